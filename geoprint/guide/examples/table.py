"""Tilt the part on a table, so that nothing overhangs.

A cell with a tilt-turn table turns the steep places of a part up, one after the other. The plan says in which attitudes
everything prints within the critical angle of the material, and what is printed in each.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import geoprint

Path("cell.toml").write_text(geoprint.config.packaged_cell_text(geoprint.config.TILTING_CELL))
job = geoprint.job_of(surface="data/heart_apex_patch.ply", unit="mm", spacing=2.0, cell="cell.toml", robot=False)
planned = geoprint.plan(job)
table, places = planned.tilting, planned.poses.surface_points[planned.poses.deposit] @ planned.workpiece.upright.T
print(f"{len(table.attitudes)} attitudes, {table.overhanging:.0f} mm still overhang")

axis = plt.figure(figsize=(7, 5)).add_subplot(projection="3d", computed_zorder=False)
part = planned.workpiece.part.vertices @ planned.workpiece.upright.T
axis.plot_trisurf(*part.T, triangles=planned.workpiece.part.faces, color="#eef1f4", linewidth=0, antialiased=False)
for number, (attitude, angles) in enumerate(zip(table.attitudes, table.axes)):
    tilt, turn = np.degrees(angles)
    for start, end in attitude.pieces:
        (line,) = axis.plot(*places[start:end].T, color=f"C{number}", linewidth=2)
    line.set_label(f"tilt {tilt:.0f}°, turn {turn:.0f}°: {table.lengths[number]:.0f} mm")
axis.view_init(elev=60, azim=-120)
axis.set_box_aspect(np.ptp(part, axis=0), zoom=1.4)
axis.set_axis_off()
axis.legend(title="attitudes of the table", frameon=False, loc="center left", bbox_to_anchor=(0.95, 0.5))
plt.savefig("table.png", dpi=120, bbox_inches="tight")
# prints: 5 attitudes, 0 mm still overhang
