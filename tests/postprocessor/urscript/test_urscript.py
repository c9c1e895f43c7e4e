"""Programs in URScript: planned, written, executed, and every planted fault in them found."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint import load_cell
from geoprint.cli.application import run
from geoprint.config.cells import packaged_cell_text
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from geoprint.model import Cell, Flood, Purge
from geoprint.postprocessor.execution import Settings
from geoprint.postprocessor.expected import expected_events
from geoprint.postprocessor.interface import Execution, RobotProgram
from geoprint.postprocessor.registry import is_as_written, post_processor
from geoprint.postprocessor.setup_file import read_setup
from geoprint.postprocessor.tables import read_orders, read_poses_table, read_trajectory_table
from geoprint.postprocessor.urscript.post_processor import UrScript
from geoprint.robot.arm import Arm
from geoprint.robot.timing.moments import tips_at
from geoprint.workflow import check_bundle
from tests.meshes import plate
from tests.postprocessor.urscript.planted_faults import FAULTS
from tests.shared_plans import SharedPlans
from tests.workflow.test_checking import LAGS

FILE = "geoprint.script"
STATED = """source = "calibrated"
model_mm = [[-50, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]]
touched_mm = [[-500, 50, 200], [-400, 50, 200], [-400, -50, 200], [-500, -50, 200]]
part_mm = [0, 0, 0]"""


def cell_text(*, stated: bool = True, **lags: float) -> str:
    text = packaged_cell_text("ur5e").replace('# vacuum = "doVacuum"', 'vacuum = "config_out_3"')
    for name, value in (LAGS | lags).items():
        text = re.sub(rf"# {name} = .*", f"{name} = {value}", text)
    return text.replace('source = "demo"', STATED) if stated else text


def made(folder: Path, cell: str, *more: str) -> None:
    folder.mkdir()
    save_ply(plate((10.0, 8.0), (10, 8), jitter_seed=1), folder / "plate.ply")
    (folder / "cell.toml").write_text(cell, encoding="utf-8")
    part = [str(folder / "plate.ply"), "--unit", "mm", "--spacing", "2", "--cell", str(folder / "cell.toml")]
    assert run(["plan", *part, *more, "--out", str(folder / "out")]) == 0


@pytest.fixture
def bundle(shared_plans: SharedPlans) -> Path:
    return shared_plans.folder("URScript of a UR5e", lambda folder: made(folder, cell_text())) / "out"


@pytest.fixture
def resting(shared_plans: SharedPlans) -> Path:
    """Return a bundle whose arm waits for flow and lamp."""
    text = cell_text(uv_tail_s=1.5, settle_ms=200)
    return shared_plans.folder("URScript with rests", lambda folder: made(folder, text)) / "out"


@pytest.mark.parametrize("lag", [0.045, 0.06, 0.1])
def test_an_output_that_is_due_in_a_blend_switches_there(tmp_path: Path, lag: float) -> None:
    made(tmp_path / "late", cell_text(valve_close_s=lag))
    checked = check_bundle(tmp_path / "late" / "out")
    assert checked.findings == ()
    record = checked.record
    assert record is not None
    assert record.robot[0].program.switching is not None
    assert record.robot[0].program.switching.largest_error_mm < 0.1


@pytest.fixture
def copy(bundle: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(bundle, tmp_path / "copy"))


def planned(folder: Path) -> tuple[RobotProgram, Cell, str]:
    """Return what a program was written for, its cell, and its text."""
    setup = read_setup(folder / "setup.json")
    cell, table = setup.cell, read_trajectory_table(folder / "trajectory.csv")
    orders = read_orders(
        folder / "targets.csv", read_poses_table(folder / "poses.csv"), extent=setup.extent,
        duration=float(table.times[-1]), frame=math.inf,
    )  # fmt: skip
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    tips = tips_at(table.times, table.joints, arm, T_base_work=setup.placement.T_base_work)
    events = expected_events(orders, signals=cell.signals, tips_at=tips, speed=cell.process.speed)
    program = RobotProgram("plate", 2.0, setup.placement, setup.surface_within, orders, events, tips, table)
    return program, cell, (folder / "urscript" / FILE).read_text(encoding="ascii")


def executed(text: str, program: RobotProgram, cell: Cell) -> Execution:
    return UrScript().execute([(FILE, text)], program, cell)


def test_a_plan_becomes_a_program_that_is_the_plan_within_a_micrometre(bundle: Path) -> None:
    checked = check_bundle(bundle)
    assert checked.findings == ()
    assert checked.executed is not None
    assert checked.executed.motion <= 1e-3
    # At 60 mm/s the tip goes 0.12 mm in the 2 ms of a frame.
    assert checked.executed.outputs <= 0.12
    assert checked.executed.move_time <= 2e-3
    assert checked.executed.run_time <= 1e-3
    assert checked.settings == Settings(dry_run=True, speed_pct=25.0, first_run=1)
    # What no scenario brings: runs that are called out of their order, twice.
    assert checked.executed.statements - checked.executed.executed == 2
    assert {path.name for path in (bundle / "urscript").iterdir()} == {FILE, "controller"}


def test_targets_are_poses_in_the_work_object_with_blends_below_half_of_the_way(bundle: Path) -> None:
    program, _, text = planned(bundle)
    moves = re.findall(r"movep\(pose_trans\(geo_at, p\[(.*?)\]\), a=(.*), v=geo_rate \* (.*), r=(.*)\)", text)
    assert len(moves) == program.orders.count - 1
    places = 1e3 * np.array([[float(each) for each in pose.split(",")[:3]] for pose, *_ in moves])
    np.testing.assert_allclose(places, program.orders.tips[1:], atol=1e-4)
    blends = 1e3 * np.array([0.0, *(float(blend) for *_, blend in moves)])
    steps = np.linalg.norm(np.diff(program.orders.tips, axis=0), axis=1)
    assert (blends[1:] + blends[:-1] < steps).all()
    assert blends.max() > 0.1
    assert "movel" not in text
    # Joints that are no poses: those of home alone.
    assert re.findall(r"movej\((\w+)", text) == ["geo_home", "get_inverse_kin", "get_inverse_kin", "geo_home"]


def test_the_same_plan_gives_the_same_bytes(bundle: Path) -> None:
    program, cell, _ = planned(bundle)
    some, others = (UrScript().write(program, cell)[0].modules for _ in range(2))
    assert some == others


def test_outputs_switch_when_the_plan_has_them_and_by_the_lines_of_the_threads(bundle: Path) -> None:
    program, cell, text = planned(bundle)
    switched = executed(text, program, cell).switched
    assert len(switched) == len(program.events)
    lines = text.split("\n")
    words = {"digital_out_0": "geo_valve", "digital_out_1": "geo_lamp", "config_out_3": "geo_vacuum"}
    for each in switched:
        assert lines[each.line - 1].strip() == f"{words[each.signal]}({each.on})"
    opened = [each.time for each in switched if each.signal == "digital_out_0" and each.on]
    deposits = [float(program.orders.times[first]) for first, _ in program.orders.deposits]
    # The valve opens its lag of 50 ms before the run, less the ramp that is made up for.
    np.testing.assert_allclose(np.array(opened) - deposits, -0.05, atol=0.008)


@pytest.mark.parametrize(("what", "change"), FAULTS, ids=[each[0] for each in FAULTS])
def test_a_planted_fault_is_found(bundle: Path, what: str, change: Callable[[str], str]) -> None:
    program, cell, text = planned(bundle)
    changed = change(text)
    assert changed != text
    if what == "a new program that prints":
        # Who sets it is free to; who writes it is not.
        assert executed(changed, program, cell).settings == Settings(dry_run=False, speed_pct=25.0, first_run=1)
        return
    execution = executed(changed, program, cell)
    assert execution.findings, what
    assert all(one.details["module"] == FILE for one in execution.findings)


def test_planted_faults_have_different_names() -> None:
    assert len({name for name, _ in FAULTS}) == len(FAULTS) >= 84


def test_an_arm_that_waits_does_so_when_it_prints_and_not_in_a_dry_run(resting: Path) -> None:
    assert check_bundle(resting).findings == ()
    program, cell, text = planned(resting)
    assert text.count("if geo_on:") == int(program.orders.runs[-1]) + 2
    changed = text.replace("sleep(0.2)", "sleep(0.19)", 1)
    (finding,) = executed(changed, program, cell).findings[:1]
    assert "the arm rests 0.19" in str(finding)
    found = executed(text.replace("    if geo_on:\n", "    if geo_prints:\n", 1), program, cell).findings
    assert found


def test_a_program_whose_placement_nobody_has_stated_runs_dry_whatever_is_set(
    shared_plans: SharedPlans,
) -> None:
    text = cell_text(stated=False)
    folder = shared_plans.folder("URScript for nowhere", lambda folder: made(folder, text, "--place", "demo")) / "out"
    program, cell, text = planned(folder)
    assert check_bundle(folder).findings == ()
    assert "global geo_prints = True" not in text
    assert "PLACEMENT UNKNOWN" in text
    found = executed(
        text.replace("    global geo_on = False\n", "    global geo_on = True\n", 1), program, cell
    ).findings
    assert any("dry" in str(one) for one in found)


def test_settings_may_be_changed_and_are_read_back(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = copy / "urscript" / FILE
    text = path.read_text(encoding="ascii")
    path.write_text(
        text.replace("geo_dry_run = True", "geo_dry_run = False").replace("geo_speed_pct = 25", "geo_speed_pct = 100"),
        encoding="ascii",
    )
    assert check_bundle(copy).findings == ()
    assert run(["check", str(copy)]) == 0
    assert "PRINT at 100 % speed, from run 1" in " ".join(capsys.readouterr().out.split())
    path.write_text(text.replace("geo_first_run = 1", "geo_first_run = 9"), encoding="ascii")
    assert any("between 1 and 2, found 9" in one.reason for one in check_bundle(copy).findings)
    path.write_text(text.replace("geo_first_run = 1", "geo_first_run = 1 + 1"), encoding="ascii")
    assert any("must be set once, to a plain value" in one.reason for one in check_bundle(copy).findings)


def test_only_settings_may_differ_from_the_hash_of_the_manifest(tmp_path: Path) -> None:
    from hashlib import sha256

    folder = tmp_path / "urscript"
    folder.mkdir()
    path, text = folder / FILE, "  global geo_speed_pct = 25\n  global geo_runs = 2\n"
    digest = sha256(text.encode()).hexdigest()
    path.write_text(text.replace("25", "60"), encoding="ascii")
    assert is_as_written(path, digest)
    path.write_text(text.replace("2\n", "3\n"), encoding="ascii")
    assert not is_as_written(path, digest)


def test_the_page_for_the_first_load_names_the_outputs_and_is_checked(bundle: Path) -> None:
    program, cell, _ = planned(bundle)
    text = (bundle / "urscript" / "controller" / "first_load.md").read_text(encoding="ascii")
    assert "valve    digital_out_0" in text
    assert "vacuum   config_out_3" in text
    assert "@" not in text

    def found(**files: str) -> list[str]:
        kept = {name.replace("_md", ".md"): text for name, text in files.items()}
        return [str(one) for one in UrScript().kept_findings(kept, cell, placement=program.placement, names=(FILE,))]

    assert found(first_load_md=text) == []
    assert "it must say" in found(first_load_md=text.replace("digital_out_0", "digital_out_1", 1))[0]
    assert "belongs to no URScript program" in found(first_load_md=text, more="")[0]


def test_another_file_beside_the_script_is_found(copy: Path) -> None:
    (copy / "urscript" / "more.script").write_text("def p():\nend\n", encoding="ascii")
    assert any(one.file == "urscript/more.script" for one in check_bundle(copy).findings)


def test_the_run_sheet_says_how_to_load_and_what_nobody_promises(
    bundle: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["check", str(bundle)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "load geoprint.script as a Script node" in said
    assert "run dry at 25 % speed (geo_dry_run True)" in said
    assert "in blends and on short moves nobody promises it" in said
    assert "go low at the end and at every stop" in said
    assert "RAPID" not in said


def test_what_is_deposited_in_the_simulation_is_what_the_plan_wants(bundle: Path, tmp_path: Path) -> None:
    program, cell, text = planned(bundle)
    found = UrScript().dispensing([(FILE, text)], program, cell)
    opened = found.valve_times[found.valve_open] + cell.signals.valve_open
    closed = found.valve_times[~found.valve_open] + cell.signals.valve_close
    lengths = [
        float(np.linalg.norm(np.diff(program.orders.tips[first : last + 1], axis=0), axis=1).sum())
        for first, last in program.orders.deposits
    ]
    # A valve that lets the same through in every second: the time of a run at the speed of the print.
    np.testing.assert_allclose((closed - opened) * cell.process.speed, lengths, rtol=0.02)
    assert run(["simulate", str(bundle), "--out", str(tmp_path / "print")]) == 0


def test_a_cell_that_the_dialect_cannot_serve_is_refused_with_all_reasons_at_once() -> None:
    writing, cell = post_processor("urscript"), load_cell("ur5e")
    writing.check_cell(cell)
    signals = replace(cell.signals, mode="analog", dispenser="doValve", uv_lamp="digital_out_8")
    with pytest.raises(UsageError) as caught:
        writing.check_cell(replace(cell, signals=signals))
    for word in ("take 'io'", "'doValve' of [signals] is none of a UR controller", "'digital_out_8'"):
        assert word in str(caught.value)
    table = load_cell("irb120-tilting45").table
    with pytest.raises(UsageError, match="does not join"):
        writing.check_cell(replace(cell, table=table))


def test_an_arm_of_another_maker_is_refused() -> None:
    cell = load_cell("irb120-straight160")
    with pytest.raises(UsageError, match="not those of Universal Robots' controllers"):
        post_processor("urscript").check_arm(Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool))


def test_priming_and_the_final_exposure_are_part_of_the_program(bundle: Path) -> None:
    program, cell, _ = planned(bundle)
    aside, home = np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0]), cell.robot.home
    cell = replace(cell, purge=Purge(home + aside, 2.0), flood=Flood(3.0, home - aside))
    written, execution = UrScript().write(program, cell)
    assert execution.findings == ()
    text = written.modules[0][1]
    for change in (("sleep(2)", "sleep(1)"), ("geo_purge = [-0.09", "geo_purge = [-0.08"), ("    geo_prime()\n", "")):
        assert change[0] in text
        assert executed(text.replace(*change, 1), program, cell).findings, change
    by_hand, execution = UrScript().write(program, replace(cell, purge=None, flood=Flood(3.0)))
    assert execution.findings == ()
    assert "flood the part with UV for 3 s" in by_hand.modules[0][1]


@pytest.mark.parametrize("kind", ["empty", "half", "letters", "capitals"])
def test_a_file_that_is_no_program_is_refused(copy: Path, kind: str) -> None:
    path = copy / "urscript" / FILE
    text = path.read_text(encoding="ascii")
    texts = {"empty": "", "half": text[: len(text) // 2], "letters": "\x00{}[]", "capitals": text.upper()}
    path.write_text(texts[kind], encoding="ascii")
    found = [one for one in check_bundle(copy).findings if "hash" not in one.reason]
    assert any(one.file == f"urscript/{FILE}" for one in found)


def test_the_view_finds_the_move_of_a_line(bundle: Path) -> None:
    program, cell, text = planned(bundle)
    lines = executed(text, program, cell).lines
    assert len(lines) == program.orders.count
    for _, line in lines[1:]:
        assert "movep(" in text.split("\n")[line - 1]
