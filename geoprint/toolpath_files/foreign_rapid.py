"""Programs that others wrote, in words that the machine of `geoprint.postprocessor.rapid` knows.

Instructions that move and switch at once become a move and a switching behind it (MoveLDO and the like), those of
options for dispensing and welding become moves and an output of their own (DispL, ArcL); what cannot change the path is
left out and counted; a production loop without an end becomes one pass. Where external axes stand still, or the work
object goes with them, they are left out: targets count in the work object. All of it is noted.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cache
from operator import attrgetter
from typing import TypeAlias, cast, final

import numpy as np

from geoprint.errors import how_many
from geoprint.postprocessor.rapid.language.symbols import examine
from geoprint.postprocessor.rapid.language.syntax import (
    TARGET,
    Aggregate,
    Argument,
    Assignment,
    Binary,
    Call,
    Component,
    Connect,
    Datum,
    Element,
    Expression,
    For,
    FunctionCall,
    Goto,
    If,
    Label,
    Leave,
    Literal,
    Module,
    Name,
    Parameter,
    Routine,
    Series,
    Statement,
    Test,
    Value,
    While,
)
from geoprint.toolpath_files.path_file import refuse

# The routine that is called with the middle place of each arc before it is followed.
THROUGH = "geoprint_through"
# Outputs that stand for a process; they are on from the target of its first instruction to that of its last.
DISPENSER, WELD = "dispenser", "weld"
# Arguments of a move that change neither where it leads nor what it switches.
_IDLE_OPTIONS = frozenset({"id", "inpos", "tload", "z", "conc"})
_MOVES = frozenset({"movel", "movec", "movej", "moveabsj", "triggl", "triggc", "triggj"})
# Moves that switch an output in the corner at their end: instruction, and what switches it.
_SWITCHING = {
    f"move{shape}{kind}": (f"Move{shape.upper()}", f"Set{kind.upper()}")
    for shape in ("l", "c", "j")
    for kind in ("do", "ao", "go")
}
_CALLING = {"movelsync": "MoveL", "movecsync": "MoveC", "movejsync": "MoveJ"}
# Moves of a process: instruction, output, its data behind the speed, and whether it begins or ends there.
_PROCESS = {
    "displ": ("MoveL", DISPENSER, 1, ""), "dispc": ("MoveC", DISPENSER, 1, ""),
    "arclstart": ("MoveL", WELD, 2, "on"), "arcl": ("MoveL", WELD, 2, ""), "arclend": ("MoveL", WELD, 2, "off"),
    "arccstart": ("MoveC", WELD, 2, "on"), "arcc": ("MoveC", WELD, 2, ""), "arccend": ("MoveC", WELD, 2, "off"),
}  # fmt: skip
_PROCESS_DATA = frozenset({"beaddata", "equipdata", "seamdata", "welddata", "weavedata", "trackdata"})
# Instructions that change neither the path nor an output.
_IDLE = frozenset({
    "gripload", "mechunitload", "cornerpathwarning", "clkreset", "clkstart", "clkstop", "tpshow", "errwrite", "errlog",
    "write", "writebin", "writestrbin", "open", "close", "rewind", "spystart", "spystop", "motionsup", "softact",
    "softdeact", "pathacclim", "worldacclim", "pathresol", "tuneservo", "tunereset", "waitsynctask", "tpwrite",
    "tperase", "textabinstall", "actunit", "deactunit", "uimsgbox", "setsysdata", "syncmoveundo",
})  # fmt: skip
_INTERRUPTS = frozenset({
    "isignaldi", "isignaldo", "isignalai", "isignalao", "isignalgi", "isignalgo", "itimer", "isleep", "iwatch",
    "idelete", "ienable", "idisable", "ipers", "ierror",
})  # fmt: skip
_WAITS = frozenset({"waitdi", "waitdo", "waituntil", "waitai", "waitao", "waitgi", "waitgo", "stop", "break"})
_LEFT_OUT = _IDLE | _INTERRUPTS | _WAITS
# Outputs by the instruction that switches them, and where among its arguments they stand.
_OUTPUTS = {
    "set": "signaldo", "reset": "signaldo", "setdo": "signaldo", "pulsedo": "signaldo", "invertdo": "signaldo",
    "setao": "signalao", "setgo": "signalgo",
}  # fmt: skip
_OPTIONS = {"dop": "signaldo", "gop": "signalgo", "aop": "signalao"}
_TRIGGSPEED_OUTPUT = 3

# External axes of a target; above the second a number stands for an axis that is not there.
_AXES, NO_AXIS, MISSING_AXIS = 6, 8.9e9, 9e9

_Body: TypeAlias = tuple[Statement, ...]
# Files and what stands in them.
_Nodes: TypeAlias = Sequence[tuple[str, object]]


@final
@dataclass(slots=True)
class Notes:
    """What was done to a program.

    Attributes:
        skipped: instructions that were left out, by name.
        assumed: what was taken for granted, in words.
        process: outputs that stand for a process in it.
    """

    skipped: Counter[str] = field(default_factory=Counter[str])
    assumed: list[str] = field(default_factory=list[str])
    process: set[str] = field(default_factory=set[str])


def translated(modules: Sequence[Module]) -> tuple[list[Module], dict[str, str], Notes]:
    """Return modules in the words that the machine knows, the type of each signal that they name, and what was done.

    Raises:
        InputError: something cannot be said in these words; names its line.
        VerificationError: a name means nothing.
    """
    notes = Notes()
    own = {each.name.lower() for module in modules for each in module.routines}
    found = [_Translator(module, notes, own).module() for module in modules]
    nodes = [
        (module.file, node)
        for module in found
        for node in each_node((module.data, module.routines), _ASKED)
        if not isinstance(node, Literal) or type(node.value) is tuple
    ]
    signals = _outputs(nodes) | dict.fromkeys(notes.process, "signaldo")
    signals |= _inputs(found, nodes, signals, notes)
    if _goes_with_axes(nodes, notes, follows=_follows(modules)):
        found = [cast("Module", _mapped(module)) for module in found]
    return found, signals, notes


@final
class _Translator:
    """Translates one module."""

    def __init__(self, module: Module, notes: Notes, own: set[str]) -> None:
        self._module = module
        self._notes = notes
        # Procedures of the program, which may have any name.
        self._own = own

    def module(self) -> Module:
        """Return the module; its file declares the routine that is told of arcs."""
        record = Parameter(1, "place", "robtarget", "", optional=False, group=0, dimensions=0)
        # RAPID wants routines behind data, in a module of data alone too.
        end = max((each.line for each in self._module.data), default=1)
        through = Routine(end, end, THROUGH, "PROC", "", (record,), (), (), (), (), (), local=True)
        routines = [
            replace(
                routine,
                data=tuple(each for each in routine.data if each.kind.lower() not in _PROCESS_DATA),
                body=self._body(self._without_restart(routine)),
                handlers=tuple(replace(each, body=self._body(each.body)) for each in routine.handlers),
                undo=self._body(routine.undo),
                backward=(),
            )
            for routine in self._module.routines
            if routine.kind != "TRAP"
        ]
        data = tuple(_held(each) for each in self._module.data if each.kind.lower() not in _PROCESS_DATA)
        return replace(self._module, data=data, routines=(*routines, through))

    def _without_restart(self, routine: Routine) -> _Body:
        """Return the statements of a routine without its call to itself that stands at the end, whatever happens."""
        last = routine.body[-1] if routine.body else None
        if not isinstance(last, Call) or last.name.lower() != routine.name.lower() or _leaves(routine.body):
            return routine.body
        self._assume(last.line, f"{routine.name}, which begins itself anew at its end, is read for one pass")
        return routine.body[:-1]

    def _body(self, statements: _Body) -> _Body:
        found: list[Statement] = []
        for statement in statements:
            if isinstance(statement, Series):
                strange = any(shape.name.lower() not in _MOVES for shape in statement.kinds())
                idle = any(_is_idle(each) for shape in statement.kinds() for each in shape.arguments)
                curved = any(shape.name.lower() in {"movec", "triggc"} for shape in statement.kinds())
                calls = statement.calls() if strange or idle or curved else ()
                found.extend(part for call in calls for part in self._call(call))
                if not (strange or idle or curved):
                    found.append(statement)
            else:
                found.extend(self._statement(statement))
        return self._once(tuple(found))

    def _statement(self, statement: Statement) -> list[Statement]:
        found: list[Statement] = [statement]
        match statement:
            case Call():
                found = self._call(statement)
            case If():
                branches = tuple((condition, self._body(body)) for condition, body in statement.branches)
                found = [replace(statement, branches=branches, otherwise=self._body(statement.otherwise))]
            case Test():
                cases = tuple((values, self._body(body)) for values, body in statement.cases)
                found = [replace(statement, cases=cases, default=self._body(statement.default))]
            case For():
                found = [replace(statement, body=self._body(statement.body))]
            case While():
                found = [self._loop(replace(statement, body=self._body(statement.body)))]
            case Connect():
                self._notes.skipped["interrupts"] += 1
                found = []
            case _:
                pass
        return found

    def _loop(self, loop: While) -> Statement:
        """Return one pass of a loop that never ends; another one as it is."""
        if not _is_true(loop.condition) or _leaves(loop.body):
            return loop
        self._assume(loop.line, "the loop without an end is read for one pass")
        return If(loop.line, ((Literal(loop.line, value=True), loop.body),), ())

    def _once(self, statements: _Body) -> _Body:
        """Leave out a GOTO that goes back for ever: nothing between the label and it leaves."""
        labels: dict[str, int] = {}
        found: list[Statement] = []
        for place, statement in enumerate(statements):
            if isinstance(statement, Label):
                labels[statement.name.lower()] = place
            since = labels.get(statement.label.lower()) if isinstance(statement, Goto) else None
            if since is not None and not _leaves(statements[since:place]):
                self._assume(statement.line, "the loop without an end is read for one pass")
            else:
                found.append(statement)
        return tuple(found)

    def _assume(self, line: int, what: str) -> None:
        self._notes.assumed.append(f"{what} ({self._module.file}, line {line})")

    def _call(self, call: Call) -> list[Statement]:
        """Return what a call becomes: nothing where it cannot change the path, or moves and switchings."""
        name = call.name.lower()
        if name in self._own or not name:
            return [call]
        if name in _LEFT_OUT:
            self._notes.skipped["interrupts" if name in _INTERRUPTS else call.name] += 1
            if name in _WAITS and (said := "what is waited for comes, and Stop goes on") not in self._notes.assumed:
                self._notes.assumed.append(said)
            return []
        call = replace(call, arguments=tuple(each for each in call.arguments if not _is_idle(each)))
        if name in _PROCESS:
            return self._processing(call)
        return self._moving(call) if name.startswith(("move", "trigg")) else self._switching(call)

    def _moving(self, call: Call) -> list[Statement]:
        name = call.name.lower()
        if name in _SWITCHING:
            move, switch = _SWITCHING[name]
            *rest, signal, value = self._positional(call, least=6)
            return [*self._move(self._stopping(call, move, rest)), Call(call.line, switch, None, (signal, value))]
        if name in _CALLING:
            *rest, called = self._positional(call, least=5)
            late = Call(call.line, "", called.value, ())
            return [*self._move(self._stopping(call, _CALLING[name], rest)), late]
        return self._move(call)

    def _switching(self, call: Call) -> list[Statement]:
        if call.name.lower() == "invertdo":
            (signal,) = self._positional(call, least=1)
            asked = FunctionCall(call.line, "DOutput", (replace(signal, optional=False),))
            other = Binary(call.line, "-", Literal(call.line, 1.0), asked)
            return [Call(call.line, "SetDO", None, (signal, Argument(call.line, "", other, optional=False)))]
        if call.name.lower() == "setdo":
            # It says when within the control's cycle.
            return [replace(call, arguments=tuple(each for each in call.arguments if each.name.lower() != "sync"))]
        return [call]

    def _positional(self, call: Call, *, least: int) -> list[Argument]:
        found = [each for each in call.arguments if not each.optional]
        if len(found) < least:
            refuse(
                self._module.file,
                call.line,
                f"{call.name} is given {how_many(len(found), 'argument')}, needed are {least}",
            )
        return found

    def _stopping(self, call: Call, move: str, rest: Sequence[Argument]) -> Call:
        """Return a move that ends at its target: what switches there does so in the middle of the corner."""
        fine = Argument(call.line, "", Name(call.line, "fine"), optional=False)
        arguments = [*rest[:-2], fine, rest[-1], *(each for each in call.arguments if each.optional)]
        return Call(call.line, move, None, tuple(arguments))

    def _move(self, call: Call) -> list[Statement]:
        if call.name.lower() not in {"movec", "triggc"}:
            return [call]
        first = self._positional(call, least=2)[0]
        return [Call(call.line, THROUGH, None, (replace(first, optional=False, name=""),)), call]

    def _processing(self, call: Call) -> list[Statement]:
        """Return a move of a process, and its beginning or end at the target."""
        move, output, data, change = _PROCESS[call.name.lower()]
        curved = move == "MoveC"
        rest = self._positional(call, least=4 + data + curved)
        options = {each.name.lower(): each for each in call.arguments if each.optional}
        if output == DISPENSER:
            change = "on" if "on" in options else "off" if "off" in options else ""
            if "d" in options and change:
                refuse(
                    self._module.file,
                    call.line,
                    f"{call.name} changes its bead off its target (\\D), which is not read",
                )
        kept = tuple(each for name, each in options.items() if name not in {"on", "off", "d", "weave", "seamname"})
        place = 2 + curved
        arguments = [*rest[:place], *rest[place + data :]]
        self._notes.process.add(output)
        record = Call(call.line, move, None, (*arguments, *kept))
        if not change:
            return self._move(record)
        said = "deposit from the target of DispL\\On to that of DispL\\Off"
        if output == DISPENSER and said not in self._notes.assumed:
            self._notes.assumed.append(said)
        signal = Argument(call.line, "", Name(call.line, output), optional=False)
        value = Argument(call.line, "", Literal(call.line, float(change == "on")), optional=False)
        stopping = self._stopping(record, move, arguments)
        return [*self._move(stopping), Call(call.line, "SetDO", None, (signal, value))]


def _is_idle(argument: Argument) -> bool:
    return argument.optional and argument.name.lower() in _IDLE_OPTIONS


def _is_true(condition: Expression) -> bool:
    """Return whether a condition holds whatever happens."""
    if isinstance(condition, Binary) and condition.operator == "=":
        left, right = condition.left, condition.right
        return isinstance(left, Literal) and isinstance(right, Literal) and left.value == right.value
    return isinstance(condition, Literal) and condition.value is True


def _leaves(statements: _Body) -> bool:
    """Return whether something within statements may leave them."""
    return any(
        not isinstance(node, Call) or node.name.lower() in {"exitcycle", "systemstopaction"}
        for node in each_node(statements, _LEAVING)
    )


# Kinds of nodes that name outputs, inputs or external axes.
_ASKED = frozenset({Aggregate, Assignment, Call, FunctionCall, If, Literal, Series, Test, While})
_LEAVING, _NAMES = frozenset({Leave, Goto, Call}), frozenset({Name})
# Types of fields that hold no syntax, as they are annotated.
_SIMPLE = frozenset({"str", "int", "bool", "Storage", "RoutineKind"})


@cache
def _parts_of(kind: type) -> Callable[[object], tuple[object, ...]] | None:
    """Return what takes the parts of a kind of syntax that hold some, the last one first, or None for what is none."""
    if not is_dataclass(kind):
        return None
    names = [] if kind is Literal else [each.name for each in fields(kind) if each.type not in _SIMPLE][::-1]
    if len(names) < 2:
        return lambda one: tuple([getattr(one, name) for name in names])
    return cast("Callable[[object], tuple[object, ...]]", attrgetter(*names))


def each_node(node: object, wanted: frozenset[type]) -> Iterator[object]:
    """Yield the nodes of some kinds within syntax, however deep, without the numbers of literals and series."""
    waiting, known = [node], dict[type, "Callable[[object], tuple[object, ...]] | None"]()
    while waiting:
        one = waiting.pop()
        kind = type(one)
        if kind is tuple:
            waiting.extend(cast("tuple[object, ...]", one)[::-1])
            continue
        parts = known[kind] if kind in known else known.setdefault(kind, _parts_of(kind))
        if parts is None:
            continue
        if kind in wanted:
            yield one
        if kind is Series:
            waiting.extend(cast("Series", one).kinds())
        elif kind is not Name and kind is not Literal:
            waiting.extend(parts(one))


def _held(datum: Datum) -> Datum:
    """Return a tool or a work object as if the robot held the tool and the part stood still.

    Targets count in the work object, whatever holds or moves it: the path on the part is the same.
    """
    value = datum.value.value if isinstance(datum.value, Literal) else None
    if not isinstance(value, tuple) or datum.sizes:
        return datum
    line = datum.line
    if datum.kind.lower() == "tooldata" and len(value) == 3:
        return replace(datum, value=Literal(line, (True, *value[1:])))
    if datum.kind.lower() == "wobjdata" and len(value) == 5:
        return replace(datum, value=Literal(line, (False, True, "", *value[3:])))
    return datum


# External axes.


def _follows(modules: Sequence[Module]) -> bool:
    """Return whether all work objects are moved by a unit, or held by the robot, so that targets go with the part."""
    values = [
        datum.value.value
        for module in modules
        for datum in module.data
        if datum.kind.lower() == "wobjdata" and isinstance(datum.value, Literal)
    ]
    return bool(values) and all(isinstance(each, tuple) and (each[0] is True or each[1] is False) for each in values)


def _goes_with_axes(nodes: _Nodes, notes: Notes, *, follows: bool) -> bool:
    """Return whether targets have external axes, which must stand still unless the work objects go with them."""
    stands: tuple[float, ...] | None = None
    for file, node in nodes:
        if isinstance(node, Assignment) and _is_axis(node.target):
            refuse(file, node.line, "it gives an external axis a value, which is not read")
        for line, axes in _axes_of(node):
            stands = stands or axes
            if axes != stands and not follows:
                refuse(
                    file, line, (
                        "an external axis moves the part or the robot, which is read only if the work object goes "
                        "with it (ufprog FALSE)"
                    )
                )  # fmt: skip
    if stands is not None:
        notes.assumed.append("the part goes with the work object" if follows else "external axes stand still")
    return stands is not None


def _is_axis(target: Expression) -> bool:
    while isinstance(target, Component | Element):
        if isinstance(target, Component) and target.name.lower().startswith(("extax", "eax_")):
            return True
        target = target.of
    return False


def _axes_of(node: object) -> Iterator[tuple[int, tuple[float, ...]]]:
    """Yield line and external axes of each target in a node that has any."""
    if isinstance(node, Series):
        axes = np.array(node.numbers).reshape(-1, TARGET)[:, -_AXES:]
        for row in np.flatnonzero((axes < NO_AXIS).any(axis=1)).tolist():
            yield node.lines[row], tuple(axes[row].tolist())
    elif isinstance(node, Literal):
        for target in _targets(node.value):
            if min(axes := cast("tuple[float, ...]", target[3])) < NO_AXIS:
                yield node.line, axes
    elif isinstance(node, Aggregate) and len(node.parts) == 4 and isinstance(node.parts[3], Literal):
        axes = node.parts[3].value
        if isinstance(axes, tuple) and len(axes) == _AXES and min(cast("tuple[float, ...]", axes)) < NO_AXIS:
            yield node.line, cast("tuple[float, ...]", axes)


def _targets(value: Value) -> Iterator[tuple[Value, ...]]:
    """Yield the robtargets in a literal, which may be an array of them."""
    if not isinstance(value, tuple):
        return
    if [len(each) if isinstance(each, tuple) else 0 for each in value] == [3, 4, 4, _AXES]:
        yield value
    else:
        for part in value:
            yield from _targets(part)


def _mapped(node: object) -> object:
    """Return syntax without external axes."""
    if isinstance(node, tuple):
        return tuple([_mapped(part) for part in cast("tuple[object, ...]", node)])
    if isinstance(node, Series):
        numbers = np.array(node.numbers).reshape(-1, TARGET)
        numbers[:, -_AXES:] = MISSING_AXIS
        return replace(node, numbers=array("d", numbers.ravel()))
    if isinstance(node, Literal):
        return replace(node, value=_unmoved(node.value))
    if is_dataclass(node) and not isinstance(node, type):
        return replace(node, **{each.name: _mapped(getattr(node, each.name)) for each in fields(node)})
    return node


def _unmoved(value: Value) -> Value:
    """Return a literal without the external axes of targets, of places and of joints."""
    if not isinstance(value, tuple):
        return value
    if [len(each) if isinstance(each, tuple) else 0 for each in value] in ([3, 4, 4, _AXES], [6, _AXES]):
        return (*value[:-1], (MISSING_AXIS,) * _AXES)
    return tuple([_unmoved(part) for part in value])


# Signals.


def _outputs(nodes: _Nodes) -> dict[str, str]:
    """Return the type of each output that is switched."""
    found: dict[str, str] = {}

    def note(argument: Expression | None, kind: str) -> None:
        if isinstance(argument, Name):
            found[argument.name.lower()] = kind

    for call in (node for _, node in nodes if isinstance(node, Call)):
        name, given = call.name.lower(), [each.value for each in call.arguments if not each.optional]
        if name in _OUTPUTS and given:
            note(given[0], _OUTPUTS[name])
        elif name == "triggspeed" and len(given) > _TRIGGSPEED_OUTPUT:
            note(given[_TRIGGSPEED_OUTPUT], "signalao")
        elif name.startswith("trigg"):
            for each in call.arguments:
                if each.name.lower() in _OPTIONS:
                    note(each.value, _OPTIONS[each.name.lower()])
    return found


def _inputs(modules: Sequence[Module], nodes: _Nodes, signals: dict[str, str], notes: Notes) -> dict[str, str]:
    """Return the inputs that conditions ask for: names that nothing declares, and that stand nowhere else."""
    asked: dict[str, int] = {}
    handed: set[str] = set()
    for _, node in nodes:
        for name in _asked(node):
            asked.setdefault(name.name.lower(), name.line)
        if isinstance(node, Call):
            handed |= {each.value.name.lower() for each in node.arguments if isinstance(each.value, Name)}
    # What a module declares for all is declared wherever it is asked.
    declared = {datum.name.lower() for module in modules for datum in module.data if not datum.local}
    known = handed | declared | set(signals)
    wanted = {name: line for name, line in asked.items() if name not in known}
    if not wanted:
        return {}
    open_names = {name.lower() for _, _, name in examine(modules, signals=signals, closed=False)[0].open_names}
    found = {name: line for name, line in wanted.items() if name in open_names}
    notes.assumed.extend(f"the input {name} is 1 (line {line})" for name, line in found.items())
    return dict.fromkeys(found, "signaldi")


def _asked(node: object) -> list[Name]:
    """Return the names in a condition, or in what a signal's value is asked by."""
    conditions: tuple[object, ...] = ()
    match node:
        case If():
            conditions = tuple(condition for condition, _ in node.branches)
        case While():
            conditions = (node.condition,)
        case Test():
            conditions = (node.subject,)
        case FunctionCall() if node.name.lower() in {"testdi", "doutput", "dinput"}:
            conditions = node.arguments
        case Assignment():
            conditions = (node.value,)
        case _:
            return []
    return cast("list[Name]", [*each_node(conditions, _NAMES)])
