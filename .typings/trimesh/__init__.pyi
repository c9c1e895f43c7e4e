from collections.abc import Mapping
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from trimesh.path import Path3D

class Trimesh:
    def __init__(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        *,
        vertex_colors: NDArray[np.int64] | None = None,
        process: bool = True,
    ) -> None: ...
    @property
    def vertices(self) -> NDArray[np.float64]: ...
    @property
    def faces(self) -> NDArray[np.int64]: ...
    # Of a PLY file "_ply_raw": the data and the properties of each element by name.
    metadata: dict[str, Mapping[str, Mapping[str, Mapping[str, object]]]]

def load_mesh(file_obj: BinaryIO, *, file_type: str, process: bool, fix_texture: bool) -> Trimesh: ...

class Scene:
    geometry: dict[str, Trimesh]
    def __init__(self, geometry: Trimesh | Path3D | None = None) -> None: ...
    def export(self, *, file_type: str) -> bytes: ...
    def to_mesh(self) -> Trimesh: ...

def load_scene(file_obj: BinaryIO, *, file_type: str, process: bool) -> Scene: ...
