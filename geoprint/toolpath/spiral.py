"""The `spiral` pattern: where distance less turns is half a spacing more than a whole number of them, in one stroke."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.spatial import KDTree

from geoprint.distance import Backend, isolines, level_distances
from geoprint.distance.sparse_solver import SymmetricSolver, nested_dissection
from geoprint.errors import FieldError, UsageError, how_many
from geoprint.geometry import (
    Piece,
    all_curves,
    arc_lengths,
    boundary_loops,
    connected_nodes,
    edge_keys,
    euler_characteristic,
    face_areas,
    face_normals,
    gradient,
    half_edges,
    pieces,
    shortest_edge_path,
    some_curves,
    twins,
)
from geoprint.model import (
    BoolArray,
    FloatArray,
    IntArray,
    Paths,
    ScalarField,
    Source,
    Surface,
    SurfaceCurves,
    SurfacePoints,
    freeze_arrays,
    frozen,
)

# A surface slit open along a line of edges, so that a number that rises by one round it has one value a vertex.


@frozen
class Slit:
    """A surface of n vertices and m faces, slit open: the same faces in their order, with c vertices.

    Attributes:
        faces: (m, 3) vertices of the slit surface.
        origins: (c,) vertex of the whole surface that each of its vertices is.
        left: (c,) whether it is the copy on the left of the line.
    """

    faces: IntArray
    origins: IntArray
    left: BoolArray

    def __post_init__(self) -> None:
        freeze_arrays(self, faces="int: m 3", origins="int: c", left="bool: c")


def slit_along(surface: Surface, line: IntArray) -> Slit:
    """Return a surface slit open along a line of edges; its ends stay one vertex unless they lie on the border."""
    count = len(surface.vertices)
    halves, other = half_edges(surface.faces), twins(surface.faces)
    ahead = np.column_stack([line[:-1], line[1:]])
    on_line = np.isin(edge_keys(halves, vertices=count), edge_keys(ahead, vertices=count))
    half = np.flatnonzero((other >= 0) & ~on_line)
    following = half - half % 3 + (half + 1) % 3
    beyond = other[half] - other[half] % 3 + (other[half] + 1) % 3
    corner = connected_nodes(
        np.concatenate([half, following]), np.concatenate([beyond, other[half]]), nodes=halves.shape[0]
    )
    vertices = int(corner.max()) + 1
    origins = np.zeros(vertices, dtype=np.int64)
    origins[corner] = surface.faces.ravel()
    beside = np.flatnonzero(np.isin(halves[:, 0] * count + halves[:, 1], ahead[:, 0] * count + ahead[:, 1]))
    left = np.zeros(vertices, dtype=np.bool_)
    left[corner[beside]] = True
    left[corner[beside - beside % 3 + (beside + 1) % 3]] = True
    left &= np.bincount(origins, minlength=count)[origins] > 1
    return Slit(corner.reshape(-1, 3), origins, left)


# The share of a turn at every vertex: rising by one round the middle, and hardly changing from turn to turn.
#
# Turns whose distance is d and that rise by one spacing w where a share t rises by one lie w (1 + w dt/dn) apart
# along the gradient of d. So t minimises the integral of (dt/dn)^2 + ALONG (dt/ds)^2: the first makes the spacing
# even, the second shares the rise out along the turn. It is one sparse system, whose seam drops out: t may jump by
# one across it.


# Weight of an even rise along the turns over an even distance between them.
ALONG = 0.02


def turns(
    surface: Surface, slit: Slit, distance: FloatArray, *, held: tuple[IntArray, FloatArray], loose: IntArray
) -> FloatArray:
    """Return the (c,) share of a turn at the vertices of a slit surface, one more on the left of the slit.

    Args:
        surface: n vertices, before it was slit.
        slit: of it.
        distance: (n,) from the source [mm].
        held: vertices on the right of the slit, or off it, at which the share is given, and the shares.
        loose: vertices that it turns about: their triangles do not count.
    """
    count = len(surface.vertices)
    stiffness = _stiffness(surface, slit, distance, apart=np.isin(surface.faces, loose))
    size = slit.origins.size
    fold = csc_array((np.ones(size), (np.arange(size), slit.origins)), (size, count))
    jump = slit.left.astype(np.float64)
    matrix, right = csc_array(fold.T @ stiffness @ fold), -(fold.T @ (stiffness @ jump))
    vertices, shares = held
    found = np.zeros(count)
    found[vertices] = shares
    free = np.setdiff1d(np.arange(count), np.union1d(vertices, loose))
    right = right - matrix @ found
    inner = csc_array(matrix[free][:, free])
    order = nested_dissection(inner, coordinates=surface.vertices[free])
    found[free] = SymmetricSolver(inner, order=order).solve(right[free])
    whole = found[slit.origins] + jump
    for vertex in loose.tolist():
        around = slit.faces[(surface.faces == vertex).any(axis=1)]
        others = np.setdiff1d(around, np.flatnonzero(slit.origins == vertex))
        whole[slit.origins == vertex] = whole[others].mean()
    return whole


def _stiffness(surface: Surface, slit: Slit, distance: FloatArray, *, apart: BoolArray) -> csc_array:
    """Return the (c, c) matrix of the integral, over the faces without a corner that is apart."""
    down = gradient(surface, distance)
    normal = face_normals(surface)
    length = np.linalg.norm(down, axis=1)
    across = down / np.maximum(length, 1e-12)[:, None]
    along = np.cross(normal, across)
    areas = face_areas(surface)
    corners = surface.vertices[surface.faces]
    opposite = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    hats = np.cross(normal[:, None, :], opposite) / (2.0 * areas)[:, None, None]
    rise = np.einsum("mcx,mx->mc", hats, across), np.einsum("mcx,mx->mc", hats, along)
    local = np.einsum("ma,mb->mab", rise[0], rise[0]) + ALONG * np.einsum("ma,mb->mab", rise[1], rise[1])
    local *= np.where(apart.any(axis=1), 0.0, areas)[:, None, None]
    rows, columns = np.repeat(slit.faces, 3, axis=1), np.tile(slit.faces, 3)
    shape = (slit.origins.size, slit.origins.size)
    return csc_array(coo_array((local.ravel(), (rows.ravel(), columns.ravel())), shape=shape))


# Along the rim the stroke rises by one spacing over so many spacings, at the end of its first turn.
RISE = 8.0
# But over no more of the rim than this share of it.
MOST_RISE = 0.125
# The stroke ends this far from the innermost point of a piece [spacings].
LEFT_OVER = 0.5
# Ends of the stroke on both sides of the slit are one point [mm].
SAME_POINT = 1e-6
# What may be left of level curves beside the stroke, in rings of their own, over its length.
MOST_BESIDE = 0.02


@final
class SpiralPattern:
    """The `spiral` pattern: one stroke a piece, from the rim inwards, or outwards from a point on a closed part.

    It serves pieces whose level curves are rings about one middle: discs whose source is the whole border, and closed
    pieces whose source is a point. A piece with a hole, or whose level curves part into two sets of rings, is refused.
    Rings about a middle of less than a fiftieth of the stroke's length are paths of their own.

    Args:
        rise: spacings of the rim over which the first turn rises to the next, an eighth of the rim at most; 0 for the
            whole turn, steadily. What the rise leaves open at the rim is half of it times the spacing.

    Raises:
        UsageError: the rise is negative.

    Examples:
        >>> SpiralPattern.title
        'one path from the rim to the centre'
    """

    title: ClassVar[str] = "one path from the rim to the centre"
    summary: ClassVar[str] = "Winds inwards from the source in one path, one spacing a turn."

    def __init__(self, *, rise: float = RISE) -> None:
        if not 0.0 <= rise < np.inf:
            raise UsageError(f"the spiral's rise is {rise:g} spacings; it must be 0 (the whole turn) or more.")
        self._rise = rise

    def paths(self, surface: Surface, source: Source, *, backend: Backend, spacing: float | ScalarField) -> Paths:
        """Return one stroke a piece; its row rises by one a turn, less where the turn follows the rim.

        Raises:
            UsageError: the spacing is not the same everywhere, or the level curves of a piece are no rings about one
                middle.
            FieldError: not even the first level lies on the surface, or on a piece of it.
        """
        if isinstance(spacing, ScalarField):
            raise UsageError(
                "turns of a spiral lie one spacing apart everywhere, but a spacing at each vertex is given. Give one "
                "number, or choose the pattern fibres."
            )
        field = backend.distance(source)
        level_distances(field, spacing=spacing)
        found = [
            piece.on_whole(self._piece(piece, piece.own(source.curves), field.values[piece.vertices], spacing=spacing))
            for piece in pieces(surface)
        ]
        curves = all_curves(found)
        away = curves.points.values(surface, field.values)
        row: FloatArray = np.maximum(away / spacing - 0.5, 0.0)
        return Paths(curves, row, np.full(row.size, float(spacing)), np.ones(row.size), promised=away)

    def _piece(self, piece: Piece, source: SurfaceCurves, distance: FloatArray, *, spacing: float) -> SurfaceCurves:
        """Return the stroke of a piece, and small rings beside it."""
        surface, middle = piece.surface, int(distance.argmax())
        if distance[middle] <= 0.5 * spacing:
            raise FieldError(
                f"spacing is {spacing:g} mm, but a component of {surface.name} ends {distance[middle]:.3g} mm from "
                f"the source: choose a spacing below {2 * distance[middle]:.3g} mm."
            )
        rim = _rim(surface, source, distance)
        start = np.array([int(distance.argmin())]) if rim is None else rim
        slit = slit_along(surface, shortest_edge_path(surface, start, np.array([middle])))
        if rim is None:
            shares = turns(surface, slit, distance, held=_pinned(distance, start), loose=np.append(start, middle))
        else:
            held = self._along(surface, slit, rim, spacing=spacing)
            shares = turns(surface, slit, distance, held=held, loose=np.array([middle]))
        return _wound(surface, slit, distance, shares, spacing=spacing)

    def _along(self, surface: Surface, slit: Slit, rim: IntArray, *, spacing: float) -> tuple[IntArray, FloatArray]:
        """Return the shares of a turn along the rim: none until the rise, then evenly to one at the slit.

        A rim has the surface on its left, so a slit that starts on it has its left side where the rim arrives.
        """
        copies = np.bincount(slit.origins, minlength=len(surface.vertices))
        rim = np.roll(rim, -int(np.flatnonzero(copies[rim] > 1)[0]))
        arcs = arc_lengths(surface.vertices[np.append(rim, rim[0])])
        rise = min(self._rise * spacing, MOST_RISE * arcs[-1]) or arcs[-1]
        return rim, np.clip((arcs[:-1] - arcs[-1]) / rise + 1.0, 0.0, 1.0)


def _pinned(distance: FloatArray, start: IntArray) -> tuple[IntArray, FloatArray]:
    """Return one vertex where the share is none: the next to the start in distance."""
    return np.array([int(np.where(np.arange(distance.size) == start[0], np.inf, distance).argmin())]), np.zeros(1)


def _rim(surface: Surface, source: SurfaceCurves, distance: FloatArray) -> IntArray | None:
    """Return the rim that distance is measured from, or None where it is a point of a closed piece.

    Raises:
        UsageError: the source is neither, or the piece has holes.
    """
    loops = boundary_loops(surface)
    if not loops and euler_characteristic(surface) == 2 and source.points.faces.size == source.count == 1:
        return None
    if len(loops) == 1 and euler_characteristic(surface) == 1:
        if distance[loops[0]].max() <= 1e-6 * distance.max():
            return loops[0]
        raise UsageError(
            f"a spiral needs the whole border as its source, but this source is only a part of that of {surface.name} "
            "or lies elsewhere. Omit `--from`, or use `--pattern contours`."
        )
    raise UsageError(
        f"a spiral needs one border, or none and a point as its source (`--from point:X,Y,Z`), but {surface.name} has "
        f"{how_many(len(loops), 'border')}. Use `--pattern contours`."
    )


def _wound(surface: Surface, slit: Slit, distance: FloatArray, shares: FloatArray, *, spacing: float) -> SurfaceCurves:
    """Return the level curve of distance less turns, joined across the slit, and small rings beside it.

    Raises:
        UsageError: what is left beside it is more than a small part.
    """
    phase = distance[slit.origins] / spacing - shares
    opened = Surface(surface.vertices[slit.origins], slit.faces, surface.name)
    levels = np.arange(max(int(np.ceil(phase.max() - 0.5)), 1), dtype=np.float64) + 0.5
    curves, _ = isolines(opened, ScalarField(phase), levels=levels)
    paths = [_from_rim(line, surface, distance) for line in _joined(opened, curves)]
    lengths = np.array([arc_lengths(stroke.xyz(surface, 0))[-1] for stroke in paths])
    first = int(lengths.argmax())
    beside = [stroke for stroke, length in zip(paths, lengths, strict=True) if stroke.closed[0] and length > spacing]
    rest = float(sum(arc_lengths(ring.xyz(surface, 0))[-1] for ring in beside))
    if rest > MOST_BESIDE * lengths[first]:
        raise UsageError(
            f"a spiral winds about one centre, but the level curves of {surface.name} form several sets of rings. "
            f"{rest:.3g} mm in {len(beside)} of them lie off a spiral of {lengths[first]:.4g} mm: use `--pattern "
            "contours`, or another source (`--from`)."
        )
    return all_curves([_trimmed(paths[first], surface, distance, spacing=spacing), *beside])


def _joined(surface: Surface, curves: SurfaceCurves) -> list[SurfaceCurves]:
    """Return curves joined where the end of one is the start of another, each by itself."""
    opened = np.flatnonzero(~curves.closed)
    places = curves.points.xyz(surface)
    starts, ends = places[curves.offsets[opened]], places[curves.offsets[opened + 1] - 1]
    away, found = KDTree(starts).query(ends)
    following = np.where(away < SAME_POINT, found, -1)
    chains = [[int(curve)] for curve in np.flatnonzero(curves.closed)]
    left = set(range(opened.size))
    heads = [number for number in range(opened.size) if number not in set(following.tolist())]
    for head in [*heads, *range(opened.size)]:
        if head not in left:
            continue
        chain, at = list[int](), head
        while at in left:
            left.remove(at)
            chain.append(int(opened[at]))
            at = int(following[at])
        chains.append(chain)
    return [_one(curves, np.array(chain), places) for chain in chains]


def _one(curves: SurfaceCurves, chain: IntArray, places: FloatArray) -> SurfaceCurves:
    """Return curves of a chain as one curve; a point that two of them share counts once."""
    picked = some_curves(curves, chain)
    keep = np.ones(picked.points.faces.size, dtype=np.bool_)
    keep[picked.offsets[1:-1]] = False
    first, last = places[curves.offsets[chain[0]]], places[curves.offsets[chain[-1] + 1] - 1]
    points = picked.points[keep]
    closed = points.faces.size > 2 and float(np.linalg.norm(last - first)) < SAME_POINT
    return SurfaceCurves(points, np.array([0, points.faces.size]), np.array([closed]))


def _from_rim(curve: SurfaceCurves, surface: Surface, distance: FloatArray) -> SurfaceCurves:
    """Return a curve turned so that its distance rises from its start to its end."""
    away = curve.points.values(surface, distance)
    if away[0] <= away[-1]:
        return curve
    points = SurfacePoints(curve.points.faces[::-1].copy(), curve.points.weights[::-1].copy())
    return SurfaceCurves(points, curve.offsets, curve.closed)


def _trimmed(curve: SurfaceCurves, surface: Surface, distance: FloatArray, *, spacing: float) -> SurfaceCurves:
    """Return a stroke without its last bit about the middle, where it would bend too tightly and lie beside itself."""
    middle = surface.vertices[int(distance.argmax())]
    away = np.linalg.norm(curve.xyz(surface, 0) - middle, axis=1)
    count = max(int(np.flatnonzero(away >= LEFT_OVER * spacing).max(initial=0)) + 1, 2)
    points = curve.points[:count]
    return SurfaceCurves(points, np.array([0, count]), np.array([False]))
