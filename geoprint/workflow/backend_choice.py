"""Which backend, pattern and field a job names, and the options that it gives them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial

from geoprint.config import Job, read_field
from geoprint.distance import Backend, backend, backend_names
from geoprint.errors import InputError, UsageError
from geoprint.model import OptionValue, Surface
from geoprint.registry import Entry, Factory
from geoprint.reporting.features import report, report_names
from geoprint.results import StackPlace, Workpiece
from geoprint.toolpath import Pattern, pattern, pattern_names, runs_beside_line

# The option that the key `middle` stands for, of whichever pattern has it, and the middle that pipeline chooses.
MIDDLE, BEST_MIDDLE = "middle", "best"
# The keys of a job that stand for an option of that name, and what they say.
PATTERN_KEYS = {MIDDLE: "contours at the medial axis", "contours": "the number of contours around rows"}
# The option of a pattern whose lines a field file says, and the key of that.
FIELD = "field"


def check_part(job: Job) -> None:
    """Check that there is a part at all, before anything else that may be wrong.

    Raises:
        InputError: there is no such file.
    """
    if not os.path.exists(job.surface):  # noqa: PTH110  (a name that no file can have is none, too)
        raise InputError(f"there is no file `{job.surface}`; check its name and folder.")


def check_options(job: Job, backends: Sequence[str]) -> None:
    """Check the options of a job, before the long work; those of what is not chosen just have to be right.

    Raises:
        UsageError: a backend, a pattern or one of their options is unknown, an option is missing or of another type,
            or the middle or the contours mean none of the patterns, or an angle not its pattern.
    """
    for name in backends:
        _options(job, backend(name))
    drawings = [pattern(each.name) for each in job.drawings]
    for key, said in (*PATTERN_KEYS.items(), (FIELD, "which lines fibres follow")):
        if getattr(job, key) is not None and not any(key in drawing.options for drawing in drawings):
            names = " and ".join(dict.fromkeys(drawing.name for drawing in drawings))
            raise UsageError(f"`{key} = {getattr(job, key)}` sets {said}, but the pattern {names} has none: omit it.")
    for drawing in drawings:
        _options(job, drawing)
        _lines(job, drawing)
    _check_angles(job)
    for name in job.options:
        _options(job, _named(name))


def _check_angles(job: Job) -> None:
    """Check that layers whose rows run beside a line have one where patterns take turns, and others no angle."""
    for each in job.drawings:
        beside = runs_beside_line(pattern(each.name))
        if each.angle_deg is not None and not beside:
            raise UsageError(
                f"`--pattern`: {each} gives an angle, but the pattern {each.name} has no rows: write {each.name} alone."
            )
        if each.angle_deg is None and beside and job.source is None and len(job.drawings) > 1:
            raise UsageError(
                f"`--pattern`: rows of {each.name} follow a line: give their angle in degrees, as {each.name}:45, or "
                "a drawn curve with `--from curve.csv`."
            )


def backend_of(job: Job) -> partial[Backend]:
    """Return what builds the backend of a job on a surface, with the options of the job.

    Raises:
        UsageError: as `check_options`.
    """
    entry = backend(job.backend)
    return partial(entry.factory, **_options(job, entry))


def pattern_of(job: Job, place: StackPlace | None = None) -> Pattern:
    """Return the pattern of a job, with the options of the job.

    Args:
        job: that names it.
        place: of the layer that it covers; None of a single skin.

    Raises:
        UsageError: as `check_options`.
    """
    entry = pattern(job.drawing.name)
    return entry.factory(**_options(job, entry), **_lines(job, entry, place))


def follows_field(job: Job) -> bool:
    """Return whether the paths of a job follow the lines of a field."""
    return FIELD in pattern(job.drawing.name).options


def check_lines(job: Job, workpiece: Workpiece) -> None:
    """Check that there are lines on a workpiece where the paths of a job follow some.

    Raises:
        GeoprintError: as what `lines_of` returns.
    """
    for lines in _lines(job, pattern(job.drawing.name), workpiece.place).values():
        lines(workpiece.surface)


def seeks_middle(job: Job) -> bool:
    """Return whether the best middle of a job's pattern is to be found: where it has one, and no other is asked for."""
    entry = pattern(job.drawing.name)
    return (
        MIDDLE in entry.options and MIDDLE not in job.options.get(entry.name, {}) and job.middle in {None, BEST_MIDDLE}
    )


def with_backend(job: Job, name: str) -> Job:
    """Return the same job for another backend."""
    return job.model_copy(update={"backend": name})


def _lines(
    job: Job, entry: Entry[Factory[Pattern]], place: StackPlace | None = None
) -> dict[str, Callable[[Surface], object]]:
    """Return the lines that a pattern follows as its option; none where it follows none.

    Raises:
        UsageError: it follows lines, and the job names no field file, or one that cannot be read or turns them through
            layers that the job does not have.
    """
    if FIELD not in entry.options:
        return {}
    if job.field is None:
        raise UsageError(
            f"the pattern {entry.name} follows a field of lines: give `--field field.toml`; `geoprint init` writes one."
        )
    file = read_field(job.field)
    if file.through is not None and not job.layered:
        raise UsageError(
            f"{job.field.name}: [through] turns lines from layer to layer, but this job has one layer: give "
            "`--thickness` or `--target`, or remove [through]."
        )
    makes: Callable[..., Callable[[Surface], object]] | None = getattr(entry.factory, "lines_of", None)
    if makes is None:
        raise UsageError(f"{entry.origin} takes a field, but has no `lines_of` that makes it of a field file.")
    return {FIELD: makes(file, place=place)}


def _named(name: str) -> Entry[Factory[object]]:
    if name in backend_names():
        return backend(name)
    if name in pattern_names():
        return pattern(name)
    if name in report_names():
        return report(name)
    raise UsageError(
        f"options are given for '{name}', which is not a backend, pattern or feature; choose one of: "
        f"{', '.join([*backend_names(), *pattern_names(), *report_names()])}."
    )


def _options(job: Job, entry: Entry[Factory[object]]) -> dict[str, OptionValue]:
    given = job.options.get(entry.name, {})
    for key in PATTERN_KEYS:
        asked = getattr(job, key)
        if asked is None or asked == BEST_MIDDLE or key not in entry.options:
            continue
        if key in given:
            raise UsageError(
                f"the {key} of {entry.name} is given twice, as `{key} = {asked}` and as its option {given[key]}: leave "
                "one of them out."
            )
        given = given | {key: asked}
    return entry.checked(given)
