"""The schema of compare.json: what is said of each part, and of each backend that was asked to plan it.

Units and counting are those of plan.json.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, final

from pydantic import Field

from geoprint.account.records.evenness import EvennessRecord
from geoprint.account.records.overhang import OverhangRecord
from geoprint.account.records.plan import (
    DepositionRecord,
    InputRecord,
    PatchRecord,
    PathsRecord,
    PlanRecord,
    SettingsRecord,
    SurfaceRecord,
)
from geoprint.account.records.printed import PrintedApartRecord
from geoprint.account.records.rounding import Record, Rounded
from geoprint.account.records.tried import MiddleRecord
from geoprint.model import frozen


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
class ToldComparison:
    """All figures of a comparison, each made once.

    Attributes:
        record: the content of compare.json.
        plans: for each part the content of plan.json by backend; empty for a part that failed.
        seconds: for each part what each backend's own stages took, by its name [s].
    """

    record: ComparisonRecord
    plans: tuple[Mapping[str, PlanRecord], ...]
    seconds: tuple[Mapping[str, float], ...]
