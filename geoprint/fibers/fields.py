"""A field of directions on a surface: from triangle to triangle, its singularities, carried to layers."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import final

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from geoprint.distance.intrinsic import intrinsic_triangulation
from geoprint.errors import InputError, UsageError, how_many
from geoprint.geometry import (
    boundary_half_edges,
    boundary_loops,
    corner_cotangents,
    edge_lengths,
    face_normals,
    half_edges,
    vertex_normals,
)
from geoprint.geometry.halfedges import BORDER
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints, freeze_arrays, frozen

# How directions pass from triangle to triangle: the two unfold into a plane about the side between them.
#
# A direction in a face is an angle from the face's first side, counter-clockwise seen from outside. Passing over a
# side adds a fixed angle to it, the transport. Carried once around a vertex a direction comes back turned by the
# angle that is missing there to a full turn, the Gaussian curvature of the vertex [Crane2010].


# Surfaces whose connection is kept: a field is made, checked and measured on the same one.
SURFACES_KEPT = 1


@final
@frozen
class Connection:
    """The angles between the sides of faces, and from face to face.

    Attributes:
        twins: (3 m,) the half-edge across the side of each; -1 on the rim.
        starts: (3 m,) the vertex at which each half-edge starts.
        ends: (3 m,) the one at which it ends.
        directions: (3 m,) its angle from the first side of its face [rad].
        transport: (3 m,) what is added to an angle on passing over it to the other face [rad]; 0 on the rim.
        weights: (3 m,) half the cotangent of the angle opposite to it in its face.
        curvature: (n,) what is missing to a full turn at a vertex inside, to half a turn on the rim; 0 where no
            face is [rad].
    """

    twins: IntArray
    starts: IntArray
    ends: IntArray
    directions: FloatArray
    transport: FloatArray
    weights: FloatArray
    curvature: FloatArray

    def __post_init__(self) -> None:
        halves = dict.fromkeys(("directions", "transport", "weights"), "float: h")
        freeze_arrays(self, twins="int: h", starts="int: h", ends="int: h", curvature="float: n", **halves)

    @property
    def inner(self) -> IntArray:
        """(e,) the first half-edge of each edge between two faces, ascending."""
        return np.flatnonzero(self.twins > np.arange(self.twins.size))

    def antisymmetric(self, inner_values: FloatArray) -> FloatArray:
        """Return (3 m,) values that are (e,) given ones at `inner`, the opposite at their twins and 0 on the rim."""
        values, inner = np.zeros(self.twins.size), self.inner
        values[inner], values[self.twins[inner]] = inner_values, -inner_values
        return values

    def around_vertices(self, halves: FloatArray) -> FloatArray:
        """Return (n,) sums of what (3 m,) half-edges carry over, counter-clockwise around each vertex."""
        # The side over which one leaves a face, counter-clockwise about a corner, ends in that corner.
        return np.bincount(self.ends, halves, minlength=self.curvature.size).astype(np.float64)


@lru_cache(maxsize=SURFACES_KEPT)
def connection(surface: Surface) -> Connection:
    """Return how directions pass over the sides of a surface.

    Args:
        surface: n vertices, m faces, manifold and consistently wound.

    Raises:
        MeshError: an edge has more than two faces, or two that are wound against each other; a face has no area.
    """
    twins = intrinsic_triangulation(surface).twins.ravel()
    cotangents = corner_cotangents(surface)
    angles = np.arctan2(1.0, cotangents)
    directions = np.column_stack([np.zeros(len(angles)), np.pi - angles[:, 1], np.pi + angles[:, 0]]).ravel()
    inside = twins != BORDER
    starts, ends = half_edges(surface.faces).T
    around = np.bincount(starts, angles.ravel(), minlength=len(surface.vertices)).astype(np.float64)
    whole = np.where(around > 0.0, 2 * np.pi, 0.0)
    # On the rim as many half-edges without a face beyond start as end.
    whole[starts[~inside]] = np.pi
    return Connection(
        twins=twins,
        starts=starts,
        ends=ends,
        directions=directions,
        transport=np.where(inside, directions[twins] + np.pi - directions, 0.0),
        # The corner opposite to the side from corner i to corner i + 1 is corner i + 2.
        weights=np.roll(cotangents, 1, axis=1).ravel() / 2,
        curvature=whole - around,
    )


def face_axes(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Return (m, 3) unit vectors along the first side of each face and, counter-clockwise, across it.

    Raises:
        MeshError: a face has no area.
    """
    corners = surface.vertices[surface.faces]
    first: FloatArray = corners[:, 1] - corners[:, 0]
    along: FloatArray = first / np.linalg.norm(first, axis=1)[:, None]
    return along, np.cross(face_normals(surface), along)


