"""The schema of plan.json: what is said of a plan, from the file that was read to the warnings.

Lengths are mm, angles degrees, times s, and another unit stands in the name; a share or a ratio is of 1. Runs, levels
and layers count from 0.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, create_model

from geoprint.config.job import Job, PatchRegion
from geoprint.config.strict import keys_of
from geoprint.geometry import PreparationReport, Repairs, described
from geoprint.model import Count, Place, Rounded, Slowdown, Thousandths
from geoprint.process import Exposure
from geoprint.reporting.records.evenness import EvennessRecord, OverhangRecord
from geoprint.reporting.records.evidence import EvidenceRecord
from geoprint.reporting.records.inspection import FeedbackRecord
from geoprint.reporting.records.rounding import Pair, Record
from geoprint.results import Side, TriedMedialAxis, TriedSource
from geoprint.robot.timing import Slowed

# What features measure of a plan.


class FigureRecord(Record):
    """A figure that a feature measures."""

    figure: str = Field(description="key of the figure")
    label: str = Field(description="name of the figure in tables, with its unit in brackets")
    meaning: str = Field(
        description="meaning of the figure for a reader who does not know it, in a few words; may be empty"
    )
    value: Rounded | None = Field(description="value of the figure; null where it could not be measured")
    lower_is_better: bool | None = Field(
        default=None, description="whether a lower value is better; left out where neither direction is"
    )

    @property
    def text(self) -> str:
        """Its value as it is written; a dash where it was not measured."""
        return "-" if self.value is None else f"{self.value:.4g}"


class FeatureRecord(Record):
    """What a feature measures."""

    feature: str = Field(description="name of the feature")
    title: str = Field(description="title of the feature, in a few words")
    figures: tuple[FigureRecord, ...] = Field(description="figures that the feature measures, in the feature's order")


# The schema of one of the robot's parts in plan.json: motion, clearance and program for one placement of the part.


class RotationRecord(Record):
    """How the nozzle turns about itself."""

    axial_nozzle: bool = Field(
        description="whether the nozzle's axis is the flange's, so that turning the nozzle moves joint 6 only"
    )
    least_deg: Thousandths = Field(
        description="least turn of the nozzle about itself, from the attitude of the path [degrees]"
    )
    most_deg: Thousandths = Field(
        description="largest turn of the nozzle about itself, from the attitude of the path [degrees]"
    )


class TiltRecord(Record):
    """The angle between nozzle and surface normal on deposit."""

    largest_deg: Thousandths = Field(description="largest angle between nozzle and surface normal on deposit [degrees]")
    mean_deg: Thousandths = Field(description="mean angle between nozzle and surface normal on deposit [degrees]")


class LeanPlaceRecord(Record):
    """A stretch in which the nozzle leans from the attitude of the path, where it does most."""

    run: int = Field(description="number of the run, from 0")
    place_mm: tuple[Thousandths, Thousandths, Thousandths] = Field(
        description="position of the tip where the nozzle leans most, in the part's coordinates [mm]"
    )
    lean_deg: Thousandths = Field(description="lean of the nozzle from the attitude of the path [degrees]")
    deposit: bool = Field(description="whether material is deposited there")


class RunLeanRecord(Record):
    """A run on which the nozzle leans from the attitude of the path."""

    run: int = Field(description="number of the run, from 0")
    mean_deg: Thousandths = Field(description="mean lean of the nozzle along the run [degrees]")
    largest_deg: Thousandths = Field(description="largest lean of the nozzle on the run [degrees]")


class LeanRecord(Record):
    """Where the nozzle leans from the attitude of the path."""

    deposit_share: Thousandths = Field(description="share of the deposited length where the nozzle leans")
    runs: tuple[RunLeanRecord, ...] = Field(
        default=(), description="runs on which the nozzle leans, in the order of printing"
    )
    places: tuple[LeanPlaceRecord, ...] = Field(
        description="stretches in which the nozzle leans, the largest lean first, at most 20"
    )


class BendRecord(Record):
    """A bend of the path that straight moves between its poses do not follow within tolerance and period."""

    run: int = Field(description="number of the run, from 0")
    kind: Literal["rounded", "close"] = Field(
        description=(
            "`rounded`: targets are set outside of the bend, so that rounded corners pass it. "
            "`close`: they are closer in time than a controller takes"
        )
    )
    place_mm: Place = Field(description="position of the tip in the middle of the bend [mm]")
    arc_mm: Rounded = Field(description="arc length from the start of the run to the middle of the bend [mm]")
    radius_mm: Rounded | None = Field(
        description="radius of the path in the middle of the bend [mm]; null where it is straight"
    )
    targets: Count = Field(description="number of targets in the bend")
    offset_mm: Rounded = Field(description="largest distance of a target in the bend from the path [mm]")
    shortest_ms: Rounded = Field(description="least time of a move in the bend [ms]")


class TargetsRecord(Record):
    """How the targets that the program names follow each other."""

    period_ms: Rounded = Field(description="shortest period that the controller takes without slowing down [ms]")
    closer: Count = Field(description="number of targets that follow the one before sooner than `period_ms`")
    shortest_ms: Rounded = Field(description="shortest time between two targets [ms]")
    shortest_mm: Rounded = Field(description="shortest move between two targets [mm]")
    least_ms: Rounded = Field(description="least time of a depositing move [ms]; a shorter one makes a `close` bend")
    bends: tuple[BendRecord, ...] = Field(
        description="bends that straight moves do not follow, in the order of printing"
    )


class QuadrantRecord(Record):
    """How near an axis whose quarter turns the configuration data count comes to a border of these on deposit."""

    axis: int = Field(description="number of the axis: 1, 4 or 6")
    targets_near: Count = Field(description="number of targets on deposit within 1 degree of a quadrant border")
    crossings: Count = Field(description="number of crossings of a quadrant border on deposit")
    nearest_deg: Thousandths = Field(
        description="smallest distance of a target on deposit to a quadrant border [degrees]"
    )
    run: int = Field(description="run of the target nearest to a quadrant border, from 0")
    place_mm: Place = Field(
        description="position of the tip at the target nearest to a quadrant border, in the part's coordinates [mm]"
    )


class OrientationRecord(Record):
    """How a demonstration was turned about its centroid, because with its mean normal up it is refused."""

    rpy_deg: tuple[Thousandths, Thousandths, Thousandths] = Field(
        description=(
            "roll, pitch and yaw of the demonstration about the base's fixed axes, after its mean normal was "
            "turned up; `demo_rpy_deg` in a cell [degrees]"
        )
    )
    tilt_deg: Thousandths = Field(description="tilt of the demonstration's mean normal from upright [degrees]")
    margin_deg: Thousandths = Field(
        description="margin of the motion in the search to limits and singularities [degrees]"
    )
    tried: Count = Field(description="number of orientations tried")
    start_refused: str = Field(description="reason why the demonstration is refused with its mean normal up")
    others_refused: tuple[str, ...] = Field(
        description="reasons why the orientations tried before the one taken are refused"
    )


class MovedRecord(Record):
    """Where a demonstration was moved, because where the cell puts it, it is refused however it is turned."""

    position_mm: tuple[Thousandths, Thousandths, Thousandths] = Field(
        description="position of the demonstration's centroid in the base frame; `demo_position_mm` in a cell [mm]"
    )
    rpy_deg: tuple[Thousandths, Thousandths, Thousandths] = Field(
        description=(
            "roll, pitch and yaw of the demonstration about the base's fixed axes, after its mean normal was "
            "turned up; `demo_rpy_deg` in a cell [degrees]"
        )
    )
    start_refused: str = Field(description="reason why the demonstration is refused where the cell puts it")


class DepositedRecord(Record):
    """Volume that the program deposits as it was executed, over the planned one; short runs count as dots."""

    share: Rounded = Field(description="volume deposited on all runs, over the planned one")
    least_run: Rounded = Field(description="volume deposited over the planned one, on the run that gets least")
    most_run: Rounded = Field(description="volume deposited over the planned one, on the run that gets most")


class MotionRecord(Record):
    """The arm's motion from home to home."""

    duration_s: Rounded = Field(description="duration of the motion, without waits for flow or lamp [s]")
    branch: int = Field(description="number of the inverse solution that the arm uses, one of eight, from 0")
    rotation: RotationRecord = Field(description="turn of the nozzle about itself")
    joint_6_turns: Thousandths = Field(description="turns of joint 6 over the whole motion")
    tilt: TiltRecord = Field(description="angle between the nozzle and the surface normal")
    lean: LeanRecord = Field(description="lean of the nozzle from the attitude of the path")
    smallest_wrist_angle_deg: Rounded = Field(description="smallest angle of joint 5 [degrees]")
    slowest_deposit_mm_s: Rounded = Field(description="slowest speed of the bead outside the ramps [mm/s]")
    off_moves_mm: Rounded = Field(
        description="largest distance of the timed path from the program's moves, all along [mm]"
    )
    off_moves_deg: Rounded = Field(
        description="largest turn of the timed path from the program's moves, where no corner is rounded [degrees]"
    )
    stretched_pieces: Count = Field(description="number of parts of the motion that had to be slower than planned")
    largest_jerk_m_s3: Rounded = Field(description="largest jerk of the tip on deposit, over steps of 10 ms [m/s3]")
    share_at_speed: Rounded = Field(description="share of the deposit within 1 % of the print's speed")
    share_on_ramps: Rounded = Field(description="share of the deposit on ramps at the ends of runs")
    share_slowed: Slowed | None = Field(
        default=None,
        description=(
            "share of the deposit slower than the print's speed outside the ramps, by the limit that slows it"
        ),
    )
    speed_ceiling_mm_s: float = Field(
        description="speed that was allowed on deposit; `settings.speed_mm_s` is the one that prints [mm/s]"
    )
    deposited: DepositedRecord | None = Field(
        default=None, description="volume that the program deposits as executed; left out where nothing is deposited"
    )
    slowdowns: tuple[Slowdown, ...] = Field(
        description="stretches of deposit slower than the print's speed, outside the ramps"
    )
    placement_calibrated: bool = Field(description="whether touched points give the placement of the fixture")
    placement_missing: tuple[str, ...] = Field(
        description="facts of the placement that nobody stated; with any, programs only run dry"
    )
    placement_orientation: OrientationRecord | None = Field(
        default=None, description="orientation found for a demonstration; left out if the cell's is used"
    )
    placement_moved: MovedRecord | None = Field(
        default=None, description="position found for a demonstration; left out if the cell's is used"
    )
    largest_touch_miss_mm: Rounded | None = Field(description="largest residual of the touched points [mm]")
    T_base_work: tuple[tuple[Rounded, ...], ...] = Field(
        description="transform from the part's coordinates to those of the robot's base, row by row [mm]"
    )
    surface_uncertainty_mm: Rounded | None = Field(
        default=None, description="standard deviation of the surface's position along its normal [mm]"
    )
    surface_within_mm: Rounded | None = Field(
        default=None, description="bound on the error of the surface along its normal in 95 of 100 calibrations [mm]"
    )
    surface_uncertain_at_mm: Place | None = Field(
        default=None, description="point where the surface is most uncertain [mm]"
    )
    targets: TargetsRecord = Field(description="spacing and timing of the program's targets")
    quadrants: tuple[QuadrantRecord, ...] = Field(description="distance of axes 1, 4 and 6 from borders of quadrants")


