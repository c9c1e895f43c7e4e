"""Conformal charts: of holed plates, bands and frusta by formula, of discs beside libigl, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.distance import BACKENDS
from geoprint.distance.distortion import Distortion, distortion, predicted_spacing, signed_areas
from geoprint.distance.lscm_chart import conformal_chart, crossing_segments, farthest_pair, refuse_overlaps
from geoprint.distance.lscm_seam import (
    LARGEST_TURN,
    UNCUT,
    Continuation,
    flat_turn,
    flattened,
    flattened_band,
)
from geoprint.errors import FieldError, InputError
from geoprint.geometry import (
    boundary_loops,
    boundary_source,
    describe,
    edge_lengths,
    face_areas,
    positions,
    prepare,
    shortest_edge_path,
    vertex_points,
)
from geoprint.geometry.files import load
from geoprint.model import FloatArray, IntArray, Surface
from tests.distance.bands import band
from tests.meshes import annulus, cylinder_patch, plate, sphere, spherical_cap, torus
from tests.shared_data import shared

PATCHES = (
    "bivme_apex_disc_r30_coarse",
    "heart_walls_closed_lv_r30",
    "interventricular_groove_disc_r20",
    "lv_anterior_disc_r30",
    "lv_apex_disc_r20",
    "lv_lateral_disc_r15",
    "lv_lateral_disc_r20_jagged",
    "lv_lateral_disc_r20_slivers",
    "lv_lateral_rect_40x30",
    "tricuspid_leaflet_disc_r6",
)


def frustum(*, low: float, high: float, height: float, divisions: tuple[int, int] = (72, 24)) -> Surface:
    """Return the band of a cone about the z axis between two radii; a cylinder where they are equal."""
    flat = annulus(inner=1.0, outer=2.0, divisions=divisions, jitter_seed=3)
    x, y, _ = flat.vertices.T
    share = np.hypot(x, y) - 1.0
    radius = high + (low - high) * share
    turn = np.arctan2(y, x)
    return Surface(np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height * (1 - share)]), flat.faces)


def plate_without(*holes: tuple[float, float], radius: float = 5.0) -> Surface:
    """Return a plate without the triangles around some places."""
    whole = plate((40.0, 30.0), (32, 24), jitter_seed=1)
    middles = whole.vertices[whole.faces].mean(axis=1)[:, :2]
    kept = np.all([np.linalg.norm(middles - hole, axis=1) > radius for hole in holes], axis=0)
    used, faces = np.unique(whole.faces[kept], return_inverse=True)
    return Surface(whole.vertices[used], faces.reshape(-1, 3), name="plate with holes")


def radii_about_hole(chart: Surface) -> FloatArray:
    """Return distances from the middle of the chart's last loop."""
    rim = chart.vertices[boundary_loops(chart)[-1]]
    return np.linalg.norm(chart.vertices - rim.mean(axis=0), axis=1)


@pytest.mark.parametrize(
    ("surface", "kind"),
    [
        (annulus(jitter_seed=1), "annulus"),
        (plate_without((12.0, 11.0), (28.0, 18.0)), "disc with 2 holes"),
        (plate_without((8.0, 8.0), (20.0, 21.0), (31.0, 9.0), radius=4.0), "disc with 3 holes"),
    ],
    ids=["annulus", "two holes", "three holes"],
)
def test_the_chart_of_a_plane_part_with_holes_is_the_part_turned(surface: Surface, kind: str) -> None:
    assert describe(surface) == kind
    np.testing.assert_allclose(edge_lengths(conformal_chart(surface)), edge_lengths(surface), rtol=1e-8)


def test_a_cylinder_band_becomes_a_ring_that_grows_exponentially() -> None:
    radius, height = 12.0, 15.0
    surface = frustum(low=radius, high=radius, height=height)
    reach = radii_about_hole(conformal_chart(surface))
    along = np.abs(surface.vertices[:, 2] - surface.vertices[boundary_loops(surface)[-1][0], 2])
    np.testing.assert_allclose(np.log(reach / reach.min()), along / radius, atol=0.03)


def test_a_cone_frustum_becomes_a_ring_that_grows_as_a_power_of_the_slant() -> None:
    low, high, height = 20.0, 8.0, 20.0
    surface = frustum(low=low, high=high, height=height)
    reach = radii_about_hole(conformal_chart(surface))
    sine = (low - high) / np.hypot(low - high, height)
    slant = np.hypot(*surface.vertices[:, :2].T)
    np.testing.assert_allclose(np.log(reach / reach.min()), np.log(slant / slant.min()) / sine, atol=0.01)


