"""Let the last print correct the next one.

A print is made up whose material flows 12 % short, and scanned. The scan tells how much lies along each run. Planned
again with it, the next print makes up for what was missing: it is simulated with the same fault.
"""

import matplotlib.pyplot as plt

import geoprint
from geoprint.inspection import appraise_scan, simulated_print
from geoprint.simulation import Faults

fault = Faults(flow=0.88, width_noise=0.03)
job = geoprint.job_of(surface="data/plate.ply", unit="mm", spacing=3.5, robot=False)
geoprint.plan(job).save("printed", overwrite=True)
first = simulated_print("printed", faults=fault, seed=0)
geoprint.save(first, "simulated", overwrite=True)  # instead of a scanner: simulated/scan.xyz

geoprint.save(appraise_scan("simulated/scan.xyz", bundle="printed"), "appraised", overwrite=True)
geoprint.plan(geoprint.job_from("printed", feedback="appraised/appraisal.json")).save("next", overwrite=True)
second = simulated_print("next", faults=fault, seed=0)

figure, axis = plt.subplots(figsize=(7, 3.4), layout="constrained")
for name, found, colour in ("first print", first, "#d55e00"), ("next print", second, "#0072b2"):
    print(f"{name}: {100 * found.deposited.sum() / found.wanted.sum():.1f} % of the material")
    axis.plot(found.runs + 1, 100 * found.deposited / found.wanted, "o-", color=colour, label=name)
axis.axhline(100, color="black", linewidth=1, linestyle=":")
axis.set(xlabel="run", ylabel="material, of what is wanted [%]", ylim=(80, 105), xticks=first.runs + 1)
axis.legend(frameon=False, loc="center right")
figure.savefig("feedback.png", dpi=120)
# prints: first print: 88.1 % of the material
# prints: next print: 99.7 % of the material
