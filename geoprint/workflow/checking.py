"""`geoprint check`: is the bundle on disk still the plan that was made, whoever has edited it since?

Everything is read from the folder: the modules by the independent reader, the plan by its own tables. What is found
wrong is listed with file, line and reason; nothing is repaired.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import final

from geoprint.errors import GeoprintError, VerificationError
from geoprint.model import FloatArray, PoseStream
from geoprint.postprocessor import (
    EVIDENCE,
    PLAN,
    Event,
    Orders,
    PosesTable,
    Setup,
    TipsAt,
    TrajectoryTable,
    read_orders,
    read_poses_table,
    read_setup,
    read_trajectory_table,
)
from geoprint.postprocessor.rapid import (
    RESIDENT,
    Executed,
    Made,
    Proof,
    Settings,
    Timeline,
    check_resident,
    check_timeline,
    check_times,
    expected_events,
    judge_program,
    program_settings,
    read_task,
    timeline,
)
from geoprint.reporting import program_digest
from geoprint.reporting.check import Checked, Finding
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import read_record
from geoprint.robot.arm import Arm
from geoprint.robot.timing.moments import tips_at
from geoprint.workflow.bundles import (
    RAPID_FOLDER,
    changes,
    check_joined,
    foreign,
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
    check_configuration,
    check_deposited_path,
    check_extent,
    check_frame,
    check_joints,
    check_lifted,
    check_moves,
    check_passing,
    check_poses,
    check_speeds,
    check_zones,
)
from geoprint.workflow.tilting import PART


def check_bundle(folder: Path | str, *, full: bool = False) -> Checked:
    """Check a bundle that `geoprint plan` or `compare` wrote, with or without a program.

    Args:
        folder: the bundle.
        full: whether the collision check and the measurement of evenness are repeated, from the bundle's own part.

    Returns:
        What was found. A file that merely changed is a finding too, at its first line; the switches of GeoCell may be
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
    elif any(name.startswith(f"{RAPID_FOLDER}/") for name in names):
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
        program_sha256=program_digest(checking.modules(names)),
        executed=checking.executed,
    )


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
        self._folder, self._plan = folder, plan

    def run(self, names: Sequence[str]) -> None:
        with_file = self._collecting
        with_file("plan.json", self._read_plan)
        with_file("setup.json", self._read_setup)
        if self.setup is None:
            # Whatever it was written for, nothing loads whose names mean nothing.
            with_file(RAPID_FOLDER, lambda: read_task(tuple(self.modules(names)), signals=None))
            return
        setup = self.setup
        with_file(f"{RAPID_FOLDER}/{RESIDENT}", lambda: self._check_resident(setup))
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
        self.setup = read_setup(self._folder / "setup.json")

    def _check_resident(self, setup: Setup) -> None:
        path = self._folder / RAPID_FOLDER / RESIDENT
        if path.is_file():
            check_resident(path.read_bytes().decode("latin-1"), cell=setup.cell, placement=setup.placement)

    def _read_orders(self, setup: Setup, table: TrajectoryTable, poses: PosesTable) -> None:
        self.orders = read_orders(
            self._folder / "targets.csv", poses, start=setup.start,
            lifted=setup.aloft, extent=setup.extent, duration=float(table.times[-1]),
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
        streams = self._check_poses(orders, table, tips)
        self._collecting("targets.csv", lambda: check_speeds(orders, tips, table.times, process=process))
        self._collecting("targets.csv", lambda: check_zones(orders, tips))
        # Places, zones or speeds that are wrong already lead past the poses, too.
        for poses in streams if not self.findings else ():
            self._collecting("targets.csv", lambda poses=poses: check_moves(orders, poses))
        modules = tuple(self.modules(names))
        wanted: list[tuple[Event, ...]] = []
        self._collecting(
            "targets.csv",
            lambda: wanted.append(
                expected_events(orders, signals=setup.cell.signals, tips_at=tips, speed=process.speed)
            ),
        )
        judged = [
            judge_program(
                modules, orders, cell=setup.cell, placement=setup.placement, surface_within=setup.surface_within,
                events=events,
            )
            for events in wanted
        ]  # fmt: skip
        self.findings += [_finding(error, RAPID_FOLDER) for findings, _ in judged for error in findings]
        for findings, proof in judged:
            if proof is None:
                continue
            self.executed = proof.executed
            if not findings and proof.printing.count == orders.count:
                self._check_motion(proof, setup, orders, table, arm=arm, tips=tips)
                self.settings = program_settings(modules, runs=int(orders.runs[-1]) + 1)

    def _check_poses(self, orders: Orders, table: TrajectoryTable, tips: TipsAt) -> list[PoseStream]:
        streams: list[PoseStream] = []
        if (record := self.record) is not None:
            self._collecting("poses.csv", lambda: streams.append(stream_of(self._folder, record)))
        for poses in streams:
            self._collecting("targets.csv", lambda poses=poses: check_poses(orders, poses))
            self._collecting("trajectory.csv", lambda poses=poses: check_deposited_path(poses, table, tips))
        return streams

    def _check_motion(
        self, proof: Proof, setup: Setup, orders: Orders, table: TrajectoryTable, *, arm: Arm, tips: TipsAt
    ) -> None:
        made, T_base_work = proof.printing, setup.placement.T_base_work
        self._collecting(RAPID_FOLDER, lambda: check_times(proof.executed))
        self._collecting(RAPID_FOLDER, lambda: check_configuration(made, orders, table, arm, T_base_work))
        self._collecting(RAPID_FOLDER, lambda: check_lifted(made, proof.dry, orders, arm, T_base_work))
        self._collecting("setup.json", lambda: check_frame(made, orders, table, arm, T_base_work))
        self._collecting("targets.csv", lambda: self._simulate(made, orders, setup, tips))

    def _simulate(self, made: Made, orders: Orders, setup: Setup, tips: Callable[[FloatArray], FloatArray]) -> None:
        self.switching = timeline(made, orders, signals=setup.cell.signals, tips_at=tips)
        check_timeline(self.switching)

    def modules(self, names: Sequence[str]) -> Iterator[tuple[str, str]]:
        """Yield name and text of the program's files that exist, in the order of the manifest."""
        for name in names:
            path = self._folder / name
            if name == f"{RAPID_FOLDER}/{path.name}" and path.is_file():
                yield path.name, path.read_bytes().decode("latin-1")

    def _collecting(self, file: str, check: Callable[[], object]) -> None:
        try:
            check()
        except GeoprintError as error:
            self.findings.append(_finding(error, file))


def _finding(error: GeoprintError, file: str) -> Finding:
    """Return what an error says; an error of a module names it and its line."""
    module, line = error.details.get("module"), error.details.get("line", error.details.get("row"))
    name = f"{RAPID_FOLDER}/{module}" if isinstance(module, str) else file
    reason = error.details.get("reason")
    return Finding(name, line if isinstance(line, int) else 1, reason if isinstance(reason, str) else str(error))
