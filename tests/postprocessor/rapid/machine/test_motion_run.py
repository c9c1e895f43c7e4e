"""How the machine moves: times, zones, places, outputs on the way, stops, and what goes on behind them."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from geoprint.postprocessor.rapid.machine import Execution, Scenario
from tests.postprocessor.rapid.machine.tasks import HOME, controller, ran, shown, target


def part(found: Execution, name: str) -> tuple[float, ...]:
    """The first part of a record at the end."""
    return cast("tuple[tuple[float, ...], ...]", found.data[name])[0]


THERE = f"MoveL {target(300)},v100,fine,tool0;"
DECLARED = """
PERS wobjdata part:=[FALSE,TRUE,"",[[100,0,0],[0.70710678,0,0,0.70710678]],[[0,0,10],[1,0,0,0]]];
CONST speeddata vSlowTurn:=[1000,30,5000,1000];
CONST zonedata z03:=[FALSE,0.3,0.3,0.3,3,0.3,3];
VAR triggdata t1;
VAR triggdata t2;
VAR num on:=1;
"""


def test_a_move_takes_its_length_over_its_speed() -> None:
    found = ran(f"{THERE} MoveL {target(350)},v20,fine,tool0;", declared=DECLARED)
    move = found.moves
    assert move.ends[1] - move.begins[1] == pytest.approx(2.5, abs=1e-6)
    assert found.seconds == pytest.approx(move.ends[1])
    assert move.lines.tolist() == [11, 11]


@pytest.mark.parametrize(
    ("before", "option", "seconds"),
    [
        ("VelSet 50,5000;", "v20", 5.0),
        ("VelSet 100,10;", "v20", 5.0),
        ("VelSet 50,10;", "v20\\T:=1", 2.0),
        ("", "v1000\\V:=25", 2.0),
        ("", "v20\\T:=1", 1.0),
    ],
)
def test_speeds_are_scaled_and_limited(before: str, option: str, seconds: float) -> None:
    move = ran(f"{THERE} {before} MoveL {target(350)},{option},fine,tool0;").moves
    assert move.ends[1] - move.begins[1] == pytest.approx(seconds, abs=1e-6)


def test_the_panel_slows_everything() -> None:
    body = f"{THERE} MoveL {target(350)},v20,fine,tool0;"
    slow = ran(body, Scenario(joints=HOME, override=50.0)).moves
    assert slow.ends[1] - slow.begins[1] == pytest.approx(5.0, abs=1e-6)


def test_a_turn_that_takes_longer_sets_the_time() -> None:
    turned = target(300).replace("[0,1,0,0]", "[0,0.70710678,0.70710678,0]")
    move = ran(f"{THERE} MoveL {turned},vSlowTurn,fine,tool0;", declared=DECLARED).moves
    assert move.ends[1] - move.begins[1] == pytest.approx(3.0, abs=1e-5)


def test_an_arc_is_as_long_as_its_circle() -> None:
    move = ran(f"{THERE} MoveC {target(310, 10)},{target(320)},v20,fine,tool0;").moves
    assert move.lengths[1] == pytest.approx(10.0 * np.pi, abs=1e-4)
    three_quarters = ran(f"{THERE} MoveC {target(320)},{target(310, -10)},v20,fine,tool0;").moves
    assert three_quarters.lengths[1] == pytest.approx(15.0 * np.pi, abs=1e-4)


def test_targets_lie_in_the_work_object_with_the_displacement_of_the_program() -> None:
    body = f"""
    MoveL {target(10, 0, 300)},v100,fine,tool0\\WObj:=part;
    PDispSet [[0,0,30],[1,0,0,0]];
    MoveL {target(10, 0, 300)},v100,fine,tool0\\WObj:=part;
    PDispOff;
    MoveL Offs({target(10, 0, 300)},0,5,0),v100,fine,tool0\\WObj:=part;
    """
    moves = ran(body, declared=DECLARED).moves
    tips = moves.Ts_base_tip(moves.along_path)[:, :3, 3]
    assert tips == pytest.approx(np.array([[100, 10, 310], [100, 10, 340], [95, 10, 310]]), abs=1e-4)
    assert moves.tips(moves.along_path[1:]) == pytest.approx(tips[1:], abs=1e-4)
    assert moves.lengths[1:] == pytest.approx([30.0, np.hypot(30.0, 5.0)], abs=1e-4)


def test_the_program_goes_on_as_a_zone_is_entered_and_behind_a_stop_as_it_is_reached() -> None:
    body = f"""
    {THERE}
    MoveL {target(310)},v10,z03,tool0; SetDO doValve,1;
    MoveL {target(310.2)},v10,z03,tool0; SetDO doUV,1;
    MoveL {target(320)},v10,fine,tool0; SetDO doValve,0;
    """
    found = ran(body, declared=DECLARED)
    start = found.moves.ends[0]
    assert [each.time - start for each in found.switchings] == pytest.approx([0.97, 1.01, 2.0], abs=1e-5)
    assert found.corners_missed == ()
    assert ran(body.replace("SetDO doUV,1;", "WaitTime 1;"), declared=DECLARED).corners_missed == (2,)


def test_outputs_switch_where_their_triggers_have_it() -> None:
    body = f"""
    {THERE}
    TriggIO t1,2\\Start\\DOp:=doValve,on; TriggIO t2,3\\DOp:=doUV,1;
    TriggL {target(310)},v10,t1\\T2:=t2,z03,tool0;
    TriggSpeed t1,0,0.04,aoFlow,0.5*on\\DipLag:=0.02;
    TriggL {target(320)},v10,t1,fine,tool0;
    TriggEquip t1,2,0.1\\DOp:=doValve,0;
    TriggL {target(330)},v10,t1,fine,tool0;
    IF doUV=1 TPWrite "lamp";
    """
    found = ran(body, declared=DECLARED)
    start = found.moves.ends[0]
    assert [(each.signal, each.value, each.move) for each in found.switchings] == [
        ("dovalve", 1.0, 1), ("douv", 1.0, 1), ("aoflow", 0.5, 2), ("dovalve", 0.0, 3),
    ]  # fmt: skip
    assert [each.time - start for each in found.switchings] == pytest.approx([0.2, 0.7, 2.0, 2.7], abs=1e-5)
    flow = found.switchings[2]
    assert (flow.flow, flow.lag, flow.dip_lag) == (True, pytest.approx(0.04), pytest.approx(0.02))
    assert shown(found) == ["lamp"]


def test_a_trigger_that_nothing_defined_is_an_error() -> None:
    found = ran(f"{THERE} TriggL {target(310)},v10,t1,fine,tool0;", declared=DECLARED)
    assert (found.ended, "is not defined" in found.reason) == ("error", True)


def test_joints_move_in_the_time_that_they_are_given_and_are_known_afterwards() -> None:
    body = """
    MoveAbsJ [[0,-10,20,0,45,-20],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v20\\T:=3,fine,tool0;
    now:=CJointT();
    """
    found = ran(body, declared="VAR jointtarget now;")
    assert found.seconds == pytest.approx(3.0)
    assert np.array(part(found, "now")) == pytest.approx([0, -10, 20, 0, 45, -20], abs=1e-4)
    back = f"MoveAbsJ [[0,-10,20,0,45,-30],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,fine,tool0; {THERE}"
    line = ran(f"{back} now:=CJointT(); where:=CRobT();", declared="VAR jointtarget now; VAR robtarget where;")
    assert part(line, "where") == pytest.approx((300.0, 0.0, 300.0), abs=1e-3)


def test_moves_in_one_go_are_those_taken_one_by_one() -> None:
    """A constant target is executed in a batch, the same from a variable is not."""
    rng = np.random.default_rng(3)
    places = np.round(300.0 + rng.uniform(0.0, 20.0, (40, 3)), 4)
    speeds, zones = ["v10", "v20", "vSlowTurn"], ["z03", "fine", "z1"]
    lines = [(target(*place), speeds[k % 3], zones[k % 3 if k % 4 else 0]) for k, place in enumerate(places.tolist())]
    batch = ran("\n".join(f"MoveL {at},{v},{z},tool0\\WObj:=part;" for at, v, z in lines), declared=DECLARED)
    single = ran(
        "\n".join(f"MoveL Offs({at},0,0,0),{v},{z},tool0\\WObj:=part;" for at, v, z in lines), declared=DECLARED
    )
    for name in ("places", "turns", "zones", "speeds", "begins", "ends", "lengths", "frames", "lines"):
        assert getattr(batch.moves, name) == pytest.approx(getattr(single.moves, name), abs=1e-9), name
    assert batch.seconds == pytest.approx(single.seconds)


STOPPING = f"""
{THERE}
MoveL {target(310)},v10,z03,tool0;
TriggIO t1,5\\DOp:=doValve,1;
TriggL {target(320)},v10,t1,z03,tool0;
MoveL {target(330)},v10,fine,tool0;
SetDO doUV,1;
"""
SAFE = """
PERS num stopped:=0;
VAR num lost:=0;
PROC safe()
  IF doValve=1 stopped:=stopped+1;
  SetDO doValve,0;
  lost:=1;
ENDPROC
"""


def test_a_stop_runs_what_is_tied_to_it_and_the_program_goes_on_where_it_stood() -> None:
    scenario = Scenario(joints=HOME, ties={"Stop": ("safe",)})
    whole = ran(STOPPING, scenario, declared=DECLARED + SAFE)
    start = float(whole.moves.ends[0])
    for after, valve in ((0.5, 0.0), (1.2, 0.0), (1.7, 1.0), (2.9, 1.0)):
        running = controller(STOPPING, scenario, declared=DECLARED + SAFE)
        running.run_until(start + 0.1)
        other = running.copy()
        other.stop_at(start + after)
        stopped = other.execution()
        assert (stopped.signals["dovalve"], stopped.data["stopped"]) == (0.0, valve)
        other.go_on()
        went = other.execution()
        assert (went.ended, went.signals["douv"], went.seconds) == ("end", 1.0, pytest.approx(whole.seconds))
        assert went.signals["dovalve"] == (0.0 if valve else 1.0)
        assert went.moves.ends == pytest.approx(whole.moves.ends)
        running.run_until(np.inf)
        assert running.execution().switchings == whole.switchings


def test_a_program_that_begins_anew_finds_the_arm_where_it_stood() -> None:
    running = controller(STOPPING, declared=DECLARED + SAFE)
    first = float(running.copy().state.clock)
    running.run_until(first)
    running.run_until(float(ran(STOPPING, declared=DECLARED + SAFE).moves.ends[0]) + 1.5)
    running.stop_at(running.state.until, "QStop")
    running.note_from_here()
    running.from_main(Scenario(joints=HOME, data={"stopped": 9.0}))
    running.run_until(np.inf)
    found = running.execution()
    assert found.moves.lengths[0] == pytest.approx(15.0, abs=1e-4)
    assert (found.data["stopped"], found.data["lost"], found.ended) == (9.0, 0.0, "end")


def test_after_a_power_failure_outputs_are_what_the_controller_gives_them() -> None:
    scenario = Scenario(joints=HOME, ties={"PowerOn": ("safe",)})
    running = controller("SetDO doUV,1; SetDO doValve,1; WaitTime 9;", scenario, declared=SAFE)
    running.run_until(1.0)
    assert running.execution().signals["douv"] == 1.0
    running.power_failure({"dovalve": 1.0})
    found = running.execution()
    assert (found.signals["douv"], found.signals["dovalve"], found.data["stopped"]) == (0.0, 0.0, 1.0)


def test_an_event_that_is_tied_to_nothing_is_an_error() -> None:
    found = ran('TPWrite "on";', Scenario(joints=HOME, ties={"Start": ("missing",)}))
    assert (found.ended, "is tied to missing" in found.reason) == ("error", True)


@pytest.mark.parametrize("count", [1, 2, 30])
def test_a_routine_of_the_program_that_bears_the_name_of_a_move_is_called_in_its_place(count: int) -> None:
    own = 'PROC MoveL(robtarget goal, speeddata v, zonedata z, num held)\nTPWrite "own";\nENDPROC'
    found = ran(f"MoveL {target(300)},v100,fine,one;\n" * count, declared=f"PERS num one:=1;\n{own}")
    assert shown(found) == ["own"] * count
    assert not found.moves.ends.size
