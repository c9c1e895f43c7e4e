"""Do G-code programs lead where LinuxCNC's interpreter leads them? Prints what differs.

    python -m benchmarks.programs.linuxcnc [--interpreter rs274] [--programs 300] [--seed 0] [--keep FOLDER] [--smoke]

`rs274` is LinuxCNC's interpreter (Debian's linuxcnc-uspace), which runs by itself. Random programs of all modes and
offsets that both know, words in any order, are read by `geoprint.read_paths` and by it; vertices of what deposits (G1,
G2, G3) must agree to 0.003 mm, as it prints four decimals. Programs that it refuses are made anew. Those that geoprint
refuses are counted, with the reason.
"""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.parts.tables import script_parser
from geoprint.errors import GeoprintError
from geoprint.model import FloatArray
from geoprint.toolpath_files import read_paths

# Farthest that vertices may lie apart [mm]; more where four decimals of an inch are added from a place and two offsets.
TOLERANCE, IN_INCHES = 0.003, 0.01
# How far chords of an arc lie from it, at most [mm].
SAGITTA = 0.0005
# Points of a run that are judged.
MOST_JUDGED = 400
_CALL = re.compile(r"N[\d.]+\s+(\w+)\((.*)\)")
_PLANES = {"CANON_PLANE_XY": (0, 1, 2), "CANON_PLANE_XZ": (2, 0, 1), "CANON_PLANE_YZ": (1, 2, 0)}
_LETTERS = {"G17": "XYIJZ", "G18": "ZXKIY", "G19": "YZJKX"}


class Writer:
    """Writes a random program; places are never known to it but where it has just said them."""

    def __init__(self, generator: np.random.Generator) -> None:
        self._random = generator
        self._plane = "G17"
        self._centres = "G91.1"
        self.lines: list[str] = []

    def program(self, blocks: int) -> str:
        """Return a program of some blocks."""
        random = self._random
        self.block("G21", "G90", "G17")
        if random.random() < 0.7:
            for system in range(1, 10):
                self.block("G10", "L2", f"P{system}", *self._words("XYZ", 20.0))
        self.block("G0", *self._words("XYZ", 50.0))
        steps = (self._straight, self._straight, self._straight, self._arc, self._arc, self._offset, self._mode)
        for _ in range(blocks):
            steps[int(random.integers(len(steps)))]()
        return "\n".join([*self.lines, "M2", ""])

    def block(self, *words: str) -> None:
        """Write a block: its words in any order and form."""
        random = self._random
        order: list[int] = random.permutation(len(words)).tolist()
        mixed = [words[i] for i in order]
        gap = ("", " ", " ", "  ")[int(random.integers(4))]
        text = gap.join(mixed)
        if random.random() < 0.2:
            text = text.lower()
        if random.random() < 0.2:
            text = f"N{len(self.lines) * 10} {text}"
        if random.random() < 0.1:
            text = f"{text} (as X9 Y9) ; or G0"
        if random.random() < 0.05:
            text = f"/{text}"
        self.lines.append(text)

    def _number(self, size: float) -> str:
        return f"{self._random.uniform(-size, size):.{int(self._random.integers(0, 4))}f}"

    def _words(self, axes: str, size: float) -> list[str]:
        return [f"{axis}{self._number(size)}" for axis in axes]

    def _some(self, size: float) -> list[str]:
        chosen = [axis for axis in "XYZ" if self._random.random() < 0.6] or ["X"]
        return self._words("".join(chosen), size)

    def _straight(self) -> None:
        codes = ["G1", "G1", "G1", "G0"][int(self._random.integers(4))]
        modes = [str(self._random.choice(["G90", "G91"]))] if self._random.random() < 0.3 else []
        self.block(codes, "F500", *modes, *self._some(40.0))
        if self._random.random() < 0.4:
            self.lines.append(" ".join(self._some(40.0)))

    def _arc(self) -> None:
        random = self._random
        if random.random() < 0.4:
            self._plane = str(random.choice(["G17", "G18", "G19"]))
        first, second, i, j, third = _LETTERS[self._plane]
        radius = float(random.uniform(2.0, 20.0))
        start, angle = random.uniform(0.0, 6.28), random.uniform(0.3, 6.0)
        clockwise = random.random() < 0.5
        arm = radius * np.array([np.cos(start), np.sin(start)])
        turn = -angle if clockwise else angle
        far = radius * np.array([np.cos(start + turn), np.sin(start + turn)])
        code, (di, dj), (dx, dy) = "G2" if clockwise else "G3", -arm, far - arm
        extra = [f"{third}{self._number(10.0)}"] if random.random() < 0.4 else []
        absolute = random.random() < 0.5
        x, y = random.uniform(-30.0, 30.0, 2) if absolute else (0.0, 0.0)
        if absolute:
            self.block("G90", "G0", self._plane, f"{first}{x:.4f}", f"{second}{y:.4f}")
        mode = "G90" if absolute else "G91"
        ends = [f"{first}{x + dx:.4f}", f"{second}{y + dy:.4f}"]
        if random.random() < 0.3:
            longer = "-" if angle > np.pi else ""
            self.block(code, mode, self._plane, "F500", *ends, f"R{longer}{radius:.4f}", *extra)
            return
        if absolute and random.random() < 0.4:
            self.block(code, mode, "G90.1", self._plane, "F500", *ends, f"{i}{x + di:.4f}", f"{j}{y + dj:.4f}", *extra)
            self.block("G91.1")
            return
        turns = [f"P{int(random.integers(1, 4))}"] if random.random() < 0.3 else []
        ends = [] if random.random() < 0.2 else ends
        self.block(code, mode, self._plane, "F500", *ends, f"{i}{di:.4f}", f"{j}{dj:.4f}", *extra, *turns)

    def _offset(self) -> None:
        random = self._random
        match int(random.integers(8)):
            case 0:
                self.block("G92", *self._some(30.0))
            case 1:
                self.block(str(random.choice(["G92.1", "G92.2", "G92.3"])))
            case 2:
                self.block("G52", *self._some(20.0))
            case 3:
                self.block("G10", "L2", f"P{int(random.integers(0, 10))}", *self._some(20.0))
            case 4:
                self.block("G10", "L20", f"P{int(random.integers(0, 10))}", *self._some(20.0))
            case 5:
                self.block("G90", "G53", "G0", *self._some(30.0))
            case 6:
                self.block(str(random.choice(["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"])))
            case _:
                self.block(str(random.choice(["G28.1", "G30.1", "G28", "G30"])))
                self.block("G90", "G0", *self._words("XYZ", 40.0))

    def _mode(self) -> None:
        self.block(str(self._random.choice(["G20", "G21", "G21", "G90", "G91", "G17", "G40 G49", "G61", "G80"])))


