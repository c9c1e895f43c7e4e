"""What every program is put through before it is written: dry, printing, resumed, refusing, stopped."""

from __future__ import annotations

import gc
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from geoprint.errors import VerificationError
from geoprint.model import Placement
from geoprint.postprocessor.rapid.executed import Proof, beyond, check_times, deviations, prove, switching_deviation
from geoprint.postprocessor.rapid.guard import resident_module
from geoprint.postprocessor.rapid.language.parsing import parse_module, uncollected
from geoprint.postprocessor.rapid.machine.moves import rounded_lengths
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

POSES = stream()


@cache
def written(*, known: bool = True) -> tuple[tuple[tuple[str, str], ...], Proof]:
    placement = PLACEMENT if known else DEMONSTRATION
    program, proof = proven_program(
        orders(placement=placement), cell=CELL, placement=placement, surface_within=0.2 if known else None,
        tips_at=tips_of(POSES), part_name="rings", spacing=2.0,
    )  # fmt: skip
    return program.modules, proof


def proven(*changes: tuple[str, str], placement: Placement = PLACEMENT) -> Proof:
    """Execute the program with words of any module replaced, as nothing else would look at it."""
    modules = [*written()[0][:-1], resident_module(CELL, placement)]
    for old, new in changes:
        assert any(old in text for _, text in modules)
        modules = [(name, text.replace(old, new)) for name, text in modules]
    parsed = [parse_module(name, text) for name, text in modules]
    proof = prove(parsed, orders(), cell=CELL, placement=placement, events=events())
    for wrong in proof.wrong:
        raise wrong
    return proof


def test_a_program_is_executed_in_every_manner_and_does_what_the_plan_says() -> None:
    executed = written()[1].executed
    assert executed.scenarios == (
        "dry", "printing", "resumed at run 2", "speed 0", "speed 101", "first run 0", "first run 3",
        "work object 5 mm off", *(f"axis {k} far from home, and Stop" for k in range(1, 7)),
        "stopped in the first deposit, and gone on",
    )  # fmt: skip
    assert executed.motion < 1e-4
    assert executed.outputs < 2e-4
    assert executed.executed + sum(len(each.lines) for each in executed.not_executed) == executed.statements


def test_what_no_scenario_executes_is_listed_with_its_reason() -> None:
    modules, proof = written()
    texts = dict([*modules, resident_module(CELL, PLACEMENT)])
    missed = [(each.file, line) for each in proof.executed.not_executed for line in each.lines]
    lines = {(file, line): texts[file].split("\n")[line - 1].strip() for file, line in missed}
    assert {words for (file, _), words in lines.items() if file == "GeoPrint.mod"} <= {"GeoSafe;", "RAISE;"}
    assert 0 < len(lines) < proof.executed.statements / 3
    assert {each.reason for each in proof.executed.not_executed} <= {
        "an error that the controller raises", "a stop, a refusal or an answer that no scenario brings here",
    }  # fmt: skip


def test_a_dry_run_switches_nothing_on_and_is_lifted() -> None:
    proof = written()[1]
    assert {each.value for each in proof.dry.execution.switchings} == {0.0}
    lifted = proof.dry.execution.moves.Ts_base_tip(proof.dry.rows)[:, 2, 3]
    printed = proof.printing.execution.moves.Ts_base_tip(proof.printing.rows)[:, 2, 3]
    assert (lifted - printed) == pytest.approx(np.full(18, float(lifted[0] - printed[0])), abs=1e-3)
    assert lifted[0] - printed[0] > 10.0


