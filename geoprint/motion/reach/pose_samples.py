"""Poses of a stream and places on the straight moves between them, where the arm has to follow."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, frozen

# Between poses farther apart than this [mm, rad] the straight move is sampled in between.
STEP = 2.0
TURN_STEP = float(np.radians(1.0))
# Over so much of the tip's path it is asked how much longer or shorter the bead is [mm].
BEAD_WINDOW = 1.0


@final
@frozen
class PoseSamples:
    """Poses and places on the straight moves between them: s samples of p poses.

    Attributes:
        Ts_base_tool: (s, 4, 4) [mm], not turned about the nozzle.
        T_base_work: (4, 4).
        runs: (s,) run.
        deposit: (s,) whether material is laid on one side of the sample at least.
        starts: (p,) sample of each pose.
    """

    Ts_base_tool: FloatArray
    T_base_work: FloatArray
    runs: IntArray
    deposit: BoolArray
    starts: IntArray


def tool_poses(poses: PoseStream, *, T_base_work: FloatArray) -> FloatArray:
    """Return (p, 4, 4) T_base_tool [mm] that a pose stream commands."""
    return T_base_work @ transforms.rigid(transforms.rotation_of(poses.quaternions), poses.tips)


def sample_poses(poses: PoseStream, *, T_base_work: FloatArray) -> PoseSamples:
    """Return the poses of a stream, of one pose at least, and places between those that lie far apart.

    Args:
        poses: p poses in the work frame.
        T_base_work: (4, 4) where the part stands [mm].

    Returns:
        The samples, in the order of motion.
    """
    commanded = tool_poses(poses, T_base_work=T_base_work)
    steps = np.maximum(np.ceil(np.maximum(tip_lengths(poses) / STEP, turns(poses) / TURN_STEP)), 1.0).astype(np.int64)
    starts = np.concatenate([[0], np.cumsum(steps)])
    rows = np.repeat(np.arange(poses.count - 1), steps)
    shares = (np.arange(rows.size) - starts[rows]) / steps[rows]
    Ts_base_tool = commanded[np.append(rows, poses.count - 1)]
    inner = np.flatnonzero(shares > 0.0)
    before = rows[inner]
    Ts_base_tool[inner] = transforms.interpolate_poses(commanded[before], commanded[before + 1], shares[inner])
    laid = poses.deposit.copy()
    laid[1:] |= poses.deposit[:-1] & (poses.runs[1:] == poses.runs[:-1])
    inside = np.where(shares > 0.0, poses.deposit[rows] & laid[rows + 1], laid[rows])
    return PoseSamples(
        Ts_base_tool=Ts_base_tool,
        T_base_work=T_base_work,
        runs=np.concatenate([poses.runs[rows], poses.runs[-1:]]),
        deposit=np.concatenate([inside, laid[-1:]]),
        starts=starts,
    )


def keyframes(Ts_base_tool: FloatArray, *, count: int) -> IntArray:
    """Return ascending rows of poses: `count` taken evenly, and those that reach farthest and lean most.

    Farthest and most are meant along each axis of the base frame.
    """
    total = len(Ts_base_tool)
    evenly = np.linspace(0, total - 1, min(total, count)).round().astype(np.int64)
    columns = np.hstack([Ts_base_tool[:, :3, 3], Ts_base_tool[:, :3, 2]])
    return np.unique(np.concatenate([evenly, columns.argmin(axis=0), columns.argmax(axis=0)]))


def tip_lengths(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) lengths of the tip's straight steps [mm]."""
    return np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)


def bead_steps(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) lengths that the steps of the tip have on the surface [mm]; on travel those of the tip.

    The tip goes farther than its bead over a bulge, and less far in a hollow. How much is taken over a millimetre about
    each step: the normals of triangles jump from step to step, and a speed must not.
    """
    steps, beads = tip_lengths(poses), poses.bead_lengths
    found = steps.copy()
    laid = poses.laid
    edges = np.flatnonzero(np.diff(np.concatenate([[False], laid, [False]]).astype(np.int8)))
    for first, last in edges.reshape(-1, 2).tolist():
        passed, left = (np.append(0.0, np.cumsum(each[first:last])) for each in (steps, beads))
        middles = (passed[1:] + passed[:-1]) / 2.0
        low, high = np.maximum(middles - BEAD_WINDOW / 2.0, 0.0), np.minimum(middles + BEAD_WINDOW / 2.0, passed[-1])
        moved = high > low
        share = np.interp(high, passed, left) - np.interp(low, passed, left)
        found[first:last] *= np.divide(share, high - low, out=np.ones_like(share), where=moved)
    return found


def turns(poses: PoseStream) -> FloatArray:
    """Return the (p - 1,) angles by which the tool turns [rad]; exact for small ones too."""
    quaternions = poses.quaternions
    apart = np.linalg.norm(np.diff(quaternions, axis=0), axis=1)
    opposite = np.linalg.norm(quaternions[1:] + quaternions[:-1], axis=1)
    return 4.0 * np.arcsin(np.minimum(apart, opposite) / 2.0)
