"""Do starts of runs stack from layer to layer?

    python -m benchmarks.seams [--parts FILE ...] [--thickness MM] [--height MM] [--spacing MM] [--smoke]

The table says how far the starts of closed runs are from those one layer below and two, in spacings, where the run has
a place two spacings from all of them.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from benchmarks.parts.tables import row, table
from geoprint.config import job_of
from geoprint.layers import whole_layers
from geoprint.model import FloatArray
from geoprint.pipeline.covering import cover
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.workpiece import prepare_workpiece

DATA = Path(__file__).parents[1] / "data"
OWN, SMOKE_OWN = ("heart_flat_patch.ply", "heart_apex_patch.ply"), ("plate.ply",)
# Nearer starts than so many spacings count as stacked.
APART = 2.0
HEADINGS = (
    "part", "layers", "closed runs", "with room", "one below: least", "nearer than 2", "two: least", "nearer than 2",
)  # fmt: skip


class _Run(NamedTuple):
    """A run: its places from its start [mm], and whether it is closed."""

    places: FloatArray
    closed: bool


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside those of data/"
    )
    parser.add_argument("--thickness", type=float, default=4.0, metavar="MM", help="in layers of the packaged cell")
    parser.add_argument("--height", type=float, default=0.5, metavar="MM", help="of a layer, as the cell has it")
    parser.add_argument("--spacing", type=float, default=1.5, metavar="MM")
    parser.add_argument("--smoke", action="store_true", help="two layers of a plate")
    arguments = parser.parse_args()
    thickness, spacing = (1.0, 6.0) if arguments.smoke else (arguments.thickness, arguments.spacing)
    count, _ = whole_layers(thickness, height=arguments.height)
    print(*table(*HEADINGS), sep="\n", flush=True)
    for file in [*(DATA / name for name in (SMOKE_OWN if arguments.smoke else OWN)), *arguments.parts]:
        layers = [_runs(file, layer, thickness, spacing) for layer in range(1, count + 1)]
        print(_row(file, layers, spacing), flush=True)


def _runs(file: Path, layer: int, thickness: float, spacing: float) -> list[_Run]:
    """Return the runs of a layer."""
    job = job_of(surface=file, unit="mm", spacing=spacing, thickness=thickness, layer=layer, robot=False)
    stage = Stages(lambda _: None)
    workpiece = prepare_workpiece(job, stage, backends=[job.backend])
    curves = cover(job, workpiece, stage).toolpath.curves
    return [_Run(curves.xyz(workpiece.surface, run), bool(curves.closed[run])) for run in range(curves.count)]


def _row(file: Path, layers: list[list[_Run]], spacing: float) -> str:
    """Return how far starts are from those of the layers below."""
    found: list[list[float]] = [[], []]
    closed, roomy = 0, 0
    for above, runs in enumerate(layers):
        below = [KDTree(np.array([run.places[0] for run in layer])) for layer in layers[max(above - 2, 0) : above]]
        for run in runs:
            away = [np.asarray(tree.query(run.places)[0], dtype=np.float64) / spacing for tree in reversed(below)]
            closed += run.closed
            if run.closed and away and np.min(away, axis=0).max() >= APART:
                roomy += 1
                for distances, nearest in zip(found, away, strict=False):
                    distances.append(float(nearest[0]))
    told = [text for each in found for text in (_least(each), f"{sum(away < APART for away in each)} of {len(each)}")]
    return row(file.name, str(len(layers)), str(closed), str(roomy), *told)


def _least(values: list[float]) -> str:
    return f"{min(values):.2f}" if values else "-"


if __name__ == "__main__":
    main()
