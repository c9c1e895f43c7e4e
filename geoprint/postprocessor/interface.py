"""What a post-processor takes and gives: a program in no dialect, its files in one, and what they do when executed.

A dialect's own terms stay behind it. Configuration data, quadrants and names of instructions are RAPID's; a robot
program says poses, speeds, blends, and where outputs switch.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol, final

from geoprint.errors import VerificationError
from geoprint.model import Cell, ControllerPath, Dispensing, JointPath, Placement, Program, Targets, comparable, frozen
from geoprint.postprocessor.execution import Executed, OwnProgram, Settings, StackProof, StackSettings, Switched
from geoprint.postprocessor.orders import Event, Orders, TipsAt
from geoprint.postprocessor.tables import TrajectoryTable
from geoprint.robot.arm import Arm

# Folder of what a controller needs before the first load, in the folder of the program.
CONTROLLER_FOLDER = "controller"


@final
@frozen
class RobotProgram:
    """A program in no dialect; tool, home and names of outputs are those of its cell.

    Attributes:
        part_name: of the part that is printed.
        spacing: distance of neighbouring paths [mm].
        placement: frames of the work object, the attitude of a table that a person is asked for, and what nobody has
            stated of them.
        surface_within: what the surface is known within along its normal, in 95 of 100 calibrations [mm], or None.
        orders: targets run by run: pose, path speed, blend radius and time of each, and what flows from it to the next.
        events: where on the path outputs switch.
        tips_at: the motion of the tip.
        motion: of the arm over time.
        checked: sentences about what was checked.
        not_checked: sentences about what was not.
    """

    part_name: str
    spacing: float
    placement: Placement
    surface_within: float | None
    orders: Orders
    events: tuple[Event, ...]
    tips_at: TipsAt
    motion: TrajectoryTable
    checked: tuple[str, ...] = ()
    not_checked: tuple[str, ...] = ()


@final
@frozen
class Execution:
    """What a program did when it was executed.

    Attributes:
        findings: what is wrong with it, in the order in which it matters.
        executed: figures; None where it does not run.
        switched: what it switches when it prints.
        lines: file and line of the move to each target; none where it does not run, or moves to others.
        settings: how it is set to run; None where something is wrong, or a dialect has no switches.
    """

    findings: tuple[VerificationError, ...]
    executed: Executed | None = None
    switched: tuple[Switched, ...] = ()
    lines: tuple[tuple[str, int], ...] = ()
    settings: Settings | None = None


@final
@comparable
class Handling:
    """What a run sheet says of loading and starting a program.

    Attributes:
        loading: what to load.
        settings: how it would run now.
        steps: what to do before the start.
    """

    loading: tuple[str, ...]
    settings: tuple[str, ...]
    steps: tuple[str, ...]


class PostProcessor(Protocol):
    """A dialect: it writes robot programs, and executes what was written by code that the writer does not share.

    Programs are `files`: name, with folders in that of the program, and text of each, in the order of loading. Those of
    `CONTROLLER_FOLDER` are `kept` on the controller, and are no part of them.
    """

    @property
    def title(self) -> str:
        """A few words that stand beside its name."""
        ...

    @property
    def joining(self) -> Joining | None:
        """How programs of several parts become one; None where it cannot."""
        ...

    def check_cell(self, cell: Cell) -> None:
        """Refuse a cell for which it cannot write, before the long work.

        Raises:
            UsageError: the cell has what the dialect cannot take, or lacks what it needs.
        """
        ...

    def check_arm(self, arm: Arm) -> None:
        """Refuse an arm for which it cannot write, likewise.

        Raises:
            UsageError: the dialect counts the joints of such an arm otherwise, or has no words for it.
        """
        ...

    def driven(self, joint_path: JointPath, targets: Targets, motion: TrajectoryTable, arm: Arm) -> ControllerPath:
        """Return the motion as whatever runs the program drives it, which is checked for collisions.

        Args:
            joint_path: p poses with their joints.
            targets: poses that are written.
            motion: of the arm, as it was timed.
            arm: with its tool.
        """
        ...

    def write(self, program: RobotProgram, cell: Cell) -> tuple[Program, Execution]:
        """Return the files of a program, and what they did when executed; the same input gives the same bytes.

        Raises:
            UsageError: the dialect cannot say it.
            VerificationError: what was written reads back otherwise, or does something else.
        """
        ...

    def kept(
        self, cell: Cell, *, placement: Placement, names: Sequence[str], folders: Sequence[str] = ()
    ) -> dict[str, str]:
        """Return name and text of each file that a controller needs before the first load.

        Args:
            cell: its outputs and arm.
            placement: whether all of it was stated.
            names: of the program's files.
            folders: of the parts that it loads in their order; none for a program of one part.
        """
        ...

    def kept_findings(
        self,
        files: Mapping[str, str],
        cell: Cell,
        *,
        placement: Placement,
        names: Sequence[str],
        folders: Sequence[str] = (),
    ) -> Iterator[VerificationError]:
        """Yield what is wrong with these files, by code that shares nothing with what writes them."""
        ...

    def parse(self, files: Sequence[tuple[str, str]]) -> None:
        """Read a program whose cell nobody knows.

        Raises:
            VerificationError: it is none in this dialect.
        """
        ...

    def as_written(self, name: str, text: str) -> str:
        """Return a file of a program with what a person sets in it as in a new one: other values are no other file."""
        ...

    def execute(self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell) -> Execution:
        """Execute a program, and compare it with what it was written for: `events` are those that must switch."""
        ...

    def check(
        self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell, *, kept: Mapping[str, str]
    ) -> Execution:
        """Execute a program that was read back, hold it against the motion of the arm too, and what is kept for it."""
        ...

    def dispensing(self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell) -> Dispensing:
        """Return where the tip of a program is when, and what it commands, whatever was planned.

        Raises:
            VerificationError: it does not run, or has other targets than planned.
        """
        ...

    def header_findings(self, files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
        """Yield where the headers of a program do not say these sentences, or claim other checks."""
        ...

    def handling(
        self, orders: Orders, cell: Cell, *, placement: Placement, names: Sequence[str], settings: Settings | None
    ) -> Handling:
        """Return what the run sheet says of loading and starting a program."""
        ...


class Joining(Protocol):
    """What makes one program of those of several parts: layers, attitudes of a table, or both."""

    @property
    def file(self) -> str:
        """Name of the file that a person loads."""
        ...

    def join(self, own: Sequence[OwnProgram], *, part_name: str) -> tuple[dict[str, str], dict[str, str], StackProof]:
        """Return the program of several: its files, what a controller keeps for it, and what was executed of it.

        Raises:
            VerificationError: the program, read back and executed, is not what they are.
        """
        ...

    def judge(
        self, files: Mapping[str, str], own: Sequence[OwnProgram], *, kept: Mapping[str, str]
    ) -> tuple[tuple[VerificationError, ...], StackProof | None, StackSettings | None]:
        """Return what is wrong with such a program, what it did when executed, and how it is set to run."""
        ...

    def header_findings(self, files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
        """Yield where its header does not say these sentences."""
        ...

    def handling(
        self, one: str, count: int, settings: StackSettings | None, *, dry_only: bool, table: str
    ) -> list[tuple[str, list[str]]]:
        """Return how such a program is set, printed, stopped and begun again: labels and lines of the run sheet."""
        ...

    def loading(self, folders: str, file: str) -> str:
        """Return what a person loads: folders of the parts in words, and the file in the bundle."""
        ...
