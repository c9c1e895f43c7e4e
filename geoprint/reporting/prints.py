"""What is said of attitudes, deposited volume and feedback before a print is made."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from geoprint.errors import how_many, percent
from geoprint.metrics.executed_flow import deposited_shares, deposited_volume, executed_flow
from geoprint.model import Cell
from geoprint.postprocessor.registry import joined_file
from geoprint.process.feedback import VALVE_CAUSES, FlowChange, PrintedProgram
from geoprint.reporting.records.inspection import (
    AppraisalRecord,
    FeedbackRecord,
    PrintedPartRecord,
    PrintedRecord,
    PrintedRunRecord,
    ScanAppraisalRecord,
)
from geoprint.reporting.records.plan import DepositedRecord, JoinedRecord, PlanRecord, TablePoseRecord
from geoprint.reporting.records.rounding import place_of
from geoprint.results import Plan, RobotPlan

# What is said of the attitudes of a table that the robot prints in, and of the one program of all of them.


def record_table_pose(plan: Plan, robot: RobotPlan) -> TablePoseRecord | None:
    """Return how a table holds the part while one of the robot's parts is printed; None where the part stands still."""
    pose = robot.placement.table
    if pose is None or plan.tilting is None or robot.table_kept is None:
        return None
    axes = np.degrees(pose.axes) if plan.tilting.rotary else pose.axes
    return TablePoseRecord(attitude=pose.number, axes=tuple(axes.tolist()), kept_mm=robot.table_kept)


def record_joined(plan: Plan) -> JoinedRecord | None:
    """Return what plan.json says of the program of all attitudes; None where there is one or none."""
    if plan.joined is None or plan.tilting is None:
        return None
    proof = plan.joined.proof
    return JoinedRecord(
        file=joined_file(plan.workpiece.cell),
        print_s=print_seconds(plan) or 0.0,
        table_s=sum(plan.tilting.seconds),
        scenarios=proof.scenarios,
        refused=proof.refused,
        lines_with_statements=proof.statements,
        lines_executed=proof.executed,
    )


def print_seconds(plan: Plan) -> float | None:
    """Return the time of the program from home to home, with the table's own motions; None without a program [s]."""
    if not plan.robot:
        return None
    moving = () if plan.tilting is None else plan.tilting.seconds
    return sum(robot.trajectory.duration for robot in plan.robot) + sum(moving)


# How much a program deposits as it was executed, over what its paths ask for.


# A layer that is slowed down by less than this is not spoken of.
NOTABLE_SLOWING = 5e-4


def record_deposited(robot: RobotPlan, cell: Cell) -> DepositedRecord | None:
    """Return the volume that a part of the program deposits, as executed, over that of its paths; None without any."""
    poses = robot.joint_path.poses
    wanted = deposited_volume(poses, poses.flow)
    if wanted == 0.0:
        return None
    flow = executed_flow(poses, robot.trajectory.pose_times, robot.switching.material, cell=cell)
    _, shares = deposited_shares(poses, flow, layer_height=cell.process.layer_height)
    return DepositedRecord(
        share=deposited_volume(poses, flow) / wanted, least_run=float(shares.min()), most_run=float(shares.max())
    )


def made_up_notes(plan: Plan, record: PlanRecord) -> Iterator[str]:
    """Say by how much a layer of a stack is slowed down, so that it has its whole volume."""
    place, poses = plan.workpiece.place, plan.poses
    if place is None or plan.workpiece.cell.signals.mode == "analog":
        return
    share = float(poses.flow.max()) / (record.settings.spacing_mm * place.height)
    if share >= 1.0 + NOTABLE_SLOWING:
        yield (
            f"the paths of this layer miss {percent(1.0 - 1.0 / share, 2)} of its volume at the medial axis: it prints "
            "slower by as much to compensate."
        )


# What is said of feedback: which program was printed, what the next one changes, and what is expected of it.


# The name of what appraisals write.
RECORD = "appraisal.json"


def record_printed(printed: PrintedProgram) -> PrintedRecord:
    """Return what an appraisal says of the program that was printed."""
    rows = zip(printed.runs.tolist(), printed.lengths.tolist(), printed.middles, strict=True)
    parts = zip(printed.owners.tolist(), printed.factors.tolist(), printed.deposited.tolist(), strict=True)
    return PrintedRecord.of(
        printed,
        part_sha256=printed.digest,
        dispenser=dict(printed.dispenser),
        runs=tuple(PrintedRunRecord(run=run, length_mm=length, middle_mm=place_of(at)) for run, length, at in rows),
        parts=tuple(PrintedPartRecord(run=run, factor=factor, deposited=share) for run, factor, share in parts),
    )


