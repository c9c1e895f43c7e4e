"""Names of a RAPID task: none is declared twice, whatever its case and kind, in whichever module."""

from __future__ import annotations

import pytest

from geoprint.errors import VerificationError
from geoprint.model import PoseStream, Program
from geoprint.postprocessor.rapid import program as rapid
from geoprint.postprocessor.rapid.language.names import Symbol, declared, declared_in, names_of
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.language.symbols import read_task
from geoprint.postprocessor.rapid.verify import judge_program
from tests.postprocessor.export_cases import CELL, PLACEMENT, events, orders, proven_program, stream, tips_of

# The first lines of the guard as geoprint wrote it for months: no controller loads them.
OLD_GUARD = """MODULE GeoGuard
  VAR num geoOn:=0;
  VAR bool geoStopped:=FALSE;
  PROC GeoSafe()
  ENDPROC
  PROC GeoStopped()
    IF doValve=1 geoStopped:=TRUE;
    GeoSafe;
  ENDPROC
ENDMODULE
"""


def written(poses: PoseStream | None = None) -> Program:
    poses = stream() if poses is None else poses
    return proven_program(
        orders(poses), cell=CELL, placement=PLACEMENT, surface_within=0.2, tips_at=tips_of(poses), part_name="rings",
        spacing=2.0,
    )[0]  # fmt: skip


def test_the_guard_that_declared_a_variable_and_a_routine_of_one_name_is_refused() -> None:
    with pytest.raises(VerificationError, match=r"GeoGuard\.mod, line 6: GeoStopped is declared twice") as caught:
        read_task([("GeoGuard.mod", OLD_GUARD)], signals=None)
    assert "also in GeoGuard.mod, line 3" in str(caught.value)


@pytest.mark.parametrize("words", ["GeoCutShort", "geoRefuse"])
def test_a_written_program_with_such_a_guard_is_refused_for_the_name(words: str) -> None:
    program = written()
    modules = tuple((name, text.replace("geoCutShort:=FALSE", f"{words}:=FALSE")) for name, text in program.modules)
    twice = tuple((name, text.replace("PROC GeoRefuse", "PROC GeoCutShort")) for name, text in modules)
    changed = twice if words == "GeoCutShort" else modules
    findings, _ = judge_program(
        changed, orders(), cell=CELL, placement=PLACEMENT, surface_within=0.2, events=events()
    )  # fmt: skip
    said = f"Geo{words[3:]} is declared twice: also in GeoGuard.mod, line 12"
    assert any(said in str(finding) for finding in findings)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("MODULE A\nVAR num x;\nPERS bool X:=TRUE;\nENDMODULE\n", 3),
        ("MODULE A\nCONST pos p{2}:=[[0,0,0],[0,0,1]];\nTRAP P\nENDTRAP\nENDMODULE\n", 3),
        ("MODULE A\nRECORD part\nnum x;\nENDRECORD\nFUNC num Part(num x)\nRETURN x;\nENDFUNC\nENDMODULE\n", 5),
        ("MODULE A\nPROC a()\nENDPROC\nENDMODULE\n", 2),
        ("MODULE B\nPROC go(num far,VAR bool FAR)\nENDPROC\nENDMODULE\n", 2),
        ("MODULE B\nPROC go(num far)\nVAR num Far;\nENDPROC\nENDMODULE\n", 3),
        ("MODULE B\nLOCAL PROC go()\nENDPROC\nFUNC bool Go()\nENDFUNC\nENDMODULE\n", 4),
    ],
)
def test_every_kind_of_declaration_counts_without_regard_to_case(text: str, line: int) -> None:
    with pytest.raises(VerificationError, match=f"A.mod, line {line}: .* is declared twice"):
        read_task([("A.mod", text)], signals=None)


def test_what_a_routine_declares_for_itself_may_be_named_as_anything_elsewhere() -> None:
    routines = "PROC go(num x)\nVAR num y;\nENDPROC\nPROC stay(num y)\nENDPROC\n"
    read_task([("A.mod", f"MODULE A\nVAR num x;\n{routines}! VAR num x;\nENDMODULE\n")], signals=None)


