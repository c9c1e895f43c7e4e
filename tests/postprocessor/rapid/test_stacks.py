"""The program of a stack: layers that come and go, each as its own program, and nothing else between them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import VerificationError
from geoprint.model import Cell, Flood, Placement, Program
from geoprint.postprocessor import OwnProgram
from geoprint.postprocessor.rapid import program as writer
from geoprint.postprocessor.rapid.cell_module import program_file
from geoprint.postprocessor.rapid.guard import resident_module
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.machine import Controller, Execution, Scenario, compile_task, execute
from geoprint.postprocessor.rapid.made import printing, signals_of, task_of
from geoprint.postprocessor.rapid.settings import as_new
from geoprint.postprocessor.rapid.stack_running import StackRun, compare_part, parts_of
from geoprint.postprocessor.rapid.stack_verifying import judge_stack, verify_stack
from geoprint.postprocessor.rapid.stack_writing import stack_files, stacked_layer
from geoprint.robot.arm import Arm
from tests.postprocessor.export_cases import CELL, DEMONSTRATION, PLACEMENT, orders, proven_program, stream, tips_of
from tests.postprocessor.rapid.test_lint import errors

PAUSING = replace(CELL, process=replace(CELL.process, layer_pause=30.0))
COURSES = (
    "dry",
    "printing",
    "printing from layer 2 on",
    "printing up to layer 2",
    "printing from run 2 of layer 2 on",
    "stopped in layer 3, and begun again from main",
)
Files = dict[str, str]
Findings = tuple[VerificationError, ...]


def own_program(number: int, *, cell: Cell = CELL, placement: Placement = PLACEMENT) -> OwnProgram:
    """The program of a layer by itself: the same rings, half a millimetre higher from layer to layer."""
    higher, tips = np.array([0.0, 0.0, 0.5 * number]), tips_of(stream())
    planned = orders(placement=placement)
    program, _ = proven_program(
        replace(planned, tips=planned.tips + higher), cell=cell, placement=placement, part_name="rings",
        surface_within=0.2 if placement.calibrated else None, tips_at=lambda times: tips(times) + higher, spacing=2.0,
    )  # fmt: skip
    return OwnProgram(number, f"layer-{number:02}", program.modules, cell, placement)


@cache
def layers(cell: Cell = CELL, placement: Placement = PLACEMENT) -> tuple[OwnProgram, ...]:
    return tuple(own_program(number, cell=cell, placement=placement) for number in (1, 2, 3))


def stacked(own: tuple[OwnProgram, ...]) -> Files:
    return dict(_stacked(own))


@cache
def _stacked(own: tuple[OwnProgram, ...]) -> tuple[tuple[str, str], ...]:
    first = own[0]
    made = [stacked_layer(one, number=number) for number, one in enumerate(own, start=1)]
    return stack_files(made, cell=first.cell, placement=first.placement, part_name="rings")


def judged(change: Callable[[Files], object], own: tuple[OwnProgram, ...] | None = None) -> Findings:
    own = own or layers()
    files = stacked(own)
    change(files)
    return judge_stack(files, own)[0]


def said(found: Findings) -> str:
    return "\n".join(map(str, found))


def running(files: Mapping[str, str], own: tuple[OwnProgram, ...], scenario: Scenario) -> Controller:
    cell, placement = own[0].cell, own[0].placement
    modules = [parse_module(name, text) for name, text in files.items() if name.endswith(".mod")]
    modules.append(parse_module(*resident_module(cell, placement)))
    arm = Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)
    at_once = [module.file for module in modules if "/" not in module.file]
    return Controller(compile_task(modules, at_once=at_once, signals=signals_of(cell), arm=arm), scenario)


def ran(files: Mapping[str, str], own: tuple[OwnProgram, ...], **data: float | bool) -> Execution:
    scenario = printing(own[0].cell, placement=own[0].placement)
    controller = running(files, own, replace(scenario, data={**scenario.data, **data}))
    controller.run_until(np.inf)
    return controller.execution()


@pytest.mark.parametrize(
    ("cell", "placement"), [(CELL, PLACEMENT), (PAUSING, DEMONSTRATION)], ids=["no pause, known", "pause, unknown"]
)
def test_a_stack_is_its_layers_one_after_another(cell: Cell, placement: Placement) -> None:
    own = layers(cell, placement)
    proof = verify_stack(stacked(own), own)
    known = COURSES if placement is PLACEMENT else COURSES[:-1]
    assert proof.scenarios == known
    assert len(proof.refused) == 6
    assert proof.runs == (2, 2, 2)
    # What a missing procedure or a broken file leads to no course brings.
    assert 0 < proof.statements - proof.executed <= 6


def test_what_is_written_is_told_in_its_names() -> None:
    text = stacked(layers(PAUSING))["GeoStack.mod"]
    assert re.search(r'GeoStackLayer 2,"layer-02","GeoLayer2_\d+";\n    GeoStackPause 2;\n    GeoStackLayer 3', text)
    assert "GeoStackPause 3" not in text
    assert "  CONST num nGeoLayerPause:=30;" in text
    assert "PERS num geoLastLayer:=3;" in text
    inner = stacked(layers())["layer-02/GeoCell.mod"]
    assert "geoDryRun" not in inner
    assert "jGeoStart" in inner


def test_a_long_layer_brings_its_paths_from_its_own_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer, "MODULE_LINES", 34)
    own = (own_program(1), own_program(2))
    files = stacked(own)
    assert 'GeoForget "layer-02/GeoPath1.mod";' in files["layer-02/GeoPrint.mod"]
    assert verify_stack(files, own).runs == (2, 2)


def test_a_flood_by_hand_is_asked_for_behind_the_last_layer_alone() -> None:
    own = layers(replace(CELL, flood=Flood(45.0)))
    flood = "Now flood the part with UV, seconds: 45"
    assert [text for _, text in ran(stacked(own), own).texts].count(flood) == 1
    texts = [text for _, text in ran(stacked(own), own, geoLastLayer=1.0).texts]
    assert texts[-1] == flood


def test_one_layer_is_a_stack_too() -> None:
    own = layers()[:1]
    assert verify_stack(stacked(own), own).scenarios[:2] == ("dry", "printing")


def test_the_last_layer_may_be_lowered_while_another_prints() -> None:
    own, scenario = layers(), printing(CELL, placement=PLACEMENT)
    controller = running(stacked(own), own, scenario)
    controller.run_until(8.0)
    controller.state.data[controller.state.task.declared.data["geolastlayer"].slot] = 1.0
    controller.run_until(np.inf)
    found = controller.execution()
    assert found.ended == "end"
    assert [part.folder for part in parts_of(found)] == ["layer-01"]
    assert (found.data["geofirstlayer"], found.data["geolayerbegun"]) == (2.0, 1.0)


def test_a_dry_run_that_is_set_to_print_in_its_middle_stays_dry() -> None:
    own, scenario = layers(), printing(CELL, placement=PLACEMENT)
    controller = running(stacked(own), own, replace(scenario, data={**scenario.data, "geoDryRun": True}))
    controller.run_until(8.0)
    controller.state.data[controller.state.task.declared.data["geodryrun"].slot] = False
    controller.run_until(np.inf)
    found = controller.execution()
    assert len(parts_of(found)) == 3
    assert not any(each.value for each in found.switchings)
    assert found.data["geofirstlayer"] == 1.0


def test_a_print_that_is_set_dry_in_its_middle_says_that_its_layer_is_not_done() -> None:
    own, scenario = layers(), printing(CELL, placement=PLACEMENT)
    controller = running(stacked(own), own, scenario)
    controller.run_until(8.0)
    controller.state.data[controller.state.task.declared.data["geodryrun"].slot] = True
    controller.run_until(np.inf)
    found = controller.execution()
    assert (found.data["geofirstlayer"], found.data["geolayerbegun"]) == (1.0, 1.0)


def test_a_layer_of_another_stack_is_not_taken_for_one_of_this() -> None:
    own = layers()
    files = stacked(own)
    other = stacked((own[0], own[2], own[1]))
    for name in ("GeoCell.mod", "GeoGuard.mod", "GeoPrint.mod"):
        files[f"layer-02/{name}"] = other[f"layer-03/{name}"]
    found = ran(files, own)
    assert found.ended == "exit"
    assert [part.folder for part in parts_of(found)] == ["layer-01"]
    assert found.texts[-1][1] == "copy the folders of this stack to HOME: anew."


def test_a_device_that_is_done_is_not_printed_upon() -> None:
    own = layers()
    found = ran(stacked(own), own, geoFirstLayer=4.0)
    assert (found.ended, found.moves.count) == ("exit", 0)
    assert "All layers are printed" in found.texts[-1][1]


@pytest.mark.parametrize("layer", [1, 3])
def test_a_stop_leads_back_to_the_layer_that_it_cut_short(layer: int) -> None:
    own, scenario = layers(), printing(CELL, placement=PLACEMENT)
    files = stacked(own)
    whole = parts_of(ran(files, own))[layer - 1]
    moment = next(each.time for each in whole.switchings if each.signal == "dovalve" and each.value) + 0.3
    controller = running(files, own, scenario)
    controller.stop_at(moment, "Stop")
    assert not any(controller.state.signals.values())
    controller.note_from_here()
    controller.from_main(replace(scenario, data={"geoFirstRun": 2.0}, answers=(1.0, 1.0)))
    controller.run_until(np.inf)
    found = controller.execution()
    shown = [text for _, text in found.texts]
    at = shown.index("The last print was stopped in run 1")
    assert shown[at : at + 4] == [
        "The last print was stopped in run 1", f"of layer {layer}", "This one starts with run 2", f"of layer {layer}",
    ]  # fmt: skip
    assert [part.folder for part in parts_of(found)] == [f"layer-{k:02}" for k in range(layer, 4)]
    assert (found.ended, found.data["geofirstlayer"], found.data["geofirstrun"]) == ("end", 4.0, 1.0)


def swapped(files: Files) -> None:
    files["layer-01/GeoPrint.mod"], files["layer-02/GeoPrint.mod"] = (
        files["layer-02/GeoPrint.mod"], files["layer-01/GeoPrint.mod"],
    )  # fmt: skip


def replaced(name: str, old: str, new: str) -> Callable[[Files], None]:
    def change(files: Files) -> None:
        assert old in files[name]
        files[name] = files[name].replace(old, new, 1)

    return change


def calls_swapped(files: Files) -> None:
    lines = files["GeoStack.mod"].split("\n")
    first, second = (next(k for k, line in enumerate(lines) if f"GeoStackLayer {n}," in line) for n in (1, 2))
    lines[first], lines[second] = lines[second], lines[first]
    files["GeoStack.mod"] = "\n".join(lines)


def call_left_out(files: Files) -> None:
    lines = files["GeoStack.mod"].split("\n")
    files["GeoStack.mod"] = "\n".join(line for line in lines if "GeoStackLayer 2," not in line)


DAMAGES: dict[str, tuple[Callable[[Files], object], str]] = {
    "modules of two layers swapped": (swapped, r"layer-01/GeoPrint.mod, line \d+: the layer's own program says"),
    "a target moved": (
        replaced("layer-02/GeoPrint.mod", "[[10.0000,0.0000,", "[[10.0001,0.0000,"),
        r"layer-02/GeoPrint.mod, line \d+: the layer's own program says 'MoveL",
    ),
    "a speed": (replaced("layer-02/GeoCell.mod", "vGeo2:=[", "vGeo2:=[1"), "layer-02/GeoCell.mod, line"),
    "a guard": (replaced("layer-03/GeoGuard.mod", "    GeoAskHome;\n", ""), "layer-03/GeoGuard.mod, line"),
    "a guard of a program by itself": (
        lambda files: files.update({"layer-01/GeoGuard.mod": dict(layers()[0].modules)["GeoGuard.mod"]}),
        r"layer-01/GeoGuard.mod, line 5: the guard must say",
    ),
    "a module gone": (lambda files: files.pop("layer-02/GeoCell.mod"), "layer-02/GeoCell.mod, line 1: this module"),
    "a module too many": (
        lambda files: files.update({"layer-02/GeoPath1.mod": "MODULE GeoPath1\nENDMODULE\n"}),
        "layer-02/GeoPath1.mod, line 1: no layer of the stack has this module",
    ),
    "a line more": (
        replaced("layer-02/GeoPrint.mod", "ENDMODULE\n", "ENDMODULE\n\n"),
        "follows the end of the module",
    ),
    "a module that breaks off": (
        lambda files: files.update({"layer-02/GeoCell.mod": files["layer-02/GeoCell.mod"][:-20]}),
        "layer-02/GeoCell.mod, line",
    ),
    "order changed": (calls_swapped, r"GeoStack.mod, line \d+: it must say 'GeoStackLayer 1,"),
    "a layer left out": (call_left_out, r"GeoStack.mod, line \d+: it must say 'GeoStackLayer 2,"),
    "another name": (
        replaced("layer-01/GeoPrint.mod", "PROC GeoLayer1_", "PROC GeoLayer1_0"),
        "layer-01/GeoPrint.mod, line 1: the layer's procedure must be GeoLayer1_",
    ),
    "the list": (
        lambda files: files.update({"GeoStack.pgf": program_file(["GeoStack.mod", "GeoPrint.mod"])}),
        "GeoStack.pgf, line 3: it must list GeoStack.mod alone",
    ),
    "no list": (lambda files: files.pop("GeoStack.pgf"), "GeoStack.pgf, line 1: the list of modules is missing"),
    "no main": (lambda files: files.pop("GeoStack.mod"), "GeoStack.mod, line 1: the module is missing"),
    "a wait": (
        replaced("GeoStack.mod", "    geoLayer:=layer;\n", "    geoLayer:=layer;\n    WaitTime 1;\n"),
        "it must say 'GeoStackLoad folder",
    ),
    "a switch out of range": (
        replaced("GeoStack.mod", "geoLastLayer:=3", "geoLastLayer:=4"),
        r"geoLastLayer must be a layer from the first on, 1 to 3, found 4",
    ),
    "a speed out of range": (
        replaced("GeoStack.mod", "geoSpeedPct:=25", "geoSpeedPct:=101"),
        r"geoSpeedPct must lie between 1 and 100, found 101",
    ),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_what_was_changed_is_found_with_its_file_and_line(name: str) -> None:
    change, words = DAMAGES[name]
    assert re.search(words, said(judged(change)))


HOMEWARD = "    MoveAbsJ jGeoHome\\NoEOffs,vGeoSlow,fine,tGeoNozzle;\n"
# What only the execution finds: the text is held to nothing here.
WRONGS: dict[str, tuple[Callable[[Files], object], str]] = {
    "order changed": (calls_swapped, r"the layers printed are \['layer-02', 'layer-01', 'layer-03'\]"),
    "a layer left out": (call_left_out, r"the layers printed are \['layer-01', 'layer-03'\]"),
    "an output left on": (
        replaced("GeoStack.mod", "    geoLayerFrom:=1;\n", "    geoLayerFrom:=1;\n    SetDO doValve,1;\n"),
        "dovalve switches here otherwise",
    ),
    "a target moved": (
        replaced("layer-02/GeoPrint.mod", "[[10.0000,0.0000,", "[[10.0001,0.0000,"),
        r"layer-02/GeoPrint.mod, line \d+: dry: layer-02: the position is",
    ),
    "a speed": (replaced("layer-02/GeoCell.mod", "vGeo2:=[2", "vGeo2:=[1"), "dry: layer-02: the speed is"),
    "a zone": (replaced("layer-02/GeoPrint.mod", ",zGeo2,", ",fine,"), "dry: layer-02: the zone is"),
    "a work object": (
        replaced("layer-03/GeoCell.mod", ',TRUE,"",[[312.3457,', ',TRUE,"",[[312.3458,'),
        "dry: layer-03: the frame is",
    ),
    "a trigger": (
        replaced("layer-01/GeoPrint.mod", "TriggIO tGeoValveOn,0.0000", "TriggIO tGeoValveOn,0.1000"),
        "layer-01/GeoPrint.mod, line 2.: dry: layer-01: douv switches here otherwise",
    ),
    "a move more": (
        replaced("layer-01/GeoPrint.mod", "    GeoEnd 2;\n", f"    GeoEnd 2;\n{HOMEWARD}"),
        r"dry: layer-01 makes \d+ moves, its own program \d+",
    ),
    "a pause": (
        replaced("GeoStack.mod", "nGeoLayerPause:=30", "nGeoLayerPause:=3"),
        "the pause behind layer 1 is 3.000 s, and should be 30 s",
    ),
    "a pause left out": (
        replaced("GeoStack.mod", "    GeoStackPause 2;\n", ""),
        "the pause behind layer 2 is 0.000 s, and should be 30 s",
    ),
    "no step": (
        replaced("GeoStack.mod", "      geoFirstLayer:=layer+1;\n", ""),
        "printing: geofirstlayer is 1.0 at the end, and should be 4",
    ),
    "no refusal": (
        replaced("GeoStack.mod", "    IF geoFirstLayer<1 GeoStackRefuse", "    IF geoFirstLayer<0 GeoStackRefuse"),
        "first layer 0: the stack must refuse before it moves",
    ),
    "no forgetting": (
        replaced("GeoStack.mod", '    GeoStackForget folder+"/GeoCell.mod";\n', ""),
        "ERR_LOADED: layer-02/GeoCell.mod brings",
    ),
    "no word of the layer": (
        replaced("layer-03/GeoGuard.mod", '    TPWrite "of layer "\\Num:=geoLayerBegun;\n', ""),
        "stopped in layer 3, and begun again from main: nothing says in which layer",
    ),
    "the layer begun is not noted": (
        replaced("layer-03/GeoGuard.mod", "    IF geoPrints geoLayerBegun:=geoLayer;\n", ""),
        "stopped in layer 3, and begun again from main: nothing says in which layer",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONGS)
def test_what_the_program_does_otherwise_is_found_by_running_it(name: str) -> None:
    change, words = WRONGS[name]
    own = layers(PAUSING)
    files = stacked(own)
    change(files)
    resident = parse_module(*resident_module(PAUSING, PLACEMENT))
    modules = [parse_module(name, text) for name, text in files.items() if name.endswith(".mod")]
    beside = [
        (one.folder, [*(parse_module(name, text) for name, text in one.modules if name.endswith(".mod")), resident])
        for one in own
    ]
    run = StackRun([*modules, resident], beside, ends=(1, 2), cell=PAUSING, placement=PLACEMENT)
    with pytest.raises(VerificationError, match=words):
        run.prove()


def test_a_part_is_held_to_every_number_of_its_own() -> None:
    (own,) = layers()[:1]
    arm = Arm(CELL.robot, T_flange_tool=CELL.tool.T_flange_tool)
    modules = [parse_module(name, text) for name, text in own.modules if name.endswith(".mod")]
    task = task_of([*modules, parse_module(*resident_module(CELL, PLACEMENT))], cell=CELL, arm=arm)
    (part,) = parts_of(execute(task, printing(CELL, placement=PLACEMENT)))
    compare_part(part, part, course="printing")
    for other in (replace(part, switchings=part.switchings[:-1]), replace(part, calls=part.calls[:-1])):
        with pytest.raises(VerificationError, match="otherwise than in its own program"):
            compare_part(part, other, course="printing")
    with pytest.raises(VerificationError, match="switches nothing"):
        compare_part(replace(part, switchings=()), part, course="printing")


def test_the_switches_of_a_stack_may_be_set() -> None:
    files = stacked(layers())
    text = files["GeoStack.mod"]
    for name, value in (("geoDryRun", "FALSE"), ("geoSpeedPct", "100"), ("geoFirstLayer", "2"), ("geoLastLayer", "2")):
        files["GeoStack.mod"] = re.sub(rf"( {name}:=)\w+;", rf"\g<1>{value};", files["GeoStack.mod"])
    assert as_new(files["GeoStack.mod"]) == text
    found, _, settings = judge_stack(files, layers())
    assert not found
    assert settings is not None
    assert (settings.dry_run, settings.speed_pct, settings.first_layer, settings.last_layer) == (False, 100.0, 2, 2)
    with pytest.raises(VerificationError, match="switches of a new program"):
        verify_stack(files, layers())


@pytest.mark.parametrize("placement", [PLACEMENT, DEMONSTRATION], ids=["known", "unknown"])
def test_a_judge_from_outside_finds_no_error_in_it(tmp_path: Path, placement: Placement) -> None:
    own = layers(PAUSING, placement)
    files = stacked(own)
    for one in own:
        folder = tmp_path / one.folder
        folder.mkdir()
        inner = [(name, text) for name, text in one.modules if name.endswith(".mod")]
        there = [("GeoStack.mod", files["GeoStack.mod"]), *((name, files[f"{one.folder}/{name}"]) for name, _ in inner)]
        # The judge follows no file whose name is made while the program runs: each layer stands beside GeoStack.
        listed = program_file([name for name, _ in there])
        assert not errors(Program((*there, ("GeoStack.pgf", listed)), targets=0, dry_run=False), folder)
