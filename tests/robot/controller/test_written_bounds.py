"""Written targets out of reach, dry runs a turn away, and what is told of moves that follow each other closely."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import ReachError
from geoprint.model import JointPath, Targets, Trajectory
from geoprint.robot.controller import controller_path, lifted_path, written_path
from geoprint.robot.controller.targets import close_targets, required_poses
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arm_of, line, solved, stream, two_runs

ARM = arm_of(bent_cell())
SHORT = solved(stream(line((0.0, 0.0, 0.0), (0.8, 0.0, 0.0), count=3)), ARM)


def targets_of(count: int, **changes: object) -> Targets:
    return replace(Targets(poses=np.arange(count), zones=np.zeros(count), speeds=np.full(count, 20.0)), **changes)


def test_a_path_whose_targets_stand_on_it_is_written_as_it_is() -> None:
    assert written_path(SHORT, targets_of(3), ARM) is SHORT


@pytest.mark.parametrize("out", [0, 1, 2])
def test_a_target_beside_the_path_that_is_out_of_reach_is_refused_by_its_run_and_place(out: int) -> None:
    places = SHORT.poses.tips.copy()
    places[out] = [2000.0, 0.0, 0.0]
    with pytest.raises(ReachError, match=r"run 1: the target beside the path at \[2000\.0, 0\.0, 0\.0\] mm is out"):
        written_path(SHORT, targets_of(3, moved=np.arange(3), places=places), ARM)


def test_lines_shorter_than_a_step_have_a_row_at_each_target_and_none_between() -> None:
    along = controller_path(SHORT, targets_of(3), ARM, step=0.5)
    assert int((along.runs >= 0).sum()) == 3


def dry_targets(path: JointPath) -> Targets:
    kept = required_poses(path.poses)
    kept = np.union1d(kept, np.flatnonzero(np.diff(path.poses.runs)))
    return Targets(poses=kept, zones=np.zeros(kept.size), speeds=np.full(kept.size, 20.0))


@pytest.mark.parametrize("turn", [0.0, -2.0 * np.pi])
def test_a_dry_run_20_mm_higher_stays_on_the_turn_of_the_path(turn: float) -> None:
    path = solved(two_runs(), ARM)
    turned = path.joints.copy()
    turned[:, 5] += turn
    path = replace(path, joints=turned)
    lifted, _ = lifted_path(path, dry_targets(path), ARM)
    assert np.abs(lifted.joints[0] - path.joints[0]).max() < 0.3
    assert lifted.poses.tips[0, 2] - path.poses.tips[0, 2] == pytest.approx(20.0)


def test_targets_a_period_apart_are_not_close_although_times_are_rounded() -> None:
    for share, close in ((1.0, 0), (1.0 - 9e-5, 0), (1.0 - 2e-4, 2)):
        times = 0.05 * share * np.arange(3.0)
        made = Trajectory(
            times=np.array([0.0, 0.001]), joints=np.zeros((2, 6)), runs=np.zeros(2, dtype=np.int64),
            deposit=np.zeros(2, np.bool_), pose_times=times, stretched=0, slowest_deposit=0.0, slowdowns=(),
            share_at_speed=0.0, share_on_ramps=0.0,
        )  # fmt: skip
        count, least = close_targets(targets_of(3), made, period=0.05)
        assert count == close
        assert least == pytest.approx(0.05 * share)
