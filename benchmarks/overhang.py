"""What overhangs without a table that tilts, and with one, and how often does that move?

    python -m benchmarks.overhang [--parts FILE ...] [--spacing MM] [--backend NAME] [--wrap MM ...] [--smoke]

A row for each part and range: a cap of half-angle 85 degrees, and any other files in mm. A table brings up what lies
within its range of what is up at rest: 30 degrees are like a hexapod, 90 like a tilt-turn table. Told are the deposited
length that overhangs by more than the critical angle at rest and with the table, by how much the worst place misses the
critical angle whatever the table does, its moves in the given order and with pieces of runs gathered by attitude, and
the processor time of the choice for 50 000 poses: those of the deposit, each as often as needed.

With --wrap a second table has a row for each spacing at which a wrap of 200 degrees around a vessel of 12 mm radius is
planned over the tilt-turn table of the packaged cell, with the vessel in the way: attitudes, time, least clearance, and
in how many scenarios the program was executed; or why it is refused.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.parts.surfaces import cap, triangulated, wrap
from benchmarks.parts.tables import row, table
from geoprint import job_of, plan
from geoprint.config import TILTING_CELL, packaged_cell_text
from geoprint.errors import PlanError
from geoprint.model import FloatArray, Surface
from geoprint.motion.tilting import Margins, UpRange, gathered, tilted
from geoprint.quality import overhang
from geoprint.results import Plan
from geoprint.surfaces.files import ply_bytes
from geoprint.transforms import angles_between

RANGES_DEG = (30.0, 90.0)
CAP_ANGLE_DEG, CAP_FACES, SMOKE_FACES = 85.0, 12_000, 2_000
POSES = 50_000
WRAP_DEG, VESSEL_RADIUS, WRAP_LENGTH, VESSEL_LENGTH = 200.0, 12.0, 16.0, 36.0
WRAP_FACES, VESSEL_SIDES = 1_200, 96
WRAP_HEADINGS = ("wrap of 200 degrees", "deposit", "attitudes", "motion", "least clearance", "program")
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
    parser.add_argument("--wrap", type=float, nargs="*", default=[], metavar="MM", help="spacings of the wrap")
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
        if arguments.wrap:
            print()
            for line in table(*WRAP_HEADINGS):
                print(line, flush=True)
        for wanted in arguments.wrap:
            print(wrap_row(Path(folder), spacing=wanted, backend=arguments.backend), flush=True)


def tilted_row(planned: Plan, name: str, *, range_deg: float) -> str:
    """Return the row of a plan with a table of one range."""
    poses, rest = planned.poses, planned.workpiece.upright[2]
    critical = planned.workpiece.cell.process.overhang
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
        f"{poses_length(planned):.0f} mm",
        f"{before.length:.1f} mm ({before.share:.1%})",
        f"{after.length:.1f} mm ({after.share:.1%})",
        f"{np.degrees(found.missing.max()):.1f} deg",
        str(found.moves),
        str(len(other)),
        f"{took:.2f} s",
    )


def wrap_row(folder: Path, *, spacing: float, backend: str) -> str:
    """Return the row of a wrap around a vessel, planned with the packaged cell that has a table.

    Args:
        folder: in which its files are written.
        spacing: of the paths [mm].
        backend: that plans them.
    """
    part, body, cell = (folder / name for name in ("wrap.ply", "vessel.ply", "cell.toml"))
    around = wrap(WRAP_DEG, radius=VESSEL_RADIUS, length=WRAP_LENGTH)
    part.write_bytes(ply_bytes(triangulated(around, name=part.stem, faces=WRAP_FACES)))
    body.write_bytes(ply_bytes(vessel()))
    cell.write_text(packaged_cell_text(TILTING_CELL), encoding="utf-8")
    job = job_of(surface=part, body=body, unit="mm", spacing=spacing, backend=backend, place="demo", cell=cell)
    named = f"{spacing:g} mm apart"
    try:
        planned = plan(job)
    except PlanError as error:
        return row(named, "", "", "", "", f"refused: {error}")
    seconds = sum(float(robot.trajectory.times[-1]) for robot in planned.robot)
    least = min(robot.clearance.smallest for robot in planned.robot)
    scenarios = 0 if planned.joined is None else len(planned.joined.proof.scenarios)
    return row(
        named, f"{poses_length(planned):.0f} mm", str(len(planned.robot)), f"{seconds:.0f} s", f"{least:.2f} mm",
        f"verified, executed in {scenarios} scenarios",
    )  # fmt: skip


def vessel() -> Surface:
    """Return the vessel under the wrap: a closed cylinder along the x axis, longer on both sides."""
    sides, more = VESSEL_SIDES, (VESSEL_LENGTH - WRAP_LENGTH) / 2
    turns = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    around = VESSEL_RADIUS * np.column_stack([np.cos(turns), np.sin(turns)])
    ends = [
        np.column_stack([np.full(sides + 1, x), np.vstack([around, [0.0, 0.0]])]) for x in (-more, WRAP_LENGTH + more)
    ]
    one, following, apex = np.arange(sides), np.roll(np.arange(sides), -1), np.full(sides, sides)
    low = [np.column_stack([one, apex, following]), np.column_stack([one, following, following + sides + 1])]
    high = [
        np.column_stack([one, following, apex]) + sides + 1,
        np.column_stack([one, following + sides + 1, one + sides + 1]),
    ]
    return Surface(np.vstack(ends), np.vstack([*low, *high]), name="vessel")


def poses_length(planned: Plan) -> float:
    """Return the deposited length [mm]."""
    lengths = np.linalg.norm(np.diff(planned.poses.tips, axis=0), axis=1)
    return float(lengths[planned.poses.laid].sum())


def cone(rest: FloatArray, half_angle: float) -> Margins:
    """Return the margins of a table that brings up what is within an angle of rest: the share of it that is left."""
    return lambda ups: 1.0 - angles_between(ups, rest) / half_angle


if __name__ == "__main__":
    main()
