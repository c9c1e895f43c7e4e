"""The schemas of appraisal.json, lying.json and simulated.json: what photographs, scans and simulations show."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Literal, TypeVar

from pydantic import Field

from geoprint.model import Count, Place, Rounded, Thousandths
from geoprint.postprocessor import Json
from geoprint.process.feedback import FlowChange
from geoprint.reporting.records.rounding import Record, as_json

# What appraisal.json says of the program that was printed, and plan.json of what that print changes in the next one.
#
# A print is held against what its own program deposits on its cell: so an appraisal carries that, and which
# dispenser it was. Its seal is a hash of all of its figures, so that nothing is fed back that somebody has edited.


_R = TypeVar("_R", bound=Record)
# The key of an appraisal that a plan takes, and that of its seal.
PRINTED, SEAL = "printed", "seal"


class PrintedRunRecord(Record):
    """A run that was printed."""

    run: Count = Field(description="number of the run, as in poses.csv")
    length_mm: Rounded = Field(description="planned length of the run [mm]")
    middle_mm: Place = Field(description="point halfway along the run [mm]")


class PrintedPartRecord(Record):
    """A part of a run, in the order of those that were measured."""

    run: Count = Field(description="number of the run, as in poses.csv")
    factor: Rounded = Field(description="flow commanded on the part of the run over the planned one, by feedback")
    deposited: Rounded = Field(
        description="volume that the program deposits on the part of the run, as executed, over the planned one"
    )


class PrintedRecord(Record):
    """What was printed: a program on its cell."""

    plan: str = Field(description="name of the bundle")
    part: str = Field(description="name of the part's file")
    part_sha256: str = Field(description="SHA-256 of the part's file", pattern="^[0-9a-f]{64}$")
    executed: bool = Field(
        description="whether the program was executed; else the bundle has none, and its paths count"
    )
    dispenser: dict[str, Rounded | str] = Field(description="values of the dispenser, by the keys of the cell file")
    speed_mm_s: Rounded = Field(description="speed of the print [mm/s]")
    opened_mm: Rounded = Field(description="length by which the valve was opened earlier, by feedback [mm]")
    shut_mm: Rounded = Field(description="length by which the valve was shut earlier, by feedback [mm]")
    runs: tuple[PrintedRunRecord, ...] = Field(description="runs in the order of printing")
    parts: tuple[PrintedPartRecord, ...] = Field(description="parts of the runs, in their order")
    seal: str = Field(default="", description="SHA-256 of all figures of this file", pattern="^([0-9a-f]{64})?$")


def sealed(record: _R) -> _R:
    """Return an appraisal whose `printed` carries the hash of all of its figures; as it is without that."""
    printed: PrintedRecord | None = getattr(record, PRINTED)
    if printed is None:
        return record
    seal = seal_of(as_json(record))
    return record.model_copy(update={PRINTED: printed.model_copy(update={SEAL: seal})})


def seal_of(appraisal: Mapping[str, Json]) -> str:
    """Return the SHA-256 of an appraisal as JSON carries it, but for its seal."""
    printed = appraisal[PRINTED]
    assert isinstance(printed, Mapping)  # noqa: S101  (as both callers have found)
    content = {**appraisal, PRINTED: {key: value for key, value in printed.items() if key != SEAL}}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode("utf-8")).hexdigest()


class FeedbackRecord(Record):
    """What the last print changes."""

    sha256: str = Field(description="SHA-256 of the inspection file", pattern="^[0-9a-f]{64}$")
    plan: str = Field(description="name of the bundle that was printed")
    seen_in: str = Field(description="name of the file of the scan or photograph")
    changes: tuple[FlowChange, ...] = Field(
        description="causes of errors that are corrected, the strongest first; none where nothing was significant"
    )
    least_factor: Rounded = Field(description="least flow that is commanded, over the wanted one")
    most_factor: Rounded = Field(description="largest flow that is commanded, over the wanted one")
    speed_mm_s: Rounded | None = Field(
        default=None,
        description=(
            "speed at which a valve deposits the corrected flow [mm/s]; left out where the print has the cell's speed"
        ),
    )
    valve_opens_earlier_mm: Rounded = Field(
        description="length by which the valve opens earlier than the cell says [mm of path]"
    )
    valve_shuts_earlier_mm: Rounded = Field(
        description="length by which the valve shuts earlier than the cell says [mm of path]"
    )
    gaps: Count = Field(description="number of parts of runs with hardly any material, which no flow corrects")
    held: Rounded = Field(description="share of the poses at which the cell's bounds hold the flow")
    error_found: Rounded = Field(
        description=(
            "root mean square error of the volume of parts of runs, as a share; without what the "
            "printed program did by itself"
        )
    )
    error_expected: Rounded = Field(
        description=(
            "root mean square error of the volume expected of the next print, as a share, by the causes that are known"
        )
    )


# The schema of appraisal.json of a scan: where it was taken, and how thick the print is, run by run.
#
# Deviations are standard deviations, by noise of the scan and by how well its pose is known. `parts` is what
# corrects the next print: volume over the planned one along the runs.


# A row of a rotation.
Row = tuple[Rounded, Rounded, Rounded, Rounded]


class ScanFileRecord(Record):
    """The scan."""

    file: str = Field(description="name of the file")
    sha256: str = Field(description="SHA-256 of the file")
    unit: str = Field(description="unit of the coordinates in the scan, as given")
    points: Count = Field(description="number of points in the scan; vertices of a mesh")
    used: Count = Field(description="number of points that are used: those over the part, thinned out")


class EstimateRecord(Record):
    """A figure with its standard deviation."""

    value: Rounded = Field(description="value that was measured")
    deviation: Rounded = Field(description="standard deviation of the measured value")


class ShiftRecord(Record):
    """The shift of a whole print from its plan: the part lies elsewhere than it was touched."""

    by_mm: Place = Field(description="shift of the whole print from its plan, in the part's coordinates [mm]")
    deviation_mm: Rounded = Field(description="standard deviation of the length of the shift [mm]")


class RegistrationRecord(Record):
    """Where a scan was taken."""

    pose: tuple[Row, Row, Row, Row] = Field(
        description="rows of the transform from the scan's coordinates to those of the part, the scale in it [mm]"
    )
    scale: EstimateRecord | None = Field(
        description="factor by which the scan's coordinates are multiplied; null where they are true to scale"
    )
    middle_mm: Place = Field(description="middle of the scan, about which it is turned, in the part's coordinates [mm]")
    covariance: tuple[tuple[float, ...], ...] = Field(
        description="covariance of the scan's turn [rad] and shift [mm], 6 by 6"
    )
    shift_deviation_mm: Rounded = Field(
        description="standard deviation of the position of the scan's middle, along the worst direction [mm]"
    )
    turn_deviation_deg: Rounded = Field(
        description="standard deviation of the scan's turn about the worst axis [degrees]"
    )
    given: bool = Field(description="whether the pose that the search began from was given")
    loose: Count = Field(
        description="number of directions of turn and shift that nothing in the scan fixes, and that are as given"
    )
    noise_mm: Rounded = Field(description="standard deviation of a point of the scan [mm]")
    on_part: Rounded = Field(description="share of the scan's points that lie on the part")
    bead_width: Rounded = Field(description="width of the beads over the width that their flow asks for")
    offset_mm: Rounded = Field(description="offset of all beads to the left of their paths, as seen from outside [mm]")


class FromPlanRecord(Record):
    """How the thickness differs from the planned one, cell by cell of the surface, by area."""

    mean: EstimateRecord = Field(
        description="mean difference of the thickness from the planned one, over all that is seen [mm]"
    )
    rms_mm: Rounded = Field(description="root mean square difference of the thickness from the planned one [mm]")
    p5_mm: Rounded = Field(description="5th percentile of the difference of the thickness from the planned one [mm]")
    p95_mm: Rounded = Field(description="95th percentile of the difference of the thickness from the planned one [mm]")
    noise_mm: Rounded = Field(description="part of the root mean square difference that is noise of the scan [mm]")


class ScannedRunRecord(Record):
    """A run of the plan, as printed."""

    run: Count = Field(description="number of the run, as in poses.csv")
    length_mm: Rounded = Field(description="planned length of the run [mm]")
    seen_mm: Rounded = Field(description="length of the run that the scan shows [mm]")
    missing_mm: Rounded = Field(description="length without material, of the length that the scan shows [mm]")
    ratio: EstimateRecord | None = Field(
        description="volume of the run over the planned one; null where nothing is seen"
    )
    crest_mm: EstimateRecord | None = Field(
        description="height over the part along the middle of the run's bead; null where no points show that [mm]"
    )
    offset_mm: EstimateRecord | None = Field(
        description="offset of the bead's middle to the left of its path, as seen from outside [mm]"
    )


class PartOfRunRecord(Record):
    """A part of a run, about two spacings long."""

    run: Count = Field(description="number of the run, as in poses.csv")
    start_mm: Thousandths = Field(description="arc length from the start of the run at which the part begins [mm]")
    end_mm: Thousandths = Field(description="arc length from the start of the run at which the part ends [mm]")
    ratio: Rounded | None = Field(
        description="volume of the part of the run over the planned one; null where the scan does not show it"
    )
    deviation: Rounded | None = Field(description="standard deviation of the volume over the planned one")
    offset_mm: Rounded | None = Field(
        description="offset of the bead's middle to the left of its path, as seen from outside [mm]"
    )
    offset_deviation_mm: Rounded | None = Field(
        description="standard deviation of the offset of the bead's middle [mm]"
    )


class ScanAppraisalRecord(Record):
    """The content of appraisal.json of a scan."""

    layout: Literal[2] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="version of geoprint")
    kind: Literal["scan"] = Field(description="kind of file that was inspected")
    printed: PrintedRecord = Field(description="the program that was printed, and what it deposits")
    scan: ScanFileRecord = Field(description="file of the scan")
    registration: RegistrationRecord = Field(description="pose of the scan on the part")
    layer_height_mm: Rounded = Field(description="planned layer height [mm]")
    seen: Rounded = Field(description="share of the area to be covered that the scan shows")
    covered: EstimateRecord = Field(description="share of the area to be covered and seen that has material")
    bare: Rounded = Field(description="share of the scan's points that lie over what the plan leaves bare")
    volume_seen_mm3: EstimateRecord = Field(description="volume of the material that the scan shows [mm3]")
    volume_ratio: EstimateRecord = Field(
        description="volume of the material that the scan shows, over the planned one there"
    )
    volume_planned_mm3: Rounded = Field(description="volume of the whole plan [mm3]")
    thickness_mm: EstimateRecord = Field(description="mean thickness over what is to be covered and seen [mm]")
    from_plan: FromPlanRecord = Field(description="difference of the thickness from the planned one")
    shift: ShiftRecord | None = Field(
        default=None, description="shift of the whole print from its plan; left out where there is none"
    )
    runs: tuple[ScannedRunRecord, ...] = Field(description="runs in the order of printing")
    parts: tuple[PartOfRunRecord, ...] = Field(
        description="parts of the runs, in their order; at most 2000 and one a run"
    )


class LyingRecord(Record):
    """The content of lying.json: the part as it lies there before it is printed on."""

    layout: Literal[1] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="version of geoprint")
    part: str = Field(description="name of the part's file")
    scan: ScanFileRecord = Field(description="file of the scan or of touched points")
    registration: RegistrationRecord = Field(description="pose of the scan on the part")
    seen: Rounded = Field(description="share of the part's area near the points of the scan")
    offset_mean_mm: Rounded = Field(description="mean offset of the surface along its normal, over what is seen [mm]")
    offset_rms_mm: Rounded = Field(description="root mean square offset of the surface along its normal [mm]")
    offset_least_mm: Rounded = Field(description="lowest offset of the surface along its normal [mm]")
    offset_most_mm: Rounded = Field(description="highest offset of the surface along its normal [mm]")
    deviation_mm: Rounded = Field(description="standard deviation of the surface's offset at a place [mm]")
    residual_mm: Rounded = Field(description="standard deviation of the points from the surface found [mm]")
    smoothing_mm: Rounded = Field(description="length over which the offset of the surface is smooth [mm]")
    allowed_mm: Rounded = Field(description="largest offset of the surface that was allowed [mm]")
    mesh: str = Field(description="file of the mesh of the part as it lies there, which `geoprint plan` takes")


# The schema of appraisal.json: what photographs show of prints, and how far these lie from their plan.
#
# Lengths are pixels of the photograph where they end in px, else mm on the surface.


# Start and end, as arc length or in pixels.
Stretch = tuple[Thousandths, Thousandths]


class DirectedRecord(Record):
    """Distances from every place of one set to the nearest of another."""

    largest: Rounded = Field(description="largest distance from a place of one set to the nearest of the other")
    p95: Rounded = Field(
        description="95th percentile of the distance from a place of one set to the nearest of the other"
    )
    mean: Rounded = Field(description="mean distance from a place of one set to the nearest of the other")


class ApartRecord(Record):
    """How far two sets of lines lie apart."""

    hausdorff: Rounded = Field(
        description="largest distance between both sets of lines, in either direction: eq. 3 of the paper"
    )
    p95: Rounded = Field(description="the larger 95th percentile of the distance, of both directions")
    mean: Rounded = Field(description="mean distance between both sets of lines, of both directions")
    there: DirectedRecord = Field(description="distances from the first to the second; from the plan to the print")
    back: DirectedRecord = Field(description="distances from the second to the first; from the print to the plan")


class LineRecord(Record):
    """A line of material in a photograph."""

    length_px: Rounded = Field(description="length of the line as far as it is seen [pixels]")
    width_mean_px: Rounded = Field(description="mean width of the line between its edges [pixels]")
    width_cv: Rounded = Field(description="standard deviation of the width over its mean")
    closed: bool = Field(description="whether the end of the line meets its start")
    breaks_px: tuple[Stretch, ...] = Field(
        description="stretches of the line without material, from and to by arc length [pixels]"
    )


class OutlineRecord(Record):
    """How the outline of the part placed the camera."""

    within_px: Rounded = Field(
        description=(
            "distance within which places of the part are seen of where they are, with 95 % confidence [pixels]"
        )
    )
    within_mm: Rounded = Field(description="distance `within_px` on the part, by what a pixel covers [mm]")
    alike: Count = Field(description="number of camera positions from which the outline looks alike")
    clearer: Rounded | None = Field(
        description=(
            "how many times nearer to the plan the lines lie from the position taken than from the next one "
            "alike; null for one"
        )
    )


class CameraRecord(Record):
    """The camera that took a photograph."""

    place_mm: Place = Field(description="position of the camera's pinhole, in the part's coordinates [mm]")
    fiducials: Count = Field(
        description="number of fiducials that the camera was placed by; 0 where the part's outline placed it"
    )
    outline: OutlineRecord | None = Field(
        default=None, description="how the part's outline placed the camera; left out where fiducials placed it"
    )
    residual_px: Rounded = Field(
        description="root mean square distance of fiducials, or the outline, from where they are seen [pixels]"
    )
    lens_residual_px: Rounded = Field(
        description="root mean square distance of the checkerboard's corners; 0 where the lens was given [pixels]"
    )
    mm_per_px: Rounded = Field(description="mean length that a pixel covers on the beads [mm]")


class RunRecord(Record):
    """A run of the plan, as printed."""

    run: Count = Field(description="number of the run, as in poses.csv")
    length_mm: Rounded = Field(description="planned length of the run [mm]")
    judged_mm: Rounded = Field(description="length of the run in sight that was judged [mm]")
    seen_mm: Rounded = Field(
        description="judged length without corners and joints, of which width and offset are known [mm]"
    )
    missing_mm: Rounded = Field(description="judged length without material [mm]")
    width_mm: EstimateRecord | None = Field(description="mean width of the run's bead [mm]; null where it is not known")
    width_planned_mm: Rounded = Field(
        description="mean planned width of the run: flow over the height of the layer [mm]"
    )
    of_usual: EstimateRecord | None = Field(
        default=None,
        description=(
            "width of the run over the planned one, over what is usual in the print; null where widths do not compare"
        ),
    )
    whole: Literal["too wide", "too narrow"] | None = Field(
        description=(
            "too wide or too narrow, where the run's width over the planned one is a quarter of volume off what "
            "is usual in the print"
        )
    )
    width_cv: Rounded | None = Field(
        description="standard deviation of the width over its mean; where the plan's flow differs, over that"
    )
    offset_mm: EstimateRecord | None = Field(
        description="offset of the bead to the left of where it is planned, seen from outside [mm]"
    )
    offset_rms_mm: Rounded | None = Field(
        description="root mean square offset of the bead from where it is planned [mm]"
    )
    gaps_mm: tuple[Stretch, ...] = Field(
        description="stretches of the run without material, from and to by arc length [mm]"
    )
    blobs_mm: tuple[Stretch, ...] = Field(
        description="stretches wider than 1.3 times the run's median width, from and to by arc length [mm]"
    )
    thin_mm: tuple[Stretch, ...] = Field(
        description="stretches narrower than 0.7 times the run's median width, from and to by arc length [mm]"
    )


class PhotographedPartRecord(Record):
    """A part of a run, about two spacings long."""

    run: Count = Field(description="number of the run, as in poses.csv")
    start_mm: Thousandths = Field(description="arc length from the start of the run at which the part begins [mm]")
    end_mm: Thousandths = Field(description="arc length from the start of the run at which the part ends [mm]")
    width_mm: Rounded | None = Field(description="width of the bead [mm]; null where it is not known")
    width_deviation_mm: Rounded | None = Field(description="standard deviation of the width of the bead [mm]")
    width_planned_mm: Rounded = Field(description="planned width: flow over the height of the layer [mm]")
    offset_mm: Rounded | None = Field(
        description="offset of the bead's middle to the left of its path, as seen from outside [mm]"
    )
    offset_deviation_mm: Rounded | None = Field(
        description="standard deviation of the offset of the bead's middle [mm]"
    )


class OnPlanRecord(Record):
    """A photograph held against the plan."""

    camera: CameraRecord = Field(description="camera of the photograph")
    reach_mm: Rounded = Field(description="largest distance from a run at which its material may lie [mm]")
    judged: Rounded = Field(description="share of the plan's length in sight")
    missing: Rounded = Field(description="share of the judged length without material")
    usual: Rounded | None = Field(
        description="usual width over the planned one in the print: a photograph cannot separate spread from volume"
    )
    width_mean_mm: Rounded | None = Field(description="mean width of all beads [mm]; null where it is not known")
    width_planned_mm: Rounded = Field(description="mean planned width of all runs [mm]")
    width_cv: Rounded | None = Field(
        description=(
            "standard deviation of the width over its mean, of all runs together; where the plan's flow differs, "
            "over that"
        )
    )
    offset_mean_mm: Rounded | None = Field(description="mean offset of all beads to the left of their runs [mm]")
    offset_rms_mm: Rounded | None = Field(description="root mean square offset of all beads from their runs [mm]")
    shift: ShiftRecord | None = Field(
        default=None, description="shift of the whole print from its plan; left out where there is none"
    )
    offset_deviation_common_mm: Rounded = Field(
        description="standard deviation that all offsets share, which is the camera's [mm]"
    )
    blur_px: Rounded = Field(
        description="standard deviation of the photograph's unsharpness, as edges have it [pixels]"
    )
    gamma: Rounded = Field(description="gamma of the photograph's tone curve, as edges have it")
    white: Rounded = Field(description="share of the beads that is white in the photograph, and left out")
    darker: bool = Field(description="whether beads are darker than what they lie on")
    doubts: tuple[str, ...] = Field(description="doubts to know before the figures are trusted")
    strays: Rounded = Field(description="share of the places of beads farther than the reach from every run")
    apart_mm: ApartRecord = Field(description="distances between the lines of plan and print [mm]")
    runs: tuple[RunRecord, ...] = Field(description="runs in the order of printing")
    parts: tuple[PhotographedPartRecord, ...] = Field(description="parts of the runs, in their order")


class PhotographRecord(Record):
    """A photograph, appraised."""

    file: str = Field(description="name of the file")
    sha256: str = Field(description="SHA-256 of the file")
    size_px: tuple[int, int] = Field(description="width and height of the photograph, upright [pixels]")
    turned: bool = Field(description="whether the photograph was turned upright, as the camera noted")
    bead_width_px: Rounded = Field(description="width of the lines that were looked for [pixels]")
    threshold: Rounded = Field(
        description="threshold of the lines' contrast, over the spread of the grey values around them"
    )
    length_px: Rounded = Field(description="length of all lines [pixels]")
    width_mean_px: Rounded = Field(description="mean width of all lines, by length [pixels]")
    width_cv: Rounded = Field(description="standard deviation of the width over its mean, of all lines together")
    lines: tuple[LineRecord, ...] = Field(description="lines in the photograph, the longest first")
    on_plan: OnPlanRecord | None = Field(
        default=None, description="how the photograph compares with the plan; left out without a plan"
    )


class PairRecord(Record):
    """Two photographs, one over the other."""

    first: str = Field(description="name of the file of the first photograph")
    second: str = Field(description="name of the file of the second photograph")
    apart_px: ApartRecord = Field(description="distances between the middles of the lines of both photographs [pixels]")


class AppraisalRecord(Record):
    """The content of appraisal.json."""

    layout: Literal[2] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="version of geoprint")
    kind: Literal["photographs"] = Field(description="kind of file that was inspected")
    plan: str | None = Field(default=None, description="name of the bundle of the plan; left out without one")
    part: str | None = Field(default=None, description="name of the part's file; left out without a plan")
    printed: PrintedRecord | None = Field(
        default=None,
        description="the program that was printed, and what it deposits; left out without a plan, and of several "
        "photographs",
    )
    shade: Literal["lighter", "darker"] = Field(description="shade of the beads against what they lie on")
    width_chosen: bool = Field(description="whether the width that lines were looked for with was chosen, not given")
    threshold_chosen: bool = Field(description="whether the threshold was chosen (Otsu), not given")
    photographs: tuple[PhotographRecord, ...] = Field(description="photographs in the order of the command")
    pairs: tuple[PairRecord, ...] = Field(description="every two of the photographs, compared; empty for one")


# The schema of simulated.json: what a bundle deposits in simulation, run by run, and what was put in besides.


class SimulatedRunRecord(Record):
    """One run of the plan that deposits material."""

    run: Count = Field(description="number of the run, as in poses.csv")
    wanted_mm3: Rounded = Field(description="volume that the path of the run asks for [mm3]")
    laid_mm3: Rounded = Field(description="volume that lies along the run [mm3]")
    beside_mm3: Rounded = Field(
        description=(
            "volume along the run that lies farther than half a spacing before its beginning or behind its end [mm3]"
        )
    )
    longest_bare_mm: Rounded = Field(description="longest stretch of the run without material")


class SimulatedRecord(Record):
    """All that simulated.json says."""

    layout: Literal[1] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="version of geoprint")
    plan: str = Field(description="name of the folder of the bundle")
    laid_by: Literal["program", "paths"] = Field(
        description="basis of the simulation: the program as executed, or the paths where the bundle has none"
    )
    flow: Rounded = Field(description="volume that flows, over the volume of the plan")
    spread: Rounded = Field(description="width of the beads over the width that their flow asks for")
    width_noise: Rounded = Field(description="standard deviation of the width along a bead, over its mean")
    offset_mm: Rounded = Field(description="offset of all beads to the left of their paths [mm]")
    seed: Count = Field(description="number that fixes all random noise")
    wanted_mm3: Rounded = Field(description="volume that all paths ask for [mm3]")
    laid_mm3: Rounded = Field(description="volume that lies on the part [mm3]")
    runs: tuple[SimulatedRunRecord, ...] = Field(description="runs in the order of printing")
