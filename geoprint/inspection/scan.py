"""Scans of a print or of the part before it: files of clouds and meshes, and what appraising them yields."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import final

import numpy as np

from geoprint.errors import GeoprintError, InputError, UsageError
from geoprint.geometry import face_areas
from geoprint.geometry.files.io import MESHES, content_of, read_mesh
from geoprint.geometry.files.mesh_file import UNITS
from geoprint.geometry.files.ply import holds_points_alone
from geoprint.geometry.files.point_clouds import read_point_ply, read_point_text
from geoprint.inspection.scan_lying import LyingPart
from geoprint.inspection.scan_measuring import MeasuredPrint
from geoprint.inspection.scan_target import spread_over
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.process.feedback import PrintedProgram

# Scans as files: clouds of points, or the meshes that a scanner's program made of them.


CLOUDS = (".xyz", ".pwn", ".txt", ".pts", ".csv")
SUFFIXES = (*MESHES, *CLOUDS)
# Larger files take more memory to read than a usual machine has [bytes]; points in binary are 12 to 24.
LARGEST_SCAN = 1 << 28
# Of text, which takes ten times its size to read.
LARGEST_TEXT = 1 << 27
# Points that are kept: more tell nothing that noise and shape leave unsure.
MOST_POINTS = 400_000
# Of a mesh, whose points lie between vertices, too.
LEAST_OF_MESH = 50_000
SEED = 24


@final
@frozen
class Scan:
    """A scan as read.

    Attributes:
        name: of the file.
        digest: SHA-256 of it.
        points: (k, 3) in the scan's own coordinates [mm].
        held: how many points the file holds; of a mesh its vertices.
        of_mesh: whether the points lie on a mesh that the file holds.
    """

    name: str
    digest: str
    points: FloatArray
    held: int
    of_mesh: bool

    def __post_init__(self) -> None:
        freeze_arrays(self, points="float: k 3")


def is_scan(name: str) -> bool:
    """Return whether a file of that name is a scan by its suffix."""
    return Path(name).suffix.lower() in SUFFIXES


def read_scan(path: Path | str, *, unit: str, least: int) -> Scan:
    """Read a scan.

    Args:
        path: of a cloud of points, as lines or PLY, or of a mesh.
        unit: of its coordinates, a key of UNITS.
        least: points that it needs.

    Raises:
        UsageError: the unit is not known.
        InputError: it cannot be read, holds too few points, is too large, or has a coordinate that is not finite.
    """
    path = Path(path)
    if unit not in UNITS:
        raise UsageError(f"the unit `{unit}` is not known; choose one of {', '.join(UNITS)}.")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"`{path.name}` has the suffix `{path.suffix}`, scans are read from {', '.join(SUFFIXES)}; export it so."
        )
    _check_size(path)
    data = content_of(path)
    try:
        points, held, of_mesh = _points(path, data)
    except (GeoprintError, MemoryError):
        raise
    except Exception as error:  # a reader may raise anything on a damaged file
        raise InputError(
            f"`{path.name}` cannot be read as points ({str(error)[:200]!r}); it is damaged or not what its suffix "
            "says, so export it again."
        ) from error
    wrong = ~np.isfinite(points).all(axis=1)
    if wrong.any():
        raise InputError(
            f"`{path.name}` has {int(wrong.sum())} points with NaN or infinite coordinates, the first is point "
            f"{int(np.argmax(wrong))}; remove them.",
            points=int(wrong.sum()),
        )
    if held < least:
        raise InputError(
            f"`{path.name}` holds {held} points, at least {least} are needed; scan more of it.", points=held
        )
    return Scan(path.name, sha256(data).hexdigest(), points * UNITS[unit], held, of_mesh)


def _check_size(path: Path) -> None:
    """Refuse files that would take too much memory, before they are read."""
    size = path.stat().st_size if path.is_file() else 0
    most = LARGEST_TEXT if path.suffix.lower() in CLOUDS else LARGEST_SCAN
    if size > most:
        raise InputError(
            f"`{path.name}` is {size} bytes large, scans of up to {most} are read; thin it out to {MOST_POINTS} "
            "points in the scanner's program, which is enough.",
            bytes=size,
        )


def _points(path: Path, data: bytes) -> tuple[FloatArray, int, bool]:
    """Return points of a file in its unit, how many it holds, and whether they lie on a mesh."""
    suffix = path.suffix.lower()
    if suffix in CLOUDS:
        found = read_point_text(data, name=path.name).points
    elif suffix == ".ply" and holds_points_alone(data):
        found = read_point_ply(data, name=path.name).points
    else:
        mesh = read_mesh(path)
        corners = mesh.surface.vertices if mesh.unit else mesh.vertices
        return _on_mesh(corners, mesh.faces), len(corners), True
    if len(found) <= MOST_POINTS:
        return found, len(found), False
    kept = np.sort(np.random.default_rng(SEED).permutation(len(found))[:MOST_POINTS])
    return found[kept], len(found), False


def _on_mesh(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return points spread evenly over a mesh, about as many as it has vertices."""
    surface = Surface(vertices=vertices, faces=faces)
    count = int(np.clip(len(vertices), LEAST_OF_MESH, MOST_POINTS))
    return spread_over(face_areas(surface), count).xyz(surface)


# What appraising a scan yields: of a print, or of the part before it.


@final
@frozen
class AppraisedScan:
    """A scan of a print, held against its plan.

    Attributes:
        scan: as read.
        unit: of its coordinates.
        printed: the program of the print.
        given: whether the pose it began from was given.
        surface: of the part.
        upright: (3, 3) rotation to the view.
        spacing: between neighbouring runs [mm].
        printed_with: names and values of the plan and its cell.
        held: what it shows.
    """

    scan: Scan
    unit: str
    printed: PrintedProgram
    given: bool
    surface: Surface
    upright: FloatArray
    spacing: float
    printed_with: tuple[tuple[str, str], ...]
    held: MeasuredPrint

    def __post_init__(self) -> None:
        freeze_arrays(self, upright="float: 3 3")


@final
@frozen
class LyingScan:
    """A scan of a part before anything is printed on it.

    Attributes:
        scan: as read.
        unit: of its coordinates.
        part: name of the part's file.
        given: whether the pose it began from was given.
        most: largest offset that is allowed [mm].
        mesh: name of the file of the surface that is there.
        lying: how it lies.
    """

    scan: Scan
    unit: str
    part: str
    given: bool
    most: float
    mesh: str
    lying: LyingPart
