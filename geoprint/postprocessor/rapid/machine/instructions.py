"""Instructions that every controller has, but for those that move: outputs, texts, waiting, loading, settings.

Each is a function of the state and of the values of its arguments. An instruction, or an option of one, that is not
listed here is an error wherever it stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any, TypeAlias, cast, final

from geoprint.postprocessor.rapid.language.syntax import Value
from geoprint.postprocessor.rapid.machine.calls import OUTPUTS
from geoprint.postprocessor.rapid.machine.execution import Switching, chosen
from geoprint.postprocessor.rapid.machine.functions import text_of
from geoprint.postprocessor.rapid.machine.moves import Trigger
from geoprint.postprocessor.rapid.machine.state import MISSING, Reference, State
from geoprint.postprocessor.rapid.machine.values import IDENTITY, fault, pose_of, stored

# Modules that come and go while a program runs: their data begin anew, their routines can be called or not.


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
            fault("ERR_LOADED", f"{file} brings {both[0]}, which {other} has already loaded")
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


Run: TypeAlias = Callable[[State, list[Any], Mapping[str, Value]], None]


@final
@dataclass(frozen=True, slots=True)
class Instruction:
    """How an instruction is executed.

    Attributes:
        run: does it.
        takes: so many arguments besides its options.
        references: places of arguments that it is handed itself.
        signals: places of arguments that name a signal.
        options: that it takes, in lower case.
    """

    run: Run
    takes: int
    references: tuple[int, ...] = ()
    signals: tuple[int, ...] = ()
    options: frozenset[str] = frozenset()


def _place(state: State) -> tuple[str, int]:
    frame = state.frames[-1]
    return frame.routine.file, frame.routine.line_of(frame.pc - 1)


def _put(state: State, signal: Value, value: float) -> None:
    file, line = _place(state)
    state.switch(Switching(state.clock, cast("str", signal).lower(), value, file, line))


def _set_output(state: State, values: list[Any], _: Mapping[str, Value]) -> None:
    _put(state, values[0], float(values[1]))


def _pulse(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    _put(state, values[0], 1.0)
    file, line = _place(state)
    moment = state.clock + float(cast("float", options.get("plength", 0.2)))
    state.plan(Switching(moment, values[0].lower(), 0.0, file, line))


def _write(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    shown = [text_of(options[name]) for name in ("num", "bool", "pos", "orient", "dnum") if name in options]
    state.log.texts.append((state.clock, values[0] + "".join(shown)))


def _ask(state: State, values: list[Any], _: Mapping[str, Value]) -> None:
    answer = cast("Reference", values[0])
    state.log.questions.append(values[1])
    if state.answered >= len(state.scenario.answers):
        state.end("waits", f"nobody answers: {values[1]}")
        return
    given = float(state.scenario.answers[state.answered])
    state.answered += 1
    keys = values[2:7]
    if len(keys) == 5 and not (given.is_integer() and 1 <= given <= 5 and keys[int(given) - 1]):
        state.end("waits", f"the answer {given:g} is not on a key: {values[1]}")
        return
    answer.put(state, given)


def _wait(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    if options.get("inpos"):
        state.clock = max(state.clock, state.motion.end)
    state.clock += max(float(values[0]), 0.0)


def _wait_until(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    if values[0] is True:
        return
    if state.pending:
        # It is asked again as the next output switches.
        state.clock = max(state.clock, state.pending[0][0])
        state.frames[-1].pc -= 1
        return
    if "maxtime" in options:
        state.clock += float(cast("float", options["maxtime"]))
        fault("ERR_WAIT_MAXTIME", "the condition of a wait did not come true in time")
    state.end("waits", "the condition of a wait never comes true")


def _wait_signal(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    _wait_until(state, [state.signals.get(values[0].lower(), 0.0) == float(values[1])], options)


def _mode(state: State, **changed: Any) -> None:
    state.motion.modes = state.motion.modes._replace(**changed)


def _velocity(state: State, values: list[Any], _: Mapping[str, Value]) -> None:
    _mode(state, override=float(values[0]), fastest=float(values[1]))


def _accelerate(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    acceleration, ramp, stop = float(values[0]), float(values[1]), options.get("finepointramp", 100.0)
    _mode(state, acceleration=(acceleration, ramp, float(cast("float", stop))))


def _limit_acceleration(state: State, _: list[Any], options: Mapping[str, Value]) -> None:
    _mode(state, world_acceleration=float(cast("float", options.get("on", math.inf))))


def _limit_along_path(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    highest = [
        float(cast("float", options.get(name, math.inf))) if limited else math.inf
        for limited, name in zip(values, ("accmax", "decelmax"), strict=True)
    ]
    _mode(state, path_acceleration=tuple(highest))


def _resolve(state: State, values: list[Any], _: Mapping[str, Value]) -> None:
    _mode(state, resolution=float(values[0]))


def _supervise_lines(state: State, _: list[Any], options: Mapping[str, Value]) -> None:
    _mode(state, lines=chosen(options, default="on") == "on")


def _supervise_joints(state: State, _: list[Any], options: Mapping[str, Value]) -> None:
    _mode(state, joints=chosen(options, default="on") == "on")


def _give_way(state: State, _: list[Any], options: Mapping[str, Value]) -> None:
    _mode(state, singularities=chosen(options, default="off"))


def _supervise_motion(state: State, _: list[Any], options: Mapping[str, Value]) -> None:
    tuned = float(cast("float", options.get("tunevalue", 100.0)))
    _mode(state, supervision=(chosen(options, default="on") == "on", tuned))


def _soften(state: State, values: list[Any], _: Mapping[str, Value]) -> None:
    soft = dict(state.motion.modes.soft) | {int(values[0]): float(values[1])}
    _mode(state, soft=tuple(sorted(soft.items())))


def _turn_in_circles(state: State, _: list[Any], options: Mapping[str, Value]) -> None:
    _mode(state, circles=chosen(options, default="pathframe"))


def _displace(state: State, values: list[Any], _: Mapping[str, Value]) -> None:
    state.motion.displacement = pose_of(stored(values[0]))


def _displace_no_more(state: State, _: list[Any], __: Mapping[str, Value]) -> None:
    state.motion.displacement = IDENTITY


def _offset_axes(_: State, values: list[Any], __: Mapping[str, Value]) -> None:
    if any(values[0]):
        fault("ERR_NORUNUNIT", "external axes are offset, but there are none")


def _trigger(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    _define(state, values[0], options, distance=values[1], value=values[2])


def _trigger_equipment(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    _define(state, values[0], options, distance=values[1], value=values[3], lead=values[2])


def _define(
    state: State, datum: Reference, options: Mapping[str, Value], *, distance: float, value: float, lead: float = 0.0
) -> None:
    outputs = [cast("str", options[name]) for name in sorted(OUTPUTS) if name in options]
    if len(outputs) != 1:
        fault("ERR_ARGDUPCND", "a trigger must switch one output")
    file, line = _place(state)
    asked = Switching(
        0.0, outputs[0].lower(), float(value), file, line, -1, float(distance), bool(options.get("start"))
    )
    datum.put(state, cast("Any", Trigger(asked, bool(options.get("time")), float(lead))))


def _trigger_speed(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    datum, distance, lag, signal, value = values
    file, line = _place(state)
    asked = Switching(
        0.0, signal.lower(), float(value), file, line, -1, float(distance), bool(options.get("start")), flow=True,
        lag=float(lag), dip_lag=float(cast("float", options.get("diplag", 0.0))),
    )  # fmt: skip
    datum.put(state, cast("Any", Trigger(asked, bool(options.get("time")))))


def _file(state: State, values: list[Any], options: Mapping[str, Value]) -> str:
    """Return a file as the task names it: with the folders below the disk if one of its modules lies there."""
    whole = f"{values[0]}/{options['file']}" if "file" in options else cast("str", values[0])
    path = PurePosixPath(whole.replace("\\", "/").rpartition(":")[2].lstrip("/"))
    return str(path) if str(path) in state.task.files else path.name


def _start_load(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    file, session = _file(state, values, options), cast("Reference", values[1])
    if file not in state.task.disk(state.scenario):
        fault("ERR_FILNOTFND", f"there is no file {file}")
    if cast("object", session.get(state)) is not None:
        fault("ERR_LOADNO_INUSE", "the load session is in use")
    state.order += 1
    state.loading[float(state.order)] = (file, state.clock + state.scenario.loading)
    session.put(state, float(state.order))


def _wait_load(state: State, values: list[Any], _: Mapping[str, Value]) -> None:
    session = cast("Reference", values[0])
    number = cast("float", session.get(state))
    if number not in state.loading:
        fault("ERR_LOADNO_NOUSE", "nothing is being loaded in the session")
    file, ready = state.loading.pop(number)
    session.put(state, None)
    state.clock = max(state.clock, ready)
    load(state, file)


def _load(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    file = _file(state, values, options)
    if file not in state.task.disk(state.scenario):
        fault("ERR_FILNOTFND", f"there is no file {file}")
    state.clock += state.scenario.loading
    load(state, file)


def _unload(state: State, values: list[Any], options: Mapping[str, Value]) -> None:
    unload(state, _file(state, values, options))


def _add(state: State, values: list[Any], _: Mapping[str, Value]) -> None:
    datum, value = cast("Reference", values[0]), float(values[1])
    datum.put(state, stored(cast("float", datum.get(state)) + value))


def _nothing(_: State, __: list[Any], ___: Mapping[str, Value]) -> None:
    pass


_TRIGGER = frozenset({"start", "time", *OUTPUTS})


def _activate(state: State, values: list[Any], _: Mapping[str, Value]) -> None:
    _still(state)
    state.motion.unit = cast("str", values[0]).lower()


def _deactivate(state: State, values: list[Any], _: Mapping[str, Value]) -> None:
    _still(state)
    if state.motion.unit == cast("str", values[0]).lower():
        state.motion.unit = ""


def _still(state: State) -> None:
    if state.clock < state.motion.end:
        fault("ERR_NORUNUNIT", "a mechanical unit is switched on or off while the arm moves: end the move with fine")


INSTRUCTIONS: Mapping[str, Instruction] = {
    "setdo": Instruction(_set_output, 2, signals=(0,)),
    "setao": Instruction(_set_output, 2, signals=(0,)),
    "setgo": Instruction(_set_output, 2, signals=(0,)),
    "set": Instruction(lambda state, values, _: _put(state, values[0], 1.0), 1, signals=(0,)),
    "reset": Instruction(lambda state, values, _: _put(state, values[0], 0.0), 1, signals=(0,)),
    "pulsedo": Instruction(_pulse, 1, signals=(0,), options=frozenset({"plength"})),
    "tperase": Instruction(_nothing, 0),
    "tpwrite": Instruction(_write, 1, options=frozenset({"num", "bool", "pos", "orient", "dnum"})),
    "tpreadfk": Instruction(_ask, 7, references=(0,)),
    "tpreadnum": Instruction(_ask, 2, references=(0,)),
    "waittime": Instruction(_wait, 1, options=frozenset({"inpos"})),
    "waitrob": Instruction(lambda state, _, __: _wait(state, [0.0], {"inpos": True}), 0, options=frozenset({"inpos"})),
    "waituntil": Instruction(_wait_until, 1, options=frozenset({"maxtime"})),
    "waitdi": Instruction(_wait_signal, 2, signals=(0,), options=frozenset({"maxtime"})),
    "waitdo": Instruction(_wait_signal, 2, signals=(0,), options=frozenset({"maxtime"})),
    "velset": Instruction(_velocity, 2),
    "accset": Instruction(_accelerate, 2, options=frozenset({"finepointramp"})),
    "worldacclim": Instruction(_limit_acceleration, 0, options=frozenset({"on", "off"})),
    "pathacclim": Instruction(_limit_along_path, 2, options=frozenset({"accmax", "decelmax"})),
    "pathresol": Instruction(_resolve, 1),
    "confl": Instruction(_supervise_lines, 0, options=frozenset({"on", "off"})),
    "confj": Instruction(_supervise_joints, 0, options=frozenset({"on", "off"})),
    "singarea": Instruction(_give_way, 0, options=frozenset({"off", "wrist", "lockaxis4"})),
    "motionsup": Instruction(_supervise_motion, 0, options=frozenset({"on", "off", "tunevalue"})),
    "softact": Instruction(_soften, 2, options=frozenset({"ramp"})),
    "softdeact": Instruction(lambda state, _, __: _mode(state, soft=()), 0, options=frozenset({"ramp"})),
    "cirpathmode": Instruction(
        _turn_in_circles,
        0,
        options=frozenset({"pathframe", "objectframe", "cirpointori", "wrist45", "wrist46", "wrist56"}),
    ),
    "pdispset": Instruction(_displace, 1),
    "pdispoff": Instruction(_displace_no_more, 0),
    "eoffsset": Instruction(_offset_axes, 1),
    "eoffsoff": Instruction(_nothing, 0),
    "triggio": Instruction(_trigger, 3, references=(0,), options=_TRIGGER),
    "triggequip": Instruction(_trigger_equipment, 4, references=(0,), options=_TRIGGER),
    "triggspeed": Instruction(
        _trigger_speed, 5, references=(0,), signals=(3,), options=frozenset({"start", "time", "diplag"})
    ),
    "startload": Instruction(_start_load, 2, references=(1,), options=frozenset({"dynamic", "file"})),
    "waitload": Instruction(_wait_load, 1, references=(0,)),
    "load": Instruction(_load, 1, options=frozenset({"dynamic", "file"})),
    "unload": Instruction(_unload, 1, options=frozenset({"file", "errifchanged", "save"})),
    "incr": Instruction(lambda state, values, _: _add(state, [values[0], 1.0], {}), 1, references=(0,)),
    "decr": Instruction(lambda state, values, _: _add(state, [values[0], -1.0], {}), 1, references=(0,)),
    "add": Instruction(_add, 2, references=(0,)),
    "clear": Instruction(lambda state, values, _: values[0].put(state, 0.0), 1, references=(0,)),
    "actunit": Instruction(_activate, 1, signals=(0,)),
    "deactunit": Instruction(_deactivate, 1, signals=(0,)),
    "stop": Instruction(lambda state, _, __: state.end("stopped", "Stop"), 0, options=frozenset({"noregain"})),
}
