"""The measure of uniformity against paths whose spacing, gaps, overlaps and widths are known."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.parts.surfaces import make
from geoprint.errors import FieldError
from geoprint.metrics import LevelSpacings, Uniformity, measure_paths, uniformity
from geoprint.metrics.levels import levelled
from geoprint.model import FloatArray, PoseStream, Surface
from geoprint.postprocessor import poses_table
from tests.meshes import cylinder_patch, disc, plate, spherical_cap
from tests.metrics.deposits import circle, deposited, rectangle_line, straight_line
from tests.shared_data import shared


def levels_of(found: Uniformity) -> LevelSpacings:
    assert found.levels is not None
    return found.levels


def rows(heights: list[float], *, wobble: float = 0.0) -> PoseStream:
    """Return level runs along x over the plate; `wobble` is an amplitude [mm] of every second run."""
    lines = [straight_line((0.0, y), (40.0, y), points=401) for y in heights]
    for line in lines[1::2]:
        line[:, 1] += wobble * np.sin(line[:, 0])
    return deposited(lines, range(len(lines)))


def fine_plate() -> Surface:
    return plate((40.0, 30.0), (40, 30))


def rectangles(spacing: float) -> PoseStream:
    """Return the exact level curves of the distance from the border of the plate."""
    insets = np.arange(spacing / 2, 15.0, spacing)
    return deposited([rectangle_line((d, d), (40.0 - d, 30.0 - d)) for d in insets.tolist()], range(insets.size))


def rolled(stream: PoseStream, *, radius: float, angle: float) -> PoseStream:
    """Return a stream on the plate rolled around a cylinder."""
    flat = stream.surface_points
    turn = flat[:, 0] / radius - angle / 2
    points = np.column_stack([radius * np.sin(turn), flat[:, 1], radius * np.cos(turn)])
    pieces = np.split(points, np.flatnonzero(np.diff(stream.runs)) + 1)
    return deposited(pieces, range(len(pieces)))


@cache
def exact_contours(name: str) -> tuple[Surface, PoseStream, float]:
    """Return a surface, the level curves of its distance from the border by formula, and their spacing."""
    if name == "plate":
        return fine_plate(), rectangles(2.0), 2.0
    if name == "cylinder":
        surface = cylinder_patch(radius=40.0 / 1.5, angle=1.5, length=30.0, divisions=(60, 24))
        return surface, rolled(rectangles(2.0), radius=40.0 / 1.5, angle=1.5), 2.0
    if name == "cone":
        slants = 30.0 - np.arange(1.0, 26.0, 2.0)
        half = np.pi / 6
        circles = [circle(s * np.sin(half), height=-s * np.cos(half)) for s in slants.tolist()]
        return make("cone", faces=4000), deposited(circles, range(len(circles))), 2.0
    polar = 1.0 - np.arange(1.0, 27.0, 2.0) / 30.0
    circles = [circle(30.0 * np.sin(a), height=30.0 * np.cos(a)) for a in polar.tolist()]
    return spherical_cap(radius=30.0, angle=1.0, rings=32), deposited(circles, range(len(circles))), 2.0


@cache
def measured_contours(name: str) -> Uniformity:
    surface, stream, spacing = exact_contours(name)
    return uniformity(stream, surface, spacing=spacing)


@pytest.mark.parametrize("name", ["plate", "cylinder", "cone", "cap"])
def test_exact_contours_are_one_spacing_apart(name: str) -> None:
    found = measured_contours(name)
    assert levels_of(found).figures.mean == pytest.approx(1.0, abs=0.002)
    assert levels_of(found).figures.cv <= 0.003
    assert levels_of(found).bounded == 0.0


def test_even_lines_are_one_spacing_apart_everywhere() -> None:
    found = uniformity(rows([1.0, 3.0, 5.0, 7.0]), fine_plate(), spacing=2.0)
    np.testing.assert_allclose(levels_of(found).ratios, 1.0, atol=1e-9)
    assert levels_of(found).figures.cv == pytest.approx(0.0, abs=1e-9)
    assert levels_of(found).figures.within_5_percent == 1.0
    assert found.length == pytest.approx(160.0)
    assert found.fill == pytest.approx(160.0 * 2.0 / 1200.0)


def test_lines_displaced_by_a_tenth_are_reported_as_a_tenth() -> None:
    found = uniformity(rows([1.0, 3.2, 5.2]), fine_plate(), spacing=2.0)
    assert sorted(set(levels_of(found).ratios.round(9).tolist())) == [1.0, 1.1]
    assert levels_of(found).figures.mean == pytest.approx(1.05, abs=1e-3)
    assert levels_of(found).figures.cv == pytest.approx(0.05 / 1.05, rel=1e-2)
    assert [(one.level, round(one.mean, 9), round(one.worst, 9)) for one in levels_of(found).by_level()] == [
        (1, 1.1, 1.1),
        (2, 1.0, 1.0),
    ]


def test_circles_a_tenth_too_far_on_a_cap_are_reported_as_a_tenth() -> None:
    polar = 0.95 - np.arange(0.0, 8.0) * 2.2 / 30.0
    stream = deposited([circle(30.0 * np.sin(a), height=30.0 * np.cos(a)) for a in polar.tolist()], range(8))
    found = uniformity(stream, spherical_cap(radius=30.0, angle=1.0, rings=32), spacing=2.0)
    assert levels_of(found).figures.mean == pytest.approx(1.1, abs=0.002)
    assert levels_of(found).figures.cv <= 0.003


def test_the_distance_runs_over_the_surface_and_not_through_the_air() -> None:
    # Two walls of a narrow ditch: 1 mm apart in the air, 11 mm along the ground.
    profile = np.array([[-10.0, 0.0], [0.0, 0.0], [0.0, -5.0], [1.0, -5.0], [1.0, 0.0], [11.0, 0.0]])
    vertices = np.array([[x, y, z] for x, z in profile for y in (0.0, 40.0)])
    faces = np.array([face for i in range(0, 10, 2) for face in ((i, i + 2, i + 1), (i + 1, i + 2, i + 3))])
    y = np.linspace(0.0, 40.0, 81)
    lines = [np.column_stack([np.full(81, x), y, np.zeros(81)]) for x in (0.0, 1.0)]
    found = uniformity(deposited(lines, [0, 1]), Surface(vertices, faces), spacing=11.0)
    np.testing.assert_allclose(levels_of(found).ratios, 1.0, atol=1e-9)
    np.testing.assert_allclose(levels_of(found).straight, 1.0 / 11.0, atol=1e-9)


def covered_twice_and_not_at_all() -> Uniformity:
    heights = [1.0, 3.0, 5.0, 5.8, 8.4, 10.4]  # two pairs are 0.8 and 2.6 mm apart instead of 2
    return uniformity(rows(heights), fine_plate(), spacing=2.0)


def test_the_gap_is_the_area_that_no_run_reaches() -> None:
    found = covered_twice_and_not_at_all()
    # Above the last line 30 - 11.5, and 0.4 between the lines that are too far apart.
    assert found.gap == pytest.approx((18.5 + 0.4) / 30.0, abs=0.002)


def test_the_overlap_is_the_area_near_two_runs() -> None:
    # Lines 0.8 mm apart share a strip of 1.8 - 0.8 mm; the others are 2 mm apart or more, beyond 1.8 mm.
    assert covered_twice_and_not_at_all().overlap == pytest.approx(1.0 / 30.0, abs=0.001)


def test_the_middle_of_a_small_circle_is_not_overlapped_by_its_own_far_side() -> None:
    found = uniformity(deposited([circle(3.0), circle(0.8)], [0, 1]), disc(radius=6.0, rings=12), spacing=2.0)
    assert found.overlap == 0.0
    # Within 0.55 spacings of either circle, of 36 pi mm2.
    assert found.gap == pytest.approx((36.0 - 4.1**2) / 36.0, abs=0.003)


def test_the_width_is_the_strip_nearest_to_each_run() -> None:
    surface = plate((40.0, 30.0), (40, 30), jitter_seed=1)
    found = uniformity(rows([1.0, 3.0, 5.4, 7.4]), surface, spacing=2.0)
    middle = (np.abs(found.sides.places[:, 0] - 20.0) < 15.0) & np.isin(found.runs, [1, 2])
    widths = [found.widths[middle & (found.runs == run)].mean() for run in (1, 2)]
    assert widths == pytest.approx([1.1, 1.1], abs=0.003)
    assert found.widths[middle].std() < 0.006


def test_the_width_of_even_lines_hardly_varies() -> None:
    found = uniformity(rows([1.0 + 2.0 * k for k in range(15)]), fine_plate(), spacing=2.0)
    assert found.width_cv < 0.01
    assert found.widths.mean() == pytest.approx(1.0, abs=0.002)
    assert found.fill == pytest.approx(1.0)


def test_samples_near_another_stretch_of_their_level_are_counted() -> None:
    # Level 1 comes back 1.5 mm beside itself.
    hairpin = np.concatenate([straight_line((0.0, 3.0), (40.0, 3.0)), straight_line((40.0, 4.5), (0.0, 4.5))])
    stream = deposited([straight_line((0.0, 1.0), (40.0, 1.0)), hairpin], [0, 1])
    assert levels_of(uniformity(stream, fine_plate(), spacing=2.0)).meeting == pytest.approx(1.0, abs=0.05)
    assert levels_of(uniformity(rows([1.0, 3.0, 5.0]), fine_plate(), spacing=2.0)).meeting == 0.0


def test_offsets_cut_the_samples_into_runs() -> None:
    found = uniformity(rows([1.0, 3.0, 5.0]), fine_plate(), spacing=2.0)
    assert levels_of(found).offsets[0] == 0
    assert levels_of(found).offsets[-1] == len(levels_of(found).places)
    pieces = np.split(levels_of(found).places, levels_of(found).offsets[1:-1])
    assert [float(piece[0, 1]) for piece in pieces] == [3.0, 5.0]


def test_the_worst_places_are_apart_and_the_worst_comes_first() -> None:
    found = uniformity(rows([1.0, 3.0, 5.0], wobble=0.3), fine_plate(), spacing=2.0)
    worst = levels_of(found).worst(4, spacing=2.0)
    deviations = [abs(place.ratio - 1.0) for place in worst]
    assert deviations == sorted(deviations, reverse=True)
    assert deviations[0] == float(np.abs(levels_of(found).ratios - 1.0).max())
    points = np.array([place.place for place in worst])
    apart = np.linalg.norm(points[:, None] - points, axis=2)[np.triu_indices(4, 1)]
    assert apart.min() > 4.0


def test_refining_the_surface_changes_nothing() -> None:
    _, stream, spacing = exact_contours("plate")
    coarse, fine = (uniformity(stream, plate((40.0, 30.0), cuts), spacing=spacing) for cuts in ((4, 3), (40, 30)))
    np.testing.assert_allclose(levels_of(coarse).ratios, levels_of(fine).ratios, atol=1e-9)
    assert coarse.gap == pytest.approx(fine.gap, abs=0.002)
    assert coarse.width_cv == pytest.approx(fine.width_cv, abs=0.005)


def test_too_little_work_is_told_and_bounded() -> None:
    surface, stream, spacing = exact_contours("cap")
    whole = measured_contours("cap")
    little = uniformity(stream, surface, spacing=spacing, windows=100_000)
    assert levels_of(little).bounded > 0.3
    assert little.unknown > 0.5
    assert (levels_of(little).bounds <= levels_of(whole).ratios + 1e-9).all()
    assert (levels_of(little).ratios >= levels_of(whole).ratios - 1e-9).all()
    assert levels_of(little).largest_doubt < 0.1


def test_one_level_has_no_spacing_to_measure() -> None:
    found = uniformity(rows([15.0]), fine_plate(), spacing=2.0)
    assert not levels_of(found).figures.measured
    assert np.isnan([levels_of(found).figures.mean, levels_of(found).figures.cv]).all()
    assert levels_of(found).by_level() == levels_of(found).worst(3, spacing=2.0) == ()
    # What is covered is measured all the same: the row in the middle reaches 1.1 mm to either side of 30 mm.
    assert found.gap == pytest.approx(1.0 - 2.2 / 30.0, abs=0.01)


def test_a_path_beside_the_surface_is_refused() -> None:
    with pytest.raises(FieldError, match="away from plate in run 2"):
        uniformity(rows([1.0, 33.0]), fine_plate(), spacing=2.0)


def test_paths_that_cover_the_part_too_often_for_their_length_are_refused() -> None:
    # 8000 rows of 40 mm at a spacing of 5 mm: 320 m cover 1200 mm2 more than 1300 times.
    row = np.array([[0.0, 15.0, 0.0], [40.0, 15.0, 0.0]])
    with pytest.raises(FieldError, match=r"cover the part 1\.3e\+03 times: .* at most 1\.5e\+04 are measured"):
        measure_paths(fine_plate(), [row] * 8000, spacing=5.0)


def test_the_check_from_outside_agrees(tmp_path: Path) -> None:
    check = shared("patches").parents[1] / "checks" / "spacing.py"
    stream = rows([1.0, 3.1, 5.0, 7.0], wobble=0.15)
    (tmp_path / "poses.csv").write_bytes(poses_table(stream))
    command = [sys.executable, str(check), str(tmp_path), "--spacing", "2.0", "--json"]
    outside = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    inside = uniformity(stream, fine_plate(), spacing=2.0)
    assert levels_of(inside).figures.mean == pytest.approx(outside["mean"], abs=1e-4)
    assert levels_of(inside).figures.cv == pytest.approx(outside["cv"], abs=1e-4)


def lengths(points: FloatArray) -> FloatArray:
    return np.linalg.norm(np.diff(points, axis=0), axis=1)


def test_samples_stand_a_quarter_of_a_spacing_apart() -> None:
    found = uniformity(rows([1.0, 3.0, 5.0]), fine_plate(), spacing=2.0)
    np.testing.assert_allclose(lengths(levels_of(found).places[: levels_of(found).offsets[1]]), 0.5, atol=1e-9)


# Paths are measured to both sides, and those of whole levels outwards as well.


SURFACE = plate((40.0, 20.0), (40, 20), jitter_seed=1)
ROWS = (3.0, 5.0, 7.4, 9.0, 11.0)


def serpentine(rows: tuple[float, ...] = ROWS) -> PoseStream:
    """Return one run that goes to and fro along rows of a plate, joined at their ends; the row is the level."""
    ends = [((4.0, y), (36.0, y)) if index % 2 == 0 else ((36.0, y), (4.0, y)) for index, y in enumerate(rows)]
    lines = [straight_line(start, end, points=129) for start, end in ends]
    whole = deposited([np.concatenate(lines)], [0])
    return replace(whole, levels=np.repeat(np.arange(len(rows)), 129))


def test_a_run_through_several_levels_has_none_and_runs_of_one_level_each_have() -> None:
    lines = [straight_line((4.0, y), (36.0, y)) for y in ROWS]
    assert levelled(deposited(lines, range(len(ROWS))))
    assert not levelled(serpentine())


def test_rows_joined_to_one_run_are_measured_to_both_sides() -> None:
    found = uniformity(serpentine(), SURFACE, spacing=2.0)
    assert found.levels is None
    places, ratios = found.sides.places, found.sides.sides()
    inside = (places[:, 0] > 8.0) & (places[:, 0] < 32.0)
    for row, near in ((0, {1.0}), (1, {1.0, 1.2}), (2, {1.2, 0.8}), (3, {0.8, 1.0}), (4, {1.0})):
        here = ratios[inside & (np.abs(places[:, 1] - ROWS[row]) < 1e-6)]
        assert set(here[np.isfinite(here)].round(3).tolist()) == near


def test_whole_levels_are_measured_outwards_too() -> None:
    lines = [straight_line((4.0, y), (36.0, y)) for y in ROWS]
    found = uniformity(deposited(lines, range(len(ROWS))), SURFACE, spacing=2.0)
    levels = found.levels
    assert levels is not None
    assert [levels.ratios[levels.levels == level].mean() for level in (1, 2, 3, 4)] == pytest.approx(
        [1.0, 1.2, 0.8, 1.0]
    )
    assert levels.bounded == 0.0
