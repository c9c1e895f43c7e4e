"""The controller's path: straight lines between targets, joint moves to home, and every refusal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint import transforms
from geoprint.errors import InputError, ReachError
from geoprint.model import ControllerPath, FloatArray, JointPath, Targets
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.controller.interpolation import _followed, controller_path, there_and_back  # pyright: ignore[reportPrivateUsage]
from geoprint.robot.controller.targets import written_targets
from geoprint.robot.reach.keyframes import tool_poses
from geoprint.robot.timing.retiming import retime
from tests.robot.cells import bent_cell, straight_cell
from tests.robot.joint_paths import WORK, arc, arm_of, line, solved, stream, tilted, two_runs

CELL = bent_cell()
ROBOT = CELL.robot
ARM = arm_of(CELL)


def every(path: JointPath, *, keep: slice = slice(None)) -> Targets:
    """Return targets at the chosen poses, all fine."""
    poses = np.arange(path.poses.count)[keep]
    return Targets(poses=poses, zones=np.zeros(poses.size), speeds=np.full(poses.size, 20.0))


@pytest.fixture(scope="module")
def path() -> JointPath:
    return solved(two_runs(), ARM)


@pytest.fixture(scope="module")
def targets(path: JointPath) -> Targets:
    return written_targets(path, retime(path, ROBOT, process=CELL.process), process=CELL.process)


@pytest.fixture(scope="module")
def found(path: JointPath, targets: Targets) -> ControllerPath:
    return controller_path(path, targets, ARM)


def tips_of(found: ControllerPath) -> FloatArray:
    return ARM.tool_poses(found.joints)[:, :3, 3]


def test_it_leads_from_home_to_home_in_small_steps(found: ControllerPath) -> None:
    np.testing.assert_array_equal(found.joints[[0, -1]], np.stack([ROBOT.home, ROBOT.home]))
    assert np.linalg.norm(np.diff(tips_of(found), axis=0), axis=1).max() <= found.step * (1.0 + 1e-9)
    away = found.runs < 0
    assert np.abs(np.diff(found.joints[away], axis=0))[:-1].max() < np.radians(15.0)
    assert np.abs(np.diff(found.joints, axis=0)).max() <= np.radians(2.0)


def test_joint_moves_are_straight_in_joint_space(path: JointPath, found: ControllerPath) -> None:
    first = int(np.argmax(found.runs >= 0))
    np.testing.assert_allclose(found.joints[first], path.joints[0], atol=1e-9)
    shares = np.linspace(0.0, 1.0, first + 1)[:, None]
    np.testing.assert_allclose(
        found.joints[: first + 1], ROBOT.home + shares * (found.joints[first] - ROBOT.home), atol=1e-12
    )


def test_a_move_between_two_targets_is_a_line_with_a_steady_turn() -> None:
    poses = stream(line((-10.0, -10.0, 0.0), (15.0, 10.0, 5.0), count=2), quaternions=tilted(np.array([0.1, -0.3])))
    path = solved(poses, ARM)
    found = controller_path(path, every(path), ARM, step=0.4)
    rows = found.runs == 0
    ends = tool_poses(poses, T_base_work=WORK)
    samples = ARM.tool_poses(found.joints[rows])
    count = int(rows.sum())
    assert count == np.ceil(np.linalg.norm([25.0, 20.0, 5.0]) / 0.4) + 1
    expected = transforms.interpolate_poses(
        np.repeat(ends[:1], count, axis=0), np.repeat(ends[1:], count, axis=0), np.linspace(0.0, 1.0, count)
    )
    np.testing.assert_allclose(samples, expected, atol=1e-6)


def test_a_turn_on_the_spot_is_sampled_each_degree() -> None:
    poses = stream(np.zeros((2, 3)), quaternions=tilted(np.radians([0.0, 25.5])))
    path = solved(poses, ARM)
    assert (controller_path(path, every(path), ARM).runs == 0).sum() == 27


def test_rounded_targets_are_rows_and_the_planned_poses_lie_within_the_tolerance_of_the_lines(
    path: JointPath, targets: Targets, found: ControllerPath
) -> None:
    rows = (found.joints + found.rounding)[found.runs >= 0]
    for joints in path.joints[targets.poses]:
        assert np.abs(rows - joints).max(axis=1).min() < 1e-9
    fine = controller_path(path, targets, ARM, step=0.02)
    tips = tips_of(fine)[fine.runs >= 0]
    planned = tool_poses(path.poses, T_base_work=WORK)[:, :3, 3]
    away = np.array([np.linalg.norm(tips - tip, axis=1).min() for tip in planned])
    assert away.max() < np.hypot(0.01, 0.01)


def test_rows_carry_their_run_and_lay_exactly_the_length_of_the_runs(found: ControllerPath) -> None:
    on_lines = np.flatnonzero(found.runs >= 0)
    assert (np.diff(on_lines) == 1).all()
    assert (np.diff(found.runs[on_lines]) >= 0).all()
    assert set(found.runs.tolist()) == {-1, 0, 1}
    assert not found.deposit[found.runs < 0].any()
    deposited = np.linalg.norm(np.diff(tips_of(found), axis=0), axis=1)[found.deposit[:-1]].sum()
    assert deposited == pytest.approx(np.pi * (20.0 + 16.0), rel=1e-3)


def test_the_winding_of_the_joint_path_is_kept(path: JointPath, targets: Targets) -> None:
    turn = 2.0 * np.pi * np.eye(6)[5]
    below = replace(path, joints=path.joints - turn)
    found = controller_path(below, targets, ARM)
    first = int(np.argmax(found.runs >= 0))
    np.testing.assert_allclose(found.joints[first], path.joints[0] - turn, atol=1e-9)


def test_a_wrist_flip_between_two_targets_is_refused() -> None:
    cell = straight_cell()
    arm = arm_of(cell)
    tilt = np.radians([-20.0, 20.0]) + forward_tilt(arm)
    flipping = solved(stream(np.zeros((2, 3)), quaternions=tilted(tilt)), arm)
    assert (flipping.joints[:, 4] > 0.1).all()
    with pytest.raises(
        ReachError, match=r"run 1: the straight line of the controller flips: joint [46] turns by"
    ) as refusal:
        controller_path(flipping, every(flipping), arm)
    assert refusal.value.details["base_mm"] == pytest.approx(tuple(WORK[:3, 3]))


def forward_tilt(arm: Arm) -> float:
    """Return the lean [rad] at which joint 5 passes zero, by bisection of its signed value on the front branch."""
    low, high = np.radians(-80.0), np.radians(80.0)
    for _ in range(40):
        middle = (low + high) / 2.0
        joints = solved(stream(np.zeros((1, 3)), quaternions=tilted(np.array([middle]))), arm).joints[0]
        low, high = (middle, high) if np.cos(joints[3]) > 0.0 else (low, middle)
    return float(low)


def test_a_line_that_leaves_the_reach_between_its_targets_is_refused() -> None:
    # Halfway the centre of the wrist would be on axis 2.
    poses = stream(line((0.0, 150.0, 0.0), (0.0, -150.0, 0.0), count=2))
    path = solved(poses, ARM, T_base_work=transforms.rigid(np.eye(3), np.array([-79.0, 0.0, 91.0])))
    with pytest.raises(ReachError, match="out of reach on the program's branch"):
        controller_path(path, every(path), ARM)


def test_a_line_that_leaves_a_joint_limit_between_its_targets_is_refused() -> None:
    path = solved(stream(line((0.0, -60.0, 0.0), (0.0, 60.0, 0.0), count=2)), ARM)
    middle = solved(stream(np.zeros((1, 3))), ARM).joints[0]
    limits = ROBOT.limits.copy()
    limits[2, 1] = (middle[2] + path.joints[:, 2].max()) / 2.0
    limits[2] = np.sort(limits[2])
    assert middle[2] > limits[2, 1] > path.joints[:, 2].max()
    narrow = Arm(replace(ROBOT, limits=limits), T_flange_tool=CELL.tool.T_flange_tool)
    with pytest.raises(ReachError, match=r"needs joint 3 at .* degrees, allowed is -110 to"):
        controller_path(path, every(path), narrow)


def test_a_target_on_another_winding_is_refused(path: JointPath) -> None:
    joints = path.joints.copy()
    joints[-1, 5] -= 2.0 * np.pi
    with pytest.raises(ReachError, match="is reached with joint 6 off the planned angle by 360 degrees"):
        controller_path(replace(path, joints=joints), every(path), ARM)


def test_targets_that_leave_out_a_stop_are_refused(path: JointPath) -> None:
    kept = np.delete(np.arange(path.poses.count), np.flatnonzero(path.poses.stops)[2])
    chosen = Targets(poses=kept, zones=np.zeros(kept.size), speeds=np.ones(kept.size))
    with pytest.raises(InputError, match="the targets leave out pose"):
        controller_path(path, chosen, ARM)


def test_targets_that_do_not_ascend_are_refused(path: JointPath) -> None:
    with pytest.raises(InputError, match="do not ascend"):
        controller_path(path, every(path, keep=slice(None, None, -1)), ARM)


@pytest.mark.parametrize("step", [0.0, -0.5, float("nan")])
def test_a_step_that_is_not_positive_is_refused(path: JointPath, targets: Targets, step: float) -> None:
    with pytest.raises(InputError, match="must be positive"):
        controller_path(path, targets, ARM, step=step)


def test_a_single_target_at_home_is_a_path_of_standing_rows() -> None:
    pose = ARM.tool_poses(ROBOT.home[None])
    poses = stream(np.zeros((1, 3)), quaternions=transforms.quaternion_of(pose[:, :3, :3]))
    at_home = transforms.rigid(np.eye(3), pose[0, :3, 3])
    found = controller_path(
        solved(poses, ARM, T_base_work=at_home), every(solved(poses, ARM, T_base_work=at_home)), ARM
    )
    np.testing.assert_allclose(found.joints, np.tile(ROBOT.home, (len(found.joints), 1)), atol=1e-9)


def test_an_arc_thinned_to_few_targets_is_followed_along_chords() -> None:
    path = solved(stream(arc(radius=10.0, angle=np.pi)), ARM)
    chosen = every(path, keep=slice(None, None, 7))
    chosen = replace(chosen, poses=np.append(chosen.poses[:-1], path.poses.count - 1))
    found = controller_path(path, chosen, ARM)
    radii = np.linalg.norm((tips_of(found) - WORK[:3, 3])[found.runs >= 0], axis=1)
    gap = np.linalg.norm(path.poses.tips[7] - path.poses.tips[0])
    assert radii.min() == pytest.approx(np.sqrt(100.0 - gap**2 / 4.0), abs=0.02)


# The controller's path at its bounds: joint limits on either side, steps of one degree, corners along the lines.


HUNDREDTH = np.radians(0.01)


def three_targets(*, zone: float = 0.0) -> tuple[JointPath, Targets]:
    """Return a right angle of two lines of 4 mm, with a zone at the corner."""
    tips = np.vstack([line((-4.0, 0.0, 0.0), (0.0, 0.0, 0.0), count=2), [[0.0, 4.0, 0.0]]])
    targets = Targets(poses=np.arange(3), zones=np.array([0.0, zone, 0.0]), speeds=np.full(3, 20.0))
    return solved(stream(tips), arm_of(CELL)), targets


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("side", [0, 1])
def test_a_line_between_targets_that_passes_either_limit_of_a_joint_is_refused(joint: int, side: int) -> None:
    path, targets = three_targets()
    along = controller_path(path, targets, arm_of(CELL))
    passed = along.joints[along.runs >= 0][:, joint]
    farthest = float(passed.max() if side else passed.min())

    def with_limit(limit: float) -> Arm:
        limits: FloatArray = CELL.robot.limits.copy()
        limits[joint, side] = limit
        # Home may lie beyond: it is no business of the lines.
        return Arm(
            replace(CELL.robot, limits=limits, home=np.clip(path.joints[1], *limits.T)),
            T_flange_tool=CELL.tool.T_flange_tool,
        )

    outwards = 1.0 if side else -1.0
    controller_path(path, targets, with_limit(farthest + outwards * HUNDREDTH))
    with pytest.raises(ReachError, match=rf"needs joint {joint + 1} at -?\d+\.\d+ degrees, allowed is"):
        controller_path(path, targets, with_limit(farthest - outwards * HUNDREDTH))


def test_a_turn_of_joint_6_by_30_degrees_takes_30_steps_of_one() -> None:
    """The straight nozzle's tip stays where it is, so that nothing but the turn asks for steps."""
    cell = straight_cell()
    joints = cell.robot.home + np.array([0.0, 0.0, 0.0, 0.0, 0.0, np.radians(29.99)])

    found = there_and_back(joints, arm_of(cell), step=0.5)

    assert len(found.joints) == 61
    assert np.degrees(np.abs(np.diff(found.joints[:, 5]))).max() <= 1.0
    np.testing.assert_allclose(found.joints[30], joints)
    assert (found.runs == -1).all()
    assert not found.deposit.any()
    assert found.rounding.max() == 0.0


