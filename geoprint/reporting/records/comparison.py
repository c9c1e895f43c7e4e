"""The schemas of compare.json, measure.json and of what `geoprint check --json` prints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, final

from pydantic import Field

from geoprint.model import frozen
from geoprint.reporting.records.evenness import EvennessRecord, OverhangRecord, PrintedApartRecord
from geoprint.reporting.records.evidence import EvidenceRecord, SeenRecord
from geoprint.reporting.records.plan import (
    DepositionRecord,
    FeatureRecord,
    FileRecord,
    InputRecord,
    MiddleRecord,
    PatchRecord,
    PathsRecord,
    PlanRecord,
    SettingsRecord,
    SurfaceRecord,
    SwitchingRecord,
)
from geoprint.reporting.records.rounding import Count, Place, ReadingRecord, Record, Rounded, Thousandths

# The schema of compare.json: what is said of each part, and of each backend that was asked to plan it.
#
# Units and counting are those of plan.json.


class PlannedRecord(Record):
    """A backend that planned the part."""

    backend: str = Field(description="its name")
    spacing_mm: float = Field(description="wanted distance between neighbouring paths [mm]")
    uniformity: EvennessRecord = Field(description="as in plan.json")
    paths: PathsRecord = Field(description="as in plan.json")
    deposition: DepositionRecord | None = Field(description="as in plan.json")
    overhang: OverhangRecord | None = Field(default=None, description="as in plan.json")
    patches: tuple[PatchRecord, ...] = Field(description="as in plan.json")
    middles: tuple[MiddleRecord, ...] = Field(default=(), description="as in plan.json")
    features: tuple[FeatureRecord, ...] = Field(default=(), description="as in plan.json")
    printable: bool | None = Field(description="null where that was not asked")
    not_printable: str | None = Field(description="why the robot cannot print it")
    not_reached: dict[str, Rounded] = Field(description="share of the deposit that the arm cannot reach, by reason")
    print_time_s: float | None = Field(description="[s]")
    smallest_clearance_mm: Rounded | None = Field(description="of the tool [mm]")
    warnings: tuple[str, ...] = Field(description="as in plan.json")


class RefusedRecord(Record):
    """A backend that cannot plan the part."""

    backend: str = Field(description="its name")
    refused: str = Field(description="why")


class PathDistancesRecord(Record):
    """How far the paths of the backends lie apart: matrices in the order of their names."""

    backends: tuple[str, ...] = Field(description="their names")
    hausdorff: tuple[tuple[Rounded, ...], ...] = Field(description="largest, in either direction [mm]")
    mean: tuple[tuple[Rounded, ...], ...] = Field(description="[mm]")


class PartRecord(Record):
    """A part that was compared."""

    part: str = Field(description="name of its file")
    input: InputRecord = Field(description="as in plan.json")
    settings: SettingsRecord = Field(description="as in plan.json, without the backend")
    surface: SurfaceRecord = Field(description="as in plan.json")
    verdict: tuple[str, ...] = Field(description="sentences; the first one decides")
    best: str = Field(description="the backend that covers the part best: coverage counts first, then thickness")
    backends: tuple[PlannedRecord | RefusedRecord, ...] = Field(description="in the order of the command")
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

    part: str = Field(description="name of its file")
    failed: str = Field(description="why")


class ComparisonRecord(Record):
    """The content of compare.json."""

    layout: Literal[9] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="of geoprint")
    parts: tuple[PartRecord | FailedRecord, ...] = Field(description="in the order of the command")


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

    file: str = Field(description="its name")
    format: str = Field(description="that it was read as")
    deposit: str = Field(description="how deposit was told from travel")
    points: Count = Field(description="that were read, those of travel too")
    runs: Count = Field(description="that were measured")
    dropped_runs: Count = Field(description="of a single point, left out")
    reading: ReadingRecord = Field(description="what its reader used, skipped and assumed")
    length_mm: Rounded = Field(description="of the deposited paths on the part [mm]")
    off_mean_mm: Rounded = Field(description="mean distance of the paths' points from the part [mm]")
    off_max_mm: Rounded = Field(description="largest [mm]")
    fit: MotionFitRecord | None = Field(description="null where the paths were taken as they are")
    uniformity: EvennessRecord = Field(description="as in plan.json")


class MeasurementRecord(Record):
    """The content of measure.json."""

    layout: Literal[4] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="of geoprint")
    part: FileRecord = Field(description="that the paths cover")
    area_mm2: Rounded = Field(description="of the part [mm2]")
    spacing_mm: float = Field(description="wanted distance between neighbouring paths [mm]")
    files: tuple[MeasuredRecord, ...] = Field(description="in the order of the command")


class MeasureSecondsRecord(Record):
    """What measuring one file took."""

    file: str = Field(description="its name")
    processor_s: Thousandths = Field(description="of all threads [s]")
    processor_s_per_m: Thousandths = Field(description="per metre of path [s]")


class MeasureTimingsRecord(Record):
    """The content of timings.json beside measure.json."""

    files: tuple[MeasureSecondsRecord, ...] = Field(description="in the order of the command")


# The schema of what `geoprint check --json` prints: of a bundle, or of a comparison with each bundle in it.


@final
class FindingRecord(Record):
    """Something that is wrong."""

    file: str = Field(description="of the bundle")
    line: int = Field(description="from 1")
    reason: str = Field(description="one sentence")


@final
class SettingsNow(Record):
    """How the program is set to run."""

    dry_run: bool = Field(description="whether it runs dry")
    speed_pct: float = Field(description="of the planned speed [%]")
    first_run: int = Field(description="from which on it prints, from 1")


@final
class StackSettingsNow(Record):
    """How the program of a stack is set to run."""

    dry_run: bool = Field(description="whether it runs dry")
    speed_pct: float = Field(description="of the planned speed [%]")
    first_layer: int = Field(description="from which on it prints, from 1")
    first_run: int = Field(description="of that layer, from which on it prints, from 1")
    last_layer: int = Field(description="behind which it ends")


@final
class AttitudeSettingsNow(Record):
    """How the program of several attitudes of a table is set to run."""

    dry_run: bool = Field(description="whether it runs dry")
    speed_pct: float = Field(description="of the planned speed [%]")
    first_attitude: int = Field(description="from which on it prints, from 1")
    first_run: int = Field(description="of that attitude, from which on it prints, from 1")
    last_attitude: int = Field(description="behind which it ends")


@final
class RepeatedRecord(Record):
    """What was computed once more, with `--full`."""

    smallest_mm: Rounded | None = Field(description="clearance of the tool [mm]; null without a program")
    arm_smallest_mm: Rounded | None = Field(description="clearance of the arm [mm]")
    tip_margin_mm: Rounded | None = Field(description="as in plan.json [mm]")
    dry_run_smallest_mm: Rounded | None = Field(description="clearance of the dry run [mm]")
    uniformity: EvennessRecord | None = Field(description="as in plan.json; null where it could not be measured")
    seconds: Thousandths = Field(description="that it took [s]")
    peak_memory_mb: Count = Field(description="of the whole process so far [MB]")


@final
class CheckRecord(Record):
    """The result object of `geoprint check` for a bundle."""

    bundle: str = Field(description="name of the folder")
    agrees: bool = Field(description="whether it is as it was planned")
    program: bool = Field(description="whether it holds a program for the robot")
    findings: tuple[FindingRecord, ...] = Field(description="what is wrong")
    set_to: SettingsNow | None = Field(default=None, description="left out where the program is not the plan's")
    switching: SwitchingRecord | None = Field(default=None, description="as in plan.json; left out likewise")
    extent_base_mm: tuple[tuple[float, ...], ...] | None = Field(
        default=None, description="lowest and highest x, y, z of the tip, in base coordinates [mm]"
    )
    repeated: RepeatedRecord | None = Field(default=None, description="left out without `--full`")
    not_derived: tuple[str, ...] = Field(
        default=(), description="files that nothing is held against: pictures but for their hash, and timings.json"
    )
    evidence: EvidenceRecord | None = Field(default=None, description="as in plan.json; left out without a program")
    seen: tuple[SeenRecord, ...] = Field(default=(), description="by people, of this program or another one")
    attitudes: tuple[CheckRecord, ...] = Field(
        default=(), description="of a table, each by itself in its folder; empty where there is one or none"
    )
    attitudes_set_to: AttitudeSettingsNow | None = Field(
        default=None, description="left out where the program of all attitudes is not theirs"
    )
    executed: tuple[str, ...] = Field(
        default=(), description="how the program of all attitudes was run in this check, each as by itself"
    )


@final
class CheckedComparisonRecord(Record):
    """The result object of `geoprint check` for a comparison, or for a stack with its layers."""

    comparison: str = Field(description="name of the folder")
    agrees: bool = Field(description="whether all of it is as it was planned")
    findings: tuple[FindingRecord, ...] = Field(description="what is wrong with what stands beside the bundles")
    bundles: tuple[CheckRecord, ...] = Field(
        description="part by part, in the order of the verdict; or from the lowest layer up"
    )
    set_to: StackSettingsNow | None = Field(
        default=None, description="of a stack; left out over a table, and where its program is not that of its layers"
    )
    attitudes_set_to: AttitudeSettingsNow | None = Field(
        default=None, description="of a stack over a table, whose program counts attitudes through; left out likewise"
    )
    executed: tuple[str, ...] = Field(
        default=(), description="of a stack: how its program was run in this check, each layer as by itself"
    )
    program_sha256: str | None = Field(
        default=None, description="of a stack's program; left out where it was not read back"
    )
    seen: tuple[SeenRecord, ...] = Field(default=(), description="by people, of the stack's program or another one")
    stacks: tuple[CheckedComparisonRecord, ...] = Field(
        default=(), description="each of several stacks that were compared; then there are no bundles"
    )
