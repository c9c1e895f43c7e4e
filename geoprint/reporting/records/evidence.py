"""How far a program has been proven: by geoprint itself, in plan.json, and by who saw it run, in evidence.json."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from pydantic import Field

from geoprint.model import Count
from geoprint.postprocessor import Executed
from geoprint.reporting.records.rounding import Record

# What people see a program do, each stage nearer to a print than the one before.
Stage: TypeAlias = Literal["loaded", "dry", "printed"]
STAGES: tuple[Stage, ...] = get_args(Stage)
EVIDENCE_SCHEMA = 1

_SHA256 = "^[0-9a-f]{64}$"


class ParsedRecord(Record):
    """The program read back by code that shares nothing with what wrote it."""

    modules: Count = Field(description="number of files of the program")
    lines: Count = Field(description="number of lines of all files of the program")
    targets: Count = Field(description="number of targets read back and compared with the plan")


class EvidenceRecord(Record):
    """What geoprint itself has proven of a program; it claims no more than that it was executed here."""

    program_sha256: str = Field(
        description="SHA-256 of the program's modules in lower case, with their switches as written", pattern=_SHA256
    )
    parsed: ParsedRecord = Field(description="counts of the program as it was read back")
    executed: Executed | None = Field(
        default=None, description="figures of the program's execution; left out where it was not executed"
    )


class SeenRecord(Record):
    """What a person saw a program do."""

    stage: Stage = Field(
        description="stage that was seen: loaded on a virtual controller, run dry on the robot, or printed"
    )
    date: str = Field(description="date and time in ISO 8601, with the offset of the clock")
    controller: str | None = Field(default=None, description="name of the controller and its RobotWare release")
    note: str = Field(description="note in the words of the person who saw it", min_length=1)
    program_sha256: str = Field(description="SHA-256 of the program that was seen", pattern=_SHA256)


class SeenFile(Record):
    """The content of evidence.json, which no manifest lists and no overwriting loses."""

    layout: Literal[1] = Field(alias="schema", description="version of this layout")
    seen: tuple[SeenRecord, ...] = Field(description="records in the order in which they were made")
