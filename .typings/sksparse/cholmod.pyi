from typing import Any, overload

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

class CholmodError(Exception): ...

class CholeskyFactor:
    @overload
    def solve(self, b: NDArray[np.float64], /) -> NDArray[np.float64]: ...
    @overload
    def solve(self, b: NDArray[np.complex128], /) -> NDArray[np.complex128]: ...

def cho_factor(A: csc_array[Any], /) -> CholeskyFactor: ...
