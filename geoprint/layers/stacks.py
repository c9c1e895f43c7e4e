"""A thickness in whole layers: their number and height, and for each the surface that its paths lie on."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.layers.level_surfaces import level_surface
from geoprint.model import Surface, frozen

# A surface may lie off its level by this share of a layer's height, and its edges are so many layers long, so that a
# layer's height is right to 2 % nearly everywhere.
TOLERANCE_SHARE = 0.01
# More layers than this are a typing error: a print of a day.
MOST_LAYERS = 500


@final
@frozen
class StackedLayer:
    """One layer of a stack.

    Attributes:
        number: from 0, from the part outwards.
        surface: halfway between what lies below and its top, where its paths lie.
        bottom: height over the part at which it begins [mm].
        top: at which it ends [mm].
    """

    number: int
    surface: Surface
    bottom: float
    top: float

    @property
    def height(self) -> float:
        """Its own height [mm]."""
        return self.top - self.bottom


@final
@frozen
class Stack:
    """Layers over a part, the lowest first.

    Attributes:
        part: that they are printed on.
        layers: of equal height.
        thickness: of all together [mm].
    """

    part: Surface
    layers: tuple[StackedLayer, ...]
    thickness: float


def whole_layers(thickness: float, *, height: float) -> tuple[int, float]:
    """Return how many layers of about a height make a thickness, and the height that they then have [mm].

    Raises:
        InputError: a length is no positive number, or there are too many layers.

    Examples:
        >>> whole_layers(3.0, height=0.4)
        (8, 0.375)
    """
    for name, value in (("the thickness", thickness), ("the height of a layer", height)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name} must be a positive number of mm, found {value}.")
    count = max(round(thickness / height), 1)
    if count > MOST_LAYERS:
        raise InputError(
            f"{thickness:g} mm in layers of {height:g} mm are {count:,} layers, at most {MOST_LAYERS} are planned: "
            "check thickness and height, both in mm."
        )
    return count, thickness / count


def stack(part: Surface, *, thickness: float, layer_height: float, edge_length: float) -> Stack:
    """Return the layers of an even thickness over a part.

    Args:
        part: manifold, consistently wound; layers lie on its outer side.
        thickness: of all layers together, along the distance from the part [mm].
        layer_height: wanted of each [mm]; adapted so that whole layers come out.
        edge_length: of the triangles of their surfaces [mm].

    Raises:
        InputError: a length is no positive number, or there are too many layers.
        FieldError: nothing of the outer side is that far from the part.
        MeshError: sheets of a layer lie too close together for the edge length.
    """
    count, height = whole_layers(thickness, height=layer_height)
    tolerance = TOLERANCE_SHARE * height
    layers = tuple(
        StackedLayer(
            number,
            level_surface(part, height=(number + 0.5) * height, edge_length=edge_length, tolerance=tolerance),
            number * height,
            (number + 1) * height,
        )
        for number in range(count)
    )
    return Stack(part, layers, thickness)
