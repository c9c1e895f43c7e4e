import numpy as np
from numpy.typing import NDArray

class Simplify:
    def setMesh(self, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> None: ...
    def simplify_mesh(
        self,
        *,
        target_count: int,
        aggressiveness: float = 7.0,
        max_iterations: int = 100,
        preserve_border: bool = False,
        verbose: bool = False,
    ) -> None: ...
    def getMesh(self) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float64]]: ...
