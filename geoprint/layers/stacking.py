"""A thickness, layer upon layer: each is planned by itself, as a part that lies on the one below.

Layers do not wait for each other: what one lies on is a level of the distance from the part, not what was planned. So
two are planned at a time, each in a process of its own, and nothing is written before all of them are verified.

The processes are started afresh, alike on every platform: a script calls `plan_stack` under
`if __name__ == "__main__":`, and what it registered itself (a backend, a pattern) is known there only where a package's
entry point brings it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from shutil import rmtree
from typing import TypeAlias

from geoprint.config import Job, job_cell
from geoprint.distance import compared_backends
from geoprint.errors import FieldError, ResourceError, UsageError, how_many, naming
from geoprint.geometry import face_areas
from geoprint.layers.check_stack import layer_moves, own_programs, stack_program
from geoprint.layers.layering import EMPTY, Stack, read_stack
from geoprint.layers.records import (
    STACK,
    STACKS,
    LeftOutRecord,
    StackComparisonRecord,
    StackedLayerRecord,
    StackProgramRecord,
    StackRecord,
)
from geoprint.layers.stack_comparison import compared_stack, compared_stacks_page, comparison_record
from geoprint.layers.stack_page import stack_page
from geoprint.layers.stack_text import finished_record, layer_record, wanted_volume, with_cure
from geoprint.layers.stack_thickness import FinishedStack, StackedLayer, finished_stack, stacked_layer
from geoprint.postprocessor import json_bytes, seal, staging
from geoprint.postprocessor.bundle import add_files
from geoprint.reporting.records.rounding import as_json, stamp, verify_record
from geoprint.results import Workpiece
from geoprint.workflow.backend_choice import check_lines, check_options, with_backend
from geoprint.workflow.bundles import REPORT
from geoprint.workflow.feedback import check_single
from geoprint.workflow.planning import compared_workpiece, plan
from geoprint.workflow.processes import layer_processes, stopped_later
from geoprint.workflow.saving import save_plan
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import prepare_workpiece

# What is said and kept of a layer, or why there is nothing to print in it.
_Found: TypeAlias = "tuple[StackedLayerRecord, StackedLayer] | LeftOutRecord"
# What is said of a backend's stack and how it comes out, or why it cannot plan a layer.
_Compared: TypeAlias = "tuple[StackRecord, FinishedStack] | str"
# Speeds of layers [mm/s] that are equal to so many digits are one.
SPEED_DECIMALS = 6


def plan_stack(
    job: Job, directory: Path | str, *, overwrite: bool = False, observe: Callable[[str], None] = lambda _: None
) -> StackRecord:
    """Plan every layer of a thickness; write bundles, one program, stack.json and report.html: verified, or nothing.

    Args:
        job: with a thickness, without a layer.
        directory: where the folder shall stand; layer 1 is in `layer-01`, and so on.
        overwrite: whether an existing result may be replaced.
        observe: called with what is being done.

    Returns:
        What stack.json says.

    Raises:
        UsageError: the job has no thickness or one layer alone, the folder exists already, or as `check_options`.
        ExportError: nothing can be written there.
        ResourceError: a process was ended from outside, as it is where memory runs out.
        GeoprintError: as `plan`; the sentence names the layer.
    """
    check_stacked(job)
    check_options(job, [job.backend])
    with staging(directory, overwrite=overwrite) as folder:
        record, _ = stack_into(job, folder, observe=observe)
        seal(folder)
        verify_record(folder / STACK, record)
    return record


def plan_layers(job: Job, *, observe: Callable[[str], None] = lambda _: None) -> FinishedStack:
    """Plan every layer of a thickness one after the other in this process, and write nothing.

    Args:
        job: with a thickness, without a layer.
        observe: called with what is being done.

    Returns:
        How the stack comes out; its `figure()` cuts it open.

    Raises:
        UsageError: the job has no thickness or one layer alone, or as `check_options`.
        GeoprintError: as `plan`, or nothing is to be printed in a layer; the sentence names it.
    """
    check_stacked(job)
    stack, layers = read_stack(job), list[StackedLayer]()
    for number in range(1, stack.count + 1):
        observe(f"layer {number}")
        with naming(f"layer {number}"):
            layers.append(stacked_layer(plan(job.model_copy(update={"layer": number}))))
    return finished_stack(job, stack, layers)


def compare_stacks(
    job: Job,
    directory: Path | str,
    *,
    backends: Sequence[str] | None = None,
    overwrite: bool = False,
    observe: Callable[[str], None] = lambda _: None,
) -> StackComparisonRecord:
    """Plan every layer of a thickness with several backends; write stacks, stacks.json and report.html: all or nothing.

    As in `compare`, all of them plan a layer on the same surface, and what the robot cannot print is planned, too.

    Args:
        job: with a thickness, without a layer; its backend is ignored.
        directory: where the folder shall stand; the stack of a backend is in a folder of its name.
        backends: which to compare, a name that comes twice counts once; those that say so of themselves by default.
        overwrite: whether an existing result may be replaced.
        observe: called with what is being done.

    Returns:
        What stacks.json says.

    Raises:
        UsageError: as `plan_stack`.
        FieldError: no backend can plan all layers; that of the first one.
        GeoprintError: as `plan_stack`.
    """
    check_stacked(job)
    names = compared_backends() if backends is None else tuple(dict.fromkeys(backends))
    check_options(job, names)
    with staging(directory, overwrite=overwrite) as folder:
        found = [(name, _stack(with_backend(job, name), names, folder / name, observe)) for name in names]
        stacks = {name: stack for name, stack in found if not isinstance(stack, str)}
        if not stacks:
            raise FieldError(next(recorded for _, recorded in found if isinstance(recorded, str)))
        rows = [
            compared_stack(name, stack if isinstance(stack, str) else stack[0], asked=job.robot)
            for name, stack in found
        ]
        record = comparison_record(rows, next(stack for stack, _ in stacks.values()))
        page = compared_stacks_page(stacks, record, job, page=REPORT)
        add_files(folder, {STACKS: json_bytes(as_json(record)), REPORT: page})
        seal(folder)
        verify_record(folder / STACKS, record)
    return record


def check_stacked(job: Job) -> None:
    """Check that a job is of all layers.

    Raises:
        UsageError: it is not, or names feedback, which is of one plan.
    """
    if not job.divided:
        raise UsageError("a stack needs a thickness or a target and no layer: `plan` plans one of them.")
    check_single(job)


def stack_into(job: Job, folder: Path, *, observe: Callable[[str], None]) -> tuple[StackRecord, FinishedStack]:
    """Plan every layer of a thickness, and write all that a stack's folder holds into one that nobody sees yet.

    Args:
        job: of all layers.
        folder: an empty one.
        observe: called with what is being done.

    Returns:
        What stack.json says, and how the stack comes out.

    Raises:
        GeoprintError: as `plan_stack`.
    """
    found = _planned(job, folder, observe)
    layers = [record for record, _ in _printed(found)]
    observe("program of all layers")
    own = own_programs(folder, layers)
    jobs = [job.model_copy(update={"layer": number}) for number, _ in enumerate(layers, start=1)]
    files, program = stack_program(own, layers, layer_moves(jobs, own), part_name=job.surface.name)
    observe("finished thickness")
    recorded, finished = _finished(job, read_stack(job), found, program=program)
    page = stack_page(finished, recorded, job)
    add_files(folder, {STACK: json_bytes(as_json(recorded)), REPORT: page, **files})
    return recorded, finished


def _printed(found: Iterable[_Found]) -> list[tuple[StackedLayerRecord, StackedLayer]]:
    """Return those of the planned layers in which something is printed."""
    return [layer for layer in found if not isinstance(layer, LeftOutRecord)]


def _finished(
    job: Job, stack: Stack, found: Sequence[_Found], *, program: StackProgramRecord | None
) -> tuple[StackRecord, FinishedStack]:
    """Return what stack.json says when all layers are planned, and how they come out."""
    printed = _printed(found)
    finished = finished_stack(job, stack, [layer for _, layer in printed])
    layers = tuple(record for record, _ in printed)
    untold = StackRecord(
        **stamp(StackRecord),
        part=job.surface.name,
        thickness_mm=stack.thickness,
        target=None if job.target is None else job.target.name,
        target_mm3=None if stack.target is None else stack.target.volume,
        finished=finished_record(finished, wanted=wanted_volume(stack.target, layers)),
        layers=layers,
        program=program,
        left_out=tuple(layer for layer in found if isinstance(layer, LeftOutRecord)),
    )
    return with_cure(untold, job_cell(job)), finished


def _planned(job: Job, folder: Path, observe: Callable[[str], None]) -> list[_Found]:
    """Plan the layers, two at a time, and return what is said and kept of each; the first refusal ends it.

    Raises:
        FieldError: a layer over one with nothing to print in it has something, or none has.
    """
    observe("layers")
    with layer_processes() as pool:
        try:
            # This process waits while others plan: what it read itself it would hold beside them.
            with stopped_later():
                counted = pool.submit(_checked_count, job)
            count = counted.result()
            observe(how_many(count, "layer"))
            found = _all_of(range(1, count + 1), job, folder, observe, pool)
            # One pressure deposits what is planned in all layers at one speed only.
            while len(speeds := {record.speed_mm_s for record, _ in _printed(found.values())}) > 1:
                slowest = min(speeds)
                faster = [number for number, one in found.items() if not _prints_at(slowest, one)]
                observe(f"{how_many(len(faster), 'layer')} again at {slowest:g} mm/s")
                slower = job.model_copy(update={"speed": slowest})
                found |= _all_of(faster, slower, folder, observe, pool)
        except BrokenProcessPool as error:
            raise ResourceError(
                "a worker that planned a layer was killed, most likely out of memory: each needs about 1 GB. Plan "
                "layer by layer with `--layer`, or choose a larger spacing. (A script calls this under `if __name__ "
                '== "__main__":`.)'
            ) from error
    layers = list(found.values())
    printed = [not isinstance(layer, LeftOutRecord) for layer in layers]
    holes = [layer for layer, above in zip(layers, printed[1:], strict=False) if above]
    empty = next((layer for layer in (*holes, layers[0]) if isinstance(layer, LeftOutRecord)), None)
    if empty is not None:
        raise FieldError(empty.reason)
    return layers


def _all_of(
    numbers: Iterable[int], job: Job, folder: Path, observe: Callable[[str], None], pool: ProcessPoolExecutor
) -> dict[int, _Found]:
    """Plan some layers, and return what is said and kept of each by its number."""
    with stopped_later():
        waiting = {
            pool.submit(_layer, job, number, folder / f"layer-{number:02}"): number for number in sorted(numbers)
        }
    for done, future in enumerate(as_completed(waiting), start=1):
        future.result()
        observe(f"{how_many(len(waiting), 'layer')}, {done} done")
    return {number: future.result() for future, number in waiting.items()}


def _prints_at(speed: float, found: _Found) -> bool:
    return isinstance(found, LeftOutRecord) or found[0].speed_mm_s <= speed


def _checked_count(job: Job) -> int:
    """Return in how many layers a job falls, once the outermost one that holds something can be prepared.

    What refuses a layer before its paths are planned, a level that meets itself, lines or widths that it does not have,
    or where it stands, refuses the outermost one. So nobody waits for those below it first.

    Raises:
        GeoprintError: as `prepare_workpiece` and `check_lines`; the sentence names the layer.
    """
    count = read_stack(job).count
    for number in range(count, 0, -1):
        asked = job.model_copy(update={"layer": number})
        try:
            with naming(f"layer {number}"):
                check_lines(asked, _workpiece(asked))
        except FieldError as error:
            if not error.details.get(EMPTY):
                raise
        else:
            break
    return count


def _workpiece(job: Job) -> Workpiece:
    """Return what a layer is planned on."""
    stage = Stages(lambda _: None)
    if job.compared:
        return compared_workpiece(job, stage, backends=list(dict.fromkeys([*job.compared, job.backend])))[0]
    return prepare_workpiece(job, stage, backends=[job.backend])


def _layer(job: Job, number: int, folder: Path) -> _Found:
    """Plan one layer and write its bundle, or say why there is nothing to print in it."""
    try:
        with naming(f"layer {number}"):
            planned = plan(job.model_copy(update={"layer": number}))
            record = save_plan(planned, folder, overwrite=True)
    except FieldError as error:
        if not error.details.get(EMPTY):
            raise
        return LeftOutRecord(number=number, reason=str(error))
    workpiece, kept = planned.workpiece, stacked_layer(planned)
    # What the whole print would be slower by: where the missing volume of a layer is made up, so much is its own.
    asked = job_cell(job).process.speed
    share = workpiece.cell.process.speed / planned.robot[0].ceiling if planned.robot else 1.0
    return layer_record(
        record,
        folder=folder.name,
        bottom=kept.bottom,
        height=kept.height,
        area=float(face_areas(workpiece.part).sum()),
        pattern=str(planned.job.drawing),
        speed=round(asked * share, SPEED_DECIMALS),
        deposited=float(kept.volumes[kept.printed]),
    ), kept


def _stack(job: Job, compared: Sequence[str], folder: Path, observe: Callable[[str], None]) -> _Compared:
    """Return what is said of the stack of a compared backend and how it comes out, or why it cannot plan a layer."""
    try:
        return stack_into(
            job.model_copy(update={"compared": [*compared]}),
            folder,
            observe=lambda stage: observe(f"{job.backend}: {stage}"),
        )
    except FieldError as error:
        rmtree(folder, ignore_errors=True)
        return str(error)
