"""What is found of a program that was read back and executed, in whichever dialect it is written."""

from __future__ import annotations

from typing import final

from geoprint.errors import VerificationError
from geoprint.model import Cell, Count, Placement, Rounded, comparable, frozen, recorded


@final
@recorded("NotExecutedRecord")
class NotExecuted:
    """Lines of a module that nothing here executed, for one reason.

    Attributes:
        file: name of the file of the program, or of what a controller keeps for it.
        lines: numbers of the lines, from 1.
        reason: event that alone leads to these lines.
    """

    file: str
    lines: tuple[Count, ...]
    reason: str


@final
@recorded(
    "ExecutedRecord",
    statements="lines", executed="lines_executed", motion="largest_motion_mm", move_time="largest_move_time_s",
    run_time="largest_run_time_share", outputs="largest_output_mm",
)  # fmt: skip
class Executed:
    """What was executed of a program, in figures.

    Attributes:
        scenarios: scenarios in which the program was run, in words.
        statements: number of lines with statements in the program's modules.
        executed: number of lines of which each statement was executed in at least one scenario.
        not_executed: lines with statements that were not executed, by reason.
        motion: largest distance of a target from where the plan has it [mm].
        move_time: largest difference of the time of a move from the planned one [s]; corners are passed as their
            parabolas are long, ramps are left out.
        run_time: largest difference of the time of a run's moves from the planned one, as a share of the run's time.
        outputs: largest distance of the place where an output switches from where the plan has it [mm].
        not_known: list of what no simulation knows.
    """

    scenarios: tuple[str, ...]
    statements: Count
    executed: Count
    not_executed: tuple[NotExecuted, ...]
    motion: Rounded
    move_time: Rounded
    run_time: Rounded
    outputs: Rounded
    not_known: tuple[str, ...]


@final
@recorded("SettingsNow")
class Settings:
    """How a program is set.

    Attributes:
        dry_run: whether the program runs dry.
        speed_pct: speed of the program, in per cent of the planned one.
        first_run: number of the run from which on the program prints, from 1.
    """

    dry_run: bool
    speed_pct: float
    first_run: int


@final
@recorded("StackSettingsNow")
class StackSettings:
    """How the program of a stack is set.

    Attributes:
        dry_run: whether the program runs dry.
        speed_pct: speed of the program, in per cent of the planned one.
        first_layer: number of the layer from which on the program prints, from 1.
        first_run: number of the run of the first layer from which on the program prints, from 1.
        last_layer: number of the layer after which the program ends.
    """

    dry_run: bool
    speed_pct: float
    first_layer: int
    first_run: int
    last_layer: int


@final
@frozen
class OwnProgram:
    """The program of a layer by itself, or of one of its attitudes, which was verified.

    Attributes:
        layer: number of the layer.
        folder: of its modules in the program of all.
        modules: file and text of each.
        cell: that it is for.
        placement: where the part stands.
    """

    layer: int
    folder: str
    modules: tuple[tuple[str, str], ...]
    cell: Cell
    placement: Placement


@final
@comparable
class StackProof:
    """What was executed of the program of a stack.

    Attributes:
        scenarios: how it was run, in words.
        refused: likewise, where it ended before anything moved, as it must.
        statements: how many lines of GeoStack hold some.
        executed: how many of these were executed in at least one scenario.
        runs: of each layer, how many.
        seconds: of each layer as it prints, from home to home [s].
    """

    scenarios: tuple[str, ...]
    refused: tuple[str, ...]
    statements: int
    executed: int
    runs: tuple[int, ...]
    seconds: tuple[float, ...]


@final
@comparable
class Switched:
    """A switching of an output by a program.

    Attributes:
        time: by the clock of the planned motion, which has no waits but that before the switching itself [s].
        signal: name of the output, in small letters.
        on: whether the output is switched on.
        file: where this is written: name of the file.
        line: number of the line there, from 1.
    """

    time: float
    signal: str
    on: bool
    file: str
    line: int


def refusal(file: str, line: int, reason: str) -> VerificationError:
    """Return the error that names a line of a program and what is wrong there."""
    return VerificationError(
        f"{file}, line {line}: {reason}. Do not run this program; write it again from its plan.",
        module=file,
        line=line,
        reason=reason,
    )
