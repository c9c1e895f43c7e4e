"""Errors of a running RAPID program, which its error handlers see by number, and what this machine does not know.

The names are those of the controller; its numbers are its own, and a program that compares ERRNO with a number instead
of a name is none that this machine takes.
"""

from __future__ import annotations

from typing import NoReturn, final

from geoprint.errors import VerificationError

_NAMES = (
    "ERR_ARGDUPCND", "ERR_ARGNOTPER", "ERR_ARGVALERR", "ERR_CALLPROC", "ERR_DIVZERO", "ERR_FILNOTFND", "ERR_ILLRAISE",
    "ERR_INVDIM", "ERR_LOADED", "ERR_LOADNO_INUSE", "ERR_LOADNO_NOUSE", "ERR_NOTPRES", "ERR_NUM_LIMIT", "ERR_OUTOFBND",
    "ERR_REFUNKDAT", "ERR_REFUNKFUN", "ERR_REFUNKPRC", "ERR_REFUNKTRP", "ERR_STRTOOLNG", "ERR_UNLOAD",
    "ERR_WAIT_MAXTIME", "ERR_TP_MAXTIME", "ERR_SPEED_REFRESH_LIM", "ERR_SIGSUPSEARCH", "ERR_NORUNUNIT", "ERR_ROBLIMIT",
)  # fmt: skip
# Behind those that a program raises itself (1 to 90) and those that it books.
_FIRST = 1001
ERRORS = {name.lower(): float(number) for number, name in enumerate(_NAMES, start=_FIRST)}
_NAME_OF = {number: name.upper() for name, number in ERRORS.items()}


@final
class Fault(Exception):  # noqa: N818  # RAPID calls it an error; whoever programs it takes it for a state.
    """An error of the running program.

    Attributes:
        number: that ERRNO takes.
        what: happened.
        file: where it happened; empty until somebody looks.
        line: where it happened.
    """

    def __init__(self, number: float, what: str) -> None:
        super().__init__(what)
        self.number = number
        self.what = what
        self.file, self.line = "", 0

    @property
    def name(self) -> str:
        """The error's name, or its number where a program has chosen it."""
        return _NAME_OF.get(self.number, f"error {self.number:g}")


def fault(name: str, what: str) -> NoReturn:
    """Raise a named error of the running program.

    Raises:
        Fault: always.
    """
    raise Fault(ERRORS[name.lower()], what)


def unknown(file: str, line: int, what: str) -> NoReturn:
    """Raise the error that says what this machine cannot execute, and where it stands.

    Raises:
        VerificationError: always.
    """
    raise VerificationError(
        f"{file}, line {line}: {what}; what cannot be executed here has not been checked. Do not run this program; "
        "write it again from its plan.",
        module=file,
        line=line,
        reason=what,
    )
