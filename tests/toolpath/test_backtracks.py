"""Runs whose tip turns back nowhere: lines that tremble, creases, corners close together."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.config import Job
from geoprint.geometry import PolylineDistance, closest, normals, positions
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints
from geoprint.reporting.plan import record_plan
from geoprint.toolpath import creases
from geoprint.toolpath.corners import round_corners, unfolded, without_backtracks
from geoprint.toolpath.lifting import advances
from geoprint.workflow.covering import cover
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import prepare_workpiece
from tests.meshes import plate
from tests.shared_data import shared

SPACING, STANDOFF = 1.0, 0.3
FLAT = plate((40.0, 30.0), (40, 30))


def bent(surface: Surface, *, radius: float) -> Surface:
    """Return a plate rolled into a gutter about its long axis [mm]."""
    x, y = surface.vertices[:, 0], surface.vertices[:, 1] - 15.0
    rolled = np.column_stack([x, radius * np.sin(y / radius), radius * (1.0 - np.cos(y / radius))])
    return Surface(rolled, surface.faces)


def turns(places: FloatArray) -> FloatArray:
    along = np.diff(places, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return np.arccos(np.clip(np.einsum("ij,ij->i", along[1:], along[:-1]), -1.0, 1.0))


def kept_of(surface: Surface, points: SurfacePoints, *, standoff: float = 0.0) -> IntArray:
    places, outward = positions(surface, points), normals(surface, points)
    return without_backtracks(places, outward, closed=False, standoff=standoff, error=0.05)


def test_a_fold_of_the_stand_off_costs_no_sample_that_a_straight_line_keeps() -> None:
    # In a gutter of half the stand-off's radius a tip on the normals would go back all the way.
    angles = np.linspace(-1.0, 1.0, 41)
    places = 0.15 * np.column_stack([np.sin(angles), 0.0 * angles, 1.0 - np.cos(angles)])
    outward = np.column_stack([-np.sin(angles), 0.0 * angles, np.cos(angles)])
    rows = without_backtracks(places, outward, closed=False, standoff=STANDOFF, error=0.05)
    np.testing.assert_array_equal(rows, np.arange(41))


def test_a_tooth_goes_just_below_the_error_and_stays_just_above() -> None:
    # The tip of a tooth 0.1 mm wide turns by 90 degrees and stands 0.05 mm off the chord.
    def tooth(height: float) -> FloatArray:
        return np.array([[0.0, 0, 0], [1, 0, 0], [1.05, height, 0], [1.1, 0, 0], [2.1, 0, 0]])

    np.testing.assert_array_equal(unfolded(tooth(0.0499), turn=np.radians(30.0), error=0.05), [0, 1, 3, 4])
    np.testing.assert_array_equal(unfolded(tooth(0.0501), turn=np.radians(30.0), error=0.05), [0, 1, 2, 3, 4])


def test_a_corner_goes_just_above_the_angle_and_stays_just_below() -> None:
    def corner(angle_deg: float) -> FloatArray:
        end = [0.05 + 0.05 * np.cos(np.radians(angle_deg)), 0.05 * np.sin(np.radians(angle_deg)), 0.0]
        return np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], end])

    np.testing.assert_array_equal(unfolded(corner(30.1), turn=np.radians(30.0), error=0.05), [0, 2])
    np.testing.assert_array_equal(unfolded(corner(29.9), turn=np.radians(30.0), error=0.05), [0, 1, 2])


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
    pieces: list[FloatArray] = [np.linspace(a, b, 9)[:-1] for a, b in pairwise(corners)]
    flat = np.vstack([*pieces, corners[-1:]])
    on_flat, _ = closest(FLAT, np.column_stack([flat, np.zeros(len(flat))]))
    run = SurfacePoints(on_flat.faces, on_flat.weights)
    before = turns(positions(surface, run)).max()
    found = round_corners(surface, [run], closed=[False], spacing=SPACING, speed=20.0)
    rounded = [positions(surface, piece.points) for piece in found.pieces]
    lines = [places[kept_of(surface, piece.points)] for places, piece in zip(rounded, found.pieces, strict=True)]
    for line in lines:
        assert turns(line).max(initial=0.0) <= max(before, np.radians(30.0)) + np.radians(3.0)
    # What is left out lies within a twentieth of the spacing of the chord over it; rounding adds a 26th, and a tenth of
    # that.
    assert PolylineDistance(lines, step=0.2)(np.vstack(rounded)).max() <= 0.05 + 1e-9
    assert PolylineDistance(lines, step=0.2)(positions(surface, run)).max() <= 0.05 + 0.0424


def test_the_tip_turns_back_nowhere_in_the_groove_between_the_ventricles() -> None:
    job = Job(surface=shared("patches/interventricular_groove_disc_r20.ply"), unit="mm", spacing=1.5, robot=False)
    stage = Stages(lambda _: None)
    plan = cover(job, prepare_workpiece(job, stage, backends=[job.backend]), stage)
    stream = plan.poses
    for run in range(int(stream.runs.max()) + 1):
        rows = stream.deposit & (stream.runs == run)
        assert np.degrees(turns(stream.tips[rows]).max()) < 90.0
        assert advances(stream.surface_points[rows], stream.normals[rows], standoff=STANDOFF).min() >= 0.5 - 1e-6
    # The needle's tip keeps three quarters of its 0.3 mm, and the plan says where it is nearest.
    found = creases(stream, plan.toolpath, plan.workpiece.surface, plan.workpiece.part)
    assert found.distances.min() > 0.225
    assert any("runs cross " in note and "at least 0.2" in note for note in record_plan(plan).notes)
