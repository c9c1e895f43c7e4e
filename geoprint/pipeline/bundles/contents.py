"""What a folder of geoprint holds by its manifest: one bundle or those of a comparison, and what has changed in it.

A folder is foreign input, whoever wrote its manifest: nothing in it is opened before it is known to be a plain file of
bounded size with a name that any system takes. A link could lead anywhere, and a pipe would be waited for.
"""

from __future__ import annotations

import json
import os
import stat
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath

from geoprint.account.checked import Finding
from geoprint.errors import InputError
from geoprint.export import EVIDENCE, MANIFEST, PLAN, TIMINGS
from geoprint.export.switches import is_as_written

# Where a bundle keeps the program.
RAPID_FOLDER = "rapid"
# What stands beside the bundles of a comparison.
COMPARISON, STACK, STACKS = "compare.json", "stack.json", "stacks.json"
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
            raise InputError(f"{folder} is no bundle of geoprint: its {MANIFEST} {reason}; {WHICH_FOLDER}.")
        hashes = dict(json.loads((place / MANIFEST).read_bytes())["sha256"])
        paths = {PurePosixPath(str(name)): str(digest) for name, digest in hashes.items()}
        names = {str(path.relative_to(below)): digest for path, digest in paths.items() if path.is_relative_to(below)}
    except StopIteration:
        raise InputError(f"{folder} is no bundle of geoprint: it holds no {MANIFEST}; {WHICH_FOLDER}.") from None
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(
            f"{folder} is no bundle of geoprint: its {MANIFEST} cannot be read ({error}); {WHICH_FOLDER}."
        ) from error
    if not names:
        raise InputError(f"{folder} is no bundle of geoprint: the {MANIFEST} above it lists none here; {WHICH_FOLDER}.")
    return names


def listed_bundle(folder: Path) -> dict[str, str]:
    """Return what `listed` does of a folder that holds a single bundle, of which every file may be opened.

    Raises:
        InputError: it is none, or holds several, and the sentence names these; or as `foreign` finds it.
    """
    names = listed(folder)
    for finding in foreign(folder, names):
        raise InputError(f"{folder / finding.file}: {finding.reason}; put the file in its place that geoprint wrote.")
    if PLAN not in names:
        found = " or ".join(str(folder / one) for one in bundles(names))
        one = f"name one of them, {found}" if found else WHICH_FOLDER
        raise InputError(f"{folder} holds no single bundle, but several; {one}.")
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
        return [Finding(MANIFEST, 1, f"it lists {len(every)} files, allowed are {MOST_FILES}")]
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
        return f"it lists {shown!r}, which is no name of a file in this folder"
    return None


def _unfit(folder: Path, name: str) -> str | None:
    """Return why a file must not be opened: it or a folder on its way is none; None where it may, or is missing."""
    path, place = folder / name, folder
    try:
        for part in PurePosixPath(name).parts[:-1]:
            place = place / part
            if not stat.S_ISDIR(place.lstat().st_mode):
                return f"its folder {place.name} is no plain folder: a bundle has no links"
        found = path.lstat()
    except OSError:
        return None
    if not stat.S_ISREG(found.st_mode):
        return f"this is {_kind(found.st_mode)}, no plain file, and is not opened"
    most = LARGEST if path.suffix in _LARGE else LARGEST_TEXT
    return f"the file has {found.st_size} bytes, allowed are {most}" if found.st_size > most else None


def _kind(mode: int) -> str:
    kinds = {stat.S_ISLNK: "a link", stat.S_ISDIR: "a folder", stat.S_ISFIFO: "a pipe", stat.S_ISSOCK: "a socket"}
    return next((word for is_one, word in kinds.items() if is_one(mode)), "a device")


def _beside_programs(folder: Path, names: Iterable[str]) -> Iterator[str]:
    """Yield all that lies in the folders of programs, without following a link; a bound ends it."""
    paths = [PurePosixPath(name) for name in names]
    places = {
        PurePosixPath(*path.parts[: path.parts.index(RAPID_FOLDER) + 1])
        for path in paths
        if RAPID_FOLDER in path.parts[:-1]
    }
    count = 0
    for place in sorted({PurePosixPath(RAPID_FOLDER), *places}):
        for root, folders, files in os.walk(folder / place, followlinks=False):
            linked = [name for name in folders if os.path.islink(os.path.join(root, name))]  # noqa: PTH114, PTH118
            for name in (*linked, *files):
                count += 1
                if count > MOST_FILES:
                    return
                yield Path(root, name).relative_to(folder).as_posix()


def changes(folder: Path, names: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield name and reason for each listed file that is not as it was written, and for modules that nobody lists.

    The switches of GeoCell, or of a stack's GeoStack, may be set as its run sheet asks.
    """
    for name, digest in names.items():
        path = folder / name
        if not path.is_file():
            yield name, "the file is missing"
        elif not is_as_written(path, digest):
            yield name, "the file was changed after it was written: its hash is not that of the manifest"
    for name in sorted(_beside_programs(folder, names)):
        if name not in names:
            yield name, "the manifest does not list this file"
