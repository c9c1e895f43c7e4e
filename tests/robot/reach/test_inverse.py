"""From pose streams to joint paths: reach, limits, singularities, windings and flips."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError, ReachError, VerificationError
from geoprint.geometry.files.io import load
from geoprint.geometry.operators import vertex_normals
from geoprint.model import Cell, FloatArray, JointPath, PoseStream, Surface
from geoprint.robot.arm.configuration import configuration_data
from geoprint.robot.arm.kinematics import Arm, about_nozzle
from geoprint.robot.placing.placement import demo_placement
from geoprint.robot.reach.inverse import reach
from geoprint.robot.reach.keyframes import tool_poses
from tests.meshes import spherical_cap
from tests.robot.cells import bent_cell, straight_cell
from tests.shared_data import shared

DOWN = np.diag([1.0, -1.0, -1.0])
HERE = np.eye(4)


def arm_of(cell: Cell) -> Arm:
    return Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)


def stream(tips: FloatArray, rotations: FloatArray, *, deposit: bool = True) -> PoseStream:
    """Poses of one run, in the base frame unless they are placed."""
    count = len(tips)
    return PoseStream(
        tips=tips,
        quaternions=transforms.quaternion_of(rotations),
        normals=-rotations[:, :, 2],
        runs=np.zeros(count, dtype=int),
        levels=np.zeros(count, dtype=int),
        layers=np.zeros(count, dtype=int),
        deposit=np.full(count, deposit),
        stops=np.zeros(count, dtype=bool),
        arcs=np.arange(count, dtype=float),
        flow=np.ones(count),
        standoff=0.3,
    )


def level(tips: list[list[float]], *, deposit: bool = True) -> PoseStream:
    return stream(np.array(tips), np.tile(DOWN, (len(tips), 1, 1)), deposit=deposit)


def on_surface(surface: Surface, T_base_work: FloatArray) -> PoseStream:
    """Every vertex of a surface with the nozzle against its normal, swept in rows 2 mm apart."""
    normals = vertex_normals(surface)
    placed = transforms.apply(T_base_work, surface.vertices)
    order = np.lexsort([placed[:, 0], np.round(placed[:, 1] / 2.0)])
    R_work_level = T_base_work[:3, :3].T @ DOWN
    axes = normals[order] / np.linalg.norm(normals[order], axis=1, keepdims=True)
    return stream(surface.vertices[order], transforms.smallest_rotation(R_work_level[:, 2], -axes) @ R_work_level)


def assert_holds(path: JointPath, poses: PoseStream, arm: Arm) -> None:
    """What a joint path promises: it reaches what was asked but for the turns, inside the limits, without a jump."""
    np.testing.assert_array_equal(path.leans, 0.0)
    asked = tool_poses(poses, T_base_work=path.T_base_work) @ about_nozzle(path.rotations)
    np.testing.assert_allclose(tool_poses(path.poses, T_base_work=path.T_base_work), asked, atol=1e-9)
    np.testing.assert_allclose(arm.tool_poses(path.joints), asked, atol=1e-5)
    assert (path.joints >= arm.robot.limits[:, 0]).all()
    assert (path.joints <= arm.robot.limits[:, 1]).all()


@pytest.mark.parametrize("cell", [bent_cell(), straight_cell()], ids=lambda cell: cell.name)
def test_dome_is_reached_from_above(cell: Cell) -> None:
    arm = arm_of(cell)
    cap = spherical_cap(radius=40.0, angle=0.4)
    placement = demo_placement(cap, position=cell.demo_position)
    poses = on_surface(cap, placement.T_base_work)
    path = reach(poses, arm, T_base_work=placement.T_base_work)
    assert_holds(path, poses, arm)
    assert np.degrees(path.smallest_wrist_angle) > 15.0
    assert (configuration_data(path.joints, arm=arm)[:, 3] == 0).all()
    assert path.branch == 0


@pytest.mark.parametrize(
    "name", ["lv_anterior_disc_r30", "lv_lateral_disc_r15", "lv_lateral_disc_r20_jagged", "lv_lateral_rect_40x30"]
)
def test_patches_of_the_heart_are_reached_wholly_in_the_bent_cell(name: str) -> None:
    surface = load(shared(f"patches/{name}.ply"), unit="mm")
    cell = bent_cell()
    arm = arm_of(cell)
    placement = demo_placement(surface, position=cell.demo_position)
    poses = on_surface(surface, placement.T_base_work)
    path = reach(poses, arm, T_base_work=placement.T_base_work)
    assert_holds(path, poses, arm)
    assert np.degrees(path.smallest_wrist_angle) > 30.0


def test_same_part_placed_elsewhere_is_reached_there() -> None:
    cell = bent_cell()
    arm = arm_of(cell)
    poses = level([[x, 0.0, 0.0] for x in range(-20, 21)])
    T_base_work = transforms.rigid(Rotation.from_euler("z", 70, degrees=True).as_matrix(), np.array([120, 250, 60.0]))
    path = reach(poses, arm, T_base_work=T_base_work)
    assert_holds(path, poses, arm)
    np.testing.assert_array_equal(path.T_base_work, T_base_work)


def winding(total_deg: float) -> PoseStream:
    """Stand still and turn the tool about its axis."""
    turns = np.zeros((181, 3))
    turns[:, 2] = np.radians(np.linspace(0.0, total_deg, 181))
    return stream(np.tile([350.0, 0.0, 200.0], (181, 1)), DOWN @ Rotation.from_rotvec(turns).as_matrix())


def test_attitudes_keep_their_signs_from_row_to_row() -> None:
    poses = winding(700.0)
    turned = reach(poses, arm_of(straight_cell()), T_base_work=HERE).poses.quaternions
    agree = [np.einsum("ij,ij->i", rows[1:], rows[:-1]) > 0.0 for rows in (poses.quaternions, turned)]
    assert not agree[0].all()
    np.testing.assert_array_equal(agree[1], agree[0])


@pytest.mark.parametrize("total_deg", [500.0, -500.0, 780.0])
def test_joint_6_unwinds_over_more_than_a_turn_within_its_range(total_deg: float) -> None:
    arm = arm_of(straight_cell())
    poses = winding(total_deg)
    path = reach(poses, arm, T_base_work=HERE)
    assert_holds(path, poses, arm)
    assert np.ptp(np.degrees(path.joints[:, 5])) == pytest.approx(abs(total_deg), abs=1e-6)
    assert np.degrees(np.abs(np.diff(path.joints, axis=0))).max() < 5.0
    assert np.ptp(configuration_data(path.joints, arm=arm)[:, 2]) >= int(abs(total_deg) / 90.0) - 1


def test_winding_beyond_the_range_of_joint_6_is_refused() -> None:
    with pytest.raises(ReachError, match=r"joint 6 turns along the runs up to .* allowed is -400 to 400"):
        reach(winding(900.0), arm_of(straight_cell()), T_base_work=HERE)


def test_joint_6_starts_at_the_whole_turn_nearest_to_home() -> None:
    cell = bent_cell()
    for turns in (0.0, -2.0 * np.pi):
        home = cell.robot.home.copy()
        home[5] += turns
        arm = Arm(replace(cell.robot, home=home), T_flange_tool=cell.tool.T_flange_tool)
        path = reach(level([[300.0, 0.0, 50.0], [305.0, 0.0, 50.0]]), arm, T_base_work=HERE)
        assert np.abs(path.joints[:, 5] - arm.robot.home[5]).max() < np.pi


def test_pose_beyond_the_arm_is_refused_with_place_and_distance() -> None:
    T_base_work = transforms.rigid(np.eye(3), np.array([900.0, 0.0, 0.0]))
    with pytest.raises(ReachError, match=r"run 1 at \(50\.0, 1\.0, 2\.0\) mm \(base \(950\.0.*out of reach") as caught:
        reach(level([[50.0, 1.0, 2.0]]), arm_of(straight_cell()), T_base_work=T_base_work)
    assert caught.value.details["share"] == 0.0
    assert caught.value.details["run"] == 0
    assert "allowed is 40 to 580 mm" in str(caught.value)
    assert "another nozzle" in str(caught.value)


def test_pose_beyond_a_joint_limit_is_refused_with_joint_and_range() -> None:
    # Straight down close to the base: the forearm would have to fold beyond joint 3's 70 degrees or joint 5's 120.
    with pytest.raises(ReachError, match=r"needs joint [1-5] at .* degrees, allowed is -?\d+ to \d+"):
        reach(level([[120.0, 0.0, 50.0]]), arm_of(straight_cell()), T_base_work=HERE)


def test_share_of_poses_reached_is_counted() -> None:
    tips = [[350.0, 0.0, 200.0], [352.0, 0.0, 200.0], [354.0, 0.0, 200.0], [1350.0, 0.0, 200.0]]
    with pytest.raises(ReachError, match="reaches 3 of 4 poses") as caught:
        reach(level(tips), arm_of(straight_cell()), T_base_work=HERE)
    assert caught.value.details["share"] == 0.75


AHEAD = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def test_wrist_singularity_is_refused_on_deposit_and_passed_on_travel() -> None:
    # The arm at zero with a straight nozzle: joints 4 and 6 lie in one line.
    arm = arm_of(straight_cell())
    tips = np.array([[534.0, 0.0, 630.0]])
    with pytest.raises(ReachError, match=r"wrist singularity: joint 5 at 0\.0 degrees, at least 5\.0"):
        reach(stream(tips, AHEAD[None]), arm, T_base_work=HERE)
    travel = reach(stream(tips, AHEAD[None], deposit=False), arm, T_base_work=HERE)
    assert travel.smallest_wrist_angle < 1e-6
    reach(stream(tips, AHEAD[None]), arm, T_base_work=HERE, minimum_wrist_angle=0.0)


def test_wrist_flip_on_travel_is_refused() -> None:
    # Travel sideways through the singularity: joint 4 would have to turn from one side to the other at once.
    aside = np.linspace(-20.0, 20.0, 41)
    attitudes = np.tile(AHEAD, (41, 1, 1))
    arm = arm_of(straight_cell())
    past = stream(np.column_stack([np.full(41, 534.0), aside, np.full(41, 500.0)]), attitudes, deposit=False)
    reach(past, arm, T_base_work=HERE)
    through = stream(np.column_stack([np.full(41, 534.0), aside, np.full(41, 630.0)]), attitudes, deposit=False)
    with pytest.raises(ReachError, match=r"flips the wrist: joint [46] turns by"):
        reach(through, arm, T_base_work=HERE)


def test_straight_move_that_cannot_be_followed_is_refused_though_both_ends_are_reached() -> None:
    arm = arm_of(straight_cell())
    ends = [[0.0, -350.0, 200.0], [0.0, 350.0, 200.0]]
    for end in ends:
        reach(level([end], deposit=False), arm, T_base_work=HERE)
    with pytest.raises(ReachError):
        reach(level(ends, deposit=False), arm, T_base_work=HERE)


def test_smaller_limits_are_kept_by_another_turn_about_the_nozzle() -> None:
    cell = bent_cell()
    poses = level([[x, 0.0, 50.0] for x in range(280, 321)])
    limits, home = cell.robot.limits.copy(), cell.robot.home.copy()
    limits[5], home[5] = np.radians([-120.0, 120.0]), 0.0
    narrow = Arm(replace(cell.robot, limits=limits, home=home), T_flange_tool=cell.tool.T_flange_tool)
    free = reach(poses, arm_of(cell), T_base_work=HERE)
    assert np.degrees(np.abs(free.joints[:, 5])).max() > 120.0
    assert_holds(reach(poses, narrow, T_base_work=HERE), poses, narrow)


def test_solution_that_forward_kinematics_does_not_confirm_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    truth = Arm.tool_poses

    def shifted(self: Arm, joints: FloatArray) -> FloatArray:
        return truth(self, joints) + np.array([[0, 0, 0, 0.01], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]])

    arm = arm_of(straight_cell())
    monkeypatch.setattr(Arm, "tool_poses", shifted)
    with pytest.raises(VerificationError, match=r"misses the commanded pose by 0\.01 mm"):
        reach(level([[350.0, 0.0, 200.0]]), arm, T_base_work=HERE)


def test_empty_stream_is_refused() -> None:
    nothing = stream(np.empty((0, 3)), np.empty((0, 3, 3)))
    with pytest.raises(InputError, match="empty"):
        reach(nothing, arm_of(straight_cell()), T_base_work=HERE)
