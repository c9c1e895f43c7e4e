"""The distance between two surfaces: known ones, bounds that hold, both directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import MeshError
from geoprint.geometry import closest, deviation, refine
from geoprint.model import Surface
from tests.meshes import annulus, disc, plate, sphere, spherical_cap


def lifted(surface: Surface, height: float) -> Surface:
    return replace(surface, vertices=surface.vertices + np.array([0.0, 0.0, height]))


def test_two_parallel_plates_lie_their_distance_apart() -> None:
    found = deviation(plate(), lifted(plate(divisions=(5, 7)), 0.25))
    for way in (found.forward, found.backward):
        assert way.largest == pytest.approx(0.25)
        assert way.mean == pytest.approx(0.25)
        assert way.p95 == pytest.approx(0.25)
        assert 0.25 <= way.bound < 0.25 + 0.06
    assert found.rim == pytest.approx(0.25, abs=0.06)


def test_the_directions_differ_where_one_surface_is_a_part_of_the_other() -> None:
    found = deviation(disc(rings=10), annulus(inner=8.0, outer=20.0))
    assert found.forward.largest == pytest.approx(8.0, rel=0.01)
    assert found.backward.largest < 0.1
    assert found.largest is found.forward
    assert np.linalg.norm(found.forward.place) < 0.5


def test_the_largest_distance_lies_within_a_face_where_no_vertex_is() -> None:
    # A tent over a plate of two triangles: none of the plate's corners is below its top.
    flat = plate((2.0, 2.0), (1, 1))
    tent = Surface(
        vertices=np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 1, 0.5]], dtype=float),
        faces=np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]),
    )
    found = deviation(flat, tent)
    # From the middle of the plate to a side of the tent, which climbs by a half on a way of one.
    assert found.forward.largest == pytest.approx(0.5 / np.sqrt(1.25), rel=0.03)
    assert found.backward.largest == pytest.approx(0.5)
    assert closest(tent, flat.vertices)[1].max() == 0.0


def test_a_finer_mesh_of_the_same_surface_lies_on_it() -> None:
    found = deviation(spherical_cap(rings=2), refine(spherical_cap(rings=2), edge_length=8.0))
    assert found.largest.largest < 1e-9
    assert found.largest.bound < 0.15


@given(seed=st.integers(0, 2**31))
@settings(max_examples=10, deadline=None)
def test_no_point_lies_beyond_the_bound(seed: int) -> None:
    one, other = spherical_cap(rings=4), spherical_cap(rings=3, jitter_seed=seed)
    found = deviation(one, other)
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.ones(3), 2000)
    corners = one.vertices[one.faces[rng.integers(0, len(one.faces), 2000)]]
    away = closest(other, np.einsum("kc,kcx->kx", weights, corners))[1]
    assert away.max() <= found.forward.bound + 1e-12
    assert found.forward.largest <= found.forward.bound


def test_a_closed_surface_and_an_open_one_are_not_compared() -> None:
    with pytest.raises(MeshError, match="the other has none"):
        deviation(sphere(), disc())
