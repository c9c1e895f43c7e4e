"""The program of several attitudes of a table: it asks for each at home, and moves in the work object of each."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import VerificationError
from geoprint.model import Cell, Hexapod, Program, TiltTurn
from geoprint.positioner import table_machine, tilted_placement
from geoprint.postprocessor import OwnProgram
from geoprint.postprocessor.rapid.guard import resident_module
from geoprint.postprocessor.rapid.language.parsing import parse_module
from geoprint.postprocessor.rapid.machine import Execution, execute
from geoprint.postprocessor.rapid.made import printing, task_of
from geoprint.postprocessor.rapid.settings import as_new
from geoprint.postprocessor.rapid.stack_running import StackRun
from geoprint.postprocessor.rapid.stack_verifying import judge_stack, verify_stack
from geoprint.robot.arm import Arm
from tests.positioner.tables import hexapod_noun, tilt_turn_noun
from tests.postprocessor.export_cases import CELL, PLACEMENT, orders, proven_program, stream, tips_of
from tests.postprocessor.rapid.test_lint import errors
from tests.postprocessor.rapid.test_stacks import Files, judged, replaced, running, said, stacked

# The last tilts and turns by negative angles, which four decimals leave half a digit away.
UPS = ((0.0, 0.0, 1.0), (0.0, 0.17, 0.98), (0.17, -0.1, 0.98))


def driven() -> TiltTurn:
    """A tilt-turn table that the arm's controller tilts and turns."""
    return tilt_turn_noun(control='"external axes"', mechanical_unit='"STN1"')


TABLES = {"hexapod": hexapod_noun, "tilt-turn": tilt_turn_noun, "external axes": driven}


def own_program(number: int, table: Hexapod | TiltTurn) -> OwnProgram:
    """The rings, printed in one attitude of a table; after a layer comes half a minute."""
    machine, up = table_machine(table), np.array([UPS[number - 1]])
    T_table_plate = machine.plates(up / np.linalg.norm(up))[0]
    placement = tilted_placement(machine, PLACEMENT, T_table_plate=T_table_plate, number=number)
    cell = replace(CELL, table=table, process=replace(CELL.process, layer_pause=30.0))
    program, _ = proven_program(
        orders(placement=placement), cell=cell, placement=placement, part_name="rings", surface_within=0.2,
        tips_at=tips_of(stream()), spacing=2.0,
    )  # fmt: skip
    return OwnProgram(1, f"part-{number}", program.modules, cell, placement)


@cache
def attitudes(kind: str = "tilt-turn") -> tuple[OwnProgram, ...]:
    table = TABLES[kind]()
    return tuple(own_program(number, table) for number in (1, 2, 3))


@cache
def layered(kind: str = "tilt-turn") -> tuple[OwnProgram, ...]:
    """Two layers: the first in two attitudes, the second in one; half a minute between them."""
    first, second, _ = attitudes(kind)
    return (
        replace(first, folder="layer-01/part-1"),
        replace(second, folder="layer-01/part-2"),
        replace(first, layer=2, folder="layer-02"),
    )


def whole(own: tuple[OwnProgram, ...]) -> Execution:
    """The whole program as it prints, with somebody who brings the table to each attitude."""
    scenario = printing(own[0].cell, placement=own[0].placement, tables=len(own))
    controller = running(stacked(own), own, scenario)
    controller.run_until(np.inf)
    return controller.execution()


@pytest.mark.parametrize("kind", TABLES)
def test_a_program_is_its_attitudes_one_after_another_and_asks_for_each(kind: str) -> None:
    own = attitudes(kind)
    proof = verify_stack(stacked(own), own)
    assert proof.scenarios == (
        "dry",
        "printing",
        "printing from attitude 2 on",
        "printing up to attitude 2",
        "printing from run 2 of attitude 2 on",
        "stopped in attitude 3, and begun again from main",
    )
    assert len(proof.refused) == 6


