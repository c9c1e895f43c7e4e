"""Beads have their width on the surface whatever the side they are seen from; wrapped parts are seen all around."""

from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib.image import imread

from geoprint.geometry import face_areas, face_normals
from geoprint.model import FloatArray, Surface
from geoprint.reporting import CoveragePanel, coverage_figure
from geoprint.reporting.figures import png_bytes
from geoprint.reporting.view import bead_sides, squares_on, views
from tests.meshes import cylinder_patch, plate, sphere, spherical_cap


def test_a_bead_is_as_wide_as_asked_and_lies_in_the_surface() -> None:
    cap = spherical_cap(radius=20.0, angle=1.2, rings=24)
    turn = np.linspace(0.0, 2.0 * np.pi, 100)
    places = 20.0 * np.column_stack([np.sin(1.0) * np.cos(turn), np.sin(1.0) * np.sin(turn), np.full(100, np.cos(1.0))])
    left, right = bead_sides(cap, places, np.array([0, 100]), width=0.6)
    np.testing.assert_allclose(np.linalg.norm(left - right, axis=1), 0.6)
    wider = np.linspace(0.2, 1.4, 100)
    sides = bead_sides(cap, places, np.array([0, 100]), width=wider)
    np.testing.assert_allclose(np.linalg.norm(sides[0] - sides[1], axis=1), wider)
    # To the left of a circle that runs counter-clockwise as seen from outside lies its middle.
    assert (left[:, 2] > right[:, 2]).all()
    across = (left - right) / 0.6
    np.testing.assert_allclose(np.einsum("ij,ij->i", across, places / 20.0), 0.0, atol=0.05)


def test_the_marks_of_what_is_uncovered_are_squares_that_face_outwards() -> None:
    squares = squares_on(plate(), np.array([[3.0, 4.0, 0.0]]), side=0.5)
    sides = np.linalg.norm(np.diff(squares[0][[0, 1, 2, 3, 0]], axis=0), axis=1)
    np.testing.assert_allclose(sides, 0.5)
    first, second = squares[0][1] - squares[0][0], squares[0][2] - squares[0][1]
    assert np.cross(first, second)[2] == pytest.approx(0.25)


def readable_share(surface: Surface) -> tuple[int, float]:
    """Return from how many sides a part is seen, and the share of its area that turns towards one of them."""
    sides = views(surface, np.eye(3))
    facing = np.any([face_normals(surface) @ R[2] > 0.3 for R in sides], axis=0)
    areas = face_areas(surface)
    return len(sides), float(areas[facing].sum() / areas.sum())


def test_a_flat_part_is_seen_from_above_and_a_wrapped_one_from_all_around() -> None:
    assert readable_share(plate()) == (1, 1.0)
    assert readable_share(spherical_cap(radius=20.0, angle=0.9, rings=12))[0] == 1
    tube, whole = cylinder_patch(radius=10.0, angle=6.2, length=30.0, divisions=(60, 20)), sphere(radius=20.0)
    for part in (tube, whole):
        count, share = readable_share(part)
        assert 2 < count <= 4
        assert share > 0.9
    for R_side_work in views(tube, np.eye(3)):
        np.testing.assert_allclose(R_side_work @ R_side_work.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R_side_work) == pytest.approx(1.0)


def test_what_is_uncovered_has_a_colour_of_its_own() -> None:
    def yellow(gaps: FloatArray) -> float:
        x = np.linspace(2.0, 38.0, 100)
        places = np.column_stack([x, np.full(100, 8.0), np.zeros(100)])
        panel = CoveragePanel("one", "caption", places, np.array([0, 100]), np.full(100, 1.2), gaps)
        figure = coverage_figure(plate(), [panel], R_view_work=np.eye(3), spacing=6.0, title="")
        seen = imread(io.BytesIO(png_bytes(figure)))
        part = np.asarray(seen, dtype=np.float64)[:, : 3 * seen.shape[1] // 4]
        return float(((part[..., 0] > 0.9) & (part[..., 1] > 0.7) & (part[..., 2] < 0.3)).mean())

    assert yellow(np.empty((0, 3))) == 0.0
    x, y = np.meshgrid(np.arange(5.0, 35.0), np.arange(15.0, 25.0))
    some = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    # 300 squares of 1.2 mm, which overlap to 30 mm by 10 mm of a plate of 40 mm by 30 mm.
    assert 0.1 < yellow(some) < 0.35
