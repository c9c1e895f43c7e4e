"""The schema of one of the robot's parts in plan.json: motion, clearance and program for one placement of the part."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geoprint.account.records.evidence import EvidenceRecord
from geoprint.account.records.rounding import Count, Place, Record, Rounded, Thousandths


class RotationRecord(Record):
    """How the nozzle turns about itself."""

    axial_nozzle: bool = Field(description="whether its axis is the flange's: then a turn moves joint 6 only")
    least_deg: Thousandths = Field(description="from the attitude of the path [degrees]")
    most_deg: Thousandths = Field(description="from the attitude of the path [degrees]")


class TiltRecord(Record):
    """The angle between nozzle and surface normal on deposit."""

    largest_deg: Thousandths = Field(description="[degrees]")
    mean_deg: Thousandths = Field(description="[degrees]")


class LeanPlaceRecord(Record):
    """A stretch in which the nozzle leans from the attitude of the path, where it does most."""

    run: int = Field(description="from 0")
    place_mm: tuple[Thousandths, Thousandths, Thousandths] = Field(description="tip in the part's coordinates [mm]")
    lean_deg: Thousandths = Field(description="[degrees]")
    deposit: bool = Field(description="whether material is laid there")


class RunLeanRecord(Record):
    """A run on which the nozzle leans from the attitude of the path, and what turning it for the speed bought."""

    run: int = Field(description="from 0")
    mean_deg: Thousandths = Field(description="along the run [degrees]")
    largest_deg: Thousandths = Field(description="[degrees]")
    eased_mm: Rounded = Field(description="length in which the tool was turned for the speed of the tip [mm]")
    lacking_mm: Rounded = Field(description="length whose joints would not hold the set speed without that [mm]")
    left_mm: Rounded = Field(description="length of it whose joints still do not [mm]")


class LeanRecord(Record):
    """Where the nozzle leans from the attitude of the path."""

    deposit_share: Thousandths = Field(description="of the deposited length")
    runs: tuple[RunLeanRecord, ...] = Field(default=(), description="that lean, in the order of printing")
    places: tuple[LeanPlaceRecord, ...] = Field(description="at most 20, the largest leans first")


class SlowdownRecord(Record):
    """A stretch of deposit on which the joints do not hold the print's speed."""

    run: int = Field(description="from 0")
    place_mm: Place = Field(description="tip where the least is held [mm]")
    arc_mm: Rounded = Field(description="of that place, from the start of the run [mm]")
    length_mm: Rounded = Field(description="of the stretch [mm]")
    set_mm_s: float = Field(description="speed that was asked for [mm/s]")
    held_mm_s: Rounded = Field(description="smallest speed on the stretch [mm/s]")
    joint: int = Field(description="that limits it there, 1 to 6; 0 where it is the targets")
    limit: Literal["speed", "acceleration", "targets"] = Field(description="of that joint, or how near targets are")


class SlowedRecord(Record):
    """Shares of the deposit not laid within 1 % of the set speed, away from the ramps, by what limits them."""

    speed: Rounded = Field(description="of a joint")
    acceleration: Rounded = Field(description="of a joint")
    targets: Rounded = Field(description="of a bend would be closer in time than a controller takes")


class BendRecord(Record):
    """A bend of the path that straight moves between its poses do not follow within tolerance and period."""

    run: int = Field(description="from 0")
    kind: Literal["rounded", "close"] = Field(
        description="targets stand outside of the bend, so that rounded corners pass it; or they are closer in time"
        " than a controller takes"
    )
    place_mm: Place = Field(description="tip in its middle [mm]")
    arc_mm: Rounded = Field(description="of that place, from the start of the run [mm]")
    radius_mm: Rounded | None = Field(description="of the path there [mm]; null where it is straight")
    targets: Count = Field(description="in the bend")
    offset_mm: Rounded = Field(description="largest, of a target from the path [mm]")
    shortest_ms: Rounded = Field(description="least time of a move there [ms]")


