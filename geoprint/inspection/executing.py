"""What a bundle deposits as it stands in its folder: by its paths, its program, or those of all attitudes of a table.

Over a table each attitude has a program of its own, whose runs are pieces of the plan's. They are deposited one after
the other on the part as it was planned, wherever it stood; the program of all of them must be as it was written, so
that nobody takes what is changed there for deposited.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.config import job_cell
from geoprint.errors import InputError, UsageError, VerificationError
from geoprint.inspection.inputs import PlannedPrint
from geoprint.model import BoolArray, Dispensing, FloatArray, IntArray, PoseStream, freeze_arrays, frozen
from geoprint.postprocessor import PLAN, read_orders, read_poses_table, read_setup, read_trajectory_table
from geoprint.postprocessor.interface import RobotProgram
from geoprint.postprocessor.registry import post_processor_name, post_processor_of
from geoprint.process.feedback import PrintedProgram, dispenser_of
from geoprint.reporting import PlanRecord, read_record
from geoprint.robot.arm import Arm
from geoprint.robot.timing import tips_at
from geoprint.simulation import DepositedBeads, Dispenser, Faults, deposited_beads, dispensed_beads
from geoprint.workflow.bundles import changes, listed_bundle, program_files, stream_of
from geoprint.workflow.replan import job_from
from geoprint.workflow.tilting import PART

# What lies this far before a run or behind it, over the spacing, still belongs to it.
MARGIN_SHARE = 0.5


@final
@frozen
class DepositedPieces:
    """What lies on a part, and of which pieces of the plan's runs.

    Attributes:
        beads: their runs are the n pieces, numbered through; another number where a program is in none of them.
        runs: (n,) of the plan, that each piece is of.
        starts: (n,) arc length of that run at which each begins [mm].
        lengths: (n,) [mm].
    """

    beads: DepositedBeads
    runs: IntArray
    starts: FloatArray
    lengths: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, runs="int: n", starts="float: n", lengths="float: n")

    @property
    def within(self) -> BoolArray:
        """(k,) whether each place of the beads is of a piece."""
        return (self.beads.runs >= 0) & (self.beads.runs < self.runs.size)


def deposited_pieces(
    folder: Path, plan: PlannedPrint, record: PlanRecord, *, faults: Faults, random: np.random.Generator
) -> DepositedPieces:
    """Deposit what a bundle commands.

    Args:
        folder: of one plan.
        plan: what was read of it.
        record: its plan.json.
        faults: what goes wrong besides.
        random: of the noise.

    Raises:
        InputError: nothing is deposited, or nothing in the cell sets the flow that its signals are to follow.
        UsageError: breaks are asked for in runs of which there are several programs.
        VerificationError: a program does not run, or has other targets than its plan, or that of all attitudes was
            changed.
    """
    if len(record.robot) > 1:
        return _of_attitudes(folder, plan, record, faults=faults, random=random)
    if record.robot:
        program, dispenser = _program(folder)
        beads = dispensed_beads(program, plan.surface, dispenser, height=plan.height, faults=faults, random=random)
    else:
        poses = replace(plan.poses, flow=plan.poses.flow * plan.factors)
        beads = deposited_beads(poses, plan.surface, height=plan.height, faults=faults, random=random)
    lengths = _lengths(plan.poses)
    return DepositedPieces(beads, np.arange(lengths.size), np.zeros(lengths.size), lengths)


def printed_program(
    folder: Path, plan: PlannedPrint, *, runs: IntArray, starts: FloatArray, ends: FloatArray
) -> PrintedProgram:
    """Return what a bundle deposits along parts of its runs without any fault, and on which dispenser.

    Args:
        folder: of the bundle.
        plan: what was read of it.
        runs: (k,) run of each part.
        starts: (k,) arc length at which each begins [mm].
        ends: (k,) arc length at which it ends [mm].

    Raises:
        InputError: as `deposited_pieces`, or an older geoprint wrote the bundle.
        UsageError: its cell is not what a cell is any more.
        VerificationError: as `deposited_pieces`, or what it was planned from was changed.
    """
    record, poses = read_record(folder / PLAN, PlanRecord), plan.poses
    deposited_there = deposited_pieces(folder, plan, record, faults=Faults(), random=np.random.default_rng(0))
    numbers = np.unique(poses.runs[poses.deposit])
    lengths, middles = np.zeros(numbers.size), np.zeros((numbers.size, 3))
    deposited = np.zeros(runs.size)
    for row, number in enumerate(numbers.tolist()):
        lengths[row], middles[row], arcs, wanted = _run_of(poses, number)
        own = runs == number
        edges = np.append(starts[own], lengths[row])
        found = _volumes_between(deposited_there, number, edges, margin=MARGIN_SHARE * plan.spacing)
        deposited[own] = found / np.maximum(np.diff(np.interp(edges, arcs, wanted)), 1e-12)
    return PrintedProgram(
        plan=plan.name, part=plan.part, digest=plan.digest, executed=bool(record.robot),
        dispenser=dispenser_of(job_cell(job_from(folder))), speed=record.settings.speed_mm_s, opened=plan.opened,
        shut=plan.shut, runs=numbers, lengths=lengths, middles=middles,
        owners=runs, factors=plan.factors_at(runs, 0.5 * (starts + ends)), deposited=deposited,
    )  # fmt: skip


def _run_of(poses: PoseStream, number: int) -> tuple[float, FloatArray, FloatArray, FloatArray]:
    """Return length and middle of a run on the surface, arc lengths of its poses, and the volume wanted up to there."""
    rows = np.flatnonzero(poses.deposit & (poses.runs == number))
    places, flow = poses.surface_points[rows], poses.flow[rows]
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    arcs: FloatArray = np.concatenate([[0.0], np.cumsum(steps)])
    length = float(arcs[-1])
    half = [float(np.interp(0.5 * length, arcs, places[:, axis])) for axis in range(3)]
    volumes = np.append(0.0, np.cumsum(0.5 * steps * (flow[1:] + flow[:-1])))
    return length, np.array(half), arcs, volumes


def _volumes_between(deposited: DepositedPieces, number: int, edges: FloatArray, *, margin: float) -> FloatArray:
    """Return the (e - 1,) volume that lies between (e,) arc lengths of a run; what is hardly beyond its ends, too."""
    beads, piece = deposited.beads, np.where(deposited.within, deposited.beads.runs, 0)
    there = deposited.within & (deposited.runs[piece] == number)
    near = there & (beads.arcs >= -margin) & (beads.arcs <= deposited.lengths[piece] + margin)
    arcs = (beads.arcs + deposited.starts[piece])[near]
    which = np.clip(np.searchsorted(edges, arcs, side="right") - 1, 0, edges.size - 2)
    return np.bincount(which, beads.volumes[near], minlength=edges.size - 1).astype(np.float64)


def _of_attitudes(
    folder: Path, plan: PlannedPrint, record: PlanRecord, *, faults: Faults, random: np.random.Generator
) -> DepositedPieces:
    if faults.breaks:
        raise UsageError(
            f"breaks need one program, and {folder} has one for each of {len(record.robot)} table attitudes: plan the "
            "part without a table to break its runs."
        )
    program = post_processor_name(read_setup(folder / f"{PART}1" / "setup.json").cell)
    joined = {name: digest for name, digest in listed_bundle(folder).items() if name.startswith(f"{program}/")}
    for name, reason in changes(folder, joined):
        raise VerificationError(
            f"{folder / name}: {reason}. Over a table, the attitudes' own programs are deposited: restore this file, "
            f"and change those below {folder / PART}1, and so on."
        )
    deposited: list[DepositedPieces] = []
    for number in range(1, len(record.robot) + 1):
        part = folder / f"{PART}{number}"
        program, dispenser = _program(part)
        beads = dispensed_beads(program, plan.surface, dispenser, height=plan.height, faults=faults, random=random)
        deposited.append(DepositedPieces(beads, *_pieces(stream_of(part, record), plan.poses)))
    return _together(deposited)


def deposited_steps(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) length on the surface of each step that deposits, 0 for the others [mm]."""
    return np.asarray(np.linalg.norm(np.diff(poses.surface_points, axis=0), axis=1) * poses.deposited)


