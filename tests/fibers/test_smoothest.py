"""The smoothest field: by formula where there is one, singularities that add up, the same however it is numbered."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import special
from scipy.sparse.linalg import ArpackNoConvergence
from scipy.spatial.transform import Rotation

from benchmarks.parts.surfaces import make
from geoprint.errors import FieldError, UsageError
from geoprint.fibers import SYMMETRIES, AlongDirection, AlongRim, prescribed, smoothest_field
from geoprint.geometry import edge_lengths, euler_characteristic, prepare, united
from geoprint.geometry.files import load
from geoprint.model import FloatArray, Surface
from tests import meshes
from tests.fibers.fields_measures import off, off_turned, turns_around
from tests.shared_data import shared


@pytest.mark.parametrize("symmetry", SYMMETRIES)
@pytest.mark.parametrize("style", ["irregular", "sliver", "anisotropic"])
def test_on_a_plane_it_is_constant_whatever_the_triangles(style: str, symmetry: int) -> None:
    field = smoothest_field(make("sheet with hole", faces=600, style=style), symmetry=symmetry)
    assert field.singularities().vertices.size == 0
    flat = smoothest_field(make("disc", faces=600, style=style), symmetry=symmetry)
    assert np.abs(flat.turning).max() < 1e-5


@pytest.mark.parametrize(("turn", "symmetry", "index"), [(0.5, 2, 0.5), (0.75, 4, 0.25), (0.5, 4, 0.5)])
def test_on_a_cone_that_unrolls_to_a_part_of_a_turn_it_is_constant_too(
    turn: float, symmetry: int, index: float
) -> None:
    # A half disc glued along its diameter fits lines, three quarters of one fit crosses.
    disc = meshes.disc(rings=10, jitter_seed=2)
    flat, far = disc.vertices[:, :2], np.linalg.norm(disc.vertices, axis=1)
    cone = Surface(np.column_stack([turn * flat, -np.sqrt(1.0 - turn**2) * far]), disc.faces)
    field = smoothest_field(cone, symmetry=symmetry)
    found = field.singularities()
    assert (found.vertices.tolist(), found.indices.tolist()) == ([0], [index])
    # On the faces that unroll, polyhedral as they are, it turns a little only.
    assert np.abs(field.turning).max() < np.radians(3.0)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_a_disc_whose_rim_it_follows_has_one_turn_in_all(symmetry: int) -> None:
    disc = meshes.disc(rings=12)
    field = smoothest_field(disc, symmetry=symmetry, preferences=[AlongRim()])
    around = np.cross([0.0, 0.0, 1.0], disc.vertices[disc.faces].mean(axis=1))
    np.testing.assert_array_equal(field.turnings(), [0.0])
    assert field.singularities().indices.sum() == 1.0
    # Towards the middle the power of the circles' directions falls with the radius to the power of the symmetry.
    kept = np.linalg.norm(disc.vertices[disc.faces].mean(axis=1), axis=1) > 8.0
    assert off(field, around, kept).max() < np.radians(1.5)


def bessel(order: int, places: FloatArray) -> FloatArray:
    """Return the modified Bessel function of the first kind."""
    return np.asarray(special.iv(order, places), dtype=np.float64)


def disc_error(faces: int) -> tuple[float, float]:
    """Return mean edge [mm] and root mean square error [rad] of lines between a circle's rim and a direction.

    Where the rim is followed and x is preferred inside alike, the power z of the lines solves an equation by Bessel
    functions: its part of x is a(r), that of the circles -b(r) exp(2 i t), both real.
    """
    disc = make("disc", faces=faces)
    radius, rim, inside = 20.0, 30.0, 60.0
    field = smoothest_field(
        disc, symmetry=2,
        preferences=[AlongRim(weight=rim), AlongDirection(np.array([1.0, 0.0, 0.0]), weight=inside)],
    )  # fmt: skip
    # laplacian z = p (z - 1), z' + q (z + exp(2 i t)) = 0 on the rim.
    p, q = inside / (np.pi * radius**2), rim / (2 * np.pi * radius)
    k = np.sqrt(p)
    middles = disc.vertices[disc.faces].mean(axis=1)
    r, t = np.hypot(middles[:, 0], middles[:, 1]), np.arctan2(middles[:, 1], middles[:, 0])
    at_rim = np.array([radius])
    first, second = (
        -q / (k * (bessel(order - 1, k * at_rim) + bessel(order + 1, k * at_rim)) / 2 + q * bessel(order, k * at_rim))
        for order in (0, 2)
    )
    z = 1.0 + first * bessel(0, k * r) + second * bessel(2, k * r) * np.exp(2j * t)
    wanted = np.column_stack([np.cos(np.angle(z) / 2), np.sin(np.angle(z) / 2), np.zeros(r.size)])
    kept = np.abs(z) > 0.3
    assert kept.mean() > 0.5
    return float(edge_lengths(disc).mean()), float(np.sqrt((off(field, wanted, kept) ** 2).mean()))


def test_between_preferences_it_converges_to_bessels_functions() -> None:
    edges, errors = np.array([disc_error(faces) for faces in (1000, 4000, 16000)]).T
    assert np.polyfit(np.log(edges), np.log(errors), 1)[0] > 0.9
    assert errors[-1] < np.radians(0.5)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_on_a_closed_surface_singularities_add_up_and_are_as_small_as_can_be(symmetry: int) -> None:
    for surface in (meshes.sphere(jitter_seed=1), meshes.torus()):
        field = smoothest_field(surface, symmetry=symmetry)
        found = field.singularities()
        assert found.indices.sum() == euler_characteristic(surface)
        assert (np.abs(found.indices) == 1 / symmetry).all()
        assert found.vertices.size == symmetry * euler_characteristic(surface)
        wanted = dict(zip(found.vertices.tolist(), found.indices.tolist(), strict=True))
        measured = turns_around(field)
        assert {vertex: wanted.get(vertex, 0.0) for vertex in measured} == pytest.approx(measured, abs=1e-9)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_on_a_torus_it_runs_around_or_through_at_one_angle(symmetry: int) -> None:
    torus = meshes.torus()
    middles = torus.vertices[torus.faces].mean(axis=1)
    # Where the gradient is least it keeps the angle: the tube turns against it inside as much as outside.
    assert off_turned(smoothest_field(torus, symmetry=symmetry), np.cross([0.0, 0.0, 1.0], middles)).max() < 0.05


@pytest.mark.parametrize(
    "file", ["hearts/rodero01_lv_cavity_closed.ply", "patches/interventricular_groove_r20_pinholes.ply"]
)
@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_so_they_do_on_a_heart(file: str, symmetry: int) -> None:
    surface, _ = prepare(load(shared(file), unit="mm"))
    field = smoothest_field(surface, symmetry=symmetry)
    total = field.singularities().indices.sum() + field.turnings().sum()
    assert total == pytest.approx(euler_characteristic(surface), abs=1e-12)


def test_pieces_have_fields_of_their_own() -> None:
    disc, sphere = meshes.disc(jitter_seed=1), meshes.sphere(subdivisions=2)
    both = united([disc, Surface(sphere.vertices + np.array([60.0, 0.0, 0.0]), sphere.faces)])
    field = smoothest_field(both, symmetry=2)
    assert np.abs(field.turning[: len(disc.faces)]).max() < 1e-5
    assert (field.singularities().vertices >= len(disc.vertices)).all()
    assert field.singularities().indices.sum() == 2.0
    # A preference on one piece leaves the other to itself.
    leaning = smoothest_field(both, symmetry=2, preferences=[AlongRim()])
    assert leaning.singularities().indices.sum() == 3.0


def test_a_few_triangles_have_a_field_too() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    for faces in ([[0, 1, 2]], [[0, 1, 2], [2, 1, 3]]):
        field = smoothest_field(Surface(corners, np.array(faces)), symmetry=4)
        assert np.abs(field.turning).max() < 1e-9


def test_three_directions_are_refused() -> None:
    with pytest.raises(UsageError, match="not 3"):
        smoothest_field(meshes.disc(), symmetry=3)


def test_a_search_that_does_not_end_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def endless(*_: object, **__: object) -> None:
        raise ArpackNoConvergence("no convergence", np.empty(0), np.empty((0, 0)))

    monkeypatch.setattr(prescribed, "eigsh", endless)
    with pytest.raises(FieldError, match="disc has no smoothest field"):
        smoothest_field(meshes.disc(), symmetry=2)


@settings(max_examples=8, deadline=None)
@given(
    turn=st.tuples(*(st.floats(-3, 3) for _ in range(3))),
    shift=st.tuples(*(st.floats(-500, 500) for _ in range(3))),
    seed=st.integers(0, 1000),
    symmetry=st.sampled_from(SYMMETRIES),
)
@pytest.mark.parametrize("alone", [True, False], ids=["alone", "with a preference"])
def test_a_rigid_motion_and_other_numbers_leave_the_field(
    turn: tuple[float, ...], shift: tuple[float, ...], seed: int, symmetry: int, *, alone: bool
) -> None:
    surface, random, rotation = make("bumpy", faces=400), np.random.default_rng(seed), Rotation.from_rotvec(turn)
    order, faces = random.permutation(len(surface.vertices)), random.permutation(len(surface.faces))
    corners = np.argsort(order)[surface.faces[faces]]
    rolled = np.take_along_axis(corners, (np.arange(3) + random.integers(0, 3, len(faces))[:, None]) % 3, axis=1)
    moved = Surface(rotation.apply(surface.vertices[order]) + np.array(shift), rolled, name=surface.name)
    direction = np.array([1.0, 2.0, 3.0])
    before, after = (
        smoothest_field(one, symmetry=symmetry, preferences=[] if alone else [AlongDirection(each)])
        for one, each in ((surface, direction), (moved, rotation.apply(direction)))
    )
    vectors = rotation.apply(before.directions()[faces, 0])
    assert (off_turned(after, vectors) if alone else off(after, vectors)).max() < 1e-3
