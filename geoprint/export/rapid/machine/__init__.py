"""A controller to execute programs on: tasks are compiled from syntax, run by scenarios, and tell what happened."""

from geoprint.export.rapid.machine.execution import (
    VERBS as VERBS,
    Called as Called,
    Execution as Execution,
    Moves as Moves,
    Switching as Switching,
)
from geoprint.export.rapid.machine.modes import INSTRUCTION_OF as INSTRUCTION_OF, Modes as Modes
from geoprint.export.rapid.machine.running import Controller as Controller, execute as execute
from geoprint.export.rapid.machine.scenario import NOT_KNOWN as NOT_KNOWN, Event as Event, Scenario as Scenario
from geoprint.export.rapid.machine.task import MachineTask as MachineTask, compile_task as compile_task
