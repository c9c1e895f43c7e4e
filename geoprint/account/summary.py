"""What plan.json says of a plan, and the few lines that a person reads after it."""

from __future__ import annotations

import resource
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import cast

import numpy as np

from geoprint.account.patch_figures import patches_summary, patches_text
from geoprint.account.robot_summary import placement_warnings, robot_summary, robot_text, targets_warnings
from geoprint.account.rounding import all_rounded, rounded
from geoprint.backends import accuracy, backend, diagnostics, distortion, most_accurate_backend, predicted_spacing
from geoprint.export import Json
from geoprint.model import PASCAL_PER_KPA, Surface
from geoprint.motion.placing import NOTABLE_SHARE
from geoprint.paths import largest_lean, mean_lean
from geoprint.quality import Thickness, Uniformity
from geoprint.results import Laid, Patch, Plan, Workpiece
from geoprint.surfaces import describe, edge_lengths, face_areas
from geoprint.surfaces.files import unit_hint

# A nozzle that leans more than this from the surface normal [degrees] lays a visibly lopsided bead.
NOTABLE_LEAN = 15.0
# Paths whose spacing varies by more than this could be more even with a more accurate backend.
NOTABLE_CV = 0.01
# Places listed where the spacing is farthest from wanted.
WORST_PLACES = 5


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
    if plan.workpiece.patches:
        result["patches"] = patches_summary(plan)
    if plan.flattenings:
        result["chart"] = _chart(plan)
    if plan.uniformity is not None:
        result["uniformity"] = uniformity_summary(plan.uniformity)
    if plan.laid is not None:
        result["deposition"] = laid_summary(plan.laid)
    if plan.robot is not None:
        result |= robot_summary(plan, plan.robot)
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
    lines += patches_text(plan)
    if plan.laid is not None:
        lines.append(laid_text(plan.laid))
    if plan.robot is not None:
        lines += robot_text(plan, plan.robot)
    lines += [f"note: {warning}" for warning in _warnings(plan)]
    return "\n".join(lines)


def uniformity_summary(measured: Uniformity) -> dict[str, Json]:
    """Return the figures of `uniformity` as plan.json and compare.json carry them; ratios to the spacing."""
    return {
        "method": measured.method,
        "spacing": {
            "mean": rounded(measured.mean),
            "cv": rounded(measured.cv),
            **{f"p{share}": rounded(measured.percentile(share)) for share in (1, 5, 50, 95, 99)},
            "max": rounded(measured.percentile(100)),
            "within_5_percent": rounded(measured.within_5_percent),
        },
        "straight": {
            "mean": rounded(measured.straight.mean()),
            "cv": rounded(measured.straight.std() / measured.straight.mean()),
        },
        "samples": len(measured.ratios),
        "samples_bounded": rounded(measured.bounded),
        "largest_doubt": rounded(measured.largest_doubt),
        "samples_unreached": measured.unreached,
        "samples_where_fronts_meet": rounded(measured.meeting),
        "gap": rounded(measured.uncovered),
        "overlap": rounded(measured.overlap),
        "area_unknown": rounded(measured.unknown),
        "fill": rounded(measured.fill),
        "width_cv": rounded(measured.width_cv),
        "levels": [
            {"level": level, "mean": rounded(mean), "cv": rounded(cv), "worst": rounded(worst)}
            for level, mean, cv, worst in measured.by_level()
        ],
        "worst_places": [
            {"place_mm": all_rounded(place), "level": level, "ratio": rounded(ratio)}
            for place, level, ratio in measured.worst(WORST_PLACES)
        ],
    }


def settings_summary(plan: Plan) -> dict[str, Json]:
    """Return what was asked for and with which cell: lengths mm, speeds mm/s."""
    process = plan.workpiece.cell.process
    settings = cast("dict[str, Json]", plan.job.settings())
    return {
        **settings,
        "spacing_mm": plan.contours.spacing,
        "cell": plan.workpiece.cell.name,
        "speed_mm_s": process.speed,
        "travel_speed_mm_s": process.travel_speed,
        "standoff_mm": process.standoff,
        "clearance_mm": process.clearance,
        "retract_mm": process.retract,
        "layer_height_mm": process.layer_height,
        "pressure_kpa": None if process.pressure is None else process.pressure / PASCAL_PER_KPA,
        "flood_s": None if plan.workpiece.cell.flood is None else plan.workpiece.cell.flood.duration,
    }


