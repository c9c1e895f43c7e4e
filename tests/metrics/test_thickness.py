"""The simulated layer: flat where flow fits the spacing, uneven where it does not, no volume lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import splu

from geoprint.config import load_cell
from geoprint.errors import InputError
from geoprint.geometry import closest, cotangent_laplacian, diagonal_matrix, lumped_mass
from geoprint.metrics import LevelledLayer, Levelling, Thickness, stretches_of_poses, uniformity
from geoprint.metrics.coverage import (
    _share,  # pyright: ignore[reportPrivateUsage]
    strip_widths,
)
from geoprint.metrics.deposited import Samples
from geoprint.metrics.executed_flow import deposited_volume, flow_by_length, flow_by_time, flow_of_all
from geoprint.metrics.oracle import Places
from geoprint.metrics.thickness import add_polynomials
from geoprint.model import FloatArray, PoseStream, Process, Surface
from geoprint.process import following_flow
from tests.meshes import cylinder_patch, disc, plate, spherical_cap
from tests.metrics.deposits import circle, deposited, rectangle_line, straight_line


def process(layer_height: float) -> Process:
    return replace(load_cell(None).process, layer_height=layer_height)


def lines_at(heights: list[float]) -> PoseStream:
    lines = [straight_line((0.0, y), (40.0, y), points=161) for y in heights]
    return deposited(lines, range(len(lines)))


def fine_plate() -> Surface:
    return plate((40.0, 30.0), (40, 30), jitter_seed=1)


def followed(stream: PoseStream, surface: Surface, *, spacing: float, layer_height: float) -> FloatArray:
    widths = uniformity(stream, surface, spacing=spacing).pose_widths
    return following_flow(widths, deposit=stream.deposit, spacing=spacing, process=process(layer_height))


def layer_of(stream: PoseStream, surface: Surface, flow: FloatArray, *, spacing: float = 2.0) -> Thickness:
    """Return the layer that a flow along a stream leaves, in mm."""
    pieces = stretches_of_poses(stream, spacing=spacing)
    return LevelledLayer(Levelling(surface, spacing=spacing), pieces.places)(pieces.volumes(flow))


def test_lines_one_spacing_apart_make_an_even_layer_of_the_right_height() -> None:
    stream = lines_at([1.0 + 2.0 * k for k in range(15)])
    found = layer_of(stream, fine_plate(), np.full(stream.count, 2.0 * 0.5))
    assert found.mean == pytest.approx(0.5, rel=1e-4)
    # What single lines leave after 32 steps: a wave of 0.0033 of the mean, and as much again at the rim.
    assert 0.002 < found.cv < 0.003
    assert found.smallest > 0.5 * 0.992
    assert found.largest < 0.5 * 1.008


def test_rows_shifted_by_a_tenth_in_turn_vary_by_as_much_as_the_heat_equation_has_it() -> None:
    shift = 0.1 * 2.0
    stream = lines_at([1.0 + 2.0 * k + shift * (-1) ** k for k in range(15)])
    found = layer_of(stream, fine_plate(), np.full(stream.count, 2.0))
    # Of lines at (k + 1/2) w + s (-1)^k the longest wave has the length 2 w and the amplitude 2 sin(pi s / w), which
    # 32 implicit steps let through by (1 + (0.6 pi)^2 / 2 / 32)^-32.
    left = (1.0 + (0.6 * np.pi) ** 2 / 2.0 / 32.0) ** -32
    assert found.cv == pytest.approx(2.0 * np.sin(np.pi * 0.1) * left / np.sqrt(2.0), rel=0.02)
    assert found.cv == pytest.approx(0.078, abs=0.002)


@pytest.mark.parametrize("squeezed", [0.0, 0.999, 1.0 - 1e-7])
def test_a_layer_is_what_32_implicit_steps_leave_however_thin_the_triangles_are(squeezed: float) -> None:
    # The middle column of vertices is drawn towards the one beside it.
    surface = plate((20.0, 20.0), (40, 40), jitter_seed=1)
    vertices = surface.vertices.copy()
    columns = np.round(vertices[:, 0] / 0.5)
    left, middle = vertices[columns == 20], columns == 21
    vertices[middle] += squeezed * (left - vertices[middle])
    surface = Surface(vertices=vertices, faces=surface.faces, name="squeezed")
    stream = lines_at([3.0, 5.0, 12.0])
    pieces = stretches_of_poses(stream, spacing=2.0)
    inside = (pieces.places[:, 0] > 0.0) & (pieces.places[:, 0] < 20.0)
    places, volumes = pieces.places[inside], pieces.volumes(np.ones(stream.count))[inside]
    levelling = Levelling(surface, spacing=2.0)
    layer = LevelledLayer(levelling, places)
    found = layer.fields(volumes[:, None])[:, 0]
    fine = levelling.surface
    masses = lumped_mass(fine)
    solve = splu(csc_array(diagonal_matrix(masses) + 0.5 * 1.2**2 / 32 * cotangent_laplacian(fine))).solve
    landed, _ = closest(fine, places)
    wanted = np.bincount(fine.faces[landed.faces].ravel(), (landed.weights * volumes[:, None]).ravel(), len(masses))
    for _ in range(32):
        wanted = masses * solve(wanted)
    assert found @ masses == pytest.approx(volumes.sum(), rel=1e-9)
    off = found - wanted / masses
    assert np.sqrt(np.average(off**2, weights=masses)) < 5e-4
    # Triangles far below a thousandth of the spacing exchange as fast as needed to be even, not as fast as they would.
    assert np.abs(off).max() < (2e-4 if squeezed == 0.0 else 0.02)


def test_bare_area_counts_as_what_it_is() -> None:
    # Rows on the lower half alone: a thickness of 1 there and of 0 above, but for a soft edge.
    stream = lines_at([1.0 + 2.0 * k for k in range(7)])
    found = layer_of(stream, plate((40.0, 28.0), (40, 28)), np.full(stream.count, 2.0))
    assert found.mean == pytest.approx(0.5, rel=1e-3)
    assert found.smallest == pytest.approx(0.0, abs=1e-3)
    # An edge of the normal distribution takes 2 s / sqrt(pi) of a step's variance, s = 1.2 mm, of 28 mm.
    assert found.cv == pytest.approx(np.sqrt(1.0 - 4.0 * 1.2 / np.sqrt(np.pi) / 28.0), rel=0.01)
    assert found.within_5_percent == pytest.approx(0.5 - 1.645 * 1.2 / 28.0, abs=0.01)


def test_rows_that_draw_apart_like_a_wedge_are_as_thin_as_they_are_far_apart() -> None:
    # The k-th of 15 rows is (k + 1/2) w apart from the first corner, w from 1.8 to 2.2 mm along x.
    lines = [straight_line((0.0, (k + 0.5) * 1.8), (40.0, (k + 0.5) * 2.2), points=161) for k in range(15)]
    stream = deposited(lines, range(15))
    wedge = plate((40.0, 27.0), (40, 27))
    vertices = wedge.vertices.copy()
    vertices[:, 1] *= 1.0 + vertices[:, 0] / 40.0 * (33.0 / 27.0 - 1.0)
    found = layer_of(stream, Surface(vertices, wedge.faces), np.full(stream.count, 2.0))
    # Thickness 2 / w over the area, which grows with w: weights w dw from 1.8 to 2.2.
    assert found.mean == pytest.approx(2.0 / 2.0, rel=0.005)
    assert found.cv == pytest.approx(np.sqrt(4.0 * np.log(2.2 / 1.8) / 0.4 / 2.0 - 1.0), rel=0.05)


def test_a_cylinder_is_measured_as_the_plate_it_was_rolled_from() -> None:
    heights = [1.0, 3.2, 5.0, 7.1, 9.0, 11.3, 13.0]
    flat = layer_of(lines_at(heights), plate((40.0, 14.0), (60, 24)), np.full(7 * 161, 2.0))
    surface = cylinder_patch(radius=40.0 / 1.5, angle=1.5, length=14.0, divisions=(60, 24))
    turn = lines_at(heights).surface_points[:, 0] / (40.0 / 1.5) - 0.75
    y = lines_at(heights).surface_points[:, 1]
    points = np.column_stack([40.0 / 1.5 * np.sin(turn), y, 40.0 / 1.5 * np.cos(turn)])
    rolled = layer_of(deposited(np.split(points, 7), range(7)), surface, np.full(7 * 161, 2.0))
    assert rolled.cv == pytest.approx(flat.cv, abs=2e-4)


def test_the_laid_volume_is_the_volume_of_the_layer() -> None:
    stream = deposited([circle(7.0), circle(3.0)], [0, 1])
    found = layer_of(stream, disc(radius=10.0, rings=20), np.full(stream.count, 0.8))
    points = stream.surface_points
    deposited_there = 0.8 * np.linalg.norm(np.diff(points, axis=0), axis=1)[stream.deposited].sum()
    area = 0.5 * 120 * 10.0**2 * np.sin(2 * np.pi / 120)
    assert found.mean * area == pytest.approx(deposited_there, rel=1e-4)


def test_a_flow_that_doubles_from_end_to_end_is_reported_as_the_unevenness_that_it_is() -> None:
    stream = lines_at([1.0 + 2.0 * k for k in range(15)])
    found = layer_of(stream, fine_plate(), 1.0 + stream.surface_points[:, 0] / 40.0)
    # A linear ramp from 1 to 2: standard deviation 1 / sqrt(12), mean 1.5; levelling flattens only its ends.
    assert found.cv == pytest.approx(1.0 / np.sqrt(12.0) / 1.5, rel=0.03)


def test_flow_that_follows_the_width_evens_out_lines_that_draw_apart() -> None:
    stream = lines_at(np.cumsum([1.0, *np.linspace(1.5, 2.5, 14)]).tolist())
    found = uniformity(stream, fine_plate(), spacing=2.0)
    assert found.thickness.cv > 0.1
    assert found.followed.cv < found.thickness.cv / 4
    assert found.followed.mean == pytest.approx(1.0, rel=0.01)
    # What a program would deposit leaves the same layer.
    own = layer_of(stream, fine_plate(), followed(stream, fine_plate(), spacing=2.0, layer_height=0.5))
    assert (own.mean, own.cv) == (
        pytest.approx(0.5 * found.followed.mean, rel=1e-3),
        pytest.approx(found.followed.cv, rel=0.02),
    )


def test_contours_of_a_rectangle_leave_more_and_less_where_their_corners_are() -> None:
    # Rectangles whose last lines stay 3.6 mm apart: their strips are 2.8 mm wide.
    insets = [1.0 + 2.0 * k for k in range(7)]
    stream = deposited([rectangle_line((d, d), (40.0 - d, 29.6 - d)) for d in insets], range(7))
    surface = plate((40.0, 29.6), (40, 30), jitter_seed=1)
    found = uniformity(stream, surface, spacing=2.0)
    # Halfway in, away from corners, nothing is off; the middle between the last lines has 2 / 2.8 of a layer.
    assert found.thickness.within_5_percent > 0.6
    assert 0.05 < found.thickness.cv < 0.15
    assert found.followed.cv < 0.75 * found.thickness.cv


def test_the_width_at_a_pose_is_that_of_its_strip_on_every_level() -> None:
    polar = 0.95 - np.arange(0.0, 8.0) * 2.2 / 30.0
    lines = [circle(30.0 * np.sin(a), height=30.0 * np.cos(a)) for a in polar.tolist()]
    stream = deposited(lines, range(8))
    stream = replace(stream, flow=np.zeros(stream.count))
    widths = uniformity(stream, spherical_cap(radius=30.0, angle=1.0, rings=32), spacing=2.0).pose_widths
    inner = (stream.levels > 0) & (stream.levels < 7)
    np.testing.assert_allclose(widths[inner], 1.1, atol=0.012)
    # Outermost: half of the spacing inwards, and 0.05 rad to the border.
    outer = (1.1 + 1.5 / 2.0 * np.sin(0.975) / np.sin(0.95)) - 0.55
    np.testing.assert_allclose(widths[stream.levels == 0], outer, atol=0.02)


def test_rows_of_triangles_that_run_along_the_paths_do_not_bias_the_widths() -> None:
    stream = deposited([circle(r, points=361) for r in np.arange(14.5, 0.0, -1.0)], range(15))
    surface = disc(radius=15.0, rings=22)
    widths = uniformity(stream, surface, spacing=1.0).pose_widths
    means = [widths[stream.deposit & (stream.levels == level)].mean() for level in range(1, 13)]
    # Triangles judged by their middles alone were off by up to 0.8 %, and the layer by 0.3 %.
    np.testing.assert_allclose(means, 1.0, atol=0.002)
    flow = following_flow(widths, deposit=stream.deposit, spacing=1.0, process=process(0.5))
    # No more than what single lines leave, and the middle, where there is no half of a spacing to the last one.
    assert layer_of(stream, surface, flow, spacing=1.0).cv < 0.007


def test_widths_stay_true_where_the_budget_of_work_leaves_out_much_of_the_surface() -> None:
    stream = deposited([circle(r, points=361) for r in np.arange(14.5, 0.0, -1.0)], range(15))
    found = uniformity(stream, disc(radius=15.0, rings=22), spacing=1.0, windows=100_000)
    assert found.unknown > 0.3
    inner = stream.deposit & (stream.levels > 0) & (stream.levels < 13)
    # Without what was left out, strips seemed narrower here and there: by 9 % in the mean.
    assert found.pose_widths[inner].std() < 0.04


def test_flow_is_width_times_spacing_times_layer_height_within_its_bounds() -> None:
    widths, deposit = np.array([1.0, 1.2, 0.1, 5.0, 1.0]), np.array([True, True, True, True, False])
    found = following_flow(widths, deposit=deposit, spacing=2.0, process=process(0.5))
    np.testing.assert_allclose(found, [1.0, 1.2, 0.5, 1.5, 0.0])
    narrow = replace(process(0.5), least_flow=0.9, most_flow=1.1)
    found = following_flow(widths, deposit=deposit, spacing=2.0, process=narrow)
    np.testing.assert_allclose(found, [1.0, 1.1, 0.9, 1.1, 0.0])
    with pytest.raises(InputError, match="positive spacing and layer height"):
        following_flow(widths, deposit=deposit, spacing=0.0, process=process(0.5))


# Widths of strips and shares of small triangles, by hand: areas laid at known places along runs of few samples.


def samples(*lengths: tuple[float, int]) -> Samples:
    """Runs of these lengths, each cut into so many gaps."""
    runs = np.concatenate([np.full(gaps + 1, run) for run, (_, gaps) in enumerate(lengths)])
    arcs = np.concatenate([np.linspace(0.0, length, gaps + 1) for length, gaps in lengths])
    places = Places(np.zeros(len(runs), dtype=np.int64), np.zeros(len(runs), dtype=np.complex128))
    return Samples(places, runs, arcs)


def widths(
    along: Samples,
    pieces: list[tuple[int, float, float]],
    *,
    closed: tuple[bool, ...],
    spacing: float,
    points: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Of pieces of surface, each with its run, its place along it and its area; runs lie apart but where told."""
    runs, arcs, areas = (np.array(column) for column in zip(*pieces, strict=True))
    apart = np.stack([along.arcs, 10.0 * along.runs, np.zeros(along.runs.size)], axis=1, dtype=np.float64)
    where = apart if points is None else points
    return strip_widths(along, runs, arcs, areas, points=where, closed=np.array(closed), spacing=spacing)