class DryRunRecord(Record):
    """What the dry run passes."""

    lift_mm: float = Field(description="height of the dry run above the printed path [mm]")
    smallest_mm: Rounded = Field(description="smallest clearance in the dry run [mm]")
    at: str = Field(description="where the clearance is smallest in the dry run, and what comes near what")


class ClearanceRecord(Record):
    """What the collision check of the motion found."""

    smallest_mm: Rounded = Field(description="smallest clearance of the tool [mm]")
    at: str = Field(description="where the tool's clearance is smallest, and what comes near what")
    arm_smallest_mm: Rounded | None = Field(description="smallest clearance of the arm [mm]")
    arm_at: str | None = Field(description="where the arm's clearance is smallest, and what comes near what")
    kept_mm: float = Field(description="clearance that was proven everywhere [mm]")
    tip_margin_mm: Rounded = Field(description="clearance of the tip on travel and of its rim on deposit [mm]")
    checks: Count = Field(description="number of places of the motion that were checked")
    checked: tuple[str, ...] = Field(description="pairs of bodies that were checked")
    not_checked: tuple[str, ...] = Field(description="list of what was not checked")
    dry_run: DryRunRecord = Field(description="clearance of the dry run")


class RunSwitchingRecord(Record):
    """When one run is deposited."""

    run: int = Field(description="number of the run, from 0")
    deposit_s: tuple[float, ...] = Field(
        description="times at which the deposit of the run starts and ends, on the path [s]"
    )
    material_s: tuple[float, ...] = Field(
        description="times at which material for the run starts and stops to leave the nozzle [s]"
    )


