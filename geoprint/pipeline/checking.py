"""`geoprint check`: is the bundle on disk still the plan that was made, whoever has edited it since?

Everything is read from the folder: the modules by the independent reader, the plan by its own tables. What is found
wrong is listed with file, line and reason; nothing is repaired.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import final

from geoprint.account.checked import Checked, Finding
from geoprint.account.records.plan import PlanRecord
from geoprint.account.records.rounding import read_record
from geoprint.errors import GeoprintError, InputError, VerificationError
from geoprint.export import (
    MANIFEST,
    Event,
    Orders,
    PosesTable,
    Setup,
    TrajectoryTable,
    read_orders,
    read_poses_table,
    read_setup,
    read_trajectory_table,
    switching_events,
)
from geoprint.export.rapid import (
    CELL_MODULE,
    Settings,
    Step,
    Timeline,
    as_new,
    check_names,
    check_timeline,
    program_findings,
    program_settings,
    read_back,
    timeline,
)
from geoprint.model import FloatArray
from geoprint.motion.arm import Arm
from geoprint.motion.timing import tips_at
from geoprint.pipeline.checking_motion import (
    check_aloft,
    check_configuration,
    check_extent,
    check_passing,
    check_speeds,
    check_zones,
)

# Where a bundle keeps the program.
RAPID_FOLDER = "rapid"
# What a person asks to check who named another folder.
_WHICH_FOLDER = "give the folder that `geoprint plan --out` wrote, or one of a backend below that of `geoprint compare`"


def check_bundle(folder: Path | str) -> Checked:
    """Check a bundle that `geoprint plan` wrote.

    Args:
        folder: the bundle.

    Returns:
        What was found. A file that merely changed is a finding too, at its first line; the switches of GeoCell may be
        set as its run sheet asks.

    Raises:
        InputError: the folder is no bundle with a program.
    """
    folder = Path(folder)
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
        folder,
        tuple(checking.findings),
        told=checking.told,
        setup=checking.setup,
        orders=checking.orders,
        settings=checking.settings,
        switching=checking.switching,
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
    if "plan.json" not in names:
        raise InputError(f"{folder} {_several(folder, names)}.")
    if not any(name.startswith(f"{RAPID_FOLDER}/") for name in names):
        raise InputError(
            f"{folder} holds no program: it was planned without the robot, or compared and found not to be printable "
            "(compare.json says why); plan it without `--no-robot`."
        )
    return names


def _several(folder: Path, names: Iterable[str]) -> str:
    """Say what a folder of several bundles is, and which of them can be checked."""
    bundles = sorted(PurePosixPath(name).parent for name in names if PurePosixPath(name).name == "plan.json")
    programs = [
        str(folder / one) for one in bundles if any(name.startswith(f"{one / RAPID_FOLDER}/") for name in names)
    ]
    found = f"holds a comparison of {len(bundles)} bundles, not one bundle"
    if programs:
        return f"{found}: check one that has a program, {' or '.join(programs)}"
    return f"{found}, and none of them has a program (compare.json says why)"


def _changes(folder: Path, names: dict[str, str]) -> Iterator[tuple[str, str]]:
    for name, digest in names.items():
        path = folder / name
        if not path.is_file():
            yield name, "the file is missing"
        elif digest not in _digests(path):
            yield name, "the file was changed after it was written: its hash is not that of the manifest"
    for path in sorted((folder / RAPID_FOLDER).glob("*")):
        if f"{RAPID_FOLDER}/{path.name}" not in names:
            yield f"{RAPID_FOLDER}/{path.name}", "the manifest does not list this file"


def _digests(path: Path) -> Iterator[str]:
    """Yield the hash of a file; of GeoCell also that with its switches as they were written."""
    content = path.read_bytes()
    yield hashlib.sha256(content).hexdigest()
    if path.name == CELL_MODULE:
        yield hashlib.sha256(as_new(content.decode("latin-1")).encode("latin-1")).hexdigest()


@final
class _Checking:
    """Collects what is found while the parts of a bundle are read; what one part lacks, later ones go without."""

    def __init__(self, folder: Path) -> None:
        self.findings: list[Finding] = []
        self.told: PlanRecord | None = None
        self.setup: Setup | None = None
        self.orders: Orders | None = None
        self.settings: Settings | None = None
        self.switching: Timeline | None = None
        self._folder = folder

    def run(self, names: Sequence[str]) -> None:
        with_file = self._collecting
        with_file("plan.json", self._read_plan)
        with_file("setup.json", self._read_setup)
        if self.setup is None:
            # Whatever it was written for, nothing loads that declares a name twice.
            with_file(RAPID_FOLDER, lambda: check_names(tuple(self._modules(names))))
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

    def _read_plan(self) -> None:
        self.told = read_record(self._folder / "plan.json", PlanRecord)
        if not self.told.robot:
            raise VerificationError("plan.json: robot: it has no part of the robot; write the plan again.")

    def _read_setup(self) -> None:
        self.setup = read_setup(self._folder / "setup.json")

    def _read_orders(self, setup: Setup, table: TrajectoryTable, poses: PosesTable) -> None:
        self.orders = read_orders(
            self._folder / "targets.csv", poses, start=setup.start,
            aloft=setup.aloft, extent=setup.extent, duration=float(table.times[-1]),
        )  # fmt: skip
        check_extent(poses, setup.extent)

    def _check_program(self, names: Sequence[str], setup: Setup, orders: Orders, table: TrajectoryTable) -> None:
        arm = Arm(setup.cell.robot, T_flange_tool=setup.cell.tool.T_flange_tool)
        T_base_work = setup.placement.T_base_work
        tips = tips_at(table.times, table.joints, arm, T_base_work=T_base_work)
        self._collecting("trajectory.csv", lambda: check_passing(orders, tips(orders.times)))
        self._collecting("targets.csv", lambda: check_speeds(orders, tips, table.times, process=setup.cell.process))
        self._collecting("targets.csv", lambda: check_zones(orders, tips))
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
            self._collecting(RAPID_FOLDER, lambda: check_configuration(steps, orders, table, arm, T_base_work))
            self._collecting(RAPID_FOLDER, lambda: check_aloft(steps, orders, arm, T_base_work))
            self._collecting("targets.csv", lambda: self._simulate(steps, orders, setup, tips))
            self.settings = program_settings(modules, runs=int(orders.runs[-1]) + 1)

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
