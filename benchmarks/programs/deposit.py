"""Does a program deposit what was planned, at which speed, and how long does it take?

    python -m benchmarks.programs.deposit [FILE ...] [--spacing MM] [--backend NAME ...] [--way NAME ...] [--csv FILE]
    python -m benchmarks.programs.deposit BODY ... --discs N or FIRST-LAST [--seed N] [...]
    python -m benchmarks.programs.deposit BUNDLE ... [--csv FILE]

Each part is planned with the default settings in the packaged cell and written, or in other ways: another cell, mode or
pattern, over a table, in layers (`WAYS`; `--way all`). `--discs` cuts discs out of bodies, in turn, about vertices and
with radii that are drawn, the same by number whatever range is asked for. What `geoprint plan` has written is taken as
it is. A program's RAPID text is read by this script alone: speeds, targets, where the valve switches and what the flow
follows (`Program`). It knows no trajectory and no joints. Each move takes its length over its speed; from a stop the
tip rises evenly to the speed of the next move, in the time that the first one takes. A valve lets the flow through that
plan.json names for the operator, half of it while the arm waits for the flow to settle; an analog output lets through
what it is worth by the cell, times the length of the moves.
What is wanted is the flow of poses.csv times the length of bead.

The columns: volume of all runs over the wanted one as plan.json says and as the text is read; the least and the most
that a run gets, likewise; the least and the most that the first two bead widths of a run get, and the last two, by a
valve and the text, of runs that are four widths long; the speed of the print and what was allowed; the share of the
length at that speed; length of bead; time on deposit over that length by speed; how far trajectory.csv is from the
moves of the text, all along from the first to the last, by kinematics of this script (`off_moves`); targets, and how
many come too soon; warnings.
"""

from __future__ import annotations

import csv
import re
import tempfile
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, product
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks import DATA
from benchmarks.parts.tables import row, script_parser, table
from geoprint import job_of, load, plan
from geoprint.config import PACKAGED_CELLS, TILTING_CELL, UR_CELL, packaged_cell_text
from geoprint.errors import GeoprintError, percent
from geoprint.geometry.files import suggested_unit
from geoprint.layers import plan_stack
from geoprint.model import FloatArray
from geoprint.reporting import PlanRecord

# Targets that are as far aside of a normal, or as high on it, but for this are alike [mm].
SAME_PLACE = 1e-3
OWN = tuple(DATA / name for name in ("plate.ply", "heart_flat_patch.ply", "heart_apex_patch.ply"))
BACKENDS = ("lscm", "heat")
# Ways to plan a part: keys of its job. "mode" is that of the cell's signals, "field" the text of a field file.
WAYS: Mapping[str, dict[str, Any]] = {
    "default": {},
    **{name: {"cell": name} for name in (*PACKAGED_CELLS[1:], TILTING_CELL, UR_CELL)},
    "analog": {"mode": "analog"},
    "follow": {"mode": "analog", "on_slowdown": "follow"},
    "spiral": {"pattern": "spiral"},
    "guided": {"pattern": "guided", "source": "angle:30"},
    "fibres": {"pattern": "fibres", "field": "[[preferences]]\nrim = true\n"},
    "layers": {"thickness": 1.0},
}
# Radii of discs that are cut out of bodies [mm].
RADII = (8.0, 30.0)
NUMBER = r"(-?[\d.]+(?:E-?\d+)?)"
SPEED = re.compile(rf"speeddata (\w+):=\[{NUMBER}")
MOVE = re.compile(r"(?:MoveL|TriggL) (?:GeoAloft\()?\[\[([^\]]*)\],\[([^\]]*)\].*?\]\)?,(\w+),(.*?)(\w+),tGeoNozzle")
WAIT = re.compile(rf"WaitTime\\InPos,{NUMBER}\*geoOn;")
SWITCH = re.compile(rf"TriggIO (\w+),{NUMBER}((?:\\Start)?)\\DOp:=doValve,(\w+);")
FLOW = re.compile(rf"TriggSpeed (\w+),0\\Start,[^,]*,\w+,{NUMBER}\*geoOn")


