"""The RAPID reader against damaged programs: each damage is named by module, line and reason."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from functools import cache

import pytest
from hypothesis import assume, given, settings, strategies as st

from geoprint.errors import VerificationError
from geoprint.model import Placement, Program
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.verify import verify_program
from tests.postprocessor.export_cases import (
    CELL,
    DEMONSTRATION,
    PLACEMENT,
    events,
    orders,
    proven_program,
    stream,
    tips_of,
)


@pytest.fixture(scope="module", autouse=True)
def parsed_once() -> Generator[None]:
    """Parse a text once, however many programs have it: a damage is in one module, the others stay as they are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("geoprint.postprocessor.rapid.verify.parse_module", cache(parse_module))
        yield


def within(placement: Placement) -> float | None:
    return 0.21 if placement.calibrated else None


def written(placement: Placement = PLACEMENT) -> Program:
    return proven_program(
        orders(placement=placement), cell=CELL, placement=placement, surface_within=within(placement),
        tips_at=tips_of(stream()), part_name="rings", spacing=2.0,
    )[0]  # fmt: skip


PROGRAM = written()


def verify(program: Program, placement: Placement = PLACEMENT) -> None:
    verify_program(
        program, orders(placement=placement), cell=CELL, placement=placement, events=events(),
        surface_within=within(placement),
    )  # fmt: skip


def damaged(module: str, change: Callable[[str], str], program: Program = PROGRAM) -> Program:
    texts = tuple((name, change(text) if name == module else text) for name, text in program.modules)
    assert texts != program.modules, "the damage must change something"
    return replace(program, modules=texts)


@dataclass(frozen=True)
class Damage:
    """Replaces the n-th occurrence of a pattern; `at` finds the line of the damaged text that must be named."""

    module: str
    pattern: str
    by: str
    reason: str
    at: str
    nth: int = 0

    def __call__(self, text: str) -> str:
        match = list(re.finditer(self.pattern, text))[self.nth]
        return text[: match.start()] + match.expand(self.by) + text[match.end() :]


