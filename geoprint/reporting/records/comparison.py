"""The schemas of compare.json, cells.json, measure.json and of what `geoprint check --json` prints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, final

from pydantic import Field

from geoprint.model import Count, Place, Reading, Rounded, Thousandths, frozen
from geoprint.reporting.records.evenness import EvennessRecord, OverhangRecord, PrintedApartRecord
from geoprint.reporting.records.plan import (
    DepositionRecord,
    FeatureRecord,
    FileRecord,
    InputRecord,
    PatchRecord,
    PathsRecord,
    PlanRecord,
    SettingsRecord,
    SurfaceRecord,
)
from geoprint.reporting.records.rounding import Record
from geoprint.results import TriedMedialAxis

# The schema of compare.json: what is said of each part, and of each backend that was asked to plan it.
#
# Units and counting are those of plan.json.


class PlannedRecord(Record):
    """A backend that planned the part."""

    backend: str = Field(description="name of the backend")
    spacing_mm: float = Field(description="wanted distance between neighbouring paths [mm]")
    uniformity: EvennessRecord = Field(description="evenness of the backend's paths over the surface")
    paths: PathsRecord = Field(description="paths of the backend")
    deposition: DepositionRecord | None = Field(description="deposit of material along the backend's paths")
    overhang: OverhangRecord | None = Field(default=None, description="overhang of beads on the backend's paths")
    patches: tuple[PatchRecord, ...] = Field(description="patches of the part, where it was cut from a body")
    middles: tuple[TriedMedialAxis, ...] = Field(
        default=(), description="treatments of the medial axis that were tried, where the best was sought"
    )
    features: tuple[FeatureRecord, ...] = Field(
        default=(), description="features that the job names, with what they measure"
    )
    printable: bool | None = Field(
        description="whether the robot can print the backend's paths; null where that was not asked"
    )
    not_printable: str | None = Field(description="reason why the robot cannot print the backend's paths")
    not_reached: dict[str, Rounded] = Field(description="share of the deposit that the arm cannot reach, by reason")
    print_time_s: float | None = Field(description="time of the program [s]")
    smallest_clearance_mm: Rounded | None = Field(description="smallest clearance of the tool [mm]")
    warnings: tuple[str, ...] = Field(description="warnings that a person should act on")


class RefusedRecord(Record):
    """A backend that cannot plan the part."""

    backend: str = Field(description="name of the backend")
    refused: str = Field(description="reason of the refusal")


class PathDistancesRecord(Record):
    """How far the paths of the backends lie apart: matrices in the order of their names."""

    backends: tuple[str, ...] = Field(
        description="names of the backends that planned, in the order of rows and columns"
    )
    hausdorff: tuple[tuple[Rounded, ...], ...] = Field(
        description="largest distance between the paths of two backends, in either direction [mm]"
    )
    mean: tuple[tuple[Rounded, ...], ...] = Field(description="mean distance between the paths of two backends [mm]")


class PartRecord(Record):
    """A part that was compared."""

    part: str = Field(description="name of the part's file")
    input: InputRecord = Field(description="file of the part")
    settings: SettingsRecord = Field(description="values of the job's keys, and the cell; without the backend")
    surface: SurfaceRecord = Field(description="surface of the part")
    verdict: tuple[str, ...] = Field(description="sentences of the verdict; the first one decides")
    best: str = Field(description="the backend that covers the part best: coverage counts first, then thickness")
    backends: tuple[PlannedRecord | RefusedRecord, ...] = Field(description="backends in the order of the command")
    printed_apart: tuple[PrintedApartRecord, ...] = Field(
        description="difference expected in print between every two backends that planned"
    )
    path_distances_mm: PathDistancesRecord = Field(
        description="distances between the paths of backends that planned [mm]"
    )

    @property
    def planned(self) -> tuple[PlannedRecord, ...]:
        """Those backends that planned, in the order of the command."""
        return tuple(row for row in self.backends if isinstance(row, PlannedRecord))

    @property
    def refused(self) -> tuple[RefusedRecord, ...]:
        """Those that did not."""
        return tuple(row for row in self.backends if isinstance(row, RefusedRecord))


class FailedRecord(Record):
    """A part that could not be compared at all."""

    part: str = Field(description="name of the part's file")
    failed: str = Field(description="reason of the failure")


class ComparisonRecord(Record):
    """The content of compare.json."""

    layout: Literal[12] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="version of geoprint")
    parts: tuple[PartRecord | FailedRecord, ...] = Field(description="parts in the order of the command")


@final
@frozen
class RecordedComparison:
    """All figures of a comparison, each made once.

    Attributes:
        record: the content of compare.json.
        plans: for each part the content of plan.json by backend; empty for a part that failed.
        seconds: for each part what each backend's own stages took, by its name [s].
    """

    record: ComparisonRecord
    plans: tuple[Mapping[str, PlanRecord], ...]
    seconds: tuple[Mapping[str, float], ...]


# The schema of measure.json: how evenly files of toolpaths cover a part, side by side.
#
# Units and counting are those of plan.json.


class MotionFitRecord(Record):
    """The rigid motion that moved the paths onto the part."""

    rotation_deg: Rounded = Field(description="angle by which the motion turns the paths [degrees]")
    axis: Place = Field(description="unit vector of the axis about which the motion turns the paths")
    translation_mm: Place = Field(description="position to which the motion moves the paths' origin [mm]")
    residual_mm: Rounded = Field(
        description="root mean square distance of the paths from the part after the motion [mm]"
    )
    before_mm: Rounded = Field(
        description="root mean square distance of the paths from the part before the motion [mm]"
    )


class MeasuredRecord(Record):
    """A file of toolpaths."""

    file: str = Field(description="name of the file")
    format: str = Field(description="format of the file, as it was recognized")
    deposit: str = Field(description="how deposit was distinguished from travel")
    points: Count = Field(description="number of points read, with those of travel")
    runs: Count = Field(description="number of runs that were measured")
    dropped_runs: Count = Field(description="number of runs of a single point, left out")
    reading: Reading = Field(description="record of what the reader used of the file, skipped and assumed")
    length_mm: Rounded = Field(description="length of the deposited paths on the part [mm]")
    off_mean_mm: Rounded = Field(description="mean distance of the paths' points from the part [mm]")
    off_max_mm: Rounded = Field(description="largest distance of the paths' points from the part [mm]")
    fit: MotionFitRecord | None = Field(
        description="rigid motion of the paths onto the part; null where they were taken as they are"
    )
    uniformity: EvennessRecord = Field(description="evenness of the file's paths over the part")


class MeasurementRecord(Record):
    """The content of measure.json."""

    layout: Literal[4] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="version of geoprint")
    part: FileRecord = Field(description="file of the covered part")
    area_mm2: Rounded = Field(description="area of the part [mm2]")
    spacing_mm: float = Field(description="wanted distance between neighbouring paths [mm]")
    files: tuple[MeasuredRecord, ...] = Field(description="files in the order of the command")


class MeasureSecondsRecord(Record):
    """What measuring one file took."""

    file: str = Field(description="name of the file")
    processor_s: Thousandths = Field(description="processor time of all threads [s]")
    processor_s_per_m: Thousandths = Field(description="processor time per metre of path [s]")


class MeasureTimingsRecord(Record):
    """The content of the timings.json that is written with measure.json."""

    files: tuple[MeasureSecondsRecord, ...] = Field(description="files in the order of the command")


# The schema of cells.json: a part on several cells.


class CellRecord(Record):
    """A part on one cell."""

    cell: str = Field(description="name of the cell, as it was given")
    arm: str | None = Field(description="name of the arm; null where the cell cannot be read")
    refused: str | None = Field(description="why the part cannot be printed there; null where it can")
    reached: Rounded | None = Field(
        description="share of the deposited length that the arm reaches; null where something else refuses"
    )
    margin_deg: Rounded | None = Field(
        description="smallest angle from a joint limit, the wrist singularity or the stretched arm [degrees]"
    )
    limiting: str | None = Field(description="what the arm is nearest to")
    speed_mm_s: Rounded | None = Field(description="speed of the print [mm/s]")
    duration_s: Rounded | None = Field(description="duration of the motion [s]")
    clearance_mm: Rounded | None = Field(description="smallest clearance of the whole motion [mm]")


class CellsRecord(Record):
    """The content of cells.json."""

    layout: Literal[1] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="version of geoprint")
    part: FileRecord = Field(description="file of the part")
    backend: str = Field(description="backend that planned it on every cell")
    verdict: tuple[str, ...] = Field(description="what the figures mean, in sentences")
    cells: tuple[CellRecord, ...] = Field(description="cells in the order of the command")
