"""The tables of a cell file as they are written, and the cell that they become in mm, rad, s and Pa."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator
from scipy.spatial.transform import Rotation

from geoprint.config.strict import Rounds, Table, Triple
from geoprint.errors import how_many
from geoprint.model import (
    PASCAL_PER_KPA,
    Box,
    Cell,
    FloatArray,
    Flood,
    Fluid,
    GoodPrint,
    Hexapod,
    Lamp,
    LoadLimits,
    Material,
    OptionValue,
    PrintErrors,
    Process,
    Purge,
    Robot,
    SearchWeights,
    SignalMode,
    Signals,
    TiltTurn,
    Tool,
    TouchedPoints,
)
from geoprint.positioner import table_machine
from geoprint.robot.arm import CALIBRATED_ARMS, FLANGE_FRAME, calibrated_urdf, read_urdf_file
from geoprint.transforms import rigid

# `[table]` of a cell file: the hexapod and the tilt-turn table as they are written, and what they are in mm and rad.
#
# The hexapod's defaults are after a PI H-840 [PIH840], taken to travel 50 mm in x and y, 25 mm in z, 15 degrees of
# tilt and 30 of twist to either side, each with all others at rest. These ranges are UNCHECKED: nobody has held them
# against the maker's sheet, so that a table of that name is measured before it is trusted. Everything else is
# CHOSEN: joints, lengths and cones so that these ranges come out within 2 % with the pivot in the plate, as
# `benchmarks/motion/tables.py` prints; diameters, heights and speed for a hexapod of that size. Another one with the
# same ranges holds other poses between them.
#
# The tilt-turn table is built as ABB's positioners of type A: tilting carries turning. All its figures are ASSUMED,
# for a table as large as an IRB 120 reaches around; state those of your own.


# Legs are hinged in three pairs, so that the two joints of a pair may be up to 120 degrees apart; at 60 all six stand
# evenly around, where plate and base are alike and the legs hold nothing.
Spread = Annotated[float, Field(gt=0.0, lt=60.0)]
Cone = Annotated[float, Field(gt=0.0, lt=90.0)]
Lengths = Annotated[list[PositiveFloat], Field(min_length=2, max_length=2)]
AngleRange = Annotated[list[Annotated[float, Field(ge=-360.0, le=360.0)]], Field(min_length=2, max_length=2)]
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
    tilt_deg: AngleRange = Field(default=[-90.0, 90.0])
    turn_deg: AngleRange = Field(default=[-180.0, 180.0])
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
            raise ValueError('control = "external axes" needs mechanical_unit, its name on the controller')
        if not driven and self.mechanical_unit is not None:
            raise ValueError('mechanical_unit needs control = "external axes": state that too')
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
                f"axis_depth_mm is {self.axis_depth_mm:g}, and the beam of {self.stand_diameter_mm:g} mm about the "
                f"tilting axis passes through the plate: it must be at least {lowest:g}"
            )
        if self.stand_distance_mm <= (self.plate_diameter_mm + self.stand_diameter_mm) / 2:
            raise ValueError(
                f"stand_distance_mm is {self.stand_distance_mm:g}, and the turning plate of "
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


# The tables of a cell file as they are written: lengths in mm, angles in degrees.


SixJoints = Annotated[list[float], Field(min_length=6, max_length=6)]
SixPositive = Annotated[list[PositiveFloat], Field(min_length=6, max_length=6)]
LengthRange = Annotated[list[float], Field(min_length=2, max_length=2)]
SixRanges = Annotated[list[LengthRange], Field(min_length=6, max_length=6)]
# From slower than any bead to what is allowed beside a person [ISO 10218-1, 5.6.2].
TipSpeed = Annotated[float, Field(ge=0.1, le=250.0)]
# Flow over that of a strip one spacing wide: three spacings are more than any strip between two paths.
LeastFlow = Annotated[float, Field(gt=0.0, le=1.0)]
MostFlow = Annotated[float, Field(ge=1.0, le=3.0)]
SignalName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,31}$")]
# Equipment that follows later than this is not switched in step with a tip; nobody waits that long by design.
Lag = Annotated[float, Field(ge=0.0, le=2.0)]
# As long as the final exposure may last.
Exposure = Annotated[float, Field(ge=0.0, le=3600.0)]
# How a material flows: all of them together.
FLOW_KEYS = ("density_g_cm3", "consistency_pa_sn", "flow_index", "yield_stress_pa")
# Level ground carries every bead; where a wall does, too, no table has to tilt.
Overhang = Annotated[float, Field(gt=0.0, lt=90.0)]
# A layer that needs more than a day before the next one is a print of its own.
Pause = Annotated[float, Field(gt=0.0, le=86400.0)]


class RobotTable(Table):
    """The arm: a packaged one or a URDF of your own, and what it may do."""

    arm: Literal["irb120", "ur5e"] | None = None
    urdf: str | None = None
    flange: str = FLANGE_FRAME
    calibration: str | None = None
    limits_deg: SixRanges
    speeds_deg_s: SixPositive
    accelerations_deg_s2: SixPositive
    target_period_ms: Annotated[float, Field(ge=1.0, le=1000.0)] = 20.0
    response_ms: Annotated[float, Field(ge=0.0, le=50.0)] = 10.0
    payload_kg: PositiveFloat | None = None
    wrist_inertia_kg_m2: Annotated[list[PositiveFloat], Field(min_length=2, max_length=2)] | None = None
    post_processor: str | None = None

    @model_validator(mode="after")
    def _one_arm_with_its_load(self) -> Self:
        if (self.arm is None) == (self.urdf is None):
            raise ValueError("give either arm, one of geoprint, or urdf, your own file")
        if self.calibration is not None and (self.arm not in CALIBRATED_ARMS or self.flange != FLANGE_FRAME):
            known = ", ".join(CALIBRATED_ARMS)
            raise ValueError(f"calibration belongs to a packaged arm with its own flange: {known}")
        if (self.payload_kg is None) != (self.wrist_inertia_kg_m2 is None):
            raise ValueError("payload_kg and wrist_inertia_kg_m2 (about axes 5 and 6) belong together: give both")
        return self

    @property
    def load(self) -> LoadLimits | None:
        """What the flange may carry, or None where the file leaves that to the maker of a packaged arm."""
        if self.payload_kg is None or self.wrist_inertia_kg_m2 is None:
            return None
        return LoadLimits(self.payload_kg, *self.wrist_inertia_kg_m2)


class HomeTable(Table):
    """Where every program starts and ends."""

    joints_deg: SixJoints


class ToolTable(Table):
    """The tool frame and the load."""

    tcp_mm: Triple
    rpy_deg: Triple
    mass_kg: PositiveFloat
    cog_mm: Triple
    inertia_kg_m2: Annotated[list[PositiveFloat], Field(min_length=3, max_length=3)]
    inertia_rpy_deg: Triple = Field(default=[0.0, 0.0, 0.0])


class NozzleTable(Table):
    """Needle, cone and barrel."""

    inner_diameter_mm: PositiveFloat
    outer_diameter_mm: PositiveFloat
    needle_length_mm: PositiveFloat
    cone_half_angle_deg: Annotated[float, Field(gt=1.0, lt=89.0)]
    barrel_diameter_mm: PositiveFloat
    barrel_top_mm: PositiveFloat

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.inner_diameter_mm >= self.outer_diameter_mm:
            raise ValueError("inner_diameter_mm must be smaller than outer_diameter_mm")
        if self.barrel_diameter_mm <= self.outer_diameter_mm:
            raise ValueError("barrel_diameter_mm must be larger than outer_diameter_mm of the needle")
        widening = (self.barrel_diameter_mm - self.outer_diameter_mm) / 2 / np.tan(np.radians(self.cone_half_angle_deg))
        if self.needle_length_mm + widening >= self.barrel_top_mm:
            raise ValueError(
                f"needle and cone are {self.needle_length_mm + widening:.1f} mm long together, which leaves no barrel "
                f"below barrel_top_mm = {self.barrel_top_mm:g}"
            )
        return self


class BracketTable(Table):
    """What holds the syringe."""

    length_mm: PositiveFloat
    diameter_mm: PositiveFloat


class LampTable(Table):
    """The housing of the UV lamp."""

    position_mm: Triple
    rpy_deg: Triple
    length_mm: PositiveFloat
    diameter_mm: PositiveFloat


class WorkTable(Table):
    """Where the part stands."""

    source: Literal["demo", "calibrated"]
    demo_position_mm: Triple
    demo_rpy_deg: Triple | None = None
    model_mm: list[Triple] = Field(default=[])
    touched_mm: list[Triple] = Field(default=[])
    noise_mm: PositiveFloat | None = None
    part_mm: Triple | None = None
    part_rpy_deg: Triple | None = None

    @model_validator(mode="after")
    def _touched_when_calibrated(self) -> Self:
        if len(self.model_mm) != len(self.touched_mm):
            raise ValueError(
                f"model_mm lists {how_many(len(self.model_mm), 'point')} and touched_mm {len(self.touched_mm)}: "
                "they must be pairs"
            )
        if self.source == "calibrated" and not self.touched_mm:
            raise ValueError('source = "calibrated" needs the points that were touched: model_mm and touched_mm')
        if self.part_mm is None and self.part_rpy_deg is not None:
            raise ValueError("part_rpy_deg needs part_mm, the position of the part on its fixture")
        return self


class ProcessTable(Table):
    """How the material is deposited."""

    speed_mm_s: TipSpeed
    travel_speed_mm_s: TipSpeed
    joint_speed_share: Annotated[float, Field(gt=0.0, le=1.0)]
    standoff_mm: PositiveFloat
    clearance_mm: PositiveFloat
    retract_mm: PositiveFloat
    layer_height_mm: PositiveFloat
    pressure_kpa: PositiveFloat | None = None
    rounds: Rounds | None = None
    least_flow_share: LeastFlow | None = None
    most_flow_share: MostFlow | None = None
    layer_pause_s: Pause | None = None

    @model_validator(mode="after")
    def _lifts_clear(self) -> Self:
        needed = self.clearance_mm + self.layer_height_mm
        if self.retract_mm < needed:
            raise ValueError(
                f"retract_mm is {self.retract_mm:g}, but the tip must clear the deposit between runs: at least "
                f"clearance_mm + layer_height_mm = {needed:g} mm"
            )
        return self


class MaterialTable(Table):
    """What the syringe holds."""

    density_g_cm3: PositiveFloat | None = None
    consistency_pa_sn: PositiveFloat | None = None
    flow_index: PositiveFloat | None = None
    yield_stress_pa: NonNegativeFloat | None = None
    uv_irradiance_mw_cm2: PositiveFloat | None = None
    uv_spot_mm: PositiveFloat | None = None
    uv_dose_mj_cm2: PositiveFloat | None = None
    uv_penetration_mm: PositiveFloat | None = None
    overhang_deg: Overhang | None = None

    @model_validator(mode="after")
    def _says_how_it_flows(self) -> Self:
        missing = [name for name in FLOW_KEYS if getattr(self, name) is None]
        if missing and self.model_fields_set != {"overhang_deg"}:
            raise ValueError(
                f"{', '.join(missing)} missing; `geoprint fit-flow` writes {', '.join(FLOW_KEYS)} together; only "
                "overhang_deg may stand alone"
            )
        return self

    @model_validator(mode="after")
    def _knows_the_whole_spot(self) -> Self:
        if (self.uv_irradiance_mw_cm2 is None) != (self.uv_spot_mm is None):
            raise ValueError("uv_irradiance_mw_cm2 and uv_spot_mm describe one spot: give both or neither")
        return self


class GoodPrintTable(Table):
    """A print that worked."""

    pressure_kpa: PositiveFloat
    rounds: Rounds


class SignalsTable(Table):
    """The controller's outputs."""

    mode: SignalMode
    dispenser: SignalName
    uv_lamp: SignalName
    valve_open_s: Lag = 0.0
    valve_close_s: Lag = 0.0
    uv_lead_s: Lag = 0.0
    uv_tail_s: Exposure = 0.0
    settle_ms: Annotated[float, Field(ge=0.0, le=2000.0)] = 0.0
    flow: SignalName | None = None
    flow_per_mm3_s: PositiveFloat | None = None
    flow_lag_s: Lag = 0.0
    vacuum: SignalName | None = None

    @model_validator(mode="after")
    def _are_different(self) -> Self:
        names = [name.lower() for name in (self.dispenser, self.uv_lamp, self.flow, self.vacuum) if name is not None]
        if len(set(names)) < len(names):
            raise ValueError("dispenser, uv_lamp, flow and vacuum name the same output twice: each needs its own")
        return self

    @model_validator(mode="after")
    def _has_a_flow_to_follow(self) -> Self:
        if self.mode == "analog" and (self.flow is None) != (self.flow_per_mm3_s is None):
            raise ValueError(
                'mode "analog" needs both flow, the analog output, and flow_per_mm3_s, its value for 1 mm3/s; '
                "otherwise programs only run dry"
            )
        if self.mode == "analog" and self.settle_ms > 0.0:
            raise ValueError(
                f'settle_ms is {self.settle_ms:g}, but in mode "analog" nothing flows while the tip rests: remove it, '
                "and state the delay of the flow as flow_lag_s"
            )
        return self


