"""Executes URScript frame by frame: threads, moves, outputs and questions, as the URScript manual describes them.

The controller runs at 500 Hz: in each frame of 2 ms every thread that can go on does so, until it uses physical time by
a move, `sync` or `sleep` or waits for another thread; one that only computes ends in an error [URScript, Threads]. A
move with a blend lets its thread go on when the blend begins [URManual]. Outputs that a program has assigned a run
state go low when it ends, however it ends [URScript, Module ioconfiguration]. Nothing here is shared with what writes.
"""

from __future__ import annotations

from collections.abc import Callable

from geoprint.model import FloatArray
from geoprint.postprocessor.urscript.evaluation import run_routine
from geoprint.postprocessor.urscript.language import Script
from geoprint.postprocessor.urscript.log import HaltError, Log, ReturnError, Scenario, Thread
from geoprint.postprocessor.urscript.machine import Machine

# A program that lasts longer than this has no end [s].
_LONGEST = 48.0 * 3600.0


def execute(script: Script, scenario: Scenario, flange: Callable[[FloatArray], FloatArray]) -> Log:
    """Execute a program from its first statement to its end.

    Args:
        script: that was read.
        scenario: how it is run.
        flange: (k, 6) joints [rad] to (k, 4, 4) poses of the flange in the base frame [mm].

    Raises:
        VerificationError: it does what the controller refuses or this machine does not know; the line is named.
    """
    machine = Machine(script, scenario, flange)
    main = machine.thread
    main.run = run_routine(machine, script.main, main, {})
    machine.threads.append(main)
    frame = 0
    try:
        while machine.threads and machine.threads[0] is main:
            machine.now = frame * scenario.frame
            if machine.now >= scenario.stops_at:
                machine.log.ended = "stopped"
                break
            if machine.now > _LONGEST:
                raise machine.refused("the program has no end")
            for thread in list(machine.threads):
                _go_on(machine, thread)
            frame += 1
        else:
            machine.log.ended = "end"
    except HaltError:
        machine.log.ended = "halt"
    if machine.pending is not None and machine.log.ended == "end":
        raise machine.refused("a blend has no move behind it", line=machine.pending[2].line)
    machine.log.time = machine.now
    for output, state in machine.run_states.items():
        if state in {1, 3} and machine.outputs.get(output, False):
            machine.outputs[output] = False
    machine.log.lit = tuple(sorted(output for output, on in machine.outputs.items() if on))
    return machine.log


def _go_on(machine: Machine, thread: Thread) -> None:
    if thread.run is None or (thread.waits is not None and not thread.waits()):
        return
    machine.thread, thread.statements = thread, 0
    try:
        thread.waits = next(thread.run)
    except StopIteration:
        thread.run = None
        machine.threads.remove(thread)
    except ReturnError:
        raise machine.refused("a value is returned to nobody") from None
    except RecursionError:
        raise machine.refused("functions call one another without end") from None
