"""A synthetic cohort: the same heart for the same seed, another for another, each of one closed piece."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import DATA
from benchmarks.parts.hearts import APEX, BASE, MODES, at_apex, heart, site
from geoprint.geometry import prepare, signed_volume
from geoprint.geometry.files import load
from geoprint.model import Surface


@pytest.fixture(scope="module")
def template() -> Surface:
    return load(DATA / "heart.ply", unit="mm")


def test_a_seed_makes_one_heart_and_others_are_as_large_as_hearts_are(template: Surface) -> None:
    first, same, other = (heart(template, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(first.vertices, same.vertices)
    assert np.linalg.norm(first.vertices - other.vertices, axis=1).max() > 2.0
    for made in (first, other):
        assert 0.5 < signed_volume(made) / signed_volume(template) < 2.0
        prepared, report = prepare(made)  # which refuses what crosses itself
        assert report.crossings_checked
        assert len(prepared.faces) == len(template.faces)


def test_modes_move_the_template_by_millimetres(template: Surface) -> None:
    for mode in MODES:
        assert 1.0 < np.linalg.norm(mode(template.vertices), axis=1).max() < 12.0


def test_sites_lie_on_the_ventricles(template: Surface) -> None:
    rng = np.random.default_rng(0)
    assert all(site(template, rng)[2] < BASE for _ in range(20))


def test_hearts_are_aligned_at_the_apex(template: Surface) -> None:
    made = heart(template, np.random.default_rng(4))
    aligned = at_apex(made, template)
    assert np.linalg.norm(aligned.vertices - APEX, axis=1).min() < 1.0
    moved = aligned.vertices - made.vertices
    assert np.ptp(moved, axis=0) == pytest.approx([0.0] * 3, abs=1e-3)
