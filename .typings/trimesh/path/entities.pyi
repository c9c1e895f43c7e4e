import numpy as np
from numpy.typing import NDArray

class Line:
    def __init__(self, points: NDArray[np.int64]) -> None: ...
