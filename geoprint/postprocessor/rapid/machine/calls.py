"""Binds the arguments of a call to the parameters of a routine, and sorts those of an instruction."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, cast

from geoprint.errors import VerificationError
from geoprint.postprocessor.rapid.language.kinds import LARGEST_NUM
from geoprint.postprocessor.rapid.language.syntax import Argument, Call, Expression, Literal, Parameter, Value
from geoprint.postprocessor.rapid.machine.state import MISSING, Reference, Slot, State, kept
from geoprint.postprocessor.rapid.machine.stepping import enter
from geoprint.postprocessor.rapid.machine.values import fault, single, unknown

if TYPE_CHECKING:
    from geoprint.postprocessor.rapid.machine.stepping import RoutineCode, Scope


# Options that name an output.
OUTPUTS = frozenset({"dop", "aop", "gop"})


def binder(
    routine: RoutineCode, arguments: tuple[Argument, ...], scope: Scope, *, line: int
) -> Callable[[State], list[Slot]]:
    """Return what makes the first slots of a routine's frame out of the arguments of a call.

    Raises:
        VerificationError: the arguments are not those of the parameters.
    """
    given: dict[str, Argument] = {}
    waiting = [parameter for parameter in routine.parameters if not parameter.optional]
    for argument in arguments:
        if argument.name:
            word = argument.name.lower()
            named = next((each for each in routine.parameters if each.name.lower() == word), None)
            if named is None:
                unknown(scope.file, argument.line, f"{routine.name} has no parameter {argument.name}")
            waiting = [parameter for parameter in waiting if parameter is not named]
        elif waiting:
            named = waiting.pop(0)
        else:
            unknown(scope.file, argument.line, f"{routine.name} has too many arguments")
        given[named.name] = argument
    if waiting:
        unknown(scope.file, line, f"{routine.name} lacks the parameter {waiting[0].name}")
    makers = [_maker(parameter, given.get(parameter.name), scope) for parameter in routine.parameters]
    return lambda state: [make(state) for make in makers]


def late_call(call: Call, run: Callable[[State], Value], scope: Scope) -> Callable[[State], None]:
    """Return the step that calls the procedure whose name a text gives."""
    binders: dict[str, tuple[Callable[[State], list[Slot]], int]] = {}

    def step(state: State) -> None:
        name = cast("str", run(state)).rpartition(":")[2].lower()
        routine = state.routines.get(name)
        if routine is None:
            fault("ERR_REFUNKPRC", f"there is no procedure {name} in a loaded module")
        if routine.kind != "PROC":
            fault("ERR_CALLPROC", f"{name} is not a procedure")
        if name not in binders:
            try:
                binders[name] = binder(routine, call.arguments, scope, line=call.line), scope.weigh()
            except VerificationError as error:
                # Only as it is called it is known whose arguments they must be.
                fault("ERR_CALLPROC", f"{name} is called by its name: {error.details.get('reason', error)}")
        bind, weight = binders[name]
        state.steps += weight
        enter(state, routine, bind(state))

    return step


def by_reference(parameter: Parameter) -> bool:
    """Tell whether a parameter's slot holds a reference; signals are handed over by their name."""
    return bool(parameter.mode) and not parameter.kind.lower().startswith("signal")


def _maker(parameter: Parameter, argument: Argument | None, scope: Scope) -> Callable[[State], Slot]:
    if argument is None:
        return lambda _: MISSING
    value = argument.value
    number = value.value if isinstance(value, Literal) and not parameter.mode else None
    if isinstance(number, float) and abs(number) <= LARGEST_NUM:
        rounded = single(number)
        return lambda _: rounded
    return _computing(parameter, argument, scope)


def _computing(parameter: Parameter, argument: Argument, scope: Scope) -> Callable[[State], Slot]:
    from geoprint.postprocessor.rapid.machine.expressions import compiled, operand, reference

    if argument.forwarded:
        return _forwarded(parameter, argument, scope)
    if argument.value is None:
        return lambda _: True
    if by_reference(parameter):
        return reference(argument.value, scope)
    if parameter.kind.lower().startswith("signal"):
        return compiled(argument.value, scope).run
    run = operand(argument.value, scope).run
    return lambda state: kept(state, run(state))


def _forwarded(parameter: Parameter, argument: Argument, scope: Scope) -> Callable[[State], Slot]:
    """Return what hands on an optional parameter of the routine around, if it is there."""
    local = scope.locals.get(argument.forwarded.lower())
    if local is None:
        unknown(scope.file, argument.line, f"{argument.forwarded} is not a parameter that can be passed on")
    slot, kept = local.slot, local.by_reference
    if kept == by_reference(parameter):
        return lambda state: state.local[slot]

    def other(state: State) -> Slot:
        given = state.local[slot]
        if given is MISSING:
            return given
        return given.get(state) if isinstance(given, Reference) else Reference(len(state.frames) - 1, slot)

    return other


def positional(arguments: tuple[Argument, ...]) -> list[Expression]:
    """Return the values of the arguments that are not optional."""
    return [argument.value for argument in arguments if not argument.optional and argument.value is not None]


def options_of(
    arguments: tuple[Argument, ...], scope: Scope, known: frozenset[str]
) -> Callable[[State], Mapping[str, Value]]:
    """Return what gives the values of optional arguments by name in lower case; a switch is TRUE.

    Raises:
        VerificationError: one is not known.
    """
    from geoprint.postprocessor.rapid.machine.expressions import compiled, operand

    makers: dict[str, Callable[[State], Value]] = {}
    for argument in arguments:
        name = argument.name.lower()
        if not argument.optional:
            continue
        if name not in known:
            unknown(scope.file, argument.line, f"the option {argument.name} is unknown to this machine here")
        look = compiled if name in OUTPUTS else operand
        makers[name] = (lambda _: True) if argument.value is None else look(argument.value, scope).run
    if not makers:
        return _nothing
    return lambda state: {name: make(state) for name, make in makers.items()}


def _nothing(_: State) -> Mapping[str, Value]:
    return {}
