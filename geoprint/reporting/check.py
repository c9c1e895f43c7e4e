"""A bundle that was read back and checked, and what was found wrong with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import final

from pydantic import Field

from geoprint.model import Count, Rounded, Thousandths, frozen, recorded
from geoprint.postprocessor import Executed, Json, Orders, Settings, Setup, StackProof, StackSettings, Timeline
from geoprint.reporting.records.evenness import EvennessRecord
from geoprint.reporting.records.evidence import EvidenceRecord, SeenRecord
from geoprint.reporting.records.plan import PlanRecord, SwitchingRecord
from geoprint.reporting.records.rounding import Record


@final
@recorded("FindingRecord")
class Finding:
    """Something that is wrong.

    Attributes:
        file: name of the file in the bundle.
        line: number of the line in the file, from 1.
        reason: one sentence on what is wrong.
    """

    file: str
    line: int
    reason: str


@final
class RepeatedRecord(Record):
    """What was computed once more, with `--full`."""

    smallest_mm: Rounded | None = Field(description="smallest clearance of the tool [mm]; null without a program")
    arm_smallest_mm: Rounded | None = Field(description="smallest clearance of the arm [mm]")
    tip_margin_mm: Rounded | None = Field(description="clearance of the tip on travel and of its rim on deposit [mm]")
    dry_run_smallest_mm: Rounded | None = Field(description="smallest clearance in the dry run [mm]")
    uniformity: EvennessRecord | None = Field(
        description="evenness of the paths over the surface; null where it could not be measured"
    )
    seconds: Thousandths = Field(description="time that the check took [s]")
    peak_memory_mb: Count = Field(description="peak memory of the whole process so far [MB]")


@final
@frozen
class CheckedParts:
    """A program of several parts that was checked: of the layers of a stack, of the attitudes of a table, or of both.

    Attributes:
        settings: how it is set to run, or None where it is not that of its parts, or there is none.
        proof: what was executed of it, or None where it does not run.
        program_sha256: of its modules with their switches as written; empty where it was not read back.
    """

    settings: StackSettings | None = None
    proof: StackProof | None = None
    program_sha256: str = ""

    @property
    def scenarios(self) -> tuple[str, ...]:
        """In which it was executed; none where it does not run."""
        return () if self.proof is None else self.proof.scenarios

    @property
    def refused(self) -> tuple[str, ...]:
        """Scenarios in which it ended before anything moved; none where it does not run."""
        return () if self.proof is None else self.proof.refused

    def proven(self) -> dict[str, Json]:
        """Return what a record says of its execution; nothing where it does not run."""
        if self.proof is None:
            return {}
        return {
            "scenarios": [*self.proof.scenarios],
            "refused": [*self.proof.refused],
            "lines_with_statements": self.proof.statements,
            "lines_executed": self.proof.executed,
        }


@final
@frozen
class Checked:
    """A bundle that was checked.

    Attributes:
        folder: where it stands.
        findings: what is wrong; empty where it is as it was planned.
        record: the content of plan.json, or None where it cannot be read.
        setup: the cell, or None where it cannot be read.
        orders: the targets, or None where they cannot be read.
        settings: how the program is set to run, or None where the program is not the plan's.
        switching: what flows when, or None where the program is not the plan's.
        executed: what of the program was executed, or None where it does not run.
        program: whether there is a program at all.
        program_sha256: of its modules with their switches as written; empty without a program.
        repeated: what was computed once more, or None where nobody asked.
        seen: what people saw a program of this bundle do.
        attitudes: what holds of each of several attitudes of a table; then setup is that of the first, and there are
            neither orders nor settings, switching and executed of a single program.
        joined: the program of all attitudes, or None where there is one or none.
        not_derived: files that nothing was held against: pictures but for their hash, and timings.json.
    """

    folder: Path
    findings: tuple[Finding, ...]
    record: PlanRecord | None
    setup: Setup | None = None
    orders: Orders | None = None
    settings: Settings | None = None
    switching: Timeline | None = None
    executed: Executed | None = None
    program: bool = True
    program_sha256: str = ""
    repeated: RepeatedRecord | None = None
    seen: tuple[SeenRecord, ...] = ()
    attitudes: tuple[Checked, ...] = ()
    joined: CheckedParts | None = None
    not_derived: tuple[str, ...] = ()


@final
@frozen
class CheckedStack:
    """Bundles that one program prints in turn, checked as one.

    Attributes:
        record: what is said of all of them in the file beside them, or None where it cannot be read.
        listed: what each is, and in which order they are listed.
        title: what is printed.
        sheet: label and texts of what the run sheet says of their program; none where there is no such program.
        one: what the program calls each: 'layer', or 'attitude' of a table.
        program: of all of them, as it was checked.
        seen: what people saw it do.
    """

    record: Record | None
    listed: tuple[str, str]
    title: str = ""
    sheet: tuple[tuple[str, tuple[str, ...]], ...] = ()
    one: str = "layer"
    program: CheckedParts = CheckedParts()
    seen: tuple[SeenRecord, ...] = ()


@final
@frozen
class CheckedComparison:
    """A comparison whose bundles were checked, or a stack with those of its layers.

    Attributes:
        folder: where it stands.
        own: what is wrong with the files beside the bundles.
        bundles: part by part, in the order of the verdict, or from the lowest layer up, each by its folder there.
        stack: what holds of them together where they are layers, or None.
        stacks: each of several stacks that were compared, by its folder there; then there are no bundles.
    """

    folder: Path
    own: tuple[Finding, ...]
    bundles: tuple[tuple[str, Checked], ...]
    stack: CheckedStack | None = None
    stacks: tuple[tuple[str, CheckedComparison], ...] = ()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """All that is wrong, files named from the comparison's folder."""
        inner = [
            Finding(f"{name}/{one.file}", one.line, one.reason)
            for name, checked in (*self.bundles, *self.stacks)
            for one in checked.findings
        ]
        return (*self.own, *inner)


