"""Reading PLY files: meshes of polygons, triangle strips or range grids, and clouds of points.

What the header promises is compared with the length of the file before anything is read, and all that the file holds
must be what the header explains. Elements and properties that cannot change the surface are skipped and recorded; one
that may, such as cells of a solid, is refused.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from geoprint.errors import InputError, how_many
from geoprint.geometry.files.mesh_file import (
    Check,
    MeshFile,
    labelled_faces,
    origin_of,
    restored,
    single_step,
    written_step,
)
from geoprint.geometry.files.optional_readers import read_cloud_ply
from geoprint.geometry.files.text_formats import triangulated
from geoprint.model import FloatArray, IntArray, reading

# numpy's types of the numbers in a file, without their byte order.
PLY_TYPES = {
    "char": "i1", "uchar": "u1", "int8": "i1", "uint8": "u1", "short": "i2", "ushort": "u2", "int16": "i2",
    "uint16": "u2", "int": "i4", "uint": "u4", "int32": "i4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
# Numbers in text are read as these.
_WRITTEN = np.dtype("<f8")
# What the list of vertices of a face, strip or grid cell is called.
_CORNERS = ("vertex_indices", "vertex_index")
# Elements that are surfaces, and those that never are.
_SURFACES = ("face", "tristrips", "range_grid")
_NO_SURFACES = ("edge", "material", "camera")
# Starts a new strip in a list of strips.
_NEW_STRIP = -1
# Cells of a range grid with edges this many times the median edge span the step between a front and what lies behind.
DEPTH_STEP = 6.0

# Where a property of each row stands: evenly, or anywhere [bytes].
_Places: TypeAlias = "range | IntArray"
# The type of the numbers of each property, and of its count where it is a list.
_Kinds: TypeAlias = "list[tuple[np.dtype[np.generic], np.dtype[np.generic] | None]]"


class Property(NamedTuple):
    """A property of an element: its name, the type of its numbers, and of its count where it is a list."""

    name: str
    kind: str
    length: str | None


@final
@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """Rows of one kind as the header describes them; where they are read, what they hold.

    Attributes:
        name: of the kind.
        count: of rows.
        properties: of each row.
        numbers: (count,) values of each property that is no list.
        lists: of the others: (count,) lengths, and the values of all rows end to end.
    """

    name: str
    count: int
    properties: tuple[Property, ...]
    numbers: Mapping[str, NDArray[np.generic]]
    lists: Mapping[str, tuple[IntArray, NDArray[np.generic]]]


@final
@dataclass(frozen=True, slots=True, eq=False)
class PlyFile:
    """A PLY file as it was read.

    Attributes:
        form: ascii, binary_little_endian or binary_big_endian.
        elements: by name, in the order of the file.
        infos: words of the lines `obj_info`.
        comments: lines of comments.
        header: up to the word that ends it.
        body: what follows.
    """

    form: str
    elements: Mapping[str, Element]
    infos: tuple[tuple[str, ...], ...]
    comments: int
    header: bytes
    body: bytes


def read_ply(data: bytes, /, *, name: str, check: Check | None = None) -> MeshFile:
    """Read a PLY file; where it holds points alone, a surface is put through them.

    Args:
        data: content of the file.
        name: what messages call it.
        check: is asked whether points have a size that can be right.

    Returns:
        Vertices and triangles; the values of integer properties are regions. A mesh that geoprint stored is the one
        that it had read.

    Raises:
        InputError: the header is not one, has a line that is not understood, or promises more or less than the file
            holds.
    """
    described = read_header(data, name=name)
    if _points_alone(described):
        return read_cloud_ply(data, name=name, check=check)
    _, origin = origin_of(described.header, data[len(described.header) + len(b"end_header") :])
    file = read_elements(described, name=name)
    vertices = positions(file, name=name)
    made = _made(file, vertices, name=name)
    faces = np.concatenate([each.faces for each in made])
    mesh = MeshFile(vertices, faces, step=_step(file, vertices))
    # Labels are told of faces alone; strips and grids have none.
    of_faces = _integers(file, "face") if len(made) == 1 else {}
    of_faces = {key: values[made[0].row] for key, values in of_faces.items()}
    if origin is not None:
        return restored(mesh, origin, next(iter(of_faces.values()), None))
    regions = labelled_faces(faces, of_faces=of_faces, of_vertices=_integers(file, "vertex"))
    used = {kind: count for each in made for kind, count in each.used.items()}
    skipped = {kind: count for each in made for kind, count in each.skipped.items()} | _skipped(file, regions)
    record = reading(
        used={**used, "vertices": len(vertices)},
        skipped=skipped,
        assumed=[said for each in made for said in each.assumed],
    )
    return replace(mesh, regions=regions, reading=record)


def holds_points_alone(data: bytes) -> bool:
    """Return whether a PLY file holds vertices and no surface; of no PLY file that is not so."""
    try:
        return _points_alone(read_header(data, name="file"))
    except InputError:
        return False


def _points_alone(described: PlyFile) -> bool:
    counts = {name: element.count for name, element in described.elements.items()}
    return counts.get("vertex", 0) > 0 and not any(counts.get(surface) for surface in _SURFACES)


def read_header(data: bytes, *, name: str) -> PlyFile:
    """Return what the header of a PLY file describes; the body is not read.

    Raises:
        InputError: it is no header of PLY 1.0, a line is not understood, or a name stands twice.
    """
    end = re.search(rb"(?:\A|[\r\n])end_header[ \t]*(\r\n|\n|\r|\Z)", data)
    first = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
    if end is None or first is None:
        raise InputError(f"`{name}` does not begin with a PLY header; it is not a PLY file, so export the mesh again.")
    # A carriage return alone ends the lines of some files; what follows it then belongs to the body.
    after = end.start(1) + len(first[1]) if data.startswith(first[1], end.start(1)) else end.end(1)
    header = data[: data.index(b"end_header", end.start())]
    form, infos, comments = "", list[tuple[str, ...]](), 0
    rows: list[tuple[str, int, list[Property]]] = []
    for number, line in enumerate(header.decode("ascii", errors="replace").splitlines()[1:], start=2):
        match line.split():
            case ["comment", *_] | []:
                comments += bool(line.split())
            case ["obj_info", *words]:
                infos.append(tuple(words))
            case ["format", kind, "1.0"] if kind in _ORDERS and not form:
                form = kind
            case ["element", kind, count] if count.isdecimal() and _is_new(kind, (row[0] for row in rows)):
                rows.append((kind, int(count), []))
            case ["property", "list", count, kind, label] if (
                rows and PLY_TYPES.get(count, "f")[0] != "f" and kind in PLY_TYPES and _is_new(label, _labels(rows))
            ):
                rows[-1][2].append(Property(label, kind, count))
            case ["property", kind, label] if rows and kind in PLY_TYPES and _is_new(label, _labels(rows)):
                rows[-1][2].append(Property(label, kind, None))
            case _:
                raise InputError(
                    f"`{name}` line {number} of its header cannot be read: {line[:60]!r}. It is not a PLY 1.0 "
                    "statement, or repeats a name: export the mesh again.",
                    line=number,
                )
    if not form:
        raise InputError(f"`{name}` does not say its format (ascii 1.0 or the like); export the mesh again.")
    elements = {kind: Element(kind, count, tuple(properties), {}, {}) for kind, count, properties in rows}
    return PlyFile(form, elements, tuple(infos), comments, header, data[after:])


def read_elements(described: PlyFile, *, name: str) -> PlyFile:
    """Return a PLY file with the values of all of its elements.

    Raises:
        InputError: the body holds more or less than the header promises, or a value that its type cannot hold.
    """
    text = described.form == "ascii"
    _check_promise(described, found=len(described.body.split()) if text else len(described.body), name=name)
    body = _numbers(described.body, name=name) if text else described.body
    at, elements = 0, dict[str, Element]()
    for element in described.elements.values():
        elements[element.name], at = _read_element(element, body, at, form=described.form, name=name)
    if body[at:] if text else body[at:].strip():
        raise InputError(
            f"`{name}` holds {_units(len(body) - at, text=text)} behind the last element that its header announces; "
            "the header does not belong to it, so export the mesh again.",
            surplus=len(body) - at,
        )
    return replace(described, elements=elements)


def positions(file: PlyFile, *, name: str, axes: tuple[str, str, str] = ("x", "y", "z")) -> FloatArray:
    """Return (n, 3) numbers of the vertices of a file that was read.

    Raises:
        InputError: they are not there.
    """
    vertex = file.elements.get("vertex")
    if vertex is None or not set(axes) <= set(vertex.numbers):
        raise InputError(f"`{name}` has no vertices with x, y and z as plain numbers; export the mesh again.")
    return np.column_stack([vertex.numbers[axis] for axis in axes]).astype(np.float64, copy=False)


def _labels(rows: list[tuple[str, int, list[Property]]]) -> list[str]:
    return [each.name for each in rows[-1][2]]


def _is_new(label: str, others: Iterable[str]) -> bool:
    """Return whether a name can be printed and stands for the first time."""
    return label.isprintable() and label not in set(others)


def _units(size: int, *, text: bool) -> str:
    return f"{size // _WRITTEN.itemsize} numbers" if text else f"{size} bytes"


def _check_promise(described: PlyFile, *, found: int, name: str) -> None:
    """Refuse a header that promises more than the file holds, before anything is made for it."""
    text, least, counts = described.form == "ascii", 0, list[str]()
    for element in described.elements.values():
        row = sum(_least(each, surface=element.name == "face", text=text) for each in element.properties)
        least += element.count * row
        counts.append(f"{element.count} of `{element.name[:40]}`")
    if found < least:
        raise InputError(
            f"`{name}` promises {' and '.join(counts)} in its header, at least {least} "
            f"{'numbers' if text else 'bytes'}, but holds {found}; it is cut off or damaged, so copy or export it "
            "again.",
            promised=least,
            found=found,
        )
    if not counts or not described.elements.get("vertex", _NOTHING).count:
        raise InputError(
            f"`{name}` holds {', '.join(counts) or 'nothing'}; a surface needs vertices and triangles, so export it as "
            "a mesh."
        )


_NOTHING = Element("", 0, (), {}, {})


def _least(one: Property, *, surface: bool, text: bool) -> int:
    """Return how many bytes, or numbers of a text, a property takes at least."""
    size = 1 if text else np.dtype(PLY_TYPES[one.kind]).itemsize
    if one.length is None:
        return size
    # A face has three corners at least; other lists may be empty.
    corners = 3 if surface and one.name in _CORNERS else 0
    return (1 if text else np.dtype(PLY_TYPES[one.length]).itemsize) + corners * size


def _numbers(body: bytes, *, name: str) -> bytes:
    """Return the numbers of a text as bytes of _WRITTEN each."""
    words = body.split()
    values = np.empty(len(words), dtype=_WRITTEN)
    place = -1
    try:
        for place, word in enumerate(words):
            # Python reads underlines between digits, nobody else does.
            values[place] = float(word if b"_" not in word else b"")
    except ValueError as error:
        shown = words[place][:40].decode("ascii", errors="replace")
        raise InputError(
            f"`{name}`: {shown!r} stands where a number must, {place + 1} words behind the header; it is damaged, so "
            "export the mesh again."
        ) from error
    return values.tobytes()


def _read_element(element: Element, body: bytes, at: int, *, form: str, name: str) -> tuple[Element, int]:
    """Return an element with its values, and where the next one begins."""

    def kind_of(word: str) -> np.dtype[np.generic]:
        return _WRITTEN if form == "ascii" else np.dtype(_ORDERS[form] + PLY_TYPES[word])

    kinds = [(kind_of(each.kind), None if each.length is None else kind_of(each.length)) for each in element.properties]
    places, end = _places(element, body, at, kinds, order=_ORDERS[form], name=name)
    numbers: dict[str, NDArray[np.generic]] = {}
    lists: dict[str, tuple[IntArray, NDArray[np.generic]]] = {}
    for each, (kind, of_count), where in zip(element.properties, kinds, places, strict=True):
        if of_count is None:
            values = _taken(body, where, kind)[:, 0]
            numbers[each.name] = _as_declared(values, each, form=form, name=name)
            continue
        lengths = _taken(body, where, of_count)[:, 0].astype(np.int64)
        starts = np.asarray(where, dtype=np.int64) + of_count.itemsize
        if isinstance(where, range) and lengths.size:
            behind = range(where.start + of_count.itemsize, where.stop + of_count.itemsize, where.step)
            values = _taken(body, behind, kind, items=int(lengths[0])).reshape(-1)
        else:
            inner = np.arange(int(lengths.sum())) - np.repeat(np.cumsum(lengths) - lengths, lengths)
            values = _taken(body, np.repeat(starts, lengths) + inner * kind.itemsize, kind)[:, 0]
        lists[each.name] = lengths, _as_declared(values, each, form=form, name=name)
    return replace(element, numbers=numbers, lists=lists), end


def _places(
    element: Element, body: bytes, at: int, kinds: _Kinds, *, order: str, name: str
) -> tuple[list[_Places], int]:
    """Return where each property of the rows of an element stands, and where the element ends."""
    if element.count == 0 or not kinds:
        return [range(0) for _ in kinds], at
    counters = [None if of_count is None else struct.Struct(order + of_count.char) for _, of_count in kinds]

    def row_at(start: int) -> tuple[list[int], int]:
        found: list[int] = []
        for (kind, of_count), counter in zip(kinds, counters, strict=True):
            found.append(start)
            if of_count is None or counter is None:
                start += kind.itemsize
                continue
            start += of_count.itemsize
            length = counter.unpack_from(body, start - of_count.itemsize)[0] if start <= len(body) else -1
            if not (length >= 0 and length == length // 1 and length * kind.itemsize <= len(body) - start):
                raise InputError(
                    f"`{name}`: a list of element `{element.name[:40]}` has the length {length:g} or runs past the "
                    "end of the file. It is cut off or damaged: copy or export it again."
                )
            start += int(length) * kind.itemsize
        return found, start

    first, second = row_at(at)
    even = [range(start, start + (second - at) * element.count, second - at) for start in first]
    if at + (second - at) * element.count <= len(body) and _same_lengths(body, even, kinds):
        return list(even), at + (second - at) * element.count
    rows: list[list[int]] = []
    for _ in range(element.count):
        row, at = row_at(at)
        rows.append(row)
    if at > len(body):
        raise InputError(f"`{name}` ends within element `{element.name[:40]}`; it is cut off, so copy it again.")
    return list(np.array(rows, dtype=np.int64).T), at


def _same_lengths(body: bytes, places: list[range], kinds: _Kinds) -> bool:
    """Return whether the lists of all rows are as long as those of the first."""
    lengths = [
        _taken(body, where, of_count)
        for (_, of_count), where in zip(kinds, places, strict=True)
        if of_count is not None
    ]
    return all(bool((each == each[0]).all()) for each in lengths)


def _taken(body: bytes, where: _Places, kind: np.dtype[np.generic], *, items: int = 1) -> NDArray[np.generic]:
    """Return (count, items) numbers that stand at places in the body; of uneven places one each."""
    if isinstance(where, range):
        return np.ndarray((len(where), items), kind, body, where.start, (where.step, kind.itemsize))
    raw = np.frombuffer(body, np.uint8)
    return raw[where[:, None] + np.arange(kind.itemsize)].copy().view(kind)


def _as_declared(values: NDArray[np.generic], one: Property, *, form: str, name: str) -> NDArray[np.generic]:
    """Return numbers of the type that the header declares; those of a text are compared with it."""
    kind = np.dtype(PLY_TYPES[one.kind])
    if form != "ascii":
        return values
    if kind.kind == "f":
        # Text is as precise as its decimals, whatever the header calls it.
        return values
    limits, found = np.iinfo(kind), values.astype(np.float64, copy=False)
    with np.errstate(invalid="ignore"):
        wrong = ~((found == np.floor(found)) & (found >= limits.min) & (found <= limits.max))
    if wrong.any():
        raise InputError(
            f"`{name}` holds {found[wrong][0]:g} as `{one.name[:40]}`, its header declares {one.kind}; it "
            "does not belong to it, or a number is missing: export the mesh again."
        )
    return found.astype(np.int64)


def _made(file: PlyFile, vertices: FloatArray, *, name: str) -> list[_Made]:
    """Return the triangles of each kind of surface that the file holds."""
    unknown = [
        element.name
        for element in file.elements.values()
        if element.name not in {"vertex", *_SURFACES, *_NO_SURFACES}
        and element.count
        and any("ind" in key.lower() or "vert" in key.lower() for key in (*element.lists, *element.numbers))
    ]
    if unknown:
        raise InputError(
            f"`{name}` has the element `{unknown[0][:40]}`, which refers to vertices but is no surface that PLY knows "
            f"({', '.join(_SURFACES)}); export its surface as faces."
        )
    makers: Mapping[str, Callable[[PlyFile, Element, FloatArray, str], _Made]] = {
        "face": _of_polygons, "tristrips": _of_strips, "range_grid": _of_grid,
    }  # fmt: skip
    return [
        makers[kind](file, file.elements[kind], vertices, name)
        for kind in _SURFACES
        if kind in file.elements and file.elements[kind].count
    ]


class _Made(NamedTuple):
    """Triangles of one element, the row of each, and what was used, skipped and assumed."""

    faces: IntArray
    row: IntArray
    used: Mapping[str, int]
    skipped: Mapping[str, int] = MappingProxyType({})
    assumed: tuple[str, ...] = ()


def _corners(element: Element, *, name: str) -> tuple[IntArray, IntArray]:
    """Return lengths and values of the list of vertices of an element."""
    found = [element.lists[key] for key in _CORNERS if key in element.lists]
    if len(found) != 1:
        raise InputError(
            f"`{name}` has {how_many(len(found), 'list')} of vertices in element `{element.name}` "
            f"({' or '.join(_CORNERS)}); one is needed: export the mesh again."
        )
    return found[0][0], found[0][1].astype(np.int64)


def _of_polygons(_file: PlyFile, element: Element, vertices: FloatArray, name: str) -> _Made:
    """Return the triangles of faces."""
    sizes, corners = _corners(element, name=name)
    if sizes.size and sizes.min() < 3:
        raise InputError(
            f"`{name}`: face {int(np.argmin(sizes))} has {int(sizes.min())} corners, a face has three at least; export "
            "the mesh again."
        )
    cut = triangulated(vertices, sizes, corners, name=name)
    polygons = int((sizes > 3).sum())
    used = {"faces": int(sizes.size) - polygons, "polygons": polygons}
    return _Made(cut.faces, cut.polygon, used)


def _of_strips(_file: PlyFile, element: Element, _vertices: FloatArray, name: str) -> _Made:
    """Return the triangles of strips: each corner makes one with the two before it, wound the other way in turn."""
    lengths, corners = _corners(element, name=name)
    row = np.repeat(np.arange(lengths.size), lengths)
    breaks = corners == _NEW_STRIP
    # Where the strip of each corner begins: behind a break, or with its list.
    fresh = np.concatenate([[True], breaks[:-1] | (row[1:] != row[:-1])]) if corners.size else breaks
    start = np.maximum.accumulate(np.where(fresh, np.arange(corners.size), 0))
    place = np.arange(corners.size) - start
    last = np.flatnonzero((place >= 2) & ~breaks)
    odd = place[last] % 2 == 1
    faces = np.column_stack([corners[last - 2], corners[last - 1], corners[last]])
    faces[odd] = faces[odd][:, [1, 0, 2]]
    # Strips are joined by triangles that name a corner twice.
    real = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    used = {"faces of triangle strips": int(real.sum())}
    return _Made(faces[real], row[last][real], used)


def _of_grid(file: PlyFile, element: Element, vertices: FloatArray, name: str) -> _Made:
    """Return the triangles of a range grid: of each cell whose corners were seen, but for steps in depth."""
    sizes = {words[0]: int(words[1]) for words in file.infos if len(words) == 2 and words[1].isdecimal()}
    columns, rows = sizes.get("num_cols", 0), sizes.get("num_rows", 0)
    lengths, corners = _corners(element, name=name)
    if columns * rows != element.count or not columns or lengths.max(initial=0) > 1:
        raise InputError(
            f"`{name}` has a range grid of {element.count} places with up to {int(lengths.max(initial=0))} vertices "
            f"each. Its `obj_info` states {columns} columns (num_cols) and {rows} rows (num_rows): export the mesh "
            "again."
        )
    grid = np.full(element.count, -1, dtype=np.int64)
    grid[lengths == 1] = corners
    grid = grid.reshape(rows, columns)
    if grid.max() >= len(vertices) or (corners < 0).any():
        raise InputError(f"`{name}` has a range grid that refers to a vertex which is not there; export it again.")
    a, b, c, d = (grid[i : rows - 1 + i, j : columns - 1 + j].ravel() for i, j in ((0, 0), (0, 1), (1, 1), (1, 0)))
    along = np.linalg.norm(vertices[a] - vertices[c], axis=1) <= np.linalg.norm(vertices[b] - vertices[d], axis=1)
    # The shorter diagonal, or the one whose ends were seen.
    along = np.where((a < 0) | (c < 0), False, np.where((b < 0) | (d < 0), True, along))  # noqa: FBT003
    first = np.where(along[:, None], np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    second = np.where(along[:, None], np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    faces = np.stack([first, second], axis=1).reshape(-1, 3)
    faces = faces[(faces >= 0).all(axis=1)]
    edges = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, -1, axis=1)], axis=2).max(axis=1, initial=0.0)
    near = edges <= DEPTH_STEP * np.median(edges) if len(edges) else np.zeros(0, dtype=np.bool_)
    faces = faces[near]
    corners3 = vertices[faces]
    heights = np.cross(corners3[:, 1] - corners3[:, 0], corners3[:, 2] - corners3[:, 0])[:, 2]
    if heights.sum() < 0.0:
        faces = faces[:, ::-1]
    return _Made(
        faces,
        np.zeros(len(faces), dtype=np.int64),
        used={"faces of a range grid": len(faces)},
        skipped={"faces across steps in depth": int((~near).sum())},
        assumed=("a scanner that looks against z",),
    )


def _integers(file: PlyFile, element: str) -> dict[str, IntArray]:
    """Return the integer properties of an element that are no lists."""
    found = file.elements.get(element, _NOTHING)
    whole = {each.name for each in found.properties if PLY_TYPES[each.kind][0] in "iu"}
    return {key: values.astype(np.int64) for key, values in found.numbers.items() if key in whole}


def _skipped(file: PlyFile, regions: Mapping[str, object]) -> dict[str, int]:
    """Return how much of what the file holds was not used, by kind."""
    kept = {
        "x",
        "y",
        "z",
        *_CORNERS,
        *(key.split("=")[0].removeprefix("face ").removeprefix("vertex ") for key in regions),
    }
    skipped: dict[str, int] = {}
    for element in file.elements.values():
        if element.name not in {"vertex", *_SURFACES}:
            skipped[f"of `{element.name[:40]}`"] = element.count
        else:
            others = [each.name[:20] for each in element.properties if each.name not in kept]
            skipped[f"properties of `{element.name}` ({', '.join(others)})"] = len(others)
    return skipped | {"comments": file.comments + len(file.infos)}


def _step(file: PlyFile, vertices: FloatArray) -> float:
    """Return the step between neighbouring numbers that the file can hold."""
    if file.form == "ascii":
        return written_step(file.body, vertices)
    kinds = [each.kind for each in file.elements["vertex"].properties if each.name in {"x", "y", "z"}]
    return single_step(vertices) if any(PLY_TYPES[kind] == "f4" for kind in kinds) else 0.0
