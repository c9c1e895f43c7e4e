"""Refinement: the same surface, shorter edges, few slivers, and a limit."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from geoprint.errors import InputError, ResourceError
from geoprint.geometry import closest, edge_lengths, face_areas, face_normals, mean_normal, prepare, refine
from geoprint.geometry.files import load
from geoprint.geometry.refine import FACE_LIMIT, LONGEST_EDGE
from geoprint.geometry.topology import boundary_loops, describe, euler_characteristic, loop_length
from geoprint.model import FloatArray, Surface
from tests import meshes
from tests.shared_data import shared

TOLERANCE = 1 + 1e-8


def smallest_angles(surface: Surface) -> FloatArray:
    """Return (m,) the smallest angle of each face [degree]."""
    corners = surface.vertices[surface.faces]
    sides = np.roll(corners, -1, axis=1) - corners
    sides /= np.linalg.norm(sides, axis=2, keepdims=True)
    return np.degrees(np.arccos(-(sides * np.roll(sides, 1, axis=1)).sum(axis=2))).min(axis=1)


def triangle(*corners: tuple[float, float]) -> Surface:
    return Surface(vertices=np.column_stack([np.array(corners), np.zeros(3)]), faces=np.array([[0, 1, 2]]))


def test_three_long_edges_make_four_similar_triangles() -> None:
    finer = refine(triangle((0, 0), (2, 0), (1, np.sqrt(3))), edge_length=1.0)
    assert len(finer.faces) == 4
    np.testing.assert_allclose(edge_lengths(finer), 1.0)


def test_one_long_edge_makes_two_triangles() -> None:
    finer = refine(triangle((0, 0), (2, 0), (1, 0.9)), edge_length=1.0)
    np.testing.assert_allclose(face_areas(finer), [0.45, 0.45])


def test_two_long_edges_make_three_triangles_along_the_shorter_diagonal() -> None:
    finer = refine(triangle((0, 0), (1, 0), (0.9, 2)), edge_length=1.0)
    assert len(finer.vertices) == 5
    assert len(finer.faces) == 3
    # The midpoints are (0.95, 1) and (0.45, 1); the first is nearer to the corner across than the second.
    inner = np.linalg.norm(finer.vertices[3:, None] - finer.vertices[None, :2], axis=2).min()
    across = min(np.linalg.norm(np.array([0.95, 1.0])), np.linalg.norm(np.array([0.45 - 1.0, 1.0])))
    assert inner <= across
    assert np.isclose(edge_lengths(finer), across).any()


def test_a_mesh_that_is_fine_enough_is_returned_as_it_is() -> None:
    plate = meshes.plate()
    same = refine(plate, edge_length=10.0)
    np.testing.assert_array_equal(same.faces, plate.faces)
    np.testing.assert_array_equal(same.vertices, plate.vertices)


@given(seed=st.integers(0, 100), edge_length=st.floats(0.6, 6.0))
@settings(max_examples=20, deadline=None)
def test_refinement_keeps_the_surface_and_its_vertices_and_bounds_the_edges(seed: int, edge_length: float) -> None:
    cap = meshes.spherical_cap(radius=15.0, rings=4, jitter_seed=seed)
    finer = refine(cap, edge_length=edge_length)
    assert edge_lengths(finer).max() <= LONGEST_EDGE * edge_length * TOLERANCE
    np.testing.assert_array_equal(finer.vertices[: len(cap.vertices)], cap.vertices)
    assert face_areas(finer).sum() == pytest.approx(face_areas(cap).sum())
    np.testing.assert_allclose(mean_normal(finer), mean_normal(cap), atol=1e-12)
    assert euler_characteristic(finer) == 1
    (rim,), (fine_rim,) = boundary_loops(cap), boundary_loops(finer)
    assert loop_length(finer.vertices, fine_rim) == pytest.approx(loop_length(cap.vertices, rim))
    assert fine_rim[0] == rim[0]


def test_new_vertices_lie_on_the_old_surface() -> None:
    cap = meshes.spherical_cap(radius=15.0, rings=4, jitter_seed=1)
    finer = refine(cap, edge_length=0.7)
    assert closest(cap, finer.vertices)[1].max() < 1e-9


def test_pieces_keep_the_normal_of_their_face_and_follow_each_other() -> None:
    cap = meshes.spherical_cap(radius=15.0, rings=3, jitter_seed=1)
    finer = refine(cap, edge_length=1.0)
    parent = closest(cap, finer.vertices[finer.faces].mean(axis=1))[0].faces
    np.testing.assert_allclose(face_normals(finer), face_normals(cap)[parent], atol=1e-9)
    assert np.diff(parent).min() >= 0


@pytest.mark.parametrize("surface", [meshes.annulus(jitter_seed=1), meshes.torus(), meshes.sphere(jitter_seed=1)])
def test_topology_is_kept(surface: Surface) -> None:
    assert describe(refine(surface, edge_length=1.1)) == describe(surface)


def test_a_turned_part_is_cut_the_same_way() -> None:
    plate = meshes.plate()
    rotation = Rotation.from_rotvec([0.3, -1.0, 0.7])
    turned = Surface(vertices=rotation.apply(plate.vertices.copy()), faces=plate.faces)
    np.testing.assert_array_equal(refine(turned, edge_length=1.0).faces, refine(plate, edge_length=1.0).faces)


def test_long_strips_are_cut_across_rather_than_into_needles() -> None:
    strips = meshes.cylinder_patch(radius=30.0, length=40.0, divisions=(40, 1))
    assert np.median(smallest_angles(strips)) < 2.0
    finer = refine(strips, edge_length=0.5)
    assert edge_lengths(finer).max() <= LONGEST_EDGE * 0.5 * TOLERANCE
    assert np.median(smallest_angles(finer)) > 30.0
    # Equilateral triangles of that side would be 16,600; halving alone makes 78,400.
    assert len(finer.faces) < 25_000
    assert face_areas(finer).sum() == pytest.approx(face_areas(strips).sum())
    assert closest(strips, finer.vertices)[1].max() < 1e-9


@pytest.mark.parametrize("name", ["lv_anterior_disc_r30", "lv_lateral_disc_r20_slivers", "aortic_root_band_6mm"])
def test_real_patches_come_out_even_and_no_angle_gets_worse(name: str) -> None:
    patch, report = prepare(load(shared(f"patches/{name}.ply"), unit="mm"))
    finer = refine(patch, edge_length=0.25)
    lengths = edge_lengths(finer)
    assert lengths.max() <= LONGEST_EDGE * 0.25 * TOLERANCE
    assert 0.8 < lengths.mean() / 0.25 < 1.2
    assert smallest_angles(finer).min() > 0.99 * smallest_angles(patch).min()
    assert np.percentile(smallest_angles(finer), 1) > 15.0
    assert describe(finer) == report.topology


@pytest.mark.parametrize("edge_length", [0.0, -1.0, np.nan, np.inf])
def test_an_edge_length_that_is_none_is_refused(edge_length: float) -> None:
    with pytest.raises(InputError, match="edge_length must be a positive number"):
        refine(meshes.plate(), edge_length=edge_length)


def test_too_many_faces_are_refused_with_the_edge_length_that_is_possible() -> None:
    plate = meshes.plate(size=(40.0, 30.0))
    with pytest.raises(ResourceError, match=r"more than the limit of 5,000,000 faces; 0\.033 mm is possible") as caught:
        refine(plate, edge_length=0.001)
    possible = caught.value.details["possible_edge_length"]
    assert isinstance(possible, float)
    # An equilateral mesh of that edge length has half as many faces as are allowed.
    assert 1200.0 / (np.sqrt(3) / 4 * possible**2) == pytest.approx(FACE_LIMIT / 2)


def test_needles_that_need_more_faces_than_their_area_tells_are_refused_at_once() -> None:
    # An area of 0.005 mm2, but sides of 2,000,000 mm.
    with pytest.raises(ResourceError, match=r"0\.57 mm is possible"):
        refine(triangle((0, 0), (1e6, 0), (1e6, 1e-8)), edge_length=0.1)


def test_a_count_that_only_shows_on_the_way_is_refused_too(monkeypatch: pytest.MonkeyPatch) -> None:
    plate = meshes.plate(size=(40.0, 30.0))
    finer = refine(plate, edge_length=1.7)
    expected = 1200.0 / (np.sqrt(3) / 4 * 1.7**2)
    assert expected < 1000 < len(finer.faces)
    monkeypatch.setattr(import_module("geoprint.geometry.refine"), "FACE_LIMIT", 1000)
    with pytest.raises(ResourceError, match="more than the limit of 1,000 faces"):
        refine(plate, edge_length=1.7)
