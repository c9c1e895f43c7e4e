"""Trajectory and targets together: a run is slower where its targets would come sooner than a controller takes."""

from __future__ import annotations

from typing import NamedTuple

from geoprint.model import Bend, JointPath, Process, Robot, Slowdown, Targets, Trajectory
from geoprint.motion.controller import SHORTEST_TIME, written_targets
from geoprint.motion.timing.retiming import Known, retime

# A slower place gets other targets; after so many lowerings what is still too close stays, and is listed.
MOST_LOWERINGS = 6
# What a place keeps of its speed at least in one lowering: the move that is far too short among these targets may be
# long enough among those of a place that is a little slower.
KEPT_SHARE = 0.8
# Where a place is lowered, so much is on either side of its targets [mm].
BESIDE = 0.5
# A place is not lowered below this share of the set speed: no speed helps where a ramp or a stop leaves no room.
SLOWEST_SHARE = 0.25


class TimedTargets(NamedTuple):
    """A trajectory, and the targets that are written of it."""

    trajectory: Trajectory
    targets: Targets


def timed_targets(joint_path: JointPath, robot: Robot, *, process: Process, known: Known | None = None) -> TimedTargets:
    """Run through a joint path in the shortest time in which its targets come no sooner than a controller takes.

    Where targets that deposit follow each other in less than 12 ms, the place is slower by what is missing, and timed
    again; the trajectory lists it.

    Args:
        joint_path: p poses with their joints.
        robot: limits, home and the period of its targets.
        process: speeds.
        known: as `retime` takes it.

    Raises:
        InputError: the joint path is empty.
        LimitError: a limit cannot be kept.
        VerificationError: the result does not pass the poses.
    """
    known = {} if known is None else known

    def timed(slower: tuple[Slowdown, ...]) -> TimedTargets:
        trajectory = retime(joint_path, robot, process=process, slower=slower, known=known)
        return TimedTargets(
            trajectory, written_targets(joint_path, trajectory, process=process, period=robot.target_period)
        )

    slower: tuple[Slowdown, ...] = ()
    found = best = timed(slower)
    for _ in range(MOST_LOWERINGS):
        close = [bend for bend in found.targets.bends if bend.kind == "close"]
        again = [place for bend in close if (place := _lowered(bend, slower, process)) is not None]
        if not again:
            break
        slower = (*slower, *again)
        found = timed(slower)
        best = min(best, found, key=_close)
    return best


def _close(found: TimedTargets) -> int:
    """Return how many moves are too short."""
    return sum(bend.targets for bend in found.targets.bends if bend.kind == "close")


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
