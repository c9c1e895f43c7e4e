"""Which codes of G-code do what: modal groups, what moves nothing, what is refused, what deposits; and dialects."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, final

from geoprint.errors import UsageError
from geoprint.toolpaths.gcode_blocks import Block
from geoprint.toolpaths.path_file import refuse

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
    return Guess("linuxcnc", "as nothing tells another", sure=False)


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
                f"`--deposit {asked}` names no two M-codes and no axis; for G-code write what switches on and what "
                "off, as M3/M5 or M42 P4 S255/S0, or the letter of the axis that extrudes, as A."
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
