"""When valve, material and lamp are on: placed by the writer, simulated from what was read back."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import UsageError, VerificationError
from geoprint.model import Cell, FloatArray, Hexapod, PoseStream, Purge, Signals, TiltTurn
from geoprint.postprocessor import Event, Orders, Setup, Timeline, TipsAt, check_timeline, timeline as timeline_of
from geoprint.postprocessor.rapid.dispensing import switched_of
from geoprint.postprocessor.rapid.guard import resident_module
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.made import Made, dry, make, printing, task_of
from geoprint.postprocessor.rapid.verify import read_back
from geoprint.postprocessor.setup_file import read_setup, setup_file
from geoprint.postprocessor.switching import switching_events
from geoprint.postprocessor.tables import poses_table, read_orders, read_poses_table, targets_table
from geoprint.robot.arm import Arm
from tests.positioner.tables import hexapod_noun, tilt_turn_noun
from tests.postprocessor.export_cases import (
    CELL,
    DEMONSTRATION,
    EXTENT,
    PLACEMENT,
    orders,
    proven_program,
    stream,
    tips_of,
)

POSES = stream(runs=3, points=30)
ORDERS = orders(POSES)
TIPS = tips_of(POSES)
SPEED = CELL.process.speed


def timeline(made: Made, orders: Orders, *, signals: Signals, tips_at: TipsAt) -> Timeline:
    return timeline_of(switched_of(made, orders, tips_at=tips_at), orders, signals=signals, tips_at=tips_at)


def signals(**lags: float) -> Signals:
    return replace(CELL.signals, **lags)  # pyright: ignore[reportArgumentType]


def simulated(lags: Signals, *, real: Signals | None = None, plan: Orders = ORDERS, tips: TipsAt = TIPS) -> Timeline:
    """Write a program for the lags, read it back, and simulate it with these or other lags."""
    cell = replace(CELL, signals=lags)
    program, _ = proven_program(
        plan, cell=cell, placement=PLACEMENT, surface_within=None, tips_at=tips, part_name="x", spacing=1.0
    )
    made = read_back(program.modules, cell=cell, placement=PLACEMENT)
    return timeline(made, plan, signals=real or lags, tips_at=tips)


def test_without_lags_outputs_switch_at_the_ends_of_the_deposits() -> None:
    events = switching_events(ORDERS, signals=signals(), tips_at=TIPS, speed=SPEED)
    first, last = ORDERS.deposits[0]
    assert events[:4] == (
        Event(first + 1, 0.0, from_start=True, output="dispenser", on=True),
        Event(first + 1, 0.0, from_start=True, output="uv_lamp", on=True),
        Event(last, 0.0, from_start=False, output="dispenser", on=False),
        Event(last, 0.0, from_start=False, output="uv_lamp", on=False),
    )
    assert len(events) == 4 * len(ORDERS.deposits)


def test_a_valve_that_opens_late_is_told_on_the_approach_and_one_that_shuts_late_before_the_end() -> None:
    events = switching_events(ORDERS, signals=signals(valve_open=0.05, valve_close=0.05), tips_at=TIPS, speed=SPEED)
    first, last = ORDERS.deposits[0]
    opens, shuts = (next(event for event in events if event.on == on and event.output == "dispenser") for on in (1, 0))
    assert (opens.target, opens.from_start) == (first, False)
    assert opens.distance == pytest.approx(60.0 * 0.05, abs=1e-3)
    assert shuts.target == last
    assert shuts.distance == pytest.approx(20.0 * 0.05, abs=1e-3)


def test_a_moment_before_the_last_move_is_placed_on_the_move_it_falls_on() -> None:
    events = switching_events(ORDERS, signals=signals(valve_close=0.15), tips_at=TIPS, speed=SPEED)
    _, last = ORDERS.deposits[0]
    shuts = next(event for event in events if not event.on and event.output == "dispenser")
    moves = np.linalg.norm(np.diff(ORDERS.tips[last - 2 : last + 1], axis=0), axis=1)
    assert shuts.target == last - 1
    assert shuts.distance == pytest.approx(20.0 * 0.15 - moves[1], abs=0.02)


def test_a_lamp_that_trails_into_the_lead_of_the_next_run_stays_on() -> None:
    long = signals(uv_lead=0.08, uv_tail=0.08)
    travel = [ORDERS.times[start] - ORDERS.times[end] for (_, end), (start, _) in zip(
        ORDERS.deposits, ORDERS.deposits[1:], strict=False)]  # fmt: skip
    assert max(travel) < 0.25
    lamps = [
        event
        for event in switching_events(ORDERS, signals=long, tips_at=TIPS, speed=SPEED)
        if event.output == "uv_lamp"
    ]
    assert len(lamps) == 6
    merged = switching_events(ORDERS, signals=signals(uv_lead=0.08, uv_tail=0.0), tips_at=TIPS, speed=SPEED)
    assert len(merged) == 12
    found = simulated(long)
    assert len(found.lamp) == 3
    assert found.lamp_alone == pytest.approx(0.0, abs=1e-3)


LIFTED = stream(runs=3, points=30, lifts=2)


def written(lags: Signals, poses: PoseStream) -> tuple[Made, Timeline, str]:
    """Write a program for the lags, execute it, and return what it made, its outputs in time, and its text."""
    cell, plan, tips = replace(CELL, signals=lags), orders(poses), tips_of(poses)
    program, _ = proven_program(
        plan, cell=cell, placement=PLACEMENT, surface_within=None, tips_at=tips, part_name="x", spacing=1.0
    )
    made = read_back(program.modules, cell=cell, placement=PLACEMENT)
    found = timeline(made, plan, signals=lags, tips_at=tips)
    check_timeline(found)
    return made, found, "".join(text for _, text in program.modules)


def rests(made: Made) -> FloatArray:
    """Return (t,) how long the arm stood still behind the move to each target of the path [s]."""
    moves = made.execution.moves
    return np.append(moves.begins[made.rows[1:]] - moves.ends[made.rows[:-1]], 0.0)


def test_a_flow_that_settles_flows_while_the_arm_waits_at_the_start_of_each_run() -> None:
    made, found, text = written(signals(settle=0.15), POSES)
    starts = [first for first, _ in ORDERS.deposits]
    np.testing.assert_allclose(rests(made)[starts], 0.15, atol=1e-9)
    assert np.delete(rests(made), starts).max() < 1e-9
    assert text.count("WaitTime\\InPos,0.15*geoOn;") == 3
    # The material comes as the tip does: the wait is no time of the motion.
    np.testing.assert_allclose(found.material[:, 0], found.deposits[:, 0], atol=1e-6)
    clock = {each.signal: each.time for each in made.execution.switchings[::-1] if each.value > 0.0}
    begins = float(made.execution.moves.begins[made.rows[starts[0] + 1]])
    assert begins - clock["dovalve"] == pytest.approx(0.15, abs=1e-3)
    # The lamp is on from when it flows.
    assert begins - clock["douv"] == pytest.approx(0.15, abs=1e-3)
    later = switching_events(ORDERS, signals=signals(valve_open=0.02, settle=0.15), tips_at=TIPS, speed=SPEED)
    assert (later[0].output, later[0].target, later[0].from_start) == ("dispenser", starts[0], False)
    assert later[0].distance == pytest.approx(60.0 * 0.02, abs=1e-3)


@pytest.mark.parametrize("settle", [0.0, 0.1])
@pytest.mark.parametrize("tail", [0.2, 30.0])
def test_a_lamp_shines_as_long_after_the_end_as_it_has_to(settle: float, tail: float) -> None:
    """The arm waits at the lift until it goes off: what is left when it arrives there."""
    made, found, text = written(signals(uv_tail=tail, settle=settle), LIFTED)
    plan = orders(LIFTED)
    end, lifted = plan.deposits[-1][1], plan.count - 2
    left = tail - float(plan.times[lifted] - plan.times[end])
    assert 0.0 < left < tail
    assert rests(made)[lifted] == pytest.approx(left, rel=1e-5)
    assert "WaitTime" in text.split("GeoRun3()")[1]
    assert found.lamp[-1, 1] == pytest.approx(plan.times[end] + tail, abs=1e-3)
    off = max(each.time for each in made.execution.switchings if each.signal == "douv" and each.move >= 0)
    ended = float(made.execution.moves.ends[made.rows[end]])
    assert off - ended == pytest.approx(tail, abs=2e-3)


def test_nobody_waits_in_a_dry_run_or_without_a_reason() -> None:
    made, _, text = written(signals(uv_tail=0.05, valve_open=0.02), LIFTED)
    assert rests(made).max() < 1e-9
    assert "WaitTime\\InPos" not in text
    cell = replace(CELL, signals=signals(uv_tail=30.0, settle=0.5))
    program, _ = proven_program(
        orders(LIFTED), cell=cell, placement=PLACEMENT, surface_within=None, tips_at=tips_of(LIFTED), part_name="x",
        spacing=1.0,
    )  # fmt: skip
    modules = [parse_module(name, text) for name, text in program.modules if name.endswith(".mod")]
    task = task_of(
        [*modules, parse_module(*resident_module(cell, PLACEMENT))], cell=cell,
        arm=Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool),
    )  # fmt: skip
    assert rests(make(task, dry(cell, placement=PLACEMENT))).max() < 1e-9
    assert rests(make(task, printing(cell, placement=PLACEMENT))).max() > 29.0


def unhurried() -> tuple[Orders, TipsAt]:
    """Return orders whose first approach and last lift take half a second longer, and the motion of their tip."""
    times = ORDERS.times.copy()
    times[0] -= 0.5
    times[-1] += 0.5
    slow = replace(ORDERS, times=times, duration=ORDERS.duration + 0.5)
    return slow, lambda moments: np.array([np.interp(moments, times, ORDERS.tips[:, axis]) for axis in range(3)]).T


@pytest.mark.parametrize(("lead", "tail"), [(0.0, 0.05), (0.1, 0.1), (0.15, 0.3), (0.3, 0.1), (0.5, 0.5)])
def test_every_run_switches_its_own_lamp_on_so_that_printing_can_begin_there(lead: float, tail: float) -> None:
    slow, tips = unhurried()
    lags = signals(uv_lead=lead, uv_tail=tail)
    lamps = [
        event for event in switching_events(slow, signals=lags, tips_at=tips, speed=SPEED) if event.output == "uv_lamp"
    ]
    assert [slow.runs[event.target] for event in lamps if event.on] == [0, 1, 2]
    program, _ = proven_program(
        slow, cell=replace(CELL, signals=lags), placement=PLACEMENT, surface_within=None, tips_at=tips, part_name="x",
        spacing=1.0,
    )  # fmt: skip
    made = read_back(program.modules, cell=replace(CELL, signals=lags), placement=PLACEMENT)
    found = timeline(made, slow, signals=lags, tips_at=tips)
    assert len(found.lamp) == (3 if lead + tail < 0.18 else 1)
    np.testing.assert_allclose(
        found.lamp[[0, -1], [0, 1]], [slow.times[1] - lead, found.deposits[-1, 1] + tail], atol=2e-3
    )
    check_timeline(found)


def test_a_valve_that_would_be_told_to_open_in_the_run_before_is_refused() -> None:
    slow, tips = unhurried()
    with pytest.raises(UsageError, match=r"valve_open_s is 0\.4 s, longer than the approach to a run at 4\.4 s"):
        switching_events(slow, signals=signals(valve_open=0.4, valve_close=0.3), tips_at=tips, speed=SPEED)


def ramped(pull: float) -> tuple[Orders, TipsAt]:
    """Return orders whose runs begin and end at rest, and the motion of their tip.

    The tip accelerates and brakes with `pull` [mm/s2], and holds the 20 mm/s of the cell in between.
    """
    steps = np.linalg.norm(np.diff(POSES.tips, axis=0), axis=1)
    arcs = np.append(0.0, np.cumsum(steps))
    passed, moments = [arcs[:1]], [np.array([1.0])]
    for run in range(3):
        first, last = np.flatnonzero(POSES.deposit & (POSES.runs == run))[[0, -1]]
        length, ramp = arcs[last] - arcs[first], SPEED / pull
        took = length / SPEED + ramp
        up = np.linspace(0.0, ramp, 201)
        begin = moments[-1][-1] + (arcs[first] - passed[-1][-1]) / 60.0
        moments.append(begin + np.concatenate([up, took - up[::-1]]))
        passed.append(arcs[first] + np.concatenate([0.5 * pull * up**2, length - 0.5 * pull * up[::-1] ** 2]))
    passed.append(arcs[-1:])
    moments.append(moments[-1][-1:] + (arcs[-1] - passed[-2][-1]) / 60.0)
    way, when = np.concatenate(passed), np.concatenate(moments)
    times = np.interp(arcs, way, when)

    def tips(at: FloatArray) -> FloatArray:
        where = np.interp(at, when, way)
        return np.column_stack([np.interp(where, arcs, POSES.tips[:, axis]) for axis in range(3)])

    return replace(ORDERS, times=times, duration=float(times[-1]) + 1.0), tips


@pytest.mark.parametrize("pull", [250.0, 400.0, 1000.0])
def test_a_valve_waits_for_the_ramps_so_that_each_run_gets_its_volume_and_an_output_does_not(pull: float) -> None:
    slow, tips = ramped(pull)
    found = simulated(signals(), plan=slow, tips=tips)
    wait = 20.0 / (2.0 * pull)
    np.testing.assert_allclose(found.material - found.deposits, [[wait, -wait]] * 3, atol=5e-4)
    # Polygons of 30 sides; one second of the valve is right for 20 mm.
    lengths = 60.0 * np.sin(np.pi / 30.0) * np.array([10.0, 9.0, 8.0])
    np.testing.assert_allclose(20.0 * np.diff(found.material, axis=1)[:, 0], lengths, rtol=5e-3)
    np.testing.assert_allclose(found.lamp, found.material, atol=2e-3)
    check_timeline(found)
    follows = replace(signals(), mode="analog", flow="aoFlow", flow_per_mm3_s=0.2)
    output = simulated(follows, plan=slow, tips=tips)
    np.testing.assert_allclose(output.material, output.deposits, atol=5e-4)
    np.testing.assert_allclose(20.0 * np.diff(output.material, axis=1)[:, 0], lengths + 400.0 / pull, rtol=5e-3)


def test_a_valve_waits_no_longer_than_50_ms_for_a_ramp() -> None:
    slow, tips = ramped(100.0)
    found = simulated(signals(), plan=slow, tips=tips)
    np.testing.assert_allclose(found.material - found.deposits, [[0.05, -0.05]] * 3, atol=5e-4)


def test_a_valve_that_lags_opens_and_shuts_so_much_sooner_than_the_material_is_wanted() -> None:
    slow, tips = ramped(400.0)
    lags = signals(valve_open=0.04, valve_close=0.06, uv_lead=0.02, uv_tail=0.03)
    found = simulated(lags, plan=slow, tips=tips)
    np.testing.assert_allclose(found.material - found.deposits, [[0.025, -0.025]] * 3, atol=1e-3)
    np.testing.assert_allclose(found.lamp - found.material, [[-0.02, 0.03]] * 3, atol=2e-3)
    early = simulated(lags, real=signals(), plan=slow, tips=tips)
    np.testing.assert_allclose(early.material - found.material, [[-0.04, -0.06]] * 3, atol=1e-3)


@given(
    st.floats(0.0, 0.08), st.floats(0.0, 0.3), st.floats(0.0, 0.08), st.floats(0.0, 5.0),
    st.one_of(st.just(0.0), st.floats(0.0, 0.5)),
)  # fmt: skip
@settings(max_examples=8, deadline=None)
def test_whatever_the_lags_material_flows_on_exactly_the_deposits_and_the_lamp_never_alone(
    opening: float, closing: float, lead: float, tail: float, settle: float
) -> None:
    lags = signals(valve_open=opening, valve_close=closing, uv_lead=lead, uv_tail=tail, settle=settle)
    made, found, _ = written(lags, LIFTED)
    starts = [first for first, _ in orders(LIFTED).deposits]
    np.testing.assert_allclose(rests(made)[starts], settle, rtol=1e-5, atol=1e-9)
    assert found.lamp[-1, 1] == pytest.approx(found.deposits[-1, 1] + tail, abs=2e-3)
    np.testing.assert_allclose(found.material, found.deposits, atol=2e-3)
    assert found.errors.max() < 0.05
    assert found.lamp_alone < 2e-3
    check_timeline(found)


def test_a_vacuum_draws_from_each_closing_to_the_next_opening_and_to_the_end_of_the_last_lift() -> None:
    lags = replace(signals(valve_open=0.03, valve_close=0.08), vacuum="doVacuum")
    found = simulated(lags)
    np.testing.assert_allclose(found.vacuum[:, 0], found.material[:, 1] - 0.08, atol=2e-3)
    np.testing.assert_allclose(found.vacuum[:-1, 1], found.material[1:, 0] - 0.03, atol=2e-3)
    assert found.vacuum[-1, 1] == pytest.approx(ORDERS.times[-1], abs=1e-6)
    check_timeline(found)
    assert simulated(signals()).vacuum.size == 0
    with pytest.raises(VerificationError, match=r"the vacuum draws for 0\.080 s while the valve is open"):
        check_timeline(replace(found, vacuum_against=0.08))


def test_a_vacuum_that_draws_while_the_valve_is_open_is_seen() -> None:
    cell = replace(CELL, signals=replace(CELL.signals, vacuum="doVacuum"))
    program, _ = proven_program(
        ORDERS, cell=cell, placement=PLACEMENT, tips_at=TIPS, part_name="x", spacing=1.0, surface_within=None
    )
    swapped = tuple(
        (name, text.replace("doVacuum,0", "doSwap,0").replace("doValve,0", "doVacuum,0").replace("doSwap", "doValve"))
        for name, text in program.modules
    )
    with pytest.raises(VerificationError, match="switched"):
        timeline(read_back(swapped, cell=cell, placement=PLACEMENT), ORDERS, signals=cell.signals, tips_at=TIPS)
    made = read_back(program.modules, cell=cell, placement=PLACEMENT)
    found = timeline(made, ORDERS, signals=cell.signals, tips_at=TIPS)
    assert found.vacuum_against < 1e-3


def test_lags_that_are_not_those_of_the_cell_are_seen_in_the_material() -> None:
    found = simulated(signals(), real=signals(valve_open=0.1))
    assert found.errors[:, 0] == pytest.approx(2.0, abs=0.02)
    with pytest.raises(VerificationError, match=r"run 1: the material begins \d\.\d\d mm from where it should"):
        check_timeline(found)
    with pytest.raises(VerificationError, match=r"the lamp is on for 0\.200 s without material"):
        check_timeline(simulated(signals(uv_tail=0.08), real=signals(uv_tail=-0.12)))


@pytest.mark.parametrize(("lag", "real"), [("uv_lead", 0.02), ("uv_tail", 0.02)])
def test_a_lamp_that_is_dark_where_material_flows_or_in_its_lead_or_tail_is_seen(lag: str, real: float) -> None:
    found = simulated(signals(), real=signals(**{lag: real}))
    assert found.lamp_dark == pytest.approx(real, abs=1e-3)
    with pytest.raises(VerificationError, match=r"the lamp is dark for 0\.0\d\d s while material flows"):
        check_timeline(found)
    assert simulated(signals(**{lag: real})).lamp_dark < 1e-3


@pytest.mark.parametrize(
    ("lags", "reason"),
    [
        ({"valve_close": 5.0}, "would close before it opens"),
        ({"valve_open": 0.3}, "longer than the approach to a run"),
        ({"uv_lead": 0.2}, "Shorten them"),
        ({"uv_tail": 0.2}, "Shorten them"),
    ],
)
def test_lags_longer_than_the_motion_that_is_there_for_them_are_refused(lags: dict[str, float], reason: str) -> None:
    with pytest.raises(UsageError, match=reason):
        switching_events(ORDERS, signals=signals(**lags), tips_at=TIPS, speed=SPEED)


def test_an_output_that_is_switched_on_twice_or_never_off_is_no_timeline() -> None:
    program, _ = proven_program(
        ORDERS, cell=CELL, placement=PLACEMENT, surface_within=None, tips_at=TIPS, part_name="x", spacing=1.0
    )
    made = read_back(program.modules, cell=CELL, placement=PLACEMENT)
    ends = {last for _, last in ORDERS.deposits}

    def without(targets: set[int]) -> Made:
        """The same execution, in which the moves to some targets switch nothing."""
        rows = {int(made.rows[target]) for target in targets}
        kept = tuple(each for each in made.execution.switchings if each.move not in rows)
        return replace(made, execution=replace(made.execution, switchings=kept))

    with pytest.raises(VerificationError, match="switched on although it is so already"):
        timeline(without(ends), ORDERS, signals=CELL.signals, tips_at=TIPS)
    with pytest.raises(VerificationError, match="never switched off"):
        timeline(without({max(ends)}), ORDERS, signals=CELL.signals, tips_at=TIPS)
    with pytest.raises(VerificationError, match="the valve opens 0 times"):
        timeline(without({*range(made.count)}), ORDERS, signals=CELL.signals, tips_at=TIPS)


def test_orders_read_back_from_their_tables(tmp_path: Path) -> None:
    (tmp_path / "targets.csv").write_bytes(targets_table(ORDERS))
    (tmp_path / "poses.csv").write_bytes(poses_table(POSES))
    found = read_orders(
        tmp_path / "targets.csv", read_poses_table(tmp_path / "poses.csv"),
        extent=ORDERS.extent, duration=ORDERS.duration,
    )  # fmt: skip
    for name in ("poses", "runs", "deposited", "times"):
        np.testing.assert_array_equal(getattr(found, name), getattr(ORDERS, name))
    for name in ("tips", "quaternions", "joints", "lifted_joints", "zones", "speeds", "flow"):
        np.testing.assert_allclose(getattr(found, name), getattr(ORDERS, name), atol=2e-6)
    assert found.deposits == ORDERS.deposits
    assert (found.there, found.back) == (ORDERS.there, ORDERS.back)


def test_orders_that_name_poses_that_do_not_exist_are_refused(tmp_path: Path) -> None:
    (tmp_path / "targets.csv").write_bytes(targets_table(ORDERS))
    (tmp_path / "poses.csv").write_bytes(poses_table(stream()))
    with pytest.raises(VerificationError, match="do not rise from 0 to 17"):
        read_orders(
            tmp_path / "targets.csv", read_poses_table(tmp_path / "poses.csv"),
            extent=ORDERS.extent, duration=ORDERS.duration,
        )  # fmt: skip


@pytest.mark.parametrize(
    ("cell", "surface_within"),
    [
        (CELL, None),
        (replace(CELL, purge=Purge(joints=np.full(6, 0.123456789), duration=2.0), signals=signals(uv_lead=0.1)), 1 / 7),
    ],
)
def test_a_setup_reads_back_to_the_last_bit(cell: Cell, surface_within: float | None, tmp_path: Path) -> None:
    written = Setup(cell, DEMONSTRATION, surface_within, extent=EXTENT)
    path = tmp_path / "setup.json"
    path.write_bytes(setup_file(written))
    found = read_setup(path)
    assert setup_file(found) == setup_file(written)
    np.testing.assert_array_equal(found.cell.robot.home, cell.robot.home)
    np.testing.assert_array_equal(found.placement.T_base_fixture, DEMONSTRATION.T_base_fixture)
    assert found.cell.signals == cell.signals
    assert (found.cell.purge is None) == (cell.purge is None)
    assert found.surface_within == surface_within


def test_the_setup_of_a_cell_without_a_tilting_table_does_not_speak_of_one() -> None:
    written = Setup(CELL, DEMONSTRATION, None, extent=EXTENT)
    assert CELL.table is None
    assert "table" not in json.loads(setup_file(written))["cell"]
    assert json.loads(setup_file(written))["cell"]["purge"] is None


@pytest.mark.parametrize("table", [hexapod_noun(), tilt_turn_noun()], ids=["hexapod", "tilt-turn"])
def test_the_setup_of_a_cell_with_a_tilting_table_reads_back(table: Hexapod | TiltTurn, tmp_path: Path) -> None:
    cell = replace(CELL, table=table)
    written = Setup(cell, DEMONSTRATION, None, extent=EXTENT)
    path = tmp_path / "setup.json"
    path.write_bytes(setup_file(written))
    found = read_setup(path)
    assert type(found.cell.table) is type(table)
    assert setup_file(found) == setup_file(written)


def test_a_setup_that_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(VerificationError, match="cannot be read"):
        read_setup(tmp_path / "setup.json")
