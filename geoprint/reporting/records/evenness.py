"""The records of evenness: thickness, coverage, spacing, expected print and overhang."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.metrics import LevelSpacing, Thickness, WorstPlace
from geoprint.model import GAP_SHARE, OVERLAP_SHARE, Count, Place, Rounded
from geoprint.reporting.records.rounding import Record

# What is said of thickness in print: how much it is expected to vary, and what makes it.


class VarianceRecord(Record):
    """Shares of the expected variance in print."""

    plan: Rounded = Field(description="variance of the planned paths")
    run_flow: Rounded = Field(description="variation of the flow between runs")
    repeatability: Rounded = Field(description="deviation of the arm between runs")
    path_repeatability: Rounded = Field(description="deviation of the arm along a run")
    placement: Rounded = Field(description="error of the placement of the part")
    needle_runout: Rounded = Field(description="runout of the needle; 0 if the orientation of the tool is unknown")
    path_accuracy: Rounded = Field(
        default=0.0, description="deviation of the arm from its commanded path; 0 in older versions"
    )


class StandoffRecord(Record):
    """How well the arm keeps the tip over the surface."""

    wanted_mm: Rounded = Field(description="planned height of the tip over what the layer lies on [mm]")
    within_mm: Rounded | None = Field(
        description=(
            "largest deviation of the tip's height at 95 of 100 places, by the arm alone [mm]; null where the "
            "cell has no path accuracy"
        )
    )


class PrintedRecord(Record):
    """The variation of the thickness that prints are expected to have."""

    cv: Rounded = Field(
        description="coefficient of variation of the thickness (standard deviation over mean), mean of the prints"
    )
    low: Rounded = Field(description="lower end of the coefficient of variation in 95 of 100 prints")
    high: Rounded = Field(description="upper end of the coefficient of variation in 95 of 100 prints")
    shares: VarianceRecord = Field(description="shares of the variance in print, by source")
    mend_first: str | None = Field(
        description="error that makes most of the variation; null where the plan itself does"
    )
    errors: Literal["cell", "packaged cell"] = Field(description="cell that the errors are from")
    standoff: StandoffRecord | None = Field(
        default=None, description="stand-off expected in print; left out for paths of a file"
    )


class PrintedApartRecord(Record):
    """Two backends, a print of each on the same cell."""

    backends: tuple[str, str] = Field(description="names of the two backends")
    mean: Rounded = Field(
        description="variation of the thickness of the first backend less that of the second, mean of all pairs"
    )
    low: Rounded = Field(description="lower end of the difference in 95 of 100 pairs of prints")
    high: Rounded = Field(description="upper end of the difference in 95 of 100 pairs of prints")
    indistinguishable: bool = Field(description="whether the interval from `low` to `high` contains 0")


# How evenly paths cover a part, as plan.json, compare.json, measure.json and `check --full --json` say it.


class SpacingRecord(Record):
    """The measured spacing over the wanted one; 1 is ideal."""

    mean: Rounded = Field(description="mean spacing, over the wanted one")
    cv: Rounded = Field(description="standard deviation of the spacing over its mean; 0 is perfectly even")
    p1: Rounded = Field(description="1st percentile of the spacing, over the wanted one")
    p5: Rounded = Field(description="5th percentile of the spacing, over the wanted one")
    p50: Rounded = Field(description="median spacing, over the wanted one")
    p95: Rounded = Field(description="95th percentile of the spacing, over the wanted one")
    p99: Rounded = Field(description="99th percentile of the spacing, over the wanted one")
    max: Rounded = Field(description="largest spacing, over the wanted one")
    within_5_percent: Rounded = Field(description="share of the samples within 5 % of the wanted spacing")


class SpacingSideRecord(Record):
    """The spacing to the left, to the right or to both sides of the paths, as seen from outside along them."""

    spacing: SpacingRecord | None = Field(
        description="spacing to the neighbour, over the wanted one; null where no path has a neighbour there"
    )
    samples: Count = Field(description="number of samples that have a neighbour on this side")
    none: Rounded = Field(description="share of the samples without a neighbour within three spacings, as at a rim")
    oblique: Rounded = Field(
        description=(
            "share of the samples with a neighbour only obliquely, at an open end or behind the path's own bend"
        )
    )
    unknown: Rounded = Field(description="share of the samples for which the budget of work did not suffice")


class StraightRecord(Record):
    """The exact distance of each level to the one outside, through the air."""

    mean: Rounded = Field(description="mean distance of levels through the air, over the wanted spacing")
    cv: Rounded = Field(description="standard deviation of the distance of levels through the air, over its mean")


class LevelSpacingsRecord(Record):
    """The exact distance of each level of paths to the one outside."""

    spacing: SpacingRecord | None = Field(
        description="distance over the surface to the level outside, over the wanted spacing; null with a single level"
    )
    straight: StraightRecord | None = Field(
        description="distance through the air to the level outside, over the wanted spacing; null with one level"
    )
    samples: Count = Field(description="number of samples along the runs")
    samples_bounded: Rounded = Field(
        description="share of the samples whose ratio is not exact but lies between bounds"
    )
    largest_doubt: Rounded = Field(description="largest difference between the ratio of a sample and its lower bound")
    samples_unreached: Count = Field(description="number of samples left out: no way to the level outside was found")
    samples_where_fronts_meet: Rounded = Field(
        description="share of the samples within one spacing of another stretch of their level, as at the medial axis"
    )
    each: tuple[LevelSpacing, ...] = Field(description="spacing of each level to the one outside")
    worst_places: tuple[WorstPlace, ...] = Field(
        description="places where the spacing is farthest from the wanted one, at most five, the worst first"
    )


class DistanceRecord(Record):
    """How much farther from the source than they promise the level curves of the backend lie, in spacings."""

    mean: Rounded = Field(description="mean distance error of samples along all level curves, in spacings")
    deviation: Rounded = Field(description="standard deviation of the distance error, in spacings")
    largest: Rounded = Field(description="largest distance error to either side, in spacings")
    samples: Count = Field(description="number of samples along the curves")
    unknown: Rounded = Field(description="share of the samples for which the budget of work did not suffice")


class EvennessRecord(Record):
    """How evenly the paths cover the part, measured over its surface."""

    thickness: Thickness = Field(description="thickness with a constant flow: the headline")
    following: Thickness = Field(description="thickness with a flow that follows the width of the strip")
    covered_once: Rounded = Field(description="share of the area that is neither missed nor covered twice")
    gap: Rounded = Field(description=f"share of the area farther than {GAP_SHARE:g} spacings from every path")
    overlap: Rounded = Field(description=f"share of the area within {OVERLAP_SHARE:g} spacings of two stretches")
    largest_hole_mm2: Rounded = Field(description="largest connected area that no path covers [mm2]")
    area_unknown: Rounded = Field(description="share of the area that could not be judged")
    fill: Rounded = Field(description="deposited length times spacing, over the area")
    width_cv: Rounded = Field(
        description="standard deviation over mean of the width of the strip that a stretch serves"
    )
    distance: DistanceRecord | None = Field(
        default=None,
        description="distance errors of the backend, before curves are fitted; left out if there are none",
    )
    printed: PrintedRecord | None = Field(
        default=None, description="variation expected in print; left out if there is none"
    )
    left: SpacingSideRecord = Field(description="spacing to the left of the paths")
    right: SpacingSideRecord = Field(description="spacing to the right of the paths")
    both: SpacingSideRecord = Field(description="spacing to both sides of the paths, all samples together")
    levels: LevelSpacingsRecord | None = Field(
        default=None, description="spacing from level to level; left out where runs have none"
    )


# What plan.json says of overhang: where the surface's outward normal is too far from upright for the material.


class OverhangPlaceRecord(Record):
    """A place where a bead overhangs."""

    run: Count = Field(description="number of the run on which the bead overhangs")
    place_mm: Place = Field(description="point on the surface [mm]")
    angle_deg: Rounded = Field(description="angle of the outward normal from upright [degrees]")


class TableAttitudeRecord(Record):
    """One attitude of the table, and what is printed in it."""

    up: Place = Field(description="unit direction of the part that points up")
    axes: tuple[Rounded, ...] = Field(
        description=(
            "positions of the table's axes: lengths of the six legs [mm], or angles of tilting and turning [degrees]"
        )
    )
    slack: Rounded = Field(
        description=(
            "share of the critical angle that is left, or of the table's range where less of that is; 0 at a limit"
        )
    )
    length_mm: Rounded = Field(description="length deposited in the attitude [mm]")
    pieces: Count = Field(description="number of parts of runs that are printed in the attitude")
    move_s: Rounded = Field(
        description="least time of the table to reach the attitude, or the time that the program gives it [s]"
    )


class TableRecord(Record):
    """How a table is to tilt the part, so that as little as possible overhangs."""

    name: str = Field(description="name of the table")
    rotary: bool = Field(
        description="whether the table's axes turn, so that their values are angles; else they are lengths"
    )
    order: Literal["kept", "gathered"] = Field(
        description="whether runs are printed in their order, or parts of them grouped by attitude"
    )
    moves_kept: Count = Field(description="number of attitudes needed for runs in their order")
    moves_gathered: Count = Field(description="number of attitudes needed for parts of runs gathered by attitude")
    length_mm: Rounded = Field(description="deposited length that overhangs although the table tilts the part [mm]")
    missing_deg: Rounded = Field(
        description="largest angle beyond the critical one that is left although the table tilts the part [degrees]"
    )
    attitudes: tuple[TableAttitudeRecord, ...] = Field(description="attitudes in the order of printing")
    refused: tuple[str, ...] = Field(
        default=(),
        description=("attitudes that the robot refused, whose parts of runs are printed in another one, and why"),
    )


class OverhangRecord(Record):
    """What of the deposit overhangs, as the part stands."""

    critical_deg: Rounded = Field(
        description="angle of the outward normal from upright beyond which a bead may sag [degrees]"
    )
    assumed: bool = Field(
        default=False,
        description=("whether the critical angle is the paper's example, because the cell's [material] states none"),
    )
    share: Rounded = Field(description="share of the deposited length that overhangs")
    length_mm: Rounded = Field(description="deposited length that overhangs [mm]")
    largest_deg: Rounded = Field(description="largest angle of the outward normal from upright on deposit [degrees]")
    worst_places: tuple[OverhangPlaceRecord, ...] = Field(
        description="places that overhang most, one for each stretch, at most five, the worst first"
    )
    table: TableRecord | None = Field(default=None, description="table that tilts the part, where the cell has one")

    @property
    def stated(self) -> bool:
        """Whether it is more than a detail: the material has an angle, or a table tilts the part by it."""
        return self.table is not None or not self.assumed
