"""The schema of measure.json: how evenly files of toolpaths cover a part, side by side.

Units and counting are those of plan.json.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.account.records.evenness import EvennessRecord
from geoprint.account.records.plan import FileRecord
from geoprint.account.records.reading import ReadingRecord
from geoprint.account.records.rounding import Count, Place, Record, Rounded, Thousandths


class MotionFitRecord(Record):
    """The rigid motion that laid the paths onto the part."""

    rotation_deg: Rounded = Field(description="angle that it turns by [degrees]")
    axis: Place = Field(description="unit vector that it turns about")
    translation_mm: Place = Field(description="where it moves the paths' origin [mm]")
    residual_mm: Rounded = Field(description="root mean square distance of the paths from the part behind it [mm]")
    before_mm: Rounded = Field(description="the same before it [mm]")


class MeasuredRecord(Record):
    """A file of toolpaths."""

    file: str = Field(description="its name")
    format: str = Field(description="that it was read as")
    deposit: str = Field(description="how deposit was told from travel")
    points: Count = Field(description="that were read, those of travel too")
    runs: Count = Field(description="that were measured")
    dropped_runs: Count = Field(description="of a single point, left out")
    reading: ReadingRecord = Field(description="what its reader used, skipped and assumed")
    length_mm: Rounded = Field(description="of the deposited paths on the part [mm]")
    off_mean_mm: Rounded = Field(description="mean distance of the paths' points from the part [mm]")
    off_max_mm: Rounded = Field(description="largest [mm]")
    fit: MotionFitRecord | None = Field(description="null where the paths were taken as they are")
    uniformity: EvennessRecord = Field(description="as in plan.json")


class MeasurementRecord(Record):
    """The content of measure.json."""

    layout: Literal[4] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="of geoprint")
    part: FileRecord = Field(description="that the paths cover")
    area_mm2: Rounded = Field(description="of the part [mm2]")
    spacing_mm: float = Field(description="wanted distance between neighbouring paths [mm]")
    files: tuple[MeasuredRecord, ...] = Field(description="in the order of the command")


class MeasureSecondsRecord(Record):
    """What measuring one file took."""

    file: str = Field(description="its name")
    processor_s: Thousandths = Field(description="of all threads [s]")
    processor_s_per_m: Thousandths = Field(description="per metre of path [s]")


class MeasureTimingsRecord(Record):
    """The content of timings.json beside measure.json."""

    files: tuple[MeasureSecondsRecord, ...] = Field(description="in the order of the command")
