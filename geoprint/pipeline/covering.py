"""A workpiece covered with strokes, and these turned into poses; the robot does not count yet."""

from __future__ import annotations

from geoprint.backends import Piecewise
from geoprint.config import Job
from geoprint.model import Contours, ScalarField
from geoprint.paths import arrange, seams_of
from geoprint.pipeline.choice import backend_of, pattern_of
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.standing import pose_stream
from geoprint.quality import DistanceErrors, Uniformity, distance_errors, uniformity
from geoprint.results import Layer, Plan, Workpiece


def cover(job: Job, workpiece: Workpiece, stage: Stages) -> Plan:
    """Cover the workpiece with strokes and turn them into poses; evenness and the robot are left out."""
    surface = workpiece.surface
    with stage("contours"):
        backend, seed = Piecewise(surface, backend_of(job)), workpiece.seed
        spacing = job.spacing or backend.distance(seed).maximum / (job.rounds or 1)
        widths = workpiece.widths
        strokes = pattern_of(job, workpiece.place).strokes(
            surface, seed, backend=backend, spacing=spacing if widths is None else ScalarField(widths(surface.vertices))
        )
        contours = Contours(strokes.curves, strokes.levels, spacing, backend.distance(seed))
        flattenings = backend.shown(spacing=spacing)
    with stage("path"):
        process = workpiece.cell.process
        place = workpiece.place
        seams = None if place is None else seams_of(place.base, layer=place.number - 1)
        toolpath = arrange(
            strokes, surface, speed=process.speed, standoff=workpiece.standoff, seams=seams,
            shortest=workpiece.cell.shortest_run,
        )  # fmt: skip
        stream = pose_stream(toolpath, workpiece, max_tilt_deg=job.max_tilt)
    layers = (Layer(surface, 0 if place is None else place.number - 1, process.layer_height),)
    return Plan(
        job, workpiece, contours, toolpath, stream, None, layers, (), tuple(stage.timings), flattenings,
        followed=strokes.followed, promised=strokes.promised,
    )  # fmt: skip


def evenness_of(paths: Plan) -> Uniformity:
    """Measure how evenly the paths of a plan cover its part."""
    workpiece = paths.workpiece
    return uniformity(
        paths.poses,
        workpiece.part,
        spacing=paths.contours.spacing,
        wanted=workpiece.widths,
        flow_shares=workpiece.cell.process.flow_shares,
    )


def distance_errors_of(paths: Plan) -> DistanceErrors | None:
    """Measure how far the curves of a plan lie from the distance that they promise; None where they promise none."""
    workpiece, contours = paths.workpiece, paths.contours
    if paths.promised is None:
        return None
    return distance_errors(
        workpiece.part,
        workpiece.seed,
        contours.curves,
        paths.promised,
        surface=workpiece.surface,
        spacing=contours.spacing,
    )
