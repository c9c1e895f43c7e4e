"""`geoprint check` of whatever geoprint wrote: a bundle, or a comparison or a stack with all bundles in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path, PurePosixPath

from geoprint.account.checked import Checked, CheckedComparison, Finding
from geoprint.account.records.comparison import ComparisonRecord, PartRecord
from geoprint.account.records.rounding import read_record
from geoprint.account.verdict import ranked
from geoprint.errors import GeoprintError
from geoprint.export import EVIDENCE, PLAN
from geoprint.pipeline.bundles.contents import (
    COMPARISON,
    STACK,
    STACKS,
    bundles,
    changes,
    foreign,
    listed,
    part_folders,
)
from geoprint.pipeline.bundles.proof import read_seen
from geoprint.pipeline.checking import check_bundle
from geoprint.pipeline.folders.comparison_record import comparison_findings, stacks_findings
from geoprint.pipeline.folders.replanning import replanned
from geoprint.pipeline.folders.stack_program import check_stack
from geoprint.pipeline.folders.stack_record import finished_findings
from geoprint.pipeline.stacked.simulating import stacked_layer
from geoprint.results import Plan, StackedLayer


def check_folder(folder: Path | str, *, full: bool = False) -> Checked | CheckedComparison:
    """Check what a folder of geoprint holds: a bundle, or a comparison or a stack with all bundles in it.

    Args:
        folder: that geoprint wrote; of stacks that were compared, each is checked.
        full: whether collision check and evenness are measured again from the bundle's own files, and all of it is
            planned again and compared.

    Returns:
        What was found; nothing is opened where a file is none.

    Raises:
        InputError: geoprint did not write the folder.
    """
    folder = Path(folder)
    names = listed(folder)
    if PLAN in names:
        return _check_plan(folder, full=full)
    if found := foreign(folder, names):
        return CheckedComparison(folder, tuple(found), ())
    if STACKS in names:
        return _check_stacks(folder, names, full=full)
    inner = bundles(names)
    own = _changes_beside(folder, names, inner)
    if STACK in names:
        order = sorted(map(str, inner))
        kept: dict[str, StackedLayer] = {}
        checked = tuple((one, _check_inner(folder / one, full=full, kept=kept, name=one)) for one in order)
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
    checked = tuple((str(one), _check_inner(folder / one, full=full)) for one in best_first)
    if COMPARISON in names:
        own += comparison_findings(folder, checked)
    return CheckedComparison(folder, tuple(own), checked)


def _check_plan(folder: Path, *, full: bool, keep: Callable[[Plan], object] = lambda _: None) -> Checked:
    """Check one bundle, and where all of it is asked for, plan it again and compare."""
    checked = check_bundle(folder, full=full)
    if not full or checked.told is None:
        return checked
    if checked.told.version != version("geoprint"):
        # What another release plans differently is no damage.
        return checked
    again = replanned(folder, listed(folder), keep=keep)
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


def _check_stacks(folder: Path, names: Mapping[str, str], *, full: bool) -> CheckedComparison:
    """Check stacks that were compared: each by itself, and what is said of all of them."""
    places = sorted(PurePosixPath(name).parent for name in names if PurePosixPath(name).name == STACK)
    own = _changes_beside(folder, names, places)
    stacks: list[tuple[str, CheckedComparison]] = []
    for place in places:
        checked = check_folder(folder / place, full=full)
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
