"""The mesh doctor: what a mesh is, what is wrong with it and where, voxel staircases included."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import MeshError
from geoprint.geometry.crossings import crossings
from geoprint.geometry.halfedges import next_halves
from geoprint.geometry.manifold import turned_faces
from geoprint.geometry.operators import face_areas, face_normals, thinness
from geoprint.geometry.points import triple
from geoprint.geometry.repair import PreparationReport, join, repair
from geoprint.geometry.topology import (
    boundary_half_edges,
    component_labels,
    connected_nodes,
    face_counts,
    half_edges,
    numbered_edges,
    twins,
)
from geoprint.model import FloatArray, IntArray, Rounded, Surface, comparable, frozen, recorded

# Staircases: surfaces that a program put around voxels, whose steps are the grid's and not the part's.


# Normals that differ by less than this in a coordinate are one.
NORMAL_STEP = 0.02
# Around voxels there are few normals, however large the surface, and edges are sharp all over it.
FACES_PER_NORMAL = 40
SHARP_COSINE = 0.9
SHARP_SHARE = 0.12
# Heights closer than this share of the surface's size are those of one tread.
TREAD_SHARE = 1e-4
# Fewer treads in a direction are no stairs, nor are those of which the lowest tenth is lower than this share of a step.
LEAST_TREADS = 3
EVEN_SHARE = 0.98
# Faces of one normal count where they are at least this share of all.
NORMAL_SHARE = 0.02


def terrace_height(surface: Surface) -> float | None:
    """Return how high the steps of a staircase are [mm], or None where the surface is none.

    In whichever direction the grid lies: most of its faces have one of few normals, and those with one of the most
    frequent lie at heights that are a step apart, of which the largest is returned: a slice is thicker than its pixels.

    Args:
        surface: a prepared one.
    """
    normals = face_normals(surface)
    rounded = np.round(normals / NORMAL_STEP).astype(np.int64)
    kinds, kind, counts = np.unique(rounded, axis=0, return_inverse=True, return_counts=True)
    if len(kinds) * FACES_PER_NORMAL > len(surface.faces):
        return None
    across = twins(surface.faces)
    inner = np.flatnonzero(across >= 0)
    cosines = np.einsum("kx,kx->k", normals[inner // 3], normals[across[inner] // 3])
    if float((cosines < SHARP_COSINE).mean()) < SHARP_SHARE:
        return None
    middles = surface.vertices[surface.faces].mean(axis=1)
    tolerance = TREAD_SHARE * float(np.ptp(surface.vertices, axis=0).max())
    steps: list[float] = []
    for which in np.flatnonzero(counts > NORMAL_SHARE * len(normals)):
        faces = kind.ravel() == which
        heights: FloatArray = np.sort(middles[faces] @ normals[faces].mean(axis=0))
        gaps: FloatArray = heights[1:] - heights[:-1]
        gaps = gaps[gaps > tolerance]
        if gaps.size + 1 >= LEAST_TREADS and np.quantile(gaps, 0.1) > EVEN_SHARE * np.median(gaps):
            steps.append(float(np.median(gaps)))
    return max(steps, default=None)


# The mesh doctor: what a mesh is, what is wrong with it and where, and what preparing it would change.


# A face whose height is below this share of its longest side is a sliver: its smallest angle is below 1.2 degrees.
SLIVER_SHARE = 0.02
# Places that are listed of each kind of finding.
MOST_PLACES = 5


@final
@comparable
class Defect:
    """How many there are of something, and where the first of them are.

    Attributes:
        count: how many; None where it could not be counted.
        places: of the first MOST_PLACES [mm].
    """

    count: int | None
    places: tuple[tuple[float, ...], ...] = ()


@final
@recorded("RimRecord", length="length_mm", place="place_mm", centre="centre_mm")
class Rim:
    """A connected piece of the border.

    Attributes:
        length: [mm].
        edges: how many.
        place: a vertex of it [mm].
        centre: of its edges, each counted by its length [mm].
    """

    length: Rounded
    edges: int
    place: tuple[Rounded, ...]
    centre: tuple[Rounded, ...]


@final
@frozen
class Inspection:
    """What `inspect` finds. Places and lengths are mm.

    Attributes:
        examined: the prepared surface; where preparing refuses the mesh, the mesh with coincident vertices joined. All
            but `preparation` and `refusal` is said of it; flipped faces and non-manifold vertices also of the file.
        components: edge-connected pieces: faces, area [mm2] and a place of each, the largest first.
        rims: pieces of the border, the longest first; the others are holes, if there is one component.
        genus: number of handles; None where there are several pieces or it is no manifold.
        nonmanifold_edges: edges with more than two faces.
        nonmanifold_vertices: vertices in which several fans of faces touch.
        flipped_faces: faces wound against most of their piece; not counted where edges have more than two faces, or
            there is one side only.
        slivers: faces that are very thin.
        crossings: pairs of faces that cross or lie on each other.
        crossings_complete: whether all pairs were looked at.
        preparation: what preparing changes, or None where it refuses.
        refusal: why it refuses, or None.
    """

    examined: Surface
    components: tuple[tuple[int, float, tuple[float, ...]], ...]
    rims: tuple[Rim, ...]
    genus: int | None
    nonmanifold_edges: Defect
    nonmanifold_vertices: Defect
    flipped_faces: Defect
    slivers: Defect
    crossings: Defect
    crossings_complete: bool
    preparation: PreparationReport | None
    refusal: str | None


def inspect(surface: Surface, *, longest_hole: float | None = None) -> Inspection:
    """Examine a mesh, and try to prepare it.

    Args:
        surface: as loaded.
        longest_hole: as `prepare` takes it.

    Returns:
        The findings.

    Raises:
        MeshError: no face has an area.
    """
    joined = join(surface)
    preparation, refusal, examined = None, None, joined.surface
    try:
        examined, preparation = repair(joined, longest_hole=longest_hole)
    except MeshError as error:
        refusal = str(error)
    rim = half_edges(examined.faces)[boundary_half_edges(examined.faces)]
    rims = _rims(examined, rim)
    labels = np.zeros(len(examined.faces), dtype=np.int64) if preparation is not None else component_labels(examined)
    if preparation is not None:
        vertices, flips = Defect(preparation.repairs.split_vertices), Defect(preparation.repairs.flipped_faces)
        crossing, complete = Defect(0), preparation.crossings_checked
        crowded = np.empty((0, 3))
    else:
        sides, side_edge = numbered_edges(examined.faces)
        vertices, flips = _touching_fans(examined, side_edge), _flips(examined)
        crowded = examined.vertices[sides[face_counts(side_edge) > 2]].mean(axis=1)
        crossing, complete = _crossings(examined, depth=joined.tolerance)
    return Inspection(
        examined=examined,
        components=_components(examined, labels),
        rims=rims,
        genus=_genus(examined, rims=len(rims), rim_edges=len(rim)) if preparation else None,
        nonmanifold_edges=_defect(crowded),
        nonmanifold_vertices=vertices,
        flipped_faces=flips,
        slivers=_defect(_slivers(examined)),
        crossings=crossing,
        crossings_complete=complete,
        preparation=preparation,
        refusal=refusal,
    )


def _defect(places: FloatArray) -> Defect:
    """Return a finding at (k, 3) places."""
    return Defect(len(places), tuple(triple(place) for place in places[:MOST_PLACES]))


def _components(surface: Surface, labels: IntArray) -> tuple[tuple[int, float, tuple[float, ...]], ...]:
    """Return faces, area and a place of each piece, the largest first."""
    counts, areas = np.bincount(labels), np.bincount(labels, face_areas(surface))
    _, first = np.unique(labels, return_index=True)
    order = np.argsort(-areas, kind="stable")
    return tuple(
        (int(counts[piece]), float(areas[piece]), triple(surface.vertices[surface.faces[first[piece], 0]]))
        for piece in order
    )


def _genus(surface: Surface, *, rims: int, rim_edges: int) -> int:
    """Return the handles of a connected manifold: each inner edge has two half-edges, each of the border one."""
    edge_count = (3 * len(surface.faces) + rim_edges) // 2
    return (2 - rims - len(surface.vertices) + edge_count - len(surface.faces)) // 2


def _rims(surface: Surface, rim: IntArray) -> tuple[Rim, ...]:
    """Return the connected pieces of the border, of which (k, 2) are the edges; they need not be loops."""
    if len(rim) == 0:
        return ()
    lengths = np.linalg.norm(surface.vertices[rim[:, 1]] - surface.vertices[rim[:, 0]], axis=1)
    piece = connected_nodes(rim[:, 0], rim[:, 1], nodes=len(surface.vertices))[rim[:, 0]]
    _, first, label = np.unique(piece, return_index=True, return_inverse=True)
    counts, totals = np.bincount(label), np.bincount(label, lengths)
    middles = surface.vertices[rim].mean(axis=1)
    sums = np.column_stack([np.bincount(label, lengths * middles[:, axis]) for axis in range(3)])
    rims = [
        Rim(float(totals[i]), int(counts[i]), triple(surface.vertices[rim[first[i], 0]]), triple(sums[i] / totals[i]))
        for i in range(first.size)
    ]
    return tuple(sorted(rims, key=lambda found: -found.length))


def _touching_fans(surface: Surface, side_edge: IntArray) -> Defect:
    """Find the vertices whose faces do not hang together by edges there."""
    flat = side_edge.ravel()
    order = np.argsort(flat, kind="stable")
    here, there = order[:-1], order[1:]
    same = flat[here] == flat[there]
    here, there = here[same], there[same]
    corners = surface.faces.ravel()
    ahead, beyond = next_halves(here), next_halves(there)
    agree = corners[here] == corners[there]
    rows = np.concatenate([here, ahead])
    columns = np.concatenate([np.where(agree, there, beyond), np.where(agree, beyond, there)])
    fans = connected_nodes(rows, columns, nodes=corners.size)
    _, first = np.unique(fans, return_index=True)
    return _defect(surface.vertices[np.flatnonzero(np.bincount(corners[first]) > 1)])


def _flips(surface: Surface) -> Defect:
    """Find the faces wound against most of their piece, if that has a meaning."""
    try:
        turned = turned_faces(surface)
    except MeshError:
        return Defect(None)
    return _defect(surface.vertices[surface.faces[turned]].mean(axis=1))


def _slivers(surface: Surface) -> FloatArray:
    """Return the (k, 3) middles of very thin faces, the thinnest first."""
    doubled, squares = thinness(surface.vertices, surface.faces)
    heights = doubled / squares
    thin = np.flatnonzero(heights < SLIVER_SHARE)
    return surface.vertices[surface.faces[thin[np.argsort(heights[thin], kind="stable")]]].mean(axis=1)


def _crossings(surface: Surface, *, depth: float) -> tuple[Defect, bool]:
    pairs, complete = crossings(surface, depth=depth)
    return _defect(surface.vertices[surface.faces[pairs[:, 0]]].mean(axis=1)), complete
