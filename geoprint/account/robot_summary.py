"""What plan.json and a person are told of the robot's part of a plan: motion, clearance, program."""

from __future__ import annotations

import numpy as np

from geoprint.account.rounding import all_rounded, rounded
from geoprint.export import Json
from geoprint.export.rapid import Timeline
from geoprint.model import FloatArray, JointPath, Placement, PoseStream, Slowdown, Tool
from geoprint.motion.arm import is_axial, tilts
from geoprint.motion.controller import LIFT, close_targets
from geoprint.motion.placing import Uncertainty
from geoprint.results import Plan, RobotPlan

# A nozzle that leans less than this from the attitude of the path does not lean [rad].
NOTABLE_LEAN = float(np.radians(0.05))
# Places of lean that are listed, those with the largest lean first.
LISTED_PLACES = 20
# Decimals of angles [degrees] and lengths [mm].
DECIMALS = 3


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


def attitude_summary(path: JointPath, *, tool: Tool) -> dict[str, Json]:
    """Return what `motion` of plan.json says of turn and lean: angles in degrees, tilt from the surface normal."""
    lengths = _laid_lengths(path.poses)
    laid = lengths > 0.0
    tilt = tilts(path.poses)[laid]
    leaning = np.linalg.norm(path.leans, axis=1) > NOTABLE_LEAN
    total = max(float(lengths.sum()), np.finfo(np.float64).tiny)
    return {
        "rotation": {
            "axial_nozzle": is_axial(tool.T_flange_tool),
            "least_deg": _degrees(path.rotations.min()),
            "most_deg": _degrees(path.rotations.max()),
        },
        "joint_6_turns": round(path.turns_of_joint_6, DECIMALS),
        "tilt": {
            "largest_deg": _degrees(tilt.max(initial=0.0)),
            "mean_deg": _degrees(float(tilt @ lengths[laid]) / total),
        },
        "lean": {"deposit_share": round(float(lengths[leaning].sum()) / total, DECIMALS), "places": _places(path)},
    }


def attitude_text(path: JointPath, *, tool: Tool) -> str:
    """Return the line that a person reads of turn and lean."""
    if is_axial(tool.T_flange_tool):
        turn = "on the flange's axis, its turn stays constant because it would move joint 6 only"
    else:
        turn = f"turns about itself over {np.degrees(np.ptp(path.rotations)):.0f} degrees along the way"
    leans = np.linalg.norm(path.leans, axis=1)
    count = len(_stretches(path))
    lean = f"leans in {count} places, by up to {np.degrees(leans.max()):.1f} degrees" if count else "leans nowhere"
    return f"nozzle: {turn}; joint 6 makes {path.turns_of_joint_6:.1f} turns; {lean}"


def _places(path: JointPath) -> list[Json]:
    """Return where the nozzle leans, the largest leans first."""
    leans = np.linalg.norm(path.leans, axis=1)
    peaks = [int(rows[leans[rows].argmax()]) for rows in _stretches(path)]
    return [
        {
            "run": int(path.poses.runs[row]),
            "place_mm": [round(float(value), DECIMALS) for value in path.poses.tips[row]],
            "lean_deg": _degrees(leans[row]),
            "deposit": bool(path.poses.deposit[row]),
        }
        for row in sorted(peaks, key=lambda row: -leans[row])[:LISTED_PLACES]
    ]


def _stretches(path: JointPath) -> list[np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Return the rows of each stretch in which the nozzle leans."""
    rows = np.flatnonzero(np.linalg.norm(path.leans, axis=1) > NOTABLE_LEAN)
    return np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1) if rows.size else []


def _laid_lengths(poses: PoseStream) -> FloatArray:
    """Return the (p,) deposited length that belongs to each pose [mm]."""
    steps = np.where(poses.laid, np.linalg.norm(np.diff(poses.tips, axis=0), axis=1), 0.0) / 2.0
    return np.append(steps, 0.0) + np.append(0.0, steps)


def _degrees(angle: float | np.floating) -> float:
    return round(float(np.degrees(angle)), DECIMALS)


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


def switching_summary(switching: Timeline) -> dict[str, Json]:
    """Return what flows and shines when, as plan.json carries it."""
    return {
        "largest_error_mm": round(float(switching.errors.max(initial=0.0)), 6),
        "lamp_alone_s": round(switching.lamp_alone, 6),
        "runs": [
            {"run": int(run), "deposit_s": deposit.round(4).tolist(), "material_s": material.round(4).tolist()}
            for run, deposit, material in zip(switching.runs, switching.deposits, switching.material, strict=True)
        ],
        "lamp_s": switching.lamp.round(4).tolist(),
        "vacuum_s": switching.vacuum.round(4).tolist(),
    }
