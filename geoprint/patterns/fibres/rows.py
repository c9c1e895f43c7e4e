"""Which row a stroke is: how many lie side by side from the first one to it."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from geoprint.model import FloatArray, IntArray, Surface
from geoprint.patterns.fibres.levels import Chains
from geoprint.patterns.fibres.net import LineNet, surface_points
from geoprint.patterns.fibres.phase import Place

# From a row to the next is one, to a vertex between them half of it, and along a side that no row crosses so little
# that it never adds up; a graph has no joints of no length.
NEXT, BETWEEN, NO_ROW = 1.0, 0.5, 1e-9


def rows_of(surface: Surface, net: LineNet, chains: Chains, *, first: Place) -> IntArray:
    """Return (c,) the number of each row, 0 for the one that passes nearest to a place."""
    if not chains.closed.size:
        return np.zeros(0, dtype=np.int64)
    count = len(surface.vertices)
    begun = count + _nearest(surface, net, chains, first)
    away: FloatArray = dijkstra(_neighbours(surface, net, chains), directed=False, indices=[begun], min_only=True)
    return np.floor(away[count:] + BETWEEN).astype(np.int64)


def _neighbours(surface: Surface, net: LineNet, chains: Chains) -> csr_array:
    """Return the graph of n vertices and then c rows, joined where they follow one another along sides."""
    near, far = surface.faces.ravel(), np.roll(surface.faces, -1, axis=1).ravel()
    sides, rows = chains.sides, len(surface.vertices) + chains.rows
    fresh = np.append(True, np.diff(sides) != 0)
    last = np.append(fresh[1:], True)
    inner = np.flatnonzero(~fresh)
    crossed = np.zeros(near.size, dtype=np.bool_)
    crossed[sides] = True
    bare = np.flatnonzero(~(crossed | crossed[net.twins]) & (net.twins >= 0) | ~crossed & (net.twins < 0))
    joints = (
        (near[sides[fresh]], rows[fresh], BETWEEN),
        (far[sides[last]], rows[last], BETWEEN),
        (rows[inner - 1], rows[inner], NEXT),
        (near[bare], far[bare], NO_ROW),
    )
    both = np.concatenate([np.column_stack([one, other]) for one, other, _ in joints])
    cost = np.concatenate([np.full(one.size, length) for one, _, length in joints])
    # The same joint on many sides is one.
    pairs, chosen = np.unique(np.sort(both, axis=1), axis=0, return_index=True)
    count = len(surface.vertices) + chains.closed.size
    return csr_array((cost[chosen], (pairs[:, 0], pairs[:, 1])), shape=(count, count))


def _nearest(surface: Surface, net: LineNet, chains: Chains, first: Place) -> int:
    """Return the row with the piece nearest to a place: in its face, or where there is none by where pieces start."""
    face, place = first
    here = np.flatnonzero(chains.faces == face)
    if here.size:
        along = chains.ends[here] - chains.starts[here]
        share = np.clip(((place - chains.starts[here]) * along.conj()).real / np.abs(along) ** 2, 0.0, 1.0)
        piece = here[np.argmin(np.abs(chains.starts[here] + share * along - place))]
    else:
        begun = surface_points(net, chains.faces, chains.starts).xyz(surface)
        there = surface_points(net, np.array([face]), np.array([place])).xyz(surface)
        piece = np.argmin(np.linalg.norm(begun - there, axis=1))
    return int(np.searchsorted(chains.offsets, piece, side="right") - 1)
