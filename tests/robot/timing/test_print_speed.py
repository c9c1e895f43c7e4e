"""One speed for a print: what ramps cost by formula, and that a valve that only opens and shuts deposits the volume."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.model import FloatArray, JointPath, PoseStream, Process, Trajectory
from geoprint.robot.arm import Arm
from geoprint.robot.reach import bead_steps
from geoprint.robot.timing import print_speed, ramp_delay, ramp_delays, retime, timed_print, timed_targets
from geoprint.robot.timing.print_speed import TimedPrint, _Steps  # pyright: ignore[reportPrivateUsage]
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arc, arm_of, line, stream
from tests.robot.timing.test_spacing import hairpin

CELL = bent_cell()
ROBOT, ARM, PROCESS = CELL.robot, arm_of(CELL), replace(CELL.process, speed=20.0)
LENGTH, COUNT = 50.0, 401
TipsAt = Callable[[FloatArray], FloatArray]
# Joint 1 turns by 0.2 rad along 50 mm, so that the tip comes up to speed at 3000 mm/s2.
PULL = float(ROBOT.accelerations[0]) / (0.2 / LENGTH)
ENDS = np.linspace(0.0, LENGTH, COUNT)


def moving(times: FloatArray, tips: FloatArray) -> TipsAt:
    """Return the motion of a tip that goes evenly from place to place [mm]."""
    return lambda moments: np.column_stack([np.interp(moments, times, tips[:, axis]) for axis in range(3)])


@pytest.fixture(autouse=True)
def no_arm_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Joints are made up here, so that no arm passes the poses with them: how far it is off them is left out.

    How far the tip has come along its 50 mm is what joint 1 says.
    """

    def unasked(joint_path: JointPath, _arm: Arm, *, process: Process) -> JointPath:  # noqa: ARG001
        return joint_path

    def passed(times: FloatArray, joints: FloatArray, _arm: Arm, **_: object) -> TipsAt:
        turned = (joints[:, 0] - ROBOT.home[0]) / 0.2 * LENGTH
        return moving(times, np.column_stack([turned, 0.0 * turned, 0.0 * turned]))

    monkeypatch.setattr(print_speed, "with_bulges", unasked)
    monkeypatch.setattr(print_speed, "tips_at", passed)


def ramped(*, speed: float, pull: float, step: float, end: float) -> tuple[FloatArray, FloatArray]:
    """Return times [s], `step` apart, and lengths [mm] of a tip that leaves at `pull` [mm/s2] until it has a speed."""
    times = np.arange(0.0, end, step)
    up = speed / pull
    return times, np.where(times < up, pull * times**2 / 2.0, speed * (times - up / 2.0))


def made(turns: FloatArray, *, poses: PoseStream | None = None) -> JointPath:
    """Return the path of a tip along 50 mm while joint 1 sweeps and joint 6 turns by angles [rad]."""
    poses = stream(line((0.0, 0.0, 0.0), (LENGTH, 0.0, 0.0), count=COUNT)) if poses is None else poses
    joints = np.tile(ROBOT.home, (COUNT, 1))
    joints[:, 0] += 0.2 / LENGTH * poses.arcs
    joints[:, 5] += turns
    return JointPath(
        poses=poses, joints=joints, branch=0, rotations=np.zeros(COUNT), leans=np.zeros((COUNT, 2)),
        T_base_work=np.eye(4),
    )  # fmt: skip


def ring() -> PoseStream:
    """Return a ring of 50 mm."""
    return stream(arc(radius=LENGTH / (2.0 * np.pi), step=LENGTH / (COUNT - 1)))


def wave(amplitude: float, *, start: float, end: float, waves: int) -> FloatArray:
    """Return a wave [rad] between two places of the path [mm], at rest there and outside of them."""
    share = np.clip((ENDS - start) / (end - start), 0.0, 1.0)
    return amplitude * np.sin(2.0 * np.pi * waves * share) * np.sin(np.pi * share) ** 2


def two_runs(first: float) -> PoseStream:
    """Return the straight path as two runs, the first of which is so long [mm]."""
    poses = stream(line((0.0, 0.0, 0.0), (LENGTH, 0.0, 0.0), count=COUNT))
    last = round(first / LENGTH * (COUNT - 1))
    numbers, stops = np.zeros(COUNT, dtype=np.int64), poses.stops.copy()
    numbers[last + 1 :] = 1
    stops[[last, last + 1]] = True
    return replace(poses, runs=numbers, stops=stops)


