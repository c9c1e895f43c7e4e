"""What a folder of geoprint holds by its manifest: one bundle or those of a comparison, and what has changed in it."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath

from geoprint.errors import InputError
from geoprint.export import MANIFEST, PLAN
from geoprint.export.rapid import CELL_MODULE, STACK_MODULE, as_new

# Where a bundle keeps the program.
RAPID_FOLDER = "rapid"
# What stands beside the bundles of a comparison.
COMPARISON, STACK, STACKS = "compare.json", "stack.json", "stacks.json"
# What a person asks for who named another folder.
WHICH_FOLDER = "give the folder that `geoprint plan --out` wrote, or one of a backend below that of `geoprint compare`"


def listed(folder: Path) -> dict[str, str]:
    """Return the hash of each file that the manifest lists: the folder's own, or that of the comparison it is in.

    Raises:
        InputError: there is no such folder, or geoprint did not write it.
    """
    if not folder.is_dir():
        raise InputError(f"there is no folder {folder}; {WHICH_FOLDER}.")
    try:
        place = next(place for place in (folder, *folder.absolute().parents[:2]) if (place / MANIFEST).is_file())
        below = folder.absolute().relative_to(place.absolute())
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
    """Return what `listed` does of a folder that holds a single bundle.

    Raises:
        InputError: it is none, or holds several; the sentence names these.
    """
    names = listed(folder)
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


def changes(folder: Path, names: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield name and reason for each listed file that is not as it was written, and for modules that nobody lists.

    The switches of GeoCell, or of a stack's GeoStack, may be set as its run sheet asks.
    """
    for name, digest in names.items():
        path = folder / name
        if not path.is_file():
            yield name, "the file is missing"
        elif digest not in _digests(path):
            yield name, "the file was changed after it was written: its hash is not that of the manifest"
    for path in sorted((folder / RAPID_FOLDER).rglob("*")):
        name = path.relative_to(folder).as_posix()
        if name not in names and not path.is_dir():
            yield name, "the manifest does not list this file"


def _digests(path: Path) -> Iterator[str]:
    """Yield the hash of a file; of what holds switches also that with these as they were written."""
    content = path.read_bytes()
    yield hashlib.sha256(content).hexdigest()
    if path.name in {CELL_MODULE, STACK_MODULE}:
        yield hashlib.sha256(as_new(content.decode("latin-1")).encode("latin-1")).hexdigest()
