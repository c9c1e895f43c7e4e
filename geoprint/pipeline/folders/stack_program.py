"""The program of a stack, made of what its layers' bundles hold, and read back from the folder in which it lies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

from geoprint.account.checked import Checked, CheckedStack, Finding
from geoprint.account.prints.attitudes import JOINED_LIST
from geoprint.account.records.rounding import read_record
from geoprint.account.records.stack import StackedLayerRecord, StackProgramRecord, StackRecord
from geoprint.account.robot_summary import program_digest
from geoprint.config import job_of
from geoprint.errors import GeoprintError
from geoprint.export import read_setup
from geoprint.export.rapid.stacks import OwnProgram, judge_stack, together
from geoprint.pipeline.bundles.again import JOB
from geoprint.pipeline.bundles.contents import RAPID_FOLDER, STACK
from geoprint.pipeline.bundles.figures import controller_files_findings, joined_header_findings
from geoprint.pipeline.bundles.joined import (
    own_program,
    program_finding,
    program_modules,
    resident_findings,
)
from geoprint.pipeline.folders.layer_moves import LayerMove, layer_moves
from geoprint.pipeline.folders.stack_record import stack_findings
from geoprint.pipeline.tilting import part_folder

# Distances that are checked again agree with those that are told to this [mm].
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
    """Return name and content of the files of a stack's program, and what is told of it; nothing without a robot.

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
    modules, beside, proof = together(own, part_name=part_name)
    files = {f"{RAPID_FOLDER}/{name}": text.encode("ascii") for name, text in (modules | beside).items()}
    pause = own[0].cell.process.layer_pause
    printing = sum(layer.print_s or 0.0 for layer in layers) + sum(move.seconds - move.from_rest for move in moves)
    return files, StackProgramRecord(
        file=JOINED_LIST,
        pause_s=pause,
        print_s=printing + pause * (len(layers) - 1),
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
    told: StackRecord | None = None
    try:
        told = read_record(folder / STACK, StackRecord)
        if any(one.findings for _, one in layers):
            reason = "a layer is not as it was planned, so that nothing of the stack was held against it"
            return [Finding(STACK if told.program is None else JOINED_LIST, 1, reason)], CheckedStack(told)
        own = own_programs(folder, told.layers)
        findings: list[Finding] = []
        stack, moves = CheckedStack(told), ()
        if own:
            found, stack, moves = _program_findings(folder, names, told, own)
            findings += found
        of_each = {name: _below(names, name) for name, _ in layers}
        findings += stack_findings(stack, layers, own, moves, names=of_each)
    except GeoprintError as error:
        return [Finding(STACK, 1, str(error))], CheckedStack(told)
    return findings, stack


def _below(names: Iterable[str], folder: str) -> dict[str, str]:
    """Return the names below a folder, without it."""
    return {name.removeprefix(f"{folder}/"): "" for name in names if name.startswith(f"{folder}/")}


def _program_findings(
    folder: Path, names: Iterable[str], told: StackRecord, own: Sequence[OwnProgram]
) -> tuple[list[Finding], CheckedStack, tuple[LayerMove, ...]]:
    """Return what is wrong with the program of a stack, what it did, and how a table comes to its layers."""
    modules = dict(program_modules(folder, names))
    judged = judge_stack(modules, own)
    findings = [*resident_findings(folder, own[0]), *map(program_finding, judged.findings)]
    moves: tuple[LayerMove, ...] = ()
    try:
        moves = layer_moves([job_of(surface=folder / layer.folder / JOB) for layer in told.layers], own)
    except GeoprintError as error:
        findings.append(Finding(JOINED_LIST, 1, str(error)))
    else:
        findings += _kept_findings(told, moves)
    last = read_setup(folder / own[-1].folder / "setup.json")
    placed = replace(last, placement=own[0].placement)
    loading = any(PurePosixPath(name).name.startswith("GeoPath") for name in modules)
    findings += controller_files_findings(
        folder, dict.fromkeys(names, ""), placed, loading=loading, folders=[one.folder for one in own]
    )
    findings += joined_header_findings(
        folder,
        part=told.part,
        version=told.version,
        cell=last.cell,
        layers=[one.layer for one in own],
        tilted=own[0].placement.table is not None,
    )
    digest = program_digest(modules.items())
    stack = CheckedStack(told, settings=judged.settings, proof=judged.proof, program_sha256=digest)
    return findings, stack, moves


def _kept_findings(told: StackRecord, moves: Sequence[LayerMove]) -> Iterator[Finding]:
    """Yield that a table comes otherwise than is told from layer to layer."""
    said, kept = None if told.program is None else told.program.table_kept_mm, _kept(moves)
    if (said is None) is not (kept is None) or abs((said or 0.0) - (kept or 0.0)) > NEAR:
        yield Finding(STACK, 1, f"program.table_kept_mm is {said}, checked again it is {kept}")


def _kept(moves: Sequence[LayerMove]) -> float | None:
    """Return what a table keeps from the arm at least as it comes to a layer [mm]; None where the part stands still."""
    return min((move.kept for move in moves), default=None)
