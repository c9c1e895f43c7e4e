"""What plan.json says of overhang: where the surface's outward normal is too far from upright for the material."""

from __future__ import annotations

from pydantic import Field

from geoprint.account.records.rounding import Count, Place, Record, Rounded


class OverhangPlaceRecord(Record):
    """A place where a bead overhangs."""

    run: Count = Field(description="that it lies on")
    place_mm: Place = Field(description="on the surface [mm]")
    angle_deg: Rounded = Field(description="of the outward normal from upright [degrees]")


class OverhangRecord(Record):
    """What of the deposit overhangs, as the part stands."""

    critical_deg: Rounded = Field(
        description="of the outward normal from upright, beyond which a bead may sag [degrees]"
    )
    share: Rounded = Field(description="of the deposited length that overhangs")
    length_mm: Rounded = Field(description="deposited length that overhangs [mm]")
    largest_deg: Rounded = Field(description="angle of all that is deposited [degrees]")
    worst_places: tuple[OverhangPlaceRecord, ...] = Field(description="at most five, the worst first, a stretch each")
