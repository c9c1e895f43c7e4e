"""What appraisal.json and lying.json say of photographs and scans, with tables and pictures."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from geoprint.geometry import lumped_mass
from geoprint.inspection.against_plan import PrintShift, print_shift
from geoprint.inspection.beads import BeadLine
from geoprint.inspection.camera import Camera
from geoprint.inspection.held import Held, PhotographedParts, doubts, photographed_parts
from geoprint.inspection.overlay import Overlay, overlay_picture, shown_scale
from geoprint.inspection.print import Appraisal, AppraisedPhotograph, OnPlan
from geoprint.inspection.scan import AppraisedScan, LyingScan
from geoprint.inspection.scan_measuring import BARE_RATIO, COVERED_SHARE, MeasuredParts, MeasuredPrint
from geoprint.inspection.scan_registration import Registration
from geoprint.inspection.skeleton import edges
from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.reporting.prints import record_printed
from geoprint.reporting.records.inspection import (
    ApartRecord,
    AppraisalRecord,
    CameraRecord,
    EstimateRecord,
    FromPlanRecord,
    LineRecord,
    LyingRecord,
    OnPlanRecord,
    OutlineRecord,
    PairRecord,
    PartOfRunRecord,
    PhotographedPartRecord,
    PhotographRecord,
    RegistrationRecord,
    Row,
    RunRecord,
    ScanAppraisalRecord,
    ScanFileRecord,
    ScannedRunRecord,
    ShiftRecord,
    sealed,
)
from geoprint.reporting.records.rounding import place_of, stamp

# From appraised photographs to what appraisal.json says of them.


def record_appraisal(found: Appraisal) -> AppraisalRecord:
    """Return what appraisal.json says: the source of text and tables."""
    names = [each.photograph.name for each in found.photographs]
    record = AppraisalRecord(
        **stamp(AppraisalRecord),
        kind="photographs",
        plan=found.plan,
        part=found.part,
        printed=None if found.printed is None else record_printed(found.printed),
        shade=found.shade,
        width_chosen=found.width_chosen,
        threshold_chosen=found.threshold_chosen,
        photographs=tuple(_photograph(each) for each in found.photographs),
        pairs=tuple(
            PairRecord(first=names[one], second=names[other], apart_px=ApartRecord.of(distances))
            for one, other, distances in found.pairs
        ),
    )
    return sealed(record)


def _photograph(each: AppraisedPhotograph) -> PhotographRecord:
    photograph = each.photograph
    widths = np.concatenate([bead.widths[bead.seen] for bead in each.beads])
    return PhotographRecord(
        file=photograph.name,
        sha256=photograph.digest,
        size_px=photograph.size,
        turned=photograph.turned,
        bead_width_px=each.width,
        threshold=each.threshold,
        length_px=sum(bead.length for bead in each.beads),
        width_mean_px=float(widths.mean()),
        width_cv=_cv(widths),
        lines=tuple(_line(bead) for bead in each.beads),
        on_plan=None if each.on_plan is None else _on_plan(each.on_plan),
    )


def _line(bead: BeadLine) -> LineRecord:
    widths = bead.widths[bead.seen]
    arcs = np.concatenate([[0.0], np.cumsum(bead.steps)])
    return LineRecord(
        length_px=bead.length,
        width_mean_px=float(widths.mean()),
        width_cv=_cv(widths),
        closed=bead.closed,
        breaks_px=tuple((float(arcs[first]), float(arcs[last])) for first, last in bead.breaks),
    )


def _on_plan(found: OnPlan) -> OnPlanRecord:
    held, camera = found.held, found.camera
    plan, measured = held.plan, held.measured
    widths, offsets = held.widths[held.sized], held.offsets[held.sized]
    judged, known = float(plan.lengths[held.judged].sum()), bool(held.sized.any())
    return OnPlanRecord(
        camera=CameraRecord.of(
            camera,
            outline=_outline(camera, scale=measured.scale),
            lens_residual_px=camera.lens.residual,
            mm_per_px=measured.scale,
        ),
        reach_mm=held.reach,
        judged=judged / float(plan.lengths.sum()),
        missing=float(plan.lengths[held.judged & ~held.seen].sum()) / judged,
        usual=held.usual if known else None,
        width_mean_mm=float(widths.mean()) if known else None,
        width_planned_mm=float(np.average(held.planned, weights=plan.lengths)),
        width_cv=_cv(held.even[held.sized]) if known else None,
        offset_mean_mm=float(offsets.mean()) if known else None,
        offset_rms_mm=_rms(offsets) if known else None,
        shift=record_shift(held.shift),
        offset_deviation_common_mm=held.pose_deviation,
        blur_px=measured.optics.blur,
        gamma=measured.optics.gamma,
        white=measured.white,
        darker=measured.darker,
        doubts=tuple(doubts(held)),
        strays=held.strays,
        apart_mm=ApartRecord.of(held.apart),
        runs=tuple(_photographed_run(held, number) for number in np.unique(plan.runs).tolist()),
        parts=_photographed_parts(photographed_parts(held)),
    )


def record_shift(found: PrintShift | None) -> ShiftRecord | None:
    """Return what appraisal.json says of a shift of a whole print."""
    return None if found is None else ShiftRecord.of(found)


def _photographed_parts(parts: PhotographedParts) -> tuple[PhotographedPartRecord, ...]:
    return tuple(
        PhotographedPartRecord(
            run=int(parts.runs[k]),
            start_mm=float(parts.starts[k]),
            end_mm=float(parts.ends[k]),
            width_mm=None if width is None else width.value,
            width_deviation_mm=None if width is None else width.deviation,
            width_planned_mm=float(parts.planned[k]),
            offset_mm=None if offset is None else offset.value,
            offset_deviation_mm=None if offset is None else offset.deviation,
        )
        for k, (width, offset) in enumerate(zip(parts.widths, parts.offsets, strict=True))
    )


def _outline(camera: Camera, *, scale: float) -> OutlineRecord | None:
    placing = camera.outline
    if placing is None:
        return None
    return OutlineRecord.of(placing, within_mm=placing.within * scale)


def _photographed_run(held: Held, number: int) -> RunRecord:
    plan = held.plan
    own = plan.runs == number
    there = own & held.sized
    width = held.width(number)
    return RunRecord.of(
        held,
        run=number,
        length_mm=float(plan.lengths[own].sum()),
        judged_mm=float(plan.lengths[own & held.judged].sum()),
        seen_mm=float(plan.lengths[there].sum()),
        missing_mm=float(plan.lengths[own & held.judged & ~held.seen].sum()),
        width_mm=width,
        width_planned_mm=float(np.average(held.planned[own], weights=plan.lengths[own])),
        of_usual=held.share(number),
        whole=held.whole(number),
        width_cv=None if width is None else _cv(held.even[there]),
        offset_mm=held.offset(number),
        offset_rms_mm=None if width is None else _rms(held.offsets[there]),
        gaps_mm=tuple(held.gaps(number)),
        blobs_mm=tuple(held.blobs(number)),
        thin_mm=tuple(held.thin(number)),
    )


def _cv(values: FloatArray) -> float:
    return float(values.std() / values.mean())


def _rms(values: FloatArray) -> float:
    return float(np.sqrt((values**2).mean()))


# From appraised scans to what appraisal.json and lying.json say of them, and the table of the parts of runs.


COLUMNS = (
    "run", "start_mm", "end_mm", "x", "y", "z", "seen", "ratio", "ratio_deviation", "offset_mm", "offset_deviation_mm",
    "crest_mm", "crest_deviation_mm",
)  # fmt: skip


def record_scan(found: AppraisedScan) -> ScanAppraisalRecord:
    """Return what appraisal.json says of a scan of a print: the source of text, table and report."""
    held = found.held
    cells = held.cells
    wanted = cells.planned >= COVERED_SHARE * held.height
    seen = wanted & cells.seen
    area = float(cells.areas[seen].sum())
    volume, planned = _volume(held, seen), float((cells.areas * cells.planned)[seen].sum())
    record = ScanAppraisalRecord(
        **stamp(ScanAppraisalRecord),
        kind="scan",
        printed=record_printed(found.printed),
        scan=ScanFileRecord(
            file=found.scan.name, sha256=found.scan.digest, unit=found.unit, points=found.scan.held, used=held.points
        ),
        registration=_registration(held.registration, given=found.given),
        layer_height_mm=held.height,
        seen=area / float(cells.areas[wanted].sum()),
        covered=_covered(held, seen),
        bare=held.bare,
        volume_seen_mm3=volume,
        volume_ratio=EstimateRecord(value=volume.value / planned, deviation=volume.deviation / planned),
        volume_planned_mm3=held.volume,
        thickness_mm=EstimateRecord(value=volume.value / area, deviation=volume.deviation / area),
        from_plan=_from_plan(held, seen, mean_deviation=volume.deviation / area),
        shift=record_shift(_shift(found)),
        runs=tuple(_run(held.parts, number, found) for number in np.unique(held.parts.runs).tolist()),
        parts=tuple(_part(held.parts, k) for k in range(np.size(held.parts.runs))),
    )
    return sealed(record)


def _shift(found: AppraisedScan) -> PrintShift | None:
    parts, registration = found.held.parts, found.held.registration
    beads = parts.seen & (parts.ratios >= BARE_RATIO)
    return print_shift(
        parts.lefts[beads], parts.offsets[beads], parts.runs[beads], lengths=(parts.ends - parts.starts)[beads],
        spacing=found.spacing, deviation=float(np.sqrt(np.linalg.eigvalsh(registration.covariance[3:, 3:])[-1])),
    )  # fmt: skip


def record_lying(found: LyingScan) -> LyingRecord:
    """Return what lying.json says of a part before it is printed on."""
    part = found.lying
    areas = lumped_mass(part.nominal)
    seen, offsets = areas * part.seen, part.offsets[part.seen]
    return LyingRecord(
        **stamp(LyingRecord),
        part=found.part,
        scan=ScanFileRecord(
            file=found.scan.name, sha256=found.scan.digest, unit=found.unit, points=found.scan.held, used=part.points
        ),
        registration=_registration(part.registration, given=found.given),
        seen=float(seen.sum() / areas.sum()),
        offset_mean_mm=float((seen * part.offsets).sum() / seen.sum()),
        offset_rms_mm=float(np.sqrt((seen * part.offsets**2).sum() / seen.sum())),
        offset_least_mm=float(offsets.min()),
        offset_most_mm=float(offsets.max()),
        deviation_mm=part.deviation,
        residual_mm=part.residual,
        smoothing_mm=part.smoothing,
        allowed_mm=found.most,
        mesh=found.mesh,
    )


def parts_table(parts: MeasuredParts) -> bytes:
    """Return parts.csv: a row a part of a run, empty cells where the scan does not show it."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for k in range(np.size(parts.runs)):
        seen = bool(parts.seen[k])
        values = (parts.ratios, parts.ratio_deviations, parts.offsets, parts.offset_deviations)
        crest = (parts.crests, parts.crest_deviations)
        where = (f"{value:.3f}" for value in (parts.starts[k], parts.ends[k], *parts.places[k]))
        found = (f"{value[k]:.5f}" if seen else "" for value in values)
        high = (f"{value[k]:.5f}" if parts.crested[k] else "" for value in crest)
        writer.writerow((int(parts.runs[k]), *where, int(seen), *found, *high))
    return text.getvalue().encode("utf-8")


