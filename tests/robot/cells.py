"""Cells that the tests of motion share: an IRB 120 with a bent and with a straight nozzle."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import Cell, FloatArray, Process, Robot, Signals, Tool

LIMITS_DEG = [(-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-400, 400)]
SPEEDS_DEG = [250, 250, 250, 320, 320, 420]


def bent_cell() -> Cell:
    """Nozzle bent by 45 degrees about the flange's y axis, 40 mm out of the flange, 120 mm long.

    Home holds the nozzle straight down, 100 mm above where a demonstration puts the part.
    """
    attitude = Rotation.from_euler("y", 45, degrees=True).as_matrix()
    offset = np.array([0.0, 0.0, 40.0]) + 120.0 * attitude[:, 2]
    return _cell(
        "bent",
        T_flange_tool=transforms.rigid(attitude, offset),
        home_deg=(0.0, 28.0, 20.0, 0.0, 87.0, 180.0),
        demo_position=(300.0, 0.0, 50.0),
    )


def straight_cell() -> Cell:
    """Nozzle along the flange's z axis, 160 mm long; home as in the bent cell."""
    return _cell(
        "straight",
        T_flange_tool=transforms.rigid(np.eye(3), np.array([0.0, 0.0, 160.0])),
        home_deg=(0.0, 9.0, 9.0, 0.0, 72.0, 0.0),
        demo_position=(350.0, 0.0, 200.0),
    )


def _cell(
    name: str, *, T_flange_tool: FloatArray, home_deg: tuple[float, ...], demo_position: tuple[float, float, float]
) -> Cell:
    robot = Robot(
        model="irb120",
        limits=np.radians(LIMITS_DEG),
        speeds=np.radians(SPEEDS_DEG),
        accelerations=np.array([12.0, 12.0, 12.0, 20.0, 20.0, 25.0]),
        home=np.radians(home_deg),
    )
    tool = Tool(
        T_flange_tool=T_flange_tool,
        needle_length=25.4,
        needle_diameter=1.3,
        inner_diameter=0.84,
        cone_half_angle=np.radians(10.0),
        barrel_diameter=20.0,
        barrel_top=120.0,
        bracket_length=40.0,
        bracket_diameter=30.0,
        mass_kg=0.6,
        cog=np.array([0.0, 0.0, 60.0]),
        inertia_kg_m2=np.array([0.002, 0.002, 0.0005]),
    )
    process = Process(
        speed=20.0,
        travel_speed=60.0,
        joint_speed_share=0.25,
        standoff=0.3,
        clearance=0.5,
        retract=5.0,
        layer_height=0.5,
    )
    return Cell(
        name=name,
        robot=robot,
        tool=tool,
        process=process,
        signals=Signals(mode="io", dispenser="doValve", uv_lamp="doUV"),
        obstacles=(),
        demo_position=np.array(demo_position),
        demo_rotation=np.eye(3),
        fixture=None,
    )