def printed(path: JointPath, *, speed: float = 20.0, constant_flow: bool = True) -> TimedPrint:
    return timed_print(path, ARM, process=replace(PROCESS, speed=speed), constant_flow=constant_flow)


def share(path: JointPath, trajectory: Trajectory, *, speed: float, run: int = 0) -> float:
    """Return the volume of a run over the planned one: speed * time without ramps of v / 2 a each / length."""
    rows = np.flatnonzero(path.poses.deposited & (path.poses.runs[1:] == run))
    time = float(np.diff(trajectory.pose_times)[rows].sum()) - 2.0 * speed / (2.0 * PULL)
    return speed * time / float(np.linalg.norm(np.diff(path.poses.tips, axis=0), axis=1)[rows].sum())


@pytest.mark.parametrize("pull", [400.0, 1000.0, 3000.0])
@pytest.mark.parametrize("speed", [7.0, 20.0])
@pytest.mark.parametrize("step", [2e-5, 1e-4, 1e-3, 4e-3])
def test_a_run_from_rest_takes_speed_over_twice_the_acceleration_longer(speed: float, pull: float, step: float) -> None:
    times, lengths = ramped(speed=speed, pull=pull, step=step, end=0.2)
    assert ramp_delay(times, lengths, speed=speed) == pytest.approx(speed / (2.0 * pull), rel=0.012)
    # Behind the ramp nothing counts, not even a stop.
    times = np.append(times, times[-1] + [1.0, 1.001])
    assert ramp_delay(times, np.append(lengths, lengths[-1] + [0.0, 1.0]), speed=speed) == pytest.approx(
        speed / (2.0 * pull), rel=0.012
    )


@pytest.mark.parametrize("step", [0.002, 0.05, 0.5])
def test_the_delay_does_not_depend_on_how_far_poses_lie_apart(step: float) -> None:
    """At 250 mm/s2 the ramp to 20 mm/s is 0.8 mm long: 400, 16 and 2 steps."""
    lengths = np.arange(0.0, 3.0, step)
    times = np.where(lengths < 0.8, np.sqrt(2.0 * lengths / 250.0), 0.08 + (lengths - 0.8) / 20.0)
    assert ramp_delay(times, lengths, speed=20.0) == pytest.approx(0.04, rel=0.012)


def test_where_joints_hold_less_the_ramp_ends_there_and_the_rest_is_no_ramp() -> None:
    times, lengths = ramped(speed=8.0, pull=400.0, step=1e-3, end=0.2)
    assert ramp_delay(times, lengths, speed=20.0) == pytest.approx(8.0 / 800.0, rel=0.012)


def test_a_run_that_stands_has_no_delay_and_none_is_longer_than_50_ms() -> None:
    assert ramp_delay(0.01 * np.arange(5.0), np.zeros(5), speed=20.0) == 0.0
    assert ramp_delay(*ramped(speed=20.0, pull=100.0, step=1e-3, end=0.5), speed=20.0) == 0.05


def test_a_pose_that_is_there_twice_changes_no_delay_and_a_rest_at_the_start_counts() -> None:
    times, lengths = ramped(speed=20.0, pull=1000.0, step=1e-3, end=0.1)
    for rest in (0.0, 0.01):
        before = np.array([0.0, rest / 2.0])
        delay = ramp_delay(np.append(before, rest + times), np.append([0.0, 0.0], lengths), speed=20.0)
        assert delay == pytest.approx(rest + 0.01, rel=0.012)


# Of the bead in tests of runs as long as that, or longer [mm].
WIDTH = 1.0


def steps(*runs: tuple[float, float]) -> _Steps:
    """Return runs of which (length [mm], speed [mm/s]) are given, in ten steps each."""
    lengths = np.repeat([length / 10.0 for length, _ in runs], 10)
    speeds = np.repeat([speed for _, speed in runs], 10)
    return _Steps(np.repeat(np.arange(len(runs)), 10), lengths, lengths / speeds, WIDTH)


