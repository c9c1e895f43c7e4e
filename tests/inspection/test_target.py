"""What a scan is laid onto, and the pieces that means over it are taken of."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.geometry import face_areas
from geoprint.inspection.scan_target import ScanTarget, even_pieces
from geoprint.model import Surface, SurfacePoints
from tests.inspection.prints import DEPOSIT, PLATE

TRIANGLE = Surface(vertices=np.array([[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [1.0, 4.0, 0.0]]), faces=np.array([[0, 1, 2]]))


def second_moment(count: int) -> float:
    pieces, sizes = even_pieces(face_areas(TRIANGLE), count)
    return float(sizes @ pieces.xyz(TRIANGLE)[:, 0] ** 2)


@pytest.mark.parametrize("count", [1, 7, 400])
def test_pieces_have_the_area_and_the_middle_of_what_they_are_cut_of(count: int) -> None:
    for surface in (TRIANGLE, PLATE):
        areas = face_areas(surface)
        pieces, sizes = even_pieces(areas, count)
        middles = surface.vertices[surface.faces].mean(axis=1)
        assert np.bincount(pieces.faces, sizes) == pytest.approx(areas)
        assert sizes @ pieces.xyz(surface) == pytest.approx(areas @ middles)


def test_the_error_of_a_mean_over_pieces_falls_with_their_area() -> None:
    # Of x^2 over a triangle: area / 6 times the sum of the products of the corners' x.
    exact = 12.0 / 6.0 * (0.0 + 36.0 + 1.0 + 0.0 + 0.0 + 6.0)
    off = [abs(second_moment(count) - exact) for count in (16, 64, 256)]
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.02)
    assert off[1] / off[2] == pytest.approx(4.0, rel=0.02)


def test_over_given_feet_a_target_has_the_deposit_itself() -> None:
    feet = SurfacePoints(np.array([3, 40, 200]), np.array([[0.2, 0.3, 0.5], [1.0, 0.0, 0.0], [0.1, 0.8, 0.1]]))
    target = ScanTarget(PLATE, DEPOSIT, spread=1.2, offset=0.1, below=feet)
    assert target.places == pytest.approx(feet.xyz(PLATE))
    expected = DEPOSIT.at(target.places, target.normals, spread=1.2, offset=0.1).heights
    assert target.material.heights == pytest.approx(expected)
    assert target.nearest(target.places + 0.01)[1].tolist() == [0, 1, 2]
