"""What the interpreter of URScript makes of statements, threads, moves and outputs: answers that are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from geoprint.errors import VerificationError
from geoprint.model import FloatArray
from geoprint.postprocessor.urscript.execution import execute
from geoprint.postprocessor.urscript.language import Call, Constant, Name, Operation, parse_script
from geoprint.postprocessor.urscript.log import Log, Scenario
from geoprint.postprocessor.urscript.motion import Arc, Line, places_of
from geoprint.postprocessor.urscript.poses import Pose, pose_inv, pose_of_matrix, pose_trans


def gantry(joints: FloatArray) -> FloatArray:
    """Return flanges of an arm whose first joints are its place in dm, and whose last turn it about z, y and x."""
    frames = np.tile(np.eye(4), (len(joints), 1, 1))
    frames[:, :3, 3] = 100.0 * joints[:, :3]
    for frame, (a, b, c) in zip(frames, joints[:, 3:].tolist(), strict=True):
        z = np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
        y = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
        x = np.array([[1, 0, 0], [0, math.cos(c), -math.sin(c)], [0, math.sin(c), math.cos(c)]])
        frame[:3, :3] = z @ y @ x
    return frames


def ran(*lines: str, scenario: Scenario = Scenario((0.0,) * 6)) -> Log:  # noqa: B008
    text = "\n".join(["def program():", *(f"  {line}" for line in lines), "end"])
    return execute(parse_script("x.script", text), scenario, gantry)


def refused(*lines: str) -> str:
    with pytest.raises(VerificationError) as caught:
        ran(*lines)
    return str(caught.value).partition(". Do not run")[0]


MOVE = "movep(p[{},{},0,0,0,0], a=1, v=0.1, r={})"


def test_operators_bind_as_in_the_manual() -> None:
    said = [
        "global c = [4]",
        "global a = 1 + 2 * 3 - c[0] / 2",
        "if not a < 5 and a == 5 or False:",
        "  sleep(1)",
        "end",
    ]
    assert ran(*said).time == pytest.approx(1.0, abs=0.003)
    script = parse_script("x", "def p():\n  global a = -b[0] * 2\nend")
    product = Operation("*", (Operation("-", (Operation("[", (Name("b"), Constant(0))),)), Constant(2)))
    assert script.main.body[0].value == product


def test_arguments_may_have_names_and_comments_stay_out_of_texts() -> None:
    script = parse_script("x", 'def p():\n  popup("a # b", blocking=True) # c\nend')
    (statement,) = script.main.body
    assert isinstance(statement.value, Call)
    assert statement.value.arguments == (Constant("a # b"),)
    assert statement.value.named == (("blocking", Constant(True)),)  # noqa: FBT003
    assert script.comments == ((2, "c"),)


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["global run = 1"], "a name must stand here"),
        (["while True:"], "no 'end' closes what begins here"),
        (["global a = (1"], "')' must stand here"),
        (["a $ b"], "'$ b' is not understood"),
        (["movep(p[1,2,3], a=1)"], "a pose has six numbers"),
        (["global a = b"], "b has no value here"),
        (["a = 1"], "a is neither global nor local here"),
        (["stopj(2)"], "there is no function stopj"),
        (["sync(1)"], "sync is called with other arguments"),
        (["global a = 1 / 0"], "a division by 0"),
        (["if 1:", "end"], "a condition must be True or False"),
        (["set_standard_digital_out(8, True)"], "there is no standard output 8"),
        (["set_standard_digital_out(0, 1)"], "an output is set to True or False"),
        (["while True:", "end"], "it needs sync() or sleep()"),
        ([MOVE.format(0.1, 0, 0.01)], "a blend has no move behind it"),
        ([MOVE.format(0.1, 0, 0.06), MOVE.format(0.1, 0.1, 0.05), MOVE.format(0, 0.1, 0)], "overlap"),
        ([MOVE.format(0.1, 0, 0.01), "sleep(0.1)", MOVE.format(0.1, 0.1, 0)], "takes time where a blend leads on"),
        (["movep(p[0,0,0,0,0,1], a=1, v=0.1)"], "the tool turns on the spot: that needs a time"),
        (["movel(p[0.1,0,0,0,0,0], t=1)", "set_tcp(p[0,0,0.1,0,0,0])"], "the tool is set on the path"),
    ],
)
def test_what_is_not_of_the_subset_is_refused_with_its_line(lines: list[str], reason: str) -> None:
    said = refused(*lines)
    assert reason in said
    assert said.startswith("x.script, line ")


def test_a_straight_move_ramps_evenly_up_and_down() -> None:
    # 100 mm at 0.1 m/s and 1 m/s2: 0.1 s and 5 mm for each ramp, 0.9 s between.
    log = ran(MOVE.format(0.1, 0, 0))
    (move,) = log.moves
    assert move.ends == pytest.approx(1.1)
    times = np.array([0.0, 0.05, 0.1, 0.55, 1.0, 1.05, 1.1])
    way = 1e3 * places_of(log.pieces, times)[:, 0]
    np.testing.assert_allclose(way, [0.0, 1.25, 5.0, 50.0, 95.0, 98.75, 100.0], atol=1e-9)


def test_a_move_too_short_for_its_speed_turns_round_half_way() -> None:
    log = ran(MOVE.format(0.004, 0, 0))
    assert log.moves[0].ends == pytest.approx(2.0 * math.sqrt(0.004))


def test_a_blend_is_a_circular_arc_that_touches_both_lines_at_its_radius() -> None:
    log = ran(MOVE.format(0.1, 0, 0.02), MOVE.format(0.1, 0.1, 0))
    first, arc, last = (piece.way for piece in log.pieces)
    assert isinstance(arc, Arc)
    assert isinstance(first, Line)
    assert isinstance(last, Line)
    np.testing.assert_allclose(arc.place(0.0), (0.08, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(arc.place(arc.length), (0.1, 0.02, 0.0), atol=1e-12)
    assert arc.length == pytest.approx(0.02 * math.pi / 2.0)
    # The middle of the arc, whose centre is (80, 20) mm.
    away = 0.02 * math.sqrt(0.5)
    np.testing.assert_allclose(arc.place(arc.length / 2.0), (0.08 + away, 0.02 - away, 0.0), atol=1e-12)
    assert arc.nearest((0.1, 0.0, 0.0)) == pytest.approx(arc.length / 2.0)
    # The speed is kept: ramps of 5 mm in 0.1 s at both ends only.
    length = 0.08 + arc.length + 0.08
    assert log.moves[-1].ends == pytest.approx(0.2 + (length - 0.01) / 0.1)
    assert places_of(log.pieces, np.array([log.moves[0].ends]))[0, 0] == pytest.approx(0.08)


def test_a_statement_behind_a_blended_move_is_made_where_its_blend_begins() -> None:
    log = ran(MOVE.format(0.1, 0, 0.02), "set_standard_digital_out(3, True)", MOVE.format(0.1, 0.1, 0))
    (switch,) = log.switches
    assert 0.0 <= switch.time - log.moves[0].ends < 0.002
    assert (switch.output, switch.on, switch.line) == ("standard 3", True, 3)


def test_a_thread_goes_on_every_2_ms_and_reads_where_the_tool_is() -> None:
    log = ran(
        "thread watch():",
        "  local here = get_target_tcp_pose()",
        "  while here[0] < 0.0505:",
        "    sync()",
        "    here = get_target_tcp_pose()",
        "  end",
        "  set_configurable_digital_out(7, True)",
        "end",
        "local watching = run watch()",
        MOVE.format(0.1, 0, 0),
        "join watching",
    )
    (switch,) = log.switches
    # At 0.1 m/s, 50 mm are passed after 0.55 s.
    assert switch.time == pytest.approx(0.556, abs=1e-9)
    assert (switch.output, switch.line, switch.thread) == ("configurable 7", 8, "watch")


def test_a_thread_that_is_killed_does_no_more() -> None:
    log = ran(
        "thread late():", "  sleep(0.1)", "  set_standard_digital_out(0, True)", "end",
        "local thrd = run late()", "sleep(0.05)", "kill thrd", "sleep(0.2)",
    )  # fmt: skip
    assert log.switches == []


def test_outputs_go_low_at_the_end_where_their_run_state_says_so() -> None:
    lines = ["set_standard_digital_out(0, True)", "set_tool_digital_out(1, True)", "sleep(1)"]
    state = "set_runstate_standard_digital_output_to_value(0, 1)"
    assert ran(*lines).lit == ("standard 0", "tool 1")
    assert ran(state, *lines).lit == ("tool 1",)
    stopped = ran(state, *lines, scenario=Scenario((0.0,) * 6, stops_at=0.5))
    assert (stopped.ended, stopped.lit) == ("stopped", ("tool 1",))


def test_who_is_asked_may_stop_the_program() -> None:
    lines = ['popup("go on?", blocking=True)', "set_standard_digital_out(0, True)"]
    assert len(ran(*lines).switches) == 1
    stopped = ran(*lines, scenario=Scenario((0.0,) * 6, goes_on=False))
    assert (stopped.ended, stopped.switches, stopped.asked) == ("halt", [], ["go on?"])


def test_settings_and_held_variables_count_instead_of_what_the_program_sets() -> None:
    lines = ["global a = 1", "global b = 1", "global a = a + 1", "global b = b + 1", "sleep(a)", "sleep(b)"]
    assert ran(*lines, scenario=Scenario((0.0,) * 6, settings=(("a", 5),))).time == pytest.approx(8.0, abs=0.005)
    assert ran(*lines, scenario=Scenario((0.0,) * 6, held=(("a", 5),))).time == pytest.approx(7.0, abs=0.005)


def test_poses_follow_one_another_and_turn_back() -> None:
    quarter = Pose((1.0, 2.0, 3.0, 0.0, 0.0, math.pi / 2.0))
    found = pose_trans(quarter, Pose((1.0, 0.0, 0.0, 0.0, 0.0, 0.5)))
    np.testing.assert_allclose(found, (1.0, 3.0, 3.0, 0.0, 0.0, math.pi / 2.0 + 0.5), atol=1e-12)
    np.testing.assert_allclose(pose_trans(pose_inv(quarter), quarter), np.zeros(6), atol=1e-12)
    half = Pose((0.0, 0.0, 0.0, math.pi, 0.0, 0.0))
    np.testing.assert_allclose(pose_trans(half, Pose((0.0, 1.0, 0.0, 0.0, 0.0, 0.0)))[:3], (0.0, -1.0, 0.0), atol=1e-12)


def test_a_joint_move_goes_to_the_joints_that_have_a_pose_with_the_tool_that_is_set() -> None:
    joints = (0.5, -0.4, 0.3, 0.2, -0.1, 0.4)
    tool = Pose((0.01, 0.0, 0.15, 0.0, 0.3, 0.0))
    aim = pose_trans(pose_of_matrix(gantry(np.array([joints]))[0]), tool)
    text = ",".join(f"{each:.12f}" for each in aim)
    log = ran(
        "set_tcp(p[0.01,0,0.15,0,0.3,0])",
        f"movej(get_inverse_kin(p[{text}], [0.4,-0.3,0.2,0.1,0,0.3]), t=2)",
    )
    np.testing.assert_allclose(log.moves[0].joints, joints, atol=1e-9)
    assert log.moves[0].ends == pytest.approx(2.0)


def test_a_joint_move_without_a_time_takes_that_of_its_leading_joint() -> None:
    # 1 rad at 0.5 rad/s and 1 rad/s2: ramps of 0.5 s and 0.125 rad.
    log = ran("movej([1,0.2,0,0,0,0], a=1, v=0.5)")
    assert log.moves[0].ends == pytest.approx(2.5)
