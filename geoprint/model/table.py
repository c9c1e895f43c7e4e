"""The table that moves the part: as a cell describes it, and what plans ask of it. Lengths in mm, angles in rad.

The table's frame stands at the middle of its plate at rest: z up, against gravity, x and y in the plate. The plate's
frame moves with the plate, and is the table's frame at rest: `T_table_plate` is the identity there.
"""

from __future__ import annotations

from typing import Protocol, final

import numpy as np

from geoprint.errors import InputError
from geoprint.model.values import FloatArray, freeze_arrays, frozen


@final
@frozen
class Hexapod:
    """A plate on six legs whose lengths are driven: a Stewart platform.

    Attributes:
        name: what messages call it.
        T_base_table: (4, 4) the table's frame in the robot's base.
        base_joints: (6, 3) where the legs are hinged below, in the table's frame [mm].
        plate_joints: (6, 3) where the same legs are hinged above, in the plate's frame [mm].
        lengths: (2,) shortest and longest leg, from joint to joint [mm].
        base_cone: largest angle of a leg at its lower joint from how it stands at rest [rad].
        plate_cone: the same at its upper joint, seen from the plate [rad].
        leg_diameter: of the cylinder that holds a leg [mm].
        leg_speed: largest speed at which a leg's length changes [mm/s].
        pivot: height over the middle of the plate about which the plate tilts [mm].
        plate_diameter: [mm].
        plate_thickness: [mm].
        base_diameter: of the cylinder below the lower joints [mm].
        base_height: of that cylinder [mm].
        overlap: of the beads where one is interrupted and goes on in another attitude [mm].
    """

    name: str
    T_base_table: FloatArray
    base_joints: FloatArray
    plate_joints: FloatArray
    lengths: FloatArray
    base_cone: float
    plate_cone: float
    leg_diameter: float
    leg_speed: float
    pivot: float
    plate_diameter: float
    plate_thickness: float
    base_diameter: float
    base_height: float
    overlap: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, T_base_table="float: 4 4", base_joints="float: 6 3", plate_joints="float: 6 3", lengths="float: 2"
        )
        if not 0.0 < self.lengths[0] < self.lengths[1]:
            raise InputError(
                f"{self.name}: the legs are {self.lengths.tolist()} mm long; give the shortest, then the longest."
            )


@final
@frozen
class TiltTurn:
    """A plate that turns about its own axis, on a hub that tilts about a level one: two rotary axes.

    The tilting axis is parallel to the table's x axis and meets the plate's axis of turning. A stand holds it on the
    side of the negative x axis.

    Attributes:
        name: what messages call it.
        T_base_table: (4, 4) the table's frame in the robot's base.
        ranges: (2, 2) lowest and highest angle of tilting, of turning [rad].
        speeds: (2,) largest speed of tilting, of turning [rad/s].
        axis_depth: of the tilting axis below the top of the plate at rest, negative above [mm].
        plate_diameter: [mm].
        plate_thickness: [mm].
        hub_diameter: of the cylinder below the plate that turns it [mm].
        hub_length: [mm].
        stand_distance: from the plate's axis to the post, along the tilting axis [mm].
        stand_diameter: of the post, and of the beam from it to the hub [mm].
        stand_height: of the tilting axis over the post's foot [mm].
        overlap: of the beads where one is interrupted and goes on in another attitude [mm].
        unit: mechanical unit of the arm's controller that tilts and turns the plate as its axes a and b; None where
            somebody else brings the plate to its attitudes.
    """

    name: str
    T_base_table: FloatArray
    ranges: FloatArray
    speeds: FloatArray
    axis_depth: float
    plate_diameter: float
    plate_thickness: float
    hub_diameter: float
    hub_length: float
    stand_distance: float
    stand_diameter: float
    stand_height: float
    overlap: float
    unit: str | None

    def __post_init__(self) -> None:
        freeze_arrays(self, T_base_table="float: 4 4", ranges="float: 2 2", speeds="float: 2")
        if not ((self.ranges[:, 0] < 0.0) & (self.ranges[:, 1] > 0.0)).all():
            raise InputError(
                f"{self.name}: the ranges of its axes are {np.degrees(self.ranges).round(1).tolist()} degrees; each "
                "must begin below 0 and end above, because the table rests there."
            )


@final
@frozen
class Cylinder:
    """A solid of a table, in the robot's base as the table stands.

    Attributes:
        name: what messages call it.
        start: (3,) middle of one end [mm].
        end: (3,) middle of the other end [mm].
        radius: [mm].
    """

    name: str
    start: FloatArray
    end: FloatArray
    radius: float

    def __post_init__(self) -> None:
        freeze_arrays(self, start="float: 3", end="float: 3")


@final
@frozen
class TablePose:
    """How a table holds the part while one attitude is printed.

    Attributes:
        number: of the attitude, from 1, in the order of printing.
        T_table_plate: (4, 4) the plate's pose.
        axes: (m,) values of the table's axes: lengths of its legs, or angles of tilting and turning [mm or rad].
    """

    number: int
    T_table_plate: FloatArray
    axes: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, T_table_plate="float: 4 4", axes="float: m")


class TiltingTable(Protocol):
    """What moves the part between stretches of printing; n poses of its plate at a time."""

    @property
    def name(self) -> str:
        """What messages call it."""
        ...

    @property
    def T_base_table(self) -> FloatArray:
        """(4, 4) the table's frame in the robot's base."""
        ...

    @property
    def rotary(self) -> bool:
        """Whether its axes turn, so that their values are angles; else they are lengths."""
        ...

    @property
    def speeds(self) -> FloatArray:
        """(m,) largest speeds of its m axes [mm/s or rad/s]."""
        ...

    def plates(self, ups: FloatArray) -> FloatArray:
        """Return the (n, 4, 4) poses of the plate that turn (n, 3) unit directions of it up; limits are not applied."""
        ...

    def axes(self, Ts_table_plate: FloatArray) -> FloatArray:
        """Return the (n, m) values of its axes at (n, 4, 4) poses of the plate [mm or rad]; limits are not applied.

        Raises:
            ReachError: its axes cannot bring the plate there, however far they go.
        """
        ...

    def plate(self, axes: FloatArray) -> FloatArray:
        """Return the (4, 4) pose of the plate at (m,) values of its axes [mm or rad].

        Raises:
            ReachError: there is no such pose, or its axes do not hold the plate there.
        """
        ...

    def margins(self, Ts_table_plate: FloatArray) -> FloatArray:
        """Return the smallest share left of any limit at (n, 4, 4) poses of the plate.

        Returns:
            (n,) shares without a unit: of each limit 1 is left at rest, 0 at the limit, and less beyond.
        """
        ...

    def solids(self, T_table_plate: FloatArray) -> tuple[Cylinder, ...]:
        """Return what of the table may be touched at a (4, 4) pose of the plate, in the robot's base."""
        ...
