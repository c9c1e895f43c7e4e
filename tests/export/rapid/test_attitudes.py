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
from geoprint.export.rapid.guard import resident_module
from geoprint.export.rapid.language.parsing import parse_module
from geoprint.export.rapid.machine import Execution, execute
from geoprint.export.rapid.made import printing, task_of
from geoprint.export.rapid.program import proven_program
from geoprint.export.rapid.settings import as_new
from geoprint.export.rapid.stacks import OwnProgram, judge_stack, verify_stack
from geoprint.export.rapid.stacks.running import StackRun
from geoprint.model import Cell, Hexapod, TiltTurn
from geoprint.motion.arm import Arm
from geoprint.motion.machine import table_machine, tilted_placement
from tests.export.export_cases import CELL, PLACEMENT, orders, stream, tips_of
from tests.export.rapid.test_lint import errors
from tests.export.rapid.test_stacks import Files, judged, replaced, running, said, stacked
from tests.motion.machine.tables import hexapod_noun, tilt_turn_noun

UPS = ((0.0, 0.0, 1.0), (0.0, 0.17, 0.98), (0.1, -0.1, 0.98))
TABLES = {"hexapod": hexapod_noun, "tilt-turn": tilt_turn_noun}


def own_program(number: int, table: Hexapod | TiltTurn) -> OwnProgram:
    """The rings, printed in one attitude of a table."""
    machine, up = table_machine(table), np.array([UPS[number - 1]])
    T_table_plate = machine.plates(up / np.linalg.norm(up))[0]
    placement = tilted_placement(machine, PLACEMENT, T_table_plate=T_table_plate, number=number)
    cell = replace(CELL, table=table)
    program, _ = proven_program(
        orders(placement=placement), cell=cell, placement=placement, part_name="rings", surface_within=0.2,
        tips_at=tips_of(stream()), spacing=2.0,
    )  # fmt: skip
    return OwnProgram(f"part-{number}", program.modules, cell, placement)


@cache
def attitudes(kind: str = "tilt-turn") -> tuple[OwnProgram, ...]:
    table = TABLES[kind]()
    return tuple(own_program(number, table) for number in (1, 2, 3))


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


@pytest.mark.parametrize(("kind", "shown"), [("tilt-turn", 3), ("hexapod", 13)])
def test_the_pendant_shows_what_to_bring_the_table_to(kind: str, shown: int) -> None:
    own = attitudes(kind)[1]
    texts = [text for _, text in whole(attitudes(kind)).texts]
    first = texts.index("Bring the table to attitude 2")
    numbers = [float(text.rpartition(" ")[2]) for text in texts[first : first + shown]]
    assert own.placement.table is not None
    axes = np.degrees(own.placement.table.axes) if kind == "tilt-turn" else own.placement.table.axes
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
    assert found.findings
    assert words in said(found)


def test_a_forgotten_question_is_found_by_executing_alone() -> None:
    own = attitudes()
    files = stacked(own)
    replaced("part-2/GeoGuard.mod", '    TPWrite "Bring the table to attitude "\\Num:=nGeoTable;\n', "")(files)
    modules = [parse_module(name, text) for name, text in files.items() if name.endswith(".mod")]
    resident = parse_module(*resident_module(own[0].cell, own[0].placement))
    layers = [
        (one.folder, [*(parse_module(name, text) for name, text in one.modules if name.endswith(".mod")), resident])
        for one in own
    ]
    run = StackRun([*modules, resident], layers, cell=own[0].cell, placement=own[0].placement)
    with pytest.raises(VerificationError, match="nobody is asked to bring the table to attitude 2"):
        run.prove()


def test_attitudes_in_another_order_or_on_another_plate_are_refused() -> None:
    own = attitudes()
    turned = (replace(own[1], folder="part-1"), replace(own[0], folder="part-2"))
    assert "attitude 1 of the table must be printed here, found 2" in said(judge_stack(stacked(turned), turned))
    moved = own[2].placement.T_base_fixture.copy()
    moved[0, 3] += 0.01
    shifted = (*own[:2], replace(own[2], placement=replace(own[2].placement, T_base_fixture=moved)))
    assert "stands elsewhere on the plate" in said(judge_stack(stacked(own), shifted))


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
