"""Places of a mesh in messages: as words, and as numbers that an error or a report can carry."""

from __future__ import annotations

from collections.abc import Iterable

from geoprint.model import FloatArray


def in_words(position: Iterable[float]) -> str:
    """Return a position [mm] as messages show it.

    Examples:
        >>> import numpy as np
        >>> in_words(np.array([1.0, -2.5, 0.125]))
        '(1.00, -2.50, 0.12) mm'
    """
    return "({:.2f}, {:.2f}, {:.2f}) mm".format(*position)


def triple(position: FloatArray) -> tuple[float, ...]:
    """Return a position as plain numbers."""
    return tuple(position.tolist())
