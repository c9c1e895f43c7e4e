"""`geoprint check` of whatever geoprint wrote: a bundle, or a comparison or a stack with all bundles in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path, PurePosixPath

from geoprint.account.checked import Checked, CheckedComparison, CheckedStack, Finding
from geoprint.account.records.comparison import ComparisonRecord, PartRecord
from geoprint.account.records.rounding import read_record
from geoprint.account.verdict import ranked
from geoprint.errors import GeoprintError, InputError
from geoprint.export import EVIDENCE, PLAN
from geoprint.pipeline.bundles.contents import COMPARISON, STACK, STACKS, bundles, changes, listed, part_folders
from geoprint.pipeline.bundles.proof import read_seen
from geoprint.pipeline.checking import check_bundle
from geoprint.pipeline.folders.stack_program import check_stack


def check_folder(folder: Path | str, *, full: bool = False) -> Checked | CheckedComparison:
    """Check what a folder holds: a bundle, or a comparison or a stack with all bundles in it.

    Args:
        folder: that `geoprint plan` or `compare` wrote.
        full: as for `check_bundle`.

    Raises:
        InputError: geoprint did not write the folder, or it holds compared stacks.
    """
    folder = Path(folder)
    names = listed(folder)
    if PLAN in names:
        return check_bundle(folder, full=full)
    stacks = [str(folder / PurePosixPath(name).parent) for name in names if PurePosixPath(name).name == STACK]
    if STACKS in names:
        raise InputError(f"{folder} holds compared stacks; check one of them: {' or '.join(stacks)}.")
    inner = bundles(names)
    beside = {
        name: digest
        for name, digest in names.items()
        if not any(PurePosixPath(name).is_relative_to(one) for one in inner)
    }
    own = [Finding(name, 1, reason) for name, reason in changes(folder, beside)]
    stack: CheckedStack | None = None
    order = sorted(map(str, inner)) if STACK in names else _order(folder, own)
    best_first = sorted(inner, key=lambda one: order.index(str(one)) if str(one) in order else len(order))
    checked = tuple((str(one), _check_inner(folder / one, full=full)) for one in best_first)
    if STACK in names:
        sound = not any(one.findings for _, one in checked)
        found, stack = check_stack(folder, names, sound=sound)
        said = {finding.file for finding in found}
        own = [*found, *(finding for finding in own if finding.file not in said)]
        try:
            stack = replace(stack, seen=read_seen(folder))
        except GeoprintError as error:
            own.append(Finding(EVIDENCE, 1, str(error)))
    return CheckedComparison(folder, tuple(own), checked, stack)


def _check_inner(folder: Path, *, full: bool) -> Checked:
    """Check one of several bundles; its folder may be gone."""
    if folder.is_dir():
        return check_bundle(folder, full=full)
    return Checked(folder, (Finding(PLAN, 1, "the folder is missing"),), None, program=False)


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
