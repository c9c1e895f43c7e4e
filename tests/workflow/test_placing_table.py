"""`geoprint place` over a table: the table goes with the part, and what is proposed is what a plan takes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint import transforms
from geoprint.config import Job, job_of
from geoprint.errors import UsageError
from geoprint.reporting import proposal_summary, proposal_text
from geoprint.reporting.placement import proposal_lines, table_lines
from geoprint.results import Plan, Proposal
from geoprint.robot.placing import FixturePose
from geoprint.workflow import plan, propose_placement
from geoprint.workflow.placement import paths_at
from geoprint.workflow.tilting import poses_at_rest, table_pose
from tests.shared_plans import SharedPlans
from tests.workflow.test_printing import SPACING, cell, part, plan_of_the_arch

# Of the packaged cell, and too far from the arm.
PART_LINE, TABLE_LINE = "demo_position_mm = [340, 0, 150]", "\nposition_mm = [340, 0, 120]\nrpy_deg = [0, 0, 90]\n"
FAR_PART, FAR_TABLE = "demo_position_mm = [620, 0, 150]", "\nposition_mm = [620, 0, 120]\nrpy_deg = [0, 0, 90]\n"
TURN_LINE = "# demo_rpy_deg = [0, 0, 0]"


def job(folder: Path, *changes: tuple[str, str]) -> Job:
    path = cell(folder)
    text = path.read_text()
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    path.write_text(text)
    return job_of(surface=part(folder), unit="mm", spacing=SPACING, backend="heat", place="demo", cell=path)


@pytest.fixture(scope="module")
def proposal(tmp_path_factory: pytest.TempPathFactory) -> Proposal:
    far = job(tmp_path_factory.mktemp("far"), (PART_LINE, FAR_PART), (TABLE_LINE, FAR_TABLE))
    return propose_placement(far)


@pytest.fixture(scope="module")
def paths(shared_plans: SharedPlans, tmp_path_factory: pytest.TempPathFactory) -> Plan:
    return plan_of_the_arch(shared_plans, tmp_path_factory.mktemp("paths"))


def test_the_lines_put_into_the_cell_file_give_the_plan_that_was_verified(proposal: Proposal, tmp_path: Path) -> None:
    assert proposal.table is not None
    assert not proposal.map_before.complete
    assert proposal.better
    position, turn = proposal_lines(proposal.pose)
    place, rpy = table_lines(proposal.table)
    planned = plan(job(tmp_path, (PART_LINE, position), (TURN_LINE, turn), (TABLE_LINE, f"\n{place}\n{rpy}\n")))
    assert len(planned.robot) == len(proposal.plan.robot) > 1
    for one, other in zip(planned.robot, proposal.plan.robot, strict=True):
        np.testing.assert_allclose(one.placement.T_base_work, other.placement.T_base_work, atol=1e-9)
        np.testing.assert_allclose(one.joint_path.joints, other.joint_path.joints, atol=1e-6)


def test_a_proposal_says_where_the_table_goes_and_in_how_many_attitudes_it_was_verified(proposal: Proposal) -> None:
    assert proposal.table is not None
    said = proposal_text(proposal)
    assert f"in {len(proposal.plan.robot)} attitudes of the table" in said
    assert "and under [table], which goes with the part:" in said
    record = proposal_summary(proposal)
    assert record["table"] == list(table_lines(proposal.table))
    # The table stands on something: it is as high as it was.
    assert proposal.table.position[2] == pytest.approx(120.0)
    # It goes with the part, the middle of its plate below the part's.
    assert proposal.table.position[:2].tolist() == pytest.approx(proposal.pose.position[:2].tolist(), abs=0.1)
    assert record["smallest_clearance_mm"] == pytest.approx(
        min(robot.clearance.smallest for robot in proposal.plan.robot), abs=1e-6
    )


def test_poses_as_seen_at_rest_are_where_the_arm_goes_in_each_attitude(paths: Plan) -> None:
    placement = paths.workpiece.placement
    assert placement is not None
    seen = poses_at_rest(paths, placement)
    deposited = np.flatnonzero(seen.deposit)
    there = transforms.apply(placement.T_base_work, seen.surface_points[deposited])
    robots = [(robot.placement.T_base_work, robot.joint_path.poses) for robot in paths.robot]
    places = np.concatenate([transforms.apply(T, poses.surface_points[poses.deposit]) for T, poses in robots])
    # Every place of the deposit is among those that the program prints at, which overlap where beads go on.
    far = [float(np.linalg.norm(places - one, axis=1).min()) for one in there]
    assert max(far) < 1e-6
    assert np.diff(seen.runs).min() >= 0


def test_part_and_table_move_as_one(paths: Plan) -> None:
    before = paths.workpiece.cell
    assert before.table is not None
    pose = FixturePose(np.array([300.0, 50.0, 150.0]), np.array([0.0, 0.0, 0.7]))
    there = paths_at(paths, pose).workpiece
    assert there.cell.table is not None
    assert there.placement is not None
    assert paths.workpiece.placement is not None
    held = transforms.inverse(before.table.T_base_table) @ paths.workpiece.placement.T_base_work
    now = transforms.inverse(there.cell.table.T_base_table) @ there.placement.T_base_work
    # Up to the rounding of what is told: a twentieth of a millimetre and of a degree.
    np.testing.assert_allclose(now, held, atol=0.15)
    np.testing.assert_allclose(there.cell.demo_position, pose.position)
    assert table_pose(there.cell.table).position.tolist() == pytest.approx(
        table_pose(there.cell.table).position.round(1).tolist()
    )


def test_a_table_tilts_the_part_itself(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="has a table that tilts the part itself: omit `--tilt`"):
        propose_placement(job(tmp_path), tilt_deg=10.0)
