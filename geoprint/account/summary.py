"""From a plan to what plan.json says of it; the robot's part stands beside, and so does what a person reads."""

from __future__ import annotations

import resource
from dataclasses import asdict
from importlib.metadata import version

import numpy as np

from geoprint.account.cautions import details_of, notes_of, warnings_of
from geoprint.account.evenness import record_evenness
from geoprint.account.patches import record_cut
from geoprint.account.prints.attitudes import record_joined
from geoprint.account.prints.expected import record_printed, says_errors
from geoprint.account.prints.feedback import record_feedback
from geoprint.account.prints.overhang import record_overhang
from geoprint.account.records.plan import (
    AreaScaleRecord,
    ChartLevelRecord,
    ChartRecord,
    DepositionRecord,
    FibresRecord,
    FieldRecord,
    FileRecord,
    InputRecord,
    LayerRecord,
    LightRecord,
    MeshRecord,
    PatchRecord,
    PatchSpacingRecord,
    PathsRecord,
    PlanRecord,
    PreparationRecord,
    RefinementRecord,
    SettingsRecord,
    SideRecord,
    SurfaceRecord,
    TimingsRecord,
)
from geoprint.account.records.printed import PrintedRecord, StandoffRecord
from geoprint.account.records.rounding import as_json, place_of
from geoprint.account.records.tried import MiddleRecord, SourceRecord
from geoprint.account.robot_summary import record_robot
from geoprint.backends import diagnostics, distortion, predicted_spacing
from geoprint.deposition import bore_of, pressure_for
from geoprint.export import Json
from geoprint.model import PASCAL_PER_KPA, PrintErrors, Surface
from geoprint.paths import largest_lean, mean_lean
from geoprint.quality import fibre_angles, standoff_within, thickness_within
from geoprint.results import Laid, Layer, Plan, TriedMiddle, TriedSource
from geoprint.surfaces import component_labels, describe, edge_lengths, face_areas, middle_of, pieces
from geoprint.surfaces.repair import PreparationReport

# Version of the layout of plan.json; a change that breaks a reader raises it.
PLAN_SCHEMA = 9
# Runs shorter than this many spacings are little more than the marks of their start and their stop.
FRAGMENT_SPACINGS = 5.0


def record_plan(plan: Plan) -> PlanRecord:
    """Return the content of plan.json."""
    told = PlanRecord(
        schema=PLAN_SCHEMA,
        version=version("geoprint"),
        input=_input(plan),
        settings=_settings(plan),
        surface=_surface(plan),
        paths=_paths(plan),
        layers=tuple(_layer(layer, plan) for layer in plan.layers),
        field=_field(plan),
        patches=_patches(plan),
        chart=_chart(plan) if plan.flattenings else None,
        uniformity=(
            None
            if plan.uniformity is None
            else record_evenness(plan.uniformity, distance=plan.distance, printed=_printed(plan))
        ),
        sources=tuple(_source(tried) for tried in plan.workpiece.tried),
        middles=tuple(_middle(tried) for tried in plan.middles),
        deposition=None if plan.laid is None else _deposition(plan.laid, plan),
        overhang=record_overhang(plan),
        feedback=record_feedback(plan),
        robot=tuple(record_robot(plan, robot) for robot in plan.robot),
        joined=record_joined(plan),
        not_printable=plan.not_printable,
        warnings=(),
    )
    said = {"warnings": warnings_of(plan, told), "notes": notes_of(plan, told), "details": details_of(plan, told)}
    return told.model_copy(update=said)


def record_timings(plan: Plan) -> TimingsRecord:
    """Return the content of timings.json."""
    return TimingsRecord(timings_s=dict(plan.timings), peak_memory_mb=peak_memory())


def peak_memory() -> int:
    """Return the most memory that this process has taken so far [MB]."""
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def summary(plan: Plan) -> dict[str, Json]:
    """Return the content of plan.json as the mapping that is written."""
    return as_json(record_plan(plan))


def _input(plan: Plan) -> InputRecord:
    read, target = plan.workpiece.files, plan.workpiece.target
    files = [FileRecord(name=file.name, sha256=file.digest, unit=file.unit) for file in read]
    return InputRecord(
        **dict(files[0]),
        made=dict(read[0].notes) if read[0].notes else None,
        body=files[1] if len(files) > 1 else None,
        target=None if target is None else FileRecord(name=target.name, sha256=target.digest, unit=target.unit),
    )