def test_what_holds_its_speed_keeps_it() -> None:
    assert steps((10.0, 20.0), (30.0, 20.0)).highest_speed(20.0) is None
    # 2 % of one run is too much for all of them, and 1 % is not.
    assert steps((10.0, 19.8)).highest_speed(20.0) is None
    assert steps((10.0, 19.6)).highest_speed(20.0) == 19.95


def test_a_short_run_is_given_no_more_than_4_and_a_half_percent_too_much() -> None:
    """A run at 10 mm/s gets v / 10 of its volume: 10.45 mm/s are too fast by a twentieth of a millimetre a second."""
    assert steps((1.0, 10.0), (99.0, 20.0)).highest_speed(20.0) == pytest.approx(10.45, abs=0.011)
    # What a run loses within 4.5 % is kept where all of them get no more than 1.8 % too much.
    assert steps((20.0, 19.2), (80.0, 20.0)).highest_speed(20.0) is None


def test_what_a_dot_is_given_too_much_counts_over_the_width_of_its_bead() -> None:
    """A fifth of a width at v instead of 10 mm/s: (v / 10 - 1) / 5 <= 0.045, v <= 12.25."""
    assert steps((0.2, 10.0), (99.8, 20.0)).highest_speed(20.0) == pytest.approx(12.25, abs=0.011)


def test_all_runs_together_are_given_no_more_than_1_8_percent_too_much() -> None:
    """One run at 10 mm/s: 10.18 mm/s at most."""
    assert steps((10.0, 10.0)).highest_speed(20.0) == 10.18
    # Half of it, at v: (v / 10 + 1) / 2 <= 1.018, v <= 10.36, where each run by itself would allow 10.45.
    assert steps((50.0, 10.0), (50.0, 20.0)).highest_speed(20.0) == 10.36


def test_within_a_run_only_the_sum_counts() -> None:
    """A twentieth of a run at 10 mm/s, the rest at 20: 0.05 v / 10 + 0.95 <= 1.018, v <= 13.6."""
    lengths = np.array([5.0, 95.0])
    assert _Steps(np.zeros(2, dtype=np.int64), lengths, lengths / [10.0, 20.0], WIDTH).highest_speed(20.0) == 13.6
    # Two hundredths cost (20 / 10 - 1) * 0.02 = 2 %, one hundredth half of that.
    for dip, speed in ((2.0, 19.0), (1.0, None)):
        lengths = np.array([dip, 100.0 - dip])
        found = _Steps(np.zeros(2, dtype=np.int64), lengths, lengths / [10.0, 20.0], WIDTH).highest_speed(20.0)
        assert found == speed


@pytest.mark.parametrize("pull", [400.0, 2000.0])
def test_the_ramps_at_both_ends_of_a_run_take_nothing_and_a_stop_within_it_does(pull: float) -> None:
    """Up, 20 mm at 20 mm/s, a rest of 100 ms, and down again."""
    times, lengths = ramped(speed=20.0, pull=pull, step=1e-3, end=0.5)
    middle = np.append(times, times[-1] + 0.1)
    up = np.append(lengths, lengths[-1])
    times = np.append(middle, middle[-1] + np.cumsum(np.diff(times)[::-1]))
    lengths = np.append(up, up[-1] + np.cumsum(np.diff(lengths)[::-1]))
    tips = np.column_stack([lengths, 0.0 * lengths, 0.0 * lengths])
    found = _Steps.of(stream(tips), times, moving(times, tips), speed=20.0, width=WIDTH)
    np.testing.assert_allclose(found.lengths, np.diff(lengths))
    assert found.times.sum() == pytest.approx(lengths[-1] / 20.0 + 0.1, abs=0.025 * 20.0 / pull)
    assert (found.times <= np.diff(times) + 1e-12).all()
    assert (found.times >= found.lengths / 20.0 - 1e-9).all()


