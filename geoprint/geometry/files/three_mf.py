"""Reading 3MF packages [3MF]: the meshes of the build, where transforms put them; ZIP archives."""

from __future__ import annotations

import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import PurePosixPath
from typing import NamedTuple, NoReturn, TypeAlias, final
from xml.parsers import expat

import numpy as np

from geoprint.errors import InputError, how_many, reason_of
from geoprint.geometry.files.mesh_file import MeshFile, Regions, printable
from geoprint.model import FloatArray, IntArray, reading

# Reading single entries of ZIP archives without trusting what the archive says of itself.
#
# Nothing is unpacked to disk. An entry is read only if it is not huge, not packed so tightly that it can only be a
# bomb, not encrypted, and stands under a name that stays inside the archive.


# Largest entry that is unpacked [bytes]: 20 million triangles of a binary STL.
LARGEST_ENTRY = 1 << 30
# Text meshes pack 3 to 20 times; a file of zeros packs 1000 times.
LARGEST_RATIO = 100
# A mesh has one entry, a 3MF package some dozens.
MOST_ENTRIES = 1000


def open_archive(data: bytes, *, name: str) -> zipfile.ZipFile:
    """Open an archive held in memory.

    Raises:
        InputError: it is damaged, has very many entries, or one whose name leads out of it.
    """
    try:
        archive = zipfile.ZipFile(BytesIO(data))
    except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError) as error:
        raise InputError(
            f"`{name}` is not a ZIP archive that can be opened ({reason_of(error)}); copy or pack it again."
        ) from error
    entries = archive.infolist()
    if len(entries) > MOST_ENTRIES:
        raise InputError(
            f"`{name}` is an archive of {len(entries)} entries, at most {MOST_ENTRIES} are allowed; pack the mesh "
            "alone."
        )
    for entry in entries:
        path = PurePosixPath(entry.filename.replace("\\", "/"))
        if path.is_absolute() or ".." in path.parts or not entry.filename.isprintable() or ":" in entry.filename:
            raise InputError(
                f"`{name}` has an entry {entry.filename!r}, whose name leads out of the archive or cannot be printed; "
                "do not use this archive."
            )
    return archive


def read_entry(archive: zipfile.ZipFile, entry: str, *, name: str) -> bytes:
    """Unpack one entry in memory.

    Args:
        archive: from `open_archive`.
        entry: its name in the archive.
        name: of the archive, for messages.

    Raises:
        InputError: it is missing, encrypted, damaged, larger than LARGEST_ENTRY, or packed tighter than LARGEST_RATIO.
    """
    try:
        info = archive.getinfo(entry)
    except KeyError as error:
        raise InputError(f"`{name}` refers to `{entry}`, which is not in it; export it again.") from error
    if info.file_size > LARGEST_ENTRY or info.file_size > LARGEST_RATIO * max(info.compress_size, 1):
        raise InputError(
            f"`{name}`: `{entry}` would unpack from {info.compress_size} to {info.file_size} bytes. At most "
            f"{LARGEST_RATIO} times its packed size and {LARGEST_ENTRY >> 20} MiB are allowed: unpack it yourself if "
            "you trust it.",
            packed=info.compress_size,
            unpacked=info.file_size,
        )
    try:
        # zipfile reads no more than the size that was checked above, and then compares the checksum.
        return archive.read(info)
    except (zipfile.BadZipFile, zlib.error, RuntimeError, NotImplementedError, OSError, EOFError, ValueError) as error:
        raise InputError(
            f"`{name}`: `{entry}` cannot be unpacked ({reason_of(error)}); copy or pack it again."
        ) from error


def only_mesh(data: bytes, *, suffixes: Collection[str], name: str) -> tuple[str, bytes]:
    """Return the one mesh of an archive.

    Args:
        data: content of the archive.
        suffixes: in lower case, of files that are meshes; an archive in the archive is none.
        name: of the archive.

    Returns:
        Suffix and content of its mesh.

    Raises:
        InputError: as `open_archive` and `read_entry`; or it holds no mesh, or several.
    """
    archive = open_archive(data, name=name)
    # macOS packs a second file of attributes beside each, of the same name.
    entries = [entry for entry in archive.namelist() if not entry.startswith("__MACOSX/")]
    meshes = [entry for entry in entries if PurePosixPath(entry).suffix.lower() in suffixes]
    if len(meshes) != 1:
        found = f"{how_many(len(meshes), 'mesh', 'meshes')} ({', '.join(meshes[:3])})" if meshes else "no mesh"
        raise InputError(
            f"`{name}` holds {found}; an archive must hold one of {', '.join(suffixes)}, so unpack it and give the "
            "file."
        )
    return PurePosixPath(meshes[0]).suffix.lower(), read_entry(archive, meshes[0], name=name)


# Reading 3MF packages [3MF]: the meshes of the build, each where its transforms put it, and their unit.
#
# The XML is read by the streaming parser alone, and document type declarations are refused, so that entities can
# neither grow nor reach for other files. Components may refer to other model files of the package, never outside it.


