"""A third dialect, sketched as a package of its own would bring it: straight moves in the words of KRL, and outputs."""

# A sketch asks for little of what it is given.
# ruff: noqa: ARG002

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar

import numpy as np

from geoprint.errors import VerificationError
from geoprint.model import Cell, ControllerPath, Dispensing, FloatArray, JointPath, Placement, Program, Targets
from geoprint.postprocessor import Executed, Orders, Settings, Switched, TrajectoryTable
from geoprint.postprocessor.execution import refusal
from geoprint.postprocessor.interface import Execution, Handling, RobotProgram
from geoprint.postprocessor.timeline import moment_on
from geoprint.robot.arm import Arm
from geoprint.robot.controller import controller_path

FILE = "part.src"
MOVE = re.compile(r"LIN \{X (\S+), Y (\S+), Z (\S+)\}")
TRIGGER = re.compile(r"TRIGGER (\w+) (TRUE|FALSE) (START|END) (\S+)")


class SketchedKrl:
    """Straight moves with triggers before the move that they belong to."""

    title: ClassVar[str] = "moves of a sketch"
    joining: ClassVar[None] = None

    def check_cell(self, cell: Cell) -> None:
        """Take every cell."""

    def check_arm(self, arm: Arm) -> None:
        """Take every arm."""

    def driven(self, joint_path: JointPath, targets: Targets, motion: TrajectoryTable, arm: Arm) -> ControllerPath:
        return controller_path(joint_path, targets, arm)

    def write(self, program: RobotProgram, cell: Cell) -> tuple[Program, Execution]:
        names = {"dispenser": cell.signals.dispenser, "uv_lamp": cell.signals.uv_lamp, "vacuum": cell.signals.vacuum}
        lines = ["DEF part()"]
        for target, (x, y, z) in enumerate(program.orders.tips.tolist()):
            lines += [
                f"TRIGGER {names[each.output]} {str(each.on).upper()} {'START' if each.from_start else 'END'} "
                f"{each.distance:.4f}"
                for each in program.events
                if each.target == target
            ]
            lines.append(f"LIN {{X {x:.4f}, Y {y:.4f}, Z {z:.4f}}}")
        files = ((FILE, "\n".join([*lines, "END", ""])),)
        execution = self.execute(files, program, cell)
        for finding in execution.findings:
            raise finding
        return Program(files, targets=program.orders.count, dry_run=bool(program.placement.missing)), execution

    def kept(
        self, cell: Cell, *, placement: Placement, names: Sequence[str], folders: Sequence[str] = ()
    ) -> dict[str, str]:
        return {"outputs.txt": f"{cell.signals.dispenser}\n{cell.signals.uv_lamp}\n"}

    def kept_findings(
        self,
        files: Mapping[str, str],
        cell: Cell,
        *,
        placement: Placement,
        names: Sequence[str],
        folders: Sequence[str] = (),
    ) -> Iterator[VerificationError]:
        if files.get("outputs.txt", "").split() != [cell.signals.dispenser, cell.signals.uv_lamp]:
            yield refusal("controller/outputs.txt", 1, "it must name valve and lamp")

    def parse(self, files: Sequence[tuple[str, str]]) -> None:
        _places(files)

    def as_written(self, name: str, text: str) -> str:
        return text

    def execute(self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell) -> Execution:
        orders = program.orders
        places, lines, switched = _places(files)
        if len(places) != orders.count:
            return Execution((refusal(FILE, 1, f"it has {len(places)} moves, planned are {orders.count}"),))
        off = np.linalg.norm(places - orders.tips, axis=1)
        findings = (refusal(FILE, lines[int(off.argmax())], "it goes elsewhere"),) if off.max() > 1e-3 else ()
        timed = tuple(
            Switched(
                moment_on(target, distance, orders, program.tips_at, from_start=start), name.lower(), on, FILE, line
            )
            for target, name, on, start, distance, line in switched
        )
        count = len(lines) + len(switched)
        done = Executed(("as written",), count, count, (), float(off.max()), 0.0, 0.0, 0.0, ())
        return Execution(findings, done, timed, tuple((FILE, line) for line in lines))

    def check(
        self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell, *, kept: Mapping[str, str]
    ) -> Execution:
        return self.execute(files, program, cell)

    def dispensing(self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell) -> Dispensing:
        raise VerificationError("a sketch deposits nothing")

    def header_findings(self, files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
        return iter(())

    def handling(
        self, orders: Orders, cell: Cell, *, placement: Placement, names: Sequence[str], settings: Settings | None
    ) -> Handling:
        return Handling((f"select {FILE}",), ("as written",), ("1. look at it",))


def _places(
    files: Sequence[tuple[str, str]],
) -> tuple[FloatArray, list[int], list[tuple[int, str, bool, bool, float, int]]]:
    """Return where the moves go, their lines, and target, output, value, end, distance and line of each trigger."""
    places: list[list[float]] = []
    lines: list[int] = []
    switched: list[tuple[int, str, bool, bool, float, int]] = []
    for number, line in enumerate(dict(files)[FILE].split("\n"), start=1):
        if move := MOVE.fullmatch(line):
            places.append([float(each) for each in move.groups()])
            lines.append(number)
        elif trigger := TRIGGER.fullmatch(line):
            name, value, end, distance = trigger.groups()
            switched.append((len(places), name, value == "TRUE", end == "START", float(distance), number))
        elif line not in {"DEF part()", "END", ""}:
            raise refusal(FILE, number, f"{line!r} is no move")
    return np.array(places), lines, switched
