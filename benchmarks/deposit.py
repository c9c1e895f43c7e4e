"""Does a program deposit what was planned, at which speed, and how long does it take?

    python -m benchmarks.deposit [FILE ...] [--spacing MM] [--backend NAME ...] [--pattern NAME] [--smoke]

Each part is planned with the default settings in the packaged cell, written, and its RAPID text is read by this script
alone: speeds, targets and where the valve switches (`Program`). It knows no trajectory and no joints. Each move takes
its length over its speed; from a stop the tip rises evenly to the speed of the next move, in the time that the first
one takes. The valve lets the flow through that plan.json names for the operator. What is wanted is spacing times layer
height times the length of bead, which lies the stand-off below the tip along the nozzle.

The columns: volume of all runs over the wanted one as plan.json says and as the text is read; the least and the most
that a run gets, likewise; the speed of the print and what was allowed; the share of the length at that speed; time on
deposit over length by speed; warnings.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.parts.tables import row, table
from geoprint import job_of, plan, save_plan
from geoprint.account import PlanRecord
from geoprint.errors import GeoprintError
from geoprint.model import FloatArray
from geoprint.surfaces.files import suggested_unit

DATA = Path(__file__).parents[1] / "data"
OWN = tuple(DATA / name for name in ("plate.ply", "heart_flat_patch.ply", "heart_apex_patch.ply"))
BACKENDS = ("lscm", "heat")
NUMBER = r"(-?[\d.]+(?:E-?\d+)?)"
SPEED = re.compile(rf"speeddata (\w+):=\[{NUMBER}")
MOVE = re.compile(r"(?:MoveL|TriggL) (?:GeoAloft\()?\[\[([^\]]*)\],\[([^\]]*)\].*?\]\)?,(\w+),(.*?)(\w+),tGeoNozzle")
SWITCH = re.compile(rf"TriggIO (\w+),{NUMBER}((?:\\Start)?)\\DOp:=doValve,(\w+);")


class Program(NamedTuple):
    """What a RAPID text says of its moves, n of them, as they stand.

    Attributes:
        tips: (n, 3) where each ends [mm].
        axes: (n, 3) of the nozzle there, out of it.
        speeds: (n,) [mm/s].
        stops: (n,) whether it ends at rest.
        switches: move, distance from its end or where it is negative from its start [mm], and whether the valve opens.
    """

    tips: FloatArray
    axes: FloatArray
    speeds: FloatArray
    stops: FloatArray
    switches: list[tuple[int, float, bool]]


class Deposited(NamedTuple):
    """Volume of each run over the wanted one, and of all of them."""

    runs: FloatArray
    whole: float


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, default=OWN, metavar="FILE")
    parser.add_argument("--spacing", type=float, default=1.0, metavar="MM")
    parser.add_argument("--backend", nargs="+", default=BACKENDS, metavar="NAME")
    parser.add_argument("--pattern", default="contours", metavar="NAME")
    parser.add_argument("--smoke", action="store_true", help="a wide spacing, to see that the script runs")
    arguments = parser.parse_args()
    files, backends, spacing = arguments.files, arguments.backend, arguments.spacing
    if arguments.smoke:
        files, backends, spacing = files[:1], backends[:1], 5.0
    for line in report(files, backends=backends, spacing=spacing, pattern=arguments.pattern):
        print(line, flush=True)


def report(files: Sequence[Path], *, backends: Sequence[str], spacing: float, pattern: str) -> Iterator[str]:
    """Yield the table, a line a part and backend."""
    yield from table(
        f"part, {pattern}, {spacing:g} mm", "backend", "whole: plan / text", "least run", "most run", "mm/s (of)",
        "at speed", "time", "warnings",
    )  # fmt: skip
    for file in files:
        for backend in backends:
            try:
                yield row(file.stem, backend, *_cells(file, backend=backend, spacing=spacing, pattern=pattern))
            except GeoprintError as error:
                yield row(file.stem, backend, f"refused: {error}"[:100], *[""] * 6)


def _cells(file: Path, *, backend: str, spacing: float, pattern: str) -> Iterator[str]:
    unit, _ = suggested_unit(file)
    planned = plan(job_of(surface=file, unit=unit, spacing=spacing, backend=backend, pattern=pattern, place="demo"))
    with tempfile.TemporaryDirectory() as folder:
        told = save_plan(planned, Path(folder) / "out")
        found = deposited(read_program(Path(folder) / "out" / "rapid"), told, spacing=spacing)
    motion = told.robot[0].motion
    said, speed = motion.deposited, told.settings.speed_mm_s
    assert said is not None
    yield f"{said.share:.2%} / {found.whole:.2%}"
    yield f"{said.least_run:.1%} / {found.runs.min():.1%}"
    yield f"{said.most_run:.1%} / {found.runs.max():.1%}"
    yield f"{speed:g} ({motion.speed_ceiling_mm_s:g})"
    yield f"{motion.share_at_speed:.1%}"
    poses, times = planned.robot[0].joint_path.poses, planned.robot[0].trajectory.pose_times
    laid = poses.laid
    yield f"{float(np.diff(times)[laid].sum()) * speed / float(poses.bead_lengths[laid].sum()):.3f}"
    yield str(len(told.warnings))


def read_program(folder: Path) -> Program:
    """Read the moves of the runs of a program from its text alone."""
    texts = [path.read_text("latin-1") for path in sorted(folder.glob("*.mod"))]
    speeds = {name: float(value) for text in texts for name, value in SPEED.findall(text)}
    moves: list[tuple[list[float], list[float], float, bool]] = []
    switches: list[tuple[int, float, bool]] = []
    waiting: dict[str, tuple[float, bool]] = {}
    for line in "\n".join(texts).splitlines():
        if switch := SWITCH.search(line):
            name, distance, start, value = switch.groups()
            waiting[name] = (-float(distance) if start else float(distance), value.lower() == "geoon")
        elif (move := MOVE.search(line)) and "geoLift" not in line:
            place, turn, speed, triggers, zone = move.groups()
            for name, (distance, opens) in waiting.items():
                if name in triggers:
                    switches.append((len(moves), distance, opens))
            waiting = {name: each for name, each in waiting.items() if name not in triggers}
            tip, quaternion = ([float(number) for number in part.split(",")] for part in (place, turn))
            moves.append((tip, quaternion, speeds[speed], zone == "fine"))
    w, x, y, z = np.array([move[1] for move in moves]).T
    axes = np.column_stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)])
    return Program(
        np.array([move[0] for move in moves]), axes, np.array([move[2] for move in moves]),
        np.array([move[3] for move in moves]), switches,
    )  # fmt: skip


def deposited(program: Program, told: PlanRecord, *, spacing: float) -> Deposited:
    """Return what a program deposits over what is wanted.

    Args:
        program: as its text says.
        told: the flow that the operator sets, layer and stand-off.
        spacing: [mm].
    """
    assert told.deposition is not None
    rate, (layer,) = told.deposition.valve_mm3_s, told.layers
    lengths = np.append(np.inf, np.linalg.norm(np.diff(program.tips, axis=0), axis=1))
    ends = np.cumsum(np.append(0.0, (lengths / program.speeds)[1:]))
    below = program.tips + layer.standoff_mm * program.axes
    passed = np.cumsum(np.append(0.0, np.linalg.norm(np.diff(below, axis=0), axis=1)))
    opened, closed = (
        [(move, _moment(program, move, off, lengths, ends)) for move, off, opens in program.switches if opens == on]
        for on in (True, False)
    )
    stops = np.flatnonzero(program.stops)
    flowed, spans = np.empty(len(opened)), np.empty((len(opened), 2), dtype=np.int64)
    for run, ((first, begun), (last, shut)) in enumerate(zip(opened, closed, strict=True)):
        flowed[run] = rate * (shut - begun)
        spans[run] = stops[np.searchsorted(stops, first) - 1], stops[np.searchsorted(stops, last)]
    beads = np.diff(passed[spans], axis=1)[:, 0]
    wanted = spacing * told.settings.layer_height_mm * beads
    return Deposited(flowed / wanted, float(flowed.sum() / wanted.sum()))


def _moment(program: Program, move: int, distance: float, lengths: FloatArray, ends: FloatArray) -> float:
    """Return when the tip is where the valve switches, on the move to a target [s]."""
    length, took, end = float(lengths[move]), float(lengths[move] / program.speeds[move]), float(ends[move])
    left = distance if distance >= 0.0 else max(length + distance, 0.0)
    if program.stops[move - 1]:
        return end - took + _rise(length - left, length, took, float(program.speeds[move + 1]))
    if program.stops[move]:
        return end - _rise(left, length, took, float(program.speeds[move - 1]))
    return end - left / length * took


def _rise(place: float, length: float, took: float, speed: float) -> float:
    """Return when a tip that rises evenly from rest to a speed, and then keeps it, is at a place of a move [s]."""
    lost = took - length / speed
    if lost <= 0.0:
        return place / length * took
    ramp = 2.0 * lost
    if ramp * speed / 2.0 > length:
        # It is still rising at the end of the move.
        return took * (place / length) ** 0.5
    return (2.0 * place * ramp / speed) ** 0.5 if place < ramp * speed / 2.0 else place / speed + lost


if __name__ == "__main__":
    main()