FIVE = [(0, float(k), float(2**k)) for k in range(5)]


@pytest.mark.parametrize(
    ("gaps", "spacing", "wanted"),
    [
        # One sample to either side.
        (4, 1.0, [3 / 1.5, 7 / 2.5, 14 / 3, 28 / 2.5, 24 / 1.5]),
        (4, 2.0, [3 / 1.5, 7 / 2.5, 14 / 3, 28 / 2.5, 24 / 1.5]),
        # Two.
        (6, 4.0, [7 / 2.5, 15 / 3.5, 31 / 4.5, 62 / 5, 124 / 4.5, 120 / 3.5, 112 / 2.5]),
        # No farther than to less than half of a short run.
        (4, 20.0, [3 / 1.5, 7 / 2.5, 14 / 3, 28 / 2.5, 24 / 1.5]),
        (5, 20.0, [7 / 2.5, 15 / 3.5, 31 / 4.5, 62 / 4.5, 60 / 3.5, 56 / 2.5]),
        (1, 20.0, [3 / 1, 3 / 1]),
    ],
)
def test_a_width_is_the_area_within_half_a_spacing_over_its_length(
    gaps: int, spacing: float, wanted: list[float]
) -> None:
    pieces = [(0, float(k), float(2**k)) for k in range(gaps + 1)]
    found, lengths = widths(samples((float(gaps), gaps)), pieces, closed=(False,), spacing=spacing)
    assert found * spacing == pytest.approx(wanted)
    assert lengths == pytest.approx([0.5, *[1.0] * (gaps - 1), 0.5])


