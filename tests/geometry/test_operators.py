"""Areas, normals and linear elements on a mesh: known answers, exactness on linear functions, and laws."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from geoprint.errors import MeshError
from geoprint.geometry.operators import (
    cotangent_laplacian,
    divergence,
    edge_lengths,
    face_areas,
    face_normals,
    gradient,
    lumped_mass,
    mean_normal,
    vertex_normals,
)
from geoprint.geometry.topology import boundary_loops, edges
from geoprint.model import FloatArray, IntArray, Surface
from tests import meshes

IRREGULAR = [
    meshes.plate(jitter_seed=1),
    meshes.annulus(jitter_seed=2),
    meshes.spherical_cap(jitter_seed=3),
    meshes.sphere(subdivisions=2, jitter_seed=4),
    meshes.torus(divisions=(24, 12)),
]


def values_on(surface: Surface, *, seed: int) -> FloatArray:
    return np.random.default_rng(seed).normal(size=len(surface.vertices))


def inner_vertices(surface: Surface) -> IntArray:
    rim = np.concatenate(boundary_loops(surface))
    return np.setdiff1d(np.arange(len(surface.vertices)), rim).astype(np.int64)


def laplacian(surface: Surface) -> FloatArray:
    return cotangent_laplacian(surface).toarray()


def moved(surface: Surface, *, rotation: Rotation, shift: tuple[float, ...]) -> Surface:
    return Surface(vertices=rotation.apply(surface.vertices.copy()) + np.array(shift), faces=surface.faces)


def test_areas_of_a_plate_add_up_to_its_size_however_it_is_cut() -> None:
    assert face_areas(meshes.plate(size=(40.0, 30.0))).sum() == pytest.approx(1200.0)
    assert face_areas(meshes.plate(size=(40.0, 30.0), jitter_seed=5)).sum() == pytest.approx(1200.0)


def test_the_area_of_a_fine_sphere_is_that_of_the_round_one() -> None:
    area = face_areas(meshes.sphere(radius=20.0, subdivisions=4)).sum()
    assert area == pytest.approx(4 * np.pi * 20.0**2, rel=2e-3)


def test_faces_of_a_plate_look_up_and_those_of_a_sphere_outward() -> None:
    np.testing.assert_allclose(face_normals(meshes.plate(jitter_seed=1)), [[0, 0, 1]] * 96, atol=1e-12)
    sphere = meshes.sphere(jitter_seed=1)
    centres = sphere.vertices[sphere.faces].mean(axis=1)
    outward = centres / np.linalg.norm(centres, axis=1, keepdims=True)
    assert np.einsum("mx,mx->m", face_normals(sphere), outward).min() > 0.98


def test_vertex_normals_of_a_regular_sphere_are_radial() -> None:
    sphere = meshes.sphere(radius=20.0, subdivisions=3)
    np.testing.assert_allclose(vertex_normals(sphere), sphere.vertices / 20.0, atol=0.01)


def test_vertex_normals_are_weighted_by_area() -> None:
    # At the origin a face of area 1 looks along z and one of area 3 along x.
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 2, 3]], dtype=float)
    bent = Surface(vertices=vertices, faces=np.array([[0, 1, 2], [0, 2, 3]]))
    np.testing.assert_allclose(vertex_normals(bent)[0], np.array([3, 0, 1]) / np.sqrt(10), atol=1e-12)


@pytest.mark.parametrize(
    ("surface", "length"),
    [(meshes.plate(jitter_seed=1), 1.0), (meshes.spherical_cap(angle=np.pi / 2, rings=30), 0.5), (meshes.torus(), 0.0)],
)
def test_the_mean_normal_is_as_long_as_the_part_is_flat(surface: Surface, length: float) -> None:
    assert np.linalg.norm(mean_normal(surface)) == pytest.approx(length, abs=2e-3)


def test_a_closed_surface_has_no_mean_normal_however_many_faces_round_it() -> None:
    fine = meshes.torus(divisions=(300, 200))
    np.testing.assert_array_equal(mean_normal(Surface(fine.vertices + 137.123, fine.faces)), np.zeros(3))
    # One triangle out of a closed sphere already gives it one.
    ball = meshes.sphere(subdivisions=5)
    assert np.linalg.norm(mean_normal(Surface(ball.vertices, ball.faces[1:]))) > 1e-6


def test_edge_lengths_follow_the_order_of_edges() -> None:
    cap = meshes.spherical_cap(jitter_seed=1)
    start, end = edges(cap.faces)[7]
    assert edge_lengths(cap)[7] == pytest.approx(np.linalg.norm(cap.vertices[end] - cap.vertices[start]))


def test_the_gradient_of_a_linear_function_is_its_slope_along_the_face() -> None:
    slope = np.array([0.3, -1.2, 0.7])
    cap = meshes.spherical_cap(jitter_seed=1)
    normals = face_normals(cap)
    tangent = slope - (normals @ slope)[:, None] * normals
    np.testing.assert_allclose(gradient(cap, cap.vertices @ slope), tangent, atol=1e-12)


def test_the_laplacian_of_a_linear_function_vanishes_inside_a_plate() -> None:
    plate = meshes.plate(jitter_seed=1)
    result = laplacian(plate) @ (2.0 * plate.vertices[:, 0] - 3.0 * plate.vertices[:, 1])
    np.testing.assert_allclose(result[inner_vertices(plate)], 0.0, atol=1e-12)
    assert np.abs(result).max() > 1.0


def test_the_laplacian_of_one_square_is_known() -> None:
    square = Surface(
        vertices=np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float),
        faces=np.array([[0, 1, 2], [0, 2, 3]]),
    )
    expected = np.array([[1, -0.5, 0, -0.5], [-0.5, 1, -0.5, 0], [0, -0.5, 1, -0.5], [-0.5, 0, -0.5, 1]])
    np.testing.assert_allclose(laplacian(square), expected, atol=1e-12)


@pytest.mark.parametrize("surface", IRREGULAR, ids=lambda surface: surface.name)
def test_the_laplacian_is_symmetric_semidefinite_and_annihilates_constants(surface: Surface) -> None:
    matrix = laplacian(surface)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-12)
    np.testing.assert_allclose(matrix.sum(axis=1), 0.0, atol=1e-11)
    assert np.linalg.eigvalsh(matrix).min() > -1e-10


@pytest.mark.parametrize("surface", IRREGULAR, ids=lambda surface: surface.name)
def test_the_laplacian_measures_the_energy_of_the_gradient(surface: Surface) -> None:
    values = values_on(surface, seed=0)
    energy = (face_areas(surface) * (gradient(surface, values) ** 2).sum(axis=1)).sum()
    assert values @ (laplacian(surface) @ values) == pytest.approx(energy)


@pytest.mark.parametrize("surface", IRREGULAR, ids=lambda surface: surface.name)
def test_the_divergence_of_a_gradient_is_minus_the_laplacian(surface: Surface) -> None:
    values = values_on(surface, seed=1)
    expected = -(laplacian(surface) @ values)
    np.testing.assert_allclose(divergence(surface, gradient(surface, values)), expected, atol=1e-10)


@pytest.mark.parametrize("surface", IRREGULAR, ids=lambda surface: surface.name)
def test_gauss_flow_out_of_all_vertices_is_nothing(surface: Surface) -> None:
    field = np.random.default_rng(2).normal(size=(len(surface.faces), 3))
    assert divergence(surface, field).sum() == pytest.approx(0.0, abs=1e-9)


def test_the_divergence_inside_a_plate_of_a_constant_field_is_zero_and_of_a_radial_one_twice_the_area() -> None:
    plate = meshes.plate(jitter_seed=1)
    inside = inner_vertices(plate)
    constant = np.tile([1.0, 2.0, 0.0], (len(plate.faces), 1))
    np.testing.assert_allclose(divergence(plate, constant)[inside], 0.0, atol=1e-12)
    # On a regular grid the centroids' mean is the vertex, so that sampling x at centroids is exact there.
    regular = meshes.plate()
    radial = regular.vertices[regular.faces].mean(axis=1)
    inside = inner_vertices(regular)
    np.testing.assert_allclose(divergence(regular, radial)[inside].sum(), 2 * lumped_mass(regular)[inside].sum())


def test_lumped_mass_adds_up_to_the_area() -> None:
    for surface in IRREGULAR:
        assert lumped_mass(surface).sum() == pytest.approx(face_areas(surface).sum())


@given(
    turn=st.tuples(*(st.floats(-3, 3) for _ in range(3))),
    shift=st.tuples(*(st.floats(-500, 500) for _ in range(3))),
    seed=st.integers(0, 50),
)
@settings(max_examples=20, deadline=None)
def test_a_rigid_motion_leaves_areas_and_laplacian_and_turns_normals(
    turn: tuple[float, ...], shift: tuple[float, ...], seed: int
) -> None:
    cap, rotation = meshes.spherical_cap(rings=4, jitter_seed=seed), Rotation.from_rotvec(turn)
    carried = moved(cap, rotation=rotation, shift=shift)
    np.testing.assert_allclose(face_areas(carried), face_areas(cap), rtol=1e-9)
    np.testing.assert_allclose(vertex_normals(carried), rotation.apply(vertex_normals(cap)), atol=1e-9)
    np.testing.assert_allclose(laplacian(carried), laplacian(cap), atol=1e-8)


FLAT = Surface(vertices=np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], dtype=float), faces=np.array([[0, 1, 2]]))


def slope(surface: Surface) -> FloatArray:
    return gradient(surface, np.zeros(len(surface.vertices)))


def outflow(surface: Surface) -> FloatArray:
    return divergence(surface, np.zeros((len(surface.faces), 3)))


@pytest.mark.parametrize("ask", [face_normals, laplacian, slope, outflow])
def test_a_face_without_area_is_refused_where_a_normal_is_needed(ask: Callable[[Surface], FloatArray]) -> None:
    with pytest.raises(MeshError, match=r"face 0 .* has no area"):
        ask(FLAT)


def test_a_vertex_without_faces_has_no_normal() -> None:
    plate = meshes.plate()
    padded = Surface(vertices=np.concatenate([plate.vertices, [[9.0, 9.0, 9.0]]]), faces=plate.faces)
    with pytest.raises(MeshError, match=f"vertex {len(plate.vertices)} .* has no normal"):
        vertex_normals(padded)
