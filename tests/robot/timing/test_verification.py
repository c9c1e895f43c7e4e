"""The judge of a trajectory at its bounds: excesses of either sign, at every joint, at start, end and within."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from geoprint.errors import LimitError, VerificationError
from geoprint.model import FloatArray, Trajectory
from geoprint.robot.timing.retiming import _bend, _refuse_missed_pose, verify  # pyright: ignore[reportPrivateUsage]
from geoprint.robot.timing.topp import end_ramps
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arm_of, line, solved, stream, tilted

CELL = bent_cell()
ROBOT = CELL.robot
PATH = solved(stream(line((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), count=2)), arm_of(CELL))


def trajectory(joints: FloatArray, *, pose_times: FloatArray | None = None) -> Trajectory:
    count = len(joints)
    return Trajectory(
        times=1e-3 * np.arange(float(count)), joints=joints, runs=np.zeros(count, dtype=np.int64),
        deposit=np.zeros(count, np.bool_), pose_times=np.array([0.0, 1.0]) if pose_times is None else pose_times,
        stretched=0, slowest_deposit=0.0, slowdowns=(), share_at_speed=0.0, share_on_ramps=0.0,
    )  # fmt: skip


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("joint", range(6))
def test_an_acceleration_of_either_sign_is_refused_beyond_one_percent_and_told_as_positive(
    joint: int, sign: float
) -> None:
    """One row off by a * dt^2 / 2 is an acceleration of a behind it, and of a / 2 on either side."""
    for share, refused in ((1.02, True), (1.0, False)):
        joints = np.tile(ROBOT.home, (40, 1))
        joints[20, joint] += sign * share * float(ROBOT.accelerations[joint]) * 1e-6 / 2.0
        what = rf"run 1 at tip .* 0\.020 s: joint {joint + 1} accelerates at \d+\.\d+ rad/s2"
        # What keeps its limits is refused for the poses it does not pass.
        with pytest.raises(
            LimitError if refused else (VerificationError, LimitError), match=what if refused else "pose"
        ):
            verify(trajectory(joints), PATH, robot=ROBOT, process=CELL.process)


@pytest.mark.parametrize("row", [0, -1])
def test_an_end_away_from_home_is_refused(row: int) -> None:
    joints = np.tile(ROBOT.home, (40, 1))
    joints[row, 2] = np.round(ROBOT.home[2], 9) - 3e-9
    with pytest.raises(LimitError, match=f"{'starts' if row == 0 else 'ends'} with joint 3 .*e-09 rad away from home"):
        verify(trajectory(joints), PATH, robot=ROBOT, process=CELL.process)


@pytest.mark.parametrize("pose", [0, 1])
@pytest.mark.parametrize(("off", "refused"), [(0.9e-5, False), (1.1e-5, True)])
def test_each_pose_is_passed_within_a_hundred_thousandth_of_a_radian_the_last_one_too(
    pose: int, off: float, *, refused: bool
) -> None:
    # Curved, so that only the rows on either side of a pose tell where it is passed.
    shares = np.linspace(0.0, 1.0, 40)[:, None] ** 2
    joints = PATH.joints[0] + shares * (PATH.joints[1] - PATH.joints[0])
    made = trajectory(joints, pose_times=np.array([0.0, 0.039]))
    moved = PATH.joints.copy()
    moved[pose, 4] += off
    path = replace(PATH, joints=moved)
    if refused:
        with pytest.raises(VerificationError, match=f"passes pose {pose} with joint 5 off by 1.1e-05 rad"):
            _refuse_missed_pose(made, path)
    else:
        _refuse_missed_pose(made, path)


def test_a_message_tells_the_turn_within_half_a_millimetre_to_either_side() -> None:
    """Poses lie 0.25 mm apart and turn by one degree each; steps that touch the millimetre about the place count."""
    poses = stream(line((0.0, 0.0, 0.0), (10.0, 0.0, 0.0), count=41), quaternions=tilted(np.radians(np.arange(41.0))))
    made = trajectory(np.zeros((50, 6)), pose_times=np.arange(41.0))
    assert "the tool turns by 6 degrees within 1.5 mm" in _bend(made, poses, time=20.0)


def test_the_ramp_to_a_speed_is_its_square_over_twice_the_acceleration_and_10_m_a_second_is_fastest() -> None:
    """Joint 1 turns by a thousandth of a radian a metre, so that only 10 m/s bounds the path speed."""
    lengths = np.linspace(0.0, 20.0, 5)
    joints = np.zeros((5, 6))
    joints[:, 0] = 1e-3 * lengths
    robot = replace(ROBOT, accelerations=np.full(6, 12.0))
    found = end_ramps(CubicSpline(lengths, joints), ceilings=np.array([np.inf, np.inf, np.inf, 4.0]), robot=robot)
    assert found == pytest.approx((10.0**2 / 2.0 * 1e-3 / 12.0, 4.0**2 / 2.0 * 1e-3 / 12.0))
