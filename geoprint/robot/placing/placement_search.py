"""Where a part may stand so that the arm prints it farthest from its limits.

The margin of a placement is the smallest angle, over all poses, by which any joint is inside its limits, |q5| above
what deposit needs, and the arm from being stretched; all poses on one branch and one turn about the nozzle. A coarse
grid over distance, height and yaw finds where it is large, a pattern search [Hooke1961] climbs from the best places of
it. Turning a part about axis 1 changes joint 1 alone: that is why the grid keeps the direction in which the part
stands, and only the climb moves it aside. At last it is turned so far that axis 1 crosses no border of its quadrants
on deposit, where that costs no margin.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.model import Box, FloatArray, IntArray, PoseStream, freeze_arrays, frozen
from geoprint.robot.arm import BRANCHES, JOINTS, QUARTER_TURN, Arm, about_nozzle, bordered_joints
from geoprint.robot.reach import PoseSamples, angle_margins, keyframes, sample_poses

# Poses on which placements are judged, besides those that reach farthest and lean most.
KEYFRAMES = 36
# The grid: distances [mm], turns of the part and about the nozzle.
GRID_STEP = 50.0
GRID_YAWS = 8
GRID_SPINS = 12
# The climb: first steps along x, y, z [mm], in yaw, about the nozzle, in roll and pitch [rad], and how often they are
# halved: 1.6 mm and a degree are left at last, finer than anybody sets a part down.
FIRST_STEPS = np.array([25.0, 25.0, 25.0, *np.radians([20.0, 10.0, 5.0, 5.0])])
HALVINGS = 5
# A step that gains less [rad] is not worth going on.
NOTABLE_GAIN = 1e-4
# How often the worst samples are added to the judged ones, and what they may differ by in the end [rad].
EXCHANGES = 5
CLOSE_ENOUGH = float(np.radians(0.5))
# Grid places from which the climb starts, no two of them nearer than a step of the grid and a step of yaw.
STARTS = 6
# Axis 1 keeps so far from the borders of its quadrants [rad]: the frame of a part 300 mm away may be off by 26 mm.
CLEAR_OF_BORDERS = float(np.radians(5.0))
# The arm's foot and column take this much room about axis 1 [mm]: half the diagonal of the IRB 120's foot, 127 mm, and
# a finger's width.
COLUMN_RADIUS = 150.0
# What a placement at which poses are out of reach is worth: less than any margin [rad], and less the more they are.
OUT_OF_REACH = -2.0 * np.pi


@final
@frozen
class FixturePose:
    """A place for the fixture's frame, in which the part has its centroid at the origin and its mean normal up.

    Attributes:
        position: (3,) in the base frame [mm].
        rpy: (3,) roll, pitch, yaw about the fixed axes of the base [rad].
    """

    position: FloatArray
    rpy: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, position="float: 3", rpy="float: 3")

    @property
    def T_base_fixture(self) -> FloatArray:
        """(4, 4) of the fixture's frame."""
        return transforms.rigid(Rotation.from_euler("xyz", self.rpy).as_matrix(), self.position)


@final
@frozen
class Room:
    """Where a part and what it lies on may stand.

    Attributes:
        part: (k, 3) corners of the part, in the fixture's frame [mm].
        body: (b, 3) corners of what it lies on, in the same frame [mm]; may be empty.
        obstacles: boxes in the base frame; both stand on or above them.
        ceiling: height in the base frame below which the part stays [mm]: that of the tip at home, because the motion
            from there to the part goes down.
    """

    part: FloatArray
    body: FloatArray
    obstacles: tuple[Box, ...]
    ceiling: float

    def __post_init__(self) -> None:
        freeze_arrays(self, part="float: k 3", body="float: b 3")

    def lowest(self, pose: FixturePose) -> float:
        """Return how far the part may be lowered from a place until it meets what is below it [mm].

        Negative where it is inside or below a box that lies below or above it; infinite over free space.
        """
        low, high = self._extent(pose)
        room = np.inf
        for box in self.obstacles:
            aside = (low[:2] >= box.centre[:2] + box.size[:2] / 2.0) | (high[:2] <= box.centre[:2] - box.size[:2] / 2.0)
            if not aside.any():
                room = min(room, float(low[2] - box.centre[2] - box.size[2] / 2.0))
        return room

    def permits(self, pose: FixturePose) -> bool:
        """Say whether both stand above all boxes below them, clear of the arm, and the part below the ceiling."""
        low, high = self._extent(pose)
        nearest = np.clip(0.0, low[:2], high[:2])
        highest = transforms.apply(pose.T_base_fixture, self.part)[:, 2].max()
        return bool(self.lowest(pose) >= 0.0 and np.hypot(*nearest) >= COLUMN_RADIUS and highest <= self.ceiling)

    def _extent(self, pose: FixturePose) -> tuple[FloatArray, FloatArray]:
        placed = transforms.apply(pose.T_base_fixture, np.vstack([self.part, self.body]))
        return placed.min(axis=0), placed.max(axis=0)


