"""Distortion of charts against singular values and formulas; the spacing it predicts against measured rings."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.distance import BACKENDS
from geoprint.distance.distortion import Distortion, distortion, predicted_spacing
from geoprint.distance.lscm_chart import conformal_chart
from geoprint.errors import FieldError, InputError
from geoprint.geometry import boundary_seed, face_areas, positions, vertex_points
from geoprint.model import FloatArray, Surface
from tests.meshes import cylinder_patch, plate, spherical_cap


def stretched(surface: Surface, along: float, across: float) -> Surface:
    return Surface(surface.vertices * np.array([along, across, 1.0]), surface.faces)


def singular_values(surface: Surface, chart: Surface) -> FloatArray:
    """Return (m, 2) stretches of each triangle, the larger first: slow and plain."""
    found: list[list[float]] = []
    for face in range(len(surface.faces)):
        a, b, c = surface.vertices[surface.faces[face]]
        first = (b - a) / np.linalg.norm(b - a)
        normal = np.cross(b - a, c - a)
        second = np.cross(normal, first) / np.linalg.norm(normal)
        there = np.array([first, second]) @ np.column_stack([b - a, c - a])
        p, q, r = chart.vertices[chart.faces[face], :2]
        stretch = np.column_stack([q - p, r - p]) @ np.linalg.inv(there)
        found.append(np.linalg.svd(stretch, compute_uv=False).tolist())
    return np.array(found)


def test_a_stretched_plate_has_the_dilatation_of_its_stretch_and_an_even_scale() -> None:
    surface = plate(jitter_seed=1)
    measured = distortion(surface, stretched(surface, 3.0, 2.0))
    np.testing.assert_allclose(measured.dilatations, 1.5, rtol=1e-12)
    np.testing.assert_allclose(measured.area_scales, 1.0, rtol=1e-12)
    assert measured.mean_dilatation == pytest.approx(1.5)


def test_a_turned_and_enlarged_plate_has_no_distortion_to_rounding() -> None:
    surface = plate(jitter_seed=1)
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    measured = distortion(surface, Surface(7.0 * surface.vertices @ turn.T, surface.faces))
    np.testing.assert_allclose(measured.dilatations, 1.0, atol=1e-13)


def test_stretches_are_the_singular_values_of_each_triangle() -> None:
    surface = spherical_cap(rings=6, jitter_seed=1)
    chart = conformal_chart(surface)
    measured, stretches = distortion(surface, chart), singular_values(surface, chart)
    np.testing.assert_allclose(measured.dilatations, stretches[:, 0] / stretches[:, 1], rtol=1e-9)
    np.testing.assert_allclose(measured.area_scales, stretches.prod(axis=1), rtol=1e-9)


def test_means_and_percentiles_are_weighted_by_area() -> None:
    measured = Distortion(np.array([1.0, 2.0, 4.0]), np.array([3.0, 1.0, 0.5]), np.array([1.0, 6.0, 3.0]))
    assert measured.mean_dilatation == pytest.approx(2.5)
    assert measured.worst_dilatation == 4.0
    assert [measured.dilatation_percentile(percent) for percent in (0, 10, 11, 70, 71, 100)] == [1, 1, 2, 2, 4, 4]
    assert [measured.scale_percentile(percent) for percent in (1, 50, 99)] == [0.5, 1.0, 3.0]


def test_the_mean_area_scale_is_one_and_angles_get_truer_with_the_mesh() -> None:
    errors: list[float] = []
    for rings in (8, 32):
        surface = spherical_cap(angle=1.2, rings=rings, jitter_seed=1)
        measured = distortion(surface, conformal_chart(surface))
        assert measured.area_scales @ measured.areas == pytest.approx(measured.areas.sum())
        errors.append(measured.mean_dilatation - 1.0)
    # First order in the mesh width: a quarter of it, and a little less.
    assert errors[1] < 0.35 * errors[0]


def test_a_rolled_plate_predicts_the_wanted_spacing() -> None:
    surface = cylinder_patch(divisions=(30, 25), jitter_seed=1)
    points = vertex_points(surface, np.arange(len(surface.vertices)))
    np.testing.assert_allclose(predicted_spacing(surface, conformal_chart(surface), points), 1.0, atol=5e-3)


def test_the_prediction_scales_with_the_lengths_of_the_chart() -> None:
    surface = plate(jitter_seed=1)
    points = vertex_points(surface, np.arange(5))
    np.testing.assert_allclose(predicted_spacing(surface, stretched(surface, 2.0, 2.0), points), 0.5, rtol=1e-12)


def test_ring_spacing_on_a_cap_is_the_predicted_one() -> None:
    radius, angle, rounds = 30.0, np.radians(70.0), 44
    surface = spherical_cap(radius=radius, angle=angle, rings=60, jitter_seed=1)
    # Areas kept, the chart of the cap is a disc of the radius 2 r sin(angle / 2).
    wanted = 2 * radius * np.sin(angle / 2) / rounds
    contours = BACKENDS["lscm"](surface).contours(boundary_seed(surface), spacing=wanted)
    levels = np.repeat(contours.levels, np.diff(contours.curves.offsets))
    polar = np.arccos(np.clip(positions(surface, contours.curves.points)[:, 2] / radius, -1.0, 1.0))
    predicted = predicted_spacing(surface, conformal_chart(surface), contours.curves.points)
    # The last ring is half a spacing wide and about the middle of the chart, which misses the pole by part of that.
    count = int(levels.max())
    assert count >= 40
    polar, predicted = ((np.bincount(levels, values) / np.bincount(levels))[:count] for values in (polar, predicted))
    measured = -radius * np.diff(polar) / wanted
    np.testing.assert_allclose(measured, 0.5 * (predicted[1:] + predicted[:-1]), rtol=0.03)
    # Stereographic projection: lengths grow by 1 / cos(polar / 2) squared, 1.49 times over this cap.
    middle = 0.5 * (polar[1:] + polar[:-1])
    formula = np.cos(middle / 2) ** 2 / np.cos(angle / 2)
    np.testing.assert_allclose(measured, formula, rtol=0.03)
    assert measured[-1] / measured[0] == pytest.approx(1 / np.cos(angle / 2) ** 2, rel=0.05)


def test_a_chart_of_another_surface_or_with_a_flip_is_refused() -> None:
    surface, other = plate(), plate(divisions=(9, 6))
    with pytest.raises(InputError, match="108 faces and plate 96"):
        distortion(surface, other)
    turned = stretched(surface, -1.0, 1.0)
    with pytest.raises(FieldError, match="96 of 96 triangles of plate are flipped"):
        distortion(surface, turned)
    with pytest.raises(FieldError, match="96 of 96"):
        predicted_spacing(surface, turned, vertex_points(surface, np.array([0])))
    assert face_areas(surface).min() > 0.0
