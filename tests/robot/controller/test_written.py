"""Targets that stand beside the path: the joints there, and that whoever takes the planned ones is refused."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.model import JointPath, Targets
from geoprint.postprocessor import orders_of
from geoprint.robot.controller import controller_path, written_path, written_targets
from geoprint.robot.placing import demo_placement
from geoprint.robot.reach import tool_poses
from geoprint.robot.timing import retime
from tests.meshes import plate
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import arc, arm_of, solved, stream

CELL = bent_cell()
ARM = arm_of(CELL)


def bent() -> tuple[JointPath, Targets]:
    """Return a path that bends by 0.5 mm, and its targets, some of them beside it."""
    path = solved(stream(arc(radius=0.5, step=0.05, angle=2.0)), ARM)
    targets = written_targets(path, retime(path, CELL.robot, process=CELL.process), process=CELL.process)
    assert targets.moved.size > 0
    return path, targets


def test_a_written_path_has_the_targets_where_they_stand_with_the_joints_there() -> None:
    path, targets = bent()
    written = written_path(path, targets, ARM)
    rows = targets.poses[targets.moved]
    np.testing.assert_array_equal(written.poses.tips[rows], targets.places)
    found = ARM.tool_poses(written.joints)
    np.testing.assert_allclose(found, tool_poses(written.poses, T_base_work=path.T_base_work), atol=1e-6)
    others = np.setdiff1d(np.arange(path.poses.count), rows)
    np.testing.assert_array_equal(written.joints[others], path.joints[others])
    np.testing.assert_array_equal(
        controller_path(path, targets, ARM).joints, controller_path(written, targets, ARM).joints
    )


def test_orders_of_the_planned_path_are_refused_where_targets_stand_beside_it() -> None:
    path, targets = bent()
    surface = plate((10.0, 10.0), (4, 4))
    placement = demo_placement(surface, position=CELL.demo_position)
    trajectory = retime(path, CELL.robot, process=CELL.process)
    with pytest.raises(InputError, match="some targets stand beside them; give the path as it is written"):
        orders_of(
            JointPath(
                poses=path.poses, joints=path.joints, branch=path.branch,
                rotations=path.rotations, leans=path.leans, T_base_work=placement.T_base_work,
            ),
            targets, trajectory, placement=placement,
            lifted_joints=path.joints[targets.poses], extent=np.zeros((2, 3)),
        )  # fmt: skip
