"""Does a program deposit what was planned, at which speed, and how long does it take?

    python -m benchmarks.deposit [FILE ...] [--spacing MM] [--backend NAME ...] [--pattern NAME] [--smoke]

Each part is planned with the default settings in the packaged cell, written, and its RAPID text is read by this script
alone: speeds, targets and where the valve switches (`Program`). It knows no trajectory and no joints. Each move takes
its length over its speed; from a stop the tip rises evenly to the speed of the next move, in the time that the first
one takes. The valve lets the flow through that plan.json names for the operator, half of it while the arm waits for
the flow to settle. What is wanted is spacing times layer height times the length of bead, which lies the stand-off
below the tip along the nozzle.

The columns: volume of all runs over the wanted one as plan.json says and as the text is read; the least and the most
that a run gets, likewise; the speed of the print and what was allowed; the share of the length at that speed; time on
deposit over length by speed; how far trajectory.csv is from the moves of the text, all along from the first to the
last, by kinematics of this script (`off_moves`); warnings.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

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
WAIT = re.compile(rf"WaitTime\\InPos,{NUMBER}\*geoOn;")
SWITCH = re.compile(rf"TriggIO (\w+),{NUMBER}((?:\\Start)?)\\DOp:=doValve,(\w+);")


# Arm of the packaged cell [mm]: shoulder, upper arm, offset of the elbow, forearm, flange.
SHOULDER, UPPER_ARM, ELBOW, FOREARM, FLANGE = 290.0, 270.0, 70.0, 302.0, 72.0
FRAME = re.compile(r"(?:tooldata tGeoNozzle:=\[TRUE,|wobjdata wGeoPart:=\[FALSE,TRUE,\"\",)\[\[([^\]]*)\],\[([^\]]*)\]")
ZONE = re.compile(rf"zonedata (\w+):=\[FALSE,{NUMBER}")
# Straight pieces that stand for the parabola in which the controller rounds a corner [ABBRapid, zonedata].
PIECES = 12


class Program(NamedTuple):
    """What a RAPID text says of its moves, n of them, as they stand.

    Attributes:
        tips: (n, 3) where each ends [mm].
        turns: rotation there.
        zones: (n,) radius in which the controller rounds it [mm].
        speeds: (n,) [mm/s].
        stops: (n,) whether it ends at rest.
        switches: move, distance from its end or where it is negative from its start [mm], and whether the valve opens.
        waits: (n,) how long the arm waits behind it [s].
        tool: place and rotation on the flange.
        part: place and rotation in the base frame.
    """

    tips: FloatArray
    turns: Rotation
    zones: FloatArray
    speeds: FloatArray
    stops: FloatArray
    switches: list[tuple[int, float, bool]]
    waits: FloatArray
    tool: tuple[FloatArray, Rotation]
    part: tuple[FloatArray, Rotation]


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
        "at speed", "time", "off moves", "warnings",
    )  # fmt: skip
    for file in files:
        for backend in backends:
            try:
                yield row(file.stem, backend, *_cells(file, backend=backend, spacing=spacing, pattern=pattern))
            except GeoprintError as error:
                yield row(file.stem, backend, f"refused: {error}"[:100], *[""] * 7)


def _cells(file: Path, *, backend: str, spacing: float, pattern: str) -> Iterator[str]:
    unit, _ = suggested_unit(file)
    planned = plan(job_of(surface=file, unit=unit, spacing=spacing, backend=backend, pattern=pattern, place="demo"))
    with tempfile.TemporaryDirectory() as folder:
        told = save_plan(planned, Path(folder) / "out")
        program = read_program(Path(folder) / "out" / "rapid")
        found = deposited(program, told, spacing=spacing)
        off, turned = off_moves(program, Path(folder) / "out" / "trajectory.csv")
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
    yield f"{off:.4f} mm, {turned:.3f} deg"
    yield str(len(told.warnings))


def read_program(folder: Path) -> Program:
    """Read the moves of the runs of a program from its text alone."""
    texts = [path.read_text("latin-1") for path in sorted(folder.glob("*.mod"))]
    speeds = {name: float(value) for text in texts for name, value in SPEED.findall(text)}
    zones = {name: float(value) for text in texts for name, value in ZONE.findall(text)} | {"fine": 0.0}
    moves: list[tuple[list[float], list[float], float, float]] = []
    switches: list[tuple[int, float, bool]] = []
    waiting: dict[str, tuple[float, bool]] = {}
    waits: list[float] = []
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
            moves.append((tip, quaternion, speeds[speed], zones[zone]))
            waits.append(0.0)
        elif wait := WAIT.search(line):
            waits[-1] = float(wait[1])
    frames = [
        (np.array(place.split(","), dtype=np.float64), _rotation([turn.split(",")])[0])
        for text in texts
        for place, turn in FRAME.findall(text)
    ]
    radii = np.array([move[3] for move in moves])
    return Program(
        np.array([move[0] for move in moves]), _rotation([move[1] for move in moves]), radii,
        np.array([move[2] for move in moves]), radii == 0.0, switches, np.array(waits), frames[0],
        frames[1],
    )  # fmt: skip


def _rotation(quaternions: Sequence[Sequence[float | str]]) -> Rotation:
    """Return the rotations of quaternions w x y z."""
    return Rotation.from_quat(np.array(quaternions, dtype=np.float64)[:, [1, 2, 3, 0]])


def off_moves(program: Program, trajectory: Path) -> tuple[float, float]:
    """Return how far the timed motion is from the moves with their zones [mm], and from their attitude [degrees].

    Attitude is compared where no corner is rounded.
    """
    table = np.loadtxt(trajectory, delimiter=",", skiprows=1)
    tips, turns = _tool(program, table[table[:, 8] >= 0, 1:7])
    lines = [_rounded(program, move) for move in range(1, len(program.tips))]
    move, off, turned = 0, 0.0, 0.0
    for tip, turn in zip(tips, turns, strict=True):
        near = range(move, min(move + 3, len(lines)))
        away = [_distance(tip, lines[each]) for each in near]
        move += int(np.argmin(away))
        off = max(off, min(away))
        start, end = program.tips[move], program.tips[move + 1]
        length = float(np.linalg.norm(end - start))
        along = float((tip - start) @ (end - start)) / max(length, 1e-9)
        if program.zones[move] < along < length - program.zones[move + 1]:
            whole = program.turns[move].inv() * program.turns[move + 1]
            meant = program.turns[move] * Rotation.from_rotvec(along / length * whole.as_rotvec())
            turned = max(turned, float(np.degrees((meant.inv() * turn).magnitude())))
    return off, turned


def _tool(program: Program, joints: FloatArray) -> tuple[FloatArray, Rotation]:
    """Return the tips (n, 3) and rotations of the tool on the part for (n, 6) joints [rad]."""
    turn, place = Rotation.identity(len(joints)), np.zeros((len(joints), 3))
    for joint, (axis, step) in enumerate(
        [("z", (0, 0, SHOULDER)), ("y", (0, 0, UPPER_ARM)), ("y", (0, 0, ELBOW)), ("x", (FOREARM, 0, 0)),
         ("y", (0, 0, 0)), ("x", (FLANGE, 0, 0))]
    ):  # fmt: skip
        turn *= Rotation.from_euler(axis, joints[:, [joint]])
        place += turn.apply(np.array(step, dtype=np.float64))
    turn *= Rotation.from_euler("y", np.pi / 2.0)
    place += turn.apply(program.tool[0])
    return program.part[1].inv().apply(place - program.part[0]), program.part[1].inv() * turn * program.tool[1]


def _rounded(program: Program, move: int) -> FloatArray:
    """Return the controller's path from about the target before a move to about its end, both corners whole."""
    tips, zones = program.tips, program.zones

    def corner(at: int) -> FloatArray:
        if zones[at] == 0.0 or not 0 < at < len(tips) - 1:
            return tips[at : at + 1]
        before, behind = tips[at - 1] - tips[at], tips[at + 1] - tips[at]
        entry, leave = (tips[at] + zones[at] * each / np.linalg.norm(each) for each in (before, behind))
        share = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
        return (1.0 - share) ** 2 * entry + 2.0 * share * (1.0 - share) * tips[at] + share**2 * leave

    return np.concatenate([corner(move - 1), corner(move)])


