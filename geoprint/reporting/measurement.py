"""What measure.json and a person's terminal say of measured toolpaths."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.errors import percent
from geoprint.metrics import RigidFit, equally_good, ranked
from geoprint.reporting.evenness import expected_text, record_evenness, record_printed
from geoprint.reporting.metrics import (
    CATALOGUE,
    COVERED_ONCE,
    FOLLOWING,
    GAP,
    HOLE,
    LEVELS,
    MEAN_SPACING,
    OF_BACKEND,
    OVERLAP,
    SPACING,
    THICKNESS,
    cover_text,
)
from geoprint.reporting.records.comparison import (
    MeasuredRecord,
    MeasurementRecord,
    MeasureSecondsRecord,
    MeasureTimingsRecord,
    MotionFitRecord,
)
from geoprint.reporting.records.evenness import SpacingRecord
from geoprint.reporting.records.plan import FileRecord
from geoprint.reporting.records.rounding import listed, place_of, stamp
from geoprint.reporting.tables import fitting, grid, left_out
from geoprint.reporting.verdict import covering
from geoprint.results import MeasuredFile, Measurement

# From measured files of toolpaths to what measure.json says of them.


def record_measurement(found: Measurement) -> MeasurementRecord:
    """Return what measure.json says: the source of table, report and CSV."""
    part = found.part
    return MeasurementRecord(
        **stamp(MeasurementRecord),
        part=FileRecord.of(part, sha256=part.digest),
        area_mm2=found.files[0].measured.area,
        spacing_mm=found.spacing,
        files=tuple(_file(each, own_errors=found.own_errors) for each in found.files),
    )


def record_measure_timings(found: Measurement) -> MeasureTimingsRecord:
    """Return what measuring took."""
    return MeasureTimingsRecord(
        files=tuple(
            MeasureSecondsRecord(
                file=each.name,
                processor_s=each.seconds,
                processor_s_per_m=each.seconds / (each.measured.length / 1000.0),
            )
            for each in found.files
        )
    )


def _file(each: MeasuredFile, *, own_errors: bool) -> MeasuredRecord:
    measured = each.measured
    return MeasuredRecord.of(
        measured,
        file=each.name,
        format=each.format,
        deposit=each.deposit,
        points=each.points,
        runs=measured.run_count,
        dropped_runs=each.dropped,
        reading=each.reading,
        fit=None if each.fit is None else _fit(each.fit),
        uniformity=record_evenness(measured, printed=record_printed(each.printed, of_cell=own_errors)),
    )


def _fit(fit: RigidFit) -> MotionFitRecord:
    turn = Rotation.from_matrix(fit.T_part_paths[:3, :3]).as_rotvec()
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle > 0.0 else np.array([0.0, 0.0, 1.0])
    return MotionFitRecord(
        rotation_deg=float(np.degrees(angle)),
        axis=place_of(axis),
        translation_mm=place_of(fit.T_part_paths[:3, 3]),
        residual_mm=fit.residual,
        before_mm=fit.before,
    )


# What a person reads of measured toolpaths: the table in a terminal, sentences below it, and the table as CSV.


# What the columns show, and how much each matters: where the terminal is narrow, the highest numbers go first.
METRICS = (THICKNESS, FOLLOWING, COVERED_ONCE, GAP, OVERLAP, HOLE, MEAN_SPACING, SPACING)
COLUMNS = {
    "file": 0, THICKNESS.column: 1, FOLLOWING.column: 7, "printed CV": 6, COVERED_ONCE.column: 2, GAP.column: 3,
    OVERLAP.column: 4, HOLE.column: 5, MEAN_SPACING.column: 9, SPACING.column: 8, "runs": 10, "length mm": 11,
    "off mm": 12, "CPU s/m": 13,
}  # fmt: skip


def measure_table(
    record: MeasurementRecord, timings: MeasureTimingsRecord | None = None, *, width: int | None = None
) -> str:
    """Return the table and what to mind, below it.

    What the figures of evenness mean stands in `geoprint.reporting.metrics`; printed CV is the mean of prints to be
    expected, and in brackets what 95 of 100 of them have.

    Args:
        record: what is said of the files.
        timings: what measuring took; None where that is not told.
        width: letters in a line, where they are counted; columns that do not fit are left out.
    """
    rows = [_row(each) for each in record.files]
    if timings is not None:
        took = [f"{each.processor_s_per_m:.1f}" for each in timings.files]
        rows = [{**row, "CPU s/m": text} for row, text in zip(rows, took, strict=True)]
    every = [name for name in COLUMNS if name in rows[0]]
    names = fitting(every, rows, width=width, weights=COLUMNS)
    title = f"{record.part.name}, {record.area_mm2:.4g} mm2, paths {record.spacing_mm:.3g} mm apart"
    lines = [title, "", *grid(names, [rows], left={"file"}), ""]
    if names != every:
        lines += [f"columns left out at this width, see `--json` and `--out`: {left_out(every, names, COLUMNS)}", ""]
    sentences = [measure_verdict(record)[0]] if len(record.files) > 1 else []
    sentences += [sentence for each in record.files for sentence in _minded(each)]
    return "\n".join([*lines, *sentences, *_expected(record)]).rstrip()


def measure_csv(record: MeasurementRecord) -> str:
    """Return the table as CSV, with every figure: a row a file."""
    figures: dict[str, Callable[[MeasuredRecord], object]] = {
        "file": lambda r: r.file, "format": lambda r: r.format, "runs": lambda r: r.runs,
        "length_mm": lambda r: r.length_mm, "off_mean_mm": lambda r: r.off_mean_mm,
        "off_max_mm": lambda r: r.off_max_mm,
        **{
            metric.key.replace(".", "_"): lambda r, metric=metric: metric.of(r.uniformity)
            for metric in CATALOGUE
            if metric not in {LEVELS, *OF_BACKEND}
        },
        "fill": lambda r: r.uniformity.fill,
    }  # fmt: skip
    of_side = ("none", "oblique", "unknown")
    of_spacing = tuple(SpacingRecord.model_fields)
    of_print = ("cv", "low", "high")
    header = [
        *figures, *(f"printed_{name}" for name in of_print),
        *(f"{side}_{name}" for side in ("left", "right") for name in (*of_side, *of_spacing)),
    ]  # fmt: skip
    written = io.StringIO()
    writer = csv.writer(written, lineterminator="\n")
    writer.writerow(header)
    for row in record.files:
        even = row.uniformity
        cells = ["" if (value := figure(row)) is None else value for figure in figures.values()]
        cells += ["" if even.printed is None else getattr(even.printed, name) for name in of_print]
        for side in (even.left, even.right):
            cells += [getattr(side, name) for name in of_side]
            cells += ["" if side.spacing is None else getattr(side.spacing, name) for name in of_spacing]
        writer.writerow(cells)
    return written.getvalue()


def measure_verdict(record: MeasurementRecord) -> tuple[str, ...]:
    """Return in words which file is most even, the deciding sentence first."""
    order = ranked_files(record)
    said = [
        f"{row.file}: with constant flow, layer thickness varies by {THICKNESS.text(row.uniformity)} (standard "
        f"deviation over mean), in print by {expected_text(row.uniformity.printed)} (95 % interval in brackets); "
        f"{cover_text(row.uniformity, digits=2)}."
        for row in order
    ]
    if len(order) == 1:
        return (said[0],)
    coverings = [covering(row.uniformity) for row in order]
    if not coverings[0].covers:
        missed = cover_text(order[0].uniformity)
        return (f"No file covers {record.part.name}. The best, {order[0].file}: {missed}.", *said)
    leading = [row.file for row in order[: equally_good(coverings)]]
    if len(leading) == len(order):
        return (f"{listed(leading)} cover {record.part.name} equally well.", *said)
    verb = "covers" if len(leading) == 1 else "cover"
    return (f"{listed(leading)} {verb} {record.part.name} best of {len(order)}.", *said)


def ranked_files(record: MeasurementRecord) -> list[MeasuredRecord]:
    """Return the files, the best first, as coverings are ranked."""
    return [record.files[index] for index in ranked([covering(each.uniformity) for each in record.files])]


def _row(row: MeasuredRecord) -> dict[str, str]:
    return {
        "file": row.file,
        **{metric.column: metric.text(row.uniformity) for metric in METRICS},
        "printed CV": expected_text(row.uniformity.printed, digits=1),
        "runs": str(row.runs),
        "length mm": f"{row.length_mm:.0f}",
        "off mm": f"{row.off_max_mm:.3f}",
    }


def _minded(row: MeasuredRecord) -> list[str]:
    """Return what a file was read as, and what its figures leave out."""
    even, found = row.uniformity, [f"{row.file}: {row.format}, deposit by {row.deposit}"]
    found[0] += f"; {row.off_mean_mm:.3g} mm off the part on average, {row.off_max_mm:.3g} mm at most"
    found.append(f"{row.file}: {row.reading.text}")
    if row.fit is not None:
        x, y, z = row.fit.translation_mm
        found.append(
            f"{row.file}: fitted to the part, turned by {row.fit.rotation_deg:.3f} degrees, moved by ({x:z.3f}, "
            f"{y:z.3f}, {z:z.3f}) mm; residual {row.fit.residual_mm:.3g} mm (root mean square), before "
            f"{row.fit.before_mm:.3g} mm"
        )
    found.append(
        f"{row.file}: no neighbour within three spacings along {percent(even.left.none, 1)} (left) and "
        f"{percent(even.right.none, 1)} (right) of the path; an oblique one along {percent(even.left.oblique, 1)} and "
        f"{percent(even.right.oblique, 1)}"
    )
    if even.both.unknown > 0.0 or even.area_unknown > 0.0:
        found.append(
            f"warning: {row.file}: the limit of work left {percent(even.both.unknown, 1)} of the path and "
            f"{percent(even.area_unknown, 1)} of the area unmeasured"
        )
    return found


def _expected(record: MeasurementRecord) -> list[str]:
    """Return what the printed CV is, and whose errors it is with."""
    whose = next((each.uniformity.printed.errors for each in record.files if each.uniformity.printed is not None), None)
    what = "expected in print, 95 % interval in brackets"
    return [] if whose is None else [f"printed CV: {what}; errors of the {whose}, without a bent needle"]
