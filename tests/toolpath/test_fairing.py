"""Runs without tremor: what trembles goes, what bends stays, and nothing leaves its place or the surface."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.geometry import PolylineDistance, closest, positions
from geoprint.model import FloatArray, SurfacePoints
from geoprint.toolpath.corners import faired
from tests.meshes import plate

SURFACE = plate((40.0, 30.0), (20, 15))


def faired_places(places: FloatArray, *, closed: bool = False, spacing: float = 1.0) -> FloatArray:
    points, _ = closest(SURFACE, places)
    (found,) = faired(SURFACE, [points], closed=[closed], spacing=spacing)
    return positions(SURFACE, found)


def circle(radius: float, *, tremor: float = 0.0, waves: int = 0) -> FloatArray:
    """Return a closed run about (20, 15) whose radius trembles by so much [mm] in so many waves."""
    turn = np.linspace(0.0, 2.0 * np.pi, 2 * max(waves, 200) + 1)
    at = radius + tremor * np.cos(waves * turn)
    return np.column_stack([20.0 + at * np.cos(turn), 15.0 + at * np.sin(turn), np.zeros(turn.size)])


def radii(places: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(places[:, :2] - [20.0, 15.0], axis=1))


def test_waves_as_short_as_an_edge_go_and_the_circle_stays() -> None:
    # 94 waves in 31.4 mm: a third of the spacing long, as a level curve trembles from edge to edge.
    shaken = circle(5.0, tremor=0.012, waves=94)
    assert np.ptp(radii(shaken)) > 0.023
    assert np.abs(radii(faired_places(shaken, closed=True)) - 5.0).max() < 0.0015


@pytest.mark.parametrize(("radius", "most"), [(1.0, 0.0016), (2.0, 0.0003), (5.0, 0.0002)])
def test_a_circle_is_left_by_far_less_than_it_bends(radius: float, most: float) -> None:
    # One window would shrink it by 0.02 / radius.
    assert np.abs(radii(faired_places(circle(radius), closed=True)) - radius).max() < most


def test_no_place_moves_by_more_than_a_fiftieth_of_the_spacing() -> None:
    saw = np.array([[5.0 + row / 3.0, 15.0 + 0.3 * (row % 2), 0.0] for row in range(61)])
    away = PolylineDistance([saw], step=0.2)(faired_places(saw))
    assert 0.01 < away.max() <= 0.02 + 1e-9


def test_an_open_run_keeps_its_ends_and_a_straight_one_all_of_it() -> None:
    line = np.column_stack([np.linspace(3.0, 9.0, 13), np.linspace(4.0, 12.0, 13), np.zeros(13)])
    found = faired_places(line)
    np.testing.assert_allclose(found[[0, -1]], line[[0, -1]], atol=1e-12)
    assert PolylineDistance([line], step=0.2)(found).max() < 1e-9


def test_a_closed_run_ends_where_it_starts() -> None:
    found = faired_places(circle(3.0), closed=True)
    np.testing.assert_array_equal(found[0], found[-1])
    # The window runs across the seam: the run is as round there as elsewhere.
    steps = np.diff(found, axis=0)
    angles = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs((np.diff(np.append(angles, angles[0])) + np.pi) % (2.0 * np.pi) - np.pi)
    assert np.ptp(turns) < 0.1 * turns.mean()


def test_runs_are_faired_each_by_itself() -> None:
    first, second = (closest(SURFACE, circle(radius))[0] for radius in (3.0, 6.0))
    both = faired(SURFACE, [first, second], closed=[True, True], spacing=1.0)
    for alone, together in zip((first, second), both, strict=True):
        (found,) = faired(SURFACE, [alone], closed=[True], spacing=1.0)
        np.testing.assert_array_equal(found.faces, together.faces)
        np.testing.assert_array_equal(found.weights, together.weights)
    assert faired(SURFACE, [], closed=[], spacing=1.0) == []


def test_the_smallest_run_is_still_a_run() -> None:
    short = np.array([[10.0, 10.0, 0.0], [10.1, 10.0, 0.0]])
    points, _ = closest(SURFACE, short)
    (found,) = faired(SURFACE, [points], closed=[False], spacing=1.0)
    assert isinstance(found, SurfacePoints)
    np.testing.assert_allclose(positions(SURFACE, found)[[0, -1]], short, atol=1e-12)
