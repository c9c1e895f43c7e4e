"""Where the tool of a G-code program is and was: modal groups, coordinate systems, offsets, extruder and moves."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Final, TypeAlias, final

import numpy as np

from geoprint.errors import UsageError
from geoprint.model import BoolArray, FloatArray
from geoprint.toolpath_files.gcode_blocks import Block
from geoprint.toolpath_files.path_file import Recorder, refuse

# Which codes of G-code do what: modal groups, what moves nothing, what is refused, what deposits; and dialects.


PRINTERS: Final = ("marlin", "klipper", "reprap")
MACHINES: Final = ("linuxcnc", "fanuc")
DIALECTS: Final = (*PRINTERS, *MACHINES)

# Axes that turn the part or the tool, or move them besides X, Y and Z.
ROTARY: Final = frozenset("ABCUVW")
MOTIONS: Final = frozenset({"G0", "G1", "G2", "G3"})
SYSTEMS: Final = {
    code: number
    for number, code in enumerate(("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"), start=1)
}
# Axes of a plane, first, second and third: a turn from the first to the second is anticlockwise.
PLANES: Final = {"G17": (0, 1, 2), "G18": (2, 0, 1), "G19": (1, 2, 0)}
# Codes that use the coordinates of their block themselves.
SETTERS: Final = frozenset({"G10", "G28", "G28.1", "G30", "G30.1", "G52", "G92"})
# Of each group a block holds one.
GROUPS: Final = {
    **dict.fromkeys(MOTIONS, "motions"),
    **dict.fromkeys(PLANES, "planes"),
    **dict.fromkeys(("G90", "G91"), "distance modes"),
    **dict.fromkeys(("G90.1", "G91.1"), "modes of arcs"),
    **dict.fromkeys(("G20", "G21"), "units"),
    **dict.fromkeys(SYSTEMS, "coordinate systems"),
    **dict.fromkeys(("G43", "G49"), "tool lengths"),
    **dict.fromkeys((*SETTERS, "G92.1", "G92.2", "G92.3"), "codes that set coordinates"),
    "G53": "machine coordinates",
}
# What moves nothing and renames nothing: dwell, exactness, modes of feed, ends of what is refused when it begins.
SKIPPED: Final = frozenset(
    {"G4", "G8", "G9", "G11", "G15", "G40", "G50.1", "G61", "G61.1", "G62", "G64", "G67", "G69", "G80",
     "G93", "G94", "G95", "G96", "G97", "G98", "G99"}
)  # fmt: skip
# Behind these the tool stands where a probe or the firmware says.
PROBING: Final = frozenset({"G31", "G38.2", "G38.3", "G38.4", "G38.5"})
LOSING: Final = PROBING | {"G12", "G27", "G29", "G32", "G33", "G34", "G35"}

ENDS: Final = frozenset({"M2", "M30", "M99"})
SWITCHES: Final = {"M3": True, "M4": True, "M5": False, "M101": True, "M103": False}
# They run what the file does not hold, or move its frame.
REFUSED_M: Final = {
    **dict.fromkeys(("M23", "M32", "M47", "M96", "M97", "M98", "M808"), "runs what is not in its place in this file"),
    **dict.fromkeys(("M206", "M290", "M428", "M429", "M430", "M579"), "moves the frame of the part or scales it"),
}
# Modes that are stored and restored; a printer means something else by them.
REFUSED_STORED: Final = frozenset({"M70", "M71", "M72", "M73"})
# From here on printers' codes take all words of their block, coordinates too; RS274/NGC has none but its own.
PRINTER_M: Final = 74
# Extended commands of printers that neither move nor rename.
QUIET: Final = (
    "SET_", "EXCLUDE_OBJECT", "TIMELAPSE", "_TIMELAPSE", "BED_MESH_CLEAR", "BED_MESH_PROFILE", "RESPOND", "STATUS_",
    "ACTIVATE_EXTRUDER", "TURN_OFF_HEATERS", "TEMPERATURE_WAIT", "SAVE_GCODE_STATE",
)  # fmt: skip
REFUSED_COMMANDS: Final = ("SET_GCODE_OFFSET", "SET_KINEMATIC_POSITION", "RESTORE_GCODE_STATE", "FORCE_MOVE")

COMMAND: Final = re.compile(r"[A-Za-z_][A-Za-z_]+[A-Za-z0-9_]*")
_PRINTER_WORD = re.compile(
    r"(?<![\d.A-Za-z_])(?:E[ \t]*[-+]?\.?\d|M(?:82|83|104|106|107|109|140|190)(?!\d))", re.IGNORECASE
)
_HOMES = re.compile(r"(?:N[ \t]*\d+[ \t]*)?G28(?:[ \t]+[XYZW])*", re.IGNORECASE)
_VALUE = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))")
_PROGRAM = re.compile(r"[O:][ \t]*\d{1,8}", re.IGNORECASE)
_FLAVOUR = re.compile(r"flavor[ \t:=]{1,5}(klipper|marlin|reprapfirmware|rrf)", re.IGNORECASE)


def flavour_of(comment: str) -> str | None:
    """Return the firmware that a slicer's comment names, as a rule of `extruder.RULES`."""
    match = _FLAVOUR.search(comment)
    if match is None:
        return None
    return {"reprapfirmware": "reprap", "rrf": "reprap"}.get(match[1].lower(), match[1].lower())


