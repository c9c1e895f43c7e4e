"""The URDF of an arm: where it comes from, and the chain of six revolute joints that it must describe.

A file that somebody gives is read within limits, and without what lets XML grow or reach out: no document type, no
entities. Lengths in it are metres; nothing outside this package sees them.
"""

from __future__ import annotations

import re
from importlib import resources
from pathlib import Path
from typing import final
from xml.etree import ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import UsageError, how_many, reason_of
from geoprint.model import FloatArray, Robot, frozen

JOINTS = 6
MILLIMETRES_PER_METRE = 1000.0
FLANGE_FRAME = "tool0"
# A URDF without meshes is some ten kilobytes long.
LARGEST_FILE = 1_000_000
# An element of macros, or a value to be computed; the name space alone, which expanded files keep, is none.
XACRO = re.compile(r"<xacro:|=\s*[\"']\$[({]")
FORBIDDEN = ("<!DOCTYPE", "<!ENTITY")


@final
@frozen
class Chain:
    """What a URDF says about the joints from the base to the flange.

    Attributes:
        base: name of the link that does not move.
        links: names of the links that joints 1 to 6 move.
        origins: (6, 4, 4) frame of each joint at zero in that of the one before [mm].
        axes: (6, 3) unit axis of each joint in its own frame.
        T_link_flange: (4, 4) the flange in the frame of the last link [mm].
        limits: (6, 2) lowest and highest angle of each joint [rad].
        speeds: (6,) highest speed of each joint [rad/s].
    """

    base: str
    links: tuple[str, ...]
    origins: FloatArray
    axes: FloatArray
    T_link_flange: FloatArray
    limits: FloatArray
    speeds: FloatArray


def read_urdf(model: str) -> str:
    """Return the URDF text of an arm in the package data.

    Raises:
        UsageError: there is none of that name.
    """
    files = {entry.name: entry for entry in resources.files("geoprint.robots").iterdir()}
    entry = files.get(f"{model}.urdf")
    if entry is None:
        known = ", ".join(sorted(name.removesuffix(".urdf") for name in files if name.endswith(".urdf")))
        raise UsageError(f"robot.arm names the arm '{model}', which geoprint does not know; known are: {known}.")
    return entry.read_text(encoding="utf-8")


def read_urdf_file(path: Path | str, *, flange: str) -> str:
    """Return the text of a URDF file that describes an arm geoprint can move.

    Args:
        path: the file.
        flange: name of its flange frame.

    Raises:
        UsageError: it cannot be read, is too large, holds a document type or entities, or describes no such arm.
    """
    try:
        with (path := Path(path)).open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
        text = content.decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(
            f"robot.urdf: {path} cannot be read ({reason_of(error)}); check its name, rights and encoding."
        ) from error
    if len(content) > LARGEST_FILE:
        raise UsageError(
            f"robot.urdf: {path} is longer than {LARGEST_FILE} bytes; a URDF refers to its meshes and is far shorter."
        )
    if path.suffix.lower() == ".xacro" or XACRO.search(text):
        raise UsageError(
            f"robot.urdf: {path.name} is xacro, macros that make a URDF; where its packages are installed, expand it "
            f"with `xacro {path.name} > {path.name.split('.')[0]}_expanded.urdf`, and give the result."
        )
    chain_of(text, name=path.name, flange=flange)
    return text


def urdf_of(robot: Robot) -> str:
    """Return the URDF text of an arm: its own, or that of the packaged arm that its model names.

    Raises:
        UsageError: there is no packaged arm of that name.
    """
    return read_urdf(robot.model) if robot.urdf is None else robot.urdf


def chain_of(text: str, *, name: str, flange: str) -> Chain:
    """Return the chain of six revolute joints from the base to the flange.

    Args:
        text: of the URDF.
        name: of the file or arm, for messages.
        flange: name of the flange's link.

    Raises:
        UsageError: the text is no URDF, another joint moves, or a joint of the chain has no limits, no place or no
            axis; says which.
    """
    robot = _parsed(text, name=name)
    parents: dict[str, ET.Element] = {}
    for joint in robot.findall("joint"):
        child = _link(joint, "child", name=name)
        if child in parents:
            raise UsageError(f"the URDF {name}: the link '{child}' hangs on two joints; geoprint needs a single chain.")
        parents[child] = joint
    links = {link.get("name", "") for link in robot.findall("link")}
    if flange not in links:
        raise UsageError(
            f"the URDF {name} has no link '{flange}' for the flange, only {', '.join(sorted(links))}; name its "
            "flange with robot.flange, or add the link."
        )
    base, joints = flange, list[ET.Element]()
    while base in parents:
        joints.append(parents.pop(base))
        base = _link(joints[-1], "parent", name=name)
    joints.reverse()
    moving = [joint for joint in joints if joint.get("type") != "fixed"]
    if base not in links or any(_link(joint, "child", name=name) == base for joint in moving):
        raise UsageError(
            f"the URDF {name} leads from '{flange}' to '{base}', which is not a base: a base is a link that no joint "
            "moves. Correct the parents of its joints."
        )
    others = [joint for joint in parents.values() if joint.get("type") != "fixed"]
    _require_six(moving, others, name=name, flange=flange)
    origins, T_link_flange = _places(joints, name=name)
    limits = np.array([_limits(joint, name=name) for joint in moving])
    return Chain(
        base=base,
        links=tuple(_link(joint, "child", name=name) for joint in moving),
        origins=origins,
        axes=np.array([_axis(joint, name=name) for joint in moving]),
        T_link_flange=T_link_flange,
        limits=limits[:, :2],
        speeds=limits[:, 2],
    )


