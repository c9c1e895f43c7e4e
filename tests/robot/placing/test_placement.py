"""Placement from touched points and for demonstrations."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import InputError, ReachError
from geoprint.model import FloatArray, Surface, TouchedPoints
from geoprint.robot.placing.placement import demo_placement, fit_touched_points
from tests.meshes import spherical_cap

CORNERS = np.array([[-50.0, 50.0, 0.0], [50.0, 50.0, 0.0], [50.0, -50.0, 0.0], [-50.0, -50.0, 0.0]])
TOUCHED = np.array([[250.0, 50.0, 0.0], [350.0, 50.0, 0.0], [350.0, -50.0, 0.0], [250.0, -50.0, 0.0]])
SOLID = np.array([[0.0, 0.0, 0.0], [80.0, 0.0, 0.0], [0.0, 60.0, 0.0], [10.0, 0.0, 40.0]])


def points(model: FloatArray, touched: FloatArray) -> TouchedPoints:
    return TouchedPoints(model=model, touched=touched, T_fixture_work=np.eye(4))


def dome(half_angle_deg: float) -> Surface:
    """A spherical cap of radius 40 mm about the x axis, its rim at the half angle."""
    cap = spherical_cap(radius=40.0, angle=np.radians(half_angle_deg))
    return Surface(vertices=cap.vertices[:, [2, 0, 1]], faces=cap.faces, name="dome")


def test_corners_of_the_paper_put_the_pedestal_where_the_paper_has_it() -> None:
    T_fixture_work = transforms.rigid(np.eye(3), np.array([0.0, 0.0, 12.0]))
    placement = fit_touched_points(TouchedPoints(model=CORNERS, touched=TOUCHED, T_fixture_work=T_fixture_work))
    assert placement.calibrated
    np.testing.assert_allclose(
        placement.T_base_fixture, transforms.rigid(np.eye(3), np.array([300.0, 0, 0])), atol=1e-9
    )
    np.testing.assert_allclose(placement.T_base_work[:3, 3], [300.0, 0.0, 12.0], atol=1e-9)
    np.testing.assert_allclose(placement.misses, 0.0, atol=1e-9)


def test_a_corner_touched_too_high_misses_what_the_others_say_by_all_of_it() -> None:
    # A warp is the same seen from each corner of a square.
    touched = TOUCHED.copy()
    touched[0, 2] = 0.4
    misses = fit_touched_points(points(CORNERS, touched)).misses
    np.testing.assert_allclose(misses, 0.4, atol=2e-3)


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3),
    st.lists(st.floats(-500.0, 500.0), min_size=3, max_size=3),
)
def test_any_rigid_motion_of_a_solid_fixture_is_recovered(turn: list[float], move: list[float]) -> None:
    truth = transforms.rigid(Rotation.from_rotvec(turn).as_matrix(), np.array(move))
    placement = fit_touched_points(points(SOLID, transforms.apply(truth, SOLID)))
    np.testing.assert_allclose(placement.T_base_fixture, truth, atol=1e-8)


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_fewer_than_four_points_are_refused(count: int) -> None:
    with pytest.raises(InputError, match=f"has {count} touched points?; at least 4"):
        fit_touched_points(points(CORNERS[:count], TOUCHED[:count]))


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("corner", [0, 3])
def test_a_corner_that_the_others_put_elsewhere_is_refused_although_the_fit_follows_it(corner: int, axis: int) -> None:
    touched = TOUCHED.copy()
    touched[corner, axis] += 2.4
    with pytest.raises(InputError, match=r"mm from the fit of the others, allowed are 2 mm"):
        fit_touched_points(points(CORNERS, touched))


def test_a_point_that_nothing_could_contradict_is_refused() -> None:
    on_an_edge = np.array([[-50.0, 50.0, 0.0], [0.0, 50.0, 0.0], [50.0, 50.0, 0.0], [50.0, -50.0, 0.0]])
    with pytest.raises(InputError, match="without touched point 4, the other 3 lie on a line"):
        fit_touched_points(points(on_an_edge, on_an_edge + 300.0))


LINE = np.array([[0.0, 0.0, 0.0], [50.0, 0.0, 0.0], [100.0, 0.2, 0.0], [150.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("model", "touched", "named"),
    [
        (LINE, TOUCHED, "model points"),
        (CORNERS, LINE, "touched points"),
        (np.ones((4, 3)), TOUCHED, "model points"),
    ],
)
def test_points_on_a_line_are_refused(model: FloatArray, touched: FloatArray, named: str) -> None:
    with pytest.raises(InputError, match=f"{named}.* lie on a line"):
        fit_touched_points(points(model, touched))


def test_mirrored_solid_is_refused() -> None:
    with pytest.raises(InputError, match="mirror the model points"):
        fit_touched_points(points(SOLID, SOLID * [1.0, -1.0, 1.0] + [300.0, 0.0, 0.0]))


def test_corners_touched_in_mirrored_order_are_refused() -> None:
    with pytest.raises(InputError, match="mirrored order"):
        fit_touched_points(points(CORNERS, TOUCHED[::-1]))


@pytest.mark.parametrize("pair", [*combinations(range(4), 2)])
def test_two_corners_that_are_swapped_are_named(pair: tuple[int, int]) -> None:
    noise = np.random.default_rng(3)
    # Exchanging either diagonal of a square makes it fit again.
    named = "1 and 3, or 2 and 4" if pair in {(0, 2), (1, 3)} else f"{pair[0] + 1} and {pair[1] + 1}"
    for _ in range(10):
        touched = TOUCHED + noise.normal(0.0, 0.2, (4, 3))
        touched[[*pair]] = touched[[*reversed(pair)]]
        with pytest.raises(InputError, match=rf"touched points {named} look swapped.* As listed: "):
            fit_touched_points(points(CORNERS, touched))


def test_a_corner_mistyped_by_a_centimetre_is_not_taken_for_a_swap() -> None:
    touched = TOUCHED.copy()
    touched[2, 1] += 10.0
    with pytest.raises(InputError, match=r"^touched point \d of 4 lies"):
        fit_touched_points(points(CORNERS, touched))


def test_demonstration_puts_the_centroid_in_place_with_the_mean_normal_up() -> None:
    surface = dome(60.0)
    placement = demo_placement(surface, position=np.array([300.0, 0.0, 50.0]))
    assert not placement.calibrated
    assert placement.misses.size == 0
    # The cap looks along x, and its centroid lies on that axis at half the height of the cap (Archimedes).
    T_base_work = placement.T_base_work
    np.testing.assert_allclose(T_base_work[:3, :3] @ [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], atol=1e-9)
    centroid = np.array([40.0 * (1.0 + np.cos(np.radians(60.0))) / 2.0, 0.0, 0.0])
    np.testing.assert_allclose(transforms.apply(T_base_work, centroid[None])[0], [300.0, 0.0, 50.0], atol=0.2)


def test_demonstration_turns_the_part_no_more_than_needed() -> None:
    T_base_work = demo_placement(dome(60.0), position=np.zeros(3)).T_base_work
    np.testing.assert_allclose(T_base_work[:3, :3] @ [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], atol=1e-9)


def test_demonstration_of_a_part_that_faces_all_directions_is_refused() -> None:
    # The mean normal of a cap has the length (1 + cos) / 2: 0.413 at 100 degrees, a little more with few faces.
    with pytest.raises(ReachError, match=r"dome has no demonstration placement.*0\.42.*0\.6"):
        demo_placement(dome(100.0), position=np.zeros(3))
