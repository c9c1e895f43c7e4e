"""What compare.json and stacks.json say, held against plan.json and stack.json of what they compare."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from geoprint.account.checked import Checked, CheckedComparison, Finding
from geoprint.account.records.comparison import ComparisonRecord, PartRecord, PlannedRecord
from geoprint.account.records.plan import PlanRecord
from geoprint.account.records.rounding import as_json, read_record
from geoprint.account.records.stack_comparison import RefusedStackRecord, StackComparisonRecord
from geoprint.account.stacked.comparison import best_stack, compared_stack, stack_verdict
from geoprint.account.verdict import ranked
from geoprint.errors import GeoprintError
from geoprint.export import Json
from geoprint.pipeline.bundles.contents import COMPARISON, STACKS, part_folders
from geoprint.pipeline.bundles.figures import figures


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
    plans = {name: one.told for name, one in checked}
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
                yield Finding(COMPARISON, 1, f"{at} tells of a plan, but {place}{one.backend} holds none")
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
    told = {name: one.stack.told for name, one in stacks if one.stack is not None and one.stack.told is not None}
    planned = [row.backend for row in said.backends if not isinstance(row, RefusedStackRecord)]
    if sorted(planned) != sorted(told):
        yield Finding(STACKS, 1, f"it tells of {', '.join(planned)}, stacks are of {', '.join(told) or 'none'}")
        return
    asked = any(not isinstance(row, RefusedStackRecord) and row.printable is not None for row in said.backends)
    rows = [
        row if isinstance(row, RefusedStackRecord) else compared_stack(row.backend, told[row.backend], asked=asked)
        for row in said.backends
    ]
    first = told[planned[0]]
    found: dict[str, Json] = {
        "part": first.part,
        "thickness_mm": first.thickness_mm,
        "layers": len(first.layers),
        "verdict": [*stack_verdict(rows, part=said.part)],
        "best": best_stack(rows)[0].backend,
        "backends": [as_json(row) for row in rows],
    }
    yield from figures(STACKS, "", as_json(said), found)
