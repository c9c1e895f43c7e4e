"""Runs whose tip never turns back: where a line trembles or bends in a few fine steps, samples are left out.

Corners are rounded on the surface, but the tip runs at its stand-off, and a contour may tremble within less than a
corner's reach. Joints splined through such samples swing out; a chord within what counts as even replaces them. Creases
in which the stand-off itself would fold are dealt with before, by `lifting`: no sample has to go for them.
"""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray, IntArray
from geoprint.paths.lifting import lifting_normals
from geoprint.surfaces import arc_lengths

# Turns between neighbouring steps above this [rad] are cut: joints splined through fine steps about a sharper one swing
# out so far that no speed holds them.
LARGEST_TURN = np.radians(30.0)
# Above this turn [rad] the line goes back.
BACKTRACK = np.radians(90.0)
# What is cut off is not longer than so many times its largest distance: a small ring stays a ring.
LONGEST_CHORD = 3.0
# Steps shorter than this [mm] have no direction; their row is left out.
SHORTEST = 1e-9


def without_backtracks(
    places: FloatArray, outward: FloatArray, *, closed: bool, standoff: float, error: float
) -> IntArray:
    """Return the samples of one run that are kept so that its tip turns back nowhere and its corners are less sharp.

    Args:
        places: (k, 3) samples of the run on the surface [mm].
        outward: (k, 3) unit normals of the surface there.
        closed: whether the run ends where it starts.
        standoff: height of the tip over the surface [mm].
        error: largest distance of the tip's places that are left out from the chord over them [mm].

    Returns:
        Rising rows; the first and the last always are among them.
    """
    lifted = lifting_normals(places, outward, closed=closed, standoff=standoff)
    return unfolded(places + standoff * lifted, turn=LARGEST_TURN, error=error)


def unfolded(places: FloatArray, *, turn: float, error: float) -> IntArray:
    """Return the rows of a polyline that are kept so that it turns less, wherever leaving rows out makes it so.

    Of neighbouring turns above the angle the sharpest goes first, until none is left that may go: what runs back is
    eaten up from both its ends, a sharp corner is cut by a chord. Only where the line goes back may a row go that
    leaves a turn back beside it.

    Args:
        places: (k, 3) vertices [mm].
        turn: angle between neighbouring steps above which a row may go [rad].
        error: largest distance of a vertex that is left out from the chord over it [mm].

    Returns:
        Rising rows, the first and the last among them.
    """
    rows: IntArray = np.arange(len(places))
    arcs = arc_lengths(places)
    fixed = np.zeros(len(places), dtype=np.bool_)
    fixed[[0, -1]] = True
    while True:
        turns = _turns(places[rows])
        open_turns = np.where(fixed[rows], 0.0, turns)
        sharper = np.maximum(np.append(open_turns[1:], 0.0), np.insert(open_turns[:-1], 0, 0.0))
        sharpest = np.flatnonzero((open_turns > turn) & (open_turns >= sharper))
        if sharpest.size == 0:
            return rows
        going = np.zeros(rows.size, dtype=np.bool_)
        for at in sharpest.tolist():
            if going[at - 1]:
                continue
            before, after = int(rows[at - 1]), int(rows[at + 1])
            left = _turns(places[np.delete(rows[max(at - 2, 0) : at + 3], at - max(at - 2, 0))]).max()
            going[at] = (
                arcs[after] - arcs[before] <= LONGEST_CHORD * error
                and _farthest(places[before + 1 : after], places[before], places[after]) <= error
                and (left < BACKTRACK or turns[at] > BACKTRACK)
            )
            fixed[rows[at]] = not going[at]
        rows = rows[~going]


def _turns(places: FloatArray) -> FloatArray:
    """Return the (k,) angle at each vertex [rad]: 0 at the ends, half a turn where a step has no direction."""
    steps = np.diff(places, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    across = np.linalg.norm(np.cross(steps[:-1], steps[1:]), axis=1)
    turns = np.arctan2(across, np.einsum("ij,ij->i", steps[:-1], steps[1:]))
    turns[np.minimum(lengths[:-1], lengths[1:]) < SHORTEST] = np.pi
    return np.concatenate([[0.0], turns, [0.0]])


def _farthest(places: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return the largest distance of places from a segment [mm]."""
    along = end - start
    shares = (places - start) @ along / max(float(along @ along), SHORTEST**2)
    return float(np.linalg.norm(places - start - np.clip(shares, 0.0, 1.0)[:, None] * along, axis=1).max(initial=0.0))
