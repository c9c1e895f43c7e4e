"""What a controller gets before the first load: it names the cell's outputs, and programs and it know each other."""

from __future__ import annotations

import hashlib
import re
import zlib
from dataclasses import replace
from importlib import resources
from pathlib import Path

import pytest

from geoprint.errors import VerificationError
from geoprint.model import Cell, Placement, Program
from geoprint.postprocessor.rapid.cell_module import guard_module
from geoprint.postprocessor.rapid.controller_files import controller_files
from geoprint.postprocessor.rapid.guard import check_resident
from geoprint.postprocessor.rapid.language.symbols import read_task
from tests.postprocessor.export_cases import CELL, DEMONSTRATION, PLACEMENT
from tests.postprocessor.rapid.test_lint import CELLS, errors, written

# The version of the text that programs ask for; a text with another hash is another version.
VERSION = 1
TEXT = "e198ec5f40fe9554"
EVENTS = {"STOP", "QSTOP", "START", "RESTART", "STEP", "RESET", "POWER_ON"}
OUTPUTS = {
    "io": {"doValve": "DO", "doUV": "DO"},
    "vacuum": {"doValve": "DO", "doUV": "DO", "doVacuum": "DO"},
    "everything": {"doValve": "DO", "doUV": "DO", "doVacuum": "DO", "aoFlow": "AO"},
}


def files(cell: Cell, placement: Placement = PLACEMENT, *, loading: bool = False) -> dict[str, str]:
    return controller_files(cell, placement=placement, loading=loading)


def entries(text: str, section: str) -> list[dict[str, str]]:
    """The entries of a section, as a controller reads them: a backslash at the end goes on in the next line."""
    bodies = dict(re.findall(r"^#\n([A-Z_]+):\n(.*?)(?=^#|\Z)", text, re.DOTALL | re.MULTILINE))
    lines = [line for line in bodies[section].replace("\\\n", " ").split("\n") if line.strip()]
    return [{key: value.strip('"') for key, value in re.findall(r'-(\w+) ("[^"]*"|\S+)', line)} for line in lines]


def procedure(text: str, name: str) -> list[str]:
    """The statements of a procedure."""
    body = re.search(rf"  PROC {name}\(.*?\)\n(.*?)\n  ENDPROC", text, re.DOTALL)
    assert body is not None, name
    return [line.strip() for line in body[1].split("\n")]


@pytest.mark.parametrize("name", OUTPUTS)
def test_the_signals_are_those_of_the_cell_each_off_by_default_and_safe_and_on_no_device(name: str) -> None:
    text = files(CELLS[name])["EIO.cfg"]
    assert text.startswith("EIO:CFG_1.0:6:1::\n#\nEIO_SIGNAL:\n")
    signals = entries(text, "EIO_SIGNAL")
    assert {signal["Name"]: signal["SignalType"] for signal in signals} == OUTPUTS[name]
    for signal in signals:
        assert (signal["Default"], signal["SafeLevel"], signal["Access"]) == ("0", "SafetySafeLevel", "Default")
        assert not {"Device", "DeviceMap"} & signal.keys()


@pytest.mark.parametrize("name", CELLS)
def test_configuration_has_the_form_of_a_controllers_own(name: str) -> None:
    for file, text in files(CELLS[name]).items():
        assert text.isascii()
        assert text.endswith("\n")
        assert not re.search(r"^@|<[A-Z]+>", text, re.MULTILINE), file
        if file.endswith(".cfg"):
            assert max(len(line) for line in text.split("\n")) <= 80
            assert not re.search(r"\\\n\s*\n|[ \t]\n", text), "a line goes on into nothing"


# Of a stack of twelve layers.
FOLDERS = [f"layer-{number:02}" for number in range(1, 13)]


