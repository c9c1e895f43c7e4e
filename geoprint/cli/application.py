"""The application that commands are registered with."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from functools import partial
from importlib import import_module
from pathlib import Path
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


# Panels of help in their order; an option that names none stands among the options.
PANELS = ("Arguments", "Part", "Paths", "Layers", "Robot", "Options", "Output")
# The first column of help: what is wider has a line of its own.
WIDEST = 22


class _Command(TyperCommand):
    """A command whose options are given once each, and stand in panels of help."""

    def make_context(self, *arguments: Any, **extra: Any) -> Any:
        refuse_repeated(self, arguments[1])
        return super().make_context(*arguments, **extra)

    def panels(self, ctx: Any) -> Mapping[str, Sequence[tuple[str, str]]]:
        """Return what the command takes, panel by panel: how it is written, and what is said of it."""
        rows: dict[str, list[tuple[str, str]]] = {panel: [] for panel in PANELS}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is None:
                continue
            if parameter.param_type_name == "argument":
                rows["Arguments"].append((parameter.metavar or str(parameter.name).upper(), record[1]))
            else:
                rows[getattr(parameter, "rich_help_panel", None) or "Options"].append(record)
        return {panel: each for panel, each in rows.items() if each}

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the panels, with one width of their first columns."""
        rows = self.panels(ctx)
        width = min(max(len(first) for each in rows.values() for first, _ in each), WIDEST)
        for panel, each in rows.items():
            with formatter.section(panel):
                formatter.write_dl([(f"{first:<{width}}", said) for first, said in each], col_max=width)


class _Later(TyperCommand):
    """A command that is read when it is called."""

    def __init__(self, name: str, load: Callable[[], Any], *, short_help: str) -> None:
        super().__init__(name, short_help=short_help)
        self._load = load

    def loaded(self) -> _Command:
        """Return the command of the function that is loaded."""
        alone = typer.Typer(add_completion=False, rich_markup_mode=None)
        alone.command(cls=_Command)(self._load())
        return cast("_Command", typer.main.get_command(alone))

    def make_context(self, *arguments: Any, **extra: Any) -> Any:
        return self.loaded().make_context(*arguments, **extra)


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


def documented() -> Iterator[tuple[str, str, Mapping[str, Sequence[tuple[str, str]]]]]:
    """Yield name, description and panels of every command of this package and its features."""
    for name, later in _KNOWN.items():
        command = later.loaded()
        yield name, command.help or "", command.panels(typer.Context(command, info_name=name))


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


# What a command line that is wrong was meant to say.
#
# What people look for under another name: commands, and options that other programs have, or that geoprint had.
COMMANDS_MEANT = {
    "slice": "`geoprint plan PART` plans the paths of a part",
}
OPTIONS_MEANT = {
    "--backends": "write `--backend`, with commas between several",
    "--patterns": "write `--pattern`, with commas between several",
    "--step": "write `--rounds`, which is 20 for a step of 0.05",
    "--resolution": "write `--set options.lscm.resolution=VALUE`",
    "--option": "write `--set options.NAME.KEY=VALUE`, or `--set options.NAME` for a feature",
    "--robot": "the cell file names the arm; give it with `--cell FILE`, and `geoprint init` writes those of an irb120",
}
_NO_NUMBER = re.compile(r"valid (?P<kind>float|number|int)")
_WITH_UNIT = re.compile(r"([-+]?[\d.]+) *[a-zA-Z/%\N{DEGREE SIGN}]+$")


def _refusal(error: Any, context: Any, arguments: Sequence[str]) -> str:
    """Return the sentence of what a parser refuses, with the next step."""
    command = NAME if context is None else context.command_path
    lists = f"`{command} --help` lists what it takes."
    kind, parameter = type(error).__name__, getattr(error, "param", None)
    if kind == "NoSuchOption":
        return f"`{command}` has no option `{error.option_name}`{_option_meant(error.option_name, context, lists)}"
    if context is not None and context.parent is None and not arguments[0].startswith("-"):
        return f"there is no command `{arguments[0][:60]}`{_command_meant(arguments[0], context)}"
    if parameter is None:
        said = error.format_message().rstrip(".")
        return f"{said[0].lower()}{said[1:]}; {lists}"
    name = parameter.opts[0] if parameter.param_type_name == "option" else parameter.metavar
    if kind == "MissingParameter":
        needed = f"{name} {parameter.metavar}" if name != parameter.metavar else name
        said = parameter.help.partition(":")[0].rstrip(".")
        return f"`{command}` needs `{needed}`: {said[0].lower()}{said[1:]}; {lists}"
    if found := _NO_NUMBER.search(error.format_message()):
        typed = _typed_for(name, arguments, count=parameter.nargs)
        value = _WITH_UNIT.match(typed)
        number = "a whole number" if found["kind"] == "int" else "a number"
        unit = f" in {parameter.metavar.lower()}" if parameter.metavar in {"MM", "GB"} else ""
        instead = f": write `{name} {value[1]}`" if value else f"; {lists.rstrip('.')}"
        return f"`{name}` takes {number}{unit}, found '{typed}'{instead}."
    said = error.format_message().partition(": ")[2].rstrip(".") or error.format_message()
    return f"`{name}`: {said[0].lower()}{said[1:]}; {lists}"


def _typed_for(flag: str, arguments: Sequence[str], *, count: int) -> str:
    """Return what was typed for an option."""
    for place, argument in enumerate(arguments):
        before, equals, value = argument.partition("=")
        if before == flag:
            return value if equals else " ".join(arguments[place + 1 : place + 1 + count])
    return ""


def _option_meant(flag: str, context: Any, lists: str) -> str:
    """Return what follows on an option that a command does not have."""
    from geoprint.cli.options import instead_of

    known: list[str] = [
        each for parameter in context.command.params for each in parameter.opts if each.startswith("--")
    ]
    rare = instead_of(flag) if "--set" in known else ""
    if rare or (flag in OPTIONS_MEANT and "--set" in known):
        return f": {f'write {rare}' if rare else OPTIONS_MEANT[flag]}."
    near = get_close_matches(flag, known, n=1)
    return f"; did you mean `{near[0]}`?" if near else f"; {lists}"


def _command_meant(name: str, context: Any) -> str:
    """Return what follows on a command that there is not."""
    if Path(name).is_file() or Path(name).suffix:
        return (
            f": for a part, `geoprint compare {name}` compares backends, and `geoprint plan {name}` writes a program."
        )
    if name in COMMANDS_MEANT:
        return f": {COMMANDS_MEANT[name]}."
    names: list[str] = context.command.list_commands(context)
    near = get_close_matches(name, names, n=1)
    return f"; did you mean `geoprint {near[0]}`?" if near else "; `geoprint --help` lists all."


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
        raise UsageError(_refusal(error, context, arguments)) from error
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