def angles_in_faces(surface: Surface, faces: IntArray, vectors: FloatArray) -> FloatArray:
    """Return (k,) angles of (k, 3) vectors, projected into (k,) faces, from the first sides of these [rad].

    Raises:
        MeshError: a face has no area.
    """
    along, across = (axis[faces] for axis in face_axes(surface))
    return np.arctan2(np.einsum("kx,kx->k", vectors, across), np.einsum("kx,kx->k", vectors, along))


def principal(angles: FloatArray, *, period: float) -> FloatArray:
    """Return angles less whole periods: above minus half a period, up to half a period [rad].

    Examples:
        >>> principal(np.array([0.0, 3.0, 4.0, -2.0]), period=4.0)
        array([ 0., -1.,  0.,  2.])
    """
    return angles - period * np.ceil(angles / period - 0.5)


# A field of directions, and what is measured of it: its singularities and how it turns against the rims.
#
# The carriers are the faces: one direction in each, and by how much it turns over each side. Singularities are then
# vertices, which is where they are asked for and where a printed path can be kept away from; a streamline is
# straight in each face, and whoever follows it needs no interpolation that is undefined at a singularity. Directions
# at vertices would be smooth across edges, but need rescaled angles at every vertex, and their singularities lie
# somewhere in faces.
#
# By how much the field turns over a side is kept and not guessed from the two directions: around a vertex of six
# faces a cross field of index 1 turns by more over each side than the eighth of a turn up to which guessing is
# right.


# How many directions a field may have in each face: a vector, a line in both directions, a cross.
SYMMETRIES = (1, 2, 4)
# Directions may disagree with what a field turns by over a side by rounding alone [rad].
ANGLE_TOLERANCE = 1e-6


@final
@frozen
class Singularities:
    """Vertices around which a field turns, and how often.

    Attributes:
        vertices: (k,) ascending, none twice.
        indices: (k,) turns of the field, counter-clockwise, as one goes around each once counter-clockwise: 1 where it
            circles or points away, -1 at a saddle; multiples of 1 / n for n directions.
    """

    vertices: IntArray
    indices: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, vertices="int: k", indices="float: k")
        if (np.diff(self.vertices) <= 0).any():
            raise InputError("Singularities.vertices must ascend, each vertex once; add up the indices at one vertex.")