def test_modules_that_are_loaded_later_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rapid, "MODULE_LINES", 55)
    modules = list(written(stream(runs=5, points=9)).modules)
    assert "GeoPath2.mod" in dict(modules)
    read_task(modules, signals=None)
    changed = [(name, text.replace("PROC GeoRun3(", "PROC GEOSAFE(")) for name, text in modules]
    with pytest.raises(VerificationError, match=r"GeoPath2\.mod, line 2: GEOSAFE is declared twice: also in GeoGuard"):
        read_task(changed, signals=None)


ONE = """MODULE A
  RECORD part
    num x;
  ENDRECORD
  ALIAS num length;
  VAR num shared;
  LOCAL VAR num own;
  PERS num doLamp:=0;
  LOCAL VAR num Sin;
  PROC go(num far)
    VAR num near;
  ENDPROC
  LOCAL PROC own2()
  ENDPROC
ENDMODULE
"""
TWO = "MODULE B\n  VAR num own;\n  VAR bool shared;\n  PROC go()\n  ENDPROC\nENDMODULE\n"
MODULES = [parse_module("A.mod", ONE), parse_module("B.mod", TWO)]
SIGNALS = {"doLamp": "SignalDO", "doValve": "SignalDO", "aoFlow": "SignalAO"}


@pytest.mark.parametrize(
    ("file", "name", "wanted"),
    [
        ("A.mod", "PART", ("part", "type", "A.mod", 2, "")),
        ("A.mod", "Length", ("length", "type", "A.mod", 5, "")),
        ("A.mod", "own", ("own", "datum", "A.mod", 7, "")),
        ("B.mod", "own", ("own", "datum", "B.mod", 2, "")),
        ("A.mod", "own2", ("own2", "routine", "A.mod", 13, "")),
        ("B.mod", "own2", None),
        # Of several declarations the first counts, and what a task declares before a signal of the cell.
        ("B.mod", "shared", ("shared", "datum", "A.mod", 6, "")),
        ("B.mod", "go", ("go", "routine", "A.mod", 10, "")),
        ("B.mod", "doLamp", ("doLamp", "datum", "A.mod", 8, "")),
        ("B.mod", "DOVALVE", ("DOVALVE", "signal", "", 0, "signaldo")),
        ("A.mod", "aoFlow", ("aoFlow", "signal", "", 0, "signalao")),
        ("A.mod", "doOther", None),
        # What the controller brings has no place; what a module declares for itself comes before it.
        ("B.mod", "sin", ("Sin", "routine", "", 0, "")),
        ("A.mod", "sin", ("Sin", "datum", "A.mod", 9, "")),
        ("A.mod", "RobTarget", ("robtarget", "type", "", 0, "")),
        ("A.mod", "SETBRUSH", ("setbrush", "known", "", 0, "")),
        ("A.mod", "near", None),
    ],
)
def test_a_name_means_what_is_declared_nearest_to_where_it_stands(
    file: str, name: str, wanted: tuple[str, str, str, int, str] | None
) -> None:
    found = names_of(MODULES, signals=SIGNALS).find(name, file=file, inner={})
    said = None if found is None else (found.name, found.role, found.file, found.line, found.detail)
    if said is not None and wanted is not None and not wanted[2] and wanted[1] != "signal":
        said, wanted = (said[0].lower(), *said[1:]), (wanted[0].lower(), *wanted[1:])
    assert said == wanted
    if wanted is not None and wanted[1] == "signal":
        assert names_of(MODULES, signals=None).find(name, file=file, inner={}) is None


def test_what_a_routine_declares_comes_before_everything_else() -> None:
    names = names_of(MODULES, signals=SIGNALS)
    inner = {each.name.lower(): each for each in declared_in(MODULES[0].routines[0], "A.mod")}
    assert [(each.name, each.role, each.file, each.line) for each in inner.values()] == [
        ("far", "parameter", "A.mod", 10), ("near", "datum", "A.mod", 11),
    ]  # fmt: skip
    own = Symbol("shared", "loop", "A.mod", 3, None)
    assert names.find("Shared", file="A.mod", inner={"shared": own}) is own
    assert names.find("NEAR", file="B.mod", inner=inner) is inner["near"]


def test_declarations_of_a_module_come_by_their_lines() -> None:
    assert [(each.name, each.line, local) for each, local in declared(MODULES[0])] == [
        ("part", 2, False), ("length", 5, False), ("shared", 6, False), ("own", 7, True), ("doLamp", 8, False),
        ("Sin", 9, True), ("go", 10, False), ("own2", 13, True),
    ]  # fmt: skip
