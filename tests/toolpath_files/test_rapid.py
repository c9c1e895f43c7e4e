r"""RAPID that others wrote: moves that switch, processes, mechanical units, loops without an end.

Each program prints the same three rows of 10 mm, 4 mm apart, unless its name says otherwise.
"""

from __future__ import annotations

import random
import time
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import InputError, UsageError
from geoprint.toolpath_files import PathFile, read_paths
from tests.shared_data import shared

ROWS = [[[0.0, 4.0 * i, 0.0], [10.0, 4.0 * i, 0.0]] for i in range(3)]
NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
DECLARED = """TASK PERS wobjdata part:=[FALSE,TRUE,"",[[300,0,200],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
TASK PERS tooldata gun:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
"""
# Processor time that a program under a megabyte may take [s].
MOST_SECONDS = 10.0


def target(x: float, y: float | str, z: float = 0.0, axes: str = NO_AXES) -> str:
    return f"[[{x},{y},{z}],[0,0,1,0],[0,0,0,0],{axes}]"


def move(verb: str, *targets: str, zone: str = "fine", more: str = "") -> str:
    return f"{verb} {','.join(targets)},v20{more},{zone},gun\\WObj:=part;"


def module(body: str, declared: str = "", routines: str = "") -> str:
    return f"MODULE Mod1\n{DECLARED}{declared}\nPROC main()\n{body}\nENDPROC\n{routines}\nENDMODULE\n"


def rows(on: str = "SetDO doGlue,1;", off: str = "SetDO doGlue,0;", axes: str = NO_AXES, zone: str = "fine") -> str:
    found = [move("MoveJ", target(0, 0, 9, axes))]
    for i in range(3):
        found += [move("MoveL", target(0, 4 * i, 0, axes), zone=zone), on]
        found += [move("MoveL", target(10, 4 * i, 0, axes), zone=zone), off]
    return "\n".join(found)


def each_row(begin: str, end: str) -> str:
    """Return the rows by two instructions, with {} where their target stands."""
    lines = [text.format(target(x, 4 * i)) for i in range(3) for x, text in ((0, begin), (10, end))]
    return "\n".join([move("MoveJ", target(0, 0, 9)), *lines])


def read(folder: Path, text: str, *, deposit: str | None = None) -> PathFile:
    (folder / "p.mod").write_text(text, encoding="utf-8")
    return read_paths(folder / "p.mod", deposit=deposit)


def runs(found: PathFile) -> list[list[list[float]]]:
    return [run.round(4).tolist() for run in np.split(found.curves.points, found.curves.offsets[1:-1])]


