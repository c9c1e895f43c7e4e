"""What a reader makes of a file: a mesh, its unit and precision, how it was made, and the regions that it names."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import field
from types import MappingProxyType
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray, Surface, frozen
from geoprint.surfaces.conversion import Notes
from geoprint.surfaces.files.regions import Regions

# Millimetres in each unit; the order is that of likelihood, which decides between units that are equally plausible.
UNITS: Mapping[str, float] = MappingProxyType({"mm": 1.0, "m": 1000.0, "in": 25.4, "cm": 10.0, "um": 0.001})
# Where the steps between neighbouring coordinates exceed this share of the part's size, vertices of a fine mesh fall
# together: in single precision a part of 40 mm may lie up to 33 m from the origin.
RESOLUTION_SHARE = 1e-4
# So much of a text tells how its numbers are written [bytes].
SAMPLE = 1 << 16
WRITTEN = re.compile(rb"[-+]?\d+\.(\d+)(?:[eE]([-+]?\d{1,3}))?")


@final
@frozen
class MeshFile:
    """A mesh as a file holds it, or as it was made of what a file holds.

    Attributes:
        vertices: (n, 3) positions in the file's unit.
        faces: (m, 3) vertex indices, counter-clockwise from outside; polygons are triangulated.
        unit: of the positions, a key of UNITS; empty where the format carries none and nobody has said it.
        notes: how the mesh was made, where the file holds something else.
        regions: groups, objects, solids and labels that the file gives to faces.
        name: of the file, or of the one that a stored mesh was read from.
        digest: SHA-256 of the bytes of that file; empty where there was none.
        label: that was asked for of a label volume, or None.
        step: between neighbouring numbers that the file can hold where the mesh lies, in its unit; 0 where these are of
            double precision.
    """

    vertices: FloatArray
    faces: IntArray
    unit: str = ""
    notes: Notes = ()
    regions: Regions = field(default_factory=dict[str, IntArray])
    name: str = "surface"
    digest: str = ""
    label: int | None = None
    step: float = 0.0

    @property
    def surface(self) -> Surface:
        """Return the mesh in mm, named after the file.

        Raises:
            InputError: the unit is not known.
        """
        if not self.unit:
            raise InputError(f"`{self.name}` has no unit; give it with `--unit`.")
        return Surface(vertices=self.vertices * UNITS[self.unit], faces=self.faces, name=self.name)


def check_indices(faces: IntArray, *, vertices: int, name: str) -> None:
    """Refuse faces that refer to vertices which are not in the file.

    Raises:
        InputError: an index is negative, or not below the number of vertices.
    """
    wrong = (faces < 0) | (faces >= vertices)
    if wrong.any():
        face = int(np.argmax(wrong.any(axis=1)))
        raise InputError(
            f"`{name}`: face {face} refers to vertex {faces[wrong][0]}, but there are {vertices} vertices, numbered "
            "from 0; the file is damaged, so export it again.",
            face=face,
            vertex=int(faces[wrong][0]),
            vertices=vertices,
        )


def check_mesh(file: MeshFile, *, name: str) -> None:
    """Refuse a mesh without faces, with faces that refer to nothing, or with coordinates that are not finite."""
    if len(file.faces) == 0:
        raise InputError(f"`{name}` holds no faces; a surface needs triangles, so export it as a mesh.")
    check_indices(file.faces, vertices=len(file.vertices), name=name)
    broken = ~np.isfinite(file.vertices).all(axis=1)
    if broken.any():
        raise InputError(
            f"`{name}`: vertices with NaN or infinite coordinates: {int(broken.sum())}, the first is vertex "
            f"{int(np.argmax(broken))}; repair the mesh where it was made.",
            vertices=int(broken.sum()),
            vertex=int(np.argmax(broken)),
        )


def single_step(vertices: FloatArray) -> float:
    """Return the step between neighbouring numbers of single precision as large as the largest coordinate."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.spacing(np.float32(np.abs(vertices).max(initial=0.0))))


def written_step(text: bytes, vertices: FloatArray) -> float:
    """Return the step that the decimals leave with which a text writes its largest coordinates.

    It is never more than that of single precision: round numbers with few decimals are meant.
    """
    least = 0.5 * float(np.abs(vertices).max(initial=0.0))
    found = [one for one in WRITTEN.finditer(text[:SAMPLE]) if abs(float(one[0])) >= least]
    return min([single_step(vertices), *(10.0 ** (int(one[2] or 0) - len(one[1])) for one in found)])


def resolves(step: float, vertices: FloatArray) -> bool:
    """Return whether steps are small enough for the extent of a mesh."""
    return step <= RESOLUTION_SHARE * float(np.ptp(vertices, axis=0).max(initial=0.0))
