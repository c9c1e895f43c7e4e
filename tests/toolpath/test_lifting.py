"""Normals in creases: known answers just on either side of the bound, and that the tip always advances."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import FieldError
from geoprint.geometry import closest, normals, positions
from geoprint.model import FloatArray, Surface, SurfaceCurves, Toolpath
from geoprint.toolpath import creases, poses
from geoprint.toolpath.poses import advances, lifting_normals
from tests.meshes import plate
from tests.robot.cells import straight_cell

STANDOFF = 0.3


def valley(*, slope_deg: float) -> Surface:
    """Return a plate folded at y = 15 mm, both sides rising; across the crease its edges are 0.2 mm long in y."""
    flat = plate((2.0, 30.0), (2, 150))
    vertices = flat.vertices.copy()
    vertices[:, 2] = np.abs(vertices[:, 1] - 15.0) * np.tan(np.radians(slope_deg))
    return Surface(vertices, flat.faces)


def across(surface: Surface, *, slope_deg: float) -> tuple[FloatArray, FloatArray]:
    """Return a run across the crease, each 0.005 mm in y: its places and the surface's normals."""
    y = np.linspace(13.0, 17.0, 801)
    rising = np.abs(y - 15.0) * np.tan(np.radians(slope_deg))
    points, _ = closest(surface, np.column_stack([np.full(801, 1.0), y, rising]))
    return positions(surface, points), normals(surface, points)


def gutter(*, radius: float) -> tuple[FloatArray, FloatArray]:
    """Return a run through a round gutter and its normals: they meet on the axis, z = radius."""
    angles = np.linspace(-1.0, 1.0, 201)
    places = radius * np.column_stack([np.sin(angles), 0.0 * angles, 1.0 - np.cos(angles)])
    return places, np.column_stack([-np.sin(angles), 0.0 * angles, np.cos(angles)])


def lifted(places: FloatArray, outward: FloatArray, *, closed: bool = False, standoff: float = STANDOFF) -> FloatArray:
    return lifting_normals(places, outward, closed=closed, standoff=standoff)


def test_in_a_round_gutter_the_tip_advances_by_one_less_the_stand_off_over_the_radius() -> None:
    np.testing.assert_allclose(advances(*gutter(radius=1.2), standoff=0.3), 0.75, rtol=1e-9)
    np.testing.assert_allclose(advances(*gutter(radius=0.2), standoff=0.3), -0.5, rtol=1e-9)


def test_a_gutter_twice_as_wide_as_the_stand_off_is_where_smoothing_begins() -> None:
    wide, narrow = gutter(radius=0.602), gutter(radius=0.598)
    np.testing.assert_array_equal(lifted(*wide), wide[1])
    smooth = lifted(*narrow)
    assert (smooth != narrow[1]).any()
    assert advances(narrow[0], smooth, standoff=STANDOFF).min() >= 0.5


def test_a_groove_of_known_angle_is_smoothed_just_beyond_the_bound_and_not_before() -> None:
    # Between the vertex normals of crease and flank, f = 20 degrees apart over an edge of 0.2 mm / cos f = 0.21284 mm,
    # the normal n = (1 - a) u + a f has its largest part back along the run at a = 0.68, where that is 0.34902 of the
    # unit normal an edge: the tip advances by 1 - s 0.34902 / 0.21284, by a half at s = 0.30491 mm.
    places, outward = across(valley(slope_deg=20.0), slope_deg=20.0)
    assert advances(places, outward, standoff=0.3).min() == pytest.approx(0.5081, abs=5e-4)
    np.testing.assert_array_equal(lifted(places, outward, standoff=0.304), outward)
    smooth = lifted(places, outward, standoff=0.306)
    assert (smooth != outward).any()
    assert advances(places, smooth, standoff=0.306).min() >= 0.5


