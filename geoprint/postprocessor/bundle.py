"""How files land: all of them, verified, or none.

A bundle is written into a temporary folder beside its place, brought to the disk, verified there, and renamed. A killed
run leaves at most hidden folders `.NAME.tmp-PID-*` (unfinished) and `.NAME.old-PID-*` (the bundle it was about to
replace); the next run that writes the same bundle removes them, or puts the old bundle back where nothing stands.

`manifest.json` lists the files of a bundle with their hashes, all but `timings.json` and `evidence.json`. Only a folder
in which nothing else lies, and nothing was edited, is ever replaced, so that no work of a user can be lost; evidence is
taken over, and the switches of a program may have been set.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import secrets
import shutil
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import TypeAlias

from geoprint.errors import ExportError, UsageError, VerificationError
from geoprint.postprocessor.registry import is_as_written

Json: TypeAlias = "bool | int | float | str | Sequence[Json] | Mapping[str, Json] | None"

# What geoprint wrote into a folder; anything else there is the user's.
MANIFEST = "manifest.json"
# Beside the files that it lists: what varies from run to run, and what people saw of a program, which no overwriting
# may lose.
TIMINGS, EVIDENCE = "timings.json", "evidence.json"
# The file that makes a folder a bundle.
PLAN = "plan.json"


def json_bytes(value: Json) -> bytes:
    r"""Return JSON in the order of the mapping, indented by two, with a newline at its end.

    Raises:
        VerificationError: a number is NaN or infinite: what JSON cannot hold was not computed right.

    Examples:
        >>> json_bytes({"runs": 2})
        b'{\n  "runs": 2\n}\n'
    """
    try:
        return (json.dumps(value, indent=2, allow_nan=False) + "\n").encode("ascii")
    except ValueError as error:
        raise VerificationError(
            f"a result is no finite number and is not written ({error}); look for NaN in the plan's figures."
        ) from error


def check_writable(directory: Path | str, *, overwrite: bool) -> None:
    """Check that a bundle can be written, before the long work starts, and clear up after killed runs there.

    Args:
        directory: where the bundle shall stand.
        overwrite: whether an existing bundle may be replaced.

    Raises:
        UsageError: the folder exists and may not or must not be replaced.
        ExportError: nothing can be written there.
    """
    with _translated(directory):
        place = _place(directory)
        _sweep(place)
        _check_place(place, overwrite=overwrite)
        ancestor = next(folder for folder in place.parents if folder.exists())
        if not ancestor.is_dir():
            raise ExportError(f"{ancestor} is a file, so nothing can be written below it; choose another folder.")
        trial = ancestor / _hidden_name(place, "tmp")
        trial.mkdir()
        trial.rmdir()


def write_bundle(
    directory: Path | str,
    files: Mapping[str, bytes],
    *,
    overwrite: bool,
    verify: Callable[[Path], None],
    unlisted: Mapping[str, bytes] = MappingProxyType({}),
) -> None:
    """Write files as one folder that appears complete and verified, or not at all.

    Args:
        directory: where the bundle shall stand; missing parents are made.
        files: name (with `/` between folders) to content; `manifest.json` is added.
        overwrite: whether an existing bundle may be replaced; it goes only after the new one stands.
        verify: called with the temporary folder; what it raises ends the writing.
        unlisted: likewise name to content, of files that the manifest leaves out: `timings.json` beside a file that it
            lists.

    Raises:
        UsageError: the folder exists and may not or must not be replaced.
        ExportError: nothing can be written there.
        VerificationError: a file does not read back as it was written, or `verify` says so.
    """
    every = {**files, **unlisted, MANIFEST: manifest(files)}
    contents = {_relative(name): content for name, content in every.items()}
    if len(contents) != len(files) + len(unlisted) + 1:
        raise ExportError("two files of the bundle have the same name; give each its own.")
    with staging(directory, overwrite=overwrite) as folder:
        with _translated(directory):
            add_files(folder, every)
            _compare(folder, contents)
        verify(folder)


@contextmanager
def staging(directory: Path | str, *, overwrite: bool) -> Generator[Path]:
    """Give a hidden folder, which appears at its place when the body ends and is removed when the body fails.

    What a killed process leaves of it is swept by the next one that writes there.

    Args:
        directory: where the folder shall stand; missing parents are made.
        overwrite: whether an existing bundle may be replaced; it goes only after the new one stands.

    Yields:
        The folder, empty, beside its place.

    Raises:
        UsageError: the folder exists and may not or must not be replaced.
        ExportError: nothing can be written there.
    """
    check_writable(directory, overwrite=overwrite)
    made: list[Path] = []
    temporary: Path | None = None
    try:
        with _translated(directory):
            place = _place(directory)
            made += [folder for folder in place.parents if not folder.exists()]
            place.parent.mkdir(parents=True, exist_ok=True)
            temporary = place.parent / _hidden_name(place, "tmp")
            temporary.mkdir()
        yield temporary
        with _translated(directory):
            _keep_evidence(place, temporary)
            _swap_in(temporary, place, overwrite=overwrite)
    except BaseException:
        _remove(temporary, made)
        raise


def add_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files, name (with `/` between folders) to content, into a staging folder and bring them to the disk."""
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("xb") as handle:
            handle.write(content)
            handle.flush()
            os.fsync(handle.fileno())
    _sync_folders(folder)


