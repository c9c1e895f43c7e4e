"""What the child process does that lays a surface through points with open3d; a script, so that it imports little."""

from __future__ import annotations

import os
import sys
from io import BytesIO

# Cells are all at least as fine as this, wherever the points lie.
FULL_DEPTH = 5


def work(data: bytes, depth: str) -> bytes:
    """Return an NPZ file of the vertices and faces of a Poisson reconstruction.

    Args:
        data: an NPY file of (k, 6) points and unit normals.
        depth: of the octree.
    """
    if sys.platform == "linux":
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    import numpy as np
    import open3d as o3d

    given, deepest = np.load(BytesIO(data), allow_pickle=False), int(depth)
    cloud = o3d.geometry.PointCloud()
    cloud.points = o3d.utility.Vector3dVector(given[:, :3])
    cloud.normals = o3d.utility.Vector3dVector(given[:, 3:])
    # Several threads give the vertices in another order each time.
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
        cloud, depth=deepest, full_depth=min(FULL_DEPTH, deepest), n_threads=1
    )
    target = BytesIO()
    np.savez(target, vertices=np.asarray(mesh.vertices), faces=np.asarray(mesh.triangles))
    return target.getvalue()
