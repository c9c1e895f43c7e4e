from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from trimesh.path.entities import Line

class Path3D:
    def __init__(
        self,
        *,
        entities: Sequence[Line],
        vertices: NDArray[np.float64],
        colors: NDArray[np.int64],
        process: bool = True,
    ) -> None: ...
