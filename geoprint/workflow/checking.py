"""`geoprint check`: is the bundle on disk still the plan that was made, whoever has edited it since?

Everything is read from the folder: the modules by the independent reader, the plan by its own tables. What is found
wrong is listed with file, line and reason; nothing is repaired.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import final

from geoprint.errors import GeoprintError, VerificationError
from geoprint.model import PoseStream
from geoprint.postprocessor import (
    EVIDENCE,
    PLAN,
    Event,
    Executed,
    Orders,
    PosesTable,
    Settings,
    Setup,
    Switched,
    Timeline,
    TipsAt,
    TrajectoryTable,
    check_timeline,
    expected_events,
    read_orders,
    read_poses_table,
    read_setup,
    read_trajectory_table,
    timeline,
)
from geoprint.postprocessor.interface import RobotProgram
from geoprint.postprocessor.registry import post_processor, post_processor_name, post_processor_names, post_processor_of
from geoprint.reporting import program_digest
from geoprint.reporting.check import Checked, Finding
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import read_record
from geoprint.robot.arm import Arm
from geoprint.robot.timing.moments import tips_at
from geoprint.workflow.bundles import (
    changes,
    check_joined,
    foreign,
    kept_files,
    listed,
    listed_bundle,
    path_findings,
    read_seen,
    stream_of,
)
from geoprint.workflow.check_figures import bundle_findings, not_derived
from geoprint.workflow.check_full import repeat
from geoprint.workflow.checking_motion import (
    check_bead_speed,
    check_deposited_path,
    check_extent,
    check_joints,
    check_moves,
    check_passing,
    check_poses,
    check_speeds,
    check_target_joints,
    check_zones,
)
from geoprint.workflow.tilting import PART


def check_bundle(folder: Path | str, *, full: bool = False) -> Checked:
    """Check a bundle that `geoprint plan` or `compare` wrote, with or without a program.

    Args:
        folder: the bundle.
        full: whether the collision check and the measurement of evenness are repeated, from the bundle's own part.

    Returns:
        What was found. A file that merely changed is a finding too, at its first line; switches of a program may be
        set as its run sheet asks.

    Raises:
        InputError: the folder is no bundle.
    """
    folder = Path(folder)
    if found := foreign(folder, listed(folder)):
        return Checked(folder, tuple(found), None, program=False)
    names = listed_bundle(folder)
    if any(name.startswith(f"{PART}1/") for name in names):
        checked = _check_attitudes(folder, list(names))
    elif _program_of(names):
        checked = check_program(folder, list(names))
    else:
        checked = _check_paths(folder)
    said = {finding.file for finding in checked.findings}
    changed = [Finding(name, 1, reason) for name, reason in changes(folder, names) if name not in said]
    checked = replace(checked, findings=(*checked.findings, *changed))
    if not checked.findings:
        # What is wrong already is not said a second time by the figures that follow from it.
        checked = replace(checked, findings=tuple(bundle_findings(checked, names)), not_derived=not_derived(names))
    if full and checked.record is not None:
        each = [(one.folder, one.setup, one.orders) for one in checked.attitudes or (checked,)]
        motions = [(place, setup, orders) for place, setup, orders in each if setup and orders]
        repeated, found = repeat(folder, checked.record, motions)
        checked = replace(checked, repeated=repeated, findings=(*checked.findings, *found))
    try:
        return replace(checked, seen=read_seen(folder))
    except GeoprintError as error:
        return replace(checked, findings=(*checked.findings, Finding(EVIDENCE, 1, str(error))))


def _check_attitudes(folder: Path, names: Sequence[str]) -> Checked:
    """Check the program of each attitude by itself, then that of all of them against these."""
    # The first is looked at in any case, so that what it lacks is said.
    count = max(sum(name.startswith(PART) and name.endswith("/setup.json") for name in names), 1)
    attitudes: list[Checked] = []
    findings: list[Finding] = []
    for number in range(1, count + 1):
        part = f"{PART}{number}"
        own = [name.removeprefix(f"{part}/") for name in names if name.startswith(f"{part}/")]
        attitudes.append(check_program(folder / part, own, plan=folder))
        findings += [replace(one, file=f"{part}/{one.file}") for one in attitudes[-1].findings if one.file != PLAN]
    record = attitudes[0].record
    if record is None:
        findings += [one for one in attitudes[0].findings if one.file == PLAN]
        return Checked(folder, tuple(findings), None, attitudes=tuple(attitudes))
    found, joined = check_joined(folder, names, record)
    return Checked(
        folder,
        (*findings, *found),
        record,
        setup=attitudes[0].setup,
        program_sha256=joined.program_sha256,
        attitudes=tuple(attitudes),
        joined=joined,
    )


def _check_paths(folder: Path) -> Checked:
    """Check a bundle without a program: its paths lie on its surface and are those of plan.json."""
    findings: list[Finding] = []
    record: PlanRecord | None = None
    try:
        record = read_record(folder / PLAN, PlanRecord)
        findings += path_findings(folder, record)
    except GeoprintError as error:
        findings.append(_finding(error, PLAN if record is None else "poses.csv"))
    if record is not None and record.robot:
        findings.append(Finding(PLAN, 1, "it lists a program, but the manifest has none"))
    return Checked(folder, tuple(findings), record, program=False)


def check_program(folder: Path, names: Sequence[str], *, plan: Path | None = None) -> Checked:
    """Check the program of a bundle, or of one of its attitudes, against its own tables; hashes are left out.

    Args:
        folder: of the tables.
        names: of its files.
        plan: the folder of plan.json, where that is another one.
    """
    checking = _Checking(folder, folder if plan is None else plan)
    checking.run(names)
    return Checked(
        folder,
        tuple(checking.findings),
        record=checking.record,
        setup=checking.setup,
        orders=checking.orders,
        settings=checking.settings,
        switching=checking.switching,
        program_sha256=program_digest(checking.modules(names), checking.dialect),
        executed=checking.executed,
    )


def _program_of(names: Iterable[str]) -> str:
    """Return the post-processor that wrote a program, which its folder is named after; empty where there is none."""
    folders = {name.partition("/")[0] for name in names if "/" in name}
    return next((name for name in post_processor_names() if name in folders), "")


@final
class _Checking:
    """Collects what is found while the parts of a bundle are read; what one part lacks, later ones go without."""

    def __init__(self, folder: Path, plan: Path) -> None:
        self.findings: list[Finding] = []
        self.record: PlanRecord | None = None
        self.setup: Setup | None = None
        self.orders: Orders | None = None
        self.settings: Settings | None = None
        self.switching: Timeline | None = None
        self.executed: Executed | None = None
        self._folder, self._plan, self.dialect = folder, plan, ""

    def run(self, names: Sequence[str]) -> None:
        with_file = self._collecting
        with_file("plan.json", self._read_plan)
        with_file("setup.json", self._read_setup)
        if self.setup is None:
            # Whatever it was written for, nothing loads whose names mean nothing.
            self.dialect = _program_of(names)
            with_file(self.dialect, lambda: post_processor(self.dialect).parse(tuple(self.modules(names))))
            return
        setup = self.setup
        moved: list[TrajectoryTable] = []
        posed: list[PosesTable] = []
        with_file("trajectory.csv", lambda: moved.append(read_trajectory_table(self._folder / "trajectory.csv")))
        with_file("poses.csv", lambda: posed.append(read_poses_table(self._folder / "poses.csv")))
        for table, poses in zip(moved, posed, strict=False):
            with_file("targets.csv", lambda table=table, poses=poses: self._read_orders(setup, table, poses))
            if self.orders is not None:
                orders = self.orders
                with_file(
                    "setup.json",
                    lambda table=table, orders=orders: self._check_program(names, setup, orders, table),
                )

    def _read_plan(self) -> None:
        self.record = read_record(self._plan / PLAN, PlanRecord)
        if not self.record.robot:
            raise VerificationError("plan.json: robot: it has no part of the robot; write the plan again.")

    def _read_setup(self) -> None:
        setup = read_setup(self._folder / "setup.json")
        self.dialect = post_processor_name(setup.cell)
        self.setup = setup

    def _read_orders(self, setup: Setup, table: TrajectoryTable, poses: PosesTable) -> None:
        self.orders = read_orders(
            self._folder / "targets.csv", poses,
            extent=setup.extent, duration=float(table.times[-1]),
            frame=inf if setup.frame is None else setup.frame,
        )  # fmt: skip
        check_extent(poses, setup.extent)
        check_bead_speed(self.orders, poses, process=setup.cell.process)

    def _check_program(self, names: Sequence[str], setup: Setup, orders: Orders, table: TrajectoryTable) -> None:
        arm = Arm(setup.cell.robot, T_flange_tool=setup.cell.tool.T_flange_tool)
        T_base_work = setup.placement.T_base_work
        tips = tips_at(table.times, table.joints, arm, T_base_work=T_base_work)
        process = setup.cell.process
        self._collecting("trajectory.csv", lambda: check_joints(table, setup.cell.robot, process=process))
        self._collecting("trajectory.csv", lambda: check_passing(orders, tips(orders.times)))
        self._collecting("targets.csv", lambda: check_target_joints(orders, table, arm, T_base_work))
        streams = self._check_poses(orders, table, tips)
        self._collecting("targets.csv", lambda: check_speeds(orders, tips, table.times, process=process))
        self._collecting("targets.csv", lambda: check_zones(orders, tips))
        # Places, zones or speeds that are wrong already lead past the poses, too.
        for poses in streams if not self.findings else ():
            self._collecting("targets.csv", lambda poses=poses: check_moves(orders, poses))
        wanted: list[tuple[Event, ...]] = []
        self._collecting(
            "targets.csv",
            lambda: wanted.append(
                expected_events(orders, signals=setup.cell.signals, tips_at=tips, speed=process.speed)
            ),
        )
        for events in wanted:
            self._execute(tuple(self.modules(names)), setup, orders, table, events=events, tips=tips)

    def _execute(
        self,
        modules: Sequence[tuple[str, str]],
        setup: Setup,
        orders: Orders,
        table: TrajectoryTable,
        *,
        events: tuple[Event, ...],
        tips: TipsAt,
    ) -> None:
        """Execute the program, and hold what it does against the plan's tables."""
        record = self.record
        program = RobotProgram(
            part_name="" if record is None else record.input.name,
            spacing=0.0 if record is None else record.settings.spacing_mm,
            placement=setup.placement,
            surface_within=setup.surface_within,
            orders=orders,
            events=events,
            tips_at=tips,
            motion=table,
        )
        kept = kept_files(self._folder, self.dialect)
        execution = post_processor_of(setup.cell).check(modules, program, setup.cell, kept=kept)
        self.findings += [_finding(error, self.dialect, program=self.dialect) for error in execution.findings]
        self.executed, self.settings = execution.executed, execution.settings
        if not execution.findings and execution.lines:
            self._collecting("targets.csv", lambda: self._simulate(execution.switched, orders, setup, tips))

    def _check_poses(self, orders: Orders, table: TrajectoryTable, tips: TipsAt) -> list[PoseStream]:
        streams: list[PoseStream] = []
        if (record := self.record) is not None:
            self._collecting("poses.csv", lambda: streams.append(stream_of(self._folder, record)))
        for poses in streams:
            self._collecting("targets.csv", lambda poses=poses: check_poses(orders, poses))
            self._collecting("trajectory.csv", lambda poses=poses: check_deposited_path(poses, table, tips))
        return streams

    def _simulate(self, switched: Sequence[Switched], orders: Orders, setup: Setup, tips: TipsAt) -> None:
        self.switching = timeline(switched, orders, signals=setup.cell.signals, tips_at=tips)
        check_timeline(self.switching)

    def modules(self, names: Sequence[str]) -> Iterator[tuple[str, str]]:
        """Yield name and text of the program's files that exist, in the order of the manifest."""
        for name in names:
            path = self._folder / name
            if name == f"{self.dialect}/{path.name}" and path.is_file():
                yield path.name, path.read_bytes().decode("latin-1")

    def _collecting(self, file: str, check: Callable[[], object]) -> None:
        try:
            check()
        except GeoprintError as error:
            self.findings.append(_finding(error, file, program=self.dialect))


def _finding(error: GeoprintError, file: str, *, program: str = "") -> Finding:
    """Return what an error says; an error of a file of the program names it and its line."""
    module, line = error.details.get("module"), error.details.get("line", error.details.get("row"))
    name = f"{program}/{module}" if isinstance(module, str) else str(error.details.get("file", file))
    reason = error.details.get("reason")
    return Finding(name, line if isinstance(line, int) else 1, reason if isinstance(reason, str) else str(error))