@final
@frozen
class DirectionField:
    """n directions in each face of a surface, evenly around: a vector (1), a line in both directions (2), a cross (4).

    Attributes:
        surface: m faces, manifold and consistently wound.
        symmetry: n, one of SYMMETRIES.
        angles: (m,) of one direction of each face from the face's first side, counter-clockwise seen from outside
            [rad].
        turning: (m, 3) by how much the field turns against a direction that passes straight over the side from corner i
            to corner i + 1 into the next face [rad]; the opposite from the other side, and 0 on the rim.
        axes: (m, 2, 3) unit vectors around and up an axis, between which helix angles count, positive where a line
            rises along the first; zero where nothing tells them. None where the field has no axis.
    """

    surface: Surface
    symmetry: int
    angles: FloatArray
    turning: FloatArray
    axes: FloatArray | None = None

    def __post_init__(self) -> None:
        check_symmetry(self.symmetry)
        axes = {} if self.axes is None else {"axes": "float: m 2 3"}
        faces = freeze_arrays(self, angles="float: m", turning="float: m 3", **axes)["m"]
        if faces != len(self.surface.faces):
            raise InputError(
                f"{self.surface.name} has {how_many(len(self.surface.faces), 'face')}, but the field has {faces}."
            )
        over, turning = connection(self.surface), self.turning.ravel()
        inner = over.inner
        apart = np.abs(turning[inner] + turning[over.twins[inner]]).max(initial=0.0)
        missed = np.abs(principal(_ahead(over, self.angles, turning)[inner], period=self.period)).max(initial=0.0)
        beyond = np.abs(turning[over.twins < 0]).max(initial=0.0)
        off = float(max(apart, missed, beyond))
        if off > ANGLE_TOLERANCE:
            raise InputError(
                f"the turn of the field on {self.surface.name} across a side misses its direction beyond by {off:.3g} "
                "rad: `nearest_field` makes a field from directions alone.",
                off=off,
            )

    @property
    def period(self) -> float:
        """Angle between neighbouring directions in a face [rad]."""
        return 2 * np.pi / self.symmetry

    def directions(self) -> FloatArray:
        """Return the (m, n, 3) unit vectors of all faces, counter-clockwise from that of the face's angle."""
        along, across = face_axes(self.surface)
        angles = self.angles[:, None] + self.period * np.arange(self.symmetry)
        return np.cos(angles)[:, :, None] * along[:, None] + np.sin(angles)[:, :, None] * across[:, None]

    def at(self, points: SurfacePoints) -> FloatArray:
        """Return the (k, n, 3) unit vectors at points: those of their faces.

        Raises:
            InputError: a point names a face that the surface does not have.
        """
        points.corners(self.surface)
        return self.directions()[points.faces]

    def matching(self) -> IntArray:
        """Return (m, 3) by how many the directions are numbered on over each side, from 0 to n - 1.

        Direction j of a face goes on in the face beyond as direction j + matching, modulo n; 0 on the rim.
        """
        over, turning = connection(self.surface), self.turning.ravel()
        steps = np.rint(_ahead(over, self.angles, turning) / self.period).astype(np.int64) % self.symmetry
        return np.where(over.twins < 0, 0, steps).reshape(-1, 3)

    def singularities(self) -> Singularities:
        """Return every vertex inside around which the field turns, measured face by face around all of them.

        The indices of all and the `turnings` of the rims add up to the Euler characteristic.
        """
        over = connection(self.surface)
        turns = self._turns(over)
        turns[over.starts[over.twins < 0]] = 0.0
        counts = np.rint(turns * self.symmetry).astype(np.int64)
        vertices = np.flatnonzero(counts)
        return Singularities(vertices, counts[vertices] / self.symmetry)

    def turnings(self) -> FloatArray:
        """Return (l,) how many turns the field falls behind each rim as one goes along it, the surface on the left.

        0 where it follows the rim or crosses it at one angle; 1 for the rim of a disc in a field that is the same
        everywhere, -1 for that of a hole in it. In the order of `boundary_loops`, multiples of 1 / n.

        Raises:
            MeshError: as `boundary_loops`.
        """
        turns = self._turns(connection(self.surface))
        found = np.array([turns[loop].sum() for loop in boundary_loops(self.surface)])
        # Nothing is added so that no turning prints as -0.
        return np.rint(found * self.symmetry) / self.symmetry + 0.0

    def _turns(self, over: Connection) -> FloatArray:
        """Return (n,) turns of the field around vertices; around those of the rim the part that is inside."""
        return (over.curvature + over.around_vertices(self.turning.ravel())) / (2 * np.pi)


def nearest_field(surface: Surface, angles: FloatArray, *, symmetry: int) -> DirectionField:
    """Return the field of given directions that turns by as little as it can over each side.

    Args:
        surface: m faces, manifold and consistently wound.
        angles: (m,) of one direction of each face from the face's first side [rad].
        symmetry: n, of the directions in a face.

    Raises:
        UsageError: the symmetry is not one of SYMMETRIES.
        MeshError: as `connection`.
    """
    check_symmetry(symmetry)
    over = connection(surface)
    ahead = _ahead(over, angles, np.zeros(over.twins.size))[over.inner]
    turning = over.antisymmetric(-principal(ahead, period=2 * np.pi / symmetry))
    return DirectionField(surface, symmetry, angles, turning.reshape(-1, 3))


