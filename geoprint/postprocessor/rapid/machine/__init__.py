"""A controller to execute programs on: tasks are compiled from syntax, run by scenarios, and tell what happened."""

from geoprint.postprocessor.rapid.machine.execution import (
    INSTRUCTION_OF as INSTRUCTION_OF,
    NOT_KNOWN as NOT_KNOWN,
    VERBS as VERBS,
    Called as Called,
    Event as Event,
    Execution as Execution,
    Modes as Modes,
    Moves as Moves,
    Scenario as Scenario,
    Switching as Switching,
)
from geoprint.postprocessor.rapid.machine.running import Controller as Controller, execute as execute
from geoprint.postprocessor.rapid.machine.task import MachineTask as MachineTask, compile_task as compile_task
