"""`geoprint check`: is the bundle on disk still the plan that was made, whoever has edited it since?

Everything is read from the folder: the modules by the independent reader, the plan by its own tables. What is found
wrong is listed with file, line and reason; nothing is repaired.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any, cast, final

import numpy as np

from geoprint import transforms
from geoprint.errors import GeoprintError, InputError, VerificationError
from geoprint.export import (
    MANIFEST,
    Event,
    Orders,
    PosesTable,
    Setup,
    Step,
    Timeline,
    TrajectoryTable,
    check_timeline,
    program_findings,
    read_back,
    read_orders,
    read_poses_table,
    read_setup,
    read_trajectory_table,
    switching_events,
    timeline,
)
from geoprint.model import FloatArray
from geoprint.motion import Arm, configuration_data, joints_at, tips_at

# Where a bundle keeps the program.
RAPID_FOLDER = "rapid"
# What a person asks to check who named another folder.
_WHICH_FOLDER = "give the folder that `geoprint plan --out` wrote, or one of a backend below that of `geoprint compare`"
# The trajectory passes the targets to this [mm]: it is written in rows of a millisecond.
TRAJECTORY_TOLERANCE = 0.01
# Joints from the inverse agree with those of the trajectory between its rows to this [rad].
JOINT_TOLERANCE = 1e-3
# An angle this near to a multiple of 90 degrees [rad] may count for either quadrant.
QUADRANT_TOLERANCE = 1e-6


@final
@dataclass(frozen=True, slots=True)
class Finding:
    """Something that is wrong: in which file and line (from 1), and why."""

    file: str
    line: int
    reason: str


@final
@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """A bundle that was checked.

    Attributes:
        folder: where it stands.
        findings: what is wrong; empty where it is as it was planned.
        summary: the content of plan.json.
        setup: the cell, or None where it cannot be read.
        orders: the targets, or None where they cannot be read.
        switching: what flows when, or None where the program is not the plan's.
    """

    folder: Path
    findings: tuple[Finding, ...]
    summary: dict[str, Any]
    setup: Setup | None
    orders: Orders | None
    switching: Timeline | None


def check_bundle(folder: Path) -> Checked:
    """Check a bundle that `geoprint plan` wrote.

    Args:
        folder: the bundle.

    Returns:
        What was found. A file that merely changed is a finding too, at its first line.

    Raises:
        InputError: the folder is no bundle with a program.
    """
    names = _listed(folder)
    checked = check_program(folder, list(names))
    said = {finding.file for finding in checked.findings}
    changed = [Finding(name, 1, reason) for name, reason in _changes(folder, names) if name not in said]
    return replace(checked, findings=(*checked.findings, *changed))


def check_program(folder: Path, names: Sequence[str]) -> Checked:
    """Check the program of a bundle against the bundle's own tables; hashes are left out.

    Args:
        folder: the bundle.
        names: of its files.
    """
    checking = _Checking(folder)
    checking.run(names)
    return Checked(
        folder, tuple(checking.findings), checking.summary, checking.setup, checking.orders, checking.switching
    )


def _listed(folder: Path) -> dict[str, str]:
    """Return the hash of each file that the manifest lists: the bundle's own, or that of the comparison it is in."""
    if not folder.is_dir():
        raise InputError(f"there is no folder {folder}; {_WHICH_FOLDER}.")
    try:
        place = next(place for place in (folder, *folder.absolute().parents[:2]) if (place / MANIFEST).is_file())
        below = folder.absolute().relative_to(place.absolute())
        listed = dict(json.loads((place / MANIFEST).read_bytes())["sha256"])
        paths = {PurePosixPath(str(name)): str(digest) for name, digest in listed.items()}
        names = {str(path.relative_to(below)): digest for path, digest in paths.items() if path.is_relative_to(below)}
    except StopIteration:
        raise InputError(f"{folder} is no bundle of geoprint: it holds no {MANIFEST}; {_WHICH_FOLDER}.") from None
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(
            f"{folder} is no bundle of geoprint: its {MANIFEST} cannot be read ({error}); {_WHICH_FOLDER}."
        ) from error
    if not names:
        raise InputError(
            f"{folder} is no bundle of geoprint: the {MANIFEST} above it lists none here; {_WHICH_FOLDER}."
        )
    if not any(name.startswith(f"{RAPID_FOLDER}/") for name in names):
        raise InputError(
            f"{folder} holds no program, because it was planned without the robot: plan it without `--no-robot`."
        )
    return names


def _changes(folder: Path, names: dict[str, str]) -> Iterator[tuple[str, str]]:
    for name, digest in names.items():
        path = folder / name
        if not path.is_file():
            yield name, "the file is missing"
        elif hashlib.sha256(path.read_bytes()).hexdigest() != digest:
            yield name, "the file was changed after it was written: its hash is not that of the manifest"
    for path in sorted((folder / RAPID_FOLDER).glob("*")):
        if f"{RAPID_FOLDER}/{path.name}" not in names:
            yield f"{RAPID_FOLDER}/{path.name}", "the manifest does not list this file"


