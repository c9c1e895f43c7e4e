"""How far two surfaces lie apart: the Hausdorff distance in both directions, to a stated accuracy.

The distance from a point to a surface changes by no more than the point moves, and the distance to one triangle is a
convex function. Both bound the distance over a whole triangle from that of its middle; triangles whose bound exceeds
the largest distance found so far are cut into four until no bound does by more than the accuracy [Guthe2005].
"""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import MeshError
from geoprint.geometry.creases import edges_alone
from geoprint.geometry.operators import edge_lengths, face_areas
from geoprint.geometry.points import closest, closest_in_triangles, triple
from geoprint.geometry.refine import FACES_PER_SQUARE, refine
from geoprint.geometry.topology import twins
from geoprint.model import FloatArray, Rounded, Surface, comparable, recorded

# The largest distance is sought to this share of the mean edge, or this share of itself, whichever is more.
EDGE_SHARE, OWN_SHARE = 0.01, 0.03
# Pieces that a surface is cut into for mean and percentile, at most, beyond its own faces.
MOST_SAMPLES = 200_000
# Pieces that are cut at a time, those of the largest bound; and that are looked at in all. What is known then is told.
AT_A_TIME, MOST_LOOKED_AT = 50_000, 1_000_000


@final
@recorded("DistancesRecord", largest="max_mm", bound="max_bound_mm", mean="mean_mm", p95="p95_mm", place="place_mm")
class Distances:
    """How far the points of one surface lie from another [mm].

    Attributes:
        largest: that was found.
        bound: that no point exceeds; it is the largest distance but for the accuracy of the search.
        mean: over the area.
        p95: 95 % of the area lies nearer.
        place: where the largest was found.
    """

    largest: Rounded
    bound: Rounded
    mean: Rounded
    p95: Rounded
    place: tuple[Rounded, ...]


@final
@comparable
class Deviation:
    """How far two surfaces lie apart.

    Attributes:
        forward: from the old surface to the new.
        backward: from the new surface to the old.
        rim: bound of the distance from either rim to the other one [mm]; 0 for closed surfaces.
    """

    forward: Distances
    backward: Distances
    rim: float

    @property
    def largest(self) -> Distances:
        """The direction with the larger bound."""
        return max(self.forward, self.backward, key=lambda found: found.bound)


def deviation(old: Surface, new: Surface) -> Deviation:
    """Return how far two surfaces lie apart, and their rims.

    Args:
        old: any triangles.
        new: any triangles; with a rim if the old one has one.

    Returns:
        The distances in both directions; for surfaces with many small features less accurate than EDGE_SHARE and
        OWN_SHARE, as the bounds then tell.

    Raises:
        MeshError: one of them has a rim and the other has none.
    """
    accuracy = EDGE_SHARE * min(float(edge_lengths(old).mean()), float(edge_lengths(new).mean()))
    old_rim, new_rim = _rim(old), _rim(new)
    if (old_rim is None) != (new_rim is None):
        raise MeshError(f"{old.name}: one of the two surfaces has a rim, the other has none; compare like with like.")
    rim = 0.0
    if old_rim is not None and new_rim is not None:
        pairs = ((old_rim, new_rim), (new_rim, old_rim))
        rim = max(_largest(one.vertices[one.faces], other, accuracy=accuracy)[1] for one, other in pairs)
    return Deviation(_distances(old, new, accuracy=accuracy), _distances(new, old, accuracy=accuracy), rim)


def _distances(source: Surface, target: Surface, *, accuracy: float) -> Distances:
    """Return how far a surface lies from another one."""
    fine = _sampled(source, target)
    corners = fine.vertices[fine.faces]
    largest, bound, place = _largest(corners, target, accuracy=accuracy)
    _, away = closest(target, corners.mean(axis=1))
    areas = face_areas(fine)
    order = np.argsort(away)
    reached = np.cumsum(areas[order]) / areas.sum()
    p95 = float(away[order][np.searchsorted(reached, 0.95)])
    return Distances(largest, bound, float(away @ areas / areas.sum()), p95, place)


def _sampled(source: Surface, target: Surface) -> Surface:
    """Return a surface cut so small that the middles of its faces tell of the whole."""
    edge_length = min(float(edge_lengths(source).mean()), float(edge_lengths(target).mean()))
    least = np.sqrt(FACES_PER_SQUARE * float(face_areas(source).sum()) / MOST_SAMPLES)
    return refine(source, edge_length=max(edge_length, float(least)))


def _rim(surface: Surface) -> Surface | None:
    rim = twins(surface.faces) < 0
    return edges_alone(surface, rim) if rim.any() else None


def _largest(corners: FloatArray, target: Surface, *, accuracy: float) -> tuple[float, float, tuple[float, ...]]:
    """Return the largest distance found from triangles to a surface, one that none exceeds, and where the largest is.

    Args:
        corners: (k, 3, 3) corners of the triangles [mm].
        target: the surface.
        accuracy: wanted [mm].
    """
    points = np.unique(corners.reshape(-1, 3), axis=0)
    _, away = closest(target, points)
    largest, place = float(away.max()), points[np.argmax(away)]
    # Those that are cut no further, because their bound is near enough; and the others, to begin with all.
    settled, waiting, bounds = largest, corners[:0], np.zeros(0)
    looked_at = 0
    while True:
        middles = corners.mean(axis=1)
        found, away = closest(target, middles)
        looked_at += len(middles)
        if away.max() > largest:
            largest, place = float(away.max()), middles[np.argmax(away)]
        waiting = np.concatenate([waiting, corners])
        bounds = np.concatenate([bounds, _bounds(corners, middles, away, target.vertices[target.faces[found.faces]])])
        near = bounds <= largest + max(accuracy, OWN_SHARE * largest)
        settled = max(settled, largest, float(bounds[near].max(initial=0.0)))
        waiting, bounds = waiting[~near], bounds[~near]
        if not bounds.size or looked_at > MOST_LOOKED_AT:
            return largest, max(settled, float(bounds.max(initial=0.0))), triple(place)
        order = np.argsort(-bounds, kind="stable")
        corners, rest = _quarters(waiting[order[:AT_A_TIME]]), order[AT_A_TIME:]
        waiting, bounds = waiting[rest], bounds[rest]


def _bounds(corners: FloatArray, middles: FloatArray, away: FloatArray, faces: FloatArray) -> FloatArray:
    """Return (k,) distances that no point of each triangle exceeds.

    Args:
        corners: (k, 3, 3) corners of the triangles [mm].
        middles: (k, 3) their centroids [mm].
        away: (k,) how far these lie from the surface [mm].
        faces: (k, 3, 3) corners of the faces of the surface that are nearest to them [mm].
    """
    by_reach = away + np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    by_face = np.sqrt(np.max([closest_in_triangles(corners[:, i], faces)[1] for i in range(3)], axis=0))
    return np.minimum(by_reach, by_face)


def _quarters(corners: FloatArray) -> FloatArray:
    """Return (4 k, 3, 3) the pieces of (k, 3, 3) triangles cut at the middles of their sides."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    pieces = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return np.concatenate([np.stack(piece, axis=1) for piece in pieces])
