"""The robot of the report page is the one that the collision check knows, and stands where its joints put it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.config import load_cell
from geoprint.model import FloatArray, Hexapod, Surface, TiltTurn
from geoprint.positioner import straight_course, table_machine, tilted_placement
from geoprint.reporting import Machine
from geoprint.reporting.replaying import at_rest, machine, motion_shades, table_replay
from geoprint.results import Plan
from geoprint.robot.arm import Arm
from tests.meshes import plate
from tests.positioner.tables import hexapod_noun, tilt_turn_noun
from tests.postprocessor.export_cases import PLACEMENT
from tests.robot.joint_paths import line, stream, tilted

JOINTS = np.radians([[30.0, 20.0, -10.0, 40.0, 60.0, -70.0]])
T_BASE_WORK = transforms.rigid(Rotation.from_euler("xyz", [0.2, 0.1, 0.7]).as_matrix(), np.array([300.0, 40.0, 80.0]))


@pytest.fixture(scope="module")
def arm() -> Arm:
    cell = load_cell(None)
    return Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)


@pytest.fixture(scope="module")
def shown() -> Machine:
    return machine(load_cell(None), T_base_work=T_BASE_WORK, body=plate(), cell_file=None)


def test_a_body_that_is_folded_onto_itself_is_drawn_all_the_same() -> None:
    folded = Surface(np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]]), np.array([[0, 1, 2], [0, 2, 1]]))
    bodies = machine(load_cell(None), T_base_work=T_BASE_WORK, body=folded, cell_file=None).bodies
    assert np.isfinite(bodies[-1].surface.vertices).all()


def moved(shown: Machine, joints: FloatArray, *, joint: int, places: FloatArray) -> FloatArray:
    """Return places on the link of a joint as the page moves them: one turn about an axis after the other."""
    for point, direction, angle in reversed(list(zip(shown.points, shown.directions, joints, strict=True))[:joint]):
        places = point + Rotation.from_rotvec(angle * direction).apply(places - point)
    return places


def test_tool_and_links_are_where_the_arm_has_them(arm: Arm, shown: Machine) -> None:
    T_work_base = transforms.inverse(T_BASE_WORK)
    at_rest = T_work_base @ arm.link_poses(np.zeros((1, 6)))[0]
    now = T_work_base @ arm.link_poses(JOINTS)[0]
    for body in shown.bodies:
        if body.kind not in {"arm", "tool"}:
            continue
        frame = len(now) - 1 if body.kind == "tool" else body.joint
        there = moved(shown, JOINTS[0], joint=body.joint, places=body.surface.vertices)
        own = transforms.apply(transforms.inverse(at_rest[frame]), body.surface.vertices)
        np.testing.assert_allclose(there, transforms.apply(now[frame], own), atol=1e-6)


def test_the_needle_ends_at_the_tip(arm: Arm, shown: Machine) -> None:
    tip = (transforms.inverse(T_BASE_WORK) @ arm.tool_poses(np.zeros((1, 6))))[0, :3, 3]
    tool = np.concatenate([body.surface.vertices for body in shown.bodies if body.kind == "tool"])
    assert np.linalg.norm(tool - tip, axis=1).min() < 0.7


def test_all_that_stands_in_the_cell_is_drawn_and_the_body_a_little_below_its_surface(shown: Machine) -> None:
    kinds = [body.kind for body in shown.bodies]
    assert {kind: kinds.count(kind) for kind in ("arm", "tool", "cell", "body")} == {
        "arm": 12, "tool": 5, "cell": 1, "body": 1,
    }  # fmt: skip
    table = next(body.surface for body in shown.bodies if body.kind == "cell")
    in_base = transforms.apply(T_BASE_WORK, table.vertices)
    np.testing.assert_allclose(in_base.max(axis=0), [700.0, 600.0, 0.0], atol=1e-9)
    body = next(body.surface for body in shown.bodies if body.kind == "body")
    np.testing.assert_allclose(body.vertices[:, 2], -0.006 * 50.0, atol=1e-9)


def test_each_vertex_has_lean_and_speed_of_the_deposit_that_lies_nearest() -> None:
    # 10 mm in 1 s upright, then 10 mm in 2 s leaned by 8 degrees; the set speed is 10 mm/s.
    tips = line((0.0, 0.0, 0.3), (20.0, 0.0, 0.3), count=21)
    leaned = stream(tips, quaternions=tilted(np.where(tips[:, 0] > 10.0, np.radians(8.0), 0.0)))
    poses = replace(leaned, normals=np.tile([0.0, 0.0, 1.0], (21, 1)))
    times = np.concatenate([np.linspace(0.0, 1.0, 11), np.linspace(1.0, 3.0, 11)[1:]])
    process = SimpleNamespace(process=SimpleNamespace(speed=10.0))
    robot = SimpleNamespace(trajectory=SimpleNamespace(pose_times=times), joint_path=SimpleNamespace(poses=poses))
    planned = SimpleNamespace(robot=(robot,), workpiece=SimpleNamespace(cell=process))
    vertices = np.array([[5.3, 1.0, 0.0], [15.3, -1.0, 0.0]])
    shades = motion_shades(cast("Plan", planned), vertices)
    np.testing.assert_allclose(shades.lean, [0.0, 8.0], atol=1e-9)
    np.testing.assert_allclose(shades.speed, [1.0, 0.5])


@pytest.mark.parametrize("noun", [hexapod_noun(), tilt_turn_noun()], ids=["hexapod", "tilt-turn"])
def test_part_and_solids_of_a_table_are_moved_from_rest_to_where_they_stand(noun: Hexapod | TiltTurn) -> None:
    table, cell = table_machine(noun), replace(load_cell(None), table=noun)
    ups = np.array([[0.0, 0.17, 0.98], [0.1, -0.1, 0.98]])
    poses = table.plates(ups / np.linalg.norm(ups, axis=1, keepdims=True))
    places = [tilted_placement(table, PLACEMENT, T_table_plate=one, number=k) for k, one in enumerate(poses, start=1)]
    turning = np.array([[0.0, 1.0], [5.0, 6.0]])
    found = table_replay(cell, places, turning=turning)
    drawn = machine(cell, T_base_work=at_rest(cell, places[1]), body=None, cell_file=None)
    solids = [body for body in drawn.bodies if body.kind == "table"]
    assert [body.joint for body in solids] == list(range(1, len(table.solids(np.eye(4))) + 1))
    corner = np.array([[10.0, -20.0, 5.0]])
    # At rest, on the course to each attitude, and in it: the frames lie evenly in the time of each motion.
    knots: list[FloatArray] = [np.eye(4), *poses]
    courses = [np.stack(ends) for ends in pairwise(knots)]
    first = int(np.searchsorted(found.times, 5.0))
    assert first > 2
    assert len(found.times) - first > 2
    on_course = [
        straight_course(table, ends, np.linspace(0.0, 1.0, count))
        for ends, count in zip(courses, (first, len(found.times) - first), strict=True)
    ]
    np.testing.assert_allclose(
        found.times, [*np.linspace(0.0, 1.0, first), *np.linspace(5.0, 6.0, len(found.times) - first)]
    )
    for number, pose in enumerate(pose for course in on_course for pose in course):
        stands = tilted_placement(table, PLACEMENT, T_table_plate=pose, number=1)
        there = corner @ found.part[number, :, :3].T + found.part[number, :, 3]
        in_base = transforms.apply(PLACEMENT.T_base_work, there)
        np.testing.assert_allclose(in_base, transforms.apply(stands.T_base_work, corner), atol=1e-9)
        for body, motion, wanted in zip(solids, found.solids[number], table.solids(pose), strict=True):
            there = body.surface.vertices @ motion[:, :3].T + motion[:, 3]
            from_start = transforms.apply(PLACEMENT.T_base_work, there) - wanted.start
            axis = wanted.end - wanted.start
            along = from_start @ axis / (axis @ axis)
            across = np.linalg.norm(from_start - along[:, None] * axis, axis=1)
            np.testing.assert_allclose(np.minimum(np.abs(along), np.abs(along - 1.0)), 0.0, atol=1e-9)
            assert np.ptp(along) == pytest.approx(1.0)
            assert wanted.radius * (1.0 - 1e-9) <= across.max() <= 1.1 * wanted.radius
