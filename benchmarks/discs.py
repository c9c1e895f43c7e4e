"""Can a disc be cut and planned anywhere on a heart? Five places on each of the shared hearts, or those given.

    python -m benchmarks.discs [FILE ...] [--radius MM] [--spacing MM] [--smoke]

The places are corners of the mesh, each as far as possible from those before; so holes, rims and tips are among them.
Files without a unit are taken to be in mm. A place that cannot be planned shows the sentence that says why.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from benchmarks.parts.tables import row, rule
from geoprint.account.metrics import COVERED_ONCE, THICKNESS
from geoprint.config import job_of
from geoprint.errors import GeoprintError
from geoprint.model import FloatArray
from geoprint.pipeline import plan
from geoprint.surfaces.files import load
from geoprint.surfaces.topology import used_vertices

HEARTS = Path(__file__).parents[1].parent / "shared" / "data" / "hearts"
PLACES = 5
# Planned by the smoke run; small and part of the project.
SMOKE_PART = Path(__file__).parents[1] / "data" / "heart_flat_patch.ply"


def main() -> None:
    """Print a row for each place."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", type=Path, nargs="*", help="bodies; by default the shared hearts")
    parser.add_argument("--radius", type=float, default=25.0, help="mm along the surface")
    parser.add_argument("--spacing", type=float, default=2.5, help="mm between neighbouring paths")
    parser.add_argument("--smoke", action="store_true", help="one small case only, to see that the script runs")
    arguments = parser.parse_args()
    files: list[Path] = arguments.files or sorted(HEARTS.glob("*.*"))
    if arguments.smoke:
        files, arguments.radius = [SMOKE_PART], 5.0
    print(row("body", "place [mm]", "patch", "area / flat disc", THICKNESS.column, COVERED_ONCE.column, "seconds"))
    print(rule(7))
    for path in files:
        try:
            places = spread_places(path)
        except GeoprintError as error:
            print(row(path.name, "", f"not read: {error}", *[""] * 4))
            continue
        for place in places[: 1 if arguments.smoke else PLACES]:
            print(planned_row(path, place, radius=arguments.radius, spacing=arguments.spacing), flush=True)


def spread_places(path: Path) -> FloatArray:
    """Return (PLACES, 3) corners of a mesh, each the farthest from those before."""
    surface = load(path, unit="mm")
    corners = surface.vertices[used_vertices(surface.faces)]
    chosen = [corners[0]]
    for _ in range(PLACES - 1):
        chosen.append(corners[np.argmax(np.min([np.linalg.norm(corners - one, axis=1) for one in chosen], axis=0))])
    return np.array(chosen)


def planned_row(path: Path, place: FloatArray, *, radius: float, spacing: float) -> str:
    """Return what comes of a disc at one place."""
    start = time.perf_counter()
    words = "{:.1f} {:.1f} {:.1f}".format(*place)
    job = job_of(surface=path, unit="mm", patch={"at": place.tolist(), "radius": radius}, spacing=spacing, robot=False)
    try:
        planned = plan(job)
    except GeoprintError as error:
        return row(
            path.name, words, f"{type(error).__name__}: {error}", *[""] * 3, f"{time.perf_counter() - start:.1f}"
        )
    found = planned.workpiece.preparations[0]
    assert planned.uniformity is not None
    even = f"{planned.uniformity.thickness.cv:.2%}", f"{planned.uniformity.covered_once:.2%}"
    share = found.area / (np.pi * radius**2)
    return row(path.name, words, found.topology, f"{share:.3f}", *even, f"{time.perf_counter() - start:.1f}")


if __name__ == "__main__":
    main()
