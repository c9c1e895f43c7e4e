"""Bands in `lscm`: even rings that close across the cut, and nobody can tell where the cut runs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from geoprint.distance import lscm
from geoprint.distance.lscm import Lscm
from geoprint.distance.lscm_raster import region_image
from geoprint.distance.lscm_seam import (
    UNCUT,
    Chart,
    Continuation,
    flat_turn,
    flattened,
    flattened_band,
    joined,
)
from geoprint.errors import FieldError
from geoprint.geometry import (
    PolylineDistance,
    boundary_loops,
    boundary_source,
    even_points,
    point_source,
    positions,
    prepare,
    refine,
    shortest_edge_path,
)
from geoprint.geometry.files import load
from geoprint.model import BoolArray, Contours, FloatArray, Source, Surface, SurfaceCurves, SurfacePoints
from tests.distance.bands import band
from tests.distance.polygons import segments_of
from tests.shared_data import shared


class Cone(NamedTuple):
    """Radii and height of a band [mm]."""

    low: float
    high: float
    height: float

    def surface(self, divisions: tuple[int, int] = (72, 16)) -> Surface:
        return band(low=self.low, high=self.high, height=self.height, divisions=divisions)


CYLINDER, CONE, STEEP = Cone(12.0, 12.0, 15.0), Cone(20.0, 8.0, 20.0), Cone(20.0, 8.0, 40.0)


def lines_of(surface: Surface, contours: Contours) -> list[FloatArray]:
    return np.split(positions(surface, contours.curves.points), contours.curves.offsets[1:-1])


def spacings(surface: Surface, contours: Contours) -> tuple[FloatArray, FloatArray]:
    """Return (k, 3) samples on all levels but the first, and their distance from the level outside over the spacing."""
    lines, step = lines_of(surface, contours), contours.spacing / 20
    levels = [[lines[i] for i in np.flatnonzero(contours.levels == level)] for level in np.unique(contours.levels)]
    places = [np.vstack([even_points(line, step=5 * step) for line in inner]) for inner in levels[1:]]
    ratios = [PolylineDistance(outer, step=step)(samples) for outer, samples in zip(levels[:-1], places, strict=True)]
    return np.vstack(places), np.concatenate(ratios) / contours.spacing


def cut_places(surface: Surface) -> FloatArray:
    """Return the (s, 3) corners of the cut that `lscm` takes [mm]."""
    return surface.vertices[shortest_edge_path(surface, *boundary_loops(surface))]


def with_other_cut(monkeypatch: pytest.MonkeyPatch, steps: int) -> None:
    """Let `lscm` cut bands of 72 rows of 17 vertices some rows from where it would."""

    def elsewhere(surface: Surface) -> Chart:
        loops = boundary_loops(surface)
        seam = (shortest_edge_path(surface, *loops) + 17 * steps) % len(surface.vertices)
        return flattened_band(surface, seam=seam, turn=flat_turn(surface, loops))

    monkeypatch.setattr(lscm, "flattened", elsewhere)


def unrolled(places: FloatArray, centre: FloatArray, shape: Cone) -> FloatArray:
    """Return the (k,) shortest distances on a cylinder or cone between places and one of them."""
    low, high, height = shape
    slant, gap = np.hypot(low - high, height), np.arctan2(places[:, 1], places[:, 0])
    gap = np.abs((gap - np.arctan2(centre[1], centre[0]) + np.pi) % (2 * np.pi) - np.pi)
    if low == high:
        return np.hypot(low * gap, places[:, 2] - centre[2])
    sine = (low - high) / slant
    out, there = (np.hypot(points[..., 0], points[..., 1]) / sine for points in (places, centre))
    return np.sqrt(out**2 + there**2 - 2 * out * there * np.cos(gap * sine))


@pytest.mark.parametrize("shape", [CYLINDER, CONE, STEEP], ids=["cylinder", "cone", "steep"])
def test_rings_on_a_developable_band_are_even_and_closed(shape: Cone) -> None:
    surface = shape.surface()
    assert flattened(surface).continuation is not UNCUT
    contours = Lscm(surface).contours(boundary_source(surface), spacing=1.0)
    _, ratios = spacings(surface, contours)
    assert ratios.std() / ratios.mean() < 0.002
    assert ratios.mean() == pytest.approx(1.0, abs=1e-3)
    assert contours.curves.closed.all()
    assert np.bincount(contours.levels).tolist()[:-1] == [2] * int(contours.levels.max())


def test_a_cylinder_band_is_measured_to_its_two_loops_as_a_strip_is_to_its_two_long_sides() -> None:
    surface = CYLINDER.surface()
    z = surface.vertices[:, 2]
    np.testing.assert_allclose(
        Lscm(surface).distance(boundary_source(surface)).values, np.minimum(z, 15.0 - z), atol=2e-3
    )


def test_on_the_tricuspid_leaflets_nothing_is_worse_at_the_cut_than_elsewhere() -> None:
    part, _ = prepare(load(shared("hearts/trivalve11_healthy_leaflets.ply"), unit="mm"))
    surface = refine(part, edge_length=Lscm.edge_length(part, spacing=1.0))
    contours = Lscm(surface).contours(boundary_source(surface), spacing=1.0)
    places, ratios = spacings(surface, contours)
    near = PolylineDistance([cut_places(surface)], step=0.05)(places) < 3.0
    assert near.sum() > 100
    assert ratios[near].std() / ratios[near].mean() <= ratios[~near].std() / ratios[~near].mean() < 0.002
    assert ratios.mean() == pytest.approx(1.0, abs=1e-3)
    assert contours.curves.closed.all()


def prism() -> Surface:
    """Return a cylinder band whose corners lie on 72 straight lines, so that it can be laid flat exactly."""
    surface = CYLINDER.surface()
    turn = np.arctan2(surface.vertices[:, 1], surface.vertices[:, 0])
    turn = np.asarray(np.round(turn * 36 / np.pi) * np.pi / 36, dtype=np.float64)
    return Surface(np.column_stack([12 * np.cos(turn), 12 * np.sin(turn), surface.vertices[:, 2]]), surface.faces)


@pytest.mark.parametrize("steps", [0, 1, 20, 36])
def test_rings_on_a_prism_are_its_sections_wherever_it_is_cut(monkeypatch: pytest.MonkeyPatch, steps: int) -> None:
    surface = prism()
    with_other_cut(monkeypatch, steps)
    contours = Lscm(surface).contours(boundary_source(surface), spacing=1.0)
    heights = positions(surface, contours.curves.points)[:, 2]
    wanted = np.repeat(contours.levels + 0.5, np.diff(contours.curves.offsets))
    np.testing.assert_allclose(np.minimum(heights, 15.0 - heights), wanted, atol=1e-6)
    assert np.bincount(contours.levels)[:7].tolist() == [2] * 7
    assert contours.curves.closed.all()


@pytest.mark.parametrize("steps", [1, 20, 36])
def test_another_cut_moves_no_curve_but_corners_by_part_of_a_pixel(monkeypatch: pytest.MonkeyPatch, steps: int) -> None:
    surface = band(low=20.0, high=8.0, height=20.0, bulge=2.0, wave=2.0)
    backend = Lscm(surface)
    wanted = backend.contours(boundary_source(surface), spacing=1.0)
    with_other_cut(monkeypatch, steps)
    found = Lscm(surface).contours(boundary_source(surface), spacing=1.0)
    first, second = (
        [[line for line, own in zip(lines_of(surface, c), c.levels, strict=True) if own == level] for level in range(6)]
        for c in (wanted, found)
    )
    assert [len(curves) for curves in first] == [len(curves) for curves in second]
    moved = np.concatenate([PolylineDistance(a, step=0.05)(np.vstack(b)) for a, b in zip(first, second, strict=True)])
    assert np.percentile(moved, 95) < 1e-3
    assert moved.max() < 0.75 * backend.shown(spacing=1.0).pixel


@pytest.mark.parametrize("source", ["border", "point"])
@pytest.mark.parametrize("steps", [1, 20, 36])
def test_distances_do_not_tell_where_the_cut_runs(monkeypatch: pytest.MonkeyPatch, steps: int, source: str) -> None:
    surface = band(low=20.0, high=8.0, height=20.0, bulge=2.0, wave=2.0)
    start = (
        boundary_source(surface) if source == "border" else point_source(surface, surface.vertices[300], tolerance=0.1)
    )
    wanted = Lscm(surface).distance(start).values
    with_other_cut(monkeypatch, steps)
    np.testing.assert_allclose(Lscm(surface).distance(start).values, wanted, atol=1e-6)


@pytest.mark.parametrize("shape", [CYLINDER, CONE, STEEP], ids=["cylinder", "cone", "steep"])
@pytest.mark.parametrize("vertex", [1000, 5030])
def test_around_a_point_curves_are_circles_that_close_round_the_band(vertex: int, shape: Cone) -> None:
    surface, spacing = shape.surface((180, 40)), 2.0
    backend, centre = Lscm(surface), surface.vertices[vertex]
    contours = backend.contours(point_source(surface, centre, tolerance=0.1), spacing=spacing)
    wanted = np.repeat((contours.levels + 0.5) * spacing, np.diff(contours.curves.offsets))
    found = unrolled(positions(surface, contours.curves.points), centre, shape)
    # The mesh is not quite the cone; behind the band curves have corners.
    error = np.abs(found / wanted - 1.0)
    assert np.percentile(error, 99) < 2e-3
    assert np.abs(found - wanted).max() < backend.shown(spacing=spacing).pixel
    for line, closed in zip(lines_of(surface, contours), contours.curves.closed, strict=True):
        ends = line[[0, -1], 2]
        assert closed or np.minimum(ends, shape.height - ends).max() < 0.05


def test_every_point_of_the_cut_can_be_the_seed() -> None:
    surface = CYLINDER.surface()
    for corner in cut_places(surface)[1:-1:4]:
        found = Lscm(surface).distance(point_source(surface, corner, tolerance=0.1)).values
        np.testing.assert_allclose(found, unrolled(surface.vertices, corner, CYLINDER), atol=0.02)


@pytest.mark.parametrize("loop", [0, 1])
def test_from_one_loop_levels_are_rings_as_far_from_it(loop: int) -> None:
    surface = CYLINDER.surface()
    curves = boundary_source(surface).curves
    first, last = curves.offsets[loop : loop + 2]
    points = SurfacePoints(curves.points.faces[first:last], curves.points.weights[first:last])
    source = Source(SurfaceCurves(points, np.array([0, last - first]), np.array([True])))
    contours = Lscm(surface).contours(source, spacing=2.0)
    base = float(positions(surface, points)[0, 2])
    away = np.abs(positions(surface, contours.curves.points)[:, 2] - base)
    wanted = np.repeat((contours.levels + 0.5) * 2.0, np.diff(contours.curves.offsets))
    np.testing.assert_allclose(away, wanted, atol=5e-3)
    assert contours.levels.tolist() == list(range(8))[: len(contours.levels)]
    assert contours.curves.closed.all()


def test_larger_distances_lie_on_the_left_all_round() -> None:
    surface = band(low=12.0, high=12.0, height=15.0, wave=2.0)
    contours = Lscm(surface).contours(boundary_source(surface), spacing=1.5)
    cut = PolylineDistance([cut_places(surface)], step=0.05)
    crossing = 0
    for line, level in zip(lines_of(surface, contours), contours.levels, strict=True):
        if level > 1:
            continue
        along, middles = np.diff(line, axis=0), 0.5 * (line[1:] + line[:-1])
        outwards = middles * [1.0, 1.0, 0.0]
        left = np.cross(outwards, along)[:, 2]
        # The outer two levels of both loops: upwards from the lower one, downwards from the upper one.
        assert (np.sign(left) == np.sign(7.5 - middles[:, 2])).all()
        crossing += int(cut(line).min() < 0.1)
    assert crossing == 4


# A square chart that its copies continue to the left and to the right.
STRIP = Continuation(
    np.array([[-5.0, 0.0], [-5.0, 10.0]]), np.array([[5.0, 0.0], [5.0, 10.0]]), 0.0, np.array([-10.0, 0.0])
)


def in_strip(places: FloatArray) -> BoolArray:
    return np.asarray(np.abs(places - np.array([0.0, 5.0])).max(axis=1) <= 5.0)


def join(*lines: list[list[float]]) -> list[FloatArray]:
    (found,) = joined([[np.array(line) for line in lines]], STRIP, holds=in_strip, pixel=0.5)
    return found


def test_a_curve_that_runs_round_the_band_closes_though_in_the_plane_it_does_not() -> None:
    (found,) = join([[-6.0, 4.0], [-4.0, 4.0], [4.0, 4.02], [6.0, 4.0]])
    np.testing.assert_allclose(found, [[-5.0, 4.005], [-4, 4], [4, 4.02], [-5, 4.005]])


def test_a_curve_that_crosses_the_cut_often_comes_back_in_one() -> None:
    hook = [[-5.5, 2.0], [-4.0, 2.0], [-4.0, 4.0], [-5.5, 4.0]]
    back = [[4.5, 4.0], [3.0, 4.0], [3.0, 6.0], [5.5, 6.0]]
    rest = [[-5.5, 6.0], [-3.0, 6.0], [-3.0, 1.0], [-5.5, 1.0]]
    last = [[5.5, 1.0], [3.0, 1.0], [3.0, 2.0], [5.5, 2.0]]
    back[0][0] = 5.5
    (found,) = join(hook, back, rest, last)
    assert (found[0] == found[-1]).all()
    assert len(found) == 13
    on_cut = found[found[:, 0] == -5.0]
    assert sorted(set(on_cut[:, 1])) == [1.0, 2.0, 4.0, 6.0]


def test_a_curve_that_touches_the_cut_on_one_side_alone_stays_whole() -> None:
    (found,) = join([[-3.0, 3.0], [-3.0, 5.0], [-5.01, 4.1], [-5.01, 3.9], [-3.0, 3.0]])
    assert (found[0] == found[-1]).all()
    assert len(found) == 4
    np.testing.assert_allclose(found[found[:, 0] == -5.0], [[-5.0, 4.0]] * int((found[:, 0] == -5.0).sum()), atol=0.01)
    assert join([[5.01, 3.0], [5.01, 3.1], [4.99, 3.05], [5.01, 3.0]]) == []


def test_what_lies_beyond_the_cut_is_left_to_the_other_side_and_what_does_not_touch_it_is_kept() -> None:
    beyond = [[-5.1, 3.0], [-5.6, 4.0], [-5.6, 3.0], [-5.1, 3.0]]
    within = [[1.0, 3.0], [2.0, 4.0], [2.0, 3.0], [1.0, 3.0]]
    beside = [[4.9, 3.0], [4.4, 4.0], [4.4, 3.0], [4.9, 3.0]]
    found = join(beyond, within, beside)
    np.testing.assert_array_equal(found, [within, beside])


def test_a_curve_that_ends_at_the_border_stays_open() -> None:
    (found,) = join([[-6.0, 4.0], [-4.0, 4.0], [-4.0, 0.0]], [[4.0, 10.0], [4.0, 4.0], [6.0, 4.0]])
    np.testing.assert_allclose(found, [[4, 10], [4, 4], [-5, 4], [-4, 4], [-4, 0]])


def test_a_curve_that_ends_beside_the_cut_on_one_side_alone_is_not_joined() -> None:
    (found,) = joined([[np.array([[-5.1, 0.1], [-4.9, 0.2], [-4.9, 0.0]])]], STRIP, holds=in_strip, pixel=0.05)
    np.testing.assert_allclose(found[0], [[-5.0, 0.15], [-4.9, 0.2], [-4.9, 0.0]])


def test_a_curve_that_is_lost_at_the_cut_is_refused() -> None:
    with pytest.raises(FieldError, match=r"2 level curves end at the cut .* first 7 mm along it, .* within 0\.8 mm"):
        joined(
            [[np.array([[-5.1, 3.0], [-4.9, 3.0], [-4.9, 0.0]]), np.array([[4.9, 10.0], [4.9, 7.0], [5.1, 7.0]])]],
            STRIP,
            holds=in_strip,
            pixel=0.05,
        )


def test_without_a_cut_lines_come_back_as_they_are() -> None:
    lines = [[np.array([[0.0, 0.0], [1.0, 1.0]])]]
    assert joined(lines, UNCUT, holds=in_strip, pixel=0.5) is lines


def test_the_image_of_a_strip_goes_on_beyond_its_cut() -> None:
    square = segments_of(np.array([[-5.0, 0.0], [5, 0], [5, 10], [-5, 10]]))
    region = region_image(square[[0, 2]], resolution=40, continuation=STRIP)
    y = np.asarray(region.origin[1] + region.pixel * np.arange(region.values.shape[0]), dtype=np.float64)
    wanted = np.repeat(np.minimum(y, 10.0 - y)[:, None], region.values.shape[1], axis=1)
    np.testing.assert_allclose(region.values[region.measured], wanted[region.measured], atol=1e-12)
