"""Slowdowns: what joints hold by hand-made paths of known answer, that all is listed, and what keeps it from speed."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, TypeAlias

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.interpolate import CubicSpline

from geoprint.model import FloatArray, JointPath, Slowdown, Trajectory
from geoprint.robot.timing import Slowed, slowed_shares, topp
from geoprint.robot.timing.knots import path_knots
from geoprint.robot.timing.retiming import retime
from geoprint.robot.timing.slowdown import lowered
from geoprint.robot.timing.topp import GriddedPath, largest_speeds
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arc, line, stream

CELL = bent_cell()
ROBOT, PROCESS = CELL.robot, CELL.process
LENGTH, COUNT, RADIUS = 50.0, 201, 20.0
Limit: TypeAlias = Literal["speed", "acceleration", "targets"]


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
        branch=0, rotations=np.zeros(COUNT),
        leans=np.zeros((COUNT, 2)), T_base_work=np.eye(4),
    )  # fmt: skip


def wave(amplitude: float, *, waves: int = 10) -> FloatArray:
    """Return a wave over the middle of the path, at rest at its ends [rad]."""
    share = np.linspace(0.0, 1.0, COUNT)
    return amplitude * np.sin(2.0 * np.pi * waves * share) * np.sin(np.pi * share) ** 2


def timed(path: JointPath, *, speed: float = 20.0, slower: tuple[Slowdown, ...] = ()) -> Trajectory:
    return retime(path, ROBOT, process=replace(PROCESS, speed=speed), slower=slower)


def step_speeds(path: JointPath, found: Trajectory) -> FloatArray:
    lengths = np.linalg.norm(np.diff(path.poses.tips, axis=0), axis=1)
    return lengths / np.diff(found.pose_times)


def test_a_joint_at_its_top_speed_is_named_with_the_tip_speed_it_allows() -> None:
    rate = 0.24  # rad/mm
    path = made(rate * np.linspace(-LENGTH / 2.0, LENGTH / 2.0, COUNT) - ROBOT.home[5])
    held = ROBOT.speeds[5] / rate
    found = timed(path, speed=60.0)
    (dip,) = found.slowdowns
    assert (dip.run, dip.joint, dip.limit, dip.set_speed) == (0, 6, "speed", 60.0)
    assert dip.held_speed == pytest.approx(held, rel=1e-3)
    assert found.slowest_deposit == pytest.approx(held, rel=1e-3)
    # All but the ramps: twice v^2 / (2 a) at each end, where joint 6 is accelerated.
    ramps = 2.0 * held**2 / (ROBOT.accelerations[5] / rate)
    assert dip.length == pytest.approx(LENGTH - ramps, abs=1.5)


@pytest.mark.parametrize(("share", "found"), [(0.992, 0), (0.988, 1)])
def test_a_run_that_holds_its_speed_within_a_percent_keeps_it(share: float, found: int) -> None:
    rate = 0.24  # rad/mm
    path = made(rate * np.linspace(-LENGTH / 2.0, LENGTH / 2.0, COUNT) - ROBOT.home[5])
    wanted = ROBOT.speeds[5] / rate / share
    trajectory = timed(path, speed=wanted)
    assert len(trajectory.slowdowns) == found
    # Off the ramps the tip is at speed all along, or nowhere.
    assert (1.0 - trajectory.share_at_speed - trajectory.share_on_ramps > 0.5) == bool(found)


def test_a_joint_at_its_top_acceleration_is_named_with_place_and_tip_speed() -> None:
    amplitude, waves = 0.02, 10
    path = made(wave(amplitude, waves=waves), joint=5)
    # In the middle, where the envelope is 1, the angle is amplitude * sin(k s): a v^2 k^2 is the acceleration.
    wavelength = LENGTH / waves
    held = np.sqrt(ROBOT.accelerations[4] / amplitude) * wavelength / (2.0 * np.pi)
    slow = min(timed(path, speed=60.0).slowdowns, key=lambda dip: dip.held_speed)
    assert (slow.joint, slow.limit) == (5, "acceleration")
    assert slow.held_speed == pytest.approx(held, rel=0.05)
    phase = slow.arc / RADIUS
    np.testing.assert_allclose(slow.place, [RADIUS * np.cos(phase), RADIUS * np.sin(phase), 0.0], atol=0.01)
    assert abs(slow.arc - LENGTH / 2.0) < wavelength / 2.0


@settings(max_examples=15, deadline=None)
@given(st.floats(0.0, 0.06), st.integers(3, 14))
def test_no_step_is_faster_than_set_and_all_that_is_not_at_speed_is_listed(amplitude: float, waves: int) -> None:
    path = made(wave(amplitude, waves=waves))
    found = timed(path)
    assert step_speeds(path, found).max() <= 20.0 * (1.0 + 1e-6)
    missing = 1.0 - found.share_at_speed - found.share_on_ramps
    assert (missing < 1e-9) == (not found.slowdowns)
    assert sum(dip.length for dip in found.slowdowns) == pytest.approx(missing * LENGTH, abs=1e-3)
    held = [dip.held_speed for dip in found.slowdowns]
    assert found.slowest_deposit == pytest.approx(min(held, default=20.0), rel=0.011)


def test_only_the_run_that_needs_it_is_slower() -> None:
    turns = wave(0.06)
    turns[: COUNT // 2 + 1] = 0.0
    path = made(turns, runs=2)
    found = timed(path)
    assert {slow.run for slow in found.slowdowns} == {1}
    speeds = step_speeds(path, found)
    np.testing.assert_allclose(speeds[5 : COUNT // 2 - 5], 20.0, rtol=1e-3)
    held = min(each.held_speed for each in found.slowdowns)
    assert speeds[COUNT // 2 + 5 : -5].min() == pytest.approx(held, rel=0.05)


def place(at: float, *, length: float, held: float, run: int = 0, limit: Limit = "targets") -> Slowdown:
    return Slowdown(
        run=run, place=(0.0, 0.0, 0.0), arc=at, length=length, set_speed=20.0, held_speed=held,
        joint=0 if limit == "targets" else 5, limit=limit,
    )  # fmt: skip


def test_places_are_as_slow_as_the_slowest_of_them_and_nothing_else_is() -> None:
    """Steps of a quarter of a millimetre, of 200; the tip goes 1.06 mm on each millimetre of bead."""
    path = made(np.zeros(COUNT), runs=2)
    bulge = replace(path.poses, normals=path.poses.tips / RADIUS, standoff=RADIUS * (1.0 - 1.0 / 1.06))
    knots = path_knots(replace(path, poses=bulge), process=replace(PROCESS, speed=20.0))
    np.testing.assert_allclose(knots.ceilings[:99], 0.02 * 1.06, rtol=1e-9)
    slower = (
        place(10.0, length=4.1, held=15.0),
        place(11.0, length=4.1, held=10.0),
        place(5.0, length=1.0, held=30.0),
        place(40.0, length=2.0, held=10.0),  # behind the end of its run
    )
    shares = lowered(knots, slower).ceilings / knots.ceilings
    ends = np.linspace(0.0, LENGTH, COUNT)[1:]
    # A step counts by where it ends.
    expected = np.where(np.abs(ends - 11.0) < 2.05, 0.5, np.where(np.abs(ends - 10.0) < 2.05, 0.75, 1.0))
    np.testing.assert_allclose(shares, expected, rtol=1e-9)


def test_a_place_that_is_slower_for_another_reason_is_listed_and_slower_and_the_rest_keeps_its_speed() -> None:
    path = made(np.zeros(COUNT))
    slower = place(25.0, length=4.0, held=10.0)
    found = timed(path, slower=(slower,))
    assert slower in found.slowdowns
    speeds, ends = step_speeds(path, found), np.linspace(0.0, LENGTH, COUNT)[1:]
    np.testing.assert_allclose(speeds[np.abs(ends - 25.0) < 1.9], 10.0, rtol=1e-6)
    np.testing.assert_allclose(speeds[(np.abs(ends - 25.0) > 3.0) & (ends > 2.0) & (ends < 48.0)], 20.0, rtol=1e-6)
    assert found.share_at_speed == pytest.approx(1.0 - 4.0 / LENGTH, abs=0.02)


def test_a_run_too_short_to_reach_its_speed_is_listed() -> None:
    tips = line((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), count=COUNT)
    path = made(np.linspace(0.0, 0.1, COUNT))
    found = timed(replace(path, poses=stream(tips)))
    assert [dip.limit for dip in found.slowdowns] == ["acceleration"]
    assert found.share_at_speed == 0.0


def test_what_is_not_at_speed_is_shared_out_by_length_and_limit() -> None:
    found = replace(
        timed(made(np.zeros(COUNT))),
        share_at_speed=0.6,
        share_on_ramps=0.1,
        slowdowns=(
            place(1.0, length=2.0, held=10.0, limit="speed"),
            place(2.0, length=1.0, held=10.0, limit="acceleration", run=1),
            place(3.0, length=1.0, held=10.0, run=2),
            place(4.0, length=9.0, held=19.9, run=3),  # within 1 %
        ),
    )
    shares = slowed_shares(found)
    assert (shares.speed, shares.acceleration, shares.targets) == pytest.approx((0.15, 0.075, 0.075))
    assert slowed_shares(replace(found, share_at_speed=0.9, slowdowns=())) == Slowed(0.0, 0.0, 0.0)


def test_windows_give_what_the_whole_path_gives(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = np.linspace(0.0, 0.5, 1001)
    joints = np.outer(4.0 * grid, np.ones(6)) + np.outer(0.05 * np.exp(-(((grid - 0.2) / 0.003) ** 2)), np.arange(6))
    path = GriddedPath.of(CubicSpline(grid, joints), grid)
    highest = np.full(grid.size, 0.05)
    solved: list[int] = []
    solve = topp._solve  # pyright: ignore[reportPrivateUsage]

    def counted(*arguments: object, **named: object) -> FloatArray | None:
        solved.append(int(arguments[2]) - int(arguments[1]))  # type: ignore[call-overload]
        return solve(*arguments, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(topp, "_solve", counted)
    speeds, strain = largest_speeds(path, highest=highest, ramp=1e-3, robot=ROBOT)
    windows = sum(solved)
    monkeypatch.setattr(topp, "PADDING_STEPS", grid.size)
    whole, _ = largest_speeds(path, highest=highest, ramp=1e-3, robot=ROBOT)
    assert windows < 0.3 * (sum(solved) - windows)
    np.testing.assert_allclose(speeds, whole, rtol=2e-3)
    assert speeds.min() == 0.0 == speeds[0] == speeds[-1]
    assert strain.max() < 1.01


def test_a_window_that_proves_too_narrow_is_widened(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = np.linspace(0.0, 0.5, 1001)
    path = GriddedPath.of(CubicSpline(grid, np.outer(4.0 * grid, np.ones(6))), grid)
    highest = np.full(grid.size, 0.5)
    monkeypatch.setattr(topp, "PADDING_STEPS", 2)
    speeds, strain = largest_speeds(path, highest=highest, ramp=1e-6, robot=ROBOT)
    pull = ROBOT.accelerations.min() / 4.0
    np.testing.assert_allclose(speeds, np.minimum(np.sqrt(2.0 * pull * np.minimum(grid, 0.5 - grid)), 0.5), rtol=5e-3)
    assert strain.max() < 1.001


def test_two_points_to_either_side_of_a_speed_below_half_of_what_holds_lie_beside_a_hole() -> None:
    held = np.full(14, 1.0)
    speeds = held.copy()
    speeds[6], speeds[11] = 0.49, 0.51
    near = topp._near_holes(speeds, held)  # pyright: ignore[reportPrivateUsage]
    assert np.flatnonzero(near).tolist() == [4, 5, 6, 7, 8]
    # What rises on one side alone is a ramp, and the ends of the grid are at rest.
    speeds[6:] = 0.3
    speeds[[0, -1]] = 0.0
    assert not topp._near_holes(speeds, held).any()  # pyright: ignore[reportPrivateUsage]
    # Next to an end there may be one.
    speeds = held.copy()
    speeds[1] = 0.2
    assert np.flatnonzero(topp._near_holes(speeds, held)).tolist() == [0, 1, 2, 3]  # pyright: ignore[reportPrivateUsage]
