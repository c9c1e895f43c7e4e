"""`geoprint check` of a program alone: edits with all hashes made anew, and faults that geoprint itself plants.

Each edit is one that a person or another program could make between planning and printing. The faults are planted in
the writer's side while it plans, without the verification that planning does by itself: `check` knows nothing of them.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest

from geoprint.errors import VerificationError
from geoprint.model import BoolArray, PoseStream
from geoprint.postprocessor import (
    Orders,
    Setup,
    TrajectoryTable,
    read_orders,
    read_poses_table,
    read_setup,
    read_trajectory_table,
    switching,
)
from geoprint.postprocessor.rapid import writing
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import read_record
from geoprint.robot.arm import Arm
from geoprint.robot.reach import bead_steps
from geoprint.robot.timing.moments import tips_at
from geoprint.workflow import check_bundle
from geoprint.workflow.bundles import stream_of
from geoprint.workflow.checking_motion import (
    check_bead_speed,
    check_deposited_path,
    check_joints,
    check_moves,
    check_poses,
)
from tests.shared_plans import SharedPlans
from tests.workflow.test_checking import cell_text, shared_bundle, write

Edit: TypeAlias = Callable[[str], str]
ROUNDED = writing.rounded_down
PATH, CELL = "GeoPrint.mod", "GeoCell.mod"


@pytest.fixture(scope="module")
def bundle(shared_plans: SharedPlans) -> Path:
    return shared_bundle(shared_plans)


def findings(bundle: Path, folder: Path, file: str, edit: Edit) -> list[str]:
    """Return what is found in the program of a bundle with one file edited, and its hash made anew."""
    shutil.copytree(bundle, folder / "copy")
    path = folder / "copy" / "rapid" / file
    edited = edit(path.read_text())
    assert edited != path.read_text()
    path.write_text(edited)
    manifest = json.loads((folder / "copy" / "manifest.json").read_text())
    manifest["sha256"][f"rapid/{file}"] = hashlib.sha256(edited.encode()).hexdigest()
    (folder / "copy" / "manifest.json").write_text(json.dumps(manifest))
    found = check_bundle(folder / "copy").findings
    return [f"{each.file}: {each.reason}" for each in found if each.file.startswith("rapid/")]


def behind(words: str, line: str) -> Edit:
    return lambda text: text.replace(f"    {words}\n", f"    {words}\n    {line}\n", 1)


def before_the_last_move(line: str) -> Edit:
    return lambda text: re.sub(r"(.*\n)(    MoveL )", rf"\1    {line}\n\2", text, count=1, flags=re.DOTALL)


def moved(name: str, by: float) -> Edit:
    """Move where a trigger switches by a distance [mm]."""
    return lambda text: re.sub(
        rf"(TriggIO {name},)([\d.]+)", lambda match: f"{match[1]}{float(match[2]) + by:.4f}", text, count=1
    )


EDITS: dict[str, tuple[str, Edit, str]] = {
    "dry run that comes down to the part": (PATH, behind("GeoEnter 1;", "PDispOff;"), "of the dry run is given"),
    "displacement of another place": (PATH, behind("GeoEnter 2;", "PDispSet [[0,0,-20],[1,0,0,0]];"), "in a frame at"),
    "half speed": (PATH, behind("GeoEnter 1;", "VelSet 50,250;"), "VelSet has set override to 50"),
    "slow tip": (PATH, before_the_last_move("VelSet 100,5;"), "VelSet has set"),
    "weak acceleration": (PATH, behind("GeoEnter 1;", "AccSet 20,20;"), "AccSet has set"),
    "configurations at will": (PATH, behind("GeoEnter 1;", "ConfL\\Off;"), "ConfL has set"),
    "wrist that gives way": (PATH, behind("GeoEnter 2;", "SingArea\\Wrist;"), "SingArea has set"),
    "time of a move": (
        PATH, lambda text: re.sub(r"(MoveL .*?,vGeo\d+),", r"\1\\T:=3,", text, count=1), "another time or speed"),
    "pause before a run": (PATH, behind("GeoEnter 2;", "WaitTime 0.5;"), "WaitTime belongs neither"),
    "lamp off between moves": (PATH, before_the_last_move("SetDO doUV,0;"), "SetDO belongs neither"),
    "guard fooled": (PATH, before_the_last_move("geoOn:=0;"), "belongs neither"),
    "valve 0.2 mm sooner": (PATH, moved("tGeoValveOn", 0.2), "mm away, the plan has"),
    "valve shut 0.2 mm sooner": (PATH, moved("tGeoValveOff", 0.2), "mm away, the plan has"),
    "lamp 0.5 mm later": (PATH, moved("tGeoLampOn", -0.5), "mm away, the plan has"),
    "speed of a shared datum": (
        CELL, lambda text: re.sub(r"(speeddata vGeo1:=\[)[\d.]+", r"\g<1>9", text), "the speed [mm/s] is"),
}  # fmt: skip


@pytest.mark.parametrize("name", EDITS)
def test_an_edit_whose_hash_was_made_anew_is_found_all_the_same(bundle: Path, tmp_path: Path, name: str) -> None:
    file, edit, words = EDITS[name]
    found = findings(bundle, tmp_path, file, edit)
    assert any(words in each for each in found), found


@pytest.mark.parametrize(("old", "new"), [("MoveL ", "movel "), ("GeoEnter 2", "GEOENTER 2"), ("TriggIO", "triggio")])
def test_a_keyword_in_another_case_is_no_finding(bundle: Path, tmp_path: Path, old: str, new: str) -> None:
    assert findings(bundle, tmp_path, PATH, lambda text: text.replace(old, new, 1)) == []


def lit_late(_: list[tuple[float, float]], lamp: list[tuple[float, float]]) -> list[tuple[float, str, bool]]:
    """The fault of which nobody knew: the lamp is lit half a second late."""
    whole = [(begin + 0.5, end) for begin, end in lamp]
    return [(moment, "uv_lamp", on) for pair in whole for moment, on in zip(pair, (True, False), strict=True)]


def test_planning_finds_a_lamp_that_is_lit_late_by_itself(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(switching, "_lamp_moments", lit_late)
    with pytest.raises(VerificationError, match=r"to switch in the move here|switches .* mm away"):
        write(tmp_path, cell=cell_text(), spacing=3.0)


@pytest.fixture(scope="module")
def tables(bundle: Path) -> tuple[Orders, PoseStream, TrajectoryTable, Setup]:
    """What a bundle says of its targets, its poses and its motion."""
    setup, table = read_setup(bundle / "setup.json"), read_trajectory_table(bundle / "trajectory.csv")
    orders = read_orders(
        bundle / "targets.csv", read_poses_table(bundle / "poses.csv"),
        extent=setup.extent, duration=float(table.times[-1]),
    )  # fmt: skip
    return orders, stream_of(bundle, read_record(bundle / "plan.json", PlanRecord)), table, setup


def swapped(flags: BoolArray, row: int) -> BoolArray:
    changed = flags.copy()
    changed[row] = not changed[row]
    return changed


def test_targets_are_poses_and_deposit_where_these_do(
    tables: tuple[Orders, PoseStream, TrajectoryTable, Setup],
) -> None:
    orders, poses, _, _ = tables
    check_poses(orders, poses)
    for changed, words in (
        (replace(orders, deposited=swapped(orders.deposited, 1)), "target 2, pose .*: material is deposited elsewhere"),
        (replace(orders, deposited=swapped(orders.deposited, 4)), "target 5, pose .*: material is deposited elsewhere"),
        (replace(orders, runs=orders.runs + 1), "target 1, pose 0: another run"),
        (replace(orders, flow=1.02 * orders.flow), "target 4, pose .*: another flow than in poses.csv"),
        (replace(orders, tips=orders.tips + 0.01), "neither stands where its pose is"),
        (replace(orders, poses=orders.poses + (orders.poses == orders.poses[-1])), "the targets go from pose 0 to"),
    ):
        with pytest.raises(VerificationError, match=words):
            check_poses(changed, poses)


def test_the_moves_pass_each_pose_that_is_no_target(tables: tuple[Orders, PoseStream, TrajectoryTable, Setup]) -> None:
    orders, poses, _, _ = tables
    check_moves(orders, poses)
    deposited = np.flatnonzero(poses.deposited)
    pose = int(deposited[~np.isin(deposited, orders.poses)][0])
    tips, turned = poses.tips.copy(), poses.quaternions.copy()
    tips[pose] += (0.0, 0.0, 0.03)
    # The tool comes from above, turned about the z axis of the plate by half a degree.
    half = np.radians(0.25)
    w, x, y, z = turned[pose]
    turned[pose] = np.cos(half) * turned[pose] + np.sin(half) * np.array([-z, -y, x, w])
    for changed, words in (
        (replace(poses, tips=tips), rf"the pose in row {pose + 1} of poses.csv 0.030 mm off"),
        (replace(poses, quaternions=turned), rf"the pose in row {pose + 1} of poses.csv 0.500 degrees off"),
    ):
        with pytest.raises(VerificationError, match=words):
            check_moves(orders, changed)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_bead_around_a_crease_is_timed_over_a_millimetre_of_the_tip_and_a_faster_one_is_found(
    bundle: Path, tables: tuple[Orders, PoseStream, TrajectoryTable, Setup], side: float
) -> None:
    """The first run of the plate over a crease of 57 degrees, where the bead goes 0.3 mm farther than the tip, or less.

    The tip is timed as the planner does it.
    """
    orders, poses, _, setup = tables
    first, last = orders.deposits[0]
    own = slice(orders.poses[first], orders.poses[last] + 1)
    arcs = np.linspace(0.0, 12.0, own.stop - own.start)
    lean = side * 0.5 * ((arcs - 6.0) / 0.2).clip(-1.0, 1.0)
    tips, normals = poses.tips.copy(), poses.normals.copy()
    tips[own] = np.column_stack([arcs, np.zeros(arcs.size), np.zeros(arcs.size)])
    normals[own] = np.column_stack([-np.sin(lean), np.zeros(arcs.size), np.cos(lean)])
    creased = replace(poses, tips=tips, normals=normals)
    read, along = read_poses_table(bundle / "poses.csv"), poses.arcs.copy()
    along[own] = arcs
    table = replace(read, points=creased.surface_points, arcs=along)
    process, times = setup.cell.process, orders.times.copy()
    passed = np.append(0.0, np.cumsum(bead_steps(creased)))[orders.poses[first : last + 1]]
    times[first : last + 1] = times[first] + (passed - passed[0]) / process.speed
    times[last + 1 :] += times[last] - orders.times[last]
    check_bead_speed(replace(orders, times=times), table, process=process)
    times[first : last + 1] -= 0.05 * (times[first : last + 1] - times[first])
    with pytest.raises(VerificationError, match=r"run 1 deposits at 2\d\.\d* mm/s behind target \d+, allowed are 20"):
        check_bead_speed(replace(orders, times=times), table, process=process)


def test_the_trajectory_passes_each_deposited_pose_within_the_limits_of_the_joints(
    tables: tuple[Orders, PoseStream, TrajectoryTable, Setup],
) -> None:
    _, poses, table, setup = tables
    arm = Arm(setup.cell.robot, T_flange_tool=setup.cell.tool.T_flange_tool)
    tips = tips_at(table.times, table.joints, arm, T_base_work=setup.placement.T_base_work)
    check_deposited_path(poses, table, tips)
    with pytest.raises(VerificationError, match=r"misses the pose in row \d+ of poses.csv by 0.0[56]\d mm"):
        check_deposited_path(replace(poses, tips=poses.tips + np.array([0.0, 0.0, 0.06])), table, tips)
    robot, process = setup.cell.robot, setup.cell.process
    check_joints(table, robot, process=process)
    alike = replace(process, joint_speed_share=1.0)
    away = table.joints.copy()
    away[-1, 2] += 1e-5
    for changed, words in (
        (replace(table, joints=table.joints + 7.0), "turns beyond its limits"),
        (replace(table, times=table.times / 20.0), "turns faster than it may"),
        (replace(table, times=table.times / 1.1), "is accelerated more than it may"),
        (replace(table, joints=away), "axis 3 (does not begin and end at home|is accelerated)"),
    ):
        with pytest.raises(VerificationError, match=words):
            check_joints(changed, robot, process=alike)
    # From and to home the joints have a share of their speeds, of which the slowest axis makes use.
    home = replace(process, joint_speed_share=process.joint_speed_share * 0.9)
    with pytest.raises(VerificationError, match="turns faster than it may"):
        check_joints(table, robot, process=home)
