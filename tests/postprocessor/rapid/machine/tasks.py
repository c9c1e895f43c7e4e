"""Small programs for the machine, and an arm to run them on."""

from __future__ import annotations

from functools import cache

from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.machine import Controller, Execution, MachineTask, Scenario, compile_task, execute
from geoprint.robot.arm import Arm
from tests.postprocessor.export_cases import CELL

HOME = tuple(CELL.robot.home.tolist())
SIGNALS = {"doValve": "signaldo", "doUV": "signaldo", "aoFlow": "signalao", "diDoor": "signaldi"}
# At the reach of the arm, with the tool upside down; one place, written short.
TARGET = "[[{x},{y},{z}],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


@cache
def arm() -> Arm:
    return Arm(CELL.robot, T_flange_tool=CELL.tool.T_flange_tool)


def target(x: float, y: float = 0.0, z: float = 300.0) -> str:
    return TARGET.format(x=x, y=y, z=z)


def task(body: str, *, others: dict[str, str] | None = None, declared: str = "") -> MachineTask:
    """A module with main and whatever else, and files that a program may load."""
    text = f"MODULE Main\n{declared}\nPROC main()\n{body}\nENDPROC\nENDMODULE\n"
    modules = [parse_module("Main.mod", text)]
    modules += [parse_module(file, other) for file, other in (others or {}).items()]
    return compile_task(modules, at_once=["Main.mod"], signals=SIGNALS, arm=arm())


def ran(
    body: str, scenario: Scenario | None = None, *, declared: str = "", others: dict[str, str] | None = None
) -> Execution:
    return execute(task(body, others=others, declared=declared), scenario or Scenario(joints=HOME))


def controller(body: str, scenario: Scenario | None = None, *, declared: str = "") -> Controller:
    return Controller(task(body, declared=declared), scenario or Scenario(joints=HOME))


def shown(execution: Execution) -> list[str]:
    return [text for _, text in execution.texts]
