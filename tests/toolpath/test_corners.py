"""Corners of runs: arcs of known radius and distance, splits, seams, and that nothing is laid at rest."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.distance.heat import Heat
from geoprint.geometry import PolylineDistance, boundary_source, closest, positions
from geoprint.model import FloatArray, SurfacePoints
from geoprint.toolpath import PATTERNS, arrange, posed_surface, poses
from geoprint.toolpath.corners import Rounded, faired, round_corners
from tests.meshes import plate
from tests.robot.cells import straight_cell

SURFACE = plate((40.0, 30.0), (20, 15))
SPACING, SPEED = 1.0, 20.0
STEP = 0.25
# A run that turns by more has a corner, and no arc leaves one.
CORNER = np.radians(30.0)


def line_through(*corners: tuple[float, float]) -> FloatArray:
    """Return samples along a polyline in the plate's plane, its corners among them [mm]."""
    pieces = [
        np.linspace(start, end, round(float(np.hypot(*np.subtract(end, start))) / STEP) + 1)[:-1]
        for start, end in pairwise(corners)
    ]
    flat = np.vstack([*pieces, [corners[-1]]])
    return np.column_stack([flat, np.zeros(len(flat))])


def bend(angle: float, *, first: float = 5.0, last: float = 5.0) -> FloatArray:
    """Return two legs [mm] that meet at (10, 10) under a change of direction [rad]."""
    end = (10.0 + last * np.cos(angle), 10.0 + last * np.sin(angle))
    return line_through((10.0 - first, 10.0), (10.0, 10.0), end)


def missed(found: Rounded, *corners: tuple[float, float]) -> list[float]:
    """Return how far the first piece passes from corners [mm]."""
    places = places_of(found.pieces[0].points)[:, :2]
    return [float(np.linalg.norm(places - corner, axis=1).min()) for corner in corners]


def rounded(places: FloatArray, *, closed: bool = False, speed: float = SPEED, spacing: float = SPACING) -> Rounded:
    points, _ = closest(SURFACE, places)
    return round_corners(SURFACE, [points], closed=[closed], spacing=spacing, speed=speed)


def places_of(points: SurfacePoints) -> FloatArray:
    return positions(SURFACE, points)


def turns(places: FloatArray) -> FloatArray:
    along = np.diff(places, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return np.arccos(np.clip(np.einsum("ij,ij->i", along[1:], along[:-1]), -1.0, 1.0))


@pytest.mark.parametrize("leg", [0.27, 0.3, 0.4])
def test_a_run_hardly_longer_than_its_arc_keeps_the_directions_of_its_ends(leg: float) -> None:
    run = bend(1.1 * CORNER, first=leg, last=leg)
    found = rounded(run)
    places = places_of(found.pieces[0].points)
    assert len(found.fillets) == 1
    assert np.isfinite(places).all()
    np.testing.assert_allclose(places[[0, -1]], run[[0, -1]], atol=1e-9)
    assert turns(places).max() < CORNER
    # Half of the leg but for 0.02 mm to either side, averaged: that times sin(16.5 degrees) / 2.
    assert missed(found, (10.0, 10.0)) == pytest.approx([(leg - 0.02) / 2.0 * 0.28402 / 2.0], rel=0.02)


@pytest.mark.parametrize(("first", "last"), [(0.24, 5.0), (5.0, 0.24)])
def test_a_corner_within_a_quarter_of_a_spacing_of_an_end_stays(first: float, last: float) -> None:
    run = bend(1.0, first=first, last=last)
    found = rounded(run)
    assert len(found.fillets) == len(found.splits) == 0
    np.testing.assert_allclose(places_of(found.pieces[0].points), run, atol=1e-9)


@pytest.mark.parametrize(("degrees", "corners"), [(29.7, 0), (30.3, 1)])
def test_a_corner_turns_by_more_than_thirty_degrees(degrees: float, corners: int) -> None:
    assert len(rounded(bend(np.radians(degrees))).fillets) == corners


@pytest.mark.parametrize(("radius", "corners"), [(0.5, 0), (0.45, 1)])
def test_a_corner_turns_within_a_quarter_of_a_spacing_to_either_side(radius: float, corners: int) -> None:
    # Chords of 0.25 mm about a place of a circle are 0.25 / radius apart: 28.6 degrees, and 31.8.
    turn = np.linspace(0.0, np.pi / 2.0, 40)
    end = line_through((10.0 + radius, 10.0 + radius), (10.0 + radius, 14.0))
    arc = np.column_stack([10.0 + radius * np.sin(turn), 10.0 + radius * (1.0 - np.cos(turn)), np.zeros(40)])
    run = np.vstack([line_through((6.0, 10.0), (10.0, 10.0))[:-1], arc, end[1:]])
    assert len(rounded(run).fillets) == corners


@pytest.mark.parametrize("size", [0.15, 0.2, 0.25])
def test_an_arc_ends_within_half_a_spacing_of_its_corner(size: float) -> None:
    # Half of that but for 0.02 mm is averaged to either side; 32 degrees would else allow 0.213 spacings.
    (found,) = missed(rounded(bend(np.radians(32.0)), spacing=size), (10.0, 10.0))
    assert found == pytest.approx((size / 2.0 - 0.02) / 2.0 * 0.27564 / 2.0, rel=0.01)


def test_arcs_of_neighbouring_corners_part_halfway() -> None:
    # A step to the side of 0.4 mm: 0.2 mm less 0.02 for either arc, half of that averaged.
    first, second = (10.0, 10.0), (10.0 + 0.4 * np.cos(0.6), 10.0 + 0.4 * np.sin(0.6))
    run = line_through((5.0, 10.0), first, second, (second[0] + 5.0, second[1]))
    found = rounded(run)
    assert len(found.fillets) == 2
    assert missed(found, first, second) == pytest.approx([0.09 * np.sin(0.3) / 2.0] * 2, rel=0.02)
    assert turns(places_of(found.pieces[0].points)).max() < CORNER
    # The middle between them stays.
    middle = (0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1]))
    assert missed(found, middle)[0] < 1e-9


