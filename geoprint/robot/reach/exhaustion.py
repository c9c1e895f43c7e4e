"""Whether single poses can be served at all: every direction in the cone, every turn about the nozzle, every branch.

A pose is asked by itself, on a grid over attitudes: what fails there fails for every motion through the pose, at the
resolution of the grid. What is free there need not be free between it and its neighbours: many free poses make no
motion. An attitude is asked in the order of what it costs: the round solids of the nozzle and its rim, which no turn
changes; the joint limits and the wrist; bracket and lamp; the links of the arm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, comparable, freeze_arrays, frozen
from geoprint.robot.arm import BRANCHES, JOINTS, Arm, about_nozzle
from geoprint.robot.collision import SinglePoses
from geoprint.robot.reach.keyframes import MINIMUM_WRIST_ANGLE, path_lengths, tool_poses, usable
from geoprint.robot.reach.lean_room import depositing

# Steps of the grid over directions and turns [degrees]: that of the proof, and a coarse one that finds where to look.
LEAN_STEP, TURN_STEP = 1.0, 5.0
COARSE_LEAN_STEP, COARSE_TURN_STEP = 5.0, 30.0
# Poses on deposit that are looked at coarsely: so many evenly along the path, and of those at which the nozzle has no
# room along the normal.
EVENLY = 80
UPRIGHT = 120
# Of them those with least room on any branch are looked at closely, with so many that have least on all branches and
# nearest to where the motion was refused.
NARROWEST = 6
NEAREST = 3
# Attitudes whose arm is asked at a time, on each branch of any pose, and where no branch serves it: what is refused so
# often counts as refused. Bracket and lamp are asked in all attitudes then.
ARM_AT_A_TIME = 32
ARM_COUNT = 256
LARGEST_ARM_COUNT = 2048
# What refuses a pose, in the order in which it is asked.
CAUSES = ("nozzle", "reach", "bracket", "arm")


@final
@comparable
class Grid:
    """Attitudes that are tried at a pose.

    Attributes:
        cone: largest angle of the nozzle from the surface normal [rad].
        lean_step: angle between neighbouring directions [rad].
        turn_step: angle between neighbouring turns about the nozzle [rad].
    """

    cone: float
    lean_step: float = float(np.radians(LEAN_STEP))
    turn_step: float = float(np.radians(TURN_STEP))

    @property
    def leans(self) -> FloatArray:
        """(l, 2) leans from the normal about the x and y axes of the tool [rad], the smallest first."""
        rings = np.linspace(0.0, self.cone, round(self.cone / self.lean_step) + 1 if self.cone > 0.0 else 1)
        leans: list[FloatArray] = []
        for ring in rings.tolist():
            count = max(int(np.ceil(2.0 * np.pi * np.sin(ring) / self.lean_step)), 1)
            turns = 2.0 * np.pi * np.arange(count) / count
            leans.append(ring * np.column_stack([np.cos(turns), np.sin(turns)]))
        return np.concatenate(leans)

    @property
    def turns(self) -> FloatArray:
        """(r,) turns about the nozzle [rad]."""
        count = round(2.0 * np.pi / self.turn_step)
        return 2.0 * np.pi * np.arange(count) / count


@final
@comparable
class JudgedPose:
    """What the grid found at a pose.

    Attributes:
        pose: row of the stream.
        run: that it belongs to.
        place: (3,) of the tip in the work frame [mm].
        tried: attitudes on all branches.
        branches: which of the eight serve it.
        cause: what refuses the last attitudes where none serves: one of `CAUSES`, or empty.
    """

    pose: int
    run: int
    place: tuple[float, ...]
    tried: int
    branches: tuple[bool, ...]
    cause: str

    @property
    def free(self) -> bool:
        """Whether any branch serves it."""
        return any(self.branches)


@final
@comparable
class Exhausted:
    """What an exhaustive search says of the worst poses of a stream.

    Attributes:
        grid: of attitudes.
        poses: that were asked, in the order of printing.
        of: poses of the stream among which they were chosen.
    """

    grid: Grid
    poses: tuple[JudgedPose, ...]
    of: int

    @property
    def tried(self) -> int:
        """Attitudes at all poses, on all branches."""
        return sum(pose.tried for pose in self.poses)

    @property
    def blocked(self) -> tuple[JudgedPose, ...]:
        """Poses that no attitude serves on any branch."""
        return tuple(pose for pose in self.poses if not pose.free)

    @property
    def narrow(self) -> bool:
        """Whether the nozzle alone has no room at one of them."""
        return any(pose.cause == CAUSES[0] for pose in self.blocked)

    @property
    def served_by(self) -> tuple[int, ...]:
        """Branches that serve each of the poses by itself."""
        return tuple(np.flatnonzero(np.all([pose.branches for pose in self.poses], axis=0)).tolist())


@final
@frozen
class Worst:
    """Rows of a stream where arm and nozzle have least room.

    Attributes:
        rows: (k,) to be looked at closely.
        narrow: (n,) these, and all others at which a coarse look found nothing.
    """

    rows: IntArray
    narrow: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, rows="int: k", narrow="int: n")


@final
class Exhaustion:
    """A grid over attitudes, asked at the poses of a stream.

    Args:
        poses: p poses in the work frame.
        arm: with its tool; its inverse has a closed form.
        around: what must not be touched, with the part where it stands.
        T_base_work: (4, 4) where that is [mm].
        turned: whether a turn about the nozzle changes more than joint 6.
    """

    __slots__ = ("_Ts_base_tool", "_arm", "_around", "_deposit", "_normals", "_poses", "_turned")

    def __init__(
        self, poses: PoseStream, arm: Arm, *, around: SinglePoses, T_base_work: FloatArray, turned: bool
    ) -> None:
        self._poses, self._arm, self._around, self._turned = poses, arm, around, turned
        self._deposit = depositing(poses)
        self._normals = poses.normals @ T_base_work[:3, :3].T
        self._Ts_base_tool = tool_poses(poses, T_base_work=T_base_work)

    def worst(self, places: list[FloatArray], *, cone: float) -> Worst:
        """Return where the arm and the nozzle have least room, with what is nearest to places of the tip [mm]."""
        grid = Grid(cone, float(np.radians(COARSE_LEAN_STEP)), float(np.radians(COARSE_TURN_STEP)))
        rows = np.flatnonzero(self._deposit)
        lengths = path_lengths(self._poses)[rows]
        steps: FloatArray = np.linspace(float(lengths[0]), float(lengths[-1]), EVENLY)
        evenly = np.minimum(np.searchsorted(lengths, steps), rows.size - 1)
        upright = np.array([self._attitudes(int(row), np.zeros((1, 2)), np.zeros(1))[0, 0] for row in rows])
        without = rows[~self._around.nozzle_free(upright, deposit=True)]
        looked = np.union1d(rows[evenly], without[:: max(-(-without.size // UPRIGHT), 1)])
        counts = np.array([self._usable(int(row), grid).sum(axis=(0, 1)) for row in looked])
        order = np.argsort(counts.sum(axis=1), kind="stable")
        worst = [*looked[counts.argmin(axis=0)], *looked[order[:NARROWEST]]]
        for place in places:
            away = np.linalg.norm(self._poses.tips - place, axis=1)
            worst.extend(np.argsort(away, kind="stable")[:NEAREST])
        none = looked[(counts == 0).all(axis=1)]
        return Worst(np.unique(np.array(worst, dtype=np.int64)), np.union1d(none, np.array(worst, dtype=np.int64)))

    def room(self, row: int, grid: Grid) -> float:
        """Return in which share of the directions of a grid the nozzle has room at a row of the stream."""
        return float(self._free_leans(row, grid.leans).mean())

    def judged(self, rows: IntArray, grid: Grid) -> Exhausted:
        """Return what a grid finds at rows of the stream."""
        return Exhausted(grid, tuple(self._judged(int(row), grid) for row in rows), int(self._deposit.sum()))

    def _judged(self, row: int, grid: Grid) -> JudgedPose:
        leans, turns = grid.leans, self._turns(grid)
        usable_at = self._usable(row, grid)
        cause = CAUSES[0] if not self._free_leans(row, leans).any() else CAUSES[1]
        branches = np.zeros(BRANCHES, dtype=np.bool_)
        if usable_at.any():
            search = _ArmSearch(self._around, self._arm, self._attitudes(row, leans, turns), usable_at)
            branches, cause = search.branches()
        return JudgedPose(
            pose=row,
            run=int(self._poses.runs[row]),
            place=tuple(self._poses.tips[row].tolist()),
            tried=len(leans) * len(turns) * BRANCHES,
            branches=tuple(branches.tolist()),
            cause="" if branches.any() else cause,
        )

    def _usable(self, row: int, grid: Grid) -> BoolArray:
        """Return (l, r, 8) which attitudes leave the nozzle its room and are within the limits of the arm."""
        leans, turns = grid.leans, self._turns(grid)
        found = np.zeros((len(leans), len(turns), BRANCHES), dtype=np.bool_)
        free = np.flatnonzero(self._free_leans(row, leans))
        if not free.size:
            return found
        attitudes = self._attitudes(row, leans[free], turns)
        joints = self._arm.solutions(attitudes.reshape(-1, 4, 4))
        each = np.swapaxes(joints.reshape(-1, BRANCHES, JOINTS), 0, 1)
        deposit = np.full(each.shape[1], self._deposit[row])
        holds = usable(each, self._arm, deposit=deposit, minimum_wrist_angle=MINIMUM_WRIST_ANGLE)
        found[free] = holds.T.reshape(free.size, len(turns), BRANCHES)
        return found

    def _free_leans(self, row: int, leans: FloatArray) -> BoolArray:
        leaned = self._attitudes(row, leans, np.zeros(1))[:, 0]
        return self._around.nozzle_free(leaned, deposit=bool(self._deposit[row]))

    def _attitudes(self, row: int, leans: FloatArray, turns: FloatArray) -> FloatArray:
        """Return (l, r, 4, 4) poses of the tool in the base frame [mm]."""
        rotations = Rotation.from_rotvec(np.column_stack([leans, np.zeros(len(leans))])).as_matrix()
        upright = self._Ts_base_tool[row].copy()
        if self._deposit[row]:
            upright[:3, :3] = (
                transforms.smallest_rotation(upright[:3, 2], -self._normals[row][None])[0] @ upright[:3, :3]
            )
        leaned = upright @ transforms.rigid(rotations, np.zeros(3))
        return leaned[:, None] @ about_nozzle(turns)

    def _turns(self, grid: Grid) -> FloatArray:
        return grid.turns if self._turned else np.zeros(1)


@final
@dataclass(frozen=True, slots=True, eq=False)
class _ArmSearch:
    """Attitudes of one pose that the arm reaches, asked until a branch has one that is free.

    Attributes:
        around: what must not be touched.
        arm: with its tool.
        attitudes: (l, r, 4, 4) [mm].
        usable: (l, r, 8) which the arm reaches, the nozzle in its room.
    """

    around: SinglePoses
    arm: Arm
    attitudes: FloatArray
    usable: BoolArray

    def branches(self) -> tuple[BoolArray, str]:
        """Return (8,) branches that serve the pose, and what refuses it where none does."""
        poses, usable_at = self.attitudes.reshape(-1, 4, 4), self.usable.reshape(-1, BRANCHES)
        rows = [_spread(np.flatnonzero(usable_at[:, branch])) for branch in range(BRANCHES)]
        found = np.array([self._free(poses, each[:ARM_COUNT], branch) for branch, each in enumerate(rows)])
        if found.any():
            return found, ""
        reached = np.flatnonzero(usable_at.any(axis=1))
        if not self.around.carried_free(poses[reached]).any():
            return found, CAUSES[2]
        later = [self._free(poses, each[ARM_COUNT:LARGEST_ARM_COUNT], branch) for branch, each in enumerate(rows)]
        return np.array(later), CAUSES[3]

    def _free(self, poses: FloatArray, rows: IntArray, branch: int) -> bool:
        for first in range(0, rows.size, ARM_AT_A_TIME):
            some = rows[first : first + ARM_AT_A_TIME]
            some = some[self.around.carried_free(poses[some])]
            if some.size and self.around.arm_free(self.arm.solutions(poses[some])[:, branch]).any():
                return True
        return False


def _spread(rows: IntArray) -> IntArray:
    """Return rows in an order that spreads over all of them first: neighbours fare alike."""
    return rows[np.argsort(np.arange(rows.size) * GOLDEN % 1.0, kind="stable")]


# Multiples of the golden section, without their whole parts, spread evenly however many there are.
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
