"""Where a level of the distance has a crease: places as far from two sides of the part.

A place moved along the distance lands on one of the sheets beside a crease, never on it. Here the planes that touch
both sheets are cut with each other, again from closer by until neither turns any more [Kobbelt2001].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geoprint.layers.feet import Ground
from geoprint.model import BoolArray, FloatArray

# Sheets whose normals turn by less than this between the ends of an edge meet in no crease.
LEAST_BEND = np.deg2rad(8.0)
# So often planes are cut, each time at places on both sides that are nearer by this share of the edge.
CUTS, NEARER = 4, 0.02
# On both sides of a crease lies at least this share of an edge that passes it; it is no farther from its middle.
LEAST_SHARE, FARTHEST = 0.15, 0.5


class Creased(NamedTuple):
    """Where edges pass a crease.

    Attributes:
        places: (k, 3) [mm].
        found: (k,) whether there is one.
    """

    places: FloatArray
    found: BoolArray


def on_crease(ground: Ground, ends: FloatArray, *, height: float, tolerance: float) -> Creased:
    """Return where edges between two sheets of a level pass the crease in which these meet.

    Args:
        ground: the part.
        ends: (k, 2, 3) of each edge, near the level [mm].
        height: of the level over the part [mm].
        tolerance: how far from the level such a place may lie [mm].
    """
    middles: FloatArray = ends.mean(axis=1)
    places, near = middles, ends
    cosine = np.ones(len(ends))
    shares = np.zeros((len(ends), 2))
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    for cut in range(CUTS):
        feet = ground.feet(near.reshape(-1, 3)).places.reshape(near.shape)
        away = near - feet
        upright = away / np.maximum(np.linalg.norm(away, axis=2, keepdims=True), np.finfo(np.float64).tiny)
        missing = np.einsum("ksx,ksx->ks", upright, feet + height * upright - middles[:, None])
        cosine = np.einsum("kx,kx->k", upright[:, 0], upright[:, 1])
        square = np.maximum(1.0 - cosine**2, np.sin(LEAST_BEND) ** 2)[:, None]
        if cut == 0:
            shares = 2.0 * np.abs(missing) / np.maximum(lengths[:, None] * np.sqrt(square), np.finfo(np.float64).tiny)
        # The place nearest to the middle that lies in both planes moves along their normals alone.
        moves = (missing - cosine[:, None] * missing[:, ::-1]) / square
        places = middles + np.einsum("ks,ksx->kx", moves, upright)
        near = places[:, None] + NEARER * (ends - middles[:, None])
    off = np.abs(np.abs(ground.feet(places).distances) - height)
    moved = np.linalg.norm(places - middles, axis=1)
    passing = (cosine < np.cos(LEAST_BEND)) & (shares.min(axis=1) >= LEAST_SHARE) & (moved <= FARTHEST * lengths)
    return Creased(places, passing & (off <= tolerance))