def test_a_right_angle_becomes_a_parabola_whose_distance_the_spacing_sets() -> None:
    found = rounded(bend(np.pi / 2.0))
    assert len(found.pieces) == 1
    np.testing.assert_allclose(found.fillets, [[10.0, 10.0, 0.0]], atol=1e-9)
    places = places_of(found.pieces[0].points)
    legs = np.abs(places[:, :2] - 10.0)
    missed = np.hypot(*legs.T).min()
    # A 34th of 1 mm, and the legs of the parabola with that apex: sqrt(x / l) + sqrt(y / l) = 1.
    assert missed == pytest.approx(0.02941, rel=0.01)
    reach = 0.08319
    inside = legs.max(axis=1) < 0.98 * reach
    assert inside.sum() >= 7
    np.testing.assert_allclose(np.sqrt(legs[inside] / reach).sum(axis=1), 1.0, atol=0.01)
    assert turns(places).max() < np.radians(20.0)


def test_a_corner_that_trembles_is_rounded_as_smoothly_as_a_clean_one() -> None:
    clean, shaken = bend(np.pi / 2.0), bend(np.pi / 2.0)
    corner = int(np.linalg.norm(clean - [10.0, 10.0, 0.0], axis=1).argmin())
    beak = np.array([[9.98, 10.0, 0.0], [10.01, 9.995, 0.0], [10.0, 10.03, 0.0]])
    shaken = np.vstack([clean[:corner], beak, clean[corner + 1 :]])
    assert turns(shaken).max() > np.radians(80.0)
    (piece,) = rounded(shaken).pieces
    assert turns(places_of(piece.points)).max() < np.radians(25.0)


def test_steps_grow_and_shrink_gradually_about_a_corner() -> None:
    places = places_of(rounded(bend(np.pi / 2.0)).pieces[0].points)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert steps.min() < 0.02
    ratios = steps[1:] / steps[:-1]
    assert max(ratios.max(), (1.0 / ratios).max()) < 3.0


@settings(max_examples=25, deadline=None)
@given(st.floats(0.6, 1.65))
def test_an_arc_keeps_its_distance_and_joins_the_legs_without_a_bend(angle: float) -> None:
    original = bend(angle)
    found = rounded(original)
    places = places_of(found.pieces[0].points)
    assert len(found.fillets) == 1
    assert PolylineDistance([original], step=0.2)(places).max() <= 0.05 * SPACING
    assert PolylineDistance([places], step=0.2)(original).max() <= 0.05 * SPACING
    assert turns(places).max() < CORNER
    np.testing.assert_allclose(places[[0, -1]], original[[0, -1]], atol=1e-9)


def test_a_gentle_bend_stays_as_it_is() -> None:
    found = rounded(bend(0.4))
    assert len(found.fillets) == len(found.splits) == 0
    np.testing.assert_allclose(places_of(found.pieces[0].points), bend(0.4), atol=1e-9)


def test_a_hairpin_is_split_and_both_runs_end_at_it() -> None:
    found = rounded(bend(2.8))
    assert [piece.closed for piece in found.pieces] == [False, False]
    np.testing.assert_allclose(found.splits, [[10.0, 10.0, 0.0]], atol=1e-9)
    before, after = (places_of(piece.points) for piece in found.pieces)
    np.testing.assert_allclose([before[-1], after[0]], [[10.0, 10.0, 0.0]] * 2, atol=1e-9)


