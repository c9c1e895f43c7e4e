"""Parts of the chain with targets beside the path: times of patterns, and stretches that leave the tolerance."""

# pyright: reportPrivateUsage=false

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.robot.controller.fitting import rounded_deviations, zones_of
from geoprint.robot.controller.targets import (
    Course,
    _chain,
    _improved,
    _leaves,
    _nearest,
    _next_soon,
    _patterns,
    _run_of,
    rounded_chain,
)
from geoprint.transforms import same_sign
from tests.robot.joint_paths import DOWN

NONE = np.empty(0, dtype=np.int64)


def course(tips: FloatArray, times: FloatArray, *, rests: tuple[int, ...] = ()) -> Course:
    count = len(tips)
    resting = np.zeros(count, dtype=np.bool_)
    resting[[0, -1, *rests]] = True
    return Course(
        tips=tips, quaternions=np.tile(DOWN, (count, 1)), times=times, required=np.flatnonzero(resting),
        runs=np.zeros(count, dtype=np.int64), rests=resting, held=resting, printing=np.full(count - 1, fill_value=True),
        allowed=np.full(count, 0.01), turns=np.full(count, np.radians(0.15)), tolerance=0.01,
        periods=(0.012, 0.024),
    )  # fmt: skip


@pytest.mark.parametrize(("height", "off"), [(0.009, False), (0.011, True), (0.019, True)])
@pytest.mark.parametrize("moved", [False, True])
def test_a_stretch_leaves_where_a_straight_move_is_wider_than_the_tolerance(
    height: float, *, off: bool, moved: bool
) -> None:
    x = np.arange(31.0)
    tips = np.column_stack([x, np.zeros(31), np.zeros(31)])
    tips[15, 1] = height
    flags = np.zeros(31, dtype=np.bool_)
    flags[5] = moved
    parts = NONE, np.array([0, 5, 10, 20, 30]), NONE
    assert _leaves(course(tips, 0.1 * x), parts, flags) == off


@pytest.mark.parametrize(("turned_deg", "off"), [(0.1, False), (0.2, True)])
@pytest.mark.parametrize("moved", [False, True])
def test_a_stretch_leaves_where_a_pose_beside_a_target_off_the_path_is_turned_otherwise_than_its_move(
    turned_deg: float, *, off: bool, moved: bool
) -> None:
    """A tool that looks down a straight path turns by four degrees over 15 mm, and by so much more at one pose of it.

    Where no target is beside the path, chains are weighed by the turn before.
    """
    x = np.arange(31.0)
    angles = np.radians(np.minimum(x, 15.0) * 4.0 / 15.0)
    angles[8] += np.radians(turned_deg)
    turns = Rotation.from_rotvec(angles[:, None] * np.array([1.0, 0.0, 0.0]))
    down = Rotation.from_quat(np.asarray(DOWN)[[1, 2, 3, 0]])
    quaternions = same_sign((turns * down).as_quat()[:, [3, 0, 1, 2]])
    made = replace(course(np.column_stack([x, np.zeros((31, 2))]), 0.1 * x), quaternions=quaternions)
    flags = np.zeros(31, dtype=np.bool_)
    flags[15] = moved
    assert _leaves(made, (NONE, np.array([0, 5, 15, 30]), NONE), flags) == (off and moved)


def test_a_stretch_is_not_judged_by_what_is_far_beside_it() -> None:
    x = np.arange(101.0)
    tips = np.column_stack([x, np.zeros(101), np.zeros(101)])
    tips[5, 1] = 0.5
    rows = np.arange(0, 101, 10)
    made, flags = course(tips, 0.1 * x), np.zeros(101, dtype=np.bool_)
    assert not _leaves(made, (rows[:4], rows[4:8], rows[8:]), flags)
    assert _leaves(made, (NONE, rows[:8], rows[8:]), flags)
    back = replace(made, tips=tips[::-1].copy())
    assert not _leaves(back, (rows[:4], rows[4:8], rows[8:]), flags)
    assert _leaves(back, (rows[:4], rows[4:], NONE), flags)


@pytest.mark.parametrize(
    ("flags", "count"), [([], 0), ([True], 1), ([False], 0), ([True, True, False, True], 2), ([True] * 3, 3)]
)
def test_flags_are_counted_up_to_the_first_that_is_not_set(flags: list[bool], count: int) -> None:
    assert _run_of(np.array(flags, dtype=np.bool_)) == count


def test_the_nearest_time_is_taken_on_either_side_and_at_both_ends() -> None:
    found: IntArray = _nearest(np.array([0.0, 1.0, 3.0]), np.array([-5.0, 0.4, 0.6, 1.9, 2.1, 9.0]))
    assert found.tolist() == [0, 0, 1, 1, 2, 2]


@pytest.mark.parametrize(("bend", "within", "between"), [
    ((20, 30), (0, 60), (20, 40)),  # from a rest on
    ((30, 40), (0, 60), (20, 40)),  # up to a rest
    ((25, 35), (0, 60), (20, 40)),  # between two rests
    ((28, 32), (24, 36), (24, 36)),  # no farther than the stretch
])  # fmt: skip
def test_patterns_stay_between_the_rests_and_within_the_stretch(
    bend: tuple[int, int], within: tuple[int, int], between: tuple[int, int]
) -> None:
    x = np.arange(61.0)
    made = course(np.column_stack([x, np.zeros(61), np.zeros(61)]), 0.01 * x, rests=(20, 40))
    every = list(_patterns(made, *bend, within=within))
    # Those from rest to rest come first: short moves at both ends, even ones between them.
    whole, patterns = ([one for one in every if (int(one[0]) in (20, 40)) is each] for each in (True, False))
    assert bool(whole) is (between == (20, 40))
    assert all((one[0], one[-1]) == between and np.ptp(np.diff(one[1:-1])) <= 1 for one in whole)
    firsts, lasts = (np.array([pattern[row] for pattern in patterns]) for row in (0, -1))
    assert firsts.min() == between[0] + 1
    assert lasts.max() == between[1] - 1
    assert all((np.diff(pattern) > 0).all() and pattern.size >= 2 for pattern in patterns)
    # Some begin before the bend and end behind it, where there is room.
    assert (firsts <= max(bend[0], between[0] + 1)).any()
    assert (lasts >= min(bend[1], between[1] - 1)).any()
    # At even times, up to half a pose to either side of both ends.
    assert all(np.ptp(np.diff(pattern)) <= 2 for pattern in patterns)


