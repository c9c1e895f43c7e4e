from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import FloatArray, Surface
from geoprint.robot.collision.tip_zone import TipZone
from geoprint.robot.collision.tool_solids import quarter
from tests.meshes import plate, spherical_cap
from tests.robot.placements import pointing_down

RADIUS = 0.65
STANDOFF = 0.3
MIDDLE = np.array([[20.3, 15.1, STANDOFF]])


def rooms(poses: FloatArray, surface: Surface, *, radius: float = RADIUS) -> FloatArray:
    return TipZone(surface.vertices[surface.faces]).rooms(poses, radius=radius, standoff=STANDOFF)


@pytest.mark.parametrize("divisions", [(1, 1), (8, 6), (120, 90)])
def test_room_over_a_plate_is_the_standoff(divisions: tuple[int, int]):
    found = rooms(pointing_down(MIDDLE), plate(divisions=divisions))

    np.testing.assert_allclose(found, STANDOFF, atol=1e-12)


@pytest.mark.parametrize("lean_deg", [-25.0, 5.0, 15.0, 40.0])
@pytest.mark.parametrize("divisions", [(1, 1), (80, 60)])
def test_lean_takes_the_known_room(lean_deg: float, divisions: tuple[int, int]):
    lean = np.radians(lean_deg)

    found = rooms(pointing_down(MIDDLE, lean=lean), plate(divisions=divisions))

    np.testing.assert_allclose(found, (STANDOFF - RADIUS * abs(np.sin(lean))) / np.cos(lean), atol=1e-12)


@pytest.mark.parametrize("bowl_radius", [3.0, 10.0])
def test_bowl_takes_the_height_of_its_wall_at_the_rim(bowl_radius: float):
    bowl = spherical_cap(radius=bowl_radius, angle=0.5, rings=60)
    bottom = transforms.rigid(np.eye(3), np.array([[0.0, 0.0, bowl_radius - STANDOFF]]))

    found = rooms(bottom, bowl)

    known = STANDOFF - (bowl_radius - np.sqrt(bowl_radius**2 - RADIUS**2))
    np.testing.assert_allclose(found, known, atol=1e-3)


def test_dome_leaves_the_whole_standoff():
    found = rooms(pointing_down(np.array([[0.0, 0.0, 30.0 + STANDOFF]])), spherical_cap(radius=30.0))

    np.testing.assert_allclose(found, STANDOFF, atol=1e-12)


@pytest.mark.parametrize(("aside", "room"), [(0.6, -0.2), (0.649, -0.2), (0.7, STANDOFF)])
def test_spike_counts_only_within_the_circle(aside: float, room: float):
    ground = plate()
    x, y, _ = MIDDLE[0]
    spike = np.array([[x + aside, y, STANDOFF + 0.2], [x + aside, y, -3.0], [x + aside, y + 1e-3, -3.0]])
    surface = Surface(
        vertices=np.concatenate([ground.vertices, spike]),
        faces=np.concatenate([ground.faces, len(ground.vertices) + np.array([[0, 1, 2]])]),
    )

    np.testing.assert_allclose(rooms(pointing_down(MIDDLE), surface), room, atol=1e-9)


def test_surface_far_below_or_above_is_not_seen():
    poses = pointing_down(np.array([[20.0, 15.0, 3.0], [20.0, 15.0, -2.0], [100.0, 15.0, STANDOFF]]))

    assert (rooms(poses, plate()) == np.inf).all()


def test_far_surface_is_infinite_everywhere():
    assert (rooms(pointing_down(np.array([[0.0, 0.0, 500.0]])), plate()) == np.inf).all()


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_room_is_that_of_the_highest_sample(seed: int):
    generator = np.random.default_rng(seed)
    triangles = generator.uniform([-1.2, -1.2, -0.4], [1.2, 1.2, 0.6], (3, 3, 3))
    samples = triangles
    for _ in range(6):
        samples = quarter(samples)
    points = samples.reshape(-1, 3)
    # The highest point lies in a sample triangle, one of whose corners is at least as high and at most a side away.
    side = np.linalg.norm(samples - np.roll(samples, 1, axis=1), axis=2).max()
    out = np.hypot(points[:, 0], points[:, 1])

    found = TipZone(triangles).rooms(pointing_down(np.zeros((1, 3))), radius=RADIUS, standoff=STANDOFF)[0]

    highest, highest_nearby = (points[out <= reach, 2].max(initial=-np.inf) for reach in (RADIUS, RADIUS + side))
    assert highest - 1e-9 <= -found <= highest_nearby + 1e-9


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_rigid_motion_and_finer_triangles_do_not_change_the_room(seed: int):
    generator = np.random.default_rng(seed)
    cap = spherical_cap(radius=8.0, angle=0.6, rings=5, jitter_seed=3)
    tips = np.array([0.0, 0.0, 8.0 + STANDOFF]) + 0.2 * generator.normal(size=(4, 3))
    poses = pointing_down(tips, lean=0.1)
    motion = transforms.rigid(Rotation.random(random_state=generator).as_matrix(), 100 * generator.normal(size=3))
    triangles = cap.vertices[cap.faces]

    known = TipZone(triangles).rooms(poses, radius=RADIUS, standoff=STANDOFF)
    moved = transforms.apply(motion, quarter(triangles).reshape(-1, 3)).reshape(-1, 3, 3)
    found = TipZone(moved).rooms(motion @ poses, radius=RADIUS, standoff=STANDOFF)

    np.testing.assert_allclose(found, known, atol=1e-9)


def test_each_placement_has_a_circle_of_its_own() -> None:
    """Two placements beside a step of 0.2 mm, each 1 mm away from it: only the wide circle reaches it."""
    step = plate((40.0, 30.0), (1, 1))
    raised = step.vertices + np.array([21.3, 0.0, 0.2])
    triangles = np.concatenate([step.vertices[step.faces], raised[step.faces]])
    poses = pointing_down(np.repeat(MIDDLE, 2, axis=0))

    found = TipZone(triangles).rooms(poses, radius=np.array([0.9, 1.1]), standoff=STANDOFF)

    np.testing.assert_allclose(found, [STANDOFF, STANDOFF - 0.2], atol=1e-12)
