"""The pages of the guide as their files have them.

They stand in four folders of `pages/`: tutorials, how-to, reference and explanation. A page begins with what is said
of it, a key a line between two lines of three hyphens:

    ---
    order: 10
    title: Compare two planners on one part
    summary: Which backend covers a part more evenly.
    ---

A `group` may be added: pages of a part with the same one stand together.

The rest is Markdown. Blocks of `sh` and `python` are run by the tests, one page after another in one folder; what `sh
refused` says ends in a refusal. A block with a second word (`toml job.toml`, `csv touched.csv`) is the file of that
name, and a block of `output` holds lines of what the block before it prints, `...` where others are left out. Whatever
else stands in a block (`text`, `console`) is only shown.
"""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from string import Template
from typing import final

from markdown_it import MarkdownIt

from geoprint.errors import UsageError
from geoprint.features import PAGE, Feature, features
from geoprint.guide.reference import GENERATED

# The parts of the guide: the folders that its pages stand in, with their headings.
PARTS = {"tutorials": "Tutorials", "how-to": "How-to", "reference": "Reference", "explanation": "Explanation"}
_KEYS = ("order", "title", "summary")
_BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_PAGE_LINK = re.compile(r"(?<!!)\[([^\]]*)\]\((?:\.\./[\w-]+/)?([\w-]+)\.md\)")
_PAGE_PICTURE = re.compile(r"!\[([^\]]*)\]\(\.\./\.\./(?:pictures|examples)/([^)\s]+)\)")


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
        part: of the guide, a key of PARTS.
        order: pages of a part stand in ascending order.
        title: of the page, a few words.
        summary: one sentence.
        group: of pages of its part that it stands with; empty where it stands alone.
        read: returns its Markdown, without the title.
    """

    name: str
    part: str
    order: int
    title: str
    summary: str
    group: str
    read: Callable[[], str]

    @property
    def is_generated(self) -> bool:
        """Whether it is made from the code, so that it stands in no file."""
        return any(name == self.name for _, _, name, *_ in GENERATED)

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
        return [(found[1], found[2]) for found in _PAGE_PICTURE.finditer(self.text)]

    @property
    def in_words(self) -> str:
        """Its Markdown for a terminal: what a picture shows in words, and what a link leads to as a command."""
        text = _PAGE_PICTURE.sub(r"*Picture: \1.*", self.text)
        return _PAGE_LINK.sub(r"\1 (`geoprint guide \2`)", text)


@cache
def pages() -> tuple[Page, ...]:
    """Return the pages in their order, part by part, those of features and those that are made from the code too.

    Raises:
        ValueError: a page lacks what has to stand at its head.
    """
    own = [_read(file, part=part) for part in PARTS for file in (_folder("pages") / part).iterdir()]
    added = [_read(file, of=feature) for feature in features() if (file := feature.folder / PAGE).is_file()]
    # Made only where they are asked for, which imports everything.
    made = [Page(name, part, order, title, summary, "", text) for part, order, name, title, summary, text in GENERATED]
    return tuple(sorted([*own, *added, *made], key=lambda page: ([*PARTS].index(page.part), page.order)))


def page_named(name: str) -> Page:
    """Return a page by its name.

    Raises:
        UsageError: there is none; the sentence names those that there are.
    """
    for page in pages():
        if page.name == name:
            return page
    names = [page.name for page in pages()]
    near = get_close_matches(name, names, n=1, cutoff=0.5)
    meant = f"did you mean `geoprint guide {near[0]}`?" if near else f"choose one of: {', '.join(names)}."
    raise UsageError(f"the guide has no page `{name}`; {meant}")


def picture_bytes(name: str) -> bytes:
    """Return the file of a picture."""
    return (_folder("pictures") / name).read_bytes()


def _folder(name: str) -> Traversable:
    return resources.files("geoprint.guide") / name


def _read(file: Traversable, *, part: str = "how-to", of: Feature | None = None) -> Page:
    """Read one page; that of a feature bears the name of its folder."""
    text = file.read_text(encoding="utf-8")
    marked, _, body = text.removeprefix("---\n").partition("\n---\n")
    head = dict(line.split(": ", 1) for line in marked.splitlines() if ": " in line)
    lacking = [key for key in _KEYS if not head.get(key, "").strip()]
    if lacking or not body.strip():
        raise ValueError(f"the page {file.name} of the guide lacks {', '.join(lacking) or 'a text'} at its head.")
    name, written = file.name.removesuffix(".md") if of is None else of.folder.name, f"{body.strip()}\n"
    return Page(name, part, int(head["order"]), head["title"], head["summary"], head.get("group", ""), lambda: written)


# The whole guide as one HTML page: it opens offline, in any browser; nothing is fetched and nothing runs.


_TYPES = {"png": "image/png", "svg": "image/svg+xml"}
_FENCE = re.compile(r"^```(\w+) (\S+)$", re.MULTILINE)
_PICTURE = re.compile(r'src="\.\./\.\./((?:pictures|examples)/[^"]+)"')
_LINK = re.compile(r'href="(?:\.\./[\w-]+/)?([\w-]+)\.md"')


def html_guide(shown: Sequence[Page], *, title: str = "geoprint: the guide") -> bytes:
    """Return the page: a list of contents beside the pages, one below the other.

    Args:
        shown: the pages, in their order.
        title: of the whole.

    Returns:
        UTF-8 HTML with every picture in it; the same for the same pages.
    """
    contents = "".join(
        f"<h2>{heading}</h2>\n<ol>\n{''.join(map(_listed, of_part))}</ol>\n"
        for part, heading in PARTS.items()
        if (of_part := [page for page in shown if page.part == part])
    )
    text = Template(_packaged("guide.html")).substitute(
        title=html.escape(title),
        style=_packaged("guide.css"),
        contents=contents,
        pages="\n".join(map(_section, shown)),
    )
    return text.encode("utf-8")


def _listed(page: Page) -> str:
    """Return the entry of a page in the contents."""
    return f'<li><a href="#{page.name}">{html.escape(page.title)}</a></li>\n'


def _section(page: Page) -> str:
    """Return one page, whose headings stand below its title."""
    # What is a file has its name above it.
    text = _FENCE.sub(_named, page.text)
    rendered = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
    rendered = re.sub(r"<(/?)h([2-4])>", lambda found: f"<{found[1]}h{int(found[2]) + 1}>", rendered)
    rendered = re.sub(r"<p><em>((?:(?!<p>).)*)</em></p>(?=\n<pre>)", r'<p class="file">\1</p>', rendered)
    rendered = re.sub(r"<code>(--[\w-]+)</code>", r'<code class="option">\1</code>', rendered)
    rendered = _PICTURE.sub(lambda found: f'src="{_inline(found[1])}"', rendered)
    rendered = _LINK.sub(r'href="#\1"', rendered)
    rendered = rendered.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")
    if page.is_generated:
        rendered = _folded(rendered)
    head = f'<h2>{html.escape(page.title)}</h2>\n<p class="summary">{html.escape(page.summary)}</p>'
    return f'<section id="{page.name}">\n{head}\n{rendered}</section>'


def _folded(rendered: str) -> str:
    """Return a long page with each part below a heading closed, to be opened by that heading."""
    before, *parts = rendered.split("<h3>")
    closed = (f"<details><summary>{part.replace('</h3>', '</summary>', 1)}</details>\n" for part in parts)
    return before + "".join(closed)


def _named(fence: re.Match[str]) -> str:
    """Return the beginning of a block, with the name of the file that it is above it."""
    language, word = fence.groups()
    said = "each of these is refused:" if word == "refused" else f"`{word}`"
    return f"*{said}*\n\n```{language}"


def _inline(path: str) -> str:
    """Return a picture as the address that holds it."""
    data = base64.b64encode(_folder(path).read_bytes()).decode("ascii")
    return f"data:{_TYPES[path.rpartition('.')[2]]};base64,{data}"


def _packaged(name: str) -> str:
    return (resources.files("geoprint.guide") / name).read_text(encoding="utf-8")
