"""Fast marching: exact distances known in closed form or from the polyhedron, laws, bad triangles and odd sources."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from pygeodesic import geodesic
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from geoprint.distance.fast_marching import FLIP_MARGIN, FastMarching, flipped_apart_from, source_pieces
from geoprint.distance.intrinsic import intrinsic_triangulation
from geoprint.distance.isolines import isolines
from geoprint.errors import FieldError, InputError
from geoprint.geometry import boundary_source, closest, edge_lengths, point_source, positions, refine
from geoprint.model import FloatArray, IntArray, Source, Surface, SurfaceCurves, SurfacePoints
from tests.meshes import annulus, cylinder_patch, disc, plate, sphere, spherical_cap, torus


def marched(surface: Surface, source: Source | None = None) -> FloatArray:
    return FastMarching(surface).distance(boundary_source(surface) if source is None else source).values


def errors(found: FloatArray, exact: FloatArray, surface: Surface) -> FloatArray:
    """Return errors as shares of the mean edge."""
    return np.abs(found - exact) / edge_lengths(surface).mean()


def point(face: int, weights: tuple[float, float, float]) -> Source:
    at = SurfacePoints(np.array([face]), np.array([weights]))
    return Source(SurfaceCurves(at, np.array([0, 1]), np.array([False])))


def curve(surface: Surface, places: FloatArray) -> Source:
    points, _ = closest(surface, places)
    return Source(SurfaceCurves(points, np.array([0, len(places)]), np.array([False])))


def exact_from_point(surface: Surface, source: Source) -> FloatArray:
    """Return the exact distance on the polyhedron from a point, made a vertex of it."""
    face = int(source.curves.points.faces[0])
    a, b, c = surface.faces[face].tolist()
    new = len(surface.vertices)
    vertices = np.vstack([surface.vertices, positions(surface, source.curves.points)])
    faces = np.vstack([np.delete(surface.faces, face, axis=0), [[a, b, new], [b, c, new], [c, a, new]]])
    return exact_from_vertices(vertices, faces, np.array([new]))[:new]


def exact_from_vertices(vertices: FloatArray, faces: IntArray, sources: IntArray) -> FloatArray:
    solver = geodesic.PyGeodesicAlgorithmExact(vertices, faces.astype(np.int32))
    return np.asarray(solver.geodesicDistances(sources.astype(np.int32), None)[0])


def distance_to_polyline(places: FloatArray, line: FloatArray) -> FloatArray:
    starts, along = line[:-1], np.diff(line, axis=0)
    shares = np.einsum("nkx,kx->nk", places[:, None] - starts, along) / (along**2).sum(axis=1)
    nearest = starts + np.clip(shares, 0.0, 1.0)[:, :, None] * along
    return np.linalg.norm(places[:, None] - nearest, axis=2).min(axis=1)


def stretched_plate(ratio: float) -> Surface:
    """Return a jittered plate whose triangles are `ratio` times longer than wide."""
    long = plate((30.0, 30.0 * ratio), (24, int(24 * ratio)), jitter_seed=4)
    return Surface(long.vertices / [1.0, ratio, 1.0], long.faces, name="stretched plate")


def sliver_plate() -> Surface:
    """Return a plate triangulated from random points, a fifth of them strung along one line."""
    rng = np.random.default_rng(3)
    inside = rng.uniform(0.02, 0.98, (900, 2)) * [40.0, 30.0]
    inside[:180, 1] = 11.0 + 0.02 * rng.uniform(-1, 1, 180)
    ticks = [np.linspace(0.0, side, 25) for side in (40.0, 30.0)]
    rim = np.vstack([np.column_stack([ticks[0], np.full(25, y)]) for y in (0.0, 30.0)])
    rim = np.vstack([rim, *(np.column_stack([np.full(23, x), ticks[1][1:-1]]) for x in (0.0, 40.0))])
    flat = np.vstack([inside, rim])
    faces = Delaunay(flat).simplices.astype(np.int64)
    a, b, c = (flat[faces[:, i]] for i in range(3))
    doubled = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    faces = np.where(doubled[:, None] < 0, faces[:, ::-1], faces)[np.abs(doubled) > 1e-9]
    return Surface(np.column_stack([flat, np.zeros(len(flat))]), faces, name="slivers")


def to_rectangle(surface: Surface, size: tuple[float, float]) -> FloatArray:
    x, y = surface.vertices[:, 0], surface.vertices[:, 1]
    return np.minimum(np.minimum(x, size[0] - x), np.minimum(y, size[1] - y))


def test_a_planar_front_is_exact() -> None:
    surface = plate((40.0, 30.0), (16, 12), jitter_seed=1)
    side = np.column_stack([np.zeros(13), np.linspace(0.0, 30.0, 13), np.zeros(13)])
    found = marched(surface, curve(surface, side))
    np.testing.assert_allclose(found, surface.vertices[:, 0], atol=1e-9)


def test_two_fronts_that_meet_keep_their_ridge() -> None:
    size = (40.0, 30.0)
    surface = plate(size, (48, 36), jitter_seed=5)
    error = errors(marched(surface), to_rectangle(surface, size), surface)
    assert error.mean() < 0.001
    assert error.max() < 0.05


def test_a_cylinder_has_the_distances_of_its_plate() -> None:
    size = (45.0, 40.0)
    flat = plate(size, (40, 36), jitter_seed=5)
    rolled = cylinder_patch(radius=30.0, angle=1.5, length=40.0, divisions=(40, 36), jitter_seed=5)
    error = errors(marched(rolled), to_rectangle(flat, size), rolled)
    # Chords are shorter than arcs.
    assert error.mean() < 0.01


def test_a_cap_has_the_distances_of_the_sphere() -> None:
    surface = spherical_cap(rings=40, jitter_seed=2)
    exact = 30.0 * (1.0 - np.arccos(surface.vertices[:, 2] / 30.0))
    error = errors(marched(surface), exact, surface)
    assert error.mean() < 0.03


@pytest.mark.parametrize("weights", [(1.0, 0.0, 0.0), (0.4, 0.6, 0.0), (0.2, 0.5, 0.3)], ids=["vertex", "edge", "face"])
@pytest.mark.parametrize("surface", [spherical_cap(rings=16, jitter_seed=3), torus()], ids=["cap", "torus"])
def test_a_point_anywhere_on_the_surface_agrees_with_the_polyhedron(
    surface: Surface, weights: tuple[float, float, float]
) -> None:
    source = point(200, weights)
    if max(weights) == 1.0:
        exact = exact_from_vertices(surface.vertices, surface.faces, surface.faces[200, :1])
    else:
        exact = exact_from_point(surface, source)
    error = errors(marched(surface, source), exact, surface)
    assert error.mean() < 0.015
    assert error.max() < 0.15


def test_a_seed_on_a_closed_surface_reaches_its_antipode() -> None:
    surface = sphere(subdivisions=4, jitter_seed=1)
    source = point_source(surface, np.array([0.0, 0.0, 20.0]), tolerance=1.0)
    exact = 20.0 * np.arccos(np.clip(surface.vertices[:, 2] / 20.0, -1.0, 1.0))
    error = errors(marched(surface, source), exact, surface)
    assert error.mean() < 0.05
    assert error.max() < 0.2


@pytest.mark.parametrize("ends_only", [True, False], ids=["long chords", "dense points"])
def test_a_curve_across_triangles_is_a_line_not_its_points(*, ends_only: bool) -> None:
    surface = plate((40.0, 30.0), (40, 30), jitter_seed=6)
    line = np.array([[8.0, 9.0, 0.0], [21.3, 17.7, 0.0], [33.1, 12.2, 0.0]])
    share = np.linspace(0.0, 2.0, 3 if ends_only else 301)
    dense = np.column_stack([np.interp(share, range(3), line[:, axis]) for axis in range(3)])
    error = errors(marched(surface, curve(surface, dense)), distance_to_polyline(surface.vertices, line), surface)
    assert error.mean() < 0.01
    assert error.max() < 0.2


def test_long_chords_are_cut_at_every_edge_without_gaps() -> None:
    surface = plate((40.0, 30.0), (20, 300), jitter_seed=1)
    line = np.array([[7.3, 8.1, 0.0], [15.2, 19.7, 0.0], [24.4, 11.3, 0.0], [33.1, 22.2, 0.0]])
    pieces = source_pieces(surface, curve(surface, line), rim=np.zeros((0, 2), dtype=np.int64))
    corners = surface.vertices[surface.faces[pieces.faces]]
    ways = np.einsum("kc,kcx->kx", pieces.ends - pieces.starts, corners)
    # Less than a thousandth is left open, where the line passes a vertex.
    covered = np.linalg.norm(ways, axis=1).sum() / np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    assert 0.999 < covered < 1.0 + 1e-9
    error = errors(marched(surface, curve(surface, line)), distance_to_polyline(surface.vertices, line), surface)
    assert error.max() < 0.2


def test_a_curve_along_inner_edges_of_the_mesh_is_a_line() -> None:
    surface = plate((40.0, 30.0), (16, 12))
    # From vertex to vertex of one row of the grid.
    row = np.column_stack([np.linspace(0.0, 40.0, 17), np.full(17, 15.0), np.zeros(17)])
    found = marched(surface, curve(surface, row))
    np.testing.assert_allclose(found, np.abs(surface.vertices[:, 1] - 15.0), atol=1e-9)


def test_several_boundary_loops_are_all_seeds() -> None:
    surface = annulus(divisions=(120, 24), jitter_seed=2)
    radius = np.linalg.norm(surface.vertices, axis=1)
    error = errors(marched(surface), np.minimum(radius - 8.0, 20.0 - radius), surface)
    assert error.mean() < 0.01
    assert error.max() < 0.1


@pytest.mark.parametrize("surface", [stretched_plate(20.0), sliver_plate()], ids=["anisotropic", "slivers"])
def test_bad_triangles_do_not_spoil_the_distance(surface: Surface) -> None:
    size = (float(surface.vertices[:, 0].max()), float(surface.vertices[:, 1].max()))
    error = errors(marched(surface), to_rectangle(surface, size), surface)
    assert error.mean() < 0.03
    assert np.percentile(error, 99) < 0.3


def test_a_jagged_rim_is_rounded_at_its_inner_corners() -> None:
    whole = refine(plate((40.0, 30.0), (10, 8)), edge_length=1.0)
    centres = whole.vertices[whole.faces].mean(axis=1)
    kept = whole.faces[(centres[:, 0] > 12.0) | (centres[:, 1] > 10.0)]
    used, faces = np.unique(kept, return_inverse=True)
    surface = Surface(whole.vertices[used], faces.reshape(-1, 3), name="jagged")
    source = boundary_source(surface)
    loop = positions(surface, source.curves.points)
    error = errors(marched(surface), distance_to_polyline(surface.vertices, loop), surface)
    assert error.mean() < 0.02
    assert error.max() < 0.2


def test_a_strip_of_thousands_of_triangles_keeps_its_length() -> None:
    surface = plate((3000.0, 2.0), (3000, 2), jitter_seed=8)
    found = marched(surface, curve(surface, np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 2.0, 0.0]])))
    # Rounding grows along so many triangles, and then levels off.
    assert errors(found, surface.vertices[:, 0], surface).max() < 0.05


def test_no_distance_exceeds_the_shortest_way_along_edges() -> None:
    surface = spherical_cap(rings=12, jitter_seed=6)
    ends = np.sort(surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    ends = np.unique(ends, axis=0)
    lengths = np.linalg.norm(np.diff(surface.vertices[ends], axis=1)[:, 0], axis=1)
    graph = coo_array((lengths, ends.T), shape=(len(surface.vertices), len(surface.vertices)))
    ways = np.asarray(dijkstra(graph.tocsr(), directed=False, indices=np.array([0])))[0]
    found = marched(surface, point_source(surface, surface.vertices[0], tolerance=1e-6))
    straight = np.linalg.norm(surface.vertices - surface.vertices[0], axis=1)
    assert (found <= ways + 1e-9).all()
    assert (found >= 0.999 * straight).all()


@given(seed=st.integers(0, 50), scale=st.floats(0.01, 100.0), turns=st.tuples(*[st.floats(0.0, 6.0)] * 3))
@settings(deadline=None, max_examples=15)
def test_rigid_motion_and_scale_change_nothing(seed: int, scale: float, turns: tuple[float, float, float]) -> None:
    surface = spherical_cap(rings=8, jitter_seed=seed)
    turn = Rotation.from_euler("xyz", turns).as_matrix()
    moved = Surface(scale * surface.vertices @ turn.T + [3.0, -20.0, 7.0], surface.faces)
    np.testing.assert_allclose(marched(moved) / scale, marched(surface), rtol=1e-9, atol=1e-9 * 30.0)


@given(seed=st.integers(0, 200))
@settings(deadline=None, max_examples=15)
def test_renumbering_moves_distances_by_less_than_a_twentieth_of_an_edge(seed: int) -> None:
    surface = spherical_cap(rings=10, jitter_seed=seed)
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(surface.vertices))
    faces = rng.permutation(np.argsort(order)[surface.faces])
    renumbered = Surface(surface.vertices[order], np.roll(faces, int(rng.integers(3)), axis=1))
    assert errors(marched(renumbered), marched(surface)[order], surface).max() < 0.05


def test_the_error_falls_at_least_with_the_square_of_the_edges() -> None:
    found: list[float] = []
    for rings in (10, 20, 40):
        surface = disc(rings=rings, jitter_seed=1)
        exact = 20.0 - np.linalg.norm(surface.vertices, axis=1)
        found.append(float(np.abs(marched(surface) - exact).mean()))
    assert np.log2(found[0] / found[2]) / 2 > 1.7


def test_level_curves_keep_their_corners_on_a_ridge() -> None:
    surface = plate((40.0, 30.0), (40, 30), jitter_seed=5)
    source = boundary_source(surface)
    backend = FastMarching(surface)
    straight, _ = isolines(surface, backend.distance(source), levels=np.arange(1.3, 12.0, 2.6))
    contours = backend.contours(source, spacing=2.6)
    inset = (contours.levels[:5] + 0.5) * 2.6
    corners = np.array([[x, y, 0.0] for d in inset for x in (d, 40.0 - d) for y in (d, 30.0 - d)])

    def missed(curves: SurfaceCurves) -> float:
        places = positions(surface, curves.points)
        return float(np.median(np.linalg.norm(places[:, None] - corners, axis=2).min(axis=0)))

    assert missed(contours.curves) < 0.7 * missed(straight)


def test_level_curves_of_a_curved_front_do_not_cut_it_short() -> None:
    surface = disc(rings=12, jitter_seed=2)
    # From the centre, so that the rim is round where it matters.
    source = point_source(surface, np.zeros(3), tolerance=1e-6)
    backend = FastMarching(surface)
    contours = backend.contours(source, spacing=4.0)
    straight, levels = isolines(surface, backend.distance(source), levels=np.array([2.0, 6.0, 10.0, 14.0, 18.0]))

    def missed(curves: SurfaceCurves, level: IntArray) -> float:
        radii = np.linalg.norm(positions(surface, curves.points), axis=1)
        return float(np.abs(radii - np.repeat(2.0 + 4.0 * level, np.diff(curves.offsets))).mean())

    assert missed(contours.curves, contours.levels) < 0.2 * missed(straight, levels)


def test_edges_may_be_twice_as_long_where_the_part_is_coarse_and_no_longer_where_it_is_fine() -> None:
    coarse, fine = spherical_cap(rings=5), spherical_cap(rings=60)
    assert FastMarching.edge_length(coarse, spacing=0.4) == pytest.approx(0.2)
    assert FastMarching.edge_length(fine, spacing=0.4) == pytest.approx(0.1)
    between = spherical_cap(rings=24)
    eighth = float(edge_lengths(between).mean()) / 8
    assert FastMarching.edge_length(between, spacing=0.4) == pytest.approx(eighth)
    assert 0.1 < eighth < 0.2


def test_faces_kept_apart_stay_and_are_sewn_in_again() -> None:
    triangulation = intrinsic_triangulation(stretched_plate(20.0))
    kept = np.array([100, 101, 555])
    flipped = flipped_apart_from(triangulation, kept, margin=FLIP_MARGIN)
    np.testing.assert_array_equal(flipped.corners[kept], triangulation.corners[kept])
    assert (flipped.twins < 0).sum() == (triangulation.twins < 0).sum()
    assert (flipped.corners != triangulation.corners).any()
    inner = np.flatnonzero(flipped.twins.ravel() >= 0)
    lengths = flipped.lengths.ravel()
    np.testing.assert_allclose(lengths[inner], lengths[flipped.twins.ravel()[inner]])


def test_a_part_without_seed_is_named() -> None:
    one = plate((10.0, 10.0), (4, 4))
    apart = one.vertices + np.array([20.0, 0.0, 0.0])
    both = Surface(np.vstack([one.vertices, apart]), np.vstack([one.faces, one.faces + len(one.vertices)]))
    with pytest.raises(FieldError, match=r"25 of 50 vertices .* have no connection"):
        marched(both, point(0, (1.0, 0.0, 0.0)))


def test_a_mesh_that_is_all_seed_is_refused() -> None:
    with pytest.raises(FieldError, match="every vertex of the surface belongs to the source"):
        marched(plate((10.0, 10.0), (1, 1)))


def test_a_seed_of_another_surface_is_refused() -> None:
    with pytest.raises(InputError, match="points belong to the surface"):
        marched(plate(), point(10_000, (1.0, 0.0, 0.0)))
