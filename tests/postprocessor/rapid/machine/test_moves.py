"""Single moves with known answers: where the arm is along them, how long joints take, tools, attitudes, corners."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from math import cos, pi, sin
from typing import TypeAlias, cast

import numpy as np
import pytest

from geoprint.postprocessor.rapid.machine import Execution, Scenario
from geoprint.postprocessor.rapid.machine.moves import rounded_lengths
from tests.postprocessor.rapid.machine.tasks import HOME, ran, target

NONE = "[9E9,9E9,9E9,9E9,9E9,9E9]"
HALF = 0.70710678
DECLARED = """
VAR jointtarget joints; VAR robtarget here; VAR pos where; VAR triggdata t1; VAR triggdata t2;
PERS tooldata long:=[TRUE,[[0,0,100],[1,0,0,0]],[0.001,[0,0,0.001],[1,0,0,0],0,0,0]];
CONST speeddata vSlowTurn:=[1000,30,5000,1000];
CONST zonedata z4:=[FALSE,4,4,4,3,4,3];
CONST num quick:=100;
"""
Write: TypeAlias = Callable[[str], str]
THERE = f"MoveL {target(300)},v100,fine,tool0;"


def as_written(at: str) -> str:
    return at


def single(at: str) -> str:
    """The same target, but from an expression, so that its move is executed by itself."""
    return f"Offs({at},0,0,0)"


def moved(body: str, *, override: float = 100.0) -> Execution:
    found = ran(body, Scenario(joints=HOME, override=override), declared=DECLARED)
    assert (found.ended, found.reason) == ("end", "")
    return found


def absolute(angles: str, rest: str) -> str:
    return f"MoveAbsJ [[{angles}],{NONE}],{rest},tool0;"


START = absolute("0,0,0,0,30,0", "v20\\T:=1,fine")
# The flange is 364.35 mm from the first axis; its way is told at 16 chords.
ARC = 32.0 * (302.0 + 72.0 * 0.8660254) * sin(pi / 64.0)


@pytest.mark.parametrize(
    ("angles", "speed", "before", "override", "seconds"),
    [
        ("90,0,0,0,30,0", "v20", "", 100.0, ARC / 20.0),
        ("90,0,0,0,30,0", "v1000\\V:=25", "", 100.0, ARC / 25.0),
        ("90,0,0,0,30,0", "v20\\T:=7", "", 50.0, 14.0),
        ("90,0,0,0,30,0", "v1000", "VelSet 100,10;", 100.0, ARC / 10.0),
        # Axes 1 to 3 make 250 degrees/s, 4 and 5 320, 6 makes 420.
        ("90,0,0,0,30,0", "vmax", "", 100.0, 90.0 / 250.0),
        ("-90,0,0,0,30,0", "vmax", "", 40.0, 90.0 / 100.0),
        ("0,0,0,0,30,90", "[1000,30,5000,1000]", "", 100.0, 3.0),
        ("0,0,0,0,30,-90", "vSlowTurn", "VelSet 50,5000;", 100.0, 6.0),
        ("0,0,0,0,30,84", "[1000,5000,5000,1000]", "", 100.0, 0.2),
    ],
)
def test_joints_take_the_time_of_the_tip_of_its_turn_or_of_the_slowest_axis(
    angles: str, speed: str, before: str, override: float, seconds: float
) -> None:
    move = moved(f"{START} {before} {absolute(angles, f'{speed},fine')}", override=override).moves
    assert move.ends[1] - move.begins[1] == pytest.approx(seconds, rel=1e-5)
    assert move.lengths[1] == pytest.approx(ARC if "90,0" in angles else 0.0, abs=1e-3)


def test_joints_are_told_as_they_are_ordered() -> None:
    moves = moved(f"MoveAbsJ [[10,-20,30,40,50,-60],{NONE}]\\NoEOffs,v100,z4,long; {THERE}").moves
    angles = np.degrees([*moves.places[0], *moves.turns[0, :3]])
    assert angles == pytest.approx([10.0, -20.0, 30.0, 40.0, 50.0, -60.0], abs=1e-6)
    assert moves.turns[0, 3] == 0.0
    assert (moves.configurations[0].tolist(), moves.files.tolist()) == ([0.0] * 4, [0, 0])
    assert (moves.speeds.tolist(), moves.zones.tolist()) == ([100.0, 100.0], [4.0, 0.0])
    assert [moves.names[k] for k in moves.tools] == ["long", "tool0"]
    assert moves.along_path.tolist() == [1]


def test_in_the_middle_of_a_move_of_joints_they_are_in_the_middle_of_their_ways() -> None:
    order = absolute("90,8,-16,0,30,40", "vmax\\T:=2,z200")
    found = moved(f"{START} {order} joints:=CJointT();")
    share = 1.0 - 200.0 / float(found.moves.lengths[1])
    angles, axes = cast("tuple[tuple[float, ...], tuple[float, ...]]", found.data["joints"])
    assert angles == pytest.approx(np.array([90.0, 8.0, -16.0, 0.0, 0.0, 40.0]) * share + [0, 0, 0, 0, 30, 0], abs=1e-4)
    assert axes == pytest.approx([9e9] * 6)


def test_in_the_middle_of_a_line_the_tip_is_in_the_middle() -> None:
    """A zone of 4 mm is entered 4 mm before the target, one that is too large half way."""
    turned = f"[[320,0,300],[0,{HALF},{HALF},0],[0,0,0,0],{NONE}]"
    found = moved(f"{THERE} MoveL {target(320)},v20,z4,tool0; where:=CPos(); here:=CRobT();")
    assert found.data["where"] == pytest.approx((316.0, 0.0, 300.0), abs=1e-4)
    place, turn, _, axes = cast("tuple[tuple[float, ...], ...]", found.data["here"])
    assert (place, turn) == (
        pytest.approx((316.0, 0.0, 300.0), abs=1e-4),
        pytest.approx((0.0, 1.0, 0.0, 0.0), abs=1e-6),
    )
    assert axes == pytest.approx([9e9] * 6)
    half = moved(f"{THERE} MoveL {turned},v20,z200,tool0; here:=CRobT();")
    place, turn, *_ = cast("tuple[tuple[float, ...], ...]", half.data["here"])
    assert place == pytest.approx((310.0, 0.0, 300.0), abs=1e-4)
    # A quarter turn about the vertical is half done.
    assert turn == pytest.approx((0.0, 0.92387953, 0.38268343, 0.0), abs=1e-6)
    over = moved(f"{THERE} MoveL {turned.replace(f'{HALF},{HALF}', f'-{HALF},-{HALF}')},v20,z200,tool0; here:=CRobT();")
    _, other, *_ = cast("tuple[tuple[float, ...], ...]", over.data["here"])
    assert np.abs(np.dot(other, turn)) == pytest.approx(1.0, abs=1e-6)


def test_another_tool_begins_where_its_own_tip_is() -> None:
    found = moved(
        f"{THERE} MoveL {target(300, 0, 180)},v10,fine,long; where:=CPos(); MoveL {target(300)},v10,fine,tool0;"
    )
    assert found.moves.lengths[1:] == pytest.approx([20.0, 20.0], abs=1e-4)
    assert found.data["where"] == pytest.approx((300.0, 0.0, 180.0), abs=1e-4)
    single = moved(f"{THERE} MoveL Offs({target(300, 0, 180)},0,0,0),v10,fine,long;")
    assert single.moves.lengths[1] == pytest.approx(20.0, abs=1e-4)
    joints = moved(f"{START} here:=CRobT(); MoveL Offs(here,0,0,-20),v10,fine,long;")
    assert joints.moves.lengths[1] == pytest.approx(np.hypot(100.0 * cos(pi / 6.0), 30.0), abs=1e-3)


def test_joints_behind_a_line_are_the_nearest_to_those_before_with_their_turns() -> None:
    down = absolute("0,0,0,0,90,300", "v20\\T:=1,fine")
    found = moved(f"{down} here:=CRobT(); MoveL Offs(here,0,0,0),v20,fine,tool0; joints:=CJointT();")
    angles, _ = cast("tuple[tuple[float, ...], tuple[float, ...]]", found.data["joints"])
    assert angles == pytest.approx([0.0, 0.0, 0.0, 0.0, 90.0, 300.0], abs=1e-3)
    written = f"MoveL [[302,0,558],[0,-0.5,0.8660254,0],[0,0,0,0],{NONE}],v20,fine,tool0;"
    for again in (written, written * 2, written.replace("MoveL", "MoveJ") + written):
        angles, _ = cast(
            "tuple[tuple[float, ...], tuple[float, ...]]", moved(f"{down} {again} joints:=CJointT();").data["joints"]
        )
        assert angles == pytest.approx([0.0, 0.0, 0.0, 0.0, 90.0, 300.0], abs=1e-2)
    over = absolute("0,0,0,180,-90,-120", "v20\\T:=1,fine")
    flipped = moved(
        f"{over} here:=CRobT(); MoveL Offs(here,5,0,0),v20,fine,tool0;"
        "MoveL Offs(here,0,0,0),v20,fine,tool0; joints:=CJointT();"
    )
    angles, _ = cast("tuple[tuple[float, ...], tuple[float, ...]]", flipped.data["joints"])
    assert angles == pytest.approx([0.0, 0.0, 0.0, 180.0, -90.0, -120.0], abs=1e-3)
    beyond = moved(f"{down} here:=CRobT(); MoveL Offs(here,0,0,-2000),v1000,fine,tool0; joints:=CJointT();")
    angles, _ = cast("tuple[tuple[float, ...], tuple[float, ...]]", beyond.data["joints"])
    assert angles == pytest.approx([0.0, 0.0, 0.0, 0.0, 90.0, 300.0], abs=1e-3)


@pytest.mark.parametrize("write", [as_written, single])
@pytest.mark.parametrize(
    ("turns", "seconds"),
    [
        (("0,1,0,0", "0,-1,0,0"), (1.0, 1.0)),
        (("0,-1,0,0", "0,1,0,0"), (1.0, 1.0)),
        ((f"0,{HALF},{HALF},0", f"0,{-HALF},{-HALF},0"), (3.0, 1.0)),
        (("0,0,1,0", f"0,-{HALF},{HALF},0"), (6.0, 3.0)),
        ((f"0,{HALF},-{HALF},0", f"0,-{HALF},-{HALF},0"), (3.0, 6.0)),
        (("0,1.0009,0,0", "0,0.9991,0,0"), (1.0, 1.0)),
        ((f"0,{HALF},0,{HALF}", "0,1,0,0"), (3.0, 3.0)),
        ((f"{HALF},{HALF},0,0", "0,1,0,0"), (3.0, 3.0)),
        (("0.5,0.5,0.5,0.5", "0,1,0,0"), (4.0, 4.0)),
    ],
)
def test_a_turn_is_as_large_as_its_smaller_way(
    write: Write, turns: tuple[str, str], seconds: tuple[float, float]
) -> None:
    """30 degrees a second, of moves of 30 mm at 30 mm/s; a quaternion and its opposite are one attitude."""
    places = [target(300 + 30 * k).replace("0,1,0,0", turn) for k, turn in enumerate(turns, start=1)]
    moves = moved(
        f"{THERE} VelSet 100,30; " + "".join(f"MoveL {write(at)},vSlowTurn,fine,tool0;" for at in places)
    ).moves
    assert (moves.ends - moves.begins)[1:] == pytest.approx(seconds, abs=1e-4)


@pytest.mark.parametrize("write", [as_written, single])
def test_targets_are_told_as_they_are_written(write: Write) -> None:
    at = f"[[300,10,290],[0,{HALF},{HALF},0],[1,-1,2,1],{NONE}]"
    moves = moved(f"MoveL {write(at)},v20,z4,long; MoveJ {at},v30,fine,tool0;").moves
    assert moves.places.tolist() == [[300.0, 10.0, 290.0]] * 2
    assert moves.turns[0] == pytest.approx([0.0, HALF, HALF, 0.0])
    assert moves.configurations.tolist() == [[1.0, -1.0, 2.0, 1.0]] * 2
    np.testing.assert_allclose(moves.other_axes, np.full((2, 6), 9e9))
    assert (moves.speeds.tolist(), moves.zones.tolist()) == ([20.0, 30.0], [4.0, 0.0])
    assert moves.verbs.tolist() == [0, 2]
    assert [moves.names[k] for k in moves.works] == ["wobj0", "wobj0"]
    changeable = [
        field.name for field in fields(moves) if getattr(getattr(moves, field.name), "flags", None) is not None
    ]
    assert [name for name in changeable if getattr(moves, name).flags.writeable] == []


@pytest.mark.parametrize("write", [as_written, single])
def test_axes_that_no_active_unit_has_are_refused_and_those_at_the_border_of_9e9_are_none(write: Write) -> None:
    nobody = "no mechanical unit is active"
    for number, reason in (("8.8E9", nobody), ("0", nobody), ("8.95E9", "")):
        there = write(target(300).replace("9E9", number, 1))
        found = ran(f"MoveL {there},v20,fine,tool0;", Scenario(joints=HOME), declared=DECLARED)
        assert (reason in found.reason, found.ended) == (True, "error" if reason else "end")


@pytest.mark.parametrize("write", [as_written, single])
@pytest.mark.parametrize(
    ("trigger", "seconds", "distance"),
    [
        ("TriggIO t1,5\\Start\\DOp:=doValve,1;", 0.5, 5.0),
        ("TriggIO t1,5\\DOp:=doValve,1;", 1.5, 5.0),
        ("TriggIO t1,0\\DOp:=doValve,1;", 2.0, 0.0),
        ("TriggIO t1,50\\Start\\DOp:=doValve,1;", 2.0, 50.0),
        ("TriggIO t1,0.3\\Start\\Time\\DOp:=doValve,1;", 0.3, 0.3),
        ("TriggIO t1,0.3\\Time\\DOp:=doValve,1;", 1.7, 0.3),
        ("TriggIO t1,30\\Time\\DOp:=doValve,1;", 0.0, 30.0),
        ("TriggEquip t1,5,0.2\\DOp:=doValve,1;", 1.3, 5.0),
        ("TriggEquip t1,5\\Start,0.2\\DOp:=doValve,1;", 0.3, 5.0),
        ("TriggEquip t1,5\\Start,-0.2\\DOp:=doValve,1;", 0.7, 5.0),
        ("TriggEquip t1,5\\Start,0.8\\DOp:=doValve,1;", 0.0, 5.0),
        ("TriggEquip t1,1,-0.8\\DOp:=doValve,1;", 2.0, 1.0),
        ("TriggEquip t1,quick/50+3,0.2\\DOp:=doValve,1;", 1.3, 5.0),
    ],
)
def test_a_trigger_switches_at_its_distance_or_time_within_the_move(
    write: Write, trigger: str, seconds: float, distance: float
) -> None:
    found = moved(f"{THERE} {trigger} TriggL {write(target(320))},v10,t1,fine,tool0; SetDO doUV,1;")
    switching = found.switchings[0]
    assert switching.time - found.moves.ends[0] == pytest.approx(seconds, abs=1e-5)
    assert (switching.signal, switching.value, switching.move, switching.distance) == ("dovalve", 1.0, 1, distance)
    assert switching.from_start == ("Start" in trigger)
    assert found.signals["dovalve"] == 1.0


@pytest.mark.parametrize("place", ["far", "far+0", "0+far", "Abs(far)", "2+(far-2)"])
def test_a_trigger_may_be_placed_by_what_a_routine_declares_itself(place: str) -> None:
    found = moved(
        f"VAR num far:=5; {THERE} TriggIO t1,{place}\\Start\\DOp:=doValve,1; TriggL {target(320)},v10,t1,fine,tool0;"
    )
    assert found.switchings[0].time - found.moves.ends[0] == pytest.approx(0.5, abs=1e-5)


@pytest.mark.parametrize("write", [as_written, single])
@pytest.mark.parametrize(
    ("options", "seconds"),
    [("v20\\V:=quick", 0.2), ("v20\\T:=quick", 100.0), ("v20", 1.0), ("v20\\V:=40", 0.5), ("v20\\T:=0.3", 0.3)],
)
def test_a_move_may_have_a_speed_or_time_of_its_own(write: Write, options: str, seconds: float) -> None:
    moves = moved(f"{THERE} MoveL {write(target(320))},{options},fine,tool0;").moves
    assert moves.ends[1] - moves.begins[1] == pytest.approx(seconds, rel=1e-5)


def test_a_flow_follows_the_speed_from_its_place_on() -> None:
    trigger = "TriggSpeed t1,2\\Start,0.05,aoFlow,quick*0.01\\DipLag:=0.03;"
    found = moved(f"{THERE} {trigger} TriggL {target(320)},v10,t1,fine,tool0;")
    flow = found.switchings[0]
    assert (flow.flow, flow.value, flow.from_start, flow.distance) == (True, 1.0, True, 2.0)
    assert (flow.lag, flow.dip_lag) == (pytest.approx(0.05), pytest.approx(0.03))
    assert flow.time - found.moves.ends[0] == pytest.approx(0.2, abs=1e-5)
    # What follows the speed has no value of its own.
    assert found.signals["aoflow"] == 0.0
    bare = moved(f"{THERE} TriggSpeed t1,0,0.05,aoFlow,1; TriggL {target(320)},v10,t1,fine,tool0;").switchings[0]
    assert (bare.dip_lag, bare.from_start) == (0.0, False)


def test_moves_with_triggers_in_one_go_are_those_taken_one_by_one() -> None:
    def body(write: Write) -> str:
        lines = [
            f"TriggIO t1,{k}\\Start\\DOp:=doValve,{k % 2}; TriggIO t2,0.1*{k}\\DOp:=doUV,{(k + 1) % 2};\n"
            f"TriggL {write(target(300 + 10 * k, (k % 3) * 5))},v{10 * k},t1\\T2:=t2,z4,tool0;\n"
            f"MoveL {write(target(300 + 10 * k, 7))},v20,{'fine' if k == 3 else 'z1'},tool0;"
            for k in range(1, 6)
        ]
        return THERE + "\n" + "\n".join(lines)

    batch, alone = moved(body(as_written)), moved(body(single))
    assert [(each.signal, each.value, each.move, each.distance, each.line) for each in batch.switchings] == [
        (each.signal, each.value, each.move, each.distance, each.line) for each in alone.switchings
    ]
    assert [each.time for each in batch.switchings] == pytest.approx([each.time for each in alone.switchings])
    assert batch.moves.ends == pytest.approx(alone.moves.ends)
    assert len(batch.switchings) == 10


@pytest.mark.parametrize("write", [as_written, single])
def test_a_corner_is_missed_by_what_comes_after_its_zone_is_entered(write: Write) -> None:
    """10 mm at 10 mm/s with a zone of 4 mm: the next move must be known 0.4 s before the target."""

    def missed(wait: str) -> tuple[int, ...]:
        first = f"{THERE} MoveL {write(target(310))},v10,z4,tool0;"
        found = moved(f"{first} {wait} MoveL {write(target(320))},v10,fine,tool0;")
        late = 0.001 if "0.401" in wait else 0.0
        assert found.moves.begins[2] - found.moves.ends[0] == pytest.approx(1.0 + late, abs=1e-6)
        return found.corners_missed

    assert missed("") == ()
    assert missed("WaitTime 0.001;") == (1,)
    assert missed("WaitTime 0.401;") == (1,)
    stop = moved(f"{THERE} MoveL {write(target(310))},v10,fine,tool0; WaitTime 1; MoveL {target(320)},v10,fine,tool0;")
    assert stop.corners_missed == ()


@pytest.mark.parametrize("write", [as_written, single])
def test_a_turn_on_the_spot_has_no_corner(write: Write) -> None:
    turned = target(310).replace("0,1,0,0", f"0,{HALF},{HALF},0")
    body = (
        f"{THERE} MoveL {write(target(310))},v10,fine,tool0; MoveL {write(turned)},vSlowTurn,z200,tool0; SetDO doUV,1;"
    )
    found = moved(body)
    assert found.moves.lengths[2] == pytest.approx(0.0, abs=1e-6)
    assert found.switchings[0].time == pytest.approx(float(found.moves.ends[2]))
    assert found.moves.ends[2] - found.moves.begins[2] == pytest.approx(3.0, abs=1e-4)


@pytest.mark.parametrize(
    ("through", "end", "length"),
    [
        ((310, 10), (320, 0), 10.0 * pi),
        ((310, -10), (320, 0), 10.0 * pi),
        ((310, 10), (310, -10), 15.0 * pi),
        ((320, 0), (310, -10), 15.0 * pi),
        ((310, -10), (310, 10), 15.0 * pi),
        ((310 - 10 * HALF, 10 * HALF), (310, 10), 5.0 * pi),
    ],
)
def test_an_arc_goes_through_its_place(through: tuple[float, float], end: tuple[float, float], length: float) -> None:
    move = moved(f"{THERE} MoveC {target(*through)},{target(*end)},v20,fine,tool0;").moves
    assert move.lengths[1] == pytest.approx(length, abs=1e-3)
    assert move.ends[1] - move.begins[1] == pytest.approx(length / 20.0, abs=1e-4)
    assert move.places[1, :2] == pytest.approx(end, abs=1e-4)


def test_places_a_millionth_of_a_millimetre_apart_are_one_and_have_no_corner() -> None:
    """At a right angle half of the parabola is 0.81161 of the zone long."""

    def saved(step: float) -> float:
        places = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, step, 0.0]])
        return 4.0 - float(rounded_lengths(places, np.array([0.0, 1.0, 0.0]))[0])

    assert saved(0.95e-6) == 0.0
    assert saved(1.05e-6) == pytest.approx(1.05e-6 / 2.0 * 0.18839, rel=1e-2)
    assert saved(1.0) == pytest.approx(0.5 * 0.188387, rel=1e-4)
    assert saved(10.0) == pytest.approx(0.188387, rel=1e-4)


def test_a_corner_that_turns_back_or_goes_straight_on_has_known_lengths() -> None:
    def lengths(last: float) -> list[float]:
        places = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [last, 0.0, 0.0]])
        return rounded_lengths(places, np.array([0.0, 1.0, 0.0])).tolist()

    assert lengths(9.0) == pytest.approx([4.0, 5.0], abs=1e-12)
    # There and back the parabola is flat: its half is half as long as the zone.
    assert lengths(1.0) == pytest.approx([3.5, 2.5], abs=1e-5)
    two = np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]])
    assert rounded_lengths(two, np.array([1.0, 1.0])).tolist() == [5.0]
