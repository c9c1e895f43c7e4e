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
from geoprint.errors import Faults, UsageError, how_many, reason_of
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
        names: of joints 1 to 6.
        links: names of the links that joints 1 to 6 move.
        origins: (6, 4, 4) frame of each joint at zero in that of the one before [mm].
        axes: (6, 3) unit axis of each joint in its own frame.
        T_link_flange: (4, 4) the flange in the frame of the last link [mm].
        limits: (6, 2) lowest and highest angle of each joint [rad].
        speeds: (6,) highest speed of each joint [rad/s].
    """

    base: str
    names: tuple[str, ...]
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
            axis; lists all that is wrong.
    """
    robot, faults = _parsed(text, name=name), Faults()
    parents = _parents(robot, faults, name=name)
    links = {link.get("name", "") for link in robot.findall("link")}
    base, joints = _followed(parents, flange)
    moving = [joint for joint in joints if joint.get("type") != "fixed"]
    with faults.noting():
        _require_ends(links, base, moving, name=name, flange=flange)
    if flange in links:
        others = [joint for joint in parents.values() if joint not in joints and joint.get("type") != "fixed"]
        with faults.noting():
            _require_six(moving, others, name=name, flange=flange)
    origins, T_link_flange = _places(joints, faults, name=name)
    axes, limits = list[FloatArray](), list[tuple[float, float, float]]()
    # Without a flange there is no chain, and all joints are looked at.
    for joint in moving if flange in links else robot.findall("joint"):
        if joint.get("type") == "revolute":
            with faults.noting():
                axes.append(_axis(joint, name=name))
            with faults.noting():
                limits.append(_limits(joint, name=name))
    faults.refuse(f"the URDF {name} cannot be served")
    return Chain(
        base=base,
        names=tuple(joint.get("name", "") for joint in moving),
        links=tuple(_link(joint, "child", name=name) for joint in moving),
        origins=origins,
        axes=np.array(axes),
        T_link_flange=T_link_flange,
        limits=np.array(limits)[:, :2],
        speeds=np.array(limits)[:, 2],
    )


@final
@frozen
class LinkShape:
    """A cylinder that contains a collision shape of a link, or one of those that do together.

    Attributes:
        joint: that moves it, from 1; 0 for the base.
        T_link_cylinder: (4, 4) its middle in the frame of what that joint moves, its axis along z [mm].
        radius: [mm].
        length: [mm].
    """

    joint: int
    T_link_cylinder: FloatArray
    radius: float
    length: float


def link_shapes(text: str, *, name: str, flange: str) -> tuple[LinkShape, ...]:
    """Return the collision shapes of the base and the links that the six joints move, in the order of the joints.

    A link that is fixed to another moves with it. A box and a sphere are contained by a cylinder.

    Args:
        text: of the URDF.
        name: of the file or arm, for messages.
        flange: name of the flange's link.

    Raises:
        UsageError: as `chain_of`; or the base or a link has no collision shape, or one that is none of these; lists
            all that is wrong.
    """
    chain = chain_of(text, name=name, flange=flange)
    robot, faults, found = _parsed(text, name=name), Faults(), list[LinkShape]()
    moved = moved_links(robot, (chain.base, *chain.links), name=name)
    for joint, link in enumerate((chain.base, *chain.links)):
        before = len(found) + len(faults.found)
        for part, T_link_part in moved[link]:
            for collision in part.findall("collision"):
                with faults.noting():
                    found.append(link_shape(collision, joint, T_link_part, name=name, link=part.get("name", "")))
        with faults.noting():
            if len(found) + len(faults.found) == before:
                raise UsageError(
                    f"the URDF {name}: its {link} has no collision shape; add a cylinder that contains it."
                )
    faults.refuse(f"the shapes of the URDF {name} cannot be served")
    return tuple(found)


