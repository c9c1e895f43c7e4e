"""What plan.json says of the targets that the program names: how many come sooner than the controller digests."""

from __future__ import annotations

import numpy as np

from geoprint.account.rounding import rounded
from geoprint.export import Json
from geoprint.motion.controller import close_targets
from geoprint.results import Plan


def targets_summary(plan: Plan) -> dict[str, Json]:
    """Return times between targets [ms], the shortest move [mm], and how many targets are special."""
    close, shortest = _close(plan)
    return {
        "period_ms": rounded(1e3 * plan.workpiece.cell.robot.target_period),
        "closer": close,
        "shortest_ms": rounded(1e3 * shortest),
        "shortest_mm": None if plan.robot is None else rounded(plan.robot.orders.shortest_move),
        "dry_run_other_configuration": 0 if plan.robot is None else plan.robot.orders.lifted_otherwise,
    }


def targets_warnings(plan: Plan) -> list[str]:
    """Return what a person should know of that, if anything."""
    close, shortest = _close(plan)
    if not close:
        return []
    warning = (
        f"{close} targets follow the one before sooner than the controller digests them (robot.target_period_ms is "
        f"{1e3 * plan.workpiece.cell.robot.target_period:g}; the soonest comes after {1e3 * shortest:.1f} ms): the arm "
        "may slow down there."
    )
    return [warning]


def _close(plan: Plan) -> tuple[int, float]:
    robot, period = plan.robot, plan.workpiece.cell.robot.target_period
    return (0, np.inf) if robot is None else close_targets(robot.targets, robot.trajectory, period=period)
