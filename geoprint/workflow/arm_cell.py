"""A cell for an arm of one's own, written from its URDF: limits, speeds, flange, home, and cylinders for its links.

What a URDF leaves open is assumed and said in the cell's comments, or must be filled in before anything is planned.
"""

from __future__ import annotations

from pathlib import Path
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.config.cells import UR_CELL, cell_of, filled_cell, packaged_parts
from geoprint.errors import UsageError
from geoprint.model import FloatArray, Robot, Tool, frozen
from geoprint.postprocessor.registry import DEFAULT, post_processor, post_processor_names
from geoprint.robot.arm import JOINTS, Arm, about_nozzle, chain_of, link_shapes
from geoprint.robot.arm.link_meshes import enclosed_urdf
from geoprint.robot.reach.keyframes import angle_margins

# A joint reaches its largest speed in this time [s]: ASSUMED, as no URDF states accelerations.
SPEED_UP = 0.4
# Limits and speeds are written so exactly [degrees, degrees/s], and never beyond what the URDF says.
RESOLUTION = 0.01
# Where the tip may be at home, as shares of the arm's reach: ahead of axis 1, and above its foot.
AHEAD, ABOVE = (0.55, 0.45, 0.65, 0.35), (0.3, 0.4, 0.2, 0.5)
# Turns about the nozzle that are tried at home.
TURNS = 24
# A part stands so far below the tip at home [mm].
BELOW_HOME = 150.0
# The links at home keep so far above the foot of the arm [mm], and the joints so large a share of the best margin.
ABOVE_FOOT = 20.0
COMFORTABLE = 0.6
TINY = 1e-9
# The link whose frame stands at axis 3.
ELBOW = 3
# What a cell of one's own says where no maker publishes it.
ERRORS = """
# Pose repeatability (RP of ISO 9283): ASSUMED; write what the data sheet of the arm says. Each run as a whole is off by
# this much.
repeatability_mm = 0.1
# Path repeatability (RT of ISO 9283): ASSUMED, three times that of a pose. The tip deviates by it slowly along a run:
# deviations one correlation length apart have the correlation 0.6; ASSUMED.
path_repeatability_mm = 0.3"""
ACCURACY = """
# Path accuracy: mean distance of the real path from the commanded one. Measure yours; by default it counts as zero.
# path_accuracy_mm = 0.2"""
ROBOT = """
# The arm of {source}, in {urdf}: its joints, and cylinders that contain its links.
urdf = "{urdf}"
flange = "{flange}"
# Working range and largest speeds of joints 1 to 6 as {source} has them.
limits_deg = {limits}
speeds_deg_s = {speeds}
# A URDF states no accelerations: these reach the largest speed in {speed_up:g} s, an ASSUMPTION. Lower them if the arm
# lags behind.
accelerations_deg_s2 = {accelerations}
# Targets closer together in time make the controller slow down or stop: an ASSUMPTION, the default.
target_period_ms = 20
# Response time of the arm. Faster bends are rounded on deposit, by 0.004 mm at most: an ASSUMPTION, the default.
response_ms = 10
# NEEDED before a plan: largest load on the flange, and largest moments of inertia about axes 5 and 6, by the maker.
# payload_kg = 5
# wrist_inertia_kg_m2 = [0.1, 0.1]"""


@final
@frozen
class ArmCell:
    """Files of a cell for an arm, and what to say of them.

    Attributes:
        files: their texts by their names: the cell, and the URDF that it names.
        notes: sentences on what was read, chosen and contained.
    """

    files: dict[str, str]
    notes: tuple[str, ...]


def arm_cell(path: Path, *, flange: str) -> ArmCell:
    """Return the files of a cell for the arm that a URDF describes.

    Args:
        path: of the URDF.
        flange: name of its flange frame.

    Raises:
        UsageError: as `enclosed_urdf`; or the arm cannot hold a nozzle down ahead of it.
    """
    text, contained = enclosed_urdf(path, flange=flange)
    urdf, parts = f"{path.stem}-cylinders.urdf", packaged_parts("irb120-straight160")
    robot = _robot(text, name=urdf, flange=flange)
    tool = cell_of(filled_cell(parts), name="tool").tool
    home, tip = _home(robot, tool)
    low, high = (np.degrees(robot.limits) / RESOLUTION).T
    limits = RESOLUTION * np.column_stack([np.ceil(low - ROUNDED), np.floor(high + ROUNDED)])
    speeds = RESOLUTION * np.floor(np.degrees(robot.speeds) / RESOLUTION + ROUNDED)
    parts |= {
        "title": f"Arm of {path.name}",
        "about": "straight nozzle of 160 mm along the flange axis.",
        "robot": ROBOT.format(
            source=path.name, urdf=urdf, flange=flange, speed_up=SPEED_UP, limits=_written(limits),
            speeds=_written(speeds), accelerations=_written((speeds / SPEED_UP).round(1)),
        ).lstrip(),
        "home": _written(np.degrees(home).round(1)),
        "demo_position": _written(np.array([*tip[:2].round(), max(round(tip[2] - BELOW_HOME), 0.0)])),
        "errors": ERRORS.lstrip(),
        "accuracy": ACCURACY.lstrip(),
    }  # fmt: skip
    arm = Arm(robot, T_flange_tool=tool.T_flange_tool)
    parts |= _written_by(arm)
    how = (
        "in closed form"
        if arm.no_closed_form is None
        else f"by iteration, which may miss solutions: {arm.no_closed_form}"
    )
    place = ", ".join(f"{value + 0.0:.0f}" for value in tip.round())
    notes = (
        f"inverse kinematics: {how}.",
        *contained,
        f"home: the nozzle points down at ({place}) mm.",
        "before a plan: give payload_kg and wrist_inertia_kg_m2 of the arm, and check what is ASSUMED.",
    )
    return ArmCell({f"{path.stem}.toml": filled_cell(parts), urdf: text}, notes)


