"""What plan.json and a person's terminal say of a plan."""

from __future__ import annotations

import resource
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version

import numpy as np

from geoprint.distance import diagnostics, distortion, predicted_spacing
from geoprint.errors import how_many, percent
from geoprint.geometry import PreparationReport, component_labels, describe, edge_lengths, face_areas, middle_of, pieces
from geoprint.metrics import fibre_angles, standoff_within, thickness_within
from geoprint.model import PASCAL_PER_KPA, PrintErrors, Surface
from geoprint.postprocessor import Json
from geoprint.process import bore_of, pressure_for
from geoprint.reporting.cautions import details_of, fibres_text, notes_of, patch_evenness, warnings_of
from geoprint.reporting.evenness import (
    WORDS,
    expected_text,
    overhang_lines,
    record_evenness,
    record_overhang,
    record_printed,
    says_errors,
)
from geoprint.reporting.features import feature_lines, record_features
from geoprint.reporting.metrics import COVERED_ONCE, FOLLOWING, GAP, OFF, OFF_MOST, OVERLAP, THICKNESS
from geoprint.reporting.prints import record_feedback, record_joined
from geoprint.reporting.records.evenness import EvennessRecord, PrintedRecord, StandoffRecord
from geoprint.reporting.records.plan import (
    AreaScaleRecord,
    ChartLevelRecord,
    ChartRecord,
    CutRecord,
    DepositionRecord,
    FibresRecord,
    FieldRecord,
    FileRecord,
    InputRecord,
    JoinedRecord,
    LayerRecord,
    MeshRecord,
    MotionRecord,
    PatchRecord,
    PatchSpacingRecord,
    PathsRecord,
    PlanRecord,
    PreparationRecord,
    RefinementRecord,
    RobotRecord,
    SettingsRecord,
    SurfaceRecord,
    TimingsRecord,
)
from geoprint.reporting.records.rounding import as_json, place_of, stamp
from geoprint.reporting.robot_summary import record_robot
from geoprint.reporting.tables import marked_lines
from geoprint.results import DepositedLayer, Layer, Patch, Plan
from geoprint.toolpath import largest_lean, mean_lean

# What is said of a patch that was cut from a body: the lines that a person reads, and the object for programs.


def record_cut(patch: Patch) -> CutRecord:
    """Return how a patch was cut from its body."""
    found = patch.preparation
    return CutRecord.of(
        found,
        body=patch.body.name,
        rims_mm=found.boundary_lengths,
        outside=patch.outside,
        inside=patch.inside,
        point_off_body_mm=patch.missed,
        changes=found.repairs.changes(),
    )


def patch_summary(patch: Patch) -> dict[str, Json]:
    """Return what `geoprint patch --json` prints; lengths are mm."""
    return as_json(record_cut(patch))


def patch_text(patch: Patch) -> str:
    """Return the lines that a person reads."""
    record = record_cut(patch)
    lengths = ", ".join(f"{length:.4g}" for length in record.rims_mm)
    rims = f"rim{'s' if len(record.rims_mm) > 1 else ''} {lengths} mm"
    lines = [
        (
            f"patch of {record.body}: {record.topology}, {record.area_mm2:.4g} mm2, {rims}, "
            f"{how_many(record.faces, 'face')}"
        ),
        f"outside: {record.outside}",
    ]
    if record.inside is not None:
        lines.append(f"inside: {record.inside}")
    if record.changes:
        lines.append(f"changed while preparing: {'; '.join(record.changes)}")
    return "\n".join(lines)


# From a plan to what plan.json says of it; the robot's part stands beside, and so does what a person reads.


# Runs shorter than this many spacings are little more than the marks of their start and their stop.
FRAGMENT_SPACINGS = 5.0


