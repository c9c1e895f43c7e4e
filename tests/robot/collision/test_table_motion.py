"""A table beside the arm: its solids as it holds the part, and its motion past the arm at home."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.model import Cylinder, FloatArray, Surface
from geoprint.robot.arm import Arm
from geoprint.robot.collision import table_motion_clearance
from geoprint.robot.collision.clearance import check_placements, stands_on
from geoprint.robot.collision.surroundings import obstacle_target
from tests.meshes import plate
from tests.positioner.tables import hexapod, tilt_turn
from tests.robot.cells import straight_cell
from tests.robot.placements import line, pointing_down, run_of

CELL = straight_cell()
STANDOFF, KEPT = CELL.process.standoff, CELL.process.clearance
NEEDLE, BARREL = CELL.tool.needle_diameter / 2.0, CELL.tool.barrel_diameter / 2.0
# Over the middle of the plate, along y.
LINE = line((20.0, 5.0, STANDOFF), (20.0, 25.0, STANDOFF))


def found(*solids: Cylinder) -> float:
    return check_placements(
        run_of(pointing_down(LINE)), tool=CELL.tool, process=CELL.process, standoff=STANDOFF, part=plate(), body=None,
        obstacles=solids, T_work_base=np.eye(4),
    ).smallest  # fmt: skip


def leg_beside_barrel(gap: float) -> Cylinder:
    """A leg that stands upright at a gap from the side of the barrel, beginning above the part."""
    x, top = 20.0 + BARREL + 5.0 + gap, CELL.tool.barrel_top
    return Cylinder("table's leg 3", np.array([x, 15.0, 5.0]), np.array([x, 15.0, top - 30.0]), 5.0)


def test_a_leg_in_the_way_is_found_and_named() -> None:
    with pytest.raises(ClearanceError, match=r"the barrel reaches .* into the table's leg 3") as error:
        found(leg_beside_barrel(-2.0))
    assert error.value.details["against"] == "table's leg 3"


def test_a_leg_that_stands_just_clear_is_not_reported() -> None:
    with pytest.raises(ClearanceError, match="table's leg 3"):
        found(leg_beside_barrel(KEPT - 0.05))
    assert found(leg_beside_barrel(KEPT + 0.3)) == pytest.approx(KEPT + 0.3, abs=0.05)


def test_a_plate_that_stands_up_beside_the_needle_is_found_and_one_just_clear_is_not() -> None:
    def upright(gap: float) -> Cylinder:
        x = 20.0 - NEEDLE - gap
        return Cylinder("table's plate", np.array([x, 15.0, 5.0]), np.array([x - 15.0, 15.0, 5.0]), 4.0)

    with pytest.raises(ClearanceError, match=r"the needle .* table's plate"):
        found(upright(0.2))
    assert found(upright(KEPT + 0.3)) == pytest.approx(KEPT + 0.3, abs=0.05)


def test_a_solid_of_a_table_holds_its_cylinder_wherever_the_part_stands() -> None:
    T_work_base = transforms.rigid(
        transforms.smallest_rotation(np.array([0.0, 0.0, 1.0]), np.eye(3)[:1])[0], np.ones(3)
    )
    leg = leg_beside_barrel(0.0)
    target = obstacle_target(leg, T_work_base=T_work_base)
    corners = transforms.apply(transforms.inverse(T_work_base), target.triangles.reshape(-1, 3))
    across = np.linalg.norm(corners[:, :2] - leg.start[:2], axis=1)
    rim = across[across > 1.0]
    assert leg.radius <= rim.min() + 1e-9
    assert rim.max() <= leg.radius + 0.05
    assert (corners[:, 2].min(), corners[:, 2].max()) == (pytest.approx(leg.start[2]), pytest.approx(leg.end[2]))
    assert not stands_on(leg)


def moved(kind: str, up: FloatArray, *, lower: float = 400.0) -> float:
    """The distance that is proven from the arm at home while a table, so much below it, goes to a direction."""
    arm = Arm(CELL.robot, T_flange_tool=CELL.tool.T_flange_tool)
    tip = arm.tool_poses(CELL.robot.home[None])[0, :3, 3]
    keys = {"position_mm": (tip - [0.0, 0.0, lower]).tolist(), "rpy_deg": [0.0, 0.0, 90.0]}
    table = tilt_turn(**keys) if kind == "tilt-turn" else hexapod(**keys)
    T_base_work = transforms.rigid(np.eye(3), table.T_base_table[:3, 3] - [20.0, 15.0, 0.0])
    Ts = np.concatenate([np.eye(4)[None], table.plates(up[None] / np.linalg.norm(up))])
    return table_motion_clearance(
        arm, tool=CELL.tool, table=table, Ts_table_plate=Ts, T_base_work=T_base_work, surfaces=[plate()], kept=KEPT,
        to="attitude 1 of 1",
    )  # fmt: skip


@pytest.mark.parametrize(("kind", "up"), [("tilt-turn", (1.0, 0.3, 0.2)), ("hexapod", (0.15, 0.1, 1.0))])
def test_a_table_far_below_the_arm_moves_freely_and_one_below_the_needle_does_not(
    kind: str, up: tuple[float, float, float]
) -> None:
    assert moved(kind, np.array(up)) > 100.0
    with pytest.raises(ClearanceError, match=r"goes to attitude 1 of 1, .* at home") as error:
        moved(kind, np.array(up), lower=12.0)
    assert "Choose a home with the arm higher" in str(error.value)


def test_what_passes_only_between_two_attitudes_is_found() -> None:
    # A mast passes the needle while its plate turns by half of a turn; before and behind it is beside.
    arm = Arm(CELL.robot, T_flange_tool=CELL.tool.T_flange_tool)
    tip = arm.tool_poses(CELL.robot.home[None])[0, :3, 3]
    table = tilt_turn(
        position_mm=np.add(tip, [0.0, 80.0, -30.0]).tolist(), rpy_deg=[0.0, 0.0, 180.0], stand_distance_mm=400.0
    )
    mast = Surface(plate().vertices * 0.1 + [80.0, 0.0, 29.0], plate().faces, name="mast")
    ends = np.stack([table.plate(np.radians([0.0, turn])) for turn in (0.0, 179.0)])

    def kept(T_ends: FloatArray) -> float:
        return table_motion_clearance(
            arm, tool=CELL.tool, table=table, Ts_table_plate=T_ends, T_base_work=table.T_base_table, surfaces=[mast],
            kept=KEPT, to="attitude 2 of 2",
        )  # fmt: skip

    for end in ends:
        assert kept(np.stack([end, end])) > KEPT
    with pytest.raises(ClearanceError, match="mast may come within"):
        kept(ends)


def test_a_finer_surface_proves_no_less() -> None:
    arm = Arm(CELL.robot, T_flange_tool=CELL.tool.T_flange_tool)
    table = tilt_turn(position_mm=[350.0, 0.0, -400.0])
    Ts = np.stack([np.eye(4), table.plates(np.array([[0.6, 0.0, 0.8]]))[0]])
    coarse = Surface(np.array([[0.0, 0, 0], [80, 0, 0], [0, 80, 0]]), np.array([[0, 1, 2]]), name="coarse")
    values = [
        table_motion_clearance(
            arm, tool=CELL.tool, table=table, Ts_table_plate=Ts, T_base_work=table.T_base_table, surfaces=[each],
            kept=replace(CELL.process).clearance, to="attitude 1 of 1",
        )
        for each in (coarse, plate())
    ]  # fmt: skip
    assert all(value > 0.0 for value in values)
