"""Six legs between a base and a plate: lengths, directions, distances and the Jacobian, for many poses at once."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from geoprint.model import FloatArray, Hexapod

LEGS = 6
# Every leg with every other.
PAIRS = np.array(list(combinations(range(LEGS), 2)))
# Two legs are parallel where the squared sine of their angle is below this: then any point of one serves as well.
PARALLEL = 1e-12


class Legs(NamedTuple):
    """The legs at n poses of the plate.

    Attributes:
        feet: (6, 3) lower joints in the table's frame [mm].
        heads: (n, 6, 3) upper joints in the table's frame [mm].
        arms: (n, 6, 3) from the plate's origin to the upper joints, in the table's frame [mm].
        lengths: (n, 6) from joint to joint [mm].
        directions: (n, 6, 3) unit vectors up the legs, in the table's frame.
        from_plate: (n, 6, 3) the same in the plate's frame.
    """

    feet: FloatArray
    heads: FloatArray
    arms: FloatArray
    lengths: FloatArray
    directions: FloatArray
    from_plate: FloatArray


def legs_at(hexapod: Hexapod, Ts_table_plate: FloatArray) -> Legs:
    """Return the legs at (n, 4, 4) poses of the plate: l_i = |t + R q_i - b_i|, the closed form [Merlet2006]."""
    rotations = Ts_table_plate[:, :3, :3]
    arms = hexapod.plate_joints @ np.swapaxes(rotations, 1, 2)
    heads = arms + Ts_table_plate[:, None, :3, 3]
    spans = heads - hexapod.base_joints
    lengths = np.sqrt(np.einsum("nij,nij->ni", spans, spans))
    directions = spans / lengths[..., None]
    return Legs(hexapod.base_joints, heads, arms, lengths, directions, directions @ rotations)


def jacobians(legs: Legs, *, scale: float) -> FloatArray:
    """Return how the legs' lengths follow the plate: (n, 6, 6), a leg a row.

    Args:
        legs: at n poses.
        scale: length by which a turn counts [mm], so that all six columns have one unit.

    Returns:
        Derivatives by a shift of the plate's origin [mm] and by a turn about it [rad times the scale], both in the
        table's frame [Merlet2006].
    """
    return np.concatenate([legs.directions, np.cross(legs.arms, legs.directions) / scale], axis=2)


def distances(legs: Legs) -> FloatArray:
    """Return the (n, 15) distances between the axes of any two legs, from joint to joint [mm] [Ericson2005]."""
    one, other = PAIRS.T
    along = legs.heads - legs.feet
    first, second = along[:, one], along[:, other]
    apart = (legs.feet[one] - legs.feet[other])[None]
    lengths = legs.lengths**2
    a, e = lengths[:, one], lengths[:, other]
    b = _dot(first, second)
    c, f = _dot(first, apart), _dot(second, apart)
    sine = a * e - b * b
    s = np.where(sine > PARALLEL * a * e, (b * f - c * e) / np.maximum(sine, PARALLEL * a * e), 0.0)
    s = np.clip(s, 0.0, 1.0)
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    # The nearest point of the first leg to where the second was cut off; the same where it was not.
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    between = apart + s[..., None] * first - t[..., None] * second
    return np.sqrt(_dot(between, between))


def _dot(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("...i,...i->...", one, other))