def test_the_chart_of_a_band_does_not_depend_on_the_numbering() -> None:
    surface = frustum(low=20.0, high=8.0, height=20.0)
    rng = np.random.default_rng(0)
    new_number = rng.permutation(len(surface.vertices))
    renumbered = Surface(surface.vertices[np.argsort(new_number)], new_number[surface.faces])
    found, wanted = (signed_areas(chart.vertices, chart.faces) for chart in map(conformal_chart, (renumbered, surface)))
    np.testing.assert_allclose(found, wanted, rtol=1e-6)


def test_the_chart_of_a_holed_part_runs_counter_clockwise_outside_and_clockwise_round_holes() -> None:
    surface = shared("patches/lv_anterior_annulus_r25_hole_r7.ply")
    part, _ = prepare(load(surface, unit="mm"))
    chart = conformal_chart(part)
    enclosed = [loop_area(chart.vertices[loop]) for loop in boundary_loops(part)]
    assert enclosed[0] > 0.0 > enclosed[1]
    assert sum(enclosed) == pytest.approx(face_areas(part).sum())


def loop_area(corners: FloatArray) -> float:
    x, y = corners[:, 0], corners[:, 1]
    return 0.5 * float(x @ np.roll(y, -1) - np.roll(x, -1) @ y)


@pytest.mark.parametrize("name", PATCHES)
def test_the_chart_of_a_disc_is_that_of_libigl(name: str) -> None:
    igl = pytest.importorskip("igl", reason="libigl is not installed")
    surface, _ = prepare(load(shared(f"patches/{name}.ply"), unit="mm"))
    pins = farthest_pair(surface, boundary_loops(surface)[0])
    flat = np.asarray(igl.lscm(surface.vertices, surface.faces, pins, np.array([[0.0, 0.0], [1.0, 0.0]]))[0])
    chart = conformal_chart(surface).vertices
    own, theirs = (places[:, 0] + 1j * places[:, 1] for places in (chart, flat))
    first, second = own[pins]
    assert np.abs((own - first) / (second - first) - theirs).max() < 1e-6


@pytest.mark.parametrize(
    ("surface", "kind"),
    [
        (sphere(subdivisions=2), "closed, genus 0"),
        (torus(), "closed, genus 1"),
        (Surface(torus().vertices, torus().faces[1:]), "genus 1 with 1 boundary loop"),
        (
            Surface(
                np.concatenate([plate().vertices, plate().vertices + np.array([90.0, 0.0, 0.0])]),
                np.concatenate([plate().faces, plate().faces + len(plate().vertices)]),
            ),
            "2 components",
        ),
    ],
    ids=["sphere", "torus", "handle", "two plates"],
)
def test_what_is_no_part_of_a_plane_is_refused_with_its_kind_and_what_to_do(surface: Surface, kind: str) -> None:
    with pytest.raises(FieldError, match=rf"{kind}\).*smaller open patch, or use `--backend heat`"):
        conformal_chart(surface)


def test_a_chart_that_overlaps_without_a_flip_is_refused_with_its_place() -> None:
    # A ramp that rises once and a quarter round: nearly developable, so that its chart is a ring and a quarter.
    flat = plate((2.5 * np.pi, 6.0), (80, 8), jitter_seed=2)
    turn, reach = flat.vertices[:, 0], 14.0 + flat.vertices[:, 1]
    # The plate's x is the turn and its y points outwards: the winding is turned.
    vertices = np.column_stack([reach * np.cos(turn), reach * np.sin(turn), 0.8 * turn])
    with pytest.raises(
        FieldError, match=r"border of ramp crosses itself \d+ times in the UV map, the first at \("
    ) as e:
        conformal_chart(Surface(vertices, flat.faces[:, ::-1], name="ramp"))
    count, place = e.value.details["count"], np.array(e.value.details["place"])
    assert f"itself {count} times" in str(e.value)
    assert np.linalg.norm(vertices - place, axis=1).min() < 1e-9