def _written_by(arm: Arm) -> dict[str, str]:
    """Return what a cell says of the first post-processor that serves its arm, and of the outputs of that one."""
    for name in post_processor_names():
        try:
            post_processor(name).check_arm(arm)
        except UsageError:
            continue
        if name == DEFAULT:
            return {}
        known = packaged_parts(UR_CELL)
        if f'"{name}"' in known["post_processor"].rpartition("=")[2]:
            return {key: known[key] for key in ("post_processor", "outputs")}
        text = f'# What writes the program: `geoprint guide another-arm` lists what can.\npost_processor = "{name}"'
        return {"post_processor": text}
    return {}


# Share of the resolution that is rounding.
ROUNDED = 1e-6


def _robot(text: str, *, name: str, flange: str) -> Robot:
    chain = chain_of(text, name=name, flange=flange)
    return Robot(
        model=name,
        limits=chain.limits,
        speeds=chain.speeds,
        accelerations=chain.speeds / SPEED_UP,
        home=np.clip(np.zeros(JOINTS), *chain.limits.T),
        urdf=text,
        flange=flange,
    )


def _home(robot: Robot, tool: Tool) -> tuple[FloatArray, FloatArray]:
    """Return (6,) joint angles that hold the nozzle down ahead of the arm [rad], and the (3,) place of the tip [mm].

    Of all solutions at some places that are well away from joint limits and singularities, the one whose elbow is
    highest, with the links above the foot.
    """
    arm = Arm(robot, T_flange_tool=tool.T_flange_tool)
    places = arm.inverse.reach * np.array([(ahead, 0.0, above) for above in ABOVE for ahead in AHEAD])
    down = transforms.rigid(np.diag([1.0, -1.0, -1.0]), arm.inverse.shoulder * [1.0, 1.0, 0.0] + places)
    turned = down[:, None] @ about_nozzle(2.0 * np.pi * np.arange(TURNS) / TURNS)
    joints = arm.solutions(turned.reshape(-1, 4, 4)).reshape(-1, JOINTS)
    joints = joints[np.isfinite(joints).all(axis=1)]
    margins = angle_margins(joints, arm, deposit=np.ones(len(joints), dtype=np.bool_)).min(axis=1)
    middle = robot.limits.mean(axis=1)
    joints = middle + transforms.wrapped(joints - middle)
    comfortable = margins >= COMFORTABLE * max(float(margins.max(initial=0.0)), TINY)
    joints = joints[comfortable & (_lowest(arm, joints) > ABOVE_FOOT)]
    if not len(joints):
        raise UsageError(
            f"robot: the arm {robot.model} holds its nozzle down nowhere ahead of it with its links above its foot. "
            "Check the limits and the flange of its URDF."
        )
    best = joints[arm.link_poses(joints)[:, ELBOW, 2, 3].argmax()]
    return best, arm.tool_poses(best[None])[0, :3, 3]


def _lowest(arm: Arm, joints: FloatArray) -> FloatArray:
    """Return the (k,) height of the lowest point of the links 2 to 6 at (k, 6) joint angles [mm]."""
    robot, frames = arm.robot, arm.link_poses(joints)
    heights = np.full(len(joints), np.inf)
    for shape in link_shapes(robot.urdf or "", name=robot.model, flange=robot.flange):
        if shape.joint > 1:
            cylinders = frames[:, shape.joint] @ shape.T_link_cylinder
            rise = np.abs(cylinders[:, 2, 2])
            below = rise * shape.length / 2.0 + shape.radius * np.sqrt(np.maximum(1.0 - rise**2, 0.0))
            heights = np.minimum(heights, cylinders[:, 2, 3] - below)
    return heights


def _written(values: FloatArray) -> str:
    """Return numbers as TOML writes them, with two decimals at most."""
    if values.ndim > 1:
        return f"[{', '.join(_written(row) for row in values)}]"
    return f"[{', '.join(f'{value + 0.0:.2f}'.rstrip('0').rstrip('.') for value in values)}]"
