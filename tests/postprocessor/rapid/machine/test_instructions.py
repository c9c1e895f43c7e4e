"""What instructions do that do not move the arm, and when: outputs, questions, waiting, loading, counting, calls."""

from __future__ import annotations

import pytest

from geoprint.errors import VerificationError
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.machine import Scenario, compile_task, execute
from tests.postprocessor.rapid.machine.tasks import HOME, arm, ran, shown, target, task

SIGNALS = "Set doUV; WaitTime 1; SetAO aoFlow,2.5; Reset doUV; PulseDO doValve; PulseDO\\PLength:=3,doUV; WaitTime 2;"


def test_outputs_take_their_values_when_they_are_told_to() -> None:
    found = ran(f"\n{SIGNALS}\nSetDO doUV,1;")
    assert [(each.signal, each.value, each.line) for each in found.switchings] == [
        ("douv", 1.0, 5), ("aoflow", 2.5, 5), ("douv", 0.0, 5), ("dovalve", 1.0, 5), ("douv", 1.0, 5),
        ("dovalve", 0.0, 5), ("douv", 1.0, 6), ("douv", 0.0, 5),
    ]  # fmt: skip
    assert [each.time for each in found.switchings] == pytest.approx([0.0, 1.0, 1.0, 1.0, 1.0, 1.2, 3.0, 4.0])
    alone = {(each.file, each.move, each.distance, each.from_start, each.flow) for each in found.switchings}
    assert alone == {("Main.mod", -1, 0.0, False, False)}
    assert {(each.lag, each.dip_lag) for each in found.switchings} == {(0.0, 0.0)}
    assert found.signals == {"dovalve": 0.0, "douv": 0.0, "aoflow": 2.5, "didoor": 0.0}


def test_what_is_written_is_a_text_and_one_value() -> None:
    body = """
    TPErase; TPWrite "n "\\Num:=0.5; TPWrite "b "\\Bool:=FALSE; TPWrite "p "\\Pos:=[1,2,3];
    TPWrite "o "\\Orient:=[1,0,0,0]; WaitTime 1; TPWrite "d "\\Dnum:=7; TPWrite "signal "\\Num:=doValve;
    """
    found = ran(body)
    assert shown(found) == ["n 0.5", "b FALSE", "p [1,2,3]", "o [1,0,0,0]", "d 7", "signal 0"]
    assert [moment for moment, _ in found.texts] == [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]


ASKING = 'TPReadFK n,"Well?","Yes","","","","No"; TPReadNum m,"How many?"; TPWrite ""\\Num:=10*n+m;'


@pytest.mark.parametrize(
    ("answers", "said", "reason"),
    [
        ((5.0, 7.5), ["57.5"], ""),
        ((1.0, 0.0), ["10"], ""),
        ((1.0,), [], "nobody answers: How many?"),
        ((), [], "nobody answers: Well?"),
        ((2.0, 1.0), [], "the answer 2 is not on a key: Well?"),
        ((0.0, 1.0), [], "the answer 0 is not on a key: Well?"),
        ((6.0, 1.0), [], "the answer 6 is not on a key: Well?"),
        ((1.5, 1.0), [], "the answer 1.5 is not on a key: Well?"),
    ],
)
def test_a_question_waits_for_an_answer_that_is_on_a_key(
    answers: tuple[float, ...], said: list[str], reason: str
) -> None:
    found = ran(ASKING, Scenario(joints=HOME, answers=answers), declared="VAR num n; VAR num m;")
    assert (shown(found), found.reason) == (said, reason)
    assert found.ended == ("waits" if reason else "end")
    assert found.questions == ("Well?", "How many?")[: 1 if "Well" in reason else 2]


