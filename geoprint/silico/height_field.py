"""How high material stands over a part: the beads of a print in silico, added up where they meet.

Every place of a bead lays its volume as the cap of a sphere pressed flat: its height at distance r is that of
sqrt(R^2 - r^2), with R half the width. Along a straight bead these add up to a parabola across, whose area is the
volume laid per length; round a corner, at an end and where beads overlap nothing is lost or counted twice.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray
from geoprint.silico.laid import LaidBeads

# Feet that are asked for at once: a hundred places of beads about each, at most, take 0.1 GB.
BATCH = 20_000


def heights(beads: LaidBeads, feet: FloatArray) -> FloatArray:
    """Return the (k,) height of the material over places of the part, along the normals there [mm].

    Args:
        beads: that are laid.
        feet: (k, 3) on the part [mm].
    """
    there = np.flatnonzero(beads.widths > 0.0)
    result = np.zeros(len(feet))
    if not there.size:
        return result
    volumes = beads.volumes[there]
    radii = 0.5 * beads.widths[there]
    tree, reach = KDTree(beads.places[there]), float(radii.max())
    for start in range(0, len(feet), BATCH):
        some = feet[start : start + BATCH]
        near = KDTree(some).sparse_distance_matrix(tree, reach, output_type="ndarray")
        foot, place, away = near["i"], near["j"], near["v"]
        radius = radii[place]
        cap = np.sqrt(np.maximum(radius**2 - away**2, 0.0))
        laid = 1.5 * volumes[place] * cap / (np.pi * radius**3)
        result[start : start + BATCH] = np.bincount(foot, laid, minlength=len(some))
    return result
