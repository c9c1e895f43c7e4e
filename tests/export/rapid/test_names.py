"""Names of a RAPID task: none is declared twice, whatever its case and kind, in whichever module."""

from __future__ import annotations

import pytest

from geoprint.errors import VerificationError
from geoprint.export.rapid import program as rapid
from geoprint.export.rapid.names import check_names
from geoprint.export.rapid.program import rapid_program
from geoprint.export.rapid.verify import verify_program
from geoprint.model import PoseStream, Program
from tests.export.export_cases import CELL, PLACEMENT, events, orders, stream, tips_of

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
    return rapid_program(
        orders(poses), cell=CELL, placement=PLACEMENT, surface_within=0.2, tips_at=tips_of(poses), part_name="rings",
        spacing=2.0,
    )  # fmt: skip


def test_the_guard_that_declared_a_variable_and_a_routine_of_one_name_is_refused() -> None:
    with pytest.raises(VerificationError, match=r"GeoGuard\.mod, line 6: GeoStopped is declared twice") as caught:
        check_names([("GeoGuard.mod", OLD_GUARD)])
    assert "also in GeoGuard.mod, line 3" in str(caught.value)


@pytest.mark.parametrize("words", ["GeoCutShort", "geoRefuse"])
def test_a_written_program_with_such_a_guard_is_refused_for_the_name_before_anything_else(words: str) -> None:
    program = written()
    modules = tuple((name, text.replace("geoCutShort:=FALSE", f"{words}:=FALSE")) for name, text in program.modules)
    twice = tuple((name, text.replace("PROC GeoRefuse", "PROC GeoCutShort")) for name, text in modules)
    changed = Program(twice if words == "GeoCutShort" else modules, targets=program.targets, dry_run=False)
    with pytest.raises(VerificationError, match=f"Geo{words[3:]} is declared twice: also in GeoGuard.mod, line 12"):
        verify_program(
            changed, orders(), cell=CELL, placement=PLACEMENT, surface_within=0.2, events=events()
        )  # fmt: skip


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
        check_names([("A.mod", text)])


def test_what_a_routine_declares_for_itself_may_be_named_as_anything_elsewhere() -> None:
    routines = "PROC go(num x)\nVAR num y;\nENDPROC\nPROC stay(num y)\nENDPROC\n"
    check_names([("A.mod", f"MODULE A\nVAR num x;\n{routines}! VAR num x;\nENDMODULE\n")])


def test_modules_that_are_loaded_later_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rapid, "MODULE_LINES", 55)
    modules = list(written(stream(runs=5, points=9)).modules)
    assert "GeoPath2.mod" in dict(modules)
    check_names(modules)
    changed = [(name, text.replace("PROC GeoRun3(", "PROC GEOSAFE(")) for name, text in modules]
    with pytest.raises(VerificationError, match=r"GeoPath2\.mod, line 2: GEOSAFE is declared twice: also in GeoGuard"):
        check_names(changed)
