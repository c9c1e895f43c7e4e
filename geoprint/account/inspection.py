"""What is said of an examined mesh file: the lines that a person reads, and the object for programs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import final

from geoprint.account.records.rounding import as_json, rounded
from geoprint.account.summary import record_preparation
from geoprint.export import Json
from geoprint.results import FileInspection
from geoprint.surfaces import in_words
from geoprint.surfaces.files import LONGEST_NAME
from geoprint.surfaces.remesh import TERRACE_SHARE, TERRACE_WAVELENGTH
from geoprint.surfaces.repair import Defect

# Regions and rims that a person reads; more are in the JSON.
MOST_REGIONS = 30
MOST_RIMS = 5


@final
@dataclass(frozen=True, slots=True)
class PieceRecord:
    """A connected piece of the mesh: its faces, their area, and a place on it."""

    faces: int
    area_mm2: float
    place_mm: tuple[float, ...]


@final
@dataclass(frozen=True, slots=True)
class RegionRecord:
    """A region that the file names."""

    name: str
    faces: int
    area_mm2: float


@final
@dataclass(frozen=True, slots=True)
class RimRecord:
    """A closed part of the border: its length and edges all around, and a place on it."""

    length_mm: float
    edges: int
    place_mm: tuple[float, ...]


@final
@dataclass(frozen=True, slots=True)
class FlawRecord:
    """How often something is wrong, None where it could not be counted, and where the first of them are."""

    count: int | None
    places_mm: tuple[tuple[float, ...], ...]


@final
@dataclass(frozen=True, slots=True)
class InspectionRecord:
    """What `geoprint inspect` says; the fields are the keys of `--json` in their order, lengths are rounded.

    Attributes:
        name: of the file.
        unit: that it was read in.
        unit_assumed: whether the unit is a guess from the size.
        unit_hint: where the size is unusual, what that may mean.
        size_mm: extents.
        vertices: of the examined mesh, and
        faces: its triangles.
        components: the largest first.
        border: the longest rim first.
        genus: number of handles; None where there are several pieces or it is no manifold.
        nonmanifold_edges: edges with more than two faces.
        nonmanifold_vertices: vertices in which several fans of faces touch.
        flipped_faces: faces wound against most of their piece.
        slivers: faces that are very thin.
        crossings: pairs of faces that cross or lie on each other.
        crossings_complete: whether all pairs were looked at.
        preparation: what preparing changes and leaves, or None where it refuses.
        changes: the changes in words, or None.
        refusal: why preparing refuses, or None.
        regions: in the order of the file.
        outside: what tells which side of it is outside.
        terraces_mm: height of the steps where the surface is a staircase around voxels, else None.
        backends: by name, 'yes', or why one cannot plan on it or was not tried.
    """

    name: str
    unit: str
    unit_assumed: bool
    unit_hint: str | None
    size_mm: tuple[float, ...]
    vertices: int
    faces: int
    components: tuple[PieceRecord, ...]
    border: tuple[RimRecord, ...]
    genus: int | None
    nonmanifold_edges: FlawRecord
    nonmanifold_vertices: FlawRecord
    flipped_faces: FlawRecord
    slivers: FlawRecord
    crossings: FlawRecord
    crossings_complete: bool
    preparation: dict[str, Json] | None
    changes: tuple[str, ...] | None
    refusal: str | None
    regions: tuple[RegionRecord, ...]
    outside: str
    terraces_mm: float | None
    backends: dict[str, str]


def inspection_summary(seen: FileInspection) -> dict[str, Json]:
    """Return what `geoprint inspect --json` prints."""
    return asdict(inspection_record(seen))


def inspection_text(seen: FileInspection) -> str:
    """Return the lines that a person reads."""
    return "\n".join(_lines(inspection_record(seen)))


def inspection_record(seen: FileInspection) -> InspectionRecord:
    """Return what is said of a file, its figures rounded and named."""
    found, done = seen.found, seen.found.preparation
    return InspectionRecord(
        name=seen.name,
        unit=seen.unit,
        unit_assumed=seen.assumed,
        unit_hint=seen.hint,
        size_mm=_place(seen.size),
        vertices=len(found.examined.vertices),
        faces=len(found.examined.faces),
        components=tuple(PieceRecord(faces, rounded(area), _place(place)) for faces, area, place in found.components),
        border=tuple(RimRecord(rounded(rim.length), rim.edges, _place(rim.place)) for rim in found.rims),
        genus=found.genus,
        nonmanifold_edges=_flaw(found.nonmanifold_edges),
        nonmanifold_vertices=_flaw(found.nonmanifold_vertices),
        flipped_faces=_flaw(found.flipped_faces),
        slivers=_flaw(found.slivers),
        crossings=_flaw(found.crossings),
        crossings_complete=found.crossings_complete,
        preparation=None if done is None else as_json(record_preparation(done)),
        changes=None if done is None else done.repairs.changes(),
        refusal=found.refusal,
        regions=tuple(RegionRecord(name, faces, rounded(area)) for name, faces, area in seen.regions),
        outside=seen.side,
        terraces_mm=None if seen.terraces is None else rounded(seen.terraces),
        backends=dict(seen.backends),
    )


def _lines(record: InspectionRecord) -> Iterator[str]:
    guessed = " (assumed from the size: give `--unit`)" if record.unit_assumed else ""
    spans = " x ".join(f"{extent:.4g}" for extent in record.size_mm)
    yield f"{record.name}: {record.faces} faces, {spans} mm, read in {record.unit}{guessed}"
    if record.unit_hint:
        yield f"warning: {record.unit_hint}"
    yield f"pieces: {len(record.components)}; genus: {'unknown' if record.genus is None else record.genus}"
    yield _border_line(record)
    yield f"outside: {record.outside}"
    yield from _flaw_lines(record)
    if record.terraces_mm is not None:
        wavelength, deviation = TERRACE_WAVELENGTH * record.terraces_mm, TERRACE_SHARE * record.terraces_mm
        yield (
            f"staircase: steps of {record.terraces_mm:.3g} mm, as around voxels; `geoprint remesh {record.name} "
            f"--smooth {wavelength:.3g} --max-deviation {deviation:.2g} --out part.ply` takes them off"
        )
    if not record.crossings_complete:
        yield "not checked: crossings between all pairs of faces"
    if record.refusal is not None:
        yield f"refused: {record.refusal}"
    elif record.changes is not None:
        yield f"preparing changes: {'; '.join(record.changes) or 'nothing'}"
    for region in record.regions[:MOST_REGIONS]:
        yield f"region '{region.name[:LONGEST_NAME]}': {region.faces} faces, {region.area_mm2:.4g} mm2"
    if len(record.regions) > MOST_REGIONS:
        yield f"and {len(record.regions) - MOST_REGIONS} more regions: `--json` lists all"
    for name, answer in record.backends.items():
        yield f"{name:<15}{answer}"


def _border_line(record: InspectionRecord) -> str:
    rims = record.border
    if not rims:
        return "border: none, the surface is closed"
    numbered = enumerate(rims[:MOST_RIMS], start=1)
    shown = "; ".join(
        f"{f'loop {number}, ' if len(rims) > 1 else ''}{rim.length_mm:.4g} mm at {in_words(rim.place_mm)}"
        for number, rim in numbered
    )
    more = f"; and {len(rims) - MOST_RIMS} more" if len(rims) > MOST_RIMS else ""
    what = "outer border and holes" if len(record.components) == 1 and len(rims) > 1 else "border"
    return f"{what}: {len(rims)}, {shown}{more}"


def _flaw_lines(record: InspectionRecord) -> Iterator[str]:
    for name, flaw in (
        ("nonmanifold edges", record.nonmanifold_edges),
        ("nonmanifold vertices", record.nonmanifold_vertices),
        ("flipped faces", record.flipped_faces),
        ("slivers", record.slivers),
        ("crossings", record.crossings),
    ):
        if flaw.count != 0:
            count = "not countable" if flaw.count is None else str(flaw.count)
            places = f", the first at {in_words(flaw.places_mm[0])}" if flaw.places_mm else ""
            yield f"{name}: {count}{places}"


def _flaw(finding: Defect) -> FlawRecord:
    return FlawRecord(finding.count, tuple(map(_place, finding.places)))


def _place(place: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(map(rounded, place))
