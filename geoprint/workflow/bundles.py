"""Bundles on disk: what a folder of geoprint holds, the paths in it, and evidence that people add."""

from __future__ import annotations

import json
import os
import secrets
import stat
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path, PurePosixPath

import numpy as np

from geoprint.errors import ExportError, GeoprintError, InputError, UsageError, VerificationError, how_many, reason_of
from geoprint.geometry import closest
from geoprint.geometry.files import load
from geoprint.model import Cell, FloatArray, PoseStream
from geoprint.postprocessor import (
    EVIDENCE,
    MANIFEST,
    PLAN,
    TIMINGS,
    OwnProgram,
    json_bytes,
    read_poses_table,
    read_setup,
)
from geoprint.postprocessor.interface import CONTROLLER_FOLDER
from geoprint.postprocessor.registry import (
    is_as_written,
    joined_file,
    joining_of,
    post_processor_name,
    post_processor_names,
)
from geoprint.reporting import read_record
from geoprint.reporting.check import Checked, CheckedComparison, CheckedParts, Finding
from geoprint.reporting.records.evidence import EVIDENCE_SCHEMA, STAGES, SeenFile, SeenRecord
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import as_json
from geoprint.reporting.robot_summary import program_digest
from geoprint.toolpath import check_sum
from geoprint.workflow.tilting import PART

# What a folder of geoprint holds by its manifest: one bundle or those of a comparison, and what has changed in it.
#
# A folder is foreign input, whoever wrote its manifest: nothing in it is opened before it is known to be a plain
# file of bounded size with a name that any system takes. A link could lead anywhere, and a pipe would be waited for.


# What stands beside the bundles of a comparison.
COMPARISON = "compare.json"
REPORT = "report.html"
# Files of a folder, and letters of a name and of each part of it, at most: what file systems take.
MOST_FILES, LONGEST_NAME, LONGEST_PART = 20_000, 1_000, 200
# Size of a file at most [bytes]: of a mesh and of a table, for a trajectory of three hours has 1 GB, and of any other.
LARGEST, LARGEST_TEXT = 2 << 30, 64 << 20
_LARGE = frozenset({".csv", ".ply"})
# What a person asks for who named another folder.
WHICH_FOLDER = "give the folder that `geoprint plan --out` wrote, or one of a backend below that of `geoprint compare`"


def listed(folder: Path) -> dict[str, str]:
    """Return the hash of each file that the manifest lists: the folder's own, or that of the comparison it is in.

    Raises:
        InputError: there is no such folder, or geoprint did not write it.
    """
    if not os.path.isdir(folder):  # noqa: PTH112  (a name that no folder can have is none, too)
        raise InputError(f"there is no folder {folder}; {WHICH_FOLDER}.")
    try:
        place = next(place for place in (folder, *folder.absolute().parents[:2]) if os.path.lexists(place / MANIFEST))
        below = folder.absolute().relative_to(place.absolute())
        if reason := _unfit(place, MANIFEST):
            raise InputError(f"{folder} is not a bundle of geoprint: its {MANIFEST} {reason}; {WHICH_FOLDER}.")
        hashes = dict(json.loads((place / MANIFEST).read_bytes())["sha256"])
        paths = {PurePosixPath(str(name)): str(digest) for name, digest in hashes.items()}
        names = {str(path.relative_to(below)): digest for path, digest in paths.items() if path.is_relative_to(below)}
    except StopIteration:
        raise InputError(f"{folder} is not a bundle of geoprint: it has no {MANIFEST}; {WHICH_FOLDER}.") from None
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(
            f"{folder} is not a bundle of geoprint: its {MANIFEST} cannot be read ({reason_of(error)}); {WHICH_FOLDER}."
        ) from error
    if not names:
        raise InputError(
            f"{folder} is not a bundle of geoprint: the {MANIFEST} above it lists none here; {WHICH_FOLDER}."
        )
    return names


