"""What the view shows, read from the files of a folder: paths, motion, program and figures of each of its plans."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.config import Job, SourceTable
from geoprint.distance import Piecewise
from geoprint.errors import GeoprintError, InputError, UsageError
from geoprint.geometry import upright_of
from geoprint.geometry.files import load_file
from geoprint.metrics import MeasuredSurface, Uniformity
from geoprint.model import FloatArray, IntArray, PoseStream, Surface, frozen
from geoprint.positioner import obstacles_at, table_machine
from geoprint.postprocessor import (
    PLAN,
    Orders,
    Setup,
    Timeline,
    TipsAt,
    TrajectoryTable,
    check_timeline,
    read_orders,
    read_poses_table,
    read_setup,
    read_trajectory_table,
    timeline,
)
from geoprint.postprocessor.interface import Execution, RobotProgram
from geoprint.postprocessor.registry import post_processor_of
from geoprint.reporting import read_record
from geoprint.reporting.divisions import division_in
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.replaying import ArmMotion, PrintMotion, machine, tip_speeds
from geoprint.reporting.values import COVERED, GAP, OVERLAP, Machine
from geoprint.robot.arm import Arm
from geoprint.robot.collision import mesh_target, obstacle_target, tool_distances
from geoprint.robot.reach import angle_margins
from geoprint.robot.timing import tips_at
from geoprint.workflow.backend_choice import backend_of
from geoprint.workflow.bundles import COMPARISON, bundles, foreign, listed, program_files, stream_of
from geoprint.workflow.check_inputs import planned_job
from geoprint.workflow.sources import sources_of, united_source
from geoprint.workflow.table_motion import sweep_seconds
from geoprint.workflow.tilting import PART
from geoprint.workflow.workpiece import read_part


@final
class Motion:
    """The motion of the arm along the paths of a plan, in one attitude of the part.

    Args:
        folder: with its setup, trajectory, targets and program.
        poses: of the paths that it prints.
        part: that they cover.
        body: what the part lies on, or None.

    Attributes:
        setup: cell and placement.
        table: when the joints are where.
        orders: the targets.
        poses: p of them.
        pose_times: (p,) when the tip passes each [s].
    """

    def __init__(self, folder: Path, poses: PoseStream, *, part: Surface, body: Surface | None) -> None:
        self._folder, self._part, self._body = folder, part, body
        self.poses = poses
        self.setup: Setup = read_setup(folder / "setup.json")
        self.table: TrajectoryTable = read_trajectory_table(folder / "trajectory.csv")
        self.orders: Orders = read_orders(
            folder / "targets.csv", read_poses_table(folder / "poses.csv"),
            extent=self.setup.extent, duration=float(self.table.times[-1]),
        )  # fmt: skip
        along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)))
        self.pose_times: FloatArray = np.interp(along, along[self.orders.poses], self.orders.times)
        self.arm = Arm(self.setup.cell.robot, T_flange_tool=self.setup.cell.tool.T_flange_tool)

    @cached_property
    def tips(self) -> TipsAt:
        """Returns where the tip is at times, in the work frame [mm]."""
        T_base_work = self.setup.placement.T_base_work
        return tips_at(self.table.times, self.table.joints, self.arm, T_base_work=T_base_work)

    @cached_property
    def speeds(self) -> FloatArray:
        """(k,) speed of the tip at the rows of the trajectory [mm/s]."""
        return tip_speeds(self.arm, self.table.times, self.table.joints, rows=np.arange(self.table.times.size))

    def row(self, time: float) -> int:
        """Return the row of the trajectory at a time [s]."""
        return int(np.clip(np.searchsorted(self.table.times, time), 0, self.table.times.size - 1))

    def target(self, time: float) -> int:
        """Return the target that the arm moves to at a time [s]."""
        return int(np.clip(np.searchsorted(self.orders.times, time), 0, self.orders.count - 1))

    def clearances(self, rows: IntArray) -> FloatArray:
        """Return the (k,) distances between tool and what is nearest of part, body and cell at k of the poses [mm]."""
        cell, placement = self.setup.cell, self.setup.placement
        T_work_base = transforms.inverse(placement.T_base_work)
        targets = [mesh_target(self._part, role="part")]
        targets += [] if self._body is None else [mesh_target(self._body, role="body")]
        targets += [obstacle_target(one, T_work_base=T_work_base) for one in obstacles_at(cell, placement)]
        return tool_distances(
            cell.tool,
            targets,
            transforms.rigid(transforms.rotation_of(self.poses.quaternions[rows]), self.poses.tips[rows]),
        )

    def margins(self, rows: IntArray) -> FloatArray:
        """Return the (k,) smallest margins of the joints to limits and singularities at k of the poses [rad]."""
        joints: FloatArray = np.empty((rows.size, self.table.joints.shape[1]))
        for axis, angles in enumerate(self.table.joints.T):
            joints[:, axis] = np.interp(self.pose_times[rows], self.table.times, angles)
        return angle_margins(joints, self.arm, deposit=self.poses.deposit[rows]).min(axis=1)

    @cached_property
    def program(self) -> Execution | None:
        """The program as it was executed, whose moves say where they stand; None where there is none that runs."""
        setup, files = self.setup, program_files(self._folder, self.setup.cell)
        if not files:
            return None
        wanted = RobotProgram("", 0.0, setup.placement, setup.surface_within, self.orders, (), self.tips, self.table)
        execution = post_processor_of(setup.cell).execute(files, wanted, setup.cell)
        return execution if execution.lines else None

    @cached_property
    def switching(self) -> Timeline | None:
        """What flows and shines when, as the program switches it; None without a program that runs."""
        if self.program is None:
            return None
        try:
            found = timeline(self.program.switched, self.orders, signals=self.setup.cell.signals, tips_at=self.tips)
            check_timeline(found)
        except GeoprintError:
            return None
        return found

    def line_of(self, target: int) -> str | None:
        """Return file and line of the move to a target; None where no program runs."""
        if self.program is None:
            return None
        file, line = self.program.lines[target]
        return f"{file}:{line}"

    def target_of(self, line: int) -> int | None:
        """Return the first target whose move stands at a line of the program or behind it; None where none does."""
        if self.program is None:
            return None
        there = np.flatnonzero(np.array([its for _, its in self.program.lines]) >= line)
        return int(there[0]) if there.size else None


@final
class ViewedPlan:
    """A plan as its folder holds it.

    Args:
        folder: of the plan.
        name: what it is called in the view.

    Attributes:
        folder: where it stands.
        name: what it is called.
        record: what plan.json says.
        job: that was planned.
        sided: the part on the side that is printed.
        surface: that the paths cover, n vertices.
        poses: p of them.
        motions: of the arm, one an attitude of the part; none without a robot.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self.folder, self.name = folder, name
        self._alike: ViewedPlan | None = None
        self.record: PlanRecord = read_record(folder / PLAN, PlanRecord)
        self.job: Job = planned_job(folder, listed(folder))
        self.sided = read_part(self.job)
        self.surface: Surface = self.sided.part
        self.poses: PoseStream = stream_of(folder, self.record)
        attitudes = sorted(folder.glob(f"{PART}*"), key=lambda path: int(path.name.removeprefix(PART)))
        if attitudes:
            motions = [self._motion(one, stream_of(one, self.record)) for one in attitudes]
        else:
            moved = (folder / "trajectory.csv").is_file()
            motions = [self._motion(folder, self.poses)] if moved else []
        self.motions: tuple[Motion, ...] = tuple(motions)

    def _motion(self, folder: Path, poses: PoseStream) -> Motion:
        return Motion(folder, poses, part=self.surface, body=self.sided.body)

    @property
    def spacing(self) -> float:
        """Wanted distance between neighbouring paths [mm]."""
        return float(self.record.settings.spacing_mm)

    @cached_property
    def upright(self) -> FloatArray:
        """(3, 3) rotation that turns the part as it stands in the cell, or with its mean normal up."""
        return upright_of(self.surface) if self.moving is None else self.moving.T_base_work[:3, :3]

    @cached_property
    def moving(self) -> PrintMotion | None:
        """The motion of the whole print on one time line; None without a robot."""
        if not self.motions:
            return None
        cell, placements = self.motions[0].setup.cell, [motion.setup.placement for motion in self.motions]
        arms = [
            ArmMotion(motion.table.times, motion.table.joints, placement)
            for motion, placement in zip(self.motions, placements, strict=True)
        ]
        turned = np.stack([np.eye(4), *(one.table.T_table_plate for one in placements if one.table)])
        table = None if cell.table is None or len(turned) == 1 else table_machine(cell.table)
        seconds = () if table is None else sweep_seconds(cell, table, Ts_from=turned[:-1], Ts_to=turned[1:])
        return PrintMotion(cell, arms, seconds=seconds)

    @cached_property
    def machine(self) -> Machine:
        """What moves around the part and stands about it, all joints at zero and a table at rest."""
        assert self.moving is not None  # noqa: S101  # Paths alone have no machine.
        cell = self.motions[0].setup.cell
        return machine(cell, T_base_work=self.moving.T_base_work, cell_file=None, body=self.sided.body)

    def at(self, moment: float) -> tuple[int, float]:
        """Return the attitude at a moment of the print [s], and the time on its own clock: below 0 the table moves."""
        assert self.moving is not None  # noqa: S101  # Paths alone have no moments.
        number = self.moving.attitude(moment)
        return number, moment - float(self.moving.begins[number])

    def moment(self, number: int, time: float) -> float:
        """Return the moment of the print [s] at a time on the clock of an attitude, from 0."""
        assert self.moving is not None  # noqa: S101  # Paths alone have no moments.
        return float(self.moving.begins[number]) + time

    @property
    def streams(self) -> tuple[PoseStream, ...]:
        """The poses that are printed, attitude by attitude; those of the paths without a robot."""
        return tuple(motion.poses for motion in self.motions) or (self.poses,)

    @cached_property
    def evenness(self) -> Uniformity:
        """Evenness of the paths, measured as `geoprint plan` measures it."""
        return self.measured.uniformity(self.poses, flow_shares=self.record.settings.flow_shares)

    @cached_property
    def measured(self) -> MeasuredSurface:
        """The part, prepared for measuring paths of this spacing."""
        if self._alike is not None:
            return self._alike.measured
        return MeasuredSurface(self.surface, spacing=self.spacing, wanted=self.sided.widths)

    def measure_like(self, other: ViewedPlan) -> None:
        """Take what is prepared for measuring from another plan, where that has the same part and spacing."""
        same = all(map(np.array_equal, _arrays(self.surface), _arrays(other.surface)))
        if same and self.spacing == other.spacing and self.sided.widths is None:
            self._alike = other

    @cached_property
    def coverage(self) -> IntArray:
        """(j,) what the places of `evenness` are: covered, a gap or an overlap."""
        return np.where(self.evenness.gaps, GAP, np.where(self.evenness.overlaps, OVERLAP, COVERED))

    @cached_property
    def distance(self) -> tuple[Surface, FloatArray]:
        """The surface that was planned on, and the distance from the source at its vertices, measured anew [mm]."""
        surface = load_file(self.folder / "surface.ply", unit="mm").surface
        taken = {one.patch: SourceTable.model_validate(one.source) for one in self.record.sources if one.taken}
        sources = tuple(taken.get(number, one) for number, one in enumerate(sources_of(self.job), start=1))
        base = None if self.sided.place is None else self.sided.place.base
        source = united_source(surface, sources, base=base)
        return surface, Piecewise(surface, backend_of(self.job)).distance(source).values


