"""Faults planted in what writes a program, one a function: `geoprint.check` alone has to find what they write.

A plate is planned once. What the arm reaches and what it keeps clear of are remembered, so that a faulty plan takes
again only what follows: speeds, targets, orders, switching and text. Whatever geoprint verifies of it by itself is left
out, and all faults are gone before `check` reads the files.
"""

from __future__ import annotations

import importlib
import inspect
import sys
import textwrap
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias, final

import numpy as np
import pytest

import geoprint
from geoprint.config import job_of
from geoprint.geometry.files import save_ply
from geoprint.model import JointPath, PoseStream, Program
from geoprint.postprocessor import Orders
from geoprint.postprocessor.rapid import post_processor, program
from geoprint.postprocessor.rapid.verify import judge_program
from geoprint.robot.collision import ClearanceCheck
from geoprint.robot.timing import knots, retiming
from geoprint.workflow import planning, saving
from tests.meshes import plate
from tests.workflow.test_checking import cell_text

# So few lines a module that the program of the plate is loaded in two parts.
SHORT_MODULE = 75


def stations(cell: str) -> str:
    """Prime the nozzle, and flood the part."""
    for table, first in (("purge", "joints_deg = [40"), ("flood", "joints_deg = [0,")):
        cell = cell.replace(f"# [{table}]", f"[{table}]").replace(f"# {first}", first)
    return cell.replace("# duration_s", "duration_s")


VALVE = {"valve_open_s": 0.05, "valve_close_s": 0.08, "uv_lead_s": 0.02, "uv_tail_s": 0.03, "vacuum": '"doVacuum"'}
FLOW = {"flow": '"aoFlow"', "flow_per_mm3_s": 0.1, "flow_lag_s": 0.05, "uv_lead_s": 0.02, "uv_tail_s": 0.03}
CELLS: dict[str, Callable[[], str]] = {
    "valve": lambda: stations(cell_text(lags=VALVE)),
    "flow": lambda: stations(cell_text(lags=FLOW, mode="analog")),
    "loading": cell_text,
}

