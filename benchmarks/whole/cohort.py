"""A cohort for an hour: patches of a thousand synthetic hearts planned by `geoprint sweep`, and the memory it takes.

    python -m benchmarks.whole.cohort --out FOLDER [--count N] [--workers N] [--smoke]

Writes the hearts (`benchmarks.parts.hearts`) and a study of one patch of each: 20 mm round the apex, heat, paths 1 mm
apart, without robot. It runs the study as anybody would, in a process of its own, and writes what all processes of it
hold each minute to FOLDER/memory.csv: proportional set sizes, in which shared pages count once (Linux). Stopped at any
time, the same command goes on; times and memory are of the last run alone.
"""

from __future__ import annotations

import csv
import itertools
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from benchmarks.parts.hearts import APEX, COUNT, write_hearts
from benchmarks.parts.tables import script_parser
from geoprint.errors import how_many, percent
from geoprint.sweep.running import CELLS, REFUSED

STUDY = f"""parts = ["hearts"]
unit = "mm"
backends = ["heat"]

[job]
spacing = {{spacing}}
robot = false

[[sites]]
name = "apex"
at = {list(APEX)}
radius = 20.0
"""
SPACING, SMOKE_COUNT, SMOKE_SPACING = 1.0, 2, 5.0
# How often memory is looked at [s].
MINUTE, SMOKE_MINUTE = 60.0, 0.5
# Shares of the cells at which memory is named.
SHARES = (0.1, 0.5, 1.0)
# The median of so many samples counts.
ABOUT = 5


class Sample(NamedTuple):
    """What the processes of a study hold at one time.

    Attributes:
        seconds: since it was started [s].
        ended: cells that have ended, however they did.
        failed: those of them that were refused or failed.
        processes: of the study.
        memory: of all of them [MB].
    """

    seconds: float
    ended: int
    failed: int
    processes: int
    memory: float


def main() -> None:
    """Run the cohort and say how many parts an hour it is, what failed, and how memory went."""
    parser = script_parser(__doc__, smoke="two hearts at a wide spacing, into a folder that is not kept")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="of hearts, study and memory.csv; required")
    parser.add_argument("--count", type=int, default=COUNT, metavar="N", help="hearts")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="processes of the study")
    arguments = parser.parse_args()
    if arguments.smoke:
        with tempfile.TemporaryDirectory() as folder:
            print(said(run(Path(folder), count=SMOKE_COUNT, workers=1, spacing=SMOKE_SPACING, period=SMOKE_MINUTE)))
        return
    if arguments.out is None:
        parser.error("--out names the folder")
    print(said(run(arguments.out, count=arguments.count, workers=arguments.workers, spacing=SPACING, period=MINUTE)))


def run(folder: Path, *, count: int, workers: int, spacing: float, period: float) -> list[Sample]:
    """Plan so many hearts, and write and return samples of the memory, one each `period` [s] and one at the end.

    Raises:
        SystemExit: the study could not be run.
    """
    write_hearts(folder / "hearts", count=count)
    (folder / "study.toml").write_text(STUDY.format(spacing=spacing), encoding="utf-8")
    out = folder / "study"
    command = [sys.executable, "-m", "geoprint", "sweep", str(folder / "study.toml"), "--out", str(out)]
    process = subprocess.Popen([*command, "--workers", str(workers)])  # noqa: S603  (this command)
    samples: list[Sample] = []
    with (folder / "memory.csv").open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(Sample._fields)
        for sample in _sampled(process, out / CELLS, period=period):
            rows.writerow([round(value, 1) for value in sample])
            file.flush()
            samples.append(sample)
    if process.returncode:
        raise SystemExit(f"the study ended with exit status {process.returncode}")
    return samples


def _sampled(process: subprocess.Popen[bytes], cells: Path, *, period: float) -> Iterator[Sample]:
    """Yield what a process and those it has started hold, each period until it ends; its end has the last memory."""
    begun, held = time.monotonic(), list[float]()
    for number in itertools.count(1):
        try:
            process.wait(max(begun + number * period - time.monotonic(), 0.0))
        except subprocess.TimeoutExpired:
            held = held_by(process.pid)
        ended = list(cells.iterdir()) if cells.is_dir() else []
        failed = sum(path.name.endswith(REFUSED) for path in ended)
        done = sum(path.is_dir() for path in ended)
        yield Sample(time.monotonic() - begun, done + failed, failed, len(held), sum(held))
        if process.returncode is not None:
            return


def held_by(pid: int) -> list[float]:
    """Return what a process and all that it and its own have started hold, one figure each [MB]."""
    return [each for each in map(_held, _family(pid)) if each]


def _family(pid: int) -> Iterator[int]:
    """Yield a process and all that it and its own have started."""
    yield pid
    try:
        tasks = [(task / "children").read_text(encoding="ascii") for task in Path(f"/proc/{pid}/task").iterdir()]
    except OSError:
        return  # it has just ended
    for child in " ".join(tasks).split():
        yield from _family(int(child))


def _held(pid: int) -> float:
    """Return the proportional set size of a process [MB], 0 for one that has just ended."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024.0 for line in lines if line.startswith("Pss:")), 0.0)


def said(samples: Sequence[Sample]) -> str:
    """Return parts an hour, failures, and the memory when 10 %, 50 % and all of the cells had ended."""
    last = samples[-1]
    hourly = 3600.0 * last.ended / last.seconds
    memory = [
        f"{median(each.memory for each in _nearest(samples, share * last.ended)):.0f} MB at {percent(share, 0)}"
        for share in SHARES
    ]
    return (
        f"{how_many(last.ended, 'part')} in {last.seconds / 60.0:.0f} minutes, {hourly:.0f} an hour, "
        f"{last.failed} not planned; {', '.join(memory)}"
    )


def _nearest(samples: Sequence[Sample], ended: float) -> list[Sample]:
    """Return the samples about the time when so many cells had ended: what a cell holds rises and falls."""
    return sorted(samples, key=lambda each: abs(each.ended - ended))[:ABOUT]


if __name__ == "__main__":
    main()
