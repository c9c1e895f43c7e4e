"""The application that commands are registered with."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib import import_module
from typing import Annotated, Any, cast

import typer
from typer.core import TyperCommand, TyperGroup

from geoprint.cli.ending import STOPPED_BY_USER
from geoprint.errors import UsageError
from geoprint.features import COMMANDS as FEATURE_COMMANDS, features, loaded, named_points, own_points

# Options that are given more than once, of which a parser would silently take the last.


def refuse_repeated(command: Any, arguments: Sequence[str]) -> None:
    """Refuse an option that takes one value and is given several.

    Args:
        command: whose options they are.
        arguments: as they were typed behind its name.

    Raises:
        UsageError: names the first such option.
    """
    typed = [argument.partition("=")[0] for argument in arguments]
    for parameter in command.params:
        flags = [flag for flag in typed if flag in parameter.opts]
        if len(flags) > 1 and not getattr(parameter, "multiple", False):
            raise UsageError(f"`{flags[0]}` is given {len(flags)} times, but it holds once: leave the others out.")


NAME = "geoprint"
# Where a shell writes what it wants to be completed.
COMPLETION = "_GEOPRINT_COMPLETE"
# What typer raises of its own: where it comes from has changed with its releases.
_Refused: Any = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")

# As help lists them, each in a line of its own, by the modules of this folder; these are read once a command is asked
# for, because its options come from `Job`. What features add stands below them.
COMMANDS = {
    "planning": {
        "demo": "Compare on the tip of a heart that comes along, open the report.",
        "plan": "Plan a part and write the checked program for the robot.",
        "compare": "Compare how evenly backends cover parts, and what prints.",
        "place": "Look for the place where the arm prints a part best.",
    },
    "measuring": {
        "measure": "Measure how evenly toolpaths of any program cover a part.",
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
        "doctor": "Show versions and prove that the checks work here.",
    },
    "assistance": {
        "help": "Show the help of a command, as its option -h does.",
        "completion": "Print what makes a shell complete commands and options.",
    },
}


class _Command(TyperCommand):
    """A command whose options are given once each."""

    def make_context(self, *arguments: Any, **extra: Any) -> Any:
        refuse_repeated(self, arguments[1])
        return super().make_context(*arguments, **extra)


class _Later(TyperCommand):
    """A command that is read when it is called."""

    def __init__(self, name: str, load: Callable[[], Any], *, short_help: str) -> None:
        super().__init__(name, short_help=short_help)
        self._load = load

    def make_context(self, *arguments: Any, **extra: Any) -> Any:
        return _command_of(self._load).make_context(*arguments, **extra)


def _command_of(load: Callable[[], Any]) -> TyperCommand:
    """Return the command of the function that is loaded."""
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    alone.command(cls=_Command)(load())
    return cast("TyperCommand", typer.main.get_command(alone))


def _function(module: str, name: str) -> Any:
    return getattr(import_module(f"geoprint.cli.{module}"), name)


def _known() -> Iterator[_Later]:
    """Yield the commands of this package in the order of help."""
    for module, commands in COMMANDS.items():
        for name, summary in commands.items():
            yield _Later(name, partial(_function, module, name), short_help=summary)
    for feature in features():
        for name, summary in feature.commands.items():
            (point,) = own_points(FEATURE_COMMANDS).select(name=name)
            yield _Later(name, point.load, short_help=summary)


class _Commands(TyperGroup):
    """All commands; installed packages are asked for theirs where all are listed, or one is called that is not here."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002  (the form that typer calls)
        return list(dict.fromkeys([*_KNOWN, *sorted(named_points(FEATURE_COMMANDS).names)]))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002
        if cmd_name in _KNOWN:
            return _KNOWN[cmd_name]
        for point in named_points(FEATURE_COMMANDS).select(name=cmd_name):
            # Not loaded for help, which one that is broken must not break.
            package = "" if point.dist is None else f"From the package {point.dist.name}."
            return _Later(cmd_name, partial(loaded, point, "command"), short_help=package)
        return None


_KNOWN = {str(command.name): command for command in _known()}
app = typer.Typer(
    name=NAME,
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Plan evenly spaced print paths on a curved surface and write the robot program that prints them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

if COMPLETION in os.environ:
    # A shell asks what may follow: typer learns here how shells ask.
    from typer.completion import get_completion_inspect_parameters

    get_completion_inspect_parameters()


def run(arguments: Sequence[str]) -> int:
    """Run the command that a command line names, and return its exit status.

    Raises:
        GeoprintError: as the command, and where the command line itself is wrong.
        KeyboardInterrupt: the user stopped it; typer makes an exit status of that.
    """
    try:
        status = app(args=[*arguments], prog_name=NAME, standalone_mode=False)
    except _Refused as error:
        context = getattr(error, "ctx", None)
        if not arguments:
            error.show()
            return error.exit_code
        command = NAME if context is None else context.command_path
        said = error.format_message().rstrip(".").replace("Input should be", "it must be")
        raise UsageError(f"{said[0].lower()}{said[1:]}; `{command} --help` shows what it takes.") from error
    if status == STOPPED_BY_USER:
        raise KeyboardInterrupt
    return status if isinstance(status, int) else 0


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
