"""Tessellating STEP and IGES files, NURBS and all, in a process of its own with limits on time and memory."""

from __future__ import annotations

import importlib.util
import math
import re
from io import BytesIO
from pathlib import Path

import numpy as np

from geoprint.cad import worker
from geoprint.errors import InputError
from geoprint.geometry.files.mesh_file import MeshFile, single_step
from geoprint.geometry.native import missing, run_worker
from geoprint.model import FloatArray, IntArray

# Largest distance between a face and its triangles [mm], and as a share of the part's size: the smaller counts.
CHORD = 0.01
CHORD_SHARE = 1 / 5000
# Largest angle between neighbouring triangles of one face [rad].
ANGLE = 0.2
# A first tessellation, relative to each edge, tells the size.
ROUGH_CHORD = 0.05
# Parts beyond this size [mm] are refused for it by whoever asked, so that a fine tessellation is not worth its time.
LARGEST_SIZE = 2000.0
# cascadio writes the metres that GLB asks for from STEP, and from IGES the millimetres that its kernel works in.
MILLIMETRES = {"step": 1000.0, "iges": 1.0}
# Larger numbers [any unit] make the kernel compute for ever, or write what is no number; a nanometre file of the
# largest part holds a thousandth.
LARGEST_NUMBER = 1e12
# Numbers that may be larger: of many digits before the point, or with a large exponent; strings and comments pass.
LARGE_NUMBER = re.compile(
    rb"'[^']*'?|/\*.*?(?:\*/|\Z)|(?<![\w.#])([-+]?(?:\d{12,}\.?\d*(?:[EeDd][-+]?\d+)?|\d+\.?\d*[EeDd]\+?\d+))",
    re.DOTALL,
)


def read_step(data: bytes, /, *, name: str) -> MeshFile:
    """Return triangles of all faces of a STEP file, in mm.

    Args:
        data: content of the file.
        name: of the file.

    Raises:
        InputError: it is damaged, holds no face, or a number beyond LARGEST_NUMBER.
        ResourceError: tessellating takes longer or more memory than allowed.
        UsageError: cascadio is not installed.
    """
    return _read(data, kind="step", name=name)


def read_iges(data: bytes, /, *, name: str) -> MeshFile:
    """Return triangles of all faces of an IGES file, in mm, as `read_step`."""
    return _read(data, kind="iges", name=name)


def _read(data: bytes, *, kind: str, name: str) -> MeshFile:
    if importlib.util.find_spec("cascadio") is None:
        raise missing("cascadio", extra="cad", work="reading STEP and IGES files")
    _check_numbers(data, kind=kind, name=name)
    vertices, faces = _tessellated(data, kind=kind, chord=ROUGH_CHORD, relative=True, name=name)
    size = float(np.ptp(vertices, axis=0).max())
    chord = min(CHORD, CHORD_SHARE * size)
    if 0.0 < size <= LARGEST_SIZE:
        vertices, faces = _tessellated(data, kind=kind, chord=chord, relative=False, name=name)
    notes = (
        ("tessellated_from", kind.upper()),
        ("chord_mm", round(chord, 6)),
        ("angle_deg", round(math.degrees(ANGLE), 3)),
    )
    return MeshFile(vertices, faces, "mm", notes, step=single_step(vertices))


def _tessellated(data: bytes, *, kind: str, chord: float, relative: bool, name: str) -> tuple[FloatArray, IntArray]:
    """Return what a child process makes of a file, in mm."""
    settings = [kind, repr(chord), repr(ANGLE), "relative" if relative else "absolute"]
    content = run_worker(Path(worker.__file__), settings, data=data, work="tessellated", name=name)
    return _triangles(content, scale=MILLIMETRES[kind], name=name)


def _check_numbers(data: bytes, *, kind: str, name: str) -> None:
    """Refuse a number that no part has: the kernel would compute with it for ever, or write what is no number."""
    # Of IGES only the lines of parameters hold coordinates, in their first 64 columns.
    iges = b"\n".join(line[:64] if line[72:73] == b"P" else b"" for line in data.splitlines())
    text = iges if kind == "iges" else data
    for found in LARGE_NUMBER.finditer(text):
        if found[1] and not abs(float(found[1].upper().replace(b"D", b"E"))) <= LARGEST_NUMBER:
            line = text.count(b"\n", 0, found.start()) + 1
            raise InputError(
                f"`{name}` line {line} holds the number {found[1][:40].decode()}; at most {LARGEST_NUMBER:g} is read: "
                "export the file again.",
                line=line,
            )


def _triangles(content: bytes, *, scale: float, name: str) -> tuple[FloatArray, IntArray]:
    """Return the triangles of all parts of a GLB file, where its scene puts them."""
    import trimesh  # here, because it takes a quarter of a second

    try:
        scene = trimesh.load_scene(BytesIO(content), file_type="glb", process=False)
    except ValueError as error:  # JSON holds neither NaN nor infinity
        raise InputError(
            f"`{name}` cannot be tessellated: its faces reach to infinity or NaN; look for a wrong coordinate, or "
            "export the file again."
        ) from error
    if not scene.geometry:
        raise InputError(f"`{name}` holds no faces, only points or curves at most; export the surfaces or the solid.")
    mesh = scene.to_mesh()
    return np.asarray(mesh.vertices, dtype=np.float64) * scale, np.asarray(mesh.faces, dtype=np.int64)
