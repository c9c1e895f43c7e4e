"""Rays meet what a slow search over all triangles meets."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.geometry.rays import first_hits
from geoprint.model import FloatArray, Surface
from tests.meshes import plate, spherical_cap


def slow(surface: Surface, starts: FloatArray, directions: FloatArray) -> FloatArray:
    """Distances to the first triangle, by planes and barycentric coordinates; infinite where there is none."""
    corners = surface.vertices[surface.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    found = np.full(len(starts), np.inf)
    for ray, (start, ahead) in enumerate(zip(starts, directions, strict=True)):
        with np.errstate(divide="ignore", invalid="ignore"):
            away = np.einsum("mx,mx->m", corners[:, 0] - start, across) / (across @ ahead)
        for face in np.flatnonzero(np.isfinite(away) & (away >= 0.0)):
            place = start + away[face] * ahead
            weights = np.linalg.lstsq(np.vstack([corners[face].T, np.ones(3)]), np.append(place, 1.0), rcond=None)[0]
            if weights.min() >= -1e-7:
                found[ray] = min(found[ray], away[face])
    return found


def test_they_meet_what_a_search_over_all_triangles_meets() -> None:
    cap = spherical_cap(radius=20.0, angle=1.0, rings=6, jitter_seed=2)
    random = np.random.default_rng(5)
    starts = random.normal(size=(60, 3)) * 30.0
    directions = cap.vertices.mean(axis=0) + 12.0 * random.normal(size=(60, 3)) - starts
    hits = first_hits(cap, starts, directions)
    expected = slow(cap, starts, directions)
    assert 10 < hits.met.sum() < 60
    assert np.array_equal(hits.met, np.isfinite(expected))
    assert hits.distances == pytest.approx(expected[hits.met], rel=1e-9)
    places = hits.points.xyz(cap)
    assert np.allclose(places, starts[hits.met] + hits.distances[:, None] * directions[hits.met], atol=1e-8)


def test_none_slips_through_an_edge_or_a_vertex() -> None:
    flat = plate((8.0, 6.0), (8, 6))
    columns, rows = np.meshgrid(np.arange(0.0, 8.1, 0.5), np.arange(0.0, 6.1, 0.5))
    starts = np.column_stack([columns.ravel(), rows.ravel(), np.full(columns.size, 3.0)])
    hits = first_hits(flat, starts, np.tile([0.0, 0.0, -1.0], (len(starts), 1)))
    assert hits.met.all()
    assert np.allclose(hits.distances, 3.0)
    assert not first_hits(flat, starts, np.tile([0.0, 0.0, 1.0], (len(starts), 1))).met.any()


def test_what_is_no_ray_is_refused() -> None:
    with pytest.raises(InputError, match=r"\(k, 3\) starts"):
        first_hits(plate(), np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(InputError, match="finite"):
        first_hits(plate(), np.full((1, 3), np.nan), np.ones((1, 3)))
