"""Ranges of tables as cones about rest, and deposits on spheres, whose attitudes can be found by hand."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray
from geoprint.positioner import Margins
from geoprint.transforms import angles_between

Z = np.array([0.0, 0.0, 1.0])
CRITICAL = float(np.radians(30.0))


def cone(half_angle_deg: float, *, rest: FloatArray = Z) -> Margins:
    """Return the margins of a table that brings up what is within an angle of rest: the share of it that is left."""
    half_angle = np.radians(half_angle_deg)
    return lambda ups: 1.0 - angles_between(ups, rest) / half_angle


def directions(polars_deg: FloatArray, azimuths_deg: FloatArray) -> FloatArray:
    """Return (n, 3) unit vectors at angles from z and about it [degrees]."""
    polar, azimuth = np.radians(polars_deg), np.radians(azimuths_deg)
    return np.column_stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])


def meridian(first_deg: float, last_deg: float, count: int) -> FloatArray:
    """Return normals along a great circle through z, at angles from it [degrees]."""
    return directions(np.linspace(first_deg, last_deg, count), np.zeros(count))
