"""Stops, failures of the power and beginning anew: what the arm, outputs, data and modules are then."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from geoprint.postprocessor.rapid.machine import Controller, Event, Scenario
from geoprint.postprocessor.rapid.machine.execution import Execution
from tests.postprocessor.rapid.machine.tasks import HOME, controller, shown, target, task

THERE = f"MoveL {target(300)},v100,fine,tool0;"
DECLARED = """
VAR triggdata t;
VAR num count:=0;
PERS num kept:=0;
PROC note()
  Incr kept;
  TPWrite "tied "\\Num:=kept;
ENDPROC
PROC late()
  WaitTime 5;
  TPWrite "late";
ENDPROC
PROC fails()
  kept:=1/count;
ENDPROC
PROC leaves()
  EXIT;
ENDPROC
"""


def begun(body: str, *, ties: dict[Event, tuple[str, ...]] | None = None, declared: str = DECLARED) -> Controller:
    return controller(body, Scenario(joints=HOME, ties=ties or {}), declared=declared)


def done(running: Controller) -> Execution:
    running.run_until(np.inf)
    return running.execution()


def test_events_at_the_start_run_their_routines_in_order_before_the_program() -> None:
    ties: dict[Event, tuple[str, ...]] = {"Start": ("note", "late"), "Reset": ("LATE", "note"), "Stop": ("fails",)}
    found = done(begun('TPWrite "main "\\Num:=kept; WaitTime 1;', ties=ties))
    assert shown(found) == ["late", "tied 1", "tied 2", "late", "main 2"]
    # They take no time of the program.
    assert (found.ended, found.texts[-1][0], found.seconds) == ("end", 0.0, 1.0)


@pytest.mark.parametrize(
    ("routine", "ended", "reason"),
    [
        ("fails", "error", "ERR_DIVZERO: a number is divided by 0, in fails at Start"),
        ("missing", "error", "the event Start is tied to missing, which no loaded module has"),
        ("leaves", "exit", "EXIT"),
    ],
)
def test_an_event_whose_routine_fails_ends_the_program(routine: str, ended: str, reason: str) -> None:
    found = done(begun('TPWrite "never";', ties={"Start": (routine, "note")}))
    assert (found.ended, found.reason) == (ended, reason)
    assert "never" not in shown(found)


def test_time_stands_still_in_a_stop_and_what_was_to_come_goes_on() -> None:
    body = 'WaitTime 1; TPWrite "a"; WaitTime 2; TPWrite "b"; SetDO doUV,1; WaitTime 1;'
    running = begun(body, ties={"Stop": ("late",), "QStop": ("note",), "Restart": ("late", "note")})
    running.stop_at(2.0)
    assert [*running.execution().texts] == [(1.0, "a"), (7.0, "late")]
    running.stop_at(2.5, "QStop")
    running.go_on()
    found = running.execution()
    assert found.texts[2:] == ((2.5, "tied 1"), (7.5, "late"), (2.5, "tied 2"), (3.0, "b"))
    assert (found.ended, found.seconds, found.switchings[0].time) == ("end", 4.0, 3.0)


def test_a_stop_of_what_has_ended_runs_nothing_and_a_restart_that_fails_ends_it() -> None:
    running = begun("WaitTime 1;", ties={"Stop": ("note",)})
    running.stop_at(3.0)
    assert (running.execution().ended, shown(running.execution())) == ("end", [])
    failing = begun(f"{THERE} TriggIO t,1\\DOp:=doValve,1; TriggL {target(320)},v10,t,z200,tool0; WaitTime 9;",
                    ties={"Restart": ("fails",)})  # fmt: skip
    start = 0.0
    failing.run_until(start)
    failing.stop_at(float(failing.execution().moves.ends[0]) + 1.2)
    failing.go_on()
    found = failing.execution()
    assert (found.ended, found.switchings) == ("error", ())
    assert found.reason == "ERR_DIVZERO: a number is divided by 0, in fails at Restart"


def test_outputs_switch_on_the_way_up_to_the_moment_that_is_looked_at() -> None:
    body = f"{THERE} TriggIO t,5\\Start\\DOp:=doValve,1; TriggL {target(320)},v10,t,z200,tool0; SetDO doUV,1; EXIT;"
    running = begun(body)
    running.run_until(0.0)
    start = float(running.execution().moves.ends[0])
    running.run_until(start + 0.4)
    assert running.execution().signals["dovalve"] == 0.0
    assert running.execution().seconds == pytest.approx(start + 0.4)
    assert (running.execution().ended, running.execution().file, running.execution().line) == ("runs", "", 0)
    running.run_until(start + 0.6)
    assert (running.execution().signals["dovalve"], running.execution().signals["douv"]) == (1.0, 0.0)
    found = done(running)
    assert (found.ended, found.signals["douv"]) == ("exit", 1.0)
    # What is left behind by EXIT before the arm is there does not switch.
    late = done(begun(body.replace("t,5", "t,15")))
    assert [each.signal for each in late.switchings] == ["douv"]
    # At the end of the program the arm comes to its end.
    ends = done(begun(body.replace("t,5", "t,15").replace("EXIT;", "")))
    assert [each.signal for each in ends.switchings] == ["douv", "dovalve"]
    assert ends.seconds == pytest.approx(start + 2.0)


ANEW = f"""
IF begun THEN
  TPWrite "again "\\Num:=kept; TPWrite "variable "\\Num:=count; MoveL {target(300)},v100,fine,tool0; EXIT;
