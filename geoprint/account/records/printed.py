"""What is said of thickness in print: how much it is expected to vary, and what makes it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.account.records.rounding import Record, Rounded


class VarianceRecord(Record):
    """Shares of the expected variance in print."""

    plan: Rounded = Field(description="of the planned paths")
    run_flow: Rounded = Field(description="of the flow from run to run")
    repeatability: Rounded = Field(description="of the arm from run to run")
    path_repeatability: Rounded = Field(description="of the arm along a run")
    placement: Rounded = Field(description="of where the part stands")
    needle_runout: Rounded = Field(description="of a bent needle; 0 where nobody knows how the tool stands")
    path_accuracy: Rounded = Field(default=0.0, description="of an arm that lies off its paths; 0 in older versions")


class StandoffRecord(Record):
    """How well the arm keeps the tip over the surface."""

    wanted_mm: Rounded = Field(description="of the tip over what the layer lies on")
    within_mm: Rounded | None = Field(
        description="95 of 100 places, by the arm alone; null where the cell has no path accuracy"
    )


class PrintedRecord(Record):
    """The variation of the thickness that prints are expected to have."""

    cv: Rounded = Field(description="mean of the prints: standard deviation over mean")
    low: Rounded = Field(description="lower end of what 95 of 100 prints have")
    high: Rounded = Field(description="upper end of it")
    shares: VarianceRecord = Field(description="of the variance in print, by what makes it")
    mend_first: str | None = Field(description="the error that makes most of it; null where the plan itself does")
    errors: Literal["cell", "packaged cell"] = Field(description="whose errors these are")
    standoff: StandoffRecord | None = Field(default=None, description="in print; left out for paths of a file")


class PrintedApartRecord(Record):
    """Two backends, a print of each on the same cell."""

    backends: tuple[str, str] = Field(description="their names")
    mean: Rounded = Field(description="by how much more the thickness of the first varies than that of the second")
    low: Rounded = Field(description="lower end of what 95 of 100 pairs of prints have")
    high: Rounded = Field(description="upper end of it")
    indistinguishable: bool = Field(description="whether 0 lies between")
