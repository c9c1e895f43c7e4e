"""Exact distance over triangles: against formulas, an independent library, and its own laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from pygeodesic.geodesic import PyGeodesicAlgorithmExact

from benchmarks.parts.surfaces import make
from geoprint.errors import FieldError, VerificationError
from geoprint.geometry import closest, refine, vertex_points
from geoprint.metrics.deposited import sampled
from geoprint.metrics.oracle.geodesic import Ask, GeodesicDistance, Nearest
from geoprint.metrics.oracle.tracing import SurfacePath, trace
from geoprint.metrics.oracle.unfolding import ANY, FlatMesh, Places, flat_mesh, flat_places, spatial
from geoprint.metrics.spacing import outer_distance
from geoprint.model import FloatArray, IntArray, Surface
from tests.meshes import annulus, cylinder_patch, plate, spherical_cap

# Runs this short [mm] are points.
DOT = 1e-7


def deposited(surface: Surface, lines: list[FloatArray]) -> tuple[FlatMesh, SurfacePath]:
    """Return (k, 3) lines as paths on a surface, one a level."""
    mesh = flat_mesh(surface)
    points, _ = closest(surface, np.concatenate(lines))
    runs = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    closed = np.array([bool(np.allclose(line[0], line[-1])) for line in lines])
    return mesh, trace(mesh, flat_places(mesh, points), runs=runs, levels=np.arange(len(lines)), closed=closed)


def places_of(surface: Surface, mesh: FlatMesh, xyz: FloatArray) -> Places:
    return flat_places(mesh, closest(surface, xyz)[0])


def anything(places: Places, limit: float = np.inf) -> Ask:
    return Ask.anything(limits=np.full(places.faces.size, limit))


def dot(surface: Surface, vertex: int) -> FloatArray:
    """Return a run so short that it is a point, from a vertex into one of its triangles."""
    face = surface.vertices[surface.faces[np.flatnonzero((surface.faces == vertex).any(axis=1))[0]]]
    inwards = face.mean(axis=0) - surface.vertices[vertex]
    return surface.vertices[vertex] + np.array([[0.0], [DOT]]) * inwards / np.linalg.norm(inwards)


def from_vertex(surface: Surface, vertex: int) -> Nearest:
    mesh, path = deposited(surface, [dot(surface, vertex)])
    places = flat_places(mesh, vertex_points(surface, np.arange(len(surface.vertices))))
    return GeodesicDistance(mesh, path)(places, anything(places))


def by_pygeodesic(surface: Surface, sources: IntArray) -> FloatArray:
    library = PyGeodesicAlgorithmExact(surface.vertices.copy(), surface.faces.astype(np.int32))
    return library.geodesicDistances(sources.astype(np.int32), None)[0]


@pytest.mark.parametrize("shape", ["saddle", "bumpy", "half torus", "sheet with hole", "cone"])
def test_it_agrees_with_an_independent_library(shape: str) -> None:
    surface = make(shape, faces=300)
    for vertex in (0, 97):
        found = from_vertex(surface, vertex)
        assert found.complete.all()
        np.testing.assert_allclose(found.distances, by_pygeodesic(surface, np.array([vertex])), atol=3 * DOT)


@pytest.mark.parametrize("style", ["anisotropic", "sliver"])
def test_thin_triangles_do_not_disturb_it(style: str) -> None:
    surface = make("bumpy", faces=300, style=style)
    found = from_vertex(surface, 40)
    np.testing.assert_allclose(found.distances, by_pygeodesic(surface, np.array([40])), atol=3 * DOT)


def test_the_shortest_way_bends_around_a_hole() -> None:
    surface = annulus(inner=8.0, outer=20.0, divisions=(96, 6))
    found = from_vertex(surface, 6)
    # Vertex 6 is at (20, 0), its opposite at (-20, 0): two tangents and the arc between them.
    opposite = int(np.argmin(surface.vertices[:, 0]))
    tangent = np.sqrt(20.0**2 - 8.0**2)
    expected = 2 * tangent + 8.0 * (np.pi - 2 * np.arccos(8.0 / 20.0))
    assert found.distances[opposite] == pytest.approx(expected, rel=1e-3)


def test_it_measures_from_every_point_of_a_line_and_not_only_its_corners() -> None:
    surface = plate((40.0, 30.0), (9, 7), jitter_seed=3)
    mesh, path = deposited(surface, [np.array([[5.0, 11.0, 0.0], [35.0, 11.0, 0.0]])])
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(0, 40, 300), rng.uniform(0, 30, 300), np.zeros(300)])
    places = places_of(surface, mesh, points)
    found = GeodesicDistance(mesh, path)(places, anything(places))
    foot = np.clip(points[:, 0], 5.0, 35.0)
    np.testing.assert_allclose(found.distances, np.hypot(points[:, 0] - foot, points[:, 1] - 11.0), atol=1e-9)
    np.testing.assert_allclose(found.arcs, foot - 5.0, atol=1e-6)
    np.testing.assert_array_equal(found.bounds, found.distances)


def test_a_rolled_plate_keeps_its_distances() -> None:
    flat, rolled = plate((45.0, 40.0), (30, 10)), cylinder_patch(divisions=(30, 10))
    lines = [np.array([[3.0, 4.0], [41.0, 33.0]]), np.array([[3.0, 30.0], [11.0, 35.0]])]
    found: list[Nearest] = []
    for surface in (flat, rolled):
        mesh = flat_mesh(surface)
        on_flat, _ = closest(flat, np.column_stack([np.concatenate(lines), np.zeros(4)]))
        path = trace(
            mesh, flat_places(mesh, on_flat), runs=np.array([0, 0, 1, 1]), levels=np.zeros(2, dtype=np.int64),
            closed=np.zeros(2, dtype=np.bool_),
        )  # fmt: skip
        places = flat_places(mesh, vertex_points(surface, np.arange(len(surface.vertices))))
        found.append(GeodesicDistance(mesh, path)(places, anything(places)))
    # The facets of the roll are a little shorter than its arcs.
    np.testing.assert_allclose(found[1].distances, found[0].distances, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("shape", ["saddle", "half torus", "sheet with hole"])
def test_what_is_known_of_the_way_behind_narrows_the_search_and_changes_nothing(shape: str) -> None:
    surface = make(shape, faces=600)
    mesh, path = deposited(surface, [dot(surface, 0)])
    places = flat_places(mesh, vertex_points(surface, np.arange(len(surface.vertices))))
    distance, asked = GeodesicDistance(mesh, path), anything(places)
    wide = distance(places, asked)
    asked = Ask.anything(limits=1.001 * wide.distances + 1e-3)
    away = np.linalg.norm(surface.vertices - surface.vertices[0], axis=1)[mesh.starts.reshape(-1, 3)]
    least = 0.5 * (away + np.roll(away, -1, axis=1)).ravel() - mesh.halves
    narrow = distance(places, asked, least=np.maximum(least, 0.0))
    np.testing.assert_allclose(narrow.distances, wide.distances, atol=1e-9)
    assert narrow.complete.all()
    assert narrow.windows < 0.5 * distance(places, asked).windows


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10_000))
def test_cutting_triangles_changes_nothing(number: int) -> None:
    surface = spherical_cap(rings=4, jitter_seed=number)
    face = surface.vertices[surface.faces[number % len(surface.faces)]]
    near = np.array([[0.8, 0.1, 0.1], [0.2, 0.5, 0.3]]) @ face
    found: list[Nearest] = []
    for part in (surface, refine(surface, edge_length=3.0)):
        mesh, path = deposited(part, [near])
        places = places_of(part, mesh, surface.vertices)
        found.append(GeodesicDistance(mesh, path)(places, anything(places)))
    np.testing.assert_allclose(found[0].distances, found[1].distances, atol=1e-8)


def test_a_path_keeps_its_length_wherever_it_runs() -> None:
    surface = plate((40.0, 30.0), (20, 15))
    x = np.linspace(0.0, 40.0, 57)
    # Along edges of the mesh, through its vertices, and across them.
    for line in ([x, np.full(57, 12.0)], [x, 0.75 * x], [x, 3.0 + 0.3 * x]):
        points = np.column_stack([*line, np.zeros(57)])
        mesh, path = deposited(surface, [points])
        assert path.lengths[0] == pytest.approx(float(np.linalg.norm(points[-1] - points[0])), abs=1e-9)
        arcs: FloatArray = np.linspace(0.0, float(path.lengths[0]), 31)
        places = spatial(mesh, path.at(np.zeros(31, dtype=np.int64), arcs))
        np.testing.assert_allclose(
            places, np.linspace(0, 1, 31)[:, None] * (points[-1] - points[0]) + points[0], atol=1e-9
        )


def test_a_path_over_vertices_of_a_curved_surface_is_as_long_as_the_shortest_way() -> None:
    surface = make("saddle", faces=300)
    ends = np.array([3, 150])
    mesh = flat_mesh(surface)
    path = trace(
        mesh, flat_places(mesh, vertex_points(surface, ends)), runs=np.zeros(2, dtype=np.int64),
        levels=np.zeros(1, dtype=np.int64), closed=np.zeros(1, dtype=np.bool_),
    )  # fmt: skip
    assert path.lengths[0] == pytest.approx(by_pygeodesic(surface, ends[:1])[150], abs=1e-9)
    gaps = spatial(mesh, Places(path.faces[1:], path.starts[1:])) - spatial(
        mesh, Places(path.faces[:-1], path.ends[:-1])
    )
    np.testing.assert_allclose(gaps, 0.0, atol=1e-9)


def test_only_the_level_asked_for_counts() -> None:
    surface = plate()
    lines = [np.array([[0.0, y, 0.0], [40.0, y, 0.0]]) for y in (5.0, 15.0)]
    mesh, path = deposited(surface, lines)
    places = places_of(surface, mesh, np.array([[20.0, 14.0, 0.0]]))
    distance = GeodesicDistance(mesh, path)
    assert [distance(places, Ask.level(np.array([k]))).distances[0] for k in (0, 1)] == pytest.approx([9.0, 1.0])
    nothing = distance(places, Ask.level(np.array([7])))
    assert np.isinf(nothing.distances[0])
    assert nothing.complete[0]


def test_the_stretch_one_is_on_can_be_left_out() -> None:
    surface = plate()
    hairpin = np.array([[5.0, 10.0, 0.0], [30.0, 10.0, 0.0], [30.0, 13.0, 0.0], [5.0, 13.0, 0.0]])
    mesh, path = deposited(surface, [hairpin])
    places = places_of(surface, mesh, np.array([[10.0, 10.5, 0.0]]))
    every = np.array([ANY])
    ask = Ask.elsewhere(every, np.array([0]), np.array([5.0]), clear=8.0, limits=np.array([np.inf]))
    assert GeodesicDistance(mesh, path)(places, ask).distances[0] == pytest.approx(2.5)


@pytest.mark.parametrize("shape", ["saddle", "half torus"])
@pytest.mark.parametrize("label", [ANY, 0])
def test_where_nothing_that_counts_is_near_in_space_no_search_is_needed(shape: str, label: int) -> None:
    surface = make(shape, faces=600)
    corners = surface.vertices[np.argsort(surface.vertices[:, 0])]
    mesh, path = deposited(surface, [dot(surface, 0), corners[[0, 1]], corners[[-1, -2]]])
    places = flat_places(mesh, vertex_points(surface, np.arange(len(surface.vertices))))
    distance, count = GeodesicDistance(mesh, path), len(surface.vertices)
    nearest = distance(places, anything(places))
    limits = np.where(np.arange(count) % 2, 1.0, 40.0)
    ask = Ask.elsewhere(np.full(count, label), nearest.runs, nearest.arcs, clear=0.5, limits=limits)
    narrowed = distance.narrowed(places, ask)
    searched, brief = distance(places, ask), distance(places, narrowed)
    for name in ("distances", "runs", "arcs", "complete"):
        np.testing.assert_array_equal(getattr(brief, name), getattr(searched, name))
    assert np.isfinite(searched.distances).any()
    assert brief.windows < searched.windows


def test_without_enough_work_allowed_it_gives_bounds_and_says_so() -> None:
    surface = make("bumpy", faces=600)
    mesh, path = deposited(surface, [dot(surface, 5)])
    places = flat_places(mesh, vertex_points(surface, np.arange(len(surface.vertices))))
    whole, little = (GeodesicDistance(mesh, path, windows=n)(places, anything(places)) for n in (10**7, 60))
    assert whole.complete.all()
    assert not little.complete.all()
    assert (little.bounds <= whole.distances + 1e-9).all()
    assert (little.distances >= whole.distances - 1e-9).all()


def test_a_distance_shorter_than_the_straight_line_is_a_defect() -> None:
    surface = plate()
    mesh, path = deposited(surface, [np.array([[0.0, y, 0.0], [40.0, y, 0.0]]) for y in (5.0, 15.0)])
    _, nearer = deposited(surface, [np.array([[0.0, y, 0.0], [40.0, y, 0.0]]) for y in (9.0, 15.0)])
    samples = sampled(path, step=5.0)
    samples = samples.some(samples.runs == 1)
    right = outer_distance(mesh, path, GeodesicDistance(mesh, path), samples, spacing=10.0)
    np.testing.assert_allclose(right.distances, 10.0)
    with pytest.raises(VerificationError, match="shorter than the straight line"):
        outer_distance(mesh, path, GeodesicDistance(mesh, nearer), samples, spacing=10.0)


def test_points_of_different_parts_have_no_connection() -> None:
    one = plate((4.0, 4.0), (2, 2))
    two = Surface(
        np.concatenate([one.vertices, one.vertices + np.array([10.0, 0.0, 0.0])]),
        np.concatenate([one.faces, one.faces + len(one.vertices)]),
    )
    with pytest.raises(FieldError, match="not connected"):
        deposited(two, [np.array([[1.0, 1.0, 0.0], [11.0, 1.0, 0.0]])])