@final
@dataclass(frozen=True, slots=True)
class Guess:
    """A dialect.

    Attributes:
        dialect: one of DIALECTS.
        why: what tells it, in words; empty where it was asked for.
        sure: whether it says how an extruder is read.
    """

    dialect: str
    why: str
    sure: bool


def guess_dialect(head: str) -> Guess:
    """Return the dialect of a text.

    Args:
        head: the beginning of the file.
    """
    for line in head.splitlines():
        flavour = flavour_of(line) if ";" in line else None
        if flavour is not None:
            return Guess(flavour, "from a comment", sure=True)
    lines = list(_bare(head))
    if any(_PRINTER_WORD.search(line) for line in lines):
        return Guess("marlin", "from E words or M-codes of printers", sure=False)
    if any(_HOMES.fullmatch(line) for line in lines):
        return Guess("marlin", "from G28 without coordinates", sure=False)
    if any(_PROGRAM.fullmatch(line) for line in lines):
        return Guess("fanuc", "from its program number", sure=False)
    return Guess("linuxcnc", "because nothing else fits", sure=False)


def _bare(head: str) -> Iterator[str]:
    for line in head.splitlines():
        text = line.partition(";")[0].partition("(")[0].strip()
        if text:
            yield text


@final
class Deposit:
    """What deposits, as it was asked for.

    Args:
        asked: as `read_gcode` takes it.

    Attributes:
        extruder: letter of the axis that extrudes.
        named: whether it or M-codes were asked for.
        codes: M-codes that switch.

    Raises:
        UsageError: it is neither.
    """

    def __init__(self, asked: str | None) -> None:
        self.asked, self.extruder, self.named = asked, "E", asked is not None
        self._on: tuple[str, dict[str, float]] | None = None
        self._off = self._on
        self.by_code = asked is None
        text = (asked or "").strip().upper()
        if asked is None or text in ROTARY | {"E"}:
            self.extruder, self.codes = text or "E", frozenset(SWITCHES if asked is None else ())
            return
        first, _, second = text.partition("/")
        self._on = _switch(first, None)
        self._off = None if self._on is None else _switch(second, self._on)
        if self._on is None or self._off is None or self._on == self._off:
            raise UsageError(
                f"`--deposit {asked}` is neither two M-codes nor an axis. For G-code give the codes for on and off, "
                "as M3/M5 or M42 P4 S255/S0, or the letter of the extruder axis, as A."
            )
        self.by_code = True
        self.codes = frozenset({self._on[0], self._off[0]})

    def switched(self, name: str, block: Block, code: str) -> bool | None:
        """Return whether an M-code switches on or off; None where it concerns something else.

        Raises:
            InputError: it has another value than the two that were named.
        """
        if self._on is None or self._off is None:
            return SWITCHES.get(code)
        selectors = set(self._on[1].items()) & set(self._off[1].items())
        for value, (own, words) in ((True, self._on), (False, self._off)):
            if code == own and all(block.words.get(letter) == number for letter, number in words.items()):
                return value
        chosen = self._on if code == self._on[0] else self._off
        fixed = (
            selectors if self._on[0] == self._off[0] else {each for each in chosen[1].items() if each[0] not in "SQ"}
        )
        if all(block.words.get(letter) == number for letter, number in fixed):
            refuse(
                name, block.number, f"{code} has neither of the values of `--deposit {self.asked}`; name what deposits"
            )
        return None


def _switch(text: str, before: tuple[str, dict[str, float]] | None) -> tuple[str, dict[str, float]] | None:
    """Return an M-code with its words; words alone change those of the one before."""
    code, found = "", dict[str, float]()
    for i, word in enumerate(text.split()):
        match = _VALUE.fullmatch(word)
        if match is None:
            return None
        if match[1] == "M" and i == 0 and match[2].isdigit():
            code = f"M{float(match[2]):g}"
        else:
            found[match[1]] = float(match[2])
    if not code and before is not None and found:
        return before[0], before[1] | found
    return (code, found) if code else None


