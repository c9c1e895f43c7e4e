"""Reading STL, OBJ and OFF files, and cutting their polygons into triangles."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np

from geoprint.errors import InputError, how_many
from geoprint.geometry.files.mesh_file import (
    MeshFile,
    Regions,
    check_indices,
    named,
    single_step,
    together,
    written_step,
)
from geoprint.geometry.operators import doubled_area_vectors
from geoprint.model import FloatArray, IntArray, reading

# Polygons of mesh files cut into triangles: convex ones into fans, others by their ears.
#
# A polygon of n corners always becomes n - 2 triangles, corners in line with their neighbours among them: its edges
# stay those of the faces next to it.


# The triangles of a polygon cover its area, seen along its normal, but for this share.
AREA_TOLERANCE = 1e-6


class Triangles(NamedTuple):
    """The triangles of polygons.

    Attributes:
        faces: (m, 3) vertex indices, polygon by polygon.
        polygon: (m,) which polygon each comes from.
        concave: how many polygons are not convex.
    """

    faces: IntArray
    polygon: IntArray
    concave: int


def triangulated(vertices: FloatArray, sizes: IntArray, corners: IntArray, *, name: str) -> Triangles:
    """Cut polygons into triangles.

    Args:
        vertices: (n, 3).
        sizes: (p,) corners of each polygon, 3 or more.
        corners: vertex indices of all polygons, end to end.
        name: of the file.

    Raises:
        InputError: a corner is no vertex, or a polygon crosses itself.
    """
    starts = np.cumsum(sizes) - sizes
    polygon = np.repeat(np.arange(sizes.size), sizes - 2)
    places = np.arange(polygon.size) - np.repeat(np.cumsum(sizes - 2) - (sizes - 2), sizes - 2)
    first = starts[polygon]
    faces = np.column_stack([corners[first], corners[first + places + 1], corners[first + places + 2]])
    check_indices(faces, vertices=len(vertices), name=name)
    if polygon.size == sizes.size:
        return Triangles(faces, polygon, 0)
    with np.errstate(invalid="ignore", over="ignore"):  # the caller refuses what is not finite
        areas = doubled_area_vectors(vertices, faces)
        total = np.column_stack([np.bincount(polygon, areas[:, axis]) for axis in range(3)])
        # A fan whose triangles do not all face to the same side would overlap itself.
        turned = np.bincount(polygon, np.einsum("mx,mx->m", areas, total[polygon]) < 0) > 0
        # The halves of a bow tie outweigh each other.
        turned |= np.linalg.norm(total, axis=1) < AREA_TOLERANCE * np.bincount(polygon, np.linalg.norm(areas, axis=1))
    overlapping = np.flatnonzero(turned)
    for number, row in zip(overlapping.tolist(), np.searchsorted(polygon, overlapping).tolist(), strict=True):
        ring = corners[starts[number] : starts[number] + sizes[number]]
        cut = _by_ears(vertices[ring], total[number])
        if cut is None:
            raise InputError(
                f"`{name}`: a polygon of {ring.size} corners crosses itself, the first at "
                f"{vertices[ring[0]].tolist()}: triangulate the mesh in the program that made it.",
                polygon=number,
            )
        faces[row : row + ring.size - 2] = ring[cut]
    return Triangles(faces, polygon, overlapping.size)


def _by_ears(ring: FloatArray, normal: FloatArray) -> IntArray | None:
    """Return (k - 2, 3) triangles of (k, 3) corners, or None where they do not make one polygon.

    Args:
        ring: corners in their order.
        normal: of the polygon, of any length above 0.
    """
    import mapbox_earcut  # here, because few files need it

    length = float(np.linalg.norm(normal))
    if not (np.isfinite(ring).all() and length > 0.0):
        return None
    across = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(normal, across)
    first /= np.linalg.norm(first)
    flat = np.ascontiguousarray(np.column_stack([ring @ first, ring @ np.cross(normal / length, first)]))
    flat -= flat[0]
    ends = np.array([len(ring)], dtype=np.uint32)
    ears = np.asarray(mapbox_earcut.triangulate_float64(flat, ends), dtype=np.int64).reshape(-1, 3)
    if len(ears) == 0:
        return None
    # Corners in line with their neighbours make no ear; they get triangles without area.
    kept = np.unique(ears)
    flats = [
        (before, between, between + 1)
        for before, after in pairwise([*kept.tolist(), int(kept[0]) + len(ring)])
        for between in range(before + 1, after)
    ]
    cut = np.concatenate([ears, np.array(flats, dtype=np.int64).reshape(-1, 3) % len(ring)])
    a, b, c = (flat[cut[:, corner]] for corner in range(3))
    doubled = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    # The library winds its triangles its own way.
    if doubled.sum() < 0.0:
        cut[: len(ears)] = cut[: len(ears), ::-1]
        doubled[: len(ears)] *= -1.0
    allowed = AREA_TOLERANCE * length
    sound = len(cut) == len(ring) - 2 and doubled.min() >= -allowed
    return cut if sound and abs(doubled.sum() - length) <= allowed and _bounded_by(cut, len(ring)) else None


def _bounded_by(cut: IntArray, corners: int) -> bool:
    """Return whether triangles meet edge to edge, and leave just the edges of the ring."""
    halves = {(int(one), int(other)) for face in cut for one, other in zip(face, np.roll(face, -1), strict=True)}
    open_ = {(one, other) for one, other in halves if (other, one) not in halves}
    return len(halves) == 3 * len(cut) and open_ == {(at, (at + 1) % corners) for at in range(corners)}


# Reading OBJ and OFF, the two mesh formats that are lists of numbers in lines of text.
#
# They are read here rather than by trimesh, which misreads relative OBJ indices, a byte order mark and OFF comments
# without a word.


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
            f"`{name}` line {number}: {words[0][:40]!r} is not an OBJ statement, so its effect is unknown. Remove the "
            "line if it is not needed, or export the mesh again.",
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
            f"`{name}` promises {vertex_count} vertices and {face_count} faces, but has only "
            f"{how_many(len(body), 'line')} of them. It is cut off: copy or export it again.",
            promised=vertex_count + face_count,
            found=len(body),
        )
    surplus = body[vertex_count + face_count :]
    if surplus:
        raise InputError(
            f"`{name}` line {surplus[0][0]} follows the {vertex_count} vertices and {face_count} faces that its "
            "header promises. The header does not match: export it again.",
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
    record = reading(used=_used(polygons, len(vertices)), skipped=skipped)
    return replace(mesh, step=written_step(data, mesh.vertices), reading=record)


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
            f"`{name}` line {number} cannot be read: `{' '.join(words)[:60]}`. A position is three numbers with "
            "decimal points, a face at least three vertices: export it again.",
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


# Reading STL files, binary or text, whose triangles say how many they are or how they end.


STL_HEADER_BYTES = 84
STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
STL_TRIANGLE_BYTES = STL_TRIANGLE.itemsize
# The words of a facet of a text file; None for the numbers of its normal and of its corners.
_VERTEX = ("vertex", None, None, None)
_FACET = ("facet", "normal", None, None, None, "outer", "loop", *_VERTEX, *_VERTEX, *_VERTEX, "endloop", "endfacet")
_WORDS = {place: word for place, word in enumerate(_FACET) if word is not None}
_CORNERS = [8, 9, 10, 12, 13, 14, 16, 17, 18]
# A solid begins and ends with a line that names it.
_SOLID = re.compile(r"^[ \t]*(end[ \t]*)?solid\b([^\r\n]*)", re.IGNORECASE | re.MULTILINE)
# No word or number of a file is longer [letters].
LONGEST_WORD = 100


def read_stl(data: bytes, /, *, name: str) -> MeshFile:
    """Read an STL file, binary if its length is what its count says and ASCII otherwise.

    A binary header may begin with 'solid' all the same.

    Args:
        data: content of the file.
        name: what messages call it.

    Returns:
        Three vertices for each triangle, not joined; the solids of an ASCII file are regions.

    Raises:
        InputError: it is neither, its length disagrees with the count, or a facet is none.
    """
    announced = int.from_bytes(data[80:STL_HEADER_BYTES], "little")
    if len(data) == STL_HEADER_BYTES + STL_TRIANGLE_BYTES * announced:
        triangles = np.frombuffer(data, dtype=STL_TRIANGLE, offset=STL_HEADER_BYTES)
        vertices = triangles["corners"].reshape(-1, 3).astype(np.float64)
        vertices.setflags(write=False)
        faces = np.arange(len(vertices)).reshape(-1, 3)
        skipped = {
            "facet normals": int(triangles["normal"].any(axis=1).sum()),
            "facet attributes": int((triangles["attributes"] != 0).sum()),
        }
        record = reading(used={"faces": len(faces)}, skipped=skipped)
        return MeshFile(vertices, faces, step=single_step(vertices), reading=record)
    # Bytes that are not UTF-8 can only stand in names.
    text = data.decode("utf-8-sig", errors="replace")
    if text[:1000].lstrip()[:5].lower() == "solid" and re.search("facet|endsolid", text, re.IGNORECASE):
        return _read_text(text, data, name=name)
    if len(data) < STL_HEADER_BYTES or data[:1] == b"<":
        raise InputError(
            f"`{name}` is not an STL file: {how_many(len(data), 'byte')} that do not begin with `solid`; look into it "
            "with an editor and export the mesh again."
        )
    raise InputError(
        f"`{name}` announces {announced} triangles, {STL_HEADER_BYTES + STL_TRIANGLE_BYTES * announced} bytes as "
        f"binary STL, but holds {how_many(len(data), 'byte')}. It is cut off or damaged: copy or export it again.",
        announced=announced,
        bytes=len(data),
    )


def _read_text(text: str, data: bytes, *, name: str) -> MeshFile:
    """Read a text file: solids of facets."""
    lines = list(_SOLID.finditer(text))
    starts = [found for found in lines if not found[1]]
    if len(starts) != len(lines) - len(starts):
        raise InputError(
            f"`{name}` begins {how_many(len(starts), 'solid')} and ends {len(lines) - len(starts)}. It is cut off: "
            "copy or export it again."
        )
    words: list[str] = []
    firsts: list[int] = []
    at = 0
    for found in lines:
        words += text[at : found.start()].split()
        at = found.end()
        if not found[1]:
            firsts.append(len(words) // len(_FACET))
    words += text[at:].split()
    table = _facets(words, text, name=name)
    try:
        vertices = table[:, _CORNERS].astype(np.float64).reshape(-1, 3)
    except ValueError as error:
        raise InputError(f"`{name}` has a facet with a word for a number ({error}); export the mesh again.") from error
    names = [found[2].strip() or f"solid {number}" for number, found in enumerate(starts, start=1)]
    faces = np.arange(len(vertices)).reshape(-1, 3)
    regions: Regions = named(names, np.searchsorted(firsts, np.arange(len(faces)), side="right") - 1)
    record = reading(used={"faces": len(faces), "solids": len(starts)}, skipped={"facet normals": len(faces)})
    return MeshFile(vertices, faces, regions=regions, step=written_step(data, vertices), reading=record)


def _facets(words: list[str], text: str, *, name: str) -> np.ndarray[tuple[int, int], np.dtype[np.str_]]:
    """Return the words of a file, a row for each facet."""
    size = len(_FACET)
    whole = len(words) // size
    longest = max(map(len, words), default=0)
    table = np.array(words[: whole * size] if longest <= LONGEST_WORD else [], dtype=np.str_).reshape(-1, size)
    wrong = np.zeros(len(table), dtype=np.bool_)
    for place, word in _WORDS.items():
        wrong |= np.char.lower(table[:, place]) != word
    if len(table) * size == len(words) and not wrong.any():
        return table
    facet = int(np.argmax(wrong)) if wrong.any() else len(table)
    line = _line_of(facet * size, text)
    raise InputError(
        f"`{name}` line {line}: facet {facet + 1} does not have three corners (facet normal, outer loop, three times "
        "vertex, endloop, endfacet). It is cut off or damaged: copy or export it again.",
        line=line,
        facet=facet,
    )


def _line_of(word: int, text: str) -> int:
    """Return the line in which a word stands, those of solids not counted."""
    seen, lines = 0, text.splitlines()
    for number, line in enumerate(lines, start=1):
        seen += 0 if _SOLID.match(line) else len(line.split())
        if seen > word:
            return number
    return len(lines)
