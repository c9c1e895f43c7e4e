"""Paths are measured to both sides, and those of whole levels outwards as well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.metrics import uniformity
from geoprint.metrics.levels import levelled
from geoprint.model import PoseStream
from tests.meshes import plate
from tests.metrics.deposits import deposited, straight_line

SURFACE = plate((40.0, 20.0), (40, 20), jitter_seed=1)
ROWS = (3.0, 5.0, 7.4, 9.0, 11.0)


def serpentine(rows: tuple[float, ...] = ROWS) -> PoseStream:
    """Return one run that goes to and fro along rows of a plate, joined at their ends; the row is the level."""
    ends = [((4.0, y), (36.0, y)) if index % 2 == 0 else ((36.0, y), (4.0, y)) for index, y in enumerate(rows)]
    lines = [straight_line(start, end, points=129) for start, end in ends]
    whole = deposited([np.concatenate(lines)], [0])
    return replace(whole, levels=np.repeat(np.arange(len(rows)), 129))


def test_a_run_through_several_levels_has_none_and_runs_of_one_level_each_have() -> None:
    lines = [straight_line((4.0, y), (36.0, y)) for y in ROWS]
    assert levelled(deposited(lines, range(len(ROWS))))
    assert not levelled(serpentine())


def test_rows_joined_to_one_run_are_measured_to_both_sides() -> None:
    found = uniformity(serpentine(), SURFACE, spacing=2.0)
    assert found.levels is None
    places, ratios = found.sides.places, found.sides.sides()
    inside = (places[:, 0] > 8.0) & (places[:, 0] < 32.0)
    for row, near in ((0, {1.0}), (1, {1.0, 1.2}), (2, {1.2, 0.8}), (3, {0.8, 1.0}), (4, {1.0})):
        here = ratios[inside & (np.abs(places[:, 1] - ROWS[row]) < 1e-6)]
        assert set(here[np.isfinite(here)].round(3).tolist()) == near


def test_whole_levels_are_measured_outwards_too() -> None:
    lines = [straight_line((4.0, y), (36.0, y)) for y in ROWS]
    found = uniformity(deposited(lines, range(len(ROWS))), SURFACE, spacing=2.0)
    levels = found.levels
    assert levels is not None
    assert [levels.ratios[levels.levels == level].mean() for level in (1, 2, 3, 4)] == pytest.approx(
        [1.0, 1.2, 0.8, 1.0]
    )
    assert levels.bounded == 0.0
