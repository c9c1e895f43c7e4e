"""What plan.json says of a plan, and the few lines that a person reads after it."""

from __future__ import annotations

import resource
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import numpy as np

from geoprint.backends import Flattening, diagnostics, distortion, predicted_spacing
from geoprint.export import Json
from geoprint.model import Slowdown, Surface
from geoprint.motion import LIFT, NOTABLE_SHARE, Uncertainty
from geoprint.paths import largest_lean, mean_lean
from geoprint.pipeline.attitude_report import attitude_summary, attitude_text
from geoprint.pipeline.laying import laid_summary, laid_text
from geoprint.pipeline.patches import patch_summary
from geoprint.pipeline.planning import Plan, RobotPlan
from geoprint.pipeline.switching_summary import switching_summary
from geoprint.pipeline.target_report import targets_summary, targets_warnings
from geoprint.quality import Uniformity
from geoprint.surfaces import describe, edge_lengths, face_areas, unit_hint

# A nozzle that leans more than this from the surface normal [degrees] lays a visibly lopsided bead.
NOTABLE_LEAN = 15.0
# Paths whose spacing varies by more than this could be more even ...
NOTABLE_CV = 0.01
# ... with the backend nearest to the exact distance.
CLOSEST_BACKEND = "fast-marching"
# Places listed where the spacing is farthest from wanted.
WORST_PLACES = 5
# Decimals of lengths [mm] and angles [degrees] in plan.json: finer than any machine, short enough to read.
DECIMALS = 6


