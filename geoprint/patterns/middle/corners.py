"""Tips of corners drawn outwards: between the tip of a sharp corner and the corner outside of it a gap stays open.

Level curves turn by the same angle on a ridge that they cross. With half the angle b between the two sides of a corner
tips lie w / sin(b) apart along the ridge, and the place between them that is farthest from both is w / (1 + sin(b))
from either. A tip that reaches x farther out leaves (w - x sin(b)) / (1 + sin(b)).
"""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray
from geoprint.patterns.middle.strands import STEP_SHARE, Strands

# Half of the stretch over which a corner turns, over the spacing.
HALF_CORNER = 0.5
# What lies farther than this from a bead is missed, over the spacing.
MISSED = 0.55
# Corners that turn less leave next to nothing open.
LEAST_TURN = np.radians(60.0)
# A tip reaches no farther than so many spacings: a longer finger would be laid twice.
MOST_REACH = 0.25
# Half of the foot of the finger, over the spacing.
FOOT = 0.6


def drawn_out(strands: Strands, places: FloatArray) -> FloatArray:
    """Return the (k, 3) places of samples with the tips of convex corners drawn outwards [mm].

    Args:
        strands: k samples; those of the outermost level stay, outside of them is the rim.
        places: (k, 3) where the samples are now [mm].
    """
    result = places.copy()
    for strand in range(strands.count):
        held = strands.rows(strand)
        if strands.levels[held.start] > 0:
            closed = bool(strands.closed[strand])
            result[held] += _reaches(places[held], strands.normals[held], closed=closed, spacing=strands.spacing)
    return result


def _reaches(line: FloatArray, normals: FloatArray, *, closed: bool, spacing: float) -> FloatArray:
    """Return how far each place of a strand (n, 3) is to move [mm]."""
    moved = np.zeros_like(line)
    half = round(HALF_CORNER / STEP_SHARE)
    if len(line) < 4 * half:
        return moved
    ahead = np.roll(line, -1, axis=0) - line
    steps = np.linalg.norm(ahead, axis=1, keepdims=True)
    ahead = np.divide(ahead, steps, out=np.zeros_like(ahead), where=steps > 0.0)
    before, behind = np.roll(ahead, half + 1, axis=0), np.roll(ahead, -half, axis=0)
    turns = np.arctan2(np.einsum("nx,nx->n", np.cross(before, behind), normals), np.einsum("nx,nx->n", before, behind))
    if not closed:
        turns[: half + 1] = turns[-half - 1 :] = 0.0
    arcs, length = np.cumsum(steps[:, 0]) - steps[:, 0], float(steps.sum())
    while turns.max() > LEAST_TURN:
        tip = int(turns.argmax())
        away = np.abs(arcs - arcs[tip])
        away = np.minimum(away, length - away) if closed else away
        outwards = before[tip] - behind[tip]
        foot = np.clip(1.0 - away / (FOOT * spacing), 0.0, 1.0)
        moved += _reach(turns[tip]) * spacing * foot[:, None] * outwards / np.linalg.norm(outwards)
        turns = np.where(away < spacing, 0.0, turns)
    return moved


def _reach(turn: float) -> float:
    """Return how far a tip is to reach so that nothing stays open outside of it [spacings]."""
    sine = max(np.cos(0.5 * turn), 1e-3)
    return float(np.clip((1.0 - MISSED * (1.0 + sine)) / sine, 0.0, MOST_REACH))
