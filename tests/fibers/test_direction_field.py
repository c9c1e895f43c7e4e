"""A field of directions: what is measured of it, how it passes over sides, and what is no field."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import InputError, MeshError, UsageError
from geoprint.fibers import SYMMETRIES, DirectionField, Singularities, nearest_field
from geoprint.fibers.fields import angles_in_faces, connection
from geoprint.geometry import closest, euler_characteristic
from geoprint.model import FloatArray, Surface, SurfacePoints
from tests import meshes
from tests.fibers.fields_measures import turns_around

SURFACES = [
    meshes.plate(jitter_seed=1),
    meshes.disc(jitter_seed=1),
    meshes.annulus(jitter_seed=2),
    meshes.sphere(subdivisions=2, jitter_seed=3),
    meshes.torus(divisions=(24, 12)),
]


def along(surface: Surface, vectors: FloatArray, *, symmetry: int) -> DirectionField:
    """Return the field along (m, 3) vectors."""
    return nearest_field(surface, angles_in_faces(surface, np.arange(len(surface.faces)), vectors), symmetry=symmetry)


def any_field(surface: Surface, *, symmetry: int, seed: int = 0) -> DirectionField:
    """Return a field without rhyme or reason."""
    angles = np.random.default_rng(seed).uniform(-10.0, 10.0, len(surface.faces))
    return nearest_field(surface, angles, symmetry=symmetry)


@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: surface.name)
def test_the_curvature_of_all_vertices_is_that_of_gauss_and_bonnet(surface: Surface) -> None:
    assert connection(surface).curvature.sum() == pytest.approx(2 * np.pi * euler_characteristic(surface), abs=1e-9)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: surface.name)
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 1000))
def test_indices_and_turnings_of_any_field_add_up_to_the_euler_characteristic(
    surface: Surface, symmetry: int, seed: int
) -> None:
    field = any_field(surface, symmetry=symmetry, seed=seed)
    total = field.singularities().indices.sum() + field.turnings().sum()
    assert total == pytest.approx(euler_characteristic(surface), abs=1e-12)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_indices_are_those_of_the_unfolded_fans(symmetry: int) -> None:
    field = any_field(meshes.sphere(subdivisions=1, jitter_seed=4), symmetry=symmetry)
    again = turns_around(field)
    found = dict(zip(field.singularities().vertices.tolist(), field.singularities().indices.tolist(), strict=True))
    assert len(found) > 10
    assert {vertex: found.get(vertex, 0.0) for vertex in again} == pytest.approx(again, abs=1e-9)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_turnings_are_1_minus_1_and_0_where_a_field_is_constant_or_follows_the_rims(symmetry: int) -> None:
    ring = meshes.annulus(jitter_seed=2)
    middles = ring.vertices[ring.faces].mean(axis=1)
    constant = along(ring, np.tile([1.0, 0.3, 0.0], (len(middles), 1)), symmetry=symmetry)
    circles = along(ring, np.cross([0.0, 0.0, 1.0], middles), symmetry=symmetry)
    np.testing.assert_array_equal(constant.turnings(), [1.0, -1.0])
    np.testing.assert_array_equal(circles.turnings(), [0.0, 0.0])
    assert constant.singularities().vertices.size == circles.singularities().vertices.size == 0


@pytest.mark.parametrize(("vectors", "index"), [("circles", 1.0), ("rays", 1.0), ("saddle", -1.0)])
def test_circles_and_rays_have_index_1_and_a_saddle_minus_1(vectors: str, index: float) -> None:
    disc = meshes.disc(rings=6)
    middles = disc.vertices[disc.faces].mean(axis=1)
    made = {"circles": np.cross([0.0, 0.0, 1.0], middles), "rays": middles, "saddle": middles * [1.0, -1.0, 0.0]}
    found = along(disc, made[vectors], symmetry=2).singularities()
    assert (found.vertices.tolist(), found.indices.tolist()) == ([0], [index])


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_directions_are_unit_vectors_in_their_faces_evenly_around(symmetry: int) -> None:
    sphere = meshes.sphere(subdivisions=2, jitter_seed=3)
    field = any_field(sphere, symmetry=symmetry)
    directions = field.directions()
    a, b, c = (sphere.vertices[sphere.faces[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    assert directions.shape == (len(sphere.faces), symmetry, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=2), 1.0)
    np.testing.assert_allclose(np.einsum("mnx,mx->mn", directions, normals), 0.0, atol=1e-9)
    if symmetry > 1:
        np.testing.assert_allclose(directions[:, symmetry // 2], -directions[:, 0], atol=1e-12)


def test_a_point_has_the_directions_of_its_face() -> None:
    disc = meshes.disc(jitter_seed=1)
    field = any_field(disc, symmetry=4)
    points, _ = closest(disc, np.array([[3.0, 4.0, 0.0], [-8.0, 1.0, 0.0]]))
    np.testing.assert_array_equal(field.at(points), field.directions()[points.faces])
    with pytest.raises(InputError, match="points belong to the surface they were made on"):
        field.at(SurfacePoints(np.array([9999]), np.array([[1.0, 0.0, 0.0]])))


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_matching_numbers_the_direction_beyond_that_is_turned_least(symmetry: int) -> None:
    plate = meshes.plate(jitter_seed=1)
    field = any_field(plate, symmetry=symmetry)
    twins, matching, directions = connection(plate).twins.reshape(-1, 3), field.matching(), field.directions()
    for face, side in np.argwhere(twins >= 0):
        # In a plane nothing is unfolded.
        cosines = directions[twins[face, side] // 3] @ directions[face, 0]
        assert int(np.argmax(cosines)) == matching[face, side]
    assert not matching[twins < 0].any()


def test_what_turns_by_something_else_than_its_directions_is_no_field() -> None:
    field = any_field(meshes.disc(), symmetry=2)
    turning = field.turning.copy()
    inner = np.argwhere(connection(field.surface).twins.reshape(-1, 3) >= 0)[0]
    turning[tuple(inner)] += 0.1
    with pytest.raises(InputError, match=r"by 0\.1 rad"):
        DirectionField(field.surface, 2, field.angles, turning)
    rim = np.argwhere(connection(field.surface).twins.reshape(-1, 3) < 0)[0]
    turning = field.turning.copy()
    turning[tuple(rim)] = 0.2
    with pytest.raises(InputError, match=r"by 0\.2 rad"):
        DirectionField(field.surface, 2, field.angles, turning)
    with pytest.raises(InputError, match="but the field has 3"):
        DirectionField(field.surface, 2, np.zeros(3), np.zeros((3, 3)))


def test_three_directions_are_refused() -> None:
    with pytest.raises(UsageError, match="not 3"):
        nearest_field(meshes.disc(), np.zeros(384), symmetry=3)


def test_singularities_ascend_and_come_once() -> None:
    with pytest.raises(InputError, match="each vertex once"):
        Singularities(np.array([4, 4]), np.array([1.0, 1.0]))


def test_a_surface_that_is_wound_both_ways_is_refused() -> None:
    disc = meshes.disc()
    faces = disc.faces.copy()
    faces[0] = faces[0, ::-1]
    with pytest.raises(MeshError, match="with opposite winding"):
        connection(Surface(disc.vertices, faces))
