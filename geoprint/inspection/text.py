"""What a person reads of inspected prints: photographs, scans, and how sure each figure is."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import TypeAlias

import numpy as np

from geoprint.errors import percent
from geoprint.reporting.records.inspection import (
    ApartRecord,
    AppraisalRecord,
    CameraRecord,
    EstimateRecord,
    LyingRecord,
    OnPlanRecord,
    PhotographRecord,
    RegistrationRecord,
    RunRecord,
    ScanAppraisalRecord,
    ScanFileRecord,
    ScannedRunRecord,
    ShiftRecord,
    Stretch,
)
from geoprint.reporting.records.rounding import listed
from geoprint.reporting.tables import fitting, left_out

Form: TypeAlias = Callable[[float], str]

# What a person reads of appraised photographs: a table of each, the runs of the plan, and how far prints lie apart.


_GAP = "  "
_NONE = "-"
# How estimates are written.
_SHARE: Form = partial(percent, digits=1)
_MM: Form = "{:.3f}".format
_SIGNED_MM: Form = "{:+z.3f}".format
# Stretches that a line of the table names; the others are counted.
MOST_NAMED = 3
PHOTOGRAPH_COLUMNS = ("photograph", "lines", "length px", "width px", "CV", "breaks")
# Of the table of runs, with the order in which they go where a line is short, the largest first.
RUN_COLUMNS = {
    "run": 0, "length mm": 5, "judged": 4, "missing mm": 1, "width mm": 3, "planned": 9, "of usual": 6, "CV": 8,
    "offset mm": 2, "rms": 7,
}  # fmt: skip
# Its last column on a page; a terminal has a line a run below the table.
FAULTS = "faults at mm"


def appraisal_text(record: AppraisalRecord, *, width: int | None = None) -> str:
    """Return tables and sentences.

    Args:
        record: of the photographs.
        width: letters in a line, where they are counted.
    """
    lines = grid(PHOTOGRAPH_COLUMNS, photograph_rows(record))
    for each in record.photographs:
        lines += ["", *looked_for(record, each)]
        if each.on_plan is not None:
            rows = photographed_run_rows(each.on_plan)
            lines += [
                "",
                *_run_table(RUN_COLUMNS, [row[:-1] for row in rows], width=width),
                *(f"run {row[0]}, {FAULTS}: {row[-1]}" for row in rows if row[-1] != _NONE),
                "",
                *plan_sentences(each, each.on_plan),
            ]
    if record.pairs:
        lines += ["", *_matrix(record)]
    return "\n".join(lines)


def photograph_rows(record: AppraisalRecord) -> list[tuple[str, ...]]:
    """Return the rows of the table of photographs, below `COLUMNS`."""
    return [
        (
            each.file, str(len(each.lines)), f"{each.length_px:.0f}", f"{each.width_mean_px:.2f}",
            percent(each.width_cv, 1), str(_breaks(each)),
        )
        for each in record.photographs
    ]  # fmt: skip


def photographed_run_rows(found: OnPlanRecord) -> list[tuple[str, ...]]:
    """Return the rows of the table of runs, below `RUN_COLUMNS` and `FAULTS`."""
    return [_run_row(run) for run in found.runs]


def looked_for(record: AppraisalRecord, each: PhotographRecord) -> list[str]:
    """Return what lines were looked for with in a photograph, and notes."""
    choices = (("width", record.width_chosen), ("threshold", record.threshold_chosen))
    chosen = " and ".join(name for name, is_chosen in choices if is_chosen)
    how = f", {chosen} chosen from the picture" if chosen else ""
    if each.on_plan is not None and each.on_plan.camera.outline is None:
        size = f"{each.size_px[0]} x {each.size_px[1]} pixels"
        looked = f"{each.file}: {size}, beads {each.bead_width_px:.3g} pixels wide"
    else:
        looked = (
            f"{each.file}: {each.size_px[0]} x {each.size_px[1]} pixels, beads {record.shade} than what they lie on, "
            f"{each.bead_width_px:.3g} pixels wide, contrast from {each.threshold:.3g} on{how}"
        )
    said = [looked]
    if each.turned:
        said.append(f"note: {each.file} was turned upright, as the camera noted; pixels are counted after that")
    return said


def plan_sentences(each: PhotographRecord, found: OnPlanRecord) -> list[str]:
    """Return how a photograph shows its plan in sentences, then notes and warnings."""
    said = (
        f"{each.file}: {percent(found.judged, 1)} of the plan is visible and judged, {percent(found.missing, 2)} of "
        "that has no material"
    )
    if found.width_mean_mm is None or found.width_cv is None or found.offset_mean_mm is None or found.usual is None:
        covered = f"{said}; width and offset are too uncertain to state"
    else:
        covered = (
            f"{said}. Beads are {found.width_mean_mm:.3f} mm wide (CV {percent(found.width_cv, 1)}), planned "
            f"{found.width_planned_mm:.3f} mm, typical {found.usual:.2f} of that. They lie "
            f"{found.offset_mean_mm:+z.3f} mm to the left of their runs ({found.offset_rms_mm or 0.0:.3f} root mean "
            "square)"
        )
    apart = f"{each.file}: plan to print and back: {_apart_text(found.apart_mm)} mm"
    tone = f"the tone curve of gamma {found.gamma:.2g}"
    light = f"{each.file}: edges are blurred by {found.blur_px:.2g} pixels and have {tone}"
    lines = [covered, apart, *_placed_camera(each, found.camera), light]
    lines += [
        f"warning: {each.file}: run {run.run + 1} is {run.whole} over its whole length: {run.of_usual.value:.2f} of "
        "what is usual in this print"
        for run in found.runs
        if run.whole is not None and run.of_usual is not None
    ]
    lines += [f"note: {each.file}: {doubt}" for doubt in found.doubts]
    lines += shift_sentences(each.file, found.shift)
    if found.strays > 0.0:
        lines.append(
            f"note: {each.file}: {percent(found.strays, 1)} of the material lies farther than {found.reach_mm:.3g} mm "
            "from every run"
        )
    return lines


def shift_sentences(file: str, shift: ShiftRecord | None) -> list[str]:
    """Return what is said where a whole print lies beside its plan."""
    if shift is None:
        return []
    x, y, z = shift.by_mm
    length = float(np.linalg.norm(shift.by_mm))
    said = (
        f"warning: {file}: the whole print lies {length:.2f} mm (+/- {shift.deviation_mm:.2f}) off its plan, by "
        f"({x:+z.2f}, {y:+z.2f}, {z:+z.2f}) mm in the part's coordinates. Touch the part again: feedback cannot move "
        "paths"
    )
    return [said]


def _placed_camera(each: PhotographRecord, camera: CameraRecord) -> list[str]:
    """Return what a pixel covers, what placed the camera, and how well."""
    covers, outline = f"{each.file}: a pixel covers {camera.mm_per_px:.3f} mm", camera.outline
    if outline is None:
        off = f"the {camera.fiducials} fiducials are {camera.residual_px:.2g} pixels off where the camera sees them"
        return [f"{covers}; {off}"]
    placed = (
        f"{covers}. The part's outline, not fiducials, places the camera: its residual is {camera.residual_px:.2g} "
        f"pixels, and points of the part are within {outline.within_px:.2g} pixels, {outline.within_mm:.2g} mm (95 %)"
    )
    if outline.clearer is None:
        return [placed]
    decided = (
        f"note: {each.file}: the outline fits {outline.alike} camera positions. From the chosen one, the lines are "
        f"{outline.clearer:.2g} times nearer to the plan: give `--fiducials` if the print may lie far off"
    )
    return [placed, decided]


def verdict_on_photographs(record: AppraisalRecord) -> str:
    """Return the sentence that says what matters most: what is missing of the plan, else how far prints lie apart."""
    first, *others = record.photographs
    plans = [(each, each.on_plan) for each in record.photographs if each.on_plan is not None]
    if plans and not others:
        return plan_sentences(*plans[0])[0]
    if plans:
        missing = listed([f"{percent(found.missing, 2)} in {each.file}" for each, found in plans])
        return f"{missing} of the judged plan has no material"
    if not others:
        return (
            f"{first.file} shows {_counted(len(first.lines), 'line')} of material, {first.length_px:.0f} pixels long "
            f"together and {first.width_mean_px:.2f} pixels wide (CV {percent(first.width_cv, 1)}), with "
            f"{_counted(_breaks(first), 'break')}"
        )
    near, *_, far = sorted([record.pairs[0], *record.pairs], key=lambda pair: pair.apart_px.hausdorff)
    nearest = f"the lines of {near.first} and {near.second} lie {near.apart_px.hausdorff:.2f} pixels apart (Hausdorff)"
    if len(record.pairs) == 1:
        return f"{nearest}, {near.apart_px.mean:.2f} in the mean"
    return (
        f"{nearest}, the nearest of {len(record.pairs)} pairs; those of {far.first} and {far.second} "
        f"{far.apart_px.hausdorff:.2f}, the farthest"
    )


def pair_sentences(record: AppraisalRecord) -> list[str]:
    """Return how far each two photographs lie apart, there and back."""
    return [f"{pair.first} to {pair.second} and back: {_apart_text(pair.apart_px)} pixels" for pair in record.pairs]


def sentence(said: str, names: Collection[str]) -> str:
    """Return what is said as a sentence; the name of a file stays as it is.

    Args:
        said: with neither a capital letter nor a full stop.
        names: of files.

    Examples:
        >>> sentence("of the plan 1 mm is missing", ["a.png"]), sentence("a.png: all is there", ["a.png"])
        ('Of the plan 1 mm is missing.', 'a.png: all is there.')
    """
    begun = said if any(said.startswith(name) for name in names) else f"{said[0].upper()}{said[1:]}"
    return f"{begun}."


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _breaks(each: PhotographRecord) -> int:
    return sum(len(line.breaks_px) for line in each.lines)


def _run_row(run: RunRecord) -> tuple[str, ...]:
    return (
        str(run.run + 1), f"{run.length_mm:.1f}", percent(run.judged_mm / run.length_mm), f"{run.missing_mm:.1f}",
        _photographed_estimate(run.width_mm, _MM), f"{run.width_planned_mm:.3f}",
        _NONE if run.of_usual is None else f"{run.of_usual.value:.2f}", _number(run.width_cv, _SHARE),
        _photographed_estimate(run.offset_mm, _SIGNED_MM), _number(run.offset_rms_mm, _MM), _faults(run),
    )  # fmt: skip


def _photographed_estimate(found: EstimateRecord | None, form: Form) -> str:
    return _NONE if found is None else f"{form(found.value)} +/- {found.deviation:.3f}"


def _faults(run: RunRecord) -> str:
    """Return what is wrong with a run: all of it, then where."""
    kinds = (("gap", run.gaps_mm), ("blob", run.blobs_mm), ("thin", run.thin_mm))
    named = [f"{kind} {_stretches(stretches)}" for kind, stretches in kinds if stretches]
    return "; ".join([*([] if run.whole is None else [f"{run.whole} all along"]), *named]) or _NONE


def _number(value: float | None, form: Form) -> str:
    return _NONE if value is None else form(value)


def _stretches(stretches: Sequence[Stretch]) -> str:
    named = [f"{start:.1f}-{end:.1f}" for start, end in stretches[:MOST_NAMED]]
    more = len(stretches) - len(named)
    return ", ".join([*named, *([f"{more} more"] if more else [])]) or _NONE


def apart_by_numbers(record: AppraisalRecord) -> dict[tuple[int, int], ApartRecord]:
    """Return how far each two photographs lie apart, by their numbers from 0, the lower first.

    Their names may be alike, as of files in two folders.
    """
    numbers = combinations(range(len(record.photographs)), 2)
    return {both: pair.apart_px for both, pair in zip(numbers, record.pairs, strict=True)}


def _matrix(record: AppraisalRecord) -> list[str]:
    """Return the Hausdorff distances of each two photographs, as the paper's Table II, and what they hide."""
    names = [each.file for each in record.photographs]
    cells = [["0"] * len(names) for _ in names]
    for (one, other), apart in apart_by_numbers(record).items():
        cells[one][other] = cells[other][one] = f"{apart.hausdorff:.4f}"
    rows = [(name, *row) for name, row in zip(names, cells, strict=True)]
    lines = ["Hausdorff distances of the lines [pixels]", *grid(("", *names), rows), ""]
    return lines + pair_sentences(record)


