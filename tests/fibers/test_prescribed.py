"""Fields with given singularities: exactly those, by formula where there is one, and refused where there is none."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from benchmarks.parts.surfaces import Shape, circle, triangulated
from geoprint.errors import FieldError, InputError, MeshError, UsageError
from geoprint.fibers import (
    SYMMETRIES,
    AlongDirection,
    AlongRim,
    DirectionField,
    Singularities,
    prescribed_field,
    singularities_near,
)
from geoprint.fibers.fields import connection
from geoprint.fibers.prescribed import (
    _verify,  # pyright: ignore[reportPrivateUsage]
    face_tree,
    nodes_of,
)
from geoprint.geometry import boundary_loops, describe, edge_lengths, euler_characteristic, prepare, united
from geoprint.geometry.files import load
from geoprint.model import FloatArray, Surface
from tests import meshes
from tests.fibers.fields_measures import inner_vertices, off, off_turned, singularities, turns_around
from tests.shared_data import shared

NONE = singularities()


def without_faces_at(surface: Surface, *vertices: int) -> Surface:
    """Cut a hole around each vertex."""
    faces = surface.faces[~np.isin(surface.faces, vertices).any(axis=1)]
    used, named = np.unique(faces, return_inverse=True)
    return Surface(surface.vertices[used], named.reshape(-1, 3), name=surface.name)


KNOWN = [
    meshes.disc(jitter_seed=1),
    meshes.annulus(jitter_seed=2),
    without_faces_at(meshes.plate(divisions=(16, 12), jitter_seed=3), 60, 150),
    meshes.sphere(subdivisions=2, jitter_seed=4),
    meshes.torus(divisions=(24, 12)),
    without_faces_at(meshes.torus(divisions=(24, 12)), 5, 100),
]


def spread(surface: Surface, *, symmetry: int, seed: int) -> Singularities:
    """Return singularities of index 1 / n and -1 / n about a surface, in all its characteristic where it is closed."""
    missing = 0 if boundary_loops(surface) else symmetry * euler_characteristic(surface)
    signs = np.concatenate([np.full(abs(missing), np.sign(missing)), [1, -1, 1, -1]])
    chosen = np.random.default_rng(seed).choice(inner_vertices(surface), signs.size, replace=False)
    return singularities(*zip(chosen.tolist(), (signs / symmetry).tolist(), strict=True))


def check(field: DirectionField, asked: Singularities, *, again: bool = True) -> None:
    """Check that a field has the singularities asked for and no others, also by the unfolded fans of its vectors."""
    found = field.singularities()
    np.testing.assert_array_equal(found.vertices, asked.vertices)
    np.testing.assert_array_equal(found.indices, asked.indices)
    total = found.indices.sum() + field.turnings().sum()
    assert total == pytest.approx(euler_characteristic(field.surface), abs=1e-12)
    if again:
        assert np.abs(field.turning).max() < field.period / 2
        wanted = dict(zip(asked.vertices.tolist(), asked.indices.tolist(), strict=True))
        measured = turns_around(field)
        assert {vertex: wanted.get(vertex, 0.0) for vertex in measured} == pytest.approx(measured, abs=1e-9)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
@pytest.mark.parametrize("surface", KNOWN, ids=describe)
def test_a_field_has_exactly_the_singularities_asked_for(surface: Surface, symmetry: int) -> None:
    asked = spread(surface, symmetry=symmetry, seed=5)
    check(prescribed_field(surface, symmetry=symmetry, singularities=asked), asked)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
@pytest.mark.parametrize(
    ("file", "kind"),
    [
        ("hearts/rodero01_lv_cavity_closed.ply", "closed, genus 0"),
        ("patches/interventricular_groove_r20_pinholes.ply", "disc with 2 holes"),
        ("patches/mitral_annulus_band_8mm.ply", "annulus"),
        ("patches/lv_apex_disc_r20.ply", "disc"),
    ],
)
def test_so_does_one_on_a_heart(file: str, kind: str, symmetry: int) -> None:
    surface, _ = prepare(load(shared(file), unit="mm"))
    assert describe(surface) == kind
    asked = spread(surface, symmetry=symmetry, seed=6)
    # By two triangles at a thin spot it turns by more than half a period, where the unfolded fans would guess.
    check(prescribed_field(surface, symmetry=symmetry, singularities=asked), asked, again=False)


def test_so_does_one_through_seven_handles() -> None:
    surface, _ = prepare(load(shared("hearts/rodero01_heart_walls_closed.ply"), unit="mm"))
    asked = spread(surface, symmetry=2, seed=7)
    check(prescribed_field(surface, symmetry=2, singularities=asked), asked, again=False)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
@pytest.mark.parametrize("index", [2.0, 1.0, -1.0, -2.0])
def test_whole_turns_at_one_vertex_are_kept_for_crosses_too(index: float, symmetry: int) -> None:
    # A cross field turns by 60 degrees from face to face here: 30 the other way would lead to the same cross.
    disc = meshes.disc(jitter_seed=1)
    field = prescribed_field(disc, symmetry=symmetry, singularities=singularities((0, index)))
    check(field, singularities((0, index)), again=False)
    np.testing.assert_allclose(field.turnings(), [1.0 - index])


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_around_one_singularity_of_index_1_on_a_disc_it_runs_in_circles(symmetry: int) -> None:
    disc = meshes.disc(rings=12)
    field = prescribed_field(disc, symmetry=symmetry, singularities=singularities((0, 1.0)), preferences=[AlongRim()])
    around = np.cross([0.0, 0.0, 1.0], disc.vertices[disc.faces].mean(axis=1))
    # Not in the faces at the middle either.
    assert off(field, around).max() < np.radians(1.0)
    assert off(field, around).mean() < np.radians(0.1)
    if symmetry == 1:
        # Not clockwise: the rim runs counter-clockwise.
        assert (np.einsum("mx,mx->m", field.directions()[:, 0], around) > 0.0).all()


@cache
def unit_disc(*, faces: int, style: str) -> Surface:
    return triangulated(
        Shape((circle(1.0),), lambda flat: np.column_stack([flat, np.zeros(len(flat))])),
        name="disc", faces=faces, style=style,
    )  # fmt: skip


def singular_disc(*, faces: int, style: str, index: float, symmetry: int) -> tuple[float, float]:
    """Return mean edge [mm] and root mean square error [rad] of a field about a vertex off the middle of a disc.

    On the unit disc a field of index I at a turns by I (arg(z - a) - arg(1 - conj(a) z)): harmonic, and its conjugate
    is 0 on the rim, along which only the sum of its turning is given.
    """
    disc = unit_disc(faces=faces, style=style)
    inner = inner_vertices(disc)
    vertex = int(inner[np.argmin(np.linalg.norm(disc.vertices[inner] - [0.3, 0.15, 0.0], axis=1))])
    field = prescribed_field(disc, symmetry=symmetry, singularities=singularities((vertex, index)))
    a, z = (complex(*disc.vertices[vertex, :2]), disc.vertices[disc.faces].mean(axis=1) @ [1.0, 1.0j, 0.0])
    turned = index * (np.angle(z - a) - np.angle(1.0 - np.conj(a) * z))
    wanted = np.column_stack([np.cos(turned), np.sin(turned), np.zeros(z.size)])
    errors = off_turned(field, wanted, np.abs(z - a) > 0.2)
    return float(edge_lengths(disc).mean()), float(np.sqrt((errors**2).mean()))


@pytest.mark.parametrize(("style", "least"), [("irregular", 1.8), ("sliver", 1.4)])
@pytest.mark.parametrize(("index", "symmetry"), [(1.0, 1), (0.5, 2), (-0.25, 4)])
def test_off_the_middle_of_a_disc_it_converges_to_the_formula(
    style: str, least: float, index: float, symmetry: int
) -> None:
    edges, errors = np.array(
        [singular_disc(faces=faces, style=style, index=index, symmetry=symmetry) for faces in (500, 2000, 8000)]
    ).T
    assert np.polyfit(np.log(edges), np.log(errors), 1)[0] > least
    assert errors[-1] < np.radians(0.1)


def cone(*, sine: float, rings: int, jitter_seed: int | None = None) -> Surface:
    """Return a cone about the z axis, its tip vertex 0; circles about that are shorter by the sine than in a plane."""
    flat = meshes.disc(rings=rings, jitter_seed=jitter_seed).vertices[:, :2]
    far = np.linalg.norm(flat, axis=1)
    vertices = np.column_stack([flat * sine, -far * np.sqrt(1.0 - sine**2)])
    return Surface(vertices, meshes.disc(rings=rings).faces, name="cone")


def cone_formula(surface: Surface, *, index: float, sine: float) -> FloatArray:
    """Return (m, 3) vectors of the smoothest field of an index at the tip, against the rays.

    Unrolled, a cone is a sector of angle 2 pi sine. Around it a field turns by that less 2 pi (1 - index), evenly;
    against the rays it turns by 2 pi (index - 1).
    """
    middles = surface.vertices[surface.faces].mean(axis=1)
    polar = np.arctan2(middles[:, 1], middles[:, 0])
    out = np.column_stack([sine * np.cos(polar), sine * np.sin(polar), np.full(polar.size, -np.sqrt(1 - sine**2))])
    around = np.column_stack([-np.sin(polar), np.cos(polar), np.zeros(polar.size)])
    turned = polar * (index - 1.0)
    return np.cos(turned)[:, None] * out + np.sin(turned)[:, None] * around


@pytest.mark.parametrize(("index", "symmetry"), [(0.0, 1), (0.0, 4), (0.5, 2), (0.25, 4), (-1.0, 1)])
def test_on_a_cone_it_turns_evenly_around_the_tip(index: float, symmetry: int) -> None:
    errors: list[float] = []
    for rings in (8, 16, 24):
        part = cone(sine=0.7, rings=rings, jitter_seed=3)
        asked = singularities((0, index)) if index else NONE
        field = prescribed_field(part, symmetry=symmetry, singularities=asked)
        kept = np.linalg.norm(part.vertices[part.faces].mean(axis=1), axis=1) > 5.0
        errors.append(float(off_turned(field, cone_formula(part, index=index, sine=0.7), kept).max()))
    assert errors[-1] < np.radians(0.5)
    assert np.polyfit(np.log([8, 16, 24]), np.log(errors), 1)[0] < -1.0


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_without_singularities_it_is_constant_on_a_plane_whatever_its_holes(symmetry: int) -> None:
    for surface in (meshes.plate(jitter_seed=1), KNOWN[2]):
        field = prescribed_field(surface, symmetry=symmetry, singularities=NONE)
        assert np.abs(field.turning).max() < 1e-9
        assert off(field, np.tile(field.directions()[0, 0], (len(field.angles), 1))).max() < 1e-6


def test_rims_of_a_ring_turn_as_asked_for() -> None:
    ring = meshes.annulus(jitter_seed=2)
    around = np.cross([0.0, 0.0, 1.0], ring.vertices[ring.faces].mean(axis=1))
    for turnings in ([0.0, 0.0], [1.0, -1.0], [-0.5, 0.5]):
        field = prescribed_field(ring, symmetry=2, singularities=NONE, turnings=turnings)
        np.testing.assert_array_equal(field.turnings(), turnings)
        assert (off_turned(field, around).max() < np.radians(1.0)) == (turnings == [0.0, 0.0])


def test_on_a_band_rims_turn_as_on_the_tube_that_it_is_of() -> None:
    # What is constant on a plane with a hole would turn once against the tube.
    ring = meshes.annulus(inner=8.0, outer=20.0)
    polar = np.arctan2(ring.vertices[:, 1], ring.vertices[:, 0])
    heights = np.linalg.norm(ring.vertices, axis=1)
    tube = Surface(np.column_stack([8 * np.cos(polar), 8 * np.sin(polar), -heights]), ring.faces)
    field = prescribed_field(tube, symmetry=1, singularities=NONE)
    np.testing.assert_array_equal(field.turnings(), [0.0, 0.0])
    # By formula: the same angle to the axis everywhere.
    np.testing.assert_allclose(np.ptp(field.directions()[:, 0, 2]), 0.0, atol=1e-6)


def test_between_the_poles_of_a_sphere_it_keeps_its_angle_to_the_meridians() -> None:
    sphere = meshes.sphere(subdivisions=4)
    poles = [int(np.argmax(sign * sphere.vertices[:, 2])) for sign in (1.0, -1.0)]
    axis: FloatArray = sphere.vertices[poles[0]] / 20.0
    field = prescribed_field(sphere, symmetry=1, singularities=singularities((poles[0], 1.0), (poles[1], 1.0)))
    middles = sphere.vertices[sphere.faces].mean(axis=1)
    kept = np.linalg.norm(np.cross(axis, middles), axis=1) > 4.0
    around = np.cross(axis, middles).astype(np.float64)
    assert off_turned(field, around, kept).max() < np.radians(0.5)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_without_singularities_it_runs_evenly_around_a_torus(symmetry: int) -> None:
    torus = meshes.torus(divisions=(48, 24))
    field = prescribed_field(torus, symmetry=symmetry, singularities=NONE)
    around = np.cross([0.0, 0.0, 1.0], torus.vertices[torus.faces].mean(axis=1))
    assert off_turned(field, around).max() < np.radians(3.0)


@pytest.mark.parametrize("surface", KNOWN, ids=describe)
def test_beside_two_trees_two_edges_are_left_for_each_handle(surface: Surface) -> None:
    over, loops = connection(surface), boundary_loops(surface)
    tree = face_tree(over, nodes_of(surface, loops or [surface.faces[0, :1]]))
    assert tree.left.size == 2 - len(loops) - euler_characteristic(surface)
    np.testing.assert_array_equal(np.sort(tree.order), np.arange(len(surface.faces)))


def test_preferences_turn_it_and_leave_its_singularities() -> None:
    disc = meshes.disc(jitter_seed=1, rings=12)
    asked = singularities((20, 0.5), (45, -0.5), (100, 0.5))
    plain = prescribed_field(disc, symmetry=2, singularities=asked)
    leaning = prescribed_field(
        disc, symmetry=2, singularities=asked, preferences=[AlongDirection(np.array([1.0, 0.0, 0.0]), weight=1e4)]
    )
    # Where it turns is drawn together so much that the unfolded fans would guess.
    check(leaning, asked, again=False)
    np.testing.assert_array_equal(leaning.turnings(), plain.turnings())
    along = np.tile([1.0, 0.0, 0.0], (len(disc.faces), 1))
    assert np.median(off(leaning, along)) < np.radians(2.0) < np.radians(10.0) < np.median(off_turned(plain, along))


def test_a_weak_preference_turns_the_field_as_a_whole() -> None:
    plate = meshes.plate(jitter_seed=1)
    slope = np.array([1.0, 2.0, 0.0])
    field = prescribed_field(plate, symmetry=1, singularities=NONE, preferences=[AlongDirection(slope, weight=1e-3)])
    assert off(field, np.tile(slope, (len(plate.faces), 1))).max() < 1e-6


def test_pieces_have_their_own_sums_and_the_refusal_names_the_piece() -> None:
    far = meshes.sphere(subdivisions=2)
    both = united([meshes.torus(divisions=(24, 12)), Surface(far.vertices + np.array([60.0, 0.0, 0.0]), far.faces)])
    first = len(meshes.torus(divisions=(24, 12)).vertices)
    asked = singularities((first + 3, 1.0), (first + 30, 1.0), (5, 0.5), (70, -0.5))
    check(prescribed_field(both, symmetry=2, singularities=asked), asked)
    with pytest.raises(FieldError, match=r"patch 2 of torus, about .* add up to 1") as refused:
        prescribed_field(both, symmetry=2, singularities=singularities((first + 3, 1.0)))
    assert refused.value.details["missed"] == 1.0


@pytest.mark.parametrize(
    ("surface", "indices", "missed"),
    [(meshes.sphere(), [1.0], 1.0), (meshes.sphere(), [1.0, 1.5], -0.5), (meshes.torus(), [0.5], -0.5)],
)
def test_a_wrong_sum_is_refused_with_what_is_missing(surface: Surface, indices: Sequence[float], missed: float) -> None:
    with pytest.raises(FieldError, match=rf"add up to {missed:g}\.") as refused:
        prescribed_field(surface, symmetry=2, singularities=singularities(*enumerate(indices)))
    assert refused.value.details["missed"] == pytest.approx(missed)


def test_so_is_that_of_given_turnings() -> None:
    ring = meshes.annulus()
    with pytest.raises(
        FieldError, match=r"add up to 0\.5 and the turnings of its rims to 0; .* is 0\. Add .* to -0\.5"
    ):
        prescribed_field(ring, symmetry=2, singularities=singularities((5, 0.5)), turnings=[0.0, 0.0])
    with pytest.raises(FieldError, match="has 2 rims and 1 turning: give"):
        prescribed_field(ring, symmetry=2, singularities=NONE, turnings=[0.0])


def test_places_are_those_of_the_nearest_vertices_inside() -> None:
    disc = meshes.disc(jitter_seed=1)
    far, near = disc.vertices[40] + [0.1, 0.1, 0.4], disc.vertices[7] - [0.2, 0.0, 0.0]
    found = singularities_near(disc, np.array([far, near]), indices=np.array([0.5, -1.0]))
    assert (found.vertices.tolist(), found.indices.tolist()) == ([7, 40], [-1.0, 0.5])
    # On the rim nothing turns.
    beside = singularities_near(disc, disc.vertices[boundary_loops(disc)[0][:1]], indices=np.array([0.5])).vertices
    assert beside in inner_vertices(disc)
    with pytest.raises(InputError, match="2 singularities are nearest to vertex 7 of disc"):
        singularities_near(disc, np.array([near, near]), indices=np.array([0.5, 0.5]))
    with pytest.raises(InputError, match="found 1 index, places of shape"):
        singularities_near(disc, np.zeros((2, 3)), indices=np.array([0.5]))
    with pytest.raises(InputError, match="0 such vertices"):
        singularities_near(Surface(np.eye(3), np.array([[0, 1, 2]])), np.zeros((1, 3)), indices=np.array([0.5]))


def test_what_is_no_singularity_is_refused() -> None:
    disc = meshes.disc()
    rim = int(boundary_loops(disc)[0][0])
    padded = Surface(np.vstack([disc.vertices, [99.0, 0.0, 0.0]]), disc.faces)
    for surface, vertex in ((disc, rim), (padded, len(disc.vertices)), (disc, 9999), (disc, -1)):
        with pytest.raises(InputError, match=f"vertex {vertex} is on a rim"):
            prescribed_field(surface, symmetry=2, singularities=singularities((vertex, 0.5)))
    with pytest.raises(InputError, match=r"is 0\.25; .* a multiple of 1/2"):
        prescribed_field(disc, symmetry=2, singularities=singularities((0, 0.25)))
    with pytest.raises(InputError, match=r"turning of rim 1 of disc is 0\.3;"):
        prescribed_field(disc, symmetry=1, singularities=NONE, turnings=[0.3])
    with pytest.raises(UsageError, match="not 6"):
        prescribed_field(disc, symmetry=6, singularities=NONE)
    flat = Surface(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]]))
    with pytest.raises(MeshError, match="has no area"):
        prescribed_field(flat, symmetry=1, singularities=NONE)


def test_a_field_that_breaks_its_promise_is_refused() -> None:
    disc = meshes.disc()
    field = prescribed_field(disc, symmetry=2, singularities=singularities((0, 0.5)))
    with pytest.raises(FieldError, match="should turn around 0 vertices, but turns around 1"):
        _verify(field, NONE, None)
    with pytest.raises(FieldError, match="should turn"):
        _verify(field, singularities((0, 0.5)), [1.0])


def test_one_triangle_and_vertices_that_no_face_uses_are_no_obstacle() -> None:
    alone = Surface(np.array([[9.0, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0], [7, 7, 7]]), np.array([[1, 2, 3]]))
    field = prescribed_field(alone, symmetry=1, singularities=NONE, preferences=[AlongDirection(np.array([0, 1.0, 0]))])
    np.testing.assert_allclose(field.directions()[0, 0], [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_array_equal(field.turnings(), [1.0])


@settings(max_examples=10, deadline=None)
@given(
    turn=st.tuples(*(st.floats(-3, 3) for _ in range(3))),
    shift=st.tuples(*(st.floats(-500, 500) for _ in range(3))),
    seed=st.integers(0, 1000),
    symmetry=st.sampled_from(SYMMETRIES),
)
@pytest.mark.parametrize("surface", [KNOWN[1], KNOWN[3], KNOWN[4]], ids=describe)
def test_a_rigid_motion_and_other_numbers_leave_the_field(
    surface: Surface, turn: tuple[float, ...], shift: tuple[float, ...], seed: int, symmetry: int
) -> None:
    random, rotation = np.random.default_rng(seed), Rotation.from_rotvec(turn)
    order, faces = random.permutation(len(surface.vertices)), random.permutation(len(surface.faces))
    corners = np.argsort(order)[surface.faces[faces]]
    rolled = np.take_along_axis(corners, (np.arange(3) + random.integers(0, 3, len(faces))[:, None]) % 3, axis=1)
    moved = Surface(rotation.apply(surface.vertices[order]) + np.array(shift), rolled, name=surface.name)
    asked = spread(surface, symmetry=symmetry, seed=1)
    renamed = singularities(*zip(np.argsort(order)[asked.vertices].tolist(), asked.indices.tolist(), strict=True))
    preference = np.array([1.0, 2.0, 3.0])
    before = prescribed_field(
        surface, symmetry=symmetry, singularities=asked, preferences=[AlongDirection(preference, weight=0.1)]
    )
    after = prescribed_field(
        moved, symmetry=symmetry, singularities=renamed,
        preferences=[AlongDirection(rotation.apply(preference), weight=0.1)],
    )  # fmt: skip
    assert off(after, rotation.apply(before.directions()[faces, 0])).max() < 1e-5