class TargetsRecord(Record):
    """How the targets that the program names follow each other."""

    period_ms: Rounded = Field(description="that the controller takes without slowing down [ms]")
    closer: Count = Field(description="targets that come sooner than that after the one before")
    shortest_ms: Rounded = Field(description="between two [ms]")
    shortest_mm: Rounded = Field(description="move between two [mm]")
    least_ms: Rounded = Field(description="time of a move that lays material [ms]; what is shorter is a 'close' bend")
    bends: tuple[BendRecord, ...] = Field(description="that straight moves do not follow, in the order of printing")
    dry_run_other_configuration: Count = Field(description="targets whose configuration differs in the dry run")


class QuadrantRecord(Record):
    """How near an axis whose quarter turns the configuration data count comes to a border of these on deposit."""

    axis: int = Field(description="1, 4 or 6")
    targets_near: Count = Field(description="targets on deposit within 1 degree of a border")
    crossings: Count = Field(description="of borders between poses on deposit")
    nearest_deg: Thousandths = Field(description="of a target on deposit to a border [degrees]")
    run: int = Field(description="where that is, from 0")
    place_mm: Place = Field(description="of the tip there, in the part's coordinates [mm]")


class OrientationRecord(Record):
    """How a demonstration was turned about its centroid, because with its mean normal up it is refused."""

    rpy_deg: tuple[Thousandths, Thousandths, Thousandths] = Field(
        description="roll, pitch, yaw about the base's fixed axes, after its mean normal was turned up; demo_rpy_deg in"
        " a cell [degrees]"
    )
    tilt_deg: Thousandths = Field(description="of its mean normal from upright [degrees]")
    margin_deg: Thousandths = Field(description="of the search's motion from limits and singularities [degrees]")
    tried: Count = Field(description="orientations")
    start_refused: str = Field(description="why it is refused with its mean normal up")
    others_refused: tuple[str, ...] = Field(description="why those before it in the search's order are")


class DepositedRecord(Record):
    """Volume that the program deposits as it was executed, over the planned one; short runs count as dots."""

    share: Rounded = Field(description="of all runs together")
    least_run: Rounded = Field(description="of the run that gets least")
    most_run: Rounded = Field(description="of the run that gets most")


class MotionRecord(Record):
    """The arm's motion from home to home."""

    duration_s: Rounded = Field(description="of the motion, without what it waits for a flow or the lamp [s]")
    branch: int = Field(description="of the eight inverse solutions, from 0")
    rotation: RotationRecord = Field(description="of the nozzle about itself")
    joint_6_turns: Thousandths = Field(description="over the whole motion")
    tilt: TiltRecord = Field(description="from the surface normal")
    lean: LeanRecord = Field(description="from the attitude of the path")
    smallest_wrist_angle_deg: Rounded = Field(description="of joint 5 [degrees]")
    slowest_deposit_mm_s: Rounded = Field(description="of the bead, beside the ramps [mm/s]")
    off_moves_mm: Rounded = Field(description="largest distance of the timed path from the moves, all along [mm]")
    off_moves_deg: Rounded = Field(description="and turn [degrees]")
    stretched_pieces: Count = Field(description="of the motion that had to be slower than planned")
    largest_jerk_m_s3: Rounded = Field(description="of the tip on deposit, over steps of 10 ms [m/s3]")
    share_at_speed: Rounded = Field(description="of the deposit within 1 % of the print's speed")
    share_on_ramps: Rounded = Field(description="of the deposit, at the ends of runs")
    share_slowed: SlowedRecord | None = Field(default=None, description="of the deposit: the rest")
    speed_ceiling_mm_s: float = Field(description="that was allowed; settings name the one that prints [mm/s]")
    deposited: DepositedRecord | None = Field(default=None, description="left out where nothing is deposited")
    slowdowns: tuple[SlowdownRecord, ...] = Field(description="beside the ramps")
    placement_calibrated: bool = Field(description="whether touched points say where the fixture stands")
    placement_missing: tuple[str, ...] = Field(description="what nobody stated; then programs run only dry")
    placement_orientation: OrientationRecord | None = Field(
        default=None, description="that was found for a demonstration; left out where it stands as the cell says"
    )
    largest_touch_miss_mm: Rounded | None = Field(description="of the touched points [mm]")
    T_base_work: tuple[tuple[Rounded, ...], ...] = Field(description="from the part's to the robot's base [mm]")
    surface_uncertainty_mm: Rounded | None = Field(default=None, description="standard deviation along the normal [mm]")
    surface_within_mm: Rounded | None = Field(default=None, description="in 95 of 100 calibrations [mm]")
    surface_uncertain_at_mm: Place | None = Field(default=None, description="where that is most [mm]")
    targets: TargetsRecord = Field(description="of the program")
    quadrants: tuple[QuadrantRecord, ...] = Field(description="of axes 1, 4 and 6")


