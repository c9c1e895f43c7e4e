"""Everything from the mesh to the program: the values that the stages of a plan made, in their order."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, final

import numpy as np

from geoprint.config import Job
from geoprint.distance import Shown
from geoprint.errors import FieldError, InputError, how_many
from geoprint.geometry import united
from geoprint.lazy import above
from geoprint.metrics import DistanceErrors, Printed, Uniformity
from geoprint.model import (
    Clearance,
    Contours,
    ControllerPath,
    Count,
    FloatArray,
    FollowedLines,
    JointPath,
    Placement,
    PoseStream,
    Program,
    Rounded,
    SignalMode,
    Surface,
    Table,
    Targets,
    Toolpath,
    Trajectory,
    freeze_arrays,
    frozen,
    recorded,
    table_of,
)
from geoprint.positioner import Attitude
from geoprint.postprocessor import Executed, Orders, StackProof, Timeline
from geoprint.process import Exposure, exposure
from geoprint.process.feedback import Correction
from geoprint.results.workpiece import Workpiece
from geoprint.robot.timing import OffMoves

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# What a plan, a comparison and measured toolpaths answer alike, by what is made of results: they are methods of each.


def result_html(self: object) -> str:
    """Return what a notebook shows of it."""
    return above("geoprint.reporting.notebook", "notebook_html")(self)


def result_view(self: object) -> Any:
    """Return its report page as a notebook shows it: it turns in 3D and has every figure, without a server."""
    return above("geoprint.reporting.notebook", "notebook_view")(self)


def result_figure(self: object) -> Figure:
    """Draw the paths, as beads or halves coloured by the distance to the next path, with what no path covers.

    Raises:
        FieldError: nobody has measured how even the paths are.
    """
    return above("geoprint.reporting.notebook", "result_figure")(self)


def save_result(self: object, directory: Path | str, *, overwrite: bool = False) -> Any:
    """Write it as the command that makes it does, complete and verified, or not at all; return its record.

    Args:
        self: the result.
        directory: where it shall stand; `geoprint.check` reads a plan or a comparison back.
        overwrite: whether what geoprint wrote there before may be replaced.

    Raises:
        UsageError: the folder exists already.
        ExportError: nothing can be written there.
        VerificationError: what was written reads back otherwise.
    """
    return above("geoprint.workflow", "save")(self, directory, overwrite=overwrite)


# What a plan keeps of a table that tilts the part.


# Whether runs are printed as they come, or pieces of them gathered by what one attitude admits.
Order: TypeAlias = Literal["kept", "gathered"]


@final
@frozen
class Tilting:
    """How a table is to tilt the part, so that as little as possible overhangs, with few moves.

    Attributes:
        table: what messages call it.
        rotary: whether its axes are angles, not lengths.
        attitudes: in the order of printing, with what is printed in each: rows of the deposited poses.
        axes: of the table in each, lengths of its legs or angles of tilting and turning [mm or rad].
        lengths: deposited in each [mm].
        seconds: that the table takes at least to come to each, from the one before or from rest; where the program
            drives it, the time that the program gives it.
        order: whether runs are printed as they come, or pieces of them gathered by what one attitude admits.
        moves: attitudes in each of these orders, as the deposit alone asks for them.
        overhanging: length that still overhangs [mm].
        missing: largest angle beyond the critical one that is left [rad].
        refused: attitudes that the robot refused before it printed their pieces in another one, in words.
    """

    table: str
    rotary: bool
    attitudes: tuple[Attitude, ...]
    axes: tuple[FloatArray, ...]
    lengths: tuple[float, ...]
    seconds: tuple[float, ...]
    order: Order
    moves: tuple[int, int]
    overhanging: float
    missing: float
    refused: tuple[str, ...] = ()


@final
@frozen
class DepositedLayer:
    """Flow along the paths of a plan.

    Attributes:
        mode: of the cell's signals: 'io' deposits the constant flow, 'analog' the one that follows.
        widest: where lines lie farthest apart, and least light falls [mm].
        following_flow: (p,) flow that follows the width [mm3/mm].
    """

    mode: SignalMode
    widest: float
    following_flow: FloatArray


@final
@frozen
class Fed:
    """What the last print changes.

    Attributes:
        digest: SHA-256 of the file of its appraisal.
        plan: name of the bundle that was printed.
        seen_in: name of the file of the scan or photograph.
        correction: of flow and valve.
        wanted: (q,) flow at the poses that deposit, without it [mm3/mm].
        held: share of these poses at which the cell's bounds hold the flow.
        speed: at which a valve deposits the flow that is commanded [mm/s]; None where it prints as the cell says.
    """

    digest: str
    plan: str
    seen_in: str
    correction: Correction
    wanted: FloatArray
    held: float
    speed: float | None

    def __post_init__(self) -> None:
        freeze_arrays(self, wanted="float: q")


@final
@recorded("MiddleRecord")
class TriedMedialAxis:
    """A treatment of contours at the medial axis, and how they cover the surface then.

    Attributes:
        middle: treatment of the medial axis, as the key `middle` of a job takes it.
        gap: share of the area that no path covers.
        overlap: share of the area that is covered twice.
        cv: coefficient of variation of the thickness with constant flow.
        runs: number of runs.
        taken: whether the treatment is the one that was taken.
    """

    middle: str
    gap: Rounded
    overlap: Rounded
    cv: Rounded
    runs: Count
    taken: bool


@final
@frozen
class Layer:
    """One skin of material.

    Attributes:
        surface: that its paths lie on.
        number: from 0, from the part outwards.
        height: that it shall have [mm].
    """

    surface: Surface
    number: int
    height: float


@final
@frozen
class RobotPlan:
    """The robot's part of a plan for one placement of the part; it exists only where every check was passed.

    Attributes:
        placement: where the part stands.
        joint_path: poses, joints and configurations.
        trajectory: when the arm is where.
        targets: poses that the program names.
        controller_path: the motion as the controller interpolates it.
        clearance: what the collision check of that motion found.
        dry_clearance: what that of the dry run found.
        orders: what the program carries out.
        program: its text.
        switching: what flows when, as the text was executed.
        executed: what of the text was executed, and how far it lies from the plan.
        off_moves: how far the trajectory is from the moves of the program, all along.
        ceiling: speed that was allowed [mm/s]; the cell of the workpiece has the one that prints.
        table_kept: distance that is kept from the arm at home while a table brings the part here [mm]; None where the
            part stands still.
    """

    placement: Placement
    joint_path: JointPath
    trajectory: Trajectory
    targets: Targets
    controller_path: ControllerPath
    clearance: Clearance
    dry_clearance: Clearance
    orders: Orders
    program: Program
    switching: Timeline
    executed: Executed
    off_moves: OffMoves
    ceiling: float
    table_kept: float | None = None


@final
@frozen
class JoinedProgram:
    """The one program of several parts of the robot, each of which was verified by itself.

    Attributes:
        modules: path and text of each of its files, in the folder of the program.
        beside: likewise of what a controller needs before the first load.
        proof: what was executed of it.
    """

    modules: tuple[tuple[str, str], ...]
    beside: tuple[tuple[str, str], ...]
    proof: StackProof


@final
@frozen
class Plan:
    """A plan: everything from the mesh to the program.

    Attributes:
        job: what was asked for.
        workpiece: the part, prepared and refined, with its body and cell.
        contours: the pattern's curves, the level of each, and the backend's distance.
        toolpath: runs in printing order.
        poses: poses of the tool in the work frame, as the robot is commanded; with several attitudes, as the paths are,
            since each entry of `robot` has its own.
        uniformity: evenness of the paths, or None if it was not measured.
        layers: layers of material that the paths deposit, from the part outwards.
        robot: the robot's part of the plan, one entry per attitude in the order of printing; empty without a robot.
        timings: name and seconds of each stage, in order.
        flattenings: UV map and raster of each component of the surface, for a backend that flattens; otherwise empty.
        deposited: the layer that the paths deposit, or None before the flow is chosen.
        middles: treatments of the medial axis that were tried; empty if contours leave no seam, or none was found.
        not_printable: why the robot cannot print the paths of a comparison, or None if it can or was left out.
        printed: expected thickness of prints, or None if evenness was not measured.
        followed: direction of the field on each face of the surface, or None if the paths follow no field.
        promised: (k,) promised distance of each point of the contours from the source [mm], or None if there is none.
        distance: errors of the backend's level curves, before any is fitted to the medial axis; None if they promise no
            distance, or it was not measured.
        fed: corrections from the last print, or None without feedback.
        tilting: attitudes of the table that tilts the part, or None if the part is fixed.
        joined: the program of all attitudes, or None if there is one or none.
    """

    job: Job
    workpiece: Workpiece
    contours: Contours
    toolpath: Toolpath
    poses: PoseStream
    uniformity: Uniformity | None
    layers: tuple[Layer, ...]
    robot: tuple[RobotPlan, ...]
    timings: tuple[tuple[str, float], ...]
    flattenings: tuple[Shown, ...]
    deposited: DepositedLayer | None = None
    middles: tuple[TriedMedialAxis, ...] = ()
    not_printable: str | None = None
    printed: Printed | None = None
    followed: FollowedLines | None = None
    promised: FloatArray | None = None
    distance: DistanceErrors | None = None
    fed: Fed | None = None
    tilting: Tilting | None = None
    joined: JoinedProgram | None = None

    _repr_html_, view, figure, save = result_html, result_view, result_figure, save_result

    @property
    def paths(self) -> list[FloatArray]:
        """(k, 3) points of each run on the surface, in printing order [mm]; a closed one ends where it starts."""
        curves = self.toolpath.curves
        return np.split(curves.points.xyz(self.workpiece.surface), curves.offsets[1:-1])

    @property
    def trajectory(self) -> Trajectory:
        """The motion of the arm over time.

        Raises:
            InputError: the robot was left out, or has several parts with a trajectory each.
        """
        if len(self.robot) != 1:
            raise InputError(
                f"this plan has {how_many(len(self.robot), 'trajectory', 'trajectories')}, not one: with a table, read "
                "each entry of `robot`; without the robot, plan again with it."
            )
        return self.robot[0].trajectory

    @property
    def evenness(self) -> Uniformity:
        """The evenness of the paths.

        Raises:
            FieldError: the plan holds strokes and poses alone, which nobody has measured.
        """
        if self.uniformity is None:
            raise FieldError(
                "the evenness of these paths was not measured: compare the results of `plan` or `compare`."
            )
        return self.uniformity

    def table(self) -> Table:
        """Return a row for each run in printing order: run, layer, level, closed, x, y, z, length and volume.

        x, y, z are where it starts on the surface [mm]; length [mm] and volume [mm3] are of what is deposited. Lengths
        are those of the tip, as `deposit_mm` in plan.json is.
        """
        poses, path = self.poses, self.toolpath
        lengths = np.where(poses.deposited, np.linalg.norm(np.diff(poses.tips, axis=0), axis=1), 0.0)
        count = path.curves.count
        length, volume = (
            np.bincount(poses.runs[:-1], weights=each, minlength=count) for each in (lengths, lengths * poses.flow[:-1])
        )
        starts = path.curves.points.xyz(self.workpiece.surface)[path.curves.offsets[:-1]]
        return table_of(
            {
                "run": np.arange(count), "layer": path.layers, "level": path.levels, "closed": path.curves.closed,
                "x": starts[:, 0], "y": starts[:, 1], "z": starts[:, 2], "length": length, "volume": volume,
            }
        )  # fmt: skip

    @property
    def light(self) -> Exposure | None:
        """What the lamp gives at the speed of the print; None where nobody has measured its spot, or before flow."""
        cell = self.workpiece.cell
        if self.deposited is None:
            return None
        return exposure(cell.material, speed=cell.process.speed, spacing=self.deposited.widest, flood=cell.flood)

    @property
    def flat_surface(self) -> Surface:
        """The charts in the plane as one surface with the faces of the one that was flattened."""
        return united([one.flat for one in self.flattenings])
