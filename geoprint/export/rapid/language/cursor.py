"""Stands at one token of a module after the other, for the parsers."""

from __future__ import annotations

from typing import NoReturn, cast, final

from geoprint.export.rapid.language.places import Place, refuse
from geoprint.export.rapid.language.syntax import Call, Series, Value
from geoprint.export.rapid.language.tokens import RESERVED, tokens

_WORDS = {"name": "a name", "number": "a number", "string": "a text", "numbers": "numbers", "end": "the end"}


@final
class Cursor:
    """The token that is read next.

    Attributes:
        kind: of the token: a reserved word, a sign, or name, number, string, numbers, call, end.
        line: where it stands.
        last_line: where the token before it stands.
        comments: lines of comments so far.
    """

    def __init__(self, file: str, lines: list[str], *, whole_calls: bool) -> None:
        self.comments: list[tuple[int, str]] = []
        self._file = file
        self._tokens = tokens(file, lines, self.comments, whole_calls=whole_calls)
        self.last_line = 1
        self.kind, self._value, self.line = next(self._tokens)

    @property
    def ended(self) -> bool:
        """Whether nothing is left."""
        return self.kind == "end"

    def step(self) -> None:
        """Go on to the next token."""
        self.last_line = self.line
        self.kind, self._value, self.line = next(self._tokens)

    def take(self, kind: str) -> bool:
        """Step over a token of this kind, and say whether there was one."""
        if self.kind != kind:
            return False
        self.step()
        return True

    def need(self, kind: str, after: str) -> None:
        """Step over a token that must be there.

        Raises:
            VerificationError: it is not.
        """
        if self.kind != kind:
            # It is missing where the token before it ends.
            refuse(Place(self._file, self.last_line), f"{kind} is missing behind {after}: found {self.shown()}")
        self.step()

    def name(self, what: str) -> str:
        """Step over a name and return it.

        Raises:
            VerificationError: something else stands here.
        """
        if self.kind != "name":
            reserved = ", which is a reserved word of RAPID" if self.kind in RESERVED else ""
            self.refuse(f"the name of {what} is missing: found {self.shown()}{reserved}")
        word = cast("str", self._value)
        self.step()
        return word

    def value(self) -> Value:
        """Step over a number, a text or an aggregate of numbers and return it."""
        value = cast("Value", self._value)
        self.step()
        return value

    def call(self) -> Call | Series:
        """Step over a whole instruction, or a series of them, and return it."""
        call = cast("Call | Series", self._value)
        self.step()
        self.last_line = call.lines[-1] if isinstance(call, Series) else call.line
        return call

    def shown(self) -> str:
        """Return in words what stands here."""
        if self.kind == "call":
            return f"the instruction {cast('Call | Series', self._value).name}"
        if self.kind in {"name", "string"}:
            return f"{_WORDS[self.kind]} {self._value!r}"
        return _WORDS.get(self.kind, self.kind)

    def refuse(self, reason: str) -> NoReturn:
        """Refuse what stands here.

        Raises:
            VerificationError: always.
        """
        refuse(Place(self._file, self.line), reason)
