"""The symbol table: what a controller would refuse is refused by module, line and reason; what it takes passes."""

from __future__ import annotations

import gc
from pathlib import Path

import pytest

from geoprint.errors import VerificationError
from geoprint.postprocessor.rapid.language.names import builtins
from geoprint.postprocessor.rapid.language.parsing import parse_module, uncollected
from geoprint.postprocessor.rapid.language.symbols import examine, read_task, resolve

SIGNALS = {"doGrip": "signaldo", "diPart": "signaldi", "aoFlow": "signalao"}
HEAD = """MODULE A
  RECORD part num size; pos place; bool good; ENDRECORD
  ALIAS num count;
  CONST num three:=3;
  CONST robtarget pHome:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS tooldata tool:=[TRUE,[[0,0,1],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS num kept:=1;
  VAR num x;
  VAR dnum d;
  VAR string s;
  VAR pos p;
  VAR part piece;
  VAR num grid{2,3};
  VAR intnum bell;
  VAR triggdata trigger;
  VAR clock watch;
  PROC main()
"""
FIRST = HEAD.count("\n") + 1
TAIL = """
  ENDPROC
  PROC plain()
  ENDPROC
  PROC taking(num a,VAR num b,PERS num c,INOUT num d \\switch loud \\num e | \\string f)
    IF Present(loud) x:=a;
    IF Present(e) taking a,b,c,d \\e?e;
  ENDPROC
  FUNC num twice(num a)
    a:=2*a;
    RETURN a;
  ENDFUNC
  LOCAL PROC mine(num grid{*,*})
  ENDPROC
  TRAP ring
  ENDTRAP
ENDMODULE
"""


def found(*lines: str) -> list[str]:
    """Return what is wrong with statements of main, which begin in line FIRST."""
    module = parse_module("A.mod", HEAD + "\n".join(lines) + TAIL)
    return [str(error).partition(". Do not")[0] for error in examine([module], signals=SIGNALS)[1]]


def test_what_the_tests_stand_on_is_right() -> None:
    assert found("plain;") == []