def listed_bundle(folder: Path) -> dict[str, str]:
    """Return what `listed` does of a folder that holds a single bundle, of which every file may be opened.

    Raises:
        InputError: it is none, or holds several, and the sentence names these; or as `foreign` finds it.
    """
    names = listed(folder)
    for finding in foreign(folder, names):
        raise InputError(f"{folder / finding.file}: {finding.reason}; restore the file that geoprint wrote.")
    if PLAN not in names:
        found = " or ".join(str(folder / one) for one in bundles(names))
        one = f"name one of them, {found}" if found else WHICH_FOLDER
        raise InputError(f"{folder} holds several bundles; {one}.")
    return names


def bundles(names: Iterable[str]) -> list[PurePosixPath]:
    """Return the folders of the bundles among listed names, in their order there."""
    return [PurePosixPath(name).parent for name in names if PurePosixPath(name).name == PLAN]


def part_folders(names: Sequence[str]) -> list[str]:
    """Return the folder of each compared part, after its file, with a slash: none for one; equal ones are numbered."""
    if len(names) == 1:
        return [""]
    seen: Counter[str] = Counter()
    folders: list[str] = []
    for name in names:
        stem = Path(name).stem
        seen[stem] += 1
        folders.append(f"{stem}/" if seen[stem] == 1 else f"{stem}-{seen[stem]}/")
    return folders


def foreign(folder: Path, names: Iterable[str]) -> list[Finding]:
    """Return what of a folder must not be opened: names that no file has, and what is no plain file of bounded size.

    Looked at are the files that the manifest lists, those that it may leave out, and all that lies beside a program.

    Args:
        folder: of the manifest, or below it.
        names: of its files.
    """
    every = list(names)
    if len(every) > MOST_FILES:
        return [Finding(MANIFEST, 1, f"it lists {how_many(len(every), 'file')}, allowed are {MOST_FILES}")]
    findings = [Finding(MANIFEST, 1, reason) for name in every if (reason := _unfit_name(name))]
    if findings:
        return findings
    places = {PurePosixPath(name).parent for name in every if PurePosixPath(name).name == PLAN}
    beside = {str(place / name) for place in {PurePosixPath(), *places} for name in (EVIDENCE, TIMINGS)}
    lying = {name for name in (*_beside_programs(folder, every), *beside) if os.path.lexists(folder / name)}
    looked_at = [*every, *sorted(lying - set(every))]
    return [Finding(name, 1, reason) for name in looked_at if (reason := _unfit(folder, name))]


def _unfit_name(name: str) -> str | None:
    """Return why no file of a bundle can have a name, or None."""
    path, shown = PurePosixPath(name), name[:60]
    if len(name) > LONGEST_NAME or any(len(part) > LONGEST_PART for part in path.parts):
        return (
            f"it lists a name of {len(name)} letters, {shown!r}..., allowed are {LONGEST_NAME}, and {LONGEST_PART} of "
            "a folder or file"
        )
    if not path.parts or path.is_absolute() or ".." in path.parts or "\\" in name or not name.isprintable():
        return f"it lists {shown!r}, which is not a file name in this folder"
    return None


def _unfit(folder: Path, name: str) -> str | None:
    """Return why a file must not be opened: it or a folder on its way is none; None where it may, or is missing."""
    path, place = folder / name, folder
    try:
        for part in PurePosixPath(name).parts[:-1]:
            place = place / part
            if not stat.S_ISDIR(place.lstat().st_mode):
                return f"its folder {place.name} is not a regular folder: a bundle has no links"
        found = path.lstat()
    except OSError:
        return None
    if not stat.S_ISREG(found.st_mode):
        return f"this is {_kind(found.st_mode)}, not a regular file, and is not opened"
    most = LARGEST if path.suffix in _LARGE else LARGEST_TEXT
    return f"the file has {found.st_size} bytes, allowed are {most}" if found.st_size > most else None


def _kind(mode: int) -> str:
    kinds = {stat.S_ISLNK: "a link", stat.S_ISDIR: "a folder", stat.S_ISFIFO: "a pipe", stat.S_ISSOCK: "a socket"}
    return next((word for is_one, word in kinds.items() if is_one(mode)), "a device")


