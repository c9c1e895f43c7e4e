"""Level surfaces of the distance from a part: what a layer of even thickness ends in.

A part pushed along its normals is too thin where it bulges between vertices and folds where it is hollow. Here every
vertex has the wanted distance to the closest place of the part, and edges are halved until what lies between does too.
"""

from __future__ import annotations

import numpy as np

from geoprint.errors import FieldError, InputError, MeshError
from geoprint.layers.feet import Ground
from geoprint.layers.nets import net
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.surfaces import clipped, component_labels, face_normals, part_of
from geoprint.surfaces.remesh import halved, remesh
from geoprint.surfaces.topology import half_edges, numbered_pairs, used_vertices

# Grids that are tried, moved by these shares of a cell: where two sheets share a cell of one, they may not of another.
SHIFTS = (0.0, 0.37, 0.71, 0.53)
# Cells are a little smaller than the edges that are wanted.
CELL_SHARE = 0.8
# Rounds of halving: each takes a quarter of what an arc lies off its chord.
ROUNDS = 5
# Faces lean from the level by no more than the angle of this cosine.
LEAST_COSINE = 0.4


def level_surface(part: Surface, *, height: float, edge_length: float, tolerance: float) -> Surface:
    """Return the surface at one distance from a part, on its outer side, cut along the normals of its rim.

    Args:
        part: manifold, consistently wound.
        height: distance from the part [mm].
        edge_length: of its triangles [mm]; shorter where they would lie off by more than
        tolerance: the largest deviation of the distance at the middles of edges and faces [mm], if halving reaches it.

    Returns:
        Its vertices have the distance up to rounding. Where the part is hollow it may fall into pieces.

    Raises:
        InputError: a length is no positive number.
        FieldError: nothing of the outer side is that far from the part.
        MeshError: sheets of it lie too close together for the edge length.
    """
    for name, value in (("height", height), ("edge_length", edge_length), ("tolerance", tolerance)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name} must be a positive number of mm, found {value}.")
    ground = Ground(part)
    for shift in SHIFTS:
        try:
            rough = remesh(
                _cut(ground, height=height, cell=CELL_SHARE * edge_length, shift=shift), edge_length=edge_length
            )
        except MeshError:
            continue
        return _fine(ground, rough, height=height, tolerance=tolerance)
    raise MeshError(
        f"{height:g} mm over {part.name} sheets of its level surface lie closer together than {edge_length:g} mm: "
        "choose shorter edges, or a lower layer."
    )


def _cut(ground: Ground, *, height: float, cell: float, shift: float) -> Surface:
    """Return the net about the level that stands on the part, without what lies beyond its rim."""
    vertices, faces = net(ground, height=height, cell=cell, shift=shift)
    beyond = ground.beyond(vertices, ground.feet(vertices).places)
    kept: BoolArray = beyond[faces].min(axis=1) <= 0.0
    if not kept.any():
        raise FieldError(
            f"nothing of the outer side of {ground.part.name} is {height:g} mm away from it: choose a smaller "
            "thickness."
        )
    whole = part_of(Surface(vertices, faces, ground.part.name), kept)
    if not ground.rimmed:
        return whole
    return _standing(ground, clipped(whole, beyond[used_vertices(faces[kept]), None]), cell=cell)


def _standing(ground: Ground, surface: Surface, *, cell: float) -> Surface:
    """Return the pieces that stand on the inside of the part: at the rim a cut may leave crumbs."""
    labels = component_labels(surface)
    feet = ground.feet(surface.vertices).places
    inside = ground.beyond(feet, feet) < -0.5 * cell
    return part_of(surface, np.isin(labels, labels[inside[surface.faces].any(axis=1)]))


def _fine(ground: Ground, surface: Surface, *, height: float, tolerance: float) -> Surface:
    """Return a surface whose vertices are on the level, with edges halved where what lies between is not."""
    surface = Surface(ground.raised(surface.vertices, height), surface.faces, surface.name)
    for _ in range(ROUNDS):
        ends = _bent(ground, surface, height=height, tolerance=tolerance)
        if not len(ends):
            break
        count = len(surface.vertices)
        surface = _lifted(ground, halved(surface, ends), first=count, height=height)
    return surface


def _bent(ground: Ground, surface: Surface, *, height: float, tolerance: float) -> IntArray:
    """Return the (k, 2) edges to halve: those off the level in the middle, and the longest of faces that are.

    With an edge of a face its longest one is halved, too, so that no face becomes thinner and thinner.
    """
    pairs, edge = numbered_pairs(half_edges(surface.faces))
    lengths = np.linalg.norm(np.diff(surface.vertices[pairs], axis=1)[:, 0], axis=1)
    sides = edge.reshape(-1, 3)
    longest = sides[np.arange(len(sides)), lengths[sides].argmax(axis=1)]
    chosen = _off(ground, surface.vertices[pairs].mean(axis=1), height) > tolerance
    middles = surface.vertices[surface.faces].mean(axis=1)
    chosen[longest[_off(ground, middles, height) > tolerance]] = True
    while True:
        waiting = chosen[sides].any(axis=1) & ~chosen[longest]
        if not waiting.any():
            return pairs[chosen]
        chosen[longest[waiting]] = True


def _lifted(ground: Ground, surface: Surface, *, first: int, height: float) -> Surface:
    """Return a surface whose vertices from one on are raised to the level, but for those that would fold it.

    In a crease the middle of an edge may rise to the wrong side of it; there it stays where it is.
    """
    vertices = surface.vertices.copy()
    vertices[first:] = ground.raised(vertices[first:], height)
    while True:
        raised = Surface(vertices, surface.faces, surface.name)
        middles = vertices[surface.faces].mean(axis=1)
        upright = middles - ground.feet(middles).places
        leaning = np.einsum("kx,kx->k", face_normals(raised), upright) < LEAST_COSINE * np.linalg.norm(upright, axis=1)
        back = np.unique(surface.faces[leaning])
        back = back[(back >= first) & (vertices[back] != surface.vertices[back]).any(axis=1)]
        if not back.size:
            return raised
        vertices[back] = surface.vertices[back]


def _off(ground: Ground, places: FloatArray, height: float) -> FloatArray:
    return np.abs(np.abs(ground.feet(places).distances) - height)
