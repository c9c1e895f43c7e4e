"""Flow that follows the path: each stretch gets the volume that its own strip of surface needs."""

from __future__ import annotations

import numpy as np

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray

# Least and most flow over that of a strip one spacing wide. A strip is narrower than the half of the spacing that it
# has outside only where fronts meet at an angle, and wider than one and a half only where paths end: more or less than
# this would make a knot or break the strand.
LEAST_SHARE = 0.4
MOST_SHARE = 2.0


def following_flow(widths: FloatArray, *, deposit: BoolArray, spacing: float, layer_height: float) -> FloatArray:
    """Return the flow that makes a layer of even thickness: width of the strip times layer height.

    Args:
        widths: (p,) width of the strip of surface nearest to the path at each pose, over the spacing.
        deposit: (p,) whether material is laid there.
        spacing: wanted distance between neighbouring paths [mm].
        layer_height: thickness of the layer [mm].

    Returns:
        (p,) flow [mm3 per mm of path], within `LEAST_SHARE` and `MOST_SHARE` of spacing times layer height; 0 on
        travel.

    Raises:
        InputError: spacing or layer height is not positive.
    """
    if spacing <= 0.0 or layer_height <= 0.0:
        raise InputError(
            f"flow needs a positive spacing and layer height, found {spacing:g} and {layer_height:g} mm.",
            spacing=spacing,
            layer_height=layer_height,
        )
    shares = np.clip(widths, LEAST_SHARE, MOST_SHARE)
    return np.where(deposit, shares * spacing * layer_height, 0.0)
