"""Reading STL and PLY, the two mesh formats whose files say how long they are.

Readers answer many damaged files with a mesh that is empty or lacks a part. So what a file promises (the count of a
binary STL, the header of a PLY) is compared with its length before it is read, and with what came out after.

Most PLY files, those of geoprint among them, are plain: binary, of triangles alone. Their rows all take as many bytes,
so that they are two tables, which numpy reads where they lie. The others are read with trimesh, which takes a quarter
of a second to import.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from dataclasses import replace
from io import BytesIO
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from geoprint.errors import InputError
from geoprint.model import IntArray
from geoprint.surfaces.files.mesh_file import MeshFile, origin_of, resolves, restored, single_step, written_step
from geoprint.surfaces.files.optional_readers import read_cloud_ply
from geoprint.surfaces.files.regions import Regions, labelled_faces, named

STL_HEADER_BYTES = 84
STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
STL_TRIANGLE_BYTES = STL_TRIANGLE.itemsize
# numpy's types of the numbers in a little-endian file.
PLY_TYPES = {
    "char": "i1", "uchar": "u1", "int8": "i1", "uint8": "u1", "short": "<i2", "ushort": "<u2", "int16": "<i2",
    "uint16": "<u2", "int": "<i4", "uint": "<u4", "int32": "<i4", "uint32": "<u4", "float": "<f4", "float32": "<f4",
    "double": "<f8", "float64": "<f8",
}  # fmt: skip
# What the list of a face's corners is called, and what we call its length.
_CORNERS = ("vertex_indices", "vertex_index")
_COUNT = "count of corners"
# Data and properties of each element of a PLY file, by their names.
Elements: TypeAlias = Mapping[str, Mapping[str, Mapping[str, object]]]


def read_stl(data: bytes, /, *, name: str) -> MeshFile:
    """Read an STL file, binary if its length is what its count says and ASCII otherwise.

    A binary header may begin with 'solid' all the same.

    Args:
        data: content of the file.
        name: what messages call it.

    Returns:
        Three vertices for each triangle, not joined; the solids of an ASCII file are regions.

    Raises:
        InputError: it is neither, or its length disagrees with the count.
    """
    announced = int.from_bytes(data[80:STL_HEADER_BYTES], "little")
    if len(data) == STL_HEADER_BYTES + STL_TRIANGLE_BYTES * announced:
        triangles = np.frombuffer(data, dtype=STL_TRIANGLE, offset=STL_HEADER_BYTES)
        vertices = triangles["corners"].reshape(-1, 3).astype(np.float64)
        vertices.setflags(write=False)
        return MeshFile(vertices, np.arange(len(vertices)).reshape(-1, 3), step=single_step(vertices))
    # trimesh needs UTF-8; other bytes can only stand in names.
    written = data.decode("utf-8-sig", errors="replace")
    text = written.lower()
    if text.lstrip().startswith("solid") and ("facet" in text or "endsolid" in text):
        facets = [found.start() for found in re.finditer(r"(?<!end)facet", written, re.IGNORECASE)]
        mesh, _ = _through_trimesh(text.encode(), kind="stl", faces=len(facets), name=name)
        return replace(mesh, regions=_solids(written, facets), step=written_step(data, mesh.vertices))
    if len(data) < STL_HEADER_BYTES or data[:1] == b"<":
        raise InputError(
            f"`{name}` is not an STL file: {len(data)} bytes that do not begin with `solid`; "
            "look into it with an editor and export the mesh again."
        )
    raise InputError(
        f"`{name}` announces {announced} triangles, which take {STL_HEADER_BYTES + STL_TRIANGLE_BYTES * announced} "
        f"bytes as binary STL, but holds {len(data)} bytes; it is cut off or damaged, so copy or export it again.",
        announced=announced,
        bytes=len(data),
    )


def _solids(text: str, facets: list[int]) -> Regions:
    """Return the regions that the solids of an ASCII STL file are, given where its facets begin."""
    solids = list(re.finditer(r"^[ \t]*solid\b(.*)$", text, re.IGNORECASE | re.MULTILINE))
    names = [found[1].strip() or f"solid {number}" for number, found in enumerate(solids, start=1)]
    return named(names, np.searchsorted([found.start() for found in solids], facets) - 1)


def read_ply(data: bytes, /, *, name: str) -> MeshFile:
    """Read a PLY file; where it holds points alone, a surface is laid through them.

    Args:
        data: content of the file.
        name: what messages call it.

    Returns:
        Vertices and triangles; the values of integer properties are regions, those of faces where all are triangles. A
        mesh that geoprint stored is the one that it had read.

    Raises:
        InputError: the header is not one, or promises more than the file holds.
    """
    if holds_points_alone(data):
        return read_cloud_ply(data, name=name)
    header, end, body = data.partition(b"end_header")
    header, origin = origin_of(header, body)
    if not end or data[:3] != b"ply":
        raise InputError(f"`{name}` does not begin with a PLY header; it is not a PLY file, so export the mesh again.")
    lines = [line.split() for line in header.decode("ascii", errors="replace").splitlines()]
    ascii_body = ["format", "ascii", "1.0"] in lines
    counts: dict[str, int] = {}
    least = 0
    for words in lines:
        if words[:1] == ["element"]:
            counts[words[1]] = int(words[2])
            least += counts[words[1]] if ascii_body else 0
        elif words[:1] == ["property"] and not ascii_body:
            least += counts[next(reversed(counts))] * _least_bytes(words)
    found = sum(1 for line in body.splitlines() if line.strip()) if ascii_body else len(body)
    if found < least:
        elements = " and ".join(f"{count} of `{element}`" for element, count in counts.items())
        raise InputError(
            f"`{name}` promises {elements} in its header, at least {least} {'lines' if ascii_body else 'bytes'}, but "
            f"holds {found}; it is cut off or damaged, so copy or export it again.",
            promised=least,
            found=found,
        )
    if not counts.get("vertex") or not counts.get("face"):
        raise InputError(
            f"`{name}` holds {counts.get('vertex', 0)} vertices and {counts.get('face', 0)} faces; a surface needs "
            "triangles, so export it as a mesh."
        )
    mesh, elements = _read_elements(header, body, counts=counts, name=name)
    of_faces = _integers(elements, "face", count=len(mesh.faces))
    if origin is not None:
        return restored(mesh, origin, next(iter(of_faces.values()), None))
    of_vertices = _integers(elements, "vertex", count=len(mesh.vertices))
    return replace(mesh, regions=labelled_faces(mesh.faces, of_faces=of_faces, of_vertices=of_vertices))


def holds_points_alone(data: bytes) -> bool:
    """Return whether a PLY file holds vertices alone."""
    header = data[: data.find(b"end_header")].split(b"\n")
    counts = {words[1]: words[2] for words in map(bytes.split, header) if len(words) == 3 and words[0] == b"element"}
    return counts.get(b"vertex", b"0") != b"0" and counts.get(b"face", b"0") == b"0"


def _read_elements(header: bytes, body: bytes, *, counts: Mapping[str, int], name: str) -> tuple[MeshFile, Elements]:
    """Return mesh and elements of a PLY file; text that single precision would blur is read as it is written."""
    mesh, elements = plain_mesh(header, body) or _through_trimesh(
        header + b"end_header" + body, kind="ply", vertices=counts["vertex"], faces=counts["face"], name=name
    )
    single, wide = single_step(mesh.vertices), re.sub(rb"property float(32)? ", b"property double ", header)
    if b"format ascii" not in header:
        return replace(mesh, step=single if wide != header else 0.0), elements
    if wide != header and not resolves(single, mesh.vertices):
        return _read_elements(wide, body, counts=counts, name=name)
    return replace(mesh, step=written_step(body, mesh.vertices)), elements


def _integers(elements: Elements, element: str, *, count: int) -> dict[str, IntArray]:
    """Return the integer properties of which an element of a PLY file has as many as `count`, as trimesh reads them."""
    data = elements[element]["data"]
    arrays = {name: np.asarray(data[name]) for name in elements[element]["properties"]}
    # What trimesh reads from text stands in columns.
    flat = {name: array[:, 0] if array.shape == (count, 1) else array for name, array in arrays.items()}
    return {name: a.astype(np.int64) for name, a in flat.items() if a.dtype.kind in "iu" and a.shape == (count,)}


def _least_bytes(words: list[str]) -> int:
    """Return the least number of bytes of `property float x` or `property list uchar int vertex_indices`."""
    if words[1] != "list":
        return np.dtype(PLY_TYPES[words[1]]).itemsize
    # A face has three corners at least; other lists may be empty.
    corners = 3 if words[4].startswith("vertex_ind") else 0
    return np.dtype(PLY_TYPES[words[2]]).itemsize + corners * np.dtype(PLY_TYPES[words[3]]).itemsize


def _through_trimesh(
    data: bytes, *, kind: str, faces: int, name: str, vertices: int | None = None
) -> tuple[MeshFile, Elements]:
    """Read with trimesh, and compare the result with what the file promises; of PLY also return the elements.

    Args:
        data: content of the file.
        kind: trimesh's name of the format.
        faces: promised number; polygons make more.
        name: of the file.
        vertices: promised number, if the format has one.
    """
    import trimesh  # here, because it takes a quarter of a second

    with warnings.catch_warnings():
        # What numpy warns of in a damaged file is found by the checks here and by those of the caller.
        warnings.simplefilter("ignore")
        mesh = trimesh.load_mesh(BytesIO(data), file_type=kind, process=False, fix_texture=False)
    got_vertices, got_faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    if len(got_faces) < faces or (vertices is not None and len(got_vertices) != vertices):
        raise InputError(
            f"`{name}` promises {faces} faces{'' if vertices is None else f' and {vertices} vertices'}, but "
            f"{len(got_faces)} faces and {len(got_vertices)} vertices could be read; it is damaged or mixes triangles "
            "with polygons, so export it again as triangles.",
            faces=faces,
            found=len(got_faces),
        )
    return MeshFile(got_vertices.reshape(-1, 3), got_faces.reshape(-1, 3)), mesh.metadata.get("_ply_raw", {})


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
