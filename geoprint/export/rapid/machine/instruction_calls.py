"""Compiles instructions that do not move the arm."""

from __future__ import annotations

from geoprint.export.rapid.language.syntax import Call
from geoprint.export.rapid.machine.calls import options_of, positional
from geoprint.export.rapid.machine.code import Scope, Step
from geoprint.export.rapid.machine.expressions import compiled, operand, reference
from geoprint.export.rapid.machine.instructions import INSTRUCTIONS
from geoprint.export.rapid.machine.values.faults import unknown


def compile_instruction(call: Call, scope: Scope) -> Step:
    """Return the step of an instruction.

    Raises:
        VerificationError: it is given what this machine does not know.
    """
    instruction = INSTRUCTIONS[call.name.lower()]
    arguments = positional(call.arguments)
    if len(arguments) != instruction.takes:
        unknown(scope.file, call.line, f"{call.name} is given {len(arguments)} arguments")
    makers = [
        reference(argument, scope)
        if place in instruction.references
        else compiled(argument, scope).run
        if place in instruction.signals
        else operand(argument, scope).run
        for place, argument in enumerate(arguments)
    ]
    options, run = options_of(call.arguments, scope, instruction.options), instruction.run
    return lambda state: run(state, [make(state) for make in makers], options(state))
