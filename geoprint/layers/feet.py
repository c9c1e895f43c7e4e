"""The part as layers see it: the foot of a place on it, the side that it is on, and how far it lies beyond the rim."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.sparse import csr_array

from geoprint.geometry import boundary_loops, closest, face_normals, half_edges, normals, positions, vertex_normals
from geoprint.geometry.creases import SHARP
from geoprint.geometry.points import closest_in_triangles
from geoprint.geometry.rays import box_tree, nearest_triangles
from geoprint.geometry.topology import twins
from geoprint.model import BoolArray, FloatArray, IntArray, Surface

# Normals at the rim of a part, where faces lie on one side alone.
#
# The mean of those faces' normals is right half a face inside: over a bulge it leans inwards, in a hollow outwards,
# and a layer cut along it is too narrow or too wide by as much as lies on that half. Here a quadric through the
# vertices about each one tells how far to turn it [Cazals2005]: the error falls with the cube of the edge length,
# not with it.


# Rings of neighbours that a quadric is fitted to, twice: a fold beside the rim bends the narrow one ten times as much
# as the wide one, what is smooth bends both alike. The smaller slope counts, and none where they differ by more than
# this factor or in sign.
RINGS = (2, 3)
AGREEING = 2.0
# A fit whose columns, each of length 1, hang together by a smaller singular value is none: too few vertices.
LEAST_SINGULAR = 0.02


def rim_normals(part: Surface, loop: IntArray) -> FloatArray:
    """Return the normals at a loop of the rim, right to second order where the part is smooth.

    Only smooth surroundings count: a quadric is fitted to vertices that are reached without passing a crease. On one,
    at the end of one, and where there are too few vertices, a normal is the mean of its faces'.

    Args:
        part: manifold, consistently wound.
        loop: (r,) vertices, in their order.

    Returns:
        (r, 3) unit normals.

    Raises:
        MeshError: faces about a vertex cancel out.
    """
    upright = vertex_normals(part)[loop]
    axes = _axes(part.vertices[np.roll(loop, -1)] - part.vertices[np.roll(loop, 1)], upright)
    both = np.stack([_slopes(part, loop, axes, near) for near in _neighbours(part, loop)])
    larger, smaller = np.abs(both).max(axis=0), np.abs(both).min(axis=0)
    agreed = (np.sign(both[0]) == np.sign(both[1])) & (larger <= AGREEING * smaller)
    slopes = np.where(agreed, np.sign(both[0]) * smaller, 0.0)
    turned: FloatArray = axes[:, 2] - np.einsum("ra,rax->rx", slopes, axes[:, :2])
    lengths: FloatArray = np.linalg.norm(turned, axis=1)
    return np.divide(turned, lengths[:, None])


def _axes(along: FloatArray, upright: FloatArray) -> FloatArray:
    """Return (r, 3, 3) along the rim, across it, and upright."""
    across: FloatArray = np.cross(upright, along)
    lengths: FloatArray = np.linalg.norm(across, axis=1)
    across = np.divide(across, np.maximum(lengths, np.finfo(np.float64).tiny)[:, None])
    return np.stack([np.cross(across, upright), across, upright], axis=1)


def _neighbours(part: Surface, loop: IntArray) -> list[csr_array]:
    """Return for each of RINGS the (r, n) vertices that lie about each of a loop, itself among them."""
    count = len(part.vertices)
    sides = half_edges(part.faces)
    passed = ~_creased(part)[sides]
    links = np.concatenate([sides[passed[:, 0]], sides[passed[:, 1]][:, ::-1]])
    step = csr_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    reached = csr_array((np.ones(len(loop)), (np.arange(len(loop)), loop)), shape=(len(loop), count))
    found: list[csr_array] = []
    for ring in range(1, max(RINGS) + 1):
        reached = reached + reached @ step
        reached.data[:] = 1.0
        if ring in RINGS:
            found.append(reached)
    return found


def _creased(part: Surface) -> BoolArray:
    """Return (n,) which vertices lie on a crease."""
    other = twins(part.faces)
    (inner,) = np.nonzero(other >= 0)
    upright = face_normals(part)
    bend = np.einsum("hx,hx->h", upright[inner // 3], upright[other[inner] // 3])
    found = np.zeros(len(part.vertices), dtype=np.bool_)
    found[half_edges(part.faces)[inner[bend < np.cos(SHARP)]]] = True
    return found


def _slopes(part: Surface, loop: IntArray, axes: FloatArray, near: csr_array) -> FloatArray:
    """Return (r, 2) slopes along and across the rim of the quadrics about its vertices; 0 where there is none."""
    counts = np.diff(near.indptr)
    row = np.repeat(np.arange(len(loop)), counts)
    column = np.arange(len(row)) - np.repeat(near.indptr[:-1], counts)
    local = np.einsum("px,pax->pa", part.vertices[near.indices] - part.vertices[loop[row]], axes[row])
    u, v, w = local.T
    terms = np.zeros((len(loop), max(int(counts.max()), 6), 6))
    terms[row, column] = np.column_stack([np.ones_like(u), u, v, u * u, u * v, v * v])
    heights = np.zeros(terms.shape[:2])
    heights[row, column] = w
    lengths = np.maximum(np.linalg.norm(terms, axis=1), np.finfo(np.float64).tiny)
    left, singular, right = np.linalg.svd(terms / lengths[:, None], full_matrices=False)
    known = singular[:, -1] > LEAST_SINGULAR
    inverse = 1.0 / np.where(known[:, None], singular, np.inf)
    along: FloatArray = np.einsum("rks,rk->rs", left, heights) * inverse
    coefficients: FloatArray = np.einsum("rsc,rs->rc", right, along) / lengths
    return coefficients[:, 1:3]


# Nearer to the part than this [mm] a place has no direction from it.
SHORTEST = 1e-12
# Moves of a place along its distance until it has the wanted one: in a crease the foot changes sides.
MOVES = 3


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

    def feet(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the (k, 3) closest places of the part to (k, 3) places, and how far these are, below 0 inside [mm]."""
        points, distances = closest(self.part, places)
        found = positions(self.part, points)
        outer = np.einsum("kx,kx->k", places - found, normals(self.part, points)) >= 0.0
        return found, np.where(outer, distances, -distances)

    def raised(self, places: FloatArray, height: float) -> FloatArray:
        """Return (k, 3) places moved along the distance until they have a height over the part [mm]."""
        for _ in range(MOVES):
            feet, distances = self.feet(places)
            places = feet + height * (places - feet) / np.maximum(np.abs(distances), SHORTEST)[:, None]
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
