"""Runs cut where they go over a sharp edge of the part, or over one that is rounded but little.

The nozzle would have to turn there all at once, which takes the arm up to a second while the valve is open. Instead one
run ends at the edge, and the next begins there. In a hollow the needle has no room to end a run in, and the tip turns
along smoothed normals before it gets there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from geoprint.geometry import (
    SHARP,
    arc_lengths,
    closest,
    creases,
    edges_alone,
    face_normals,
    half_edges,
    juts_out,
    normals,
    positions,
    twins,
    vertex_normals,
)
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, SurfacePoints
from geoprint.toolpath.corners import CROWDED, Outline, RunPiece, angles, peaks
from geoprint.toolpath.resample import resample

# An edge that is rounded counts where the surface turns by as much as at a crease within this length along a run [mm]:
# an edge of 60 degrees rounded by up to 2 mm.
ROUNDED = 1.5
# Tight bends are looked for at places so far apart [mm].
FINE = 0.1
# A step of a run goes over an edge where the way to it and on is no longer than the step by more than this share.
DETOUR_SHARE = 0.5


class _Crossing(NamedTuple):
    """Where a run goes over an edge: the arc length [mm], and the point as one of either side."""

    arc: float
    before: SurfacePoints
    behind: SurfacePoints


def cut_at_edges(
    surface: Surface, runs: list[SurfacePoints], *, closed: list[bool], least: float
) -> tuple[list[RunPiece], FloatArray]:
    """Cut runs where they go over edges that jut out: over creases, and in the middle of tight bends.

    Every piece is worth a run of its own: where a run goes over edges that follow each other sooner, as where it
    trembles along one, it stays whole. A closed run that is cut starts and ends at its first cut.

    Args:
        surface: what the runs lie on.
        runs: points of each; a closed one repeats its first point.
        closed: whether each is.
        least: shortest run that is worth it, and shortest crease that is one [mm].

    Returns:
        The runs that they became, in the same order, whose ends lie in the triangle on their own side of the edge; and
        the (g, 3) places of the cuts [mm].
    """
    pieces: list[RunPiece] = []
    places = [np.zeros((0, 3))]
    arcs = [arc_lengths(positions(surface, points)) for points in runs]
    at_vertices, of_faces = vertex_normals(surface), face_normals(surface)
    crossings = _crossings(surface, runs, arcs, least=least)
    for run, (points, ring) in enumerate(zip(runs, closed, strict=True)):
        even, length = resample(surface, points, step=FINE, chord_error=np.inf), float(arcs[run][-1])
        line = Outline(
            np.arange(even.faces.size), positions(surface, even), ring, np.linspace(0.0, length, even.faces.size)
        )
        outward = normals(surface, even, given=at_vertices), of_faces[even.faces]
        bends = [
            _Crossing(float(line.arcs[row]), even[[row]], even[[row]])
            for row in _bends(line, outward, beside=_beside(line.arcs, crossings[run], reach=ROUNDED))
        ]
        over = sorted([*crossings[run], *bends], key=lambda crossing: crossing.arc)
        cuts = _far_apart(over, length=length, closed=ring, least=least)
        pieces += [RunPiece(run, piece, ring and not cuts) for piece in _cut(points, arcs[run], cuts, closed=ring)]
        places += [positions(surface, cut.before) for cut in cuts]
    return pieces, np.concatenate(places)


def _crossings(
    surface: Surface, runs: list[SurfacePoints], arcs: list[FloatArray], *, least: float
) -> list[list[_Crossing]]:
    """Return where each run, with (k,) arc lengths of its points [mm], goes over a crease that juts out, in order."""
    found: list[list[_Crossing]] = [[] for _ in runs]
    other, own = twins(surface.faces), face_normals(surface)
    steps = [(run, after) for run, points in enumerate(runs) for after in _turning(own[points.faces])]
    if not steps:
        return found
    edges = creases(surface, shortest=least)[0] & juts_out(surface) & (np.arange(other.size) < other)
    if not edges.any():
        return found
    begun, ended = (
        positions(surface, SurfacePoints.chained([runs[run][[after + k]] for run, after in steps])) for k in (0, 1)
    )
    halves = np.flatnonzero(edges)[closest(edges_alone(surface, edges), (begun + ended) / 2.0)[0].faces]
    shares, crossed = _met(begun, ended, surface.vertices[half_edges(surface.faces)[halves]])
    there, on = np.linalg.norm(crossed - begun, axis=1), np.linalg.norm(ended - crossed, axis=1)
    sides = _on_edges(halves, shares), _on_edges(other[halves], 1.0 - shares)
    for row in np.flatnonzero(there + on <= (1.0 + DETOUR_SHARE) * np.linalg.norm(ended - begun, axis=1)).tolist():
        run, after = steps[row]
        here = own[runs[run].faces[after]]
        behind, before = sorted((side[[row]] for side in sides), key=lambda side: float(own[side.faces[0]] @ here))
        found[run].append(_Crossing(float(arcs[run][after] + there[row]), before, behind))
    return found


def _bends(line: Outline, outward: tuple[FloatArray, FloatArray], *, beside: BoolArray) -> list[int]:
    """Return the even places of a run that are the middles of tight bends.

    Args:
        line: k even places of the run.
        outward: (k, 3) normals there, of the vertices around and of the face.
        beside: (k,) whether a place is so near to a crease that its bend is that of the crease.
    """
    arcs = line.arcs
    ends = arcs - ROUNDED / 2.0, arcs + ROUNDED / 2.0
    ahead, turns = line.at(ends[1]) - line.at(ends[0]), np.where(beside, 0.0, np.pi)
    # Beside a crease the normals of vertices turn towards it, and on a rough surface those of faces turn anywhere.
    for normals_there in outward:
        before, behind = (line._replace(places=normals_there).at(each) for each in ends)
        juts = np.einsum("kx,kx->k", behind - before, ahead) > 0.0
        turns = np.minimum(turns, np.where(juts, angles(before, behind), 0.0))
    # The seam of a closed run may lie in a bend: its places are counted from the one that turns least.
    order = np.roll(np.arange(arcs.size - 1), -int(turns[:-1].argmin())) if line.closed else np.arange(arcs.size)
    found = order[peaks(turns[order], arcs[: order.size], above=SHARP, apart=ROUNDED)]
    return [_middle(line._replace(places=outward[0]), float(arcs[row])) for row in found]


def _middle(outward: Outline, arc: float) -> int:
    """Return the place about which the normals of an outline turn, near an arc length [mm]."""
    near = arc + np.arange(-ROUNDED / 2.0, ROUNDED / 2.0 + FINE, FINE)
    turned = np.linalg.norm(np.diff(outward.at(near), axis=0), axis=1)
    middle = float(turned @ (near[1:] + near[:-1])) / (2.0 * float(turned.sum()))
    return int(np.abs(outward.arcs - (middle % outward.arcs[-1] if outward.closed else middle)).argmin())


def _turning(normals: FloatArray) -> list[int]:
    """Return after which of (k, 3) normals the next one differs by more than a crease does."""
    return np.flatnonzero(np.einsum("kx,kx->k", normals[1:], normals[:-1]) < np.cos(SHARP)).tolist()


def _on_edges(halves: IntArray, shares: FloatArray) -> SurfacePoints:
    """Return the points at (k,) shares of (k,) half-edges."""
    rows, weights = np.arange(halves.size), np.zeros((halves.size, 3))
    weights[rows, halves % 3], weights[rows, (halves + 1) % 3] = 1.0 - shares, shares
    return SurfacePoints(halves // 3, weights)


def _met(begun: FloatArray, ended: FloatArray, edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return at which (k,) shares of (k, 2, 3) edges the lines of steps come nearest to them, and where [mm]."""
    step, edge, between = ended - begun, edges[:, 1] - edges[:, 0], begun - edges[:, 0]
    steps, squares, along = (np.einsum("kx,kx->k", *each) for each in ((step, step), (edge, edge), (step, edge)))
    ahead = steps * np.einsum("kx,kx->k", edge, between) - along * np.einsum("kx,kx->k", step, between)
    shares = np.clip(ahead / np.maximum(steps * squares - along**2, np.finfo(np.float64).tiny), 0.0, 1.0)
    return shares, edges[:, 0] + shares[:, None] * edge


