"""Attitudes eased: joints hold the speed where a small lean buys it, and nothing else changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, JointPath, Process
from geoprint.robot.arm import tilts
from geoprint.robot.collision import CheckedWorld
from geoprint.robot.reach import Easing, NozzleRoom
from geoprint.robot.reach.easing import Stretch, demands, eased, eased_turns
from geoprint.robot.timing import retime
from tests.meshes import plate
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import WORK, arm_of, line, solved, stream, tilted

CELL = bent_cell()
ARM = arm_of(CELL)
PART = plate((130.0, 40.0), (26, 8))
CAP = float(np.radians(8.0))
COUNT, LENGTH = 241, 60.0
PROCESS: Process = CELL.process
SCENE = CheckedWorld(
    CELL.tool, process=PROCESS, part=PART, body=None, obstacles=(), T_work_base=transforms.inverse(WORK)
)


def nodding(height: float = 10.0, wide: float = 3.0) -> JointPath:
    """Return a straight run whose normal nods by so many degrees half way, over so many millimetres."""
    tips = line((-30.0, 0.0, 0.3), (30.0, 0.0, 0.3), count=COUNT)
    nod = np.radians(height) * np.exp(-((tips[:, 0] / wide) ** 2))
    return solved(stream(tips, quaternions=tilted(nod)), ARM)


def touches_nothing(joints: FloatArray) -> BoolArray:
    return np.zeros(len(joints), dtype=np.bool_)


def easing(cap: float = CAP, *, arm_touches: Callable[[FloatArray], BoolArray] = touches_nothing) -> Easing:
    room = NozzleRoom(CELL.tool, process=PROCESS, standoff=0.3, scene=SCENE, T_base_work=WORK)
    return Easing(PROCESS.speed, cap, room, arm_touches)


def demand(path: JointPath) -> FloatArray:
    return demands(path.poses.arcs, path.joints, speed=PROCESS.speed, arm=ARM)


def eased_path(path: JointPath, *, cap: float = CAP) -> JointPath:
    return eased(path, ARM, easing=easing(cap), minimum_wrist_angle=float(np.radians(5.0)))


def test_attitudes_in_which_the_arm_comes_too_close_stay_as_they_are_but_where_it_did_before() -> None:
    path = nodding()
    asked: list[FloatArray] = []

    def touches_when_eased(joints: FloatArray) -> BoolArray:
        asked.append(joints)
        return np.full(len(joints), len(asked) == 1)

    def found_with(arm_touches: Callable[[FloatArray], BoolArray]) -> JointPath:
        return eased(path, ARM, easing=easing(arm_touches=arm_touches), minimum_wrist_angle=float(np.radians(5.0)))

    assert found_with(touches_when_eased) is path
    assert len(asked) == 2
    assert np.abs(asked[0] - asked[1]).max() > 0.01
    everywhere = found_with(lambda joints: np.ones(len(joints), dtype=np.bool_))
    np.testing.assert_array_equal(everywhere.joints, eased_path(path).joints)
    assert everywhere.eased


def test_a_nod_that_no_joint_follows_at_speed_is_passed_by_a_lean() -> None:
    path = nodding()
    assert demand(path).max() > 1.05
    found = eased_path(path)
    assert demand(found).max() <= 1.0
    trajectory = retime(found, CELL.robot, process=PROCESS)
    assert trajectory.slowdowns == ()
    assert retime(path, CELL.robot, process=PROCESS).slowdowns


def test_lean_stays_in_its_cone_and_the_tip_and_the_ends_where_they_were() -> None:
    path = nodding()
    found = eased_path(path)
    assert 0.0 < np.degrees(tilts(found.poses).max()) <= 8.0
    np.testing.assert_array_equal(found.poses.tips, path.poses.tips)
    # 12 mm before the nod and behind it nothing is turned.
    away = np.abs(path.poses.tips[:, 0]) > 12.0 + 4.0
    np.testing.assert_array_equal(found.joints[away], path.joints[away])
    np.testing.assert_allclose(found.poses.quaternions[away], path.poses.quaternions[away], atol=1e-12)
    assert found.branch == path.branch


def test_a_run_that_is_left_out_stays_as_it_is() -> None:
    path = nodding()
    found = eased(path, ARM, easing=replace(easing(), left_out=(0,)), minimum_wrist_angle=float(np.radians(5.0)))
    assert found == path


def test_what_easing_bought_is_told_with_its_run_and_place() -> None:
    (record,) = eased_path(nodding()).eased
    assert (record.run, record.left) == (0, 0.0)
    # The nod bends most in its middle, 30 mm from the start, and within 3 mm to either side.
    assert 0.5 < record.lacking < 6.0
    assert record.arc == pytest.approx(30.0 - 12.0, abs=4.0)
    assert record.arc + record.length == pytest.approx(30.0 + 12.0, abs=4.0)
    assert nodding().eased == ()


def test_joints_lead_to_the_poses_that_the_path_tells() -> None:
    found = eased_path(nodding())
    commanded = WORK @ transforms.rigid(transforms.rotation_of(found.poses.quaternions), found.poses.tips)
    np.testing.assert_allclose(ARM.tool_poses(found.joints), commanded, atol=1e-7)
    # Lean and turn about the nozzle are those of the attitudes.
    base = nodding().poses.quaternions
    record = transforms.rotation_of(base) @ [
        transforms.smallest_rotation(np.array([0.0, 0.0, 1.0]), _axis(lean)[None])[0] @ _about_z(turn)
        for lean, turn in zip(found.leans, found.rotations, strict=True)
    ]
    np.testing.assert_allclose(record, transforms.rotation_of(found.poses.quaternions), atol=1e-9)


def _axis(lean: FloatArray) -> FloatArray:
    angle = float(np.linalg.norm(lean))
    if angle == 0.0:
        return np.array([0.0, 0.0, 1.0])
    return np.array([np.sin(angle) * lean[1] / angle, -np.sin(angle) * lean[0] / angle, np.cos(angle)])


def _about_z(turn: float) -> FloatArray:
    return np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])


def test_a_cone_too_narrow_for_it_leaves_the_path_or_keeps_to_itself() -> None:
    path = nodding(12.0, 2.0)
    found = eased_path(path, cap=float(np.radians(1.0)))
    assert (tilts(found.poses) <= np.maximum(np.radians(1.0), tilts(path.poses)) + 1e-9).all()


def test_what_the_joints_hold_is_not_touched() -> None:
    path = nodding(2.0)
    assert demand(path).max() < 0.9
    assert eased_path(path) is path


def test_a_bend_of_the_path_itself_is_not_leaned_for() -> None:
    # A corner at 20 mm/s takes more than any turn of the tool gives back.
    tips = line((-30.0, 0.0, 0.3), (0.0, 0.0, 0.3), count=241)
    leg = line((0.0, 0.0, 0.3), (0.0, 30.0, 0.3), count=241)[1:]
    path = solved(stream(np.vstack([tips, leg])), ARM)
    assert demand(path).max() > 1.4
    assert eased_path(path) is path


def test_an_obstacle_where_the_nozzle_would_lean_keeps_it_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    path = nodding()

    def lacking(_: NozzleRoom, poses: FloatArray, *, deposit: BoolArray) -> BoolArray:
        return deposit & _leans(poses, path)

    monkeypatch.setattr(NozzleRoom, "lacking", lacking)
    assert eased_path(path) is path


def _of(path: JointPath) -> FloatArray:
    return transforms.rigid(transforms.rotation_of(path.poses.quaternions), path.poses.tips)


def _leans(poses: FloatArray, path: JointPath) -> BoolArray:
    """Return which poses lean from what the path has at the same tip."""
    own = WORK @ _of(path)
    nearest = np.abs(poses[:, None, :3, 3] - own[None, :, :3, 3]).sum(axis=2).argmin(axis=1)
    return np.asarray(np.abs(poses[:, :3, 2] - own[nearest, :3, 2]).max(axis=1) > 1e-6)


def bumped(*, allowed: float, largest: float = 0.2) -> Stretch:
    """Return 40 mm of path on which joint 1 has a bump of 0.01 rad; leaning about x moves it as much as it leans."""
    arcs = np.linspace(0.0, 40.0, 161)
    joints = np.zeros((161, 6))
    joints[:, 0] = 0.01 * np.exp(-(((arcs - 20.0) / 2.0) ** 2))
    moved = np.zeros((161, 6, 3))
    moved[:, 0, 0] = moved[:, 1, 1] = moved[:, 2, 2] = 1.0
    return Stretch(
        arcs=arcs, joints=joints, moved=moved, leans=np.zeros((161, 2)), largest=np.full(161, largest),
        counted=np.ones(161, dtype=np.bool_), rates=np.full(6, 1.0), bends=np.full(6, allowed),
    )  # fmt: skip


def curvature(stretch: Stretch, turns: FloatArray) -> FloatArray:
    eased_joint = stretch.joints[:, 0] + turns[:, 0]
    return np.asarray(CubicSpline(stretch.arcs, eased_joint)(stretch.arcs, 2))


def test_a_step_brings_the_joint_to_its_limit_with_the_least_lean() -> None:
    # The bump bends by 2 * 0.01 / 4 = 0.005 rad/mm2 at its top.
    tight, loose = bumped(allowed=0.002), bumped(allowed=0.004)
    turns, fewer = eased_turns(tight), eased_turns(loose)
    assert turns is not None
    assert fewer is not None
    assert np.abs(curvature(tight, turns)).max() < 0.00205
    assert np.abs(curvature(loose, fewer)).max() < 0.00405
    assert 0.0 < np.abs(fewer).max() < np.abs(turns).max() < 0.01
    np.testing.assert_allclose(turns[[0, -1]], 0.0, atol=1e-12)
    assert np.abs(turns[:, 1:]).max() < 1e-4


def test_a_step_with_room_turns_nothing() -> None:
    turns = eased_turns(bumped(allowed=0.006))
    assert turns is not None
    assert np.abs(turns).max() < 1e-4


def test_a_step_leans_no_more_than_it_may_and_counts_only_what_counts() -> None:
    turns = eased_turns(bumped(allowed=0.001, largest=0.002))
    assert turns is not None
    assert np.linalg.norm(turns[:, :2], axis=1).max() <= 0.002 + 1e-6
    uncounted = replace(bumped(allowed=0.001), counted=np.zeros(161, dtype=np.bool_))
    nothing = eased_turns(uncounted)
    assert nothing is not None
    assert np.abs(nothing).max() < 1e-4


def test_a_stretch_too_short_to_turn_and_turn_back_is_left() -> None:
    arcs = np.linspace(0.0, 5.0, 21)
    short = Stretch(
        arcs=arcs, joints=np.zeros((21, 6)), moved=np.zeros((21, 6, 3)), leans=np.zeros((21, 2)),
        largest=np.full(21, 0.1), counted=np.ones(21, dtype=np.bool_), rates=np.ones(6), bends=np.ones(6),
    )  # fmt: skip
    assert eased_turns(short) is None


def test_the_jacobian_is_what_turning_each_joint_does() -> None:
    joints = nodding().joints[::60]
    found = ARM.jacobians(joints)
    for joint in range(6):
        step = np.zeros(6)
        step[joint] = 1e-6
        before, after = ARM.tool_poses(joints - step), ARM.tool_poses(joints + step)
        tip = (after[:, :3, 3] - before[:, :3, 3]) / 2e-6
        spin = (after[:, :3, :3] - before[:, :3, :3]) @ np.swapaxes(ARM.tool_poses(joints)[:, :3, :3], 1, 2) / 2e-6
        np.testing.assert_allclose(found[:, :3, joint], tip, atol=1e-5)
        turn = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        np.testing.assert_allclose(found[:, 3:, joint], turn, atol=1e-8)
