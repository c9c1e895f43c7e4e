"""The schemas of compare.json, measure.json and of what `geoprint check --json` prints."""

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
    uniformity: EvennessRecord = Field(description="as in plan.json")
    paths: PathsRecord = Field(description="as in plan.json")
    deposition: DepositionRecord | None = Field(description="as in plan.json")
    overhang: OverhangRecord | None = Field(default=None, description="as in plan.json")
    patches: tuple[PatchRecord, ...] = Field(description="as in plan.json")
    middles: tuple[TriedMedialAxis, ...] = Field(default=(), description="as in plan.json")
    features: tuple[FeatureRecord, ...] = Field(default=(), description="as in plan.json")
    printable: bool | None = Field(description="null where that was not asked")
    not_printable: str | None = Field(description="why the robot cannot print it")
    not_reached: dict[str, Rounded] = Field(description="share of the deposit that the arm cannot reach, by reason")
    print_time_s: float | None = Field(description="time of the program [s]")
    smallest_clearance_mm: Rounded | None = Field(description="smallest clearance of the tool [mm]")
    warnings: tuple[str, ...] = Field(description="as in plan.json")


class RefusedRecord(Record):
    """A backend that cannot plan the part."""

    backend: str = Field(description="name of the backend")
    refused: str = Field(description="reason of the refusal")


class PathDistancesRecord(Record):
    """How far the paths of the backends lie apart: matrices in the order of their names."""

    backends: tuple[str, ...] = Field(description="names of the two backends")
    hausdorff: tuple[tuple[Rounded, ...], ...] = Field(description="largest, in either direction [mm]")
    mean: tuple[tuple[Rounded, ...], ...] = Field(description="mean distance [mm]")


class PartRecord(Record):
    """A part that was compared."""

    part: str = Field(description="name of the part's file")
    input: InputRecord = Field(description="as in plan.json")
    settings: SettingsRecord = Field(description="as in plan.json, without the backend")
    surface: SurfaceRecord = Field(description="as in plan.json")
    verdict: tuple[str, ...] = Field(description="sentences; the first one decides")
    best: str = Field(description="the backend that covers the part best: coverage counts first, then thickness")
    backends: tuple[PlannedRecord | RefusedRecord, ...] = Field(description="backends in the order of the command")
    printed_apart: tuple[PrintedApartRecord, ...] = Field(description="every two of those that planned, in print")
    path_distances_mm: PathDistancesRecord = Field(description="between those that planned [mm]")

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

    layout: Literal[10] = Field(alias="schema", description="version of this layout")
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
    """The rigid motion that laid the paths onto the part."""

    rotation_deg: Rounded = Field(description="angle that it turns by [degrees]")
    axis: Place = Field(description="unit vector that it turns about")
    translation_mm: Place = Field(description="where it moves the paths' origin [mm]")
    residual_mm: Rounded = Field(description="root mean square distance of the paths from the part behind it [mm]")
    before_mm: Rounded = Field(description="the same before it [mm]")


class MeasuredRecord(Record):
    """A file of toolpaths."""

    file: str = Field(description="name of the file")
    format: str = Field(description="format that was recognized")
    deposit: str = Field(description="how deposit was distinguished from travel")
    points: Count = Field(description="number of points read, with those of travel")
    runs: Count = Field(description="number of measured runs")
    dropped_runs: Count = Field(description="number of runs of a single point, left out")
    reading: Reading = Field(description="what its reader used, skipped and assumed")
    length_mm: Rounded = Field(description="length of the deposited paths on the part [mm]")
    off_mean_mm: Rounded = Field(description="mean distance of the paths' points from the part [mm]")
    off_max_mm: Rounded = Field(description="largest distance of the paths' points from the part [mm]")
    fit: MotionFitRecord | None = Field(description="null where the paths were taken as they are")
    uniformity: EvennessRecord = Field(description="as in plan.json")


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
    """The content of timings.json beside measure.json."""

    files: tuple[MeasureSecondsRecord, ...] = Field(description="files in the order of the command")
