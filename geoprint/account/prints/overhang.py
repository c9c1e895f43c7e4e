"""What is said of overhang: as files record it, in a line, and in the rows of a report.

Where the cell's [material] states no critical angle it is a detail, in the report and with --verbose; a table that
tilts by it is always stated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from geoprint.account.records.comparison import PlannedRecord
from geoprint.account.records.overhang import OverhangPlaceRecord, OverhangRecord, TableAttitudeRecord, TableRecord
from geoprint.account.records.rounding import how_many, place_of
from geoprint.quality import overhang
from geoprint.report import Row
from geoprint.results import Plan, Tilting

# Behind a critical angle that nobody has stated.
ASSUMED = " (assumed: [material] states no overhang_deg)"


def record_overhang(plan: Plan) -> OverhangRecord:
    """Return what of a plan overhangs as its part stands; without a placement, with its mean normal up."""
    poses, workpiece = plan.poses, plan.workpiece
    # The base's z axis is up, and so is the row of the rotation that makes it.
    found = overhang(poses, up=workpiece.upright[2], critical=workpiece.cell.critical_overhang)
    return OverhangRecord(
        critical_deg=float(np.degrees(found.critical)),
        assumed=workpiece.cell.overhang is None,
        share=found.share,
        length_mm=found.length,
        largest_deg=float(np.degrees(found.largest)),
        worst_places=tuple(
            OverhangPlaceRecord(run=int(poses.runs[row]), place_mm=place_of(place), angle_deg=float(np.degrees(angle)))
            for row, place, angle in zip(found.rows, poses.surface_points[found.rows], found.angles, strict=True)
        ),
        table=None if plan.tilting is None else _table(plan.tilting),
    )


def _table(found: Tilting) -> TableRecord:
    kept, by_attitude = found.moves
    return TableRecord(
        name=found.table,
        rotary=found.rotary,
        refused=found.refused,
        order=found.order,
        moves_kept=kept,
        moves_gathered=by_attitude,
        length_mm=found.overhanging,
        missing_deg=float(np.degrees(found.missing)),
        attitudes=tuple(
            TableAttitudeRecord(
                up=place_of(one.up),
                axes=tuple((np.degrees(axes) if found.rotary else axes).tolist()),
                slack=one.slack,
                length_mm=length,
                pieces=len(one.pieces),
                move_s=seconds,
            )
            for one, axes, length, seconds in zip(
                found.attitudes, found.axes, found.lengths, found.seconds, strict=True
            )
        ),
    )


def overhang_lines(record: OverhangRecord, *, verbose: bool) -> list[str]:
    """Return the lines on how much overhangs and where most, and on the attitudes of a table that tilts."""
    if not (record.stated or verbose):
        return []
    critical = f"{record.critical_deg:g} degrees{ASSUMED if record.assumed else ''}"
    text = f"overhang: none beyond {critical}, the steepest bead at {record.largest_deg:.0f}"
    if record.worst_places:
        worst = record.worst_places[0]
        place = ", ".join(f"{mm:.1f}" for mm in worst.place_mm)
        text = (
            f"overhang: {record.share:.1%} of the deposit, {record.length_mm:.0f} mm, beyond {critical} "
            f"from upright; {worst.angle_deg:.0f} degrees in run {worst.run + 1} at ({place})"
        )
    return [text] if record.table is None else [text, table_text(record.table)]


def table_text(told: TableRecord) -> str:
    """Return the line on the attitudes of a table, and what still overhangs with them."""
    left = "nothing overhangs then"
    if told.length_mm > 0.0:
        left = f"{told.length_mm:.0f} mm overhang still, by up to {told.missing_deg:.0f} degrees more"
    count = how_many(len(told.attitudes), "attitude")
    order = f"pieces of runs gathered by attitude; {told.moves_kept} in their own order"
    kept = f"runs in their own order; {told.moves_gathered} with pieces of them gathered"
    return (
        f"{told.name}: {count}, {order if told.order == 'gathered' else kept}; {left}; "
        f"moves take {sum(one.move_s for one in told.attitudes):.0f} s at least"
    )


def table_sentences(rows: Sequence[PlannedRecord]) -> list[str]:
    """Return the sentence on what overhangs of each backend's paths, at rest and over the table; none without one."""
    told = [(row.backend, row.overhang) for row in rows if row.overhang is not None]
    with_tables = [(backend, one.length_mm, one.table) for backend, one in told if one.table is not None]
    each = [f"{length:.0f} mm at rest with {backend} and {_left(table)}" for backend, length, table in with_tables]
    return [f"Overhang: {'; '.join(each)}."] if each else []


def _left(table: TableRecord) -> str:
    count = len(table.attitudes)
    over = f"over the {table.name} in {how_many(count, 'attitude')}"
    if table.length_mm == 0.0:
        return f"nothing {over}"
    return f"{table.length_mm:.0f} mm {over}, up to {table.missing_deg:.0f} degrees beyond the critical angle"


def overhang_rows(rows: Sequence[PlannedRecord]) -> list[Row]:
    """Return the rows of a report on overhang; none where it was not measured.

    Args:
        rows: of compare.json, a column each.
    """
    told = [row.overhang for row in rows if row.overhang is not None]
    if not told:
        return []
    critical = f"{told[0].critical_deg:g} degrees{ASSUMED if told[0].assumed else ''}"
    meaning = f"outward normal farther than {critical} from upright, as the part stands"
    found = [
        _row(rows, "deposit that overhangs", meaning, lambda one: f"{one.share:.1%}, {one.length_mm:.0f} mm"),
        _row(rows, "steepest bead [degrees]", "0 on level ground, 90 on a wall", lambda one: f"{one.largest_deg:.1f}"),
    ]
    if told[0].table is not None:
        tilted = f"with the {told[0].table.name}: attitudes, and what overhangs still"
        found.append(_row(rows, "attitudes of the table", tilted, _with_table))
    return found


def _with_table(told: OverhangRecord) -> str:
    if told.table is None:
        return "-"
    return f"{len(told.table.attitudes)}; {told.table.length_mm:.0f} mm"


def _row(rows: Sequence[PlannedRecord], quantity: str, meaning: str, text: Callable[[OverhangRecord], str]) -> Row:
    return Row(
        "Overhang", quantity, meaning, tuple("-" if row.overhang is None else text(row.overhang) for row in rows)
    )
