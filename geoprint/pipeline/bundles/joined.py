"""The program of all attitudes of a table, read back from a bundle and held against those of each and the paths."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from geoprint.account.checked import CheckedJoined, Finding
from geoprint.account.prints.attitudes import JOINED_LIST
from geoprint.account.records.plan import PlanRecord
from geoprint.account.robot_summary import program_digest
from geoprint.errors import GeoprintError, VerificationError
from geoprint.export import read_setup
from geoprint.export.rapid import CONTROLLER_FOLDER, RESIDENT, check_resident
from geoprint.export.rapid.stacks import OwnProgram, judge_stack
from geoprint.paths import check_sum
from geoprint.pipeline.bundles.contents import RAPID_FOLDER
from geoprint.pipeline.bundles.paths import stream_of
from geoprint.pipeline.tilting import PART


def check_joined(folder: Path, names: Iterable[str], told: PlanRecord) -> CheckedJoined:
    """Check the program of all attitudes of a bundle, and that what they lay is together what the paths ask for.

    Args:
        folder: the bundle.
        names: of its files.
        told: what its plan.json says.
    """
    findings: list[Finding] = []
    try:
        own = [own_program(folder, f"{PART}{number}", layer=1) for number, _ in enumerate(told.robot, start=1)]
        findings += resident_findings(folder, own[-1])
        _check_laid(folder, told)
        modules = dict(program_modules(folder, names))
        judged = judge_stack(modules, own)
    except GeoprintError as error:
        return CheckedJoined((*findings, program_finding(error)), None, None, "")
    findings += [program_finding(error) for error in judged.findings]
    return CheckedJoined(tuple(findings), judged.settings, judged.proof, program_digest(modules.items()))


def _check_laid(folder: Path, told: PlanRecord) -> None:
    parts = [stream_of(folder / f"{PART}{number}", told) for number, _ in enumerate(told.robot, start=1)]
    check_sum(stream_of(folder, told), parts)


def own_program(folder: Path, part: str, *, layer: int) -> OwnProgram:
    """Return the program of a layer of a stack, or of an attitude of a table, from the folder of either.

    Args:
        folder: of the bundle, or of the stack.
        part: of that folder, with a setup and a program of its own.
        layer: number of the layer that it prints; those of one bundle print one.

    Raises:
        VerificationError: its setup or a module cannot be read.
    """
    setup = read_setup(folder / part / "setup.json")
    try:
        paths = sorted((folder / part / RAPID_FOLDER).glob("*.mod"))
        modules = tuple((path.name, path.read_bytes().decode("latin-1")) for path in paths)
    except OSError as error:
        raise VerificationError(f"{folder / part / RAPID_FOLDER} cannot be read ({error.strerror}).") from error
    return OwnProgram(layer, part, modules, setup.cell, setup.placement)


def program_modules(folder: Path, names: Iterable[str]) -> Iterable[tuple[str, str]]:
    """Yield path within the folder of the program and text of its files that exist, without the controller's."""
    for name in names:
        path = PurePosixPath(name)
        if path.parts[0] == RAPID_FOLDER and path.parts[1] != CONTROLLER_FOLDER and (folder / name).is_file():
            yield str(path.relative_to(RAPID_FOLDER)), (folder / name).read_bytes().decode("latin-1")


def resident_findings(folder: Path, own: OwnProgram) -> Iterable[Finding]:
    """Yield what is wrong with the module that stays on the controller, where the folder brings it."""
    path = folder / RAPID_FOLDER / RESIDENT
    try:
        if path.is_file():
            check_resident(path.read_bytes().decode("latin-1"), cell=own.cell, placement=own.placement)
    except VerificationError as error:
        yield program_finding(error)


def program_finding(error: GeoprintError) -> Finding:
    """Return what an error says; it names a module and its line."""
    module, line, reason = (error.details.get(name) for name in ("module", "line", "reason"))
    name = f"{RAPID_FOLDER}/{module}" if isinstance(module, str) else JOINED_LIST
    return Finding(name, line if isinstance(line, int) else 1, reason if isinstance(reason, str) else str(error))
