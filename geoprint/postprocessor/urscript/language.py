"""Reads URScript: the subset that geoprint writes, line by line, into a tree of statements.

The grammar is that of [URScript], sections "Numbers, Variables, and Types" to "Threads": a program is a function,
functions and threads may stand within it, a line is a statement, and `end` closes what a colon has opened.
What is not of the subset is refused with its line, never skipped.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TypeAlias, final

from geoprint.errors import VerificationError
from geoprint.model import comparable
from geoprint.postprocessor.execution import refusal

_TOKEN = re.compile(
    r"\s*(?:(?P<number>\d+\.\d*(?:[eE][-+]?\d+)?|\d+(?:[eE][-+]?\d+)?)|(?P<pose>p\[)|(?P<name>[A-Za-z_]\w*)"
    r'|(?P<text>"[^"]*")|(?P<sign>==|!=|<=|>=|[-+*/%<>=()\[\],:]))'
)
_KEYWORDS = frozenset(
    "and break def elif else end global halt if join kill local not or pause return run thread while".split(" ")  # noqa: SIM905
)
# Far more than geoprint writes: signs and words in a line, and expressions or blocks within one another.
_MOST_TOKENS, _DEEPEST = 200, 20
_COMPARISONS = frozenset({"==", "!=", "<", ">", "<=", ">="})


@final
@comparable
class Constant:
    """A number, a truth value or a text."""

    value: float | int | bool | str


@final
@comparable
class Name:
    """A variable."""

    name: str


@final
@comparable
class Items:
    """A list, or a pose of six numbers."""

    items: tuple[Expression, ...]
    is_pose: bool


@final
@comparable
class Operation:
    """One or two operands and what joins them; `[` takes an item."""

    sign: str
    operands: tuple[Expression, ...]


@final
@comparable
class Call:
    """A function with its arguments; `starts` where a thread is started."""

    name: str
    arguments: tuple[Expression, ...]
    named: tuple[tuple[str, Expression], ...]
    starts: bool


Expression: TypeAlias = Constant | Name | Items | Operation | Call


@final
@comparable
class Statement:
    """A statement.

    Attributes:
        kind: 'set', 'call', 'if', 'while', 'return', 'halt', 'join', 'kill'.
        line: number of its line, from 1.
        scope: 'global', 'local' or '' of what is set.
        name: what is set, joined or killed.
        value: that is set, called, returned or asked.
        body: of a loop; of a branch, where it holds.
        otherwise: of a branch, where it does not.
    """

    kind: str
    line: int
    scope: str = ""
    name: str = ""
    value: Expression | None = None
    body: tuple[Statement, ...] = ()
    otherwise: tuple[Statement, ...] = ()


@final
@comparable
class Routine:
    """A function or a thread: its name, where it begins, the names of its arguments, and its statements."""

    name: str
    line: int
    is_thread: bool
    arguments: tuple[str, ...]
    body: tuple[Statement, ...]


@final
@comparable
class Script:
    """A program: its own function, and the functions and threads within it."""

    file: str
    main: Routine
    routines: tuple[Routine, ...]
    comments: tuple[tuple[int, str], ...]

    @property
    def lines(self) -> frozenset[int]:
        """Numbers of the lines with statements."""
        found: set[int] = set()
        left = [each for routine in (self.main, *self.routines) for each in routine.body]
        while left:
            each = left.pop()
            found.add(each.line)
            left += [*each.body, *each.otherwise]
        return frozenset(found)


def parse_script(file: str, text: str) -> Script:
    """Return the program of a file.

    Raises:
        VerificationError: a line is not of the subset; it is named.
    """
    return _Reader(file, text).script()


@final
class _Line:
    """The tokens of a line, read one after another."""

    def __init__(self, file: str, number: int, text: str) -> None:
        self.file, self.number = file, number
        self.tokens: list[tuple[str, str]] = []
        self.at, self.depth = 0, 0
        place, length = 0, len(text.rstrip())
        while place < length:
            match = _TOKEN.match(text, place)
            if match is None:
                raise self.refused(f"{text[place : place + 40].strip()!r} is not understood")
            kind = match.lastgroup or ""
            self.tokens.append((kind, match[kind]))
            place = match.end()
        if len(self.tokens) > _MOST_TOKENS:
            raise self.refused(f"more than {_MOST_TOKENS} words and signs stand in the line")

    def refused(self, reason: str) -> VerificationError:
        """Return the error that names the line."""
        return refusal(self.file, self.number, reason)

    def next_is(self, *texts: str) -> bool:
        """Return whether one of these stands next."""
        return self.at < len(self.tokens) and self.tokens[self.at][0] != "text" and self.tokens[self.at][1] in texts

    def take(self, text: str) -> bool:
        """Go over a word or sign, if it stands next."""
        if self.next_is(text):
            self.at += 1
            return True
        return False

    def need(self, text: str) -> None:
        """Go over a word or sign, which must stand next."""
        if not self.take(text):
            found = self.tokens[self.at][1] if self.at < len(self.tokens) else "the end of the line"
            raise self.refused(f"{text!r} must stand here, found {found!r}")

    def name(self) -> str:
        """Read a name."""
        if self.at == len(self.tokens) or self.tokens[self.at][0] != "name" or self.tokens[self.at][1] in _KEYWORDS:
            raise self.refused("a name must stand here")
        self.at += 1
        return self.tokens[self.at - 1][1]

    def done(self) -> None:
        """Refuse what is left."""
        if self.at < len(self.tokens):
            raise self.refused(f"{self.tokens[self.at][1]!r} follows the end of the statement")

    def expression(self) -> Expression:
        """Read a value."""
        return self._within(lambda: self._joined(("or",), lambda: self._joined(("and",), self._negated)))

    def _within(self, read: Callable[[], Expression]) -> Expression:
        """Read what stands within another value."""
        self.depth += 1
        if self.depth > _DEEPEST:
            raise self.refused(f"more than {_DEEPEST} values stand within one another")
        value = read()
        self.depth -= 1
        return value

    def _negated(self) -> Expression:
        if self.take("not"):
            return Operation("not", (self._within(self._negated),))
        return self._compared()

    def _compared(self) -> Expression:
        left = self._sum()
        if self.next_is(*_COMPARISONS):
            sign = self.tokens[self.at][1]
            self.at += 1
            return Operation(sign, (left, self._sum()))
        return left

    def _sum(self) -> Expression:
        return self._joined(("+", "-"), lambda: self._joined(("*", "/", "%"), self._signed))

    def _joined(self, signs: tuple[str, ...], operand: Callable[[], Expression]) -> Expression:
        left = operand()
        while self.next_is(*signs):
            sign = self.tokens[self.at][1]
            self.at += 1
            left = Operation(sign, (left, operand()))
        return left

    def _signed(self) -> Expression:
        if self.take("-"):
            operand = self._within(self._signed)
            if isinstance(operand, Constant) and isinstance(operand.value, (int, float)):
                return Constant(-operand.value)
            return Operation("-", (operand,))
        value = self._single()
        while self.take("["):
            value = Operation("[", (value, self.expression()))
            self.need("]")
        return value

    def _single(self) -> Expression:
        if self.at == len(self.tokens):
            raise self.refused("the line is cut off")
        kind, text = self.tokens[self.at]
        self.at += 1
        if kind == "name":
            return self._named(text)
        if kind == "number":
            return Constant(int(text) if text.isdigit() else float(text))
        if kind == "text":
            return Constant(text[1:-1])
        if kind == "pose" or text == "[":
            return Items(tuple(self._listed("]")), kind == "pose")
        if text != "(":
            raise self.refused(f"{text!r} stands where a value must be")
        value = self.expression()
        self.need(")")
        return value

    def _named(self, text: str) -> Expression:
        if text == "run":
            return self._call(self.name(), starts=True)
        if text in _KEYWORDS:
            raise self.refused(f"{text!r} stands where a value must be")
        if text in {"True", "False"}:
            return Constant(text == "True")
        return self._call(text, starts=False) if self.next_is("(") else Name(text)

    def _listed(self, closing: str) -> list[Expression]:
        items: list[Expression] = []
        while not self.take(closing):
            if items:
                self.need(",")
            items.append(self.expression())
        return items

    def _call(self, name: str, *, starts: bool) -> Call:
        self.need("(")
        arguments: list[Expression] = []
        named: list[tuple[str, Expression]] = []
        while not self.take(")"):
            if arguments or named:
                self.need(",")
            value = self.expression()
            if isinstance(value, Name) and self.take("="):
                named.append((value.name, self.expression()))
            elif named:
                raise self.refused("an argument without a name follows one with a name")
            else:
                arguments.append(value)
        return Call(name, tuple(arguments), tuple(named), starts)


@final
class _Reader:
    """The lines of a file, read one after another."""

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        self.comments: list[tuple[int, str]] = []
        self.lines: list[_Line] = []
        for number, line in enumerate(text.split("\n"), start=1):
            bare, comment = _without_comment(line)
            if comment is not None:
                self.comments.append((number, comment))
            if bare.strip():
                self.lines.append(_Line(file, number, bare))
        self.at, self.depth = 0, 0
        self.routines: list[Routine] = []

    def script(self) -> Script:
        """Read all of it."""
        if not self.lines:
            raise refusal(self.file, 1, "there is no program")
        main = self._routine()
        if self.at < len(self.lines):
            raise self.lines[self.at].refused("this follows the end of the program")
        names = [main.name, *(each.name for each in self.routines)]
        for routine in self.routines:
            if names.count(routine.name) > 1:
                raise refusal(self.file, routine.line, f"{routine.name} is defined twice")
        return Script(self.file, main, tuple(self.routines), tuple(self.comments))

    def _routine(self) -> Routine:
        line = self.lines[self.at]
        is_thread = line.take("thread")
        if not is_thread:
            line.need("def")
        name = line.name()
        line.need("(")
        arguments: list[str] = []
        while not line.take(")"):
            if arguments:
                line.need(",")
            arguments.append(line.name())
        line.need(":")
        line.done()
        self.at += 1
        body = self._block(within=line)
        self._close(line)
        return Routine(name, line.number, is_thread, tuple(arguments), body)

    def _close(self, opened: _Line) -> None:
        if self.at == len(self.lines) or not self.lines[self.at].take("end"):
            raise opened.refused("no 'end' closes what begins here")
        self.lines[self.at].done()
        self.at += 1

    def _block(self, *, within: _Line) -> tuple[Statement, ...]:
        self.depth += 1
        if self.depth > _DEEPEST:
            raise within.refused(f"more than {_DEEPEST} blocks stand within one another")
        found: list[Statement] = []
        while self.at < len(self.lines) and not self.lines[self.at].next_is("end", "else", "elif"):
            if self.lines[self.at].next_is("def", "thread"):
                if within is not self.lines[0]:
                    raise self.lines[self.at].refused("a function begins within a block")
                self.routines.append(self._routine())
            else:
                found.append(self._statement())
        self.depth -= 1
        return tuple(found)

    def _statement(self) -> Statement:
        line = self.lines[self.at]
        if line.next_is("if"):
            return self._branch()
        self.at += 1
        number = line.number
        if line.take("while"):
            value = line.expression()
            line.need(":")
            line.done()
            body = self._block(within=line)
            self._close(line)
            return Statement("while", number, value=value, body=body)
        return self._simple(line)

    def _simple(self, line: _Line) -> Statement:
        number = line.number
        for word in ("halt", "join", "kill"):
            if line.take(word):
                name = "" if word == "halt" else line.name()
                line.done()
                return Statement(word, number, name=name)
        if line.take("return"):
            value = None if line.at == len(line.tokens) else line.expression()
            line.done()
            return Statement("return", number, value=value)
        scope = next((word for word in ("global", "local") if line.take(word)), "")
        value = line.expression()
        if isinstance(value, Name) and line.take("="):
            statement = Statement("set", number, scope=scope, name=value.name, value=line.expression())
        elif isinstance(value, Call) and not scope:
            statement = Statement("call", number, value=value)
        else:
            raise line.refused("this is no statement")
        line.done()
        return statement

    def _branch(self) -> Statement:
        line = self.lines[self.at]
        self.at += 1
        line.at += 1
        value = line.expression()
        line.need(":")
        line.done()
        body = self._block(within=line)
        otherwise: Sequence[Statement] = ()
        if self.at < len(self.lines) and self.lines[self.at].next_is("elif"):
            # It closes with the same end, and is a block within this one.
            self.depth += 1
            other = self._branch()
            self.depth -= 1
            return Statement("if", line.number, value=value, body=body, otherwise=(other,))
        if self.at < len(self.lines) and self.lines[self.at].take("else"):
            self.lines[self.at].need(":")
            self.lines[self.at].done()
            self.at += 1
            otherwise = self._block(within=line)
        self._close(line)
        return Statement("if", line.number, value=value, body=body, otherwise=tuple(otherwise))


def _without_comment(line: str) -> tuple[str, str | None]:
    """Return a line without its comment, and the comment."""
    if "#" not in line:
        return line, None
    quoted = False
    for place, letter in enumerate(line):
        quoted ^= letter == '"'
        if letter == "#" and not quoted:
            return line[:place], line[place + 1 :].strip()
    return line, None
