"""Where a part may stand, and where the arm prints it farthest from its limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.model import Box, FloatArray, PoseStream
from geoprint.robot.arm import Arm, about_nozzle
from geoprint.robot.placing import Candidate, FixturePose, Room, search_placement
from geoprint.robot.placing.placement_search import _Judge  # pyright: ignore[reportPrivateUsage]
from geoprint.robot.reach import reach, reach_margin, sample_poses
from geoprint.robot.reach.keyframes import LIMITING, Margin, angle_margins, smallest_margin
from tests.robot.cells import bent_cell
from tests.robot.placements import pointing_down

DOWN = np.diag([1.0, -1.0, -1.0])
TABLE = Box("table", np.array([300.0, 0.0, -10.0]), np.array([800.0, 1200.0, 20.0]))
SQUARE = np.array([[-20.0, -10.0, 0.0], [20.0, -10.0, 0.0], [20.0, 10.0, 5.0], [-20.0, 10.0, 5.0]])
UPRIGHT = np.zeros(3)


def arm() -> Arm:
    cell = bent_cell()
    return Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)


def line(length: float = 40.0, count: int = 21) -> PoseStream:
    """Poses along a level line through the fixture's origin, the nozzle straight down."""
    tips = np.column_stack([np.linspace(-length / 2.0, length / 2.0, count), np.zeros((count, 2))])
    return PoseStream(
        tips=tips,
        quaternions=transforms.quaternion_of(np.tile(DOWN, (count, 1, 1))),
        normals=np.tile([0.0, 0.0, 1.0], (count, 1)),
        runs=np.zeros(count, dtype=int),
        levels=np.zeros(count, dtype=int),
        layers=np.zeros(count, dtype=int),
        deposit=np.ones(count, dtype=bool),
        stops=np.zeros(count, dtype=bool),
        arcs=np.arange(count, dtype=float),
        flow=np.ones(count),
        standoff=0.3,
    )


def room(*, body: FloatArray | None = None, obstacles: tuple[Box, ...] = (TABLE,), ceiling: float = 400.0) -> Room:
    return Room(part=SQUARE, body=np.empty((0, 3)) if body is None else body, obstacles=obstacles, ceiling=ceiling)


