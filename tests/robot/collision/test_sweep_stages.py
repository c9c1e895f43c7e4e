"""The sweep against thin posts planted just nearer and just farther than the kept distance, wherever only one of its
stages can find them: at placements, beside them, within steps, across rounded corners, in blocks of steps.

The needle is upright and so are the posts, so that the true distance is that of a point from a line in the plane: the
oracle here is plane geometry, and no other solid is near.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.model import BoolArray, ControllerPath, FloatArray
from geoprint.robot.collision.contact import CollisionWorld, InflatedSolids
from geoprint.robot.collision.surroundings import mesh_target
from geoprint.robot.collision.sweep import ALLOWANCE, Placements, _Fan, find_hits, refined, step_parts  # pyright: ignore[reportPrivateUsage]
from geoprint.robot.collision.tool_solids import Solid
from tests.robot.placements import block, pointing_down, run_of

RADIUS, KEPT = 0.15, 0.1
# Half the side of a post; its corners are a little farther out.
HALF = 0.01
NEEDLE = Solid("needle", start=np.zeros(3), end=np.array([0.0, 0.0, -20.0]), start_radius=RADIUS, end_radius=RADIUS)
INFLATED = InflatedSolids((NEEDLE,), kept=(KEPT,))
# What is nearer than kept by this is a hit, and what is farther by this is none [mm].
NEARER, FARTHER = 0.02, 0.12
STILL = np.zeros((1, 2))


def world_with_post(place: FloatArray) -> CollisionWorld:
    x, y = place.tolist()
    post = block((x - HALF, y - HALF, 8.0), (x + HALF, y + HALF, 12.0), name="post")
    return CollisionWorld(INFLATED, targets=(mesh_target(post, role="body"),))


def moving(points: FloatArray, corners: FloatArray | None = None, *, deposit: BoolArray | None = None) -> Placements:
    """Return the needle's motion through (k, 2) points, which stand for (k, 2) corners where these are rounded."""
    placements = run_of(pointing_down(np.column_stack([points, np.zeros(len(points))])), deposit=deposit)
    if corners is None:
        return placements
    return replace(placements, corners=pointing_down(np.column_stack([corners, np.zeros(len(corners))])))


def is_hit(placements: Placements, post: FloatArray, *, largest_step: float = 2.0) -> bool:
    return find_hits(world_with_post(post), placements, largest_step=largest_step) is not None


def distance(points: FloatArray, corners: FloatArray, post: FloatArray) -> float:
    """Return how near the needle's side comes to a post, anywhere between and across, from samples in the plane."""
    shares = np.linspace(0.0, 1.0, 101)[:, None, None]
    across = np.linspace(-1.0, 1.0, 21)[:, None, None, None]
    between = points[:-1] + shares * np.diff(points, axis=0)
    off = corners - points
    offs = off[:-1] + shares * np.diff(off, axis=0)
    return float(np.linalg.norm(between + across * offs - post, axis=-1).min()) - RADIUS - HALF


@pytest.mark.parametrize("share", [0.0, 0.1, 0.25, 0.42, 0.5, 0.58, 0.75, 0.9, 1.0])
@pytest.mark.parametrize("step", [0, 1, 2])
def test_a_post_anywhere_along_three_open_steps_is_found_and_one_farther_is_not(step: int, share: float) -> None:
    points = np.array([[0.0, 0.0], [1.9, 0.0], [1.9, 1.9], [3.8, 1.9]])
    along = points[step + 1] - points[step]
    aside = np.array([along[1], -along[0]]) / 1.9
    beside = points[step] + share * along
    for gap, found in ((KEPT - NEARER, True), (KEPT + FARTHER, False)):
        # On the outer side of the bends, where no other step comes nearer.
        post = beside + (-aside if step == 1 and share > 0.5 else aside) * (RADIUS + HALF + gap)
        if distance(points, points, post) == pytest.approx(gap, abs=0.005):
            assert is_hit(moving(points), post) == found, (gap, post)


