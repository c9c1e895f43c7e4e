"""How far a program has been proven: by geoprint itself, in plan.json, and by who saw it run, in evidence.json."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from pydantic import Field

from geoprint.model import Count, Rounded
from geoprint.reporting.records.rounding import Record

# What people see a program do, each stage nearer to a print than the one before.
Stage: TypeAlias = Literal["loaded", "dry", "printed"]
STAGES: tuple[Stage, ...] = get_args(Stage)
EVIDENCE_SCHEMA = 1

_SHA256 = "^[0-9a-f]{64}$"


class ParsedRecord(Record):
    """The program read back by code that shares nothing with what wrote it."""

    modules: Count = Field(description="files of the program")
    lines: Count = Field(description="of all of them")
    targets: Count = Field(description="that were read back and compared with the plan")


class NotExecutedRecord(Record):
    """Lines of a module that nothing here executed, for one reason."""

    file: str = Field(description="of the program, or of what a controller keeps for it")
    lines: tuple[Count, ...] = Field(description="from 1")
    reason: str = Field(description="what alone leads there")


class ExecutedRecord(Record):
    """The program executed here, which is no controller."""

    scenarios: tuple[str, ...] = Field(description="how it was run; each did what it must")
    lines: Count = Field(description="that hold statements")
    lines_executed: Count = Field(description="of these, in at least one scenario")
    not_executed: tuple[NotExecutedRecord, ...] = Field(description="the others")
    largest_motion_mm: Rounded = Field(description="from where the plan has a target")
    largest_move_time_s: Rounded = Field(
        description="by which a move takes longer or shorter than planned, ramps left out"
    )
    largest_run_time_share: Rounded = Field(description="the same of the moves of a run, as a share of its time")
    largest_output_mm: Rounded = Field(description="along the path, from where the plan switches an output")
    not_known: tuple[str, ...] = Field(description="what no simulation knows")


class EvidenceRecord(Record):
    """What geoprint itself has proven of a program; it claims no more than that it was executed here."""

    program_sha256: str = Field(
        description="of its modules in lower case, with their switches as written", pattern=_SHA256
    )
    parsed: ParsedRecord = Field(description="read back")
    executed: ExecutedRecord | None = Field(default=None, description="left out where it was not executed")


class SeenRecord(Record):
    """What a person saw a program do."""

    stage: Stage = Field(description="loaded on a virtual controller, run dry on the robot, or printed")
    date: str = Field(description="ISO 8601, with the offset of the clock")
    controller: str | None = Field(default=None, description="its name and RobotWare release")
    note: str = Field(description="in that person's words", min_length=1)
    program_sha256: str = Field(description="of the program that it was", pattern=_SHA256)


class SeenFile(Record):
    """The content of evidence.json, which no manifest lists and no overwriting loses."""

    layout: Literal[1] = Field(alias="schema", description="version of this layout")
    seen: tuple[SeenRecord, ...] = Field(description="in the order in which it was recorded")
