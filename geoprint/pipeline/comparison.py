"""The same part planned with several backends, and how even each of them is."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np

from geoprint.config import Job
from geoprint.errors import FieldError, PlanError, VerificationError
from geoprint.export import Json, json_bytes, write_bundle
from geoprint.pipeline.planning import Plan, plan_paths, with_robot
from geoprint.pipeline.saving import plan_files, verify_files
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.summary import settings_summary, summary, uniformity_summary
from geoprint.pipeline.workpiece import RASTERED, Workpiece, prepare_workpiece, require_raster, upright
from geoprint.quality import Uniformity
from geoprint.report import Coverage, coverage_figure

COMPARED = ("lscm", "heat")
# The stages whose time is a backend's own.
PLANNING_STAGES = ("contours", "path")


@final
@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    """A backend's outcome.

    Attributes:
        plan: with the robot where the part is printable, without it where it is not.
        uniformity: how even its paths are.
        not_printable: why the robot cannot print it, or None where it can or was left out.
    """

    plan: Plan
    uniformity: Uniformity
    not_printable: str | None

    @property
    def planning_time(self) -> float:
        """Seconds that the backend's own stages took."""
        return sum(seconds for name, seconds in self.plan.timings if name in PLANNING_STAGES)


@final
@dataclass(frozen=True, slots=True)
class Refused:
    """A backend that cannot plan on this part.

    Attributes:
        reason: one sentence.
    """

    reason: str


