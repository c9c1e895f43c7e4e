"""The heat method: known distances, seeds inside the surface, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array, eye_array

from geoprint.backends.heat import Heat, held_vertices
from geoprint.backends.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.errors import FieldError, UsageError
from geoprint.model import Seed, Surface, SurfaceCurves, SurfacePoints
from geoprint.surfaces import boundary_seed, cotangent_laplacian, point_seed
from tests.meshes import disc, plate, sphere, spherical_cap


def test_distance_from_the_rim_of_a_cap_is_the_arc() -> None:
    radius, angle = 30.0, 1.0
    surface = spherical_cap(radius=radius, angle=angle, rings=60, jitter_seed=1)
    found = Heat(surface).distance(boundary_seed(surface)).values
    polar = np.arccos(np.clip(surface.vertices[:, 2] / radius, -1, 1))
    np.testing.assert_allclose(found, radius * (angle - polar), atol=0.6)


def test_distance_from_a_point_of_a_sphere_is_the_great_circle() -> None:
    surface = sphere(radius=20.0, subdivisions=5)
    pole = np.array([0.3, 0.2, 20.0])
    found = Heat(surface).distance(point_seed(surface, pole, tolerance=1.0)).values
    angle = np.arccos(np.clip(surface.vertices @ pole / np.linalg.norm(pole) / 20.0, -1, 1))
    assert np.abs(found - 20.0 * angle).mean() < 0.4


def test_vertices_of_the_seed_are_held_at_zero_and_no_other() -> None:
    surface = disc(rings=6)
    held, distances = held_vertices(surface, boundary_seed(surface))
    assert held.size == 36
    np.testing.assert_array_equal(distances, 0.0)


def test_a_seed_inside_a_triangle_holds_its_corners_at_their_straight_distance() -> None:
    surface = plate((4.0, 4.0), (2, 2))
    seed = Seed(
        SurfaceCurves(
            SurfacePoints(np.array([0]), np.array([[1 / 3, 1 / 3, 1 / 3]])), np.array([0, 1]), np.array([False])
        )
    )
    held, distances = held_vertices(surface, seed)
    corners = surface.vertices[surface.faces[0]]
    assert sorted(held.tolist()) == sorted(surface.faces[0].tolist())
    wanted = np.linalg.norm(surface.vertices[held] - corners.mean(axis=0), axis=1)
    np.testing.assert_allclose(distances, wanted, atol=1e-12)


def test_a_seed_curve_across_a_triangle_holds_its_corners_at_their_distance_from_the_curve() -> None:
    surface = Surface(np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, 0]]), np.array([[0, 1, 2], [1, 3, 2]]))
    # From (2, 0) to (0, 2) across the first triangle.
    points = SurfacePoints(np.array([0, 0]), np.array([[0.5, 0.5, 0.0], [0.5, 0.0, 0.5]]))
    held, distances = held_vertices(surface, Seed(SurfaceCurves(points, np.array([0, 2]), np.array([False]))))
    assert held.tolist() == [0, 1, 2]
    np.testing.assert_allclose(distances, [np.sqrt(2.0), 2.0, 2.0], atol=1e-12)


def test_a_seed_that_holds_every_vertex_is_refused() -> None:
    surface = Surface(np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]]), np.array([[0, 1, 2]]))
    with pytest.raises(FieldError, match="every vertex"):
        Heat(surface).distance(boundary_seed(surface))


def test_heat_that_does_not_arrive_is_an_error_and_not_a_zero() -> None:
    surface = plate((3000.0, 2.0), (1500, 1))
    end = point_seed(surface, np.array([0.0, 0.0, 0.0]), tolerance=1.0)
    with pytest.raises(FieldError, match="heat does not reach"):
        Heat(surface, time_factor=0.05).distance(end)


def test_a_time_factor_that_is_not_positive_is_refused() -> None:
    with pytest.raises(UsageError, match="time_factor"):
        Heat(plate(), time_factor=0.0)


def test_the_elimination_order_is_a_permutation_that_saves_fill() -> None:
    surface = plate((40.0, 40.0), (60, 60))
    matrix = csc_array(cotangent_laplacian(surface) + 0.1 * eye_array(len(surface.vertices)))
    order = nested_dissection(matrix, coordinates=surface.vertices)
    assert sorted(order.tolist()) == list(range(len(surface.vertices)))


def test_the_solver_solves() -> None:
    surface = plate((40.0, 40.0), (20, 20), jitter_seed=1)
    matrix = csc_array(cotangent_laplacian(surface) + 0.1 * eye_array(len(surface.vertices)))
    order = nested_dissection(matrix, coordinates=surface.vertices)
    wanted = np.random.default_rng(0).normal(size=len(surface.vertices))
    found = SymmetricSolver(matrix, order=order).solve(np.asarray(matrix @ wanted))
    np.testing.assert_allclose(found, wanted, atol=1e-10)


def test_a_singular_system_is_refused() -> None:
    with pytest.raises(FieldError, match="singular"):
        SymmetricSolver(csc_array((3, 3)), order=np.arange(3))