@pytest.mark.parametrize("step", [0.2, 0.5, 2.0])
def test_no_step_of_a_joint_move_moves_the_tip_by_more_than_asked(step: float) -> None:
    arm = arm_of(CELL)
    found = there_and_back(CELL.robot.home + np.array([0.3, 0.1, -0.1, 0.2, 0.1, 0.0]), arm, step=step)

    moved = np.linalg.norm(np.diff(arm.tool_poses(found.joints)[:, :3, 3], axis=0), axis=1)
    assert step / 2.0 < moved.max() <= step


def test_a_rounded_corner_falls_linearly_to_nothing_along_both_lines() -> None:
    path, targets = three_targets(zone=1.0)
    arm = arm_of(CELL)
    found = controller_path(path, targets, arm)
    rows = found.runs >= 0
    rounding, joints = found.rounding[rows], found.joints[rows]
    corner = int(np.abs(rounding).max(axis=1).argmax())

    # At the corner the row and its rounding make the joints at the target itself.
    np.testing.assert_allclose(joints[corner] + rounding[corner], path.joints[1], atol=1e-9)
    # The middle of the triangle is half a zone's diagonal of a half away: 1 mm / 2 along each line.
    tip = arm.tool_poses(joints[corner][None])[0, :3, 3]
    at_corner = arm.tool_poses(path.joints[1][None])[0, :3, 3]
    assert np.linalg.norm(tip - at_corner) == pytest.approx(np.sqrt(2.0) / 4.0, abs=1e-3)
    for shares, part in (
        (np.linspace(0.0, 1.0, corner + 1), rounding[: corner + 1]),
        (np.linspace(1.0, 0.0, len(rounding) - corner), rounding[corner:]),
    ):
        assert len(part) > 4
        np.testing.assert_allclose(part, shares[:, None] * rounding[corner], atol=1e-12)


