"""The pages of the guide as their files have them.

A page begins with what is said of it, a key a line between two lines of three hyphens:

    ---
    order: 10
    title: The first comparison
    summary: Which backend covers a part more evenly.
    ---

The rest is Markdown. Blocks of `sh` and `python` are run by the tests, one page after another in one folder; what `sh
refused` says ends in a refusal. A block with a second word (`toml job.toml`, `csv touched.csv`) is the file of that
name. Whatever else stands in a block (`text`, `console`) is only shown.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from typing import final

from geoprint.errors import UsageError
from geoprint.guide.names import names_text

# The page that is made from the docstrings.
NAMES = "names"
NAMES_SUMMARY = "What the library has, stage by stage, with shapes and units, as its docstrings say it."
_KEYS = ("order", "title", "summary")
_BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([\w-]+)\.md\)")
_PICTURE = re.compile(r"!\[([^\]]*)\]\(\.\./pictures/([^)\s]+)\)")


@final
@dataclass(frozen=True, slots=True)
class Block:
    """What stands between two fences of a page.

    Attributes:
        language: its first word.
        word: its second: the name of a file, or `refused`; empty where it has none.
        text: its lines.
    """

    language: str
    word: str
    text: str


@final
@dataclass(frozen=True, slots=True)
class Page:
    """One page of the guide.

    Attributes:
        name: that it is asked for by; that of its file.
        order: pages stand in ascending order.
        title: of the page, a few words.
        summary: one sentence.
        read: returns its Markdown, without the title.
    """

    name: str
    order: int
    title: str
    summary: str
    read: Callable[[], str]

    @property
    def text(self) -> str:
        """Its Markdown, without the title."""
        return self.read()

    @property
    def blocks(self) -> Sequence[Block]:
        """Its blocks in their order."""
        return [Block(*(each or "" for each in found.groups())) for found in _BLOCK.finditer(self.text)]

    @property
    def pictures(self) -> Sequence[tuple[str, str]]:
        """What its pictures show, in words, and their files."""
        return [(found[1], found[2]) for found in _PICTURE.finditer(self.text)]

    @property
    def in_words(self) -> str:
        """Its Markdown for a terminal: what a picture shows in words, and what a link leads to as a command."""
        text = _PICTURE.sub(r"*Picture: \1.*", self.text)
        return _LINK.sub(r"\1 (`geoprint guide \2`)", text)


@cache
def pages() -> tuple[Page, ...]:
    """Return the pages in their order; the last one lists the public names, made from the docstrings.

    Raises:
        ValueError: a page lacks what has to stand at its head.
    """
    written = (_read(file) for file in _folder("pages").iterdir() if file.name.endswith(".md"))
    ordered = sorted(written, key=lambda page: page.order)
    # Read only where it is asked for: it imports everything.
    last = Page(NAMES, ordered[-1].order + 1, "The public names", NAMES_SUMMARY, names_text)
    return (*ordered, last)


def page_named(name: str) -> Page:
    """Return a page by its name.

    Raises:
        UsageError: there is none; the sentence names those that there are.
    """
    for page in pages():
        if page.name == name:
            return page
    names = ", ".join(page.name for page in pages())
    raise UsageError(f"the guide has no page `{name}`; choose one of: {names}.")


def picture_bytes(name: str) -> bytes:
    """Return the file of a picture."""
    return (_folder("pictures") / name).read_bytes()


def _folder(name: str) -> Traversable:
    return resources.files("geoprint.guide") / name


def _read(file: Traversable) -> Page:
    """Read one page."""
    text = file.read_text(encoding="utf-8")
    marked, _, body = text.removeprefix("---\n").partition("\n---\n")
    head = dict(line.split(": ", 1) for line in marked.splitlines() if ": " in line)
    lacking = [key for key in _KEYS if not head.get(key, "").strip()]
    if lacking or not body.strip():
        raise ValueError(f"the page {file.name} of the guide lacks {', '.join(lacking) or 'a text'} at its head.")
    name, written = file.name.removesuffix(".md"), f"{body.strip()}\n"
    return Page(name, int(head["order"]), head["title"], head["summary"], lambda: written)
