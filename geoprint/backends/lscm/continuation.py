"""How a chart goes on beyond a cut: moved copies of itself, one on each side, and distances that do not see the cut.

A point of a band is nearest to the image of a seed that is at most half a round away. So each half of a chart needs
the copy at its own side of the cut alone, and of that copy the half behind the cut. Nothing else is compared: once a
chart turns far enough, other parts of its copies lie on top of it without being near it on the surface.
"""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.backends.lscm.segment_distance import point_distances
from geoprint.model import BoolArray, FloatArray, Surface, freeze_arrays, frozen


@final
@frozen
class Continuation:
    """The two sides of a cut in the plane, and the motion that carries the right one into the left one.

    Attributes:
        left: (s, 2) corners of the cut, the chart on their left [mm]; none where a chart is not cut.
        right: (s, 2) the same places of the surface on the other side, the chart on their right [mm].
        turn: angle of the motion [rad]: 2 pi for a plane ring, 0 for a cylinder.
        shift: (2,) its translation [mm], after the turn about the origin.
    """

    left: FloatArray
    right: FloatArray
    turn: float
    shift: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, left="float: s 2", right="float: s 2", shift="float: 2")

    @property
    def rounds(self) -> tuple[int, ...]:
        """The copies that continue the chart: 1 at the left side of the cut, -1 at the right; none without a cut."""
        return (1, -1) if len(self.left) else ()

    @property
    def sides(self) -> FloatArray:
        """The (2 s - 2, 2, 2) segments of both sides [mm]."""
        return np.concatenate([np.stack([side[:-1], side[1:]], axis=1) for side in (self.left, self.right)])

    def moved(self, points: FloatArray, *, rounds: int) -> FloatArray:
        """Carry places of the chart round the band.

        One round forward lays the right side of the cut on the left one, so that a moved chart continues this one
        there; one round back continues it on the right side.

        Args:
            points: (..., 2) places [mm].
            rounds: how often, counter-clockwise along the longest loop; negative for clockwise.

        Returns:
            (..., 2) places [mm].
        """
        z = points[..., 0] + 1j * points[..., 1]
        step, shift = np.exp(1j * self.turn), complex(*self.shift)
        for _ in range(abs(rounds)):
            z = step * z + shift if rounds > 0 else (z - shift) / step
        return np.stack([z.real, z.imag], axis=-1)

    @property
    def extremes(self) -> FloatArray:
        """The (2, 2, 2) pairs of left and right corners that bound where half a round from the cut is [mm].

        What is half a round from a corner is as far from its place on the left as from that on the right: a straight
        line through the centre of the motion, or across its shift. Half a round on from the middle of the cut these
        lines are compared; where the cut is not straight they differ.
        """
        half = np.exp(0.5j * self.turn)
        middle, shift = complex(*self.right.mean(axis=0)), complex(*self.shift)
        opposite = half * middle + shift / (1.0 + half)
        across = self.left - self.right
        places = np.array([opposite.real, opposite.imag]) - 0.5 * (self.left + self.right)
        beyond = (places * across).sum(axis=1) / np.linalg.norm(across, axis=1)
        corners = [int(np.argmin(beyond)), int(np.argmax(beyond))]
        return np.stack([self.left[corners], self.right[corners]], axis=1)

    def beside(self, x: FloatArray, y: FloatArray, *, rounds: int) -> BoolArray:
        """Tell which places [mm] can be nearer to something across a side of the cut than to all within the chart.

        They are the half of the chart at the side that a copy continues; where the cut is not straight, the halves
        overlap so that none is too small from any of its corners.
        """
        found = np.zeros(np.broadcast_shapes(x.shape, y.shape), dtype=np.bool_)
        for left, right in self.extremes:
            (across, up), (middle_x, middle_y) = left - right, 0.5 * (left + right)
            found |= ((x - middle_x) * across + (y - middle_y) * up) * rounds > 0.0
        return found

    def beyond(self, segments: FloatArray, *, rounds: int) -> FloatArray:
        """Return the (b, 2, 2) images in a copy of those segments [mm] that are within half a round of the cut."""
        behind = self.beside(segments[..., 0], segments[..., 1], rounds=-rounds).any(axis=1)
        return self.moved(segments[behind], rounds=rounds)

    def nearest_images(self, points: FloatArray, *, to: FloatArray) -> FloatArray:
        """Return, of each of (k, 2) places and its images in the copies, the one nearest to another place [mm]."""
        images = np.stack([points, *(self.moved(points, rounds=rounds) for rounds in self.rounds)])
        nearest = np.argmin(((images - to) ** 2).sum(axis=2), axis=0)
        return np.asarray(images[nearest, np.arange(len(points))])

    def distances(self, segments: FloatArray, points: FloatArray) -> FloatArray:
        """Return the (k,) straight distances of (k, 2) places of the chart to (s, 2, 2) segments and their images."""
        found = point_distances(segments, points)
        for rounds in self.rounds:
            images = self.beyond(segments, rounds=rounds)
            here = np.flatnonzero(self.beside(points[:, 0], points[:, 1], rounds=rounds))
            if len(images) and here.size:
                found[here] = np.minimum(found[here], point_distances(images, points[here]))
        return found


# Of a chart that was not cut.
UNCUT = Continuation(np.empty((0, 2)), np.empty((0, 2)), 0.0, np.zeros(2))


@final
@frozen
class Chart:
    """A surface in the plane, and how it goes on where it was cut to lie there.

    Attributes:
        flat: the m faces of the surface in their order, counter-clockwise, z = 0 [mm]; on its n vertices, and behind
            them, where it was cut, copies of those along the cut.
        continuation: beyond the cut; `UNCUT` where there is none.
    """

    flat: Surface
    continuation: Continuation
