"""Commands about the command line itself: help."""

from __future__ import annotations

from typing import Annotated

import typer


def help(  # noqa: A001  (what people type)
    command: Annotated[str | None, typer.Argument(help="Name of a command.", show_default=False)] = None,
) -> None:
    """Show what geoprint does, or what a command does and takes."""
    from geoprint.cli.application import run

    run([*([] if command is None else [command]), "--help"])
