"""What becomes of contours where fronts meet: plain ones and fitted ones are measured, and the better ones taken."""

from __future__ import annotations

from dataclasses import replace

from geoprint.config import Job
from geoprint.errors import FieldError
from geoprint.pipeline.choice import seeks_middle
from geoprint.pipeline.covering import cover, evenness_of
from geoprint.pipeline.stages import Stages
from geoprint.quality import Covering, Uniformity, ranked
from geoprint.results import Plan, TriedMiddle, Workpiece

PLAIN, FITTED = "plain", "fitted"
# Where less of the area than this is missed or covered twice there is nothing to gain.
NEGLIGIBLE_FAULT = 0.003


def measured_cover(job: Job, workpiece: Workpiece, stage: Stages) -> tuple[Plan, Uniformity]:
    """Cover a workpiece and measure how evenly; where the best middle is sought, with the one that leaves least.

    Plain contours stay where they miss or cover twice next to nothing, and where fitted ones cannot be made.

    Returns:
        The paths with what was measured, and that by itself.

    Raises:
        FieldError: the backend cannot plan on this part.
    """
    if not seeks_middle(job):
        return _measured(job, job, workpiece, stage)
    plain, found = _measured(job, job.model_copy(update={"middle": PLAIN}), workpiece, stage)
    if _covering(found).fault <= NEGLIGIBLE_FAULT:
        return plain, found
    try:
        fitted, fits = _measured(job, job.model_copy(update={"middle": FITTED}), workpiece, stage)
    except FieldError:
        return plain, found
    taken = ranked([_covering(found), _covering(fits)])[0] == 1
    middles = (_tried(FITTED, fitted, fits, taken=taken), _tried(PLAIN, plain, found, taken=not taken))
    return (replace(fitted, middles=middles), fits) if taken else (replace(plain, middles=middles), found)


def taken_job(paths: Plan) -> Job:
    """Return the job of a plan with the middle that was taken for it: covering with it makes the same paths again."""
    if not seeks_middle(paths.job):
        return paths.job
    taken = next((tried.middle for tried in paths.middles if tried.taken), PLAIN)
    return paths.job.model_copy(update={"middle": taken})


def _measured(asked: Job, job: Job, workpiece: Workpiece, stage: Stages) -> tuple[Plan, Uniformity]:
    """Return the paths of a job, kept as those of what was asked for, and how even they are."""
    paths = cover(job, workpiece, stage)
    with stage("evenness"):
        measured = evenness_of(paths)
    return replace(paths, job=asked, uniformity=measured), measured


def _covering(measured: Uniformity) -> Covering:
    return Covering(measured.gap, measured.overlap, measured.thickness.cv)


def _tried(middle: str, paths: Plan, found: Uniformity, *, taken: bool) -> TriedMiddle:
    return TriedMiddle(middle, *_covering(found), paths.toolpath.curves.count, taken)
