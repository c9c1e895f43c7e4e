"""What the layers of a job fill: read from a mesh or a table, and laid over the part."""

from __future__ import annotations

import hashlib

import numpy as np

from geoprint.backends import Piecewise, most_accurate_backend
from geoprint.config import Job
from geoprint.deposition import between
from geoprint.errors import InputError, UsageError
from geoprint.layers import LayerTarget, TargetShape, TargetThickness
from geoprint.model import FloatArray, Surface
from geoprint.pipeline.number_tables import read_thicknesses
from geoprint.results import TargetFile
from geoprint.surfaces import boundary_seed, closest, in_words
from geoprint.surfaces.files import load_file, stored_mesh
from geoprint.surfaces.remesh import refine
from geoprint.surfaces.repair import prepare

TABLE = ".csv"
# Points of a table may lie off the part by this [mm]: what is read off a screen is rounded.
TABLE_TOLERANCE = 1.0
# A thickness is linear in triangles of this many across the part, and of as many up a feathered rim.
ACROSS, UP_A_RIM = 100, 6
# But in no more across the part than this.
MOST_ACROSS = 800


def read_target(job: Job) -> TargetFile | None:
    """Read the file of a job's target; None where it names none.

    Raises:
        UsageError: the unit of a mesh is unclear.
        InputError: it cannot be read.
    """
    if job.target is None:
        return None
    if job.target.suffix.lower() == TABLE:
        places, values = read_thicknesses(job.target)
        content = job.target.read_bytes()
        digest = hashlib.sha256(content).hexdigest()
        return TargetFile(job.target.name, digest, "mm", content, np.column_stack([places, values]))
    file = load_file(job.target, unit=job.unit)
    return TargetFile(file.name, file.digest, file.unit, stored_mesh(file), prepare(file.surface)[0])


def target_over(job: Job, file: TargetFile | None, part: Surface) -> LayerTarget | None:
    """Return what the layers of a job fill; None for one thickness everywhere.

    Args:
        job: its thickness and its feather.
        file: its target as read.
        part: that the lowest layer lies on.

    Raises:
        UsageError: a feather is given for a shape, or for a part without a rim.
        InputError: a point of the table lies off the part.
        FieldError: nothing of the target is over the part.
        MeshError: the shape is open.
    """
    table = None if file is None else file.content
    if isinstance(table, Surface):
        if job.feather is not None:
            raise UsageError(f"the target {table.name} ends as its shape says: leave `--feather` out.")
        return TargetShape(table, part)
    if table is None and job.feather is None:
        return None
    size = float(np.linalg.norm(np.ptp(part.vertices, axis=0)))
    rise = size if job.feather is None else job.feather / UP_A_RIM
    fine = refine(part, edge_length=min(size / ACROSS, max(rise, size / MOST_ACROSS)))
    if file is None or table is None:
        thickness = np.full(len(fine.vertices), job.thickness)
    else:
        check_on_part(table[:, :3], fine, name=file.name)
        thickness = between(table[:, :3], table[:, 3], fine.vertices)
    if job.feather is not None:
        thickness = thickness * np.minimum(_from_rim(fine) / job.feather, 1.0)
    return TargetThickness(fine, thickness)


def check_on_part(places: FloatArray, part: Surface, *, name: str) -> None:
    """Check that the (k, 3) points of a table lie on a part.

    Raises:
        InputError: one lies off it; says which.
    """
    _, away = closest(part, places)
    if away.max() > TABLE_TOLERANCE:
        worst = int(away.argmax())
        raise InputError(
            f"{name}: the point {in_words(places[worst])} is {away[worst]:.3g} mm off {part.name}, allowed are "
            f"{TABLE_TOLERANCE:g} mm: give points on the part, in its coordinates and in mm.",
            distance=float(away[worst]),
        )


def _from_rim(part: Surface) -> FloatArray:
    """Return (n,) the distance of the vertices from the rim along the surface [mm].

    It is measured by the backend that is nearest to the true one, whichever plans the paths.
    """
    try:
        rim = boundary_seed(part)
    except InputError as error:
        raise UsageError(
            f"{part.name} has no rim that the thickness could rise from: leave `--feather` out."
        ) from error
    return Piecewise(part, most_accurate_backend().factory).distance(rim).values
