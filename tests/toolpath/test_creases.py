"""Runs over sharp edges of a part: cut there, each piece on its own side, with the nozzle upright to the end."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from geoprint.distance.heat import Heat
from geoprint.geometry import arc_lengths, boundary_source, closest, face_normals, positions
from geoprint.model import FloatArray
from geoprint.toolpath import PATTERNS, arrange, posed_surface, poses
from geoprint.toolpath.creases import cut_at_creases
from geoprint.transforms import rotation_of
from tests.meshes import folded_plate
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
    pieces, places = cut_at_creases(surface, [points], closed=[closed], least=LEAST)
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


@pytest.mark.parametrize("angle", [60.0, -60.0])
def test_the_nozzle_stands_upright_up_to_an_edge_and_turns_through_a_hollow(angle: float) -> None:
    surface = folded_plate(angle)
    paths = PATTERNS["contours"]().paths(surface, boundary_source(surface), backend=Heat(surface), spacing=1.5)
    toolpath = arrange(paths, surface, speed=20.0)
    stream = poses(
        toolpath, posed_surface(surface, part=surface, body=None), R_base_work=np.eye(3), standoff=0.3, retract=5.0,
        layer_height=0.5, max_tilt=np.radians(15.0), tool=straight_cell().tool,
    )  # fmt: skip
    axes, sides = -rotation_of(stream.quaternions)[:, :, 2], face_normals(surface)[[0, -1]]
    leans = np.degrees(np.arccos(np.clip(axes[stream.deposit] @ sides.T, -1.0, 1.0))).min(axis=1)
    if angle > 0.0:
        # Every ring is two runs.
        assert len(toolpath.splits) == 2 * len(np.unique(toolpath.levels)) == 8
        assert leans.max() < 1e-6
    else:
        assert len(toolpath.splits) == 0
        assert leans.max() > 20.0
