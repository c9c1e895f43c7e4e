"""What is said of the attitudes of a table that the robot prints in, and of the one program of all of them."""

from __future__ import annotations

import numpy as np

from geoprint.account.records.robot import JoinedRecord, TablePoseRecord
from geoprint.results import Plan, RobotPlan

# What a person loads to print all attitudes.
JOINED_LIST = "rapid/GeoStack.pgf"


def record_table_pose(plan: Plan, robot: RobotPlan) -> TablePoseRecord | None:
    """Return how a table holds the part while one of the robot's parts is printed; None where the part stands still."""
    pose = robot.placement.table
    if pose is None or plan.tilting is None or robot.table_kept is None:
        return None
    axes = np.degrees(pose.axes) if plan.tilting.rotary else pose.axes
    return TablePoseRecord(attitude=pose.number, axes=tuple(axes.tolist()), kept_mm=robot.table_kept)


def record_joined(plan: Plan) -> JoinedRecord | None:
    """Return what plan.json says of the program of all attitudes; None where there is one or none."""
    if plan.joined is None or plan.tilting is None:
        return None
    proof = plan.joined.proof
    return JoinedRecord(
        file=JOINED_LIST,
        print_s=print_seconds(plan) or 0.0,
        table_s=sum(plan.tilting.seconds),
        scenarios=proof.scenarios,
        refused=proof.refused,
        lines_with_statements=proof.statements,
        lines_executed=proof.executed,
    )


def print_seconds(plan: Plan) -> float | None:
    """Return the time of the program from home to home, with the table's own motions; None without a program [s]."""
    if not plan.robot:
        return None
    moving = () if plan.tilting is None else plan.tilting.seconds
    return sum(robot.trajectory.duration for robot in plan.robot) + sum(moving)
