"""The bead that a flow makes: volume per length, pressed flat to the layer height; flow that follows the width."""

from __future__ import annotations

import numpy as np

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, Process

# The bead that a flow makes: volume deposited per length, pressed flat to the stand-off.
#
# What leaves the nozzle stays on the path: cross-section = flow / speed. The section is a circular segment on the
# surface, as wide as its chord. With half its opening angle a and the radius R of the circle
#
#     height = R (1 - cos a),   width = 2 R sin a,   area = R^2 (a - sin a cos a).


# Smallest half angle of a segment [rad]: a bead 2000 times wider than high; flatter ones are not distinguished.
FLATTEST = 1e-3


def bead_width(*, flow: float, speed: float, standoff: float) -> float:
    """Return the width of the foot of the bead that the nozzle presses down to its stand-off [mm].

    Args:
        flow: [mm3/s].
        speed: of the tip [mm/s].
        standoff: of the tip over the surface [mm], which is the bead's height.

    Raises:
        InputError: a value is not positive, or the strand is thinner than the stand-off, so that nothing presses it:
            it falls, coils or tears, and no width follows from the balance of mass.
    """
    if min(flow, speed, standoff) <= 0.0:
        raise InputError(
            f"a bead needs a flow, a speed and a stand-off above 0, found {flow:g} mm3/s, {speed:g} mm/s, "
            f"{standoff:g} mm."
        )
    area = flow / speed
    if strand_diameter(area) < standoff:
        raise InputError(
            f"{flow:.3g} mm3/s at {speed:g} mm/s make a strand of {strand_diameter(area):.3g} mm, thinner than the "
            f"stand-off of {standoff:g} mm, so it is not pressed on. Print slower, with more pressure, or nearer.",
            strand=strand_diameter(area),
            standoff=standoff,
        )
    return segment_width(area, height=standoff)


def flow_for(*, width: float, speed: float, standoff: float) -> float:
    """Return the flow that makes a bead of a width at a speed and a stand-off [mm3/s]."""
    return speed * segment_area(width, height=standoff)


def strand_diameter(area: float) -> float:
    """Return the diameter of a round strand of some cross-section [mm]."""
    return float(np.sqrt(4.0 * area / np.pi))


def segment_area(width: float, *, height: float) -> float:
    """Return the area of a circular segment from its chord and its height [mm2]."""
    half = 2.0 * np.arctan2(height, 0.5 * width)
    return _area(float(half), height)


def segment_width(area: float, *, height: float) -> float:
    """Return the chord of a circular segment [mm].

    For a given height the area falls as the segment closes, down to that of the full circle: one angle fits.

    Raises:
        InputError: the area is smaller than that circle's, or more than 1000 squares of the height.
    """
    from scipy.optimize import brentq

    if not _area(np.pi, height) * (1.0 - 1e-12) <= area <= _area(FLATTEST, height):
        raise InputError(
            f"a bead of {height:g} mm height cannot have a cross-section of {area:g} mm2: a circle has "
            f"{_area(np.pi, height):.3g} mm2, the flattest bead {_area(FLATTEST, height):.3g} mm2.",
            area=area,
            height=height,
        )
    if area <= _area(np.pi, height):
        return 0.0
    half = float(brentq(lambda angle: _area(angle, height) - area, FLATTEST, np.pi, xtol=1e-14, rtol=1e-14))
    return 2.0 * height / float(np.tan(0.5 * half))


def _area(half: float, height: float) -> float:
    radius = height / (1.0 - np.cos(half))
    return float(radius**2 * (half - np.sin(half) * np.cos(half)))


# Flow that follows the path: each stretch gets the volume that its own strip of surface needs.


def following_flow(
    widths: FloatArray, *, deposit: BoolArray, spacing: float, process: Process, wanted: FloatArray | float = 1.0
) -> FloatArray:
    """Return the flow that makes a layer of even thickness: width of the strip times layer height.

    Args:
        widths: (p,) width of the strip of surface nearest to the path at each pose, over the wanted one.
        deposit: (p,) whether material is deposited there.
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
