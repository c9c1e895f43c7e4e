"""`[table]` of a cell file: the hexapod and the tilt-turn table as they are written, and what they are in mm and rad.

The hexapod's defaults are after a PI H-840 [PIH840], taken to travel 50 mm in x and y, 25 mm in z, 15 degrees of tilt
and 30 of twist to either side, each with all others at rest. These ranges are UNCHECKED: nobody has held them against
the maker's sheet, so that a table of that name is measured before it is trusted. Everything else is CHOSEN: joints,
lengths and cones so that these ranges come out within 2 % with the pivot in the plate, as
`benchmarks/motion/tables.py` prints; diameters, heights and speed for a hexapod of that size. Another one with the same
ranges holds other poses between them.

The tilt-turn table is built as ABB's positioners of type A: tilting carries turning. All its figures are ASSUMED, for a
table as large as an IRB 120 reaches around; state those of your own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from geoprint.config.strict import Table, Triple
from geoprint.model import FloatArray, Hexapod, TiltTurn

# Legs are hinged in three pairs, so that the two joints of a pair may be up to 120 degrees apart; at 60 all six stand
# evenly around, where plate and base are alike and the legs hold nothing.
Spread = Annotated[float, Field(gt=0.0, lt=60.0)]
Cone = Annotated[float, Field(gt=0.0, lt=90.0)]
Lengths = Annotated[list[PositiveFloat], Field(min_length=2, max_length=2)]
Range = Annotated[list[Annotated[float, Field(ge=-360.0, le=360.0)]], Field(min_length=2, max_length=2)]
# A few beads wide: CHOSEN.
OVERLAP_MM = 3.0
# Pairs stand 120 degrees apart, those of the plate between those of the base.
_PAIRS_DEG = np.array([0.0, 120.0, 240.0])
_FIRST_BASE_PAIR_DEG, _FIRST_PLATE_PAIR_DEG = 270.0, 330.0


class HexapodTable(Table):
    """A hexapod."""

    kind: Literal["hexapod"]
    position_mm: Triple
    rpy_deg: Triple = Field(default=[0.0, 0.0, 0.0])
    pivot_mm: float = 0.0
    base_joint_radius_mm: PositiveFloat = 110.0
    base_joint_spread_deg: Spread = 21.3
    plate_joint_radius_mm: PositiveFloat = 98.0
    plate_joint_spread_deg: Spread = 30.9
    plate_joint_depth_mm: PositiveFloat = 20.0
    joint_height_mm: PositiveFloat = 188.9
    leg_mm: Lengths = Field(default=[175.2, 222.8])
    base_cone_deg: Cone = 14.7
    plate_cone_deg: Cone = 31.0
    leg_diameter_mm: PositiveFloat = 30.0
    leg_speed_mm_s: PositiveFloat = 57.0
    plate_diameter_mm: PositiveFloat = 250.0
    plate_thickness_mm: PositiveFloat = 15.0
    base_diameter_mm: PositiveFloat = 348.0
    base_height_mm: PositiveFloat = 119.1
    overlap_mm: NonNegativeFloat = OVERLAP_MM

    def noun(self, pose: Callable[[list[float], list[float]], FloatArray]) -> Hexapod:
        """Return the hexapod in mm and rad.

        Args:
            pose: makes a transform of a position [mm] and of roll, pitch, yaw [degrees].
        """
        # From the right joint of a base pair up to the left one of the plate's next pair, and so on around.
        base = _ring(self.base_joint_radius_mm, self.base_joint_spread_deg, first_deg=_FIRST_BASE_PAIR_DEG)
        plate = _ring(self.plate_joint_radius_mm, self.plate_joint_spread_deg, first_deg=_FIRST_PLATE_PAIR_DEG)
        depth = self.plate_joint_depth_mm
        return Hexapod(
            name="hexapod",
            T_base_table=pose(self.position_mm, self.rpy_deg),
            base_joints=np.roll(base, -1, axis=0) - [0.0, 0.0, depth + self.joint_height_mm],
            plate_joints=plate - [0.0, 0.0, depth],
            lengths=np.array(self.leg_mm),
            base_cone=float(np.radians(self.base_cone_deg)),
            plate_cone=float(np.radians(self.plate_cone_deg)),
            leg_diameter=self.leg_diameter_mm,
            leg_speed=self.leg_speed_mm_s,
            pivot=self.pivot_mm,
            plate_diameter=self.plate_diameter_mm,
            plate_thickness=self.plate_thickness_mm,
            base_diameter=self.base_diameter_mm,
            base_height=self.base_height_mm,
            overlap=self.overlap_mm,
        )


class TiltTurnTable(Table):
    """A tilt-turn table."""

    kind: Literal["tilt-turn"]
    position_mm: Triple
    rpy_deg: Triple = Field(default=[0.0, 0.0, 0.0])
    tilt_deg: Range = Field(default=[-90.0, 90.0])
    turn_deg: Range = Field(default=[-180.0, 180.0])
    tilt_speed_deg_s: PositiveFloat = 90.0
    turn_speed_deg_s: PositiveFloat = 90.0
    axis_depth_mm: float = 60.0
    plate_diameter_mm: PositiveFloat = 200.0
    plate_thickness_mm: PositiveFloat = 20.0
    hub_diameter_mm: PositiveFloat = 120.0
    hub_length_mm: PositiveFloat = 100.0
    stand_distance_mm: PositiveFloat = 220.0
    stand_diameter_mm: PositiveFloat = 80.0
    stand_height_mm: PositiveFloat = 250.0
    overlap_mm: NonNegativeFloat = OVERLAP_MM
    control: Literal["hand-shake", "external axes"] = "hand-shake"
    mechanical_unit: str | None = None

    @model_validator(mode="after")
    def _names_what_drives_it(self) -> Self:
        driven = self.control == "external axes"
        if driven and self.mechanical_unit is None:
            raise ValueError('control is "external axes": name the mechanical_unit that the controller knows them by')
        if not driven and self.mechanical_unit is not None:
            raise ValueError('mechanical_unit is named, which only control = "external axes" moves: state that too')
        return self

    @model_validator(mode="after")
    def _rests_within_its_ranges(self) -> Self:
        for key in ("tilt_deg", "turn_deg"):
            low, high = getattr(self, key)
            if not low < 0.0 < high:
                raise ValueError(f"{key} is [{low:g}, {high:g}]: it must begin below 0, where the table rests")
        lowest = self.plate_thickness_mm + self.stand_diameter_mm / 2
        if self.axis_depth_mm < lowest:
            raise ValueError(
                f"axis_depth_mm is {self.axis_depth_mm:g}, so that the beam of {self.stand_diameter_mm:g} mm about the "
                f"tilting axis passes through the plate: it must be at least {lowest:g}"
            )
        if self.stand_distance_mm <= (self.plate_diameter_mm + self.stand_diameter_mm) / 2:
            raise ValueError(
                f"stand_distance_mm is {self.stand_distance_mm:g}, so that the turning plate of "
                f"{self.plate_diameter_mm:g} mm meets the post of {self.stand_diameter_mm:g} mm"
            )
        return self

    def noun(self, pose: Callable[[list[float], list[float]], FloatArray]) -> TiltTurn:
        """Return the tilt-turn table in mm and rad.

        Args:
            pose: makes a transform of a position [mm] and of roll, pitch, yaw [degrees].
        """
        return TiltTurn(
            name="tilt-turn table",
            T_base_table=pose(self.position_mm, self.rpy_deg),
            ranges=np.radians([self.tilt_deg, self.turn_deg]),
            speeds=np.radians([self.tilt_speed_deg_s, self.turn_speed_deg_s]),
            axis_depth=self.axis_depth_mm,
            plate_diameter=self.plate_diameter_mm,
            plate_thickness=self.plate_thickness_mm,
            hub_diameter=self.hub_diameter_mm,
            hub_length=self.hub_length_mm,
            stand_distance=self.stand_distance_mm,
            stand_diameter=self.stand_diameter_mm,
            stand_height=self.stand_height_mm,
            overlap=self.overlap_mm,
            unit=self.mechanical_unit,
        )


def _ring(radius: float, spread_deg: float, *, first_deg: float) -> FloatArray:
    """Return (6, 3) joints in three pairs on a circle, counter-clockwise, the first pair about an angle."""
    angles = np.radians(first_deg + np.add.outer(_PAIRS_DEG, [-spread_deg / 2, spread_deg / 2]).ravel())
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros(len(angles))])