ENDIF
begun:=TRUE; kept:=4; count:=4;
VelSet 50,25;
PDispSet [[0,0,10],[1,0,0,0]];
SetDO doUV,1;
StartLoad\\Dynamic,diskhome\\File:="Path.mod",s; WaitLoad s;
%"go"%;
TPReadNum count,"How many?";
MoveL {target(300)},v100,fine,tool0;
TriggIO t,10\\DOp:=doValve,1;
TriggL {target(350)},v10,t,fine,tool0;
"""
PATH = 'MODULE Path\nVAR num far:=5;\nPERS num lasting:=6;\nPROC go()\nTPWrite "gone";\nENDPROC\nENDMODULE\n'


def test_beginning_anew_keeps_persistents_outputs_and_where_the_arm_stands() -> None:
    """Variables begin anew, modules that were loaded are gone, and so is what was set for the motion."""
    declared = f"PERS bool begun:=FALSE; VAR loadsession s;{DECLARED}"
    scenario = Scenario(
        joints=HOME, answers=(3.0,), ties={"Start": ("note",), "Reset": ("note",)}, signals={"diDoor": 1.0}
    )
    running = Controller(task(ANEW, declared=declared, others={"Path.mod": PATH}), scenario)
    running.run_until(0.0)
    running.run_until(40.0)
    before = running.execution()
    assert (before.questions, before.data["count"], before.loaded) == (("How many?",), 3.0, {"Main.mod", "Path.mod"})
    first, second = (float(end) for end in before.moves.ends)
    running = Controller(task(ANEW, declared=declared, others={"Path.mod": PATH}), scenario)
    running.run_until(0.0)
    # Half way: 25 of 50 mm at half of 10 mm/s.
    running.run_until(first + 5.0)
    assert second - first == pytest.approx(10.0, abs=1e-4)
    running.note_from_here()
    ties: dict[Event, tuple[str, ...]] = {"Start": ("note",)}
    running.from_main(Scenario(joints=(1.0,) * 6, override=50.0, ties=ties, data={"KEPT": 70.0}))
    found = done(running)
    assert shown(found) == ["tied 71", "again 71", "variable 0"]
    assert (found.ended, found.loaded) == ("exit", {"Main.mod"})
    assert (found.signals["douv"], found.signals["didoor"], found.signals["dovalve"]) == (1.0, 1.0, 0.0)
    # From (325, 0, 310) to (300, 0, 300), at half of 100 mm/s.
    assert found.moves.lengths.tolist() == pytest.approx([np.hypot(25.0, 10.0)], abs=1e-3)
    assert found.moves.ends - found.moves.begins == pytest.approx(np.hypot(25.0, 10.0) / 50.0, abs=1e-4)
    assert found.moves.begins[0] == pytest.approx(first + 5.0)
    assert (found.data["far"], found.data["lasting"]) == (None, None)


def test_an_arm_that_was_stopped_on_joints_begins_anew_from_there() -> None:
    axes = "[9E9,9E9,9E9,9E9,9E9,9E9]"
    body = f"""
    IF kept=1 THEN joints:=CJointT(); EXIT; ENDIF
    kept:=1;
    MoveAbsJ [[0,0,0,0,30,0],{axes}],v100\\T:=1,fine,tool0;
    MoveAbsJ [[40,0,20,0,30,-8],{axes}],v100\\T:=4,fine,tool0;
    """
    running = begun(body, declared=f"VAR jointtarget joints;{DECLARED}")
    running.run_until(2.0)
    running.from_main(Scenario(joints=HOME))
    begun_anew = running.execution()
    assert (begun_anew.ended, begun_anew.reason, begun_anew.file, begun_anew.line) == ("runs", "", "", 0)
    angles, _ = cast("tuple[tuple[float, ...], tuple[float, ...]]", done(running).data["joints"])
    assert angles == pytest.approx((10.0, 0.0, 5.0, 0.0, 30.0, -2.0), abs=1e-4)


def test_a_power_failure_leaves_the_data_and_runs_what_is_tied_to_it() -> None:
    running = begun("kept:=5; SetDO doUV,1; SetAO aoFlow,2; WaitTime 9;", ties={"PowerOn": ("note",)})
    running.run_until(1.0)
    running.power_failure({"aoflow": 2.0})
    found = running.execution()
    assert (found.signals["douv"], found.signals["aoflow"], found.data["kept"]) == (0.0, 2.0, 6.0)
    running.power_failure()
    assert set(running.execution().signals.values()) == {0.0}
    assert done(running).ended == "end"


def test_a_copy_goes_its_own_way() -> None:
    body = f"""
    {THERE} FOR i FROM 1 TO 3 DO Incr count; TPReadNum kept,"?"; WaitTime 1; SetDO doUV,count; ENDFOR
    MoveL {target(310)},v10,fine,tool0;
    """
    running = controller(body, Scenario(joints=HOME, answers=(1.0, 2.0, 3.0)), declared=DECLARED)
    running.run_until(0.0)
    start = float(running.execution().moves.ends[0])
    running.run_until(start + 1.5)
    other = running.copy()
    other.run_until(np.inf)
    one, two = running.execution(), other.execution()
    assert (one.ended, one.data["count"], one.data["kept"], len(one.switchings), len(one.moves.ends)) == (
        "runs", 2.0, 2.0, 1, 1,
    )  # fmt: skip
    assert (two.ended, two.data["count"], two.data["kept"], len(two.switchings), len(two.moves.ends)) == (
        "end", 3.0, 3.0, 3, 2,
    )  # fmt: skip
    assert (len(one.questions), len(two.questions)) == (2, 3)
    whole = done(running)
    assert (whole.seconds, whole.switchings, whole.questions) == (two.seconds, two.switchings, two.questions)
    assert (whole.moves.lengths.tolist(), whole.line, whole.file) == (two.moves.lengths.tolist(), two.line, two.file)
