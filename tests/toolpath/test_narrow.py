"""Curves that come near to themselves, drawn by hand on a plate: what is too narrow for two beads becomes one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from benchmarks.parts.surfaces import Shape, rectangle, triangulated
from geoprint import measure_paths
from geoprint.distance import BACKENDS
from geoprint.geometry import arc_lengths, boundary_source, closest, positions
from geoprint.model import FloatArray, Surface, SurfaceCurves
from geoprint.toolpath import PATTERNS, arrange
from geoprint.toolpath.medial_axis_fitting import parted
from tests.meshes import annulus, plate

SHEET = plate((40.0, 20.0), (20, 10))


def corners(*places: tuple[float, float], step: float = 0.1) -> FloatArray:
    """A polyline through places, sampled finely."""
    legs = list[FloatArray]()
    for start, end in zip(np.array(places[:-1]), np.array(places[1:]), strict=True):
        share: FloatArray = np.linspace(
            0.0, 1.0, max(round(float(np.linalg.norm(end - start)) / step), 1), endpoint=False
        )
        legs.append(start + share[:, None] * (end - start))
    return np.vstack([*legs, np.array(places[-1:])])


def arc(centre: tuple[float, float], radius: float, start: float, end: float) -> FloatArray:
    angles: FloatArray = np.linspace(start, end, 120)
    return np.array(centre) + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def cut(line: FloatArray, *, spacing: float = 1.0) -> tuple[SurfaceCurves, SurfaceCurves, list[bool]]:
    points, _ = closest(SHEET, np.column_stack([line, np.zeros(len(line))]))
    closed = bool(np.array_equal(line[0], line[-1]))
    curves = SurfaceCurves(points, np.array([0, len(line)]), np.array([closed]))
    found, _, anew = parted(SHEET, curves, spacing=spacing)
    return curves, found, anew.tolist()


def lines(found: SurfaceCurves) -> list[FloatArray]:
    return [found.xyz(SHEET, curve)[:, :2] for curve in range(found.count)]


def nearness(line: FloatArray, *, closed: bool) -> float:
    """Least distance of a line from itself at more than two units along it, written independently of the code."""
    arcs = arc_lengths(line)
    at: FloatArray = np.linspace(0.0, float(arcs[-1]), int(arcs[-1] / 0.05) + 2)
    places = np.column_stack([np.interp(at, arcs, line[:, axis]) for axis in range(line.shape[1])])
    along = np.abs(at[:, None] - at)
    along = np.minimum(along, arcs[-1] - along) if closed else along
    away = np.linalg.norm(places[:, None] - places, axis=2)
    return float(away[along > 2.0].min(initial=np.inf))


@pytest.mark.parametrize("length", [1.5, 20.0])
def test_a_ring_that_is_narrow_everywhere_becomes_one_bead_along_its_middle(length: float) -> None:
    ends = (5.0, 5.0 + length)
    _, found, anew = cut(corners((ends[0], 9.8), (ends[1], 9.8), (ends[1], 10.2), (ends[0], 10.2), (ends[0], 9.8)))
    (bead,) = lines(found)
    assert anew == [True]
    assert not found.closed[0]
    np.testing.assert_allclose(bead[:, 1], 10.0, atol=0.05)
    assert sorted([bead[0, 0], bead[-1, 0]]) == pytest.approx(ends, abs=0.06)


@pytest.mark.parametrize(
    "line",
    [
        # A finger 0.8 wide, and rings as small as may be printed.
        corners((5.0, 9.6), (25.0, 9.6), (25.0, 10.4), (5.0, 10.4), (5.0, 9.6)),
        arc((10.0, 10.0), 0.2, 0.0, 2.0 * np.pi),
        arc((10.0, 10.0), 0.5, 0.0, 2.0 * np.pi),
        # Straight on, and round a right angle.
        corners((5.0, 10.0), (6.0, 10.0)),
        corners((5.0, 5.0), (15.0, 5.0), (15.0, 15.0)),
    ],
    ids=["wide", "tiny ring", "small ring", "short", "corner"],
)
def test_what_is_wide_enough_stays_as_it_is(line: FloatArray) -> None:
    line[-1] = line[0] if np.allclose(line[-1], line[0]) else line[-1]
    curves, found, anew = cut(line)
    assert found is curves
    assert not any(anew)


def ring_with_a_finger(tip: float) -> FloatArray:
    """A ring of radius 5 about (10, 10) with a finger 0.4 wide from (15, 10) to a tip."""
    half = float(np.arcsin(0.2 / 5.0))
    round_part = arc((10.0, 10.0), 5.0, half, 2.0 * np.pi - half)
    finger = corners(tuple(round_part[-1]), (tip, 9.8), (tip, 10.2), tuple(round_part[0]))
    return np.vstack([round_part, finger])


def test_a_finger_is_cut_off_and_its_middle_is_one_bead_to_its_tip() -> None:
    _, found, _ = cut(ring_with_a_finger(20.0))
    assert sorted(found.closed.tolist()) == [False, True]
    bead, ring = sorted(lines(found), key=len)
    # The round part is left, with a chord where the finger was; the bead keeps half a spacing from that.
    assert ring[:, 0].max() == pytest.approx(15.0, abs=0.15)
    assert arc_lengths(ring)[-1] == pytest.approx(2.0 * np.pi * 5.0, abs=0.2)
    assert bead[:, 0].max() == pytest.approx(20.0, abs=0.06)
    assert bead[:, 0].min() == pytest.approx(ring[:, 0].max() + 0.5, abs=0.12)
    np.testing.assert_allclose(bead[:, 1], 10.0, atol=0.05)


def test_a_ring_with_a_short_finger_starts_at_its_tip_and_goes_round_once() -> None:
    _, found, _ = cut(ring_with_a_finger(16.4))
    (line,) = lines(found)
    assert not found.closed[0]
    line = line if line[0, 0] > line[-1, 0] else line[::-1]
    assert line[0] == pytest.approx((16.4, 10.0), abs=0.06)
    # Along the middle of the finger, 1.4 long, and round the ring but for what keeps its end off the foot.
    np.testing.assert_allclose(line[(line[:, 0] > 15.2), 1], 10.0, atol=0.05)
    assert arc_lengths(line)[-1] == pytest.approx(1.4 + 2.0 * np.pi * 5.0 - 0.6, abs=0.5)
    assert np.linalg.norm(line[-1] - (15.0, 10.0)) == pytest.approx(0.65, abs=0.15)
    assert nearness(line, closed=False) >= 0.58


def test_a_ring_with_a_neck_becomes_two_with_a_bead_along_the_neck() -> None:
    half = np.arcsin(0.2 / 4.0)
    left = arc((8.0, 10.0), 4.0, half, 2.0 * np.pi - half)
    right = arc((24.0, 10.0), 4.0, np.pi + half, 3.0 * np.pi - half)
    neck = corners(tuple(left[-1]), tuple(right[0])), corners(tuple(right[-1]), tuple(left[0]))
    _, found, _ = cut(np.vstack([left, neck[0], right, neck[1]]))
    assert sorted(found.closed.tolist()) == [False, True, True]
    (bead,) = (line for line, closed in zip(lines(found), found.closed, strict=True) if not closed)
    # The neck is 8 long; the chords lie a little inside of the rings, and the bead half a spacing from either.
    assert arc_lengths(bead)[-1] == pytest.approx(8.0 - 1.0, abs=0.3)
    for line, closed in zip(lines(found), found.closed, strict=True):
        assert nearness(line, closed=bool(closed)) >= 0.59


def test_an_open_curve_whose_end_comes_back_to_its_side_ends_before_it() -> None:
    _, found, _ = cut(corners((2.0, 10.0), (20.0, 10.0), (20.0, 15.0), (12.0, 15.0), (12.0, 10.2), (8.0, 10.3)))
    (line,) = lines(found)
    assert nearness(line, closed=False) >= 0.58
    np.testing.assert_allclose(line[0], (2.0, 10.0), atol=1e-9)
    assert line[-1] == pytest.approx((12.0, 10.6), abs=0.1)


def test_a_hairpin_of_a_short_open_line_becomes_one_bead() -> None:
    _, found, _ = cut(corners((5.0, 10.0), (6.5, 10.0), (6.5, 10.02), (5.0, 10.02)))
    (bead,) = lines(found)
    assert arc_lengths(bead)[-1] == pytest.approx(1.5, abs=0.1)
    assert nearness(bead, closed=False) == np.inf


def test_the_last_level_of_a_strip_is_one_bead_and_says_how_far_from_the_rim_it_lies() -> None:
    strip = plate((30.0, 7.4), (90, 22))
    backend, source = BACKENDS["fast-marching"](strip), boundary_source(strip)
    drawn = PATTERNS["contours"](middle="plain").paths(strip, source, backend=backend, spacing=1.0)
    # Levels 0.5, 1.5 and 2.5 from the rim are rings; 3.5 has sides 0.4 apart.
    assert drawn.levels.tolist() == [0, 1, 2, 3]
    assert drawn.curves.closed.tolist() == [True, True, True, False]
    bead = drawn.curves.xyz(strip, 3)
    np.testing.assert_allclose(bead[:, 1], 3.7, atol=0.05)
    assert sorted([bead[0, 0], bead[-1, 0]]) == pytest.approx([3.5, 26.5], abs=0.12)
    assert drawn.promised is not None
    np.testing.assert_allclose(drawn.promised[drawn.curves.offsets[3] :][5:-5], 3.7, atol=0.06)
    np.testing.assert_allclose(drawn.promised[: drawn.curves.offsets[1]], 0.5)


@pytest.mark.parametrize("middle", ["plain", "fitted"])
@pytest.mark.parametrize(
    "part",
    [plate((30.0, 7.4), (90, 22)), annulus(inner=10.0, outer=16.8, divisions=(120, 20))],
    ids=["strip", "ring"],
)
def test_a_part_moved_by_a_billionth_of_a_millimetre_has_the_same_runs(part: Surface, middle: str) -> None:
    found = set[tuple[int, int]]()
    for seed in range(3):
        shift = np.random.default_rng(seed).normal(scale=1e-9, size=part.vertices.shape)
        moved = replace(part, vertices=part.vertices + shift * (seed > 0))
        backend = BACKENDS["fast-marching"](moved)
        paths = PATTERNS["contours"](middle=middle).paths(moved, boundary_source(moved), backend=backend, spacing=1.0)
        path = arrange(paths, moved, speed=20.0)
        found.add((path.curves.count, path.dropped_runs))
        places = positions(moved, path.curves.points)
        for run, (first, last) in enumerate(zip(path.curves.offsets[:-1], path.curves.offsets[1:], strict=True)):
            assert nearness(places[first:last], closed=bool(path.curves.closed[run])) > 0.58
    assert len(found) == 1


def hairpin(*, gap: float) -> Surface:
    """A sheet 40 by 12 bent round x = 20, so that its two halves are a gap apart [mm]."""
    flat = plate((40.0, 12.0), (160, 24))
    x, y, _ = flat.vertices.T
    radius = 0.5 * gap
    turn = np.clip((x - 20.0) / radius, -0.5 * np.pi, 0.5 * np.pi)
    along = np.maximum(np.abs(x - 20.0) - 0.5 * np.pi * radius, 0.0)
    bent = np.column_stack([radius * np.cos(turn) - along, y, radius * np.sin(turn)])
    return replace(flat, vertices=bent)


@pytest.mark.parametrize("middle", ["plain", "fitted"])
def test_both_sides_of_a_thin_wall_have_their_own_beads(middle: str) -> None:
    # The halves are 0.4 spacings apart through the wall, where on a flat part one bead would replace two.
    wall = hairpin(gap=0.4)
    backend = BACKENDS["heat"](wall)
    paths = PATTERNS["contours"](middle=middle).paths(wall, boundary_source(wall), backend=backend, spacing=1.0)
    assert paths.curves.closed.tolist() == [True] * 6
    lengths = [float(arc_lengths(paths.curves.xyz(wall, ring))[-1]) for ring in range(6)]
    # Rings at 0.5, 1.5, ... from the rim of a sheet 40 by 12, but for its rounded corners.
    assert lengths == pytest.approx([2.0 * (40.0 + 12.0) - 8.0 * (level + 0.5) for level in range(6)], rel=0.02)


def test_lines_are_none_of_the_curves_own_points_twice() -> None:
    _, found, _ = cut(corners((5.0, 9.8), (25.0, 9.8), (25.0, 10.2), (5.0, 10.2), (5.0, 9.8)))
    (bead,) = lines(found)
    assert KDTree(bead).query_pairs(1e-6) == set()


@pytest.mark.parametrize("backend", ["heat", "fast-marching"])
@pytest.mark.parametrize("width", [9.02, 9.1])
def test_a_last_level_that_errors_of_the_distance_make_is_one_bead(backend: str, width: float) -> None:
    # Nine beads fill the width; the fifth level, 4.5 mm from the rim, comes and goes along the middle.
    flat = Shape((rectangle(20.0, width),), lambda points: np.column_stack([points, np.zeros(len(points))]))
    strip = triangulated(flat, name="strip", faces=4000)
    paths = PATTERNS["contours"](middle="fitted").paths(
        strip, boundary_source(strip), backend=BACKENDS[backend](strip), spacing=1.0
    )
    assert paths.curves.closed.tolist() == [True] * 4 + [False]
    bead = paths.curves.xyz(strip, 4)
    assert np.abs(bead[:, 1] - width / 2.0).max() < 0.1
    assert np.ptp(bead[:, 0]) == pytest.approx(20.0 - width, abs=0.3)


@pytest.mark.parametrize("backend", ["heat", "fast-marching"])
def test_rings_make_way_only_for_a_bead_that_comes(backend: str) -> None:
    # By heat, the innermost ring, about 2.5 across, leaves too little clear for a bead along the middle.
    turns: FloatArray = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
    border = np.column_stack([8.8 * np.cos(turns), 8.4 * np.sin(turns)])
    flat = Shape((border,), lambda points: np.column_stack([points, np.zeros(len(points))]))
    oval = triangulated(flat, name="oval", faces=4000)

    def hole(middle: str) -> float:
        paths = PATTERNS["contours"](middle=middle).paths(
            oval, boundary_source(oval), backend=BACKENDS[backend](oval), spacing=1.0
        )
        lines = [paths.curves.xyz(oval, run) for run in range(paths.curves.count)]
        return measure_paths(oval, lines, spacing=1.0).hole

    # In square spacings; by heat 1.18 was left where rings moved apart for it.
    plain = hole("plain")
    assert hole("fitted") < 1.05 * plain
    assert plain < 0.8
