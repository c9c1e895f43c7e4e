"""Plans on cells with other arms than ABB's: the packaged UR5e, and an arm whose inverse is iteration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint.config import UR_CELL, job_of
from geoprint.results import Plan
from geoprint.workflow import check_bundle, plan, save_plan
from geoprint.workflow.arm_cell import arm_cell
from geoprint.workflow.planning import BY_ITERATION
from tests.robot.arms import offset_wrist

PLATE = Path(__file__).parents[2] / "data" / "plate.ply"
DISC = {"patch": {"at": [0.0, 0.0, 0.0], "radius": 4.0}, "spacing": 4.0, "max_tilt": 0.0}


def planned_on(cell: Path) -> Plan:
    return plan(job_of(surface=PLATE, unit="mm", place="demo", cell=cell, **DISC))


@pytest.fixture(scope="module")
def on_ur5e() -> Plan:
    return planned_on(Path(UR_CELL))


def test_a_part_is_planned_on_the_cell_with_a_ur5e_named_alone(on_ur5e: Plan) -> None:
    (robot,) = on_ur5e.robot

    assert on_ur5e.workpiece.cell.name == "ur5e.toml"
    assert robot.clearance.smallest > 0.5
    assert robot.dry_clearance.smallest > 0.5
    moved = np.abs(np.diff(robot.trajectory.joints, axis=0)) / np.diff(robot.trajectory.times)[:, None]
    assert (moved <= 1.001 * on_ur5e.workpiece.cell.robot.speeds).all()
    assert BY_ITERATION not in robot.clearance.not_checked


def test_its_folder_is_written_verified_and_checked_without_quadrants(on_ur5e: Plan, tmp_path: Path) -> None:
    record = save_plan(on_ur5e, tmp_path / "out")

    assert record.robot[0].motion.quadrants == ()
    assert (tmp_path / "out" / "cell" / "ur5e.toml").is_file()
    assert check_bundle(tmp_path / "out").findings == ()


def test_an_arm_by_iteration_is_planned_and_says_that_solutions_may_be_missed(tmp_path: Path) -> None:
    shape = '<link name="{}"><collision><geometry><sphere radius="0.01"/></geometry></collision></link>'
    text = offset_wrist().urdf or ""
    for link in ("foot", *(f"piece_{joint}" for joint in range(1, 7))):
        text = text.replace(f'<link name="{link}"/>', shape.format(link))
    (tmp_path / "own.urdf").write_text(text, encoding="utf-8")
    for name, content in arm_cell(tmp_path / "own.urdf", flange="tool0").files.items():
        known = content.replace("# payload_kg", "payload_kg").replace("# wrist_inertia", "wrist_inertia")
        (tmp_path / name).write_text(known, encoding="utf-8")
    (robot,) = planned_on(tmp_path / "own.toml").robot
    assert BY_ITERATION in robot.clearance.not_checked
