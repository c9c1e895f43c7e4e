"""What stands between the moves of a path: each move is judged in the state that it is made in, printing and dry."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest

from geoprint.postprocessor.rapid.verify import judge_program
from tests.postprocessor.export_cases import CELL, PLACEMENT, events, orders, proven_program, stream, tips_of

PATH = "GeoPrint.mod"
# Another displacement than the lift of a dry run: none, higher, and the part's own frame once more.
DISPLACED = ("PDispOff;", "PDispSet [[0,0,5],[1,0,0,0]];", "PDispSet geoFrame;")
# What no program of geoprint says between two moves, and what is found of it.
STATES = {
    "VelSet 50,250;": "VelSet has set override to 50.0, the guard sets",
    "VelSet 99,250;": "VelSet has set override to 99.0",
    "VelSet 100,5;": "VelSet has set",
    "VelSet 100,5000;": "VelSet has set",
    "AccSet 50,50;": "AccSet has set acceleration to (50.0, 50.0, 100.0)",
    "AccSet 100,100\\FinePointRamp:=50;": "AccSet has set acceleration to (100.0, 100.0, 50.0)",
    "WorldAccLim\\On:=1;": "WorldAccLim has set world acceleration to 1.0",
    "PathAccLim TRUE\\AccMax:=2,FALSE;": "PathAccLim has set path acceleration to (2.0, inf)",
    "PathResol 400;": "PathResol has set resolution to 400.0",
    "ConfL\\Off;": "ConfL has set lines to False",
    "ConfJ\\Off;": "ConfJ has set joints to False",
    "SingArea\\Wrist;": "SingArea has set singularities to wrist",
    "SingArea\\LockAxis4;": "SingArea has set singularities to lockaxis4",
    "MotionSup\\Off;": "MotionSup has set supervision to (False, 100.0)",
    "MotionSup\\On\\TuneValue:=300;": "MotionSup has set supervision to (True, 300.0)",
    "SoftAct 1,50;": "SoftAct has set soft to ((1, 50.0),)",
    "CirPathMode\\ObjectFrame;": "CirPathMode has set circles to objectframe",
}
# What nobody can execute who does not know what it does.
UNKNOWN = ("TuneReset;", "SpeedRefresh 50;", "GripLoad load0;", "MotionSup\\On\\NoBackoff;", "TestSignReset;")
# What does more than a path does, whether it changes anything here or not.
MORE = (
    "WaitTime 0.5;", "SetDO doUV,0;", "SetDO doValve,0;", "SetDO doValve,1;", "GeoSafe;", "geoOn:=0;", "geoOn:=1;",
    "geoPct:=50;", 'TPWrite "here";', "IF geoOn=1 SetDO doUV,0;", "ConfL\\On;",
)  # fmt: skip


@cache
def written() -> dict[str, str]:
    program, _ = proven_program(
        orders(), cell=CELL, placement=PLACEMENT, surface_within=None, tips_at=tips_of(stream()), part_name="rings",
        spacing=2.0,
    )  # fmt: skip
    return dict(program.modules)


def judged(edit: Callable[[str], str], file: str = PATH) -> list[str]:
    """Return what is found in the program with one of its files edited."""
    texts = dict(written())
    edited = edit(texts[file])
    assert edited != texts[file]
    found, _ = judge_program(
        tuple((texts | {file: edited}).items()), orders(), cell=CELL, placement=PLACEMENT, surface_within=None,
        events=events(),
    )  # fmt: skip
    return [str(each) for each in found]


def between(line: str, place: str) -> Callable[[str], str]:
    """Return what inserts a line behind the entry of a run, or between two moves of the first."""

    def edit(text: str) -> str:
        lines = text.split("\n")
        entry = lines.index("    GeoEnter 2;" if place == "entry" else "    GeoEnter 1;")
        row = entry if place == "entry" else next(k for k in range(entry + 5, len(lines)) if "MoveL" in lines[k])
        return "\n".join([*lines[: row + 1], f"    {line}", *lines[row + 1 :]])

    return edit


def test_nothing_is_found_in_the_program_as_it_was_written() -> None:
    assert judged(lambda text: text.replace("rings", "kings")) == []


@pytest.mark.parametrize("place", ["entry", "middle"])
@pytest.mark.parametrize(("line", "words"), STATES.items())
def test_each_move_is_judged_in_the_modal_state_that_it_is_made_in(line: str, words: str, place: str) -> None:
    found = judged(between(line, place))
    assert any(words in each for each in found), found
    assert any(f"{line.split()[0].split(chr(92))[0].rstrip(';')} belongs neither" in each for each in found)


@pytest.mark.parametrize("line", DISPLACED)
@pytest.mark.parametrize("place", ["entry", "middle"])
def test_another_displacement_is_found_where_only_the_dry_run_shows_it_as_well(line: str, place: str) -> None:
    found = judged(between(line, place))
    dry = line == "PDispOff;"
    words = "of the dry run is given in a frame" if dry else "is given in a frame at"
    assert any(words in each for each in found), found


@pytest.mark.parametrize("line", UNKNOWN)
def test_an_instruction_whose_effect_nobody_knows_is_an_error_and_no_pause(line: str) -> None:
    found = judged(between(line, "middle"))
    assert any("not an instruction that this machine knows" in each or "the option" in each for each in found), found


@pytest.mark.parametrize("line", MORE)
def test_a_path_holds_nothing_but_moves_and_triggers(line: str) -> None:
    assert any("belongs neither to a path nor" in each for each in judged(between(line, "middle"))), line


@pytest.mark.parametrize(
    ("place", "words"), [("entry", "only follow a move to a fine point"), ("middle", "the arm waits 0.5 s before")]
)
def test_a_wait_that_no_signal_needs_is_found(place: str, words: str) -> None:
    def edit(text: str) -> str:
        if place == "entry":
            return between("WaitTime\\InPos,0.5;", place)(text)
        return text.replace(
            ",fine,tGeoNozzle\\WObj:=wGeoPart;", ",fine,tGeoNozzle\\WObj:=wGeoPart;\n    WaitTime\\InPos,0.5;", 1
        )

    found = judged(edit)
    assert any(words in each for each in found), found


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("MoveL", "movel"), ("MoveL", "MOVEL"), ("TriggIO", "triggio"), ("TriggL", "trigGL"), ("GeoRun1;", "GEORUN1;"),
        ("PROC GeoRun2", "proc georun2"), ("GeoEnter 2", "geoenter 2"), ("GeoSafe", "GEOSAFE"), ("RAISE", "Raise"),
        ("ERROR", "error"), ("\\WObj", "\\wobj"), ("tGeoValveOn", "TGEOVALVEON"), ("\\T2:=", "\\t2:="),
        ("\\DOp", "\\dop"), ("fine", "FINE"), ("ENDMODULE", "EndModule"),
    ],
)  # fmt: skip
def test_a_word_in_another_case_is_no_fault(old: str, new: str) -> None:
    assert judged(lambda text: text.replace(old, new)) == []


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (",vGeo2,", ",vGeo2\\T:=30,", "another time or speed"), (",vGeo2,", ",vGeo2\\V:=1,", "the speed"),
        ("geoOn;", "1;", "is switched to 1 here in a dry run"), ("geoOn;", "0;", "otherwise"),
        ("GeoRun1;\n    GeoRun2;", "GeoRun2;\n    GeoRun1;", "is called where"),
        ("    GeoEnd 2;\n", "", "the program ends without"),
    ],
)  # fmt: skip
def test_a_move_or_switching_with_another_meaning_is_found(old: str, new: str, words: str) -> None:
    found = judged(lambda text: text.replace(old, new, 1))
    assert any(words in each for each in found), found
