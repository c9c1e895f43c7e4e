"""Written targets: what must be kept is kept, the rest stays within tolerance, zones and speeds are safe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation, Slerp

from geoprint.errors import ReachError, UsageError
from geoprint.geometry import PolylineDistance
from geoprint.model import FloatArray, IntArray, JointPath, PoseStream, Targets, Trajectory
from geoprint.robot.controller import controller_path, lifted_path, written_path
from geoprint.robot.controller.choice import FINE_SHARE
from geoprint.robot.controller.fitting import LARGEST_ZONE
from geoprint.robot.controller.targets import (
    ANGLE_TOLERANCE,
    SHORTEST_MOVE,
    SMALLEST_SPEED,
    SMALLEST_TURN,
    close_targets,
    required_poses,
    written_targets,
)
from geoprint.transforms import same_sign
from tests.robot.cells import bent_cell
from tests.robot.joint_paths import DOWN, arc, arm_of, line, solved, stream, tilted, two_runs

PROCESS = bent_cell().process
TOLERANCE = 0.01


def unsolved(poses: PoseStream) -> JointPath:
    """Return a joint path whose joints play no part."""
    return JointPath(
        poses=poses, joints=np.zeros((poses.count, 6)),
        branch=0, rotations=np.zeros(poses.count), leans=np.zeros((poses.count, 2)), T_base_work=np.eye(4),
    )  # fmt: skip


def passing(poses: PoseStream, *, share: float = 1.0, still: float = 0.0) -> Trajectory:
    """Return a trajectory that passes the poses at a share of the set speeds; turns on the spot take `still` [s]."""
    lengths = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)
    speeds = share * np.where(poses.deposited, PROCESS.speed, PROCESS.travel_speed)
    return Trajectory(
        times=np.zeros(1), joints=np.zeros((1, 6)), runs=np.zeros(1, dtype=np.int64), deposit=np.zeros(1, np.bool_),
        pose_times=np.append([0.0], np.cumsum(np.where(lengths > 0.0, lengths / speeds, still))), stretched=0,
        slowest_deposit=0.0, slowdowns=(), share_at_speed=0.0, share_on_ramps=0.0,
    )  # fmt: skip


def thinned(
    poses: PoseStream, *, tolerance: float = TOLERANCE, period: float = 0.025, share: float = 1.0, still: float = 0.0
) -> Targets:
    return written_targets(
        unsolved(poses), passing(poses, share=share, still=still), process=PROCESS, tolerance=tolerance, period=period
    )


def deviations(poses: PoseStream, chosen: IntArray) -> tuple[float, float]:
    """Return how far the poses are from the written path [mm, rad]; turns on the spot are sampled densely."""
    distance = angle = 0.0
    for first, last in zip(chosen[:-1].tolist(), chosen[1:].tolist(), strict=True):
        line = poses.tips[last] - poses.tips[first]
        ends = Rotation.from_quat(poses.quaternions[[first, last]], scalar_first=True)
        for pose in range(first + 1, last):
            offset = poses.tips[pose] - poses.tips[first]
            shares = (
                np.clip(offset @ line / (line @ line), 0.0, 1.0)[None] if line.any() else np.linspace(0.0, 1.0, 2001)
            )
            own = Rotation.from_quat(poses.quaternions[pose], scalar_first=True)
            angles = np.asarray((Slerp([0.0, 1.0], ends)(shares) * own.inv()).magnitude())
            nearest = int(angles.argmin())
            distance = max(distance, float(np.linalg.norm(offset - shares[nearest] * line)))
            angle = max(angle, float(angles[nearest]))
    return distance, angle


def places_of(poses: PoseStream, found: Targets) -> FloatArray:
    """Return where the targets are written."""
    places = poses.tips[found.poses].copy()
    places[found.moved] = found.places
    return places


def driven(places: FloatArray, zones: FloatArray, *, samples: int = 40) -> FloatArray:
    """Return places along what a controller drives: lines, and in each zone the parabola from its entry to its exit."""
    steps = np.diff(places, axis=0)
    along = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    share = np.linspace(0.0, 1.0, samples)[:, None]
    parts = [places[:1]]
    for row in range(1, len(places) - 1):
        entry, leaving = places[row] - zones[row] * along[row - 1], places[row] + zones[row] * along[row]
        parts.append((1 - share) ** 2 * entry + 2 * share * (1 - share) * places[row] + share**2 * leaving)
    return np.vstack([*parts, places[-1:]])


def written_deviation(poses: PoseStream, found: Targets) -> float:
    """Return how far the poses are from the written path: rounded beside moved targets, else by straight moves [mm]."""
    near = np.isin(np.arange(found.poses.size), found.moved)
    near = near[1:] | near[:-1]
    first, last = found.poses[:-1][near], found.poses[1:][near]
    every = np.arange(poses.count)
    rounded = ((every[:, None] >= first) & (every[:, None] <= last)).any(axis=1)
    off = PolylineDistance([driven(places_of(poses, found), found.zones)], step=0.2)(poses.tips[rounded])
    pairs = zip(found.poses[:-1].tolist(), found.poses[1:].tolist(), near.tolist(), strict=True)
    straight = [deviations(poses, np.array([a, b]))[0] for a, b, one in pairs if not one]
    return max([0.0, *straight, *off.tolist()])


def wavy(seed: int, *, count: int = 60) -> PoseStream:
    """Return a smooth curve in space with a smoothly leaning tool and stops at random places."""
    random = np.random.default_rng(seed)
    phase = np.linspace(0.0, 1.5, count)[:, None]
    tips = 10.0 * np.hstack([phase, 0.3 * np.sin(random.uniform(1.0, 5.0, 2) * phase + random.uniform(0.0, 6.0, 2))])
    lean = random.uniform(0.0, 0.3) * np.sin(random.uniform(0.5, 4.0) * phase[:, 0])
    stops = tuple(random.choice(np.arange(1, count - 1), size=3, replace=False).tolist())
    return stream(tips, quaternions=tilted(lean), stops=stops)


def test_a_straight_line_is_written_with_its_ends_alone() -> None:
    found = thinned(stream(line((0.0, 0.0, 0.0), (50.0, 20.0, 5.0), count=137)))
    np.testing.assert_array_equal(found.poses, [0, 136])
    np.testing.assert_array_equal(found.zones, [0.0, 0.0])
    np.testing.assert_allclose(found.speeds, [PROCESS.travel_speed, PROCESS.speed])


def test_a_steady_turn_along_a_line_is_written_with_its_ends_alone() -> None:
    tips = line((0.0, 0.0, 0.0), (50.0, 0.0, 0.0), count=101)
    np.testing.assert_array_equal(thinned(stream(tips, quaternions=tilted(np.linspace(0.0, 1.2, 101)))).poses, [0, 100])
    np.testing.assert_array_equal(
        thinned(stream(0.0 * tips, quaternions=tilted(np.linspace(0.0, 1.2, 101))), still=0.01).poses, [0, 100]
    )


def test_the_sign_of_quaternions_does_not_matter() -> None:
    poses = wavy(3)
    flipped = replace(
        poses, quaternions=poses.quaternions * np.where(np.arange(poses.count) % 3 == 0, -1.0, 1.0)[:, None]
    )
    np.testing.assert_array_equal(thinned(flipped).poses, thinned(poses).poses)
    aligned = same_sign(flipped.quaternions)
    assert (np.sum(aligned[1:] * aligned[:-1], axis=1) > 0.0).all()


def test_a_turn_of_more_than_a_right_angle_is_cut() -> None:
    tips = line((0.0, 0.0, 0.0), (50.0, 0.0, 0.0), count=101)
    found = thinned(stream(tips, quaternions=tilted(np.linspace(0.0, 2.0 * np.pi, 101), axis="z")))
    assert np.diff(found.poses).max() <= 25
    assert (found.poses.size, found.poses[-1]) == (6, 100)


def test_a_wobble_of_the_tool_alone_keeps_targets() -> None:
    tips = line((0.0, 0.0, 0.0), (50.0, 0.0, 0.0), count=101)
    wobble = stream(tips, quaternions=tilted(np.radians(5.0) * np.sin(np.linspace(0.0, 12.0, 101))))
    found = thinned(wobble)
    assert found.poses.size > 10
    assert deviations(wobble, found.poses)[1] <= ANGLE_TOLERANCE


@pytest.mark.parametrize(("angle_deg", "kept"), [(0.095, False), (0.105, True)])
def test_a_pose_that_leans_by_less_than_a_tenth_of_a_degree_is_left_out_where_moves_are_short(
    angle_deg: float, *, kept: bool
) -> None:
    """The whole line takes 2.5 s, so that no move of it should be cut."""
    angles = np.zeros(101)
    angles[50] = np.radians(angle_deg)
    poses = stream(line((0.0, 0.0, 0.0), (50.0, 0.0, 0.0), count=101), quaternions=tilted(angles))
    assert (thinned(poses, period=3.0).poses.size > 4) == kept


def test_stops_and_the_ends_of_deposit_are_targets_where_the_tool_rests() -> None:
    poses = two_runs()
    found = thinned(poses)
    deposited = np.concatenate([[False], poses.deposited, [False]])
    required = np.flatnonzero(poses.stops | (deposited[1:] != deposited[:-1]))
    assert np.isin(required, found.poses).all()
    assert (found.zones[np.isin(found.poses, required)] == 0.0).all()
    assert (found.zones[~np.isin(found.poses, required)] > 0.0).all()


def split_run(*, apart: float = 0.0, turn: float = 0.0) -> PoseStream:
    """Two half circles with a lift where the first ends and the second begins, so far apart [mm] and turned [rad]."""
    first, second = arc(angle=np.pi), -arc(angle=np.pi)
    up, aside = np.array([[0.0, 0.0, 5.0]]), np.array([[0.0, apart, 0.0]])
    parts = [first[:1] + up, first, first[-1:] + up, second[:1] + up + aside, second, second[-1:] + up]
    sizes = [len(each) for each in parts]
    ends = np.cumsum(sizes)
    tips = np.vstack(parts)
    return stream(
        tips,
        deposit=np.repeat([False, True, False, False, True, False], sizes),
        runs=np.repeat([0, 0, 0, 1, 1, 1], sizes),
        stops=tuple(sorted({0, *(ends - 1).tolist(), *ends[:-1].tolist()})),
        quaternions=tilted(np.where(np.arange(len(tips)) < ends[2], 0.0, turn), axis="z"),
    )


def test_no_move_goes_nowhere_where_a_run_begins_in_the_place_where_the_one_before_ends() -> None:
    poses = split_run()
    assert (np.linalg.norm(np.diff(poses.tips, axis=0), axis=1) < 1e-12).sum() == 1
    found = thinned(poses)
    assert np.linalg.norm(np.diff(poses.tips[found.poses], axis=0), axis=1).min() >= SHORTEST_MOVE
    # The place belongs to the run that begins, so that whoever resumes there begins above the part.
    first = int(np.flatnonzero(np.diff(poses.runs[found.poses]))[0]) + 1
    assert poses.tips[found.poses[first], 2] == 5.0
    assert poses.deposited[found.poses[first - 2 : first]].tolist() == [True, False]
    np.testing.assert_array_equal(found.zones[first - 1 : first + 1], 0.0)
    lifted_path(solved(poses, arm_of(bent_cell())), found, arm_of(bent_cell()))


@pytest.mark.parametrize(("apart", "turn"), [(0.5 * SHORTEST_MOVE, 0.0), (0.0, 0.5 * SMALLEST_TURN)])
def test_what_is_nearer_than_any_arm_repeats_is_the_same_place(apart: float, turn: float) -> None:
    poses = split_run(apart=apart, turn=turn)
    assert thinned(poses).poses.size == thinned(split_run()).poses.size


@pytest.mark.parametrize(("apart", "turn"), [(1.1 * SHORTEST_MOVE, 0.0), (0.0, 1.1 * SMALLEST_TURN)])
def test_a_short_travel_and_a_turn_on_the_spot_are_written(apart: float, turn: float) -> None:
    poses = split_run(apart=apart, turn=turn)
    assert thinned(poses, still=0.1).poses.size == thinned(split_run()).poses.size + 1


def test_a_switch_of_the_deposit_is_a_target_and_what_leads_to_it_has_the_speed_of_the_print() -> None:
    deposit = np.arange(41) >= 17
    found = thinned(stream(line((0.0, 0.0, 0.0), (20.0, 0.0, 0.0), count=41), deposit=deposit))
    np.testing.assert_array_equal(found.poses, [0, 17, 40])
    np.testing.assert_array_equal(found.zones, [0.0, LARGEST_ZONE, 0.0])
    np.testing.assert_allclose(found.speeds, [PROCESS.travel_speed, PROCESS.speed, PROCESS.speed])


def test_a_run_begins_at_rest_even_where_the_stream_has_no_stop() -> None:
    poses = replace(two_runs(), stops=np.zeros(two_runs().count, dtype=np.bool_))
    found = thinned(poses)
    first = int(np.flatnonzero(np.diff(poses.runs[found.poses]))[0]) + 1
    assert not np.isin(found.poses[first], np.flatnonzero(np.diff(poses.deposited.astype(int))) + 1)
    assert found.zones[first] == 0.0


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([0.003, 0.01, 0.05]), st.sampled_from([0.025, 0.1]))
def test_all_poses_stay_within_tolerance_and_zones_within_half_the_distance(
    seed: int, tolerance: float, period: float
) -> None:
    poses = wavy(seed)
    found = thinned(poses, tolerance=tolerance, period=period)
    assert written_deviation(poses, found) <= tolerance * 1.01
    assert deviations(poses, found.poses)[1] <= ANGLE_TOLERANCE * 1.001
    assert (np.diff(found.poses) > 0).all()
    gaps = np.linalg.norm(np.diff(places_of(poses, found), axis=0), axis=1)
    assert (found.zones[1:-1] <= 0.5 * np.minimum(gaps[1:], gaps[:-1]) + 1e-12).all()
    assert found.zones.max() <= LARGEST_ZONE


def test_the_dense_check_sees_a_target_that_is_left_out() -> None:
    poses = stream(arc(radius=10.0))
    found = thinned(poses, period=0.01)
    assert deviations(poses, found.poses)[0] <= TOLERANCE
    assert deviations(poses, np.delete(found.poses, slice(4, 6)))[0] > TOLERANCE
    bent = stream(arc(radius=0.5, step=0.02, angle=np.pi))
    found = thinned(bent)
    assert found.moved.size > 2
    assert written_deviation(bent, found) <= 1.01 * TOLERANCE
    unmoved = replace(found, places=bent.tips[found.poses[found.moved]])
    assert written_deviation(bent, unmoved) > TOLERANCE


def test_targets_come_no_sooner_than_the_period_where_the_tolerance_allows() -> None:
    poses = stream(arc(radius=3.0, step=0.05, angle=np.pi))
    times = passing(poses).pose_times
    gaps = np.diff(times[thinned(poses, tolerance=0.03).poses])
    assert gaps.min() >= 1.0 / 40.0 - 1e-9


@pytest.mark.parametrize("angle", [1.0, np.pi / 2.0, 2.0])
def test_a_bend_of_a_fifth_of_a_millimetre_is_driven_at_20_mm_a_second(angle: float) -> None:
    # Chords of 12 ms would leave this arc by 0.04 mm: v t = 0.24 mm, (v t)^2 / (8 R).
    bent = arc(radius=0.18, step=0.02, angle=angle)
    into, out = bent[1] - bent[0], bent[-1] - bent[-2]
    legs = [leg / np.linalg.norm(leg) * np.linspace(0.05, 5.0, 100)[:, None] for leg in (into, out)]
    poses = stream(np.vstack([bent[0] - legs[0][::-1], bent, bent[-1] + legs[1]]))
    found = thinned(poses, period=0.02)
    assert np.diff(passing(poses).pose_times[found.poses]).min() >= 0.012 - 1e-9
    assert written_deviation(poses, found) <= 1.01 * TOLERANCE
    (bend,) = found.bends
    assert (bend.run, bend.kind, bend.targets) == (0, "rounded", found.moved.size)
    assert bend.shortest >= 0.012 - 1e-9
    assert 0.01 < bend.offset < 0.2
    assert 4.9 < bend.arc < 5.2 + 0.18 * angle


@pytest.mark.parametrize("radius", [0.43, 0.45, 0.47, 0.5, 0.6])
def test_a_ring_hardly_wider_than_its_bead_is_driven_at_20_mm_a_second(radius: float) -> None:
    # From rest to rest, where corners are not rounded; chords of 12 ms would leave it by up to 0.017 mm.
    poses = stream(arc(radius=radius, step=0.026, angle=2.0 * np.pi))
    found = thinned(poses, period=0.02)
    assert np.diff(passing(poses).pose_times[found.poses]).min() >= 0.012 - 1e-9
    assert written_deviation(poses, found) <= 1.01 * TOLERANCE
    assert all(bend.kind == "rounded" for bend in found.bends)


def test_no_move_is_a_leftover_before_a_stop() -> None:
    # Greedily, moves of seven steps would leave one of a single step, 5 ms, before the stop.
    poses = stream(arc(radius=4.0, step=0.1, angle=2.0), stops=(22,))
    times = passing(poses).pose_times
    assert np.diff(times[thinned(poses, period=0.012).poses]).min() >= 0.012 - 1e-9


@pytest.mark.parametrize("seed", range(15))
def test_random_bends_keep_time_and_tolerance_or_are_listed(seed: int) -> None:
    random = np.random.default_rng(seed)
    headings = np.cumsum(np.repeat(random.uniform(-1.2, 1.2, 12), 12) / 12.0)
    steps = np.repeat(random.uniform(0.02, 0.3, 12), 12)
    tips = np.cumsum(steps[:, None] * np.column_stack([np.cos(headings), np.sin(headings), 0.0 * headings]), axis=0)
    poses = stream(tips, stops=(0, 71, 143))
    found = thinned(poses, period=0.02)
    assert np.isin([0, 71, 143], found.poses).all()
    assert written_deviation(poses, found) <= 1.01 * TOLERANCE
    moves = np.diff(passing(poses).pose_times[found.poses])
    listed = sum(bend.targets for bend in found.bends if bend.kind == "close")
    assert (moves < 0.012 - 1e-9).sum() == listed
    offsets = np.linalg.norm(found.places - poses.tips[found.poses[found.moved]], axis=1)
    assert (
        sum(bend.targets for bend in found.bends if bend.kind == "rounded") == found.moved.size == (offsets > 0).sum()
    )
    assert (found.zones[np.isin(found.poses, [0, 71, 143])] == 0.0).all()


def test_targets_that_come_too_soon_are_counted_and_the_soonest_is_told() -> None:
    poses = stream(line((0.0, 0.0, 0.0), (8.0, 0.0, 0.0), count=5))
    found = Targets(poses=np.array([0, 1, 2, 4]), zones=np.zeros(4), speeds=np.full(4, 20.0))
    trajectory = passing(poses)

    assert close_targets(found, trajectory, period=0.05) == (0, pytest.approx(0.1))
    assert close_targets(found, trajectory, period=0.1) == (0, pytest.approx(0.1))
    assert close_targets(found, trajectory, period=0.15) == (2, pytest.approx(0.1))
    assert close_targets(found, trajectory, period=0.3)[0] == 3


@pytest.mark.parametrize("radius", [2.0, 3.0, 5.0])
def test_what_rounding_takes_from_a_time_changes_no_target(radius: float) -> None:
    # Every fifth pose comes exactly a period after another, or less than a millionth of it sooner or later.
    poses = stream(arc(radius=radius, step=0.1, angle=20.0 / radius))
    period = 5.0 * float(np.linalg.norm(poses.tips[1] - poses.tips[0])) / PROCESS.speed
    exact, later, sooner = (thinned(poses, period=period, share=share).poses for share in (1.0, 1.0 - 1e-6, 1.0 + 1e-6))
    np.testing.assert_array_equal(later, exact)
    np.testing.assert_array_equal(sooner, exact)


def test_a_short_period_is_used_to_follow_the_path_closer() -> None:
    poses = stream(arc(radius=10.0, step=0.1, angle=np.pi))
    usual, fast = thinned(poses, period=0.025), thinned(poses, period=0.001)
    assert deviations(poses, fast.poses)[0] <= FINE_SHARE * TOLERANCE
    assert deviations(poses, usual.poses)[0] > FINE_SHARE * TOLERANCE
    assert usual.poses.size < fast.poses.size


def test_speeds_follow_the_trajectory_where_it_is_slower() -> None:
    poses = stream(arc())
    np.testing.assert_allclose(thinned(poses).speeds[1:], PROCESS.speed)
    np.testing.assert_allclose(thinned(poses, share=0.4).speeds[1:], 8.0)
    np.testing.assert_allclose(thinned(poses, share=2.0).speeds[1:], PROCESS.speed)
    np.testing.assert_allclose(thinned(poses, share=1e-3).speeds[1:], SMALLEST_SPEED)


@pytest.mark.parametrize(("side", "tip_speed"), [(1.0, 21.2), (-1.0, 18.8)])
def test_the_bead_keeps_the_set_speed_so_that_targets_over_a_bulge_are_faster_and_in_a_hollow_slower(
    side: float, tip_speed: float
) -> None:
    """Circles of 5 mm on the surface are 5.3 and 4.7 mm for the tip 0.3 mm above it; rounded moves are shorter."""
    radius = 5.0 + 0.3 * side
    tips = arc(radius=radius, step=0.1)
    poses = replace(stream(tips), normals=side * tips / radius)
    np.testing.assert_allclose(thinned(poses, share=tip_speed / 20.0).speeds[1:], tip_speed, rtol=3e-3)
    np.testing.assert_allclose(thinned(poses, share=2.0).speeds[1:], tip_speed, rtol=1e-6)
    np.testing.assert_allclose(thinned(poses, share=0.4).speeds[1:], 8.0, rtol=3e-3)


def test_a_turn_on_the_spot_keeps_the_set_speed_and_is_not_rounded() -> None:
    wobble = np.radians(5.0) * np.sin(np.linspace(0.0, 12.0, 40))
    found = thinned(stream(np.zeros((40, 3)), quaternions=tilted(wobble)), still=0.02)
    assert found.poses.size > 4
    np.testing.assert_allclose(found.speeds[1:], PROCESS.speed)
    np.testing.assert_array_equal(found.zones, 0.0)


def test_a_single_pose_is_its_only_target() -> None:
    found = thinned(stream(np.zeros((1, 3)), quaternions=DOWN[None]))
    np.testing.assert_array_equal(found.poses, [0])
    np.testing.assert_array_equal(found.zones, [0.0])


@pytest.mark.parametrize(("tolerance", "period"), [(0.0, 0.02), (-1.0, 0.02), (0.01, 0.0), (float("nan"), 0.02)])
def test_a_tolerance_or_period_that_is_not_positive_is_refused(tolerance: float, period: float) -> None:
    with pytest.raises(UsageError, match="positive tolerance and period"):
        thinned(stream(arc(angle=0.5)), tolerance=tolerance, period=period)


def test_a_bend_that_only_one_pose_shows_is_kept() -> None:
    tips = line((0.0, 0.0, 0.0), (30.0, 0.0, 0.0), count=61)
    bumped: FloatArray = tips + np.where(np.arange(61) == 31, 0.02, 0.0)[:, None] * [0.0, 0.0, 1.0]
    assert 31 in thinned(stream(bumped)).poses


# Written targets out of reach, dry runs a turn away, and what is told of moves that follow each other closely.


ARM = arm_of(bent_cell())
SHORT = solved(stream(line((0.0, 0.0, 0.0), (0.8, 0.0, 0.0), count=3)), ARM)


def targets_of(count: int, **changes: object) -> Targets:
    return replace(Targets(poses=np.arange(count), zones=np.zeros(count), speeds=np.full(count, 20.0)), **changes)


def test_a_path_whose_targets_stand_on_it_is_written_as_it_is() -> None:
    assert written_path(SHORT, targets_of(3), ARM) is SHORT


@pytest.mark.parametrize("out", [0, 1, 2])
def test_a_target_beside_the_path_that_is_out_of_reach_is_refused_by_its_run_and_place(out: int) -> None:
    places = SHORT.poses.tips.copy()
    places[out] = [2000.0, 0.0, 0.0]
    with pytest.raises(ReachError, match=r"run 1: the target beside the path at \[2000\.0, 0\.0, 0\.0\] mm is out"):
        written_path(SHORT, targets_of(3, moved=np.arange(3), places=places), ARM)


def test_lines_shorter_than_a_step_have_a_row_at_each_target_and_none_between() -> None:
    along = controller_path(SHORT, targets_of(3), ARM, step=0.5)
    assert int((along.runs >= 0).sum()) == 3


def dry_targets(path: JointPath) -> Targets:
    kept = required_poses(path.poses)
    kept = np.union1d(kept, np.flatnonzero(np.diff(path.poses.runs)))
    return Targets(poses=kept, zones=np.zeros(kept.size), speeds=np.full(kept.size, 20.0))


@pytest.mark.parametrize("turn", [0.0, -2.0 * np.pi])
def test_a_dry_run_20_mm_higher_stays_on_the_turn_of_the_path(turn: float) -> None:
    path = solved(two_runs(), ARM)
    turned = path.joints.copy()
    turned[:, 5] += turn
    path = replace(path, joints=turned)
    lifted, _ = lifted_path(path, dry_targets(path), ARM)
    assert np.abs(lifted.joints[0] - path.joints[0]).max() < 0.3
    assert lifted.poses.tips[0, 2] - path.poses.tips[0, 2] == pytest.approx(20.0)


def test_targets_a_period_apart_are_not_close_although_times_are_rounded() -> None:
    for share, close in ((1.0, 0), (1.0 - 9e-5, 0), (1.0 - 2e-4, 2)):
        times = 0.05 * share * np.arange(3.0)
        made = Trajectory(
            times=np.array([0.0, 0.001]), joints=np.zeros((2, 6)), runs=np.zeros(2, dtype=np.int64),
            deposit=np.zeros(2, np.bool_), pose_times=times, stretched=0, slowest_deposit=0.0, slowdowns=(),
            share_at_speed=0.0, share_on_ramps=0.0,
        )  # fmt: skip
        count, least = close_targets(targets_of(3), made, period=0.05)
        assert count == close
        assert least == pytest.approx(0.05 * share)