# Where the tool of a G-code program is: coordinate systems, offsets, homes, and the frame that each place is known
# in.
#
# A coordinate system that nothing in the file sets lies where the controller's memory has it: its zero is a frame of
# its own. So is a place that the tool had before anything says where, once G92 or G10 L20 gives it a name. Machine
# coordinates are frame 0. Two places are compared only within one frame; each axis has its own.


_MACHINE = 0
_SYSTEMS = 9
_NAN = math.nan


@final
class Places:
    """Place of the tool and offsets of the coordinates, axis by axis [mm]; lives while a file is read.

    Attributes:
        here: of the tool; not a number where it is not known.
        frames: in which `here` is known.
        why: what made an axis unknown; empty where nothing before has said it.
        shift: what is added to a coordinate of the program.
        shift_frames: in which that is known.
    """

    def __init__(self) -> None:
        self.here = [_NAN] * 3
        self.frames = [_MACHINE] * 3
        self.why = [""] * 3
        self._system = 1
        # Offset of each system and axis, with its frame; what G92 or G52 adds, with a frame where it alone counts.
        self._offsets = {s: [(0.0, s)] * 3 for s in range(1, _SYSTEMS + 1)}
        self._added: list[tuple[float, int | None]] = [(0.0, None)] * 3
        self._stored = list(self._added)
        self._homes: dict[str, tuple[list[float], list[int]]] = {}
        self._frame_count = _SYSTEMS
        self._triples: dict[tuple[int, ...], int] = {}
        # Of the frames in use, where they have been looked up since they changed.
        self._triple = -1
        self.shift = [0.0] * 3
        self.shift_frames = [1] * 3

    def frame(self) -> int:
        """Return a number for the frames that the three axes are known in."""
        if self._triple < 0:
            self._triple = self._triples.setdefault(tuple(self.frames), len(self._triples))
        return self._triple

    def select(self, system: int) -> None:
        """Use another coordinate system, 1 for G54 to 9 for G59.3."""
        if system != self._system:
            self._system = system
            self._lose_renamed(range(3))

    def put_system(self, system: int, axis: int, value: float) -> None:
        """Put the zero of a coordinate system to a machine coordinate (G10 L2); 0 for the one in use."""
        system = system or self._system
        self._offsets[system][axis] = (value, _MACHINE)
        if system == self._system:
            self._lose_renamed([axis])

    def move_system(self, system: int, axis: int, value: float) -> None:
        """Move the zero of a coordinate system by a distance."""
        system = system or self._system
        old, frame = self._offsets[system][axis]
        self._offsets[system][axis] = (old + value, frame)
        self._add_up()

    def name_in_system(self, system: int, axis: int, value: float) -> None:
        """Put the zero of a coordinate system so that the tool is at a coordinate of it (G10 L20)."""
        system = system or self._system
        added, renamed = self._added[axis]
        if renamed is not None:
            self._added[axis], added = (0.0, None), 0.0
        self._begin_frame(axis, value + added)
        self._offsets[system][axis] = (self.here[axis] - value - added, self.frames[axis])
        self._add_up()

    def name_here(self, axis: int, value: float) -> None:
        """Give the tool's place a coordinate (G92)."""
        self._begin_frame(axis, value)
        offset, frame = self._offsets[self._system][axis]
        away = self.here[axis] - value
        same = frame == self.frames[axis]
        self._added[axis] = (away - offset, None) if same else (away, self.frames[axis])
        self._stored[axis] = self._added[axis]
        self._add_up()

    def add(self, axis: int, value: float) -> None:
        """Add a distance to the coordinates of an axis (G52), in place of what G92 added."""
        self._added[axis] = self._stored[axis] = (value, None)
        self._add_up()

    def is_renamed(self, axis: int) -> bool:
        """Return whether G92 or G52 has given an axis other coordinates."""
        return self._added[axis] != (0.0, None)

    def cancel(self, *, forget: bool) -> None:
        """Take back what G92 and G52 added (G92.1, and G92.2 which does not forget it)."""
        self._added = [(0.0, None)] * 3
        if forget:
            self._stored = list(self._added)
        self._add_up()

    def restore(self) -> None:
        """Add again what was taken back (G92.3)."""
        self._added = list(self._stored)
        self._add_up()

    def home(self, axis: int) -> None:
        """Move an axis to its home and take it for the zero of the program, as printers are sliced for."""
        self._added[axis] = self._stored[axis] = (0.0, None)
        self._add_up()
        self.here[axis] = self.shift[axis]
        self._know(axis, self.shift_frames[axis])

    def keep(self, code: str) -> None:
        """Store the tool's place (G28.1, G30.1)."""
        self._homes[code] = (list(self.here), list(self.frames))

    def recall(self, code: str, axis: int, why: str) -> None:
        """Move an axis to where a code leads (G28, G30); nobody knows where, unless it was stored."""
        if code not in self._homes:
            self.lose(axis, why)
            return
        places, frames = self._homes[code]
        self.here[axis], self.why[axis] = places[axis], why
        self._know(axis, frames[axis])

    def lose(self, axis: int, why: str) -> None:
        """Forget where an axis is."""
        self.here[axis], self.why[axis] = _NAN, why
        self._know(axis, _MACHINE)

    def put(self, axis: int, value: float, *, machine: bool) -> None:
        """Move an axis to a coordinate of the program, or of the machine (G53)."""
        frame = _MACHINE if machine else self.shift_frames[axis]
        self.here[axis] = value if machine else value + self.shift[axis]
        if frame != self.frames[axis]:
            self._know(axis, frame)

    def _know(self, axis: int, frame: int) -> None:
        """Note the frame that the place of an axis is known in."""
        self.frames[axis] = frame
        self._triple = -1

    def _begin_frame(self, axis: int, value: float) -> None:
        """Where nobody knows the place of an axis, let its coordinate begin a frame."""
        if math.isnan(self.here[axis]):
            self._frame_count += 1
            self.here[axis] = value
            self._know(axis, self._frame_count)

    def _lose_renamed(self, axes: range | list[int]) -> None:
        """Add up offsets behind a change of system; what G92 named in a frame of its own is known no more."""
        for axis in axes:
            if self._added[axis][1] is not None:
                self._frame_count += 1
                self._added[axis] = (self._added[axis][0], self._frame_count)
        self._add_up()

    def _add_up(self) -> None:
        for axis, ((offset, frame), (added, renamed)) in enumerate(
            zip(self._offsets[self._system], self._added, strict=True)
        ):
            self.shift[axis] = added + (offset if renamed is None else 0.0)
            self.shift_frames[axis] = frame if renamed is None else renamed