def test_each_attitude_moves_in_its_own_work_object() -> None:
    own = attitudes()
    moves = whole(own).moves
    places = moves.tips(moves.along_path).reshape(3, -1, 3)
    one = own[0].placement.T_base_work
    for of, program in zip(places, own, strict=True):
        T = program.placement.T_base_work @ np.linalg.inv(one)
        np.testing.assert_allclose(of, places[0] @ T[:3, :3].T + T[:3, 3], atol=1e-3)
    assert np.abs(places[1] - places[0]).max() > 1.0


@pytest.mark.parametrize(("kind", "shown"), [("tilt-turn", 3), ("external axes", 3), ("hexapod", 13)])
def test_the_pendant_shows_what_to_bring_the_table_to(kind: str, shown: int) -> None:
    own = attitudes(kind)[1]
    texts = [text for _, text in whole(attitudes(kind)).texts]
    said = "The table will drive to attitude" if kind == "external axes" else "Bring the table to attitude"
    first = texts.index(f"{said} 2")
    assert all(len(text) <= 40 for text in texts[first : first + shown])
    numbers = [float(text.rpartition(" ")[2]) for text in texts[first : first + shown]]
    assert own.placement.table is not None
    axes = np.degrees(own.placement.table.axes) if kind != "hexapod" else own.placement.table.axes
    np.testing.assert_allclose(numbers[: 1 + len(axes)], [2.0, *axes], atol=1e-3)
    if kind == "hexapod":
        np.testing.assert_allclose(numbers[7:10], own.placement.table.T_table_plate[:3, 3], atol=1e-3)


def test_who_says_that_the_table_is_not_there_is_obeyed() -> None:
    own = attitudes()[1]
    modules = [parse_module(name, text) for name, text in own.modules if name.endswith(".mod")]
    modules.append(parse_module(*resident_module(own.cell, own.placement)))
    task = task_of(modules, cell=own.cell, arm=Arm(own.cell.robot, T_flange_tool=own.cell.tool.T_flange_tool))
    found = execute(task, replace(printing(own.cell, placement=own.placement), answers=(5.0,)))
    assert found.ended == "exit"
    assert not found.moves.along_path.size
    assert "bring the table to its attitude" in found.texts[-1][1]


def calls_swapped(files: Files) -> None:
    lines = files["GeoStack.mod"].split("\n")
    first, second = (next(k for k, line in enumerate(lines) if f"GeoStackAttitude {n}," in line) for n in (1, 2))
    lines[first], lines[second] = lines[second], lines[first]
    files["GeoStack.mod"] = "\n".join(lines)


def swapped(files: Files) -> None:
    files["part-1/GeoCell.mod"], files["part-2/GeoCell.mod"] = files["part-2/GeoCell.mod"], files["part-1/GeoCell.mod"]


CHANGES: dict[str, tuple[Callable[[Files], object], str]] = {
    "order of calls": (calls_swapped, "GeoStack.mod, line"),
    "cells changed for one another": (swapped, "the layer's own program says"),
    "no question": (replaced("part-2/GeoGuard.mod", "    GeoAskTable;\n", ""), "the guard must say 'GeoAskTable;'"),
    "an answer that does not count": (
        replaced("part-2/GeoGuard.mod", "IF answer<>1 GeoRefuse \"bring", "IF answer<>answer GeoRefuse \"bring"),
        "the guard must say 'IF answer<>1",
    ),
    "another angle": (
        replaced("part-2/GeoCell.mod", "nGeoTilt:=", "nGeoTilt:=1"), "own program says 'CONST num nGeoTilt",
    ),
}  # fmt: skip


@pytest.mark.parametrize("change", CHANGES)
def test_what_was_changed_is_found(change: str) -> None:
    how, words = CHANGES[change]
    found = judged(how, attitudes())
    assert found
    assert words in said(found)