@pytest.mark.parametrize("placement", [PLACEMENT, DEMONSTRATION], ids=["known", "unknown"])
def test_a_stack_says_what_to_copy_and_what_to_try(placement: Placement) -> None:
    brought = controller_files(CELL, placement=placement, loading=True, folders=FOLDERS)
    page = brought.pop("first_load.md")
    alone = controller_files(CELL, placement=placement, loading=True)
    assert not re.search(r"^@|<[A-Z]+>", page, re.MULTILINE)
    assert max(len(line) for line in page.split("\n")) <= 88
    assert "Copy the folders `layer-01` to `layer-12` of `rapid/` to HOME:" in page
    assert "geoFirstLayer and geoLastLayer above 12" in page
    assert "GeoPrint.pgf" not in page
    assert page.count("GeoStack.pgf") == alone["first_load.md"].count("GeoPrint.pgf") == 2
    assert ("Set geoLastLayer to 1" in page) is not bool(placement.missing)
    # All else is that of the cell, whatever is printed in it.
    assert brought == {name: text for name, text in alone.items() if name != "first_load.md"}


def test_every_event_is_tied_to_a_routine_of_the_resident_that_takes_nothing() -> None:
    brought = files(CELL)
    hooks = entries(brought["SYS.cfg"], "CAB_EXEC_HOOKS")
    assert brought["SYS.cfg"].startswith("SYS:CFG_1.0:6:0::\n#\n")
    assert {hook["Shelf"] for hook in hooks} == EVENTS
    assert len(hooks) == len(EVENTS)
    tied = {hook["Shelf"]: hook["Routine"] for hook in hooks}
    assert tied["STOP"] == tied["QSTOP"] == "GeoResidentStopped"
    assert tied["RESTART"] == tied["STEP"] == "GeoResidentRestarted"
    for hook in hooks:
        assert f"  PROC {hook['Routine']}()\n" in brought["GeoResident.sys"]
        assert hook["Routine"] in brought["first_load.md"]
    (module,) = entries(brought["SYS.cfg"], "CAB_TASK_MODULES")
    assert module == {"File": "HOME:/GeoResident.sys", "ModName": "GeoResident", "Task": "T_ROB1"}


@pytest.mark.parametrize("name", OUTPUTS)
def test_a_stop_with_any_output_on_is_remembered_before_all_of_them_are_shut(name: str) -> None:
    text = files(CELLS[name])["GeoResident.sys"]
    safe = {f"Set{kind} {output},0;" for output, kind in OUTPUTS[name].items()}
    assert set(procedure(text, "GeoResidentSafe")) == safe
    stopped = procedure(text, "GeoResidentStopped")
    asked = {f"IF {output}{'=1' if kind == 'DO' else '<>0'} GeoResidentCut;" for output, kind in OUTPUTS[name].items()}
    assert set(stopped[:-1]) == asked
    assert stopped[-1] == "GeoResidentSafe;"


def test_what_is_remembered_outlasts_a_start_from_main_and_a_loss_of_power() -> None:
    text = files(CELL)["GeoResident.sys"]
    assert "(SYSMODULE)\n" in text
    assert re.findall(r"  (VAR|PERS) (\w+) (\w+)", text.partition("  PROC ")[0]) == [
        ("PERS", "num", "geoRunUnderWay"), ("PERS", "num", "geoRunCutShort"),
    ]  # fmt: skip
    assert procedure(text, "GeoResidentCut") == ["IF geoRunUnderWay>0 geoRunCutShort:=geoRunUnderWay;"]
    for routine in ("GeoResidentStarted", "GeoResidentPowered", "GeoResidentReset"):
        assert procedure(text, routine)[0] == "GeoResidentCut;"
    assert procedure(text, "GeoResidentRestarted")[0] == "IF geoRunUnderWay>0 AND geoRunCutShort>0 THEN"
    assert "EXIT;" in procedure(text, "GeoResidentRestarted")


