"""A planar slicer as small as can be: the slices of a dome as ordinary G-code, circle by circle."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray

# Filament per mm of path, as slicers write it [mm].
FILAMENT = 0.033
# Points of a circle.
POINTS = 180


def dome_heights(*, radius: float, opening: float, layer: float) -> FloatArray:
    """Return the heights of horizontal slices of a dome over its middle, layer by layer from its rim up [mm].

    Args:
        radius: of the sphere [mm].
        opening: angle from the axis to the rim [rad].
        layer: height of a layer [mm].
    """
    low = radius * np.cos(opening)
    return np.arange(low + 0.5 * layer, radius - 0.25 * layer, layer)


def dome_gcode(*, radius: float, opening: float, layer: float) -> str:
    """Return the G-code that prints the outline of every slice; coordinates are those of the sphere's middle."""
    lines = ["; planar slices of a dome", "M140 S60", "G28", "G90", "M82", "G21", "G92 E0", "G1 Z5 F5000"]
    fed = 0.0
    for height in dome_heights(radius=radius, opening=opening, layer=layer).tolist():
        across = float(np.sqrt(radius**2 - height**2))
        turns = np.linspace(0.0, 2.0 * np.pi, POINTS + 1)
        circle = across * np.column_stack([np.cos(turns), np.sin(turns)])
        x, y = circle[0].tolist()
        lines += [f";LAYER z={height:.3f}", f"G1 E{fed - 1.0:.5f} F2400", f"G0 X{x:.4f} Y{y:.4f} Z{height:.4f}"]
        lines.append(f"G1 E{fed:.5f} F2400")
        step = FILAMENT * float(np.linalg.norm(circle[1] - circle[0]))
        for x, y in circle[1:].tolist():
            fed += step
            lines.append(f"G1 X{x:.4f} Y{y:.4f} E{fed:.5f}")
    return "\n".join([*lines, "M107", "M84", ""])
