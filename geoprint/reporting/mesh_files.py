"""What is said of an examined mesh file, and of a part with another mesh."""

from __future__ import annotations

from collections.abc import Iterator
from string import ascii_uppercase

import numpy as np

from geoprint.errors import how_many, percent
from geoprint.geometry import (
    TERRACE_SHARE,
    TERRACE_WAVELENGTH,
    Distances,
    Landmark,
    Rim,
    edge_lengths,
    in_words,
    smallest_angles,
)
from geoprint.geometry.files import LONGEST_NAME, LabelFound
from geoprint.model import Reading, Rounded, Surface
from geoprint.postprocessor import Json
from geoprint.reporting.plan import record_preparation
from geoprint.reporting.records.plan import PreparationRecord
from geoprint.reporting.records.rounding import Record, as_json
from geoprint.results import FileInspection, Remeshed, VolumeInspection

# What is said of an examined mesh file: the lines that a person reads, and the object for programs.


# Regions and rims that a person reads; more are in the JSON.
MOST_REGIONS = 30
MOST_RIMS = 5
# Places that are listed and drawn, and labels that a line names as touched.
MOST_LANDMARKS = 12
MOST_CONTACTS = 4


class PieceRecord(Record):
    """A connected piece of the mesh: its faces, their area, and a place on it."""

    faces: int
    area_mm2: Rounded
    place_mm: tuple[Rounded, ...]


class RegionRecord(Record):
    """A region that the file names."""

    name: str
    faces: int
    area_mm2: Rounded


class FlawRecord(Record):
    """How often something is wrong, None where it could not be counted, and where the first of them are."""

    count: int | None
    places_mm: tuple[tuple[Rounded, ...], ...]


class VolumeRecord(Record):
    """What `geoprint inspect --json` says of a volume without a mesh.

    Attributes:
        name: of the file.
        labels: that it holds.
        refusal: why no surface can be put around the label, or None where none was chosen of several.
        reading: what was used of the file, skipped and assumed.
    """

    name: str
    labels: tuple[LabelFound, ...]
    refusal: str | None
    reading: Reading


class InspectionRecord(Record):
    """What `geoprint inspect` says; the fields are the keys of `--json` in their order, lengths are rounded.

    Attributes:
        name: of the file.
        unit: that it was read in.
        unit_assumed: whether the unit is a guess from the size.
        unit_hint: where the size is unusual, what that may mean.
        low_mm: lowest, and
        high_mm: highest coordinates.
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
        reading: what was used of the file, skipped and assumed.
        labels: that a label volume holds.
        landmarks: places to find the way by; none where preparing refuses the mesh.
        label: of which the surface is, or None.
    """

    name: str
    unit: str
    unit_assumed: bool
    unit_hint: str | None
    low_mm: tuple[Rounded, ...]
    high_mm: tuple[Rounded, ...]
    size_mm: tuple[Rounded, ...]
    vertices: int
    faces: int
    components: tuple[PieceRecord, ...]
    border: tuple[Rim, ...]
    genus: int | None
    nonmanifold_edges: FlawRecord
    nonmanifold_vertices: FlawRecord
    flipped_faces: FlawRecord
    slivers: FlawRecord
    crossings: FlawRecord
    crossings_complete: bool
    preparation: PreparationRecord | None
    changes: tuple[str, ...] | None
    refusal: str | None
    regions: tuple[RegionRecord, ...]
    outside: str
    terraces_mm: Rounded | None
    backends: dict[str, str]
    reading: Reading
    labels: tuple[LabelFound, ...]
    landmarks: tuple[Landmark, ...]
    label: int | None


def inspection_summary(seen: FileInspection | VolumeInspection) -> dict[str, Json]:
    """Return what `geoprint inspect --json` prints."""
    if isinstance(seen, VolumeInspection):
        return as_json(VolumeRecord.of(seen))
    return as_json(inspection_record(seen))


def inspection_text(seen: FileInspection | VolumeInspection) -> str:
    """Return the lines that a person reads."""
    record = [seen.reading.text] if seen.reading.text else []
    if isinstance(seen, VolumeInspection):
        first = f"{seen.name}: a volume of {how_many(len(seen.labels), 'label')}"
        advice = f"`geoprint inspect {seen.name} --label N` examines the surface around one of them"
        last = advice if seen.refusal is None else f"refused: {seen.refusal}"
        return "\n".join([first, *_label_lines(seen.labels), *record, last])
    return "\n".join([*_lines(inspection_record(seen)), *record])


