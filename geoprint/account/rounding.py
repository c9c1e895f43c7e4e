"""How numbers appear in the JSON that a plan or a comparison leaves."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from geoprint.export import Json

# Decimals of lengths [mm] and angles [degrees]: finer than any machine, short enough to read.
DECIMALS = 6


def rounded(value: float | np.floating) -> float:
    """Return a number as JSON carries it; zero has no sign."""
    return round(float(value), DECIMALS) + 0.0


def all_rounded(values: Iterable[float | np.floating]) -> list[Json]:
    """Return numbers, such as a place, as JSON carries them."""
    return [rounded(value) for value in values]
