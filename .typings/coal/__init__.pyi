"""The part of Coal that the tests use."""

import numpy as np
from numpy.typing import NDArray

class CollisionGeometry: ...

class Box(CollisionGeometry):
    def __init__(self, x: float, y: float, z: float) -> None: ...

class Transform3s:
    def __init__(self, R: NDArray[np.float64], T: NDArray[np.float64]) -> None: ...

class DistanceRequest:
    def __init__(self) -> None: ...

class DistanceResult:
    def __init__(self) -> None: ...

def distance(
    o1: CollisionGeometry,
    tf1: Transform3s,
    o2: CollisionGeometry,
    tf2: Transform3s,
    request: DistanceRequest,
    result: DistanceResult,
) -> float: ...