class PurgeTable(Table):
    """Where the nozzle is primed."""

    joints_deg: SixJoints
    duration_s: Annotated[float, Field(gt=0.0, le=60.0)]


class FloodTable(Table):
    """The final exposure of the whole part."""

    duration_s: Annotated[float, Field(gt=0.0, le=3600.0)]
    joints_deg: SixJoints | None = None


class BoxTable(Table):
    """An obstacle."""

    name: str
    centre_mm: Triple
    size_mm: Annotated[list[PositiveFloat], Field(min_length=3, max_length=3)]


class SearchTable(Table):
    """What the choice of rotation, lean and branch counts."""

    motion: PositiveFloat = 1.0
    limits: NonNegativeFloat = 1.0
    singularities: NonNegativeFloat = 1.0
    lean: NonNegativeFloat = 1.0


class ErrorsTable(Table):
    """How far a print strays from its plan."""

    repeatability_mm: NonNegativeFloat
    path_repeatability_mm: NonNegativeFloat
    # An arm that nobody has measured is not guessed to be like another.
    path_accuracy_mm: NonNegativeFloat = 0.0
    correlation_mm: Annotated[float, Field(ge=1.0, le=1000.0)]
    placement_mm: NonNegativeFloat
    placement_turn_deg: NonNegativeFloat
    needle_runout_mm: NonNegativeFloat
    flow_share: Annotated[float, Field(ge=0.0, lt=1.0)]
    run_flow_share: Annotated[float, Field(ge=0.0, lt=1.0)]


