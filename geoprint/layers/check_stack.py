"""stack.json and stacks.json, held against the bundles of the layers, their program and the table's motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path, PurePosixPath
from typing import cast, final

import numpy as np

from geoprint.config import Job, job_cell, job_of
from geoprint.errors import GeoprintError, naming
from geoprint.layers.layering import read_stack
from geoprint.layers.records import (
    STACK,
    STACKS,
    RefusedStackRecord,
    StackComparisonRecord,
    StackedLayerRecord,
    StackProgramRecord,
    StackRecord,
)
from geoprint.layers.stack_comparison import compared_stack, comparison_record
from geoprint.layers.stack_text import (
    finished_record,
    layer_record,
    layer_seconds,
    printed_parts,
    stack_sheet,
    wanted_volume,
    with_cure,
)
from geoprint.layers.stack_thickness import StackedLayer, finished_stack, stacked_layer
from geoprint.metrics.executed_flow import deposited_volume
from geoprint.model import PoseStream, frozen
from geoprint.positioner import table_machine
from geoprint.postprocessor import EVIDENCE, Json, OwnProgram, StackProof, read_setup
from geoprint.postprocessor.registry import joined_file, joining_of, post_processor_name
from geoprint.reporting.check import Checked, CheckedComparison, CheckedParts, CheckedStack, Finding
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import as_json, read_record
from geoprint.results import Plan
from geoprint.workflow.bundles import bundles, check_parts, own_program, read_seen, stream_of
from geoprint.workflow.check_figures import VOLUME_SHARE, controller_files_findings, figures, joined_header_findings
from geoprint.workflow.check_folder import changes_beside, check_folder, check_inner
from geoprint.workflow.check_inputs import planned_cell, planned_job
from geoprint.workflow.check_replan import record_findings
from geoprint.workflow.replan import JOB
from geoprint.workflow.table_motion import move_clearance, sweep_seconds
from geoprint.workflow.tilting import part_folder
from geoprint.workflow.workpiece import read_part

# A folder with a stack, or with several that are compared.


def check_stacks(
    folder: Path, names: Mapping[str, str], *, full: bool, observe: Callable[[str], None]
) -> CheckedComparison:
    """Check a stack with the bundles of its layers; or stacks that were compared, each by itself and all of them.

    Args:
        folder: with stack.json or stacks.json.
        names: hash of each file there.
        full: as in `check_folder`.
        observe: called with the name of each stage as it starts.
    """
    if STACKS not in names:
        return _checked_layers(folder, names, full=full, observe=observe)
    places = sorted(PurePosixPath(name).parent for name in names if PurePosixPath(name).name == STACK)
    own = changes_beside(folder, names, places)
    stacks: list[tuple[str, CheckedComparison]] = []
    for place in places:
        checked = check_folder(folder / place, full=full, observe=observe)
        assert isinstance(checked, CheckedComparison)  # noqa: S101  # It holds stack.json and no plan.json.
        stacks.append((str(place), checked))
    own += stacks_findings(folder, stacks)
    return CheckedComparison(folder, tuple(own), (), stacks=tuple(stacks))


def _checked_layers(
    folder: Path, names: Mapping[str, str], *, full: bool, observe: Callable[[str], None]
) -> CheckedComparison:
    """Check a stack, the lowest layer first."""
    inner, kept = bundles(names), dict[str, StackedLayer]()
    order = sorted(map(str, inner))

    def keep(name: str, planned: Plan) -> None:
        kept[name] = stacked_layer(planned)

    changed = changes_beside(folder, names, inner)
    checked = check_inner(folder, order, full=full, observe=observe, keep=keep)
    found, stack = check_stack(folder, names, checked)
    found += finished_findings(folder, stack, [kept[one] for one in order if one in kept]) if full else []
    said = {finding.file for finding in found}
    own = [*found, *(finding for finding in changed if finding.file not in said)]
    try:
        stack = replace(stack, seen=read_seen(folder))
    except GeoprintError as error:
        own.append(Finding(EVIDENCE, 1, str(error)))
    return CheckedComparison(folder, tuple(own), checked, stack)


def stacks_findings(folder: Path, stacks: Sequence[tuple[str, CheckedComparison]]) -> Iterator[Finding]:
    """Yield what stacks.json says that the stack.json of each backend does not.

    Args:
        folder: of the compared stacks.
        stacks: each of them, by its folder.
    """
    try:
        said = read_record(folder / STACKS, StackComparisonRecord)
    except GeoprintError as error:
        yield Finding(STACKS, 1, str(error))
        return
    every = {name: None if one.stack is None else one.stack.record for name, one in stacks}
    record = {name: one for name, one in every.items() if isinstance(one, StackRecord)}
    planned = [row.backend for row in said.backends if not isinstance(row, RefusedStackRecord)]
    if sorted(planned) != sorted(record):
        yield Finding(STACKS, 1, f"it lists {', '.join(planned)}, the stacks are {', '.join(record) or 'none'}")
        return
    asked = any(not isinstance(row, RefusedStackRecord) and row.printable is not None for row in said.backends)
    rows = [
        row if isinstance(row, RefusedStackRecord) else compared_stack(row.backend, record[row.backend], asked=asked)
        for row in said.backends
    ]
    found = comparison_record(rows, record[planned[0]]).model_copy(update={"version": said.version})
    yield from figures(STACKS, "", as_json(said), as_json(found))


# The table's motion from one layer to the next: from the last attitude of the one to the first of the other.
#
# A layer is planned by itself, as if the table came to its first attitude from rest. In the program of all layers it
# comes from where the layer below has left it, so that this motion is proven here, with all that lies on the part
# then.


@final
@frozen
class LayerMove:
    """How the table comes to a layer.

    Attributes:
        kept: distance that is kept from the arm at home [mm].
        seconds: from the last attitude of the layer below [s].
        from_rest: from rest, as it is planned and reported for the layer by itself [s].
    """

    kept: float
    seconds: float
    from_rest: float


def layer_moves(jobs: Sequence[Job], own: Sequence[OwnProgram]) -> tuple[LayerMove, ...]:
    """Return how a table comes to each layer but the lowest; nothing where the part stands still.

    Args:
        jobs: of each layer, the lowest first.
        own: the programs of all attitudes, in the order of printing.

    Raises:
        ClearanceError: the table cannot be proven to keep clear of the arm at home; the sentence names the layer.
        GeoprintError: as `read_part`, and as `move_clearance`.
    """
    between = [(one, other) for one, other in pairwise(own) if one.layer != other.layer]
    return tuple(_move(jobs[other.layer - 1], one, other) for one, other in between if other.cell.table is not None)


def _move(job: Job, one: OwnProgram, other: OwnProgram) -> LayerMove:
    part = read_part(job)
    with naming(f"layer {other.layer}, which comes upon layer {one.layer} without a rest of the table"):
        kept = move_clearance(
            other.cell,
            before=one.placement,
            stands=other.placement,
            surfaces=(part.base,) if part.body is None else (part.base, part.body),
            place=part.place,
            to=f"attitude 1 of layer {other.layer}",
        )
    before, after, noun = one.placement.table, other.placement.table, other.cell.table
    assert before is not None  # noqa: S101  # As `move_clearance` has asked.
    assert after is not None  # noqa: S101  # As above.
    assert noun is not None  # noqa: S101  # As above.
    table = table_machine(noun)
    rest, last, first = np.eye(4)[None], before.T_table_plate[None], after.T_table_plate[None]
    (seconds,) = sweep_seconds(other.cell, table, Ts_from=last, Ts_to=first)
    (from_rest,) = sweep_seconds(other.cell, table, Ts_from=rest, Ts_to=first)
    return LayerMove(kept, seconds, from_rest)


# What stack.json and stacks.json say, held against the bundles of the layers and the program of all of them.
#
# Each figure of a layer is that of its own plan.json, which is checked by itself; those of the whole follow from
# them and from the program as it was executed. How the finished thickness comes out is simulated again with
# `--full`.


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
    record = stack.record
    if not isinstance(record, StackRecord):
        return
    folders: list[Json] = [name for name, _ in layers]
    yield from figures(STACK, "", {"layers": [one.folder for one in record.layers]}, {"layers": folders})
    plans = [one.record for _, one in layers]
    if len(plans) != len(record.layers) or any(plan is None for plan in plans):
        return
    held = cast("Sequence[PlanRecord]", plans)
    jobs = [planned_job(one.folder, names[name]) for name, one in layers]
    for number, (of, plan, (_, one), job) in enumerate(zip(record.layers, held, layers, jobs, strict=True)):
        yield from figures(STACK, f"layers.{number}", as_json(of), _layer(of, plan, one, job), near=SPEED)
        yield from _volume(of, plan, one, number=number)
    yield from figures(STACK, "", as_json(record), _whole(record, held, jobs))
    yield from _finished_volume(record)
    lit = with_cure(record.model_copy(update={"cure": None, "not_checked": ()}), job_cell(jobs[0]))
    for key in ("cure", "not_checked"):
        yield from figures(STACK, "", {key: as_json(record).get(key)}, {key: as_json(lit).get(key)})
    program, proof = record.program, stack.program.proof
    if (program is None) is not (not own):
        yield Finding(STACK, 1, f"it lists {'no' if program is None else 'a'} program of all layers")
    if program is not None and own and proof is not None:
        found = _program(own, moves, proof, [layer_seconds(plan) for plan in held])
        # How near the table comes is checked by itself, less closely.
        found = found.model_copy(update={"table_kept_mm": program.table_kept_mm})
        yield from figures(STACK, "program", as_json(program), as_json(found))


def _layer(of: StackedLayerRecord, plan: PlanRecord, one: Checked, job: Job) -> dict[str, Json]:
    """Return what is said of a layer, by its own bundle, but for its volume."""
    (layer,) = plan.layers
    # What a layer is slowed down by is its own missing volume: the rest is the speed of all layers.
    asked = planned_cell(job, plan).process.speed
    share = one.setup.cell.process.speed / plan.robot[0].motion.speed_ceiling_mm_s if plan.robot and one.setup else 1.0
    found = layer_record(
        plan,
        folder=of.folder,
        bottom=layer.bottom_mm,
        height=layer.height_mm,
        area=plan.surface.area_mm2,
        pattern=str(job.drawing),
        speed=asked * share,
        deposited=of.laid_mm3,
    )
    return as_json(found)


def _volume(of: StackedLayerRecord, plan: PlanRecord, one: Checked, *, number: int) -> Iterator[Finding]:
    """Yield the volume of a layer that is not what its program deposits."""
    count = len(plan.robot)
    folders = [part_folder(each, count) for each in range(1, count + 1)] or [""]
    shares = [robot.motion.deposited.share if robot.motion.deposited else 0.0 for robot in plan.robot] or [1.0]
    streams: list[PoseStream] = [stream_of(one.folder / folder, plan) for folder in folders]
    deposited = sum(share * deposited_volume(each, each.flow) for share, each in zip(shares, streams, strict=True))
    found: dict[str, Json] = {"laid_mm3": deposited}
    yield from figures(STACK, f"layers.{number}", as_json(of), found, near=VOLUME_SHARE * deposited)


def _whole(record: StackRecord, plans: Sequence[PlanRecord], jobs: Sequence[Job]) -> dict[str, Json]:
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
    numbers: list[Json] = [each.number for each in record.left_out]
    if numbers != [*range(len(plans) + 1, len(plans) + 1 + len(numbers))] or len(plans) + len(numbers) != layer.count:
        found["left_out (numbers)"] = [*range(len(plans) + 1, layer.count + 1)]
    return found


def _finished_volume(record: StackRecord) -> Iterator[Finding]:
    """Yield that the volume of the finished stack is not that of its layers."""
    finished = record.finished.printed
    wanted = record.target_mm3 or sum(layer.wanted_mm3 for layer in record.layers)
    if finished is not None and wanted > 0.0:
        volume: dict[str, Json] = {"volume": sum(layer.laid_mm3 for layer in record.layers) / wanted}
        yield from figures(STACK, "finished.printed", as_json(finished), volume)


def finished_findings(folder: Path, stack: CheckedStack, kept: Sequence[StackedLayer]) -> list[Finding]:
    """Return what is said of the finished thickness that its layers, planned again, do not leave.

    Args:
        folder: of the stack.
        stack: with stack.json.
        kept: what a stack takes of each layer that was planned again.
    """
    record = stack.record
    if not isinstance(record, StackRecord) or len(kept) != len(record.layers):
        return []
    try:
        job = job_of(surface=folder / record.layers[0].folder / JOB).model_copy(update={"layer": None})
        whole = read_stack(job)
        finished = finished_stack(job, whole, kept)
    except GeoprintError as error:
        return [Finding(STACK, 1, f"simulated again: {error}")]
    again: dict[str, Json] = {
        "finished": as_json(finished_record(finished, wanted=wanted_volume(whole.target, record.layers))),
        "thickness_mm": whole.thickness,
        "target_mm3": None if whole.target is None else whole.target.volume,
    }
    said: dict[str, Json] = {**as_json(record)}
    return [*record_findings(STACK, {key: said.get(key) for key in again}, again)]


# The program of a stack, made of what its layers' bundles hold, and read back from the folder in which it lies.


# Distances that are checked again agree with those that are reported to this [mm].
NEAR = 0.01


def own_programs(folder: Path, layers: Sequence[StackedLayerRecord]) -> list[OwnProgram]:
    """Return the own programs of all layers, over a table of all attitudes of each, in the order of printing.

    There are none without a robot.

    Args:
        folder: in which the bundles of the layers stand.
        layers: what is said of them, the lowest first.

    Raises:
        VerificationError: as `own_program`.
    """
    if any(layer.print_s is None for layer in layers):
        return []
    return [
        own_program(folder, str(PurePosixPath(layer.folder, part_folder(attitude, layer.attitudes or 1))), layer=number)
        for number, layer in enumerate(layers, start=1)
        for attitude in range(1, (layer.attitudes or 1) + 1)
    ]


def stack_program(
    own: Sequence[OwnProgram], layers: Sequence[StackedLayerRecord], moves: Sequence[LayerMove], *, part_name: str
) -> tuple[dict[str, bytes], StackProgramRecord | None]:
    """Return name and content of the files of a stack's program, and what is reported of it; nothing without a robot.

    Args:
        own: as `own_programs`.
        layers: what is said of the layers, the lowest first.
        moves: how a table comes to each but the lowest; none where the part stands still.
        part_name: for the header.

    Raises:
        VerificationError: the program, read back and executed, is not what its layers are.
    """
    if not own:
        return {}, None
    modules, beside, proof = joining_of(own[0].cell).join(own, part_name=part_name)
    folder = post_processor_name(own[0].cell)
    files = {f"{folder}/{name}": text.encode("ascii") for name, text in (modules | beside).items()}
    return files, _program(own, moves, proof, [layer.print_s for layer in layers])


def _program(
    own: Sequence[OwnProgram], moves: Sequence[LayerMove], proof: StackProof, seconds: Sequence[float | None]
) -> StackProgramRecord:
    """Return what is said of the program of layers, each of which takes so many seconds."""
    cell = own[0].cell
    printing = sum(each or 0.0 for each in seconds) + sum(move.seconds - move.from_rest for move in moves)
    return StackProgramRecord(
        file=joined_file(cell),
        pause_s=cell.process.layer_pause,
        print_s=printing + cell.process.layer_pause * (len(seconds) - 1),
        table_kept_mm=_kept(moves),
        runs_dry_only=bool(own[0].placement.missing),
        scenarios=proof.scenarios,
        refused=proof.refused,
        lines_with_statements=proof.statements,
        lines_executed=proof.executed,
    )


def check_stack(
    folder: Path, names: Iterable[str], layers: Sequence[tuple[str, Checked]]
) -> tuple[list[Finding], CheckedStack]:
    """Check the record and the program of a stack on the disk against those of its layers, executed.

    No layer's bundle tells how a table comes from layer to layer, so that this is proven to be clear of the arm anew.

    Args:
        folder: of the stack.
        names: of all that its manifest lists.
        layers: folder and bundle of each, checked; nothing is held against those that are not as they were planned.

    Returns:
        What is wrong, and what a person reads of it.
    """
    record: StackRecord | None = None
    try:
        record = read_record(folder / STACK, StackRecord)
        if any(one.findings for _, one in layers):
            reason = "a layer differs from its plan, so the stack was not compared with it"
            return [Finding(STACK if record.program is None else record.program.file, 1, reason)], _checked(
                record, CheckedParts()
            )
        own = own_programs(folder, record.layers)
        findings: list[Finding] = []
        stack, moves = _checked(record, CheckedParts()), ()
        if own:
            found, stack, moves = _program_findings(folder, names, record, own)
            findings += found
        of_each = {name: _below(names, name) for name, _ in layers}
        findings += stack_findings(stack, layers, own, moves, names=of_each)
    except GeoprintError as error:
        return [Finding(STACK, 1, str(error))], _checked(record, CheckedParts())
    return findings, stack


def _checked(record: StackRecord | None, program: CheckedParts) -> CheckedStack:
    """Return what is said of a stack by its record, None where that cannot be read, and what its program did."""
    listed = "layer", "the lowest first"
    if record is None:
        return CheckedStack(None, listed)
    sheet = tuple((label, tuple(texts)) for label, texts in stack_sheet(record, program))
    one, _ = printed_parts(record.layers)
    return CheckedStack(record, listed, f"{record.part}, layer upon layer", sheet, one, program)


def _below(names: Iterable[str], folder: str) -> dict[str, str]:
    """Return the names below a folder, without it."""
    return {name.removeprefix(f"{folder}/"): "" for name in names if name.startswith(f"{folder}/")}


def _program_findings(
    folder: Path, names: Iterable[str], record: StackRecord, own: Sequence[OwnProgram]
) -> tuple[list[Finding], CheckedStack, tuple[LayerMove, ...]]:
    """Return what is wrong with the program of a stack, what it did, and how a table comes to its layers."""
    names = [*names]
    findings, program = check_parts(folder, names, own)
    moves: tuple[LayerMove, ...] = ()
    try:
        moves = layer_moves([job_of(surface=folder / layer.folder / JOB) for layer in record.layers], own)
    except GeoprintError as error:
        findings.append(Finding(joined_file(own[0].cell), 1, str(error)))
    else:
        findings += _kept_findings(record, moves)
    last = read_setup(folder / own[-1].folder / "setup.json")
    placed = replace(last, placement=own[0].placement)
    findings += controller_files_findings(
        folder, dict.fromkeys(names, ""), placed, modules=names, folders=[one.folder for one in own]
    )
    findings += joined_header_findings(
        folder,
        part=record.part,
        version=record.version,
        cell=last.cell,
        layers=[one.layer for one in own],
        tilted=own[0].placement.table is not None,
    )
    return findings, _checked(record, program), moves


def _kept_findings(record: StackRecord, moves: Sequence[LayerMove]) -> Iterator[Finding]:
    """Yield that a table comes otherwise than is reported from layer to layer."""
    said, kept = None if record.program is None else record.program.table_kept_mm, _kept(moves)
    if (said is None) is not (kept is None) or abs((said or 0.0) - (kept or 0.0)) > NEAR:
        yield Finding(STACK, 1, f"program.table_kept_mm is {said}, checked again it is {kept}")


def _kept(moves: Sequence[LayerMove]) -> float | None:
    """Return what a table keeps from the arm at least as it comes to a layer [mm]; None where the part stands still."""
    return min((move.kept for move in moves), default=None)
