"""Fibres by rule through a wall of voxels: a hollow ball, by formula, from both sides, on finer voxels and askew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import FieldError, InputError, UsageError
from geoprint.fibers import HelixRule, WallCoordinates, apex_to_base
from geoprint.geometry import boundary_loops, face_normals, prepare, turned_over, united
from geoprint.geometry.files import load
from geoprint.model import FloatArray, Surface
from geoprint.transforms import rotation_of
from tests import meshes
from tests.fibers.fields_measures import off
from tests.fibers.hollow_ball import INNER, OUTER, ball_voxels, skin
from tests.fibers.tetrahedra import solved
from tests.geometry.files.volumes import save_nifti
from tests.shared_data import shared

RULE = HelixRule(epicardial=np.radians(-60.0), endocardial=np.radians(60.0))


def _depth(radius: float) -> float:
    """Return how deep a place is by formula."""
    return (1.0 / radius - 1.0 / OUTER) / (1.0 / INNER - 1.0 / OUTER)


def _fibres(surface: Surface, angle: float) -> FloatArray:
    """Return (m, 3) fibres about the z axis at a helix angle [rad]."""
    outwards = surface.vertices[surface.faces].mean(axis=1)
    outwards /= np.linalg.norm(outwards, axis=1)[:, None]
    right = np.cross([0.0, 0.0, 1.0], outwards)
    right /= np.linalg.norm(right, axis=1)[:, None]
    return np.cos(angle) * right + np.sin(angle) * np.cross(outwards, right)


@pytest.fixture(scope="module")
def ball() -> WallCoordinates:
    return WallCoordinates(ball_voxels())


@pytest.mark.parametrize("radius", [15.6, 17.5, 20.0, 22.5, 24.4])
def test_depths_are_those_of_the_formula_and_fibres_have_the_angle_of_theirs(
    ball: WallCoordinates, radius: float
) -> None:
    part = skin(radius)
    depths = ball.depths(part.vertices[np.unique(part.faces)])
    assert np.abs(depths - _depth(radius)).mean() < 0.006
    wanted = _fibres(part, float(RULE.angles(np.array([_depth(radius)]))[0]))
    for seen in (part, turned_over(part)):
        # A surface that looks into the cavity has the same fibres.
        assert float(np.degrees(off(ball.field(seen, RULE), wanted)).mean()) < 1.5


@pytest.mark.parametrize(
    ("part", "layer", "angle"), [(25.0, 25.5, -60.0), (25.0, 32.0, -60.0), (20.0, 28.0, -60.0), (15.0, 11.0, 60.0)]
)
def test_layers_beyond_the_wall_have_the_fibres_of_the_side_on_which_they_leave_it(
    ball: WallCoordinates, part: float, layer: float, angle: float
) -> None:
    below = skin(part) if layer > part else turned_over(skin(part))
    over = replace(below, vertices=below.vertices * layer / part)
    found = ball.field(over, RULE, part=below)
    assert float(np.degrees(off(found, _fibres(over, np.radians(angle)))).mean()) < 1.5
    # The axes between which the angle counts are those of the wall, from whichever side the layer is seen.
    assert found.axes is not None
    along = found.directions()[:, 0]
    right, up = (np.einsum("mx,mx->m", along, found.axes[:, axis]) for axis in (0, 1))
    assert float(np.degrees(np.arctan(up / right)).mean()) == pytest.approx(angle, abs=0.5)


def test_a_layer_over_a_part_off_the_wall_is_refused(ball: WallCoordinates) -> None:
    with pytest.raises(FieldError, match=r"lies off the wall of ball"):
        ball.field(skin(24.0), RULE, part=skin(30.0))


def test_depths_end_at_0_and_1_on_both_sides_and_heights_rise_from_the_apex_to_the_base(ball: WallCoordinates) -> None:
    # Of the boundary at the centres of voxels beside it a few tenths of a mm are left: of depth a few hundredths.
    for radius, depth in ((INNER, 1.0), (OUTER, 0.0)):
        part = skin(radius)
        np.testing.assert_allclose(ball.depths(part.vertices[np.unique(part.faces)]), depth, atol=0.06)
    line = np.array([[20.0 * np.sin(a), 0.0, -20.0 * np.cos(a)] for a in np.linspace(0.4, 2.0, 9)])
    assert (np.diff(ball.heights(line)) > 0.0).all()
    assert ball.heights(np.array([[0.0, 0.0, -20.0]]))[0] < 0.2


def test_finer_voxels_come_nearer_to_the_formula(ball: WallCoordinates) -> None:
    part = skin(19.0)
    vertices = part.vertices[np.unique(part.faces)]
    rough, fine = (
        np.abs(each.depths(vertices) - _depth(19.0)).mean() for each in (WallCoordinates(ball_voxels(side=2.0)), ball)
    )
    assert rough > 4.0 * fine
    # What is left comes from the base, which cuts the ball off straight.
    assert fine < 0.002


def test_how_voxels_lie_in_space_does_not_count(ball: WallCoordinates) -> None:
    turned = rotation_of(np.array([0.8, 0.36, 0.0, 0.48]))
    part = skin(20.0)
    field = WallCoordinates(ball_voxels(turned=turned)).field(part, RULE)
    assert float(np.degrees(off(field, ball.field(part, RULE).directions()[:, 0])).mean()) < 1.5


def test_of_several_pieces_of_wall_the_largest_counts(ball: WallCoordinates) -> None:
    voxels = ball_voxels()
    crumb = voxels.wall.copy()
    crumb[1, 1, 1] = True
    with_crumb = WallCoordinates(replace(voxels, wall=crumb))
    places = skin(20.0).vertices[:50]
    places = places[places[:, 2] < -2.0]
    np.testing.assert_array_equal(with_crumb.depths(places), ball.depths(places))


def test_what_is_off_the_wall_and_labels_that_make_no_wall_are_refused(ball: WallCoordinates) -> None:
    with pytest.raises(FieldError, match=r"\(0.*, 0.*, -40.*\) mm lies off the wall of ball, by more than 2.5 voxels"):
        ball.depths(np.array([[0.0, 0.0, -20.0], [0.0, 0.0, -40.0]]))
    voxels = ball_voxels()
    nothing = np.zeros_like(voxels.wall)
    for changed, said in (
        ({"cavity": nothing}, "the wall does not touch the cavity"),
        ({"base": nothing}, "the wall does not touch the base"),
        ({"base": ~(voxels.wall | voxels.cavity)}, "the wall does not touch the outside"),
        ({"wall": nothing}, "no voxel belongs to the wall"),
    ):
        with pytest.raises(FieldError, match=said):
            WallCoordinates(replace(voxels, **changed))
    sheared = voxels.affine + np.array([[0.0, 0.5, 0.0, 0.0], *[[0.0] * 4] * 3])
    with pytest.raises(InputError, match="the edges of its voxels are not square to each other"):
        replace(voxels, affine=sheared)


def test_the_tetrahedra_that_walls_are_held_against_have_the_formula_too(tmp_path: Path) -> None:
    voxels = ball_voxels()
    labels = np.where(voxels.wall, 1, np.where(voxels.cavity, 2, np.where(voxels.base, 3, 0)))
    save_nifti(tmp_path / "ball.nii.gz", labels.astype(np.uint8), voxels.affine)
    own = solved(tmp_path / "ball.nii.gz", wall=[1], cavity=[2], base=[3])
    for radius in (17.0, 23.0):
        part = skin(radius)
        middles = part.vertices[part.faces].mean(axis=1)
        found, _ = own.fibres(middles, epicardial=RULE.epicardial, endocardial=RULE.endocardial)
        wanted = _fibres(part, float(RULE.angles(np.array([_depth(radius)]))[0]))
        assert float(np.degrees(np.arccos(np.abs(np.einsum("mx,mx->m", found, wanted)))).mean()) < 2.0


# Fibres by rule: helix angles on a tube, an ellipsoid and a heart, and what has no apex or no base.


def bowl(*, rings: int = 16, jitter_seed: int | None = 1) -> Surface:
    """Return half of an ellipsoid, its apex, vertex 0, down and its base open above: a ventricle, seen from outside."""
    cap = meshes.spherical_cap(radius=1.0, angle=np.pi / 2, rings=rings, jitter_seed=jitter_seed)
    return Surface(cap.vertices * [20.0, -20.0, -40.0], cap.faces, name="bowl")


def helix_angles(surface: Surface, directions: FloatArray) -> FloatArray:
    """Return the angle of lines to the horizontal, positive where they rise to the right seen from outside [rad]."""
    outwards = face_normals(surface)
    right = np.cross([0.0, 0.0, 1.0], outwards)
    rightwards = np.sign(np.einsum("mx,mx->m", directions, right))
    up = np.cross(outwards, right / np.linalg.norm(right, axis=1)[:, None])
    return np.arcsin(np.clip(rightwards * np.einsum("mx,mx->m", directions, up), -1.0, 1.0))


@pytest.mark.parametrize("depth", [0.0, 0.25, 0.5, 1.0])
def test_on_a_bowl_with_an_axis_the_helix_angle_is_that_of_the_depth(depth: float) -> None:
    part = bowl()
    assert (np.einsum("mx,mx->m", face_normals(part), part.vertices[part.faces].mean(axis=1)) > 0.0).all()
    field = RULE.field(part, heights=part.vertices[:, 2], depths=np.full(len(part.vertices), depth))
    wanted = np.radians(-60.0 + 120.0 * depth)
    np.testing.assert_allclose(helix_angles(part, field.directions()[:, 0]), wanted, atol=1e-6)
    assert field.symmetry == 2
    # Around the apex lines turn once.
    found = field.singularities()
    assert (found.vertices.tolist(), found.indices.tolist()) == ([0], [1.0])
    np.testing.assert_array_equal(field.turnings(), [0.0])


def test_a_positive_angle_winds_as_a_right_handed_screw() -> None:
    part = bowl()
    field = RULE.field(part, heights=part.vertices[:, 2], depths=np.ones(len(part.vertices)))
    middles, along = part.vertices[part.faces].mean(axis=1), field.directions()[:, 0]
    turning = np.einsum("mx,mx->m", np.cross([0.0, 0.0, 1.0], middles), along)
    assert (turning * along[:, 2] > 0.0).all()


def test_an_endocardium_that_looks_into_the_cavity_is_turned_over() -> None:
    cavity = turned_over(bowl())
    depths = np.ones(len(cavity.vertices))
    looking_in = RULE.field(cavity, heights=cavity.vertices[:, 2], depths=depths)
    turned = RULE.field(turned_over(cavity), heights=cavity.vertices[:, 2], depths=depths)
    np.testing.assert_allclose(helix_angles(turned_over(cavity), turned.directions()[:, 0]), np.radians(60.0))
    assert off(turned, looking_in.directions()[:, 0]).min() > np.radians(30.0)


def test_the_depth_may_vary_and_its_power_keeps_the_epicardial_angle_longer() -> None:
    part = bowl()
    depths = (part.vertices[:, 2] + 40.0) / 40.0
    field = HelixRule(np.radians(-60.0), np.radians(60.0), power=3.0).field(
        part, heights=part.vertices[:, 2], depths=np.clip(depths, 0.0, 1.0)
    )
    middles = np.clip(depths, 0.0, 1.0)[part.faces] ** 3
    wanted = np.radians(-60.0) + np.radians(120.0) * middles.mean(axis=1)
    np.testing.assert_allclose(helix_angles(part, field.directions()[:, 0]), wanted, atol=1e-6)


def test_heights_on_a_tube_rise_evenly_from_apex_to_base() -> None:
    tube = meshes.cylinder_patch(jitter_seed=1)
    low, high = (np.flatnonzero(np.abs(tube.vertices[:, 1] - end) < 1e-9) for end in (0.0, 40.0))
    np.testing.assert_allclose(apex_to_base(tube, apex=low, base=high), tube.vertices[:, 1] / 40.0, atol=2e-3)


@pytest.mark.parametrize("rings", [8, 16])
def test_from_the_apex_to_the_base_they_rise_along_the_meridians_of_a_bowl(rings: int) -> None:
    part = bowl(rings=rings, jitter_seed=None)
    heights = apex_to_base(part, apex=np.array([0]), base=boundary_loops(part)[0])
    field = RULE.field(part, heights=heights, depths=np.ones(len(part.vertices)))
    kept = np.linalg.norm(part.vertices[part.faces].mean(axis=1)[:, :2], axis=1) > 3.0
    angles = helix_angles(part, field.directions()[:, 0])
    np.testing.assert_allclose(angles[kept], np.radians(60.0), atol=np.radians(6.0 * 8 / rings))
    assert field.singularities().vertices.tolist() == [0]


def test_on_a_ventricle_fibres_run_around_the_axis_and_faces_at_the_base_are_filled() -> None:
    surface, _ = prepare(load(shared("hearts/rodero01_lv_epicardium.ply"), unit="mm"))
    base = boundary_loops(surface)[0]
    apex = np.array([np.argmax(np.linalg.norm(surface.vertices - surface.vertices[base].mean(axis=0), axis=1))])
    heights = apex_to_base(surface, apex=apex, base=base)
    assert heights.min() == 0.0
    assert heights.max() == 1.0
    ears = (heights[surface.faces] == 1.0).all(axis=1)
    field = HelixRule().field(surface, heights=heights, depths=np.zeros(heights.size))
    assert ears.any()
    assert field.singularities().indices.sum() + field.turnings().sum() == pytest.approx(1.0)
    near = (heights[surface.faces].mean(axis=1) > 0.3) & ~ears
    assert np.abs(field.turning[near]).max() < np.pi / 2


def test_the_angle_goes_from_side_to_side() -> None:
    depths = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(np.degrees(RULE.angles(depths)), np.linspace(-60.0, 60.0, 11))
    for beyond in (-0.1, 1.1, np.nan):
        with pytest.raises(InputError, match="from 0 at the epicardium to 1"):
            RULE.angles(np.array([0.5, beyond]))
    with pytest.raises(UsageError, match="positive power"):
        HelixRule(power=0.0)
    with pytest.raises(UsageError, match="two angles"):
        HelixRule(epicardial=np.nan)


def test_what_has_no_apex_no_base_or_no_height_is_refused() -> None:
    part = bowl()
    base = boundary_loops(part)[0]
    for apex in (base[:1], np.array([99999])):
        with pytest.raises(InputError, match="none is both"):
            apex_to_base(part, apex=apex, base=base)
    both = united([part, Surface(part.vertices + np.array([99.0, 0.0, 0.0]), part.faces)])
    with pytest.raises(FieldError, match="no apex or no base"):
        apex_to_base(both, apex=np.array([0]), base=base)
    with pytest.raises(FieldError, match="the height is constant over"):
        RULE.field(part, heights=np.ones(len(part.vertices)), depths=np.zeros(len(part.vertices)))
    with pytest.raises(InputError, match="a finite height and a depth at each"):
        RULE.field(part, heights=np.ones(3), depths=np.zeros(3))
