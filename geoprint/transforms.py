"""Rigid transforms as (4, 4) arrays and quaternions as w x y z, for one pose or many.

`T_a_b` turns b-coordinates into a-coordinates: p_a = T_a_b @ p_b. Rotations are SciPy's; this module only fixes the
order of quaternion components (w first, as RAPID has it) and their sign (w not negative).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.model import FloatArray

# Distances that differ by less [mm] are equal: no arm tells them apart, and rounding must not. Of what is equally near
# the one farthest this way counts, about which no part is symmetric by design.
EQUAL = 1e-4
THIS_WAY = np.array([0.6337, 0.5102, 0.5814])
THIS_WAY.setflags(write=False)


def rigid(rotation: FloatArray, translation: FloatArray) -> FloatArray:
    """Join rotations and translations.

    Args:
        rotation: (..., 3, 3).
        translation: (..., 3) [mm].

    Returns:
        (..., 4, 4) transforms.

    Examples:
        >>> rigid(np.eye(3), np.array([1.0, 2.0, 3.0]))[:, 3]
        array([1., 2., 3., 1.])
    """
    shape = np.broadcast_shapes(rotation.shape[:-2], translation.shape[:-1])
    result = np.zeros((*shape, 4, 4))
    result[..., :3, :3] = rotation
    result[..., :3, 3] = translation
    result[..., 3, 3] = 1.0
    return result


def inverse(T_a_b: FloatArray) -> FloatArray:
    """Return T_b_a of one (4, 4) or many (..., 4, 4) rigid transforms, by transposing the rotation."""
    rotation = np.swapaxes(T_a_b[..., :3, :3], -1, -2)
    return rigid(rotation, -(rotation @ T_a_b[..., :3, 3, None])[..., 0])


def apply(T_a_b: FloatArray, points_b: FloatArray) -> FloatArray:
    """Return (k, 3) points in frame a, given (k, 3) points in frame b [mm]."""
    return points_b @ T_a_b[:3, :3].T + T_a_b[:3, 3]


def rotation_of(quaternions: FloatArray) -> FloatArray:
    """Return (..., 3, 3) rotations of (..., 4) unit quaternions w x y z."""
    return Rotation.from_quat(quaternions, scalar_first=True).as_matrix()


def quaternion_of(rotations: FloatArray) -> FloatArray:
    """Return (..., 4) unit quaternions w x y z with w >= 0 of (..., 3, 3) rotations."""
    return Rotation.from_matrix(rotations).as_quat(canonical=True, scalar_first=True)


def smallest_rotation(start: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the rotations by the smallest angle that take one direction to others.

    Where an end is opposite to the start the axis is free: then the turn is about an axis normal to the start that
    depends on the start alone, so that the result is still a rotation but does not vary smoothly there.

    Args:
        start: (3,) unit vector.
        ends: (k, 3) unit vectors.

    Returns:
        (k, 3, 3) rotations R with R @ start = end.
    """
    cosine = ends @ start
    axis = np.cross(start, ends)
    opposite = cosine < -1.0 + 1e-12
    helper = np.eye(3)[np.argmin(np.abs(start))]
    aside = np.cross(start, helper)
    w = np.where(opposite, 0.0, 1.0 + cosine)
    xyz = np.where(opposite[:, None], aside, axis)
    quaternion = np.column_stack([w, xyz])
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return rotation_of(quaternion)


def interpolate_poses(Ts_from: FloatArray, Ts_to: FloatArray, shares: FloatArray) -> FloatArray:
    """Return poses between one and another: straight line and slerp, as MoveL runs.

    Args:
        Ts_from: (k, 4, 4) poses.
        Ts_to: (k, 4, 4) poses.
        shares: (k,) share of the motion in [0, 1].

    Returns:
        (k, 4, 4) poses.
    """
    start = Rotation.from_matrix(Ts_from[:, :3, :3])
    turn = (start.inv() * Rotation.from_matrix(Ts_to[:, :3, :3])).as_rotvec()
    rotation = (start * Rotation.from_rotvec(turn * shares[:, None])).as_matrix()
    position = Ts_from[:, :3, 3] + shares[:, None] * (Ts_to[:, :3, 3] - Ts_from[:, :3, 3])
    return rigid(rotation, position)


def nearest(distances: FloatArray, places: FloatArray) -> int:
    """Return the index of the smallest distance; of those that are equal the same one whatever rounding does.

    Args:
        distances: (k,) [mm].
        places: (k, 3) what they lead to [mm].

    Examples:
        >>> nearest(np.array([2.0 - 1e-9, 2.0, 3.0]), np.eye(3))
        0
        >>> nearest(np.array([2.0, 2.0 - 1e-9, 3.0]), np.eye(3))
        0
    """
    equal = np.flatnonzero(distances <= distances.min() + EQUAL)
    return int(equal[(places[equal] @ THIS_WAY).argmax()])


def rotation_angle(rotations: FloatArray) -> FloatArray:
    """Return the angle [rad] in [0, pi] of each of (..., 3, 3) rotations."""
    return np.asarray(Rotation.from_matrix(rotations).magnitude())


def angles_between(ones: FloatArray, others: FloatArray) -> FloatArray:
    """Return the (...,) angles [rad] in [0, pi] between (..., 3) unit vectors; small and straight ones are exact, too.

    Examples:
        >>> angles_between(np.eye(3)[:2], np.eye(3)[1:]) / np.pi
        array([0.5, 0.5])
    """
    return 2.0 * np.arctan2(np.linalg.norm(ones - others, axis=-1), np.linalg.norm(ones + others, axis=-1))


def same_sign(quaternions: FloatArray) -> FloatArray:
    """Flip quaternions so that neighbours lie in one half-space; q and -q are the same attitude.

    Args:
        quaternions: (k, 4) unit quaternions.

    Returns:
        (k, 4) the same attitudes; the first keeps its sign.
    """
    turns = np.einsum("ij,ij->i", quaternions[1:], quaternions[:-1]) < 0.0
    signs = np.where(np.concatenate([[False], np.cumsum(turns) % 2 == 1]), -1.0, 1.0)
    return quaternions * signs[:, None]


def wrapped(angles: FloatArray) -> FloatArray:
    """Return angles [rad] in (-pi, pi], turned by whole turns.

    Examples:
        >>> wrapped(np.array([0.0, 3.0, -1.5]) * np.pi) / np.pi
        array([0. , 1. , 0.5])
    """
    return np.pi - (np.pi - angles) % (2.0 * np.pi)