class SwitchingRecord(Record):
    """What flows and shines when, simulated from the program as it was read back."""

    largest_error_mm: Rounded = Field(description="largest distance of the material from the ends of a run [mm]")
    lamp_alone_s: Rounded = Field(description="time that the lamp is on without deposit [s]")
    runs: tuple[RunSwitchingRecord, ...] = Field(description="runs in the order of printing")
    lamp_s: tuple[tuple[float, ...], ...] = Field(description="times at which the lamp goes on and off [s]")
    vacuum_s: tuple[tuple[float, ...], ...] = Field(
        description="times at which the vacuum starts and stops drawing [s]"
    )


class ProgramRecord(Record):
    """The program that was written."""

    modules: tuple[str, ...] = Field(description="names of the program's files in the folder of its post-processor")
    targets: Count = Field(description="number of targets in the program")
    dry_run_only: bool = Field(
        description="whether the program only runs dry, because the placement of the part is not stated"
    )
    switching: SwitchingRecord = Field(description="switching of valve, lamp and vacuum")


class TablePoseRecord(Record):
    """How a table holds the part while this is printed."""

    attitude: Count = Field(description="number of the table's attitude, from 1, in the order of printing")
    axes: tuple[Rounded, ...] = Field(
        description=(
            "positions of the table's axes: lengths of the six legs [mm], or angles of tilting and turning [degrees]"
        )
    )
    kept_mm: Rounded = Field(
        description=(
            "least distance that is proven of the table and all on it from the arm at home, as it "
            "comes to this attitude [mm]"
        )
    )


