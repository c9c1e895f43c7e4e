"""What the child process does that brings a scan near its part with open3d; a script, so that it imports little."""

from __future__ import annotations

import os
import sys
from io import BytesIO


def work(data: bytes) -> bytes:
    """Return an NPY file of the (s, 4, 4) poses at which a scan lies on its part, one from each start.

    From each start points are drawn to the nearest ones of the part [Besl1992], from ever less far, so that what lies
    beside it comes in; planes would let a flat part slide. If asked for, features that are found in both clouds (FPFH,
    RANSAC) give one more start, the first one.

    Args:
        data: an NPZ file of `scan` (k, 3), `places` and `normals` (n, 3) of the part, `starts` (s, 4, 4), `reaches`
            (r,), `feature`, the radius of features or 0 for none.
    """
    if sys.platform == "linux":
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})  # several threads give other last digits each time
    import numpy as np
    import open3d as o3d

    o3d.utility.random.seed(24)
    registration = o3d.pipelines.registration
    with np.load(BytesIO(data), allow_pickle=False) as given:
        scan, part = o3d.geometry.PointCloud(), o3d.geometry.PointCloud()
        scan.points = o3d.utility.Vector3dVector(given["scan"])
        part.points = o3d.utility.Vector3dVector(given["places"])
        part.normals = o3d.utility.Vector3dVector(given["normals"])
        starts, reaches, feature = list(given["starts"]), given["reaches"].tolist(), float(given["feature"])
    if feature > 0.0:
        near = o3d.geometry.KDTreeSearchParamHybrid(radius=feature, max_nn=100)
        coarse = [cloud.voxel_down_sample(0.4 * feature) for cloud in (scan, part)]
        coarse[0].estimate_normals(near)
        # A scan is seen from its own origin.
        coarse[0].orient_normals_towards_camera_location(np.zeros(3))
        one, other = (registration.compute_fpfh_feature(cloud, near) for cloud in coarse)
        fitted = registration.registration_ransac_based_on_feature_matching(
            coarse[0], coarse[1], one, other, mutual_filter=True, max_correspondence_distance=feature,
            estimation_method=registration.TransformationEstimationPointToPoint(), ransac_n=3,
            checkers=[registration.CorrespondenceCheckerBasedOnDistance(feature)],
            criteria=registration.RANSACConvergenceCriteria(100_000, 0.999),
        )  # fmt: skip
        starts.insert(0, fitted.transformation)
    ended: list[np.ndarray[tuple[int, ...], np.dtype[np.float64]]] = []
    for start in starts:
        pose = start
        for reach in reaches:
            pose = registration.registration_icp(
                scan, part, reach, pose, registration.TransformationEstimationPointToPoint(),
                registration.ICPConvergenceCriteria(relative_fitness=1e-7, relative_rmse=1e-7, max_iteration=100),
            ).transformation  # fmt: skip
        ended.append(pose)
    written = BytesIO()
    np.save(written, np.array(ended, dtype=np.float64), allow_pickle=False)
    return written.getvalue()
