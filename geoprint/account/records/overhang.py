"""What plan.json says of overhang: where the surface's outward normal is too far from upright for the material."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.account.records.rounding import Count, Place, Record, Rounded


class OverhangPlaceRecord(Record):
    """A place where a bead overhangs."""

    run: Count = Field(description="that it lies on")
    place_mm: Place = Field(description="on the surface [mm]")
    angle_deg: Rounded = Field(description="of the outward normal from upright [degrees]")


class TableAttitudeRecord(Record):
    """One attitude of the table, and what is printed in it."""

    up: Place = Field(description="unit direction of the part that points up")
    axes: tuple[Rounded, ...] = Field(
        description="lengths of the six legs [mm], or angles of tilting and turning [degrees]"
    )
    slack: Rounded = Field(
        description="share left of the critical angle, or of the table's range where less of that is; 0 at a limit"
    )
    length_mm: Rounded = Field(description="deposited in it [mm]")
    pieces: Count = Field(description="of runs that are printed in it")
    move_s: Rounded = Field(
        description="that the table takes at least to come here, or where the program drives it, what that gives it [s]"
    )


class TableRecord(Record):
    """How a table is to tilt the part, so that as little as possible overhangs."""

    name: str = Field(description="of the table")
    rotary: bool = Field(description="whether its axes turn, so that their values are angles; else they are lengths")
    order: Literal["kept", "gathered"] = Field(
        description="whether runs are printed as they come, or pieces of them gathered by attitude"
    )
    moves_kept: Count = Field(description="attitudes that runs as they come need")
    moves_gathered: Count = Field(description="attitudes that pieces gathered by attitude need")
    length_mm: Rounded = Field(description="deposited length that still overhangs [mm]")
    missing_deg: Rounded = Field(description="largest angle beyond the critical one that is left [degrees]")
    attitudes: tuple[TableAttitudeRecord, ...] = Field(description="in the order of printing")
    refused: tuple[str, ...] = Field(
        default=(), description="attitudes that the robot refused, whose pieces are printed in another one, and why"
    )


class OverhangRecord(Record):
    """What of the deposit overhangs, as the part stands."""

    critical_deg: Rounded = Field(
        description="of the outward normal from upright, beyond which a bead may sag [degrees]"
    )
    assumed: bool = Field(
        default=False, description="whether that is the paper's example, because the cell's [material] states none"
    )
    share: Rounded = Field(description="of the deposited length that overhangs")
    length_mm: Rounded = Field(description="deposited length that overhangs [mm]")
    largest_deg: Rounded = Field(description="angle of all that is deposited [degrees]")
    worst_places: tuple[OverhangPlaceRecord, ...] = Field(description="at most five, the worst first, a stretch each")
    table: TableRecord | None = Field(default=None, description="that tilts the part, where the cell has one")

    @property
    def stated(self) -> bool:
        """Whether it is more than a detail: the material has an angle, or a table tilts the part by it."""
        return self.table is not None or not self.assumed
