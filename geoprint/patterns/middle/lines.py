"""The strokes that fitted strands become: curves as they were traced, curves moved or cut, and beads along ridges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import BoolArray, Contours, FloatArray, Strokes, Surface, SurfaceCurves
from geoprint.patterns.middle.ridges import stretches
from geoprint.patterns.middle.strands import STEP_SHARE, Strands, interpolated
from geoprint.surfaces import all_curves, arc_lengths, closest, some_curves

# Strands that move by less than this stay as they were traced [spacings].
NEGLIGIBLE = 1e-3
# What is left of a curve at the end of a ridge is its tip where it is shorter than this and its ends are so near.
TIP_LENGTH, TIP_WIDTH = 2.0, 0.75
# What is left between merged stretches goes with them where it is shorter than so many samples.
LEAST_LEFT = 4
# The bead along a ridge goes on to a tip within this reach, and closes where its ends are so near [spacings]; what it
# goes on to lies ahead of its end, within this cosine of its direction.
TIP_REACH, CLOSING, AHEAD = 1.2, 1.0, 0.5
# Elsewhere it goes straight on for so many samples while everything else is farther than this [spacings].
STRAIGHT_SAMPLES, ROOM = 4, 0.95


class MovedStrands(NamedTuple):
    """Strands with k samples where they lie now.

    Attributes:
        strands: where they lay.
        places: (k, 3) samples now [mm].
        merged: (k,) whether a bead along the ridge takes the place of this strand and of the one that faces it.
    """

    strands: Strands
    places: FloatArray
    merged: BoolArray


class LaidLine(NamedTuple):
    """A line of material.

    Attributes:
        line: (n, 3) places [mm]; the last is the first where it is closed.
        level: of it.
    """

    line: FloatArray
    level: int


def strokes_of(surface: Surface, contours: Contours, moved: MovedStrands, beads: list[LaidLine]) -> Strokes:
    """Return what is left of the strands where they lie now, and the beads along ridges, level by level.

    Args:
        surface: what they lie on.
        contours: the curves that the strands were sampled from.
        moved: the strands.
        beads: along ridges; they go on to the tips of what was merged there.
    """
    stays = _staying(moved)
    left, tips = list[LaidLine](), list[LaidLine]()
    for strand in np.flatnonzero(~stays).tolist():
        bent = contours.curves.xyz(surface, strand)
        for bead in _left(moved, strand, bent, level=int(contours.levels[strand])):
            if moved.merged[moved.strands.rows(strand)].any() and _is_tip(bead.line, spacing=contours.spacing):
                tips.append(bead)
            else:
                left.append(bead)
    beside = KDTree(moved.places[~moved.merged])
    drawn, reached = left, set[int]()
    for bead in beads:
        ended, used = _to_the_end(bead, tips, beside, spacing=contours.spacing)
        drawn, reached = [*drawn, ended], reached | used
    # No bead goes on to these, so that they stay.
    drawn += [tip for number, tip in enumerate(tips) if number not in reached]
    levels = np.concatenate([contours.levels[stays], np.array([bead.level for bead in drawn], dtype=np.int64)])
    curves = some_curves(contours.curves, np.flatnonzero(stays))
    if drawn:
        curves = all_curves([curves, landed(surface, [bead.line for bead in drawn])])
    order = np.argsort(levels, kind="stable")
    row = np.repeat(levels[order], np.diff(curves.offsets)[order]).astype(np.float64)
    return Strokes(some_curves(curves, order), row, np.full(row.size, contours.spacing), np.ones(row.size))


def _staying(moved: MovedStrands) -> BoolArray:
    """Return the (c,) strands that stay as they were traced."""
    strands = moved.strands
    far = np.linalg.norm(moved.places - strands.places, axis=1) > NEGLIGIBLE * strands.spacing
    return np.bincount(strands.strand, far | moved.merged, minlength=strands.count) == 0


def _left(moved: MovedStrands, strand: int, curve: FloatArray, *, level: int) -> list[LaidLine]:
    """Return what a strand has become: its traced curve (n, 3) moved [mm], or what is not merged of its samples."""
    strands, held = moved.strands, moved.strands.rows(strand)
    closed, merged, places = bool(strands.closed[strand]), moved.merged[held], moved.places[held]
    if merged.any():
        return [LaidLine(places[each], level) for each in stretches(~merged, closed=closed) if each.size >= LEAST_LEFT]
    arcs, moves, own = strands.arcs[held], places - strands.places[held], arc_lengths(curve)
    if closed:
        arcs, moves = np.append(arcs, own[-1]), np.vstack([moves, moves[:1]])
    bent = curve + interpolated(own, arcs, moves)
    return [LaidLine(np.vstack([bent[:-1], bent[:1]]) if closed else bent, level)]


def _is_tip(line: FloatArray, *, spacing: float) -> bool:
    """Return whether an open line (n, 3) turns round the end of a ridge."""
    across = float(np.linalg.norm(line[0] - line[-1]))
    return 0.0 < across < TIP_WIDTH * spacing and float(arc_lengths(line)[-1]) < TIP_LENGTH * spacing


def _to_the_end(bead: LaidLine, tips: list[LaidLine], beside: KDTree, *, spacing: float) -> tuple[LaidLine, set[int]]:
    """Return a bead that goes on to tips ahead of its ends, or straight on; closed where its ends face each other.

    Args:
        bead: along a ridge.
        tips: of what was merged; in the middle of each it turns round.
        beside: places of all other strands [mm].
        spacing: of the levels [mm].

    Returns:
        The bead, and which tips it reaches.
    """
    line, reached = bead.line, set[int]()
    for _ in range(2):
        found = _tip_ahead(line, tips, spacing=spacing)
        if found is not None:
            line = np.vstack([line, _turn_of(tips[found])])
            reached.add(found)
        line = line[::-1]
    is_long = float(arc_lengths(line)[-1]) > 4.0 * CLOSING * spacing
    near = np.linalg.norm(line[0] - line[-1]) < CLOSING * spacing
    if is_long and near and _is_ahead(line, line[0]) and _is_ahead(line[::-1], line[-1]):
        return LaidLine(np.vstack([line, line[:1]]), bead.level), reached
    for _ in range(2):
        line = _straight_on(line, beside, spacing=spacing)[::-1]
    return LaidLine(line, bead.level), reached


def _tip_ahead(line: FloatArray, tips: list[LaidLine], *, spacing: float) -> int | None:
    """Return which tip is nearest to the end of a line among those that lie ahead of it; None where none does."""
    away = np.array([float(np.linalg.norm(_turn_of(tip) - line[-1])) for tip in tips])
    ahead = [k for k in range(len(tips)) if away[k] < TIP_REACH * spacing and _is_ahead(line, _turn_of(tips[k]))]
    return min(ahead, key=lambda k: away[k], default=None)


def _turn_of(tip: LaidLine) -> FloatArray:
    return tip.line[len(tip.line) // 2]


def _is_ahead(line: FloatArray, place: FloatArray) -> bool:
    """Return whether a place lies ahead of the end of a line, so that the line goes on to it without turning back."""
    towards = place - line[-1]
    return float(towards @ _direction(line)) >= AHEAD * float(np.linalg.norm(towards))


def _direction(line: FloatArray) -> FloatArray:
    """Return the (3,) unit vector in which a line ends."""
    ahead = line[-1] - line[max(len(line) - 1 - STRAIGHT_SAMPLES, 0)]
    return ahead / max(float(np.linalg.norm(ahead)), 1e-12)


def _straight_on(line: FloatArray, beside: KDTree, *, spacing: float) -> FloatArray:
    """Return a line that goes on from its last place as far as nothing lies beside it, one spacing at most."""
    ahead = _direction(line)
    steps = np.arange(1, STRAIGHT_SAMPLES + 1) * STEP_SHARE * spacing
    away = np.asarray(beside.query(line[-1] + steps[:, None] * ahead)[0])
    near = np.flatnonzero(away <= ROOM * spacing)
    count = int(near[0]) if near.size else STRAIGHT_SAMPLES
    return line if count == 0 else np.vstack([line, line[-1] + steps[count - 1] * ahead])


def landed(surface: Surface, lines: list[FloatArray]) -> SurfaceCurves:
    """Return lines (n, 3) near a surface as curves on it [mm]; one whose last place is its first is closed."""
    landed, _ = closest(surface, np.concatenate(lines))
    offsets = np.concatenate([[0], np.cumsum([len(line) for line in lines])])
    closed = np.array([np.array_equal(line[0], line[-1]) for line in lines])
    return SurfaceCurves(landed, offsets, closed)
