from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.model import FloatArray
from geoprint.robot.collision.tool_solids import (
    ARC_ALLOWANCE,
    EXCESS,
    TIP_ZONE,
    Solid,
    movements,
    polytope,
    revolution,
    signed_distances,
    tool_solids,
)
from tests.robot.cells import bent_cell, straight_cell

SOLIDS = tool_solids(straight_cell().tool)
SEEDS = st.integers(0, 2**32 - 1)


def random_points_of(index: int, generator: np.random.Generator, *, count: int) -> FloatArray:
    """Return points inside one of the straight tool's solids, many of them on its rims."""
    solid = SOLIDS[index]
    share = generator.choice([0.0, 1.0, 0.5, float(generator.random())], count)
    radius = solid.start_radius + share * (solid.end_radius - solid.start_radius)
    radius = radius * generator.choice([0.0, 1.0, 1.0], count)
    turn = generator.uniform(0.0, 2 * np.pi, count)
    flat = radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(count)])
    return solid.start + share[:, None] * (solid.end - solid.start) + flat


def unit_vectors(generator: np.random.Generator, *, count: int) -> FloatArray:
    directions = generator.normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_solids_stack_from_the_tip_to_the_top_of_the_barrel():
    tip, needle, cone, barrel, bracket = SOLIDS

    cone_top = 25.4 + 9.35 / np.tan(np.radians(10.0))
    assert [solid.name for solid in SOLIDS] == ["needle's tip", "needle", "cone", "barrel", "bracket"]
    np.testing.assert_allclose(
        [-tip.start[2], -needle.start[2], -cone.start[2], -barrel.start[2], -barrel.end[2]],
        [0.0, TIP_ZONE, 25.4, cone_top, 120.0],
    )
    assert (cone.start_radius, cone.end_radius, barrel.end_radius, bracket.end_radius) == (0.65, 10.0, 10.0, 15.0)


def test_bracket_of_a_bent_tool_lies_along_the_flange_axis():
    tool = bent_cell().tool
    bracket = tool_solids(tool)[-1]

    ends = transforms.apply(tool.T_flange_tool, np.array([bracket.end, bracket.start]))

    np.testing.assert_allclose(ends, [[0.0, 0.0, 0.0], [0.0, 0.0, 40.0]], atol=1e-12)


@pytest.mark.parametrize("index", range(1, 5))
@settings(max_examples=15, deadline=None)
@given(seed=SEEDS, by=st.floats(0.01, 0.75))
def test_polytope_holds_every_point_within_the_distance(index: int, seed: int, by: float):
    generator = np.random.default_rng(seed)
    points = random_points_of(index, generator, count=40) + by * unit_vectors(generator, count=40)
    corners, triangles = polytope(SOLIDS[index], by=by)
    a, b, c = (corners[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)

    outside = ((points[:, None] - a) * normals).sum(axis=2).max()

    assert outside < 1e-9


@pytest.mark.parametrize("index", range(1, 5))
@pytest.mark.parametrize("by", [0.0, 0.1, 0.5])
def test_polytope_adds_no_more_than_its_excess(index: int, by: float):
    corners, _ = polytope(SOLIDS[index], by=by)

    assert signed_distances(revolution((SOLIDS[index],)), corners).max() < by + EXCESS


@pytest.mark.parametrize(("start", "end"), [(5.0, 40.0), (40.0, 5.0)])
def test_polytope_of_a_cone_as_wide_as_a_hand_adds_less_than_half_a_tenth_of_a_millimetre(start: float, end: float):
    wide = Solid("cone", np.zeros(3), np.array([0.0, 0.0, 200.0]), start, end)

    corners, _ = polytope(wide, by=0.5)

    assert signed_distances(revolution((wide,)), corners).max() < 0.5 + 0.045


def test_polytope_of_a_cylinder_has_its_volume_and_is_wound_outwards():
    corners, triangles = polytope(SOLIDS[3], by=0.0)
    a, b, c = (corners[triangles[:, i]] for i in range(3))

    volume = (a * np.cross(b, c)).sum() / 6

    assert volume == pytest.approx(np.pi * 10.0**2 * SOLIDS[3].length, rel=5e-3)


@pytest.mark.parametrize(("index", "by", "lowest"), [(0, 0.7, 0.0), (1, 0.75, 0.25), (1, 1.0, 0.0), (1, 2.5, 0.0)])
def test_needle_and_tip_are_not_inflated_below_the_tip_plane(index: int, by: float, lowest: float):
    corners, _ = polytope(SOLIDS[index], by=by)

    assert -corners[:, 2].max() == pytest.approx(lowest, abs=1e-12)


def test_shift_moves_every_solid_by_its_length():
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, 3] = [0.3, 0.0, 0.4]

    np.testing.assert_allclose(movements(SOLIDS, poses), ARC_ALLOWANCE * np.full((1, 5), 0.5))


def test_turn_about_its_own_axis_does_not_move_a_solid_of_revolution():
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, :3] = Rotation.from_euler("z", 1.3).as_matrix()

    np.testing.assert_allclose(movements(SOLIDS, poses), 0.0, atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, angle=st.floats(0.0, 0.5), index=st.integers(0, 4))
def test_no_point_leaves_a_solid_by_more_than_its_movement(seed: int, angle: float, index: int):
    generator = np.random.default_rng(seed)
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, :3] = Rotation.from_rotvec(angle * unit_vectors(generator, count=1)[0]).as_matrix()
    poses[1, :3, 3] = generator.normal(size=3)
    bound = movements(SOLIDS, poses)[0, index]

    moved = transforms.apply(poses[1], random_points_of(index, generator, count=60))

    assert signed_distances(revolution((SOLIDS[index],)), moved).max() <= bound + 1e-9


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"needle_length": 0.8}, "needle_length is 0.8 mm"),
        ({"bracket_length": 0.0}, "bracket_length is 0.0 mm"),
        ({"needle_diameter": -1.0}, "needle_diameter is -1.0 mm"),
        ({"barrel_diameter": float("nan")}, "barrel_diameter is nan mm"),
        ({"needle_diameter": 21.0}, "the cone widens from 21.0 to 20.0 mm"),
        ({"cone_half_angle": 0.0}, "at 0.0 degrees"),
        ({"barrel_top": 60.0}, "the cone ends 78.4 mm from the tip and barrel_top is 60.0 mm"),
    ],
)
def test_impossible_tool_is_refused(change: dict[str, float], message: str):
    with pytest.raises(InputError, match=message):
        tool_solids(replace(straight_cell().tool, **change))
