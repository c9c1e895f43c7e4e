"""Toolpaths of any program are read: each format with what it leaves open, and by its content, not its name."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import InputError, UsageError
from geoprint.model import FloatArray
from geoprint.toolpath_files import PathFile, gcode, path_file, read_paths

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def call(text: str, name: str = "paths.txt") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return call


def runs(found: PathFile) -> list[list[list[float]]]:
    return [run.round(6).tolist() for run in np.split(found.curves.points, found.curves.offsets[1:-1])]


ONE, TWO = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [[0.0, 2.0, 0.5], [1.0, 2.0, 0.5]]


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z,run\n0,0,0,1\n1,0,0,1\n0,2,0.5,2\n1,2,0.5,2\n",
        "run;Z;Y;X;note\n7;0;0;0;a\n7;0;0;1;b\n8;0,5;2;0;c\n8;0,5;2;1;d\n",
        "# made by hand\n\nrun\tx\ty\tz\na\t0\t0\t0\na\t1\t0\t0\nb\t0\t2\t.5\nb\t1\t2\t5e-1\n",
        "x y z run\n0 0 0 0\n1 0 0 0\n0 2 0.5 1\n1 2 0.5 1\n",
        "X [mm],Y [mm],Z [mm],run,deposit\r\n0,0,0,0,1\r\n1,0,0,0,1\r\n5,5,5,0,0\r\n0,2,.5,0,1\r\n1,2,.5,0,1\r\n",
        "\ufeffx_mm,y_mm,z_mm,run\n0,0,0,1\n1,0,0,1\n9,9,9,5\n0,2,0.5,2\n1,2,0.5,2\n",
    ],
    ids=["commas", "semicolons and decimal commas", "tabs", "blanks", "travel between", "a run of one point"],
)
def test_a_table_has_its_columns_in_any_order(write: Write, text: str) -> None:
    found = read_paths(write(text))
    assert (found.format, runs(found)) == ("table", [ONE, TWO])


def test_a_table_without_runs_is_one_run(write: Write) -> None:
    assert runs(read_paths(write("x,y,z\n0,0,0\n1,0,0\n"))) == [ONE]


INCHES = """G20
G91
G1 X0.0393700787401575
G0 X-0.0393700787401575 Y0.078740157480315 Z0.0196850393700787
G1 X0.0393700787401575
"""
HEAD = "; made by a slicer\nM140 S60\nM117 Printing 100%\nSET_VELOCITY_LIMIT ACCEL=500\nZ_TILT_ADJUST\nG28\nG21\nG90\n"


@pytest.mark.parametrize(
    ("text", "deposit"),
    [
        (
            "M82\nG92 E0\nG1 Z0 F900\nG1 E-1\nG0 X0 Y0\nG1 E0\nG1 X1 E0.1\nG1 E-1\nG0 X0 Y2 Z.5\nG1 E0.1\nX1 E0.2\n",
            "growing E",
        ),
        ("M83\nN10 G1 X0 Y0 Z0*71\nN20 g1x1e.1*4\nG1 X0 Y2 Z0.5 E-1 (travel)\nG1 X1 Y2 E.1 ; deposit\n", "growing E"),
        ("G91\nG1 X1 E1\nG1 X-1 Y2 Z.5 E0\nG1 X1 E1\n", "growing E"),
        ("G92 X10 E5\nG1 X11 E6\nG1 X10 Y2 Z.5 E5\nG1 X11 E6\n", "growing E"),
        ("M3 S100\nG1 X1\nM5\nG1 X0 Y2 Z.5\nM3\nG1 X1\nM5\n", "M-codes"),
        ("G1 X1\nG00 X0 Y2 Z.5\nG01 X1\n", "G1, while G0 travels"),
        (INCHES, "G1, while G0 travels"),
    ],
    ids=["absolute E", "relative E", "all relative", "G92", "M-codes", "G0 and G1", "inches"],
)  # fmt: skip
def test_gcode_tells_deposit_from_travel(write: Write, text: str, deposit: str) -> None:
    found = read_paths(write(f"{HEAD}{text}", "part.gcode"))
    assert (found.format, found.deposit) == ("G-code", deposit)
    # Where G92 gives the head another place, coordinates are those of the head as it was.
    assert runs(found) == [ONE, TWO]


def test_named_m_codes_switch(write: Write) -> None:
    path = write("G28\nM64\nG1 X1\nM65\nG1 X0 Y2 Z.5\nM64\nG1 X1\nM65\n")
    assert runs(read_paths(path, deposit="M64/M65")) == [ONE, TWO]
    with pytest.raises(UsageError, match="is neither two M-codes"):
        read_paths(path, deposit="valve")


APT = """PARTNO PATCH $$ a comment
UNITS/MM
LOADTL/1
FEDRAT/100,MMPM
RAPID
GOTO/0,0,0
GOTO/1,0,0
RAPID
GOTO/0,2,0.5
GOTO/1,2,0.5
FINI
"""
CLS = """TOOL PATH/SPIRAL,TOOL,BALL
MSYS/0,0,0,1,0,0,0,1,0
FROM/9,9,9,0,0,1
RAPID
GOTO/0,0,0,0,0,1
GOTO/1.0000,0.,0.,$
0,0,1
PAINT/PATH
RAPID
GOTO/0,2,.5,0,0,1
GOTO/1,2,.5
END-OF-PATH
"""
APT_INCHES = """UNITS/INCHES
RAPID
GOTO / 0, 0, 0
GOTO / 0.03937007874, 0, 0
RAPID
GOTO/0,0.07874015748,0.01968503937
GOTO/0.03937007874,0.07874015748,0.01968503937
"""


@pytest.mark.parametrize("text", [APT, CLS, APT_INCHES], ids=["APT", "CLS", "inches"])
def test_apt_travels_by_rapid(write: Write, text: str) -> None:
    found = read_paths(write(text, "part.cls"))
    assert (found.format, runs(found)) == ("APT", [ONE, TWO])


AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
WORK = 'PERS wobjdata part:=[FALSE,TRUE,"",[[300,0,200],[1,0,0,0]],[[0,0,10],[1,0,0,0]]];'


def move(verb: str, *places: tuple[float, float, float]) -> str:
    targets = ",".join(f"[[{x},{y},{z}],[0,0,1,0],[0,0,0,0],{AXES}]" for x, y, z in places)
    return f"{verb} {targets},v20,fine,tool0\\WObj:=part;"


def module(body: str, declared: str = "") -> str:
    return f"MODULE Hand\n{WORK}\n{declared}\nPROC main()\n{body}\nENDPROC\nENDMODULE\n"


SWITCHED = "\n".join(
    [move("MoveJ", (0, 0, 9)), move("MoveL", (0, 0, 0)), "SetDO doGlue,1;", move("MoveL", (1, 0, 0)), "SetDO doGlue,0;",
     move("MoveL", (0, 2, 0.5)), "SetDO doGlue,1;", move("MoveL", (1, 2, 0.5)), "Reset doGlue;"]
)  # fmt: skip
UNSWITCHED = "\n".join(
    [move("MoveJ", (0, 0, 0)), move("MoveL", (1, 0, 0)), move("MoveJ", (0, 2, 0.5)), move("MoveL", (1, 2, 0.5))]
)


@pytest.mark.parametrize(("body", "deposit"), [(SWITCHED, "the output doglue"), (UNSWITCHED, "MoveL and MoveC")])
def test_rapid_is_executed_in_its_work_object(write: Write, body: str, deposit: str) -> None:
    found = read_paths(write(module(body), "Hand.mod"))
    assert found.format == "RAPID"
    assert found.deposit.startswith(deposit)
    assert runs(found) == [ONE, TWO]


def test_rapid_switches_on_the_way(write: Write) -> None:
    body = "\n".join(
        [move("MoveL", (0, 0, 0)), "TriggIO t1,1\\Start\\DOp:=doGlue,1;", "TriggIO t2,2\\DOp:=doGlue,0;",
         move("MoveL", (0, 0, 0)), move("TriggL", (10, 0, 0)).replace("v20,", "v20,t1\\T2:=t2,")]
    )  # fmt: skip
    found = read_paths(write(module(body, "VAR triggdata t1; VAR triggdata t2;")))
    assert runs(found) == [[[1.0, 0.0, 0.0], [8.0, 0.0, 0.0]]]


def test_rapid_moves_along_arcs(write: Write) -> None:
    body = "\n".join([move("MoveJ", (20, 0, 0)), move("MoveC", (10, 10, 0), (0, 0, 0))])
    points: FloatArray = read_paths(write(module(body))).curves.points
    assert len(points) == 181
    np.testing.assert_allclose(np.hypot(points[:, 0] - 10.0, points[:, 1]), 10.0, atol=1e-9)
    assert points[:, 1].min() > -1e-9


def test_of_several_outputs_the_one_that_deposits_is_named(write: Write) -> None:
    path = write(module(f"Set doLamp;\n{SWITCHED}\nReset doLamp;"))
    with pytest.raises(UsageError, match="switches the outputs dolamp, doglue; say with `--deposit NAME`"):
        read_paths(path)
    assert runs(read_paths(path, deposit="doGlue")) == [ONE, TWO]
    with pytest.raises(UsageError, match="switches no such output, but dolamp, doglue"):
        read_paths(path, deposit="doValve")


def test_a_program_without_main_begins_where_it_only_can(write: Write) -> None:
    assert runs(read_paths(write(module(SWITCHED).replace("main", "Path_10")))) == [ONE, TWO]


def test_memory_is_bounded_by_a_number_of_points(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path_file, "MOST_POINTS", 100)
    lines = "".join(f"{x},0,0\n" for x in range(200))
    with pytest.raises(InputError, match="line 102: the file has more than 100 points"):
        read_paths(write(f"x,y,z\n{lines}"))
    with pytest.raises(InputError, match="line 102: the file has more than 100 points"):
        read_paths(write("G28\n" + "".join(f"G0 X{x}\n" for x in range(1, 200))))
    monkeypatch.setattr(path_file, "MOST_LINE", 50)
    with pytest.raises(InputError, match="line 2: it is longer than 50 bytes"):
        read_paths(write(f"x,y,z\n{'1' * 60},0,0\n"))
    monkeypatch.setattr(path_file, "MOST_BYTES", 10)
    with pytest.raises(InputError, match=r"paths\.txt has 18 bytes, a file of toolpaths has at most 10"):
        read_paths(write("x,y,z\n0,0,0\n1,0,0\n"))


def test_long_comments_of_a_slicer_do_not_hide_its_moves(write: Write) -> None:
    comments = "".join(f"; thumbnail {'A' * 70}\n" for _ in range(500))
    assert gcode.is_gcode(f"{comments}G28\n")
    assert runs(read_paths(write(f"{comments}G28\nG1 X1\n"))) == [ONE]


MALFORMED = {
    "nothing": ("", "unknown format"),
    "prose": ("Dear all,\nplease find the paths attached.\n", "unknown format"),
    "four columns without a header": ("0 0 0 1\n1 0 0 1\n", "line 1: found 4 cells separated by blanks and no header"),
    "a mesh": ("solid part\nfacet normal 0 0 1\n", "unknown format"),
    "a table of two axes": ("x,y,run\n0,0,1\n", "unknown format"),
    "centimetres": ("x,y,z,x (cm)\n0,0,0,0\n", "line 1: column 'x (cm)' is in another unit"),
    "only a header": ("x,y,z,run\n", "holds no path that deposits"),
    "a single point": ("x,y,z\n0,0,0\n", "holds no path that deposits"),
    "runs of single points": ("x,y,z,run\n0,0,0,1\n1,0,0,2\n", "holds no path that deposits"),
    "a cell too few": (
        "x,y,z\n0,0,0\n1,0\n",
        "line 3: found 2 cells separated by commas, but the header names 3",
    ),
    "a cell too many": ("x,y,z\n0,0,0\n1,0,0,0\n", "line 3: found 4 cells"),
    "decimal commas between commas": ("x,y,z\n0,5,0,0\n", "line 2: found 4 cells"),
    "no number": ("x,y,z\n0,0,0\n1,zero,0\n", "line 3, column y: found 'zero', needed is a number"),
    "not a number": ("x,y,z\n0,0,nan\n1,0,0\n", "line 2, column z: found 'nan'"),
    "infinity": ("x,y,z\n0,0,0\ninf,0,0\n", "line 3, column x: found 'inf'"),
    "a number nobody means": ("x,y,z\n0,0,0\n1_0,0,0\n", "line 3, column x: found '1_0'"),
    "another planet": ("x,y,z\n0,0,0\n1e9,0,0\n", "line 3, column x: found '1e9'"),
    "an empty cell": ("x,y,z\n0,0,0\n,0,0\n", "line 3, column x: found ''"),
    "an empty run": ("x,y,z,run\n0,0,0,\n", "line 2: the cell of column run is empty"),
    "a strange flag": ("x,y,z,deposit\n0,0,0,maybe\n", "line 2: column deposit is 'maybe'"),
    "only travel": ("x,y,z,deposit\n0,0,0,0\n1,0,0,0\n", "holds no path that deposits"),
    "a zero byte": ("x,y,z\n0,0,0\n1,0\0,0\n", "line 3: it holds a zero byte"),
    "a spline": ("G28\nG1 X1 E1\nG5 X2 Y2 I1 J0 P1 Q1 E2\n", "line 3: G5 is not read"),
    "an arc that does not meet": ("G28\nG1 X1 E1\nG2 X2 Y2 I1 J0 E2\n", "line 3: the arc begins 1 mm from"),
    "X without a number": ("G28\nG1 X E1\n", "line 2: X has no number"),
    "E without a number": ("G28\nG1 X1 E\n", "line 2: E has no number"),
    "X twice": ("G28\nG1 X1 X2 E1\n", "line 2: X stands in it twice"),
    "a word that is none": ("G28\nG1 X1 @ E1\n", "line 2: '@ E1' is no word"),
    "two points in a number": ("G28\nG1 X1.2.3 E1\n", "line 2: '.3 E1' is no word"),
    "far away": ("G28\nG1 X1 E1\nG1 X99999999 E2\n", "line 3: X is '99999999'"),
    "from nowhere": ("G21\nG91\nG1 X1 Y1 Z1 E1\n", "line 3: it moves X by a distance, but from where"),
    "a height that nobody set": ("G21\nG1 X0 Y0 E0\nG1 X1 E1\n", "line 3: it deposits before all of X, Y and Z"),
    "gcode without a move": ("G28\nG21\nM84\n", "holds no path that deposits"),
    "two coordinates": ("UNITS/MM\nGOTO/0,0\n", "line 2: a point has 3 numbers, or 6"),
    "no coordinates": ("UNITS/MM\nGOTO\n", "line 2: a point has 3 numbers, or 6"),
    "letters": ("UNITS/MM\nGOTO/0,0,0\nGOTO/A,0,0\n", "line 3: x is 'A'"),
    "an axis of letters": ("UNITS/MM\nGOTO/0,0,0,0,0,up\n", "line 2: the tool's axis is 'up'"),
    "a unit of old": ("UNITS/CUBITS\nGOTO/0,0,0\n", "line 1: UNITS/CUBITS is no unit"),
    "half a circle": ("UNITS/MM\nGOTO/5,0,0\nCIRCLE/0,0,0,0,0,1,5\n", "line 3: no GOTO behind CIRCLE says where"),
    "a surface": ("UNITS/MM\nGOTO/0,0,0\nTLON,GOFWD/C1,ON,L1\n", "line 3: this motion is not read"),
    "no end": ("UNITS/MM\nGOTO/0,0,$\n", "line 2: the file ends within a statement"),
    "only rapid": ("UNITS/MM\nRAPID\nGOTO/0,0,0\nRAPID\nGOTO/1,0,0\n", "holds no path that deposits"),
    "half a module": ("MODULE Hand\nPROC main()\nMoveL\n", "line 3: "),
    "a tool from elsewhere": (module(SWITCHED.replace("tool0", "nozzle")), "line 5: "),
    "a target that lacks a part": (module(SWITCHED.replace("[0,0,1,0],[0,0,0,0]", "[0,0,1,0]")), "line 5: "),
    "a speed that is none": (module(SWITCHED.replace("v20", "tool0")), "line 5: "),
    "no beginning": (module("").replace("PROC main()", "PROC main(num a)"), "has no procedure main"),
    "for ever": (module("WHILE n = 0 DO\nWaitTime 1;\nENDWHILE", "VAR num n;"), "does not run to its end"),
    "an encoded module": ("MODULE Hand(NOVIEW)\nx5f\n", "encoded"),
    "nothing moves": (module('TPWrite "hello";'), "holds no path that deposits"),
}


@pytest.mark.parametrize("what", [*MALFORMED])
def test_what_is_malformed_is_refused_in_one_sentence(write: Write, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    text, complaint = MALFORMED[what]
    for name in ("MOST_STEPS", "LEAST_STEPS"):
        monkeypatch.setattr(f"geoprint.toolpath_files.rapid.{name}", 2000)
    with pytest.raises(InputError, match=re.escape(complaint)) as refused:
        read_paths(write(text, "odd.nc"))
    said = str(refused.value)
    assert said.startswith(("odd.nc", "Hand.mod")), said
    assert said.count("\n") == 0
    assert said.endswith(".")


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist; check the name"):
        read_paths(tmp_path / "nowhere.csv")
    with pytest.raises(InputError, match=r"holds neither a poses\.csv nor modules"):
        read_paths(tmp_path)
    with pytest.raises(InputError, match="is no plain file"):
        read_paths("/dev/null")
    assert len(MALFORMED) >= 40
