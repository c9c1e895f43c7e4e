"""Angles of paths to lines and axes, on plates where both are known by construction."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.geometry import closest
from geoprint.metrics import fibre_angles
from geoprint.model import FloatArray, FollowedLines, Surface, SurfaceCurves
from tests.meshes import plate

PLATE = plate((20.0, 20.0), (10, 10))


def _lines(angle_deg: float, *, axes: bool) -> FollowedLines:
    """Return lines at an angle to the x axis, and the axes x and y between which it counts."""
    count, angle = len(PLATE.faces), np.radians(angle_deg)
    along = np.tile([np.cos(angle), np.sin(angle), 0.0], (count, 1))
    frame = np.tile(np.eye(3)[:2], (count, 1, 1)) if axes else None
    return FollowedLines(along, np.zeros((0, 3)), np.zeros(0), frame)


def _paths(surface: Surface, *rows: tuple[float, float]) -> SurfaceCurves:
    """Return straight paths through the middle, each at an angle [degrees] and of a length [mm], with both senses."""
    corners: list[FloatArray] = []
    for number, (angle_deg, length) in enumerate(rows):
        angle = np.radians(angle_deg + 180.0 * (number % 2))
        half = 0.5 * length * np.array([np.cos(angle), np.sin(angle), 0.0])
        corners.append(np.linspace(-half, half, 7) + np.array([10.0, 10.0, 0.0]))
    points, _ = closest(surface, np.concatenate(corners))
    return SurfaceCurves(points, 7 * np.arange(len(rows) + 1), np.zeros(len(rows), dtype=np.bool_))


def test_paths_along_their_lines_are_off_by_nothing_and_have_their_helix_angle() -> None:
    found = fibre_angles(PLATE, _paths(PLATE, (-60.0, 10.0), (-60.0, 6.0)), _lines(-60.0, axes=True))
    assert found.off == pytest.approx(0.0, abs=1e-6)
    assert found.helix is not None
    assert np.degrees(found.helix) == pytest.approx(-60.0)


def test_angles_are_means_by_length_and_neither_sense_nor_a_right_angle_breaks_them() -> None:
    # Angles of lines have no beginning: 88 and 94 degrees are six apart, and their mean is no level line.
    found = fibre_angles(PLATE, _paths(PLATE, (88.0, 5.0), (94.0, 10.0)), _lines(90.0, axes=True))
    assert np.degrees(found.off) == pytest.approx((2.0 * 5.0 + 4.0 * 10.0) / 15.0)
    assert np.degrees(found.most_off) == pytest.approx(4.0)
    assert found.helix is not None
    assert found.spread is not None
    assert np.degrees(found.helix) % 180.0 == pytest.approx(92.0)
    assert np.degrees(found.spread[1] - found.spread[0]) == pytest.approx(6.0)


def test_lines_without_an_axis_have_no_helix_angle() -> None:
    found = fibre_angles(PLATE, _paths(PLATE, (30.0, 8.0)), _lines(20.0, axes=False))
    assert np.degrees(found.off) == pytest.approx(10.0)
    assert found.helix is None
    assert found.spread is None
