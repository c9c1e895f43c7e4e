"""From what a program, a command line or a job file says to a job.

A job file has the keys of `Job` in TOML; the files that it names are found from its own folder.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import cast

from pydantic import ValidationError

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
)
from geoprint.errors import UsageError

_JOB_SUFFIX = ".toml"
_HEAD = """\
# A job of geoprint: what to plan. `geoprint plan job.toml --out DIR` plans it, `geoprint compare job.toml --out DIR`
# compares backends on it; options given there count more than the keys here. Lengths in mm, angles in degrees. Files
# are found from the folder of this file. Keys that are commented out show their default, or what they could be.
"""
_PLANNED = """\
# The job that these files were planned from; `geoprint plan --from` this folder plans it again.
"""
# Keys that exclude each other: the one that is given replaces the one that is written.
_EXCLUSIVE = ({"spacing", "rounds"}, {"pattern", "patterns"})
# What was set by the needle of a job file goes with it where another one is given.
_OF_NEEDLE = ("spacing", "layer_height", "standoff", "speed")
# Keys of a job that name files.
_FILES = tuple(name for name, _, field in keys_of(Job) if option_type(field) is Path)


def job_of(**values: object) -> Job:
    """Return the job with the given values.

    Where the surface is a job file (.toml), its keys are taken first; whatever else is given counts more than them.

    Args:
        **values: attributes of `Job`, None for those that are not given; files as text or paths, the source as
            a text too, such as "best" or "loops:2"; `patch` stands for a single one of `patches`.

    Raises:
        UsageError: a value is unknown, missing or meaningless; the sentence names it, and its line in a job file.
    """
    return job_named(values, named=key_at)


def job_named(values: Mapping[str, object], *, named: Callable[[Place], str]) -> Job:
    """Return what `job_of` does, with words of one's own for the keys.

    Args:
        values: as for `job_of`.
        named: what a message calls the place of a key.

    Raises:
        UsageError: as for `job_of`.
    """
    given = {name: value for name, value in values.items() if value is not None}
    if "patch" in given:
        given["patches"] = [given.pop("patch")]
    given = _with_paths(given)
    surface = given.get("surface")
    if isinstance(surface, Path) and surface.suffix.lower() == _JOB_SUFFIX:
        del given["surface"]
        written = _read_job_file(surface)
        gone = {name for pair in _EXCLUSIVE if pair & given.keys() for name in pair}
        gone |= set(_OF_NEEDLE) if "needle" in given else set()
        given = _joined({name: value for name, value in written.items() if name not in gone}, given)
    given = with_needle_settings(given)
    try:
        return Job.model_validate(given)
    except ValidationError as error:
        raise UsageError(f"{describe(error, named)}; `geoprint plan --help` lists what can be given.") from error


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


def _read_job_file(path: Path) -> dict[str, object]:
    """Return the keys of a job file; files it names are found from its folder, inside or outside of it.

    Raises:
        UsageError: it cannot be read, is not TOML, names a job file as its part, or has an unknown, missing or
            meaningless key; the sentence says the file, the line and the key.
    """
    try:
        text = text_of(path)
    except (OSError, ValueError) as error:
        raise UsageError(f"the job file {path} cannot be read ({error}); `geoprint init` writes one.") from error
    keys = _with_paths(parsed_toml(text, name=path.name), folder=path.parent)
    try:
        Job.model_validate(keys)
    except ValidationError as error:
        where = line_of(error, text, name=path.name)
        raise UsageError(f"{where}: {describe(error)}; `geoprint init` writes a job with every key.") from error
    surface = keys["surface"]
    if isinstance(surface, Path) and surface.suffix.lower() == _JOB_SUFFIX:
        raise UsageError(
            f"{path.name}: surface: {surface.name} is a job file too; name the mesh of the part or its body."
        )
    return keys


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
    return {
        name: folder / value if name in _FILES and isinstance(value, str) else value for name, value in keys.items()
    }