def _distance(tip: FloatArray, line: FloatArray) -> float:
    """Return the distance of a place from a polyline [mm]."""
    along = np.diff(line, axis=0)
    squares = np.einsum("ij,ij->i", along, along)
    shares = np.einsum("ij,ij->i", tip - line[:-1], along) / np.where(squares > 0.0, squares, 1.0)
    feet = line[:-1] + np.clip(shares, 0.0, 1.0)[:, None] * along
    return float(np.linalg.norm(tip - feet, axis=1).min())


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
    below = program.tips + layer.standoff_mm * program.turns.apply([0.0, 0.0, 1.0])
    passed = np.cumsum(np.append(0.0, np.linalg.norm(np.diff(below, axis=0), axis=1)))
    opened, closed = (
        [(move, _moment(program, move, off, lengths, ends)) for move, off, opens in program.switches if opens == on]
        for on in (True, False)
    )
    stops = np.flatnonzero(program.stops)
    flowed, spans = np.empty(len(opened)), np.empty((len(opened), 2), dtype=np.int64)
    for run, ((first, begun), (last, shut)) in enumerate(zip(opened, closed, strict=True)):
        flowed[run] = rate * (shut - begun + program.waits[first:last].sum() / 2.0)
        begin = first if program.waits[first] > 0.0 else stops[np.searchsorted(stops, first) - 1]
        spans[run] = begin, stops[np.searchsorted(stops, last)]
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