@pytest.mark.parametrize(
    ("gaps", "spacing", "wanted"),
    [
        (4, 2.0, [11 / 3, 7 / 3, 14 / 3, 13 / 3, 11 / 3]),
        # No farther than once around.
        (4, 100.0, [11 / 3, 7 / 3, 14 / 3, 13 / 3, 11 / 3]),
        (5, 2.0, [19 / 3, 7 / 3, 14 / 3, 28 / 3, 25 / 3, 19 / 3]),
        (5, 4.0, [31 / 5] * 6),
        (3, 4.0, [7 / 3] * 4),
    ],
)
def test_a_closed_run_goes_on_behind_its_end(gaps: int, spacing: float, wanted: list[float]) -> None:
    pieces = [(0, float(k), float(2**k)) for k in range(gaps)]
    found, lengths = widths(samples((float(gaps), gaps)), pieces, closed=(True,), spacing=spacing)
    assert found * spacing == pytest.approx(wanted)
    assert lengths == pytest.approx([0.5, *[1.0] * (gaps - 1), 0.5])
    # Whether a piece is taken for the start or for the end.
    other = [*pieces[1:], (0, float(gaps), 1.0)]
    assert widths(samples((float(gaps), gaps)), other, closed=(True,), spacing=spacing)[0] == pytest.approx(found)


