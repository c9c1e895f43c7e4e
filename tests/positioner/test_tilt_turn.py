"""The tilt-turn table: each direction is brought up, by the smaller motion, as rotations of SciPy say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import ReachError
from geoprint.model import FloatArray
from tests.positioner.tables import random_directions, random_poses, tilt_turn, tilt_turn_noun

UP = np.array([0.0, 0.0, 1.0])
DEPTH = 75.0


def by_scipy(tilt: float, turn: float) -> FloatArray:
    """Return the pose of the plate at two angles, the tilting axis `DEPTH` below it."""
    axis = transforms.rigid(np.eye(3), np.array([0.0, 0.0, -DEPTH]))
    tilted, turned = (Rotation.from_euler(name, angle).as_matrix() for name, angle in (("x", tilt), ("z", turn)))
    return (
        axis @ transforms.rigid(tilted, np.zeros(3)) @ transforms.inverse(axis) @ transforms.rigid(turned, np.zeros(3))
    )


def test_each_direction_is_brought_up() -> None:
    ups = random_directions(500)
    poses = tilt_turn(axis_depth_mm=DEPTH).plates(ups)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", poses[:, :3, :3], ups), np.tile(UP, (500, 1)), atol=1e-12)


def test_the_pose_of_two_angles_is_that_of_scipy_and_leads_back_to_them() -> None:
    machine = tilt_turn(axis_depth_mm=DEPTH)
    for tilt, turn in np.random.default_rng(0).uniform(-np.pi, np.pi, (300, 2)):
        found = machine.plate(np.array([tilt, turn]))
        np.testing.assert_allclose(found, by_scipy(tilt, turn), atol=1e-12)
        np.testing.assert_allclose(machine.axes(found[None])[0], [tilt, turn], atol=1e-12)


def test_of_both_solutions_the_smaller_turn_is_taken() -> None:
    machine = tilt_turn()
    ups = random_directions(500)
    tilts, turns = machine.axes(machine.plates(ups)).T
    np.testing.assert_allclose(np.abs(tilts), np.arccos(ups[:, 2]), atol=1e-7)
    assert np.abs(turns).max() <= np.pi / 2.0 + 1e-12
    # The other one tilts to the other side and turns by half a turn more or less.
    other = machine.axes(
        np.array([machine.plate(np.array([-a, b + np.pi])) for a, b in zip(tilts, turns, strict=True)])
    )
    assert (np.abs(turns) <= np.abs(other[:, 1]) + 1e-12).all()
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", np.array([machine.plate(each) for each in other])[:, :3, :3], ups),
        np.tile(UP, (500, 1)),
        atol=1e-12,
    )


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_where_both_turns_are_equal_the_positive_tilt_is_taken(sign: float) -> None:
    machine = tilt_turn()
    tilt, turn = machine.axes(machine.plates(np.array([[sign * np.sin(0.5), 0.0, np.cos(0.5)]])))[0]
    assert tilt == pytest.approx(0.5)
    assert abs(turn) == pytest.approx(np.pi / 2.0)


def test_a_solution_within_the_ranges_goes_before_a_smaller_turn() -> None:
    ups = np.array([[0.1, 0.4, 0.9]]) / np.linalg.norm([0.1, 0.4, 0.9])
    free, onesided = tilt_turn(), tilt_turn(tilt_deg=[-90.0, 5.0])
    assert free.axes(free.plates(ups))[0, 0] > 0.0
    assert onesided.axes(onesided.plates(ups))[0, 0] < 0.0
    assert onesided.margins(onesided.plates(ups))[0] > 0.0


def test_a_direction_along_the_axis_needs_no_turn() -> None:
    machine = tilt_turn()
    np.testing.assert_array_equal(machine.plates(UP[None])[0], np.eye(4))
    np.testing.assert_allclose(machine.axes(machine.plates(-UP[None]))[0], [np.pi, 0.0])


def test_the_margins_of_thousands_of_poses_are_those_of_a_plain_loop() -> None:
    machine = tilt_turn(tilt_deg=[-30.0, 100.0], turn_deg=[-120.0, 170.0], axis_depth_mm=DEPTH)
    angles = np.random.default_rng(1).uniform(-np.pi, np.pi, (10_000, 2))
    rotations = Rotation.from_euler("XZ", angles).as_matrix()
    tilted = Rotation.from_euler("X", angles[:, :1]).as_matrix()[:, :, 2]
    found = machine.margins(transforms.rigid(rotations, DEPTH * (tilted - UP)))
    ranges = tilt_turn_noun(tilt_deg=[-30.0, 100.0], turn_deg=[-120.0, 170.0]).ranges.tolist()
    for margin, row in zip(found.tolist(), angles.tolist(), strict=True):
        left = [1.0 - angle / (low if angle < 0.0 else high) for angle, (low, high) in zip(row, ranges, strict=True)]
        assert margin == pytest.approx(min(left), abs=1e-9)


def test_a_pose_that_two_axes_cannot_take_is_refused_with_how_much_it_misses() -> None:
    machine = tilt_turn()
    poses = np.concatenate([machine.plates(random_directions(3)), random_poses(1, shift=1.0, turn=0.3)])
    with pytest.raises(
        ReachError, match=r"tilt-turn table: pose 4 of the plate is missed by 4\.\d+ .* allowed is 1e-06"
    ):
        machine.axes(poses)
    assert machine.axes(np.empty((0, 4, 4))).shape == (0, 2)


def test_the_solids_stand_in_the_base_of_the_robot_and_only_plate_and_hub_move() -> None:
    machine, noun = tilt_turn(axis_depth_mm=DEPTH), tilt_turn_noun(axis_depth_mm=DEPTH)
    T_table_plate = machine.plate(np.array([0.7, 0.3]))
    rest, moved = machine.solids(np.eye(4)), machine.solids(T_table_plate)
    assert [solid.name for solid in moved] == ["table's plate", "table's hub", "table's beam", "table's post"]
    np.testing.assert_allclose(moved[0].start, (noun.T_base_table @ T_table_plate)[:3, 3])
    np.testing.assert_allclose(moved[0].end, moved[1].start)
    for before, after in zip(rest[2:], moved[2:], strict=True):
        np.testing.assert_array_equal(before.start, after.start)
        np.testing.assert_array_equal(before.end, after.end)
    along = moved[2].start - moved[2].end
    np.testing.assert_allclose(along / np.linalg.norm(along), noun.T_base_table[:3, 0], atol=1e-12)
    # The tilting axis keeps its distance from the plate.
    top = T_table_plate[:3, 3] - np.array([0.0, 0.0, -DEPTH])
    assert np.linalg.norm(top) == pytest.approx(DEPTH)