THERE = f"MoveL {target(300)},v100,fine,tool0;"
AWAY = f"{THERE} TriggIO t,4\\Start\\DOp:=doValve,1; TriggL {target(320)},v10,t,z200,tool0;"
WAITING = {
    "WaitTime 2.5;": 2.5,
    "WaitTime 0;": 0.0,
    "WaitTime -1;": 0.0,
    "WaitUntil TRUE;": 0.0,
    "WaitUntil doValve=0\\MaxTime:=3;": 0.0,
    "WaitDO doValve,0; WaitDI diDoor,0;": 0.0,
    # Half way the program goes on; the arm takes two seconds in all.
    f"{AWAY} WaitTime\\InPos,1;": 3.0,
    f"{AWAY} WaitTime\\InPos,0;": 2.0,
    f"{AWAY} WaitTime 0.25;": 1.25,
    f"{AWAY} WaitRob\\InPos;": 2.0,
    f"{AWAY}": 1.0,
    f"{THERE} TriggIO t,18\\Start\\DOp:=doValve,1; TriggL {target(320)},v10,t,z200,tool0; WaitUntil doValve=1;": 1.8,
    f"{THERE} TriggIO t,18\\Start\\DOp:=doValve,1; TriggL {target(320)},v10,t,z200,tool0; WaitDO doValve,1;": 1.8,
    f"{AWAY} WaitDO doValve,1;": 1.0,
}


@pytest.mark.parametrize("body", WAITING)
def test_a_program_waits_as_long_as_it_is_told_to(body: str) -> None:
    found = ran(f'{body} TPWrite "on";', declared="VAR triggdata t;")
    start = float(found.moves.ends[0]) if len(found.moves.ends) else 0.0
    assert found.texts[0][0] - start == pytest.approx(WAITING[body], abs=1e-5)


@pytest.mark.parametrize("line", ["WaitUntil doUV=1;", "WaitDI diDoor,1;", "WaitDO doUV,1;"])
def test_what_never_comes_is_waited_for_for_ever_or_until_time_is_up(line: str) -> None:
    for_ever = ran(f'WaitTime 1; {line} TPWrite "never";')
    assert (for_ever.ended, for_ever.reason) == ("waits", "the condition of a wait never comes true")
    declared = f'PROC waiting()\n{line[:-1]}\\MaxTime:=4;\nERROR\nIF ERRNO=ERR_WAIT_MAXTIME TPWrite "late";\nENDPROC'
    found = ran("waiting;", declared=declared)
    assert found.texts == ((4.0, "late"),)


def test_numbers_are_counted_up_and_down() -> None:
    body = "Incr n; Incr n; Add m,2.5; Decr place.y; Add place.z,-4; Clear k; Add k,0.1;"
    found = ran(body, declared="VAR num n:=5; VAR num m:=1; VAR pos place:=[1,2,3]; VAR num k:=9;")
    assert (found.data["n"], found.data["m"], found.data["place"]) == (7.0, 3.5, (1.0, 1.0, -1.0))
    assert found.data["k"] == 0.10000000149011612


def test_a_program_says_where_and_how_it_ended() -> None:
    stopped = ran('WaitTime 1;\nStop;\nTPWrite "never";')
    assert (stopped.ended, stopped.reason, stopped.line, stopped.texts) == ("stopped", "Stop", 5, ())
    left = ran('WaitTime 1;\nEXIT;\nTPWrite "never";')
    assert (left.ended, left.reason, left.line, left.seconds) == ("exit", "EXIT", 5, 1.0)
    done = ran("WaitTime 1;\nWaitTime 1;")
    assert (done.ended, done.file, done.line, done.seconds) == ("end", "Main.mod", 6, 2.0)
    returned = ran("WaitTime 1;\nRETURN;\nWaitTime 1;")
    assert (returned.ended, returned.line) == ("end", 5)


MODULE = 'MODULE {name}\nVAR num seen:=1;\nPROC {name}()\nTPWrite "{name}";\nENDPROC\nENDMODULE\n'
OTHERS = {f"{name}.mod": MODULE.format(name=name).replace("seen", f"seen{name}") for name in ("one", "two")}
MAIN = 'MODULE Main\nPROC main()\nkept;\nUnLoad "HOME:/kept.sys";\nENDPROC\nENDMODULE\n'
LOADS = {
    'Load\\Dynamic,diskhome\\File:="one.mod"; one;': (["one"], 3.0),
    'Load\\Dynamic,"HOME:/folder/one.mod"; one;': (["one"], 3.0),
    'Load\\Dynamic,diskhome\\File:="folder/two.mod"; %"two"%;': (["two"], 3.0),
    'StartLoad\\Dynamic,diskhome\\File:="one.mod",s; StartLoad\\Dynamic,diskhome\\File:="two.mod",r; WaitTime 1;'
    ' WaitLoad r; %"two"%; WaitLoad s; %"one"%;': (["two", "one"], 3.0),
    'StartLoad\\Dynamic,diskhome\\File:="one.mod",s; WaitTime 4; WaitLoad s; one; UnLoad "HOME:one.mod";'
    ' StartLoad\\Dynamic,diskhome\\File:="two.mod",s; WaitLoad s; %"two"%;': (["one", "two"], 7.0),
}