def seal(folder: Path | str) -> None:
    """Write the manifest of all that lies in a staging folder but `timings.json`, and bring it to the disk.

    Raises:
        ExportError: it cannot be written.
    """
    folder = Path(folder)
    with _translated(folder):
        files = [path for path in sorted(folder.rglob("*")) if path.is_file()]
        listed = {path.relative_to(folder).as_posix(): path.read_bytes() for path in files if path.name != TIMINGS}
        written = {PurePosixPath(MANIFEST): manifest(listed)}
        (folder / MANIFEST).write_bytes(written[PurePosixPath(MANIFEST)])
        for path in (*files, folder / MANIFEST):
            descriptor = os.open(path, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
        _sync_folders(folder)
        _compare(folder, {PurePosixPath(name): content for name, content in listed.items()} | written)


def manifest(files: Mapping[str, bytes]) -> bytes:
    """Return the content of manifest.json: the SHA-256 of each file, by name."""
    return json_bytes({"sha256": {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}})


def changed_in(folder: Path) -> str | None:
    """Return the first file that a manifest lists and that is gone or holds something else; itself if it lists none."""
    hashes = _listed(folder / MANIFEST)
    if not hashes:
        return MANIFEST
    for name, digest in hashes.items():
        if not (folder / name).is_file() or _is_edited(folder / name, digest):
            return name
    return None


@contextmanager
def _translated(directory: Path | str) -> Generator[None]:
    """Turn what the system says into an error of geoprint that names the folder."""
    try:
        yield
    except OSError as error:
        # Writing itself fails without a name.
        reason = (error.strerror or str(error)) + (f" ({error.filename})" if error.filename else "")
        raise ExportError(f"cannot write {directory}: {reason}; choose another place, or make room there.") from error


def _check_place(place: Path, *, overwrite: bool) -> None:
    if place.exists() and not place.is_dir():
        raise ExportError(f"{place} is a file, not a folder; choose another place for the result.")
    if place.exists():
        hashes = _listed(place / MANIFEST)
        known = _known(hashes)
        foreign = next((path for path in sorted(place.rglob("*")) if _is_foreign(path, place, known)), None)
        if foreign is not None:
            raise UsageError(
                f"{place} holds {foreign.relative_to(place)}, which geoprint did not write: it replaces only folders "
                f"in which everything is listed in the {MANIFEST} it left there. Choose another folder, or move that "
                "file away."
            )
        if not overwrite:
            raise UsageError(f"{place} exists; choose another folder, or replace it with --overwrite.")
        edited = next((name for name, digest in hashes.items() if _is_edited(place / name, digest)), None)
        if edited is not None:
            raise UsageError(
                f"{place} holds {edited}, changed after geoprint wrote it, and --overwrite would lose that change. "
                "Copy it elsewhere and remove it here, or choose another folder."
            )


def _listed(path: Path) -> dict[str, str]:
    """Return name and hash of all that a manifest lists; nothing where there is no manifest of geoprint's."""
    try:
        hashes = dict(json.loads(path.read_bytes())["sha256"])
        return {str(PurePosixPath(name)): str(digest) for name, digest in hashes.items()}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return {}


def _known(hashes: Mapping[str, str]) -> set[str]:
    """Return the names that a manifest lists and those beside them; none without a manifest."""
    names = [PurePosixPath(name) for name in hashes]
    beside = {str(name.with_name(TIMINGS)) for name in names if name.name == PLAN}
    return {MANIFEST, *hashes, *beside} if hashes else set()


def _is_edited(path: Path, digest: str) -> bool:
    """Return whether a file that geoprint wrote holds something else by now; the switches of a program may be set."""
    return path.is_file() and not is_as_written(path, digest)


def _is_foreign(path: Path, place: Path, known: set[str]) -> bool:
    if path.is_dir() and not path.is_symlink():
        return False
    if path.is_symlink() or not path.is_file():
        return True
    kept = path.name == EVIDENCE and not path.is_symlink() and bool(known)
    return not kept and path.relative_to(place).as_posix() not in known


def _keep_evidence(place: Path, temporary: Path) -> None:
    """Take over what people saw of the bundles that are replaced: each entry names the program that it is about."""
    for path in sorted(place.rglob(EVIDENCE)) if place.is_dir() else ():
        name, content = path.relative_to(place).as_posix(), path.read_bytes()
        add_files(temporary, {name: content})
        _compare(temporary, {PurePosixPath(name): content})


def _place(directory: Path | str) -> Path:
    """Return the absolute path that is replaced: links are followed, so that a link stays one."""
    try:
        place = Path(directory).resolve()
    except (RuntimeError, ValueError) as error:
        raise ExportError(f"{str(directory)!r} is no usable path ({error}); choose another folder.") from error
    if not place.name:
        raise ExportError(f"{directory} is the root of the file system; choose a folder below it.")
    return place


def _hidden_name(place: Path, kind: str) -> str:
    return f".{place.name}.{kind}-{os.getpid()}-{secrets.token_hex(4)}"


def _relative(name: str) -> PurePosixPath:
    path = PurePosixPath(name)
    if not path.parts or path.is_absolute() or ".." in path.parts or "\\" in name or "\0" in name:
        raise ExportError(f"{name!r} is no name of a file inside a bundle; allowed are names such as rapid/main.mod.")
    return path


def _sync_folders(folder: Path) -> None:
    """Bring a folder and all below it to the disk."""
    for path in (folder, *(path for path in folder.rglob("*") if path.is_dir())):
        _sync_folder(path)


def _compare(folder: Path, files: Mapping[PurePosixPath, bytes]) -> None:
    for name, content in files.items():
        if (folder / name).read_bytes() != content:
            raise VerificationError(
                f"{name} does not read back as it was written; the disk may be faulty: write again."
            )


def _sync_folder(folder: Path) -> None:
    """Bring a folder's entries to the disk, so that a power cut after the rename does not lose them."""
    if os.name != "posix":  # Windows opens no folders
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _swap_in(temporary: Path, place: Path, *, overwrite: bool) -> None:
    """Rename the new folder into place; an old one steps aside and is removed only then."""
    _check_place(place, overwrite=overwrite)
    if not place.exists():
        temporary.rename(place)
        _sync_folder(place.parent)
        return
    aside = place.parent / _hidden_name(place, "old")
    place.rename(aside)
    try:
        temporary.rename(place)
    except BaseException:
        aside.rename(place)
        raise
    _sync_folder(place.parent)
    # The result stands. What cannot be removed of the old one is swept by the next run.
    shutil.rmtree(aside, ignore_errors=True)


def _remove(temporary: Path | None, made: Sequence[Path]) -> None:
    """Remove what a failed run made, innermost first; folders that somebody else uses meanwhile stay."""
    if temporary is not None:
        shutil.rmtree(temporary, ignore_errors=True)
    for folder in made:
        with suppress(OSError):
            folder.rmdir()


def _sweep(place: Path) -> None:
    """Clear up after killed runs: remove unfinished folders, put an old bundle back where nothing stands."""
    pattern = re.compile(rf"\.{re.escape(place.name)}\.(tmp|old)-([0-9]+)-[0-9a-f]{{8}}")
    if not place.parent.is_dir():
        return
    for folder in sorted(place.parent.iterdir()):
        match = pattern.fullmatch(folder.name)
        if match is None or _is_running(int(match[2])):
            continue
        if match[1] == "old" and not place.exists():
            folder.rename(place)
        else:
            shutil.rmtree(folder, ignore_errors=True)


def _is_running(process: int) -> bool:
    """Whether a process lives; where that cannot be asked it may."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True
