"""Which orientations a search about the centroid finds: reached, clear, upright where that serves, ever the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.model import Box, Robot
from geoprint.robot.arm import Arm
from geoprint.robot.placing import Oriented, Room, Scene, search_orientation
from geoprint.robot.reach import reach
from tests.meshes import plate
from tests.robot.cells import bent_cell, straight_cell
from tests.robot.placing.test_placement_search import TABLE, line

POSITION = np.array([350.0, 0.0, 200.0])
PART = plate((40.0, 20.0), (2, 2))
CORNERS = PART.vertices - PART.vertices.mean(axis=0)


def searched(robot: Robot | None = None, *, obstacles: tuple[Box, ...] = (TABLE,)) -> tuple[tuple[Oriented, ...], int]:
    """Search for a straight nozzle that prints a line of 40 mm on a plate."""
    cell = straight_cell()
    arm = Arm(robot or cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    scene = Scene(
        cell.tool,
        cell.process,
        replace(PART, vertices=CORNERS),
        None,
        Room(part=CORNERS, body=np.empty((0, 3)), obstacles=obstacles, ceiling=400.0),
    )
    return search_orientation(line(), arm, T_fixture_work=np.eye(4), position=POSITION, scene=scene)


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Try three yaws, for what does not depend on how fine the grid is."""
    monkeypatch.setattr("geoprint.robot.placing.orientation_search.YAWS", 3)


def with_joint_5_up_to(degrees: float) -> Robot:
    robot = straight_cell().robot
    limits, home = robot.limits.copy(), robot.home.copy()
    limits[4, 1], home[4] = np.radians(degrees), np.radians(30.0)
    return replace(robot, limits=limits, home=home)


@pytest.mark.usefixtures("coarse")
def test_a_part_that_is_reached_upright_with_room_is_left_as_it_stands() -> None:
    found, _ = searched()
    assert len(found) == 3
    np.testing.assert_array_equal(found[0].pose.rpy, 0.0)
    assert [each.tilt for each in found] == [0.0, 0.0, 0.0]


@pytest.mark.usefixtures("coarse")
def test_a_wrist_that_cannot_point_down_tilts_the_part_no_more_than_it_needs() -> None:
    robot = with_joint_5_up_to(40.0)
    found, _ = searched(robot)
    assert found
    for each in found:
        np.testing.assert_array_equal(each.pose.position, POSITION)
        np.testing.assert_allclose(np.degrees(each.pose.rpy).round(1), np.degrees(each.pose.rpy), atol=1e-9)
        # Straight down joint 5 stands at 72 degrees there: at least 30 are missing, and 10 more are asked for.
        assert np.radians(29.0) < each.tilt < np.radians(61.0)
        path = reach(line(), Arm(robot, T_flange_tool=straight_cell().tool.T_flange_tool),
                     T_base_work=each.pose.T_base_fixture)  # fmt: skip
        assert path.joints[:, 4].max() <= np.radians(40.0)
    again, _ = searched(robot)
    assert [each.pose.rpy.tolist() for each in again] == [each.pose.rpy.tolist() for each in found]


@pytest.mark.usefixtures("coarse")
def test_what_nothing_keeps_clear_of_is_found_nowhere() -> None:
    wall = Box("wall before the arm", np.array([200.0, 0.0, 500.0]), np.array([20.0, 600.0, 600.0]))
    assert searched(obstacles=(TABLE, wall))[0] == ()


def test_a_part_within_an_obstacle_is_found_nowhere_however_it_is_turned() -> None:
    above = Box("table above the part", np.array([350.0, 0.0, 150.0]), np.array([800.0, 1200.0, 120.0]))
    found, tried = searched(obstacles=(TABLE, above))
    assert found == ()
    # 1 + 8 + 12 + 16 + 16 + 16 tilts, each with 24 yaws.
    assert tried == 1656


@pytest.mark.usefixtures("coarse")
def test_a_bent_nozzle_is_searched_too() -> None:
    cell = bent_cell()
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    room = Room(part=CORNERS, body=np.empty((0, 3)), obstacles=(TABLE,), ceiling=400.0)
    scene = Scene(cell.tool, cell.process, replace(PART, vertices=CORNERS), None, room)
    found, _ = search_orientation(line(), arm, T_fixture_work=np.eye(4), position=cell.demo_position, scene=scene)
    assert found[0].tilt == 0.0
    assert found[0].margin > np.radians(10.0)
