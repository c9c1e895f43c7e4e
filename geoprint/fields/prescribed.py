"""Fields with given singularities and no others, that turn as little as they can: trivial connections [Crane2010].

What a field turns by over an edge, beside being carried straight over it, adds up around every vertex to what its
curvature lacks to the whole number of turns that is asked for there. What does so and is least flows out of a function
from one equation with the cotangent Laplacian, whose sources are the turns asked for less the curvature. Walks
around and through handles have to close up, too: what they miss, two harmonic fields for each handle make up for, out
of the same factor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import FieldError, InputError, naming
from geoprint.fields.connection import Connection, connection, principal
from geoprint.fields.cycles import FaceTree, face_tree
from geoprint.fields.direction_field import DirectionField, Singularities, check_symmetry
from geoprint.fields.potential import Potential, flow, nodes_of
from geoprint.fields.preferences import Preference, Wishes, all_wishes
from geoprint.fields.rotation import leant
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.surfaces import Piece, boundary_loops, euler_characteristic, in_words, middle_of, pieces

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
            f"singularities need an index and (x, y, z) each, and a vertex inside of {surface.name}: found "
            f"{len(indices)} indices, places of shape {places.shape} and {inside.size} such vertices."
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
            f"the indices of the singularities of {surface.name} add up to {turns.sum():g}"
            f"{f' and the turnings of its rims to {turnings.sum():g}' if loops else ''}, but its Euler characteristic "
            f"is {euler_characteristic(surface)}: they miss it by {missed:g}; add singularities with indices that add "
            f"up to {missed:g}.",
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
                f"vertex {vertex} lies on a rim of {surface.name} or on none of its faces, so that nothing can turn "
                "around it: name a vertex inside, or the turning of the rim.",
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
            f"{surface.name} has {len(loops)} rims, but {len(turnings)} turnings are given: give one a rim, the "
            "longest first, or none."
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
            f"the field on {field.surface.name} was to turn around {wanted.size} vertices, but turns around "
            f"{found.vertices.size}: triangles without height spoil it, prepare or remesh the surface."
        )


def _name(surface: Surface, piece: Piece, number: int) -> str:
    return f"patch {number} of {surface.name}, about {in_words(middle_of(piece.surface))}"
