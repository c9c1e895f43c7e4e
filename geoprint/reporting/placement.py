"""What is said of a proposed placement, and a refusal in words and numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from geoprint.config import PLACEMENT_DECIMALS
from geoprint.errors import Detail, PlanError, how_many, percent
from geoprint.geometry import in_words
from geoprint.model import Rounded, rounded
from geoprint.postprocessor import Json
from geoprint.reporting.records.rounding import Record, as_json
from geoprint.reporting.tables import marked_lines
from geoprint.results import Proposal, Refusal, TriedChange
from geoprint.robot.placing import FixturePose
from geoprint.robot.reach import Exhausted, JudgedPose, Margin

# What is said of a proposed placement: the lines that a person reads, and the object for programs.


# Places listed that are farthest beyond what is allowed.
WORST_PLACES = 5

Numbers = tuple[float, ...]


class BeforeRecord(Record):
    """Where the cell file puts the part: the margin, None out of reach, and what share of the poses is lost for what.

    The places are those of poses that are farthest beyond what is allowed, on the part.
    """

    margin_deg: float | None
    limiting: str
    reached: bool
    lost: Rounded
    lost_for: dict[str, float]
    worst_places_mm: tuple[Numbers, ...]


class ProposalRecord(Record):
    """What `geoprint place` says; the fields are the keys of `--json` in their order.

    Attributes:
        part: name of it.
        cell: name of the cell file.
        position_mm: of the part's centroid in the base frame.
        rpy_deg: roll, pitch, yaw of the part, turned from its mean normal up.
        T_base_work: rows of the part's frame [mm].
        calibrated: whether anybody has measured that the part stands there.
        better: whether it stands better than where the cell file puts it.
        margin_deg: how far inside what is refused every pose stays; None out of reach.
        limiting: to what it is nearest.
        before: where the cell file puts the part.
        lowest_point_above_mm: height of part and body over what stands below, or None over free space.
        smallest_clearance_mm: of the whole motion.
        not_checked: what the collision check leaves out.
        refused: why better candidates fell.
        work: lines under [work] in a cell file that put a demonstration there.
        table: lines under [table] that put the table below it, or None without one.
    """

    part: str
    cell: str
    position_mm: Numbers
    rpy_deg: Numbers
    T_base_work: tuple[Numbers, ...]
    calibrated: bool
    better: bool
    margin_deg: float | None
    limiting: str
    before: BeforeRecord
    lowest_point_above_mm: float | None
    smallest_clearance_mm: Rounded
    not_checked: tuple[str, ...]
    refused: tuple[str, ...]
    work: tuple[str, str]
    table: tuple[str, str] | None


def proposal_summary(proposal: Proposal) -> dict[str, Json]:
    """Return a proposal as `--json` prints it."""
    return as_json(_record(proposal))


def proposal_text(proposal: Proposal, *, verbose: bool = False) -> str:
    """Return the lines that a person reads of a proposal.

    Args:
        proposal: where the part should stand.
        verbose: whether to list all that was not checked.
    """
    record = _record(proposal)
    return "\n".join([*_lines(proposal, record), *_mind(proposal, record, verbose=verbose)])


def proposal_lines(pose: FixturePose) -> tuple[str, str]:
    """Return the lines under [work] in a cell file that put a demonstration there."""
    position, rpy = _numbers(pose)
    return f"demo_position_mm = [{_listed(position)}]", f"demo_rpy_deg = [{_listed(rpy)}]"


def table_lines(pose: FixturePose) -> tuple[str, str]:
    """Return the lines under [table] in a cell file that put the table there."""
    position, rpy = _numbers(pose)
    return f"position_mm = [{_listed(position)}]", f"rpy_deg = [{_listed(rpy)}]"


def _record(proposal: Proposal) -> ProposalRecord:
    robots, placement = proposal.plan.robot, proposal.placement
    position, rpy = _numbers(proposal.pose)
    return ProposalRecord.of(
        placement,
        part=proposal.plan.workpiece.name,
        cell=proposal.plan.workpiece.cell.name,
        position_mm=position,
        rpy_deg=rpy,
        T_base_work=placement.T_base_work.round(6),
        better=proposal.better,
        margin_deg=_degrees(proposal.after),
        limiting=proposal.after.limiting,
        before=_before(proposal),
        lowest_point_above_mm=round(proposal.above, 3) if np.isfinite(proposal.above) else None,
        smallest_clearance_mm=min(robot.clearance.smallest for robot in robots),
        not_checked=tuple(dict.fromkeys(text for robot in robots for text in robot.clearance.not_checked)),
        refused=proposal.refused,
        work=proposal_lines(proposal.pose),
        table=None if proposal.table is None else table_lines(proposal.table),
    )


def _before(proposal: Proposal) -> BeforeRecord:
    found = proposal.map_before
    return BeforeRecord.of(
        found,
        margin_deg=_degrees(proposal.before),
        limiting=proposal.before.limiting,
        reached=found.complete,
        lost_for={reason: rounded(share) for reason, share in found.shares().items()},
        worst_places_mm=found.places[[*found.worst(WORST_PLACES)]].round(3),
    )


def _lines(proposal: Proposal, record: ProposalRecord) -> Iterator[str]:
    tilted = proposal.pose.rpy[:2].any()
    turned = f"roll, pitch, yaw {_listed(record.rpy_deg)}" if tilted else f"yaw {_listed(record.rpy_deg[2:])}"
    tilting = "" if record.table is None else f" in {how_many(len(proposal.plan.robot), 'attitude')} of the table"
    before = _margin(record.before) + ("" if record.before.reached else ", refused")
    yield f"{record.part}: centroid at ({_listed(record.position_mm)}) mm, mean normal up, then {turned} degrees"
    yield f"margin: {_margin(record)}; where the cell file puts it: {before}"
    if record.lowest_point_above_mm is not None:
        yield f"fixture: the lowest point is {record.lowest_point_above_mm:.0f} mm above what is below it"
    yield (
        f"verified on all {how_many(proposal.plan.poses.count, 'pose')}{tilting}: joints, time and clearance "
        f"({record.smallest_clearance_mm:.2f} mm at the closest)"
    )
    for reason in record.refused:
        yield f"a better placement failed: {reason}"
    yield f"to plan it there with `--place demo`, put under [work] in {record.cell}:"
    for line in record.work:
        yield f"    {line}"
    if record.table is not None:
        yield "and under [table], which goes with the part:"
        for line in record.table:
            yield f"    {line}"


def _mind(proposal: Proposal, record: ProposalRecord, *, verbose: bool) -> list[str]:
    """Return what to mind, the weightiest first."""
    return marked_lines(
        warnings=[_uncalibrated(touched=proposal.plan.workpiece.cell.fixture is not None)],
        notes=[] if record.better else ["the placement in the cell file is the best one: leave it as it is."],
        not_checked=record.not_checked,
        verbose=verbose,
    )


def _uncalibrated(*, touched: bool) -> str:
    if touched:
        return (
            "NOT CALIBRATED: the cell's touched points are for the old placement. Move the fixture there, touch the "
            "points again and list them."
        )
    return "NOT CALIBRATED: the placement is not measured, so programs only run dry."


def _margin(found: ProposalRecord | BeforeRecord) -> str:
    return "out of reach" if found.margin_deg is None else f"{found.margin_deg:.1f} degrees ({found.limiting})"


def _degrees(margin: Margin) -> float | None:
    return rounded(np.degrees(margin.angle)) if np.isfinite(margin.angle) else None


def _numbers(pose: FixturePose) -> tuple[Numbers, Numbers]:
    """Return position [mm] and roll, pitch, yaw [degrees] as they were verified."""
    position, rpy = pose.position.round(PLACEMENT_DECIMALS), np.degrees(pose.rpy).round(PLACEMENT_DECIMALS)
    return tuple(position.tolist()), tuple(rpy.tolist())


def _listed(values: Iterable[float]) -> str:
    return ", ".join(f"{value + 0.0:g}" for value in values)


# A refusal in words and numbers: what the search at the worst poses found, and which change was tried.


# What refuses a pose, in words.
CAUSES = {
    "nozzle": "the nozzle has no room",
    "reach": "the arm is at a limit",
    "bracket": "the bracket or lamp has no room",
    "arm": "the arm's links have no room in any sampled attitude",
}


def refusal_sentence(refusal: Refusal) -> str:
    """Return what follows the finding: the proof, and a change that was tried where any could be."""
    if not refusal.screened:
        return f"{_proof(refusal.exhausted)}."
    return f"{_proof(refusal.exhausted)}. {_help(refusal)}"


def refusal_details(refusal: Refusal) -> dict[str, Detail]:
    """Return the numbers of a refusal for programs."""
    exhausted, change = refusal.exhausted, refusal.help
    return {
        "cone_deg": round(float(np.degrees(exhausted.grid.cone)), 6),
        "lean_step_deg": round(float(np.degrees(exhausted.grid.lean_step)), 6),
        "turn_step_deg": round(float(np.degrees(exhausted.grid.turn_step)), 6),
        "poses_searched": len(exhausted.poses),
        "poses_blocked": len(exhausted.blocked),
        "attitudes_tried": exhausted.tried,
        "changes_asked": refusal.screened,
        "changes_freeing": refusal.freeing,
        "changes_tried": "; ".join(_outcome(tried) for tried in refusal.tried),
        "change": None if change is None else change.name,
        "change_keys": None if change is None else change.keys,
    }


def shortfall(error: PlanError) -> str:
    """Return by how much a change that was tried misses."""
    details = error.details
    distance, wanted, room = details.get("distance"), details.get("wanted"), details.get("room")
    if isinstance(distance, float) and isinstance(wanted, float):
        return f"{details.get('solid')} {max(wanted - distance, 0.0):.2f} mm short"
    if isinstance(room, float):
        return f"the needle's rim has {room:z.2f} mm of room"
    lost = details.get("lost")
    return f"the arm loses {percent(lost, 2)} of the deposit" if isinstance(lost, float) else str(error)


def _proof(exhausted: Exhausted) -> str:
    count, grid = len(exhausted.poses), exhausted.grid
    steps = f"{np.degrees(grid.lean_step):g} and {np.degrees(grid.turn_step):g} degrees apart"
    blocked = exhausted.blocked
    cone = f"within {np.degrees(grid.cone):.3g} degrees of the normal"
    if blocked:
        first = blocked[0]
        also = f", nor {len(blocked) - 1} more of the {how_many(count, 'worst pose')}" if len(blocked) > 1 else ""
        return (
            f"no nozzle direction {cone}, turn or branch ({exhausted.tried} tried, {steps}) reaches "
            f"{_where(first)}{also}: {CAUSES[first.cause]}"
        )
    if not exhausted.served_by:
        return (
            f"each of the worst poses ({count}) is free by itself, but no single branch reaches all "
            f"({exhausted.tried} tried)"
        )
    return (
        f"each of the worst poses ({count}) is free by itself ({exhausted.tried} attitudes tried, {steps}), but no "
        "continuous motion joins them"
    )


def _help(refusal: Refusal) -> str:
    change = refusal.help
    if change is not None:
        keys = f": {change.keys}" if change.keys else ""
        name = change.name[0].upper() + change.name[1:]
        return f"{name} prints it (tried: the whole program is checked){keys}."
    tried = "; ".join(_outcome(each) for each in refusal.tried)
    named = f", tried through: {tried}" if tried else ""
    asked = f"Of {refusal.screened} changes of needle, lean, cell and place"
    if refusal.exhausted.narrow:
        return f"{asked} {refusal.freeing} free the worst poses{named}."
    return f"{asked} none makes it printable{named}."


def _outcome(tried: TriedChange) -> str:
    return f"{tried.name} ({tried.missing or 'prints'})"


def _where(pose: JudgedPose) -> str:
    return f"run {pose.run + 1} at tip {in_words(np.array(pose.place))}"
