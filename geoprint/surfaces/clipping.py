"""Cutting a piece out of a surface: along the zero line of a function through its triangles, or by whole faces."""

from __future__ import annotations

import numpy as np

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints
from geoprint.surfaces.operators import doubled_area_vectors
from geoprint.surfaces.points import closest
from geoprint.surfaces.topology import component_labels, edges, used_vertices

# A cut that passes a vertex closer than this share of its height over the far sides of its triangles takes the vertex
# along instead of leaving a sliver beside it. So far no triangle turns over, and at 1.5 mm edges and 10 degrees
# between faces the surface moves by less than 0.02 mm.
SNAP_SHARE = 0.08
# Distances of places a metre off are rounded to less than this [mm].
ROUNDING = 1e-9


def clipped(surface: Surface, bounds: FloatArray) -> Surface:
    """Keep the part of a surface on which functions are not positive, cutting through triangles.

    The functions are linear in each triangle, so that the new rim is straight in each; what is left of a triangle
    becomes one or two. Where the rim passes very close to a vertex, the vertex slides along its edge onto the rim.

    Args:
        surface: n vertices, manifold.
        bounds: (n, k) values of k functions at the vertices; the part lies where all of them are at most 0.

    Returns:
        The part, in as many pieces as it falls into, wound as before.

    Raises:
        InputError: nothing is left, or a value is not finite.
    """
    if bounds.shape[:1] != (len(surface.vertices),) or not np.isfinite(bounds).all():
        raise InputError(f"{surface.name} can only be cut where finite values are given at all of its vertices.")
    # Columns after the position are carried along: a later cut finds its values at the vertices an earlier one made.
    carried = np.column_stack([surface.vertices, bounds])
    faces = surface.faces
    for column in range(3, carried.shape[1]):
        carried, faces = _cut(carried, faces, column)
        if len(faces) == 0:
            raise InputError(f"{surface.name} has no part within the given bounds; check their place and size in mm.")
    used, named = _compact(faces, count=len(carried))
    return Surface(vertices=carried[used, :3], faces=named, name=surface.name)


def part_of(surface: Surface, kept: BoolArray) -> Surface:
    """Return some of the faces with the vertices they use, both in their order.

    Args:
        surface: m faces.
        kept: (m,) which faces, at least one.
    """
    used, named = _compact(surface.faces[kept], count=len(surface.vertices))
    return Surface(vertices=surface.vertices[used], faces=named, name=surface.name)


def piece_at(surface: Surface, xyz: FloatArray) -> Surface:
    """Return the edge-connected piece of a surface that is nearest to a (3,) position [mm]."""
    labels = component_labels(surface)
    if not labels.any():
        return surface
    nearest, _ = closest_once(surface, xyz[None, :])
    return part_of(surface, labels == labels[nearest.faces[0]])


def faces_within(surface: Surface, centre: FloatArray, *, radius: float) -> BoolArray:
    """Return (m,) which faces may reach into a ball about a (3,) position: all that do, and few others."""
    from geoprint.surfaces.triangle_sizes import reaching  # here, because Numba takes half a second to load

    return reaching(surface.vertices, surface.faces, centre, radius)


def closest_once(surface: Surface, xyz: FloatArray) -> tuple[SurfacePoints, FloatArray]:
    """Return what `closest` does for places that lie together and are asked for once.

    Only the faces about them are sorted: what is closest to a place in a ball about the middle of all lies no farther
    from that place than whatever point of the surface is nearest to the middle.
    """
    from geoprint.surfaces.triangle_sizes import nearest_middle  # as in `faces_within`

    if not np.isfinite(xyz).all():
        # It refuses them, in its own words.
        return closest(surface, xyz)
    centre = 0.5 * (xyz.min(axis=0) + xyz.max(axis=0))
    spread = float(np.linalg.norm(xyz - centre, axis=1).max())
    nearest = nearest_middle(surface.vertices, surface.faces, centre)
    near = faces_within(surface, centre, radius=2.0 * spread + nearest + ROUNDING)
    found, distances = closest(part_of(surface, near), xyz)
    return SurfacePoints(np.flatnonzero(near)[found.faces], found.weights), distances


