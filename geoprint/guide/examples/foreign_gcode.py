"""Judge somebody's G-code.

Whatever wrote the toolpaths: they are read, placed on the part and measured as our own. These rows lie one
spacing apart as a slicer sees them from above. On the flanks of the dome they are farther apart,
and the layer gets thin.
"""

from pathlib import Path

import numpy as np
from matplotlib.tri import Triangulation

import geoprint


def height(x, y):
    return np.sqrt(27.0**2 - x**2 - y**2)


x, y = (each.ravel() for each in np.meshgrid(np.linspace(-18, 18, 49), np.linspace(-18, 18, 49)))
dome = geoprint.Surface(np.column_stack([x, y, height(x, y)]), Triangulation(x, y).triangles)
geoprint.geometry.files.save_ply(dome, "dome.ply")

lines = ["G21 G90 M83"]
for row in np.arange(-17.0, 18.0, 2.0):
    places = [f"X{row} Y{y:.3f} Z{height(row, y):.3f}" for y in np.linspace(-18, 18, 49)]
    lines += ["G0 Z35", f"G0 {places[0]}", *(f"G1 {place} E0.1" for place in places[1:])]
Path("slicer.gcode").write_text("\n".join(lines))

measured = geoprint.measure_files(geoprint.job_of(surface="dome.ply", unit="mm", spacing=2.0), ["slicer.gcode"])
even = measured.files[0].measured
print(f"thickness varies by {100 * even.thickness.cv:.1f} %, {100 * even.gap:.1f} % of the area is missed")
measured.figure().savefig("foreign_gcode.png")
# prints: thickness varies by 8.7 %, 3.6 % of the area is missed
