"""Blocks of G-code: a line as its words; points along arcs."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import final

import numpy as np

from geoprint.model import FloatArray
from geoprint.toolpath_files.path_file import number_of, refuse

# Arcs: points along those of G-code (G2, G3), of APT (CIRCLE) and of RAPID (MoveC).


# Angle between points of an arc [rad]: on a radius of 20 mm its chords are within a micrometre.
STEP = np.radians(1.0)
# On large radii points are nearer: chords stay within this of the arc [mm].
SAGITTA = 0.001
# Chords of all arcs of a file: a short file of long arcs must not take minutes.
MOST_CHORDS = 2_000_000
# Ends of an arc that are nearer than this make it a full turn [rad], as in RS274/NGC.
CLOSED = 1e-6


def along_arc(start: FloatArray, through: FloatArray | None, end: FloatArray) -> FloatArray:
    """Return (k, 3) points of a straight line, or of the arc through another place [mm]."""
    if through is None:
        return np.stack([start, end])
    first, second = through - start, end - start
    normal = np.cross(first, second)
    square = float(normal @ normal)
    if square == 0.0:
        return np.stack([start, through, end])
    towards = np.cross((first @ first) * second - (second @ second) * first, normal)
    centre = start + towards / (2.0 * square)
    axis = normal / np.sqrt(square)
    points = round_axis(start, centre=centre, axis=axis, angle=turn_to(start, end, centre=centre, axis=axis))
    # A run goes on where the arc before it ends, without rounding.
    points[0], points[-1] = start, end
    return points


def turn_to(start: FloatArray, end: FloatArray, *, centre: FloatArray, axis: FloatArray) -> float:
    """Return by how much a start turns about an axis of length 1 to an end, counter-clockwise [rad], 0 to 2 pi."""
    x = start - centre
    return float(np.mod(np.arctan2((end - centre) @ np.cross(axis, x), (end - centre) @ x), 2.0 * np.pi))


def round_axis(
    start: FloatArray, *, centre: FloatArray, axis: FloatArray, angle: float, climb: float = 0.0
) -> FloatArray:
    """Return (k, 3) points of an arc from a start, as many as `chords` says.

    Args:
        start: where it begins.
        centre: a point of the axis.
        axis: of length 1.
        angle: by which it turns about the axis, counter-clockwise [rad], 0 or more.
        climb: how far it goes along the axis meanwhile.
    """
    foot = centre + ((start - centre) @ axis) * axis
    x = start - foot
    shares = np.linspace(0.0, 1.0, chords(angle, float(np.linalg.norm(x))) + 1)[:, None]
    turns = angle * shares
    return foot + np.cos(turns) * x + np.sin(turns) * np.cross(axis, x) + climb * shares * axis


def chords(angle: float, radius: float) -> int:
    """Return how many chords follow an arc [rad, mm]."""
    step = min(STEP, float(np.sqrt(8.0 * SAGITTA / max(radius, SAGITTA))))
    return max(int(np.ceil(angle / step)), 1)


def full_turn(angle: float, *, turns: int = 1) -> float:
    """Return the angle of an arc of G-code [rad]: a full turn where it would be none, and full turns besides.

    Args:
        angle: as `turn_to` returns it.
        turns: full turns that are begun, 1 or more.
    """
    closed = angle < CLOSED or angle > 2.0 * np.pi - CLOSED
    return (2.0 * np.pi if closed else angle) + 2.0 * np.pi * (turns - 1)


# Blocks of G-code: a line as the words that it holds, in the order and form that RS274/NGC and firmwares allow.
#
# A block may begin with a slash (block delete) and a line number; comments stand in parentheses or behind a
# semicolon, a checksum behind an asterisk. A word is a letter and a number, with blanks or none between.


MM_PER_INCH = 25.4
# Letters whose numbers are lengths. E is one where it feeds filament.
LENGTHS = frozenset("XYZIJKRUVWE")
# Letters of a number.
_LONGEST = 60
_WORD = re.compile(r"[ \t\r]*([A-Za-z])[ \t]*([-+]?(?:\d+\.?\d*|\.\d+))?")
# What may be the exponent of the number that it stands behind, or an E word.
_EXPONENT = re.compile(r"[eE][-+]?\d{1,3}(?![\d.])")
_PADDED = re.compile(r"[eE][-+]0\d")
_DELETED = re.compile(r"/[1-9]?(?!\d)")
# What makes a file parametric; nothing of it is evaluated.
_COMPUTED = re.compile(r"[#\[\]=]")


@final
@dataclass(slots=True)
class Block:
    """The words of a line; lives while it is executed.

    Attributes:
        number: of the line, from 1.
        codes: G-codes in their order, as "G90.1".
        switches: M-codes in their order, as "M3".
        words: the number behind each other letter, as it is written; None where there is none.
        exponents: numbers with an exponent.
    """

    number: int
    codes: list[str] = field(default_factory=list[str])
    switches: list[str] = field(default_factory=list[str])
    words: dict[str, float | None] = field(default_factory=dict[str, "float | None"])
    exponents: int = 0


def without_comments(name: str, number: int, line: str) -> str:
    """Return a line without comments and checksum.

    Args:
        name: of the file.
        number: of the line.
        line: its text.

    Raises:
        InputError: a parenthesis is not closed.
    """
    if "(" not in line:
        return line.partition(";")[0].partition("*")[0]
    kept: list[str] = []
    place = 0
    while True:
        begin, rest = line.find("(", place), line.find(";", place)
        if rest >= 0 and (begin < 0 or rest < begin):
            kept.append(line[place:rest])
            break
        if begin < 0:
            kept.append(line[place:])
            break
        end = line.find(")", begin)
        if end < 0:
            refuse(name, number, "a comment that begins with ( has no end; close it with )")
        kept.append(line[place:begin])
        place = end + 1
    return "".join(kept).partition("*")[0]


def without_slash(text: str) -> tuple[str, bool]:
    """Return a block without its slash, and whether it had one (block delete)."""
    text = text.strip()
    if not text.startswith("/"):
        return text, False
    match = _DELETED.match(text)
    return (text, False) if match is None else (text[match.end() :].strip(), True)


def parse_block(name: str, number: int, text: str, *, no_extruder: bool) -> Block:
    """Return the words of a block.

    Args:
        name: of the file.
        number: of the line.
        text: of the line, without comments.
        no_extruder: whether the dialect has no E words, so that an E behind a number is its exponent.

    Raises:
        InputError: something in it is no word, stands twice, or is computed.
    """
    computed = _COMPUTED.search(text)
    if computed is not None:
        refuse(
            name,
            number,
            f"{text[:40]!r} holds {computed[0]!r}: parameters and expressions are not evaluated; export plain numbers",
        )
    block = Block(number)
    place, first = 0, True
    while place < len(text):
        match = _WORD.match(text, place)
        if match is None:
            if not text[place:].strip():
                break
            refuse(name, number, f"{text[place:].strip()[:40]!r} is no word of G-code")
        letter, digits, place = match[1].upper(), match[2], match.end()
        if digits is not None and len(digits) > _LONGEST:
            refuse(name, number, f"{letter} has a number of {len(digits)} letters, allowed are {_LONGEST}")
        if digits and letter in LENGTHS and text[place : place + 1] in {"e", "E"}:
            end = _end_of_exponent(name, number, text, match, no_extruder=no_extruder)
            block.exponents += end > place
            digits, place = f"{digits}{text[place:end]}", end
        if letter != "N" or not first:
            _add(name, block, letter, digits)
        first = False
    return block


def _add(name: str, block: Block, letter: str, digits: str | None) -> None:
    """Add a word to a block."""
    if letter in {"G", "M"}:
        if digits is None or digits[0] in "+-":
            refuse(name, block.number, f"{letter} needs a number without a sign, as {letter}1")
        (block.codes if letter == "G" else block.switches).append(f"{letter}{float(digits):g}")
        return
    if letter in block.words:
        refuse(name, block.number, f"{letter} stands in it twice")
    block.words[letter] = None if digits is None else number_of(name, block.number, letter, digits)


def _end_of_exponent(name: str, number: int, text: str, match: re.Match[str], *, no_extruder: bool) -> int:
    """Return where a number ends that an E follows at once: behind an exponent, or before an E word.

    RS274/NGC knows no exponents and firmwares end the number at the E, but programs that print numbers as they come
    write them: Y3e-05. An exponent of two digits with a leading zero, or one in another case than the letter of its
    word, is nothing else; in a block without blanks an E begins a word.

    Raises:
        InputError: it may be either.
    """
    place = match.end()
    found = _EXPONENT.match(text, place)
    if found is None:
        return place
    if no_extruder or _PADDED.match(found[0]) or match[1].isupper() != found[0][0].isupper():
        return found.end()
    if any(sign.isspace() for sign in text.strip()):
        shown = text[match.start() : found.end()].strip()[:40]
        refuse(
            name,
            number,
            f"{shown!r} is a number with an exponent, or two words; write it without exponent, or a blank before E",
        )
    return place