def _cut(carried: FloatArray, faces: IntArray, column: int) -> tuple[FloatArray, IntArray]:
    """Cut at the zero of one column; vertices that the result does not use are left in place."""
    carried = _snapped(carried, faces, column)
    values = carried[:, column]
    pairs = edges(faces)
    pairs = pairs[np.sign(values[pairs]).prod(axis=1) < 0]
    new = _crossings(carried, pairs, column)
    keys = pairs[:, 0] * len(carried) + pairs[:, 1]

    def on_edge(a: IntArray, b: IntArray) -> IntArray:
        low, high = np.minimum(a, b), np.maximum(a, b)
        return len(carried) + np.searchsorted(keys, low * len(carried) + high)

    grown = np.concatenate([carried, new])
    signs = np.sign(values[faces])
    pieces = [faces[(signs <= 0).all(axis=1)]]
    below, above = (signs < 0).sum(axis=1), (signs > 0).sum(axis=1)
    a, b, c = _led_by(faces, signs, (below == 1) & (above == 2), sign=-1).T
    pieces.append(np.column_stack([a, on_edge(a, b), on_edge(a, c)]))
    a, b, c = _led_by(faces, signs, (below == 2) & (above == 1), sign=1).T
    pieces.append(_quadrangles(grown, b, c, on_edge(c, a), on_edge(a, b)))
    a, b, c = _led_by(faces, signs, (below == 1) & (above == 1), sign=-1).T
    # Led by the one below; of the others one is above and one on the cut, in either order.
    third: BoolArray = values[b] == 0
    cut = on_edge(a, c * third + b * ~third)
    pieces.append(np.column_stack([a, np.where(third, b, cut), np.where(third, cut, c)]))
    return grown, np.concatenate(pieces)


def _snapped(carried: FloatArray, faces: IntArray, column: int) -> FloatArray:
    """Slide vertices that the cut passes very closely along their edge onto it."""
    values = carried[:, column]
    pairs = edges(faces)
    pairs = pairs[np.sign(values[pairs]).prod(axis=1) < 0]
    lengths = np.linalg.norm(carried[pairs[:, 1], :3] - carried[pairs[:, 0], :3], axis=1)
    ends = np.concatenate([pairs, pairs[:, ::-1]])
    shares = values[ends[:, 0]] / (values[ends[:, 0]] - values[ends[:, 1]])
    slides = shares * np.concatenate([lengths, lengths])
    near = np.flatnonzero(slides < SNAP_SHARE * _least_heights(carried[:, :3], faces)[ends[:, 0]])
    # The last assignment wins: the nearest crossing of each vertex.
    near = near[np.argsort(-slides[near], kind="stable")]
    result = carried.copy()
    start, end, share = ends[near, 0], ends[near, 1], shares[near, None]
    result[start] = (1 - share) * carried[start] + share * carried[end]
    result[start, column] = 0.0
    return result


def _least_heights(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the (n,) smallest distance of each vertex from the line through the far side of one of its faces."""
    corners = vertices[faces]
    doubled = np.linalg.norm(doubled_area_vectors(vertices, faces), axis=1)
    far = np.linalg.norm(corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]], axis=2)
    heights = doubled[:, None] / np.maximum(far, np.finfo(np.float64).tiny)
    least = np.full(len(vertices), np.inf)
    np.minimum.at(least, faces.ravel(), heights.ravel())
    return least


def _crossings(carried: FloatArray, pairs: IntArray, column: int) -> FloatArray:
    """Return the rows of new vertices where a column is 0 on each of (e, 2) edges."""
    first, second = carried[pairs[:, 0]], carried[pairs[:, 1]]
    share = (first[:, column] / (first[:, column] - second[:, column]))[:, None]
    new = (1 - share) * first + share * second
    new[:, column] = 0.0
    return new


def _led_by(faces: IntArray, signs: FloatArray, chosen: BoolArray, *, sign: int) -> IntArray:
    """Return the chosen faces, turned so that their one corner of a sign comes first."""
    lead = np.argmax(signs[chosen] == sign, axis=1)
    return np.take_along_axis(faces[chosen], (lead[:, None] + np.arange(3)) % 3, axis=1)


def _quadrangles(carried: FloatArray, a: IntArray, b: IntArray, c: IntArray, d: IntArray) -> IntArray:
    """Return two triangles of each quadrangle a b c d, divided along its shorter diagonal."""
    points = carried[:, :3]
    by_a = np.linalg.norm(points[c] - points[a], axis=1) <= np.linalg.norm(points[d] - points[b], axis=1)
    first = np.where(by_a[:, None], np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    second = np.where(by_a[:, None], np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    return np.concatenate([first, second])


def _compact(faces: IntArray, *, count: int) -> tuple[IntArray, IntArray]:
    """Return the vertices that faces use, and the faces in terms of these."""
    used = used_vertices(faces)
    names = np.zeros(count, dtype=np.int64)
    names[used] = np.arange(used.size)
    return used, names[faces]
