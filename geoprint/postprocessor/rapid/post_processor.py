"""RAPID as a post-processor: what writes, reads, executes and verifies it, under the names that all dialects share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import ClassVar, final

from geoprint.errors import VerificationError
from geoprint.model import Cell, ControllerPath, Dispensing, JointPath, Placement, Program, Targets
from geoprint.postprocessor.execution import OwnProgram, Settings, StackProof, StackSettings
from geoprint.postprocessor.expected import expected_events
from geoprint.postprocessor.interface import CONTROLLER_FOLDER, Execution, Handling, Joining, RobotProgram
from geoprint.postprocessor.orders import Orders
from geoprint.postprocessor.rapid.cell_module import check_cell
from geoprint.postprocessor.rapid.configuration import check_configuration, check_frame, check_lifted
from geoprint.postprocessor.rapid.controller_files import controller_files
from geoprint.postprocessor.rapid.dispensing import dispensing_of, switched_of
from geoprint.postprocessor.rapid.executed import Proof, check_times
from geoprint.postprocessor.rapid.guard import RESIDENT, check_resident
from geoprint.postprocessor.rapid.handling import handling, parts_handling, parts_loading
from geoprint.postprocessor.rapid.language.symbols import read_task
from geoprint.postprocessor.rapid.program import written_program
from geoprint.postprocessor.rapid.settings import as_written
from geoprint.postprocessor.rapid.stack_verifying import judge_stack
from geoprint.postprocessor.rapid.stack_writing import STACK_LIST, together
from geoprint.postprocessor.rapid.verify import (
    header_findings,
    joined_header_findings,
    judge_program,
    program_settings,
    read_back,
    verify_program,
)
from geoprint.postprocessor.rapid.verify_controller import controller_findings
from geoprint.postprocessor.tables import TrajectoryTable
from geoprint.robot.arm import Arm, require_abb_conventions
from geoprint.robot.controller import controller_path


@final
class Rapid:
    """Modules for controllers of ABB; as `PostProcessor`."""

    title: ClassVar[str] = "RAPID modules for ABB controllers"

    @property
    def joining(self) -> Joining:
        """How programs of several parts become one."""
        return _RapidParts()

    def check_cell(self, cell: Cell) -> None:
        """Refuse an output without a RAPID name, and a load that is not physical."""
        check_cell(cell)

    def check_arm(self, arm: Arm) -> None:
        """Refuse an arm whose joints ABB counts otherwise."""
        require_abb_conventions(arm)

    def driven(self, joint_path: JointPath, targets: Targets, motion: TrajectoryTable, arm: Arm) -> ControllerPath:
        """Return the straight moves between targets with their rounded corners, from home to home."""
        del motion
        return controller_path(joint_path, targets, arm)

    def write(self, program: RobotProgram, cell: Cell) -> tuple[Program, Execution]:
        """Write the modules, and verify them by reading them back."""
        orders, speed = program.orders, cell.process.speed
        written = written_program(
            orders, program.events, cell=cell, placement=program.placement, surface_within=program.surface_within,
            part_name=program.part_name, spacing=program.spacing, checked=program.checked,
            not_checked=program.not_checked,
        )  # fmt: skip
        proof = verify_program(
            written, orders, cell=cell, placement=program.placement, surface_within=program.surface_within,
            events=expected_events(orders, signals=cell.signals, tips_at=program.tips_at, speed=speed),
        )  # fmt: skip
        check_times(proof.executed)
        return written, _execution((), proof, program)

    def kept(
        self, cell: Cell, *, placement: Placement, names: Sequence[str], folders: Sequence[str] = ()
    ) -> dict[str, str]:
        """Return signals, ties of events, the module that outlasts programs, and the page about them."""
        return controller_files(cell, placement=placement, loading=_loading(names), folders=folders)

    def kept_findings(
        self,
        files: Mapping[str, str],
        cell: Cell,
        *,
        placement: Placement,
        names: Sequence[str],
        folders: Sequence[str] = (),
    ) -> Iterator[VerificationError]:
        """Yield what is wrong with these files: the first of each."""
        return controller_findings(files, cell=cell, placement=placement, loading=_loading(names), folders=folders)

    def parse(self, files: Sequence[tuple[str, str]]) -> None:
        """Read modules whose outputs nobody knows."""
        read_task(tuple(files), signals=None)

    def as_written(self, name: str, text: str) -> str:
        """Return a module with the switches of a new program."""
        return as_written(name, text)

    def execute(self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell) -> Execution:
        """Execute a program dry, printing, resumed and stopped."""
        found, proof = _judged(files, program, cell)
        return _execution(found, proof, program)

    def check(
        self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell, *, kept: Mapping[str, str]
    ) -> Execution:
        """Execute a program, and hold the configuration of its targets against the inverse kinematics."""
        findings = _resident(kept, cell, program.placement)
        judged, proof = _judged(files, program, cell)
        findings += judged
        settings: list[Settings] = []
        orders, table, runs = program.orders, program.motion, int(program.orders.runs[-1]) + 1
        if proof is not None and not judged and proof.printing.count == orders.count:
            made, arm, T_base_work = proof.printing, _arm(cell), program.placement.T_base_work
            findings += _failing(
                lambda: check_times(proof.executed),
                lambda: check_configuration(made, orders, table, arm, T_base_work),
                lambda: check_lifted(made, proof.dry, orders, arm, T_base_work),
                lambda: check_frame(made, orders, table, arm, T_base_work),
                lambda: settings.append(program_settings(tuple(files), runs=runs)),
            )
        return _execution(tuple(findings), proof, program, settings=settings[0] if settings else None)

    def dispensing(self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell) -> Dispensing:
        """Return where the tip is when, and what the program commands."""
        made = read_back(tuple(files), cell=cell, placement=program.placement)
        return dispensing_of(
            made, program.orders, signals=cell.signals, placement=program.placement, tips_at=program.tips_at
        )

    def header_findings(self, files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
        """Yield where a header does not say what it must."""
        return header_findings(files, sentences)

    def handling(
        self, orders: Orders, cell: Cell, *, placement: Placement, names: Sequence[str], settings: Settings | None
    ) -> Handling:
        """Return how a program is loaded, set by its three switches, and started."""
        return handling(orders, cell, placement=placement, names=names, settings=settings)


@final
class _RapidParts:
    """A program that loads the modules of each part in its turn; as `Joining`."""

    @property
    def file(self) -> str:
        """Name of the list that a person loads."""
        return STACK_LIST

    def join(self, own: Sequence[OwnProgram], *, part_name: str) -> tuple[dict[str, str], dict[str, str], StackProof]:
        """Return the program of several, verified."""
        return together(own, part_name=part_name)

    def judge(
        self, files: Mapping[str, str], own: Sequence[OwnProgram], *, kept: Mapping[str, str]
    ) -> tuple[tuple[VerificationError, ...], StackProof | None, StackSettings | None]:
        """Return what is wrong with a program of several, what it did, and how it is set."""
        findings, proof, settings = judge_stack(files, own)
        return (*_resident(kept, own[-1].cell, own[-1].placement), *findings), proof, settings

    def header_findings(self, files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
        """Yield where the header of GeoStack does not say what it must."""
        return joined_header_findings(files, sentences)

    def handling(
        self, one: str, count: int, settings: StackSettings | None, *, dry_only: bool, table: str
    ) -> list[tuple[str, list[str]]]:
        """Return how a program of several is set, printed, stopped and begun again."""
        return parts_handling(one, count, settings, dry_only=dry_only, table=table)

    def loading(self, folders: str, file: str) -> str:
        """Return what a person copies and loads."""
        return parts_loading(folders, file)


def _arm(cell: Cell) -> Arm:
    return Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)


def _loading(names: Sequence[str]) -> bool:
    """Return whether a program loads modules while it runs."""
    return any(name.rpartition("/")[2].startswith("GeoPath") for name in names)


def _judged(
    files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell
) -> tuple[tuple[VerificationError, ...], Proof | None]:
    return judge_program(
        tuple(files), program.orders, cell=cell, placement=program.placement, surface_within=program.surface_within,
        events=program.events,
    )  # fmt: skip


def _execution(
    findings: tuple[VerificationError, ...],
    proof: Proof | None,
    program: RobotProgram,
    *,
    settings: Settings | None = None,
) -> Execution:
    if proof is None:
        return Execution(findings)
    made, orders = proof.printing, program.orders
    if made.count != orders.count:
        return Execution(findings, proof.executed)
    places = [made.place(target) for target in range(made.count)]
    return Execution(
        findings,
        proof.executed,
        switched_of(made, orders, tips_at=program.tips_at),
        tuple((place.module, place.line) for place in places),
        settings,
    )


def _resident(kept: Mapping[str, str], cell: Cell, placement: Placement) -> list[VerificationError]:
    """Return what is wrong with the module that outlasts programs, where it lies there."""
    name = RESIDENT.removeprefix(f"{CONTROLLER_FOLDER}/")
    if name not in kept:
        return []
    return _failing(lambda: check_resident(kept[name], cell=cell, placement=placement))


def _failing(*checks: Callable[[], object]) -> list[VerificationError]:
    """Return what checks find, one after the other."""
    found: list[VerificationError] = []
    for check in checks:
        try:
            check()
        except VerificationError as error:
            found.append(error)
    return found
