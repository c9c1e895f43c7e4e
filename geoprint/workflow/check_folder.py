"""`geoprint check` of whatever geoprint wrote: a bundle, or a comparison or a stack with all bundles in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path, PurePosixPath

from geoprint.errors import GeoprintError
from geoprint.postprocessor import EVIDENCE, PLAN, Json
from geoprint.reporting.check import Checked, CheckedComparison, Finding
from geoprint.reporting.records.comparison import ComparisonRecord, PartRecord, PlannedRecord
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import as_json, read_record
from geoprint.reporting.records.stack import RefusedStackRecord, StackComparisonRecord, StackRecord
from geoprint.reporting.stack_comparison import best_stack, compared_stack, stack_verdict
from geoprint.reporting.verdict import ranked
from geoprint.results import Plan, StackedLayer
from geoprint.workflow.bundles import (
    COMPARISON,
    STACK,
    STACKS,
    bundles,
    changes,
    foreign,
    listed,
    part_folders,
    read_seen,
)
from geoprint.workflow.check_figures import figures
from geoprint.workflow.check_replan import replanned
from geoprint.workflow.check_stack import check_stack, finished_findings
from geoprint.workflow.checking import check_bundle
from geoprint.workflow.stack_thickness import stacked_layer

# What compare.json and stacks.json say, held against plan.json and stack.json of what they compare.


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


def stacks_findings(folder: Path, stacks: Sequence[tuple[str, CheckedComparison]]) -> Iterator[Finding]:
    """Yield what stacks.json says that the stack.json of each backend does not.

    Args:
        folder: of the compared stacks.
        stacks: each of them, by its folder.
    """
    try:
        said = read_record(folder / STACKS, StackComparisonRecord)
    except GeoprintError as error:
        yield Finding(STACKS, 1, str(error))
        return
    every = {name: None if one.stack is None else one.stack.record for name, one in stacks}
    record = {name: one for name, one in every.items() if isinstance(one, StackRecord)}
    planned = [row.backend for row in said.backends if not isinstance(row, RefusedStackRecord)]
    if sorted(planned) != sorted(record):
        yield Finding(STACKS, 1, f"it lists {', '.join(planned)}, the stacks are {', '.join(record) or 'none'}")
        return
    asked = any(not isinstance(row, RefusedStackRecord) and row.printable is not None for row in said.backends)
    rows = [
        row if isinstance(row, RefusedStackRecord) else compared_stack(row.backend, record[row.backend], asked=asked)
        for row in said.backends
    ]
    first = record[planned[0]]
    found: dict[str, Json] = {
        "part": first.part,
        "thickness_mm": first.thickness_mm,
        "layers": len(first.layers),
        "verdict": [*stack_verdict(rows, part=said.part)],
        "best": best_stack(rows)[0].backend,
        "backends": [as_json(row) for row in rows],
    }
    yield from figures(STACKS, "", as_json(said), found)


def check_folder(
    folder: Path | str, *, full: bool = False, observe: Callable[[str], None] = lambda _: None
) -> Checked | CheckedComparison:
    """Check a folder that geoprint wrote: a bundle, or a comparison or a stack with all bundles in it.

    Args:
        folder: the folder; of compared stacks, each is checked.
        full: whether to plan all of it again from the bundle's own files and compare, with collision check and
            evenness.
        observe: called with the name of each stage as it starts.

    Returns:
        The findings, each with file and line; `findings` is empty if the folder is as it was planned.

    Raises:
        InputError: geoprint did not write the folder.
    """
    folder = Path(folder)
    names = listed(folder)
    if PLAN in names:
        return _check_plan(folder, full=full, observe=observe)
    if found := foreign(folder, names):
        return CheckedComparison(folder, tuple(found), ())
    if STACKS in names:
        return _check_stacks(folder, names, full=full, observe=observe)
    inner = bundles(names)
    own = _changes_beside(folder, names, inner)
    if STACK in names:
        order = sorted(map(str, inner))
        kept: dict[str, StackedLayer] = {}
        checked = tuple(
            (one, _check_inner(folder / one, full=full, kept=kept, name=one)) for one in _observed(order, observe)
        )
        found, stack = check_stack(folder, names, checked)
        found += finished_findings(folder, stack, [kept[one] for one in order if one in kept]) if full else []
        said = {finding.file for finding in found}
        own = [*found, *(finding for finding in own if finding.file not in said)]
        try:
            stack = replace(stack, seen=read_seen(folder))
        except GeoprintError as error:
            own.append(Finding(EVIDENCE, 1, str(error)))
        return CheckedComparison(folder, tuple(own), checked, stack)
    order = _order(folder, own)
    best_first = sorted(inner, key=lambda one: order.index(str(one)) if str(one) in order else len(order))
    checked = tuple((one, _check_inner(folder / one, full=full)) for one in _observed(map(str, best_first), observe))
    if COMPARISON in names:
        own += comparison_findings(folder, checked)
    return CheckedComparison(folder, tuple(own), checked)


def _observed(names: Iterable[str], observe: Callable[[str], None]) -> Iterator[str]:
    """Yield the names of bundles, and say which one is checked."""
    listed_names = [*names]
    for number, name in enumerate(listed_names, start=1):
        observe(f"checking {name}, {number} of {len(listed_names)}")
        yield name


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


def _check_inner(folder: Path, *, full: bool, kept: dict[str, StackedLayer] | None = None, name: str = "") -> Checked:
    """Check one of several bundles, and keep what a stack takes of it; its folder may be gone."""
    if not folder.is_dir():
        return Checked(folder, (Finding(PLAN, 1, "the folder is missing"),), None, program=False)

    def keep(planned: Plan) -> None:
        if kept is not None:
            kept[name] = stacked_layer(planned)

    return _check_plan(folder, full=full, keep=keep)


def _changes_beside(folder: Path, names: Mapping[str, str], inner: Sequence[PurePosixPath]) -> list[Finding]:
    """Return which files beside the bundles of a folder are not as they were written."""
    beside = {
        name: digest
        for name, digest in names.items()
        if not any(PurePosixPath(name).is_relative_to(one) for one in inner)
    }
    return [Finding(name, 1, reason) for name, reason in changes(folder, beside)]


def _check_stacks(
    folder: Path, names: Mapping[str, str], *, full: bool, observe: Callable[[str], None]
) -> CheckedComparison:
    """Check stacks that were compared: each by itself, and what is said of all of them."""
    places = sorted(PurePosixPath(name).parent for name in names if PurePosixPath(name).name == STACK)
    own = _changes_beside(folder, names, places)
    stacks: list[tuple[str, CheckedComparison]] = []
    for place in places:
        checked = check_folder(folder / place, full=full, observe=observe)
        assert isinstance(checked, CheckedComparison)  # noqa: S101  # It holds stack.json and no plan.json.
        stacks.append((str(place), checked))
    own += stacks_findings(folder, stacks)
    return CheckedComparison(folder, tuple(own), (), stacks=tuple(stacks))


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