CALLS = "PROC on()\nSet doGlue;\nENDPROC\nPROC off()\nReset doGlue;\nENDPROC"
AXES = "[45,0,9E9,9E9,9E9,9E9]"
WRITTEN = {
    "SetDO": module(rows()),
    "Set and Reset": module(rows("Set doGlue;", "Reset doGlue;")),
    "a moment of the cycle": module(rows("SetDO \\Sync,doGlue,1;")),
    "an analog output": module(rows("SetAO aoFlow,1.5;", "SetAO aoFlow,0;")),
    "a group": module(rows("SetGO goFlow,5;", "SetGO goFlow,0;")),
    "InvertDO": module(rows("InvertDO doGlue;", "InvertDO doGlue;")),
    "MoveLDO": module(each_row(
        "MoveLDO {},v20,z5,gun\\WObj:=part,doGlue,1;", "MoveLDO {}\\ID:=3,v20,z5,gun\\WObj:=part,doGlue,0;"
    )),
    "MoveLAO": module(each_row(
        "MoveLAO {},v20,z5,gun\\WObj:=part,aoFlow,2;", "MoveLAO {},v20,z5,gun\\WObj:=part,aoFlow,0;"
    )),
    "MoveLSync": module(each_row(
        'MoveLSync {},v20,z5,gun\\WObj:=part,"on";', 'MoveLSync {},v20,z5,gun\\WObj:=part,"off";'
    ), routines=CALLS),
    "TriggL": module(
        "TriggIO t1,0\\Start\\DOp:=doGlue,1;\nTriggEquip t2,0,0\\DOp:=doGlue,0;\n"
        + each_row("MoveL {},v20,fine,gun\\WObj:=part;", "TriggL {},v20,t1\\T2:=t2,fine,gun\\WObj:=part;"),
        "VAR triggdata t1;\nVAR triggdata t2;",
    ),
    "DispL": module(
        each_row("DispL \\On,{},v20,bead1,z5,gun\\WObj:=part;", "DispL \\Off,{},v20,bead1,z5,gun\\WObj:=part;"),
        "PERS beaddata bead1:=[1,100,100,0,0];",
    ),
    "ArcL": module(
        each_row("ArcLStart {},v20,s1,w1,fine,gun\\WObj:=part;", "ArcLEnd {},v20,s1,w1\\Weave:=v1,z1,gun\\WObj:=part;"),
        "PERS seamdata s1:=[0,0,0,0];\nPERS welddata w1:=[5,0,[0,0,0,0],[0,0,0,0]];\nPERS weavedata v1:=[1,0,3];",
    ),
    "options that change nothing": module(rows().replace("part;", "part\\TLoad:=load0;")),
    "a unit that stands still": module(f"ActUnit STN1;\n{rows(axes=AXES)}\nDeactUnit STN1;"),
    "a unit that the part goes with": module(
        "ActUnit STN1;\n" + rows(axes=AXES).replace("[45,0", "[90,0", 3)
    ).replace('[FALSE,TRUE,""', '[FALSE,FALSE,"STN1"'),
    "a part in the gripper": module(rows()).replace("part:=[FALSE", "part:=[TRUE").replace("gun:=[TRUE", "gun:=[FALSE"),
    "inputs": module(
        f"WaitDI diStart,1;\nIF diPart=1 THEN\n{rows()}\nENDIF\nWaitUntil diDone=1\\MaxTime:=3;\nStop;"
    ),
    "interrupts": module(
        f"CONNECT i1 WITH t1;\nISignalDI diStop,1,i1;\n{rows()}\nIDelete i1;", "VAR intnum i1;",
        "TRAP t1\nReset doGlue;\nENDTRAP",
    ),
    "a loop without an end": module(f"WHILE TRUE DO\n{rows()}\nENDWHILE"),
    "a loop within": module(f"FOR i FROM 1 TO 1 DO\nWHILE 1=1 DO\n{rows()}\nENDWHILE\nENDFOR"),
    "a label": module(f"again:\n{rows()}\nGOTO again;"),
    "a program that calls itself": module(f"{rows()}\nmain;"),
}  # fmt: skip


@pytest.mark.parametrize("what", [*WRITTEN])
def test_rows_are_read_however_they_are_written(tmp_path: Path, what: str) -> None:
    assert runs(read(tmp_path, WRITTEN[what])) == ROWS


def test_what_is_skipped_and_assumed_is_said(tmp_path: Path) -> None:
    found = read(tmp_path, WRITTEN["inputs"])
    assert found.reading.used == {"moves": 7, "switchings of doglue": 6}
    assert dict(found.reading.skipped) == {"WaitDI": 1, "WaitUntil": 1, "Stop": 1}
    assert found.reading.assumed[0] == "what is waited for comes, and Stop goes on"
    assert found.reading.assumed[1].startswith("the input dipart is 1 (line ")
    found = read(tmp_path, WRITTEN["a loop without an end"])
    assert found.reading.assumed == ("the loop without an end is read for one pass (p.mod, line 6)",)
    found = read(tmp_path, WRITTEN["a unit that stands still"])
    assert found.reading.assumed == ("external axes stand still",)


def test_the_process_deposits_where_other_outputs_are_switched(tmp_path: Path) -> None:
    text = WRITTEN["DispL"].replace("PROC main()\n", "PROC main()\nSet doLamp;\n")
    assert runs(read(tmp_path, text)) == ROWS
    with pytest.raises(UsageError, match="switches no such output, but dolamp, dispenser"):
        read(tmp_path, text, deposit="doGlue")


