"""What does `--from best` gain, and what does it cost?

    python -m benchmarks.sources [--parts FILE ...] [--spacing MM] [--backend NAME] [--smoke]

A row for each source that a part has: the share of the area that is missed and covered twice, the variation of the
thickness and the runs, and which one is taken. The cost is the processor time of a plan with its best source over that
of a plan from the border, paths and evenness alone, both in this run; the first plan of a process is left out.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from benchmarks.parts.tables import row, table
from geoprint import plan
from geoprint.account.metrics import GAP, OVERLAP, THICKNESS
from geoprint.config import job_of
from geoprint.results import Plan

DATA = Path(__file__).parents[1] / "data"
HEADINGS = ("part", "source", GAP.column, OVERLAP.column, THICKNESS.column, "runs", "taken", "cost")
PLATE: Mapping[str, object] = {"surface": DATA / "plate.ply"}
# The rim of a heart: what lies between two planes.
BAND = {"box": [-99.0, -99.0, -52.0, 99.0, 99.0, -44.0]}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside those of data/"
    )
    parser.add_argument("--spacing", type=float, default=1.0, metavar="MM")
    parser.add_argument("--backend", default="heat")
    parser.add_argument("--smoke", action="store_true", help="the plate at 8 mm")
    arguments = parser.parse_args()
    options: dict[str, object] = {
        "unit": "mm", "backend": arguments.backend, "spacing": 8.0 if arguments.smoke else arguments.spacing
    }  # fmt: skip
    for line in table(*HEADINGS):
        print(line, flush=True)
    parts = [("plate", PLATE)] if arguments.smoke else _parts(arguments.parts)
    for name, part in parts:
        for line in _rows(name, options | dict(part)):
            print(line, flush=True)


def _parts(files: list[Path]) -> Iterator[tuple[str, Mapping[str, object]]]:
    yield "band of the heart", {"surface": DATA / "heart.ply", "patch": BAND}
    yield "plate", PLATE
    for file in files:
        yield file.stem, {"surface": file}


def _rows(name: str, options: dict[str, object]) -> Iterator[str]:
    _timed(options)
    border, best = _timed(options), _timed(options | {"source": "best"})
    for tried in best[0].workpiece.tried:
        cost = f"{best[1] / border[1]:.1f}" if tried.taken else ""
        yield row(
            name, tried.source, f"{tried.gap:.2%}", f"{tried.overlap:.2%}", f"{tried.cv:.2%}", str(tried.runs),
            "yes" if tried.taken else "", cost,
        )  # fmt: skip


def _timed(options: dict[str, object]) -> tuple[Plan, float]:
    began = time.process_time()
    planned = plan(job_of(robot=False, **options))
    return planned, time.process_time() - began


if __name__ == "__main__":
    main()
