"""What a slicer for flat layers does of a curved part: concentric infill of its outline, projected onto it."""

from __future__ import annotations

import importlib
import itertools
from typing import Any

import numpy as np
from matplotlib.tri import LinearTriInterpolator, Triangulation

from geoprint.errors import InputError
from geoprint.model import FloatArray, Surface
from geoprint.surfaces import boundary_loops, mean_normal
from geoprint.transforms import smallest_rotation

# Points along the projected lines lie so far apart at most, over the spacing.
STEP_SHARE = 0.2


def concentric_infill(surface: Surface, *, spacing: float) -> list[FloatArray]:
    """Return closed lines (k, 3) on a surface: its outline from above, offset inwards at (k + 1/2) spacings [mm].

    Raises:
        InputError: the surface overhangs as seen from above, or has no rim, so that nothing can be projected.
    """
    loops = boundary_loops(surface)
    if not loops:
        raise InputError(f"{surface.name or 'the part'} has no rim, so that it has no outline from above.")
    mean = mean_normal(surface)
    rotation = smallest_rotation(mean / np.linalg.norm(mean), np.array([[0.0, 0.0, 1.0]]))[0]
    upright = surface.vertices @ rotation.T
    try:
        heights = LinearTriInterpolator(Triangulation(upright[:, 0], upright[:, 1], surface.faces), upright[:, 2])
    except (RuntimeError, ValueError) as error:
        raise InputError(f"{surface.name or 'the part'} overhangs: it cannot be projected from above.") from error
    outlines = sorted((upright[loop, :2] for loop in loops), key=_extent, reverse=True)
    return [_lifted(ring, heights, step=STEP_SHARE * spacing) @ rotation for ring in _rings(outlines, spacing=spacing)]


def _rings(outlines: list[FloatArray], *, spacing: float) -> list[FloatArray]:
    """Return closed flat rings within the first outline and outside the others, each a spacing inside the last."""
    geometry: Any = importlib.import_module("shapely")
    region = geometry.Polygon(outlines[0], outlines[1:]).buffer(0.0)
    insets = (region.buffer(-(number + 0.5) * spacing) for number in itertools.count())
    polygons = (
        polygon
        for inset in itertools.takewhile(lambda inset: not inset.is_empty, insets)
        for polygon in getattr(inset, "geoms", [inset])
    )
    return [np.asarray(ring.coords)[:, :2] for each in polygons for ring in (each.exterior, *each.interiors)]


def _lifted(ring: FloatArray, heights: LinearTriInterpolator, *, step: float) -> FloatArray:
    """Return a flat closed ring, resampled, at the heights below it; points beside the part are left out."""
    lengths: FloatArray = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1)))
    whole = float(lengths[-1])
    places: FloatArray = np.linspace(0.0, whole, max(int(np.ceil(whole / step)), 3) + 1)
    flat: FloatArray = np.column_stack([np.interp(places, lengths, ring[:, axis]) for axis in (0, 1)])
    found: FloatArray = np.ma.filled(heights(flat[:, 0], flat[:, 1]), np.nan)
    return np.column_stack([flat, found])[np.isfinite(found)]


def _extent(outline: FloatArray) -> float:
    return float(np.ptp(outline, axis=0).prod())