def record_plan(plan: Plan) -> PlanRecord:
    """Return the content of plan.json."""
    record = PlanRecord(
        **stamp(PlanRecord),
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
        sources=plan.workpiece.tried,
        middles=plan.middles,
        deposition=None if plan.deposited is None else _deposition(plan.deposited, plan),
        overhang=record_overhang(plan),
        feedback=record_feedback(plan),
        features=record_features(plan),
        robot=tuple(record_robot(plan, robot) for robot in plan.robot),
        joined=record_joined(plan),
        not_printable=plan.not_printable,
        warnings=(),
    )
    said = {"warnings": warnings_of(plan, record), "notes": notes_of(plan, record), "details": details_of(plan, record)}
    return record.model_copy(update=said)


def record_timings(plan: Plan) -> TimingsRecord:
    """Return the content of timings.json: what each stage took in all."""
    names = dict.fromkeys(name for name, _ in plan.timings)
    took = {name: sum(seconds for each, seconds in plan.timings if each == name) for name in names}
    return TimingsRecord(timings_s=took, peak_memory_mb=peak_memory())


def peak_memory() -> int:
    """Return the most memory that this process has taken so far [MB]."""
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def summary(plan: Plan) -> dict[str, Json]:
    """Return the content of plan.json as the mapping that is written."""
    return as_json(record_plan(plan))


def _input(plan: Plan) -> InputRecord:
    read, place = plan.workpiece.files, plan.workpiece.place
    target = None if place is None else place.target
    files = [FileRecord.of(file, sha256=file.digest) for file in read]
    return InputRecord(
        **dict(files[0]),
        made=dict(read[0].notes) if read[0].notes else None,
        body=files[1] if len(files) > 1 else None,
        target=None if target is None else FileRecord.of(target, sha256=target.digest),
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
        side=plan.workpiece.side,
    )


def _mesh(surface: Surface) -> MeshRecord:
    mean_edge = float(edge_lengths(surface).mean())
    return MeshRecord(vertices=len(surface.vertices), faces=len(surface.faces), mean_edge_mm=mean_edge)


def _paths(plan: Plan) -> PathsRecord:
    poses, toolpath = plan.poses, plan.toolpath
    lengths = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)
    of_runs = np.bincount(
        poses.runs[:-1][poses.deposited], weights=lengths[poses.deposited], minlength=toolpath.curves.count
    )
    return PathsRecord(
        runs=toolpath.curves.count,
        levels=int(np.floor(toolpath.rows).max()) + 1,
        poses=poses.count,
        deposit_mm=float(lengths[poses.deposited].sum()),
        travel_mm=float(lengths[~poses.deposited].sum()),
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
        pattern=str(plan.job.drawing) if len(plan.job.drawings) > 1 else None,
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


def _deposition(deposited: DepositedLayer, plan: Plan) -> DepositionRecord:
    cell = plan.workpiece.cell
    errors, flow = cell.errors or PrintErrors(), deposited.following_flow[deposited.following_flow > 0.0]
    rate = plan.poses.flow.max(keepdims=True) * cell.process.speed
    return DepositionRecord(
        flow="follows the width" if deposited.mode == "analog" else "constant",
        valve_mm3_s=float(rate[0]),
        valve_kpa=None
        if cell.material is None
        else float(pressure_for(cell.material.fluid, bore_of(cell.tool), flows=rate).total[0]) / PASCAL_PER_KPA,
        least_mm3_per_mm=float(flow.min()),
        most_mm3_per_mm=float(flow.max()),
        printed_mean_within=thickness_within(errors),
        light=plan.light,
    )


def _patches(plan: Plan) -> tuple[PatchRecord, ...]:
    """Return what became of each patch of a plan, in the order of the job."""
    if not plan.workpiece.patches:
        return ()
    curves, poses, measured = plan.toolpath.curves, plan.poses, plan.uniformity
    piece_of_run = component_labels(plan.workpiece.surface)[curves.points.faces[curves.offsets[:-1]]]
    lengths = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1) * poses.deposited
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
    record = asdict(found)
    return PreparationRecord(**record.pop("repairs"), **record)


