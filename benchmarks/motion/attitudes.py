"""What prints over a table that tilts the part?

    python -m benchmarks.motion.attitudes [--parts FILE ...] [--spacing MM] [--wrap MM] [--tables KIND ...]
                                          [--backends NAME ...] [--smoke]

The table has a row for each part, table and backend, planned with the packaged cell that has a table, or with the
default hexapod in its place: a wrap of 200 degrees around a vessel of 12 mm radius, with the vessel in the way, and any
other files in mm. Told are what overhangs at rest and over the table, by how much the worst place misses the critical
angle, attitudes, directions that were refused before others were taken, time, least clearance, and in how many
scenarios the program was executed; or why the part is refused.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import DATA
from benchmarks.parts.surfaces import triangulated, wrap
from benchmarks.parts.tables import row, script_parser, table
from geoprint import job_of, plan
from geoprint.config import TILTING_CELL, packaged_cell_text
from geoprint.errors import PlanError, percent
from geoprint.geometry.files import ply_bytes
from geoprint.metrics import overhang
from geoprint.model import Surface
from geoprint.results import Plan

APEX = DATA / "heart_apex_patch.ply"
TABLES = ("tilt-turn", "hexapod")
WRAP_DEG, VESSEL_RADIUS, WRAP_LENGTH, VESSEL_LENGTH = 200.0, 12.0, 16.0, 36.0
WRAP_FACES, VESSEL_SIDES = 1_200, 96
HEADINGS = (
    "part", "table", "backend", "deposit", "overhangs at rest", "over the table", "missing", "attitudes", "refused",
    "motion", "least clearance", "program",
)  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="only the wrap, its vessel and the cells are made: tests plan it")
    parser.add_argument("--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside the wrap")
    parser.add_argument("--spacing", type=float, default=2.0, metavar="MM", help="of these")
    parser.add_argument("--wrap", type=float, default=3.0, metavar="MM", help="spacing of the wrap")
    parser.add_argument("--tables", nargs="+", choices=TABLES, default=list(TABLES))
    parser.add_argument("--backends", nargs="+", default=["lscm", "heat"], metavar="NAME")
    arguments = parser.parse_args()
    backends: Sequence[str] = () if arguments.smoke else arguments.backends
    for line in table(*HEADINGS):
        print(line, flush=True)
    with TemporaryDirectory() as folder:
        part, body = wrapped(Path(folder))
        cells = [cell_with(kind, Path(folder)) for kind in arguments.tables]
        for cell, backend in product(cells, backends):
            print(printed_row(part, cell, body=body, spacing=arguments.wrap, backend=backend), flush=True)
            for file in arguments.parts:
                line = printed_row(file, cell, body=None, spacing=arguments.spacing, backend=backend)
                print(line, flush=True)


def cell_with(kind: str, folder: Path) -> Path:
    """Write the packaged cell that has a table with one of another kind, or without one, and return its path.

    Args:
        kind: one of `TABLES`, or nothing.
        folder: in which it is written, as `KIND.toml`.
    """
    text = packaged_cell_text(TILTING_CELL)
    if kind != "tilt-turn":
        text = re.sub(r"(?m)^(hub_length|stand_height)_mm.*\n", "", text.replace('"tilt-turn"', '"hexapod"'))
    if not kind:
        text = re.sub(r"(?ms)^\[table\]\n.*?(?=^$)", "", text)
    path = folder / f"{kind or 'none'}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def wrapped(folder: Path) -> tuple[Path, Path]:
    """Write the wrap and the vessel under it, and return their paths."""
    part, body = folder / f"wrap of {WRAP_DEG:g} degrees.ply", folder / "vessel.ply"
    around = wrap(WRAP_DEG, radius=VESSEL_RADIUS, length=WRAP_LENGTH)
    part.write_bytes(ply_bytes(triangulated(around, name=part.stem, faces=WRAP_FACES)))
    body.write_bytes(ply_bytes(vessel()))
    return part, body


def printed_row(part: Path, cell: Path, *, body: Path | None, spacing: float, backend: str) -> str:
    """Return the row of a part that is planned over a table.

    Args:
        part: file in mm.
        cell: that has the table.
        body: what the part lies on, if anything is in the way.
        spacing: of the paths [mm].
        backend: that plans them.
    """
    job = job_of(surface=part, body=body, unit="mm", spacing=spacing, backend=backend, place="demo", cell=cell)
    named = (f"{part.stem}, {spacing:g} mm", cell.stem, backend)
    try:
        planned = plan(job)
    except PlanError as error:
        return row(*named, *[""] * 8, f"refused: {error}")
    tilting, deposited = planned.tilting, deposit(planned)
    assert tilting is not None
    critical = planned.workpiece.cell.critical_overhang
    at_rest = overhang(planned.poses, up=planned.workpiece.upright[2], critical=critical)
    scenarios = 0 if planned.joined is None else len(planned.joined.proof.scenarios)
    seconds = sum(float(robot.trajectory.times[-1]) for robot in planned.robot)
    return row(
        *named, f"{deposited:.0f} mm", percent(at_rest.share, 1), f"{tilting.overhanging:.0f} mm",
        f"{np.degrees(tilting.missing):.1f} deg", str(len(planned.robot)), str(len(tilting.refused)),
        f"{seconds:.0f} s",
        f"{min(robot.clearance.smallest for robot in planned.robot):.2f} mm",
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


def deposit(planned: Plan) -> float:
    """Return the deposited length [mm]."""
    lengths = np.linalg.norm(np.diff(planned.poses.tips, axis=0), axis=1)
    return float(lengths[planned.poses.deposited].sum())


if __name__ == "__main__":
    main()
