from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

class CholmodError(Exception): ...

class CholeskyFactor:
    def solve(self, b: NDArray[np.float64], /) -> NDArray[np.float64]: ...

def cho_factor(A: csc_array[Any], /) -> CholeskyFactor: ...
