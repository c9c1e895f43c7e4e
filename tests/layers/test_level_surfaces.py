"""Level surfaces of the distance: known shapes, creases, holes and hearts, and what cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import FieldError, InputError, MeshError
from geoprint.geometry import (
    boundary_loops,
    clipped,
    closest,
    component_labels,
    edge_lengths,
    euler_characteristic,
    face_areas,
    face_normals,
    turned_over,
)
from geoprint.geometry.crossings import crossings
from geoprint.geometry.files import load
from geoprint.layers import level_surface
from geoprint.layers.feet import Ground
from geoprint.layers.level_surfaces import net, several_sheets
from geoprint.layers.refining import cosines
from geoprint.model import FloatArray, Surface
from tests import meshes
from tests.shared_data import shared

LAYER = 0.4


def _places(surface: Surface, count: int = 20_000) -> tuple[FloatArray, FloatArray]:
    """Return places drawn evenly from a surface, and the normals of their faces."""
    random = np.random.default_rng(5)
    areas = face_areas(surface)
    faces = random.choice(len(surface.faces), count, p=areas / areas.sum())
    shares = random.dirichlet(np.ones(3), count)
    return np.einsum("kc,kcx->kx", shares, surface.vertices[surface.faces[faces]]), face_normals(surface)[faces]


def _judged(part: Surface, level: Surface, *, height: float) -> float:
    """Return the share of the area that lies off by more than 2 % of a layer; nothing is flipped, nothing crosses."""
    places, upright = _places(level)
    points, distances = closest(part, places)
    away = places - points.xyz(part)
    assert (np.einsum("kx,kx->k", away, upright) <= 0.0).mean() < 1e-4
    assert crossings(level, depth=1e-9)[0].size == 0
    return float((np.abs(distances - height) > 0.02 * LAYER).mean())


def _level(part: Surface, height: float, *, edge: float = 0.5) -> Surface:
    return level_surface(part, height=height, edge_length=edge, tolerance=0.01 * LAYER)


def test_over_a_plate_it_is_the_plate() -> None:
    part = meshes.plate((12.0, 8.0), (6, 4))
    level = _level(part, 0.7)
    np.testing.assert_allclose(level.vertices[:, 2], 0.7, atol=1e-4)
    assert face_areas(level).sum() == pytest.approx(96.0, rel=4e-3)
    np.testing.assert_allclose(level.vertices.min(axis=0)[:2], 0.0, atol=0.02)
    np.testing.assert_allclose(level.vertices.max(axis=0)[:2], [12.0, 8.0], atol=0.02)
    assert np.median(edge_lengths(level)) == pytest.approx(0.5, rel=0.2)


@pytest.mark.parametrize("inner", [False, True])
def test_over_a_cap_it_is_a_cap(*, inner: bool) -> None:
    part = meshes.spherical_cap(radius=10.0, angle=0.9, rings=24)
    before = float(face_areas(part).sum())
    level = _level(turned_over(part) if inner else part, 2.0)
    radius = 8.0 if inner else 12.0
    assert face_areas(level).sum() == pytest.approx(before * (radius / 10.0) ** 2, rel=0.002)
    np.testing.assert_allclose(np.linalg.norm(level.vertices, axis=1), radius, atol=0.02)
    # The rim is ruled by the normals: as far from the pole as below.
    polar = np.arccos(level.vertices[:, 2] / np.linalg.norm(level.vertices, axis=1))
    assert polar.max() == pytest.approx(0.9, abs=0.001)


def test_over_a_cylinder_it_is_a_cylinder() -> None:
    part = meshes.cylinder_patch(radius=10.0, angle=0.8, length=6.0, divisions=(27, 5))
    level = _level(part, 1.5)
    assert face_areas(level).sum() == pytest.approx(0.8 * 11.5 * 6.0, rel=0.002)
    assert _judged(part, level, height=1.5) < 1e-3


@pytest.mark.parametrize("inner", [False, True])
def test_the_area_of_a_shell_comes_to_its_formula_with_the_square_of_the_edge(*, inner: bool) -> None:
    off: list[float] = []
    for rings in (4, 8):
        part = meshes.spherical_cap(radius=12.0, angle=0.8, rings=rings, jitter_seed=3)
        area = float(face_areas(part).sum()) * (0.75 if inner else 1.25) ** 2
        level = _level(turned_over(part) if inner else part, 3.0)
        off.append(abs(float(face_areas(level).sum()) / area - 1.0))
    assert off[0] < 0.015
    assert off[0] / off[1] > 3.0


def _ridge(angle_deg: float) -> Surface:
    """Return two plates of 5 by 6 mm that meet in a ridge along y; both fall from it."""
    flat = meshes.plate((10.0, 6.0), (10, 6))
    across = flat.vertices[:, 0] - 5.0
    slope = np.radians(angle_deg)
    vertices = np.column_stack([across * np.cos(slope), flat.vertices[:, 1], -np.abs(across) * np.sin(slope)])
    return Surface(vertices, flat.faces, "ridge")


@pytest.mark.parametrize("angle_deg", [10.0, 35.0])
def test_a_ridge_is_rounded_and_a_groove_keeps_its_crease(angle_deg: float) -> None:
    ridge = _ridge(angle_deg)
    over = _level(ridge, 1.0)
    assert _judged(ridge, over, height=1.0) < 1e-3
    arc = 2.0 * np.radians(angle_deg)
    assert face_areas(over).sum() == pytest.approx(6.0 * (10.0 + arc), rel=0.005)
    groove = turned_over(ridge)
    within = _level(groove, 1.0)
    assert _judged(groove, within, height=1.0) < 1e-3
    assert face_areas(within).sum() == pytest.approx(6.0 * (10.0 - 2.0 * np.tan(arc / 2.0)), rel=0.005)
    deepest = within.vertices[np.abs(within.vertices[:, 0]) < 0.05]
    assert deepest[:, 2].max() == pytest.approx(-1.0 / np.cos(arc / 2.0), abs=0.02)


def test_a_hole_stays_a_hole_and_a_closed_part_closed() -> None:
    ring = meshes.annulus(inner=4.0, outer=9.0, divisions=(60, 10))
    over = _level(ring, 0.8, edge=1.0)
    assert len(boundary_loops(over)) == 2
    assert face_areas(over).sum() == pytest.approx(face_areas(ring).sum(), rel=1e-3)
    ball = meshes.sphere(radius=3.0, subdivisions=3)
    shell = _level(ball, 0.8)
    assert (euler_characteristic(shell), len(boundary_loops(shell))) == (2, 0)
    assert face_areas(shell).sum() == pytest.approx(4.0 * np.pi * 3.8**2, rel=0.01)


def test_a_bowl_of_half_as_much_again_as_the_thickness_is_filled() -> None:
    bowl = turned_over(meshes.spherical_cap(radius=3.0, angle=1.2, rings=20))
    assert _judged(bowl, _level(bowl, 2.0, edge=0.3), height=2.0) < 1e-3


def test_pieces_stay_pieces() -> None:
    first = meshes.plate((6.0, 6.0), (6, 6))
    both = Surface(
        np.concatenate([first.vertices, first.vertices + np.array([20.0, 0.0, 0.0])]),
        np.concatenate([first.faces, first.faces + len(first.vertices)]),
    )
    level = _level(both, 0.6)
    assert component_labels(level).max() == 1
    assert face_areas(level).sum() == pytest.approx(72.0, rel=4e-3)


def test_where_nothing_is_so_far_away_it_is_refused() -> None:
    with pytest.raises(FieldError, match="12 mm away from it: choose a smaller thickness"):
        _level(turned_over(meshes.sphere(radius=10.0, subdivisions=3)), 12.0, edge=1.0)


@pytest.mark.parametrize("name", ["height", "edge_length", "tolerance"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_lengths_are_positive_numbers(name: str, value: float) -> None:
    lengths = {"height": 1.0, "edge_length": 0.5, "tolerance": 0.01} | {name: value}
    with pytest.raises(InputError, match=f"{name} must be a positive number"):
        level_surface(meshes.plate(), **lengths)


def test_a_cell_is_crossed_by_one_sheet() -> None:
    # One corner, an edge and a face on one side are one sheet; two corners that share no edge are two.
    assert not several_sheets()[[0, 1, 0b11, 0b1111, 255]].any()
    assert several_sheets()[[0b1001, 0b10000001, 0b01101001]].all()
    groove = turned_over(_ridge(60.0))
    for shift in (0.0, 0.3, 0.6):
        _, faces = net(Ground(groove), height=0.3, cell=0.35, shift=shift)
        sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        assert np.unique(sides, axis=0, return_counts=True)[1].max() <= 2


def _cut_out(whole: Surface) -> Surface:
    """Return what of a disc lies about its middle, and of a band a quarter."""
    away = whole.vertices - whole.vertices.mean(axis=0)
    rims = len(boundary_loops(whole))
    return clipped(whole, (away[:, :2] if rims == 2 else np.linalg.norm(away, axis=1)[:, None] - 7.0))


@pytest.mark.parametrize("name", ["interventricular_groove_disc_r20", "lv_apex_disc_r20", "aortic_root_band_6mm"])
def test_over_hearts_a_layer_is_as_high_as_it_shall_be(name: str) -> None:
    part = _cut_out(load(shared(f"patches/{name}.ply"), unit="mm"))
    for height in (0.2, 3.0):
        level = level_surface(part, height=height, edge_length=0.5, tolerance=0.01 * LAYER)
        assert _judged(part, level, height=height) < 1e-3
        assert len(boundary_loops(level)) == len(boundary_loops(part))


@pytest.mark.parametrize("high", [0.0, 0.4])
def test_a_face_without_area_does_not_follow_the_level_even_upon_the_part(high: float) -> None:
    part = meshes.plate((10.0, 10.0), (4, 4))
    vertices = np.array([[2.0, 2.0, high], [4.0, 2.0, high], [3.0, 2.0, high], [3.0, 4.0, 0.4]])
    found = cosines(Ground(part), vertices, np.array([[0, 1, 2], [0, 1, 3]]))
    assert found[0] == 0.0
    assert found[1] > 0.0


def test_a_mesh_that_is_none_is_refused() -> None:
    fan = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])
    with pytest.raises(MeshError):
        _level(Surface(fan, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])), 0.5)
