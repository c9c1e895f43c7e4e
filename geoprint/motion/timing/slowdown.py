"""Where the joints cannot hold the set speed of the tip on deposit: what they hold instead, and which joint it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, final

import numpy as np
from scipy.interpolate import CubicSpline

from geoprint.model import BoolArray, FloatArray, IntArray, Process, Robot, Slowdown
from geoprint.motion.timing.knots import METRES_PER_MILLIMETRE, Knots
from geoprint.motion.timing.strain import GriddedPath, strains
from geoprint.motion.timing.topp import Motion, at_grid, end_ramps

# A tip within 1 % of its speed lays an even bead.
EVEN_SHARE = 0.99

# At each stop so many times the length of an ideal ramp to the set speed counts as ramp, whatever speed is held in the
# end; the path bends, so that the true ramp is longer.
RAMP_FACTOR = 2.0

# A lowered speed is a whole number of these steps [mm/s], so that the program can name it exactly.
SPEED_DECIMALS = 1
SPEED_STEP = 10.0**-SPEED_DECIMALS
SPEED_ROUNDING = 1e-9

JOINTS = 6


@final
@dataclass(frozen=True, slots=True)
class Pace:
    """How evenly the tip runs on deposit.

    Attributes:
        slowest: smallest tip speed away from the ramps [mm/s]; the set speed where nothing is laid.
        dips: stretches below 99 % of the speed of their run, away from the ramps.
        share_at_speed: share of the deposited length within 1 % of the set speed; 1 where nothing is laid.
        share_on_ramps: share of it that is below 99 % of the run's speed, on the ramps.
    """

    slowest: float
    dips: tuple[Slowdown, ...]
    share_at_speed: float
    share_on_ramps: float


def held_speeds(knots: Knots, *, robot: Robot, process: Process) -> tuple[Slowdown, ...]:
    """Find the runs whose joints do not hold the set speed all along, off the ramps at their stops, and what they hold.

    A joint that would have to turn f times as fast as it may sets the speed to 1/f, one that is accelerated f^2 times
    too much as well: at constant speed of the tip the accelerations go with its square. Runs that lose less than 1 %
    keep their speed; others get a whole number of tenths of a millimetre a second.

    Args:
        knots: of the path, with the set speed as ceiling.
        robot: limits of the joints.
        process: with the set speed.

    Returns:
        One slowdown a run, of kind 'lowered'.
    """
    holds: dict[int, list[Hold]] = {}
    for first, last in knots.legs:
        if knots.deposit[first:last].any():
            holds.setdefault(int(knots.runs[last]), []).append(hold_of(knots, first, last, robot=robot))
    slower: list[Slowdown] = []
    for run, legs in holds.items():
        share, hold, step = _held(legs)
        if share < EVEN_SHARE:
            joint, limit = _limiting(hold.factors[step])
            slower.append(
                Slowdown(
                    run=run,
                    kind="lowered",
                    place=_place(knots.tips[hold.first + step]),
                    arc=float(knots.arcs[hold.first + step]),
                    length=_laid_length(knots, run),
                    set_speed=process.speed,
                    held_speed=stepped(process.speed * share),
                    joint=joint,
                    limit=limit,
                )
            )
    return tuple(slower)


def held_after_dips(knots: Knots, dips: tuple[Slowdown, ...]) -> tuple[Slowdown, ...]:
    """Return what runs hold that still dip: one slowdown of kind 'lowered' for each, at the speed of its lowest dip."""
    lowest = {dip.run: dip for dip in sorted(dips, key=lambda dip: -dip.held_speed)}
    return tuple(
        replace(dip, kind="lowered", length=_laid_length(knots, run), held_speed=stepped(dip.held_speed))
        for run, dip in lowest.items()
    )


def lowered(knots: Knots, slower: tuple[Slowdown, ...]) -> Knots:
    """Return the knots with the ceilings of some runs, or of places of them, at the speeds that they hold."""
    ceilings = knots.ceilings.copy()
    for slowdown in slower:
        steps = _laid(knots, slowdown.run)
        if slowdown.kind == "dip":
            steps &= np.abs(knots.arcs[1:] - slowdown.arc) <= slowdown.length / 2.0
        held = slowdown.held_speed * METRES_PER_MILLIMETRE / knots.tip_shares[steps]
        ceilings[steps] = np.minimum(ceilings[steps], held) if slowdown.kind == "dip" else held
    return replace(knots, ceilings=ceilings)


def pace(knots: Knots, motions: list[Motion], *, robot: Robot, process: Process) -> Pace:
    """Measure how evenly the tip runs on deposit.

    Args:
        knots: what was timed; the ceilings of its depositing steps are the speeds of the runs.
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
        return Pace(process.speed, (), 1.0, 0.0)
    at_speed = sum(float(profile.lengths @ profile.above(EVEN_SHARE * process.speed)) for profile in profiles)
    on_ramps = sum(
        float((profile.lengths * (1.0 - profile.above(EVEN_SHARE * profile.wanted)))[~profile.inner].sum())
        for profile in profiles
    )
    return Pace(
        slowest=min(profile.slowest for profile in profiles),
        dips=tuple(dip for profile in profiles for dip in profile.dips(robot=robot, set_speed=process.speed)),
        share_at_speed=at_speed / total,
        share_on_ramps=on_ramps / total,
    )


