"""The paper's pipeline of chart, raster, lift: exact on the plane from any source, elsewhere as the scale predicts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint.distance.distortion import local_scales, signed_areas
from geoprint.distance.lscm import PIXELS_PER_SPACING, Lscm
from geoprint.distance.lscm_chart import conformal_chart, farthest_pair
from geoprint.distance.segment_distance import point_distances
from geoprint.errors import FieldError, UsageError
from geoprint.geometry import (
    PolylineDistance,
    boundary_loops,
    boundary_source,
    closest,
    edge_lengths,
    even_points,
    face_areas,
    point_source,
    positions,
)
from geoprint.model import Contours, FloatArray, Source, Surface, SurfaceCurves, SurfacePoints
from tests.distance.polygons import LETTER, LETTER_HOLES, segments_of, slow_distances, star, triangulated
from tests.meshes import annulus, cylinder_patch, plate, sphere, spherical_cap

# A level curve is cut at the kinks of the distance; how far from them it is exact, in pixels.
KINK_PIXELS = 1.5


def lines_of(surface: Surface, contours: Contours) -> list[FloatArray]:
    return np.split(positions(surface, contours.curves.points), contours.curves.offsets[1:-1])


def node_levels(contours: Contours) -> FloatArray:
    levels = np.repeat(contours.levels, np.diff(contours.curves.offsets))
    return np.asarray((levels + 0.5) * contours.spacing, dtype=np.float64)


def at_kink(points: FloatArray, segments: FloatArray, *, pixel: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Tell which points lie within some pixels of a place that two parts of the border are equally far from."""
    reach = KINK_PIXELS * pixel
    middle = point_distances(segments, points)
    bent = np.zeros(len(points), dtype=np.bool_)
    for angle in np.arange(8) * np.pi / 8:
        step = reach * np.array([np.cos(angle), np.sin(angle)])
        sides = point_distances(segments, points + step) + point_distances(segments, points - step)
        bent |= np.abs(sides - 2 * middle) > 0.2 * reach
    return bent


def curve_source(surface: Surface, xyz: FloatArray) -> Source:
    points, _ = closest(surface, xyz)
    return Source(SurfaceCurves(points, np.array([0, len(xyz)]), np.array([False])))


def loop_source(surface: Surface, loop: int) -> Source:
    """Return one boundary loop of several as a source."""
    curves = boundary_source(surface).curves
    first, last = curves.offsets[loop : loop + 2]
    points = SurfacePoints(curves.points.faces[first:last], curves.points.weights[first:last])
    return Source(SurfaceCurves(points, np.array([0, last - first]), np.array([True])))


@pytest.mark.parametrize("surface", [plate(jitter_seed=1), cylinder_patch(jitter_seed=2)], ids=["plate", "cylinder"])
def test_a_developable_surface_is_unrolled_without_distortion(surface: Surface) -> None:
    chart = conformal_chart(surface)
    np.testing.assert_allclose(signed_areas(chart.vertices, chart.faces), face_areas(surface), rtol=2e-2)


def test_the_chart_of_a_plate_is_the_plate_turned() -> None:
    surface = plate((40.0, 30.0), (16, 12), jitter_seed=1)
    chart = conformal_chart(surface)
    lengths = [
        np.linalg.norm(mesh.vertices[mesh.faces[:, 0]] - mesh.vertices[mesh.faces[:, 1]], axis=1)
        for mesh in (surface, chart)
    ]
    np.testing.assert_allclose(lengths[1], lengths[0], rtol=1e-9)


def test_the_chart_of_a_cap_is_the_stereographic_projection() -> None:
    radius, angle = 30.0, 1.0
    surface = spherical_cap(radius=radius, angle=angle, rings=40)
    chart = conformal_chart(surface)
    polar = np.arccos(np.clip(surface.vertices[:, 2] / radius, -1, 1))
    wanted = 2 * np.tan(polar / 2)
    wanted *= np.sqrt(face_areas(surface).sum() / (np.pi * wanted.max() ** 2))
    found = np.linalg.norm(chart.vertices - chart.vertices[0], axis=1)
    np.testing.assert_allclose(found, wanted, atol=0.02 * wanted.max())


