"""Areas, side lengths, normals and linear finite elements of triangles: gradient, divergence, Laplacian and mass.

A function is given by its values at the vertices and linear in each triangle. phi_i is the one that is 1 at vertex i
and 0 at the others; its gradient in a triangle is N x e_i / (2 A) with the unit normal N, the side e_i opposite to i
taken counter-clockwise, and the area A [Crane2013, sec. 3.2].
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array, dia_array
from scipy.sparse.csgraph import dijkstra

from geoprint.errors import MeshError
from geoprint.geometry.topology import edges
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.transforms import THIS_WAY

# A mean normal shorter than this is what rounding leaves of the millions of normals of a closed surface.
ROUNDED_NORMAL = 1e-9
# Share by which edges at one side of a surface count as longer than those at the other: rounding does not.
TILT = 1e-4


def doubled_area_vectors(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return (m, 3) normals whose lengths are twice the faces' areas, on the side seen counter-clockwise.

    Args:
        vertices: (n, 3) positions.
        faces: (m, 3); a face without area has a zero normal.
    """
    # One row an axis, which numpy works on twice as fast as on one a face.
    corners = vertices.T[:, faces.T]
    (x, y, z), (u, v, w) = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.column_stack([y * w - z * v, z * u - x * w, x * v - y * u])


def face_areas(surface: Surface) -> FloatArray:
    """Return the (m,) area [mm2] of every face."""
    return np.linalg.norm(doubled_area_vectors(surface.vertices, surface.faces), axis=1) / 2


def face_normals(surface: Surface) -> FloatArray:
    """Return the (m, 3) outward unit normal of every face.

    Raises:
        MeshError: a face has no area, and so no normal.
    """
    doubled = doubled_area_vectors(surface.vertices, surface.faces)
    return doubled / _positive_lengths(doubled, surface)[:, None]


def vertex_normals(surface: Surface) -> FloatArray:
    """Return the (n, 3) unit normal of every vertex: the area-weighted mean of its faces' normals, normalised.

    Raises:
        MeshError: the mean vanishes somewhere: a vertex without faces, or faces folded back on each other.
    """
    doubled = doubled_area_vectors(surface.vertices, surface.faces)
    return mean_directions(surface, np.repeat(doubled, 3, axis=0))


def mean_directions(surface: Surface, at_corners: FloatArray) -> FloatArray:
    """Return the (n, 3) unit vector along the sum of what the corners of faces have at each vertex.

    Args:
        surface: n vertices, m faces.
        at_corners: (3 m, 3) normals times areas, face by face.

    Raises:
        MeshError: the sum vanishes somewhere.
    """
    total = np.column_stack([_sum_at_corners(surface, at_corners[:, axis]) for axis in range(3)])
    lengths = np.linalg.norm(total, axis=1)
    if not lengths.all():
        vertex = int(np.argmin(lengths))
        raise MeshError(
            f"{surface.name}: vertex {vertex} at {surface.vertices[vertex].tolist()} has no normal, because no face "
            "uses it or its faces are folded onto each other; prepare the surface first.",
            vertex=vertex,
        )
    return total / lengths[:, None]


def mean_normal(surface: Surface) -> FloatArray:
    """Return the (3,) area-weighted mean of the unit face normals, not normalised.

    Its length says how flat the part is: 1 for a plane, 1/2 for a hemisphere, 0 for a closed surface.
    """
    doubled = doubled_area_vectors(surface.vertices, surface.faces)
    mean: FloatArray = doubled.sum(axis=0) / np.linalg.norm(doubled, axis=1).sum()
    return mean if np.linalg.norm(mean) > ROUNDED_NORMAL else np.zeros(3)


def edge_lengths(surface: Surface) -> FloatArray:
    """Return the (e,) length [mm] of every edge, in the order of `topology.edges`."""
    ends = surface.vertices[edges(surface.faces)]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def shortest_edge_path(surface: Surface, starts: IntArray, ends: IntArray) -> IntArray:
    """Return the (k,) vertices of the shortest path along edges from one of some vertices to one of some others.

    Of paths that are equally long, as on a grid, the same one is chosen, whatever rounding does.

    Args:
        surface: n vertices.
        starts: (s,) vertices.
        ends: (e,) vertices that edges connect with a start.
    """
    sides, count = edges(surface.faces), len(surface.vertices)
    aside = surface.vertices[sides].mean(axis=1) @ THIS_WAY
    lengths = edge_lengths(surface) * (1.0 + TILT * (aside - aside.min()) / np.ptp(aside))
    graph = coo_array((lengths, (sides[:, 0], sides[:, 1])), shape=(count, count)).tocsr()
    distances, before, _ = dijkstra(graph, directed=False, indices=starts, min_only=True, return_predecessors=True)
    path = [int(ends[distances[ends].argmin()])]
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    return np.array(path[::-1], dtype=np.int64)


