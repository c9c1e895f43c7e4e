"""What a piece of work costs: clock, processor time and memory of a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import numpy as np

from benchmarks import ROOT
from benchmarks.parts.surfaces import cap, triangulated
from geoprint.geometry.files import save_ply
from geoprint.model import FloatArray, Surface
from tests.meshes import sphere

TREE = ROOT
# A process may say its own cost: seconds of clock and of the processor, without imports, and the memory above what its
# work was given [MB].
INNER = "inner cost:"
# Level curves of a raster, and segments of the border that it is of.
LEVELS, SEGMENTS = 20, 1_200


@final
@dataclass(frozen=True, slots=True)
class Cost:
    """What a piece of work took: clock and processor time [s], and peak memory [MB]."""

    clock: float
    processor: float
    memory: float


def cost_of(arguments: Sequence[str], tree: Path, *, fresh: bool = False) -> Cost:
    """Run a piece of work in a tree and return what it took.

    Args:
        arguments: of the interpreter; `OUT` is an empty place, and a name of `PARTS` a file with that part.
        tree: to import from.
        fresh: whether what was compiled before is kept from it.

    Raises:
        RuntimeError: it failed; says with what.
    """
    cost, inner = _run(arguments, tree, fresh=fresh)
    return inner[-1] if inner else cost


def costs_of(codes: Sequence[str], tree: Path) -> list[Cost]:
    """Run several pieces of inner work in one process, each with names of its own, and return what each took.

    Args:
        codes: each says its own cost.
        tree: to import from.

    Raises:
        RuntimeError: one of them failed; says with what.
    """
    program = f"for code in {list(codes)!r}:\n    exec(code, {{'__name__': '__main__'}})"
    return _run(("-c", program), tree, fresh=False)[1]


def _run(arguments: Sequence[str], tree: Path, *, fresh: bool) -> tuple[Cost, list[Cost]]:
    """Run a piece of work, and return what the process took and what it said itself."""
    with TemporaryDirectory() as folder:
        # What Python compiles stays beside the sources, as it does for people.
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        environment |= {"PYTHONPATH": str(tree), FOLDER: folder_of_parts().name}
        environment |= {"NUMBA_CACHE_DIR": folder} if fresh else {}
        places = {"OUT": f"{folder}/out"} | {name: str(part_file(name)) for name in PARTS if name in arguments}
        command = [sys.executable, *(places.get(each, each) for each in arguments)]
        start, said = os.times(), Path(folder, "said")
        with said.open("wb") as sink:
            process = subprocess.Popen(  # noqa: S603  (commands of this folder)
                command, cwd=tree, env=environment, stdout=sink, stderr=subprocess.STDOUT
            )
            _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        text = said.read_text(encoding="utf-8", errors="replace")
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)[:200]} in {tree} ended with {process.returncode}: {text[-2000:]}")
    cost = Cost(os.times().elapsed - start.elapsed, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0)
    inner = [line.removeprefix(INNER).split() for line in text.splitlines() if line.startswith(INNER)]
    return cost, [Cost(*map(float, figures)) for figures in inner]


def least(costs: Sequence[Cost]) -> Cost:
    """Return the least of each that some runs took: the machine is rarely alone."""
    return Cost(*(min(getattr(cost, name) for cost in costs) for name in ("clock", "processor", "memory")))


# Names the folder in which parts are kept to the processes that are timed.
FOLDER = "BENCHMARK_PARTS"
PARTS: Mapping[str, Callable[[], Surface]] = {
    "SPHERE": lambda: sphere(radius=40.0, subdivisions=8),
    "CAP": lambda: triangulated(cap(40.0, depth=30.0), name="cap", faces=10_000),
}


@cache
def part_file(name: str) -> Path:
    """Return a file with a part of that name."""
    path = Path(folder_of_parts().name, f"{name.lower()}.ply")
    save_ply(PARTS[name](), path)
    return path


@cache
def folder_of_parts() -> TemporaryDirectory[str]:
    """Return the folder, which goes when this process does."""
    return TemporaryDirectory()


@cache
def cap_of(faces: int) -> Surface:
    """Return an irregular mesh of a cap of 70 degrees, with about so many faces, from the folder or for it."""
    kept = Path(os.environ[FOLDER], f"cap_{faces}.npz")
    if not kept.exists():
        made = triangulated(cap(70.0), name="cap", faces=faces, style="irregular")
        np.savez(kept, vertices=made.vertices, faces=made.faces)
    with np.load(kept) as arrays:
        return Surface(arrays["vertices"], arrays["faces"], name="cap")


def flower() -> FloatArray:
    """Return the segments of a smooth border with bays and a hole, 60 mm across, on no axis of the raster."""
    angles = 2 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    reach = 24.0 + 6.0 * np.cos(3 * angles + 0.3) + 1.5 * np.sin(7 * angles)
    rim = np.column_stack([np.cos(angles), np.sin(angles)]) * reach[:, None]
    turn = 2 * np.pi * np.arange(5) / 5 + 0.2
    hole = 4.0 * np.column_stack([np.cos(turn), -np.sin(turn)]) + [2.0, 1.0]
    return np.concatenate([np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in (rim, hole)])
