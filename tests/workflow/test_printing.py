"""A plan over a tilting table: one verified program of all attitudes, and what is changed in it is found."""

from __future__ import annotations

import json
import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from benchmarks.programs.simulated import slowed
from geoprint import job_of, plan, transforms
from geoprint.config import TILTING_CELL, packaged_cell_text
from geoprint.errors import UsageError, VerificationError
from geoprint.geometry.files import ply_bytes
from geoprint.inspection.simulated import SimulatedPrint, simulated_print
from geoprint.model import FloatArray, Surface
from geoprint.positioner import table_machine
from geoprint.postprocessor import write_bundle
from geoprint.reporting import MOST_FRAMES
from geoprint.reporting.replaying import replay
from geoprint.reporting.run_sheet import check_text
from geoprint.results import Plan
from geoprint.robot.arm import Arm
from geoprint.simulation import Break, Faults
from geoprint.toolpath import check_sum
from geoprint.workflow.checking import check_bundle
from geoprint.workflow.placement import pose_stream, posed
from geoprint.workflow.saving import save_plan
from tests.meshes import cylinder_patch
from tests.shared_plans import SharedPlans
from tests.workflow.test_planted_faults import planted

# Of the paths on it [mm].
SPACING = 1.8


def cell(folder: Path) -> Path:
    """The packaged cell with a table, and the flow on an analog output."""
    text = packaged_cell_text(TILTING_CELL)
    text = text.replace('mode = "io"', 'mode = "analog"')
    for key in ('flow = "aoFlow"', "flow_per_mm3_s = 0.1", "flow_lag_s = 0.05"):
        text = text.replace(f"# {key}", key)
    path = folder / "cell.toml"
    path.write_text(text)
    return path


def part(folder: Path) -> Path:
    """A small arch: both of its sides overhang at rest, and no attitude prints both of them."""
    arch: Surface = cylinder_patch(radius=6.0, angle=1.4, length=6.0, divisions=(8, 6))
    path = folder / "arch.ply"
    path.write_bytes(ply_bytes(arch))
    return path


@pytest.fixture(scope="module")
def planned(shared_plans: SharedPlans, tmp_path_factory: pytest.TempPathFactory) -> Plan:
    return plan_of_the_arch(shared_plans, tmp_path_factory.mktemp("tilted"))


def plan_of_the_arch(shared_plans: SharedPlans, folder: Path) -> Plan:
    def make() -> Plan:
        job = job_of(surface=part(folder), unit="mm", spacing=SPACING, backend="heat", place="demo", cell=cell(folder))
        return plan(job)

    return shared_plans.value("an arch over a table", make)


def bundle_of_the_arch(shared_plans: SharedPlans, planned: Plan) -> Path:
    """The bundle of that plan, of which a copy is taken before it is changed."""
    return shared_plans.folder("an arch over a table, written", lambda folder: save_plan(planned, folder))


@pytest.fixture(scope="module")
def bundle(shared_plans: SharedPlans, planned: Plan) -> Path:
    return bundle_of_the_arch(shared_plans, planned)


@pytest.fixture(scope="module")
def simulated(bundle: Path) -> SimulatedPrint:
    return simulated_print(bundle, faults=Faults(), seed=0)


def test_every_attitude_has_its_own_placement_and_all_lay_the_paths_together(planned: Plan) -> None:
    assert planned.tilting is not None
    assert planned.joined is not None
    assert len(planned.robot) == len(planned.tilting.attitudes) > 1
    ups = [robot.placement.T_base_work[2, :3] for robot in planned.robot]
    np.testing.assert_allclose(ups, [one.up for one in planned.tilting.attitudes], atol=1e-9)
    check_sum(planned.poses, [robot.joint_path.poses for robot in planned.robot])
    assert planned.tilting.overhanging == 0.0
    for robot in planned.robot:
        assert robot.table_kept is not None
        assert robot.table_kept >= planned.workpiece.cell.process.clearance
        assert any("table's plate" in pair for pair in robot.clearance.checked)
        assert "how exactly the table reaches and holds its attitude" in robot.clearance.not_checked