# Arm of the packaged cell [mm]: shoulder, upper arm, offset of the elbow, forearm, flange.
SHOULDER, UPPER_ARM, ELBOW, FOREARM, FLANGE = 290.0, 270.0, 70.0, 302.0, 72.0
FRAMES = re.compile(r"(?:tooldata tGeoNozzle|wobjdata wGeoPart):=.*")
POSE = re.compile(r"\[\[([^\[\]]*)\],\[([^\[\]]*)\]\]")
ZONE = re.compile(rf"zonedata (\w+):=\[FALSE,{NUMBER}")
ATTITUDE = re.compile(r"part-(\d+)")
# Rows of a trajectory from one that is compared with the moves to the next.
EVERY = 4
# What a trajectory may be off its moves [mm], and turned from them [degrees].
ALLOWED = (0.02, 0.2)
# Straight pieces that stand for the parabola in which the controller rounds a corner [ABBRapid, zonedata].
PIECES = 12


# Name and keys of a job.
Part: TypeAlias = tuple[str, dict[str, Any]]


class Program(NamedTuple):
    """What a RAPID text says of its moves, n of them, as they stand.

    Attributes:
        tips: (n, 3) where each ends [mm].
        turns: rotation there.
        zones: (n,) radius in which the controller rounds it [mm].
        speeds: (n,) [mm/s].
        stops: (n,) whether it ends at rest.
        switches: move, distance from its start or its end [mm], whether from its start, and whether the valve opens.
        waits: (n,) how long the arm waits behind it [s].
        flows: (n,) output on it, by the speed of the tip [1/(mm/s)]; 0 where none follows that.
        tool: place and rotation on the flange.
        part: place and rotation in the base frame.
    """

    tips: FloatArray
    turns: Rotation
    zones: FloatArray
    speeds: FloatArray
    stops: FloatArray
    switches: list[tuple[int, float, bool, bool]]
    waits: FloatArray
    flows: FloatArray
    tool: tuple[FloatArray, Rotation]
    part: tuple[FloatArray, Rotation]


class Deposited(NamedTuple):
    """Volume of each run over the wanted one, and of all of them."""

    runs: FloatArray
    whole: float


class Measured(NamedTuple):
    """What is found of a program, and what plan.json says of it.

    Attributes:
        whole: volume of all runs over the wanted one, by plan and by text.
        least: of the run that gets least, likewise.
        most: of the run that gets most, likewise.
        starts: of the first two bead widths of a run, the least and the most, by text; not a number without a valve, or
            where no run is four widths long.
        ends: of the last two, likewise.
        speed: of the print, and what was allowed [mm/s].
        at_speed: share of the length at that speed.
        bead: length [mm].
        time: on deposit, over the length of bead by the speed.
        off: largest distance of the trajectory from the moves [mm], and turn [degrees].
        targets: how many, and how many of them come too soon.
        warnings: how many.
    """

    whole: tuple[float, float]
    least: tuple[float, float]
    most: tuple[float, float]
    starts: tuple[float, float]
    ends: tuple[float, float]
    speed: tuple[float, float]
    at_speed: float
    bead: float
    time: float
    off: tuple[float, float]
    targets: tuple[int, int]
    warnings: int


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="a wide spacing, to see that the script runs")
    parser.add_argument("files", nargs="*", type=Path, default=OWN, metavar="FILE")
    parser.add_argument("--spacing", type=float, default=1.0, metavar="MM")
    parser.add_argument("--backend", nargs="+", default=BACKENDS, metavar="NAME")
    parser.add_argument("--way", nargs="+", default=["default"], choices=(*WAYS, "all"), metavar="NAME")
    parser.add_argument("--discs", type=numbers, metavar="N", help="or FIRST-LAST, cut out of the files: bodies")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the discs")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="to which the figures are added as well")
    arguments = parser.parse_args()
    files, backends, spacing = arguments.files, arguments.backend, arguments.spacing
    if arguments.smoke:
        files, backends, spacing = files[:1], backends[:1], 5.0
    bundles = [file for file in files if file.is_dir()]
    parts: Iterator[Part] = ((file.stem, {"surface": file}) for file in files if not file.is_dir())
    if arguments.discs is not None:
        parts = discs([file for file in files if not file.is_dir()], arguments.discs, seed=arguments.seed)
    ways = tuple(WAYS) if "all" in arguments.way else arguments.way
    for line in table(
        "part", "whole: plan / text", "least run", "most run", "first widths", "last widths", "mm/s (of)", "at speed",
        "mm", "time", "off moves", "targets (too soon)", "warnings",
    ):  # fmt: skip
        print(line, flush=True)
    written = ((str(own.relative_to(folder.parent)), measured(own)) for folder in bundles for own in programs(folder))
    for name, found in chain(written, cases(parts, backends=backends, ways=ways, spacing=spacing)):
        refused = isinstance(found, GeoprintError)
        print(row(name, *([f"refused: {found}"[:100], *[""] * 11] if refused else _cells(found))), flush=True)
        if arguments.csv is not None:
            with arguments.csv.open("a", encoding="utf-8", newline="") as figures:
                csv.writer(figures).writerow([name, *([str(found)] if refused else _figures(found))])


