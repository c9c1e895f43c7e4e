"""The paper's pipeline: chart, raster, marching squares, lift; each against a known answer or a plain reference."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from geoprint.backends.chart import conformal_chart, farthest_pair, signed_areas
from geoprint.backends.lscm import Lscm
from geoprint.backends.raster import DistanceImage, filled_polygon
from geoprint.errors import FieldError, UsageError
from geoprint.model import FloatArray, Surface
from geoprint.surfaces import boundary_loops, boundary_seed, face_areas, point_seed, positions
from tests.meshes import annulus, cylinder_patch, plate, sphere, spherical_cap

# Corners of a cell in the order of the paper's table: bit 1 (row, column), 2 (row, column + 1), 4 (row + 1,
# column + 1), 8 (row + 1, column); edges 0 bottom, 1 right, 2 top, 3 left. Each case lists pairs of edges.
SIXTEEN_CASES: dict[int, list[tuple[int, int]]] = {
    0: [], 1: [(0, 3)], 2: [(0, 1)], 3: [(1, 3)], 4: [(1, 2)], 6: [(0, 2)], 7: [(2, 3)],
    8: [(2, 3)], 9: [(0, 2)], 11: [(1, 2)], 12: [(1, 3)], 13: [(0, 1)], 14: [(0, 3)], 15: [],
}  # fmt: skip
SADDLES: dict[tuple[int, bool], list[tuple[int, int]]] = {
    (5, True): [(0, 1), (2, 3)], (5, False): [(0, 3), (1, 2)],
    (10, True): [(0, 3), (1, 2)], (10, False): [(0, 1), (2, 3)],
}  # fmt: skip


def marching_squares(values: FloatArray, level: float) -> set[frozenset[tuple[float, float]]]:
    """Return the pieces (x, y) of a level curve by the 16-case table, cell by cell: slow and plain."""
    pieces: set[frozenset[tuple[float, float]]] = set()
    for row in range(values.shape[0] - 1):
        for column in range(values.shape[1] - 1):
            corners = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)]
            z = [float(values[corner]) for corner in corners]
            case = sum(1 << i for i in range(4) if z[i] > level)
            pairs = SADDLES[case, sum(z) / 4 > level] if case in (5, 10) else SIXTEEN_CASES[case]
            for pair in pairs:
                ends: list[tuple[float, float]] = []
                for edge in pair:
                    i, j = edge, (edge + 1) % 4
                    share = (level - z[i]) / (z[j] - z[i])
                    y, x = (corners[i][k] + share * (corners[j][k] - corners[i][k]) for k in range(2))
                    ends.append((round(x, 9), round(y, 9)))
                pieces.add(frozenset(ends))
    return pieces


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), smooth=st.booleans())
def test_contours_are_those_of_the_sixteen_case_table(seed: int, *, smooth: bool) -> None:
    noise = np.random.default_rng(seed).normal(size=(12, 15))
    image = DistanceImage(np.array([[0.0, 0], [10, 0], [10, 8], [0, 8]]), resolution=16)
    object.__setattr__(image, "values", gaussian_filter(noise, 2.0) if smooth else noise)
    object.__setattr__(image, "_origin", np.zeros(2))
    image.pixel = 1.0
    found = {
        frozenset((round(float(x), 9), round(float(y), 9)) for x, y in piece)
        for line in image.contours(0.01)
        for piece in pairwise(line)
    }
    assert found == marching_squares(image.values, 0.01)


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
    contours = Lscm(surface).contours(boundary_seed(surface), spacing=0.5)
    polar = np.arccos(np.clip(positions(surface, contours.curves.points)[:, 2] / radius, -1, 1))
    levels = np.repeat(contours.levels, np.diff(contours.curves.offsets))
    mean_polar = np.array([polar[levels == level].mean() for level in range(int(levels.max()) + 1)])
    spacing = -radius * np.diff(mean_polar)
    stretch = np.cos(0.5 * (mean_polar[1:] + mean_polar[:-1]) / 2) ** 2
    ratio = spacing / stretch
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=0.03)


@pytest.mark.parametrize(
    ("surface", "kind"), [(annulus(), "annulus"), (sphere(subdivisions=2), "closed")], ids=["annulus", "sphere"]
)
def test_what_is_not_a_disc_is_refused_with_its_kind_and_the_backend_that_can(surface: Surface, kind: str) -> None:
    with pytest.raises(FieldError, match=f"{kind}.*--backend heat"):
        Lscm(surface)


def test_a_chart_that_overlaps_itself_is_refused_with_count_and_place() -> None:
    # A nearly closed sphere: its chart is conformal but a sliver turned inside out cannot stay unseen.
    surface = plate((4.0, 4.0), (4, 4))
    vertices = surface.vertices.copy()
    inner = int(np.argmin(np.linalg.norm(vertices - [2.0, 2.0, 0.0], axis=1)))
    vertices[inner] = [3.6, 3.7, 0.0]
    with pytest.raises(FieldError, match=r"triangles of folded are flipped .* at \("):
        conformal_chart(Surface(vertices, surface.faces, name="folded"))


def test_the_pins_do_not_depend_on_the_numbering() -> None:
    surface = plate((40.0, 30.0), (8, 6), jitter_seed=1)
    loop = boundary_loops(surface)[0]
    pairs = {frozenset(farthest_pair(surface, np.roll(loop, shift)).tolist()) for shift in range(loop.size)}
    assert all(np.linalg.norm(np.diff(surface.vertices[list(pair)], axis=0)) == pytest.approx(50.0) for pair in pairs)


def test_a_polygon_is_filled_by_the_even_odd_rule() -> None:
    rng = np.random.default_rng(3)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 40))
    corners = np.column_stack([np.cos(angle), np.sin(angle)]) * rng.uniform(5, 14, (40, 1)) + 15.3
    found = filled_polygon(corners, shape=(30, 31))
    rows, columns = np.nonzero(found | ~found)
    turning = np.zeros(rows.size)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        u, v = a - np.column_stack([columns, rows]), b - np.column_stack([columns, rows])
        turning += np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], (u * v).sum(axis=1))
    np.testing.assert_array_equal(found[rows, columns], np.abs(turning) > np.pi)


@pytest.mark.parametrize("degrees", [0.0, 17.0, 45.0])
def test_the_distance_image_of_a_rectangle_is_right_to_a_fraction_of_a_pixel(degrees: float) -> None:
    turn = np.array([[np.cos(np.radians(degrees)), np.sin(np.radians(degrees))]])
    turn = np.vstack([turn, [[-turn[0, 1], turn[0, 0]]]])
    image = DistanceImage(np.array([[0.0, 0], [20, 0], [20, 10], [0, 10]]) @ turn, resolution=400)
    points = np.random.default_rng(0).uniform([0.5, 0.5], [19.5, 9.5], (200, 2))
    x, y = points.T
    wanted = np.minimum(np.minimum(x, 20 - x), np.minimum(y, 10 - y))
    error = np.abs(image.sample(points @ turn) - wanted)
    assert error.mean() < 0.06 * image.pixel
    assert error.max() < 0.6 * image.pixel


def test_another_seed_than_the_border_is_refused() -> None:
    surface = plate(jitter_seed=1)
    with pytest.raises(UsageError, match="whole border"):
        Lscm(surface).distance(point_seed(surface, np.array([20.0, 15.0, 0.0]), tolerance=0.1))


def test_a_raster_too_coarse_for_the_spacing_is_refused() -> None:
    surface = plate(jitter_seed=1)
    with pytest.raises(FieldError, match="pixel of the chart"):
        Lscm(surface, resolution=32).contours(boundary_seed(surface), spacing=1.0)
    with pytest.raises(UsageError, match="resolution"):
        Lscm(surface, resolution=8)