def test_a_step_as_large_as_allowed_is_covered_up_to_its_middle() -> None:
    points = np.array([[0.0, 0.0], [3.9, 0.0]])

    assert is_hit(moving(points), np.array([1.95, 0.0]), largest_step=4.0)
    assert not is_hit(moving(points), np.array([1.95, RADIUS + HALF + KEPT + FARTHER]), largest_step=4.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("row", [0, 1, 7, 8, 20, 39, 40, 41, 80])
def test_a_corner_that_is_rounded_by_far_is_found_on_both_sides_wherever_it_lies_in_its_block(
    row: int, side: float
) -> None:
    points = np.column_stack([np.linspace(0.0, 0.4, 81), np.zeros(81)])
    corners = points.copy()
    corners[row, 1] += 3.0

    for gap, found in ((KEPT - NEARER, True), (KEPT + FARTHER, False)):
        post = np.array([points[row, 0], side * (3.0 + RADIUS + HALF + gap)])
        assert is_hit(moving(points, corners), post) == found


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_corner_that_is_rounded_by_more_than_any_inflation_is_found_on_both_sides(side: float) -> None:
    points = np.column_stack([np.linspace(0.0, 0.4, 5), np.zeros(5)])
    corners = points.copy()
    corners[2, 1] += 30.0

    for gap, found in ((KEPT - NEARER, True), (KEPT + FARTHER, False)):
        post = np.array([points[2, 0], side * (30.0 + RADIUS + HALF + gap)])
        assert is_hit(moving(points, corners), post) == found


def test_planted_posts_are_found_where_plane_geometry_has_them_and_nowhere_else() -> None:
    random = np.random.default_rng(11)
    hits, misses = 0, 0
    for _ in range(60):
        count = int(random.choice([2, 3, 9, 60]))
        steps = random.uniform(0.05, 1.9, count - 1) * random.choice([0.05, 1.0])
        ways = np.cumsum(random.normal(0.0, 0.5, count - 1))
        points = np.vstack([STILL, np.cumsum(steps[:, None] * np.column_stack([np.cos(ways), np.sin(ways)]), axis=0)])
        corners = points + (random.random((count, 1)) < 0.3) * random.uniform(-0.4, 0.4, (count, 2))
        row = int(random.integers(count - 1))
        place = points[row] + random.random() * (points[row + 1] - points[row]) + random.uniform(-0.8, 0.8, 2)
        truth = distance(points, corners, place)
        if truth < KEPT - NEARER:
            hits += 1
            assert is_hit(moving(points, corners), place), (truth, count)
        elif truth > KEPT + FARTHER:
            misses += 1
            assert not is_hit(moving(points, corners), place), (truth, count)
    assert hits > 12
    assert misses > 12


def test_travel_and_deposit_differ_for_what_is_not_inflated_downwards() -> None:
    """The tip zone touches nothing on travel and stands for its whole steps; on deposit it may."""
    tip = Solid("tip", start=np.zeros(3), end=np.array([0.0, 0.0, -20.0]), start_radius=RADIUS, end_radius=RADIUS,
                reach_below=0.0)  # fmt: skip
    inflated = InflatedSolids((tip,), kept=(0.0,))
    points = np.array([[0.0, 0.0], [1.9, 0.0], [3.8, 0.0]])
    for x, depositing, found in (
        (0.9, (False, False), True), (2.8, (False, False), True), (0.9, (True, True), False),
        (2.8, (True, True), False),
        (0.6, (False, True), True), (3.2, (False, True), False), (3.2, (True, False), True),
        (0.6, (True, False), False),
    ):  # fmt: skip
        post = block((x - HALF, -HALF, 8.0), (x + HALF, HALF, 12.0), name="post")
        world = CollisionWorld(inflated, targets=(mesh_target(post, role="body"),))
        hits = find_hits(world, moving(points, deposit=np.array([*depositing, False])))
        assert (hits is not None) == found, (x, depositing)


def test_a_cut_path_rounds_its_corners_in_between_by_the_mean_of_both_ends() -> None:
    path = ControllerPath(
        joints=np.array([np.zeros(6), np.full(6, 0.4), np.full(6, 0.6)]), runs=np.array([-1, 0, 0]),
        deposit=np.array([False, True, False]),
        rounding=np.array([np.zeros(6), np.full(6, 0.02), np.full(6, 0.01)]), step=0.5,
    )  # fmt: skip

    found = refined(path, parts=np.array([2, 4]))

    np.testing.assert_allclose(found.rounding[:, 0], [0.0, 0.01, 0.02, 0.0175, 0.015, 0.0125, 0.01])
    np.testing.assert_allclose(found.joints[:, 3], [0.0, 0.2, 0.4, 0.45, 0.5, 0.55, 0.6])
    assert found.runs.tolist() == [-1, -1, 0, 0, 0, 0, 0]
    assert found.deposit.tolist() == [False, False, True, True, True, True, False]


def test_rows_between_a_run_and_a_joint_move_belong_to_the_joint_move_on_either_side_of_it() -> None:
    still = np.zeros((4, 6))
    path = ControllerPath(
        joints=still, runs=np.array([-1, 0, 0, -1]), deposit=np.zeros(4, np.bool_), rounding=still, step=0.5
    )
    found = refined(path, parts=np.array([3, 3, 3]))
    assert found.runs.tolist() == [-1, -1, -1, 0, 0, 0, 0, -1, -1, -1]


def test_steps_are_cut_so_that_none_is_larger_than_allowed() -> None:
    assert step_parts(np.array([0.0, 0.5, 1.79, 1.81, 3.61]), largest=2.0).tolist() == [1, 1, 1, 2, 3]


@pytest.mark.parametrize(("step", "refused"), [(1.97, False), (2.03, True)])
def test_placements_farther_apart_than_two_millimetres_prove_nothing(step: float, *, refused: bool) -> None:
    placements = moving(np.array([[0.0, 0.0], [0.0, 0.5], [step, 0.5]]))
    world = world_with_post(np.array([50.0, 50.0]))
    if refused:
        with pytest.raises(InputError, match=r"the needle moves by 2\.1 mm .* at most 2\.0 mm are allowed"):
            find_hits(world, placements)
    else:
        assert find_hits(world, placements) is None


def test_travel_is_what_lays_nothing_within_runs() -> None:
    placements = replace(
        moving(
            np.column_stack([np.arange(6.0), np.zeros(6)]), deposit=np.array([False, True, False, False, True, False])
        ),
        runs=np.array([-1, 0, 0, 1, 1, -1]),
    )
    assert [placements.travelling(np.array([row])) for row in range(6)] == [False, False, True, True, False, False]
    assert placements.travelling(np.array([2, 3]))
    assert not placements.travelling(np.array([2, 4]))
    assert placements.travels.tolist() == [True, False, True, True, False]


def test_a_rounded_corner_is_asked_in_the_middle_of_each_hundredth_of_a_millimetre_across() -> None:
    poses = pointing_down(np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]))
    corners = pointing_down(np.array([[0.0, 0.03, 0.0], [5.0, 0.0, 0.0]]))

    fan = _Fan.of(poses, corners, rounding=np.array([[0.03], [0.0]]))

    assert fan.owners.tolist() == [0, 0, 0, 1]
    assert fan.parts.tolist() == [3, 1]
    np.testing.assert_allclose(fan.poses[:, 1, 3], [-0.02, 0.0, 0.02, 0.0], atol=1e-12)


