"""What is listed of bends: known answers of hand-made targets, one by one."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.model import Bend, FloatArray, PoseStream
from geoprint.robot.controller.targets import bends_of
from tests.robot.joint_paths import arc, stream

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
