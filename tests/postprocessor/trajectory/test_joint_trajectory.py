"""Joint trajectories with timed outputs: written, read back, played, and every fault in them found."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geoprint import load_cell
from geoprint.cli.application import run
from geoprint.config.cells import packaged_cell_text
from geoprint.errors import InputError, UsageError, VerificationError
from geoprint.geometry.files import save_ply
from geoprint.model import Purge
from geoprint.postprocessor.registry import post_processor
from geoprint.postprocessor.ros_bag import save_bag
from geoprint.postprocessor.trajectory.reading import Samples, read_samples
from geoprint.robot.arm import Arm
from geoprint.workflow import check_bundle
from tests.meshes import plate
from tests.shared_plans import SharedPlans
from tests.workflow.test_checking import LAGS, cell_text

FOLDER = "joint-trajectory"
TABLE, MESSAGE, OUTPUTS = "joint_trajectory.csv", "joint_trajectory.yaml", "outputs_withheld.csv"


def made(folder: Path, cell: Path | str, *more: str) -> None:
    folder.mkdir()
    save_ply(plate((10.0, 8.0), (10, 8), jitter_seed=1), folder / "plate.ply")
    arguments = ["plan", str(folder / "plate.ply"), "--unit", "mm", "--spacing", "2", *more]
    assert run([*arguments, "--cell", str(cell), "--out", str(folder / "out")]) == 0


def moved(folder: Path) -> None:
    """Plan with the packaged cell of the UR5e, but joints over time for its program."""
    cell = folder.with_name(f"{folder.name}.toml")
    cell.write_text(packaged_cell_text("ur5e").replace('"urscript"', '"joint-trajectory"'), encoding="utf-8")
    made(folder, cell, "--place", "demo")


@pytest.fixture
def bundle(shared_plans: SharedPlans) -> Path:
    return shared_plans.folder("joint trajectory of a UR5e", moved) / "out"


@pytest.fixture
def copy(bundle: Path, tmp_path: Path) -> Path:
    return shutil.copytree(bundle, tmp_path / "copy")


def test_a_ur5e_gets_a_motion_that_is_the_plan_within_a_micrometre_and_no_program(bundle: Path) -> None:
    checked = check_bundle(bundle)
    assert checked.findings == ()
    assert checked.executed is not None
    assert checked.settings is None
    assert checked.executed.motion <= 1e-3
    # At 60 mm/s the tip goes 0.12 mm in 2 ms.
    assert checked.executed.outputs <= 0.02
    assert checked.executed.move_time <= 2e-3
    names = {path.name for path in (bundle / FOLDER).iterdir()}
    assert names == {TABLE, MESSAGE, OUTPUTS}
    sheet = (bundle / "plan.json").read_text(encoding="utf-8")
    assert '"dry_run_only": true' in sheet


def test_the_run_sheet_says_that_there_is_no_program(bundle: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", str(bundle)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "NO PROGRAM: joint_trajectory.csv" in said
    assert "speeds and clearance are proven" in said
    assert "nothing may switch" in said
    assert "calibrated by itself, plan with its own URDF" in said
    assert "GeoPrint" not in said


def test_samples_are_fewer_than_rows_and_hold_the_speeds_of_the_arm(bundle: Path) -> None:
    samples = np.loadtxt(bundle / FOLDER / TABLE, delimiter=",", skiprows=1)
    rows = np.loadtxt(bundle / "trajectory.csv", delimiter=",", skiprows=1)
    assert len(samples) < 0.25 * len(rows)
    assert samples[-1, 0] == pytest.approx(rows[-1, 0])
    np.testing.assert_allclose(samples[[0, -1], 1:7], rows[[0, -1], 1:7], atol=1e-8)
    np.testing.assert_array_equal(samples[[0, -1], 7:], 0.0)
    assert np.abs(samples[:, 7:]).max() <= np.radians(180.0) * 1.001


def test_the_message_names_the_joints_of_the_arm_and_has_the_samples_of_the_table(bundle: Path) -> None:
    yaml: Any = pytest.importorskip("yaml")
    message = yaml.safe_load((bundle / FOLDER / MESSAGE).read_text(encoding="ascii"))
    assert message["joint_names"] == [f"joint_{number}" for number in range(1, 7)]
    samples = np.loadtxt(bundle / FOLDER / TABLE, delimiter=",", skiprows=1)
    np.testing.assert_allclose([point["positions"] for point in message["points"]], samples[:, 1:7])
    np.testing.assert_allclose([point["velocities"] for point in message["points"]], samples[:, 7:])
    starts = [point["time_from_start"] for point in message["points"]]
    np.testing.assert_allclose([each["sec"] + 1e-9 * each["nanosec"] for each in starts], samples[:, 0])


def test_cubic_segments_pass_samples_with_their_speeds() -> None:
    # q = t^3 - t on [0, 2] is one cubic.
    times = np.array([0.0, 2.0])
    joints, speeds = (np.tile(each[:, None], 6) for each in (times**3 - times, 3.0 * times**2 - 1.0))
    moments = np.linspace(0.0, 2.0, 9)
    played, found = Samples(times, joints, speeds).played(moments)
    np.testing.assert_allclose(played[:, 3], moments**3 - moments, atol=1e-12)
    np.testing.assert_allclose(found[:, 3], 3.0 * moments**2 - 1.0, atol=1e-12)


def test_the_arm_rests_while_a_flow_settles_and_a_lamp_shines_and_outputs_count_that(
    shared_plans: SharedPlans, tmp_path: Path
) -> None:
    lags = {**LAGS, "uv_tail_s": 1.5, "settle_ms": 200}
    text = cell_text(lags=lags).replace('# post_processor = "rapid"', 'post_processor = "joint-trajectory"')
    (tmp_path / "cell.toml").write_text(text, encoding="utf-8")
    folder = shared_plans.folder("joint trajectory with rests", lambda folder: made(folder, tmp_path / "cell.toml"))
    checked = check_bundle(folder / "out")
    assert checked.findings == ()
    assert checked.executed is not None
    assert checked.executed.motion <= 1e-3
    samples = np.loadtxt(folder / "out" / FOLDER / TABLE, delimiter=",", skiprows=1)
    still = np.flatnonzero((samples[1:, 1:7] == samples[:-1, 1:7]).all(axis=1))
    lengths = np.diff(samples[:, 0])[still]
    runs = int(checked.orders.runs[-1]) + 1 if checked.orders else 0
    assert (np.abs(lengths - 0.2) < 1e-6).sum() == runs
    rows = np.loadtxt(folder / "out" / "trajectory.csv", delimiter=",", skiprows=1)
    assert samples[-1, 0] == pytest.approx(rows[-1, 0] + lengths.sum())
    events = (folder / "out" / FOLDER / "outputs.csv").read_text(encoding="ascii").splitlines()[1:]
    off = max(float(event.split(",")[0]) for event in events if event.endswith("doUV,0"))
    shut = max(float(event.split(",")[0]) for event in events if event.endswith("doValve,0"))
    # The lamp trails the material, which lags 0.08 s behind the valve.
    assert off - shut == pytest.approx(1.58, abs=0.06)


@pytest.mark.needs("rosbags")
def test_a_bag_holds_the_trajectory_and_each_switching_at_its_time(
    shared_plans: SharedPlans, bundle: Path, tmp_path: Path
) -> None:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    text = cell_text(lags=LAGS).replace('# post_processor = "rapid"', 'post_processor = "joint-trajectory"')
    (tmp_path / "cell.toml").write_text(text, encoding="utf-8")
    folder = shared_plans.folder(
        "joint trajectory to be put in a bag", lambda folder: made(folder, tmp_path / "cell.toml")
    )
    bag = save_bag(folder / "out", tmp_path / "one")
    topics: dict[str, list[tuple[float, Any]]] = {}
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, nanos, raw in reader.messages():
            found = reader.deserialize(raw, connection.msgtype)
            topics.setdefault(connection.topic, []).append((1e-9 * nanos, found))
    ((start, message),) = topics.pop("/joint_trajectory")
    samples = np.loadtxt(folder / "out" / FOLDER / TABLE, delimiter=",", skiprows=1)
    assert start == 0.0
    assert list(message.joint_names) == [f"joint_{number}" for number in range(1, 7)]
    np.testing.assert_allclose([point.positions for point in message.points], samples[:, 1:7], atol=1e-12)
    events = (folder / "out" / FOLDER / "outputs.csv").read_text(encoding="ascii").lower().splitlines()[1:]
    told = sorted(
        (f"{time:.6f}", topic.removeprefix("/outputs/"), str(int(found.data)))
        for topic, messages in topics.items()
        for time, found in messages
    )
    assert told == sorted(tuple(event.split(",")) for event in events)
    with pytest.raises(UsageError, match="Choose another folder"):
        save_bag(folder / "out", tmp_path / "one")
    # Nobody has stated where this part stands: nothing may switch.
    with AnyReader([save_bag(bundle, tmp_path / "two")]) as reader:
        assert [connection.topic for connection in reader.connections] == ["/joint_trajectory"]


@pytest.mark.needs("rosbags")
def test_what_was_changed_after_it_was_checked_gets_no_bag(copy: Path, tmp_path: Path) -> None:
    (copy / FOLDER / OUTPUTS).write_text("t,output,value\n", encoding="ascii")
    with pytest.raises(VerificationError, match=r"outputs_withheld\.csv is not as geoprint wrote it; `geoprint check"):
        save_bag(copy, tmp_path / "bag")
    assert not (tmp_path / "bag").exists()


def test_a_plan_without_a_joint_trajectory_has_no_bag(tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    with pytest.raises(InputError, match=r'holds no joint trajectory: plan with `post_processor = "joint-trajectory"`'):
        save_bag(tmp_path, tmp_path / "bag")


def row(text: str, number: int, edit: Callable[[list[str]], list[str]]) -> str:
    lines = text.split("\n")
    lines[number - 1] = ",".join(edit(lines[number - 1].split(",")))
    return "\n".join(lines)


def turned(column: int, by: float) -> Callable[[list[str]], list[str]]:
    return lambda cells: [*cells[:column], f"{float(cells[column]) + by:.9f}", *cells[column + 1 :]]


def later(by: float) -> Callable[[list[str]], list[str]]:
    return lambda cells: [f"{float(cells[0]) + by:.6f}", *cells[1:]]


FAULTS: list[tuple[str, str, Callable[[str], str], str]] = [
    ("a joint 0.01 mrad off", TABLE, lambda text: row(text, 90, turned(2, 1e-5)), "joint_trajectory"),
    ("a speed that bends the segment", TABLE, lambda text: row(text, 90, turned(8, 0.05)), "joint_trajectory"),
    ("a sample that comes late", TABLE, lambda text: row(text, 90, later(0.002)), "joint_trajectory"),
    ("a message of its own", MESSAGE, lambda text: text.replace("nanosec: 512000000", "nanosec: 512000001"), "yaml"),
    ("joints in another order", MESSAGE, lambda text: text.replace("- joint_3", "- joint_4", 1), "yaml"),
    ("another base", MESSAGE, lambda text: text.replace("frame_id: ", "frame_id: other_"), "yaml"),
    ("a valve that opens 3 ms early", OUTPUTS, lambda text: row(text, 2, later(-0.003)), "ms off the plan"),
    (
        "a lamp that stays dark",
        OUTPUTS,
        lambda text: re.sub(r"(digital_out_1),1", r"\1,0", text, count=1),
        "off the plan",
    ),
    ("an output of nobody", OUTPUTS, lambda text: text.replace("digital_out_0", "digital_out_7", 1), "switches"),
    ("a row cut off", TABLE, lambda text: text[:-20], "cut off"),
    ("a word in a table", OUTPUTS, lambda text: text.replace(",1\n", ",on\n", 1), "0 or 1"),
]


@pytest.mark.parametrize(("what", "name", "edit", "reason"), FAULTS, ids=[each[0] for each in FAULTS])
def test_a_fault_is_found(copy: Path, what: str, name: str, edit: Callable[[str], str], reason: str) -> None:
    path = copy / FOLDER / name
    text = path.read_text(encoding="ascii")
    edited = edit(text)
    assert edited != text, what
    path.write_text(edited, encoding="ascii")
    found = [one for one in check_bundle(copy).findings if "hash differs" not in one.reason]
    assert any(one.file.startswith(f"{FOLDER}/") and reason in f"{one.file} {one.reason}" for one in found), found


def test_outputs_that_nobody_may_drive_have_a_file_of_another_name(copy: Path) -> None:
    (copy / FOLDER / OUTPUTS).rename(copy / FOLDER / "outputs.csv")
    assert any("alone" in one.reason or "missing" in one.reason for one in check_bundle(copy).findings)


def test_the_simulation_deposits_what_the_motion_commands(bundle: Path, tmp_path: Path) -> None:
    assert run(["simulate", str(bundle), "--out", str(tmp_path / "print")]) == 0


def test_a_motion_without_a_program_is_refused_where_it_would_need_one() -> None:
    cell = load_cell("ur5e")
    writing = post_processor("joint-trajectory")
    writing.check_cell(cell)
    with pytest.raises(UsageError, match="prime it by hand"):
        writing.check_cell(replace(cell, purge=Purge(cell.robot.home, 2.0)))
    signals = replace(cell.signals, mode="analog", flow="aoFlow", flow_per_mm3_s=1.0)
    with pytest.raises(UsageError, match="take 'io'"):
        writing.check_cell(replace(cell, signals=signals))


def test_rapid_is_refused_for_an_arm_that_it_cannot_count_and_says_what_to_take() -> None:
    cell = load_cell("ur5e")
    with pytest.raises(UsageError, match=r'post_processor = "joint-trajectory"'):
        post_processor("rapid").check_arm(Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool))


def test_a_table_of_two_samples_at_least_is_read() -> None:
    header = "t,q1,q2,q3,q4,q5,q6,v1,v2,v3,v4,v5,v6\n"
    with pytest.raises(VerificationError, match="2 rows at least"):
        read_samples({TABLE: header}, names=(), base="")
    with pytest.raises(VerificationError, match="is missing"):
        read_samples({}, names=(), base="")
