"""How far does what a program does, executed here, lie from its plan?

    python -m benchmarks.execution [--smoke]
    python -m benchmarks.execution --parts FOLDER

Each part is planned with two backends in the packaged cell with lags, at the spacing that it is printed with, and its
program is executed dry, printing, resumed, refusing and stopped. A row tells how far a target, a move's time (from
speed data alone, ramps excluded), a run's time and the place of a switching lie from the plan at most, and how many
statements were executed in at least one of these scenarios; the others are listed by reason below. Without `--parts`
the part is a plate.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Iterator
from itertools import product
from pathlib import Path

from benchmarks.limits import all_parts
from benchmarks.parts.tables import row, table
from benchmarks.programs import BACKENDS, cell_with_lags
from geoprint.config import job_of
from geoprint.errors import GeoprintError
from geoprint.export.rapid import Executed
from geoprint.pipeline import plan

SPACING = 1.5
SMOKE_SPACING = 8.0
PLATE = Path(__file__).parents[1] / "data" / "plate.ply"
COLUMNS = (
    "part", "backend", "targets", "motion, um", "move time, ms", "run time, %", "outputs, um", "statements", "executed",
    "scenarios",
)  # fmt: skip
# What the rows must keep: mm, s, share, mm.
MOST_MOTION, MOST_MOVE_TIME, MOST_RUN_TIME, MOST_OUTPUTS = 1e-3, 1e-3, 1e-3, 0.05


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help="one part and backend only, to see that the script runs")
    parser.add_argument("--parts", type=Path, metavar="FOLDER", help="holds patches/ and hearts/")
    arguments = parser.parse_args()
    for line in rows(arguments.parts, smoke=arguments.smoke):
        print(line, flush=True)


def rows(folder: Path | None, *, smoke: bool = False) -> Iterator[str]:
    """Yield the table, and what was not executed by reason.

    Args:
        folder: of the parts, or None for a part of this package.
        smoke: the first part with the first backend only, widely spaced.
    """
    yield from table(*COLUMNS)
    reasons: Counter[str] = Counter()
    kept = told = 0
    with tempfile.TemporaryDirectory() as scratch:
        cell = Path(scratch) / "cell.toml"
        cell.write_text(cell_with_lags(), encoding="utf-8")
        parts = [PLATE] if folder is None else [*all_parts(folder, Path(scratch))]
        cases = list(product(parts, BACKENDS))
        for part, backend in cases[:1] if smoke else cases:
            spacing = SMOKE_SPACING if smoke else SPACING
            try:
                planned = plan(
                    job_of(surface=part, unit="mm", spacing=spacing, backend=backend, cell=cell, place="demo")
                )
            except GeoprintError as error:
                yield row(part.stem, backend, f"refused: {str(error).split(';', maxsplit=1)[0]}")
                continue
            executed = planned.robot[0].executed
            told, kept = told + 1, kept + within(executed)
            reasons.update(reason for _, _, reason in executed.not_executed)
            yield _row(part.stem, backend, planned.robot[0].orders.count, executed)
    yield f"\n{kept} of {told} keep 0.001 mm, 1 ms a move, 0.1 % a run and 0.05 mm of path."
    yield from (f"{count} lines not executed: {reason}" for reason, count in sorted(reasons.items()))


def within(executed: Executed) -> bool:
    """Whether a program keeps all that it must."""
    return (
        executed.motion <= MOST_MOTION
        and executed.move_time <= MOST_MOVE_TIME
        and executed.run_time <= MOST_RUN_TIME
        and executed.outputs <= MOST_OUTPUTS
    )


def _row(part: str, backend: str, targets: int, executed: Executed) -> str:
    return row(
        part, backend, str(targets), f"{1e3 * executed.motion:.3f}", f"{1e3 * executed.move_time:.3f}",
        f"{100.0 * executed.run_time:.3f}", f"{1e3 * executed.outputs:.3f}", str(executed.statements),
        str(executed.executed), str(len(executed.scenarios)),
    )  # fmt: skip


if __name__ == "__main__":
    main()