@final
class _Checking:
    """Collects what is found while the parts of a bundle are read; what one part lacks, later ones go without."""

    def __init__(self, folder: Path) -> None:
        self.findings: list[Finding] = []
        self.summary: dict[str, Any] = {}
        self.setup: Setup | None = None
        self.orders: Orders | None = None
        self.switching: Timeline | None = None
        self._folder = folder

    def run(self, names: Sequence[str]) -> None:
        with_file = self._collecting
        with_file("plan.json", self._read_summary)
        with_file("setup.json", self._read_setup)
        if self.setup is None:
            return
        setup = self.setup
        moved: list[TrajectoryTable] = []
        posed: list[PosesTable] = []
        with_file("trajectory.csv", lambda: moved.append(read_trajectory_table(self._folder / "trajectory.csv")))
        with_file("poses.csv", lambda: posed.append(read_poses_table(self._folder / "poses.csv")))
        for table, poses in zip(moved, posed, strict=False):
            with_file("targets.csv", lambda table=table, poses=poses: self._read_orders(setup, table, poses))
            if self.orders is not None:
                self._check_program(names, setup, self.orders, table)

    def _read_summary(self) -> None:
        try:
            self.summary = cast("dict[str, Any]", json.loads((self._folder / "plan.json").read_bytes()))
        except (OSError, ValueError, RecursionError) as error:
            raise VerificationError(f"plan.json cannot be read ({error}); write the plan again.") from error

    def _read_setup(self) -> None:
        self.setup = read_setup(self._folder / "setup.json")

    def _read_orders(self, setup: Setup, table: TrajectoryTable, poses: PosesTable) -> None:
        self.orders = read_orders(
            self._folder / "targets.csv", poses, standoff=setup.cell.process.standoff, start=setup.start,
            aloft=setup.aloft, duration=float(table.times[-1]),
        )  # fmt: skip

    def _check_program(self, names: Sequence[str], setup: Setup, orders: Orders, table: TrajectoryTable) -> None:
        arm = Arm(setup.cell.robot, T_flange_tool=setup.cell.tool.T_flange_tool)
        T_base_work = setup.placement.T_base_work
        tips = tips_at(table.times, table.joints, arm, T_base_work=T_base_work)
        self._collecting("trajectory.csv", lambda: _check_trajectory(orders, tips(orders.times)))
        modules = tuple(self._modules(names))
        wanted: list[tuple[Event, ...]] = []
        self._collecting(
            "targets.csv",
            lambda: wanted.append(switching_events(orders, signals=setup.cell.signals, tips_at=tips)),
        )
        wrong = [
            finding
            for events in wanted
            for finding in program_findings(
                modules, orders, cell=setup.cell, placement=setup.placement, surface_within=setup.surface_within,
                events=events,
            )
        ]  # fmt: skip
        self.findings += [_finding(error, RAPID_FOLDER) for error in wrong]
        steps = () if wrong or not wanted else read_back(modules)
        if len(steps) == orders.count:
            self._collecting(RAPID_FOLDER, lambda: _check_configuration(steps, orders, table, arm, T_base_work))
            self._collecting("targets.csv", lambda: self._simulate(steps, orders, setup, tips))

    def _simulate(
        self, steps: tuple[Step, ...], orders: Orders, setup: Setup, tips: Callable[[FloatArray], FloatArray]
    ) -> None:
        self.switching = timeline(steps, orders, signals=setup.cell.signals, tips_at=tips)
        check_timeline(self.switching)

    def _modules(self, names: Sequence[str]) -> Iterator[tuple[str, str]]:
        """Yield name and text of the program's files that exist, in the order of the manifest."""
        for name in names:
            path = self._folder / name
            if name.startswith(f"{RAPID_FOLDER}/") and path.is_file():
                yield path.name, path.read_bytes().decode("latin-1")

    def _collecting(self, file: str, check: Callable[[], None]) -> None:
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


def _check_trajectory(orders: Orders, passed: FloatArray) -> None:
    misses = np.linalg.norm(passed - orders.tips, axis=1)
    if misses.max() > TRAJECTORY_TOLERANCE:
        target = int(misses.argmax())
        raise VerificationError(
            f"the trajectory passes target {target + 1} {misses.max():.3f} mm off at {orders.times[target]:.3f} s, "
            f"allowed are {TRAJECTORY_TOLERANCE} mm",
            line=int(orders.times[target] * 1000) + 2,
        )


def _check_configuration(
    steps: tuple[Step, ...], orders: Orders, table: TrajectoryTable, arm: Arm, T_base_work: FloatArray
) -> None:
    """Check that the inverse kinematics of the written targets has the written configuration, on the planned way."""
    data = np.array([step.move.target for step in steps])
    rotations = transforms.rotation_of(data[:, 3:7] / np.linalg.norm(data[:, 3:7], axis=1, keepdims=True))
    found = arm.solutions(T_base_work @ transforms.rigid(rotations, data[:, :3]))
    planned = joints_at(table.times, table.joints, orders.times)
    wound = found + 2.0 * np.pi * np.rint((planned[:, None] - found) / (2.0 * np.pi))
    misses = np.abs(wound - planned[:, None]).max(axis=2)
    nearest = np.nanargmin(np.where(np.isnan(misses), np.inf, misses), axis=1)
    rows = np.arange(len(steps))
    joints = wound[rows, nearest]
    said = data[:, 7:11].astype(np.int64)
    below, above = (configuration_data(joints + sign * QUADRANT_TOLERANCE, arm=arm) for sign in (-1.0, 1.0))
    off = misses[rows, nearest] > JOINT_TOLERANCE
    wrong = ~(misses[rows, nearest] <= JOINT_TOLERANCE) | ((said != below) & (said != above)).any(axis=1)
    if wrong.any():
        row = int(np.argmax(wrong))
        what = (
            "no inverse kinematic solution is on the planned way"
            if off[row]
            else f"the inverse kinematics gives the configuration {above[row].tolist()}, found {said[row].tolist()}"
        )
        place = steps[row].move.place
        raise VerificationError(f"target {row + 1}: {what}", module=place.module, line=place.line)
