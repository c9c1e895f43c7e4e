"""What whoever stands at the robot should read before pressing start: one page about a bundle that was checked."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import asdict
from typing import final

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.account.checked import Checked
from geoprint.account.records.plan import DepositionRecord, PatchRecord
from geoprint.account.records.robot import ClearanceRecord, MotionRecord, SwitchingRecord
from geoprint.account.records.rounding import Record, as_json
from geoprint.account.robot_summary import record_switching
from geoprint.export import Json, Orders, Setup
from geoprint.export.rapid import Settings, Timeline
from geoprint.model import PASCAL_PER_KPA, FloatArray
from geoprint.surfaces import in_words

WIDTH, NARROW = 100, 60
_LABEL = 18


@final
class FindingRecord(Record):
    """Something that is wrong."""

    file: str = Field(description="of the bundle")
    line: int = Field(description="from 1")
    reason: str = Field(description="one sentence")


@final
class SettingsNow(Record):
    """How the program is set to run."""

    dry_run: bool = Field(description="whether it runs dry")
    speed_pct: float = Field(description="of the planned speed [%]")
    first_run: int = Field(description="from which on it prints, from 1")


@final
class CheckRecord(Record):
    """The result object of `geoprint check`."""

    bundle: str = Field(description="name of the folder")
    agrees: bool = Field(description="whether it is as it was planned")
    findings: tuple[FindingRecord, ...] = Field(description="what is wrong")
    set_to: SettingsNow | None = Field(default=None, description="left out where the program is not the plan's")
    switching: SwitchingRecord | None = Field(default=None, description="as in plan.json; left out likewise")
    extent_base_mm: tuple[tuple[float, ...], ...] | None = Field(
        default=None, description="lowest and highest x, y, z of the tip, in base coordinates [mm]"
    )


def check_summary(checked: Checked) -> dict[str, Json]:
    """Return the result object of `geoprint check`: lengths mm, angles degrees, times s."""
    setup, orders, settings, switching = checked.setup, checked.orders, checked.settings, checked.switching
    extent = None if setup is None or orders is None else _extent(setup, orders)
    return as_json(
        CheckRecord(
            bundle=checked.folder.name,
            agrees=not checked.findings,
            findings=tuple(FindingRecord(**asdict(finding)) for finding in checked.findings),
            set_to=None if settings is None else SettingsNow(**asdict(settings)),
            switching=None if switching is None else record_switching(switching),
            extent_base_mm=None if extent is None else tuple(tuple(corner.round(3).tolist()) for corner in extent),
        )
    )


def run_sheet(checked: Checked, *, width: int | None = None) -> str:
    """Return the page; where something was found, only that.

    Args:
        checked: a bundle.
        width: letters in a line, where they are counted; the page is never wider than 100.
    """
    setup, orders, settings, switching = checked.setup, checked.orders, checked.settings, checked.switching
    told = checked.told
    if checked.findings or told is None or not (setup and orders and settings and switching):
        return "\n".join(f"{each.file}, line {each.line}: {each.reason}" for each in checked.findings)
    robot = told.robot[0]
    lines = [f"RUN SHEET  {told.input.name}  ({checked.folder.name})", ""]
    for label, texts in (
        ("program", _program(setup, orders, modules=robot.program.modules)),
        ("is set to", _settings(setup, settings)),
        ("patches", _patches(told.patches)),
        ("placement", _placement(setup)),
        ("extent", _reach(setup, orders, robot.motion)),
        ("closest approach", _closest(robot.clearance)),
        ("signals", _signals(setup, switching)),
        ("process", _process(setup, told.deposition)),
        ("limits", _limits(setup, robot.motion)),
        ("before start", _steps(setup, orders)),
        ("not checked", ["; ".join(robot.clearance.not_checked) + "; the real cell."]),
    ):
        lines += _entry(label, texts, width=min(width or WIDTH, WIDTH)) if texts else []
    return "\n".join(lines)


def _entry(label: str, texts: Sequence[str], *, width: int) -> list[str]:
    """Return a label with its texts beside it, or below it where a line is short."""
    if width < NARROW:
        return [
            label,
            *(
                line
                for text in texts
                for line in textwrap.wrap(text, width, initial_indent="  ", subsequent_indent="    ")
            ),
        ]
    wrapped = [line for text in texts for line in textwrap.wrap(text, width - _LABEL)]
    return [f"{name:<{_LABEL}}{line}" for name, line in zip([label, *[""] * len(wrapped)], wrapped, strict=False)]


def _program(setup: Setup, orders: Orders, *, modules: Sequence[str]) -> list[str]:
    loaded = sum(name.startswith("GeoPath") for name in modules)
    copies = f"; copy the {loaded} GeoPath modules to the controller's HOME folder" if loaded else ""
    dry = "; RUNS DRY ONLY" if setup.placement.missing else ""
    return [
        (
            f"{int(orders.runs[-1]) + 1} runs, {orders.count} targets ({orders.shortest_move:.2g} mm and more apart), "
            f"{orders.duration:.0f} s at full speed{dry}"
        ),
        f"load GeoPrint.pgf ({len(modules) - 1 - loaded} modules){copies}",
    ]


def _settings(setup: Setup, settings: Settings) -> list[str]:
    """Say how the program would run now, by its three switches."""
    if settings.dry_run or setup.placement.missing:
        return [f"run dry at {settings.speed_pct:g} % of the speed (geoDryRun {str(settings.dry_run).upper()})"]
    texts = [f"PRINT at {settings.speed_pct:g} % of the speed, from run {settings.first_run} on (geoDryRun FALSE)"]
    if setup.cell.signals.mode == "io" and settings.speed_pct != 100.0:
        texts.append("it will refuse to: at a fixed pressure it prints only with geoSpeedPct 100")
    return texts


def _patches(patches: Sequence[PatchRecord]) -> list[str]:
    """Name each of several patches by its runs, numbered as the controller does, so that printing can begin at one."""
    if len(patches) < 2:
        return []
    return [
        f"{number}: runs {patch.runs[0] + 1} to {patch.runs[1] + 1}, {patch.area_mm2:.4g} mm2 about "
        f"{in_words(np.array(patch.place_mm, dtype=np.float64))}, spacing CV "
        + ("none (one level)" if patch.spacing.cv is None else f"{patch.spacing.cv:.2%}")
        for number, patch in enumerate(patches, start=1)
    ]


def _placement(setup: Setup) -> list[str]:
    placement = setup.placement
    texts = [f"NOT KNOWN: nobody has stated {' and '.join(placement.missing)}"] if placement.missing else []
    if placement.calibrated:
        texts.append(f"fixture calibrated, touched points miss by at most {placement.misses.max(initial=0.0):.2f} mm")
    if placement.part_stated:
        texts.append(f"part on the fixture, as stated: {_frame(placement.T_fixture_work)}")
    if setup.surface_within is not None:
        texts.append(f"surface known within {setup.surface_within:.2f} mm along its normal (95 %)")
    return [*texts, f"part in base coordinates: {_frame(placement.T_base_work)}"]


def _frame(T: FloatArray) -> str:
    x, y, z = T[:3, 3]
    roll, pitch, yaw = Rotation.from_matrix(T[:3, :3]).as_euler("xyz", degrees=True)
    return f"its origin at ({x:.2f}, {y:.2f}, {z:.2f}) mm, turned ({roll:.2f}, {pitch:.2f}, {yaw:.2f}) degrees"


def _extent(setup: Setup, orders: Orders) -> tuple[np.ndarray, np.ndarray]:
    tips = transforms.apply(setup.placement.T_base_work, orders.tips)
    return tips.min(axis=0), tips.max(axis=0)


def _reach(setup: Setup, orders: Orders, motion: MotionRecord) -> list[str]:
    low, high = _extent(setup, orders)
    spans = ", ".join(f"{axis} {a:.1f} to {b:.1f}" for axis, a, b in zip("xyz", low, high, strict=True))
    return [f"tip in base coordinates: {spans} mm; wrist never below {motion.smallest_wrist_angle_deg:.1f} degrees"]


def _closest(clearance: ClearanceRecord) -> list[str]:
    dry = clearance.dry_run
    texts = [f"{clearance.smallest_mm:.2f} mm, {clearance.at}; kept everywhere: {clearance.kept_mm} mm"]
    if clearance.arm_smallest_mm is not None:
        texts.append(f"arm: {clearance.arm_smallest_mm:.1f} mm, {clearance.arm_at}")
    return [*texts, f"dry run, {dry.lift_mm:g} mm higher: {dry.smallest_mm:.2f} mm, {dry.at}"]


def _signals(setup: Setup, switching: Timeline) -> list[str]:
    signals = setup.cell.signals
    flow = "" if signals.flow is None else f", flow {signals.flow} ({signals.flow_per_mm3_s:g} for 1 mm3/s)"
    vacuum = "" if signals.vacuum is None else f", vacuum {signals.vacuum} while the valve is shut"
    return [
        f"mode {signals.mode}: valve {signals.dispenser}, lamp {signals.uv_lamp}{flow}{vacuum}; safe values 0",
        (
            f"lags: valve opens {signals.valve_open:g} s and closes {signals.valve_close:g} s late; lamp leads "
            f"{signals.uv_lead:g} s and trails {signals.uv_tail:g} s; material "
            f"{switching.errors.max(initial=0.0):.3f} mm from each run's ends"
        ),
    ]


def _process(setup: Setup, deposition: DepositionRecord | None) -> list[str]:
    """Say what a person sets beside the robot, and what the lamp gives."""
    process, flood = setup.cell.process, setup.cell.flood
    pressure = "not named" if process.pressure is None else f"{process.pressure / PASCAL_PER_KPA:g} kPa"
    texts = [f"air pressure {pressure}; layer {process.layer_height:g} mm, stand-off {process.standoff:g} mm"]
    light = None if deposition is None else deposition.light
    if setup.cell.purge is not None:
        texts.append(f"nozzle primed by the program before its first run: {setup.cell.purge.duration:g} s at [purge]")
    if light is not None:
        texts.append(f"light: {light.one_pass:.3g} mJ/cm2 in one pass, {light.all_passes:.3g} in all together")
    if flood is not None:
        who = "by hand" if flood.joints is None else "by the program, after the last run"
        texts.append(f"final exposure of the whole part: {flood.duration:g} s, {who}")
    return texts


def _limits(setup: Setup, motion: MotionRecord) -> list[str]:
    process = setup.cell.process
    laying = f"tip {process.speed:g} mm/s laying (slowest {motion.slowest_deposit_mm_s:.1f})"
    joints = f"joints from and to home at {process.joint_speed_share:.0%} of their speeds"
    return [f"{laying}, {process.travel_speed:g} mm/s travelling; {joints}"]


def _steps(setup: Setup, orders: Orders) -> list[str]:
    signals = setup.cell.signals
    texts = ["1. before the first load on a controller: rapid/controller/first_load.md; nothing runs without it"]
    if signals.mode == "analog" and signals.flow_lag > 0.0:
        texts.append(f"   set the system parameter Event Preset Time to {signals.flow_lag:g} s or more, for TriggSpeed")
    texts.append("2. run as written: dry, 20 mm higher, at 25 % (geoDryRun TRUE, geoSpeedPct 25)")
    if orders.lifted_otherwise:
        texts.append(
            f"   {orders.lifted_otherwise} targets have other configuration data there: only the print proves theirs"
        )
    if not setup.placement.missing:
        full = " and geoSpeedPct 100, speed override 100 %" if signals.mode == "io" else ""
        texts.append(f"3. to print: geoDryRun FALSE{full}; to resume at run k: clean the nozzle, geoFirstRun k, main")
    return texts