def at(x: float, y: float, z: float, *, yaw_deg: float = 0.0) -> FixturePose:
    return FixturePose(np.array([x, y, z]), np.array([0.0, 0.0, np.radians(yaw_deg)]))


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Begin the climb from a grid of a few places, for what does not depend on how fine it is."""
    monkeypatch.setattr("geoprint.robot.placing.placement_search.GRID_STEP", 100.0)
    monkeypatch.setattr("geoprint.robot.placing.placement_search.GRID_YAWS", 4)


def test_margins_are_the_distances_to_what_is_refused() -> None:
    arm_ = arm()
    limits = np.degrees(arm_.robot.limits)
    joints = np.radians([[0.0, 100.0, 0.0, 0.0, 50.0, 0.0], [0.0, 0.0, 0.0, 0.0, -12.0, 0.0]])
    margins = np.degrees(angle_margins(joints, arm_, deposit=np.array([True, True])))
    assert margins.shape == (2, len(LIMITING))
    assert margins[0, 1] == pytest.approx(limits[1, 1] - 100.0)
    assert margins[0, 2] == pytest.approx(70.0)
    assert margins[1, 6] == pytest.approx(7.0)
    # The IRB 120's arm is stretched where joint 3 is at -77 degrees: arctan(302 / 70).
    assert margins[0, 7] == pytest.approx(np.degrees(np.arctan2(302.0, 70.0)), abs=1e-6)
    assert smallest_margin(joints, arm_, deposit=np.array([True, True])).limiting == "the wrist singularity"
    on_travel = smallest_margin(joints, arm_, deposit=np.array([False, False]))
    assert (on_travel.limiting, on_travel.pose) == ("joint 2", 0)
    joints[1] = np.nan
    assert smallest_margin(joints, arm_, deposit=np.array([True, True])) == Margin(-np.inf, "the arm's reach", 1)


@pytest.mark.parametrize(
    ("pose", "permitted"),
    [
        (at(300, 0, 0), True),
        (at(300, 0, -1), False),
        (at(300, 0, 394), True),
        (at(300, 0, 396), False),
        (at(171, 0, 50), True),
        (at(169, 0, 50), False),
        (at(161, 0, 50, yaw_deg=90), True),
        (at(-500, 0, -50), True),
    ],
)
def test_part_stands_above_what_is_below_it_and_beside_the_arm_and_below_home(
    pose: FixturePose, *, permitted: bool
) -> None:
    assert room().permits(pose) is permitted


def test_body_stands_on_the_table_too_but_may_rise_above_home() -> None:
    body = np.array([[0.0, 0.0, -60.0], [0.0, 0.0, 600.0]])
    assert not room(body=body).permits(at(300, 0, 59))
    assert room(body=body).permits(at(300, 0, 61))
    assert room(body=body).lowest(at(300, 0, 61)) == pytest.approx(1.0)
    assert room(obstacles=()).lowest(at(300, 0, 61)) == np.inf


@pytest.mark.usefixtures("coarse")
def test_line_is_placed_with_more_margin_than_before_and_is_reached_there() -> None:
    start, arm_, poses = at(430, 0, 5), arm(), line()
    before = reach_margin(poses, arm_, T_base_work=start.T_base_fixture)
    found = search_placement(poses, arm_, T_fixture_work=np.eye(4), start=start, room=room())
    best = found[0]
    assert list(found) == sorted(found, key=lambda candidate: -candidate.margin)
    assert all(room().permits(candidate.pose) for candidate in found)
    assert best.margin > before.angle + np.radians(5.0)
    path = reach(poses, arm_, T_base_work=best.pose.T_base_fixture)
    assert path.branch == best.branch
    np.testing.assert_array_equal(best.pose.rpy[:2], 0.0)


def test_margin_of_a_candidate_is_that_of_its_motion_over_all_poses() -> None:
    arm_, poses = arm(), line(count=161)
    best = search_placement(poses, arm_, T_fixture_work=np.eye(4), start=at(300, 0, 50), room=room(), height=50.0)[0]
    turn = transforms.rigid(
        np.array([[np.cos(best.spin), -np.sin(best.spin), 0], [np.sin(best.spin), np.cos(best.spin), 0], [0, 0, 1.0]]),
        np.zeros(3),
    )
    Ts = best.pose.T_base_fixture @ transforms.rigid(np.tile(DOWN, (161, 1, 1)), poses.tips) @ turn
    joints = arm_.solutions(Ts)[:, best.branch]
    assert best.margin == pytest.approx(smallest_margin(joints, arm_, deposit=poses.deposit).angle)


@pytest.mark.usefixtures("coarse")
def straight_ahead() -> tuple[_Judge, Candidate]:
    """A line over the border of axis 1 at 0 degrees, and its judge on all samples."""
    samples = sample_poses(line(), T_base_work=np.eye(4))
    judge = _Judge(samples, arm(), rows=np.arange(len(samples.deposit)))
    best = judge.best(at(350.0, 0.0, 60.0), spins=np.zeros(1), branches=[*range(8)])
    return judge, best


def axis_1(candidate: Candidate) -> FloatArray:
    nozzle = pointing_down(line().tips) @ about_nozzle(np.array([candidate.spin]))
    return np.degrees(arm().solutions(candidate.pose.T_base_fixture @ nozzle)[:, candidate.branch, 0])


def test_a_place_is_turned_about_axis_1_until_that_is_clear_of_the_border_ahead() -> None:
    judge, ahead = straight_ahead()
    # With the nozzle's bend aside, axis 1 stands elsewhere, and a line along the other axis crosses the border there.
    x, y = 350.0 * np.cos(np.radians(-12.0)), 350.0 * np.sin(np.radians(-12.0))
    yawed = judge.best(at(x, y, 60.0, yaw_deg=78.0), spins=np.zeros(1), branches=[*range(8)])
    for candidate in (ahead, yawed):
        aside = judge.clear_of_borders(candidate, room=room())
        before, after = axis_1(candidate), axis_1(aside)
        assert np.abs(before).min() < 5.0
        # As little as it takes, in one quadrant, and with it the part: nothing but axis 1 changes.
        assert np.abs(after).min() == pytest.approx(5.0, abs=1e-6)
        assert np.sign(after).min() == np.sign(after).max()
        np.testing.assert_allclose(after - before, (after - before)[0])
        assert np.degrees(aside.pose.rpy[2] - candidate.pose.rpy[2]) == pytest.approx((after - before)[0])
        assert aside.margin == pytest.approx(candidate.margin)
        assert np.hypot(*aside.pose.position[:2]) == pytest.approx(350.0)
        again = judge.clear_of_borders(aside, room=room())
        np.testing.assert_allclose(again.pose.position, aside.pose.position)


def test_a_place_stays_where_room_or_margin_allow_no_turn() -> None:
    judge, ahead = straight_ahead()
    walls = tuple(
        Box(f"wall {y:+g}", np.array([350.0, y, 500.0]), np.array([800.0, 40.0, 1000.0])) for y in (-40.0, 40.0)
    )
    assert room(obstacles=(TABLE, *walls)).permits(ahead.pose)
    assert judge.clear_of_borders(ahead, room=room(obstacles=(TABLE, *walls))) is ahead
    held = replace(ahead, margin=ahead.margin + 0.1)
    assert judge.clear_of_borders(held, room=room()) is held


def test_height_is_kept_and_tilt_is_bounded_where_they_are_given() -> None:
    found = search_placement(
        line(), arm(), T_fixture_work=np.eye(4), start=at(300, 0, 50), room=room(), height=20.0,
        tilt=np.radians(15.0),
    )  # fmt: skip
    for candidate in found:
        assert candidate.pose.position[2] == 20.0
        assert np.hypot(*candidate.pose.rpy[:2]) <= np.radians(15.0) + 1e-9


def test_part_that_fits_nowhere_and_empty_stream_are_refused() -> None:
    with pytest.raises(InputError, match="the arm cannot reach the part"):
        search_placement(
            line(), arm(), T_fixture_work=np.eye(4), start=at(300, 0, 50), room=room(ceiling=-10.0), height=0.0
        )
    nothing = line(count=1)
    empty = replace(
        nothing,
        **{
            name: getattr(nothing, name)[:0]
            for name in (
                "tips",
                "quaternions",
                "normals",
                "runs",
                "levels",
                "layers",
                "deposit",
                "stops",
                "arcs",
                "flow",
            )
        },
    )
    with pytest.raises(InputError, match="pose stream is empty"):
        search_placement(empty, arm(), T_fixture_work=np.eye(4), start=at(300, 0, 50), room=room())
