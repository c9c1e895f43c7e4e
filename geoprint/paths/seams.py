"""Where closed runs of a layer of a stack start: away from the starts in the layers below, where a bead is weakest."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.surfaces import direction_across

# Multiples of this share of a turn fall farthest apart.
GOLDEN = (5.0**0.5 - 1.0) / 2.0
# Layers take turns: each three in a row start at different places.
TURNS = 3
# A start keeps so many spacings from those below, half a spacing more than it must: the runs below lie not quite under
# those of a layer.
APART = 2.5


@final
@frozen
class Seams:
    """Where closed runs of a layer may start.

    A start is a blob or a gap: one over another is a weak line through the device. So a closed run starts at least two
    spacings from every start in the layer below and in the one below that, or where it is too short for that, as far
    from them as it can.

    Layers are planned without waiting for each other, but their runs lie nearly over each other, so that a layer finds
    on its own runs where those below it start: that holds as far as they do; in up to four runs of a hundred it does
    not, by less than a spacing.

    Three layers take turns. The first starts its runs in a row from where the part reaches farthest in one direction;
    the second in another direction, keeping from the starts of the first; the third in one more, keeping from both; the
    fourth starts where the first does. Directions follow each other by the golden section of a turn, so that rows of
    starts are 85 degrees apart or more to begin with.

    Attributes:
        layer: of a stack, from 0.
        directions: (t, 3) unit vectors: of each layer of the three up to this one, whose first run starts where it
            reaches farthest in it; this layer's is the last.
    """

    layer: int
    directions: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, directions="float: t 3")


def seams_of(base: Surface, *, layer: int) -> Seams:
    """Return where closed runs of a layer may start.

    Args:
        base: the part that the lowest layer lies on: the same for all layers.
        layer: from 0.
    """
    turns = range(layer % TURNS + 1)
    return Seams(layer, np.array([direction_across(base, angle=2.0 * np.pi * GOLDEN * turn) for turn in turns]))


def starts_apart(places: FloatArray, taken: FloatArray, *, spacing: float) -> IntArray:
    """Return the indices of the places of a closed run that are far enough from other starts, or else of the farthest.

    Args:
        places: (k, 3) of the run [mm].
        taken: (t, 3) the starts to keep from [mm].
        spacing: [mm].

    Examples:
        >>> places = np.array([[0.0, 0, 0], [2, 0, 0], [3, 0, 0], [9, 0, 0]])
        >>> starts_apart(places, np.zeros((1, 3)), spacing=1.0)
        array([2, 3])
        >>> starts_apart(places, np.zeros((1, 3)), spacing=9.0)
        array([3])
        >>> starts_apart(places, np.zeros((0, 3)), spacing=1.0)
        array([0, 1, 2, 3])
    """
    if not len(taken):
        return np.arange(len(places))
    away = np.asarray(KDTree(taken).query(places)[0], dtype=np.float64)
    return np.flatnonzero(away >= min(APART * spacing, float(away.max())))
