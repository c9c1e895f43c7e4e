"""Printing order, seams, attitudes, travel: the toolpath and the pose stream."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial import KDTree

from geoprint.distance.heat import Heat
from geoprint.distance.isolines import isolines
from geoprint.errors import FieldError, VerificationError
from geoprint.geometry import boundary_source, closest, positions
from geoprint.model import FloatArray, IntArray, Paths, PoseStream, ScalarField, Surface, SurfaceCurves, Toolpath
from geoprint.toolpath import PATTERNS, arrange, check_sum, largest_lean, mean_lean, posed_surface, poses, seams_of
from geoprint.toolpath.medial_axis import bead_counts
from geoprint.toolpath.poses import smoothed_axes, tool_quaternions
from geoprint.transforms import rotation_of
from tests.meshes import annulus, cylinder_patch, plate, spherical_cap
from tests.robot.cells import straight_cell

RETRACT, STANDOFF, SPEED = 5.0, 0.3, 20.0
MAX_TILT = float(np.radians(15.0))


def planned(surface: Surface, *, spacing: float) -> tuple[Toolpath, PoseStream]:
    paths = PATTERNS["contours"]().paths(surface, boundary_source(surface), backend=Heat(surface), spacing=spacing)
    toolpath = arrange(paths, surface, speed=SPEED)
    stream = poses(
        toolpath, posed_surface(surface, part=surface, body=None), R_base_work=np.eye(3), standoff=STANDOFF,
        retract=RETRACT, layer_height=0.5, max_tilt=MAX_TILT, tool=straight_cell().tool,
    )  # fmt: skip
    return toolpath, stream


def strokes_of(curves: SurfaceCurves, levels: IntArray, *, spacing: float) -> Paths:
    row = np.repeat(levels, np.diff(curves.offsets)).astype(np.float64)
    return Paths(curves, row, np.full(row.size, spacing), np.ones(row.size))


def unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.sqrt((vectors**2).sum(axis=1, keepdims=True))


def run_starts(toolpath: Toolpath, surface: Surface) -> FloatArray:
    return positions(surface, toolpath.curves.points)[toolpath.curves.offsets[:-1]]


def test_runs_go_from_the_seed_inwards() -> None:
    surface = plate((40.0, 30.0), (40, 30), jitter_seed=1)
    toolpath, _ = planned(surface, spacing=2.0)
    assert (np.diff(toolpath.levels) >= 0).all()
    assert toolpath.levels[0] == 0


def test_seams_of_a_cap_lie_side_by_side() -> None:
    surface = spherical_cap(radius=30.0, angle=0.8, rings=30, jitter_seed=2)
    toolpath, _ = planned(surface, spacing=2.0)
    steps = np.linalg.norm(np.diff(run_starts(toolpath, surface), axis=0), axis=1)
    assert steps.max() < 2.0 * 1.6


@pytest.mark.parametrize(
    "surface",
    [
        plate((40.0, 30.0), (40, 30), jitter_seed=3),
        spherical_cap(radius=30.0, angle=0.8, rings=24, jitter_seed=2),
        annulus(inner=4.0, divisions=(90, 24)),
    ],
    ids=["plate", "cap", "annulus"],
)
def test_no_closed_run_starts_within_two_spacings_of_a_start_in_the_two_layers_below(surface: Surface) -> None:
    spacing = 1.5
    paths = PATTERNS["contours"]().paths(surface, boundary_source(surface), backend=Heat(surface), spacing=spacing)
    layers = [arrange(paths, surface, speed=SPEED, seams=seams_of(surface, layer=layer)) for layer in range(4)]
    assert [int(layer.layers[0]) for layer in layers] == list(range(4))
    starts = [run_starts(layer, surface) for layer in layers]
    judged = 0
    for above in range(1, 4):
        below = KDTree(np.concatenate(starts[max(above - 2, 0) : above]))
        curves = layers[above].curves
        for run in np.flatnonzero(curves.closed).tolist():
            # A run too short for that has no place so far from them.
            away = np.asarray(below.query(curves.xyz(surface, run))[0], dtype=np.float64)
            if away.max() >= 2.5 * spacing:
                assert away[0] >= 2.0 * spacing
                judged += 1
    assert judged > 20


def test_the_fourth_layer_of_a_stack_starts_where_the_first_does_and_a_single_skin_knows_no_layers() -> None:
    surface = spherical_cap(radius=30.0, angle=0.8, rings=30, jitter_seed=2)
    paths = PATTERNS["contours"]().paths(surface, boundary_source(surface), backend=Heat(surface), spacing=3.0)
    first, fourth, skin = (
        arrange(paths, surface, speed=SPEED, seams=seams)
        for seams in (seams_of(surface, layer=0), seams_of(surface, layer=3), None)
    )
    np.testing.assert_array_equal(run_starts(first, surface), run_starts(fourth, surface))
    assert set(skin.layers.tolist()) == {0}


def test_closed_runs_shorter_than_a_spacing_are_dropped_and_counted_with_their_area() -> None:
    surface = plate((30.0, 30.0), (60, 60))
    x, y = surface.vertices[:, 0], surface.vertices[:, 1]
    field = ScalarField(np.minimum(np.minimum(x, 30.0 - x), np.minimum(y, 30.0 - y)))
    curves, levels = isolines(surface, field, levels=np.array([2.0, 14.7]))
    toolpath = arrange(strokes_of(curves, levels, spacing=3.0), surface, speed=SPEED)
    assert toolpath.levels.tolist() == [0]
    assert toolpath.dropped_runs == 1
    assert toolpath.dropped_length == pytest.approx(4 * 0.6, abs=0.4)
    assert toolpath.dropped_area == pytest.approx(3.0 * toolpath.dropped_length)
    # With what the pattern left out itself.
    deposited = strokes_of(curves, levels, spacing=3.0)
    record = arrange(replace(deposited, dropped=(2.0, 3.5)), surface, speed=SPEED)
    assert record.dropped_runs == 3
    assert record.dropped_length == pytest.approx(toolpath.dropped_length + 5.5)
    inner, _ = isolines(surface, field, levels=np.array([14.7]))
    with pytest.raises(FieldError, match="shorter than one spacing"):
        arrange(strokes_of(inner, np.array([0]), spacing=3.0), surface, speed=SPEED)


def lines_on(surface: Surface, lines: list[list[tuple[float, float]]], *, spacing: float = 1.0) -> Paths:
    """Straight open paths on a plate, each of its places a fifth apart."""
    fine = list[FloatArray]()
    for line in lines:
        (x, y), (u, v) = line
        share: FloatArray = np.linspace(0.0, 1.0, max(round(np.hypot(u - x, v - y) / 0.2), 1) + 1)
        fine.append(np.column_stack([x + share * (u - x), y + share * (v - y), np.zeros(share.size)]))
    points, _ = closest(surface, np.concatenate(fine))
    offsets = np.concatenate([[0], np.cumsum([len(line) for line in fine])])
    curves = SurfaceCurves(points, offsets, np.zeros(len(lines), dtype=np.bool_))
    return strokes_of(curves, np.zeros(len(lines), dtype=np.int64), spacing=spacing)


@pytest.mark.parametrize(
    ("short", "runs", "dropped"),
    [
        # It goes on where the long one ends, as far as a spacing away, and at a slant.
        ([(10.4, 5.0), (11.0, 5.0)], 1, 0),
        ([(10.9, 5.0), (11.4, 5.0)], 1, 0),
        ([(11.0, 5.0), (10.4, 5.0)], 1, 0),
        ([(10.6, 5.2), (11.1, 5.4)], 1, 0),
        # Too far away; across; beside, facing the same way.
        ([(11.2, 5.0), (11.7, 5.0)], 1, 1),
        ([(10.4, 4.7), (10.4, 5.3)], 1, 1),
        ([(9.5, 5.5), (10.1, 5.5)], 1, 1),
        # Long enough by itself: it stays a run.
        ([(10.4, 5.0), (11.6, 5.0)], 2, 0),
    ],
    ids=["touching", "near", "turned", "slanted", "far", "across", "beside", "long"],
)
def test_a_short_run_goes_on_into_one_that_faces_it_and_is_dropped_where_none_does(
    short: list[tuple[float, float]], runs: int, dropped: int
) -> None:
    surface = plate((20.0, 10.0), (10, 5))
    toolpath = arrange(lines_on(surface, [[(2.0, 5.0), (10.0, 5.0)], short]), surface, speed=SPEED)
    assert (toolpath.curves.count, toolpath.dropped_runs) == (runs, dropped)
    length = float(np.hypot(short[1][0] - short[0][0], short[1][1] - short[0][1]))
    assert toolpath.dropped_length == pytest.approx(dropped * length)
    assert toolpath.dropped_area == pytest.approx(dropped * length * 1.0)
    if runs == 1 and not dropped:
        places = positions(surface, toolpath.curves.points)
        assert sorted(places[[0, -1], 0]) == pytest.approx([2.0, max(short[0][0], short[1][0])])


def test_a_short_run_joins_the_nearer_of_two_but_not_across_a_third() -> None:
    surface = plate((20.0, 10.0), (10, 5))
    row = [[(2.0, 5.0), (9.0, 5.0)], [(9.4, 5.0), (10.1, 5.0)], [(10.7, 5.0), (18.0, 5.0)]]
    joined = arrange(lines_on(surface, row), surface, speed=SPEED)
    assert (joined.curves.count, joined.dropped_runs) == (2, 0)
    places = positions(surface, joined.curves.points)
    assert sorted(np.ptp(places[slice(*joined.curves.offsets[run : run + 2])], axis=0)[0] for run in (0, 1)) == (
        pytest.approx([7.3, 8.1])
    )
    crossed = [*row[:2], [(10.5, 0.5), (10.5, 9.5)]]
    assert arrange(lines_on(surface, crossed), surface, speed=SPEED).curves.count == 2
    beside = [[(2.0, 5.0), (9.0, 5.0)], [(9.8, 5.0), (10.5, 5.0)], [(9.4, 5.3), (9.4, 9.0)]]
    apart = arrange(lines_on(surface, beside), surface, speed=SPEED)
    assert (apart.curves.count, apart.dropped_runs) == (2, 1)


def test_the_valve_decides_what_is_too_short_where_it_needs_more_than_a_spacing() -> None:
    surface = plate((20.0, 10.0), (10, 5))
    drawn = lines_on(surface, [[(2.0, 5.0), (10.0, 5.0)], [(2.0, 8.0), (3.5, 8.0)]])
    cell = straight_cell()
    slow = replace(cell, signals=replace(cell.signals, valve_close=0.08)).at_speed(20.0)
    assert slow.shortest_run == pytest.approx(1.6)
    assert slow.at_speed(10.0).shortest_run == pytest.approx(0.8)
    for shortest, left in ((0.0, 2), (1.5, 2), (slow.shortest_run, 1)):
        toolpath = arrange(drawn, surface, speed=SPEED, shortest=shortest)
        assert toolpath.curves.count == left
        assert toolpath.dropped_runs == 2 - left
    with pytest.raises(FieldError, match=r"every path of the part is shorter than 9 mm, .*valve_close_s"):
        arrange(drawn, surface, speed=SPEED, shortest=9.0)


def test_the_nozzle_stands_on_the_normal_at_the_stand_off() -> None:
    surface = spherical_cap(radius=30.0, angle=0.8, rings=30, jitter_seed=2)
    _, stream = planned(surface, spacing=2.0)
    outward = stream.tips / np.linalg.norm(stream.tips, axis=1, keepdims=True)
    axes = -rotation_of(stream.quaternions)[:, :, 2]
    cosine = np.einsum("ij,ij->i", axes, outward)[stream.deposit]
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 3.0
    radii = np.linalg.norm(stream.tips[stream.deposit], axis=1)
    np.testing.assert_allclose(radii, 30.0 + STANDOFF, atol=0.05)
    assert np.degrees(largest_lean(stream)) < 3.0


def test_the_tool_x_axis_follows_the_base_over_a_level_part() -> None:
    quaternions = tool_quaternions(np.array([[0.0, 0.0, 1.0]]), R_base_work=np.eye(3))
    np.testing.assert_allclose(rotation_of(quaternions)[0], np.diag([1.0, -1.0, -1.0]), atol=1e-12)


def test_surface_points_of_the_stream_lie_on_the_surface() -> None:
    surface = cylinder_patch(divisions=(40, 30))
    toolpath, stream = planned(surface, spacing=2.0)
    np.testing.assert_allclose(
        stream.surface_points[stream.deposit], positions(surface, toolpath.curves.points), atol=1e-9
    )


def test_travel_lifts_off_and_comes_down_along_the_nozzle_and_stops_at_its_corners() -> None:
    surface = spherical_cap(radius=30.0, angle=0.8, rings=30)
    _, stream = planned(surface, spacing=2.0)
    first, last = np.flatnonzero(stream.deposit)[[0, -1]]
    corners = np.flatnonzero(stream.stops & ~stream.deposit)
    for end, on_run, lifted in ((0, first, corners[1]), (-1, last, corners[-2])):
        axis = -rotation_of(stream.quaternions[on_run])[:, 2]
        np.testing.assert_allclose(stream.tips[lifted] - stream.tips[on_run], RETRACT * axis, atol=1e-9)
        assert stream.stops[end]
        assert stream.tips[end, 2] == pytest.approx(30.0 + 2 * RETRACT)
    edges = np.flatnonzero(stream.deposit[1:] != stream.deposit[:-1])
    on_run = np.where(stream.deposit[edges], edges, edges + 1)
    assert stream.stops[on_run].all()
    assert not stream.flow[~stream.deposit].any()
    np.testing.assert_allclose(stream.flow[stream.deposit], 2.0 * 0.5)
    assert (stream.levels[~stream.deposit] == -1).all()


def test_travel_keeps_off_the_part() -> None:
    surface = annulus(inner=10.0, outer=24.0, divisions=(90, 20))
    _, stream = planned(surface, spacing=2.0)
    distances = np.asarray(KDTree(surface.vertices).query(stream.tips[~stream.deposit])[0])
    lifts = stream.tips[~stream.deposit][:, 2] < RETRACT - 1e-9
    assert distances[~lifts].min() >= RETRACT / 2


def test_axis_noise_is_smoothed_away_and_the_mean_kept() -> None:
    arcs = np.linspace(0.0, 60.0, 241)
    angle = 2 * np.pi * arcs / 60.0
    clean = np.column_stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.ones(241)])
    clean = unit(clean)
    noisy: FloatArray = clean + np.random.default_rng(0).normal(scale=np.radians(0.5), size=clean.shape)
    noisy[-1] = noisy[0]
    noisy = unit(noisy)
    smooth = smoothed_axes(noisy, arcs, closed=True, max_tilt=MAX_TILT)
    before, after = (np.degrees(np.linalg.norm(axes - clean, axis=1)).mean() for axes in (noisy, smooth))
    assert after < 0.4 * before
    np.testing.assert_allclose(smooth[0], smooth[-1], atol=1e-12)


def over_a_fillet(turn: float, *, radius: float = 2.0) -> tuple[FloatArray, FloatArray]:
    """Return arc lengths and normals of a run over a fillet in the middle of 40 mm that turns by an angle [degrees]."""
    arcs = np.linspace(0.0, 40.0, 801)
    half = np.radians(turn) / 2.0
    angles = np.clip((arcs - 20.0) / radius, -half, half)
    return arcs, np.column_stack([np.sin(angles), np.zeros_like(arcs), np.cos(angles)])


def leans_of(axes: FloatArray, normals: FloatArray) -> FloatArray:
    """Return the (k,) angles between axes and normals [rad]."""
    return np.arctan2(np.linalg.norm(np.cross(axes, normals), axis=1), np.einsum("ij,ij->i", axes, normals))


def bend_of(axes: FloatArray, arcs: FloatArray) -> float:
    """Return the largest second derivative of the angle of axes in the x-z plane [rad/mm2]."""
    angles = np.arctan2(axes[:, 0], axes[:, 2])[::5]
    return float(np.abs(np.diff(angles, n=2)).max()) / (arcs[5] - arcs[0]) ** 2


@pytest.mark.parametrize(("turn", "wanted"), [(10.0, 0.02), (30.0, 0.04), (30.0, 0.02)])
def test_over_a_fillet_the_tool_turns_ahead_no_more_suddenly_than_wanted(turn: float, wanted: float) -> None:
    arcs, normals = over_a_fillet(turn)
    short = smoothed_axes(normals, arcs, closed=False, max_tilt=MAX_TILT)
    axes = smoothed_axes(normals, arcs, closed=False, max_tilt=MAX_TILT, largest_bend=wanted)
    assert bend_of(short, arcs) > 1.3 * wanted
    # As much as that, and no less: the nozzle leans no more than it has to.
    assert bend_of(axes, arcs) == pytest.approx(wanted, rel=0.03)
    assert leans_of(axes, normals).max() < MAX_TILT


def test_where_a_longer_window_would_lean_too_far_the_tool_turns_as_gently_as_its_cone_allows() -> None:
    arcs, normals = over_a_fillet(60.0)
    axes = smoothed_axes(normals, arcs, closed=False, max_tilt=MAX_TILT, largest_bend=0.01)
    assert leans_of(axes, normals).max() == pytest.approx(MAX_TILT, abs=1e-3)
    assert (
        0.01 < bend_of(axes, arcs) < 0.7 * bend_of(smoothed_axes(normals, arcs, closed=False, max_tilt=MAX_TILT), arcs)
    )


def test_the_window_follows_from_the_normals_without_jumps_and_stays_short_where_nothing_asks_for_more() -> None:
    arcs, normals = over_a_fillet(30.0)
    near = unit(normals + np.random.default_rng(0).normal(scale=1e-9, size=normals.shape))
    one, other = (
        smoothed_axes(each, arcs, closed=False, max_tilt=MAX_TILT, largest_bend=0.03) for each in (normals, near)
    )
    assert np.abs(one - other).max() < 1e-4
    short, gentle = (
        smoothed_axes(normals, arcs, closed=False, max_tilt=MAX_TILT, largest_bend=bend) for bend in (np.inf, 1.0)
    )
    np.testing.assert_array_equal(short, gentle)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 1000), tilt=st.floats(0.0, 50.0), bend=st.floats(0.0, 2.0), closed=st.booleans())
def test_no_axis_leans_more_than_it_may_however_rough_the_normals(
    seed: int, tilt: float, bend: float, *, closed: bool
) -> None:
    generator = np.random.default_rng(seed)
    arcs = np.append(0.0, np.cumsum(generator.uniform(0.01, 0.6, 60)))
    normals = unit(np.array([0.0, 0.0, 1.0]) + generator.normal(scale=0.6, size=(61, 3)))
    axes = smoothed_axes(normals, arcs, closed=closed, max_tilt=float(np.radians(tilt)), largest_bend=bend)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-12)
    assert np.degrees(leans_of(axes, normals)).max() <= tilt + 1e-6


def test_an_axis_over_a_crease_leans_to_the_edge_of_its_cone_and_no_farther_elsewhere() -> None:
    arcs = np.linspace(0.0, 20.0, 81)
    angle = np.where(arcs < 10.0, -0.6, 0.6)
    normals = np.column_stack([np.sin(angle), np.zeros(81), np.cos(angle)])
    axes = smoothed_axes(normals, arcs, closed=False, max_tilt=MAX_TILT)
    leans = leans_of(axes, normals)
    assert leans.max() == pytest.approx(MAX_TILT, abs=1e-7)
    assert leans[np.abs(arcs - 10.0) > 4.0].max() < 1e-3


def test_the_mean_lean_is_that_over_the_length_and_the_largest_that_of_any_pose() -> None:
    surface = spherical_cap(radius=30.0, angle=0.8, rings=30, jitter_seed=2)
    _, stream = planned(surface, spacing=2.0)
    assert 0.0 < mean_lean(stream) < largest_lean(stream)


# All parts of a program together lay what one deposit asks for, or it is said where not.


def deposit(count: int = 11, *, start: int = 0) -> PoseStream:
    """A straight bead, a pose a millimetre."""
    places = np.column_stack([np.arange(start, start + count, dtype=np.float64), np.zeros(count), np.ones(count)])
    return PoseStream(
        tips=places,
        quaternions=np.tile([0.0, 1.0, 0.0, 0.0], (count, 1)),
        normals=np.tile([0.0, 0.0, 1.0], (count, 1)),
        runs=np.zeros(count, dtype=np.int64),
        levels=np.zeros(count, dtype=np.int64),
        layers=np.zeros(count, dtype=np.int64),
        deposit=np.ones(count, dtype=np.bool_),
        stops=np.isin(np.arange(count), [0, count - 1]),
        arcs=np.arange(count, dtype=np.float64),
        flow=np.full(count, 0.5),
        standoff=1.0,
    )


def faded(stream: PoseStream, rows: slice, shares: list[float]) -> PoseStream:
    flow = stream.flow.copy()
    flow[rows] *= shares
    return replace(stream, flow=flow)


def test_beads_that_meet_or_fade_into_each_other_are_one() -> None:
    whole = deposit()
    check_sum(whole, [whole.between(0, 6), whole.between(5, 11)])
    fading, growing = [1.0, 2 / 3, 1 / 3, 0.0], [0.0, 1 / 3, 2 / 3, 1.0]
    check_sum(
        whole, [faded(whole.between(0, 6), slice(2, 6), fading), faded(whole.between(2, 11), slice(0, 4), growing)]
    )


def test_what_is_missing_or_laid_twice_or_elsewhere_is_told_with_its_place() -> None:
    whole = deposit()
    with pytest.raises(
        VerificationError, match=r"deposit 0 mm3 in run 1 at \(5.50, 0.00, 0.00\) mm, the paths ask for 0.5"
    ):
        check_sum(whole, [whole.between(0, 6), whole.between(6, 11)])
    with pytest.raises(VerificationError, match="deposit 1 mm3 in run 1"):
        check_sum(whole, [whole.between(0, 7), whole.between(5, 11)])
    with pytest.raises(VerificationError, match="part 2 deposits material in its run 1"):
        check_sum(whole, [whole, deposit(3, start=20)])


def test_a_line_that_is_passed_twice_asks_for_both() -> None:
    once = deposit()
    twice = replace(
        once,
        **{
            name: np.concatenate([getattr(once, name)] * 2)
            for name in ("tips", "quaternions", "normals", "levels", "layers", "deposit", "stops", "arcs", "flow")
        },
        runs=np.repeat([0, 1], once.count),
    )
    check_sum(twice, [once, once])
    with pytest.raises(VerificationError, match="the paths ask for 1"):
        check_sum(twice, [once])


# How many beads lie across a ridge: the nearest whole number, and no change of it for a short stretch.


@pytest.mark.parametrize(
    ("width", "fewest", "beads"),
    # Level curves that cross are one more than the fewest. Of 3.5 spacings three beads would miss 0.2, four lay 0.075
    # twice.
    [(6.8, 5, 7), (7.4, 7, 7), (7.6, 7, 8), (8.0, 7, 8), (3.5, 3, 4), (1.2, 1, 1)],
)
def test_as_many_beads_as_fit(width: float, fewest: int, beads: int) -> None:
    places = np.ones(5)
    counts = bead_counts(width * places, np.full(5, fewest), places)
    np.testing.assert_array_equal(counts, beads)


@pytest.mark.parametrize(("bump", "beads"), [(0.5, 20), (4.0, 21)])
def test_a_short_stretch_is_not_worth_a_change(bump: float, beads: int) -> None:
    # Of 20.2 spacings 20 beads fit, of 20.8 there fit 21: (0.8^2 - 0.2^2) a spacing are saved, two changes cost one.
    widths = np.concatenate([np.full(20, 20.2), np.full(10, 20.8), np.full(20, 20.2)])
    lengths = np.concatenate([np.ones(20), np.full(10, bump / 10), np.ones(20)])
    counts = bead_counts(widths, np.full(50, 19), lengths)
    assert set(counts[20:30].tolist()) == {beads}
    assert set(counts[:20].tolist()) == {20}


def test_the_number_follows_level_curves_through_a_tip() -> None:
    # A wedge: where the width reaches 8 spacings two more level curves cross, and a bead on the ridge goes on as one.
    widths = np.linspace(6.6, 9.4, 40)
    fewest = np.where(widths < 8.0, 5, 7)
    counts = bead_counts(widths, fewest, np.full(40, 0.5))
    assert (np.diff(counts) >= 0).all()
    assert np.abs(counts - widths).max() < 1.0
