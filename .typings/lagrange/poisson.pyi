import numpy as np
from numpy.typing import NDArray

class SurfaceMesh:
    @property
    def vertices(self) -> NDArray[np.float64]: ...
    @property
    def facets(self) -> NDArray[np.uint32]: ...

def mesh_from_oriented_points(
    points: NDArray[np.float64], normals: NDArray[np.float64], octree_depth: int = 0
) -> SurfaceMesh: ...
