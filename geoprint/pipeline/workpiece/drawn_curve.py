"""A closed curve drawn on a body: points joined by the shortest lines over the triangles, and what it encloses."""

from __future__ import annotations

from itertools import pairwise
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, frozen
from geoprint.quality.oracle import shortest_way
from geoprint.surfaces import (
    SurfaceLine,
    closest,
    connected_nodes,
    edge_faces,
    edge_keys,
    edges,
    face_areas,
    half_edges,
    in_words,
    inscribed,
    triple,
    with_vertex,
)


@final
@frozen
class Enclosed:
    """What a closed curve encloses.

    Attributes:
        surface: with the curve along edges.
        inside: (m,) which faces of it lie on the chosen side of the curve.
        length: of the curve [mm].
        share: of the surface's area that is inside.
    """

    surface: Surface
    inside: BoolArray
    length: float
    share: float


def enclosed(surface: Surface, points: FloatArray, *, at: FloatArray | None) -> Enclosed:
    """Draw a closed curve into the triangles of a surface and choose one of its sides.

    Args:
        surface: manifold, in one piece.
        points: (k, 3) on the surface [mm], in order round the curve; one that repeats its predecessor is left out, and
            so is the last where it repeats the first.
        at: (3,) on the side that is meant [mm]; None for the one with the smaller area.

    Raises:
        InputError: fewer than three different points, the curve meets itself, or it does not divide the surface.
        FieldError: two neighbouring points have no connection that can be found.
    """
    corners: list[int] = []
    for point in points:
        surface, vertex = with_vertex(surface, point)
        corners.append(vertex)
    corners = [vertex for vertex, before in zip(corners, [corners[-1], *corners[:-1]], strict=True) if vertex != before]
    if len(corners) < 3:
        raise InputError(
            f"a closed curve on {surface.name} needs three points or more, found {len(corners)} different ones.",
            points=len(corners),
        )
    repeated = [vertex for index, vertex in enumerate(corners) if vertex in corners[:index]]
    if repeated:
        raise _meeting(surface, surface.vertices[repeated[0]])
    surface, chain, length = _drawn(surface, corners)
    left, right = _sides(surface, chain)
    areas = face_areas(surface)
    if at is None:
        inside = left if areas[left].sum() <= areas[right].sum() else right
    else:
        inside = left if left[closest(surface, at[None, :])[0].faces[0]] else right
    return Enclosed(surface, inside, length, float(areas[inside].sum() / areas.sum()))


def _drawn(surface: Surface, corners: list[int]) -> tuple[Surface, IntArray, float]:
    """Join vertices in turn; return the surface with these lines as edges, their vertices in turn and their length."""
    chain, length = np.array(corners[:1]), 0.0
    for first, last in pairwise([*corners, corners[0]]):
        line = shortest_way(surface, first, last)
        _refuse_meeting(surface, line, chain)
        surface, vertices = inscribed(surface, line)
        chain, length = np.concatenate([chain, vertices[1:]]), length + line.length
    return surface, chain[:-1], length


def _refuse_meeting(surface: Surface, line: SurfaceLine, chain: IntArray) -> None:
    """Refuse a line that meets those drawn before it anywhere but at its own ends."""
    count = len(surface.vertices)
    drawn = edge_keys(np.column_stack([chain[:-1], chain[1:]]), vertices=count)
    crossed = edge_keys(line.edges, vertices=count)
    passes = (line.edges[:, 0] == line.edges[:, 1]) & np.isin(line.edges[:, 0], chain)
    # It starts where the last line ended, and the closing one ends where the first began.
    passes[0] = False
    passes[-1] &= line.edges[-1, 0] != chain[0]
    met = np.flatnonzero(passes | np.isin(crossed, drawn))
    if met.size:
        raise _meeting(surface, line.places(surface)[met[0]])


def _meeting(surface: Surface, place: FloatArray) -> InputError:
    return InputError(
        f"the curve on {surface.name} meets itself at {in_words(place)}; give its points in order round the patch, "
        "each once, and more of them where it turns sharply.",
        place=triple(place),
    )


def _sides(surface: Surface, chain: IntArray) -> tuple[BoolArray, BoolArray]:
    """Return (m,) which faces lie on the left and on the right of a closed chain of edges."""
    ends, beside = edges(surface.faces), edge_faces(surface.faces)
    count, following = len(surface.vertices), np.roll(chain, -1)
    drawn = edge_keys(np.column_stack([chain, following]), vertices=count)
    joined = beside[(beside[:, 1] >= 0) & ~np.isin(edge_keys(ends, vertices=count), drawn)]
    labels = connected_nodes(*joined.T, nodes=len(surface.faces))
    halves = half_edges(surface.faces) @ np.array([count, 1])
    on_left = np.unique(labels[np.flatnonzero(np.isin(halves, chain * count + following)) // 3])
    on_right = np.unique(labels[np.flatnonzero(np.isin(halves, following * count + chain)) // 3])
    if np.intersect1d(on_left, on_right).size or min(on_left.size, on_right.size) == 0:
        raise InputError(
            f"the curve does not divide {surface.name} into an inside and an outside: it goes round a handle or along "
            "the border; draw it round the patch."
        )
    return np.isin(labels, on_left), np.isin(labels, on_right)