class CellFile(Table):
    """A cell file as it is written: lengths in mm, angles in degrees."""

    robot: RobotTable
    home: HomeTable
    tool: ToolTable
    nozzle: NozzleTable
    bracket: BracketTable
    lamp: LampTable | None = None
    material: MaterialTable | None = None
    work: WorkTable
    process: ProcessTable
    signals: SignalsTable
    purge: PurgeTable | None = None
    flood: FloodTable | None = None
    good_print: GoodPrintTable | None = None
    obstacles: list[BoxTable] = Field(default=[])
    search: SearchTable = SearchTable()
    errors: ErrorsTable | None = None
    table: HexapodTable | TiltTurnTable | None = Field(default=None, discriminator="kind")
    options: dict[str, dict[str, OptionValue]] = Field(default={})


# From the tables of a cell file to the machine in mm, s, rad and Pa: degrees end here.
#
# The tables hold what a person writes, with the unit in a key's name; the nouns of `geoprint.model` hold arrays,
# know no pydantic, and are what everything else is made of. Where a table is one noun, `noun_of` turns it into that
# by its names.


Noun = TypeVar("Noun", Box, Flood, GoodPrint, PrintErrors, Process, Purge, SearchWeights, Signals)

# What a value in the unit at the end of a key's name is in mm, s, rad and Pa; the longer name first.
_UNITS: Mapping[str, Callable[[Any], Any]] = {
    "_deg": np.radians,
    "_kpa": lambda value: value * PASCAL_PER_KPA,
    "_mm_s": lambda value: value,
    "_mm": lambda value: value,
    "_ms": lambda value: value / 1000.0,
    "_s": lambda value: value,
    "_share": lambda value: value,
}