@pytest.mark.parametrize(("count", "expected"), [(4, 40), (5, 30)])
def test_where_one_move_in_25_comes_too_soon_only_those_below_the_least_time_are_mended(
    count: int, expected: int
) -> None:
    """Of 100 moves, some of 0.02 s from the 30th on and one of 0.01 s, the 40th."""
    steps = np.full(100, 0.03)
    steps[30 : 30 + count - 1] = 0.02
    steps[40] = 0.01
    times = np.concatenate([[0.0], np.cumsum(steps)])
    made = course(np.column_stack([np.arange(101.0), np.zeros((101, 2))]), times)
    rows = np.arange(101)
    assert _next_soon(made, rows, after=-1) == expected
    assert _next_soon(made, rows, after=39) == 40
    assert _next_soon(made, rows, after=40) is None


def test_about_a_move_that_is_too_short_poses_count_and_not_what_the_path_bulges() -> None:
    """Two poses 6 ms apart are 0.006 mm off a line, one on each side, and by what the path bulges may be 0.003 mm."""
    times = 0.006 * np.arange(60.0)
    tips = np.linspace([0.0, 0.0, 0.0], [5.9, 0.0, 0.0], 60)
    tips[[30, 31], 1] = 0.006, -0.006
    plain = course(tips, times)
    allowed = plain.allowed.copy()
    allowed[25:37] = 0.003
    bulged = replace(plain, allowed=allowed, turns=np.where(allowed < 0.01, 1e-4, plain.turns))

    rows, places = rounded_chain(bulged)
    assert plain.too_short(rows).size == 0
    np.testing.assert_array_equal(rows, rounded_chain(plain)[0])
    assert rounded_deviations(tips, rows, places, zones_of(places, plain.resting(rows))).max() <= 0.01
    assert plain.too_short(_chain(bulged)[0]).size > 0


def bent_course(seed: int) -> Course:
    """Tight bends at 20 mm/s."""
    rng = np.random.default_rng(seed)
    along, times = 0.16 * np.arange(240.0), 0.008 * np.arange(240.0)
    heights, lengths, phases = rng.uniform([0.1, 2.5, 0.0], [1.0, 14.0, 6.0], (4, 3)).T[:, :, None]
    angle: FloatArray = (heights * np.sin(2.0 * np.pi * along / lengths + phases)).sum(axis=0)
    tips = np.cumsum(0.16 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(240)]), axis=0)
    return replace(course(tips, times), allowed=rng.uniform(0.007, 0.0095, 240))


@pytest.mark.parametrize("seed", [0, 3])
def test_what_corners_do_not_make_up_for_is_taken_back_however_long_that_takes(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wide move leaves the path there as soon as its widening is not looked at to the end."""
    monkeypatch.setattr("geoprint.robot.controller.targets.ROUNDS", 0)
    made = bent_course(seed)
    rows, places = rounded_chain(made)
    # Where a pattern begins, its moved ends add a little.
    assert rounded_deviations(made.tips, rows, places, zones_of(places, made.resting(rows))).max() < 0.0105


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_a_stretch_that_is_passed_alike_is_looked_at_once(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    looked_at: list[tuple[int, int]] = []

    def counted(*arguments: Any, bend: tuple[int, int], **more: Any) -> tuple[IntArray, BoolArray]:
        looked_at.append(bend)
        return _improved(*arguments, bend=bend, **more)

    monkeypatch.setattr("geoprint.robot.controller.targets._improved", counted)
    made = bent_course(seed)
    rows, places = rounded_chain(made)
    count = len(looked_at)
    assert count > 3
    again = rounded_chain(replace(made, times=made.times + 12.345))
    assert len(looked_at) == count
    np.testing.assert_array_equal(again[0], rows)
    np.testing.assert_array_equal(again[1], places)

    # Where its second half is slower, less is looked at than without what is known, and the same is found.
    slower = replace(made, times=np.where(np.arange(240) > 120, 1.1 * made.times - 0.1 * made.times[120], made.times))
    found = rounded_chain(slower)
    more = len(looked_at) - count
    alone = rounded_chain(replace(slower, known={}))
    assert more < len(looked_at) - count - more
    np.testing.assert_array_equal(found[0], alone[0])
    np.testing.assert_array_equal(found[1], alone[1])


def test_more_targets_between_those_of_a_chain_make_no_fewer_moves_that_come_too_soon() -> None:
    """What is left out of the chain is not worth weighing where what stays alone is no better than the best."""
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.uniform(0.001, 0.01, 200))
    made = course(np.column_stack([times, np.zeros((200, 2))]), times)
    made = replace(made, printing=rng.random(199) > 0.2)
    for _ in range(50):
        rows = np.unique(np.concatenate([[0, 199], rng.integers(1, 199, size=20)]))
        more = np.unique(np.concatenate([rows, rng.integers(1, 199, size=20)]))
        assert all(few <= many for few, many in zip(made.short(rows), made.short(more), strict=True))
