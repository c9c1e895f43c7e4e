"""Functions, operators, types and names that every controller has: the values that the RAPID reference gives them."""

from __future__ import annotations

from typing import cast

import pytest

from geoprint.postprocessor.rapid.machine import Scenario
from tests.postprocessor.rapid.machine.tasks import HOME, ran, target

HALF = 0.70710678
NUMBERS = {
    "Abs(-3.5)": 3.5,
    "Sqrt(6.25)": 2.5,
    "Exp(1)": 2.7182818,
    "Pow(2,10)": 1024.0,
    "Sin(30)": 0.5,
    "Cos(60)": 0.5,
    "Tan(45)": 1.0,
    "ATan(-1)": -45.0,
    "ATan2(1,-1)": 135.0,
    "ASin(0.5)": 30.0,
    "ACos(0.5)": 60.0,
    "Round(0.3852138\\Dec:=3)": 0.385,
    "Round(0.3852138\\Dec:=1)": 0.4,
    "Round(0.5)": 1.0,
    "Round(-2.5)": -3.0,
    "Round(2.4)": 2.0,
    "Trunc(0.3852138\\Dec:=3)": 0.385,
    "Trunc(0.3852138\\Dec:=1)": 0.3,
    "Trunc(-1.9)": -1.0,
    "VectMagn([2,3,6])": 7.0,
    "Distance([1,2,3],[3,5,9])": 7.0,
    "DotProd([1,2,3],[4,-5,6])": 12.0,
    'StrLen("Robotics")': 8.0,
    "14 DIV 4": 3.0,
    "14 MOD 4": 2.0,
    "-14 DIV 4": -3.0,
    "7-2-1": 4.0,
    "-(2-5)": 3.0,
    "+4": 4.0,
    "DotProd([1,0,0]-[3,2,1],[1,1,1])": -5.0,
    "DotProd([2,4,6]/2,[1,10,100])": 321.0,
    "DotProd(-[1,2,3],[1,10,100])": -321.0,
    "DotProd([1,2,3]*2,[1,10,100])": 642.0,
    "DotProd([1,2,3]*[4,5,7],[1,10,100])": -1.0 + 50.0 - 300.0,
    "CSpeedOverride()": 70.0,
    "DOutput(doValve)": 1.0,
    "AOutput(aoFlow)": 0.25,
    "aoFlow*4": 1.0,
    "Dim(table,1)": 2.0,
    "Dim(table,2)": 3.0,
}
TRUTHS = {
    "TestDI(diDoor)": True,
    "diDoor=1": True,
    "2<=2": True,
    "2>=3": False,
    "2<2": False,
    "3>2": True,
    "2<>2": False,
    '"a"="a"': True,
    "TRUE XOR FALSE": True,
    "TRUE AND FALSE": False,
    "FALSE OR TRUE": True,
    "FALSE OR FALSE": False,
    "[1,2,3]=[1,2,3]": True,
}
TEXTS = {
    "NumToStr(0.38521,3)": "0.385",
    "NumToStr(0.38521,2\\Exp)": "3.85E-01",
    "ValToStr(TRUE)": "TRUE",
    "ValToStr([1,2.5,3])": "[1,2.5,3]",
    "ValToStr(1234567)": "1.23457E+06",
    'ValToStr("a")': "a",
    'StrPart("Robotics",1,5)': "Robot",
    'StrPart("Robotics",6,3)': "ics",
    'StrPart("Robotics",9,0)': "",
    '"a"+"b"': "ab",
}
PLACES = {
    "pos PoseVect([[1,2,3],[0,1,0,0]],[1,10,100])": (2.0, -8.0, -97.0),
    f"pos PoseVect([[0,0,0],[{HALF},0,0,{HALF}]],[1,2,3])": (-2.0, 1.0, 3.0),
    f"pos PoseVect([[0,0,0],[{HALF},{HALF},0,0]],[1,2,3])": (1.0, -3.0, 2.0),
    f"pos PoseVect([[0,0,0],[{HALF},0,{HALF},0]],[1,2,3])": (3.0, 2.0, -1.0),
    "orient OrientZYX(90,0,0)": (HALF, 0.0, 0.0, HALF),
    "orient OrientZYX(0,90,0)": (HALF, 0.0, HALF, 0.0),
    "orient OrientZYX(0,0,90)": (HALF, HALF, 0.0, 0.0),
    "orient OrientZYX(90,90,0)": (0.5, -0.5, 0.5, 0.5),
    "orient OrientZYX(90,0,90)": (0.5, 0.5, 0.5, 0.5),
    "orient NOrient([3,0,4,0])": (0.6, 0.0, 0.8, 0.0),
    "orient OrientZYX(90,0,0)*OrientZYX(0,90,0)": (0.5, -0.5, 0.5, 0.5),
    f"pose PoseMult([[1,2,3],[0,1,0,0]],[[1,10,100],[{HALF},0,0,{HALF}]])": (
        (2.0, -8.0, -97.0), (0.0, HALF, -HALF, 0.0),
    ),
    f"pose PoseInv([[1,2,3],[{HALF},0,0,{HALF}]])": ((-2.0, 1.0, -3.0), (HALF, 0.0, 0.0, -HALF)),
    f"pose PoseInv([[1,2,3],[{HALF},{HALF},0,0]])": ((-1.0, -3.0, 2.0), (HALF, -HALF, 0.0, 0.0)),
    f"pose PoseInv([[1,2,3],[{HALF},0,{HALF},0]])": ((3.0, -2.0, -1.0), (HALF, 0.0, -HALF, 0.0)),
    "robtarget Offs([[1,2,3],[0,1,0,0],[1,2,3,4],[9E9,9E9,9E9,9E9,9E9,9E9]],10,20,30)": (
        (11.0, 22.0, 33.0), (0.0, 1.0, 0.0, 0.0), (1.0, 2.0, 3.0, 4.0), (9e9,) * 6,
    ),
    "robtarget RelTool([[1,2,3],[0,1,0,0],[1,2,3,4],[9E9,9E9,9E9,9E9,9E9,9E9]],10,20,30)": (
        (11.0, -18.0, -27.0), (0.0, 1.0, 0.0, 0.0), (1.0, 2.0, 3.0, 4.0), (9e9,) * 6,
    ),
    "robtarget RelTool([[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],0,0,0\\Rx:=90\\Ry:=90\\Rz:=90)": (
        (1.0, 2.0, 3.0), (0.0, HALF, 0.0, HALF), (0.0, 0.0, 0.0, 0.0), (9e9,) * 6,
    ),
    "robtarget RelTool([[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],0,0,0\\Rz:=60)": (
        (1.0, 2.0, 3.0), (0.8660254, 0.0, 0.0, 0.5), (0.0, 0.0, 0.0, 0.0), (9e9,) * 6,
    ),
}  # fmt: skip