def test_what_a_speed_is_looked_for_with_is_what_the_valve_lets_through() -> None:
    """The ramp ends where its speed rises by 1 % in 4 ms no more, which poses 2 mm apart do not show."""
    times, lengths = ramped(speed=9.0, pull=400.0, step=1e-3, end=0.0225)
    rising = 9.0 + 3.0 * np.arange(0.0, 0.2, 1e-3) / 0.2
    lengths = np.append(lengths, lengths[-1] + np.cumsum(np.append(rising, np.full(300, 20.0))) * 1e-3)
    lengths = np.append(lengths, lengths[-1] + np.cumsum(np.diff(lengths)[::-1]))
    times: FloatArray = 1e-3 * np.arange(lengths.size, dtype=np.float64)
    places = np.append(np.arange(0.0, lengths[-1], 2.0), lengths[-1])
    poses = stream(np.column_stack([places, 0.0 * places, 0.0 * places]))
    passed = np.interp(places, lengths, times)
    tips = moving(times, np.column_stack([lengths, 0.0 * lengths, 0.0 * lengths]))
    found = _Steps.of(poses, passed, tips, speed=20.0, width=WIDTH)
    delays = ramp_delays((0.0, float(times[-1])), tips, speed=20.0)
    assert delays == pytest.approx((9.0 / 800.0, 9.0 / 800.0), rel=0.1)
    assert found.times.sum() == pytest.approx(times[-1] - sum(delays), abs=1e-9)


@pytest.mark.parametrize("settle", [0.1, 0.4])
def test_a_flow_that_settles_gives_each_run_half_of_its_wait_and_the_ramp_at_its_start(settle: float) -> None:
    """40 mm at 20 mm/s after a ramp of v / a, which takes v / (2 a) longer than at that speed."""
    times, lengths = ramped(speed=20.0, pull=400.0, step=1e-3, end=2.025)
    tips = np.column_stack([lengths, 0.0 * lengths, 0.0 * lengths])
    found = _Steps.of(stream(tips), times, moving(times, tips), speed=20.0, width=WIDTH, settle=settle)
    assert found.times.sum() - lengths[-1] / 20.0 == pytest.approx(0.025, abs=1e-3)
    # What is too much may be 1.8 % of the length.
    speed = found.highest_speed(20.0)
    assert speed is not None
    shares = [
        each * (np.maximum(found.times, found.lengths / each).sum() + settle / 2.0) / lengths[-1]
        for each in (speed, speed + 0.01)
    ]
    assert shares[0] <= 1.018 < shares[1]


def test_only_what_deposits_is_counted_and_runs_have_no_gaps() -> None:
    poses = stream(
        line((0.0, 0.0, 0.0), (5.0, 0.0, 0.0), count=6),
        deposit=np.array([True, True, False, False, True, True]),
        runs=np.array([3, 3, 7, 7, 7, 7]),
    )
    times = np.array([0.0, 0.05, 1.0, 2.0, 3.0, 3.05])
    found = _Steps.of(poses, times, moving(times, poses.tips), speed=20.0, width=WIDTH)
    assert found.runs.tolist() == [0, 1]
    np.testing.assert_allclose(found.times, 0.05)
    still = replace(poses, deposit=np.zeros(6, np.bool_))
    nothing = _Steps.of(still, times, moving(times, poses.tips), speed=20.0, width=WIDTH)
    assert nothing.highest_speed(20.0) is None


def test_a_ring_whose_joints_hold_less_than_the_ceiling_is_printed_slower_and_gets_its_volume() -> None:
    path = made(wave(0.06, start=2.0, end=48.0, waves=10), poses=ring())
    fast = retime(path, ROBOT, process=PROCESS)
    assert share(path, fast, speed=20.0) > 1.05
    found = printed(path)
    speed = found.process.speed
    assert 5.0 < speed < 18.0
    assert speed == round(speed, 2)
    assert share(path, found.trajectory, speed=speed) == pytest.approx(1.005, abs=0.012)
    # It is the highest one: 5 % faster less than 90 % of the length are at speed.
    assert found.trajectory.share_at_speed >= 0.9
    faster = retime(path, ROBOT, process=replace(PROCESS, speed=1.05 * speed))
    assert faster.share_at_speed < 0.9
    # What is timed is what is written, at the speed of the print where that is held.
    inner = found.targets.speeds[1:]
    assert inner.max() == speed
    np.testing.assert_array_equal(found.trajectory.pose_times, retime(path, ROBOT, process=found.process).pose_times)