def inspection_record(seen: FileInspection) -> InspectionRecord:
    """Return what is said of a file, its figures rounded and named."""
    found, done = seen.found, seen.found.preparation
    return InspectionRecord.of(
        found,
        name=seen.name,
        unit=seen.unit,
        unit_assumed=seen.assumed,
        unit_hint=seen.hint,
        low_mm=seen.low,
        high_mm=seen.high,
        size_mm=tuple(high - low for low, high in zip(seen.low, seen.high, strict=True)),
        vertices=len(found.examined.vertices),
        faces=len(found.examined.faces),
        components=tuple(
            PieceRecord(faces=faces, area_mm2=area, place_mm=place) for faces, area, place in found.components
        ),
        border=found.rims,
        preparation=None if done is None else record_preparation(done),
        changes=None if done is None else done.repairs.changes(),
        regions=tuple(RegionRecord(name=name, faces=faces, area_mm2=area) for name, faces, area in seen.regions),
        outside=seen.side,
        terraces_mm=seen.terraces,
        backends=dict(seen.backends),
        reading=seen.reading,
        labels=seen.labels,
        landmarks=seen.landmarks,
        label=seen.label,
    )


def _lines(record: InspectionRecord) -> Iterator[str]:
    guessed = " (assumed from the size: give `--unit`)" if record.unit_assumed else ""
    spans = " x ".join(f"{extent:.4g}" for extent in record.size_mm)
    box = f"from {in_words(record.low_mm)} to {in_words(record.high_mm)}"
    yield f"{record.name}: {how_many(record.faces, 'face')}, {spans} mm, {box}, read in {record.unit}{guessed}"
    if record.unit_hint:
        yield f"warning: {record.unit_hint}"
    yield f"components: {len(record.components)}; genus: {'unknown' if record.genus is None else record.genus}"
    yield _border_line(record)
    yield f"outside: {record.outside}"
    yield from _flaw_lines(record)
    if record.terraces_mm is not None:
        wavelength, deviation = TERRACE_WAVELENGTH * record.terraces_mm, TERRACE_SHARE * record.terraces_mm
        yield (
            f"staircase: steps of {record.terraces_mm:.3g} mm, as around voxels; `geoprint remesh {record.name} "
            f"--smooth {wavelength:.3g} --max-deviation {deviation:.2g} --out part.ply` removes them"
        )
    if not record.crossings_complete:
        yield "not checked: crossings between all pairs of faces"
    if record.refusal is not None:
        yield f"refused: {record.refusal}"
    elif record.changes is not None:
        yield f"preparing changes: {'; '.join(record.changes) or 'nothing'}"
    yield from _label_lines(tuple(one for one in record.labels if record.label in {None, one.label}))
    yield from _landmark_lines(record)
    for region in record.regions[:MOST_REGIONS]:
        yield f"region '{region.name[:LONGEST_NAME]}': {how_many(region.faces, 'face')}, {region.area_mm2:.4g} mm2"
    if len(record.regions) > MOST_REGIONS:
        yield f"and {len(record.regions) - MOST_REGIONS} more regions: `--json` lists all"
    for name, answer in record.backends.items():
        yield f"{name:<15}{answer}"


def _label_lines(labels: tuple[LabelFound, ...]) -> Iterator[str]:
    for one in labels:
        named = f" '{one.name[:LONGEST_NAME]}'" if one.name else ""
        spans = " x ".join(f"{high - low:.4g}" for low, high in zip(one.low, one.high, strict=True))
        yield (
            f"label {one.label}{named}: {how_many(one.voxels, 'voxel')}, {one.volume / 1000.0:.4g} cm3, {spans} mm "
            f"from {in_words(one.low)} to {in_words(one.high)}{_contacts(one)}"
        )


def _contacts(one: LabelFound) -> str:
    """Return in which label another lies, and which it touches over how much of its surface."""
    inside = "" if one.inside is None else f"; lies inside label {one.inside}"
    shown = [
        f"label {each.label} over {percent(each.share)}" for each in one.touches[:MOST_CONTACTS] if each.share >= 0.005
    ]
    free = 1.0 - sum(each.share for each in one.touches)
    last = f", no label over {percent(free)}" if free >= 0.005 else ""
    return f"{inside}; touches {', '.join(shown)} of its surface{last}" if shown else ""


