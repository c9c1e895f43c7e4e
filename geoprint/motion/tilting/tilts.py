"""When a tilting table takes which attitude: the longest stretches of a deposit that do not overhang.

A direction u of the part may point up while a surface with the outward normal n is printed where both are within the
critical angle c: u lies in the cap of half-angle c about n, and for a stretch of the deposit in the intersection of all
its caps. The paper's rule takes the attitude that carries the deposit farthest before it overhangs, then the next.

**No other choice of attitudes moves the table less.** Let a stretch be feasible where one direction that the table can
bring up is in all its caps; then every part of it is feasible, as fewer caps share no less. A stretch that ends with
pose e is followed by one that starts with s(e): with e itself, where the run goes on and e and e + 1 are feasible
together, so that what is laid between them has one attitude that admits both ends; else with e + 1. s never falls:
s(e) <= e + 1 <= s(e + 1). Compare the rule with any other cuts. Its first stretch ends at or behind theirs, being the
longest. And if its k-th ends at or behind their k-th, its next one starts at or behind theirs, so that up to the end of
theirs it is a part of theirs and feasible: the longest one ends no earlier. So it is never behind, and done no later.

From this follows that no stretch, however short, can be joined to a neighbour and stay feasible: one stretch fewer
would do. The least number of stretches is the number of moves, the first from rest included.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray, freeze_arrays, frozen
from geoprint.motion.tilting.caps import ANGLE_TOLERANCE
from geoprint.motion.tilting.ranges import UpRange
from geoprint.transforms import angles_between

# Halvings that find the largest slack: to 2e-4 of the critical angle and of the table's limits.
SLACK_HALVINGS = 12


@final
@frozen
class Tilts:
    """The attitudes of a table along a deposit of n poses, in s stretches.

    Attributes:
        starts: (s,) first pose of each stretch; it is the last of the one before where a run goes on through both.
        ends: (s,) pose behind the last.
        ups: (s, 3) unit direction of the part that points up.
        slacks: (s,) share that is left of the critical angle, and of the table's limits where less of these is; of
            what overhangs whatever the table does, of the angle to which it is led.
        angles: (n,) of overhang of each pose in the stretch that lays what leads to it [rad].
        missing: (n,) by how much each pose overhangs whatever the table does; 0 where the table can prevent it [rad].
    """

    starts: IntArray
    ends: IntArray
    ups: FloatArray
    slacks: FloatArray
    angles: FloatArray
    missing: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, starts="int: s", ends="int: s", ups="float: s 3", slacks="float: s",
            angles="float: n", missing="float: n",
        )  # fmt: skip

    @property
    def moves(self) -> int:
        """How often the table takes an attitude, the first from rest included."""
        return int(self.starts.size)

    @property
    def pose_ups(self) -> FloatArray:
        """(n, 3) direction that points up at each pose, in the stretch that lays what leads to it."""
        return _at_poses(self.ups, self.ends)


@final
@dataclass(frozen=True, slots=True)
class _Tilt:
    """Poses from first to before behind, with the direction that points up and the slack of it."""

    first: int
    behind: int
    up: FloatArray
    slack: float


def tilted(normals: FloatArray, *, runs: IntArray, within: UpRange) -> Tilts:
    """Choose the attitudes of a table along a deposit, with the fewest moves for its order.

    A stretch may end anywhere in a run: the bead is interrupted, and goes on in the next one. A pose that overhangs
    whatever the table does is printed where it misses least, up to 1 degree more, and its least missing angle is
    listed. Of the admissible directions of a stretch the one is taken at which most is left: the smaller of the angle
    left to the critical one over that, and the table's margin; both are shares, of which one is as dear as the other.

    Args:
        normals: (n, 3) outward unit normals of the deposited poses, in the order of printing.
        runs: (n,) run of each, not falling within a run's poses.
        within: what the table can bring up, with the critical angle.

    Raises:
        InputError: there is no pose, or the arrays differ in length.
    """
    if not len(normals) or len(normals) != len(runs):
        raise InputError(
            f"a table tilts along poses with a normal and a run each, found {len(normals)} and {len(runs)}: give those "
            "that deposit."
        )
    nearest = within.nearest(normals)
    aims = within.aims(normals, nearest)
    missing = np.maximum(angles_between(normals, nearest) - within.critical, 0.0)
    stretches: list[_Tilt] = []
    while not stretches or stretches[-1].behind < len(normals):
        stretches.append(_next(stretches[-1:], aims, nearest, runs, within=within))
    ends = np.array([each.behind for each in stretches])
    ups = np.stack([each.up for each in stretches])
    return Tilts(
        np.array([each.first for each in stretches]), ends, ups,
        slacks=np.array([each.slack for each in stretches]),
        angles=angles_between(normals, _at_poses(ups, ends)),
        missing=np.where(missing > ANGLE_TOLERANCE, missing, 0.0),
    )  # fmt: skip


def longest(first: int, aims: FloatArray, *, within: UpRange) -> int:
    """Return the pose behind the longest feasible stretch from one on, found by doubling and halving.

    Args:
        first: its first pose, feasible by itself.
        aims: (n, 3) as `UpRange.aims` returns them.
        within: what the table can bring up.
    """
    low, step = first + 1, 1
    while low < len(aims) and len(within.admissible(aims[first : min(low + step, len(aims))])):
        low, step = min(low + step, len(aims)), 2 * step
    high = min(low + step, len(aims) + 1)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if len(within.admissible(aims[first:middle])) else (low, middle)
    return low


def _next(before: list[_Tilt], aims: FloatArray, nearest: FloatArray, runs: IntArray, *, within: UpRange) -> _Tilt:
    """Return the stretch behind the last one; it shares that one's last pose where their run goes on, if it can."""
    first = before[0].behind if before else 0
    if before and runs[first] == runs[first - 1] and len(within.admissible(aims[first - 1 : first + 1])):
        first -= 1
    behind = longest(first, aims, within=within)
    up, slack = roomiest(aims[first:behind], nearest[first], within=within)
    return _Tilt(first, behind, up, slack)


def roomiest(aims: FloatArray, single: FloatArray, *, within: UpRange) -> tuple[FloatArray, float]:
    """Return the admissible direction of a feasible stretch with the largest slack, and that.

    Args:
        aims: (k, 3) of its poses.
        single: (3,) direction of its first pose alone, which stands in where the stretch is that pose.
        within: what the table can bring up.
    """
    found = within.admissible(aims)
    up = found[0] if len(found) else single
    low, high = 0.0, 1.0
    for _ in range(SLACK_HALVINGS):
        middle = 0.5 * (low + high)
        found = within.admissible(aims, slack=middle)
        if len(found):
            up, low = found[0], middle
        else:
            high = middle
    return up, low


def _at_poses(ups: FloatArray, ends: IntArray) -> FloatArray:
    """Return the (n, 3) direction that points up at each pose; one that stretches share is of the first."""
    return np.repeat(ups, np.diff(ends, prepend=0), axis=0)
