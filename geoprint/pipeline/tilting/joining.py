"""The one program of all attitudes: it loads the program of each in its turn, which asks for the table first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from geoprint.export.rapid.stacks import OwnProgram, together
from geoprint.model import Cell
from geoprint.results import JoinedProgram, Plan, RobotPlan

# How the folders begin in which a bundle keeps what belongs to one of several attitudes; its number follows.
PART = "part-"


def joined_program(plan: Plan) -> JoinedProgram | None:
    """Return the program that prints all attitudes of a plan, verified; None where one attitude is all.

    Raises:
        VerificationError: the program, read back and executed, is not what its attitudes are.
    """
    if len(plan.robot) < 2:
        return None
    own = own_programs(plan.workpiece.cell, plan.robot)
    modules, beside, proof = together(own, part_name=plan.workpiece.name)
    return JoinedProgram(tuple(modules.items()), tuple(beside.items()), proof)


def own_programs(cell: Cell, robots: Sequence[RobotPlan]) -> list[OwnProgram]:
    """Return the program of each attitude by itself, in the order of printing."""
    count = len(robots)
    return [
        OwnProgram(
            1, part_folder(number, count), robot.program.modules, attitude_cell(cell, number=number, count=count),
            robot.placement,
        )
        for number, robot in enumerate(robots, start=1)
    ]  # fmt: skip


def part_folder(number: int, count: int) -> str:
    """Return the folder in which the files of one of several placements lie; none for a single one."""
    return "" if count == 1 else f"{PART}{number}"


def attitude_cell(cell: Cell, *, number: int, count: int) -> Cell:
    """Return the cell for one of several attitudes: the part is exposed as a whole when all of it is printed.

    Args:
        cell: of the plan.
        number: of the attitude, from 1.
        count: of all of them.
    """
    return cell if number == count else replace(cell, flood=None)
