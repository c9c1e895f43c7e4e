"""Single poses against boxes planted just nearer and just farther than the clearance, solid by solid."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint import transforms
from geoprint.model import Box, FloatArray, Surface
from geoprint.robot.collision import SinglePoses
from geoprint.robot.collision.tool_solids import tool_solids
from tests.meshes import plate
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arm_of
from tests.robot.placements import block, pointing_down

CELL = bent_cell()
ARM = arm_of(CELL)
WHERE = np.array([300.0, 0.0, 100.0])
STANDOFF, CLEARANCE = 0.3, 0.5
# What is nearer than the clearance by this is in the way, and what is farther by this is not [mm].
NEARER, FARTHER = 0.05, 0.15
SIDE = 2.0


def around(*obstacles: Box, body: Surface | None = None) -> SinglePoses:
    return SinglePoses(
        ARM, tool=CELL.tool, process=CELL.process, standoff=STANDOFF, part=plate((60.0, 60.0), (6, 6)), body=body,
        obstacles=obstacles, T_base_work=transforms.rigid(np.eye(3), WHERE - np.array([30.0, 30.0, 0.0])),
    )  # fmt: skip


def over_the_middle(*, lean: float = 0.0, height: float = STANDOFF) -> FloatArray:
    return pointing_down(np.array([WHERE + np.array([0.0, 0.0, height])]), lean=lean)


def post(*, beside: float, height: float) -> Box:
    """A cube whose side is so far beside the axis of the nozzle, and its middle so high above the part."""
    return Box("post", WHERE + np.array([0.0, beside + SIDE / 2, height]), np.full(3, SIDE))


def test_the_scene_is_what_the_tests_say() -> None:
    assert CELL.process.clearance == CLEARANCE
    assert (CELL.tool.needle_diameter, CELL.tool.needle_length, CELL.tool.barrel_diameter) == (1.3, 25.4, 20.0)


@pytest.mark.parametrize("deposit", [True, False])
def test_a_nozzle_over_a_part_alone_is_free(*, deposit: bool) -> None:
    assert around().nozzle_free(over_the_middle(), deposit=deposit).tolist() == [True]


@pytest.mark.parametrize(("radius", "height"), [(0.65, 15.0), (10.0, 100.0)])
@pytest.mark.parametrize("deposit", [True, False])
def test_one_obstacle_beside_needle_or_barrel_is_enough_and_farther_ones_are_nothing(
    radius: float, height: float, *, deposit: bool
) -> None:
    far = post(beside=60.0, height=50.0)
    near = post(beside=radius + CLEARANCE - NEARER, height=height)
    beyond = post(beside=radius + CLEARANCE + FARTHER, height=height)
    assert not around(far, near).nozzle_free(over_the_middle(), deposit=deposit).any()
    assert around(far, beyond).nozzle_free(over_the_middle(), deposit=deposit).all()


def test_a_body_beside_the_needle_is_in_the_way() -> None:
    beside = 30.0 + 0.65 + CLEARANCE - NEARER
    near = block((beside, 29.0, 10.0), (beside + 2.0, 31.0, 20.0), name="body")
    assert not around(body=near).nozzle_free(over_the_middle(), deposit=True).any()


def test_each_pose_is_judged_by_itself() -> None:
    beside = around(post(beside=0.65 + CLEARANCE - NEARER, height=15.0))
    poses = np.concatenate([over_the_middle(), over_the_middle() + 0.0, over_the_middle()])
    poses[1, 0, 3] += 20.0
    assert beside.nozzle_free(poses, deposit=True).tolist() == [False, True, False]


@pytest.mark.parametrize(("lean_deg", "free"), [(15.0, True), (40.0, False)])
def test_the_rim_of_a_needle_that_leans_on_deposit_has_to_have_its_room(lean_deg: float, *, free: bool) -> None:
    # The rim is 0.65 sin(lean) lower than the tip, which is 0.3 mm up: 0.17 and 0.42 mm.
    assert around().nozzle_free(over_the_middle(lean=np.radians(lean_deg)), deposit=True).tolist() == [free]


def test_the_tip_may_touch_nothing_on_travel() -> None:
    assert around().nozzle_free(over_the_middle(height=0.05), deposit=False).all()
    assert not around().nozzle_free(over_the_middle(height=-0.05), deposit=False).any()


def test_what_is_carried_beside_the_nozzle_is_asked_apart_from_it() -> None:
    bracket = tool_solids(CELL.tool)[4]
    middle = transforms.apply(over_the_middle()[0], bracket.centre[None])[0]
    inside = around(Box("inside", middle, np.full(3, SIDE)))
    poses = np.concatenate([over_the_middle(), over_the_middle()])
    poses[1, :3, 3] += [100.0, 0.0, 0.0]
    assert inside.carried_free(poses).tolist() == [False, True]
    assert inside.nozzle_free(poses, deposit=True).tolist()[0]
    assert inside.carried_free(np.zeros((0, 4, 4))).tolist() == []


def test_an_arm_at_home_is_free_and_one_that_reaches_into_a_box_is_not() -> None:
    home = ARM.robot.home
    wrist = ARM.link_poses(home[None])[0, 5, :3, 3]
    joints = np.array([home, home + np.radians([60.0, 0.0, 0.0, 0.0, 0.0, 0.0])])
    assert around().arm_free(joints).tolist() == [True, True]
    assert around(Box("box", wrist, np.full(3, 20.0))).arm_free(joints).tolist() == [False, True]


def test_a_tool_that_reaches_into_the_base_of_its_arm_is_not_free() -> None:
    low, high = ARM.robot.limits.T
    joints = np.random.default_rng(0).uniform(low, high, (20_000, 6))
    tips = ARM.tool_poses(joints)[:, :3, 3]
    inside = (np.hypot(tips[:, 0], tips[:, 1]) < 40.0) & (tips[:, 2] > 30.0) & (tips[:, 2] < 200.0)
    assert inside.sum() >= 5
    assert not around().arm_free(joints[inside][:20]).any()
