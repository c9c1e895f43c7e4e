"""Cuts RAPID text into tokens, and stands at one after the other for the parsers."""

from __future__ import annotations

import json
import re
from array import array
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import NoReturn, TypeAlias, cast, final

from geoprint.postprocessor.rapid.language.syntax import (
    Argument,
    Call,
    Literal,
    Name,
    Place,
    Series,
    Value,
    refusal,
    refuse,
)

# Cuts RAPID text into tokens, line by line.
#
# A token is its kind, its value and its line. Operators and reserved words are their own kind (`:=`, `ENDPROC`, in
# capitals); the others are `name`, `number`, `string`, `numbers` (a whole aggregate of nothing but numbers, decoded
# by the JSON scanner, whose brackets and numbers are RAPID's), `call` and, at last, `end`. A `call` is a whole
# instruction of names behind such an aggregate, on a line of its own (`MoveL [...],v,z,tool\WObj:=w;`), or a series
# of those whose aggregates are robtargets: a program has tens of thousands of them, and read so they cost a tenth.
# They are the nodes that the parser would make of the tokens; a test holds that.


Token: TypeAlias = tuple[str, "str | float | Value | Call | Series", int]
# Kind and value of a word.
_Meaning: TypeAlias = tuple[str, "str | float"]

# Reserved words, which no name may be [3HAC050946, lexical elements].
RESERVED = frozenset(
    re.findall(
        r"\w+",
        """ALIAS AND BACKWARD CASE CONNECT CONST DEFAULT DIV DO ELSE ELSEIF ENDFOR ENDFUNC ENDIF ENDMODULE ENDPROC
        ENDRECORD ENDTEST ENDTRAP ENDWHILE ERROR EXIT FALSE FOR FROM FUNC GOTO IF INOUT LOCAL MOD MODULE NOSTEPIN NOT
        NOVIEW OR PERS PROC RAISE READONLY RECORD RETRY RETURN STEP SYSMODULE TASK TEST THEN TO TRAP TRUE TRYNEXT UNDO
        VAR VIEWONLY WHILE WITH XOR""",
    )
)
TOO_DEEP = "statements or brackets are nested too deeply"
# What an editor leaves where a programmer has still to write something: a controller stops there.
_PLACEHOLDERS = frozenset({"TDN", "DDN", "RDN", "PAR", "ALT", "DIM", "SMT", "VAR", "EIT", "CSE", "EXP", "ARG", "ID"})
_FORMS = {
    "name": r"[^\W\d_]\w*",
    "number": r"0[xX][0-9a-fA-F]+|0[oO][0-7]+|0[bB][01]+|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?",
    "string": r'"(?:[^"]|"")*"',
    "comment": "!.*",
    "hole": r"<[A-Z]{2,3}>",
    "sign": r":=|<>|<=|>=|[-+*/=<>()\[\]{},;.:\\?|%]",
    "bad": r"\S",
}
_ALL_FORMS = re.compile("|".join(_FORMS.values()), re.DOTALL)
_WORD_KINDS = re.compile("|".join(f"(?P<{kind}>{form})" for kind, form in _FORMS.items()), re.DOTALL)
_BASES = {"x": 16, "o": 8, "b": 2}
# In a text a quotation mark is doubled, a backslash too, and a backslash with two digits is a character by its code.
_ESCAPE = re.compile(r'""|\\\\|\\([0-9a-fA-F]{2})')
_NUMBERS = re.compile(r"\[[-+0-9.eE,\[\] \t]*\]")
_DECODER = json.JSONDecoder(parse_int=float)
_WORD = r"[A-Za-z][A-Za-z0-9_]*"
_CALL = re.compile(rf"\s*({_WORD})[ \t]+(?=\[)", re.ASCII)
_TAIL = re.compile(rf"((?:(?:,|\\{_WORD}:=){_WORD})*);\s*$", re.ASCII)
_NUMBER = r"[-+0-9.eE]+"
_TARGET = re.compile(
    rf"\s*({_WORD})[ \t]+\[\[({_NUMBER}(?:,{_NUMBER}){{2}})\],\[({_NUMBER}(?:,{_NUMBER}){{3}})\],"
    rf"\[({_NUMBER}(?:,{_NUMBER}){{3}})\],\[({_NUMBER}(?:,{_NUMBER}){{5}})\]\]([^\[\]]*)$",
    re.ASCII,
)
_PART = re.compile(rf"(?:,|\\({_WORD}):=)({_WORD})", re.ASCII)


def tokens(
    file: str, lines: list[str], comments: list[tuple[int, str]], *, whole_calls: bool = True
) -> Iterator[Token]:
    """Return the tokens of a module, at last `end`; a line is taken to pieces when its first one is asked for.

    Args:
        file: its name, for errors.
        lines: its text.
        comments: takes the number and text of each line that is a comment.
        whole_calls: whether instructions behind an aggregate of numbers come as one token.

    Raises:
        VerificationError: a character begins no token, a text has no end, or a placeholder was left standing.
    """
    return chain.from_iterable(_by_line(file, lines, comments, whole_calls=whole_calls))


def _by_line(
    file: str, lines: list[str], comments: list[tuple[int, str]], *, whole_calls: bool
) -> Iterator[Iterable[Token]]:
    # Only where a statement begins is a line with a whole instruction one: behind the last token of a line before it.
    last = ""
    series = _Series()
    known: dict[str, _Meaning] = {}
    for number, line in enumerate(lines, start=1):
        begins = whole_calls and last == ";"
        if not line or (begins and series.takes(line, number)):
            continue
        yield series.taken()
        if begins and (call := _whole_call(line, number)) is not None:
            yield [("call", call, number)]
        elif found := _of_line(line, Place(file, number), comments, known):
            last = found[-1][0]
            yield found
    yield series.taken()
    yield [("end", "", len(lines))]


