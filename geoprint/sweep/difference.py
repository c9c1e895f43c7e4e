"""What differs between two results: settings, figures, and how far the paths lie apart."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from geoprint.errors import InputError, how_many
from geoprint.metrics import agreement
from geoprint.reporting import as_json, read_record
from geoprint.reporting.metrics import CATALOGUE
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import Record
from geoprint.sweep.running import CELLS
from geoprint.workflow.bundles import bundles, listed, stream_of
from geoprint.workflow.check_inputs import differences

# Settings and figures that are written out; more are counted, and stand in the JSON.
MOST_LINES = 12


class ChangeRecord(Record):
    """A value that is another one in the second result; null where one of them has none."""

    key: str
    first: Any
    second: Any


class PlanDifferenceRecord(Record):
    """What differs between two plans of one name.

    Attributes:
        plan: its folder within both results; `.` where they are plans themselves.
        same_part: whether both are of the same file, byte for byte.
        settings: that differ.
        figures: that differ.
        largest_apart_mm: largest distance from a point of either's paths to the other's [mm].
        mean_apart_mm: mean of these distances [mm].
    """

    plan: str
    same_part: bool
    settings: tuple[ChangeRecord, ...]
    figures: tuple[ChangeRecord, ...]
    largest_apart_mm: float
    mean_apart_mm: float

    @property
    def same(self) -> bool:
        """Whether nothing differs."""
        return self.same_part and not self.settings and not self.figures and self.largest_apart_mm == 0.0


class DifferenceRecord(Record):
    """What differs between two results.

    Attributes:
        plans: of both.
        only_first: plans that the first alone has.
        only_second: plans that the second alone has.
    """

    plans: tuple[PlanDifferenceRecord, ...]
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]


def difference(first: Path, second: Path) -> DifferenceRecord:
    """Compare two plans, comparisons or studies, plan by plan.

    Raises:
        InputError: one of them is no result of geoprint, or they have no plan in common.
        VerificationError: a file cannot be read.
    """
    one, other = _plans(first), _plans(second)
    # A plan is compared with a plan, whatever their folders are called.
    common = [name for name in one if name in other]
    if not common:
        raise InputError(
            f"{first} and {second} have no plan of one name: {_named(one)} there, {_named(other)} here; name the "
            "folders of two plans."
        )
    return DifferenceRecord(
        plans=tuple(_between(name, one[name], other[name]) for name in common),
        only_first=tuple(name for name in one if name not in other),
        only_second=tuple(name for name in other if name not in one),
    )


def difference_text(record: DifferenceRecord) -> str:
    """Return what a person reads of it."""
    lines = [line for plan in record.plans for line in _plan_lines(plan)]
    for which, names in (("first", record.only_first), ("second", record.only_second)):
        if names:
            lines.append(f"only in the {which}: {', '.join(names)}")
    return "\n".join(lines)


def _plan_lines(plan: PlanDifferenceRecord) -> Iterator[str]:
    name = "the plan" if plan.plan == "." else plan.plan
    if plan.same:
        yield f"{name}: the same"
        return
    apart = f"{plan.largest_apart_mm:.3g} mm apart at most, {plan.mean_apart_mm:.3g} mm on average"
    part = "" if plan.same_part else "; of another part"
    yield f"{name}: {'paths are the same' if plan.largest_apart_mm == 0.0 else f'paths {apart}'}{part}"
    changes = [*plan.settings, *plan.figures]
    for change in changes[:MOST_LINES]:
        yield f"  {change.key}: {_text(change.first)} -> {_text(change.second)}"
    if len(changes) > MOST_LINES:
        yield f"  and {how_many(len(changes) - MOST_LINES, 'other')}, see `--json`"


def _text(value: object) -> str:
    return "none" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def _named(plans: dict[str, Path]) -> str:
    names = ["one plan" if name == "." else name for name in plans] or ["none"]
    return f"{', '.join(names[:3])}{', ...' if len(names) > 3 else ''}"


def _plans(folder: Path) -> dict[str, Path]:
    """Return the folders of the plans of a result, by their names in it."""
    if (folder / CELLS).is_dir():
        cells = sorted(place for place in (folder / CELLS).iterdir() if place.is_dir() and place.name[0] != ".")
        return {place.name: place for place in cells}
    return {str(place): folder / place for place in bundles(listed(folder))}


def _between(name: str, first: Path, second: Path) -> PlanDifferenceRecord:
    one, other = (read_record(place / "plan.json", PlanRecord) for place in (first, second))
    spacing = min(one.settings.spacing_mm, other.settings.spacing_mm)
    apart = agreement([stream_of(first, one), stream_of(second, other)], spacing=spacing)
    return PlanDifferenceRecord(
        plan=name,
        same_part=one.input.sha256 == other.input.sha256,
        settings=_changes(as_json(one.settings), as_json(other.settings)),
        figures=_changes(_figures(one), _figures(other)),
        largest_apart_mm=round(float(apart.hausdorff[0, 1]), 6),
        mean_apart_mm=round(float(apart.mean[0, 1]), 6),
    )


def _changes(first: Any, second: Any) -> tuple[ChangeRecord, ...]:
    found = differences(first, second, near=0.0, share=0.0)
    return tuple(ChangeRecord(key=key, first=one, second=other) for key, one, other in found)


def _figures(record: PlanRecord) -> dict[str, Any]:
    """Return the figures of a plan by their names."""
    measured = record.uniformity
    found: dict[str, Any] = {} if measured is None else {metric.key: metric.of(measured) for metric in CATALOGUE}
    found |= {"runs": record.paths.runs, "deposit_mm": record.paths.deposit_mm}
    for number, robot in enumerate(record.robot, start=1):
        at = f"attitude {number}: " if len(record.robot) > 1 else ""
        found[f"{at}time_s"] = robot.motion.duration_s
        found[f"{at}clearance_mm"] = robot.clearance.smallest_mm
    return found
