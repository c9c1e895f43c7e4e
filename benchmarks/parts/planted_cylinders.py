"""The solids of a table that tilts the part, from what its cell says of it, and patches of cylinders for any distance.

Plate, legs, hub and stand are built here anew from the lengths in the cell and from the plate's pose: nothing is asked
of the table's kinematics or of the collision check.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.model import BoolArray, Cylinder, FloatArray, Hexapod, IntArray, TiltTurn

# Each cylinder's side and both ends begin as so many patches, an eighth of a turn to either side of their middles.
QUARTERS = 4
# A direction whose share along an axis is larger than this meets the end of a cylinder first, else its side.
STEEP = 0.8


@final
@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """Patches of the surfaces of cylinders.

    Attributes:
        cylinders: that they lie on.
        own: (n,) which of these.
        ends: (n,) 0 on the side, -1 and 1 on the end at the start and on the other.
        middles: (n, 2) angle about the axis [rad], and share of the length, or on an end of the radius.
        halves: (n, 2) by how much a patch goes beyond its middle to either side.
    """

    cylinders: Sequence[Cylinder]
    own: IntArray
    ends: IntArray
    middles: FloatArray
    halves: FloatArray

    @classmethod
    def of(cls, cylinders: Sequence[Cylinder]) -> Patches:
        """Return patches that together are the surfaces of cylinders."""
        own, ends, turns = (
            each.ravel() for each in np.meshgrid(range(len(cylinders)), [-1, 0, 1], range(QUARTERS), indexing="ij")
        )
        halves = np.tile([np.pi / QUARTERS, 0.5], (len(own), 1))
        middles = np.column_stack([2.0 * np.pi * turns / QUARTERS, np.full(len(own), 0.5)])
        return cls(cylinders, own, ends, middles, halves)

    def balls(self) -> tuple[FloatArray, FloatArray]:
        """Return the (n, 3) middles of the patches, and the (n,) radii of the balls about them that hold them [mm]."""
        at = self._points(self.middles)
        # Distance from the middle grows with the angle, and towards both ends of the other range: a corner is farthest.
        corners = np.stack([self._points(self.middles + self.halves * [i, j]) for i in (-1, 1) for j in (-1, 1)])
        return at, np.linalg.norm(corners - at, axis=2).max(axis=0)

    def split(self, kept: BoolArray) -> Patches:
        """Return the quarters of those of n patches that are kept."""
        middles, halves = self.middles[kept], self.halves[kept] / 2.0
        quarters = np.concatenate([middles + halves * [i, j] for i in (-1, 1) for j in (-1, 1)])
        return replace(
            self,
            own=np.tile(self.own[kept], 4),
            ends=np.tile(self.ends[kept], 4),
            middles=quarters,
            halves=np.tile(halves, (4, 1)),
        )

    def _points(self, places: FloatArray) -> FloatArray:
        starts, along = _axes_of(self.cylinders)
        radii = np.array([one.radius for one in self.cylinders])[self.own]
        x, y = _across(along)
        angles, shares = places.T
        outwards = np.cos(angles)[:, None] * x[self.own] + np.sin(angles)[:, None] * y[self.own]
        out = radii * np.where(self.ends == 0, 1.0, shares)
        up = np.where(self.ends == 0, shares, (self.ends + 1) / 2.0)
        return starts[self.own] + up[:, None] * along[self.own] + out[:, None] * outwards


def facing(cylinder: Cylinder, outward: FloatArray, random: np.random.Generator) -> FloatArray:
    """Return a random (3,) point of a cylinder's surface, on the side that a (3,) unit direction meets from outside."""
    (start,), (along,) = _axes_of([cylinder])
    axis = along / np.linalg.norm(along)
    rise = float(outward @ axis)
    x, y = _across(axis[None])
    if abs(rise) > STEEP:
        turn, out = 2.0 * np.pi * float(random.random()), cylinder.radius * float(np.sqrt(random.random()))
        return start + (rise < 0.0) * along + out * (np.cos(turn) * x[0] + np.sin(turn) * y[0])
    aside = outward - rise * axis
    return start + float(random.random()) * along - cylinder.radius * aside / np.linalg.norm(aside)


def table_cylinders(table: Hexapod | TiltTurn, T_table_plate: FloatArray) -> list[Cylinder]:
    """Return the solids of a table at a (4, 4) pose of its plate, in the robot's base."""
    T_base_plate = table.T_base_table @ T_table_plate
    under = -table.plate_thickness
    plate = _cylinder("table's plate", T_base_plate, (0.0, 0.0, 0.0), (0.0, 0.0, under), table.plate_diameter)
    if isinstance(table, TiltTurn):
        deep, end = under - table.hub_length, (-table.stand_distance, 0.0, -table.axis_depth)
        foot = (end[0], 0.0, end[2] - table.stand_height)
        hub = _cylinder("table's hub", T_base_plate, (0.0, 0.0, under), (0.0, 0.0, deep), table.hub_diameter)
        beam = _cylinder("table's beam", table.T_base_table, (0.0, 0.0, end[2]), end, table.stand_diameter)
        return [plate, hub, beam, _cylinder("table's post", table.T_base_table, end, foot, table.stand_diameter)]
    feet = transforms.apply(table.T_base_table, table.base_joints)
    heads = transforms.apply(T_base_plate, table.plate_joints)
    legs = [
        Cylinder(f"table's leg {number}", foot, head, table.leg_diameter / 2.0)
        for number, (foot, head) in enumerate(zip(feet, heads, strict=True), start=1)
    ]
    low = float(table.base_joints[:, 2].min())
    base = ((0.0, 0.0, low), (0.0, 0.0, low - table.base_height))
    return [plate, *legs, _cylinder("table's base", table.T_base_table, *base, table.base_diameter)]


def _cylinder(
    name: str,
    T_base_own: FloatArray,
    start: tuple[float, float, float],
    end: tuple[float, float, float],
    diameter: float,
) -> Cylinder:
    ends = transforms.apply(T_base_own, np.array([start, end]))
    return Cylinder(name, ends[0], ends[1], diameter / 2.0)


def _axes_of(cylinders: Sequence[Cylinder]) -> tuple[FloatArray, FloatArray]:
    starts = np.stack([one.start for one in cylinders])
    return starts, np.stack([one.end for one in cylinders]) - starts


def _across(along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (n, 3) unit vectors across (n, 3) axes, and across these and one another."""
    x = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(along, x)
    return x, y / np.linalg.norm(y, axis=1, keepdims=True)
