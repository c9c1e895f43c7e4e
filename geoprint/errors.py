"""The error tree: every refusal of geoprint is one of these, and each class owns its exit status.

A message says what is wrong, where, what was found, what is allowed and what to do next; the numbers in it are
attributes too, under the names given when the error is raised.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from typing import ClassVar, final

Detail = float | int | str | tuple[float, ...] | None


class GeoprintError(Exception):
    """Base of every error that geoprint raises on purpose.

    Args:
        message: one plain sentence for the person who gave the input.
        **details: the numbers of the message, kept as `details`.
    """

    exit_status: ClassVar[int] = 1

    def __init__(self, message: str, **details: Detail) -> None:
        super().__init__(message)
        self.details: dict[str, Detail] = details


@final
class UsageError(GeoprintError):
    """A command, job or cell file asks for something unclear or impossible."""

    exit_status: ClassVar[int] = 2


class InputError(GeoprintError, ValueError):
    """A value or a file that was given cannot be used."""

    exit_status: ClassVar[int] = 3


@final
class MeshError(InputError):
    """A mesh is not an orientable manifold surface that can be planned on."""


@final
class FieldError(InputError):
    """A distance field or its contours cannot be computed on this surface with these settings."""


class PlanError(GeoprintError):
    """No valid plan exists for this part in this cell."""

    exit_status: ClassVar[int] = 4


@final
class ReachError(PlanError):
    """A pose has no inverse kinematic solution on the branch of the program."""


@final
class LimitError(PlanError):
    """A joint limit, speed or acceleration cannot be kept."""


@final
class ClearanceError(PlanError):
    """The tool or the arm touches the part, its body or an obstacle, or comes closer than the cell allows."""


@final
class VerificationError(GeoprintError):
    """What was written or computed disagrees with the plan when it is read back."""

    exit_status: ClassVar[int] = 5


@final
class ResourceError(GeoprintError):
    """A time or memory limit stopped the work."""

    exit_status: ClassVar[int] = 6


@final
class ExportError(GeoprintError):
    """The result cannot be written where it was asked for."""

    exit_status: ClassVar[int] = 7


def reason_of(error: Exception) -> str:
    """Return what went wrong in words: of an error of the system without its number and its file."""
    return (isinstance(error, OSError) and error.strerror) or str(error)


def how_many(count: int, noun: str, plural: str = "") -> str:
    """Return a number of things in words: '1 run', '2 runs'.

    Args:
        count: of them.
        noun: for one.
        plural: for several, where it takes more than an s.
    """
    return f"{count} {noun}" if count == 1 else f"{count} {plural or f'{noun}s'}"


def percent(share: float, digits: int = 0, *, signed: bool = False) -> str:
    """Return a share in per cent, as every text writes it: '0.5 %'; zero has no minus.

    Args:
        share: 1 is all.
        digits: behind the point.
        signed: whether a plus stands before what is above 0.
    """
    return f"{100.0 * share:{'+' if signed else ''}z.{digits}f} %"


@contextmanager
def naming(what: str) -> Generator[None]:
    """Say of what an error inside is: its sentence begins with these words; its class and numbers stay.

    Args:
        what: for example "patch 2"; empty where there is nothing to tell apart.
    """
    try:
        yield
    except GeoprintError as error:
        if not what:
            raise
        raise type(error)(f"{what}: {error}", **error.details) from error


@final
class Faults:
    """What is wrong with what somebody gave, collected so that all of it is said at once."""

    __slots__ = ("found",)

    def __init__(self) -> None:
        self.found: list[UsageError] = []

    @contextmanager
    def noting(self) -> Generator[None]:
        """Note a `UsageError` inside, and go on behind it."""
        try:
            yield
        except UsageError as error:
            self.found.append(error)

    def refuse(self, what: str) -> None:
        """Refuse for all that was noted, if anything was.

        Args:
            what: begins the sentence where there are several reasons.

        Raises:
            UsageError: the one that was noted, or one that lists them.
        """
        if len(self.found) == 1:
            raise self.found[0]
        if self.found:
            listed = " ".join(f"({number}) {error}" for number, error in enumerate(self.found, start=1))
            raise UsageError(f"{what}, for {len(self.found)} reasons. {listed}")
