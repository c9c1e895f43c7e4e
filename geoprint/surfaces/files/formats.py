"""Reading STL, PLY, OBJ, OFF and 3MF files, also zipped, into plain arrays, and refusing the damaged ones.

Readers answer many damaged files with a mesh that is empty or lacks a part. So what a file promises (the count of a
binary STL, the header of a PLY) is compared with its length before it is read, and with what came out after.
"""

from __future__ import annotations

import re
import stat
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Protocol, TypeAlias, final

import numpy as np

from geoprint.errors import GeoprintError, InputError, UsageError
from geoprint.model import FloatArray, IntArray
from geoprint.surfaces.conversion import Notes
from geoprint.surfaces.files.archives import only_mesh
from geoprint.surfaces.files.regions import Regions, labelled_faces, named
from geoprint.surfaces.files.text_formats import MeshArrays, check_indices, read_obj, read_off
from geoprint.surfaces.files.three_mf import read_3mf

# Largest file that is read [bytes]: 40 million triangles of a binary STL.
LARGEST_FILE = 1 << 31

STL_HEADER_BYTES = 84
STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
STL_TRIANGLE_BYTES = STL_TRIANGLE.itemsize
PLY_SIZES = {
    "char": 1, "uchar": 1, "int8": 1, "uint8": 1, "short": 2, "ushort": 2, "int16": 2, "uint16": 2, "int": 4,
    "uint": 4, "int32": 4, "uint32": 4, "float": 4, "float32": 4, "double": 8, "float64": 8,
}  # fmt: skip
# Data and properties of each element of a PLY file, by their names.
_Elements: TypeAlias = Mapping[str, Mapping[str, Mapping[str, object]]]


class _Reader(Protocol):
    def __call__(self, data: bytes, /, *, name: str) -> MeshArrays: ...


@final
@dataclass(frozen=True, slots=True, eq=False)
class MeshFile:
    """What a mesh file holds.

    Attributes:
        vertices: (n, 3) positions in the file's unit.
        faces: (m, 3) vertex indices; polygons are triangulated.
        unit: of the positions, a key of `io.UNITS`; None where the format carries none.
        notes: how the mesh was made, where the file holds something else.
        regions: groups, objects, solids and labels that the file gives to faces.
    """

    vertices: FloatArray
    faces: IntArray
    unit: str | None
    notes: Notes = ()
    regions: Regions = field(default_factory=dict[str, IntArray])


def read_mesh(path: Path, *, label: int | None = None) -> MeshFile:
    """Read a mesh file by its suffix, or make a mesh of what else it holds.

    Args:
        path: of a .stl, .ply, .obj, .off or .3mf file, of a .zip file that holds one of these, or of one of the
            VOLUMES.
        label: of a label volume, which one is meant.

    Returns:
        What the file holds.

    Raises:
        InputError: the file is missing, unreadable, of another kind, damaged, or its length disagrees with what it
            promises; it holds no faces, a coordinate that is not finite, or a face that refers to a vertex that is
            not there; an archive holds no mesh, several, or one that is packed too tightly.
        UsageError: a label is given for a file that has none or is missing, or an optional package is not installed.
    """
    suffix = ".nii.gz" if path.name.lower().endswith(".nii.gz") else path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"`{path.name}` has the suffix `{path.suffix}`, but geoprint reads {', '.join(SUFFIXES)}; "
            "export the mesh as one of these."
        )
    if label is not None and suffix not in VOLUMES:
        raise UsageError(f"`{path.name}` has no labels, only {', '.join(VOLUMES)} have; leave `--label` out.")
    data = _content(path)
    if suffix == ".zip":
        suffix, data = only_mesh(data, suffixes=[*_READERS, ".3mf"], name=path.name)
    try:
        file = _file(data, suffix=suffix, label=label, name=path.name)
    except (GeoprintError, MemoryError):
        raise
    except Exception as error:  # a reader may raise anything on a damaged file
        raise InputError(
            f"`{path.name}` cannot be read as {suffix} ({type(error).__name__}: {str(error)[:200]!r}); "
            "it is damaged or not what its suffix says, so export it again."
        ) from error
    _check(file, name=path.name)
    return file


def _file(data: bytes, *, suffix: str, label: int | None, name: str) -> MeshFile:
    """Return what a file of a known kind holds, unchecked; what needs an extra is imported where it is met."""
    if suffix == ".3mf":
        mesh, unit = read_3mf(data, name=name)
        return MeshFile(mesh.vertices, mesh.faces, unit, regions=mesh.regions)
    if suffix in VOLUMES:
        from geoprint.surfaces.files.label_volumes import read_volume

        made = read_volume(data, suffix=suffix, label=label, name=name)
        return MeshFile(made.vertices, made.faces, made.unit, made.notes)
    if suffix in CAD:
        from geoprint.surfaces.files.cad import read_cad

        made = read_cad(data, suffix=suffix, name=name)
        return MeshFile(made.vertices, made.faces, made.unit, made.notes)
    if suffix in CLOUDS or (suffix == ".ply" and _without_faces(data)):
        from geoprint.surfaces.files.point_clouds import read_point_ply, read_point_text, reconstruct

        cloud = (read_point_ply if suffix == ".ply" else read_point_text)(data, name=name)
        made = reconstruct(cloud, name=name)
        return MeshFile(made.vertices, made.faces, made.unit, made.notes)
    mesh = _READERS[suffix](data, name=name)
    return MeshFile(mesh.vertices, mesh.faces, None, regions=mesh.regions)


