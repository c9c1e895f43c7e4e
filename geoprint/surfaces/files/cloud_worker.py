"""What the child process does that lays a surface through points; a script, so that it imports little."""

from __future__ import annotations

import os
import sys
from io import BytesIO


def work(data: bytes, depth: str) -> bytes:
    """Return an NPZ file of the vertices and faces of a Poisson reconstruction.

    Args:
        data: an NPY file of (k, 6) points and unit normals.
        depth: of the octree.
    """
    if sys.platform == "linux":
        # Several threads give the vertices in another order each time.
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    import numpy as np
    from lagrange.poisson import mesh_from_oriented_points

    given = np.load(BytesIO(data), allow_pickle=False)
    points, normals = np.ascontiguousarray(given[:, :3]), np.ascontiguousarray(given[:, 3:])
    mesh = mesh_from_oriented_points(points, normals, octree_depth=int(depth))
    target = BytesIO()
    np.savez(target, vertices=np.asarray(mesh.vertices), faces=np.asarray(mesh.facets))
    return target.getvalue()
