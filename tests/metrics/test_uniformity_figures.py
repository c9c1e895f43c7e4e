"""What is told of measured spacings: figures by hand, of samples that are given and not measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import FieldError, InputError
from geoprint.geometry import united
from geoprint.metrics import LevelSpacings, Uniformity, WorstPlace, uniformity
from geoprint.model import Surface
from tests.meshes import plate
from tests.metrics.deposits import deposited, straight_line


def given(
    ratios: list[float], *, bounds: list[float] | None = None, levels: list[int] | None = None, apart: float = 10.0
) -> LevelSpacings:
    """Return what is told of samples in a row along x, of runs 2 mm apart, with these ratios."""
    count = len(ratios)
    found = np.ones(count, dtype=np.int64) if levels is None else np.array(levels)
    places = np.zeros((count, 3))
    places[:, 0] = apart * np.arange(count)
    return LevelSpacings(
        places=places,
        offsets=np.array([0, count]),
        runs=found,
        levels=found,
        ratios=np.array(ratios),
        bounds=np.array(ratios if bounds is None else bounds),
        straight=np.array(ratios),
        unreached=0,
        meeting=0.0,
    )


def test_mean_variation_and_percentiles_are_those_of_the_ratios() -> None:
    found = given([0.8, 1.0, 1.0, 1.4]).figures
    assert found.measured
    assert found.mean == pytest.approx(1.05)
    # Squares of 0.25, 0.05, 0.05 and 0.35: 0.19 in all.
    assert found.cv == pytest.approx(np.sqrt(0.19 / 4.0) / 1.05)
    assert (found.percentile(0.0), found.percentile(50.0), found.percentile(100.0)) == (0.8, 1.0, 1.4)


def test_five_percent_of_the_spacing_to_either_side_count_as_even() -> None:
    assert given([0.9499, 0.9501, 1.0499, 1.0501]).figures.within_5_percent == 0.5


def test_what_is_not_exact_is_told_with_its_share_and_largest_doubt() -> None:
    exact = given([1.0, 1.1])
    assert (exact.bounded, exact.largest_doubt) == (0.0, 0.0)
    found = given([1.0, 1.1, 1.2, 1.3], bounds=[1.0, 1.05, 0.9, 1.3])
    assert found.bounded == 0.5
    assert found.largest_doubt == pytest.approx(0.3)


def test_of_no_samples_nothing_is_told() -> None:
    assert given([1.0]).figures.measured
    none = given([])
    assert not none.figures.measured
    assert np.isnan([none.figures.mean, none.figures.cv, none.figures.within_5_percent]).all()
    assert (none.bounded, none.largest_doubt) == (0.0, 0.0)
    assert none.by_level() == none.worst(3, spacing=2.0) == ()


def test_every_level_has_its_own_figures() -> None:
    first, second, third = given([0.9, 1.0, 1.3, 0.6, 0.8, 1.3], levels=[1, 1, 3, 3, 4, 4]).by_level()
    assert (first.level, first.mean, first.worst) == (1, pytest.approx(0.95), 0.9)
    assert first.cv == pytest.approx(0.05 / 0.95)
    # 0.6 is farther from 1 than 1.3.
    assert (second.level, second.mean, second.worst) == (3, pytest.approx(0.95), 0.6)
    assert second.cv == pytest.approx(0.35 / 0.95)
    assert (third.level, third.worst) == (4, 1.3)


def test_worst_places_are_more_than_two_spacings_apart_and_as_many_as_asked() -> None:
    # 4 mm are two spacings: nearer to a worst place there is no other one.
    assert [place.ratio for place in given([1.4, 0.5, 1.3], apart=3.99).worst(5, spacing=2.0)] == [0.5]
    assert [place.ratio for place in given([1.4, 0.5, 1.3], apart=4.01).worst(5, spacing=2.0)] == [0.5, 1.4, 1.3]
    far = given([1.1, 0.5, 1.3], levels=[1, 2, 3])
    assert far.worst(2, spacing=2.0) == (WorstPlace((10.0, 0.0, 0.0), 2, 0.5), WorstPlace((20.0, 0.0, 0.0), 3, 1.3))
    assert far.worst(0, spacing=2.0) == ()
    # A fifth too far is worse than a seventh too near.
    assert [place.ratio for place in given([0.86, 1.2]).worst(2, spacing=2.0)] == [1.2, 0.86]


def test_samples_that_do_not_belong_together_are_refused_and_the_others_are_held() -> None:
    found = given([1.0, 1.1])
    assert not found.ratios.flags.writeable
    with pytest.raises(InputError, match="bounds"):
        replace(found, bounds=np.ones(3))


def rows(*heights: float, levels: list[int]) -> Uniformity:
    lines = [straight_line((0.0, y), (20.0, y), points=41) for y in heights]
    return uniformity(deposited(lines, levels), plate((20.0, 12.0), (4, 3)), spacing=2.0)


def levels_of(found: Uniformity) -> LevelSpacings:
    assert found.levels is not None
    return found.levels


def test_what_is_measured_belongs_to_its_run_level_and_place() -> None:
    found = rows(1.0, 3.0, 5.5, levels=[0, 2, 5])
    levels = levels_of(found)
    # Four samples a spacing of 2 mm: 41 on each run, of levels on each but the first level's.
    np.testing.assert_array_equal(levels.runs, np.repeat([1, 2], 41))
    np.testing.assert_array_equal(levels.levels, np.repeat([2, 5], 41))
    np.testing.assert_array_equal(levels.offsets, [0, 41, 82])
    np.testing.assert_allclose(levels.places[:, 1], np.repeat([3.0, 5.5], 41), atol=1e-9)
    np.testing.assert_allclose(levels.places[:41, 0], np.linspace(0.0, 20.0, 41), atol=1e-9)
    for measured in (levels.ratios, levels.bounds, levels.straight):
        np.testing.assert_allclose(measured, np.repeat([1.0, 1.25], 41), atol=1e-9)
    assert (found.length, found.fill) == (pytest.approx(60.0), pytest.approx(60.0 * 2.0 / 240.0))
    assert (levels.unreached, found.unknown, found.spacing, found.run_count) == (0, 0.0, 2.0, 3)
    np.testing.assert_array_equal(found.runs, np.repeat([0, 1, 2], 41))
    np.testing.assert_allclose(found.sides.places[:, 1], np.repeat([1.0, 3.0, 5.5], 41), atol=1e-9)
    # Widths at the poses of every run: to the rim and halfway to the neighbours; at most a spacing to a side.
    middle = np.arange(123) % 41 == 20
    np.testing.assert_allclose(found.pose_widths[middle], [1.0, (1.0 + 1.25) / 2.0, (1.25 + 2.0) / 2.0], atol=0.03)
    np.testing.assert_allclose(found.widths[[61, 102]], found.pose_widths[[61, 102]], atol=1e-9)
    assert found.judged_places.shape == (found.gaps.size, 3)
    # Beyond 1.1 mm of every run: 0.3 mm in the wider gap, and above 6.6 mm.
    assert found.gap == pytest.approx((0.3 + 5.4) / 12.0, abs=0.005)
    assert found.covered_once == pytest.approx(1.0 - (0.3 + 5.4) / 12.0, abs=0.005)
    assert found.hole == pytest.approx(5.4 * 20.0, rel=0.01)
    assert found.gaps[found.judged_places[:, 1] > 7.0].all()
    assert not found.overlaps.any()


def test_what_lies_on_another_piece_is_left_out_and_counted() -> None:
    one = plate((20.0, 12.0), (4, 3))
    both = united([one, Surface(one.vertices + np.array([0.0, 50.0, 0.0]), one.faces)])
    lines = [straight_line((0.0, y), (20.0, y), points=41) for y in (1.0, 3.0, 51.0)]
    found = levels_of(uniformity(deposited(lines, [0, 1, 1]), both, spacing=2.0))
    assert found.unreached == 41
    np.testing.assert_array_equal(found.runs, np.ones(41))
    np.testing.assert_allclose(found.ratios, 1.0, atol=1e-9)


def test_a_path_may_lie_a_tenth_of_a_spacing_off_its_surface() -> None:
    surface = plate((20.0, 12.0), (4, 3))
    lines = [straight_line((0.0, y), (20.0, y), points=41) for y in (1.0, 3.0)]
    for line in lines:
        line[:, 2] += 0.19
    near = deposited(lines, [0, 1])
    lines[0][:, 2] += 0.02
    far = deposited(lines, [0, 1])
    found = uniformity(near, surface, spacing=2.0)
    assert levels_of(found).figures.mean == pytest.approx(1.0)
    assert (found.off_mean, found.off_max) == (pytest.approx(0.19), pytest.approx(0.19))
    with pytest.raises(FieldError, match=r"0\.21 mm away from plate in run 1, allowed are 0\.2 mm"):
        uniformity(far, surface, spacing=2.0)