# What a person reads of a plan: the few lines when it is done.


def outcome_text(record: PlanRecord, *, verbose: bool = False) -> str:
    """Return the lines that a person reads when a plan is done.

    Args:
        record: what plan.json says.
        verbose: whether to list details, and all that was not checked.
    """
    lines = _path_lines(record)
    lines += [
        f"layer {layer.number + 1} of {layer.count}: from {layer.bottom_mm:.3g} to "
        f"{layer.bottom_mm + layer.height_mm:.3g} mm above the part, paths at mid-height"
        + (f", {layer.pattern}" if layer.pattern else "")
        for layer in record.layers
        if layer.count > 1
    ]
    if record.uniformity is not None:
        lines.append(_evenness_text(record.uniformity, record.deposition))
        if record.uniformity.distance is not None:
            off, most = OFF.text(record.uniformity), OFF_MOST.text(record.uniformity)
            lines.append(f"distance: level curves deviate by {off} of a spacing (standard deviation), {most} at most")
        lines += [] if record.uniformity.printed is None else [_printed_text(record.uniformity.printed)]
    if len(record.patches) > 1:
        lines += [
            f"patch {number}: {patch.area_mm2:.4g} mm2, runs {patch.runs[0] + 1} to {patch.runs[1] + 1}, spacing "
            f"varies by {patch_evenness(patch)} (CV)"
            for number, patch in enumerate(record.patches, start=1)
        ]
    if record.overhang is not None:
        lines += overhang_lines(record.overhang, verbose=verbose)
    for robot in record.robot:
        lines += _robot_text(robot, speed=record.settings.speed_mm_s)
    if record.joined is not None:
        lines.append(_joined_text(record.joined, count=len(record.robot)))
    if record.not_printable is not None:
        lines.append(f"no program, the robot cannot print this: {record.not_printable}")
    unchecked = list(dict.fromkeys(text for robot in record.robot for text in robot.clearance.not_checked))
    lines += marked_lines(
        warnings=record.warnings, notes=record.notes, details=record.details, not_checked=unchecked, verbose=verbose
    )
    return "\n".join(lines)


def _path_lines(record: PlanRecord) -> list[str]:
    paths, settings = record.paths, record.settings
    lines = [
        (
            f"{record.input.name}: {how_many(paths.runs, 'run')}, {paths.deposit_mm:.0f} mm of path at "
            f"{settings.spacing_mm:.3g} mm "
            f"spacing ({settings.backend})"
        )
    ]
    if paths.widths_mm is not None:
        least, most = paths.widths_mm
        lines.append(f"width: {least:.3g} to {most:.3g} mm; evenness, gaps and flow are relative to that")
    if paths.fibres is not None:
        lines.append(f"fibres: {fibres_text(paths.fibres)}")
    return [*lines, *feature_lines({settings.backend or "": record.features})]


def replanned_text(folder: str, *, written_by: str, differing: Sequence[str], changed: Sequence[str]) -> str:
    """Return the line on a bundle that was planned again.

    Args:
        folder: the bundle that it was made from.
        written_by: the version of geoprint that wrote that one.
        differing: files that have other bytes than there.
        changed: keys of the job that were given another value.
    """
    again = f"replanned from {folder}"
    if changed:
        keys = ", ".join(name.replace("_", " ") for name in changed)
        return (
            f"{again} with another {keys}: {how_many(len(differing), 'file')} "
            f"{'differs' if len(differing) == 1 else 'differ'}"
        )
    if not differing:
        return f"{again}: all files are identical"
    now = version("geoprint")
    why = "last digits may differ between machines and library versions"
    other = why if written_by == now else f"it was written by geoprint {written_by}, this is {now}"
    return (
        f"warning: {again}, but {how_many(len(differing), 'file')} {'differs' if len(differing) == 1 else 'differ'} "
        f"({', '.join(differing[:3])}): {other}"
    )


