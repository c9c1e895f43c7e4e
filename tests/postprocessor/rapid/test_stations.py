"""What a program does before and after its path, executed: priming, the final exposure, and moves that take no time.

The guard's text is elsewhere compared with its own template; here it is held to what comes out of the outputs.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from geoprint.model import Flood, Purge, Signals
from geoprint.postprocessor.rapid.executed import Proof
from geoprint.postprocessor.rapid.made import Made
from geoprint.postprocessor.rapid.verify import verify_program
from tests.postprocessor.export_cases import CELL, PLACEMENT, events, orders, proven_program, stream, tips_of

ABOVE = CELL.robot.home + np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
ASIDE = CELL.robot.home + np.array([-0.4, 0.1, 0.0, 0.0, 0.0, 0.0])
STATIONS = replace(CELL, purge=Purge(joints=ABOVE, duration=2.5), flood=Flood(duration=60.0, joints=ASIDE))
ANALOG = Signals(mode="analog", dispenser="doValve", uv_lamp="doUV", flow="aoFlow", flow_per_mm3_s=0.2, flow_lag=0.05)
CELLS = {
    "valve": STATIONS,
    "flow": replace(STATIONS, signals=ANALOG),
    "vacuum": replace(STATIONS, signals=replace(CELL.signals, vacuum="doVacuum")),
}


@pytest.fixture(scope="module", params=CELLS)
def proof(request: pytest.FixtureRequest) -> Proof:
    cell = CELLS[request.param]
    program, _ = proven_program(
        orders(), cell=cell, placement=PLACEMENT, surface_within=0.21, tips_at=tips_of(stream()), part_name="rings",
        spacing=2.0,
    )  # fmt: skip
    return verify_program(
        program, orders(), cell=cell, placement=PLACEMENT, surface_within=0.21, events=events(cell=cell)
    )


def changes(made: Made, *, before: float = np.inf, after: float = -np.inf) -> list[tuple[str, float, float]]:
    """Return when outputs that are off go on, and off again: signal, value, time, in order."""
    state: dict[str, float] = {}
    found: list[tuple[str, float, float]] = []
    for each in made.execution.switchings:
        if state.get(each.signal, 0.0) != each.value and after <= each.time <= before:
            found.append((each.signal, each.value, each.time))
        state[each.signal] = each.value
    return found


def test_the_nozzle_is_primed_at_its_station_with_the_largest_flow_at_the_set_speed(proof: Proof) -> None:
    made = proof.printing
    moves = made.execution.moves
    path_begins = float(moves.begins[made.rows[0] - 1])
    primed = changes(made, before=path_begins)
    flow = [("aoflow", 0.2 * 0.5 * 20.0)] if "aoflow" in made.execution.signals else []
    assert [(signal, value) for signal, value, _ in primed] == [
        *flow, ("dovalve", 1.0), ("dovalve", 0.0), *((signal, 0.0) for signal, _ in flow),
    ]  # fmt: skip
    on, off = (time for signal, _, time in primed if signal == "dovalve")
    assert off - on == pytest.approx(2.5)
    # The arm stands over the station meanwhile, and goes home from there before the path.
    row = int(np.searchsorted(moves.ends, on + 1e-9)) - 1
    joints = np.append(moves.places[row], moves.turns[row, :3])
    np.testing.assert_allclose(joints, ABOVE, atol=1e-6)
    np.testing.assert_allclose(np.append(moves.places[row + 1], moves.turns[row + 1, :3]), CELL.robot.home, atol=1e-6)


def test_the_whole_part_is_exposed_at_last_from_its_station_with_the_valve_shut(proof: Proof) -> None:
    made = proof.printing
    moves = made.execution.moves
    path_ends = float(moves.ends[made.rows[-1]])
    flooded = changes(made, after=path_ends + 1e-6)
    assert [(signal, value) for signal, value, _ in flooded] == [("douv", 1.0), ("douv", 0.0)]
    assert flooded[1][2] - flooded[0][2] == pytest.approx(60.0)
    row = int(np.searchsorted(moves.ends, flooded[0][2] + 1e-9)) - 1
    np.testing.assert_allclose(np.append(moves.places[row], moves.turns[row, :3]), ASIDE, atol=1e-6)
    np.testing.assert_allclose(np.append(moves.places[-1], moves.turns[-1, :3]), CELL.robot.home, atol=1e-6)
    assert not any(made.execution.signals.values())


def test_a_dry_run_visits_the_stations_and_switches_nothing_on(proof: Proof) -> None:
    assert changes(proof.dry) == []
    assert len(proof.dry.execution.moves.begins) == len(proof.printing.execution.moves.begins)
    # The dry run waits nowhere, the print 2.5 s over the cup and 60 s aside.
    waits = [
        each.execution.seconds - float((each.execution.moves.ends - each.execution.moves.begins).sum())
        for each in (proof.dry, proof.printing)
    ]
    assert waits == pytest.approx([0.0, 62.5], abs=1e-6)


@pytest.mark.parametrize(("seconds", "written"), [(0.0, "0.100"), (0.0999, "0.100"), (0.101, "0.101"), (1.5, "1.500")])
def test_a_joint_move_that_takes_no_time_is_given_a_tenth_of_a_second(seconds: float, written: str) -> None:
    usual = orders()
    wanted = replace(
        usual,
        times=usual.times - usual.there + seconds,
        duration=usual.duration - usual.there - usual.back + 2 * seconds,
    )
    tips = tips_of(stream())
    program, _ = proven_program(
        wanted, cell=CELL, placement=PLACEMENT, surface_within=0.21,
        tips_at=lambda moments: tips(moments + usual.there - seconds), part_name="rings", spacing=2.0,
    )  # fmt: skip
    text = dict(program.modules)["GeoCell.mod"]
    assert re.findall(r"num nGeo(There|Back):=([\d.]+);", text) == [("There", written), ("Back", written)]


def test_configurations_are_followed_and_the_tip_stays_below_250_mm_s_before_anything_moves() -> None:
    program, _ = proven_program(
        orders(), cell=CELL, placement=PLACEMENT, surface_within=0.21, tips_at=tips_of(stream()), part_name="rings",
        spacing=2.0,
    )  # fmt: skip
    guard = dict(program.modules)["GeoGuard.mod"]
    begin = guard[guard.index("PROC GeoBegin(") : guard.index("PROC GeoKeeper(")]
    lines = [line.strip() for line in begin.splitlines()]
    first_move = next(number for number, line in enumerate(lines) if "Move" in line)
    for setting in ("ConfJ\\On;", "ConfL\\On;", "SingArea\\Off;", "PDispOff;", "EOffsOff;", "VelSet 100,250;"):
        assert setting in lines[:first_move]
    assert "VelSet geoPct,250;" in lines[first_move:]
    assert "\\Off;" not in guard.replace("SingArea\\Off;", "")