@pytest.mark.parametrize(
    "line",
    [
        "x:=three+2*kept MOD 4; d:=4294967296; d:=NumToDnum(x); s:=NumToStr(x,2)+\"mm\";",
        "p:=[1,2,3]*2+piece.place; piece:=[1,[0,0,0],x>1]; x:=p.x; grid{1,three}:=x; piece.place.z:=-x;",
        "IF diPart=1 AND NOT piece.good OR p=[0,0,x] plain;",
        "taking 1,x,kept,x\\loud\\e:=2; taking a:=1,b:=grid{1,2},c:=kept,d:=kept\\f:=\"s\"; taking doGrip,x,kept,x;",
        "MoveL pHome,v100,z10,tool\\WObj:=wobj0; MoveL\\Conc,Offs(pHome,0,0,x),v20\\T:=2,fine,tool0;",
        "MoveJ RelTool(pHome,0,0,1\\Rx:=90),[20,500,5000,1000],z1,tool;",
        "TriggIO trigger,1\\Start\\DOp:=doGrip,1; TriggL pHome,v10,trigger\\T2:=trigger,z1,tool;",
        "SetDO\\SDelay:=0.5,doGrip,high; SetAO aoFlow,x; WaitDI diPart,1\\MaxTime:=3; Reset doGrip;",
        "FOR i FROM 1 TO Dim(grid,1) DO grid{i,1}:=i; ENDFOR WHILE TRUE DO x:=x+1; ENDWHILE",
        "TEST x CASE 1,three: plain; DEFAULT: plain; ENDTEST IF x=1 GOTO off; off:",
        "CONNECT bell WITH ring; ISignalDI diPart,1,bell; mine grid; ClkReset watch; x:=ClkRead(watch);",
        "%\"plain\"%; %s%; %\"taking\"% 1,x,kept,x; %\"A:plain\"%; x:=twice(a:=x);",
        "ArcLStart pHome,v10,whatever,tool; TPWrite \"at \"\\Pos:=p; x:=ATan2(1,x)*pi;",
        "ERROR IF ERRNO=ERR_WAIT_MAXTIME RETRY; TRYNEXT;",
        "RAISE 5; ERROR (ERR_DIVZERO, ERR_OUTOFBND) RAISE;",
    ],
)  # fmt: skip
def test_what_a_controller_takes_passes(line: str) -> None:
    errors = found(line)
    # An option's instruction is known by its name; what is handed to it has to mean something still.
    assert errors == ([f"A.mod, line {FIRST}: whatever is not declared, and is not built into the controller"]
                      if "whatever" in line else [])  # fmt: skip


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("y:=1;", "y is not declared"),
        ("nothing 1;", "nothing is not declared"),
        ("x:=s;", "the assignment needs a num, found a string"),
        ('x:="1";', '"1" is not a num, needed for the assignment'),
        ("x:=d;", "the assignment needs a num, found a dnum"),
        ("x:=x+d;", "+ cannot be applied to a num and a dnum"),
        ('s:=s+1;', "+ cannot be applied to a string and a num"),
        ("IF x plain;", "IF needs a bool, found a num"),
        ("WHILE 1 DO ENDWHILE", "1 is not a bool, needed for WHILE"),
        ("x:=NOT x;", "NOT needs a bool, found a num"),
        ("IF x=s plain;", "a num cannot be compared with a string"),
        ("three:=4;", "three is a CONST, but a value is assigned to it"),
        ("three:=4;", "three is a CONST"),
        ("doGrip:=1;", "no value can be assigned to doGrip, which is a signal"),
        ("FOR i FROM 1 TO 2 DO i:=3; ENDFOR", "no value can be assigned to i, which is a loop"),
        ("FOR i FROM 1 TO 2 DO ENDFOR x:=i;", "i is not declared"),
        ("piece.length:=1;", "a part has no component length"),
        ("x.size:=1;", "a num has no component size"),
        ("grid{1}:=1;", "a num{*,*} is given 1 index"),
        ("piece:=[1,[0,0,0]];", "a part has 3 components, found 2"),
        ("p:=[1,2,x,3];", "a pos has 3 components, found 4"),
        ("p:=[1,2,TRUE];", "TRUE is not a num"),
        ("RAISE 5; ERROR (s) RAISE;", "ERROR needs a num, found a string"),
        ("RAISE 5; ERROR (1, s) RAISE;", "ERROR needs a num, found a string"),
        ("RAISE 5; ERROR y:=1;", "y is not declared"),
        ("plain 1;", "plain takes no a further argument"),
        ("twice 1;", "twice is a FUNC; a procedure is needed here"),
        ("x:=plain();", "plain is a PROC; a function is needed here"),
        ("x:=twice;", "twice is a routine; a value is needed here"),
        ("x:=twice();", "twice lacks the argument a"),
        ("ring;", "ring is a TRAP; a procedure is needed here"),
        ("CONNECT bell WITH plain;", "plain is not a trap"),
        ("CONNECT s WITH ring;", "CONNECT needs an intnum, found a string"),
        ("taking 1,2,kept,x;", "b of taking is passed by reference, so it must be a variable"),
        ("taking 1,three,kept,x;", "b of taking is passed by reference, but three never changes"),
        ("taking 1,kept,kept,x;", "b of taking needs a VAR, but kept is a PERS"),
        ("taking 1,x,x,x;", "c of taking needs a PERS, but x is not one"),
        ("taking 1,x,kept,three;", "d of taking is passed by reference, but three never changes"),
        ("taking 1,x,kept,x\\loud:=1;", "loud of taking is a switch and takes no value"),
        ("taking 1,x,kept,x\\e;", "e of taking needs a value"),
        ("taking 1,x,kept,x\\e:=1\\f:=s;", "taking is given f twice, or together with what excludes it"),
        ("taking\\e:=1,1,x,kept,x;", "taking takes a further ahead among its arguments"),
        ("taking 1,x,kept,x\\g:=1;", "taking takes no \\g"),
        ("MoveL pHome,z10,v100,tool;", "Speed of MoveL needs a speeddata, found a zonedata"),
        ("MoveL pHome,v100,z10,pHome;", "Tool of MoveL needs a tooldata, found a robtarget"),
        ("MoveL pHome,v100,z10;", "MoveL lacks the argument Tool"),
        ("MoveL [[1,2],[1,0,0,0],[0,0,0,0],[0,0,0,0,0,0]],v100,z10,tool;", "a pos has 3 components, found 2"),
        ("SetDO aoFlow,1;", "Signal of SetDO needs a signaldo, found a signalao"),
        ("SetDO doNowhere,1;", "doNowhere is not declared"),
        ("SetDO doGrip;", "SetDO lacks the argument Value"),
        ("ConfL\\On\\Off;", "ConfL is given Off twice, or together with what excludes it"),
        ("x:=Sin(s);", "Angle of Sin needs a num, found a string"),
        ("GOTO off;", "GOTO off: no such label in this routine"),
        ("off: off:", ""),
        ("RETURN 1;", "main is a PROC and returns no value"),
        ("RETRY;", "RETRY is outside an error handler"),
        ("RAISE;", "RAISE without a number is outside an error handler"),
        ('%"nowhere"%;', "nowhere is not declared"),
        ('%"twice"% 1;', "twice is a FUNC; a procedure is needed here"),
        ("%x%;", "a late call needs a string, found a num"),
        ('%"taking"% 1;', "taking lacks the argument b"),
        ("x:=Present(1);", "Present takes one parameter"),
        ("TEST x CASE \"1\": plain; ENDTEST", '"1" is not a num, needed for CASE'),
        ("x:=1E39;", "1e+39 is too large for a num"),
        (f's:="{"x" * 81}";', "a string has at most 80 characters, found 81"),
        ("mine x;", "grid of mine needs a num{*,*}, found a num"),
    ],
)  # fmt: skip
def test_what_a_controller_refuses_is_named(line: str, reason: str) -> None:
    if not reason:
        # Twice in one line it is the same label for whoever reads the line's number; in two lines it is named.
        assert found("off:", "off:") == [f"A.mod, line {FIRST + 1}: the label off is declared twice in main"]
        return
    (first, *_) = found(line)
    assert first.startswith(f"A.mod, line {FIRST}: "), first
    assert reason in first


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("VAR num x;\nVAR string X;", 3, "X is declared twice: also in A.mod, line 2"),
        ("VAR num a23456789012345678901234567890123;", 2, "at most 32 characters"),
        ("VAR num movel;", 2, "movel is built into the controller, but is declared again"),
        ("PROC tool0()\nENDPROC", 2, "tool0 is built into the controller"),
        ("VAR number x;", 2, "number is not declared"),
        ("VAR main x;\nPROC main()\nENDPROC", 2, "main is not a type"),
        ("PROC main()\nENDPROC\nVAR num x;", 4, "x is declared after a routine"),
        ("VAR num x;\nALIAS num y;", 3, "y is declared after data or a routine"),
        ("PROC go()\nENDPROC\nRECORD r num x; ENDRECORD", 4, "r is declared after data or a routine"),
        ("CONST num x;", 2, "x is a CONST without a value"),
        ("PERS num x;", 2, "x is a PERS without an initial value"),
        ("PERS num x:=1+1;", 2, "x is a PERS, so its initial value must be a literal"),
        ("VAR num y;\nCONST num x:=y;", 3, "x must be constant, but y is a VAR"),
        ("CONST num x:=Abs(-1);", 2, "x must be constant, but Abs is a function"),
        ("VAR num x{2}:=[1,2,3];", 2, "the array has 2 elements, found 3"),
        ("FUNC num f()\nRETURN;\nENDFUNC", 3, "f is a function, but RETURN has no value"),
        ('FUNC num f()\nRETURN "a";\nENDFUNC', 3, '"a" is not a num, needed for RETURN of f'),
        ("FUNC nothing f()\nRETURN 1;\nENDFUNC", 2, "nothing is not declared"),
        ("PROC f(num x)\nVAR num X;\nENDPROC", 3, "X is declared twice"),
        ("RECORD r nothing x; ENDRECORD", 2, "nothing is not declared"),
    ],
)
def test_declarations_are_judged(text: str, line: int, reason: str) -> None:
    with pytest.raises(VerificationError) as caught:
        read_task([("A.mod", f"MODULE A\n{text}\nENDMODULE\n")], signals=SIGNALS)
    assert str(caught.value).startswith(f"A.mod, line {line}: ")
    assert reason in str(caught.value)