def test_over_a_sharp_crease_the_tip_runs_on_and_nothing_changes_away_from_it() -> None:
    places, outward = across(valley(slope_deg=50.0), slope_deg=50.0)
    assert advances(places, outward, standoff=STANDOFF).min() < 0.2
    smooth = lifted(places, outward)
    tips, steps = places + STANDOFF * smooth, np.diff(smooth, axis=0)
    assert advances(places, smooth, standoff=STANDOFF).min() >= 0.5
    # The normal turns by at most a radian while the tip goes on by a stand-off.
    assert (STANDOFF * np.linalg.norm(steps, axis=1) <= np.linalg.norm(np.diff(tips, axis=0), axis=1)).all()
    away = np.abs(places[:, 1] - 15.0) > 1.0
    np.testing.assert_array_equal(smooth[away], outward[away])
    # Upright over the bottom: 0.3 mm cos 50 = 0.193 mm from the flanks, and nowhere nearer.
    surface = valley(slope_deg=50.0)
    distances = closest(surface, tips)[1]
    assert distances.min() == pytest.approx(0.193, abs=2e-3)
    assert np.abs(places[distances.argmin(), 1] - 15.0) < 0.01


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), rough=st.floats(0.0, 0.8), standoff=st.floats(0.05, 2.0), closed=st.booleans())
def test_the_tip_advances_on_any_run(seed: int, rough: float, standoff: float, *, closed: bool) -> None:
    generator = np.random.default_rng(seed)
    arcs = np.append(0.0, np.cumsum(generator.uniform(0.001, 0.5, 80)))
    angles = 2.0 * np.pi * arcs / arcs[-1]
    flat = np.column_stack([np.cos(angles), np.sin(angles), 0.1 * np.sin(3.0 * angles)]) * arcs[-1] / (2.0 * np.pi)
    places: FloatArray = flat if closed else np.column_stack([arcs, 0.0 * arcs, 0.1 * np.sin(angles)])
    outward = np.array([0.0, 0.0, 1.0]) + generator.normal(scale=rough, size=(81, 3)).clip(-0.9, 0.9)
    if closed:
        places[-1], outward[-1] = places[0], outward[0]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    smooth = lifted(places, outward, closed=closed, standoff=standoff)
    np.testing.assert_allclose(np.linalg.norm(smooth, axis=1), 1.0, rtol=1e-12)
    assert advances(places, smooth, standoff=standoff).min() >= 0.5
    if advances(places, outward, standoff=standoff).min() >= 0.5:
        np.testing.assert_array_equal(smooth, outward)
    if closed:
        np.testing.assert_allclose(smooth[0], smooth[-1], rtol=0.0, atol=1e-12)


def test_a_crease_at_the_seam_is_smoothed_as_anywhere_else() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 401)
    ring = 5.0 * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    swing = 0.8 * np.tanh((angles - np.pi) / 0.02) * np.exp(-(((angles - np.pi) / 0.3) ** 2))
    along = np.column_stack([np.sin(angles), -np.cos(angles), 0.0 * angles])
    outward: FloatArray = along * np.sin(swing)[:, None] + np.array([0.0, 0.0, 1.0]) * np.cos(swing)[:, None]
    inside = lifted(ring, outward, closed=True)
    assert (inside != outward).any()
    rolled = [np.vstack([np.roll(rows[:-1], 200, axis=0), rows[200:201]]) for rows in (ring, outward, inside)]
    np.testing.assert_allclose(lifted(rolled[0], rolled[1], closed=True), rolled[2], atol=1e-9)


def test_a_pipe_as_narrow_as_the_stand_off_is_refused_with_its_place() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 41)
    inwards = -np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    with pytest.raises(FieldError, match=r"around \(7\.40, 0\.00, 2\.00\) mm the part is so hollow") as refused:
        lifted(np.array([7.0, 0.0, 2.0]) - 0.4 * inwards, inwards, closed=True)
    assert refused.value.details["place"] == pytest.approx((7.4, 0.0, 2.0))


@pytest.mark.parametrize(("slope_deg", "count", "nearest"), [(50.0, 1, 0.193), (5.0, 0, None)])
def test_creases_of_a_stream_are_counted_and_measured(slope_deg: float, count: int, nearest: float | None) -> None:
    surface = valley(slope_deg=slope_deg)
    points, _ = closest(surface, across(surface, slope_deg=slope_deg)[0])
    nothing = np.zeros((0, 3))
    runs = SurfaceCurves(points, np.array([0, 801]), np.array([False]))
    one = np.array([0])
    toolpath = Toolpath(runs, one, one, 1.0, 0, 0.0, 0.0, nothing, nothing, np.zeros(801), np.ones(801))
    stream = poses(
        toolpath, surface, R_base_work=np.eye(3), standoff=STANDOFF, retract=5.0, layer_height=0.5, max_tilt=0.2,
        tool=straight_cell().tool, body=None,
    )  # fmt: skip
    found = creases(stream, toolpath, surface)
    assert found.count == count
    assert (np.abs(stream.tips[found.poses, 1] - 15.0) < 1.0).all()
    if nearest is not None:
        assert found.distances.min() == pytest.approx(nearest, abs=2e-3)
    np.testing.assert_allclose(stream.surface_points[stream.deposit], positions(surface, points), atol=1e-12)
