"""What makes triangles a surface: two faces at an edge at most, one fan at a vertex, two sides, one piece."""

from __future__ import annotations

import numpy as np

from geoprint.errors import MeshError, how_many
from geoprint.geometry.halfedges import next_halves
from geoprint.geometry.points import in_words, triple
from geoprint.geometry.topology import (
    connected_nodes,
    crowded_half_edges,
    face_counts,
    half_edges,
    numbered_edges,
    twins,
)
from geoprint.model import BoolArray, IntArray, Surface


def check_edges(surface: Surface) -> None:
    """Refuse edges with more than two faces.

    Raises:
        MeshError: how many, and the middle of the first.
    """
    if crowded_half_edges(surface.faces).size:
        sides, side_edge = numbered_edges(surface.faces)
        crowded = np.flatnonzero(face_counts(side_edge) > 2)
        place = surface.vertices[sides[crowded[0]]].mean(axis=0)
        raise MeshError(
            f"{surface.name}: edges with more than two faces: {crowded.size}, the first at {in_words(place)}; a "
            "surface has one or two there, so remove the extra faces.",
            edges=int(crowded.size),
            place=triple(place),
        )


def turned_faces(surface: Surface) -> BoolArray:
    """Return which faces must be turned for a consistent winding that keeps most of the file's.

    Each face is taken twice, as it is and turned; neighbours are joined where their windings agree. An orientable
    piece then falls into two sheets that mirror each other, a non-orientable one hangs together.

    Returns:
        (m,) whether to turn each face. Where exactly half of a piece agrees, its first face stays.

    Raises:
        MeshError: an edge has more than two faces, or the surface is not orientable.
    """
    count = len(surface.faces)
    other = twins(surface.faces)
    half = np.flatnonzero(other >= 0)
    rising = np.less(*half_edges(surface.faces).T)
    # Half-edges of one edge agree when they run against each other.
    agree = rising[half] != rising[other[half]]
    if agree.all():
        return np.zeros(count, dtype=np.bool_)
    here, there = half // 3, other[half] // 3
    rows = np.concatenate([here, here + count])
    columns = np.concatenate([np.where(agree, there, there + count), np.where(agree, there + count, there)])
    sheets = connected_nodes(rows, columns, nodes=2 * count)
    as_is, turned = sheets[:count], sheets[count:]
    if (as_is == turned).any():
        place = surface.vertices[surface.faces[np.argmax(as_is == turned), 0]]
        raise MeshError(
            f"{surface.name} is not orientable: like a Moebius strip, the component at {in_words(place)} has one side "
            "only. Cut it open.",
            place=triple(place),
        )
    agreeing = np.bincount(as_is, minlength=int(sheets.max()) + 1)
    # Sheets are numbered by their first node, and the first face of a piece is there as it is before it is turned.
    return (agreeing[as_is] < agreeing[turned]) | ((agreeing[as_is] == agreeing[turned]) & (turned < as_is))


def split_vertices(surface: Surface) -> Surface:
    """Give each fan of faces a vertex of its own where several touch in one.

    Two holes with a common vertex become one hole, and sheets that touch in a point come apart there; nothing moves.

    Args:
        surface: consistently wound, with at most two faces at an edge.

    Returns:
        The surface with the copies behind its n vertices; the fan of the first face keeps the vertex.
    """
    other = twins(surface.faces)
    half = np.flatnonzero(other >= 0)
    # The start of a half-edge is the end of its twin: these two corners are next to each other at that vertex.
    touching = next_halves(other[half])
    fans = connected_nodes(half, touching, nodes=3 * len(surface.faces))
    vertex_of_fan = np.empty(int(fans.max()) + 1, dtype=np.int64)
    vertex_of_fan[fans] = surface.faces.ravel()
    first = np.zeros(len(surface.vertices), dtype=np.int64)
    # The last of several assignments stands: backwards, the first fan of each vertex.
    first[vertex_of_fan[::-1]] = np.arange(vertex_of_fan.size)[::-1]
    extra = np.flatnonzero(first[vertex_of_fan] != np.arange(vertex_of_fan.size))
    own = vertex_of_fan.copy()
    own[extra] = len(surface.vertices) + np.arange(extra.size)
    vertices = np.concatenate([surface.vertices, surface.vertices[vertex_of_fan[extra]]])
    return Surface(vertices=vertices, faces=own[fans].reshape(-1, 3), name=surface.name)


def check_connected(surface: Surface, labels: IntArray) -> None:
    """Refuse a surface in several pieces; those that touch in a vertex alone are separate.

    Args:
        surface: in as many pieces as there are labels.
        labels: (m,) piece of each face, as `topology.component_labels` numbers them; numbers may be left out.

    Raises:
        MeshError: how many, and a vertex of the smallest.
    """
    pieces, sizes = np.unique(labels, return_counts=True)
    if sizes.size > 1:
        smallest = pieces[np.argmin(sizes)]
        place = surface.vertices[surface.faces[np.argmax(labels == smallest), 0]]
        raise MeshError(
            f"{surface.name} has {how_many(sizes.size, 'separate component')}, the largest with {sizes.max()} faces, "
            f"the smallest with {sizes.min()} at {in_words(place)}. Delete all but one, or cut a patch out at a point "
            "(`--at`), several with a job file (`geoprint init` writes one).",
            pieces=int(sizes.size),
            place=triple(place),
        )
