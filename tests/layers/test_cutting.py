"""Levels cut by targets: areas by formula, pieces, crumbs, what stands out or hangs, and what holds a layer."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from geoprint.errors import FieldError
from geoprint.geometry import boundary_loops, component_labels, face_areas, signed_volume, turned_over, united
from geoprint.geometry.crossings import crossings
from geoprint.layers import (
    Columns,
    TargetShape,
    TargetThickness,
    area_standing_out,
    cut,
    layer_level,
    with_sides,
    without_crumbs,
)
from geoprint.model import Surface
from tests import meshes

PART = meshes.plate((20.0, 12.0), (10, 6))
HEIGHT = 0.5


@cache
def _level(over: float) -> Surface:
    return layer_level(PART, over, height=HEIGHT)


def _cut(shape: Surface, over: float, part: Surface = PART) -> Surface:
    level = _level(over) if part is PART else layer_level(part, over, height=HEIGHT)
    return cut(part, level, TargetShape(shape, part), height=over, tolerance=0.1 * HEIGHT)


def _area(surface: Surface) -> float:
    return float(face_areas(surface).sum())


def _mushroom(*, out: float) -> Surface:
    """Return a stem of 8 by 8 mm up to z = 1 under a head that stands out by so much on the four sides, up to z = 2."""
    filled = [[[0, 1]] * 3, [[0, 1], [1, 1], [0, 1]], [[0, 1]] * 3]
    return meshes.blocks(
        filled, x=[6.0 - out, 6.0, 14.0, 14.0 + out], y=[2.0 - out, 2.0, 10.0, 10.0 + out], z=[-1.0, 1.0, 2.0]
    )


def test_a_wedge_leaves_of_each_level_what_lies_under_its_top() -> None:
    shape = meshes.wedge(length=20.0, width=12.0, height=4.0)
    for over in (0.25, 1.75, 3.75):
        # At the corners of the part the rim is rounded by a tenth of a millimetre.
        assert _area(_cut(shape, over)) == pytest.approx(12.0 * (20.0 - 5.0 * over), abs=0.3)


def test_a_window_stays_open() -> None:
    filled = [[[1], [1], [1]], [[1], [0], [1]], [[1], [1], [1]]]
    window = meshes.blocks(filled, x=[-2.0, 7.0, 13.0, 22.0], y=[-2.0, 4.0, 8.0, 14.0], z=[-1.0, 3.0])
    found = _cut(window, 1.25)
    assert len(boundary_loops(found)) == 2
    assert _area(found) == pytest.approx(240.0 - 24.0, rel=0.003)
    assert crossings(found, depth=1e-9)[0].size == 0


def test_the_upper_layers_of_a_trough_are_in_two_pieces() -> None:
    trough = meshes.blocks([[[1, 1]], [[1, 0]], [[1, 1]]], x=[2.0, 7.0, 13.0, 18.0], y=[1.0, 11.0], z=[-1.0, 1.0, 3.0])
    low, high = _cut(trough, 0.75), _cut(trough, 1.25)
    assert (component_labels(low).max() + 1, component_labels(high).max() + 1) == (1, 2)
    assert _area(low) == pytest.approx(160.0, rel=0.005)
    assert _area(high) == pytest.approx(100.0, rel=0.005)


def test_a_box_as_wide_as_the_part_leaves_all_of_it() -> None:
    box = meshes.blocks([[[1]]], x=[0.0, 20.0], y=[0.0, 12.0], z=[0.0, 3.0])
    assert _area(_cut(box, 1.25)) == pytest.approx(240.0, rel=0.005)
    wide = meshes.blocks([[[1]]], x=[-5.0, 25.0], y=[-5.0, 15.0], z=[-1.0, 3.0])
    level = _level(1.25)
    assert cut(PART, level, TargetShape(wide, PART), height=1.25, tolerance=0.05) is level


def test_over_a_cap_a_ball_leaves_a_cap() -> None:
    part = meshes.spherical_cap(radius=10.0, angle=0.9, rings=24)
    ball = meshes.sphere(radius=6.0, subdivisions=4)
    shape = Surface(ball.vertices + np.array([0.0, 0.0, 9.0]), ball.faces, "ball")
    # Where spheres of 11.25 and 6 mm about places 9 mm apart meet.
    cosine = (11.25**2 + 9.0**2 - 6.0**2) / (2.0 * 11.25 * 9.0)
    assert _area(_cut(shape, 1.25, part)) == pytest.approx(2.0 * np.pi * 11.25**2 * (1.0 - cosine), rel=0.01)


def test_a_saddle_and_a_bowl_keep_their_layers_within_a_box() -> None:
    flat = meshes.plate((10.0, 10.0), (20, 20))
    x, y = flat.vertices[:, 0] - 5.0, flat.vertices[:, 1] - 5.0
    saddle = Surface(np.column_stack([x, y, (x**2 - y**2) / 24.0]), flat.faces, "saddle")
    box = meshes.blocks([[[1]]], x=[-2.5, 2.5], y=[-2.5, 2.5], z=[-9.0, 9.0])
    for part in (saddle, turned_over(saddle)):
        found = _cut(box, 1.25, part)
        upright = found.vertices[found.faces].mean(axis=1)
        assert np.abs(found.vertices[:, :2]).max() == pytest.approx(2.5, abs=0.06)
        # A surface over a square of the plane, as steep as the saddle at most.
        assert 25.0 < _area(found) < 25.0 * 1.1
        assert len(upright) == len(found.faces)


def test_where_nothing_of_the_target_is_left_it_is_told() -> None:
    box = meshes.blocks([[[1]]], x=[4.0, 9.0], y=[4.0, 9.0], z=[-1.0, 1.0])
    with pytest.raises(FieldError, match=r"nothing of the target lies 1\.25 mm over plate"):
        _cut(box, 1.25)


def test_a_feather_ends_each_layer_where_the_thickness_is_its_middle() -> None:
    fine = meshes.plate((20.0, 12.0), (200, 120))
    x, y, _ = fine.vertices.T
    from_rim = np.minimum(np.minimum(x, 20.0 - x), np.minimum(y, 12.0 - y))
    target = TargetThickness(fine, 2.0 * np.minimum(from_rim / 4.0, 1.0))
    for over in (0.25, 1.75):
        found = cut(PART, _level(over), target, height=over, tolerance=0.05)
        away = 4.0 * over / 2.0
        assert _area(found) == pytest.approx((20.0 - 2.0 * away) * (12.0 - 2.0 * away), rel=0.01)


def test_pieces_too_narrow_for_a_path_are_left_out_and_told() -> None:
    wide = meshes.plate((8.0, 6.0), (8, 6))
    narrow = Surface(
        meshes.plate((8.0, 1.0), (16, 2)).vertices + np.array([0.0, 10.0, 0.0]), meshes.plate((8.0, 1.0), (16, 2)).faces
    )
    both = united([wide, narrow])
    kept, left_out = without_crumbs(both, spacing=1.5)
    assert (_area(kept), left_out) == (pytest.approx(48.0), pytest.approx(8.0))
    kept, left_out = without_crumbs(both, spacing=0.9)
    assert (kept is both, left_out) == (True, 0.0)
    with pytest.raises(FieldError, match="all of it is narrower than the spacing of 7 mm"):
        without_crumbs(both, spacing=7.0)
    # Triangles larger than the spacing are no narrower for it.
    assert without_crumbs(meshes.plate((8.0, 6.0), (1, 1)), spacing=1.0)[1] == 0.0
    closed = meshes.sphere(radius=1.0)
    assert without_crumbs(closed, spacing=5.0) == (closed, 0.0)


def test_what_stands_out_by_more_than_a_layer_is_measured() -> None:
    for out, wanted in ((2.0, 12.0**2 - 9.0**2), (0.3, 0.0)):
        shape = _mushroom(out=out)
        found = _cut(shape, 1.25)
        area = area_standing_out(PART, found, TargetShape(shape, PART), below=0.75, height=HEIGHT)
        # Faces are counted as wholes.
        assert area == pytest.approx(wanted, abs=8.0 if wanted else 0.0)


def test_a_piece_with_nothing_below_is_refused() -> None:
    filled = [[[1, 1, 1]], [[0, 0, 1]], [[0, 1, 1]]]
    shape = meshes.blocks(filled, x=[2.0, 7.0, 13.0, 18.0], y=[1.0, 11.0], z=[-1.0, 1.0, 2.0, 3.0])
    found = _cut(shape, 1.25)
    with pytest.raises(FieldError, match=r"about \(15.* it would hang in the air, with no target below"):
        area_standing_out(PART, found, TargetShape(shape, PART), below=0.75, height=HEIGHT)


def test_columns_are_as_wide_as_the_widest_layer_of_them() -> None:
    shape = TargetShape(_mushroom(out=2.0), PART)
    places = np.array([[10.0, 6.0, 0.3], [5.0, 6.0, 0.3], [3.0, 6.0, 0.3], [5.0, 6.0, 1.9]])
    low, both = Columns(PART, shape, [0.75]), Columns(PART, shape, [0.75, 1.25])
    np.testing.assert_array_equal(low.depth(places) > 0.0, [True, False, False, False])
    np.testing.assert_array_equal(both.depth(places) > 0.0, [True, True, False, True])
    assert (both.thickness, both.volume) == (shape.thickness, shape.volume)


@pytest.mark.parametrize("inner", [False, True])
def test_a_level_with_its_sides_and_the_part_hold_what_lies_between(*, inner: bool) -> None:
    part = meshes.spherical_cap(radius=10.0, angle=0.8, rings=24)
    part = turned_over(part) if inner else part
    top = with_sides(part, layer_level(part, 1.5, height=HEIGHT))
    # Divergence needs no closed seam: what is missing between the rims is thinner than a hundredth of a millimetre.
    volume = signed_volume(united([top, turned_over(part)]))
    radii = sorted((10.0, 8.5 if inner else 11.5))
    assert volume == pytest.approx((1.0 - np.cos(0.8)) * 2.0 * np.pi * (radii[1] ** 3 - radii[0] ** 3) / 3.0, rel=0.01)


def test_sides_fall_straight_to_the_part_from_a_rim_within_it() -> None:
    box = meshes.blocks([[[1]]], x=[4.0, 12.0], y=[3.0, 9.0], z=[-1.0, 3.0])
    level = _cut(box, 1.0)
    found = with_sides(PART, level)
    assert _area(found) - _area(level) == pytest.approx(28.0, rel=0.01)
    assert found.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_array_equal(found.faces[: len(level.faces)], level.faces)
    ball = meshes.sphere(radius=5.0)
    assert with_sides(meshes.sphere(radius=4.0), ball) is ball