def test_a_hole_turned_inside_out_is_refused_though_nothing_crosses_or_flips_there() -> None:
    # z + b / z maps a ring in two sheets where its inner radius is below sqrt(b) < 1; its loops do not cross.
    ring = annulus(inner=0.5, outer=3.0, divisions=(240, 60))
    z = ring.vertices[:, 0] + 1j * ring.vertices[:, 1]
    image = z + 0.6 / z
    flat = np.column_stack([image.real, image.imag])
    loops = boundary_loops(ring)
    ends = [np.roll(loop, -1) for loop in loops]
    assert len(crossing_segments(flat[np.concatenate(loops)], flat[np.concatenate(ends)])) == 0
    good = signed_areas(flat, ring.faces) > 1e-6
    part = Surface(ring.vertices, ring.faces[good], name="ring")
    assert good.mean() > 0.99
    with pytest.raises(FieldError, match="1 of 1 holes of ring are turned inside out"):
        refuse_overlaps(part, flat, loops)


def test_flipped_and_collapsed_triangles_are_refused_with_their_number() -> None:
    surface = plate((4.0, 4.0), (4, 4))
    flat = surface.vertices[:, :2].copy()
    refuse_overlaps(surface, flat, boundary_loops(surface))
    inner = int(np.argmin(np.linalg.norm(flat - 2.0, axis=1)))
    flat[inner] = [3.6, 3.7]
    count = int((signed_areas(flat, surface.faces) <= 0.0).sum())
    with pytest.raises(FieldError, match=f"^{count} of 32 triangles of plate are flipped or collapsed"):
        refuse_overlaps(surface, flat, boundary_loops(surface))


def crossing_by_parameters(start: FloatArray, end: FloatArray) -> IntArray:
    """Solve for the common point of every pair: slow and plain."""
    found: list[tuple[int, int]] = []
    for i in range(len(start)):
        for j in range(i + 1, len(start)):
            system = np.column_stack([end[i] - start[i], start[j] - end[j]])
            if abs(np.linalg.det(system)) > 0.0:
                shares = np.asarray(np.linalg.solve(system, start[j] - start[i]), dtype=np.float64)
                if float(shares.min()) > 0.0 and float(shares.max()) < 1.0:
                    found.append((i, j))
    return np.array(found, dtype=np.int64).reshape(-1, 2)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), spread=st.floats(0.1, 3.0))
