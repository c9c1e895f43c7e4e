import numpy as np
from numpy.typing import NDArray

class geometry:
    class PointCloud:
        points: utility.Vector3dVector
        normals: utility.Vector3dVector
        def voxel_down_sample(self, voxel_size: float) -> geometry.PointCloud: ...
        def estimate_normals(self, search_param: geometry.KDTreeSearchParamHybrid) -> None: ...
        def orient_normals_towards_camera_location(self, camera_location: NDArray[np.float64]) -> None: ...

    class TriangleMesh:
        vertices: utility.Vector3dVector
        triangles: utility.Vector3iVector
        @staticmethod
        def create_from_point_cloud_poisson(
            pcd: geometry.PointCloud,
            depth: int = 8,
            width: float = 0,
            scale: float = 1.1,
            linear_fit: bool = False,
            n_threads: int = -1,
            full_depth: int = 5,
        ) -> tuple[geometry.TriangleMesh, utility.DoubleVector]: ...

    class KDTreeSearchParamHybrid:
        def __init__(self, radius: float, max_nn: int) -> None: ...

class utility:
    class Vector3dVector:
        def __init__(self, values: NDArray[np.float64]) -> None: ...
        def __array__(self) -> NDArray[np.float64]: ...

    class Vector3iVector:
        def __array__(self) -> NDArray[np.int32]: ...

    class DoubleVector: ...

    class random:
        @staticmethod
        def seed(seed: int) -> None: ...

class pipelines:
    class registration:
        class Feature: ...
        class Estimation: ...

        class TransformationEstimationPointToPoint(Estimation):
            def __init__(self, with_scaling: bool = False) -> None: ...

        class ICPConvergenceCriteria:
            def __init__(
                self, relative_fitness: float = 1e-6, relative_rmse: float = 1e-6, max_iteration: int = 30
            ) -> None: ...

        class RANSACConvergenceCriteria:
            def __init__(self, max_iteration: int, confidence: float) -> None: ...

        class CorrespondenceCheckerBasedOnDistance:
            def __init__(self, distance_threshold: float) -> None: ...

        class RegistrationResult:
            @property
            def transformation(self) -> NDArray[np.float64]: ...
            @property
            def fitness(self) -> float: ...

        @staticmethod
        def compute_fpfh_feature(
            input: geometry.PointCloud, search_param: geometry.KDTreeSearchParamHybrid
        ) -> pipelines.registration.Feature: ...
        @staticmethod
        def registration_ransac_based_on_feature_matching(
            source: geometry.PointCloud,
            target: geometry.PointCloud,
            source_feature: pipelines.registration.Feature,
            target_feature: pipelines.registration.Feature,
            mutual_filter: bool,
            max_correspondence_distance: float,
            estimation_method: pipelines.registration.Estimation,
            ransac_n: int,
            checkers: list[pipelines.registration.CorrespondenceCheckerBasedOnDistance],
            criteria: pipelines.registration.RANSACConvergenceCriteria,
        ) -> pipelines.registration.RegistrationResult: ...
        @staticmethod
        def registration_icp(
            source: geometry.PointCloud,
            target: geometry.PointCloud,
            max_correspondence_distance: float,
            init: NDArray[np.float64],
            estimation_method: pipelines.registration.Estimation,
            criteria: pipelines.registration.ICPConvergenceCriteria,
        ) -> pipelines.registration.RegistrationResult: ...
