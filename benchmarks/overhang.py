"""What overhangs without a table that tilts, and with one, and how often does that move?

    python -m benchmarks.overhang [--parts FILE ...] [--spacing MM] [--backend NAME] [--smoke]

A row for each part and range: a cap of half-angle 85 degrees, and any other files in mm. A table brings up what lies
within its range of what is up at rest: 30 degrees are like a hexapod, 90 like a tilt-turn table. Told are the deposited
length that overhangs by more than the critical angle at rest and with the table, by how much the worst place misses the
critical angle whatever the table does, its moves in the given order and with pieces of runs gathered by attitude, and
the processor time of the choice for 50 000 poses: those of the deposit, each as often as needed.

What prints over a table of the cell, and how fast that is planned, tells `benchmarks.attitudes`.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.attitudes import deposit
from benchmarks.parts.surfaces import cap, triangulated
from benchmarks.parts.tables import row, table
from geoprint import job_of, plan
from geoprint.model import FloatArray
from geoprint.motion.tilting import Margins, UpRange, gathered, tilted
from geoprint.quality import overhang
from geoprint.results import Plan
from geoprint.surfaces.files import ply_bytes
from geoprint.transforms import angles_between

RANGES_DEG = (30.0, 90.0)
CAP_ANGLE_DEG, CAP_FACES, SMOKE_FACES = 85.0, 12_000, 2_000
POSES = 50_000
HEADINGS = (
    "part", "poses", "range", "deposit", "overhangs", "with the table", "missing angle", "moves", "gathered",
    "seconds for 50k poses",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside the cap")
    parser.add_argument("--spacing", type=float, default=1.0, metavar="MM")
    parser.add_argument("--backend", default="heat")
    parser.add_argument("--smoke", action="store_true", help="the cap at 4 mm")
    arguments = parser.parse_args()
    spacing = 4.0 if arguments.smoke else arguments.spacing
    for line in table(*HEADINGS):
        print(line, flush=True)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "cap of 85 degrees.ply"
        faces = SMOKE_FACES if arguments.smoke else CAP_FACES
        path.write_bytes(ply_bytes(triangulated(cap(CAP_ANGLE_DEG), name=path.stem, faces=faces)))
        for file in [path, *arguments.parts]:
            planned = plan(job_of(surface=file, unit="mm", spacing=spacing, backend=arguments.backend, robot=False))
            for range_deg in RANGES_DEG:
                print(tilted_row(planned, file.stem, range_deg=range_deg), flush=True)


def tilted_row(planned: Plan, name: str, *, range_deg: float) -> str:
    """Return the row of a plan with a table of one range."""
    poses, rest = planned.poses, planned.workpiece.upright[2]
    critical = planned.workpiece.cell.critical_overhang
    laid = np.flatnonzero(poses.deposit)
    normals, runs, layers = poses.normals[laid], poses.runs[laid], poses.layers[laid]
    within = UpRange(cone(rest, np.radians(range_deg)), rest=rest, critical=critical)
    found = tilted(normals, runs=runs, within=within)
    rows = np.linspace(0, laid.size - 1, POSES).round().astype(np.int64)
    began = time.process_time()
    again = UpRange(cone(rest, np.radians(range_deg)), rest=rest, critical=critical)
    tilted(normals[rows], runs=runs[rows], within=again)
    took = time.process_time() - began
    other = gathered(normals, runs=runs, layers=layers, lengths=np.ones(laid.size), within=within)
    ups = np.tile(rest, (poses.count, 1))
    ups[laid] = found.pose_ups
    before, after = (overhang(poses, up=up, critical=critical) for up in (rest, ups))
    return row(
        name,
        str(laid.size),
        f"{range_deg:g} deg",
        f"{deposit(planned):.0f} mm",
        f"{before.length:.1f} mm ({before.share:.1%})",
        f"{after.length:.1f} mm ({after.share:.1%})",
        f"{np.degrees(found.missing.max()):.1f} deg",
        str(found.moves),
        str(len(other)),
        f"{took:.2f} s",
    )


def cone(rest: FloatArray, half_angle: float) -> Margins:
    """Return the margins of a table that brings up what is within an angle of rest: the share of it that is left."""
    return lambda ups: 1.0 - angles_between(ups, rest) / half_angle


if __name__ == "__main__":
    main()
