"""The record of a part on several cells, as cells.json has it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.model import Rounded
from geoprint.reporting.records.plan import FileRecord
from geoprint.reporting.records.rounding import Record


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
