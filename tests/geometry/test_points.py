"""Points on a surface: positions, normals and closest points, against known shapes and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import InputError, MeshError
from geoprint.geometry import PolylineDistance, direction_across, turned_over
from geoprint.geometry.points import closest, closest_in_triangles, normals, positions, vertex_points
from geoprint.model import FloatArray, Surface, SurfacePoints
from tests import meshes
from tests.meshes import plate, spherical_cap


def random_points(surface: Surface, *, count: int, seed: int) -> SurfacePoints:
    generator = np.random.default_rng(seed)
    faces = generator.integers(len(surface.faces), size=count)
    return SurfacePoints(faces=faces, weights=generator.dirichlet(np.ones(3), size=count))


def brute_force_distances(surface: Surface, xyz: FloatArray) -> FloatArray:
    corners = surface.vertices[surface.faces]
    squares = [closest_in_triangles(np.tile(point, (len(corners), 1)), corners)[1].min() for point in xyz]
    return np.sqrt(np.array(squares))


def one_triangle(point: tuple[float, float, float]) -> tuple[FloatArray, float]:
    corners = np.array([[[0, 0, 0], [4, 0, 0], [0, 4, 0]]], dtype=float)
    weights, squares = closest_in_triangles(np.array([point]), corners)
    return weights[0], float(squares[0])


def test_positions_are_the_weighted_corners() -> None:
    plate = meshes.plate()
    middle = SurfacePoints(faces=np.array([3]), weights=np.array([[0.5, 0.25, 0.25]]))
    corners = plate.vertices[plate.faces[3]]
    np.testing.assert_allclose(positions(plate, middle)[0], corners[0] / 2 + corners[1] / 4 + corners[2] / 4)


def test_normals_on_a_fine_sphere_point_away_from_its_centre_and_have_unit_length() -> None:
    sphere = meshes.sphere(subdivisions=4)
    points = random_points(sphere, count=200, seed=0)
    found, places = normals(sphere, points), positions(sphere, points)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0)
    outward = places / np.linalg.norm(places, axis=1, keepdims=True)
    assert np.einsum("kx,kx->k", found, outward).min() > 0.9995


def test_normals_agree_on_both_sides_of_an_edge() -> None:
    cap = meshes.spherical_cap(jitter_seed=1)
    face = int(np.flatnonzero((cap.faces == 0).any(axis=1))[0])
    neighbours = np.flatnonzero(np.isin(cap.faces, cap.faces[face]).sum(axis=1) == 2)
    shared = np.intersect1d(cap.faces[face], cap.faces[neighbours[0]])
    both = np.array([face, neighbours[0]])
    points = SurfacePoints(faces=both, weights=np.isin(cap.faces[both], shared) / 2)
    first, second = normals(cap, points)
    np.testing.assert_allclose(first, second, atol=1e-12)


@pytest.mark.parametrize(
    ("point", "weights", "square"),
    [
        ((1, 1, 2), (0.5, 0.25, 0.25), 4.0),  # above the inside
        ((2, -3, 0), (0.5, 0.5, 0), 9.0),  # beside an edge
        ((3, 3, 0), (0, 0.5, 0.5), 2.0),  # beside the long edge
        ((-1, -1, 1), (1, 0, 0), 3.0),  # beyond a corner
        ((7, -1, 0), (0, 1, 0), 10.0),
        ((2, 2, 0), (0, 0.5, 0.5), 0.0),  # on an edge
    ],
)
def test_the_closest_point_of_a_triangle_is_known_in_every_region(
    point: tuple[float, float, float], weights: tuple[float, float, float], square: float
) -> None:
    found, squared = one_triangle(point)
    np.testing.assert_allclose(found, weights, atol=1e-12)
    assert squared == pytest.approx(square)


def test_a_triangle_without_area_is_its_sides() -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [3, 0, 0]], [[1, 1, 1], [1, 1, 1], [1, 1, 1]]], dtype=float)
    weights, squares = closest_in_triangles(np.array([[2.0, 1.0, 0.0], [1.0, 1.0, 3.0]]), corners)
    np.testing.assert_allclose(squares, [1.0, 4.0])
    np.testing.assert_allclose(np.einsum("kc,kcx->kx", weights, corners), [[2, 0, 0], [1, 1, 1]])


def test_points_on_the_surface_find_themselves() -> None:
    cap = meshes.spherical_cap(jitter_seed=1)
    places = positions(cap, random_points(cap, count=300, seed=1))
    points, distances = closest(cap, places)
    np.testing.assert_allclose(positions(cap, points), places, atol=1e-9)
    assert distances.max() < 1e-9


def test_a_point_above_a_plate_has_its_height_as_distance() -> None:
    points, distances = closest(meshes.plate(), np.array([[11.0, 7.0, 3.0], [-4.0, 15.0, 3.0]]))
    np.testing.assert_allclose(distances, [3.0, 5.0])
    np.testing.assert_allclose(positions(meshes.plate(), points), [[11, 7, 0], [0, 15, 0]], atol=1e-12)


@given(seed=st.integers(0, 1000), spread=st.sampled_from([1.0, 20.0, 300.0]))
@settings(max_examples=15, deadline=None)
def test_closest_agrees_with_trying_every_triangle(seed: int, spread: float) -> None:
    sphere = meshes.sphere(subdivisions=2, jitter_seed=seed)
    xyz = np.random.default_rng(seed).normal(scale=spread, size=(20, 3))
    points, distances = closest(sphere, xyz)
    np.testing.assert_allclose(distances, brute_force_distances(sphere, xyz), atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(positions(sphere, points) - xyz, axis=1), distances, atol=1e-9)


def test_a_huge_triangle_among_small_ones_is_found() -> None:
    fine = meshes.plate(size=(1.0, 1.0), divisions=(20, 20))
    corners = np.array([[-500.0, -500.0, -1.0], [500.0, -500.0, -1.0], [0.0, 900.0, -1.0]])
    mixed = Surface(
        vertices=np.concatenate([fine.vertices, corners]),
        faces=np.concatenate([fine.faces, [len(fine.vertices) + np.arange(3)]]),
    )
    xyz = np.array([[0.5, 0.5, -0.9], [0.5, 0.5, -0.2], [100.0, 5.0, 0.0]])
    points, distances = closest(mixed, xyz)
    np.testing.assert_allclose(distances, [0.1, 0.2, 1.0])
    np.testing.assert_array_equal(points.faces == len(fine.faces), [True, False, True])


def test_no_positions_have_no_closest_points() -> None:
    points, distances = closest(meshes.plate(), np.empty((0, 3)))
    assert points.faces.size == distances.size == 0


def test_vertices_are_found_in_a_face_that_uses_them() -> None:
    cap = meshes.spherical_cap()
    every = np.arange(len(cap.vertices))
    np.testing.assert_allclose(positions(cap, vertex_points(cap, every)), cap.vertices)


def test_a_vertex_is_placed_in_its_first_face() -> None:
    plate = meshes.plate()
    vertex = 20
    points = vertex_points(plate, np.array([vertex]))
    assert points.faces[0] == np.flatnonzero((plate.faces == vertex).any(axis=1))[0]


@pytest.mark.parametrize("xyz", [np.zeros(3), np.zeros((2, 2)), np.array([[0.0, np.nan, 0.0]])])
def test_closest_refuses_positions_that_are_none(xyz: FloatArray) -> None:
    with pytest.raises(InputError, match="finite positions of shape"):
        closest(meshes.plate(), xyz)


def test_vertices_that_do_not_exist_or_lie_off_the_surface_are_refused() -> None:
    plate = meshes.plate()
    for wrong in (-1, len(plate.vertices)):
        with pytest.raises(InputError, match="asked for"):
            vertex_points(plate, np.array([0, wrong]))
    padded = Surface(vertices=np.concatenate([plate.vertices, [[0.0, 0.0, 9.0]]]), faces=plate.faces)
    with pytest.raises(InputError, match="belongs to no face"):
        vertex_points(padded, np.array([len(plate.vertices)]))


def test_points_of_another_surface_are_refused() -> None:
    fine = meshes.plate(divisions=(30, 30))
    points = random_points(fine, count=50, seed=0)
    for ask in (positions, normals):
        with pytest.raises(InputError, match="points belong to the surface they were made on"):
            ask(meshes.plate(), points)


def test_corner_normals_that_cancel_out_are_refused() -> None:
    # A narrow wall stands between a large floor that looks up and a large roof that looks down.
    vertices = np.array([[0, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4], [9, 9, 0], [-9, 9, 0], [-9, 9, 1e-4], [9, 9, 1e-4]])
    folded = Surface(vertices=vertices, faces=np.array([[0, 1, 2], [0, 3, 4], [2, 5, 6]]))
    between = SurfacePoints(faces=np.array([0]), weights=np.array([[0.5, 0.0, 0.5]]))
    with pytest.raises(MeshError, match="normals at the corners of face 0 cancel out"):
        normals(folded, between)
    on_floor = SurfacePoints(faces=np.array([0]), weights=np.array([[1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(normals(folded, on_floor), [[0, 0, 1]], atol=1e-6)


# Directions across a mean normal: where they are counted from, and which way.


def test_angles_count_counter_clockwise_seen_from_outside_from_x() -> None:
    level = plate((4.0, 3.0))
    np.testing.assert_allclose(direction_across(level, angle=0.0), [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(direction_across(level, angle=np.pi / 2.0), [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(direction_across(turned_over(level), angle=np.pi / 2.0), [0.0, -1.0, 0.0], atol=1e-12)


def test_where_the_mean_normal_is_nearly_x_the_y_axis_stands_in_for_it() -> None:
    level = plate((4.0, 3.0))
    upright = Surface(level.vertices[:, [2, 0, 1]], level.faces)
    np.testing.assert_allclose(direction_across(upright, angle=0.0), [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(direction_across(upright, angle=np.pi / 2.0), [0.0, 0.0, 1.0], atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1.0, -2.0])
def test_a_direction_is_of_unit_length_and_square_to_the_mean_normal(angle: float) -> None:
    cap = spherical_cap(radius=10.0, angle=0.9, rings=8)
    tilt = np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]])
    found = direction_across(Surface(cap.vertices @ tilt.T, cap.faces), angle=angle)
    assert np.linalg.norm(found) == pytest.approx(1.0)
    assert found @ tilt @ [0.0, 0.0, 1.0] == pytest.approx(0.0, abs=1e-9)


# Distances to polylines, corners included.


def brute_force(points: FloatArray, line: FloatArray) -> FloatArray:
    start, along = line[:-1], np.diff(line, axis=0)
    share = np.einsum("kij,ij->ki", points[:, None] - start, along) / np.einsum("ij,ij->i", along, along)
    nearest = start + np.clip(share, 0, 1)[..., None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


@pytest.mark.parametrize("step", [0.3, 0.7, 5.0])
def test_the_distance_to_a_corner_is_not_that_to_a_cut_corner(step: float) -> None:
    line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    assert PolylineDistance([line], step=step)(np.array([[2.0, -1.0, 0.0]])) == pytest.approx(np.sqrt(2.0), abs=1e-12)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), step=st.floats(0.02, 0.2))
def test_distances_to_random_walks_are_exact(seed: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    line = np.cumsum(rng.normal(size=(12, 3)), axis=0)
    points = rng.uniform(-5.0, 5.0, size=(40, 3))
    np.testing.assert_allclose(PolylineDistance([line], step=step)(points), brute_force(points, line), atol=1e-12)
