"""Does each dialect do what was planned: path, outputs and volume of one plan in RAPID, URScript and joints over time?

    python -m benchmarks.programs.dialects [FILE ...] [--spacing MM]

Each part is planned with the default settings in the packaged cells of the IRB 120 and of the UR5e. The plan of the
latter is written as URScript and as a joint trajectory. Each program is executed by the interpreter of its dialect,
which shares no code with the writer.

The columns: targets; time of the program [s]; how far the executed path lies from the plan [mm], at targets, of a joint
trajectory all along; how far outputs switch from the moment at which the plan has them [ms]; volume of all runs over
the planned one, and of the run that is off most, for a valve that lets as much through in every second; how much longer
or shorter a run takes; lines of the program; seconds to write and execute it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks import DATA
from benchmarks.parts.tables import row, script_parser, table
from geoprint import job_of, plan
from geoprint.errors import GeoprintError
from geoprint.geometry.files import suggested_unit
from geoprint.model import Cell
from geoprint.postprocessor import TrajectoryTable, expected_events, expected_waits
from geoprint.postprocessor.interface import Execution, RobotProgram
from geoprint.postprocessor.registry import post_processor
from geoprint.postprocessor.timeline import moment_on
from geoprint.results import Plan
from geoprint.robot.arm import Arm
from geoprint.robot.timing.moments import tips_at

OWN = tuple(DATA / name for name in ("plate.ply", "heart_flat_patch.ply", "heart_apex_patch.ply"))
# Cells, and the dialects in which their plans are written.
DIALECTS = {"ur5e": ("urscript", "joint-trajectory"), "irb120-straight160": ("rapid",)}


class Measured(NamedTuple):
    """What a program does: path [mm], outputs [ms], volumes over the wanted ones, shares, lines and seconds."""

    targets: int
    duration: float
    path: float
    outputs: float
    whole: float
    worst: float
    run: float
    lines: int
    seconds: float


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="a plate and a wide spacing, to see that the script runs")
    parser.add_argument("files", nargs="*", type=Path, default=OWN, metavar="FILE")
    parser.add_argument("--spacing", type=float, default=3.0, metavar="MM")
    arguments = parser.parse_args()
    files, spacing = (arguments.files[:1], 5.0) if arguments.smoke else (arguments.files, arguments.spacing)
    for line in table(
        "part",
        "dialect",
        "targets",
        "s",
        "path mm",
        "outputs ms",
        "volume",
        "worst run",
        "run time",
        "lines",
        "written s",
    ):
        print(line, flush=True)
    for name, dialect, found in cases(files, spacing=spacing):
        print(row(name, dialect, *_cells(found)), flush=True)


def _cells(found: Measured | GeoprintError) -> Sequence[str]:
    if isinstance(found, GeoprintError):
        return [f"refused: {found}"[:100], *[""] * 8]
    return (
        str(found.targets), f"{found.duration:.1f}", f"{found.path:.5f}", f"{found.outputs:.2f}", f"{found.whole:.4f}",
        f"{found.worst:.4f}", f"{100.0 * found.run:.2f} %", str(found.lines), f"{found.seconds:.1f}",
    )  # fmt: skip


def cases(files: Sequence[Path], *, spacing: float) -> Iterator[tuple[str, str, Measured | GeoprintError]]:
    """Yield part, dialect and figures of each program, or what refuses it."""
    for file in files:
        unit, _ = suggested_unit(file)
        for cell, dialects in DIALECTS.items():
            job = job_of(surface=file, unit=unit, spacing=spacing, place="demo", cell=Path(cell))
            try:
                made = plan(job)
            except GeoprintError as error:
                yield file.stem, " and ".join(dialects), error
                continue
            for dialect in dialects:
                try:
                    yield file.stem, dialect, measured(made, dialect)
                except GeoprintError as error:
                    yield file.stem, dialect, error


def measured(made: Plan, dialect: str) -> Measured:
    """Write a plan in a dialect, and return what its program does when executed."""
    (robot,) = made.robot
    cell = made.workpiece.cell
    moved = robot.trajectory
    motion = TrajectoryTable(moved.times, moved.joints, moved.deposit, moved.runs)
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    tips = tips_at(motion.times, motion.joints, arm, T_base_work=robot.placement.T_base_work)
    events = expected_events(robot.orders, signals=cell.signals, tips_at=tips, speed=cell.process.speed)
    program = RobotProgram(
        made.workpiece.name, made.contours.spacing, robot.placement, made.workpiece.surface_within, robot.orders,
        events, tips, motion,
    )  # fmt: skip
    start = time.perf_counter()
    written, execution = post_processor(dialect).write(program, cell)
    seconds = time.perf_counter() - start
    assert execution.executed is not None
    whole, worst = _volumes(written.modules, dialect, program, cell)
    return Measured(
        robot.orders.count, robot.orders.duration, execution.executed.motion, 1e3 * _delay(execution, program, cell),
        whole, worst, execution.executed.run_time, sum(text.count("\n") for _, text in written.modules), seconds,
    )  # fmt: skip


def _delay(execution: Execution, program: RobotProgram, cell: Cell) -> float:
    """Return how far a switching is from the moment at which the plan has it, at most [s]."""
    signals = cell.signals
    names = {"dispenser": signals.dispenser, "uv_lamp": signals.uv_lamp, "vacuum": signals.vacuum or ""}
    off = [0.0]
    for output, name in names.items():
        found = sorted(each.time for each in execution.switched if each.signal == name.lower())
        off += np.abs(np.subtract(found, [time for time, _ in _due(output, program, cell)])).tolist()
    return max(off)


def _due(output: str, program: RobotProgram, cell: Cell) -> list[tuple[float, bool]]:
    """Return when the plan has an output switched, and to what."""
    orders, waits = program.orders, expected_waits(program.orders, cell.signals)
    return sorted(
        (
            moment_on(each.target, each.distance, orders, program.tips_at, from_start=each.from_start)
            + float(waits[each.target - 1]) * each.from_start,
            each.on,
        )
        for each in program.events
        if each.output == output
    )


def _volumes(files: Sequence[tuple[str, str]], dialect: str, program: RobotProgram, cell: Cell) -> tuple[float, float]:
    """Return the volume of all runs over the planned one, and of the run that is off most.

    A valve lets the same through in every second that it is open, less what its lags take.
    """
    found = post_processor(dialect).dispensing(files, program, cell)
    # A valve that is shut where it is shut already stays so.
    changes = found.valve_open != np.append(np.False_, found.valve_open[:-1])
    times, opens = found.valve_times[changes], found.valve_open[changes]
    due = _due("dispenser", program, cell)
    planned = np.subtract([time for time, on in due if not on], [time for time, on in due if on])
    lag = cell.signals.valve_close - cell.signals.valve_open
    flowing, wanted = times[~opens] - times[opens] + lag, planned + lag
    shares = flowing / wanted
    return float(flowing.sum() / wanted.sum()), float(shares[np.abs(shares - 1.0).argmax()])


if __name__ == "__main__":
    main()
