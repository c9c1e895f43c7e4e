"""Blocks of G-code: a line as the words that it holds, in the order and form that RS274/NGC and firmwares allow.

A block may begin with a slash (block delete) and a line number; comments stand in parentheses or behind a semicolon, a
checksum behind an asterisk. A word is a letter and a number, with blanks or none between.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import final

from geoprint.toolpaths.path_file import number_of, refuse

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