def test_what_the_check_may_need_beyond_the_kept_distance_is_75_micrometres() -> None:
    """Half a movement and half a distance across of 10 um each, reaches rounded up by 10 um, shapes larger by 45 um."""
    assert pytest.approx(0.010 + 0.010 + 0.010 + 0.045) == ALLOWANCE


@pytest.mark.parametrize("row", [0, 5, 30, 44])
def test_a_tip_that_dips_within_a_block_is_found_although_it_is_not_inflated_downwards(row: int) -> None:
    tip = Solid("tip", start=np.zeros(3), end=np.array([0.0, 0.0, -20.0]), start_radius=RADIUS, end_radius=RADIUS,
                reach_below=0.0)  # fmt: skip
    tips = np.column_stack([np.linspace(0.0, 4.4, 45), np.zeros(45), np.full(45, 1.0)])
    tips[row, 2] = 0.0
    placements = run_of(pointing_down(tips), deposit=np.zeros(45, dtype=np.bool_))
    for top, found in ((0.1, True), (-0.1, False)):
        post = block((tips[row, 0] - HALF, -HALF, -5.0), (tips[row, 0] + HALF, HALF, top), name="post")
        world = CollisionWorld(InflatedSolids((tip,), kept=(0.0,)), targets=(mesh_target(post, role="body"),))
        assert (find_hits(world, placements) is not None) == found
