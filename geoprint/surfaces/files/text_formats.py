"""Reading OBJ and OFF, the two mesh formats that are lists of numbers in lines of text.

They are read here rather than by trimesh, which misreads relative OBJ indices, a byte order mark and OFF comments
without a word.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import TypeAlias, TypeVar

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray
from geoprint.surfaces.files.mesh_file import MeshFile, check_indices
from geoprint.surfaces.files.precision import written_step
from geoprint.surfaces.files.regions import Regions, named, together
from geoprint.surfaces.operators import doubled_area_vectors

# The statements of OBJ that name the faces after them, and what they name.
_OBJ_NAMES = (("g", "group"), ("o", "object"), ("usemtl", "material"))


# Its number in the file and its words.
_Line: TypeAlias = tuple[int, list[str]]
_Parsed = TypeVar("_Parsed")


def read_obj(data: bytes, /, *, name: str) -> MeshFile:
    """Read positions, faces and regions of an OBJ file; normals and texture are left out.

    Args:
        data: content of the file.
        name: what messages call it.

    Returns:
        (n, 3) vertices in the file's unit and (m, 3) faces; polygons are cut into fans. Groups, objects and materials
        are regions; a statement that names several groups makes one region of them all.

    Raises:
        InputError: a line cannot be read, a face has fewer than three corners or refers to a vertex that is not
            there, or a polygon is not convex.
    """
    text = re.sub(r"\\\r?\n", " ", _decode(data))
    lines = [(number, line.split("#")[0].split()) for number, line in enumerate(text.splitlines(), start=1)]
    position_lines = [line for line in lines if line[1][:1] == ["v"]]
    face_lines = [line for line in lines if line[1][:1] == ["f"]]
    vertices = _parse(position_lines, lambda words: _position(words[1:]), name=name)
    polygons = _parse(face_lines, _obj_corners, name=name)
    # A negative index counts back from the last vertex before the face.
    defined = np.searchsorted([number for number, _ in position_lines], [number for number, _ in face_lines])
    absolute = [
        [index - 1 if index > 0 else int(count) + index for index in polygon]
        for polygon, count in zip(polygons, defined, strict=True)
    ]
    mesh = _mesh(vertices, absolute, name=name)
    sizes = np.array([len(polygon) for polygon in polygons], dtype=np.int64)
    return replace(mesh, regions=_obj_regions(lines, face_lines, sizes), step=written_step(data, mesh.vertices))


def _obj_regions(lines: list[_Line], face_lines: list[_Line], sizes: IntArray) -> Regions:
    """Return the regions of triangles, of which a polygon of each size makes two fewer than it has corners."""
    triangles = np.repeat([number for number, _ in face_lines], sizes - 2)
    kinds: list[tuple[str, Regions]] = []
    for keyword, kind in _OBJ_NAMES:
        statements = [line for line in lines if line[1][:1] == [keyword]]
        # A statement without a name ends the one before.
        names = [" ".join(words[1:]) for _, words in statements]
        which = np.searchsorted([number for number, _ in statements], triangles) - 1
        regions = named(names, which)
        kinds.append((kind, {each: faces for each, faces in regions.items() if each}))
    return together(kinds)


def read_off(data: bytes, /, *, name: str) -> MeshFile:
    """Read positions and faces of an OFF file, also with colours (COFF) or normals (NOFF), which are left out.

    Args:
        data: content of the file.
        name: what messages call it.

    Returns:
        (n, 3) vertices in the file's unit and (m, 3) faces; polygons are cut into fans.

    Raises:
        InputError: the keyword or the counts are missing, the file ends before what they promise, a line cannot be
            read, a face has fewer than three corners or refers to a vertex that is not there, or a polygon is not
            convex.
    """
    split = ((number, line.split("#")[0].split()) for number, line in enumerate(_decode(data).splitlines(), start=1))
    lines = [(number, words) for number, words in split if words]
    head = re.match(r"C?N?OFF ?(\d+) (\d+)", " ".join(word for _, words in lines[:2] for word in words))
    if head is None:
        raise InputError(
            f"`{name}` does not begin with OFF and the numbers of its vertices and faces; "
            "export it again as ASCII OFF, PLY or STL."
        )
    vertex_count, face_count = int(head[1]), int(head[2])
    # The counts stand in the keyword's line or in the next one.
    body = lines[2:] if lines[0][1][-1].endswith("OFF") else lines[1:]
    if len(body) < vertex_count + face_count:
        raise InputError(
            f"`{name}` promises {vertex_count} vertices and {face_count} faces, but holds only {len(body)} lines of "
            "them; it is cut off, so copy or export it again.",
            promised=vertex_count + face_count,
            found=len(body),
        )
    vertices = _parse(body[:vertex_count], _position, name=name)
    polygons = _parse(body[vertex_count : vertex_count + face_count], _off_corners, name=name)
    mesh = _mesh(vertices, polygons, name=name)
    return replace(mesh, step=written_step(data, mesh.vertices))


def _decode(data: bytes) -> str:
    """Return text without byte order mark; bytes that are not UTF-8 can only stand in names and comments."""
    return data.decode("utf-8-sig", errors="replace")


def _parse(lines: list[_Line], parser: Callable[[list[str]], _Parsed], *, name: str) -> list[_Parsed]:
    """Apply a parser to the words of lines; where it raises ValueError, say which line it is."""
    parsed: list[_Parsed] = []
    try:
        # One by one, since the count of those parsed tells the line.
        for _, words in lines:
            parsed.append(parser(words))
    except ValueError as error:
        number, words = lines[len(parsed)]
        raise InputError(
            f"`{name}` line {number} cannot be read: `{' '.join(words)[:60]}`; a position is three numbers with "
            "decimal points and a face at least three vertices, so export it again.",
            line=number,
        ) from error
    return parsed


def _position(words: list[str]) -> tuple[float, float, float]:
    x, y, z = words[:3]
    return float(x), float(y), float(z)


def _obj_corners(words: list[str]) -> list[int]:
    """Return the vertex numbers of `f 1/1/1 2//1 -1` as they stand."""
    numbers = [int(word.split("/")[0]) for word in words[1:]]
    if len(numbers) < 3 or not all(numbers):
        raise ValueError(words)
    return numbers


def _off_corners(words: list[str]) -> list[int]:
    """Return the vertex numbers of `3 0 1 2 255 0 0`: the count, the corners, perhaps a colour."""
    count = int(words[0])
    corners = [int(word) for word in words[1 : count + 1]]
    if count < 3 or len(corners) < count:
        raise ValueError(words)
    return corners


def _mesh(vertices: list[tuple[float, float, float]], polygons: list[list[int]], *, name: str) -> MeshFile:
    """Cut polygons into fans from their first corner."""
    positions = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    sizes = np.array([len(polygon) for polygon in polygons], dtype=np.int64)
    fans = [(polygon[0], *pair) for polygon in polygons for pair in pairwise(polygon[1:])]
    faces = np.array(fans, dtype=np.int64).reshape(-1, 3)
    check_indices(faces, vertices=len(positions), name=name)
    _check_convex(positions, faces, np.repeat(np.arange(sizes.size), sizes - 2), name=name)
    return MeshFile(positions, faces)


def _check_convex(vertices: FloatArray, faces: IntArray, polygon: IntArray, *, name: str) -> None:
    """Refuse a fan whose triangles do not all face to the same side: it would overlap itself.

    Args:
        vertices: positions.
        faces: (m, 3) triangles of all fans.
        polygon: (m,) the polygon that each triangle comes from.
        name: of the file.
    """
    areas = doubled_area_vectors(vertices, faces)
    total = np.column_stack([np.bincount(polygon, areas[:, axis]) for axis in range(3)])
    turned = np.einsum("mx,mx->m", areas, total[polygon]) < 0
    if turned.any():
        place = vertices[faces[turned][0, 0]].tolist()
        raise InputError(
            f"`{name}`: polygons that are not convex: {np.unique(polygon[turned]).size}, the first at {place}; "
            "triangulate the mesh in the program that made it.",
            polygons=int(np.unique(polygon[turned]).size),
        )