def test_a_changed_text_of_the_resident_is_a_new_version() -> None:
    template = resources.files("geoprint.postprocessor.rapid").joinpath("geo_resident.sys").read_bytes()
    assert hashlib.sha256(template).hexdigest()[:16] == TEXT, "raise RESIDENT_VERSION, then the two values here"
    assert f"CONST num nGeoResident:={VERSION};" in files(CELL)["GeoResident.sys"]


@pytest.mark.parametrize("name", CELLS)
def test_a_program_asks_for_just_this_version_and_just_these_outputs(name: str) -> None:
    cell = CELLS[name]
    signals = cell.signals
    known = [f"LAMP={signals.uv_lamp}", f"VALVE={signals.dispenser}"]
    known += [f"FLOW={signals.flow}"] if signals.mode == "analog" else []
    known += [f"VACUUM={signals.vacuum}"] if signals.vacuum else []
    outputs = (
        zlib.crc32(
            ",".join(sorted(word.partition("=")[0] + "=" + word.partition("=")[2].lower() for word in known)).encode()
        )
        % 1000000
    )
    guard = guard_module(cell, placement=PLACEMENT, loading=False)
    assert f"IF version<>{VERSION} THEN" in guard
    assert f"IF outputs<>{outputs} GeoRefuse" in guard
    assert f"CONST num nGeoOutputs:={outputs};" in files(cell)["GeoResident.sys"]


def test_a_resident_for_other_outputs_is_another_one() -> None:
    other = replace(CELL, signals=replace(CELL.signals, uv_lamp="doLamp"))
    record = re.compile(r"CONST num nGeoOutputs:=\d+;")
    assert record.findall(files(CELL)["GeoResident.sys"]) != record.findall(files(other)["GeoResident.sys"])


@pytest.mark.parametrize("placement", [PLACEMENT, DEMONSTRATION], ids=["known", "demo"])
def test_a_program_never_names_the_resident_but_in_strings_and_asks_before_anything_else(placement: Placement) -> None:
    guard = guard_module(CELLS["everything"], placement=placement, loading=True)
    code = re.sub(r'"[^"]*"|!.*', "", guard)
    assert "GeoResident" not in code
    begin = procedure(guard, "GeoBegin")
    asks = begin.index("GeoAskResident;")
    assert not [line for line in begin[:asks] if re.match(r"Move|GeoAsk|IF", line)]
    called = set(re.findall(r'GeoKeeper "(\w+)"', guard))
    resident = files(CELLS["everything"])["GeoResident.sys"]
    assert {"GeoResidentVersion", "GeoResidentOutputs"} <= called
    assert all(f"  PROC {routine}(INOUT num value)\n" in resident for routine in called)
    assert "IF ERRNO=ERR_REFUNKPRC OR ERRNO=ERR_CALLPROC THEN" in procedure(guard, "GeoKeeper")


def test_what_shuts_off_on_an_error_needs_no_resident() -> None:
    guard = guard_module(CELLS["everything"], placement=PLACEMENT, loading=False)
    for routine in ("GeoSafe", "GeoRefuse"):
        assert not [line for line in procedure(guard, routine) if "GeoKeeper" in line]
    assert procedure(guard, "GeoSafe")[-2:] == ["IF geoOn=1 geoCutShort:=TRUE;", "geoOn:=0;"]


def test_what_was_set_at_the_start_counts_to_the_end() -> None:
    guard = guard_module(CELLS["everything"], placement=PLACEMENT, loading=False)
    begin = guard.index("  PROC GeoBegin(")
    behind = guard[:begin] + guard[guard.index("  PROC GeoKeeper(") :]
    assert "geoSpeedPct" not in re.sub(r'"[^"]*"|!.*', "", behind)
    assert "geoFirstRun" not in re.sub(r'"[^"]*"|!.*', "", behind)
    assert re.findall(r".*geoDryRun.*", re.sub(r"!.*", "", behind)) == [
        "    IF NOT geoPrints OR geoDryRun OR run<geoFrom THEN",
        "    IF geoPrints AND (NOT geoDryRun) THEN",
        "    IF geoPrints AND (NOT geoDryRun) THEN",
    ]
    io = guard_module(CELL, placement=PLACEMENT, loading=False)
    assert "IF geoPct<>100 OR CSpeedOverride()<>100" in io


