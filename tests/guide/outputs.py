"""What the blocks of a page print, and the lines of it that the page quotes.

A block `output` behind a block of commands or of Python holds lines of what that prints, as a terminal of `WIDTH`
letters shows them, results and notes alike; `...` stands for lines that are left out. A block that prints results or is
refused has one. Which lines a page quotes is chosen by hand once; `renewed` gives them the figures of today.
"""

from __future__ import annotations

import io
import re
import shlex
import subprocess
import sys
from collections.abc import Generator, Iterable, Sequence
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, final

import pytest

from geoprint import cli
from geoprint.cli.terminal import fitted
from geoprint.distance import registry
from geoprint.guide import Block, Page, page_named, pages
from tests.guide.here import working_here
from tests.painting import painting_nothing

# Letters of a line of the terminal that pages show.
WIDTH = 80
# Pages that go on with what another one has written, behind that one.
GO_ON = {"your-cell": ("calibrate", "fine-lines", "controller", "checks", "simulate")}
LEFT_OUT = "...\n"
# Stands where a line goes on below itself.
GOES_ON = "\x1f"
# Exit status of what runs, and of what is refused.
FINE, REFUSED = (0,), (2, 3, 4)
_FIGURE = re.compile(r"[-+]?\d+(?:[.,]\d+)*(?: ?%)?")


class Ran(NamedTuple):
    """A block that ran.

    Attributes:
        block: of commands or of Python.
        printed: the lines of all that it printed, results and notes, without how far it was; one that is too long for
            the terminal goes on below itself.
        needs: whether the page has to quote it: Python or geoprint printed results, or it is refused.
        quoted: lines that the page quotes, or None.
    """

    block: Block
    printed: Sequence[str]
    needs: bool
    quoted: str | None


def sequences() -> list[Sequence[Page]]:
    """Return the pages, those that go on with another one behind it, in the order in which they run."""
    every = [page for page in pages() if not page.is_generated]
    behind = {name for names in GO_ON.values() for name in names}
    return [
        [page, *map(page_named, GO_ON.get(page.name, ()))] for page in every if page.name not in behind
    ]  # fmt: skip


def ran(page: Page, folder: Path) -> Sequence[Ran]:
    """Run the blocks of a page in their order, as somebody does who reads it in a clone.

    Args:
        page: to run.
        folder: where its files are written; `data` stands in it.

    Raises:
        RuntimeError: a command ends otherwise than the page says.
    """
    found, names = list[Ran](), dict[str, object](__name__="__main__")
    with _here(folder):
        for block, following in pairwise([*page.blocks, None]):
            assert block is not None
            if block.word and block.word != "refused":
                (folder / block.word).write_text(block.text, encoding="utf-8")
            if block.language in {"python", "sh"}:
                quoted = following.text if following is not None and following.language == "output" else None
                found.append(_ran(block, quoted, names, at=page.name))
    return found


def _ran(block: Block, quoted: str | None, names: dict[str, object], *, at: str) -> Ran:
    """Run one block of a page."""
    every, results = io.StringIO(), io.StringIO()
    with redirect_stdout(_Both(every, results)), redirect_stderr(every):
        if block.language == "python":
            exec(compile(block.text, f"{at}.md", "exec"), names)  # noqa: S102  (our own text)
        for line in commands(block.text) if block.language == "sh" else []:
            status = _status_of(line)
            if status not in (REFUSED if block.word == "refused" else FINE):
                raise RuntimeError(f"{at}: {line}\nended with {status}:\n{every.getvalue()}")
    printed = [line.replace(GOES_ON, "\n") for line in re.findall(r".*\n", every.getvalue())]
    return Ran(block, printed, bool(results.getvalue()) or block.word == "refused", quoted)


def commands(text: str) -> list[str]:
    """Return the lines of a block of commands; what ends in a backslash goes on in the next."""
    return text.replace("\\\n", " ").splitlines()


