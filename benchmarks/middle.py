"""What do contours leave where fronts meet, plain and fitted?

    python -m benchmarks.middle [--parts FILE ...] [--spacing MM] [--backend NAME] [--smoke]

A row for each part: the variation of the thickness with either kind, with a constant flow and with one that follows
the width; the share of the area that is covered once, that which is missed or covered twice and its ratio; the largest
hole in shares of the spacing squared, the runs, which kind is taken, and what a plan of fitted paths takes of the
processor time of plain ones.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from benchmarks.parts.tables import row, table
from geoprint import job_of, plan
from geoprint.account.metrics import COVERED_ONCE, FOLLOWING, THICKNESS
from geoprint.quality import Uniformity
from geoprint.results import Plan

DATA = Path(__file__).parents[1] / "data"
OWN = ("plate.ply", "heart_apex_patch.ply", "heart_flat_patch.ply")
KINDS = ("plain", "fitted")
HEADINGS = (
    "part", THICKNESS.column, FOLLOWING.column, COVERED_ONCE.column, "gap + overlap", "ratio", "largest hole / w2",
    "runs", "taken", "cost",
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
    measured = {kind: _measured(planned) for kind, planned in plans.items()}
    faults = {kind: each.gap + each.overlap for kind, each in measured.items()}
    best = plan(job_of(surface=file, unit="mm", spacing=spacing, backend=backend, robot=False))
    (taken, *_) = [each.middle for each in best.middles if each.taken] or ["plain"]
    return row(
        file.stem,
        " -> ".join(f"{each.thickness.cv:.2%}" for each in measured.values()),
        " -> ".join(f"{each.followed.cv:.2%}" for each in measured.values()),
        " -> ".join(f"{each.covered_once:.2%}" for each in measured.values()),
        " -> ".join(f"{fault:.2%}" for fault in faults.values()),
        f"{faults['fitted'] / faults['plain']:.2f}" if faults["plain"] else "",
        " -> ".join(f"{each.hole / spacing**2:.2f}" for each in measured.values()),
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


def _measured(planned: Plan) -> Uniformity:
    assert planned.uniformity is not None
    return planned.uniformity


if __name__ == "__main__":
    main()