def test_arcs_lead_through_places_that_are_computed(tmp_path: Path) -> None:
    # Two half circles of 10 mm in one line, through a place that the program computes and then changes.
    body = "\n".join([
        move("MoveJ", target(20, 0)), "p:=" + target(0, 0) + ";",
        move("MoveC", "Offs(p,10,10,0)", "p") + " p.trans.y:=-10; " + move("MoveC", "Offs(p,10,0,0)", target(20, 0)),
        "p.trans.x:=500;",
    ])  # fmt: skip
    found = read(tmp_path, module(body, "VAR robtarget p;"))
    points = found.curves.points
    np.testing.assert_allclose(np.hypot(points[:, 0] - 10.0, points[:, 1]), 10.0, atol=1e-4)
    assert (found.curves.offsets.tolist(), points[:, 1].min(), points[:, 1].max()) == ([0, 361], -10.0, 10.0)


REFUSED = {
    "a unit that moves": (
        module(rows(axes=AXES) + rows(axes="[90,0,9E9,9E9,9E9,9E9]")), "p.mod, line 18: an external axis moves"
    ),
    "an axis that is computed": (
        module(f"p.extax.eax_a:=30;\n{rows()}", "VAR robtarget p;"), "line 6: it gives an external axis a value"
    ),
    "a displacement": (module(f"PDispOn p1,gun;\n{rows()}", f"CONST robtarget p1:={target(0, 0)};"), "line 6: PDispOn"),
    "an unknown word": (module(f"Wobble 3;\n{rows()}"), "line 6: Wobble is not declared"),
    "paint": (module(f"{rows()}\nPaintL {target(0, 0)},v20,z5,gun;"), "line 19: PaintL is not an instruction"),
    "a delay": (module(rows("SetDO \\SDelay:=0.2,doGlue,1;")), "line 8: the option SDelay"),
    "a bead that changes on the way": (
        WRITTEN["DispL"].replace("\\On,", "\\On\\D:=5,", 1), "line 7: DispL changes its bead off its target"
    ),
    "too few arguments": (module("MoveLDO p1;"), "line 6: MoveLDO is given 1 argument, needed are 6"),
}  # fmt: skip


@pytest.mark.parametrize("what", [*REFUSED])
def test_what_may_change_the_path_is_refused_with_its_line(tmp_path: Path, what: str) -> None:
    text, complaint = REFUSED[what]
    with pytest.raises(InputError, match=complaint):
        read(tmp_path, text)


FOR_EVER = {
    "an empty loop": module("WHILE n=0 DO\nENDWHILE", "VAR num n;"),
    "a flag": module(f"WHILE bRun DO\n{rows()}\nENDWHILE", "PERS bool bRun:=TRUE;"),
    "a long count": module("FOR i FROM 1 TO 1000000000 DO\nn:=n+1;\nENDFOR", "VAR num n;"),
    "a function that calls itself twice": module(
        "n:=f(40);", "VAR num n;", "FUNC num f(num a)\nIF a<1 RETURN 1;\nRETURN f(a-1)+f(a-1);\nENDFUNC"
    ),
    "a string that doubles": module(
        "WHILE TRUE DO\ns:=s+s;\nIF n=1 EXIT;\nENDWHILE", 'VAR num n;\nVAR string s:="ab";'
    ),
    "a large array": module("a{1,1}:=1;", "VAR num a{100000,100000};"),
    "a function without an end": module("n:=f(1);", "VAR num n;", "FUNC num f(num a)\nRETURN f(a);\nENDFUNC"),
    "brackets": module(f"n:={'(' * 20000}1{')' * 20000};", "VAR num n;"),
    "a long sum": module(f"n:=1{'+1' * 200000};", "VAR num n;"),
    "blocks": module("IF TRUE THEN\n" * 5000),
    "options": module(f"SetDO {(chr(92) + 'a:=') * 5000} !"),
}


@pytest.mark.parametrize("what", [*FOR_EVER])
def test_everything_ends(tmp_path: Path, what: str) -> None:
    begun = time.process_time()
    with pytest.raises(InputError, match=r"^p\.mod"):
        read(tmp_path, FOR_EVER[what])
    assert time.process_time() - begun < MOST_SECONDS


