"""What plan.json and a person are told of the robot's part of a plan: motion, clearance, program."""

from __future__ import annotations

import numpy as np

from geoprint.account.rounding import all_rounded, rounded
from geoprint.export import Json
from geoprint.model import Placement, Slowdown
from geoprint.motion.controller import LIFT
from geoprint.motion.placing import Uncertainty
from geoprint.pipeline.attitude_report import attitude_summary, attitude_text
from geoprint.pipeline.switching_summary import switching_summary
from geoprint.pipeline.target_report import targets_summary
from geoprint.results import Plan, RobotPlan


def robot_summary(plan: Plan, robot: RobotPlan) -> dict[str, Json]:
    """Return `motion`, `clearance` and `program` of plan.json."""
    calibration = _calibration(plan.workpiece.uncertainty)
    return {
        "motion": _motion(plan, robot) | calibration | {"targets": targets_summary(plan)},
        "clearance": _clearance(robot),
        "program": {
            "modules": [name for name, _ in robot.program.modules],
            "targets": robot.program.targets,
            "dry_run_only": robot.program.dry_run,
            "switching": switching_summary(robot.switching),
        },
    }


def robot_text(plan: Plan, robot: RobotPlan) -> list[str]:
    """Return the lines that a person reads of the robot's part."""
    found, wrist = robot.clearance, np.degrees(robot.joint_path.smallest_wrist_angle)
    return [
        (
            f"motion: {robot.trajectory.duration:.0f} s, smallest wrist angle {wrist:.1f} degrees, "
            f"{robot.program.targets} targets, {robot.orders.shortest_move:.2g} mm and more apart"
        ),
        attitude_text(robot.joint_path, tool=plan.workpiece.cell.tool),
        _pace_text(robot),
        (
            f"clearance: {found.smallest:.2f} mm at the closest ({found.at}); "
            f"not checked: {', '.join(found.not_checked)}"
        ),
    ]


def placement_warnings(placement: Placement) -> list[str]:
    """Return what a person should know of where the part stands, if anything."""
    if not placement.missing:
        return []
    return [f"PLACEMENT NOT KNOWN: programs run only dry, until somebody states {' and '.join(placement.missing)}."]


def _motion(plan: Plan, robot: RobotPlan) -> dict[str, Json]:
    placement = robot.placement
    return {
        "duration_s": rounded(robot.trajectory.duration),
        "branch": robot.joint_path.branch,
        **attitude_summary(robot.joint_path, tool=plan.workpiece.cell.tool),
        "smallest_wrist_angle_deg": rounded(np.degrees(robot.joint_path.smallest_wrist_angle)),
        "slowest_deposit_mm_s": rounded(robot.trajectory.slowest_deposit),
        "stretched_pieces": robot.trajectory.stretched,
        "share_at_speed": rounded(robot.trajectory.share_at_speed),
        "share_on_ramps": rounded(robot.trajectory.share_on_ramps),
        "slowdowns": [_slowdown(slowdown) for slowdown in robot.trajectory.slowdowns],
        "placement_calibrated": placement.calibrated,
        "placement_missing": list(placement.missing),
        "largest_touch_miss_mm": rounded(placement.misses.max()) if placement.calibrated else None,
        "T_base_work": [all_rounded(row) for row in placement.T_base_work],
    }


def _calibration(uncertainty: Uncertainty | None) -> dict[str, Json]:
    """Return how far the surface may lie off along its normal, where that is most; nothing where nobody calibrated."""
    if uncertainty is None:
        return {}
    return {
        "surface_uncertainty_mm": rounded(uncertainty.deviation),
        "surface_within_mm": rounded(uncertainty.bound),
        "surface_uncertain_at_mm": all_rounded(uncertainty.place),
    }


def _slowdown(slowdown: Slowdown) -> dict[str, Json]:
    return {
        "run": slowdown.run,
        "kind": slowdown.kind,
        "place_mm": all_rounded(slowdown.place),
        "arc_mm": rounded(slowdown.arc),
        "length_mm": rounded(slowdown.length),
        "set_mm_s": slowdown.set_speed,
        "held_mm_s": rounded(slowdown.held_speed),
        "joint": slowdown.joint,
        "limit": slowdown.limit,
    }


def _pace_text(robot: RobotPlan) -> str:
    """Return one line on the speed of the deposit that names the worst slowdown."""
    found = robot.trajectory
    line = f"speed: {found.share_at_speed:.1%} of the deposit within 1 % of the set speed"
    if not found.slowdowns:
        return f"{line}; the rest are the ramps at the ends of runs"
    worst = min(found.slowdowns, key=lambda slowdown: slowdown.held_speed)
    what = "is lowered" if worst.kind == "lowered" else "dips"
    x, y, z = worst.place
    others = len({slowdown.run for slowdown in found.slowdowns}) - 1
    return (
        f"{line}; run {worst.run + 1} {what} to {worst.held_speed:.1f} mm/s by the {worst.limit} of joint "
        f"{worst.joint} at ({x:.1f}, {y:.1f}, {z:.1f})" + (f", {others} more by less" if others else "")
    )


def _clearance(robot: RobotPlan) -> dict[str, Json]:
    found = robot.clearance
    return {
        "smallest_mm": rounded(found.smallest),
        "at": found.at,
        "arm_smallest_mm": None if found.arm_smallest is None else rounded(found.arm_smallest),
        "arm_at": found.arm_at,
        "kept_mm": found.kept,
        "tip_margin_mm": rounded(found.tip_margin),
        "checks": found.checks,
        "checked": list(found.checked),
        "not_checked": list(found.not_checked),
        "dry_run": {
            "lift_mm": LIFT,
            "smallest_mm": rounded(robot.dry_clearance.smallest),
            "at": robot.dry_clearance.at,
        },
    }
