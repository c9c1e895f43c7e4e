"""What a person reads of appraised scans: the runs of the plan, how thick the print is, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.account.records.scan import (
    EstimateRecord,
    LyingRecord,
    RegistrationRecord,
    ScanAppraisalRecord,
    ScanFileRecord,
    ScannedRunRecord,
)
from geoprint.account.texts.appraising import grid, shift_sentences

_NONE = "-"
COLUMNS = ("run", "length mm", "seen", "missing mm", "volume", "crest mm", "offset mm")
# Standard deviations to either side that hold 95 of 100.
TWO_SIDED = 1.96
# Less bare part than this among the points says little of where the part's surface is.
LEAST_BARE = 0.03
# A volume farther from the planned one than this is worth a word.
NOTABLE_VOLUME = 0.03


def scan_text(told: ScanAppraisalRecord) -> str:
    """Return tables and sentences on a scan of a print."""
    lines = grid(COLUMNS, run_rows(told.runs))
    return "\n".join([*lines, "", *scan_sentences(told)])


def scan_sentences(told: ScanAppraisalRecord) -> list[str]:
    """Return what a scan shows of a print in sentences, then notes and warnings."""
    off, ratio = told.from_plan, told.volume_ratio
    volume = (
        f"{told.scan.file}: the print has {_said(ratio, '{:.1%}')} of the planned volume where it is seen, and is "
        f"{_said(told.thickness_mm, '{:.3f}')} mm thick in the mean"
    )
    covered = (
        f"of the area to be covered {told.seen:.1%} is seen, and {_said(told.covered, '{:.1%}')} of that has material: "
        f"{_said(told.volume_seen_mm3, '{:.0f}')} mm3 of {told.volume_planned_mm3:.0f} mm3 planned in all"
    )
    thickness = (
        f"thickness minus the planned one: {_said(off.mean, '{:+.3f}')} mm in the mean, {off.rms_mm:.3f} mm root mean "
        f"square ({off.noise_mm:.3f} mm of it by the scan), 90 % between {off.p5_mm:+.3f} and {off.p95_mm:+.3f} mm"
    )
    beads = (
        f"beads are {told.registration.bead_width:.2f} times as wide as their flow over the layer's height, and lie "
        f"{told.registration.offset_mm:+.3f} mm to the left of their paths"
    )
    lines = [volume, covered, thickness, *_placed(told.scan, told.registration), beads]
    if told.bare < LEAST_BARE:
        lines.append(
            f"note: only {told.bare:.1%} of the points show the part bare, so that thickness hangs on beads being "
            "parabolas across; scan what lies around the print as well, or leave a margin"
        )
    if abs(ratio.value - 1.0) > max(NOTABLE_VOLUME, TWO_SIDED * ratio.deviation):
        lines.append(
            f"warning: {abs(ratio.value - 1.0):.0%} {'more' if ratio.value > 1.0 else 'less'} material than planned; "
            "fit the flow anew with `geoprint fit-flow`, or check pressure and material"
        )
    return [*lines, *shift_sentences(told.scan.file, told.shift)]


def lying_text(told: LyingRecord) -> str:
    """Return sentences on a part before it is printed on."""
    lies = (
        f"{told.part} lies {told.offset_mean_mm:+.3f} mm off its file in the mean, {told.offset_rms_mm:.3f} mm root "
        f"mean square, {told.offset_least_mm:+.3f} to {told.offset_most_mm:+.3f} mm (+/- "
        f"{TWO_SIDED * told.deviation_mm:.3f}), over {told.seen:.0%} of its area; allowed are {told.allowed_mm:g} mm"
    )
    fitted = (
        f"fitted smoothly over {told.smoothing_mm:.2g} mm, from which {told.scan.used} points are off by "
        f"{told.residual_mm:.3f} mm (standard deviation)"
    )
    mesh = f"{told.mesh} is the surface that is there: plan on it with `geoprint plan {told.mesh} --unit mm`"
    return "\n".join([lies, fitted, *_placed(told.scan, told.registration), mesh])


def run_rows(runs: Sequence[ScannedRunRecord]) -> list[tuple[str, ...]]:
    """Return the rows of the table of runs, below `COLUMNS`."""
    return [_run(run) for run in runs]


def _placed(scan: ScanFileRecord, found: RegistrationRecord) -> list[str]:
    """Return how well a scan lies on its part."""
    shift, turn = TWO_SIDED * found.shift_deviation_mm, TWO_SIDED * found.turn_deviation_deg
    placed = (
        f"{scan.file}: {scan.used} points lie over the part, {scan.points} are in the file; they have "
        f"{found.noise_mm:.3f} mm noise, and their pose is known to {shift:.3f} mm and {turn:.3f} degrees"
    )
    lines = [placed]
    if found.scale is not None:
        larger = 1.0 / found.scale.value - 1.0
        lines.append(
            f"warning: {scan.file} is {abs(larger):.2%} too {'large' if larger > 0.0 else 'small'}; its coordinates "
            f"are multiplied by {_said(found.scale, '{:.4f}')} here; calibrate the scanner"
        )
    if found.loose:
        lines.append(
            f"note: {found.loose} of six directions of that pose are fixed by nothing in the scan, and "
            f"{'as given' if found.given else 'as the scan had them'}"
        )
    return lines


def _run(run: ScannedRunRecord) -> tuple[str, ...]:
    return (
        str(run.run + 1), f"{run.length_mm:.1f}", f"{run.seen_mm / run.length_mm:.0%}", f"{run.missing_mm:.1f}",
        _estimate(run.ratio, "{:.1%}"), _estimate(run.crest_mm, "{:.3f}"), _estimate(run.offset_mm, "{:+.3f}"),
    )  # fmt: skip


def _estimate(found: EstimateRecord | None, form: str) -> str:
    return _NONE if found is None else _said(found, form)


def _said(found: EstimateRecord, form: str) -> str:
    """Return a figure with what 95 of 100 lie within."""
    return f"{form.format(found.value)} +/- {form.replace('+', '').format(TWO_SIDED * found.deviation)}"
