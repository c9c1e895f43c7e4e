"""From the tables of a cell file to the machine in mm, s, rad and Pa: degrees end here.

The tables hold what a person writes, with the unit in a key's name; the nouns of `geoprint.model` hold arrays, know no
pydantic, and are what everything else is made of. Where a table is one noun, `noun_of` turns it into that by its names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.config.cell_file import CellFile, LampTable, MaterialTable, WorkTable
from geoprint.config.strict import Table
from geoprint.config.tilting import HexapodTable, TiltTurnTable
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
    Material,
    PrintErrors,
    Process,
    Purge,
    Robot,
    SearchWeights,
    Signals,
    TiltTurn,
    Tool,
    TouchedPoints,
)
from geoprint.motion.arm import read_urdf_file
from geoprint.motion.machine import table_machine
from geoprint.transforms import rigid

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
            response=file.robot.response_ms / 1000.0,
            urdf=None if urdf is None else read_urdf_file(folder / urdf, flange=file.robot.flange),
            flange=file.robot.flange,
            load=file.robot.load,
        ),
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
