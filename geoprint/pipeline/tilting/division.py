"""In which attitude of the table each piece of the paths is to be printed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geoprint.model import FloatArray, Hexapod, PoseStream, TiltingTable, TiltTurn
from geoprint.motion.machine import table_machine
from geoprint.motion.tilting import Attitude, UpRange, attitudes_of, gathered, tilted
from geoprint.pipeline.tilting.sweeping import sweep_seconds
from geoprint.quality import overhang
from geoprint.results import Order, Plan, Tilting
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
    machine, poses = table_machine(table), deposited(paths)
    within, lengths = up_range(paths, machine), _lengths(poses)
    kept = attitudes_of(tilted(poses.normals, runs=poses.runs, within=within), poses.runs)
    other = gathered(poses.normals, runs=poses.runs, layers=poses.layers, lengths=lengths, within=within)
    order: Order = "gathered" if len(other) < len(kept) else "kept"
    attitudes, moves = other if order == "gathered" else kept, (len(kept), len(other))
    return replace(paths, tilting=tilting_of(paths, machine, attitudes, order=order, moves=moves))


def deposited(paths: Plan) -> PoseStream:
    """Return the poses of a plan that deposit."""
    return paths.poses.taken(np.flatnonzero(paths.poses.deposit))


def plate_turn(paths: Plan, table: TiltingTable) -> FloatArray:
    """Return the (3, 3) rotation from the part to the plate of a table that it stands on."""
    return table.T_base_table[:3, :3].T @ paths.workpiece.upright


def up_range(paths: Plan, table: TiltingTable) -> UpRange:
    """Return which directions of a part a table can bring up, with the critical angle of the cell.

    Raises:
        LimitError: the table brings nothing up.
    """
    R_plate_work = plate_turn(paths, table)
    return UpRange(
        lambda ups: table.margins(table.plates(ups @ R_plate_work.T)),
        rest=R_plate_work[2],
        critical=paths.workpiece.cell.critical_overhang,
        least=LEAST_MARGIN,
    )


def tilting_of(
    paths: Plan, table: TiltingTable, attitudes: tuple[Attitude, ...], *, order: Order, moves: tuple[int, int]
) -> Tilting:
    """Return what attitudes mean for the table and the deposit.

    Args:
        paths: with the part as it stands while the table is at rest.
        table: under it.
        attitudes: in the order of printing.
        order: as `Tilting`.
        moves: as `Tilting`.
    """
    poses, critical = deposited(paths), paths.workpiece.cell.critical_overhang
    lengths, R_plate_work = _lengths(poses), plate_turn(paths, table)
    Ts_table_plate = table.plates(np.stack([R_plate_work @ one.up for one in attitudes]))
    before = np.concatenate([np.eye(4)[None], Ts_table_plate[:-1]])
    angles, own = np.full(poses.count, np.inf), np.zeros(poses.count, dtype=np.int64)
    ups = np.zeros((poses.count, 3))
    for one in attitudes:
        ups[one.pieces[:, 0]] = one.up
    for number, one in enumerate(attitudes):
        for start, end in one.pieces.tolist():
            # Where a run goes on, what ends at the first pose of a piece is deposited in the attitude before.
            ups[start + 1 : end] = one.up
            # The last pose of a piece is that of the next one, too: the steeper attitude is not its own.
            found = angles_between(poses.normals[start:end], one.up)
            own[start:end] = np.where(found < angles[start:end], number, own[start:end])
            angles[start:end] = np.minimum(angles[start:end], found)
    left = overhang(poses, up=ups, critical=critical + NOTHING)
    return Tilting(
        table=table.name,
        rotary=table.rotary,
        attitudes=attitudes,
        axes=tuple(table.axes(Ts_table_plate)),
        lengths=tuple(np.bincount(own, lengths, minlength=len(attitudes)).tolist()),
        seconds=sweep_seconds(paths.workpiece.cell, table, Ts_from=before, Ts_to=Ts_table_plate),
        order=order,
        moves=moves,
        overhanging=left.length,
        missing=left.largest - critical if left.length else 0.0,
    )


def _lengths(poses: PoseStream) -> FloatArray:
    """Return the (n,) length of path of the tip that each of deposited poses stands for [mm]."""
    steps = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)
    steps = np.where(poses.laid, steps, 0.0)
    return (np.append(steps, 0.0) + np.append(0.0, steps)) / 2.0
