"""Shortest lines between vertices, and drawing them into the triangles: known lengths, then an independent oracle."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import FieldError
from geoprint.geometry import edges, euler_characteristic, face_areas, inscribed, with_vertex
from geoprint.metrics.oracle.geodesic import shortest_way
from geoprint.model import FloatArray, IntArray, Surface
from tests.meshes import cylinder_patch, plate, sphere, torus
from tests.metrics.oracle.test_geodesic import by_pygeodesic


def nearest(surface: Surface, *xyz: float) -> int:
    return int(np.argmin(np.linalg.norm(surface.vertices - np.array(xyz), axis=1)))


def length(points: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def are_edges(surface: Surface, chain: IntArray) -> bool:
    pairs = {tuple(pair) for pair in edges(surface.faces).tolist()}
    return all((min(pair), max(pair)) in pairs for pair in zip(chain[:-1].tolist(), chain[1:].tolist(), strict=True))


def test_on_a_plate_the_shortest_line_is_straight() -> None:
    surface = plate(jitter_seed=3)
    line = shortest_way(surface, nearest(surface, 0, 0, 0), nearest(surface, 40, 30, 0))
    assert line.length == pytest.approx(50.0, rel=1e-12)
    places = line.places(surface)
    # Within the distance that lets it pass through a vertex.
    assert np.abs(places[:, 0] * 30.0 - places[:, 1] * 40.0).max() < 50.0 * 5e-3


def test_on_a_rolled_plate_it_is_as_long_as_on_the_flat_one() -> None:
    surface = cylinder_patch(divisions=(120, 40), jitter_seed=1)
    line = shortest_way(surface, 0, len(surface.vertices) - 1)
    assert line.length == pytest.approx(float(np.hypot(45.0, 40.0)), rel=1e-4)


@settings(max_examples=12, deadline=None)
@given(first=st.integers(0, 500), last=st.integers(0, 500))
def test_no_line_is_shorter_and_drawn_it_consists_of_edges(first: int, last: int) -> None:
    surface = torus(divisions=(36, 18))
    first, last = first % len(surface.vertices), last % len(surface.vertices)
    if first == last:
        return
    line = shortest_way(surface, first, last)
    exact = by_pygeodesic(surface, np.array([first]))[last]
    assert line.length == pytest.approx(exact, rel=1e-9)
    assert shortest_way(surface, last, first).length == pytest.approx(exact, rel=1e-9)
    drawn, chain = inscribed(surface, line)
    assert are_edges(drawn, chain)
    assert (chain[0], chain[-1]) == (first, last)
    # It goes through vertices that it passes closely: none of 6,000 drawn lines became longer by a share of 8e-5.
    assert exact * (1.0 - 1e-12) <= length(drawn.vertices[chain]) <= exact * (1.0 + 2e-4)
    assert face_areas(drawn).sum() == pytest.approx(face_areas(surface).sum(), rel=1e-12)
    assert face_areas(drawn).min() > 0.0
    assert euler_characteristic(drawn) == 0


def test_a_point_becomes_a_vertex_inside_a_face_on_an_edge_or_where_one_is_already() -> None:
    surface = plate(divisions=(2, 2))
    middle = surface.vertices[surface.faces[0]].mean(axis=0)
    side = surface.vertices[surface.faces[0, :2]].mean(axis=0)
    inside, vertex = with_vertex(surface, middle)
    assert len(inside.faces) == len(surface.faces) + 2
    np.testing.assert_allclose(inside.vertices[vertex], middle)
    on_edge, _ = with_vertex(surface, side)
    assert len(on_edge.faces) in {len(surface.faces) + 1, len(surface.faces) + 2}
    assert face_areas(on_edge).sum() == pytest.approx(1200.0)
    same, found = with_vertex(surface, surface.vertices[4] + 1e-6)
    assert same is surface
    assert found == 4


def test_vertices_that_no_line_joins_are_refused() -> None:
    one = plate()
    other = one.vertices + np.array([0.0, 0.0, 5.0])
    both = Surface(np.vstack([one.vertices, other]), np.vstack([one.faces, one.faces + len(other)]), name="two plates")
    with pytest.raises(FieldError, match=r"two plates: .* lie on pieces of the surface that do not hang together"):
        shortest_way(both, 0, len(other))


def test_a_search_without_room_ends_in_a_refusal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules[shortest_way.__module__], "WINDOWS", 20)
    surface = sphere()
    with pytest.raises(FieldError, match=r"too many triangles apart .* mm long. Add a point between them"):
        shortest_way(surface, 0, 300)
