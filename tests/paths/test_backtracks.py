"""Runs whose tip turns back nowhere: folds of the stand-off in a valley, lines that tremble, corners close together."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.config import Job
from geoprint.model import FloatArray, Surface, SurfacePoints
from geoprint.paths.backtracks import unfolded, without_backtracks
from geoprint.paths.corners import round_corners
from geoprint.pipeline.planning import cover
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.workpiece import prepare_workpiece
from geoprint.surfaces import PolylineDistance, closest, normals, positions
from tests.meshes import plate

GROOVE = Path("/work/shared/data/patches/interventricular_groove_disc_r20.ply")
SPACING, STANDOFF = 1.0, 0.3
FLAT = plate((40.0, 30.0), (40, 30))


def bent(surface: Surface, *, radius: float) -> Surface:
    """Return a plate rolled into a gutter about its long axis [mm]."""
    x, y = surface.vertices[:, 0], surface.vertices[:, 1] - 15.0
    rolled = np.column_stack([x, radius * np.sin(y / radius), radius * (1.0 - np.cos(y / radius))])
    return Surface(rolled, surface.faces)


def valley(*, slope: float) -> Surface:
    """Return a plate folded at y = 15 mm, both sides rising under a slope [rad]."""
    vertices = plate((40.0, 30.0), (40, 150)).vertices.copy()
    vertices[:, 2] = np.abs(vertices[:, 1] - 15.0) * np.tan(slope)
    return Surface(vertices, plate((40.0, 30.0), (40, 150)).faces)


def turns(places: FloatArray) -> FloatArray:
    along = np.diff(places, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return np.arccos(np.clip(np.einsum("ij,ij->i", along[1:], along[:-1]), -1.0, 1.0))


def tips(surface: Surface, points: SurfacePoints) -> FloatArray:
    return positions(surface, points) + STANDOFF * normals(surface, points)


def test_a_fold_of_the_stand_off_in_a_valley_is_cut_off() -> None:
    surface = valley(slope=np.radians(50.0))
    y = np.linspace(13.0, 17.0, 201)
    across, _ = closest(surface, np.column_stack([np.full(201, 20.0), y, np.abs(y - 15.0) * np.tan(np.radians(50.0))]))
    assert np.degrees(turns(tips(surface, across)).max()) > 120.0
    found = without_backtracks(surface, across, standoff=STANDOFF, error=0.05)
    assert np.degrees(turns(tips(surface, found)).max()) < 90.0
    np.testing.assert_array_equal(positions(surface, found)[[0, -1]], positions(surface, across)[[0, -1]])
    # Only the fold went: what is farther from the valley than the stand-off is as it was.
    left = np.abs(positions(surface, found)[:, 1] - 15.0)
    assert (left > 0.4).sum() == (np.abs(y - 15.0) > 0.4).sum()


def test_a_way_back_goes_and_a_corner_within_the_angle_stays() -> None:
    back = np.array([[0.0, 0, 0], [1, 0, 0], [1.1, 0, 0], [1.05, 0, 0], [1.2, 0, 0], [2, 0, 0]])
    kept = unfolded(back, turn=np.radians(30.0), error=0.1)
    assert turns(back[kept]).max() < 1e-9
    gentle = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0.5, 0], [3, 1, 0]])
    np.testing.assert_array_equal(unfolded(gentle, turn=np.radians(30.0), error=0.1), [0, 1, 2, 3])


def test_a_hairpin_with_long_legs_stays_because_its_tip_would_be_lost() -> None:
    hairpin = np.array([[0.0, 0, 0], [5, 0.1, 0], [0, 0.2, 0]])
    np.testing.assert_array_equal(unfolded(hairpin, turn=np.radians(30.0), error=0.1), [0, 1, 2])


def test_a_small_ring_is_not_eaten_up() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 9)
    ring = 0.3 * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    assert unfolded(ring, turn=np.radians(30.0), error=0.05).size == 9


@pytest.mark.parametrize("surface", [FLAT, bent(FLAT, radius=12.0)], ids=["plane", "gutter"])
@settings(max_examples=15, deadline=None)
@given(
    legs=st.lists(st.floats(0.15, 1.2), min_size=3, max_size=7),
    angles=st.lists(st.floats(-1.9, 1.9), min_size=6, max_size=6),
)
def test_corners_close_together_never_turn_back(surface: Surface, legs: list[float], angles: list[float]) -> None:
    headings: FloatArray = np.cumsum([0.0, *angles[: len(legs) - 1]])
    steps: FloatArray = np.array(legs)[:, None] * np.column_stack([np.cos(headings), np.sin(headings)])
    corners: FloatArray = np.vstack([[20.0, 15.0], np.array([20.0, 15.0]) + np.cumsum(steps, axis=0)])
    flat: FloatArray = np.vstack([np.linspace(a, b, 9)[:-1] for a, b in pairwise(corners)] + [corners[-1:]])
    on_flat, _ = closest(FLAT, np.column_stack([flat, np.zeros(len(flat))]))
    run = SurfacePoints(on_flat.faces, on_flat.weights)
    before = turns(positions(surface, run)).max()
    found = round_corners(surface, [run], closed=[False], spacing=SPACING, speed=20.0)
    kept = [without_backtracks(surface, piece.points, standoff=0.0, error=SPACING / 20.0) for piece in found.pieces]
    lines = [positions(surface, points) for points in kept]
    for line in lines:
        assert turns(line).max(initial=0.0) <= max(before, np.radians(30.0)) + np.radians(3.0)
    assert PolylineDistance(lines, step=0.2)(positions(surface, run)).max() <= 2.2 * SPACING / 20.0


@pytest.mark.skipif(not GROOVE.exists(), reason="needs the real patches")
def test_the_tip_turns_back_nowhere_in_the_groove_between_the_ventricles() -> None:
    job = Job(surface=GROOVE, unit="mm", spacing=1.5, robot=False)
    stage = Stages(lambda _: None)
    stream = cover(job, prepare_workpiece(job, stage, backends=[job.backend]), stage).poses
    for run in range(int(stream.runs.max()) + 1):
        assert np.degrees(turns(stream.tips[stream.deposit & (stream.runs == run)]).max()) < 90.0
