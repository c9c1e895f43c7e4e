"""Files of triangles: nine coordinates a line."""

from __future__ import annotations

import numpy as np

from geoprint.errors import InputError
from geoprint.geometry.files import MeshFile


def read_tri(data: bytes, /, *, name: str) -> MeshFile:
    """Read a .tri file; it says no unit.

    Raises:
        InputError: a line does not hold nine numbers.
    """
    for number, line in enumerate(data.splitlines(), start=1):
        if len(line.split()) != 9:
            raise InputError(f"`{name}` line {number}: a triangle has nine coordinates; write them in one line.")
    corners = np.array(data.split(), dtype=np.float64).reshape(-1, 3)
    return MeshFile(corners, np.arange(len(corners)).reshape(-1, 3))
