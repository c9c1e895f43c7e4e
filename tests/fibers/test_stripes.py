"""Stripes as paths: known answers on plate, cylinder and disc, where rows end, how even they are, and refusals."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint.distance import BACKENDS
from geoprint.errors import FieldError, UsageError
from geoprint.fibers import (
    AlongCurvature,
    AlongDirection,
    AlongRim,
    DirectionField,
    HelixRule,
    nearest_field,
    prescribed_field,
    singularities_near,
    smoothest_field,
)
from geoprint.fibers.fields import angles_in_faces
from geoprint.fibers.net import net_of, senses_of
from geoprint.fibers.pattern import FibrePattern
from geoprint.geometry import (
    arc_lengths,
    pieces,
    point_source,
    prepare,
    refine,
    united,
)
from geoprint.geometry.files import load
from geoprint.metrics import measure_paths
from geoprint.model import FloatArray, Paths, Polylines, Surface
from tests.fibers.fibres_measures import crossings, lines, off_field, paths_along
from tests.meshes import annulus, cylinder_patch, disc, plate, sphere
from tests.shared_data import shared

_paths = partial(paths_along, laying="stripes")


def _along(surface: Surface, *direction: float) -> DirectionField:
    return smoothest_field(surface, symmetry=2, preferences=[AlongDirection(np.array(direction))])


def _about(index: float, *, rings: int = 30) -> DirectionField:
    surface = disc(rings=rings, jitter_seed=1)
    middle = singularities_near(surface, np.zeros((1, 3)), indices=np.array([index]))
    return prescribed_field(surface, symmetry=2, singularities=middle, preferences=[AlongRim(weight=1e4)])


def _fan(surface: Surface, *, reach: float) -> DirectionField:
    """Return lines that part from a place that far to the left of the left side of a plate."""
    middles = surface.vertices[surface.faces].mean(axis=1) + np.array([reach, 0.0, 0.0])
    middles[:, 1] -= np.ptp(surface.vertices[:, 1]) / 2
    return nearest_field(surface, angles_in_faces(surface, np.arange(len(middles)), middles), symmetry=2)


def _sides(surface: Surface, paths: Paths, *, spacing: float) -> FloatArray:
    drawn = Polylines(np.concatenate(lines(surface, paths)), paths.curves.offsets)
    ratios = measure_paths(surface, drawn, spacing=spacing).sides.sides()
    return ratios[np.isfinite(ratios)]


@pytest.mark.parametrize("divisions", [(2, 1), (40, 20)])
def test_on_a_plate_rows_are_straight_and_one_spacing_apart(divisions: tuple[int, int]) -> None:
    surface = plate((20.0, 10.0), divisions, jitter_seed=None if divisions == (2, 1) else 1)
    paths = _paths(_along(surface, 1.0, 0.0, 0.0), spacing=1.0)
    drawn = lines(surface, paths)
    assert max(float(np.ptp(line[:, 1])) for line in drawn) < 1e-4
    np.testing.assert_allclose([arc_lengths(line)[-1] for line in drawn], 20.0, atol=1e-4)
    np.testing.assert_allclose(np.sort([line[0, 1] for line in drawn]), np.arange(10) + 0.5, atol=1e-4)
    assert sorted(paths.levels.tolist()) == list(range(10))


def test_where_the_width_holds_no_whole_number_of_rows_they_stay_one_spacing_apart() -> None:
    surface = plate((20.0, 10.4), (40, 20), jitter_seed=1)
    paths = _paths(_along(surface, 1.0, 0.0, 0.0), spacing=1.0)
    heights = np.sort([line[:, 1].mean() for line in lines(surface, paths)])
    np.testing.assert_allclose(np.diff(heights), 1.0, atol=0.03)
    # Both rims draw: what is left over is shared.
    np.testing.assert_allclose(heights[0] + heights[-1], 10.4, atol=0.02)


@pytest.mark.parametrize("angle_deg", [-60.0, 0.0, 37.0])
def test_on_a_cylinder_a_helix_rule_gives_helices_one_spacing_apart(angle_deg: float) -> None:
    surface = cylinder_patch(radius=12.0, angle=2.0, length=30.0, divisions=(48, 40), jitter_seed=1)
    rule = HelixRule(np.radians(angle_deg), np.radians(angle_deg))
    field = rule.field(surface, heights=surface.vertices[:, 1], depths=np.zeros(len(surface.vertices)))
    paths = _paths(field, spacing=1.0)
    across, off = list[float](), list[float]()
    for line in lines(surface, paths):
        flat = np.column_stack([12.0 * np.arctan2(line[:, 0], line[:, 2]), line[:, 1]])
        along = flat[-1] - flat[0]
        found = np.degrees(np.arctan2(along[1], along[0]))
        off.append(float(abs((abs(found - angle_deg) + 90.0) % 180.0 - 90.0)))
        turned = np.radians(angle_deg)
        across.append(float((flat @ [-np.sin(turned), np.cos(turned)]).mean()))
    assert paths.curves.count >= 25
    assert np.mean(off) < 0.1
    assert max(off) < 0.5
    np.testing.assert_allclose(np.diff(np.sort(across)), 1.0, atol=0.02)


def test_about_an_index_of_one_on_a_disc_rows_are_closed_circles() -> None:
    field = _about(1.0)
    paths = _paths(field, spacing=1.0)
    radii = [np.linalg.norm(line, axis=1) for line in lines(field.surface, paths)]
    closed = [around for around, whole in zip(radii, paths.curves.closed, strict=True) if whole]
    assert len(closed) >= len(radii) - 1
    assert max(np.ptp(around) for around in closed) < 0.2
    means = np.array([float(around.mean()) for around in closed])
    np.testing.assert_allclose(np.diff(np.sort(means)), 1.0, atol=0.1)


def test_around_half_an_index_rows_turn_back_and_do_not_end() -> None:
    surface, spacing = disc(rings=40, jitter_seed=1), 1.0
    middles = surface.vertices[surface.faces].mean(axis=1)
    # Lines at one distance around a straight line with two ends.
    away = middles - np.clip(middles @ np.diag([1.0, 0.0, 0.0]), -6.0, 6.0)
    around = np.column_stack([-away[:, 1], away[:, 0], np.zeros(len(away))])
    field = nearest_field(surface, angles_in_faces(surface, np.arange(len(middles)), around), symmetry=2)
    assert senses_of(surface, net_of(field, spacings=np.full(len(field.angles), spacing))).odd.sum() == 2
    paths = _paths(field, spacing=spacing)
    ends = _ends(surface, paths)
    assert crossings(surface, paths.curves) == 0
    assert np.linalg.norm(ends, axis=1).min(initial=np.inf) > 19.5
    lowest = sorted(float(np.abs(line[:, 1]).max()) for line in lines(surface, paths))
    np.testing.assert_allclose(lowest[:8], np.arange(8) + 0.5, atol=0.2)


def test_where_lines_part_half_of_the_ends_are_saved_by_a_little_more_or_less_spacing() -> None:
    surface, spacing, reach = plate((30.0, 20.0), (60, 40), jitter_seed=1), 1.0, 20.0
    paths = _paths(_fan(surface, reach=reach), spacing=spacing)
    ends = _ends(surface, paths)
    inside = (ends[:, 0] > 0.2) & (ends[:, 0] < 29.8) & (ends[:, 1] > 0.2) & (ends[:, 1] < 19.8)
    # Rows exactly one spacing apart begin as often as lines part: one over the distance from where they come from.
    middles = surface.vertices[surface.faces].mean(axis=1) + np.array([reach, -10.0, 0.0])
    parting: FloatArray = 1.0 / np.linalg.norm(middles, axis=1)
    demanded = float(parting.mean()) * 30.0 * 20.0 / spacing
    assert 0.2 * demanded < inside.sum() < 0.6 * demanded
    ratios = _sides(surface, paths, spacing=spacing)
    assert ratios.std() / ratios.mean() < 0.1


MADE: dict[str, Callable[[], DirectionField]] = {
    "along the rim of a ring": lambda: smoothest_field(
        annulus(divisions=(96, 16), jitter_seed=1), symmetry=2, preferences=[AlongRim()]
    ),
    "along x on a disc": lambda: _along(disc(rings=30, jitter_seed=1), 1.0, 0.0, 0.0),
    "circles": lambda: _about(1.0),
    "a fan": lambda: _fan(plate((20.0, 14.0), (40, 28), jitter_seed=1), reach=15.0),
    "smoothest on a sphere": lambda: smoothest_field(sphere(radius=10.0, jitter_seed=1), symmetry=2),
}


@pytest.mark.parametrize("made", MADE)
def test_rows_never_cross_follow_the_field_to_two_degrees_and_leave_no_gap(made: str) -> None:
    field = MADE[made]()
    surface, spacing = field.surface, 1.1
    paths = _paths(field, spacing=spacing)
    assert crossings(surface, paths.curves) == 0
    off, lengths = off_field(field, paths.curves)
    assert np.degrees(np.average(off, weights=lengths)) < 2.0
    drawn = Polylines(np.concatenate(lines(surface, paths)), paths.curves.offsets)
    assert measure_paths(surface, drawn, spacing=spacing).gap < 0.05


def _ends(surface: Surface, paths: Paths) -> FloatArray:
    """Return the (e, 3) ends of open paths [mm]."""
    drawn = zip(lines(surface, paths), paths.curves.closed.tolist(), strict=True)
    return np.concatenate([np.zeros((0, 3)), *(line[[0, -1]] for line, closed in drawn if not closed)])


def test_each_piece_of_a_surface_has_rows_of_its_own() -> None:
    one = plate((10.0, 6.0), (10, 6))
    both = united([one, Surface(one.vertices + np.array([20.0, 0.0, 0.0]), one.faces)])
    paths = _paths(_along(both, 1.0, 0.0, 0.0), spacing=1.0)
    assert [int(piece.holds(paths.curves).sum()) for piece in pieces(both)] == [6, 6]


def test_a_row_passes_through_a_source_that_is_one_point() -> None:
    surface = plate((10.0, 6.0), (10, 6))
    source = point_source(surface, np.array([5.0, 2.7, 0.0]), tolerance=1.0)
    pattern = FibrePattern(field=lambda _: _along(surface, 1.0, 0.0, 0.0))
    paths = pattern.paths(surface, source, backend=BACKENDS["heat"](surface), spacing=1.0)
    heights = np.array([line[0, 1] for line in lines(surface, paths)])
    assert np.abs(heights - 2.7).min() < 1e-5
    assert abs(heights[int(np.argmin(paths.levels))] - 2.7) < 1e-5


def test_moving_the_part_moves_the_rows_with_it() -> None:
    field = _about(1.0, rings=12)
    turn, shift = Rotation.from_rotvec([0.4, -1.0, 0.3]).as_matrix(), np.array([5.0, -3.0, 2.0])
    moved = Surface(field.surface.vertices @ turn.T + shift, field.surface.faces)
    there = DirectionField(moved, field.symmetry, field.angles, field.turning)
    ours, theirs = (_paths(each, spacing=2.0) for each in (field, there))
    assert ours.curves.count == theirs.curves.count
    for one, other in zip(lines(field.surface, ours), lines(moved, theirs), strict=True):
        np.testing.assert_allclose(one @ turn.T + shift, other, atol=1e-6)


def test_what_is_shorter_than_three_spacings_is_left_out_and_told() -> None:
    # A triangle whose corner cuts rows shorter and shorter.
    surface = Surface(np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [20.0, 10.0, 0.0]]), np.array([[0, 1, 2]]))
    paths = _paths(_along(surface, 0.0, 1.0, 0.0), spacing=1.0)
    assert len(paths.dropped) >= 4
    assert max(paths.dropped) < 3.0
    assert min(arc_lengths(line)[-1] for line in lines(surface, paths)) >= 3.0


def test_a_part_too_short_for_any_stroke_is_refused() -> None:
    surface = plate((2.0, 2.0), (4, 4))
    with pytest.raises(FieldError, match=r"no path along the field on plate is 3 spacings of 1 mm long: choose"):
        _paths(_along(surface, 1.0, 0.0, 0.0), spacing=1.0)


def test_another_laying_is_refused() -> None:
    with pytest.raises(UsageError, match=r"^fibres have no placement 'woven'; choose one of: stripes, streamlines\.$"):
        FibrePattern(laying="woven")


@pytest.mark.parametrize("name", ["lv_lateral_rect_40x30", "aortic_root_band_6mm"])
def test_on_a_real_patch_rows_are_even_cover_it_cross_nowhere_and_follow_the_curvature(name: str) -> None:
    part = prepare(load(shared(f"patches/{name}.ply"), unit="mm"))[0]
    fine = refine(part, edge_length=0.8)
    field = smoothest_field(fine, symmetry=2, preferences=[AlongCurvature("smallest")])
    paths = _paths(field, spacing=1.8)
    assert crossings(fine, paths.curves) == 0
    off, lengths = off_field(field, paths.curves)
    assert np.degrees(np.average(off, weights=lengths)) < 2.0
    ratios = _sides(fine, paths, spacing=1.8)
    assert ratios.std() / ratios.mean() < 0.1
