"""The spacing to the left and to the right of paths: as files tell it, and in a few words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from geoprint.account.prints.expected import record_printed
from geoprint.account.records.comparison import PlannedRecord
from geoprint.account.records.plan import EvennessRecord
from geoprint.account.records.spacing import SpacingRecord, SpacingSideRecord
from geoprint.quality import Printed, SideFigures
from geoprint.report import Row

Told = TypeVar("Told", str, float)


def record_side(figures: SideFigures, printed: Printed | None = None, *, own_errors: bool = False) -> SpacingSideRecord:
    """Return the figures of one side or both.

    Args:
        figures: of it.
        printed: what prints are expected to have; None where nobody expects one.
        own_errors: whether the cell says by itself what a print strays by.
    """
    spacing = None
    if figures.measured:
        p1, p5, p50, p95, p99, largest = (figures.percentile(share) for share in (1, 5, 50, 95, 99, 100))
        spacing = SpacingRecord(
            mean=figures.mean, cv=figures.cv, p1=p1, p5=p5, p50=p50, p95=p95, p99=p99, max=largest,
            within_5_percent=figures.within_5_percent,
        )  # fmt: skip
    return SpacingSideRecord(
        spacing=spacing,
        printed=record_printed(printed, of_cell=own_errors),
        samples=figures.ratios.size,
        none=figures.none,
        oblique=figures.oblique,
        unknown=figures.unknown,
    )


def variation_text(told: EvennessRecord, *, digits: int = 2) -> str | None:
    """Return by how much the spacing varies, on either side where runs have no level; None where there is none.

    Args:
        told: of the paths.
        digits: behind the point of a per cent.
    """
    if told.spacing is None:
        return None
    sides = [(name, side.spacing) for name, side in (("left", told.left), ("right", told.right)) if side is not None]
    if not sides:
        return f"{told.spacing.cv:.{digits}%}"
    each = [f"{'-' if spacing is None else f'{spacing.cv:.{digits}%}'} to the {name}" for name, spacing in sides]
    return " and ".join(each)


def of_spacing(row: PlannedRecord, figure: Callable[[SpacingRecord], Told], otherwise: Told) -> Told:
    """Return a figure of a backend's spacing, or another value where there is but one level and so no spacing."""
    return otherwise if row.uniformity.spacing is None else figure(row.uniformity.spacing)


def side_rows(rows: Sequence[PlannedRecord]) -> list[Row]:
    """Return the rows of a report on either side of paths whose runs have no level; none where all runs have one.

    Args:
        rows: of compare.json, a column each.
    """
    if not any(row.uniformity.left for row in rows):
        return []
    columns = {
        "left": [row.uniformity.left for row in rows],
        "right": [row.uniformity.right for row in rows],
    }
    return [
        Row(
            "Evenness",
            f"spacing to the {name}, variation (CV), 1st and 99th percentile",
            "as seen from outside along the path",
            tuple(_side(side) for side in sides),
        )
        for name, sides in columns.items()
    ]


def _side(side: SpacingSideRecord | None) -> str:
    if side is None or side.spacing is None:
        return "-"
    return f"{side.spacing.cv:.2%}, {side.spacing.p1:.3f} - {side.spacing.p99:.3f}"