def test_a_piece_between_two_samples_is_shared_by_its_place_and_one_beyond_the_end_belongs_to_it() -> None:
    along = samples((30.0, 3))
    found, lengths = widths(along, [(0, 12.5, 4.0), (0, 40.0, 8.0), (0, -3.0, 16.0)], closed=(False,), spacing=1.0)
    # Areas of 16, 3, 1, 8, and one sample to either side.
    assert found == pytest.approx([19 / 15, 20 / 25, 12 / 25, 9 / 15])
    assert lengths == pytest.approx([5.0, 10.0, 10.0, 5.0])


def test_runs_keep_to_themselves_and_each_has_its_own_reach() -> None:
    along = samples((4.0, 4), (2.5, 5), (4.0, 4))
    pieces = [*FIVE, (2, 1.0, 6.0), *((1, 0.5 * k, float(2**k)) for k in range(6))]
    found, lengths = widths(along, pieces, closed=(False, False, True), spacing=2.0)
    assert found[:5] * 2.0 == pytest.approx([3 / 1.5, 7 / 2.5, 14 / 3, 28 / 2.5, 24 / 1.5])
    # Two samples of half a millimetre to either side.
    assert found[5:11] * 2.0 == pytest.approx([7 / 1.25, 15 / 1.75, 31 / 2.25, 62 / 2.25, 60 / 1.75, 56 / 1.25])
    assert found[11:] * 2.0 == pytest.approx([2.0, 2.0, 2.0, 0.0, 2.0])
    assert lengths[5:11] == pytest.approx([0.25, 0.5, 0.5, 0.5, 0.5, 0.25])


