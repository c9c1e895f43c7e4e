"""Does every heart print, and at the speed that was set?

    python -m benchmarks.hearts --parts FOLDER [--spacing MM] [--cell NAME ...] [--discs N] [--accelerations SHARE]
    python -m benchmarks.hearts --smoke

A row for each patch of FOLDER/patches, cell and what is done on slowdowns: whether it prints with the demonstration's
placement, or what refuses it; the share of the deposit within 1 % of the set speed, of what is no ramp at the end of a
run; mean and largest lean of the nozzle; clearance; time of the print and processor time of the planning. `--discs`
adds discs cut from the whole hearts of FOLDER/hearts: about vertices drawn by a fixed seed, of 8 to 30 mm radius.
`--accelerations` takes another share of the joints' accelerations, which no maker publishes.
"""

from __future__ import annotations

import argparse
import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import numpy as np

from benchmarks.parts.tables import row, table
from geoprint import plan
from geoprint.account.prints.laid import record_deposited
from geoprint.config import PACKAGED_CELLS, Job, job_of, packaged_cell_text
from geoprint.errors import GeoprintError
from geoprint.paths import largest_lean, mean_lean
from geoprint.surfaces.files import load_file

DATA = Path(__file__).parents[1] / "data"
SEED = 20
RADII = (8.0, 30.0)
HEADINGS = (
    "part", "cell", "on slowdown", "prints", "mm/s", "deposits", "worst run", "at speed off ramps", "ramps",
    "mean lean", "largest lean", "clearance", "print", "planning",
)  # fmt: skip


@final
@dataclass(frozen=True, slots=True)
class Case:
    """What is planned: its name, and the job but for cell and slowdowns."""

    name: str
    options: dict[str, object]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=Path, metavar="FOLDER", help="with patches and whole hearts")
    parser.add_argument("--spacing", type=float, default=1.0, metavar="MM")
    parser.add_argument("--cell", nargs="*", default=list(PACKAGED_CELLS), choices=PACKAGED_CELLS)
    parser.add_argument("--on-slowdown", nargs="*", default=["auto"], choices=["auto", "follow"])
    parser.add_argument("--discs", type=int, default=0, metavar="N", help="cut from whole hearts")
    parser.add_argument("--accelerations", type=float, default=1.0, metavar="SHARE", help="of the joints")
    parser.add_argument("--smoke", action="store_true", help="a disc of data/ at 4 mm, one cell")
    arguments = parser.parse_args()
    if not (arguments.smoke or arguments.parts):
        parser.error("state --parts FOLDER, or --smoke")
    if arguments.smoke:
        disc: dict[str, object] = {
            "surface": DATA / "heart.ply",
            "spacing": 4.0,
            "patch": {"at": [1.5, 0.0, -57.5], "radius": 6.0},
        }
        cases = [Case("disc about the apex", disc)]
        cells, slowdowns = list(PACKAGED_CELLS[:1]), ["auto"]
    else:
        cases = list(_patches(arguments.parts, arguments.spacing))
        cases += _discs(arguments.parts, arguments.spacing, arguments.discs)
        cells, slowdowns = arguments.cell, arguments.on_slowdown
    for line in table(*HEADINGS):
        print(line, flush=True)
    printed: list[bool] = []
    for case in cases:
        for cell in cells:
            for slowdown in slowdowns:
                cells_of_row = _row(case, cell, slowdown, accelerations=arguments.accelerations)
                printed.append(cells_of_row[0] == "yes")
                print(row(case.name, cell, slowdown, *cells_of_row), flush=True)
    print(f"\n{sum(printed)} of {len(printed)} print.")


def _patches(folder: Path, spacing: float) -> Iterator[Case]:
    for path in sorted((folder / "patches").glob("*.ply")):
        yield Case(path.stem, {"surface": path, "spacing": spacing})


def _discs(folder: Path, spacing: float, count: int) -> Iterator[Case]:
    """Yield discs about vertices of whole hearts, by a fixed seed."""
    hearts = sorted(path for path in (folder / "hearts").glob("*.*") if path.suffix in {".ply", ".stl", ".obj"})
    random = np.random.default_rng(SEED)
    for number in range(count if hearts else 0):
        heart = hearts[number % len(hearts)]
        vertices = load_file(heart, unit="mm").surface.vertices
        at = vertices[random.integers(len(vertices))]
        radius = float(np.round(random.uniform(*RADII), 1))
        patch = {"at": [float(value) for value in at], "radius": radius}
        yield Case(f"{heart.stem} disc {number} r{radius:g}", {"surface": heart, "spacing": spacing, "patch": patch})


def _row(case: Case, cell: str, slowdown: str, *, accelerations: float) -> list[str]:
    began = time.process_time()
    try:
        with TemporaryDirectory() as folder:
            planned = plan(_job(case, cell, slowdown, Path(folder), accelerations=accelerations))
    except GeoprintError as error:
        return [str(error)[:110].replace("|", "/"), *[""] * 9, f"{time.process_time() - began:.0f} s"]
    took = time.process_time() - began
    (robot,) = planned.robot
    timed, deposited = robot.trajectory, record_deposited(robot, planned.workpiece.cell)
    assert deposited is not None
    return [
        "yes",
        f"{planned.workpiece.cell.process.speed:g}",
        f"{deposited.share:.1%}",
        f"{max(deposited.most_run, 2.0 - deposited.least_run, key=lambda share: abs(share - 1.0)):.1%}",
        f"{timed.share_at_speed / max(1.0 - timed.share_on_ramps, 1e-9):.1%}",
        f"{timed.share_on_ramps:.1%}",
        f"{np.degrees(mean_lean(planned.poses)):.1f} deg",
        f"{np.degrees(largest_lean(planned.poses)):.1f} deg",
        f"{robot.clearance.smallest:.2f} mm",
        f"{timed.duration:.0f} s",
        f"{took:.0f} s",
    ]


def _job(case: Case, cell: str, slowdown: str, folder: Path, *, accelerations: float) -> Job:
    """Return the job of a row, with its cell in a file of its own."""
    text = packaged_cell_text(cell)
    found = re.search(r"(?m)^accelerations_deg_s2 = \[(.*)\]$", text)
    if found is None:
        raise ValueError(f"the cell {cell} states no accelerations.")
    scaled = ", ".join(f"{float(value) * accelerations:g}" for value in found[1].split(","))
    path = folder / f"{cell}.toml"
    path.write_text(text.replace(found[1], scaled), encoding="utf-8")
    return job_of(unit="mm", place="demo", cell=path, on_slowdown=slowdown, **case.options)


if __name__ == "__main__":
    main()
