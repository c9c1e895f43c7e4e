"""Which nodes of a graph hang together: a forest in which the smallest node of each piece is its root.

Numba is loaded with this module, so that `topology` asks for it only when it is needed.
"""

from __future__ import annotations

import numpy as np

from geoprint.kernels import inner, njit
from geoprint.model import IntArray


@njit
def linked(first: IntArray, second: IntArray, nodes: int) -> IntArray:
    """Return the (nodes,) piece of each node, numbered by first node; (k,) links go from `first` to `second`."""
    parents = np.arange(nodes)
    for link in range(first.size):
        one, other = root(parents, first[link]), root(parents, second[link])
        # The smaller stays a root, so that a piece is numbered when its root comes.
        parents[max(one, other)] = min(one, other)
    labels, count = np.empty(nodes, np.int64), 0
    for node in range(nodes):
        if parents[node] == node:
            labels[node] = count
            count += 1
        else:
            # A parent is smaller than its child, and has its number.
            labels[node] = labels[parents[node]]
    return labels


@inner
def root(parents: IntArray, node: int) -> int:
    """Return the root above a node, and halve the path to it."""
    while parents[node] != node:
        parents[node] = parents[parents[node]]
        node = parents[node]
    return node