@contextmanager
def _here(folder: Path) -> Generator[None]:
    """Work in a folder and in this process; what a page registers is gone when it ends."""
    with pytest.MonkeyPatch.context() as patch, chdir(folder), working_here(), painting_nothing():
        patch.setattr(registry._KNOWN, "_own", dict(registry._KNOWN._own))  # pyright: ignore[reportPrivateUsage]
        patch.setenv("COLUMNS", str(WIDTH))
        patch.setattr("geoprint.cli.terminal.fitted", _broken)
        # How far a command is differs from machine to machine.
        patch.setattr("geoprint.cli.bounds.PATIENCE", 3600.0)
        # Of the poses of a camera that are tried fewer are enough here.
        patch.setattr("geoprint.inspection.outline_pose.COARSE", 40)
        patch.setattr("geoprint.inspection.outline_pose.FINE", 6)
        yield


@final
class _Both(io.TextIOBase):
    """A stream that writes to two."""

    def __init__(self, *streams: io.StringIO) -> None:
        super().__init__()
        self._streams = streams

    def write(self, text: str, /) -> int:
        return max(stream.write(text) for stream in self._streams)


def _broken(text: str, _width: int | None) -> str:
    """Return a text as a terminal shows it, with a mark where a line goes on below itself."""
    return "\n".join(fitted(line, WIDTH).replace("\n", GOES_ON) for line in text.split("\n"))


def _status_of(line: str) -> int:
    """Run a line of a page and return its exit status."""
    if not line.startswith("geoprint "):
        done = subprocess.run(["/bin/bash", "-c", line], capture_output=True, text=True, check=False)
        # No result of geoprint.
        sys.stderr.write(done.stdout + done.stderr)
        return done.returncode
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", shlex.split(line))
        try:
            cli.main()
        except SystemExit as end:
            return int(end.code or 0)
    raise AssertionError("the command line ended without a status")


def is_quoted(quoted: str, printed: str) -> bool:
    """Say whether lines stand in what is printed, from its first line to its last, but for those left out."""
    parts = [re.escape(part) for part in re.split(rf"^{re.escape(LEFT_OUT)}", quoted, flags=re.MULTILINE)]
    return re.fullmatch(r"(?:.*\n)*?".join(parts), printed) is not None


def renewed(quoted: str, printed: Sequence[str]) -> str:
    """Return quoted lines as they are printed now.

    A line is found again by all of it but its figures, or else by what stands before the first of them.

    Raises:
        ValueError: one is not found behind those before it; choose another by hand.
    """
    at, chosen = 0, list[str]()
    for row in quoted.splitlines(keepends=True):
        if row == LEFT_OUT:
            continue
        skipped = _found_again(row, printed[at:])
        if skipped is not None:
            chosen += [LEFT_OUT] * (skipped > 0) + [printed[at + skipped]]
            at += skipped + 1
        elif not chosen or not row.startswith("  "):
            raise ValueError(f"no line is printed like this one:\n{row}in\n{''.join(printed)}")
    return "".join([*chosen, *[LEFT_OUT] * (at < len(printed))])


def with_outputs(text: str, blocks: Iterable[Ran]) -> str:
    """Return the text of a page with what its blocks print now; all of it where lines are still to be chosen."""
    done, rest = "", text
    for each in blocks:
        before, block, rest = rest.partition(f"\n{each.block.text}```\n")
        done += before + block
        if each.quoted is not None:
            before, fence, rest = rest.partition("```output\n")
            done += before + fence + renewed(each.quoted, each.printed)
            rest = rest.removeprefix(each.quoted)
        elif each.needs:
            done += f"\n```output\n{''.join(each.printed)}```\n"
    return done + rest


def _found_again(row: str, printed: Sequence[str]) -> int | None:
    """Return which line begins with a row that is like this one, or None."""
    rows = [line.partition("\n")[0] for line in printed]
    for likeness in (_whole, _without_figures, _label):
        wanted = likeness(row.rstrip("\n"))
        if wanted is not None and wanted in (found := [likeness(each) for each in rows]):
            return found.index(wanted)
    return None


def _whole(row: str) -> str | None:
    return row


def _without_figures(row: str) -> str | None:
    return re.sub("-{3,}", "---", _FIGURE.sub("#", " ".join(row.split())))


def _label(row: str) -> str | None:
    """Return what stands before the first figure; None where a line goes on that began above."""
    return _FIGURE.split(" ".join(row.split()))[0] or None if not row.startswith("  ") else None
