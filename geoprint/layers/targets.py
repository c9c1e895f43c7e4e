"""What layers fill: a closed shape, or a thickness at every place of the part; and how deep within it places lie."""

from __future__ import annotations

from typing import Protocol, final

import numpy as np

from geoprint.errors import FieldError, MeshError
from geoprint.layers.feet import Ground
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints
from geoprint.surfaces import (
    boundary_loops,
    closest,
    edges,
    face_normals,
    half_edges,
    positions,
    signed_volume,
    turned_over,
)
from geoprint.surfaces.remesh import refine
from geoprint.surfaces.topology import numbered_pairs

# Weights below this count as none: the closest place lies on an edge or at a corner.
ON_EDGE = 1e-9
# The height of a shape is looked for at places so far apart [mm], at most so many across it.
LOOKED_AT, MOST_ACROSS = 1.0, 200
# A vertex of a shape that lies on the part is over it, as exactly as files are written [mm].
TOUCHING = 1e-3
# So many places tell a volume to a few thousandths; steps of the additive sequence that spreads them over a box: powers
# of one over the root of x^4 = x + 1 [Roberts2018].
PLACES = 200_000
STEPS = (0.8191725133961645, 0.6710436067037893, 0.5497004779019703)
# Where its edges pass the rim is found by so many halvings: a thousandth of a millimetre and less.
HALVINGS = 12


class LayerTarget(Protocol):
    """What layers fill.

    Attributes:
        thickness: the largest over the part [mm].
    """

    thickness: float

    @property
    def volume(self) -> float | None:
        """Of what is over the part [mm3], or None where nobody knows."""
        ...

    def depth(self, places: FloatArray) -> FloatArray:
        """Return how deep (k, 3) places lie within [mm], below 0 outside."""
        ...


@final
class TargetShape:
    """A closed shape.

    Args:
        shape: closed and without triangles that cross, of either winding.
        part: that the layers lie on.

    Raises:
        MeshError: the shape is open.
        FieldError: nothing of it is over the outer side of the part.
    """

    def __init__(self, shape: Surface, part: Surface) -> None:
        loops = boundary_loops(shape)
        if loops:
            raise MeshError(
                f"the target {shape.name} is open: it has {len(loops)} border{'s' if len(loops) > 1 else ''}, so that "
                "nobody can say what lies within it. Close it, or give a `--thickness`."
            )
        volume = signed_volume(shape)
        self._part, self._shape = part, shape if volume > 0.0 else turned_over(shape)
        self._faces = face_normals(self._shape)
        pairs, edge = numbered_pairs(half_edges(self._shape.faces))
        self._edge: IntArray = edge.reshape(-1, 3)
        self._edges = np.zeros((len(pairs), 3))
        np.add.at(self._edges, edge, np.repeat(self._faces, 3, axis=0))
        self._corners = _angle_weighted(self._shape, self._faces)
        self.thickness = self._highest(part)

    @property
    def volume(self) -> float | None:
        """Of what is over the part [mm3]: exact where all of it is, else by places spread over the box around it."""
        ground, vertices = Ground(self._part), self._shape.vertices
        feet = ground.feet(vertices)
        inside, outer = ground.beyond(vertices, feet.places) <= TOUCHING, feet.distances >= -TOUCHING
        if (inside & outer).all():
            return signed_volume(self._shape)
        low, sides = vertices.min(axis=0), np.ptp(vertices, axis=0)
        places = low + sides * np.mod(0.5 + np.outer(np.arange(PLACES), STEPS), 1.0)
        within = places[self.depth(places) >= 0.0]
        feet = ground.feet(within)
        over = (feet.distances >= 0.0) & (ground.beyond(within, feet.places) <= 0.0)
        return float(over.sum() / PLACES * sides.prod())

    def depth(self, places: FloatArray) -> FloatArray:
        """Return how deep (k, 3) places lie within the shape [mm], below 0 outside; exact up to rounding.

        The sign is that of the mean normal of the faces about the closest place, weighted by their angles
        [Baerentzen2005].
        """
        points, distances = closest(self._shape, places)
        outwards = np.einsum("kx,kx->k", places - positions(self._shape, points), self._normals(points))
        return np.where(outwards > 0.0, -distances, distances)

    def _normals(self, points: SurfacePoints) -> FloatArray:
        """Return (k, 3) the normals that tell the sides of points: of their face, of their edge, or of their corner."""
        off = points.weights <= ON_EDGE
        found = self._faces[points.faces].copy()
        on_edge, at_corner = off.sum(axis=1) == 1, off.sum(axis=1) == 2
        # A weight of nothing is that of the corner which the edge lies opposite to.
        opposite = (off[on_edge].argmax(axis=1) + 1) % 3
        found[on_edge] = self._edges[self._edge[points.faces[on_edge], opposite]]
        corner = points.weights[at_corner].argmax(axis=1)
        found[at_corner] = self._corners[self._shape.faces[points.faces[at_corner], corner]]
        return found

    def _highest(self, part: Surface) -> float:
        """Return how high the shape ends over the part [mm]."""
        across = float(np.linalg.norm(np.ptp(self._shape.vertices, axis=0)))
        looked_at = refine(self._shape, edge_length=max(LOOKED_AT, across / MOST_ACROSS))
        ground = Ground(part)
        over = ground.feet(_standing_on(ground, looked_at)).distances
        if over.max(initial=0.0) <= 0.0:
            raise FieldError(
                f"nothing of the target {self._shape.name} is over the outer side of {part.name}: check that both are "
                "in the same coordinates and unit, and which side is printed on (`--flip`)."
            )
        return float(over.max())


