"""The command that shows the guide: a list of its pages, one of them, or the whole as an HTML page."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from geoprint.cli.options import Overwrite
from geoprint.cli.terminal import say
from geoprint.errors import ExportError, UsageError


def guide(
    topic: Annotated[
        str | None, typer.Argument(help="Name of a page; without it the pages are listed.", show_default=False)
    ] = None,
    *,
    html: Annotated[
        Path | None, typer.Option(help="Write the whole guide, or the page that is named, as one HTML file.")
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Show the guide: how to compare, prepare a part and a cell, print, script, and what a refusal asks for."""
    from geoprint.guide import page_named, pages

    shown = pages() if topic is None else (page_named(topic),)
    if html is not None:
        from geoprint.guide import html_guide

        _write(html, html_guide(shown), overwrite=overwrite)
        say(f"written: {html}")
    elif topic is None:
        _list()
    elif sys.stdout.isatty():
        _render(topic)
    else:
        page = page_named(topic)
        typer.echo(f"# {page.title}\n\n{page.summary}\n\n{page.in_words}", nl=False)


def _list() -> None:
    """Print a line for each page, as wide as the terminal."""
    from rich.console import Console
    from rich.table import Table

    from geoprint.guide import pages

    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True, style="bold")
    table.add_column()
    for page in pages():
        table.add_row(page.name, f"{page.title}: {page.summary[0].lower()}{page.summary[1:]}")
    console = Console(highlight=False)
    console.print(table)
    console.print("\n`geoprint guide NAME` shows a page, `geoprint guide --html guide.html` writes all of them.")


def _render(topic: str) -> None:
    """Print a page on a terminal, with headings, tables and blocks laid out in its width."""
    from rich.console import Console
    from rich.markdown import Markdown

    from geoprint.guide import page_named

    page = page_named(topic)
    text = f"# {page.title}\n\n*{page.summary}*\n\n{page.in_words}"
    console = Console()
    console.print(Markdown(text, code_theme="ansi_dark", hyperlinks=False), width=min(console.width, 100))


def _write(path: Path, data: bytes, *, overwrite: bool) -> None:
    """Write a file that is not there yet, or may be replaced."""
    if path.exists() and not overwrite:
        raise UsageError(f"{path} exists; choose another name, or replace it with --overwrite.")
    try:
        path.write_bytes(data)
    except OSError as error:
        raise ExportError(f"`{path}` cannot be written ({error}); choose another place.") from error
