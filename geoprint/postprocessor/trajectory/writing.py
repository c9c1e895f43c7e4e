"""Writes a joint trajectory: samples of joints over time as CSV and ROS 2 YAML, and a table of timed outputs.

Samples have positions and velocities, so that whoever plays them joins them by cubic segments, as joint trajectory
controllers do [ROSTrajectory]. They are as sparse as these segments keep the tip where it was timed. Where the arm has
to wait for flow or lamp, it rests between two samples, so that all times are those of the player's clock.
"""

from __future__ import annotations

from importlib.metadata import version

import numpy as np

from geoprint.model import Cell, FloatArray, IntArray, Program
from geoprint.postprocessor.interface import RobotProgram
from geoprint.postprocessor.orders import Event, Orders, TipsAt
from geoprint.postprocessor.switching import waits
from geoprint.robot.arm import Arm, chain_of
from geoprint.robot.arm.urdf import urdf_of

# How far a cubic segment may leave the timed motion of the tip, and of a joint [mm, rad].
_DEVIATION, _TURN = 4e-4, 4e-6
# Rows of a millisecond from a sample to the next at most.
_LONGEST = 32
# An event is placed on its move so exactly: halvings of the time of the move.
_HALVINGS = 30
_HEADER = ",".join(["t", *(f"q{k}" for k in range(1, 7)), *(f"v{k}" for k in range(1, 7))])


def written_trajectory(program: RobotProgram, cell: Cell) -> Program:
    """Return the files of a joint trajectory; without a stated placement its outputs are withheld.

    Args:
        program: that it moves and switches as.
        cell: arm and outputs.
    """
    times, joints, speeds = _samples(program, cell)
    missing = bool(program.placement.missing)
    events = _outputs(program, cell)
    return Program(
        (
            ("joint_trajectory.csv", _table(times, joints, speeds)),
            ("joint_trajectory.yaml", _message(times, joints, speeds, program, cell)),
            ("outputs_withheld.csv" if missing else "outputs.csv", events),
        ),
        targets=program.orders.count,
        dry_run=missing,
    )


def _samples(program: RobotProgram, cell: Cell) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (k,) times by the player's clock, and (k, 6) joints and their speeds."""
    motion, arm = program.motion, Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    waiting = waits(program.orders, cell.signals)
    at = np.flatnonzero(waiting > 0.0)
    rests = np.searchsorted(motion.times, np.round(program.orders.times[at], 3) - 5e-4)
    joints, speeds = motion.joints, np.gradient(motion.joints, motion.times, axis=0)
    speeds[[0, -1, *rests.tolist()]] = 0.0
    rows = _thinned(motion.times, joints, speeds, rests, arm)
    # A row that rests is a sample when the rest begins, and one when it ends.
    twice = np.sort(np.concatenate([rows, rests]))
    begun = np.array([float(waiting[at][rests < row].sum()) for row in np.unique(rests).tolist()])
    passed = np.zeros(twice.size)
    for row, before, wait in zip(np.unique(rests).tolist(), begun.tolist(), waiting[at].tolist(), strict=True):
        passed[twice > row] = before + wait
        first, last = np.flatnonzero(twice == row)
        passed[first], passed[last] = before, before + wait
    return motion.times[twice] + passed, joints[twice], speeds[twice]


