"""Paths as APT or a cutter location source (CLS): every statement is obeyed, skipped by name, or refused.

Obeyed are GOTO, GODLTA, FROM and RAPID; arcs, as CIRCLE before a GOTO (counter-clockwise about its axis, as Creo and NX
write them) and as `TLON,GOFWD/(CIRCLE/...),ON,(LINE/...)` behind INDIRV (as CATIA does); UNITS; MSYS, whose frame the
points behind it are in, as NX writes them; TRACUT and COPY; points and matrices with names; labels. What RAPID leads to
is travel, everything else deposits.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, NoReturn, final

import numpy as np

from geoprint.model import FloatArray, reading
from geoprint.toolpath_files.gcode_blocks import MOST_CHORDS, round_axis, turn_to
from geoprint.toolpath_files.path_file import PathFile, Recorder, lines_of, number_of, refuse

TITLE = "APT"
_LOOKS = re.compile(
    r"^[ \t]*(?:N?\d+[ \t]+)?(?:\w{1,8}\)[ \t]*)?"
    r"(?:GOTO|GODLTA|FROM|FEDRAT|UNITS|TOOL PATH|LOADTL|PARTNO|MULTAX|TLON,[ \t]*GOFWD)[ \t]*(?:/|[ \w]|$)",
    re.IGNORECASE | re.MULTILINE,
)
_LABEL = re.compile(r"[ \t]*(?:N?\d+[ \t]+)?(?:\w{1,8}\)[ \t]*)?", re.IGNORECASE)
_SYMBOL = re.compile(r"([A-Za-z]\w{0,31})[ \t]*=[ \t]*(?=\S)")
_UNITS = {"MM": 1.0, "MILLIMETER": 1.0, "MILLIMETERS": 1.0, "INCH": 25.4, "INCHES": 25.4, "IN": 25.4, "CM": 10.0}
# Statements whose rest is text, whatever stands there.
_TEXTS = frozenset({"PARTNO", "PPRINT", "REMARK", "INSERT", "LETTER", "PPFUN", "DISPLY"})
# Statements that change neither where the tool goes nor what deposits.
_HARMLESS = _TEXTS | {
    "AUTOPS", "AUXFUN", "CAMERA", "CATMAT", "CHKSUR", "CLAMP", "CLDIST", "CLEARP", "CLPRNT", "CLRSRF", "COOLNT",
    "CSI_SET_EXTENSION_LENGTH", "CSI_SET_FLUTE_LENGTH", "CUTTER", "DELAY", "DWELL", "END", "END-OF-FILE",
    "END-OF-PATH", "FEDRAT", "FINI", "GEAR", "HEAD", "INTOL", "LEADER", "LINTOL", "LOAD", "LOADTL", "MACHIN", "MAXANG",
    "MAXDPM", "MAXIPM", "MAXRPM", "MAXVEL", "MULTAX", "NOPOST", "NOPS", "NUMPTS", "OPSKIP", "OPSTOP", "OUTTOL",
    "PAINT", "PARTNO", "PIVOTZ", "PLOTFT", "PRINT", "REWIND", "SAFPOS", "SELCTL", "SELECT", "SEQNO", "SPINDL", "STOP",
    "SYN", "TITLES", "TLDATA", "TLSPEC", "TOLER", "TOOL", "TOOL PATH", "TOOLNO", "TURRET", "UNLOAD", "VERIFY",
}  # fmt: skip
# Statements that change nothing where they say one of these words.
_SWITCHED_OFF = {
    "CUTCOM": ("OFF", "NOMORE"), "CYCLE": ("OFF", "NOMORE"), "LCS": ("OFF", "NOMORE"), "MODE": ("ABSOL", "MILL"),
}  # fmt: skip
# Statements that change nothing where all their numbers are 0, perhaps in the world's frame.
_ZERO = frozenset({"ORIGIN", "TRANS", "THICK", "ROTATE", "ROTABL", "ROTHED", "TLLVL", "TRNTYP"})
# Statements by which the head goes where the file does not say.
_ELSEWHERE = frozenset({"GOHOME", "HOME", "RETRCT"})
_WHY = {
    "CUTCOM": "the controller would shift the path by the tool's radius",
    "CYCLE": "its points are holes, not a path",
    "ORIGIN": "it moves the origin", "TRANS": "it moves the origin", "TRNTYP": "it moves the origin",
    "LCS": "it sets a frame",
    "MODE": "it changes what coordinates mean", "THICK": "it shifts the path off the part",
    "ROTATE": "it turns the part", "ROTABL": "it turns the part", "ROTHED": "it turns the head",
}  # fmt: skip
# Lines that one statement may take up; statements of a file and its copies.
_MOST_CONTINUED = 100
_MOST_STATEMENTS = 5_000_000
# Points of an arc may lie off its circle by this [mm], or by this share of its radius: few decimals are written.
_OFF_CIRCLE, _OFF_SHARE = 0.02, 1e-3
# A straight move along a circle that an arc has just followed, up to this turn [rad] and from this sagitta [mm], may be
# more of the arc. It is in files of Creo, whose help says that all GOTO behind a CIRCLE are points on the arc, three
# at least.
_MORE_OF_ARC, _SAGITTA = np.radians(60.0), 0.01
_MORE_IN_CREO = np.radians(121.0)
_Z = np.array([0.0, 0.0, 1.0])


def is_apt(head: str) -> bool:
    """Return whether a text holds statements of APT."""
    return _LOOKS.search(head) is not None


def read_apt(path: Path, *, deposit: str | None) -> PathFile:
    """Read the runs of APT.

    Args:
        path: of the file.
        deposit: not used: RAPID tells.

    Raises:
        InputError: it cannot be read, or holds what is not known here; names its line.
    """
    del deposit
    tool = _Tool(path.name)
    for number, text in _statements(path):
        tool.execute(number, text)
    return tool.file()


def _statements(path: Path) -> Iterator[tuple[int, str]]:
    """Yield number and text of each statement: `$$` begins a comment, a `$` at the end goes on in the next line.

    Creo writes statements of its own into comments (`$$-> CSYS / ...`), which go on in the same way.
    """
    kept, first = list[str](), 0
    for number, line in lines_of(path):
        text, sign, comment = line.partition("$$")
        text = (sign + comment if comment.startswith("->") and not text.strip() else text).rstrip()
        first = first if kept else number
        if len(kept) > _MOST_CONTINUED:
            refuse(path.name, first, f"a statement goes on over more than {_MOST_CONTINUED} lines")
        if text.endswith("$"):
            kept.append(text[:-1])
            continue
        whole = "".join([*kept, text])
        kept = []
        if whole.strip():
            yield first, whole
    if kept:
        refuse(path.name, first, "the file ends within a statement that goes on ($)")


@final
class _Circle(NamedTuple):
    """A circle: its centre, its axis of length 1, about which it is followed, and its radius [mm]."""

    centre: FloatArray
    axis: FloatArray
    radius: float


@final
class _Tool:
    """Where the tool is, and what it has deposited; lives while a file is read."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._recorder = Recorder(name)
        self._scale: float | None = None
        # In the file's coordinates, before TRACUT and COPY; None where nobody knows.
        self._place: FloatArray | None = None
        self._axis = _Z
        self._travels = False
        self._direction: FloatArray | None = None
        # Line, centre, axis and radius of a CIRCLE whose GOTO is to come, and those of the arc just followed.
        self._circle: tuple[int, _Circle] | None = None
        self._followed: _Circle | None = None
        self._named: dict[str, FloatArray] = {}
        self._cut = self._copied = np.eye(4)
        # Statements since each INDEX, which COPY executes anew.
        self._done: list[tuple[int, str]] = []
        self._indices: dict[str, int] = {}
        self._copying = False
        self._cut_at = -1
        # Whether MSYS has set another frame than the part's.
        self._framed = False
        self._frame_said = ""
        # Whether Creo has written it: where GOTO goes on along a circle, so does the arc.
        self._of_creo = False
        self._count = self._chords = 0
        self._used, self._skipped = Counter[str](), Counter[str]()
        self._obeyed: Mapping[str, Callable[[int, str], None]] = {
            "GOTO": self._goto, "GODLTA": self._goby, "FROM": self._from, "RAPID": self._rapid, "UNITS": self._units,
            "CIRCLE": self._arc, "INDIRV": self._towards, "INDIRP": self._towards_point, "TRACUT": self._transform,
            "COPY": self._copy, "INDEX": self._index, "MSYS": self._frame, "TLAXIS": self._tilt,
            "CSYS": self._own_frame, "$$-> CSYS": self._own_frame, "UNIT": self._units,
        }  # fmt: skip

    def execute(self, number: int, text: str) -> None:
        """Execute a statement.

        Raises:
            InputError: it is not known, or wrong.
        """
        self._count += 1
        if self._count > _MOST_STATEMENTS:
            refuse(self._name, number, f"with its copies the file has more than {_MOST_STATEMENTS} statements")
        if self._indices and not self._copying:
            self._done.append((number, text))
        text = text[match.end() :] if (match := _LABEL.match(text)) else text
        if not (text := text.strip()):
            return
        if match := _SYMBOL.match(text):
            self._define(number, match[1].upper(), text[match.end() :])
            return
        major, _, said = text.partition("/")
        major = " ".join(major.upper().split())
        if (first := major.split(" ", 1)[0]) in _TEXTS:
            major = first
        words = frozenset(word.strip() for word in major.split(","))
        self._of_creo |= major.startswith("$$")
        if "GOFWD" in words and words <= {"GOFWD", "TLON"}:
            self._follow(number, said)
        elif major in self._obeyed:
            self._obeyed[major](number, said.strip())
        elif major in _HARMLESS:
            self._skipped[major] += 1
        elif major in _ELSEWHERE:
            self._place, self._followed = None, None
            self._skipped[major] += 1
        else:
            self._check_idle(number, major, said)

    def _check_idle(self, number: int, major: str, said: str) -> None:
        """Refuse a statement that may change something, unless it says that it does not."""
        if major.startswith("$$"):
            return
        words = [word.strip().upper() for word in said.split(",")]
        if words[0] in _SWITCHED_OFF.get(major, ()) or (
            major in _ZERO and all(word == "WORLD" or _is_zero(word) for word in words)
        ):
            self._skipped[f"{major}/{words[0]}"] += 1
            return
        why = _WHY.get(major, "it is not known here, and may change the path")
        self._refuse(number, f"{major[:40]} is not read: {why}; export straight moves to points (GOTO)")

    def _refuse(self, number: int, reason: str) -> NoReturn:
        refuse(self._name, number, reason)

    # Numbers, points and matrices.

    def _numbers(self, number: int, what: str, cells: Sequence[str]) -> FloatArray:
        values = [number_of(self._name, number, what, cell.strip()) for cell in cells]
        return np.array(values, dtype=np.float64)

    def _lengths(self, number: int, cells: Sequence[str]) -> FloatArray:
        """Return x, y and z [mm]."""
        self._scale = self._scale or 1.0
        names = ("x", "y", "z")
        return np.array([
            number_of(self._name, number, axis, cell.strip(), scale=self._scale)
            for axis, cell in zip(names, cells, strict=False)
        ])  # fmt: skip

    def _direction_of(self, number: int, what: str, cells: Sequence[str]) -> FloatArray:
        values = self._numbers(number, what, cells)
        length = float(np.linalg.norm(values))
        if len(values) != 3 or not 1e-6 < length < 1e6:
            self._refuse(number, f"{what} must be three numbers of a direction, found {', '.join(cells)[:60]!r}")
        return values / length

    def _point(self, number: int, said: str) -> FloatArray:
        """Return a place [mm] by 3 numbers, or 6 with the tool's axis, or the name of a point."""
        cells = _parts(_inner(said, "POINT"))
        known = self._named.get(cells[0].upper()) if len(cells) == 1 else None
        if known is not None and known.ndim == 1:
            return known
        if len(cells) not in {3, 6}:
            self._refuse(number, f"a point has 3 numbers, or 6 with the tool's axis, found {len(cells)}")
        if len(cells) == 6:
            self._axis = self._direction_of(number, "the tool's axis", cells[3:])
        return self._lengths(number, cells)

    def _matrix(self, number: int, said: str) -> FloatArray:
        """Return a (4, 4) matrix by 12 numbers in rows, TRANSL, XYROT, YZROT, ZXROT or the name of one."""
        cells = [cell.upper() for cell in _parts(_inner(said, "MATRIX"))]
        known = self._named.get(cells[0]) if len(cells) == 1 else None
        if known is not None and known.ndim == 2:
            return known
        found = np.eye(4)
        if cells[0] == "TRANSL" and len(cells) in {3, 4}:
            found[: len(cells) - 1, 3] = self._lengths(number, cells[1:])
        elif cells[0] in {"XYROT", "YZROT", "ZXROT"} and len(cells) == 2:
            turn = np.radians(self._numbers(number, "an angle", cells[1:])[0])
            i, j = {"XYROT": (0, 1), "YZROT": (1, 2), "ZXROT": (2, 0)}[cells[0]]
            found[i, i] = found[j, j] = np.cos(turn)
            found[j, i], found[i, j] = np.sin(turn), -np.sin(turn)
        elif len(cells) == 12:
            found[:3] = self._numbers(number, "a number of the matrix", cells).reshape(3, 4)
            self._scale = self._scale or 1.0
            found[:3, 3] *= self._scale
        else:
            self._refuse(
                number, f"the matrix {said.strip()[:40]!r} is not read; give 12 numbers, TRANSL, XYROT, YZROT or ZXROT"
            )
        turned = found[:3, :3]
        if np.abs(turned @ turned.T - np.eye(3)).max() > 1e-3:
            self._refuse(number, "the matrix stretches or shears the path, and only motions are read")
        return found

    def _define(self, number: int, name: str, text: str) -> None:
        kind, _, said = text.partition("/")
        match kind.strip().upper():
            case "POINT":
                self._named[name] = self._point(number, said)
            case "MATRIX":
                self._named[name] = self._matrix(number, said)
            case word:
                # Whoever uses it is refused.
                self._named.pop(name, None)
                self._skipped[f"definition of a {word[:20]}" if said else "definition of a number"] += 1

    # What is obeyed.

    def _units(self, number: int, said: str) -> None:
        unit = said.upper()
        if unit not in _UNITS:
            self._refuse(number, f"UNITS/{unit[:20]} is no unit; MM, CM and INCHES are read")
        if self._scale not in {None, _UNITS[unit]}:
            self._refuse(number, "it gives another unit than what stands before; give one UNITS at the begin")
        self._scale = _UNITS[unit]
        self._used["UNITS"] += 1

    def _rapid(self, _: int, __: str) -> None:
        self._travels = True
        self._used["RAPID"] += 1

    def _from(self, number: int, said: str) -> None:
        self._recorder.count(number)
        self._place, self._followed = self._point(number, said), None

    def _goto(self, number: int, said: str) -> None:
        self._used["GOTO"] += 1
        end = self._point(number, said)
        if self._circle is None:
            self._line(number, end)
            return
        line, circle = self._circle
        self._circle = None
        start = self._start(number)
        self._check_on(line, "begins", start, circle)
        self._check_on(number, "ends", end, circle)
        angle = turn_to(start, end, centre=circle.centre, axis=circle.axis)
        # An arc that ends where it begins is a circle, whatever rounding says.
        if min(angle, 2.0 * np.pi - angle) * circle.radius < _OFF_CIRCLE:
            angle = 2.0 * np.pi
        self._turn(number, start, end, circle, angle=angle)

    def _goby(self, number: int, said: str) -> None:
        cells = _parts(said)
        if len(cells) not in {3, 6}:
            self._refuse(number, f"GODLTA needs 3 numbers, found {len(cells)}")
        self._used["GODLTA"] += 1
        self._line(number, self._start(number) + self._lengths(number, cells))

    def _arc(self, number: int, said: str) -> None:
        cells = _parts(said)
        if len(cells) < 6 or "TIMES" in {cell.upper() for cell in cells}:
            self._refuse(
                number, "CIRCLE is not read so; it is read as x,y,z,i,j,k,r of centre, axis and radius before the GOTO "
                "to the arc's end"
            )  # fmt: skip
        axis = self._direction_of(number, "the axis of CIRCLE", cells[3:6])
        centre = self._lengths(number, cells[:3])
        # Without a radius it is that of the arc's beginning.
        radius = (
            float(self._lengths(number, cells[6:7])[0])
            if len(cells) > 6
            else float(np.linalg.norm(np.cross(axis, self._start(number) - centre)))
        )
        self._circle = number, _Circle(centre, axis, radius)
        self._used["CIRCLE"] += 1

    def _towards(self, number: int, said: str) -> None:
        self._direction = self._direction_of(number, "INDIRV", _parts(said))

    def _towards_point(self, number: int, said: str) -> None:
        self._direction = self._point(number, said) - self._start(number)

    def _follow(self, number: int, said: str) -> None:
        """Follow a circle to a line, from where the tool is, as INDIRV says."""
        parts = _parts(said)
        order = 1
        if len(parts) == 5 and parts[3].upper() == "INTOF" and parts[2].isdigit():
            order, parts = int(parts[2]), [*parts[:2], parts[4]]
        circle = _parts(_inner(parts[0], "CIRCLE"))
        line = _parts(_inner(parts[-1], "LINE"))
        if len(parts) != 3 or parts[1].upper() != "ON" or len(circle) not in {4, 7} or len(line) != 6:
            self._refuse(
                number, "this motion is not read, but GOFWD/(CIRCLE/x,y,z,r),ON,(LINE/x,y,z,x,y,z) is; export points "
                "(GOTO)"
            )  # fmt: skip
        if self._direction is None:
            self._refuse(number, "no INDIRV says in which direction the circle is followed")
        start, centre = self._start(number), self._lengths(number, circle[:3])
        axis = self._axis if len(circle) == 4 else self._direction_of(number, "the axis of CIRCLE", circle[3:6])
        radius = float(self._lengths(number, circle[-1:])[0])
        self._check_on(number, "begins", start, _Circle(centre, axis, radius))
        way = float(np.cross(axis, start - centre) @ self._direction)
        if abs(way) < 0.1 * radius * float(np.linalg.norm(self._direction)):
            self._refuse(number, "INDIRV does not say in which direction the circle is followed: it points across it")
        axis = axis if way > 0.0 else -axis
        followed = _Circle(centre, axis, radius)
        ends = _crossings(self._lengths(number, line[:3]), self._lengths(number, line[3:]), followed)
        # An end where the arc begins is the last one, after the whole circle.
        turns = sorted((turn_to(start, end, centre=centre, axis=axis), tuple(end.tolist())) for end in ends)
        turns = sorted((turn if turn * radius > _OFF_CIRCLE else turn + 2.0 * np.pi, end) for turn, end in turns)
        if not 1 <= order <= len(turns):
            self._refuse(number, f"the line meets the circle {len(turns)} times, and crossing {order} is asked for")
        angle, end = turns[order - 1]
        self._direction = None
        self._used["arcs"] += 1
        self._turn(number, start, np.array(end), followed, angle=angle)

    def _frame(self, number: int, said: str) -> None:
        """Take what follows to be in a frame that origin, x axis and y axis give in the part's coordinates."""
        if said == self._frame_said:
            self._used["MSYS"] += 1
            return
        cells = _parts(said)
        if len(cells) != 9:
            self._refuse(number, f"MSYS needs 9 numbers, of its origin, x axis and y axis, found {len(cells)}")
        x, y = (self._direction_of(number, "an axis of MSYS", cells[i : i + 3]) for i in (3, 6))
        if abs(float(x @ y)) > 1e-3:
            self._refuse(number, "the axes of MSYS are not at right angles")
        if self._used["TRACUT"] or self._copying:
            self._refuse(number, "MSYS stands with TRACUT or COPY, and programs differ in which of them goes first")
        frame = np.eye(4)
        frame[:3] = np.column_stack([x, y, np.cross(x, y), self._lengths(number, cells[:3])])
        self._used["MSYS"] += 1
        self._frame_said = said
        self._framed |= not np.array_equal(frame, np.eye(4))
        self._cut_to(frame)

    def _own_frame(self, number: int, said: str) -> None:
        values = self._numbers(number, "CSYS", _parts(said))
        if len(values) != 12 or np.abs(values - np.eye(3, 4).ravel()).max() > 1e-6:
            self._refuse(
                number, (
                    "CSYS is not read: programs differ in the frame of the points after it. Export in the part's own "
                    "frame"
                )
            )  # fmt: skip
        self._skipped["CSYS of the part's own frame"] += 1

    def _tilt(self, number: int, said: str) -> None:
        self._axis = self._direction_of(number, "TLAXIS", _parts(said))

    def _transform(self, number: int, said: str) -> None:
        if self._copying:
            self._refuse(number, "TRACUT stands within what COPY repeats, and programs differ in what that means")
        if self._framed:
            self._refuse(number, "TRACUT stands with MSYS, and programs differ in which of them goes first")
        self._used["TRACUT"] += 1
        self._cut_to(np.eye(4) if said.upper() == "NOMORE" else self._matrix(number, said))

    def _cut_to(self, matrix: FloatArray) -> None:
        """Let a matrix turn coordinates of the file into those of the part; the tool stays where it is."""
        here = None if self._place is None else self._out(self._place)
        self._cut, self._cut_at = matrix, len(self._done)
        self._place = None if here is None else self._in(here)

    def _index(self, _: int, said: str) -> None:
        if not self._copying:
            self._indices[said] = len(self._done)

    def _copy(self, number: int, said: str) -> None:
        cells = _parts(said)
        begin = self._indices.get(cells[0])
        if self._copying or begin is None:
            self._refuse(number, f"COPY/{cells[0][:20]} repeats what no INDEX before it begins")
        if not np.array_equal(self._cut, np.eye(4)) or self._cut_at > begin:
            self._refuse(number, "COPY stands with TRACUT or MSYS, and programs differ in which of them goes first")
        kind, last = (cells[1].upper() if len(cells) > 1 else ""), cells[-1]
        if kind not in {"TRANSL", "XYROT", "YZROT", "ZXROT", "MODIFY", "SAME"} or not last.isdigit():
            self._refuse(number, "COPY is read as COPY/n,TRANSL,x,y,z,times, or with XYROT, MODIFY or SAME")
        moved = ",".join(cells[2:-1] if kind == "MODIFY" else cells[1:-1])
        step = np.eye(4) if kind == "SAME" else self._matrix(number, moved)
        self._used["COPY"] += 1
        # The last statement is the COPY itself.
        repeated = self._done[begin:-1]
        self._copying = True
        for _ in range(int(last)):
            here = None if self._place is None else self._out(self._place)
            self._copied = step @ self._copied
            self._place = None if here is None else self._in(here)
            for line, text in repeated:
                self.execute(line, text)
        here = None if self._place is None else self._out(self._place)
        self._copied, self._copying = np.eye(4), False
        self._place = here

    # Motion.

    def _start(self, number: int) -> FloatArray:
        if self._place is None:
            self._refuse(number, "it moves from where the tool is, and nothing before says where")
        return self._place

    def _check_on(self, number: int, what: str, place: FloatArray, circle: _Circle) -> None:
        centre, axis, radius = circle
        reach = np.linalg.norm(np.cross(axis, place - centre))
        off = abs(float(reach) - radius)
        if not radius > 0.0 or off > max(_OFF_CIRCLE, _OFF_SHARE * radius):
            self._refuse(number, f"the arc {what} {off:.3g} mm off its circle of radius {radius:g} mm")

    def _out(self, place: FloatArray) -> FloatArray:
        matrix = self._copied @ self._cut
        return matrix[:3, :3] @ place + matrix[:3, 3]

    def _in(self, place: FloatArray) -> FloatArray:
        matrix = np.linalg.inv(self._copied @ self._cut)
        return matrix[:3, :3] @ place + matrix[:3, 3]

    def _line(self, number: int, end: FloatArray) -> None:
        start = self._place
        if self._followed is not None and start is not None and not self._travels:
            centre, axis, radius = self._followed
            angle = turn_to(start, end, centre=centre, axis=axis)
            on = abs(float(np.linalg.norm(np.cross(axis, end - centre))) - radius) < _OFF_CIRCLE
            on &= radius * (1.0 - np.cos(angle / 2.0)) > _SAGITTA
            if on and self._of_creo and angle < _MORE_IN_CREO:
                self._turn(number, start, end, self._followed, angle=angle)
                return
            if on and angle < _MORE_OF_ARC:
                self._refuse(
                    number, "it goes on along the circle of the arc before, and nothing says whether straight or not; "
                    "give each arc its own CIRCLE"
                )  # fmt: skip
        self._followed = None
        self._deposit(number, end[None] if start is None else np.stack([start, end]))

    def _turn(self, number: int, start: FloatArray, end: FloatArray, circle: _Circle, *, angle: float) -> None:
        climb = float((end - start) @ circle.axis)
        points = round_axis(start, centre=circle.centre, axis=circle.axis, angle=angle, climb=climb)
        # A run goes on where the arc before it ends, without rounding.
        points[0], points[-1] = start, end
        self._chords += len(points)
        if self._chords > MOST_CHORDS:
            self._refuse(number, f"arcs take more than {MOST_CHORDS} chords; give the paths of one part")
        self._deposit(number, points)
        self._followed = circle

    def _deposit(self, number: int, points: FloatArray) -> None:
        """Go along points, from where the tool is."""
        if self._travels or len(points) == 1:
            self._recorder.count(number)
        elif len(points) == 2:
            start, end = ((x, y, z) for x, y, z in (self._out(point).tolist() for point in points))
            if start != end:
                self._recorder.line(number, start, end)
        else:
            matrix = self._copied @ self._cut
            placed = points @ matrix[:3, :3].T + matrix[:3, 3]
            placed[0], placed[-1] = self._out(points[0]), self._out(points[-1])
            self._recorder.path(number, placed)
        self._place, self._travels = points[-1], False

    def file(self) -> PathFile:
        """Return what was deposited."""
        if self._circle is not None:
            self._refuse(self._circle[0], "no GOTO behind CIRCLE says where the arc ends")
        assumed = [] if self._used["UNITS"] else ["mm, as no UNITS stands in it"]
        if self._framed:
            assumed.append("points behind MSYS in the frame that it sets")
        if not self._used["RAPID"]:
            assumed.append("all moves deposit, as no RAPID stands in it")
        return self._recorder.file(
            title=TITLE, deposit="all but what RAPID leads to",
            reading=reading(used=self._used, skipped=self._skipped, assumed=assumed),
        )  # fmt: skip