# What the format calls a unit, our name of it and how many of ours it is.
_UNITS: Mapping[str, tuple[str, float]] = {
    "micron": ("um", 1.0), "millimeter": ("mm", 1.0), "centimeter": ("cm", 1.0), "inch": ("in", 1.0),
    "foot": ("in", 12.0), "meter": ("m", 1.0),
}  # fmt: skip
MODEL_RELATION = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
# Components may use components; deeper than this they go round in a circle.
DEEPEST = 20
# Triangles of the whole build: components multiply, so that a short file can ask for any number.
MOST_FACES = 20_000_000

# An object counts as this many triangles at least: empty ones that use each other multiply too.
LEAST_COST = 1000

# Types of objects that hold the part while it is printed by others, and are no part of it.
_SUPPORTS = ("support", "solidsupport")
# Elements of extensions that are solids of their own, or change the mesh.
_SHAPES = ("beamlattice", "booleanshape", "displacementmesh", "implicitfunction", "levelset", "slicestack")

# Name of the model file and identifier of an object in it.
_Key: TypeAlias = tuple[str, str]


@final
@dataclass(slots=True)
class _Object:
    """An object as it is read: its name and type, corners and triangles of its own, and what it is composed of."""

    name: str
    kind: str = "model"
    vertices: list[tuple[float, ...]] = field(default_factory=list[tuple[float, ...]])
    faces: list[tuple[int, ...]] = field(default_factory=list[tuple[int, ...]])
    components: list[tuple[_Key, FloatArray]] = field(default_factory=list[tuple[_Key, FloatArray]])


class _Placed(NamedTuple):
    """The mesh of an object where a build puts it, and the names of the object and of those composed of it."""

    vertices: FloatArray
    faces: IntArray
    owners: tuple[str, ...] = ()


@final
@dataclass(slots=True)
class _Model:
    """A model file as it is read."""

    unit: str = "millimeter"
    objects: dict[_Key, _Object] = field(default_factory=dict[_Key, _Object])
    build: list[tuple[_Key, FloatArray]] = field(default_factory=list[tuple[_Key, FloatArray]])


def read_3mf(data: bytes, /, *, name: str) -> MeshFile:
    """Read the meshes of the build of a 3MF package, end to end.

    Args:
        data: content of the package.
        name: what messages call it.

    Returns:
        The mesh, whose regions are the objects, composed ones too.

    Raises:
        InputError: the package or its model is damaged, declares entities, refers to what is not there, or its
            components grow without bound.
    """
    archive = open_archive(data, name=name)
    root = _root_model(archive, name=name)
    model = _read_model(archive, root, name=name)
    objects, waiting, read = dict(model.objects), [model], {root}
    while waiting:
        composed = [key for found in waiting.pop().objects.values() for key, _ in found.components]
        for path in sorted({path for path, _ in composed} - read):
            read.add(path)
            waiting.append(_read_model(archive, path, name=name))
            objects |= waiting[-1].objects
    if model.unit not in _UNITS:
        raise InputError(f"`{name}` is in the unit {model.unit!r}, which 3MF does not know; export it again.")
    unit, scale = _UNITS[model.unit]
    left, supports = [MOST_FACES], Counter[str]()
    placed = [
        piece
        for key, transform in model.build
        for piece in _placed(objects, key, transform, name=name, depth=0, left=left, supports=supports)
    ]
    faces = sum(len(piece.faces) for piece in placed)
    if supports and not faces:
        raise InputError(f"`{name}` holds supports alone ({sum(supports.values())} faces of them); export the part.")
    shifts = np.cumsum([0, *(len(piece.vertices) for piece in placed)])
    return MeshFile(
        np.concatenate([piece.vertices for piece in placed] or [np.empty((0, 3))]) * scale,
        np.concatenate(
            [piece.faces + shift for piece, shift in zip(placed, shifts, strict=False)] or [np.empty((0, 3), np.int64)]
        ),
        unit,
        regions=_regions(placed),
        reading=reading(used={"faces": faces, "objects": len(placed)}, skipped=supports),
    )


def _regions(placed: list[_Placed]) -> Regions:
    """Return the regions that the objects of pieces are, whose faces stand end to end."""
    parts: dict[str, list[IntArray]] = {}
    first = 0
    for piece in placed:
        for owner in dict.fromkeys(piece.owners):
            parts.setdefault(owner, []).append(np.arange(first, first + len(piece.faces)))
        first += len(piece.faces)
    return {printable(owner): np.concatenate(faces) for owner, faces in parts.items()}