@final
@frozen
class Candidate:
    """A place, the motion that reaches the part there, and what it is worth.

    Attributes:
        pose: where the part stands.
        margin: smallest over the poses [rad], or less than -2 pi where some are out of reach.
        branch: of the inverse kinematics.
        spin: turn about the nozzle [rad].
    """

    pose: FixturePose
    margin: float
    branch: int
    spin: float


@final
class _Judge:
    """Judges places on some samples of a stream, or on all of them.

    Args:
        samples: of the stream, in the fixture's frame.
        arm: with its tool.
        rows: samples on which places are judged.
    """

    def __init__(self, samples: PoseSamples, arm: Arm, *, rows: IntArray) -> None:
        self._samples = samples
        self._arm = arm
        self._rows = rows

    def best(self, pose: FixturePose, *, spins: FloatArray, branches: list[int]) -> Candidate:
        """Return the place with its best motion among turns about the nozzle and branches."""
        Ts = pose.T_base_fixture @ self._samples.Ts_base_tool[self._rows] @ about_nozzle(spins)[:, None]
        count = self._rows.size
        joints = self._arm.solutions(Ts.reshape(-1, 4, 4)).reshape(spins.size, count, BRANCHES, JOINTS)
        joints = np.swapaxes(joints[:, :, branches], 1, 2)
        margins = angle_margins(joints, self._arm, deposit=self._samples.deposit[self._rows]).min(axis=-1)
        worth = _worth(margins)
        spin, branch = np.unravel_index(int(worth.argmax()), worth.shape)
        return Candidate(pose, float(worth[spin, branch]), branches[branch], float(spins[spin]))

    def on_all(self, candidate: Candidate) -> tuple[Candidate, _Judge]:
        """Return a candidate judged on all samples, and a judge that also looks at the worst of each margin."""
        joints = self._joints(candidate)
        margins = angle_margins(joints, self._arm, deposit=self._samples.deposit)
        worst = np.where(np.isnan(margins), -np.inf, margins).argmin(axis=0)
        judged = replace(candidate, margin=float(_worth(margins.min(axis=1))))
        return judged, _Judge(self._samples, self._arm, rows=np.union1d(self._rows, worst))

    def clear_of_borders(self, candidate: Candidate, *, room: Room) -> Candidate:
        """Return a candidate turned about axis 1, as little as it takes to keep that clear of borders on deposit.

        Where the room or a margin does not allow it, or all of a quadrant is needed, it stays where it is.
        """
        axis_1 = np.unwrap(self._joints(candidate)[self._samples.deposit, 0])
        if 0 not in bordered_joints(self._arm) or not np.isfinite(axis_1).all() or not axis_1.size:
            return candidate
        low, high = float(axis_1.min()) - CLEAR_OF_BORDERS, float(axis_1.max()) + CLEAR_OF_BORDERS
        if np.floor(low / QUARTER_TURN) == np.floor(high / QUARTER_TURN) or high - low >= QUARTER_TURN:
            return candidate
        border = QUARTER_TURN * np.ceil(low / QUARTER_TURN)
        for turn in sorted((border - low, border - high), key=abs):
            x, y, z = candidate.pose.position
            position = np.array([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y, z])
            yaw = transforms.wrapped(candidate.pose.rpy[2:] + turn)
            aside = FixturePose(position, np.append(candidate.pose.rpy[:2], yaw))
            judged, _ = self.on_all(replace(candidate, pose=aside))
            if room.permits(aside) and judged.margin >= candidate.margin - NOTABLE_GAIN:
                return judged
        return candidate

    def _joints(self, candidate: Candidate) -> FloatArray:
        """Return the (s, 6) joints of a candidate at all samples [rad]."""
        turned = candidate.pose.T_base_fixture @ self._samples.Ts_base_tool @ about_nozzle(np.array([candidate.spin]))
        return self._arm.solutions(turned)[:, candidate.branch]