def _registration(found: Registration, *, given: bool) -> RegistrationRecord:
    first, second, third, last = (_row(row) for row in found.T_work_scan)
    return RegistrationRecord(
        pose=(first, second, third, last),
        scale=EstimateRecord(value=found.scale, deviation=found.scale_deviation) if found.scaled else None,
        middle_mm=place_of(found.middle),
        covariance=tuple(tuple(float(f"{value:.6g}") for value in row) for row in found.covariance.tolist()),
        shift_deviation_mm=found.shift_deviation,
        turn_deviation_deg=float(np.degrees(found.turn_deviation)),
        given=given,
        loose=len(found.loose),
        noise_mm=found.noise,
        on_part=found.used,
        bead_width=found.spread,
        offset_mm=found.offset,
    )


def _row(values: FloatArray) -> Row:
    a, b, c, d = values.tolist()
    return a, b, c, d


def _volume(held: MeasuredPrint, which: BoolArray) -> EstimateRecord:
    """Return the volume over some cells: noise of each adds up at random, the pose moves all together."""
    cells = held.cells
    areas = cells.areas[which]
    together = areas @ cells.slopes[which]
    pose = together @ held.registration.covariance @ together
    own = np.einsum("ki,ij,kj->k", cells.slopes[which], held.registration.covariance, cells.slopes[which])
    noise = float((areas**2 * np.maximum(cells.deviations[which] ** 2 - own, 0.0)).sum())
    return EstimateRecord(value=float((areas * cells.thickness[which]).sum()), deviation=float(np.sqrt(pose + noise)))


