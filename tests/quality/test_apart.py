"""Paths whose runs go through several levels are measured to both sides, and those of whole levels outwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.model import PoseStream
from geoprint.quality import uniformity
from geoprint.quality.apart import levelled
from tests.meshes import plate
from tests.quality.deposits import deposited, straight_line

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


def test_rows_joined_to_one_run_are_measured_to_both_sides_at_the_level_of_each() -> None:
    found = uniformity(serpentine(), SURFACE, spacing=2.0)
    assert found.sides is not None
    assert found.spaced
    assert "left" in found.method
    assert found.offsets[0] == 0
    assert found.offsets[-1] == found.ratios.size == len(found.places)
    inside = (found.places[:, 0] > 8.0) & (found.places[:, 0] < 32.0)
    for level, ratios in ((0, {1.0}), (1, {1.0, 1.2}), (2, {1.2, 0.8}), (3, {0.8, 1.0}), (4, {1.0})):
        here = found.ratios[inside & (found.levels == level)]
        assert set(here.round(3).tolist()) == ratios
        np.testing.assert_allclose(found.places[inside & (found.levels == level), 1], ROWS[level], atol=1e-9)


def two_runs() -> PoseStream:
    """Return two such runs, each of two rows, of which the second begins 4 mm beside the end of the first."""
    rows = [
        straight_line((x, y), (40.0 - x, y), points=129) for x, y in ((4.0, 3.0), (36.0, 5.0), (4.0, 9.0), (36.0, 11.0))
    ]
    both = deposited([np.concatenate(rows[:2]), np.concatenate(rows[2:])], [0, 1])
    return replace(both, levels=np.repeat([0, 1, 2, 3], both.count // 4))


@pytest.mark.parametrize("stream", [serpentine(), two_runs()])
def test_samples_of_one_stretch_are_neighbours_and_stretches_are_few(stream: PoseStream) -> None:
    found = uniformity(stream, SURFACE, spacing=2.0)
    assert found.offsets.size <= 12
    for first, last in zip(found.offsets[:-1], found.offsets[1:], strict=True):
        steps = np.linalg.norm(np.diff(found.places[first:last], axis=0), axis=1)
        assert steps.max(initial=0.0) < 0.6


def test_whole_levels_are_measured_outwards_alone() -> None:
    lines = [straight_line((4.0, y), (36.0, y)) for y in ROWS]
    found = uniformity(deposited(lines, range(len(ROWS))), SURFACE, spacing=2.0)
    assert found.sides is None
    assert [found.ratios[found.levels == level].mean() for level in (1, 2, 3, 4)] == pytest.approx([1.0, 1.2, 0.8, 1.0])
