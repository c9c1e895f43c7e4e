"""A check that takes over what another prepared of the same part, tool and arm finds what one of its own finds."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest

from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.model import Box, Clearance, Cylinder, FloatArray, Obstacle, Tool
from geoprint.robot.arm import Arm
from geoprint.robot.collision import ClearanceCheck, contact
from geoprint.robot.collision.closest import ranking_trees, smallest_distance
from geoprint.robot.collision.contact import CollisionWorld, InflatedSolids
from geoprint.robot.collision.surroundings import obstacle_target
from geoprint.robot.collision.tool_solids import tool_solids
from tests.meshes import plate
from tests.robot.collision.test_clearance_path import CELL, T_BASE_WORK, printed_line
from tests.robot.placements import pointing_down, run_of

PART = plate()
POST = Cylinder("hub", np.array([330.0, 60.0, 0.0]), np.array([330.0, 60.0, 100.0]), 8.0)
BESIDE = Box("box", np.array([350.0, 15.0, 62.0]), np.array([4.0, 30.0, 4.0]))


def checked(
    *obstacles: Obstacle,
    known: ClearanceCheck | None = None,
    tool: Tool = CELL.tool,
    T_base_work: FloatArray = T_BASE_WORK,
) -> ClearanceCheck:
    return ClearanceCheck(
        Arm(CELL.robot, T_flange_tool=tool.T_flange_tool), tool=tool, process=CELL.process, T_base_work=T_base_work,
        part=PART, body=None, obstacles=obstacles, known=known,
    )  # fmt: skip


@pytest.fixture(scope="module")
def own() -> tuple[ClearanceCheck, Clearance]:
    """A check that has prepared all by itself, and what it finds."""
    path, _, poses = printed_line()
    check = checked(POST)
    return check, check(path, poses=poses)


def test_a_check_with_what_another_prepared_finds_the_same(own: tuple[ClearanceCheck, Clearance]) -> None:
    path, _, poses = printed_line()
    elsewhere = checked(T_base_work=T_BASE_WORK @ transforms.rigid(np.eye(3), np.array([0.0, 30.0, 0.0])))

    taken = checked(POST, known=elsewhere)(path, poses=poses)

    assert astuple(taken) == astuple(own[1])
    assert any("against hub" in each for each in taken.checked)


def test_what_stands_only_where_the_second_check_looks_is_found(own: tuple[ClearanceCheck, Clearance]) -> None:
    path, _, poses = printed_line()
    assert own[1].smallest > 0.0

    with pytest.raises(ClearanceError, match=r"into the obstacle box"):
        checked(BESIDE, known=own[0])(path, poses=poses)


def test_what_is_new_is_controlled_and_nothing_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    named: list[str] = []
    control = contact._expect  # pyright: ignore[reportPrivateUsage]

    def noted(*values: object, name: str, **others: object) -> None:
        named.append(name)
        control(*values, name=name, **others)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(contact, "_expect", noted)
    # One that nothing in this process has inflated yet.
    tool = replace(CELL.tool)
    first = checked(POST, tool=tool)
    assert {"part plate", "hub", "plate"} <= set(named)
    named.clear()

    checked(POST, tool=tool, known=first)

    # The hub stands elsewhere as the part sees it, and is another target each time.
    assert set(named) == {"hub"}


def test_of_another_tool_nothing_is_taken(own: tuple[ClearanceCheck, Clearance]) -> None:
    path, _, poses = printed_line()
    slim = replace(CELL.tool, needle_diameter=0.7)
    of_the_slim = checked(tool=slim)

    wide = checked(POST, known=of_the_slim)

    assert wide(path, poses=poses).tip_margin == own[1].tip_margin
    assert wide.scene.tool is not of_the_slim.scene.tool
    assert checked(tool=slim, known=of_the_slim).scene.tool is of_the_slim.scene.tool


@pytest.mark.parametrize("away", [12.0, 29.0, 80.0])
def test_a_target_left_out_as_farther_than_the_nearest_is_farther(away: float) -> None:
    solids = tool_solids(CELL.tool)
    line = np.column_stack([np.linspace(0.0, 20.0, 41), np.zeros(41), np.zeros(41)])
    near = Box("near", np.array([10.0, 11.0, 40.0]), np.array([2.0, 2.0, 2.0]))
    far = Cylinder("far", np.array([10.0, -away - 10.0, 0.0]), np.array([10.0, -away - 10.0, 200.0]), 5.0)
    targets = tuple(obstacle_target(one, T_work_base=np.eye(4)) for one in (near, far))
    world = CollisionWorld(InflatedSolids(solids, kept=(0.5,) * len(solids)), targets=targets)
    alone = [
        smallest_distance(
            run_of(pointing_down(line)), CollisionWorld(world.inflated, targets=(one,)), ranking_trees((one,))
        )
        for one in targets
    ]

    found = smallest_distance(run_of(pointing_down(line)), world, ranking_trees(targets))

    assert found.distance == pytest.approx(min(one.distance for one in alone), abs=0.011)
