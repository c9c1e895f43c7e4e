"""Reads a script, and holds its settings, its guard and the order of its statements against what is written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TypeAlias

from geoprint.errors import VerificationError
from geoprint.model import Cell, Placement
from geoprint.postprocessor.execution import Settings, refusal
from geoprint.postprocessor.urscript.guard import guard_lines
from geoprint.postprocessor.urscript.language import Call, Constant, Script, Statement, parse_script

FILE = "geoprint.script"
_SETTINGS = ("geo_dry_run", "geo_speed_pct", "geo_first_run")

# What may follow what: states, and words with the states that they lead to.
_Form: TypeAlias = "dict[str, dict[str, str]]"
_MAIN: _Form = {
    "begin": {"set": "begin", "step": "begin", "call geo_begin": "runs"},
    "runs": {"call geo_run": "runs", "call geo_end": "end"},
}
_RUN: _Form = {
    "begin": {"call geo_enter": "entered"},
    "entered": {"start": "going"},
    "going": {"step": "to"},
    "to": {"call movep": "at", "call movel": "at", "join": "end"},
    "at": {"step": "arrived"},
    "arrived": {"call movep": "at", "call movel": "at", "join": "end", "if": "going"},
}
_THREAD: _Form = {
    "begin": {"call geo_wait": "passed"},
    "passed": {"call geo_valve": "begin", "call geo_lamp": "begin", "call geo_vacuum": "begin"},
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


def wrong_guard(text: str, cell: Cell, placement: Placement) -> Iterator[VerificationError]:
    """Yield the first line of the guard that is not word for word as it must be, and what defines a word of it anew."""
    lines, wanted = text.split("\n"), guard_lines(cell, placement)
    begin = next((k for k, line in enumerate(lines) if line == wanted[0]), None)
    if begin is None:
        yield refusal(FILE, 1, f"the guard must begin with {wanted[0].strip()!r}")
        return
    for k, line in enumerate(wanted):
        found = lines[begin + k] if begin + k < len(lines) else ""
        if found != line:
            yield refusal(
                FILE, begin + k + 1, f"the guard must say {line.strip()[:80]!r}, found {found.strip()[:80]!r}"
            )
            return


def wrong_statements(script: Script) -> Iterator[VerificationError]:
    """Yield the first statement of the program, of each run and of each thread that has no place there.

    A run enters, starts its thread, says which target it goes to before each move, may wait while it prints, and joins
    its thread at the end; a thread waits and switches in turns.
    """
    names = [each.name for each in script.routines if each.name.startswith("geo_run_")]
    threads = {each.name for each in script.routines if each.is_thread}
    calls = [said for said in map(_said, script.main.body) if said.startswith("call geo_run_")]
    if calls != [f"call geo_run_{number}" for number in range(1, len(names) + 1)]:
        yield refusal(FILE, script.main.body[-1].line, "the program must call each run once, in their order")
    for routine in (script.main, *script.routines):
        form, last = _THREAD, "begin"
        if routine is script.main:
            form, last = _MAIN, "end"
        elif routine.name.startswith("geo_run_"):
            starts = routine.name.replace("run", "switch") in threads
            form, last = _RUN, "end" if starts else "arrived"
            form = form if starts else form | {"entered": {"step": "to"}}
        elif not routine.is_thread:
            continue
        state = "begin"
        for statement in routine.body:
            said = _said(statement)
            word = "call geo_run" if said.startswith("call geo_run_") else said
            if word not in form.get(state, {}):
                yield refusal(FILE, statement.line, f"this statement has no place here in {routine.name}")
                break
            state = form[state][word]
        else:
            if state != last:
                yield refusal(FILE, routine.line, f"{routine.name} ends before its last statement")


def _said(statement: Statement) -> str:
    """Return a word or two for a statement."""
    if statement.kind == "call" and isinstance(statement.value, Call):
        return f"call {statement.value.name}"
    if statement.kind == "set" and isinstance(statement.value, Call) and statement.value.starts:
        return "start"
    return "step" if statement.kind == "set" and statement.name == "geo_step" else statement.kind