def run_of(files: Files, own: tuple[OwnProgram, ...], *, ends: tuple[int, ...] = ()) -> StackRun:
    """What executes a program beside those of its attitudes; the text is held to nothing."""
    modules = [parse_module(name, text) for name, text in files.items() if name.endswith(".mod")]
    resident = parse_module(*resident_module(own[0].cell, own[0].placement))
    layers = [
        (one.folder, [*(parse_module(name, text) for name, text in one.modules if name.endswith(".mod")), resident])
        for one in own
    ]
    return StackRun([*modules, resident], layers, ends=ends, cell=own[0].cell, placement=own[0].placement)


def test_a_forgotten_question_is_found_by_executing_alone() -> None:
    own = attitudes()
    files = stacked(own)
    replaced("part-2/GeoGuard.mod", '    TPWrite "Bring the table to attitude "\\Num:=nGeoTable;\n', "")(files)
    with pytest.raises(VerificationError, match="nothing asks before the table comes to attitude 2"):
        run_of(files, own).prove()


def test_attitudes_in_another_order_or_on_another_plate_are_refused() -> None:
    own = attitudes()
    turned = (replace(own[1], folder="part-1"), replace(own[0], folder="part-2"))
    assert "attitude 1 of the table must be printed here, found 2" in said(judge_stack(stacked(turned), turned)[0])
    moved = own[2].placement.T_base_fixture.copy()
    moved[0, 3] += 0.01
    shifted = (*own[:2], replace(own[2], placement=replace(own[2].placement, T_base_fixture=moved)))
    assert "stands elsewhere on the plate" in said(judge_stack(stacked(own), shifted)[0])


@pytest.mark.parametrize("kind", TABLES)
def test_layers_over_a_table_are_one_program_whose_attitudes_are_numbered_through(kind: str) -> None:
    own = layered(kind)
    files = stacked(own)
    proof = verify_stack(files, own)
    assert len(proof.seconds) == 3
    texts = [text for _, text in whole(own).texts]
    said = "The table will drive to attitude" if kind == "external axes" else "Bring the table to attitude"
    asked = [k for k, text in enumerate(texts) if text.startswith(said)]
    assert [texts[k] for k in asked] == [f"{said} 1", f"{said} 2", f"{said} 3"]
    # The third one is the first of its layer: the table comes to the same pose.
    assert texts[asked[2] + 1 : asked[2] + 3] == texts[asked[0] + 1 : asked[0] + 3]
    assert "Layer 1: attitudes 1 to 2." in files["GeoStack.mod"]
    assert "Layer 2: attitude 3." in files["GeoStack.mod"]


def test_the_pause_comes_between_layers_and_not_between_attitudes_of_one() -> None:
    own = layered()
    assert "GeoStackPause 2;" in stacked(own)["GeoStack.mod"]
    assert stacked(own)["GeoStack.mod"].count("    GeoStackPause ") == 1
    paused = [moment for moment, text in whole(own).texts if text.startswith("Pause before the next layer")]
    asked = [moment for moment, text in whole(own).texts if text == "Attitude 3"]
    assert len(paused) == 1
    # What is more is loading.
    assert asked[0] - paused[0] == pytest.approx(31.5)
    assert "nGeoLayerPause" not in stacked(attitudes())["GeoStack.mod"]


LAYERED_CHANGES: dict[str, tuple[Callable[[Files], object], str]] = {
    "a pause moved": (
        replaced("GeoStack.mod", "GeoStackPause 2;", "GeoStackPause 1;"), "it must say 'GeoStackPause 2;' here",
    ),
    "a number that begins anew": (
        replaced("layer-02/GeoCell.mod", "nGeoTable:=3;", "nGeoTable:=1;"),
        "own program says 'CONST num nGeoTable:=3;' here",
    ),
    "calls of two layers changed for one another": (calls_swapped, "GeoStack.mod, line"),
}  # fmt: skip


