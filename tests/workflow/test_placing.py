"""`geoprint place`: what it proposes is what a plan takes, and nothing is claimed to be measured."""

from __future__ import annotations

import json
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of, load_cell, packaged_cell_text
from geoprint.errors import PlanError, UsageError
from geoprint.geometry.files import save_ply
from geoprint.reporting import proposal_summary, proposal_text
from geoprint.reporting.placement import proposal_lines
from geoprint.results import Proposal
from geoprint.robot.placing import placement_search
from geoprint.workflow import best_placed, check_folder, job_from, plan, propose_placement, save_plan
from geoprint.workflow.placing import higher_home, room_of
from tests.meshes import spherical_cap

POSITION = "demo_position_mm = [300, 0, 50]"
TURN = "# demo_rpy_deg = [0, 0, 0]"


@pytest.fixture(scope="module", autouse=True)
def coarse_grid() -> Generator[None]:
    """Begin the search at fewer places: how good the best one is, is told in tests/robot/placing."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("GRID_STEP", 100.0), ("GRID_YAWS", 4), ("GRID_SPINS", 6), ("STARTS", 2)):
            patch.setattr(placement_search, name, value)
        yield


@pytest.fixture(scope="module")
def part(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("part") / "cap.ply"
    save_ply(spherical_cap(radius=40.0, angle=0.2, rings=5, jitter_seed=1), path)
    return path


def cell_file(folder: Path, *changes: tuple[str, str]) -> Path:
    text = packaged_cell_text("irb120-bent45")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "cell.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def proposal(part: Path, tmp_path_factory: pytest.TempPathFactory) -> Proposal:
    """Return what is proposed for a part that stands out of reach."""
    cell = cell_file(tmp_path_factory.mktemp("cell"), (POSITION, "demo_position_mm = [900, 0, 50]"))
    return propose_placement(job_of(surface=part, unit="mm", spacing=4.0, cell=cell))


def test_the_lines_put_into_the_cell_file_give_the_plan_that_was_verified(
    proposal: Proposal, part: Path, tmp_path: Path
) -> None:
    position, turn = proposal_lines(proposal.pose)
    cell = cell_file(tmp_path, (POSITION, position), (TURN, turn))
    planned = plan(job_of(surface=part, unit="mm", spacing=4.0, cell=cell, place="demo"))
    assert planned.robot
    np.testing.assert_allclose(
        planned.robot[0].placement.T_base_work, proposal.plan.robot[0].placement.T_base_work, atol=1e-9
    )
    np.testing.assert_allclose(planned.robot[0].joint_path.joints, proposal.plan.robot[0].joint_path.joints, atol=1e-9)


def test_the_proposal_says_before_after_and_that_nothing_is_calibrated(proposal: Proposal) -> None:
    said, record = proposal_text(proposal), json.loads(json.dumps(proposal_summary(proposal)))
    assert "where the cell file puts it: out of reach, refused" in said
    assert "NOT CALIBRATED" in said
    assert "not checked: 7 things; `--verbose` lists them" in said.splitlines()
    assert proposal_text(proposal, verbose=True).count("not checked: ") == 7
    assert record["calibrated"] is False
    assert record["better"] is True
    assert record["before"] == {
        "margin_deg": None, "limiting": "the arm's reach", "reached": False, "lost": 1.0,
        "lost_for": {"out_of_reach": 1.0}, "worst_places_mm": record["before"]["worst_places_mm"],
    }  # fmt: skip
    assert np.degrees(proposal.after.angle) > 20.0
    assert record["work"] == list(proposal_lines(proposal.pose))
    assert proposal.above >= 0.0


def test_a_calibrated_cell_is_told_to_touch_its_points_again(part: Path, tmp_path: Path) -> None:
    touched = (
        'source = "calibrated"\n'
        "model_mm = [[-50, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]]\n"
        "touched_mm = [[250, 50, 0], [350, 50, 0], [350, -50, 0], [250, -50, 0]]"
    )
    cell = cell_file(tmp_path, ('\nsource = "demo"', f"\n{touched}"))
    found = propose_placement(job_of(surface=part, unit="mm", rounds=3, cell=cell), height=50.0)
    assert "touch the points again" in proposal_text(found)
    assert found.placement.calibrated is False
    assert found.pose.position[2] == 50.0


def test_what_passes_nowhere_is_refused_with_the_reason(part: Path, tmp_path: Path) -> None:
    # Joint 5 held near zero: no nozzle but one along the forearm.
    narrow = ("[-120, 120], [-400", "[-6, 6], [-400")
    cell = cell_file(tmp_path, narrow, ("joints_deg = [0, 28, 20, 0, 87, 180]", "joints_deg = [0, 28, 20, 0, 6, 180]"))
    with pytest.raises(PlanError, match=r"cap\.ply has no placement in cell\.toml; .*candidates is refused: .*loses"):
        propose_placement(job_of(surface=part, unit="mm", rounds=3, cell=cell), height=50.0)


def test_a_higher_home_is_named_where_it_would_help(proposal: Proposal) -> None:
    low = replace(room_of(proposal.plan.workpiece), ceiling=0.0)
    assert "With a higher home, it is reachable at (" in higher_home(proposal.plan, low, height=None)
    assert higher_home(proposal.plan, low, height=50.0) == ""


def test_a_tilt_beyond_a_right_angle_is_refused(part: Path) -> None:
    with pytest.raises(UsageError, match="--tilt"):
        propose_placement(job_of(surface=part, unit="mm"), tilt_deg=120.0)


def test_a_turned_demonstration_is_read_from_the_cell(tmp_path: Path) -> None:
    cell = load_cell(cell_file(tmp_path, (TURN, "demo_rpy_deg = [0, 0, 90]")))
    assert cell.demo_rotation is not None
    np.testing.assert_allclose(cell.demo_rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)


def test_a_job_at_the_best_place_is_planned_where_place_proposes_it_and_its_bundle_says_where(
    part: Path, tmp_path: Path
) -> None:
    asked = job_of(surface=part, unit="mm", spacing=8.0, place="best")
    with pytest.raises(UsageError, match="find the placement 'best' before planning"):
        plan(asked)
    job = best_placed(asked)
    proposal = propose_placement(asked)
    assert proposal.better
    assert job.place == "demo"
    assert job.stand == [*proposal.pose.position.tolist(), *np.degrees(proposal.pose.rpy).round(1).tolist()]
    planned = plan(job)
    np.testing.assert_allclose(planned.robot[0].placement.T_base_work, proposal.placement.T_base_work, atol=1e-9)
    save_plan(planned, tmp_path / "out")
    assert not check_folder(tmp_path / "out").findings
    assert plan(job_from(tmp_path / "out")).robot[0].trajectory.duration == planned.robot[0].trajectory.duration