class JoinedRecord(Record):
    """The one program of several attitudes, and what was executed of it."""

    file: str = Field(description="list of the modules that a person loads; attitudes are loaded by the program")
    print_s: Rounded = Field(description="time of all attitudes and of the table's own motions, loading left out [s]")
    table_s: Rounded = Field(
        description="part of `print_s` in which the table moves, at its largest speeds or as the program drives it [s]"
    )
    scenarios: tuple[str, ...] = Field(
        description=(
            "scenarios in which the program was executed, each attitude with the moves and switchings of its own "
            "program"
        )
    )
    refused: tuple[str, ...] = Field(
        description="scenarios in which the program ended before anything moved, as it must"
    )
    lines_with_statements: Count = Field(description="number of lines with statements in the program's main module")
    lines_executed: Count = Field(
        description="number of lines with statements that were executed in at least one scenario"
    )


class RobotRecord(Record):
    """The robot's part of a plan for one placement of the part."""

    table: TablePoseRecord | None = Field(
        default=None, description="table that holds the part; left out where the part is fixed"
    )

    motion: MotionRecord = Field(description="motion of the arm")
    clearance: ClearanceRecord = Field(description="clearance of the motion")
    program: ProgramRecord = Field(description="program of the motion")
    evidence: EvidenceRecord = Field(description="how far geoprint itself has proven the program")


class FileRecord(Record):
    """A file as it was read."""

    name: str = Field(description="name of the file, without its folder")
    sha256: str = Field(description="SHA-256 of the file", pattern="^[0-9a-f]{64}$")
    unit: str = Field(description="unit of the coordinates in the file")


class InputRecord(FileRecord):
    """The part's file, and those of the body and of what layers fill if the job names them."""

    made: dict[str, str | float | int] | None = Field(
        default=None, description="how the mesh was made from the file, where the file holds something else"
    )
    body: FileRecord | None = Field(default=None, description="file of the body under the part")
    target: FileRecord | None = Field(
        default=None, description="file of what layers fill: a shape, or a table of thicknesses"
    )


def _asked() -> dict[str, Any]:
    """Return what keys of a job become here: their names in plan.json with type and, as description, their help."""
    return {
        key.record or name: (
            field.annotation,
            Field(description=key.help) if key.always else Field(default=field.default, description=key.help),
        )
        for name, key, field in keys_of(Job)
        if key.record != ""
    }


