"""The mesh doctor on a file: what it is, what preparing it would change, and which backends can plan it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geoprint.backends import BACKENDS
from geoprint.errors import GeoprintError
from geoprint.model import Seed, Surface
from geoprint.results import FileInspection
from geoprint.surfaces import boundary_half_edges, boundary_seed, face_areas, point_seed
from geoprint.surfaces.files import load_file, suggested_unit, unit_hint
from geoprint.surfaces.repair import Inspection, inspect

# Levels of the trial plan: coarse, since it only tries whether a backend accepts the surface.
TRIAL_LEVELS = 4
# Larger surfaces are not tried: that would take longer than everything else.
TRIAL_FACES = 100_000
NOT_TRIED = "not tried"
POSSIBLE = "yes"


def inspect_file(
    path: Path, *, unit: str | None = None, label: int | None = None, longest_hole: float | None = None
) -> FileInspection:
    """Examine a mesh file.

    Args:
        path: of the file.
        unit: of its coordinates; where neither this nor the file says it, the likely one is assumed and said so.
        label: of a label volume, which one is meant.
        longest_hole: holes up to this long [mm] count as closed by preparing.

    Raises:
        UsageError: the unit is unknown or not that of the file, or the label is missing or not in the file.
        InputError: the file cannot be read.
    """
    suggested, assumed = (unit, False) if unit is not None else suggested_unit(path, label=label)
    loaded = load_file(path, unit=suggested, label=label)
    found = inspect(loaded.surface, longest_hole=longest_hole)
    areas = face_areas(loaded.surface)
    return FileInspection(
        name=path.name,
        unit=loaded.unit,
        assumed=assumed,
        hint=unit_hint(found.examined, unit=loaded.unit),
        size=tuple(np.ptp(found.examined.vertices[found.examined.faces.ravel()], axis=0).tolist()),
        found=found,
        regions=tuple((name, faces.size, float(areas[faces].sum())) for name, faces in loaded.regions.items()),
        backends=tuple((name, _trial(name, found)) for name in BACKENDS),
    )


def _trial(name: str, found: Inspection) -> str:
    """Return whether a backend plans a few levels on the prepared surface, or its own words why not."""
    if found.refusal is not None:
        return "no: preparing refuses the mesh"
    surface = found.examined
    if len(surface.faces) > TRIAL_FACES:
        return f"{NOT_TRIED}: {len(surface.faces)} faces, {TRIAL_FACES} at most are tried; plan it"
    try:
        backend, seed = BACKENDS[name](surface), _seed(surface)
        backend.contours(seed, spacing=backend.distance(seed).maximum / TRIAL_LEVELS)
    except GeoprintError as error:
        return f"no: {error}"
    return POSSIBLE if boundary_half_edges(surface.faces).size else f"{POSSIBLE}, with `--seed X Y Z`: it is closed"


def _seed(surface: Surface) -> Seed:
    """Return the border, or some point of a closed surface."""
    if boundary_half_edges(surface.faces).size:
        return boundary_seed(surface)
    return point_seed(surface, surface.vertices[surface.faces[0, 0]], tolerance=1.0)