@pytest.mark.parametrize("body", LOADS)
def test_modules_are_loaded_while_time_goes_by(body: str) -> None:
    found = ran(
        body, Scenario(joints=HOME, loading=3.0), declared="VAR loadsession s; VAR loadsession r;", others=OTHERS
    )
    assert (found.ended, shown(found), found.seconds) == ("end", *LOADS[body])


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ('Load diskhome\\File:="two.mod";', "ERR_FILNOTFND: there is no file two.mod"),
        ('StartLoad diskhome\\File:="two.mod",s;', "ERR_FILNOTFND: there is no file two.mod"),
        ('StartLoad diskhome\\File:="one.mod",s; WaitLoad s; WaitLoad s;', "ERR_LOADNO_NOUSE"),
        ("one;", "ERR_REFUNKPRC: one is called, but one.mod is not loaded"),
        ("n:=seenone;", "ERR_REFUNKDAT: data is used whose module is not loaded"),
        ("n:=asked();", "ERR_REFUNKFUN: asked is called, but more.mod is not loaded"),
        ('Load diskhome\\File:="more.mod"; asking;', "ERR_UNLOAD: more.mod is being executed"),
    ],
)
def test_what_is_not_there_is_not_found(body: str, reason: str) -> None:
    more = (
        "MODULE more\nFUNC num asked()\nRETURN 1;\nENDFUNC\n"
        'PROC asking()\nUnLoad diskhome\\File:="more.mod";\nENDPROC\nENDMODULE\n'
    )
    scenario = Scenario(joints=HOME, disk=frozenset({"one.mod", "more.mod"}))
    found = ran(body, scenario, declared="VAR loadsession s; VAR num n;", others=OTHERS | {"more.mod": more})
    assert found.ended == "error"
    assert found.reason.startswith(reason)


def test_what_a_controller_keeps_no_program_takes_away() -> None:
    kept = MODULE.format(name="kept")
    modules = [parse_module("kept.sys", kept), parse_module("Main.mod", MAIN)]
    found = execute(
        compile_task(modules, at_once=["kept.sys", "Main.mod"], signals={}, arm=arm()), Scenario(joints=HOME)
    )
    assert (found.ended, found.reason) == ("error", "ERR_UNLOAD: kept.sys is not loaded by the program")
    assert shown(found) == ["kept"]


HANDED = """
PROC outer(\\num a|switch turned,\\switch other)
  counts\\by?a;
  tells\\what?a;
  IF Present(a) TPWrite "own "\\Num:=a;
  IF Present(turned) TPWrite "turned";
  IF Present(other) TPWrite "other";
ENDPROC
PROC counts(\\INOUT num by)
  IF Present(by) by:=by+1;
  tells\\what?by;
ENDPROC
PROC tells(\\num what)
  IF Present(what) TPWrite "told "\\Num:=what;
  IF NOT Present(what) TPWrite "nothing";
ENDPROC
"""


def test_optional_parameters_are_handed_on_as_what_they_are_declared() -> None:
    """Also a parameter that is a value to one that is changed, and the other way round."""
    record = shown(ran("outer; outer\\a:=4; outer\\turned\\other; counts\\by:=n;", declared=f"VAR num n:=9;{HANDED}"))
    assert record == [
        "nothing", "nothing", "told 5", "told 5", "own 5", "nothing", "nothing", "turned", "other", "told 10",
    ]  # fmt: skip


@pytest.mark.parametrize("use", ["n:=a;", "n:=b;", "b:=1;", "taken b;"])
def test_a_parameter_that_was_left_out_cannot_be_used(use: str) -> None:
    declared = f"VAR num n;\nPROC go(\\num a\\INOUT num b)\n{use}\nENDPROC\nPROC taken(INOUT num c)\nENDPROC"
    found = ran("go;", declared=declared)
    assert (found.ended, found.reason.split(":")[0]) == ("error", "ERR_NOTPRES")


