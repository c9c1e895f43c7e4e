"""In which attitude of the table each piece of the paths is to be printed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geoprint.model import FloatArray, Hexapod, PoseStream, TiltingTable, TiltTurn
from geoprint.motion.machine import move_seconds, table_machine
from geoprint.motion.tilting import Attitude, UpRange, attitudes_of, gathered, tilted
from geoprint.results import Plan, Tilting
from geoprint.transforms import angles_between

# Share of the table's range that is left at least.
LEAST_MARGIN = 0.02
# Angles are compared up to this [rad].
NOTHING = 1e-6


def with_table(paths: Plan, table: Hexapod | TiltTurn) -> Plan:
    """Add to a plan of paths how the table of its cell is to tilt the part.

    Runs keep their order, unless pieces of them gathered by attitude need fewer moves.

    Raises:
        InputError: a hexapod at rest is beyond one of its limits.
        LimitError: the table brings nothing up.
    """
    machine, poses = table_machine(table), paths.poses.taken(np.flatnonzero(paths.poses.deposit))
    R_plate_work = machine.T_base_table[:3, :3].T @ paths.workpiece.upright
    within = UpRange(
        lambda ups: machine.margins(machine.plates(ups @ R_plate_work.T)),
        rest=R_plate_work[2],
        critical=paths.workpiece.cell.process.overhang,
        least=LEAST_MARGIN,
    )
    lengths = _lengths(poses)
    kept = attitudes_of(tilted(poses.normals, runs=poses.runs, arcs=poses.arcs, within=within, overlap=0.0), poses.runs)
    other = gathered(poses.normals, runs=poses.runs, layers=poses.layers, lengths=lengths, within=within)
    return replace(
        paths,
        tilting=_tilting(machine, kept, other, poses, lengths, R_plate_work=R_plate_work, critical=within.critical),
    )


def _tilting(
    table: TiltingTable,
    kept: tuple[Attitude, ...],
    other: tuple[Attitude, ...],
    poses: PoseStream,
    lengths: FloatArray,
    *,
    R_plate_work: FloatArray,
    critical: float,
) -> Tilting:
    """Return the attitudes of the order that needs fewer, and what they mean for the table and the deposit."""
    attitudes = other if len(other) < len(kept) else kept
    Ts_table_plate = table.plates(np.stack([R_plate_work @ one.up for one in attitudes]))
    before = np.concatenate([np.eye(4)[None], Ts_table_plate[:-1]])
    angles, own = np.full(poses.count, np.inf), np.zeros(poses.count, dtype=np.int64)
    for number, one in enumerate(attitudes):
        for start, end in one.pieces.tolist():
            # The last pose of a piece is that of the next one, too: the steeper attitude is not its own.
            found = angles_between(poses.normals[start:end], one.up)
            own[start:end] = np.where(found < angles[start:end], number, own[start:end])
            angles[start:end] = np.minimum(angles[start:end], found)
    over = angles > critical + NOTHING
    return Tilting(
        table=table.name,
        attitudes=attitudes,
        axes=tuple(table.axes(Ts_table_plate)),
        lengths=tuple(np.bincount(own, lengths, minlength=len(attitudes)).tolist()),
        seconds=tuple(move_seconds(table, Ts_from=before, Ts_to=Ts_table_plate).tolist()),
        order="kept" if attitudes is kept else "gathered",
        moves=(len(kept), len(other)),
        overhanging=float(lengths[over].sum()),
        missing=float(np.where(over, angles - critical, 0.0).max()),
    )


def _lengths(poses: PoseStream) -> FloatArray:
    """Return the (n,) length of path of the tip that each of deposited poses stands for [mm]."""
    steps = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)
    steps = np.where(poses.laid, steps, 0.0)
    return (np.append(steps, 0.0) + np.append(0.0, steps)) / 2.0
