"""Fields with given singularities, and the smoothest field [Knöppel2013]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array
from scipy.sparse.csgraph import breadth_first_order
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh
from scipy.spatial import KDTree

from geoprint.distance.sparse_solver import ComplexArray, SymmetricSolver, nested_dissection
from geoprint.errors import FieldError, InputError, MeshError, how_many, naming
from geoprint.fibers.fields import (
    Connection,
    DirectionField,
    Singularities,
    check_symmetry,
    connection,
    nearest_field,
    principal,
)
from geoprint.fibers.preferences import Preference, Wishes, all_wishes
from geoprint.geometry import (
    Piece,
    boundary_loops,
    cotangent_laplacian,
    diagonal_matrix,
    euler_characteristic,
    face_areas,
    in_words,
    middle_of,
    pieces,
)
from geoprint.kernels import njit
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.threads import single_threaded_blas

# Trees over vertices and faces, and the closed walks over faces that they leave: around and through each handle.
#
# A tree over the vertices along edges, and one over the faces that crosses none of these edges: what edges neither
# of them uses are two for each handle of the surface. Crossing such an edge and going back within the tree of faces
# makes a closed walk that cannot be drawn together to a point [Crane2010].


@final
@frozen
class FaceTree:
    """All faces of a connected surface, from the first one outwards.

    Attributes:
        order: (m,) faces, each after the one that it is entered from.
        entries: (m,) the half-edge of that other face over which each is entered; -1 for the first.
        left: (2 g,) half-edges that close a walk each, two for each of g handles.
    """

    order: IntArray
    entries: IntArray
    left: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, order="int: m", entries="int: m", left="int: l")

    def carried(self, first: float, steps: FloatArray) -> FloatArray:
        """Return (m,) values, the first face's given, that rise by (3 m,) steps over each half-edge of the tree."""
        return _carried(self.order, self.entries, steps, first)

    def walks(self, over: Connection) -> list[tuple[IntArray, IntArray]]:
        """Return the closed walk of each edge that is left: (k,) half-edges crossed, and (k,) +1 or, back, -1.

        Half-edges that a walk crosses in both directions do not appear.
        """
        found: list[tuple[IntArray, IntArray]] = []
        for half in self.left.tolist():
            home, back = self._from_first(half // 3), self._from_first(int(over.twins[half]) // 3)
            out, away = np.setdiff1d(home, back), np.setdiff1d(back, home)
            signs = np.concatenate([np.ones(out.size + 1, dtype=np.int64), np.full(away.size, -1)])
            found.append((np.concatenate([[half], out, away]), signs))
        return found

    def _from_first(self, face: int) -> IntArray:
        """Return the half-edges over which the tree goes from the first face to another."""
        crossed: list[int] = []
        while (entry := int(self.entries[face])) >= 0:
            crossed.append(entry)
            face = entry // 3
        return np.array(crossed, dtype=np.int64)


def face_tree(over: Connection, node: IntArray) -> FaceTree:
    """Return a tree over the faces of a connected surface, and what it leaves beside a tree over the vertices.

    Args:
        over: of a surface in one piece.
        node: (n,) number of each vertex, from 0; those of a rim have one number, as if it were drawn together.

    Raises:
        MeshError: the surface is in several pieces.
    """
    inner = over.inner
    first, last = node[over.starts[inner]], node[over.ends[inner]]
    count = int(node.max()) + 1
    graph = csr_array((np.ones(inner.size, dtype=np.int8), (first, last)), shape=(count, count))
    _, before = breadth_first_order(graph, 0, directed=False)
    # Of several edges between two nodes one is in the tree.
    reached = np.where(before[last] == first, last, np.where(before[first] == last, first, -1))
    nodes, place = np.unique(reached, return_index=True)
    shut = np.zeros(over.twins.size, dtype=np.bool_)
    trunk = inner[place[nodes >= 0]]
    shut[trunk] = shut[over.twins[trunk]] = True
    order, entries = _spread(over.twins, shut)
    if order.min() < 0:
        raise MeshError("a tree over faces reaches only one component of a surface: take its components one by one.")
    used = entries[entries >= 0]
    shut[used] = shut[over.twins[used]] = True
    return FaceTree(order, entries, inner[~shut[inner]])


@njit
def _spread(twins: IntArray, shut: BoolArray) -> tuple[IntArray, IntArray]:
    """Return (m,) faces in the order in which they are reached without crossing what is shut, and their entries.

    Faces that are not reached are missing: the order ends in -1.
    """
    count = twins.size // 3
    order, entries = np.full(count, -1), np.full(count, -1)
    seen = np.zeros(count, np.bool_)
    seen[0], order[0], held = True, 0, 1
    for place in range(count):
        face = order[place]
        if face < 0:
            break
        for half in range(3 * face, 3 * face + 3):
            twin = twins[half]
            if twin >= 0 and not shut[half] and not seen[twin // 3]:
                seen[twin // 3], entries[twin // 3], order[held] = True, half, twin // 3
                held += 1
    return order, entries


@njit
def _carried(order: IntArray, entries: IntArray, steps: FloatArray, first: float) -> FloatArray:
    """Return (m,) values that rise by a step over each entry."""
    values = np.empty(order.size)
    for face in order:
        entry = entries[face]
        values[face] = first if entry < 0 else values[entry // 3] + steps[entry]
    return values


# Functions at the vertices with given sources, the same all along each rim: what fields turn by comes from them.
#
# A function u whose cotangent Laplacian gives each vertex its source, linear in each face, has a gradient whose flow
# out of any region about a vertex is that source. A field that turns along its lines by as much as the gradient
# flows across them turns by the source around every vertex, and has the least squared gradient of all that do. A rim
# counts as one vertex, because only the sum along it is given.


def nodes_of(surface: Surface, groups: Sequence[IntArray]) -> IntArray:
    """Return (n,) numbers of the vertices, from 0: those of a group have its number, all others one each.

    Args:
        surface: n vertices; those that no face uses belong to the first group.
        groups: vertices, at least one group, none in two.
    """
    node = np.full(len(surface.vertices), -1, dtype=np.int64)
    used = np.zeros(node.size, dtype=np.bool_)
    used[surface.faces] = True
    node[~used] = 0
    for number, group in enumerate(groups):
        node[group] = number
    alone = np.flatnonzero(node < 0)
    node[alone] = len(groups) + np.arange(alone.size)
    return node


@final
class Potential:
    """Answers which function has given sources; factorised here, for many of them.

    Args:
        surface: n vertices, in one piece.
        over: its connection.
        node: (n,) number of each vertex, as `nodes_of` returns it. The function is 0 at number 0, whose source is
            what the others leave.

    Raises:
        FieldError: the system is singular.
    """

    def __init__(self, surface: Surface, over: Connection, *, node: IntArray) -> None:
        self._over, self._node, self._count = over, node, int(node.max()) + 1
        whole = coo_array(cotangent_laplacian(surface))
        summed = (whole.data, (node[whole.row], node[whole.col]))
        matrix = csc_array(coo_array(summed, shape=(self._count, self._count)))[1:, 1:]
        # A rim stands where its last vertex is.
        places = np.empty((self._count, 3))
        places[node] = surface.vertices
        self._solver = None
        if self._count > 1:
            inner = csc_array(matrix)
            self._solver = SymmetricSolver(inner, order=nested_dissection(inner, coordinates=places[1:]))

    def rises(self, sources: FloatArray) -> FloatArray:
        """Return (3 m,) by how much the function of (n,) sources, summed over each number, rises along half-edges."""
        values = np.zeros(self._count)
        if self._solver is not None:
            summed = np.bincount(self._node, sources, minlength=self._count).astype(np.float64)
            values[1:] = self._solver.solve(summed[1:])
        at = values[self._node]
        return at[self._over.ends] - at[self._over.starts]


def flow(over: Connection, rises: FloatArray) -> FloatArray:
    """Return what flows across lines between the middles of faces on both sides of half-edges.

    The lines are straight from the middle of a face to that of the side and on to the middle of the next face. What
    flows across those around a vertex adds up to its part of the cotangent Laplacian.

    Args:
        over: of a surface of m faces.
        rises: (3 m,) along half-edges, that add up to 0 around each face.

    Returns:
        (3 m,) what flows out of the vertex that each half-edge ends in; 0 on the rim.
    """
    along = (over.weights * rises).reshape(-1, 3)
    # Out of the third of a face about each corner: across a line from the middle of one side to that of the other.
    out = np.roll(along, 1, axis=1) - along
    # From the middle of the face to that of each side; the three add up to nothing.
    half = ((np.roll(out, -1, axis=1) - out) / 3).ravel()
    return np.where(over.twins < 0, 0.0, half - half[over.twins])


# Turning a field smoothly towards what is preferred, by a continuous angle: its singularities stay where they are.
#
# The angle f, linear in each triangle, makes the least of the integral of |grad f|^2 and of the weighted squares of
# what is left to the wishes. Of the n directions each wish takes the nearest; as f grows others may be nearer, and
# the same system is solved for them, which makes less of the sum each time and so comes to an end.


def leant(surface: Surface, angles: FloatArray, wishes: Wishes, *, symmetry: int) -> FloatArray:
    """Return by how much a field turns in each face towards what is wished; 0 where nothing is.

    Args:
        surface: m faces, in one piece.
        angles: (m,) of one direction of the field in each face [rad].
        wishes: on this surface.
        symmetry: n, of the directions in a face.

    Returns:
        (m,) angles [rad].
    """
    if wishes.weights.sum() <= 0.0:
        return np.zeros(angles.size)
    period, count, vertices = 2 * np.pi / symmetry, wishes.faces.size, len(surface.vertices)
    where = np.repeat(np.arange(count), 3), surface.faces[wishes.faces].ravel()
    means = csc_array((np.full(3 * count, 1 / 3), where), shape=(count, vertices))
    pulls = csc_array(means.T @ diagonal_matrix(wishes.weights))
    # A vertex that no face uses stays at 0.
    unused = np.bincount(surface.faces.ravel(), minlength=vertices) == 0
    matrix = csc_array(cotangent_laplacian(surface) + pulls @ means + diagonal_matrix(unused.astype(np.float64)))
    solver = SymmetricSolver(matrix, order=nested_dissection(matrix, coordinates=surface.vertices))
    left = wishes.angles - angles[wishes.faces]
    # The one turn of the whole that all wishes together are nearest to.
    whole = float(np.angle(np.sum(wishes.weights * np.exp(1j * symmetry * left)))) / symmetry
    wanted = _nearest_turns(left, np.full(count, whole), period=period)
    while True:
        at = solver.solve(np.asarray(pulls @ wanted, dtype=np.float64))
        lean = at[surface.faces].mean(axis=1)
        nearer = _nearest_turns(left, lean[wishes.faces], period=period)
        if np.allclose(nearer, wanted):
            return lean
        wanted = nearer


def _nearest_turns(left: FloatArray, lean: FloatArray, *, period: float) -> FloatArray:
    """Return (k,) angles that wishes leave, of those a period apart the one nearest to how far the field leans."""
    return lean + principal(left - lean, period=period)


# Fields with given singularities and no others, that turn as little as they can: trivial connections [Crane2010].
#
# What a field turns by over an edge, beside being carried straight over it, adds up around every vertex to what its
# curvature lacks to the whole number of turns that is asked for there. What does so and is least flows out of a
# function from one equation with the cotangent Laplacian, whose sources are the turns asked for less the curvature.
# Walks around and through handles have to close up, too: what they miss, two harmonic fields for each handle make up
# for, out of the same factor.


# An index may miss a multiple of 1 / n by rounding alone.
WHOLE = 1e-9


def prescribed_field(
    surface: Surface,
    *,
    symmetry: int,
    singularities: Singularities,
    turnings: Sequence[float] | None = None,
    preferences: Sequence[Preference] = (),
) -> DirectionField:
    """Return the field that has given singularities, no others, and turns as little as it can.

    On each piece of the surface the indices of the singularities and the turnings of the rims add up to the Euler
    characteristic. Up to one turn of the whole piece the field is unique; without preferences its first face's
    direction lies along that face's first side. Preferences turn it smoothly, by a continuous angle, so that
    singularities and turnings stay.

    Args:
        surface: n vertices, manifold and consistently wound.
        symmetry: directions in a face: 1, 2 or 4.
        singularities: vertices inside with their indices, multiples of 1 / symmetry.
        turnings: of the rims in the order of `boundary_loops`, as `DirectionField.turnings` measures them: 0 follows
            the rim. None leaves them open: they are the multiples of 1 / symmetry nearest to those of the field that
            turns least.
        preferences: that the field leans to as far as smoothness allows.

    Raises:
        UsageError: the symmetry is another.
        InputError: a singularity lies on a rim or at no vertex, or an index is no multiple.
        FieldError: the indices do not add up to the Euler characteristic, or the turnings are not as many as rims.
        MeshError: as `connection` and `boundary_loops`.
    """
    check_symmetry(symmetry)
    loops = boundary_loops(surface)
    turns = _indices(surface, loops, singularities, symmetry=symmetry)
    if turnings is not None:
        _check_turnings(surface, loops, turnings, symmetry=symmetry)
    wishes = all_wishes(surface, preferences, symmetry=symmetry)
    angles, turning = np.empty(len(surface.faces)), np.empty((len(surface.faces), 3))
    parts = pieces(surface)
    for number, piece in enumerate(parts, start=1):
        held = [k for k, loop in enumerate(loops) if loop[0] in piece.vertices]
        own = None if turnings is None else np.array([turnings[k] for k in held], dtype=np.float64)
        with naming(_name(surface, piece, number) if len(parts) > 1 else ""):
            angles[piece.faces], turning[piece.faces] = _piece_field(
                piece.surface, symmetry, turns[piece.vertices], own, wishes.on(piece)
            )
    field = DirectionField(surface, symmetry, angles, turning)
    _verify(field, singularities, turnings)
    return field


def singularities_near(surface: Surface, places: FloatArray, *, indices: FloatArray) -> Singularities:
    """Return singularities at the vertices inside that are nearest to places.

    Args:
        surface: with a vertex inside.
        places: (k, 3) [mm].
        indices: (k,) of the field around each.

    Raises:
        InputError: there are not as many indices as places, no vertex is inside, or two places have one vertex.
        MeshError: as `boundary_loops`.
    """
    inside = np.flatnonzero(_inside(surface, boundary_loops(surface)))
    if places.shape != (len(indices), 3) or inside.size == 0:
        raise InputError(
            f"each singularity needs an index, (x, y, z) and a vertex inside {surface.name}: found "
            f"{how_many(len(indices), 'index', 'indices')}, places of shape {places.shape} and "
            f"{how_many(inside.size, 'such vertex', 'such vertices')}."
        )
    nearest = inside[np.asarray(KDTree(surface.vertices[inside]).query(places)[1], dtype=np.int64)]
    vertices, first, counts = np.unique(nearest, return_index=True, return_counts=True)
    if counts.max(initial=1) > 1:
        vertex = int(vertices[np.argmax(counts)])
        raise InputError(
            f"{counts.max()} singularities are nearest to vertex {vertex} of {surface.name} at "
            f"{in_words(surface.vertices[vertex])}: add up their indices, or refine the mesh there.",
            vertex=vertex,
        )
    return Singularities(vertices, indices[first])


def _piece_field(
    surface: Surface, symmetry: int, turns: FloatArray, turnings: FloatArray | None, wishes: Wishes
) -> tuple[FloatArray, FloatArray]:
    """Return the (m,) angles and the (m, 3) turning of the field on one piece."""
    over, loops, period = connection(surface), boundary_loops(surface), 2 * np.pi / symmetry
    sources = 2 * np.pi * turns - over.curvature
    rest = euler_characteristic(surface) - float(turns.sum())
    if turnings is None:
        turnings = _least_turnings(surface, over, loops, sources, rest=rest, symmetry=symmetry)
    missed = rest - float(turnings.sum())
    if abs(missed) > WHOLE:
        raise FieldError(
            f"the indices of the singularities of {surface.name} add up to "
            f"{turns.sum():g}{f' and the turnings of its rims to {turnings.sum():g}' if loops else ''}; its Euler "
            f"characteristic is {euler_characteristic(surface)}. Add singularities with indices that add up to "
            f"{missed:g}.",
            missed=missed,
        )
    for loop, turned in zip(loops, turnings.tolist(), strict=True):
        sources[loop[0]] += 2 * np.pi * turned
    node = nodes_of(surface, loops or [surface.faces[0, :1]])
    potential, tree = Potential(surface, over, node=node), face_tree(over, node)
    turning = flow(over, potential.rises(sources))
    turning += _through_handles(over, tree, potential, turning, period=period)
    angles = tree.carried(0.0, over.transport + turning)
    lean = leant(surface, angles, wishes, symmetry=symmetry)
    turning += over.antisymmetric((lean[over.twins // 3] - np.repeat(lean, 3))[over.inner])
    return principal(angles + lean, period=2 * np.pi), turning.reshape(-1, 3)


def _least_turnings(
    surface: Surface, over: Connection, loops: Sequence[IntArray], sources: FloatArray, *, rest: float, symmetry: int
) -> FloatArray:
    """Return (l,) turnings that add up to the rest, the nearest to those of the field that turns least."""
    if len(loops) < 2:
        return np.full(len(loops), rest)
    # Where all rims together count as one vertex, nothing is asked of each.
    free = Potential(surface, over, node=nodes_of(surface, [np.concatenate(loops)]))
    turns = (over.around_vertices(flow(over, free.rises(sources))) + over.curvature) / (2 * np.pi)
    wanted = symmetry * np.array([turns[loop].sum() for loop in loops])
    counts = np.floor(wanted)
    short = round(symmetry * rest - float(counts.sum()))
    counts[np.argsort(counts - wanted, kind="stable")[:short]] += 1.0
    return counts / symmetry


def _through_handles(
    over: Connection, tree: FaceTree, potential: Potential, turning: FloatArray, *, period: float
) -> FloatArray:
    """Return (3 m,) what the field has to turn by in addition so that walks around and through handles close up."""
    if tree.left.size == 0:
        return np.zeros(turning.size)
    angles = tree.carried(0.0, over.transport + turning)
    left, beyond = tree.left, over.twins[tree.left]
    short = principal(angles[beyond // 3] - angles[left // 3] - (over.transport + turning)[left], period=period)
    walks = tree.walks(over)
    harmonic = np.column_stack([_harmonic(over, potential, *walk) for walk in walks])
    gains = np.array([signs @ harmonic[halves] for halves, signs in walks])
    cost: FloatArray = np.linalg.inv(gains).astype(np.float64)
    return harmonic @ (cost @ _nearest(short, cost, period=period))


def _harmonic(over: Connection, potential: Potential, halves: IntArray, signs: IntArray) -> FloatArray:
    """Return (3 m,) what flows without any source where the function rises over a closed walk each time around."""
    rise = np.zeros(over.twins.size)
    rise[halves], rise[over.twins[halves]] = signs, -signs
    return flow(over, rise + potential.rises(-over.around_vertices(flow(over, rise))))


def _nearest(short: FloatArray, cost: FloatArray, *, period: float) -> FloatArray:
    """Return what walks miss with whole periods added one by one as long as the field turns less for it.

    Args:
        short: (2 g,) what each walk misses [rad].
        cost: (2 g, 2 g) of the square sum of what that adds.
        period: of the field [rad].
    """
    best = short.copy()
    steps = period * np.vstack([np.eye(short.size), -np.eye(short.size)])
    while True:
        tried = best + steps
        costs = np.einsum("ki,ij,kj->k", tried, cost, tried)
        if costs.min() >= (1.0 - WHOLE) * (best @ cost @ best):
            return best
        best = tried[int(np.argmin(costs))]


def _indices(surface: Surface, loops: Sequence[IntArray], singularities: Singularities, *, symmetry: int) -> FloatArray:
    """Return the (n,) index of each vertex."""
    inside = _inside(surface, loops)
    turns = np.zeros(inside.size)
    for vertex, index in zip(singularities.vertices.tolist(), singularities.indices.tolist(), strict=True):
        if not 0 <= vertex < inside.size or not inside[vertex]:
            raise InputError(
                f"vertex {vertex} is on a rim of {surface.name} or on none of its faces, so the field cannot turn "
                "there. Name a vertex inside, or the turning of the rim.",
                vertex=vertex,
            )
        _check_multiple(index, symmetry=symmetry, what=f"the index at vertex {vertex} of {surface.name}")
        turns[vertex] = index
    return turns


def _inside(surface: Surface, loops: Sequence[IntArray]) -> BoolArray:
    """Return (n,) whether faces lie all around each vertex."""
    inside = np.zeros(len(surface.vertices), dtype=np.bool_)
    inside[surface.faces] = True
    for loop in loops:
        inside[loop] = False
    return inside


def _check_turnings(surface: Surface, loops: Sequence[IntArray], turnings: Sequence[float], *, symmetry: int) -> None:
    if len(turnings) != len(loops):
        raise FieldError(
            f"{surface.name} has {how_many(len(loops), 'rim')} and {how_many(len(turnings), 'turning')}: give one for "
            "each rim, the longest first, or none."
        )
    for number, turned in enumerate(turnings, start=1):
        _check_multiple(turned, symmetry=symmetry, what=f"the turning of rim {number} of {surface.name}")


def _check_multiple(turns: float, *, symmetry: int, what: str) -> None:
    if abs(turns * symmetry - round(turns * symmetry)) > WHOLE:
        raise InputError(
            f"{what} is {turns:g}; where a field has {symmetry} directions it must be a multiple of 1/{symmetry}."
        )


def _verify(field: DirectionField, asked: Singularities, turnings: Sequence[float] | None) -> None:
    """Check that the field has the singularities asked for and no others.

    Raises:
        FieldError: it has not.
    """
    found, wanted = field.singularities(), asked.vertices[asked.indices != 0.0]
    same = np.array_equal(found.vertices, wanted) and np.allclose(found.indices, asked.indices[asked.indices != 0.0])
    if not same or (turnings is not None and not np.allclose(field.turnings(), turnings)):
        raise FieldError(
            f"the field on {field.surface.name} should turn around {how_many(wanted.size, 'vertex', 'vertices')}, but "
            f"turns around {found.vertices.size}: remesh the surface to remove triangles without height."
        )


def _name(surface: Surface, piece: Piece, number: int) -> str:
    return f"patch {number} of {surface.name}, about {in_words(middle_of(piece.surface))}"


# The smoothest field, which has the singularities that suit it: globally optimal directions [Knöppel2013].
#
# A field of n directions is a complex number in each tangent plane, the n-th power of any of them. Its integral of
# the squared gradient is least for the smallest eigenvector of a Hermitian matrix or, where directions are
# preferred, for the solution of one linear system: nothing is searched, and singularities come where they cost
# least.
#
# The carriers here are the sides of triangles: both faces beside one see it in their own plane, so that a field is
# linear in each flat face and passes over sides without any rescaled angle. These elements of Crouzeix and Raviart
# keep the matrix positive for all triangles, obtuse ones too, and a field that turns nowhere but at cones costs
# nothing. The face has the mean of its sides [Crouzeix1973].


# What is added to the matrix so that it has an inverse, over the inverse of the area: far below the second eigenvalue
# of any part, which is of the order of the inverse of its longest extent squared.
SHIFT = 1e-3
# How many vectors are held to find the smallest, and how exact it is: to a thousandth of a degree.
HELD, ACCURACY = 8, 1e-6


def smoothest_field(surface: Surface, *, symmetry: int, preferences: Sequence[Preference] = ()) -> DirectionField:
    """Return the field of least gradient, leaning to what is preferred, with the singularities that this takes.

    A piece of the surface without any preference has the field of least gradient of all, up to one turn of the whole
    piece, which is open; of several equally smooth ones, as on a sphere, it has any. What is least is the
    gradient of numbers that may be short where directions differ around them; the field has their directions alone.

    Args:
        surface: n vertices, manifold and consistently wound.
        symmetry: directions in a face: 1, 2 or 4.
        preferences: that the field leans to.

    Raises:
        UsageError: the symmetry is another.
        FieldError: the system is singular, or no smallest eigenvector is found.
        MeshError: as `connection`.
    """
    check_symmetry(symmetry)
    wishes = all_wishes(surface, preferences, symmetry=symmetry)
    angles = np.empty(len(surface.faces))
    for piece in pieces(surface):
        sides = _Sides(piece.surface, connection(piece.surface), symmetry=symmetry)
        own = wishes.on(piece)
        values = sides.leaning(own) if own.weights.any() else sides.smallest()
        angles[piece.faces] = np.angle(sides.in_faces(values)) / symmetry
    return nearest_field(surface, angles, symmetry=symmetry)


@final
class _Sides:
    """Fields on the sides of triangles: their matrix, and the least of them.

    Args:
        surface: m faces with e sides in all, in one piece.
        over: its connection.
        symmetry: n; values are n-th powers of directions, against that of the first half-edge of their side.
    """

    def __init__(self, surface: Surface, over: Connection, *, symmetry: int) -> None:
        self._surface, self._symmetry = surface, symmetry
        self._side, first = _numbered(over)
        turned = over.directions + np.where(first, 0.0, np.pi)
        # (m, 3) what turns the value of a side into the plane of the face.
        self._into = np.exp(1j * symmetry * turned).reshape(-1, 3)
        self._mass = np.bincount(self._side.ravel(), np.repeat(face_areas(surface) / 3, 3))
        self._middles = np.empty((self._mass.size, 3))
        self._middles[self._side.ravel()] = (surface.vertices[over.starts] + surface.vertices[over.ends]) / 2
        self._stiffness = self._assembled(_elements(over), np.arange(len(surface.faces)))

    def smallest(self) -> ComplexArray:
        """Return the (e,) values of the field of least gradient among those of one size."""
        root = np.sqrt(self._mass)
        scale = diagonal_matrix(1.0 / root)
        matrix = csc_array(scale @ self._stiffness @ scale)
        if root.size <= HELD:
            return np.asarray(np.linalg.eigh(matrix.toarray())[1][:, 0] / root, dtype=np.complex128)
        shift = SHIFT / float(self._mass.sum())
        solver = self._solver(csc_array(matrix + shift * diagonal_matrix(np.ones(root.size))))
        inverse = LinearOperator(matrix.shape, matvec=solver.solve, dtype=np.complex128)
        start = root.astype(np.complex128)
        try:
            with single_threaded_blas():
                _, vectors = eigsh(matrix, 1, sigma=-shift, OPinv=inverse, v0=start, ncv=HELD, tol=ACCURACY)
        except ArpackError as error:
            raise FieldError(
                f"{self._surface.name} has no smoothest field ({error}): check the mesh for triangles without height, "
                "or give a preference."
            ) from error
        return vectors[:, 0] / root

    def leaning(self, wishes: Wishes) -> ComplexArray:
        """Return the (e,) values of the field that makes the least of its gradient and what it misses of wishes."""
        each = np.repeat(wishes.weights / 9, 9).reshape(-1, 3, 3)
        matrix = csc_array(self._stiffness + self._assembled(each, wishes.faces))
        wanted = wishes.weights * np.exp(1j * self._symmetry * wishes.angles)
        pull: ComplexArray = np.zeros(self._mass.size, dtype=np.complex128)
        np.add.at(pull, self._side[wishes.faces], np.conj(self._into[wishes.faces]) * wanted[:, None] / 3)
        return self._solver(matrix).solve(pull)

    def in_faces(self, values: ComplexArray) -> ComplexArray:
        """Return the (m,) values in the middles of the faces, against the first side of each."""
        return (self._into * values[self._side]).mean(axis=1)

    def _assembled(self, elements: FloatArray, faces: IntArray) -> csc_array:
        """Return the (e, e) sum of (t, 3, 3) real matrices of the sides of (t,) faces, in the planes of these."""
        into, side = self._into[faces], self._side[faces]
        values = np.conj(into)[:, :, None] * elements * into[:, None, :]
        rows, columns = np.repeat(side, 3, axis=1).ravel(), np.tile(side, (1, 3)).ravel()
        count = self._mass.size
        return csc_array(coo_array((values.ravel(), (rows, columns)), shape=(count, count)))

    def _solver(self, matrix: csc_array) -> SymmetricSolver:
        return SymmetricSolver(matrix, order=nested_dissection(matrix, coordinates=self._middles))


def _elements(over: Connection) -> FloatArray:
    """Return (m, 3, 3) the integrals of grad psi_i . grad psi_j, with psi_i 1 in the middle of side i and linear.

    psi_i is 1 - 2 phi of the corner opposite to side i, so that they are four times those of the corners, which the
    cotangents make up.
    """
    weights = over.weights.reshape(-1, 3)
    elements = np.empty((len(weights), 3, 3))
    for side in range(3):
        following, before = (side + 1) % 3, (side + 2) % 3
        elements[:, side, side] = 4.0 * (weights[:, following] + weights[:, before])
        # Between two sides lies the corner that the third is opposite to.
        elements[:, side, following] = elements[:, following, side] = -4.0 * weights[:, before]
    return elements


def _numbered(over: Connection) -> tuple[IntArray, BoolArray]:
    """Return (m, 3) the number of each side, and (3 m,) whether a half-edge is the first of its side."""
    first = (over.twins < 0) | (over.twins > np.arange(over.twins.size))
    number = np.cumsum(first) - 1
    number[~first] = number[over.twins[~first]]
    return number.reshape(-1, 3), first
