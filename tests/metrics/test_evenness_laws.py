"""Evenness is of the paths and the part, and not of how they are written down: laws that each figure keeps."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from benchmarks.paths.invariance import CHANGES, Change, Paths, cut, measured
from geoprint.metrics import Covering, Uniformity
from tests.meshes import plate, spherical_cap
from tests.metrics.deposits import circle, rectangle_line, straight_line

# 0.02 points, and 0.1 where the surface is another one.
SAME, SAME_REFINED = 2e-4, 1e-3


def _rows() -> Paths:
    heights = np.cumsum([1.0, 2.0, 2.3, 1.8, 2.0, 1.2, 2.6, 2.0]).tolist()
    return Paths(
        plate((30.0, 16.0), (20, 11), jitter_seed=1),
        tuple(straight_line((0.0, y), (30.0, y), points=61) for y in heights), 2.0,
    )  # fmt: skip


def _contours() -> Paths:
    lines = [rectangle_line((d, d), (30.0 - d, 18.0 - d)) for d in (1.0, 3.0, 5.0, 7.0)]
    return Paths(plate((30.0, 18.0), (20, 12), jitter_seed=2), tuple(lines), 2.0)


def _rings() -> Paths:
    polar = [0.95, 0.88, 0.80, 0.74]
    lines = [circle(20.0 * np.sin(a), height=20.0 * np.cos(a), points=121) for a in polar]
    return Paths(spherical_cap(radius=20.0, angle=1.0, rings=20), tuple(lines), 1.5)


KINDS = {"rows": _rows, "contours": _contours, "rings": _rings}


@cache
def plain(kind: str) -> Uniformity:
    return measured(KINDS[kind]())


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
@pytest.mark.parametrize("kind", KINDS)
def test_headline_coverage_and_verdict_stay_however_paths_and_part_are_written(kind: str, change: Change) -> None:
    before, after = plain(kind), measured(change(KINDS[kind]()))
    assert after.thickness.cv == pytest.approx(before.thickness.cv, abs=SAME)
    assert after.followed.cv == pytest.approx(before.followed.cv, abs=SAME)
    assert after.gap == pytest.approx(before.gap, abs=SAME)
    assert after.overlap == pytest.approx(before.overlap, abs=SAME)
    assert covers(after) == covers(before)


@pytest.mark.parametrize("kind", ["rows", "contours"])
def test_a_finer_mesh_of_the_same_part_changes_little(kind: str) -> None:
    coarse = KINDS[kind]()
    width, height = (30.0, 16.0) if kind == "rows" else (30.0, 18.0)
    found = measured(coarse._replace(part=plate((width, height), (61, 37))))
    assert found.thickness.cv == pytest.approx(plain(kind).thickness.cv, abs=SAME_REFINED)
    assert found.gap == pytest.approx(plain(kind).gap, abs=SAME_REFINED)
    assert found.overlap == pytest.approx(plain(kind).overlap, abs=SAME_REFINED)


def test_rows_cut_into_runs_that_touch_cover_nothing_twice() -> None:
    rows = Paths(
        plate((30.0, 8.0), (15, 4)),
        tuple(straight_line((0.0, y), (30.0, y), points=61) for y in (1.0, 3.0, 5.0, 7.0)),
        2.0,
    )
    pieces = cut(rows)
    # One piece of a fiftieth of a spacing, whose both ends lie near those of its neighbours.
    first, rest = rows.lines[0], rows.lines[1:]
    short = [first[0] + np.array([x, 0.0, 0.0]) for x in (0.0, 10.0, 10.04, 30.0)]
    splinter = rows._replace(lines=(*(np.array([a, b]) for a, b in pairwise(short)), *rest))
    for some, count in ((pieces, 12), (splinter, 6)):
        found = measured(some)
        assert (found.run_count, found.overlap) == (count, pytest.approx(0.0, abs=1e-9))
        assert found.gap == pytest.approx(0.0, abs=1e-9)


def covers(found: Uniformity) -> bool:
    return Covering(found.gap, found.overlap, found.thickness.cv).covers
