"""What is said of a patch that was cut from a body: the lines that a person reads, and the object for programs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import final

from geoprint.account.rounding import rounded
from geoprint.export import Json
from geoprint.results import Patch


@final
@dataclass(frozen=True, slots=True)
class PatchRecord:
    """What `geoprint patch` says, and plan.json of each patch; the fields are the keys in their order.

    Attributes:
        body: name of what it was cut from.
        topology: of the patch.
        area_mm2: of the patch.
        rims_mm: their lengths, the longest first.
        faces: how many.
        outside: how it is known which side is outside.
        inside: what a drawn curve encloses and which side of it was taken, or None without one.
        point_off_body_mm: how far the given points lie off the body at most, or None without a point.
        changes: what preparing changed, in words.
    """

    body: str
    topology: str
    area_mm2: float
    rims_mm: tuple[float, ...]
    faces: int
    outside: str
    inside: str | None
    point_off_body_mm: float | None
    changes: tuple[str, ...]


def patch_record(patch: Patch) -> PatchRecord:
    """Return what is said of a patch, its figures rounded and named."""
    found = patch.preparation
    return PatchRecord(
        body=patch.body.name,
        topology=found.topology,
        area_mm2=rounded(found.area),
        rims_mm=tuple(map(rounded, found.boundary_lengths)),
        faces=found.faces,
        outside=patch.outside,
        inside=patch.inside,
        point_off_body_mm=None if patch.missed is None else rounded(patch.missed),
        changes=found.changes(),
    )


def patch_summary(patch: Patch) -> dict[str, Json]:
    """Return what `geoprint patch --json` prints."""
    return asdict(patch_record(patch))


def patch_text(patch: Patch) -> str:
    """Return the lines that a person reads."""
    record = patch_record(patch)
    lengths = ", ".join(f"{length:.4g}" for length in record.rims_mm)
    rims = f"rim{'s' if len(record.rims_mm) > 1 else ''} {lengths} mm"
    lines = [
        f"patch of {record.body}: {record.topology}, {record.area_mm2:.4g} mm2, {rims}, {record.faces} faces",
        f"outside: {record.outside}",
    ]
    if record.inside is not None:
        lines.append(f"inside: {record.inside}")
    if record.changes:
        lines.append(f"preparing changed: {'; '.join(record.changes)}")
    return "\n".join(lines)
