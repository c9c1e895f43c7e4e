import numpy as np
from numpy.typing import NDArray

def marching_cubes(
    volume: NDArray[np.floating], level: float, *, allow_degenerate: bool
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]: ...
def find_contours(image: NDArray[np.float64], level: float) -> list[NDArray[np.float64]]: ...
