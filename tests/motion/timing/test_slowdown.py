"""Constant tip speed: what joints hold by hand-made paths of known answer, and the laws of lowering and following."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.interpolate import CubicSpline

from geoprint.model import FloatArray, JointPath, OnSlowdown, Trajectory
from geoprint.motion.controller.targets import written_targets
from geoprint.motion.timing import path_speeds
from geoprint.motion.timing.path_speeds import largest_speeds
from geoprint.motion.timing.retiming import retime
from geoprint.motion.timing.strain import GriddedPath
from tests.motion.cells import bent_cell
from tests.motion.joint_paths import arc, line, stream

CELL = bent_cell()
ROBOT, PROCESS = CELL.robot, CELL.process
LENGTH, COUNT, RADIUS = 50.0, 201, 20.0
# A tip within 1 % of its speed lays an even bead.
EVEN = 0.99


def made(turns: FloatArray, *, joint: int = 6, runs: int = 1) -> JointPath:
    """Return the path of a tip that goes 50 mm on an arc while joint 1 sweeps and another turns by angles [rad]."""
    joints = np.tile(ROBOT.home, (COUNT, 1))
    joints[:, 0] += np.linspace(0.0, 0.2, COUNT)
    joints[:, joint - 1] += turns
    tips = arc(radius=RADIUS, step=LENGTH / (COUNT - 1), angle=LENGTH / RADIUS)
    numbers, stops = np.zeros(COUNT, dtype=np.int64), ()
    if runs == 2:
        numbers[COUNT // 2 + 1 :] = 1
        stops = (COUNT // 2, COUNT // 2 + 1)
    return JointPath(
        poses=stream(tips, runs=numbers, stops=stops), joints=joints,
        configuration=np.zeros((COUNT, 4), dtype=np.int64), branch=0, rotations=np.zeros(COUNT),
        leans=np.zeros((COUNT, 2)), T_base_work=np.eye(4),
    )  # fmt: skip


def wave(amplitude: float, *, waves: int = 10) -> FloatArray:
    """Return a wave over the middle of the path, at rest at its ends [rad]."""
    share = np.linspace(0.0, 1.0, COUNT)
    return amplitude * np.sin(2.0 * np.pi * waves * share) * np.sin(np.pi * share) ** 2


def timed(path: JointPath, on_slowdown: OnSlowdown, *, speed: float = 20.0) -> Trajectory:
    return retime(path, ROBOT, process=replace(PROCESS, speed=speed), on_slowdown=on_slowdown)


def step_speeds(path: JointPath, found: Trajectory) -> FloatArray:
    lengths = np.linalg.norm(np.diff(path.poses.tips, axis=0), axis=1)
    return lengths / np.diff(found.pose_times)


def test_a_joint_at_its_top_speed_is_named_with_the_tip_speed_it_allows() -> None:
    rate = 0.24  # rad/mm
    path = made(rate * np.linspace(-LENGTH / 2.0, LENGTH / 2.0, COUNT) - ROBOT.home[5])
    held = ROBOT.speeds[5] / rate
    (slow,) = timed(path, "lower", speed=60.0).slowdowns
    assert (slow.run, slow.kind, slow.joint, slow.limit) == (0, "lowered", 6, "speed")
    assert slow.held_speed == pytest.approx(np.floor(held * 10.0) / 10.0, abs=0.1)
    assert slow.length == pytest.approx(LENGTH, rel=1e-3)
    (dip,) = timed(path, "follow", speed=60.0).slowdowns
    assert (dip.kind, dip.joint, dip.limit) == ("dip", 6, "speed")
    assert dip.held_speed == pytest.approx(held, rel=1e-3)


@pytest.mark.parametrize(("share", "found"), [(0.992, 0), (0.988, 1)])
def test_a_run_that_holds_its_speed_within_a_percent_keeps_it(share: float, found: int) -> None:
    rate = 0.24  # rad/mm
    path = made(rate * np.linspace(-LENGTH / 2.0, LENGTH / 2.0, COUNT) - ROBOT.home[5])
    wanted = ROBOT.speeds[5] / rate / share
    lowered, followed = (timed(path, on_slowdown, speed=wanted) for on_slowdown in ("lower", "follow"))
    assert [slow.kind for slow in lowered.slowdowns] == ["lowered"] * found
    assert [slow.kind for slow in followed.slowdowns] == ["dip"] * found
    # Off the ramps the tip is at speed all along, or nowhere.
    assert (1.0 - followed.share_at_speed - followed.share_on_ramps > 0.5) == bool(found)


def test_a_joint_at_its_top_acceleration_is_named_with_place_and_tip_speed() -> None:
    amplitude, waves = 0.02, 10
    path = made(wave(amplitude, waves=waves), joint=5)
    # In the middle, where the envelope is 1, the angle is amplitude * sin(k s): a v^2 k^2 is the acceleration.
    wavelength = LENGTH / waves
    held = np.sqrt(ROBOT.accelerations[4] / amplitude) * wavelength / (2.0 * np.pi)
    (slow,) = timed(path, "lower", speed=60.0).slowdowns
    assert (slow.joint, slow.limit) == (5, "acceleration")
    assert slow.held_speed == pytest.approx(held, rel=0.05)
    phase = slow.arc / RADIUS
    np.testing.assert_allclose(slow.place, [RADIUS * np.cos(phase), RADIUS * np.sin(phase), 0.0], atol=0.01)
    assert abs(slow.arc - LENGTH / 2.0) < wavelength / 2.0


@settings(max_examples=15, deadline=None)
@given(st.floats(0.0, 0.06), st.integers(3, 14))
def test_lowering_leaves_one_speed_off_the_ramps_and_following_lists_what_is_not_at_speed(
    amplitude: float, waves: int
) -> None:
    path = made(wave(amplitude, waves=waves))
    even, followed = timed(path, "lower"), timed(path, "follow")
    for found in (even, followed):
        assert step_speeds(path, found).max() <= 20.0 * (1.0 + 1e-6)
    speeds = step_speeds(path, even)[4:-4]
    assert speeds.min() >= EVEN * speeds.max()
    held = even.slowdowns[0].held_speed if even.slowdowns else 20.0
    assert speeds.max() == pytest.approx(held, rel=0.011)
    assert even.slowest_deposit >= EVEN * held
    missing = 1.0 - followed.share_at_speed - followed.share_on_ramps
    assert (missing < 1e-9) == (not followed.slowdowns)
    assert sum(dip.length for dip in followed.slowdowns) == pytest.approx(missing * LENGTH, abs=1e-3)
    assert even.duration > followed.duration - 1e-3


def test_only_the_run_that_needs_it_is_lowered() -> None:
    turns = wave(0.06)
    turns[: COUNT // 2 + 1] = 0.0
    path = made(turns, runs=2)
    found = timed(path, "lower")
    assert [slow.run for slow in found.slowdowns] == [1]
    speeds = step_speeds(path, found)
    assert np.median(speeds[: COUNT // 2]) == pytest.approx(20.0, rel=1e-3)
    assert np.median(speeds[COUNT // 2 :]) == pytest.approx(found.slowdowns[0].held_speed, rel=1e-3)
    assert found.share_at_speed == pytest.approx(0.5, abs=0.02)


def test_the_written_speeds_are_those_of_the_lowered_run() -> None:
    path = made(wave(0.06))
    found = timed(path, "lower")
    targets = written_targets(path, found, process=PROCESS)
    inner = targets.speeds[2:-2]
    assert inner.size > 5
    np.testing.assert_allclose(inner, found.slowdowns[0].held_speed, atol=1e-9)


def test_a_run_too_short_to_reach_its_speed_is_listed() -> None:
    tips = line((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), count=COUNT)
    path = made(np.linspace(0.0, 0.1, COUNT))
    short = replace(path, poses=stream(tips))
    followed = timed(short, "follow")
    assert [dip.limit for dip in followed.slowdowns] == ["acceleration"]
    assert followed.share_at_speed == 0.0
    even = timed(short, "lower")
    assert even.slowdowns[0].held_speed <= followed.slowdowns[0].held_speed


def test_windows_give_what_the_whole_path_gives(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = np.linspace(0.0, 0.5, 1001)
    joints = np.outer(4.0 * grid, np.ones(6)) + np.outer(0.05 * np.exp(-(((grid - 0.2) / 0.003) ** 2)), np.arange(6))
    path = GriddedPath.of(CubicSpline(grid, joints), grid)
    highest = np.full(grid.size, 0.05)
    solved: list[int] = []
    solve = path_speeds._solve  # pyright: ignore[reportPrivateUsage]

    def counted(*arguments: object, **named: object) -> FloatArray | None:
        solved.append(int(arguments[2]) - int(arguments[1]))  # type: ignore[call-overload]
        return solve(*arguments, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(path_speeds, "_solve", counted)
    speeds, strain = largest_speeds(path, highest=highest, ramp=1e-3, robot=ROBOT)
    windows = sum(solved)
    monkeypatch.setattr(path_speeds, "PADDING_STEPS", grid.size)
    whole, _ = largest_speeds(path, highest=highest, ramp=1e-3, robot=ROBOT)
    assert windows < 0.3 * (sum(solved) - windows)
    np.testing.assert_allclose(speeds, whole, rtol=2e-3)
    assert speeds.min() == 0.0 == speeds[0] == speeds[-1]
    assert strain.max() < 1.01


def test_a_window_that_proves_too_narrow_is_widened(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = np.linspace(0.0, 0.5, 1001)
    path = GriddedPath.of(CubicSpline(grid, np.outer(4.0 * grid, np.ones(6))), grid)
    highest = np.full(grid.size, 0.5)
    monkeypatch.setattr(path_speeds, "PADDING_STEPS", 2)
    speeds, strain = largest_speeds(path, highest=highest, ramp=1e-6, robot=ROBOT)
    pull = ROBOT.accelerations.min() / 4.0
    np.testing.assert_allclose(speeds, np.minimum(np.sqrt(2.0 * pull * np.minimum(grid, 0.5 - grid)), 0.5), rtol=5e-3)
    assert strain.max() < 1.001


def test_two_points_to_either_side_of_a_speed_below_half_of_what_holds_lie_beside_a_hole() -> None:
    held = np.full(14, 1.0)
    speeds = held.copy()
    speeds[6], speeds[11] = 0.49, 0.51
    near = path_speeds._near_holes(speeds, held)  # pyright: ignore[reportPrivateUsage]
    assert np.flatnonzero(near).tolist() == [4, 5, 6, 7, 8]
    # What rises on one side alone is a ramp, and the ends of the grid are at rest.
    speeds[6:] = 0.3
    speeds[[0, -1]] = 0.0
    assert not path_speeds._near_holes(speeds, held).any()  # pyright: ignore[reportPrivateUsage]
    # Next to an end there may be one.
    speeds = held.copy()
    speeds[1] = 0.2
    assert np.flatnonzero(path_speeds._near_holes(speeds, held)).tolist() == [0, 1, 2, 3]  # pyright: ignore[reportPrivateUsage]