def _parts(said: str) -> list[str]:
    """Return what commas part, outside of brackets."""
    found, depth, begin = list[str](), 0, 0
    for place, sign in enumerate(said):
        depth += (sign == "(") - (sign == ")")
        if sign == "," and depth == 0:
            found.append(said[begin:place].strip())
            begin = place + 1
    return [*found, said[begin:].strip()]


def _inner(said: str, kind: str) -> str:
    """Return what a statement in brackets says, such as (POINT/1,2,3); another text as it is."""
    text = said.strip()
    word, sign, rest = text[1:-1].partition("/")
    return rest if text.startswith("(") and text.endswith(")") and sign and word.strip().upper() == kind else text


def _is_zero(word: str) -> bool:
    try:
        return float(word) == 0.0
    except ValueError:
        return False


def _crossings(first: FloatArray, second: FloatArray, circle: _Circle) -> list[FloatArray]:
    """Return where a line meets a circle, seen along the circle's axis and in its plane."""
    centre, axis, radius = circle
    flat = first - centre
    flat = flat - (flat @ axis) * axis
    along = second - first
    along = along - (along @ axis) * axis
    square = float(along @ along)
    if square < 1e-18:
        return []
    middle = float(flat @ along) / square
    left = (radius**2 - float(flat @ flat)) / square + middle**2
    # A line that grazes the circle within rounding touches it.
    if left * square < -_OFF_CIRCLE * radius:
        return []
    half = float(np.sqrt(max(left, 0.0)))
    return [centre + flat + (sign * half - middle) * along for sign in (-1.0, 1.0)[: 2 if half else 1]]