@pytest.mark.parametrize("end", [(0, 4.0), (1, 0.0)])
def test_runs_that_meet_end_to_end_share_what_lies_beyond_the_corner_whoever_is_nearer(end: tuple[int, float]) -> None:
    """A run along x is split where it turns to go along y; rounding says whose the corner's surface is."""
    along = samples((4.0, 4), (4.0, 4))
    first = along.runs == 0
    points = np.column_stack([np.where(first, along.arcs, 4.0), np.where(first, 0.0, along.arcs), 0.0 * along.arcs])
    points[~first] += 1e-6
    found, _ = widths(
        along, [(0, 2.0, 1.0), (1, 2.0, 1.0), (*end, 6.0)], closed=(False, False), spacing=1.0, points=points
    )
    # Three square millimetres for each of the ends, and one sample to either side.
    half = [0.0, 1 / 2.5, 1 / 3, 4 / 2.5, 3 / 1.5]
    assert found == pytest.approx([*half, *half[::-1]])


@pytest.mark.parametrize(
    ("low", "high", "share"),
    [
        (-9.0, 9.0, 1.0), (-1.0, 1.0, 1.0), (0.0, 9.0, 0.5), (-9.0, 0.0, 0.5), (-0.5, 0.25, 0.375), (0.25, 0.75, 0.25),
        (-0.75, -0.25, 0.25), (1.5, 9.0, 0.0), (-9.0, -1.5, 0.0), (0.5, -0.5, 0.0), (0.9, 9.0, 0.05),
    ],
)  # fmt: skip
def test_a_triangle_holds_the_part_of_its_extent_that_lies_between_two_bounds(
    low: float, high: float, share: float
) -> None:
    """Two millimetres across, one to either side of its middle."""
    assert _share(np.array([2.0]), np.array([low]), np.array([high])).tolist() == pytest.approx([share])


