"""Judges what a task declares: each name once, short enough, not the controller's, and in RAPID's order."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeAlias

from geoprint.export.rapid.language.bodies import judge_body, labels_in
from geoprint.export.rapid.language.constants import judge_data, judge_type
from geoprint.export.rapid.language.context import Context
from geoprint.export.rapid.language.expression_kinds import judge
from geoprint.export.rapid.language.kinds import NUM
from geoprint.export.rapid.language.names import Names, Symbol, declared, declared_in
from geoprint.export.rapid.language.syntax import Alias, Module, Routine

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
            say(module.file, 1, f"module {module.name} is there twice: also in {known.file}")
        own: dict[str, Symbol] = {}
        if closed:
            _judge_once(heads, first, say)
        for symbol, is_local in declared(module):
            _judge_once([symbol], own, say)
            if not is_local and own[symbol.name.lower()] is symbol:
                _judge_once([symbol], first, say)
            brought = names.brought.get(symbol.name.lower())
            if closed and module.name.lower() != "user" and brought is not None and brought.node is not None:
                say(symbol.file, symbol.line, f"{symbol.name} is what the controller brings, and is declared anew")
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
            outside.say(kind.line, f"{kind.name} is declared behind data or a routine; RAPID wants types first")
    for datum in module.data:
        if any(datum.line > routine.line for routine in module.routines[:1]):
            outside.say(datum.line, f"{datum.name} is declared behind a routine; RAPID wants data first")


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
            outside.say(label.line, f"the label {label.name} is there twice in {routine.name}")
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