class DryRunRecord(Record):
    """What the dry run passes."""

    lift_mm: float = Field(description="above the printed path [mm]")
    smallest_mm: Rounded = Field(description="clearance [mm]")
    at: str = Field(description="where, and what comes near what")


class ClearanceRecord(Record):
    """What the collision check of the motion found."""

    smallest_mm: Rounded = Field(description="of the tool [mm]")
    at: str = Field(description="where, and what comes near what")
    arm_smallest_mm: Rounded | None = Field(description="of the arm [mm]")
    arm_at: str | None = Field(description="where, and what comes near what")
    kept_mm: float = Field(description="everywhere [mm]")
    tip_margin_mm: Rounded = Field(description="of the tip on travel and its rim on deposit [mm]")
    checks: Count = Field(description="places of the motion that were looked at")
    checked: tuple[str, ...] = Field(description="what against what")
    not_checked: tuple[str, ...] = Field(description="what nobody looked at")
    dry_run: DryRunRecord = Field(description="likewise")


class RunSwitchingRecord(Record):
    """When one run is laid."""

    run: int = Field(description="from 0")
    deposit_s: tuple[float, ...] = Field(description="from and to, on the path [s]")
    material_s: tuple[float, ...] = Field(description="from and to, as it leaves the nozzle [s]")


class SwitchingRecord(Record):
    """What flows and shines when, simulated from the program as it was read back."""

    largest_error_mm: Rounded = Field(description="of the material from each run's ends [mm]")
    lamp_alone_s: Rounded = Field(description="that the lamp shines where nothing is laid [s]")
    runs: tuple[RunSwitchingRecord, ...] = Field(description="in the order of printing")
    lamp_s: tuple[tuple[float, ...], ...] = Field(description="on, from and to [s]")
    vacuum_s: tuple[tuple[float, ...], ...] = Field(description="drawing, from and to [s]")


class ProgramRecord(Record):
    """The program that was written."""

    modules: tuple[str, ...] = Field(description="its files in the folder rapid")
    targets: Count = Field(description="that it names")
    dry_run_only: bool = Field(description="because nobody stated where the part stands")
    switching: SwitchingRecord = Field(description="of valve, lamp and vacuum")


class TablePoseRecord(Record):
    """How a table holds the part while this is printed."""

    attitude: Count = Field(description="from 1, in the order of printing")
    axes: tuple[Rounded, ...] = Field(
        description="lengths of the six legs [mm], or angles of tilting and turning [degrees]"
    )
    kept_mm: Rounded = Field(
        description="distance of the table, and of all on it, from the arm at home as it comes here [mm]; the true one "
        "may be larger"
    )


class JoinedRecord(Record):
    """The one program of several attitudes, and what was executed of it."""

    file: str = Field(description="list of the modules that a person loads; attitudes are loaded by the program")
    print_s: Rounded = Field(description="time of all attitudes and of the table's own motions, loading left out [s]")
    table_s: Rounded = Field(
        description="that the table moves of these: at its largest speeds, or as the program drives it [s]"
    )
    scenarios: tuple[str, ...] = Field(
        description="in which it was executed, each attitude with the moves and switchings of its own program"
    )
    refused: tuple[str, ...] = Field(description="scenarios in which it ended before anything moved, as it must")
    lines_with_statements: Count = Field(description="of its main module")
    lines_executed: Count = Field(description="of these, in at least one scenario")


class RobotRecord(Record):
    """The robot's part of a plan for one placement of the part."""

    table: TablePoseRecord | None = Field(
        default=None, description="that holds it; left out where the part stands still"
    )

    motion: MotionRecord = Field(description="of the arm")
    clearance: ClearanceRecord = Field(description="of the motion")
    program: ProgramRecord = Field(description="that runs it")
    evidence: EvidenceRecord = Field(description="how far geoprint itself has proven the program")
