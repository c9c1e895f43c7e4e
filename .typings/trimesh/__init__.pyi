from collections.abc import Mapping
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

class Trimesh:
    @property
    def vertices(self) -> NDArray[np.float64]: ...
    @property
    def faces(self) -> NDArray[np.int64]: ...
    # Of a PLY file "_ply_raw": the data and the properties of each element by name.
    metadata: dict[str, Mapping[str, Mapping[str, Mapping[str, object]]]]

def load_mesh(file_obj: BinaryIO, *, file_type: str, process: bool, fix_texture: bool) -> Trimesh: ...

class Scene:
    geometry: dict[str, Trimesh]
    def to_mesh(self) -> Trimesh: ...

def load_scene(file_obj: BinaryIO, *, file_type: str, process: bool) -> Scene: ...
