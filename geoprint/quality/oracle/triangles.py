"""Triangles laid flat one by one: the plane coordinates in which geodesics are unfolded.

Half-edges are numbered as `surfaces.halfedges` says. Points of the plane are complex numbers, so that laying a triangle
beside another is one multiplication.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints
from geoprint.surfaces import boundary_half_edges, twins

ComplexArray: TypeAlias = NDArray[np.complex128]

# An angle larger than the straight one by this [rad] turns geodesics; less is rounding.
ANGLE_TOLERANCE = 1e-12


class FlatMesh(NamedTuple):
    """A triangle mesh as its flat triangles and how they join.

    Attributes:
        starts: (3 m,) vertex at which each half-edge starts.
        twins: (3 m,) half-edge on the other side, -1 on the border.
        corners: (3 m,) where each half-edge starts, in the plane of its face; corner 0 of a face is at 0 [mm].
        apexes: (3 m,) the opposite corner, as a multiple of the half-edge from its start.
        angles: (3 m,) angle of the face where the half-edge starts [rad].
        totals: (n,) sum of the angles at each vertex [rad].
        turns: (n,) whether a shortest path may turn at the vertex: more than 2 pi inside, than pi on the border.
        middles: (3 m, 3) middle of each half-edge in space [mm].
        halves: (3 m,) half of its length [mm].
        origins: (m, 3) corner 0 of each face in space [mm].
        axes: (m, 2, 3) unit vectors of the face's plane coordinates in space.
    """

    starts: IntArray
    twins: IntArray
    corners: ComplexArray
    apexes: ComplexArray
    angles: FloatArray
    totals: FloatArray
    turns: BoolArray
    middles: FloatArray
    halves: FloatArray
    origins: FloatArray
    axes: FloatArray


class Places(NamedTuple):
    """Points on a mesh.

    Attributes:
        faces: (k,) face of each.
        flat: (k,) where it is in the plane of that face [mm].
    """

    faces: IntArray
    flat: ComplexArray

    def some(self, part: slice | IntArray | BoolArray) -> Places:
        """Return some of them."""
        return Places(self.faces[part], self.flat[part])


def flat_mesh(surface: Surface) -> FlatMesh:
    """Lay every triangle of a surface flat.

    Args:
        surface: m faces, none without area, at most two at an edge.

    Raises:
        MeshError: an edge has more than two faces.
    """
    corners = surface.vertices[surface.faces]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.linalg.norm(first, axis=1)
    along = first / length[:, None]
    share = np.einsum("mx,mx->m", second, along)
    across = second - share[:, None] * along
    height = np.linalg.norm(across, axis=1)
    flat: ComplexArray = np.column_stack([np.zeros(len(corners)), length, share + 1j * height]).astype(np.complex128)
    following, last = np.roll(flat, -1, axis=1), np.roll(flat, -2, axis=1)
    apexes = (last - flat) / (following - flat)
    starts = surface.faces.ravel()
    sums = np.bincount(starts, np.angle(apexes).ravel(), minlength=len(surface.vertices))
    totals = np.asarray(sums, dtype=np.float64)
    straight = np.full(totals.size, 2 * np.pi)
    straight[starts[boundary_half_edges(surface.faces)]] = np.pi
    return FlatMesh(
        starts=np.ascontiguousarray(starts),
        twins=twins(surface.faces),
        corners=flat.ravel(),
        apexes=apexes.ravel(),
        angles=np.angle(apexes).ravel(),
        totals=totals,
        turns=totals > straight + ANGLE_TOLERANCE,
        middles=(0.5 * (corners + np.roll(corners, -1, axis=1))).reshape(-1, 3),
        halves=0.5 * np.abs(following - flat).ravel(),
        origins=np.ascontiguousarray(corners[:, 0]),
        axes=np.stack([along, across / height[:, None]], axis=1),
    )


def flat_places(mesh: FlatMesh, points: SurfacePoints) -> Places:
    """Return points of the surface in the planes of their faces."""
    flat = (points.weights * mesh.corners.reshape(-1, 3)[points.faces]).sum(axis=1)
    return Places(points.faces, flat)


def spatial(mesh: FlatMesh, places: Places) -> FloatArray:
    """Return the (k, 3) positions of places in space [mm]."""
    plane = np.column_stack([places.flat.real, places.flat.imag])
    return mesh.origins[places.faces] + np.einsum("kp,kpx->kx", plane, mesh.axes[places.faces])


class SmallTriangles(NamedTuple):
    """Small triangles that together are the surface.

    Attributes:
        middles: of the k triangles.
        areas: (k,) [mm2].
        extents: (k,) how far each reaches in any direction: a strip that wide has the same mean square distance from
            its middle [mm].
        scales: (k,) size of each over that of its face; negative for those that are turned by half a turn.
    """

    middles: Places
    areas: FloatArray
    extents: FloatArray
    scales: FloatArray

    def some(self, which: IntArray | BoolArray) -> SmallTriangles:
        """Return some of them."""
        middles = Places(self.middles.faces[which], self.middles.flat[which])
        return SmallTriangles(middles, self.areas[which], self.extents[which], self.scales[which])

    def corners(self, mesh: FlatMesh) -> ComplexArray:
        """Return the (k, 3) corners seen from the middles, in the planes of their faces [mm]."""
        whole = mesh.corners.reshape(-1, 3)
        about = whole - whole.mean(axis=1, keepdims=True)
        return self.scales[:, None] * about[self.middles.faces]


def small_triangles(mesh: FlatMesh, *, edge_length: float) -> SmallTriangles:
    """Cut every face into equal similar triangles with sides of at most `edge_length` [mm]."""
    halves = mesh.halves.reshape(-1, 3)
    cuts = np.maximum(np.ceil(2 * halves.max(axis=1) / edge_length), 1).astype(np.int64)
    corners = mesh.corners.reshape(-1, 3)
    areas = 0.5 * (corners[:, 1].real * corners[:, 2].imag) / cuts**2
    # The mean square distance of a triangle from its middle is a 36th of the sum of its squared sides, in both
    # directions together; that of a strip is a 12th of its squared width, in one.
    extents = np.sqrt((4 * halves**2).sum(axis=1) / 6) / cuts
    faces: list[IntArray] = []
    flat: list[ComplexArray] = []
    scales: list[FloatArray] = []
    for cut in np.unique(cuts):
        chosen = np.flatnonzero(cuts == cut)
        weights, upright = _middle_weights(int(cut))
        middles = corners[chosen] @ weights.T
        faces.append(np.repeat(chosen, middles.shape[1]))
        flat.append(middles.ravel())
        scales.append(np.tile(np.where(upright, 1.0, -1.0) / float(cut), chosen.size))
    where = np.concatenate(faces)
    middles = Places(where, np.concatenate(flat))
    return SmallTriangles(middles, areas[where], extents[where], np.concatenate(scales))


def _middle_weights(cut: int) -> tuple[FloatArray, BoolArray]:
    """Return the (cut^2, 3) barycentric weights of the middles of a face's small triangles, and which are upright."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(cut), np.arange(cut), indexing="ij"))
    upright, turned = i + j < cut, i + j < cut - 1
    second = np.concatenate([i[upright] + 1 / 3, i[turned] + 2 / 3]) / cut
    third = np.concatenate([j[upright] + 1 / 3, j[turned] + 2 / 3]) / cut
    return np.column_stack([1.0 - second - third, second, third]), np.arange(second.size) < upright.sum()


def positive_shares(values: FloatArray) -> FloatArray:
    """Return which share of a triangle's area a linear function is positive on.

    Args:
        values: (k, 3) at the corners.

    Examples:
        >>> positive_shares(np.array([[-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [0.0, 0.0, 0.0]]))
        array([0.75, 0.25, 1.  ])
    """
    ordered: FloatArray = np.sort(values, axis=1)
    low, middle, high = ordered[:, 0], ordered[:, 1], ordered[:, 2]
    # The corner that is alone on its side of the line cuts off a triangle that is similar in two sides.
    alone = np.where(middle < 0.0, high, low)
    others = np.where(middle < 0.0, (low - high) * (middle - high), (middle - low) * (high - low))
    corner = np.divide(alone**2, others, out=np.zeros_like(alone), where=others > 0.0)
    return np.where(middle < 0.0, np.where(high > 0.0, corner, 0.0), np.where(low < 0.0, 1.0 - corner, 1.0))