class SettingsRecord(create_model("AskedRecord", __base__=Record, **_asked())):
    """What was asked for: every key of a job that is recorded, and the cell."""

    backend: str | None = Field(default=None, description="backend that planned; left out where several are compared")
    spacing_mm: float = Field(description="wanted distance between neighbouring paths [mm]")
    patches: list[PatchRegion] = Field(description="regions of the body that make up the part")
    robot: bool = Field(description="whether the robot is planned, too")
    cell: str = Field(description="name of the cell")
    speed_mm_s: float = Field(description="speed of the tip at which it prints [mm/s]")
    travel_speed_mm_s: float = Field(description="speed of the tip on travel [mm/s]")
    standoff_mm: float = Field(description="height of the tip over what the layer lies on [mm]")
    clearance_mm: float = Field(description="clearance that the tool keeps [mm]")
    retract_mm: float = Field(description="height of travel above the surface [mm]")
    layer_height_mm: float = Field(description="height of a layer [mm]")
    needle_mm: float = Field(description="inner diameter of the needle [mm]")
    flow_shares: tuple[float, float] = Field(
        description="least and most flow that follows the width, over that of a strip one spacing wide"
    )
    pressure_kpa: float | None = Field(description="air pressure [kPa]")
    flood_s: float | None = Field(description="time of the final exposure of the whole part [s]")


class MeshRecord(Record):
    """A mesh."""

    vertices: Count = Field(description="number of vertices")
    faces: Count = Field(description="number of faces")
    mean_edge_mm: Rounded = Field(description="mean length of an edge [mm]")


def _prepared() -> dict[str, Any]:
    """Return what fields of a report on preparing become here, the repairs first: their types and descriptions."""
    return {
        name: (Count if kind is int else kind, Field(description=what))
        for name, kind, what in (*described(Repairs), *described(PreparationReport))
    }


class PreparationRecord(create_model("PreparedRecord", __base__=Record, **_prepared())):
    """What preparing the mesh changed, and what it found."""


class SurfaceRecord(Record):
    """The part's surface."""

    topology: str = Field(description="topology of the surface in words")
    area_mm2: Rounded = Field(description="area of the surface [mm2]")
    size_mm: Place = Field(description="size of the surface's box along x, y, z [mm]")
    prepared: MeshRecord = Field(description="mesh before refinement")
    refined: MeshRecord = Field(description="mesh that was planned on")
    preparation: PreparationRecord | None = Field(
        description="changes made to the mesh in preparation; null for several patches, each of which lists its own"
    )
    side: Side = Field(description="side of the surface that is printed on")


class FibresRecord(Record):
    """The angles of fibres, by their length."""

    off_mean_deg: Rounded = Field(description="mean angle of fibres to the lines that they follow [degrees]")
    off_p95_deg: Rounded = Field(
        description="95th percentile of the angle of fibres to the lines that they follow [degrees]"
    )
    helix_mean_deg: Rounded | None = Field(
        default=None,
        description=(
            "mean fibre angle to the direction around the axis, positive where fibres rise to the right, seen from "
            "outside; left out without an axis [degrees]"
        ),
    )
    helix_deg: tuple[Rounded, Rounded] | None = Field(
        default=None,
        description=(
            "5th and 95th percentile of the angle of fibres to the direction around the axis [degrees]; left out "
            "without an axis"
        ),
    )


class PathsRecord(Record):
    """The paths as they are printed."""

    runs: Count = Field(description="number of runs; each starts and stops the dispenser")
    levels: Count = Field(description="number of levels")
    poses: Count = Field(description="number of poses, the rows of poses.csv")
    deposit_mm: Rounded = Field(description="length of the tip's path on deposit [mm]")
    travel_mm: Rounded = Field(description="length of the tip's path on travel [mm]")
    stops_while_laying: Count = Field(description="number of stops at sharp corners with the valve open")
    corners_rounded: Count = Field(description="number of rounded corners")
    corners_rounded_mm: tuple[Place, ...] = Field(description="where corners were rounded [mm]")
    corners_split: Count = Field(
        description="number of corners, and of edges of the part, too sharp to pass at speed, at which runs are split"
    )
    corners_split_mm: tuple[Place, ...] = Field(description="where runs were split [mm]")
    fragments: Count = Field(
        description="number of runs shorter than five spacings, little more than a start and a stop"
    )
    dropped_runs: Count = Field(
        description=(
            "number of runs left out as too short to be worth a start: shorter than one spacing or than the valve "
            "needs, fibres than three"
        )
    )
    dropped_mm: Rounded = Field(description="length of all dropped runs together [mm]")
    dropped_mm2: Rounded = Field(description="area that the dropped runs would have filled, length by width [mm2]")
    widths_mm: tuple[Rounded, Rounded] | None = Field(
        default=None, description="least and most width that is wanted; left out where paths are one spacing wide [mm]"
    )
    fibres: FibresRecord | None = Field(
        default=None, description="angles of the fibres; left out where paths follow no lines"
    )
    largest_distance_mm: Rounded = Field(description="largest distance from the source [mm]")
    largest_lean_deg: Rounded = Field(description="largest lean of the nozzle from the normal [degrees]")
    mean_lean_deg: Rounded = Field(description="mean lean of the nozzle from the normal [degrees]")


