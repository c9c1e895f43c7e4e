"""The application that commands are registered with, and how it ends."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from importlib import import_module
from typing import Annotated, Any, cast

import typer
from typer.core import TyperCommand

from geoprint.cli.terminal import say
from geoprint.errors import GeoprintError, ResourceError

app = typer.Typer(
    name="geoprint",
    help="Plan evenly spaced print paths on a curved surface and write the robot program that prints them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
# As help lists them, each in a line of its own, by the modules of this folder; these are read once a command is asked
# for, because its options come from `Job`.
COMMANDS = {
    "planning": {
        "plan": "Plan a part and write the checked program for the robot.",
        "compare": "Compare how evenly backends cover parts, and what prints.",
        "place": "Look for the place where the arm prints a part best.",
        "recommend": "Say which spacing, rounds and speed fit a pressure.",
    },
    "parts": {
        "inspect": "Say what a mesh is, its defects, and which backends plan it.",
        "patch": "Cut patches out of a body.",
        "remesh": "Smooth, even or thin out a mesh, within a deviation.",
        "check": "Read a bundle back and print its run sheet.",
    },
    "cells": {
        "init": "Write commented cell files and a job file.",
        "calibrate": "Fit the fixture or the tool centre point from touches.",
        "fit_flow": "Fit how the material flows to a few measured lines.",
        "doctor": "Show versions and prove that the checks work here.",
    },
}


class _Later(TyperCommand):
    """A command that is read when it is called; its callback returns it."""

    def make_context(self, *arguments: Any, **extra: Any) -> Any:
        read = cast("Callable[[], TyperCommand]", self.callback)
        return read().make_context(*arguments, **extra)


def _reader(module: str, name: str) -> Callable[[], Any]:
    """Return what reads a command from its module."""

    def read() -> Any:
        alone = typer.Typer(add_completion=False, rich_markup_mode=None)
        alone.command()(getattr(import_module(f"geoprint.cli.{module}"), name))
        return typer.main.get_command(alone)

    return read


for module, commands in COMMANDS.items():
    for name, summary in commands.items():
        app.command(name.replace("_", "-"), cls=_Later, short_help=summary)(_reader(module, name))

STOPPED_BY_USER = 130


def main() -> None:
    """Run the command line and end the process with the exit status of the outcome."""
    try:
        app()
    except GeoprintError as error:
        say(f"geoprint: {error}")
        sys.exit(error.exit_status)
    except SystemExit as end:
        if end.code == STOPPED_BY_USER:
            say("geoprint: stopped; nothing was written.")
        raise
    except MemoryError:
        say("geoprint: out of memory; choose a larger spacing or a smaller part.")
        sys.exit(ResourceError.exit_status)
    except Exception:  # the one place where a defect may end: with its traceback
        traceback.print_exc()
        say("geoprint: this is a defect of geoprint; please report it with the lines above.")
        sys.exit(GeoprintError.exit_status)


def _show_version(wanted: bool) -> None:  # noqa: FBT001  (the form that typer calls)
    if wanted:
        from importlib.metadata import version

        typer.echo(version("geoprint"))
        raise typer.Exit


@app.callback()
def _root(
    *,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and end.")
    ] = False,
) -> None:
    """Hold what every command shares."""
