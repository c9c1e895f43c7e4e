"""Tips of corners drawn outwards: between the tip of a sharp corner and the corner outside of it a gap stays open.

Level curves turn by the same angle on a ridge that they cross. With half the angle b between the two sides of a corner
tips lie w / sin(b) apart along the ridge, and the place between them that is farthest from both is w / (1 + sin(b))
from either. A tip that reaches x farther out leaves (w - x sin(b)) / (1 + sin(b)).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import GAP_SHARE, FloatArray
from geoprint.patterns.middle.strands import STEP_SHARE, Strands

# Half of the stretch over which a corner turns, over the spacing.
HALF_CORNER = 0.5
# Corners that turn less leave next to nothing open.
LEAST_TURN = np.radians(60.0)
# A tip reaches no farther than so many spacings: a longer finger would be laid twice, or cut at its sharp end.
MOST_REACH = 0.15
# Nothing is open outside of a tip where a bead is within so many spacings of the place as far outside of it.
SERVED = 0.6
# Half of the foot of the finger, over the spacing.
FOOT = 0.6


def drawn_out(strands: Strands, places: FloatArray, beads: FloatArray) -> FloatArray:
    """Return the (k, 3) places of samples with the tips of convex corners drawn outwards [mm].

    Args:
        strands: k samples; those of the outermost level stay, outside of them is the rim.
        places: (k, 3) where the samples are now [mm].
        beads: (j, 3) places along beads on ridges; tips with one outside of them stay [mm].
    """
    result = places.copy()
    laid = KDTree(beads) if len(beads) else None
    for strand in range(strands.count):
        held = strands.rows(strand)
        if strands.levels[held.start] > 0:
            closed = bool(strands.closed[strand])
            moves = _reaches(places[held], strands.normals[held], laid, closed=closed, spacing=strands.spacing)
            result[held] += moves
    return result


def _reaches(line: FloatArray, normals: FloatArray, laid: KDTree | None, *, closed: bool, spacing: float) -> FloatArray:
    """Return how far each place of a strand (n, 3) is to move; nowhere with a bead outside of it [mm]."""
    moved = np.zeros_like(line)
    half = round(HALF_CORNER / STEP_SHARE)
    if len(line) < 4 * half:
        return moved
    ahead = np.roll(line, -1, axis=0) - line
    steps = np.linalg.norm(ahead, axis=1, keepdims=True)
    ahead = np.divide(ahead, steps, out=np.zeros_like(ahead), where=steps > 0.0)
    # A corner is where narrow windows turn as much as wide ones.
    windows = [_turns(ahead, normals, half=each, closed=closed) for each in range(half + 1)]
    turns, sharpness = windows[-1], np.sum(windows, axis=0)
    arcs, length = np.cumsum(steps[:, 0]) - steps[:, 0], float(steps.sum())
    while turns.max() > LEAST_TURN:
        tip = int(np.where(turns > LEAST_TURN, sharpness, -np.inf).argmax())
        away = np.abs(arcs - arcs[tip])
        away = np.minimum(away, length - away) if closed else away
        outwards = np.roll(ahead, half + 1, axis=0)[tip] - np.roll(ahead, -half, axis=0)[tip]
        foot = np.clip(1.0 - away / (FOOT * spacing), 0.0, 1.0)
        outwards /= np.linalg.norm(outwards)
        if laid is None or laid.query(line[tip] + SERVED * spacing * outwards)[0] > SERVED * spacing:
            moved += _reach(turns[tip]) * spacing * foot[:, None] * outwards
        turns = np.where(away < spacing, 0.0, turns)
    return moved


def _turns(ahead: FloatArray, normals: FloatArray, *, half: int, closed: bool) -> FloatArray:
    """Return the (n,) angles by which a strand turns towards the inside within so many samples to both sides [rad].

    Args:
        ahead: (n, 3) directions from each sample to the next.
        normals: (n, 3) of the surface.
        half: samples to either side.
        closed: whether the strand is.
    """
    before, behind = np.roll(ahead, half + 1, axis=0), np.roll(ahead, -half, axis=0)
    turns = np.arctan2(np.einsum("nx,nx->n", np.cross(before, behind), normals), np.einsum("nx,nx->n", before, behind))
    if not closed:
        turns[: half + 1] = turns[-half - 1 :] = 0.0
    return turns


def _reach(turn: float) -> float:
    """Return how far a tip is to reach so that nothing stays open outside of it [spacings]."""
    sine = max(np.cos(0.5 * turn), 1e-3)
    return float(np.clip((1.0 - GAP_SHARE * (1.0 + sine)) / sine, 0.0, MOST_REACH))
