"""The table's motion between attitudes while the arm waits at home: what it keeps clear of, and how long it takes."""

from __future__ import annotations

import numpy as np

from geoprint import transforms
from geoprint.errors import VerificationError
from geoprint.model import Cell, FloatArray, Placement, Surface, TiltingTable, TiltTurn
from geoprint.positioner import driven_seconds, move_seconds, table_machine
from geoprint.results import StackPlace
from geoprint.robot.arm import Arm
from geoprint.robot.collision import table_motion_clearance


def sweep_clearance(
    cell: Cell,
    table: TiltingTable,
    *,
    Ts_table_plate: FloatArray,
    T_base_work: FloatArray,
    surfaces: tuple[Surface, ...],
    place: StackPlace | None,
    to: str,
) -> float:
    """Prove that a table keeps clear of the arm at home while it goes to an attitude.

    Args:
        cell: its arm, its tool and the distance to keep.
        table: of the cell.
        Ts_table_plate: (2, 4, 4) from where to where.
        T_base_work: (4, 4) where the part stands while the table is at rest [mm].
        surfaces: the part, and what it lies on.
        place: of the layer that is printed next; the layers below go with the part, and on these lies what is printed
            of it, no higher than the layer.
        to: where it goes, as messages call it.

    Returns:
        A distance that is kept [mm].

    Raises:
        ClearanceError: no such distance can be proven.
        ReachError: the table has no such poses.
    """
    deposited = 0.0 if place is None else place.height
    kept = table_motion_clearance(
        Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool),
        tool=cell.tool,
        table=table,
        Ts_table_plate=Ts_table_plate,
        T_base_work=T_base_work,
        surfaces=surfaces if place is None else (*surfaces, place.ground),
        kept=cell.process.clearance + deposited,
        to=to,
    )
    return kept - deposited


def move_clearance(
    cell: Cell,
    *,
    before: Placement | None,
    stands: Placement,
    surfaces: tuple[Surface, ...],
    place: StackPlace | None,
    to: str,
) -> float:
    """Prove as `sweep_clearance` the motion between two attitudes of which a program says how the part stands.

    Args:
        cell: as `sweep_clearance`.
        before: how the part stands at the beginning; None at rest.
        stands: how it stands at the end.
        surfaces: as `sweep_clearance`.
        place: as `sweep_clearance`.
        to: as `sweep_clearance`.

    Returns:
        A distance that is kept [mm].

    Raises:
        ClearanceError: no such distance can be proven.
        InputError: a hexapod at rest is beyond one of its limits, or singular.
        ReachError: the table has no such poses.
        VerificationError: the cell has no table, or the part stands in no attitude of one.
    """
    poses = [None if each is None else each.table for each in (before, stands)]
    if cell.table is None or poses[1] is None or (before is not None and poses[0] is None):
        raise VerificationError(f"{to}: its cell and placement do not state the pose of a table; write the plan again.")
    table = table_machine(cell.table)
    first, last = (np.eye(4) if pose is None else pose.T_table_plate for pose in poses)
    # What is on the plate keeps its pose seen from there, so that it is known where it stood while the table rested.
    T_rest_stands = table.T_base_table @ last @ transforms.inverse(table.T_base_table)
    return sweep_clearance(
        cell,
        table,
        Ts_table_plate=np.stack([first, last]),
        T_base_work=transforms.inverse(T_rest_stands) @ stands.T_base_work,
        surfaces=surfaces,
        place=place,
        to=to,
    )


def sweep_seconds(cell: Cell, table: TiltingTable, *, Ts_from: FloatArray, Ts_to: FloatArray) -> tuple[float, ...]:
    """Return how long the table takes to each pose, as the program drives it, or else at least [s].

    Args:
        cell: whose program may drive the table.
        table: of the cell.
        Ts_from: (n, 4, 4) poses of the plate.
        Ts_to: (n, 4, 4) poses of the plate.
    """
    if isinstance(cell.table, TiltTurn) and cell.table.unit is not None:
        return (driven_seconds(cell.table, share=cell.process.joint_speed_share),) * len(Ts_to)
    return tuple(move_seconds(table, Ts_from=Ts_from, Ts_to=Ts_to).tolist())
