"""The inverse of six-axis arms that no closed form covers: damped least squares [Nakamura1986] from many starts.

Such an arm has up to sixteen solutions for a pose, and nothing orders them by itself. They are told apart here by the
same three signs as those of arms with a spherical wrist: on which side of axis 1 the wrist is, to which side the elbow
bends, and to which side axis 6 is turned from axis 4. For arms whose singularities are just these (a UR5's are) that
numbers all of them. For others the name may change while the arm passes no singularity, or two share it: then the
one that continues the row before is kept. Whoever follows a branch must look for jumps, as `following` does.
"""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np

from geoprint.kernels import njit
from geoprint.model import FloatArray
from geoprint.motion.arm.closed_form import BRANCHES, JOINTS
from geoprint.motion.arm.screws import Screws

# A solution misses its pose by no more than this [rad, and the same share of the arm's reach]: 1e-8 mm for a metre.
CONVERGED = 1e-11
MOST_ITERATIONS = 40
# Largest turn of a joint in one iteration [rad], beyond which the linear model says nothing.
LARGEST_STEP = 0.5
# Damping as a share of the squared miss: it vanishes as the pose comes near, so that the last steps are Newton's.
DAMPING = 0.05
LEAST_DAMPING = 1e-14
# Starts for solutions that no neighbouring row gives: with 32, 1 in 50 of a lone pose is missed, with 64 1 in 1000.
STARTS = 64
# Rows within this distance of the one before (share of the reach, and entries of a rotation) follow a path: solutions
# come from their neighbours, and the starts, which take a hundred times longer, are tried at each so many rows only.
NEAR = 0.05
FRESH = 8
# Keeps the side of axis 1 defined where axis 2 is parallel to it.
TINY = 1e-300


class _Axes(NamedTuple):
    """Axes, flange and marks of an arm as the compiled loops need them; all joints at zero."""

    directions: FloatArray
    points: FloatArray
    rotation: FloatArray
    place: FloatArray
    marks: FloatArray
    scale: float


