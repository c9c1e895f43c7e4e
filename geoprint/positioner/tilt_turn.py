"""The tilt-turn table, and what follows from any table's kinematics."""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from geoprint import transforms
from geoprint.errors import ReachError
from geoprint.model import Cell, Cylinder, FloatArray, Hexapod, Obstacle, Placement, TablePose, TiltingTable, TiltTurn
from geoprint.positioner.hexapod import HexapodMachine

# The tilt-turn table: two rotary axes bring any direction of the plate up, in closed form.


# A pose given to `axes` may miss what two axes can do by this [entries of the rotation, and mm]: roundings of a file.
ROUNDING = 1e-6
# A direction this far from the axis of turning [its sine] tells no angle of turning: the plate need not turn.
UPRIGHT = 1e-12


@final
class TiltTurnMachine:
    """A tilt-turn table in motion; a `TiltingTable` whose axes are tilt and turn [rad].

    The plate turns about its own z axis and then tilts about the tilting axis, T_table_plate = A Rx(tilt) A^-1
    Rz(turn), with A the shift from the plate's origin down to the tilting axis.

    Args:
        tilt_turn: as the cell describes it.
    """

    __slots__ = ("_tilt_turn",)

    def __init__(self, tilt_turn: TiltTurn) -> None:
        self._tilt_turn = tilt_turn

    @property
    def name(self) -> str:
        """What messages call it."""
        return self._tilt_turn.name

    @property
    def T_base_table(self) -> FloatArray:
        """(4, 4) the table's frame in the robot's base."""
        return self._tilt_turn.T_base_table

    @property
    def rotary(self) -> bool:
        """Yes: both axes turn."""
        return True

    @property
    def speeds(self) -> FloatArray:
        """(2,) largest speeds of tilting and turning [rad/s]."""
        return self._tilt_turn.speeds

    def plates(self, ups: FloatArray) -> FloatArray:
        """Return the poses of the plate that turn directions of it up.

        Two solutions tilt by the same angle to either side; both keep the turn within a quarter. Those within the
        ranges come first, then the smaller turn, then the positive tilt. A direction along the plate's axis needs no
        turn.

        Args:
            ups: (n, 3) unit directions in the plate's frame.

        Returns:
            (n, 4, 4) T_table_plate; limits are not applied.
        """
        sine = np.hypot(ups[:, 0], ups[:, 1])
        tilt = np.arctan2(sine, ups[:, 2])
        # Rz(turn) brings the direction into the plane across the tilting axis, at (0, sin(tilt), cos(tilt)).
        turn = np.where(sine > UPRIGHT, np.arctan2(ups[:, 0], ups[:, 1]), 0.0)
        back = np.where(sine > UPRIGHT, np.arctan2(-ups[:, 0], -ups[:, 1]), 0.0)
        one, other = np.column_stack([tilt, turn]), np.column_stack([-tilt, back])
        # The only one within its ranges is taken, else the smaller turn.
        within, without = self._left(one).min(axis=1) >= 0.0, self._left(other).min(axis=1) < 0.0
        taken = np.where(within == without, within, np.abs(turn) <= np.abs(back))
        return self._poses(np.where(taken[:, None], one, other))

    def axes(self, Ts_table_plate: FloatArray) -> FloatArray:
        """Return the (n, 2) tilts and turns in (-pi, pi] at (n, 4, 4) poses of the plate [rad]; limits are not applied.

        Raises:
            ReachError: a pose is none that tilting and turning lead to.
        """
        rotations = Ts_table_plate[:, :3, :3]
        tilts = np.arctan2(-rotations[:, 1, 2], rotations[:, 2, 2])
        turns = np.arctan2(-rotations[:, 0, 1], rotations[:, 0, 0])
        found = np.column_stack([tilts, turns])
        misses = np.abs(self._poses(found) - Ts_table_plate).max(axis=(1, 2), initial=0.0)
        if (misses > ROUNDING).any():
            worst = int(np.argmax(misses))
            raise ReachError(
                f"{self.name}: pose {worst + 1} of the plate is missed by {misses[worst]:.3g} by any tilt and turn, "
                f"allowed is {ROUNDING:g}; take poses from this table's own `plates`.",
                pose=worst,
                miss=float(misses[worst]),
            )
        return found

    def plate(self, axes: FloatArray) -> FloatArray:
        """Return the (4, 4) pose of the plate at (2,) tilt and turn [rad]; limits are not applied."""
        return self._poses(axes[None])[0]

    def margins(self, Ts_table_plate: FloatArray) -> FloatArray:
        """Return the smallest share left of the ranges of both axes.

        Args:
            Ts_table_plate: (n, 4, 4) poses of the plate.

        Returns:
            (n,) of each range 1 is left at rest, 0 at its end, and less beyond.

        Raises:
            ReachError: a pose is none that tilting and turning lead to.
        """
        return self._left(self.axes(Ts_table_plate)).min(axis=1)

    def solids(self, T_table_plate: FloatArray) -> tuple[Cylinder, ...]:
        """Return plate, hub, beam and post at a (4, 4) pose of the plate, in the robot's base."""
        one = self._tilt_turn
        under = -one.plate_thickness
        along = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, under], [0.0, 0.0, under - one.hub_length]])
        top, bottom, end = transforms.apply(T_table_plate, along)
        axis = np.array([0.0, 0.0, -one.axis_depth])
        corner = axis - [one.stand_distance, 0.0, 0.0]
        foot = corner - [0.0, 0.0, one.stand_height]
        ends = [
            ("table's plate", top, bottom, one.plate_diameter),
            ("table's hub", bottom, end, one.hub_diameter),
            ("table's beam", axis, corner, one.stand_diameter),
            ("table's post", corner, foot, one.stand_diameter),
        ]
        return tuple(
            Cylinder(
                name,
                transforms.apply(self.T_base_table, start),
                transforms.apply(self.T_base_table, stop),
                diameter / 2,
            )
            for name, start, stop, diameter in ends
        )

    def _poses(self, axes: FloatArray) -> FloatArray:
        """Return the (n, 4, 4) poses of the plate at (n, 2) tilts and turns [rad]."""
        cosines, sines = np.cos(axes), np.sin(axes)
        poses = np.zeros((len(axes), 4, 4))
        poses[:, 0, 0], poses[:, 0, 1] = cosines[:, 1], -sines[:, 1]
        poses[:, 1, 0], poses[:, 1, 1], poses[:, 1, 2] = sines[:, 1] * cosines[:, 0], cosines.prod(1), -sines[:, 0]
        poses[:, 2, 0], poses[:, 2, 1], poses[:, 2, 2] = sines.prod(1), cosines[:, 1] * sines[:, 0], cosines[:, 0]
        depth = self._tilt_turn.axis_depth
        poses[:, 1, 3], poses[:, 2, 3] = -depth * sines[:, 0], depth * (cosines[:, 0] - 1.0)
        poses[:, 3, 3] = 1.0
        return poses

    def _left(self, axes: FloatArray) -> FloatArray:
        """Return the (..., 2) shares left of the range of each axis."""
        low, high = self._tilt_turn.ranges[:, 0], self._tilt_turn.ranges[:, 1]
        return 1.0 - np.where(axes < 0.0, axes / low, axes / high)


# What follows from any table's kinematics: where the part stands, what is beside it, how long the table moves.


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
