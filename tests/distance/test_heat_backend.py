"""The heat method: known distances, sources inside the surface, refusals."""

from __future__ import annotations

import gc
import threading
import weakref

import numpy as np
import pytest
from scipy.sparse import csc_array, eye_array
from scipy.sparse.linalg import splu

from geoprint.distance import heat as backend
from geoprint.distance.heat import Heat, held_vertices
from geoprint.distance.sparse_solver import SymmetricSolver, nested_dissection, picked, superlu
from geoprint.errors import FieldError, UsageError
from geoprint.geometry import boundary_source, cotangent_laplacian, point_source
from geoprint.model import FloatArray, IntArray, ScalarField, Source, Surface, SurfaceCurves, SurfacePoints
from tests.meshes import annulus, disc, plate, sphere, spherical_cap


def test_distance_from_the_rim_of_a_cap_is_the_arc() -> None:
    radius, angle = 30.0, 1.0
    surface = spherical_cap(radius=radius, angle=angle, rings=60, jitter_seed=1)
    found = Heat(surface).distance(boundary_source(surface)).values
    polar = np.arccos(np.clip(surface.vertices[:, 2] / radius, -1, 1))
    np.testing.assert_allclose(found, radius * (angle - polar), atol=0.1)


def test_distance_from_a_point_of_a_sphere_is_the_great_circle() -> None:
    surface = sphere(radius=20.0, subdivisions=5)
    pole = np.array([0.3, 0.2, 20.0])
    found = Heat(surface).distance(point_source(surface, pole, tolerance=1.0)).values
    angle = np.arccos(np.clip(surface.vertices @ pole / np.linalg.norm(pole) / 20.0, -1, 1))
    assert np.abs(found - 20.0 * angle).mean() < 0.1


def test_vertices_of_the_seed_are_held_at_zero_and_no_other() -> None:
    surface = disc(rings=6)
    held, distances = held_vertices(surface, boundary_source(surface))
    assert held.size == 36
    np.testing.assert_array_equal(distances, 0.0)


def test_a_seed_inside_a_triangle_holds_its_corners_at_their_straight_distance() -> None:
    surface = plate((4.0, 4.0), (2, 2))
    source = Source(
        SurfaceCurves(
            SurfacePoints(np.array([0]), np.array([[1 / 3, 1 / 3, 1 / 3]])), np.array([0, 1]), np.array([False])
        )
    )
    held, distances = held_vertices(surface, source)
    corners = surface.vertices[surface.faces[0]]
    assert sorted(held.tolist()) == sorted(surface.faces[0].tolist())
    wanted = np.linalg.norm(surface.vertices[held] - corners.mean(axis=0), axis=1)
    np.testing.assert_allclose(distances, wanted, atol=1e-12)


def test_a_seed_curve_across_a_triangle_holds_its_corners_at_their_distance_from_the_curve() -> None:
    surface = Surface(np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, 0]]), np.array([[0, 1, 2], [1, 3, 2]]))
    # From (2, 0) to (0, 2) across the first triangle.
    points = SurfacePoints(np.array([0, 0]), np.array([[0.5, 0.5, 0.0], [0.5, 0.0, 0.5]]))
    held, distances = held_vertices(surface, Source(SurfaceCurves(points, np.array([0, 2]), np.array([False]))))
    assert held.tolist() == [0, 1, 2]
    np.testing.assert_allclose(distances, [np.sqrt(2.0), 2.0, 2.0], atol=1e-12)


@pytest.mark.parametrize(("off", "held"), [(1e-10, 1), (1e-8, 3)])
def test_a_point_a_billionth_of_an_edge_off_a_vertex_is_that_vertex(off: float, held: int) -> None:
    surface = Surface(np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, 0]]), np.array([[0, 1, 2], [1, 3, 2]]))
    point = SurfacePoints(np.array([0]), np.array([[1.0 - off, off, 0.0]]))
    found, distances = held_vertices(surface, Source(SurfaceCurves(point, np.array([0, 1]), np.array([False]))))
    assert found.tolist() == [0, 1, 2][:held]
    np.testing.assert_allclose(distances, [0.0, 4.0, 4.0][:held], atol=1e-6)


def test_heat_flows_for_half_a_squared_edge_and_is_fitted_twelve_times_where_nothing_else_is_said() -> None:
    surface = spherical_cap(rings=6, jitter_seed=1)
    source = boundary_source(surface)
    found = Heat(surface).distance(source).values
    said = Heat(surface, time_factor=0.5, renormalisations=12).distance(source).values
    np.testing.assert_array_equal(found, said)


def test_a_seed_that_holds_every_vertex_is_refused() -> None:
    surface = Surface(np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]]), np.array([[0, 1, 2]]))
    with pytest.raises(FieldError, match="every vertex"):
        Heat(surface).distance(boundary_source(surface))


