"""In which of its two senses the line of each face runs at each vertex.

A line has two senses, and a phase that rises across it rises to the other side in the other sense. Each vertex chooses
the sense of one face beside it, and says of the others which of theirs is the same. Around a vertex with half an index
there is none: a sense that is carried once around comes back as its opposite.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.patterns.fibres.net import LineNet


@final
@frozen
class Senses:
    """How the senses of faces and of vertices agree.

    Attributes:
        corners: (m, 3) 1 where the line of a face has the sense of the vertex at its corner, -1 where the opposite.
        along: (m, 3) 1 where the vertices at both ends of the side from corner i to corner i + 1 have one sense.
        odd: (n,) vertices around which there is no sense.
    """

    corners: FloatArray
    along: FloatArray
    odd: BoolArray

    def __post_init__(self) -> None:
        freeze_arrays(self, corners="float: m 3", along="float: m 3", odd="bool: n")


def senses_of(surface: Surface, net: LineNet) -> Senses:
    """Return the senses of the lines on a surface; each vertex takes that of the first face beside it."""
    halves = np.flatnonzero(net.twins >= 0)
    beyond, corners = net.twins[halves], net.twins.size
    # Each corner in both senses; what is the same over a side is joined.
    here = np.concatenate([halves, _following(halves)])
    there = np.concatenate([_following(beyond), beyond])
    same = np.tile(net.signs[halves] > 0.0, 2)
    joined = np.concatenate([np.where(same, there, there + corners), np.where(same, there + corners, there)])
    places = np.concatenate([here, here + corners]), joined
    graph = csr_array((np.ones(joined.size), places), shape=(2 * corners, 2 * corners))
    label = connected_components(graph, directed=False)[1]
    vertices = surface.faces.ravel()
    first = np.zeros(len(surface.vertices), dtype=np.int64)
    first[vertices[::-1]] = np.arange(corners)[::-1]
    odd = np.zeros(len(surface.vertices), dtype=np.bool_)
    odd[vertices[label[:corners] == label[corners:]]] = True
    agreed = np.where(label[:corners] == label[first[vertices]], 1.0, -1.0).reshape(-1, 3)
    turned = _turned(surface, agreed * np.roll(agreed, -1, axis=1))
    corners_sense = agreed * turned[surface.faces]
    return Senses(corners_sense, corners_sense * np.roll(corners_sense, -1, axis=1), odd)


def _turned(surface: Surface, along: FloatArray) -> FloatArray:
    """Return (n,) -1 for vertices that take the other sense, so that all have one where the whole surface has one."""
    count = len(surface.vertices)
    here, there = surface.faces.ravel(), np.roll(surface.faces, -1, axis=1).ravel()
    same = along.ravel() > 0.0
    joined = np.concatenate([np.where(same, there, there + count), np.where(same, there + count, there)])
    places = np.concatenate([here, here + count]), joined
    graph = csr_array((np.ones(joined.size), places), shape=(2 * count, 2 * count))
    label = connected_components(graph, directed=False)[1]
    return np.where(label[:count] == label[surface.faces[0, 0]], 1.0, -1.0)


def _following(halves: IntArray) -> IntArray:
    """Return the next half-edge of the same face, which starts where each ends."""
    return halves - halves % 3 + (halves + 1) % 3
