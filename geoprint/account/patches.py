"""What is said of a patch that was cut from a body: the lines that a person reads, and the object for programs."""

from __future__ import annotations

from geoprint.account.records.plan import CutRecord
from geoprint.account.records.rounding import as_json
from geoprint.export import Json
from geoprint.results import Patch


def record_cut(patch: Patch) -> CutRecord:
    """Return how a patch was cut from its body."""
    found = patch.preparation
    return CutRecord(
        body=patch.body.name,
        topology=found.topology,
        area_mm2=found.area,
        rims_mm=found.boundary_lengths,
        faces=found.faces,
        outside=patch.outside,
        inside=patch.inside,
        point_off_body_mm=patch.missed,
        changes=found.repairs.changes(),
    )


def patch_summary(patch: Patch) -> dict[str, Json]:
    """Return what `geoprint patch --json` prints; lengths are mm."""
    return as_json(record_cut(patch))


def patch_text(patch: Patch) -> str:
    """Return the lines that a person reads."""
    told = record_cut(patch)
    lengths = ", ".join(f"{length:.4g}" for length in told.rims_mm)
    rims = f"rim{'s' if len(told.rims_mm) > 1 else ''} {lengths} mm"
    lines = [
        f"patch of {told.body}: {told.topology}, {told.area_mm2:.4g} mm2, {rims}, {told.faces} faces",
        f"outside: {told.outside}",
    ]
    if told.inside is not None:
        lines.append(f"inside: {told.inside}")
    if told.changes:
        lines.append(f"preparing changed: {'; '.join(told.changes)}")
    return "\n".join(lines)
