"""Normals at the rim: right to second order where a part is smooth, and those of its faces where it is not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from geoprint.geometry import boundary_loops, part_of, prepare, turned_over, vertex_normals
from geoprint.geometry.files import load
from geoprint.layers.feet import rim_normals
from geoprint.model import FloatArray, Surface
from tests import meshes
from tests.shared_data import shared

# A cap and a cylinder of radius 1 with edges of a length, and where their normals point.
SMOOTH: list[tuple[Callable[[float], Surface], FloatArray]] = [
    (lambda edge: meshes.spherical_cap(radius=1.0, angle=0.8, rings=round(0.8 / edge), jitter_seed=3), np.ones(3)),
    (
        lambda edge: meshes.cylinder_patch(
            radius=1.0, angle=1.4, length=1.0, divisions=(round(1.4 / edge), round(1.0 / edge)), jitter_seed=3
        ),
        np.array([1.0, 0.0, 1.0]),
    ),
]


def _errors(part: Surface, away: FloatArray) -> tuple[float, float]:
    """Return the largest angle [rad] off the true normals, of the rim's and of the mean of its faces'."""
    (loop,) = boundary_loops(part)
    true = part.vertices[loop] * away
    true /= np.linalg.norm(true, axis=1)[:, None]
    found = (rim_normals(part, loop), vertex_normals(part)[loop])
    return tuple(float(np.linalg.norm(np.cross(each, true), axis=1).max()) for each in found)  # pyright: ignore[reportReturnType]


@pytest.mark.parametrize(("make", "away"), SMOOTH)
def test_where_a_part_is_smooth_the_error_falls_with_more_than_the_square_of_the_edge(
    make: Callable[[float], Surface], away: FloatArray
) -> None:
    coarse, fine = (_errors(make(edge), away) for edge in (0.2, 0.05))
    # The mean of the faces is of first order: a quarter of the edge, a quarter of the error.
    assert coarse[1] / fine[1] == pytest.approx(4.0, rel=0.2)
    assert coarse[0] / fine[0] > 4.0**2
    assert coarse[0] < 0.1 * coarse[1]


@pytest.mark.parametrize(("make", "away"), SMOOTH)
def test_turned_over_the_normals_are_turned_over(make: Callable[[float], Surface], away: FloatArray) -> None:
    part = make(0.1)
    (loop,) = boundary_loops(part)
    back = rim_normals(turned_over(part), loop[::-1])[::-1]
    np.testing.assert_allclose(back, -rim_normals(part, loop), atol=1e-9)
    assert away.size == 3


def test_over_a_plate_they_are_exact_at_its_corners_too() -> None:
    part = meshes.plate((12.0, 8.0), (6, 4), jitter_seed=5)
    (loop,) = boundary_loops(part)
    np.testing.assert_allclose(rim_normals(part, loop), np.tile([0.0, 0.0, 1.0], (len(loop), 1)), atol=1e-12)


def test_a_part_of_two_triangles_has_those_of_its_faces() -> None:
    part = Surface(np.array([[0.0, 0, 0], [4, 0, 1], [4, 3, 0], [0, 3, 1]]), np.array([[0, 1, 2], [0, 2, 3]]))
    (loop,) = boundary_loops(part)
    np.testing.assert_allclose(rim_normals(part, loop), vertex_normals(part)[loop])


@pytest.mark.parametrize("strips", [1, 2, 3])
@pytest.mark.parametrize("fold_deg", [8.0, 20.0, 38.0, 60.0])
def test_a_fold_beside_the_rim_does_not_turn_them(fold_deg: float, strips: int) -> None:
    flat = meshes.plate((12.0, 20.0), (12, 20))
    beyond = np.maximum(strips - flat.vertices[:, 0], 0.0)
    slope = np.radians(fold_deg)
    vertices = flat.vertices + np.column_stack([beyond * (1.0 - np.cos(slope)), 0 * beyond, -beyond * np.sin(slope)])
    part = Surface(vertices, flat.faces)
    (loop,) = boundary_loops(part)
    # In the middle of the folded side; at its ends the rim meets the fold.
    side = np.flatnonzero((flat.vertices[loop, 0] == 0.0) & (np.abs(flat.vertices[loop, 1] - 10.0) < 6.0))
    found = rim_normals(part, loop)[side]
    np.testing.assert_allclose(found, np.tile([-np.sin(slope), 0.0, np.cos(slope)], (len(side), 1)), atol=1e-9)


@pytest.mark.parametrize("name", ["lv_lateral_disc_r15", "lv_anterior_annulus_r25_hole_r7", "lv_lateral_rect_40x30"])
def test_at_a_rim_cut_into_a_heart_they_are_nearer_to_those_of_the_whole(name: str) -> None:
    whole = prepare(load(shared(f"patches/{name}.ply"), unit="mm"))[0]
    rim = np.concatenate(boundary_loops(whole))
    inner = np.array([not np.isin(face, rim).any() for face in whole.faces])
    part = part_of(whole, inner)
    upright = {tuple(place): normal for place, normal in zip(whole.vertices, vertex_normals(whole), strict=True)}
    off: list[FloatArray] = []
    for loop in boundary_loops(part):
        true = np.array([upright[tuple(place)] for place in part.vertices[loop]])
        along = part.vertices[np.roll(loop, -1)] - part.vertices[np.roll(loop, 1)]
        along /= np.linalg.norm(along, axis=1)[:, None]
        found = (rim_normals(part, loop), vertex_normals(part)[loop])
        off.append(np.array([np.abs(np.einsum("rx,rx->r", np.cross(each, true), along)) for each in found]))
    angles = np.concatenate(off, axis=1)
    assert np.median(angles[0]) < 0.6 * np.median(angles[1])
    assert np.percentile(angles[0], 95) < np.percentile(angles[1], 95)
