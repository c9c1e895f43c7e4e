"""How fast is a program written, read and executed, and how much memory does that take?

    python -m benchmarks.rapid [--smoke]
    python -m benchmarks.rapid --parts FOLDER

A path of many runs over a plate, every pose a target, in both signal modes: seconds of processor time (one core
does it all) for the whole export, which writes the modules, reads and resolves them, executes them in every scenario
and compares; what of that is reading and what is executing; the export without executing beside it; per hundred
thousand lines; and the memory on top of the plan, of the whole and of executing alone. Each row runs in processes of
its own, so that its memory is its own.
With `--parts`, the programs of the real parts below a folder instead (`benchmarks.programs`).
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.parts.tables import row
from benchmarks.programs import programs
from geoprint import transforms
from geoprint.config import load_cell
from geoprint.export import Orders, TipsAt, orders_of, switching_events
from geoprint.export.rapid import program as writer, rapid_program
from geoprint.export.rapid.executed import prove
from geoprint.export.rapid.guard import resident_module
from geoprint.export.rapid.language.parsing import parse_module
from geoprint.export.rapid.language.symbols import resolve
from geoprint.export.rapid.made import signals_of
from geoprint.model import Cell, FloatArray, JointPath, Placement, PoseStream, Program, SignalMode, Targets, Trajectory
from geoprint.motion.arm import Arm

COUNTS, SMOKE_COUNT = (1_000, 10_000, 100_000), 100
RUN = 400  # poses of a run
STEP = 0.4  # between poses [mm]
SPEED = 20.0  # of the tip [mm/s]
MEGABYTE = 1024.0


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help="the smallest case only, to see that the script runs")
    parser.add_argument("--parts", type=Path, metavar="FOLDER", help="holds patches/ and hearts/")
    arguments = parser.parse_args()
    if arguments.parts is not None:
        for line in programs(arguments.parts):
            print(line, flush=True)
        return
    counts = (SMOKE_COUNT,) if arguments.smoke else COUNTS
    head = (
        "poses", "mode", "lines", "modules", "export, s", "of that reading, s", "executing, s", "without executing, s",
        "export, s / 100k lines", "memory, MB", "of that executing, MB",
    )  # fmt: skip
    print(row(*head))
    print(row(*("---" for _ in head)))
    context = multiprocessing.get_context("spawn")
    modes: tuple[SignalMode, ...] = ("analog",) if arguments.smoke else ("io", "analog")
    for count in counts:
        for mode in modes:
            if arguments.smoke:
                program, whole, memory = export(count, mode)
                reading, executing, alone = execution(program, count, mode)
            else:
                with context.Pool(1) as pool:
                    program, whole, memory = pool.apply(export, (count, mode))
                with context.Pool(1) as pool:
                    reading, executing, alone = pool.apply(execution, (program, count, mode))
            lines = _lines(program)
            print(
                row(
                    str(count), mode, str(lines), str(len(program.modules)), f"{whole:.2f}", f"{reading:.2f}",
                    f"{executing:.2f}", f"{whole - executing:.2f}", f"{whole / lines * 1e5:.2f}", f"{memory:.0f}",
                    f"{alone:.0f}",
                ),
                flush=True,
            )  # fmt: skip


def export(count: int, mode: SignalMode) -> tuple[Program, float, float]:
    """Return a program, the time that its export took [s], and its memory [MB]."""
    cell, placement, orders, tips_at = _case(count, mode)
    before = _memory()
    start = time.process_time()
    program = rapid_program(
        orders, cell=cell, placement=placement, surface_within=0.2, tips_at=tips_at, part_name="benchmark", spacing=1.0
    )  # fmt: skip
    return program, time.process_time() - start, _memory() - before


def execution(program: Program, count: int, mode: SignalMode) -> tuple[float, float, float]:
    """Return the times of reading and of executing a program [s], and the memory of executing [MB]."""
    cell, placement, orders, tips_at = _case(count, mode)
    events = switching_events(orders, signals=cell.signals, tips_at=tips_at, speed=cell.process.speed)
    start = time.process_time()
    texts = [(name, text) for name, text in program.modules if name.endswith(".mod")]
    modules = [parse_module(name, text) for name, text in (*texts, resident_module(cell, placement))]
    resolve(modules, signals=signals_of(cell))
    reading = time.process_time() - start
    before = _memory()
    start = time.process_time()
    prove(modules, orders, cell=cell, placement=placement, events=events)
    return reading, time.process_time() - start, _memory() - before


def _case(count: int, mode: SignalMode) -> tuple[Cell, Placement, Orders, TipsAt]:
    cell = _cell(mode)
    # A plan has its arm already.
    Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool).solutions(np.eye(4)[None])
    T_base_fixture = transforms.rigid(np.eye(3), cell.demo_position)
    placement = Placement(T_base_fixture, np.eye(4), calibrated=True, part_stated=True, misses=np.zeros(1))
    poses = stream(count)
    times = 1.0 + np.append(0.0, np.cumsum(np.linalg.norm(np.diff(poses.tips, axis=0), axis=1))) / SPEED

    def tips_at(moments: FloatArray) -> FloatArray:
        x, y, z = (np.interp(moments, times, poses.tips[:, axis]) for axis in range(3))
        return np.column_stack([x, y, z])

    return cell, placement, _orders(poses, times, placement), tips_at


def stream(count: int) -> PoseStream:
    """Return runs along y, side by side, each with a descent and a lift; the flow varies along them."""
    runs = max(round(count / RUN), 1)
    inner = count // runs - 2
    along = STEP * np.arange(inner)
    parts = [np.column_stack([np.full(inner, float(run)), along, 0.3 + np.sin(along / 9.0)]) for run in range(runs)]
    lift = np.array([[0.0, 0.0, 5.0]])
    tips = np.concatenate([np.concatenate([part[:1] + lift, part, part[-1:] + lift]) for part in parts])
    deposit = np.tile(np.concatenate([[False], np.ones(inner, dtype=np.bool_), [False]]), runs)
    stops = ~deposit
    stops[:-1] |= ~deposit[1:]
    stops[1:] |= ~deposit[:-1]
    total = len(tips)
    return PoseStream(
        tips=tips,
        quaternions=np.tile([0.0, 1.0, 0.0, 0.0], (total, 1)),
        normals=np.tile([0.0, 0.0, 1.0], (total, 1)),
        runs=np.repeat(np.arange(runs), inner + 2),
        levels=np.where(deposit, 0, -1),
        layers=np.zeros(total, dtype=np.int64),
        deposit=deposit,
        stops=stops,
        arcs=np.zeros(total),
        flow=np.where(deposit, 0.5 + 0.1 * np.sin(np.arange(total) / 50.0), 0.0),
        standoff=0.3,
    )


def _cell(mode: SignalMode) -> Cell:
    cell = load_cell(None)
    lags = replace(cell.signals, valve_open=0.05, valve_close=0.08, uv_lead=0.02, uv_tail=0.03)
    if mode == "analog":
        lags = replace(lags, mode="analog", flow="aoFlow", flow_per_mm3_s=0.1, flow_lag=0.04)
    return replace(cell, signals=lags)


def _orders(poses: PoseStream, times: FloatArray, placement: Placement) -> Orders:
    """Return orders with every pose a target and joints that only look like some: the writer reads no more."""
    count = poses.count
    path = JointPath(
        poses=poses,
        joints=np.zeros((count, 6)),
        configuration=np.zeros((count, 4), dtype=np.int64),
        branch=0,
        rotations=np.zeros(count),
        leans=np.zeros((count, 2)),
        T_base_work=placement.T_base_work,
    )
    end = float(times[-1]) + 1.0
    trajectory = Trajectory(
        times=np.array([0.0, end]),
        joints=np.zeros((2, 6)),
        runs=np.full(2, -1),
        deposit=np.zeros(2, dtype=np.bool_),
        pose_times=times,
        stretched=0,
        slowest_deposit=SPEED,
        slowdowns=(),
        share_at_speed=1.0,
        share_on_ramps=0.0,
    )
    zones = np.where(poses.stops, 0.0, STEP / 2.0)
    speeds = np.where(poses.deposit, SPEED - 0.1 * (np.arange(count) % 50), 60.0)
    targets = Targets(poses=np.arange(count), zones=zones, speeds=speeds)
    return orders_of(
        path, targets, trajectory, placement=placement, aloft=np.zeros(6), aloft_configuration=path.configuration,
        extent=np.stack([poses.tips.min(axis=0), poses.tips.max(axis=0)]),
    )  # fmt: skip


def _lines(program: Program) -> int:
    longest = max(text.count("\n") for _, text in program.modules)
    assert longest <= writer.MODULE_LINES, longest
    return sum(text.count("\n") for _, text in program.modules)


def _memory() -> float:
    """Return the largest memory that this process has had [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MEGABYTE


if __name__ == "__main__":
    main()
