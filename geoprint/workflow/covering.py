"""What covers a workpiece: paths, and how even prints of them are expected to be.

Where fronts meet plain contours and fitted ones are measured, and the better ones taken.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import cache, partial
from typing import TypeAlias, cast, final

import numpy as np

from geoprint.config import Job
from geoprint.distance import Piecewise, Shown
from geoprint.errors import FieldError
from geoprint.metrics import Covering, DistanceErrors, MeasuredSurface, Uniformity, distance_errors, printed, ranked
from geoprint.model import (
    Cell,
    Contours,
    FloatArray,
    FollowedLines,
    Placement,
    PoseStream,
    PrintErrors,
    ScalarField,
    Toolpath,
    frozen,
)
from geoprint.results import Layer, Plan, TriedMedialAxis, Workpiece
from geoprint.robot.placing import calibrate_fixture, position_uncertainty, turn_uncertainty
from geoprint.toolpath import PosedSurface, arrange, seams_of
from geoprint.transforms import apply
from geoprint.workflow.backend_choice import backend_of, pattern_of, seeks_middle
from geoprint.workflow.placement import pose_stream, posed
from geoprint.workflow.stages import Stages

# A workpiece covered with paths, and these turned into poses; the robot does not count yet.


def cover(
    job: Job,
    workpiece: Workpiece,
    stage: Stages,
    *,
    backend: Piecewise | None = None,
    known: Callable[[], PosedSurface] | None = None,
) -> Plan:
    """Cover the workpiece with paths and turn them into poses; evenness and the robot are left out.

    Args:
        job: what to plan.
        workpiece: to cover.
        stage: names and times the work.
        backend: that of the job on the surface of the workpiece; None builds it.
        known: returns what poses need of its surface and body, so that nothing is prepared twice.
    """
    drawn = drawn_runs(job, workpiece, stage, backend=backend)
    with stage("path"):
        stream = pose_stream(drawn.toolpath, workpiece, max_tilt_deg=job.max_tilt, known=known and known())
    place, height = workpiece.place, workpiece.cell.process.layer_height
    layers = (Layer(workpiece.surface, 0 if place is None else place.number - 1, height),)
    return Plan(
        job, workpiece, drawn.contours, drawn.toolpath, stream, None, layers, (), tuple(stage.timings),
        drawn.flattenings, followed=drawn.followed, promised=drawn.promised,
    )  # fmt: skip


@final
@frozen
class DrawnRuns:
    """The runs that cover a workpiece, before they become poses; everything as `Plan` has it."""

    workpiece: Workpiece
    contours: Contours
    toolpath: Toolpath
    flattenings: tuple[Shown, ...]
    followed: FollowedLines | None
    promised: FloatArray | None

    @property
    def paths(self) -> list[FloatArray]:
        """(k, 3) points of each run on the surface, in printing order [mm]."""
        curves = self.toolpath.curves
        return np.split(curves.points.xyz(self.workpiece.surface), curves.offsets[1:-1])


def drawn_runs(job: Job, workpiece: Workpiece, stage: Stages, *, backend: Piecewise | None = None) -> DrawnRuns:
    """Return the runs with which `cover` covers a workpiece, in the order of printing."""
    surface = workpiece.surface
    with stage("contours"):
        backend, source = backend or Piecewise(surface, backend_of(job)), workpiece.source
        spacing = job.spacing or backend.distance(source).maximum / (job.rounds or 1)
        widths = workpiece.widths
        paths = pattern_of(job, workpiece.place).paths(
            surface,
            source,
            backend=backend,
            spacing=spacing if widths is None else ScalarField(widths(surface.vertices)),
        )
        contours = Contours(paths.curves, paths.levels, spacing, backend.distance(source))
        flattenings = backend.shown(spacing=spacing)
    with stage("path"):
        place = workpiece.place
        seams = None if place is None else seams_of(place.base, layer=place.number - 1)
        toolpath = arrange(
            paths, surface, speed=workpiece.cell.process.speed, standoff=workpiece.standoff, seams=seams,
            shortest=workpiece.cell.shortest_run,
        )  # fmt: skip
    return DrawnRuns(workpiece, contours, toolpath, flattenings, paths.followed, paths.promised)


def measured_surface(workpiece: Workpiece, *, spacing: float) -> MeasuredSurface:
    """Return the part of a workpiece as it is measured, for all paths that are so far apart [mm]."""
    return MeasuredSurface(workpiece.part, spacing=spacing, wanted=workpiece.widths)


def shared_surface(job: Job, workpiece: Workpiece) -> MeasuredSurface | None:
    """Return the `measured_surface` for all that covers a workpiece; None where each has a spacing of its own."""
    return None if job.spacing is None else measured_surface(workpiece, spacing=job.spacing)


def evenness_of(paths: Plan, on: MeasuredSurface) -> Uniformity:
    """Measure how evenly the paths of a plan cover its part."""
    return on.uniformity(paths.poses, flow_shares=paths.workpiece.cell.process.flow_shares)


def distance_errors_of(paths: Plan, on: MeasuredSurface) -> DistanceErrors | None:
    """Measure how far the curves of a plan lie from the distance that they promise; None where they promise none."""
    workpiece, contours = paths.workpiece, paths.contours
    if paths.promised is None:
        return None
    return distance_errors(
        on.judged,
        workpiece.source,
        contours.curves,
        paths.promised,
        surface=workpiece.surface,
        spacing=contours.spacing,
    )


# Paths with what was measured of them, and that by itself.
Measured: TypeAlias = tuple[Plan, Uniformity]
PLAIN, FITTED = "plain", "fitted"
# Where less of the area than this is missed or covered twice there is nothing to gain.
NEGLIGIBLE_FAULT = 0.003


def measured_covers(
    job: Job,
    workpiece: Workpiece,
    stage: Stages,
    *,
    on: MeasuredSurface | None = None,
    backend: Piecewise | None = None,
    distance: bool = True,
) -> tuple[Measured, ...]:
    """Cover a workpiece and measure how evenly; where the best middle is sought, with each of them.

    Args:
        job: whose backend covers it.
        workpiece: to cover.
        stage: names and times the work.
        on: its `shared_surface`, if there is any.
        backend: as for `cover`.
        distance: whether the errors of the distance are measured too.

    Returns:
        What was asked for alone; or plain contours, and fitted ones where plain ones miss or cover twice more than next
        to nothing and fitted ones can be made.

    Raises:
        FieldError: the backend cannot plan on this part.
    """
    with stage("contours"):
        backend = backend or Piecewise(workpiece.surface, backend_of(job))

    def measured(middle: str | None, like: Plan | None = None) -> Measured:
        one = job if middle is None else job.model_copy(update={"middle": middle})
        paths = replace(cover(one, workpiece, stage, backend=backend, known=known), job=job)
        with stage("evenness"):
            return _measured(paths, surface_at(paths.contours.spacing), like=like, distance=distance)

    known = cache(partial(posed, workpiece))

    @cache
    def surface_at(spacing: float) -> MeasuredSurface:
        return on or measured_surface(workpiece, spacing=spacing)

    if not seeks_middle(job):
        return (measured(None),)
    plain = measured(PLAIN)
    if _covering(plain[1]).fault <= NEGLIGIBLE_FAULT:
        return (plain,)
    try:
        return plain, measured(FITTED, like=plain[0])
    except FieldError:
        return (plain,)


def _measured(paths: Plan, surface: MeasuredSurface, *, like: Plan | None, distance: bool) -> Measured:
    """Measure paths, but for what they share with those of the other treatment of the medial axis."""
    same = like is not None and _same(paths.poses, like.poses)
    paths = replace(paths, uniformity=like.uniformity if like and same else evenness_of(paths, surface))
    # Both treatments are of one distance.
    if like is not None or distance:
        paths = replace(paths, distance=like.distance if like else distance_errors_of(paths, surface))
    return paths, cast("Uniformity", paths.uniformity)


def _same(poses: PoseStream, others: PoseStream) -> bool:
    """Return whether two streams are the same: where no fronts meet, fitted contours are plain ones."""
    names = [field.name for field in fields(PoseStream)]
    return all(np.array_equal(getattr(poses, name), getattr(others, name)) for name in names)


def taken_alike(each: Sequence[tuple[Measured, ...]]) -> list[Measured]:
    """Return one covering of each of several backends, all with the middle of the best of those that have a choice.

    Like is compared with like so. A backend for which plain contours alone were measured keeps them, and has no say in
    what becomes of the others.

    Args:
        each: what `measured_covers` returned, a backend each.
    """
    choices = [(kind, measured) for covers in each if len(covers) > 1 for kind, measured in enumerate(covers)]
    order = ranked([_covering(found) for _, (_, found) in choices])
    taken = choices[order[0]][0] if choices else 0
    return [_of_kind(covers, taken) for covers in each]


def _of_kind(covers: tuple[Measured, ...], kind: int) -> Measured:
    """Return one of the coverings with what is said of both, or the only one."""
    if len(covers) == 1:
        return covers[0]
    tried = [_tried(name, *covers[k], taken=k == kind) for k, name in enumerate((PLAIN, FITTED))]
    paths, found = covers[kind]
    return replace(paths, middles=(tried[kind], tried[1 - kind])), found


def taken_job(paths: Plan) -> Job:
    """Return the job of a plan with the middle that was taken for it: covering with it makes the same paths again."""
    if not seeks_middle(paths.job):
        return paths.job
    taken = next((tried.middle for tried in paths.middles if tried.taken), PLAIN)
    return paths.job.model_copy(update={"middle": taken})


def _covering(measured: Uniformity) -> Covering:
    return Covering(measured.gap, measured.overlap, measured.thickness.cv)


def _tried(middle: str, paths: Plan, found: Uniformity, *, taken: bool) -> TriedMedialAxis:
    return TriedMedialAxis(middle, *_covering(found), paths.toolpath.curves.count, taken)


# What the cell makes of a plan: its errors, and how even prints are expected to be.


def with_print(plan: Plan, stage: Stages) -> Plan:
    """Return a plan with the thickness that prints of it are expected to have; as it is where it was not measured."""
    if plan.uniformity is None or plan.deposited is None:
        return plan
    with stage("expected print"):
        part, placement = plan.workpiece.part, plan.workpiece.placement
        errors = errors_of(plan.workpiece.cell, placement, middle=part.vertices.mean(axis=0))
        measured = plan.uniformity
        layer, along = measured.layer(follows=plan.deposited.mode == "analog")
        found = printed(
            layer, along, measured, errors, poses=plan.poses,
            wanted=plan.workpiece.widths,
        )  # fmt: skip
    return replace(plan, printed=found, timings=tuple(stage.timings))


def errors_of(cell: Cell, placement: Placement | None, *, middle: FloatArray) -> PrintErrors:
    """Return how far a print strays: what the cell says, and of the placement what its touched points tell.

    Args:
        cell: without errors of its own those of the packaged cells count.
        placement: where the part stands, or None without a robot.
        middle: (3,) of the part [mm].
    """
    errors = cell.errors or PrintErrors()
    if placement is None or not placement.calibrated or cell.fixture is None:
        return errors
    calibration = calibrate_fixture(cell.fixture)
    shift = position_uncertainty(calibration, apply(placement.T_base_work, middle[None]))
    turn = turn_uncertainty(calibration)
    return replace(errors, placement=shift.deviation, placement_turn=turn.deviation)
