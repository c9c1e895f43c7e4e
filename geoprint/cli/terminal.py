"""What a person sees: lines that fit the terminal, marked by their weight; and what a program reads."""

from __future__ import annotations

import json
import os
import re
import sys
import textwrap
from collections.abc import Callable
from itertools import groupby
from typing import TextIO

from geoprint.errors import ExportError, reason_of

# A terminal is not narrower than this.
NARROWEST = 20
# What a terminal has that does not know its width.
USUAL = 80
# A line that has a label hangs below its text, where the label is no longer than this.
LONGEST_LABEL = 24
# Words at the beginning of a line that say its weight, with the colours of a terminal.
MARKS = {"geoprint": "1;31", "warning": "1;33", "note": "36", "not checked": "35"}

_MARK = re.compile(rf"^({'|'.join(MARKS)}): ")
_LABEL = re.compile(r"\s*\S+(?: \S+)*? {2,}(?=\S)|\s*")


def say(text: str) -> None:
    """Tell a person on stderr what is no result."""
    shown = fitted(_harmless(text), columns(sys.stderr))
    _write(coloured(shown) if has_colours(sys.stderr) else shown, sys.stderr)


def result(text: str, value: Callable[[], object], *, as_json: bool) -> None:
    """Print the result of a command on stdout, for people or for programs; its notes and warnings go to stderr.

    Args:
        text: of it, for people.
        value: returns what programs get.
        as_json: whether a program asks.
    """
    if as_json:
        print_json(value())
    for marked, lines in groupby(text.split("\n"), key=lambda line: _MARK.match(line) is not None):
        if marked:
            say("\n".join(lines))
        elif not as_json:
            show("\n".join(lines))


def show(text: str) -> None:
    """Print the result of a command that tells a person on stdout."""
    tell(fitted(_harmless(text), columns(sys.stdout)))


def _harmless(text: str) -> str:
    """Return a text that does not steer the terminal, whatever file it comes from."""
    return "".join(sign if sign.isprintable() or sign == "\n" else "\N{REPLACEMENT CHARACTER}" for sign in text)


def tell(text: str) -> None:
    """Print the result of a command as it stands.

    Raises:
        ExportError: stdout cannot take it; that nobody reads it any more is no error.
    """
    try:
        _write(text, sys.stdout)
    except OSError as error:
        raise ExportError(
            f"the result cannot be printed on stdout ({reason_of(error)}); give it another place."
        ) from error


def print_json(value: object) -> None:
    """Print an object for programs."""
    tell(json.dumps(value, indent=2))


def columns(stream: TextIO | None = None) -> int | None:
    """Return how many letters a line has, by COLUMNS or by the terminal; None where neither says it.

    Args:
        stream: that is written to; that of results if not given.
    """
    stream = stream or sys.stdout
    asked = os.environ.get("COLUMNS", "")
    # Closed streams are None. A refusal is one line where programs read it, whatever a shell passes on.
    if stream is None or (not stream.isatty() and (stream is sys.stderr or not asked.isdecimal())):  # pyright: ignore[reportUnnecessaryComparison]
        return None
    wide = int(asked) if asked.isdecimal() else os.get_terminal_size(stream.fileno()).columns
    return max(wide or USUAL, NARROWEST)


def fitted(text: str, width: int | None) -> str:
    """Return a text whose lines are broken between words where they are too long, the rest hanging below the first."""
    if width is None:
        return text
    return "\n".join(_broken(line, width) if len(line) > width else line for line in text.split("\n"))


def _broken(line: str, width: int) -> str:
    label = _LABEL.match(line)
    hanging = label.end() if label is not None and label.end() <= min(LONGEST_LABEL, width // 2) else 0
    if not line[:hanging].strip():
        hanging += 2
    unbroken = line.replace(" %", "\N{NO-BREAK SPACE}%")
    indent = " " * hanging
    lines = textwrap.wrap(unbroken, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace("\N{NO-BREAK SPACE}%", " %")


def has_colours(stream: TextIO | None) -> bool:
    """Say whether a terminal shows colours, and nobody objects: see no-color.org."""
    return (
        stream is not None and stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    )


def coloured(text: str) -> str:
    """Return a text whose marks at the beginning of lines are coloured by their weight."""
    return "\n".join(
        _MARK.sub(lambda found: f"\033[{MARKS[found[1]]}m{found[1]}:\033[0m ", line) for line in text.split("\n")
    )


def _write(text: str, stream: TextIO | None) -> None:
    """Write lines; where nobody reads them any more, as behind `| head`, the work goes on and its status counts."""
    if stream is None:
        return
    try:
        stream.write(f"{text}\n")
        stream.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
