"""Contours as strokes: a row a level, and a spacing that is the same everywhere."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance import BACKENDS
from geoprint.errors import UsageError
from geoprint.geometry import boundary_seed
from geoprint.model import ScalarField
from geoprint.toolpath import PATTERNS
from tests.meshes import annulus


def test_a_stroke_is_a_level_curve_and_its_row_the_level() -> None:
    surface = annulus(inner=10.0, outer=24.0, divisions=(60, 20))
    backend, seed = BACKENDS["heat"](surface), boundary_seed(surface)
    contours = backend.contours(seed, spacing=2.0)
    strokes = PATTERNS["contours"]().strokes(surface, seed, backend=backend, spacing=2.0)
    np.testing.assert_array_equal(strokes.curves.points.weights, contours.curves.points.weights)
    np.testing.assert_array_equal(strokes.levels, contours.levels)
    assert strokes.row.size == strokes.curves.points.faces.size
    assert set(strokes.row.tolist()) == set(contours.levels.tolist())
    assert (strokes.spacing == 2.0).all()
    assert (strokes.width == 1.0).all()


def test_contours_refuse_a_spacing_that_differs_from_place_to_place() -> None:
    surface = annulus(inner=10.0, outer=24.0, divisions=(60, 20))
    field = ScalarField(np.full(len(surface.vertices), 2.0))
    with pytest.raises(UsageError, match="or choose the pattern fibres"):
        PATTERNS["contours"]().strokes(
            surface, boundary_seed(surface), backend=BACKENDS["heat"](surface), spacing=field
        )
