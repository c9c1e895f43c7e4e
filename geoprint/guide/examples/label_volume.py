"""From a label volume to paths on a patch.

A segmentation, here a wall around a chamber in voxels of 1.5 mm, becomes a smooth surface around one of its labels. A
patch is cut out of it about a place, and planned.
"""

import matplotlib.pyplot as plt
import nibabel
import numpy as np

import geoprint

x, y, z = np.meshgrid(*[np.arange(-30.0, 30.0, 1.5)] * 3, indexing="ij")
labels = np.where(x**2 / 12**2 + y**2 / 12**2 + z**2 / 18**2 < 1, 2, 1)  # 2: the chamber
labels[x**2 / 18**2 + y**2 / 18**2 + z**2 / 25**2 > 1] = 0
nibabel.save(nibabel.Nifti1Image(labels.astype(np.uint8), np.diag([1.5, 1.5, 1.5, 1.0])), "labels.nii.gz")

patch = {"at": [17.6, 17.6, 36.0], "radius": 11.0}
job = geoprint.job_of(surface="labels.nii.gz", unit="mm", label=1, patch=patch, spacing=1.5, robot=False)
planned = geoprint.plan(job)
print(f"{len(planned.paths)} runs, thickness varies by {100 * planned.evenness.thickness.cv:.1f} %")

body = geoprint.reporting.view_surface(planned.workpiece.body, faces=8000).surface
axis = plt.figure(figsize=(7, 5)).add_subplot(projection="3d", computed_zorder=False)
axis.plot_trisurf(*body.vertices.T, triangles=body.faces, color="#f3ddd6", linewidth=0, antialiased=False)
for path in planned.paths:
    axis.plot(*path.T, color="#0072b2", linewidth=1.2)
axis.view_init(elev=20, azim=-120)
axis.set_box_aspect(np.ptp(body.vertices, axis=0), zoom=1.4)
axis.set_axis_off()
axis.set_title(f"label 1 of labels.nii.gz, {len(planned.paths)} runs on a patch of it")
plt.savefig("label_volume.png", dpi=120, bbox_inches="tight")
# prints: 7 runs, thickness varies by 0.5 %