@pytest.mark.parametrize(("speed", "fillets"), [(21.6, 1), (22.8, 0)])
def test_a_run_is_split_where_the_tip_would_fall_below_35_percent_of_its_speed(speed: float, fillets: int) -> None:
    # The parabola of a right angle has legs of 0.0832 mm and so a smallest radius of 0.0588 mm, which 1000 mm/s2 pass
    # at 7.67 mm/s: 35 % of 21.91.
    found = rounded(bend(np.pi / 2.0), speed=speed)
    assert (len(found.fillets), len(found.splits)) == (fillets, 1 - fillets)


def test_what_is_split_at_speed_is_rounded_where_the_tip_is_slow() -> None:
    assert len(rounded(bend(2.3), speed=20.0).splits) == 1
    slow = rounded(bend(2.3), speed=5.0)
    assert (len(slow.fillets), len(slow.splits)) == (1, 0)


def test_a_closed_run_with_a_corner_at_its_seam_stays_closed_and_starts_there() -> None:
    square = [(10.0, 10.0), (20.0, 10.0), (20.0, 20.0), (10.0, 20.0)]
    ring = line_through((10.2, 10.0), *square[1:], square[0], (10.2, 10.0))
    found = rounded(ring, closed=True)
    assert [piece.closed for piece in found.pieces] == [True]
    assert len(found.fillets) == 3
    places = places_of(found.pieces[0].points)
    np.testing.assert_allclose(places[[0, -1]], [[10.0, 10.0, 0.0]] * 2, atol=1e-9)
    # No place is passed twice, and the sides are where they were.
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).min() > 1e-3
    assert PolylineDistance([ring], step=0.2)(places).max() < 0.05
    assert missed(found, *square[1:]) == pytest.approx([0.02941] * 3, rel=0.01)


@pytest.mark.parametrize("seed", range(6))
def test_rounding_does_not_decide_at_which_of_two_like_corners_a_closed_run_starts(seed: int) -> None:
    """Its seam lies in the middle of a side that is shorter than the reach, so that both corners are next to it."""
    ring = line_through((10.2, 10.0), (10.4, 10.0), (10.4, 12.0), (10.0, 12.0), (10.0, 10.0), (10.2, 10.0))
    noise = np.random.default_rng(seed).normal(scale=1e-9, size=ring.shape)
    noise[-1] = noise[0]
    own, other = (places_of(rounded(each, closed=True).pieces[0].points) for each in (ring, ring + noise))
    np.testing.assert_allclose(other, own, atol=1e-6)


def test_a_closed_run_with_two_hairpins_becomes_two_open_ones() -> None:
    needle = line_through((15.0, 10.0), (25.0, 10.2), (15.0, 10.4), (5.0, 10.2), (15.0, 10.0))
    found = rounded(needle, closed=True)
    assert [piece.closed for piece in found.pieces] == [False, False]
    ends = np.array([places_of(piece.points)[[0, -1]] for piece in found.pieces])
    np.testing.assert_allclose(ends[0], ends[1, ::-1], atol=1e-9)
    assert sorted(ends[0, :, 0].round(6).tolist()) == [5.0, 25.0]


def test_nothing_is_laid_at_rest_on_a_plate_and_every_corner_is_told() -> None:
    surface = plate((40.0, 30.0), (80, 60))
    paths = PATTERNS["contours"]().paths(surface, boundary_source(surface), backend=Heat(surface), spacing=4.0)
    toolpath = arrange(paths, surface, speed=SPEED)
    stream = poses(
        toolpath, posed_surface(surface, part=surface, body=None), R_base_work=np.eye(3), standoff=0.3, retract=5.0,
        layer_height=0.5, max_tilt=0.2, tool=straight_cell().tool,
    )  # fmt: skip
    assert stream.stops_while_laying == 0
    assert len(toolpath.splits) == 0
    # Four rectangles; one corner of each may be its seam.
    assert 12 <= len(toolpath.fillets) <= 16


def test_a_closed_run_with_one_hairpin_starts_and_ends_at_it() -> None:
    turn = np.linspace(-np.pi / 2.0, np.pi / 2.0, 60)
    arc = np.column_stack([20.0 + 1.5 * np.cos(turn), 10.0 + 1.5 * np.sin(turn), np.zeros(60)])
    lower, upper = line_through((8.0, 10.0), (20.0, 8.5)), line_through((20.0, 11.5), (8.0, 10.0))
    drop = np.vstack([lower[:-1], arc, upper[1:]])
    middle = len(lower) + 30
    found = rounded(np.vstack([drop[middle:-1], drop[: middle + 1]]), closed=True)
    assert [piece.closed for piece in found.pieces] == [True]
    assert len(found.splits) == len(found.fillets) == 0
    places = places_of(found.pieces[0].points)
    np.testing.assert_allclose(places[[0, -1]], [[8.0, 10.0, 0.0]] * 2, atol=1e-9)
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).min() > 1e-3
    assert PolylineDistance([places], step=0.2)(drop).max() < 1e-9