def origin_of(element: ET.Element, *, name: str) -> FloatArray:
    """Return the (4, 4) place that a joint's or a shape's <origin> gives [mm]: turned about x, then y, then z.

    Args:
        element: that has the <origin>, or none where it is at its parent's.
        name: of the element, for messages.

    Raises:
        UsageError: it is not three finite numbers for a place and three for a turn.
    """
    origin = element.find("origin")
    place, turn = (_three_numbers(origin, key, "0 0 0", name=name) for key in ("xyz", "rpy"))
    return transforms.rigid(Rotation.from_euler("xyz", turn).as_matrix(), MILLIMETRES_PER_METRE * place)


def _places(joints: list[ET.Element], *, name: str) -> tuple[FloatArray, FloatArray]:
    """Return (6, 4, 4) places of the moving joints, each in the frame before, and (4, 4) of the flange in the last."""
    origins, T_moving_joint = list[FloatArray](), np.eye(4)
    for joint in joints:
        T_moving_joint = T_moving_joint @ origin_of(joint, name=f"{name}: joint '{joint.get('name')}'")
        if joint.get("type") != "fixed":
            origins.append(T_moving_joint)
            T_moving_joint = np.eye(4)
    return np.array(origins), T_moving_joint


def _axis(joint: ET.Element, *, name: str) -> FloatArray:
    who = f"{name}: joint '{joint.get('name')}'"
    axis = _three_numbers(joint.find("axis"), "xyz", "1 0 0", name=who)
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise UsageError(f"the URDF {who} has an axis of length 0; give it a direction.")
    return axis / length


def _three_numbers(element: ET.Element | None, key: str, default: str, *, name: str) -> FloatArray:
    words = default if element is None else element.get(key, default)
    try:
        numbers = np.array([float(word) for word in words.split()])
    except ValueError:
        numbers = np.empty(0)
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise UsageError(f"the URDF {name} has {key} '{words}', which is not three finite numbers; correct it.")
    return numbers


def _parsed(text: str, *, name: str) -> ET.Element:
    for word in FORBIDDEN:
        if word in text.upper():
            raise UsageError(f"the URDF {name} holds '{word}', which geoprint does not read; write it without.")
    try:
        robot = ET.fromstring(text)  # noqa: S314  (entities were refused)
    except (ET.ParseError, ValueError) as error:
        raise UsageError(f"the URDF {name} is not valid XML ({error}); correct it.") from error
    if robot.tag != "robot":
        raise UsageError(f"the URDF {name} starts with <{robot.tag}>, expected is <robot>; give a plain URDF.")
    return robot


def _require_six(moving: list[ET.Element], others: list[ET.Element], *, name: str, flange: str) -> None:
    """Refuse a chain that is not of six revolute joints, and joints that move beside it."""
    words = [f"{joint.get('name')} ({joint.get('type')})" for joint in moving]
    wrong = [joint for joint in moving if joint.get("type") != "revolute" or joint.find("mimic") is not None]
    if len(moving) != JOINTS or wrong:
        raise UsageError(
            f"the URDF {name} moves '{flange}' by {how_many(len(moving), 'joint')}: {', '.join(words) or 'none'}; "
            "geoprint needs six of type revolute that nothing couples."
        )
    if others:
        raise UsageError(
            f"the URDF {name} has a joint '{others[0].get('name')}' of type {others[0].get('type')} beside the chain "
            f"to '{flange}'; make it fixed."
        )


def _limits(joint: ET.Element, *, name: str) -> tuple[float, float, float]:
    """Return the lowest and the highest angle [rad] and the highest speed [rad/s] of a joint."""
    limit = joint.find("limit")
    try:
        low, high, speed = (
            float("nan" if limit is None else limit.get(key, "nan")) for key in ("lower", "upper", "velocity")
        )
    except ValueError:
        low = high = speed = float("nan")
    if not (low < high and speed > 0.0 and np.isfinite([low, high, speed]).all()):
        raise UsageError(
            f"the URDF {name}: joint '{joint.get('name')}' needs a <limit> with finite lower below upper [rad] and "
            f"velocity above 0 [rad/s]. Found lower {low:g}, upper {high:g}, velocity {speed:g}."
        )
    return low, high, speed


def _link(joint: ET.Element, role: str, *, name: str) -> str:
    element = joint.find(role)
    link = None if element is None else element.get("link")
    if link is None:
        raise UsageError(f"the URDF {name}: joint '{joint.get('name')}' names no {role} link; add it.")
    return link
