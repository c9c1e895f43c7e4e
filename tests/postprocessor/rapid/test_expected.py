"""Where outputs must switch by the checker's own words: as the writer's, which share nothing with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import VerificationError
from geoprint.model import FloatArray, Signals
from geoprint.postprocessor import expected_events, expected_waits
from geoprint.postprocessor.orders import Event, Orders, TipsAt
from geoprint.postprocessor.switching import switching_events, waits
from tests.postprocessor.export_cases import CELL, orders, stream, tips_of

SPEED = 20.0
# Two valves, an output that follows, and a vacuum, with lags and without.
SIGNALS = {
    "valve": CELL.signals,
    "late valve": replace(CELL.signals, valve_open=0.04, valve_close=0.07),
    "lamp that stays on": replace(CELL.signals, uv_lead=0.08, uv_tail=0.08),
    "flow that settles": replace(CELL.signals, valve_open=0.02, valve_close=0.03, uv_tail=7.0, settle=0.1),
    "vacuum": replace(CELL.signals, valve_open=0.03, valve_close=0.08, uv_tail=0.02, vacuum="doVacuum"),
    "follows": replace(CELL.signals, mode="analog", flow="aoFlow", flow_per_mm3_s=0.2, valve_close=0.05),
}


def straight(pull: float, *, length: float = 10.0, wait: float = 0.0) -> tuple[Orders, TipsAt]:
    """Return a run of a length [mm] between a descent and a lift of a second each, and the motion of its tip.

    The tip begins and ends at rest with `pull` [mm/s2], up to 20 mm/s where the run is long enough. It stands still for
    `wait` [s] before it begins, which counts for the run.
    """
    tips = np.array([[0.0, 0.0, 5.0], [0.0, 0.0, 0.0], [length, 0.0, 0.0], [length, 0.0, 5.0]])
    top = min(SPEED, np.sqrt(pull * length))
    ramp = top / pull
    took = 2.0 * ramp + (length - top * ramp) / top
    times = np.array([1.0, 2.0, 2.0 + wait + took, 3.0 + wait + took])
    up = np.linspace(0.0, ramp, 400)
    when = np.concatenate([[1.0, 2.0], 2.0 + wait + up, 2.0 + wait + took - up[::-1], times[3:]])
    way = np.concatenate([[-5.0, 0.0], 0.5 * pull * up**2, length - 0.5 * pull * up[::-1] ** 2, [length + 5.0]])

    def tips_at(moments: FloatArray) -> FloatArray:
        s = np.interp(moments, when, way)
        along = np.clip(s, 0.0, length)
        return np.column_stack([along, np.zeros_like(s), np.maximum(-s, 0.0) + np.maximum(s - length, 0.0)])

    small = orders(stream(runs=1))
    return replace(
        small, poses=np.arange(4), tips=tips, quaternions=np.tile([0.0, 1.0, 0.0, 0.0], (4, 1)),
        joints=np.zeros((4, 6)), lifted_joints=np.zeros((4, 6)),
        zones=np.zeros(4), speeds=np.full(4, SPEED), runs=np.zeros(4, dtype=np.int64),
        deposited=np.array([False, True, False, False]), flow=np.array([0.0, 1.0, 0.0, 0.0]), times=times,
        duration=float(times[-1]) + 1.0,
    ), tips_at  # fmt: skip


def expected(plan: Orders, tips: TipsAt, signals: Signals = CELL.signals) -> dict[tuple[str, bool], Event]:
    found = expected_events(plan, signals=signals, tips_at=tips, speed=SPEED)
    return {(event.output, event.on): event for event in found}


@pytest.mark.parametrize("pull", [400.0, 1000.0])
def test_a_valve_waits_half_of_the_ramp_in_time_and_a_quarter_in_place(pull: float) -> None:
    # At v / (2 a) behind its start the tip is v^2 / (8 a) away.
    found = expected(*straight(pull))
    opens, shuts = found["dispenser", True], found["dispenser", False]
    assert (opens.target, opens.from_start, shuts.target, shuts.from_start) == (2, False, 2, False)
    assert 10.0 - opens.distance == pytest.approx(SPEED**2 / (8.0 * pull), rel=0.05)
    assert shuts.distance == pytest.approx(SPEED**2 / (8.0 * pull), rel=0.05)
    lit, dark = found["uv_lamp", True], found["uv_lamp", False]
    assert (lit.distance, dark.distance) == (opens.distance, shuts.distance)


def test_a_valve_waits_no_longer_than_a_millimetre_takes() -> None:
    # At 100 mm/s2 the half of the ramp would be 0.1 s: it waits 0.05 s, in which the tip goes 0.125 mm.
    found = expected(*straight(100.0))
    assert 10.0 - found["dispenser", True].distance == pytest.approx(0.5 * 100.0 * 0.05**2, abs=1e-4)


def test_in_a_run_too_short_for_the_speed_the_speed_of_the_print_counts() -> None:
    # 0.1 mm at 1000 mm/s2: 10 ms up to 10 mm/s, which leaves 0.05 mm of the 0.2 mm at 20 mm/s: 7.5 ms too much.
    found = expected(*straight(1000.0, length=0.1))
    assert 0.1 - found["dispenser", True].distance < 0.5 * 1000.0 * 0.0075**2 + 0.01


def test_where_the_flow_follows_it_begins_and_ends_with_the_deposit() -> None:
    found = expected(*straight(400.0), SIGNALS["follows"])
    assert found["dispenser", True] == Event(2, 0.0, from_start=True, output="dispenser", on=True)
    # 50 ms before the end at rest: a t^2 / 2.
    assert found["dispenser", False].distance == pytest.approx(0.5 * 400.0 * 0.05**2, abs=1e-3)


def test_a_flow_that_settles_flows_before_the_tip_moves_and_waits_for_no_ramp() -> None:
    plan, tips = straight(400.0)
    found = expected(plan, tips, replace(CELL.signals, settle=0.1))
    assert found["dispenser", True] == Event(1, 0.0, from_start=False, output="dispenser", on=True)
    assert found["uv_lamp", True] == Event(1, 0.0, from_start=False, output="uv_lamp", on=True)
    assert found["dispenser", False] == expected(plan, tips)["dispenser", False]
    np.testing.assert_array_equal(expected_waits(plan, replace(CELL.signals, settle=0.1)), [0.0, 0.1, 0.0, 0.0])


def test_a_flow_cannot_settle_where_the_tip_is_in_motion() -> None:
    poses = stream(lead=1.5)
    with pytest.raises(
        VerificationError, match=r"target 3: the arm has to wait there for 0.10 s, but the plan passes it"
    ):
        expected_events(orders(poses), signals=replace(CELL.signals, settle=0.1), tips_at=tips_of(poses), speed=SPEED)


@pytest.mark.parametrize("lead", [0.0, 1.5])
def test_the_arm_waits_for_the_lamp_at_the_lift_and_not_where_a_lead_ends(lead: float) -> None:
    poses = stream(runs=2, lifts=2, lead=lead)
    waiting = expected_waits(orders(poses), replace(CELL.signals, uv_tail=60.0))
    (row,) = np.flatnonzero(waiting)
    assert row == poses.count - 2
    assert poses.tips[row, 2] > 5.0


@pytest.mark.parametrize("signals", SIGNALS.values(), ids=SIGNALS)
@pytest.mark.parametrize("points", [6, 30])
@pytest.mark.parametrize("lead", [0.0, 1.5])
def test_writer_and_checker_agree_though_they_share_no_words(signals: Signals, points: int, lead: float) -> None:
    # A flow that settles does so at rest.
    poses = stream(runs=3, points=points, lifts=2, lead=lead if signals.settle == 0.0 else 0.0)
    plan, tips = orders(poses), tips_of(poses)
    np.testing.assert_array_equal(expected_waits(plan, signals), waits(plan, signals))
    written = switching_events(plan, signals=signals, tips_at=tips, speed=SPEED)
    found = expected_events(plan, signals=signals, tips_at=tips, speed=SPEED)

    def keys(events: tuple[Event, ...]) -> list[tuple[int, str, bool, bool]]:
        return sorted((each.target, each.output, each.on, each.from_start) for each in events)

    assert keys(found) == keys(written)
    for event in found:
        assert min(abs(event.distance - each.distance) for each in written if each.output == event.output) < 1e-6


# The last is still rising at the end of what is looked at of a ramp.
@pytest.mark.parametrize(("pull", "speed"), [(150.0, SPEED), (400.0, SPEED), (1000.0, SPEED), (44.0, 6.7)])
@pytest.mark.parametrize("length", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("wait", [0.0, 0.02])
def test_writer_and_checker_agree_on_ramps(pull: float, speed: float, length: float, wait: float) -> None:
    plan, tips = straight(pull, length=length, wait=wait)
    written = switching_events(plan, signals=CELL.signals, tips_at=tips, speed=speed)
    found = expected_events(plan, signals=CELL.signals, tips_at=tips, speed=speed)
    assert len(found) == len(written) == 4
    for one, other in zip(found, written, strict=True):
        assert (one.target, one.output, one.on) == (other.target, other.output, other.on)
        assert one.distance == pytest.approx(other.distance, abs=1e-6)


@pytest.mark.parametrize(
    ("lags", "reason"),
    [
        ({"valve_close": 5.0}, "would close before it opens"),
        ({"valve_open": 0.3}, "would open in the previous run"),
        ({"uv_lead": 0.2}, "longer than the first approach"),
        ({"uv_tail": 0.2}, "longer than the first approach or the last retract"),
    ],
)
def test_lags_without_motion_for_them_are_findings(lags: dict[str, float], reason: str) -> None:
    poses = stream(runs=3, points=30)
    with pytest.raises(VerificationError, match=reason):
        expected_events(orders(poses), signals=replace(CELL.signals, **lags), tips_at=tips_of(poses), speed=SPEED)