# What a program lays: by time through a valve, by length wthis print has following flow the speed.


# Two lines of 40 mm at 10 mm/s, and 2 s of travel between them.
SPEED, BETWEEN = 10.0, 2.0


def lines() -> PoseStream:
    made = deposited([straight_line((0.0, y), (40.0, y)) for y in (0.0, 1.0)], (0, 1))
    return replace(made, flow=np.full(made.count, 0.4))


def times(stream: PoseStream) -> FloatArray:
    along = stream.surface_points[:, 0] / SPEED
    return along + stream.runs * (4.0 + BETWEEN)


MATERIAL = np.array([[0.0, 4.0], [6.0, 10.0]])


def test_at_the_set_speed_both_lay_what_was_planned() -> None:
    stream = lines()
    for found in (
        flow_by_time(stream, times(stream), MATERIAL, rate=0.4 * SPEED),
        flow_by_length(stream, times(stream), MATERIAL),
    ):
        np.testing.assert_allclose(found, 0.4)
        assert deposited_volume(stream, found) == pytest.approx(0.4 * 80.0)


def test_a_valve_lays_more_where_the_tip_is_slower_and_a_flow_that_follows_does_not() -> None:
    stream = lines()
    slow = np.where(stream.runs == 0, times(stream), 6.0 + 2.0 * (times(stream) - 6.0))
    material = np.array([[0.0, 4.0], [6.0, 14.0]])
    valve = flow_by_time(stream, slow, material, rate=0.4 * SPEED)
    np.testing.assert_allclose(valve, np.where(stream.runs == 0, 0.4, 0.8))
    assert deposited_volume(stream, valve) == pytest.approx(0.4 * SPEED * 12.0)
    np.testing.assert_allclose(flow_by_length(stream, slow, material), 0.4)


def test_what_opens_late_and_shuts_early_is_missing_at_the_ends() -> None:
    stream = lines()
    material = MATERIAL + np.array([[0.5, 0.0], [0.0, -1.0]])
    for found in (
        flow_by_time(stream, times(stream), material, rate=0.4 * SPEED),
        flow_by_length(stream, times(stream), material),
    ):
        x, second = stream.surface_points[:, 0], stream.runs == 1
        np.testing.assert_allclose(found[(~second & (x < 4.7)) | (second & (x > 30.3))], 0.0, atol=1e-12)
        np.testing.assert_allclose(found[(~second & (x > 5.6)) | (second & (x < 29.4))], 0.4)
        assert deposited_volume(stream, found) == pytest.approx(0.4 * 65.0)