# Where an extruder feeds: M82 and M83 beside G90 and G91, as firmwares differ in them.
#
# Marlin: what was said last counts, G90 and G91 set the extruder too. Klipper: relative where G91 or M83 holds.
# RepRapFirmware: M82 and M83 alone. All of these are followed at once, each also from a relative beginning, since
# what a file leaves open follows from its moves.


# In the order in which they are preferred where the moves tell nothing.
NAMES = {"marlin": "Marlin", "klipper": "Klipper", "reprap": "RepRapFirmware"}
RULES = tuple(NAMES)
# Each rule from an absolute beginning, and from a relative one.
_READINGS = tuple((rule, relative) for relative in (False, True) for rule in RULES)
# Moves by which a reading is chosen.
_JUDGED = 20_000
# Feed per mm of path that is like the median of all: within a factor of this.
_ALIKE = 1.5


@final
class Extruder:
    """Follows all readings of the E words; lives while a file is read.

    Attributes:
        said: whether M82 or M83 has been read.
        mixed: whether an E word has been read where the rules differ.
    """

    def __init__(self) -> None:
        self.said = self.mixed = False
        self._g91 = self._m83 = self._last = self._differs = self._ever_g91 = False
        self._positions_said = False
        self._relative = [relative for _, relative in _READINGS]
        self._at = [0.0] * len(_READINGS)
        self._feeds = array("d")

    def distance_mode(self, *, relative: bool) -> None:
        """Execute G90 or G91."""
        self._g91 = self._last = relative
        self._ever_g91 |= relative
        self._positions_said = True
        self._set()

    def extruder_mode(self, *, relative: bool) -> None:
        """Execute M82 or M83."""
        self._m83 = self._last = relative
        self.said = True
        self._set()

    def rename(self, value: float) -> None:
        """Give the extruder another coordinate (G92)."""
        self._at = [value] * len(self._at)

    def feed(self, value: float, length: float) -> int:
        """Return in a bit for each reading whether it feeds along a move.

        Args:
            value: of the E word.
            length: of the move [mm]; 0 where only the extruder moves.
        """
        self.mixed |= self._differs
        bits = 0
        judged = length > 0.0 and len(self._feeds) < _JUDGED * len(self._at)
        for i, relative in enumerate(self._relative):
            gain = value if relative else value - self._at[i]
            self._at[i] += gain
            if gain > 0.0:
                bits |= 1 << i
            if judged:
                self._feeds.append(gain / length)
        return bits

    def chosen(self, rule: str) -> int:
        """Return which reading the moves bear out best; where they tell nothing, an absolute one of the first rule.

        Args:
            rule: that is known to hold; another word leaves it to the moves.
        """
        count = len(_READINGS)
        allowed = [i for i in range(count) if rule not in RULES or _READINGS[i][0] == rule]
        scores = [_alike(self._feeds[i::count]) for i in range(count)]
        return max(allowed, key=lambda i: (scores[i], -i))

    def rule(self, reading: int) -> str:
        """Return the rule of a reading that `chosen` returned, one of RULES."""
        return _READINGS[reading][0]

    def assumed(self, reading: int) -> list[str]:
        """Return in words what a reading that `chosen` returned assumes."""
        rule, relative = _READINGS[reading]
        found: list[str] = []
        if self.mixed:
            found.append(f"M82 and M83 beside G90 and G91 as {NAMES[rule]} reads them")
        if not self.said and not self._ever_g91:
            found.append("E relative, from the first moves" if relative else "E absolute, as no M83 says otherwise")
        return found

    def _set(self) -> None:
        for i, (rule, beginning) in enumerate(_READINGS):
            own = self._m83 if self.said else beginning
            if rule == "marlin":
                self._relative[i] = self._last if self.said or self._positions_said else beginning
            else:
                self._relative[i] = own or (rule == "klipper" and self._g91)
        self._differs = len(set(self._relative[: len(RULES)])) > 1


