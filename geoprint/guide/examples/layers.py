"""Cut a print of several layers open.

A device of 2 mm on the wall of a heart is printed in layers at even distances from the part. The picture cuts the
whole stack across its middle: each bead lies on the layer below, and the thickness says how well they fill it.
"""

import geoprint

patch = {"at": [42.0, 4.0, -6.0], "radius": 7.8}
part = {"surface": "data/heart_flat_patch.ply", "unit": "mm", "patch": patch, "robot": False}
stack = geoprint.layers.plan_layers(geoprint.job_of(**part, spacing=1.5, thickness=2.0))
finished = stack.flows[stack.printed]
print(f"{len(stack.layers)} layers, {len(stack.layers[0].seams)} runs in the first")
print(f"finished thickness {100 * finished.mean:.1f} % of what is wanted, varies by {100 * finished.cv:.1f} %")
stack.figure().savefig("layers.png")
# prints: 4 layers, 5 runs in the first
# prints: finished thickness 100.0 % of what is wanted, varies by 0.6 %
