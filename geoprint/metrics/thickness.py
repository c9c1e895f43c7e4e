"""How thick, and how even, the layer is that a flow along paths leaves on a surface: the headline of evenness.

Every stretch of path puts its volume down where it lies. Then the volume spreads over the surface as heat does, and
nothing leaves over the rim:

    M u + t L u = b    after each of many small steps, with mass M and stiffness L of linear finite elements,

where b is the volume at each vertex and u the thickness [Crane2013, sec. 3.2 for M and L]. Paths one spacing apart
leave one thickness everywhere but for a ripple of 0.2 %; gaps, overlaps, ends, corners and rows that are off count as
what they leave behind. No level, no neighbour, no window and no threshold enters.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias, final

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from geoprint.geometry import closest, corner_cotangents, diagonal_matrix, lumped_mass, refine, stiffness
from geoprint.kernels import njit
from geoprint.metrics.deposited import Samples
from geoprint.metrics.oracle import FlatMesh, SurfacePath, spatial
from geoprint.metrics.spacing import SpacingAt, cut_evenly
from geoprint.model import FloatArray, IntArray, PoseStream, Rounded, Surface, recorded

# Numba looks for the sign of any other index whenever it is used.
UIntArray: TypeAlias = NDArray[np.uint32]

# Standard deviation of the spread over the spacing: about what a bead does that is as wide as its spacing.
SPREAD_SHARE = 0.6
# Edges of the triangles over the spacing: a CV is 0.01 to 0.04 points above what ever finer ones tend to.
EDGE_SHARE = 0.125
# Longest stretch of path that puts its volume down at its middle, over the spacing.
STRETCH_SHARE = 0.125
# Small steps of the spreading.
STEPS = 32
# Chebyshev coefficients whose sum is below this are left out: root mean square of what they change.
TRUNCATION = 1e-5
# Rows of a matrix that are multiplied at once, at least, and steps of the recurrence that pass over them while they are
# in the cache of the processor: about 1 MB.
BLOCK_ROWS = 1024
STEPS_TOGETHER = 8
# Fastest exchange between the corners of a triangle, per step: what is faster leaves them as equal as this does.
FASTEST = 1e3


@final
@recorded("ThicknessRecord")
class Thickness:
    """Thickness of a layer over all of the surface, each place weighted by its area; 1 is as wanted.

    Attributes:
        mean: mean thickness, over the wanted one.
        cv: coefficient of variation of the thickness: standard deviation over mean.
        within_5_percent: share of the area within 5 % of the wanted thickness.
        within_10_percent: share of the area within 10 % of the wanted thickness.
        smallest: smallest thickness, over the wanted one.
        largest: largest thickness, over the wanted one.
    """

    mean: Rounded
    cv: Rounded
    within_5_percent: Rounded
    within_10_percent: Rounded
    smallest: Rounded
    largest: Rounded


class Stretches(NamedTuple):
    """Middles of k short stretches of path, each between two of the places that its flow is given at.

    Attributes:
        places: (k, 3) [mm].
        lengths: (k,) [mm].
        before: (k,) which place lies before each; the one behind it follows.
        shares: (k,) how far each lies on the way between the two.
    """

    places: FloatArray
    lengths: FloatArray
    before: IntArray
    shares: FloatArray

    def volumes(self, flow: FloatArray) -> FloatArray:
        """Return the (k,) volume of each stretch for a flow at the places, linear between them [mm3/mm]."""
        return self.lengths * ((1.0 - self.shares) * flow[self.before] + self.shares * flow[self.before + 1])

    def at_ends(self, values: FloatArray, samples: Samples) -> FloatArray:
        """Return the (k,) mean over the stretches behind each sample of values of them."""
        count = samples.runs.size
        sums, counts = (np.bincount(self.before, each, minlength=count) for each in (values, np.ones(values.size)))
        # The last sample of a run has none behind it.
        last = np.flatnonzero(counts == 0)
        sums[last], counts[last] = sums[last - 1], counts[last - 1]
        return sums / counts


@final
class Levelling:
    """How volumes on a surface spread over it, whatever they are.

    Args:
        surface: what is covered.
        spacing: distance between neighbouring paths [mm].
        wanted: what it is at each place, where that differs.

    Attributes:
        surface: the same refined, n vertices, at which thickness is simulated.
        areas: (n,) of the vertices [mm2].
    """

    def __init__(self, surface: Surface, *, spacing: float, wanted: SpacingAt | None = None) -> None:
        least = spacing if wanted is None else min(spacing, float(wanted(surface.vertices).min()))
        self.surface = fine = refine(surface, edge_length=EDGE_SHARE * least)
        self.areas = lumped_mass(fine)
        widths = spacing if wanted is None else wanted(fine.vertices[fine.faces].mean(axis=1))
        times = 0.5 * (SPREAD_SHARE * widths) ** 2 / STEPS
        # The products of two cotangents each sum to one: a quadratic equation has the largest eigenvalue of a triangle.
        cotangents = corner_cotangents(fine)
        sums = cotangents.sum(axis=1)
        largest = 0.5 * (sums + np.sqrt(np.maximum(sums**2 - 3.0, 0.0)))
        times = np.minimum(times, FASTEST * self.areas[fine.faces].min(axis=1) / largest)
        scales = diagonal_matrix(1.0 / np.sqrt(self.areas))
        exchange = csr_array(scales @ stiffness(fine, cotangents * times[:, None]) @ scales)
        # No eigenvalue is above the largest sum of absolute values in a row.
        fastest = float(abs(exchange).sum(axis=1).max())
        self._coefficients = _damping(fastest)
        # Twice the matrix of a step with its eigenvalues moved to where the polynomials are: between -1 and 1.
        matrix = csr_array(exchange * (4.0 / fastest) - diagonal_matrix(np.full(self.areas.size, 2.0)))
        self._order = np.asarray(reverse_cuthill_mckee(matrix, symmetric_mode=True), dtype=np.int64)
        self._matrix = _reordered(matrix, self._order)
        rows = np.repeat(np.arange(self._order.size), np.diff(self._matrix.indptr))
        self._block = max(int(np.abs(self._matrix.indices - rows).max(initial=0)), BLOCK_ROWS)
        self._places = self._matrix.indptr.astype(np.uint32), self._matrix.indices.astype(np.uint32)

    def __call__(self, volumes: FloatArray) -> FloatArray:
        """Return the (n, 2) thicknesses that two times n volumes at the vertices leave [mm3, mm].

        All steps together are one function of the matrix of a step, (1 + x)^-32, which Chebyshev polynomials
        approximate on the interval of its eigenvalues [Trefethen2019, ch. 3].
        """
        scales, matrix = np.sqrt(self.areas)[self._order, None], self._matrix
        before = volumes[self._order] / scales
        now = 0.5 * (matrix @ before)
        total = self._coefficients[0] * before + self._coefficients[1] * now
        add_polynomials(*self._places, matrix.data, before, now, total, self._coefficients[2:], self._block)
        thickness = np.empty_like(total)
        thickness[self._order] = total / scales
        return thickness


@final
class LevelledLayer:
    """Answers how thick the layer becomes that volumes at places leave on a surface.

    Args:
        levelling: of the surface, refined to n vertices.
        places: (k, 3) where volumes are put down [mm].
    """

    def __init__(self, levelling: Levelling, places: FloatArray) -> None:
        self._levelling, fine = levelling, levelling.surface
        landed, _ = closest(fine, places)
        corners = fine.faces[landed.faces].ravel()
        indices = (corners, np.repeat(np.arange(len(places)), 3))
        self._put_down = csr_array((landed.weights.ravel(), indices), shape=(len(fine.vertices), len(places)))

    def __call__(self, volumes: FloatArray) -> Thickness:
        """Return the thickness for (k,) volumes at the places [mm3]."""
        return self.over_all(self.fields(volumes[:, None])[:, 0])

    def over_all(self, thickness: FloatArray) -> Thickness:
        """Return what a thickness at the n vertices [mm] is over all of the area."""
        areas = self._levelling.areas
        mean, whole = float(np.average(thickness, weights=areas)), float(areas.sum())
        within = [float(areas[np.abs(thickness - 1.0) <= share].sum()) / whole for share in (0.05, 0.1)]
        return Thickness(
            mean=mean,
            cv=float(np.sqrt(np.average((thickness - mean) ** 2, weights=areas))) / mean,
            within_5_percent=within[0],
            within_10_percent=within[1],
            smallest=float(thickness.min()),
            largest=float(thickness.max()),
        )

    def fields(self, volumes: FloatArray) -> FloatArray:
        """Return the (n, f) thicknesses at the vertices of the refined surface for (k, f) volumes [mm]."""
        put_down = np.asarray(self._put_down @ volumes)
        count = put_down.shape[1]
        pairs = np.pad(put_down, ((0, 0), (0, count % 2)))
        return np.hstack([self._levelling(pairs[:, k : k + 2]) for k in range(0, count, 2)])[:, :count]

    def at_places(self, thickness: FloatArray) -> FloatArray:
        """Return the (k,) thickness at the places, of one at the n vertices [mm]."""
        return np.asarray(self._put_down.T @ thickness)


def _damping(fastest: float) -> FloatArray:
    """Return Chebyshev coefficients of what all steps leave of rates between none and the fastest, (1 + x)^-32."""
    # More nodes than coefficients are needed: both grow with the square root.
    nodes = 64 * math.ceil(1.0 + math.sqrt(fastest))
    rates = 0.5 * fastest * (1.0 + np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes))
    coefficients: FloatArray = np.asarray(dct((1.0 + rates) ** -STEPS), dtype=float) / nodes
    coefficients[0] /= 2.0
    left = np.cumsum(np.abs(coefficients[::-1]))[::-1]
    kept = coefficients[: max(int(np.argmax(left < TRUNCATION)), 2)]
    # What is even stays, so that no volume is lost: the polynomial is 1 where the rate is 0.
    kept[0] += 1.0 - kept[::2].sum() + kept[1::2].sum()
    return kept


def _reordered(matrix: csr_array, order: IntArray) -> csr_array:
    """Return a square matrix with rows and columns in another order; the entries of a row stay in theirs."""
    rows, places = csr_array(matrix[order]), np.empty_like(order)
    places[order] = np.arange(order.size)
    return csr_array((rows.data, places[rows.indices], rows.indptr), shape=matrix.shape)


@njit
def add_polynomials(
    first: UIntArray, columns: UIntArray, values: FloatArray, before: FloatArray, now: FloatArray, total: FloatArray,
    coefficients: FloatArray, block: int,
) -> None:  # fmt: skip
    """Add terms of a Chebyshev series of a matrix times two vectors to what the first two terms have summed up to.

    Each polynomial is the matrix times the last one, less the one before that, whose place it takes. Rows reach at most
    one block of rows to either side, so that a step may follow the step before it one block behind: some steps pass
    over a block before it leaves the cache.

    Args:
        first: (n + 1,) entry that each row begins with.
        columns: (e,) of the entries.
        values: (e,) of the entries.
        before: (n, 2) first polynomial; changed.
        now: (n, 2) second one; changed.
        total: (n, 2) is added to.
        coefficients: (c,) of the polynomials from the third on.
        block: rows in one.
    """
    rows = first.size - 1
    blocks = (rows + block - 1) // block
    for begun in range(0, coefficients.size, STEPS_TOGETHER):
        steps = min(STEPS_TOGETHER, coefficients.size - begun)
        for wave in range(blocks + steps - 1):
            for step in range(max(0, wave - blocks + 1), min(steps, wave + 1)):
                last, after = (now, before) if (begun + step) % 2 == 0 else (before, now)
                coefficient, start = coefficients[begun + step], (wave - step) * block
                for row in range(np.uint64(start), np.uint64(min(rows, start + block))):
                    one, two = 0.0, 0.0
                    for entry in range(np.uint64(first[row]), np.uint64(first[row + np.uint64(1)])):
                        column, value = np.uint64(columns[entry]), values[entry]
                        one += value * last[column, 0]
                        two += value * last[column, 1]
                    after[row, 0] = one - after[row, 0]
                    after[row, 1] = two - after[row, 1]
                    total[row, 0] += coefficient * after[row, 0]
                    total[row, 1] += coefficient * after[row, 1]


def stretches_of_poses(poses: PoseStream, *, spacing: float) -> Stretches:
    """Cut what is deposited between poses into equal stretches; flow is given at the (p,) poses.

    Args:
        poses: p of them.
        spacing: [mm].
    """
    deposited = np.flatnonzero(poses.deposited)
    points = poses.surface_points
    start, along = points[deposited], points[deposited + 1] - points[deposited]
    lengths = np.linalg.norm(along, axis=1)
    owner, shares, counts = cut_evenly(lengths, step=STRETCH_SHARE * spacing)
    places = start[owner] + shares[:, None] * along[owner]
    return Stretches(places, (lengths / counts)[owner], deposited[owner], shares)


def stretches_of_path(mesh: FlatMesh, path: SurfacePath, samples: Samples, *, spacing: float) -> Stretches:
    """Cut a path between samples into equal stretches; flow is given at the samples.

    Args:
        mesh: that the path lies on.
        path: r runs.
        samples: k samples along all of them, ends included.
        spacing: [mm].
    """
    between = np.flatnonzero(np.diff(samples.runs) == 0)
    lengths = np.diff(samples.arcs)[between]
    owner, shares, counts = cut_evenly(lengths, step=STRETCH_SHARE * spacing)
    arcs = samples.arcs[between][owner] + shares * lengths[owner]
    places = spatial(mesh, path.at(samples.runs[between][owner], arcs))
    return Stretches(places, (lengths / counts)[owner], between[owner], shares)
