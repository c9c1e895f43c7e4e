"""Slowdown: where joints or waypoints (targets) do not hold the print's speed, and the speed profile that follows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, final

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray, Process, Robot, Rounded, Slowdown, Trajectory, recorded
from geoprint.robot.timing.knots import METRES_PER_MILLIMETRE, Knots
from geoprint.robot.timing.topp import GriddedPath, Motion, end_ramps, strains

# A tip within 1 % of its speed deposits an even bead.
EVEN_SHARE = 0.99

# At each stop so many times the length of an ideal ramp to the set speed counts as ramp, whatever speed is held in the
# end; the path bends, so that the true ramp is longer.
RAMP_FACTOR = 2.0

JOINTS = 6


@final
@dataclass(frozen=True, slots=True)
class SpeedProfile:
    """How evenly the bead is deposited.

    Attributes:
        slowest: smallest speed away from the ramps [mm/s]; the set speed where nothing is deposited.
        dips: stretches below 99 % of the speed that is asked for, away from the ramps.
        share_at_speed: share of the deposited length within 1 % of the set speed; 1 where nothing is deposited.
        share_on_ramps: share of it that is below 99 % of the speed that is asked for, on the ramps.
    """

    slowest: float
    dips: tuple[Slowdown, ...]
    share_at_speed: float
    share_on_ramps: float


@final
@recorded("SlowedRecord")
class Slowed:
    """Shares of the deposited length that are not within 1 % of the set speed, away from the ramps, by the limit.

    Attributes:
        speed: share slowed by the largest speed of a joint.
        acceleration: share slowed by the largest acceleration of a joint.
        targets: share slowed because targets of a bend would follow each other sooner than a controller takes.
    """

    speed: Rounded
    acceleration: Rounded
    targets: Rounded


def slowed_shares(trajectory: Trajectory) -> Slowed:
    """Return which limits keep which share of the deposit from its set speed.

    What is neither at speed nor on a ramp is shared out by the lengths of the slowdowns.
    """
    slower = [each for each in trajectory.slowdowns if each.held_speed < EVEN_SHARE * each.set_speed]
    total = sum(each.length for each in slower)
    missing = max(1.0 - trajectory.share_at_speed - trajectory.share_on_ramps, 0.0)

    def share(limit: str) -> float:
        return missing * sum(each.length for each in slower if each.limit == limit) / total if total > 0.0 else 0.0

    return Slowed(share("speed"), share("acceleration"), share("targets"))


def lowered(knots: Knots, places: tuple[Slowdown, ...]) -> Knots:
    """Return the knots with the ceilings at some places of runs at the speeds that are held there."""
    ceilings = knots.ceilings.copy()
    for place in places:
        steps = knots.deposit & (knots.runs[1:] == place.run)
        steps &= np.abs(knots.arcs[1:] - place.arc) <= place.length / 2.0
        held = place.held_speed * METRES_PER_MILLIMETRE / knots.bead_shares[steps]
        ceilings[steps] = np.minimum(ceilings[steps], held)
    return replace(knots, ceilings=ceilings)


def speed_profile(knots: Knots, motions: list[Motion], *, robot: Robot, process: Process) -> SpeedProfile:
    """Measure how evenly the bead is deposited.

    Args:
        knots: what was timed; the ceilings of its depositing steps are the speeds that are asked for.
        motions: of its legs, in their order.
        robot: limits of the joints.
        process: with the set speed.
    """
    profiles = [
        _Profile.of(knots, first, last, motion, robot=robot, set_speed=process.speed)
        for (first, last), motion in zip(knots.legs, motions, strict=True)
        if knots.deposit[first:last].any()
    ]
    total = sum(float(profile.lengths.sum()) for profile in profiles)
    if not profiles or total == 0.0:
        return SpeedProfile(process.speed, (), 1.0, 0.0)
    at_speed = sum(float(profile.lengths @ profile.above(EVEN_SHARE * process.speed)) for profile in profiles)
    on_ramps = sum(
        float((profile.lengths * (1.0 - profile.above(EVEN_SHARE * profile.wanted)))[~profile.inner].sum())
        for profile in profiles
    )
    return SpeedProfile(
        slowest=min(profile.slowest for profile in profiles),
        dips=tuple(dip for profile in profiles for dip in profile.dips(robot=robot, set_speed=process.speed)),
        share_at_speed=at_speed / total,
        share_on_ramps=on_ramps / total,
    )


def off_ramps(grid: FloatArray, *, ramps: tuple[float, float]) -> BoolArray:
    """Return for each step whether it lies off the ramps; the first and the last one never do."""
    start, end = (RAMP_FACTOR * ramp for ramp in ramps)
    inner = (grid[:-1] >= start) & (grid[1:] <= grid[-1] - end)
    inner[[0, -1]] = False
    return inner


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Profile:
    """The bead's speed along the steps of one timed leg that deposit, h of them.

    Attributes:
        motion: of the leg.
        rows: (h,) step of the motion's grid.
        run: run of the stream.
        lengths: (h,) of bead [mm].
        speeds: (2, h) of the bead at both ends of the step [mm/s].
        wanted: (h,) that is asked for [mm/s].
        inner: (h,) whether the step lies off the ramps; where none does, only the fastest step.
        tips: (h, 3) tip at the start of the step [mm].
        arcs: (h,) arc length there, from the start of the run [mm].
    """

    motion: Motion
    rows: IntArray
    run: int
    lengths: FloatArray
    speeds: FloatArray
    wanted: FloatArray
    inner: BoolArray
    tips: FloatArray
    arcs: FloatArray

    @classmethod
    def of(cls, knots: Knots, first: int, last: int, motion: Motion, *, robot: Robot, set_speed: float) -> _Profile:
        """Return the profile of one leg."""
        lengths, grid = knots.lengths_of(first, last), motion.grid
        deposited, shares = knots.deposit[first:last], knots.bead_shares[first:last]
        ceilings = knots.ceilings[first:last].copy()
        ceilings[deposited] = set_speed * METRES_PER_MILLIMETRE / shares[deposited]
        step = first + np.searchsorted(lengths, grid[1:]) - 1
        rows = np.flatnonzero(knots.deposit[step])
        step, shares = step[rows], knots.bead_shares[step[rows]]
        speeds = np.stack([motion.speeds[rows], motion.speeds[rows + 1]]) * shares / METRES_PER_MILLIMETRE
        inner = off_ramps(grid, ramps=end_ramps(motion.path, ceilings=ceilings, robot=robot))[rows]
        if not inner.any():
            inner = np.arange(rows.size) == speeds.max(axis=0).argmax()
        within = (grid[rows] - lengths[step - first]) / (lengths[step - first + 1] - lengths[step - first])
        return cls(
            motion=motion,
            rows=rows,
            run=int(knots.runs[last]),
            lengths=np.diff(grid)[rows] * shares / METRES_PER_MILLIMETRE,
            speeds=speeds,
            wanted=knots.ceilings[step] * shares / METRES_PER_MILLIMETRE,
            inner=inner,
            tips=knots.tips[step] + within[:, None] * (knots.tips[step + 1] - knots.tips[step]),
            arcs=knots.arcs[step] + within * (knots.arcs[step + 1] - knots.arcs[step]),
        )

    @property
    def slowest(self) -> float:
        """Smallest speed off the ramps, or the largest where all is ramp [mm/s]."""
        return float(self._off_ramps.min())

    @property
    def _off_ramps(self) -> FloatArray:
        """(i,) speed of the inner steps [mm/s]: the smaller of both ends, but the larger where all is ramp."""
        inner = self.speeds[:, self.inner]
        slower: FloatArray = inner.min(axis=0)
        faster: FloatArray = inner.max(axis=0)
        return faster if faster.size == 1 else slower

    def above(self, speeds: FloatArray | float) -> FloatArray:
        """Return the share of each step that is deposited at least so fast; its square is linear in the length."""
        squares = self.speeds**2
        low: FloatArray = squares.min(axis=0)
        high: FloatArray = squares.max(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            share: FloatArray = (high - np.square(speeds)) / (high - low)
        return np.where(high == low, high >= np.square(speeds), share.clip(0.0, 1.0)).astype(np.float64)

    def dips(self, *, robot: Robot, set_speed: float) -> list[Slowdown]:
        """Return the stretches off the ramps that are below 99 % of the speed that is asked for."""
        steps = np.flatnonzero(self.inner)
        slow = steps[self._off_ramps < EVEN_SHARE * self.wanted[steps]]
        stretches = np.split(slow, np.flatnonzero(np.diff(slow) > 1) + 1) if slow.size else []
        below = self.lengths * (1.0 - self.above(EVEN_SHARE * self.wanted))
        return [self._dip(stretch, below, robot=robot, set_speed=set_speed) for stretch in stretches]

    def _dip(self, stretch: IntArray, below: FloatArray, *, robot: Robot, set_speed: float) -> Slowdown:
        lowest = int(stretch[self.speeds[:, stretch].min(axis=0).argmin()])
        row = int(self.rows[lowest])
        near = slice(max(row - 1, 0), row + 3)
        path = GriddedPath.of(self.motion.path, self.motion.grid[near])
        joint, limit = _limiting(strains(path, self.motion.speeds[near], robot=robot).max(axis=0))
        return Slowdown(
            run=self.run,
            place=_place(self.tips[lowest]),
            arc=float(self.arcs[lowest]),
            length=float(below[stretch].sum()),
            set_speed=set_speed,
            held_speed=float(self._off_ramps.min())
            if self._off_ramps.size == 1
            else float(self.speeds[:, stretch].min()),
            joint=joint,
            limit=limit,
        )


def _limiting(factors: FloatArray) -> tuple[int, Literal["speed", "acceleration"]]:
    """Return the joint, from 1, and the kind of the largest of twelve strains."""
    largest = int(factors.argmax())
    return largest % JOINTS + 1, "speed" if largest < JOINTS else "acceleration"


def _place(tip: FloatArray) -> tuple[float, float, float]:
    x, y, z = tip.tolist()
    return x, y, z
