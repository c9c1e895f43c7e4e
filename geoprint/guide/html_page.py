"""The whole guide as one HTML page: it opens offline, in any browser; nothing is fetched and nothing runs."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Sequence
from importlib import resources
from string import Template

from markdown_it import MarkdownIt

from geoprint.guide.pages import NAMES, Page, picture_bytes

_TYPES = {"png": "image/png", "svg": "image/svg+xml"}
_FENCE = re.compile(r"^```(\w+) (\S+)$", re.MULTILINE)
_PICTURE = re.compile(r'src="\.\./pictures/([^"]+)"')
_LINK = re.compile(r'href="([\w-]+)\.md"')


def html_guide(shown: Sequence[Page], *, title: str = "geoprint: the guide") -> bytes:
    """Return the page: a list of contents beside the pages, one below the other.

    Args:
        shown: the pages, in their order.
        title: of the whole.

    Returns:
        UTF-8 HTML with every picture in it; the same for the same pages.
    """
    contents = "".join(f'<li><a href="#{page.name}">{html.escape(page.title)}</a></li>\n' for page in shown)
    text = Template(_packaged("guide.html")).substitute(
        title=html.escape(title),
        style=_packaged("guide.css"),
        contents=contents,
        pages="\n".join(map(_section, shown)),
    )
    return text.encode("utf-8")


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
