"""What a plan deposits: no volume is lost, the section is a parabola, and slopes are those of the height."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.inspection.scan_target import PlannedDeposit
from geoprint.model import FloatArray
from tests.inspection.drawn import rows_on_plate, stream
from tests.inspection.prints import DEPOSIT, FLOW, HEIGHT, POSES, SPACING

UP = np.array([0.0, 0.0, 1.0])


def grid(step: float) -> FloatArray:
    x, y = np.meshgrid(np.arange(0.0, 42.0, step), np.arange(0.0, 32.0, step))
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])


def ups(places: FloatArray) -> FloatArray:
    return np.broadcast_to(UP, places.shape).copy()


@pytest.mark.parametrize("spread", [0.6, 1.0, 1.7])
def test_the_height_holds_the_volume_however_wide_the_beads(spread: float) -> None:
    places = grid(0.15)
    found = DEPOSIT.at(places, ups(places), spread=spread).heights[:, 0]
    assert float(found.sum()) * 0.15**2 == pytest.approx(6 * 30.0 * FLOW, rel=0.01)
    assert pytest.approx(6 * 30.0 * FLOW, rel=1e-6) == DEPOSIT.volume


def test_a_bead_is_a_parabola_as_wide_as_its_flow_over_the_height() -> None:
    wide = FLOW / HEIGHT
    assert pytest.approx(wide) == DEPOSIT.width
    away = np.linspace(0.0, 0.45 * wide, 10)
    places = np.column_stack([np.full(10, 20.0), 5.0 + away, np.zeros(10)])
    high = 1.5 * HEIGHT * (1.0 - (away / (0.5 * wide)) ** 2)
    assert DEPOSIT.at(places, ups(places)).heights[:, 0] == pytest.approx(high, abs=1e-6)


def test_where_beads_meet_the_valley_is_as_deep_as_parabolas_make_it() -> None:
    # Wide beads that just touch their neighbours, and those that run over one another by a tenth.
    wide = SPACING * HEIGHT / FLOW
    for spread in (wide, 1.1 * wide):
        radius = 0.5 * spread * DEPOSIT.width
        away = np.array([0.0, 0.4, 0.5]) * SPACING
        places = np.column_stack([np.full(3, 20.0), 9.0 + away, np.zeros(3)])
        tops = [np.maximum(1.0 - ((away - middle) / radius) ** 2, 0.0) for middle in (0.0, SPACING)]
        high = 0.75 * FLOW / radius * np.sum(tops, axis=0)
        assert DEPOSIT.at(places, ups(places), spread=spread).heights[:, 0] == pytest.approx(high, abs=1e-6)


def test_the_stretches_of_a_ring_have_its_own_mean_radius_and_not_that_of_its_tangents() -> None:
    angles, radius = np.linspace(0.0, 2.0 * np.pi, 721), 5.0
    ring = radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(721)])
    runs = PlannedDeposit(stream([ring], flow=FLOW), spacing=SPACING, height=HEIGHT).runs
    sizes = np.linalg.norm(runs.places, axis=1)
    half = 0.5 * runs.lengths / radius
    assert sizes == pytest.approx(radius * np.sin(half) / half, abs=1e-4)
    assert (radius - sizes).min() > 1e-3


def test_slopes_and_changes_are_differences_of_the_height() -> None:
    random = np.random.default_rng(2)
    places = np.column_stack([random.uniform(8.0, 32.0, 200), random.uniform(6.0, 24.0, 200), np.zeros(200)])
    found, step = DEPOSIT.at(places, ups(places)), 1e-3
    for axis in range(2):
        aside = np.eye(3)[axis] * step
        more, less = (DEPOSIT.at(places + s * aside, ups(places)).heights[:, 0] for s in (1.0, -1.0))
        assert np.median(np.abs((more - less) / (2.0 * step) - found.slopes[:, 0, axis])) < 1e-3
    wider = DEPOSIT.at(places, ups(places), spread=float(np.exp(0.02))).heights[:, 0]
    assert np.median(np.abs((wider - found.heights[:, 0]) / 0.02 - found.heights[:, 1])) < 0.02
    beside = DEPOSIT.at(places, ups(places), offset=0.01).heights[:, 0]
    assert np.median(np.abs((beside - found.heights[:, 0]) / 0.01 - found.heights[:, 2])) < 0.02


def test_parts_of_runs_are_about_two_spacings_long_and_of_one_run_each() -> None:
    runs, parts = DEPOSIT.runs, DEPOSIT.parts
    lengths = np.bincount(parts, runs.lengths)
    assert lengths.min() >= 2.0 * SPACING - runs.lengths.max()
    assert lengths.max() < 4.0 * SPACING
    assert all(np.unique(runs.runs[parts == part]).size == 1 for part in np.unique(parts))
    assert np.array_equal(np.unique(parts), np.arange(int(parts.max()) + 1))


def test_however_long_a_plan_is_its_parts_are_bounded() -> None:
    rows = rows_on_plate(spacing=0.02, count=400, length=6.0)
    many = PlannedDeposit(stream(rows, flow=0.01), spacing=0.05, height=0.2)
    assert many.parts.max() < 2000 + 400
    assert POSES.count == 6 * 31