def check_symmetry(symmetry: int) -> None:
    """Check how many directions a field shall have.

    Raises:
        UsageError: not so many.
    """
    if symmetry not in SYMMETRIES:
        raise UsageError(f"a field has 1 direction (vector), 2 (line) or 4 (cross) in each face, not {symmetry}.")


def _ahead(over: Connection, angles: FloatArray, turning: FloatArray) -> FloatArray:
    """Return (3 m,) by how much a direction that passes over each side and turns is ahead of that beyond [rad]."""
    mine = np.repeat(angles, 3)
    return mine + over.transport + turning - mine[over.twins]


# A field carried from a surface to one that lies over it: the lines of every layer are those of the first one.
#
# Along the straight line from a place to its foot, which is normal to both surfaces, a direction keeps itself: that
# is parallel transport along the gradient of the distance. What is left is that the triangles at both ends are not
# quite parallel, and there the smallest rotation between their normals carries over.
#
# How a field turns over a side is read off directions well where it turns little. Around a singularity it does not,
# and reading spreads its index over vertices beside it: there indices are gathered again at the vertex that lies
# above.


# A singularity's index is spread over vertices at most so many edges of the level beside it, or of the surface below
# where these are longer, and the vertex above it lies no farther from where it must be.
SPREAD = 3.0
# Lines over a hollow meet lines from elsewhere. Where normals oppose each other by more than this cosine, feet lie on
# the wrong side of a surface, and no rotation is the smallest.
OPPOSITE = -0.99


def carried_field(
    field: DirectionField, level: Surface, *, feet: SurfacePoints, turned: FloatArray | float = 0.0
) -> DirectionField:
    """Return a field of a surface as it is on a level of the distance from it, turned there.

    Every face has the direction at its foot, linear between the middles of faces. The field above turns around the
    vertices over singularities with their indices, and around no others, except where feet part: over the crease of a
    hollow it jumps as they do. A singularity has no vertex above where the level is cut off.

    Args:
        field: on the surface below.
        level: m faces, its outside away from the surface below.
        feet: (m,) of the middles of its faces, on the surface below.
        turned: (m,) or one for all: what directions are then turned by, counter-clockwise seen from outside [rad]; it
            varies little from face to face.

    Raises:
        InputError: there are not as many feet as faces, or the level faces the surface below.
        MeshError: as `connection`.
    """
    count = len(level.faces)
    if feet.faces.size != count:
        raise InputError(
            f"{level.name} has {how_many(count, 'face')}, but {feet.faces.size} feet are given: give one for each face."
        )
    upright, above = face_normals(field.surface)[feet.faces], face_normals(level)
    cosines = np.einsum("mx,mx->m", upright, above)
    if cosines.min(initial=1.0) < OPPOSITE:
        face = int(np.argmin(cosines))
        raise InputError(
            f"face {face} of {level.name} looks at {field.surface.name} below it: turn the level over.", face=face
        )

    def raised(along: FloatArray) -> FloatArray:
        """Return (m, 3) vectors after the smallest rotation that takes one normal to the other."""
        share = np.einsum("mx,mx->m", along, above) / (1.0 + cosines)
        return along - share[:, None] * (upright + above)

    angles = angles_in_faces(level, np.arange(count), raised(_directions(field, feet))) + turned
    found = _gathered(field, nearest_field(level, angles, symmetry=field.symmetry))
    if field.axes is None:
        return found
    axes = field.axes[feet.faces]
    return replace(found, axes=np.stack([raised(axes[:, 0]), raised(axes[:, 1])], axis=1))