def moved_links(
    robot: ET.Element, moving: tuple[str, ...], *, name: str
) -> dict[str, list[tuple[ET.Element, FloatArray]]]:
    """Return each moving link with all that is fixed to it: elements, and (4, 4) where they are in its frame [mm]."""
    parents = {_link(joint, "child", name=name): joint for joint in robot.findall("joint")}
    found: dict[str, list[tuple[ET.Element, FloatArray]]] = {link: [] for link in moving}
    for link in robot.findall("link"):
        at, T_at_link = link.get("name", ""), np.eye(4)
        while at not in found and at in parents:
            T_at_link = origin_of(parents[at], name=f"{name}: joint '{parents[at].get('name')}'") @ T_at_link
            at = _link(parents[at], "parent", name=name)
        if at in found:
            found[at].append((link, T_at_link))
    return found


def link_shape(collision: ET.Element, joint: int, T_link_part: FloatArray, *, name: str, link: str) -> LinkShape:
    """Return the cylinder around a collision shape."""
    shape = next(iter(collision.findall("geometry/*")), None)
    kind = "empty" if shape is None else shape.tag
    if shape is None or kind not in ("cylinder", "sphere", "box"):
        raise UsageError(
            f"the URDF {name}: its {link} has a collision shape that is no cylinder, box or sphere, but {kind}. "
            f"`geoprint init --urdf {name}` puts cylinders around meshes."
        )
    T_link_cylinder = T_link_part @ origin_of(collision, name=f"{name}: link '{link}'")
    numbers = [float(shape.get(key, "nan")) for key in ("radius", "length")]
    if kind == "sphere":
        numbers[1] = 2.0 * numbers[0]
    if kind == "box":
        sides = _three_numbers(shape, "size", "0 0 0", name=f"{name}: link '{link}'")
        axis = int(sides.argmax())
        numbers = [float(np.linalg.norm(np.delete(sides, axis))) / 2.0, float(sides[axis])]
        T_link_cylinder = T_link_cylinder @ transforms.rigid(np.roll(np.eye(3), axis + 1, axis=0), np.zeros(3))
    radius, length = (MILLIMETRES_PER_METRE * number for number in numbers)
    if not (0.0 < radius < np.inf and 0.0 < length < np.inf):
        raise UsageError(
            f"the URDF {name}: its {link} has a {kind} of radius {radius:g} mm and length {length:g} mm; correct it."
        )
    return LinkShape(joint, T_link_cylinder, radius, length)


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


def _parents(robot: ET.Element, faults: Faults, *, name: str) -> dict[str, ET.Element]:
    """Return the joint that each link hangs on."""
    parents: dict[str, ET.Element] = {}
    for joint in robot.findall("joint"):
        with faults.noting():
            child, _ = (_link(joint, role, name=name) for role in ("child", "parent"))
            if child in parents:
                raise UsageError(
                    f"the URDF {name}: the link '{child}' hangs on two joints; geoprint needs a single chain."
                )
            parents[child] = joint
    return parents


def _followed(parents: dict[str, ET.Element], flange: str) -> tuple[str, list[ET.Element]]:
    """Return the link at which joints end that are followed from the flange, and these, the flange's last."""
    base, joints = flange, list[ET.Element]()
    while base in parents and parents[base] not in joints:
        joints.append(parents[base])
        base = _link(joints[-1], "parent", name="")
    return base, joints[::-1]


def _require_ends(links: set[str], base: str, moving: list[ET.Element], *, name: str, flange: str) -> None:
    """Refuse a flange that is no link, and a chain that does not end at a base."""
    if flange not in links:
        raise UsageError(
            f"the URDF {name} has no link '{flange}' for the flange, only {', '.join(sorted(links))}; name its "
            "flange with robot.flange or `--flange`, or add the link."
        )
    if base not in links or any(_link(joint, "child", name=name) == base for joint in moving):
        raise UsageError(
            f"the URDF {name} leads from '{flange}' to '{base}', which is not a base: a base is a link that no joint "
            "moves. Correct the parents of its joints."
        )


def _places(joints: list[ET.Element], faults: Faults, *, name: str) -> tuple[FloatArray, FloatArray]:
    """Return (6, 4, 4) places of the moving joints, each in the frame before, and (4, 4) of the flange in the last."""
    origins, T_moving_joint = list[FloatArray](), np.eye(4)
    for joint in joints:
        with faults.noting():
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
