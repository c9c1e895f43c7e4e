"""Zones that targets must have, and where their rounded corners pass, for whoever checks them."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray
from geoprint.postprocessor.orders import Orders

# Moves shorter than this [mm] turn the tool; the tip's speed means nothing there.
TURN_ON_THE_SPOT = 1e-3
# The largest zone that is asked for, and how much higher the path is driven dry [mm].
LARGEST_ZONE, LIFT = 0.3, 20.0
# Joints from the inverse agree with those of the trajectory between its rows to this [rad], and by so much more for
# each mm that a target stands outside of a bend.
JOINT_TOLERANCE, JOINTS_PER_MM = 1e-3, 0.03


def largest_zones(orders: Orders) -> FloatArray:
    """Return (t,) the zone of each target by its neighbours, runs and laying alone [mm]."""
    distances = np.linalg.norm(np.diff(orders.tips, axis=0), axis=1)
    nearer = np.minimum(np.append(distances, 0.0), np.append(0.0, distances))
    borders = np.diff(orders.runs) != 0
    stops = np.append(borders, np.True_) | np.append(np.True_, borders)
    stops |= np.diff(orders.deposited.astype(np.int8), prepend=0) != 0
    return np.where(stops | (nearer < TURN_ON_THE_SPOT), 0.0, np.minimum(nearer / 2.0, LARGEST_ZONE))


def corner_middles(orders: Orders) -> FloatArray:
    """Return (t, 3) the middle of the parabola about each target, with the zone that its neighbours give [mm]."""
    steps = np.diff(orders.tips, axis=0)
    along = steps / np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), TURN_ON_THE_SPOT)
    zones = largest_zones(orders)[1:-1, None]
    entries, exits = orders.tips[1:-1] - zones * along[:-1], orders.tips[1:-1] + zones * along[1:]
    middles = orders.tips.copy()
    middles[1:-1] = (entries + 2.0 * orders.tips[1:-1] + exits) / 4.0
    return middles


def joint_tolerances(orders: Orders) -> FloatArray:
    """Return (t,) how far joints at the targets may be off those of the trajectory as it passes them [rad]."""
    beside = np.linalg.norm(corner_middles(orders) - orders.tips, axis=1)
    return JOINT_TOLERANCE + JOINTS_PER_MM * beside
