"""Where something stands in the text of a module, and the error that names it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn, final

from geoprint.errors import VerificationError


@final
@dataclass(frozen=True, slots=True)
class Place:
    """Where something stands: module file and line, from 1."""

    module: str
    line: int


def refuse(place: Place, reason: str) -> NoReturn:
    """Raise the error that names a place in a module and what is wrong there.

    Raises:
        VerificationError: always.
    """
    raise refusal(place, reason)


def refusal(place: Place, reason: str) -> VerificationError:
    """Return the error that names a place in a module and what is wrong there."""
    return VerificationError(
        f"{place.module}, line {place.line}: {reason}. Do not run this program; write it again from its plan.",
        module=place.module,
        line=place.line,
        reason=reason,
    )
