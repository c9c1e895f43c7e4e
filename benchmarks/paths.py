"""How even are the paths of other planners, and what the measure costs? Prints a Markdown table.

    python -m benchmarks.paths [--parts FILE ...] [--spacing MM] [--smoke]

On a dome: contours of ours, the same with every second one shifted aside by a tenth of the spacing, and what a planar
slicer makes of it (`benchmarks.parts.slicer`), by its G-code. On each part: contours of ours, and isolines of
potpourri3d's heat distance (`pip install potpourri3d`; left out where it is missing). All of them are judged by
`geoprint.measure_paths` (what the columns mean stands in `geoprint.account.metrics`); beside it, for ours, the spacing
from level to level, which `compare` finds and which needs levels, and what measuring costs in processor time per metre
of path.
"""

from __future__ import annotations

import argparse
import importlib.util
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.parts.slicer import dome_gcode
from benchmarks.parts.streams import deposited
from benchmarks.parts.surfaces import cap, triangulated
from benchmarks.peers import METHODS
from geoprint import job_of, measure_paths, plan, read_paths
from geoprint.account.metrics import COVERED_ONCE, FOLLOWING, GAP, HOLE, LEVELS, OVERLAP, THICKNESS
from geoprint.errors import GeoprintError
from geoprint.model import FloatArray, Polylines, Surface
from geoprint.quality import Uniformity
from geoprint.surfaces.files import save_ply
from geoprint.surfaces.remesh import refine

DATA = Path(__file__).parents[1] / "data"
RADIUS, OPENING = 30.0, 1.0
FACES, SMOKE_FACES = 20_000, 2_000
# Every second contour is shifted by this share of the spacing.
SHIFT = 0.1
PEER = "potpourri3d heat"
# Behind a row that has no figures.
BLANK = " |" * 11


class Timed(NamedTuple):
    """A measurement, and the processor time that it took [s]."""

    found: Uniformity
    seconds: float


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", type=Path, default=[DATA / "heart_apex_patch.ply"], metavar="FILE")
    parser.add_argument("--spacing", type=float, default=1.0)
    parser.add_argument("--smoke", action="store_true", help="a coarse dome alone, to see that the script runs")
    arguments = parser.parse_args()
    spacing = 4.0 if arguments.smoke else arguments.spacing
    for line in table([] if arguments.smoke else arguments.parts, spacing=spacing, smoke=arguments.smoke):
        print(line, flush=True)


def table(parts: list[Path], *, spacing: float, smoke: bool) -> Iterator[str]:
    """Return the heading and a row for each set of paths."""
    told = " | ".join(metric.column for metric in (THICKNESS, FOLLOWING, COVERED_ONCE, GAP, OVERLAP, HOLE))
    yield f"| part | paths | {told} | left CV | right CV | {LEVELS.column} | CPU s/m |"
    yield "|" + "---|" * 12
    shape = cap(float(np.degrees(OPENING)), depth=RADIUS * OPENING)
    dome = triangulated(shape, name="dome", faces=SMOKE_FACES if smoke else FACES)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "dome.ply"
        save_ply(dome, file)
        yield from _ours(file, "dome", spacing)
        yield _row("dome", "every second circle shifted by 10 %", _measured(dome, circles(spacing, SHIFT), spacing))
        sliced = Path(folder) / "dome.gcode"
        sliced.write_text(dome_gcode(radius=RADIUS, opening=OPENING, layer=0.6 * spacing), encoding="utf-8")
        top = np.array([0.0, 0.0, dome.vertices[:, 2].max() - RADIUS])
        read = read_paths(sliced).curves
        yield _row("dome", "planar slices", _measured(dome, Polylines(read.points + top, read.offsets), spacing))
    for part in parts:
        yield from _ours(part, part.stem, spacing)


def circles(spacing: float, shift: float) -> Polylines:
    """Return circles about the dome's pole, every second one shifted towards it by a share of the spacing."""
    turns = np.append(np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False), 0.0)
    lines: list[FloatArray] = []
    for k in range(int(0.8 * RADIUS * OPENING / spacing)):
        polar = OPENING - (0.5 + k + shift * (k % 2)) * spacing / RADIUS
        flat = np.sin(polar) * np.column_stack([np.cos(turns), np.sin(turns)])
        lines.append(RADIUS * np.column_stack([flat, np.full(turns.size, np.cos(polar))]))
    return Polylines(np.concatenate(lines), np.cumsum([0, *map(len, lines)]))


def _ours(part: Path, name: str, spacing: float) -> Iterator[str]:
    """Return rows of our contours on a part, and of the peer's isolines on the same surface where it is there."""
    asked = job_of(surface=part, unit="mm", spacing=spacing, backend="fast-marching", robot=False)
    planned = plan(asked)
    curves, part_surface = deposited(planned.poses), planned.workpiece.part
    found = planned.uniformity
    assert found is not None
    assert found.levels is not None
    # What has to be compiled was compiled by the plan.
    yield _row(
        name,
        "contours, fast-marching",
        _measured(part_surface, curves, spacing),
        levels=f"{found.levels.figures.cv:.3%}",
    )
    if importlib.util.find_spec(METHODS[PEER].library) is None:
        yield f"| {name} | {PEER}: not installed and left out{BLANK}"
        return
    fine = refine(part_surface, edge_length=0.5 * spacing)
    lines, _ = METHODS[PEER].isolines(fine, spacing)
    lines = [line for line in lines if len(line) > 1]
    peer = Polylines(np.concatenate(lines), np.cumsum([0, *map(len, lines)]))
    yield _row(name, f"isolines of {PEER}", _measured(part_surface, peer, spacing))


def _measured(surface: Surface, curves: Polylines, spacing: float) -> Timed | GeoprintError:
    begun = time.process_time()
    try:
        found = measure_paths(surface, curves, spacing=spacing, offset_up_to=0.2 * spacing)
    except GeoprintError as error:
        return error
    return Timed(found, time.process_time() - begun)


def _row(part: str, paths: str, timed: Timed | GeoprintError, *, levels: str = "-") -> str:
    if isinstance(timed, GeoprintError):
        return f"| {part} | {paths}: not measured: {timed}{BLANK}"
    found, sides = timed.found, timed.found.sides
    return (
        f"| {part} | {paths} | {found.thickness.cv:.2%} | {found.followed.cv:.2%} | {found.covered_once:.2%} "
        f"| {found.gap:.2%} | {found.overlap:.2%} | {found.hole:.2f} | {sides.left.cv:.3%} | {sides.right.cv:.3%} "
        f"| {levels} | {timed.seconds / (found.length / 1000.0):.1f} |"
    )


if __name__ == "__main__":
    main()
