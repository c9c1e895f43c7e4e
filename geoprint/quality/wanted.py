"""How wide paths shall lie at a place, where that is not the same everywhere."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from geoprint.model import FloatArray
from geoprint.quality.oracle import FlatMesh, Places, spatial

# Returns the (k,) distance wanted to the neighbouring path at (k, 3) places on a part [mm].
WantedSpacing: TypeAlias = Callable[[FloatArray], FloatArray]


def shares_at(mesh: FlatMesh, places: Places, wanted: WantedSpacing | None, *, spacing: float) -> FloatArray:
    """Return the (k,) spacing wanted at k places over a usual one [mm]; 1 where it is the same everywhere."""
    return np.ones(places.faces.size) if wanted is None else wanted(spatial(mesh, places)) / spacing
