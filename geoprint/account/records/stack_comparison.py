"""The schema of stacks.json: whole stacks of layers that several backends planned.

Units and counting are those of stack.json.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.account.records.rounding import Record, Rounded
from geoprint.account.records.stack import FinishedRecord


class ComparedStackRecord(Record):
    """A backend that planned every layer."""

    backend: str = Field(description="its name, and that of the folder of its stack")
    gap: Rounded = Field(description="share of the area of all layers that no path covers")
    overlap: Rounded = Field(description="share of it that is covered twice")
    thickness_cv: Rounded = Field(description="variation of the layers' own thickness, of all by area")
    worst_cv: Rounded = Field(description="that of the layer where it is largest")
    finished: FinishedRecord | None = Field(description="how all layers together come out, as printed")
    runs: int = Field(description="of all layers", ge=0)
    deposit_mm: Rounded = Field(description="length of the tip's path on deposit [mm]")
    print_s: Rounded | None = Field(description="time of all programs [s]; null without a robot")
    clearance_mm: Rounded | None = Field(description="smallest distance of the tool [mm]; null without a robot")
    printable: bool | None = Field(description="null where that was not asked")
    not_printable: str | None = Field(description="why the robot cannot print a layer")
    warnings: tuple[str, ...] = Field(description="what to act on, with the layer that it is said of")
    not_checked: tuple[str, ...] = Field(description="what nobody looked at")


class RefusedStackRecord(Record):
    """A backend that cannot plan a layer."""

    backend: str = Field(description="its name")
    refused: str = Field(description="why")


class StackComparisonRecord(Record):
    """The content of stacks.json."""

    layout: Literal[2] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="of geoprint")
    part: str = Field(description="file that the lowest layer lies on")
    thickness_mm: Rounded = Field(description="of all layers together, where it is largest [mm]")
    layers: int = Field(description="in which it falls", ge=1)
    verdict: tuple[str, ...] = Field(description="sentences; the first one decides")
    best: str = Field(description="the backend that covers the layers best: coverage counts first, then spacing")
    backends: tuple[ComparedStackRecord | RefusedStackRecord, ...] = Field(description="in the order of the command")