@pytest.mark.parametrize(("beyond", "kept"), [(0.0092, 0), (0.0108, 1)])
def test_samples_within_a_hundredth_of_a_millimetre_of_an_arc_are_dropped(beyond: float, kept: int) -> None:
    # The arc of a right angle reaches 0.16638 mm along either leg.
    reach, end = 0.16638, (10.0, 15.0)
    before, after = (10.0 - reach - beyond, 10.0), (10.0, 10.0 + reach + beyond)
    run = line_through((5.0, 10.0), before, (10.0, 10.0), after, end)
    assert [away < 1e-9 for away in missed(rounded(run), before, after)] == [bool(kept)] * 2


# Runs without tremor: what trembles goes, what bends stays, and nothing leaves its place or the surface.


def faired_places(places: FloatArray, *, closed: bool = False, spacing: float = 1.0) -> FloatArray:
    points, _ = closest(SURFACE, places)
    (found,) = faired(SURFACE, [points], closed=[closed], spacing=spacing)
    return positions(SURFACE, found)


def circle(radius: float, *, tremor: float = 0.0, waves: int = 0) -> FloatArray:
    """Return a closed run about (20, 15) whose radius trembles by so much [mm] in so many waves."""
    turn = np.linspace(0.0, 2.0 * np.pi, 2 * max(waves, 200) + 1)
    at = radius + tremor * np.cos(waves * turn)
    return np.column_stack([20.0 + at * np.cos(turn), 15.0 + at * np.sin(turn), np.zeros(turn.size)])


def radii(places: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(places[:, :2] - [20.0, 15.0], axis=1))


def test_waves_as_short_as_an_edge_go_and_the_circle_stays() -> None:
    # 94 waves in 31.4 mm: a third of the spacing long, as a level curve trembles from edge to edge.
    shaken = circle(5.0, tremor=0.012, waves=94)
    assert np.ptp(radii(shaken)) > 0.023
    assert np.abs(radii(faired_places(shaken, closed=True)) - 5.0).max() < 0.0015


@pytest.mark.parametrize(("radius", "most"), [(1.0, 0.0016), (2.0, 0.0003), (5.0, 0.0002)])
def test_a_circle_is_left_by_far_less_than_it_bends(radius: float, most: float) -> None:
    # One window would shrink it by 0.02 / radius.
    assert np.abs(radii(faired_places(circle(radius), closed=True)) - radius).max() < most


def test_no_place_moves_by_more_than_a_fiftieth_of_the_spacing() -> None:
    saw = np.array([[5.0 + row / 3.0, 15.0 + 0.3 * (row % 2), 0.0] for row in range(61)])
    away = PolylineDistance([saw], step=0.2)(faired_places(saw))
    assert 0.01 < away.max() <= 0.02 + 1e-9


def test_an_open_run_keeps_its_ends_and_a_straight_one_all_of_it() -> None:
    line = np.column_stack([np.linspace(3.0, 9.0, 13), np.linspace(4.0, 12.0, 13), np.zeros(13)])
    found = faired_places(line)
    np.testing.assert_allclose(found[[0, -1]], line[[0, -1]], atol=1e-12)
    assert PolylineDistance([line], step=0.2)(found).max() < 1e-9


def test_a_closed_run_ends_where_it_starts() -> None:
    found = faired_places(circle(3.0), closed=True)
    np.testing.assert_array_equal(found[0], found[-1])
    # The window runs across the seam: the run is as round there as elsewhere.
    steps = np.diff(found, axis=0)
    angles = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs((np.diff(np.append(angles, angles[0])) + np.pi) % (2.0 * np.pi) - np.pi)
    assert np.ptp(turns) < 0.1 * turns.mean()


def test_runs_are_faired_each_by_itself() -> None:
    first, second = (closest(SURFACE, circle(radius))[0] for radius in (3.0, 6.0))
    both = faired(SURFACE, [first, second], closed=[True, True], spacing=1.0)
    for alone, together in zip((first, second), both, strict=True):
        (found,) = faired(SURFACE, [alone], closed=[True], spacing=1.0)
        np.testing.assert_array_equal(found.faces, together.faces)
        np.testing.assert_array_equal(found.weights, together.weights)
    assert faired(SURFACE, [], closed=[], spacing=1.0) == []


def test_the_smallest_run_is_still_a_run() -> None:
    short = np.array([[10.0, 10.0, 0.0], [10.1, 10.0, 0.0]])
    points, _ = closest(SURFACE, short)
    (found,) = faired(SURFACE, [points], closed=[False], spacing=1.0)
    assert isinstance(found, SurfacePoints)
    np.testing.assert_allclose(positions(SURFACE, found)[[0, -1]], short, atol=1e-12)