def _placed(
    objects: Mapping[_Key, _Object],
    key: _Key,
    transform: FloatArray,
    *,
    name: str,
    depth: int,
    left: list[int],
    supports: Counter[str],
) -> list[_Placed]:
    """Return the meshes of an object and its components under a transform; `left` counts down the faces allowed.

    Those of supports are left out and counted.
    """
    if key not in objects:
        raise InputError(f"`{name}` refers to object {key[1]!r}, which is not in it; export it again.")
    found = objects[key]
    left[0] -= max(len(found.faces), LEAST_COST)
    if depth > DEEPEST or left[0] < 0:
        raise InputError(
            f"`{name}`: components are nested more than {DEEPEST} deep or make more than {MOST_FACES} triangles; "
            "export the part as one mesh."
        )
    pieces: list[_Placed] = []
    if found.kind in _SUPPORTS:
        supports[f"faces of objects of type {found.kind}"] += len(found.faces)
    elif found.faces:
        vertices = np.array(found.vertices, dtype=np.float64).reshape(-1, 3)
        faces = np.array(found.faces, dtype=np.int64).reshape(-1, 3)
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InputError(
                f"`{name}`: a triangle of object {key[1]!r} refers to a vertex that is not there; export it again."
            )
        mirrored = np.linalg.det(transform[:3]) < 0
        # Points are rows here: the format multiplies from the right. The caller refuses what is not finite.
        with np.errstate(invalid="ignore", over="ignore"):
            moved = vertices @ transform[:3] + transform[3]
        pieces.append(_Placed(moved, faces[:, ::-1] if mirrored else faces))
    # What a support is composed of holds the part, too.
    components = () if found.kind in _SUPPORTS else found.components
    for component, own in components:
        with np.errstate(invalid="ignore", over="ignore"):
            inner = np.vstack([own[:3] @ transform[:3], own[3] @ transform[:3] + transform[3]])
        pieces += _placed(objects, component, inner, name=name, depth=depth + 1, left=left, supports=supports)
    return [piece._replace(owners=(found.name, *piece.owners)) for piece in pieces]


def _root_model(archive: zipfile.ZipFile, *, name: str) -> str:
    """Return the name of the model file that the package's relations point to."""
    targets: list[str] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        if tag.rpartition(" ")[2] == "Relationship" and attributes.get("Type") == MODEL_RELATION:
            targets.append(attributes.get("Target", "").lstrip("/"))

    _parse(read_entry(archive, "_rels/.rels", name=name), start, name=name)
    if len(targets) != 1:
        raise InputError(
            f"`{name}` has {how_many(len(targets), 'root model')}; a 3MF package has one, so export it again."
        )
    return targets[0]


def _read_model(archive: zipfile.ZipFile, path: str, *, name: str) -> _Model:
    """Read one model file of the package."""
    model, current = _Model(), _Object("")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal current
        match tag.rpartition(" ")[2]:
            case "model":
                model.unit = attributes.get("unit", model.unit)
            case "object":
                current = model.objects[path, attributes["id"]] = _Object(
                    _object_name(attributes), attributes.get("type", "model")
                )
            case "vertex":
                current.vertices.append(tuple(float(attributes[axis]) for axis in "xyz"))
            case "triangle":
                current.faces.append(tuple(int(attributes[corner]) for corner in ("v1", "v2", "v3")))
            case "component":
                current.components.append((_key(attributes, path), _transform(attributes)))
            case shape if shape in _SHAPES:
                raise InputError(
                    f"`{name}` holds a `{shape}`, a shape of an extension of 3MF that is not read; export the part as "
                    "triangles alone."
                )
            case "item":
                model.build.append((_key(attributes, path), _transform(attributes)))
            case _:
                pass

    _parse(read_entry(archive, path, name=name), start, name=name)
    return model


def _object_name(attributes: Mapping[str, str]) -> str:
    return attributes.get("name", "").strip() or f"object {attributes['id']}"


def _key(attributes: Mapping[str, str], path: str) -> _Key:
    """Return which object is meant: in this model file, or in the one of the production extension's path."""
    elsewhere = next((value for key, value in attributes.items() if key.endswith(" path")), None)
    return path if elsewhere is None else elsewhere.lstrip("/"), attributes["objectid"]


def _transform(attributes: Mapping[str, str]) -> FloatArray:
    """Return the (4, 3) matrix by which row vectors (x, y, z, 1) are multiplied."""
    if "transform" not in attributes:
        return np.eye(4)[:, :3]
    return np.array([float(word) for word in attributes["transform"].split()], dtype=np.float64).reshape(4, 3)


def _parse(data: bytes, start: Callable[[str, dict[str, str]], None], *, name: str) -> None:
    """Send the elements of an XML text to a function; namespaces stand before a blank in names."""

    def refuse(*_: object) -> NoReturn:
        raise InputError(f"`{name}` declares a document type, which 3MF forbids; do not use this file.")

    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler = start
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)  # noqa: FBT003  (expat takes it by place alone)
    except (expat.ExpatError, KeyError, ValueError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        line = parser.CurrentLineNumber
        raise InputError(
            f"`{name}` cannot be read as 3MF from line {line} on; it is damaged, so export it again."
        ) from error
