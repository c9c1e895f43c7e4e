"""The directions of the part that a table can bring up, and which of them are admissible for a stretch of deposit."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias, final

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import LimitError
from geoprint.model import FloatArray
from geoprint.motion.tilting.caps import ANGLE_TOLERANCE, common_direction, first_common
from geoprint.transforms import angles_between

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