def _covered(held: MeasuredPrint, seen: BoolArray) -> EstimateRecord:
    """Return the share of the area with material; cells count by how surely they have some."""
    from scipy.stats import norm

    cells = held.cells
    areas = cells.areas[seen]
    surely = norm.cdf(
        (cells.thickness[seen] - COVERED_SHARE * cells.planned[seen]) / np.maximum(cells.deviations[seen], 1e-9)
    )
    whole = float(areas.sum())
    variance = float((areas**2 * surely * (1.0 - surely)).sum())
    return EstimateRecord(value=float((areas * surely).sum()) / whole, deviation=float(np.sqrt(variance)) / whole)


def _from_plan(held: MeasuredPrint, seen: BoolArray, *, mean_deviation: float) -> FromPlanRecord:
    cells = held.cells
    areas, off = cells.areas[seen], (cells.thickness - cells.planned)[seen]
    order = np.argsort(off)
    shares = (np.cumsum(areas[order]) - 0.5 * areas[order]) / areas.sum()
    low, high = np.interp([0.05, 0.95], shares, off[order]).tolist()
    return FromPlanRecord(
        mean=EstimateRecord(value=float((areas * off).sum() / areas.sum()), deviation=mean_deviation),
        rms_mm=float(np.sqrt((areas * off**2).sum() / areas.sum())),
        p5_mm=low,
        p95_mm=high,
        noise_mm=float(np.sqrt((areas * cells.deviations[seen] ** 2).sum() / areas.sum())),
    )


