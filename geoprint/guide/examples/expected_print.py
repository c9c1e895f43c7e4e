"""Ask how even a print will be, not only a plan.

What the arm, the fixture, the needle and the flow add is sampled over 2000 prints with the errors of the cell. Two
backends differ in print only where their intervals do; the largest error says what to improve first.
"""

import matplotlib.pyplot as plt

import geoprint

job = geoprint.job_of(surface="data/heart_apex_patch.ply", unit="mm", spacing=1.5, robot=False)
compared = geoprint.compare(job, backends=["lscm", "heat"])
figure, axis = plt.subplots(figsize=(7, 3.6), layout="constrained")
for (name, planned), colour in zip(compared.plans.items(), ("#d55e00", "#0072b2")):
    printed = planned.printed
    mean, low, high = printed.cv
    cause = printed.largest_error or "the plan"
    prints = f"{100 * mean:.1f} % ({100 * low:.1f} to {100 * high:.1f})"
    print(f"{name}: plan {100 * printed.planned:.1f} %, prints {prints}, most by {cause}")
    axis.hist(100 * printed.cvs, bins=60, color=colour, alpha=0.6, label=f"{name}, 2000 prints")
    axis.axvline(100 * printed.planned, color=colour, linestyle="--", label=f"{name}, as planned")
axis.set(xlabel="variation of the thickness, CV [%]", ylabel="prints", xlim=(0, None))
axis.legend(frameon=False)
figure.savefig("expected_print.png", dpi=120)
# prints: lscm: plan 9.6 %, prints 10.2 % (8.2 to 13.0), most by the plan
# prints: heat: plan 0.4 %, prints 3.5 % (1.6 to 6.3), most by placement