class LayerRecord(Record):
    """One skin of material."""

    number: Count = Field(description="number of the layer, from 0, from the part outwards")
    count: Count = Field(default=1, description="number of layers of the thickness")
    bottom_mm: float = Field(default=0.0, description="height over the part at which the layer begins [mm]")
    height_mm: float = Field(description="planned height of the layer [mm]")
    pattern: str | None = Field(
        default=None,
        description=("pattern of the layer's paths, with the angle of rows in degrees, where patterns alternate"),
    )
    standoff_mm: Rounded = Field(description="height of the tip over what the layer lies on [mm]")
    runs: Pair = Field(description="first and last run of the layer")


class RefinementRecord(Record):
    """How finely the surface was cut."""

    edge_length_mm: Rounded = Field(description="edge length that the backend needs [mm]")
    faces_before: Count = Field(description="number of faces of the prepared surface")
    faces_after: Count = Field(description="number of faces of the surface that was planned on")


class FieldRecord(Record):
    """How true the distance is that the paths follow: its slope is 1 where it is exact."""

    refinement: RefinementRecord = Field(description="refinement of the surface")
    mean_slope_error: Rounded = Field(description="mean difference of the slope from 1, away from the medial axis")
    p95_slope_error: Rounded = Field(description="95th percentile of the slope's difference from 1")
    cut_locus_share: Rounded = Field(description="share of the area along the medial axis")


class PatchSpacingRecord(Record):
    """The spacing on one patch, over the wanted one."""

    mean: Rounded | None = Field(description="mean spacing on the patch, over the wanted one; null with one level")
    cv: Rounded | None = Field(
        description="standard deviation of the spacing on the patch, over its mean; null with one level"
    )


class CutRecord(Record):
    """How a patch was cut from its body."""

    body: str = Field(description="name of the file of the body that the patch was cut from")
    topology: str = Field(description="topology of the patch in words")
    area_mm2: Rounded = Field(description="area of the patch [mm2]")
    rims_mm: tuple[Rounded, ...] = Field(description="length of each rim of the patch, the longest first [mm]")
    faces: Count = Field(description="number of faces of the patch")
    outside: str = Field(description="how the outer side of the patch was found")
    inside: str | None = Field(
        description=(
            "region that a drawn curve encloses, and which side of the curve was taken, in words; null without a curve"
        )
    )
    point_off_body_mm: Rounded | None = Field(
        description="largest distance of given points from the body [mm]; null without a point"
    )
    changes: tuple[str, ...] = Field(description="repairs made in preparation of the patch")


class PatchRecord(CutRecord):
    """A patch: how it was cut, and what became of it."""

    place_mm: Place = Field(description="point near the middle of the patch [mm]")
    runs: Pair = Field(description="first and last run that lie on the patch")
    deposit_mm: Rounded = Field(description="length of the tip's path on deposit on the patch [mm]")
    spacing: PatchSpacingRecord = Field(description="spacing on the patch over the wanted one")


class ChartLevelRecord(Record):
    """The spacing that the UV map predicts for one level, over the wanted one."""

    level: Count = Field(description="level, from 0 for the outermost")
    mean: Rounded = Field(description="mean spacing that the UV map predicts for the level, over the wanted one")
    min: Rounded = Field(description="smallest spacing that the UV map predicts for the level, over the wanted one")
    max: Rounded = Field(description="largest spacing that the UV map predicts for the level, over the wanted one")


class AreaScaleRecord(Record):
    """Percentiles of the UV map's area over that on the surface; 1 everywhere on a plane."""

    p1: Rounded = Field(description="1st percentile of the area in the UV map over that on the surface")
    p50: Rounded = Field(description="median of the area in the UV map over that on the surface")
    p99: Rounded = Field(description="99th percentile of the area in the UV map over that on the surface")


