"""How even are rows beside a drawn curve, at the rim and away from it?

    python -m benchmarks.guided [--parts FILE ...] [--spacing MM] [--contours N] [--backend NAME ...] [--smoke]

Every part in one piece gets a line over its middle, along its longer side: the shortest one between places below a
straight line from rim to rim. A row for each part and backend: starts; the variation of the thickness; what is covered
once, missed and covered twice; the variation of the spacing to both sides, of all and of what lies farther from the rim
than the turns and two spacings; the length of the turns over that of all.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.parts.tables import row, table
from geoprint import job_of, plan
from geoprint.account.metrics import COVERED_ONCE, GAP, OVERLAP, SPACING, THICKNESS
from geoprint.errors import GeoprintError
from geoprint.model import FloatArray, Surface
from geoprint.results import Plan
from geoprint.surfaces import PolylineDistance, boundary_loops, boundary_seed, closest, even_points, positions
from geoprint.surfaces.files import load

DATA = Path(__file__).parents[1] / "data"
OWN = ("plate.ply", "heart_flat_patch.ply", "heart_apex_patch.ply")
HEADINGS = (
    "part", "backend", "runs", THICKNESS.column, COVERED_ONCE.column, GAP.column, OVERLAP.column, SPACING.column,
    "away from the rim", "share", "turns",
)  # fmt: skip
# Away from the rim: beyond the line of ends by so many spacings.
BEYOND = 2.0
# Places of a line [mm], joined by shortest lines.
STEP = 8.0


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside those of data/"
    )
    parser.add_argument("--spacing", type=float, default=1.0, metavar="MM")
    parser.add_argument("--contours", type=int, default=0, metavar="N")
    parser.add_argument("--backend", nargs="*", default=["heat", "fast-marching", "lscm"])
    parser.add_argument("--smoke", action="store_true", help="a part of data/ at 4 mm, one backend")
    arguments = parser.parse_args()
    spacing = 4.0 if arguments.smoke else arguments.spacing
    for line in table(*HEADINGS):
        print(line, flush=True)
    for file in [*(DATA / name for name in OWN[: 1 if arguments.smoke else None]), *arguments.parts]:
        for backend in arguments.backend[: 1 if arguments.smoke else None]:
            print(_row(file, backend, spacing=spacing, contours=arguments.contours), flush=True)


def _row(file: Path, backend: str, *, spacing: float, contours: int) -> str:
    job = job_of(
        surface=file, unit="mm", spacing=spacing, backend=backend, robot=False, pattern="guided", contours=contours,
        source={"curve": guide(load(file, unit="mm")).tolist()},
    )  # fmt: skip
    try:
        planned = plan(job)
    except GeoprintError as error:
        return row(file.stem, backend, str(error)[:110].replace("|", "/"), *[""] * (len(HEADINGS) - 3))
    found = planned.uniformity
    assert found is not None
    surface = planned.workpiece.surface
    rims = boundary_seed(surface).curves
    rim = PolylineDistance([rims.xyz(surface, curve) for curve in range(rims.count)], step=spacing / 4.0)
    sides = found.sides
    every = sides.sides()[rim(sides.places) > (contours + 0.5 + BEYOND) * spacing]
    away = every[np.isfinite(every)]
    return row(
        file.stem,
        backend,
        str(planned.toolpath.curves.count),
        f"{found.thickness.cv:.2%}",
        f"{found.covered_once:.2%}",
        f"{found.gap:.2%}",
        f"{found.overlap:.2%}",
        f"{sides.both.cv:.2%}",
        f"{away.std() / away.mean():.2%}" if away.size else "",
        f"{away.size / max(sides.both.ratios.size, 1):.0%}",
        f"{_turning(planned):.1%}",
    )


def guide(surface: Surface) -> FloatArray:
    """Return the (k, 3) places of a line over the middle of a part, along its longer side, from rim to rim [mm]."""
    rim = surface.vertices[np.concatenate(boundary_loops(surface)[:1])]
    middle = surface.vertices.mean(axis=0)
    _, _, axes = np.linalg.svd(rim - rim.mean(axis=0), full_matrices=False)
    along, across = (rim - middle) @ axes[0], np.abs((rim - middle) @ axes[1])
    first, last = (int(np.argmin(np.where(sign * along > 0.0, across, np.inf))) for sign in (-1.0, 1.0))
    near = surface.vertices[int(np.linalg.norm(surface.vertices - middle, axis=1).argmin())]
    straight = even_points(np.stack([rim[first], near, rim[last]]), step=STEP)
    return positions(surface, closest(surface, straight)[0])


def _turning(planned: Plan) -> float:
    """Return the length of turns, where the row is no whole number, over the whole length."""
    curves, surface, rows = planned.toolpath.curves, planned.workpiece.surface, planned.toolpath.rows
    turned, length = 0.0, 0.0
    for curve in range(curves.count):
        steps = np.linalg.norm(np.diff(curves.xyz(surface, curve), axis=0), axis=1)
        within = rows[curves.offsets[curve] : curves.offsets[curve + 1] - 1]
        turned += float(steps[within != np.floor(within)].sum())
        length += float(steps.sum())
    return turned / length


if __name__ == "__main__":
    main()