P, C, G = "GeoPrint.mod", "GeoCell.mod", "GeoGuard.mod"
SECOND = r"\[\[5\.0000,8"
HANDLER = r"  ERROR\n    GeoSafe;\n    RAISE;\n"
DAMAGES = {
    "missing semicolon": Damage(P, r"wGeoPart;", "wGeoPart", "; is missing", r"wGeoPart$"),
    "swapped groups": Damage(
        P, r"\[(\[5[^]]*\]),(\[[^]]*\])", r"[\2,\1", "a pos has 3 components, found 4",
        r"TriggL \[\[[^]]*\],\[5\.0000,8"
    ),
    "swapped coordinates": Damage(P, r"\[\[5\.0000,8\.6603", "[[8.6603,5.0000", "position", r"\[\[8\.6603"),
    "NaN": Damage(P, r"\[\[5\.0000,8\.6603", "[[NaN,8.6603", "NaN is not declared", "NaN"),
    "infinite number": Damage(P, r"\[\[5\.0000,8\.6603", "[[1e999,8.6603", "too large for a num", "1e999"),
    "text for a number": Damage(P, r"\[\[5\.0000,8\.6603", "[[true,8.6603", "TRUE is not a num", "true"),
    "four coordinates": Damage(P, r"\[\[5\.0000,", "[[5.0000,1.0,", "a pos has 3 components, found 4", "5.0000,1.0,"),
    "33-character name": Damage(P, r"GeoRun2;", f"{'a' * 33};", "is not declared", "aaaa"),
    "33-character procedure": Damage(P, r"PROC GeoRun2", f"PROC {'a' * 33}", "at most 32 characters", "aaaa"),
    "33-character signal": Damage(P, r"doValve", "a" * 33, "is not declared", "aaaa"),
    "81-character string": Damage(C, "=TRUE", f'="{"x" * 81}"', "is not a bool", "xxxx"),
    "other string": Damage(C, '""', '"T_ROB2"', "wobjdata", "T_ROB2"),
    "wrong quaternion": Damage(P, r"0\.08645827,-0", "0.08745827,-0", "quaternion", "0.08745827"),
    "quaternion of another attitude": Damage(P, r"\[0\.08645827,-0\.99500417", "[0.08645827,0.99500417",
                                             "quaternion", r"\[0\.08645827,0\.99500417"),
    "moved by half a micrometre": Damage(P, r"8\.6603", "8.6608", "position", "8.6608"),
    "valve never opened": Damage(
        P, r"    TriggIO tGeoValveOn.*\n", "", "is used, but this routine has not", r"TriggL.*tGeoValveOn"),
    "valve not pulled": Damage(P,
        r"tGeoValveOn\\T2:=", "", "1 output to switch in the move here, the plan has 2", r"TriggL.*tGeoLampOn"),
    "valve and lamp not pulled": Damage(
        P, r"TriggL (.*),tGeoValveOn\\T2:=tGeoLampOn", r"MoveL \1",
        "0 outputs to switch in the move here, the plan has 2", SECOND),
    "valve opened one move late": Damage(
        P, r"((?:    TriggIO.*\n){2})(    )TriggL (.*),tGeoValveOn\\T2:=tGeoLampOn(.*\n)    MoveL (.*),vGeo1,",
        r"\2MoveL \3\4\1    TriggL \5,vGeo1,tGeoValveOn\\T2:=tGeoLampOn,", "the plan has 2", SECOND),
    "valve opened a millimetre late": Damage(
        P, r"tGeoValveOn,0\.0000", "tGeoValveOn,1.0000", "the plan has 0.0000 mm", "tGeoValveOn,1"),
    "valve opened at the end": Damage(P, r"tGeoValveOn,0\.0000\\Start", "tGeoValveOn,0.0000", "otherwise", "ValveOn,0"),
    "valve never shut": Damage(P, r"ValveOff,0\.0000\\DOp:=doValve,0", r"ValveOff,0.0000\\DOp:=doValve,geoOn",
                               "otherwise", r"ValveOff,0\.0000"),
    "valve opened in a dry run": Damage(P, r"doValve,geoOn", "doValve,1", "switched to 1 here in a dry run",
        "doValve,1"),
    "lamp for valve": Damage(P, r"DOp:=doValve,geoOn", "DOp:=doUV,geoOn", "otherwise", "tGeoValveOn"),
    "other output": Damage(P, r"DOp:=doUV,geoOn", "DOp:=doGripper,geoOn", "doGripper is not declared", "doGripper"),
    "a flow that nobody asked for": Damage(
        P, r"(    TriggIO tGeoValveOn)", r"    TriggSpeed tGeoValveOff,0\\Start,0,aoFlow,1*geoOn;\n\1",
        "aoFlow is not declared", "TriggSpeed"),
    "triggers out of order": Damage(P, r"\\T2:=tGeoLampOn", r"\\T3:=tGeoLampOn", "one after the other", "T3"),
    "trigger without a trigger move": Damage(P, r"TriggL", "MoveL", r"MoveL takes no \T2", SECOND),
    "trigger of another type": Damage(C, "VAR triggdata tGeoLampOn", "CONST num tGeoLampOn:=1",
        "needs a triggdata, found a num",
                                      "no line"),
    "SetDO on the path": Damage(P, r"    TriggIO tGeoValveOn", "    SetDO doValve,1;\n    TriggIO tGeoValveOn",
                                "switched to 1 here in a dry run", "SetDO"),
    "dropped target": Damage(P, r"    MoveL \[\[-5\.0000,8.*\n", "", "position", r"\[\[-10\.0000,0"),
    "duplicated target": Damage(P, r"(    MoveL \[\[-5\.0000,8.*\n)", r"\1\1", "position", "the second"),
    "dropped last target": Damage(
        P, rf"    MoveL .*\n(?={HANDLER}  ENDPROC\nENDMODULE)", "",
        "17 targets, the plan has 18", r"TriggL.*\n  ERROR\n.*\n.*\n.*\nE"
    ),
    "swapped targets": Damage(
        P, r"(    MoveL \[\[-5\.0000,8.*\n)(    MoveL \[\[-10\.0000.*\n)", r"\2\1", "position", r"\[\[-10\.0000,0"),
    "wrong zone": Damage(P, r"vGeo2,zGeo2", "vGeo2,zGeo1", "zone", r"\[\[-10\.0000,0"),
    "rounded where it must stop": Damage(P, r"vGeo2,fine", "vGeo2,zGeo1", "zone", r"vGeo2,zGeo1"),
    "unknown zone": Damage(P, r"vGeo2,zGeo2", "vGeo2,zGeo9", "zGeo9 is not declared", "zGeo9"),
    "larger zone": Damage(C, r"FALSE,0\.3,0\.3", "FALSE,0.4,0.3", "zonedata", "FALSE,0.4"),
    "wrong speed": Damage(P, r"vGeo2,zGeo2", "vGeo3,zGeo2", "speed", r"vGeo3,zGeo2"),
    "faster": Damage(C, r"\[20,500", "[21,500", "speed", "no line"),
    "slow turns": Damage(C, r"\[20,500", "[20,5", "speeddata", r"\[20,5,"),
    "wrong configuration": Damage(P, r"\[-1,0,-2,4\]", "[-1,0,-2,0]", "configuration", r"\[-1,0,-2,0\]", nth=3),
    "fractional configuration": Damage(P, r"\[-1,0,-2,4\]", "[-1,0.5,-2,4]", "configuration", r"-1,0\.5", nth=3),
    "wrong configuration of the dry run": Damage(
        P, r"(GeoAloft\(.*),\[-1,0,-1,4\]\)", r"\1,[-1,0,-2,4])", "configuration of the dry run", "GeoAloft", nth=0),
    "no configuration of the dry run": Damage(
        P, r"GeoAloft\((.*),\[-1,0,-1,4\]\)", r"\1", "configuration of the dry run", "no line", nth=0),
    "configuration of three numbers": Damage(
        P, r"(GeoAloft\(.*),\[-1,0,-1,4\]\)", r"\1,[-1,0,4])", "a confdata has 4 components, found 3",
        "GeoAloft", nth=0),
    "external axis": Damage(P, r"\[9E9,", "[0,", "external axes", r"\[0,9E9", nth=4),
    "wrong tool": Damage(P, "tGeoNozzle", "tool0", "tool0", "tool0", nth=3),
    "wrong work object": Damage(P, "wGeoPart", "wobj0", "wobj0", "wobj0", nth=3),
    "no work object": Damage(P, r"\\WObj:=wGeoPart", "", "in wobj0", r"MoveL.*tGeoNozzle;", nth=3),
    "tool shifted": Damage(C, r"84\.8528", "84.8538", "tool frame", "84.8538"),
    "tool turned": Damage(C, r"0\.38268343", "-0.38268343", "tool frame", "-0.38268343"),
    "tool not held": Damage(C, r"tGeoNozzle:=\[TRUE", "tGeoNozzle:=[FALSE", "must be a tool held", "tGeoNozzle"),
    "tool heavier": Damage(C, r"\[0\.6000", "[0.7000", "load", "0.7000"),
    "part shifted": Damage(C, r"312\.3457", "312.3467", "uframe", "312.3467"),
    "part shifted on its fixture": Damage(C, r"\[1\.2500", "[1.2600", "oframe", "1.2600"),
    "part turned": Damage(C, r"0\.25738118", "0.25738218", "uframe", "0.25738218"),
    "constant tool": Damage(C, "PERS tooldata", "CONST tooldata", "tGeoNozzle never changes", "no line"),
    "home elsewhere": Damage(C, r"45\.00000", "45.00100", "jGeoHome", "45.00100"),
    "first target elsewhere": Damage(C, r"jGeoStart:=\[\[-45\.0", "jGeoStart:=[[-45.1", "jGeoStart", "jGeoStart"),
    "dry run elsewhere": Damage(C, r"jGeoAloft:=\[\[-45\.0", "jGeoAloft:=[[-45.1", "jGeoAloft", "jGeoAloft"),
    "dry run not lifted": Damage(C, r"19\.8966", "0.0000", "geoLift", "geoLift"),
    "surface known better": Damage(P, r"known within 0\.21", "known within 0.01", "must say", "known within"),
    "surface not uncertain": Damage(C, r"  ! Surface.*\n", "", "must say 'Surface known", "! Part"),
    "touches closer": Damage(C, r"points: 0\.11", "points: 0.01", "must say 'largest", "residual"),
    "frame of another plan": Damage(C, r"313\.0504", "313.1504", "geoFrame", "geoFrame"),
    "looser about the frame": Damage(C, r"nGeoShift:=0\.03", "nGeoShift:=0.04", "let the part lie off", "nGeoShift"),
    "looser about the frame's turn": Damage(C, r"nGeoTurn:=0", "nGeoTurn:=1", "let the part lie off", "no line"),
    "frame asked for elsewhere": Damage(C, r"geoMiddle:=\[0", "geoMiddle:=[99", "let the part lie off", "no line"),
    "frame never right": Damage(C, r"nGeoTurn:=0", "nGeoTurn:=-0", "let the part lie off", "no line"),
    "faster home": Damage(C, r"nGeoBack:=1\.000", "nGeoBack:=0.500", "nGeoBack", "nGeoBack"),
    "faster to unknown places": Damage(C, r"vGeoSlow:=\[20", "vGeoSlow:=[200", "vGeoSlow", "vGeoSlow"),
    "begins without questions": Damage(P, "    GeoBegin 2;\n", "", "called where geobegin 2 must be", "GeoEnter 1"),
    "more runs announced": Damage(P, "GeoBegin 2;", "GeoBegin 3;", "geobegin 3 is called where geobegin 2 must be",
        "GeoBegin 3"),
    "ends without end": Damage(P, "    GeoEnd 2;\n", "", "the program ends without geoend 2",
        r"ENDPROC\n  PROC GeoRun1"),
    "goes on after its end": Damage(P, "    GeoEnd 2;\n", "    GeoEnd 2;\n    GeoRun2;\n", "goes on after",
                                    "GeoEnter 2"),
    "run not entered": Damage(P, "    GeoEnter 2;\n", "", "geoend 2 is called where geoenter 2 must be", "GeoEnd 2"),
    "run entered as another": Damage(P, "GeoEnter 2;", "GeoEnter 3;",
        "geoenter 3 is called where geoenter 2 must be", "GeoEnter 3"),
    "guard that asks less": Damage(G, "far:=TRUE", "far:=FALSE", "the guard must say", "rax_1.*far:=FALSE"),
    "guard that never shuts": Damage(G, "    SetDO doUV,0;\n", "", "the guard must say 'SetDO doUV,0;'",
                                   "geoCutShort:=TRUE"),
    "guard with a line more": Damage(G, "ENDMODULE\n", "ENDMODULE\n! more\n", "the guard must say", "! more"),
    "guard cut off": Damage(G, r"(?s)  PROC GeoEnd.*", "", "the guard", "no line"),
    "no error handler": Damage(P, rf"{HANDLER}(?=  ENDPROC\n  PROC GeoRun2)", "", "no error handler",
                               r"ENDPROC\n  PROC GeoRun2"),
    "error handler that goes on": Damage(P, "RAISE;", "TRYNEXT;", "must be GeoSafe; RAISE", "TRYNEXT"),
    "run left out": Damage(P, "    GeoRun2;\n", "", "geoend 2 is called where geoenter 2 must be", "GeoEnd 2"),
    "run that does not exist": Damage(P, "    GeoRun2;\n", "    GeoRun3;\n", "GeoRun3 is not declared", "GeoRun3"),
    "run that calls itself": Damage(P, r"(PROC GeoRun2\(\)\n)", r"\1    GeoRun2;\n", "calls are nested deeper than 200",
        "no line"),
    "run called late": Damage(P, "    GeoRun2;\n", '    %"GeoRun2"%;\n', "called by %", '%"'),
    "deposits at once": Damage(C, "geoDryRun:=TRUE", "geoDryRun:=FALSE", "must be declared TRUE", "geoDryRun:="),
    "at full speed at once": Damage(C, "geoSpeedPct:=25", "geoSpeedPct:=100", "must be declared 25", "geoSpeedPct"),
    "starts later": Damage(C, "geoFirstRun:=1", "geoFirstRun:=2", "must be declared 1", "geoFirstRun"),
    "data nobody uses": Damage(C, r"(  VAR triggdata tGeoValveOn;\n)", r"\1  VAR triggdata tGeoOther;\n",
                               "no use for it", "tGeoOther"),
    "a module loaded during another": Damage(
        P, "    GeoRun2;\n", '    StartLoad\\\\Dynamic,diskhome\\\\File:="GeoPrint.mod",geoLoading;\n    GeoRun2;\n',
        "geoLoading is not declared", "StartLoad"),
    "unloaded too early": Damage(P, "    GeoRun2;\n", '    UnLoad diskhome\\\\File:="GeoPrint.mod";\n    GeoRun2;\n',
                                 "ERR_UNLOAD: GeoPrint.mod is not loaded by the program", "UnLoad"),
    "unknown instruction": Damage(P, "    GeoRun2;", "    TuneReset;", "TuneReset", "TuneReset"),
    "second statement in a line": Damage(
        P, "    GeoRun2;", "    GeoRun2; GeoRun1;", "more than one statement", "GeoRun2; GeoRun1"
    ),
    "empty line": Damage(P, "    GeoRun2;", "\n    GeoRun2;", "empty line", r"^$"),
    "not ASCII": Damage(P, "rings", "r\u00efngs", "printable ASCII", "Part:"),
    "tabulator": Damage(P, "    GeoRun2;", "\tGeoRun2;", "printable ASCII", "\t"),
    "carriage return": Damage(P, "GeoRun2;", "GeoRun2;\r", "printable ASCII", "\r"),
    "line too long": Damage(P, "! Part", f"! {'x' * 250} Part", "at most 250 characters", "xxxx"),
    "declared twice": Damage(C, r"(  CONST speeddata vGeo1.*\n)", r"\1\1", "declared twice", "the second"),
    "declared twice in other letters": Damage(
        C, r"(  CONST speeddata vGeo1)(.*\n)", r"\1\2  CONST speeddata VGEO1\2", "VGEO1 is declared twice: also in",
        "VGEO1"),
    "datum named as a routine of the guard": Damage(
        C, r"(  VAR triggdata tGeoValveOn;\n)", r"\1  VAR bool geosafe:=FALSE;\n", "declared twice: also in GeoCell",
        "no line"),
    "routine named as a datum of the cell": Damage(
        P, "PROC GeoRun2", "PROC tGeoNozzle", "declared twice: also in GeoCell.mod", "PROC tGeoNozzle"),
    "procedure twice": Damage(P, "PROC GeoRun2", "PROC GeoRun1", "declared twice", "the second"),
    "data after procedures": Damage(
        P, r"(  PROC GeoRun2)", r"  CONST num n:=1;\n\1", "needs data first", "CONST num"
    ),
    "end of a procedure missing": Damage(
        P, r"  ENDPROC\n(?=  PROC GeoRun1)", "", "PROC cannot begin a statement", "PROC GeoRun1"
    ),
    "end of the last procedure missing": Damage(P, r"  ENDPROC\n(?=ENDMODULE)", "", "ENDPROC is missing", "ENDMODULE"),
    "end of the module missing": Damage(P, r"ENDMODULE\n", "", "ENDMODULE is missing", "no line"),
    "other module name": Damage(P, "MODULE GeoPrint", "MODULE GeoPrimt", "name of its file", "MODULE GeoPrimt"),
    "module not listed": Damage("GeoPrint.pgf", r"\t<Module>GeoCell.mod</Module>\n", "", "it must list", "xml"),
    "list broken": Damage("GeoPrint.pgf", "<Program>\n", "", "not a list of modules", "xml"),
    "list of something else": Damage("GeoPrint.pgf", "GeoCell.mod<", "../a.mod<", "does not name a module", "a.mod"),
}  # fmt: skip


