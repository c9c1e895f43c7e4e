"""Flow that follows the path: each stretch gets the volume that its own strip of surface needs."""

from __future__ import annotations

import numpy as np

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, Process


def following_flow(
    widths: FloatArray, *, deposit: BoolArray, spacing: float, process: Process, wanted: FloatArray | float = 1.0
) -> FloatArray:
    """Return the flow that makes a layer of even thickness: width of the strip times layer height.

    Args:
        widths: (p,) width of the strip of surface nearest to the path at each pose, over the wanted one.
        deposit: (p,) whether material is laid there.
        spacing: wanted distance between neighbouring paths [mm].
        process: thickness of the layer, least and most flow. A strip is narrower than the half of the spacing that it
            has outside only where fronts meet at an angle, and wider than one and a half only where paths end.
        wanted: (p,) the wanted width over the spacing, where that differs.

    Returns:
        (p,) flow [mm3 per mm of path], within least and most of spacing times layer height; 0 on travel.

    Raises:
        InputError: spacing or layer height is not positive.
    """
    layer_height = process.layer_height
    if spacing <= 0.0 or layer_height <= 0.0:
        raise InputError(
            f"flow needs a positive spacing and layer height, found {spacing:g} and {layer_height:g} mm.",
            spacing=spacing,
            layer_height=layer_height,
        )
    shares = np.clip(widths * wanted, process.least_flow, process.most_flow)
    return np.where(deposit, shares * spacing * layer_height, 0.0)
