"""The schemas of stack.json and stacks.json: layers of a thickness, by one backend or several."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.model import Count, Rounded
from geoprint.reporting.records.rounding import Record

# The files beside the bundles of the layers of one stack, and beside several stacks that are compared.
STACK, STACKS = "stack.json", "stacks.json"

# The schema of stack.json: what is said of the layers of a thickness, each of which has a bundle of its own.
#
# Units and counting are those of plan.json.


class LayerCureRecord(Record):
    """The light at the bottom of a layer."""

    own_mj_cm2: float = Field(description="dose after the passes of the layer itself [mJ/cm2]")
    whole_mj_cm2: float = Field(description="dose after those of all layers above it, too [mJ/cm2]")


class CureRecord(Record):
    """What the light within a stack is held against."""

    needed_mj_cm2: float = Field(description="dose that cures the material [mJ/cm2]")
    penetration_mm: float = Field(description="depth at which 1/e of the light is left [mm]")
    speed_mm_s: float = Field(description="speed of the lamp over the layers [mm/s]")
    flood_s: float | None = Field(description="time of the final exposure, whose dose is not counted [s]")


class StackedLayerRecord(Record):
    """A layer, in short; the plan.json in its folder says all of it."""

    folder: str = Field(description="name of the folder of the layer's bundle")
    bottom_mm: Rounded = Field(description="height over the part at which the layer begins [mm]")
    height_mm: Rounded = Field(description="height of the layer [mm]")
    area_mm2: Rounded = Field(description="area of the surface in the middle of the layer [mm2]")
    pattern: str = Field(
        default="contours", description="pattern of the layer's paths, with the angle of rows in degrees"
    )
    runs: Count = Field(description="number of runs")
    deposit_mm: Rounded = Field(description="length of the tip's path on deposit [mm]")
    gap: float | None = Field(description="share of the layer's area that no path covers")
    overlap: float | None = Field(description="share of the layer's area that is covered twice")
    thickness_cv: float | None = Field(
        description=(
            "coefficient of variation of the layer's own thickness, with the flow to print; null where it was not "
            "measured"
        )
    )
    helix_deg: Rounded | None = Field(
        default=None,
        description=(
            "mean angle of the layer's fibres to the direction around the axis [degrees]; left out where there is none"
        ),
    )
    speed_mm_s: float = Field(
        description=(
            "speed at which the layer prints with the flow that the valve has in all layers, before its missing "
            "volume is made up [mm/s]"
        )
    )
    laid_mm3: Rounded = Field(
        description="volume deposited by the executed program; without a robot, by the path [mm3]"
    )
    wanted_mm3: Rounded = Field(description="volume of the layer: area times height [mm3]")
    print_s: Rounded | None = Field(
        description="time of the program, with the table's own motions [s]; null without a robot"
    )
    attitudes: Count | None = Field(
        default=None,
        description=(
            "number of attitudes of the table in which the layer is printed; left out where the part is fixed"
        ),
    )
    clearance_mm: Rounded | None = Field(
        description="smallest clearance of the tool [mm]; null without a robot, or where nothing is near"
    )
    not_printable: str | None = Field(
        description="reason why the robot cannot print the layer, where that does not end the planning"
    )
    dose_mj_cm2: float | None = Field(
        default=None,
        description=(
            "mean dose at the top of the layer from its own passes [mJ/cm2]; left out where the lamp is unknown"
        ),
    )
    cure: LayerCureRecord | None = Field(
        default=None, description="dose at the bottom of the layer; left out where the stack has no `cure`"
    )
    warnings: tuple[str, ...] = Field(description="warnings that a person should act on")
    not_checked: tuple[str, ...] = Field(description="list of what was not checked")


class FinishedRecord(Record):
    """How the stack comes out with one flow: thickness of all layers together over the wanted one, by simulation."""

    mean: Rounded = Field(description="mean thickness over the wanted one")
    cv: Rounded = Field(description="standard deviation of the thickness over its mean")
    p1: Rounded = Field(description="1st percentile of the thickness over the wanted one")
    p99: Rounded = Field(description="99th percentile of the thickness over the wanted one")
    within_5_percent: Rounded = Field(description="share of the area within 5 % of the wanted thickness")
    judged: Rounded = Field(description="share of the area that the figures of thickness stand for")
    creased: Rounded = Field(
        description="share of the area over which a hollow is filled before the stack is as high as wanted"
    )
    under_sides: Rounded = Field(
        description=(
            "share of the area over which sides lean in before the stack is as high as wanted; judged up to these"
        )
    )
    volume: Rounded = Field(description="deposited volume over the wanted one")


class FinishedFlowsRecord(Record):
    """The finished stack with each flow; null where nothing of it can be judged."""

    constant_flow: FinishedRecord | None = Field(description="with constant flow")
    following_flow: FinishedRecord | None = Field(description="with flow that follows the width")
    printed: FinishedRecord | None = Field(
        description="as the programs were executed; without a robot as the cell's signals allow"
    )


class LeftOutRecord(Record):
    """A layer at the top of a target in which there is nothing to print."""

    number: int = Field(description="number of the layer, from 1", ge=1)
    reason: str = Field(description="reason why the layer is left out")


class StackProgramRecord(Record):
    """The program that prints the layers one after another, and what was executed of it."""

    file: str = Field(description="list of the modules that a person loads; the layers are loaded by the program")
    pause_s: Rounded = Field(description="time that the arm waits at home between two layers [s]; 0 for none")
    print_s: Rounded = Field(
        description="time of all layers, of a table's motions and of the pauses between layers, loading left out [s]"
    )
    table_kept_mm: float | None = Field(
        default=None,
        description=(
            "smallest proven distance from the arm at home to a table that moves between layers; left out where the "
            "part is fixed [mm]"
        ),
    )
    runs_dry_only: bool = Field(
        description="whether the program only runs dry, because the placement of the part is not stated"
    )
    scenarios: tuple[str, ...] = Field(
        description=(
            "scenarios in which the program was executed, each layer with the moves and switchings of its own program"
        )
    )
    refused: tuple[str, ...] = Field(
        description="scenarios in which the program ended before anything moved, as it must"
    )
    lines_with_statements: Count = Field(description="number of lines with statements in the program's main module")
    lines_executed: Count = Field(
        description="number of lines with statements that were executed in at least one scenario"
    )


class StackRecord(Record):
    """The content of stack.json."""

    layout: Literal[3] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="version of geoprint")
    part: str = Field(description="file that the lowest layer lies on")
    thickness_mm: Rounded = Field(description="largest thickness of all layers together [mm]")
    target: str | None = Field(description="file of what the layers fill; null for a thickness")
    target_mm3: Rounded | None = Field(
        description="volume of the part of the target that is over the part [mm3]; null without a target"
    )
    finished: FinishedFlowsRecord = Field(description="thickness of all layers together")
    layers: tuple[StackedLayerRecord, ...] = Field(
        description="layers from the lowest up, which is the order in which they are printed"
    )
    program: StackProgramRecord | None = Field(
        description="program of all layers, over a table of all their attitudes; null without a robot"
    )
    cure: CureRecord | None = Field(
        default=None, description="dose that the layers need; left out where the lamp or the material is unknown"
    )
    not_checked: tuple[str, ...] = Field(default=(), description="list of what was not checked of the stack as one")
    left_out: tuple[LeftOutRecord, ...] = Field(
        description="layers above the others in which there is nothing to print"
    )


# The schema of stacks.json: whole stacks of layers that several backends planned.
#
# Units and counting are those of stack.json.


class ComparedStackRecord(Record):
    """A backend that planned every layer."""

    backend: str = Field(description="name of the backend, and of the folder of its stack")
    gap: Rounded = Field(description="share of the area of all layers that no path covers")
    overlap: Rounded = Field(description="share of the area of all layers that is covered twice")
    thickness_cv: Rounded = Field(description="coefficient of variation of the layers' own thickness, of all by area")
    worst_cv: Rounded = Field(description="largest coefficient of variation of the thickness of a single layer")
    finished: FinishedRecord | None = Field(description="thickness of all layers together, as printed")
    runs: int = Field(description="number of runs of all layers", ge=0)
    deposit_mm: Rounded = Field(description="length of the tip's path on deposit [mm]")
    print_s: Rounded | None = Field(description="time of all programs [s]; null without a robot")
    clearance_mm: Rounded | None = Field(description="smallest clearance of the tool [mm]; null without a robot")
    printable: bool | None = Field(description="whether the robot can print every layer; null where that was not asked")
    not_printable: str | None = Field(description="reason why the robot cannot print a layer")
    warnings: tuple[str, ...] = Field(description="warnings to act on, with the layer that each concerns")
    not_checked: tuple[str, ...] = Field(description="list of what was not checked")


class RefusedStackRecord(Record):
    """A backend that cannot plan a layer."""

    backend: str = Field(description="name of the backend")
    refused: str = Field(description="reason of the refusal")


class StackComparisonRecord(Record):
    """The content of stacks.json."""

    layout: Literal[2] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="version of geoprint")
    part: str = Field(description="file that the lowest layer lies on")
    thickness_mm: Rounded = Field(description="largest thickness of all layers together [mm]")
    layers: int = Field(description="number of layers", ge=1)
    verdict: tuple[str, ...] = Field(description="sentences of the verdict; the first one decides")
    best: str = Field(description="the backend that covers the layers best: coverage counts first, then spacing")
    backends: tuple[ComparedStackRecord | RefusedStackRecord, ...] = Field(
        description="backends in the order of the command"
    )