@pytest.mark.parametrize("change", LAYERED_CHANGES)
def test_what_was_changed_in_a_program_of_layers_over_a_table_is_found(change: str) -> None:
    how, words = LAYERED_CHANGES[change]
    assert words in said(judged(how, layered()))


def test_a_pause_within_a_layer_is_found_by_executing_alone() -> None:
    own = layered()
    files = stacked(own)
    replaced("GeoStack.mod", "    GeoStackPause 2;\n", "")(files)
    replaced("GeoStack.mod", "    GeoStackAttitude 2,", "    GeoStackPause 1;\n    GeoStackAttitude 2,")(files)
    with pytest.raises(VerificationError, match=r"the pause behind attitude 1 is 30.000 s, and should be 0 s"):
        run_of(files, own, ends=(2,)).prove()


def test_layers_whose_attitudes_do_not_begin_with_the_first_are_refused() -> None:
    own = layered()
    cut = (own[0], replace(own[1], layer=2, folder="layer-02"))
    assert "attitude 1 of the table must be printed here, found 2" in said(judge_stack(stacked(cut), cut)[0])


def test_switches_of_a_program_of_attitudes_are_known_again() -> None:
    text = stacked(attitudes())["GeoStack.mod"]
    changed = text.replace("geoFirstAttitude:=1;", "geoFirstAttitude:=2;").replace(
        "geoLastAttitude:=3;", "geoLastAttitude:=2;"
    )
    assert changed != text
    assert as_new(changed) == text


def test_a_program_of_attitudes_stands_up_to_the_lint(tmp_path: Path) -> None:
    program = own_program(1, tilt_turn_noun())
    text = dict(program.modules)["GeoCell.mod"]
    assert re.search(r"CONST num nGeoTilt:=-?\d+\.\d{4};", text)
    assert isinstance(program.cell, Cell)
    made, _ = proven_program(
        orders(placement=program.placement), cell=program.cell, placement=program.placement, part_name="rings",
        surface_within=0.2, tips_at=tips_of(stream()), spacing=2.0,
    )  # fmt: skip
    assert errors(made, tmp_path) == []


def test_a_program_with_external_axes_stands_up_to_the_lint(tmp_path: Path) -> None:
    own = attitudes("external axes")[1]
    found = errors(Program(own.modules, targets=1, dry_run=False), tmp_path)
    # The judge takes outputs for given by the controller's configuration, but no mechanical unit.
    assert len(found) == 3
    assert all(one["code"] == "unresolved" and "stn1" in str(one).lower() for one in found)


def test_every_target_has_the_table_where_its_attitude_has_it_and_only_home_moves_it() -> None:
    own = attitudes("external axes")
    moves = whole(own).moves
    table = np.abs(moves.other_axes[:, 0]) < 1e9
    assert (np.abs(moves.other_axes[:, 2:]) > 1e9).all()
    along = moves.along_path.reshape(3, -1)
    for of, program in zip(along, own, strict=True):
        assert program.placement.table is not None
        axes = np.degrees(program.placement.table.axes)
        np.testing.assert_allclose(moves.other_axes[of, :2], np.tile(axes, (len(of), 1)), atol=1e-3)
    # Where the table's angles change the arm stands at home before and behind.
    home = own[0].cell.robot.home
    joints = np.column_stack([moves.places, moves.turns[:, :3]])
    changes = np.flatnonzero(table[1:] & (np.abs(np.diff(moves.other_axes[:, :2], axis=0)).max(axis=1) > 1e-3)) + 1
    assert changes.size == len(own)
    for row in changes.tolist():
        np.testing.assert_allclose(joints[[row - 1, row]], [home, home], atol=1e-5)


def changed_target(files: Files) -> None:
    """Another angle of the table in one target of the second attitude."""
    text = files["part-2/GeoPrint.mod"]
    found = list(re.finditer(r"\],\[(-?\d+\.\d{4}),(-?\d+\.\d{4}),9E9", text))[5]
    files["part-2/GeoPrint.mod"] = text[: found.start(1)] + f"{float(found[1]) + 0.5:.4f}" + text[found.end(1) :]


