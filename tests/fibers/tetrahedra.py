"""The rule of a ventricle's fibres solved once more, sharing no code: linear tetrahedra that end at the wall's surface.

Every cube between eight voxels is six tetrahedra, one for each order of its sides; where a smoothed wall ends within
one it is cut there, into tetrahedra again, by the order of its corners, so that neighbours are cut alike.
"""

from __future__ import annotations

import gzip
from itertools import permutations
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.linalg import cg
from scipy.spatial import KDTree
from threadpoolctl import threadpool_limits

from geoprint.model import BoolArray, FloatArray, IntArray

# Smoothing of labels [voxels], and what counts as no distance to the surface, so that no tetrahedron is a sliver.
SMOOTHED, CRUMB = 1.0, 0.05
# Tetrahedra of what is inside, by how many corners are: a digit is a corner, two are the cut between both.
CUTS = {
    1: [("0", "01", "02", "03")],
    2: [("0", "02", "03", "13"), ("0", "02", "12", "13"), ("0", "1", "12", "13")],
    3: [("0", "1", "2", "23"), ("0", "1", "13", "23"), ("0", "03", "13", "23")],
    4: [("0", "1", "2", "3")],
}


class Solved(NamedTuple):
    """The rule's own fibres.

    Attributes:
        places: (v, 3) [mm].
        depths: (v,) from 0 outside to 1 at the cavity.
        inwards: (v, 3) gradient of the depth [1/mm].
        upwards: (v, 3) gradient of the height, from apex to base [1/mm].
    """

    places: FloatArray
    depths: FloatArray
    inwards: FloatArray
    upwards: FloatArray

    def frames(self, places: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (k,) depths of (k, 3) places [mm], and (k, 3) unit vectors around the ventricle and up there."""
        _, near = KDTree(self.places).query(places)
        at = np.asarray(near, dtype=np.int64)
        depths = self.depths[at] + np.einsum("kx,kx->k", self.inwards[at], places - self.places[at])
        outwards, up = -_unit(self.inwards[at]), self.upwards[at]
        up = _unit(up - np.einsum("kx,kx->k", up, outwards)[:, None] * outwards)
        return np.clip(depths, 0.0, 1.0), np.cross(up, outwards), up

    def fibres(self, places: FloatArray, *, epicardial: float, endocardial: float) -> tuple[FloatArray, FloatArray]:
        """Return (k, 3) unit fibres at (k, 3) places [mm], and (k,) their helix angles [rad]."""
        depths, around, up = self.frames(places)
        angles = epicardial + (endocardial - epicardial) * depths
        return np.cos(angles)[:, None] * around + np.sin(angles)[:, None] * up, angles


def solved(path: Path, *, wall: list[int], cavity: list[int], base: list[int]) -> Solved:
    """Solve for depth and height in the wall of a NIfTI file of 1 mm voxels."""
    labels, affine = _read(path)
    kinds = [np.isin(labels, each) for each in (wall, cavity, base)]
    hollow, beyond, filled = (_smooth(each) for each in (kinds[1], kinds[2], kinds[0] | kinds[1] | kinds[2]))
    inside = np.minimum(np.minimum(filled - 0.5, 0.5 - hollow), 0.5 - beyond)
    inside = np.where(np.abs(inside) < CRUMB, np.where(inside < 0.0, -CRUMB, CRUMB), inside)
    places, tets, ends = _clipped(inside)
    kept = _largest(tets, len(places))
    used, renumbered = np.unique(tets[kept], return_inverse=True)
    places, tets, ends = places[used], renumbered.reshape(-1, 4), ends[used]
    sampled = [ndimage.map_coordinates(each, places.T, order=1) for each in (hollow, beyond, filled)]
    nearest = np.abs(np.stack(sampled) - 0.5).argmin(axis=0)
    xyz = places @ affine[:3, :3].T + affine[:3, 3]
    gradients, volumes = _gradients(xyz, tets)
    depths = _harmonic(tets, gradients, volumes, ends & (nearest != 1), (nearest == 0).astype(np.float64))
    # By voxels: cuts lie closer together along the diagonals of cubes.
    beside = np.argwhere(kinds[2] & ndimage.binary_dilation(kinds[0])).mean(axis=0)
    away = np.linalg.norm(xyz - (affine[:3, :3] @ beside + affine[:3, 3]), axis=1)
    apex, top = away > 0.95 * away.max(), ends & (nearest == 1)
    heights = _harmonic(tets, gradients, volumes, apex | top, top.astype(np.float64))
    slopes = [_at_corners(tets, gradients, volumes, values) for values in (depths, heights)]
    return Solved(xyz, depths, slopes[0], slopes[1])


def _read(path: Path) -> tuple[IntArray, FloatArray]:
    """Return labels of one byte and (4, 4) the places of their voxels, as the header has them."""
    data = gzip.decompress(path.read_bytes())
    shape, (kind,) = np.frombuffer(data, "<i2", 3, 42), np.frombuffer(data, "<i2", 1, 70)
    assert kind == np.int16(2)
    (start,) = np.frombuffer(data, "<f4", 1, 108).astype(int)
    rows = np.frombuffer(data, "<f4", 12, 280).reshape(3, 4).astype(np.float64)
    labels = np.frombuffer(data, np.uint8, int(shape.prod(dtype=np.int64)), int(start))
    return labels.reshape(shape.tolist(), order="F").astype(np.int64), np.vstack([rows, [0.0, 0.0, 0.0, 1.0]])


def _smooth(voxels: BoolArray) -> FloatArray:
    return np.asarray(ndimage.gaussian_filter(voxels.astype(np.float64), SMOOTHED), dtype=np.float64)


def _clipped(inside: FloatArray) -> tuple[FloatArray, IntArray, BoolArray]:
    """Return (v, 3) corners in voxels and (t, 4) tetrahedra of where a function is positive, and which are cuts."""
    shape = np.array(inside.shape)
    cubes = np.argwhere(ndimage.maximum_filter(inside, size=2, origin=-1)[:-1, :-1, :-1] > 0.0)
    tets = np.concatenate([_path(cubes, order, shape) for order in permutations(range(3))])
    values = inside.ravel()[tets]
    order = np.lexsort((tets, -values), axis=1)
    tets, values = np.take_along_axis(tets, order, axis=1), np.take_along_axis(values, order, axis=1)
    count = inside.size
    found = list[IntArray]()
    for within, pieces in CUTS.items():
        own = tets[(values > 0.0).sum(axis=1) == within]
        for piece in pieces:
            # A cut is named by the pair of its corners.
            names = [
                own[:, int(name)] if len(name) == 1 else count + own[:, int(name[0])] * count + own[:, int(name[1])]
                for name in piece
            ]
            found.append(np.column_stack(names))
    names, numbered = np.unique(np.concatenate(found), return_inverse=True)
    cut = names >= count
    first, second = np.where(cut, (names - count) // count, names), np.where(cut, (names - count) % count, names)
    ends = [np.column_stack(np.unravel_index(each, inside.shape)).astype(np.float64) for each in (first, second)]
    low, high = inside.ravel()[first], inside.ravel()[second]
    share = np.where(cut, low / np.where(cut, low - high, 1.0), 0.0)[:, None]
    return ends[0] + share * (ends[1] - ends[0]), numbered.reshape(-1, 4), cut


def _path(cubes: IntArray, order: tuple[int, ...], shape: IntArray) -> IntArray:
    """Return the (c, 4) corners of the tetrahedron of each cube along its sides in an order."""
    corner, corners = cubes.copy(), [cubes]
    for axis in order:
        corner = corner + np.eye(3, dtype=np.int64)[axis]
        corners.append(corner)
    return np.column_stack([np.ravel_multi_index(tuple(each.T), tuple(shape)) for each in corners]).astype(np.int64)


def _largest(tets: IntArray, count: int) -> BoolArray:
    """Return which tetrahedra are of the largest piece."""
    from scipy.sparse.csgraph import connected_components

    pairs = np.concatenate([tets[:, [0, 1]], tets[:, [1, 2]], tets[:, [2, 3]]])
    graph = csr_array((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, labels = connected_components(graph, directed=False)
    own = labels[tets[:, 0]]
    return np.asarray(own == np.bincount(own).argmax())


def _gradients(places: FloatArray, tets: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return (t, 4, 3) gradients of the functions that are 1 at one corner, and (t,) volumes."""
    sides = places[tets[:, 1:]] - places[tets[:, :1]]
    inner: FloatArray = np.asarray(np.linalg.inv(sides), dtype=np.float64).transpose(0, 2, 1)
    volumes = np.abs(np.asarray(np.linalg.det(sides), dtype=np.float64)) / 6.0
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1), volumes


