"""Judges the statements of routines: conditions, assignments, calls, jumps and what leaves a routine."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from geoprint.export.rapid.language.calls import form_of, judge_arguments, root_of
from geoprint.export.rapid.language.context import Context
from geoprint.export.rapid.language.expression_kinds import judge, judge_parts
from geoprint.export.rapid.language.kinds import BOOL, LARGEST_NUM, NUM, STRING, Kind, fits
from geoprint.export.rapid.language.syntax import (
    Assignment,
    Call,
    Connect,
    Datum,
    For,
    Goto,
    If,
    Label,
    Leave,
    Literal,
    Routine,
    Series,
    Statement,
    Test,
    While,
)

_INTERRUPT = Kind("num")


def judge_body(statements: Sequence[Statement], here: Context) -> None:
    """Judge statements, and those within them."""
    for statement in statements:
        match statement:
            case Call():
                _once(statement, here)
            case Series():
                _series(statement, here)
            case Assignment():
                _once(statement, here)
            case If() | Test() | For() | While():
                _compound(statement, here)
            case Leave():
                _leave(statement, here)
            case Goto() | Label():
                _jump(statement, here)
            case Connect():
                _connect(statement, here)


def labels_in(statements: Iterable[Statement]) -> list[Label]:
    """Return the labels among statements and those within them."""
    found: list[Label] = []
    for statement in statements:
        match statement:
            case Label():
                found.append(statement)
            case If():
                for _, body in statement.branches:
                    found += labels_in(body)
                found += labels_in(statement.otherwise)
            case Test():
                for _, body in statement.cases:
                    found += labels_in(body)
                found += labels_in(statement.default)
            case For() | While():
                found += labels_in(statement.body)
            case _:
                pass
    return found


def _compound(statement: If | Test | For | While, here: Context) -> None:
    match statement:
        case If():
            for condition, body in statement.branches:
                judge(condition, here, wanted=BOOL, what="IF")
                judge_body(body, here)
            judge_body(statement.otherwise, here)
        case Test():
            _test(statement, here)
        case For():
            for bound in (statement.first, statement.last, statement.step):
                if bound is not None:
                    judge(bound, here, wanted=NUM, what="FOR")
            judge_body(statement.body, here.within_loop(statement.variable, statement.line))
        case While():
            judge(statement.condition, here, wanted=BOOL, what="WHILE")
            judge_body(statement.body, here)


def _test(test: Test, here: Context) -> None:
    subject = judge(test.subject, here)
    wanted = NUM if subject is not None and subject.name.startswith("signal") else subject
    for values, body in test.cases:
        for value in values:
            judge(value, here, wanted=wanted, what="CASE")
        judge_body(body, here)
    judge_body(test.default, here)


def _assignment(assignment: Assignment, here: Context) -> None:
    target = judge(assignment.target, here)
    root = root_of(assignment.target)
    symbol = here.find(root.name) if root else None
    if symbol is not None and root is not None:
        if isinstance(symbol.node, Datum) and symbol.node.storage == "CONST":
            here.say(assignment.line, f"{root.name} is a CONST, and a value is assigned to it")
        elif symbol.role in {"loop", "signal"}:
            here.say(assignment.line, f"no value can be assigned to {root.name}, which is a {symbol.role}")
    judge(assignment.value, here, wanted=target, what="the assignment")


def _once(statement: Call | Assignment, here: Context) -> None:
    """Judge a call or an assignment, or leave it where one that differs in numbers only was judged before."""
    form = None if here.inner else form_of(statement)
    if form is None:
        _judge_one(statement, here)
    elif form not in here.sound:
        if _is_sound(statement, here):
            here.sound.add(form)
        else:
            _judge_one(statement, here)


def _judge_one(statement: Call | Assignment, here: Context) -> None:
    if isinstance(statement, Assignment):
        _assignment(statement, here)
    else:
        _call(statement, here)


def _call(call: Call, here: Context) -> None:
    if call.late is not None:
        judge(call.late, here, wanted=STRING, what="a late call")
        if not isinstance(call.late, Literal) or not isinstance(call.late.value, str):
            judge_parts(call.arguments, here)
            return
    name = call.late.value if isinstance(call.late, Literal) else call.name
    # A late call may name the module, too.
    name = str(name).rpartition(":")[2]
    symbol = here.find(name)
    if symbol is None:
        here.miss(call.line, name)
    elif symbol.role not in {"routine", "known"}:
        here.say(call.line, f"{name} is no procedure")
    elif isinstance(symbol.node, Routine) and symbol.node.kind != "PROC":
        here.say(call.line, f"{name} is a {symbol.node.kind}, and a procedure is wanted")
    elif isinstance(symbol.node, Routine):
        judge_arguments(call.line, call.arguments, symbol, here, judge=judge)
        return
    judge_parts(call.arguments, here)


def _series(series: Series, here: Context) -> None:
    """Judge one call of each form; where something is wrong with one, or a number is too large, all of them."""
    sound: set[object] = set() if here.inner else here.sound
    forms = {form for form in set(series.forms) if form not in sound}
    wrong = [form for form in sorted(forms) if not _is_sound(series.shapes[form], here)]
    if wrong or max(series.numbers) > LARGEST_NUM or min(series.numbers) < -LARGEST_NUM:
        for call in series.calls():
            _call(call, here)
    else:
        sound.update(forms)


def _is_sound(statement: Call | Assignment, here: Context) -> bool:
    """Whether nothing is wrong with a statement."""
    wrong: list[str] = []

    def note(_: int, what: str) -> None:
        wrong.append(what)

    _judge_one(statement, replace(here, say=note, miss=note))
    return not wrong


def _leave(leave: Leave, here: Context) -> None:
    routine = here.routine
    if leave.verb in {"RETRY", "TRYNEXT"} and not here.handling:
        here.say(leave.line, f"{leave.verb} stands outside an error handler")
    elif leave.verb == "RAISE":
        if leave.value is not None:
            judge(leave.value, here, wanted=NUM, what="RAISE")
        elif not here.handling:
            here.say(leave.line, "RAISE without a number stands outside an error handler")
    elif leave.verb == "RETURN" and routine is not None:
        if routine.kind != "FUNC" and leave.value is not None:
            here.say(leave.line, f"{routine.name} is a {routine.kind} and returns no value")
        elif routine.kind == "FUNC" and leave.value is None:
            here.say(leave.line, f"{routine.name} is a function, and RETURN brings no value")
        elif leave.value is not None:
            wanted = here.kinds.of_type(routine.returns, file=here.file)
            judge(leave.value, here, wanted=wanted, what=f"RETURN of {routine.name}")


def _jump(statement: Goto | Label, here: Context) -> None:
    if isinstance(statement, Goto) and statement.label.lower() not in here.labels:
        here.say(statement.line, f"GOTO {statement.label}: no such label in this routine")


def _connect(connect: Connect, here: Context) -> None:
    kind = judge(connect.interrupt, here)
    if not fits(kind, _INTERRUPT) and kind is not None:
        here.say(connect.line, f"CONNECT wants an intnum, found a {kind.shown()}")
    trap = here.find(connect.trap)
    if trap is None:
        here.miss(connect.line, connect.trap)
    elif trap.role != "known" and (not isinstance(trap.node, Routine) or trap.node.kind != "TRAP"):
        here.say(connect.line, f"{connect.trap} is no trap")
