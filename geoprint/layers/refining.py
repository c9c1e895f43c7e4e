"""A surface made finer until it follows a level of the distance, or until its edges tell where a function is zero."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from geoprint.geometry import boundary_loops, component_labels, face_areas, halved, part_of
from geoprint.geometry.halfedges import next_halves
from geoprint.geometry.manifold import split_vertices
from geoprint.geometry.operators import doubled_area_vectors
from geoprint.geometry.repair import fill_holes
from geoprint.geometry.topology import edge_keys, half_edges, numbered_pairs, twins
from geoprint.layers.feet import Ground
from geoprint.model import BoolArray, FloatArray, IntArray, Surface

# Where a level of the distance has a crease: places as far from two sides of the part.
#
# A place moved along the distance lands on one of the sheets beside a crease, never on it. Here the planes that
# touch both sheets are cut with each other, again from closer by until neither turns any more [Kobbelt2001].


# Sheets whose normals turn by less than this between the ends of an edge meet in no crease.
LEAST_BEND = np.deg2rad(8.0)
# So often planes are cut, each time at places on both sides that are nearer by this share of the edge.
CUTS, NEARER = 4, 0.02
# On both sides of a crease lies at least this share of an edge that passes it; it is no farther from its middle.
LEAST_SHARE, FARTHEST = 0.15, 0.5


def on_crease(ground: Ground, ends: FloatArray, *, height: float, tolerance: float) -> tuple[FloatArray, BoolArray]:
    """Return where edges between two sheets of a level pass the crease in which these meet.

    Args:
        ground: the part.
        ends: (k, 2, 3) of each edge, near the level [mm].
        height: of the level over the part [mm].
        tolerance: how far from the level such a place may lie [mm].

    Returns:
        (k, 3) places [mm], and (k,) whether there is a crease.
    """
    middles: FloatArray = ends.mean(axis=1)
    places, near = middles, ends
    cosine = np.ones(len(ends))
    shares = np.zeros((len(ends), 2))
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    for cut in range(CUTS):
        feet = ground.feet(near.reshape(-1, 3))[0].reshape(near.shape)
        away = near - feet
        upright = away / np.maximum(np.linalg.norm(away, axis=2, keepdims=True), np.finfo(np.float64).tiny)
        missing = np.einsum("ksx,ksx->ks", upright, feet + height * upright - middles[:, None])
        cosine = np.einsum("kx,kx->k", upright[:, 0], upright[:, 1])
        square = np.maximum(1.0 - cosine**2, np.sin(LEAST_BEND) ** 2)[:, None]
        if cut == 0:
            shares = 2.0 * np.abs(missing) / np.maximum(lengths[:, None] * np.sqrt(square), np.finfo(np.float64).tiny)
        # The place nearest to the middle that lies in both planes moves along their normals alone.
        moves = (missing - cosine[:, None] * missing[:, ::-1]) / square
        places = middles + np.einsum("ks,ksx->kx", moves, upright)
        near = places[:, None] + NEARER * (ends - middles[:, None])
    off = _off(ground, places, height)
    moved = np.linalg.norm(places - middles, axis=1)
    passing = (cosine < np.cos(LEAST_BEND)) & (shares.min(axis=1) >= LEAST_SHARE) & (moved <= FARTHEST * lengths)
    return places, passing & (off <= tolerance)


# Faces that lean from the level that they shall lie on: edges turned until they follow it, and crumbs at the rim.


# Faces lean from the level by no more than the angle of this cosine.
LEAST_COSINE = 0.4
# Faces of less area [mm2] have no side: what their normal says is rounding.
LEAST_AREA = 1e-10
# Rounds of turning edges; most folds are gone after one.
FOLD_ROUNDS = 20
# The cosine must become larger by this much.
LEAST_GAIN = 1e-6


def cosines(ground: Ground, vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return (m,) the cosine between the normal of each face and what stands upright on the part, or 0."""
    middles: FloatArray = vertices[faces].mean(axis=1)
    across = doubled_area_vectors(vertices, faces)
    upright = middles - ground.feet(middles)[0]
    doubled = np.linalg.norm(across, axis=1)
    lengths = doubled * np.linalg.norm(upright, axis=1)
    sided = (doubled > 2.0 * LEAST_AREA) & (lengths > 0.0)
    found: FloatArray = np.einsum("kx,kx->k", across, upright)
    return np.divide(found, lengths, out=np.zeros_like(found), where=sided)


