"""Options that are given more than once, of which a parser would silently take the last."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from geoprint.errors import UsageError


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
