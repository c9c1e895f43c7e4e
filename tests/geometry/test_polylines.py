"""Distances to polylines, corners included."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.geometry import PolylineDistance
from geoprint.model import FloatArray


def brute_force(points: FloatArray, line: FloatArray) -> FloatArray:
    start, along = line[:-1], np.diff(line, axis=0)
    share = np.einsum("kij,ij->ki", points[:, None] - start, along) / np.einsum("ij,ij->i", along, along)
    nearest = start + np.clip(share, 0, 1)[..., None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)


@pytest.mark.parametrize("step", [0.3, 0.7, 5.0])
def test_the_distance_to_a_corner_is_not_that_to_a_cut_corner(step: float) -> None:
    line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    assert PolylineDistance([line], step=step)(np.array([[2.0, -1.0, 0.0]])) == pytest.approx(np.sqrt(2.0), abs=1e-12)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), step=st.floats(0.02, 0.2))
def test_distances_to_random_walks_are_exact(seed: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    line = np.cumsum(rng.normal(size=(12, 3)), axis=0)
    points = rng.uniform(-5.0, 5.0, size=(40, 3))
    np.testing.assert_allclose(PolylineDistance([line], step=step)(points), brute_force(points, line), atol=1e-12)