def summary(plan: Plan) -> dict[str, Json]:
    """Return the content of plan.json.

    Lengths are mm, angles degrees, times s. `timings_s` and `peak_memory_mb` vary from run to run, nothing else does.
    """
    result: dict[str, Json] = {
        "version": version("geoprint"),
        "input": _input(plan),
        "settings": settings_summary(plan),
        "surface": _surface(plan),
        "paths": _paths(plan),
        "field": _field(plan),
    }
    if plan.flattening is not None:
        result["chart"] = _chart(plan, plan.flattening)
    if plan.uniformity is not None:
        result["uniformity"] = uniformity_summary(plan.uniformity)
    if plan.laid is not None:
        result["deposition"] = laid_summary(plan.laid)
    if plan.robot is not None:
        result |= {
            "motion": _motion(plan, plan.robot)
            | _calibration(plan.workpiece.uncertainty)
            | {"targets": targets_summary(plan)},
            "clearance": _clearance(plan.robot),
            "program": {
                "modules": [name for name, _ in plan.robot.program.modules],
                "targets": plan.robot.program.targets,
                "dry_run_only": plan.robot.program.dry_run,
                "switching": switching_summary(plan.robot.switching),
            },
        }
    result["timings_s"] = {name: round(seconds, 3) for name, seconds in plan.timings}
    result["peak_memory_mb"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    result["warnings"] = list(_warnings(plan))
    return result


def outcome_text(plan: Plan) -> str:
    """Return the lines that a person reads when a plan is done."""
    paths = _paths(plan)
    lines = [
        (
            f"{plan.job.surface.name}: {paths['runs']} runs, {paths['deposit_mm']:.0f} mm of path at "
            f"{plan.contours.spacing:.3g} mm spacing ({plan.job.backend})"
        )
    ]
    if plan.uniformity is not None:
        lines.append(
            f"evenness: spacing varies by {plan.uniformity.cv:.2%} (CV), uncovered {plan.uniformity.uncovered:.2%}"
        )
    if plan.laid is not None:
        lines.append(laid_text(plan.laid))
    if plan.robot is not None:
        motion, found = _motion(plan, plan.robot), plan.robot.clearance
        lines += [
            (
                f"motion: {motion['duration_s']:.0f} s, smallest wrist angle {motion['smallest_wrist_angle_deg']:.1f} "
                f"degrees, {plan.robot.program.targets} targets"
            ),
            attitude_text(plan.robot.joint_path, tool=plan.workpiece.cell.tool),
            _pace_text(plan.robot),
            (
                f"clearance: {found.smallest:.2f} mm at the closest ({found.at}); "
                f"not checked: {', '.join(found.not_checked)}"
            ),
        ]
    lines += [f"note: {warning}" for warning in _warnings(plan)]
    return "\n".join(lines)


def uniformity_summary(measured: Uniformity) -> dict[str, Json]:
    """Return the figures of `uniformity` as plan.json and compare.json carry them; ratios to the spacing."""
    return {
        "method": measured.method,
        "spacing": {
            "mean": _rounded(measured.mean),
            "cv": _rounded(measured.cv),
            **{f"p{share}": _rounded(measured.percentile(share)) for share in (1, 5, 50, 95, 99)},
            "max": _rounded(measured.percentile(100)),
            "within_5_percent": _rounded(measured.within_5_percent),
        },
        "straight": {
            "mean": _rounded(measured.straight.mean()),
            "cv": _rounded(measured.straight.std() / measured.straight.mean()),
        },
        "samples": len(measured.ratios),
        "samples_bounded": _rounded(measured.bounded),
        "largest_doubt": _rounded(measured.largest_doubt),
        "samples_unreached": measured.unreached,
        "samples_where_fronts_meet": _rounded(measured.meeting),
        "gap": _rounded(measured.uncovered),
        "overlap": _rounded(measured.overlap),
        "area_unknown": _rounded(measured.unknown),
        "fill": _rounded(measured.fill),
        "width_cv": _rounded(measured.width_cv),
        "levels": [
            {"level": level, "mean": _rounded(mean), "cv": _rounded(cv), "worst": _rounded(worst)}
            for level, mean, cv, worst in measured.by_level()
        ],
        "worst_places": [
            {"place_mm": [_rounded(value) for value in place], "level": level, "ratio": _rounded(ratio)}
            for place, level, ratio in measured.worst(WORST_PLACES)
        ],
    }


def settings_summary(plan: Plan) -> dict[str, Json]:
    """Return what was asked for and with which cell: lengths mm, speeds mm/s."""
    process = plan.workpiece.cell.process
    return {
        "backend": plan.job.backend,
        "spacing_mm": plan.contours.spacing,
        "resolution": plan.job.resolution,
        "rounds": plan.job.rounds,
        "seed": plan.job.seed,
        "flip": plan.job.flip,
        "label": plan.job.label,
        "at_mm": plan.job.at,
        "radius_mm": plan.job.radius,
        "cone_deg": plan.job.cone_deg,
        "box_mm": plan.job.box,
        "fill_holes_mm": plan.job.fill_holes,
        "cell": plan.workpiece.cell.name,
        "place": plan.job.place,
        "max_tilt_deg": plan.job.max_tilt,
        "on_slowdown": plan.job.on_slowdown,
        "robot": plan.job.robot,
        "speed_mm_s": process.speed,
        "travel_speed_mm_s": process.travel_speed,
        "standoff_mm": process.standoff,
        "clearance_mm": process.clearance,
        "retract_mm": process.retract,
        "layer_height_mm": process.layer_height,
    }


def _input(plan: Plan) -> dict[str, Json]:
    def of(path: Path, digest: str) -> dict[str, Json]:
        return {"name": path.name, "sha256": digest, "unit": plan.workpiece.unit}

    digests = plan.workpiece.digests
    result = of(plan.job.surface, digests[0])
    if plan.workpiece.notes:
        result["made"] = dict(plan.workpiece.notes)
    if plan.job.body is not None:
        result["body"] = of(plan.job.body, digests[1])
    return result


def _surface(plan: Plan) -> dict[str, Json]:
    def of(surface: Surface) -> dict[str, Json]:
        return {
            "vertices": len(surface.vertices),
            "faces": len(surface.faces),
            "mean_edge_mm": _rounded(edge_lengths(surface).mean()),
        }

    return {
        "topology": describe(plan.workpiece.part),
        "area_mm2": _rounded(face_areas(plan.workpiece.part).sum()),
        "size_mm": [_rounded(size) for size in np.ptp(plan.workpiece.part.vertices, axis=0)],
        "prepared": of(plan.workpiece.part),
        "refined": of(plan.workpiece.surface),
        "preparation": asdict(plan.workpiece.preparation),
        "patch": None if plan.workpiece.patch is None else patch_summary(plan.workpiece.patch),
        "side": asdict(plan.workpiece.side),
    }


def _paths(plan: Plan) -> dict[str, Json]:
    poses = plan.poses
    lengths = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)
    return {
        "runs": plan.toolpath.curves.count,
        "levels": int(plan.toolpath.levels.max()) + 1,
        "poses": poses.count,
        "deposit_mm": _rounded(lengths[poses.laid].sum()),
        "travel_mm": _rounded(lengths[~poses.laid].sum()),
        "stops_while_laying": poses.stops_while_laying,
        "corners_rounded": len(plan.toolpath.fillets),
        "corners_rounded_mm": [[_rounded(value) for value in place] for place in plan.toolpath.fillets],
        "corners_split": len(plan.toolpath.splits),
        "corners_split_mm": [[_rounded(value) for value in place] for place in plan.toolpath.splits],
        "dropped_runs": plan.toolpath.dropped_runs,
        "dropped_mm": _rounded(plan.toolpath.dropped_length),
        "largest_distance_mm": _rounded(plan.contours.distance.maximum),
        "largest_lean_deg": _rounded(np.degrees(largest_lean(poses))),
        "mean_lean_deg": _rounded(np.degrees(mean_lean(poses))),
    }


