"""The pages of the guide as their files have them.

They stand in four folders of `pages/`: tutorials, how-to, reference and explanation. A page begins with what is said
of it, a key a line between two lines of three hyphens:

    ---
    order: 10
    title: Compare two planners on one part
    summary: Which backend covers a part more evenly.
    ---

The rest is Markdown. Blocks of `sh` and `python` are run by the tests, one page after another in one folder; what `sh
refused` says ends in a refusal. A block with a second word (`toml job.toml`, `csv touched.csv`) is the file of that
name. Whatever else stands in a block (`text`, `console`) is only shown.
"""

from __future__ import annotations

import base64
import html
import inspect
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from importlib import import_module, resources
from importlib.resources.abc import Traversable
from string import Template
from types import MappingProxyType, ModuleType
from typing import cast, final

from markdown_it import MarkdownIt

from geoprint.errors import UsageError
from geoprint.features import PAGE, Feature, features

# The page of the public names: what every package passes on, with signature, shapes and units from the docstrings.


# Packages in the order in which data passes them, with what one looks for there.
_TOP = "geoprint"
STAGES = {
    _TOP: "The whole at once",
    "geoprint.config": "Jobs and cells",
    "geoprint.geometry.files": "Files",
    "geoprint.geometry": "Surfaces, their defects and repair, other triangles",
    "geoprint.distance": "Distance and contours",
    "geoprint.fibers": "Direction fields",
    "geoprint.layers": "Layers",
    "geoprint.toolpath": "Patterns and paths",
    "geoprint.metrics": "Evenness",
    "geoprint.inspection": "Photographs of the print",
    "geoprint.simulation": "A simulated print",
    "geoprint.toolpath_files": "Toolpaths of any program",
    "geoprint.process": "Material",
    "geoprint.process_fitting": "Process settings from measurements",
    "geoprint.positioner": "Tables that move the part",
    "geoprint.robot.placing": "Where the part stands",
    "geoprint.robot.arm": "The arm",
    "geoprint.robot.reach": "Reach",
    "geoprint.robot.timing": "Timing",
    "geoprint.robot.controller": "The controller",
    "geoprint.robot.collision": "Collision",
    "geoprint.postprocessor": "Tables and bundle",
    "geoprint.postprocessor.rapid": "RAPID",
    "geoprint.workflow": "Where the stages meet",
    "geoprint.results": "Results",
    "geoprint.reporting": "What is said of a result",
    "geoprint.model": "Values",
    "geoprint.errors": "Refusals",
}
# The sections of a docstring that are shown line by line, and what stands before each.
_SECTIONS = {"Attributes": "", "Args": "", "Returns": "returns: "}
# Defaults that are shown as they are written.
_PLAIN = (bool, int, float, str, type(None))
_BEFORE = """\
Every stage is a function from frozen values to a new one, and what each of these packages names is public.
Lengths are mm, times s, angles rad; letters in brackets are the shapes of arrays.
"""
_HEADING = re.compile(r"^(\w+):$")


def names_text() -> str:
    """Return the Markdown: a section a package, an entry a name."""
    parts = [_BEFORE]
    for name, heading in STAGES.items():
        package = import_module(name)
        first = inspect.getdoc(package) or ""
        parts.append(f"## {heading}: `{name}`\n\n{first.partition(chr(10) * 2)[0]}\n")
        whole = name != _TOP
        parts += [_entry(each, getattr(package, each), whole=whole) for each in public_names(package)]
    return "\n".join(parts)


def public_names(package: ModuleType) -> Sequence[str]:
    """Return what a package passes on: functions, classes, and tables of what is chosen by name.

    They stand in the package's own order where it has one, else from a to z.
    """
    named: Sequence[str] | None = getattr(package, "__all__", None)
    return [
        name
        for name in named or sorted(vars(package), key=str.lower)
        if not name.startswith("_") and _is_shown(getattr(package, name), package.__name__)
    ]


def _is_shown(value: object, package: str) -> bool:
    """Return whether a name is a function, a class or a table of geoprint, at home at or below its package."""
    if isinstance(value, MappingProxyType):
        return True
    return (inspect.isfunction(value) or inspect.isclass(value)) and (
        package == _TOP or value.__module__.startswith(package)
    )


def _entry(name: str, value: object, *, whole: bool) -> str:
    """Return what is said of one name; of those at the top, which stand below again, the first sentence alone."""
    if isinstance(value, MappingProxyType):
        return f"### `{name}`\n\n{''.join(_known(cast('Mapping[str, type]', value)))}"
    sections = _sections(inspect.getdoc(value) or "")
    first = f"### `{name}{_signature(value)}`\n\n{' '.join(sections[''])}\n"
    if not whole:
        return first
    lines = [f"- {before}{each}\n" for title, before in _SECTIONS.items() for each in _items(sections.get(title, []))]
    raised = re.findall(r"^    (\w+): ", "\n".join(sections.get("Raises", [])), re.MULTILINE)
    if raised:
        lines.append(f"- raises: {', '.join(f'`{each}`' for each in raised)}\n")
    return f"{first}\n{''.join(lines)}"