def next_print(record: AppraisalRecord | ScanAppraisalRecord, *, plan: str, folder: str | None) -> str:
    """Return the line on the command that makes the next print better by an appraisal.

    Args:
        record: what the appraisal says.
        plan: folder of the bundle that was printed.
        folder: that holds appraisal.json; None where nothing was written.
    """
    if folder is None:
        return f"next: the same with `--out appraised`, then geoprint plan --from {plan} --feedback appraised/{RECORD}"
    written = Path(folder, RECORD).as_posix()
    if isinstance(record, ScanAppraisalRecord):
        shift = record.shift
    else:
        on_plan = record.photographs[0].on_plan
        shift = None if on_plan is None else on_plan.shift
    if shift is None:
        return f"next: geoprint plan --from {plan} --feedback {written} --out next"
    return (
        "next: touch the part again, then `geoprint calibrate touched.csv --model corners.csv --cell cell.toml --out "
        f"touched.toml`, then `geoprint plan --from {plan} --cell touched.toml --feedback {written} --out next`"
    )


def next_appraisal(plan: str) -> str:
    """Return the line on what to do with a plan that feedback has corrected, which stands in a folder."""
    return f"next: print {plan}, then geoprint appraise SCAN-OR-PHOTO --plan {plan} --out appraised"


def record_feedback(plan: Plan) -> FeedbackRecord | None:
    """Return what plan.json says of feedback, or None where the job names none."""
    fed = plan.fed
    if fed is None:
        return None
    flow = plan.poses.flow[plan.poses.deposit]
    there = fed.wanted > 0.0
    factors, found = flow[there] / fed.wanted[there], fed.correction
    return FeedbackRecord.of(
        fed,
        sha256=fed.digest,
        changes=fed.correction.changes,
        least_factor=float(factors.min()),
        most_factor=float(factors.max()),
        valve_opens_earlier_mm=found.opening,
        valve_shuts_earlier_mm=found.shutting,
        gaps=found.gaps,
        error_found=found.found,
        error_expected=found.expected,
    )


def feedback_notes(record: FeedbackRecord | None) -> Iterator[str]:
    """Say what feedback changed and expects, or that nothing was significant."""
    if record is None:
        return
    found = (
        f"feedback: {record.seen_in} shows the volume of {record.plan} {percent(record.error_found, 1)} (RMS) off what "
        "its program deposits"
    )
    if not record.changes:
        yield f"{found}, none of it significant: flow and valve stay unchanged."
    else:
        causes = ", ".join(_in_words(each) for each in record.changes)
        valve = ", ".join(
            f"{'opens' if earlier else 'shuts'} {abs(by):.2f} mm {'earlier' if by > 0.0 else 'later'}"
            for earlier, by in ((True, record.valve_opens_earlier_mm), (False, record.valve_shuts_earlier_mm))
            if by != 0.0
        )
        slower = "" if record.speed_mm_s is None else f", by printing at {record.speed_mm_s:.3g} mm/s"
        yield (
            f"{found}: {causes}. Flow is commanded at {record.least_factor:.2f} to {record.most_factor:.2f} of its "
            f"target{slower}{f', the valve {valve}' if valve else ''}. Expected to remain: "
            f"{percent(record.error_expected, 1)} (feedback.csv lists the flow)."
        )
    if record.held > 0.0:
        yield (
            f"feedback: the cell's bounds limit the flow at {percent(record.held, 1)} of the poses, which need more "
            "correction."
        )
    if record.gaps:
        yield (
            f"feedback: {how_many(record.gaps, 'part')} of runs had hardly any material: flow cannot correct that, so "
            "look for what stopped it."
        )
    yield "feedback: print this plan and appraise that print too: geoprint appraise SCAN-OR-PHOTO --plan FOLDER."


def _in_words(record: FlowChange) -> str:
    if record.name in VALVE_CAUSES:
        return f"{record.name} {abs(record.most):.2f} mm too {'late' if record.most > 0.0 else 'early'}"
    if record.least == record.most:
        return f"{record.least:.2f} of it everywhere"
    article = "" if record.name == "along runs" else "a "
    return f"{article}{record.name} of {record.least:.2f} to {record.most:.2f}".strip()
