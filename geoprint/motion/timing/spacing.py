"""Trajectory and targets together: runs are slower where their targets would come sooner than a controller takes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geoprint.model import Bend, JointPath, OnSlowdown, Process, Robot, Slowdown, Targets, Trajectory
from geoprint.motion.controller import SHORTEST_TIME, written_targets
from geoprint.motion.timing.retiming import Known, retime
from geoprint.motion.timing.slowdown import stepped

# A slower run gets other targets; after so many lowerings what is still too close stays, and is listed.
MOST_LOWERINGS = 6
# What a run keeps of its speed at least in one lowering: the move that is far too short among these targets may be long
# enough among those of a run that is a little slower.
KEPT_SHARE = 0.8
# Where a place is lowered, so much is on either side of its targets [mm].
BESIDE = 0.5
# A run is not lowered below this share of the set speed: what a ramp or a stop leaves no room for, no speed mends.
SLOWEST_SHARE = 0.25


class TimedTargets(NamedTuple):
    """A trajectory, and the targets that are written of it."""

    trajectory: Trajectory
    targets: Targets


def timed_targets(
    joint_path: JointPath, robot: Robot, *, process: Process, on_slowdown: OnSlowdown = "lower"
) -> TimedTargets:
    """Run through a joint path in the shortest time in which its targets come no sooner than a controller takes.

    Where targets that lay material follow each other in less than 12 ms, the whole run is lowered by what is missing,
    so that the bead stays even, or with `follow` the place alone, and timed again; the trajectory lists it.

    Args:
        joint_path: p poses with their joints.
        robot: limits, home and the period of its targets.
        process: speeds of the tip.
        on_slowdown: what is done where the joints do not hold the set speed.

    Raises:
        InputError: the joint path is empty.
        LimitError: a limit cannot be kept.
        VerificationError: the result does not pass the poses.
    """
    known: Known = {}

    def timed(lowered: tuple[Slowdown, ...]) -> TimedTargets:
        trajectory = retime(joint_path, robot, process=process, on_slowdown=on_slowdown, lowered=lowered, known=known)
        return TimedTargets(
            trajectory, written_targets(joint_path, trajectory, process=process, period=robot.target_period)
        )

    lowered: tuple[Slowdown, ...] = ()
    found = best = timed(lowered)
    for _ in range(MOST_LOWERINGS):
        again = _lowerings(found, joint_path, process=process, whole_runs=on_slowdown == "lower", before=lowered)
        if not again:
            break
        lowered = again
        found = timed(lowered)
        best = min(best, found, key=_close)
    return best


def _close(found: TimedTargets) -> int:
    """Return how many moves are too short."""
    return sum(bend.targets for bend in found.targets.bends if bend.kind == "close")


def _lowerings(
    found: TimedTargets, joint_path: JointPath, *, process: Process, whole_runs: bool, before: tuple[Slowdown, ...]
) -> tuple[Slowdown, ...]:
    """Return what is lowered next: what was before, and whole runs with targets too close, or the places of these.

    Nothing where no more can be lowered.
    """
    close = [bend for bend in found.targets.bends if bend.kind == "close"]
    if whole_runs:
        speeds = {slow.run: slow.held_speed for slow in found.trajectory.slowdowns if slow.kind == "lowered"}
        worst = {bend.run: bend for bend in sorted(close, key=lambda bend: -bend.shortest)}
        again = [_run_lowered(joint_path, bend, speeds.get(run, process.speed), process) for run, bend in worst.items()]
        runs = {slow.run for slow in again if slow is not None}
        kept = [slow for slow in before if slow.run not in runs]
    else:
        again = [_place_lowered(bend, before, process) for bend in close]
        kept = list(before)
    slower = [slow for slow in again if slow is not None]
    return (*kept, *slower) if slower else ()


def _run_lowered(joint_path: JointPath, bend: Bend, speed: float, process: Process) -> Slowdown | None:
    """Return the run of a bend at the speed at which its closest targets would be far enough apart."""
    held = _held(bend, speed)
    if held < SLOWEST_SHARE * process.speed:
        return None
    length = _laid_length(joint_path, bend.run)
    return Slowdown(
        run=bend.run, kind="lowered", place=bend.place, arc=bend.arc, length=length, set_speed=process.speed,
        held_speed=held, joint=0, limit="targets",
    )  # fmt: skip


def _place_lowered(bend: Bend, before: tuple[Slowdown, ...], process: Process) -> Slowdown | None:
    """Return the place of a bend, with what is lowered there already, at such a speed."""
    there = [slow.held_speed for slow in before if slow.run == bend.run and abs(slow.arc - bend.arc) < slow.length / 2]
    held = _held(bend, min(there, default=process.speed))
    if held < SLOWEST_SHARE * process.speed:
        return None
    length = 2.0 * BESIDE + bend.targets * SHORTEST_TIME * process.speed
    return Slowdown(
        run=bend.run, kind="dip", place=bend.place, arc=bend.arc, length=length, set_speed=process.speed,
        held_speed=held, joint=0, limit="targets",
    )  # fmt: skip


def _held(bend: Bend, speed: float) -> float:
    return stepped(speed * max(bend.shortest / SHORTEST_TIME, KEPT_SHARE))


def _laid_length(joint_path: JointPath, run: int) -> float:
    poses = joint_path.poses
    laid = poses.laid & (poses.runs[1:] == run)
    return float(np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)[laid].sum())
