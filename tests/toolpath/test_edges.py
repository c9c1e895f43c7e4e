"""Runs over sharp edges of a part: cut there, each piece on its own side, with the nozzle upright to the end."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from geoprint.distance.heat import Heat
from geoprint.geometry import arc_lengths, boundary_source, closest, face_normals, positions
from geoprint.model import FloatArray, PoseStream, Surface, Toolpath
from geoprint.toolpath import PATTERNS, arrange, posed_surface, poses
from geoprint.toolpath.edges import cut_at_edges
from geoprint.transforms import rotation_of
from tests.meshes import bent_plate, folded_plate, plate
from tests.robot.cells import straight_cell

LEAST = 1.0
STEP = 0.3


def line(*corners: tuple[float, float], angle: float) -> FloatArray:
    """Return samples along a polyline on the plate as it was before it was folded [mm]."""
    legs = [
        np.linspace(start, end, int(np.hypot(*np.subtract(end, start)) / STEP) + 2)[:-1]
        for start, end in pairwise(corners)
    ]
    flat = np.vstack([*legs, [corners[-1]]])
    beyond = np.maximum(flat[:, 0], 0.0)
    x = np.minimum(flat[:, 0], 0.0) + beyond * np.cos(np.radians(angle))
    return np.column_stack([x, flat[:, 1], -beyond * np.sin(np.radians(angle))])


def cut(
    *corners: tuple[float, float], angle: float = 90.0, closed: bool = False
) -> tuple[list[FloatArray], FloatArray]:
    """Return the places of the pieces of one run, and where it was cut; no piece of several lies on both sides."""
    surface = folded_plate(angle)
    points, _ = closest(surface, line(*corners, angle=angle))
    pieces, places = cut_at_edges(surface, [points], closed=[closed], least=LEAST)
    assert [piece.closed for piece in pieces] == [closed and len(places) == 0] * len(pieces)
    if len(places):
        normals = face_normals(surface)
        assert all((normals[piece.points.faces] @ normals[piece.points.faces[0]] > 0.99).all() for piece in pieces)
    return [positions(surface, piece.points) for piece in pieces], places


def length(places: FloatArray) -> float:
    return float(arc_lengths(places)[-1])


@pytest.mark.parametrize(("start", "end", "at"), [(-5.0, 5.0, 2.0), (-7.03, 4.0, 2.0), (-4.0, 8.0, 3.0)])
def test_a_run_over_an_edge_ends_and_begins_where_it_crosses_it(start: float, end: float, at: float) -> None:
    slope = (at - 2.0) / 4.0
    (before, behind), places = cut((start, at + slope * start), (end, at + slope * end))
    np.testing.assert_allclose(places, [[0.0, at, 0.0]], atol=1e-9)
    np.testing.assert_allclose([before[-1], behind[0]], [places[0]] * 2, atol=1e-9)
    assert length(before) == pytest.approx(-start * np.hypot(1.0, slope))
    assert length(behind) == pytest.approx(end * np.hypot(1.0, slope))


def test_a_ring_over_an_edge_becomes_two_runs_from_edge_to_edge() -> None:
    pieces, places = cut((-3.0, -2.0), (4.0, -2.0), (4.0, 2.5), (-3.0, 2.5), (-3.0, -2.0), closed=True)
    np.testing.assert_allclose(places, [[0.0, -2.0, 0.0], [0.0, 2.5, 0.0]], atol=1e-9)
    np.testing.assert_allclose([piece[[0, -1]] for piece in pieces], [places, places[::-1]], atol=1e-9)
    assert [length(piece) for piece in pieces] == pytest.approx([4.0 + 4.5 + 4.0, 3.0 + 4.5 + 3.0])


def test_a_run_that_meets_its_seam_at_the_edge_is_cut_there_once() -> None:
    pieces, places = cut((0.0, -2.0), (4.0, -2.0), (4.0, 2.5), (-3.0, 2.5), (-3.0, -2.0), (0.0, -2.0), closed=True)
    assert sorted(np.round(places[:, 1], 9).tolist()) == [-2.0, 2.5]
    assert sum(map(length, pieces)) == pytest.approx(23.0)


@pytest.mark.parametrize(("angle", "cuts"), [(39.0, 0), (41.0, 1), (150.0, 1), (-90.0, 0)])
def test_edges_count_from_forty_degrees_on_and_hollows_never(angle: float, cuts: int) -> None:
    pieces, places = cut((-5.0, 1.0), (5.0, 1.0), angle=angle)
    assert (len(pieces), len(places)) == (cuts + 1, cuts)


@pytest.mark.parametrize(
    "corners",
    [
        ((-5.0, 1.0), (0.9, 1.0)),
        ((-5.0, -3.0), (0.3, -3.0), (-0.3, -2.4), (0.3, -1.8), (-5.0, 1.0)),
        ((-5.0, 1.0), (-0.01, 1.0), (-0.01, 5.0)),
    ],
    ids=["near its end", "trembling along it", "beside it"],
)  # fmt: skip
def test_what_is_not_worth_a_run_stays_whole(corners: tuple[tuple[float, float], ...]) -> None:
    pieces, places = cut(*corners)
    assert (len(pieces), len(places)) == (1, 0)


def over_bend(radius: float, *, seam: int = 0) -> tuple[FloatArray, list[FloatArray]]:
    """Return how far from the middle of a bend a ring over it is cut [mm], and the pieces."""
    surface, flat = bent_plate(60.0, radius=radius), plate((20.0, 12.0), (200, 12))
    ring = line((-3.0, -2.0), (4.0, -2.0), (4.0, 2.5), (-3.0, 2.5), (-3.0, -2.0), angle=0.0)
    ring = np.vstack([ring[seam:-1], ring[: seam + 1]])
    points, _ = closest(flat, ring + np.array([10.0, 6.0, 0.0]))
    pieces, places = cut_at_edges(surface, [points], closed=[True], least=LEAST)
    where, _ = closest(surface, places) if len(places) else (points[[]], None)
    return positions(flat, where)[:, 0] - 10.0, [positions(surface, piece.points) for piece in pieces]


@pytest.mark.parametrize("radius", [0.25, 0.5, 1.0])
@pytest.mark.parametrize("seam", [0, 10, 11])
def test_a_ring_is_cut_in_the_middle_of_an_edge_that_is_rounded_but_little(radius: float, seam: int) -> None:
    off, pieces = over_bend(radius, seam=seam)
    assert len(pieces) == len(off) == 2
    assert np.abs(off).max() < 0.1
    assert sum(map(length, pieces)) == pytest.approx(23.0, abs=0.1)


def test_a_wide_bend_is_passed() -> None:
    off, pieces = over_bend(3.0)
    assert (len(off), len(pieces)) == (0, 1)


def posed(surface: Surface) -> tuple[Toolpath, PoseStream]:
    paths = PATTERNS["contours"]().paths(surface, boundary_source(surface), backend=Heat(surface), spacing=1.5)
    toolpath = arrange(paths, surface, speed=20.0)
    return toolpath, poses(
        toolpath, posed_surface(surface, part=surface, body=None), R_base_work=np.eye(3), standoff=0.3, retract=5.0,
        layer_height=0.5, max_tilt=np.radians(15.0), tool=straight_cell().tool,
    )  # fmt: skip


def leans(surface: Surface, stream: PoseStream) -> FloatArray:
    """Return how far the nozzle leans on deposit from the normal of the nearer of two plates [degrees]."""
    axes, sides = -rotation_of(stream.quaternions)[:, :, 2], face_normals(surface)[[0, -1]]
    return np.degrees(np.arccos(np.clip(axes[stream.deposit] @ sides.T, -1.0, 1.0))).min(axis=1)


def test_the_nozzle_stands_upright_up_to_an_edge() -> None:
    surface = folded_plate(60.0)
    toolpath, stream = posed(surface)
    # Every ring is two runs.
    assert len(toolpath.splits) == 2 * len(np.unique(toolpath.levels)) == 8
    assert leans(surface, stream).max() < 1e-6


def test_the_nozzle_turns_but_little_before_an_edge_that_is_all_but_sharp() -> None:
    surface = bent_plate(60.0, radius=0.2)
    toolpath, stream = posed(surface)
    assert len(toolpath.splits) == 8
    assert leans(surface, stream).max() < 5.0


def test_the_nozzle_turns_through_a_hollow() -> None:
    surface = folded_plate(-60.0)
    toolpath, stream = posed(surface)
    assert len(toolpath.splits) == 0
    assert leans(surface, stream).max() > 20.0