def test_runs_follow_one_another_from_main_only() -> None:
    guard = guard_module(CELL, placement=PLACEMENT, loading=False)
    assert "VAR num geoRun:=-1;" in guard
    assert procedure(guard, "GeoBegin")[-4] == "geoRun:=0;"
    enter = procedure(guard, "GeoEnter")
    assert enter.index('IF run<>geoRun+1 GeoRefuse "runs follow one another from main only: start from main.";') < (
        enter.index("geoOn:=1;")
    )
    assert "geoRun:=-1;" in procedure(guard, "GeoEnd")
    assert "geoRun:=-1;" in procedure(guard, "GeoRefuse")


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("placement", [PLACEMENT, DEMONSTRATION], ids=["known", "demo"])
def test_program_and_resident_are_one_task_without_a_name_declared_twice(name: str, placement: Placement) -> None:
    program = written(CELLS[name], placement)
    modules = [each for each in program.modules if each[0].endswith(".mod")]
    task = read_task([*modules, ("GeoResident.sys", files(CELLS[name], placement)["GeoResident.sys"])], signals=None)
    assert len(task.modules) == len(modules) + 1


@pytest.mark.parametrize("name", ["io", "everything"])
def test_a_judge_finds_no_error_in_program_and_resident_together(name: str, tmp_path: Path) -> None:
    program = written(CELLS[name], PLACEMENT)
    ends = ("</Program>", "\t<Module>GeoResident.sys</Module>\n</Program>")
    listed = [(file, text.replace(*ends)) for file, text in program.modules]
    listed.append(("GeoResident.sys", files(CELLS[name])["GeoResident.sys"]))
    assert errors(Program(tuple(listed), targets=program.targets, dry_run=False), tmp_path) == []


@pytest.mark.parametrize("name", ["io", "everything"])
def test_each_lost_or_doubled_line_of_the_resident_is_found_at_its_place(name: str) -> None:
    text = files(CELLS[name])["GeoResident.sys"]
    check_resident(text, cell=CELLS[name], placement=PLACEMENT)
    lines = text.split("\n")
    for number, line in enumerate(lines[:-1], start=1):
        for changed in ([*lines[: number - 1], *lines[number:]], [*lines[:number], line, *lines[number:]]):
            with pytest.raises(VerificationError, match=r"controller/GeoResident\.sys, line \d+") as caught:
                check_resident("\n".join(changed), cell=CELLS[name], placement=PLACEMENT)
            assert caught.value.details["line"] in {number - 1, number, number + 1}


@pytest.mark.parametrize("placement", [PLACEMENT, DEMONSTRATION], ids=["known", "demo"])
def test_the_page_goes_from_a_virtual_controller_to_the_real_one_and_promises_no_print_it_may_not(
    placement: Placement,
) -> None:
    page = files(CELLS["analog"], placement, loading=True)["first_load.md"]
    heads = re.findall(r"^## (.*)$", page, re.MULTILINE)
    assert heads.index("First on a virtual controller") < heads.index("Then on the real controller")
    assert "Options: none beyond RobotWare itself" in page
    assert "have never been loaded on a controller" in re.sub(r"\s+", " ", page)
    assert "Event Preset Time of 0.04 s" in page
    assert ("geoDryRun FALSE" in page) == (not placement.missing)
    assert "doValve, doUV, aoFlow" in page
    assert "GeoPath1" in page
    assert max(len(line) for line in page.split("\n")) <= 100
    assert "GeoPath" not in files(CELL, placement)["first_load.md"]