def _thinned(times: FloatArray, joints: FloatArray, speeds: FloatArray, rests: IntArray, arm: Arm) -> IntArray:
    """Return the rows that are samples: halved where the cubic between two leaves the timed tip."""
    rows = np.unique(np.concatenate([np.arange(0, times.size, _LONGEST), rests, [times.size - 1]]))
    tips = arm.tool_poses(joints)[:, :3, 3]
    while True:
        cubic = _cubic(times, joints, speeds, rows)
        away = np.linalg.norm(arm.tool_poses(cubic)[:, :3, 3] - tips, axis=1) / _DEVIATION
        spans = np.maximum.reduceat(np.maximum(away, np.abs(cubic - joints).max(axis=1) / _TURN), rows[:-1])
        wide = np.flatnonzero((spans > 1.0) & (np.diff(rows) > 1))
        if not wide.size:
            return rows
        rows = np.sort(np.concatenate([rows, (rows[wide] + rows[wide + 1]) // 2]))


def _cubic(times: FloatArray, joints: FloatArray, speeds: FloatArray, rows: IntArray) -> FloatArray:
    """Return (k, 6) joints at all rows, on the cubic segments between some."""
    span = np.clip(np.searchsorted(rows, np.arange(times.size), side="right") - 1, 0, rows.size - 2)
    first, last = rows[span], rows[span + 1]
    length = (times[last] - times[first])[:, None]
    s = (times - times[first])[:, None] / length
    start = (1.0 + 2.0 * s) * joints[first] + s * length * speeds[first]
    end = (3.0 - 2.0 * s) * joints[last] - (1.0 - s) * length * speeds[last]
    return (1.0 - s) ** 2 * start + s**2 * end


def _table(times: FloatArray, joints: FloatArray, speeds: FloatArray) -> str:
    line = ",".join(["%.6f", *["%.9f"] * 12])
    rows = np.column_stack([times, np.round(joints, 9) + 0.0, np.round(speeds, 9) + 0.0])
    return "\n".join([_HEADER, *(line % tuple(row) for row in rows.tolist()), ""])


def _message(times: FloatArray, joints: FloatArray, speeds: FloatArray, program: RobotProgram, cell: Cell) -> str:
    """Return the same as a trajectory_msgs/msg/JointTrajectory, with what was checked in comments."""
    chain = chain_of(urdf_of(cell.robot), name=cell.robot.model, flange=cell.robot.flange)
    lines = [f"# {_ascii(sentence)}" for sentence in _sentences(program, cell)]
    lines += ["header:", "  stamp: {sec: 0, nanosec: 0}", f"  frame_id: {chain.base}", "joint_names:"]
    lines += [f"- {name}" for name in chain.names]
    lines.append("points:")
    six = ", ".join(["%.9f"] * 6)
    for micros, row, speed in zip(
        np.round(times * 1e6).astype(np.int64).tolist(),
        (np.round(joints, 9) + 0.0).tolist(),
        (np.round(speeds, 9) + 0.0).tolist(),
        strict=True,
    ):
        lines.append(f"- positions: [{six % tuple(row)}]")
        lines.append(f"  velocities: [{six % tuple(speed)}]")
        lines.append(f"  time_from_start: {{sec: {micros // 1000000}, nanosec: {micros % 1000000 * 1000}}}")
    return "\n".join([*lines, ""])


def _sentences(program: RobotProgram, cell: Cell) -> list[str]:
    orders = program.orders
    return [
        f"Written by geoprint {version('geoprint')}. Do not edit: change the plan and write it again.",
        f"Part: {program.part_name}",
        f"Cell: {cell.name}; robot: {cell.robot.model}",
        f"Spacing: {program.spacing:.4f} mm; runs: {int(orders.runs[-1]) + 1}; targets: {orders.count}",
        *(f"Checked: {sentence}" for sentence in program.checked),
        *(f"Not checked: {sentence}" for sentence in program.not_checked),
        "Not checked: the real cell. Run it dry and slowly first.",
        "Speeds and clearance are proven; this is no program of a controller.",
    ]


def _ascii(text: str) -> str:
    return "".join(letter if " " <= letter <= "~" else "?" for letter in text)


def _outputs(program: RobotProgram, cell: Cell) -> str:
    """Return the table of what switches when, by the player's clock."""
    orders, signals = program.orders, cell.signals
    names = {"dispenser": signals.dispenser, "uv_lamp": signals.uv_lamp, "vacuum": signals.vacuum}
    waited = np.cumsum(waits(orders, signals))
    rows = [(_moment(event, orders, program.tips_at), event) for event in program.events]
    due = [(moment + float(waited[max(event.target - 1, 0)]), names[event.output], event.on) for moment, event in rows]
    due.sort(key=lambda row: row[0])
    return "\n".join(["t,output,value", *(f"{time:.6f},{name},{int(on)}" for time, name, on in due), ""])


def _moment(event: Event, orders: Orders, tips_at: TipsAt) -> float:
    """Return when the tip is where an event switches, by halving the time of the move."""
    low, high = float(orders.times[max(event.target - 1, 0)]), float(orders.times[event.target])
    if event.distance == 0.0:
        return low if event.from_start else high
    origin = orders.tips[event.target - 1 if event.from_start else event.target]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        away = float(np.linalg.norm(tips_at(np.array([middle]))[0] - origin))
        behind = away >= event.distance if event.from_start else away <= event.distance
        low, high = (low, middle) if behind else (middle, high)
    return high
