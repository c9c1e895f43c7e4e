"""Preparing a mesh: what can be repaired without guessing is repaired and recorded; the rest is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, NamedTuple, final

import numpy as np

from geoprint.errors import MeshError
from geoprint.kernels import writable
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, comparable, frozen
from geoprint.surfaces.halfedges import counted
from geoprint.surfaces.operators import face_areas, signed_volume
from geoprint.surfaces.places import in_words, triple
from geoprint.surfaces.repair.crossings import crossings
from geoprint.surfaces.repair.holes import fill_holes
from geoprint.surfaces.repair.junctions import split_junctions
from geoprint.surfaces.repair.manifold import check_connected, check_edges, split_vertices, turned_faces
from geoprint.surfaces.repair.repairs import Repairs
from geoprint.surfaces.repair.welding import weld_tolerance, welded
from geoprint.surfaces.topology import (
    boundary_half_edges,
    boundary_loops,
    component_labels,
    connected_nodes,
    half_edges,
    kind_of,
    loop_length,
    turned_over,
    used_vertices,
)
from geoprint.surfaces.triangle_sizes import side_lengths, thinness

# A face whose height is below this share of its longest side has no usable normal in double precision.
DEGENERATE_SHARE = 1e-9
# A piece with less than this share of the area of the largest is a speck that a program left behind.
DEBRIS_SHARE = 1e-3
# Edges of the rim that a missing triangle leaves.
SINGLE_TRIANGLE = 3


@final
@frozen
class Joined:
    """A mesh whose coincident rim vertices are one, without faces that have no area or are there twice.

    Attributes:
        surface: with all vertices of the file.
        tolerance: distance below which vertices count as one [mm].
        repairs: what was joined and dropped.
    """

    surface: Surface
    tolerance: float
    repairs: Repairs


@final
@comparable
class PreparationReport:
    """What `prepare` changed, and what it found; `topology.describe` names the topology."""

    repairs: Repairs
    crossings_checked: Annotated[bool, "whether every pair of faces was looked at for crossing"]
    vertices: Annotated[int, "left"]
    faces: Annotated[int, "left"]
    topology: Annotated[str, "in words"]
    boundary_lengths: Annotated[tuple[float, ...], "of each rim, the longest first [mm]"]
    area: Annotated[float, "[mm2]"]
    mean_edge: Annotated[float, "mean length of an edge [mm]"]


def prepare(surface: Surface, *, longest_hole: float | None = None) -> tuple[Surface, PreparationReport]:
    """Make a mesh from a file one that can be planned on, or say what prevents it.

    In this order: faces without area are dropped; rim vertices that coincide are joined, exactly first and then within
    a tolerance (vertices inside the surface or at the two ends of an edge are never joined); faces that lost their area
    and duplicate faces are dropped; edges are cut at rim vertices that lie on them; specks beside the part are dropped;
    the winding is made consistent, keeping that of most faces; a vertex in which several fans of faces touch is given
    to each of them; missing triangles are put back; a closed surface is turned outward. Vertices that no face uses go.
    It does not refine, and no vertex moves but to one it is joined to.

    Args:
        surface: as loaded.
        longest_hole: holes whose rim is up to this long [mm] are closed too; None closes those of one triangle alone.

    Returns:
        The surface, with vertices and faces in their former order, new and cut ones last, and what was done.

    Raises:
        MeshError: nothing is left, an edge has more than two faces, the surface has one side only, several pieces
            (those that touch in a vertex alone are separate), or passes through itself; the message says how many and
            where.
    """
    return repair(join(surface), longest_hole=longest_hole)


def join(surface: Surface) -> Joined:
    """Join rim vertices that coincide, and drop faces without area and duplicate ones: the first steps of `prepare`.

    Raises:
        MeshError: nothing is left.
    """
    solid = surface.faces[~_degenerate(surface.vertices, surface.faces)]
    joined = welded(surface.vertices, solid)
    whole = joined[~_degenerate(surface.vertices, joined)]
    single = whole[_first_of_each(whole)]
    if len(single) == 0:
        raise MeshError(f"{surface.name}: none of its {len(surface.faces)} faces has an area; export the mesh again.")
    return Joined(
        surface=replace(surface, faces=single),
        tolerance=weld_tolerance(surface.vertices, single),
        repairs=Repairs(
            welded_vertices=int(used_vertices(solid).size - used_vertices(joined).size),
            dropped_degenerate_faces=len(surface.faces) - len(whole),
            dropped_duplicate_faces=len(whole) - len(single),
            dropped_unreferenced_vertices=int(len(surface.vertices) - used_vertices(surface.faces).size),
        ),
    )


def repair(joined: Joined, *, longest_hole: float | None = None) -> tuple[Surface, PreparationReport]:
    """Return what `prepare` returns, from its first steps on."""
    cut, junction_faces = split_junctions(joined.surface, tolerance=joined.tolerance)
    part, labels, debris_places = _without_debris(cut)
    turned, fans = _wound(part, labels)
    loops = boundary_loops(fans)
    filled, holes = fill_holes(fans, loops, longest=longest_hole)
    loops = boundary_loops(filled) if holes else loops
    inverted = not loops and signed_volume(filled) < 0
    prepared = turned_over(filled) if inverted else filled
    sizes = _sizes(prepared, loops)
    repairs = Repairs(
        dropped_debris_faces=len(cut.faces) - len(part.faces),
        debris_places=debris_places,
        junction_faces=junction_faces,
        flipped_faces=int((~turned if inverted else turned).sum()),
        split_vertices=len(fans.vertices) - len(part.vertices),
        filled_holes=holes,
    )
    report = PreparationReport(
        repairs=joined.repairs + repairs,
        crossings_checked=_check_crossings(prepared, depth=joined.tolerance),
        vertices=len(prepared.vertices),
        faces=len(prepared.faces),
        topology=sizes.topology,
        boundary_lengths=sizes.boundary_lengths,
        area=float(face_areas(prepared).sum()),
        mean_edge=sizes.mean_edge,
    )
    return prepared, report


def stays_open(surface: Surface) -> bool:
    """Tell whether preparing a surface in one piece, joined before, leaves a border, without preparing it.

    A rim goes where its vertices lie on each other's edges, or where it is that of a single triangle.

    Raises:
        MeshError: as `prepare`, where cutting edges does not end.
    """
    cut, _ = split_junctions(surface, tolerance=weld_tolerance(surface.vertices, surface.faces))
    rim = half_edges(cut.faces)[boundary_half_edges(cut.faces)]
    rims = connected_nodes(rim[:, 0], rim[:, 1], nodes=len(cut.vertices))[rim[:, 0]]
    return bool((np.bincount(rims) > SINGLE_TRIANGLE).any())


def _without_debris(surface: Surface) -> tuple[Surface, IntArray, tuple[tuple[float, ...], ...]]:
    """Return the surface without specks and unused vertices, the piece of each face, and a corner of each speck."""
    labels = component_labels(surface)
    areas = np.bincount(labels, face_areas(surface))
    specks = np.flatnonzero(areas < DEBRIS_SHARE * areas.max())
    _, first = np.unique(labels, return_index=True)
    places = tuple(triple(surface.vertices[surface.faces[first[speck], 0]]) for speck in specks)
    kept = ~np.isin(labels, specks)
    faces = surface.faces[kept]
    used = used_vertices(faces)
    names = np.zeros(len(surface.vertices), dtype=np.int64)
    names[used] = np.arange(used.size)
    part = Surface(vertices=surface.vertices[used], faces=names[faces], name=surface.name)
    return part, labels[kept], places


def _wound(surface: Surface, labels: IntArray) -> tuple[BoolArray, Surface]:
    """Return which faces were turned for a consistent winding, and the surface so wound, each fan apart."""
    check_edges(surface)
    turned = turned_faces(surface)
    check_connected(surface, labels)
    wound = replace(surface, faces=np.where(turned[:, None], surface.faces[:, ::-1], surface.faces))
    return turned, split_vertices(wound)


class _Sizes(NamedTuple):
    """What the loops of a prepared surface tell without numbering its edges again, which is slow on large ones."""

    topology: str
    boundary_lengths: tuple[float, ...]
    mean_edge: float


def _sizes(surface: Surface, loops: tuple[IntArray, ...]) -> _Sizes:
    """Return the sizes of a connected manifold: each inner edge has two half-edges, each border edge one."""
    lengths = tuple(loop_length(surface.vertices, loop) for loop in loops)
    edge_count = (3 * len(surface.faces) + sum(loop.size for loop in loops)) // 2
    total = float(side_lengths(surface.vertices, surface.faces).ravel().sum()) + sum(lengths)
    euler = len(surface.vertices) - edge_count + len(surface.faces)
    return _Sizes(kind_of(euler, loops=len(loops)), lengths, total / (2 * edge_count))


def _check_crossings(surface: Surface, *, depth: float) -> bool:
    """Refuse a surface that passes through itself; return whether all of it was looked at."""
    found = crossings(surface, depth=depth)
    if len(found.pairs):
        place = surface.vertices[surface.faces[found.pairs[0, 0]]].mean(axis=0)
        number = f"{len(found.pairs)}" if found.complete else f"at least {len(found.pairs)}"
        raise MeshError(
            f"{surface.name} passes through itself: pairs of faces that cross or lie on each other: {number}, the "
            f"first at {in_words(place)}; no nozzle can follow it there, so cut or remesh the part there.",
            pairs=len(found.pairs),
            place=triple(place),
        )
    return found.complete


def _degenerate(vertices: FloatArray, faces: IntArray) -> BoolArray:
    """Return (m,) whether a face has no area: a corner twice, or a height lost in rounding."""
    doubled, squares = thinness(writable(vertices), writable(faces))
    return doubled <= DEGENERATE_SHARE * squares


def _first_of_each(faces: IntArray) -> IntArray:
    """Return the first of each set of faces with the same corners, ascending."""
    corners = np.sort(faces, axis=1)
    order = np.arange(len(faces))
    for corner in (2, 1, 0):
        order = counted(np.ascontiguousarray(corners[:, corner]), order, int(faces.max(initial=0)) + 1)
    ordered = corners[order]
    starts = np.concatenate([np.ones(min(len(order), 1), dtype=np.bool_), (ordered[1:] != ordered[:-1]).any(axis=1)])
    return np.sort(order[starts])