@frozen
class Viewed:
    """What a folder holds.

    Attributes:
        name: of the part.
        kind: one plan, plans of several backends on one part, or layers of a stack, from the part outwards.
        plans: one or more.
    """

    name: str
    kind: str
    plans: tuple[ViewedPlan, ...]


def load_viewed(folder: Path | str) -> Viewed:
    """Read a folder that `geoprint plan` or `compare` wrote.

    Raises:
        UsageError: it is a file.
        InputError: geoprint did not write it, it holds several parts, or a file in it is none that may be opened.
        VerificationError: a file cannot be read.
    """
    folder = Path(folder)
    if folder.is_file():
        raise UsageError(f"{folder} is a file: name the folder that `geoprint plan` or `geoprint compare` wrote.")
    names = listed(folder)
    for finding in foreign(folder, names):
        raise InputError(f"{folder / finding.file}: {finding.reason}; restore the file that geoprint wrote.")
    found = bundles(names)
    parents = sorted({str(place.parent) for place in found})
    if len(parents) > 1:
        which = " or ".join(str(folder / PurePosixPath(one)) for one in parents)
        raise InputError(f"{folder} holds several parts; name one of them: `geoprint view {which}`.")
    if not found:
        raise InputError(f"{folder} holds no plan; name a folder that `geoprint plan` or `geoprint compare` wrote.")
    plans = tuple(ViewedPlan(folder / place, place.name or folder.name) for place in found)
    for plan in plans[1:]:
        plan.measure_like(plans[0])
    stacked = COMPARISON not in names and division_in(names) is not None
    kind = "plan" if len(plans) == 1 else "stack" if stacked else "comparison"
    return Viewed(plans[0].record.input.name, kind, plans)


def _arrays(surface: Surface) -> tuple[FloatArray, IntArray]:
    return surface.vertices, surface.faces
