"""The benchmark of feedback: a closed loop with a dispenser that errs in ways that the corrector does not know."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from benchmarks.prints.closed_loop import Measure, Mode, changed, closed_loop, deviations, plant_of
from benchmarks.prints.feedback import silence

# Lines of sight to either side, and places of a triangle by which the truth is found.
RAYS, SIDE = 130, 3


@pytest.mark.needs("open3d")
def test_one_corrected_print_leaves_less_than_half_of_the_error() -> None:
    first, second = islice(closed_loop(plant_of(0), seed=0, rays=RAYS, side=SIDE), 2)
    assert first.error > 0.2
    assert second.error < 0.5 * first.error
    assert {change.name for change in first.record.changes} >= {"opening"}


@pytest.mark.parametrize("mode", ["io", "analog"])
def test_two_corrected_prints_leave_a_third_of_what_runs_were_off(mode: Mode) -> None:
    first, second, third = deviations((mode,) * 3, seed=0)
    for off in (second, third):
        assert np.abs(off).max() < np.abs(first).max() / 3.0
        assert np.sqrt(np.mean(off**2)) < np.sqrt(np.mean(first**2)) / 3.0


def test_photographs_even_out_what_runs_have_beside_one_another() -> None:
    first, second = (1.0 + each for each in deviations(("analog", "analog"), seed=0, by="photograph"))
    assert np.std(second) / np.mean(second) < 0.7 * np.std(first) / np.mean(first)


@pytest.mark.parametrize("by", ["scan", "photograph"])
def test_a_print_as_its_program_deposits_it_changes_nothing(by: Measure) -> None:
    assert not any(changed(seed, mode="io", by=by) for seed in range(20))


def test_noise_alone_changes_nothing_and_twice_the_uncertainty_of_parts_something() -> None:
    rows = [line.split("|")[1:-1] for line in silence(10)][2:]
    changed = {float(off): int(count) for off, _, count in rows}
    assert changed[0.0] == 0
    assert changed[2.0] >= 9
    assert changed[-2.0] >= 9
