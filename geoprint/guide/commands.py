"""The command that shows the guide: a list of its pages, one of them, or the whole as an HTML page."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from geoprint.cli.ending import wrote
from geoprint.cli.options import Overwrite
from geoprint.cli.terminal import columns, show, tell
from geoprint.errors import UsageError

if TYPE_CHECKING:
    from geoprint.guide import Page


# Longer lines are hard to read.
WIDEST = 100


def guide(
    topic: Annotated[
        str | None, typer.Argument(help="Name of a page; without it the pages are listed.", show_default=False)
    ] = None,
    *,
    html: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the whole guide, or the page that is named, as one HTML file."),
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Show the guide: how to compare, prepare a part and a cell, print, script, and what a refusal asks for."""
    from geoprint.guide import page_named, pages

    shown = pages() if topic is None else (page_named(topic),)
    if html is not None:
        from geoprint.guide import html_guide

        _write(html, html_guide(shown), overwrite=overwrite)
        wrote(html)
    elif topic is None:
        show(_listed(shown))
    else:
        page = page_named(topic)
        width = columns(sys.stdout)
        tell(_plain(page) if width is None else rendered(page, width=width))


def _listed(shown: Sequence[Page]) -> str:
    """Return a list of pages, part by part."""
    from geoprint.guide.pages import PARTS

    names = max(len(page.name) for page in shown)
    lines: list[str] = []
    for part, heading in PARTS.items():
        lines += [heading, *(f"  {page.name:<{names}}  {page.title}" for page in shown if page.part == part), ""]
    return "\n".join([*lines, "`geoprint guide NAME` shows a page, `geoprint guide --html FILE` writes all."])


def _plain(page: Page) -> str:
    """Return a page for whoever reads it through a pipe: as it is written."""
    return f"# {page.title}\n\n{page.summary}\n\n{page.in_words.rstrip()}"


def rendered(page: Page, *, width: int) -> str:
    """Return a page as a terminal of some width shows it, with headings, tables and blocks laid out."""
    from rich.console import Console
    from rich.markdown import Markdown

    console = Console(width=min(width, WIDEST))
    with console.capture() as captured:
        text = f"# {page.title}\n\n*{page.summary}*\n\n{page.in_words}"
        console.print(Markdown(text, code_theme="ansi_dark", hyperlinks=False))
    return captured.get().rstrip("\n")


def _write(path: Path, data: bytes, *, overwrite: bool) -> None:
    """Write a file that is not there yet, or may be replaced."""
    if path.exists() and not overwrite:
        raise UsageError(f"{path} exists; choose another name, or replace it with --overwrite.")
    from geoprint.geometry.files import write_whole

    write_whole(path, data)