def _apart_text(apart: ApartRecord) -> str:
    return (
        f"Hausdorff {apart.hausdorff:.3f} ({apart.there.largest:.3f} there, {apart.back.largest:.3f} back), 95 % "
        f"within {apart.p95:.3f}, mean {apart.mean:.3f}"
    )


def _run_table(weights: Mapping[str, int], rows: Sequence[Sequence[str]], *, width: int | None) -> list[str]:
    """Return the table of runs, without columns that do not fit, and which these are."""
    cells = [dict(zip(weights, row, strict=True)) for row in rows]
    names = fitting([*weights], cells, width=width, weights=weights)
    gone = left_out([*weights], names, weights)
    said = [f"columns left out at this width, see `--json`: {gone}", ""] if gone else []
    return [*grid(names, [[each[name] for name in names] for each in cells]), *said]


def grid(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a heading, a line below it, and the rows; the first column to the left."""
    widths = [max(len(row[column]) for row in (header, *rows)) for column in range(len(header))]

    def line(cells: Sequence[str]) -> str:
        fitted = [cell.rjust(width) for cell, width in zip(cells, widths, strict=True)]
        return _GAP.join([cells[0].ljust(widths[0]), *fitted[1:]]).rstrip()

    return [line(header), "-" * (sum(widths) + len(_GAP) * (len(widths) - 1)), *map(line, rows)]


# What a person reads of appraised scans: the runs of the plan, how thick the print is, and how sure that is.

# With the order in which they go where a line is short, the largest first.
SCANNED_COLUMNS = {
    "run": 0, "length mm": 6, "seen": 5, "missing mm": 4, "volume": 1, "crest mm": 2, "offset mm": 3,
}  # fmt: skip
# Standard deviations to either side that hold 95 of 100.
TWO_SIDED = 1.96
# Less bare part than this among the points says little of where the part's surface is.
LEAST_BARE = 0.03
# A volume farther from the planned one than this is worth a word.
NOTABLE_VOLUME = 0.03


def scan_text(record: ScanAppraisalRecord, *, width: int | None = None) -> str:
    """Return tables and sentences on a scan of a print.

    Args:
        record: of the scan.
        width: letters in a line, where they are counted.
    """
    lines = _run_table(SCANNED_COLUMNS, scanned_run_rows(record.runs), width=width)
    return "\n".join([*lines, "", *scan_sentences(record)])


def scan_sentences(record: ScanAppraisalRecord) -> list[str]:
    """Return what a scan shows of a print in sentences, then notes and warnings."""
    off, ratio = record.from_plan, record.volume_ratio
    volume = (
        f"{record.scan.file}: the print has {_said(ratio, _SHARE)} of the planned volume in the visible area, and "
        f"is {_said(record.thickness_mm, _MM)} mm thick on average"
    )
    covered = (
        f"{percent(record.seen, 1)} of the area to cover is visible, and {_said(record.covered, _SHARE)} of that has "
        f"material: {_said(record.volume_seen_mm3, '{:.0f}'.format)} mm3 of {record.volume_planned_mm3:.0f} mm3 "
        "planned in all"
    )
    thickness = (
        f"thickness error: {_said(off.mean, _SIGNED_MM)} mm on average, {off.rms_mm:.3f} mm root mean square "
        f"({off.noise_mm:.3f} mm from the scan), 90 % between {off.p5_mm:+z.3f} and {off.p95_mm:+z.3f} mm"
    )
    beads = (
        f"bead width: {record.registration.bead_width:.2f} of flow over layer height; beads lie "
        f"{record.registration.offset_mm:+z.3f} mm to the left of their paths"
    )
    lines = [volume, covered, thickness, *_placed(record.scan, record.registration), beads]
    if record.bare < LEAST_BARE:
        lines.append(
            f"note: only {percent(record.bare, 1)} of the points show the bare part, so thickness assumes parabolic "
            "beads. Scan the surroundings of the print too, or leave a margin"
        )
    if abs(ratio.value - 1.0) > max(NOTABLE_VOLUME, TWO_SIDED * ratio.deviation):
        lines.append(
            f"warning: {percent(abs(ratio.value - 1.0))} {'more' if ratio.value > 1.0 else 'less'} material than "
            "planned; fit the flow anew with `geoprint fit-flow`, or check pressure and material"
        )
    return [*lines, *shift_sentences(record.scan.file, record.shift)]


def lying_text(record: LyingRecord) -> str:
    """Return sentences on a part before it is printed on."""
    lies = (
        f"{record.part} lies {record.offset_mean_mm:+z.3f} mm off its file on average, {record.offset_rms_mm:.3f} mm "
        f"root mean square. Range: {record.offset_least_mm:+z.3f} to {record.offset_most_mm:+z.3f} mm (+/- "
        f"{TWO_SIDED * record.deviation_mm:.3f}), over {percent(record.seen)} of its area; allowed: "
        f"{record.allowed_mm:g} mm"
    )
    fitted = (
        f"fitted smoothly over {record.smoothing_mm:.2g} mm, from which {record.scan.used} points are off by "
        f"{record.residual_mm:.3f} mm (standard deviation)"
    )
    mesh = f"{record.mesh} is the measured surface: plan on it with `geoprint plan {record.mesh} --unit mm`"
    return "\n".join([lies, fitted, *_placed(record.scan, record.registration), mesh])


def scanned_run_rows(runs: Sequence[ScannedRunRecord]) -> list[tuple[str, ...]]:
    """Return the rows of the table of runs, below `COLUMNS`."""
    return [_run(run) for run in runs]


def _placed(scan: ScanFileRecord, found: RegistrationRecord) -> list[str]:
    """Return how well a scan lies on its part."""
    shift, turn = TWO_SIDED * found.shift_deviation_mm, TWO_SIDED * found.turn_deviation_deg
    placed = (
        f"{scan.file}: {scan.used} of {scan.points} points lie over the part; noise {found.noise_mm:.3f} mm, pose "
        f"known within {shift:.3f} mm and {turn:.3f} degrees"
    )
    lines = [placed]
    if found.scale is not None:
        larger = 1.0 / found.scale.value - 1.0
        lines.append(
            f"warning: {scan.file} is {percent(abs(larger), 2)} too {'large' if larger > 0.0 else 'small'}; its "
            f"coordinates are multiplied by {_said(found.scale, '{:.4f}'.format)} here; calibrate the scanner"
        )
    if found.loose:
        lines.append(
            f"note: {found.loose} of six directions of that pose are fixed by nothing in the scan, and "
            f"{'as given' if found.given else 'as the scan had them'}"
        )
    return lines


def _run(run: ScannedRunRecord) -> tuple[str, ...]:
    return (
        str(run.run + 1), f"{run.length_mm:.1f}", percent(run.seen_mm / run.length_mm), f"{run.missing_mm:.1f}",
        _estimate(run.ratio, _SHARE), _estimate(run.crest_mm, _MM), _estimate(run.offset_mm, _SIGNED_MM),
    )  # fmt: skip


def _estimate(found: EstimateRecord | None, form: Form) -> str:
    return _NONE if found is None else _said(found, form)


def _said(found: EstimateRecord, form: Form) -> str:
    """Return a figure with what 95 of 100 lie within."""
    return f"{form(found.value)} +/- {form(TWO_SIDED * found.deviation).removeprefix('+')}"