# Module, function, words of its source, and what the fault has in their place.
Fault: TypeAlias = tuple[str, str, str, str]
FAULTS: dict[str, tuple[Fault, ...]] = {
    "valve": (
        # Where outputs switch.
        ("postprocessor.switching", "switching_events", "_placed(orders, moment,", "_placed(orders, moment - 0.02,"),
        ("postprocessor.switching", "_moments", "start - signals.valve_open", "start + signals.valve_open"),
        ("postprocessor.switching", "_within_ramps", "span[0] + begins", "span[0]"),
        ("postprocessor.switching", "_lamp_moments", "max(start, before)", "start + 0.5"),
        ("postprocessor.switching", "_placed", "min(distance, length)", "max(distance - 0.3, 0.0)"),
        ("rapid.writing", "triggers_of", '"geoOn" if event.on', '"1" if event.on'),
        # The path.
        ("rapid.program", "_written", "orders.runs[-1]) + 1", "orders.runs[-1])"),
        ("rapid.program", "_name_shared_data", "(orders.speeds,", "(1.02 * orders.speeds,"),
        ("rapid.program", "_plain", "decimals=5", "decimals=1"),
        ("rapid.program", "_moves", "orders.tips, writing.POSITION_DECIMALS", "orders.tips, 1"),
        ("rapid.program", "_unit", "return quaternions", "return quaternions[:, [0, 2, 1, 3]]"),
        ("rapid.program", "_procedures", "GeoEnter {number}", "GeoEnter 1"),
        ("rapid.program", "_print_modules", "GeoBegin {last_run}", "GeoBegin 1"),
        ("rapid.program", "_module", "MODULE {name}", "MODULE {name}(NOSTEPIN)"),
        # The cell's module, the guard, and what a controller needs.
        ("rapid.cell_module", "header_lines", "runs: {runs}", "runs: {runs + 1}"),
        ("rapid.cell_module", "cell_module", "0.0, LIFT", "0.0, -LIFT"),
        ("rapid.cell_module", "guard_module", "stacked=stacked", "stacked=not stacked"),
        ("rapid.cell_module", "program_file", "for name in modules", "for name in modules[:-1]"),
        ("rapid.cell_module", "_tooldata", "(tool.cog,", "(-tool.cog,"),
        ("rapid.cell_module", "_frame_limits", "_FRAME_SHARE * ", ""),
        ("rapid.cell_module", "_jointtarget", "np.degrees(joints)", "np.degrees(joints) + 0.1"),
        ("rapid.cell_module", "_seconds", "max(duration,", "max(0.5 * duration,"),
        ("rapid.cell_module", "_prime_data", "cell.purge.duration", "2.0 * cell.purge.duration"),
        ("rapid.cell_module", "_flood_data", "cell.flood.duration", "0.1 * cell.flood.duration"),
        ("rapid.writing", "comment", "for character in text", "for character in text.upper()"),
        ("rapid.writing", "number", "round(value, decimals)", "round(value, decimals - 2)"),
        ("rapid.writing", "significant", ".6G", ".1G"),
        ("rapid.writing", "array", "for value in values", "for value in list(values)[::-1]"),
        ("rapid.writing", "pose", "T_a_b[:3, :3]", "T_a_b[:3, :3].T"),
        ("rapid.writing", "rounded_down", "np.floor(values", "np.ceil(values"),
        ("rapid.writing", "output_names", 'signals.dispenser, what="signals.dispenser"',
            'signals.uv_lamp, what=""'),
        ("rapid.writing", "output_words", "str(sum_of)", "str(sum_of + 1)"),
        ("rapid.templates", "filled", "<= set(holding)", "<= {*holding} - {'vacuum'}"),
        ("rapid.templates", "conditions", '{"prime"} if', "set() if"),
        ("rapid.controller_files", "controller_files", '", ".join(names.values())', '""'),
        # Orders and tables.
        ("postprocessor.ordering", "orders_of", "zones=targets.zones", "zones=0.5 * targets.zones"),
        ("postprocessor.tables", "targets_table", "orders.zones", "0.5 * orders.zones"),
        ("postprocessor.tables", "_pose_rows", "poses.normals", "-poses.normals"),
        ("postprocessor.tables", "_trajectory_rows", "trajectory.joints", "trajectory.joints + 1e-3"),
        ("postprocessor.tables", "table_bytes", "(block[:, column], places)", "(block[:, column], places - 3)"),
        ("postprocessor.setup_file", "_written", "value.tolist()", "np.round(value, 2).tolist()"),
        # Targets.
        ("robot.controller.targets", "written_targets", "tolerance=tolerance", "tolerance=50.0 * tolerance"),
        ("robot.controller.targets", "close_targets", "(times < period", "(times > period"),
        ("robot.controller.targets", "_speeds", "np.minimum(planned", "0.8 * np.minimum(planned"),
        ("robot.controller.fitting", "zones_of", "nearer / 2.0", "0.4 * nearer"),
        ("robot.controller.lifted", "lifted_path", "], lift,", "], 0.5 * lift,"),
        ("robot.controller.lifted", "lifted_joints", "joints[raised]", "joints[raised] + 1.6"),
        # The motion.
        ("robot.timing.print_speed", "_Search.timed", "process=process, known",
            "process=replace(process, speed=1.05 * speed), known"),
        ("robot.timing.print_speed", "ramp_delay", "times[end] - times[0]", "2.0 * (times[end] - times[0])"),
        ("robot.timing.retiming", "_home_motion", "process.joint_speed_share *", "2.0 * process.joint_speed_share *"),
        ("robot.timing.retiming", "_passing_times", "start + leg.times_at", "start + 0.02 + leg.times_at"),
        ("robot.timing.retiming", "_sampled", "times[low:high] - start", "0.98 * (times[low:high] - start)"),
        ("robot.timing.retiming", "_labels", "between & deposit[", "between & ~deposit["),
        ("robot.timing.knots", "path_knots", "process.speed, process.travel_speed",
            "2.0 * process.speed, process.travel_speed"),
        ("robot.timing.topp", "straight_motion", "(accelerations[moved]", "(4.0 * accelerations[moved]"),
        ("robot.timing.topp", "fastest_motion", "factor = ", "path_speeds = 1.5 * path_speeds\n    factor = "),
        ("robot.timing.topp", "_times", "2.0 * np.diff", "1.8 * np.diff"),
        ("robot.timing.topp", "at_grid", "return np.minimum(", "return 1.2 * np.minimum("),
        ("robot.timing.topp", "largest_speeds", "return speeds,", "return 0.9 * speeds,"),
        ("robot.timing.moments", "tips_at", "joints, moments)", "joints, moments + 0.01)"),
        ("robot.timing.moments", "joints_at", "np.interp(moments,", "np.interp(moments - 0.01,"),
    ),
    "flow": (
        ("rapid.writing", "_flow_triggers", "signals.flow_per_mm3_s *", "1.03 * signals.flow_per_mm3_s *"),
        ("postprocessor.ordering", "_mean_flow", "/ 2.0)", "/ 2.1)"),
        ("rapid.cell_module", "_prime_data", "float(orders.flow.max())", "2.0 * float(orders.flow.max())"),
    ),
    "loading": (
        ("rapid.program", "_loading_main", "    WaitLoad geoLoading;\" for", "    StopMove;\" for"),
        ("rapid.program", "_start_load", "diskhome", "disktemp"),
        ("rapid.program", "_written", 'not name.startswith("GeoPath")', "name"),
    ),
}  # fmt: skip
# A speed below the ceiling, and a flow within its bounds, are free to choose; what plan.json says of the motion is
# measured by planning. These faults are found by `check --full`, which plans again.
CHOICES: dict[str, tuple[Fault, ...]] = {
    "valve": (
        ("robot.timing.print_speed", "timed_print", "search.highest_of_joints())", "5.0)"),
        ("robot.timing.retiming", "retime", "found.share_at_speed", "1.0"),
        ("robot.timing.slowdown", "speed_profile", "at_speed / total", "0.5 * at_speed / total"),
        ("robot.timing.moments", "largest_jerk", "JERK_TIME**3", "(2.0 * JERK_TIME) ** 3"),
        ("robot.timing.knots", "off_moves", "OffMoves(float(max(tip_off", "OffMoves(0.5 * float(max(tip_off"),
    ),
    "flow": (("process.bead", "following_flow", "shares * spacing", "1.05 * shares * spacing"),),
}  # fmt: skip


