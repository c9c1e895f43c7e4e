"""What the links of an arm look like: the meshes that its URDF names, and cylinders that contain them."""

from __future__ import annotations

import tomllib
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from scipy.spatial import ConvexHull

from geoprint import transforms
from geoprint.errors import Faults, GeoprintError, InputError, UsageError
from geoprint.geometry.files import load
from geoprint.model import FloatArray, Robot, Surface
from geoprint.robot.arm.urdf import (
    MILLIMETRES_PER_METRE,
    Chain,
    LinkShape,
    chain_of,
    link_shape,
    moved_links,
    origin_of,
    read_urdf_file,
)

# Units of a mesh by its scale: a URDF's lengths are metres.
UNITS = {1.0: "m", 0.001: "mm"}
# Folders above the URDF in which a package is looked for.
LEVELS = 3


def link_meshes(robot: Robot, *, cell: Path) -> tuple[dict[int, list[Surface]], list[str]]:
    """Read the meshes of the base and the links 1 to 6.

    Args:
        robot: with a URDF of its own.
        cell: file of the cell, which names the URDF.

    Returns:
        The meshes in the link's own frame, by the joint that moves it; and a sentence for each link without one, or
        whose mesh cannot be read. Nothing at all where no link names one.
    """
    found: dict[int, list[Surface]] = {}
    notes: list[str] = []
    chain = chain_of(robot.urdf or "", name=robot.model, flange=robot.flange)
    # `chain_of` has refused what makes XML dangerous.
    root = ET.fromstring(robot.urdf or "<robot/>")  # noqa: S314
    # A calibrated arm has the URDF of its kind, which lies nowhere beside the cell.
    named = tomllib.loads(cell.read_text(encoding="utf-8"))["robot"].get("urdf", "")
    folder = (cell.parent / str(named)).parent
    visuals = {link.get("name", ""): link.findall("visual") for link in root.findall("link")}
    for joint, link in enumerate((chain.base, *chain.links)):
        meshes = [(shape, mesh) for shape in visuals[link] if (mesh := shape.find("geometry/mesh")) is not None]
        try:
            found.update({joint: [_mesh(shape, mesh, folder) for shape, mesh in meshes]} if meshes else {})
        except GeoprintError as error:
            notes.append(f"{link} is drawn as its collision solids: {error}")
    return found, notes


def _mesh(shape: ET.Element, mesh: ET.Element, folder: Path) -> Surface:
    name, scale = mesh.get("filename", ""), {float(word) for word in mesh.get("scale", "1").split()}
    unit = UNITS.get(next(iter(scale))) if len(scale) == 1 else None
    if unit is None:
        raise InputError(f"the mesh {name} has the scale {mesh.get('scale')}, known are 1 and 0.001.")
    surface = load(_file(name, folder), unit=unit)
    return Surface(transforms.apply(origin_of(shape, name=name), surface.vertices), surface.faces)


def _file(name: str, folder: Path) -> Path:
    """Return where a mesh lies: beside the URDF, or in the package that it names, around the URDF."""
    inner = Path(name.removeprefix("file://").removeprefix("package://"))
    inside = Path(*inner.parts[1:]) if name.startswith("package://") else inner
    around = (folder, *folder.resolve().parents[:LEVELS])
    places = [above / part for part in (inner, inside) for above in around]
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        raise InputError(f"the mesh {name} is not there, beside the URDF in {folder}; copy it there.")
    return found


# An arm as planning needs it: its joints, and cylinders that contain the shapes of each link.


# The circle around points comes within a hundredth of the smallest one after so many steps [Badoiu2003].
CIRCLE_STEPS = 400
# A cylinder around a mesh is wider by this [mm]: what rounding leaves outside.
ROUNDING = 1e-6


def enclosed_urdf(path: Path, *, flange: str) -> tuple[str, list[str]]:
    """Return an arm's URDF with cylinders around the shapes of its links, and what was done with meshes.

    The visual meshes of a link stand in where it has no collision shapes. One cylinder contains each mesh, the smallest
    along an axis of the mesh or of its link: generous where the link is bent.

    Args:
        path: of the URDF; its meshes are looked for as `link_meshes` does.
        flange: name of the flange's link.

    Returns:
        The text, and a sentence for each link whose meshes were contained.

    Raises:
        UsageError: as `read_urdf_file`; or a link has no shape, or one that cannot be read; lists all of these.
    """
    text = read_urdf_file(path, flange=flange)
    chain, faults = chain_of(text, name=path.name, flange=flange), Faults()
    # `chain_of` has refused what makes XML dangerous.
    root = ET.fromstring(text)  # noqa: S314
    moved = moved_links(root, (chain.base, *chain.links), name=path.name)
    shapes, notes = list[LinkShape](), list[str]()
    for joint, link in enumerate((chain.base, *chain.links)):
        with faults.noting():
            found, meshes = _enclosed(moved[link], joint, path, link=link)
            shapes += found
            if meshes:
                largest = max(found, key=lambda shape: shape.radius)
                size = f"{2.0 * largest.radius:.0f} mm wide and {largest.length:.0f} mm long"
                notes.append(f"{link}: {meshes} by cylinders, the widest {size}.")
    faults.refuse(f"the shapes of the URDF {path.name} cannot be served")
    return _written(root, chain, shapes), notes