def smallest_angles(surface: Surface) -> FloatArray:
    """Return the (m,) smallest angle of every face [rad]; pi / 3 in an equilateral one.

    Raises:
        MeshError: a face has no area.
    """
    # The cotangent falls from 0 to pi, so that the largest belongs to the smallest angle.
    return np.arctan2(1.0, corner_cotangents(surface).max(axis=1))


def diagonal_matrix(values: FloatArray) -> dia_array[np.float64]:
    """Return the (k, k) matrix that has (k,) values on its diagonal and nothing beside it."""
    return dia_array((values[None], np.zeros(1, dtype=np.int64)), shape=(values.size, values.size))


def corner_cotangents(surface: Surface) -> FloatArray:
    """Return the (m, 3) cotangent of the angle at each corner of each face.

    Raises:
        MeshError: a face has no area.
    """
    corners = surface.vertices.T[:, surface.faces.T]
    sides = [corners[:, (corner + 2) % 3] - corners[:, (corner + 1) % 3] for corner in range(3)]
    doubled = _positive_lengths(doubled_area_vectors(surface.vertices, surface.faces), surface)
    products = [(sides[(corner + 1) % 3] * sides[(corner + 2) % 3]).sum(axis=0) for corner in range(3)]
    return np.column_stack(products) / -doubled[:, None]


def cotangent_laplacian(surface: Surface, factors: FloatArray | float = 1.0) -> csc_array[np.float64]:
    """Return the stiffness matrix of linear elements, L_ij = integral of factor grad phi_i . grad phi_j.

    It is minus the Laplacian integrated over each vertex's hat function: symmetric, positive semi-definite, with rows
    that sum to zero. L_ij = -(cot a + cot b) / 2 for the angles a and b opposite to edge ij; on the boundary one
    of them is absent, which leaves the natural (Neumann) condition.

    Args:
        surface: n vertices, m faces.
        factors: of all faces, or (m,) one a face.

    Returns:
        (n, n) matrix in the unit of the factors.

    Raises:
        MeshError: a face has no area.
    """
    return stiffness(surface, corner_cotangents(surface) * np.reshape(factors, (-1, 1)))


def stiffness(surface: Surface, cotangents: FloatArray) -> csc_array[np.float64]:
    """Return the matrix of `cotangent_laplacian` for the (m, 3) cotangents at the corners times the factors."""
    count = len(surface.vertices)
    # What scipy makes of them anyway; as they are, twice as many would take most of the memory here.
    start = surface.faces.astype(np.int32)
    end = np.roll(start, -1, axis=1)
    # The side from corner i to i + 1 is opposite to corner i + 2.
    weights = np.roll(cotangents, -2, axis=1) / 2
    at_corners = weights + np.roll(weights, 1, axis=1)
    ahead = csc_array((weights.ravel(), (start.ravel(), end.ravel())), shape=(count, count))
    return csc_array(diagonal_matrix(_sum_at_corners(surface, at_corners.ravel())) - ahead - ahead.T)


def lumped_mass(surface: Surface) -> FloatArray:
    """Return the (n,) area [mm2] of each vertex: a third of the area of every face around it."""
    return sum_around_vertices(surface, face_areas(surface) / 3)


def sum_around_vertices(surface: Surface, values: FloatArray) -> FloatArray:
    """Return the (n,) sum over the faces around each vertex of (m,) values of faces."""
    return _sum_at_corners(surface, np.repeat(values, 3))


def gradient(surface: Surface, values: FloatArray) -> FloatArray:
    """Return the gradient of a function given at the vertices.

    Args:
        surface: n vertices, m faces.
        values: (n,) values at the vertices.

    Returns:
        (m, 3) gradient in each face [unit of values per mm], tangent to the face.

    Raises:
        MeshError: a face has no area.
    """
    return np.einsum("mc,mcx->mx", values[surface.faces], _hat_gradients(surface))