def _of_line(line: str, place: Place, comments: list[tuple[int, str]], known: dict[str, _Meaning]) -> list[Token]:
    text = line.strip()
    if text.startswith("!"):
        comments.append((place.line, text))
        return []
    if "[" not in line:
        return _of_words(_ALL_FORMS.findall(line), place, known)
    found: list[Token] = []
    at = tried = 0
    while (match := _ALL_FORMS.search(line, at)) is not None:
        at, value = match.end(), None
        if match[0] == "[" and at > tried:
            try:
                value, tried = _numbers(line, at - 1)
            except RecursionError as error:
                raise refusal(place, TOO_DEEP) from error
        if value is None:
            found += _of_words([match[0]], place, known)
        else:
            at = tried
            found.append(("numbers", value, place.line))
    return found


def _of_words(words: list[str], place: Place, known: dict[str, _Meaning]) -> list[Token]:
    # A program has few different words, and many of each.
    number = place.line
    found: list[Token] = []
    for word in words:
        meaning = known.get(word)
        if meaning is None:
            meaning = known[word] = _meaning(word, place)
        kind, value = meaning
        if kind != "comment":
            found.append((kind, value, number))
    return found


@final
class _Series:
    """Gathers the calls of robtargets that stand one behind the other."""

    def __init__(self) -> None:
        self._lines, self._forms, self._numbers = array("i"), array("i"), array("d")
        # The first call of each form, and its number by what stands before and behind the target; -1 for no such call.
        self._shapes: list[Call] = []
        self._known: dict[tuple[str, str], int] = {}

    def takes(self, line: str, number: int) -> bool:
        """Take a line, and say whether it is such a call."""
        match = _TARGET.match(line)
        if match is None:
            return False
        verb, *parts, tail = match.groups()
        form = self._known.get((verb, tail))
        if form is None:
            call = _whole_call(line, number)
            form = self._known[verb, tail] = -1 if call is None else len(self._shapes)
            if call is not None:
                self._shapes.append(call)
        if form < 0:
            return False
        try:
            found = [float(one) for one in ",".join(parts).split(",")]
        except ValueError:
            return False
        self._numbers.extend(found)
        self._lines.append(number)
        self._forms.append(form)
        return True

    def taken(self) -> list[Token]:
        """Return what was taken since this was asked last, as one token."""
        if not self._lines:
            return []
        whole = Series(self._lines, self._forms, self._numbers, self._shapes)
        self._lines, self._forms, self._numbers = array("i"), array("i"), array("d")
        return [("call", whole, whole.lines[0])]


def _meaning(word: str, place: Place) -> _Meaning:
    match = _WORD_KINDS.match(word)
    kind = "bad" if match is None else str(match.lastgroup)
    if kind == "name":
        return (reserved if (reserved := word.upper()) in RESERVED else kind), word
    if kind == "sign":
        return word, word
    if kind == "number":
        base = _BASES.get(word[1:2].lower(), 10)
        return kind, float(word) if base == 10 else float(int(word[2:], base))
    if kind == "string":
        return kind, _ESCAPE.sub(_unescaped, word[1:-1])
    if kind == "comment":
        return kind, word
    if kind == "hole" and word[1:-1] in _PLACEHOLDERS:
        reason = f"the placeholder {word} was never filled in"
    else:
        reason = "a text has no closing quotation mark" if word == '"' else f"{word!r} has no meaning in RAPID"
    raise refusal(place, reason)


def _unescaped(escape: re.Match[str]) -> str:
    return chr(int(escape[1], 16)) if escape[1] else escape[0][0]


def _numbers(line: str, at: int) -> tuple[Value | None, int]:
    """Return the aggregate of numbers that begins here, or None, and where it ends, or up to where there is none.

    What the scanner does not take is not tried again from within, so that a line is read once, whatever it holds.
    """
    try:
        value, end = cast("tuple[list[object], int]", _DECODER.raw_decode(line, at))
    except json.JSONDecodeError as error:
        return None, error.pos
    return (_frozen(value) if _NUMBERS.fullmatch(line, at, end) else None), end


def _frozen(parts: list[object]) -> Value:
    # Tens of thousands of targets come here; most lists are flat.
    if list in map(type, parts):
        nested = cast("list[list[object] | float]", parts)
        return tuple([_frozen(part) if isinstance(part, list) else part for part in nested])
    return tuple(cast("list[float]", parts))


def _whole_call(line: str, number: int) -> Call | None:
    head = _CALL.match(line)
    if head is None:
        return None
    try:
        value, at = _numbers(line, head.end())
    except RecursionError:
        return None
    if value is None:
        return None
    tail = _TAIL.match(line, at)
    if tail is None:
        return None
    parts = _PART.findall(tail[1])
    if not RESERVED.isdisjoint([head[1].upper(), *(word.upper() for part in parts for word in part)]):
        return None
    rest = [Argument(number, option, Name(number, word), option != "") for option, word in parts]
    return Call(number, head[1], None, (Argument(number, "", Literal(number, value), optional=False), *rest))


# Stands at one token of a module after the other, for the parsers.


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
            refuse(Place(self._file, self.last_line), f"{kind} is missing after {after}: found {self.shown()}")
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