def the_same(found: object, *_: object, **__: object) -> object:
    return found


def nothing(*_: object, **__: object) -> None:
    """Verify nothing."""


@final
class Remembering:
    """Lets functions give from the second plan on what they gave in the first, call by call."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, int], Any] = {}
        self._calls: dict[str, int] = {}

    def begin(self) -> None:
        """Begin a plan."""
        self._calls.clear()

    def __call__(self, real: Any, again: Callable[..., Any] = the_same) -> Callable[..., Any]:
        """Return a function that remembers; `again` fits what it gave to other arguments."""

        def called(*given: Any, **named: Any) -> Any:
            number = self._calls[real.__qualname__] = self._calls.get(real.__qualname__, 0) + 1
            key = (real.__qualname__, number)
            if key in self._known:
                return again(self._known[key], *given, **named)
            self._known[key] = real(*given, **named)
            return self._known[key]

        return called


@contextmanager
def unverified(kind: str) -> Generator[Remembering]:
    """Let geoprint write what it has not verified, and plan again only what comes after the arm's reach."""

    def with_flow(found: JointPath, poses: PoseStream, *_: object, **__: object) -> JointPath:
        return replace(found, poses=replace(found.poses, flow=poses.flow))

    def proof(written: Program, orders: Orders, **known: Any) -> object:
        return judge_program(written.modules, orders, **known)[1]

    def as_judged(found: object, *given: Any, **named: Any) -> object:
        return proof(*given, **named) or found

    remembering = Remembering()
    with pytest.MonkeyPatch.context() as patch:
        for name in ("prepare_workpiece", "measured_covers", "clearance_check", "leaning_of"):
            patch.setattr(planning, name, remembering(getattr(planning, name)))
        patch.setattr(planning, "reach", remembering(planning.reach, with_flow))
        patch.setattr(ClearanceCheck, "__call__", remembering(ClearanceCheck.__call__))
        patch.setattr(post_processor, "verify_program", remembering(proof, as_judged))
        for module, name in (
            (planning, "check_timeline"), (post_processor, "check_times"), (planning, "_check_deposit"),
            (saving, "verify_files"), (retiming, "verify"), (retiming, "_confirm_longest"),
        ):  # fmt: skip
            patch.setattr(module, name, nothing)
        patch.setattr(knots, "LARGEST_OFF", np.inf)
        patch.setattr(knots, "LARGEST_TURN", np.inf)
        if kind == "loading":
            patch.setattr(program, "MODULE_LINES", SHORT_MODULE)
        yield remembering


