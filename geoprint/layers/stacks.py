"""A thickness in whole layers: their number and height, and the levels between which they lie."""

from __future__ import annotations

import numpy as np

from geoprint.errors import InputError
from geoprint.layers.level_surfaces import level_surface
from geoprint.model import Surface

# A surface may lie off its level by this share of a layer's height, so that layers are as high as they shall be to 2 %.
TOLERANCE_SHARE = 0.01
# Its edges are as long as a layer is high, within these bounds [mm]: longer ones round off the corners of its rim.
SHORTEST_EDGE, LONGEST_EDGE = 0.3, 1.0
# More layers than this are a typing error: a print of a day.
MOST_LAYERS = 500


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


def layer_level(part: Surface, over: float, *, height: float) -> Surface:
    """Return the surface at a height over a part, as true as layers need it.

    Args:
        part: manifold, consistently wound; layers lie on its outer side.
        over: the height, along the distance from the part [mm].
        height: of a layer [mm].

    Raises:
        InputError: a length is no positive number.
        FieldError: nothing of the outer side is that far from the part.
        MeshError: sheets of the level lie too close together.
    """
    edge = min(max(height, SHORTEST_EDGE), LONGEST_EDGE)
    return level_surface(part, height=over, edge_length=edge, tolerance=TOLERANCE_SHARE * height)
