"""Reading STL files, binary or text, whose triangles say how many they are or how they end."""

from __future__ import annotations

import re

import numpy as np

from geoprint.errors import InputError
from geoprint.model import reading
from geoprint.surfaces.files.mesh_file import MeshFile, single_step, written_step
from geoprint.surfaces.files.regions import Regions, named

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
        told = reading(used={"faces": len(faces)}, skipped=skipped)
        return MeshFile(vertices, faces, step=single_step(vertices), reading=told)
    # Bytes that are not UTF-8 can only stand in names.
    text = data.decode("utf-8-sig", errors="replace")
    if text[:1000].lstrip()[:5].lower() == "solid" and re.search("facet|endsolid", text, re.IGNORECASE):
        return _read_text(text, data, name=name)
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


def _read_text(text: str, data: bytes, *, name: str) -> MeshFile:
    """Read a text file: solids of facets."""
    lines = list(_SOLID.finditer(text))
    starts = [found for found in lines if not found[1]]
    if len(starts) != len(lines) - len(starts):
        raise InputError(
            f"`{name}` begins {len(starts)} solids and ends {len(lines) - len(starts)}; it is cut off, so copy or "
            "export it again."
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
    told = reading(used={"faces": len(faces), "solids": len(starts)}, skipped={"facet normals": len(faces)})
    return MeshFile(vertices, faces, regions=regions, step=written_step(data, vertices), reading=told)


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
        f"`{name}` line {line}: facet {facet + 1} is not a facet of three corners (facet normal, outer loop, three "
        "times vertex, endloop, endfacet); it is cut off or damaged, so copy or export it again.",
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
