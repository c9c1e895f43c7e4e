"""Rigid transforms obey the laws of their group, and the smallest rotation is one."""

from __future__ import annotations

import numpy as np
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import FloatArray


def directions(seed: int, count: int) -> FloatArray:
    found = np.random.default_rng(seed).normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def poses(seed: int, count: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    return transforms.rigid(Rotation.random(count, rng=rng).as_matrix(), rng.normal(size=(count, 3)) * 100.0)


@given(st.integers(0, 10_000))
def test_inverse_undoes_a_transform(seed: int) -> None:
    T = poses(seed, 4)
    np.testing.assert_allclose(T @ transforms.inverse(T), np.tile(np.eye(4), (4, 1, 1)), atol=1e-12)


@given(st.integers(0, 10_000))
def test_quaternions_and_rotations_are_the_same_thing(seed: int) -> None:
    rotations = poses(seed, 5)[:, :3, :3]
    quaternions = transforms.quaternion_of(rotations)
    assert (quaternions[:, 0] >= 0).all()
    np.testing.assert_allclose(transforms.rotation_of(quaternions), rotations, atol=1e-12)


@given(st.integers(0, 10_000))
def test_the_smallest_rotation_arrives_and_turns_by_the_angle_between(seed: int) -> None:
    start, *ends = directions(seed, 6)
    rotations = transforms.smallest_rotation(start, np.array(ends))
    np.testing.assert_allclose(rotations @ start, ends, atol=1e-12)
    angles = np.arccos(np.clip(np.array(ends) @ start, -1, 1))
    np.testing.assert_allclose(transforms.rotation_angle(rotations), angles, atol=1e-7)


def test_the_smallest_rotation_to_the_opposite_is_still_a_rotation() -> None:
    start = np.array([0.0, 0.0, 1.0])
    rotation = transforms.smallest_rotation(start, -start[None])[0]
    np.testing.assert_allclose(rotation @ start, -start, atol=1e-15)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)


def test_poses_are_interpolated_along_a_line_and_at_a_constant_rate_of_turn() -> None:
    T_from, T_to = poses(3, 1), poses(4, 1)
    shares = np.linspace(0.0, 1.0, 5)
    between = transforms.interpolate_poses(np.repeat(T_from, 5, axis=0), np.repeat(T_to, 5, axis=0), shares)
    np.testing.assert_allclose(between[[0, -1]], np.concatenate([T_from, T_to]), atol=1e-12)
    steps = transforms.rotation_angle(transforms.inverse(between[:-1])[:, :3, :3] @ between[1:, :3, :3])
    np.testing.assert_allclose(steps, steps.mean(), atol=1e-9)
    np.testing.assert_allclose(np.diff(between[:, :3, 3], axis=0).std(axis=0), 0.0, atol=1e-10)


def test_points_move_with_their_frame() -> None:
    T = transforms.rigid(Rotation.from_euler("z", 90, degrees=True).as_matrix(), np.array([10.0, 0.0, 0.0]))
    np.testing.assert_allclose(transforms.apply(T, np.array([[1.0, 0.0, 0.0]])), [[10.0, 1.0, 0.0]], atol=1e-15)
