"""Job and cell: TOML and command-line values in, validated model values out. Degrees end here.

Unknown keys, wrong types, NaN and infinity are refused by name, so that a typing error never becomes a default.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    ValidationError,
    model_validator,
)
from scipy.spatial.transform import Rotation

from geoprint.errors import InputError, UsageError
from geoprint.model import (
    Box,
    Cell,
    FloatArray,
    Fluid,
    Lamp,
    LoadLimits,
    Material,
    OnSlowdown,
    Process,
    Robot,
    SearchWeights,
    SignalMode,
    Signals,
    Tool,
    TouchedPoints,
)
from geoprint.motion.urdf import FLANGE_FRAME, read_urdf_file
from geoprint.transforms import rigid

# The cells that come with geoprint, the default first.
PACKAGED_CELLS = ("irb120-bent45", "irb120-straight160")

Triple = Annotated[list[float], Field(min_length=3, max_length=3)]
SixJoints = Annotated[list[float], Field(min_length=6, max_length=6)]
SixPositive = Annotated[list[PositiveFloat], Field(min_length=6, max_length=6)]
Range = Annotated[list[float], Field(min_length=2, max_length=2)]
SixRanges = Annotated[list[Range], Field(min_length=6, max_length=6)]
# From slower than any bead to what is allowed beside a person [ISO 10218-1, 5.6.2].
TipSpeed = Annotated[float, Field(ge=0.1, le=250.0)]
SignalName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,31}$")]


class _Table(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class Job(_Table):
    """What to plan, as the command line or a program asks for it.

    Attributes:
        surface: mesh file of the part.
        unit: length unit of the file, for formats that carry none.
        flip: whether the file's winding is turned, so that the other side is printed.
        backend: name of the planning backend.
        resolution: pixels along the longer side of the raster of a backend that has one.
        spacing: distance between neighbouring paths [mm]; or
        rounds: number of levels between the seed and the farthest point.
        seed: point [mm] from which distance is measured, instead of the border.
        body: mesh file of what the part lies on, in the same coordinates and unit.
        cell: cell file; a packaged one if not given.
        place: "demo" puts the part over the pedestal; without it the cell must be calibrated.
        robot: whether the robot's chain is planned too.
        max_tilt: largest angle between nozzle and surface normal on deposit [degrees].
        on_slowdown: where joints cannot hold the speed: "lower" it for the run, or let the flow "follow".
    """

    surface: Path
    unit: Literal["mm", "cm", "m", "um", "in"] | None = None
    flip: bool = False
    backend: str = "heat"
    resolution: PositiveInt | None = None
    spacing: PositiveFloat | None = None
    rounds: Annotated[int, Field(ge=1, le=100_000)] | None = None
    seed: Triple | None = None
    body: Path | None = None
    cell: Path | None = None
    place: Literal["demo"] | None = None
    robot: bool = True
    max_tilt: Annotated[float, Field(ge=0.0, le=45.0)] = 15.0
    on_slowdown: OnSlowdown = "lower"

    @model_validator(mode="after")
    def _one_of_spacing_and_rounds(self) -> Self:
        if self.spacing is not None and self.rounds is not None:
            raise ValueError("give either spacing or rounds, not both: each follows from the other")
        return self


def job_of(**values: object) -> Job:
    """Return the job with the given values.

    Args:
        **values: attributes of `Job`; files as text or paths, the seed as any sequence of three numbers.

    Raises:
        UsageError: a value is unknown, missing or meaningless; the sentence names it.
    """
    given = dict(values)
    for name, value in values.items():
        if name in {"surface", "body", "cell"} and isinstance(value, str):
            given[name] = Path(value)
        if name == "seed" and isinstance(value, Sequence):
            given[name] = [*value]
    try:
        return Job.model_validate(given)
    except ValidationError as error:
        raise UsageError(f"{describe(error)}; `geoprint --help` lists what can be given.") from error


class _RobotTable(_Table):
    model: Literal["irb120"] | None = None
    urdf: str | None = None
    flange: str = FLANGE_FRAME
    limits_deg: SixRanges
    speeds_deg_s: SixPositive
    accelerations_deg_s2: SixPositive
    target_period_ms: Annotated[float, Field(ge=1.0, le=1000.0)] = 20.0
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


class _HomeTable(_Table):
    joints_deg: SixJoints


class _ToolTable(_Table):
    tcp_mm: Triple
    rpy_deg: Triple
    mass_kg: PositiveFloat
    cog_mm: Triple
    inertia_kg_m2: Annotated[list[PositiveFloat], Field(min_length=3, max_length=3)]
    inertia_rpy_deg: Triple = [0.0, 0.0, 0.0]


class _NozzleTable(_Table):
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


class _BracketTable(_Table):
    length_mm: PositiveFloat
    diameter_mm: PositiveFloat


class _LampTable(_Table):
    position_mm: Triple
    rpy_deg: Triple
    length_mm: PositiveFloat
    diameter_mm: PositiveFloat


class _WorkTable(_Table):
    source: Literal["demo", "calibrated"]
    demo_position_mm: Triple
    demo_rpy_deg: Triple = [0.0, 0.0, 0.0]
    model_mm: list[Triple] = []
    touched_mm: list[Triple] = []
    noise_mm: PositiveFloat | None = None
    part_mm: Triple = [0.0, 0.0, 0.0]
    part_rpy_deg: Triple = [0.0, 0.0, 0.0]

    @model_validator(mode="after")
    def _touched_when_calibrated(self) -> Self:
        if len(self.model_mm) != len(self.touched_mm):
            raise ValueError(
                f"model_mm lists {len(self.model_mm)} points and touched_mm {len(self.touched_mm)}: they must be pairs"
            )
        if self.source == "calibrated" and not self.touched_mm:
            raise ValueError('source = "calibrated" needs the points that were touched: model_mm and touched_mm')
        return self


class _ProcessTable(_Table):
    speed_mm_s: TipSpeed
    travel_speed_mm_s: TipSpeed
    joint_speed_share: Annotated[float, Field(gt=0.0, le=1.0)]
    standoff_mm: PositiveFloat
    clearance_mm: PositiveFloat
    retract_mm: PositiveFloat
    layer_height_mm: PositiveFloat

    @model_validator(mode="after")
    def _lifts_clear(self) -> Self:
        needed = self.clearance_mm + self.layer_height_mm
        if self.retract_mm < needed:
            raise ValueError(
                f"retract_mm is {self.retract_mm:g}, but between runs the tip must pass over what was laid: at least "
                f"clearance_mm + layer_height_mm = {needed:g} mm"
            )
        return self


class _MaterialTable(_Table):
    density_g_cm3: PositiveFloat
    consistency_pa_sn: PositiveFloat
    flow_index: PositiveFloat
    yield_stress_pa: Annotated[float, Field(ge=0.0)]
    uv_irradiance_mw_cm2: PositiveFloat | None = None
    uv_spot_mm: PositiveFloat | None = None
    uv_dose_mj_cm2: PositiveFloat | None = None
    flood_s: PositiveFloat | None = None

    @model_validator(mode="after")
    def _knows_the_whole_spot(self) -> Self:
        if (self.uv_irradiance_mw_cm2 is None) != (self.uv_spot_mm is None):
            raise ValueError("uv_irradiance_mw_cm2 and uv_spot_mm describe one spot: give both or neither")
        return self


class _SignalsTable(_Table):
    mode: SignalMode
    dispenser: SignalName
    uv_lamp: SignalName

    @model_validator(mode="after")
    def _are_two(self) -> Self:
        if self.dispenser.lower() == self.uv_lamp.lower():
            raise ValueError(f"dispenser and uv_lamp are the same output {self.dispenser}: each needs its own")
        return self


class _BoxTable(_Table):
    name: str
    centre_mm: Triple
    size_mm: Annotated[list[PositiveFloat], Field(min_length=3, max_length=3)]


class _SearchTable(_Table):
    motion: PositiveFloat = 1.0
    limits: NonNegativeFloat = 1.0
    singularities: NonNegativeFloat = 1.0
    lean: NonNegativeFloat = 1.0


class CellFile(_Table):
    """A cell file as it is written: lengths in mm, angles in degrees."""

    robot: _RobotTable
    home: _HomeTable
    tool: _ToolTable
    nozzle: _NozzleTable
    bracket: _BracketTable
    lamp: _LampTable | None = None
    material: _MaterialTable | None = None
    work: _WorkTable
    process: _ProcessTable
    signals: _SignalsTable
    obstacles: list[_BoxTable] = []
    search: _SearchTable = _SearchTable()


def load_cell(path: Path | None) -> Cell:
    """Read and validate a cell file.

    Args:
        path: the TOML file, or None for the first packaged cell.

    Returns:
        The cell in mm, s and rad.

    Raises:
        UsageError: the file is missing, not TOML, or has an unknown, missing or meaningless key.
    """
    name = path.name if path else f"{PACKAGED_CELLS[0]}.toml"
    try:
        text = path.read_text(encoding="utf-8") if path else packaged_cell_text(PACKAGED_CELLS[0])
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"the cell file {path} cannot be read ({error}); `geoprint init` writes one.") from error
    try:
        folder = path.parent if path else Path()
        return _cell(CellFile.model_validate(tomllib.loads(text)), name=name, folder=folder)
    except tomllib.TOMLDecodeError as error:
        raise UsageError(f"{name} is not valid TOML: {error}; compare with a cell from `geoprint init`.") from error
    except ValidationError as error:
        raise UsageError(f"{name}: {describe(error)}; `geoprint init` writes a cell with every key.") from error
    except (InputError, UsageError) as error:
        raise UsageError(f"{name}: {error}", **error.details) from error


def packaged_cell_text(name: str) -> str:
    """Return the text of a packaged cell file."""
    return resources.files("geoprint.robots").joinpath(f"{name}.toml").read_text(encoding="utf-8")


def describe(error: ValidationError) -> str:
    """Say in one phrase what the first wrong key of a table is, and how many more there are."""
    problems = error.errors()
    first = problems[0]
    where = ".".join(str(part) for part in first["loc"]) or "the table"
    message = first["msg"].removeprefix("Value error, ")
    found = "" if first["type"] in {"missing", "value_error"} else f", found {first['input']!r}"
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    return f"{where}: {message[0].lower()}{message[1:]}{found}{more}"


def _cell(file: CellFile, *, name: str, folder: Path) -> Cell:
    urdf = file.robot.urdf
    return Cell(
        name=name,
        robot=Robot(
            model=file.robot.model or Path(file.robot.urdf or "").name,
            limits=np.radians(file.robot.limits_deg),
            speeds=np.radians(file.robot.speeds_deg_s),
            accelerations=np.radians(file.robot.accelerations_deg_s2),
            home=np.radians(file.home.joints_deg),
            target_period=file.robot.target_period_ms / 1000.0,
            urdf=None if urdf is None else read_urdf_file(folder / urdf, flange=file.robot.flange),
            flange=file.robot.flange,
            load=file.robot.load,
        ),
        tool=_tool(file),
        process=Process(
            speed=file.process.speed_mm_s,
            travel_speed=file.process.travel_speed_mm_s,
            joint_speed_share=file.process.joint_speed_share,
            standoff=file.process.standoff_mm,
            clearance=file.process.clearance_mm,
            retract=file.process.retract_mm,
            layer_height=file.process.layer_height_mm,
        ),
        signals=Signals(mode=file.signals.mode, dispenser=file.signals.dispenser, uv_lamp=file.signals.uv_lamp),
        obstacles=tuple(Box(box.name, np.array(box.centre_mm), np.array(box.size_mm)) for box in file.obstacles),
        demo_position=np.array(file.work.demo_position_mm, dtype=np.float64),
        demo_rotation=Rotation.from_euler("xyz", file.work.demo_rpy_deg, degrees=True).as_matrix(),
        fixture=_fixture(file.work),
        material=None if file.material is None else _material(file.material),
        search=SearchWeights(**file.search.model_dump()),
    )


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


def _lamp(lamp: _LampTable) -> Lamp:
    return Lamp(_pose(lamp.position_mm, lamp.rpy_deg), length=lamp.length_mm, diameter=lamp.diameter_mm)


def _material(table: _MaterialTable) -> Material:
    return Material(
        density=table.density_g_cm3,
        fluid=Fluid(table.consistency_pa_sn, table.flow_index, table.yield_stress_pa),
        irradiance=table.uv_irradiance_mw_cm2,
        spot_diameter=table.uv_spot_mm,
        dose=table.uv_dose_mj_cm2,
        flood=table.flood_s,
    )


def _fixture(work: _WorkTable) -> TouchedPoints | None:
    if work.source == "demo":
        return None
    return TouchedPoints(
        model=np.array(work.model_mm),
        touched=np.array(work.touched_mm),
        T_fixture_work=_pose(work.part_mm, work.part_rpy_deg),
        noise=work.noise_mm,
    )


def _pose(position_mm: list[float], rpy_deg: list[float]) -> FloatArray:
    """Return the transform of a position and of roll, pitch, yaw about fixed x, y, z axes."""
    rotation = Rotation.from_euler("xyz", rpy_deg, degrees=True).as_matrix()
    return rigid(rotation, np.array(position_mm, dtype=np.float64))
