"""Corners of level curves on ridges, where two fronts meet inside a triangle.

A level curve that is straight in each triangle cuts such a corner off by up to a triangle's width. The slopes along
the edges where it enters and leaves say in which directions it really runs there; the two lines meet on the ridge.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from geoprint.backends.marching.ridge_tips import tips_beyond
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfaceCurves, SurfacePoints
from geoprint.surfaces import positions

# Smaller turns within one triangle [rad] are the curvature of a front rather than the meeting of two.
LEAST_TURN = 0.2
# A point with a smaller barycentric weight on an edge lies at its end, where the edge does not say the direction.
VERTEX_WEIGHT = 1e-6

EdgeSlopes: TypeAlias = Callable[[IntArray, FloatArray], tuple[FloatArray, FloatArray]]


def with_ridge_corners(surface: Surface, curves: SurfaceCurves, *, edge_slopes: EdgeSlopes) -> SurfaceCurves:
    """Insert the corners that level curves have inside triangles.

    Args:
        surface: m faces.
        curves: level curves of a distance, larger values on their left; every point on an edge and, but for the last
            of an open curve, in the face that the curve crosses next.
        edge_slopes: given (k, 2) edges and (k,) shares of their length, returns the (k,) derivatives of the
            distance along them, per mm, and (k,) positive where it rises to the left of the edge, negative where to the
            right, and 0 where that is not known.

    Returns:
        The same curves with more points. Only turns to the left are ridges. A corner may lie beyond the third side of
        its triangle, where the curve pokes through; one beyond a vertex is left out.
    """
    points = curves.points
    first = np.setdiff1d(np.arange(points.faces.size), curves.offsets[1:] - 1)
    faces = points.faces[first]
    places = positions(surface, points)
    edges, shares, on_edge = _edges_of(surface, points)
    slopes, sides = edge_slopes(edges, shares)
    corners = surface.vertices[surface.faces[faces]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    chords = places[first + 1] - places[first]
    entering, leaving = (
        _directions(surface.vertices[edges[at]], slopes[at], sides[at], normals, chords) for at in (first, first + 1)
    )
    turn = _dot(np.cross(entering, leaving), normals)
    is_ridge = on_edge[first] & on_edge[first + 1] & (turn > np.sin(LEAST_TURN))
    steps = np.divide(_dot(np.cross(chords, leaving), normals), turn, out=np.zeros_like(turn), where=is_ridge)
    weights = _weights(corners, normals, places[first] + steps[:, None] * entering)
    is_ridge &= steps > 0.0
    inside = np.flatnonzero(is_ridge & (weights.min(axis=1) >= 0.0))
    outside = np.flatnonzero(is_ridge & (np.count_nonzero(weights < 0.0, axis=1) == 1))
    piece, tips = tips_beyond(
        surface,
        faces[outside],
        first=points.weights[first[outside]],
        corners=weights[outside],
        last=_weights(corners[outside], normals[outside], places[first[outside] + 1]),
    )
    before = np.concatenate([first[inside], first[outside][piece]]) + 1
    order = np.argsort(before, kind="stable")
    added_faces = np.concatenate([faces[inside], tips.faces])[order]
    added_weights = np.concatenate([weights[inside], tips.weights])[order]
    return _inserted(curves, before[order], SurfacePoints(added_faces, added_weights))


def _edges_of(surface: Surface, points: SurfacePoints) -> tuple[IntArray, FloatArray, BoolArray]:
    """Return (k, 2) ends of the edge of each point, its (k,) share from the first, and (k,) whether it is between."""
    opposite = np.argmin(points.weights, axis=1)
    row = np.arange(len(points.faces))
    start, end = (opposite + 1) % 3, (opposite + 2) % 3
    corners = surface.faces[points.faces]
    shares = points.weights[row, end]
    between = (points.weights[row, start] > VERTEX_WEIGHT) & (shares > VERTEX_WEIGHT)
    return np.column_stack([corners[row, start], corners[row, end]]), shares, between


def _directions(
    ends: FloatArray, slopes: FloatArray, sides: FloatArray, normals: FloatArray, chords: FloatArray
) -> FloatArray:
    """Return the (k, 3) unit directions of level curves at edges.

    Two have the slope; it is the one with the larger values on its left, or where the side of those is not known the
    one along the chord.
    """
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(normals, along)
    steep = np.clip(slopes, -1.0, 1.0)[:, None]
    rest = np.sqrt(1.0 - steep * steep)
    # The gradient turned clockwise.
    candidates = np.stack([rest * along - steep * across, -rest * along - steep * across])
    along_chord = _dot(candidates[0], chords) - _dot(candidates[1], chords)
    rising_left = np.where(sides == 0.0, along_chord, sides) >= 0.0
    return candidates[np.where(rising_left, 0, 1), np.arange(len(slopes))]


def _weights(corners: FloatArray, normals: FloatArray, places: FloatArray) -> FloatArray:
    """Return the (k, 3) barycentric weights of places in the planes of triangles."""
    following, last = np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)
    doubled = np.cross(following - places[:, None], last - places[:, None])
    parts: FloatArray = np.einsum("kcx,kx->kc", doubled, normals)
    return parts / parts.sum(axis=1, keepdims=True)


def _inserted(curves: SurfaceCurves, before: IntArray, points: SurfacePoints) -> SurfaceCurves:
    """Insert points, each before the point of the given index."""
    faces = np.insert(curves.points.faces, before, points.faces)
    weights = np.insert(curves.points.weights, before, points.weights, axis=0)
    offsets = curves.offsets + np.searchsorted(before, curves.offsets, side="left")
    return SurfaceCurves(SurfacePoints(faces, weights), offsets, curves.closed)


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.einsum("kx,kx->k", first, second)