def line_of(pattern: str, text: str, original: str) -> int | None:
    """The line a message must name: that of the pattern, or of the second of two equal lines, or none in particular."""
    if pattern == "no line":
        return None
    if pattern == "the second":
        lines = text.split("\n")
        return next(k for k, pair in enumerate(zip(lines, original.split("\n"), strict=False), 1) if pair[0] != pair[1])
    match = next(re.finditer(pattern, text, re.MULTILINE))
    return text.count("\n", 0, match.start()) + 1


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_program_is_refused_with_module_line_and_reason(name: str) -> None:
    damage = DAMAGES[name]
    program = damaged(damage.module, damage)
    with pytest.raises(VerificationError) as caught:
        verify(program)
    message, details = str(caught.value), caught.value.details
    assert damage.reason in message
    assert message.startswith(f"{details['module']}, line {details['line']}: ")
    line = line_of(damage.at, dict(program.modules)[damage.module], dict(PROGRAM.modules)[damage.module])
    assert line is None or (details["module"], details["line"]) == (damage.module, line)


def test_the_undamaged_programs_are_accepted() -> None:
    verify(PROGRAM)
    verify(written(DEMONSTRATION), DEMONSTRATION)


@pytest.mark.parametrize(
    ("frame", "shift", "looser", "tighter"),
    # A tenth of the stand-off of 0.3 mm; what takes an axis to the border of its quadrants; what a num can tell.
    [(1.0, "0.03", "0.031", "0.01"), (0.0123456, "0.01234", "0.03", "0.005"), (1e-9, "0.001", "0.01", "0.0001")],
)
def test_the_frame_may_lie_off_by_no_more_than_takes_an_axis_to_a_border(
    frame: float, shift: str, looser: str, tighter: str
) -> None:
    near = replace(orders(), frame=frame)
    program, _ = proven_program(
        near, cell=CELL, placement=PLACEMENT, surface_within=0.21, tips_at=tips_of(stream()), part_name="rings",
        spacing=2.0,
    )  # fmt: skip

    def check(program: Program) -> None:
        verify_program(program, near, cell=CELL, placement=PLACEMENT, events=events(), surface_within=0.21)

    assert f"CONST num nGeoShift:={shift};" in dict(program.modules)[C]
    check(program)
    for other in (looser, tighter):
        said = f"nGeoShift:={shift};"
        with pytest.raises(VerificationError, match="let the part lie off by"):
            check(damaged(C, lambda text, said=said, other=other: text.replace(said, f"nGeoShift:={other};"), program))


