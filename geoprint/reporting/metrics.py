"""The catalogue of what evenness is measured by: each figure is named, explained and written in one way everywhere.

Tables in a terminal, pages, CSV, JSON schemas and sentences take names, meanings, digits and order from here; what is
farther or nearer than which share of the spacing, from `metrics.coverage`.
"""

from __future__ import annotations

from operator import attrgetter
from typing import final

from geoprint.errors import percent
from geoprint.model import GAP_SHARE, OVERLAP_SHARE, frozen
from geoprint.reporting.records.evenness import EvennessRecord

NONE = "-"


@final
@frozen
class Metric:
    """A figure of evenness.

    Attributes:
        key: where it stands in an `EvennessRecord`, and its column in a CSV file with `_` for `.`.
        label: its name in a table of a page.
        column: its name in a table of a terminal.
        meaning: what it tells, in a few words.
        lower_is_better: whether the smaller of two is the better one; None where neither is.
        decides: whether it is among those by which coverings are ranked.
        percent: whether it is a share, written in per cent; else a number.
        digits: behind the point.
    """

    key: str
    label: str
    column: str
    meaning: str
    lower_is_better: bool | None = None
    decides: bool = False
    percent: bool = True
    digits: int = 2

    def of(self, record: EvennessRecord) -> float | None:
        """Return its value; None where it was not measured."""
        value: object = record
        for name in self.key.split("."):
            value = None if value is None else attrgetter(name)(value)
        return None if value is None else float(value)  # pyright: ignore[reportArgumentType]

    def text(self, record: EvennessRecord, *, digits: int | None = None) -> str:
        """Return its value as it is written; a dash where it was not measured."""
        value = self.of(record)
        places = self.digits if digits is None else digits
        return NONE if value is None else percent(value, places) if self.percent else f"{value:.{places}f}"

    def badness(self, record: EvennessRecord) -> float:
        """Return a number that is the smaller, the better it is."""
        value = self.of(record) or 0.0
        return value if self.lower_is_better else -value


THICKNESS = Metric(
    "thickness.cv", "layer thickness, variation (CV)", "thickness CV",
    "with constant flow, over the whole area; 0 % is perfectly even", lower_is_better=True, decides=True,
)  # fmt: skip
FOLLOWING = Metric(
    "following.cv", "layer thickness, variation with a flow that follows", "following CV",
    "flow follows the width of the strip that each stretch serves", lower_is_better=True,
)  # fmt: skip
WITHIN_10 = Metric(
    "thickness.within_10_percent", "thickness within 10 % of the target", "within 10 %",
    "share of the area, with constant flow", lower_is_better=False,
)  # fmt: skip
COVERED_ONCE = Metric(
    "covered_once", "area covered once", "once", "neither missed nor covered twice", lower_is_better=False, decides=True
)
GAP = Metric("gap", "area missed", "gap", f"farther than {GAP_SHARE:g} spacings from every path", lower_is_better=True)
OVERLAP = Metric(
    "overlap", "area covered twice", "overlap", f"within {OVERLAP_SHARE:g} spacings of two stretches of path",
    lower_is_better=True,
)  # fmt: skip
HOLE = Metric(
    "largest_hole_mm2", "largest hole [mm2]", "hole mm2", "largest connected missed area", lower_is_better=True,
    percent=False,
)  # fmt: skip
WIDTH = Metric(
    "width_cv", "strip width, variation (CV)", "width CV", "what a following flow compensates", lower_is_better=True
)
SPACING = Metric(
    "both.spacing.cv", "spacing to both sides, variation (CV)", "spacing CV",
    "where a path has a neighbour directly beside it", lower_is_better=True,
)  # fmt: skip
MEAN_SPACING = Metric(
    "both.spacing.mean", "spacing to both sides, mean", "spacing", "1 is as wanted", percent=False, digits=3
)
LEVELS = Metric(
    "levels.spacing.cv", "spacing from level to level, variation (CV)", "level CV",
    "exact distance of each level to the one outside", lower_is_better=True,
)  # fmt: skip
OFF = Metric(
    "distance.deviation", "level curves off their distance, deviation", "off",
    "exact minus promised distance from the source, in spacings; standard deviation, before fitting",
    lower_is_better=True,
)  # fmt: skip
OFF_MEAN = Metric(
    "distance.mean", "level curves off their distance, mean", "off, mean", ("above 0: too far from the source")
)
OFF_MOST = Metric(
    "distance.largest", "level curves off their distance, at most", "off, most", "to either side", lower_is_better=True
)
# What the backend's distance tells, and not the paths alone.
OF_BACKEND = (OFF, OFF_MEAN, OFF_MOST)
# In the order of tables: what decides, what tells where it comes from, details.
CATALOGUE = (
    THICKNESS, FOLLOWING, WITHIN_10, COVERED_ONCE, GAP, OVERLAP, HOLE, WIDTH, MEAN_SPACING, SPACING, LEVELS,
    *OF_BACKEND,
)  # fmt: skip


def cover_text(record: EvennessRecord, *, digits: int = 1) -> str:
    """Return in words how much of the area is missed and covered twice."""
    gap, overlap = GAP.text(record, digits=digits), OVERLAP.text(record, digits=digits)
    return f"{gap} of the area is missed and {overlap} is covered twice"
