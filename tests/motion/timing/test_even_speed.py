"""The largest speed that all of a deposit holds, proven by timing it again, and what keeps the rest from its speed."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, TypeAlias

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.model import FloatArray, JointPath, Slowdown, Trajectory
from geoprint.motion.timing import Slowed, largest_even_speed, retime, slowed_shares, timed_targets
from tests.motion.cells import bent_cell
from tests.motion.joint_paths import line, stream
from tests.motion.timing.test_spacing import hairpin, timed_hairpin

CELL = bent_cell()
ROBOT, PROCESS = CELL.robot, CELL.process
LENGTH, COUNT = 50.0, 201
Kind: TypeAlias = Literal["lowered", "dip"]
Limit: TypeAlias = Literal["speed", "acceleration", "targets"]
SHARES = np.linspace(0.0, 1.0, COUNT)


def made(turns: FloatArray, *, length: float = LENGTH, runs: int = 1) -> JointPath:
    """Return the path of a tip along a line while joint 1 sweeps by 0.2 rad and joint 6 turns by angles [rad]."""
    joints = np.tile(ROBOT.home, (COUNT, 1))
    joints[:, 0] += 0.2 * SHARES
    joints[:, 5] += turns
    half, numbers = COUNT // 2, np.zeros(COUNT, dtype=np.int64)
    stops = () if runs == 1 else (half, half + 1)
    if runs == 2:
        numbers[half + 1 :] = 1
    return JointPath(
        poses=stream(line((0.0, 0.0, 0.0), (length, 0.0, 0.0), count=COUNT), runs=numbers, stops=stops), joints=joints,
        configuration=np.zeros((COUNT, 4), dtype=np.int64), branch=0, rotations=np.zeros(COUNT),
        leans=np.zeros((COUNT, 2)), T_base_work=np.eye(4),
    )  # fmt: skip


def wave(amplitude: float, *, waves: int) -> FloatArray:
    """Return a wave over the middle of the path, at rest at its ends [rad]."""
    return amplitude * np.sin(2.0 * np.pi * waves * SHARES) * np.sin(np.pi * SHARES) ** 2


def even_speed(path: JointPath, *, speed: float = 20.0, slowdowns: tuple[Slowdown, ...] = ()) -> float:
    return largest_even_speed(path, ROBOT, process=replace(PROCESS, speed=speed), slowdowns=slowdowns)


def followed(path: JointPath, speed: float) -> Trajectory:
    return retime(path, ROBOT, process=replace(PROCESS, speed=speed), on_slowdown="follow")


def test_a_joint_at_its_top_speed_allows_its_speed_over_the_turn_a_millimetre() -> None:
    # Joint 6 turns by 420 degrees a second at most; here by 0.24 rad a millimetre.
    path = made(0.24 * LENGTH * (SHARES - 0.5) - ROBOT.home[5])
    assert even_speed(path, speed=60.0) == pytest.approx(np.radians(420.0) / 0.24, rel=1e-3)
    # The speed at which it was asked for does not count.
    assert even_speed(path, speed=10.0) == pytest.approx(np.radians(420.0) / 0.24, rel=1e-3)


@settings(max_examples=12, deadline=None)
@given(st.floats(0.02, 0.06), st.integers(3, 14), st.sampled_from([1, 2]))
def test_all_but_the_ramps_is_at_speed_at_the_largest_speed_and_not_at_a_higher_one(
    amplitude: float, waves: int, runs: int
) -> None:
    path = made(wave(amplitude, waves=waves), runs=runs)
    largest = even_speed(path)
    found = followed(path, largest)
    assert found.slowdowns == ()
    assert found.share_at_speed + found.share_on_ramps == pytest.approx(1.0, abs=1e-6)
    assert found.share_on_ramps < 0.2
    assert followed(path, 1.05 * largest).slowdowns


def test_a_leg_that_lays_only_along_a_part_of_it_counts() -> None:
    path = made(0.24 * LENGTH * (SHARES - 0.5) - ROBOT.home[5])
    laid = (SHARES > 0.2) & (SHARES < 0.7)
    partly = replace(path, poses=replace(path.poses, deposit=laid, levels=np.where(laid, 0, -1)))
    assert even_speed(partly) == pytest.approx(np.radians(420.0) / 0.24, rel=1e-3)
    nothing = replace(path, poses=replace(path.poses, deposit=laid & False, levels=np.full(COUNT, -1)))
    assert even_speed(nothing) == float("inf")


def test_a_run_too_short_for_its_ramps_has_a_lower_speed() -> None:
    path = made(0.1 * SHARES, length=0.1)
    assert followed(path, 20.0).slowdowns
    largest = even_speed(path)
    assert 0.0 < largest < 20.0
    assert followed(path, largest).slowdowns == ()


def slowdown(run: int, limit: Limit, *, length: float, kind: Kind = "dip", held: float = 10.0) -> Slowdown:
    return Slowdown(
        run=run, kind=kind, place=(0.0, 0.0, 0.0), arc=0.0, length=length, set_speed=20.0, held_speed=held,
        joint=0 if limit == "targets" else 5, limit=limit,
    )  # fmt: skip


def test_targets_of_a_bend_bound_the_speed_too() -> None:
    path = made(np.zeros(COUNT))
    assert even_speed(path) > 20.0
    assert even_speed(path, slowdowns=(slowdown(0, "targets", length=50.0, kind="lowered", held=7.5),)) == 7.5
    assert even_speed(path, slowdowns=(slowdown(0, "speed", length=50.0, kind="lowered", held=7.5),)) > 20.0


def test_the_speed_that_targets_allow_leaves_nothing_to_lower_and_a_higher_one_does() -> None:
    path = hairpin(4.0)
    slower = timed_hairpin(4.0).trajectory.slowdowns
    assert [each.limit for each in slower] == ["targets"]
    largest = even_speed(path, slowdowns=slower)
    found = timed_targets(path, ROBOT, process=replace(PROCESS, speed=largest)).trajectory
    assert found.slowdowns == ()
    assert found.share_at_speed + found.share_on_ramps == pytest.approx(1.0, abs=1e-6)
    assert timed_targets(path, ROBOT, process=replace(PROCESS, speed=1.2 * largest)).trajectory.slowdowns


def test_what_is_not_at_speed_is_shared_out_by_length_and_limit() -> None:
    timed = replace(
        followed(made(np.zeros(COUNT)), 20.0),
        share_at_speed=0.6,
        share_on_ramps=0.1,
        slowdowns=(
            slowdown(0, "speed", length=2.0),
            slowdown(1, "acceleration", length=1.0, kind="lowered"),
            slowdown(1, "speed", length=0.4),  # in a run that was lowered as a whole
            slowdown(2, "targets", length=1.0),
            slowdown(3, "targets", length=9.0, kind="lowered", held=19.9),  # within 1 %
        ),
    )
    found = slowed_shares(timed)
    assert (found.speed, found.acceleration, found.targets) == pytest.approx((0.15, 0.075, 0.075))
    even = replace(timed, share_at_speed=0.9, slowdowns=())
    assert slowed_shares(even) == Slowed(0.0, 0.0, 0.0)
