"""The links of the arm as cylinders that contain them: the collision elements of its URDF."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

# The URDF is package data of geoprint, not a stranger's.
from xml.etree import ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.errors import UsageError
from geoprint.motion.kinematics import JOINTS, MILLIMETRES_PER_METRE, read_urdf
from geoprint.motion.tool_solids import Solid


@final
@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A piece of the arm that moves as one.

    Attributes:
        name: what messages call it.
        joint: the joint that moves it, from 1; 0 for the base.
        solids: cylinders in the link's own frame; together they contain it.
    """

    name: str
    joint: int
    solids: tuple[Solid, ...]


def link_solids(model: str) -> tuple[Link, ...]:
    """Read the collision shapes of an arm from its URDF.

    Args:
        model: name of the arm.

    Returns:
        The base and the links 1 to 6, in the order of the joints.

    Raises:
        UsageError: there is no such arm, or a link has no collision shape or one that is not a cylinder.
    """
    robot = ET.fromstring(read_urdf(model))  # noqa: S314
    shapes = {link.get("name", ""): link.findall("collision") for link in robot.findall("link")}
    chain = [_child(joint, "parent") for joint in robot.findall("joint")][:1]
    chain += [_child(joint, "child") for joint in robot.findall("joint") if joint.get("type") == "revolute"]
    names = ["arm's base", *(f"arm's link {joint}" for joint in range(1, JOINTS + 1))]
    links: list[Link] = []
    for joint, (link, name) in enumerate(zip(chain, names, strict=True)):
        if not shapes[link]:
            raise UsageError(f"the arm {model}: its {link} has no collision shape; correct its URDF.")
        links.append(Link(name, joint, tuple(_cylinder(shape, name=name, link=link) for shape in shapes[link])))
    return tuple(links)


def _child(joint: ET.Element, role: str) -> str:
    element = joint.find(role)
    return "" if element is None else element.get("link", "")


def _cylinder(collision: ET.Element, *, name: str, link: str) -> Solid:
    cylinder, origin = collision.find("geometry/cylinder"), collision.find("origin")
    if cylinder is None or origin is None:
        raise UsageError(f"the URDF's {link} has a collision shape that is no cylinder with an origin; correct it.")
    numbers = {key: np.array([float(word) for word in origin.get(key, "0 0 0").split()]) for key in ("xyz", "rpy")}
    radius, length = (float(cylinder.get(key, "nan")) * MILLIMETRES_PER_METRE for key in ("radius", "length"))
    if not (0.0 < radius < np.inf and 0.0 < length < np.inf):
        raise UsageError(f"the URDF's {link} has a cylinder of radius {radius} mm and length {length} mm; correct it.")
    centre = numbers["xyz"] * MILLIMETRES_PER_METRE
    half = Rotation.from_euler("xyz", numbers["rpy"]).as_matrix()[:, 2] * length / 2
    return Solid(name, centre - half, centre + half, radius, radius)
