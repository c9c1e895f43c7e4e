"""Attitudes of a table: few directions of the part that admit everything, and which stretch is printed in which."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise
from math import acos, atan2, cos, pi, sin, sqrt, tan
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from geoprint.errors import InputError, LimitError
from geoprint.kernels import njit
from geoprint.model import BoolArray, FloatArray, IntArray, freeze_arrays, frozen
from geoprint.transforms import angles_between

# Where spherical caps of one size meet: the common direction that is nearest to a given one.
#
# Caps of less than a quarter turn are convex, and so is what they share. The caps are taken one after the other;
# where the nearest direction so far lies outside the next one, the new one lies on that cap's border circle, as in
# linear programs of two variables [Seidel1991]. On the circle each other cap leaves an arc of at most half a turn,
# so that what all of them leave is one arc again, or nothing. In an order that jumps about this takes a time that
# grows as the number of caps.


# Caps are wider by this [rad]: those that only touch, as a table of one angle makes them, still meet.
ANGLE_TOLERANCE = 1e-9
# Steps through a list with which it is taken in an order that jumps about: a prime number near 2**32 over the golden
# ratio, which no list is long enough to be a multiple of.
STRIDE = 2_654_435_761


def common_direction(centres: FloatArray, *, half_angle: float, start: FloatArray) -> FloatArray:
    """Return the direction within all caps that is nearest to a given one.

    Args:
        centres: (k, 3) unit vectors, at least one.
        half_angle: of each cap, in (0, pi / 2) [rad].
        start: (3,) unit vector.

    Returns:
        (1, 3) the unit vector, or (0, 3) where the caps share nothing. It is in all caps whatever the start is, and
        the nearest to the start where it is within a quarter turn of it.
    """
    order = np.arange(len(centres)) * STRIDE % len(centres)
    found, direction = nearest_common(centres[order], half_angle + ANGLE_TOLERANCE, start)
    return direction[None] if found else np.empty((0, 3))


@njit
def nearest_common(centres: FloatArray, half_angle: float, start: FloatArray) -> tuple[bool, FloatArray]:
    """Return whether caps about (k, 3) centres share a direction, and the (3,) one that is nearest to the start."""
    cosine, sine, cotangent = cos(half_angle), sin(half_angle), 1.0 / tan(half_angle)
    best = start.copy()
    for i in range(len(centres)):
        n = centres[i]
        if n[0] * best[0] + n[1] * best[1] + n[2] * best[2] >= cosine:
            continue
        aside = np.cross(n, start)
        length = sqrt(aside[0] ** 2 + aside[1] ** 2 + aside[2] ** 2)
        if length < ANGLE_TOLERANCE:
            # The start is opposite, or the centre itself: every point of the circle is as near.
            aside = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
            length = sqrt(aside[0] ** 2 + aside[1] ** 2 + aside[2] ** 2)
        across = aside / length
        towards = np.cross(across, n)
        low, high = -pi, pi
        bounded = False
        middle = 0.0
        for j in range(i):
            m = centres[j]
            x = m[0] * towards[0] + m[1] * towards[1] + m[2] * towards[2]
            y = m[0] * across[0] + m[1] * across[1] + m[2] * across[2]
            along = m[0] * n[0] + m[1] * n[1] + m[2] * n[2]
            aside_of = sqrt(x * x + y * y)
            if aside_of < ANGLE_TOLERANCE and along > 0.0:
                continue
            # The tangent of half the angle between both centres, over that of the caps.
            ratio = cotangent * aside_of / (1.0 + along) if along > -1.0 else 2.0
            if ratio > 1.0:
                return False, best
            half, at = acos(ratio), atan2(y, x)
            if not bounded:
                bounded, middle, low, high = True, at, -half, half
                continue
            # Angles from the middle of the first arc, which is half a turn at most, in (-pi, pi].
            off = (at - middle + pi) % (2.0 * pi) - pi
            low, high = max(low, off - half), min(high, off + half)
            if low > high:
                return False, best
        # The start lies in the direction of angle 0.
        nearest = (-middle + pi) % (2.0 * pi) - pi
        angle = nearest
        if nearest < low or nearest > high:
            before, behind = (low - nearest) % (2.0 * pi), (nearest - high) % (2.0 * pi)
            angle = low if before < behind else high
        angle += middle
        best = cosine * n + sine * (cos(angle) * towards + sin(angle) * across)
    return True, best


@njit
def first_common(directions: FloatArray, centres: FloatArray, half_angle: float) -> int:
    """Return the first of (n, 3) directions that is within caps about all of (k, 3) centres; -1 where none is."""
    cosine = cos(half_angle)
    for i in range(len(directions)):
        u, inside = directions[i], True
        for j in range(len(centres)):
            n = centres[j]
            if n[0] * u[0] + n[1] * u[1] + n[2] * u[2] < cosine:
                inside = False
                break
        if inside:
            return i
    return -1


# The directions of the part that a table can bring up, and which of them are admissible for a stretch of deposit.


# (n, 3) unit directions of the part that shall point up -> (n,) share that is left of the table's limits, 1 where all
# is left, negative where it cannot bring them up.
Margins: TypeAlias = Callable[[FloatArray], FloatArray]

# Directions that are tried all over the sphere: 1.1 degrees from one to the next.
DIRECTIONS = 40_000
# Normals that directions are compared with at a time: these are few behind the first.
NORMALS_AT_ONCE = 200
# Margins are met up to this share: they are worked out in floating point.
MARGIN_TOLERANCE = 1e-9
# Halvings that find how far the table comes towards a direction: to 1e-6 of the angle, far finer than a table repeats.
HALVINGS = 20
# A pose that overhangs whatever the table does may miss by so much more than the least, so that its neighbours share
# its attitude of the table: tables repeat to hundredths, and no material's angle is known to a degree [rad].
GIVE = np.radians(1.0)


@final
class UpRange:
    """Answers which directions of the part may point up, of those that a table can bring up.

    Whether caps share a direction at all is decided exactly. One that the table can bring up is sought at that nearest
    to rest, then anywhere among all, and then on a grid. So the answer is exact, to 1e-9 rad, where the margin falls
    with the angle from rest alone and the range ends within 90 degrees of it, as a cone about rest does. For any other
    range, what is found always holds, but a spot between the grid's directions, 1.1 degrees apart, can be missed.

    Args:
        margins: of the table.
        rest: (3,) unit direction of the part that points up while the table rests.
        critical: angle of overhang, in (0, pi / 2) [rad].
        least: margin that is wanted, 0 or more.

    Raises:
        LimitError: the table has no margin at rest, nor anywhere else.
    """

    def __init__(self, margins: Margins, *, rest: FloatArray, critical: float, least: float = 0.0) -> None:
        self.critical, self.least, self._margins, self._rest = critical, least - MARGIN_TOLERANCE, margins, rest
        tried = np.concatenate([rest[None], _sphere(DIRECTIONS)])
        found = margins(tried)
        order = np.argsort(-found, kind="stable")
        self._grid = tried[order[: int((found >= self.least).sum())]]
        self._grid_margins = found[order[: len(self._grid)]]
        if not len(self._grid):
            raise LimitError(
                f"the table brings no direction of the part up with a margin of {least:g}, the most is "
                f"{found.max():.3g}: allow less, or place the part otherwise.",
                margin=float(found.max()),
            )

    @property
    def directions(self) -> FloatArray:
        """(g, 3) directions all over what the table can bring up, 1.1 degrees apart, those with most margin first."""
        return self._grid

    def admissible(self, normals: FloatArray, *, slack: float = 0.0) -> FloatArray:
        """Return a direction that may point up while a surface with these normals is printed.

        Args:
            normals: (k, 3) outward unit normals.
            slack: share of the critical angle that is to be left, and of the table's limits, in [0, 1).

        Returns:
            (1, 3) the direction, or (0, 3) where there is none.
        """
        half_angle, least = (1.0 - slack) * self.critical, max(self.least, slack)
        anywhere = common_direction(normals, half_angle=half_angle, start=normals[0])
        if not len(anywhere):
            return anywhere
        near = common_direction(normals, half_angle=half_angle, start=self._rest)
        for tried in (near, anywhere):
            if float(self._margins(tried)[0]) >= least:
                return tried
        within = self._grid[: int(np.searchsorted(-self._grid_margins, -least, side="right"))]
        at = first_common(within, normals, half_angle + ANGLE_TOLERANCE)
        return within[at : at + 1] if at >= 0 else np.empty((0, 3))

    @property
    def rest(self) -> FloatArray:
        """(3,) unit direction of the part that points up while the table rests."""
        return self._rest

    def admitting(self, normals: FloatArray) -> FloatArray:
        """Return the (a, 3) of `directions` within the critical angle of all of (k, 3) normals, most margin first."""
        left = self._grid
        for rows in np.array_split(normals, max(len(normals) // NORMALS_AT_ONCE, 1)):
            left = left[(left @ rows.T >= np.cos(self.critical + ANGLE_TOLERANCE)).all(axis=1)]
        return left

    def slack(self, up: FloatArray, normals: FloatArray) -> float:
        """Return the share that a (3,) direction leaves of the critical angle of (k, 3) normals, or of the table.

        The smaller of both counts; it is negative where one is passed.
        """
        angle = float(angles_between(normals, up).max())
        return min(1.0 - angle / self.critical, float(self._margins(up[None])[0]))

    def nearest(self, normals: FloatArray) -> FloatArray:
        """Return the (n, 3) directions that the table can bring up at which (n, 3) normals overhang least.

        A normal within the critical angle of one that can be brought up gets one of those, near rest.
        """
        near = _turned(normals, self._rest, by=np.full(len(normals), self.critical))
        lacking = np.flatnonzero(self._margins(near) < self.least)
        if not lacking.size:
            return near
        wanted = normals[lacking]
        ups = self._grid[np.asarray(KDTree(self._grid).query(wanted)[1])]
        far = np.flatnonzero(angles_between(ups, wanted) > self.critical)
        if far.size:
            along = self._farthest(wanted[far])
            nearer = angles_between(along, wanted[far]) < angles_between(ups[far], wanted[far])
            ups[far[nearer]] = along[nearer]
        near[lacking] = ups
        return near

    def aims(self, normals: FloatArray, ups: FloatArray) -> FloatArray:
        """Return the (n, 3) normals with those that overhang at their nearest directions led towards these.

        A direction within the critical angle of what is returned is within that of the normal, or misses by at most
        `GIVE` more than the least.

        Args:
            normals: (n, 3).
            ups: as `nearest` returns them.
        """
        missing = angles_between(normals, ups) > self.critical + ANGLE_TOLERANCE
        led = _turned(ups, normals, by=np.full(len(ups), max(self.critical - GIVE, 0.5 * self.critical)))
        return np.where(missing[:, None], led, normals)

    def _farthest(self, normals: FloatArray) -> FloatArray:
        """Return how far the table comes from rest towards (n, 3) normals, where it can rest; else where it stands."""
        low, high = np.zeros(len(normals)), angles_between(normals, self._rest[None])
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            serves = self._margins(_turned(self._rest[None], normals, by=middle)) >= self.least
            low, high = np.where(serves, middle, low), np.where(serves, high, middle)
        found = _turned(self._rest[None], normals, by=low)
        return np.where((self._margins(found) >= self.least)[:, None], found, self._grid[:1])


def _turned(starts: FloatArray, ends: FloatArray, *, by: FloatArray) -> FloatArray:
    """Return (n, 3) directions led from starts towards ends by (n,) angles [rad], no farther than there."""
    starts, ends = np.broadcast_arrays(starts, ends)
    angles = angles_between(starts, ends)
    aside = ends - np.sum(starts * ends, axis=1, keepdims=True) * starts
    length = np.linalg.norm(aside, axis=1, keepdims=True)
    aside = np.where(length > ANGLE_TOLERANCE, aside / np.maximum(length, ANGLE_TOLERANCE), _normal_to(starts))
    led = np.minimum(by, angles)[:, None]
    return np.where(by[:, None] >= angles[:, None], ends, np.cos(led) * starts + np.sin(led) * aside)


def _normal_to(directions: FloatArray) -> FloatArray:
    """Return (n, 3) unit vectors normal to others: where an end is opposite to its start any will do."""
    helper = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
    aside = np.cross(directions, helper)
    return aside / np.linalg.norm(aside, axis=1, keepdims=True)


def _sphere(count: int) -> FloatArray:
    """Return (count, 3) unit vectors all over the sphere, evenly, on a spiral of golden angles [Swinbank2006]."""
    ranks = np.arange(count) + 0.5
    heights, turns = 1.0 - 2.0 * ranks / count, np.pi * (1.0 + np.sqrt(5.0)) * ranks
    radii = np.sqrt(1.0 - heights**2)
    return np.column_stack([radii * np.cos(turns), radii * np.sin(turns), heights])


# Few directions of the part that together admit everything that is printed: a set cover, found by a heuristic.
#
# Nobody finds the fewest exactly in reasonable time. Greedily the direction is taken that admits the most length of
# what is left [Chvatal1979]. Then, as long as it helps, one that the others make needless is left out, or one is put
# in place of two: whether any direction admits all that only these two admit is decided by `UpRange.admissible`.


# Zeros and ones, and lengths that are only compared.
Shares: TypeAlias = NDArray[np.float32]
# Poses and directions that the cover is chosen by at first; poses that it leaves out join them, some at a time.
SAMPLED_POSES = 1500
SAMPLED_UPS = 2000
JOINING = 100
# Directions are admitted up to this: they are worked out in floating point [cosine].
ADMITTED = 1e-9


def covering(
    aims: FloatArray, nearest: FloatArray, lengths: FloatArray, *, within: UpRange, starts: FloatArray | None = None
) -> FloatArray:
    """Return (t, 3) directions of which one at least admits each pose, with the start of the step to it if one can.

    Args:
        aims: (n, 3) as `UpRange.aims` returns them.
        nearest: (n, 3) directions that admit these, as `UpRange.nearest` returns them.
        lengths: (n,) of path that each stands for [mm].
        within: what the table can bring up.
        starts: (n, 3) aims of the pose at which the step to each begins, its own where a run does; those of the poses
            without it, so that steps do not count.
    """
    taken, starts = _greedily(aims, aims if starts is None else starts, nearest, lengths, within=within)
    return fewer(taken, aims, starts, within=within)


def fewer(taken: FloatArray, aims: FloatArray, starts: FloatArray, *, within: UpRange) -> FloatArray:
    """Return as many or fewer directions that admit all that (t, 3) do: no other is needless, and no two are one.

    Args:
        taken: of which one at least admits each pose and the start of the step to it.
        aims: (n, 3) of the poses.
        starts: (n, 3) of the starts of the steps to them.
        within: what the table can bring up.
    """
    while True:
        better = next(_better(taken, aims, starts, within=within), taken)
        if len(better) == len(taken):
            return taken
        taken = better


def admitted(ups: FloatArray, aims: FloatArray, *, within: UpRange) -> BoolArray:
    """Return (d, n) whether each of (d, 3) directions admits each of n poses."""
    return ups @ aims.T >= np.cos(within.critical) - ADMITTED


def _steps(ups: FloatArray, aims: FloatArray, starts: FloatArray, *, within: UpRange) -> BoolArray:
    return admitted(ups, aims, within=within) & admitted(ups, starts, within=within)


def _better(taken: FloatArray, aims: FloatArray, starts: FloatArray, *, within: UpRange) -> Iterator[FloatArray]:
    """Yield what admits all that (t, 3) directions do with one fewer: without one, or with one in place of two."""
    admits = _steps(taken, aims, starts, within=within)
    counts = admits.sum(axis=0)
    for row in np.argsort(admits.sum(axis=1), kind="stable").tolist():
        if (counts > admits[row]).all():
            yield np.delete(taken, row, axis=0)
    for pair in combinations(range(len(taken)), 2):
        only = counts == admits[list(pair)].sum(axis=0)
        alone = np.vstack([aims[only], starts[only]])
        found = within.admissible(alone)
        if len(found) and admitted(found, alone, within=within).all():
            yield np.vstack([np.delete(taken, pair, axis=0), found])


def _greedily(
    aims: FloatArray, starts: FloatArray, nearest: FloatArray, lengths: FloatArray, *, within: UpRange
) -> tuple[FloatArray, FloatArray]:
    """Return directions that admit every step, and the starts: the end instead where nothing admits both."""
    starts = starts.copy()
    rows = np.arange(0, len(aims), max(1, len(aims) // SAMPLED_POSES))
    some = within.directions[:: max(1, len(within.directions) // SAMPLED_UPS)]
    while True:
        # What no direction of these may admit is admitted by the nearest of its own, or by one of both ends.
        choices = np.vstack([some, nearest[rows]])
        for row in rows[~_steps(choices, aims[rows], starts[rows], within=within).any(axis=0)].tolist():
            ends = np.stack([aims[row], starts[row]])
            found = within.admissible(ends)
            if len(found) and admitted(found, ends, within=within).all():
                choices = np.vstack([choices, found])
            else:
                starts[row] = aims[row]
        admits = _steps(choices, aims[rows], starts[rows], within=within)
        taken = choices[_greedy(admits.astype(np.float32), lengths[rows].astype(np.float32))]
        missed = np.flatnonzero(~_steps(taken, aims, starts, within=within).any(axis=0))
        if not missed.size:
            return taken, starts
        rows = np.union1d(rows, missed[:: max(1, len(missed) // JOINING)])


def _greedy(admits: Shares, weights: Shares) -> IntArray:
    """Return rows of (d, n) that together admit every column, the one with the most weight left first."""
    left, taken = np.maximum(weights, np.finfo(np.float32).tiny), list[int]()
    while left.any():
        taken.append(int((admits @ left).argmax()))
        left = np.where(admits[taken[-1]] > 0.0, np.float32(0.0), left)
    return np.array(taken, dtype=np.int64)


# When a tilting table takes which attitude: the longest stretches of a deposit that do not overhang.
#
# A direction u of the part may point up while a surface with the outward normal n is printed where both are within
# the critical angle c: u lies in the cap of half-angle c about n, and for a stretch of the deposit in the
# intersection of all its caps. The paper's rule takes the attitude that carries the deposit farthest before it
# overhangs, then the next.
#
# **No other choice of attitudes moves the table less.** Let a stretch be feasible where one direction that the table
# can bring up is in all its caps; then every part of it is feasible, as fewer caps share no less. A stretch that
# ends with pose e is followed by one that starts with s(e): with e itself, where the run goes on and e and e + 1 are
# feasible together, so that what is deposited between them has one attitude that admits both ends; else with e + 1. s
# never falls: s(e) <= e + 1 <= s(e + 1). Compare the rule with any other cuts. Its first stretch ends at or behind
# theirs, being the longest. And if its k-th ends at or behind their k-th, its next one starts at or behind theirs,
# so that up to the end of theirs it is a part of theirs and feasible: the longest one ends no earlier. So it is
# never behind, and done no later.
#
# From this follows that no stretch, however short, can be joined to a neighbour and stay feasible: one stretch fewer
# would do. The least number of stretches is the number of moves, the first from rest included.


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
        angles: (n,) of overhang of each pose in the stretch that deposits what leads to it [rad].
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
        """(n, 3) direction that points up at each pose, in the stretch that deposits what leads to it."""
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


# What one attitude of the table admits is printed in it, of whichever run it is: far fewer moves, in another order.
#
# A heuristic. Few directions that admit everything are chosen by `covering`. Then each run is divided among these,
# into as few pieces as they allow, which is exact by the argument of `tilts`. Within an attitude the pieces keep
# their order, and layers follow one another.


@final
@frozen
class Attitude:
    """One attitude of the table, and what is printed in it.

    Attributes:
        up: (3,) unit direction of the part that points up.
        slack: share that is left, as `Tilts.slacks`.
        pieces: (k, 2) first pose and pose behind the last of what is printed, each within one run, in this order. The
            last pose of a piece is the first of the one that goes on with its run.
    """

    up: FloatArray
    slack: float
    pieces: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, up="float: 3", pieces="int: k 2")


def attitudes_of(found: Tilts, runs: IntArray) -> tuple[Attitude, ...]:
    """Return the attitudes of tilts with what of each run is printed in them.

    Args:
        found: along a deposit.
        runs: (n,) run of each pose.
    """
    breaks = np.flatnonzero(np.diff(runs) != 0) + 1
    attitudes: list[Attitude] = []
    behind = 0
    for start, end, up, slack in zip(found.starts, found.ends, found.ups, found.slacks, strict=True):
        # Where no attitude admits both ends of a step, it is deposited in that of its end.
        first = start - (start == behind and start > 0 and runs[start] == runs[start - 1])
        edges = np.concatenate([[first], breaks[(breaks > first) & (breaks < end)], [end]])
        pieces = np.column_stack([edges[:-1], edges[1:]])
        attitudes.append(Attitude(up, float(slack), pieces[np.diff(pieces, axis=1)[:, 0] > 1]))
        behind = end
    return tuple(each for each in attitudes if len(each.pieces))


def gathered(
    normals: FloatArray, *, runs: IntArray, layers: IntArray, lengths: FloatArray, within: UpRange
) -> tuple[Attitude, ...]:
    """Choose attitudes of a table for a deposit whose pieces may be printed in any order within their layer.

    Args:
        normals: (n, 3) outward unit normals of the deposited poses.
        runs: (n,) run of each, not falling.
        layers: (n,) layer of each, not falling, the same along a run.
        lengths: (n,) of path that each stands for [mm].
        within: what the table can bring up, with the critical angle.

    Raises:
        InputError: there is no pose, or the arrays differ in length.
    """
    if not len(normals) or {len(normals)} != {len(runs), len(layers), len(lengths)}:
        raise InputError(
            f"a table tilts along poses with one normal, run, layer and length each, found {len(normals)}, "
            f"{len(runs)}, {len(layers)} and {len(lengths)}: give those that deposit."
        )
    nearest = within.nearest(normals)
    aims = within.aims(normals, nearest)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(layers) != 0) + 1, [len(normals)]])
    attitudes: list[Attitude] = []
    for first, behind in pairwise(edges.tolist()):
        rows = slice(first, behind)
        found = _layer(aims[rows], nearest[rows], runs[rows], lengths[rows], within=within)
        attitudes += [Attitude(one.up, one.slack, one.pieces + first) for one in found]
    return tuple(attitudes)


def _layer(
    aims: FloatArray, nearest: FloatArray, runs: IntArray, lengths: FloatArray, *, within: UpRange
) -> list[Attitude]:
    starts = np.concatenate([[0], np.flatnonzero(np.diff(runs) != 0) + 1])
    before = np.arange(len(aims)) - 1
    before[starts] = starts
    taken = covering(aims, nearest, lengths, within=within, starts=aims[before])
    admits = admitted(taken, aims, within=within)
    chosen = np.concatenate(
        [_divided(np.ascontiguousarray(admits[:, a:b])) for a, b in pairwise([*starts.tolist(), len(aims)])]
    )
    cuts = np.union1d(starts, np.flatnonzero(np.diff(chosen)) + 1)
    # What is laid from the last pose of a piece to the first of the next is laid by the piece, or by the next one where
    # that alone admits both.
    inner = ~np.isin(cuts, starts)
    taking = inner & ~admits[chosen[cuts - 1], cuts] & admits[chosen[cuts], cuts - 1]
    firsts, ends = cuts - taking, np.append(cuts[1:] + (inner & ~taking)[1:], len(aims))
    attitudes: list[Attitude] = []
    for number, up in enumerate(taken):
        # A pose alone deposits nothing: what leads to it is deposited by the piece before.
        own = np.flatnonzero((chosen[cuts] == number) & (ends - firsts > 1))
        if own.size:
            pieces = np.column_stack([firsts[own], ends[own]])
            along: list[IntArray] = [np.arange(first, end) for first, end in pieces]
            rows = np.unique(np.concatenate(along))
            at, slack = roomiest(aims[rows[admits[number, rows]]], up, within=within)
            attitudes.append(Attitude(at, slack, pieces))
    return sorted(attitudes, key=lambda each: int(each.pieces[0, 0]))


@njit
def _divided(admits: BoolArray) -> IntArray:
    """Return the (n,) row of (d, n) by which each column is admitted, with the fewest changes from column to column.

    A row that also admits the column before its first goes before one that does not: it takes the step from there.
    """
    rows, count = admits.shape
    chosen = np.empty(count, dtype=np.int64)
    place = 0
    while place < count:
        best, end, joined = 0, place, False
        for row in range(rows):
            behind = place
            while behind < count and admits[row, behind]:
                behind += 1
            joins = place > 0 and admits[row, place - 1]
            if behind > place and (joins > joined or (joins == joined and behind > end)):
                best, end, joined = row, behind, joins
        # Every column is admitted by a row, so that one is left behind each time.
        chosen[place:end] = best
        place = end
    return chosen
