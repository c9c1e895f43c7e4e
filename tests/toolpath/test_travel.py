"""Crossings between runs: as low as part and body allow, for the whole tool, and never bobbing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import FieldError
from geoprint.geometry import closest, normals, positions
from geoprint.model import FloatArray, Surface, SurfaceCurves, Toolpath
from geoprint.toolpath import creases, posed_surface, poses
from geoprint.toolpath.lifting import advances, lifting_normals
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


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=100, deadline=None)
def test_points_that_are_left_out_lift_no_tool_however_it_leans(seed: int):
    random = np.random.default_rng(seed)
    everything = ground(random.uniform(-60.0, 60.0, (400, 3)))
    ends = random.uniform(-20.0, 20.0, (2, 3))
    lean, turn = random.uniform(0.0, 1.2, 2), random.uniform(0.0, 2.0 * np.pi, 2)
    axes = np.column_stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)])
    shares: FloatArray = np.linspace(0.0, 1.0, 15)[:, None]
    line, turned = ends[0] + shares * (ends[1] - ends[0]), axes[0] + shares * (axes[1] - axes[0])
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    under = everything.under(line, turned)
    for tip, axis in zip(line, turned, strict=True):
        assert max(under.lift(tip, axis), 0.0) == max(everything.lift(tip, axis), 0.0)


def test_of_a_large_part_few_points_count():
    sheet = terrain_points([plate((200.0, 200.0), (2, 2))]) - [100.0, 100.0, 0.0]
    line = np.array([[-50.0, 0.0, 5.0], [50.0, 0.0, 5.0]])
    assert len(ground(sheet).under(line, UPRIGHT).points) < 0.1 * len(sheet)


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


@pytest.mark.parametrize("seed", range(8))
def test_rounding_changes_neither_how_travel_is_sampled_nor_where_it_bends_nor_what_it_passes_over(seed: int) -> None:
    """A lift of five whole steps, a crossing over a flat top, and a part whose corners lie on the grid of points."""
    noise = np.random.default_rng(seed)

    def moved(points: FloatArray) -> FloatArray:
        return points + noise.normal(scale=1e-9, size=points.shape)

    lift = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 5.0], [10.0, 0.0, 5.0]])
    assert len(sampled_polyline(moved(lift))[0]) == len(sampled_polyline(lift)[0]) == 16
    flat_top = np.clip(hill(20.0), None, 8.0)
    np.testing.assert_allclose(travel_over(moved(flat_top)), travel_over(flat_top), atol=1e-6)
    own, part = plate((8.0, 6.0), (8, 6)), plate((8.0, 6.0), (8, 6)).vertices
    np.testing.assert_allclose(terrain_points([Surface(moved(part), own.faces)]), terrain_points([own]), atol=1e-6)


# Normals in creases: known answers just on either side of the bound, and that the tip always advances.


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
    with pytest.raises(FieldError, match=r"around \(7\.40, 0\.00, 2\.00\) mm the part is too hollow") as refused:
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
        toolpath, posed_surface(surface, part=surface, body=None), R_base_work=np.eye(3), standoff=STANDOFF,
        retract=5.0, layer_height=0.5, max_tilt=0.2, tool=straight_cell().tool,
    )  # fmt: skip
    found = creases(stream, toolpath, surface, surface)
    assert found.count == count
    assert (np.abs(stream.tips[found.poses, 1] - 15.0) < 1.0).all()
    if nearest is not None:
        assert found.distances.min() == pytest.approx(nearest, abs=2e-3)
    np.testing.assert_allclose(stream.surface_points[stream.deposit], positions(surface, points), atol=1e-12)
