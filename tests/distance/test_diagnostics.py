"""The slope of a field: known on a plate, broken on its diagonals, and reported by area."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance.interface import diagnostics
from geoprint.model import ScalarField
from tests.meshes import plate


def test_a_plane_of_slope_one_has_no_error_and_no_cut_locus() -> None:
    surface = plate((40.0, 30.0), (20, 15), jitter_seed=1)
    found = diagnostics(surface, ScalarField(surface.vertices[:, 0].copy()))
    assert found.mean_slope_error == pytest.approx(0.0, abs=1e-12)
    assert found.p95_slope_error == pytest.approx(0.0, abs=1e-12)
    assert found.cut_locus_share == 0.0


def test_a_slope_off_by_a_twentieth_is_reported_as_such() -> None:
    surface = plate((40.0, 30.0), (20, 15), jitter_seed=1)
    found = diagnostics(surface, ScalarField(1.05 * surface.vertices[:, 0]))
    assert found.mean_slope_error == pytest.approx(0.05)
    assert found.p95_slope_error == pytest.approx(0.05)


def test_triangles_over_the_ridge_between_two_edges_are_the_cut_locus() -> None:
    surface = plate((40.0, 30.0), (21, 15))
    x = surface.vertices[:, 0]
    found = diagnostics(surface, ScalarField(np.minimum(x, 40.0 - x)))
    assert found.cut_locus_share == pytest.approx(1 / 21, rel=1e-6)
    assert found.mean_slope_error == pytest.approx(0.0, abs=1e-12)
    flat = diagnostics(surface, ScalarField(np.ones(x.size)))
    assert flat.cut_locus_share == 1.0
    assert flat.mean_slope_error == pytest.approx(1.0)
