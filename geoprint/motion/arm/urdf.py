"""The URDF of an arm: where it comes from, and the chain of six revolute joints that it must describe.

A file that somebody gives is read within limits, and without what lets XML grow or reach out: no document type, no
entities. Lengths in it are metres.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import final
from xml.etree import ElementTree as ET

import numpy as np

from geoprint.errors import UsageError
from geoprint.model import Robot, comparable

JOINTS = 6
FLANGE_FRAME = "tool0"
# A URDF without meshes is some ten kilobytes long.
LARGEST_FILE = 1_000_000
FORBIDDEN = ("<!DOCTYPE", "<!ENTITY")


@final
@comparable
class Chain:
    """What a URDF says about the joints from the base to the flange.

    Attributes:
        base: name of the link that does not move.
        links: names of the links that joints 1 to 6 move.
    """

    base: str
    links: tuple[str, ...]


def read_urdf(model: str) -> str:
    """Return the URDF text of an arm in the package data.

    Raises:
        UsageError: there is none of that name.
    """
    files = {entry.name: entry for entry in resources.files("geoprint.robots").iterdir()}
    entry = files.get(f"{model}.urdf")
    if entry is None:
        known = ", ".join(sorted(name.removesuffix(".urdf") for name in files if name.endswith(".urdf")))
        raise UsageError(f"robot.model names the arm '{model}', which geoprint does not know; known are: {known}.")
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
            f"robot.urdf: {path} cannot be read ({error}); check its name, rights and encoding."
        ) from error
    if len(content) > LARGEST_FILE:
        raise UsageError(
            f"robot.urdf: {path} is longer than {LARGEST_FILE} bytes; a URDF refers to its meshes and is far shorter."
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
        UsageError: the text is no URDF, another joint moves, or a joint of the chain has no limits; says which.
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
    base, moving = flange, list[ET.Element]()
    while base in parents:
        joint = parents.pop(base)
        if joint.get("type") != "fixed":
            moving.append(joint)
        base = _link(joint, "parent", name=name)
    if base not in links or any(_link(joint, "child", name=name) == base for joint in moving):
        raise UsageError(
            f"the URDF {name} leads from '{flange}' to '{base}', which is no base: it must be a link that no joint "
            "moves; correct the parents of its joints."
        )
    moving.reverse()
    others = [joint for joint in parents.values() if joint.get("type") != "fixed"]
    _require_six(moving, others, name=name, flange=flange)
    for joint in moving:
        _require_limits(joint, name=name)
    return Chain(base, tuple(_link(joint, "child", name=name) for joint in moving))


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
            f"the URDF {name} moves '{flange}' by {len(moving)} joints: {', '.join(words) or 'none'}; geoprint needs "
            "six of type revolute that nothing couples."
        )
    if others:
        raise UsageError(
            f"the URDF {name} has a joint '{others[0].get('name')}' of type {others[0].get('type')} beside the chain "
            f"to '{flange}'; make it fixed."
        )


def _require_limits(joint: ET.Element, *, name: str) -> None:
    limit = joint.find("limit")
    try:
        low, high, speed = (
            float("nan" if limit is None else limit.get(key, "nan")) for key in ("lower", "upper", "velocity")
        )
    except ValueError:
        low = high = speed = float("nan")
    if not (low < high and speed > 0.0 and np.isfinite([low, high, speed]).all()):
        raise UsageError(
            f"the URDF {name}: joint '{joint.get('name')}' needs a <limit> with finite lower below upper [rad] and a "
            f"velocity above 0 [rad/s], found lower {low:g}, upper {high:g}, velocity {speed:g}."
        )


def _link(joint: ET.Element, role: str, *, name: str) -> str:
    element = joint.find(role)
    link = None if element is None else element.get("link")
    if link is None:
        raise UsageError(f"the URDF {name}: joint '{joint.get('name')}' names no {role} link; add it.")
    return link
