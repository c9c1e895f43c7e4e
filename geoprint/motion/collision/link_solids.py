"""The links of the arm as cylinders that contain them: the collision elements of its URDF."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import final
from xml.etree import ElementTree as ET

import numpy as np

from geoprint.errors import UsageError
from geoprint.motion.arm import FLANGE_FRAME, JOINTS, MILLIMETRES_PER_METRE, chain_of, origin_of, read_urdf
from geoprint.motion.collision.tool_solids import Solid


@final
@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """What of the arm moves as one.

    Attributes:
        name: what messages call it.
        joint: the joint that moves it, from 1; 0 for the base.
        solids: cylinders in the link's own frame; together they contain it.
    """

    name: str
    joint: int
    solids: tuple[Solid, ...]


@lru_cache(maxsize=8)
def link_solids(model: str, *, urdf: str | None = None, flange: str = FLANGE_FRAME) -> tuple[Link, ...]:
    """Read the collision shapes of an arm from its URDF.

    Args:
        model: name of the arm.
        urdf: its text, or None where it is package data.
        flange: name of its flange frame.

    Returns:
        The base and the links 1 to 6, in the order of the joints.

    Raises:
        UsageError: there is no such arm, or a link has no collision shape or one that is not a cylinder, or a link that
            is fixed to another has one.
    """
    text = read_urdf(model) if urdf is None else urdf
    chain = chain_of(text, name=model, flange=flange)
    # `chain_of` has refused what makes XML dangerous.
    robot = ET.fromstring(text)  # noqa: S314
    shapes = {link.get("name", ""): link.findall("collision") for link in robot.findall("link")}
    moving = (chain.base, *chain.links)
    fixed = [link for link, found in shapes.items() if found and link not in moving]
    if fixed:
        raise UsageError(
            f"the arm {model}: its {fixed[0]} has a collision shape but hangs on a fixed joint; give the shape to the "
            "link that it is fixed to."
        )
    names = ["arm's base", *(f"arm's link {joint}" for joint in range(1, JOINTS + 1))]
    links: list[Link] = []
    for joint, (link, name) in enumerate(zip(moving, names, strict=True)):
        if not shapes[link]:
            raise UsageError(f"the arm {model}: its {link} has no collision shape; correct its URDF.")
        links.append(Link(name, joint, tuple(_cylinder(shape, name=name, link=link) for shape in shapes[link])))
    return tuple(links)


def _cylinder(collision: ET.Element, *, name: str, link: str) -> Solid:
    cylinder = collision.find("geometry/cylinder")
    if cylinder is None:
        raise UsageError(f"the URDF's {link} has a collision shape that is no cylinder; correct it.")
    radius, length = (float(cylinder.get(key, "nan")) * MILLIMETRES_PER_METRE for key in ("radius", "length"))
    if not (0.0 < radius < np.inf and 0.0 < length < np.inf):
        raise UsageError(f"the URDF's {link} has a cylinder of radius {radius} mm and length {length} mm; correct it.")
    T_link_cylinder = origin_of(collision, name=f"link {link}")
    centre, half = T_link_cylinder[:3, 3], T_link_cylinder[:3, 2] * length / 2
    return Solid(name, centre - half, centre + half, radius, radius)
