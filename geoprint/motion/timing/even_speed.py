"""The largest speed at which all that is laid runs evenly, and how much of it which limit keeps from the set speed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import final

from geoprint.model import JointPath, Process, Robot, Slowdown, Trajectory, comparable
from geoprint.motion.timing.knots import path_knots
from geoprint.motion.timing.slowdown import EVEN_SHARE, JOINTS, RAMP_FACTOR, Hold, hold_of, off_ramps

# Each lowering shortens the ramps, so that more of a leg counts: it settles after a few.
SETTLINGS = 20
SETTLED = 1e-6


@final
@comparable
class Slowed:
    """Shares of the deposited length that are not laid within 1 % of the set speed, away from the ramps, by the limit.

    Attributes:
        speed: of a joint.
        acceleration: of a joint.
        targets: of a bend would follow each other sooner than a controller takes.
    """

    speed: float
    acceleration: float
    targets: float


def slowed_shares(trajectory: Trajectory) -> Slowed:
    """Return which limits keep which share of the deposit from its set speed.

    What is neither at speed nor on a ramp is shared out by the lengths of the slowdowns; of a run that was lowered as a
    whole, its dips count no more.
    """
    slower = [each for each in trajectory.slowdowns if each.held_speed < EVEN_SHARE * each.set_speed]
    whole = {each.run for each in slower if each.kind == "lowered"}
    slower = [each for each in slower if each.kind == "lowered" or each.run not in whole]
    total = sum(each.length for each in slower)
    missing = max(1.0 - trajectory.share_at_speed - trajectory.share_on_ramps, 0.0)

    def share(limit: str) -> float:
        return missing * sum(each.length for each in slower if each.limit == limit) / total if total > 0.0 else 0.0

    return Slowed(share("speed"), share("acceleration"), share("targets"))


def largest_even_speed(
    joint_path: JointPath, robot: Robot, *, process: Process, slowdowns: Iterable[Slowdown] = ()
) -> float:
    """Return the largest set speed at which all of the deposit but the ramps would run within 1 % of it [mm/s].

    At constant speed of the tip, joint speeds grow with it and accelerations with its square, so that the `strains` at
    the set speed tell the speed at which the first limit is met. The ramps at the ends of runs are left out, as they
    are at that speed, or at the set speed where that is less.

    Args:
        joint_path: p poses with their joints.
        robot: limits of the joints.
        process: with the set speed.
        slowdowns: of the trajectory: what targets of a bend hold is an upper bound.

    Returns:
        The speed; infinite where nothing is laid. Above what was set where that leaves room.
    """
    knots = path_knots(joint_path, process=process)
    legs = [hold_of(knots, first, last, robot=robot) for first, last in knots.legs if knots.deposit[first:last].any()]
    bounds = [each.held_speed for each in slowdowns if each.limit == "targets"]
    return min([*bounds, *(float(process.speed * _held_share(leg)) for leg in legs)], default=float("inf"))


def _held_share(leg: Hold) -> float:
    """Return the largest share of the set speed that a leg holds off its ramps; above 1 where there is room."""
    share = 1.0
    for _ in range(SETTLINGS):
        # A ramp is as long as the square of its top speed, which is the joints' where that is less than the tip's.
        start, end = (
            ramp * min(1.0, share * max(1.0, float(leg.factors[step, :JOINTS].max()))) ** 2
            for step, ramp in zip((0, -1), leg.ramps, strict=True)
        )
        # Ramps that meet leave nothing between them; they are the shorter the lower the speed.
        room = leg.lengths[-1] / max(RAMP_FACTOR * (start + end), float(leg.lengths[-1]) * SETTLED)
        inner = off_ramps(leg.lengths, ramps=(start, end)) & leg.laid
        held = 1.0 / max(float(leg.factors[inner].max()), SETTLED) if inner.any() else share
        found = min(held, share * room**0.5) if room < 1.0 else held
        if found >= share * (1.0 - SETTLED):
            return found if share == 1.0 else share
        share = found
    return share
