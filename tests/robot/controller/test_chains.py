"""Which poses become targets, and how far the rounded moves between them are off: known answers in the plane."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint.model import FloatArray
from geoprint.robot.controller.choice import Weighed, cheapest_chain, weighed
from geoprint.robot.controller.fitting import apexes, fitted_places, rounded_deviations, rounded_lengths, zones_of
from geoprint.robot.controller.interpolation import triangle_middles
from geoprint.robot.controller.targets import Course
from tests.robot.joint_paths import DOWN, tilted

PERIODS = (0.012, 0.024)


def flat(*points: tuple[float, float]) -> FloatArray:
    return np.column_stack([np.array(points), np.zeros(len(points))])


def chain(
    tips: FloatArray, times: FloatArray, *, quaternions: FloatArray | None = None, required: tuple[int, ...] = ()
) -> list[int]:
    count = len(tips)
    wanted = np.union1d(np.array([0, count - 1]), np.array(required, dtype=np.int64))
    moves = weighed(
        tips, np.tile(DOWN, (count, 1)) if quaternions is None else quaternions, times, wanted,
        allowed=np.full(count, 1.0), turns=np.full(count, 0.01), tolerance=1.0, periods=PERIODS,
    )  # fmt: skip
    return cheapest_chain(moves, wanted).tolist()


def test_a_straight_line_is_one_move_however_long() -> None:
    tips = np.linspace([0.0, 0.0, 0.0], [70.0, 0.0, 0.0], 71)
    assert chain(tips, 0.1 * np.arange(71.0)) == [0, 70]
    assert chain(tips, 0.1 * np.arange(71.0), required=(7, 50)) == [0, 7, 50, 70]


@pytest.mark.parametrize("seed", range(5))
def test_moves_that_are_weighed_again_cost_what_they_cost_weighed_afresh(seed: int) -> None:
    """Rows whose distance changes are far apart and close, at the ends, and beside rows that must be targets."""
    random = np.random.default_rng(seed)
    count, required = 2_000, np.array([0, 40, 41, 900, 1_999])
    tips: FloatArray = np.cumsum(random.normal(np.array([0.1, 0.0, 0.0]), 0.02, (count, 3)), axis=0, dtype=np.float64)

    def of(allowed: FloatArray, known: Weighed | None = None) -> Weighed:
        return weighed(
            tips, np.tile(DOWN, (count, 1)), np.linspace(0.0, 10.0, count), required, allowed=allowed,
            turns=np.full(count, 0.01), tolerance=0.1, periods=PERIODS, known=known,
        )  # fmt: skip

    before = of(np.full(count, 0.1))
    allowed = before.allowed.copy()
    allowed[[0, 41, *random.integers(0, count, 3), *range(1_200, 1_230), 1_999]] = 0.3
    allowed[random.integers(0, count, 5)] = 0.05
    again, afresh = of(allowed, before), of(allowed)

    np.testing.assert_array_equal(again.costs, afresh.costs)
    assert not np.array_equal(again.costs, before.costs, equal_nan=True)
    np.testing.assert_array_equal(cheapest_chain(again, required), cheapest_chain(afresh, required))


def test_two_straight_legs_meet_in_their_corner_although_moves_past_it_keep_the_tolerance() -> None:
    """From the poses beside the corner the other end is reached as well, at half of the tolerance."""
    for corner in (10, 20):
        x = np.arange(41.0)
        tips = np.column_stack([x, 0.5 * np.maximum(x - corner, 0.0), np.zeros(41)])
        assert chain(tips, 0.1 * x) == [0, corner, 40]


def test_a_move_that_comes_too_soon_is_worse_than_any_that_uses_the_tolerance_up() -> None:
    """By path alone pose 2 is better: from there on all is straight, while the move from 1 past it is 0.71 off."""
    tips = flat((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 2.0))
    # Both ways have moves shorter than they should be; by way of pose 2 the last is shorter than any may be.
    assert chain(tips, np.array([0.0, 0.013, 0.020, 0.030])) == [0, 1, 3]
    assert chain(tips, np.array([0.0, 0.013, 0.020, 0.033])) == [0, 2, 3]
    # The other way round in time: the first move is the one that is too short.
    assert chain(tips, np.array([0.0, 0.011, 0.030, 0.045])) == [0, 2, 3]


@pytest.mark.parametrize(("last", "expected"), [(0.012, [0, 2, 3]), (0.012 * (1.0 - 9e-5), [0, 2, 3]),
                                                (0.012 * (1.0 - 2e-4), [0, 1, 3])])  # fmt: skip
def test_a_move_of_just_the_least_time_is_not_shorter_than_that(last: float, expected: list[int]) -> None:
    tips = flat((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 2.0))
    assert chain(tips, np.array([0.0, 0.013, 0.020, 0.020 + last])) == expected


@pytest.mark.parametrize(("last", "expected"), [(0.024, [0, 2, 3]), (0.024 * (1.0 - 9e-5), [0, 2, 3]),
                                                (0.024 * (1.0 - 2e-4), [0, 1, 3])])  # fmt: skip
def test_a_move_of_just_the_time_it_should_have_does_not_come_too_soon(last: float, expected: list[int]) -> None:
    tips = flat((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 2.0))
    assert chain(tips, np.array([0.0, 0.030, 0.060, 0.060 + last])) == expected


def test_of_two_ways_with_a_move_that_comes_too_soon_that_with_the_longer_one_is_taken() -> None:
    tips = flat((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 2.0))
    assert chain(tips, np.array([0.0, 0.013, 0.016, 0.024])) == [0, 1, 3]
    assert chain(tips, np.array([0.0, 0.008, 0.013, 0.024])) == [0, 2, 3]


def test_neighbours_are_joined_however_far_the_tool_turns_between_them() -> None:
    """By 100 degrees at once: no pose lies between them that a move could pass wrongly."""
    angles = np.radians([0.0, 0.0, 100.0, 100.0])
    tips = np.linspace([0.0, 0.0, 0.0], [3.0, 0.0, 0.0], 4)
    assert chain(tips, np.arange(4.0), quaternions=tilted(angles)) == [0, 1, 2, 3]


@pytest.mark.parametrize(("angle", "kept"), [(0.009, False), (0.011, True)])
def test_a_pose_stays_out_where_its_attitude_is_within_the_tolerance(angle: float, *, kept: bool) -> None:
    turned = Rotation.from_quat(np.roll(DOWN, -1)) * Rotation.from_euler("y", [[0.0], [angle], [0.0]])
    quaternions = np.roll(turned.as_quat(), 1, axis=1)
    quaternions *= np.sign((quaternions * DOWN).sum(axis=1, keepdims=True))
    tips = np.linspace([0.0, 0.0, 0.0], [2.0, 0.0, 0.0], 3)
    # Two moves would come sooner than they should.
    assert chain(tips, 0.02 * np.arange(3.0), quaternions=quaternions) == ([0, 1, 2] if kept else [0, 2])


@pytest.mark.parametrize("row", [1, 2, 3])
def test_any_pose_between_two_targets_counts_with_its_distance_from_the_move(row: int) -> None:
    tips = np.linspace([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], 5)
    tips[row, 1] = 0.3
    found = rounded_deviations(tips, np.array([0, 4]), tips[[0, 4]], np.zeros(2))
    np.testing.assert_allclose(found, [0.3])


@pytest.mark.parametrize("turn", [0.2, -0.2])
def test_targets_of_a_bend_are_passed_where_their_poses_stand(turn: float) -> None:
    """On a circle with a target each 0.2 rad the written path is off by the fourth power of that, not the second."""
    angles = turn / 8.0 * np.arange(81.0)
    tips = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(81)])
    chosen, rests = np.arange(0, 81, 8), np.zeros(11, dtype=np.bool_)
    rests[[0, -1]] = True
    places = fitted_places(tips[chosen], ~rests, rests)
    inner = slice(3, -3)
    assert rounded_deviations(tips, chosen, tips[chosen], np.zeros(11))[inner].max() == pytest.approx(0.005, rel=0.01)
    assert rounded_deviations(tips, chosen, places, zones_of(places, rests))[inner].max() < 1e-4


def course(times: FloatArray, *, deposited: bool = True, rests: tuple[int, ...] = ()) -> Course:
    count = len(times)
    resting = np.zeros(count, dtype=np.bool_)
    resting[list(rests)] = True
    return Course(
        tips=np.linspace([0.0, 0.0, 0.0], [float(count - 1), 0.0, 0.0], count), quaternions=np.tile(DOWN, (count, 1)),
        times=times, required=np.array([0, count - 1]), runs=np.zeros(count, dtype=np.int64), rests=resting,
        held=resting, printing=np.full(count - 1, deposited), allowed=np.full(count, 1.0), turns=np.full(count, 0.01),
        tolerance=1.0, periods=PERIODS,
    )  # fmt: skip


def test_moves_of_just_the_time_they_need_are_not_too_short_although_times_are_rounded() -> None:
    for period, expected in ((0.012, (0, 99)), (0.024, (0, 0)), (0.01199, (99, 99)), (0.02399, (0, 99))):
        exact = period * np.arange(100.0)
        for share in (1.0, 1.0 - 1e-11):
            found = course(exact * share)
            assert found.short(np.arange(100)) == expected
    assert course(0.005 * np.arange(100.0), deposited=False).short(np.arange(100)) == (0, 0)


def test_the_zone_goes_as_far_into_the_shorter_line_as_into_the_longer() -> None:
    """From 3.2 to 0.8 mm behind the corner: the middle of that chord is (3.6, 0.4), halfway on (3.8, 0.2)."""
    for first, second in ((4.0, 2.0), (4.0, 9.0)):
        targets = np.tile(np.eye(4), (3, 1, 1))
        targets[:, :2, 3] = [[0.0, 0.0], [first, 0.0], [first, second]]
        middles = triangle_middles(targets, np.array([0.0, 0.8, 0.0]))
        np.testing.assert_allclose(middles[1, :3, 3], [3.8, 0.2, 0.0], atol=1e-12)


def test_the_controllers_path_is_as_long_as_its_lines_and_half_parabolas() -> None:
    """Half the parabola of a zone of 1 mm at a right angle is 0.8116 mm long, by its integral; six chords lose 6e-4."""
    tips = flat((0.0, 0.0), (4.0, 0.0), (4.0, 6.0))
    chosen = np.arange(3)
    np.testing.assert_allclose(rounded_lengths(tips, chosen, tips, np.zeros(3)), [4.0, 6.0])
    found = rounded_lengths(tips, chosen, tips, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(found, [3.8116, 5.8116], atol=7e-4)


def test_a_target_on_the_path_has_a_zone_that_cuts_its_corner_by_no_more_than_0_004_mm() -> None:
    """Of a corner of 90 degrees a zone cuts off a quarter of it times sqrt(2)."""
    places = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [4.0, 8.0, 0.0], [4.0, 8.4, 0.0]])
    rests = np.array([True, False, False, False, True])
    found = zones_of(places, rests, moved=np.zeros(5, dtype=np.bool_))
    np.testing.assert_allclose(found, [0.0, 0.016 / np.sqrt(2.0), 0.3, 0.2, 0.0])
    assert np.linalg.norm(apexes(places, found)[1] - places[1]) == pytest.approx(0.004)
    np.testing.assert_allclose(zones_of(places, rests, moved=~rests), [0.0, 0.3, 0.3, 0.2, 0.0])
