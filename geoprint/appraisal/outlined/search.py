"""Poses from which a part may have the outline that is seen: one for every direction and likely turn about its axis.

From every direction the outline of the part is compared with the one in the picture as a curve of its distance from
its own middle over the angle: that tells how the camera was turned about its axis, and how far away it stood.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint.appraisal.camera import Camera, Lens
from geoprint.appraisal.outlined.part_outline import OutlinedPart
from geoprint.appraisal.outlined.picture_outline import PictureOutline
from geoprint.model import FloatArray
from geoprint.transforms import rigid

# Directions to look from, all around: neighbours are about 10 degrees apart.
DIRECTIONS = 420
# Bins of the angle, and turns about the axis that are kept of each direction.
BINS, TURNS = 120, 3
# Places of an outline that is compared, and how large it is for that [pixels].
PLACES, SIZE = 200, 300.0
# The mean normal of what is printed is longer than this where it has a side.
LEAST_FACING = 0.5
# Distances that are compared from, over the size of a part: farther than this nothing of it is behind the camera.
LEAST_AWAY, MEAN_SIZE = 1.5, 0.8


def likely_poses(seen: PictureOutline, outlined: OutlinedPart, lens: Lens, *, facing: FloatArray) -> list[FloatArray]:
    """Return (4, 4) poses of the camera, one for each direction and likely turn, the likeliest outline first.

    Args:
        seen: the outline in the picture.
        outlined: the part.
        lens: of the camera.
        facing: (3,) the mean normal of what is printed, which the camera looks at.
    """
    looked = lens.directions(seen.pixels)
    R_ray = _toward(looked.mean(axis=0))
    flat = looked @ R_ray
    middle, curve, size = _signature(flat[:, :2] / flat[:, 2:])
    vertices = outlined.surface.vertices
    centre = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    radius = float(np.linalg.norm(vertices - centre, axis=1).max())
    away = radius * max(MEAN_SIZE / size, LEAST_AWAY)
    focal = SIZE * away / radius
    pinhole = Lens((1, 1), np.full(2, focal), np.zeros(2), np.zeros(2))
    tried: list[tuple[float, FloatArray]] = []
    for direction in _directions(facing):
        R_first = _toward(-direction).T
        T_first = rigid(R_first, np.array([0.0, 0.0, away]) - R_first @ centre)
        outline = outlined.under(Camera(pinhole, T_first, 0.0, 0), places=PLACES)
        if len(outline.pixels) < BINS // 4:
            continue
        shift, own, own_size = _signature(outline.pixels / focal)
        distance = away * own_size / size
        for unlike, turn in _turns(curve, own):
            R_turn = Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix()
            place = R_turn @ np.array([-away * shift[0], -away * shift[1], distance])
            place += distance * np.array([*middle, 0.0])
            R = R_ray @ R_turn @ R_first
            tried.append((unlike, rigid(R, R_ray @ place - R @ centre)))
    return [pose for _, pose in sorted(tried, key=lambda each: each[0])]


def _directions(facing: FloatArray) -> FloatArray:
    """Return (n, 3) unit directions evenly all around, from which what is printed is looked at."""
    steps = np.arange(DIRECTIONS) + 0.5
    high, turns = 1.0 - 2.0 * steps / DIRECTIONS, np.pi * (1.0 + 5.0**0.5) * steps
    level = np.sqrt(1.0 - high**2)
    around = np.column_stack([level * np.cos(turns), level * np.sin(turns), high])
    return around[around @ facing > 0.0] if has_a_side(facing) else around


def has_a_side(facing: FloatArray) -> bool:
    """Return whether what is printed has a side: its mean normal is short where it goes all around a part."""
    return float(np.linalg.norm(facing)) > LEAST_FACING


def _toward(ahead: FloatArray) -> FloatArray:
    """Return a (3, 3) rotation whose third column looks ahead."""
    z = ahead / np.linalg.norm(ahead)
    guide = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(guide, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _signature(flat: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the (2,) middle of an outline, its (BINS,) distance from there over the angle, and the mean of it."""
    middle = flat.mean(axis=0)
    off = flat - middle
    bins = np.floor((np.arctan2(off[:, 1], off[:, 0]) / (2.0 * np.pi) + 0.5) * BINS).astype(np.int64) % BINS
    far = np.zeros(BINS)
    np.maximum.at(far, bins, np.linalg.norm(off, axis=1))
    known = np.flatnonzero(far)
    far = np.interp(np.arange(BINS), known, far[known], period=BINS)
    size = float(far.mean())
    return middle, far / size, size


def _turns(curve: FloatArray, own: FloatArray) -> list[tuple[float, float]]:
    """Return how unlike two signatures are, and by what angle the other is turned, at its least values."""
    together = np.fft.irfft(np.fft.rfft(curve) * np.conj(np.fft.rfft(own)), BINS) / BINS
    unlike = np.sqrt(np.maximum((curve**2).mean() + (own**2).mean() - 2.0 * together, 0.0))
    lowest = np.flatnonzero((unlike <= np.roll(unlike, 1)) & (unlike < np.roll(unlike, -1)))
    best = lowest[np.argsort(unlike[lowest])][:TURNS]
    return [(float(unlike[k]), 2.0 * np.pi * k / BINS) for k in best.tolist()]