def _field(plan: Plan) -> dict[str, Json]:
    workpiece = plan.workpiece
    found = diagnostics(workpiece.surface, plan.contours.distance)
    refinement: dict[str, Json] = {
        "edge_length_mm": _rounded(workpiece.edge_length),
        "faces_before": len(workpiece.part.faces),
        "faces_after": len(workpiece.surface.faces),
    }
    return {"refinement": refinement, **{name: _rounded(value) for name, value in asdict(found).items()}}


def _chart(plan: Plan, flattening: Flattening) -> dict[str, Json]:
    surface, contours = plan.workpiece.surface, plan.contours
    found = distortion(surface, flattening.chart.flat)
    predicted = predicted_spacing(surface, flattening.chart.flat, contours.curves.points)
    levels = np.repeat(contours.levels, np.diff(contours.curves.offsets))
    return {
        "resolution": flattening.resolution,
        "pixel_mm": _rounded(flattening.pixel),
        "largest_pixel_on_surface_mm": _rounded(flattening.largest_pixel),
        "area_scale": {f"p{share}": _rounded(found.scale_percentile(share)) for share in (1, 50, 99)},
        "mean_dilatation": _rounded(found.mean_dilatation),
        "predicted_spacing": [
            {
                "level": int(level),
                "mean": _rounded(predicted[levels == level].mean()),
                "min": _rounded(predicted[levels == level].min()),
                "max": _rounded(predicted[levels == level].max()),
            }
            for level in np.unique(levels)
        ],
    }


def _motion(plan: Plan, robot: RobotPlan) -> dict[str, Json]:
    placement = robot.placement
    return {
        "duration_s": _rounded(robot.trajectory.duration),
        "branch": robot.joint_path.branch,
        **attitude_summary(robot.joint_path, tool=plan.workpiece.cell.tool),
        "smallest_wrist_angle_deg": _rounded(np.degrees(robot.joint_path.smallest_wrist_angle)),
        "slowest_deposit_mm_s": _rounded(robot.trajectory.slowest_deposit),
        "stretched_pieces": robot.trajectory.stretched,
        "share_at_speed": _rounded(robot.trajectory.share_at_speed),
        "share_on_ramps": _rounded(robot.trajectory.share_on_ramps),
        "slowdowns": [_slowdown(slowdown) for slowdown in robot.trajectory.slowdowns],
        "placement_calibrated": placement.calibrated,
        "largest_touch_miss_mm": _rounded(placement.misses.max()) if placement.calibrated else None,
        "T_base_work": [[_rounded(value) for value in row] for row in placement.T_base_work],
    }