def test_spacing_on_a_cap_varies_as_the_conformal_factor_predicts() -> None:
    radius, angle = 30.0, 1.0
    surface = spherical_cap(radius=radius, angle=angle, rings=60, jitter_seed=1)
    contours = Lscm(surface).contours(boundary_source(surface), spacing=0.5)
    polar = np.arccos(np.clip(positions(surface, contours.curves.points)[:, 2] / radius, -1, 1))
    levels = np.repeat(contours.levels, np.diff(contours.curves.offsets))
    mean_polar = np.array([polar[levels == level].mean() for level in range(int(levels.max()) + 1)])
    spacing = -radius * np.diff(mean_polar)
    stretch = np.cos(0.5 * (mean_polar[1:] + mean_polar[:-1]) / 2) ** 2
    ratio = spacing / stretch
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=0.03)


def test_the_pins_do_not_depend_on_the_numbering() -> None:
    surface = plate((40.0, 30.0), (8, 6), jitter_seed=1)
    loop = boundary_loops(surface)[0]
    pairs = {frozenset(farthest_pair(surface, np.roll(loop, shift)).tolist()) for shift in range(loop.size)}
    assert all(np.linalg.norm(np.diff(surface.vertices[list(pair)], axis=0)) == pytest.approx(50.0) for pair in pairs)


REGIONS = {
    "rectangle": (np.array([[0.0, 0], [23, 0], [23, 17], [0, 17]]),),
    "letter with holes": (LETTER, *LETTER_HOLES),
    "star with a hole": (star(11, radius=22.0, seed=4), star(5, radius=4.0, seed=1)),
}


@pytest.mark.parametrize("name", REGIONS)
def test_on_the_plane_curves_are_as_far_from_the_border_and_from_each_other_as_wanted(name: str) -> None:
    loops = REGIONS[name]
    surface, border, spacing = triangulated(*loops, width=1.2), segments_of(*loops), 1.0
    backend = Lscm(surface)
    contours = backend.contours(boundary_source(surface), spacing=spacing)
    lines, pixel = lines_of(surface, contours), backend.shown(spacing=spacing).pixel
    assert contours.curves.closed.all()
    nodes = np.vstack(lines)[:, :2]
    error = np.abs(slow_distances(nodes, border) - node_levels(contours)) / spacing
    assert error[~at_kink(nodes, border, pixel=pixel)].max() < 0.005
    assert error.max() < 0.75 * pixel
    ratios: list[FloatArray] = []
    for outer, inner in pairwise(range(int(contours.levels.max()) + 1)):
        samples = np.vstack([even_points(lines[i], step=spacing / 4) for i in np.flatnonzero(contours.levels == inner)])
        samples = samples[~at_kink(samples[:, :2], border, pixel=pixel)]
        distance = PolylineDistance([lines[i] for i in np.flatnonzero(contours.levels == outer)], step=spacing / 20)
        ratios.append(distance(samples) / spacing)
    spread = np.concatenate(ratios)
    assert spread.size > 500
    assert spread.std() / spread.mean() < 0.002
    assert spread.mean() == pytest.approx(1.0, abs=5e-4)


def test_a_turned_and_enlarged_copy_has_the_same_curves() -> None:
    surface = triangulated(LETTER, *LETTER_HOLES, width=1.5)
    wanted = Lscm(surface).contours(boundary_source(surface), spacing=1.1)
    turn = Rotation.from_euler("xyz", [20.0, 50.0, 130.0], degrees=True).as_matrix()
    copy = Surface(2.7 * surface.vertices @ turn.T + [7.0, -50.0, 400.0], surface.faces)
    found = Lscm(copy).contours(boundary_source(copy), spacing=2.7 * 1.1)
    np.testing.assert_array_equal(found.levels, wanted.levels)
    assert found.curves.points.faces.size == wanted.curves.points.faces.size
    places = 2.7 * positions(surface, wanted.curves.points) @ turn.T + [7.0, -50.0, 400.0]
    np.testing.assert_allclose(positions(copy, found.curves.points), places, atol=1e-6)


def test_distance_is_the_exact_one_of_the_chart_whatever_the_raster() -> None:
    surface = triangulated(LETTER, *LETTER_HOLES, width=1.5)
    source, border = boundary_source(surface), segments_of(LETTER, *LETTER_HOLES)
    values = Lscm(surface).distance(source).values
    np.testing.assert_allclose(values, slow_distances(surface.vertices[:, :2], border), atol=1e-9)
    np.testing.assert_array_equal(Lscm(surface, resolution=40).distance(source).values, values)