def _landmark_lines(record: InspectionRecord) -> Iterator[str]:
    """Yield places as a command takes them; loops of the border stand in their own line."""
    shown = record.landmarks[:MOST_LANDMARKS]
    if not shown:
        return
    yield "points, as `--at X Y Z` takes them (`--from near:X,Y,Z` with commas), and outward normals:"
    widest = max(len(one.name) for one in shown)
    for letter, one in zip(ascii_uppercase, shown, strict=False):
        place = " ".join(f"{value:z8.2f}" for value in one.place)
        normal = " ".join(f"{value:z5.2f}" for value in one.normal)
        yield f"  {letter} {one.name:<{widest}} {place}   {normal}"
    if len(record.landmarks) > len(shown):
        yield f"and {how_many(len(record.landmarks) - len(shown), 'more point')}: `--json` lists all"


def _border_line(record: InspectionRecord) -> str:
    rims = record.border
    if not rims:
        return "border: none, the surface is closed"
    numbered = enumerate(rims[:MOST_RIMS], start=1)
    shown = "; ".join(
        f"{f'loop {number}, ' if len(rims) > 1 else ''}{rim.length:.4g} mm at {in_words(rim.place)}, around "
        f"{in_words(rim.centre)}"
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


# What is said of a part with another mesh: the lines that a person reads, and the object for programs.


class FinenessRecord(Record):
    """How fine and how even a mesh is: mean of its edges and their standard deviation over it, its smallest angles."""

    faces: int
    edge_mean_mm: Rounded
    edge_cv: Rounded
    smallest_angle_deg: Rounded
    smallest_angle_p1_deg: Rounded


class DeviationRecord(Record):
    """How far two surfaces lie apart in both directions, and their rims, and how far they may."""

    old_to_new: Distances
    new_to_old: Distances
    rim_max_mm: Rounded
    allowed_mm: Rounded


class RemeshingRecord(Record):
    """What `geoprint remesh` says; the fields are the keys of `--json` in their order.

    Attributes:
        name: of the part.
        steps: what was done, in words.
        topology: which both meshes have.
        preparation: what preparing the part changed, in words.
        before: the mesh as prepared.
        after: the new one.
        deviation: how far they lie apart.
    """

    name: str
    steps: tuple[str, ...]
    topology: str
    preparation: tuple[str, ...]
    before: FinenessRecord
    after: FinenessRecord
    deviation: DeviationRecord


def remeshing_summary(found: Remeshed) -> dict[str, Json]:
    """Return what `geoprint remesh --json` prints."""
    return as_json(_record(found))


def remeshing_text(found: Remeshed) -> str:
    """Return the lines that a person reads."""
    record = _record(found)
    deviation = record.deviation
    rim = f"; rims at most {deviation.rim_max_mm:.3f} mm" if found.preparation.boundary_lengths else ""
    return "\n".join(
        [
            f"{record.name}: {'; '.join([*record.preparation, *record.steps])}",
            f"before: {_mesh_text(record.before)}",
            f"after:  {_mesh_text(record.after)}",
            f"old surface to new: {_distances_text(deviation.old_to_new)}",
            f"new surface to old: {_distances_text(deviation.new_to_old)}{rim}; {deviation.allowed_mm:.3g} mm allowed",
        ]
    )


def _record(found: Remeshed) -> RemeshingRecord:
    return RemeshingRecord(
        name=found.before.name,
        steps=found.steps,
        topology=found.preparation.topology,
        preparation=found.preparation.repairs.changes(),
        before=_mesh(found.before),
        after=_mesh(found.after),
        deviation=DeviationRecord(
            old_to_new=found.deviation.forward,
            new_to_old=found.deviation.backward,
            rim_max_mm=found.deviation.rim,
            allowed_mm=found.allowed,
        ),
    )


def _mesh(surface: Surface) -> FinenessRecord:
    lengths, angles = edge_lengths(surface), np.degrees(smallest_angles(surface))
    return FinenessRecord(
        faces=len(surface.faces),
        edge_mean_mm=float(lengths.mean()),
        edge_cv=float(lengths.std() / lengths.mean()),
        smallest_angle_deg=float(angles.min()),
        smallest_angle_p1_deg=float(np.quantile(angles, 0.01)),
    )


def _mesh_text(mesh: FinenessRecord) -> str:
    return (
        f"{how_many(mesh.faces, 'face')}, edges {mesh.edge_mean_mm:.3g} mm (CV {mesh.edge_cv:.2f}), smallest angle "
        f"{mesh.smallest_angle_deg:.3g} degrees, 1 % below {mesh.smallest_angle_p1_deg:.3g}"
    )


def _distances_text(found: Distances) -> str:
    """Return lengths to a thousandth of a mm, below which no printer tells a difference."""
    return (
        f"largest {found.largest:.3f} mm at {in_words(found.place)}, proven below {found.bound:.3f}; "
        f"mean {found.mean:.3f}, 95 % below {found.p95:.3f}"
    )