def test_crossing_segments_are_those_with_a_common_inner_point(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    start = rng.uniform(0.0, 1.0, (40, 2))
    end = start + rng.normal(size=(40, 2)) * np.exp(spread * rng.normal(size=(40, 1))) * 0.1
    np.testing.assert_array_equal(crossing_segments(start, end), crossing_by_parameters(start, end))


def test_segments_apart_on_one_line_do_not_cross_though_rounding_puts_their_ends_on_either_side() -> None:
    start = np.array([[0.1182872602709719, -0.2595024075854812], [-0.20570465704083962, 0.4512815127458273]])
    end = np.array([[-0.1811790261929029, 0.3974763925831601], [-0.4226043838121327, 0.9271231306245735]])
    assert len(crossing_segments(start, end)) == 0


def test_holes_that_touch_in_a_point_touch_in_the_chart_as_well() -> None:
    whole = plate((40.0, 30.0), (8, 6))
    middles = whole.vertices[whole.faces].mean(axis=1)
    first = (np.abs(middles[:, 0] - 17.5) < 2.5) & (np.abs(middles[:, 1] - 12.5) < 2.5)
    second = (np.abs(middles[:, 0] - 22.5) < 2.5) & (np.abs(middles[:, 1] - 17.5) < 2.5)
    holed, _ = prepare(Surface(whole.vertices, whole.faces[~(first | second)], name="holed"))
    chart = conformal_chart(holed)
    corners = np.flatnonzero(np.linalg.norm(holed.vertices - [20.0, 15.0, 0.0], axis=1) < 1e-9)
    assert corners.size == 2
    np.testing.assert_array_equal(chart.vertices[corners[0]], chart.vertices[corners[1]])
    edge_length = np.linalg.norm(np.diff(holed.vertices[holed.faces[:, :2]], axis=1)[:, 0], axis=1)
    chart_length = np.linalg.norm(np.diff(chart.vertices[chart.faces[:, :2]], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(chart_length, edge_length, rtol=1e-9)


# Distortion of charts against singular values and formulas; the spacing it predicts against measured rings.


def stretched(surface: Surface, along: float, across: float) -> Surface:
    return Surface(surface.vertices * np.array([along, across, 1.0]), surface.faces)


def singular_values(surface: Surface, chart: Surface) -> FloatArray:
    """Return (m, 2) stretches of each triangle, the larger first: slow and plain."""
    found: list[list[float]] = []
    for face in range(len(surface.faces)):
        a, b, c = surface.vertices[surface.faces[face]]
        first = (b - a) / np.linalg.norm(b - a)
        normal = np.cross(b - a, c - a)
        second = np.cross(normal, first) / np.linalg.norm(normal)
        there = np.array([first, second]) @ np.column_stack([b - a, c - a])
        p, q, r = chart.vertices[chart.faces[face], :2]
        stretch = np.column_stack([q - p, r - p]) @ np.linalg.inv(there)
        found.append(np.linalg.svd(stretch, compute_uv=False).tolist())
    return np.array(found)


def test_a_stretched_plate_has_the_dilatation_of_its_stretch_and_an_even_scale() -> None:
    surface = plate(jitter_seed=1)
    measured = distortion(surface, stretched(surface, 3.0, 2.0))
    np.testing.assert_allclose(measured.dilatations, 1.5, rtol=1e-12)
    np.testing.assert_allclose(measured.area_scales, 1.0, rtol=1e-12)
    assert measured.mean_dilatation == pytest.approx(1.5)


def test_a_turned_and_enlarged_plate_has_no_distortion_to_rounding() -> None:
    surface = plate(jitter_seed=1)
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    measured = distortion(surface, Surface(7.0 * surface.vertices @ turn.T, surface.faces))
    np.testing.assert_allclose(measured.dilatations, 1.0, atol=1e-13)


def test_stretches_are_the_singular_values_of_each_triangle() -> None:
    surface = spherical_cap(rings=6, jitter_seed=1)
    chart = conformal_chart(surface)
    measured, stretches = distortion(surface, chart), singular_values(surface, chart)
    np.testing.assert_allclose(measured.dilatations, stretches[:, 0] / stretches[:, 1], rtol=1e-9)
    np.testing.assert_allclose(measured.area_scales, stretches.prod(axis=1), rtol=1e-9)


def test_means_and_percentiles_are_weighted_by_area() -> None:
    measured = Distortion(np.array([1.0, 2.0, 4.0]), np.array([3.0, 1.0, 0.5]), np.array([1.0, 6.0, 3.0]))
    assert measured.mean_dilatation == pytest.approx(2.5)
    assert measured.worst_dilatation == 4.0
    assert [measured.dilatation_percentile(percent) for percent in (0, 10, 11, 70, 71, 100)] == [1, 1, 2, 2, 4, 4]
    assert [measured.scale_percentile(percent) for percent in (1, 50, 99)] == [0.5, 1.0, 3.0]


def test_the_mean_area_scale_is_one_and_angles_get_truer_with_the_mesh() -> None:
    errors: list[float] = []
    for rings in (8, 32):
        surface = spherical_cap(angle=1.2, rings=rings, jitter_seed=1)
        measured = distortion(surface, conformal_chart(surface))
        assert measured.area_scales @ measured.areas == pytest.approx(measured.areas.sum())
        errors.append(measured.mean_dilatation - 1.0)
    # First order in the mesh width: a quarter of it, and a little less.
    assert errors[1] < 0.35 * errors[0]


def test_a_rolled_plate_predicts_the_wanted_spacing() -> None:
    surface = cylinder_patch(divisions=(30, 25), jitter_seed=1)
    points = vertex_points(surface, np.arange(len(surface.vertices)))
    np.testing.assert_allclose(predicted_spacing(surface, conformal_chart(surface), points), 1.0, atol=5e-3)


def test_the_prediction_scales_with_the_lengths_of_the_chart() -> None:
    surface = plate(jitter_seed=1)
    points = vertex_points(surface, np.arange(5))
    np.testing.assert_allclose(predicted_spacing(surface, stretched(surface, 2.0, 2.0), points), 0.5, rtol=1e-12)


def test_ring_spacing_on_a_cap_is_the_predicted_one() -> None:
    radius, angle, rounds = 30.0, np.radians(70.0), 44
    surface = spherical_cap(radius=radius, angle=angle, rings=60, jitter_seed=1)
    # Areas kept, the chart of the cap is a disc of the radius 2 r sin(angle / 2).
    wanted = 2 * radius * np.sin(angle / 2) / rounds
    contours = BACKENDS["lscm"](surface).contours(boundary_source(surface), spacing=wanted)
    levels = np.repeat(contours.levels, np.diff(contours.curves.offsets))
    polar = np.arccos(np.clip(positions(surface, contours.curves.points)[:, 2] / radius, -1.0, 1.0))
    predicted = predicted_spacing(surface, conformal_chart(surface), contours.curves.points)
    # The last ring is half a spacing wide and about the middle of the chart, which misses the pole by part of that.
    count = int(levels.max())
    assert count >= 40
    polar, predicted = ((np.bincount(levels, values) / np.bincount(levels))[:count] for values in (polar, predicted))
    measured = -radius * np.diff(polar) / wanted
    np.testing.assert_allclose(measured, 0.5 * (predicted[1:] + predicted[:-1]), rtol=0.03)
    # Stereographic projection: lengths grow by 1 / cos(polar / 2) squared, 1.49 times over this cap.
    middle = 0.5 * (polar[1:] + polar[:-1])
    formula = np.cos(middle / 2) ** 2 / np.cos(angle / 2)
    np.testing.assert_allclose(measured, formula, rtol=0.03)
    assert measured[-1] / measured[0] == pytest.approx(1 / np.cos(angle / 2) ** 2, rel=0.05)


def test_a_chart_of_another_surface_or_with_a_flip_is_refused() -> None:
    surface, other = plate(), plate(divisions=(9, 6))
    with pytest.raises(InputError, match="it has 108, the surface 96"):
        distortion(surface, other)
    turned = stretched(surface, -1.0, 1.0)
    with pytest.raises(FieldError, match="96 of 96 triangles of plate are flipped"):
        distortion(surface, turned)
    with pytest.raises(FieldError, match="96 of 96"):
        predicted_spacing(surface, turned, vertex_points(surface, np.array([0])))
    assert face_areas(surface).min() > 0.0


# Bands laid flat along a tied cut: exact on developable ones, and nobody can tell where the cut runs.


def side_lengths(vertices: np.ndarray[tuple[int, int], np.dtype[np.float64]], faces: IntArray) -> list[list[float]]:
    corners = vertices[faces]
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).tolist()


@pytest.mark.parametrize(
    ("low", "high", "height"),
    [(12.0, 12.0, 15.0), (20.0, 8.0, 20.0), (20.0, 8.0, 40.0)],
    ids=["cylinder", "cone", "steep"],
)
def test_a_developable_band_keeps_its_lengths_where_uncut_it_loses_them(low: float, high: float, height: float) -> None:
    surface = band(low=low, high=high, height=height)
    chart = flattened(surface)
    # Chords of the mesh are a little shorter than arcs: the polyhedron itself bends by that much.
    found, wanted = (side_lengths(m.vertices, m.faces) for m in (chart.flat, surface))
    np.testing.assert_allclose(found, wanted, rtol=5e-3)
    sine = (low - high) / np.hypot(low - high, height)
    assert chart.continuation.turn == pytest.approx(2 * np.pi * sine, abs=2e-3)
    uncut = distortion(surface, conformal_chart(surface))
    assert uncut.scale_percentile(99) / uncut.scale_percentile(1) > 4.0


def test_a_cylinder_is_moved_by_its_girth() -> None:
    surface = band(low=12.0, high=12.0, height=15.0)
    chart = flattened(surface)
    assert np.linalg.norm(chart.continuation.shift) == pytest.approx(2 * np.pi * 12.0, rel=2e-3)


def test_the_motion_carries_one_side_of_the_cut_into_the_other_and_back() -> None:
    surface = band(low=20.0, high=8.0, height=20.0, bulge=2.0)
    chart = flattened(surface)
    flat = chart.flat.vertices[:, :2]
    left, right = chart.continuation.left, chart.continuation.right
    np.testing.assert_array_equal(left, flat[shortest_edge_path(surface, *boundary_loops(surface))])
    np.testing.assert_array_equal(right, flat[len(surface.vertices) :])
    np.testing.assert_allclose(chart.continuation.moved(right, rounds=1), left, atol=1e-9)
    np.testing.assert_allclose(chart.continuation.moved(left, rounds=-1), right, atol=1e-9)
    np.testing.assert_allclose(
        chart.continuation.moved(chart.continuation.moved(flat, rounds=3), rounds=-3), flat, atol=1e-9
    )
    np.testing.assert_array_equal(chart.continuation.moved(flat, rounds=0), flat)


def test_the_moved_chart_continues_the_chart_beyond_the_cut() -> None:
    surface = band(low=12.0, high=12.0, height=15.0)
    chart = flattened(surface)
    border = boundary_loops(chart.flat)
    assert len(border) == 1
    middles = chart.flat.vertices[chart.flat.faces].mean(axis=1)[:, :2]
    # On a cylinder the chart is a rectangle along the shift: a round takes it to the next one.
    along = middles @ chart.continuation.shift / np.linalg.norm(chart.continuation.shift)
    next_along = (
        chart.continuation.moved(middles, rounds=1)
        @ chart.continuation.shift
        / np.linalg.norm(chart.continuation.shift)
    )
    girth = float(np.linalg.norm(chart.continuation.shift))
    assert next_along.min() - along.max() == pytest.approx(0.0, abs=girth / 72)
    np.testing.assert_allclose(next_along - along, girth)


def test_lengths_do_not_tell_where_the_cut_runs() -> None:
    surface = band(low=20.0, high=8.0, height=20.0, bulge=3.0)
    loops = boundary_loops(surface)
    turn, first = flat_turn(surface, loops), shortest_edge_path(surface, *loops)
    # The grid has rows of 17 vertices: half way round, and not along the shortest path.
    second = (first + 36 * 17) % len(surface.vertices)
    charts = [flattened_band(surface, seam=seam, turn=turn) for seam in (first, second)]
    areas = [signed_areas(chart.flat.vertices, chart.flat.faces) for chart in charts]
    np.testing.assert_allclose(areas[1], areas[0], rtol=1e-8)


def test_the_tricuspid_leaflets_are_flat_to_a_thousandth_where_uncut_they_are_not() -> None:
    surface, _ = prepare(load(shared("hearts/trivalve11_healthy_leaflets.ply"), unit="mm"))
    measured = distortion(surface, flattened(surface).flat)
    assert measured.scale_percentile(1) == pytest.approx(1.0, abs=1e-3)
    assert measured.scale_percentile(99) == pytest.approx(1.0, abs=1e-3)


def test_the_turn_of_a_plane_ring_is_a_full_one_and_it_is_not_cut() -> None:
    ring = annulus(jitter_seed=1)
    assert flat_turn(ring, boundary_loops(ring)) == pytest.approx(2 * np.pi, abs=1e-12)
    assert flattened(ring).continuation is UNCUT


@pytest.mark.parametrize("sine", [0.6, 0.65], ids=["steeper", "flatter"])
def test_a_cone_is_cut_only_where_it_is_so_steep_that_it_turns_by_225_degrees_at_most(sine: float) -> None:
    surface = band(low=20.0, high=8.0, height=12.0 * np.sqrt(1 / sine**2 - 1))
    turn = flat_turn(surface, boundary_loops(surface))
    assert turn == pytest.approx(2 * np.pi * sine, abs=1e-2)
    assert (flattened(surface).continuation is not UNCUT) == (turn <= LARGEST_TURN) == (sine < 0.625)


def test_the_curvature_of_a_bulge_goes_to_both_loops() -> None:
    surface = band(low=12.0, high=12.0, height=15.0, bulge=2.0)
    loops = boundary_loops(surface)
    assert abs(flat_turn(surface, loops)) < 1e-2
    assert all(abs(_turn_on_surface(surface, loop)) > 1.0 for loop in loops)


def _turn_on_surface(surface: Surface, loop: IntArray) -> float:
    corners = surface.vertices[surface.faces]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cosines = (ahead * back).sum(axis=2) / np.linalg.norm(ahead, axis=2) / np.linalg.norm(back, axis=2)
    around = np.bincount(surface.faces.ravel(), np.arccos(cosines).ravel())
    return float((np.pi - around[loop]).sum())


def test_what_is_no_band_is_not_cut() -> None:
    surface = plate(jitter_seed=1)
    chart = flattened(surface)
    assert chart.continuation.rounds == ()
    np.testing.assert_array_equal(chart.flat.vertices, conformal_chart(surface).vertices)


def test_a_continuation_checks_its_arrays() -> None:
    with pytest.raises(InputError, match=r"Continuation\.shift"):
        Continuation(np.zeros((2, 2)), np.ones((2, 2)), 0.0, np.zeros(3))
