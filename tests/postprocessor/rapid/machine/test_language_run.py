"""What programs compute and where they go: known answers of data, expressions, branches, routines and errors."""

from __future__ import annotations

import pytest

from geoprint.errors import VerificationError
from geoprint.postprocessor.rapid.machine import Scenario
from tests.postprocessor.rapid.machine.tasks import HOME, ran, shown

EXPRESSIONS = {
    "2+3*4": "14",
    "(2+3)*4": "20",
    "7 DIV 2": "3",
    "-7 MOD 3": "-1",
    "7/2": "3.5",
    "2<3 AND NOT 3<2": "TRUE",
    "NOT TRUE AND FALSE": "TRUE",
    "TRUE XOR TRUE": "FALSE",
    'StrPart("geoprint",4,5)+"!"': "print!",
    "[1,2,3]+2*[1,0,0]": "[3,2,3]",
    "[1,0,0]*[0,1,0]": "[0,0,1]",
    "Abs(-2)+Sqrt(9)+Round(2.567\\Dec:=1)+Trunc(-2.5)": "5.6",
    "ATan2(1,1)+Sin(30)+Cos(60)": "46",
    "VectMagn([3,4,0])+Distance([0,0,0],[0,0,2])": "7",
    "VectMagn(PoseVect([[1,0,0],[0.70710678,0,0,0.70710678]],[1,0,0])-[1,1,0])": "0",
    "VectMagn(PoseVect(PoseMult(PoseInv([[1,2,3],[0,1,0,0]]),[[1,2,4],[0,1,0,0]]),[0,0,7]))": "6",
    "table{2,3}": "6",
    "half(10)": "5",
    "doValve": "0",
}
DECLARED = """
VAR num table{2,3}:=[[1,2,3],[4,5,6]];
FUNC num half(num x)
  RETURN x/2;
ENDFUNC
"""


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_expressions_have_their_values(text: str) -> None:
    shift = "\\Bool:=" if EXPRESSIONS[text] in {"TRUE", "FALSE"} else "\\Num:="
    shift = "\\Pos:=" if "[" in EXPRESSIONS[text] else shift
    form = f"TPWrite {text};" if "!" in text else f'TPWrite ""{shift}{text};'
    (found,) = shown(ran(form, declared=DECLARED))
    if EXPRESSIONS[text][0] in "-[0123456789" and "[" not in EXPRESSIONS[text]:
        assert float(found) == pytest.approx(float(EXPRESSIONS[text]), abs=1e-5)
    else:
        assert found == EXPRESSIONS[text]


def test_numbers_are_kept_in_single_precision() -> None:
    found = ran("n:=16777217; m:=0.1;", declared="PERS num n:=0; PERS num m:=0;")
    assert found.data["n"] == 16777216.0
    assert found.data["m"] == 0.10000000149011612


def test_loops_branches_and_jumps_go_where_they_must() -> None:
    body = """
    FOR i FROM 3 TO 1 DO TPWrite ""\\Num:=i; ENDFOR
    FOR i FROM 1 TO 5 STEP 2 DO TPWrite ""\\Num:=i; ENDFOR
    n:=0;
    WHILE n<2 DO n:=n+1; ENDWHILE
    TEST n CASE 1: TPWrite "one"; CASE 2,3: TPWrite "few"; DEFAULT: TPWrite "many"; ENDTEST
    IF n=1 THEN TPWrite "a"; ELSEIF n=2 THEN TPWrite "b"; ELSE TPWrite "c"; ENDIF
    IF n=3 TPWrite "never";
    GOTO over;
    TPWrite "never";
    over:
    TPWrite "end";
    """
    found = ran(body, declared="VAR num n;")
    assert shown(found) == ["3", "2", "1", "1", "3", "5", "few", "b", "end"]
    assert found.ended == "end"
    lines, done = found.statements["Main.mod"]
    assert (~done).sum() == 6  # one, many, a, c and twice never
    assert set(lines[~done]) < set(lines)


ROUTINES = """
PERS num counted:=0;
CONST num fixed:=4;
PROC count(INOUT num total,num by\\switch Twice|num Times)
  VAR num first;
  IF Present(Times) total:=total+by*Times;
  IF Present(Twice) total:=total+2*by;
  IF (NOT Present(Times)) AND (NOT Present(Twice)) total:=total+by;
  by:=100;
  first:=first+1;
  TPWrite "first "\\Num:=first;
ENDPROC
PROC pass(num by\\num Times)
  count counted,by\\Times?Times;
ENDPROC
LOCAL PROC part(VAR robtarget where)
  where.trans.y:=7;
ENDPROC
"""