def mutated(generator: random.Random) -> str:
    """Return the rows in one of the equivalent forms, at random."""
    text = generator.choice([each for name, each in WRITTEN.items() if name not in {"an analog output", "a group"}])
    lines = text.splitlines()
    idle = [
        "! a comment",
        "",
        "ConfL\\Off;",
        "WaitTime 0.5;",
        'TPWrite "row";',
        "WaitDI diReady,1;",
        "SingArea\\Wrist;",
    ]
    begin = lines.index("PROC main()") + 1
    for _ in range(generator.randrange(4)):
        lines.insert(generator.randrange(begin, begin + 3), generator.choice(idle))
    text = generator.choice(["\n", "\r\n"]).join(f"{generator.choice(['', '  ', chr(9)])}{line}" for line in lines)
    text = text.replace("v20", generator.choice(["v20", "v100", "vmax"]))
    if generator.random() < 0.3:
        text = text.replace("doGlue", generator.choice(["DO10_1", "dispense", "Valve_1"]))
    words = {"MODULE": "module", "PROC ": "proc ", "ENDPROC": "endproc", "MoveL ": "MOVEL ", "SetDO": "setdo"}
    for word, other in words.items():
        text = text.replace(word, other) if generator.random() < 0.3 else text
    return generator.choice(["", "%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\n", "\ufeff"]) + text


@pytest.mark.fuzz
def test_five_hundred_equivalent_programs_have_equal_runs(tmp_path: Path) -> None:
    generator = random.Random(51)  # noqa: S311  # Nothing is kept secret.
    for _ in range(500):
        text = mutated(generator)
        assert runs(read(tmp_path, text)) == ROWS, text


def test_modules_are_found_whatever_their_suffix(tmp_path: Path) -> None:
    main, other = WRITTEN["MoveLSync"].split("PROC on()")
    (tmp_path / "MAIN.MOD").write_text(f"{main}ENDMODULE\n", encoding="utf-8")
    (tmp_path / "calls.sysx").write_text(f"MODULE Calls(SYSMODULE)\nPROC on(){other}", encoding="utf-8")
    assert runs(read_paths(tmp_path)) == ROWS
    (tmp_path / "MAIN.MOD").rename(tmp_path / "main.modx")
    assert runs(read_paths(tmp_path)) == ROWS


def test_a_joint_move_that_deposits_is_said_to_be_straight(tmp_path: Path) -> None:
    # Nobody knows the arm: the three returns between the rows are travel, one of them is not here.
    found = read(tmp_path, module(rows().replace("SetDO doGlue,0;", "", 1).replace("MoveL", "MoveJ")))
    assert "4 MoveJ that deposit lead straight" in found.reading.assumed


def test_the_data_of_a_backup_are_its_own(tmp_path: Path) -> None:
    # Every controller's module user declares what builtins list; a module may hold data alone, and stand last.
    body = "\n".join(
        [move("MoveJ", target(0, 0, 9)), move("MoveL", target(0, "reg1")), move("MoveL", target(10, "reg1"))]
    )
    (tmp_path / "PROGMOD").mkdir()
    (tmp_path / "SYSMOD").mkdir()
    (tmp_path / "PROGMOD" / "m.mod").write_text(module(body), encoding="utf-8")
    user = "MODULE user(SYSMODULE)\n! Predefined.\nVAR num reg1:=4;\nVAR clock clock1;\nENDMODULE\n"
    (tmp_path / "SYSMOD" / "user.sys").write_text(user, encoding="utf-8")
    assert runs(read_paths(tmp_path)) == [[[0.0, 0.0, 9.0], [0.0, 4.0, 0.0], [10.0, 4.0, 0.0]]]


@pytest.mark.parametrize("name", ["k10_moveldo.mod", "k10_folder", "k11_production_loop.mod"])
def test_the_programs_of_the_field_are_read(name: str) -> None:
    found = read_paths(shared(f"field/{name}"))
    assert [len(run) for run in runs(found)] == [2] * 10
    assert np.ptp(np.array(runs(found))[:, :, 0], axis=1).tolist() == [56.0] * 10


@pytest.mark.parametrize(
    ("name", "reason"), [("loop.mod", "holds no path"), ("redos.mod", "line 3: a value is missing")]
)
def test_the_programs_of_the_field_that_are_none_are_refused_at_once(name: str, reason: str) -> None:
    path, begun = shared(f"field/{name}"), time.process_time()
    with pytest.raises(InputError, match=reason):
        read_paths(path)
    assert time.process_time() - begun < 2.0
