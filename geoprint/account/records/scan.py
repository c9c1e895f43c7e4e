"""The schema of appraisal.json of a scan: where it was taken, and how thick the print is, run by run.

Deviations are standard deviations, by noise of the scan and by how well its pose is known. `parts` is what corrects the
next print: volume over the planned one along the runs.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.account.records.feedback import PrintedRecord
from geoprint.account.records.rounding import Count, Place, Record, Rounded, Thousandths

# A row of a rotation.
Row = tuple[Rounded, Rounded, Rounded, Rounded]


class ScanFileRecord(Record):
    """The scan."""

    file: str = Field(description="its name")
    sha256: str = Field(description="of the file")
    unit: str = Field(description="of its coordinates, as given")
    points: Count = Field(description="that it holds; vertices of a mesh")
    used: Count = Field(description="of these, thinned out, that lie over the part")


class EstimateRecord(Record):
    """A figure with its standard deviation."""

    value: Rounded = Field(description="as measured")
    deviation: Rounded = Field(description="standard deviation of that")


class ShiftRecord(Record):
    """By how much a whole print lies beside its plan: the part lies elsewhere than it was touched."""

    by_mm: Place = Field(description="in the part's coordinates [mm]")
    deviation_mm: Rounded = Field(description="standard deviation of its length [mm]")


class RegistrationRecord(Record):
    """Where a scan was taken."""

    pose: tuple[Row, Row, Row, Row] = Field(
        description="rows of the transform from the scan's coordinates to those of the part, the scale in it [mm]"
    )
    scale: EstimateRecord | None = Field(
        description="by which the scan's coordinates are multiplied; null where they are true to scale"
    )
    middle_mm: Place = Field(description="of the scan, in the part's coordinates; turns are about it [mm]")
    covariance: tuple[tuple[float, ...], ...] = Field(description="6 by 6, of turn [rad] and shift [mm]")
    shift_deviation_mm: Rounded = Field(description="of the middle, along the worst direction [mm]")
    turn_deviation_deg: Rounded = Field(description="about the worst axis [degrees]")
    given: bool = Field(description="whether the pose it began from was given")
    loose: Count = Field(description="directions that nothing in the scan fixes, and that are as given")
    noise_mm: Rounded = Field(description="standard deviation of a point [mm]")
    on_part: Rounded = Field(description="share of the points that lie on the part")
    bead_width: Rounded = Field(description="width of the beads over that which their flow asks for")
    offset_mm: Rounded = Field(description="of all beads to the left of their paths, as seen from outside [mm]")


class FromPlanRecord(Record):
    """How the thickness differs from the planned one, cell by cell of the surface, by area."""

    mean: EstimateRecord = Field(description="of all that is seen [mm]")
    rms_mm: Rounded = Field(description="root mean square [mm]")
    p5_mm: Rounded = Field(description="5th percentile [mm]")
    p95_mm: Rounded = Field(description="95th percentile [mm]")
    noise_mm: Rounded = Field(description="what of the root mean square is the scan's own [mm]")


class ScannedRunRecord(Record):
    """A run of the plan, as printed."""

    run: Count = Field(description="as poses.csv counts it")
    length_mm: Rounded = Field(description="of the plan [mm]")
    seen_mm: Rounded = Field(description="of it in the scan [mm]")
    missing_mm: Rounded = Field(description="of that without material [mm]")
    ratio: EstimateRecord | None = Field(description="volume over the planned one; null where nothing is seen")
    crest_mm: EstimateRecord | None = Field(
        description="height over the part along the middle of its bead; null where no points show that [mm]"
    )
    offset_mm: EstimateRecord | None = Field(description="of its middle to the left, as seen from outside [mm]")


class PartOfRunRecord(Record):
    """A part of a run, about two spacings long."""

    run: Count = Field(description="as poses.csv counts it")
    start_mm: Thousandths = Field(description="arc length from the start of the run at which it begins [mm]")
    end_mm: Thousandths = Field(description="arc length at which it ends [mm]")
    ratio: Rounded | None = Field(description="volume over the planned one; null where the scan does not show it")
    deviation: Rounded | None = Field(description="standard deviation of that")
    offset_mm: Rounded | None = Field(description="of the bead's middle to the left, as seen from outside [mm]")
    offset_deviation_mm: Rounded | None = Field(description="standard deviation of that [mm]")


class ScanAppraisalRecord(Record):
    """The content of appraisal.json of a scan."""

    layout: Literal[2] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="of geoprint")
    kind: Literal["scan"] = Field(description="what was appraised")
    printed: PrintedRecord = Field(description="the program that was printed, and what it deposits")
    scan: ScanFileRecord = Field(description="the file")
    registration: RegistrationRecord = Field(description="where it was taken")
    layer_height_mm: Rounded = Field(description="of the plan [mm]")
    seen: Rounded = Field(description="share of the area to be covered that the scan shows")
    covered: EstimateRecord = Field(description="share of that which has material")
    bare: Rounded = Field(description="share of the points over what the plan leaves bare")
    volume_seen_mm3: EstimateRecord = Field(description="of the material that the scan shows [mm3]")
    volume_ratio: EstimateRecord = Field(description="of that over the planned one there")
    volume_planned_mm3: Rounded = Field(description="of the whole plan [mm3]")
    thickness_mm: EstimateRecord = Field(description="mean over what is to be covered and seen [mm]")
    from_plan: FromPlanRecord = Field(description="how the thickness differs from the planned one")
    shift: ShiftRecord | None = Field(default=None, description="of all of it; left out where there is none")
    runs: tuple[ScannedRunRecord, ...] = Field(description="in their order")
    parts: tuple[PartOfRunRecord, ...] = Field(description="of the runs, in their order; at most 2000 and one a run")


class LyingRecord(Record):
    """The content of lying.json: the part as it lies there before it is printed on."""

    layout: Literal[1] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="of geoprint")
    part: str = Field(description="name of the part's file")
    scan: ScanFileRecord = Field(description="scan or touched points")
    registration: RegistrationRecord = Field(description="where it was taken")
    seen: Rounded = Field(description="share of the part's area near its points")
    offset_mean_mm: Rounded = Field(description="of the surface along its normal, over what is seen [mm]")
    offset_rms_mm: Rounded = Field(description="root mean square of it [mm]")
    offset_least_mm: Rounded = Field(description="the lowest [mm]")
    offset_most_mm: Rounded = Field(description="the highest [mm]")
    deviation_mm: Rounded = Field(description="standard deviation of the offset at a place [mm]")
    residual_mm: Rounded = Field(description="standard deviation of the points from the surface found [mm]")
    smoothing_mm: Rounded = Field(description="length over which the offset is smooth [mm]")
    allowed_mm: Rounded = Field(description="largest offset that was allowed [mm]")
    mesh: str = Field(description="name of the mesh of the surface that is there, which `geoprint plan` takes")
