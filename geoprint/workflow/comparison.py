"""The same parts planned with several backends, and how even each of them is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from geoprint.config import Job
from geoprint.distance import compared_backends
from geoprint.errors import FieldError, InputError
from geoprint.metrics import MeasuredSurface
from geoprint.results import Comparison, FailedPart, Planned, Refused, Workpiece
from geoprint.workflow.backend_choice import check_part, with_backend
from geoprint.workflow.covering import Measured, measured_covers, shared_surface, taken_alike
from geoprint.workflow.feedback import check_single
from geoprint.workflow.planning import compared_workpiece, plan_compared
from geoprint.workflow.processes import OtherProcesses, shared
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import with_rounds


def compare(
    job: Job, *, backends: Sequence[str] | None = None, observe: Callable[[str], None] = lambda _: None
) -> Comparison:
    """Plan one part with several backends and measure how even each is.

    All backends get the same source, spacing and surface, refined for the backend that needs the finest mesh. Where
    fronts meet, each takes the best of its treatments of the medial axis. Evenness is measured even where the cell
    cannot print the paths; such a plan states the reason.

    Args:
        job: what to plan; its backend is ignored.
        backends: names of those to compare, duplicates counted once; by default those that declare themselves compared.
        observe: called with the name of each stage as it starts.

    Returns:
        The outcome of each backend: a plan, or the reason why there is none.

    Raises:
        UsageError: the job or its cell is unclear or contradicts itself.
        InputError: the part cannot be read, or no backend can plan on it.
    """
    return _compare(job, backends, observe, None)


def compare_parts(
    jobs: Sequence[Job],
    *,
    backends: Sequence[str] | None = None,
    observe: Callable[[str], None] = lambda _: None,
    helper: OtherProcesses | None = None,
) -> tuple[Comparison | FailedPart, ...]:
    """Compare the backends on several parts; one part's failure does not end the run.

    Args:
        jobs: one a part, at least one.
        backends: as for `compare`.
        observe: called with the name of each stage as it starts, the part's before it.
        helper: processes in which backends are planned besides this one, as `beside` keeps them; what is found is the
            same. They are started afresh, so that a script calls this under `if __name__ == "__main__":`, and what it
            registered itself is planned only without them.

    Returns:
        The outcomes, in the order of the jobs.

    Raises:
        UsageError: a job or its cell is unclear or contradicts itself: that holds for all of them.
        InputError: not one part can be read or planned on; that of the last one.
    """
    results: list[Comparison | FailedPart] = []
    for job in jobs:
        try:
            results.append(_compare(job, backends, _named(observe, job.surface.name, of=len(jobs)), helper))
        except InputError as error:
            if len(results) + 1 == len(jobs) and not any(isinstance(result, Comparison) for result in results):
                raise
            results.append(FailedPart(job, str(error)))
    return tuple(results)


def _compare(
    job: Job, backends: Sequence[str] | None, observe: Callable[[str], None], helper: OtherProcesses | None
) -> Comparison:
    """Compare backends, in this process and where there is one in a helper's."""
    backends = compared_backends() if backends is None else tuple(dict.fromkeys(backends))
    check_part(job)
    check_single(job)
    # Without the robot a backend is planned before another process has started.
    if len(backends) == 1 or not job.robot:
        helper = None
    if helper is not None:
        helper.start()
    workpiece, unplaced = compared_workpiece(job, Stages(observe), backends=backends)
    job = with_rounds(job, workpiece.cell).model_copy(update={"compared": [*backends]})
    jobs = [with_backend(job, name) for name in backends]
    cover = partial(_covers, workpiece=workpiece, on=shared_surface(job, workpiece))
    covers = shared(helper, cover, jobs, here=partial(cover, observe=observe))
    alike = iter(taken_alike([each for each in covers if not isinstance(each, Refused)]))
    measured = [each if isinstance(each, Refused) else next(alike) for each in covers]
    plan = partial(_outcome, unplaced=unplaced)
    outcomes = shared(helper, plan, measured, here=partial(plan, observe=observe))
    comparison = Comparison(job, workpiece, tuple(zip(backends, outcomes, strict=True)))
    if not comparison.planned:
        raise FieldError(comparison.refused[-1][1])
    return comparison


def _named(observe: Callable[[str], None], part: str, *, of: int) -> Callable[[str], None]:
    """Return an observer that hears of which part a stage is, where there are several."""
    return observe if of == 1 else lambda stage: observe(f"{part}: {stage}")


def _covers(
    job: Job, workpiece: Workpiece, on: MeasuredSurface | None, *, observe: Callable[[str], None] = lambda _: None
) -> tuple[Measured, ...] | Refused:
    """Return the measured paths of a backend, with each middle that is tried."""
    stage = Stages(lambda name: observe(f"{job.backend}: {name}"))
    try:
        covers = measured_covers(job, workpiece, stage, on=on)
    except FieldError as error:
        return Refused(str(error))
    # What was tried took its time, whichever is taken.
    return tuple((replace(paths, timings=tuple(stage.timings)), found) for paths, found in covers)


def _outcome(
    measured: Measured | Refused, *, unplaced: str | None, observe: Callable[[str], None] = lambda _: None
) -> Planned | Refused:
    """Return what becomes of the paths of a backend with the robot."""
    if isinstance(measured, Refused):
        return measured
    paths, _ = measured
    stage = Stages(lambda name: observe(f"{paths.job.backend}: {name}"), timings=paths.timings)
    try:
        plan, lost = plan_compared(measured, stage, unplaced=unplaced)
    except FieldError as error:
        return Refused(str(error))
    return Planned(plan, plan.not_printable, lost)
