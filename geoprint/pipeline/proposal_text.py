"""What is said of a proposed placement: the lines that a person reads, and the object for programs."""

from __future__ import annotations

import numpy as np

from geoprint.export import Json
from geoprint.model import FloatArray
from geoprint.motion.placing import Stand
from geoprint.motion.reach import Margin
from geoprint.pipeline.placing import DECIMALS, Proposal

# Places listed that are farthest beyond what is allowed.
WORST_PLACES = 5


def proposal_lines(stand: Stand) -> tuple[str, str]:
    """Return the lines under [work] in a cell file that put a demonstration there."""
    return (
        f"demo_position_mm = [{_listed(stand.position)}]",
        f"demo_rpy_deg = [{_listed(np.degrees(stand.rpy))}]",
    )


def proposal_text(proposal: Proposal) -> str:
    """Return the lines that a person reads of a proposal."""
    plan, stand, found = proposal.plan, proposal.stand, proposal.robot.clearance
    degrees = np.degrees(stand.rpy)
    turned = f"roll, pitch, yaw {_listed(degrees)}" if stand.rpy[:2].any() else f"yaw {_listed(degrees[2:])}"
    before = f"{_margin(proposal.before)}" + ("" if proposal.map_before.complete else ", refused")
    lines = [
        f"{plan.job.surface.name}: centroid at ({_listed(stand.position)}) mm, mean normal up, then {turned} degrees",
        f"margin: {_margin(proposal.after)}; where the cell file puts it: {before}",
    ]
    if not proposal.better:
        lines.append("note: nothing better was found than where the cell file puts it: leave that as it is.")
    if np.isfinite(proposal.above):
        lines.append(f"fixture: the lowest point is {proposal.above:.0f} mm above what stands below it")
    lines += [
        (
            f"verified on all {plan.poses.count} poses: joints, time and clearance ({found.smallest:.2f} mm at the "
            f"closest); not checked: {', '.join(found.not_checked)}"
        ),
        *(f"a better one fell: {reason}" for reason in proposal.refused),
        _next_step(proposal),
        *(f"    {line}" for line in proposal_lines(stand)),
    ]
    return "\n".join(lines)


def proposal_summary(proposal: Proposal) -> dict[str, Json]:
    """Return a proposal as `--json` prints it: lengths mm, angles degrees."""
    stand, robot, before = proposal.stand, proposal.robot, proposal.map_before
    return {
        "part": proposal.plan.job.surface.name,
        "cell": proposal.plan.workpiece.cell.name,
        "position_mm": stand.position.round(DECIMALS).tolist(),
        "rpy_deg": np.degrees(stand.rpy).round(DECIMALS).tolist(),
        "T_base_work": robot.placement.T_base_work.round(6).tolist(),
        "calibrated": robot.placement.calibrated,
        "better": proposal.better,
        **_margin_object(proposal.after),
        "before": {
            **_margin_object(proposal.before),
            "reached": before.complete,
            "lost": round(before.lost, 6),
            "lost_for": {reason: round(share, 6) for reason, share in before.shares().items()},
            "worst_places_mm": before.places[[*before.worst(WORST_PLACES)]].round(3).tolist(),
        },
        "lowest_point_above_mm": round(proposal.above, 3) if np.isfinite(proposal.above) else None,
        "smallest_clearance_mm": round(robot.clearance.smallest, 6),
        "not_checked": list(robot.clearance.not_checked),
        "refused": list(proposal.refused),
        "work": list(proposal_lines(stand)),
    }


def _next_step(proposal: Proposal) -> str:
    cell = proposal.plan.workpiece.cell
    if cell.fixture is None:
        return (
            "NOT CALIBRATED: nobody has measured that the part stands there, and a program runs only dry. To plan it "
            f"there with `--place demo`, put under [work] in {cell.name}:"
        )
    return (
        "NOT CALIBRATED: the touched points of the cell say where the part stands now. Move its fixture there, touch "
        f"the points again and list them; to try it before with `--place demo`, put under [work] in {cell.name}:"
    )


def _margin(margin: Margin) -> str:
    if not np.isfinite(margin.angle):
        return "out of reach"
    return f"{np.degrees(margin.angle):.1f} degrees ({margin.limiting})"


def _margin_object(margin: Margin) -> dict[str, Json]:
    angle = round(float(np.degrees(margin.angle)), 6) if np.isfinite(margin.angle) else None
    return {"margin_deg": angle, "limiting": margin.limiting}


def _listed(values: FloatArray) -> str:
    return ", ".join(f"{round(float(value), DECIMALS) + 0.0:g}" for value in values)
