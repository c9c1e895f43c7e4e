"""Where the arm and the tip of its nozzle are at a moment of the trajectory."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geoprint import transforms
from geoprint.model import FloatArray, Trajectory
from geoprint.robot.arm import JOINTS, Arm

# Over this [s] the tip's jerk is looked at: rows a millisecond apart have accelerations that jump, whose differences
# say how fine the rows are; an arm does not follow within less than this.
JERK_TIME = 0.01
METRES_PER_MILLIMETRE = 1e-3


def joints_at(times: FloatArray, joints: FloatArray, moments: FloatArray) -> FloatArray:
    """Return (m, 6) joints [rad] at moments, with even turning between the rows of a trajectory.

    Args:
        times: (k,) rising [s].
        joints: (k, 6) [rad].
        moments: (m,) [s].
    """
    between: FloatArray = np.empty((len(moments), JOINTS))
    if len(moments):
        # A few moments are asked for again and again: the other rows, which NumPy would copy, are left out.
        first, last = np.searchsorted(times, [moments.min(), moments.max()]).tolist()
        rows = slice(max(first - 1, 0), last + 1)
        for joint in range(JOINTS):
            between[:, joint] = np.interp(moments, times[rows], joints[rows, joint])
    return between


def tips_at(
    times: FloatArray, joints: FloatArray, arm: Arm, *, T_base_work: FloatArray
) -> Callable[[FloatArray], FloatArray]:
    """Return a function that gives the tip's places in the work frame at any moments.

    Rows a millisecond apart miss the true tip by a few micrometres at most at the accelerations of a robot.

    Args:
        times: (k,) rising [s].
        joints: (k, 6) [rad].
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].

    Returns:
        From (m,) moments [s] to (m, 3) tips [mm].
    """
    T_work_base = transforms.inverse(T_base_work)

    def tips(moments: FloatArray) -> FloatArray:
        return transforms.apply(T_work_base, arm.tool_poses(joints_at(times, joints, moments))[:, :3, 3])

    return tips


def largest_jerk(trajectory: Trajectory, arm: Arm, *, T_base_work: FloatArray) -> float:
    """Return the largest jerk of the tip while it deposits material [m/s3]; 0 where it deposits none.

    The tip is what the bead follows: joints may jerk together without moving it. It is the third difference of its
    places 10 ms apart, of which all four lie on one deposit: the ramps at its ends count.

    Args:
        trajectory: to look at.
        arm: with its tool.
        T_base_work: (4, 4) where the part stands [mm].
    """
    step = round(JERK_TIME / float(trajectory.times[1] - trajectory.times[0])) if trajectory.times.size > 1 else 1
    rows = np.flatnonzero(trajectory.deposit)
    tips = np.full((trajectory.times.size, 3), np.nan)
    if rows.size:
        there = tips_at(trajectory.times, trajectory.joints, arm, T_base_work=T_base_work)
        tips[rows] = there(trajectory.times[rows]) * METRES_PER_MILLIMETRE
    third = tips[3 * step :] - 3.0 * tips[2 * step : -step] + 3.0 * tips[step : -2 * step] - tips[: -3 * step]
    jerks = np.linalg.norm(third, axis=1) / JERK_TIME**3
    return float(np.nan_to_num(jerks).max(initial=0.0))
