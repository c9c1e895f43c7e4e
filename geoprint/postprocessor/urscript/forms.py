"""Reads a script, and holds its settings, its guard and the order of its statements against what is written."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TypeAlias

from geoprint.errors import VerificationError
from geoprint.model import Cell, Placement
from geoprint.postprocessor.execution import Settings, refusal
from geoprint.postprocessor.urscript.guard import guard_lines
from geoprint.postprocessor.urscript.language import (
    Constant,
    Expression,
    Items,
    Name,
    Operation,
    Script,
    Statement,
    parse_script,
)

FILE = "geoprint.script"
_SETTINGS = ("geo_dry_run", "geo_speed_pct", "geo_first_run")

_POSE, _JOINTS = "p[#,#,#,#,#,#]", "[#,#,#,#,#,#]"
# What a program sets before the guard, and to which values: # is a number, ? a truth value.
_DATA = {
    "geo_dry_run": "?", "geo_speed_pct": "#", "geo_first_run": "#", "geo_runs": "#", "geo_tcp": _POSE, "geo_mass": "#",
    "geo_cog": "[#,#,#]", "geo_inertia": _JOINTS, "geo_fixture": _POSE, "geo_part": _POSE, "geo_home": _JOINTS,
    "geo_first": _POSE, "geo_start": _JOINTS, "geo_aloft": _JOINTS, "geo_there": "#", "geo_back": "#",
}  # fmt: skip

# What may follow what: states, and statements with the states that they lead to; @ is the number of the run.
_Form: TypeAlias = "dict[str, dict[str, str]]"
_STEP = "global geo_step = #"
_MOVES = {
    "movep(pose_trans(geo_at,p[#,#,#,#,#,#]),a=#,v=(geo_rate * #),r=#)": "at",
    "movel(pose_trans(geo_at,p[#,#,#,#,#,#]),a=#,v=#,t=(# / geo_rate))": "at",
}
_RUN: _Form = {
    "begin": {"geo_enter(#)": "entered"},
    "entered": {"local switching = run geo_switch_@()": "going"},
    "going": {_STEP: "to"},
    "to": _MOVES | {"join switching": "end"},
    "at": {_STEP: "arrived"},
    "arrived": _MOVES | {"join switching": "end", "if geo_on: sleep(#) end": "going"},
}
_THREAD: _Form = {
    "begin": {"geo_wait(#,p[#,#,#,#,#,#])": "passed"},
    "passed": {"geo_valve(?)": "begin", "geo_lamp(?)": "begin", "geo_vacuum(?)": "begin"},
}


def read_script(files: Mapping[str, str]) -> Script:
    """Return the program of a folder.

    Raises:
        VerificationError: it is missing, is no URScript of the subset, or another file lies beside it.
    """
    for name in sorted(files.keys() - {FILE}):
        raise refusal(name, 1, "this file belongs to no URScript program")
    if FILE not in files:
        raise refusal(FILE, 1, "the file is missing")
    odd = re.search(r"[^\n -~]", files[FILE])
    if odd is not None:
        line = files[FILE].count("\n", 0, odd.start()) + 1
        raise refusal(FILE, line, f"{odd[0]!r} has no place in a URScript program")
    return parse_script(FILE, files[FILE])


def settings_of(script: Script) -> Settings:
    """Return how a program is set.

    Raises:
        VerificationError: one of the three settings is no plain value, or is set twice.
    """
    found: dict[str, float | bool] = {}
    for statement in script.main.body:
        if statement.kind == "set" and statement.name in _SETTINGS:
            value = statement.value
            if not isinstance(value, Constant) or isinstance(value.value, str) or statement.name in found:
                raise refusal(FILE, statement.line, f"{statement.name} must be set once, to a plain value")
            found[statement.name] = value.value
    for name in _SETTINGS:
        if name not in found or isinstance(found[name], bool) != (name == "geo_dry_run"):
            raise refusal(FILE, script.main.line, f"{name} must be set, to a value of its kind")
    if found["geo_first_run"] != int(found["geo_first_run"]):
        raise refusal(FILE, script.main.line, "geo_first_run must be a whole number")
    return Settings(bool(found["geo_dry_run"]), float(found["geo_speed_pct"]), int(found["geo_first_run"]))


def wrong_settings(script: Script, settings: Settings, *, runs: int, new: bool) -> Iterator[VerificationError]:
    """Yield where a setting is one that the guard refuses, or not that of a new program."""
    line = next((each.line for each in script.main.body if each.name in _SETTINGS), 1)
    if not 1.0 <= settings.speed_pct <= 100.0:
        yield refusal(FILE, line, f"geo_speed_pct must lie between 1 and 100, found {settings.speed_pct:g}")
    if not 1 <= settings.first_run <= runs:
        yield refusal(FILE, line, f"geo_first_run must lie between 1 and {runs}, found {settings.first_run}")
    if new and (settings.dry_run, settings.speed_pct, settings.first_run) != (True, 25.0, 1):
        yield refusal(FILE, line, "a new program runs dry, at 25 per cent, from run 1")


def guard_of(text: str, cell: Cell, placement: Placement) -> range:
    """Return the numbers of the lines from the first line of the guard to its last; none, if the first is missing."""
    lines, wanted = text.split("\n"), guard_lines(cell, placement)
    begin = next((number for number, line in enumerate(lines, start=1) if line == wanted[0]), None)
    return range(0) if begin is None else range(begin, begin + len(wanted))


def wrong_guard(text: str, cell: Cell, placement: Placement) -> Iterator[VerificationError]:
    """Yield the first line of the guard that is not word for word as it must be."""
    lines, wanted = text.split("\n"), guard_lines(cell, placement)
    guard = guard_of(text, cell, placement)
    if not guard:
        yield refusal(FILE, 1, f"the guard must begin with {wanted[0].strip()!r}")
    for number, line in zip(guard, wanted, strict=False):
        found = lines[number - 1] if number <= len(lines) else ""
        if found != line:
            yield refusal(FILE, number, f"the guard must say {line.strip()[:80]!r}, found {found.strip()[:80]!r}")
            return


def wrong_statements(script: Script, cell: Cell, guard: range) -> Iterator[VerificationError]:
    """Yield the first statement outside the guard, of the program and of each routine, that has no place there.

    Before the guard the program sets settings and data, once each, to plain values; behind it, it calls each run. A run
    enters, starts its thread, says which target it goes to before each move, may wait while it prints, and joins its
    thread at the end; a thread waits and switches in turns. Each statement is of an exact form, in which numbers alone
    differ: so what a program does depends on its settings in the guard alone.

    Args:
        script: that was read.
        cell: what it has.
        guard: numbers of the lines of the guard, which are compared word for word.
    """
    yield from _wrong_main(script, cell, guard)
    threads = {each.name for each in script.routines if each.is_thread}
    for routine in script.routines:
        if routine.line in guard:
            continue
        number = routine.name.rpartition("_")[2]
        form, last = _THREAD, "begin"
        if routine.name.startswith("geo_run_"):
            starts = f"geo_switch_{number}" in threads
            form, last = _RUN, "end" if starts else "arrived"
            form = form if starts else form | {"entered": {_STEP: "to"}}
        if routine.name not in _routines(script, is_thread=routine.is_thread) or routine.arguments:
            yield refusal(FILE, routine.line, f"{routine.name} is no routine of a written program")
            continue
        state = "begin"
        for statement in routine.body:
            said = _said(statement).replace(f"run geo_switch_{number}()", "run geo_switch_@()")
            if said not in form.get(state, {}):
                yield refusal(FILE, statement.line, f"this statement has no place here in {routine.name}")
                break
            state = form[state][said]
        else:
            if state != last:
                yield refusal(FILE, routine.line, f"{routine.name} ends before its last statement")


def _wrong_main(script: Script, cell: Cell, guard: range) -> Iterator[VerificationError]:
    """Yield the first statement of the program itself, outside the guard, that has no place there."""
    left = dict(_DATA)
    if cell.purge is not None:
        left["geo_purge"] = _JOINTS
    if cell.flood is not None and cell.flood.joints is not None:
        left["geo_flooding"] = _JOINTS
    calls = ["geo_begin()", *(f"{name}()" for name in _routines(script, is_thread=False)), "geo_end()"]
    routines = max((each.line for each in script.routines), default=0)
    if script.main.name != "geoprint" or script.main.arguments or script.main.is_thread:
        yield refusal(FILE, script.main.line, "the program must begin with 'def geoprint():'")
    for statement in script.main.body:
        line = statement.line
        if line in guard:
            continue
        if line < guard.start:
            wrong = _said(statement) != f"global {statement.name} = {left.pop(statement.name, None)}"
        else:
            wrong = line < routines or not calls or _said(statement) != calls.pop(0)
        if wrong:
            yield refusal(FILE, line, f"this statement has no place here in {script.main.name}")
            return
    if left or calls:
        what = f"does not set {min(left)}" if left else f"does not call {calls[0]}"
        yield refusal(FILE, script.main.body[-1].line, f"the program {what}, once and in order")


def _routines(script: Script, *, is_thread: bool) -> list[str]:
    """Return the names that runs, or their threads, may have, in order."""
    runs = sum(each.name.startswith("geo_run_") for each in script.routines)
    return [f"geo_{'switch' if is_thread else 'run'}_{number}" for number in range(1, runs + 1)]


def _said(statement: Statement) -> str:
    """Return a statement with its numbers as #, truth values as ? and texts as quotes."""
    value = "" if statement.value is None else _shown(statement.value)
    if statement.kind == "call":
        return value
    if statement.kind == "set":
        return f"{statement.scope} {statement.name} = {value}".lstrip()
    if statement.kind == "if" and not statement.otherwise:
        return f"if {value}: {' '.join(map(_said, statement.body))} end"
    return f"{statement.kind} {statement.name}"


def _shown(value: Expression) -> str:
    """Return an expression likewise."""
    if isinstance(value, Constant):
        return "?" if isinstance(value.value, bool) else "''" if isinstance(value.value, str) else "#"
    if isinstance(value, Name):
        return value.name
    if isinstance(value, Items):
        return f"{'p' * value.is_pose}[{','.join(map(_shown, value.items))}]"
    if isinstance(value, Operation):
        first, *others = map(_shown, value.operands)
        return f"({first} {value.sign} {others[0]})" if others else f"({value.sign} {first})"
    named = (f"{name}={_shown(each)}" for name, each in value.named)
    return f"{'run ' * value.starts}{value.name}({','.join([*map(_shown, value.arguments), *named])})"
