"""Joint trajectories as a post-processor: for every arm that has no dialect, speeds and clearance are proven alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar, final

import numpy as np

from geoprint.errors import Faults, UsageError, VerificationError
from geoprint.model import (
    Cell,
    ControllerPath,
    Dispensing,
    JointPath,
    Placement,
    Program,
    Targets,
)
from geoprint.postprocessor.execution import Settings, refusal
from geoprint.postprocessor.expected import expected_events, expected_waits
from geoprint.postprocessor.interface import Execution, Handling, RobotProgram
from geoprint.postprocessor.orders import Orders, dispensing_along
from geoprint.postprocessor.tables import TrajectoryTable
from geoprint.postprocessor.trajectory.playing import Clock, execution_of, read_back, tips_of
from geoprint.postprocessor.trajectory.reading import comments, read_samples
from geoprint.postprocessor.trajectory.writing import written_trajectory
from geoprint.robot.arm import Arm

# The collision check looks at the tip so often [mm].
STEP = 0.4


@final
class JointTrajectory:
    """Joints over time with timed outputs; as `PostProcessor`."""

    title: ClassVar[str] = "joint trajectories as CSV and ROS 2 messages, for every arm"
    joining: ClassVar[None] = None

    def check_cell(self, cell: Cell) -> None:
        """Refuse what a motion without a program cannot do: ask, prime, expose, or follow the speed with a flow."""
        faults = Faults()
        for held, what in (
            (cell.table is not None, "[table] needs a program that asks for each attitude"),
            (cell.purge is not None, "[purge] needs a program that primes the nozzle: prime it by hand"),
            (
                cell.flood is not None and cell.flood.joints is not None,
                "[flood] with joints needs a program",
            ),
            (cell.signals.sets_flow, "signals.mode 'analog' needs a controller that follows its speed: take 'io'"),
        ):
            with faults.noting():
                if held:
                    raise UsageError(f"{what}.")
        faults.refuse("a joint trajectory has no program")

    def check_arm(self, arm: Arm) -> None:
        """Refuse nothing: joints are what the URDF counts."""

    def driven(self, joint_path: JointPath, targets: Targets, motion: TrajectoryTable, arm: Arm) -> ControllerPath:
        """Return the timed motion itself, so densely that the tip moves little from row to row."""
        del joint_path, targets
        tips = arm.tool_poses(motion.joints)[:, :3, 3]
        passed = np.floor(np.append(0.0, np.cumsum(np.linalg.norm(np.diff(tips, axis=0), axis=1))) / STEP)
        keep = np.append(np.True_, np.diff(passed) > 0.0)
        keep[1:] |= (np.diff(motion.runs) != 0) | (np.diff(motion.deposit.astype(np.int8)) != 0)
        keep[-1] = True
        rows = np.flatnonzero(keep)
        return ControllerPath(
            joints=motion.joints[rows],
            runs=motion.runs[rows],
            deposit=motion.deposit[rows],
            rounding=np.zeros((rows.size, motion.joints.shape[1])),
            step=float(np.linalg.norm(np.diff(tips[rows], axis=0), axis=1).max()),
        )

    def write(self, program: RobotProgram, cell: Cell) -> tuple[Program, Execution]:
        """Write the files, and play them as they read."""
        written = written_trajectory(program, cell)
        speed, orders = cell.process.speed, program.orders
        events = expected_events(orders, signals=cell.signals, tips_at=program.tips_at, speed=speed)
        execution = execution_of(dict(written.modules), program, cell, events)
        for finding in execution.findings:
            raise finding
        return written, execution

    def kept(
        self, cell: Cell, *, placement: Placement, names: Sequence[str], folders: Sequence[str] = ()
    ) -> dict[str, str]:
        """Return nothing: no controller keeps anything for a motion."""
        del cell, placement, names, folders
        return {}

    def kept_findings(
        self,
        files: Mapping[str, str],
        cell: Cell,
        *,
        placement: Placement,
        names: Sequence[str],
        folders: Sequence[str] = (),
    ) -> Iterator[VerificationError]:
        """Yield that a file belongs to no motion."""
        del cell, placement, names, folders
        return (refusal(name, 1, "this file belongs to no joint trajectory") for name in sorted(files))

    def parse(self, files: Sequence[tuple[str, str]]) -> None:
        """Read the samples of an arm that nobody knows: what names the joints have is not asked."""
        texts = dict(files)
        lines = texts.get("joint_trajectory.yaml", "").split("\n")
        base = next((line.removeprefix("  frame_id: ") for line in lines if line.startswith("  frame_id: ")), "")
        named = [line.removeprefix("- ") for line in lines if line.startswith("- ") and ":" not in line]
        read_samples(texts, names=named, base=base)

    def as_written(self, name: str, text: str) -> str:
        """Return a file as it is: a motion has no switches."""
        del name
        return text

    def execute(self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell) -> Execution:
        """Play the motion with its outputs."""
        return execution_of(dict(files), program, cell, program.events)

    def check(
        self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell, *, kept: Mapping[str, str]
    ) -> Execution:
        """Play the motion, which is held against the plan's rows in any case."""
        execution = execution_of(dict(files), program, cell, program.events)
        more = tuple(self.kept_findings(kept, cell, placement=program.placement, names=()))
        return Execution((*more, *execution.findings), execution.executed, execution.switched, execution.lines)

    def dispensing(self, files: Sequence[tuple[str, str]], program: RobotProgram, cell: Cell) -> Dispensing:
        """Return where the tip is when, and what valve and lamp are commanded, by the player's clock."""
        samples, switched = read_back(dict(files), program, cell)
        orders, clock = program.orders, Clock(program.orders, expected_waits(program.orders, cell.signals))
        times = program.motion.times
        rows = np.flatnonzero((times >= orders.times[0]) & (times <= orders.times[-1]))
        moments = clock.played(times[rows])
        tips = tips_of(samples.played(moments)[0], program, cell)
        moves = np.clip(np.searchsorted(orders.times, times[rows]), 1, orders.count - 1)
        valve = [each for each in switched if each.signal == cell.signals.dispenser.lower()]
        return dispensing_along(
            orders, times=moments, tips=tips, moves=moves, runs=orders.runs[moves],
            valve=[(each.time, each.on) for each in valve],
        )  # fmt: skip

    def header_findings(self, files: Mapping[str, str], sentences: Sequence[str]) -> Iterator[VerificationError]:
        """Yield where the comments of the message do not say what they must, or claim another check."""
        said = comments(files)
        wanted = ["".join(letter if " " <= letter <= "~" else "?" for letter in sentence) for sentence in sentences]
        for sentence in wanted:
            if sentence not in said:
                yield refusal("joint_trajectory.yaml", 1, f"the comments must say {sentence[:100]!r}")
        for sentence in said:
            if sentence.startswith(("Checked:", "Not checked:")) and sentence not in wanted:
                yield refusal("joint_trajectory.yaml", 1, f"the comments say {sentence[:100]!r}, plan.json does not")

    def handling(
        self, orders: Orders, cell: Cell, *, placement: Placement, names: Sequence[str], settings: Settings | None
    ) -> Handling:
        """Return that there is no program, and what whoever plays the motion has to take care of."""
        del orders, settings
        switching = (
            "nothing may switch: outputs_withheld.csv says what would"
            if placement.missing
            else ("switch each output of outputs.csv at its time, counted from the first sample, within 2 ms")
        )
        return Handling(
            loading=(f"NO PROGRAM: {', '.join(names)}; speeds and clearance are proven, what plays them is not",),
            settings=("the planned speed, from home to home; there is no switch for a dry run",),
            steps=(
                "1. joints are those of the arm's URDF: where your arm is calibrated by itself, plan with its own URDF",
                f"2. bring the arm to home, joints {np.degrees(cell.robot.home).round(2).tolist()} degrees",
                "3. play it without material and with outputs disconnected, slowly, from the first sample on",
                f"4. {switching}",
                "5. whatever plays it must shut valve and lamp off at every stop: no file here does",
            ),
        )