def numbers(text: str) -> range:
    """Return the numbers that FIRST-LAST names, or N, which are the first N of them, from 1."""
    first, found, last = text.partition("-")
    return range(int(first), int(last) + 1) if found else range(1, int(first) + 1)


def discs(bodies: Sequence[Path], asked: range, *, seed: int) -> Iterator[Part]:
    """Yield discs of bodies by number, from 1: about vertices that are drawn, with radii that are drawn evenly."""
    drawn = np.random.default_rng(seed)
    surfaces = {body: load(body, unit=suggested_unit(body)[0]) for body in bodies}
    for disc in range(1, asked.stop):
        body = bodies[(disc - 1) % len(bodies)]
        at = drawn.choice(surfaces[body].vertices).tolist()
        radius = round(float(drawn.uniform(*RADII)), 1)
        if disc in asked:
            yield f"{body.stem} {disc} r{radius:g}", {"surface": body, "patches": [{"at": at, "radius": radius}]}


def cases(
    parts: Iterable[Part], *, backends: Sequence[str], ways: Sequence[str], spacing: float
) -> Iterator[tuple[str, Measured | GeoprintError]]:
    """Yield name and figures of each program of each part by each way and backend, or what refuses it."""
    for (part, keys), way, backend in product(parts, ways, backends):
        name = f"{part} {backend}" if way == "default" else f"{part} {backend} {way}"
        with tempfile.TemporaryDirectory() as scratch:
            out = Path(scratch) / "out"
            try:
                _save(keys | WAYS[way] | {"spacing": spacing, "backend": backend}, out)
            except GeoprintError as error:
                yield name, error
                continue
            own = programs(out)
            for folder in own:
                yield (name if len(own) == 1 else f"{name} {folder.name}"), measured(folder)


def _save(keys: dict[str, Any], out: Path) -> None:
    """Plan a job of keys and write it, every layer where it has a thickness."""
    if (mode := keys.pop("mode", None)) is not None:
        text = packaged_cell_text(PACKAGED_CELLS[0]).replace('mode = "io"', f'mode = "{mode}"')
        for key in ('flow = "aoFlow"', "flow_per_mm3_s = 0.1", "flow_lag_s = 0.05"):
            text = text.replace(f"# {key}", key)
        keys["cell"] = out.parent / "cell.toml"
        keys["cell"].write_text(text, encoding="utf-8")
    if (field := keys.pop("field", None)) is not None:
        keys["field"] = out.parent / "field.toml"
        keys["field"].write_text(field, encoding="utf-8")
    job = job_of(unit=suggested_unit(keys["surface"])[0], place="demo", **keys)
    if job.layered:
        plan_stack(job, out)
    else:
        plan(job).save(out)


def programs(bundle: Path) -> list[Path]:
    """Return the folders of a bundle that hold a program: its own, or those of its attitudes or layers."""
    return sorted(path.parent for path in bundle.rglob("trajectory.csv"))