@final
@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Several backends on one workpiece.

    Attributes:
        job: what was asked for; its backend does not count.
        workpiece: what all of them planned on.
        outcomes: backend name to outcome, in the order of the table.
    """

    job: Job
    workpiece: Workpiece
    outcomes: tuple[tuple[str, Planned | Refused], ...]


def compare(
    job: Job, *, backends: Sequence[str] = COMPARED, observe: Callable[[str], None] = lambda _: None
) -> Comparison:
    """Plan one part with several backends and measure how even each is.

    Like is compared with like: the same seed and spacing, and the same surface, refined to what the backend that needs
    the finest one asks for. Evenness is reported whatever the robot says; what the cell cannot print carries the
    reason.

    Args:
        job: what to plan; its backend is ignored, its resolution means the backends that have a raster.
        backends: which to compare; a name that comes twice counts once.
        observe: called with the name of each stage as it starts.

    Returns:
        The outcomes.

    Raises:
        UsageError: the job or its cell is unclear or contradicts itself.
        InputError: the part cannot be read, or no backend can plan on it.
    """
    require_raster(job, backends)
    shared = Stages(observe)
    workpiece, unplaced = _placed_workpiece(job, shared, backends=backends)
    outcomes = tuple(
        (name, _outcome(replace_backend(job, name), workpiece, unplaced=unplaced, observe=observe))
        for name in dict.fromkeys(backends)
    )
    refusals = [outcome.reason for _, outcome in outcomes if isinstance(outcome, Refused)]
    if len(refusals) == len(outcomes):
        raise FieldError(refusals[-1])
    return Comparison(job, workpiece, outcomes)


def replace_backend(job: Job, name: str) -> Job:
    """Return the same job for another backend; without the resolution where that has no raster."""
    return job.model_copy(update={"backend": name, "resolution": job.resolution if name in RASTERED else None})


def save_comparison(comparison: Comparison, directory: Path, *, overwrite: bool = False) -> None:
    """Write compare.json, the picture and a bundle for each planned backend: complete and verified, or not at all.

    Raises:
        UsageError: the folder exists already.
        ExportError: nothing can be written there.
        VerificationError: what was written differs from the plans when it is read back.
    """
    files = {"compare.json": json_bytes(comparison_summary(comparison)), "compare.png": comparison_picture(comparison)}
    planned = [(name, outcome.plan) for name, outcome in comparison.outcomes if isinstance(outcome, Planned)]
    for name, plan in planned:
        files |= {f"{name}/{file}": content for file, content in plan_files(plan).items()}

    def verify(folder: Path) -> None:
        for name, plan in planned:
            verify_files(plan, folder / name)
        if [row["backend"] for row in json.loads((folder / "compare.json").read_bytes())["backends"]] != [
            name for name, _ in comparison.outcomes
        ]:
            raise VerificationError("compare.json does not list the compared backends; write again.")

    write_bundle(directory, files, overwrite=overwrite, verify=verify)


def comparison_summary(comparison: Comparison) -> dict[str, Json]:
    """Return the content of compare.json: what was compared, and a row of figures for each backend."""
    first = next(outcome.plan for _, outcome in comparison.outcomes if isinstance(outcome, Planned))
    about = summary(first)
    return {
        "version": about["version"],
        "input": about["input"],
        "settings": {name: value for name, value in settings_summary(first).items() if name != "backend"},
        "surface": about["surface"],
        "backends": [_row(name, outcome) for name, outcome in comparison.outcomes],
    }


def comparison_picture(comparison: Comparison) -> bytes:
    """Return a PNG: the backends side by side, their paths coloured by local spacing."""
    planned = [(name, outcome) for name, outcome in comparison.outcomes if isinstance(outcome, Planned)]
    spacing = planned[0][1].plan.contours.spacing
    return coverage_figure(
        comparison.workpiece.part,
        [_coverage(name, outcome) for name, outcome in planned],
        R_view_work=upright(comparison.workpiece),
        spacing=spacing,
        title=f"{comparison.job.surface.name}, paths {spacing:.3g} mm apart, seen along the mean normal",
    )


def _coverage(name: str, outcome: Planned) -> Coverage:
    """Return the panel of a backend; the outermost runs have no neighbour outside and so no spacing."""
    measured, poses = outcome.uniformity, outcome.plan.poses
    outermost = poses.deposit & (poses.levels == poses.levels[poses.deposit].min())
    _, counts = np.unique(poses.runs[outermost], return_counts=True)
    sizes = np.concatenate([np.diff(measured.offsets), counts])
    return Coverage(
        title=name,
        caption=f"spacing CV {measured.cv:.1%}, uncovered {measured.uncovered:.1%}",
        places=np.concatenate([measured.places, poses.surface_points[outermost]]),
        offsets=np.concatenate([[0], np.cumsum(sizes)]),
        ratios=np.concatenate([measured.ratios, np.full(int(counts.sum()), np.nan)]),
    )


def _placed_workpiece(job: Job, stage: Stages, *, backends: Sequence[str]) -> tuple[Workpiece, str | None]:
    """Prepare the workpiece; where it cannot be placed, without a robot and with the reason."""
    try:
        return prepare_workpiece(job, stage, backends=backends), None
    except PlanError as error:
        return prepare_workpiece(job.model_copy(update={"robot": False}), stage, backends=backends), str(error)


def _outcome(
    job: Job, workpiece: Workpiece, *, unplaced: str | None, observe: Callable[[str], None]
) -> Planned | Refused:
    stage = Stages(lambda name: observe(f"{job.backend}: {name}"))
    try:
        paths = plan_paths(job, workpiece, stage)
    except FieldError as error:
        return Refused(str(error))
    measured = paths.uniformity
    if measured is None:
        return Refused(
            f"there is but one level of paths {paths.contours.spacing:g} mm apart: choose a smaller spacing."
        )
    if workpiece.placement is None:
        return Planned(paths, measured, unplaced)
    try:
        return Planned(with_robot(paths, workpiece.placement, stage), measured, None)
    except PlanError as error:
        return Planned(replace(paths, timings=tuple(stage.timings)), measured, str(error))


def _row(name: str, outcome: Planned | Refused) -> dict[str, Json]:
    if isinstance(outcome, Refused):
        return {"backend": name, "refused": outcome.reason}
    plan, about = outcome.plan, summary(outcome.plan)
    robot = plan.robot
    return {
        "backend": name,
        "spacing_mm": plan.contours.spacing,
        "uniformity": uniformity_summary(outcome.uniformity),
        "paths": about["paths"],
        "printable": robot is not None if plan.job.robot else None,
        "not_printable": outcome.not_printable,
        "print_time_s": None if robot is None else robot.trajectory.duration,
        "smallest_clearance_mm": None if robot is None else round(robot.clearance.smallest, 6),
        "planning_s": round(outcome.planning_time, 3),
        "warnings": about["warnings"],
    }
