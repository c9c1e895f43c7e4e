"""What the flange carries against what the arm's maker allows: mass, and moments of inertia about axes 5 and 6.

The moments are those of ABB's product specification (IRB 120, 3HAC035960, section 1.4.3): with the centre of gravity Z
ahead of the flange and L beside axis 6, and the flange d ahead of axis 5,

    J5 = mass * ((Z + d)^2 + L^2) + max(J0x, J0y),    J6 = mass * L^2 + J0z,

J0 about the centre of gravity. J5 is the most that any angle of joint 6 makes of it. The maker's load diagram, which
allows less mass the farther its centre is from the flange, is a picture: it is not checked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass
from types import MappingProxyType
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.model import FloatArray, LoadLimits, Robot, Tool
from geoprint.motion.arm.kinematics import Arm
from geoprint.motion.arm.urdf import MILLIMETRES_PER_METRE

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
            f"{self.axis_6_kg_m2:.4f} about axis 6, within what the maker allows; its load diagram was not compared."
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
                f"tool: its {what} is {found:.4g} {unit} with the centre of gravity {load.ahead:.0f} mm from axis 5 "
                f"and {load.beside:.0f} mm from axis 6, allowed for the {arm.robot.model} is {allowed:g} {unit}: take "
                "a lighter or shorter tool, or correct mass_kg, cog_mm and inertia_kg_m2 in the cell file.",
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
            f"robot: nobody has said what the flange of the {robot.model} may carry; give payload_kg and "
            "wrist_inertia_kg_m2 (about axes 5 and 6) of its data sheet under [robot]."
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
            f"mm, plausible are {LEAST_GYRATION:g} to {MOST_GYRATION:g}; give the moments about the centre of gravity "
            "in kg m2."
        )
