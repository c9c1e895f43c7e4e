"""How far two surfaces lie apart: the Hausdorff distance in both directions, to a stated accuracy.

The distance from a point to a surface changes by no more than the point moves, and the distance to one triangle is a
convex function. Both bound the distance over a whole triangle from that of its middle; triangles whose bound exceeds
the largest distance found so far are cut into four until no bound does by more than the accuracy [Guthe2005].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from geoprint.errors import MeshError
from geoprint.model import FloatArray, Surface
from geoprint.surfaces.creases import edges_alone
from geoprint.surfaces.operators import edge_lengths, face_areas
from geoprint.surfaces.places import triple
from geoprint.surfaces.points import closest, closest_in_triangles
from geoprint.surfaces.refine import FACES_PER_SQUARE, refine
from geoprint.surfaces.topology import twins

# The largest distance is sought to this share of the mean edge, or this share of itself, whichever is more.
EDGE_SHARE, OWN_SHARE = 0.01, 0.02
# Triangles that are looked at at a time: more would gain little. What is known then is told.
MOST_SAMPLES = 200_000


@final
@dataclass(frozen=True, slots=True)
class Distances:
    """How far the points of one surface lie from another [mm].

    Attributes:
        largest: that was found.
        bound: that no point exceeds; it is the largest distance but for the accuracy of the search.
        mean: over the area.
        p95: 95 % of the area lies nearer.
        place: where the largest was found.
    """

    largest: float
    bound: float
    mean: float
    p95: float
    place: tuple[float, ...]


@final
@dataclass(frozen=True, slots=True)
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
    cut = False
    while True:
        middles = corners.mean(axis=1)
        found, away = closest(target, middles)
        if away.max() > largest:
            largest, place = float(away.max()), middles[np.argmax(away)]
        by_reach = away + np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
        faces = target.vertices[target.faces[found.faces]]
        by_face = np.sqrt(np.max([closest_in_triangles(corners[:, i], faces)[1] for i in range(3)], axis=0))
        beyond = np.minimum(by_reach, by_face) - largest
        waiting = beyond > max(accuracy, OWN_SHARE * largest)
        if not waiting.any() or 4 * int(waiting.sum()) > MOST_SAMPLES:
            # What was set aside before lies below the accuracy that was wanted.
            known = max(accuracy, OWN_SHARE * largest)
            return largest, largest + max(float(beyond.max()), known if cut else 0.0), triple(place)
        cut = cut or not waiting.all()
        corners = _quarters(corners[waiting])


def _quarters(corners: FloatArray) -> FloatArray:
    """Return (4 k, 3, 3) the pieces of (k, 3, 3) triangles cut at the middles of their sides."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    pieces = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return np.concatenate([np.stack(piece, axis=1) for piece in pieces])