def measured(folder: Path) -> Measured:
    """Return what is found of the program in a folder of a bundle; of other dialects than RAPID what plan.json says."""
    # Of several attitudes the plan stands in the folder above.
    attitude = ATTITUDE.fullmatch(folder.name)
    own = folder.parent if attitude else folder
    record = PlanRecord.model_validate_json((own / "plan.json").read_text("utf-8"))
    robot = record.robot[int(attitude[1]) - 1 if attitude else 0]
    trajectory = np.loadtxt(folder / "trajectory.csv", delimiter=",", skiprows=1)
    beads = wanted(folder / "poses.csv")
    assert record.deposition is not None
    found, parts = Deposited(np.array([np.nan]), np.nan), np.full((1, 2), np.nan)
    width, off = beads.widest / record.settings.layer_height_mm, (robot.motion.off_moves_mm, robot.motion.off_moves_deg)
    if (folder / "rapid").is_dir():
        program = read_program(folder / "rapid")
        found = deposited(
            program,
            beads.volumes,
            rate=record.deposition.valve_mm3_s,
            output=output_of(own) if program.flows.any() else 1.0,
            dot=beads.widest * width,
        )
        if not program.flows.any() and (long := beads.lengths >= 4.0 * width).any():
            parts = at_ends(program, beads, rate=record.deposition.valve_mm3_s, width=width)[long]
        off = off_moves(program, trajectory)
    motion, speed, bead = robot.motion, record.settings.speed_mm_s, float(beads.lengths.sum())
    assert motion.deposited is not None
    return Measured(
        (motion.deposited.share, found.whole),
        (motion.deposited.least_run, float(found.runs.min())),
        (motion.deposited.most_run, float(found.runs.max())),
        (float(parts[:, 0].min()), float(parts[:, 0].max())),
        (float(parts[:, 1].min()), float(parts[:, 1].max())),
        (speed, motion.speed_ceiling_mm_s),
        motion.share_at_speed,
        bead,
        float(trajectory[1, 0] * trajectory[:, 7].sum()) * speed / bead,
        off,
        (robot.program.targets, motion.targets.closer),
        len(record.warnings),
    )


def _cells(found: Measured) -> Iterator[str]:
    for shares, digits in (
        (found.whole, 2), (found.least, 1), (found.most, 1), (found.starts, 1), (found.ends, 1)
    ):  # fmt: skip
        yield " / ".join(percent(share, digits) for share in shares)
    yield "{:g} ({:g})".format(*found.speed)
    yield percent(found.at_speed, 1)
    yield f"{found.bead:.0f}"
    yield f"{found.time:.3f}"
    yield "{:.4f} mm, {:.3f} deg".format(*found.off)
    yield "{} ({})".format(*found.targets)
    yield str(found.warnings)


def _figures(found: Measured) -> Iterator[float]:
    for figure in found:
        yield from figure if isinstance(figure, tuple) else (figure,)


def read_program(folder: Path) -> Program:
    """Read the moves of the runs of a program from its text alone."""
    texts = [path.read_text("latin-1") for path in sorted(folder.glob("*.mod"))]
    speeds = {name: float(value) for text in texts for name, value in SPEED.findall(text)}
    zones = {name: float(value) for text in texts for name, value in ZONE.findall(text)} | {"fine": 0.0}
    moves: list[tuple[list[float], list[float], float, float]] = []
    switches: list[tuple[int, float, bool, bool]] = []
    waiting: dict[str, tuple[float, bool, bool]] = {}
    waits: list[float] = []
    flows: list[float] = []
    flow: dict[str, float] = {}
    for line in "\n".join(texts).splitlines():
        if switch := SWITCH.search(line):
            name, distance, start, value = switch.groups()
            waiting[name] = (float(distance), bool(start), value.lower() == "geoon")
        elif change := FLOW.search(line):
            flow = {change[1]: float(change[2])}
        elif (move := MOVE.search(line)) and "geoLift" not in line:
            place, turn, speed, triggers, zone = move.groups()
            switches += [(len(moves), *each) for name, each in waiting.items() if name in triggers]
            waiting = {name: each for name, each in waiting.items() if name not in triggers}
            tip, quaternion = ([float(number) for number in part.split(",")] for part in (place, turn))
            moves.append((tip, quaternion, speeds[speed], zones[zone]))
            waits.append(0.0)
            # A trigger is pulled by the move that follows it, and the output then follows the speed until the next.
            flows.append(sum(flow.values()))
        elif wait := WAIT.search(line):
            waits[-1] = float(wait[1])
    # The tool on the flange, the fixture's frame, and the part's in it.
    tool, (place, turn), part = (
        (np.array(place.split(","), dtype=np.float64), _rotation([turn.split(",")])[0])
        for text in texts
        for line in FRAMES.findall(text)
        for place, turn in POSE.findall(line)
    )
    radii = np.array([move[3] for move in moves])
    return Program(
        np.array([move[0] for move in moves]), _rotation([move[1] for move in moves]), radii,
        np.array([move[2] for move in moves]), radii == 0.0, switches, np.array(waits),
        np.array(flows), tool,
        (place + turn.apply(part[0]), turn * part[1]),
    )  # fmt: skip


