from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

class Trimesh:
    @property
    def vertices(self) -> NDArray[np.float64]: ...
    @property
    def faces(self) -> NDArray[np.int64]: ...

def load_mesh(file_obj: BinaryIO, *, file_type: str, process: bool, fix_texture: bool) -> Trimesh: ...
