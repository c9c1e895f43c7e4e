"""The mesh doctor on a file: what it is, what preparing it would change, and which backends can plan it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import final

import numpy as np

from geoprint.account.rounding import all_rounded, rounded
from geoprint.backends import backend as find_backend, backend_names
from geoprint.errors import GeoprintError
from geoprint.export import Json
from geoprint.model import Seed, Surface
from geoprint.surfaces import boundary_half_edges, boundary_seed, face_areas, in_words, point_seed
from geoprint.surfaces.files import LONGEST_NAME, load_file, suggested_unit, unit_hint
from geoprint.surfaces.repair import Defect, Inspection, inspect

# Levels of the trial plan: coarse, since it only tries whether a backend accepts the surface.
TRIAL_LEVELS = 4
# Larger surfaces are not tried: that would take longer than everything else.
TRIAL_FACES = 100_000
# Regions that a person reads; more are in the JSON.
MOST_REGIONS = 30
NOT_TRIED = "not tried"
POSSIBLE = "yes"


@final
@dataclass(frozen=True, slots=True, eq=False)
class FileInspection:
    """What the mesh doctor says of a file.

    Attributes:
        name: of the file.
        unit: that it was read in.
        assumed: whether the unit is a guess from the size, because neither file nor user said it.
        hint: where the size is unusual, what that may mean.
        size: extents [mm].
        found: the examination of the mesh.
        regions: name, number of faces and area [mm2] of each that the file has.
        backends: by name, POSSIBLE, or why a backend cannot plan on it, or that it was NOT_TRIED and why.
    """

    name: str
    unit: str
    assumed: bool
    hint: str | None
    size: tuple[float, ...]
    found: Inspection
    regions: tuple[tuple[str, int, float], ...]
    backends: tuple[tuple[str, str], ...]


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
        backends=tuple((name, _trial(name, found)) for name in backend_names()),
    )


def inspection_summary(seen: FileInspection) -> dict[str, Json]:
    """Return what `geoprint inspect --json` prints; lengths are mm."""
    found = seen.found
    return {
        "name": seen.name,
        "unit": seen.unit,
        "unit_assumed": seen.assumed,
        "unit_hint": seen.hint,
        "size_mm": all_rounded(seen.size),
        "vertices": len(found.examined.vertices),
        "faces": len(found.examined.faces),
        "components": [
            {"faces": faces, "area_mm2": rounded(area), "place_mm": all_rounded(place)}
            for faces, area, place in found.components
        ],
        "border": [
            {"length_mm": rounded(rim.length), "edges": rim.edges, "place_mm": all_rounded(rim.place)}
            for rim in found.rims
        ],
        "genus": found.genus,
        **{name: _finding(finding) for name, finding in _findings(found)},
        "crossings_complete": found.crossings_complete,
        "preparation": None if found.preparation is None else asdict(found.preparation),
        "changes": None if found.preparation is None else list(found.preparation.changes()),
        "refusal": found.refusal,
        "regions": [{"name": name, "faces": faces, "area_mm2": rounded(area)} for name, faces, area in seen.regions],
        "backends": dict(seen.backends),
    }


def inspection_text(seen: FileInspection) -> str:
    """Return the lines that a person reads."""
    found = seen.found
    guessed = " (assumed from the size: give `--unit`)" if seen.assumed else ""
    spans = " x ".join(f"{extent:.4g}" for extent in seen.size)
    lines = [
        f"{seen.name}: {len(found.examined.faces)} faces, {spans} mm, read in {seen.unit}{guessed}",
        *([f"note: {seen.hint}"] if seen.hint else []),
        f"pieces: {len(found.components)}; genus: {'unknown' if found.genus is None else found.genus}",
        _border_text(found),
    ]
    for name, finding in _findings(found):
        if finding.count != 0:
            count = "not countable" if finding.count is None else str(finding.count)
            places = f", the first at {in_words(finding.places[0])}" if finding.places else ""
            lines.append(f"{name.replace('_', ' ')}: {count}{places}")
    if not found.crossings_complete:
        lines.append("crossings: not all pairs of faces were looked at")
    if found.refusal is not None:
        lines.append(f"refused: {found.refusal}")
    elif found.preparation is not None:
        lines.append(f"preparing changes: {'; '.join(found.preparation.changes()) or 'nothing'}")
    lines += [
        f"region '{name[:LONGEST_NAME]}': {faces} faces, {area:.4g} mm2"
        for name, faces, area in seen.regions[:MOST_REGIONS]
    ]
    if len(seen.regions) > MOST_REGIONS:
        lines.append(f"and {len(seen.regions) - MOST_REGIONS} more regions: `--json` lists all")
    lines += [f"{name:<14}{answer}" for name, answer in seen.backends]
    return "\n".join(lines)


def _trial(name: str, found: Inspection) -> str:
    """Return whether a backend plans a few levels on the prepared surface, or its own words why not."""
    if found.refusal is not None:
        return "no: preparing refuses the mesh"
    surface = found.examined
    if len(surface.faces) > TRIAL_FACES:
        return f"{NOT_TRIED}: {len(surface.faces)} faces, {TRIAL_FACES} at most are tried; plan it"
    try:
        backend, seed = find_backend(name).factory(surface), _seed(surface)
        backend.contours(seed, spacing=backend.distance(seed).maximum / TRIAL_LEVELS)
    except GeoprintError as error:
        return f"no: {error}"
    return POSSIBLE if boundary_half_edges(surface.faces).size else f"{POSSIBLE}, with `--seed X Y Z`: it is closed"


def _seed(surface: Surface) -> Seed:
    """Return the border, or some point of a closed surface."""
    if boundary_half_edges(surface.faces).size:
        return boundary_seed(surface)
    return point_seed(surface, surface.vertices[surface.faces[0, 0]], tolerance=1.0)


def _findings(found: Inspection) -> tuple[tuple[str, Defect], ...]:
    return (
        ("nonmanifold_edges", found.nonmanifold_edges),
        ("nonmanifold_vertices", found.nonmanifold_vertices),
        ("flipped_faces", found.flipped_faces),
        ("slivers", found.slivers),
        ("crossings", found.crossings),
    )


def _finding(finding: Defect) -> dict[str, Json]:
    return {"count": finding.count, "places_mm": [all_rounded(place) for place in finding.places]}


def _border_text(found: Inspection) -> str:
    if not found.rims:
        return "border: none, the surface is closed"
    shown = "; ".join(f"{rim.length:.4g} mm at {in_words(rim.place)}" for rim in found.rims[:5])
    more = f"; and {len(found.rims) - 5} more" if len(found.rims) > 5 else ""
    what = "outer border and holes" if len(found.components) == 1 and len(found.rims) > 1 else "border"
    return f"{what}: {len(found.rims)}, {shown}{more}"
