"""What do the programs of real parts say when they are read back? The table of `benchmarks.rapid --parts`.

The patches and discs of `benchmarks.limits` are planned with two backends in the packaged cell with lags, written as
bundles, and checked as `geoprint check` does. Beside its verdict the table has the largest deviations of the text that
was read from the plan in memory, and of what would flow and shine from where it should.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.limits import all_parts
from benchmarks.parts.tables import row, table
from geoprint import transforms
from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import GeoprintError
from geoprint.export import switching_events
from geoprint.export.rapid import Timeline, read_back, timeline
from geoprint.model import FloatArray
from geoprint.motion.arm import Arm
from geoprint.motion.controller import written_path
from geoprint.motion.timing import tips_at
from geoprint.pipeline import check_bundle, plan, save_plan
from geoprint.results import Plan, RobotPlan

BACKENDS = ("heat", "lscm")
SPACING = 2.0
CELL = "irb120-bent45"
LAGS = {"valve_open_s": 0.05, "valve_close_s": 0.08, "uv_lead_s": 0.02, "uv_tail_s": 0.03}
COLUMNS = (
    "part", "backend", "targets", "findings", "position, um", "attitude, deg", "joints, deg", "switching, um",
    "material, mm", "flow on travel, mm", "lamp alone, s",
)  # fmt: skip


def programs(folder: Path) -> Iterator[str]:
    """Yield the table of all parts below a folder, and its last row: the largest of each column."""
    yield from table(*COLUMNS)
    written: list[FloatArray] = []
    with tempfile.TemporaryDirectory() as scratch:
        cell = Path(scratch) / "cell.toml"
        cell.write_text(cell_with_lags(), encoding="utf-8")
        for part, backend in product(all_parts(folder, Path(scratch)), BACKENDS):
            try:
                told, found = checked(part, backend=backend, cell=cell, bundle=Path(scratch) / "bundle")
            except GeoprintError as error:
                yield row(part.stem, backend, f"refused: {str(error).split(';', maxsplit=1)[0]}")
                continue
            written.append(found)
            yield row(part.stem, backend, *told, *_told(found))
    if written:
        yield row(f"largest of {len(written)}", "", "", "", *_told(np.max(written, axis=0)))


def checked(part: Path, *, backend: str, cell: Path, bundle: Path) -> tuple[list[str], FloatArray]:
    """Plan a part, write and check its bundle; return numbers of targets and findings, and the deviations.

    Raises:
        GeoprintError: the part cannot be planned.
    """
    planned = plan(job_of(surface=part, unit="mm", spacing=SPACING, backend=backend, cell=cell, place="demo"))
    save_plan(planned, bundle, overwrite=True)
    assert planned.robot
    findings = check_bundle(bundle).findings
    return [str(planned.robot[0].orders.count), str(len(findings))], deviations(planned, planned.robot[0])


def cell_with_lags() -> str:
    """Return the text of a packaged cell whose outputs lag: without lags a timeline shows nothing."""
    text = packaged_cell_text(CELL)
    for name, value in LAGS.items():
        text = re.sub(rf"# {name} = .*", f"{name} = {value}", text)
    return text


def deviations(planned: Plan, robot: RobotPlan) -> FloatArray:
    """Return the last columns of the table: the text as it is read back against the plan in memory."""
    cell, orders, motion = planned.workpiece.cell, robot.orders, robot.trajectory
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    T_base_work = robot.placement.T_base_work
    tips = tips_at(motion.times, motion.joints, arm, T_base_work=T_base_work)
    made = read_back(robot.program.modules, cell=cell, placement=robot.placement)
    rotations = transforms.rotation_of(made.turns)
    turned = np.swapaxes(rotations, 1, 2) @ transforms.rotation_of(orders.quaternions)
    solved = arm.solutions(T_base_work @ transforms.rigid(rotations, made.places))[:, robot.joint_path.branch]
    written = written_path(robot.joint_path, robot.targets, arm)
    joints = transforms.wrapped(solved - written.joints[orders.poses])
    events = switching_events(orders, signals=cell.signals, tips_at=tips, speed=cell.process.speed)
    switches = [each for _, some in sorted(made.switchings.items()) for each in some if not each.flow]
    places = [trigger.distance - event.distance for trigger, event in zip(switches, events, strict=True)]
    seen = timeline(made, orders, signals=cell.signals, tips_at=tips)
    return np.array(
        [
            1e3 * np.linalg.norm(made.places - orders.tips, axis=1).max(),
            np.degrees(transforms.rotation_angle(turned).max()),
            np.degrees(np.abs(joints).max()),
            1e3 * np.abs(places).max(),
            seen.errors.max(),
            _flow_on_travel(seen),
            seen.lamp_alone,
        ]
    )


def _flow_on_travel(seen: Timeline) -> float:
    """Return the longest path on which material flows before or after a deposit [mm]."""
    outside = np.column_stack([seen.material[:, 0] < seen.deposits[:, 0], seen.material[:, 1] > seen.deposits[:, 1]])
    return float(seen.errors[outside].max(initial=0.0))


def _told(found: FloatArray) -> Iterator[str]:
    return (f"{value:.2g}" for value in found)
