"""The schema of simulated.json: what a bundle lays in silico, run by run, and what was put in besides."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.account.records.rounding import Count, Record, Rounded

# A change that breaks a reader raises it.
SIMULATED_SCHEMA = 1


class SimulatedRunRecord(Record):
    """One run of the plan that lays material."""

    run: Count = Field(description="as poses.csv counts it")
    wanted_mm3: Rounded = Field(description="volume that its path asks for")
    laid_mm3: Rounded = Field(description="volume that lies along it")
    beside_mm3: Rounded = Field(
        description="of that, what lies farther than half a spacing before the run's beginning or behind its end"
    )
    longest_bare_mm: Rounded = Field(description="longest stretch of the run without material")


class SimulatedRecord(Record):
    """All that simulated.json says."""

    schema_version: Literal[1] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="of geoprint")
    plan: str = Field(description="folder of the bundle")
    laid_by: Literal["program", "paths"] = Field(
        description="whether its program was executed; paths where the bundle has none"
    )
    flow: Rounded = Field(description="volume that flows, over that of the plan")
    spread: Rounded = Field(description="width of beads over what their flow asks for")
    width_noise: Rounded = Field(description="standard deviation of the width along a bead, over its mean")
    offset_mm: Rounded = Field(description="by which all beads lie to the left of their paths")
    seed: Count = Field(description="of all noise")
    wanted_mm3: Rounded = Field(description="volume that the paths ask for")
    laid_mm3: Rounded = Field(description="volume that lies on the part")
    runs: tuple[SimulatedRunRecord, ...] = Field(description="in the order of printing")
