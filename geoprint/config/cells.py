"""From a cell file to the machine in mm, s and rad: degrees end here."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import numpy as np
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from geoprint.config.cell_file import CellFile, FloodTable, LampTable, MaterialTable, SignalsTable, WorkTable
from geoprint.config.strict import describe, parsed_toml, text_of
from geoprint.errors import InputError, UsageError
from geoprint.model import (
    PASCAL_PER_KPA,
    Box,
    Cell,
    FloatArray,
    Flood,
    Fluid,
    GoodPrint,
    Lamp,
    Material,
    Process,
    Purge,
    Robot,
    SearchWeights,
    Signals,
    Tool,
    TouchedPoints,
)
from geoprint.motion.arm import read_urdf_file
from geoprint.transforms import rigid

# The cells that come with geoprint, the default first.
PACKAGED_CELLS = ("irb120-bent45", "irb120-straight160")


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
        text = text_of(path) if path else packaged_cell_text(PACKAGED_CELLS[0])
    except (OSError, ValueError) as error:
        raise UsageError(f"the cell file {path} cannot be read ({error}); `geoprint init` writes one.") from error
    table = parsed_toml(text, name=name)
    try:
        folder = path.parent if path else Path()
        return _cell(CellFile.model_validate(table), name=name, folder=folder)
    except ValidationError as error:
        raise UsageError(f"{name}: {describe(error)}; `geoprint init` writes a cell with every key.") from error
    except (InputError, UsageError) as error:
        raise UsageError(f"{name}: {error}", **error.details) from error


def packaged_cell_text(name: str) -> str:
    """Return the text of a packaged cell file."""
    return resources.files("geoprint.robots").joinpath(f"{name}.toml").read_text(encoding="utf-8")


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
            pressure=None if file.process.pressure_kpa is None else file.process.pressure_kpa * PASCAL_PER_KPA,
            rounds=file.process.rounds,
        ),
        signals=_signals(file.signals),
        purge=None
        if file.purge is None
        else Purge(joints=np.radians(file.purge.joints_deg), duration=file.purge.duration_s),
        flood=None if file.flood is None else _flood(file.flood),
        obstacles=tuple(Box(box.name, np.array(box.centre_mm), np.array(box.size_mm)) for box in file.obstacles),
        demo_position=np.array(file.work.demo_position_mm, dtype=np.float64),
        demo_rotation=Rotation.from_euler("xyz", file.work.demo_rpy_deg, degrees=True).as_matrix(),
        fixture=_fixture(file.work),
        material=None if file.material is None else _material(file.material),
        good_print=None
        if file.good_print is None
        else GoodPrint(file.good_print.pressure_kpa * PASCAL_PER_KPA, file.good_print.rounds),
        search=SearchWeights(**file.search.model_dump()),
    )


def _signals(table: SignalsTable) -> Signals:
    return Signals(
        mode=table.mode,
        dispenser=table.dispenser,
        uv_lamp=table.uv_lamp,
        valve_open=table.valve_open_s,
        valve_close=table.valve_close_s,
        uv_lead=table.uv_lead_s,
        uv_tail=table.uv_tail_s,
        flow=table.flow,
        flow_per_mm3_s=table.flow_per_mm3_s or 0.0,
        flow_lag=table.flow_lag_s,
        vacuum=table.vacuum,
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


def _lamp(lamp: LampTable) -> Lamp:
    return Lamp(_pose(lamp.position_mm, lamp.rpy_deg), length=lamp.length_mm, diameter=lamp.diameter_mm)


def _material(table: MaterialTable) -> Material:
    return Material(
        density=table.density_g_cm3,
        fluid=Fluid(table.consistency_pa_sn, table.flow_index, table.yield_stress_pa),
        irradiance=table.uv_irradiance_mw_cm2,
        spot_diameter=table.uv_spot_mm,
        dose=table.uv_dose_mj_cm2,
    )


def _flood(table: FloodTable) -> Flood:
    return Flood(table.duration_s, joints=None if table.joints_deg is None else np.radians(table.joints_deg))


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