def modules(**texts: str) -> list[tuple[str, str]]:
    return [(f"{name}.mod", f"MODULE {name}\n{text}\nENDMODULE\n") for name, text in texts.items()]


def test_what_is_local_belongs_to_its_module_and_hides_what_is_declared_for_all() -> None:
    own = "LOCAL VAR string x;\nPROC go{0}()\nx:={1};\nENDPROC"
    read_task(modules(A="VAR num x;", B=own.format("b", '"b"'), C=own.format("c", '"c"')), signals=None)
    with pytest.raises(VerificationError, match=r"B\.mod, line 4: 1 is not a string"):
        read_task(modules(A="VAR num x;", B=own.format("b", "1")), signals=None)
    with pytest.raises(VerificationError, match=r"A\.mod, line 3: hidden is not declared"):
        read_task(modules(A="PROC go()\nhidden;\nENDPROC", B="LOCAL PROC hidden()\nENDPROC"), signals=None)


def test_modules_are_resolved_together_whatever_their_order() -> None:
    pair = modules(A="PROC go()\nthere y;\nENDPROC", B="VAR num y;\nPROC there(VAR num z)\nENDPROC")
    for task in (pair, pair[::-1]):
        assert read_task(task, signals=None).open_names == ()
    with pytest.raises(VerificationError, match=r"A\.mod, line 3: there is not declared"):
        read_task(pair[:1], signals=None)
    with pytest.raises(VerificationError, match="module A is declared twice"):
        resolve([parse_module("A.mod", pair[0][1]), parse_module("A2.mod", pair[0][1])], signals=None)