def test_parameters_are_handed_over_as_they_are_declared() -> None:
    body = """
    VAR num mine:=1;
    VAR robtarget place;
    count mine,mine; count counted,10\\Twice; pass 3; pass 3\\Times:=5; %"co"+"unt"%counted,1000;
    part place;
    TPWrite "mine "\\Num:=mine; TPWrite "y "\\Num:=place.trans.y;
    """
    found = ran(body, declared=ROUTINES, scenario=Scenario(joints=HOME, watched=frozenset({"Pass"})))
    assert shown(found) == [*(["first 1"] * 5), "mine 2", "y 7"]
    assert found.data["counted"] == 1038.0
    assert [call.arguments[0] for call in found.calls] == [3.0, 3.0]
    assert found.calls[1].arguments == (3.0, 5.0)


ERRORS = """
VAR num tried:=0;
PROC divide()
  VAR num x:=0;
  x:=1/x;
  TPWrite "behind";
ERROR
  TPWrite "own";
  IF ERRNO=ERR_DIVZERO TRYNEXT;
  RAISE;
ENDPROC
PROC raised()
  inner;
  TPWrite "never";
ERROR (ERR_UNLOAD)
  TPWrite "never";
ERROR
  tried:=tried+1;
  TPWrite "tried "\\Num:=tried;
  IF tried<3 RETRY;
  IF tried=3 RETURN;
ENDPROC
PROC inner()
  RAISE 7;
ERROR
  TPWrite "passes "\\Num:=ERRNO;
  RAISE;
ENDPROC
FUNC num broken()
  RETURN 1/0;
ENDFUNC
PROC asking()
  VAR num n;
  n:=broken();
ERROR
  TPWrite "from a function";
  TRYNEXT;
ENDPROC
"""


def test_errors_go_to_the_nearest_handler_which_decides() -> None:
    found = ran('divide; raised; asking; TPWrite "on";', declared=ERRORS)
    words = [
        "own",
        "behind",
        *(word for k in (1, 2, 3) for word in ("passes 7", f"tried {k}")),
        "from a function",
        "on",
    ]
    assert shown(found) == words
    assert found.ended == "end"


def test_what_nobody_handles_ends_the_program_where_it_stands() -> None:
    found = ran('VAR num n;\nn:=1;\nn:=n/(n-1);\nTPWrite "never";')
    assert (found.ended, found.file, found.line) == ("error", "Main.mod", 6)
    assert "ERR_DIVZERO" in found.reason
    assert ran('IF TRUE THEN EXIT; ENDIF TPWrite "never";').ended == "exit"


@pytest.mark.parametrize(
    ("call", "word"),
    [
        ('%"two"% 1,2;', "two"),
        ('%"two"% 1;', "called wrongly"),
        ('%"two"% 1,2,3;', "called wrongly"),
        ('%"two"% 1\\c:=2;', "called wrongly"),
        ('%"half"% 1;', "called wrongly"),
        ('%"three"% 1,2;', "unknown"),
    ],
)
def test_a_late_call_of_what_does_not_fit_is_an_error_of_the_program(call: str, word: str) -> None:
    declared = (
        f'PROC two(num a,num b)\nTPWrite "two";\nENDPROC\n{DECLARED}PROC caller()\n{call}\nERROR\n'
        'IF ERRNO=ERR_CALLPROC TPWrite "called wrongly";\nIF ERRNO=ERR_REFUNKPRC TPWrite "unknown";\nTRYNEXT;\nENDPROC'
    )
    assert shown(ran("caller;", declared=declared)) == [word]


def test_an_error_in_a_handler_is_nobodys() -> None:
    declared = "PROC bad()\nRAISE 5;\nERROR\nRAISE 1/0;\nENDPROC"
    found = ran("bad;\nERROR TRYNEXT;", declared=declared)
    assert (found.ended, "ERR_DIVZERO" in found.reason) == ("error", True)


