"""Crossings between runs: as low as part and body allow, for the whole tool, and never bobbing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.model import FloatArray, Surface
from geoprint.toolpath.poses import Terrain, crossing, sampled_polyline, terrain, terrain_points
from tests.meshes import plate
from tests.robot.cells import straight_cell
from tests.robot.placements import block

TOOL = straight_cell().tool
UP = np.array([0.0, 0.0, 1.0])
UPRIGHT = np.array([UP, UP])
START, END = np.array([-10.0, 0.0, 5.0]), np.array([10.0, 0.0, 5.0])
RETRACT, KEPT = 5.0, 2.5


def ground(points: FloatArray, *, kept: float = KEPT) -> Terrain:
    return Terrain(
        points, up=UP, needle_radius=TOOL.needle_diameter / 2,
        cone_heights=(TOOL.needle_length, TOOL.needle_length + TOOL.cone_length),
        barrel_radius=TOOL.barrel_diameter / 2, kept=kept,
    )  # fmt: skip


def travel_over(points: FloatArray, *, kept: float = KEPT) -> FloatArray:
    return crossing(START, END, axes=UPRIGHT, terrain=ground(points, kept=kept), retract=RETRACT)


def hill(height: float) -> FloatArray:
    x = np.linspace(-10.0, 10.0, 81)
    return np.column_stack([x, np.zeros(81), height * (1.0 - (x / 10.0) ** 2)])


def test_travel_over_low_ground_is_straight():
    np.testing.assert_allclose(travel_over(hill(2.4)), [START, END])


def test_travel_over_a_hill_keeps_half_the_retract_from_it_and_goes_no_higher():
    corners = travel_over(hill(8.0))

    assert corners[:, 2].max() == pytest.approx(8.0 + KEPT, abs=0.1)
    line, _ = sampled_polyline(corners, step=0.1)
    distances = np.linalg.norm(line[:, None] - hill(8.0), axis=2).min(axis=1)
    assert distances[10:-10].min() > 0.9 * KEPT


def test_travel_over_everything_rises_straight_up_above_the_highest_point():
    corners = travel_over(hill(8.0), kept=np.inf)

    np.testing.assert_allclose(corners[:, 2], [5.0, 18.0, 18.0, 5.0])
    np.testing.assert_allclose(corners[[0, -1]], [START, END])


def test_wall_beside_the_travel_lifts_the_cone_over_it():
    wall = np.array([[0.0, 5.0, 45.0]])

    # 2.5 mm from the axis, besides what is kept, the cone is so high over the tip.
    cone = TOOL.needle_length + (5.0 - KEPT - TOOL.needle_diameter / 2) / np.tan(TOOL.cone_half_angle)
    assert ground(wall).lift(np.zeros(3), UP) == pytest.approx(45.0 - cone + KEPT)
    assert travel_over(wall)[:, 2].max() == pytest.approx(45.0 - cone + KEPT)
    assert len(travel_over(wall + 8.0 * UPRIGHT[:1, [0, 2, 1]])) == 2


def test_leaning_tool_is_lifted_by_more_because_it_goes_up_and_not_along_its_axis():
    lean = np.array([np.sin(0.5), 0.0, np.cos(0.5)])
    below = ground(np.array([[0.0, 0.0, 0.0]]))

    assert below.lift(np.zeros(3), lean) == pytest.approx(KEPT / np.cos(0.5))


def test_travel_between_opposite_attitudes_is_as_high_as_over_everything_where_the_tool_has_no_direction():
    axes = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])

    corners = crossing(START, END, axes=axes, terrain=ground(hill(2.4)), retract=RETRACT)
    assert np.isfinite(corners).all()
    assert corners[:, 2].max() == pytest.approx(2.4 + 2.0 * RETRACT)


def test_no_travel_is_higher_than_over_everything():
    assert travel_over(np.array([[0.0, 1.0, 300.0]]))[:, 2].max() <= 300.0 + 2 * RETRACT


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_string_over_any_ground_keeps_above_it_and_never_sags(seed: int):
    random = np.random.default_rng(seed)
    points = random.uniform([-9.0, -4.0, -5.0], [9.0, 4.0, 12.0], (20, 3))

    corners = travel_over(points)

    assert (np.diff(np.diff(corners[:, 2]) / np.diff(corners[:, 0])) < 0.0).all()
    line, _ = sampled_polyline(np.stack([START, END]))
    heights = np.interp(line[:, 0], corners[:, 0], corners[:, 2])
    low = np.array([ground(points).lift(np.array([x, 0.0, z]), UP) for x, z in zip(line[:, 0], heights, strict=True)])
    assert low[1:-1].max() < 1e-9


@settings(max_examples=20, deadline=None)
@given(rise=st.floats(0.0, 20.0))
def test_higher_ground_never_lowers_the_travel(rise: float):
    lower, higher = (travel_over(hill(6.0) + shift * UP)[:, 2].max() for shift in (0.0, rise))

    assert higher >= lower - 1e-9


def test_terrain_covers_large_faces_of_part_and_body():
    body = block((-20.0, -20.0, -30.0), (60.0, 50.0, -1.0), name="body")
    found: Terrain = terrain(terrain_points([plate(), body]), beside=np.empty((0, 3)), tool=TOOL, up=UP, kept=KEPT)
    surfaces: list[Surface] = [plate(), body]

    for surface in surfaces:
        weights = np.random.default_rng(0).dirichlet(np.ones(3), size=40)
        for corners in surface.vertices[surface.faces[:20]]:
            away = np.linalg.norm((weights @ corners)[:, None] - found.points, axis=2).min(axis=1)
            assert away.max() < 2.5
    assert found.top == pytest.approx(0.0)


def test_a_polyline_is_sampled_with_its_corners() -> None:
    samples, corners = sampled_polyline(np.array([[0.0, 0, 0], [2.5, 0, 0], [2.5, 1.0, 0]]), step=1.0)
    assert corners.tolist() == [0, 3, 4]
    np.testing.assert_allclose(np.linalg.norm(np.diff(samples, axis=0), axis=1), [2.5 / 3] * 3 + [1.0])
