"""Streamlines as paths: known answers on plate, disc and cylinder, how near and how true they run, and refusals."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

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
    Preference,
    nearest_field,
    prescribed_field,
    singularities_near,
    smoothest_field,
)
from geoprint.fibers.fields import angles_in_faces
from geoprint.fibers.pattern import FibrePattern, lines_along_rim
from geoprint.geometry import (
    arc_lengths,
    boundary_source,
    pieces,
    point_source,
    prepare,
    refine,
    united,
)
from geoprint.geometry.files import load
from geoprint.metrics import measure_paths
from geoprint.model import Paths, Polylines, Source, Surface
from tests.fibers.fibres_measures import crossings, lines, off_field, paths_along
from tests.meshes import annulus, cylinder_patch, disc, plate, sphere
from tests.shared_data import shared

_paths = partial(paths_along, laying="streamlines")


def _leaning(surface: Surface, *preferences: Preference) -> DirectionField:
    return smoothest_field(surface, symmetry=2, preferences=preferences)


def _along(surface: Surface, *direction: float) -> DirectionField:
    return _leaning(surface, AlongDirection(np.array(direction)))


def _circles(*, rings: int = 40, jitter_seed: int | None = 1) -> DirectionField:
    surface = disc(rings=rings, jitter_seed=jitter_seed)
    middle = singularities_near(surface, np.zeros((1, 3)), indices=np.ones(1))
    return prescribed_field(surface, symmetry=2, singularities=middle, preferences=[AlongRim(weight=1e4)])


@pytest.mark.parametrize("divisions", [(2, 1), (40, 20)])
def test_on_a_plate_rows_are_straight_and_one_spacing_apart(divisions: tuple[int, int]) -> None:
    surface = plate((20.0, 10.0), divisions, jitter_seed=None if divisions == (2, 1) else 1)
    paths = _paths(_along(surface, 1.0, 0.0, 0.0), spacing=1.0)
    drawn = lines(surface, paths)
    assert max(float(np.ptp(line[:, 1])) for line in drawn) < 1e-5
    np.testing.assert_allclose([arc_lengths(line)[-1] for line in drawn], 20.0, atol=1e-4)
    np.testing.assert_allclose(np.sort([line[0, 1] for line in drawn]), np.arange(10) + 0.5, atol=1e-5)
    assert sorted(paths.levels.tolist()) == list(range(10))


def test_about_an_index_of_one_on_a_disc_strokes_are_closed_circles() -> None:
    field = _circles()
    paths = _paths(field, spacing=1.0)
    radii = [np.linalg.norm(line, axis=1) for line in lines(field.surface, paths)]
    assert paths.curves.closed.sum() >= 18
    closed = [around for around, whole in zip(radii, paths.curves.closed, strict=True) if whole]
    assert max(np.ptp(around) for around in closed) < 0.15
    means = np.array([float(around.mean()) for around in closed])
    np.testing.assert_allclose(np.diff(np.sort(means)), 1.0, atol=0.1)
    for curve in np.flatnonzero(paths.curves.closed).tolist():
        line = paths.curves.xyz(field.surface, curve)
        np.testing.assert_allclose(line[0], line[-1], atol=1e-9)


@pytest.mark.parametrize("angle_deg", [-60.0, 0.0, 37.0])
def test_on_a_cylinder_a_helix_rule_gives_helices(angle_deg: float) -> None:
    surface = cylinder_patch(radius=12.0, angle=2.0, length=30.0, divisions=(48, 40), jitter_seed=1)
    rule = HelixRule(np.radians(angle_deg), np.radians(angle_deg))
    field = rule.field(surface, heights=surface.vertices[:, 1], depths=np.zeros(len(surface.vertices)))
    paths = _paths(field, spacing=1.0)
    for line in lines(surface, paths):
        flat = np.column_stack([12.0 * np.arctan2(line[:, 0], line[:, 2]), line[:, 1]])
        along = flat[-1] - flat[0]
        # The axis points to y; seen from outside with y up, x grows to the right.
        found = np.degrees(np.arctan2(along[1], along[0]))
        assert abs((abs(found - angle_deg) + 90.0) % 180.0 - 90.0) < 0.1
    assert paths.curves.count >= 25


MADE: dict[str, Callable[[], DirectionField]] = {
    "along the rim of a ring": lambda: _leaning(annulus(divisions=(96, 16), jitter_seed=1), AlongRim()),
    "along x on a disc": lambda: _along(disc(rings=30, jitter_seed=1), 1.0, 0.0, 0.0),
    "circles": lambda: _circles(rings=30),
    "from a middle": lambda: _rays(disc(rings=30, jitter_seed=1)),
    "smoothest on a sphere": lambda: smoothest_field(sphere(radius=10.0, jitter_seed=1), symmetry=2),
}


def _rays(surface: Surface) -> DirectionField:
    middles = surface.vertices[surface.faces].mean(axis=1)
    return nearest_field(surface, angles_in_faces(surface, np.arange(len(middles)), middles), symmetry=2)


@cache
def _deposited(made: str) -> tuple[DirectionField, Paths]:
    field = MADE[made]()
    return field, _paths(field, spacing=1.1)


@pytest.mark.parametrize("made", MADE)
def test_strokes_never_cross_and_follow_the_field(made: str) -> None:
    field, paths = _deposited(made)
    assert crossings(field.surface, paths.curves) == 0
    off, lengths = off_field(field, paths.curves)
    assert np.degrees(np.average(off, weights=lengths)) < 0.5
    # All but where the lines of two triangles lead to one side, which the stroke then follows.
    assert lengths[np.degrees(off) > 2.0].sum() < 0.02 * lengths.sum()


@pytest.mark.parametrize("made", MADE)
def test_strokes_are_apart_over_the_surface_and_leave_no_wide_gap(made: str) -> None:
    field, paths = _deposited(made)
    drawn = Polylines(np.concatenate(lines(field.surface, paths)), paths.curves.offsets)
    found = measure_paths(field.surface, drawn, spacing=1.1)
    ratios = found.sides.both.ratios
    # A stroke looks about each eighth of a spacing.
    assert ratios.min() > 0.6 - 0.125
    assert found.gap < 0.06


def test_a_ray_ends_where_rays_come_near_each_other() -> None:
    field = _rays(disc(rings=30, jitter_seed=1))
    paths = _paths(field, spacing=1.0)
    inner = np.array([np.linalg.norm(line, axis=1).min() for line in lines(field.surface, paths)])
    # 2 pi r has room for r * 2 pi / 0.6 rays at most, and for a half of it at least.
    for radius in (5.0, 10.0, 15.0):
        assert 0.6 * (inner < radius).sum() < 2.0 * np.pi * radius < 1.6 * (inner < radius).sum()


def test_each_piece_of_a_surface_has_strokes_of_its_own() -> None:
    one = plate((10.0, 6.0), (10, 6))
    both = united([one, Surface(one.vertices + np.array([20.0, 0.0, 0.0]), one.faces)])
    paths = _strokes_on(both, _along(both, 1.0, 0.0, 0.0), source=boundary_source(both))
    held = [int(piece.holds(paths.curves).sum()) for piece in pieces(both)]
    assert held == [6, 6]


def test_a_source_that_is_one_point_lies_on_the_first_stroke() -> None:
    surface = plate((10.0, 6.0), (10, 6))
    field = _along(surface, 1.0, 0.0, 0.0)
    paths = _strokes_on(surface, field, source=point_source(surface, np.array([5.0, 2.7, 0.0]), tolerance=1.0))
    first = lines(surface, paths)[int(np.argmin(paths.levels))]
    np.testing.assert_allclose(first[:, 1], 2.7, atol=1e-5)


def test_moving_the_part_moves_the_strokes_with_it() -> None:
    field = _circles(rings=12)
    turn, shift = Rotation.from_rotvec([0.4, -1.0, 0.3]).as_matrix(), np.array([5.0, -3.0, 2.0])
    moved = Surface(field.surface.vertices @ turn.T + shift, field.surface.faces)
    there = DirectionField(moved, field.symmetry, field.angles, field.turning)
    ours, theirs = (_paths(each, spacing=2.0) for each in (field, there))
    assert ours.curves.count == theirs.curves.count
    for one, other in zip(lines(field.surface, ours), lines(moved, theirs), strict=True):
        np.testing.assert_allclose(one @ turn.T + shift, other, atol=1e-6)


def test_without_a_field_strokes_follow_the_rim_and_where_there_is_none_the_smoothest_lines() -> None:
    ring = annulus(divisions=(96, 16))
    paths = FibrePattern(laying="streamlines").paths(
        ring, boundary_source(ring), backend=BACKENDS["heat"](ring), spacing=1.0
    )
    assert paths.curves.closed.sum() >= 10
    assert lines_along_rim(sphere()).singularities().indices.sum() == pytest.approx(2.0)


def test_a_field_of_crosses_is_refused() -> None:
    surface = plate()
    with pytest.raises(UsageError, match="not of crosses: give a field of symmetry 2"):
        _paths(smoothest_field(surface, symmetry=4), spacing=1.0)


def test_a_stroke_that_is_too_short_is_left_out_and_told_once_from_wherever_it_is_met() -> None:
    # In a corner rows grow shorter and shorter: so many as there are spacings in three, at 45 degrees.
    surface = plate((20.0, 20.0), (40, 40), jitter_seed=1)
    paths = _paths(_along(surface, 1.0, 1.0, 0.0), spacing=1.0)
    assert 2 <= len(paths.dropped) <= 4
    assert max(paths.dropped) < 3.0
    assert min(arc_lengths(line)[-1] for line in lines(surface, paths)) >= 3.0


def test_a_part_too_short_for_any_stroke_is_refused() -> None:
    surface = plate((2.0, 2.0), (4, 4))
    with pytest.raises(
        FieldError, match=r"no path along the field on plate is 3 spacings of 1 mm long: choose a smaller"
    ):
        _paths(_along(surface, 1.0, 0.0, 0.0), spacing=1.0)


@pytest.mark.parametrize("name", ["lv_lateral_rect_40x30", "aortic_root_band_6mm"])
def test_on_a_real_patch_strokes_cover_it_cross_nowhere_and_follow_the_curvature(name: str) -> None:
    part = prepare(load(shared(f"patches/{name}.ply"), unit="mm"))[0]
    fine = refine(part, edge_length=0.8)
    field = _leaning(fine, AlongCurvature("smallest"))
    paths = _paths(field, spacing=1.8)
    assert crossings(fine, paths.curves) == 0
    off, lengths = off_field(field, paths.curves)
    assert np.degrees(np.average(off, weights=lengths)) < 0.5
    drawn = Polylines(np.concatenate(lines(fine, paths)), paths.curves.offsets)
    assert measure_paths(part, drawn, spacing=1.8).gap < 0.05


def _strokes_on(surface: Surface, field: DirectionField, *, source: Source) -> Paths:
    pattern = FibrePattern(field=lambda _: field, laying="streamlines")
    return pattern.paths(surface, source, backend=BACKENDS["heat"](surface), spacing=1.0)
