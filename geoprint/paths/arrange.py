"""Strokes put into printing order: from the seed inwards, seams next to each other, resampled along the arc."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import FieldError
from geoprint.model import FloatArray, IntArray, Strokes, Surface, SurfaceCurves, SurfacePoints, Toolpath, frozen
from geoprint.paths.backtracks import without_backtracks
from geoprint.paths.corners import RoundedRun, round_corners
from geoprint.paths.fairing import faired
from geoprint.paths.resample import resample
from geoprint.paths.seams import Seams, starts_apart
from geoprint.surfaces import arc_lengths, component_labels, normals, positions

# Defaults of the sampling as shares of the spacing: errors far below the bead's width, steps that a spline follows.
STEP_SHARE = 0.5
CHORD_ERROR_SHARE = 1.0 / 500.0
# What the tip may leave out where it would turn sharply, as a share of the spacing: what is within 5 % counts as even.
BACKTRACK_ERROR_SHARE = 1.0 / 20.0


@frozen
class _Run:
    """One stroke that becomes a run: its points, where they are, on which row and how far from the next, and so on."""

    points: SurfacePoints
    places: FloatArray
    rows: FloatArray
    spacings: FloatArray
    closed: bool
    level: int
    piece: int


def arrange(
    strokes: Strokes, surface: Surface, *, speed: float, standoff: float = 0.0, seams: Seams | None = None
) -> Toolpath:
    """Order, orient and resample strokes.

    Runs go from the seed inwards, level by level, which is the whole part of the row at which a stroke starts; inside a
    level the next run is the one nearest to where the tool is. A closed run starts at its point nearest to the end of
    the run before, so that seams lie side by side and travel is short; it keeps its direction. An open run starts at
    its nearer end. Closed runs shorter than one spacing would be a blob rather than a bead: they are dropped and
    counted, as are those that the pattern left out.

    A surface in several pieces is printed piece by piece, each in the order that it has alone: first the first one,
    then always the one that starts nearest to the tool.

    Args:
        strokes: c curves.
        surface: what they were drawn on.
        speed: set speed of the tip [mm/s]; `round_corners` says what depends on it.
        standoff: height of the tip over the surface [mm]: where its line turns sharply there, samples are left out.
        seams: of a layer of a stack: where its closed runs may start; of those places the nearest counts.

    Returns:
        The toolpath, `faired`; steps at most half a spacing and chord error at most a 500th of it, but where the tip
        would turn sharply a 20th; corners rounded or split. Where the spacing differs, the smallest counts.

    Raises:
        FieldError: nothing is left to print of a piece, or a run is too hollow for a tip at the stand-off.
    """
    spacing = float(strokes.spacing.min())
    runs, dropped = _worth_printing(_runs_of(strokes, surface), spacing=spacing)
    ordered = _piece_by_piece(runs, seams=seams, spacing=spacing)
    closed = [run.closed for run in ordered]
    smooth = faired(surface, [run.points for run in ordered], closed=closed, spacing=spacing)
    step, error = STEP_SHARE * spacing, CHORD_ERROR_SHARE * spacing
    sampled = [resample(surface, points, step=step, chord_error=error) for points in smooth]
    rounded = round_corners(surface, sampled, closed=closed, spacing=spacing, speed=speed)
    curves = _curves(surface, rounded.pieces, standoff=standoff, error=BACKTRACK_ERROR_SHARE * spacing)
    rows, spacings = _carried(surface, curves, [ordered[run.run] for run in rounded.pieces])
    return Toolpath(
        curves=curves,
        levels=np.array([ordered[run.run].level for run in rounded.pieces]),
        layers=np.full(len(rounded.pieces), 0 if seams is None else seams.layer),
        spacing=spacing,
        dropped_runs=len(dropped) + len(strokes.dropped),
        dropped_length=float(sum(_length(run) for run in dropped) + sum(strokes.dropped)),
        fillets=rounded.fillets,
        splits=rounded.splits,
        rows=rows,
        spacings=spacings,
    )


def _runs_of(strokes: Strokes, surface: Surface) -> list[_Run]:
    curves = strokes.curves
    places = positions(surface, curves.points)
    pieces = component_labels(surface)[curves.points.faces[curves.offsets[:-1]]]
    slices = [slice(*curves.offsets[i : i + 2]) for i in range(curves.count)]
    return [
        _Run(
            points=SurfacePoints(curves.points.faces[piece], curves.points.weights[piece]),
            places=places[piece],
            rows=strokes.row[piece],
            spacings=strokes.spacing[piece],
            closed=bool(closed),
            level=int(level),
            piece=int(label),
        )
        for piece, closed, level, label in zip(slices, curves.closed, strokes.levels, pieces, strict=True)
    ]


def _curves(surface: Surface, runs: list[RoundedRun], *, standoff: float, error: float) -> SurfaceCurves:
    """Return the curves of runs, one after the other, without the samples at which the tip would turn sharply."""
    offsets = np.concatenate([[0], np.cumsum([run.points.faces.size for run in runs])])
    every = SurfacePoints(
        np.concatenate([run.points.faces for run in runs]), np.concatenate([run.points.weights for run in runs])
    )
    places, outward = positions(surface, every), normals(surface, every)
    kept = [
        begin
        + without_backtracks(places[begin:end], outward[begin:end], closed=run.closed, standoff=standoff, error=error)
        for run, (begin, end) in zip(runs, pairwise(offsets.tolist()), strict=True)
    ]
    rows = np.concatenate(kept)
    return SurfaceCurves(
        SurfacePoints(every.faces[rows], every.weights[rows]),
        np.concatenate([[0], np.cumsum([run.size for run in kept])]),
        np.array([run.closed for run in runs]),
    )


def _carried(surface: Surface, curves: SurfaceCurves, runs: list[_Run]) -> tuple[FloatArray, FloatArray]:
    """Return row and spacing of each point of some curves: of the nearest point of the stroke that it comes from."""
    places, rows, spacings = positions(surface, curves.points), list[FloatArray](), list[FloatArray]()
    for run, (begin, end) in zip(runs, pairwise(curves.offsets.tolist()), strict=True):
        nearest = np.zeros(end - begin, dtype=np.int64)
        if np.ptp(run.rows) or np.ptp(run.spacings):
            nearest = np.asarray(KDTree(run.places).query(places[begin:end])[1], dtype=np.int64)
        rows.append(run.rows[nearest])
        spacings.append(run.spacings[nearest])
    return np.concatenate(rows), np.concatenate(spacings)


def _length(run: _Run) -> float:
    return float(arc_lengths(run.places)[-1])


def _worth_printing(runs: list[_Run], *, spacing: float) -> tuple[list[_Run], list[_Run]]:
    """Part runs into those to print and those to drop; an open run too short to have two points is dropped too.

    Raises:
        FieldError: nothing is left of a piece.
    """
    long_enough = [_length(run) >= (spacing if run.closed else spacing / 100) for run in runs]
    kept = [run for run, keep in zip(runs, long_enough, strict=True) if keep]
    dropped = [run for run, keep in zip(runs, long_enough, strict=True) if not keep]
    if lost := {run.piece for run in dropped} - {run.piece for run in kept}:
        raise _lost(min(lost) if kept else None, spacing=spacing)
    return kept, dropped


def _lost(piece: int | None, *, spacing: float) -> FieldError:
    which = "the part" if piece is None else f"patch {piece + 1}"
    return FieldError(
        f"at a spacing of {spacing:g} mm every contour of {which} is shorter than one spacing: choose a "
        "smaller spacing."
    )


def _piece_by_piece(runs: list[_Run], *, seams: Seams | None, spacing: float) -> list[_Run]:
    """Order the runs of each piece by themselves, and the pieces so that each starts near where the tool is."""
    waiting = [
        _in_turn([run for run in runs if run.piece == piece], seams, spacing=spacing)
        for piece in sorted({run.piece for run in runs})
    ]
    ordered = waiting.pop(0)
    while waiting:
        away = [float(np.linalg.norm(piece[0].places[0] - ordered[-1].places[-1])) for piece in waiting]
        ordered += waiting.pop(int(np.argmin(away)))
    return ordered


def _in_turn(runs: list[_Run], seams: Seams | None, *, spacing: float) -> list[_Run]:
    """Order the runs of a piece; of a layer of a stack keeping from where those below it start, as they would here."""
    taken = np.zeros((0, 3))
    ordered: list[_Run] = []
    for towards in [None] if seams is None else seams.directions:
        ordered = _in_order(runs, towards=towards, taken=taken, spacing=spacing)
        taken = np.concatenate([taken, [run.places[0] for run in ordered]])
    return ordered


def _in_order(runs: list[_Run], *, towards: FloatArray | None, taken: FloatArray, spacing: float) -> list[_Run]:
    """Go level by level, always to the nearest run, each turned so that it starts near the tool."""
    waiting = sorted(runs, key=lambda run: run.level)
    here = _first_start(waiting, towards=towards)
    starts = [_starts(run, taken, spacing=spacing) for run in waiting]
    ordered: list[_Run] = []
    while waiting:
        level = sum(run.level == waiting[0].level for run in waiting)
        nearest = [_nearest_start(*each, here) for each in zip(waiting[:level], starts[:level], strict=True)]
        chosen = int(np.argmin([distance for _, distance in nearest]))
        turned = _started_at(waiting.pop(chosen), nearest[chosen][0])
        del starts[chosen]
        ordered.append(turned)
        here = turned.places[-1]
    return ordered


def _first_start(runs: list[_Run], *, towards: FloatArray | None) -> FloatArray:
    """Start where the first level is nearest to the last one, so that the row of seams runs inwards straight.

    Where a direction is given, start where the first level reaches farthest towards it.
    """
    outer = np.concatenate([run.places for run in runs if run.level == runs[0].level])
    inner = np.concatenate([run.places for run in runs if run.level == runs[-1].level])
    if towards is not None:
        return outer[int(np.argmax(outer @ towards))]
    return outer[int(np.argmin(np.linalg.norm(outer - inner.mean(axis=0), axis=1)))]


def _starts(run: _Run, taken: FloatArray, *, spacing: float) -> IntArray:
    """Return the indices of the points at which a run may start: its ends; of a closed run those apart from others."""
    if not run.closed:
        return np.array([0, len(run.places) - 1])
    return starts_apart(run.places[:-1], taken, spacing=spacing)


def _nearest_start(run: _Run, starts: IntArray, here: FloatArray) -> tuple[int, float]:
    """Return which of some starting points of a run is nearest to a place, and its distance from there [mm]."""
    distances = np.linalg.norm(run.places[starts] - here, axis=1)
    best = int(np.argmin(distances))
    return int(starts[best]), float(distances[best])


def _started_at(run: _Run, start: int) -> _Run:
    forward: IntArray = np.arange(int(run.places.shape[0]))
    if run.closed:
        return _reordered(run, np.append(np.roll(forward[:-1], -start), start))
    return run if start == 0 else _reordered(run, forward[::-1])


def _reordered(run: _Run, order: IntArray) -> _Run:
    points = SurfacePoints(run.points.faces[order], run.points.weights[order])
    return _Run(
        points, run.places[order], run.rows[order], run.spacings[order], closed=run.closed, level=run.level,
        piece=run.piece,
    )  # fmt: skip
