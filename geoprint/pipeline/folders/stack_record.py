"""What stack.json and stacks.json say, held against the bundles of the layers and the program of all of them.

Each figure of a layer is that of its own plan.json, which is checked by itself; those of the whole follow from them and
from the program as it was executed. How the finished thickness comes out is simulated again with `--full`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import cast

from geoprint.account.checked import Checked, CheckedStack, Finding
from geoprint.account.prints.attitudes import JOINED_LIST
from geoprint.account.prints.cure import with_cure
from geoprint.account.records.plan import PlanRecord
from geoprint.account.records.rounding import as_json
from geoprint.account.records.stack import StackedLayerRecord, StackRecord
from geoprint.account.stacked.summary import finished_record
from geoprint.config import Job, job_cell, job_of
from geoprint.errors import GeoprintError
from geoprint.export import Json
from geoprint.export.rapid.stacks import OwnProgram
from geoprint.model import PoseStream
from geoprint.pipeline.bundles.again import JOB
from geoprint.pipeline.bundles.contents import STACK
from geoprint.pipeline.bundles.figures import VOLUME_SHARE, figures
from geoprint.pipeline.bundles.inputs import planned_cell, planned_job
from geoprint.pipeline.bundles.paths import stream_of
from geoprint.pipeline.folders.layer_moves import LayerMove
from geoprint.pipeline.folders.replanning import record_findings
from geoprint.pipeline.stacked.simulating import finished_stack
from geoprint.pipeline.tilting import part_folder
from geoprint.pipeline.workpiece import read_stack
from geoprint.quality.stacked import laid_volume
from geoprint.results import StackedLayer

# Speeds of layers that are equal to so many mm/s are one.
SPEED = 1e-4


def stack_findings(
    stack: CheckedStack,
    layers: Sequence[tuple[str, Checked]],
    own: Sequence[OwnProgram],
    moves: Sequence[LayerMove],
    *,
    names: Mapping[str, Mapping[str, str]],
) -> Iterator[Finding]:
    """Yield what stack.json says that its layers and its program do not.

    Args:
        stack: with stack.json, and with what its program did in this check.
        layers: folder and bundle of each, the lowest first, without a finding.
        own: their programs; none without a robot.
        moves: how a table comes to each but the lowest; none where the part stands still.
        names: of the files of each bundle, by its folder.
    """
    told = stack.told
    if told is None:
        return
    folders: list[Json] = [name for name, _ in layers]
    yield from figures(STACK, "", {"layers": [one.folder for one in told.layers]}, {"layers": folders})
    plans = [one.told for _, one in layers]
    if len(plans) != len(told.layers) or any(plan is None for plan in plans):
        return
    held = cast("Sequence[PlanRecord]", plans)
    jobs = [planned_job(one.folder, names[name]) for name, one in layers]
    for number, (of, plan, (_, one), job) in enumerate(zip(told.layers, held, layers, jobs, strict=True)):
        yield from figures(STACK, f"layers.{number}", as_json(of), _layer(plan, one, job), near=SPEED)
        yield from _volume(of, plan, one, number=number)
    yield from figures(STACK, "", as_json(told), _whole(told, held, jobs))
    yield from _finished_volume(told)
    untold = told.model_copy(
        update={
            "cure": None,
            "not_checked": (),
            "layers": tuple(layer.model_copy(update={"cure": None}) for layer in told.layers),
        }
    )
    lit = with_cure(untold, job_cell(jobs[0]))
    for key in ("cure", "not_checked"):
        yield from figures(STACK, "", {key: as_json(told).get(key)}, {key: as_json(lit).get(key)})
    program = None if told.program is None else as_json(told.program)
    if (program is None) is not (not own):
        yield Finding(STACK, 1, f"it tells of {'no' if program is None else 'a'} program of all layers")
    if program is not None and own:
        yield from figures(STACK, "program", program, _program(stack, held, own, moves))


def _layer(plan: PlanRecord, one: Checked, job: Job) -> dict[str, Json]:
    """Return what is said of a layer, by its own bundle."""
    (layer,) = plan.layers
    even, laid, robots = plan.uniformity, plan.deposition, plan.robot
    thickness = None if even is None or laid is None else even.thickness if laid.flow == "constant" else even.following
    seconds = plan.joined.print_s if plan.joined is not None else sum(one.motion.duration_s for one in robots)
    found: dict[str, Json] = {
        "bottom_mm": layer.bottom_mm,
        "height_mm": layer.height_mm,
        "area_mm2": plan.surface.area_mm2,
        "pattern": str(job.drawing),
        "runs": plan.paths.runs,
        "deposit_mm": plan.paths.deposit_mm,
        "gap": None if even is None else even.gap,
        "overlap": None if even is None else even.overlap,
        "thickness_cv": None if thickness is None else thickness.cv,
        "helix_deg": None if plan.paths.fibres is None else plan.paths.fibres.helix_mean_deg,
        "wanted_mm3": plan.surface.area_mm2 * layer.height_mm,
        "print_s": seconds if robots else None,
        "attitudes": len(robots) if any(robot.table is not None for robot in robots) else None,
        "clearance_mm": min((robot.clearance.smallest_mm for robot in robots), default=None),
        "not_printable": plan.not_printable,
        "dose_mj_cm2": None if laid is None or laid.light is None else laid.light.all_passes,
        "warnings": [*plan.warnings],
        "not_checked": list(dict.fromkeys(text for robot in robots for text in robot.clearance.not_checked)),
    }
    # What a layer is slowed down by is its own missing volume: the rest is the speed of all layers.
    asked = planned_cell(job, plan).process.speed
    share = one.setup.cell.process.speed / robots[0].motion.speed_ceiling_mm_s if robots and one.setup else 1.0
    found["speed_mm_s"] = asked * share
    if "pattern" in found and found["pattern"] == "contours":
        # Left out where it is that.
        del found["pattern"]
    return {key: value for key, value in found.items() if value is not None}


def _volume(of: StackedLayerRecord, plan: PlanRecord, one: Checked, *, number: int) -> Iterator[Finding]:
    """Yield the volume of a layer that is not what its program deposits."""
    count = len(plan.robot)
    folders = [part_folder(each, count) for each in range(1, count + 1)] or [""]
    shares = [robot.motion.deposited.share if robot.motion.deposited else 0.0 for robot in plan.robot] or [1.0]
    streams: list[PoseStream] = [stream_of(one.folder / folder, plan) for folder in folders]
    laid = sum(share * laid_volume(each, each.flow) for share, each in zip(shares, streams, strict=True))
    found: dict[str, Json] = {"laid_mm3": laid}
    yield from figures(STACK, f"layers.{number}", as_json(of), found, near=VOLUME_SHARE * laid)


def _whole(told: StackRecord, plans: Sequence[PlanRecord], jobs: Sequence[Job]) -> dict[str, Json]:
    """Return what is said of all layers together, by their own bundles."""
    first, job = plans[0], jobs[0]
    (layer,) = first.layers
    found: dict[str, Json] = {
        "part": first.input.name,
        "target": None if first.input.target is None else first.input.target.name,
        "thickness_mm": layer.count * layer.height_mm if job.thickness is None else job.thickness,
    }
    found["version"] = first.version if all(plan.version == first.version for plan in plans) else version("geoprint")
    if job.target is None:
        found["target_mm3"] = None
        found["left_out"] = []
    numbers: list[Json] = [each.number for each in told.left_out]
    if numbers != [*range(len(plans) + 1, len(plans) + 1 + len(numbers))] or len(plans) + len(numbers) != layer.count:
        found["left_out (numbers)"] = [*range(len(plans) + 1, layer.count + 1)]
    return found


def _finished_volume(told: StackRecord) -> Iterator[Finding]:
    """Yield that the volume of the finished stack is not that of its layers."""
    finished = told.finished.printed
    wanted = told.target_mm3 or sum(layer.wanted_mm3 for layer in told.layers)
    if finished is not None and wanted > 0.0:
        volume: dict[str, Json] = {"volume": sum(layer.laid_mm3 for layer in told.layers) / wanted}
        yield from figures(STACK, "finished.printed", as_json(finished), volume)


def _program(
    stack: CheckedStack, plans: Sequence[PlanRecord], own: Sequence[OwnProgram], moves: Sequence[LayerMove]
) -> dict[str, Json]:
    """Return what is said of the program of all layers, as it was executed in this check."""
    pause = own[0].cell.process.layer_pause
    printing = sum(
        plan.joined.print_s if plan.joined is not None else sum(one.motion.duration_s for one in plan.robot)
        for plan in plans
    )
    moving = sum(move.seconds - move.from_rest for move in moves)
    found: dict[str, Json] = {
        "file": JOINED_LIST,
        "pause_s": pause,
        "print_s": printing + moving + pause * (len(plans) - 1),
        "runs_dry_only": bool(own[0].placement.missing),
    }
    if stack.proof is not None:
        found |= {
            "scenarios": [*stack.proof.scenarios],
            "refused": [*stack.proof.refused],
            "lines_with_statements": stack.proof.statements,
            "lines_executed": stack.proof.executed,
        }
    return found


def finished_findings(folder: Path, stack: CheckedStack, kept: Sequence[StackedLayer]) -> list[Finding]:
    """Return what is said of the finished thickness that its layers, planned again, do not leave.

    Args:
        folder: of the stack.
        stack: with stack.json.
        kept: what a stack takes of each layer that was planned again.
    """
    told = stack.told
    if told is None or len(kept) != len(told.layers):
        return []
    try:
        job = job_of(surface=folder / told.layers[0].folder / JOB).model_copy(update={"layer": None})
        whole = read_stack(job)
        finished = finished_stack(job, whole, kept)
    except GeoprintError as error:
        return [Finding(STACK, 1, f"simulated again: {error}")]
    target = None if whole.target is None else whole.target.volume
    wanted = sum(layer.wanted_mm3 for layer in told.layers) if target is None else target
    again: dict[str, Json] = {
        "finished": as_json(finished_record(finished, wanted=wanted)),
        "thickness_mm": whole.thickness,
        "target_mm3": target,
    }
    said: dict[str, Json] = {**as_json(told)}
    return [*record_findings(STACK, {key: said.get(key) for key in again}, again)]