def _lengths(poses: PoseStream) -> FloatArray:
    """Return the (n,) deposited length of each run on the surface [mm]."""
    steps = deposited_steps(poses)
    return np.array([float(steps[poses.runs[1:] == run].sum()) for run in range(int(poses.runs.max()) + 1)])


def _pieces(own: PoseStream, whole: PoseStream) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return (n,) run of the whole of which each run of an attitude is a piece, where in it that begins, its length."""
    places = whole.surface_points
    passed = np.concatenate([[0.0], np.cumsum(deposited_steps(whole))])
    begun = np.array([passed[np.argmax(whole.deposit & (whole.runs == run))] for run in range(whole.runs.max() + 1)])
    rows = np.flatnonzero(whole.deposited)
    # The middles of steps: where a closed run begins it also ends.
    tree = KDTree((places[rows] + places[rows + 1]) / 2.0)
    lengths, there = _lengths(own), np.flatnonzero(own.deposited)
    firsts = there[np.searchsorted(own.runs[there], np.arange(lengths.size))]
    middles = (own.surface_points[firsts] + own.surface_points[firsts + 1]) / 2.0
    found = rows[np.asarray(tree.query(middles)[1])]
    runs = whole.runs[found]
    return runs, passed[found] - begun[runs], lengths


def _together(deposited: Sequence[DepositedPieces]) -> DepositedPieces:
    """Return the pieces of several programs, numbered through."""
    firsts = np.cumsum([0, *(each.runs.size for each in deposited[:-1])]).tolist()
    numbered = [
        np.where(each.within, each.beads.runs + first, -1) for each, first in zip(deposited, firsts, strict=True)
    ]
    names = ("places", "normals", "ahead", "widths", "areas", "arcs")
    joined: dict[str, FloatArray] = {
        name: np.concatenate([getattr(each.beads, name) for each in deposited]) for name in names
    }
    return DepositedPieces(
        replace(deposited[0].beads, runs=np.concatenate(numbered), **joined),
        *(
            np.concatenate(each)
            for each in zip(*((one.runs, one.starts, one.lengths) for one in deposited), strict=True)
        ),
    )


def _program(folder: Path) -> tuple[Dispensing, Dispenser]:
    """Return what a program commands, and the dispenser that its cell describes."""
    setup = read_setup(folder / "setup.json")
    if setup.cell.signals.flow_unstated:
        raise InputError(
            f'{folder}: its cell has mode "analog" and no output that sets the flow. State signals.flow and '
            f"signals.flow_per_mm3_s in a cell file, then run `geoprint plan --from {folder} --cell CELL --out next`."
        )
    poses = read_poses_table(folder / "poses.csv")
    table = read_trajectory_table(folder / "trajectory.csv")
    orders = read_orders(
        folder / "targets.csv", poses, extent=setup.extent,
        duration=float(table.times[-1]),
    )  # fmt: skip
    cell, placement = setup.cell, setup.placement
    files = program_files(folder, cell)
    if not files:
        place = folder / post_processor_name(cell)
        raise VerificationError(f"{place} holds no program; restore it, or plan again.")
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    tips = tips_at(table.times, table.joints, arm, T_base_work=placement.T_base_work)
    wanted = RobotProgram("", 0.0, placement, setup.surface_within, orders, (), tips, table)
    program = post_processor_of(cell).dispensing(files, wanted, cell)
    # The pressure is set for the flow at the set speed.
    rate, lags = float(poses.flow.max()) * cell.process.speed, cell.signals
    return program, Dispenser(
        rate, opens=lags.valve_open, shuts=lags.valve_close, follows=lags.flow_lag, settles=lags.settle
    )
