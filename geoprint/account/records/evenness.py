"""How evenly paths cover a part, as plan.json, compare.json, measure.json and `check --full --json` say it."""

from __future__ import annotations

from pydantic import Field

from geoprint.account.records.printed import PrintedRecord
from geoprint.account.records.rounding import Count, Place, Record, Rounded
from geoprint.model import GAP_SHARE, OVERLAP_SHARE


class ThicknessRecord(Record):
    """The thickness of the layer that a flow leaves, over the wanted one and over all of the area."""

    mean: Rounded = Field(description="1 is as wanted")
    cv: Rounded = Field(description="standard deviation over mean; 0 is perfectly even")
    within_5_percent: Rounded = Field(description="share of the area")
    within_10_percent: Rounded = Field(description="share of the area")
    smallest: Rounded = Field(description="anywhere")
    largest: Rounded = Field(description="anywhere")


class SpacingRecord(Record):
    """The measured spacing over the wanted one; 1 is ideal."""

    mean: Rounded = Field(description="ratio")
    cv: Rounded = Field(description="standard deviation over mean; 0 is perfectly even")
    p1: Rounded = Field(description="ratio")
    p5: Rounded = Field(description="ratio")
    p50: Rounded = Field(description="ratio")
    p95: Rounded = Field(description="ratio")
    p99: Rounded = Field(description="ratio")
    max: Rounded = Field(description="ratio")
    within_5_percent: Rounded = Field(description="share of the samples")


class SpacingSideRecord(Record):
    """The spacing to the left, to the right or to both sides of the paths, as seen from outside along them."""

    spacing: SpacingRecord | None = Field(description="over the wanted one; null where no path has a neighbour there")
    samples: Count = Field(description="that have a neighbour there")
    none: Rounded = Field(description="share of the samples without one within three spacings, as at a rim")
    oblique: Rounded = Field(description="share with one only obliquely, at an open end or behind the path's own bend")
    unknown: Rounded = Field(description="share for which the budget of work did not suffice")


class StraightRecord(Record):
    """The same through the air."""

    mean: Rounded = Field(description="ratio")
    cv: Rounded = Field(description="standard deviation over mean")


class LevelRecord(Record):
    """The spacing of a level to the one outside, over the wanted one."""

    level: Count = Field(description="its number")
    mean: Rounded = Field(description="ratio")
    cv: Rounded = Field(description="standard deviation over mean")
    worst: Rounded = Field(description="ratio farthest from 1")


class WorstPlaceRecord(Record):
    """A place where the spacing is far from wanted."""

    place_mm: Place = Field(description="on the surface [mm]")
    level: Count = Field(description="of the run there")
    ratio: Rounded = Field(description="spacing over the wanted one")


class LevelSpacingsRecord(Record):
    """The exact distance of each level of paths to the one outside."""

    spacing: SpacingRecord | None = Field(description="over the wanted one; null with a single level")
    straight: StraightRecord | None = Field(description="the same through the air; null with a single level")
    samples: Count = Field(description="along the runs")
    samples_bounded: Rounded = Field(description="share whose ratio lies between bounds")
    largest_doubt: Rounded = Field(description="between a ratio and its lower bound")
    samples_unreached: Count = Field(description="left out: no way to the level outside was found")
    samples_where_fronts_meet: Rounded = Field(description="share within one spacing of their own level")
    each: tuple[LevelRecord, ...] = Field(description="each to the one outside")
    worst_places: tuple[WorstPlaceRecord, ...] = Field(description="at most five, the worst first")


class DistanceRecord(Record):
    """How much farther from the source than they promise the level curves of the backend lie, in spacings."""

    mean: Rounded = Field(description="of samples along all level curves")
    deviation: Rounded = Field(description="standard deviation")
    largest: Rounded = Field(description="to either side")
    samples: Count = Field(description="along the curves")
    unknown: Rounded = Field(description="share for which the budget of work did not suffice")


class EvennessRecord(Record):
    """How evenly the paths cover the part, measured over its surface."""

    thickness: ThicknessRecord = Field(description="with a constant flow: the headline")
    following: ThicknessRecord = Field(description="with a flow that follows the width of the strip")
    covered_once: Rounded = Field(description="share of the area that is neither missed nor covered twice")
    gap: Rounded = Field(description=f"share of the area farther than {GAP_SHARE:g} spacings from every path")
    overlap: Rounded = Field(description=f"share of the area within {OVERLAP_SHARE:g} spacings of two stretches")
    largest_hole_mm2: Rounded = Field(description="largest connected area that no path covers [mm2]")
    area_unknown: Rounded = Field(description="share of the area that could not be judged")
    fill: Rounded = Field(description="deposited length times spacing, over the area")
    width_cv: Rounded = Field(description="of the strip that each stretch serves: standard deviation over mean")
    distance: DistanceRecord | None = Field(
        default=None, description="of the backend, before curves are fitted; left out where none is promised or known"
    )
    printed: PrintedRecord | None = Field(default=None, description="in print; left out where nobody expects one")
    left: SpacingSideRecord = Field(description="to the left of the paths")
    right: SpacingSideRecord = Field(description="to the right")
    both: SpacingSideRecord = Field(description="all samples of both sides")
    levels: LevelSpacingsRecord | None = Field(
        default=None, description="from level to level; left out where runs have none"
    )