def test_an_open_task_lists_what_nothing_declares() -> None:
    task, errors = examine([parse_module("A.mod", "MODULE A\nPROC a()\nthere y;\nSetDO z,1;\nENDPROC\nENDMODULE")],
                           signals=None, closed=False)  # fmt: skip
    assert errors == []
    assert [(line, name) for _, line, name in task.open_names] == [(3, "there")]


def test_without_a_list_of_signals_what_stands_in_the_place_of_one_is_one() -> None:
    text = "PROC go()\nSetDO doFar,1;\nIF doFar=1 Stop;\nENDPROC"
    read_task(modules(A=text), signals=None)
    with pytest.raises(VerificationError, match="doFar is not declared"):
        read_task(modules(A=text), signals=SIGNALS)
    with pytest.raises(VerificationError, match="doFar is not declared"):
        read_task(modules(A="PROC go()\nIF doFar=1 Stop;\nENDPROC"), signals=None)


def test_what_the_controller_brings_is_itself_right() -> None:
    errors = [str(error) for error in examine([builtins().module], signals=None, closed=False)[1]]
    # Only constants whose value depends on the controller have none.
    assert [error for error in errors if "is a CONST without a value" not in error] == []
    kinds = {routine.name: len(routine.parameters) for routine in builtins().module.routines}
    assert (kinds["MoveL"], kinds["TriggIO"], kinds["PoseMult"], kinds["SetDO"]) == (13, 14, 2, 4)


def test_a_task_read_from_files_is_the_same_as_from_memory(tmp_path: Path) -> None:
    (tmp_path / "A.mod").write_text(HEAD + TAIL)
    text = (tmp_path / "A.mod").read_text()
    assert read_task([("A.mod", text)], signals=SIGNALS).modules == (parse_module("A.mod", HEAD + TAIL),)


@pytest.mark.parametrize(
    ("deep", "line"),
    [("x:=" + "(" * 4000 + "1" + ")" * 4000 + ";", FIRST), ("b:=" + " AND ".join(["b"] * 9000) + ";", 1)],
)
def test_what_is_nested_too_deeply_is_refused_and_not_a_crash(deep: str, line: int) -> None:
    with pytest.raises(VerificationError, match=rf"A\.mod, line {line}: .*too deeply"):
        read_task([("A.mod", HEAD + deep + TAIL)], signals=SIGNALS)


def test_cycles_are_collected_again_after_reading_and_not_where_nobody_collected_them() -> None:
    for collecting in (True, False):
        (gc.enable if collecting else gc.disable)()
        try:
            with uncollected():
                assert not gc.isenabled()
            assert gc.isenabled() == collecting
        finally:
            gc.enable()
