"""Connectivity of a triangle mesh: edges, half-edges, boundary loops, components and the kind of surface.

Half-edges are numbered as `halfedges` says. All of this reads the faces alone; only the order of boundary loops asks
for lengths.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from geoprint.errors import MeshError
from geoprint.model import FloatArray, IntArray, Surface

# Digits to which lengths of loops are compared [mm]: rounding does not decide which of two is the longer.
EQUAL_DIGITS = 5


def half_edges(faces: IntArray) -> IntArray:
    """Return the start and end vertex of every half-edge.

    Args:
        faces: (m, 3) vertex indices.

    Returns:
        (3 m, 2) start and end of half-edge 3 f + i.
    """
    return faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def turned_over(surface: Surface) -> Surface:
    """Return a surface wound in the opposite sense, so that its inside is outside."""
    return replace(surface, faces=surface.faces[:, ::-1])


def used_vertices(indices: IntArray) -> IntArray:
    """Return the vertices that faces or edges refer to, each once, ascending.

    Args:
        indices: vertex indices of any shape.
    """
    # Sorting millions of indices takes half a second, counting them does not.
    return np.flatnonzero(np.bincount(indices.ravel()))


def edges(faces: IntArray) -> IntArray:
    """Return every undirected edge once.

    Args:
        faces: (m, 3) vertex indices.

    Returns:
        (e, 2) vertex indices, the smaller first, rows ascending.

    Examples:
        >>> edges(np.array([[0, 1, 2], [2, 1, 3]]))
        array([[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]])
    """
    return numbered_edges(faces)[0]


def numbered_edges(faces: IntArray) -> tuple[IntArray, IntArray]:
    """Number the undirected edges and say which one each side of each face is.

    Args:
        faces: (m, 3) vertex indices.

    Returns:
        (e, 2) edges as `edges` returns them, and (m, 3) the edge from corner i to corner i + 1 of each face.
    """
    found, side_edge = numbered_pairs(half_edges(faces))
    return found, side_edge.reshape(-1, 3)


def numbered_pairs(sides: IntArray) -> tuple[IntArray, IntArray]:
    """Number the undirected edges among some sides.

    Args:
        sides: (k, 2) vertex indices, in either order.

    Returns:
        (e, 2) edges as `edges` returns them, and (k,) the edge of each side.
    """
    base = int(sides.max(initial=0)) + 1
    keys, edge = np.unique(edge_keys(sides, vertices=base), return_inverse=True)
    return np.column_stack(np.divmod(keys, base)), edge


def edge_keys(sides: IntArray, *, vertices: int) -> IntArray:
    """Return (k,) numbers that are equal for equal undirected edges, and rise as `edges` orders them.

    Args:
        sides: (k, 2) vertex indices, in either order.
        vertices: more than the largest index.
    """
    ordered = np.sort(sides, axis=1)
    return ordered[:, 0] * vertices + ordered[:, 1]


def connected_nodes(first: IntArray, second: IntArray, *, nodes: int) -> IntArray:
    """Return the (nodes,) component of each node of an undirected graph, numbered by first node.

    Args:
        first: (k,) one end of each link.
        second: (k,) its other end.
        nodes: how many there are.
    """
    links = coo_array((np.ones(first.size), (first, second)), shape=(nodes, nodes))
    _, labels = connected_components(links, directed=False)
    return labels.astype(np.int64)


def face_counts(side_edge: IntArray) -> IntArray:
    """Return the (e,) number of faces at each edge, given the (m, 3) numbering of `numbered_edges`."""
    return np.bincount(side_edge.ravel())


def edge_faces(faces: IntArray) -> IntArray:
    """Return the faces on both sides of every edge of a manifold mesh.

    Args:
        faces: (m, 3) vertex indices.

    Returns:
        (e, 2) face indices in the order of `edges`, ascending within a row; -1 in the second column on the boundary.

    Raises:
        MeshError: an edge has more than two faces.
    """
    side_edge = numbered_edges(faces)[1]
    counts = face_counts(side_edge)
    if counts.max(initial=0) > 2:
        raise _crowded(counts)
    order, first = np.argsort(side_edge.ravel(), kind="stable"), np.concatenate([[0], np.cumsum(counts)[:-1]])
    result = np.full((counts.size, 2), -1, dtype=np.int64)
    result[:, 0] = order[first] // 3
    inner = counts == 2
    result[inner, 1] = order[first[inner] + 1] // 3
    return result


def twins(faces: IntArray) -> IntArray:
    """Return the half-edge on the other side of the same edge.

    Args:
        faces: (m, 3) vertex indices of a manifold mesh.

    Returns:
        (3 m,) the other half-edge of the edge of half-edge 3 f + i; -1 on the boundary.

    Raises:
        MeshError: an edge has more than two faces.
    """
    other = _matched(faces)
    if other.min(initial=-1) < -1:
        raise _crowded(face_counts(numbered_edges(faces)[1]))
    return other


def boundary_half_edges(faces: IntArray) -> IntArray:
    """Return the half-edges whose edge has no other face, ascending."""
    return np.flatnonzero(_matched(faces) == -1)


def crowded_half_edges(faces: IntArray) -> IntArray:
    """Return the half-edges whose edge has more than two faces, ascending."""
    return np.flatnonzero(_matched(faces) == -2)


def encloses(faces: IntArray) -> bool:
    """Tell whether faces leave no border and are wound in one sense: every half-edge has one twin, which runs back."""
    other, starts = _matched(faces), faces.ravel()
    return bool(other.min(initial=0) >= 0) and bool((starts[other] != starts).all())


def boundary_loops(surface: Surface) -> tuple[IntArray, ...]:
    """Return the closed loops of boundary edges.

    A loop follows its half-edges, so that the surface is on its left seen from outside: the rim of a disc runs
    counter-clockwise, the rim of a hole in it clockwise. It starts at its smallest vertex index.

    Args:
        surface: manifold and consistently wound.

    Returns:
        One (l,) array of vertex indices a loop, the first not repeated; the longest [mm] first, those that are
        equally long to 1e-5 mm by their first vertex. Empty for a closed surface.

    Raises:
        MeshError: two loops pass through one vertex, or the winding is not consistent.
    """
    rim = half_edges(surface.faces)[boundary_half_edges(surface.faces)]
    starts, ends = rim[np.argsort(rim[:, 0])].T
    if np.unique(starts).size != starts.size or not np.array_equal(starts, np.sort(ends)):
        raise MeshError(
            f"{surface.name}: the boundary does not fall into separate loops; prepare the surface first, "
            "which says where it is pinched or inconsistently wound."
        )
    following = dict(zip(starts.tolist(), ends.tolist(), strict=True))
    loops: list[IntArray] = []
    while following:
        # Insertion order is ascending, so that every loop starts at its smallest vertex.
        start, vertex = next(iter(following.items()))
        loop = [start]
        while vertex != start:
            loop.append(vertex)
            vertex = following.pop(vertex)
        del following[start]
        loops.append(np.array(loop, dtype=np.int64))
    return tuple(sorted(loops, key=lambda loop: (-round(loop_length(surface.vertices, loop), EQUAL_DIGITS), loop[0])))


def loop_length(vertices: FloatArray, loop: IntArray) -> float:
    """Return the length [mm] of a closed loop of vertex indices that does not repeat its first."""
    return float(np.linalg.norm(vertices[np.roll(loop, -1)] - vertices[loop], axis=1).sum())


def component_labels(surface: Surface) -> IntArray:
    """Number the edge-connected parts of a surface.

    Returns:
        (m,) component of each face, numbered from 0 in the order of their first faces. Parts that touch in a vertex
        alone are different components.
    """
    other = _matched(surface.faces)
    half, crowded = np.flatnonzero(other >= 0), np.flatnonzero(other < -1)
    first, second = half // 3, other[half] // 3
    if crowded.size:
        # Of more than two faces at an edge each is joined to the first.
        _, edge = numbered_pairs(half_edges(surface.faces)[crowded])
        _, leading = np.unique(edge, return_index=True)
        first, second = np.append(first, crowded // 3), np.append(second, crowded[leading][edge] // 3)
    return connected_nodes(first, second, nodes=len(surface.faces))


def euler_characteristic(surface: Surface) -> int:
    """Return vertices - edges + faces, counting only vertices that a face uses: disc 1, annulus 0, sphere 2."""
    return int(used_vertices(surface.faces).size - len(edges(surface.faces)) + len(surface.faces))


def describe(surface: Surface) -> str:
    """Name the kind of a manifold, orientable surface by its Euler characteristic and boundary loops.

    Returns:
        'disc', 'annulus', 'disc with 2 holes', 'closed, genus 1', 'genus 1 with 2 boundary loops', or
        '3 components' for a surface in several parts.

    Raises:
        MeshError: as `boundary_loops`.
    """
    components = int(component_labels(surface).max()) + 1
    if components > 1:
        return f"{components} components"
    return kind_of(euler_characteristic(surface), loops=len(boundary_loops(surface)))


def kind_of(euler: int, *, loops: int) -> str:
    """Return what `describe` returns for a surface in one piece, given its Euler characteristic and its loops."""
    genus = (2 - loops - euler) // 2
    if loops == 0:
        return f"closed, genus {genus}"
    if genus > 0:
        return f"genus {genus} with {loops} boundary loop{'s' if loops > 1 else ''}"
    return ("disc", "annulus")[loops - 1] if loops <= 2 else f"disc with {loops - 1} holes"


def _matched(faces: IntArray) -> IntArray:
    """Return the (3 m,) twins of half-edges, -1 on the border and -2 where an edge has more than two faces."""
    from geoprint.geometry.halfedges import matched  # here, because Numba takes half a second to load

    return matched(faces.ravel(), int(faces.max(initial=-1)) + 1)


def _crowded(counts: IntArray) -> MeshError:
    """Return the refusal of edges with more than two faces, given the number of faces at each edge."""
    return MeshError(
        f"{int((counts > 2).sum())} edges have more than two faces; prepare the surface first, which says where."
    )