@pytest.mark.parametrize("start", [0.0, 0.4, -0.3])
def test_a_turn_of_10_degrees_on_the_spot_takes_10_steps_whatever_attitude_it_begins_at(start: float) -> None:
    angles = np.array([start, start + np.radians(9.99)])
    path = solved(stream(np.zeros((2, 3)), quaternions=tilted(angles)), arm_of(CELL))
    targets = Targets(poses=np.arange(2), zones=np.zeros(2), speeds=np.full(2, 20.0))

    found = controller_path(path, targets, arm_of(CELL))

    assert int((found.runs == 0).sum()) == 11


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_target_that_is_reached_with_other_joints_than_planned_is_refused_to_either_side(sign: float) -> None:
    path, targets = three_targets()
    for off, refused in ((0.9e-6, False), (1.2e-6, True)):
        joints = path.joints.copy()
        joints[1, 3] += sign * off
        planned = replace(path, joints=joints)
        if refused:
            with pytest.raises(ReachError, match="is reached with joint 4 off the planned angle"):
                controller_path(planned, targets, arm_of(CELL))
        else:
            controller_path(planned, targets, arm_of(CELL))


def test_a_line_on_which_the_wrist_flips_tells_joint_angle_and_how_straight_the_wrist_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Joint 4 turns by 2 rad where joint 5 is at -0.3 rad."""
    path, _ = three_targets()
    planted = np.tile(path.joints[0], (5, 1))
    planted[:, 4] = [-0.1, -0.2, -0.3, -0.4, -0.45]
    planted[3:, 3] += 2.0

    def solutions(_arm: Arm, _poses: FloatArray) -> FloatArray:
        return planted[:, None]

    monkeypatch.setattr(Arm, "solutions", solutions)
    with pytest.raises(ReachError, match=r"joint 4 turns by 115 degrees at once \(joint 5 at 17\.2\)"):
        _followed(np.tile(np.eye(4), (5, 1, 1)), np.zeros(5, dtype=np.int64), path, arm_of(CELL))
