"""From what a program, a command line or a job file says to a job.

A job file has the keys of `Job` in TOML; the files that it names are found from its own folder.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TypeAlias, cast

from pydantic import BaseModel, ValidationError

from geoprint.config.cells import with_needle_settings
from geoprint.config.job import GROUPS, Job
from geoprint.config.strict import (
    Place,
    Table,
    describe,
    key_at,
    keys_of,
    line_of,
    option_type,
    parsed_toml,
    part_of,
    table_of,
    text_of,
    unknown_key,
)
from geoprint.errors import UsageError, reason_of

_JOB_SUFFIX = ".toml"
_HEAD = """\
# A job of geoprint: what to plan. `geoprint plan job.toml --out DIR` plans it, `geoprint compare job.toml --out DIR`
# compares backends on it; options given there count more than the keys here. Lengths in mm, angles in degrees. Files
# are found from the folder of this file. Keys that are commented out show their default, or what they could be.
"""
_PLANNED = """\
# The job that these files were planned from; `geoprint plan --from` this folder plans it again.
"""
_DRAWN = """\
# A job of geoprint, as it was drawn in `geoprint view`; `geoprint plan` this file plans it. Lengths in mm.
"""
# Keys that exclude each other: the one that is given replaces the one that is written.
_EXCLUSIVE = {"spacing", "rounds"}
# What was set by the needle of a job file goes with it where another one is given.
_OF_NEEDLE = ("spacing", "layer_height", "standoff", "speed")
# Keys of a job that name files.
FILES = tuple(name for name, _, field in keys_of(Job) if option_type(field) is Path)
# Where a key stands in a job, and its new value.
Setting: TypeAlias = tuple[Place, object]
# How an item of a list, and a name that is free, stand in the names of all keys.
_ITEM, _OWNER = "1", "NAME"
# A key of a backend that people look for by its name alone.
_RESOLUTION = "options.lscm.resolution"


def job_of(**values: object) -> Job:
    """Return the job with the given keys.

    If the surface is a job file (.toml), its keys are read first; keys given here take precedence.

    Args:
        **values: keys of `Job`; None counts as not given. Files are text or paths; the source may be a text such as
            "best" or "loops:2"; `patch` is short for `patches` with one entry.

    Returns:
        The checked job, for `plan`, `compare` and `measure_files`.

    Raises:
        UsageError: a value is unknown, missing or meaningless; the sentence names it, and its line in a job file.
    """
    return job_named(values, named=key_at)


def job_named(values: Mapping[str, object], *, named: Callable[[Place], str], settings: Sequence[Setting] = ()) -> Job:
    """Return what `job_of` does, with words of one's own for the keys.

    Args:
        values: as for `job_of`.
        named: what a message calls the place of a key.
        settings: keys that are given besides, also within tables, as `setting` returns them.

    Raises:
        UsageError: as for `job_of`.
    """
    given = {name: value for name, value in values.items() if value is not None}
    for place, value in settings:
        if len(place) == 1 and place[0] in given:
            raise UsageError(f"`{place[0]}` is given twice, as an option and by `--set`: leave one of them out.")
        given |= {str(place[0]): value} if len(place) == 1 else {}
    if "patch" in given:
        given["patches"] = [given.pop("patch")]
    given = _with_paths(given)
    surface = given.get("surface")
    if isinstance(surface, Path) and surface.suffix.lower() == _JOB_SUFFIX:
        del given["surface"]
        written = _read_job_file(surface)
        gone = _EXCLUSIVE if _EXCLUSIVE & given.keys() else set[str]()
        gone |= set(_OF_NEEDLE) if "needle" in given else set()
        given = _joined({name: value for name, value in written.items() if name not in gone}, given)
    for place, value in settings:
        given = cast("dict[str, object]", _with(given, place, value)) if len(place) > 1 else given
    given = with_needle_settings(given)
    try:
        return Job.model_validate(given)
    except ValidationError as error:
        near = _nearest(unknown_key(error)) or ";"
        raise UsageError(f"{describe(error, named)}{near} `geoprint plan --help` lists what can be given.") from error


def setting(text: str) -> Setting:
    """Return the key of a job file that a text names, with its value: `max_tilt=5`, `patches.1.cone_deg=20`.

    A value is one of TOML, or a bare word; `options.NAME` alone asks for a feature.

    Raises:
        UsageError: there is no such key, or no value; the sentence names the nearest key.

    Examples:
        >>> setting("max_tilt=5"), setting("patches.2.cone_deg=20"), setting("middle=plain")
        ((('max_tilt',), 5), (('patches', 1, 'cone_deg'), 20), (('middle',), 'plain'))
    """
    name, equals, value = (part.strip() for part in text.partition("="))
    parts = name.split(".")
    within_options = parts[0] == "options" and 2 <= len(parts) <= 3 and all(parts)
    known = {*_key_names(Job)}
    if not within_options and ".".join(_ITEM if part.isdecimal() else part for part in parts) not in known:
        raise UsageError(
            f"`--set {text[:60]}`: a job has no key `{name[:60]}`{_nearest(name) or '.'} `geoprint init` writes a job "
            "file with every key."
        )
    if within_options and len(parts) == 2 and not equals:
        return tuple(parts), {}
    if not equals or not value:
        raise UsageError(f"`--set {text[:60]}` has no value: write it as `--set {name}=VALUE`.")
    return tuple(int(part) - 1 if part.isdecimal() else part for part in parts), _value(value)


def job_file_text(model: type[Table] = Job) -> str:
    """Return the text of a commented job file with every key."""
    parts = [_HEAD]
    for group, heading in GROUPS.items():
        lines = [f"# {line}" for line in heading.splitlines()]
        for name, key, field in keys_of(model):
            if key.group == group:
                lines += key.lines(name, field)
                if (table := table_of(field) or part_of(field)) is not None:
                    lines += [line for within, one, inner in keys_of(table) for line in one.lines(within, inner)]
        parts.append("".join(f"{line}\n" for line in lines))
    return "\n".join(parts)


def job_text(job: Job) -> str:
    """Return the text of the job file of a job: every key that is given or has a default, files as the job names them.

    Read again from the folder that these names are seen from, it is the same job.
    """
    import tomlkit

    values = job.model_dump(exclude_none=True)
    kept = {name: value.as_posix() if isinstance(value, Path) else value for name, value in values.items()}
    return _PLANNED + tomlkit.dumps({name: value for name, value in kept.items() if value not in ([], {})})


def edited_job_text(job: Job, path: Path) -> str:
    """Return the text of a job file with another job in it: comments, and keys with the same value, stay.

    Args:
        job: files it names are seen from here.
        path: where the text will stand; what stands there is edited, and without a file only keys that differ from
            their defaults are written.

    Raises:
        UsageError: what stands there is no job file.
    """
    filed = path.is_file()
    before = _written_keys(
        Job.model_validate(_read_job_file(path)) if filed else Job(surface=Path()), folder=path.parent
    )
    after = _written_keys(job, folder=path.parent)
    changed = {name: after.get(name) for name in {**before, **after} if before.get(name) != after.get(name)}
    return edited_toml(text_of(path) if filed else _DRAWN, changed)


def _written_keys(job: Job, *, folder: Path) -> dict[str, object]:
    """Return the keys of a job as its file says them, files as they are named from its folder."""
    # Of tables within, what is left at its default says nothing.
    values = job.model_dump(exclude_none=True) | job.model_dump(exclude_none=True, exclude_defaults=True)
    return {
        name: Path(os.path.relpath(value, folder)).as_posix() if isinstance(value, Path) else value
        for name, value in values.items()
    }


def edited_toml(text: str, values: Mapping[str, object]) -> str:
    """Return a TOML text with other values of some keys; None removes one. Comments and all other keys stay."""
    import tomlkit

    document = tomlkit.parse(text)
    for name, value in values.items():
        if value is None:
            document.pop(name, None)  # pyright: ignore[reportUnknownMemberType]
        else:
            document[name] = value
    return tomlkit.dumps(document)


def _read_job_file(path: Path) -> dict[str, object]:
    """Return the keys of a job file; files it names are found from its folder, inside or outside of it.

    Raises:
        UsageError: it cannot be read, is not TOML, names a job file as its part, or has an unknown, missing or
            meaningless key; the sentence says the file, the line and the key.
    """
    try:
        text = text_of(path)
    except (OSError, ValueError) as error:
        raise UsageError(
            f"the job file {path} cannot be read ({reason_of(error)}); `geoprint init` writes one."
        ) from error
    keys = _with_paths(parsed_toml(text, name=path.name), folder=path.parent)
    try:
        Job.model_validate(keys)
    except ValidationError as error:
        where = line_of(error, text, name=path.name)
        near = _nearest(unknown_key(error)) or ";"
        raise UsageError(f"{where}: {describe(error)}{near} `geoprint init` writes a job with every key.") from error
    surface = keys["surface"]
    if isinstance(surface, Path) and surface.suffix.lower() == _JOB_SUFFIX:
        raise UsageError(
            f"{path.name}: surface: {surface.name} is a job file too; name the mesh of the part or its body."
        )
    return keys


def _key_names(model: type[BaseModel], before: str = "") -> Iterator[str]:
    """Yield the names of all keys of a table, those of its tables behind a dot."""
    for name, key, field in keys_of(model):
        listed, part = table_of(field), part_of(field)
        if key.group == "options":
            yield f"{before}{name}.{_OWNER}.KEY"
        elif listed is not None:
            yield from _key_names(listed, f"{before}{name}.{_ITEM}.")
        else:
            yield f"{before}{name}"
        if part is not None:
            yield from _key_names(part, f"{before}{name}.")


def _nearest(name: str) -> str:
    """Return a question for the key whose name, or the end of it, is most like a name; nothing where none is."""
    known = sorted(_key_names(Job), key=len, reverse=True)
    ends = {each.rpartition(".")[2]: each for each in known} | {"resolution": _RESOLUTION}
    found = get_close_matches(name.rpartition(".")[2], ends, n=1, cutoff=0.5)
    return f"; did you mean `{ends[found[0]]}`?" if found else ""


def _value(text: str) -> object:
    """Return a value of TOML, or a bare word as it stands."""
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return parsed["value"] if len(parsed) == 1 else text


def _with(values: object, place: Place, value: object) -> object:
    """Return tables and lists with another value at a place.

    Raises:
        UsageError: it lies in an item of a list that does not follow on the others.
    """
    if not place:
        return value
    first, rest = place[0], place[1:]
    if isinstance(first, str):
        table = cast("dict[str, object]", values) if isinstance(values, dict) else {}
        return {**table, first: _with(table.get(first), rest, value)}
    items = [*cast("list[object]", values)] if isinstance(values, list) else []
    if not 0 <= first <= len(items):
        raise UsageError(f"`--set` names item {first + 1} of a list of {len(items)}: count them from 1.")
    items[first : first + 1] = [_with(items[first] if first < len(items) else None, rest, value)]
    return items


def _joined(written: Mapping[str, object], given: Mapping[str, object]) -> dict[str, object]:
    """Return the keys of a job file with those that are given in their place; options are joined one by one."""
    joined = {**written, **given}
    ours, theirs = written.get("options"), given.get("options")
    if isinstance(ours, dict) and isinstance(theirs, dict):
        known = cast("dict[str, dict[str, object]]", ours)
        newer = cast("dict[str, dict[str, object]]", theirs)
        joined["options"] = known | {owner: {**known.get(owner, {}), **newer[owner]} for owner in newer}
    return joined


def _with_paths(keys: dict[str, object], *, folder: Path = Path()) -> dict[str, object]:
    """Return the keys of a job with the files that it names as paths, as seen from a folder."""
    return {name: folder / value if name in FILES and isinstance(value, str) else value for name, value in keys.items()}