def _directions(field: DirectionField, points: SurfacePoints) -> FloatArray:
    """Return (k, 3) unit vectors at points: those in the middles of faces, and linear in between.

    In the middle of a side a field has done half of what it turns by over it.
    """
    # The side from corner i to corner i + 1 is opposite to corner i + 2; a function that is 1 in its middle and 0 in
    # those of the other two is a third in the middle of the face.
    shares = 1.0 - 2.0 * points.weights[:, [2, 0, 1]] - 1.0 / 3.0
    turned = np.einsum("kc,kc->k", shares, field.turning[points.faces]) / 2.0
    angles = (field.angles[points.faces] + turned)[:, None]
    along, across = (axis[points.faces] for axis in face_axes(field.surface))
    return np.cos(angles) * along + np.sin(angles) * across


def _gathered(below: DirectionField, found: DirectionField) -> DirectionField:
    """Return a field with the indices beside places above singularities moved there; its directions stay."""
    level, wanted = found.surface, below.singularities()
    reach = SPREAD * max(float(np.median(edge_lengths(each))) for each in (below.surface, level))
    counts = np.zeros(len(level.vertices))
    for vertex, index in zip(wanted.vertices.tolist(), wanted.indices.tolist(), strict=True):
        above = _above(below.surface, vertex, level, reach=reach)
        if above is not None:
            counts[above] += index
    places = np.flatnonzero(counts)
    read = found.singularities()
    counts[read.vertices] -= read.indices
    missing = np.rint(found.symmetry * counts).astype(np.int64)
    missing[places] = 0
    if not (places.size and missing.any()):
        return found
    away, onwards, _ = dijkstra(
        _inner_edges(level), directed=False, indices=places, min_only=True, return_predecessors=True, limit=reach
    )
    moved = np.flatnonzero((missing != 0) & np.isfinite(away))
    shifts = _shifts(level, moved, missing[moved], onwards.astype(np.int64))
    return DirectionField(level, found.symmetry, found.angles, found.turning + found.period * shifts)


def _above(below: Surface, vertex: int, level: Surface, *, reach: float) -> int | None:
    """Return the vertex inside a level that lies over one below; None where it is cut off."""
    place, upright = below.vertices[vertex], vertex_normals(below)[vertex]
    inside = np.zeros(len(level.vertices), dtype=np.bool_)
    inside[level.faces] = True
    inside[level.faces.ravel()[boundary_half_edges(level.faces)]] = False
    candidates = np.flatnonzero(inside)
    away = level.vertices[candidates] - place
    aside = np.linalg.norm(away - (away @ upright)[:, None] * upright, axis=1)
    # Where a level lies twice over a place the nearer sheet is meant.
    height = np.linalg.norm(away, axis=1)
    near = np.flatnonzero(aside < reach)
    if not near.size:
        return None
    sheet = near[height[near] < height[near].min() + reach]
    return int(candidates[sheet[np.argmin(aside[sheet])]])


def _inner_edges(surface: Surface) -> csr_array:
    """Return the (n, n) lengths of edges between two faces [mm]."""
    over, count = connection(surface), len(surface.vertices)
    starts, ends = over.starts[over.inner], over.ends[over.inner]
    lengths = np.linalg.norm(surface.vertices[starts] - surface.vertices[ends], axis=1)
    return csr_array(coo_array((lengths, (starts, ends)), shape=(count, count)))


def _shifts(surface: Surface, starts: IntArray, amounts: IntArray, onwards: IntArray) -> FloatArray:
    """Return (m, 3) whole periods over sides that give vertices what they miss, and take it where their paths end.

    A field that turns by a period more over a half-edge has one n-th of an index more at the vertex where that ends,
    and one less where it starts.

    Args:
        surface: m faces.
        starts: (k,) vertices.
        amounts: (k,) n-th parts of an index that are missing there.
        onwards: (n,) the next vertex on the path of each; below 0 where it ends.
    """
    over = connection(surface)
    shifts = np.zeros(over.twins.size)
    for start, amount in zip(starts.tolist(), amounts.tolist(), strict=True):
        vertex = start
        while (ahead := int(onwards[vertex])) >= 0:
            half = np.flatnonzero((over.starts == ahead) & (over.ends == vertex))[0]
            shifts[half] += amount
            shifts[over.twins[half]] -= amount
            vertex = ahead
    return shifts.reshape(-1, 3)