def test_calls_nest_two_hundred_deep_and_no_deeper() -> None:
    declared = "VAR num deepest; PROC down(num n)\ndeepest:=deepest+1; IF n>1 down n-1;\nENDPROC"
    assert ran("down 199;", declared=declared).data["deepest"] == 199.0
    deeper = ran("down 200;", declared=declared)
    assert (deeper.ended, deeper.reason) == ("error", "calls are nested deeper than 200")


WEIGHTS = {
    "n:=1;": 1,
    "n:=1+1+1+1+1+1+1+1;": 2,
    "Incr n;": 2,
    "n:=Sin(n);": 2,
    "many{1}:=1;": 101,
    "many:=others;": 101,
    "b:=many=others;": 101,
    "MoveJ Offs(p,1,0,0),v100,fine,tool0;": 13,
}


@pytest.mark.parametrize("statement", [*WEIGHTS])
def test_a_program_may_make_as_many_steps_as_the_scenario_allows_and_long_ones_count_for_more(statement: str) -> None:
    p = "VAR robtarget p:=[[300,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];"
    declared = f"VAR num n; VAR bool b; VAR num many{{400}}; VAR num others{{400}};{p}"
    # Leaving main is one more.
    steps = WEIGHTS[statement] + 1
    assert ran(statement, Scenario(joints=HOME, most_steps=steps), declared=declared).ended == "end"
    ended = ran(f"{statement} n:=1;", Scenario(joints=HOME, most_steps=steps), declared=declared)
    assert (ended.ended, ended.reason) == ("error", f"the program has made {steps} steps and does not end")


FUNCTIONS = """
VAR num calls:=0;
FUNC num factorial(num n)
  Incr calls;
  IF n<=1 RETURN 1;
  RETURN n*factorial(n-1);
ENDFUNC
FUNC num safely(num n)
  RETURN 1/n;
ERROR
  RETURN -1;
ENDFUNC
FUNC num first(num values{*})
  VAR num sum:=0;
  FOR i FROM Dim(values,1) TO 1 STEP -1 DO sum:=10*sum+values{i}; ENDFOR
  RETURN sum;
ENDFUNC
FUNC pos mirrored(pos at)
  at.y:=-at.y;
  RETURN at;
ENDFUNC
PROC handled()
  VAR num n:=0;
  n:=1/n;
ERROR (ERR_OUTOFBND,ERR_UNLOAD)
  TPWrite "wrong";
ERROR (ERR_FILNOTFND,ERR_DIVZERO)
  TPWrite "right";
  RETURN;
ENDPROC
PROC raising()
  n0;
ERROR
  IF ERRNO=55 TPWrite "fifty-five";
  RETURN;
ENDPROC
PROC n0()
  RAISE 5;
ERROR
  RAISE 55;
ENDPROC
"""


def test_functions_compute_in_the_middle_of_expressions_and_handle_their_own_errors() -> None:
    body = """
    TPWrite ""\\Num:=factorial(5)+factorial(3); TPWrite ""\\Num:=calls; TPWrite ""\\Num:=safely(0)+safely(4);
    TPWrite ""\\Num:=first(row); TPWrite ""\\Pos:=mirrored([1,2,3]); handled; raising;
    """
    found = ran(body, declared=f"CONST num row{{3}}:=[1,2,3];{FUNCTIONS}")
    assert shown(found) == ["126", "8", "-0.75", "321", "[1,-2,3]", "right", "fifty-five"]


def test_what_fails_in_the_middle_of_an_assignment_assigns_nothing() -> None:
    declared = """
    VAR num n:=5; VAR num table{2}:=[7,8];
    FUNC num broken(num x)
      RETURN 1/x;
    ENDFUNC
    PROC tries()
      n:=3+broken(0);
      table{2}:=broken(0);
      n:=n+broken(1);
    ERROR
      TPWrite "n "\\Num:=n;
      TRYNEXT;
    ENDPROC
    """
    found = ran("tries;", declared=declared)
    assert shown(found) == ["n 5", "n 5"]
    assert (found.data["n"], found.data["table"]) == (6.0, (7.0, 8.0))