def _without_faces(data: bytes) -> bool:
    """Return whether a PLY file holds vertices alone."""
    header = data[: data.find(b"end_header")].split(b"\n")
    counts = {words[1]: words[2] for words in map(bytes.split, header) if len(words) == 3 and words[0] == b"element"}
    return counts.get(b"vertex", b"0") != b"0" and counts.get(b"face", b"0") == b"0"


def _check(file: MeshFile, *, name: str) -> None:
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


def read_stl(data: bytes, /, *, name: str) -> MeshArrays:
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
        return MeshArrays(vertices, np.arange(len(vertices)).reshape(-1, 3))
    # trimesh needs UTF-8; other bytes can only stand in names.
    written = data.decode("utf-8-sig", errors="replace")
    text = written.lower()
    if text.lstrip().startswith("solid") and ("facet" in text or "endsolid" in text):
        facets = [found.start() for found in re.finditer(r"(?<!end)facet", written, re.IGNORECASE)]
        mesh, _ = _through_trimesh(text.encode(), kind="stl", faces=len(facets), name=name)
        return mesh._replace(regions=_solids(written, facets))
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


def read_ply(data: bytes, /, *, name: str) -> MeshArrays:
    """Read a PLY file.

    Args:
        data: content of the file.
        name: what messages call it.

    Returns:
        Vertices and triangles; the values of integer properties are regions, those of faces where all are triangles.

    Raises:
        InputError: the header is not one, or promises more than the file holds.
    """
    header, end, body = data.partition(b"end_header")
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
    mesh, elements = _through_trimesh(data, kind="ply", vertices=counts["vertex"], faces=counts["face"], name=name)
    return mesh._replace(
        regions=labelled_faces(
            mesh.faces,
            of_faces=_integers(elements, "face", count=len(mesh.faces)),
            of_vertices=_integers(elements, "vertex", count=len(mesh.vertices)),
        )
    )


def _integers(elements: _Elements, element: str, *, count: int) -> dict[str, IntArray]:
    """Return the integer properties of which an element of a PLY file has as many as `count`, as trimesh reads them."""
    data = elements[element]["data"]
    arrays = {name: np.asarray(data[name]) for name in elements[element]["properties"]}
    # What trimesh reads from text stands in columns.
    flat = {name: array[:, 0] if array.shape == (count, 1) else array for name, array in arrays.items()}
    return {name: a.astype(np.int64) for name, a in flat.items() if a.dtype.kind in "iu" and a.shape == (count,)}


_READERS: Mapping[str, _Reader] = {".stl": read_stl, ".ply": read_ply, ".obj": read_obj, ".off": read_off}
CAD = (".step", ".stp", ".iges", ".igs")
CLOUDS = (".xyz", ".pwn")
VOLUMES = (".nii", ".nii.gz", ".nrrd", ".dcm")
SUFFIXES = (*_READERS, ".3mf", ".zip", *CAD, *VOLUMES, *CLOUDS)


def _content(path: Path) -> bytes:
    """Return the bytes of a file, or say why there are none."""
    if path.is_dir():
        raise InputError(f"`{path}` is a directory; give the mesh file in it.")
    try:
        found = path.stat()
        # Reading a pipe or a device might never end.
        plain = stat.S_ISREG(found.st_mode)
        data = path.read_bytes() if plain and found.st_size <= LARGEST_FILE else None
    except FileNotFoundError as error:
        raise InputError(f"`{path}` does not exist; check the name and the folder.") from error
    except (OSError, ValueError) as error:
        raise InputError(f"`{path}` cannot be read ({error}); check its permissions and its name.") from error
    if data is None:
        what = f"{found.st_size} bytes large" if plain else "a pipe or a device"
        raise InputError(
            f"`{path.name}` is {what}; plain files of up to {LARGEST_FILE >> 30} GiB are read, so copy or decimate it "
            "first.",
            bytes=found.st_size,
        )
    if not data:
        raise InputError(f"`{path.name}` is empty (0 bytes); copy or export it again.")
    if data.startswith(b"version https://git-lfs"):
        raise InputError(f"`{path.name}` is a git-LFS pointer, not the mesh itself; fetch it with `git lfs pull`.")
    if data[:4] in {b"ply\n", b"ply\r"} and path.suffix.lower() != ".ply":
        raise InputError(f"`{path.name}` is a PLY file by its content; rename it to `{path.stem}.ply`.")
    return data


def _least_bytes(words: list[str]) -> int:
    """Return the least number of bytes of `property float x` or `property list uchar int vertex_indices`."""
    if words[1] != "list":
        return PLY_SIZES[words[1]]
    # A face has three corners at least; other lists may be empty.
    corners = 3 if words[4].startswith("vertex_ind") else 0
    return PLY_SIZES[words[2]] + corners * PLY_SIZES[words[3]]


def _through_trimesh(
    data: bytes, *, kind: str, faces: int, name: str, vertices: int | None = None
) -> tuple[MeshArrays, _Elements]:
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
    return MeshArrays(got_vertices.reshape(-1, 3), got_faces.reshape(-1, 3)), mesh.metadata.get("_ply_raw", {})
