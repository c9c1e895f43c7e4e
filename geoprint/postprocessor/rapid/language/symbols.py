"""Resolves the names of a whole task: declared once, every use means something, and arguments and values fit.

It judges the text as it is written and knows nothing of whoever wrote it. In a closed task everything must resolve; in
an open one (not all modules are at hand) a name that nothing declares may stand in another module.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias, final

from geoprint.errors import VerificationError
from geoprint.postprocessor.rapid.language.context import Context
from geoprint.postprocessor.rapid.language.judging import judge, judge_body, labels_in
from geoprint.postprocessor.rapid.language.kinds import NUM, Kinds
from geoprint.postprocessor.rapid.language.names import Names, Symbol, declared, declared_in, names_of
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.language.syntax import (
    Aggregate,
    Alias,
    Binary,
    Component,
    Datum,
    Element,
    Expression,
    FunctionCall,
    Literal,
    Module,
    Name,
    Place,
    Routine,
    Unary,
    refusal,
)

# Judges declared data: types exist, constants are constant, PERS begin with literals, arrays have sizes.


def judge_data(data: Sequence[Datum], here: Context, *, closed: bool) -> None:
    """Judge data of a module or a routine."""
    for datum in data:
        judge_type(datum.kind, datum.line, here)
        for size in datum.sizes:
            judge(size, here, wanted=NUM, what="the size of an array")
            _judge_constant(size, f"the size of {datum.name}", here)
        if datum.value is not None:
            _judge_value(datum, datum.value, here)
        elif datum.storage == "CONST":
            here.say(datum.line, f"{datum.name} is a CONST without a value")
        elif datum.storage == "PERS" and closed:
            here.say(datum.line, f"{datum.name} is a PERS without an initial value")


def judge_type(name: str, line: int, here: Context) -> None:
    """Judge the name of a type where one is used."""
    symbol = here.names.find(name, file=here.file, inner={})
    if symbol is None:
        here.miss(line, name)
    elif symbol.role not in {"type", "known"}:
        here.say(line, f"{name} is not a type")


def _judge_value(datum: Datum, value: Expression, here: Context) -> None:
    kind = here.kinds.of_type(datum.kind, file=here.file, dimensions=len(datum.sizes))
    if isinstance(value, Literal):
        sizes = tuple(_number(size) for size in datum.sizes)
        if why := here.kinds.misfit(value.value, kind, sizes):
            here.say(value.line, f"{datum.name}: {why}")
        return
    judge(value, here, wanted=kind, what=datum.name)
    if datum.storage == "PERS":
        here.say(datum.line, f"{datum.name} is a PERS, so its initial value must be a literal")
    else:
        _judge_constant(value, datum.name, here)


def _number(size: Expression) -> int | None:
    return int(size.value) if isinstance(size, Literal) and isinstance(size.value, float) else None


def _judge_constant(expression: Expression, what: str, here: Context) -> None:
    """Judge that nothing in an expression can change."""
    match expression:
        case Aggregate():
            for part in expression.parts:
                _judge_constant(part, what, here)
        case Binary():
            _judge_constant(expression.left, what, here)
            _judge_constant(expression.right, what, here)
        case Unary():
            _judge_constant(expression.operand, what, here)
        case Component() | Element():
            _judge_constant(expression.of, what, here)
        case FunctionCall():
            here.say(expression.line, f"{what} must be constant, but {expression.name} is a function")
        case Name():
            symbol = here.find(expression.name)
            if symbol is not None and isinstance(symbol.node, Datum) and symbol.node.storage != "CONST":
                here.say(expression.line, f"{what} must be constant, but {expression.name} is a {symbol.node.storage}")
        case Literal():
            pass


# Judges what a task declares: each name once, short enough, not the controller's, and in RAPID's order.


# Takes file, line and reason of what is wrong.
Say: TypeAlias = Callable[[str, int, str], None]
NAME_LENGTH = 32


def judge_names(modules: Sequence[Module], names: Names, say: Say, *, closed: bool) -> None:
    """Judge the names that modules declare outside their routines.

    In a closed task a module's name is one of them, and none is the name of what the controller brings: who reads the
    one would get the other. A controller keeps some of that, such as reg1, in a module of its own, user.
    """
    first: dict[str, Symbol] = {}
    for module in modules:
        heads = [Symbol(module.name, "module", module.file, 1, None)]
        known = first.setdefault(f"module {module.name.lower()}", heads[0])
        if known is not heads[0]:
            say(module.file, 1, f"module {module.name} is declared twice: also in {known.file}")
        own: dict[str, Symbol] = {}
        if closed:
            _judge_once(heads, first, say)
        for symbol, is_local in declared(module):
            _judge_once([symbol], own, say)
            if not is_local and own[symbol.name.lower()] is symbol:
                _judge_once([symbol], first, say)
            brought = names.brought.get(symbol.name.lower())
            if closed and module.name.lower() != "user" and brought is not None and brought.node is not None:
                say(symbol.file, symbol.line, f"{symbol.name} is built into the controller, but is declared again")
        for symbol in heads + [one for one, _ in declared(module)]:
            _judge_length(symbol, say)


def judge_module(module: Module, outside: Context, *, closed: bool) -> None:
    """Judge types, data and routines of a module."""
    _judge_order(module, outside)
    for kind in module.types:
        for of in [kind.of] if isinstance(kind, Alias) else [of for of, _ in kind.components]:
            judge_type(of, kind.line, outside)
    judge_data(module.data, outside, closed=closed)
    for routine in module.routines:
        _judge_routine(routine, outside, closed=closed)


def _judge_order(module: Module, outside: Context) -> None:
    """Judge that types stand before data and data before routines, as RAPID wants them."""
    for kind in module.types:
        if any(kind.line > other.line for other in (*module.data[:1], *module.routines[:1])):
            outside.say(kind.line, f"{kind.name} is declared after data or a routine; RAPID needs types first")
    for datum in module.data:
        if any(datum.line > routine.line for routine in module.routines[:1]):
            outside.say(datum.line, f"{datum.name} is declared after a routine; RAPID needs data first")


def _judge_routine(routine: Routine, outside: Context, *, closed: bool) -> None:
    symbols = declared_in(routine, outside.file)
    own: dict[str, Symbol] = {}
    _judge_once(symbols, own, lambda _, line, reason: outside.say(line, reason))
    for symbol in symbols:
        _judge_length(symbol, lambda _, line, reason: outside.say(line, reason))
    bodies = [routine.body, routine.undo, routine.backward, *(handler.body for handler in routine.handlers)]
    labels: dict[str, int] = {}
    for label in (label for body in bodies for label in labels_in(body)):
        if labels.setdefault(label.name.lower(), label.line) != label.line:
            outside.say(label.line, f"the label {label.name} is declared twice in {routine.name}")
    here = outside.within(routine, own, frozenset(labels))
    if routine.returns:
        judge_type(routine.returns, routine.line, here)
    for parameter in routine.parameters:
        judge_type(parameter.kind, parameter.line, here)
    judge_data(routine.data, here, closed=closed)
    for body in bodies[:3]:
        judge_body(body, here)
    for handler in routine.handlers:
        for error in handler.errors:
            judge(error, here, wanted=NUM, what="ERROR")
        judge_body(handler.body, here.within_handler())


def _judge_once(symbols: Iterable[Symbol], first: dict[str, Symbol], say: Say) -> None:
    for symbol in symbols:
        known = first.setdefault(symbol.name.lower(), symbol)
        if known is not symbol and known.file:
            say(
                symbol.file,
                symbol.line,
                f"{symbol.name} is declared twice: also in {known.file}, line {known.line}; RAPID ignores case, and "
                "data and routines share their names",
            )


def _judge_length(symbol: Symbol, say: Say) -> None:
    if len(symbol.name) > NAME_LENGTH:
        length = len(symbol.name)
        say(symbol.file, symbol.line, f"a name has at most {NAME_LENGTH} characters, {symbol.name!r} has {length}")


@final
@dataclass(frozen=True, slots=True)
class Task:
    """Modules whose names are resolved.

    Attributes:
        modules: as given.
        names: what each name means.
        open_names: file, line and name of what nothing declares; empty in a closed task.
    """

    modules: tuple[Module, ...]
    names: Names
    open_names: tuple[tuple[str, int, str], ...]


def read_task(modules: Sequence[tuple[str, str]], *, signals: Mapping[str, str] | None, closed: bool = True) -> Task:
    """Parse the modules of a task and resolve its names.

    Args:
        modules: file name and text of each module, those loaded later among them; a list of modules (.pgf) says
            nothing.
        signals: as for `resolve`.
        closed: as for `resolve`.

    Raises:
        VerificationError: a text is no RAPID, or something in it means nothing; the first such place is named.
    """
    texts = [(file, text) for file, text in modules if not file.endswith(".pgf")]
    return resolve([parse_module(file, text) for file, text in texts], signals=signals, closed=closed)


def resolve(modules: Sequence[Module], *, signals: Mapping[str, str] | None, closed: bool = True) -> Task:
    """Resolve the names of a task.

    Args:
        modules: all of the task, those loaded later among them.
        signals: type of each signal of the cell (`signaldo`, ...) by its name; where None, whatever stands in the
            place of a signal is one of the controller's configuration.
        closed: whether everything must resolve.

    Raises:
        VerificationError: something is wrong; the first such place is named.
    """
    task, errors = examine(modules, signals=signals, closed=closed)
    if errors:
        raise errors[0]
    return task


def examine(
    modules: Sequence[Module], *, signals: Mapping[str, str] | None, closed: bool = True
) -> tuple[Task, list[VerificationError]]:
    """Return a task and all that is wrong in it, in the order of its modules; the arguments are those of `resolve`."""
    names = names_of(modules, signals=signals)
    errors: list[VerificationError] = []
    missing: list[tuple[str, int, str]] = []
    assumed: set[str] = set()

    def say(file: str, line: int, reason: str) -> None:
        errors.append(refusal(Place(file, line), reason))

    def miss(file: str, line: int, name: str) -> None:
        missing.append((file, line, name))

    def assume(name: str) -> None:
        assumed.add(name.lower())

    judge_names(modules, names, say, closed=closed)
    kinds = Kinds(names)
    for module in modules:
        here = Context(names, kinds, module.file, partial(say, module.file), partial(miss, module.file), assume)
        try:
            judge_module(module, here, closed=closed)
        except RecursionError:
            say(module.file, 1, "statements or operators are nested too deeply")
    missing = [entry for entry in missing if entry[2].lower() not in assumed]
    if closed:
        for file, line, name in missing:
            say(file, line, f"{name} is not declared, and is not built into the controller")
    return Task(tuple(modules), names, tuple(missing)), errors
