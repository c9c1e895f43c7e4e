"""How far the paths of several plans lie apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from geoprint.model import FloatArray, PoseStream, freeze_arrays, frozen
from geoprint.surfaces import PolylineDistance, even_points

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
