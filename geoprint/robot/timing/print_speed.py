"""Feed rate: one speed for a whole print, the highest at which a valve deposits what was planned."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil
from typing import NamedTuple, final

import numpy as np

from geoprint.model import (
    Bend,
    FloatArray,
    IntArray,
    JointPath,
    PoseStream,
    Process,
    Robot,
    Slowdown,
    Targets,
    Trajectory,
)
from geoprint.robot.arm import Arm
from geoprint.robot.controller import SHORTEST_TIME, KnownStretches, written_targets
from geoprint.robot.reach import bead_steps
from geoprint.robot.timing.knots import with_bulges
from geoprint.robot.timing.moments import tips_at
from geoprint.robot.timing.retiming import Known, retime
from geoprint.robot.timing.slowdown import EVEN_SHARE

# Trajectory and targets together: a run is slower where its targets would come sooner than a controller takes.


# A slower place gets other targets; after so many lowerings what is still too close stays, and is listed.
MOST_LOWERINGS = 6
# What a place keeps of its speed at least in one lowering: the move that is far too short among these targets may be
# long enough among those of a place that is a little slower.
KEPT_SHARE = 0.8
# Where a place is lowered, so much is on either side of its targets [mm].
BESIDE = 0.5
# A place is not lowered below this share of the set speed: no speed helps where a ramp or a stop leaves no room.
SLOWEST_SHARE = 0.25


def timed_targets(
    joint_path: JointPath,
    robot: Robot,
    *,
    process: Process,
    known: Known | None = None,
    stretches: KnownStretches | None = None,
) -> tuple[Trajectory, Targets]:
    """Run through a joint path in the shortest time in which its targets come no sooner than a controller takes.

    Where targets that deposit follow each other in less than 12 ms, the place is slower by what is missing, and timed
    again; the trajectory lists it.

    Args:
        joint_path: p poses with their joints.
        robot: limits, home and the period of its targets.
        process: speeds.
        known: as `retime` takes it.
        stretches: as `written_targets` takes what is known.

    Raises:
        InputError: the joint path is empty.
        LimitError: a limit cannot be kept.
        VerificationError: the result does not pass the poses.
    """
    known = {} if known is None else known
    stretches = {} if stretches is None else stretches

    def timed(slower: tuple[Slowdown, ...]) -> tuple[Trajectory, Targets]:
        trajectory = retime(joint_path, robot, process=process, slower=slower, known=known)
        period = robot.target_period
        return trajectory, written_targets(joint_path, trajectory, process=process, period=period, known=stretches)

    slower: tuple[Slowdown, ...] = ()
    found = best = timed(slower)
    for _ in range(MOST_LOWERINGS):
        close = [bend for bend in found[1].bends if bend.kind == "close"]
        again = [place for bend in close if (place := _lowered(bend, slower, process)) is not None]
        if not again:
            break
        slower = (*slower, *again)
        found = timed(slower)
        best = min(best, found, key=lambda one: _close(one[1]))
    return best


def _close(targets: Targets) -> int:
    """Return how many moves are too short."""
    return sum(bend.targets for bend in targets.bends if bend.kind == "close")


def _lowered(bend: Bend, before: tuple[Slowdown, ...], process: Process) -> Slowdown | None:
    """Return the place of a bend, with what is lowered there already, at a speed that leaves time for its targets."""
    there = [slow.held_speed for slow in before if slow.run == bend.run and abs(slow.arc - bend.arc) < slow.length / 2]
    held = min(there, default=process.speed) * max(bend.shortest / SHORTEST_TIME, KEPT_SHARE)
    if held < SLOWEST_SHARE * process.speed:
        return None
    length = 2.0 * BESIDE + bend.targets * SHORTEST_TIME * process.speed
    return Slowdown(
        run=bend.run, place=bend.place, arc=bend.arc, length=length, set_speed=process.speed, held_speed=held, joint=0,
        limit="targets",
    )  # fmt: skip


# One speed for a whole print: the highest at which a valve that only opens and shuts deposits what was planned.
#
# Such a valve lets the same volume through in every second, so that a run that takes longer than its length over the
# speed gets too much. The ramps at its ends do not count: the valve opens and shuts so much nearer to the middle of
# the run (`ramp_delay`) that what lies on them is right in sum. But a bead is even only at speed: a print of which
# less than nine tenths are at its speed is slower, where a speed not far below makes them.


# Volume over the planned one that is allowed: 5 % of each run and 2 % of all of them, with room for the executed ramps.
# A speed that was found for these has a little more once it is timed: what rounding changes decides nothing.
RUN_EXCESS = 0.045
WHOLE_EXCESS = 0.018
TIMED_SHARE = 1.05
# Share of the deposited length that may be below the speed of the print, and what a print keeps of its speed at least
# where it is slowed for that: on a part with many corners it would crawl. It loses 1 % at least in one try.
MOST_UNEVEN = 0.1
SLOWEST_EVEN = 0.6
LEAST_LOWERING = 0.99
# The speed has so many decimals [mm/s]: steps far finer than what the volumes tell, so that it follows from them
# without jumps, and short enough that the program can name it exactly.
SPEED_DECIMALS = 2
# What a speed is estimated to deposit proves a little off once it is timed: it is looked for so often.
MOST_TRIES = 8
# What a print keeps of its speed in one try after the other until its targets fit. The tries that are left look for a
# higher one, until it is so close.
SHRINKING = (0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3)
CLOSE_SHARE = 0.04
# The valve waits for a ramp no longer than the print takes for this [mm]. The bead begins a quarter of it behind where
# the tip stood: at 20 mm/s and 1 m/s2 the valve waits 10 ms, which pass 0.2 mm at speed, and 0.05 mm are missing.
LONGEST_WAIT = 1.0
# A ramp goes on while the speed rises by 1 % in this time [s]; at one acceleration that is so until 0.4 s.
RISE_TIME = 0.004
# How long after its start, or before its end, the ramp of a run is looked at, and how often [s].
RAMP_TIME = 0.152
RAMP_STEP = 0.004


class TimedPrint(NamedTuple):
    """What a print is timed as.

    Attributes:
        process: with the speed of the print.
        trajectory: at that speed.
        targets: that are written of it.
    """

    process: Process
    trajectory: Trajectory
    targets: Targets


def timed_print(
    joint_path: JointPath, arm: Arm, *, process: Process, constant_flow: bool, settle: float = 0.0
) -> TimedPrint:
    """Time a joint path, at the speed that deposits what was planned where the flow cannot follow.

    Args:
        joint_path: p poses with their joints.
        arm: that follows it, with its tool.
        process: its speed is not exceeded.
        constant_flow: whether the same volume flows in every second; else the speed stays.
        settle: how long the flow rises evenly, until it is that of the print, while the tip waits at each start [s].

    Raises:
        InputError: the joint path is empty.
        LimitError: a limit cannot be kept.
        VerificationError: the result does not pass the poses.
    """
    search = _Search(joint_path, arm, process, settle, {}, {})
    if not constant_flow:
        return search.timed(process.speed)
    return search.even(search.highest_with_targets(search.highest_of_joints()))


@final
@dataclass(frozen=True, slots=True)
class _Search:
    """Looks for the highest speed at which a joint path deposits what was planned; motions are timed only once."""

    joint_path: JointPath
    arm: Arm
    process: Process
    settle: float
    known: Known
    stretches: KnownStretches

    def timed(self, speed: float) -> TimedPrint:
        """Return the print at a speed [mm/s]."""
        process = replace(self.process, speed=speed)
        joint_path = with_bulges(self.joint_path, self.arm, process=process)
        found = timed_targets(joint_path, self.arm.robot, process=process, known=self.known, stretches=self.stretches)
        return TimedPrint(process, *found)

    def highest_of_joints(self) -> float:
        """Return the highest speed that the joints allow, whatever targets are written [mm/s]."""
        speed = self.process.speed
        for _ in range(MOST_TRIES):
            process = replace(self.process, speed=speed)
            lower = self._lower(speed, retime(self.joint_path, self.arm.robot, process=process, known=self.known))
            if lower is None:
                break
            speed = lower
        return speed

    def highest_with_targets(self, speed: float) -> TimedPrint:
        """Return the print at a speed [mm/s], or at the highest lower one at which its targets leave the volume right.

        A slower print has other targets: between a speed that fits and one that does not lies the highest that fits.
        """
        found = self.timed(speed)
        lower = self._lower(speed, found.trajectory)
        fits, too_high = lower is None, speed
        for kept in SHRINKING if not fits else ():
            if not fits:
                speed = max(lower or 0.0, _stepped(kept * too_high))
            elif too_high - found.process.speed > CLOSE_SHARE * too_high:
                speed = _stepped((too_high + found.process.speed) / 2.0)
            else:
                break
            tried = self.timed(speed)
            lower = self._lower(speed, tried.trajectory)
            if lower is None:
                found, fits = tried, True
            else:
                found, too_high = found if fits else tried, speed
        return found

    def even(self, found: TimedPrint) -> TimedPrint:
        """Return a print, slower where less than nine tenths of its length are at its speed, by four tenths at most.

        A ramp is as long as the square of the speed, and so about is what a bend takes; between a speed that is enough
        and one that is not the highest is looked for. Where none is enough, as on a part with many corners, the print
        stays as it is.
        """
        high, slowest = found.process.speed, SLOWEST_EVEN * found.process.speed
        uneven, even = 1.0 - found.trajectory.share_at_speed, None
        for _ in range(MOST_TRIES if uneven > MOST_UNEVEN else 0):
            if even is None:
                wanted = high * min((MOST_UNEVEN / max(uneven, MOST_UNEVEN)) ** 0.5, LEAST_LOWERING)
            elif high - even.process.speed > CLOSE_SHARE * high:
                wanted = (high + even.process.speed) / 2.0
            else:
                break
            if (speed := _stepped(wanted)) < slowest:
                break
            tried = self.timed(speed)
            uneven = 1.0 - tried.trajectory.share_at_speed
            if uneven <= MOST_UNEVEN and self._lower(speed, tried.trajectory) is None:
                even = tried
            else:
                high = speed
        return found if even is None else even

    def _lower(self, speed: float, trajectory: Trajectory) -> float | None:
        """Return a lower speed that probably fits, or None where this one does."""
        poses = self.joint_path.poses
        width = float(poses.flow.max(initial=0.0)) / self.process.layer_height
        tips = tips_at(trajectory.times, trajectory.joints, self.arm, T_base_work=self.joint_path.T_base_work)
        steps = _Steps.of(poses, trajectory.pose_times, tips, speed=speed, width=width, settle=self.settle)
        return steps.highest_speed(speed)


def _stepped(speed: float) -> float:
    """Return a speed rounded down to a whole number of steps, to one at least [mm/s]."""
    steps = 10.0**SPEED_DECIMALS
    return round(max(float(np.floor(speed * steps)), 1.0) / steps, SPEED_DECIMALS)


def ramp_delays(
    span: tuple[float, float], tips_at: Callable[[FloatArray], FloatArray], *, speed: float
) -> tuple[float, float]:
    """Return how much later than its run a material that flows evenly begins, and how much sooner it ends [s].

    What a valve lets through on the ramps of the run is then right in sum.

    Args:
        span: when the run begins and ends [s].
        tips_at: from (m,) moments [s] to the (m, 3) places of the tip [mm].
        speed: of the print [mm/s].
    """
    start, end = span
    samples = 1 + round(min(RAMP_TIME, (end - start) / 2.0) / RAMP_STEP)
    since: FloatArray = RAMP_STEP * np.arange(samples, dtype=np.float64)
    delays: list[float] = []
    for moments in (start + since, end - since):
        tips = tips_at(moments)
        steps = np.linalg.norm(np.diff(tips, axis=0), axis=1)
        delays.append(ramp_delay(since, np.append(0.0, np.cumsum(steps)), speed=speed))
    return delays[0], delays[1]


def ramp_delay(times: FloatArray, lengths: FloatArray, *, speed: float) -> float:
    """Return how much longer a run takes to come up to speed than at that speed all along [s].

    The ramp ends where the print's speed is reached within 1 %, or the speed rises no more: then that is the speed that
    the run begins with. Where it rises all along, the print's speed counts, which the run is too short for.

    Args:
        times: (k,) rising, from rest to the middle of the run or before [s].
        lengths: (k,) passed until then, from 0 [mm].
        speed: of the print [mm/s].
    """
    if lengths[-1] == 0.0:
        return 0.0
    passed, took = np.diff(lengths), np.diff(times)
    speeds = np.divide(passed, took, out=np.zeros_like(took), where=took > 0.0)
    later = np.interp(times[:-1] + RISE_TIME, times[:-1], speeds)
    up = (speeds > 0.0) & ((speeds >= EVEN_SHARE * speed) | (EVEN_SHARE * later <= speeds))
    end = int(up.argmax())
    reached = speed if end == up.size - 1 else min(speeds[end], speed)
    return float(np.clip(times[end] - times[0] - lengths[end] / reached, 0.0, LONGEST_WAIT / speed))


class _Steps(NamedTuple):
    """The steps between poses that deposit.

    Attributes:
        runs: (k,) run of each, or piece of one, from 0 without gaps.
        lengths: (k,) of bead [mm].
        times: (k,) that each takes without the delays of ramps [s].
        width: of the bead [mm]: a run that is shorter is a dot, and what it gets too much spreads over that.
        settled: time in which as much flows as while the tip waits at the start of a run [s].
    """

    runs: IntArray
    lengths: FloatArray
    times: FloatArray
    width: float
    settled: float = 0.0

    @classmethod
    def of(
        cls,
        poses: PoseStream,
        times: FloatArray,
        tips_at: Callable[[FloatArray], FloatArray],
        *,
        speed: float,
        width: float,
        settle: float = 0.0,
    ) -> _Steps:
        """Return those of a stream whose poses are passed at (p,) times, at a speed of the print [mm/s].

        The delays of ramps are those by which the valve will switch. A flow that rises evenly for `settle` [s] while
        the tip waits flows at once when it begins to move.
        """
        rows = np.flatnonzero(poses.deposited)
        # Over a table a run may be printed in several pieces.
        begins = (np.diff(rows) > 1) | (np.diff(poses.runs[rows + 1]) != 0)
        runs = np.append(0, np.cumsum(begins))[: rows.size]
        lengths, took = bead_steps(poses)[rows], np.diff(times)[rows]
        for own in np.split(np.arange(rows.size), np.flatnonzero(begins) + 1) if rows.size else ():
            span = float(times[rows[own[0]]]), float(times[rows[own[-1]] + 1])
            begun, ended = ramp_delays(span, tips_at, speed=speed)
            for delay, order in ((0.0 if settle > 0.0 else begun, own), (ended, own[::-1])):
                left = delay
                for step in order:
                    removed = min(left, max(float(took[step]) - float(lengths[step]) / speed, 0.0))
                    took[step] -= removed
                    left -= removed
        return cls(runs, lengths, took, width, settle / 2.0)

    def highest_speed(self, speed: float) -> float | None:
        """Return the highest lower speed at which each run and the whole probably get their volume.

        A step that is faster now takes as long as it is then asked for; none takes less than now. The slower the print,
        the less is too much.

        Returns:
            None where they do at this speed already, or at no other.
        """
        if self._fits(speed, share=TIMED_SHARE):
            return None
        steps = 10**SPEED_DECIMALS
        highest = bisect_right(range(1, ceil(speed * steps)), 0, key=lambda lower: not self._fits(lower / steps))
        return highest / steps or None

    def _fits(self, speed: float, *, share: float = 1.0) -> bool:
        """Tell whether a constant flow at a speed [mm/s] gives each run and the whole their volume.

        They may have such a share of the excess that is allowed.
        """
        took = np.bincount(self.runs, np.maximum(self.times, self.lengths / speed)) + self.settled
        lengths = np.bincount(self.runs, self.lengths)
        excess = (speed * took - lengths) / np.maximum(lengths, self.width)
        whole = speed * took.sum() / lengths.sum() if self.lengths.size else 1.0
        return bool((excess <= share * RUN_EXCESS).all() and whole <= 1.0 + share * WHOLE_EXCESS)
