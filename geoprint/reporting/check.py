"""A bundle that was read back and checked, and what was found wrong with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import final

from geoprint.model import Clearance, comparable, frozen
from geoprint.postprocessor import Json, Orders, Setup
from geoprint.postprocessor.rapid import Executed, Settings, StackSettings, Timeline
from geoprint.postprocessor.rapid.stack_running import StackProof
from geoprint.reporting.records.evenness import EvennessRecord
from geoprint.reporting.records.evidence import SeenRecord
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.stack import StackRecord


@final
@comparable
class Finding:
    """Something that is wrong: in which file and line (from 1), and why."""

    file: str
    line: int
    reason: str


@final
@frozen
class Repeated:
    """What was computed once more from the bundle's own part, body, cell and targets.

    Attributes:
        printing: clearance of the print, or None without a program or where it is not clear.
        dry: clearance of the dry run, or None likewise.
        uniformity: how even the paths are, or None where that cannot be measured.
        seconds: that it took [s].
        memory: most that the process has taken so far [MB].
    """

    printing: Clearance | None
    dry: Clearance | None
    uniformity: EvennessRecord | None
    seconds: float
    memory: int


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
    repeated: Repeated | None = None
    seen: tuple[SeenRecord, ...] = ()
    attitudes: tuple[Checked, ...] = ()
    joined: CheckedParts | None = None
    not_derived: tuple[str, ...] = ()


@final
@frozen
class CheckedStack:
    """A stack that was checked.

    Attributes:
        record: the content of stack.json, or None where it cannot be read.
        program: of all its layers.
        seen: what people saw it do.
    """

    record: StackRecord | None
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
