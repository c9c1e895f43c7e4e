"""Cutting pieces out of surfaces: known areas, smooth rims, no slivers, nothing lost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from geoprint.errors import InputError
from geoprint.geometry import (
    boundary_loops,
    clipped,
    closest,
    closest_once,
    contracted,
    describe,
    edge_lengths,
    euler_characteristic,
    face_areas,
    face_normals,
    faces_within,
    part_of,
    piece_at,
    positions,
    prepare,
    trimmed,
)
from geoprint.model import FloatArray, Surface
from tests.meshes import annulus, disc, plate, sphere, spherical_cap, torus


def area(surface: Surface) -> float:
    return float(face_areas(surface).sum())


def two_plates() -> Surface:
    one = plate()
    moved = one.vertices + np.array([100.0, 0.0, 0.0])
    return Surface(
        vertices=np.vstack([one.vertices, moved]), faces=np.vstack([one.faces, one.faces + len(one.vertices)])
    )


def test_a_straight_cut_leaves_exactly_the_area_on_its_side() -> None:
    surface = plate(size=(40.0, 30.0), divisions=(7, 5), jitter_seed=3)
    cut = clipped(surface, surface.vertices[:, :1] - 13.3)
    assert area(cut) == pytest.approx(13.3 * 30.0, rel=1e-12)
    assert cut.vertices[:, 0].max() == pytest.approx(13.3, abs=1e-12)
    assert describe(cut) == "disc"


def test_a_box_keeps_its_corners() -> None:
    surface = plate(size=(40.0, 30.0), divisions=(7, 5), jitter_seed=4)
    x, y = surface.vertices[:, 0], surface.vertices[:, 1]
    cut = clipped(surface, np.column_stack([3.1 - x, x - 22.2, 4.3 - y, y - 17.7]))
    assert area(cut) == pytest.approx(19.1 * 13.4, rel=1e-12)
    corner = np.linalg.norm(cut.vertices[:, :2] - [22.2, 17.7], axis=1).min()
    assert corner < 1e-9


def test_what_lies_in_the_bounding_plane_itself_is_kept() -> None:
    surface = plate()
    z = surface.vertices[:, 2]
    assert len(clipped(surface, np.column_stack([-z, z - 5.0])).faces) == len(surface.faces)


any_plane = given(normal=st.tuples(*[st.floats(-1.0, 1.0)] * 3), level=st.floats(-0.6, 0.6), seed=st.integers(0, 5))


def coarse_sphere(
    normal: tuple[float, float, float], level: float, seed: int
) -> tuple[Surface, Callable[[FloatArray], FloatArray]]:
    """Return a sphere of 20 mm with edges of 3 to 6 mm, and how high places are over a plane through it."""
    axis = np.array(normal) if np.linalg.norm(normal) >= 0.1 else np.array([0.0, 0.0, 1.0])
    axis /= np.linalg.norm(axis)
    return sphere(radius=20.0, subdivisions=2, jitter_seed=seed), lambda places: places @ axis - 20.0 * level


@settings(max_examples=25, deadline=None)
@any_plane
def test_both_sides_of_a_cut_make_up_the_whole_and_keep_its_shape(
    normal: tuple[float, float, float], level: float, seed: int
) -> None:
    surface, height = coarse_sphere(normal, level, seed)
    values = height(surface.vertices)
    low, high = clipped(surface, values[:, None]), clipped(surface, -values[:, None])
    # Vertices that slide onto the cut move the surface by a small share of an edge.
    assert area(low) + area(high) == pytest.approx(area(surface), rel=5e-3)
    assert euler_characteristic(low) == euler_characteristic(high) == 1
    for side in (low, high):
        rim = side.vertices[boundary_loops(side)[0]]
        assert np.abs(height(rim)).max() < 1e-9
        assert np.einsum("mx,mx->m", face_normals(side), side.vertices[side.faces].mean(axis=1)).min() > 0.0


@settings(max_examples=40, deadline=None)
@any_plane
def test_what_rids_a_cut_of_slivers_keeps_the_surface_where_its_faces_meet_at_an_angle(
    normal: tuple[float, float, float], level: float, seed: int
) -> None:
    """Between faces that meet at 10 to 20 degrees a share of an edge across one is 0.1 mm high."""
    surface, height = coarse_sphere(normal, level, seed)
    cut = trimmed(contracted(clipped(surface, height(surface.vertices)[:, None])))
    corners = cut.vertices[cut.faces]
    places = np.vstack(
        [cut.vertices, corners.mean(axis=1), (0.5 * (corners + np.roll(corners, 1, axis=1))).reshape(-1, 3)]
    )
    # Half of what a part may lie off its file, for each of two steps.
    assert closest(surface, places)[1].max() < 0.01


def test_a_cut_leaves_no_edge_much_shorter_than_the_snap_share() -> None:
    surface = disc(radius=20.0, rings=12, jitter_seed=1)
    cut = clipped(surface, (np.linalg.norm(surface.vertices, axis=1) - 11.0)[:, None])
    assert edge_lengths(cut).min() > 0.04 * edge_lengths(surface).min()
    assert area(cut) == pytest.approx(np.pi * 11.0**2, rel=2e-2)


def test_a_cut_with_nothing_left_or_without_values_is_refused() -> None:
    surface = plate()
    with pytest.raises(InputError, match="has no part within the given bounds"):
        clipped(surface, np.ones((len(surface.vertices), 1)))
    with pytest.raises(InputError, match="finite values are given at all of its vertices"):
        clipped(surface, np.full((len(surface.vertices), 1), np.nan))
    with pytest.raises(InputError, match="finite values"):
        clipped(surface, np.zeros((3, 1)))


def test_the_piece_at_a_point_is_the_nearest_one_alone() -> None:
    both = two_plates()
    assert piece_at(both, np.array([101.0, 1.0, 0.0])).vertices[:, 0].min() >= 100.0
    one = plate()
    assert piece_at(one, np.zeros(3)) is one


def test_faces_within_a_ball_hold_every_vertex_in_it() -> None:
    surface = spherical_cap(jitter_seed=2)
    near = faces_within(surface, surface.vertices[0], radius=9.0)
    inside = np.flatnonzero(np.linalg.norm(surface.vertices - surface.vertices[0], axis=1) <= 9.0)
    assert np.isin(inside, surface.faces[near]).all()
    assert 0 < near.sum() < len(surface.faces)
    assert len(part_of(surface, near).faces) == near.sum()


def test_contraction_takes_crumbs_and_keeps_shape_rim_and_topology() -> None:
    surface = annulus(jitter_seed=5)
    # Crumbs: a vertex very close to a corner of every tenth face.
    chosen = np.arange(0, len(surface.faces), 10)
    corners = surface.vertices[surface.faces[chosen]]
    crumbs = corners @ np.eye(3)
    crumbs = np.einsum("c,kcx->kx", np.array([0.98, 0.01, 0.01]), corners)
    number = len(surface.vertices) + np.arange(chosen.size)
    a, b, c = surface.faces[chosen].T
    parts = [np.column_stack(triple) for triple in ((a, b, number), (b, c, number), (c, a, number))]
    faces = np.vstack([np.delete(surface.faces, chosen, axis=0), *parts])
    crumbly = replace(surface, vertices=np.vstack([surface.vertices, crumbs]), faces=faces)
    clean = contracted(crumbly)
    assert describe(clean) == "annulus"
    assert edge_lengths(clean).min() >= 0.1 * np.median(edge_lengths(crumbly))
    assert area(clean) == pytest.approx(area(surface), rel=1e-9)
    assert prepare(clean)[1].repairs.welded_vertices == 0


def test_contraction_leaves_a_surface_without_crumbs_as_it_is() -> None:
    surface = sphere(subdivisions=2)
    assert contracted(surface) is surface


def test_flat_faces_that_hang_on_the_rim_are_trimmed_and_others_stay() -> None:
    surface = plate(divisions=(4, 3))
    # On the lower rim: two flat ears, one upon the other, and a spike as high as it is long.
    ears = np.array([[15.0, -0.02, 0.0], [12.0, -0.03, 0.0], [35.0, -10.0, 0.0]])
    rim = [int(np.flatnonzero((surface.vertices == [x, 0, 0]).all(axis=1))[0]) for x in (10, 20, 30, 40)]
    first, second, third, fourth = rim
    count = len(surface.vertices)
    faces = [[second, first, count], [count, first, count + 1], [fourth, third, count + 2]]
    eared = replace(surface, vertices=np.vstack([surface.vertices, ears]), faces=np.vstack([surface.faces, faces]))
    clean = trimmed(eared)
    assert len(clean.faces) == len(surface.faces) + 1
    assert area(clean) == pytest.approx(1200.0 + 50.0)
    assert trimmed(surface) is surface


def test_contraction_never_joins_two_rims_across_a_narrow_strip() -> None:
    ring = annulus(inner=10.0, outer=20.0, divisions=(48, 2))
    far = np.linalg.norm(ring.vertices, axis=1) > 11.0
    # Squeezed to a strip a hundredth of a millimetre wide, but for one wide place.
    angle = np.arctan2(ring.vertices[:, 1], ring.vertices[:, 0])
    squeeze = np.where(far & (np.abs(angle) > 1.0), 10.01 / np.linalg.norm(ring.vertices, axis=1), 1.0)
    narrow = replace(ring, vertices=ring.vertices * squeeze[:, None])
    assert describe(contracted(narrow)) == "annulus"


def test_what_is_closest_to_places_asked_for_once_is_what_is_closest_of_all() -> None:
    surface = torus()
    rng = np.random.default_rng(3)
    for spread in (0.0, 0.5, 30.0):
        places = surface.vertices[7] + rng.normal(size=(40, 3)) * spread + [0.0, 0.0, 0.3]
        found, distances = closest_once(surface, places)
        np.testing.assert_allclose(distances, closest(surface, places)[1], atol=1e-12)
        gaps = np.linalg.norm(positions(surface, found) - places, axis=1)
        np.testing.assert_allclose(gaps, distances, atol=1e-12)
