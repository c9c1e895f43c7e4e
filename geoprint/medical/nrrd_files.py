"""Reading NRRD files (.nrrd) with their data inside, segmentations of 3D Slicer (.seg.nrrd) among them [NRRD].

A field of the header is obeyed, is one that changes neither labels nor places and is skipped, or the file is refused
with its line. Segments that overlap lie in layers, a list axis of the grid; the keys `Segment0_Name` and the like say
which value of which layer each segment is, and what it is called.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.errors import InputError, how_many
from geoprint.geometry.files.labelling import GridFile, LabelVolume, Segment, labelled
from geoprint.geometry.files.mesh_file import LONGEST_NAME, Choice, printable
from geoprint.medical.nifti_files import checked_shape, grid_of, unpacked
from geoprint.model import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray


# Headers are lines of text that end with an empty one.
LONGEST_HEADER = 1 << 16
TYPES = {
    "signed char": "i1", "int8": "i1", "int8_t": "i1", "uchar": "u1", "unsigned char": "u1", "uint8": "u1",
    "uint8_t": "u1", "short": "i2", "short int": "i2", "signed short": "i2", "signed short int": "i2", "int16": "i2",
    "int16_t": "i2", "ushort": "u2", "unsigned short": "u2", "unsigned short int": "u2", "uint16": "u2",
    "uint16_t": "u2", "int": "i4", "signed int": "i4", "int32": "i4", "int32_t": "i4", "uint": "u4",
    "unsigned int": "u4", "uint32": "u4", "uint32_t": "u4", "longlong": "i8", "long long": "i8", "int64": "i8",
    "int64_t": "i8", "signed long long": "i8", "ulonglong": "u8", "unsigned long long": "u8", "uint64": "u8",
    "uint64_t": "u8", "float": "f4", "double": "f8",
}  # fmt: skip
UNITS_BY_NAME = {
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("um", "micron", "microns", "micrometer", "micrometers", "micrometre", "micrometres"), "um"),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), "cm"),
    **dict.fromkeys(("in", "inch", "inches"), "in"),
}
_ENCODINGS = {
    "raw": "raw", "gzip": "gzip", "gz": "gzip", "bzip2": "bzip2", "bz2": "bzip2", "ascii": "ascii", "text": "ascii",
    "txt": "ascii", "hex": "hex",
}  # fmt: skip
# The unit of a patient's space where a header says none: that of DICOM, from which such spaces come.
PATIENT_UNIT = "mm"
# Other spellings of fields.
_SPELLINGS = {
    "datafile": "data file", "lineskip": "line skip", "byteskip": "byte skip", "axismins": "axis mins",
    "axismaxs": "axis maxs", "centers": "centerings", "oldmin": "old min", "oldmax": "old max",
    "blocksize": "block size", "sampleunits": "sample units",
}  # fmt: skip
_OBEYED = (
    "type", "dimension", "sizes", "encoding", "endian", "space", "space dimension", "space directions", "space origin",
    "space units", "kinds", "byte skip", "line skip", "spacings",
)  # fmt: skip
_SKIPPED = (
    "content", "number", "min", "max", "sample units", "thicknesses", "centerings", "labels", "units",
    "measurement frame",
)  # fmt: skip
# What each of the others would change.
_REFUSED = {
    "data file": "keeps its data in another file, which is not read; export it as one .nrrd file",
    "block size": "holds blocks of bytes, no numbers; export it as whole numbers",
    "old min": "holds quantised numbers (`old min`), no labels; export the labels themselves",
    "old max": "holds quantised numbers (`old max`), no labels; export the labels themselves",
    "axis mins": "has the place of its grid in `axis mins`; export it with `space origin` and `space directions`",
    "axis maxs": "has the place of its grid in `axis maxs`; export it with `space origin` and `space directions`",
}
_SPACES = {"ras": "right-anterior-superior", "las": "left-anterior-superior", "lps": "left-posterior-superior"}
# Signs that turn a patient's space into right, anterior, superior.
_SIGNS = {
    "right-anterior-superior": (1.0, 1.0, 1.0),
    "left-anterior-superior": (-1.0, 1.0, 1.0),
    "left-posterior-superior": (-1.0, -1.0, 1.0),
}
# Spaces that are nobody's body: their places are taken as they are.
_PLAIN = ("scanner-xyz", "3d-right-handed")
_SEGMENT = re.compile(r"Segment(\d{1,6})_(Name|LabelValue|Layer)")
# Lengths of axes agree within this share with what is said of them elsewhere.
_SAME_LENGTH = 1e-3


@final
@dataclass(frozen=True, slots=True)
class _Header:
    """Fields and keys of a header, and the line of each field."""

    fields: Mapping[str, str]
    lines: Mapping[str, int]
    keys: Mapping[str, str]


def nrrd_labels(data: bytes, /, *, name: str, choice: Choice) -> LabelVolume:
    """Read the labels of an NRRD file; raises as `read_nrrd` and `labelled`."""
    return labelled(read_nrrd(data, name=name), choice, name=name)


def read_nrrd(data: bytes, *, name: str) -> GridFile:
    """Read a NRRD file; coordinates of a patient become right, anterior, superior, as those of NIfTI.

    Raises:
        InputError: it is none, is cut off or longer than it says, unpacks to more than LARGEST_VOLUME, a field is not
            known or says what is not read here, or the data stand in another file.
    """
    header, body = _header(data, name=name)
    sizes = _whole(header, "sizes", name=name)
    if [len(sizes)] != _whole(header, "dimension", name=name):
        raise InputError(
            f"`{name}` has the dimension {header.fields['dimension'][:20]} and {how_many(len(sizes), 'size')}; "
            "export it again."
        )
    stored = _stored(header, name=name)
    frame, layered = _frame(header, sizes, name=name)
    layers = 1 if layered is None else sizes[layered]
    grid = [size for axis, size in enumerate(sizes) if axis != layered]
    shape = checked_shape(tuple(grid), frame.affine, stored=stored, name=name, layers=layers)
    content = _content(header, body, layers * int(np.prod(shape)), stored, name=name)
    whole = shape if layered is None else tuple(sizes)
    values = grid_of(content, whole, stored=stored, offset=0, name=name)
    parts: list[NDArray[np.generic]] = (
        [values] if layered is None else [np.take(values, layer, axis=layered) for layer in range(layers)]
    )
    segments = _segments(header, layers=layers, name=name)
    if layers > 1 and not segments:
        raise InputError(
            f"`{name}` holds {layers} values for each voxel ({header.fields.get('kinds', 'no kinds')[:60]}) and no "
            "segments that say what they are; export one volume of labels."
        )
    known = {f"field `{field}`": 1 for field in header.fields if field in _SKIPPED}
    others = sum(not _SEGMENT.fullmatch(key) for key in header.keys)
    return replace(frame, layers=tuple(parts), segments=segments, skipped={**known, "keys of the header": others})


def _header(data: bytes, *, name: str) -> tuple[_Header, bytes]:
    """Return the header of a file and the bytes behind it."""
    end = re.compile(rb"\r?\n\r?\n").search(data, 0, LONGEST_HEADER)
    if not re.match(rb"NRRD000[1-5]\r?\n", data):
        raise InputError(f"`{name}` does not begin with a NRRD header; export the segmentation again as NRRD.")
    if end is None:
        raise InputError(
            f"`{name}` has a NRRD header without the empty line that ends it, in its first {LONGEST_HEADER} bytes; "
            "export the segmentation again as NRRD."
        )
    fields: dict[str, str] = {}
    lines: dict[str, int] = {}
    keys: dict[str, str] = {}
    for number, line in enumerate(data[: end.start()].decode("utf-8", errors="replace").splitlines()[1:], start=2):
        if line.startswith("#"):
            continue
        key, keyed, value = line.partition(":=")
        if keyed:
            keys[key] = value
            continue
        field, colon, value = line.partition(": ")
        field = " ".join(field.lower().split())
        field = _SPELLINGS.get(field, field)
        if field in _REFUSED:
            raise InputError(f"`{name}` line {number}: it {_REFUSED[field]}.", line=number)
        if not colon or field not in {*_OBEYED, *_SKIPPED} or field in fields:
            why = "stands twice" if field in fields else "is no field of NRRD"
            raise InputError(
                f"`{name}` line {number}: {printable(line)[:LONGEST_NAME]!r} {why}, so its effect is unknown; export "
                "the segmentation again.",
                line=number,
            )
        fields[field], lines[field] = value.strip(), number
    missing = [field for field in ("type", "dimension", "sizes", "encoding") if field not in fields]
    if missing:
        raise InputError(f"`{name}` has no field `{missing[0]}` in its header; export the segmentation again.")
    return _Header(fields, lines, keys), data[end.end() :]


def _refuse(header: _Header, field: str, advice: str, *, name: str) -> InputError:
    """Return the error for a field whose value is not read here."""
    line = header.lines[field]
    shown = printable(header.fields[field])[:LONGEST_NAME]
    return InputError(f"`{name}` line {line}: `{field}` is {shown!r}; {advice}.", line=line)


def _whole(header: _Header, field: str, *, name: str) -> list[int]:
    """Return the whole numbers of a field."""
    words = header.fields[field].split()
    if not words or not all(re.fullmatch(r"\d{1,18}", word) for word in words):
        raise _refuse(header, field, "whole numbers are needed, so export it again", name=name)
    return [int(word) for word in words]


def _vectors(header: _Header, field: str, *, name: str) -> list[FloatArray | None]:
    """Return the vectors of three numbers of a field, None for an axis that has none."""
    found: list[FloatArray | None] = []
    for word in re.findall(r"\([^()]*\)|[^\s()]+", header.fields[field]):
        if word.lower() == "none":
            found.append(None)
            continue
        try:
            vector = np.array([float(part) for part in word.strip("()").split(",")])
        except ValueError:
            vector = np.zeros(0)
        if vector.shape != (3,) or not np.isfinite(vector).all():
            raise _refuse(header, field, "vectors of three numbers, (0.8,0,0), are needed: export it again", name=name)
        found.append(vector)
    return found


def _frame(header: _Header, sizes: list[int], *, name: str) -> tuple[GridFile, int | None]:
    """Return where the grid lies, turned from its space into right, anterior, superior; and the axis of its layers."""
    if "space directions" not in header.fields:
        raise InputError(f"`{name}` has no `space directions`; export it with its position in space.")
    directions = _vectors(header, "space directions", name=name)
    none = [axis for axis, direction in enumerate(directions) if direction is None]
    if len(directions) != len(sizes) or len(sizes) - len(none) != 3 or len(none) > 1:
        advice = f"of {len(sizes)} axes three lie in space and one more at most is a list: export one volume"
        raise _refuse(header, "space directions", advice, name=name)
    axis = none[0] if none else None
    kinds = header.fields.get("kinds", "").lower().split()
    if kinds and len(kinds) != len(sizes):
        raise _refuse(
            header, "kinds", f"there are {how_many(len(sizes), 'axis', 'axes')}, so export it again", name=name
        )
    wrong = [kind for at, kind in enumerate(kinds) if at != axis and kind not in {"domain", "space", "none", "???"}]
    if wrong:
        raise _refuse(
            header, "kinds", f"an axis of the kind {wrong[0]} has a direction in space: export it again", name=name
        )
    affine = np.eye(4)
    affine[:3, :3] = np.array([direction for direction in directions if direction is not None]).T
    _check_spacings(header, affine, axis, name=name)
    if "space origin" in header.fields:
        origins = _vectors(header, "space origin", name=name)
        if len(origins) != 1 or origins[0] is None:
            raise _refuse(header, "space origin", "one place, (0,0,0), is needed: export it again", name=name)
        affine[:3, 3] = origins[0]
    assumed = () if "space origin" in header.fields else ("the first voxel at the origin",)
    return _placed(header, affine, assumed, name=name), axis


def _placed(header: _Header, affine: FloatArray, assumed: tuple[str, ...], *, name: str) -> GridFile:
    """Return a grid, still without numbers, whose affine is in the space of the header."""
    written = header.fields.get("space", "").lower()
    space = _SPACES.get(written, written)
    if header.fields.get("space dimension", "3") != "3":
        raise _refuse(header, "space dimension", "three are read, so export it in space", name=name)
    if space in _SIGNS:
        affine[:3] *= np.array(_SIGNS[space])[:, None]
        coordinates, usual = "right, anterior, superior", PATIENT_UNIT
    elif space in _PLAIN or not space:
        coordinates, usual = f"those of the file ({space or 'no space named'})", ""
    else:
        raise _refuse(header, "space", "export it in left-posterior-superior or the like", name=name)
    if not space:
        assumed = (*assumed, "a right-handed space, as none is named")
    if "space units" not in header.fields:
        if usual:
            assumed = (*assumed, f"{usual} (a patient's space without `space units`)")
        return GridFile((), affine, None, usual, coordinates=coordinates, assumed=assumed)
    words = [word.strip('"').lower() for word in header.fields["space units"].split()]
    units = {UNITS_BY_NAME.get(word) for word in words}
    if len(words) != 3 or len(units) != 1 or None in units:
        known = ", ".join(dict.fromkeys(UNITS_BY_NAME.values()))
        raise _refuse(header, "space units", f"three times one of {known} is needed: export it again", name=name)
    return GridFile((), affine, units.pop(), coordinates=coordinates, assumed=assumed)


def _check_spacings(header: _Header, affine: FloatArray, axis: int | None, *, name: str) -> None:
    """Refuse distances of voxels that are others than those of the directions."""
    if "spacings" not in header.fields:
        return
    try:
        spacings = np.array([float(word) for word in header.fields["spacings"].split()])
    except ValueError:
        spacings = np.zeros(0)
    sides = np.linalg.norm(affine[:3, :3], axis=0)
    along = spacings if axis is None else np.delete(spacings, axis) if axis < spacings.size else np.zeros(0)
    if along.shape != (3,) or not (np.isnan(along) | (np.abs(along - sides) <= _SAME_LENGTH * sides)).all():
        raise _refuse(header, "spacings", "it contradicts `space directions`, so export it again", name=name)


def _stored(header: _Header, *, name: str) -> np.dtype[np.generic]:
    """Return the type of the values as they are stored."""
    kind, encoding = header.fields["type"].lower(), header.fields["encoding"].lower()
    if kind not in TYPES or encoding not in _ENCODINGS:
        shown = f"{printable(encoding)[:20]} of {printable(kind)[:20]}"
        raise InputError(f"`{name}` is packed as {shown}; export it as raw or gzip, of whole numbers.")
    if _ENCODINGS[encoding] == "ascii":
        return np.dtype(TYPES[kind])
    stored = np.dtype(TYPES[kind])
    order = header.fields.get("endian", "").lower()
    if stored.itemsize > 1 and order not in {"little", "big"}:
        raise InputError(
            f"`{name}` does not say the order of its bytes (`endian: little` or big), which values of {kind} need; "
            "export it again."
        )
    return stored.newbyteorder(">" if order == "big" else "<")


def _content(header: _Header, body: bytes, count: int, stored: np.dtype[np.generic], *, name: str) -> bytes:
    """Return the data: behind lines and bytes that are skipped, the lines as they are packed, the bytes unpacked."""
    skips = {field: header.fields.get(field, "0") for field in ("line skip", "byte skip")}
    for field, value in skips.items():
        if not re.fullmatch(r"\d{1,15}", value) and not (field == "byte skip" and value == "-1"):
            raise _refuse(header, field, "a number of 0 or more is needed, so export it again", name=name)
    encoding, needed = _ENCODINGS[header.fields["encoding"].lower()], count * stored.itemsize
    lines, skip = int(skips["line skip"]), int(skips["byte skip"])
    start = 0
    for _ in range(lines):
        start = body.find(b"\n", start) + 1
        if start == 0:
            raise _refuse(header, "line skip", "the file has fewer lines, so export it again", name=name)
    body = body[start:]
    if encoding in {"ascii", "hex"}:
        if skip:
            raise _refuse(header, "byte skip", "text has no bytes that are skipped: export it again", name=name)
        return _of_text(body, encoding, stored, name=name)
    if skip == -1:
        if encoding != "raw":
            raise _refuse(
                header, "byte skip", "packed data have no bytes to count from the end: export it again", name=name
            )
        skip = max(len(body) - needed, 0)
    if encoding == "raw":
        return body[skip:]
    return unpacked(body, skip + needed, name=name, packing=encoding)[skip:]


def _of_text(body: bytes, encoding: str, stored: np.dtype[np.generic], *, name: str) -> bytes:
    """Return the bytes of numbers that are written as decimals (ascii), or of bytes as two digits each (hex)."""
    try:
        if encoding == "hex":
            return bytes.fromhex(body.decode("ascii"))
        # Python reads underlines between digits, nobody else does.
        values = np.fromiter(map(float, body.replace(b"_", b"?").split()), dtype=np.float64)
        with np.errstate(invalid="ignore", over="ignore"):
            found = values.astype(stored)
    except ValueError as error:
        raise InputError(
            f"`{name}` holds something else than the numbers that its encoding, {encoding}, promises ({error}); export "
            "it again."
        ) from error
    if stored.kind in "iu" and not (found == values).all():
        wrong = values[found != values][0]
        raise InputError(f"`{name}` holds {wrong:g}, but its header promises values of {stored}; export it again.")
    return found.tobytes()


def _segments(header: _Header, *, layers: int, name: str) -> dict[int, Segment]:
    """Return the segments that the keys of 3D Slicer describe, by the numbers to choose them by.

    That is their label value; where several have the same in different layers, it is their place in the header.
    """
    said: dict[int, dict[str, str]] = {}
    for key, value in header.keys.items():
        if found := _SEGMENT.fullmatch(key):
            said.setdefault(int(found[1]), {})[found[2]] = value.strip()
    segments: list[Segment] = []
    for place in sorted(said):
        words = said[place]
        value, layer = words.get("LabelValue", str(place + 1)), words.get("Layer", "0")
        if not (re.fullmatch(r"\d{1,9}", value) and re.fullmatch(r"\d{1,9}", layer) and int(layer) < layers):
            raise InputError(
                f"`{name}` has a segment {place} with the label value {printable(value)[:20]!r} in layer "
                f"{printable(layer)[:20]!r} of {layers}; export the segmentation again."
            )
        segments.append(Segment(int(layer), int(value), printable(words.get("Name", ""))[:LONGEST_NAME]))
    values = [segment.value for segment in segments]
    own = len(set(values)) == len(values) and 0 not in values
    return {segment.value if own else place: segment for place, segment in enumerate(segments, start=1)}