def _input(plan: Plan) -> dict[str, Json]:
    def of(path: Path, index: int) -> dict[str, Json]:
        return {"name": path.name, "sha256": plan.workpiece.digests[index], "unit": plan.workpiece.units[index]}

    result = of(plan.job.surface, 0)
    if plan.workpiece.notes:
        result["made"] = dict(plan.workpiece.notes)
    if plan.job.body is not None:
        result["body"] = of(plan.job.body, 1)
    return result


def _surface(plan: Plan) -> dict[str, Json]:
    def of(surface: Surface) -> dict[str, Json]:
        return {
            "vertices": len(surface.vertices),
            "faces": len(surface.faces),
            "mean_edge_mm": rounded(edge_lengths(surface).mean()),
        }

    return {
        "topology": describe(plan.workpiece.part),
        "area_mm2": rounded(face_areas(plan.workpiece.part).sum()),
        "size_mm": all_rounded(np.ptp(plan.workpiece.part.vertices, axis=0)),
        "prepared": of(plan.workpiece.part),
        "refined": of(plan.workpiece.surface),
        # Of several patches each says what changed.
        "preparation": asdict(preparations[0]) if len(preparations := plan.workpiece.preparations) == 1 else None,
        "side": asdict(plan.workpiece.side),
    }


def _paths(plan: Plan) -> dict[str, Json]:
    poses = plan.poses
    lengths = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)
    return {
        "runs": plan.toolpath.curves.count,
        "levels": int(plan.toolpath.levels.max()) + 1,
        "poses": poses.count,
        "deposit_mm": rounded(lengths[poses.laid].sum()),
        "travel_mm": rounded(lengths[~poses.laid].sum()),
        "stops_while_laying": poses.stops_while_laying,
        "corners_rounded": len(plan.toolpath.fillets),
        "corners_rounded_mm": [all_rounded(place) for place in plan.toolpath.fillets],
        "corners_split": len(plan.toolpath.splits),
        "corners_split_mm": [all_rounded(place) for place in plan.toolpath.splits],
        "dropped_runs": plan.toolpath.dropped_runs,
        "dropped_mm": rounded(plan.toolpath.dropped_length),
        "largest_distance_mm": rounded(plan.contours.distance.maximum),
        "largest_lean_deg": rounded(np.degrees(largest_lean(poses))),
        "mean_lean_deg": rounded(np.degrees(mean_lean(poses))),
    }


def _field(plan: Plan) -> dict[str, Json]:
    workpiece = plan.workpiece
    found = diagnostics(workpiece.surface, plan.contours.distance)
    refinement: dict[str, Json] = {
        "edge_length_mm": rounded(workpiece.edge_length),
        "faces_before": len(workpiece.part.faces),
        "faces_after": len(workpiece.surface.faces),
    }
    return {"refinement": refinement, **{name: rounded(value) for name, value in asdict(found).items()}}


def _chart(plan: Plan) -> dict[str, Json]:
    """Return what the chart does to lengths and areas; of several patches over all, with the coarsest raster."""
    surface, contours, flat = plan.workpiece.surface, plan.contours, plan.flat_surface
    coarsest = max(plan.flattenings, key=lambda flattening: flattening.largest_pixel)
    found = distortion(surface, flat)
    predicted = predicted_spacing(surface, flat, contours.curves.points)
    levels = np.repeat(contours.levels, np.diff(contours.curves.offsets))
    return {
        "resolution": coarsest.resolution,
        "pixel_mm": rounded(coarsest.pixel),
        "largest_pixel_on_surface_mm": rounded(coarsest.largest_pixel),
        "area_scale": {f"p{share}": rounded(found.scale_percentile(share)) for share in (1, 50, 99)},
        "mean_dilatation": rounded(found.mean_dilatation),
        "predicted_spacing": [
            {
                "level": int(level),
                "mean": rounded(predicted[levels == level].mean()),
                "min": rounded(predicted[levels == level].min()),
                "max": rounded(predicted[levels == level].max()),
            }
            for level in np.unique(levels)
        ],
    }