def test_heat_that_does_not_arrive_is_an_error_and_not_a_zero() -> None:
    one = plate((4.0, 4.0), (2, 2))
    both = Surface(
        np.concatenate([one.vertices, one.vertices + np.array([10.0, 0.0, 0.0])]),
        np.concatenate([one.faces, one.faces + len(one.vertices)]),
    )
    with pytest.raises(FieldError, match=r"heat does not reach 9 of 18|singular"):
        Heat(both).distance(point_source(both, np.array([0.0, 0.0, 0.0]), tolerance=1.0))


def test_distance_is_right_where_heat_is_colder_than_the_smallest_number() -> None:
    length = 3000.0
    surface = plate((length, 2.0), (1500, 1))
    end = SurfacePoints(np.array([0]), np.array([[1.0, 0.0, 0.0]]))
    source = Source(SurfaceCurves(end, np.array([0, 1]), np.array([False])))
    found = Heat(surface).distance(source).values
    start = surface.vertices[surface.faces[0, 0]]
    far = surface.vertices[:, 0] > 0.5 * length
    wanted = np.linalg.norm(surface.vertices - start, axis=1)
    np.testing.assert_allclose(found[far], wanted[far], rtol=2e-3)


def test_a_strip_that_heat_leaves_three_times_has_the_distance_of_a_short_one() -> None:
    # Fronts stay straight, so that the distance is the coordinate along the strip.
    surface = plate((2000.0, 3.0), (2000, 3), jitter_seed=4)
    ends = np.flatnonzero(surface.vertices[:, 0] == 0.0)
    faces, corners = np.nonzero(np.isin(surface.faces, ends))
    source = Source(
        SurfaceCurves(SurfacePoints(faces, np.eye(3)[corners]), np.arange(faces.size + 1), np.zeros(faces.size, "bool"))
    )
    found = Heat(surface).distance(source).values
    np.testing.assert_allclose(found, surface.vertices[:, 0], rtol=5e-4, atol=0.02)


def test_each_renormalisation_comes_nearer_to_the_distance() -> None:
    size = (40.0, 30.0)
    surface = plate(size, (40, 30), jitter_seed=5)
    x, y = surface.vertices[:, 0], surface.vertices[:, 1]
    wanted = np.minimum(np.minimum(x, size[0] - x), np.minimum(y, size[1] - y))
    errors = [
        np.abs(Heat(surface, renormalisations=count).distance(boundary_source(surface)).values - wanted).mean()
        for count in (0, 3, 12)
    ]
    assert errors[1] < 0.7 * errors[0]
    assert errors[2] < 0.5 * errors[0]


def test_slivers_do_not_spoil_the_distance_on_a_plane() -> None:
    # Cells 20 times as long as wide: the mean edge is 3 mm.
    surface = plate((40.0, 40.0), (8, 160), jitter_seed=3)
    x, y = surface.vertices[:, 0], surface.vertices[:, 1]
    wanted = np.minimum(np.minimum(x, 40.0 - x), np.minimum(y, 40.0 - y))
    found = Heat(surface).distance(boundary_source(surface)).values
    assert np.abs(found - wanted).mean() < 0.05 * 3.0


def test_the_same_seed_is_solved_once_and_another_gives_its_own_distance() -> None:
    surface = spherical_cap(rings=10, jitter_seed=1)
    solver = Heat(surface)
    rim, pole = boundary_source(surface), point_source(surface, np.array([0.0, 0.0, 30.0]), tolerance=1.0)
    first = solver.distance(rim)
    assert solver.distance(rim) is first
    assert solver.contours(rim, spacing=3.0).distance is first
    from_pole = solver.distance(pole).values
    np.testing.assert_array_equal(from_pole, Heat(surface).distance(pole).values)
    np.testing.assert_array_equal(solver.distance(rim).values, first.values)


def test_a_hole_is_a_border_that_heat_does_not_cross() -> None:
    # From a point of the outer rim of a ring to the opposite one: around the hole, not across it.
    surface = annulus(inner=8.0, outer=20.0, divisions=(120, 30), jitter_seed=2)
    start = np.array([20.0, 0.0, 0.0])
    found = Heat(surface).distance(point_source(surface, start, tolerance=1.0)).values
    opposite = int(np.argmin(np.linalg.norm(surface.vertices + start, axis=1)))
    touching = np.arccos(8.0 / 20.0)
    assert found[opposite] == pytest.approx(2 * np.sqrt(20.0**2 - 8.0**2) + 8.0 * (np.pi - 2 * touching), rel=0.01)


def test_a_negative_number_of_renormalisations_is_refused() -> None:
    with pytest.raises(UsageError, match="renormalisations"):
        Heat(plate(), renormalisations=-1)


def test_a_time_factor_that_is_not_positive_is_refused() -> None:
    with pytest.raises(UsageError, match="time_factor"):
        Heat(plate(), time_factor=0.0)


def test_the_elimination_order_is_a_permutation() -> None:
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


