"""The check of the arm, one pair at a time: what passes something within a step is found by its pair alone.

The links are made up: seven upright cylinders far from one another, of which one passes another or a post. At both
placements it is farther than has to be kept; between them it is nearer.
"""

from __future__ import annotations

from itertools import combinations

import fcl
import numpy as np
import pytest

from geoprint.errors import ClearanceError, VerificationError
from geoprint.model import FloatArray
from geoprint.robot.collision.arm_clearance import ArmCheck, ArmMotion, arm_control
from geoprint.robot.collision.closest import ranking_trees
from geoprint.robot.collision.contact import CollisionWorld, InflatedSolids
from geoprint.robot.collision.surroundings import Target, mesh_target
from geoprint.robot.collision.sweep import Placements, refuse_links_inside
from geoprint.robot.collision.tool_solids import Link, Solid
from tests.robot.placements import always, block

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
            with pytest.raises(ClearanceError, match="is inside the closed body block where the path begins"):
                refuse_links_inside([(world, moved)])
        else:
            refuse_links_inside([(world, moved)])
