"""What a program commands in simulation is what lies there: by time or by length, as late as the dispenser is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.model import Dispensing, FloatArray
from geoprint.simulation import Break, DepositedBeads, Dispenser, Faults, dispensed_beads, heights
from geoprint.simulation.plant import let_through
from tests.meshes import plate

SPEED, FLOW, HEIGHT, STANDOFF = 20.0, 1.0, 0.5, 0.3
# A rate that lays the flow at the speed [mm3/s].
RATE = SPEED * FLOW
PLATE = plate((60.0, 20.0), (30, 10))


def straight(*, speeds: tuple[float, float] = (SPEED, SPEED), analog: bool = False, opens: float = 1.0) -> Dispensing:
    """Return a tip that travels 10 mm, lays 40 mm at two speeds, half of it each, and travels 5 mm."""
    places = np.array([5.0, 15.0, 35.0, 55.0, 60.0])
    ends = np.concatenate([[0.0], np.cumsum(np.diff(places) / np.array([10.0, *speeds, 10.0]))])
    times = np.unique(np.concatenate([np.arange(0.0, ends[-1], 0.001), ends]))
    x = np.interp(times, ends, places)
    deposited = (x >= 15.0) & (x < 55.0)
    return Dispensing(
        times=times,
        tips=np.column_stack([x, np.full(x.size, 10.0), np.full(x.size, STANDOFF)]),
        runs=np.zeros(times.size, dtype=np.int64),
        arcs=x - 15.0,
        wanted=np.where(deposited, FLOW, 0.0),
        valve_times=np.array([opens, float(ends[3])]),
        valve_open=np.array([True, False]),
        flow_times=np.array([0.9, float(ends[3]) + 0.1]) if analog else np.empty(0),
        flows=np.array([FLOW, 0.0]) if analog else np.empty(0),
    )


def deposited(program: Dispensing, dispenser: Dispenser | None = None, faults: Faults | None = None) -> DepositedBeads:
    return dispensed_beads(
        program, PLATE, dispenser or Dispenser(RATE), height=HEIGHT, faults=faults or Faults(),
        random=np.random.default_rng(0),
    )  # fmt: skip


def flow(beads: DepositedBeads, start: float, end: float) -> float:
    """Return the mean volume per length between two places of a run [mm3/mm]."""
    there = (beads.arcs >= start) & (beads.arcs < end)
    return float(beads.volumes[there].sum() / (end - start))


def filled(beads: DepositedBeads) -> FloatArray:
    return beads.arcs[beads.widths > 0.0]


def test_a_program_as_planned_lays_what_the_plan_asks_for() -> None:
    beads = deposited(straight())
    assert float(beads.volumes.sum()) == pytest.approx(40.0 * FLOW, rel=1e-9)
    assert flow(beads, 5.0, 35.0) == pytest.approx(FLOW, rel=1e-2)
    assert filled(beads)[[0, -1]] == pytest.approx([0.0, 40.0], abs=0.1)
    inner = (beads.arcs > 2.0) & (beads.arcs < 38.0)
    assert beads.widths[inner] == pytest.approx(FLOW / HEIGHT, rel=2e-3)
    assert np.abs(beads.places[:, 2]).max() < 1e-9


@pytest.mark.parametrize("analog", [False, True])
def test_a_tip_at_half_its_speed_lays_twice_as_much_where_the_valve_doses_by_time(*, analog: bool) -> None:
    beads = deposited(straight(speeds=(SPEED, SPEED / 2.0), analog=analog))
    assert flow(beads, 5.0, 15.0) == pytest.approx(FLOW, rel=1e-2)
    assert flow(beads, 25.0, 35.0) == pytest.approx(FLOW if analog else 2.0 * FLOW, rel=1e-2)
    wide = beads.widths[(beads.arcs > 25.0) & (beads.arcs < 35.0)]
    assert wide == pytest.approx(FLOW / HEIGHT * (1.0 if analog else np.sqrt(2.0)), rel=1e-3)


def test_material_begins_and_ends_as_late_as_the_dispenser_is() -> None:
    beads = deposited(straight(), Dispenser(RATE, opens=0.1, shuts=0.05))
    assert filled(beads)[0] == pytest.approx(2.0, abs=0.1)
    # It travels on at 10 mm/s for 0.05 s.
    assert filled(beads)[-1] == pytest.approx(40.5, abs=0.1)
    assert float(beads.volumes.sum()) == pytest.approx(RATE * (2.0 - 0.1 + 0.05), rel=1e-6)


@pytest.mark.parametrize("settles", [0.2, 1.0])
def test_a_flow_that_settles_rises_evenly(settles: float) -> None:
    program = straight()
    volume = np.cumsum(let_through(program, Dispenser(RATE, opens=0.1, settles=settles)))
    since = program.times - 1.1
    wanted = RATE * np.where(since < settles, np.maximum(since, 0.0) ** 2 / (2.0 * settles), since - settles / 2.0)
    until = program.times < float(program.valve_times[-1])
    np.testing.assert_allclose(volume[until], wanted[until], atol=0.01 * RATE * settles + 2e-3 * RATE)
    with pytest.raises(InputError, match="no negative lags"):
        Dispenser(RATE, settles=-0.1)


def test_a_flow_that_follows_late_is_missing_at_the_beginning() -> None:
    program = straight(analog=True)
    beads = deposited(program, Dispenser(RATE, follows=0.2))
    assert filled(beads)[0] == pytest.approx(2.0, abs=0.1)
    assert float(beads.volumes.sum()) == pytest.approx(38.0 * FLOW, rel=1e-3)


def test_a_valve_that_stays_open_lays_on_travel_too() -> None:
    program = straight()
    beads = deposited(replace(program, valve_times=program.valve_times[:1], valve_open=program.valve_open[:1]))
    assert filled(beads)[-1] == pytest.approx(45.0, abs=0.1)
    assert flow(beads, 41.0, 44.0) == pytest.approx(2.0 * FLOW, rel=2e-2)


def test_what_comes_while_the_tip_rests_lies_in_one_place_with_all_of_its_volume() -> None:
    program = straight()
    later = program.times > program.times[program.arcs <= 20.0][-1]
    beads = deposited(
        replace(
            program,
            times=program.times + np.where(later, 0.5, 0.0),
            valve_times=program.valve_times + np.array([0.0, 0.5]),
        )
    )
    assert float(beads.volumes.sum()) == pytest.approx(40.0 * FLOW + 0.5 * RATE, rel=1e-9)
    assert flow(beads, 19.0, 21.0) == pytest.approx(FLOW + 0.5 * RATE / 2.0, rel=5e-2)
    feet = np.column_stack([np.linspace(0.0, 60.0, 601), np.full(601, 10.0), np.zeros(601)])
    high = heights(beads, feet)
    assert feet[int(high.argmax()), 0] == pytest.approx(35.0, abs=0.5)


def test_faults_are_put_in_besides() -> None:
    faults = Faults(flow=1.2, viscosity=1.5, offset=0.4, breaks=(Break(0, 10.0, 14.0),))
    beads = deposited(straight(), faults=faults)
    assert float(beads.volumes.sum()) == pytest.approx(0.8 * 36.0 * FLOW, rel=1e-2)
    assert not beads.widths[(beads.arcs > 10.0) & (beads.arcs < 14.0)].any()
    assert beads.places[:, 1] == pytest.approx(10.4)


def test_what_lays_nothing_or_breaks_elsewhere_is_refused() -> None:
    program = straight()
    shut = replace(program, valve_times=np.empty(0), valve_open=np.empty(0, dtype=np.bool_))
    with pytest.raises(InputError, match="the program deposits nothing: its valve never opens"):
        deposited(shut)
    with pytest.raises(InputError, match="found run 3"):
        deposited(program, faults=Faults(breaks=(Break(3, 0.0, 1.0),)))
    with pytest.raises(InputError, match="no negative lags"):
        Dispenser(RATE, opens=-0.1)
