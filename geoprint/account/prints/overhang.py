"""What is said of overhang: as files tell it, in a line, and in the rows of a report."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from geoprint.account.records.comparison import PlannedRecord
from geoprint.account.records.overhang import OverhangPlaceRecord, OverhangRecord
from geoprint.account.records.rounding import place_of
from geoprint.quality import overhang
from geoprint.report import Row
from geoprint.results import Plan


def record_overhang(plan: Plan) -> OverhangRecord:
    """Return what of a plan overhangs as its part stands; without a placement, with its mean normal up."""
    poses, workpiece = plan.poses, plan.workpiece
    # The base's z axis is up, and so is the row of the rotation that makes it.
    found = overhang(poses, up=workpiece.upright[2], critical=workpiece.cell.process.overhang)
    return OverhangRecord(
        critical_deg=float(np.degrees(found.critical)),
        share=found.share,
        length_mm=found.length,
        largest_deg=float(np.degrees(found.largest)),
        worst_places=tuple(
            OverhangPlaceRecord(run=int(poses.runs[row]), place_mm=place_of(place), angle_deg=float(np.degrees(angle)))
            for row, place, angle in zip(found.rows, poses.surface_points[found.rows], found.angles, strict=True)
        ),
    )


def overhang_text(told: OverhangRecord) -> str:
    """Return the line on how much overhangs and where most, or that nothing does."""
    if not told.worst_places:
        return f"overhang: none beyond {told.critical_deg:g} degrees, the steepest bead at {told.largest_deg:.0f}"
    worst = told.worst_places[0]
    place = ", ".join(f"{mm:.1f}" for mm in worst.place_mm)
    return (
        f"overhang: {told.share:.1%} of the deposit, {told.length_mm:.0f} mm, beyond {told.critical_deg:g} degrees "
        f"from upright; {worst.angle_deg:.0f} degrees in run {worst.run + 1} at ({place})"
    )


def overhang_rows(rows: Sequence[PlannedRecord]) -> list[Row]:
    """Return the rows of a report on overhang; none where it was not measured.

    Args:
        rows: of compare.json, a column each.
    """
    told = [row.overhang for row in rows if row.overhang is not None]
    if not told:
        return []
    meaning = f"outward normal farther than {told[0].critical_deg:g} degrees from upright, as the part stands"
    return [
        _row(rows, "deposit that overhangs", meaning, lambda one: f"{one.share:.1%}, {one.length_mm:.0f} mm"),
        _row(rows, "steepest bead [degrees]", "0 on level ground, 90 on a wall", lambda one: f"{one.largest_deg:.1f}"),
    ]


def _row(rows: Sequence[PlannedRecord], quantity: str, meaning: str, text: Callable[[OverhangRecord], str]) -> Row:
    return Row(
        "Overhang", quantity, meaning, tuple("-" if row.overhang is None else text(row.overhang) for row in rows)
    )