def _harmonic(
    tets: IntArray, gradients: FloatArray, volumes: FloatArray, held: BoolArray, values: FloatArray
) -> FloatArray:
    """Return (v,) values that are harmonic where they are not held."""
    elements = np.einsum("t,tax,tbx->tab", volumes, gradients, gradients)
    rows, columns = np.repeat(tets, 4, axis=1).ravel(), np.tile(tets, (1, 4)).ravel()
    matrix = csr_array((elements.ravel(), (rows, columns)), shape=(held.size, held.size))
    free = np.flatnonzero(~held)
    found = np.where(held, values, 0.0)
    inner, right = matrix[free][:, free], -(matrix[free] @ found)
    scale = csr_array((1.0 / inner.diagonal(), (np.arange(free.size), np.arange(free.size))), shape=inner.shape)
    with threadpool_limits(limits=1, user_api="blas"):
        found[free], failed = cg(inner, right, rtol=1e-7, M=scale)
    assert failed == 0
    return found


def _at_corners(tets: IntArray, gradients: FloatArray, volumes: FloatArray, values: FloatArray) -> FloatArray:
    """Return (v, 3) gradients of a function at corners: the mean of those around each, weighted by volume."""
    slopes = np.einsum("tax,ta->tx", gradients, values[tets]) * volumes[:, None]
    sums, weights = np.zeros((values.size, 3)), np.bincount(tets.ravel(), np.repeat(volumes, 4), minlength=values.size)
    for corner in range(4):
        for axis in range(3):
            sums[:, axis] += np.bincount(tets[:, corner], slopes[:, axis], minlength=values.size)
    return sums / weights[:, None]


def _unit(vectors: FloatArray) -> FloatArray:
    lengths: FloatArray = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / lengths