def test_a_joint_at_its_top_speed_all_along_sets_the_speed_of_the_print() -> None:
    """Joint 6 turns by 420 degrees a second at most, here by 0.24 rad a millimetre off soft ends: 30.5 mm/s."""
    rates = 0.24 * np.clip(np.minimum(ENDS, LENGTH - ENDS) / 10.0, 0.0, 1.0)
    turns = np.append(0.0, np.cumsum((rates[1:] + rates[:-1]) / 2.0 * np.diff(ENDS)))
    held = np.radians(420.0) / 0.24
    found = printed(made(turns - turns[-1] / 2.0 - ROBOT.home[5]), speed=60.0)
    # Three fifths of the run are that slow: (v / held - 1) * 0.6 <= 0.018, so that v <= 1.03 held.
    assert 1.0 < found.process.speed / held < 1.035
    assert found.trajectory.slowest_deposit == pytest.approx(held, rel=0.01)


@settings(max_examples=8, deadline=None)
@given(st.floats(0.0, 0.08), st.integers(4, 14))
def test_every_run_gets_its_volume_within_5_percent_and_the_whole_within_2(amplitude: float, waves: int) -> None:
    turns = wave(amplitude, start=1.0, end=19.0, waves=waves)
    path = made(turns, poses=two_runs(20.0))
    found = printed(path)
    speed = found.process.speed
    shares = [share(path, found.trajectory, speed=speed, run=run) for run in (0, 1)]
    assert min(shares) > 0.99
    assert max(shares) < 1.05
    assert 0.4 * shares[0] + 0.6 * shares[1] < 1.02


def test_a_short_run_that_is_slow_sets_the_speed_of_all_of_them() -> None:
    turns = wave(0.06, start=1.0, end=4.0, waves=2)
    path = made(turns, poses=two_runs(5.0))
    found = printed(path)
    speed = found.process.speed
    assert speed < 19.0
    assert share(path, found.trajectory, speed=speed) == pytest.approx(1.04, abs=0.012)
    assert share(path, found.trajectory, speed=speed, run=1) == pytest.approx(1.0, abs=0.005)


