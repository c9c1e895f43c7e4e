"""From appraised scans to what appraisal.json and lying.json say of them, and the table of the parts of runs."""

from __future__ import annotations

import csv
import io
from importlib.metadata import version

import numpy as np

from geoprint.account.appraised.figures import record_shift
from geoprint.account.prints.feedback import record_printed
from geoprint.account.records.feedback import sealed
from geoprint.account.records.rounding import place_of
from geoprint.account.records.scan import (
    EstimateRecord,
    FromPlanRecord,
    LyingRecord,
    PartOfRunRecord,
    RegistrationRecord,
    Row,
    ScanAppraisalRecord,
    ScanFileRecord,
    ScannedRunRecord,
)
from geoprint.appraisal import PrintShift, print_shift
from geoprint.appraisal.scanned import (
    BARE_RATIO,
    COVERED_SHARE,
    AppraisedScan,
    LyingScan,
    MeasuredParts,
    MeasuredPrint,
    Registration,
)
from geoprint.model import BoolArray, FloatArray
from geoprint.surfaces import lumped_mass

# Versions of the layouts; a change that breaks a reader raises them.
SCAN_SCHEMA, LYING_SCHEMA = 2, 1
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
    told = ScanAppraisalRecord(
        schema=SCAN_SCHEMA,
        version=version("geoprint"),
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
    return sealed(told)


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
        schema=LYING_SCHEMA,
        version=version("geoprint"),
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
