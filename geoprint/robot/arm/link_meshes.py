"""What the links of an arm look like: the visual meshes that its URDF names."""

from __future__ import annotations

import tomllib
from pathlib import Path
from xml.etree import ElementTree as ET

from geoprint import transforms
from geoprint.errors import GeoprintError, InputError
from geoprint.geometry.files import load
from geoprint.model import Robot, Surface
from geoprint.robot.arm.urdf import chain_of, origin_of

# Units of a mesh by its scale: a URDF's lengths are metres.
UNITS = {1.0: "m", 0.001: "mm"}


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
    folder = (cell.parent / str(tomllib.loads(cell.read_text(encoding="utf-8"))["robot"]["urdf"])).parent
    visuals = {link.get("name", ""): link.findall("visual") for link in root.findall("link")}
    for joint, link in enumerate((chain.base, *chain.links)):
        meshes = [(shape, mesh) for shape in visuals[link] if (mesh := shape.find("geometry/mesh")) is not None]
        try:
            found.update({joint: [_mesh(shape, mesh, folder) for shape, mesh in meshes]} if meshes else {})
        except GeoprintError as error:
            notes.append(f"{link} is drawn as its collision solids: {error}")
    return found, notes


def _mesh(visual: ET.Element, mesh: ET.Element, folder: Path) -> Surface:
    name, scale = mesh.get("filename", ""), {float(word) for word in mesh.get("scale", "1").split()}
    unit = UNITS.get(next(iter(scale))) if len(scale) == 1 else None
    if unit is None:
        raise InputError(f"the mesh {name} has the scale {mesh.get('scale')}, known are 1 and 0.001.")
    surface = load(_file(name, folder), unit=unit)
    return Surface(transforms.apply(origin_of(visual, name=name), surface.vertices), surface.faces)


def _file(name: str, folder: Path) -> Path:
    """Return where a mesh lies: beside the URDF, or in the package that it names, in which the URDF lies too."""
    inner = Path(name.removeprefix("file://").removeprefix("package://"))
    inside = Path(*inner.parts[1:]) if name.startswith("package://") else inner
    places = [folder / inner, *(above / inside for above in (folder, *folder.resolve().parents[:2]))]
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        raise InputError(f"the mesh {name} is not there, beside the URDF in {folder}; copy it there.")
    return found