def judged(interpreter: str, program: Path) -> list[FloatArray] | None:
    """Return the runs that LinuxCNC makes of a program [mm], arcs as chords; None where it refuses it."""
    folder = program.parent
    for name, text in (("judge.tbl", ""), ("judge.var", "5220 1\n")):
        (folder / name).write_text(text, encoding="utf-8")
    done = subprocess.run(  # noqa: S603
        [interpreter, "-g", "-t", str(folder / "judge.tbl"), "-v", str(folder / "judge.var"), str(program)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    if "PROGRAM_END" not in done.stdout:
        return None
    return _runs(_CALL.findall(done.stdout))


def _runs(calls: list[tuple[str, str]]) -> list[FloatArray]:
    """Return the runs of what the interpreter prints."""
    scale, plane = 1.0, (0, 1, 2)
    away = {"SET_G5X_OFFSET": np.zeros(3), "SET_G92_OFFSET": np.zeros(3)}
    here = np.full(3, np.nan)
    runs: list[list[FloatArray]] = [[]]
    for call, said in calls:
        cells = [cell.strip() for cell in said.split(",")]
        if call == "USE_LENGTH_UNITS":
            scale = 25.4 if "INCH" in said else 1.0
        elif call in away:
            away[call] = scale * np.array([float(cell) for cell in cells[-6:-3]])
        elif call == "SELECT_PLANE":
            plane = _PLANES[cells[0]]
        elif call in {"STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "ARC_FEED"}:
            shift = away["SET_G5X_OFFSET"] + away["SET_G92_OFFSET"]
            numbers = [float(cell) for cell in cells[:6]]
            points = [here, scale * np.array(numbers[:3]) + shift]
            if call == "ARC_FEED":
                points = _arc(here, numbers, plane, scale=scale, away=shift)
            moved = call == "ARC_FEED" or not np.allclose(here, points[-1], rtol=0.0, atol=3e-4)
            if call == "STRAIGHT_TRAVERSE":
                runs += [[]] if moved else []
            elif moved:
                runs[-1] += points[1:] if runs[-1] else points
            here = points[-1]
    return [np.array(run) for run in runs if run]


def _arc(
    here: FloatArray, said: list[float], plane: tuple[int, int, int], *, scale: float, away: FloatArray
) -> list[FloatArray]:
    """Return points of an ARC_FEED: first and second end, first and second of the centre, turns, end of the third."""
    first, second, third = plane
    end, centre = here.copy(), here.copy()
    for place, axis, value in (
        (end, first, 0),
        (end, second, 1),
        (centre, first, 2),
        (centre, second, 3),
        (end, third, 5),
    ):
        place[axis] = scale * said[value] + away[axis]
    turns = int(said[4])
    angles = [np.arctan2(place[second] - centre[second], place[first] - centre[first]) for place in (here, end)]
    turn = (angles[1] - angles[0]) % (2.0 * np.pi) if turns > 0 else -((angles[0] - angles[1]) % (2.0 * np.pi))
    # Ends that are alike but for how they are printed make a full turn.
    if float(np.hypot(*(end - here)[[first, second]])) < TOLERANCE:
        turn = np.sign(turns) * 2.0 * np.pi
    turn += np.sign(turns) * 2.0 * np.pi * (abs(turns) - 1)
    radii = [np.hypot(place[first] - centre[first], place[second] - centre[second]) for place in (here, end)]
    points: list[FloatArray] = []
    step = min(np.radians(1.0), np.sqrt(8.0 * SAGITTA / radii[0]))
    for share in np.linspace(0.0, 1.0, int(np.ceil(abs(turn) / step)) + 1):
        angle, radius = angles[0] + share * turn, radii[0] + share * (radii[1] - radii[0])
        point = here + share * (end - here)
        point[first], point[second] = centre[first] + radius * np.cos(angle), centre[second] + radius * np.sin(angle)
        points.append(point)
    points[-1] = end
    return points


def farthest(ours: list[FloatArray], theirs: list[FloatArray]) -> float:
    """Return how far points of the one lie from lines of the other, run by run [mm]; infinity where runs differ."""
    if len(ours) != len(theirs):
        return np.inf
    apart = [0.0]
    for one, other in zip(ours, theirs, strict=True):
        apart += [_aside(one, other), _aside(other, one), *np.linalg.norm(one[[0, -1]] - other[[0, -1]], axis=1)]
        apart.append(abs(_length(one) - _length(other)) / 100.0)
    return max(apart)


def _length(points: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _aside(points: FloatArray, line: FloatArray) -> float:
    """Return the largest distance of points from a polyline."""
    points = points[:: max(len(points) // MOST_JUDGED, 1)]
    start, along = line[:-1], np.diff(line, axis=0)
    square = np.maximum((along * along).sum(axis=1), 1e-30)
    away = points[:, None] - start
    shares = np.clip((away * along).sum(axis=2) / square, 0.0, 1.0)
    return float(np.linalg.norm(away - shares[:, :, None] * along, axis=2).min(axis=1).max())


def main() -> None:
    """Compare, print what differs, and end with status 1 if anything does."""
    parser = script_parser(__doc__, smoke="five programs, read by geoprint alone")
    parser.add_argument("--interpreter", default="rs274")
    parser.add_argument("--programs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path)
    args = parser.parse_args()
    generator = np.random.default_rng(args.seed)
    seen, reasons, worst, wrong = 0, Counter[str](), 0.0, 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = args.keep or Path(temporary)
        while seen < (5 if args.smoke else args.programs):
            program = folder / f"program_{seen}.ngc"
            program.write_text(Writer(generator).program(int(generator.integers(5, 25))), encoding="utf-8")
            theirs = None if args.smoke else judged(args.interpreter, program)
            if not (theirs or args.smoke):
                continue
            seen += 1
            try:
                curves = read_paths(program, dialect="linuxcnc").curves
            except GeoprintError as refused:
                reasons[re.sub(r"[-\d.]+", "#", str(refused).partition(": ")[2])] += 1
                continue
            if not theirs:
                continue
            apart = farthest(np.split(curves.points, curves.offsets[1:-1]), theirs)
            allowed = IN_INCHES if "G20" in program.read_text(encoding="utf-8").upper() else TOLERANCE
            worst = max(worst, apart if apart < allowed else 0.0)
            if apart >= allowed:
                wrong += 1
                print(f"{program.name}: {apart:.4g} mm apart")
    if args.smoke:
        print(f"{seen} programs read, {sum(reasons.values())} refused")
        return
    print(f"{seen} programs: {seen - wrong - sum(reasons.values())} agree to {worst:.4f} mm, {wrong} differ, refused:")
    for reason, count in reasons.most_common():
        print(f"  {count} {reason}")
    if wrong:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
