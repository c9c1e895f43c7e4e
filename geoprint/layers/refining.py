"""A surface made finer until it follows a level of the distance, or until its edges tell where a function is zero."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geoprint.layers.feet import Ground
from geoprint.model import BoolArray, FloatArray, IntArray, Surface
from geoprint.surfaces import face_normals
from geoprint.surfaces.remesh import halved
from geoprint.surfaces.topology import half_edges, numbered_pairs

# Rounds of halving: each takes a quarter of what an arc lies off its chord.
ROUNDS = 5
# Faces lean from the level by no more than the angle of this cosine.
LEAST_COSINE = 0.4


def on_level(ground: Ground, surface: Surface, *, height: float, tolerance: float) -> Surface:
    """Return a surface whose vertices are on the level, with edges halved where what lies between is not."""
    surface = Surface(ground.raised(surface.vertices, height), surface.faces, surface.name)
    for _ in range(ROUNDS):
        ends = _bent(ground, surface, height=height, tolerance=tolerance)
        if not len(ends):
            break
        count = len(surface.vertices)
        surface = _lifted(ground, halved(surface, ends), first=count, height=height)
    return surface


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
        count = len(surface.vertices)
        surface = halved(surface, pairs[_with_longest(chosen, edge.reshape(-1, 3), lengths)])
        surface = _lifted(ground, surface, first=count, height=height)
    return surface


def _bent(ground: Ground, surface: Surface, *, height: float, tolerance: float) -> IntArray:
    """Return the (k, 2) edges to halve: those off the level in the middle, and the longest of faces that are."""
    pairs, edge = numbered_pairs(half_edges(surface.faces))
    lengths, sides = _lengths(surface, pairs), edge.reshape(-1, 3)
    chosen = _off(ground, surface.vertices[pairs].mean(axis=1), height) > tolerance
    off = _off(ground, surface.vertices[surface.faces].mean(axis=1), height) > tolerance
    chosen[_longest(sides, lengths)[off]] = True
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
