"""Make the cell files of the three prints in Table I of the paper that geoprint follows.

    python data/make_paper_cells.py [--out DIR]

The paper names pressure, step of the normalised distance and final exposure of each print, and that case C came out
best. It names neither the silicone nor nozzle, speed and stand-off: these stay those of the packaged cell, and nothing
is guessed. So `geoprint recommend` compares each case with case C, of the same part, material, nozzle and speed.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from geoprint.config import PACKAGED_CELLS, packaged_cell_text

# Pressure [kPa], rounds (1 / step) and final exposure [s] of each print.
CASES = {"a": (20, 10, 60), "b": (10, 10, 60), "c": (10, 20, 60)}
BEST = "c"


def main() -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, metavar="DIR")
    folder = parser.parse_args().out
    for case in CASES:
        (folder / f"paper_case_{case}.toml").write_text(cell_of(case), encoding="utf-8")


def cell_of(case: str) -> str:
    """Return the text of a case's cell file: the packaged cell with what the paper says."""
    pressure, rounds, flood = CASES[case]
    good_pressure, good_rounds, _ = CASES[BEST]
    text = packaged_cell_text(PACKAGED_CELLS[0])
    title = (
        f"# Case {case.upper()} of Table I in the paper: {pressure} kPa, step 1/{rounds}, {flood} s of UV at the end."
    )
    said = "Only these, and case C in [good_print], are the paper's."
    for old, new in (
        ("# A geoprint cell.", f"{title}\n# {said} data/make_paper_cells.py writes this file.\n# A geoprint cell."),
        (
            "# [good_print]\n# pressure_kpa = 10\n# rounds = 20",
            _table(good_pressure, good_rounds, head="[good_print]\n"),
        ),
        ("# pressure_kpa = 10\n# rounds = 20", _table(pressure, rounds)),
        ("# [flood]\n# duration_s = 60", f"[flood]\nduration_s = {flood}"),
    ):
        if text.count(old) < 1:
            raise SystemExit(f"the packaged cell no longer says {old!r}: adapt this script.")
        text = text.replace(old, new, 1)
    return text


def _table(pressure: int, rounds: int, *, head: str = "") -> str:
    return f"{head}pressure_kpa = {pressure}\nrounds = {rounds}"


if __name__ == "__main__":
    main()