def _laid(knots: Knots, run: int) -> BoolArray:
    """Return for each step whether it lays material of a run."""
    return knots.deposit & (knots.runs[1:] == run)


def _laid_length(knots: Knots, run: int) -> float:
    laid = _laid(knots, run)
    return float((np.diff(knots.lengths) * knots.tip_shares)[laid].sum()) / METRES_PER_MILLIMETRE


def stepped(speed: float) -> float:
    """Return the speed [mm/s] rounded down to a whole number of steps, where it has one."""
    steps = np.floor(speed / SPEED_STEP + SPEED_ROUNDING)
    return round(float(steps) * SPEED_STEP, SPEED_DECIMALS) if steps > 0 else speed


class Hold(NamedTuple):
    """What a leg needs to run at its ceilings all along.

    Attributes:
        first: its first knot.
        lengths: (n,) path parameter of its knots [m].
        laid: (n - 1,) whether the step lays material.
        factors: (n - 1, 12) the `strains` of each step at the ceilings: speeds of the joints, then accelerations.
        ramps: lengths of the ideal ramps at its ends [m].
    """

    first: int
    lengths: FloatArray
    laid: BoolArray
    factors: FloatArray
    ramps: tuple[float, float]


def hold_of(knots: Knots, first: int, last: int, *, robot: Robot) -> Hold:
    """Return what a leg needs to run at its ceilings all along."""
    lengths, ceilings = knots.lengths_of(first, last), knots.ceilings[first:last]
    path = CubicSpline(lengths, knots.joints[first : last + 1])
    factors = strains(GriddedPath.of(path, lengths), at_grid(ceilings, lengths, lengths), robot=robot)
    return Hold(first, lengths, knots.deposit[first:last], factors, end_ramps(path, ceilings=ceilings, robot=robot))


def _held(legs: list[Hold]) -> tuple[float, Hold, int]:
    """Return the share of the set speed that is held along all legs, and the leg and step that hold no more."""
    share, worst, step = 1.0, legs[0], 0
    for leg in legs:
        inner = off_ramps(leg.lengths, ramps=leg.ramps) & leg.laid
        factors = np.where(inner, leg.factors.max(axis=1), 0.0)
        if share * factors.max() > 1.0:
            step, worst = int(factors.argmax()), leg
            share = 1.0 / float(factors[step])
    return share, worst, step


def off_ramps(grid: FloatArray, *, ramps: tuple[float, float]) -> BoolArray:
    """Return for each step whether it lies off the ramps; the first and the last one never do."""
    start, end = (RAMP_FACTOR * ramp for ramp in ramps)
    inner = (grid[:-1] >= start) & (grid[1:] <= grid[-1] - end)
    inner[[0, -1]] = False
    return inner


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Profile:
    """The tip's speed along the steps of one timed leg that lay material, h of them.

    Attributes:
        motion: of the leg.
        rows: (h,) step of the motion's grid.
        run: run of the stream.
        lengths: (h,) that the tip passes [mm].
        speeds: (2, h) tip speed at both ends of the step [mm/s].
        wanted: (h,) speed of the run [mm/s].
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
        laid, tip_shares = knots.deposit[first:last], knots.tip_shares[first:last]
        ceilings = knots.ceilings[first:last].copy()
        ceilings[laid] = set_speed * METRES_PER_MILLIMETRE / tip_shares[laid]
        step = first + np.searchsorted(lengths, grid[1:]) - 1
        rows = np.flatnonzero(knots.deposit[step])
        step, shares = step[rows], knots.tip_shares[step[rows]]
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
        """Return the share of each step on which the tip is at least so fast; its square is linear in the length."""
        squares = self.speeds**2
        low: FloatArray = squares.min(axis=0)
        high: FloatArray = squares.max(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            share: FloatArray = (high - np.square(speeds)) / (high - low)
        return np.where(high == low, high >= np.square(speeds), share.clip(0.0, 1.0)).astype(np.float64)

    def dips(self, *, robot: Robot, set_speed: float) -> list[Slowdown]:
        """Return the stretches off the ramps that are below 99 % of the run's speed."""
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
            kind="dip",
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