def machine_of(table: Mapping[str, object], *, name: str, folder: Path) -> Cell:
    """Return the cell that a table of TOML describes.

    Args:
        table: as it is written.
        name: of the cell.
        folder: from which the URDF is found.

    Raises:
        ValidationError: a key is unknown, missing or meaningless.
        InputError: values contradict each other.
        UsageError: the URDF cannot be read.
    """
    file = CellFile.model_validate(table)
    return Cell(
        name=name,
        robot=_robot(file, folder),
        tool=_tool(file),
        process=noun_of(Process, file.process),
        signals=noun_of(Signals, file.signals),
        purge=file.purge and noun_of(Purge, file.purge),
        flood=file.flood and noun_of(Flood, file.flood),
        obstacles=tuple(noun_of(Box, box) for box in file.obstacles),
        demo_position=np.array(file.work.demo_position_mm, dtype=np.float64),
        demo_rotation=None
        if file.work.demo_rpy_deg is None
        else Rotation.from_euler("xyz", file.work.demo_rpy_deg, degrees=True).as_matrix(),
        fixture=_fixture(file.work),
        material=None if file.material is None else _material(file.material),
        overhang=None
        if file.material is None or file.material.overhang_deg is None
        else float(np.radians(file.material.overhang_deg)),
        good_print=file.good_print and noun_of(GoodPrint, file.good_print),
        search=noun_of(SearchWeights, file.search),
        errors=file.errors and noun_of(PrintErrors, file.errors),
        table=None if file.table is None else _table(file.table),
        options=file.options,
    )


