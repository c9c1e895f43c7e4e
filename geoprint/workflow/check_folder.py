"""`geoprint check` of whatever geoprint wrote: a bundle, a comparison, or what a division wrote, with all bundles."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from pathlib import Path, PurePosixPath

from geoprint.errors import GeoprintError, UsageError
from geoprint.postprocessor import PLAN, Json
from geoprint.reporting.check import Checked, CheckedComparison, Finding
from geoprint.reporting.divisions import division_in
from geoprint.reporting.records.comparison import ComparisonRecord, PartRecord, PlannedRecord
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import as_json, read_record
from geoprint.reporting.verdict import ranked
from geoprint.results import Plan
from geoprint.workflow.bundles import COMPARISON, bundles, changes, foreign, listed, part_folders
from geoprint.workflow.check_figures import figures
from geoprint.workflow.check_replan import replanned
from geoprint.workflow.checking import check_bundle

# What compare.json says, held against plan.json of what it compares.


def comparison_findings(folder: Path, checked: Sequence[tuple[str, Checked]]) -> Iterator[Finding]:
    """Yield what compare.json says of a bundle that its plan.json does not.

    Args:
        folder: of the comparison.
        checked: its bundles, by their folders.
    """
    try:
        parts = read_record(folder / COMPARISON, ComparisonRecord).parts
    except GeoprintError:
        # Said where the order of the bundles is read.
        return
    plans = {name: one.record for name, one in checked}
    for number, (place, part) in enumerate(zip(part_folders([one.part for one in parts]), parts, strict=True)):
        if not isinstance(part, PartRecord):
            continue
        for row, one in enumerate(part.backends):
            plan = plans.get(f"{place}{one.backend}")
            at = f"parts.{number}.backends.{row}"
            if isinstance(one, PlannedRecord) and plan is not None:
                yield from figures(COMPARISON, at, as_json(one), _row(plan))
                wanted = {"input": as_json(plan.input), "surface": as_json(plan.surface)}
                yield from figures(COMPARISON, f"parts.{number}", as_json(part), wanted)
            elif isinstance(one, PlannedRecord):
                yield Finding(COMPARISON, 1, f"{at} lists a plan, but {place}{one.backend} holds none")
        best: dict[str, Json] = {"best": ranked(part.backends)[0].backend, "part": part.input.name}
        yield from figures(COMPARISON, f"parts.{number}", as_json(part), best)


def _row(plan: PlanRecord) -> Mapping[str, Json]:
    """Return what is said of a backend, by its plan.json."""
    even, robots = plan.uniformity, plan.robot
    times = [robot.motion.duration_s for robot in robots]
    found: dict[str, Json] = {
        "spacing_mm": plan.settings.spacing_mm,
        "uniformity": None if even is None else as_json(even),
        "paths": as_json(plan.paths),
        "deposition": None if plan.deposition is None else as_json(plan.deposition),
        "patches": [as_json(patch) for patch in plan.patches],
        "not_printable": plan.not_printable,
        "print_time_s": None if not robots else plan.joined.print_s if plan.joined is not None else sum(times),
        "smallest_clearance_mm": min((robot.clearance.smallest_mm for robot in robots), default=None),
        "warnings": [*plan.warnings],
    }
    return found


def check_folder(
    folder: Path | str, *, full: bool = False, observe: Callable[[str], None] = lambda _: None
) -> Checked | CheckedComparison:
    """Check a folder that geoprint wrote: a bundle, a comparison, or what a division wrote, all bundles included.

    Args:
        folder: the folder.
        full: whether to plan all of it again from the bundle's own files and compare, with collision check and
            evenness.
        observe: called with the name of each stage as it starts.

    Returns:
        The findings, each with file and line; `findings` is empty if the folder is as it was planned.

    Raises:
        InputError: geoprint did not write the folder.
        UsageError: a feature wrote it that is not here.
    """
    folder = Path(folder)
    names = listed(folder)
    if PLAN in names:
        return _check_plan(folder, full=full, observe=observe)
    if found := foreign(folder, names):
        return CheckedComparison(folder, tuple(found), ())
    if COMPARISON not in names and (division := division_in(names)) is not None:
        return division.check(folder, names, full=full, observe=observe)
    inner = bundles(names)
    if COMPARISON not in names and inner:
        raise UsageError(
            f"{folder} holds workpieces that one program prints in turn, and this geoprint lacks the feature that "
            "wrote it: install all of geoprint."
        )
    own = changes_beside(folder, names, inner)
    order = _order(folder, own)
    best_first = sorted(inner, key=lambda one: order.index(str(one)) if str(one) in order else len(order))
    checked = check_inner(folder, map(str, best_first), full=full, observe=observe)
    if COMPARISON in names:
        own += comparison_findings(folder, checked)
    return CheckedComparison(folder, tuple(own), checked)


def check_inner(
    folder: Path,
    names: Iterable[str],
    *,
    full: bool,
    observe: Callable[[str], None],
    keep: Callable[[str, Plan], object] = lambda _, __: None,
) -> tuple[tuple[str, Checked], ...]:
    """Check several bundles, any of whose folders may be gone.

    Args:
        folder: in which they stand.
        names: of theirs, in the order of the result.
        full: as in `check_folder`.
        observe: called with the one that is checked.
        keep: called with the name and the plan of each that was planned again.

    Returns:
        Each by its name.
    """
    checked: list[tuple[str, Checked]] = []
    listed_names = [*names]
    for number, name in enumerate(listed_names, start=1):
        observe(f"checking {name}, {number} of {len(listed_names)}")
        if (folder / name).is_dir():
            checked.append((name, _check_plan(folder / name, full=full, keep=partial(keep, name))))
        else:
            missing = Finding(PLAN, 1, "the folder is missing")
            checked.append((name, Checked(folder / name, (missing,), None, program=False)))
    return tuple(checked)


def changes_beside(folder: Path, names: Mapping[str, str], inner: Sequence[PurePosixPath]) -> list[Finding]:
    """Return which files beside the bundles of a folder are not as they were written."""
    beside = {
        name: digest
        for name, digest in names.items()
        if not any(PurePosixPath(name).is_relative_to(one) for one in inner)
    }
    return [Finding(name, 1, reason) for name, reason in changes(folder, beside)]


def _check_plan(
    folder: Path,
    *,
    full: bool,
    keep: Callable[[Plan], object] = lambda _: None,
    observe: Callable[[str], None] = lambda _: None,
) -> Checked:
    """Check one bundle, and where all of it is asked for, plan it again and compare."""
    checked = check_bundle(folder, full=full)
    if not full or checked.record is None:
        return checked
    if checked.record.version != version("geoprint"):
        # What another release plans differently is no damage.
        return checked
    again = replanned(folder, listed(folder), keep=keep, observe=observe)
    said = {(finding.file, finding.reason) for finding in checked.findings}
    found = tuple(finding for finding in again if (finding.file, finding.reason) not in said)
    return replace(checked, findings=(*checked.findings, *found))


def _order(folder: Path, findings: list[Finding]) -> list[str]:
    """Return the folders of a comparison's bundles in the order of its verdict; where it cannot be read, none."""
    if not (folder / COMPARISON).is_file():
        return []
    try:
        parts = read_record(folder / COMPARISON, ComparisonRecord).parts
    except GeoprintError as error:
        findings.append(Finding(COMPARISON, 1, str(error)))
        return []
    places = part_folders([part.part for part in parts])
    return [
        f"{place}{row.backend}"
        for place, part in zip(places, parts, strict=True)
        if isinstance(part, PartRecord)
        for row in ranked(part.backends)
    ]
