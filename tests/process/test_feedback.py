"""Feedback: what is significant is taken out, within bounds; noise alone changes nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.model import FloatArray
from geoprint.process.feedback import Correction, FlowBounds, MeasuredRuns, corrected

BOUNDS = FlowBounds(0.5, 1.5, 2.0, 2.0)
RUNS, PARTS, LENGTH, DEVIATION = 8, 12, 4.0, 0.04


def measured(
    shares: FloatArray | float, *, seed: int = 0, deviation: float = DEVIATION, common: float = 0.0
) -> MeasuredRuns:
    """Return parts of runs that were measured as well as they say."""
    random = np.random.default_rng(seed)
    count = RUNS * PARTS
    starts: FloatArray = np.tile(np.linspace(0.0, (PARTS - 1) * LENGTH, PARTS), RUNS)
    noise = deviation * random.standard_normal(count) + common * random.standard_normal()
    return MeasuredRuns(
        runs=np.repeat(np.arange(RUNS), PARTS),
        starts=starts,
        ends=starts + LENGTH,
        seen=np.ones(count, dtype=np.bool_),
        ratios=np.maximum(np.broadcast_to(shares, count) + noise, 0.0),
        deviations=np.full(count, deviation),
        factors=np.ones(count),
        deposited=np.ones(count),
        common=common,
    )


def commanded(print_: MeasuredRuns, factor: float) -> MeasuredRuns:
    """Return a print of a program that was told to deposit so much more everywhere, and does."""
    return replace(print_, factors=np.full(RUNS * PARTS, factor), deposited=np.full(RUNS * PARTS, factor))


def names(found: Correction) -> set[str]:
    return {change.name for change in found.changes}


def test_a_perfect_print_changes_nothing_a_hundred_times() -> None:
    for seed in range(100):
        found = corrected(measured(1.0, seed=seed, common=0.02), bounds=BOUNDS)
        assert found.changes == ()
        assert (found.factors == 1.0).all()
        assert (found.opening, found.shutting) == (0.0, 0.0)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_print_off_by_twice_the_uncertainty_of_its_parts_changes_something(sign: float) -> None:
    changed = [
        corrected(measured(1.0 + 2.0 * sign * DEVIATION, seed=seed, common=0.005), bounds=BOUNDS).changes != ()
        for seed in range(100)
    ]
    assert sum(changed) >= 90


def test_a_share_that_all_runs_lack_is_commanded_on_top() -> None:
    found = corrected(measured(0.8), bounds=BOUNDS)
    assert names(found) == {"constant"}
    assert found.factors == pytest.approx(1.25, rel=0.02)
    assert found.changes[0].most == pytest.approx(0.8, rel=0.02)
    assert found.expected < 0.2 * found.found


def test_an_error_that_a_scan_cannot_tell_from_its_own_height_changes_nothing() -> None:
    assert corrected(measured(0.92, common=0.08), bounds=BOUNDS).changes == ()


def test_a_drift_over_the_print_is_followed() -> None:
    shares = np.linspace(1.0, 0.7, RUNS * PARTS)
    found = corrected(measured(shares), bounds=BOUNDS)
    assert "drift" in names(found)
    assert np.sqrt(np.mean((found.factors * shares - 1.0) ** 2)) < 0.03


def test_what_differs_along_each_run_is_followed_smoothly() -> None:
    shares = np.tile(1.0 + 0.2 * np.sin(np.arange(PARTS) / PARTS * 2.0 * np.pi), RUNS)
    found = corrected(measured(shares, deviation=0.02), bounds=BOUNDS)
    assert np.sqrt(np.mean((found.factors * shares - 1.0) ** 2)) < 0.04
    assert np.abs(np.diff(found.factors)).max() < 0.2


def test_lags_of_the_valve_are_told_from_the_flow() -> None:
    shares = np.ones((RUNS, PARTS))
    shares[:, 0] -= 0.8 / LENGTH
    shares[:, -1] += 0.4 / LENGTH
    found = corrected(measured(shares.ravel(), deviation=0.02), bounds=BOUNDS)
    assert names(found) == {"opening", "shutting"}
    assert found.opening == pytest.approx(0.8, abs=0.15)
    assert found.shutting == pytest.approx(0.4, abs=0.1)
    assert (found.factors == 1.0).all()


def test_a_second_correction_stands_on_the_first() -> None:
    first = commanded(measured(0.96, deviation=0.01), 1.25)
    again = corrected(replace(first, opened=0.3), bounds=BOUNDS)
    assert again.factors == pytest.approx(1.25 / 0.96, rel=0.01)
    assert again.opening == 0.3
    kept = corrected(commanded(measured(1.0), 1.25), bounds=BOUNDS)
    assert kept.changes == ()
    assert (kept.factors == 1.25).all()


def test_what_the_program_itself_deposits_is_no_error_of_the_material() -> None:
    # A valve let 1.6 times the volume of run 3 through, because the arm was slow there: its program says so.
    program = np.where(np.repeat(np.arange(RUNS), PARTS) == 3, 1.6, 1.0)
    as_programmed = replace(measured(program), deposited=program)
    found = corrected(as_programmed, bounds=BOUNDS)
    assert found.changes == ()
    assert (found.factors == 1.0).all()
    assert found.found == pytest.approx(DEVIATION, rel=0.15)
    thin = corrected(replace(measured(0.8 * program), deposited=program), bounds=BOUNDS)
    assert names(thin) == {"constant"}
    assert thin.factors == pytest.approx(1.25, rel=0.02)


def test_a_valve_gets_one_flow_by_which_the_whole_volume_is_right() -> None:
    shares = np.linspace(1.0, 0.7, RUNS * PARTS)
    found = corrected(measured(shares, deviation=0.01), bounds=replace(BOUNDS, even=True))
    assert np.ptp(found.factors) == 0.0
    assert float((found.factors * shares).mean()) == pytest.approx(1.0, abs=0.01)


def test_scatter_of_a_print_is_left_alone_because_the_next_one_has_its_own() -> None:
    for seed in range(20):
        scatter = 1.0 + 0.1 * np.random.default_rng([seed, 1]).standard_normal(RUNS * PARTS)
        assert corrected(measured(scatter, seed=seed), bounds=BOUNDS).changes == ()


def test_of_what_is_known_beside_the_rest_alone_the_whole_is_left_as_it_was() -> None:
    drift = np.linspace(1.2, 0.8, RUNS * PARTS)
    sure, unsure = (
        corrected(replace(measured(0.7 * drift), common=0.5, scale=scale), bounds=BOUNDS) for scale in (0.0, 0.2)
    )
    assert names(sure) == names(unsure) == {"drift"}
    left = sure.factors * drift
    assert float(left.std() / left.mean()) < 0.03
    # How much there is in all nobody knows.
    assert float(sure.factors.mean()) == pytest.approx(1.0, abs=0.1)
    assert unsure.expected > sure.expected + 0.002


def test_bounds_hold_the_flow_and_are_told() -> None:
    found = corrected(measured(0.5), bounds=BOUNDS)
    assert (found.factors <= 1.5).all()
    assert found.bounded == RUNS * PARTS
    # A third more was needed than the bound lets through.
    assert found.expected == pytest.approx(np.log(2.0 / 1.5), abs=0.05)


def test_gaps_and_what_is_not_seen_change_no_flow() -> None:
    whole = measured(1.0)
    ratios, seen = whole.ratios.copy(), whole.seen.copy()
    ratios[5], seen[7], ratios[7] = 0.1, False, 0.0
    found = corrected(replace(whole, ratios=ratios, seen=seen), bounds=BOUNDS)
    assert found.changes == ()
    assert found.gaps == 1


def test_between_parts_the_flow_is_straight_and_of_other_runs_as_wanted() -> None:
    found = corrected(measured(np.linspace(1.0, 0.7, RUNS * PARTS)), bounds=BOUNDS)
    middle = found.at(np.array([0, 0, 99]), np.array([LENGTH, -1.0, 3.0]))
    assert middle == pytest.approx([found.factors[:2].mean(), found.factors[0], 1.0])


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"factors": np.zeros(RUNS * PARTS)}, "positive"),
        ({"common": -0.1}, "not negative"),
        ({"runs": np.tile(np.arange(PARTS), RUNS)}, "run after run"),
        ({"ends": np.zeros(RUNS * PARTS)}, "from its start"),
        ({"ratios": np.full(RUNS * PARTS, np.nan)}, "finite"),
    ],
)
def test_what_cannot_have_been_measured_is_refused(wrong: dict[str, FloatArray], said: str) -> None:
    with pytest.raises(InputError, match=said):
        replace(measured(1.0), **wrong)


@pytest.mark.parametrize("wrong", [(0.0, 1.5, 1.0, 1.0), (0.5, 0.9, 1.0, 1.0), (0.5, 1.5, -1.0, 1.0)])
def test_bounds_that_leave_no_flow_as_wanted_are_refused(wrong: tuple[float, float, float, float]) -> None:
    with pytest.raises(InputError, match="bounds of a flow must enclose 1"):
        FlowBounds(*wrong)
