import numpy as np
from numpy.typing import NDArray

class PyGeodesicAlgorithmExact:
    def __init__(self, points: NDArray[np.float64], faces: NDArray[np.int32], /) -> None: ...
    def geodesicDistances(
        self, source_indices: NDArray[np.int32], target_indices: NDArray[np.int32] | None, /
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]: ...