def _robot(file: CellFile, folder: Path) -> Robot:
    """Return the arm of a cell; it has no URDF where it is a packaged one that is not calibrated.

    Raises:
        UsageError: the URDF or the calibration cannot be read.
    """
    table = file.robot
    model, urdf = table.arm or "", None
    if table.urdf is not None:
        model, urdf = Path(table.urdf).name, read_urdf_file(folder / table.urdf, flange=table.flange)
    elif table.calibration is not None:
        model, urdf = f"{model}-calibrated.urdf", calibrated_urdf(model, folder / table.calibration)
    return Robot(
        model=model,
        limits=np.radians(table.limits_deg),
        speeds=np.radians(table.speeds_deg_s),
        accelerations=np.radians(table.accelerations_deg_s2),
        home=np.radians(file.home.joints_deg),
        target_period=table.target_period_ms / 1000.0,
        response=table.response_ms / 1000.0,
        urdf=urdf,
        flange=table.flange,
        load=table.load,
        post_processor=table.post_processor,
    )


def noun_of(noun: type[Noun], table: Table) -> Noun:
    """Return the noun of a table: each key is its field of the same name, or of the name without the unit behind it.

    Degrees, kPa and ms end here. A key that is not given is left to the noun's own default.
    """
    known = {field.name for field in fields(noun)}
    values: dict[str, Any] = {}
    for key, written in table:
        unit = next((unit for unit in _UNITS if key.endswith(unit)), "")
        name = key if key in known else key.removesuffix(unit)
        value = np.array(written, dtype=np.float64) if isinstance(written, list) else written
        if written is not None:
            values[name] = _UNITS[unit](value) if name != key else value
    return noun(**values)


def _tool(file: CellFile) -> Tool:
    return Tool(
        T_flange_tool=_pose(file.tool.tcp_mm, file.tool.rpy_deg),
        needle_length=file.nozzle.needle_length_mm,
        needle_diameter=file.nozzle.outer_diameter_mm,
        inner_diameter=file.nozzle.inner_diameter_mm,
        cone_half_angle=float(np.radians(file.nozzle.cone_half_angle_deg)),
        barrel_diameter=file.nozzle.barrel_diameter_mm,
        barrel_top=file.nozzle.barrel_top_mm,
        bracket_length=file.bracket.length_mm,
        bracket_diameter=file.bracket.diameter_mm,
        mass_kg=file.tool.mass_kg,
        cog=np.array(file.tool.cog_mm),
        inertia_kg_m2=np.array(file.tool.inertia_kg_m2),
        principal_axes=Rotation.from_euler("xyz", file.tool.inertia_rpy_deg, degrees=True).as_matrix(),
        lamp=None if file.lamp is None else _lamp(file.lamp),
    )


def _lamp(lamp: LampTable) -> Lamp:
    return Lamp(_pose(lamp.position_mm, lamp.rpy_deg), length=lamp.length_mm, diameter=lamp.diameter_mm)


def _material(table: MaterialTable) -> Material | None:
    """Return what a table says of flow and light; None where it says only from which angle on beads overhang."""
    density, consistency, index = table.density_g_cm3, table.consistency_pa_sn, table.flow_index
    if density is None or consistency is None or index is None or table.yield_stress_pa is None:
        return None
    return Material(
        density=density,
        fluid=Fluid(consistency, index, table.yield_stress_pa),
        irradiance=table.uv_irradiance_mw_cm2,
        spot_diameter=table.uv_spot_mm,
        dose=table.uv_dose_mj_cm2,
        penetration=table.uv_penetration_mm,
    )


def _table(table: HexapodTable | TiltTurnTable) -> Hexapod | TiltTurn:
    noun = table.noun(_pose)
    # Refuses legs that do not hold the plate at rest.
    table_machine(noun)
    return noun


def _fixture(work: WorkTable) -> TouchedPoints | None:
    if work.source == "demo":
        return None
    return TouchedPoints(
        model=np.array(work.model_mm),
        touched=np.array(work.touched_mm),
        T_fixture_work=None if work.part_mm is None else _pose(work.part_mm, work.part_rpy_deg or [0.0, 0.0, 0.0]),
        noise=work.noise_mm,
    )


def _pose(position_mm: list[float], rpy_deg: list[float]) -> FloatArray:
    """Return the transform of a position and of roll, pitch, yaw about fixed x, y, z axes."""
    rotation = Rotation.from_euler("xyz", rpy_deg, degrees=True).as_matrix()
    return rigid(rotation, np.array(position_mm, dtype=np.float64))
