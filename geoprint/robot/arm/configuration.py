"""Which of the eight inverse solutions the arm uses, and what its flange carries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass
from types import MappingProxyType
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.model import FloatArray, IntArray, LoadLimits, Robot, Tool
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.arm.ortho_parallel import OrthoParallel
from geoprint.robot.arm.urdf import MILLIMETRES_PER_METRE

# Which of the eight solutions for a pose the arm uses: branch numbers and RAPID configuration data.
#
# RAPID (technical reference, data type confdata; robots with a serial arm, the IRB 120 among them) tells them apart
# by the three singularities of the arm:
#
# | cfx | wrist centre relative to axis 1 | wrist centre relative to lower arm | axis 5 | |---|---|---|---| | 0 | in
# front of | in front of | positive | | 1 | in front of | in front of | negative | | 2 | in front of | behind |
# positive | | 3 | in front of | behind | negative | | 4 to 7 | behind | as 0 to 3 | as 0 to 3 |
#
# that is, cfx = 4 * shoulder + 2 * elbow + wrist, each 1 for the second word. The solver of `kinematics.Arm` numbers
# the same three choices as branch = 4 * wrist + 2 * shoulder + elbow; RobotComponents and py-opw-kinematics, which
# write for the same controllers, order them alike. The lower arm is the line through axes 2 and 3: the wrist centre
# is behind it where axis 3 has bent back past the stretched arm (below -77 degrees for the IRB 120).
#
# cf1, cf4 and cf6 count quarter turns: quadrant 0 is [0, 90) degrees, 1 is [90, 180), -1 is [-90, 0); axis 6 turns
# more than once, so that its quadrants go on (-5 to 4 within 400 degrees).


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
    left = 'state `post_processor = "joint-trajectory"` under [robot] for joints over time, or give --no-robot'
    if not isinstance(inverse, OrthoParallel):
        kind = arm.no_closed_form or "its axes 2, 3 and 4 are parallel, as those of Universal Robots"
        raise UsageError(
            f"a RAPID program is impossible for the arm {name}: {kind}. RAPID's configuration data need the "
            f"singularities of a spherical wrist; {left}."
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
            f"a RAPID program is impossible for the arm {name}: {what} in ABB's convention, so angles and "
            f"configuration data would differ on the controller. Write its URDF in ABB's convention, or: {left}."
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


def bordered_joints(arm: Arm) -> tuple[int, ...]:
    """Return the columns of joints with borders to keep clear of: `BORDERED`, or none without a spherical wrist.

    Only controllers of ABB count quadrants, and their arms have such a wrist.
    """
    return BORDERED if isinstance(arm.inverse, OrthoParallel) else ()


def _sides(joints: FloatArray, *, arm: Arm) -> tuple[IntArray, IntArray, IntArray]:
    behind = (singularity_distances(joints, arm=arm) < -TIE).astype(np.int64)
    return behind[:, 0], behind[:, 1], behind[:, 2]


# What the flange carries against what the arm's maker allows: mass, and moments of inertia about axes 5 and 6.
#
# The moments are those of ABB's product specification (IRB 120, 3HAC035960, section 1.4.3): with the centre of
# gravity Z ahead of the flange and L beside axis 6, and the flange d ahead of axis 5,
#
#     J5 = mass * ((Z + d)^2 + L^2) + max(J0x, J0y),    J6 = mass * L^2 + J0z,
#
# J0 about the centre of gravity. J5 is the most that any angle of joint 6 makes of it. The maker's load diagram,
# which allows less mass the farther its centre is from the flange, is a picture: it is not checked.


# What the flanges of the packaged arms may carry, by their makers.
MAKERS_LIMITS: Mapping[str, LoadLimits] = MappingProxyType(
    {"irb120": LoadLimits(mass_kg=3.0, axis_5_kg_m2=0.175, axis_6_kg_m2=0.085)}
)
# A load's radius of gyration [mm], sqrt(moment / mass): outside it the moments are in another unit than kg m2.
LEAST_GYRATION = 1.0
MOST_GYRATION = 300.0


@final
@dataclass(frozen=True, slots=True)
class WristLoad:
    """What a tool means for the wrist.

    Attributes:
        mass_kg: of the tool.
        ahead: distance of its centre of gravity from axis 5, along axis 6 [mm].
        beside: distance of its centre of gravity from axis 6 [mm].
        axis_5_kg_m2: largest moment of inertia about axis 5, over all angles of joint 6.
        axis_6_kg_m2: moment of inertia about axis 6.
    """

    mass_kg: float
    ahead: float
    beside: float
    axis_5_kg_m2: float
    axis_6_kg_m2: float

    @property
    def sentence(self) -> str:
        """What was found, for whoever stands at the robot."""
        return (
            f"load of {self.mass_kg:g} kg, inertia {self.axis_5_kg_m2:.4f} kg m2 about axis 5 and "
            f"{self.axis_6_kg_m2:.4f} about axis 6, within the maker's limits. Its load diagram was not compared."
        )


def wrist_load(tool: Tool, arm: Arm) -> WristLoad:
    """Return mass and moments of inertia of a tool about the arm's last two axes.

    Args:
        tool: with mass, centre of gravity, principal moments and their axes.
        arm: whose axes 5 and 6 count; axis 5 may pass axis 6, then its distance is added to L.
    """
    screws = arm.screws()
    T_flange_base = transforms.inverse(screws.T_base_flange)
    on_5, on_6 = transforms.apply(T_flange_base, np.array([screws.nearest(4, 5), screws.nearest(5, 4)]))
    axis = T_flange_base[:3, :3] @ screws.directions[5]
    away = tool.cog - on_6
    ahead = float(away @ axis)
    beside = float(np.linalg.norm(away - ahead * axis))
    aside = float(np.linalg.norm(on_6 - on_5))
    inertia: FloatArray = tool.principal_axes @ np.diag(tool.inertia_kg_m2) @ tool.principal_axes.T
    across = np.linalg.svd(axis[None])[2][1:]
    own = float(np.linalg.eigvalsh(across @ inertia @ across.T).max())
    squared_5, squared_6 = (
        (ahead**2 + (beside + aside) ** 2) / MILLIMETRES_PER_METRE**2,
        beside**2 / MILLIMETRES_PER_METRE**2,
    )
    return WristLoad(
        mass_kg=tool.mass_kg,
        ahead=abs(ahead),
        beside=beside,
        axis_5_kg_m2=tool.mass_kg * squared_5 + own,
        axis_6_kg_m2=tool.mass_kg * squared_6 + float(axis @ inertia @ axis),
    )


def check_load(tool: Tool, arm: Arm) -> WristLoad:
    """Refuse a tool that is heavier than the arm may carry, or turns its wrist harder than its maker allows.

    Returns:
        What was found.

    Raises:
        UsageError: a limit is exceeded, the moments are those of no body, or nobody has said what the flange may carry.
    """
    limits = _limits(arm.robot)
    _require_body(tool)
    load = wrist_load(tool, arm)
    for what, found, allowed, unit in (
        ("mass", load.mass_kg, limits.mass_kg, "kg"),
        ("moment of inertia about axis 5", load.axis_5_kg_m2, limits.axis_5_kg_m2, "kg m2"),
        ("moment of inertia about axis 6", load.axis_6_kg_m2, limits.axis_6_kg_m2, "kg m2"),
    ):
        if found > allowed:
            raise UsageError(
                f"tool: its {what} is {found:.4g} {unit} at {load.ahead:.0f} mm from axis 5 and {load.beside:.0f} mm "
                f"from axis 6; the {arm.robot.model} allows {allowed:g} {unit}. Use a lighter or shorter tool, or "
                "correct mass_kg, cog_mm and inertia_kg_m2 in the cell file.",
                found=found,
                allowed=allowed,
            )
    return load


def _limits(robot: Robot) -> LoadLimits:
    """Return what the cell states, not above what the maker of a packaged arm does."""
    maker = MAKERS_LIMITS.get(robot.model) if robot.urdf is None else None
    limits = robot.load or maker
    if limits is None:
        raise UsageError(
            f"robot: the flange load of the {robot.model} is unknown: give payload_kg and wrist_inertia_kg_m2 (about "
            "axes 5 and 6) from its data sheet under [robot]."
        )
    if maker is not None and any(stated > most for stated, most in zip(astuple(limits), astuple(maker), strict=True)):
        raise UsageError(
            f"robot: payload_kg and wrist_inertia_kg_m2 are {limits.mass_kg:g} and [{limits.axis_5_kg_m2:g}, "
            f"{limits.axis_6_kg_m2:g}], the maker of the {robot.model} allows {maker.mass_kg:g} and "
            f"[{maker.axis_5_kg_m2:g}, {maker.axis_6_kg_m2:g}]; correct them."
        )
    return limits


def _require_body(tool: Tool) -> None:
    """Refuse principal moments that no body of that mass and a tool's size has."""
    moments = tool.inertia_kg_m2
    written = f"tool: inertia_kg_m2 {moments.tolist()}"
    if tool.mass_kg <= 0.0 or moments.min() <= 0.0:
        raise UsageError(f"{written} of {tool.mass_kg:g} kg: mass and moments must be positive; weigh the full tool.")
    if moments.max() > moments.sum() - moments.max():
        raise UsageError(f"{written} are no moments of a body: none exceeds the other two together; measure again.")
    gyration = np.sqrt(moments / tool.mass_kg) * MILLIMETRES_PER_METRE
    if gyration.min() < LEAST_GYRATION or gyration.max() > MOST_GYRATION:
        raise UsageError(
            f"{written} of {tool.mass_kg:g} kg mean radii of gyration of {gyration.min():.2g} to {gyration.max():.2g} "
            f"mm, plausible are {LEAST_GYRATION:g} to {MOST_GYRATION:g}. Give the moments about the centre of gravity "
            "in kg m2."
        )
