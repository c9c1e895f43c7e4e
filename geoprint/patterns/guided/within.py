"""Curves cut to where a field stays above a value: the parts of rows that keep from the rim."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from geoprint.model import FloatArray
from geoprint.surfaces import arc_lengths


def parts_within(
    places: FloatArray, values: FloatArray, *, closed: bool, least: float, spared: float, grazing: float
) -> Iterator[tuple[FloatArray, bool]]:
    """Yield the parts of a curve on which a field is large enough.

    Args:
        places: (k, 3) of the curve [mm]; a closed one repeats its first.
        values: (k,) of the field there, linear between them.
        closed: whether it is.
        least: a part ends where the field falls below this.
        spared: where the field stays below it by less than this the part goes on,
        grazing: and ends there only where it is cut off no farther than this [mm] from where it falls lower.

    Yields:
        The (j, 3) places of a part, j >= 2, and whether it is the whole of a closed curve.

    Examples:
        >>> places = np.column_stack([np.arange(4.0), np.zeros((4, 2))])
        >>> [part[:, 0].tolist() for part, _ in parts_within(
        ...     places, np.array([0.0, 2.0, 2.0, 1.5]), closed=False, least=1.0, spared=0.0, grazing=1.0)]
        [[0.5, 1.0, 2.0, 3.0]]
    """
    inside = values >= least - spared
    if inside.all():
        yield places, closed
        return
    if closed:
        first = int(np.flatnonzero(~inside)[0])
        order = np.append(np.roll(np.arange(len(places) - 1), -first), first)
        places, values, inside = places[order], values[order], inside[order]
    bounds = np.flatnonzero(np.diff(inside)) + 1
    for begin, end in pairwise([0, *bounds.tolist(), len(places)]):
        if not inside[begin]:
            continue
        # With the places beyond both ends, where the field is lower.
        first, last = max(begin - 1, 0), min(end, len(places) - 1)
        part, held = places[first : last + 1], values[first : last + 1]
        if end < len(places):
            part, held = _cut(part, held, least=least, spared=spared, grazing=grazing)
        if begin:
            part, held = (
                each[::-1] for each in _cut(part[::-1], held[::-1], least=least, spared=spared, grazing=grazing)
            )
        if len(part) > 1:
            yield part, False


def _cut(
    places: FloatArray, values: FloatArray, *, least: float, spared: float, grazing: float
) -> tuple[FloatArray, FloatArray]:
    """Return a line, with the field on it, that ends where the field crosses the value before its lower end."""
    ends = [_ended(places, values, at=value) for value in (least - spared, least) if values.max() >= value]
    lengths = [float(arc_lengths(line)[-1]) for line, _ in ends]
    return ends[-1] if lengths[0] - lengths[-1] <= grazing else ends[0]


def _ended(places: FloatArray, values: FloatArray, *, at: float) -> tuple[FloatArray, FloatArray]:
    """Return a line up to where the field takes a value for the last time."""
    last = int(np.flatnonzero(values >= at)[-1])
    share = (at - values[last]) / (values[last + 1] - values[last])
    end = places[last] + share * (places[last + 1] - places[last])
    return np.vstack([places[: last + 1], end]), np.append(values[: last + 1], at)