def _rotation(quaternions: Sequence[Sequence[float | str]]) -> Rotation:
    """Return the rotations of quaternions w x y z."""
    return Rotation.from_quat(np.array(quaternions, dtype=np.float64)[:, [1, 2, 3, 0]])


def off_moves(program: Program, table: FloatArray) -> tuple[float, float]:
    """Return how far the timed motion is from the moves with their zones [mm], and from their attitude [degrees].

    Attitude is compared where no corner is rounded, at the place that is nearest by tip and attitude, as shares of what
    is allowed.

    Args:
        program: as its text says.
        table: rows of trajectory.csv.
    """
    tips, turns = _tool(program, table[table[:, 8] >= 0][::EVERY, 1:7])
    lines = [_rounded(program, move) for move in range(1, len(program.tips))]
    moves, off = np.zeros(len(tips), dtype=np.int64), 0.0
    for sample, tip in enumerate(tips):
        move = int(moves[sample - 1]) if sample else 0
        away = [_distance(tip, line) for line in lines[move : move + 3]]
        moves[sample] = move + int(np.argmin(away))
        off = max(off, min(away))
    starts, steps = program.tips[moves], program.tips[moves + 1] - program.tips[moves]
    lengths = np.maximum(np.linalg.norm(steps, axis=1), 1e-9)
    along = np.einsum("ij,ij->i", tips - starts, steps) / lengths
    straight = (along > program.zones[moves]) & (along < lengths - program.zones[moves + 1])
    move, share = moves[straight], along[straight] / lengths[straight]
    begin, step = program.turns[move], (program.turns[move].inv() * program.turns[move + 1]).as_rotvec()
    # Where the tool turns nearly on the spot, the place that is meant is not quite the one nearest to the tip.
    worst, turned = np.full(len(move), np.inf), np.zeros(len(move))
    foot = starts[straight] + share[:, None] * steps[straight]
    aside = np.linalg.norm(tips[straight] - foot, axis=1)
    for shift in np.linspace(-ALLOWED[0], ALLOWED[0], 41):
        at = np.clip(share + shift / lengths[straight], 0.0, 1.0)
        turn = np.degrees(((begin * Rotation.from_rotvec(at[:, None] * step)).inv() * turns[straight]).magnitude())
        away = np.hypot(aside, (at - share) * lengths[straight])
        larger = np.maximum(away / ALLOWED[0], turn / ALLOWED[1])
        turned = np.where(larger < worst, turn, turned)
        worst = np.minimum(larger, worst)
    return off, float(turned.max(initial=0.0))


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
    return np.concatenate([_corner(program, move - 1), _corner(program, move)])


def _corner(program: Program, at: int) -> FloatArray:
    """Return the controller's path where it rounds a target, of an even number of pieces; the target where it stops."""
    tips, zone = program.tips, program.zones[at]
    if zone == 0.0 or not 0 < at < len(tips) - 1:
        return tips[at : at + 1]
    before, behind = tips[at - 1] - tips[at], tips[at + 1] - tips[at]
    entry, leave = (tips[at] + zone * each / np.linalg.norm(each) for each in (before, behind))
    share = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
    return (1.0 - share) ** 2 * entry + 2.0 * share * (1.0 - share) * tips[at] + share**2 * leave


