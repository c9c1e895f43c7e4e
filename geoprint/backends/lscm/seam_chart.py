"""A band laid flat along a cut whose two sides are tied by a rigid motion: lengths without a visible seam.

Uncut, a band becomes a ring in the plane, and its lengths grow exponentially across it. Cut, it can keep them: a
cylinder becomes a rectangle, a cone frustum a sector. Chart lengths agree on both sides of the cut, so that whatever is
measured in the chart and its moved copies does not know where the cut runs.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import dijkstra

from geoprint.backends.distortion import signed_areas
from geoprint.backends.lscm.chart import conformal_chart
from geoprint.backends.lscm.conformal_map import PinnedMap, conformal_energy, turning_pull
from geoprint.backends.lscm.continuation import UNCUT, Chart, Continuation
from geoprint.backends.lscm.overlap import refuse_overlaps
from geoprint.backends.sparse_solver import ComplexArray, SymmetricSolver, nested_dissection
from geoprint.model import IntArray, Surface
from geoprint.surfaces import (
    boundary_loops,
    connected_nodes,
    cotangent_laplacian,
    describe,
    edge_lengths,
    edges,
    face_areas,
    half_edges,
    twins,
)
from geoprint.surfaces.halfedges import next_halves

# Bands that turn by more are nearly plane rings [rad]: uncut their charts are hardly worse. From 4 / 3 pi on the copy
# at one side of the cut would come round to the half of the chart at that side; what is left is for crooked cuts.
LARGEST_TURN = 1.25 * np.pi


def flattened(surface: Surface) -> Chart:
    """Lay a surface flat by the map that comes nearest to keeping angles, cut where it is a band.

    A band is an annulus that turns by no more than `LARGEST_TURN`; the cut is the shortest path between its loops. All
    else is left uncut, as `conformal_chart`.

    Args:
        surface: what `conformal_chart` takes.

    Returns:
        The chart, scaled so that its area is the surface's.

    Raises:
        FieldError: as `conformal_chart`; or the system of a band is singular.
    """
    if describe(surface) == "annulus":
        loops = boundary_loops(surface)
        turn = flat_turn(surface, loops)
        if abs(turn) <= LARGEST_TURN:
            return laid_flat(surface, seam=shortest_cut(surface, loops), turn=turn)
    return Chart(conformal_chart(surface), UNCUT)


def laid_flat(surface: Surface, *, seam: IntArray, turn: float) -> Chart:
    """Lay an annulus flat along a given cut with a given turn.

    The copies on the right of the cut are no unknowns but the images of their originals, turned back and moved by one
    more unknown. The longest loop is asked to advance along a line that turns evenly by the turn.

    Args:
        surface: an annulus of n vertices.
        seam: (s,) vertices along edges from the longest loop to the other, none in between on a loop.
        turn: angle from the right side of the cut to the left, once round [rad].

    Returns:
        The chart; vertex n + i of it is the copy of seam[i] on the right side of the cut.

    Raises:
        FieldError: the chart overlaps itself, or the system is singular.
    """
    count, copies = len(surface.vertices), len(surface.vertices) + np.arange(seam.size)
    cut = _cut_along(surface, seam)
    rows = np.concatenate([np.arange(count), copies, copies])
    columns = np.concatenate([np.arange(count), seam, np.full(seam.size, count)])
    entries = np.concatenate([np.ones(count), np.full(seam.size, np.exp(-1j * turn)), np.ones(seam.size)])
    tied = csc_array(coo_array((entries, (rows, columns)), shape=(count + seam.size, count + 1)))
    border = boundary_loops(cut)
    energy = csc_array(tied.conj().T @ conformal_energy(cut, border) @ tied)
    # Once round the longest loop: from the copy on the right of the cut to its original on the left.
    longest = boundary_loops(surface)[0]
    longest = np.roll(longest, -int(np.argmax(longest == seam[0])))
    line = np.concatenate([copies[:1], longest[1:], seam[:1]])
    lengths = np.linalg.norm(np.diff(cut.vertices[line], axis=0), axis=1)
    pull = turning_pull(line[:-1], line[1:], lengths=lengths, turn=turn, unknowns=count + seam.size)
    coordinates = np.vstack([surface.vertices, surface.vertices[seam].mean(axis=0)])
    solved = PinnedMap(energy, coordinates=coordinates, pins=np.array([seam[0], longest[longest.size // 2]]))
    unknowns = solved.pulled(np.asarray(tied.conj().T @ pull))
    image: ComplexArray = np.asarray(tied @ unknowns, dtype=np.complex128)
    flat = np.column_stack([image.real, image.imag])
    refuse_overlaps(cut, flat, border)
    scale = float(np.sqrt(face_areas(surface).sum() / signed_areas(flat, cut.faces).sum()))
    shift = -scale * np.exp(1j * turn) * unknowns[-1]
    flat = scale * flat
    chart = Surface(np.column_stack([flat, np.zeros(len(flat))]), cut.faces, name=surface.name)
    return Chart(chart, Continuation(flat[seam], flat[copies], turn, np.array([shift.real, shift.imag])))


def shortest_cut(surface: Surface, loops: tuple[IntArray, ...]) -> IntArray:
    """Return the (s,) vertices of the shortest path along edges from the first loop to the second."""
    ends, lengths = edges(surface.faces), edge_lengths(surface)
    count = len(surface.vertices)
    graph = coo_array((lengths, (ends[:, 0], ends[:, 1])), shape=(count, count)).tocsr()
    distances, before, _ = dijkstra(graph, directed=False, indices=loops[0], min_only=True, return_predecessors=True)
    path = [int(loops[1][np.argmin(distances[loops[1]])])]
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    return np.array(path[::-1])


def flat_turn(surface: Surface, loops: tuple[IntArray, ...]) -> float:
    """Return by how much the first loop of an annulus turns once the surface is flat [rad].

    On the surface the loops turn by angles that differ by its curvature, which flattening moves onto them. Logarithms
    of the scale of two conformal maps to flat surfaces differ by a harmonic function; the one that is zero on the
    border has the least Dirichlet energy of them all, because its gradient is orthogonal to those of harmonic
    functions. In that sense the scale varies least where the border keeps its lengths. Then the curvature of a place
    goes to the first loop by its harmonic measure there: the function that is 1 on that loop, 0 on the other and
    harmonic in between.
    """
    count = len(surface.vertices)
    share, straight = np.zeros(count), np.full(count, 2 * np.pi)
    share[loops[0]] = 1.0
    straight[np.concatenate(loops)] = np.pi
    free = np.flatnonzero(straight > np.pi)
    if free.size:
        rows = cotangent_laplacian(surface)[free]
        inner = csc_array(rows[:, free])
        solver = SymmetricSolver(inner, order=nested_dissection(inner, coordinates=surface.vertices[free]))
        share[free] = solver.solve(-np.asarray(rows @ share))
    corners = surface.vertices[surface.faces]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    doubled = 2.0 * face_areas(surface)[:, None]
    angles = np.arctan2(doubled, np.einsum("mcx,mcx->mc", ahead, back))
    around = np.bincount(surface.faces.ravel(), angles.ravel(), minlength=count)
    return float(share @ (straight - around))


def _cut_along(surface: Surface, seam: IntArray) -> Surface:
    """Return the surface with copies of the seam's vertices, in order, for the faces on its right.

    Corners of faces are joined across every edge that is not cut; what stays together is one vertex.
    """
    count = len(surface.vertices)
    halves, other = half_edges(surface.faces), twins(surface.faces)
    keys = halves @ np.array([count, 1])
    left, right = seam[:-1] * count + seam[1:], seam[1:] * count + seam[:-1]
    whole = np.flatnonzero((other >= 0) & ~np.isin(keys, np.concatenate([left, right])))
    # The end of a half-edge is the corner at which its twin starts.
    after = next_halves(whole)
    size = len(keys)
    corner_class = connected_nodes(after, other[whole], nodes=size)
    # The face of a half-edge that runs back along the seam lies on its right.
    order = np.argsort(keys)
    back = order[np.searchsorted(keys, right, sorter=order)]
    starts, ends = back, next_halves(back)
    copied = corner_class[np.concatenate([ends[:1], starts])]
    number = np.full(size, -1, dtype=np.int64)
    number[copied] = count + np.arange(seam.size)
    copy = number[corner_class]
    faces = np.where(copy >= 0, copy, surface.faces.ravel()).reshape(-1, 3)
    return Surface(np.vstack([surface.vertices, surface.vertices[seam]]), faces, name=surface.name)
