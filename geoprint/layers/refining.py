"""A surface made finer until it follows a level of the distance, or until its edges tell where a function is zero."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geoprint.layers.creases import on_crease
from geoprint.layers.feet import Ground
from geoprint.layers.folds import LEAST_COSINE, cosines, laid_flat, trimmed, unfolded
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.surfaces.remesh import halved
from geoprint.surfaces.topology import half_edges, numbered_pairs

# Rounds of halving: each takes a quarter of what an arc lies off its chord.
ROUNDS = 5
# Edges shorter than this many tolerances are not halved: between ends on the level they lie off by half their length.
SHORTEST = 4.0


def on_level(ground: Ground, surface: Surface, *, height: float, tolerance: float, hole: float) -> Surface:
    """Return a surface whose vertices are on the level, with edges halved where what lies between is not.

    Args:
        ground: the part.
        surface: near the level.
        height: of the level [mm].
        tolerance: how far from it middles of edges and faces may lie, if halving reaches it [mm].
        hole: as in `trimmed`.
    """
    surface = trimmed(ground, surface, hole=hole)
    surface = Surface(ground.raised(surface.vertices, height), surface.faces, surface.name)
    surface = unfolded(ground, trimmed(ground, surface, hole=hole))
    for _ in range(ROUNDS):
        ends = _bent(ground, surface, height=height, tolerance=tolerance)
        if not len(ends):
            break
        surface = _halved(ground, surface, ends, height=height, tolerance=tolerance)
        surface = trimmed(ground, surface, hole=hole)
    return laid_flat(ground, surface)


def fine_where(
    ground: Ground, surface: Surface, values: Callable[[FloatArray], FloatArray], *, height: float, tolerance: float
) -> Surface:
    """Return a level with edges halved where a function of the place is near zero and not linear along them.

    Args:
        ground: the part.
        surface: on the level.
        values: (k,) of (k, 3) places [mm]; where it changes by more than one moves, only edges that it is zero on
            are sure to be looked at.
        height: of the level [mm].
        tolerance: largest deviation of the function from linear at the middles of edges, if halving reaches it [mm].
    """
    for _ in range(ROUNDS):
        found = values(surface.vertices)
        pairs, edge = numbered_pairs(half_edges(surface.faces))
        ends, lengths = found[pairs], _lengths(surface, pairs)
        doubtful = np.flatnonzero((np.abs(ends).min(axis=1) < lengths) | (np.sign(ends).prod(axis=1) < 0.0))
        middles = surface.vertices[pairs[doubtful]].mean(axis=1)
        chosen = np.zeros(len(pairs), dtype=np.bool_)
        chosen[doubtful] = np.abs(values(middles) - ends[doubtful].mean(axis=1)) > tolerance
        if not chosen.any():
            break
        ends = pairs[_with_longest(chosen, edge.reshape(-1, 3), lengths)]
        surface = _halved(ground, surface, ends, height=height, tolerance=tolerance)
    return surface


def _bent(ground: Ground, surface: Surface, *, height: float, tolerance: float) -> IntArray:
    """Return the (k, 2) edges to halve: those off the level in the middle, and the longest of faces that are."""
    pairs, edge = numbered_pairs(half_edges(surface.faces))
    lengths, sides = _lengths(surface, pairs), edge.reshape(-1, 3)
    chosen = (_off(ground, surface.vertices[pairs].mean(axis=1), height) > tolerance) & (lengths > SHORTEST * tolerance)
    off = _off(ground, surface.vertices[surface.faces].mean(axis=1), height) > tolerance
    longest = _longest(sides, lengths)[off]
    chosen[longest[lengths[longest] > SHORTEST * tolerance]] = True
    return pairs[_with_longest(chosen, sides, lengths)]


def _with_longest(chosen: BoolArray, sides: IntArray, lengths: FloatArray) -> BoolArray:
    """Return (e,) the chosen edges with the longest one of each face that has one: so none becomes ever thinner.

    Args:
        chosen: (e,) edges.
        sides: (m, 3) edges of each face.
        lengths: (e,) [mm].
    """
    chosen, longest = chosen.copy(), _longest(sides, lengths)
    while True:
        waiting = chosen[sides].any(axis=1) & ~chosen[longest]
        if not waiting.any():
            return chosen
        chosen[longest[waiting]] = True


def _longest(sides: IntArray, lengths: FloatArray) -> IntArray:
    return sides[np.arange(len(sides)), lengths[sides].argmax(axis=1)]


def _lengths(surface: Surface, pairs: IntArray) -> FloatArray:
    found: FloatArray = np.linalg.norm(np.diff(surface.vertices[pairs], axis=1)[:, 0], axis=1)
    return found


def _halved(ground: Ground, surface: Surface, ends: IntArray, *, height: float, tolerance: float) -> Surface:
    """Return a surface with edges halved by vertices on the level, and others that were off it moved there.

    Where an edge passes a crease, that is where it is cut: the middle raised to either sheet would leave an edge that
    passes it, however short. Edges of faces that would fold are turned; what would fold even so stays where it is.
    """
    first = len(surface.vertices)
    finer = halved(surface, ends)
    vertices, faces = finer.vertices.copy(), finer.faces
    off = np.flatnonzero(_off(ground, surface.vertices, height) > tolerance)
    vertices[off] = ground.raised(vertices[off], height)
    creased = on_crease(ground, surface.vertices[ends], height=height, tolerance=tolerance)
    vertices[first:] = np.where(creased.found[:, None], creased.places, ground.raised(vertices[first:], height))
    while True:
        raised = unfolded(ground, Surface(vertices, faces, surface.name))
        faces = raised.faces
        back = np.unique(faces[cosines(ground, vertices, faces) <= LEAST_COSINE])
        back = back[(vertices[back] != finer.vertices[back]).any(axis=1)]
        if not back.size:
            return raised
        vertices[back] = finer.vertices[back]


def _off(ground: Ground, places: FloatArray, height: float) -> FloatArray:
    return np.abs(np.abs(ground.feet(places).distances) - height)
