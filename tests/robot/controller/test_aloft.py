"""The path of a dry run: higher, on the same branch, with a descent to each later run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import ClearanceError, InputError, ReachError
from geoprint.model import Box, FloatArray, Flood, JointPath, Purge, Targets
from geoprint.robot.arm import Arm, configuration_data
from geoprint.robot.collision import clearance
from geoprint.robot.controller import LIFT, controller_path, lifted_joints, lifted_path, there_and_back
from geoprint.robot.controller.lifted import _course, _refuse_rounded_ends  # pyright: ignore[reportPrivateUsage]
from geoprint.robot.controller.targets import required_poses
from geoprint.robot.reach.keyframes import tool_poses
from geoprint.robot.timing import tips_at
from tests.meshes import plate
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import WORK, arm_of, solved, two_runs

CELL = bent_cell()
ARM = arm_of(CELL)
TURNED = WORK @ transforms.rigid(transforms.rotation_of(np.array([np.cos(0.1), np.sin(0.1), 0.0, 0.0])), np.zeros(3))


def path_and_targets(T_base_work: FloatArray = TURNED) -> tuple[JointPath, Targets]:
    path = solved(two_runs(), ARM, T_base_work=T_base_work)
    kept = np.union1d(required_poses(path.poses), np.arange(0, path.poses.count, 3))
    rests = path.poses.stops[kept] | (np.diff(path.poses.runs[kept], prepend=-1) != 0)
    return path, Targets(poses=kept, zones=np.where(rests, 0.0, 0.2), speeds=np.full(kept.size, 20.0))


def test_a_dry_run_is_the_same_path_20_mm_higher_in_the_base_frame() -> None:
    path, targets = path_and_targets()
    lifted, _ = lifted_path(path, targets, ARM)
    planned = transforms.apply(path.T_base_work, path.poses.tips[targets.poses])
    found = transforms.apply(lifted.T_base_work, lifted.poses.tips)
    first = int(np.flatnonzero(np.diff(path.poses.runs[targets.poses]))[0]) + 1
    np.testing.assert_allclose(found[:first] - planned[:first], [[0.0, 0.0, LIFT]] * first, atol=1e-9)
    np.testing.assert_allclose(
        found[first + 2 :] - planned[first:], [[0.0, 0.0, LIFT]] * (len(planned) - first), atol=1e-9
    )
    assert not lifted.poses.deposit.any()


def test_there_is_a_descent_to_the_first_target_of_each_later_run_and_up_again() -> None:
    path, targets = path_and_targets()
    lifted, dry_targets = lifted_path(path, targets, ARM)
    runs = path.poses.runs[targets.poses]
    first = int(np.flatnonzero(np.diff(runs))[0]) + 1
    tips = path.poses.tips[targets.poses]
    np.testing.assert_allclose(lifted.poses.tips[first], tips[first])
    np.testing.assert_allclose(lifted.poses.tips[first + 1], lifted.poses.tips[first - 1])
    assert dry_targets.poses.size == targets.poses.size + 2
    # Whoever resumes there goes on as the print does: with the same joints, not a turn away from them.
    np.testing.assert_allclose(lifted.joints[first], path.joints[targets.poses[first]], atol=1e-9)
    controller_path(lifted, dry_targets, ARM, step=2.0)


def test_each_of_several_later_runs_has_its_own_descent() -> None:
    rows, raised = _course(np.array([0, 0, 1, 1, 1, 2]))
    assert rows.tolist() == [0, 1, 2, 1, 2, 3, 4, 5, 4, 5]
    # Down to the first targets of runs 1 and 2; everything else is aloft.
    assert np.flatnonzero(~raised).tolist() == [2, 7]


def test_a_dry_run_rounds_its_corners_as_the_print_does() -> None:
    path, targets = path_and_targets()
    lifted, dry_targets = lifted_path(path, targets, ARM)
    first = int(np.flatnonzero(np.diff(path.poses.runs[targets.poses]))[0]) + 1
    np.testing.assert_array_equal(np.delete(dry_targets.zones, [first, first + 1]), targets.zones)
    np.testing.assert_array_equal(dry_targets.zones[[first, first + 1]], 0.0)
    rounded = controller_path(lifted, dry_targets, ARM, step=2.0)
    exact = controller_path(lifted, replace(dry_targets, zones=0.0 * dry_targets.zones), ARM, step=2.0)
    printed = controller_path(path, targets, ARM, step=2.0)
    assert np.abs(exact.rounding).max() < 1e-9
    assert np.abs(rounded.rounding).max() > 1e-5
    assert np.abs(rounded.rounding).max() == pytest.approx(np.abs(printed.rounding).max(), rel=0.2)


def test_a_run_that_does_not_begin_or_end_at_rest_is_refused() -> None:
    path, targets = path_and_targets()
    first = int(np.flatnonzero(np.diff(path.poses.runs[targets.poses]))[0]) + 1
    for row in (first - 1, first):
        zones = targets.zones.copy()
        zones[row] = 0.1
        with pytest.raises(InputError, match="does not stop at the start of run 2"):
            lifted_path(path, replace(targets, zones=zones), ARM)


@pytest.mark.parametrize(("rounded", "run"), [(1, 2), (2, 2), (3, 3), (4, 3)])
def test_the_run_that_does_not_begin_at_rest_is_named(rounded: int, run: int) -> None:
    zones = np.zeros(6)
    zones[rounded] = 0.1
    with pytest.raises(InputError, match=f"does not stop at the start of run {run}"):
        _refuse_rounded_ends(np.array([0, 0, 1, 1, 2, 2]), zones)


def test_a_dry_run_stays_on_the_branch_and_turn_of_the_path() -> None:
    path, targets = path_and_targets()
    lifted, _ = lifted_path(path, targets, ARM)
    assert np.abs(lifted.joints[0] - path.joints[0]).max() < 0.2
    assert np.abs(np.diff(lifted.joints, axis=0)).max() < 0.3
    assert lifted.branch == path.branch


def test_each_lifted_target_has_the_joints_that_the_inverse_gives_there() -> None:
    beside = TURNED @ transforms.rigid(Rotation.from_euler("z", -25, degrees=True).as_matrix(), np.zeros(3))
    path, targets = path_and_targets(beside)
    lifted, dry_targets = lifted_path(path, targets, ARM)
    found = lifted_joints(lifted, path, targets)
    lift = transforms.rigid(np.eye(3), np.array([0.0, 0.0, LIFT]))
    chosen = targets.poses
    joints = ARM.solutions(lift @ tool_poses(path.poses, T_base_work=beside)[chosen])[:, path.branch]
    joints = joints + 2.0 * np.pi * np.rint((path.joints[chosen] - joints) / (2.0 * np.pi))
    np.testing.assert_allclose(found, joints, atol=1e-9)
    # Printed, quadrants are others: the wrist turns where the arm rises.
    printed, dry = (configuration_data(each, arm=ARM) for each in (path.joints[chosen], found))
    assert (printed != dry).any()
    controller_path(lifted, dry_targets, ARM, step=2.0)


def test_a_descent_that_ends_with_other_joints_than_the_print_has_is_refused() -> None:
    path, targets = path_and_targets()
    turned = path.joints.copy()
    turned[path.poses.runs == 1, 5] += 2.0 * np.pi
    with pytest.raises(ReachError, match=r"run 2: resuming there, the arm .* joint 6 off .* by 360 degrees"):
        lifted_path(replace(path, joints=turned), targets, ARM)


def test_a_dry_run_out_of_reach_is_refused() -> None:
    places = [transforms.rigid(np.eye(3), np.array([330.0, 0.0, height])) for height in range(700, 100, -10)]
    reached = [np.isfinite(ARM.solutions(tool_poses(two_runs(), T_base_work=place))[:, 0]).all() for place in places]
    path = solved(two_runs(), ARM, T_base_work=places[int(np.argmax(reached))])
    kept = np.arange(path.poses.count)
    with pytest.raises(ReachError, match="at the height of the dry run"):
        lifted_path(path, Targets(poses=kept, zones=np.zeros(kept.size), speeds=np.full(kept.size, 20.0)), ARM)


def test_a_ceiling_that_only_the_dry_run_would_touch_is_found() -> None:
    path, targets = path_and_targets()
    surface = plate((60.0, 60.0), (20, 20))
    part = replace(surface, vertices=surface.vertices - np.array([30.0, 30.0, 0.3]))
    lifted, dry_targets = lifted_path(path, targets, ARM)
    dry = controller_path(lifted, dry_targets, ARM, step=2.0)

    def check(*obstacles: Box) -> float:
        return clearance(
            dry, ARM, tool=CELL.tool, process=CELL.process, T_base_work=TURNED, poses=lifted.poses, part=part,
            body=None,
            obstacles=obstacles,
        ).smallest  # fmt: skip

    assert check() > 1.0
    tip = transforms.apply(TURNED, lifted.poses.tips[5:6])[0]
    with pytest.raises(ClearanceError):
        check(Box("ceiling", tip + np.array([0.0, 0.0, 8.0]), np.array([4.0, 4.0, 4.0])))


def test_priming_goes_there_and_back_along_the_same_path() -> None:
    over_a_cup = CELL.robot.home + np.array([0.6, 0.1, 0.0, 0.0, 0.0, 0.0])
    path = there_and_back(over_a_cup, ARM, step=2.0)
    np.testing.assert_array_equal(path.joints, path.joints[::-1])
    np.testing.assert_array_equal(path.joints[0], CELL.robot.home)
    np.testing.assert_array_equal(path.joints[len(path.joints) // 2], over_a_cup)
    tips = Arm(CELL.robot, T_flange_tool=CELL.tool.T_flange_tool).tool_poses(path.joints)[:, :3, 3]
    assert np.linalg.norm(np.diff(tips, axis=0), axis=1).max() <= 2.0


def test_a_place_to_prime_outside_the_limits_is_refused() -> None:
    with pytest.raises(InputError, match="purge: the joints"):
        replace(CELL, purge=Purge(joints=np.full(6, 3.0), duration=1.0))
    with pytest.raises(InputError, match=r"flood: the joints .* over the part"):
        replace(CELL, flood=Flood(60.0, joints=np.full(6, 3.0)))


def test_the_tip_is_where_the_rows_say_and_between_them() -> None:
    joints = np.stack([CELL.robot.home, CELL.robot.home + 0.001])
    tips = tips_at(np.array([0.0, 0.001]), joints, ARM, T_base_work=WORK)
    ends = transforms.apply(transforms.inverse(WORK), ARM.tool_poses(joints)[:, :3, 3])
    found = tips(np.array([0.0, 0.0005, 0.001]))
    np.testing.assert_allclose(found[[0, 2]], ends, atol=1e-9)
    np.testing.assert_allclose(found[1], ends.mean(axis=0), atol=1e-3)
