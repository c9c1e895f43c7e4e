"""How far the paths of several plans lie apart, and which of several coverings is best."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile
from typing import NamedTuple, final

import numpy as np

from geoprint.geometry import PolylineDistance, even_points
from geoprint.model import FloatArray, PoseStream, freeze_arrays, frozen

# How far the paths of several plans lie apart.


# Points per spacing along each path at which the distance to the others is taken.
POINTS_PER_SPACING = 4
# Pieces per spacing into which paths are cut to find the nearest one.
PIECES_PER_SPACING = 4


@final
@frozen
class Agreement:
    """Distances between every two of b paths; both matrices are symmetric with zeros on the diagonal.

    Attributes:
        hausdorff: (b, b) largest distance from a point of either path to the other path [mm].
        mean: (b, b) mean of the distances from the points of both paths to the other one [mm].
    """

    hausdorff: FloatArray
    mean: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, hausdorff="float: b b", mean="float: b b")


def agreement(paths: Sequence[PoseStream], *, spacing: float) -> Agreement:
    """Measure how far deposited paths lie apart, straight through space.

    The Hausdorff distance [Huttenlocher1993] is that of the paper's Table II, there between photographed paths: the
    larger of the two one-sided ones. Paths that lie as close as the surface's other side are compared across the gap.

    Args:
        paths: b streams over the same part; only what deposits counts.
        spacing: wanted distance of neighbouring runs [mm]; a quarter of it is the distance of the sampled points.

    Returns:
        The distances.
    """
    lines = [_deposited_lines(poses) for poses in paths]
    points = [np.vstack([even_points(line, step=spacing / POINTS_PER_SPACING) for line in some]) for some in lines]
    nearest = [PolylineDistance(some, step=spacing / PIECES_PER_SPACING) for some in lines]
    count = len(paths)
    hausdorff, mean = np.zeros((count, count)), np.zeros((count, count))
    for i in range(count):
        for j in range(i):
            apart = np.concatenate([nearest[j](points[i]), nearest[i](points[j])])
            hausdorff[i, j] = hausdorff[j, i] = apart.max()
            mean[i, j] = mean[j, i] = apart.mean()
    return Agreement(hausdorff, mean)


def _deposited_lines(poses: PoseStream) -> list[FloatArray]:
    """Return the polyline on the surface of every deposited run of two points or more [mm]."""
    rows = np.flatnonzero(poses.deposit)
    starts = np.flatnonzero(np.diff(poses.runs[rows], prepend=-1))
    return [line for line in np.split(poses.surface_points[rows], starts[1:]) if len(line) > 1]


# Which of several coverings of a part is best: coverage decides first, and thickness second.


# A layer whose thickness varies by less than this is even enough: the flow from run to run varies it by half as much.
EVEN_ENOUGH = 0.04
# A thickness that varies by less than this more is as even: what is simulated is as uncertain.
SAME_THICKNESS = 0.002
# Coverings that miss or cover twice shares of the area that differ by less than this cover a part alike.
SAME_COVERAGE = 0.005
# Where more of the area than this is missed, or covered twice, that is no cover; seams where fronts meet make up to
# about as much.
MOST_MISSED = 0.02
MOST_TWICE = 0.05


class Covering(NamedTuple):
    """What paths make of a part.

    Attributes:
        gap: share of the area that is missed.
        overlap: share of it that is covered twice.
        cv: variation of the thickness that a constant flow leaves.
    """

    gap: float
    overlap: float
    cv: float

    @property
    def covers(self) -> bool:
        """Whether paths leave no holes and deposit little twice."""
        return self.gap <= MOST_MISSED and self.overlap <= MOST_TWICE

    @property
    def fault(self) -> float:
        """Share of the area that is not covered once."""
        return self.gap + self.overlap

    def is_alike(self, other: Covering) -> bool:
        """Return whether both cover a part alike."""
        return abs(self.fault - other.fault) <= SAME_COVERAGE and self.covers == other.covers


def ranked(coverings: Sequence[Covering]) -> list[int]:
    """Return the indices of some coverings of one part, the best first.

    Those that cover it come before those that do not. Of those that cover it alike (uncovered and overlapped area
    together), the one with the most even thickness is the best.
    """
    order = sorted(range(len(coverings)), key=lambda index: (not coverings[index].covers, coverings[index].fault))
    alike = sum(coverings[index].is_alike(coverings[order[0]]) for index in order)
    return [*sorted(order[:alike], key=lambda index: coverings[index].cv), *order[alike:]]


def equally_good(ordered: Sequence[Covering]) -> int:
    """Return how many of some coverings, the best first, cannot be distinguished from the best one; that counts too."""
    best = ordered[0]
    same = takewhile(lambda each: each.is_alike(best) and 0.0 <= each.cv - best.cv < SAME_THICKNESS, ordered)
    return len(list(same))
