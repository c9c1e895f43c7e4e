"""Reading the plainest of PLY files, which most programs write and geoprint itself: binary, of triangles alone.

Its rows all take as many bytes, so that it is two tables, which numpy reads where they lie. All other PLY files are
read with trimesh, which takes a quarter of a second to import.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from geoprint.surfaces.files.mesh_file import MeshFile

# Data and properties of each element of a PLY file, by their names.
Elements: TypeAlias = Mapping[str, Mapping[str, Mapping[str, object]]]

# numpy's types of the numbers in a little-endian file.
PLY_TYPES = {
    "char": "i1", "uchar": "u1", "int8": "i1", "uint8": "u1", "short": "<i2", "ushort": "<u2", "int16": "<i2",
    "uint16": "<u2", "int": "<i4", "uint": "<u4", "int32": "<i4", "uint32": "<u4", "float": "<f4", "float32": "<f4",
    "double": "<f8", "float64": "<f8",
}  # fmt: skip
_CORNERS = ("vertex_indices", "vertex_index")
_COUNT = "count of corners"


class PlainMesh(NamedTuple):
    """A mesh, and the numbers that its vertices and faces carry besides."""

    mesh: MeshFile
    elements: Elements


def plain_mesh(header: bytes, body: bytes) -> PlainMesh | None:
    """Return the mesh of a PLY file if it is plain: little-endian, vertices, then faces of three corners each.

    Args:
        header: up to the word that ends it.
        body: what follows that word.

    Returns:
        None where it is not plain, or is longer or shorter than it says.
    """
    lines = [line.split() for line in header.decode("ascii", errors="replace").splitlines()]
    said = [line for line in lines if line and line[0] not in {"ply", "comment", "obj_info"}]
    names = [line[1] for line in said if line[0] == "element" and len(line) == 3]
    if said[:1] != [["format", "binary_little_endian", "1.0"]] or names != ["vertex", "face"]:
        return None
    first, second = (index for index, line in enumerate(said) if line[0] == "element")
    vertex, face = _row_of(said[first + 1 : second]), _row_of(said[second + 1 :])
    if first != 1 or vertex is None or face is None or not {"x", "y", "z"} <= set(vertex.names or ()):
        return None
    corners = [name for name in _CORNERS if name in (face.names or ())]
    count, faces = int(said[first][2]), int(said[second][2])
    rows = body.partition(b"\n")[2]
    if min(count, faces) < 1 or len(corners) != 1 or len(rows) != count * vertex.itemsize + faces * face.itemsize:
        return None
    points = np.frombuffer(rows, dtype=vertex, count=count)
    triangles = np.frombuffer(rows, dtype=face, offset=count * vertex.itemsize)
    if not (triangles[_COUNT] == 3).all():
        return None
    mesh = MeshFile(
        np.column_stack([points[axis] for axis in "xyz"]).astype(np.float64, copy=False),
        triangles[corners[0]].astype(np.int64),
    )
    return PlainMesh(mesh, {"vertex": _numbers(points), "face": _numbers(triangles)})


def _row_of(properties: list[list[str]]) -> np.dtype[np.void] | None:
    """Return the type of one row; None where that is not known before it is read, or a property stands twice."""
    fields: list[tuple[str, str] | tuple[str, str, int]] = []
    for line in properties:
        match line:
            case ["property", kind, name] if kind in PLY_TYPES:
                fields.append((name, PLY_TYPES[kind]))
            case ["property", "list", "uchar" | "uint8", "int" | "int32" | "uint" | "uint32" as kind, name] if (
                name in _CORNERS
            ):
                fields += [(_COUNT, "u1"), (name, PLY_TYPES[kind], 3)]
            case _:
                return None
    names = {field[0] for field in fields}
    return np.dtype(fields) if len(names) == len(fields) else None


def _numbers(rows: NDArray[np.void]) -> Mapping[str, Mapping[str, object]]:
    """Return what each row carries once, as trimesh returns the elements of a file."""
    names = [name for name in rows.dtype.names or () if rows[name].ndim == 1 and name != _COUNT]
    return {"data": {name: rows[name] for name in names}, "properties": dict.fromkeys(names)}