class ChartRecord(Record):
    """What flattening does to lengths and areas; of several patches over all, with the coarsest raster."""

    resolution: int = Field(description="pixels along the longer side of the raster")
    pixel_mm: Rounded = Field(description="side of a pixel in the UV map [mm]")
    largest_pixel_on_surface_mm: Rounded = Field(description="side on the surface of the largest pixel [mm]")
    area_scale: AreaScaleRecord = Field(description="scale of area in the UV map")
    mean_dilatation: Rounded = Field(
        description="mean of the longest over the shortest scale of length in the UV map; 1 is conformal"
    )
    predicted_spacing: tuple[ChartLevelRecord, ...] = Field(
        description="spacing that the UV map predicts, one over the scale of length, level by level"
    )


class DepositionRecord(Record):
    """What flows along the paths, and what light falls on it."""

    flow: Literal["constant", "follows the width"] = Field(
        description="planned flow; constant over the wanted width where that varies"
    )
    valve_mm3_s: Rounded = Field(description="flow through a valve that only opens and shuts [mm3/s]")
    valve_kpa: Rounded | None = Field(
        default=None,
        description=("air pressure at which this flow passes the valve, of a [material] whose flow is fitted [kPa]"),
    )
    least_mm3_per_mm: Rounded = Field(description="least flow, where it follows the width [mm3/mm]")
    most_mm3_per_mm: Rounded = Field(description="largest flow, where it follows the width [mm3/mm]")
    printed_mean_within: Rounded = Field(
        description="largest deviation of the mean thickness from the planned one in 95 of 100 prints, as a share"
    )
    light: Exposure | None = Field(description="dose of the lamp on the part; null if the lamp is not measured")


class TimingsRecord(Record):
    """The content of timings.json, which no manifest lists: what varies from run to run."""

    timings_s: dict[str, Thousandths] = Field(description="time of each stage [s]")
    peak_memory_mb: Count = Field(description="peak memory of the whole process so far [MB]")


class PlanRecord(Record):
    """The content of plan.json; what varies from run to run stands in timings.json."""

    layout: Literal[14] = Field(alias="schema", description="version of this layout")
    version: str = Field(description="version of geoprint")
    input: InputRecord = Field(description="file of the part")
    settings: SettingsRecord = Field(description="values of the job's keys, and the cell")
    surface: SurfaceRecord = Field(description="surface of the part")
    paths: PathsRecord = Field(description="paths as printed")
    layers: tuple[LayerRecord, ...] = Field(description="layers, from the part outwards")
    field: FieldRecord = Field(description="field of distance that the paths follow")
    patches: tuple[PatchRecord, ...] = Field(
        default=(), description="patches of the part, where it was cut from a body"
    )
    sources: tuple[TriedSource, ...] = Field(
        default=(), description="sources that were tried, where the best was asked for"
    )
    middles: tuple[TriedMedialAxis, ...] = Field(
        default=(), description="treatments of the medial axis that were tried, where the best was sought"
    )
    chart: ChartRecord | None = Field(default=None, description="UV map of a backend that flattens")
    uniformity: EvennessRecord | None = Field(
        default=None, description="evenness of the paths over the surface; left out where it was not measured"
    )
    deposition: DepositionRecord | None = Field(default=None, description="deposit of material")
    overhang: OverhangRecord | None = Field(
        default=None, description="overhang of beads; older versions did not measure it"
    )
    feedback: FeedbackRecord | None = Field(default=None, description="corrections from the last print")
    features: tuple[FeatureRecord, ...] = Field(
        default=(), description="features that the job names, with what they measure"
    )
    robot: tuple[RobotRecord, ...] = Field(
        description=(
            "motion, clearance and program of the robot for each placement of the part, in the order of printing; "
            "empty without a robot"
        )
    )
    joined: JoinedRecord | None = Field(
        default=None, description="program of all attitudes; left out where there is one or none"
    )
    not_printable: str | None = Field(default=None, description="reason why the robot cannot print what was compared")
    warnings: tuple[str, ...] = Field(description="warnings that a person should act on")
    notes: tuple[str, ...] = Field(default=(), description="notes that a person wants to know before printing")
    details: tuple[str, ...] = Field(
        default=(), description="details of what is as it should be, and how it came about"
    )