def also_seen(checked: Checked | CheckedComparison, seen: SeenRecord) -> Checked | CheckedComparison:
    """Return what was checked with one more thing that a person saw its program do; a comparison has no program."""
    if isinstance(checked, Checked):
        return replace(checked, seen=(*checked.seen, seen))
    stack = checked.stack
    return checked if stack is None else replace(checked, stack=replace(stack, seen=(*stack.seen, seen)))


# The schema of what `geoprint check --json` prints: of a bundle, or of a comparison with each bundle in it.


@final
class AttitudeSettingsNow(Record):
    """How the program of several attitudes of a table is set to run."""

    dry_run: bool = Field(description="whether the program runs dry")
    speed_pct: float = Field(description="speed of the program over the planned one [%]")
    first_attitude: int = Field(description="number of the attitude from which on the program prints, from 1")
    first_run: int = Field(
        description="number of the run of the first attitude from which on the program prints, from 1"
    )
    last_attitude: int = Field(description="number of the attitude after which the program ends")


@final
class CheckRecord(Record):
    """The result object of `geoprint check` for a bundle."""

    bundle: str = Field(description="name of the bundle's folder")
    agrees: bool = Field(description="whether the bundle is as it was planned")
    program: bool = Field(description="whether the bundle holds a program for the robot")
    findings: tuple[Finding, ...] = Field(description="differences from the plan, with file and line")
    set_to: Settings | None = Field(
        default=None, description="how the program is set; left out where the program is not the plan's"
    )
    switching: SwitchingRecord | None = Field(
        default=None, description="switching of valve, lamp and vacuum; left out where the program is not the plan's"
    )
    extent_base_mm: tuple[tuple[float, ...], ...] | None = Field(
        default=None, description="lowest and highest x, y, z of the tip, in base coordinates [mm]"
    )
    repeated: RepeatedRecord | None = Field(
        default=None, description="figures computed once more; left out without `--full`"
    )
    not_derived: tuple[str, ...] = Field(
        default=(),
        description=("names of the files that nothing is compared with: pictures but for their hash, and timings.json"),
    )
    evidence: EvidenceRecord | None = Field(
        default=None, description="how far geoprint itself has proven the program; left out without a program"
    )
    seen: tuple[SeenRecord, ...] = Field(
        default=(), description="records of what people saw this program do, or another one"
    )
    attitudes: tuple[CheckRecord, ...] = Field(
        default=(),
        description=(
            "checks of the attitudes of a table, each by itself in its folder; empty where there is one or none"
        ),
    )
    attitudes_set_to: AttitudeSettingsNow | None = Field(
        default=None,
        description="how the program of all attitudes is set; left out where it is not that of the attitudes",
    )
    executed: tuple[str, ...] = Field(
        default=(), description="how the program of all attitudes was run in this check, each as by itself"
    )


@final
class CheckedComparisonRecord(Record):
    """The result object of `geoprint check` for a comparison, or for a stack with its layers."""

    comparison: str = Field(description="name of the comparison's or the stack's folder")
    agrees: bool = Field(description="whether the whole folder is as it was planned")
    findings: tuple[Finding, ...] = Field(description="findings in the files outside the bundles")
    bundles: tuple[CheckRecord, ...] = Field(
        description="checks of the bundles, part by part, in the order of the verdict; or from the lowest layer up"
    )
    set_to: StackSettings | None = Field(
        default=None,
        description=(
            "how the program of a stack is set; left out over a table, and where it is not that of its layers"
        ),
    )
    attitudes_set_to: AttitudeSettingsNow | None = Field(
        default=None,
        description=(
            "how the program of a stack over a table is set, which counts attitudes through; left out where it is "
            "not that of its layers"
        ),
    )
    executed: tuple[str, ...] = Field(
        default=(), description="how the program of a stack was run in this check, each layer as by itself"
    )
    program_sha256: str | None = Field(
        default=None, description="SHA-256 of the program of a stack; left out where it was not read back"
    )
    seen: tuple[SeenRecord, ...] = Field(
        default=(), description="records of what people saw the stack's program do, or another one"
    )
    stacks: tuple[CheckedComparisonRecord, ...] = Field(
        default=(), description="checks of several stacks that were compared; then there are no bundles"
    )
