"""Intrinsic triangulations: what flips keep, what they reach, and where they must stop."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.distance.intrinsic import IntrinsicTriangulation, delaunay, doubled_areas, intrinsic_triangulation
from geoprint.errors import InputError, MeshError, UsageError
from geoprint.geometry import face_areas, twins
from geoprint.geometry.files import load
from geoprint.model import FloatArray, Surface
from tests.meshes import plate, sphere, spherical_cap, torus
from tests.shared_data import shared


def corner_angles(triangulation: IntrinsicTriangulation) -> FloatArray:
    side, right, left = (np.roll(triangulation.lengths, shift, axis=1) for shift in (-1, 0, 1))
    # The side opposite to corner i runs from corner i + 1 to corner i + 2.
    cosine = (right**2 + left**2 - side**2) / (2 * right * left)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)), dtype=np.float64)


def cone_angles(triangulation: IntrinsicTriangulation) -> FloatArray:
    angles = corner_angles(triangulation)
    return np.bincount(triangulation.corners.ravel(), angles.ravel(), minlength=triangulation.vertex_count).astype(
        np.float64
    )


def opposite_sums(triangulation: IntrinsicTriangulation) -> FloatArray:
    """Return the sum of the angles opposite to each inner edge."""
    opposite = np.roll(corner_angles(triangulation), -2, axis=1).ravel()
    inner = triangulation.twins.ravel() >= 0
    return opposite[inner] + opposite[triangulation.twins.ravel()[inner]]


def stretched(surface: Surface, factor: float) -> Surface:
    return Surface(surface.vertices * [factor, 1.0, 1.0], surface.faces, name="stretched")


def square_with_the_long_diagonal() -> Surface:
    """Return a kite whose diagonal along x is 8 mm and the other 2 mm; the mesh has the long one."""
    return Surface(np.array([[-4.0, 0, 0], [0, -1, 0], [4, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))


def sharp_cone(sides: int) -> Surface:
    """Return a cone of few sides, cut off askew, whose tip has little angle."""
    turn = 2 * np.pi * np.arange(sides) / sides
    rim = np.column_stack([np.cos(turn), np.sin(turn), 30.0 * np.arange(sides) / sides])
    vertices = np.concatenate([rim, [[0, 0, 40.0], [0, 0, 0]]])
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = np.concatenate(
        [np.column_stack([i, j, np.full(sides, sides)]), np.column_stack([j, i, np.full(sides, sides + 1)])]
    )
    return Surface(vertices, faces, name="cone")


SURFACES = {
    "cap": spherical_cap(rings=12, jitter_seed=3),
    "stretched cap": stretched(spherical_cap(rings=12, jitter_seed=3), 8.0),
    "stretched plate": stretched(plate((4.0, 30.0), (12, 9), jitter_seed=1), 20.0),
    "torus": torus(divisions=(40, 6)),
    "sphere": sphere(subdivisions=2, jitter_seed=2),
    "cone of three sides": sharp_cone(3),
    "cone of seven sides": sharp_cone(7),
}
every_surface = pytest.mark.parametrize("surface", SURFACES.values(), ids=list(SURFACES))


@every_surface
def test_the_mesh_as_it_is_keeps_its_faces_lengths_and_neighbours(surface: Surface) -> None:
    found = intrinsic_triangulation(surface)
    np.testing.assert_array_equal(found.corners, surface.faces)
    np.testing.assert_array_equal(found.twins.ravel(), twins(surface.faces))
    np.testing.assert_allclose(doubled_areas(found), 2 * face_areas(surface), rtol=1e-9)
    ends = surface.vertices[np.roll(surface.faces, -1, axis=1)] - surface.vertices[surface.faces]
    np.testing.assert_allclose(found.lengths, np.linalg.norm(ends, axis=2), rtol=1e-12)


def test_the_long_diagonal_of_a_kite_becomes_the_short_one() -> None:
    found = delaunay(intrinsic_triangulation(square_with_the_long_diagonal()))
    assert found.lengths.min() == pytest.approx(2.0, abs=1e-14)
    shared_side = found.twins >= 0
    np.testing.assert_allclose(found.lengths[shared_side], 2.0)
    assert {frozenset(pair) for pair in (found.corners[0], found.corners[1])} == {
        frozenset((0, 1, 3)),
        frozenset((1, 2, 3)),
    }


@every_surface
def test_after_the_flips_every_inner_edge_is_locally_delaunay(surface: Surface) -> None:
    assert opposite_sums(delaunay(intrinsic_triangulation(surface))).max() <= np.pi + 1e-7


@every_surface
def test_flips_keep_the_area_and_the_angle_around_every_vertex(surface: Surface) -> None:
    before = intrinsic_triangulation(surface)
    after = delaunay(before)
    assert doubled_areas(after).sum() == pytest.approx(doubled_areas(before).sum(), rel=1e-10)
    np.testing.assert_allclose(cone_angles(after), cone_angles(before), atol=1e-7)


@every_surface
def test_flips_keep_the_border_and_glue_each_side_to_one_of_its_length(surface: Surface) -> None:
    before = intrinsic_triangulation(surface)
    after = delaunay(before)
    sides, other = after.lengths.ravel(), after.twins.ravel()
    inner = np.flatnonzero(other >= 0)
    np.testing.assert_array_equal(sides[inner], sides[other[inner]])
    start, end = after.corners.ravel(), np.roll(after.corners, -1, axis=1).ravel()
    np.testing.assert_array_equal(start[inner], end[other[inner]])
    for one in (before, after):
        assert (one.twins < 0).sum() == (before.twins < 0).sum()
    np.testing.assert_allclose(np.sort(sides[other < 0]), np.sort(before.lengths[before.twins < 0]), rtol=0.0, atol=0.0)


def test_a_sharp_cone_ends_with_a_triangle_that_is_its_own_neighbour() -> None:
    found = delaunay(intrinsic_triangulation(sharp_cone(7)))
    face_of_twin = found.twins // 3
    assert (face_of_twin == np.arange(len(found.corners))[:, None]).any()
    assert opposite_sums(found).max() <= np.pi + 1e-7


def test_plane_vertices_get_the_triangles_of_their_delaunay_triangulation() -> None:
    surface = stretched(plate((4.0, 30.0), (12, 9), jitter_seed=1), 20.0)
    found = delaunay(intrinsic_triangulation(surface))
    a, b, c = (surface.vertices[found.corners[:, corner], :2] for corner in range(3))
    for corner, face_corners in ((a, (b, c)), (b, (c, a))):
        side = np.linalg.norm(face_corners[0] - corner, axis=1)
        np.testing.assert_allclose(side, found.lengths[:, 0 if corner is a else 1], rtol=1e-9)
    # No vertex lies inside the circle around a triangle.
    for p, q, r in zip(a, b, c, strict=True):
        centre = np.linalg.solve(2 * np.array([q - p, r - p]), [q @ q - p @ p, r @ r - p @ p])
        radius = np.linalg.norm(p - centre)
        assert np.linalg.norm(surface.vertices[:, :2] - centre, axis=1).min() >= radius * (1 - 1e-9)


def test_a_triangle_without_area_is_flipped_away() -> None:
    surface = Surface(
        np.array([[-1.0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 2, 0], [0, -2, 0]]),
        np.array([[0, 1, 2], [0, 2, 3], [1, 0, 4], [2, 1, 4]]),
    )
    before = intrinsic_triangulation(surface)
    assert doubled_areas(before).min() == 0.0
    assert doubled_areas(delaunay(before)).min() > 0.9


def test_a_margin_leaves_edges_that_are_only_slightly_wrong() -> None:
    before = intrinsic_triangulation(SURFACES["stretched plate"])
    found = delaunay(before, margin=0.5)
    assert np.pi < opposite_sums(found).max() <= np.pi + 0.5 + 1e-7
    assert opposite_sums(before).max() > np.pi + 0.5


def test_only_edges_opposite_to_a_wide_angle_are_flipped_when_so_asked() -> None:
    before = intrinsic_triangulation(SURFACES["stretched plate"])
    found = delaunay(before, widest=2.5)
    opposite = np.roll(corner_angles(found), -2, axis=1).ravel()
    inner = np.flatnonzero(found.twins.ravel() >= 0)
    bad = opposite[inner] + opposite[found.twins.ravel()[inner]] > np.pi + 1e-7
    wide = np.maximum(opposite[inner], opposite[found.twins.ravel()[inner]]) > 2.5 + 1e-7
    assert bad.any()
    assert not (bad & wide).any()


@settings(max_examples=20, deadline=None)
@given(factor=st.floats(0.05, 20.0), seed=st.integers(0, 1000))
def test_any_stretch_of_a_plate_ends_delaunay_with_its_area(factor: float, seed: int) -> None:
    before = intrinsic_triangulation(stretched(plate((10.0, 8.0), (9, 7), jitter_seed=seed), factor))
    after = delaunay(before)
    assert opposite_sums(after).max() <= np.pi + 1e-7
    assert doubled_areas(after).sum() == pytest.approx(2 * 80.0 * factor, rel=1e-9)


def test_the_sliver_patch_keeps_its_area_and_loses_its_slivers() -> None:
    before = intrinsic_triangulation(load(shared("patches/lv_lateral_disc_r20_slivers.ply"), unit="mm"))
    after = delaunay(before)
    assert doubled_areas(after).sum() == pytest.approx(doubled_areas(before).sum(), rel=1e-9)
    slivers = [int((corner_angles(one).max(axis=1) > 2.8).sum()) for one in (before, after)]
    assert slivers[1] < 0.2 * slivers[0]
    assert opposite_sums(after).max() <= np.pi + 1e-6


def test_an_edge_with_three_faces_is_refused() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])
    with pytest.raises(MeshError, match="vertices 0 and 1"):
        intrinsic_triangulation(Surface(vertices, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])))


def test_neighbours_wound_against_each_other_are_refused() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0]])
    with pytest.raises(MeshError, match="with opposite winding"):
        intrinsic_triangulation(Surface(vertices, np.array([[0, 1, 2], [0, 1, 3]])))


def test_corners_at_the_same_place_are_refused() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0]])
    with pytest.raises(MeshError, match="same point"):
        intrinsic_triangulation(Surface(vertices, np.array([[0, 1, 2]])))


@pytest.mark.parametrize(
    ("corner", "lengths", "twin", "message"),
    [
        (3, (3.0, 4.0, 5.0), -1, "refers to vertex 3"),
        (2, (3.0, 4.0, 0.0), -1, "positive length"),
        (2, (3.0, 4.0, 8.0), -1, "do not close"),
        (2, (3.0, 4.0, 5.0), 1, "twin of the twin"),
        (2, (3.0, 4.0, 5.0), -2, "twin of the twin"),
    ],
)
def test_what_is_no_triangulation_is_refused(
    corner: int, lengths: tuple[float, float, float], twin: int, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        IntrinsicTriangulation(np.array([[0, 1, corner]]), np.array([lengths]), np.array([[twin, -1, -1]]), 3)


@pytest.mark.parametrize("angles", [{"margin": 0.0}, {"margin": 1.6}, {"widest": -0.1}, {"widest": 3.2}])
def test_angles_outside_their_range_are_refused(angles: dict[str, float]) -> None:
    with pytest.raises(UsageError, match="rad"):
        delaunay(intrinsic_triangulation(plate()), **angles)
