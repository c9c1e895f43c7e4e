"""The benchmark of feedback: a closed loop with a dispenser that errs in ways that the corrector does not know."""

from __future__ import annotations

from itertools import islice

import pytest

from benchmarks.feedback import silence
from benchmarks.parts.closed_loop import closed_loop, plant_of

# Lines of sight to either side, and places of a triangle by which the truth is found.
RAYS, SIDE = 130, 3


@pytest.mark.needs("open3d")
def test_one_corrected_print_leaves_less_than_half_of_the_error() -> None:
    first, second = islice(closed_loop(plant_of(0), seed=0, rays=RAYS, side=SIDE), 2)
    assert first.error > 0.2
    assert second.error < 0.5 * first.error
    assert {change.name for change in first.told.changes} >= {"opening"}


def test_noise_alone_changes_nothing_and_twice_the_uncertainty_of_parts_something() -> None:
    rows = [line.split("|")[1:-1] for line in silence(10)][2:]
    changed = {float(off): int(count) for off, _, count in rows}
    assert changed[0.0] == 0
    assert changed[2.0] >= 9
    assert changed[-2.0] >= 9
