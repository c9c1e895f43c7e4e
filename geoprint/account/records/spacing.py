"""The spacing of paths as every file tells it: outwards, through the air, to the left and to the right."""

from __future__ import annotations

from pydantic import Field

from geoprint.account.records.printed import PrintedRecord
from geoprint.account.records.rounding import Count, Record, Rounded


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


class StraightRecord(Record):
    """The same through the air."""

    mean: Rounded = Field(description="ratio")
    cv: Rounded = Field(description="standard deviation over mean")


class SpacingSideRecord(Record):
    """The spacing to the left, to the right or to both sides of the paths, as seen from outside along them."""

    spacing: SpacingRecord | None = Field(description="over the wanted one; null where no path has a neighbour there")
    printed: PrintedRecord | None = Field(description="in print; null where nobody expects one")
    samples: Count = Field(description="that have a neighbour there")
    none: Rounded = Field(description="share of the samples without one within three spacings, as at a rim")
    oblique: Rounded = Field(description="share with one only obliquely, at an open end or behind the path's own bend")
    unknown: Rounded = Field(description="share for which the budget of work did not suffice")
