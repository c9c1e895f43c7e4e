"""What the controller may do where it rounds a target: the triangle that its corner path stays in.

A target with a zone is a fly-by point [ABBRapid, zonedata]: at the edge of the zone, `zone` before the target, the tip
leaves the straight line for a parabola that joins the next line as far behind the target; a zone is never larger than
half the distance to the nearer neighbour, and the controller may make it smaller where the tool turns much. The
attitude blends over the same stretch, because the program gives both zones the same size, and is at its end what it
would be without a zone. So, whatever the controller does there, every point of tool and arm stays within the triangle
of its places at the zone's entry, at the target and at the zone's exit: for the parabola, for one of a smaller zone,
and for the corner itself.

The checked path passes the *middle* of each triangle, halfway between the target and the middle of the chord from entry
to exit, where the parabola has its apex. With straight lines from middle to middle, no point of the triangles or of the
lines between the targets is farther from the path than the target is from the middle, falling linearly to the next one:
in coordinates along the chord (a, from -1 to 1) and from chord to target (b, from 0 to 1 - |a|), the path runs at
b = 1/2 - |a|/2 or below. What a point of the tool may be off there, the *rounding*, is added to what the check
inflates.
"""

from __future__ import annotations

import numpy as np

from geoprint import transforms
from geoprint.model import FloatArray

# The controller makes larger zones smaller than this share of the distance to a neighbour.
LARGEST_SHARE = 0.5
# Targets nearer than this [mm] have no line between them that a zone could lie on.
COINCIDENT = 1e-9


def triangle_middles(Ts_base_tool: FloatArray, zones: FloatArray) -> FloatArray:
    """Return where the checked path passes each target.

    Args:
        Ts_base_tool: (t, 4, 4) targets [mm].
        zones: (t,) radius of the zone of each [mm]; 0 where the tool stops, first and last among them.

    Returns:
        (t, 4, 4) the middle of each triangle; the target itself where its zone is 0, and at both ends.

    Examples:
        >>> corner = np.tile(np.eye(4), (3, 1, 1))
        >>> corner[:, :2, 3] = [[0, 0], [4, 0], [4, 4]]
        >>> triangle_middles(corner, np.array([0.0, 1.0, 0.0]))[1, :3, 3]
        array([3.75, 0.25, 0.  ])
    """
    middles = Ts_base_tool.copy()
    lengths = np.linalg.norm(np.diff(Ts_base_tool[:, :3, 3], axis=0), axis=1)
    inner = 1 + np.flatnonzero((zones[1:-1] > 0.0) & (np.minimum(lengths[:-1], lengths[1:]) > COINCIDENT))
    before, at, behind = Ts_base_tool[inner - 1], Ts_base_tool[inner], Ts_base_tool[inner + 1]
    entries = transforms.interpolate_poses(at, before, np.minimum(zones[inner] / lengths[inner - 1], LARGEST_SHARE))
    exits = transforms.interpolate_poses(at, behind, np.minimum(zones[inner] / lengths[inner], LARGEST_SHARE))
    halves = np.full(len(inner), 0.5)
    middles[inner] = transforms.interpolate_poses(at, transforms.interpolate_poses(entries, exits, halves), halves)
    return middles
