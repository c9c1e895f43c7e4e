"""What do contours leave where fronts meet, plain and fitted?

    python -m benchmarks.middle [--parts FILE ...] [--spacing MM] [--backend NAME] [--smoke]

A row for each part: the share of the area that is missed and laid twice with either kind and their ratio, the largest
hole in shares of the spacing squared, the variation of the spacing, that of the thickness near the ridge with flow that
follows, the runs, which kind is taken, and what a plan of fitted paths takes of the processor time of plain ones.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from benchmarks.parts.tables import row, table
from geoprint import job_of, measure_paths, plan
from geoprint.model import Polylines
from geoprint.results import Plan

DATA = Path(__file__).parents[1] / "data"
OWN = ("plate.ply", "heart_apex_patch.ply", "heart_flat_patch.ply")
KINDS = ("plain", "fitted")
HEADINGS = (
    "part", "missed + twice", "ratio", "largest hole / w2", "spacing CV", "thickness CV near", "runs", "taken", "cost"
)  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside those of data/"
    )
    parser.add_argument("--spacing", type=float, default=1.0, metavar="MM")
    parser.add_argument("--backend", default="heat")
    parser.add_argument("--smoke", action="store_true", help="a part of data/ at 8 mm")
    arguments = parser.parse_args()
    spacing = 8.0 if arguments.smoke else arguments.spacing
    for line in table(*HEADINGS):
        print(line, flush=True)
    for file in [*(DATA / name for name in OWN[: 1 if arguments.smoke else None]), *arguments.parts]:
        print(_row(file, spacing=spacing, backend=arguments.backend), flush=True)


def _row(file: Path, *, spacing: float, backend: str) -> str:
    found = {kind: _planned(file, kind, spacing=spacing, backend=backend) for kind in KINDS}
    plans = {kind: planned for kind, (planned, _) in found.items()}
    faults = {kind: _fault(planned) for kind, planned in plans.items()}
    holes = [_hole(plans[kind]) / spacing**2 for kind in KINDS]
    best = plan(job_of(surface=file, unit="mm", spacing=spacing, backend=backend, robot=False))
    (taken, *_) = [each.middle for each in best.middles if each.taken] or ["plain"]
    return row(
        file.stem,
        " -> ".join(f"{faults[kind]:.2%}" for kind in KINDS),
        f"{faults['fitted'] / faults['plain']:.2f}" if faults["plain"] else "",
        " -> ".join(f"{hole:.2f}" for hole in holes),
        " -> ".join(_percent(None if each.uniformity is None else each.uniformity.cv) for each in plans.values()),
        " -> ".join(_percent(None if each.laid is None else each.laid.following.near_cv) for each in plans.values()),
        " -> ".join(str(each.toolpath.curves.count) for each in plans.values()),
        taken,
        f"{found['fitted'][1] / found['plain'][1]:.2f}",
    )


def _planned(file: Path, middle: str, *, spacing: float, backend: str) -> tuple[Plan, float]:
    """Return a plan of paths and the processor time of it [s], without that of a first run."""
    job = job_of(surface=file, unit="mm", spacing=spacing, backend=backend, robot=False, middle=middle)
    plan(job)
    began = time.process_time()
    return plan(job), time.process_time() - began


def _fault(planned: Plan) -> float:
    """Return the share of the area that is missed or laid twice."""
    measured = planned.uniformity
    return 0.0 if measured is None else measured.uncovered + measured.overlap


def _hole(planned: Plan) -> float:
    """Return the largest connected area that no path covers [mm2]."""
    deposit, places = planned.poses.deposit, planned.poses.surface_points
    runs = planned.poses.runs[deposit]
    starts = np.flatnonzero(np.diff(runs, prepend=-1))
    curves = Polylines(places[deposit], np.append(starts, runs.size))
    return measure_paths(planned.workpiece.part, curves, spacing=planned.contours.spacing).hole


def _percent(share: float | None) -> str:
    return "" if share is None else f"{share:.2%}"


if __name__ == "__main__":
    main()
