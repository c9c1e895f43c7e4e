"""A check that takes over what another prepared of the same part, tool and arm finds what one of its own finds."""

from __future__ import annotations

from dataclasses import astuple, replace
from itertools import combinations

import fcl
import numpy as np
import pytest

from geoprint import transforms
from geoprint.errors import ClearanceError, VerificationError
from geoprint.model import Box, Clearance, Cylinder, FloatArray, Obstacle, Tool
from geoprint.robot.arm import Arm
from geoprint.robot.collision import ClearanceCheck, contact
from geoprint.robot.collision.arm_clearance import ArmCheck, ArmMotion, arm_control
from geoprint.robot.collision.closest import ranking_trees, smallest_distance
from geoprint.robot.collision.contact import CollisionWorld, InflatedSolids
from geoprint.robot.collision.surroundings import Target, mesh_target, obstacle_target
from geoprint.robot.collision.sweep import Placements, refuse_links_inside
from geoprint.robot.collision.tool_solids import Link, Solid, tool_solids
from tests.meshes import plate
from tests.robot.collision.test_clearance import CELL, T_BASE_WORK, printed_line
from tests.robot.placements import always, block, pointing_down, run_of

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
    tool = replace(CELL.tool, needle_length=CELL.tool.needle_length + 0.125)
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


# The check of the arm, one pair at a time: what passes something within a step is found by its pair alone.
#
# The links are made up: seven upright cylinders far from one another, of which one passes another or a post. At both
# placements it is farther than has to be kept; between them it is nearer.


RADIUS, KEPT = 5.0, 0.5
# The check is right to this [mm], on the far side.
NEARER, FARTHER = 0.02, 0.12
# The tool comes after the links 0 to 6.
TOOL = 7
FAR = mesh_target(block((-5.0, 900.0, 0.0), (5.0, 905.0, 10.0), name="far"), role="body")
# By hand: links three joints or more apart but for link 1, and the tool with the base and the links 1 to 4.
KEPT_APART = {(0, 3), (0, 4), (0, 5), (0, 6), (2, 5), (2, 6), (3, 6), *((link, TOOL) for link in range(5))}


def cylinder(name: str, low: float = 0.0, high: float = 10.0) -> Solid:
    return Solid(name, np.array([0.0, 0.0, low]), np.array([0.0, 0.0, high]), RADIUS, RADIUS)


LINKS = tuple(Link(f"link {joint}", joint, (cylinder(f"link {joint}"),)) for joint in range(7))
NOZZLE = (cylinder("needle's tip", 0.0, 1.0), cylinder("needle", 1.0, 10.0))


def motion(mover: int, past: FloatArray) -> ArmMotion:
    """Return links and tool, 100 mm apart, of which one passes a place within its only step, 3 mm long."""
    poses = np.tile(np.eye(4), (2, 8, 1, 1))
    poses[:, :, 0, 3] = 100.0 * np.arange(8)
    poses[:, mover, :3, 3] = past + np.array([[-1.5, 0.0, 0.0], [1.5, 0.0, 0.0]])
    tool = Placements(
        poses[:, TOOL], runs=np.zeros(2, dtype=np.int64), deposit=np.zeros(2, np.bool_), corners=poses[:, TOOL]
    )
    return ArmMotion(poses[:, :TOOL], poses[:, :TOOL], tool)


def refused(found: ArmMotion, *, targets: tuple[Target, ...] = (FAR,), base: tuple[Target, ...] = (FAR,)) -> bool:
    trees = ranking_trees((*targets, *base))
    try:
        ArmCheck(LINKS, tool=NOZZLE, kept=KEPT, targets=targets, base_targets=base, trees=trees)(found)
    except ClearanceError:
        return True
    return False


@pytest.mark.parametrize(("other", "mover"), list(combinations(range(8), 2)))
def test_links_and_tool_keep_apart_from_those_they_may_hit_and_from_no_others(other: int, mover: int) -> None:
    place = np.array([100.0 * other, 2.0 * RADIUS + KEPT - NEARER, 0.0])
    assert refused(motion(mover, place)) == ((other, mover) in KEPT_APART)


@pytest.mark.parametrize(("other", "mover"), [(0, 3), (3, 6), (4, TOOL)])
def test_a_pair_that_keeps_its_distance_within_the_step_is_free(other: int, mover: int) -> None:
    place = np.array([100.0 * other, 2.0 * RADIUS + KEPT + FARTHER, 0.0])
    assert not refused(motion(mover, place))


@pytest.mark.parametrize("mover", range(1, 7))
def test_each_link_keeps_its_distance_from_its_own_targets_within_a_step(mover: int) -> None:
    post = mesh_target(block((-0.01, RADIUS, 4.0), (0.01, RADIUS + 1.0, 6.0), name="post"), role="body")
    for gap, near in ((KEPT - NEARER, True), (KEPT + FARTHER, False)):
        moving = motion(mover, np.array([0.0, -gap, 0.0]))
        poses = moving.Ts_work_link.copy()
        # The base is out of the way.
        poses[:, 0, 1, 3] = -300.0
        moving = ArmMotion(poses, poses, moving.tool)
        assert refused(moving, targets=(post,)) == (near and mover > 1)
        assert not near or refused(moving, base=(post,)) == (mover == 1)


@pytest.mark.parametrize(("answer", "message"), [(0, "a known hit"), (1, "a known miss")])
def test_the_control_of_the_links_notices_a_library_that_always_says_the_same(
    monkeypatch: pytest.MonkeyPatch, answer: int, message: str
) -> None:
    monkeypatch.setattr(fcl, "collide", always(answer))
    with pytest.raises(VerificationError, match=message):
        arm_control("irb120")


@pytest.mark.parametrize(("places", "within"), [(((0.0, 0.0), (40.0, 0.0)), True), (((40.0, 0.0), (0.0, 0.0)), False)])
def test_a_link_inside_a_closed_body_is_refused_where_the_path_begins(
    places: tuple[tuple[float, float], ...], *, within: bool
) -> None:
    body = mesh_target(block((-20.0, -20.0, -20.0), (20.0, 20.0, 30.0)), role="body")
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :2, 3] = places
    moved = Placements(poses, runs=np.zeros(2, dtype=np.int64), deposit=np.zeros(2, dtype=np.bool_), corners=poses)
    # One of two solids inside is enough.
    aside = Solid("aside", np.array([300.0, 0.0, 0.0]), np.array([300.0, 0.0, 10.0]), RADIUS, RADIUS)
    for solids in ((cylinder("link 2"), aside), (aside, cylinder("link 2"))):
        world = CollisionWorld(InflatedSolids(solids, kept=(KEPT, KEPT)), targets=(FAR, body))
        if within:
            with pytest.raises(ClearanceError, match="is inside the closed body block at the start of the path"):
                refuse_links_inside([(world, moved)])
        else:
            refuse_links_inside([(world, moved)])
