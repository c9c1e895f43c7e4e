"""Geodesic distance by the heat method [Crane2013] on the intrinsic Delaunay triangulation."""

from __future__ import annotations

from math import sqrt
from typing import ClassVar, final

import numpy as np
from scipy.sparse import coo_array, csc_array

from geoprint.distance.interface import Accuracy, level_distances, linear_edge_length
from geoprint.distance.intrinsic import IntrinsicTriangulation, delaunay, doubled_areas, intrinsic_triangulation
from geoprint.distance.isolines import isolines
from geoprint.distance.sparse_solver import SymmetricSolver, nested_dissection, picked
from geoprint.errors import FieldError, MeshError, UsageError
from geoprint.geometry import diagonal_matrix, positions
from geoprint.kernels import njit
from geoprint.model import BoolArray, Contours, FloatArray, IntArray, ScalarField, Source, Surface
from geoprint.threads import both, single_threaded_blas

# Linear finite elements on an intrinsic triangulation: stiffness, mass, and gradients made unit length.
#
# Everything follows from side lengths. For a function f, linear in each triangle T, the stiffness of one triangle
# gives (L_T f)_i = integral over T of grad f . grad phi_i and f . L_T f = area |grad f|^2, so that neither
# coordinates nor a layout of the triangle in a plane are needed [Crane2013, sec. 3.2].


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


# Geodesic distance by the heat method [Crane2013] on the intrinsic Delaunay triangulation.
#
# Heat that flows from the source for a short time t falls off so fast that -sqrt(t) log u approaches the distance
# (Varadhan's formula) and its gradient points along geodesics; the distance is the function whose gradient fits the
# directions best. That fit is then repeated with its own directions, which takes it towards the least of the
# integral of (|grad d| - 1)^2. The source is a curve held at its distance, not a sum of point sources, so that the
# front starts parallel to it.


# Temperatures below this are not trusted: smaller ones lose digits, 1e-308 is the smallest normal number. What is
# colder is solved for again, from where the heat has got to.
COLDEST = 1e-250

# Up to so many unknowns both systems are factorised at the same time; a factor of so many takes 0.3 GB.
BESIDE = 200_000

# Share of the last change that is added before the next fit: 6 fits then do what 16 do without it; at 0.9 they
# overshoot.
MOMENTUM = 0.8

# Steepness below which a triangle counts as lying over a ridge, where fronts meet, and above which it does not. Made
# unit length there too, gradients lift the ridge by half an edge, and all that flows towards it.
RIDGE = (0.85, 1.0)


