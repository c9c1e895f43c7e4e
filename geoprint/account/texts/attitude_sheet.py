"""The run sheet of a program over a tilting table: its attitudes in order, what to bring the table to, what to set."""

from __future__ import annotations

from collections.abc import Sequence

from geoprint.account.checked import Checked, CheckedJoined
from geoprint.account.evidence import seen_rows
from geoprint.account.records.overhang import TableRecord
from geoprint.account.records.plan import PlanRecord
from geoprint.account.records.robot import JoinedRecord, RobotRecord
from geoprint.export.rapid import StackSettings


def attitude_rows(checked: Checked, told: PlanRecord) -> list[tuple[str, list[str]]]:
    """Return label and texts of the page of a bundle with several attitudes; none where it has no program of all.

    Args:
        checked: the bundle, with nothing found wrong.
        told: its plan.json.
    """
    joined, now = told.joined, checked.joined
    table = None if told.overhang is None else told.overhang.table
    if joined is None or now is None or table is None:
        return []
    dry_only = any(robot.program.dry_run_only for robot in told.robot)
    seen = [f"{stage}: {what}" for stage, what in seen_rows(checked.seen, program_sha256=now.program_sha256)]
    unchecked = dict.fromkeys(text for robot in told.robot for text in robot.clearance.not_checked)
    return [
        ("program", _program(joined, told.robot, dry_only=dry_only)),
        ("attitudes", [_attitude(robot, table) for robot in told.robot]),
        ("table", table_lines(table.name)),
        ("is set to", [] if now.settings is None else [_settings(now.settings, dry_only=dry_only)]),
        ("to print", _printing(dry_only=dry_only)),
        ("to stop", [_stopping(len(told.robot))]),
        ("to resume", [] if dry_only else [_resuming()]),
        ("not checked", ["; ".join(unchecked) + "; the real cell."]),
        ("executed", [_executed(joined, now)]),
        ("evidence", seen),
    ]


def _program(joined: JoinedRecord, robots: Sequence[RobotRecord], *, dry_only: bool) -> list[str]:
    count = len(robots)
    dry = "; RUNS DRY ONLY" if dry_only else ""
    return [
        f"{count} attitudes, {joined.print_s:.0f} s at full speed, the table's {joined.table_s:.0f} s among them{dry}",
        f"copy the folders part-1 to part-{count} of rapid/ to the controller's HOME folder, then load {joined.file}",
    ]


def _attitude(robot: RobotRecord, table: TableRecord) -> str:
    """Return the line of one attitude: what the table is brought to, and what the arm does in it."""
    pose = robot.table
    assert pose is not None  # noqa: S101  # Every part of a plan with several has its attitude.
    axes = ", ".join(f"{value:.2f}" for value in pose.axes)
    held = f"tilt and turn {axes} degrees" if table.rotary else f"legs {axes} mm"
    return (
        f"{pose.attitude}  {held}; {robot.motion.duration_s:.0f} s, {robot.program.targets} targets; closest approach "
        f"{robot.clearance.smallest_mm:.2f} mm; on its course here the table keeps {pose.kept_mm:.1f} mm from the arm"
    )


def table_lines(name: str) -> list[str]:
    """Return what a person must know who brings a table to its attitudes.

    Args:
        name: of the table.
    """
    return [
        f"the {name} moves only while the arm waits at home and you are asked: look, bring it or let it, answer",
        "nothing but you notices a wrong attitude, or a driven table's wrong zero: the tool would run into the part",
    ]


def _settings(settings: StackSettings, *, dry_only: bool) -> str:
    attitudes = f"attitudes {settings.first_layer} to {settings.last_layer}"
    if settings.dry_run or dry_only:
        dry = str(settings.dry_run).upper()
        return f"run {attitudes} dry at {settings.speed_pct:g} % of the speed (geoDryRun {dry})"
    return (
        f"PRINT {attitudes} at {settings.speed_pct:g} % of the speed, from run {settings.first_run} of the first on "
        "(geoDryRun FALSE)"
    )


def _printing(*, dry_only: bool) -> list[str]:
    first = "run it as written first: dry, 20 mm higher, at 25 %, with the table in each attitude (geoDryRun TRUE)"
    full = "then geoDryRun FALSE, and at a fixed pressure geoSpeedPct 100 and the speed override 100 %"
    return [first] if dry_only else [first, full]


def _stopping(count: int) -> str:
    return (
        f"geoLastAttitude, 1 to {count}, ends it behind that attitude, at home, with everything shut off; it may be "
        "lowered while an attitude is printed"
    )


def _resuming() -> str:
    return (
        "geoFirstAttitude stands at the attitude that was begun and not finished: clean the nozzle, set geoFirstRun to "
        "the run that the pendant names, start from main"
    )


def _executed(joined: JoinedRecord, now: CheckedJoined) -> str:
    return (
        f"{', '.join(now.scenarios)}; each attitude moved and switched as by itself, and the table was asked for "
        f"before each; refused before anything moved: {', '.join(joined.refused)}"
    )
