"""The hexapod: its published workspace, forward and inverse, and every limit against a plain loop."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from benchmarks.motion.tables import TRAVEL, reached
from geoprint import transforms
from geoprint.errors import InputError, ReachError, UsageError
from geoprint.model import FloatArray, Hexapod
from geoprint.positioner import SINGULAR_SHARE, HexapodMachine
from geoprint.positioner.hexapod import PAIRS, distances, jacobians, legs_at
from tests.positioner.tables import hexapod, hexapod_noun, random_directions, random_poses

# Of the default: roundings of legs of 200 mm, and of angles.
ROUNDING = 1e-9


def pose(shift: tuple[float, ...], turn: tuple[float, ...]) -> FloatArray:
    return transforms.rigid(Rotation.from_rotvec(turn).as_matrix(), np.array(shift))


@pytest.mark.parametrize("axis", TRAVEL)
def test_the_default_reaches_what_its_maker_publishes_within_2_percent(axis: str) -> None:
    low, high = reached(HexapodMachine(hexapod_noun()), axis)
    assert -low == pytest.approx(TRAVEL[axis], rel=0.02)
    assert high == pytest.approx(TRAVEL[axis], rel=0.02)


@settings(deadline=None, max_examples=50)
@given(st.tuples(*[st.floats(-40.0, 40.0)] * 3), st.tuples(*[st.floats(-0.4, 0.4)] * 3))
def test_the_legs_of_a_pose_lead_back_to_it(shift: tuple[float, ...], turn: tuple[float, ...]) -> None:
    machine = hexapod()
    T_table_plate = pose(shift, turn)
    found = machine.plate(machine.axes(T_table_plate[None])[0])
    np.testing.assert_allclose(found, T_table_plate, rtol=0.0, atol=ROUNDING)


def test_a_leg_is_as_long_as_its_joints_are_apart() -> None:
    noun, machine = hexapod_noun(), hexapod()
    for T_table_plate in random_poses(50, shift=40.0, turn=0.4):
        heads = [T_table_plate @ [*joint, 1.0] for joint in noun.plate_joints]
        wanted = [math.dist(head[:3], foot) for head, foot in zip(heads, noun.base_joints, strict=True)]
        np.testing.assert_allclose(machine.axes(T_table_plate[None])[0], wanted, rtol=1e-13)


def test_the_jacobian_is_what_differences_say() -> None:
    noun, step = hexapod_noun(), 1e-5
    for T_table_plate in random_poses(5, shift=40.0, turn=0.4):
        matrix = jacobians(legs_at(noun, T_table_plate[None]), scale=50.0)[0]
        for column in range(6):
            twist = np.zeros(6)
            twist[column] = step
            ends: list[FloatArray] = []
            for sign in (-1.0, 1.0):
                moved = T_table_plate.copy()
                moved[:3, 3] += sign * twist[:3]
                moved[:3, :3] = Rotation.from_rotvec(sign * twist[3:] / 50.0).as_matrix() @ moved[:3, :3]
                ends.append(legs_at(noun, moved[None]).lengths[0])
            np.testing.assert_allclose(matrix[:, column], (ends[1] - ends[0]) / (2.0 * step), atol=1e-8)


def test_two_legs_are_as_far_apart_as_a_search_along_both_finds() -> None:
    noun = hexapod_noun()
    poses = random_poses(4, shift=60.0, turn=1.2)
    legs = legs_at(noun, poses)
    found = distances(legs)
    for row in range(len(poses)):
        for column, (one, other) in enumerate(PAIRS):
            ends = legs.feet[one], legs.heads[row, one], legs.feet[other], legs.heads[row, other]

            def apart(at: FloatArray, ends: tuple[FloatArray, ...] = ends) -> float:
                first = ends[0] + at[0] * (ends[1] - ends[0])
                return float(np.sum((first - ends[2] - at[1] * (ends[3] - ends[2])) ** 2))

            best = minimize(apart, [0.5, 0.5], bounds=[(0.0, 1.0)] * 2, tol=1e-14).fun
            assert found[row, column] == pytest.approx(math.sqrt(best), abs=1e-3)
            assert found[row, column] <= math.sqrt(best) + 1e-6


@pytest.mark.parametrize(
    ("heads", "wanted"),
    [
        # Crossing, side by side, one behind the other, and past each other's ends.
        ([[10.0, 10.0, 0.0], [10.0, 0.0, 0.0]], 0.0),
        ([[0.0, 0.0, 10.0], [0.0, 10.0, 10.0]], 10.0),
        ([[0.0, 4.0, 0.0], [0.0, 20.0, 0.0]], 6.0),
        ([[-10.0, 0.0, 0.0], [10.0, 10.0, 0.0]], 10.0),
    ],
)
def test_the_distance_of_two_segments_is_right_where_they_cross_or_run_side_by_side(
    heads: list[list[float]], wanted: float
) -> None:
    noun = hexapod_noun()
    feet = np.array([[0.0, 0.0, 0.0], [0.0, 10.0, 0.0]])
    tops = np.array(heads)
    legs = legs_at(noun, np.eye(4)[None])
    along = legs.heads[0].copy()
    along[:2] = tops
    lower = legs.feet.copy()
    lower[:2] = feet
    lengths = np.linalg.norm(along - lower, axis=1)[None]
    found = distances(legs._replace(feet=lower, heads=along[None], lengths=lengths))
    assert found[0, 0] == pytest.approx(wanted, abs=1e-12)


def test_the_margins_of_a_thousand_poses_are_those_of_a_plain_loop() -> None:
    # Thick legs, and then nothing but them and the singularity, so that each limit is the nearest one somewhere.
    thick = hexapod_noun(leg_diameter_mm=40.0, plate_cone_deg=16.0)
    loose = hexapod_noun(leg_mm=[20.0, 900.0], base_cone_deg=89.9, plate_cone_deg=89.9, leg_diameter_mm=1.0)
    near, far = random_poses(600, shift=30.0, turn=0.25), random_poses(400, shift=60.0, turn=1.6, seed=1)
    nearest: Counter[str] = Counter()
    for noun, poses in ((thick, near), (thick, far), (loose, random_poses(200, shift=60.0, turn=1.2, seed=2))):
        rest = Loop(noun, np.eye(4))
        left = [Loop(noun, each).left(rest) for each in poses]
        wanted = [min(1.0, *each.values()) for each in left]
        np.testing.assert_allclose(HexapodMachine(noun).margins(poses), wanted, rtol=0.0, atol=1e-7)
        nearest.update(min(each, key=each.__getitem__) for each in left)
    assert min(nearest[name] for name in ("strokes", "base", "plate", "legs", "singular")) > 5, nearest


class Loop:
    """Every limit of a hexapod by the definition, a leg at a time."""

    def __init__(self, noun: Hexapod, T_table_plate: FloatArray) -> None:
        rotation, origin = T_table_plate[:3, :3].tolist(), T_table_plate[:3, 3].tolist()
        rotation, origin = _rows(T_table_plate[:3, :3]), _rows(T_table_plate[:3, 3:].T)[0]
        self.noun = noun
        self.arms = [[_dot(row, joint) for row in rotation] for joint in _rows(noun.plate_joints)]
        self.feet = _rows(noun.base_joints)
        self.heads = [[a + o for a, o in zip(arm, origin, strict=True)] for arm in self.arms]
        spans = [_minus(head, foot) for head, foot in zip(self.heads, self.feet, strict=True)]
        self.lengths = [math.hypot(*span) for span in spans]
        self.up = [[each / math.hypot(*span) for each in span] for span in spans]
        self.seen = [[_dot(column, up) for column in zip(*rotation, strict=True)] for up in self.up]
        self.firmness = self._firmness()
        self.apart = [self._apart(one, other) for one, other in combinations(range(6), 2)]

    def left(self, rest: Loop) -> dict[str, float]:
        noun = self.noun
        strokes = [
            (one - noun.lengths[0]) / (at - noun.lengths[0])
            if one < at
            else (noun.lengths[1] - one) / (noun.lengths[1] - at)
            for one, at in zip(self.lengths, rest.lengths, strict=True)
        ]
        thick = noun.leg_diameter
        return {
            "strokes": float(min(strokes)),
            "base": 1.0 - max(map(_angle, self.up, rest.up)) / noun.base_cone,
            "plate": 1.0 - max(map(_angle, self.seen, rest.seen)) / noun.plate_cone,
            "legs": min((one - thick) / (at - thick) for one, at in zip(self.apart, rest.apart, strict=True)),
            "singular": (self.firmness / rest.firmness - SINGULAR_SHARE) / (1.0 - SINGULAR_SHARE),
        }

    def _firmness(self) -> float:
        scale = sum(math.hypot(*joint[:2]) for joint in _rows(self.noun.plate_joints)) / 6
        arms = zip(self.arms, self.up, strict=True)
        rows = [[*up, *(each / scale for each in _cross(arm, up))] for arm, up in arms]
        return float(np.linalg.svd(np.array(rows), compute_uv=False)[-1])

    def _apart(self, one: int, other: int) -> float:
        """Return the least of the distances of the ends to the other leg, and of both lines where they pass within."""
        a, b, c, d = self.feet[one], self.heads[one], self.feet[other], self.heads[other]
        found = [_to_segment(a, c, d), _to_segment(b, c, d), _to_segment(c, a, b), _to_segment(d, a, b)]
        u, v, between = _minus(b, a), _minus(d, c), _minus(c, a)
        normal = _cross(u, v)
        size = math.hypot(*normal)
        if size > 1e-9:
            shares = [_dot(_cross(between, along), normal) / size**2 for along in (v, u)]
            if min(shares) >= 0.0 and max(shares) <= 1.0:
                found.append(abs(_dot(between, normal)) / size)
        return min(found)


def _rows(matrix: FloatArray) -> list[list[float]]:
    return [list(map(float, row)) for row in matrix]


def _minus(one: Sequence[float], other: Sequence[float]) -> list[float]:
    return [a - b for a, b in zip(one, other, strict=True)]


def _dot(one: Sequence[float], other: Sequence[float]) -> float:
    return sum(a * b for a, b in zip(one, other, strict=True))


def _cross(one: Sequence[float], other: Sequence[float]) -> list[float]:
    (a, b, c), (x, y, z) = one, other
    return [b * z - c * y, c * x - a * z, a * y - b * x]


def _to_segment(point: list[float], start: list[float], end: list[float]) -> float:
    along, away = _minus(end, start), _minus(point, start)
    share = min(1.0, max(0.0, _dot(along, away) / _dot(along, along)))
    return math.dist(away, [share * each for each in along])


def _angle(one: list[float], other: list[float]) -> float:
    return 2.0 * math.asin(min(1.0, math.dist(one, other) / 2.0))


def test_all_is_left_of_every_limit_at_rest() -> None:
    assert hexapod().margins(np.eye(4)[None])[0] == pytest.approx(1.0, abs=1e-12)


def test_no_pose_has_more_left_than_rest() -> None:
    assert hexapod().margins(random_poses(2000, shift=20.0, turn=0.3)).max() < 1.0


def test_no_poses_have_no_margins() -> None:
    assert hexapod().margins(np.empty((0, 4, 4))).shape == (0,)
    assert hexapod().plates(np.empty((0, 3))).shape == (0, 4, 4)


def test_the_plate_brings_each_direction_up_about_its_pivot_without_twist() -> None:
    machine = hexapod(pivot_mm=30.0)
    ups = random_directions(300)
    poses = machine.plates(ups)
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", poses[:, :3, :3], ups), np.tile([0.0, 0.0, 1.0], (300, 1)), atol=1e-12
    )
    np.testing.assert_allclose(poses @ [0.0, 0.0, 30.0, 1.0], np.tile([0.0, 0.0, 30.0, 1.0], (300, 1)), atol=1e-10)
    turns = Rotation.from_matrix(poses[:, :3, :3]).as_rotvec()
    # The least rotation turns by the angle to up, about a level axis.
    np.testing.assert_allclose(np.linalg.norm(turns, axis=1), np.arccos(ups[:, 2]), atol=1e-7)
    np.testing.assert_allclose(turns[:, 2], 0.0, atol=1e-9)


def test_a_direction_straight_down_is_brought_up_too() -> None:
    np.testing.assert_allclose(hexapod().plates(np.array([[0.0, 0.0, -1.0]]))[0, :3, 2], [0.0, 0.0, -1.0], atol=1e-12)


def test_a_plate_twisted_by_a_right_angle_is_singular_and_refused() -> None:
    # With equal radii or not, a platform twisted by 90 degrees is held against no turn [Merlet2006].
    machine = hexapod()
    singular = pose((0.0, 0.0, 0.0), (0.0, 0.0, math.pi / 2.0))
    assert machine.margins(singular[None])[0] < 0.0
    with pytest.raises(ReachError, match=r"hexapod: (with legs .* singular|no pose of the plate)"):
        machine.plate(machine.axes(singular[None])[0])


@pytest.mark.parametrize("turn", [1.5, 1.55, math.pi / 2.0])
def test_the_margin_falls_below_zero_before_the_plate_is_singular(turn: float) -> None:
    # Without strokes and cones to speak of the singularity is what stops it; legs may pass through each other.
    noun = hexapod_noun(leg_mm=[20.0, 900.0], base_cone_deg=89.9, plate_cone_deg=89.9, leg_diameter_mm=0.1)
    machine = HexapodMachine(noun)
    assert machine.margins(pose((0.0, 0.0, 0.0), (0.0, 0.0, turn))[None])[0] < 0.0
    assert machine.margins(pose((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))[None])[0] > 0.0


@pytest.mark.parametrize("lengths", [[1.0] * 6, [175.0, 900.0, 175.0, 175.0, 175.0, 175.0]])
def test_legs_that_fit_no_pose_are_refused(lengths: list[float]) -> None:
    with pytest.raises(ReachError, match=r"hexapod: .*legs of \[.*\] mm"):
        hexapod().plate(np.array(lengths))


def test_the_solids_stand_in_the_base_of_the_robot_and_move_with_the_plate() -> None:
    noun, machine = hexapod_noun(), hexapod()
    for T_table_plate in (np.eye(4), machine.plates(np.array([[0.0, 0.2, 0.98]]) / math.hypot(0.2, 0.98))[0]):
        plate, *legs, base = machine.solids(T_table_plate)
        np.testing.assert_allclose(plate.start, (noun.T_base_table @ T_table_plate)[:3, 3])
        assert np.linalg.norm(plate.end - plate.start) == pytest.approx(noun.plate_thickness)
        np.testing.assert_allclose(
            [np.linalg.norm(leg.end - leg.start) for leg in legs], machine.axes(T_table_plate[None])[0], rtol=1e-12
        )
        assert [leg.name for leg in legs] == [f"table's leg {number}" for number in range(1, 7)]
        np.testing.assert_allclose(base.start, [350.0, -20.0, 5.0 - 20.0 - 188.9])
        # Depth of the joints, height between them, and the base below.
        assert 5.0 - base.end[2] == pytest.approx(328.0)


@pytest.mark.parametrize(
    ("keys", "complaint"),
    [
        ({"leg_mm": [222.8, 175.2]}, "give the shortest, then the longest"),
        ({"leg_mm": [175.2, 190.0]}, "at rest its legs are 198.7 to 198.7 mm long, but may be 175.2 to 190"),
        ({"leg_mm": [200.0, 222.8]}, "but may be 200 to 222.8"),
        ({"leg_diameter_mm": 42.0}, "at rest two legs are 40.7 mm apart from axis to axis, but 42 mm thick"),
    ],
)
def test_a_hexapod_that_cannot_rest_is_refused(keys: dict[str, object], complaint: str) -> None:
    with pytest.raises(UsageError, match=complaint):
        hexapod_noun(**keys)


def test_legs_that_do_not_hold_the_plate_are_refused() -> None:
    noun = hexapod_noun(leg_diameter_mm=0.1)
    upright = noun.base_joints + np.array([0.0, 0.0, 188.9])
    parallel = Hexapod(
        "parallel",
        noun.T_base_table,
        noun.base_joints,
        upright,
        noun.lengths,
        0.2,
        0.2,
        0.1,
        1.0,
        0.0,
        1.0,
        1.0,
        1.0,
        1.0,
        0.0,
    )
    with pytest.raises(InputError, match="parallel: its legs do not hold the plate at rest"):
        HexapodMachine(parallel)
