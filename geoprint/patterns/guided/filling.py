"""Where rows run along the line of ends, but leave a strip open beside it, that line is a row itself."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from geoprint.model import FloatArray
from geoprint.patterns.guided.turns import RowPart
from geoprint.surfaces import arc_lengths

# A strip is open where the line is farther from the row before than this share of the spacing ...
LEAST_SHARE = 0.5
# ... and from the row behind, which would run outside of it, than the rest to this.
MOST_SHARE = 0.9
# Shorter strips than so many spacings lie between rows that end there.
SHORTEST_STRIP = 2.0


def strips(places: FloatArray, distances: FloatArray, *, spacing: float) -> Iterator[RowPart]:
    """Yield the parts of a line of ends that are rows.

    Args:
        places: (k, 3) of a closed line, the first repeated at the end [mm].
        distances: (k,) from the drawn curve [mm].
        spacing: of the rows [mm].

    Yields:
        Rows with the number of the one that would run outside.
    """
    row = distances / spacing - 0.5
    before: FloatArray = np.floor(row)
    number = np.where((row - before >= LEAST_SHARE) & (row - before <= MOST_SHARE) & (row > 0.0), before + 1.0, -1.0)
    changes = np.flatnonzero(np.diff(number))
    if changes.size == 0:
        if number[0] >= 0.0:
            yield RowPart(places, int(number[0]), closed=True, strip=True)
        return
    first = int(changes[0]) + 1
    order = np.append(np.roll(np.arange(len(places) - 1), -first), first)
    places, number = places[order], number[order]
    bounds = np.flatnonzero(np.diff(number[:-1])) + 1
    for begin, end in pairwise([0, *bounds.tolist(), len(places) - 1]):
        if number[begin] >= 0.0 and arc_lengths(places[begin:end])[-1] >= SHORTEST_STRIP * spacing:
            yield RowPart(places[begin:end], int(number[begin]), closed=False, strip=True)
