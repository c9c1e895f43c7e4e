"""What breaks when programs of real parts are tried to destruction on a controller of our own?

    python -m benchmarks.destruction --parts FOLDER [--stops COUNT] [--seed SEED]
    python -m benchmarks.destruction --smoke

Each part is planned with two backends and three cells (a valve that only opens and shuts, a flow that follows the
speed, and a cell with vacuum, priming and a final exposure), all with lags, as if fixture and part were known. Every
promise of `promises` is tried: dry runs, prints, prints from later runs, stops at random moments with the program
started again behind them, and everything that must be refused. Then each mutant must break its promise.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.destruction.mutants import MUTANTS
from benchmarks.destruction.promises import PROMISES, stops
from benchmarks.destruction.subject import Subject, cell_with_lags, subject_of
from benchmarks.parts.tables import row, table
from geoprint.config import job_of
from geoprint.errors import GeoprintError
from geoprint.pipeline.planning import plan_paths, with_robot
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.workpiece import prepare_workpiece, with_rounds
from geoprint.results import Plan

BACKENDS = ("heat", "lscm")
SPACING = 2.0
SMOKE_SPACING = 9.0
ANALOG = {"mode": '"analog"', "flow": '"aoFlow"', "flow_per_mm3_s": "0.1", "flow_lag_s": "0.05"}
VACUUM = {"vacuum": '"doVacuum"'}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=Path, metavar="FOLDER", help="holds patches/")
    parser.add_argument("--stops", type=int, default=500, metavar="COUNT", help="random stops of each program")
    parser.add_argument("--seed", type=int, default=0, help="of the random moments")
    parser.add_argument("--smoke", action="store_true", help="data/'s plate in one cell and a few stops only")
    arguments = parser.parse_args()
    folder: Path | None = None if arguments.smoke else arguments.parts
    parts = [Path("data/plate.ply")] if folder is None else sorted((folder / "patches").glob("*.ply"))
    count = 4 if arguments.smoke else arguments.stops
    tried = {**PROMISES, "stops": partial(stops, seed=arguments.seed, count=count)}
    for line in table("part", "backend", "cell", "targets", *tried, "lines executed", "mutants found"):
        print(line, flush=True)
    never: set[str] = set()
    with tempfile.TemporaryDirectory() as scratch:
        for name, text in cells().items():
            (Path(scratch) / f"{name}.toml").write_text(text, encoding="utf-8")
        backends, kinds = (BACKENDS[:1], ["flow"]) if arguments.smoke else (BACKENDS, list(cells()))
        for part, backend, cell in product(parts, backends, kinds):
            path = Path(scratch) / f"{cell}.toml"
            spacing = SMOKE_SPACING if arguments.smoke else SPACING
            try:
                subject = subject_of(planned(part, backend=backend, cell=path, spacing=spacing))
            except GeoprintError as error:
                print(row(part.stem, backend, cell, f"refused: {str(error).split(';', maxsplit=1)[0]}"), flush=True)
                continue
            told = [_told(list(promise(subject))) for promise in tried.values()]
            lines = f"{len({key[:2] for key in subject.seen}) - len(subject.never())}"
            lines += f" of {len({key[:2] for key in subject.seen})}"
            found = _mutants(subject) if cell == "valve" else ""
            print(row(part.stem, backend, cell, str(subject.orders.count), *told, lines, found), flush=True)
            never |= set(subject.never().values())
    print("\nLines of some program that no scenario executed: " + "; ".join(sorted(never)))


def cells() -> dict[str, str]:
    """Return the texts of the cells that are tried, by name."""
    valve = cell_with_lags()
    stations = re.sub(r"# (\[purge\]|joints_deg = \[40|duration_s = 2)", r"\1", valve)
    stations = stations.replace("# [flood]\n# duration_s = 60\n# joints", "[flood]\nduration_s = 60\njoints")
    return {"valve": valve, "flow": _with(valve, ANALOG), "stations": _with(stations, VACUUM)}


def planned(part: Path, *, backend: str, cell: Path, spacing: float = SPACING) -> Plan:
    """Plan a part as if somebody had touched the fixture and stated where the part stands on it."""
    job = job_of(surface=part, unit="mm", spacing=spacing, backend=backend, place="demo", cell=cell)
    stage = Stages(lambda _: None)
    workpiece = prepare_workpiece(job, stage, backends=[job.backend])
    assert workpiece.placement is not None
    placement = replace(workpiece.placement, calibrated=True, part_stated=True, misses=np.zeros(3))
    workpiece = replace(workpiece, placement=placement)
    return with_robot(plan_paths(with_rounds(job, workpiece.cell), workpiece, stage), placement, stage)


def _with(text: str, values: dict[str, str]) -> str:
    """Return a cell with values of its signals set, whether they stand there or are commented out."""
    for name, value in values.items():
        text = re.sub(rf"(?m)^(# )?{name} = .*$", f"{name} = {value}", text, count=1)
    return text


def _told(failures: list[str]) -> str:
    return f"{len(failures)}: {failures[0]}" if failures else "0"


def _mutants(subject: Subject) -> str:
    missed = [mutant.found for mutant in MUTANTS if not mutant.failure(subject)]
    return f"{len(MUTANTS) - len(missed)} of {len(MUTANTS)}" + "".join(f"; missed {each}" for each in missed)


if __name__ == "__main__":
    main()
