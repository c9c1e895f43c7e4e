"""What JSON says of how a file was read: what its reader used, skipped and assumed."""

from __future__ import annotations

from pydantic import Field

from geoprint.account.records.rounding import Count, Record
from geoprint.model import Reading


class ReadingRecord(Record):
    """What a reader used of a file, what it skipped and what it assumed."""

    used: dict[str, Count] = Field(description="how often each kind was used")
    skipped: dict[str, Count] = Field(description="how often each kind was skipped: none can change what was read")
    assumed: tuple[str, ...] = Field(description="what the file leaves open, and what it was taken for")


def record_reading(reading: Reading) -> ReadingRecord:
    """Return the record of a reader as JSON carries it."""
    return ReadingRecord(used=dict(reading.used), skipped=dict(reading.skipped), assumed=reading.assumed)


def reading_text(record: ReadingRecord) -> str:
    """Return it in one line, as `Reading.text` says it."""
    return Reading(tuple(record.used.items()), tuple(record.skipped.items()), record.assumed).text