def _enclosed(
    parts: list[tuple[ET.Element, FloatArray]], joint: int, path: Path, *, link: str
) -> tuple[list[LinkShape], str]:
    """Return cylinders around the shapes of all that moves with a link, and how many meshes they contain, in words."""
    kind = "collision" if any(part.find("collision") is not None for part, _ in parts) else "visual"
    found, meshes = list[LinkShape](), 0
    for part, T_link_part in parts:
        for shape in part.findall(kind):
            mesh = shape.find("geometry/mesh")
            if mesh is None:
                found.append(link_shape(shape, joint, T_link_part, name=path.name, link=part.get("name", "")))
                continue
            try:
                points = transforms.apply(T_link_part, _mesh(shape, mesh, path.parent).vertices)
            except GeoprintError as error:
                raise UsageError(f"the URDF {path.name}: its {part.get('name')}: {error}") from error
            axes = np.concatenate([np.eye(3), (T_link_part @ origin_of(shape, name=path.name))[:3, :3].T])
            found.append(min((_cylinder_around(points, axis, joint) for axis in axes), key=_volume))
            meshes += 1
    if not found:
        raise UsageError(f"the URDF {path.name}: its {link} has no shape; add a cylinder that contains it.")
    return found, f"{meshes} {kind} mesh{'es' if meshes > 1 else ''} contained" if meshes else ""


def _cylinder_around(points: FloatArray, axis: FloatArray, joint: int) -> LinkShape:
    """Return a cylinder along an axis that contains (n, 3) points."""
    frame = np.linalg.svd(axis[None])[2][[1, 2, 0]]
    frame[2] = axis
    frame[0] *= np.linalg.det(frame)
    seen = points @ frame.T
    corners = seen[ConvexHull(seen[:, :2], qhull_options="QJ").vertices, :2]
    centre = corners.mean(axis=0)
    for step in range(2, CIRCLE_STEPS):
        centre += (corners[np.linalg.norm(corners - centre, axis=1).argmax()] - centre) / step
    radius = float(np.linalg.norm(seen[:, :2] - centre, axis=1).max()) + ROUNDING
    low, high = float(seen[:, 2].min()), float(seen[:, 2].max())
    middle = frame.T @ np.array([*centre, (low + high) / 2.0])
    return LinkShape(joint, transforms.rigid(frame.T, middle), radius, high - low + 2.0 * ROUNDING)


def _volume(shape: LinkShape) -> float:
    return shape.radius**2 * shape.length


def _written(root: ET.Element, chain: Chain, shapes: list[LinkShape]) -> str:
    """Return a URDF with its joints as they are, and with cylinders as the only shapes."""
    moving = (chain.base, *chain.links)
    for element in list(root):
        if element.tag not in ("link", "joint"):
            root.remove(element)
        elif element.tag == "link":
            for child in list(element):
                element.remove(child)
            if (name := element.get("name", "")) in moving:
                element.extend(_collision(shape) for shape in shapes if shape.joint == moving.index(name))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _collision(shape: LinkShape) -> ET.Element:
    # A cylinder is round: two angles turn its axis anywhere.
    axis = shape.T_link_cylinder[:3, 2]
    rpy = np.array([0.0, np.arctan2(np.hypot(*axis[:2]), axis[2]), np.arctan2(axis[1], axis[0])])
    collision = ET.Element("collision")
    ET.SubElement(
        collision, "origin", xyz=_numbers(shape.T_link_cylinder[:3, 3] / MILLIMETRES_PER_METRE), rpy=_numbers(rpy)
    )
    sizes = np.array([shape.radius, shape.length]) / MILLIMETRES_PER_METRE
    radius, length = _numbers(sizes).split()
    ET.SubElement(ET.SubElement(collision, "geometry"), "cylinder", radius=radius, length=length)
    return collision


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.17g}" for value in values)