def _printed_text(record: PrintedRecord) -> str:
    """Return the line on the thickness in print."""
    cause = (
        "largest error source: the plan itself"
        if record.mend_first is None
        else f"largest error source: {WORDS[record.mend_first]}"
    )
    whose = "" if record.errors == "cell" else "; errors assumed from the packaged cell"
    return (
        f"in print: thickness is expected to vary by {expected_text(record)}, 95 % interval in brackets; {cause}{whose}"
    )


def _evenness_text(record: EvennessRecord, flow: DepositionRecord | None) -> str:
    """Return the line on how evenly the paths cover the part."""
    covered = f"area covered once {COVERED_ONCE.text(record)}, missed {GAP.text(record)}, twice {OVERLAP.text(record)}"
    here = "" if flow is None else f"; this print has {'constant' if flow.flow == 'constant' else 'following'} flow"
    return (
        f"evenness: layer thickness varies by {THICKNESS.text(record)} with constant flow, "
        f"{FOLLOWING.text(record)} with "
        f"flow that follows the width (CV){here}; {covered}"
    )


def _robot_text(record: RobotRecord, *, speed: float) -> list[str]:
    motion, found = record.motion, record.clearance
    named = "" if record.table is None else f"attitude {record.table.attitude}, "
    return [
        (
            f"{named}motion: {motion.duration_s:.0f} s, smallest wrist angle {motion.smallest_wrist_angle_deg:.1f} "
            f"degrees, {how_many(record.program.targets, 'target')} at least {motion.targets.shortest_mm:.2g} mm apart"
        ),
        _attitude_text(motion),
        _speed_text(motion, speed=speed),
        f"clearance: {found.smallest_mm:.2f} mm at the closest ({found.at})",
    ]


def _joined_text(record: JoinedRecord, *, count: int) -> str:
    """Return the line on the program of all attitudes."""
    return (
        f"program: {how_many(count, 'table attitude')} in turn, {record.print_s:.0f} s with the table's motions, "
        f"executed in {how_many(len(record.scenarios), 'scenario')}: {record.file}"
    )


def _attitude_text(record: MotionRecord) -> str:
    """Return the line on how the nozzle turns about itself, and where it leans."""
    turned = record.rotation.most_deg - record.rotation.least_deg
    if record.rotation.axial_nozzle:
        turn = "on the flange axis, so its rotation stays constant"
    else:
        turn = f"rotates about its axis by {turned:.0f} degrees"
    lean = f"leans from the surface normal by up to {record.tilt.largest_deg:.1f} degrees"
    return f"nozzle: {turn}; joint 6 makes {record.joint_6_turns:.1f} turns; {lean}"


def _speed_text(record: MotionRecord, *, speed: float) -> str:
    """Return one line on the speed of the print, where it dips and why, and what is deposited."""
    ceiling = f" (ceiling {record.speed_ceiling_mm_s:g})" if speed < record.speed_ceiling_mm_s else ""
    at_speed = percent(record.share_at_speed, 1)
    line = f"speed: prints at {speed:g} mm/s{ceiling}, {at_speed} of the deposit within 1 % of it"
    if record.slowdowns:
        worst = min(record.slowdowns, key=lambda dip: dip.held_speed)
        length = sum(dip.length for dip in record.slowdowns)
        why = f"the {worst.limit} of joint {worst.joint}" if worst.joint else "close targets in a bend"
        x, y, z = worst.place
        where = f"in run {worst.run + 1} by {why} at ({x:z.1f}, {y:z.1f}, {z:z.1f})"
        line += f"; down to {worst.held_speed:.3g} mm/s over {length:.3g} mm, {where}"
    found = record.deposited
    if found is None:
        return line
    whole, least, most = (percent(share, 1) for share in (found.share, found.least_run, found.most_run))
    return f"{line}; deposits {whole}, runs {least} to {most}"
