"""Where the arm and the tip of its nozzle are at a moment of the trajectory."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geoprint import transforms
from geoprint.model import FloatArray
from geoprint.motion.arm import JOINTS, Arm


def joints_at(times: FloatArray, joints: FloatArray, moments: FloatArray) -> FloatArray:
    """Return (m, 6) joints [rad] at moments, with even turning between the rows of a trajectory.

    Args:
        times: (k,) rising [s].
        joints: (k, 6) [rad].
        moments: (m,) [s].
    """
    between: FloatArray = np.empty((len(moments), JOINTS))
    for joint in range(JOINTS):
        between[:, joint] = np.interp(moments, times, joints[:, joint])
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