@contextmanager
def planted(fault: Fault) -> Generator[None]:
    """Change the source of a function, or of a method, wherever it is imported."""
    module, name, old, new = fault
    inside = importlib.import_module(
        f"geoprint.postprocessor.{module}" if module.startswith("rapid.") else f"geoprint.{module}"
    )
    owner, _, attribute = name.rpartition(".")
    holder: Any = getattr(inside, owner) if owner else inside
    real = inspect.getattr_static(holder, attribute)
    source = textwrap.dedent(inspect.getsource(real))
    assert old in source, f"{name} does not hold {old!r}"
    made: dict[str, Any] = {}
    exec(f"from __future__ import annotations\n{source.replace(old, new, 1)}", vars(inside), made)  # noqa: S102
    with pytest.MonkeyPatch.context() as patch:
        for each in [holder] if owner else [one for path, one in sys.modules.items() if path.startswith("geoprint")]:
            for known in [known for known, value in vars(each).items() if value is real]:
                patch.setattr(each, known, made[attribute])
        yield


def contents(folder: Path) -> dict[str, bytes]:
    """Return what a bundle holds, but for its hashes and the times that planning took."""
    apart = {"timings.json", "manifest.json"}
    files = [path for path in folder.rglob("*") if path.is_file() and path.name not in apart]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.mark.slow
@pytest.mark.parametrize("kind", CELLS)
def test_check_alone_finds_what_a_fault_in_the_writer_writes(kind: str, tmp_path: Path) -> None:
    save_ply(plate((10.0, 8.0), (10, 8), jitter_seed=1), tmp_path / "plate.ply")
    (tmp_path / "cell.toml").write_text(CELLS[kind]())
    job = job_of(
        surface=tmp_path / "plate.ply", cell=tmp_path / "cell.toml", unit="mm", spacing=2.0, backend="heat",
        middle="plain",
    )  # fmt: skip
    faults = (*FAULTS[kind], *CHOICES.get(kind, ()))
    with unverified(kind) as remembering:
        timed_print = remembering(planning.timed_print)

        def written(name: str, *, fault_in: str = "") -> Path:
            remembering.begin()
            with pytest.MonkeyPatch.context() as patch:
                # No time follows from what is written of it.
                if fault_in.startswith(("postprocessor.", "rapid.")):
                    patch.setattr(planning, "timed_print", timed_print)
                geoprint.plan(job).save(tmp_path / name)
            return tmp_path / name

        first, right = written("first"), written("right", fault_in="postprocessor.")
        assert contents(first) == contents(right)
        folders: list[Path] = []
        for number, fault in enumerate(faults):
            with planted(fault):
                folders.append(written(str(number), fault_in=fault[0]))
    assert geoprint.check(right).findings == ()
    assert [fault for fault, wrong in zip(faults, folders, strict=True) if contents(wrong) == contents(right)] == []
    missed = [
        fault
        for fault, wrong in zip(faults, folders, strict=True)
        if not geoprint.check(wrong, full=fault not in FAULTS[kind]).findings
    ]
    assert missed == []


def test_a_fault_is_planted_in_at_least_sixty_functions() -> None:
    every = [fault for kind in (FAULTS, CHOICES) for faults in kind.values() for fault in faults]
    assert len({(module, name) for module, name, _, _ in every}) >= 60
