"""Fibres by rule through a wall of voxels: a hollow ball, by formula, from both sides, on finer voxels and askew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import FieldError, InputError
from geoprint.fibers import HelixRule, WallCoordinates
from geoprint.geometry import turned_over
from geoprint.model import FloatArray, Surface
from geoprint.transforms import rotation_of
from tests.fibers.fields_measures import off
from tests.fibers.hollow_ball import INNER, OUTER, ball_voxels, skin
from tests.fibers.tetrahedra import solved
from tests.geometry.files.volumes import save_nifti

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
    with pytest.raises(FieldError, match=r"\(0.*, 0.*, -40.*\) mm lies off the wall of ball, farther than 2.5 voxels"):
        ball.depths(np.array([[0.0, 0.0, -20.0], [0.0, 0.0, -40.0]]))
    voxels = ball_voxels()
    nothing = np.zeros_like(voxels.wall)
    for changed, said in (
        ({"cavity": nothing}, "nothing of the wall is beside the cavity"),
        ({"base": nothing}, "nothing of the wall is beside the base"),
        ({"base": ~(voxels.wall | voxels.cavity)}, "nothing of the wall is beside the outside"),
        ({"wall": nothing}, "no voxel is of the wall"),
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