def test_nothing_unknown_is_stepped_over() -> None:
    for line, reason in {
        "TuneReset;": "TuneReset is not an instruction",
        "TPWrite Secret(1);": "Secret is not a function",
        "n:=elsewhere;": "elsewhere is unknown to this machine as data or signal",
        "MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\Conc,v20,fine,tool0;": "the option Conc",
        "SetDO doValve\\SDelay:=1,1;": "the option SDelay",
        "SetDO doValve;": "is given 1 argument,",
        "go;": "lacks the parameter far",
        "Fixed:=3;": "is a constant",
    }.items():
        declared = "VAR num n;\nCONST num fixed:=1;\nPROC go(num far)\nENDPROC"
        with pytest.raises(VerificationError, match=reason) as caught:
            ran(f"\n\n{line}", declared=declared)
        assert caught.value.details["module"] == "Main.mod"
        assert caught.value.details["line"] == 9


def test_a_program_that_never_ends_is_ended() -> None:
    found = ran("WHILE TRUE DO ENDWHILE", Scenario(joints=HOME, most_steps=1000))
    assert (found.ended, found.reason) == ("error", "the program has made 1000 steps and does not end")


def test_the_operator_is_asked_and_answers() -> None:
    body = 'TPReadFK n,"Well?","Yes","","","","No"; TPWrite "said "\\Num:=n;'
    asked = Scenario(joints=HOME, answers=(5.0,))
    assert shown(ran(body, asked, declared="VAR num n;")) == ["said 5"]
    assert ran(body, declared="VAR num n;").ended == "waits"
    assert ran(body, Scenario(joints=HOME, answers=(2.0,)), declared="VAR num n;").ended == "waits"


def test_data_are_set_by_a_person_and_held_against_the_program() -> None:
    scenario = Scenario(joints=HOME, data={"dry": False}, held={"on": 1.0})
    found = ran(
        'on:=0; SetDO doValve,on; TPWrite ""\\Bool:=dry;', scenario, declared="VAR num on:=0; PERS bool dry:=TRUE;"
    )
    assert (shown(found), found.signals["dovalve"]) == (["FALSE"], 1.0)


PATH = 'MODULE Path\nVAR num seen:=1;\nPROC go()\nTPWrite "going "\\Num:=seen;\nseen:=seen+1;\nENDPROC\nENDMODULE\n'
LOADING = """
VAR loadsession s;
PROC forget()
  UnLoad diskhome\\File:="Path.mod";
ERROR
  TPWrite "unload";
  IF ERRNO=ERR_UNLOAD TRYNEXT;
ENDPROC
"""


def test_modules_are_there_from_when_they_are_loaded_until_they_are_not() -> None:
    body = """
    forget;
    StartLoad\\Dynamic,diskhome\\File:="Path.mod",s; WaitTime 2; WaitLoad s;
    %"go"%; %"go"%; forget;
    StartLoad\\Dynamic,diskhome\\File:="Path.mod",s; WaitLoad s;
    %"go"%; forget;
    %"go"%;
    """
    found = ran(body, Scenario(joints=HOME, loading=3.0), declared=LOADING, others={"Path.mod": PATH})
    assert shown(found) == ["unload", "going 1", "going 2", "going 1"]
    assert (found.ended, found.seconds) == ("error", 6.0)
    assert "ERR_REFUNKPRC" in found.reason
    assert found.loaded == frozenset({"Main.mod"})


@pytest.mark.parametrize(
    ("body", "error"),
    [
        ('StartLoad\\Dynamic,diskhome\\File:="None.mod",s;', "ERR_FILNOTFND"),
        ("WaitLoad s;", "ERR_LOADNO_NOUSE"),
        ('StartLoad diskhome\\File:="Path.mod",s; StartLoad diskhome\\File:="Path.mod",s;', "ERR_LOADNO_INUSE"),
        ('Load diskhome\\File:="Path.mod"; Load diskhome\\File:="Path.mod";', "ERR_LOADED"),
        ('UnLoad diskhome\\File:="Main.mod";', "ERR_UNLOAD"),
        ('%"nothing"%;', "ERR_REFUNKPRC"),
        ('%"half"%;', "ERR_CALLPROC"),
        ('TPWrite ""\\Num:=table{2,4};', "ERR_OUTOFBND"),
    ],
)
def test_what_goes_wrong_has_the_controllers_name(body: str, error: str) -> None:
    found = ran(body, declared=DECLARED.replace("FUNC", "VAR loadsession s;\nFUNC", 1), others={"Path.mod": PATH})
    assert (found.ended, found.reason.split(":")[0]) == ("error", error)
