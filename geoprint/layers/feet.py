"""The part as layers see it: the foot of a place on it, the side that it is on, and how far it lies beyond the rim."""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np

from geoprint.layers.rims import rim_normals
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.surfaces import boundary_loops, closest, normals, positions
from geoprint.surfaces.box_tree import box_tree, nearest_triangles
from geoprint.surfaces.points import closest_in_triangles

# Nearer to the part than this [mm] a place has no direction from it.
SHORTEST = 1e-12
# Moves of a place along its distance until it has the wanted one: in a crease the foot changes sides.
MOVES = 3


class Feet(NamedTuple):
    """Where places stand on the part.

    Attributes:
        places: (k, 3) closest places of the part [mm].
        distances: (k,) to them [mm], below 0 on the inner side.
    """

    places: FloatArray
    distances: FloatArray


@final
class Ground:
    """A part, of which places outside of it are asked.

    Args:
        part: manifold; its normals say which side is the outer one.
    """

    def __init__(self, part: Surface) -> None:
        self.part = part
        loops = boundary_loops(part)
        self.rimmed = bool(loops)
        if not loops:
            return
        ends: IntArray = np.concatenate([np.column_stack([loop, np.roll(loop, -1)]) for loop in loops])
        starts, stops = part.vertices[ends[:, 0]], part.vertices[ends[:, 1]]
        upright = np.zeros_like(part.vertices)
        for loop in loops:
            upright[loop] = rim_normals(part, loop)
        between: FloatArray = upright[ends[:, 0]] + upright[ends[:, 1]]
        outwards = _unit(np.cross(stops - starts, between))
        beyond = np.zeros_like(part.vertices)
        np.add.at(beyond, ends.ravel(), np.repeat(outwards, 2, axis=0))
        # A side of the rim is a triangle without area.
        self._sides = np.stack([starts, stops, stops], axis=1)
        self._tree = box_tree(self._sides)
        self._upright, self._beyond = upright[ends], _unit(beyond[ends])

    def feet(self, places: FloatArray) -> Feet:
        """Return the feet of (k, 3) places [mm]."""
        points, distances = closest(self.part, places)
        found = positions(self.part, points)
        outer = np.einsum("kx,kx->k", places - found, normals(self.part, points)) >= 0.0
        return Feet(found, np.where(outer, distances, -distances))

    def raised(self, places: FloatArray, height: float) -> FloatArray:
        """Return (k, 3) places moved along the distance until they have a height over the part [mm]."""
        for _ in range(MOVES):
            feet = self.feet(places)
            away = places - feet.places
            places = feet.places + height * away / np.maximum(np.abs(feet.distances), SHORTEST)[:, None]
        return places

    def beyond(self, places: FloatArray, feet: FloatArray) -> FloatArray:
        """Return how far places lie beyond the surface that the normals of the rim rule.

        Args:
            places: (k, 3) [mm].
            feet: (k, 3) of each [mm].

        Returns:
            (k,) above 0 beyond it [mm]; within it the distance of the foot from the rim counts, below 0. Of a part
            without a rim minus infinity.
        """
        if not self.rimmed:
            return np.full(len(places), -np.inf)
        side = nearest_triangles(feet, self._sides, self._tree)
        weights, _ = closest_in_triangles(feet, self._sides[side])
        share = np.stack([weights[:, 0], weights[:, 1] + weights[:, 2]], axis=1)
        at = np.einsum("ks,ksx->kx", share, self._sides[side][:, :2])
        upright = _unit(np.einsum("ks,ksx->kx", share, self._upright[side]))
        outwards = np.einsum("ks,ksx->kx", share, self._beyond[side])
        outwards = _unit(outwards - np.einsum("kx,kx->k", outwards, upright)[:, None] * upright)
        past: FloatArray = np.einsum("kx,kx->k", places - at, outwards)
        inside = np.linalg.norm(feet - at, axis=1)
        return np.where(inside > np.linalg.norm(places - feet, axis=1), -inside, past)


def _unit(vectors: FloatArray) -> FloatArray:
    lengths: FloatArray = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, np.maximum(lengths, SHORTEST))
