"""Paths as G-code: an interpreter of blocks with modal groups, as RS274/NGC has them [Kramer2000].

A block is parsed into words, its modes are set in the standard's order of execution, then it moves. Deposited is what
the extruder feeds; where no E is written, where M-codes are on (M3 or M4 and M5, M101 and M103, or those that are
named); and where there are none, G1, G2 and G3 deposit and G0 travels. What can change where the tool goes is obeyed
or refused with its line; what cannot is skipped and counted.

Places are kept with the frame that they are known in. The zero of G54 lies where a controller's memory has it, a home
where its maker put it: a place behind these is only compared with places of the same frame.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from pathlib import Path
from typing import final

import numpy as np

from geoprint.errors import UsageError
from geoprint.model import FloatArray, reading
from geoprint.toolpath_files.gcode_blocks import (
    MM_PER_INCH,
    MOST_CHORDS,
    Block,
    chords,
    full_turn,
    parse_block,
    round_axis,
    turn_to,
    without_comments,
    without_slash,
)
from geoprint.toolpath_files.gcode_state import (
    COMMAND,
    DIALECTS,
    ENDS,
    GROUPS,
    LOSING,
    MACHINES,
    MOTIONS,
    PLANES,
    PRINTER_M,
    PRINTERS,
    PROBING,
    QUIET,
    REFUSED_COMMANDS,
    REFUSED_M,
    REFUSED_STORED,
    ROTARY,
    SETTERS,
    SKIPPED,
    SWITCHES,
    SYSTEMS,
    Corners,
    Deposit,
    Extruder,
    GcodeMoves,
    Guess,
    Places,
    flavour_of,
    guess_dialect,
)
from geoprint.toolpath_files.path_file import FARTHEST, PathFile, lines_of, refuse

TITLE = "G-code"
_AXES = "XYZ"
_CENTRES = "IJK"
# Letters that a straight move may have; what else stands there would change where it leads.
_BESIDE_MOVES = frozenset("EFSTNHDPXYZ") | ROTARY
_BESIDE_ARCS = _BESIDE_MOVES | frozenset("IJKR")
_STRAIGHT = ("G0", "G1")
_MOVE_LINES, _MOVE_CURVES = frozenset("XYZ"), frozenset("XYZIJKR")
_COUNTED = frozenset("FSTHDP")
# An arc's ends may lie at distances from its centre that differ by so much [mm], and by this share of them.
_OUT_OF_ROUND, _SPIRAL = 0.05, 0.001
_MOST_TURNS = 1_000
# Bytes by which the dialect is guessed.
_HEAD = 400_000
_LOOKS = re.compile(
    r"^[ \t/]*(?:N[ \t]*\d+[ \t]*)?(?:[MTSF][ \t]*\d+(?:\.\d+)?[ \t]+)*G\d+(?:\.\d)?(?=[ \t(;*\r]|[A-Z]|$)",
    re.IGNORECASE | re.MULTILINE,
)
_TEXT = re.compile(r"[ \t]*(?:N[ \t]*\d+[ \t]*)?M0*(\d+)(\.\d)?(?![\d.])", re.IGNORECASE)
# What a move would have behind an M-code.
_MOVING = re.compile(r"[GXYZ][ \t]*[-+.]?\d", re.IGNORECASE)
# Levelling of printers, whose words, bare letters among them, differ by firmware.
_LEVELLING = re.compile(r"[ \t]*(?:N[ \t]*\d+[ \t]*)?G0*29(?![\d.])", re.IGNORECASE)
_SUBPROGRAM = re.compile(r"O[ \t]*(?:<|\d{1,8}[ \t]*[A-Z])", re.IGNORECASE)
_PROGRAM = re.compile(r"[O:][ \t]*\d{1,8}", re.IGNORECASE)
# Bits of a move behind those of the extruder's readings: an M-code is on; it is no G0.
_ON, _FEEDS = 64, 128


def is_gcode(head: str) -> bool:
    """Return whether a text holds a block with a G-code."""
    return _LOOKS.search(head) is not None


def read_gcode(path: Path, *, deposit: str | None, dialect: str | None = None) -> PathFile:
    """Read the deposited runs of G-code.

    Args:
        path: of the file.
        deposit: M-codes that switch on and off, as M3/M5 or M42 P4 S255/S0, or the letter of the axis that extrudes;
            None to tell by what the file holds.
        dialect: one of DIALECTS; None to guess it by what the file holds.

    Raises:
        UsageError: what deposits is not named so, or the dialect is not known.
        InputError: it cannot be read, or moves as is not known here; names its line.
    """
    if dialect is not None and dialect not in DIALECTS:
        raise UsageError(f"`--dialect {dialect}` is not known; known are {', '.join(DIALECTS)}.")
    with path.open("rb") as stream:
        head = stream.read(_HEAD).decode("utf-8-sig", errors="replace")
    guess = Guess(dialect, "", sure=True) if dialect is not None else guess_dialect(head)
    program = _Program(path.name, guess, Deposit(deposit))
    for number, line in lines_of(path):
        program.line(number, line)
    return program.file()


@final
class _Program:
    """Executes a program block by block; lives while a file is read.

    Args:
        name: of the file.
        guess: its dialect.
        deposit: what deposits.
    """

    def __init__(self, name: str, guess: Guess, deposit: Deposit) -> None:
        self._name, self._guess, self._deposit = name, guess, deposit
        self._dialect = guess.dialect
        self._printer = guess.dialect in PRINTERS
        self._places, self._extruder, self._moves = Places(), Extruder(), GcodeMoves(name)
        self._used: Counter[str] = Counter()
        self._skipped: Counter[str] = Counter()
        self._assumed: dict[str, None] = {}
        self._scale, self._units_said = 1.0, False
        self._plane, self._motion = PLANES["G17"], ""
        self._relative = self._absolute_centres = self._lengths = False
        self._switched, self._power = False, math.inf
        self._ended, self._chords = "", 0
        self._percents = self._programs = 0
        # Axes that stand at a home.
        self._homed: set[int] = set()
        # Axes whose coordinates G52 has moved.
        self._locals = [False] * 3

    def line(self, number: int, line: str) -> None:
        """Execute a line."""
        if self._ended:
            self._skipped[f"lines behind {self._ended}"] += bool(line.strip())
            return
        if ";" in line and "flavor" in line.lower():
            self._hear(flavour_of(line), "from a comment")
        words = _TEXT.match(line) if self._printer else None
        if words is not None and self._takes_all(words[1], line[words.end() :]):
            self._skipped[f"M{words[1]}{words[2] or ''}"] += 1
            return
        if self._printer and _LEVELLING.match(line):
            self._skipped["G29"] += 1
            self._lose(f"the position of the head is unknown after G29 in line {number}")
            return
        text, deleted = without_slash(without_comments(self._name, number, line))
        if deleted:
            self._used["blocks with a slash"] += 1
            self._assumed["block delete off: blocks with a slash are executed"] = None
        if text and not self._is_frame(number, text):
            self._execute(
                parse_block(self._name, number, text, no_extruder=self._dialect in MACHINES and not self._guess.why)
            )

    def _hear(self, flavour: str | None, why: str) -> None:
        """Heed what tells the firmware, if nobody named it."""
        if flavour is not None and self._guess.why and self._printer:
            self._guess = Guess(flavour, why, sure=True)

    def _takes_all(self, digits: str, behind: str) -> bool:
        """Return whether an M-code that begins a line takes all words behind it, as those of printers do."""
        code = f"M{digits}"
        if int(digits) < PRINTER_M and _MOVING.search(behind.partition(";")[0]):
            return False
        return code not in {"M82", "M83"} | self._deposit.codes and code not in REFUSED_M

    def _is_frame(self, number: int, text: str) -> bool:
        """Execute what is no block of words: percent signs, program numbers, and extended commands of printers."""
        if text[0] == "%":
            self._percents += 1
            self._ended = "the second %" if self._percents > 1 else ""
            return True
        if text[0].isalpha() and (len(text) == 1 or not (text[1].isalpha() or text[1] in "_<")) and text[0] not in "oO":
            return False
        if _SUBPROGRAM.match(text):
            refuse(
                self._name,
                number,
                f"{text[:20]!r}: subprograms, loops and branches (O) are not run; export plain moves",
            )
        if _PROGRAM.fullmatch(text):
            self._programs += 1
            if self._programs > 1:
                refuse(self._name, number, f"{text[:20]} begins a second program; give one program a file")
            return True
        match = COMMAND.match(text)
        if match is None or not self._printer:
            return False
        command = match[0].upper()
        if command in REFUSED_COMMANDS:
            refuse(self._name, number, f"{command} moves the coordinates; export without it")
        self._skipped[command] += 1
        self._hear(None if self._guess.sure else "klipper", f"from commands such as {command}")
        if not command.startswith(QUIET):
            self._assumed["extended commands leave units, modes and offsets alone"] = None
            self._lose(f"the position of the head is unknown after {command} in line {number}")
        return True

    def _execute(self, block: Block) -> None:
        """Execute a block in the order of RS274/NGC."""
        if block.exponents:
            self._used["numbers with an exponent"] += block.exponents
        # Most blocks of a long file hold coordinates of a straight move alone.
        if not (block.codes or block.switches) and self._motion in _STRAIGHT and block.words.keys() <= _MOVE_LINES:
            if block.words:
                self._go(block, [axis for axis, letter in enumerate(_AXES) if letter in block.words], curved=False)
            return
        self._check(block)
        late: list[str] = []
        for code in block.switches:
            # What ends something a Fanuc does behind the move.
            if code in ENDS or (self._dialect == "fanuc" and SWITCHES.get(code) is False):
                late.append(code)
            else:
                self._switch(block, code)
        if "S" in block.words and not set(block.switches) - set(SWITCHES) and block.words["S"] is not None:
            self._power = block.words["S"]
        setter = self._set_modes(block) if block.codes else ""
        self._move(block, setter)
        for code in late:
            if code not in ENDS:
                moves = any(letter in block.words for letter in _AXES)
                self._assume(["M5 behind the move of its block"] if moves else [])
            self._switch(block, code)

    def _check(self, block: Block) -> None:
        """Refuse words that move the part, codes that are not known, and two codes of one group."""
        groups: set[str] = set()
        for code in block.codes:
            group = GROUPS.get(code)
            if group is None and code not in SKIPPED | PROBING and not (code in LOSING and self._printer):
                refuse(
                    self._name,
                    block.number,
                    f"{code} is not read, and it may move the tool or the part; export straight moves and arcs in the "
                    "part's coordinates (G1, G2, G3)",
                )
            if group is not None and group in groups:
                refuse(self._name, block.number, f"it holds two {group}; write one in a block")
            groups.add(group or "")
        for letter in block.words.keys() & ROTARY - {self._deposit.extruder}:
            value = block.words[letter]
            if value:
                refuse(
                    self._name,
                    block.number,
                    f"{letter}{value:g} moves the part or the tool in a way that is not in the file. Export the paths "
                    f"in the part's coordinates, or name an extruder on {letter} with `--deposit {letter}`",
                )
            self._skipped[f"{letter}0"] += 1

    def _switch(self, block: Block, code: str) -> None:
        """Execute an M-code."""
        if code in self._deposit.codes:
            value = self._deposit.switched(self._name, block, code)
            if value is not None:
                self._switched = value
                self._used[code] += 1
                return
        if code in {"M82", "M83"}:
            self._extruder.extruder_mode(relative=code == "M83")
        elif code in ENDS and (not self._printer or code == "M99"):
            self._ended = code
        elif code in REFUSED_M or (code in REFUSED_STORED and not self._printer):
            reason = REFUSED_M.get(code, "stores and restores modes")
            refuse(self._name, block.number, f"{code} {reason}; write out what it does")
        else:
            self._skipped[code] += 1

    def _set_modes(self, block: Block) -> str:
        """Execute the modes of a block, and return the code that uses its coordinates in place of a move."""
        # Units come before what has lengths.
        for code in sorted(block.codes, key=lambda code: GROUPS.get(code) != "units"):
            self._set_mode(block, code)
        for code in block.codes:
            if code in {"G92.1", "G92.2"}:
                self._places.cancel(forget=code == "G92.1")
            elif code == "G92.3":
                self._places.restore()
        setter = next((code for code in block.codes if code in SETTERS | LOSING or code == "G4"), "")
        if setter:
            self._set(block, setter)
        return setter

    def _set_mode(self, block: Block, code: str) -> None:
        match GROUPS.get(code):
            case "units":
                self._scale, self._units_said = MM_PER_INCH if code == "G20" else 1.0, True
            case "planes":
                self._plane = PLANES[code]
            case "tool lengths":
                self._length(block, code)
            case "coordinate systems":
                self._places.select(SYSTEMS[code])
            case "distance modes":
                self._relative = code == "G91"
                self._extruder.distance_mode(relative=self._relative)
            case "modes of arcs":
                self._absolute_centres = code == "G90.1"
            case None if code in SKIPPED:
                self._skipped[code] += 1
                self._motion = "" if code == "G80" else self._motion
            case _:
                pass

    def _length(self, block: Block, code: str) -> None:
        """Execute G43 or G49: the tip's height behind it is known when Z is said again."""
        if code == "G43" or self._lengths:
            self._places.lose(2, f"{code} in line {block.number} changes the tool's length, and Z is not said again")
        self._lengths = code == "G43"
        self._skipped[code] += 1

    def _set(self, block: Block, code: str) -> None:
        """Execute a code that uses the coordinates of its block itself."""
        words = block.words
        named = [axis for axis in range(3) if _AXES[axis] in words]
        if any(each in MOTIONS for each in block.codes) and (named or code == "G10"):
            refuse(self._name, block.number, f"{code} and a move both use its coordinates; write them in two blocks")
        match code:
            case "G28" | "G30":
                self._home(block, code, named)
            case "G28.1" | "G30.1":
                self._places.keep(code[:-2])
            case "G10":
                self._set_system(block, named)
            case "G92":
                self._rename(block, named)
            case "G52":
                self._shift(block, named)
            case "G4":
                pass
            case _:
                self._skipped[code] += 1
                for axis in named if code in PROBING else range(3):
                    self._places.lose(axis, f"the position of the tool is unknown after {code} in line {block.number}")

    def _shift(self, block: Block, named: list[int]) -> None:
        """Execute G52."""
        self._used["offsets"] += 1
        for axis in named:
            if self._dialect != "linuxcnc" and self._places.is_renamed(axis) and not self._locals[axis]:
                refuse(self._name, block.number, "controllers differ in G52 where G92 holds; cancel G92 before (G92.1)")
            self._places.add(axis, self._length_of(block, _AXES[axis]))
            self._locals[axis] = True

    def _home(self, block: Block, code: str, named: list[int]) -> None:
        """Execute G28 or G30: through a place, where coordinates stand, to one that the controller knows."""
        if self._switched and self._deposit.named:
            refuse(self._name, block.number, f"{code} while it deposits leads where the file does not say")
        self._used["homings"] += 1
        why = f"{code} in line {block.number} left the tool where the file does not say"
        if self._printer and code == "G30":
            self._lose(why)
            return
        for axis in named or range(3):
            if self._printer:
                self._places.home(axis)
                self._homed.add(axis)
                continue
            if block.words.get(_AXES[axis]) is None and named:
                refuse(self._name, block.number, f"{_AXES[axis]} has no number")
            self._places.recall(code, axis, why)

    def _set_system(self, block: Block, named: list[int]) -> None:
        """Execute G10."""
        words = block.words
        which = words.get("L")
        if which is None or which not in {2.0, 20.0}:
            # Firmwares retract by a bare G10 or set temperatures; L1 and its like fill the table of tools.
            if (which is None and (named or not self._printer)) or (
                which is not None and which not in {1.0, 10.0, 11.0}
            ):
                refuse(self._name, block.number, "G10 is read with L2 and L20 only; give offsets by these")
            self._skipped["G10"] += 1
            return
        if words.get("R"):
            refuse(self._name, block.number, "G10 with R turns the coordinates; export the paths as the part lies")
        system = words.get("P")
        if system is None or system not in {float(each) for each in range(10)}:
            refuse(self._name, block.number, "G10 needs P with the number of a coordinate system, 1 to 9")
        self._used["offsets"] += 1
        for axis in named:
            value = self._length_of(block, _AXES[axis])
            if which == 20.0:
                self._places.name_in_system(int(system), axis, value)
            elif self._relative and self._dialect == "fanuc":
                self._places.move_system(int(system), axis, value)
            else:
                self._places.put_system(int(system), axis, value)

    def _rename(self, block: Block, named: list[int]) -> None:
        """Execute G92."""
        letter = self._deposit.extruder
        if not named and letter not in block.words:
            if not self._printer:
                if block.words.keys() & ROTARY or "S" in block.words:
                    return
                refuse(self._name, block.number, "G92 names no axis")
            named = [0, 1, 2]
            self._extruder.rename(0.0)
        elif letter in block.words:
            self._extruder.rename((block.words[letter] or 0.0) * self._scale)
        for axis in named:
            bare = block.words.get(_AXES[axis]) is None and self._printer
            self._places.name_here(axis, 0.0 if bare else self._length_of(block, _AXES[axis]))
            self._locals[axis] = False
        self._used["G92"] += 1

    def _length_of(self, block: Block, letter: str) -> float:
        """Return the length that a word gives [mm].

        Raises:
            InputError: it has no number, or a larger one than any part has.
        """
        value = block.words[letter]
        if value is None:
            refuse(self._name, block.number, f"{letter} has no number")
        value *= self._scale
        if abs(value) > FARTHEST:
            refuse(self._name, block.number, f"{letter} is {value:g} mm, allowed are {FARTHEST:g}")
        return value

    def _lose(self, why: str) -> None:
        for axis in range(3):
            self._places.lose(axis, why)

    def _move(self, block: Block, setter: str) -> None:
        """Execute the move of a block."""
        said = next((code for code in block.codes if code in MOTIONS), "")
        self._motion = said or self._motion
        if setter:
            return
        words = block.words.keys()
        for letter in words & _COUNTED:
            self._skipped[letter] += 1
        curved = self._motion in {"G2", "G3"}
        # M67 and its like have an E of their own.
        moving = bool(words & (_MOVE_CURVES if curved else _MOVE_LINES))
        if not block.switches or not set(block.switches) - {"M82", "M83"} - set(SWITCHES):
            moving |= self._deposit.extruder in words
        if not moving and not (said and curved):
            return
        if not self._motion:
            refuse(self._name, block.number, "it has coordinates, but no code before says how to move (G0, G1, G2, G3)")
        odd = words - (_BESIDE_ARCS if curved else _BESIDE_MOVES)
        if odd:
            refuse(self._name, block.number, f"{self._motion} has no word {min(odd)}, and it may change where it leads")
        named = [axis for axis in range(3) if _AXES[axis] in words]
        if self._printer and not curved and block.words.get("H"):
            for axis in named:
                self._places.lose(axis, f"H in line {block.number} moves to an endstop")
            return
        self._go(block, named, curved=curved)

    def _go(self, block: Block, named: list[int], *, curved: bool) -> None:
        """Move to the coordinates of a block."""
        places, number = self._places, block.number
        machine = "G53" in block.codes
        if machine and (curved or self._relative):
            refuse(self._name, number, "G53 is for straight moves to absolute coordinates (G0, G1, G90)")
        start, before = list(places.here), places.frame()
        relative = self._step(block, named, machine=machine)
        end = list(places.here)
        lost = ""
        if any(places.why):
            lost = next((why for why, value in zip(places.why, start, strict=True) if why and math.isnan(value)), "")
            for axis in named:
                if not math.isnan(end[axis]):
                    places.why[axis] = ""
        corners: Corners = (start, end)
        if curved:
            corners = self._along(block, start, end, same=before == places.frame())
        elif relative or start != end:
            self._moves.recorder.count(number)
        flags = self._fed(block, corners)
        if curved or relative or start != end:
            self._keep(number, corners, flags, (before, places.frame()), relative or lost)

    def _step(self, block: Block, named: list[int], *, machine: bool) -> str:
        """Take the tool to the coordinates of a block; return why a distance leads nobody knows where, if one does."""
        places, why = self._places, ""
        for axis in named:
            value = self._length_of(block, _AXES[axis])
            if not self._relative:
                places.put(axis, value, machine=machine)
                self._homed.discard(axis)
            elif math.isnan(places.here[axis]):
                cause = f" ({places.why[axis]})" if places.why[axis] else ""
                why = why or f"it moves {_AXES[axis]} by a distance, but from where nothing before has said{cause}"
            else:
                places.here[axis] += value
        return why

    def _fed(self, block: Block, corners: Corners) -> int:
        """Return the bits of a move: which readings of E feed, whether a switch is on, whether it is no G0."""
        bits = 0
        letter = self._deposit.extruder
        if letter in block.words:
            straight = len(corners) == 2
            length = math.dist(*corners) if straight else float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum())
            bits = self._extruder.feed(self._length_of(block, letter), 0.0 if math.isnan(length) else length)
        power = self._power != 0.0 or self._deposit.named
        return bits + _ON * (self._switched and power) + _FEEDS * (self._motion != "G0")

    def _keep(self, number: int, corners: Corners, flags: int, frames: tuple[int, int], why: str) -> None:
        """Note a move that may deposit."""
        self._used["arcs" if self._motion in {"G2", "G3"} else "moves"] += 1
        if self._homed and flags:
            self._assumed["G28 leads to 0 of each axis"] = None
        if flags:
            self._moves.add(number, corners, flags, frames, why)

    def _along(self, block: Block, start: list[float], end: list[float], *, same: bool) -> Corners:
        """Return the points of an arc; its two ends alone where the places of these are not known."""
        words, number = block.words, block.number
        first, second, third = self._plane
        given = [letter for letter in _CENTRES if letter in words]
        if "R" in words and given:
            refuse(self._name, number, f"{self._motion} has both R and {given[0]}; write one of them")
        turns = words.get("P") if "P" in words else 1.0
        if turns is None or turns not in range(1, _MOST_TURNS):
            refuse(
                self._name, number, f"{self._motion} has P for a number of turns, which must be 1 to {_MOST_TURNS - 1}"
            )
        if not same or any(math.isnan(value) for value in (*start, *end)):
            self._moves.recorder.count(number)
            return start, end
        a, b = np.array(start), np.array(end)
        clockwise = self._motion == "G2"
        centre = self._by_radius(block, a, b, clockwise=clockwise) if "R" in words else self._by_offsets(block, a)
        arm, last = a[[first, second]] - centre, b[[first, second]] - centre
        radii = float(np.hypot(*arm)), float(np.hypot(*last))
        if min(radii) == 0.0 or abs(radii[0] - radii[1]) > _OUT_OF_ROUND + _SPIRAL * max(radii):
            refuse(
                self._name,
                number,
                f"the arc begins {radii[0]:.6g} mm from its centre and ends {radii[1]:.6g} mm from it; both must be "
                "equal. Check the plane (G17 to G19), I, J and K and their reference (G91.1, G90.1)",
            )
        axis = np.zeros(3)
        axis[third] = -1.0 if clockwise else 1.0
        middle = a.copy()
        middle[[first, second]] = centre
        angle = full_turn(turn_to(a, b, centre=middle, axis=axis), turns=int(turns))
        count = chords(angle, max(radii))
        self._chords += count
        if self._chords > MOST_CHORDS:
            refuse(self._name, number, f"arcs take more than {MOST_CHORDS} chords; give the paths of one part")
        self._moves.recorder.count(number, count)
        points = round_axis(a, centre=middle, axis=axis, angle=angle)
        # What is left climbs along the axis (a helix), and makes good what its radii differ by (a spiral).
        points += np.linspace(0.0, 1.0, len(points))[:, None] * (b - points[-1])
        points[0], points[-1] = a, b
        return points

    def _by_radius(self, block: Block, start: FloatArray, end: FloatArray, *, clockwise: bool) -> FloatArray:
        """Return the centre of an arc that has a radius; a negative one is for more than half a turn."""
        radius = self._length_of(block, "R")
        first, second, _ = self._plane
        chord = (end - start)[[first, second]]
        half = float(np.hypot(*chord)) / 2.0
        if half == 0.0 or half > abs(radius) + _OUT_OF_ROUND:
            refuse(
                self._name,
                block.number,
                f"no arc of radius {abs(radius):g} mm joins ends that lie {2.0 * half:.6g} mm apart; write I, J or K",
            )
        away = math.sqrt(max(radius**2 - half**2, 0.0)) / (2.0 * half)
        side = -1.0 if clockwise == (radius > 0.0) else 1.0
        return (start + end)[[first, second]] / 2.0 + side * away * np.array([-chord[1], chord[0]])

    def _by_offsets(self, block: Block, start: FloatArray) -> FloatArray:
        """Return the centre of an arc that has I, J or K."""
        axes = self._plane[:2]
        letters = [_CENTRES[axis] for axis in axes]
        stray = _CENTRES[self._plane[2]]
        if block.words.get(stray):
            refuse(
                self._name, block.number, f"{stray} is not of the plane of the arc; G17, G18 and G19 say which it is"
            )
        given = [letter for letter in letters if letter in block.words]
        if not given or (self._absolute_centres and len(given) < 2):
            refuse(
                self._name,
                block.number,
                f"{self._motion} needs {letters[0]} {'and' if self._absolute_centres else 'or'} {letters[1]}, or R",
            )
        offsets = np.array([self._length_of(block, letter) if letter in given else 0.0 for letter in letters])
        shift = np.array(self._places.shift)[list(axes)]
        return offsets + (shift if self._absolute_centres else start[list(axes)])

    def file(self) -> PathFile:
        """Return the moves that deposit as runs."""
        moves, deposit, extruder = self._moves, self._deposit, self._extruder
        reading_of_e = extruder.chosen(self._guess.dialect if self._guess.sure else "")
        by_feed = not deposit.by_code or (deposit.asked is None and bool(moves.seen & 1 << reading_of_e))
        if by_feed:
            bits, recorded = 1 << reading_of_e, f"growing {deposit.extruder}"
            self._assume(extruder.assumed(reading_of_e))
        elif deposit.named or moves.seen & _ON:
            bits, recorded = _ON | (0 if deposit.named else _FEEDS), "M-codes"
        else:
            bits, recorded = _FEEDS, "G1, while G0 travels"
        read = moves.recorder.read
        self._skipped["moves from an unknown place"] = moves.runs(bits, approach=bits == _FEEDS)
        moves.recorder.read = read
        guess = self._guess
        if extruder.mixed and by_feed and not guess.sure:
            guess = Guess(extruder.rule(reading_of_e), "from the moves", sure=True)
        self._assume([f"dialect {guess.dialect}, {guess.why}"] if guess.why else [])
        if not self._units_said and not self._printer:
            self._assume(["mm, as no G20 or G21 stands in it"])
        record = reading(used=self._used, skipped=self._skipped, assumed=self._assumed)
        return moves.recorder.file(title=TITLE, deposit=recorded, reading=record)

    def _assume(self, phrases: list[str]) -> None:
        self._assumed.update(dict.fromkeys(phrases))
