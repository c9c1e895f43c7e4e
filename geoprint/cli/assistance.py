"""Commands about the command line itself: help, completion."""

from __future__ import annotations

from typing import Annotated

import typer

from geoprint.cli.terminal import tell
from geoprint.errors import UsageError

# That typer writes a script for, besides those of Windows.
SHELLS = ("bash", "zsh", "fish")


def help(  # noqa: A001  (what people type)
    command: Annotated[str | None, typer.Argument(help="Name of a command.", show_default=False)] = None,
) -> None:
    """Show what geoprint does, or what a command does and takes."""
    from geoprint.cli.application import run

    run([*([] if command is None else [command]), "--help"])


def completion(
    shell: Annotated[str, typer.Argument(help="bash, zsh or fish.", show_default=False)],
) -> None:
    """Print the script that makes a shell complete commands and options, for its start-up file.

    For bash, put this line into ~/.bashrc: eval "$(geoprint completion bash)"
    """
    from typer.completion import get_completion_script  # pyright: ignore[reportPrivateImportUsage]

    from geoprint.cli.application import COMPLETION, NAME

    if shell not in SHELLS:
        raise UsageError(f"there is no completion for the shell '{shell}'; choose one of: {', '.join(SHELLS)}.")
    tell(get_completion_script(prog_name=NAME, complete_var=COMPLETION, shell=shell))
