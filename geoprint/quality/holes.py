"""The largest piece of a surface that no path covers."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from geoprint.model import FloatArray
from geoprint.quality.coverage import TRIANGLE_SHARE, Coverage
from geoprint.quality.oracle import FlatMesh, spatial

# Middles of triangles that share an edge are nearer together than this share of the side that they are cut to.
NEIGHBOURS_SHARE = 0.7


def largest_hole(mesh: FlatMesh, covered: Coverage, *, spacing: float) -> float:
    """Return the area of the largest connected piece farther than 0.55 spacings from every run [mm2].

    Small triangles hang together where their middles are as near as those of neighbours, so that a seam narrower than
    a quarter of a spacing between two pieces does not part them.

    Args:
        mesh: m triangles.
        covered: by the path.
        spacing: wanted [mm].
    """
    bare = np.flatnonzero(covered.missed > 0.0)
    if not bare.size:
        return 0.0
    places: FloatArray = spatial(mesh, covered.places)[bare]
    pairs = KDTree(places).query_pairs(NEIGHBOURS_SHARE * TRIANGLE_SHARE * spacing, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(bare.size, bare.size))
    _, pieces = connected_components(links, directed=False)
    return float(np.bincount(pieces, covered.missed[bare]).max())
