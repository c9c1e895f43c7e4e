"""Attitude of the tool along a run: nozzle against the smoothed surface normal, the rest by the smallest rotation.

Normals interpolated on a triangle mesh carry its facets as noise. A tenth of a degree of it at half a millimetre
spacing would cost most of the print speed, because the wrist has to follow. So the axis is smoothed along the arc
before anything moves; the tip stays where it is.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from geoprint.model import FloatArray
from geoprint.transforms import interpolate_poses, quaternion_of, rigid, rotation_of, same_sign, smallest_rotation

# Standard deviation of the smoothing along the arc [mm]: about an edge of a well-made part mesh, below a bend of it.
SMOOTHING_LENGTH = 1.0
# ... and never more than this share of the run, so that small loops keep leaning with the surface.
SMOOTHING_SHARE = 0.05
# The smoothing gives way where the nozzle would lean more than this from the normal [rad] ...
LARGEST_LEAN = np.radians(15.0)
# ... down to a standard deviation [mm] that no longer smooths anything.
SHORTEST_SMOOTHING = 0.25
# Even samples per standard deviation on which the filter works.
SAMPLES_PER_DEVIATION = 8

# The tool frame over a flat part: z straight down, x along the x axis of the base.
STRAIGHT_DOWN = np.diag([1.0, -1.0, -1.0])


def smoothed_axes(normals: FloatArray, arcs: FloatArray, *, closed: bool) -> FloatArray:
    """Smooth unit normals along one run with a Gaussian window, as wide as the lean allows.

    The window starts at a millimetre and is halved until no axis leans more than 15 degrees from its normal, so that
    a sharp bend of the part is followed rather than cut.

    Args:
        normals: (k, 3) unit normals.
        arcs: (k,) rising arc lengths from 0 [mm].
        closed: whether the run ends where it starts; then the window runs across the seam.

    Returns:
        (k, 3) unit vectors.
    """
    deviation = min(SMOOTHING_LENGTH, SMOOTHING_SHARE * float(arcs[-1]))
    while True:
        axes = _filtered(normals, arcs, deviation=deviation, closed=closed)
        cosine = np.einsum("ij,ij->i", axes, normals).min()
        if cosine >= np.cos(LARGEST_LEAN) or deviation < SHORTEST_SMOOTHING:
            return axes
        deviation /= 2.0


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
    """Return (k, 4) attitudes at (k,) shares of the way between two quaternions (4,), by the short way round."""
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
