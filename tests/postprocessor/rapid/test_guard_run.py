"""What the guard asks, refuses and lets through, executed: its bounds just on either side, and what it leaves behind.

Its text is elsewhere compared with its own template; here only what a program does with it counts.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from math import cos, radians, sin
from typing import TypeAlias, cast

import numpy as np
import pytest

from geoprint.model import Cell, Flood, Placement, Purge, Signals
from geoprint.postprocessor.rapid.guard import resident_module
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.language.syntax import Value
from geoprint.postprocessor.rapid.machine import Controller, Event, Execution, MachineTask, Scenario, execute
from geoprint.postprocessor.rapid.made import TIES, task_of
from geoprint.robot.arm import Arm
from tests.postprocessor.export_cases import CELL, DEMONSTRATION, PLACEMENT, orders, proven_program, stream, tips_of

ANALOG = Signals(mode="analog", dispenser="doValve", uv_lamp="doUV", flow="aoFlow", flow_per_mm3_s=0.1, flow_lag=0.04)
CELLS = {
    "io": CELL,
    "analog": replace(CELL, signals=replace(ANALOG, vacuum="doVacuum")),
    "stations": replace(
        CELL, purge=Purge(joints=CELL.robot.home + 0.1, duration=2.0), flood=Flood(60.0, joints=CELL.robot.home - 0.1)
    ),
    "by hand": replace(CELL, flood=Flood(45.0)),
    "demonstration": CELL,
}
_Pose: TypeAlias = tuple[tuple[float, float, float], tuple[float, float, float, float]]
_WorkObject: TypeAlias = tuple[bool, bool, str, Value, _Pose]
REPLAN = "the work object is not the planned one: replan."
OVERRIDE = "to deposit, set geoSpeedPct and the speed override to 100."
ORDER = "runs follow one another from main only: start from main."
NO_PROCEDURE = "FUNC num GeoResidentVersion(INOUT num value)\nRETURN 1;\nENDFUNC\nPROC GeoOther(INOUT num value)"


def placed(name: str) -> Placement:
    return DEMONSTRATION if name == "demonstration" else PLACEMENT


@cache
def texts(name: str) -> tuple[tuple[str, str], ...]:
    cell: Cell = CELLS[name]
    placement = placed(name)
    program, _ = proven_program(
        orders(placement=placement), cell=cell, placement=placement, tips_at=tips_of(stream()), part_name="rings",
        surface_within=0.2 if placement.calibrated else None, spacing=2.0,
    )  # fmt: skip
    return (*program.modules[:-1], resident_module(cell, placement))


@cache
def compiled(name: str, *changes: tuple[str, str]) -> MachineTask:
    cell = CELLS[name]
    modules = list(texts(name))
    for old, new in changes:
        assert any(old in text for _, text in modules)
        modules = [(file, text.replace(old, new)) for file, text in modules]
    parsed = [parse_module(file, text) for file, text in modules if text]
    return task_of(parsed, cell=cell, arm=Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool))


def ran(
    name: str = "io",
    *changes: tuple[str, str],
    off: tuple[float, ...] = (0.0,) * 6,
    answers: tuple[float, ...] = (),
    override: float = 100.0,
    signals: dict[str, float] | None = None,
    entry: str = "main",
    ties: Mapping[Event, tuple[str, ...]] = TIES,
    data: Mapping[str, Value] | None = None,
    **more: Value,
) -> Execution:
    """A program set to print, with the arm so many degrees off home."""
    given: dict[str, Value] = {"geoDryRun": False, "geoSpeedPct": 100.0, "geoFirstRun": 1.0, **(data or {}), **more}
    scenario = Scenario(
        data=given, joints=tuple((CELL.robot.home + np.radians(off)).tolist()), answers=answers, override=override,
        ties=ties, signals=signals or {}, entry=entry,
    )  # fmt: skip
    return execute(compiled(name, *changes), scenario)


def refused(found: Execution) -> str:
    """Why a program stopped by itself, with everything off; empty where it ran to its end."""
    assert not any(found.signals.values())
    words = [text for _, text in found.texts]
    if found.ended == "end":
        assert "geoprint stops here:" not in words
        return ""
    assert found.ended == "exit"
    assert words[-2] == "geoprint stops here:"
    return words[-1]


def on(found: Execution) -> set[str]:
    """What was ever switched on."""
    return {each.signal for each in found.switchings if each.value != 0.0}


@pytest.mark.parametrize(
    ("data", "why"),
    [
        ({"geoSpeedPct": 1.0}, ""), ({"geoSpeedPct": 0.99}, "geoSpeedPct must lie between 1 and 100."),
        ({"geoSpeedPct": 100.0}, ""), ({"geoSpeedPct": 100.1}, "geoSpeedPct must lie between 1 and 100."),
        ({"geoFirstRun": 1.0}, ""), ({"geoFirstRun": 0.0}, "geoFirstRun is no run of this program."),
        ({"geoFirstRun": 2.0}, ""), ({"geoFirstRun": 3.0}, "geoFirstRun is no run of this program."),
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["io", "demonstration"])
def test_what_a_person_sets_lies_within_its_bounds(name: str, data: dict[str, Value], why: str) -> None:
    found = ran(name, geoDryRun=True, data=data)
    assert refused(found) == why
    assert on(found) == set()
    assert bool(len(found.moves.begins)) == (not why)


@pytest.mark.parametrize(
    ("name", "speed", "override", "why"),
    [
        ("io", 100.0, 100.0, ""), ("io", 99.0, 100.0, OVERRIDE), ("io", 100.0, 99.0, OVERRIDE),
        ("analog", 100.0, 100.0, ""), ("analog", 50.0, 100.0, ""), ("analog", 100.0, 40.0, ""),
    ],
)  # fmt: skip
def test_a_fixed_pressure_prints_at_full_speed_only_and_a_flow_at_any(
    name: str, speed: float, override: float, why: str
) -> None:
    found = ran(name, override=override, geoSpeedPct=speed)
    assert refused(found) == why
    assert ("dovalve" in on(found)) == (not why)
    dry = ran(name, override=override, geoSpeedPct=speed, geoDryRun=True)
    assert (refused(dry), on(dry)) == ("", set())
    full = ran(name, geoDryRun=True)
    # The arm is at home already: only the ways there, along the path and back take time.
    assert dry.seconds == pytest.approx(full.seconds * 1e4 / (speed * override), rel=1e-6)


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_arm_may_stand_five_degrees_from_home_and_farther_a_person_is_asked(axis: int, sign: float) -> None:
    def off(degrees: float) -> tuple[float, ...]:
        return tuple(sign * degrees if k == axis else 0.0 for k in range(6))

    near = ran(off=off(4.99))
    assert (refused(near), near.questions) == ("", ())
    far = ran(off=off(5.01), answers=(1.0,))
    assert (refused(far), far.questions) == ("", ("Move home slowly?",))
    stopped = ran(off=off(5.01), answers=(5.0,))
    assert refused(stopped) == "jog the arm home, then start from main."
    assert len(stopped.moves.begins) == 0
    # There it goes at 10 degrees, or 20 mm, a second at most.
    speed = far.moves.lengths[0] / (far.moves.ends[0] - far.moves.begins[0])
    assert 0.0 <= speed < 20.001
    assert np.append(far.moves.places[0], far.moves.turns[0, :3]) == pytest.approx(CELL.robot.home, abs=1e-6)


def work_object(*, shift: tuple[float, float, float] = (0.0, 0.0, 0.0), turn: tuple[int, float] = (0, 0.0)) -> Value:
    """The planned work object, shifted along its own axes [mm] and turned about one of them [degrees]."""
    planned = execute(compiled("io"), Scenario()).data["wgeopart"]
    held, fixed, unit, user, (place, (w, x, y, z)) = cast("_WorkObject", planned)
    axis, degrees = turn
    half = radians(degrees) / 2.0
    a, b, c, d = cos(half), *(sin(half) if k == axis else 0.0 for k in range(3))
    turned = (
        w * a - x * b - y * c - z * d, w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b, w * d + x * c - y * b + z * a,
    )  # fmt: skip
    moved = tuple(p + q for p, q in zip(place, shift, strict=True))
    return (held, fixed, unit, user, (moved, turned))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_work_object_may_lie_as_far_off_as_the_plan_allows(axis: int, sign: float) -> None:
    """A tenth of the stand-off of 0.3 mm, and as much at the corners of the part, 14.14 mm away: 0.1215 degrees."""

    def shifted(by: float) -> str:
        x, y, z = (sign * by if k == axis else 0.0 for k in range(3))
        return refused(ran(wGeoPart=work_object(shift=(x, y, z))))

    assert shifted(0.0297) == ""
    assert shifted(0.0303) == REPLAN
    assert refused(ran(wGeoPart=work_object(turn=(axis, sign * 0.120)))) == ""
    assert refused(ran(wGeoPart=work_object(turn=(axis, sign * 0.123)))) == REPLAN
    assert refused(ran(wGeoPart=work_object(turn=(axis, 360.0 - 0.120)))) == ""


def test_what_a_stop_has_cut_short_is_asked_for_before_the_next_print_only() -> None:
    asked = ("Is the nozzle clean, the part right?",)
    first = ran(geoRunCutShort=2.0, answers=(1.0,))
    assert (refused(first), first.questions) == ("", asked)
    assert (first.data["georuncutshort"], first.data["georununderway"]) == (0.0, 0.0)
    assert [text for _, text in first.texts if "2" in text] == ["The last print was stopped in run 2"]
    again = ran(geoRunCutShort=2.0, answers=(5.0,))
    assert refused(again) == "clean the nozzle, set geoFirstRun, start from main."
    assert again.data["georuncutshort"] == 2.0
    dry = ran(geoRunCutShort=2.0, geoDryRun=True)
    assert (refused(dry), dry.questions, dry.data["georuncutshort"]) == ("", (), 2.0)
    clean = ran()
    assert (refused(clean), clean.questions, clean.data["georuncutshort"]) == ("", (), 0.0)
    # A run that was under way when a new start came was cut short as well.
    left = ran(geoRunUnderWay=1.0, geoFirstRun=2.0, answers=(1.0,))
    assert (refused(left), left.questions, left.data["georuncutshort"]) == ("", asked, 0.0)
    assert {"The last print was stopped in run 1", "This one starts with run 2"} <= {text for _, text in left.texts}


def test_a_run_that_was_under_way_is_kept_though_nothing_is_tied_to_the_start() -> None:
    dry = ran(geoRunUnderWay=2.0, geoDryRun=True, ties={})
    assert (refused(dry), dry.questions, dry.data["georuncutshort"]) == ("", (), 2.0)
    left = ran(geoRunUnderWay=2.0, answers=(5.0,), ties={})
    assert refused(left) == "clean the nozzle, set geoFirstRun, start from main."
    assert left.data["georuncutshort"] == 2.0


@pytest.mark.parametrize(("dry", "runs"), [(True, {0.0}), (False, {0.0, 1.0, 2.0})])
def test_only_a_run_that_prints_is_under_way(dry: object, runs: set[float]) -> None:
    scenario = Scenario(
        data={"geoDryRun": bool(dry), "geoSpeedPct": 100.0}, joints=tuple(CELL.robot.home.tolist()), ties=TIES
    )
    running = Controller(compiled("io"), scenario)
    seen: set[object] = set()
    for moment in np.linspace(0.0, 1.1 * execute(compiled("io"), scenario).seconds, 60):
        running.run_until(float(moment))
        seen.add(running.execution().data["georununderway"])
    assert seen == runs
    assert running.execution().ended == "end"


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (("CONST num nGeoResident:=1;", "CONST num nGeoResident:=2;"), "load GeoResident.sys version 1: see "),
        (("PROC GeoResidentVersion(INOUT num value)", "PROC GeoOther(INOUT num value)"), "load GeoResident.sys "),
        (("PROC GeoResidentOutputs(INOUT num value)", "PROC GeoOther(INOUT num value)"), "load GeoResident.sys "),
        (("PROC GeoResidentVersion(INOUT num value)", NO_PROCEDURE), "load GeoResident.sys "),
        (("CONST num nGeoOutputs:=", "CONST num nGeoOutputs:=1"), "GeoResident.sys switches the outputs of another "),
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["io", "demonstration"])
def test_without_the_resident_that_it_was_written_for_nothing_moves(
    name: str, change: tuple[str, str], why: str
) -> None:
    found = ran(name, change)
    assert refused(found).startswith(why)
    assert len(found.moves.begins) == 0


@pytest.mark.parametrize(
    ("changes", "entry", "moves"),
    [
        ((), "GeoRun1", 0), ((), "GeoRun2", 0),
        ((("    GeoRun1;\n", ""),), "main", 2), ((("    GeoRun2;\n", ""),), "main", None),
        ((("    GeoRun2;\n", "    GeoRun1;\n"),), "main", None),
        ((("    GeoRun2;\n", "    GeoRun2;\n    GeoRun2;\n"),), "main", None),
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["io", "demonstration"])
def test_runs_follow_one_another_from_main_only(
    name: str, changes: tuple[tuple[str, str], ...], entry: str, moves: int | None
) -> None:
    found = ran(name, *changes, entry=entry)
    assert refused(found) == ORDER
    assert moves is None or len(found.moves.begins) == moves


@pytest.mark.parametrize("name", CELLS)
def test_what_was_on_is_off_before_anything_moves(name: str) -> None:
    every = list(ran(name, geoDryRun=True).signals)
    found = ran(name, signals=dict.fromkeys(every, 1.0), geoDryRun=True)
    assert refused(found) == ""
    assert {each.signal for each in found.switchings if each.time == 0.0 and each.value == 0.0} == set(every)
    assert on(found) == set()


@pytest.mark.parametrize("name", CELLS)
def test_a_printing_program_switches_what_the_cell_has_and_a_demonstration_nothing(name: str) -> None:
    found = ran(name)
    assert refused(found) == ""
    wanted = {"analog": {"dovalve", "douv", "aoflow", "dovacuum"}, "demonstration": set[str]()}
    assert on(found) == wanted.get(name, {"dovalve", "douv"})
    by_hand = [text for _, text in found.texts if "flood the part" in text]
    assert by_hand == (["Now flood the part with UV, seconds: 45"] if name == "by hand" else [])
    dry = ran(name, geoDryRun=True)
    assert (refused(dry), on(dry)) == ("", set())
    assert not [text for _, text in dry.texts if "flood" in text]
    # Where a run is left out it is lifted like a dry run.
    later = ran(name, geoFirstRun=2.0)
    heights = [each.moves.Ts_base_tip(each.moves.along_path)[:, 2, 3] for each in (found, dry, later)]
    lifts = heights[1] - heights[0]
    assert lifts == pytest.approx(np.full(len(lifts), 0.0 if name == "demonstration" else 20.0), abs=1e-3)
    if name != "demonstration":
        assert (heights[2] - heights[0])[[0, -1]] == pytest.approx([20.0, 0.0], abs=1e-3)


@pytest.mark.parametrize(("speed", "fastest"), [(100.0, 60.0), (50.0, 30.0)])
def test_the_path_is_driven_at_its_share_of_the_speed_and_home_in_its_time(speed: float, fastest: float) -> None:
    moves = ran(geoSpeedPct=speed, geoDryRun=True).moves
    rows = moves.along_path[1:]
    straight = moves.lengths[rows] > 1.0
    took = (moves.ends - moves.begins)[rows][straight]
    assert (moves.lengths[rows][straight] / took).max() == pytest.approx(fastest, rel=1e-4)
    # A second there, a second back, of which geoSpeedPct counts once.
    assert moves.ends[1] - moves.begins[1] == pytest.approx(100.0 / speed, abs=1e-3)
    assert moves.ends[-1] - moves.begins[-1] == pytest.approx(100.0 / speed, abs=1e-3)


def test_an_error_on_the_path_shuts_everything_off_and_is_nobodys() -> None:
    found = ran("analog", ("    GeoEnter 2;\n", "    GeoEnter 2;\n    WaitUntil FALSE\\MaxTime:=1;\n"))
    assert found.ended == "error"
    assert found.reason.startswith("ERR_WAIT_MAXTIME")
    assert not any(found.signals.values())
    turned = ran(wGeoPart=(False, True, "", ((0.0,) * 3, (0.0,) * 4), ((0.0,) * 3, (1.0, 0.0, 0.0, 0.0))))
    assert (turned.ended, turned.reason.split(":")[0], len(turned.moves.begins)) == ("error", "ERR_ARGVALERR", 0)


ROUTINES = (
    "GeoBegin", "GeoKeeper", "GeoAskHome", "GeoAskCutShort", "GeoAskStopped", "GeoEnter", "GeoEnd", "GeoPrime",
    "GeoFlood",
)  # fmt: skip


@pytest.mark.parametrize("routine", ROUTINES)
def test_an_error_anywhere_in_the_guard_shuts_everything_off_and_ends_the_program(routine: str) -> None:
    guard = dict(texts("stations"))["GeoGuard.mod"]
    (body,) = re.findall(rf"  PROC {routine}\([^)]*\)\n.*?  ENDPROC", guard, re.DOTALL)
    failing = body.replace("  ERROR\n", "    SetDO doUV,1;\n    SetDO doValve,1;\n    RAISE 5;\n  ERROR\n")
    found = ran("stations", (body, failing), geoRunCutShort=2.0, answers=(1.0,))
    assert (found.ended, found.reason) == ("error", "error 5: was raised")
    assert {"douv", "dovalve"} <= on(found)
    assert not any(found.signals.values())


def stopped(
    name: str, signal: str, *, nth: int = 0, ties: Mapping[Event, tuple[str, ...]] = TIES, **data: Value
) -> tuple[Execution, Execution]:
    """A print that is stopped while an output is on, at its n-th time, and what comes of going on."""
    scenario = Scenario(
        data={"geoDryRun": False, "geoSpeedPct": 100.0, "geoFirstRun": 1.0} | data,
        joints=tuple(CELL.robot.home.tolist()), ties=ties,
    )  # fmt: skip
    whole = execute(compiled(name), scenario)
    moments = [each.time for each in whole.switchings if each.signal == signal and each.value != 0.0]
    running = Controller(compiled(name), scenario)
    running.stop_at(moments[nth] + 0.3)
    then = running.execution()
    running.go_on()
    return then, running.execution()


@pytest.mark.parametrize("ties", [TIES, {"Stop": TIES["Stop"]}], ids=["tied", "stops only"])
@pytest.mark.parametrize(
    ("name", "signal", "nth", "first", "run"),
    [
        ("stations", "dovalve", 0, 1.0, 1.0), ("stations", "dovalve", 0, 2.0, 2.0),
        ("stations", "dovalve", 1, 1.0, 1.0), ("stations", "dovalve", 2, 1.0, 2.0), ("io", "dovalve", 0, 1.0, 1.0),
        ("io", "dovalve", 1, 1.0, 2.0), ("io", "douv", 1, 1.0, 2.0), ("analog", "aoflow", 0, 1.0, 1.0),
    ],
)  # fmt: skip
def test_a_stop_cuts_the_run_short_that_was_under_way_or_primed_for(
    name: str, signal: str, nth: int, first: float, run: float, ties: Mapping[Event, tuple[str, ...]]
) -> None:
    """The resident ends it as it goes on, and where nothing is tied to that, the guard before the next run."""
    then, on_again = stopped(name, signal, nth=nth, ties=ties, geoFirstRun=first)
    assert not any(then.signals.values())
    assert then.data["georuncutshort"] == run
    assert on_again.ended == "exit"
    assert on_again.data["georuncutshort"] == run
    assert f"Material was stopped in run {run:g}" in {text for _, text in on_again.texts}
    assert not any(on_again.signals.values())
    if "Restart" in ties:
        assert max(each.time for each in on_again.switchings if each.value != 0.0) <= then.seconds
    else:
        assert refused(on_again) == "clean the nozzle, set geoFirstRun to that run, start from main."


def test_a_stop_of_the_final_exposure_cuts_no_run_short_and_is_told() -> None:
    then, on_again = stopped("stations", "douv", nth=2)
    assert (then.data["georuncutshort"], not any(then.signals.values())) == (0.0, True)
    assert (on_again.ended, on_again.data["georuncutshort"]) == ("end", 0.0)
    assert "A stop has cut the final exposure short: flood the part again." in {text for _, text in on_again.texts}
