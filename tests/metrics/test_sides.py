"""Spacing to the left and to the right of any path: known answers, the law for shifted paths, contours as before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from geoprint import job_of, plan
from geoprint.errors import FieldError
from geoprint.geometry import closest
from geoprint.metrics import DistanceErrors, Uniformity, distance_errors, measure_paths, uniformity
from geoprint.metrics.spacing import judged_surface
from geoprint.model import FloatArray, Polylines, PoseStream, Source, Surface, SurfaceCurves
from tests.meshes import annulus, cylinder_patch, disc, plate, spherical_cap
from tests.metrics.deposits import circle, straight_line
from tests.metrics.test_uniformity import exact_contours, fine_plate, levels_of, measured_contours, rows


def polylines(lines: Sequence[FloatArray]) -> Polylines:
    return Polylines(np.concatenate(lines), np.cumsum([0, *map(len, lines)]))


def deposits_of(stream: PoseStream) -> Polylines:
    """What a stream deposits, without its levels."""
    kept = np.flatnonzero(stream.deposit)
    firsts = np.flatnonzero(np.diff(stream.runs[kept], prepend=-1))
    return Polylines(stream.surface_points[kept], np.append(firsts, kept.size))


def straight(heights: Sequence[float]) -> Polylines:
    """Rows along x over the plate: left of them is +y."""
    return polylines([straight_line((0.0, y), (40.0, y), points=11) for y in heights])


def test_each_side_has_its_own_spacing() -> None:
    found = measure_paths(fine_plate(), straight([1.0, 3.0, 5.0, 7.2]), spacing=2.0).sides
    assert sorted(set(found.left.ratios.round(6).tolist())) == [1.0, 1.1]
    assert sorted(set(found.right.ratios.round(6).tolist())) == [1.0, 1.1]
    assert found.left.mean == pytest.approx((1.0 + 1.0 + 1.1) / 3.0, abs=1e-6)
    # The last row has none to its left within three spacings, the first none to its right: a quarter of all samples.
    assert (found.left.none, found.right.none) == (0.25, 0.25)
    assert found.left.oblique == found.left.unknown == 0.0
    assert found.both.ratios.size == found.left.ratios.size + found.right.ratios.size


def test_every_second_row_shifted_by_a_tenth_is_reported_to_each_side() -> None:
    heights = [2.0 + 2.0 * k + 0.2 * (k % 2) for k in range(7)]
    found = measure_paths(fine_plate(), straight(heights), spacing=2.0).sides
    run = np.repeat(np.arange(7), np.diff(found.offsets))
    sides = found.sides()
    # Seen along +x: 2.2 mm to the left of an even row, 1.8 mm to its right; an odd one the other way round.
    even = run % 2 == 0
    for column, of_even, of_odd in ((0, 1.1, 0.9), (1, 0.9, 1.1)):
        there = ~np.isnan(sides[:, column])
        np.testing.assert_allclose(sides[there & even, column], of_even, atol=1e-6)
        np.testing.assert_allclose(sides[there & ~even, column], of_odd, atol=1e-6)
    for side in (found.left, found.right):
        assert side.mean == pytest.approx(1.0, abs=1e-6)
        assert side.cv == pytest.approx(0.1, abs=1e-6)
        assert side.within_5_percent == 0.0


def test_the_law_holds_on_a_curved_part_too() -> None:
    polar = [0.95 - (2.0 * k + 0.2 * (k % 2)) / 30.0 for k in range(9)]
    lines = [circle(30.0 * np.sin(a), height=30.0 * np.cos(a)) for a in polar]
    found = measure_paths(spherical_cap(radius=30.0, angle=1.0, rings=32), polylines(lines), spacing=2.0).sides
    for side in (found.left, found.right):
        assert side.percentile(1) == pytest.approx(0.9, abs=2e-3)
        assert side.percentile(99) == pytest.approx(1.1, abs=2e-3)
        assert side.cv == pytest.approx(0.1, abs=5e-3)


def outwards(found: Uniformity, stream: PoseStream) -> FloatArray:
    """The ratios of the sides whose neighbour is of the level outside."""
    sides = found.sides
    deposited = np.flatnonzero(stream.deposit)
    firsts = np.flatnonzero(np.diff(stream.runs[deposited], prepend=-1))
    # Runs that touch are one stretch, and of one level.
    levels = stream.levels[deposited][firsts][found.runs[sides.offsets[:-1]]]
    own = np.repeat(levels, np.diff(sides.offsets))
    outside = (sides.kinds == 0) & (levels[sides.nearest] == own[:, None] - 1)
    return sides.ratios[outside]


@pytest.mark.parametrize("name", ["plate", "cylinder", "cone", "cap"])
def test_on_exact_contours_the_outer_side_is_the_outward_figure(name: str) -> None:
    surface, stream, spacing = exact_contours(name)
    before, found = measured_contours(name), measure_paths(surface, deposits_of(stream), spacing=spacing)
    ratios, levels = outwards(found, stream), levels_of(before)
    assert ratios.size == levels.ratios.size
    assert ratios.std() / ratios.mean() == pytest.approx(levels.figures.cv, abs=1e-4)
    assert ratios.mean() == pytest.approx(levels.figures.mean, abs=1e-4)
    assert found.gap == pytest.approx(before.gap, abs=1e-4)
    assert found.thickness.cv == pytest.approx(before.thickness.cv, abs=1e-4)
    assert found.overlap == pytest.approx(before.overlap, abs=1e-4)
    assert found.length == pytest.approx(before.length, rel=1e-6)


@pytest.mark.parametrize("part", ["plate", "heart_apex_patch"])
def test_on_planned_contours_the_outer_side_is_the_outward_figure(part: str) -> None:
    job = job_of(surface=f"data/{part}.ply", unit="mm", spacing=3.5, backend="heat", robot=False, middle="plain")
    planned = plan(job)
    surface = planned.workpiece.surface
    before = levels_of(uniformity(planned.poses, surface, spacing=3.5))
    found = measure_paths(surface, deposits_of(planned.poses), spacing=3.5)
    ratios = outwards(found, planned.poses)
    assert before.figures.cv > 1e-3
    assert ratios.std() / ratios.mean() == pytest.approx(before.figures.cv, abs=1e-4)
    assert ratios.mean() == pytest.approx(before.figures.mean, abs=1e-4)


def test_a_spiral_has_neighbours_though_it_is_one_run() -> None:
    turn = np.linspace(6.0 * np.pi, 14.0 * np.pi, 2001)
    radius = 2.0 * turn / (2.0 * np.pi)
    line = np.column_stack([20.0 + radius * np.cos(turn), 15.0 + radius * np.sin(turn), np.zeros_like(turn)])
    inside = (line[:, :2] > 0.0).all(axis=1) & (line[:, 0] < 40.0) & (line[:, 1] < 30.0)
    assert inside.all()
    found = measure_paths(fine_plate(), polylines([line]), spacing=2.0).sides
    for side in (found.left, found.right):
        assert side.mean == pytest.approx(1.0, abs=5e-3)
        assert side.cv < 5e-3
    # Inside, the first turn has none within three spacings but across the middle; outside the last has none.
    assert found.right.none == pytest.approx(found.left.none, abs=0.3)
    assert found.right.none > 0.2


def test_one_stroke_to_and_fro_is_as_even_as_its_rows() -> None:
    pieces: list[FloatArray] = []
    for k in range(6):
        y, turn = 5.0 + 2.0 * k, np.linspace(-np.pi / 2.0, np.pi / 2.0, 41)
        ends = (10.0, 30.0) if k % 2 == 0 else (30.0, 10.0)
        pieces.append(straight_line((ends[0], y), (ends[1], y), points=41))
        if k < 5:
            side = 1.0 if k % 2 == 0 else -1.0
            pieces.append(np.column_stack([ends[1] + side * np.cos(turn), y + 1.0 + np.sin(turn), np.zeros(41)]))
    found = measure_paths(fine_plate(), polylines([np.concatenate(pieces)]), spacing=2.0).sides
    # Within a turn the path's own bend lies between: no row behind it counts as its neighbour.
    assert found.both.percentile(90) == pytest.approx(1.0, abs=1e-3)
    assert found.both.percentile(1) > 0.85
    assert 0.0 < found.both.oblique < 0.3


def test_runs_that_touch_end_to_end_are_one_stretch() -> None:
    halves = [straight_line((0.0, y), (20.0, y)) for y in (11.0, 13.0)]
    halves += [straight_line((40.0, y), (20.02, y)) for y in (11.0, 13.0)]
    found = measure_paths(fine_plate(), polylines(halves), spacing=2.0).sides
    np.testing.assert_allclose(found.both.ratios, 1.0, atol=1e-6)
    assert found.both.none == 0.5
    apart = [straight_line((0.0, 11.0), (20.0, 11.0)), straight_line((20.5, 11.0), (40.0, 11.0))]
    found = measure_paths(fine_plate(), polylines(apart), spacing=2.0).sides
    # What lies straight ahead is on neither side.
    assert found.both.none == 1.0


def test_beyond_the_end_of_a_row_there_is_no_neighbour() -> None:
    lines = [straight_line((0.0, 11.0), (20.0, 11.0)), straight_line((0.0, 13.0), (40.0, 13.0))]
    found = measure_paths(fine_plate(), polylines(lines), spacing=2.0).sides
    np.testing.assert_allclose(found.both.ratios, 1.0, atol=1e-3)
    assert found.right.oblique > 0.0


def test_the_way_runs_over_the_surface_and_ends_at_a_rim() -> None:
    profile = np.array([[-10.0, 0.0], [0.0, 0.0], [0.0, -5.0], [1.0, -5.0], [1.0, 0.0], [11.0, 0.0]])
    vertices = np.array([[x, y, z] for x, z in profile for y in (0.0, 40.0)])
    faces = np.array([face for i in range(0, 10, 2) for face in ((i, i + 2, i + 1), (i + 1, i + 2, i + 3))])
    y = np.linspace(0.0, 40.0, 81)
    lines = [np.column_stack([np.full(81, x), y, np.zeros(81)]) for x in (0.0, 1.0)]
    found = measure_paths(Surface(vertices, faces), polylines(lines), spacing=11.0).sides
    np.testing.assert_allclose(found.both.ratios, 1.0, atol=1e-6)
    assert (found.left.none, found.right.none) == (0.5, 0.5)


def test_behind_a_slit_there_is_no_neighbour() -> None:
    # A slit of the plate between two rows: ways around its ends are none to the side.
    whole = plate((40.0, 30.0), (40, 30))
    middles = whole.vertices[whole.faces].mean(axis=1)
    kept = ~((abs(middles[:, 1] - 15.5) < 0.5) & (middles[:, 0] > 10.0) & (middles[:, 0] < 30.0))
    found = measure_paths(
        Surface(whole.vertices, whole.faces[kept]),
        polylines([straight_line((12.0, y), (28.0, y)) for y in (14.5, 16.5)]),
        spacing=2.0,
    ).sides
    assert found.both.none == 1.0


def test_what_the_budget_leaves_over_is_unknown() -> None:
    found = measure_paths(fine_plate(), straight([1.0, 3.0, 5.0]), spacing=2.0, windows=2000)
    assert found.sides.both.unknown > 0.1
    assert found.sides.both.none + found.sides.both.unknown < 1.0
    assert found.unknown > 0.1


def test_the_largest_hole_is_the_largest_piece_that_no_path_covers() -> None:
    # Strips of 2 * 0.55 spacings to both sides of each row are covered: bare are 0.9, 5.8 and 18.9 mm.
    found = measure_paths(fine_plate(), straight([2.0, 10.0]), spacing=2.0)
    assert found.hole == pytest.approx(40.0 * (30.0 - 10.0 - 1.1), rel=2e-3)
    assert found.gap * 1200.0 == pytest.approx(40.0 * (0.9 + 5.8 + 18.9), rel=5e-3)


def test_a_path_off_the_surface_is_refused_unless_allowed() -> None:
    above = straight([5.0, 7.0])
    above = Polylines(above.points + np.array([0.0, 0.0, 0.3]), above.offsets)
    with pytest.raises(
        FieldError, match=r"lie up to 0\.3 mm off the part, farthest in run 1 at .* allowed are 0\.2 mm"
    ):
        measure_paths(fine_plate(), above, spacing=2.0)
    found = measure_paths(fine_plate(), above, spacing=2.0, offset_up_to=0.4)
    assert (found.off_mean, found.off_max) == (pytest.approx(0.3), pytest.approx(0.3))
    np.testing.assert_allclose(found.sides.left.ratios, 1.0, atol=1e-6)


def test_the_measure_does_not_depend_on_where_runs_begin_nor_how_finely_they_are_cut() -> None:
    coarse, fine = straight([5.0, 7.0]), rows([5.0, 7.0])
    found = [measure_paths(fine_plate(), curves, spacing=2.0) for curves in (coarse, deposits_of(fine))]
    assert found[0].length == pytest.approx(found[1].length)
    np.testing.assert_allclose(found[0].sides.ratios, found[1].sides.ratios, atol=1e-9)


# How far curves lie from the distance that they promise: known answers by formula, on several shapes.


SPACING = 2.0


def on(surface: Surface, lines: Sequence[FloatArray]) -> SurfaceCurves:
    """Return (k, 3) lines as curves of a surface."""
    points, _ = closest(surface, np.concatenate(lines))
    closed = np.array([len(line) > 1 and bool(np.allclose(line[0], line[-1])) for line in lines])
    return SurfaceCurves(points, np.cumsum([0, *(len(line) for line in lines)]), closed)


def errors_of(
    surface: Surface, source: Sequence[FloatArray], lines: Sequence[FloatArray], rows: Sequence[float]
) -> DistanceErrors:
    each = np.repeat(np.asarray(rows, dtype=np.float64), [len(line) for line in lines])
    return distance_errors(
        judged_surface(surface, spacing=SPACING), Source(on(surface, source)), on(surface, lines),
        (each + 0.5) * SPACING, surface=surface, spacing=SPACING,
    )  # fmt: skip


def test_lines_on_a_plate_are_off_by_what_they_were_moved() -> None:
    surface = plate((30.0, 20.0), (20, 13), jitter_seed=1)
    edge = straight_line((0.0, 0.0), (30.0, 0.0), points=31)
    lines = [straight_line((0.0, y), (30.0, y), points=11) for y in (1.0, 3.1, 4.8, 19.0)]
    found = errors_of(surface, [edge], lines, [0, 1, 2, 9])
    of_line = np.round(found.places[:, 1], 6)
    for y, off in ((1.0, 0.0), (3.1, 0.05), (4.8, -0.1), (19.0, 0.0)):
        np.testing.assert_allclose(found.errors[of_line == y], off, atol=1e-9)
    assert found.mean == pytest.approx(-0.0125)
    assert found.deviation == pytest.approx(np.std([0.0, 0.05, -0.1, 0.0]))
    assert found.largest == pytest.approx(0.1)
    assert found.unknown == 0.0


def test_a_curve_that_rises_promises_more_and_more() -> None:
    surface = plate((30.0, 20.0), (20, 13), jitter_seed=2)
    line = np.column_stack([np.linspace(0.0, 30.0, 16), np.linspace(1.0, 4.0, 16), np.zeros(16)])
    edge = straight_line((0.0, 0.0), (30.0, 0.0), points=2)
    found = distance_errors(
        judged_surface(surface, spacing=SPACING), Source(on(surface, [edge])), on(surface, [line]), line[:, 1],
        surface=surface, spacing=SPACING,
    )  # fmt: skip
    np.testing.assert_allclose(found.errors, 0.0, atol=1e-9)


def test_a_rolled_plate_keeps_its_distances() -> None:
    surface = cylinder_patch(divisions=(96, 10))

    def rolled(x: FloatArray, y: FloatArray) -> FloatArray:
        turn = x / 30.0 - 0.75
        return np.column_stack([30.0 * np.sin(turn), y, 30.0 * np.cos(turn)])

    across, along = np.linspace(0.0, 45.0, 181), np.linspace(0.0, 40.0, 81)
    # From a side of the roll, around it and along it, and from a point, where distance is that of the plane.
    sides = rolled(np.full(81, 0.0), along)
    found = errors_of(surface, [sides], [rolled(np.full(81, x), along) for x in (1.0, 21.0, 43.5)], [0, 10, 21])
    np.testing.assert_allclose(np.unique(np.round(found.errors, 3)), [0.0, 0.249], atol=2e-3)
    slanting = rolled(across, 5.0 + 0.5 * across)
    point = rolled(np.array([0.0]), np.array([5.0]))
    away = across * np.hypot(1.0, 0.5)
    to_point = distance_errors(
        judged_surface(surface, spacing=SPACING), Source(on(surface, [point])), on(surface, [slanting]), away,
        surface=surface, spacing=SPACING,
    )  # fmt: skip
    np.testing.assert_allclose(to_point.errors, 0.0, atol=3e-3)


def test_circles_on_a_cone_lie_at_their_slant_distance_from_its_tip() -> None:
    flat = disc(radius=16.0, rings=40)
    heights = -0.75 * np.linalg.norm(flat.vertices[:, :2], axis=1)
    cone = Surface(np.column_stack([flat.vertices[:, :2], heights]), flat.faces, "cone")
    # 1.25 mm along the slope for each mm away from the axis.
    radii = [4.0, 8.0, 12.4]
    lines = [circle(r, height=-0.75 * r, points=241) for r in radii]
    found = errors_of(cone, [np.zeros((1, 3))], lines, [2, 4.5, 7])
    at = np.linalg.norm(found.places[:, :2], axis=1)
    for r, off in zip(radii, (0.0, 0.0, 0.25), strict=True):
        # Facets lie up to 0.3 % inside of the cone.
        np.testing.assert_allclose(found.errors[np.abs(at - r) < 0.2], off, atol=0.02)


def test_the_way_leads_around_a_hole() -> None:
    surface = annulus(inner=8.0, outer=20.0, divisions=(96, 6))
    behind = straight_line((-19.9, -0.5), (-19.9, 0.5), points=3)
    # Straight through the hole it is 39.9 mm; around it two tangents and the arc between them.
    tangents = 2.0 * np.sqrt(19.95**2 - 8.0**2)
    around = tangents + 8.0 * (np.pi - 2.0 * np.arccos(8.0 / 19.95))
    found = errors_of(surface, [np.array([[20.0, 0.0, 0.0]])], [behind], [39.9 / SPACING - 0.5])
    assert found.unknown == 0.0
    assert found.mean == pytest.approx((around - 39.9) / SPACING, abs=0.15)
    assert found.mean > 1.5


def test_the_nearest_of_several_sources_counts() -> None:
    surface = plate((30.0, 20.0), (20, 13), jitter_seed=3)
    sources = [straight_line((0.0, 0.0), (30.0, 0.0), points=31), np.array([[15.0, 20.0, 0.0]])]
    found = errors_of(surface, sources, [straight_line((5.0, 15.0), (25.0, 15.0), points=21)], [2])
    x = found.places[:, 0]
    expected = np.minimum(15.0, np.hypot(x - 15.0, 5.0))
    np.testing.assert_allclose(found.errors, (expected - 5.0) / SPACING, atol=1e-9)


def test_what_the_budget_does_not_reach_is_unknown_and_left_out() -> None:
    surface = plate((30.0, 20.0), (20, 13), jitter_seed=4)
    edge = on(surface, [straight_line((0.0, 0.0), (30.0, 0.0), points=31)])
    lines = on(surface, [straight_line((0.0, 15.0), (30.0, 15.0), points=11)])
    promised = np.full(11, 15.0)
    whole, little = (
        distance_errors(
            judged_surface(surface, spacing=SPACING),
            Source(edge),
            lines,
            promised,
            surface=surface,
            spacing=SPACING,
            windows=windows,
        )
        for windows in (10**7, 3000)
    )
    assert whole.unknown == 0.0
    assert 0.5 < little.unknown < 1.0
    assert len(little.places) == little.errors.size == round((1.0 - little.unknown) * whole.errors.size)
    np.testing.assert_allclose(little.errors, 0.0, atol=1e-9)
