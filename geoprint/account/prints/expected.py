"""What is said of thickness in print: its expected variation, which plans cannot be told apart, what to mend first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

from geoprint.account.records.comparison import PlannedRecord
from geoprint.account.records.printed import PrintedApartRecord, PrintedRecord, StandoffRecord, VarianceRecord
from geoprint.account.records.rounding import listed
from geoprint.quality import Printed, alike, difference
from geoprint.report import Row
from geoprint.results import Plan

# What each error is in words, by its key in the cell without the unit.
WORDS: Mapping[str, str] = {
    "run_flow": "how the flow differs from run to run (`run_flow_share`)",
    "repeatability": "how the arm repeats from run to run (`repeatability_mm`)",
    "path_repeatability": "how the arm strays along a run (`path_repeatability_mm`)",
    "placement": "where the part stands (`placement_mm`, or touched points)",
    "needle_runout": "how the needle is bent (`needle_runout_mm`)",
    "path_accuracy": "how far the arm's paths lie off (`path_accuracy_mm`)",
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


def expected_text(told: PrintedRecord | None, *, digits: int = 2) -> str:
    """Return the variation in print and, in brackets, what 95 of 100 prints have; a dash where there is none."""
    if told is None:
        return "-"
    return f"{told.cv:.{digits}%} ({100 * told.low:.{digits}f}-{100 * told.high:.{digits}f})"


def unbroken(text: str) -> str:
    """Return a text whose interval stays in one line of a page."""
    return text.replace("-", "\N{NON-BREAKING HYPHEN}") if "(" in text else text


def expected_rows(every: Sequence[PrintedRecord | None]) -> list[Row]:
    """Return the rows of the report on thickness and stand-off in print."""
    rows = [
        Row(
            "Evenness", "printed, expected variation (CV)", f"what 95 of 100 prints have; {_whose(every)}",
            tuple(unbroken(expected_text(told)) for told in every), decides=True,
        ),
        Row(
            "Evenness", "printed, made by", "shares of the variance: plan / flow / arm / placement and needle",
            tuple(_shares(told) for told in every),
        ),
    ]  # fmt: skip
    if any(told is not None and told.standoff is not None for told in every):
        meaning = "95 of 100 places keep within, by the arm alone; of the stand-off"
        rows.append(Row("Evenness", "printed, stand-off off by [mm]", meaning, tuple(map(_standoff, every))))
    return rows


def in_print(order: Sequence[PlannedRecord], apart: Sequence[PrintedApartRecord]) -> tuple[str, ...]:
    """Return sentences on what the cell makes of paths: who cannot be told apart, and what to mend first.

    Args:
        order: backends, the best first.
        apart: how far every two are apart in print.
    """
    told = [(row.backend, row.uniformity.printed) for row in order if row.uniformity.printed is not None]
    if not told:
        return ()
    best, of_best = told[0]
    varies = listed([f"{expected_text(printed, digits=1)} with {name}" for name, printed in told])
    same = [best, *(name for name, _ in told[1:] if _indistinguishable(best, name, apart))]
    verdict = ""
    if len(told) > 1:
        which = "they" if len(same) == len(told) else listed(same)
        verdict = (
            f": {which} are indistinguishable on this cell"
            if len(same) > 1
            else f": {best} can be told from {'the others' if len(told) > 2 else 'the other'}"
        )
    return (
        f"In print the thickness is expected to vary by {varies}, in brackets what 95 of 100 prints have{verdict}.",
        _mend(best, of_best),
    )


def _mend(name: str, told: PrintedRecord) -> str:
    whose = "" if told.errors == "cell" else " Errors are those of the packaged cell; give yours in its [errors]."
    if told.mend_first is None:
        return f"What varies in print is the plan of {name}: {told.shares.plan:.0%} of the variance.{whose}"
    share = dict(told.shares)[told.mend_first]
    return f"To mend first: {WORDS[told.mend_first]}, {share:.0%} of the variance of {name} in print.{whose}"


def _apart(one: tuple[str, Printed], other: tuple[str, Printed]) -> PrintedApartRecord:
    mean, low, high = difference(one[1], other[1])
    return PrintedApartRecord(
        backends=(one[0], other[0]), mean=mean, low=low, high=high, indistinguishable=alike(one[1], other[1])
    )


def _indistinguishable(one: str, other: str, apart: Sequence[PrintedApartRecord]) -> bool:
    return any(each.indistinguishable and set(each.backends) == {one, other} for each in apart)


def _whose(every: Sequence[PrintedRecord | None]) -> str:
    own = any(told is not None and told.errors == "cell" for told in every)
    return "errors of the cell" if own else "errors of the packaged cell"


def _shares(told: PrintedRecord | None) -> str:
    if told is None:
        return "-"
    shares = told.shares
    arm = shares.repeatability + shares.path_repeatability + shares.path_accuracy
    rest = shares.placement + shares.needle_runout
    return f"{shares.plan:.0%} / {shares.run_flow:.0%} / {arm:.0%} / {rest:.0%}"


def _standoff(record: PrintedRecord | None) -> str:
    if record is None or record.standoff is None:
        return "-"
    within, wanted = record.standoff.within_mm, record.standoff.wanted_mm
    if within is None:
        return "path accuracy not measured"
    return f"\N{PLUS-MINUS SIGN}{within:.2f}, {within / wanted:.0%} of {wanted:g}"