def _beside_programs(folder: Path, names: Iterable[str]) -> Iterator[str]:
    """Yield all that lies in the folders of programs, without following a link; a bound ends it."""
    paths = [PurePosixPath(name) for name in names]
    known = post_processor_names()
    places = {
        PurePosixPath(*path.parts[: path.parts.index(name) + 1])
        for path in paths
        for name in known
        if name in path.parts[:-1]
    }
    count = 0
    for place in sorted({*map(PurePosixPath, known), *places}):
        for root, folders, files in os.walk(folder / place, followlinks=False):
            linked = [name for name in folders if os.path.islink(os.path.join(root, name))]  # noqa: PTH114, PTH118
            for name in (*linked, *files):
                count += 1
                if count > MOST_FILES:
                    return
                yield Path(root, name).relative_to(folder).as_posix()


def changes(folder: Path, names: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield name and reason for each listed file that is not as it was written, and for modules that nobody lists.

    The switches of a program may be set as its run sheet asks.
    """
    for name, digest in names.items():
        path = folder / name
        if not path.is_file():
            yield name, "the file is missing"
        elif not is_as_written(path, digest):
            yield name, "the file was changed after it was written: its hash differs from the manifest"
    for name in sorted(_beside_programs(folder, names)):
        if name not in names:
            yield name, "the manifest does not list this file"


# The paths of a bundle by its own tables: on its surface, and as long and as many as plan.json says.


# What is deposited lies on the surface to this [mm]: both are written to six decimals or better, and a rounded corner
# cuts through no more than its triangles' curvature.
ON_SURFACE = 0.01
# Lengths that are summed over rows of six decimals agree to this [mm] and this share.
LENGTH_TOLERANCE, LENGTH_SHARE = 1e-3, 1e-6


def stream_of(folder: Path, record: PlanRecord) -> PoseStream:
    """Return the pose stream that a bundle's poses.csv holds; where the tool stops it does not say.

    Raises:
        VerificationError: it cannot be read.
        InputError: it is no stream of poses.
    """
    table = read_poses_table(folder / "poses.csv")
    (layer,) = record.layers
    # The paths of a layer of several lie in its middle.
    standoff = record.settings.standoff_mm - (layer.height_mm / 2.0 if is_layer(record) else 0.0)
    normals = _unit(table.normals)
    return PoseStream(
        tips=table.points + np.where(table.deposit, standoff, 0.0)[:, None] * normals,
        quaternions=_unit(table.quaternions),
        normals=normals,
        runs=table.runs,
        levels=table.levels,
        layers=table.layers,
        deposit=table.deposit,
        stops=np.zeros(table.runs.size, dtype=np.bool_),
        arcs=table.arcs,
        flow=table.flow,
        standoff=standoff,
    )


def is_layer(record: PlanRecord) -> bool:
    """Return whether a plan is of a layer over the part."""
    return as_json(record.settings).get("layer") is not None


def path_findings(folder: Path, record: PlanRecord) -> Iterator[Finding]:
    """Yield where the paths leave the surface that they were planned on, and which figures of plan.json are not theirs.

    Raises:
        VerificationError: a table cannot be read.
        InputError: surface.ply or poses.csv holds something else.
    """
    stream = stream_of(folder, record)
    deposited = np.flatnonzero(stream.deposit)
    _, misses = closest(load(folder / "surface.ply", unit="mm"), stream.surface_points[deposited])
    if misses.max(initial=0.0) > ON_SURFACE:
        worst = int(misses.argmax())
        yield Finding(
            "poses.csv",
            int(deposited[worst]) + 2,
            f"the pose lies {misses[worst]:.3f} mm off surface.ply, allowed are {ON_SURFACE} mm",
        )
    lengths = np.linalg.norm(np.diff(stream.tips, axis=0), axis=1)
    found = {
        "runs": float(np.unique(stream.runs).size),
        "poses": float(stream.count),
        "deposit_mm": float(lengths[stream.deposited].sum()),
        "travel_mm": float(lengths[~stream.deposited].sum()),
    }
    for name, value in found.items():
        said = float(getattr(record.paths, name))
        if abs(value - said) > LENGTH_TOLERANCE + LENGTH_SHARE * abs(said):
            yield Finding(PLAN, 1, f"paths.{name} is {said:.10g}, by poses.csv it is {value:.10g}")


def _unit(rows: FloatArray) -> FloatArray:
    """Return rows of nine decimals at unit length again."""
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


# evidence.json: what people saw the program of a bundle or of a stack do, beside what the manifest lists.


def read_seen(folder: Path) -> tuple[SeenRecord, ...]:
    """Return what people saw of a bundle, in the order in which they recorded it; nothing where nobody did.

    Raises:
        VerificationError: evidence.json cannot be read.
    """
    path = folder / EVIDENCE
    return read_record(path, SeenFile).seen if path.exists() else ()


def record_seen(
    checked: Checked | CheckedComparison,
    stage: str,
    *,
    note: str,
    controller: str | None = None,
    when: datetime | None = None,
) -> SeenRecord:
    """Record what a person saw the program of a bundle, or of a stack, do.

    Args:
        checked: the folder, just checked.
        stage: 'loaded' (on a virtual controller), 'dry' or 'printed'.
        note: what was seen.
        controller: its name and RobotWare release.
        when: the time, with its offset; now if not given.

    Raises:
        UsageError: the stage is unknown, the note empty, there is no program or several, or one that runs only dry was
            printed.
        VerificationError: the folder is not as it was planned, or evidence.json cannot be read.
        ExportError: it cannot be written.
    """
    if stage not in STAGES:
        raise UsageError(f"`--record {stage}` is unknown; what people see is one of {', '.join(STAGES)}.")
    if not note.strip():
        raise UsageError("state what you saw: `--note` with a few words, such as who watched.")
    there, sha256, stated_by_nobody = _program(checked)
    if not there:
        raise UsageError(f"{checked.folder} holds no program, so nobody can have seen it run.")
    if checked.findings:
        raise VerificationError(
            f"{checked.folder} differs from the plan that was made ({checked.findings[0].file}: "
            f"{checked.findings[0].reason}): what was seen of it is not recorded; `geoprint check` lists all."
        )
    if stage == "printed" and stated_by_nobody:
        missing = " and ".join(stated_by_nobody)
        raise UsageError(f"this program only runs dry, because {missing} is not stated: it cannot have printed.")
    seen = SeenRecord(
        stage=stage,
        date=(when or datetime.now().astimezone()).isoformat(timespec="seconds"),
        controller=(controller or "").strip() or None,
        note=note.strip(),
        program_sha256=sha256,
    )
    _write(checked.folder, SeenFile(schema=EVIDENCE_SCHEMA, seen=(*read_seen(checked.folder), seen)))
    return seen


def _program(checked: Checked | CheckedComparison) -> tuple[bool, str, Sequence[str]]:
    """Return whether a folder holds one program, its hash, and what nobody has stated of where the part stands."""
    if isinstance(checked, Checked):
        missing = () if checked.setup is None else checked.setup.placement.missing
        return checked.program, checked.program_sha256, missing
    stack = checked.stack
    if stack is None:
        named = ", ".join(name for name, _ in (*checked.bundles, *checked.stacks))
        raise UsageError(f"{checked.folder} holds several bundles: name the one whose program you saw, of {named}.")
    # All layers stand where the part stands.
    setups = [one.setup for _, one in checked.bundles if one.setup is not None]
    there = stack.record is None or bool(stack.sheet)
    return there, stack.program.program_sha256, setups[0].placement.missing if setups else ()


def _write(folder: Path, content: SeenFile) -> None:
    """Replace evidence.json in one step."""
    path = folder / EVIDENCE
    trial = folder / f".{EVIDENCE}.{os.getpid()}-{secrets.token_hex(4)}"
    try:
        with trial.open("xb") as handle:
            handle.write(json_bytes(as_json(content)))
            handle.flush()
            os.fsync(handle.fileno())
        trial.replace(path)
    except OSError as error:
        trial.unlink(missing_ok=True)
        raise ExportError(f"{path} cannot be written ({error.strerror}); make room, or check its rights.") from error


# The program of all attitudes of a table, read back from a bundle and held against those of each and the paths.


def check_joined(folder: Path, names: Iterable[str], record: PlanRecord) -> tuple[list[Finding], CheckedParts]:
    """Check the program of all attitudes of a bundle, and that what they lay is together what the paths ask for.

    Args:
        folder: the bundle.
        names: of its files.
        record: what its plan.json says.

    Returns:
        What is wrong, and what it did.
    """
    try:
        own = [own_program(folder, f"{PART}{number}", layer=1) for number, _ in enumerate(record.robot, start=1)]
        _check_deposited(folder, record)
        return check_parts(folder, names, own)
    except GeoprintError as error:
        file = PLAN if record.joined is None else record.joined.file
        return [program_finding(error, str(PurePosixPath(file).parent), file=file)], CheckedParts()


def check_parts(folder: Path, names: Iterable[str], own: Sequence[OwnProgram]) -> tuple[list[Finding], CheckedParts]:
    """Check a program of several parts against those of each, executed.

    Args:
        folder: of the bundle, or of the stack.
        names: of its files.
        own: the programs of its parts, in the order of printing.

    Returns:
        What is wrong, and what it did.

    Raises:
        GeoprintError: it cannot be judged at all.
    """
    cell = own[-1].cell
    name = post_processor_name(cell)
    modules = dict(program_modules(folder, names, name))
    wrong, proof, settings = joining_of(cell).judge(modules, own, kept=kept_files(folder, name))
    findings = [program_finding(error, name, file=joined_file(cell)) for error in wrong]
    return findings, CheckedParts(settings, proof, program_digest(modules.items(), name))


def _check_deposited(folder: Path, record: PlanRecord) -> None:
    parts = [stream_of(folder / f"{PART}{number}", record) for number, _ in enumerate(record.robot, start=1)]
    check_sum(stream_of(folder, record), parts)


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
    return OwnProgram(layer, part, program_files(folder / part, setup.cell), setup.cell, setup.placement)


def program_files(folder: Path, cell: Cell) -> tuple[tuple[str, str], ...]:
    """Return name and text of each file of a program, by name.

    Args:
        folder: of its tables.
        cell: that it is for.

    Raises:
        UsageError: nothing known writes programs of that cell.
        VerificationError: a file cannot be read.
    """
    place = folder / post_processor_name(cell)
    try:
        paths = sorted(path for path in place.glob("*") if path.is_file())
        return tuple((path.name, path.read_bytes().decode("latin-1")) for path in paths)
    except OSError as error:
        raise VerificationError(f"{place} cannot be read ({error.strerror}).") from error


def program_modules(folder: Path, names: Iterable[str], program: str) -> Iterable[tuple[str, str]]:
    """Yield path within the folder of a program and text of its files that exist, without the controller's."""
    for name in names:
        path = PurePosixPath(name)
        if path.parts[0] == program and path.parts[1] != CONTROLLER_FOLDER and (folder / name).is_file():
            yield str(path.relative_to(program)), (folder / name).read_bytes().decode("latin-1")


def kept_files(folder: Path, program: str) -> dict[str, str]:
    """Return name and text of each file that a controller keeps for a program, of those that lie in its folder."""
    paths = sorted(path for path in (folder / program / CONTROLLER_FOLDER).glob("*") if path.is_file())
    return {path.name: path.read_bytes().decode("latin-1") for path in paths}


def program_finding(error: GeoprintError, program: str, *, file: str | None = None) -> Finding:
    """Return what an error says, of the file that it names in the folder of the program, or else of `file`."""
    module, line, reason = (error.details.get(name) for name in ("module", "line", "reason"))
    name = f"{program}/{module}" if isinstance(module, str) else file or program
    return Finding(name, line if isinstance(line, int) else 1, reason if isinstance(reason, str) else str(error))