def test_a_demonstration_that_could_deposit_is_refused() -> None:
    program = damaged("GeoGuard.mod", lambda text: text.replace("geoOn:=0;", "geoOn:=1;"), written(DEMONSTRATION))
    with pytest.raises(VerificationError, match="the guard must say 'VAR num geoOn:=0;'"):
        verify(program, DEMONSTRATION)


def test_a_demonstration_that_does_not_say_so_is_refused() -> None:
    program = damaged("GeoPrint.mod", lambda text: text.replace("T UNKNOWN", "T FINE"), written(DEMONSTRATION))
    with pytest.raises(VerificationError, match="line 3: the header must say 'PLACEMENT UNKNOWN"):
        verify(program, DEMONSTRATION)


def test_a_calibrated_program_is_not_accepted_for_a_demonstration() -> None:
    with pytest.raises(VerificationError, match="PLACEMENT UNKNOWN"):
        verify(PROGRAM, DEMONSTRATION)


def test_a_module_of_more_than_15000_lines_is_refused() -> None:
    program = damaged("GeoPrint.mod", lambda text: text.replace("  PROC main", "  ! x\n" * 15000 + "  PROC main"))
    with pytest.raises(VerificationError, match="at most 15000 lines"):
        verify(program)


CODE = [
    (name, start + index)
    for name, text in PROGRAM.modules[:3]
    for start, line in ((match.start(), match[0]) for match in re.finditer(r"^(?! *!).+$", text, re.MULTILINE))
    for index, character in enumerate(line)
    if character not in " 0123456789"
]


@given(st.sampled_from(CODE))
@settings(max_examples=60, deadline=None)
def test_no_letter_sign_or_bracket_can_be_lost_unnoticed(place: tuple[str, int]) -> None:
    module, index = place
    with pytest.raises(VerificationError):
        verify(damaged(module, lambda text: text[:index] + text[index + 1 :]))


PATH = dict(PROGRAM.modules)[P]
NUMBERS = [match.span() for match in re.finditer(r"-?\d+\.\d{4,}", PATH) if match.start() > PATH.index("PROC main")]


@given(st.sampled_from(NUMBERS), st.integers(0, 9), st.data())
@settings(max_examples=40, deadline=None)
def test_no_digit_that_matters_can_change_unnoticed(span: tuple[int, int], digit: int, data: st.DataObject) -> None:
    index = data.draw(st.integers(span[0], PATH.index(".", span[0]) + 3))
    assume(PATH[index].isdigit() and PATH[index] != str(digit))
    with pytest.raises(VerificationError):
        verify(damaged("GeoPrint.mod", lambda text: text[:index] + str(digit) + text[index + 1 :]))
