"""Time parameterisation: known profiles, limits by differentiation, and every refusal of the verifier."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import InputError, LimitError, VerificationError
from geoprint.model import FloatArray, JointPath, Robot, Trajectory
from geoprint.robot.timing import confirmation, topp, topp as path_speeds, unconfirmed_speeds
from geoprint.robot.timing.reachability import Problem
from geoprint.robot.timing.retiming import _labels, retime, verify  # pyright: ignore[reportPrivateUsage]
from geoprint.robot.timing.topp import fastest_motion, straight_motion
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arc, arm_of, line, solved, stream, tilted, two_runs

CELL = bent_cell()
ROBOT, PROCESS = CELL.robot, CELL.process
ARM = arm_of(CELL)
FAST = replace(PROCESS, speed=60.0)


@pytest.fixture(scope="module")
def path() -> JointPath:
    return solved(two_runs(), ARM)


@pytest.fixture(scope="module")
def trajectory(path: JointPath) -> Trajectory:
    return retime(path, ROBOT, process=PROCESS)


def timed(joint_path: JointPath, *, speed: float = PROCESS.speed, robot: Robot = ROBOT) -> Trajectory:
    return retime(joint_path, robot, process=replace(PROCESS, speed=speed))


def tip_speeds(found: Trajectory) -> FloatArray:
    tips = ARM.tool_poses(found.joints)[:, :3, 3]
    return np.linalg.norm(np.diff(tips, axis=0), axis=1) / 1e-3


def largest_shares(found: Trajectory) -> tuple[float, float]:
    """Return the largest speed and acceleration by their limits, from plain differences of the rows."""
    joints = np.vstack([ROBOT.home, found.joints, ROBOT.home])
    speeds = np.diff(joints, axis=0) / 1e-3
    accelerations = np.diff(speeds, axis=0) / 1e-3
    return float((np.abs(speeds) / ROBOT.speeds).max()), float((np.abs(accelerations) / ROBOT.accelerations).max())


def rough_path(*, count: int, noise: float) -> JointPath:
    """Return joints that tremble from pose to pose while the tip is said to go straight on."""
    joints = ROBOT.home + noise * np.random.default_rng(1).normal(size=(count, 6))
    poses = stream(line((0.0, 0.0, 0.0), (0.5 * (count - 1), 0.0, 0.0), count=count))
    return JointPath(
        poses=poses, joints=joints, branch=0,
        rotations=np.zeros(count), leans=np.zeros((count, 2)), T_base_work=np.eye(4),
    )  # fmt: skip


@pytest.mark.parametrize(("turn", "duration"), [(1.0, 1.5), (0.1, 2.0 * np.sqrt(0.05))])
def test_a_joint_move_takes_the_time_of_its_trapezoid_or_triangle(turn: float, duration: float) -> None:
    end = turn * np.array([1.0, -0.5, 0.0, 0.25, 0.0, 0.1])
    motion = straight_motion(np.zeros(6), end, speeds=np.ones(6), accelerations=np.full(6, 2.0))
    assert motion.duration == pytest.approx(duration, rel=1e-12)
    np.testing.assert_allclose(motion.joints_at(np.array([0.0, duration / 2, duration])), np.outer([0, 0.5, 1], end))


@pytest.mark.parametrize(("ceiling", "count"), [(0.05, 2), (0.05, 40), (1.0, 2), (1.0, 41)])
def test_a_straight_piece_takes_the_time_of_its_trapezoid_or_triangle(ceiling: float, count: int) -> None:
    lengths = np.linspace(0.0, 0.1, count)
    slope = np.array([5.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    motion = fastest_motion(np.outer(lengths, slope), lengths, ceilings=np.full(count - 1, ceiling), robot=ROBOT)
    pull = ROBOT.accelerations[0] / slope[0]
    top = min(ceiling, ROBOT.speeds[0] / slope[0])
    ideal = 0.1 / top + top / pull if top**2 / pull < 0.1 else 2.0 * np.sqrt(0.1 / pull)
    assert motion.duration == pytest.approx(ideal, rel=1e-3)
    assert not motion.stretched


def test_speeds_and_accelerations_of_the_rows_stay_within_the_limits(trajectory: Trajectory) -> None:
    speed, acceleration = largest_shares(trajectory)
    assert speed <= 1.0
    assert 0.99 < acceleration < 1.005


def test_the_tip_runs_at_its_set_speed_and_never_faster(trajectory: Trajectory) -> None:
    speeds = tip_speeds(trajectory)
    depositing = trajectory.deposit[:-1]
    travelling = (trajectory.runs[:-1] >= 0) & ~depositing & ~trajectory.deposit[1:]
    assert np.median(speeds[depositing]) == pytest.approx(PROCESS.speed, rel=1e-3)
    assert speeds[depositing].max() < 1.001 * PROCESS.speed
    assert 0.9 * PROCESS.travel_speed < speeds[travelling].max() < 1.001 * PROCESS.travel_speed
    assert trajectory.slowest_deposit == pytest.approx(PROCESS.speed, rel=1e-3)


def test_it_starts_and_ends_at_home_and_rests_at_every_stop(path: JointPath, trajectory: Trajectory) -> None:
    np.testing.assert_array_equal(trajectory.joints[[0, -1]], np.stack([ROBOT.home, ROBOT.home]))
    np.testing.assert_allclose(np.diff(trajectory.times), 1e-3, rtol=1e-9)
    rows = np.round(trajectory.pose_times[path.poses.stops] / 1e-3).astype(np.int64)
    # Within half a row of the rest a joint turns at no more than its acceleration times a millisecond.
    assert (np.abs(np.diff(trajectory.joints, axis=0))[rows] <= 1.5e-6 * ROBOT.accelerations).all()


def test_every_pose_is_passed_at_its_time_and_later_than_the_one_before(
    path: JointPath, trajectory: Trajectory
) -> None:
    assert (np.diff(trajectory.pose_times) > 0.0).all()
    for joint in range(6):
        passed = np.interp(trajectory.pose_times, trajectory.times, trajectory.joints[:, joint])
        np.testing.assert_allclose(passed, path.joints[:, joint], atol=4e-6)


def test_rows_carry_the_run_they_lead_to_and_deposit_only_inside_runs(path: JointPath, trajectory: Trajectory) -> None:
    start, end = trajectory.pose_times[[0, -1]]
    away = (trajectory.times < start) | (trajectory.times >= end)
    assert (trajectory.runs[away] == -1).all()
    assert (np.diff(trajectory.runs[~away]) >= 0).all()
    deposited = np.diff(trajectory.pose_times)[path.poses.deposited].sum()
    assert trajectory.deposit.sum() * 1e-3 == pytest.approx(deposited, abs=2e-3)
    assert not trajectory.deposit[away].any()


def test_a_corner_without_a_stop_is_passed_slower_but_the_rest_at_speed() -> None:
    corner = np.vstack(
        [line((-10.0, 0.0, 0.0), (0.0, 0.0, 0.0), count=21), line((0.0, 0.5, 0.0), (0.0, 10.0, 0.0), count=20)]
    )
    smooth = timed(solved(stream(corner, stops=(20,)), ARM), speed=60.0)
    sharp = timed(solved(stream(corner), ARM), speed=60.0)
    at_corner = np.abs(sharp.times - sharp.pose_times[20]).argmin()
    speeds = tip_speeds(sharp)
    assert smooth.slowest_deposit == pytest.approx(60.0, rel=1e-3)
    assert sharp.slowest_deposit < 50.0
    assert speeds[at_corner] < 50.0
    assert np.percentile(speeds[sharp.deposit[:-1]], 60) > 59.0
    assert sharp.stretched == 0


def test_a_deposit_behind_a_lead_begins_at_the_speed_of_the_print() -> None:
    """What leads to it without a stop is passed at that speed as well, however fast the tool may travel."""
    deposit = (np.arange(81) >= 20) & (np.arange(81) <= 60)
    path = solved(stream(line((-20.0, 0.0, 0.0), (20.0, 0.0, 0.0), count=81), deposit=deposit), ARM)
    for travel_speed in (20.0, 200.0):
        found = retime(path, ROBOT, process=replace(PROCESS, speed=60.0, travel_speed=travel_speed))
        assert found.slowest_deposit == pytest.approx(60.0, rel=1e-3)
        assert found.share_at_speed == pytest.approx(1.0)
        assert tip_speeds(found)[found.runs[:-1] >= 0].max() == pytest.approx(60.0, rel=1e-2)


def test_a_piece_of_two_poses_is_timed_like_one_of_many() -> None:
    ends = (-0.5, 0.0, 0.0), (0.5, 0.0, 0.0)
    two = timed(solved(stream(line(*ends, count=2)), ARM))
    many = timed(solved(stream(line(*ends, count=30)), ARM))
    assert two.duration == pytest.approx(many.duration, rel=2e-3)


@pytest.mark.parametrize("count", [2, 30])
def test_a_turn_on_the_spot_runs_at_the_limits_of_the_joints(count: int) -> None:
    poses = stream(
        np.zeros((count, 3)), quaternions=tilted(np.linspace(0.0, 0.5, count)), deposit=np.zeros(count, bool)
    )
    found = timed(solved(poses, ARM))
    assert (np.diff(found.pose_times) > 0.0).all()
    turning = found.runs == 0
    accelerations = np.abs(np.diff(found.joints[turning], 2, axis=0)) / 1e-6 / ROBOT.accelerations
    assert accelerations.max() == pytest.approx(1.0, abs=0.01)
    assert found.slowest_deposit == PROCESS.speed


def test_poses_in_the_same_place_are_passed_at_the_same_time() -> None:
    tips = arc(angle=1.0)
    once = timed(solved(stream(tips), ARM))
    twice = timed(solved(stream(np.repeat(tips, 2, axis=0)), ARM))
    np.testing.assert_allclose(twice.pose_times, np.repeat(once.pose_times, 2), atol=1e-6)


def test_a_single_pose_is_visited_and_left() -> None:
    found = timed(solved(stream(np.zeros((1, 3))), ARM))
    passed = round(float(found.pose_times[0]) / 1e-3)
    assert passed == pytest.approx(found.times.size / 2, abs=1.0)
    assert (found.runs == -1).all()


def test_a_path_that_begins_and_ends_at_home_has_no_joint_moves() -> None:
    path = rough_path(count=40, noise=0.0)
    joints = ROBOT.home + 0.1 * np.sin(np.linspace(0.0, np.pi, 40))[:, None] ** 2
    found = timed(replace(path, joints=joints))
    assert found.pose_times[0] == 0.0
    assert found.duration == pytest.approx(found.pose_times[-1], abs=1e-3)


def test_a_rough_path_keeps_its_limits_on_a_finer_grid_or_is_stretched(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = replace(ROBOT, response=0.0)
    refined = timed(rough_path(count=200, noise=1e-3), speed=60.0, robot=exact)
    assert refined.stretched == 0
    monkeypatch.setattr(topp, "REFINEMENTS", 0)
    found = timed(rough_path(count=200, noise=1e-3), speed=60.0, robot=exact)
    assert found.stretched == 1
    assert max(largest_shares(refined)) <= 1.01
    assert max(largest_shares(found)) <= 1.01
    assert found.slowest_deposit < refined.slowest_deposit < 30.0


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 1000), st.floats(5.0, 200.0), st.integers(2, 60))
def test_smooth_paths_keep_their_limits_and_lower_accelerations_never_save_time(
    seed: int, speed: float, count: int
) -> None:
    amplitudes, phases = np.random.default_rng(seed).uniform([[0.0], [0.0]], [[0.3], [6.0]], size=(2, 6))
    phase = np.linspace(0.0, 3.0, count)[:, None]
    path = replace(rough_path(count=count, noise=0.0), joints=ROBOT.home + amplitudes * np.sin(phase + phases))
    process = replace(PROCESS, speed=speed)
    found = retime(path, ROBOT, process=process)
    slower = retime(path, replace(ROBOT, accelerations=ROBOT.accelerations / 2.0), process=process)
    assert max(largest_shares(found)) < 1.01
    assert slower.duration > found.duration - 1e-3


def test_an_empty_path_is_refused() -> None:
    with pytest.raises(InputError, match="no poses"):
        timed(rough_path(count=0, noise=0.0))


def test_a_jump_of_the_joints_on_the_spot_is_refused() -> None:
    path = solved(stream(np.repeat(arc(angle=0.5), 2, axis=0)), ARM)
    joints = path.joints.copy()
    joints[5, 3] += 0.01
    with pytest.raises(LimitError, match=r"run 1, pose 5: joint 4 jumps by 0\.01 rad"):
        timed(replace(path, joints=joints))


def test_a_path_that_no_speed_can_follow_is_refused_by_its_run(
    path: JointPath, monkeypatch: pytest.MonkeyPatch
) -> None:
    def give_up(_: object) -> None:
        return None

    monkeypatch.setattr(path_speeds, "reachable_speeds", give_up)
    with pytest.raises(LimitError, match="run 1: no speed keeps the joint accelerations") as refusal:
        timed(path)
    assert refusal.value.details["run"] == 0


def test_without_toppra_a_motion_is_the_same_and_said_not_to_be_confirmed(
    path: JointPath, trajectory: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(_: str) -> None:
        return None

    assert unconfirmed_speeds() == ()
    monkeypatch.setattr(confirmation.importlib.util, "find_spec", missing)
    monkeypatch.setattr(confirmation, "import_module", pytest.fail)
    np.testing.assert_array_equal(timed(path).joints, trajectory.joints)
    assert unconfirmed_speeds() == ("the speeds, by a second library: toppra is not installed",)


def test_where_toppra_finds_no_motion_shorter_legs_are_asked_about_and_then_it_is_said(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    pytest.importorskip("toppra")
    path = solved(stream(arc(angle=0.8), stops=(0, 22, 32)), ARM)
    asked: list[int] = []

    def none_at_first(problem: Problem) -> FloatArray | None:
        asked.append(problem.grid.size)
        return problem.highest if len(asked) in answered else None

    monkeypatch.setattr(confirmation, "_speeds_of_toppra", none_at_first)
    answered = {2}
    timed(path)
    assert len(asked) == 2
    assert asked[0] > asked[1]
    assert not caplog.messages
    answered = set[int]()
    timed(path)
    assert len(asked) == 4
    assert ["note: toppra finds no motion" in message for message in caplog.messages] == [True]


def test_a_motion_is_refused_that_toppra_finds_slower(path: JointPath, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("toppra")
    known = confirmation._speeds_of_toppra  # pyright: ignore[reportPrivateUsage]

    def slower(problem: Problem) -> FloatArray | None:
        found = known(problem)
        return None if found is None else 0.95 * found

    monkeypatch.setattr(confirmation, "_speeds_of_toppra", slower)
    with pytest.raises(VerificationError, match="toppra finds a lower speed than geoprint"):
        timed(path)


def test_toppra_is_imported_only_when_something_is_timed() -> None:
    code = (
        "import sys, geoprint.robot.timing.retiming; sys.exit('toppra' in sys.modules or 'matplotlib' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_sound_trajectory_passes_the_verifier(path: JointPath, trajectory: Trajectory) -> None:
    verify(trajectory, path, robot=ROBOT, process=PROCESS)


def moved(found: Trajectory, *, rows: slice, by: FloatArray) -> Trajectory:
    joints = found.joints.copy()
    joints[rows] += by
    return replace(found, joints=joints)


@pytest.mark.parametrize(
    ("rows", "amount", "message"),
    [
        (slice(3000, 3001), 2e-5, "joint 3 accelerates at"),
        (slice(3000, None), 0.02, "ends with joint 3"),
        (slice(None, 1), 1e-6, "starts with joint 3"),
        (slice(3000, 3003), 0.1, "joint 3 turns at"),
        (
            slice(2000, 4000),
            3.0,
            r"run \d at tip \(.* mm, where the tool turns by \d+ degrees within [0-9.]+ mm, .* the middle",
        ),
    ],
)
def test_a_planted_violation_is_found_with_its_joint(
    path: JointPath, trajectory: Trajectory, rows: slice, amount: float, message: str
) -> None:
    planted = moved(trajectory, rows=rows, by=amount * np.eye(6)[2])
    with pytest.raises(LimitError, match=message) as refusal:
        verify(planted, path, robot=ROBOT, process=PROCESS)
    assert refusal.value.details["joint"] == 3


@pytest.mark.parametrize("order", [1, -1])
def test_a_start_or_an_end_that_is_not_at_rest_is_found(path: JointPath, order: int) -> None:
    times = np.arange(1001, dtype=np.float64) * 1e-3
    leaving = (times * (1.0 - times) ** 2)[::order]
    planted = Trajectory(
        times=times, joints=ROBOT.home + 0.5 * leaving[:, None] * np.eye(6)[2], runs=np.full(1001, -1),
        deposit=np.zeros(1001, np.bool_), pose_times=np.zeros(path.poses.count), stretched=0, slowest_deposit=20.0,
        slowdowns=(), share_at_speed=1.0, share_on_ramps=0.0,
    )  # fmt: skip
    with pytest.raises(LimitError, match=r"the motion from or to home, .* s: joint 3 accelerates at 49") as refusal:
        verify(planted, path, robot=ROBOT, process=PROCESS)
    assert refusal.value.details["time_s"] == pytest.approx(0.0 if order == 1 else 1.0, abs=2e-3)


def test_a_tip_that_is_too_fast_is_found(path: JointPath, trajectory: Trajectory) -> None:
    with pytest.raises(LimitError, match="mm are passed from pose"):
        verify(trajectory, path, robot=ROBOT, process=replace(PROCESS, speed=19.0))


def test_a_pose_that_is_not_passed_is_found(path: JointPath, trajectory: Trajectory) -> None:
    times = trajectory.pose_times.copy()
    times[50] += 0.005
    with pytest.raises(VerificationError, match="passes pose 50 with joint"):
        verify(replace(trajectory, pose_times=times), path, robot=ROBOT, process=FAST)


def test_rows_that_are_not_a_millisecond_apart_are_found(path: JointPath, trajectory: Trajectory) -> None:
    with pytest.raises(VerificationError, match=r"rows are 0\.001 s apart"):
        verify(replace(trajectory, times=trajectory.times * 1.5), path, robot=ROBOT, process=PROCESS)


def test_a_row_bears_run_and_deposit_of_the_step_it_lies_on_and_neither_before_the_first_pose_nor_after_the_last() -> (
    None
):
    poses = replace(
        stream(line((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), count=5)),
        runs=np.array([0, 0, 1, 1, 1]),
        deposit=np.array([True, True, False, True, True]),
    )
    times = np.array([-0.5, 0.0, 0.5, 1.5, 2.5, 3.5, 4.5])
    runs, deposit = _labels(poses, np.arange(5.0), times)
    assert runs.tolist() == [-1, 0, 0, 1, 1, 1, -1]
    assert deposit.tolist() == [False, True, True, False, False, True, False]


def test_what_bends_sooner_than_the_arm_responds_costs_no_speed_and_is_hardly_off() -> None:
    path = rough_path(count=2000, noise=0.0)
    tips = line((0.0, 0.0, 0.0), (40.0, 0.0, 0.0), count=2000)
    # Corners as a mesh makes them: every 4 mm the joints turn at another rate.
    corners = 4e-4 * np.abs(tips[:, 0] % 8.0 - 4.0)[:, None]
    path = replace(path, poses=replace(path.poses, tips=tips), joints=ROBOT.home + corners)
    exact, rounded = (timed(path, robot=replace(ROBOT, response=response)) for response in (0.0, 0.01))
    assert rounded.slowest_deposit > 1.2 * exact.slowest_deposit
    assert max(largest_shares(rounded)) <= 1.01
    at = np.searchsorted(rounded.times, rounded.pose_times)
    assert np.abs(rounded.joints[at] - path.joints).max() < 4e-4