def test_half_of_what_flows_while_a_flow_settles_lies_at_the_start_of_each_deposit() -> None:
    stream = lines()
    at_once, settled = (
        flow_by_time(stream, times(stream), MATERIAL, rate=0.4 * SPEED, settle=settle) for settle in (0.0, 0.5)
    )
    # Two lines get 0.25 s of the flow more each, in their first step.
    assert deposited_volume(stream, settled) - deposited_volume(stream, at_once) == pytest.approx(
        2.0 * 0.25 * 0.4 * SPEED
    )
    starts = np.flatnonzero(np.diff(stream.deposited.astype(int), prepend=0) == 1)
    np.testing.assert_array_equal(np.flatnonzero(settled != at_once), sorted([*starts, *(starts + 1)]))


def test_what_flows_while_the_tip_stands_comes_to_its_neighbours() -> None:
    stream = lines()
    points = stream.tips.copy()
    points[51] = points[50]
    waiting = times(stream) + np.where((np.arange(stream.count) > 50), 3.0, 0.0)
    found = flow_by_time(replace(stream, tips=points), waiting, np.array([[0.0, 7.0], [9.0, 13.0]]), rate=4.0)
    assert deposited_volume(replace(stream, tips=points), found) == pytest.approx(4.0 * 11.0)
    assert found.argmax() in (50, 51)


def test_parts_that_share_the_lines_lay_together_what_each_lays_of_them_wherever_they_end() -> None:
    stream = lines()
    count = stream.count
    middle = count // 4
    # One part lays the start of the first line, at twice its flow, the other the rest; both have the pose between them.
    first, second = stream.taken(np.arange(middle + 1)), stream.taken(np.arange(middle, count))
    found = flow_of_all(stream, [(second, second.flow), (first, 2.0 * first.flow)])
    assert deposited_volume(stream, found) == pytest.approx(
        deposited_volume(second, second.flow) + 2.0 * deposited_volume(first, first.flow)
    )
    np.testing.assert_allclose(found[:middle], 0.8)
    np.testing.assert_allclose(found[middle + 1 :], 0.4)
    assert 0.4 < found[middle] < 0.8


def test_beads_that_fade_over_one_another_add_to_one() -> None:
    stream = lines()
    half = stream.count // 2
    first, second = stream.taken(np.arange(half)), stream.taken(np.arange(half, stream.count))
    fading = np.linspace(1.0, 0.0, half)
    found = flow_of_all(
        stream, [(first, fading * first.flow), (first, (1.0 - fading) * first.flow), (second, second.flow)]
    )
    np.testing.assert_allclose(found, 0.4, atol=1e-9)


@pytest.mark.parametrize("block", [7, 50, 1024])
@pytest.mark.parametrize("count", [0, 1, 8, 21])
def test_polynomials_in_blocks_are_those_of_one_multiplication_after_the_other(block: int, count: int) -> None:
    rng = np.random.default_rng(1)
    matrix = csr_array(diags_array([1.0, -2.5, 0.5], offsets=[-7, 0, 6], shape=(211, 211)))
    before, now, coefficients = rng.random((211, 2)), rng.random((211, 2)), rng.random(count)
    total = before + now
    wanted, behind, ahead = total.copy(), before.copy(), now.copy()
    for coefficient in coefficients:
        behind, ahead = ahead, matrix @ ahead - behind
        wanted += coefficient * ahead
    first, columns = (places.astype(np.uint32) for places in (matrix.indptr, matrix.indices))
    values = np.asarray(matrix.data, dtype=np.float64)
    add_polynomials(first, columns, values, before, now, total, coefficients, block)
    np.testing.assert_allclose(total, wanted, rtol=1e-12)
