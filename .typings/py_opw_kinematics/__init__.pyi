"""The part of py-opw-kinematics that geoprint uses."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

class KinematicModel:
    def __init__(
        self,
        a1: float = ...,
        a2: float = ...,
        b: float = ...,
        c1: float = ...,
        c2: float = ...,
        c3: float = ...,
        c4: float = ...,
        offsets: tuple[float, float, float, float, float, float] = ...,
    ) -> None: ...

class ReachResult:
    joints: NDArray[np.float64]

class Robot:
    def __init__(self, kinematic_model: KinematicModel, degrees: bool = ...) -> None: ...
    def reach(
        self, poses: RigidTransform, joint_limits: NDArray[np.float64] | None = ..., threads: int = ...
    ) -> ReachResult: ...