def _run(parts: MeasuredParts, number: int, found: AppraisedScan) -> ScannedRunRecord:
    own = parts.runs == number
    lengths = parts.ends - parts.starts
    seen = own & parts.seen
    bare = seen & (parts.ratios < BARE_RATIO)
    pose = found.held.registration.covariance

    def mean(values: FloatArray, deviations: FloatArray, which: BoolArray, floor: float) -> EstimateRecord | None:
        if not which.any():
            return None
        weights = lengths[which] / lengths[which].sum()
        # What the pose adds is the same along the run, and no mean makes it less.
        noise = float((weights**2 * deviations[which] ** 2).sum())
        return EstimateRecord(value=float((weights * values[which]).sum()), deviation=float(np.sqrt(noise + floor**2)))

    shift = float(np.sqrt(np.linalg.eigvalsh(pose[3:, 3:])[-1]))
    crests = found.held.crests
    row = int(np.searchsorted(crests.runs, number))
    crest = EstimateRecord(value=float(crests.heights[row]), deviation=float(crests.deviations[row]))
    return ScannedRunRecord(
        run=number,
        length_mm=float(lengths[own].sum()),
        seen_mm=float(lengths[seen].sum()),
        missing_mm=float(lengths[bare].sum()),
        ratio=mean(parts.ratios, parts.ratio_deviations, seen, shift / found.held.height),
        crest_mm=crest if crests.seen[row] else None,
        offset_mm=mean(parts.offsets, parts.offset_deviations, seen & ~bare, shift),
    )


def _part(parts: MeasuredParts, k: int) -> PartOfRunRecord:
    seen = bool(parts.seen[k])
    bead = seen and bool(parts.ratios[k] >= BARE_RATIO)
    return PartOfRunRecord(
        run=int(parts.runs[k]),
        start_mm=float(parts.starts[k]),
        end_mm=float(parts.ends[k]),
        ratio=float(parts.ratios[k]) if seen else None,
        deviation=float(parts.ratio_deviations[k]) if seen else None,
        offset_mm=float(parts.offsets[k]) if bead else None,
        offset_deviation_mm=float(parts.offset_deviations[k]) if bead else None,
    )


# The places behind the figures of an appraisal, as CSV: what other programs, and the next print, take up.


# A row for each place of a line.
BEADS_COLUMNS = ("line", "u", "v", "seen", "width_px")
# A row for each stretch of a run.
STRETCHES_COLUMNS = (
    "run", "s_mm", "length_mm", "judged", "seen", "sized", "width_mm", "width_planned_mm", "offset_mm", "of_usual"
)  # fmt: skip


def appraisal_tables(found: Appraisal) -> dict[str, bytes]:
    """Return name and content of the tables of all photographs, by their numbers from 1."""
    tables: dict[str, bytes] = {}
    for number, each in enumerate(found.photographs, start=1):
        tables[f"lines-{number}.csv"] = _lines(each)
        if each.on_plan is not None:
            tables[f"stretches-{number}.csv"] = _stretch_table(each.on_plan)
    return tables


