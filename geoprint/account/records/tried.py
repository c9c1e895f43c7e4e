"""What is said of what was tried: sources of a part, and what becomes of contours where fronts meet."""

from __future__ import annotations

from pydantic import Field

from geoprint.account.records.rounding import Count, Record, Rounded


class SourceRecord(Record):
    """A source that was tried, because the best one was asked for."""

    patch: int = Field(description="from 1")
    source: str = Field(description="as `--from` takes it")
    gap: Rounded = Field(description="share of the area that is missed")
    overlap: Rounded = Field(description="share of the area that is covered twice")
    cv: Rounded = Field(description="of the thickness that a constant flow leaves")
    runs: Count = Field(description="how many")
    taken: bool = Field(description="whether it is the one that covers best")


class MiddleRecord(Record):
    """What was tried where fronts meet."""

    middle: str = Field(description="as `--middle` takes it")
    gap: Rounded = Field(description="share of the area that is missed")
    overlap: Rounded = Field(description="share of the area that is covered twice")
    cv: Rounded = Field(description="of the thickness that a constant flow leaves")
    runs: Count = Field(description="how many")
    taken: bool = Field(description="whether it is the one that covers best")
