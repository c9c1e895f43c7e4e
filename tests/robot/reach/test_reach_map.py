"""The map of what the arm cannot reach: reasons, shares, places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint import transforms
from geoprint.errors import InputError, ReachError
from geoprint.model import BoolArray, FloatArray, PoseStream
from geoprint.robot.arm import Arm
from geoprint.robot.reach import ReachMap, lost_shares, reach, reach_map
from geoprint.robot.reach.reach_map import Reason
from tests.robot.cells import straight_cell

DOWN = np.diag([1.0, -1.0, -1.0])
AHEAD = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
HERE = np.eye(4)


def straight_arm(*, joint_1_deg: float = 165.0) -> Arm:
    cell = straight_cell()
    limits = cell.robot.limits.copy()
    limits[0] = np.radians([-joint_1_deg, joint_1_deg])
    return Arm(replace(cell.robot, limits=limits), T_flange_tool=cell.tool.T_flange_tool)


def stream(tips: FloatArray, *, attitude: FloatArray = DOWN, deposit: BoolArray | None = None) -> PoseStream:
    count = len(tips)
    return PoseStream(
        tips=tips,
        quaternions=transforms.quaternion_of(np.tile(attitude, (count, 1, 1))),
        normals=np.tile(-attitude[:, 2], (count, 1)),
        runs=np.arange(count) // 100,
        levels=np.zeros(count, dtype=int),
        layers=np.zeros(count, dtype=int),
        deposit=np.ones(count, dtype=bool) if deposit is None else deposit,
        stops=np.zeros(count, dtype=bool),
        arcs=np.arange(count, dtype=float),
        flow=np.ones(count),
        standoff=0.3,
    )


def on_circle(angles_deg: FloatArray, *, radius: float = 350.0) -> FloatArray:
    """Tips about axis 1, on a circle on which joint 1 equals the angle."""
    angles = np.radians(angles_deg)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(angles.size, 200.0)])


def test_what_is_reached_has_a_complete_map_for_the_motion_that_is_taken() -> None:
    poses, arm = stream(on_circle(np.linspace(-5.0, 5.0, 41))), straight_arm()
    path, found = reach(poses, arm, T_base_work=HERE), reach_map(poses, arm, T_base_work=HERE)
    assert found.complete
    assert (found.lost, found.unservable, found.shares(), found.worst(3)) == (0.0, 0.0, {}, ())
    assert found.branch == path.branch
    assert found.lengths.sum() == pytest.approx(np.linalg.norm(np.diff(poses.tips, axis=0), axis=1).sum())
    np.testing.assert_allclose(found.places, poses.tips, atol=1e-9)


def test_poses_beyond_a_limit_name_the_joint_and_by_how_much_at_the_right_places() -> None:
    angles = np.linspace(0.0, 15.0, 61)
    poses, arm = stream(on_circle(angles)), straight_arm(joint_1_deg=10.1)
    found = reach_map(poses, arm, T_base_work=HERE)
    beyond = angles > 10.1
    np.testing.assert_array_equal(found.reasons == Reason.JOINT_LIMIT, beyond)
    assert found.reached == (~beyond).sum()
    assert (found.joints[beyond] == 1).all()
    np.testing.assert_allclose(np.degrees(found.excess), np.maximum(angles - 10.1, 0.0), atol=1e-6)
    np.testing.assert_allclose(found.places[beyond], poses.tips[beyond], atol=1e-9)
    assert found.shares() == {"joint_1": pytest.approx(19.5 / 60.0, rel=1e-9)}
    assert found.worst(3) == (60,)
    assert found.unservable == pytest.approx(found.lost)


def test_poses_out_of_reach_lose_their_share_and_are_placed_where_the_motion_to_them_ends() -> None:
    T_base_work = transforms.rigid(np.eye(3), np.array([100.0, 0.0, 0.0]))
    poses, arm = stream(np.array([[250.0, 0, 200], [252.0, 0, 200], [700.0, 0, 200]])), straight_arm()
    found = reach_map(poses, arm, T_base_work=T_base_work)
    np.testing.assert_array_equal(found.reasons, [Reason.REACHED, Reason.REACHED, Reason.OUT_OF_REACH])
    assert 352.0 < found.base_places[2, 0] < 800.0
    np.testing.assert_allclose(found.base_places[2] - found.places[2], [100.0, 0.0, 0.0], atol=1e-9)
    assert found.excess[2] == pytest.approx(found.found[2] - 580.0, abs=1.0)
    assert found.shares() == {"out_of_reach": pytest.approx(224.0 / 450.0)}


def test_wrist_singularity_counts_on_deposit_only() -> None:
    tips = np.array([[534.0, 0.0, 630.0], [534.0, 0.0, 629.9]])
    arm = straight_arm()
    deposited = reach_map(stream(tips, attitude=AHEAD), arm, T_base_work=HERE)
    assert (deposited.reasons == Reason.WRIST).all()
    assert deposited.shares() == {"wrist_singularity": 1.0}
    np.testing.assert_allclose(np.degrees(deposited.allowed[0]), [5.0, 180.0])
    travel = reach_map(stream(tips, attitude=AHEAD, deposit=np.zeros(2, dtype=bool)), arm, T_base_work=HERE)
    assert travel.complete


def test_flip_is_mapped_on_travel_and_loses_no_deposit() -> None:
    aside = np.linspace(-20.0, 20.0, 41)
    tips = np.column_stack([np.full(41, 534.0), aside, np.full(41, 630.0)])
    found = reach_map(stream(tips, attitude=AHEAD, deposit=np.zeros(41, dtype=bool)), straight_arm(), T_base_work=HERE)
    assert set(found.reasons.tolist()) == {Reason.REACHED, Reason.FLIP}
    assert (found.lost, found.shares()) == (0.0, {"flip": 0.0})
    assert found.unservable == 0.0


def test_refusal_says_share_reason_and_first_place_and_keeps_the_numbers() -> None:
    poses, arm = stream(on_circle(np.linspace(0.0, 15.0, 61))), straight_arm(joint_1_deg=10.1)
    with pytest.raises(ReachError) as caught:
        reach(poses, arm, T_base_work=HERE)
    message = str(caught.value)
    assert "needs joint 1 at 10.25 degrees, allowed is -10 to 10" in message
    assert "loses 32.5 % of the deposited length (joint 1 32.5 %; no motion serves 32.5 %)" in message
    assert "`geoprint place`" in message
    assert caught.value.details["lost"] == pytest.approx(0.325)
    assert lost_shares(caught.value) == (("joint_1", pytest.approx(0.325)),)


def map_of(reasons: list[int], lengths: list[float]) -> ReachMap:
    count = len(reasons)
    return ReachMap(
        reasons=np.array(reasons),
        joints=np.where(np.array(reasons) == Reason.JOINT_LIMIT, 3, 0),
        found=np.arange(count, dtype=float),
        allowed=np.zeros((count, 2)),
        servable=np.ones(count, dtype=bool),
        lengths=np.array(lengths),
        runs=np.zeros(count, dtype=int),
        places=np.zeros((count, 3)),
        base_places=np.zeros((count, 3)),
        branch=0,
    )


def test_worst_places_are_one_a_stretch_with_the_worst_reason_first() -> None:
    found = map_of([2, 2, 0, 3, 1, 0, 2], [1.0] * 7)
    assert found.worst(9) == (4, 6, 1, 3)
    assert found.worst(2) == (4, 6)
    assert list(found.shares()) == ["joint_3", "out_of_reach", "wrist_singularity"]


@pytest.mark.parametrize(
    ("reasons", "lengths", "complaint"), [([0, 9], [1.0, 1.0], "known ones"), ([0], [-1.0], "not be negative")]
)
def test_impossible_maps_are_refused(reasons: list[int], lengths: list[float], complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        map_of(reasons, lengths)
