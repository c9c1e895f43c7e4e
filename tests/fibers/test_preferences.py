"""What a field leans to: strokes, directions, rims and curvature become directions in faces with weights."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import FieldError, InputError, UsageError
from geoprint.fibers import (
    AlongCurvature,
    AlongDirection,
    AlongRim,
    AlongStroke,
    Preference,
    Wishes,
    nearest_field,
    smoothest_field,
)
from geoprint.geometry import boundary_loops, closest
from geoprint.model import FloatArray, Surface, SurfaceCurves
from tests import meshes
from tests.fibers.fields_measures import off


def drawn(surface: Surface, *lines: FloatArray) -> SurfaceCurves:
    """Return polylines as curves on a surface."""
    points, _ = closest(surface, np.concatenate(lines))
    offsets = np.cumsum([0, *(len(line) for line in lines)])
    return SurfaceCurves(points, offsets, np.zeros(len(lines), dtype=np.bool_))


def wished(surface: Surface, preference: Preference, *, symmetry: int = 2) -> tuple[Wishes, FloatArray]:
    """Return wishes, and their (k, 3) directions."""
    wishes = preference.wishes(surface, symmetry=symmetry)
    angles = np.zeros(len(surface.faces))
    angles[wishes.faces] = wishes.angles
    return wishes, nearest_field(surface, angles, symmetry=1).directions()[wishes.faces, 0]


@pytest.mark.parametrize(
    "preference",
    [
        AlongRim(weight=7.0),
        AlongDirection(np.array([1.0, 0.0, 2.0]), weight=7.0),
        AlongCurvature("smallest", weight=7.0),
    ],
    ids=lambda preference: type(preference).__name__,
)
def test_weights_add_up_to_that_of_the_preference_on_coarse_and_fine_meshes(preference: Preference) -> None:
    for rings in (6, 12):
        cap = meshes.spherical_cap(rings=rings, jitter_seed=1)
        assert preference.wishes(cap, symmetry=2).weights.sum() == pytest.approx(7.0)
        stroke = AlongStroke(drawn(cap, cap.vertices[[5, 60]]), weight=3.0)
        assert stroke.wishes(cap, symmetry=2).weights.sum() == pytest.approx(3.0)


def test_a_stroke_wishes_its_direction_in_the_faces_that_it_crosses() -> None:
    plate = meshes.plate(jitter_seed=1)
    line = np.array([[5.0, 5.0, 0.0], [33.0, 19.0, 0.0]])
    wishes, directions = wished(plate, AlongStroke(drawn(plate, line)))
    np.testing.assert_allclose(directions, np.tile([28.0, 14.0, 0.0] / np.hypot(28.0, 14.0), (len(directions), 1)))
    crossed = closest(plate, line[0] + np.linspace(0.0, 1.0, 1000)[:, None] * (line[1] - line[0]))[0].faces
    # One that is cut at a corner for a moment may be left out.
    shares = np.bincount(crossed, minlength=len(plate.faces)) / crossed.size
    assert set(np.flatnonzero(shares > 0.04)) <= set(wishes.faces.tolist()) <= set(crossed.tolist())


def test_a_field_follows_a_stroke_that_bends() -> None:
    disc = meshes.disc(rings=16, jitter_seed=1)
    turn = np.linspace(0.0, np.pi / 2, 40)
    arc = 12.0 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(turn.size)])
    field = smoothest_field(disc, symmetry=1, preferences=[AlongStroke(drawn(disc, arc), weight=1000.0)])
    middles = disc.vertices[disc.faces].mean(axis=1)
    beside = (np.abs(np.linalg.norm(middles, axis=1) - 12.0) < 1.0) & (middles[:, 0] > 2.0) & (middles[:, 1] > 2.0)
    assert beside.sum() > 20
    assert off(field, np.cross([0.0, 0.0, 1.0], middles), beside).max() < np.radians(12.0)


def test_a_heavier_stroke_is_followed_closer() -> None:
    disc = meshes.disc(rings=10)
    across = AlongStroke(drawn(disc, np.array([[0.0, -8.0, 0.0], [0.0, 8.0, 0.0]])), weight=3.0)
    sides = np.tile([0.0, 1.0, 0.0], (len(disc.faces), 1))
    kept = np.linalg.norm(disc.vertices[disc.faces].mean(axis=1), axis=1) < 3.0
    errors = [
        off(
            smoothest_field(disc, symmetry=1, preferences=[across, AlongDirection(x, weight=weight)]), sides, kept
        ).max()
        for x in [np.array([1.0, 0.0, 0.0])]
        for weight in (0.1, 3.0, 100.0)
    ]
    assert errors == sorted(errors)
    assert errors[0] < np.radians(5.0) < np.radians(45.0) < errors[-1]


def test_a_direction_is_projected_and_counts_less_where_it_is_steep() -> None:
    cap = meshes.spherical_cap(angle=1.5, rings=12, jitter_seed=1)
    wishes, directions = wished(cap, AlongDirection(np.array([0.0, 0.0, 5.0])))
    middles = cap.vertices[cap.faces].mean(axis=1)
    polar = np.arccos(middles[:, 2] / np.linalg.norm(middles, axis=1))
    rising = -middles * [1.0, 1.0, 0.0]
    level = np.einsum("mx,mx->m", directions, rising) / np.linalg.norm(rising, axis=1)
    assert level[polar > 0.3].min() > 0.0
    by_face = wishes.weights[np.argsort(wishes.faces)]
    assert by_face[polar < 0.2].mean() < 0.05 * by_face[polar > 1.3].mean()


def test_the_rim_wishes_its_own_direction() -> None:
    ring = meshes.annulus(jitter_seed=1)
    wishes, directions = wished(ring, AlongRim())
    middles = ring.vertices[ring.faces].mean(axis=1)[wishes.faces]
    turned = np.einsum(
        "kx,kx->k", directions, np.cross([0.0, 0.0, 1.0], middles / np.linalg.norm(middles, axis=1)[:, None])
    )
    outer = np.linalg.norm(middles, axis=1) > 14.0
    assert wishes.faces.size == sum(loop.size for loop in boundary_loops(ring))
    assert turned[outer].min() > 0.99
    assert turned[~outer].max() < -0.99
    # The longer rim weighs more.
    assert wishes.weights[outer].sum() / wishes.weights[~outer].sum() == pytest.approx(20.0 / 8.0)


@pytest.mark.parametrize(("of", "axis"), [("largest", [1.0, 0.0, 0.0]), ("smallest", [0.0, 1.0, 0.0])])
def test_curvature_is_that_of_a_cylinder(of: str, axis: list[float]) -> None:
    tube = meshes.cylinder_patch(divisions=(24, 20), jitter_seed=1)
    preference = AlongCurvature("largest" if of == "largest" else "smallest")
    wishes, directions = wished(tube, preference)
    normals = np.cross(*np.diff(tube.vertices[tube.faces], axis=1).transpose(1, 0, 2))
    along = np.array(axis) - (normals @ axis / (normals**2).sum(axis=1))[:, None] * normals
    cosines = np.abs(np.einsum("kx,kx->k", directions, along[wishes.faces])) / np.linalg.norm(
        along[wishes.faces], axis=1
    )
    assert np.average(np.arccos(np.clip(cosines, 0.0, 1.0)), weights=wishes.weights) < np.radians(6.0)
    assert off(smoothest_field(tube, symmetry=2, preferences=[preference]), along).max() < np.radians(1.0)


def test_crosses_follow_both_principal_directions_and_vectors_none() -> None:
    tube = meshes.cylinder_patch(jitter_seed=1)
    fields = [smoothest_field(tube, symmetry=4, preferences=[AlongCurvature(of)]) for of in ("largest", "smallest")]
    assert off(fields[0], fields[1].directions()[:, 0]).max() < 1e-6
    with pytest.raises(UsageError, match="a field of vectors cannot follow"):
        smoothest_field(tube, symmetry=1, preferences=[AlongCurvature("largest")])


def test_what_means_nothing_on_a_surface_is_refused() -> None:
    plate, sphere = meshes.plate(jitter_seed=1), meshes.sphere(subdivisions=1)
    dot = drawn(plate, plate.vertices[30:31])
    for surface, preference, why in (
        (sphere, AlongRim(), "sphere is closed"),
        (plate, AlongCurvature("largest"), "plate is flat"),
        (plate, AlongDirection(np.array([0.0, 0.0, 1.0])), "perpendicular to it everywhere"),
        (plate, AlongStroke(dot), "every line drawn on plate has one point"),
        (plate, AlongStroke(drawn(plate, plate.vertices[[30, 30]])), "perpendicular to it everywhere"),
    ):
        with pytest.raises(FieldError, match=why):
            preference.wishes(surface, symmetry=2)


def test_values_that_are_none_are_refused() -> None:
    for weight in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(UsageError, match="it must be positive"):
            AlongRim(weight=weight)
    with pytest.raises(InputError, match="must have a length"):
        AlongDirection(np.zeros(3))
    with pytest.raises(UsageError, match="not 'mean'"):
        AlongCurvature("mean")  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="must not be negative"):
        Wishes(np.array([0]), np.array([0.0]), np.array([-1.0]))