def unfolded(ground: Ground, surface: Surface) -> Surface:
    """Return a surface with edges turned where that makes the faces beside them lean less from the level.

    Only what leans is looked at: as in a crease, where an edge from sheet to sheet becomes one along it.
    """
    faces = surface.faces.copy()
    lean = cosines(ground, surface.vertices, faces)
    for _ in range(FOLD_ROUNDS):
        turned = _turned(ground, surface.vertices, faces, lean)
        if not turned:
            break
        lean[turned] = cosines(ground, surface.vertices, faces[turned])
    return Surface(surface.vertices, faces, surface.name)


def _turned(ground: Ground, vertices: FloatArray, faces: IntArray, lean: FloatArray) -> list[int]:
    """Turn edges of faces that lean, each face once, in place; return which faces were turned."""
    found = np.flatnonzero(lean <= LEAST_COSINE)
    if not found.size:
        return []
    other = twins(faces)
    halves: IntArray = (3 * found[:, None] + np.arange(3)).ravel()
    halves = halves[other[halves] >= 0]
    across = other[halves]
    start, stop = faces.ravel()[halves], faces.ravel()[next_halves(halves)]
    left, right = (faces.ravel()[next_halves(next_halves(sides))] for sides in (halves, across))
    pairs = [np.column_stack(corners) for corners in ((start, right, left), (right, stop, left))]
    after = np.minimum(*(cosines(ground, vertices, each) for each in pairs))
    gain = after - np.minimum(lean[halves // 3], lean[across // 3])
    keys = edge_keys(np.column_stack([left, right]), vertices=len(vertices))
    linked = np.isin(keys, edge_keys(half_edges(faces), vertices=len(vertices)))
    turned: list[int] = []
    made: set[int] = set()
    for index in np.argsort(-gain, kind="stable"):
        if gain[index] <= LEAST_GAIN:
            break
        beside, key = (int(halves[index]) // 3, int(across[index]) // 3), int(keys[index])
        if not (linked[index] or left[index] == right[index] or key in made or set(beside) & set(turned)):
            faces[beside[0]], faces[beside[1]] = pairs[0][index], pairs[1][index]
            turned.extend(beside)
            made.add(key)
    return turned


def flattened_band(ground: Ground, surface: Surface) -> Surface:
    """Return a surface in which no face has turned over: what turning edges leaves is drawn to the middle of its ring.

    That is the last resort, off the level by as much as faces there are long; it meets a few vertices in a crease.
    """
    for _ in range(FOLD_ROUNDS):
        over = cosines(ground, surface.vertices, surface.faces) <= 0.0
        if not over.any():
            break
        moved = np.unique(surface.faces[over])
        sides = half_edges(surface.faces)
        links = np.unique(np.concatenate([sides, sides[:, ::-1]]), axis=0)
        links = links[np.isin(links[:, 0], moved)]
        middles = np.zeros_like(surface.vertices)
        np.add.at(middles, links[:, 0], surface.vertices[links[:, 1]])
        vertices = surface.vertices.copy()
        counts = np.bincount(links[:, 0], minlength=len(vertices))[moved]
        vertices[moved] = middles[moved] / counts[:, None]
        surface = unfolded(ground, Surface(vertices, surface.faces, surface.name))
    return surface


def trimmed(ground: Ground, surface: Surface, *, hole: float) -> Surface:
    """Return a surface without the faces along its rim that lean from the level.

    Args:
        ground: the part.
        surface: near a level.
        hole: a rim up to this length [mm] is none of the part's: pieces so small are left out, holes closed.
    """
    while True:
        lean = cosines(ground, surface.vertices, surface.faces) <= LEAST_COSINE
        crumbs = lean & (twins(surface.faces).reshape(-1, 3) < 0).any(axis=1)
        if not crumbs.any():
            break
        surface = split_vertices(part_of(surface, ~crumbs))
    labels = component_labels(surface)
    large = np.bincount(labels, face_areas(surface)) > hole**2 / (4.0 * np.pi)
    if large.any():
        surface = part_of(surface, large[labels])
    return fill_holes(surface, boundary_loops(surface), longest=hole)[0]


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
    return flattened_band(ground, surface)


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
    places, creased = on_crease(ground, surface.vertices[ends], height=height, tolerance=tolerance)
    vertices[first:] = np.where(creased[:, None], places, ground.raised(vertices[first:], height))
    while True:
        raised = unfolded(ground, Surface(vertices, faces, surface.name))
        faces = raised.faces
        back = np.unique(faces[cosines(ground, vertices, faces) <= LEAST_COSINE])
        back = back[(vertices[back] != finer.vertices[back]).any(axis=1)]
        if not back.size:
            return raised
        vertices[back] = finer.vertices[back]


def _off(ground: Ground, places: FloatArray, height: float) -> FloatArray:
    return np.abs(np.abs(ground.feet(places)[1]) - height)