def _beside(arcs: FloatArray, crossings: list[_Crossing], *, reach: float) -> BoolArray:
    """Return which of (k,) rising arc lengths lie within a reach of crossings, around the end as well [mm]."""
    beside = np.zeros(arcs.size, dtype=np.bool_)
    for crossing in crossings:
        for around in (crossing.arc - arcs[-1], crossing.arc, crossing.arc + arcs[-1]):
            beside[slice(*np.searchsorted(arcs, (around - reach, around + reach)))] = True
    return beside


def _far_apart(crossings: list[_Crossing], *, length: float, closed: bool, least: float) -> list[_Crossing]:
    """Return the crossings of a run of a length [mm] that have no other, and no end, nearer than the least length."""
    if not crossings:
        return []
    arcs = np.array([crossing.arc for crossing in crossings])
    first, last = (arcs[-1] - length, arcs[0] + length) if closed else (0.0, length)
    gaps = np.diff(np.concatenate([[first], arcs, [last]]))
    far = np.minimum(gaps[1:], gaps[:-1]) >= least
    return [crossing for crossing, kept in zip(crossings, far.tolist(), strict=True) if kept]


def _cut(points: SurfacePoints, arcs: FloatArray, cuts: list[_Crossing], *, closed: bool) -> list[SurfacePoints]:
    """Return the pieces of a run between cuts, of a closed one from the first around to the first again."""
    if not cuts:
        return [points]
    at = np.array([cut.arc for cut in cuts])
    kept = np.flatnonzero(~_beside(arcs, cuts, reach=CROWDED))
    # The point at the seam is there twice.
    kept = kept[kept < arcs.size - 1] if closed else kept
    pieces = [
        SurfacePoints.chained([*begin, points[rows], *end])
        for begin, rows, end in zip(
            [[], *([cut.behind] for cut in cuts)],
            np.split(kept, np.searchsorted(arcs[kept], at)),
            [*([cut.before] for cut in cuts), []],
            strict=True,
        )
    ]
    return [*pieces[1:-1], SurfacePoints.chained([pieces[-1], pieces[0]])] if closed else pieces
