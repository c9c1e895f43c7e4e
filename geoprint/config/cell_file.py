"""The tables of a cell file as they are written: lengths in mm, angles in degrees."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from geoprint.config.strict import Rounds, Table, Triple
from geoprint.config.tilting import HexapodTable, TiltTurnTable
from geoprint.model import LoadLimits, SignalMode
from geoprint.motion.arm import FLANGE_FRAME

SixJoints = Annotated[list[float], Field(min_length=6, max_length=6)]
SixPositive = Annotated[list[PositiveFloat], Field(min_length=6, max_length=6)]
Range = Annotated[list[float], Field(min_length=2, max_length=2)]
SixRanges = Annotated[list[Range], Field(min_length=6, max_length=6)]
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
    """The arm: a packaged model or a URDF of your own, and what it may do."""

    model: Literal["irb120"] | None = None
    urdf: str | None = None
    flange: str = FLANGE_FRAME
    limits_deg: SixRanges
    speeds_deg_s: SixPositive
    accelerations_deg_s2: SixPositive
    target_period_ms: Annotated[float, Field(ge=1.0, le=1000.0)] = 20.0
    response_ms: Annotated[float, Field(ge=0.0, le=50.0)] = 10.0
    payload_kg: PositiveFloat | None = None
    wrist_inertia_kg_m2: Annotated[list[PositiveFloat], Field(min_length=2, max_length=2)] | None = None

    @model_validator(mode="after")
    def _one_arm_with_its_load(self) -> Self:
        if (self.model is None) == (self.urdf is None):
            raise ValueError("give either model, an arm that geoprint brings, or urdf, the file of your own")
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
                f"model_mm lists {len(self.model_mm)} points and touched_mm {len(self.touched_mm)}: they must be pairs"
            )
        if self.source == "calibrated" and not self.touched_mm:
            raise ValueError('source = "calibrated" needs the points that were touched: model_mm and touched_mm')
        if self.part_mm is None and self.part_rpy_deg is not None:
            raise ValueError("part_rpy_deg turns the part on its fixture, but part_mm does not say where it stands")
        return self


class ProcessTable(Table):
    """How the material is laid."""

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
                f"retract_mm is {self.retract_mm:g}, but between runs the tip must pass over what was laid: at least "
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
                f"{', '.join(missing)} missing; `geoprint fit-flow` writes {', '.join(FLOW_KEYS)} together, only "
                "overhang_deg may stand without them"
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
                'mode "analog" needs both flow, the analog output, and flow_per_mm3_s, its value for 1 mm3/s; without '
                "either a program runs only dry"
            )
        if self.mode == "analog" and self.settle_ms > 0.0:
            raise ValueError(
                f'settle_ms is {self.settle_ms:g}, but in mode "analog" nothing flows while the tip rests: take it out '
                "and say with flow_lag_s how late the flow follows"
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
