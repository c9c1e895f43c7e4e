"""Bands: surfaces with two boundary loops about the z axis, irregularly triangulated."""

from __future__ import annotations

import numpy as np

from geoprint.model import Surface
from tests.meshes import annulus


def band(
    *,
    low: float,
    high: float,
    height: float,
    bulge: float = 0.0,
    wave: float = 0.0,
    divisions: tuple[int, int] = (72, 16),
) -> Surface:
    """Return the band of a cone between two radii, bulging in the middle, its lower loop a wave up and down."""
    flat = annulus(inner=1.0, outer=2.0, divisions=divisions, jitter_seed=3)
    x, y, _ = flat.vertices.T
    share, turn = np.hypot(x, y) - 1.0, np.arctan2(y, x)
    up = (height + wave * np.sin(5 * turn)) * (1.0 - share)
    radius = low + (high - low) * up / height + 4.0 * bulge * share * (1.0 - share)
    return Surface(np.column_stack([radius * np.cos(turn), radius * np.sin(turn), up]), flat.faces)
