"""What appraisal.json says of the program that was printed, and plan.json of what that print changes in the next one.

A print is held against what its own program deposits on its cell: so an appraisal carries that, and which dispenser
it was. Its seal is a hash of all of its figures, so that nothing is fed back that somebody has edited.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Literal, TypeVar

from pydantic import Field

from geoprint.account.records.rounding import Count, Place, Record, Rounded, as_json
from geoprint.export import Json

_R = TypeVar("_R", bound=Record)
# The key of an appraisal that a plan takes, and that of its seal.
PRINTED, SEAL = "printed", "seal"


class PrintedRunRecord(Record):
    """A run that was printed."""

    run: Count = Field(description="as poses.csv counts it")
    length_mm: Rounded = Field(description="of the plan [mm]")
    middle_mm: Place = Field(description="halfway along it [mm]")


class PrintedPartRecord(Record):
    """A part of a run, in the order of those that were measured."""

    run: Count = Field(description="as poses.csv counts it")
    factor: Rounded = Field(description="flow that was commanded over the planned one, by feedback")
    deposited: Rounded = Field(description="volume that the program deposits, as executed, over the planned one")


class PrintedRecord(Record):
    """What was printed: a program on its cell."""

    plan: str = Field(description="name of the bundle")
    part: str = Field(description="name of the part's file")
    part_sha256: str = Field(description="of that file", pattern="^[0-9a-f]{64}$")
    executed: bool = Field(description="whether its program was executed; else it has none, and its paths count")
    dispenser: dict[str, Rounded | str] = Field(description="what doses, by the keys of the cell file")
    speed_mm_s: Rounded = Field(description="of the print [mm/s]")
    opened_mm: Rounded = Field(description="by which the valve was opened earlier, by feedback [mm]")
    shut_mm: Rounded = Field(description="by which the valve was shut earlier, by feedback [mm]")
    runs: tuple[PrintedRunRecord, ...] = Field(description="in their order")
    parts: tuple[PrintedPartRecord, ...] = Field(description="of the runs, in their order")
    seal: str = Field(default="", description="SHA-256 of all figures of this file", pattern="^([0-9a-f]{64})?$")


def sealed(record: _R) -> _R:
    """Return an appraisal whose `printed` carries the hash of all of its figures; as it is without that."""
    printed: PrintedRecord | None = getattr(record, PRINTED)
    if printed is None:
        return record
    seal = seal_of(as_json(record))
    return record.model_copy(update={PRINTED: printed.model_copy(update={SEAL: seal})})


def seal_of(appraisal: Mapping[str, Json]) -> str:
    """Return the SHA-256 of an appraisal as JSON carries it, but for its seal."""
    printed = appraisal[PRINTED]
    assert isinstance(printed, Mapping)  # noqa: S101  (as both callers have found)
    content = {**appraisal, PRINTED: {key: value for key, value in printed.items() if key != SEAL}}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode("utf-8")).hexdigest()


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
    """What the last print changes."""

    sha256: str = Field(description="of the appraisal", pattern="^[0-9a-f]{64}$")
    plan: str = Field(description="name of the bundle that was printed")
    seen_in: str = Field(description="name of the file of the scan or photograph")
    changes: tuple[ChangeRecord, ...] = Field(description="the strongest first; none where nothing was significant")
    least_factor: Rounded = Field(description="of the flow, over the wanted one")
    most_factor: Rounded = Field(description="likewise")
    speed_mm_s: Rounded | None = Field(
        default=None, description="at which a valve lays that flow [mm/s]; left out where it prints as the cell says"
    )
    valve_opens_earlier_mm: Rounded = Field(description="than the cell says [mm of path]")
    valve_shuts_earlier_mm: Rounded = Field(description="than the cell says [mm of path]")
    gaps: Count = Field(description="parts of runs with hardly any material, which no flow mends")
    held: Rounded = Field(description="share of the poses at which the cell's bounds hold the flow")
    error_found: Rounded = Field(
        description="root mean square of the volume of parts of runs off the wanted one, but for what the program that "
        "was printed did by itself"
    )
    error_expected: Rounded = Field(description="of the next print, by the causes that are known")
