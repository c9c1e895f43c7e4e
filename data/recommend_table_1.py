"""What `geoprint recommend` says of the three prints in Table I of the paper, beside the one that came out best.

    python data/recommend_table_1.py

The paper names pressure, step of the normalised distance and flood exposure of each print, and that case C was best;
it names neither the silicone's flow nor nozzle, speed and depth of the part. So nothing absolute can be said, and
nothing is guessed: each case is compared with case C, of the same part, material, nozzle and speed.
"""

from __future__ import annotations

import csv
from pathlib import Path

from geoprint.config import job_of
from geoprint.pipeline import recommendation

TABLE = Path(__file__).parent / "paper_table_1.csv"


def main() -> None:
    """Print a paragraph for each case."""
    with TABLE.open(newline="", encoding="utf-8") as file:
        cases = list(csv.DictReader(file))
    best = next(case for case in cases if case["printed_best"] == "yes")
    good = float(best["pressure_kpa"]), _rounds(best)
    for case in cases:
        job = job_of(surface=Path(), rounds=_rounds(case))
        _, text = recommendation(job, part=False, pressure_kpa=float(case["pressure_kpa"]), good=good)
        print(f"Case {case['case']}, flooded for {case['flood_s']} s\n{text}\n")


def _rounds(case: dict[str, str]) -> int:
    return round(1.0 / float(case["step"]))


if __name__ == "__main__":
    main()
