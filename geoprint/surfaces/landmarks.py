"""Landmarks: places by which a person finds the way on a surface, each with the outward normal there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from geoprint.model import BoolArray, FloatArray, IntArray, Surface, comparable
from geoprint.surfaces.clipping import closest_once, part_of
from geoprint.surfaces.operators import face_areas
from geoprint.surfaces.places import triple
from geoprint.surfaces.points import positions
from geoprint.surfaces.topology import boundary_half_edges, component_labels, edges, half_edges

# Vertices within this share of the part's size of the outermost one are as far out: a flat end has many.
LEVEL_SHARE = 1e-6
# Pieces of a surface that get a place each, the largest first.
MOST_PIECES = 5
INSIDE = "farthest from the border"


@final
@comparable
class Landmark:
    """A place on a surface.

    Attributes:
        name: what is there.
        place: (3,) [mm].
        normal: (3,) outward unit normal.
    """

    name: str
    place: tuple[float, ...]
    normal: tuple[float, ...]


def extremes(surface: Surface) -> tuple[Landmark, ...]:
    """Return the lowest and highest place along each axis; of a flat end that nearest to its middle.

    An axis along which the surface has no extent is left out.
    """
    used = surface.vertices[np.unique(surface.faces)]
    low, high = used.min(axis=0), used.max(axis=0)
    level = LEVEL_SHARE * float(np.linalg.norm(high - low))
    found: list[Landmark] = []
    for axis, letter in enumerate("xyz"):
        if high[axis] - low[axis] <= level:
            continue
        for name, end in (("lowest", low[axis]), ("highest", high[axis])):
            middle = used[np.abs(used[:, axis] - end) <= level].mean(axis=0)
            points, _ = closest_once(surface, middle[None])
            corner = int(np.argmax(points.weights[0]))
            at_vertex = points.weights[0, corner] > 1.0 - LEVEL_SHARE
            faces = (
                (surface.faces == surface.faces[points.faces[0], corner]).any(axis=1)
                if at_vertex
                else np.arange(len(surface.faces)) == points.faces[0]
            )
            found.append(Landmark(f"{name} {letter}", triple(positions(surface, points)[0]), _normal(surface, faces)))
    return tuple(found)


def farthest_inside(surface: Surface, faces: BoolArray, *, name: str) -> Landmark:
    """Return the vertex of some faces that is farthest from their border along edges; the highest where they have none.

    Args:
        surface: with m faces.
        faces: (m,) which of them, at least one.
        name: of the place.
    """
    part = part_of(surface, faces)
    border = np.unique(half_edges(part.faces)[boundary_half_edges(part.faces)])
    depth = part.vertices[:, 2]
    if border.size:
        first, second = edges(part.faces).T
        lengths = np.linalg.norm(part.vertices[first] - part.vertices[second], axis=1)
        links = coo_array((lengths, (first, second)), shape=(len(part.vertices), len(part.vertices))).tocsr()
        depth = dijkstra(links, directed=False, indices=border, min_only=True)
        # A closed piece among others is reached from no border.
        depth = np.where(np.isfinite(depth), depth, 0.0)
    vertex = int(np.argmax(depth))
    return Landmark(name, triple(part.vertices[vertex]), _normal(part, (part.faces == vertex).any(axis=1)))


def landmarks(surface: Surface, *, regions: Mapping[str, BoolArray]) -> tuple[Landmark, ...]:
    """Return the extremes, the place of each piece that is farthest from its border, and one of each region.

    Args:
        surface: manifold, m faces.
        regions: (m,) which faces lie in each, by its name; at least one.
    """
    labels = component_labels(surface)
    several = bool(labels.any())
    found = [*extremes(surface)]
    if several or boundary_half_edges(surface.faces).size:
        largest = np.argsort(-np.bincount(labels, face_areas(surface)), kind="stable")[:MOST_PIECES]
        found += [
            farthest_inside(surface, labels == piece, name=f"{INSIDE} of piece {number}" if several else INSIDE)
            for number, piece in enumerate(largest, start=1)
        ]
    return (*found, *(farthest_inside(surface, own, name=name) for name, own in regions.items()))


def _normal(surface: Surface, faces: BoolArray) -> tuple[float, ...]:
    """Return the unit mean of some faces' normals, weighted by area."""
    corners = surface.vertices[surface.faces[faces]]
    whole: FloatArray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    length = float(np.linalg.norm(whole))
    return triple(whole / length if length > 0.0 else whole)


def middle_face(surface: Surface, faces: IntArray, *, name: str) -> Landmark:
    """Return the middle of the one of some faces that is nearest to the mean of all; they need not hang together."""
    middles = surface.vertices[surface.faces[faces]].mean(axis=1)
    nearest = int(np.argmin(np.linalg.norm(middles - middles.mean(axis=0), axis=1)))
    own = np.zeros(len(surface.faces), dtype=np.bool_)
    own[faces[nearest]] = True
    return Landmark(name, triple(middles[nearest]), _normal(surface, own))
