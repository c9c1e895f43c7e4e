"""Normals over facets: exact on a cylinder however it is cut, near those of a sphere, and kept at creases and flats."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.geometry import refine, smooth_normals, vertex_normals
from geoprint.model import FloatArray, Surface
from tests import meshes


def between(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the angles between unit vectors, row by row [degrees]."""
    return np.degrees(2.0 * np.arcsin(np.clip(np.linalg.norm(one - other, axis=1) / 2.0, 0.0, 1.0)))


def folded(angle_deg: float, *, width: float = 30.0) -> Surface:
    """Two flat rectangles that meet at the y axis, the right one lower; each is two triangles."""
    slope = np.radians(angle_deg)
    across = [(-width, 0.0), (0.0, 0.0), (width * np.cos(slope), -width * np.sin(slope))]
    vertices = np.array([(x, y, z) for y in (0.0, 20.0) for x, z in across])
    return Surface(vertices, np.array([(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4)]))


def strips(*, diagonals: int, radius: float = 10.0, turn_deg: float = 5.0, length: float = 40.0) -> Surface:
    """A cylinder about z in flat strips of two triangles each; bits of `diagonals` say which way each is cut."""
    angles = np.radians(turn_deg) * np.arange(13)
    ring = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    vertices = np.vstack([np.column_stack([ring, np.full(13, z)]) for z in (0.0, length)])
    faces: list[tuple[int, int, int]] = []
    for k in range(12):
        low, high = (k, k + 1), (k + 13, k + 14)
        if diagonals >> k & 1:
            faces += [(low[0], low[1], high[1]), (low[0], high[1], high[0])]
        else:
            faces += [(low[0], low[1], high[0]), (low[1], high[1], high[0])]
    return Surface(vertices, np.array(faces))


@pytest.mark.parametrize("diagonals", [0, 0b101010101010, 0b110010111010])
def test_on_strips_of_a_cylinder_they_are_radial_however_each_is_cut(diagonals: int) -> None:
    part = strips(diagonals=diagonals)
    surface = refine(part, edge_length=0.3)
    radial = surface.vertices * (1.0, 1.0, 0.0)
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    angle = np.arctan2(surface.vertices[:, 1], surface.vertices[:, 0])
    inside = (angle > np.radians(5.1)) & (angle < np.radians(54.9))
    assert between(smooth_normals(surface, part).vertices, radial)[inside].max() < 1e-4
    # Those of the refined mesh are the strips' own: half of their turn off.
    assert between(vertex_normals(surface), radial)[inside].max() > 2.0


def test_on_a_coarse_sphere_they_are_near_the_true_ones() -> None:
    part = meshes.sphere(radius=20.0, subdivisions=3)
    surface = refine(part, edge_length=0.5)
    true = surface.vertices / np.linalg.norm(surface.vertices, axis=1, keepdims=True)
    assert between(smooth_normals(surface, part).vertices, true).max() < 0.4
    assert between(vertex_normals(surface), true).max() > 3.0


@pytest.mark.parametrize("angle_deg", [50.0, 90.0])
def test_a_crease_keeps_both_sides_as_they_are(angle_deg: float) -> None:
    part = folded(angle_deg)
    surface = refine(part, edge_length=1.0)
    np.testing.assert_allclose(smooth_normals(surface, part).vertices, vertex_normals(surface), atol=1e-12)


def test_an_edge_between_large_flats_turns_normals_near_it_alone() -> None:
    part = folded(30.0)
    surface = refine(part, edge_length=0.5)
    turned = between(smooth_normals(surface, part).vertices, np.broadcast_to([0.0, 0.0, 1.0], surface.vertices.shape))
    x = surface.vertices[:, 0]
    assert turned[np.abs(x) < 1e-9] == pytest.approx(15.0, abs=0.1)
    assert turned[x < -5.0].max() < 1e-6
    assert (np.abs(turned[x > 5.0] - 30.0) < 1e-6).all()
    left = (x < -0.6) & (x > -4.9)
    assert ((turned[left] > 0.0) & (turned[left] < 15.0)).all()


def test_a_plate_has_its_own_normals_bit_by_bit() -> None:
    part = meshes.plate(jitter_seed=1)
    surface = refine(part, edge_length=0.7)
    assert (smooth_normals(surface, part).vertices == vertex_normals(surface)).all()


def test_moved_by_a_billionth_they_stay() -> None:
    part = meshes.sphere(radius=20.0, subdivisions=2)
    moved = Surface(part.vertices + np.random.default_rng(0).uniform(-1e-9, 1e-9, part.vertices.shape), part.faces)
    found = [smooth_normals(refine(each, edge_length=1.0), each).vertices for each in (part, moved)]
    assert between(*found).max() < 1e-5
