"""The whole chain on real parts: what a plan promises, measured on what it leaves behind."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of, load_cell, packaged_cell_text
from geoprint.errors import ClearanceError, InputError, LimitError, ReachError, UsageError, VerificationError
from geoprint.geometry import edge_lengths
from geoprint.geometry.files import load, save_ply
from geoprint.metrics import printed
from geoprint.model import PrintErrors, Slowdown, Surface
from geoprint.postprocessor import read_poses_table, read_trajectory_table
from geoprint.reporting import (
    PlanRecord,
    as_json,
    comparison_table,
    outcome_text,
    record_plan,
    recorded_comparison,
    summary,
)
from geoprint.reporting.records.comparison import PartRecord
from geoprint.results import Plan, Planned, RobotPlan
from geoprint.robot.arm import Arm, tilts
from geoprint.toolpath import largest_lean
from geoprint.transforms import inverse, rigid, rotation_angle, rotation_of
from geoprint.workflow import compare, plan, save_comparisons, save_plan
from geoprint.workflow.saving import verify_files
from tests.meshes import bent_plate, cylinder_patch, folded_plate, plate, sphere, spherical_cap, torus
from tests.shared_data import shared

LIMITS_DEG = np.array([[-165, 165], [-110, 110], [-110, 70], [-160, 160], [-120, 120], [-400, 400]])


def saved(tmp_path: Path, surface: Surface) -> Path:
    path = tmp_path / f"{surface.name}.ply"
    save_ply(surface, path)
    return path


def robot_of(planned: Plan) -> RobotPlan:
    (robot,) = planned.robot
    return robot


@pytest.fixture(scope="module")
def cap_plan(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    path = saved(tmp_path_factory.mktemp("cap"), spherical_cap(radius=30.0, angle=0.25, rings=6, jitter_seed=1))
    return plan(job_of(surface=path, unit="mm", spacing=1.5, place="demo"))


@pytest.fixture(scope="module")
def cap_bundle(cap_plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, PlanRecord]:
    """Return the bundle of the cap, which nobody changes, and what is told of it."""
    out = tmp_path_factory.mktemp("cap-bundle") / "out"
    return out, save_plan(cap_plan, out)


def test_forward_kinematics_return_every_commanded_pose(cap_plan: Plan) -> None:
    robot, cell = robot_of(cap_plan), cap_plan.workpiece.cell
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    commanded = robot.placement.T_base_work @ rigid(rotation_of(cap_plan.poses.quaternions), cap_plan.poses.tips)
    found = arm.tool_poses(robot.joint_path.joints)
    assert np.linalg.norm(found[:, :3, 3] - commanded[:, :3, 3], axis=1).max() < 1e-3
    assert rotation_angle(inverse(found)[:, :3, :3] @ commanded[:, :3, :3]).max() < 1e-5


def test_print_is_expected_with_the_attitudes_that_are_commanded(cap_plan: Plan) -> None:
    assert cap_plan.uniformity is not None
    assert cap_plan.printed is not None
    layer, measured = cap_plan.uniformity.layer(follows=False), cap_plan.uniformity
    found = printed(*layer, measured, PrintErrors(), poses=cap_plan.poses)
    assert cap_plan.printed.variances == found.variances
    # The tool turns and leans from run to run, so that a bent needle counts, among what the flow and the arm vary.
    assert cap_plan.printed.shares["needle_runout"] > 5e-4
    assert printed(*layer, measured, PrintErrors()).shares["needle_runout"] == 0.0


def test_the_written_trajectory_keeps_speeds_and_accelerations_and_goes_from_home_to_home(
    cap_plan: Plan, cap_bundle: tuple[Path, PlanRecord]
) -> None:
    table = read_trajectory_table(cap_bundle[0] / "trajectory.csv")
    robot = cap_plan.workpiece.cell.robot
    np.testing.assert_allclose(np.diff(table.times), 0.001, atol=1e-9)
    speeds = np.diff(table.joints, axis=0) / 0.001
    accelerations = np.diff(speeds, axis=0) / 0.001
    assert (np.abs(speeds).max(axis=0) <= 1.01 * robot.speeds).all()
    assert (np.abs(accelerations).max(axis=0) <= 1.01 * robot.accelerations).all()
    assert (np.degrees(table.joints) >= LIMITS_DEG[:, 0]).all()
    assert (np.degrees(table.joints) <= LIMITS_DEG[:, 1]).all()
    np.testing.assert_allclose(table.joints[[0, -1]], np.tile(robot.home, (2, 1)), atol=1e-8)


def test_the_bead_keeps_the_speed_of_the_print(cap_plan: Plan) -> None:
    trajectory, cell = robot_of(cap_plan).trajectory, cap_plan.workpiece.cell
    # The tip stands 0.3 mm over a sphere of 30 mm.
    farther = 30.3 / 30.0
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    rows = slice(2000, 6000)
    tips = arm.tool_poses(trajectory.joints[rows])[:, :3, 3]
    speeds = np.linalg.norm(np.diff(tips, axis=0), axis=1) / 0.001
    deposited = trajectory.deposit[rows][:-1]
    assert speeds[deposited].max() <= 1.015 * farther * cell.process.speed
    assert np.median(speeds[deposited]) == pytest.approx(farther * cell.process.speed, rel=0.005)


def test_poses_csv_holds_surface_points_normals_and_closed_runs(cap_bundle: tuple[Path, PlanRecord]) -> None:
    table = read_poses_table(cap_bundle[0] / "poses.csv")
    deposited = table.deposit
    radii = np.linalg.norm(table.points, axis=1)
    assert np.abs(radii[deposited] - 30.0).max() < 0.2
    outward = table.points[deposited] / radii[deposited, None]
    assert np.einsum("ij,ij->i", outward, table.normals[deposited]).min() > np.cos(np.radians(3.0))
    for run in np.unique(table.runs[deposited]):
        rows = deposited & (table.runs == run)
        np.testing.assert_allclose(table.points[rows][0], table.points[rows][-1], atol=1e-5)


def test_plan_json_says_what_was_planned(cap_plan: Plan, cap_bundle: tuple[Path, PlanRecord]) -> None:
    found = json.loads((cap_bundle[0] / "plan.json").read_text())
    assert found["settings"]["spacing_mm"] == 1.5
    assert found["settings"]["backend"] == "heat"
    assert found["surface"]["topology"] == "disc"
    assert found["paths"]["runs"] == cap_plan.toolpath.curves.count
    assert found["robot"][0]["clearance"]["not_checked"]
    periods = np.diff(robot_of(cap_plan).trajectory.pose_times[robot_of(cap_plan).targets.poses])
    assert found["robot"][0]["motion"]["targets"]["period_ms"] == 20.0
    assert found["robot"][0]["motion"]["targets"]["closer"] == (periods < 0.02 - 1e-9).sum()
    assert found["robot"][0]["motion"]["targets"]["shortest_ms"] == pytest.approx(1e3 * periods.min(), abs=1e-5)
    # None comes so soon that a controller does not take it at all: something to know, not to act on.
    assert any("after the previous one" in note for note in found["notes"])
    assert cap_plan.uniformity is not None
    assert found["uniformity"]["thickness"]["cv"] == pytest.approx(cap_plan.uniformity.thickness.cv, abs=1e-6)
    assert cap_plan.uniformity.levels is not None
    assert found["uniformity"]["levels"]["spacing"]["cv"] == pytest.approx(
        cap_plan.uniformity.levels.figures.cv, abs=1e-6
    )
    # It was asked for: no news.
    assert any("placement unknown" in note for note in found["notes"])
    # Warnings are to act on; what only informs stands beside them, and a person reads both in this order.
    assert cap_plan.workpiece.side.sentence in found["notes"]
    assert not {*found["notes"]} & {*found["warnings"]}
    said = [line.partition(": ")[0] for line in outcome_text(record_plan(cap_plan)).splitlines()]
    minded = ["warning"] * len(found["warnings"]) + ["note"] * len(found["notes"]) + ["not checked"]
    assert said[-len(minded) :] == minded
    assert len(found["input"]["sha256"]) == 64


def test_a_cell_with_switched_signals_lays_a_constant_flow_and_both_layers_are_told(cap_plan: Plan) -> None:
    assert cap_plan.deposited is not None
    assert cap_plan.uniformity is not None
    deposited = cap_plan.poses.deposit
    np.testing.assert_allclose(cap_plan.poses.flow[deposited], 1.5 * 0.5)
    found, even = (summary(cap_plan)[name] for name in ("deposition", "uniformity"))
    assert isinstance(found, dict)
    assert isinstance(even, dict)
    assert found["flow"] == "constant"
    for name, layer in (("thickness", cap_plan.uniformity.thickness), ("following", cap_plan.uniformity.followed)):
        record = even[name]
        assert isinstance(record, dict)
        assert record["cv"] == pytest.approx(layer.cv, abs=1e-6)
        # The innermost ring alone is off, by a sixth.
        assert layer.cv < 0.02
        assert layer.within_5_percent > 0.97
    assert cap_plan.uniformity.thickness != cap_plan.uniformity.followed


def test_a_cell_with_an_analog_signal_lays_a_flow_that_follows_the_width(tmp_path: Path) -> None:
    cell = tmp_path / "analog.toml"
    analog = 'mode = "analog"\nflow = "aoFlow"\nflow_per_mm3_s = 0.1'
    cell.write_text(packaged_cell_text("irb120-bent45").replace('mode = "io"', analog), encoding="utf-8")
    part = saved(tmp_path, spherical_cap(radius=10.0, angle=1.0, rings=6, jitter_seed=1))
    planned = plan(job_of(surface=part, unit="mm", spacing=2.0, backend="lscm", cell=cell, robot=False))
    assert planned.deposited is not None
    np.testing.assert_array_equal(planned.poses.flow, planned.deposited.following_flow)
    assert planned.uniformity is not None
    constant, following = planned.uniformity.thickness, planned.uniformity.followed
    assert following.cv < constant.cv / 3
    # It puts down what the surface holds.
    assert following.mean == pytest.approx(1.0, abs=1e-3)
    assert following.within_5_percent > constant.within_5_percent + 0.4
    save_plan(planned, tmp_path / "out")
    np.testing.assert_allclose(read_poses_table(tmp_path / "out" / "poses.csv").flow, planned.poses.flow, atol=1e-9)


def test_a_bundle_that_was_changed_does_not_verify(
    cap_plan: Plan, cap_bundle: tuple[Path, PlanRecord], tmp_path: Path
) -> None:
    bundle, record = cap_bundle
    shutil.copytree(bundle, tmp_path / "out")
    verify_files(cap_plan, record, tmp_path / "out")
    module = tmp_path / "out" / "rapid" / "GeoPrint.mod"
    text = module.read_text()
    start = text.index("MoveL [[") + len("MoveL [[")
    module.write_text(text[:start] + "9" + text[start:])
    with pytest.raises(VerificationError, match=r"GeoPrint\.mod"):
        verify_files(cap_plan, record, tmp_path / "out")


def test_rounds_divide_the_largest_distance(tmp_path: Path) -> None:
    path = saved(tmp_path, plate((16.0, 12.0), (8, 6), jitter_seed=1))
    planned = plan(job_of(surface=path, unit="mm", rounds=5, robot=False))
    assert int(planned.contours.levels.max()) + 1 == 5
    assert planned.contours.spacing == pytest.approx(planned.contours.distance.maximum / 5)
    assert planned.contours.spacing == pytest.approx(6.0 / 5, rel=0.01)


def test_a_cell_names_the_rounds_of_a_job_that_names_none(tmp_path: Path) -> None:
    path = saved(tmp_path, plate((20.0, 16.0), (5, 4)))
    cell = tmp_path / "cell.toml"
    cell.write_text(packaged_cell_text("irb120-bent45").replace(
        "# pressure_kpa = 10\n# rounds = 20\n\n# Weights for", "rounds = 4\n\n# Weights for"))  # fmt: skip
    asked = {"surface": path, "unit": "mm", "robot": False, "cell": cell, "middle": "plain"}
    assert plan(job_of(**asked)).contours.spacing == pytest.approx(8.0 / 4, rel=0.01)
    assert plan(job_of(**asked, rounds=2)).contours.spacing == pytest.approx(8.0 / 2, rel=0.01)
    assert plan(job_of(**asked, spacing=3.0)).contours.spacing == 3.0


def test_a_single_level_gets_the_flow_that_its_strip_needs(tmp_path: Path) -> None:
    path = saved(tmp_path, plate((20.0, 16.0), (20, 16), jitter_seed=1))
    cell = tmp_path / "cell.toml"
    analog = 'mode = "analog"\nflow = "aoFlow"\nflow_per_mm3_s = 0.1'
    cell.write_text(packaged_cell_text("irb120-bent45").replace('mode = "io"', analog))
    planned = plan(job_of(surface=path, unit="mm", spacing=7.0, robot=False, cell=cell))
    deposited = planned.deposited
    assert planned.uniformity is not None
    assert planned.uniformity.levels is not None
    assert not planned.uniformity.levels.figures.measured
    assert deposited is not None
    # One rectangle 3.5 mm inside has to fill the whole plate, which is more than its length times the spacing.
    assert planned.uniformity.thickness.mean < 0.94
    assert planned.uniformity.followed.mean == pytest.approx(1.0, rel=0.01)
    assert np.array_equal(planned.poses.flow, deposited.following_flow)
    assert "this print has following flow" in outcome_text(record_plan(planned))


def test_a_closed_surface_is_planned_from_a_seed_point(tmp_path: Path) -> None:
    path = saved(tmp_path, sphere(radius=8.0, subdivisions=2))
    planned = plan(job_of(surface=path, unit="mm", spacing=3.0, source="point:0,0,8", robot=False))
    lowest = planned.poses.surface_points[planned.poses.deposit][0]
    assert np.linalg.norm(lowest - [0.0, 0.0, 8.0]) == pytest.approx(1.5, abs=0.2)


def plate_beside_a_wall(tmp_path: Path) -> tuple[Path, Path]:
    """A plate, and a wall 60 mm high 2 mm beside it: the barrel is 10 mm thick and starts 78 mm up, a cone below it."""
    wall = plate((60.0, 12.0), (2, 2))
    x, y, _ = wall.vertices.T
    body = saved(tmp_path, Surface(np.column_stack([np.full(x.size, 18.0), y, x]), wall.faces, name="wall"))
    return saved(tmp_path, plate((16.0, 12.0), (8, 6))), body


@pytest.mark.usefixtures("brief_proofs")
def test_a_wall_beside_the_part_is_hit_upright_and_the_refusal_names_run_place_and_depth(tmp_path: Path) -> None:
    part, body = plate_beside_a_wall(tmp_path)
    stages: list[str] = []
    job = job_of(surface=part, unit="mm", spacing=3.0, body=body, place="demo", max_tilt=0.0)
    with pytest.raises(ClearanceError, match=r"run \d+ at tip \(.*\) mm the \w+ reaches \d+\.\d\d mm into the body"):
        plan(job, observe=stages.append)
    # The poses tell: no motion is timed first.
    assert "reach" in stages
    assert "timing" not in stages


def test_a_wall_beside_the_part_is_passed_by_a_nozzle_that_may_lean(tmp_path: Path) -> None:
    part, body = plate_beside_a_wall(tmp_path)
    planned = plan(job_of(surface=part, unit="mm", spacing=3.0, body=body, place="demo"))
    motion = json.loads(json.dumps(summary(planned)))["robot"][0]["motion"]
    assert 3.0 < motion["tilt"]["largest_deg"] <= 15.0
    assert 0.0 < motion["tilt"]["mean_deg"] < motion["tilt"]["largest_deg"]
    assert 0.0 < motion["lean"]["deposit_share"] < 1.0
    # All along the wall it leans as much as anywhere, and somewhere away from it not at all.
    poses = robot_of(planned).joint_path.poses
    leans, beside = tilts(poses), poses.deposit & (poses.tips[:, 0] > 12.0)
    assert leans[beside].min() > 0.99 * np.radians(motion["tilt"]["largest_deg"])
    assert leans[poses.deposit].min() < np.radians(1.0)
    assert [place["lean_deg"] for place in motion["lean"]["places"]] == [motion["tilt"]["largest_deg"]]
    assert not motion["rotation"]["axial_nozzle"]
    assert "leans from the surface normal by up to" in outcome_text(record_plan(planned))


@pytest.mark.usefixtures("brief_proofs")
def test_a_part_out_of_reach_is_refused_with_run_place_and_next_step(tmp_path: Path) -> None:
    part = saved(tmp_path, plate((12.0, 9.0), (6, 4)))
    cell = tmp_path / "far.toml"
    text = packaged_cell_text("irb120-bent45").replace("[300, 0, 50]", "[900, 0, 50]")
    # The cell says how the plate is turned, so that no other orientation is tried.
    cell.write_text(text.replace("# demo_rpy_deg", "demo_rpy_deg"))
    with pytest.raises(ReachError, match=r"run \d+ at \(.*Move"):
        plan(job_of(surface=part, unit="mm", spacing=3.0, cell=cell, place="demo"))


def test_without_a_calibrated_cell_or_a_demonstration_nothing_is_planned(tmp_path: Path) -> None:
    part = saved(tmp_path, plate())
    with pytest.raises(UsageError, match=r"not calibrated.*--place demo"):
        plan(job_of(surface=part, unit="mm", spacing=3.0))


def test_a_body_far_from_the_part_is_refused_because_it_checks_nothing(tmp_path: Path) -> None:
    part = saved(tmp_path, plate())
    far = plate()
    body = saved(tmp_path, Surface(far.vertices + 500.0, far.faces, name="elsewhere"))
    with pytest.raises(InputError, match=r"is \d+ mm away from plate"):
        plan(job_of(surface=part, unit="mm", spacing=3.0, body=body, place="demo"))


def test_the_hash_in_plan_json_is_that_of_the_file_as_it_was_read(tmp_path: Path) -> None:
    part = saved(tmp_path, plate((12.0, 9.0), (4, 3)))
    wanted = hashlib.sha256(part.read_bytes()).hexdigest()
    planned = plan(job_of(surface=part, unit="mm", spacing=3.0, robot=False))
    part.unlink()
    save_plan(planned, tmp_path / "out")
    assert json.loads((tmp_path / "out" / "plan.json").read_text())["input"]["sha256"] == wanted


def test_what_no_program_can_come_from_is_refused_before_the_long_work(tmp_path: Path) -> None:
    text, part = packaged_cell_text("irb120-bent45"), saved(tmp_path, plate())
    stages: list[str] = []
    for old, new, reason in (
        ('mode = "io"', 'mode = "analog"\nflow = "aoFlow"', "needs both flow, the analog output"),
        ("cog_mm = [25, 0, 65]", "cog_mm = [0, 0, 0]", "refuses a load"),
        ('dispenser = "doValve"', 'dispenser = "geoValve"', "is a word of RAPID"),
    ):
        assert old in text
        (tmp_path / "cell.toml").write_text(text.replace(old, new))
        with pytest.raises(UsageError, match=reason):
            plan(
                job_of(surface=part, unit="mm", spacing=3.0, cell=tmp_path / "cell.toml", place="demo"),
                observe=stages.append,
            )
    assert stages == ["reading"] * 3


def test_nothing_is_laid_at_rest_and_corners_rounded_and_split_are_counted_and_placed(tmp_path: Path) -> None:
    part = saved(tmp_path, plate((24.0, 18.0), (24, 18)))
    planned = plan(job_of(surface=part, unit="mm", spacing=3.0, robot=False))
    paths = summary(planned)["paths"]
    assert isinstance(paths, dict)
    assert paths["stops_while_laying"] == 0
    # Three rectangles turn four corners each, one of them perhaps at the seam.
    assert 9 <= len(planned.toolpath.fillets) <= 12
    assert paths["corners_rounded"] == len(planned.toolpath.fillets)
    assert paths["corners_split_mm"] == []
    split = replace(planned, toolpath=replace(planned.toolpath, splits=np.zeros((2, 3))))
    assert "split at 2 corners" in outcome_text(record_plan(split))


@pytest.mark.parametrize("backend", ["heat", "lscm"])
def test_over_a_fillet_the_tool_turns_ahead_and_keeps_its_speed(backend: str, tmp_path: Path) -> None:
    path = saved(tmp_path, bent_plate(30.0, radius=2.0))
    planned = plan(job_of(surface=path, unit="mm", spacing=3.0, backend=backend, place="demo"))
    assert planned.workpiece.cell.process.speed > 12.0
    # No farther ahead than joints need: a slower print leans less.
    slow = plan(job_of(surface=path, unit="mm", spacing=3.0, backend=backend, speed=8.0, robot=False))
    assert largest_lean(slow.poses) < largest_lean(planned.poses) <= np.radians(15.0)


@pytest.mark.parametrize("backend", ["heat", "lscm"])
def test_an_edge_of_the_part_does_not_slow_the_print(backend: str, tmp_path: Path) -> None:
    path = saved(tmp_path, folded_plate(60.0))
    planned = plan(job_of(surface=path, unit="mm", spacing=3.0, backend=backend, place="demo"))
    assert planned.workpiece.cell.process.speed == robot_of(planned).ceiling == 20.0
    assert robot_of(planned).trajectory.share_at_speed > 0.95
    assert len(planned.toolpath.splits) >= 2


def test_speed_slowest_place_and_deposit_stand_in_one_line_and_all_slowdowns_in_the_summary(cap_plan: Plan) -> None:
    slow = Slowdown(
        run=3, place=(1.0, 2.0, 3.0), arc=4.0, length=0.5, set_speed=20.0, held_speed=7.25, joint=5,
        limit="acceleration",
    )  # fmt: skip
    slowdowns = replace(slow, run=1, held_speed=9.0), slow
    robot = robot_of(cap_plan)
    trajectory = replace(robot.trajectory, slowdowns=slowdowns, share_at_speed=0.6, share_on_ramps=0.125)
    slower = replace(cap_plan, robot=(replace(robot, trajectory=trajectory, ceiling=25.0),))
    record = record_plan(slower)
    said, motion = outcome_text(record), record.robot[0].motion
    speed, deposited = cap_plan.workpiece.cell.process.speed, motion.deposited
    assert speed < motion.speed_ceiling_mm_s == 25.0
    assert deposited is not None
    assert 0.95 <= deposited.least_run <= deposited.share <= deposited.most_run <= 1.05
    assert abs(deposited.share - 1.0) <= 0.02
    assert (
        f"speed: prints at {speed:g} mm/s (ceiling 25), 60.0 % of the deposit within 1 % of it; down to 7.25 mm/s over "
        f"1 mm, in run 4 by the acceleration of joint 5 at (1.0, 2.0, 3.0); deposits "
        f"{100 * deposited.share:.1f} %, runs "
    ) in said
    assert motion.share_slowed is not None
    assert (motion.share_slowed.speed, motion.share_slowed.acceleration) == (0.0, 0.275)
    listed = as_json(motion)["slowdowns"]
    assert isinstance(listed, list)
    assert listed[1] == {
        "run": 3, "place_mm": [1.0, 2.0, 3.0], "arc_mm": 4.0, "length_mm": 0.5, "set_mm_s": 20.0,
        "held_mm_s": 7.25, "joint": 5, "limit": "acceleration",
    }  # fmt: skip


def test_a_misspelt_backend_is_refused_before_the_others_plan(tmp_path: Path) -> None:
    seen: list[str] = []
    part = saved(tmp_path, plate())
    with pytest.raises(UsageError, match="no backend named 'haet'"):
        compare(job_of(surface=part, unit="mm", spacing=3.0), backends=["lscm", "haet"], observe=seen.append)
    assert seen == []


def test_names_with_dollar_signs_are_drawn_and_backends_named_twice_count_once(tmp_path: Path) -> None:
    cap = spherical_cap(radius=30.0, angle=0.4, rings=6)
    part = saved(tmp_path, Surface(cap.vertices, cap.faces, name="a$_$b$"))
    compared = compare(job_of(surface=part, unit="mm", spacing=3.0, robot=False), backends=["heat", "heat"])
    assert [name for name, _ in compared.outcomes] == ["heat"]
    save_comparisons([compared], tmp_path / "out")
    assert (tmp_path / "out" / "compare.png").read_bytes().startswith(b"\x89PNG")


def test_neither_spacing_nor_rounds_says_what_both_would_be_on_this_part(tmp_path: Path) -> None:
    part = saved(tmp_path, plate((40.0, 30.0), (20, 15)))
    with pytest.raises(UsageError, match=r"10 rounds are about 1\.5 mm, 20 about 0\.7\d mm"):
        plan(job_of(surface=part, unit="mm", robot=False))


def test_a_calibrated_cell_writes_a_program_that_may_deposit(tmp_path: Path) -> None:
    part = saved(tmp_path, plate((12.0, 9.0), (6, 4)))
    cell = tmp_path / "calibrated.toml"
    cell.write_text(
        packaged_cell_text("irb120-bent45").replace(
            'source = "demo"',
            'source = "calibrated"\nmodel_mm = [[-50, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]]\n'
            "touched_mm = [[250, 50, 30], [350, 50, 30], [350, -50, 30], [250, -50, 30]]\npart_mm = [-20, -15, 20]\n",
        )
    )
    planned = plan(job_of(surface=part, unit="mm", spacing=3.0, cell=cell))
    robot = robot_of(planned)
    assert robot.placement.calibrated
    assert not robot.program.dry_run
    np.testing.assert_allclose(robot.placement.T_base_work[:3, 3], [280.0, -15.0, 50.0], atol=1e-9)
    assert "UNKNOWN" not in "".join(text for _, text in robot.program.modules)


def test_backends_agree_on_a_plate_and_on_a_cylinder(tmp_path: Path) -> None:
    for surface in (
        plate((16.0, 12.0), (12, 9), jitter_seed=1),
        cylinder_patch(angle=0.5, length=12.0, divisions=(12, 9), jitter_seed=1),
    ):
        compared = compare(
            job_of(surface=saved(tmp_path, surface), unit="mm", spacing=2.0, middle="plain", robot=False)
        )
        for _, outcome in compared.outcomes:
            assert isinstance(outcome, Planned)
            levels = outcome.uniformity.levels
            assert levels is not None
            assert levels.figures.cv < 0.03
            assert levels.figures.mean == pytest.approx(1.0, abs=0.02)
            # Where fronts meet and at corners plain contours leave less than they shall.
            assert outcome.uniformity.thickness.cv < 0.065
            assert outcome.uniformity.thickness.mean == pytest.approx(0.975, abs=0.015)


def test_a_part_is_refined_as_its_backend_asks_and_plan_json_says_how(tmp_path: Path) -> None:
    cap = spherical_cap(radius=13.0, angle=0.5, rings=2, jitter_seed=1)
    part, eighth = saved(tmp_path, cap), float(edge_lengths(cap).mean()) / 8
    faces: dict[str, int] = {}
    for backend, wanted in (("heat", 0.25), ("fast-marching", eighth)):
        planned = plan(job_of(surface=part, unit="mm", spacing=1.0, backend=backend, robot=False))
        save_plan(planned, tmp_path / backend)
        refinement = json.loads((tmp_path / backend / "plan.json").read_text())["field"]["refinement"]
        assert refinement["edge_length_mm"] == pytest.approx(wanted, abs=1e-6)
        assert refinement["faces_before"] == 24
        assert refinement["faces_after"] == len(planned.workpiece.surface.faces)
        faces[backend] = refinement["faces_after"]
    assert faces["fast-marching"] < faces["heat"] / 2


def test_compared_backends_share_the_finest_surface_that_any_of_them_asks_for(tmp_path: Path) -> None:
    cap = spherical_cap(radius=13.0, angle=0.5, rings=2, jitter_seed=1)
    part, eighth = saved(tmp_path, cap), float(edge_lengths(cap).mean()) / 8
    job = job_of(surface=part, unit="mm", spacing=1.0, robot=False)
    for backends, wanted in ((["fast-marching", "heat"], 0.25), (["fast-marching"], eighth)):
        compared = compare(job, backends=backends)
        assert compared.workpiece.edge_length == pytest.approx(wanted, abs=1e-6)
        for _, outcome in compared.outcomes:
            assert isinstance(outcome, Planned)
            assert outcome.plan.workpiece is compared.workpiece


def test_what_cannot_be_flattened_is_a_row_with_its_reason_and_the_rest_is_measured(tmp_path: Path) -> None:
    closed = torus(major=7.0, minor=3.0, divisions=(28, 14))
    part = saved(tmp_path, Surface(closed.vertices, closed.faces[2:], name="handle"))
    compared = compare(job_of(surface=part, unit="mm", spacing=1.5, robot=False, middle="plain"))
    table = comparison_table(recorded_comparison([compared]))
    assert "lscm could not plan on this part: handle.ply (genus 1 with 1 boundary loop) cannot be flattened" in table
    assert "not asked" in table
    save_comparisons([compared], tmp_path / "out")
    rows = json.loads((tmp_path / "out" / "compare.json").read_text())["parts"][0]["backends"]
    assert [row["backend"] for row in rows] == ["lscm", "heat"]
    assert "refused" in rows[0]
    assert rows[1]["uniformity"]["levels"]["spacing"]["cv"] < 0.05
    assert rows[1]["uniformity"]["thickness"]["cv"] < 0.07
    assert (tmp_path / "out" / "heat" / "poses.csv").is_file()
    assert not (tmp_path / "out" / "lscm").exists()
    assert (tmp_path / "out" / "compare.png").read_bytes().startswith(b"\x89PNG")


def test_a_resolution_is_that_of_the_raster_of_lscm_and_plan_json_names_it(tmp_path: Path) -> None:
    part = saved(tmp_path, plate((20.0, 15.0), (10, 8), jitter_seed=1))
    job = job_of(
        surface=part, unit="mm", spacing=3.0, robot=False, middle="plain", options={"lscm": {"resolution": 100}}
    )
    save_comparisons([compare(job, backends=["lscm", "heat"])], tmp_path / "out")
    found = {name: json.loads((tmp_path / "out" / name / "plan.json").read_text()) for name in ("lscm", "heat")}
    assert found["lscm"]["settings"]["options"] == {"lscm": {"resolution": 100}}
    assert found["lscm"]["chart"]["resolution"] == 100
    assert found["lscm"]["chart"]["pixel_mm"] == pytest.approx(25.0 / 100, rel=1e-3)
    assert found["lscm"]["chart"]["area_scale"]["p99"] == pytest.approx(1.0, abs=1e-6)
    predicted = found["lscm"]["chart"]["predicted_spacing"]
    assert [row["level"] for row in predicted] == [0, 1]
    assert [row["mean"] for row in predicted] == pytest.approx([1.0] * 2, abs=1e-6)
    assert "chart" not in found["heat"]
    assert (tmp_path / "out" / "lscm" / "chart.png").read_bytes().startswith(b"\x89PNG")
    assert not (tmp_path / "out" / "heat" / "chart.png").exists()


def test_a_single_level_is_compared_by_all_but_spacing(tmp_path: Path) -> None:
    part = saved(tmp_path, plate((20.0, 17.0), (8, 7)))
    compared = compare(job_of(surface=part, unit="mm", spacing=10.0, robot=False, middle="plain"))
    for _, planned in compared.planned:
        assert planned.uniformity.levels is not None
        assert not planned.uniformity.levels.figures.measured
        # Its layer is measured all the same.
        assert 0.1 < planned.uniformity.thickness.cv < 0.15
        # One rectangle 5 mm inside the rim: 3.3 % of the plate, at its corners, is farther than 5.5 mm from it, and a
        # little more where the path rounds them.
        assert 0.0326 < planned.uniformity.gap < 0.11
    (found,) = recorded_comparison([compared]).record.parts
    assert isinstance(found, PartRecord)
    for row in found.planned:
        assert row.uniformity.levels is not None
        assert row.uniformity.levels.spacing is row.uniformity.both.spacing is None
    assert found.verdict[0].startswith("No backend covers plate.ply. The best, ")
    assert found.verdict[1].startswith("Try `--spacing 5`,")
    save_comparisons([compared], tmp_path / "out")
    shown = (tmp_path / "out" / "report.html").read_text().split("<script", maxsplit=1)[0]
    # What there is not has no row.
    assert "layer thickness, variation (CV)" in shown
    assert "from level to level" not in shown
    assert "spacing to both sides" not in shown
    assert "nan" not in re.sub(r"base64,[^\"]*|<[^>]*>", "", shown).lower()


def test_a_part_out_of_reach_still_gets_its_uniformity(tmp_path: Path) -> None:
    part = saved(tmp_path, spherical_cap(radius=8.0, angle=2.2, rings=10))
    compared = compare(job_of(surface=part, unit="mm", spacing=2.0, place="demo"), backends=["heat"])
    table = comparison_table(recorded_comparison([compared]))
    assert "The robot cannot print heat: cap.ply has no demonstration placement" in table
    assert load_cell(None).name in str(compared.workpiece.cell.name)


@pytest.mark.parametrize("name", ["lv_anterior_disc_r30", "lv_lateral_rect_40x30"])
def test_heart_patches_are_planned_on_one_branch_away_from_the_wrist_singularity(name: str) -> None:
    path = shared(f"patches/{name}.ply")
    planned = plan(job_of(surface=path, unit="mm", spacing=8.0, place="demo", middle="plain"))
    assert np.degrees(robot_of(planned).joint_path.smallest_wrist_angle) > 15.0


@pytest.mark.usefixtures("brief_proofs")
def test_a_needle_too_short_for_the_groove_of_a_whole_heart_is_refused(tmp_path: Path) -> None:
    # A needle of 25.4 mm prints this disc beside the groove; 2 mm and a blunt cone leave the barrel no room.
    cell = tmp_path / "short.toml"
    text = packaged_cell_text("irb120-bent45").replace("needle_length_mm = 25.4", "needle_length_mm = 2")
    cell.write_text(text.replace("cone_half_angle_deg = 10", "cone_half_angle_deg = 60"))
    job = job_of(
        surface=shared("patches/interventricular_groove_disc_r20.ply"), unit="mm", spacing=3.0, cell=cell,
        patches=[{"at": [79.33, 74.61, 11.63], "radius": 4.0}], middle="plain", max_tilt=0.0, place="demo",
        body=shared("hearts/rodero01_heart_walls_closed.ply"),
    )  # fmt: skip
    reason = r"run \d+ at tip \(.*\) mm the (cone|barrel) reaches \d\.\d+ mm into the body rodero01_heart_walls_closed"
    with pytest.raises(ClearanceError, match=reason):
        plan(job)


def test_the_surface_that_was_planned_on_is_written_with_the_plan(cap_plan: Plan, tmp_path: Path) -> None:
    save_plan(replace(cap_plan, robot=()), tmp_path / "out")
    found = load(tmp_path / "out" / "surface.ply", unit="mm")
    np.testing.assert_array_equal(found.vertices, cap_plan.workpiece.surface.vertices)
    assert not (tmp_path / "out" / "trajectory.csv").exists()


def test_a_program_that_deposits_too_much_is_not_written_unless_that_is_accepted(tmp_path: Path) -> None:
    job = job_of(
        surface=saved(tmp_path, spherical_cap(radius=4.0, angle=0.7, rings=12)), unit="mm", spacing=1.0, place="demo",
        on_slowdown="follow",
    )  # fmt: skip
    with pytest.raises(LimitError, match=r"would deposit \d{3} % of the volume of run \d.*`--set on_slowdown=auto`"):
        plan(job)
    accepted = record_plan(plan(job.model_copy(update={"accept_flow": True}))).robot[0].motion
    assert accepted.deposited is not None
    assert accepted.deposited.most_run > 1.1
    found = record_plan(plan(job.model_copy(update={"on_slowdown": "auto"})))
    motion = found.robot[0].motion
    assert motion.deposited is not None
    assert found.settings.speed_mm_s < motion.speed_ceiling_mm_s
    assert motion.deposited.most_run <= 1.05


def test_a_job_may_ask_for_less_than_the_speed_of_its_cell_and_not_for_more(tmp_path: Path) -> None:
    part = saved(tmp_path, plate((24.0, 18.0), (24, 18)))
    job = job_of(surface=part, unit="mm", spacing=3.0, place="demo", speed=5.0)
    record = record_plan(plan(job))
    assert (record.settings.speed_mm_s, record.robot[0].motion.speed_ceiling_mm_s) == (5.0, 5.0)
    with pytest.raises(UsageError, match=r"`--speed 21` is above the speed_mm_s of irb120-bent45.toml, 20"):
        plan(job.model_copy(update={"speed": 21.0}))
