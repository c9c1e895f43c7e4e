"""Modules that come and go while a program runs: their data begin anew, their routines can be called or not."""

from __future__ import annotations

from geoprint.export.rapid.machine.state import MISSING, State
from geoprint.export.rapid.machine.values.faults import fault


def load(state: State, file: str) -> None:
    """Make a module's routines and data available.

    Raises:
        Fault: it is loaded already, or declares what a loaded one declares.
    """
    if file in state.loaded:
        fault("ERR_LOADED", f"{file} is loaded already")
    task = state.task
    for other in sorted(state.loaded):
        both = sorted(task.shared_names(file) & task.shared_names(other))
        if both:
            fault("ERR_LOADED", f"{file} brings {both[0]}, which {other} has brought and nobody has unloaded")
    state.loaded |= {file}
    begin_data(state, file)
    state.routines |= {
        routine.name.lower(): routine for routine in task.routines if routine.file == file and not routine.local
    }


def unload(state: State, file: str) -> None:
    """Take a module away.

    Raises:
        Fault: it is not loaded, or one of its routines is being executed.
    """
    if file not in state.loaded or file in state.task.resident:
        fault("ERR_UNLOAD", f"{file} is not loaded by the program")
    if any(frame.routine.file == file for frame in state.frames):
        fault("ERR_UNLOAD", f"{file} is being executed")
    state.loaded -= {file}
    for slot in state.task.slots_of(file):
        state.data[slot] = MISSING
    state.routines = {name: routine for name, routine in state.routines.items() if routine.file != file}


def begin_data(state: State, file: str, *, variables_only: bool = False) -> None:
    """Give the data of a module their first values; what a person has set or holds stays so."""
    for slot, name, storage, evaluate in state.task.first_values(file):
        if variables_only and storage != "VAR":
            continue
        state.data[slot] = evaluate(state)
        for given in (state.scenario.data, state.scenario.held):
            if name in given:
                state.data[slot] = given[name]