@pytest.mark.parametrize(("beside", "most"), [(10**9, 2), (0, 1)])
def test_factors_are_let_go_once_they_have_served(beside: int, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of large systems are made one after the other, and what they find is the same."""
    surface = spherical_cap(radius=30.0, angle=1.0, rings=20)
    wanted = Heat(surface).distance(boundary_source(surface)).values
    made: list[weakref.ref[SymmetricSolver]] = []
    alive: list[int] = []

    def solver(matrix: csc_array, *, order: IntArray) -> SymmetricSolver:
        found = SymmetricSolver(matrix, order=order)
        made.append(weakref.ref(found))
        alive.append(sum(each() is not None for each in made))
        return found

    monkeypatch.setattr(backend, "SymmetricSolver", solver)
    monkeypatch.setattr(backend, "BESIDE", beside)
    heat = Heat(surface)
    found = heat.distance(boundary_source(surface)).values
    gc.collect()

    assert found.tobytes() == wanted.tobytes()
    assert len(made) == 2
    assert max(alive) <= most
    assert not any(each() is not None for each in made)
    assert heat.distance(boundary_source(surface)).values.tobytes() == wanted.tobytes()
    assert len(made) == 2


def test_a_singular_system_is_refused() -> None:
    with pytest.raises(FieldError, match="singular"):
        SymmetricSolver(csc_array((3, 3)), order=np.arange(3))


def test_cholmod_and_superlu_agree_where_both_are_installed() -> None:
    cholmod = pytest.importorskip("sksparse.cholmod", reason="scikit-sparse is not installed")
    surface = plate((40.0, 40.0), (20, 20), jitter_seed=1)
    matrix = csc_array(cotangent_laplacian(surface) + 0.1 * eye_array(len(surface.vertices)))
    load = np.random.default_rng(0).normal(size=len(surface.vertices))
    np.testing.assert_allclose(cholmod.cho_factor(matrix).solve(load), superlu(matrix).solve(load), rtol=0, atol=1e-10)


def test_the_order_by_nested_dissection_leaves_less_fill_than_the_order_of_the_mesh() -> None:
    surface = plate((40.0, 40.0), (60, 60), jitter_seed=1)
    matrix = csc_array(cotangent_laplacian(surface) + 0.1 * eye_array(len(surface.vertices)))
    order = nested_dissection(matrix, coordinates=surface.vertices)
    fill = [splu(one, permc_spec="NATURAL").nnz for one in (matrix, csc_array(matrix[order][:, order]))]
    assert fill[1] < 0.4 * fill[0]


def test_unknowns_all_at_one_place_are_still_ordered() -> None:
    matrix = csc_array(eye_array(50))
    assert sorted(nested_dissection(matrix, coordinates=np.zeros((50, 3))).tolist()) == list(range(50))


@pytest.mark.parametrize("factor", [1.0, 1.0 - 2.0j], ids=["real", "complex"])
def test_rows_and_columns_are_picked_in_their_order(*, factor: complex) -> None:
    surface = disc(rings=5, jitter_seed=1)
    whole = cotangent_laplacian(surface).toarray()
    dense = whole if factor == 1.0 else whole * factor
    matrix = csc_array(dense)
    chosen = np.random.default_rng(0).permutation(len(surface.vertices))[:40]
    found = picked(matrix, chosen).toarray()
    assert found.dtype == dense.dtype
    np.testing.assert_array_equal(found, dense[chosen][:, chosen])
    assert picked(matrix, chosen[:0]).shape == (0, 0)


def test_memory_that_ends_while_factorising_is_not_taken_for_a_singular_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    def without_memory(*_: object, **__: object) -> None:
        raise RuntimeError("SUPERLU_MALLOC fails for buf in intMalloc() at line 162 in file memory.c")

    monkeypatch.setattr("geoprint.distance.sparse_solver.splu", without_memory)
    with pytest.raises(MemoryError, match="SUPERLU_MALLOC"):
        superlu(csc_array(eye_array(3)))


def test_the_factor_that_is_kept_is_made_by_the_thread_that_keeps_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """SciPy never gives back the memory of a factor that outlives the thread it was made in."""
    made: list[tuple[weakref.ref[SymmetricSolver], int]] = []
    kept: list[int] = []

    def solver(matrix: csc_array, *, order: IntArray) -> SymmetricSolver:
        found = SymmetricSolver(matrix, order=order)
        made.append((weakref.ref(found), threading.get_ident()))
        return found

    def ended(self: Heat, held: IntArray, distances: FloatArray) -> ScalarField:
        system = backend._Held(self._elements, held, distances, time=self._time, order=self._order)  # pyright: ignore[reportPrivateUsage]
        gc.collect()
        kept.extend(thread for alive, thread in made if alive() is not None)
        return ScalarField(system.varadhan)

    monkeypatch.setattr(backend, "SymmetricSolver", solver)
    monkeypatch.setattr(Heat, "_fitted", ended)
    monkeypatch.setattr("geoprint.threads.processors", lambda: 2)
    surface = disc(rings=6)
    Heat(surface).distance(boundary_source(surface))
    assert kept == [threading.get_ident()]
    assert {thread for _, thread in made} > set(kept)
