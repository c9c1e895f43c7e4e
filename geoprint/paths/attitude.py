"""Attitude of the tool along a run: nozzle against the smoothed surface normal, the rest by the smallest rotation.

Normals interpolated on a triangle mesh carry its facets as noise. A tenth of a degree of it at half a millimetre
spacing would cost most of the print speed, because the wrist has to follow. So the axis is smoothed along the arc
before anything moves, and leans no farther from the normal than it may; the tip stays where it is.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from geoprint.model import FloatArray
from geoprint.transforms import interpolate_poses, quaternion_of, rigid, rotation_of, same_sign, smallest_rotation

# Standard deviation of the smoothing along the arc [mm]: about an edge of a well-made part mesh. A shorter one leaves
# so much of 0.05 degrees of noise that a print at 20 mm/s slows down, a longer one only leans more.
SMOOTHING_LENGTH = 1.0
# Even samples per standard deviation on which the filter works.
SAMPLES_PER_DEVIATION = 8

# The tool frame over a flat part: z straight down, x along the x axis of the base.
STRAIGHT_DOWN = np.diag([1.0, -1.0, -1.0])


def smoothed_axes(normals: FloatArray, arcs: FloatArray, *, closed: bool, max_tilt: float) -> FloatArray:
    """Smooth unit normals along one run with a Gaussian window, and keep them in the cone about each normal.

    An axis that the window leans too far from its normal, where the part bends fast, is turned back to the edge of the
    cone by the smallest rotation.

    Args:
        normals: (k, 3) unit normals.
        arcs: (k,) rising arc lengths from 0 [mm].
        closed: whether the run ends where it starts; then the window runs across the seam.
        max_tilt: largest angle between an axis and its normal [rad], in [0, pi / 2).

    Returns:
        (k, 3) unit vectors.
    """
    axes = _filtered(normals, arcs, deviation=SMOOTHING_LENGTH, closed=closed)
    cosine = np.einsum("ij,ij->i", axes, normals)
    aside = axes - cosine[:, None] * normals
    aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    edge = np.cos(max_tilt) * normals + np.sin(max_tilt) * aside
    return np.where((cosine < np.cos(max_tilt))[:, None], edge, axes)


def tool_quaternions(axes: FloatArray, *, R_base_work: FloatArray) -> FloatArray:
    """Return the attitude of the tool for nozzles that point against given axes.

    The tool over a level surface has its z axis straight down in the base frame and its x axis along the base's; a
    leaning one is turned from there by the smallest rotation.

    Args:
        axes: (k, 3) unit vectors in the work frame, out of the surface.
        R_base_work: (3, 3) rotation from work to base frame.

    Returns:
        (k, 4) unit quaternions w x y z of the tool frame in the work frame, of one sign from row to row.
    """
    R_work_level = R_base_work.T @ STRAIGHT_DOWN
    rotations = smallest_rotation(R_work_level[:, 2], -axes) @ R_work_level
    return same_sign(quaternion_of(rotations))


def slerp(start: FloatArray, end: FloatArray, shares: FloatArray) -> FloatArray:
    """Return (k, 4) attitudes at (k,) shares of the shorter turn between two quaternions (4,)."""
    T_start, T_end = (rigid(rotation_of(quaternion), np.zeros(3)) for quaternion in (start, end))
    poses = np.broadcast_to(T_start, (shares.size, 4, 4)), np.broadcast_to(T_end, (shares.size, 4, 4))
    return same_sign(quaternion_of(interpolate_poses(*poses, shares)[:, :3, :3]))


def _filtered(normals: FloatArray, arcs: FloatArray, *, deviation: float, closed: bool) -> FloatArray:
    """Return unit normals after a Gaussian filter of one standard deviation [mm] along the arc."""
    length = float(arcs[-1])
    count = int(np.ceil(length / deviation * SAMPLES_PER_DEVIATION))
    even: FloatArray = np.linspace(0.0, length, count + 1)
    sampled = np.column_stack([np.interp(even, arcs, normals[:, i]) for i in range(3)])
    sigma = deviation / (length / count)
    if closed:
        around = gaussian_filter1d(sampled[:-1], sigma, axis=0, mode="wrap")
        smooth = np.vstack([around, around[:1]])
    else:
        smooth = gaussian_filter1d(sampled, sigma, axis=0, mode="nearest")
    axes = np.column_stack([np.interp(arcs, even, smooth[:, i]) for i in range(3)])
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)
