"""Places whose targets would come too soon are slower, and what is written of the tip's jerk."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from geoprint.model import Bend, FloatArray, JointPath, Slowdown, Targets, Trajectory
from geoprint.robot.controller import written_targets
from geoprint.robot.timing import joints_at, largest_jerk, retime, timed_targets
from geoprint.robot.timing.print_speed import _lowered  # pyright: ignore[reportPrivateUsage]
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arc, arm_of, line, solved, stream

CELL = bent_cell()
ROBOT, PROCESS = CELL.robot, CELL.process
BEND = 0.18


def hairpin(angle: float) -> JointPath:
    """Return a run of two straight legs of 10 mm with an arc of 0.18 mm between them; its joints hardly move."""
    bend = arc(radius=BEND, step=0.02, angle=angle)
    legs: list[FloatArray] = []
    for start, other in ((bend[0], bend[1]), (bend[-1], bend[-2])):
        away = (start - other) / np.linalg.norm(start - other)
        legs.append(start + away * np.linspace(0.05, 10.0, 200)[:, None])
    tips = np.vstack([legs[0][::-1], bend, legs[1]])
    count = len(tips)
    joints = np.tile(ROBOT.home, (count, 1))
    joints[:, 0] += np.append(0.0, np.cumsum(np.linalg.norm(np.diff(tips, axis=0), axis=1))) * 1e-3
    return JointPath(
        poses=stream(tips), joints=joints, branch=0,
        rotations=np.zeros(count), leans=np.zeros((count, 2)), T_base_work=np.eye(4),
    )  # fmt: skip


@cache
def timed_hairpin(angle: float) -> tuple[Trajectory, Targets]:
    return timed_targets(hairpin(angle), ROBOT, process=PROCESS)


def test_only_the_place_whose_targets_come_too_soon_is_slower_until_they_do_not() -> None:
    path = hairpin(4.0)
    fast = retime(path, ROBOT, process=PROCESS)
    (close, *_) = (bend for bend in written_targets(path, fast, process=PROCESS).bends if bend.kind == "close")
    assert close.shortest < 0.012

    trajectory, targets = timed_hairpin(4.0)
    assert [bend for bend in targets.bends if bend.kind == "close"] == []
    assert np.diff(trajectory.pose_times[targets.poses]).min() >= 0.012 - 1e-9
    assert {(slow.run, slow.joint) for slow in trajectory.slowdowns if slow.limit == "targets"} == {(0, 0)}
    for slow in trajectory.slowdowns:
        assert 5.0 <= slow.held_speed < 20.0
        # The bend is 0.7 mm long and half way along 20.7 mm; half a millimetre on either side is slower with it, and
        # where the place begins and ends joint 1 brakes.
        assert abs(slow.arc - 10.4) < 2.5
        assert slow.length < 4.0
    lengths = np.linalg.norm(np.diff(path.poses.tips, axis=0), axis=1)
    speeds = lengths / np.diff(trajectory.pose_times)
    ends = path.poses.arcs[1:]
    legs = (np.abs(ends - 10.4) > 4.0) & (ends > 2.0) & (ends < 18.0)
    np.testing.assert_allclose(speeds[legs], PROCESS.speed, rtol=1e-6)
    assert trajectory.share_at_speed > 0.7


@pytest.mark.parametrize("angle", [3.1, 5.0])
def test_a_place_is_slowed_no_farther_than_its_targets_need(angle: float) -> None:
    trajectory, targets = timed_hairpin(angle)
    assert [bend for bend in targets.bends if bend.kind == "close"] == []
    # By the shortest move among the targets of the set speed it would be 10 mm/s.
    assert 15.0 <= min(slow.held_speed for slow in trajectory.slowdowns) < 20.0


@pytest.mark.parametrize("angle", [2.0, 3.1, 5.0])
def test_targets_at_both_ends_of_moves_that_are_wide_stand_outside_of_the_bend(angle: float) -> None:
    path = hairpin(angle)
    targets = written_targets(path, retime(path, ROBOT, process=PROCESS), process=PROCESS)
    moved = targets.poses[targets.moved]
    assert moved.size >= 3
    # The bend is the same from either end, but for how its poses fall.
    np.testing.assert_allclose(moved, path.poses.count - 1 - moved[::-1], atol=6.0)


def test_a_run_whose_targets_have_time_keeps_its_speed() -> None:
    path = hairpin(1.0)
    trajectory, targets = timed_hairpin(1.0)
    assert trajectory.slowdowns == ()
    assert targets.moved.size > 0
    assert trajectory.duration == retime(path, ROBOT, process=PROCESS).duration


def test_written_speeds_give_the_time_of_each_move_over_the_length_of_the_controllers_path() -> None:
    path = hairpin(1.0)
    trajectory, targets = timed_hairpin(1.0)
    places = path.poses.tips[targets.poses].copy()
    places[targets.moved] = targets.places
    steps = np.diff(places, axis=0)
    along = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    zones = targets.zones[1:-1, None]
    share = np.linspace(0.0, 1.0, 201)[:, None, None]
    curves = (
        (1 - share) ** 2 * (places[1:-1] - zones * along[:-1])
        + 2 * share * (1 - share) * places[1:-1]
        + share**2 * (places[1:-1] + zones * along[1:])
    )
    pieces = np.linalg.norm(np.diff(curves, axis=0), axis=2)
    halves = np.vstack([pieces[:100].sum(axis=0), pieces[100:].sum(axis=0)])
    lengths = np.linalg.norm(steps, axis=1) - np.append(0.0, targets.zones[1:-1]) - np.append(targets.zones[1:-1], 0.0)
    lengths[:-1] += halves[0]
    lengths[1:] += halves[1]
    planned = np.diff(trajectory.pose_times[targets.poses])
    clock = lengths / targets.speeds[1:]
    assert np.abs(clock - planned).max() < 1e-3
    assert clock.sum() == pytest.approx(planned.sum(), rel=1e-3)
    assert targets.speeds.max() <= PROCESS.travel_speed
    assert np.unique(targets.speeds).size < 30


def test_jerk_is_that_of_the_tip_and_nothing_where_nothing_is_laid() -> None:
    arm = arm_of(CELL)
    path = solved(stream(line((0.0, 0.0, 0.0), (20.0, 0.0, 0.0), count=81)), arm)
    trajectory = retime(path, ROBOT, process=PROCESS)
    times: FloatArray = 1e-3 * np.arange(400.0)
    # 100 m/s3 along x of the base: joints are those of the straight line at the places of a cubic in time.
    way = 1e3 * 100.0 * (times - 0.2) ** 3 / 6.0
    places = 10.0 + way
    inside = np.abs(way) < 9.0
    joints = joints_at(path.poses.tips[:, 0], path.joints, places)
    made = Trajectory(
        times=times, joints=joints, runs=np.zeros(400, dtype=np.int64), deposit=inside,
        pose_times=trajectory.pose_times, stretched=0, slowest_deposit=0.0, slowdowns=(), share_at_speed=0.0,
        share_on_ramps=0.0,
    )  # fmt: skip
    assert largest_jerk(made, arm, T_base_work=path.T_base_work) == pytest.approx(100.0, rel=0.1)
    none = Trajectory(
        times=times, joints=joints, runs=np.zeros(400, dtype=np.int64), deposit=np.zeros(400, dtype=np.bool_),
        pose_times=trajectory.pose_times, stretched=0, slowest_deposit=0.0, slowdowns=(), share_at_speed=0.0,
        share_on_ramps=0.0,
    )  # fmt: skip
    assert largest_jerk(none, arm, T_base_work=path.T_base_work) == 0.0


def close_bend(*, arc: float = 50.0, shortest: float = 0.0108, run: int = 0) -> Bend:
    """Return a bend of three targets, one of them nine tenths of 12 ms behind the other."""
    return Bend(run, "close", place=(1.0, 2.0, 3.0), arc=arc, radius=0.2, targets=3, offset=0.0, shortest=shortest)


def dip(arc: float, *, held: float, length: float = 2.0, run: int = 0) -> Slowdown:
    return Slowdown(
        run=run, place=(0.0, 0.0, 0.0), arc=arc, length=length, set_speed=20.0, held_speed=held, joint=0,
        limit="targets",
    )  # fmt: skip


def test_a_place_is_lowered_by_what_is_missing_and_as_long_as_its_targets_and_half_a_mm_on_either_side() -> None:
    found = _lowered(close_bend(), (), PROCESS)
    assert found is not None
    assert (found.run, found.arc, found.place, found.limit) == (0, 50.0, (1.0, 2.0, 3.0), "targets")
    # Nine tenths of 20 mm/s; three targets of 12 ms at 20 mm/s and two halves of a millimetre.
    assert found.held_speed == pytest.approx(18.0)
    assert found.length == pytest.approx(3 * 0.012 * 20.0 + 1.0)


@pytest.mark.parametrize(
    ("before", "counts"),
    [
        (dip(50.9, held=12.0), True),
        (dip(49.1, held=12.0), True),
        (dip(51.1, held=12.0), False),
        (dip(48.9, held=12.0), False),
        (dip(20.0, held=12.0), False),
        (dip(50.0, held=12.0, run=1), False),
    ],
)
def test_only_what_is_lowered_there_already_is_lowered_from_its_own_speed(before: Slowdown, *, counts: bool) -> None:
    found = _lowered(close_bend(), (before, dip(50.0, held=16.0)), PROCESS)
    assert found is not None
    assert found.held_speed == pytest.approx(0.9 * (12.0 if counts else 16.0))


def test_one_lowering_keeps_four_fifths_of_the_speed_and_all_of_them_a_quarter_of_the_set_one() -> None:
    tight = close_bend(shortest=0.002)
    once = _lowered(tight, (), PROCESS)
    assert once is not None
    assert once.held_speed == pytest.approx(16.0)
    # Four fifths of 6 mm/s are less than a quarter of 20 mm/s, those of 7 mm/s are not.
    assert _lowered(tight, (dip(50.0, held=6.0),), PROCESS) is None
    assert _lowered(tight, (dip(50.0, held=7.0),), PROCESS) is not None