def path_lengths(program: Program) -> FloatArray:
    """Return (n - 1,) the length of the controller's path along each move, from the middle of a corner to the next."""
    corners = [_corner(program, at) for at in range(len(program.tips))]
    halves = [corner[: len(corner) // 2 + 1] for corner in corners]
    others = [corner[len(corner) // 2 :] for corner in corners]
    return np.array(
        [
            np.linalg.norm(np.diff(np.concatenate([before, behind]), axis=0), axis=1).sum()
            for before, behind in zip(others, halves[1:], strict=False)
        ]
    )


def _distance(tip: FloatArray, line: FloatArray) -> float:
    """Return the distance of a place from a polyline [mm]."""
    along = np.diff(line, axis=0)
    squares = np.einsum("ij,ij->i", along, along)
    shares = np.einsum("ij,ij->i", tip - line[:-1], along) / np.where(squares > 0.0, squares, 1.0)
    feet = line[:-1] + np.clip(shares, 0.0, 1.0)[:, None] * along
    return float(np.linalg.norm(tip - feet, axis=1).min())


class Wanted(NamedTuple):
    """What the paths of poses.csv ask for, run by run.

    Attributes:
        lengths: of bead [mm].
        volumes: [mm3].
        ends: (r, 2, 3) where each begins and ends on the surface [mm].
        normals: (r, 2, 3) unit normals there.
        widest: the largest flow [mm3/mm].
    """

    lengths: FloatArray
    volumes: FloatArray
    ends: FloatArray
    normals: FloatArray
    widest: float


def wanted(poses: Path) -> Wanted:
    """Return what the paths ask for: on deposit the places of poses.csv are those of the bead on the surface."""
    table = np.loadtxt(poses, delimiter=",", skiprows=1)
    runs, deposit, places, normals, flow = table[:, 0], table[:, 3] > 0.0, table[:, 4:7], table[:, 11:14], table[:, 15]
    lengths: FloatArray = np.linalg.norm(np.diff(places, axis=0), axis=1)
    volumes = lengths * (flow[:-1] + flow[1:]) / 2.0
    steps = np.flatnonzero(deposit[:-1] & deposit[1:] & (np.diff(runs) == 0.0))
    own = np.cumsum(np.append(False, (np.diff(steps) > 1) | (np.diff(runs[steps]) != 0.0)))
    lengths, volumes = (np.bincount(own, each[steps]).astype(np.float64) for each in (lengths, volumes))
    begins, ends = steps[np.diff(own, prepend=-1) > 0], steps[np.diff(own, append=own[-1] + 1) > 0] + 1
    at_ends = np.stack([begins, ends], axis=1)
    return Wanted(lengths, volumes, places[at_ends], normals[at_ends], float(flow[deposit].max()))


def output_of(bundle: Path) -> float:
    """Return what the output for a flow of 1 mm3/s is, by the cell in a bundle."""
    # A stack has one cell for all its layers.
    folders = (each / "cell" for each in (bundle, bundle.parent))
    cell = next(path for each in folders for path in each.glob("*.toml"))
    return float(tomllib.loads(cell.read_text("utf-8"))["signals"]["flow_per_mm3_s"])


class _Timing(NamedTuple):
    """When the moves of a program are driven, and when its valve lets something through.

    Attributes:
        lengths: (n,) of the controller's path along each move [mm]; there is none before the first one.
        ends: (n,) when each ends, without waits [s].
        followed: (n,) what an output that follows the speed adds up to until then.
        opened: move on which each run begins to flow, and when [s].
        closed: move on which it ends, likewise.
    """

    lengths: FloatArray
    ends: FloatArray
    followed: FloatArray
    opened: list[tuple[int, float]]
    closed: list[tuple[int, float]]

    @classmethod
    def of(cls, program: Program) -> _Timing:
        """Time the moves of a program, as its text says."""
        lengths = np.append(np.inf, path_lengths(program))
        ends = np.cumsum(np.append(0.0, (lengths / program.speeds)[1:]))
        followed = np.cumsum(np.append(0.0, lengths[1:] * program.flows[1:]))
        opened, closed = (
            [
                (move, _moment(program, move, lengths[move] - off if start else off, lengths, ends))
                for move, off, start, opens in program.switches
                if opens == on
            ]
            for on in (True, False)
        )
        return cls(lengths, ends, followed, opened, closed)


def deposited(
    program: Program, volumes: FloatArray, *, rate: float, output: float = 1.0, dot: float = 0.0
) -> Deposited:
    """Return what a program deposits over what is wanted.

    Args:
        program: as its text says.
        volumes: that are wanted, run by run [mm3].
        rate: of an open valve, unless an output follows the speed [mm3/s].
        output: for 1 mm3/s, where one does.
        dot: volume that a run counts as at least, for what it gets too much spreads over that [mm3].
    """
    timing = _Timing.of(program)
    flowed = np.empty(len(timing.opened))
    for run, ((first, begun), (last, shut)) in enumerate(zip(timing.opened, timing.closed, strict=True)):
        if program.flows.any():
            # It is switched at the ends of the run itself.
            flowed[run] = (timing.followed[last] - timing.followed[first - 1]) / output
        else:
            flowed[run] = rate * (shut - begun + program.waits[first:last].sum() / 2.0)
    return Deposited(1.0 + (flowed - volumes) / np.maximum(volumes, dot), float(flowed.sum() / volumes.sum()))


def at_ends(program: Program, beads: Wanted, *, rate: float, width: float) -> FloatArray:
    """Return (r, 2) what each run gets along its first and its last two bead widths, over what is wanted there.

    A run that is shorter than four widths is looked at by halves. What a bead spreads along the path is left out.

    Args:
        program: as its text says; its valve opens and shuts.
        beads: r runs, as they are wanted.
        rate: of the open valve [mm3/s].
        width: of the bead [mm].
    """
    timing = _Timing.of(program)
    found = np.empty((len(beads.lengths), 2))
    for run, ((_, begun), (_, shut)) in enumerate(zip(timing.opened, timing.closed, strict=True)):
        first, last = (
            _target_over(program, timing, beads.ends[run, end], beads.normals[run, end], (moment, (shut - begun) / 4.0))
            for end, moment in enumerate((begun, shut))
        )
        passed = np.cumsum(timing.lengths[first + 1 : last + 1])
        looked = min(2.0 * width, passed[-1] / 2.0)
        times: list[float] = []
        for place in (looked, passed[-1] - looked):
            move = int(np.searchsorted(passed, place))
            left = float(passed[move] - place)
            times.append(_moment(program, first + 1 + move, left, timing.lengths, timing.ends))
        flowed = rate * np.array([times[0] - begun + program.waits[first] / 2.0, shut - times[1]])
        found[run] = flowed * passed[-1] / (looked * beads.volumes[run])
    return found


def _target_over(
    program: Program, timing: _Timing, place: FloatArray, normal: FloatArray, about: tuple[float, float]
) -> int:
    """Return the target over the end of a bead: the lowest on its normal, within some time about a moment [s].

    A run may begin where the one before ended, and a closed one ends where it began: the nearest in time counts.
    """
    near = np.flatnonzero(np.abs(timing.ends - about[0]) < about[1])
    heights = (program.tips[near] - place) @ normal
    aside = np.linalg.norm(program.tips[near] - place - heights[:, None] * normal, axis=1)
    near, heights = (each[aside < aside.min() + SAME_PLACE] for each in (near, heights))
    near = near[heights < heights.min() + SAME_PLACE]
    return int(near[np.abs(timing.ends[near] - about[0]).argmin()])


def _moment(program: Program, move: int, left: float, lengths: FloatArray, ends: FloatArray) -> float:
    """Return when the tip is so far before the target of a move [s]."""
    length, took, end = float(lengths[move]), float(lengths[move] / program.speeds[move]), float(ends[move])
    left = float(np.clip(left, 0.0, length))
    if program.stops[move - 1]:
        return end - took + _rise(length - left, length, took, _reached(program, move, 1))
    if program.stops[move]:
        return end - _rise(left, length, took, _reached(program, move, -1))
    return end - left / length * took


def _reached(program: Program, move: int, step: int) -> float:
    """Return the speed that is reached behind a move from rest (step 1), or left before one to rest (-1) [mm/s].

    It is that of the faster of the two moves next to it, for one alone may round a bend; where that is a ramp as well,
    or slower than the ramp in the mean, that of the print.
    """
    near = program.speeds[[move + step, min(max(move + 2 * step, 0), len(program.speeds) - 1)]]
    neighbour = move + step
    if near.max() > program.speeds[move] and not (program.stops[neighbour - 1] or program.stops[neighbour]):
        return float(near.max())
    ends = sorted(each for each, *_ in program.switches)
    return float(max(program.speeds[first : last + 1].max() for first, last in zip(ends[::2], ends[1::2], strict=True)))


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