LOOPS = {
    "FOR i FROM 1 TO 3 DO Incr n; ENDFOR": 3.0,
    "FOR i FROM 2 TO 2 DO n:=n+i; ENDFOR": 2.0,
    "FOR i FROM 3 TO 1 DO n:=10*n+i; ENDFOR": 321.0,
    "FOR i FROM 3 TO 1 STEP 1 DO Incr n; ENDFOR": 0.0,
    "FOR i FROM 1 TO 3 STEP -1 DO Incr n; ENDFOR": 0.0,
    "FOR i FROM 10 TO 1 STEP -4 DO n:=n+i; ENDFOR": 18.0,
    "FOR i FROM 1 TO 2 DO FOR j FROM 1 TO 3 DO n:=10*n+i*j; ENDFOR ENDFOR": 123246.0,
    "FOR i FROM 1 TO 2 DO FOR i FROM 5 TO 6 DO n:=10*n+i; ENDFOR n:=10*n+i; ENDFOR": 561562.0,
    "WHILE n<4 DO n:=n+3; ENDWHILE": 6.0,
    "again: n:=n+1; IF n<5 GOTO again;": 5.0,
    "TEST 2 CASE 1: n:=1; CASE 2: n:=2; CASE 2: n:=3; DEFAULT: n:=4; ENDTEST": 2.0,
    "TEST 5 CASE 1,2: n:=1; ENDTEST": 0.0,
    "IF FALSE THEN n:=1; ELSEIF TRUE THEN n:=2; ELSEIF TRUE THEN n:=3; ENDIF": 2.0,
}


@pytest.mark.parametrize("body", LOOPS)
def test_loops_end_where_they_must(body: str) -> None:
    assert ran(body, declared="VAR num n;").data["n"] == LOOPS[body]


def test_watched_calls_are_noted_with_their_arguments_moment_and_place() -> None:
    body = f"WaitTime 2; {THERE}\ngo n,7\\c;\ngo n,8;"
    declared = "VAR num n:=3; PROC go(INOUT num a,num b\\switch c\\num d)\nIncr a;\nENDPROC"
    found = ran(body, Scenario(joints=HOME, watched=frozenset({"GO"})), declared=declared)
    assert [call.arguments for call in found.calls] == [(3.0, 7.0, True, None), (4.0, 8.0, None, None)]
    assert [(call.routine, call.file, call.line, call.moves) for call in found.calls] == [
        ("go", "Main.mod", 7, 1), ("go", "Main.mod", 8, 1),
    ]  # fmt: skip
    assert found.calls[0].time == pytest.approx(float(found.moves.ends[0]))


# Two folders whose modules declare the same names, one of them with a module that uses what the other one declares.
FOLDERS = {
    f"{folder}/{name}.mod": text
    for folder, value in (("low", 1), ("high", 2))
    for name, text in (
        ("Data", f"MODULE Data\nVAR num height:={value};\nENDMODULE\n"),
        ("Show", 'MODULE Show\nPROC shows()\nTPWrite "height "\\Num:=height;\nheight:=7;\nENDPROC\nENDMODULE\n'),
    )
}
LOADED = 'Load\\Dynamic,diskhome\\File:="{0}/Data.mod"; Load\\Dynamic,diskhome\\File:="{0}/Show.mod";'
FORGOTTEN = 'UnLoad diskhome\\File:="{0}/Show.mod"; UnLoad diskhome\\File:="{0}/Data.mod";'


def test_modules_of_a_folder_see_one_another_and_come_anew_each_time() -> None:
    body = "".join(LOADED.format(folder) + '%"shows"%;' + FORGOTTEN.format(folder) for folder in ("low", "high", "low"))
    found = ran(body, others=FOLDERS)
    assert (found.ended, shown(found)) == ("end", ["height 1", "height 2", "height 1"])


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (LOADED.format("low") + LOADED.format("high"), "ERR_LOADED: high/Data.mod brings data, which low/Data.mod has"),
        (LOADED.format("low") + FORGOTTEN.format("high"), "ERR_UNLOAD: high/Show.mod is not loaded by the program"),
        ('%"shows"%;', "ERR_REFUNKPRC: there is no procedure shows in a loaded module"),
    ],
)
def test_folders_that_declare_the_same_are_not_loaded_together(body: str, reason: str) -> None:
    found = ran(body, others=FOLDERS)
    assert found.ended == "error"
    assert reason in found.reason


def test_nothing_outside_of_a_folder_names_what_is_in_it() -> None:
    with pytest.raises(VerificationError, match="shows is not an instruction that this machine knows"):
        task("shows;", others=FOLDERS)
    with pytest.raises(VerificationError, match="height"):
        task("height:=1;", others=FOLDERS)