@final
class NumericInverse:
    """The inverse of any six-axis arm by iteration.

    Args:
        screws: its axes.
        limits: (6, 2) lowest and highest joint angles [rad], between which the starts are drawn.

    Attributes:
        shoulder: (3,) the point of axis 1 that is nearest to axis 2, in the base frame [mm].
        reach: how far from the shoulder the flange may come at most [mm].
    """

    __slots__ = ("_axes", "_starts", "reach", "shoulder")

    def __init__(self, screws: Screws, *, limits: FloatArray) -> None:
        low, high = np.clip(limits, -np.pi, np.pi).T
        self._starts: FloatArray = np.random.default_rng(0).uniform(low, high, (STARTS, JOINTS))
        marks = np.stack([screws.nearest(3, 4), screws.nearest(4, 5)])
        place = screws.T_base_flange[:3, 3].copy()
        self.shoulder = screws.nearest(0, 1)
        knees = [self.shoulder, screws.nearest(1, 0), screws.nearest(2, 1), *marks, screws.nearest(5, 4), place]
        self.reach = float(np.linalg.norm(np.diff(knees, axis=0), axis=1).sum())
        rotation = np.ascontiguousarray(screws.T_base_flange[:3, :3])
        self._axes = _Axes(screws.directions.copy(), screws.points.copy(), rotation, place, marks, self.reach)

    def solutions(self, Ts_base_flange: FloatArray) -> FloatArray:
        """Return the joint angles of up to eight branches, limits not applied.

        Args:
            Ts_base_flange: (k, 4, 4) poses of the flange [mm]; rows that follow a path give solutions that do.

        Returns:
            (k, 8, 6) angles [rad] in (-pi, pi], branch = 4 * wrist + 2 * shoulder + elbow; NaN where none was found,
            which proves nothing: the starts are many, not all.
        """
        found = np.full((len(Ts_base_flange), BRANCHES, JOINTS), np.nan)
        _follow(*_split(Ts_base_flange), self._axes, self._starts, found)
        return found

    def refined(self, Ts_base_flange: FloatArray, joints: FloatArray) -> FloatArray:
        """Return the solutions to which iteration leads from given joint angles.

        Args:
            Ts_base_flange: (k, 4, 4) poses of the flange [mm].
            joints: (k, 6) where to start [rad].

        Returns:
            (k, 6) angles [rad] in (-pi, pi]; NaN where the iteration does not converge.
        """
        found = joints.astype(np.float64)
        for angles, rotation, place in zip(found, *_split(Ts_base_flange), strict=True):
            if not _iterate(angles, rotation, place, self._axes):
                angles[:] = np.nan
        return found

    def singularity_distances(self, joints: FloatArray) -> FloatArray:
        """Return the three quantities whose signs tell the branches apart.

        Args:
            joints: (k, 6) [rad].

        Returns:
            (k, 3): how far the wrist lies ahead of axis 1 in the plane of the arm [mm]; the angle by which the elbow is
            bent; the angle from axis 4 to axis 6 [rad], both in (-pi, pi].
        """
        distances = np.empty((len(joints), 3))
        for row, angles in enumerate(np.ascontiguousarray(joints)):
            _sides(angles, self._axes, distances[row])
        return distances

    def wrist_distances(self, Ts_base_flange: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (k,) distances of the flange from the shoulder and (2,) bounds that none exceeds [mm]."""
        away = np.linalg.norm(Ts_base_flange[:, :3, 3] - self.shoulder, axis=1)
        return away, np.array([0.0, self.reach])


def _split(Ts: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.ascontiguousarray(Ts[:, :3, :3]), np.ascontiguousarray(Ts[:, :3, 3])


@njit
def _follow(rotations: FloatArray, places: FloatArray, axes: _Axes, starts: FloatArray, found: FloatArray) -> None:
    """Fill (k, 8, 6) solutions: from the row before, from the starts, and at last from the row after."""
    rows = places.shape[0]
    for k in range(rows):
        near = False
        if k > 0:
            _add(found[k - 1], rotations[k], places[k], axes, found[k])
            moved = np.abs(places[k] - places[k - 1]).max() / axes.scale
            near = max(moved, np.abs(rotations[k] - rotations[k - 1]).max()) < NEAR
        if not near or k % FRESH == 0:
            _add(starts, rotations[k], places[k], axes, found[k])
    for k in range(rows - 2, -1, -1):
        _add(found[k + 1], rotations[k], places[k], axes, found[k])


@njit
def _add(starts: FloatArray, rotation: FloatArray, place: FloatArray, axes: _Axes, found: FloatArray) -> None:
    """Iterate from each start and keep what has a number that is still free in (8, 6) found."""
    angles, sides = np.empty(6), np.empty(3)
    for s in range(starts.shape[0]):
        if not np.isnan(found[:, 0]).any():
            return
        if np.isnan(starts[s, 0]):
            continue
        angles[:] = starts[s]
        if _iterate(angles, rotation, place, axes):
            _sides(angles, axes, sides)
            branch = 4 * int(sides[2] < 0.0) + 2 * int(sides[0] < 0.0) + int(sides[1] < 0.0)
            if np.isnan(found[branch, 0]):
                found[branch] = angles


@njit
def _iterate(angles: FloatArray, rotation: FloatArray, place: FloatArray, axes: _Axes) -> bool:
    """Move (6,) angles by damped least squares until the flange is at a pose; say whether it got there."""
    directions, points = np.empty((6, 3)), np.empty((6, 3))
    miss, slope = np.empty(6), np.empty((6, 6))
    for _ in range(MOST_ITERATIONS):
        R, t = _forward(angles, axes, directions, points)
        at = R @ axes.place + t
        miss[:3] = (place - at) / axes.scale
        miss[3:] = _turn(rotation @ np.ascontiguousarray((R @ axes.rotation).T))
        if np.abs(miss).max() < CONVERGED:
            angles[:] = np.pi - (np.pi - angles) % (2.0 * np.pi)
            return True
        for joint in range(6):
            slope[joint, :3] = np.cross(directions[joint], at - points[joint]) / axes.scale
            slope[joint, 3:] = directions[joint]
        damping = DAMPING * (miss @ miss) + LEAST_DAMPING
        squared = np.ascontiguousarray(slope.T) @ slope + damping * np.eye(6)
        step = slope @ np.linalg.solve(squared, miss)
        angles += step * min(1.0, LARGEST_STEP / np.abs(step).max())
    return False


@njit
def _forward(
    angles: FloatArray, axes: _Axes, directions: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Fill (6, 3) directions and points of the turned axes; return rotation and shift of the last link."""
    rotation, shift = np.eye(3), np.zeros(3)
    for joint in range(6):
        directions[joint] = rotation @ axes.directions[joint]
        points[joint] = rotation @ axes.points[joint] + shift
        rotation = _rotation(directions[joint], angles[joint]) @ rotation
        shift = points[joint] - rotation @ axes.points[joint]
    return rotation, shift


@njit
def _rotation(axis: FloatArray, angle: float) -> FloatArray:
    """Return the (3, 3) rotation about a unit vector, by the formula of Rodrigues."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)


@njit
def _turn(R: FloatArray) -> FloatArray:
    """Return the (3,) rotation vector of a rotation; about no particular axis where it is a half turn."""
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    sine, cosine = np.sqrt(vector @ vector), (np.trace(R) - 1.0) / 2.0
    if sine > 0.0:
        return vector * (np.arctan2(sine, cosine) / sine)
    return vector if cosine > 0.0 else np.array([np.pi, 0.0, 0.0])


@njit
def _sides(angles: FloatArray, axes: _Axes, sides: FloatArray) -> None:
    """Fill (3,) with the quantities of `NumericInverse.singularity_distances`."""
    directions, points = np.empty((6, 3)), np.empty((6, 3))
    _forward(angles, axes, directions, points)
    # The marks lie on axes 4 and 5, so that joints 4 and 5 leave them where joints 1 to 3, or 4, have put them.
    elbow = points[3] + directions[3] * ((axes.marks[0] - axes.points[3]) @ axes.directions[3])
    wrist = points[4] + directions[4] * ((axes.marks[1] - axes.points[4]) @ axes.directions[4])
    ahead = np.cross(directions[1], directions[0])
    sides[0] = (wrist - points[0]) @ ahead / max(np.sqrt(ahead @ ahead), TINY)
    lower, fore = points[2] - points[1], elbow - points[2]
    lower = lower - (lower @ directions[1]) * directions[1]
    sides[1] = np.arctan2(np.cross(lower, fore) @ directions[1], lower @ fore)
    sides[2] = np.arctan2(np.cross(directions[3], directions[5]) @ directions[4], directions[3] @ directions[5])
