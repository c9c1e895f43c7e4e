"""Where a table stands, and the poses of all its attitudes as they are seen while it rests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import UsageError
from geoprint.model import FloatArray, Hexapod, Placement, PoseStream, TiltTurn
from geoprint.motion.machine import table_machine, tilted_placement
from geoprint.motion.placing import Stand
from geoprint.paths import posed_surface
from geoprint.pipeline.tilting.division import deposited, plate_turn
from geoprint.pipeline.tilting.pieces import attitude_paths, portions
from geoprint.results import Plan


def table_stand(table: Hexapod | TiltTurn) -> Stand:
    """Return where the middle of a table's plate stands while it rests, as a cell file says it."""
    T_base_table = table.T_base_table
    return Stand(T_base_table[:3, 3], Rotation.from_matrix(T_base_table[:3, :3]).as_euler("xyz"))


def poses_at_rest(paths: Plan, placement: Placement) -> PoseStream:
    """Return the poses of all attitudes, one after the other, in the part's frame while the table rests.

    Args:
        paths: with the attitudes of the table.
        placement: where the part stands while it rests.

    Raises:
        UsageError: the cell has no table, or nothing is divided among its attitudes.
    """
    table, tilting = paths.workpiece.cell.table, paths.tilting
    if table is None or tilting is None:
        raise UsageError(f"the cell {paths.workpiece.cell.name} has no table that tilts the part.")
    machine = table_machine(table)
    critical = paths.workpiece.cell.critical_overhang
    divided = portions(tilting.attitudes, deposited(paths), overlap=0.0, critical=critical)
    Ts_table_plate = machine.plates(np.stack([one.up for one in tilting.attitudes]) @ plate_turn(paths, machine).T)
    known = posed_surface(paths.workpiece.surface, paths.workpiece.body)
    streams: list[PoseStream] = []
    for number, (portion, pose) in enumerate(zip(divided, Ts_table_plate, strict=True), start=1):
        stands = tilted_placement(machine, placement, T_table_plate=pose, number=number)
        streams.append(seen_at_rest(attitude_paths(paths, portion, stands, known=known).poses, stands, placement))
    return in_turn(streams)


def seen_at_rest(poses: PoseStream, stands: Placement, rests: Placement) -> PoseStream:
    """Return poses of a part that stands in an attitude, in its frame while the table rests: the arm's are the same."""
    T_rest_work = transforms.inverse(rests.T_base_work) @ stands.T_base_work
    turn = T_rest_work[:3, :3]
    return replace(
        poses,
        tips=transforms.apply(T_rest_work, poses.tips),
        normals=poses.normals @ turn.T,
        quaternions=transforms.quaternion_of(turn @ transforms.rotation_of(poses.quaternions)),
    )


def in_turn(streams: list[PoseStream]) -> PoseStream:
    """Return the poses of several streams, one after the other; the runs are numbered on."""
    runs = np.cumsum([0, *(int(one.runs.max()) + 1 for one in streams[:-1])])
    names = ("tips", "quaternions", "normals", "levels", "layers", "deposit", "stops", "arcs", "flow")
    joined: dict[str, FloatArray] = {name: np.concatenate([getattr(one, name) for one in streams]) for name in names}
    numbered = np.concatenate([one.runs + first for one, first in zip(streams, runs.tolist(), strict=True)])
    return replace(streams[0], runs=numbered, **joined)
