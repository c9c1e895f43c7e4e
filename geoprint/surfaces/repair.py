"""Preparing a mesh: joining what belongs together, dropping what is empty, one winding; the rest is refused."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from geoprint.errors import MeshError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.surfaces.manifold import check_connected, check_edges, check_junctions, split_vertices, turned_faces
from geoprint.surfaces.operators import edge_lengths, face_areas
from geoprint.surfaces.topology import boundary_half_edges, boundary_loops, describe, edges, half_edges, loop_length

# Rim vertices closer than this share of the bounding box's diagonal are one: 0.01 mm for a part of 40 mm, which is
# what rounding leaves between the corners of STL triangles and far below a bead.
WELD_SHARE = 2.5e-4
# But never farther apart than this share of the median edge, so that a fine mesh keeps its own detail.
WELD_EDGE_SHARE = 0.05
# A face whose height is below this share of its longest side has no usable normal in double precision.
DEGENERATE_SHARE = 1e-9


@final
@dataclass(frozen=True, slots=True)
class PreparationReport:
    """What `prepare` changed, and what it found.

    Attributes:
        welded_vertices: vertices that were joined to another one.
        dropped_degenerate_faces: faces without area, before or after welding.
        dropped_duplicate_faces: faces with the same corners as an earlier one, whichever way they are wound.
        dropped_unreferenced_vertices: vertices that no face uses.
        flipped_faces: faces whose winding differs from the file's.
        split_vertices: copies made where several fans of faces touched in one vertex.
        vertices: number of vertices left.
        faces: number of faces left.
        topology: as `topology.describe` names it.
        boundary_lengths: length of each boundary loop [mm], the longest first.
        area: [mm2].
        mean_edge: mean edge length [mm].
    """

    welded_vertices: int
    dropped_degenerate_faces: int
    dropped_duplicate_faces: int
    dropped_unreferenced_vertices: int
    flipped_faces: int
    split_vertices: int
    vertices: int
    faces: int
    topology: str
    boundary_lengths: tuple[float, ...]
    area: float
    mean_edge: float


def prepare(surface: Surface) -> tuple[Surface, PreparationReport]:
    """Make a mesh from a file one that can be planned on, or say what stands in the way.

    In this order: faces without area are dropped; rim vertices that coincide are joined, exactly first and then within
    a tolerance (vertices inside the surface or at the two ends of an edge are never joined); faces that lost their area
    and duplicate faces are dropped; the winding is made consistent, keeping that of most faces, and a closed surface is
    turned outward; a vertex in which several fans of faces touch is given to each of them. Vertices that no face uses
    go. It does not refine, fill holes or move vertices otherwise.

    Args:
        surface: as loaded.

    Returns:
        The surface, with vertices and faces in their former order, copies of vertices last, and what was done.

    Raises:
        MeshError: nothing is left, an edge has more than two faces, the surface has one side only, several pieces
            (those that touch in a vertex alone are separate), or T-junctions; the message says how many and where.
    """
    solid = surface.faces[~_degenerate(surface.vertices, surface.faces)]
    welded = _welded(surface.vertices, solid)
    whole = welded[~_degenerate(surface.vertices, welded)]
    single = whole[_first_of_each(whole)]
    if len(single) == 0:
        raise MeshError(f"{surface.name}: none of its {len(surface.faces)} faces has an area; export the mesh again.")
    used, faces = np.unique(single, return_inverse=True)
    vertices, faces = surface.vertices[used], faces.reshape(-1, 3)
    turned = _checked_turns(Surface(vertices=vertices, faces=faces, name=surface.name))
    prepared = split_vertices(Surface(vertices=vertices, faces=_turn(faces, turned), name=surface.name))
    report = PreparationReport(
        welded_vertices=int(np.unique(solid).size - np.unique(welded).size),
        dropped_degenerate_faces=len(surface.faces) - len(whole),
        dropped_duplicate_faces=len(whole) - len(single),
        dropped_unreferenced_vertices=len(surface.vertices) - int(np.unique(surface.faces).size),
        flipped_faces=int(turned.sum()),
        split_vertices=len(prepared.vertices) - len(vertices),
        vertices=len(prepared.vertices),
        faces=len(prepared.faces),
        topology=describe(prepared),
        boundary_lengths=tuple(loop_length(prepared.vertices, loop) for loop in boundary_loops(prepared)),
        area=float(face_areas(prepared).sum()),
        mean_edge=float(edge_lengths(prepared).mean()),
    )
    return prepared, report


def signed_volume(surface: Surface) -> float:
    """Return the volume [mm3] inside a closed surface, positive if its faces are counter-clockwise from outside."""
    a, b, c = (surface.vertices[surface.faces[:, corner]] - surface.vertices.mean(axis=0) for corner in range(3))
    return float(np.einsum("mx,mx->", a, np.cross(b, c)) / 6)


def _checked_turns(surface: Surface) -> BoolArray:
    """Return which faces to turn, after every check."""
    check_edges(surface)
    turned = turned_faces(surface)
    wound = Surface(vertices=surface.vertices, faces=_turn(surface.faces, turned), name=surface.name)
    check_connected(wound)
    check_junctions(wound, tolerance=_weld_tolerance(wound.vertices, wound.faces))
    closed = boundary_half_edges(wound.faces).size == 0
    return ~turned if closed and signed_volume(wound) < 0 else turned


def _turn(faces: IntArray, turned: BoolArray) -> IntArray:
    return np.where(turned[:, None], faces[:, ::-1], faces)


def _degenerate(vertices: FloatArray, faces: IntArray) -> BoolArray:
    """Return (m,) whether a face has no area: a corner twice, or a height lost in rounding."""
    corners = vertices[faces]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return doubled <= DEGENERATE_SHARE * longest**2


def _first_of_each(faces: IntArray) -> IntArray:
    """Return the first of each set of faces with the same corners, ascending."""
    return np.sort(np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1])


def _welded(vertices: FloatArray, faces: IntArray) -> IntArray:
    """Return faces whose coincident rim vertices are one: each is replaced by the smallest index of its group.

    The exact round comes first because it turns most corners of an STL file into inner vertices, which the round with
    a tolerance then leaves alone.
    """
    if len(faces) == 0:
        return faces
    rim = _rim(faces)
    _, first, group = np.unique(vertices[rim], axis=0, return_index=True, return_inverse=True)
    exact = _renamed(faces, rim, rim[first[group.ravel()]], count=len(vertices))
    rim = _rim(exact)
    if rim.size == 0:
        return exact
    near = rim[KDTree(vertices[rim]).query_pairs(_weld_tolerance(vertices, exact), output_type="ndarray")]
    near = near[~_are_edges(near, exact, count=len(vertices))]
    shape = (len(vertices), len(vertices))
    graph = coo_array((np.ones(len(near), dtype=np.int8), (near[:, 0], near[:, 1])), shape=shape)
    labels = np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
    _, first = np.unique(labels, return_index=True)
    return first[labels][exact]


def _rim(faces: IntArray) -> IntArray:
    """Return the vertices on edges that have one face, ascending."""
    return np.unique(half_edges(faces)[boundary_half_edges(faces)])


def _renamed(faces: IntArray, old: IntArray, new: IntArray, *, count: int) -> IntArray:
    names = np.arange(count)
    names[old] = new
    return names[faces]


def _weld_tolerance(vertices: FloatArray, faces: IntArray) -> float:
    """Return the distance [mm] below which rim vertices are one."""
    used = vertices[np.unique(faces)]
    sides = vertices[edges(faces)]
    median_edge = float(np.median(np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1)))
    diagonal = float(np.linalg.norm(used.max(axis=0) - used.min(axis=0)))
    return min(WELD_SHARE * diagonal, WELD_EDGE_SHARE * median_edge)


def _are_edges(pairs: IntArray, faces: IntArray, *, count: int) -> BoolArray:
    """Return (k,) whether each of (k, 2) pairs of vertices is an edge."""
    ordered, known = np.sort(pairs, axis=1), edges(faces)
    return np.isin(ordered[:, 0] * count + ordered[:, 1], known[:, 0] * count + known[:, 1])