def value(kind: str, expression: str) -> object:
    """What an expression comes to, as it is stored."""
    scenario = Scenario(joints=HOME, override=70.0, signals={"doValve": 1.0, "AOFLOW": 0.25, "didoor": 1.0})
    declared = f"PERS {kind} found;\nVAR num table{{2,3}};"
    execution = ran(f"found:={expression};", scenario, declared=declared)
    assert (execution.ended, execution.reason) == ("end", "")
    return execution.data["found"]


def flat(values: object) -> list[float]:
    if isinstance(values, tuple):
        return [number for part in cast("tuple[object, ...]", values) for number in flat(part)]
    return [cast("float", values)]


@pytest.mark.parametrize("expression", NUMBERS)
def test_a_number_has_the_value_of_the_reference(expression: str) -> None:
    assert value("num", expression) == pytest.approx(NUMBERS[expression], rel=1e-6)


@pytest.mark.parametrize("expression", TRUTHS)
def test_a_truth_has_the_value_of_the_reference(expression: str) -> None:
    assert value("bool", expression) is TRUTHS[expression]


@pytest.mark.parametrize("expression", TEXTS)
def test_a_text_has_the_value_of_the_reference(expression: str) -> None:
    assert value("string", expression) == TEXTS[expression]


@pytest.mark.parametrize("form", PLACES)
def test_a_place_has_the_value_of_the_reference(form: str) -> None:
    kind, _, expression = form.partition(" ")
    assert flat(value(kind, expression)) == pytest.approx(flat(PLACES[form]), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(
    ("statement", "error"),
    [
        ("found:=Sqrt(-1);", "ERR_ARGVALERR"),
        ("found:=ACos(1.1);", "ERR_ARGVALERR"),
        ("found:=Exp(1000);", "ERR_ARGVALERR"),
        ("found:=1E30*1E30;", "ERR_NUM_LIMIT"),
        ("found:=1 DIV 0;", "ERR_DIVZERO"),
        ("found:=1 MOD 0;", "ERR_DIVZERO"),
        ("where:=where/0;", "ERR_DIVZERO"),
        ('word:=StrPart("Robotics",0,1);', "ERR_OUTOFBND"),
        ('word:=StrPart("Robotics",10,0);', "ERR_OUTOFBND"),
        ('word:=StrPart("Robotics",6,4);', "ERR_OUTOFBND"),
        ("found:=table{0};", "ERR_OUTOFBND"),
        ("found:=table{3};", "ERR_OUTOFBND"),
        ("found:=table{1.5};", "ERR_OUTOFBND"),
        ("table{3}:=1;", "ERR_OUTOFBND"),
        ("where:=PoseVect([[0,0,0],[1.0011,0,0,0]],where);", "ERR_ARGVALERR"),
        ("where:=PoseVect([[0,0,0],[0.9989,0,0,0]],where);", "ERR_ARGVALERR"),
        ("PDispSet [[0,0,0],[0,0,0,0]];", "ERR_ARGVALERR"),
        ("EOffsSet [0,0,1,0,0,0];", "ERR_NORUNUNIT"),
        ("RAISE;", "ERR_ILLRAISE"),
        ("RETRY;", "ERR_ILLRAISE"),
        ("TRYNEXT;", "ERR_ILLRAISE"),
        ("RAISE 7;", "error 7"),
        ("WaitUntil FALSE\\MaxTime:=4;", "ERR_WAIT_MAXTIME"),
        ('Load diskhome\\File:="None.mod";', "ERR_FILNOTFND"),
        ('Load diskhome\\File:="Main.mod";', "ERR_FILNOTFND"),
        ('UnLoad diskhome\\File:="None.mod";', "ERR_UNLOAD"),
        ("TriggIO t,1,1;", "ERR_ARGDUPCND"),
        ("TriggEquip t,1,0\\DOp:=doUV\\AOp:=aoFlow,1;", "ERR_ARGDUPCND"),
        ("TriggEquip t,1,0,1;", "ERR_ARGDUPCND"),
        (f"MoveL {target(300)},[0,500,0,0],fine,tool0;", "ERR_SPEED_REFRESH_LIM"),
        (f"MoveL {target(300)},[10,0,0,0],fine,tool0;", "ERR_SPEED_REFRESH_LIM"),
        (f"MoveL Offs({target(300)},0,0,0),[0,500,0,0],fine,tool0;", "ERR_SPEED_REFRESH_LIM"),
        (f"VelSet 0,100; MoveL Offs({target(300)},0,0,0),v20,fine,tool0;", "ERR_SPEED_REFRESH_LIM"),
        (f"MoveL {target(300)},stands,fine,tool0;", "ERR_SPEED_REFRESH_LIM"),
        (f"MoveL {target(300)},turnless,fine,tool0;", "ERR_SPEED_REFRESH_LIM"),
        (f"MoveL {target(300)},v20,fine,fixed;", "ERR_NORUNUNIT"),
        (f"MoveL {target(300)},v20,fine,tool0\\WObj:=carried;", "ERR_NORUNUNIT"),
        (f"MoveL {target(300)},v20,fine,tool0\\WObj:=turntable;", "ERR_NORUNUNIT"),
        (f"MoveL {target(300)},v20,fine,tool0; MoveC {target(310)},{target(320)},v20,fine,tool0;", "ERR_ARGVALERR"),
        ("MoveL [[300,0,300],[0,1.0011,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,fine,tool0;", "ERR_ARGVALERR"),
        ("MoveL [[300,0,300],[0,0.9989,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,fine,tool0;", "ERR_ARGVALERR"),
    ],
)
def test_what_has_no_value_is_an_error_of_the_program(statement: str, error: str) -> None:
    declared = """
    VAR num found; VAR pos where; VAR string word; VAR num table{2}; VAR triggdata t;
    PERS speeddata stands:=[0,500,5000,1000];
    PERS speeddata turnless:=[20,0,5000,1000];
    PERS tooldata fixed:=[FALSE,[[0,0,0],[1,0,0,0]],[0.001,[0,0,0.001],[1,0,0,0],0,0,0]];
    PERS wobjdata carried:=[TRUE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
    PERS wobjdata turntable:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
    """
    execution = ran(statement, declared=declared)
    assert execution.ended == "error"
    assert execution.reason.startswith(error)
