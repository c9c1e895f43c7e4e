"""The curves of a surface that a changed one must keep: its rim, and the creases where faces meet at a sharp angle."""

from __future__ import annotations

import numpy as np

from geoprint.geometry.operators import face_normals
from geoprint.geometry.topology import boundary_loops, connected_nodes, half_edges, twins, used_vertices
from geoprint.model import BoolArray, FloatArray, IntArray, Surface

# Faces whose normals differ by more meet in a crease, and a curve that turns by more has a corner [rad]: smooth scans
# of hearts bend less from face to face, machined edges more. Rounding does not make one of an edge that bends so much.
SHARP = float(np.radians(40.0))
ROUNDING = 1e-9
# Rims keep as many edges: with three a hole would read as a missing triangle, with eight it stays as round as it was.
LEAST_RIM = 8
# Kinds of vertices: inside, on a curve that is kept, and an end, a junction or a sharp turn of curves.
INSIDE, ON_CREASE, ON_RIM, CORNER = 0, 1, 2, 3


def creases(surface: Surface, *, shortest: float) -> tuple[BoolArray, IntArray]:
    """Find the rim and the sharp creases.

    Args:
        surface: manifold, consistently wound, without faces that have no area.
        shortest: a crease, with all that hang together with it, that is smaller than this is noise [mm].

    Returns:
        (3 m,) whether the edge of each half-edge is on the rim or on a crease; and (n,) INSIDE, ON_CREASE, ON_RIM or
        CORNER of each vertex. Where two rims touch, and all over the smallest rims, there are corners too.

    Raises:
        MeshError: the surface is not manifold, or a face has no area.
    """
    other, sides = twins(surface.faces), half_edges(surface.faces)
    rim = other < 0
    normals = face_normals(surface)
    beside = np.where(rim, np.arange(other.size), other) // 3
    bend = np.einsum("hx,hx->h", np.repeat(normals, 3, axis=0), normals[beside])
    sharp = _large(surface.vertices, sides, bend < np.cos(SHARP) - ROUNDING, shortest=shortest)
    curves = rim | sharp
    once = curves & (rim | (np.arange(other.size) < other))
    kinds = _kinds(surface.vertices, sides[once])
    kinds[(kinds == ON_CREASE) & np.isin(np.arange(kinds.size), sides[rim])] = ON_RIM
    for loop in boundary_loops(surface):
        if loop.size <= LEAST_RIM:
            kinds[loop] = CORNER
    kinds[_pinched(surface.vertices, used_vertices(sides[rim]))] = CORNER
    return curves, kinds


def juts_out(surface: Surface) -> BoolArray:
    """Return (3 m,) whether the surface bends back at the edge of a half-edge, as at the edge of a box."""
    other, own, sides = twins(surface.faces), face_normals(surface), half_edges(surface.faces)
    turned = np.cross(np.repeat(own, 3, axis=0), own[np.maximum(other, 0) // 3])
    along = surface.vertices[sides[:, 1]] - surface.vertices[sides[:, 0]]
    return (other >= 0) & (np.einsum("hx,hx->h", turned, along) > 0.0)


def edges_alone(surface: Surface, sides: BoolArray) -> Surface:
    """Return the edges of some half-edges as triangles without area, on which `closest` finds the nearest points.

    Args:
        surface: m faces.
        sides: (3 m,) which half-edges, at least one.
    """
    return Surface(vertices=surface.vertices, faces=half_edges(surface.faces)[sides][:, [0, 1, 1]])


def _large(vertices: FloatArray, sides: IntArray, sharp: BoolArray, *, shortest: float) -> BoolArray:
    """Return which sharp edges belong to a connected set of them that is large enough."""
    labels = connected_nodes(*sides[sharp].T, nodes=len(vertices))
    count = int(labels.max(initial=-1)) + 1
    lowest, highest = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(lowest, labels, vertices)
    np.maximum.at(highest, labels, vertices)
    return sharp & (np.linalg.norm(highest - lowest, axis=1) >= shortest)[labels[sides[:, 0]]]


def _pinched(vertices: FloatArray, rim: IntArray) -> IntArray:
    """Return the vertices of the rim that lie on others: where rims touch, they must go on doing so."""
    _, same, counts = np.unique(vertices[rim], axis=0, return_inverse=True, return_counts=True)
    return rim[counts[same] > 1]


def _kinds(vertices: FloatArray, pairs: IntArray) -> IntArray:
    """Return the kind of each vertex, given each edge of the curves once, as if all of them were creases."""
    degrees = np.bincount(pairs.ravel(), minlength=len(vertices))
    along = vertices[pairs[:, 1]] - vertices[pairs[:, 0]]
    along /= np.maximum(np.linalg.norm(along, axis=1), np.finfo(np.float64).tiny)[:, None]
    # Directions from the vertex along each of its edges: on a straight curve two of them cancel out.
    total = np.zeros((len(vertices), 3))
    np.add.at(total, pairs[:, 0], along)
    np.add.at(total, pairs[:, 1], -along)
    turning = np.linalg.norm(total, axis=1) > 2.0 * np.sin(SHARP / 2.0)
    kinds = np.where((degrees == 2) & ~turning, ON_CREASE, CORNER)
    return np.where(degrees == 0, INSIDE, kinds)
