"""What plan.json says of feedback: what the last print taught, what is changed, and what that is expected to do."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.account.records.rounding import Count, Record, Rounded


class ChangeRecord(Record):
    """A cause of errors that is taken out."""

    cause: Literal["constant", "drift", "along runs", "opening", "shutting"] = Field(
        description="of the flow: one share of all, what changes slowly over the print, what changes along runs; and "
        "of the valve, at the beginning and at the end of runs"
    )
    least: Rounded = Field(description="volume that it made over the wanted one; of the valve, how late it was [mm]")
    most: Rounded = Field(description="likewise, where it made most")
    gain: Rounded = Field(description="by which it makes the measurement likelier, at least 8 [nats]")


class FeedbackRecord(Record):
    """What the last print taught."""

    sha256: str = Field(description="of the appraisal", pattern="^[0-9a-f]{64}$")
    plan: str = Field(description="name of the bundle that was printed")
    scan: str = Field(description="name of the file of the scan")
    changes: tuple[ChangeRecord, ...] = Field(description="the strongest first; none where nothing was significant")
    least_factor: Rounded = Field(description="of the flow, over the wanted one")
    most_factor: Rounded = Field(description="likewise")
    valve_opens_earlier_mm: Rounded = Field(description="than the cell says [mm of path]")
    valve_shuts_earlier_mm: Rounded = Field(description="than the cell says [mm of path]")
    gaps: Count = Field(description="parts of runs with hardly any material, which no flow mends")
    held: Rounded = Field(description="share of the poses at which the cell's bounds hold the flow")
    error_found: Rounded = Field(description="root mean square of the volume of parts of runs off the wanted one")
    error_expected: Rounded = Field(description="of the next print, by the causes that are known")
