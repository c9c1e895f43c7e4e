"""Print a patch in one run: a spiral.

Rings start and stop once a ring, a spiral once. It winds from the rim to the middle, one spacing from turn to turn, and
leaves a triangle open at the rim: eight spacings long and one high, which its variation counts.
"""

import geoprint

part = {"surface": "data/heart_apex_patch.ply", "unit": "mm", "spacing": 2.0, "robot": False}
rings = geoprint.plan(geoprint.job_of(**part))
spiral = geoprint.plan(geoprint.job_of(**part, pattern="spiral"))
for name, planned in {"rings": rings, "spiral": spiral}.items():
    count, length = len(planned.paths), planned.evenness.length
    print(f"{name}: {length:.0f} mm, starts: {count}, thickness varies by {100 * planned.evenness.thickness.cv:.1f} %")
spiral.figure().savefig("spiral.png")
# prints: rings: 545 mm, starts: 10, thickness varies by 0.9 %
# prints: spiral: 539 mm, starts: 1, thickness varies by 7.5 %
