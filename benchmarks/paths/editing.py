"""How fast are paths and exact figures while a source is dragged over a part of 50,000 faces?

    python -m benchmarks.paths.editing [--smoke]

A point source is dragged over a spherical cap in twenty steps, with each backend. `Planner` is asked for the paths of
each step, and where the drag rests for the figures. Beside it stands what planning anew takes to the same paths and
figures, the robot left out. Seconds are those of the processor, of all threads together: the clock depends on what else
the machine does. Every figure is the mean over the steps; paths of the last step are compared with those of `plan`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

import numpy as np

from benchmarks.parts.surfaces import cap, triangulated
from benchmarks.parts.tables import row, script_parser, table
from geoprint import Job, job_of, load, plan
from geoprint.geometry.files import save_ply
from geoprint.workflow import Planner

BACKENDS = ("heat", "lscm", "fast-marching")
STEPS, FACES, SPACINGS = 20, 50_000, (1.0, 2.0)
# Angle of the cap from its pole to the rim, and of the drag to both sides of the pole [degrees]; and its radius [mm].
CAP_DEG, DRAG_DEG, DEPTH = 60.0, 25.0, 20.0
COLUMNS = (
    "spacing mm", "backend", "paths/s", "paths s", "figures s", "made ready s", "anew: paths and figures s",
    "same paths",
)  # fmt: skip

_Value = TypeVar("_Value")


def main() -> None:
    """Print the table."""
    arguments = script_parser(__doc__, smoke="a step on a part of 500 faces").parse_args()
    steps, faces = (1, 500) if arguments.smoke else (STEPS, FACES)
    spacings = (4.0,) if arguments.smoke else SPACINGS
    with TemporaryDirectory() as folder:
        part = Path(folder, "cap.ply")
        save_ply(triangulated(cap(CAP_DEG, depth=DEPTH), name="cap", faces=faces), part)
        print(f"{len(load(part, unit='mm').faces)} faces, {steps} steps", *table(*COLUMNS), sep="\n")
        for spacing in spacings:
            for backend in BACKENDS:
                print(measured(list(drag(part, backend, spacing=spacing, steps=steps))), flush=True)


def drag(part: Path, backend: str, *, spacing: float, steps: int) -> Iterator[Job]:
    """Yield the job of each step of a drag of the source over the pole of a cap."""
    radius = DEPTH / np.radians(CAP_DEG)
    for angle in np.radians(np.linspace(-DRAG_DEG, DRAG_DEG, steps + 1)):
        point = [radius * np.sin(angle), 0.1 * radius * np.sin(angle), radius * np.cos(angle)]
        yield job_of(surface=part, unit="mm", backend=backend, spacing=spacing, robot=False, source={"point": point})


def measured(jobs: list[Job]) -> str:
    """Return the line of a drag, which begins with the first job."""
    first, *steps = jobs
    plan(first)  # Compiled loops are loaded.
    planner, ready = timed(lambda: Planner(first))
    planner.figures(first)
    paths = [timed(lambda job=job: planner.paths(job))[1] for job in steps]
    rests = steps[:: max(len(steps) // 3, 1)]
    figures = [timed(lambda job=job: planner.figures(job))[1] for job in rests]
    anew, seconds = timed(lambda: plan(steps[-1]))
    found = planner.plan(steps[-1])
    same = len(found.paths) == len(anew.paths) and all(map(np.array_equal, found.paths, anew.paths))
    each = float(np.mean(paths))
    return row(
        f"{first.spacing:g}", first.backend, f"{1.0 / each:.1f}", f"{each:.2f}", f"{np.mean(figures):.1f}",
        f"{ready:.2f}", f"{seconds:.1f}", "yes" if same else "no",
    )  # fmt: skip


def timed(work: Callable[[], _Value]) -> tuple[_Value, float]:
    """Return what some work returns, and the seconds of the processor that it takes."""
    start = time.process_time()
    return work(), time.process_time() - start


if __name__ == "__main__":
    main()