def _alike(feeds: Sequence[float]) -> int:
    """Return how many moves feed about as much per mm as the median of those that feed."""
    fed = [math.log(feed) for feed in feeds if feed > 0.0]
    middle = median(fed) if fed else 0.0
    return sum(abs(feed - middle) < math.log(_ALIKE) for feed in fed)


# Points that a move leads through.
Corners: TypeAlias = tuple[list[float], list[float]] | FloatArray


@final
class GcodeMoves:
    """The moves that may deposit, point to point; lives while a file is read.

    Args:
        name: of the file.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self.recorder = Recorder(name)
        self._places, self._lines, self._flags, self._frames = array("d"), array("q"), array("B"), array("q")
        self.seen = 0
        # Why the place is not known where a move begins or ends, by its line.
        self._unknown: dict[int, str] = {}

    def add(self, number: int, corners: Corners, flags: int, frames: tuple[int, int], why: str) -> None:
        """Add a move through its corners."""
        self.seen |= flags
        if why:
            self._unknown.setdefault(number, why)
        if len(corners) == 2:
            self._places.extend([*corners[0], *corners[1]])
            self._lines.append(number)
            self._flags.append(flags)
            self._frames.extend(frames)
            return
        points = np.asarray(corners, dtype=np.float64)
        count = len(points) - 1
        self._places.frombytes(np.hstack([points[:-1], points[1:]]).tobytes())
        self._lines.extend([number] * count)
        self._flags.extend([flags] * count)
        self._frames.extend([*frames] * count)

    def runs(self, bits: int, *, approach: bool) -> int:
        """Record the moves that have all of some bits, and return how many of them begin where nobody knows.

        Args:
            bits: of their flags.
            approach: whether such moves are left out wherever they are: G1 leads to a part too.

        Raises:
            InputError: the place of one is not known, or in another frame; names its line.
        """
        flags = np.frombuffer(self._flags, dtype=np.uint8)
        rows = np.flatnonzero((flags & bits) == bits)
        places = np.frombuffer(self._places, dtype=np.float64).reshape(-1, 2, 3)[rows]
        lines = np.frombuffer(self._lines, dtype=np.int64)[rows]
        frames = np.frombuffer(self._frames, dtype=np.int64).reshape(-1, 2)[rows]
        unknown: BoolArray = np.asarray(np.isnan(places).any(axis=2))
        for row in np.flatnonzero(unknown.any(axis=1)).tolist():
            line = int(lines[row])
            why = self._unknown.get(line, "")
            if unknown[row, 1] or (why and not approach):
                refuse(self._name, line, why or "it deposits before all of X, Y and Z have a value")
        known = ~unknown[:, 0]
        places, lines, frames = places[known], lines[known], frames[known]
        strange = (frames != frames[:1, :1]).any(axis=1) if len(frames) else np.zeros(0, dtype=bool)
        if strange.any():
            refuse(
                self._name,
                int(lines[int(np.argmax(strange))]),
                "deposits are in other coordinates than before, at an unknown offset. Give both offsets with G10 L2, "
                "or one part at a time",
            )
        self.recorder.lines(places[:, 0], places[:, 1])
        return len(known) - int(known.sum())
