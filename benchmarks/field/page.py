"""The page of the comparison of planners: medians with their intervals, families, reasons, and the least even."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.field.figures import HEADS, Figures, field_picture, standings
from benchmarks.field.study import RECORD
from geoprint.errors import how_many, percent
from geoprint.reporting.html import Markup, element, figure, row_table
from geoprint.reporting.page import page
from geoprint.reporting.values import Picture
from geoprint.sweep import Outcome, Study
from geoprint.sweep.report import MOST_WORST, reasons
from geoprint.sweep.running import CELLS

TITLE = "Planners on the same parts"


def field_page(found: Sequence[Figures], study: Study, *, hours: float) -> bytes:
    """Return the page of all figures of a study, in the order of its cells; it opens offline."""
    parts = {each.part: each.family for each in found}
    body = [
        element("h1", TITLE),
        element(
            "p",
            f"{how_many(len(parts), 'part')}, {how_many(len(found), 'cell')}, {hours:.2f} h of processor time. Medians "
            "are over all parts of a planner, where one that it refused is worse than any; in brackets their 95 % "
            "intervals. The last column is the share of parts that either planned on which a planner is more even "
            "than the first.",
        ),
        row_table(HEADS, list(standings(found)), label="planners over all parts"),
        figure(Picture("A dot a part, a bar the median of those that were planned.", "png", field_picture(found))),
    ]
    for family in dict.fromkeys(parts.values()):
        some = [each for each in found if each.family == family]
        body += [element("h2", f"Parts: {family}"), row_table(HEADS, list(standings(some)), label=family)]
    body += [element("h2", "The least even of geoprint"), _worst(found, study)]
    outcomes = [
        Outcome(cell, each.status, each.reason, None) for each, cell in zip(found, study.cells, strict=True)
    ]  # fmt: skip
    if not all(each.done for each in found):
        body += [element("h2", "Why there are no paths"), reasons(outcomes)]
    return page(TITLE, body, {})


def _worst(found: Sequence[Figures], study: Study) -> Markup:
    """Return the least even paths of our first planner."""
    cells = zip(found, study.cells, strict=True)
    done = [(each, cell) for each, cell in cells if each.done and each.planner == found[0].planner]
    done.sort(key=lambda pair: -pair[0].thickness_cv)
    rows = [
        [
            element("a", cell.name, href=f"{CELLS}/{cell.name}/{RECORD}"),
            percent(each.thickness_cv, 2), percent(each.following_cv, 2), percent(each.gap, 2),
            percent(each.overlap, 2),
        ]
        for each, cell in done[:MOST_WORST]
    ]  # fmt: skip
    return row_table(["cell", "thickness CV", "with a flow that follows", "gap", "overlap"], rows, label="least even")