def _worth(margins: FloatArray) -> FloatArray:
    """Return the smallest of (..., s) margins; less than any of them where some are missing."""
    missing: FloatArray = np.isnan(margins).mean(axis=-1)
    worth: FloatArray = np.where(missing > 0.0, OUT_OF_REACH * (1.0 + missing), margins.min(axis=-1))
    return worth


def search_placement(
    poses: PoseStream,
    arm: Arm,
    *,
    T_fixture_work: FloatArray,
    start: FixturePose,
    room: Room,
    height: float | None = None,
    tilt: float = 0.0,
) -> tuple[Candidate, ...]:
    """Return places for a part, the one with the largest margin first.

    Args:
        poses: the stream to print, in the work frame; its attitudes are taken to turn with the part.
        arm: with its tool.
        T_fixture_work: (4, 4) the part on its fixture.
        start: where it stands now; the grid keeps the direction in which that is seen from axis 1.
        room: where it may stand.
        height: of the part's centroid that is kept [mm], or None where it is free.
        tilt: largest angle from upright that is tried [rad].

    Returns:
        One or more candidates that the room permits, margins over all poses falling; a negative one says that some
        poses are refused. Axis 1 is clear of borders of quadrants on deposit where room and margin permit that.
        Flips, windings and collisions are not looked at: what is proposed must be planned through.

    Raises:
        InputError: the stream is empty, or the room permits no place within the arm's reach.
    """
    if poses.count == 0:
        raise InputError("the pose stream is empty: plan at least one run.")
    samples = sample_poses(poses, T_base_work=T_fixture_work)
    judge = _Judge(samples, arm, rows=judged_samples(samples.Ts_base_tool))
    spins = 2.0 * np.pi * np.arange(GRID_SPINS) / GRID_SPINS
    candidates = [pose for pose in _grid(arm, start, room=room, height=height, tilt=tilt) if room.permits(pose)]
    if not candidates:
        raise InputError(
            f"the arm cannot reach the part above the obstacles, below {room.ceiling:.0f} mm (the tip at home) and "
            f"{COLUMN_RADIUS:g} mm from axis 1. Raise home, or choose a smaller part or body."
        )
    steps = np.diag(FIRST_STEPS)[
        [*([0, 1] if height is not None else [0, 1, 2]), 3, 4, *([5, 6] if tilt > 0.0 else [])]
    ]
    found = [judge.best(pose, spins=spins, branches=[*range(BRANCHES)]) for pose in candidates]
    climbed = [_settled(candidate, judge, room=room, steps=steps, tilt=tilt) for candidate in _apart(found)]
    climbed = [judge.clear_of_borders(candidate, room=room) for candidate in climbed]
    return tuple(sorted(climbed, key=lambda candidate: -candidate.margin))


def judged_samples(Ts_fixture_tool: FloatArray) -> IntArray:
    """Return samples taken evenly, and those that are farthest or lean most in any of 26 directions."""
    evenly = keyframes(Ts_fixture_tool, count=KEYFRAMES)
    directions = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))
    columns = np.hstack([Ts_fixture_tool[:, :3, 3] @ directions.T, Ts_fixture_tool[:, :3, 2] @ directions.T])
    return np.union1d(evenly, columns.argmax(axis=0))


