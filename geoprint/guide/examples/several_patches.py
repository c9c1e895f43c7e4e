"""Print several patches of one body.

Each patch is a place on the body and a radius, and is planned from its own rim. One program prints them in turn; the
numbers of runs go on from patch to patch.
"""

import matplotlib.pyplot as plt
import numpy as np

import geoprint

patches = [{"at": [1.5, 0.0, -57.5], "radius": 8.0}, {"at": [14.6, -16.5, -46.7], "radius": 6.0}]
job = geoprint.job_of(surface="data/heart.ply", unit="mm", spacing=1.5, patches=patches, robot=False)
planned = geoprint.plan(job)
runs = planned.table()
print(f"{len(runs)} runs, {runs['length'].sum():.0f} mm, {runs['volume'].sum():.0f} mm3")

body = geoprint.reporting.view_surface(planned.workpiece.body, faces=8000).surface
axis = plt.figure(figsize=(7, 7)).add_subplot(projection="3d", computed_zorder=False)
axis.plot_trisurf(*body.vertices.T, triangles=body.faces, color="#f3ddd6", linewidth=0, antialiased=False)
for path in planned.paths:
    axis.plot(*path.T, color="#0072b2", linewidth=1.2)
axis.view_init(elev=-30, azim=-75)
axis.set_box_aspect(np.ptp(body.vertices, axis=0), zoom=1.4)
axis.set_axis_off()
axis.set_title(f"{len(runs)} runs on {len(patches)} patches, printed by one program")
plt.savefig("several_patches.png", dpi=120, bbox_inches="tight")
# prints: 9 runs, 209 mm, 157 mm3
