"""How wide beads shall be from place to place on a part: along a direction, between points of a table, about places.

A width that a rule gives nowhere leaves the range of those it is made of. On a layer over a part each place has the
width of its foot on the part.
"""

from __future__ import annotations

from typing import Protocol, final

import numpy as np
from scipy.spatial import KDTree

from geoprint.geometry import closest
from geoprint.model import FloatArray, Surface, freeze_arrays, frozen

# What is between points of a table is that of so many of the nearest.
NEIGHBOURS = 24


class WidthRule(Protocol):
    """Says how wide beads shall be."""

    def __call__(self, places: FloatArray, /) -> FloatArray:
        """Return the (k,) width at (k, 3) places on the part [mm]."""
        ...

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Return (e, 3) places and the (e,) widths there, the least and the greatest of all among them [mm]."""
        ...


@final
@frozen
class WidthsAlong:
    """A width that changes evenly along a direction, from where a part begins to where it ends.

    Attributes:
        begin: (3,) the place at which the part begins [mm].
        end: (3,) the place at which it ends [mm].
        direction: (3,) unit vector.
        widths: (2,) at both [mm].
    """

    begin: FloatArray
    end: FloatArray
    direction: FloatArray
    widths: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, begin="float: 3", end="float: 3", direction="float: 3", widths="float: 2")

    def __call__(self, places: FloatArray, /) -> FloatArray:
        """Return the (k,) width at (k, 3) places [mm]."""
        heights = np.array([self.begin, self.end]) @ self.direction
        return np.interp(places @ self.direction, heights, self.widths)

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Return both ends of the part and the widths there [mm]."""
        return np.array([self.begin, self.end]), self.widths


@final
@frozen
class WidthsBetween:
    """Widths at points, and between them in proportion to how far these are.

    Attributes:
        places: (e, 3) [mm].
        widths: (e,) there [mm].
    """

    places: FloatArray
    widths: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, places="float: e 3", widths="float: e")

    def __call__(self, places: FloatArray, /) -> FloatArray:
        """Return the (k,) width at (k, 3) places [mm]."""
        return between(self.places, self.widths, places)

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Return the points and the widths there [mm]."""
        return self.places, self.widths


@final
@frozen
class WidthsAbout:
    """A width at places that fades, without a step in its slope, to the one that is usual so far from them.

    Attributes:
        places: (e, 3) [mm].
        width: at them [mm].
        within: how far from them the usual one begins, straight through the air [mm].
        usual: [mm].
    """

    places: FloatArray
    width: float
    within: float
    usual: float

    def __post_init__(self) -> None:
        freeze_arrays(self, places="float: e 3")

    def __call__(self, places: FloatArray, /) -> FloatArray:
        """Return the (k,) width at (k, 3) places [mm]."""
        near = 1.0 - np.minimum(KDTree(self.places).query(places)[0] / self.within, 1.0)
        return self.usual + (self.width - self.usual) * near**2 * (3.0 - 2.0 * near)

    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Return the places and the width there [mm]; the usual one needs no place."""
        return self.places, np.full(len(self.places), self.width)


@final
@frozen
class WidthsOver:
    """The widths that a rule gives to a part, on that or on a layer over it.

    Attributes:
        rule: of the part.
        base: the part where places lie on a layer over it; None where they lie on the part itself.
    """

    rule: WidthRule
    base: Surface | None

    def __call__(self, places: FloatArray, /) -> FloatArray:
        """Return the (k,) width at (k, 3) places [mm]."""
        if self.base is None:
            return self.rule(places)
        return self.rule(closest(self.base, places)[0].xyz(self.base))


def between(places: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """Return values between those at points, and never beyond them.

    Args:
        places: (e, 3) of the points, no two alike [mm].
        values: (e,) there.
        at: (k, 3) places [mm].

    Returns:
        (k,) values.

    Examples:
        >>> ends = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]])
        >>> between(ends, np.array([1.0, 3.0]), np.array([[1.0, 0.0, 0.0], [9.0, 0.0, 0.0]])).round(3).tolist()
        [1.5, 3.0]
    """
    from scipy.interpolate import RBFInterpolator

    if len(values) == 1:
        return np.full(len(at), values[0])
    found = RBFInterpolator(places, values, neighbors=min(NEIGHBOURS, len(values)), kernel="linear", degree=0)
    return np.clip(found(at), values.min(), values.max())
