"""The run sheet: what to read at the robot before pressing start, attitudes of a table included.

A bundle without a program has a page instead, one of several bundles a line.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import how_many, percent
from geoprint.geometry import in_words
from geoprint.model import PASCAL_PER_KPA, FloatArray, Process
from geoprint.postprocessor import Json, Orders, Setup, StackSettings, Timeline, waits
from geoprint.postprocessor.registry import joining_of, post_processor_name, post_processor_of
from geoprint.reporting.cautions import demonstration_notes, near_borders
from geoprint.reporting.check import (
    AttitudeSettingsNow,
    Checked,
    CheckedComparison,
    CheckedComparisonRecord,
    CheckedStack,
    CheckRecord,
    Finding,
)
from geoprint.reporting.evidence import evidence_rows, seen_rows
from geoprint.reporting.metrics import COVERED_ONCE, THICKNESS
from geoprint.reporting.records.evenness import TableRecord
from geoprint.reporting.records.evidence import EvidenceRecord, SeenRecord
from geoprint.reporting.records.plan import (
    ClearanceRecord,
    DepositionRecord,
    JoinedRecord,
    MotionRecord,
    PatchRecord,
    PlanRecord,
    RobotRecord,
)
from geoprint.reporting.records.rounding import as_json
from geoprint.reporting.robot_summary import record_switching

# The run sheet of a program over a tilting table: its attitudes in order, what to bring the table to, what to set.


def attitude_rows(checked: Checked, record: PlanRecord) -> list[tuple[str, list[str]]]:
    """Return label and texts of the page of a bundle with several attitudes; none where it has no program of all.

    Args:
        checked: the bundle, with nothing found wrong.
        record: its plan.json.
    """
    joined, now = record.joined, checked.joined
    table = None if record.overhang is None else record.overhang.table
    if joined is None or now is None or table is None:
        return []
    if checked.setup is None:
        return []
    joining, program = joining_of(checked.setup.cell), post_processor_name(checked.setup.cell)
    folders = f"{program}/part-1 to {program}/part-{len(record.robot)}"
    dry_only, count = any(robot.program.dry_run_only for robot in record.robot), len(record.robot)
    unchecked = dict.fromkeys(text for robot in record.robot for text in robot.clearance.not_checked)
    return [
        ("program", [_joined_program(joined, record.robot, dry_only=dry_only), joining.loading(folders, joined.file)]),
        ("attitudes", [_attitude(robot, table) for robot in record.robot]),
        *joining.handling("attitude", count, now.settings, dry_only=dry_only, table=table.name),
        ("not checked", ["; ".join(unchecked) + "; the real cell."]),
        *proof_rows("attitude", now.scenarios, joined.refused, checked.seen, program_sha256=now.program_sha256),
    ]


def proof_rows(
    one: str, scenarios: Sequence[str], refused: Sequence[str], seen: Sequence[SeenRecord], *, program_sha256: str
) -> list[tuple[str, list[str]]]:
    """Return how a program of several parts was executed, and what people saw it do."""
    asked = ", after asking for the table" if one == "attitude" else ""
    executed = (
        f"{', '.join(scenarios)}; each {one} moved and switched as in its own program{asked}; refused before any "
        f"motion: {', '.join(refused)}"
    )
    people = [f"{stage}: {what}" for stage, what in seen_rows(seen, program_sha256=program_sha256)]
    return [("SHA-256", [program_sha256]), ("executed", [executed]), ("evidence", people)]


def _joined_program(joined: JoinedRecord, robots: Sequence[RobotRecord], *, dry_only: bool) -> str:
    dry = "; RUNS DRY ONLY" if dry_only else ""
    return (
        f"{how_many(len(robots), 'attitude')}, {joined.print_s:.0f} s at full speed including {joined.table_s:.0f} s "
        f"of the table{dry}"
    )


def _attitude(robot: RobotRecord, table: TableRecord) -> str:
    """Return the line of one attitude: what the table is brought to, and what the arm does in it."""
    pose = robot.table
    assert pose is not None  # noqa: S101  # Every part of a plan with several has its attitude.
    axes = ", ".join(f"{value:.2f}" for value in pose.axes)
    held = f"tilt and turn {axes} degrees" if table.rotary else f"legs {axes} mm"
    return (
        f"{pose.attitude}  {held}; {robot.motion.duration_s:.0f} s, {how_many(robot.program.targets, 'target')}; "
        f"closest approach {robot.clearance.smallest_mm:.2f} mm; on the way here the table keeps {pose.kept_mm:.1f} "
        "mm from the arm"
    )


# What whoever stands at the robot should read before pressing start: one page about a bundle that was checked.


WIDTH, NARROW = 100, 60
_LABEL = 18
# Bends that are listed where targets stand beside the path, the farthest first.
LISTED_BENDS = 3


def check_text(checked: Checked | CheckedComparison, *, width: int | None = None) -> str:
    """Return the page; of a bundle in which something was found only that.

    Args:
        checked: a bundle, or a comparison with its bundles.
        width: letters in a line, where they are counted.
    """
    if isinstance(checked, CheckedComparison):
        return _comparison(checked, width=width)
    if checked.findings or checked.program:
        return run_sheet(checked, width=width)
    return _paths(checked, width=width)


def check_summary(checked: Checked | CheckedComparison) -> dict[str, Json]:
    """Return the result object of `geoprint check`: lengths mm, angles degrees, times s."""
    if isinstance(checked, Checked):
        return as_json(_record(checked, checked.folder.name))
    return as_json(_comparison_record(checked, checked.folder.name))


def _comparison_record(checked: CheckedComparison, name: str) -> CheckedComparisonRecord:
    stack = checked.stack
    program = None if stack is None else stack.program
    settings = None if program is None else program.settings
    tilted = stack is not None and stack.one == "attitude"
    return CheckedComparisonRecord(
        comparison=name,
        agrees=not checked.findings,
        findings=checked.own,
        bundles=tuple(_record(one, inner) for inner, one in checked.bundles),
        set_to=None if tilted else settings,
        attitudes_set_to=_attitudes_now(settings) if settings is not None and tilted else None,
        executed=() if program is None else program.scenarios,
        program_sha256=None if program is None else program.program_sha256 or None,
        seen=() if stack is None else stack.seen,
        stacks=tuple(_comparison_record(one, inner) for inner, one in checked.stacks),
    )


def _record(checked: Checked, name: str) -> CheckRecord:
    setup, orders, settings, switching = checked.setup, checked.orders, checked.settings, checked.switching
    extent = None if setup is None or orders is None else _extent(setup, orders)
    robot = checked.record.robot if checked.record is not None and len(checked.record.robot) == 1 else ()
    joined = checked.joined
    return CheckRecord(
        bundle=name,
        agrees=not checked.findings,
        program=checked.program,
        findings=checked.findings,
        set_to=settings,
        switching=None if switching is None else record_switching(switching),
        extent_base_mm=None if extent is None else tuple(tuple(corner.round(3).tolist()) for corner in extent),
        repeated=checked.repeated,
        evidence=_executed_now(checked, robot[0].evidence) if robot else None,
        attitudes=tuple(_record(one, one.folder.name) for one in checked.attitudes),
        attitudes_set_to=None if joined is None or joined.settings is None else _attitudes_now(joined.settings),
        executed=() if joined is None else joined.scenarios,
        seen=checked.seen,
        not_derived=checked.not_derived,
    )


def _attitudes_now(found: StackSettings) -> AttitudeSettingsNow:
    return AttitudeSettingsNow(
        dry_run=found.dry_run,
        speed_pct=found.speed_pct,
        first_attitude=found.first_layer,
        first_run=found.first_run,
        last_attitude=found.last_layer,
    )


def run_sheet(checked: Checked, *, width: int | None = None) -> str:
    """Return the page; where something was found, only that.

    Args:
        checked: a bundle.
        width: letters in a line, where they are counted; the page is never wider than 100.
    """
    setup, orders, settings, switching = checked.setup, checked.orders, checked.settings, checked.switching
    record = checked.record
    if checked.attitudes and record is not None and not checked.findings:
        head = [f"RUN SHEET  {record.input.name}, attitude by attitude  ({checked.folder.name})", ""]
        rows = [
            *attitude_rows(checked, record),
            ("checked again", repeated_texts(checked)),
            ("not derived", underived_texts(checked)),
        ]
        return "\n".join(
            [*head, *(line for label, texts in rows if texts for line in entry(label, texts, width=width))]
        )
    if checked.findings or record is None or not (setup and orders and switching):
        return "\n".join(f"{each.file}, line {each.line}: {each.reason}" for each in checked.findings)
    robot = record.robot[0]
    handling = post_processor_of(setup.cell).handling(
        orders, setup.cell, placement=setup.placement, names=robot.program.modules, settings=settings
    )
    lines = [f"RUN SHEET  {record.input.name}  ({checked.folder.name})", ""]
    for label, texts in (
        ("program", [_program(setup, orders), *handling.loading]),
        ("SHA-256", [checked.program_sha256]),
        ("is set to", [*handling.settings]),
        ("patches", _patches(record.patches)),
        ("placement", [*_placement(setup), *demonstration_notes(robot.motion)]),
        ("extent", _reach(setup, orders, robot.motion)),
        ("closest approach", _closest(robot.clearance)),
        ("signals", _signals(setup, switching)),
        ("process", _process(setup, record)),
        ("limits", _limits(setup, robot.motion)),
        ("targets", _targets(robot.motion)),
        ("before start", [*handling.steps]),
        ("not checked", ["; ".join(robot.clearance.not_checked) + "; the real cell."]),
        ("checked again", repeated_texts(checked)),
        ("not derived", underived_texts(checked)),
        ("evidence", _evidence(checked, robot.evidence)),
    ):
        lines += entry(label, texts, width=width) if texts else []
    return "\n".join(lines)


def repeated_texts(checked: Checked) -> list[str]:
    """Return what `--full` found as it was planned, or nothing without it."""
    again = checked.repeated
    if again is None:
        return []
    clear = [] if again.smallest_mm is None else [f"{again.smallest_mm:.2f} mm clear"]
    clear += [] if again.dry_run_smallest_mm is None else [f"{again.dry_run_smallest_mm:.2f} mm in the dry run"]
    even = again.uniformity
    clear += [] if even is None else [f"{COVERED_ONCE.text(even)} of the area covered once"]
    return [f"{', '.join(clear)}: as in plan.json ({again.seconds:.1f} s, {again.peak_memory_mb} MB)"]


def underived_texts(checked: Checked) -> list[str]:
    """Return which files of a bundle nothing was held against, or nothing where something is wrong already."""
    return ["; ".join(checked.not_derived)] if checked.not_derived else []


def _evidence(checked: Checked, record: EvidenceRecord) -> list[str]:
    rows = evidence_rows(_executed_now(checked, record), checked.seen, program_sha256=checked.program_sha256)
    return [f"{stage}: {what}" for stage, what in rows]


def _executed_now(checked: Checked, record: EvidenceRecord) -> EvidenceRecord:
    """Return what plan.json says, but executed in this check; not at all where it goes to other targets."""
    found = checked.executed
    same = found is not None and np.isfinite([found.motion, found.outputs]).all()
    return EvidenceRecord.of(record, executed=found if same else None)


def entry(label: str, texts: Sequence[str], *, width: int | None) -> list[str]:
    """Return a label with its texts beside it, or below it where a line is short; a hash stays in one line.

    Args:
        label: of a few letters.
        texts: that are broken into lines.
        width: letters in a line, where they are counted; it is never longer than 100.
    """
    width = min(width or WIDTH, WIDTH)
    if width < NARROW:
        return [
            label,
            *(
                line
                for text in texts
                for line in textwrap.wrap(
                    text, width, initial_indent="  ", subsequent_indent="    ", break_long_words=False
                )
            ),
        ]
    wrapped = [line for text in texts for line in textwrap.wrap(text, width - _LABEL, break_long_words=False)]
    labels = [label, *[""] * len(wrapped)]
    # A line that is longer begins to the left, a space behind the label at least.
    return [
        f"{name:<{max(min(_LABEL, width - len(line)), len(name) + 1)}}{line}"
        for name, line in zip(labels, wrapped, strict=False)
    ]


def _program(setup: Setup, orders: Orders) -> str:
    dry = "; RUNS DRY ONLY" if setup.placement.missing else ""
    return (
        f"{how_many(int(orders.runs[-1]) + 1, 'run')}, {how_many(orders.count, 'target')} at least "
        f"{orders.shortest_move:.2g} mm apart, {orders.duration + waits(orders, setup.cell.signals).sum():.0f} s "
        f"at full speed{dry}"
    )


def _patches(patches: Sequence[PatchRecord]) -> list[str]:
    """Name each of several patches by its runs, numbered as the controller does, so that printing can begin at one."""
    if len(patches) < 2:
        return []
    return [
        f"{number}: runs {patch.runs[0] + 1} to {patch.runs[1] + 1}, {patch.area_mm2:.4g} mm2 about "
        f"{in_words(np.array(patch.place_mm, dtype=np.float64))}, spacing CV "
        + ("none (one level)" if patch.spacing.cv is None else percent(patch.spacing.cv, 2))
        for number, patch in enumerate(patches, start=1)
    ]


def _placement(setup: Setup) -> list[str]:
    placement = setup.placement
    texts = (
        [f"UNKNOWN: {' and '.join(placement.missing)} {'is' if len(placement.missing) == 1 else 'are'} not stated"]
        if placement.missing
        else []
    )
    if placement.calibrated:
        texts.append(
            f"fixture calibrated, largest residual of the touched points {placement.misses.max(initial=0.0):.2f} mm"
        )
    if placement.part_stated:
        texts.append(f"part on the fixture, as stated: {_frame(placement.T_fixture_work)}")
    if setup.surface_within is not None:
        texts.append(f"surface known within {setup.surface_within:.2f} mm along its normal (95 %)")
    return [*texts, f"part in base coordinates: {_frame(placement.T_base_work)}"]


def _frame(T: FloatArray) -> str:
    x, y, z = T[:3, 3]
    roll, pitch, yaw = Rotation.from_matrix(T[:3, :3]).as_euler("xyz", degrees=True)
    return f"origin at ({x:z.2f}, {y:z.2f}, {z:z.2f}) mm, turned ({roll:z.2f}, {pitch:z.2f}, {yaw:z.2f}) degrees"


def _extent(setup: Setup, orders: Orders) -> tuple[np.ndarray, np.ndarray]:
    tips = transforms.apply(setup.placement.T_base_work, orders.tips)
    return tips.min(axis=0), tips.max(axis=0)


def _reach(setup: Setup, orders: Orders, motion: MotionRecord) -> list[str]:
    low, high = _extent(setup, orders)
    spans = ", ".join(f"{axis} {a:.1f} to {b:.1f}" for axis, a, b in zip("xyz", low, high, strict=True))
    tip = f"tip in base coordinates: {spans} mm; smallest wrist angle {motion.smallest_wrist_angle_deg:.1f} degrees"
    return [tip, *near_borders(motion)]


def _closest(clearance: ClearanceRecord) -> list[str]:
    dry = clearance.dry_run
    texts = [f"{clearance.smallest_mm:.2f} mm, {clearance.at}; at least {clearance.kept_mm} mm everywhere"]
    if clearance.arm_smallest_mm is not None:
        texts.append(f"arm: {clearance.arm_smallest_mm:.1f} mm, {clearance.arm_at}")
    return [*texts, f"dry run, {dry.lift_mm:g} mm higher: {dry.smallest_mm:.2f} mm, {dry.at}"]


def _signals(setup: Setup, switching: Timeline) -> list[str]:
    signals = setup.cell.signals
    flow = "" if signals.flow is None else f", flow {signals.flow} ({signals.flow_per_mm3_s:g} for 1 mm3/s)"
    vacuum = "" if signals.vacuum is None else f", vacuum {signals.vacuum} while the valve is shut"
    settling = f"the arm waits {signals.settle:g} s at each start for steady flow; " if signals.settle else ""
    return [
        f"mode {signals.mode}: valve {signals.dispenser}, lamp {signals.uv_lamp}{flow}{vacuum}; safe values 0",
        (
            f"lags: valve opens {signals.valve_open:g} s and closes {signals.valve_close:g} s late; lamp leads "
            f"{signals.uv_lead:g} s and trails {signals.uv_tail:g} s; {settling}material "
            f"{switching.errors.max(initial=0.0):.3f} mm from each run's ends"
        ),
    ]


def _process(setup: Setup, record: PlanRecord) -> list[str]:
    """Say what a person sets beside the robot, and what the lamp gives."""
    process, flood = setup.cell.process, setup.cell.flood
    (layer,) = record.layers
    below = " over the layer below" if layer.bottom_mm else ""
    flow = record.deposition
    light = None if flow is None else flow.light
    texts = [] if flow is None else [f"air pressure: {_pressure(process, flow, record.robot)}"]
    texts.append(f"layer {process.layer_height:g} mm, stand-off {layer.standoff_mm:g} mm{below}")
    if setup.cell.purge is not None:
        texts.append(f"priming: {setup.cell.purge.duration:g} s at [purge], by the program before the first run")
    if light is not None:
        texts.append(f"light: {light.one_pass:.3g} mJ/cm2 in one pass, {light.all_passes:.3g} mJ/cm2 in all passes")
    if flood is not None:
        who = "by hand" if flood.joints is None else "by the program, after the last run"
        texts.append(f"final exposure of the whole part: {flood.duration:g} s, {who}")
    return texts


def _pressure(process: Process, flow: DepositionRecord, robots: Sequence[RobotRecord]) -> str:
    """Say which pressure is set: the one that lets the flow of the print through."""
    wanted = f"set it for {flow.valve_mm3_s:.4g} mm3/s at {process.speed:g} mm/s"
    if flow.valve_kpa is not None:
        wanted += f", by [material] {flow.valve_kpa:.3g} kPa"
    if process.pressure is None:
        return wanted
    ceiling = robots[0].motion.speed_ceiling_mm_s
    return f"{wanted}; the cell states {process.pressure / PASCAL_PER_KPA:g} kPa for {ceiling:g} mm/s"


def _limits(setup: Setup, motion: MotionRecord) -> list[str]:
    process = setup.cell.process
    printing = f"prints at {process.speed:g} mm/s (slowest {motion.slowest_deposit_mm_s:.1f})"
    joints = f"joint moves from and to home at {percent(process.joint_speed_share)} speed"
    return [f"{printing}, travels at {process.travel_speed:g} mm/s; {joints}"]


def _targets(motion: MotionRecord) -> list[str]:
    """Say how hard the targets are for the controller: close ones, the jerk, bends where they leave the path."""
    targets = motion.targets
    beside = sorted((bend for bend in targets.bends if bend.offset_mm > 0.0), key=lambda bend: -bend.offset_mm)
    texts = [
        (
            f"shortest move {targets.shortest_ms:.1f} ms ({targets.closer} below {targets.period_ms:g} ms, where a "
            f"controller may slow down); largest jerk of the tip on deposit {motion.largest_jerk_m_s3:.0f} m/s3"
        )
    ]
    if beside:
        texts.append(f"off the path in {how_many(len(beside), 'tight bend')}, the farthest (plan.json lists all):")
    for bend in beside[:LISTED_BENDS]:
        place = ", ".join(f"{mm:.1f}" for mm in bend.place_mm)
        texts.append(
            f"  {bend.offset_mm:.3f} mm in run {bend.run + 1} at ({place}) mm, {how_many(bend.targets, 'target')}"
        )
    return texts


def _paths(checked: Checked, *, width: int | None) -> str:
    """Return the page of a bundle that has paths alone."""
    record = checked.record
    if record is None:
        return ""
    why = (
        "the robot was left out"
        if record.not_printable is None
        else f"the robot cannot print it: {record.not_printable}"
    )
    paths, even = record.paths, record.uniformity
    spread = "" if even is None else f", thickness CV {THICKNESS.text(even)}"
    spacing = f"{record.settings.spacing_mm:.3g}"
    lines = [f"PATHS ONLY  {record.input.name}  ({checked.folder.name})", ""]
    for label, texts in (
        ("program", [f"NONE: {why}"]),
        ("paths", [f"{how_many(paths.runs, 'run')}, {paths.deposit_mm:.0f} mm at {spacing} mm{spread}"]),
        ("checked", ["files unchanged, paths on their surface, number and length as in plan.json"]),
        ("checked again", repeated_texts(checked)),
        ("not derived", underived_texts(checked)),
    ):
        lines += entry(label, texts, width=width) if texts else []
    return "\n".join(lines)


def _comparison(checked: CheckedComparison, *, width: int | None) -> str:
    """Return a line for each bundle, the best of a part or the lowest layer first, and below it what is wrong.

    A stack in which nothing is wrong has its run sheet below.
    """
    if checked.stacks:
        head = f"COMPARISON  {checked.folder.name}: {how_many(len(checked.stacks), 'stack')}"
        pages = [page for _, stack in checked.stacks for page in ("", _comparison(stack, width=width))]
        return "\n".join([head, "", *(f"  {_line(one)}" for one in checked.own), *pages])
    longest = max((len(name) for name, _ in checked.bundles), default=0)
    count = len(checked.bundles)
    stack = checked.stack
    word, one, order = ("STACK", *stack.listed) if stack else ("COMPARISON", "bundle", "the best of a part first")
    listed = f"{how_many(count, one)}, {order}" if count > 1 else how_many(count, one)
    lines = [f"{word}  {checked.folder.name}: {listed}", ""]
    lines += [f"  {_line(one)}" for one in checked.own]
    for name, bundle in checked.bundles:
        lines.append(f"{name:<{longest}}  {_outcome(bundle)}")
        lines += [f"  {name}/{_line(one)}" for one in bundle.findings]
    if stack is not None and stack.sheet and not checked.findings:
        lines += ["", f"RUN SHEET  {stack.title}  ({checked.folder.name})", "", *_stack_sheet(stack, width=width)]
    return "\n".join(lines)


def _stack_sheet(stack: CheckedStack, *, width: int | None) -> list[str]:
    """Return the lines of the page of a program of several bundles, which was executed."""
    now = stack.program
    proof = proof_rows(stack.one, now.scenarios, now.refused, stack.seen, program_sha256=now.program_sha256)
    return [line for label, texts in (*stack.sheet, *proof) for line in entry(label, texts, width=width)]


def _outcome(bundle: Checked) -> str:
    """Return what is said of one of several bundles."""
    if bundle.findings:
        return f"differs from the plan that was made: {how_many(len(bundle.findings), 'finding')}"
    record, again = bundle.record, "".join(f"; {text}" for text in repeated_texts(bundle)[:1])
    if record is None or not bundle.program or bundle.setup is None:
        why = "" if record is None or record.not_printable is None else f": {record.not_printable}"
        return f"as planned{again}; holds no program{why}"
    dry = ", runs dry only" if bundle.setup.placement.missing else ""
    of_it = [one.stage for one in bundle.seen if one.program_sha256 == bundle.program_sha256]
    seen = f"; seen {', '.join(dict.fromkeys(of_it))}" if of_it else ""
    targets = sum(robot.program.targets for robot in record.robot)
    tilted = f" in {how_many(len(record.robot), 'attitude')}" if len(record.robot) > 1 else ""
    return f"as planned{again}; {how_many(targets, 'target')}{tilted}{dry}{seen}"


def _line(one: Finding) -> str:
    return f"{one.file}, line {one.line}: {one.reason}"
