"""How much a program deposits as it was executed, over what its paths ask for."""

from __future__ import annotations

from collections.abc import Iterator

from geoprint.account.records.plan import PlanRecord
from geoprint.account.records.robot import DepositedRecord
from geoprint.model import Cell
from geoprint.quality.stacked import deposited_shares, executed_flow, laid_volume
from geoprint.results import Plan, RobotPlan

# A layer that is slowed down by less than this is not spoken of.
NOTABLE_SLOWING = 5e-4


def record_deposited(robot: RobotPlan, cell: Cell) -> DepositedRecord | None:
    """Return the volume that a part of the program deposits, as executed, over that of its paths; None without any."""
    poses = robot.joint_path.poses
    wanted = laid_volume(poses, poses.flow)
    if wanted == 0.0:
        return None
    flow = executed_flow(poses, robot.trajectory.pose_times, robot.switching.material, cell=cell)
    _, shares = deposited_shares(poses, flow, layer_height=cell.process.layer_height)
    return DepositedRecord(
        share=laid_volume(poses, flow) / wanted, least_run=float(shares.min()), most_run=float(shares.max())
    )


def made_up_notes(plan: Plan, told: PlanRecord) -> Iterator[str]:
    """Say by how much a layer of a stack is slowed down, so that it has its whole volume."""
    place, poses = plan.workpiece.place, plan.poses
    if place is None or plan.workpiece.cell.signals.mode == "analog":
        return
    share = float(poses.flow.max()) / (told.settings.spacing_mm * place.height)
    if share >= 1.0 + NOTABLE_SLOWING:
        yield (
            f"the paths of this layer leave out {1.0 - 1.0 / share:.2%} of its volume where fronts meet: it prints so "
            "much slower, which makes up for it."
        )