@final
class Heat:
    """The `heat` backend: any topology, any source.

    What does not depend on the source (triangulation, matrices, elimination order) is made here. The distance is made
    when a source is first asked for, and kept until another one is; the factors of the two linear systems, which take
    more memory than all else, are let go as soon as they have served.

    Args:
        surface: an orientable manifold whose triangles are a few times smaller than the wanted spacing.
        time_factor: diffusion time t as a multiple of the squared mean edge length. Measured on nine surfaces, smooth,
            folded and pierced (benchmarks/paths/geodesic.py): larger times are better where no fronts meet (cap, cone),
            but heat rounds a ridge over a width of sqrt(t), which spoils a pierced sheet from 1 on; smaller ones
            follow the edges of the mesh. [Crane2013, sec. 3.2.4] takes 1.
        renormalisations: how often the distance is fitted again to its own directions. Each costs one solution of a
            system that is already factorised; 12 leave a sixth (cap) to two thirds (pierced sheet) of the error.

    Raises:
        UsageError: the time factor is not positive, or the number of renormalisations is negative.
        MeshError: the surface is no manifold, or a triangle has no area.
    """

    title: ClassVar[str] = "heat method on the mesh"
    summary: ClassVar[str] = "Diffuses heat over the surface and fits a distance to its gradient."
    accuracy: ClassVar[Accuracy] = Accuracy.EDGE_LENGTH
    compared: ClassVar[bool] = True

    def __init__(self, surface: Surface, *, time_factor: float = 0.5, renormalisations: int = 12) -> None:
        if not time_factor > 0.0:
            raise UsageError(f"time_factor is {time_factor}; it must be positive, 0.5 is the usual choice.")
        if renormalisations < 0:
            raise UsageError(f"renormalisations is {renormalisations}; it must be 0 or more, 12 is the usual choice.")
        self._surface = surface
        self._renormalisations = renormalisations
        self._elements = Elements(delaunay(intrinsic_triangulation(surface)))
        self._time = time_factor * self._elements.mean_length**2
        self._order = nested_dissection(self._elements.stiffness, coordinates=surface.vertices)
        self._fields: dict[bytes, ScalarField] = {}

    @staticmethod
    def edge_length(_part: Surface, *, spacing: float) -> float:
        """Return how long edges may be for even contours at a spacing [mm]."""
        return linear_edge_length(spacing=spacing)

    def distance(self, source: Source) -> ScalarField:
        """Return the geodesic distance from the source at the vertices [mm].

        Vertices of the source are held at zero; where it runs inside a triangle, the corners of that triangle are
        held at their straight distance from it.

        Raises:
            FieldError: the source touches every vertex, or heat does not reach a part of the surface.
        """
        held, held_distances = held_vertices(self._surface, source)
        key = held.tobytes() + held_distances.tobytes()
        if key not in self._fields:
            self._fields.clear()
            self._fields[key] = self._fitted(held, held_distances)
        return self._fields[key]

    def contours(self, source: Source, *, spacing: float) -> Contours:
        """Return the level curves at (k + 1/2) * spacing from the source [mm].

        Raises:
            FieldError: the surface is so small that not even the first level lies on it.
        """
        field = self.distance(source)
        levels = level_distances(field, spacing=spacing)
        curves, curve_levels = isolines(self._surface, field, levels=levels)
        return Contours(curves, curve_levels, spacing, field)

    def _fitted(self, held: IntArray, held_distances: FloatArray) -> ScalarField:
        system = _Held(self._elements, held, held_distances, time=self._time, order=self._order)
        values = system.fitted(system.varadhan)
        behind = values
        for _ in range(self._renormalisations):
            ahead = values + MOMENTUM * (values - behind)
            behind, values = values, system.fitted(ahead, ridge=RIDGE)
        return ScalarField(np.maximum(values, 0.0))


