"""Rounded corners: the documented parabola, and any smaller one, stays within the rounding of the checked path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.model import (
    Bend,
    BoolArray,
    Clearance,
    ControllerPath,
    FloatArray,
    JointPath,
    PoseStream,
    Surface,
    Targets,
)
from geoprint.robot.arm.kinematics import Arm
from geoprint.robot.collision.clearance import check_placements
from geoprint.robot.collision.sweep import Placements, refined
from geoprint.robot.collision.tool_solids import ARC_ALLOWANCE
from geoprint.robot.controller.fitting import _distance  # pyright: ignore[reportPrivateUsage]
from geoprint.robot.controller.interpolation import controller_path, triangle_middles
from geoprint.robot.controller.targets import bends_of
from tests.meshes import plate
from tests.robot.cells import straight_cell
from tests.robot.joint_paths import arc, arm_of, solved, stream, tilted
from tests.robot.placements import block, line, pointing_down, run_of

CELL = straight_cell()
ARM = arm_of(CELL)
ZONE = 0.3
# Over the middle of the plate, along y.
LINE = line((20.0, 5.0, 0.3), (20.0, 25.0, 0.3))


def placements_of(poses: FloatArray, corners: FloatArray, *, deposit: BoolArray | None = None) -> Placements:
    return replace(run_of(poses, deposit=deposit), corners=corners)


def check(placements: Placements, *, body: Surface | None = None) -> Clearance:
    return check_placements(
        placements, tool=CELL.tool, process=CELL.process, standoff=0.3, part=plate(), body=body, obstacles=(),
        T_work_base=np.eye(4),
    )  # fmt: skip


def corner(turn: float, *, lean: float = 0.0) -> tuple[JointPath, Targets]:
    """Return two straight lines of 4 mm that meet at a target with a zone, and the tool leaning in between [rad]."""
    tips = 4.0 * np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [np.cos(turn), np.sin(turn), 0.0]])
    path = solved(stream(tips, quaternions=tilted(lean * np.array([0.0, 1.0, 0.3]))), ARM)
    return path, Targets(poses=np.arange(3), zones=np.array([0.0, ZONE, 0.0]), speeds=np.full(3, 20.0))


def blended(path: JointPath, *, zone: float, count: int = 21) -> FloatArray:
    """Return (count, 4, 4) poses of the tool on the parabola of a zone around the middle target, in the base frame."""
    targets = ARM.tool_poses(path.joints)
    share = np.array([zone / 4.0])
    entry, exit_ = (transforms.interpolate_poses(targets[1:2], targets[[end]], share) for end in (0, 2))
    shares = np.linspace(0.0, 1.0, count)
    along = [np.repeat(pose, count, axis=0) for pose in (entry, targets[1:2], exit_)]
    first = transforms.interpolate_poses(along[0], along[1], shares)
    second = transforms.interpolate_poses(along[1], along[2], shares)
    return transforms.interpolate_poses(first, second, shares)


def beyond_rounding(poses: FloatArray, path: ControllerPath, arm: Arm, point: FloatArray) -> FloatArray:
    """Return how far a point of the tool at poses is beyond the rounding about every row of its path [mm].

    What is checked for collisions is the rounding about all rows together; where a point turns back, another row than
    the nearest one may be the one that holds it.
    """
    here = arm.tool_poses(path.joints)
    rows = (here @ point)[:, :3]
    allowed = np.linalg.norm(((arm.tool_poses(path.joints + path.rounding) - here) @ point)[:, :3], axis=1)
    distances = np.linalg.norm((poses @ point)[:, None, :3] - rows, axis=2)
    return (distances - allowed).min(axis=1)


def test_middle_of_a_right_angle_is_an_eighth_of_the_diagonal_away():
    targets = np.tile(np.eye(4), (3, 1, 1))
    targets[:, :2, 3] = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0]]

    middles = triangle_middles(targets, np.array([0.0, 0.8, 0.0]))

    np.testing.assert_allclose(middles[1, :3, 3], [4.0 - 0.2, 0.2, 0.0])
    np.testing.assert_allclose(middles[[0, 2]], targets[[0, 2]])


def test_zone_larger_than_half_the_distance_is_taken_as_half_of_it():
    targets = np.tile(np.eye(4), (3, 1, 1))
    targets[:, :2, 3] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]

    wide, half = (triangle_middles(targets, np.array([0.0, zone, 0.0])) for zone in (9.0, 0.5))

    np.testing.assert_allclose(wide, half)


@settings(max_examples=25, deadline=None)
@example(turn=0.0, lean=0.0322, zone=0.25, height=124.0)
@given(turn=st.floats(-2.6, 2.6), lean=st.floats(-0.2, 0.2), zone=st.floats(0.01, ZONE), height=st.floats(0.0, 150.0))
def test_every_parabola_stays_within_the_rounding_of_the_rows(turn: float, lean: float, zone: float, height: float):
    path, targets = corner(turn, lean=lean)
    coarse = controller_path(path, targets, ARM)
    rows = refined(coarse, parts=np.where(coarse.runs[:-1] >= 0, 50, 1))
    on_lines = ControllerPath(
        joints=rows.joints[rows.runs >= 0],
        runs=rows.runs[rows.runs >= 0],
        deposit=rows.deposit[rows.runs >= 0],
        rounding=rows.rounding[rows.runs >= 0],
        step=rows.step,
    )

    beyond = beyond_rounding(blended(path, zone=zone), on_lines, ARM, np.array([0.0, 0.0, -height, 1.0]))

    # Rows are 0.01 mm apart at the tip, five times as much at the other end of the leaning tool.
    assert beyond.max() <= 0.03


def test_corner_itself_is_within_the_rounding_and_straight_on_there_is_none():
    path, targets = corner(1.0)
    bent = controller_path(path, targets, ARM)
    straight = controller_path(*corner(0.0), ARM)

    assert np.abs(straight.rounding).max() < 1e-9
    at = int(np.abs(bent.rounding).max(axis=1).argmax())
    np.testing.assert_allclose(bent.joints[at] + bent.rounding[at], path.joints[1], atol=1e-9)
    tip = ARM.tool_poses(np.stack([bent.joints[at], path.joints[1]]))[:, :3, 3]
    assert np.linalg.norm(tip[1] - tip[0]) == pytest.approx(ZONE * np.sin(0.5) / 2, rel=1e-6)


def beside_a_post(gap: float) -> Clearance:
    """Check a needle that passes a post at a distance, where its path bends 0.15 mm to it and may be off as much."""
    corners = pointing_down(LINE)
    poses = corners.copy()
    poses[20, 0, 3] += 0.15
    edge = 20.0 + CELL.tool.needle_diameter / 2 + gap
    post = block((edge, 14.95, 5.0), (edge + 1.0, 15.05, 20.0), name="post")
    return check(placements_of(poses, corners), body=post)


def test_post_that_only_the_rounded_corner_comes_near_is_refused_and_one_beyond_is_not():
    with pytest.raises(ClearanceError, match="needle comes within"):
        beside_a_post(CELL.process.clearance + 0.28)

    found = beside_a_post(CELL.process.clearance + 0.3 + 0.1)

    assert found.checked[-1] == "tool where the controller rounds targets, at most 0.151 mm off its way"


def test_room_under_the_rim_shrinks_by_what_a_corner_may_be_lower():
    corners = pointing_down(LINE)
    poses = corners.copy()
    poses[20, 2, 3] -= 0.04

    found = check(placements_of(poses, corners))

    assert found.tip_margin == pytest.approx(0.3 - 0.04 - 0.04 * ARC_ALLOWANCE, abs=1e-9)


def over_a_bump(higher: float) -> Clearance:
    """Check a tip that travels just over a bump, and is there higher than the corner that it rounds."""
    depositing = np.arange(len(LINE)) < 3
    corners = pointing_down(np.where(depositing[:, None], LINE, LINE + np.array([0.0, 0.0, 0.7])))
    poses = corners.copy()
    poses[30, 2, 3] += higher
    return check(
        placements_of(poses, corners, deposit=depositing),
        body=block((19.0, 19.0, 0.0), (21.0, 21.0, 0.98), name="bump"),
    )


def test_tip_that_may_be_lower_in_a_corner_of_travel_must_not_touch_there_either():
    assert over_a_bump(0.0).smallest > CELL.process.clearance
    with pytest.raises(ClearanceError, match="the needle's tip reaches"):
        over_a_bump(0.05)


@pytest.mark.parametrize(
    ("place", "distance"),
    [((5.0, 3.0, 0.0), 3.0), ((13.0, 14.0, 0.0), 5.0), ((-3.0, 0.0, 4.0), 5.0), ((12.0, 4.0, 0.0), 2.0)],
)
def test_a_place_beyond_the_end_of_a_line_is_as_far_from_it_as_from_that_end(
    place: tuple[float, float, float], distance: float
) -> None:
    # From (0, 0, 0) to (10, 0, 0), where it stands for a moment, and on to (10, 10, 0).
    line = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0]])
    assert _distance(np.array(place), line) == pytest.approx(distance)


# What is listed of bends: known answers of hand-made targets, one by one.


TIMES = np.array([0.0, 1.0, 1.9, 3.1, 4.0, 5.2])


def listed(
    poses: PoseStream, *, times: FloatArray = TIMES, offsets: tuple[float, ...] = (0.0,) * 6, shortest: float = 0.1
) -> tuple[Bend, ...]:
    """Return the bends where all poses are targets that stand so far above the path [mm]."""
    places = poses.tips + np.array(offsets)[:, None] * [0.0, 0.0, 1.0]
    return bends_of(poses, np.arange(poses.count), times, places=places, shortest=shortest)


def circle() -> PoseStream:
    return stream(arc(radius=7.0, step=0.7, angle=0.5))


def test_a_bend_stands_at_its_largest_offset_with_the_moves_to_either_side() -> None:
    poses = circle()
    (bend,) = listed(poses, offsets=(0.0, 0.1, 0.2, 0.5, 0.0, 0.0))
    assert (bend.kind, bend.run, bend.targets) == ("rounded", 0, 3)
    assert bend.offset == pytest.approx(0.5)
    assert bend.place == pytest.approx(tuple(poses.tips[3]))
    assert bend.arc == pytest.approx(poses.arcs[3])
    assert bend.radius == pytest.approx(7.0)
    # Moves from target 0 to 4: of 1.0, 0.9, 1.2 and 0.9 s.
    assert bend.shortest == pytest.approx(0.9)


@pytest.mark.parametrize(("times", "shortest"), [
    ((0.0, 0.3, 1.0, 2.0, 3.0, 4.0), 0.7), ((0.0, 1.0, 1.2, 2.2, 3.2, 4.2), 0.2),
    ((0.0, 1.0, 2.0, 2.3, 3.3, 4.3), 0.3), ((0.0, 1.0, 2.0, 3.0, 3.4, 4.4), 1.0),
])  # fmt: skip
def test_the_shortest_move_of_a_bend_is_one_that_ends_or_begins_in_it(
    times: tuple[float, ...], shortest: float
) -> None:
    (bend,) = listed(circle(), times=np.array(times), offsets=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
    assert bend.shortest == pytest.approx(shortest)


def test_bends_at_both_ends_have_the_moves_that_are_there() -> None:
    first, last = listed(circle(), offsets=(0.1, 0.0, 0.0, 0.0, 0.0, 0.3))
    assert (first.shortest, last.shortest) == (pytest.approx(1.0), pytest.approx(1.2))
    assert (first.offset, last.offset) == (pytest.approx(0.1), pytest.approx(0.3))
    # At an end there are no three places for a circle.
    assert (first.radius, last.radius) == (np.inf, np.inf)


def test_a_stretch_of_close_targets_is_told_at_its_middle() -> None:
    poses = circle()
    (bend,) = listed(poses, times=np.array([0.0, 0.2, 0.28, 0.36, 0.43, 0.7]))
    assert (bend.kind, bend.targets, bend.offset) == ("close", 3, 0.0)
    assert bend.place == pytest.approx(tuple(poses.tips[2]))
    assert bend.shortest == pytest.approx(0.07)


@pytest.mark.parametrize(("duration", "count"), [(0.0999, 1), (0.1, 0), (0.1 * (1.0 - 1e-11), 0), (0.1001, 0)])
def test_a_move_of_just_the_time_it_needs_is_not_close(duration: float, count: int) -> None:
    assert len(listed(circle(), times=np.array([0.0, 1.0, 1.0 + duration, 2.2, 3.2, 4.2]))) == count


def test_moves_that_lay_nothing_are_not_close() -> None:
    poses = stream(arc(radius=7.0, step=0.7, angle=0.5), deposit=np.zeros(6, dtype=np.bool_))
    assert listed(poses, times=0.01 * np.arange(6.0)) == ()


def test_bends_of_two_runs_are_two_and_stand_in_the_order_of_the_path() -> None:
    poses = stream(arc(radius=7.0, step=0.7, angle=0.5), runs=np.array([0, 0, 0, 1, 1, 1]))
    bends = listed(poses, offsets=(0.0, 0.1, 0.1, 0.2, 0.2, 0.0), times=np.array([0.0, 0.05, 1.0, 2.0, 3.0, 3.05]))
    assert [(bend.run, bend.kind, bend.targets) for bend in bends] == [
        (0, "close", 1), (0, "rounded", 2), (1, "rounded", 2), (1, "close", 1),
    ]  # fmt: skip


def test_a_straight_line_has_no_radius() -> None:
    poses = stream(np.linspace([0.0, 0.0, 0.0], [5.0, 0.0, 0.0], 6))
    (bend,) = listed(poses, offsets=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
    assert bend.radius == np.inf