def test_the_bundle_reads_back_and_what_is_changed_in_it_is_found(planned: Plan, bundle: Path, tmp_path: Path) -> None:
    checked = check_bundle(bundle)
    assert checked.findings == ()
    assert checked.joined is not None
    assert checked.joined.scenarios[:2] == ("dry", "printing")
    sheet = check_text(checked)
    assert "attitude by attitude" in sheet
    assert f"{len(planned.robot)} attitudes" in sheet
    assert json.loads((bundle / "plan.json").read_text())["joined"]["file"] == "rapid/GeoStack.pgf"
    swapped = tmp_path / "swapped"
    shutil.copytree(bundle, swapped)
    one, other = (swapped / "rapid" / f"part-{number}" / "GeoCell.mod" for number in (1, 2))
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)
    assert any("own program says" in finding.reason for finding in check_bundle(swapped).findings)
    thinner = tmp_path / "thinner"
    shutil.copytree(bundle, thinner)
    poses = thinner / "part-1" / "poses.csv"
    lines = poses.read_text().split("\n")
    poses.write_text("\n".join([*lines[:2], *lines[3:]]))
    assert any(finding.file.startswith("part-1/") for finding in check_bundle(thinner).findings)


@pytest.mark.slow
def test_a_plan_with_its_table_always_at_rest_is_found_by_a_check_that_has_the_same_fault(tmp_path: Path) -> None:
    with planted(("positioner.tilt_turn", "obstacles_at", "placement.table.T_table_plate", "np.eye(4)")):
        job = job_of(
            surface=part(tmp_path), unit="mm", spacing=SPACING, backend="heat", place="demo", cell=cell(tmp_path)
        )
        save_plan(plan(job), tmp_path / "wrong")
        found = check_bundle(tmp_path / "wrong", full=True).findings
    assert {finding.file for finding in found} == {"plan.json"}
    assert all("clearance" in finding.reason for finding in found)
    # Attitude by attitude, by what the check derives itself, and not only where it plans again.
    again = [finding.reason for finding in found if "checked again it is" in finding.reason]
    assert [reason[: len("robot.1")] for reason in again] == ["robot.1", "robot.2"]


def test_the_replay_lays_every_bead_under_the_tip_where_the_part_stands_then(planned: Plan) -> None:
    shown = replay(planned)
    assert shown.table is not None
    assert len(shown.table.turning) == len(planned.robot)
    assert shown.times.size <= MOST_FRAMES
    cell = planned.workpiece.cell
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    assert planned.workpiece.placement is not None
    T_base_rest = planned.workpiece.placement.T_base_work
    axes: list[FloatArray] = [np.interp(shown.bead_times, shown.times, each) for each in shown.joints.T]
    joints = np.column_stack(axes)
    tips = arm.tool_poses(joints)[:, :3, 3]
    frames = np.searchsorted(shown.table.times, shown.bead_times, side="right") - 1
    motions = shown.table.part[frames]
    placed = np.einsum("kij,kj->ki", motions[:, :, :3], shown.bead) + motions[:, :, 3]
    apart = np.linalg.norm(transforms.apply(T_base_rest, placed) - tips, axis=1)
    # The page's frames are 0.1 s apart, over which joints go straight.
    assert np.median(apart) < 0.1
    assert apart.max() < 1.0


def test_the_replay_moves_part_and_table_on_the_course_that_is_proven_and_in_its_time(planned: Plan) -> None:
    shown, tilting, noun = replay(planned).table, planned.tilting, planned.workpiece.cell.table
    assert shown is not None
    assert tilting is not None
    assert noun is not None
    assert planned.workpiece.placement is not None
    durations = np.diff(shown.turning, axis=1)[:, 0]
    np.testing.assert_allclose(durations, np.maximum(tilting.seconds, 0.1), atol=1e-9)
    table, T_base_rest = table_machine(noun), planned.workpiece.placement.T_base_work
    # Where the plate is in each frame, and the axes of the table there: even in time from attitude to attitude.
    works = T_base_rest @ transforms.rigid(shown.part[:, :, :3], shown.part[:, :, 3])
    T_work_plate = transforms.inverse(T_base_rest) @ table.T_base_table
    axes = table.axes(transforms.inverse(table.T_base_table) @ works @ T_work_plate)
    knots = np.array([np.zeros(2), *tilting.axes])
    times = np.concatenate([shown.turning[:1, 0], *shown.turning])[1:]
    course = np.concatenate([np.stack([one, other]) for one, other in pairwise(knots)])
    for axis in range(2):
        np.testing.assert_allclose(axes[:, axis], np.interp(shown.times, times, course[:, axis]), atol=1e-6)
    within = np.abs(np.diff(axes, axis=0)).sum(axis=1)
    assert within.max() < np.radians(5.01)
    # The beam of the table stands still, and its plate goes with the part.
    np.testing.assert_allclose(shown.solids[:, 2], shown.solids[:1, 2].repeat(len(axes), axis=0), atol=1e-6)
    assert np.abs(np.diff(shown.solids[:, 0], axis=0)).max() > 0.0


