"""Level surfaces of the distance from a part: what a layer of even thickness ends in.

A part pushed along its normals is too thin where it bulges between vertices and folds where it is hollow. Here every
vertex has the wanted distance to the closest place of the part, and edges are halved until what lies between does too.
"""

from __future__ import annotations

import numpy as np

from geoprint.errors import FieldError, InputError, MeshError
from geoprint.layers.feet import Ground
from geoprint.layers.folds import trimmed
from geoprint.layers.nets import net
from geoprint.layers.refining import fine_where, on_level
from geoprint.model import BoolArray, FloatArray, Surface
from geoprint.surfaces import clipped, component_labels, part_of
from geoprint.surfaces.remesh import remesh
from geoprint.surfaces.repair.manifold import split_vertices

# Grids that are tried, moved by these shares of a cell: where two sheets share a cell of one, they may not of another.
SHIFTS = (0.0, 0.37, 0.71, 0.53)
# Cells are a little smaller than the edges that are wanted.
CELL_SHARE = 0.8
# The rim of the net is true to this share of a cell: a layer that stands out so little over the one below is as high.
RIM_SHARE = 0.03
# A hole in it whose rim has so many cells is none of the part's, but where what lies beyond jumps from place to place.
HOLE = 4.0


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
    cell = CELL_SHARE * edge_length
    for shift in SHIFTS:
        try:
            cut = _cut(ground, height=height, cell=cell, shift=shift)
            rough = remesh(cut, edge_length=edge_length)
        except MeshError:
            continue
        return on_level(ground, rough, height=height, tolerance=tolerance, hole=HOLE * cell)
    raise MeshError(
        f"{height:g} mm over {part.name} sheets of its level surface lie closer together than {edge_length:g} mm: "
        "choose shorter edges, or a lower layer."
    )


def _cut(ground: Ground, *, height: float, cell: float, shift: float) -> Surface:
    """Return the net about the level that stands on the part, without what lies beyond its rim."""

    def beyond(places: FloatArray) -> FloatArray:
        return ground.beyond(places, ground.feet(places).places)

    vertices, faces = net(ground, height=height, cell=cell, shift=shift)
    kept: BoolArray = beyond(vertices)[faces].min(axis=1) <= 0.0
    if not kept.any():
        raise FieldError(
            f"nothing of the outer side of {ground.part.name} is {height:g} mm away from it: choose a smaller "
            "thickness."
        )
    whole = part_of(Surface(vertices, faces, ground.part.name), kept)
    if not ground.rimmed:
        return whole
    # In a crease the closest place of the part changes, and with it how far beyond its rim a place lies: by a jump.
    whole = fine_where(ground, whole, beyond, height=height, tolerance=RIM_SHARE * cell)
    standing = _standing(ground, split_vertices(clipped(whole, beyond(whole.vertices)[:, None])), cell=cell)
    return trimmed(ground, standing, hole=HOLE * cell)


def _standing(ground: Ground, surface: Surface, *, cell: float) -> Surface:
    """Return the pieces that stand on the inside of the part: at the rim a cut may leave crumbs."""
    labels = component_labels(surface)
    feet = ground.feet(surface.vertices).places
    inside = ground.beyond(feet, feet) < -0.5 * cell
    return part_of(surface, np.isin(labels, labels[inside[surface.faces].any(axis=1)]))
