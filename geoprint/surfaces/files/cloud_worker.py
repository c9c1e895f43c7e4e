"""The child process that lays a surface through points, run as a script so that it imports little.

    python -I cloud_worker.py INPUT.npy OUTPUT.npz DEPTH MEMORY_BYTES

INPUT holds (k, 6) points and unit normals.
"""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Reconstruct by the command line and write vertices and faces."""
    source, target, depth, memory = sys.argv[1:]
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (int(memory), int(memory)))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":
        # Several threads give the vertices in another order each time.
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    import numpy as np
    from lagrange.poisson import mesh_from_oriented_points

    given = np.load(source, allow_pickle=False)
    points, normals = np.ascontiguousarray(given[:, :3]), np.ascontiguousarray(given[:, 3:])
    mesh = mesh_from_oriented_points(points, normals, octree_depth=int(depth))
    np.savez(target, vertices=np.asarray(mesh.vertices), faces=np.asarray(mesh.facets))


if __name__ == "__main__":
    main()
