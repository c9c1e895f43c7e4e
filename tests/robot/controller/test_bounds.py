"""The controller's path at its bounds: joint limits on either side, steps of one degree, corners along the lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import ReachError
from geoprint.model import FloatArray, JointPath, Targets
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.controller.interpolation import _followed, controller_path, there_and_back  # pyright: ignore[reportPrivateUsage]
from tests.robot.cells import bent_cell, straight_cell
from tests.robot.joint_paths import arm_of, line, solved, stream, tilted

CELL = bent_cell()
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
