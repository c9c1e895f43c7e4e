"""How much a program lays as it was executed, over what its paths ask for, and what to do where that is not alike."""

from __future__ import annotations

from collections.abc import Iterator

from geoprint.account.records.plan import PlanRecord
from geoprint.quality.stacked import executed_flow, laid_volume
from geoprint.results import Plan, RobotPlan

# A layer that is slowed down by less than this is not spoken of.
NOTABLE_SLOWING = 5e-4
# A bead whose volume is off by less than this is even enough not to speak of it.
NOTABLE_EXCESS = 0.05


def laid_share(plan: Plan, robot: RobotPlan) -> float | None:
    """Return the volume that a part of the program lays, as executed, over that of its paths; None without any."""
    poses = robot.joint_path.poses
    wanted = laid_volume(poses, poses.flow)
    if wanted == 0.0:
        return None
    times, material = robot.trajectory.pose_times, robot.switching.material
    return laid_volume(poses, executed_flow(poses, times, material, cell=plan.workpiece.cell)) / wanted


def made_up_notes(plan: Plan, told: PlanRecord) -> Iterator[str]:
    """Say by how much a layer of a stack is slowed down, so that it has its whole volume."""
    place, poses = plan.workpiece.place, plan.poses
    if place is None or plan.workpiece.cell.signals.mode == "analog":
        return
    share = float(poses.flow.max()) / (told.settings.spacing_mm * place.height)
    if share >= 1.0 + NOTABLE_SLOWING:
        yield (
            f"the paths of this layer leave out {1.0 - 1.0 / share:.2%} of its volume where fronts meet: it is laid at "
            f"{told.settings.speed_mm_s:.4g} mm/s, so much slower than the cell says, which makes up for it."
        )


def laid_warnings(told: PlanRecord) -> Iterator[str]:
    """Say where a program lays more than its paths ask for, because the tip does not hold the set speed."""
    shares = [1.0 if robot.motion.laid_share is None else robot.motion.laid_share for robot in told.robot]
    if max(shares, default=1.0) < 1.0 + NOTABLE_EXCESS:
        return
    number = shares.index(max(shares))
    motion, whose = told.robot[number].motion, f"IN ATTITUDE {number + 1} OF {len(shares)} " if len(shares) > 1 else ""
    held, speed = motion.largest_even_speed_mm_s, told.settings.speed_mm_s
    lowered = held is not None and held < speed
    why = f"the joints do not hold {speed:g} mm/s" if lowered else f"short runs hardly reach {speed:g} mm/s"
    slower = f"a speed_mm_s of {held:.1f}, with the pressure that lays the bead at it, or " if lowered else ""
    yield (
        f"{whose}THE PROGRAM LAYS {shares[number]:.2f} TIMES THE VOLUME of its paths: {why}, and a valve that only "
        f'opens and shuts lays by time. Set in the cell {slower}[signals] mode = "analog", with which the flow '
        "follows the speed."
    )
