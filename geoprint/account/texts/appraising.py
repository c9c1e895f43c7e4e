"""What a person reads of appraised photographs: a table of each, the runs of the plan, and how far prints lie apart."""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.account.records.appraisal import (
    ApartRecord,
    AppraisalRecord,
    OnPlanRecord,
    PhotographRecord,
    RunRecord,
    Stretch,
)

_GAP = "  "
_NONE = "-"
# Stretches that a line of the table names; the others are counted.
MOST_NAMED = 3
# Offsets in the mean beyond this share of a bead's width are worth a word.
NOTABLE_OFFSET = 0.25


def appraisal_text(told: AppraisalRecord) -> str:
    """Return tables and sentences."""
    choices = (("width", told.width_chosen), ("threshold", told.threshold_chosen))
    chosen = [name for name, is_chosen in choices if is_chosen]
    lines = grid(
        ("photograph", "lines", "length px", "width px", "CV", "breaks"),
        [_photograph(each) for each in told.photographs],
    )
    for each in told.photographs:
        lines += ["", *_looked_for(told, each, chosen)]
        if each.on_plan is not None:
            lines += ["", *_on_plan(each, each.on_plan)]
    if told.pairs:
        lines += ["", *_matrix(told)]
    return "\n".join(lines)


def _photograph(each: PhotographRecord) -> tuple[str, ...]:
    breaks = sum(len(line.breaks_px) for line in each.lines)
    return (
        each.file, str(len(each.lines)), f"{each.length_px:.0f}", f"{each.width_mean_px:.2f}", f"{each.width_cv:.1%}",
        str(breaks),
    )  # fmt: skip


def _looked_for(told: AppraisalRecord, each: PhotographRecord, chosen: Sequence[str]) -> list[str]:
    """Return what lines were looked for with."""
    how = f", {' and '.join(chosen)} chosen from the picture" if chosen else ""
    looked = (
        f"{each.file}: {each.size_px[0]} x {each.size_px[1]} pixels, beads {told.shade} than what they lie on, "
        f"{each.bead_width_px:.3g} pixels wide, contrast from {each.threshold:.3g} on{how}"
    )
    said = [looked]
    if each.turned:
        said.append(f"note: {each.file} was turned upright, as the camera noted; pixels are counted after that")
    return said


def _on_plan(each: PhotographRecord, found: OnPlanRecord) -> list[str]:
    """Return the runs of a plan, as a photograph shows them."""
    camera = found.camera
    lines = grid(
        ("run", "length mm", "judged", "missing mm", "width mm", "CV", "offset mm", "rms", "gaps at mm"),
        [_run(run) for run in found.runs],
    )
    covered = (
        f"{each.file}: of the plan {found.judged:.1%} is in sight and judged, of that {found.missing:.2%} has no "
        f"material; beads are {found.width_mean_mm:.3f} mm wide (CV {found.width_cv:.1%}) and lie "
        f"{found.offset_mean_mm:+.3f} mm to the left of their runs ({found.offset_rms_mm:.3f} root mean square)"
    )
    placed = (
        f"{each.file}: a pixel covers {camera.mm_per_px:.3f} mm; the {camera.fiducials} fiducials are "
        f"{camera.residual_px:.2g} pixels off where the camera sees them"
    )
    lines += ["", covered, f"{each.file}: plan to print and back: {_said(found.apart_mm)} mm", placed]
    if abs(found.offset_mean_mm) > NOTABLE_OFFSET * found.width_mean_mm:
        lines.append(
            f"warning: {each.file}: all beads lie to one side in the mean; check fixture and tool with "
            "`geoprint calibrate` before the path is blamed"
        )
    if found.strays > 0.0:
        lines.append(
            f"note: {each.file}: {found.strays:.1%} of the material lies farther than {found.reach_mm:.3g} mm from "
            "every run"
        )
    return lines


def _run(run: RunRecord) -> tuple[str, ...]:
    return (
        str(run.run + 1), f"{run.length_mm:.1f}", f"{run.judged_mm / run.length_mm:.0%}", f"{run.missing_mm:.1f}",
        _number(run.width_mean_mm, "{:.3f}"), _number(run.width_cv, "{:.1%}"), _number(run.offset_mean_mm, "{:+.3f}"),
        _number(run.offset_rms_mm, "{:.3f}"), _stretches(run.gaps_mm),
    )  # fmt: skip


def _number(value: float | None, form: str) -> str:
    return _NONE if value is None else form.format(value)


def _stretches(stretches: Sequence[Stretch]) -> str:
    named = [f"{start:.1f}-{end:.1f}" for start, end in stretches[:MOST_NAMED]]
    more = len(stretches) - len(named)
    return ", ".join([*named, *([f"{more} more"] if more else [])]) or _NONE


def _matrix(told: AppraisalRecord) -> list[str]:
    """Return the Hausdorff distances of each two photographs, as the paper's Table II, and what they hide."""
    names = [each.file for each in told.photographs]
    between = {(pair.first, pair.second): pair.apart_px.hausdorff for pair in told.pairs}
    rows = [
        (one, *(_cell(between, one, other) for other in names))
        for one in names
    ]  # fmt: skip
    lines = ["Hausdorff distances of the lines [pixels]", *grid(("", *names), rows), ""]
    return lines + [f"{pair.first} to {pair.second} and back: {_said(pair.apart_px)} pixels" for pair in told.pairs]


def _cell(between: dict[tuple[str, str], float], one: str, other: str) -> str:
    if one == other:
        return "0"
    return f"{between.get((one, other), between.get((other, one), 0.0)):.4f}"


def _said(apart: ApartRecord) -> str:
    return (
        f"Hausdorff {apart.hausdorff:.3f} ({apart.there.largest:.3f} there, {apart.back.largest:.3f} back), 95 % "
        f"within {apart.p95:.3f}, mean {apart.mean:.3f}"
    )


def grid(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a heading, a line below it, and the rows; the first column to the left."""
    widths = [max(len(row[column]) for row in (header, *rows)) for column in range(len(header))]

    def line(cells: Sequence[str]) -> str:
        fitted = [cell.rjust(width) for cell, width in zip(cells, widths, strict=True)]
        return _GAP.join([cells[0].ljust(widths[0]), *fitted[1:]]).rstrip()

    return [line(header), "-" * (sum(widths) + len(_GAP) * (len(widths) - 1)), *map(line, rows)]
