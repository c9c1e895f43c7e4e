"""Linear finite elements on an intrinsic triangulation: stiffness, mass, and gradients made unit length.

Everything follows from side lengths. For a function f, linear in each triangle T, the stiffness of one triangle gives
(L_T f)_i = integral over T of grad f . grad phi_i and f . L_T f = area |grad f|^2, so that neither coordinates nor a
layout of the triangle in a plane are needed [Crane2013, sec. 3.2].
"""

from __future__ import annotations

from math import sqrt
from typing import final

import numpy as np
from scipy.sparse import coo_array, csc_array

from geoprint.backends.intrinsic import IntrinsicTriangulation, doubled_areas
from geoprint.errors import MeshError
from geoprint.kernels import njit
from geoprint.model import FloatArray, IntArray

# Where the values at the corners of a triangle differ by less than this share of themselves, rounding decides the
# direction of the gradient, so that it has none.
FLAT_SHARE = 1e-13


@final
class Elements:
    """The matrices of an intrinsic triangulation.

    Args:
        triangulation: n vertices, m triangles.

    Raises:
        MeshError: a triangle has no area.

    Attributes:
        stiffness: (n, n) L_ij = integral of grad phi_i . grad phi_j: symmetric, positive semi-definite, rows sum to
            zero, natural (Neumann) condition at the border. Minus the cotangent Laplacian.
        conductance: (n, n) the same less its negative weights, which flips leave at obtuse angles opposite to the
            border alone. With it the heat equation keeps the maximum principle, so that temperatures are positive.
        mass: (n,) area of each vertex, a third of every triangle around it [mm2].
        mean_length: of the sides of the triangles [mm].
    """

    def __init__(self, triangulation: IntrinsicTriangulation) -> None:
        areas = doubled_areas(triangulation) / 2
        if not areas.all():
            face = int(np.argmin(areas))
            raise MeshError(
                f"triangle {face} with sides {triangulation.lengths[face].tolist()} mm has no area; prepare the "
                "surface first, which drops such faces.",
                face=face,
            )
        self._corners = triangulation.corners
        self._areas = areas
        self._weights = _half_cotangents(triangulation.lengths, areas)
        thirds = np.repeat(areas / 3, 3)
        self.mass: FloatArray = np.bincount(
            triangulation.corners.ravel(), thirds, minlength=triangulation.vertex_count
        ).astype(np.float64)
        self.mean_length = float(triangulation.lengths.mean())
        starts, ends, weights = _edges(triangulation.corners, triangulation.twins, self._weights)
        self.stiffness = _graph_laplacian(starts, ends, weights, count=self.mass.size)
        self.conductance = _graph_laplacian(starts, ends, np.maximum(weights, 0.0), count=self.mass.size)

    def flow_of_unit_gradient(self, values: FloatArray, *, ridge: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
        """Return the (n,) integral of X . grad phi_i, where X is grad f made unit length: L d for the d that fits X.

        Args:
            values: (n,) the function f. Triangles in which it is flat count as zero.
            ridge: a triangle over a ridge of a distance, where fronts meet, has a gradient shorter than 1, the mean
                of those on both sides. Gradients shorter than the first number stay as they are, those longer than
                the second become unit length, those between in proportion.
        """
        return _unit_flow(self._corners, self._weights, self._areas, values, ridge)


def _half_cotangents(lengths: FloatArray, areas: FloatArray) -> FloatArray:
    """Return (m, 3) half the cotangent of the angle opposite to each side."""
    squares = lengths * lengths
    others = squares[:, [1, 2, 0]] + squares[:, [2, 0, 1]]
    return (others - squares) / (8.0 * areas[:, None])


@njit
def _edges(corners: IntArray, twins: IntArray, weights: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Return start, end and weight of every edge once; edges from a vertex to itself carry nothing."""
    starts, ends = np.empty(corners.size, np.int64), np.empty(corners.size, np.int64)
    sums = np.empty(corners.size)
    count = 0
    flat_twins, flat_weights = twins.ravel(), weights.ravel()
    for face in range(corners.shape[0]):
        for side in range(3):
            half = 3 * face + side
            start, end = corners[face, side], corners[face, (side + 1) % 3]
            twin = flat_twins[half]
            if (twin > half or twin < 0) and start != end:
                starts[count], ends[count] = start, end
                sums[count] = flat_weights[half] + (flat_weights[twin] if twin >= 0 else 0.0)
                count += 1
    return starts[:count], ends[:count], sums[:count]


def _graph_laplacian(starts: IntArray, ends: IntArray, weights: FloatArray, *, count: int) -> csc_array[np.float64]:
    """Return the (n, n) matrix of sum over edges of weight (f_start - f_end)^2."""
    diagonal = np.zeros(count)
    diagonal += np.bincount(starts, weights, minlength=count)
    diagonal += np.bincount(ends, weights, minlength=count)
    each = np.arange(count)
    rows, columns = np.concatenate([starts, ends, each]), np.concatenate([ends, starts, each])
    return csc_array(coo_array((np.concatenate([-weights, -weights, diagonal]), (rows, columns)), shape=(count, count)))


@njit
def _unit_flow(
    corners: IntArray, weights: FloatArray, areas: FloatArray, values: FloatArray, ridge: tuple[float, float]
) -> FloatArray:
    """Sum L_T f |X| / |grad f| over the triangles T.

    With a, b, c the values at the corners, the half cotangents w of the angles opposite to the sides weigh the
    differences along the sides.
    """
    flow = np.zeros(values.size)
    short, whole = ridge
    for face in range(corners.shape[0]):
        i, j, k = corners[face, 0], corners[face, 1], corners[face, 2]
        along = weights[face, 0] * (values[j] - values[i])
        beyond = weights[face, 1] * (values[k] - values[j])
        back = weights[face, 2] * (values[i] - values[k])
        energy = along * (values[j] - values[i]) + beyond * (values[k] - values[j]) + back * (values[i] - values[k])
        highest, lowest = max(values[i], values[j], values[k]), min(values[i], values[j], values[k])
        if highest - lowest <= FLAT_SHARE * max(abs(highest), abs(lowest)) or energy <= 0.0:
            continue
        steepness = sqrt(energy / areas[face])
        scale = 1.0 / steepness
        if steepness < whole:
            kept = min((whole - steepness) / (whole - short), 1.0)
            scale = kept + (1.0 - kept) * scale
        flow[i] += scale * (back - along)
        flow[j] += scale * (along - beyond)
        flow[k] += scale * (beyond - back)
    return flow
