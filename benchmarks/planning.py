"""Where does the time of a plan go? The seconds and the share of each stage, and the heat method beside its peer.

    python -m benchmarks.planning [--spacing MM] [--smoke]

The peer is potpourri3d's heat method (geometry-central), run on the same refined surface in the same process where it
is installed (`pip install potpourri3d`); its wheel uses Eigen's simplicial solver, which is slower than the supernodal
one that geometry-central uses where it is built with SuiteSparse.
"""

from __future__ import annotations

import argparse
import importlib.util
import time

import numpy as np

from benchmarks.uniformity import DATA
from geoprint.backends.heat import Heat
from geoprint.config import job_of
from geoprint.pipeline import plan
from geoprint.results import Plan
from geoprint.surfaces import boundary_loops

PART = "heart_flat_patch.ply"
SMOKE_PART = "plate.ply"


def main() -> None:
    """Print the stages of one plan and the ratio to the peer."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spacing", type=float, default=1.0, help="mm between neighbouring paths")
    parser.add_argument("--smoke", action="store_true", help="the smallest case only, to see that the script runs")
    arguments = parser.parse_args()
    part, spacing = (SMOKE_PART, 12.0) if arguments.smoke else (PART, arguments.spacing)
    planned = plan(job_of(surface=DATA / part, unit="mm", spacing=spacing, place="demo"))
    total = sum(seconds for _, seconds in planned.timings)
    print(f"{part} at {spacing:g} mm: {len(planned.workpiece.surface.faces)} faces, {planned.poses.count} poses")
    for name, seconds in planned.timings:
        print(f"  {name:<16}{seconds:7.2f} s  {seconds / total:6.1%}")
    print(f"  {'all':<16}{total:7.2f} s")
    _print_peer(planned)


def _print_peer(planned: Plan) -> None:
    if importlib.util.find_spec("potpourri3d") is None:
        print("potpourri3d is not installed: no ratio")
        return
    surface, seed = planned.workpiece.surface, planned.workpiece.seed
    start = time.perf_counter()
    Heat(surface).distance(seed)
    own = time.perf_counter() - start
    potpourri3d = importlib.import_module("potpourri3d")
    start = time.perf_counter()
    solver = potpourri3d.MeshHeatMethodDistanceSolver(surface.vertices.copy(), surface.faces.copy())
    solver.compute_distance_multisource(np.concatenate(boundary_loops(surface)))
    peer = time.perf_counter() - start
    print(f"heat method, {len(surface.faces)} faces: {own:.2f} s, potpourri3d {peer:.2f} s, ratio {own / peer:.2f}")


if __name__ == "__main__":
    main()
