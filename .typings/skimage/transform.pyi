from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

def resize(
    image: NDArray[np.float64], output_shape: Sequence[int], *, anti_aliasing: bool
) -> NDArray[np.float64]: ...
