"""What does a stack of ten layers cost beside one skin: processor time, clock and memory?

    python -m benchmarks.stack_cost [PART] [--spacing MM] [--layers N] [--backend NAME] [--smoke]

Both are planned by the command line, one after the other, each as a user would, with the packaged cell `irb120-slim45`
in its demonstration's place. Memory is the largest sum of what all processes of a command hold at a time, looked at
five times a second; what several share counts once. (Linux alone tells it.)
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from os import times
from pathlib import Path
from typing import NamedTuple

from benchmarks.parts.tables import row, table
from geoprint.config import load_cell, packaged_cell_text

DATA = Path(__file__).parents[1] / "data"
SMOKE_DISC = ("--at", "0", "0", "0", "--radius", "4", "--no-robot")
PRINTED = ("--place", "demo")
CELL = "irb120-slim45"
PAUSE_S = 0.2
KB_PER_MB = 1024.0


class Cost(NamedTuple):
    """What a command took: processor time and clock [s], and memory [MB]."""

    processor: float
    clock: float
    memory: float


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "part", nargs="?", type=Path, default=DATA / "heart_apex_patch.ply", metavar="PART", help="in mm"
    )
    parser.add_argument("--spacing", type=float, default=0.8, metavar="MM")
    parser.add_argument("--layers", type=int, default=10, metavar="N")
    parser.add_argument("--backend", default="heat", metavar="NAME")
    parser.add_argument("--smoke", action="store_true", help="one layer of a disc of the plate")
    arguments = parser.parse_args()
    part, spacing, layers = arguments.part, arguments.spacing, arguments.layers
    if arguments.smoke:
        part, spacing, layers = DATA / "plate.ply", 4.0, 1
    with tempfile.TemporaryDirectory() as folder:
        cell = Path(folder, "cell.toml")
        cell.write_text(packaged_cell_text(CELL), encoding="utf-8")
        thickness = layers * load_cell(cell).process.layer_height
        command = [
            sys.executable, "-m", "geoprint", "plan", str(part), "--unit", "mm", "--backend",
            arguments.backend, "--spacing", f"{spacing:g}", "--cell", str(cell),
            *(SMOKE_DISC if arguments.smoke else PRINTED),
        ]  # fmt: skip
        skin = _cost([*command, "--out", f"{folder}/skin"])
        stack = _cost([*command, "--thickness", f"{thickness:g}", "--out", f"{folder}/stack"])
    print(*table(part.stem, "processor time", "clock", "memory"), sep="\n")
    for name, cost in (("one skin", skin), (f"{layers} layers", stack)):
        print(row(name, f"{cost.processor:.1f} s", f"{cost.clock:.1f} s", f"{cost.memory:.0f} MB"))
    print(row("over the skin", *(f"{more / less:.1f}" for more, less in zip(stack, skin, strict=True))))


def _cost(command: Sequence[str]) -> Cost:
    """Run a command, and return what it took.

    Raises:
        RuntimeError: it was refused.
    """
    before, begun, memory = times(), time.monotonic(), 0.0
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:  # noqa: S603  (our own command)
        while process.poll() is None:
            memory = max(memory, _held(process.pid))
            time.sleep(PAUSE_S)
        said = process.stderr.read() if process.stderr else ""
    if process.returncode:
        raise RuntimeError(said)
    after = times()
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    return Cost(spent, time.monotonic() - begun, memory)


def _held(pid: int) -> float:
    """Return what a process and its children hold [MB]; nothing of those that have ended meanwhile."""
    folder = Path(f"/proc/{pid}")
    try:
        rollup = (folder / "smaps_rollup").read_text(encoding="ascii")
        tasks = [(task / "children").read_text(encoding="ascii") for task in (folder / "task").iterdir()]
    except OSError:
        return 0.0
    held = next((int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Pss:")), 0)
    return held / KB_PER_MB + sum(_held(int(child)) for children in tasks for child in children.split())


if __name__ == "__main__":
    main()
