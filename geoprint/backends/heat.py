"""Geodesic distance by the heat method [Crane2013], level curves traced per triangle.

Heat that flows from the seed for a short time t falls off so fast that its gradient points along geodesics
(Varadhan's formula); the distance is the function whose gradient fits the normalised directions best. Two sparse
systems, each factorised once per seed. The seed is a curve held at a fixed temperature, not a sum of point sources,
so that the front starts parallel to it.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.sparse import csc_array, diags_array

from geoprint.backends.isolines import isolines
from geoprint.backends.levels import level_distances
from geoprint.backends.sparse_solver import SymmetricSolver
from geoprint.errors import FieldError, UsageError
from geoprint.model import BoolArray, Contours, FloatArray, IntArray, ScalarField, Seed, Surface
from geoprint.surfaces import (
    cotangent_laplacian,
    divergence,
    edge_lengths,
    gradient,
    lumped_mass,
    positions,
)

# Gradients of the heat are judged against the largest temperature in their triangle; below this they have no direction.
FLAT_GRADIENT = 1e-12


@final
class Heat:
    """The `heat` backend: any topology, any seed.

    Args:
        surface: an orientable manifold whose triangles are a few times smaller than the wanted spacing.
        time_factor: diffusion time as a multiple of the squared mean edge length. 1 follows [Crane2013, section
            3.2.4]: smaller times leave the direction to rounding errors, larger ones smooth the distance.

    Raises:
        UsageError: the time factor is not positive.
    """

    def __init__(self, surface: Surface, *, time_factor: float = 1.0) -> None:
        if not time_factor > 0.0:
            raise UsageError(f"time_factor is {time_factor}; it must be positive, 1 is the usual choice.")
        self._surface = surface
        self._laplacian = cotangent_laplacian(surface)
        self._mass = lumped_mass(surface)
        self._time = time_factor * float(edge_lengths(surface).mean()) ** 2

    def distance(self, seed: Seed) -> ScalarField:
        """Return the geodesic distance from the seed at the vertices [mm].

        Vertices of the seed are held at zero; where the seed runs inside a triangle, the corners of that triangle are
        held at their straight distance from it.

        Raises:
            FieldError: the seed touches every vertex, or heat does not reach a part of the surface.
        """
        held, held_distances = held_vertices(self._surface, seed)
        free = np.setdiff1d(np.arange(self._mass.size), held)
        if free.size == 0:
            raise FieldError(
                "every vertex of the surface belongs to the seed, so there is no distance to compute: refine the mesh "
                "or choose a smaller spacing."
            )
        directions = self._directions(free, held, held_distances)
        target = -divergence(self._surface, directions)
        values = np.zeros(self._mass.size)
        values[held] = held_distances
        stiffness = self._laplacian[free]
        solver = self._solver(csc_array(stiffness[:, free]), free)
        values[free] = solver.solve(target[free] - stiffness[:, held] @ held_distances)
        return ScalarField(np.maximum(values, 0.0))

    def contours(self, seed: Seed, *, spacing: float) -> Contours:
        """Return the level curves at (k + 1/2) * spacing from the seed [mm].

        Raises:
            FieldError: the surface is so small that not even the first level lies on it.
        """
        field = self.distance(seed)
        levels = level_distances(field, spacing=spacing)
        curves, curve_levels = isolines(self._surface, field, levels=levels)
        return Contours(curves, curve_levels, spacing, field)

    def _directions(self, free: IntArray, held: IntArray, held_distances: FloatArray) -> FloatArray:
        """Return the (m, 3) unit directions away from the seed."""
        heat = np.empty(self._mass.size)
        heat[held] = np.exp(-held_distances / np.sqrt(self._time))
        stiffness = self._time * self._laplacian[free]
        system = csc_array(diags_array(self._mass[free]) + stiffness[:, free])
        heat[free] = self._solver(system, free).solve(-np.asarray(stiffness[:, held] @ heat[held]))
        # Far from the seed heat is tiny: each triangle is scaled to its own largest temperature before squaring.
        scale = np.abs(heat[self._surface.faces]).max(axis=1)
        if scale.min() <= np.finfo(np.float64).tiny:
            cold = int((scale <= np.finfo(np.float64).tiny).sum())
            raise FieldError(
                f"heat does not reach {cold} of {scale.size} triangles: they are more than about 700 edge lengths "
                "from the seed. Give a seed nearer to them, or coarsen the mesh."
            )
        slopes = -gradient(self._surface, heat) / scale[:, None]
        steepness = np.linalg.norm(slopes, axis=1, keepdims=True)
        return np.where(steepness > FLAT_GRADIENT, slopes / np.maximum(steepness, FLAT_GRADIENT), 0.0)

    def _solver(self, matrix: csc_array, free: IntArray) -> SymmetricSolver:
        return SymmetricSolver(matrix, coordinates=self._surface.vertices[free])


def held_vertices(surface: Surface, seed: Seed) -> tuple[IntArray, FloatArray]:
    """Return the vertices that hold the seed and their straight distance from it.

    Args:
        surface: n vertices.
        seed: curves and points.

    Returns:
        (h,) vertex indices, ascending, and (h,) distances [mm]: 0 for vertices on the seed; corners of a triangle
        that the seed crosses or lies in carry the distance to its nearest piece in that triangle. Where the seed
        consists of vertices only, nothing but these vertices is held.
    """
    points = seed.curves.points
    corners = surface.faces[points.faces]
    at_vertex = points.weights.max(axis=1) > 1.0 - 1e-9
    on_seed = corners[at_vertex, np.argmax(points.weights[at_vertex], axis=1)]
    inside = ~at_vertex
    distances = np.full(surface.vertices.shape[0], np.inf)
    here = positions(surface, points)
    first, last = _pieces_within(seed, inside)
    for corner in range(3):
        vertices = corners[first, corner]
        reach = _distance_to_segments(surface.vertices[vertices], here[first], here[last])
        np.minimum.at(distances, vertices, reach)
    distances[on_seed] = 0.0
    held = np.flatnonzero(np.isfinite(distances))
    return held, distances[held]


def _pieces_within(seed: Seed, inside: BoolArray) -> tuple[IntArray, IntArray]:
    """Return first and last point of every piece of the seed in a triangle; a point off the vertices is one too."""
    curves = seed.curves
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
