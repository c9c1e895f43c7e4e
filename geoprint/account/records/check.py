"""The schema of what `geoprint check --json` prints: of a bundle, or of a comparison with each bundle in it."""

from __future__ import annotations

from typing import final

from pydantic import Field

from geoprint.account.records.evenness import EvennessRecord
from geoprint.account.records.evidence import EvidenceRecord, SeenRecord
from geoprint.account.records.robot import SwitchingRecord
from geoprint.account.records.rounding import Count, Record, Rounded, Thousandths


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