def test_a_program_whose_place_nobody_knows_is_executed_as_it_would_print() -> None:
    proof = written(known=False)[1]
    assert proof.printing.scenario.held == {"geoOn": 1.0}
    assert {each.value for each in proof.printing.execution.switchings} == {0.0, 1.0}
    assert proof.executed.motion < 1e-4
    assert not any(name.startswith("stopped") for name in proof.executed.scenarios)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("    IF geoSpeedPct<1 OR geoSpeedPct>100 GeoRefuse", "    IF geoSpeedPct>100 GeoRefuse", "speed 0"),
        ("geoSpeedPct>100 GeoRefuse", "geoSpeedPct>101 GeoRefuse", "speed 101"),
        ("IF geoFirstRun<1 OR", "IF geoFirstRun<0 OR", "first run 0"),
        ("geoFirstRun>runs GeoRefuse", "geoFirstRun>runs+1 GeoRefuse", "first run 3"),
        (">nGeoShift OR", ">1000*nGeoShift OR", "work object 5 mm off"),
        ("rax_1)>5", "rax_1)>50", "axis 1 far from home"),
        ("rax_6)>5", "rax_6)>50", "axis 6 far from home"),
        ("answer<>1", "answer=1", "far from home"),
        ("      geoOn:=0;", "      geoOn:=1;", "does not run to its end"),
        ("geoRunCutShort:=geoRunUnderWay", "geoRunCutShort:=0", "the program goes on printing"),
        ("    GeoResidentSafe;\n  ENDPROC\n  ! Event Start", "  ENDPROC\n  ! Event Start", "is still on"),
        ("run<geoFrom THEN", "run<geoFrom-1 THEN", "before that run"),
    ],
)  # fmt: skip
def test_a_guard_that_lets_through_what_it_must_not_is_found_by_executing_it(old: str, new: str, reason: str) -> None:
    with pytest.raises(VerificationError, match=reason):
        proven((old, new))


def test_deviations_are_those_of_what_was_executed() -> None:
    made, planned = written()[1].printing, orders()
    slower = replace(planned, times=planned.times * 1.01)
    assert deviations(made, slower, placement=PLACEMENT)[2] > 0.005
    off = replace(planned, tips=planned.tips + np.array([0.0, 0.0, 0.01]))
    assert deviations(made, off, placement=PLACEMENT)[0] == pytest.approx(0.01, abs=1e-4)
    first, *rest = events()
    moved = (replace(first, distance=first.distance + 0.07), *rest)
    assert switching_deviation(made, moved) == pytest.approx(0.07, abs=1e-5)
    assert switching_deviation(made, tuple(rest)) == np.inf


def test_a_corner_is_as_long_as_its_parabola() -> None:
    places = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [5.0, 3.0, 1.0], [5.0, 3.0, 1.0], [9.0, 3.0, 1.0]])
    zones = np.array([0.0, 9.0, 0.0, 0.0, 0.0])
    # A zone of 9 mm is no larger than half of the nearer line, sqrt(11) / 2; the curve is measured in small pieces.
    size, ahead = np.sqrt(11.0) / 2.0, np.array([1.0, 3.0, 1.0]) / np.sqrt(11.0)
    share = np.linspace(0.0, 0.5, 20_001)[:, None]
    entry, leave = places[1] - [size, 0.0, 0.0], places[1] + size * ahead
    curve = (1.0 - share) ** 2 * entry + 2.0 * share * (1.0 - share) * places[1] + share**2 * leave
    half = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
    expected = [4.0 - size + half, np.sqrt(11.0) - size + half, 0.0, 4.0]
    np.testing.assert_allclose(rounded_lengths(places, zones), expected, atol=1e-7)


def test_a_straight_path_loses_nothing_at_its_zones() -> None:
    places = np.outer(np.arange(4.0), [0.6, 0.0, 0.8])
    np.testing.assert_allclose(rounded_lengths(places, np.full(4, 0.3)), 1.0, atol=1e-12)


def test_a_program_that_takes_longer_or_shorter_than_it_was_timed_is_refused() -> None:
    executed = replace(written()[1].executed, move_time=0.02, run_time=0.05)
    check_times(executed)
    for figure, words in (("move_time", r"a move takes 0\.0202 s more"), ("run_time", r"of a run take 5\.1 % of")):
        with pytest.raises(VerificationError, match=words):
            check_times(replace(executed, **{figure: 1.01 * getattr(executed, figure)}))


@pytest.mark.parametrize(("figure", "allowed"), [("motion", 0.001), ("outputs", 0.05)])
def test_what_lies_farther_from_the_plan_than_allowed_is_refused(figure: str, allowed: float) -> None:
    executed = written()[1].executed
    assert not beyond(replace(executed, **{figure: allowed}))
    (error,) = beyond(replace(executed, **{figure: 1.01 * allowed}))
    assert f"allowed are {allowed:g} mm" in str(error)


def test_the_collector_is_as_it_was_behind_a_program_that_fails() -> None:
    seen: list[bool] = []

    @uncollected()
    def fail() -> None:
        seen.append(gc.isenabled())
        raise VerificationError("no program; write it again.")

    with pytest.raises(VerificationError):
        fail()
    assert (seen, gc.isenabled()) == ([False], True)
