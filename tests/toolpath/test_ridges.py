"""Ridges: strands that face each other are found on both sides, and a ridge goes on beyond the tip of a level."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance import BACKENDS
from geoprint.geometry import boundary_seed
from geoprint.model import Surface
from geoprint.toolpath.medial_axis import InnerNeighbours, Strands, middles, neighbours, ridges, strands_of, stretches
from tests.meshes import annulus, plate


def found_on(surface: Surface, *, spacing: float) -> tuple[Strands, InnerNeighbours]:
    contours = BACKENDS["fast-marching"](surface).contours(boundary_seed(surface), spacing=spacing)
    strands = strands_of(surface, contours)
    return strands, neighbours(strands)


def test_the_ridge_of_a_ring_is_one_circle_seen_from_one_side() -> None:
    ring = annulus(inner=10.0, outer=16.8, divisions=(180, 28))
    strands, beside = found_on(ring, spacing=1.0)
    innermost = strands.levels == 2
    assert beside.on_ridge[innermost].mean() > 0.99
    assert not beside.on_ridge[~innermost].any()
    np.testing.assert_allclose(beside.half[innermost & beside.on_ridge], 0.9, atol=0.02)
    # Inside of every other sample lies the next level.
    assert (strands.levels[beside.inside[strands.levels < 2]] == strands.levels[strands.levels < 2] + 1).all()
    (ridge,) = ridges(strands, beside)
    line = middles(ridge, strands.places, beside)
    np.testing.assert_allclose(np.linalg.norm(line, axis=1), 13.4, atol=0.02)
    assert np.unique(strands.strand[ridge]).size == 1


def test_inwards_is_towards_larger_distance_on_either_rim() -> None:
    ring = annulus(inner=10.0, outer=16.8, divisions=(180, 28))
    strands, _ = found_on(ring, spacing=1.0)
    radii = np.linalg.norm(strands.places, axis=1)
    outwards = np.einsum("kx,kx->k", strands.inward, strands.places) / radii
    np.testing.assert_allclose(outwards, np.where(radii < 13.4, 1.0, -1.0), atol=1e-3)


def test_a_ridge_of_a_rectangle_runs_between_its_ends_and_not_into_its_corners() -> None:
    table = plate((30.0, 7.4), (90, 22))
    strands, beside = found_on(table, spacing=1.0)
    lines = [middles(ridge, strands.places, beside) for ridge in ridges(strands, beside)]
    longest = max(lines, key=len)
    # On the middle line, between the ends of the roof 3.7 mm from either side.
    np.testing.assert_allclose(longest[:, 1], 3.7, atol=0.05)
    assert longest[:, 0].min() == pytest.approx(3.7, abs=0.8)
    assert longest[:, 0].max() == pytest.approx(26.3, abs=0.8)


@pytest.mark.parametrize(
    ("chosen", "ends", "expected"),
    [
        ("0110", "open", [[1, 2]]),
        ("1011", "open", [[0], [2, 3]]),
        ("1011", "closed", [[2, 3, 0]]),
        ("1111", "closed", [[0, 1, 2, 3]]),
        ("0000", "closed", []),
        ("", "open", []),
    ],
)
def test_stretches_are_unbroken_rows(chosen: str, ends: str, expected: list[list[int]]) -> None:
    found = stretches(np.array([each == "1" for each in chosen], dtype=bool), closed=ends == "closed")
    assert [each.tolist() for each in found] == expected
