"""Bands laid flat along a tied cut: exact on developable ones, and nobody can tell where the cut runs."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance.distortion import distortion, signed_areas
from geoprint.distance.lscm_chart import conformal_chart
from geoprint.distance.lscm_seam import (
    LARGEST_TURN,
    UNCUT,
    Continuation,
    flat_turn,
    flattened,
    flattened_band,
    shortest_cut,
)
from geoprint.errors import InputError
from geoprint.geometry import boundary_loops, prepare
from geoprint.geometry.files import load
from geoprint.model import IntArray, Surface
from tests.distance.bands import band
from tests.meshes import annulus, plate
from tests.shared_data import shared


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
    np.testing.assert_array_equal(left, flat[shortest_cut(surface, boundary_loops(surface))])
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
    turn, first = flat_turn(surface, loops), shortest_cut(surface, loops)
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
