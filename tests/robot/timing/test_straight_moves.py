"""One motion: the timed path keeps to the straight moves, where the tool turns far on one step as well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import LimitError
from geoprint.model import FloatArray, JointPath, Targets, Trajectory
from geoprint.robot.controller import written_targets
from geoprint.robot.timing import held_straight, off_moves, retime
from geoprint.robot.timing.knots import MOST_ROUNDED, Knots, path_knots, with_bulges
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arc, arm_of, line, solved, stream, tilted

CELL = bent_cell()
ARM = arm_of(CELL)
# Steps of 0.06 mm on which the tool turns by 1 degree each, then one of 0.5 mm and 10 degrees: a crease of a part.
STEPS = np.array([0.06] * 12 + [0.5] + [0.06] * 12)
TURNS = np.radians([1.0] * 12 + [10.0] + [0.0] * 12)


def crease() -> JointPath:
    arcs, angles = (np.append(0.0, np.cumsum(each)) for each in (STEPS, TURNS))
    tips = np.column_stack([arcs, np.zeros(arcs.size), np.zeros(arcs.size)])
    return solved(stream(tips, quaternions=tilted(angles - angles[-1] / 2.0)), ARM)


def off_line(path: JointPath, trajectory: Trajectory) -> tuple[FloatArray, FloatArray]:
    """Return how far the rows between first and last pose are from the line of the tips [mm], and from its plane."""
    rows = (trajectory.times > trajectory.pose_times[0]) & (trajectory.times < trajectory.pose_times[-1])
    found = transforms.inverse(path.T_base_work) @ ARM.tool_poses(trajectory.joints[rows])
    return np.linalg.norm(found[:, 1:3, 3], axis=1), found[:, 0, 3]


def timed(path: JointPath) -> Trajectory:
    return retime(path, CELL.robot, process=CELL.process)


def test_a_crease_is_passed_on_the_line_between_its_poses_and_nowhere_else() -> None:
    path = crease()
    held = held_straight(path, ARM, process=CELL.process)
    assert off_line(path, timed(path))[0].max() > 0.05
    assert off_line(held, timed(held))[0].max() < 0.0065
    assert 0 < held.via_rows.size < 16
    # The poses are what they were, and each is passed.
    np.testing.assert_array_equal(held.joints, path.joints)
    assert held.poses is path.poses
    assert timed(held).pose_times.size == path.poses.count


def test_via_points_lie_on_their_moves_with_the_attitude_of_a_constant_turn() -> None:
    path = crease()
    held = held_straight(path, ARM, process=CELL.process)
    found = transforms.inverse(path.T_base_work) @ ARM.tool_poses(held.via_joints)
    step = held.via_rows.astype(np.int64)
    share = held.via_rows - step
    arcs, angles = (np.append(0.0, np.cumsum(each)) for each in (STEPS, TURNS))
    np.testing.assert_allclose(found[:, 0, 3], arcs[step] + share * STEPS[step], atol=1e-6)
    np.testing.assert_allclose(found[:, 1:3, 3], 0.0, atol=1e-6)
    meant = angles[step] + share * TURNS[step] - angles[-1] / 2.0
    quaternions = np.roll(Rotation.from_matrix(found[:, :3, :3]).as_quat(), 1, axis=1)
    wanted = tilted(meant)
    signs = np.sign((quaternions * wanted).sum(axis=1, keepdims=True))
    np.testing.assert_allclose(signs * quaternions, wanted, atol=1e-6)


def test_a_path_that_keeps_to_its_moves_has_no_via_points() -> None:
    tips = line((0.0, 0.0, 0.0), (20.0, 0.0, 0.0), count=41)
    path = solved(stream(tips, quaternions=tilted(np.linspace(0.0, 0.2, 41))), ARM)
    assert held_straight(path, ARM, process=CELL.process) is path


def test_a_part_of_a_path_keeps_its_own_via_points() -> None:
    held = held_straight(crease(), ARM, process=CELL.process)
    part = held.between(10, 20)
    inside = (held.via_rows > 10) & (held.via_rows < 19)
    np.testing.assert_array_equal(part.via_rows, held.via_rows[inside] - 10)
    np.testing.assert_array_equal(part.via_joints, held.via_joints[inside])
    assert not held.between(0, 2).via_rows.size


def test_what_is_off_the_written_moves_is_found_all_along_and_refused() -> None:
    path = crease()
    held = held_straight(path, ARM, process=CELL.process)
    trajectory = timed(held)
    targets = written_targets(held, trajectory, process=CELL.process)
    found = off_moves(trajectory, held, targets, ARM)
    assert 0.0 < found.distance < 0.015
    assert 0.0 < found.turn < np.radians(0.15)
    loose = timed(path)
    with pytest.raises(LimitError, match=r"run 1: at .* the timed path is .* mm and .* degrees from the written move"):
        off_moves(loose, path, written_targets(path, loose, process=CELL.process), ARM)


def test_what_the_timed_path_bulges_is_taken_off_what_targets_may_leave_out() -> None:
    radius, step = 10.0, 0.31
    path = solved(stream(arc(radius=radius, step=step, angle=1.5)), ARM)
    bulged = with_bulges(path, ARM, process=CELL.process)
    # Poses past a move of three steps are within 0.01 mm of it, and the circle is not.
    # The timed path goes round the circle, the moves along its chords: but for ends that is step^2 / (8 radius).
    inner = slice(4, -5)
    np.testing.assert_allclose(bulged.bulges[inner, 0], step**2 / (8.0 * radius), rtol=0.1)
    trajectory = timed(path)
    without, targets = (written_targets(each, trajectory, process=CELL.process) for each in (path, bulged))
    before, found = (off_moves(trajectory, path, each, ARM) for each in (without, targets))
    assert found.distance < 0.01 < before.distance
    assert targets.poses.size > without.poses.size


def test_a_motion_along_a_steep_turn_is_compared_with_the_place_that_is_nearest_by_tip_and_attitude() -> None:
    # The tool turns by 20 degrees a millimetre: 0.005 mm along the move are 0.1 degrees.
    tips = line((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), count=41)
    path = solved(stream(tips, quaternions=tilted(np.radians(np.linspace(-20.0, 20.0, 41)))), ARM)
    trajectory = timed(path)
    targets = Targets(poses=np.arange(41), zones=np.zeros(41), speeds=np.full(41, 20.0))
    exact = off_moves(trajectory, path, targets, ARM)
    ahead = replace(path, poses=replace(path.poses, tips=tips + np.array([0.005, 0.0, 0.0])))
    found = off_moves(trajectory, ahead, targets, ARM)
    # The place is 0.005 mm away by the tip, by the attitude 0.1 degrees; of shares of 0.02 mm and 0.2 degrees the
    # larger is least where both are a sixth. At the ends of the path the tip is off by all of it.
    assert found.distance == pytest.approx(0.005, abs=0.0005)
    assert exact.turn < np.radians(0.015)
    assert found.turn == pytest.approx(np.radians(0.2 / 6.0), abs=np.radians(0.01))
    # What is turned about another axis is turned at every place of the move.
    twist = Rotation.from_euler("z", 0.15, degrees=True) * Rotation.from_quat(path.poses.quaternions, scalar_first=True)
    aside = replace(path, poses=replace(path.poses, quaternions=twist.as_quat(scalar_first=True)))
    assert off_moves(trajectory, aside, targets, ARM).turn == pytest.approx(np.radians(0.15), abs=np.radians(0.01))


def test_a_motion_is_off_by_as_much_as_its_targets_are_moved() -> None:
    tips = line((0.0, 0.0, 0.0), (20.0, 0.0, 0.0), count=41)
    path = solved(stream(tips), ARM)
    trajectory = timed(path)
    targets = Targets(poses=np.array([0, 20, 40]), zones=np.zeros(3), speeds=np.full(3, 20.0))
    moved = path.poses.tips.copy()
    moved[20, 1] += 0.015
    aside = replace(path, poses=replace(path.poses, tips=moved))
    assert off_moves(trajectory, path, targets, ARM).distance < 0.001
    assert off_moves(trajectory, aside, targets, ARM).distance == pytest.approx(0.015, abs=0.001)


# The length of a path that is timed: what is one place, how turns count, and where the tip alone is the length.


PROCESS = replace(bent_cell().process, speed=20.0, travel_speed=60.0)


def path_of(tips: FloatArray, angles: FloatArray, *, deposited: bool, joints: FloatArray | None = None) -> JointPath:
    """Return the path of a tool that leans by angles [rad] along a flat surface."""
    count = len(tips)
    poses = stream(tips, quaternions=tilted(angles), deposit=np.full(count, deposited))
    return JointPath(
        poses=replace(poses, normals=np.tile([0.0, 0.0, 1.0], (count, 1))),
        joints=np.zeros((count, 6)) if joints is None else joints,
        branch=0, rotations=np.zeros(count), leans=np.zeros((count, 2)), T_base_work=np.eye(4),
    )  # fmt: skip


def knots_of(step: float, turn: float, *, deposited: bool) -> Knots:
    """Return the knots of three poses a step [mm] and a turn [rad] apart."""
    tips = line((0.0, 0.0, 0.0), (2.0 * step, 0.0, 0.0), count=3)
    return path_knots(path_of(tips, turn * np.arange(3.0), deposited=deposited), process=PROCESS)


def test_on_travel_a_radian_counts_as_10_mm_beside_the_way_of_the_tip() -> None:
    found = knots_of(4.0, 0.3, deposited=False)
    np.testing.assert_allclose(found.lengths, [0.0, 0.005, 0.010])
    np.testing.assert_allclose(found.bead_shares, 0.8)
    np.testing.assert_allclose(found.ceilings, 0.06 / 0.8)


def test_a_tool_that_turns_on_the_spot_moves_on_and_its_tip_sets_no_ceiling() -> None:
    found = knots_of(0.0, 0.3, deposited=False)
    np.testing.assert_allclose(found.lengths, [0.0, 0.003, 0.006])
    assert np.isinf(found.ceilings).all()


@pytest.mark.parametrize(("step", "alone"), [(0.0303, True), (0.0297, False)])
def test_where_material_is_laid_the_tip_alone_is_the_length_down_to_a_hundredth(step: float, *, alone: bool) -> None:
    """A turn of 0.3 rad is as long as 3 mm, a hundredth of which is 0.03 mm."""
    found = knots_of(step, 0.3, deposited=True)
    np.testing.assert_allclose(np.diff(found.lengths), 1e-3 * (step if alone else np.hypot(step, 3.0)))
    assert np.isclose(found.bead_shares, 1.0, rtol=1e-12).all() == alone


def test_one_step_that_all_but_turns_on_the_spot_takes_its_whole_leg_with_it() -> None:
    tips = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.001, 0.0, 0.0]])
    found = path_knots(path_of(tips, np.array([0.0, 0.3, 0.6]), deposited=True), process=PROCESS)
    np.testing.assert_allclose(np.diff(found.lengths), [0.005, 0.003], rtol=1e-6)


@pytest.mark.parametrize(("jump", "refused"), [(0.9e-8, False), (1.1e-8, True)])
def test_joints_may_differ_by_a_hundred_millionth_of_a_radian_at_one_place(jump: float, *, refused: bool) -> None:
    joints = np.zeros((3, 6))
    joints[1:, 3] = jump
    path = path_of(
        np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), np.zeros(3), deposited=True, joints=joints
    )
    if refused:
        with pytest.raises(LimitError, match=r"run 1, pose 1: joint 4 jumps by 1\.1e-08 rad"):
            path_knots(path, process=PROCESS)
    else:
        assert path_knots(path, process=PROCESS).places.tolist() == [0, 0, 1]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_bead_keeps_the_speed_so_that_the_tip_is_faster_over_a_bulge_and_slower_in_a_hollow(side: float) -> None:
    """A circle of 5 mm on the surface is one of 5.3 mm for the tip outside of it, of 4.7 mm inside."""
    outward = side * arc(radius=1.0, step=0.02)
    tips = 5.0 * side * outward + 0.3 * outward
    path = path_of(tips, np.zeros(len(tips)), deposited=True)
    found = path_knots(replace(path, poses=replace(path.poses, normals=outward)), process=PROCESS)
    share = 5.0 / (5.0 + 0.3 * side)
    np.testing.assert_allclose(found.lengths, 1e-3 * path.poses.arcs, rtol=1e-12)
    np.testing.assert_allclose(found.bead_shares, share, rtol=1e-9)
    np.testing.assert_allclose(found.ceilings, 0.02 / share, rtol=1e-9)


def test_on_travel_the_speed_is_that_of_the_tip() -> None:
    outward = arc(radius=1.0, step=0.02)
    path = path_of(5.3 * outward, np.zeros(len(outward)), deposited=False)
    found = path_knots(replace(path, poses=replace(path.poses, normals=outward)), process=PROCESS)
    np.testing.assert_allclose(found.bead_shares, 1.0, rtol=1e-12)
    np.testing.assert_allclose(found.ceilings, 0.06, rtol=1e-12)


def driven(tips: FloatArray, joints: FloatArray, *, response: float, deposited: bool = True) -> FloatArray:
    """Return the joints of a path with level tool as the arm drives them."""
    knots = path_knots(path_of(tips, np.zeros(len(tips)), deposited=deposited, joints=joints), process=PROCESS)
    return knots.driven_joints(0, len(tips) - 1, response=response)


def test_a_wave_of_joints_is_driven_as_its_mean_over_the_response() -> None:
    """The mean of a sine of wave number k over a length w is the sine times sin(k w / 2) / (k w / 2)."""
    x, k = np.linspace(0.0, 6.0, 601), 2.0 * np.pi
    joints = 1e-4 * np.sin(k * x)[:, None] * np.arange(1.0, 7.0)
    found = driven(np.column_stack([x, 0.0 * x, 0.0 * x]), joints, response=0.01)
    inner = slice(20, -20)
    # 10 ms at 20 mm/s are 0.2 mm.
    np.testing.assert_allclose(found[inner], joints[inner] * np.sinc(0.2), rtol=1e-4, atol=1e-10)
    np.testing.assert_array_equal(found[[0, -1]], joints[[0, -1]])


def test_without_a_response_on_travel_and_along_straight_lines_joints_stay() -> None:
    x = np.linspace(0.0, 6.0, 601)
    tips, wave = np.column_stack([x, 0.0 * x, 0.0 * x]), np.tile(1e-3 * np.sin(9.0 * x)[:, None], 6)
    np.testing.assert_array_equal(driven(tips, wave, response=0.0), wave)
    np.testing.assert_array_equal(driven(tips, wave, response=0.01, deposited=False), wave)
    straight = np.tile(0.1 * x[:, None], 6)
    np.testing.assert_allclose(driven(tips, straight, response=0.01), straight, atol=1e-12)


def test_a_corner_is_rounded_by_less_than_it_may_be_however_long_the_arm_takes() -> None:
    x = np.linspace(-3.0, 3.0, 601)
    tips = np.column_stack([x, np.abs(x), 0.0 * x])
    # The joints follow the tip: what they turn less is what the tip is moved.
    joints = np.column_stack([np.abs(x) * 1e-3] + [0.0 * x] * 5)
    for response in (0.002, 0.05):
        moved = 1e3 * np.abs(driven(tips, joints, response=response) - joints).max()
        assert 0.5 * MOST_ROUNDED < moved <= MOST_ROUNDED
