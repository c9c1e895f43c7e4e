"""What follows from any table's kinematics: where the part stands, what is beside it, how long the table moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from geoprint import transforms
from geoprint.model import Cell, FloatArray, Hexapod, Obstacle, Placement, TablePose, TiltingTable, TiltTurn
from geoprint.motion.machine.hexapod import HexapodMachine
from geoprint.motion.machine.tilt_turn import TiltTurnMachine


def table_machine(table: Hexapod | TiltTurn) -> TiltingTable:
    """Return the kinematics of the table that a cell describes.

    Raises:
        InputError: a hexapod at rest is beyond one of its limits, or singular.
    """
    return HexapodMachine(table) if isinstance(table, Hexapod) else TiltTurnMachine(table)


def work_poses(table: TiltingTable, *, Ts_table_plate: FloatArray, T_base_work: FloatArray) -> FloatArray:
    """Return where a part stands that moves with the plate.

    Args:
        table: under the part.
        Ts_table_plate: (n, 4, 4) poses of the plate.
        T_base_work: (4, 4) where the part was touched while the table was at rest.

    Returns:
        (n, 4, 4) T_base_work = T_base_table @ T_table_plate @ T_plate_work, where T_plate_work stays what it was at
        rest.
    """
    T_plate_work = transforms.inverse(table.T_base_table) @ T_base_work
    return table.T_base_table @ Ts_table_plate @ T_plate_work


def move_seconds(table: TiltingTable, *, Ts_from: FloatArray, Ts_to: FloatArray) -> FloatArray:
    """Return how long the table takes at least from poses of its plate to others.

    The slowest axis counts, at its largest speed all along: no maker of these tables publishes accelerations, so that
    starting and stopping are left out. A rotary axis turns back through rest rather than on past half a turn.

    Args:
        table: that moves.
        Ts_from: (n, 4, 4) poses.
        Ts_to: (n, 4, 4) poses.

    Returns:
        (n,) seconds.

    Raises:
        ReachError: the table's axes cannot bring the plate to one of the poses.
    """
    moved = np.abs(table.axes(Ts_to) - table.axes(Ts_from))
    return (moved / table.speeds).max(axis=1)


def straight_course(table: TiltingTable, Ts_table_plate: FloatArray, shares: FloatArray) -> FloatArray:
    """Return poses of the plate on its straight course from one to another.

    Axes that turn do so in proportion; a plate on legs goes straight and turns evenly about one axis.

    Args:
        table: that moves.
        Ts_table_plate: (2, 4, 4) from where to where.
        shares: (k,) of the course, in [0, 1].

    Returns:
        (k, 4, 4) poses.

    Raises:
        ReachError: the table has no such poses.
    """
    if table.rotary:
        return turned_course(table, table.axes(Ts_table_plate), shares)
    one, other = Ts_table_plate
    rotations = Slerp([0.0, 1.0], Rotation.from_matrix(Ts_table_plate[:, :3, :3]))(shares).as_matrix()
    return transforms.rigid(rotations, one[:3, 3] + shares[:, None] * (other[:3, 3] - one[:3, 3]))


def turned_course(table: TiltingTable, knots: FloatArray, shares: FloatArray) -> FloatArray:
    """Return the (k, 4, 4) poses of a plate whose axes go from knot to knot, each stretch in the same share of all.

    Args:
        table: that moves.
        knots: (m, a) values of its axes [rad].
        shares: (k,) of the whole, in [0, 1].
    """
    places = np.linspace(0.0, 1.0, len(knots))
    axes = [np.interp(shares, places, knots[:, axis]) for axis in range(knots.shape[1])]
    return np.stack([table.plate(np.array(each)) for each in zip(*axes, strict=True)])


def driven_seconds(table: TiltTurn, *, share: float) -> float:
    """Return how long a table that the arm's controller drives takes to each attitude [s].

    It may stand anywhere when it begins, so that each motion is given the time of the whole range of its slowest axis.

    Args:
        table: with a mechanical unit.
        share: of the axes' largest speeds that motions at home have, in (0, 1].
    """
    return float(((table.ranges[:, 1] - table.ranges[:, 0]) / table.speeds).max()) / share


def tilted_placement(table: TiltingTable, placement: Placement, *, T_table_plate: FloatArray, number: int) -> Placement:
    """Return where a part stands in an attitude: its fixture moves with the plate.

    Args:
        table: under the part.
        placement: while the table is at rest.
        T_table_plate: (4, 4) pose of the plate.
        number: of the attitude, from 1.
    """
    pose = TablePose(number, T_table_plate, table.axes(T_table_plate[None])[0])
    T_base_fixture = work_poses(table, Ts_table_plate=T_table_plate[None], T_base_work=placement.T_base_fixture)[0]
    return replace(placement, T_base_fixture=T_base_fixture, table=pose)


def obstacles_at(cell: Cell, placement: Placement) -> tuple[Obstacle, ...]:
    """Return what of the cell must not be touched: its obstacles, and its table as it holds the part there."""
    if cell.table is None:
        return cell.obstacles
    at = np.eye(4) if placement.table is None else placement.table.T_table_plate
    return (*cell.obstacles, *table_machine(cell.table).solids(at))
