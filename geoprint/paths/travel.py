"""Moves between runs: lift off along the nozzle, cross over the part, come down along the nozzle."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray
from geoprint.surfaces import arc_lengths

# Travel is sampled this finely [mm], so that the joints' spline follows the straight line.
TRAVEL_STEP = 1.0
# A crossing counts as free of the part when it keeps this share of the retract height everywhere.
FREE_SHARE = 0.5


def crossing(
    start: FloatArray, end: FloatArray, *, up: FloatArray, retract: float, vertices: KDTree, top: float
) -> FloatArray:
    """Return the corners of the way between two lifted points.

    The straight line is taken where it stays clear of the part; else the way goes up over everything.

    Args:
        start: (3,) lifted end of the last run [mm].
        end: (3,) lifted start of the next one [mm].
        up: (3,) unit vector away from the table.
        retract: height of lifted points over the surface [mm].
        vertices: tree of the part's vertices, spaced closer than the retract height.
        top: highest coordinate of the part along `up` [mm].

    Returns:
        (c, 3) corners, c = 2 or 4; first is start, last is end.
    """
    direct = np.stack([start, end])
    line, _ = sampled_polyline(direct)
    nearest, _ = vertices.query(line)
    if float(np.min(nearest)) >= FREE_SHARE * retract:
        return direct
    raised = [over(point, up=up, retract=retract, top=top) for point in direct]
    return np.stack([start, *raised, end])


def over(point: FloatArray, *, up: FloatArray, retract: float, top: float) -> FloatArray:
    """Return the (3,) place straight above a point from where everything is below by two retract heights [mm]."""
    return point + max(top + 2.0 * retract - float(point @ up), 0.0) * up


def sampled_polyline(corners: FloatArray, *, step: float = TRAVEL_STEP) -> tuple[FloatArray, IntArray]:
    """Sample a polyline evenly between its corners, corners included.

    Args:
        corners: (c, 3) [mm], c >= 2.
        step: largest distance between neighbouring samples [mm].

    Returns:
        (k, 3) samples, and (c,) the rows of the corners among them.
    """
    arcs = arc_lengths(corners)
    counts = np.maximum(np.ceil(np.diff(arcs) / step).astype(np.int64), 1)
    rows = np.concatenate([[0], np.cumsum(counts)])
    pieces = np.repeat(np.arange(counts.size), counts)
    share = (np.arange(int(rows[-1])) - rows[pieces]) / counts[pieces]
    samples = corners[pieces] + share[:, None] * (corners[pieces + 1] - corners[pieces])
    return np.vstack([samples, corners[-1:]]), rows
