"""Fields carried to a level over their surface: by formula, with the singularities below, and turned on the way."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.fibers import (
    AlongRim,
    DirectionField,
    HelixRule,
    carried_field,
    nearest_field,
    prescribed_field,
    singularities_near,
    smoothest_field,
)
from geoprint.geometry import boundary_half_edges, closest, turned_over
from geoprint.layers import level_surface
from geoprint.model import FloatArray, Surface, SurfacePoints
from tests import meshes
from tests.fibers.fields_measures import off, turns_around


def _over(part: Surface, height: float, *, edge_length: float = 1.0) -> tuple[Surface, SurfacePoints]:
    """Return the level at a height over a part, and the feet of its faces."""
    level = level_surface(part, height=height, edge_length=edge_length, tolerance=0.01)
    return level, closest(part, _middles(level))[0]


@cache
def _disc() -> Surface:
    return meshes.disc(radius=12.0, rings=10, jitter_seed=1)


@cache
def _over_disc(edge_length: float) -> tuple[Surface, SurfacePoints]:
    return _over(_disc(), 3.0, edge_length=edge_length)


@cache
def _tube() -> Surface:
    return meshes.cylinder_patch(radius=20.0, angle=1.2, length=20.0, divisions=(48, 16), jitter_seed=1)


@cache
def _over_tube() -> tuple[Surface, SurfacePoints]:
    return _over(_tube(), 4.0)


def _middles(surface: Surface) -> FloatArray:
    return surface.vertices[surface.faces].mean(axis=1)


def _designed(surface: Surface, asked: Sequence[tuple[float, float, float]], *, symmetry: int = 2) -> DirectionField:
    """Return the field with indices asked for at places of a flat disc."""
    places = np.array([[x, y, 0.0] for x, y, _ in asked])
    found = singularities_near(surface, places, indices=np.array([index for *_, index in asked]))
    return prescribed_field(surface, symmetry=symmetry, singularities=found)


def _worst(field: DirectionField, wanted: FloatArray) -> float:
    return float(np.degrees(off(field, wanted)).max())


def test_over_a_plate_lines_stay_as_they_are_and_turn_by_the_angle_that_is_given() -> None:
    part = meshes.plate((20.0, 15.0), (20, 15), jitter_seed=1)
    wish = np.array([np.cos(0.4), np.sin(0.4), 0.0])
    along, across = part.vertices[part.faces[:, 1]] - part.vertices[part.faces[:, 0]], np.array([0.0, 0.0, 1.0])
    angles = np.arctan2(np.cross(along, wish) @ across, along @ wish)
    level, feet = _over(part, 2.0)
    # At its corners the level is cut a hundredth of a millimetre beyond the plate, and bends down there.
    for turned in (0.0, 0.7, np.linspace(-1.0, 1.0, len(level.faces))):
        found = carried_field(nearest_field(part, angles, symmetry=2), level, feet=feet, turned=turned)
        ahead = 0.4 + turned * np.ones(len(level.faces))
        assert _worst(found, np.column_stack([np.cos(ahead), np.sin(ahead), 0.0 * ahead])) < 0.02


@pytest.mark.parametrize("turned_deg", [0.0, 25.0, -90.0])
def test_over_a_tube_a_helix_stays_a_helix_of_the_same_angle_and_is_turned_from_there(turned_deg: float) -> None:
    tube = _tube()
    rule = HelixRule(np.radians(30.0), np.radians(30.0))
    field = rule.field(tube, heights=tube.vertices[:, 1], depths=np.zeros(len(tube.vertices)))
    level, feet = _over_tube()
    found = carried_field(field, level, feet=feet, turned=np.radians(turned_deg))
    right = np.cross([0.0, 1.0, 0.0], _middles(level))
    right /= np.linalg.norm(right, axis=1)[:, None]
    angle = np.radians(30.0 + turned_deg)
    wanted = np.cos(angle) * right + np.sin(angle) * np.array([0.0, 1.0, 0.0])
    # Faces of the tube are turned by up to 0.6 degrees against it.
    assert _worst(found, wanted) < 1.0
    assert float(np.degrees(off(found, wanted)).mean()) < 0.3


@pytest.mark.parametrize("height", [1.0, 4.0])
def test_over_a_sphere_circles_around_the_pole_stay_circles(height: float) -> None:
    cap = meshes.spherical_cap(radius=15.0, rings=24, jitter_seed=1)
    pole = singularities_near(cap, np.array([[0.0, 0.0, 15.0]]), indices=np.array([1.0]))
    field = prescribed_field(cap, symmetry=2, singularities=pole, preferences=[AlongRim()])
    level, feet = _over(cap, height)
    found = carried_field(field, level, feet=feet)
    middles = _middles(level)
    kept = np.linalg.norm(middles[:, :2], axis=1) > 4.0
    assert float(np.degrees(off(found, np.cross([0.0, 0.0, 1.0], middles), kept)).mean()) < 0.5
    above = found.singularities()
    assert above.indices.tolist() == [1.0]
    assert np.linalg.norm(level.vertices[above.vertices[0]] - [0.0, 0.0, 15.0 + height]) < 1.0


@pytest.mark.parametrize(
    ("symmetry", "asked"),
    [
        (2, [(-6.0, 0.0, 0.5), (6.0, 0.0, 0.5)]),
        (2, [(3.0, 2.0, 1.0)]),
        (2, [(3.0, 2.0, -1.0), (-6.0, 0.0, 1.5)]),
        (1, [(3.0, 2.0, 1.0), (-6.0, 0.0, -1.0)]),
        (4, [(3.0, 2.0, 0.25), (-6.0, 0.0, -0.5), (-4.0, 6.0, 1.0)]),
    ],
)
@pytest.mark.parametrize("edge_length", [0.7, 1.6])
def test_indices_above_are_those_below_at_the_vertices_over_them(
    symmetry: int, asked: list[tuple[float, float, float]], edge_length: float
) -> None:
    part = _disc()
    field = _designed(part, asked, symmetry=symmetry)
    level, feet = _over_disc(edge_length)
    found = carried_field(field, level, feet=feet).singularities()
    below = field.singularities()
    missed = level.vertices[found.vertices][:, None, :2] - part.vertices[below.vertices][None, :, :2]
    nearest = np.linalg.norm(missed, axis=2).argmin(axis=1)
    assert sorted(nearest.tolist()) == list(range(len(asked)))
    np.testing.assert_array_equal(found.indices, below.indices[nearest])
    assert np.linalg.norm(missed, axis=2).min(axis=1).max() < edge_length


def test_halves_are_read_from_directions_alone_around_every_vertex() -> None:
    part = _disc()
    field = _designed(part, [(-6.0, 0.0, 0.5), (6.0, 3.0, 0.5), (0.0, -7.0, -0.5)])
    level, feet = _over_disc(0.7)
    found = carried_field(field, level, feet=feet)
    indices = np.round([turn for _, turn in sorted(turns_around(found).items())], 6)
    assert sorted(indices[indices != 0.0].tolist()) == [-0.5, 0.5, 0.5]


def test_over_a_closed_part_indices_add_up_to_its_euler_characteristic() -> None:
    ball = meshes.sphere(radius=8.0, jitter_seed=1)
    field = smoothest_field(ball, symmetry=2)
    level, feet = _over(ball, 1.5)
    found = carried_field(field, level, feet=feet).singularities()
    assert sorted(found.indices.tolist()) == sorted(field.singularities().indices.tolist())
    assert found.indices.sum() == 2.0


def test_where_the_level_is_cut_off_a_singularity_is_left_out() -> None:
    part = _disc()
    field = _designed(part, [(-6.0, 0.0, 0.5), (6.0, 0.0, 0.5)])
    level, _ = _over_disc(0.7)
    half = Surface(level.vertices, level.faces[_middles(level)[:, 0] > 0.0])
    assert boundary_half_edges(half.faces).size
    found = carried_field(field, half, feet=closest(part, _middles(half))[0]).singularities()
    assert found.indices.tolist() == [0.5]
    assert half.vertices[found.vertices[0], 0] > 0.0


def test_a_level_that_looks_down_and_feet_of_another_surface_are_refused() -> None:
    part = meshes.plate((20.0, 15.0), (20, 15), jitter_seed=1)
    field = nearest_field(part, np.zeros(len(part.faces)), symmetry=2)
    level, feet = _over(part, 2.0)
    with pytest.raises(InputError, match=r"face 0 of .* looks at plate below it: turn the level over"):
        carried_field(field, turned_over(level), feet=feet)
    with pytest.raises(InputError, match=r"has \d+ faces, but \d+ feet are given: give one for each face"):
        carried_field(field, part, feet=feet)
