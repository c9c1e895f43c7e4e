"""What a person reads of measured toolpaths: the table in a terminal, sentences below it, and the table as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable

from geoprint.account.prints.expected import expected_text
from geoprint.account.records.measure import MeasuredRecord, MeasurementRecord, MeasureTimingsRecord
from geoprint.account.records.spacing import SpacingRecord, SpacingSideRecord
from geoprint.account.texts.tables import fitting, grid, left_out

# What the columns show, and how much each matters: where the terminal is narrow, the highest numbers go first.
COLUMNS = {
    "file": 0, "mean": 8, "CV": 1, "printed CV": 6, "p95": 9, "left": 10, "left CV": 2, "right": 11, "right CV": 3,
    "gap": 4, "overlap": 5, "hole mm2": 7, "runs": 12, "length mm": 13, "off mm": 14, "CPU s/m": 15,
}  # fmt: skip
# Where more of the samples than this share have no neighbour squarely beside them it is worth a word.
NOTABLE = 0.02
_NONE = "-"


def measure_table(
    told: MeasurementRecord, timings: MeasureTimingsRecord | None = None, *, width: int | None = None
) -> str:
    """Return the table and what to mind, below it.

    Mean, CV and p95 are of the spacing over the wanted one, to both sides; left and right are their means. Printed CV
    is the mean of prints to be expected, to both sides, and in brackets what 95 of 100 of them have.

    Args:
        told: what is said of the files.
        timings: what measuring took; None where that is not told.
        width: letters in a line, where they are counted; columns that do not fit are left out.
    """
    rows = [_row(each) for each in told.files]
    if timings is not None:
        took = [f"{each.processor_s_per_m:.1f}" for each in timings.files]
        rows = [{**row, "CPU s/m": text} for row, text in zip(rows, took, strict=True)]
    every = [name for name in COLUMNS if name in rows[0]]
    names = fitting(every, rows, width=width, weights=COLUMNS)
    title = f"{told.part.name}, {told.area_mm2:.4g} mm2, paths {told.spacing_mm:.3g} mm apart; "
    lines = [f"{title}mean, p95, left and right are multiples of that", "", *grid(names, [rows], left={"file"}), ""]
    if names != every:
        lines += [f"left out at this width, told with `--json` and `--out`: {left_out(every, names, COLUMNS)}", ""]
    sentences = [sentence for each in told.files for sentence in _minded(each)]
    return "\n".join([*lines, *sentences, *_expected(told)]).rstrip()


def measure_csv(told: MeasurementRecord) -> str:
    """Return the table as CSV, with every figure: a row a file."""
    figures: dict[str, Callable[[MeasuredRecord], object]] = {
        "file": lambda r: r.file, "format": lambda r: r.format, "runs": lambda r: r.runs,
        "length_mm": lambda r: r.length_mm, "off_mean_mm": lambda r: r.off_mean_mm,
        "off_max_mm": lambda r: r.off_max_mm,
        "gap": lambda r: r.gap, "overlap": lambda r: r.overlap, "largest_hole_mm2": lambda r: r.largest_hole_mm2,
        "fill": lambda r: r.fill,
    }  # fmt: skip
    sides = ("left", "right", "both")
    of_side = ("none", "oblique", "unknown")
    of_spacing = tuple(SpacingRecord.model_fields)
    of_print = ("cv", "low", "high")
    names = (*of_side, *of_spacing, *(f"printed_{name}" for name in of_print))
    header = [*figures, *(f"{side}_{name}" for side in sides for name in names)]
    written = io.StringIO()
    writer = csv.writer(written, lineterminator="\n")
    writer.writerow(header)
    for row in told.files:
        cells = [figure(row) for figure in figures.values()]
        for side in (row.left, row.right, row.both):
            cells += [getattr(side, name) for name in of_side]
            cells += ["" if side.spacing is None else getattr(side.spacing, name) for name in of_spacing]
            cells += ["" if side.printed is None else getattr(side.printed, name) for name in of_print]
        writer.writerow(cells)
    return written.getvalue()


def measure_verdict(told: MeasurementRecord) -> tuple[str, ...]:
    """Return in words which file is most even, the deciding sentence first."""
    order = sorted(told.files, key=lambda row: (row.gap + row.overlap > NOTABLE, _cv(row.both)))
    said = [
        f"{row.file}: the spacing varies by {_percent(row.left)} to the left and {_percent(row.right)} to the right "
        f"(standard deviation over mean), in print by {expected_text(row.both.printed)} to both, what 95 of 100 "
        f"prints have in brackets; {row.gap:.2%} of the area is missed and {row.overlap:.2%} laid twice."
        for row in order
    ]
    if len(order) == 1:
        return (said[0],)
    return (f"{order[0].file} covers {told.part.name} most evenly of {len(order)}.", *said)


def _row(row: MeasuredRecord) -> dict[str, str]:
    return {
        "file": row.file,
        "mean": _of(row.both, lambda s: f"{s.mean:.3f}"),
        "CV": _of(row.both, lambda s: f"{s.cv:.2%}"),
        "printed CV": expected_text(row.both.printed, digits=1),
        "p95": _of(row.both, lambda s: f"{s.p95:.3f}"),
        "left": _of(row.left, lambda s: f"{s.mean:.3f}"),
        "left CV": _of(row.left, lambda s: f"{s.cv:.2%}"),
        "right": _of(row.right, lambda s: f"{s.mean:.3f}"),
        "right CV": _of(row.right, lambda s: f"{s.cv:.2%}"),
        "gap": f"{row.gap:.2%}",
        "overlap": f"{row.overlap:.2%}",
        "hole mm2": f"{row.largest_hole_mm2:.2f}",
        "runs": str(row.runs),
        "length mm": f"{row.length_mm:.0f}",
        "off mm": f"{row.off_max_mm:.3f}",
    }


def _of(side: SpacingSideRecord, figure: Callable[[SpacingRecord], str]) -> str:
    return _NONE if side.spacing is None else figure(side.spacing)


def _cv(side: SpacingSideRecord) -> float:
    return float("inf") if side.spacing is None else side.spacing.cv


def _percent(side: SpacingSideRecord) -> str:
    return _of(side, lambda s: f"{s.cv:.2%}")


def _minded(row: MeasuredRecord) -> list[str]:
    """Return what a file was read as, and what its figures leave out."""
    both, found = row.both, [f"{row.file}: {row.format}, deposit by {row.deposit}"]
    found[0] += f"; {row.off_mean_mm:.3g} mm off the part in the mean, {row.off_max_mm:.3g} mm at most"
    if row.fit is not None:
        x, y, z = row.fit.translation_mm
        found.append(
            f"{row.file}: laid onto the part by a turn of {row.fit.rotation_deg:.3f} degrees and a shift of "
            f"({x:.3f}, {y:.3f}, {z:.3f}) mm; {row.fit.residual_mm:.3g} mm are left (root mean square), "
            f"{row.fit.before_mm:.3g} mm before"
        )
    found.append(
        f"{row.file}: no neighbour within three spacings for {row.left.none:.1%} of the path to the left and "
        f"{row.right.none:.1%} to the right; only an oblique one for {row.left.oblique:.1%} and {row.right.oblique:.1%}"
    )
    if both.unknown > 0.0 or row.area_unknown > 0.0:
        found.append(
            f"warning: {row.file}: the budget of work left {both.unknown:.1%} of the path and {row.area_unknown:.1%} "
            "of the area unmeasured"
        )
    return found


def _expected(told: MeasurementRecord) -> list[str]:
    """Return what the printed CV is, and whose errors it is with."""
    whose = next((each.both.printed.errors for each in told.files if each.both.printed is not None), None)
    what = "expected of prints, in brackets what 95 of 100 have"
    return [] if whose is None else [f"printed CV: {what}; errors of the {whose}, without a bent needle"]