def test_larger_distances_lie_on_the_left_seen_from_outside() -> None:
    surface = triangulated(LETTER, *LETTER_HOLES, width=1.5)
    contours = Lscm(surface).contours(boundary_source(surface), spacing=1.5)
    border, rises = segments_of(LETTER, *LETTER_HOLES), list[FloatArray]()
    for line in lines_of(surface, contours):
        along = np.diff(line[:, :2], axis=0)
        left = 1e-3 * np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
        middles = line[:-1, :2] + 0.5 * along
        rises.append(point_distances(border, middles + left) - point_distances(border, middles - left))
    # The few pieces that cut a corner at a kink run between two distances that rise away from it.
    assert (np.concatenate(rises) > 0.0).mean() > 0.99


def test_around_a_point_curves_are_circles_that_end_at_the_border() -> None:
    surface = plate((40.0, 30.0), (32, 24), jitter_seed=1)
    centre = np.array([13.3, 12.1, 0.0])
    backend = Lscm(surface)
    contours = backend.contours(point_source(surface, centre, tolerance=0.1), spacing=2.0)
    pixel = backend.shown(spacing=2.0).pixel
    lines = lines_of(surface, contours)
    nodes = np.vstack(lines)
    away = np.linalg.norm(nodes - centre, axis=1)
    assert np.abs(away - node_levels(contours)).max() < 0.005 * 2.0
    assert contours.levels.max() == 15
    for line, level, closed in zip(lines, contours.levels, contours.curves.closed, strict=True):
        assert closed == ((level + 0.5) * 2.0 < 12.1)
        if not closed:
            x, y = line[[0, -1], 0], line[[0, -1], 1]
            assert np.minimum(np.minimum(x, 40 - x), np.minimum(y, 30 - y)).max() < 0.1 * pixel
    assert nodes.min() > -1e-9
    assert (nodes.max(axis=0) < [40 + 1e-9, 30 + 1e-9, 1e-9]).all()


def test_beside_a_curve_through_triangles_levels_are_strips_on_both_sides() -> None:
    surface = plate((40.0, 30.0), (17, 13), jitter_seed=2)
    y = np.linspace(0.0, 30.0, 400)
    source = curve_source(surface, np.column_stack([np.full(400, 17.7), y, np.zeros(400)]))
    backend = Lscm(surface)
    np.testing.assert_allclose(backend.distance(source).values, np.abs(surface.vertices[:, 0] - 17.7), atol=1e-9)
    contours = backend.contours(source, spacing=2.0)
    x = positions(surface, contours.curves.points)[:, 0]
    # Beyond the border, where curves are cut, the source has ended and its distance bends.
    np.testing.assert_allclose(np.abs(x - 17.7), node_levels(contours), atol=0.0025)
    counts = np.bincount(contours.levels)
    assert counts[:9].tolist() == [2] * 9
    assert counts[9:].tolist() == [1] * (counts.size - 9)
    assert not contours.curves.closed.any()


@pytest.mark.parametrize("loop", [0, 1], ids=["rim", "hole"])
def test_from_one_of_two_loops_levels_are_rings_about_it(loop: int) -> None:
    surface = annulus(inner=8.0, outer=20.0, divisions=(240, 12))
    contours = Lscm(surface).contours(loop_source(surface, loop), spacing=2.0)
    radii = np.linalg.norm(positions(surface, contours.curves.points), axis=1)
    start, inwards = ((20.0, -1.0), (8.0, 1.0))[loop]
    np.testing.assert_allclose(radii, start + inwards * node_levels(contours), atol=0.01)
    assert contours.levels.tolist() == list(range(6))
    assert contours.curves.closed.all()


def test_a_hole_is_crossed_by_the_straight_distance_of_a_point() -> None:
    surface = annulus(inner=8.0, outer=20.0, divisions=(120, 12))
    values = Lscm(surface).distance(point_source(surface, np.array([-14.0, 0.0, 0.0]), tolerance=0.1)).values
    np.testing.assert_allclose(values, np.linalg.norm(surface.vertices - [-14.0, 0, 0], axis=1), atol=0.01)


def test_every_loop_of_a_holed_part_bounds_and_seeds_it() -> None:
    surface = annulus(inner=8.0, outer=20.0, divisions=(240, 12))
    contours = Lscm(surface).contours(boundary_source(surface), spacing=2.0)
    radii = [float(np.linalg.norm(line, axis=1).mean()) for line in lines_of(surface, contours)]
    assert sorted(round(radius) for radius in radii) == [9, 11, 13, 15, 17, 19]
    assert np.bincount(contours.levels).tolist() == [2, 2, 2]


