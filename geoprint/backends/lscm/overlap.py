"""Does a flattened surface lie in the plane once? Turned triangles, turned holes and borders that cross."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from geoprint.backends.distortion import signed_areas
from geoprint.errors import FieldError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.surfaces import in_words, triple

# Chart triangles with less than this share of the mean chart area count as collapsed.
COLLAPSED_SHARE = 1e-9
# Segments of one search tree differ in length by at most this factor, so that a long one does not widen the search
# among short ones: a conformal chart may hold both a thousandfold.
LENGTH_CLASS_FACTOR = 2.0


def refuse_overlaps(surface: Surface, flat: FloatArray, loops: tuple[IntArray, ...]) -> None:
    """Refuse a chart in which two places of the surface fall on one.

    Where no triangle is turned, a place of the plane is covered as often as the border winds about it. So the chart
    is one to one exactly when the loops neither cross themselves nor each other, one of them runs
    counter-clockwise, and the others, the holes, run clockwise. Without the last condition a hole that is turned
    inside out would lie on top of the surface.

    Args:
        surface: n vertices, m faces; messages name its places.
        flat: (n, 2) vertices in the plane [mm].
        loops: boundary loops with the surface on their left, as `boundary_loops` returns them.

    Raises:
        FieldError: triangles are flipped or collapsed, holes are turned inside out, or the border crosses itself.
    """
    areas = signed_areas(flat, surface.faces)
    bad = areas <= COLLAPSED_SHARE * abs(areas.mean())
    if bad.any():
        place = surface.vertices[surface.faces[int(np.argmax(bad))]].mean(axis=0)
        count = int(bad.sum())
        raise _overlap(f"{count} of {areas.size} triangles of {surface.name} are flipped or collapsed", place, count)
    turned = [loop for loop in loops if _enclosed(flat[loop]) > 0.0][1:]
    if turned:
        place = surface.vertices[turned[0]].mean(axis=0)
        raise _overlap(
            f"{len(turned)} of {len(loops) - 1} holes of {surface.name} are turned inside out", place, len(turned)
        )
    start, end = np.concatenate(loops), np.concatenate([np.roll(loop, -1) for loop in loops])
    crossing = crossing_segments(flat[start], flat[end])
    if len(crossing):
        place = surface.vertices[start[crossing[0, 0]]]
        raise _overlap(f"the border of {surface.name} crosses itself {len(crossing)} times", place, len(crossing))


def crossing_segments(start: FloatArray, end: FloatArray) -> IntArray:
    """Return the pairs of segments in the plane that cross at a point inside both.

    Segments are sought by their middles in one k-d tree for each class of lengths: each segment asks the classes of
    its own length and longer. On borders of meshes, which do not crowd, that is O(s log s).

    Args:
        start: (s, 2) first ends.
        end: (s, 2) second ends.

    Returns:
        (p, 2) segments, the smaller first, rows ascending. Segments that touch at an end or lie on one line do not
        cross.

    Examples:
        >>> crossing_segments(np.array([[0.0, 0], [0, 2], [5, 5]]), np.array([[2.0, 2], [2, 0], [6, 5]]))
        array([[0, 1]])
    """
    lengths = np.sqrt(((end - start) ** 2).sum(axis=1))
    middles = 0.5 * (start + end)
    floor = max(float(lengths.max(initial=0.0)), np.finfo(np.float64).tiny) * np.finfo(np.float64).eps
    classes = np.floor(np.log(np.maximum(lengths, floor)) / np.log(LENGTH_CLASS_FACTOR))
    found: list[IntArray] = [np.empty((0, 2), dtype=np.int64)]
    for size in np.unique(classes):
        members, asking = np.flatnonzero(classes == size), np.flatnonzero(classes <= size)
        # Middles of two segments that meet are at most half of both lengths apart.
        near = KDTree(middles[asking]).sparse_distance_matrix(
            KDTree(middles[members]), float(lengths[members].max()), output_type="coo_matrix"
        )
        pairs = np.column_stack([asking[near.row], members[near.col]])
        found.append(pairs[_cross_inside(start[pairs], end[pairs])])
    return np.unique(np.sort(np.concatenate(found), axis=1), axis=0)


def _cross_inside(start: FloatArray, end: FloatArray) -> BoolArray:
    """Tell which of (p, 2, 2) pairs of segments have the ends of each on both sides of the other."""
    a, b, c, d = start[:, 0], end[:, 0], start[:, 1], end[:, 1]
    parted = _cross(b - a, c - a) * _cross(b - a, d - a) < 0.0
    parted &= _cross(d - c, a - c) * _cross(d - c, b - c) < 0.0
    # Of segments on one line rounding decides the sides; those that are apart have boxes that are apart.
    boxes = (np.maximum(a, b) >= np.minimum(c, d)) & (np.maximum(c, d) >= np.minimum(a, b))
    return parted & boxes.all(axis=1)


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def _enclosed(polygon: FloatArray) -> float:
    """Return the area [mm2] inside a closed polygon, positive where it runs counter-clockwise."""
    return 0.5 * float(_cross(polygon, np.roll(polygon, -1, axis=0)).sum())


def _overlap(what: str, place: FloatArray, count: int) -> FieldError:
    return FieldError(
        f"{what} in the chart, the first at {in_words(place)}: the flattened part would overlap itself. "
        "Use `--backend heat`, or a smaller patch.",
        place=triple(place),
        count=count,
    )
