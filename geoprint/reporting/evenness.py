"""From the measured evenness of paths to what files say of it: expected print and overhang included."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

import numpy as np

from geoprint.errors import how_many, percent
from geoprint.metrics import (
    DistanceErrors,
    LevelSpacings,
    Printed,
    SpacingFigures,
    Uniformity,
    alike,
    difference,
    overhang,
)
from geoprint.reporting.records.comparison import PlannedRecord
from geoprint.reporting.records.evenness import (
    DistanceRecord,
    EvennessRecord,
    LevelSpacingsRecord,
    OverhangPlaceRecord,
    OverhangRecord,
    PrintedApartRecord,
    PrintedRecord,
    SpacingRecord,
    SpacingSideRecord,
    StandoffRecord,
    StraightRecord,
    TableAttitudeRecord,
    TableRecord,
    VarianceRecord,
)
from geoprint.reporting.records.rounding import listed, place_of
from geoprint.reporting.values import Row
from geoprint.results import Plan, Tilting

# From the measured evenness of paths to what files say of it.


# Places listed where the spacing is farthest from wanted.
WORST_PLACES = 5


def record_evenness(
    measured: Uniformity, *, distance: DistanceErrors | None = None, printed: PrintedRecord | None = None
) -> EvennessRecord:
    """Return the figures of `uniformity` and `measure_paths` as files carry them.

    Args:
        measured: evenness.
        distance: how far the backend's level curves lie from what they promise.
        printed: what is expected of prints.
    """
    return EvennessRecord.of(
        measured,
        following=measured.followed,
        largest_hole_mm2=measured.hole,
        area_unknown=measured.unknown,
        distance=None if distance is None else DistanceRecord.of(distance, samples=distance.errors.size),
        printed=printed,
        left=_side(measured.sides.left),
        right=_side(measured.sides.right),
        both=_side(measured.sides.both),
        levels=None if measured.levels is None else _levels(measured.levels, spacing=measured.spacing),
    )


def _spacing(found: SpacingFigures) -> SpacingRecord | None:
    if not found.measured:
        return None
    percentiles = {f"p{share}": found.percentile(share) for share in (1, 5, 50, 95, 99)}
    return SpacingRecord.of(found, **percentiles, max=found.percentile(100))


def _side(found: SpacingFigures) -> SpacingSideRecord:
    return SpacingSideRecord.of(found, spacing=_spacing(found), samples=found.ratios.size)


def _levels(found: LevelSpacings, *, spacing: float) -> LevelSpacingsRecord:
    straight = found.straight
    return LevelSpacingsRecord(
        spacing=_spacing(found.figures),
        straight=(
            StraightRecord(mean=float(straight.mean()), cv=float(straight.std() / straight.mean()))
            if found.ratios.size
            else None
        ),
        samples=len(found.ratios),
        samples_bounded=found.bounded,
        largest_doubt=found.largest_doubt,
        samples_unreached=found.unreached,
        samples_where_fronts_meet=found.meeting,
        each=found.by_level(),
        worst_places=found.worst(WORST_PLACES, spacing=spacing),
    )


# What is said of thickness in print: its expected variation, which plans cannot be told apart, what to fix first.


# What each error is in words, by its key in the cell without the unit.
WORDS: Mapping[str, str] = {
    "run_flow": "flow differences between runs (`run_flow_share`)",
    "repeatability": "repeatability of the arm between runs (`repeatability_mm`)",
    "path_repeatability": "path repeatability of the arm (`path_repeatability_mm`)",
    "placement": "placement of the part (`placement_mm`, or touched points)",
    "needle_runout": "runout of the needle (`needle_runout_mm`)",
    "path_accuracy": "path accuracy of the arm (`path_accuracy_mm`)",
}


def record_printed(
    found: Printed | None, *, of_cell: bool, standoff: StandoffRecord | None = None
) -> PrintedRecord | None:
    """Return what is said of the thickness in print; nothing where nobody expects one.

    Args:
        found: as sampled.
        of_cell: whether the errors are those of a cell that was given.
        standoff: what is expected of it; None for paths of a file.
    """
    if found is None:
        return None
    mean, low, high = found.cv
    return PrintedRecord(
        cv=mean,
        low=low,
        high=high,
        shares=VarianceRecord(**found.shares),
        mend_first=found.largest_error,
        errors="cell" if of_cell else "packaged cell",
        standoff=standoff,
    )


def says_errors(plan: Plan) -> bool:
    """Return whether the cell of a plan was given and says how far a print strays."""
    return plan.job.cell is not None and plan.workpiece.cell.errors is not None


def record_apart(plans: Sequence[tuple[str, Plan]]) -> tuple[PrintedApartRecord, ...]:
    """Return how far every two plans are apart in print."""
    found = [(name, plan.printed) for name, plan in plans if plan.printed is not None]
    return tuple(_apart(one, other) for one, other in combinations(found, 2))


def expected_text(record: PrintedRecord | None, *, digits: int = 2) -> str:
    """Return the variation in print and, in brackets, what 95 of 100 prints have; a dash where there is none."""
    if record is None:
        return "-"
    return f"{percent(record.cv, digits)} ({100 * record.low:.{digits}f}-{100 * record.high:.{digits}f})"


def unbroken(text: str) -> str:
    """Return a text whose interval stays in one line of a page."""
    return text.replace("-", "\N{NON-BREAKING HYPHEN}") if "(" in text else text


def expected_rows(every: Sequence[PrintedRecord | None]) -> list[Row]:
    """Return the rows of the report on thickness and stand-off in print."""
    rows = [
        Row(
            "Evenness", "printed, expected variation (CV)", f"95 % interval in brackets; {_whose(every)}",
            tuple(unbroken(expected_text(record)) for record in every), decides=True,
        ),
        Row(
            "Evenness", "printed, sources of variation",
            "shares of the variance: plan / flow / arm / placement and needle",
            tuple(_shares(record) for record in every),
        ),
    ]  # fmt: skip
    if any(record is not None and record.standoff is not None for record in every):
        meaning = "by the arm alone, at 95 of 100 points; share of the stand-off"
        rows.append(Row("Evenness", "printed, stand-off error [mm]", meaning, tuple(map(_standoff, every))))
    return rows


def in_print(order: Sequence[PlannedRecord], apart: Sequence[PrintedApartRecord]) -> tuple[str, ...]:
    """Return sentences on what the cell makes of paths: who cannot be told apart, and what to fix first.

    Args:
        order: backends, the best first.
        apart: how far every two are apart in print.
    """
    record = [(row.backend, row.uniformity.printed) for row in order if row.uniformity.printed is not None]
    if not record:
        return ()
    best, of_best = record[0]
    varies = listed([f"{expected_text(printed, digits=1)} with {name}" for name, printed in record])
    same = [best, *(name for name, _ in record[1:] if _indistinguishable(best, name, apart))]
    verdict = ""
    if len(record) > 1:
        which = "they" if len(same) == len(record) else listed(same)
        verdict = (
            f". On this cell, {which} are indistinguishable"
            if len(same) > 1
            else f". {best} differs measurably from {'the others' if len(record) > 2 else 'the other'}"
        )
    return (
        f"In print, thickness is expected to vary by {varies} (95 % interval in brackets){verdict}.",
        _fix(best, of_best),
    )


def _fix(name: str, record: PrintedRecord) -> str:
    whose = "" if record.errors == "cell" else " These are errors of the packaged cell: state yours in [errors]."
    if record.mend_first is None:
        return (
            f"Largest error source: the plan of {name} itself, {percent(record.shares.plan)} of its variance in "
            f"print.{whose}"
        )
    share = dict(record.shares)[record.mend_first]
    return (
        f"Largest error source: {WORDS[record.mend_first]}, {percent(share)} of the variance of {name} in print.{whose}"
    )


def _apart(one: tuple[str, Printed], other: tuple[str, Printed]) -> PrintedApartRecord:
    mean, low, high = difference(one[1], other[1])
    return PrintedApartRecord(
        backends=(one[0], other[0]), mean=mean, low=low, high=high, indistinguishable=alike(one[1], other[1])
    )


def _indistinguishable(one: str, other: str, apart: Sequence[PrintedApartRecord]) -> bool:
    return any(each.indistinguishable and set(each.backends) == {one, other} for each in apart)


def _whose(every: Sequence[PrintedRecord | None]) -> str:
    own = any(record is not None and record.errors == "cell" for record in every)
    return "errors of the cell" if own else "errors of the packaged cell"


def _shares(record: PrintedRecord | None) -> str:
    if record is None:
        return "-"
    shares = record.shares
    arm = shares.repeatability + shares.path_repeatability + shares.path_accuracy
    rest = shares.placement + shares.needle_runout
    return f"{100 * shares.plan:.0f} / {100 * shares.run_flow:.0f} / {100 * arm:.0f} / {percent(rest)}"


def _standoff(record: PrintedRecord | None) -> str:
    if record is None or record.standoff is None:
        return "-"
    within, wanted = record.standoff.within_mm, record.standoff.wanted_mm
    if within is None:
        return "path accuracy not measured"
    return f"\N{PLUS-MINUS SIGN}{within:.2f}, {percent(within / wanted)} of {wanted:g}"


# What is said of overhang: as files record it, in a line, and in the rows of a report.
#
# Where the cell's [material] states no critical angle it is a detail, in the report and with --verbose; a table that
# tilts by it is always stated.


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
            f"overhang: {percent(record.share, 1)} of the deposit, {record.length_mm:.0f} mm, beyond {critical} "
            f"from upright; {worst.angle_deg:.0f} degrees in run {worst.run + 1} at ({place})"
        )
    return [text] if record.table is None else [text, table_text(record.table)]


def table_text(record: TableRecord) -> str:
    """Return the line on the attitudes of a table, and what still overhangs with them."""
    left = "nothing overhangs"
    if record.length_mm > 0.0:
        left = f"{record.length_mm:.0f} mm still overhang, by up to {record.missing_deg:.0f} degrees more"
    count = how_many(len(record.attitudes), "attitude")
    order = f"parts of runs grouped by attitude; {record.moves_kept} in their own order"
    kept = f"runs in their own order; {record.moves_gathered} with parts of runs grouped"
    return (
        f"{record.name}: {count}, {order if record.order == 'gathered' else kept}; {left}; "
        f"moves take {sum(one.move_s for one in record.attitudes):.0f} s at least"
    )


def table_sentences(rows: Sequence[PlannedRecord]) -> list[str]:
    """Return the sentence on what overhangs of each backend's paths, at rest and over the table; none without one."""
    record = [(row.backend, row.overhang) for row in rows if row.overhang is not None]
    with_tables = [(backend, one.length_mm, one.table) for backend, one in record if one.table is not None]
    each = [
        f"{length:.0f} mm without the table, with {backend} and {_left(table)}"
        for backend, length, table in with_tables
    ]
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
    record = [row.overhang for row in rows if row.overhang is not None]
    if not record:
        return []
    critical = f"{record[0].critical_deg:g} degrees{ASSUMED if record[0].assumed else ''}"
    meaning = f"outward normal farther than {critical} from upright, as the part stands"
    found = [
        _row(rows, "deposit that overhangs", meaning, lambda one: f"{percent(one.share, 1)}, {one.length_mm:.0f} mm"),
        _row(rows, "steepest bead [degrees]", "0 on level ground, 90 on a wall", lambda one: f"{one.largest_deg:.1f}"),
    ]
    if record[0].table is not None:
        tilted = f"with the {record[0].table.name}: attitudes, and what still overhangs"
        found.append(_row(rows, "attitudes of the table", tilted, _with_table))
    return found


def _with_table(record: OverhangRecord) -> str:
    if record.table is None:
        return "-"
    return f"{len(record.table.attitudes)}; {record.table.length_mm:.0f} mm"


def _row(rows: Sequence[PlannedRecord], quantity: str, meaning: str, text: Callable[[OverhangRecord], str]) -> Row:
    return Row(
        "Overhang", quantity, meaning, tuple("-" if row.overhang is None else text(row.overhang) for row in rows)
    )