def test_half_the_border_is_a_seed_of_its_own() -> None:
    surface = plate((40.0, 30.0), (16, 12))
    loop = boundary_loops(surface)[0]
    bottom = loop[surface.vertices[loop, 1] == 0.0]
    xyz = surface.vertices[bottom[np.argsort(surface.vertices[bottom, 0])]]
    contours = Lscm(surface).contours(curve_source(surface, xyz), spacing=2.0)
    places = positions(surface, contours.curves.points)
    np.testing.assert_allclose(places[:, 1], node_levels(contours), atol=0.0025)
    assert contours.levels.max() == 14


@pytest.mark.parametrize("spacing", [0.4, 1.0, 2.5])
def test_the_raster_has_sixteen_pixels_a_spacing_where_the_chart_shrinks_the_surface_most(spacing: float) -> None:
    surface = spherical_cap(radius=30.0, angle=1.2, rings=20, jitter_seed=1)
    chart = Lscm(surface).shown(spacing=spacing).flat
    found = Lscm(surface).shown(spacing=spacing)
    shrunk = float(np.min(edge_lengths(chart) / edge_lengths(surface)))
    assert found.largest_pixel <= spacing / PIXELS_PER_SPACING * (1 + 1e-6)
    assert found.pixel / shrunk < 1.15 * spacing / PIXELS_PER_SPACING
    assert found.resolution == pytest.approx(PIXELS_PER_SPACING * np.ptp(chart.vertices, axis=0).max()
                                             / local_scales(surface, chart).min() / spacing, abs=1)  # fmt: skip


def test_the_raster_of_a_turned_part_is_as_fine_though_its_size_is_rounded() -> None:
    counts: set[int] = set()
    for degrees in np.linspace(0.0, 360.0, 40):
        surface = plate((40.0, 30.0))
        turn = Rotation.from_euler("z", degrees, degrees=True).as_matrix()
        counts.add(Lscm(Surface(surface.vertices @ turn.T, surface.faces)).shown(spacing=1.0).resolution)
    assert len(counts) == 1


def test_a_given_resolution_is_taken_and_refused_where_paths_would_run_together() -> None:
    surface = plate(jitter_seed=1)
    source = boundary_source(surface)
    assert Lscm(surface, resolution=200).shown(spacing=1.0).resolution == 200
    with pytest.raises(FieldError, match=r"pixel of the UV map of plate at resolution 32 is 1\.\d+ mm .* at \(.*\) mm"):
        Lscm(surface, resolution=32).contours(source, spacing=1.0)
    for resolution in (8, 8193):
        with pytest.raises(UsageError, match="between 16 and 8192"):
            Lscm(surface, resolution=resolution)


def test_paths_too_fine_for_any_raster_are_refused_with_the_finest_that_fit() -> None:
    surface = plate(jitter_seed=1)
    with pytest.raises(
        FieldError, match=r"need a raster of \d+ pixels.*8192 are allowed.*at least (0\.\d+) mm"
    ) as found:
        Lscm(surface).contours(boundary_source(surface), spacing=0.01)
    finest = float(str(found.value).split("at least ")[1].split(" ")[0])
    assert Lscm(surface).shown(spacing=finest).resolution <= 8192
    assert "resolution=" not in str(found.value)
    with pytest.raises(FieldError, match=r"take a coarser raster with `--set options\.lscm\.resolution=8192`"):
        Lscm(surface).shown(spacing=0.07)
    assert Lscm(surface, resolution=8192).shown(spacing=0.07).resolution == 8192


def test_a_first_level_smaller_than_a_pixel_is_refused() -> None:
    surface = plate((40.0, 40.0), (8, 8))
    with pytest.raises(FieldError, match="longer than a pixel"):
        Lscm(surface, resolution=16).contours(
            point_source(surface, np.array([20.0, 20.0, 0.0]), tolerance=0.1), spacing=56.5
        )


@pytest.mark.parametrize(("surface", "kind"), [(sphere(subdivisions=2), "closed")], ids=["sphere"])
def test_what_cannot_be_flattened_is_refused_with_its_kind_and_the_backend_that_can(
    surface: Surface, kind: str
) -> None:
    with pytest.raises(FieldError, match=f"{kind}.*--backend heat"):
        Lscm(surface)