def _inside(patches: Sequence[Patch]) -> list[str]:
    """Return which side of a drawn curve was taken, patch by patch."""
    return [
        f"{f'patch {number}' if len(patches) > 1 else 'the patch'} lies inside {patch.inside}."
        for number, patch in enumerate(patches, start=1)
        if patch.inside is not None
    ]


def _repairs(workpiece: Workpiece) -> list[str]:
    """Say what preparing changed and what it could not check, patch by patch."""
    said: list[str] = []
    for number, preparation in enumerate(workpiece.preparations, start=1):
        which = f"patch {number}: " if len(workpiece.preparations) > 1 else ""
        if preparation.changes():
            said.append(f"{which}the mesh was repaired: {'; '.join(preparation.changes())}.")
        if not preparation.crossings_checked:
            said.append(
                f"{which}not checked: whether the surface passes through itself, because its triangles are so thin."
            )
    return said


def _warnings(plan: Plan) -> tuple[str, ...]:
    workpiece = plan.workpiece
    hint = unit_hint(workpiece.part, unit=workpiece.units[0])
    warnings: list[str] = [hint] if hint else []
    warnings += [workpiece.side.sentence, *_inside(workpiece.patches), *_repairs(workpiece)]
    if plan.robot is not None:
        warnings += placement_warnings(plan.robot.placement)
    warnings += targets_warnings(plan)
    uncertainty, standoff = plan.workpiece.uncertainty, plan.workpiece.cell.process.standoff
    if uncertainty is not None and uncertainty.bound > NOTABLE_SHARE * standoff:
        warnings.append(
            f"by the touched points the surface may lie {uncertainty.bound:.2f} mm off along its normal (95 % bound), "
            f"{uncertainty.bound / standoff:.0%} of the stand-off: `geoprint calibrate --part` says which point to "
            "touch next."
        )
    if plan.laid is not None and plan.laid.light is not None and plan.laid.light.lacking is not None:
        warnings.append(plan.laid.light.lacking)
    if plan.toolpath.dropped_runs:
        warnings.append(
            f"closed runs shorter than one spacing were left out: {plan.toolpath.dropped_runs}, "
            f"{plan.toolpath.dropped_length:.2f} mm long in all."
        )
    nearest = most_accurate_backend()
    if (
        plan.uniformity is not None
        and plan.uniformity.cv > NOTABLE_CV
        and accuracy(nearest) > accuracy(backend(plan.job.backend))
    ):
        warnings.append(
            f"spacing varies by {plan.uniformity.cv:.1%}; `--backend {nearest.name}` is nearer to the true distance."
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


def laid_summary(laid: Laid) -> dict[str, Json]:
    """Return what plan.json and compare.json say of the layer: thickness mm, its variation (CV) as shares of 1."""
    flow = laid.following_flow[laid.following_flow > 0.0]
    return {
        "flow": "follows the width" if laid.mode == "analog" else "constant",
        "share_away_from_medial_axis": rounded(laid.constant.away_share),
        "constant_flow": _thickness(laid.constant),
        "following_flow": _thickness(laid.following)
        | {"least_mm3_per_mm": rounded(flow.min()), "most_mm3_per_mm": rounded(flow.max())},
        "light": None if laid.light is None else asdict(laid.light),
    }


def laid_text(laid: Laid) -> str:
    """Return the line that a person reads."""
    away = laid.constant.cv is not None
    constant, following = (
        f"{(found.cv if away else found.near_cv) or 0.0:.2%}" for found in (laid.constant, laid.following)
    )
    which = "follows" if laid.mode == "analog" else "is constant"
    where = "" if away else "; fronts meet all over this part"
    return (
        f"layer: thickness varies by {constant} with constant flow, {following} with flow that follows the width; here "
        f"it {which}{where}"
    )


def _thickness(found: Thickness) -> dict[str, Json]:
    return {
        "mean_mm": rounded(found.mean),
        "cv": None if found.cv is None else rounded(found.cv),
        "cv_near_medial_axis": None if found.near_cv is None else rounded(found.near_cv),
    }
