"""Every attitude at single poses: what a wall leaves free is found, what it does not is proved for the whole grid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint import transforms
from geoprint.model import Box, Cell, FloatArray, PoseStream
from geoprint.robot.collision import SinglePoses
from geoprint.robot.reach import Exhausted, Exhaustion, Grid
from tests.meshes import plate
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arm_of, line, stream

PART = plate((60.0, 40.0), (12, 8))
STANDOFF = 0.3
CELL = bent_cell()
MIDDLE = 12
CONE = float(np.radians(15.0))


def placed(cell: Cell) -> FloatArray:
    middle = (PART.vertices.min(axis=0) + PART.vertices.max(axis=0)) / 2.0
    return transforms.rigid(np.eye(3), cell.demo_position - middle)


def along_x() -> PoseStream:
    low, high = PART.vertices.min(axis=0), PART.vertices.max(axis=0)
    y = (low[1] + high[1]) / 2.0
    tips = line((low[0] + 10.0, y, STANDOFF), (high[0] - 10.0, y, STANDOFF), count=2 * MIDDLE + 1)
    return stream(tips)


def wall(*, away: float) -> Box:
    """A wall 10 mm high and 4 mm long beside the middle of the path, so far [mm] from the tip, in the base frame."""
    centre = along_x().tips[MIDDLE] + [0.0, away + 2.0, 5.0 - STANDOFF]
    return Box("wall", transforms.apply(placed(CELL), centre[None])[0], np.array([4.0, 4.0, 10.0]))


def search(*obstacles: Box, cell: Cell = CELL) -> Exhaustion:
    arm = arm_of(cell)
    around = SinglePoses(
        arm, tool=cell.tool, process=cell.process, standoff=STANDOFF, part=PART, body=None, obstacles=obstacles,
        T_base_work=placed(cell),
    )  # fmt: skip
    return Exhaustion(along_x(), arm, around=around, T_base_work=placed(cell), turned=True)


def found(*obstacles: Box, cone_deg: float, cell: Cell = CELL) -> Exhausted:
    grid = Grid(float(np.radians(cone_deg)), float(np.radians(2.0)), float(np.radians(30.0)))
    return search(*obstacles, cell=cell).judged(np.array([MIDDLE]), grid)


def test_grid_covers_the_cone_no_coarser_than_its_steps() -> None:
    grid = Grid(CONE)
    leans = grid.leans
    lengths = np.linalg.norm(leans, axis=1)
    assert lengths[0] == 0.0
    assert lengths.max() == pytest.approx(CONE)
    # Any direction of the cone is within three quarters of a degree of one of them: half the diagonal of a cell.
    rng = np.random.default_rng(1)
    angles, turns = CONE * np.sqrt(rng.random(500)), 2.0 * np.pi * rng.random(500)
    asked = angles[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
    nearest = np.linalg.norm(asked[:, None] - leans, axis=2).min(axis=1)
    assert np.degrees(nearest.max()) < 0.75
    assert len(grid.turns) == 72


def test_pose_in_the_open_is_served() -> None:
    exhausted = found(cone_deg=0.0)
    assert exhausted.blocked == ()
    assert exhausted.served_by
    assert not exhausted.narrow
    # One direction, 12 turns, 8 branches.
    assert exhausted.tried == 96


def test_wall_that_refuses_the_upright_nozzle_alone_is_cleared_within_the_cone() -> None:
    # Needle and clearance need 0.65 + 0.5 mm.
    near = wall(away=1.1)
    assert [pose.cause for pose in found(near, cone_deg=0.0).blocked] == ["nozzle"]
    assert found(near, cone_deg=15.0).blocked == ()


def test_pocket_that_no_lean_clears_is_proved() -> None:
    sides = (wall(away=0.9), wall(away=-0.9 - 4.0))
    exhausted = found(*sides, cone_deg=15.0)
    (pose,) = exhausted.blocked
    assert pose.cause == "nozzle"
    assert exhausted.narrow
    assert pose.place == pytest.approx(along_x().tips[MIDDLE])
    assert exhausted.served_by == ()
    thin = replace(CELL, tool=replace(CELL.tool, needle_diameter=0.51, needle_length=60.0, barrel_top=154.6))
    assert found(*sides, cone_deg=15.0, cell=thin).blocked == ()


def test_arm_that_may_not_turn_so_far_is_the_cause() -> None:
    limits = CELL.robot.limits.copy()
    limits[4] = np.radians([-120.0, -119.0])
    home = CELL.robot.home.copy()
    home[4] = np.radians(-119.5)
    stiff = replace(CELL, robot=replace(CELL.robot, limits=limits, home=home))
    (pose,) = found(cone_deg=0.0, cell=stiff).blocked
    assert pose.cause == "reach"


def test_worst_poses_are_where_the_wall_is_and_where_it_is_asked_for() -> None:
    place = along_x().tips[2]
    worst = search(wall(away=0.9), wall(away=-0.9 - 4.0)).worst([place], cone=CONE)
    assert MIDDLE in worst.rows
    assert 2 in worst.rows
    assert MIDDLE in worst.narrow