def all_targets(files: Files) -> None:
    """Another angle of the table wherever the second attitude says one: what moves agrees, but not with the plan."""
    for name in ("part-2/GeoPrint.mod", "part-2/GeoCell.mod"):
        files[name] = re.sub(
            r"\],\[(-?\d+\.\d{4}),(?=-?\d+\.\d{4},9E9)", lambda one: f"],[{float(one[1]) + 0.5:.4f},", files[name]
        )


DRIVEN_CHANGES: dict[str, tuple[Callable[[Files], object], str]] = {
    "no ActUnit": (replaced("part-2/GeoGuard.mod", "    ActUnit STN1;\n", ""), "the guard must say 'ActUnit STN1;'"),
    "no DeactUnit": (replaced("part-2/GeoGuard.mod", "    DeactUnit STN1;\n", ""), "the guard must say"),
    "another unit": (replaced("part-2/GeoGuard.mod", "ActUnit STN1;", "ActUnit STN2;"), "the guard must say"),
    "another angle of one target": (changed_target, "part-2/GeoPrint.mod, line"),
    "another angle of all": (all_targets, "part-2/GeoCell.mod, line"),
}  # fmt: skip


@pytest.mark.parametrize("change", DRIVEN_CHANGES)
def test_what_was_changed_of_a_table_that_is_driven_is_found(change: str) -> None:
    how, words = DRIVEN_CHANGES[change]
    found = judged(how, attitudes("external axes"))
    assert found
    assert words in said(found)


def executed_alone(*changes: tuple[str, str, str]) -> Execution:
    """The second attitude by itself, its modules changed by hand, executed without being compared with anything."""
    own = attitudes("external axes")[1]
    texts = {name: text for name, text in own.modules if name.endswith(".mod")}
    for name, before, behind in changes:
        assert before in texts[name]
        texts[name] = texts[name].replace(before, behind, 1)
    modules = [parse_module(name, text) for name, text in texts.items()]
    modules.append(parse_module(*resident_module(own.cell, own.placement)))
    task = task_of(modules, cell=own.cell, arm=Arm(own.cell.robot, T_flange_tool=own.cell.tool.T_flange_tool))
    return execute(task, printing(own.cell, placement=own.placement))


def test_the_machine_refuses_axes_of_a_unit_that_is_not_active_or_stands_elsewhere() -> None:
    assert executed_alone().ended == "end"
    inactive = executed_alone(("GeoGuard.mod", "    ActUnit STN1;\n", ""))
    assert (inactive.ended, "no mechanical unit is active" in inactive.reason) == ("error", True)
    unsaid = executed_alone(
        ("GeoGuard.mod", "jGeoTable\\NoEOffs,vGeoHome\\T:=nGeoTableMove", "jGeoHome\\NoEOffs,vGeoHome")
    )
    assert (unsaid.ended, "does not say where the active" in unsaid.reason) == ("error", True)
    text = dict(attitudes("external axes")[1].modules)["GeoCell.mod"]
    start = re.search(r"jGeoStart:=\[\[[^\]]*\],\[(-?\d+\.\d{4}),", text)
    assert start is not None
    turned = f"{float(start[1]) + 1.0:.4f}"
    elsewhere = executed_alone(("GeoCell.mod", start[0], start[0].replace(f"[{start[1]},", f"[{turned},")))
    assert (elsewhere.ended, "would move along a move of the tip" in elsewhere.reason) == ("error", True)
    end = "MoveAbsJ jGeoStart\\NoEOffs,vGeoHome\\T:=nGeoThere*100/geoPct,fine,tGeoNozzle;\n"
    moving = executed_alone(("GeoGuard.mod", end, end.replace("fine", "z10") + "      DeactUnit STN1;\n"))
    assert (moving.ended, "while the arm moves" in moving.reason) == ("error", True)