def _lines(each: AppraisedPhotograph) -> bytes:
    rows = [
        (line, f"{u:.2f}", f"{v:.2f}", int(seen), f"{width:.2f}")
        for line, bead in enumerate(each.beads, start=1)
        for (u, v), seen, width in zip(bead.middles, bead.seen, bead.widths, strict=True)
    ]
    return _written(BEADS_COLUMNS, rows)


def _stretch_table(found: OnPlan) -> bytes:
    held = found.held
    plan = held.plan
    rows = [
        (
            int(plan.runs[k]), f"{plan.arcs[k]:.3f}", f"{plan.lengths[k]:.3f}", int(held.judged[k]), int(held.seen[k]),
            int(held.sized[k]), f"{held.widths[k]:.4f}", f"{held.planned[k]:.4f}", f"{held.offsets[k]:.4f}",
            f"{held.relative[k]:.4f}",
        )
        for k in range(np.size(plan.runs))
    ]  # fmt: skip
    return _written(STRETCHES_COLUMNS, rows)


def _written(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue().encode("utf-8")


# Pictures of an appraisal: what was found, drawn over each photograph, and its edges as the paper shows them.


# Each place of an outline is drawn as a short line [pixels].
DASH = np.array([[-1.5, 0.0], [1.5, 0.0]])


def appraisal_pictures(found: Appraisal) -> dict[str, bytes]:
    """Return name and PNG of two pictures a photograph, by their numbers from 1."""
    pictures: dict[str, bytes] = {}
    for number, each in enumerate(found.photographs, start=1):
        pictures[f"overlay-{number}.png"] = photograph_overlay(each)
        pictures[f"edges-{number}.png"] = edge_picture(each)
    return pictures


def photograph_overlay(each: AppraisedPhotograph) -> bytes:
    """Return a PNG: the photograph with edges, middles and breaks of its beads, and what is missing of the plan."""
    missing: list[FloatArray] = []
    outline: FloatArray = np.zeros((0, 2), dtype=np.float64)
    if each.on_plan is not None:
        held = each.on_plan.held
        bare = held.judged & ~held.seen
        pixels = each.on_plan.camera.seen(held.plan.places)
        missing = [pixels[rows] for rows in _stretches(bare, held.plan.runs)]
        placing = each.on_plan.camera.outline
        outline = outline if placing is None else placing.pixels
    return overlay_picture(
        each.photograph.grey,
        Overlay(
            middles=tuple(part for bead in each.beads for part in _parts(bead.middles, bead)),
            edges=tuple(
                part for bead in each.beads for side in (bead.lefts, bead.rights) for part in _parts(side, bead)
            ),
            breaks=tuple(
                bead.middles[max(first - 1, 0) : last + 2] for bead in each.beads for first, last in bead.breaks
            ),
            missing=tuple(missing),
            outline=tuple(place + DASH for place in outline),
        ),
        title=each.photograph.name,
    )


def edge_picture(each: AppraisedPhotograph) -> bytes:
    """Return a PNG: white where |dI/dx| + |dI/dy| of the photograph in even light is above its threshold."""
    from PIL import Image

    grey = each.photograph.grey
    scale = shown_scale(grey)
    small = Image.fromarray((255.0 * grey).astype(np.uint8))
    small = small.resize([max(1, round(scale * side)) for side in small.size])
    found = edges(np.asarray(small, dtype=np.float64) / 255.0, width=scale * each.width)
    written = io.BytesIO()
    Image.fromarray(np.where(found, 255, 0).astype(np.uint8)).save(written, format="PNG", optimize=True)
    return written.getvalue()


def _parts(line: FloatArray, bead: BeadLine) -> list[FloatArray]:
    """Return what is seen of a line, stretch by stretch."""
    return [line[rows] for rows in _stretches(bead.seen, np.zeros(bead.seen.size, dtype=np.int64))]


def _stretches(marked: BoolArray, owners: IntArray) -> list[slice]:
    """Return the rows of each stretch that is marked and of one owner."""
    ends = np.flatnonzero(
        np.diff(marked.astype(np.int64), prepend=0, append=0) | np.diff(owners, prepend=-1, append=-1)
    )
    return [slice(a, b) for a, b in pairwise(ends.tolist()) if marked[a]]