def _settings(plan: Plan) -> SettingsRecord:
    cell, process = plan.workpiece.cell, plan.workpiece.cell.process
    return SettingsRecord.model_validate(
        plan.job.settings()
        | {
            "spacing_mm": plan.contours.spacing,
            "cell": cell.name,
            "speed_mm_s": process.speed,
            "travel_speed_mm_s": process.travel_speed,
            "standoff_mm": process.standoff,
            "clearance_mm": process.clearance,
            "retract_mm": process.retract,
            "layer_height_mm": process.layer_height,
            "needle_mm": cell.tool.inner_diameter,
            "flow_shares": (process.least_flow, process.most_flow),
            "pressure_kpa": None if process.pressure is None else process.pressure / PASCAL_PER_KPA,
            "flood_s": None if cell.flood is None else cell.flood.duration,
        }
    )


def _surface(plan: Plan) -> SurfaceRecord:
    part, preparations = plan.workpiece.part, plan.workpiece.preparations
    return SurfaceRecord(
        topology=describe(part),
        area_mm2=float(face_areas(part).sum()),
        size_mm=place_of(np.ptp(part.vertices, axis=0)),
        prepared=_mesh(part),
        refined=_mesh(plan.workpiece.surface),
        preparation=record_preparation(preparations[0]) if len(preparations) == 1 else None,
        side=SideRecord(**asdict(plan.workpiece.side)),
    )


def _source(tried: TriedSource) -> SourceRecord:
    return SourceRecord.model_validate(asdict(tried))


def _middle(tried: TriedMiddle) -> MiddleRecord:
    return MiddleRecord.model_validate(asdict(tried))


def _mesh(surface: Surface) -> MeshRecord:
    mean_edge = float(edge_lengths(surface).mean())
    return MeshRecord(vertices=len(surface.vertices), faces=len(surface.faces), mean_edge_mm=mean_edge)


def _paths(plan: Plan) -> PathsRecord:
    poses, toolpath = plan.poses, plan.toolpath
    lengths = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)
    of_runs = np.bincount(poses.runs[:-1][poses.laid], weights=lengths[poses.laid], minlength=toolpath.curves.count)
    return PathsRecord(
        runs=toolpath.curves.count,
        levels=int(np.floor(toolpath.rows).max()) + 1,
        poses=poses.count,
        deposit_mm=float(lengths[poses.laid].sum()),
        travel_mm=float(lengths[~poses.laid].sum()),
        stops_while_laying=poses.stops_while_laying,
        corners_rounded=len(toolpath.fillets),
        corners_rounded_mm=tuple(place_of(place) for place in toolpath.fillets),
        corners_split=len(toolpath.splits),
        corners_split_mm=tuple(place_of(place) for place in toolpath.splits),
        fragments=int((of_runs < FRAGMENT_SPACINGS * plan.contours.spacing).sum()),
        dropped_runs=toolpath.dropped_runs,
        dropped_mm=toolpath.dropped_length,
        dropped_mm2=toolpath.dropped_area,
        widths_mm=None
        if plan.workpiece.widths is None
        else (float(toolpath.spacings.min()), float(toolpath.spacings.max())),
        fibres=_fibres(plan),
        largest_distance_mm=plan.contours.distance.maximum,
        largest_lean_deg=float(np.degrees(largest_lean(poses))),
        mean_lean_deg=float(np.degrees(mean_lean(poses))),
    )


def _fibres(plan: Plan) -> FibresRecord | None:
    """Return the angles of the paths to the lines that they follow; None where they follow none."""
    if plan.followed is None:
        return None
    found = fibre_angles(plan.workpiece.surface, plan.toolpath.curves, plan.followed)
    low, high = np.degrees(found.spread or (0.0, 0.0)).tolist()
    return FibresRecord(
        off_mean_deg=float(np.degrees(found.off)),
        off_p95_deg=float(np.degrees(found.most_off)),
        helix_mean_deg=None if found.helix is None else float(np.degrees(found.helix)),
        helix_deg=None if found.spread is None else (low, high),
    )


def _layer(layer: Layer, plan: Plan) -> LayerRecord:
    place = plan.workpiece.place
    return LayerRecord(
        number=layer.number,
        count=1 if place is None else place.count,
        bottom_mm=0.0 if place is None else place.bottom,
        height_mm=layer.height,
        pattern=str(plan.job.drawing) if plan.job.patterns else None,
        standoff_mm=plan.workpiece.cell.process.standoff,
        runs=(0, plan.toolpath.curves.count - 1),
    )