def _grid(arm: Arm, start: FixturePose, *, room: Room, height: float | None, tilt: float) -> Iterator[FixturePose]:
    """Yield places at even distances, heights and yaws within the arm's reach, and the start itself."""
    yield start if height is None else FixturePose(np.array([*start.position[:2], height]), start.rpy)
    shoulder = float(arm.inverse.shoulder[2])
    reach = arm.inverse.reach + float(np.linalg.norm(arm.T_flange_tool[:3, 3]))
    ahead = start.position[:2] / max(float(np.hypot(*start.position[:2])), np.finfo(float).tiny)
    if not ahead.any():
        ahead = np.array([1.0, 0.0])
    tilts = [(0.0, 0.0)]
    if tilt > 0.0:
        tilts += [(tilt, 0.0), (-tilt, 0.0), (0.0, tilt), (0.0, -tilt)]
    distances = np.arange(COLUMN_RADIUS, reach, GRID_STEP)
    lowest = min([box.centre[2] + box.size[2] / 2.0 for box in room.obstacles], default=shoulder - reach)
    heights = [height] if height is not None else np.arange(lowest, shoulder + reach, GRID_STEP / 2.0)
    yaws = 2.0 * np.pi * np.arange(GRID_YAWS) / GRID_YAWS
    yield from (
        FixturePose(np.array([*(distance * ahead), z]), np.array([roll, pitch, yaw]))
        for distance in distances
        for z in heights
        if np.hypot(distance, z - shoulder) <= reach
        for yaw in yaws
        for roll, pitch in tilts
    )


def _apart(found: list[Candidate]) -> list[Candidate]:
    """Return the best candidates, no two of them neighbours in the grid."""
    chosen: list[Candidate] = []
    for candidate in sorted(found, key=lambda candidate: -candidate.margin):
        if len(chosen) == STARTS:
            break
        if not any(_near(candidate.pose, other.pose) for other in chosen):
            chosen.append(candidate)
    return chosen


def _near(one: FixturePose, other: FixturePose) -> bool:
    turned = np.abs(transforms.wrapped(one.rpy - other.rpy)).max()
    return bool(np.abs(one.position - other.position).max() <= GRID_STEP and turned <= 2.0 * np.pi / GRID_YAWS + 1e-9)


def _settled(candidate: Candidate, judge: _Judge, *, room: Room, steps: FloatArray, tilt: float) -> Candidate:
    """Climb, look at all samples, add the worst of them to those that are judged, and climb again [Blankenship1976]."""
    best: Candidate | None = None
    for _ in range(EXCHANGES):
        climbed = _climbed(candidate, judge, room=room, steps=steps, tilt=tilt)
        judged, judge = judge.on_all(climbed)
        if best is None or judged.margin > best.margin:
            best = judged
        if judged.margin > climbed.margin - CLOSE_ENOUGH:
            break
        candidate = judge.best(best.pose, spins=np.array([best.spin]), branches=[best.branch])
    return best or candidate


def _climbed(candidate: Candidate, judge: _Judge, *, room: Room, steps: FloatArray, tilt: float) -> Candidate:
    """Climb from a candidate by (k, 7) steps, each along its own direction and back, as long as it is worth it."""
    best = candidate
    for halving in range(HALVINGS):
        improved = True
        while improved:
            improved = False
            for step in np.vstack([steps, -steps]) / 2.0**halving:
                tried = _stepped(best, step, tilt=tilt)
                if tried is None or not room.permits(tried[0]):
                    continue
                judged = judge.best(tried[0], spins=np.array([tried[1]]), branches=[best.branch])
                if judged.margin > best.margin + NOTABLE_GAIN:
                    best, improved = judged, True
    return best


def _stepped(candidate: Candidate, step: FloatArray, *, tilt: float) -> tuple[FixturePose, float] | None:
    """Return the place and the turn about the nozzle a step on; None where it tilts too far."""
    pose = candidate.pose
    roll_pitch = pose.rpy[:2] + step[5:]
    if np.hypot(*roll_pitch) > tilt + 1e-9:
        return None
    rpy = np.append(roll_pitch, transforms.wrapped(pose.rpy[2:] + step[3:4]))
    return FixturePose(pose.position + step[:3], rpy), candidate.spin + float(step[4])
