"""Which of the eight solutions for a pose the arm uses: branch numbers and RAPID configuration data.

RAPID (technical reference, data type confdata; robots with a serial arm, the IRB 120 among them) tells them apart
by the three singularities of the arm:

| cfx | wrist centre relative to axis 1 | wrist centre relative to lower arm | axis 5 |
|---|---|---|---|
| 0 | in front of | in front of | positive |
| 1 | in front of | in front of | negative |
| 2 | in front of | behind | positive |
| 3 | in front of | behind | negative |
| 4 to 7 | behind | as 0 to 3 | as 0 to 3 |

that is, cfx = 4 * shoulder + 2 * elbow + wrist, each 1 for the second word. The solver of `kinematics.Arm` numbers the
same three choices as branch = 4 * wrist + 2 * shoulder + elbow; RobotComponents and py-opw-kinematics, which write for
the same controllers, order them alike. The lower arm is the line through axes 2 and 3: the wrist centre is behind it
where axis 3 has bent back past the stretched arm (below -77 degrees for the IRB 120).

cf1, cf4 and cf6 count quarter turns: quadrant 0 is [0, 90) degrees, 1 is [90, 180), -1 is [-90, 0); axis 6 turns more
than once, so that its quadrants go on (-5 to 4 within 400 degrees).
"""

from __future__ import annotations

import numpy as np

from geoprint.errors import UsageError
from geoprint.model import FloatArray, IntArray
from geoprint.motion.arm.kinematics import Arm
from geoprint.motion.arm.ortho_parallel import OrthoParallel

QUARTER_TURN = np.pi / 2.0

# Rounding leaves an angle that is meant to be a multiple of 90 degrees this much [rad] below it at most: it then counts
# as the quadrant that starts there, so that a zero that came out as -1e-17 is not written as quadrant -1.
TIE = 1e-9

# Axes whose quadrants configuration data counts, as columns of joint angles.
BORDERED = (0, 3, 5)

# A controller counts by its own calibration of the arm, which may differ by as much [rad]: an angle nearer to a border
# of its quadrants may be refused there, or mean another configuration.
BORDER_MARGIN = float(np.radians(1.0))

# Offsets [rad] and frames [mm] within this of ABB's are ABB's: a hundredth of what a calibration of the arm corrects.
SAME_CONVENTION = 1e-6


def singularity_distances(joints: FloatArray, *, arm: Arm) -> FloatArray:
    """Return how far the arm is from each of its three singularities, with the side as sign.

    Args:
        joints: (k, 6) [rad].
        arm: whose inverse knows them.

    Returns:
        (k, 3): how far the wrist centre lies ahead of axis 1, seen in the plane of the arm [mm]; the angle [rad] in
        (-pi, pi] by which the wrist centre has bent forward from the stretched arm (0 and pi are singular); the angle
        of axis 5 [rad] in (-pi, pi] (0 and pi are singular).
    """
    return arm.inverse.singularity_distances(joints)


def wrist_angles(joints: FloatArray, *, arm: Arm) -> FloatArray:
    """Return how far axis 5 is from the wrist singularity [rad], at least 0, for (..., 6) joint angles [rad].

    That is |q5| where the URDF counts joint 5 from there, as ABB does.
    """
    angles = np.abs(singularity_distances(joints.reshape(-1, joints.shape[-1]), arm=arm)[:, 2])
    return np.minimum(angles, np.pi - angles).reshape(joints.shape[:-1])


def require_abb_conventions(arm: Arm) -> None:
    """Refuse an arm for which RAPID targets and configuration data would mean something else.

    A RAPID program is for an ABB controller, whose arms with a spherical wrist count their joints alike: all
    at zero the lower arm is upright and the forearm points ahead, and axes 1 to 6 turn about z y y x y x.

    Raises:
        UsageError: the arm has no spherical wrist, or its URDF counts joints, base or flange otherwise.
    """
    name, inverse = arm.robot.model, arm.inverse
    left = "reach, timing and clearance can be had from the library, `geoprint plan` needs an ABB arm or --no-robot"
    if not isinstance(inverse, OrthoParallel):
        raise UsageError(
            f"no RAPID program can be written for the arm {name}: {arm.no_closed_form}, and RAPID's configuration data "
            f"are defined by the singularities of an arm with a spherical wrist; {left}."
        )
    turned = (np.abs(inverse.offsets) > SAME_CONVENTION) | (inverse.signs < 0.0)
    moved = [np.abs(T - np.eye(4)).max() > SAME_CONVENTION for T in (inverse.T_base_foot, inverse.T_end_flange)]
    if turned.any() or any(moved):
        joint = int(np.argmax(turned))
        what = (
            f"joint {joint + 1} counts {'down' if inverse.signs[joint] < 0.0 else 'up'} from "
            f"{np.degrees(inverse.offsets[joint]):.1f} degrees"
            if turned.any()
            else f"its {'base' if moved[0] else 'flange'} frame is another"
        )
        raise UsageError(
            f"no RAPID program can be written for the arm {name}: {what} as ABB counts, so that angles and "
            f"configuration data would mean something else on the controller; write its URDF as ABB counts, or: {left}."
        )


def branch_of(joints: FloatArray, *, arm: Arm) -> IntArray:
    """Return the branch of `Arm.solutions` that joint angles belong to.

    On a singularity both sides meet; there the side in front, or the positive one, is returned.

    Args:
        joints: (k, 6) [rad].
        arm: whose lengths count.

    Returns:
        (k,) 4 * wrist + 2 * shoulder + elbow.
    """
    shoulder, elbow, wrist = _sides(joints, arm=arm)
    return 4 * wrist + 2 * shoulder + elbow


def configuration_data(joints: FloatArray, *, arm: Arm) -> IntArray:
    """Return the RAPID configuration data of joint angles.

    Angles less than `TIE` below a multiple of 90 degrees count as that multiple, which opens the upper quadrant; an
    axis 5 at zero counts as positive.

    Args:
        joints: (k, 6) [rad].
        arm: whose lengths count.

    Returns:
        (k, 4) cf1, cf4, cf6, cfx.
    """
    quadrants = np.floor((joints[:, [0, 3, 5]] + TIE) / QUARTER_TURN).astype(np.int64)
    shoulder, elbow, wrist = _sides(joints, arm=arm)
    return np.column_stack([quadrants, 4 * shoulder + 2 * elbow + wrist])


def border_distances(joints: FloatArray) -> FloatArray:
    """Return how far axes 1, 4 and 6 of (..., 6) joint angles are from the borders of their quadrants, (..., 3) [rad].

    Examples:
        >>> np.degrees(border_distances(np.radians([[1.0, 30.0, 20.0, -93.0, 70.0, 225.0]])))
        array([[ 1.,  3., 45.]])
    """
    angles = joints[..., BORDERED]
    return np.abs(angles - QUARTER_TURN * np.rint(angles / QUARTER_TURN))


def _sides(joints: FloatArray, *, arm: Arm) -> tuple[IntArray, IntArray, IntArray]:
    behind = (singularity_distances(joints, arm=arm) < -TIE).astype(np.int64)
    return behind[:, 0], behind[:, 1], behind[:, 2]
