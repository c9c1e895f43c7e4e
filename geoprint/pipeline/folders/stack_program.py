"""The program of a stack, made of what its layers' bundles hold, and read back from the folder in which it lies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path, PurePosixPath

from geoprint.account.checked import CheckedStack, Finding
from geoprint.account.records.rounding import read_record
from geoprint.account.records.stack import StackedLayerRecord, StackProgramRecord, StackRecord
from geoprint.account.robot_summary import program_digest
from geoprint.errors import GeoprintError, VerificationError
from geoprint.export import read_setup
from geoprint.export.rapid import CONTROLLER_FOLDER, RESIDENT, check_resident, controller_files
from geoprint.export.rapid.stacks import (
    OwnProgram,
    StackProof,
    judge_stack,
    stack_files,
    stacked_layer,
    verify_stack,
)
from geoprint.pipeline.bundles.contents import RAPID_FOLDER, STACK

# What a person loads.
_LIST = f"{RAPID_FOLDER}/GeoStack.pgf"


def stack_program(
    folder: Path, layers: Sequence[StackedLayerRecord], *, part_name: str
) -> tuple[dict[str, bytes], StackProgramRecord | None]:
    """Return name and content of the files of a stack's program, and what is told of it; nothing without a robot.

    Args:
        folder: in which the bundles of the layers stand.
        layers: what is said of them, the lowest first.
        part_name: for the header.

    Raises:
        VerificationError: the program, read back and executed, is not what its layers are.
    """
    if any(layer.print_s is None for layer in layers):
        return {}, None
    own = [_own_program(folder, layer.folder) for layer in layers]
    cell, placement = own[0].cell, own[0].placement
    made = [
        stacked_layer(one.modules, number=number, folder=one.folder, cell=one.cell, placement=placement)
        for number, one in enumerate(own, start=1)
    ]
    modules = dict(stack_files(made, cell=cell, placement=placement, part_name=part_name))
    proof = verify_stack(modules, own)
    loading = any(PurePosixPath(name).name.startswith("GeoPath") for name in modules)
    kept = controller_files(cell, placement=placement, loading=loading, layers=len(layers))
    modules |= {f"{CONTROLLER_FOLDER}/{name}": text for name, text in kept.items()}
    files = {f"{RAPID_FOLDER}/{name}": text.encode("ascii") for name, text in modules.items()}
    return files, _record(proof, layers, pause=cell.process.layer_pause, dry=bool(placement.missing))


def check_stack(folder: Path, names: Iterable[str], *, sound: bool) -> tuple[list[Finding], CheckedStack]:
    """Check the program of a stack on the disk against those of its layers, executed.

    Args:
        folder: of the stack.
        names: of all that its manifest lists.
        sound: whether the bundles of its layers are as they were planned: nothing is held against others.

    Returns:
        What is wrong, and what a person reads of it.
    """
    told: StackRecord | None = None
    try:
        told = read_record(folder / STACK, StackRecord)
        if told.program is None:
            return [], CheckedStack(told)
        if not sound:
            reason = "a layer is not as it was planned, so that the program of the stack was not held against it"
            return [Finding(_LIST, 1, reason)], CheckedStack(told)
        own = [_own_program(folder, layer.folder) for layer in told.layers]
        findings = [*_resident_findings(folder, own[0])]
        modules = dict(_modules(folder, names))
        judged = judge_stack(modules, own)
    except GeoprintError as error:
        return [Finding(STACK, 1, str(error))], CheckedStack(told)
    findings += [_finding(error) for error in judged.findings]
    executed = () if judged.proof is None else judged.proof.scenarios
    digest = program_digest(modules.items())
    return findings, CheckedStack(told, settings=judged.settings, scenarios=executed, program_sha256=digest)


def _own_program(folder: Path, layer: str) -> OwnProgram:
    """Return the program in the bundle of a layer.

    Raises:
        VerificationError: its setup or a module cannot be read.
    """
    setup = read_setup(folder / layer / "setup.json")
    try:
        paths = sorted((folder / layer / RAPID_FOLDER).glob("*.mod"))
        modules = tuple((path.name, path.read_bytes().decode("latin-1")) for path in paths)
    except OSError as error:
        raise VerificationError(f"{folder / layer / RAPID_FOLDER} cannot be read ({error.strerror}).") from error
    return OwnProgram(layer, modules, setup.cell, setup.placement)


def _record(proof: StackProof, layers: Sequence[StackedLayerRecord], *, pause: float, dry: bool) -> StackProgramRecord:
    printing = sum(layer.print_s or 0.0 for layer in layers)
    return StackProgramRecord(
        file=_LIST,
        pause_s=pause,
        print_s=printing + pause * (len(layers) - 1),
        runs_dry_only=dry,
        scenarios=proof.scenarios,
        refused=proof.refused,
        lines_with_statements=proof.statements,
        lines_executed=proof.executed,
    )


def _modules(folder: Path, names: Iterable[str]) -> Iterable[tuple[str, str]]:
    """Yield path within the folder of the program and text of its files that exist, without the controller's."""
    for name in names:
        path = PurePosixPath(name)
        if path.parts[0] == RAPID_FOLDER and path.parts[1] != CONTROLLER_FOLDER and (folder / name).is_file():
            yield str(path.relative_to(RAPID_FOLDER)), (folder / name).read_bytes().decode("latin-1")


def _resident_findings(folder: Path, own: OwnProgram) -> Iterable[Finding]:
    path = folder / RAPID_FOLDER / RESIDENT
    try:
        if path.is_file():
            check_resident(path.read_bytes().decode("latin-1"), cell=own.cell, placement=own.placement)
    except VerificationError as error:
        yield _finding(error)


def _finding(error: VerificationError) -> Finding:
    """Return what an error says; it names a module and its line."""
    module, line, reason = (error.details.get(name) for name in ("module", "line", "reason"))
    name = f"{RAPID_FOLDER}/{module}" if isinstance(module, str) else _LIST
    return Finding(name, line if isinstance(line, int) else 1, reason if isinstance(reason, str) else str(error))
