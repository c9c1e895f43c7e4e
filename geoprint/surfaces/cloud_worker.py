"""The child process that lays a surface through points, run as a script so that it imports little.

    python -I cloud_worker.py INPUT.npy OUTPUT.npz NEIGHBOURS DEPTH MEMORY_BYTES

INPUT holds (k, 3) points or (k, 6) points and normals. One thread, since several give other bytes in every run.
"""

from __future__ import annotations

import sys


def main() -> None:
    """Reconstruct by the command line and write vertices and faces."""
    source, target, neighbours, depth, memory = sys.argv[1:]
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (int(memory), int(memory)))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    import numpy as np
    import open3d

    given = np.load(source, allow_pickle=False)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(given[:, :3]))
    if given.shape[1] == 6:
        cloud.normals = open3d.utility.Vector3dVector(given[:, 3:])
    else:
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(int(neighbours)))
        cloud.orient_normals_consistent_tangent_plane(int(neighbours))
    mesh, _ = open3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=int(depth), n_threads=1)
    np.savez(target, vertices=np.asarray(mesh.vertices), faces=np.asarray(mesh.triangles))


if __name__ == "__main__":
    main()
