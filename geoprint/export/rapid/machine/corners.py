"""How far the tip goes where a controller rounds its corners by parabolas.

At the edge of a zone the tip leaves the straight line for a parabola that joins the next line as far behind the target
[ABBRapid, zonedata]: the quadratic Bezier curve from the entry over the target to the exit, whose length has a closed
form. A zone is never larger than half the distance to the nearer neighbour.
"""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray

# Shorter moves turn on the spot: no corner lies at their ends [mm].
ON_THE_SPOT = 1e-6
# At smaller halves of a turn [rad] a corner is as long as its two lines, by far less than a rounding.
_STRAIGHT = 1e-6


def rounded_lengths(places: FloatArray, zones: FloatArray) -> FloatArray:
    """Return how far the tip goes in each move to the next target, from the middle of a corner to that of the next.

    Args:
        places: (t, 3) of the targets [mm].
        zones: (t,) radius of the zone of each, 0 for a stop [mm].

    Returns:
        (t - 1,) lengths [mm].

    Examples:
        >>> places = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0]])
        >>> rounded_lengths(places, np.array([0.0, 1.0, 0.0])).round(4).tolist()
        [3.8116, 3.8116]
    """
    steps = np.diff(places, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    saved = np.zeros(len(places))
    along = steps / np.maximum(lengths, ON_THE_SPOT)[:, None]
    nearer = np.minimum(lengths[1:], lengths[:-1])
    sizes = np.where(nearer > ON_THE_SPOT, np.minimum(zones[1:-1], nearer / 2.0), 0.0)
    saved[1:-1] = sizes * _saved_share(along[:-1], along[1:])
    return lengths - saved[1:] - saved[:-1]


def _saved_share(before: FloatArray, behind: FloatArray) -> FloatArray:
    """Return (k,) by how much half a parabola is shorter than the radius of its zone, by that radius.

    With h half the angle by which the tip turns, half of it is (1 + cos(h)^2 / sin(h) asinh(tan(h))) / 2 long.
    """
    sine = np.linalg.norm(behind - before, axis=1) / 2.0
    cosine = np.linalg.norm(behind + before, axis=1) / 2.0
    turns = sine > _STRAIGHT
    sine = np.where(turns, sine, 1.0)
    half = (1.0 + cosine**2 / sine * np.arcsinh(sine / np.maximum(cosine, _STRAIGHT))) / 2.0
    return np.where(turns, 1.0 - half, 0.0)