def divergence(surface: Surface, vectors: FloatArray) -> FloatArray:
    """Return the divergence of a field that is constant in each face, integrated over each vertex's hat function.

    It is minus the integral of the field times grad phi_i, so that divergence(gradient(f)) = -L f with the cotangent
    Laplacian L; flow through the boundary counts as zero.

    Args:
        surface: n vertices, m faces.
        vectors: (m, 3) vectors; parts normal to the faces do not matter.

    Returns:
        (n,) integrated divergence [unit of vectors times mm].

    Raises:
        MeshError: a face has no area.
    """
    shares = -np.einsum("mcx,mx->mc", _hat_gradients(surface), vectors) * face_areas(surface)[:, None]
    return _sum_at_corners(surface, shares.ravel())


def signed_volume(surface: Surface) -> float:
    """Return the volume [mm3] inside a closed surface, positive if its faces are counter-clockwise from outside."""
    middle = surface.vertices.mean(axis=0)
    a, b, c = (surface.vertices[surface.faces[:, corner]] - middle for corner in range(3))
    return float(np.einsum("mx,mx->", a, np.cross(b, c)) / 6)


def side_lengths(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the (m, 3) distance between corner i and corner i + 1 of each face."""
    lengths = np.empty(faces.shape)
    for side in range(3):
        lengths[:, side] = np.sqrt(_squares(vertices[faces[:, (side + 1) % 3]] - vertices[faces[:, side]]))
    return lengths


def thinness(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return (m,) twice the area of each face, and the (m,) square of its longest side."""
    starts = vertices[faces[:, 0]]
    first, second = vertices[faces[:, 1]] - starts, vertices[faces[:, 2]] - starts
    (x, y, z), (u, v, w) = first.T, second.T
    doubled = np.sqrt((y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2)
    longest = np.maximum(_squares(first), _squares(second))
    longest = np.sqrt(np.maximum(longest, _squares(vertices[faces[:, 2]] - vertices[faces[:, 1]])))
    return doubled, longest * longest


def reaching(vertices: FloatArray, faces: IntArray, centre: FloatArray, radius: float) -> BoolArray:
    """Return (m,) which faces may reach into a ball: their balls, about the means of their corners, meet it."""
    middles = _middles(vertices, faces)
    sizes = np.zeros(len(faces))
    for corner in range(3):
        np.maximum(sizes, np.sqrt(_squares(vertices[faces[:, corner]] - middles)), out=sizes)
    return np.asarray(np.sqrt(_squares(middles - centre)) <= radius + sizes)


def nearest_middle(vertices: FloatArray, faces: IntArray, centre: FloatArray) -> float:
    """Return the distance from a (3,) position to the nearest mean of the corners of a face."""
    return float(np.sqrt(_squares(_middles(vertices, faces) - centre).min(initial=np.inf)))


def _sum_at_corners(surface: Surface, values: FloatArray) -> FloatArray:
    """Return (n,) the sum at each vertex of (3 m,) values, one for each corner of each face in turn."""
    return np.bincount(surface.faces.ravel(), values, minlength=len(surface.vertices)).astype(np.float64)


def _opposite_sides(surface: Surface) -> FloatArray:
    """Return (m, 3, 3) the side opposite to each corner, counter-clockwise: from corner i + 1 to corner i + 2."""
    ahead, behind = surface.vertices[surface.faces[:, [2, 0, 1]]], surface.vertices[surface.faces[:, [1, 2, 0]]]
    ahead -= behind
    return ahead


def _hat_gradients(surface: Surface) -> FloatArray:
    """Return (m, 3, 3) the gradient of each corner's hat function [1/mm]."""
    doubled = doubled_area_vectors(surface.vertices, surface.faces)
    squares = _positive_lengths(doubled, surface) ** 2
    return np.cross(doubled[:, None, :], _opposite_sides(surface)) / squares[:, None, None]


def _positive_lengths(doubled: FloatArray, surface: Surface) -> FloatArray:
    lengths = np.linalg.norm(doubled, axis=1)
    if not lengths.all():
        face = int(np.argmin(lengths))
        raise MeshError(
            f"{surface.name}: face {face} at {surface.vertices[surface.faces[face, 0]].tolist()} has no area; "
            "prepare the surface first, which drops such faces.",
            face=face,
        )
    return lengths


def _middles(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the (m, 3) means of the corners of the faces."""
    middles = vertices[faces[:, 0]] + vertices[faces[:, 1]]
    middles += vertices[faces[:, 2]]
    middles /= 3.0
    return middles


def _squares(vectors: FloatArray) -> FloatArray:
    """Return the (m,) squared lengths of (m, 3) vectors, always summed in the order of the axes."""
    x, y, z = vectors.T
    return np.asarray(x * x + y * y + z * z)