def _calibration(uncertainty: Uncertainty | None) -> dict[str, Json]:
    """Return how far the surface may lie off along its normal, where that is most; nothing where nobody calibrated."""
    if uncertainty is None:
        return {}
    return {
        "surface_uncertainty_mm": _rounded(uncertainty.deviation),
        "surface_within_mm": _rounded(uncertainty.bound),
        "surface_uncertain_at_mm": [_rounded(value) for value in uncertainty.place],
    }


def _slowdown(slowdown: Slowdown) -> dict[str, Json]:
    return {
        "run": slowdown.run,
        "kind": slowdown.kind,
        "place_mm": [_rounded(value) for value in slowdown.place],
        "arc_mm": _rounded(slowdown.arc),
        "length_mm": _rounded(slowdown.length),
        "set_mm_s": slowdown.set_speed,
        "held_mm_s": _rounded(slowdown.held_speed),
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
        f"{line}; run {worst.run} {what} to {worst.held_speed:.1f} mm/s by the {worst.limit} of joint {worst.joint} at "
        f"({x:.1f}, {y:.1f}, {z:.1f})" + (f", {others} other runs by less" if others else "")
    )


def _clearance(robot: RobotPlan) -> dict[str, Json]:
    found = robot.clearance
    return {
        "smallest_mm": _rounded(found.smallest),
        "at": found.at,
        "arm_smallest_mm": None if found.arm_smallest is None else _rounded(found.arm_smallest),
        "arm_at": found.arm_at,
        "kept_mm": found.kept,
        "tip_margin_mm": _rounded(found.tip_margin),
        "checks": found.checks,
        "checked": list(found.checked),
        "not_checked": list(found.not_checked),
        "dry_run": {
            "lift_mm": LIFT,
            "smallest_mm": _rounded(robot.dry_clearance.smallest),
            "at": robot.dry_clearance.at,
        },
    }


def _warnings(plan: Plan) -> tuple[str, ...]:
    workpiece, preparation = plan.workpiece, plan.workpiece.preparation
    hint = unit_hint(workpiece.part, unit=workpiece.unit)
    warnings: list[str] = [hint] if hint else []
    warnings.append(workpiece.side.sentence)
    if preparation.changes():
        warnings.append(f"the mesh was repaired: {'; '.join(preparation.changes())}.")
    if not preparation.crossings_checked:
        warnings.append("not checked: whether the surface passes through itself, because its triangles are so thin.")
    if plan.robot is not None and not plan.robot.placement.calibrated:
        warnings.append("PLACEMENT NOT CALIBRATED: the program runs only dry.")
    warnings += targets_warnings(plan)
    uncertainty, standoff = plan.workpiece.uncertainty, plan.workpiece.cell.process.standoff
    if uncertainty is not None and uncertainty.bound > NOTABLE_SHARE * standoff:
        warnings.append(
            f"by the touched points the surface may lie {uncertainty.bound:.2f} mm off along its normal (95 % bound), "
            f"{uncertainty.bound / standoff:.0%} of the stand-off: `geoprint calibrate --part` says which point to "
            "touch next."
        )
    if plan.toolpath.dropped_runs:
        warnings.append(
            f"{plan.toolpath.dropped_runs} closed runs shorter than one spacing were left out "
            f"({plan.toolpath.dropped_length:.2f} mm)."
        )
    if plan.job.backend != CLOSEST_BACKEND and plan.uniformity is not None and plan.uniformity.cv > NOTABLE_CV:
        warnings.append(
            f"spacing varies by {plan.uniformity.cv:.1%}; `--backend {CLOSEST_BACKEND}` is nearer to the true distance."
        )
    if len(plan.toolpath.splits):
        warnings.append(
            f"runs are split at {len(plan.toolpath.splits)} corners that are too sharp to be rounded at speed: the "
            "bead ends and begins there."
        )
    lean = float(np.degrees(largest_lean(plan.poses)))
    if lean >= NOTABLE_LEAN:
        warnings.append(f"the nozzle leans up to {lean:.0f} degrees from the surface normal where the part bends fast.")
    return tuple(warnings)


def _rounded(value: float | np.floating) -> float:
    return round(float(value), DECIMALS)