@final
class _Held:
    """The heat equation, solved, and the Poisson equation, factorised, with a set of vertices held.

    Attributes:
        varadhan: (n,) -sqrt(t) log u of the heat u after the time t [mm].

    Raises:
        FieldError: every vertex is held, or a part of the surface has no held vertex.
    """

    def __init__(
        self, elements: Elements, held: IntArray, held_distances: FloatArray, *, time: float, order: IntArray
    ) -> None:
        self._elements, self._time, self._order = elements, time, order
        self._held, self._held_distances = held, held_distances
        known = np.zeros(elements.mass.size, dtype=np.bool_)
        known[held] = True
        if known.all():
            raise FieldError(
                "every vertex of the surface belongs to the source, so there is no distance to compute: choose a "
                "smaller spacing."
            )
        free = np.flatnonzero(~known)
        self._free, self._coupling = free, csc_array(elements.stiffness[:, held][free])
        # SuperLU lets go of the interpreter, so that both systems are factorised at the same time; large ones would
        # not fit beside one another. The factor that is kept is made in this thread: the memory of one that outlives
        # its thread is never given back [SciPy, issue 15921].
        with single_threaded_blas():
            if free.size <= BESIDE:
                self._poisson, self.varadhan = both(self._poisson_solver, lambda: self._warmed(known))
            else:
                self.varadhan, self._poisson = self._warmed(known), self._poisson_solver()

    def fitted(self, values: FloatArray, *, ridge: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
        """Return the (n,) function whose gradient fits best to the unit gradient of (n,) others [mm].

        `ridge` is that of `Elements.flow_of_unit_gradient`.
        """
        flow = self._elements.flow_of_unit_gradient(values, ridge=ridge)
        fit = np.empty(values.size)
        fit[self._held] = self._held_distances
        fit[self._free] = self._poisson.solve(flow[self._free] - self._coupling @ self._held_distances)
        return fit

    def _warmed(self, known: BoolArray) -> FloatArray:
        """Return `varadhan`, with these vertices held.

        Heat falls below the smallest number about 500 edge lengths from the source. The equation is local: where it has
        become cold, the same equation is solved again with the last warm vertices held, all scaled up.

        Raises:
            FieldError: heat does not reach some vertices, because nothing connects them to the source.
        """
        known, reach = known.copy(), np.zeros(known.size)
        reach[self._held] = self._held_distances
        while not known.all():
            self._spread(self._heat_solver(~known), known, reach)
        return reach

    def _spread(self, solver: SymmetricSolver, known: BoolArray, reach: FloatArray) -> None:
        """Fill in `reach` and mark as known what heat gets to from the known vertices."""
        width = np.sqrt(self._time)
        free = np.flatnonzero(~known)
        coupling = csc_array(self._elements.conductance[:, known][free])
        rim = np.flatnonzero(np.diff(coupling.indptr))
        rim_reach = reach[known][rim]
        nearest = float(rim_reach.min(initial=np.inf))
        warmth = np.exp((nearest - rim_reach) / width)
        heat = solver.solve(-self._time * (coupling[:, rim] @ warmth))
        warm = heat > COLDEST
        if not warm.any():
            raise FieldError(
                f"heat does not reach {free.size} of {known.size} vertices, which are not connected to the source: "
                "put a source on every part of the surface."
            )
        reach[free[warm]] = nearest - width * np.log(heat[warm])
        known[free[warm]] = True

    def _poisson_solver(self) -> SymmetricSolver:
        kept = np.zeros(self._elements.mass.size, dtype=np.bool_)
        kept[self._free] = True
        return SymmetricSolver(picked(self._elements.stiffness, self._free), order=restricted(self._order, kept))

    def _heat_solver(self, free: BoolArray) -> SymmetricSolver:
        rows = np.flatnonzero(free)
        conductance = picked(self._elements.conductance, rows)
        system = csc_array(diagonal_matrix(self._elements.mass[rows]) + self._time * conductance)
        return SymmetricSolver(system, order=restricted(self._order, free))


def restricted(order: IntArray, kept: BoolArray) -> IntArray:
    """Return the order of the kept unknowns among themselves, numbered anew; separators remain separators.

    Examples:
        >>> restricted(np.array([3, 0, 2, 1]), np.array([True, False, True, True]))
        array([2, 0, 1])
    """
    return (np.cumsum(kept) - 1)[order[kept[order]]]


def held_vertices(surface: Surface, source: Source) -> tuple[IntArray, FloatArray]:
    """Return the vertices that hold the source and their straight distance from it.

    Args:
        surface: n vertices.
        source: curves and points.

    Returns:
        (h,) vertex indices, ascending, and (h,) distances [mm]: 0 for vertices on the source; corners of a triangle
        that the source crosses or lies in carry the distance to its nearest piece in that triangle. Where the source
        consists of vertices only, nothing but these vertices is held.
    """
    points = source.curves.points
    corners = surface.faces[points.faces]
    at_vertex = points.weights.max(axis=1) > 1.0 - 1e-9
    on_source = corners[at_vertex, np.argmax(points.weights[at_vertex], axis=1)]
    inside = ~at_vertex
    distances = np.full(surface.vertices.shape[0], np.inf)
    here = positions(surface, points)
    first, last = _pieces_within(source, inside)
    for corner in range(3):
        vertices = corners[first, corner]
        reach = _distance_to_segments(surface.vertices[vertices], here[first], here[last])
        np.minimum.at(distances, vertices, reach)
    distances[on_source] = 0.0
    held = np.flatnonzero(np.isfinite(distances))
    return held, distances[held]


def _pieces_within(source: Source, inside: BoolArray) -> tuple[IntArray, IntArray]:
    """Return first and last point of every piece of the source in a triangle; a point off the vertices is one too."""
    curves = source.curves
    index = np.arange(inside.size)
    ends = np.zeros(inside.size, dtype=np.bool_)
    ends[curves.offsets[1:] - 1] = True
    first = index[~ends]
    crossing = inside[first] | inside[np.minimum(first + 1, inside.size - 1)]
    alone = index[inside]
    return np.concatenate([first[crossing], alone]), np.concatenate([first[crossing] + 1, alone])


def _distance_to_segments(points: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the (k,) distance from each point to its own segment [mm]."""
    along = ends - starts
    length_squared = np.einsum("ij,ij->i", along, along)
    share = np.einsum("ij,ij->i", points - starts, along) / np.maximum(length_squared, np.finfo(np.float64).tiny)
    nearest = starts + np.clip(share, 0.0, 1.0)[:, None] * along
    away = points - nearest
    return np.sqrt((away * away).sum(axis=1))
