"""The schema of appraisal.json: what photographs show of prints, and how these lie beside their plan.

Lengths are pixels of the photograph where they end in px, else mm on the surface.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.account.records.feedback import PrintedRecord
from geoprint.account.records.rounding import Count, Place, Record, Rounded, Thousandths
from geoprint.account.records.scan import EstimateRecord, ShiftRecord

# Start and end, as arc length or in pixels.
Stretch = tuple[Thousandths, Thousandths]


class DirectedRecord(Record):
    """Distances from every place of one set to the nearest of another."""

    largest: Rounded = Field(description="of them")
    p95: Rounded = Field(description="95th percentile")
    mean: Rounded = Field(description="of them all")


class ApartRecord(Record):
    """How far two sets of lines lie apart."""

    hausdorff: Rounded = Field(description="the larger of both largest distances: eq. 3 of the paper")
    p95: Rounded = Field(description="the larger of both 95th percentiles")
    mean: Rounded = Field(description="mean of both means")
    there: DirectedRecord = Field(description="from the first to the second; from the plan to the print")
    back: DirectedRecord = Field(description="from the second to the first; from the print to the plan")


class LineRecord(Record):
    """A line of material in a photograph."""

    length_px: Rounded = Field(description="of what is seen of it [pixels]")
    width_mean_px: Rounded = Field(description="between its edges [pixels]")
    width_cv: Rounded = Field(description="standard deviation of the width over its mean")
    closed: bool = Field(description="whether its end meets its start")
    breaks_px: tuple[Stretch, ...] = Field(description="stretches without material, by arc length along it [pixels]")


class OutlineRecord(Record):
    """How the outline of the part placed the camera."""

    within_px: Rounded = Field(
        description="places of the part are seen within this of where they are, with 95 % confidence [pixels]"
    )
    within_mm: Rounded = Field(description="that on the part, by what a pixel covers [mm]")
    alike: Count = Field(description="from how many places of the camera the outline looks alike")
    clearer: Rounded | None = Field(
        description="how many times nearer to the plan the lines lie than from the next of these; null for one"
    )


class CameraRecord(Record):
    """The camera that took a photograph."""

    place_mm: Place = Field(description="of the pinhole, in the part's coordinates [mm]")
    fiducials: Count = Field(description="that it was placed by; 0 where the part's outline placed it")
    outline: OutlineRecord | None = Field(default=None, description="left out where fiducials placed it")
    residual_px: Rounded = Field(
        description="root mean square distance of fiducials, or the outline, from where they are seen [pixels]"
    )
    lens_residual_px: Rounded = Field(description="of the checkerboard's corners; 0 where the lens was given [pixels]")
    mm_per_px: Rounded = Field(description="that a pixel covers on the beads, in the mean [mm]")


class RunRecord(Record):
    """A run of the plan, as printed."""

    run: Count = Field(description="as poses.csv counts it")
    length_mm: Rounded = Field(description="of the plan [mm]")
    judged_mm: Rounded = Field(description="of it in sight [mm]")
    seen_mm: Rounded = Field(description="of that, neither corner nor joint, of which width and offset are known [mm]")
    missing_mm: Rounded = Field(description="of what is judged without material [mm]")
    width_mm: EstimateRecord | None = Field(description="mean of its bead [mm]; null where it is not known")
    width_planned_mm: Rounded = Field(description="flow over the height of the layer, in the mean [mm]")
    of_usual: EstimateRecord | None = Field(
        default=None,
        description="its width over the planned one, over what is usual in the print; null where widths do not compare",
    )
    whole: Literal["too wide", "too narrow"] | None = Field(
        description="where its width over the planned one is a quarter of volume off what is usual in the print"
    )
    width_cv: Rounded | None = Field(
        description="standard deviation of the width over its mean; where the plan's flow differs, over that"
    )
    offset_mm: EstimateRecord | None = Field(description="to the left of where it is planned, seen from outside [mm]")
    offset_rms_mm: Rounded | None = Field(description="root mean square of it [mm]")
    gaps_mm: tuple[Stretch, ...] = Field(description="stretches without material, by arc length [mm]")
    blobs_mm: tuple[Stretch, ...] = Field(description="stretches wider than 1.3 medians of the run [mm]")
    thin_mm: tuple[Stretch, ...] = Field(description="stretches narrower than 0.7 medians of the run [mm]")


class PhotographedPartRecord(Record):
    """A part of a run, about two spacings long."""

    run: Count = Field(description="as poses.csv counts it")
    start_mm: Thousandths = Field(description="arc length from the start of the run at which it begins [mm]")
    end_mm: Thousandths = Field(description="arc length at which it ends [mm]")
    width_mm: Rounded | None = Field(description="of the bead [mm]; null where it is not known")
    width_deviation_mm: Rounded | None = Field(description="standard deviation of that [mm]")
    width_planned_mm: Rounded = Field(description="flow over the height of the layer [mm]")
    offset_mm: Rounded | None = Field(description="of its middle to the left, as seen from outside [mm]")
    offset_deviation_mm: Rounded | None = Field(description="standard deviation of that [mm]")


class OnPlanRecord(Record):
    """A photograph held against the plan."""

    camera: CameraRecord = Field(description="that took it")
    reach_mm: Rounded = Field(description="how far from a run its material may lie [mm]")
    judged: Rounded = Field(description="share of the plan's length in sight")
    missing: Rounded = Field(description="share of what is judged without material")
    usual: Rounded | None = Field(
        description="width over the planned one that is usual: a photograph cannot tell spread from volume"
    )
    width_mean_mm: Rounded | None = Field(description="of all beads [mm]; null where it is not known")
    width_planned_mm: Rounded = Field(description="mean of the planned widths [mm]")
    width_cv: Rounded | None = Field(description="as of a run, of all runs together")
    offset_mean_mm: Rounded | None = Field(description="of all beads to the left of their runs [mm]")
    offset_rms_mm: Rounded | None = Field(description="root mean square of it [mm]")
    shift: ShiftRecord | None = Field(default=None, description="of the whole print; left out where there is none")
    offset_deviation_common_mm: Rounded = Field(description="standard deviation that all offsets share: the camera's")
    blur_px: Rounded = Field(description="standard deviation of the unsharpness, as edges have it [pixels]")
    gamma: Rounded = Field(description="of the tone curve, as edges have it")
    white: Rounded = Field(description="share of the beads that is white, and left out")
    darker: bool = Field(description="whether beads are darker than what they lie on")
    doubts: tuple[str, ...] = Field(description="what to know before the figures are trusted")
    strays: Rounded = Field(description="share of the places of beads farther than the reach from every run")
    apart_mm: ApartRecord = Field(description="plan and print [mm]")
    runs: tuple[RunRecord, ...] = Field(description="in their order")
    parts: tuple[PhotographedPartRecord, ...] = Field(description="of the runs, in their order")


class PhotographRecord(Record):
    """A photograph, appraised."""

    file: str = Field(description="its name")
    sha256: str = Field(description="of the file")
    size_px: tuple[int, int] = Field(description="width and height, upright [pixels]")
    turned: bool = Field(description="whether it was turned upright, as the camera noted")
    bead_width_px: Rounded = Field(description="that lines were looked for with [pixels]")
    threshold: Rounded = Field(description="of their contrast, over the spread of the grey values around them")
    length_px: Rounded = Field(description="of all lines [pixels]")
    width_mean_px: Rounded = Field(description="of all lines, by length [pixels]")
    width_cv: Rounded = Field(description="standard deviation of the width over its mean, of all lines together")
    lines: tuple[LineRecord, ...] = Field(description="the longest first")
    on_plan: OnPlanRecord | None = Field(default=None, description="left out without a plan")


class PairRecord(Record):
    """Two photographs, one over the other."""

    first: str = Field(description="name of the file")
    second: str = Field(description="name of the file")
    apart_px: ApartRecord = Field(description="the middles of their lines [pixels]")


class AppraisalRecord(Record):
    """The content of appraisal.json."""

    layout: Literal[2] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="of geoprint")
    kind: Literal["photographs"] = Field(description="what was appraised")
    plan: str | None = Field(default=None, description="name of the bundle; left out without one")
    part: str | None = Field(default=None, description="name of the part's file; left out without a plan")
    printed: PrintedRecord | None = Field(
        default=None,
        description="the program that was printed, and what it deposits; left out without a plan, and of several "
        "photographs",
    )
    shade: Literal["lighter", "darker"] = Field(description="what beads are, beside what they lie on")
    width_chosen: bool = Field(description="whether the width that lines were looked for with was chosen, not given")
    threshold_chosen: bool = Field(description="whether the threshold was chosen (Otsu), not given")
    photographs: tuple[PhotographRecord, ...] = Field(description="in the order of the command")
    pairs: tuple[PairRecord, ...] = Field(description="each two photographs; empty for one")
