"""Reading OBJ and OFF, the two mesh formats that are lists of numbers in lines of text.

They are read here rather than by trimesh, which misreads relative OBJ indices, a byte order mark and OFF comments
without a word.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeAlias, TypeVar

import numpy as np

from geoprint.errors import InputError
from geoprint.model import IntArray, reading
from geoprint.surfaces.files.mesh_file import MeshFile, written_step
from geoprint.surfaces.files.polygons import triangulated
from geoprint.surfaces.files.regions import Regions, named, together

# The statements of OBJ that name the faces after them, and what they name.
_OBJ_NAMES = (("g", "group"), ("o", "object"), ("usemtl", "material"))
# Those that are faces; the second is its old name.
_OBJ_FACES = ("f", "fo")
# Those that change no surface: they are skipped and recorded.
_OBJ_SKIPPED = (
    "vn", "vt", "vp", "p", "l", "s", "mg", "lod", "bevel", "c_interp", "d_interp", "mtllib", "usemap", "maplib",
    "shadow_obj", "trace_obj",
)  # fmt: skip
# Those that are surfaces of another kind, or bring in what stands in other files.
_OBJ_REFUSED = (
    "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp", "end", "con",
    "ctech", "stech", "bzp", "bsp", "cdc", "cdp", "res", "call", "csh",
)  # fmt: skip


# Its number in the file and its words.
_Line: TypeAlias = tuple[int, list[str]]
_Parsed = TypeVar("_Parsed")


def read_obj(data: bytes, /, *, name: str) -> MeshFile:
    """Read positions, faces and regions of an OBJ file; normals and texture are left out.

    Args:
        data: content of the file.
        name: what messages call it.

    Returns:
        (n, 3) vertices in the file's unit and (m, 3) faces; polygons are triangulated. Groups, objects and materials
        are regions; a statement that names several groups makes one region of them all.

    Raises:
        InputError: a line cannot be read or is no statement that is known, a face has fewer than three corners or
            refers to a vertex that is not there, or a polygon crosses itself.
    """
    lines = [(number, words) for number, line in _joined(_decode(data)) if (words := line.split("#")[0].split())]
    _check_statements(lines, name=name)
    position_lines = [line for line in lines if line[1][0] == "v"]
    face_lines = [line for line in lines if line[1][0] in _OBJ_FACES]
    vertices = _parse(position_lines, _obj_position, name=name)
    polygons = _parse(face_lines, _obj_corners, name=name)
    # A negative index counts back from the last vertex before the face.
    defined = np.searchsorted([number for number, _ in position_lines], [number for number, _ in face_lines])
    absolute = [
        [index - 1 if index > 0 else int(count) + index for index in polygon]
        for polygon, count in zip(polygons, defined, strict=True)
    ]
    mesh, polygon = _mesh(vertices, absolute, name=name)
    # Those of lines that are joined stand in the first.
    owners = np.array([number for number, _ in face_lines], dtype=np.int64)[polygon]
    skipped = Counter(f"`{words[0]}`" for _, words in lines if words[0] in _OBJ_SKIPPED)
    skipped["vertex colours"] = sum(len(words) > 5 for _, words in position_lines)
    return replace(
        mesh,
        regions=_obj_regions(lines, owners),
        step=written_step(data, mesh.vertices),
        reading=reading(used=_used(polygons, len(vertices)), skipped=skipped),
    )


def _used(polygons: list[list[int]], vertices: int) -> dict[str, int]:
    """Return what the record says was used of a mesh."""
    larger = sum(len(polygon) > 3 for polygon in polygons)
    return {"faces": len(polygons) - larger, "polygons": larger, "vertices": vertices}


def _joined(text: str) -> Iterator[tuple[int, str]]:
    """Return the lines of a text with their numbers; one that ends in a backslash goes on in the next."""
    first, before = 1, ""
    for number, line in enumerate(text.splitlines(), start=1):
        if not before:
            first = number
        if line.endswith("\\"):
            before += line[:-1] + " "
            continue
        yield first, before + line
        before = ""
    if before:
        yield first, before


def _check_statements(lines: list[_Line], *, name: str) -> None:
    """Refuse statements that may change the surface and are not read here."""
    known = {"v", *_OBJ_FACES, *_OBJ_SKIPPED, *(keyword for keyword, _ in _OBJ_NAMES)}
    for number, words in lines:
        if words[0] in known:
            continue
        if words[0] in _OBJ_REFUSED:
            raise InputError(
                f"`{name}` line {number}: `{words[0]}` belongs to curved surfaces or other files, only faces (`f`) are "
                "read; export it as a mesh of polygons.",
                line=number,
            )
        raise InputError(
            f"`{name}` line {number}: {words[0][:40]!r} is no statement of OBJ, so nobody can say what it changes; "
            "take the line out if it may be left out, or export the mesh again.",
            line=number,
        )


def _obj_regions(lines: list[_Line], triangles: IntArray) -> Regions:
    """Return the regions of triangles, given the line of each."""
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
        (n, 3) vertices in the file's unit and (m, 3) faces; polygons are triangulated.

    Raises:
        InputError: the keyword or the counts are missing, the file ends before what they promise, a line cannot be
            read or stands behind them, a face has fewer than three corners or refers to a vertex that is not there,
            or a polygon crosses itself.
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
    surplus = body[vertex_count + face_count :]
    if surplus:
        raise InputError(
            f"`{name}` line {surplus[0][0]} stands behind the {vertex_count} vertices and {face_count} faces that its "
            "header promises; the header does not belong to it, so export it again.",
            line=surplus[0][0],
        )
    vertices = _parse(body[:vertex_count], _position, name=name)
    face_lines = body[vertex_count:]
    polygons = _parse(face_lines, _off_corners, name=name)
    mesh = _mesh(vertices, polygons, name=name)[0]
    skipped = {
        "vertices' colours or normals": sum(len(words) > 3 for _, words in body[:vertex_count]),
        "face colours": sum(len(words) > len(p) + 1 for (_, words), p in zip(face_lines, polygons, strict=True)),
    }
    told = reading(used=_used(polygons, len(vertices)), skipped=skipped)
    return replace(mesh, step=written_step(data, mesh.vertices), reading=told)


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
    x, y, z, *_ = map(float, words)
    return x, y, z


def _obj_position(words: list[str]) -> tuple[float, float, float]:
    """Return the place of `v x y z`, perhaps with a weight of 1 or a colour behind."""
    numbers = [float(word) for word in words[1:]]
    if len(numbers) not in {3, 4, 6, 7} or (len(numbers) == 4 and numbers[3] != 1.0):
        raise ValueError(words)
    return numbers[0], numbers[1], numbers[2]


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


def _mesh(
    vertices: list[tuple[float, float, float]], polygons: list[list[int]], *, name: str
) -> tuple[MeshFile, IntArray]:
    """Return the mesh of polygons, and which polygon each triangle comes from."""
    positions = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    sizes = np.array([len(polygon) for polygon in polygons], dtype=np.int64)
    corners = np.array([corner for polygon in polygons for corner in polygon], dtype=np.int64)
    cut = triangulated(positions, sizes, corners, name=name)
    return MeshFile(positions, cut.faces), cut.polygon