@final
class TargetThickness:
    """A thickness that varies over the part.

    Args:
        part: refined as far as the thickness is linear in its triangles.
        thickness: (n,) at its vertices [mm], along the distance from it; 0 where nothing shall lie.

    Raises:
        FieldError: it is 0 everywhere.
    """

    def __init__(self, part: Surface, thickness: FloatArray) -> None:
        self.thickness = float(thickness.max())
        if self.thickness <= 0.0:
            raise FieldError(f"the thickness over {part.name} is 0 everywhere: nothing is left to print.")
        self._part, self._thickness = part, thickness

    @property
    def volume(self) -> float | None:
        """None: it is what the layers hold."""
        return None

    def depth(self, places: FloatArray) -> FloatArray:
        """Return how far below the top (k, 3) places lie [mm], below 0 over it."""
        points, distances = closest(self._part, places)
        return points.values(self._part, self._thickness) - distances


def _standing_on(ground: Ground, surface: Surface) -> FloatArray:
    """Return the vertices of a surface over or under the part, and where its edges pass the rim; there may be none."""
    if not ground.rimmed:
        return surface.vertices
    beyond = ground.beyond(surface.vertices, ground.feet(surface.vertices).places)
    pairs = edges(surface.faces)
    passing = pairs[np.sign(beyond[pairs]).prod(axis=1) < 0.0]
    ends = np.take_along_axis(passing, beyond[passing].argsort(axis=1), axis=1)
    inner, outer = surface.vertices[ends[:, 0]], surface.vertices[ends[:, 1]]
    for _ in range(HALVINGS):
        middles = (inner + outer) / 2.0
        out = (ground.beyond(middles, ground.feet(middles).places) > 0.0)[:, None]
        inner, outer = np.where(out, inner, middles), np.where(out, middles, outer)
    return np.concatenate([surface.vertices[beyond <= 0.0], inner])


def _angle_weighted(surface: Surface, upright: FloatArray) -> FloatArray:
    """Return (n, 3) the sum of the (m, 3) normals of the faces about each vertex, weighted by their angles there."""
    corners = surface.vertices[surface.faces]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    sines = np.linalg.norm(np.cross(ahead, back), axis=2)
    angles = np.arctan2(sines, np.einsum("mcx,mcx->mc", ahead, back))
    total = np.zeros_like(surface.vertices)
    np.add.at(total, surface.faces, angles[:, :, None] * upright[:, None])
    return total