def _field(plan: Plan) -> FieldRecord:
    workpiece = plan.workpiece
    refinement = RefinementRecord(
        edge_length_mm=workpiece.edge_length,
        faces_before=len(workpiece.part.faces),
        faces_after=len(workpiece.surface.faces),
    )
    return FieldRecord(refinement=refinement, **asdict(diagnostics(workpiece.surface, plan.contours.distance)))


def _chart(plan: Plan) -> ChartRecord:
    surface, contours, flat = plan.workpiece.surface, plan.contours, plan.flat_surface
    coarsest = max(plan.flattenings, key=lambda flattening: flattening.largest_pixel)
    found = distortion(surface, flat)
    predicted = predicted_spacing(surface, flat, contours.curves.points)
    levels = contours.point_levels
    p1, p50, p99 = (found.scale_percentile(share) for share in (1, 50, 99))
    each = ((int(level), predicted[levels == level]) for level in np.unique(levels))
    return ChartRecord(
        resolution=coarsest.resolution,
        pixel_mm=coarsest.pixel,
        largest_pixel_on_surface_mm=coarsest.largest_pixel,
        area_scale=AreaScaleRecord(p1=p1, p50=p50, p99=p99),
        mean_dilatation=found.mean_dilatation,
        predicted_spacing=tuple(
            ChartLevelRecord(level=level, mean=float(of.mean()), min=float(of.min()), max=float(of.max()))
            for level, of in each
        ),
    )


def _printed(plan: Plan) -> PrintedRecord | None:
    within = standoff_within(plan.workpiece.cell.errors or PrintErrors())
    standoff = StandoffRecord(wanted_mm=plan.workpiece.cell.process.standoff, within_mm=within)
    return record_printed(plan.printed, of_cell=says_errors(plan), standoff=standoff)


def _deposition(laid: Laid, plan: Plan) -> DepositionRecord:
    cell = plan.workpiece.cell
    errors, flow = cell.errors or PrintErrors(), laid.following_flow[laid.following_flow > 0.0]
    rate = plan.poses.flow.max(keepdims=True) * cell.process.speed
    return DepositionRecord(
        flow="follows the width" if laid.mode == "analog" else "constant",
        valve_mm3_s=float(rate[0]),
        valve_kpa=None
        if cell.material is None
        else float(pressure_for(cell.material.fluid, bore_of(cell.tool), flows=rate).total[0]) / PASCAL_PER_KPA,
        least_mm3_per_mm=float(flow.min()),
        most_mm3_per_mm=float(flow.max()),
        printed_mean_within=thickness_within(errors),
        light=None if plan.light is None else LightRecord(**asdict(plan.light)),
    )


def _patches(plan: Plan) -> tuple[PatchRecord, ...]:
    """Return what became of each patch of a plan, in the order of the job."""
    if not plan.workpiece.patches:
        return ()
    curves, poses, measured = plan.toolpath.curves, plan.poses, plan.uniformity
    piece_of_run = component_labels(plan.workpiece.surface)[curves.points.faces[curves.offsets[:-1]]]
    lengths = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1) * poses.laid
    found: list[PatchRecord] = []
    for number, (patch, piece) in enumerate(zip(plan.workpiece.patches, pieces(plan.workpiece.part), strict=True)):
        runs = np.flatnonzero(piece_of_run == number)
        sides = np.empty((0, 2)) if measured is None else measured.sides.sides()[np.isin(measured.runs, runs)]
        ratios = sides[np.isfinite(sides)]
        found.append(
            PatchRecord(
                **dict(record_cut(patch)),
                place_mm=place_of(middle_of(piece.surface)),
                runs=(int(runs[0]), int(runs[-1])),
                deposit_mm=float(lengths[np.isin(poses.runs[:-1], runs)].sum()),
                spacing=PatchSpacingRecord(
                    mean=float(ratios.mean()) if ratios.size else None,
                    cv=float(ratios.std() / ratios.mean()) if ratios.size else None,
                ),
            )
        )
    return tuple(found)


def record_preparation(found: PreparationReport) -> PreparationRecord:
    """Return what preparing changed and found: its repairs, then what is left."""
    told = asdict(found)
    return PreparationRecord(**told.pop("repairs"), **told)