def test_poses_on_a_surface_that_was_prepared_before_are_the_same(planned: Plan) -> None:
    workpiece = planned.workpiece
    known = posed(workpiece)
    once, again = (
        pose_stream(planned.toolpath, workpiece, max_tilt_deg=planned.job.max_tilt, known=each)
        for each in (None, known)
    )
    for name in ("tips", "quaternions", "normals", "arcs"):
        np.testing.assert_array_equal(getattr(once, name), getattr(again, name))


def test_in_silico_all_attitudes_lay_together_what_the_runs_of_the_plan_ask_for(
    planned: Plan, simulated: SimulatedPrint
) -> None:
    printed, poses = simulated, planned.poses
    assert printed.runs.tolist() == np.unique(poses.runs[poses.deposit]).tolist()
    # Pieces of a run lie in several attitudes, and overlap: an output that follows the speed lays what is wanted, but
    # for what its lag takes from the start of each.
    assert len(planned.robot) > 1
    np.testing.assert_allclose(printed.deposited, printed.wanted, rtol=0.05)
    assert printed.beads.volumes.sum() == pytest.approx(printed.deposited.sum(), rel=1e-9)
    assert printed.bare.max() < 1.0
    np.testing.assert_allclose(printed.beside, 0.0, atol=0.02 * printed.wanted.min())
    # The pieces lie on the runs: no place is farther from the planned path than beads shift it.
    path = poses.surface_points[poses.deposit]
    apart = np.linalg.norm(printed.beads.places[::7, None] - path, axis=2).min(axis=1)
    steps = np.linalg.norm(np.diff(poses.surface_points, axis=0), axis=1)
    assert apart.max() < steps[poses.deposited].max()


def test_in_silico_an_edited_attitude_shows_and_an_edited_program_of_all_is_refused(
    bundle: Path, simulated: SimulatedPrint, tmp_path: Path
) -> None:
    folder, before = shutil.copytree(bundle, tmp_path / "arch"), simulated
    with pytest.raises(UsageError, match="breaks need one program"):
        simulated_print(folder, faults=Faults(breaks=(Break(0, 1.0, 2.0),)), seed=0)
    slow(folder / "part-2" / "rapid")
    after = simulated_print(folder, faults=Faults(), seed=0)
    # The flow follows the speed, so that nearly as much is laid as before, on the runs of this attitude alone.
    np.testing.assert_allclose(after.deposited, before.deposited, rtol=0.05)
    assert 0 < np.count_nonzero(np.abs(after.deposited - before.deposited) > 0.01) < after.runs.size
    slow(folder / "rapid" / "part-2")
    with pytest.raises(VerificationError, match="the attitudes' own programs are deposited: restore this"):
        simulated_print(folder, faults=Faults(), seed=0)


def slow(folder: Path) -> None:
    """Let the first run of the program in a folder go at half its speed."""
    modules = {path.name: path.read_text(encoding="latin-1") for path in sorted(folder.glob("*.mod"))}
    for name, text in slowed(modules, run=1, factor=2.0).items():
        (folder / name).write_text(text, encoding="latin-1")


def test_an_attitude_without_its_files_is_found_wrong(tmp_path: Path) -> None:
    write_bundle(
        tmp_path / "out", {"plan.json": b"{}\n", "part-1/poses.csv": b"x\n"}, overwrite=False, verify=lambda _: None
    )
    assert any("setup.json" in finding.file for finding in check_bundle(tmp_path / "out").findings)