def _known(entries: Mapping[str, type]) -> Iterator[str]:
    """Yield a line for each backend or pattern, with what it says of itself and its options."""
    for name, entry in entries.items():
        said = str(getattr(entry, "summary", getattr(entry, "title", ""))).rstrip(".")
        parameters = inspect.signature(entry).parameters.values()
        options = ", ".join(f"`{name}.{one.name}`" for one in parameters if one.kind is one.KEYWORD_ONLY)
        yield f"- `{name}`: {said}.{f' Options: {options}.' if options else ''}\n"


def _signature(value: object) -> str:
    """Return the arguments of a function as they are written; nothing for a class, whose attributes are listed."""
    if not inspect.isfunction(value):
        return ""
    whole = inspect.signature(value)
    plain = [
        one if one.default is one.empty or isinstance(one.default, _PLAIN) else one.replace(default=...)
        for one in whole.parameters.values()
    ]
    return str(whole.replace(parameters=plain)).replace("'", "").replace("Ellipsis", "...")


def _sections(text: str) -> Mapping[str, list[str]]:
    """Return the lines of a docstring by the heading that they stand under; the first line alone under none."""
    found: dict[str, list[str]] = {"": []}
    under = ""
    for line in text.splitlines():
        if heading := _HEADING.match(line):
            under = heading[1]
        elif under:
            found.setdefault(under, []).append(line)
        elif line.strip():
            found[""].append(line.strip())
        else:
            under = "more"
    return found


def _items(lines: Sequence[str]) -> Sequence[str]:
    """Return the entries of a section, each in one line: what is indented more goes on with the entry above it."""
    items: list[str] = []
    for line in filter(str.strip, lines):
        if line.startswith("     ") and items:
            items[-1] += f" {line.strip()}"
        else:
            items.append(line.strip())
    return [re.sub(r"^(\*{0,2}\w+)(?=: )", r"`\1`", item) for item in items]


# The parts of the guide: the folders that its pages stand in, with their headings.
PARTS = {"tutorials": "Tutorials", "how-to": "How-to", "reference": "Reference", "explanation": "Explanation"}
# The page that is made from the docstrings.
NAMES = "api"
NAMES_ORDER = 1000
NAMES_SUMMARY = "What the library has, stage by stage, with shapes and units, as its docstrings say it."
_KEYS = ("order", "title", "summary")
_BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_PAGE_LINK = re.compile(r"(?<!!)\[([^\]]*)\]\((?:\.\./[\w-]+/)?([\w-]+)\.md\)")
_PAGE_PICTURE = re.compile(r"!\[([^\]]*)\]\(\.\./\.\./pictures/([^)\s]+)\)")


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
        read: returns its Markdown, without the title.
    """

    name: str
    part: str
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
        return [(found[1], found[2]) for found in _PAGE_PICTURE.finditer(self.text)]

    @property
    def in_words(self) -> str:
        """Its Markdown for a terminal: what a picture shows in words, and what a link leads to as a command."""
        text = _PAGE_PICTURE.sub(r"*Picture: \1.*", self.text)
        return _PAGE_LINK.sub(r"\1 (`geoprint guide \2`)", text)


@cache
def pages() -> tuple[Page, ...]:
    """Return the pages in their order, part by part, those of features too; one lists the public names.

    Raises:
        ValueError: a page lacks what has to stand at its head.
    """
    own = [_read(file, part=part) for part in PARTS for file in (_folder("pages") / part).iterdir()]
    added = [_read(file, of=feature) for feature in features() if (file := feature.folder / PAGE).is_file()]
    # Read only where it is asked for: it imports everything.
    names = Page(NAMES, "reference", NAMES_ORDER, "API: the public names", NAMES_SUMMARY, names_text)
    return tuple(sorted([*own, *added, names], key=lambda page: ([*PARTS].index(page.part), page.order)))


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
    return Page(name, part, int(head["order"]), head["title"], head["summary"], lambda: written)


# The whole guide as one HTML page: it opens offline, in any browser; nothing is fetched and nothing runs.


_TYPES = {"png": "image/png", "svg": "image/svg+xml"}
_FENCE = re.compile(r"^```(\w+) (\S+)$", re.MULTILINE)
_PICTURE = re.compile(r'src="\.\./\.\./pictures/([^"]+)"')
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
    if page.name == NAMES:
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


def _inline(name: str) -> str:
    """Return a picture as the address that holds it."""
    data = base64.b64encode(picture_bytes(name)).decode("ascii")
    return f"data:{_TYPES[name.rpartition('.')[2]]};base64,{data}"


def _packaged(name: str) -> str:
    return (resources.files("geoprint.guide") / name).read_text(encoding="utf-8")
