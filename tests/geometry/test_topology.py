"""Connectivity: edges, half-edges, boundary loops, components and the kind of surface."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import MeshError
from geoprint.geometry.topology import (
    boundary_loops,
    component_labels,
    describe,
    edge_faces,
    edges,
    euler_characteristic,
    half_edges,
    loop_length,
    twins,
)
from geoprint.model import IntArray, Surface
from tests import meshes

TWO_TRIANGLES = np.array([[0, 1, 2], [2, 1, 3]])
THREE_AT_AN_EDGE = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])

KINDS = [
    (meshes.plate(), 1, "disc"),
    (meshes.disc(jitter_seed=1), 1, "disc"),
    (meshes.cylinder_patch(), 1, "disc"),
    (meshes.spherical_cap(), 1, "disc"),
    (meshes.annulus(), 0, "annulus"),
    (meshes.sphere(), 2, "closed, genus 0"),
    (meshes.torus(), 0, "closed, genus 1"),
]


def without_faces_at(surface: Surface, *vertices: int) -> Surface:
    """Cut a hole around each vertex."""
    kept = ~np.isin(surface.faces, vertices).any(axis=1)
    return Surface(vertices=surface.vertices, faces=surface.faces[kept], name=surface.name)


def signed_area(surface: Surface, loop: IntArray) -> float:
    """Return the area enclosed by a loop in the xy plane, positive if it runs counter-clockwise."""
    x, y = surface.vertices[loop, :2].T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


@pytest.mark.parametrize(("surface", "characteristic", "kind"), KINDS)
def test_known_surfaces_have_their_euler_characteristic_and_name(
    surface: Surface, characteristic: int, kind: str
) -> None:
    assert euler_characteristic(surface) == characteristic
    assert describe(surface) == kind


def test_holes_and_handles_are_named() -> None:
    plate = meshes.plate(divisions=(12, 8))
    assert describe(without_faces_at(plate, 30)) == "annulus"
    assert describe(without_faces_at(plate, 30, 60)) == "disc with 2 holes"
    torus = meshes.torus()
    assert describe(without_faces_at(torus, 0)) == "genus 1 with 1 boundary loop"
    assert describe(without_faces_at(torus, 0, 500)) == "genus 1 with 2 boundary loops"


def test_two_pieces_are_counted_and_labelled_in_the_order_of_their_faces() -> None:
    left, right = meshes.plate(), meshes.disc()
    both = Surface(
        vertices=np.concatenate([left.vertices, right.vertices + 100.0]),
        faces=np.concatenate([left.faces, right.faces + len(left.vertices)]),
    )
    assert describe(both) == "2 components"
    expected = np.repeat([0, 1], [len(left.faces), len(right.faces)])
    np.testing.assert_array_equal(component_labels(both), expected)


def test_unused_vertices_do_not_count_in_the_euler_characteristic() -> None:
    plate = meshes.plate()
    padded = Surface(vertices=np.concatenate([plate.vertices, [[1e3, 0.0, 0.0]]]), faces=plate.faces)
    assert euler_characteristic(padded) == 1


def test_edges_are_unique_sorted_and_as_many_as_euler_says() -> None:
    sphere = meshes.sphere(subdivisions=1)
    found = edges(sphere.faces)
    assert len(found) == 3 * len(sphere.faces) // 2
    assert (found[:, 0] < found[:, 1]).all()
    np.testing.assert_array_equal(found, np.unique(found, axis=0))


def test_the_faces_of_an_edge_are_its_neighbours_and_minus_one_on_the_rim() -> None:
    np.testing.assert_array_equal(edge_faces(TWO_TRIANGLES), [[0, -1], [0, -1], [0, 1], [1, -1], [1, -1]])


def test_twins_run_the_other_way_along_the_same_edge() -> None:
    annulus = meshes.annulus()
    other, sides = twins(annulus.faces), half_edges(annulus.faces)
    inner = other >= 0
    np.testing.assert_array_equal(sides[inner], sides[other[inner]][:, ::-1])
    np.testing.assert_array_equal(other[other[inner]], np.flatnonzero(inner))
    assert (~inner).sum() == sum(loop.size for loop in boundary_loops(annulus))


@pytest.mark.parametrize("ask", [edge_faces, twins])
def test_an_edge_with_three_faces_has_no_twins(ask: object) -> None:
    assert callable(ask)
    with pytest.raises(MeshError, match="1 edges have more than two faces"):
        ask(THREE_AT_AN_EDGE)


def test_the_outer_rim_runs_counter_clockwise_and_a_hole_clockwise() -> None:
    annulus = meshes.annulus(inner=8.0, outer=20.0, divisions=(96, 6))
    outer, hole = boundary_loops(annulus)
    assert signed_area(annulus, outer) == pytest.approx(np.pi * 20**2, rel=2e-3)
    assert signed_area(annulus, hole) == pytest.approx(-np.pi * 8**2, rel=2e-3)


def test_loops_follow_edges_start_at_their_smallest_vertex_and_do_not_repeat_it() -> None:
    annulus = meshes.annulus()
    known = {tuple(edge) for edge in edges(annulus.faces).tolist()}
    for loop in boundary_loops(annulus):
        assert loop[0] == loop.min()
        assert np.unique(loop).size == loop.size
        steps = np.sort(np.column_stack([loop, np.roll(loop, -1)]), axis=1)
        assert {tuple(step) for step in steps.tolist()} <= known


def test_the_longest_loop_comes_first_even_with_fewer_vertices() -> None:
    plate = meshes.plate(size=(40.0, 30.0), divisions=(3, 3))
    fine_hole = Surface(
        vertices=np.concatenate([plate.vertices, meshes.annulus(inner=1, outer=2).vertices]),
        faces=np.concatenate([plate.faces, meshes.annulus(inner=1, outer=2).faces + len(plate.vertices)]),
    )
    lengths = [loop_length(fine_hole.vertices, loop) for loop in boundary_loops(fine_hole)]
    assert lengths[0] == pytest.approx(140.0)
    assert lengths == sorted(lengths, reverse=True)


def test_a_closed_surface_has_no_boundary_loop() -> None:
    assert boundary_loops(meshes.sphere()) == ()


def test_a_pinched_or_inconsistent_boundary_is_refused() -> None:
    pinched = Surface(vertices=np.eye(5, 3), faces=np.array([[0, 1, 2], [0, 3, 4]]))
    turned = Surface(vertices=np.eye(4, 3), faces=np.array([[0, 1, 2], [1, 2, 3]]))
    for surface in (pinched, turned):
        with pytest.raises(MeshError, match="does not fall into separate loops"):
            boundary_loops(surface)