def dashes(length: float) -> PoseStream:
    """Return the straight path as runs of so many millimetres each, which all begin and end at rest."""
    every = round(length / LENGTH * (COUNT - 1))
    # Each begins in the place where the one before ends; rows that are left stay where the last one ends.
    numbers = np.minimum(np.arange(COUNT) // (every + 1), COUNT // (every + 1) - 1)
    steps = np.minimum(np.arange(COUNT) - numbers, every * (numbers[-1] + 1))
    poses = stream(np.outer(steps * LENGTH / (COUNT - 1), [1.0, 0.0, 0.0]))
    ends = np.diff(numbers) != 0
    return replace(poses, runs=numbers, stops=poses.stops | np.append(ends, True) | np.append(True, ends))


@pytest.mark.parametrize("ceiling", [25.0, 27.0])
def test_short_runs_are_printed_so_slowly_that_nine_tenths_are_at_speed(ceiling: float) -> None:
    """Ramps are as long as the square of the speed."""
    path = made(np.zeros(COUNT), poses=dashes(1.0))
    ramps = 1.0 - retime(path, ROBOT, process=replace(PROCESS, speed=ceiling)).share_at_speed
    assert ramps > 0.11
    found = printed(path, speed=ceiling)
    assert found.process.speed == pytest.approx(ceiling * (0.1 / ramps) ** 0.5, rel=0.04)
    assert 0.9 <= found.trajectory.share_at_speed < 0.91


def test_what_would_crawl_until_nine_tenths_are_at_speed_keeps_its_speed() -> None:
    found = printed(made(np.zeros(COUNT), poses=dashes(1.0)), speed=32.0)
    assert found.process.speed == 32.0
    assert found.trajectory.share_at_speed < 0.7


def test_a_single_run_with_a_short_dip_keeps_the_ceiling() -> None:
    path = made(wave(0.003, start=24.0, end=26.0, waves=2))
    found = printed(path)
    assert found.trajectory.slowdowns
    assert found.trajectory.slowest_deposit < 18.0
    assert found.process.speed == 20.0
    assert 1.001 < share(path, found.trajectory, speed=20.0) < 1.02


@pytest.mark.parametrize("angle", [2.0, 3.1, 5.0])
def test_a_place_that_is_slower_for_its_targets_counts(angle: float) -> None:
    """A bend of less than a millimetre half way along 21 mm, where targets come too soon at 20 mm/s but for 2 rad."""
    path = hairpin(angle)
    found = printed(path)
    speed = found.process.speed
    assert [bend for bend in found.targets.bends if bend.kind == "close"] == []
    # Joint 1 turns by a thousandth of a radian a millimetre: ramps of a millisecond.
    time = float(np.ptp(found.trajectory.pose_times)) - speed / (float(ROBOT.accelerations[0]) / 1e-3)
    assert speed * time / float(path.poses.arcs[-1]) < 1.02
    # A twentieth less is enough: the slower print has other targets.
    assert 19.0 <= speed <= 20.0
    at_ceiling = timed_targets(path, ROBOT, process=PROCESS)[0].slowdowns
    assert (speed < 20.0) == (angle > 2.0) == any(slow.limit == "targets" for slow in at_ceiling)


def test_what_no_joint_slows_keeps_the_ceiling_and_never_exceeds_it() -> None:
    for speed in (7.3, 20.0, 33.33):
        assert printed(made(np.zeros(COUNT)), speed=speed).process.speed == speed


def test_where_the_flow_follows_the_speed_stays() -> None:
    path = made(wave(0.06, start=2.0, end=48.0, waves=10))
    found = printed(path, constant_flow=False)
    assert found.process.speed == 20.0
    np.testing.assert_array_equal(found.trajectory.joints, retime(path, ROBOT, process=PROCESS).joints)
    assert printed(path).process.speed < 20.0


@pytest.mark.parametrize(("side", "tip_speed"), [(1.0, 20.0 * 10.5 / 10.0), (-1.0, 20.0 * 9.5 / 10.0)])
def test_around_a_cylinder_the_tip_runs_so_much_faster_as_its_circle_is_larger_and_in_a_hollow_slower(
    side: float, tip_speed: float
) -> None:
    """Half a millimetre above a cylinder of 10 mm, outside of it and inside."""
    outward = arc(radius=1.0, step=0.0125, angle=0.0125 * (COUNT - 1))
    tips = (10.0 + 0.5 * side) * outward
    poses = replace(stream(tips), normals=side * outward, standoff=0.5)
    np.testing.assert_allclose(bead_steps(poses), 2.0 * 10.0 * np.sin(0.0125 / 2.0), rtol=1e-9)
    found = printed(made(np.zeros(COUNT), poses=poses))
    speeds = np.linalg.norm(np.diff(tips, axis=0), axis=1) / np.diff(found.trajectory.pose_times)
    np.testing.assert_allclose(speeds[20:-20], tip_speed, rtol=1e-5)
    assert found.process.speed == 20.0
    assert found.trajectory.slowest_deposit == pytest.approx(20.0, rel=1e-4)
    assert found.trajectory.slowdowns == ()


def test_normals_that_jump_from_step_to_step_do_not_let_the_tip_jump() -> None:
    """Normals of triangles off by a degree: steps of the surface change by 8 %, the speed of the tip by a tenth."""
    angles = np.radians(1.0) * np.where(np.arange(COUNT) % 2 == 0, 1.0, -1.0)
    normals = np.column_stack([np.sin(angles), np.zeros(COUNT), np.cos(angles)])
    poses = replace(stream(line((0.0, 0.0, 0.0), (LENGTH, 0.0, 0.0), count=COUNT)), normals=normals)
    raw = poses.bead_lengths / np.diff(ENDS)
    assert np.abs(np.diff(raw)).min() > 0.08
    beads = bead_steps(poses) / np.diff(ENDS)
    assert np.abs(beads - 1.0).max() < 0.012
    trajectory = retime(made(np.zeros(COUNT), poses=poses), ROBOT, process=PROCESS)
    speeds = np.diff(ENDS) / np.diff(trajectory.pose_times)
    assert np.ptp(speeds[10:-10]) < 0.02 * 20.0


def test_on_travel_and_beside_it_the_length_of_a_step_is_that_of_the_tip() -> None:
    outward = arc(radius=1.0, step=0.05)
    deposit = np.arange(len(outward)) >= 40
    poses = replace(stream(10.5 * outward, deposit=deposit), normals=outward, standoff=0.5)
    steps_of_tip = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)
    np.testing.assert_allclose(bead_steps(poses), steps_of_tip * np.where(poses.deposited, 10.0 / 10.5, 1.0), rtol=1e-9)
