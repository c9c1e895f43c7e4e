"""URScript as a post-processor: what writes, reads and executes it, under the names that all dialects share.

What a run sheet says of a script, and the page about the controller before the first load, are written here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from importlib import resources
from typing import ClassVar, final

import numpy as np

from geoprint.errors import Faults, UsageError, VerificationError
from geoprint.model import Cell, ControllerPath, Dispensing, JointPath, Placement, Program, Targets
from geoprint.postprocessor.execution import Settings, refusal
from geoprint.postprocessor.expected import expected_events
from geoprint.postprocessor.interface import Execution, Handling, RobotProgram
from geoprint.postprocessor.orders import Orders
from geoprint.postprocessor.tables import TrajectoryTable
from geoprint.postprocessor.urscript.dispensing import dispensing_of
from geoprint.postprocessor.urscript.executed import execution_of
from geoprint.postprocessor.urscript.forms import read_script
from geoprint.postprocessor.urscript.guard import output_of
from geoprint.postprocessor.urscript.writing import written_script
from geoprint.robot.arm import Arm
from geoprint.robot.controller import controller_path

# Directions of the joint axes, and of the flange's z and x axes, of an arm of the maker with all joints at zero, in the
# controller's frame Base; calibration turns them by less than this [rad].
_AXES = np.array(
    [(0, 0, 1), (0, -1, 0), (0, -1, 0), (0, -1, 0), (0, 0, -1), (0, -1, 0), (0, -1, 0), (1, 0, 0)], dtype=np.float64
)
_CALIBRATED = 0.035
_PAGE = "first_load.md"
_BEFORE = "Before the first load, follow urscript/controller/first_load.md."
_COMPARED = "Checked: the text matches the plan: targets, speeds, blends, outputs, frames."


@final
class UrScript:
    """A script for controllers of Universal Robots; as `PostProcessor`."""

    title: ClassVar[str] = "URScript for arms of Universal Robots"
    joining: ClassVar[None] = None

    def check_cell(self, cell: Cell) -> None:
        """Refuse outputs that no UR controller has, a table, and a flow that follows the speed."""
        faults = Faults()
        for held, what in (
            (cell.table is not None, "[table] needs programs of several parts, which URScript here does not join"),
            (
                cell.signals.mode == "analog",
                "signals.mode 'analog' needs a flow that leads the speed, which no script does: take 'io'",
            ),
        ):
            with faults.noting():
                if held:
                    raise UsageError(f"{what}.")
        for name in (cell.signals.dispenser, cell.signals.uv_lamp, cell.signals.vacuum):
            with faults.noting():
                if name is not None:
                    output_of(name)
        faults.refuse("no URScript program serves this cell")

    def check_arm(self, arm: Arm) -> None:
        """Refuse an arm that is none of Universal Robots, or counts its joints otherwise."""
        screws = arm.screws()
        found = [*screws.directions, screws.T_base_flange[:3, 2], screws.T_base_flange[:3, 0]]
        turned = [float(np.arccos(np.clip(axis @ known, -1.0, 1.0))) for axis, known in zip(found, _AXES, strict=True)]
        # The lower arm lies along negative x.
        behind = float(screws.nearest(2, 1)[0] - screws.nearest(1, 2)[0]) < 0.0
        if max(turned) > _CALIBRATED or not behind:
            raise UsageError(
                f"a URScript program is impossible for the arm {arm.robot.model}: its joints, base or flange are not "
                "those of Universal Robots' controllers. Write its URDF in their frame Base, or state "
                '`post_processor = "joint-trajectory"` under [robot].'
            )

    def driven(self, joint_path: JointPath, targets: Targets, motion: TrajectoryTable, arm: Arm) -> ControllerPath:
        """Return the straight moves between targets with their rounded corners, from home to home."""
        del motion
        return controller_path(joint_path, targets, arm)

    def write(self, program: RobotProgram, cell: Cell) -> tuple[Program, Execution]:
        """Write the script, and execute it as it reads."""
        written = written_script(program, cell)
        speed, orders = cell.process.speed, program.orders
        events = expected_events(orders, signals=cell.signals, tips_at=program.tips_at, speed=speed)
        execution = execution_of(dict(written.modules), program, cell, events, new=True)
        for finding in execution.findings:
            raise finding
        return written, execution

    def kept(
        self, cell: Cell, *, placement: Placement, names: Sequence[str], folders: Sequence[str] = ()
    ) -> dict[str, str]:
        """Return the page about what the controller must be set to, and what to try before the first print."""
        del names, folders
        return {_PAGE: _first_load(cell, placement)}

    def kept_findings(
        self,
        files: Mapping[str, str],
        cell: Cell,
        *,
        placement: Placement,
        names: Sequence[str],
        folders: Sequence[str] = (),
    ) -> Iterator[VerificationError]:
        """Yield where the page is missing, says something else, or another file lies beside it."""
        del names, folders
        for name in sorted(files.keys() - {_PAGE}):
            yield refusal(f"controller/{name}", 1, "this file belongs to no URScript program")
        found, wanted = files.get(_PAGE, "").split("\n"), _first_load(cell, placement).split("\n")
        for number, line in enumerate(wanted, start=1):
            if number > len(found) or found[number - 1] != line:
                yield refusal(f"controller/{_PAGE}", number, f"it must say {line[:60]!r} here")
                return

    def parse(self, files: Sequence[tuple[str, str]]) -> None:
        """Read a script whose cell nobody knows."""
        read_script(dict(files))

    def as_written(self, name: str, text: str) -> str:
        """Return the script with the settings of a new program, where they are plain values."""
        del name
        for setting, value in (("geo_dry_run", "True"), ("geo_speed_pct", "25"), ("geo_first_run", "1")):
            text = re.sub(rf"(?m)^(  global {setting} = )[A-Za-z0-9.]+$", rf"\g<1>{value}", text)
        return text

    def execute(self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell) -> Execution:
        """Execute the script dry, printing, resumed and stopped."""
        return execution_of(dict(files), program, cell, program.events)

    def check(
        self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell, *, kept: Mapping[str, str]
    ) -> Execution:
        """Execute the script: its poses are held against the plan's in any case."""
        del kept
        return execution_of(dict(files), program, cell, program.events)

    def dispensing(self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell) -> Dispensing:
        """Return where the tip is when, and what valve is commanded, as executed."""
        return dispensing_of(read_script(dict(files)), program, cell)

    def header_findings(self, files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
        """Yield where the comments at the head do not say what they must, or claim another check."""
        for name, text in sorted(files.items()):
            said: list[str] = []
            for line in text.split("\n"):
                if not line.startswith("# "):
                    break
                said.append(line[2:])
            wanted = [_ascii(sentence) for sentence in (*sentences, _COMPARED, _BEFORE)]
            for sentence in wanted:
                if sentence not in said:
                    yield refusal(name, 1, f"the header must say {sentence[:100]!r}")
            for sentence in said:
                if sentence.startswith(("Checked:", "Not checked:")) and sentence not in wanted:
                    yield refusal(name, 1, f"the header says {sentence[:100]!r}, plan.json does not")

    def handling(
        self, orders: Orders, cell: Cell, *, placement: Placement, names: Sequence[str], settings: Settings | None
    ) -> Handling:
        """Return how the script is loaded, set by its three settings, and started."""
        del orders
        outputs = [cell.signals.dispenser, cell.signals.uv_lamp, cell.signals.vacuum]
        named = ", ".join(name for name in outputs if name)
        steps = [
            "1. before the first load on a controller, follow urscript/controller/first_load.md: required",
            f"   outputs {named} go low at the end and at every stop of the program",
            "2. run it as written: dry, 20 mm higher, at 25 % (geo_dry_run True, geo_speed_pct 25)",
            "3. speed: movep keeps the tool's speed where the arm can; in blends and on short moves nobody promises it",
        ]
        if not placement.missing:
            steps.append(
                "4. to print: set geo_dry_run False and geo_speed_pct 100, speed slider 100 %; to resume at run k: "
                "clean the nozzle, set geo_first_run k, start anew"
            )
        return Handling(
            loading=(f"load {names[0]} as a Script node of kind File, and call geoprint() in a Script line behind it",),
            settings=() if settings is None else (_set_to(placement, settings),),
            steps=tuple(steps),
        )


def _ascii(text: str) -> str:
    return "".join(letter if " " <= letter <= "~" else "?" for letter in text)


def _set_to(placement: Placement, settings: Settings) -> str:
    """Say how the program would run now, by its three settings."""
    if settings.dry_run or placement.missing:
        return f"run dry at {settings.speed_pct:g} % speed (geo_dry_run {settings.dry_run})"
    if settings.speed_pct != 100.0:
        return "it will refuse to print: printing needs geo_speed_pct 100"
    return f"PRINT at 100 % speed, from run {settings.first_run} (geo_dry_run False)"


def _first_load(cell: Cell, placement: Placement) -> str:
    """Return the page about what a controller must be set to, and what to try before the first print.

    Args:
        cell: its outputs.
        placement: whether all of it was stated.
    """
    signals = cell.signals
    words = {
        "<ARM>": cell.robot.model,
        "<VALVE>": signals.dispenser,
        "<LAMP>": signals.uv_lamp,
        "<VACUUM>": signals.vacuum or "",
    }
    holds = {"known": not placement.missing, "unknown": bool(placement.missing), "vacuum": signals.vacuum is not None}
    lines: list[str] = []
    text = resources.files("geoprint.postprocessor.urscript").joinpath("first_load.md").read_text(encoding="ascii")
    for line in text.split("\n"):
        condition, _, rest = line.partition("|")
        if condition.startswith("@") and condition[1:] in holds:
            if holds[condition[1:]]:
                lines.append(rest)
        else:
            lines.append(line)
    page = "\n".join(lines)
    for word, value in words.items():
        page = page.replace(word, value)
    return page
