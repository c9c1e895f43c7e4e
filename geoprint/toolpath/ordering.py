"""Printing order: from the source inwards, seams next to one another; where closed runs start.

Runs go level by level, which is the whole part of the row at which a stroke starts; inside a level the next run is the
one nearest to where the tool is. A closed run starts at its point nearest to the end of the run before, so that seams
lie side by side and travel is short; it keeps its direction. An open run starts at its nearer end.

A run shorter than one spacing would be a blob rather than a bead, and one shorter than the equipment needs would not be
what was planned. Where its end faces that of another run with nothing beside, both become one; else it is dropped and
counted, as are those that the pattern left out, and what is left so short where a corner splits a run.

Steps are at most half a spacing and chord errors at most a 500th of it, but a 20th where the tip would turn sharply.

A surface in several pieces is printed piece by piece, each in the order that it has alone: first the first one, then
always the one that starts nearest to the tool.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple, final

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import FieldError, VerificationError
from geoprint.geometry import arc_lengths, component_labels, direction_across, in_words, normals, positions, triple
from geoprint.model import (
    FloatArray,
    IntArray,
    Paths,
    PoseStream,
    Surface,
    SurfaceCurves,
    SurfacePoints,
    Toolpath,
    freeze_arrays,
    frozen,
)
from geoprint.toolpath.corners import Rounded, RunPiece, faired, round_corners, without_backtracks
from geoprint.toolpath.edges import cut_at_edges
from geoprint.toolpath.resample import ROUNDING, resample
from geoprint.transforms import nearest

# Where closed runs of a layer of a stack start: away from the starts in the layers below, where a bead is weakest.


# Multiples of this share of a turn fall farthest apart.
GOLDEN = (5.0**0.5 - 1.0) / 2.0
# Layers take turns: each three in a row start at different places.
TURNS = 3
# A start keeps so many spacings from those below, half a spacing more than it must: the runs below lie not quite under
# those of a layer.
APART = 2.5


@final
@frozen
class Seams:
    """Where closed runs of a layer may start.

    A start is a blob or a gap: one over another is a weak line through the device. So a closed run starts at least two
    spacings from every start in the layer below and in the one below that, or where it is too short for that, as far
    from them as it can.

    Layers are planned without waiting for each other, but their runs lie nearly over each other, so that a layer finds
    on its own runs where those below it start: that holds as far as they do; in up to four runs of a hundred it does
    not, by less than a spacing.

    Three layers take turns. The first starts its runs in a row from where the part reaches farthest in one direction;
    the second in another direction, keeping from the starts of the first; the third in one more, keeping from both; the
    fourth starts where the first does. Directions follow each other by the golden section of a turn, so that rows of
    starts are 85 degrees apart or more to begin with.

    Attributes:
        layer: of a stack, from 0.
        directions: (t, 3) unit vectors: of each layer of the three up to this one, whose first run starts where it
            reaches farthest in it; this layer's is the last.
    """

    layer: int
    directions: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, directions="float: t 3")


def seams_of(base: Surface, *, layer: int) -> Seams:
    """Return where closed runs of a layer may start.

    Args:
        base: the part that the lowest layer lies on: the same for all layers.
        layer: from 0.
    """
    turns = range(layer % TURNS + 1)
    return Seams(layer, np.array([direction_across(base, angle=2.0 * np.pi * GOLDEN * turn) for turn in turns]))


def starts_apart(places: FloatArray, taken: FloatArray, *, spacing: float) -> IntArray:
    """Return the indices of the places of a closed run that are far enough from other starts, or else of the farthest.

    Args:
        places: (k, 3) of the run [mm].
        taken: (t, 3) the starts to keep from [mm].
        spacing: [mm].

    Examples:
        >>> places = np.array([[0.0, 0, 0], [2, 0, 0], [3, 0, 0], [9, 0, 0]])
        >>> starts_apart(places, np.zeros((1, 3)), spacing=1.0)
        array([2, 3])
        >>> starts_apart(places, np.zeros((1, 3)), spacing=9.0)
        array([3])
        >>> starts_apart(places, np.zeros((0, 3)), spacing=1.0)
        array([0, 1, 2, 3])
    """
    if not len(taken):
        return np.arange(len(places))
    away = np.asarray(KDTree(taken).query(places)[0], dtype=np.float64)
    return np.flatnonzero(away >= min(APART * spacing, float(away.max())))


# Paths put into printing order and resampled along the arc.


# Defaults of the sampling as shares of the spacing: errors far below the bead's width, steps that a spline follows.
STEP_SHARE = 0.5
CHORD_ERROR_SHARE = 1.0 / 500.0
# Length that a step has at least, where all of them have none [mm].
SMALLEST = 1e-12
# A short run goes on into another one whose end is within so many spacings, ahead of its own end and facing it within
# this cosine; its direction is that over so many spacings. Ends nearer than the last have no line between them.
JOINED_REACH, FACING, DIRECTION, TOUCHING = 1.0, 0.7, 0.5, 0.05
# Nothing else lies within so many spacings of what joins them.
JOINED_ROOM = 0.6
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

    @property
    def length(self) -> float:
        return float(arc_lengths(self.places)[-1])


class _Joint(NamedTuple):
    """Where a run goes on into another: how far, where, which two, and whether each is joined at its end."""

    gap: float
    middle: FloatArray
    runs: tuple[int, int]
    at_end: tuple[bool, bool]


def arrange(
    paths: Paths,
    surface: Surface,
    *,
    speed: float,
    standoff: float = 0.0,
    shortest: float = 0.0,
    seams: Seams | None = None,
) -> Toolpath:
    """Order, orient and resample paths.

    Args:
        paths: c curves.
        surface: what they were drawn on.
        speed: set speed of the tip [mm/s]; `round_corners` says what depends on it.
        standoff: height of the tip over the surface [mm]: where its line turns sharply there, samples are left out.
        shortest: run that the equipment can deposit, as `Cell.shortest_run` [mm].
        seams: of a layer of a stack: where its closed runs may start; of those places the nearest counts.

    Returns:
        The toolpath, `faired` and sampled by the smallest spacing; corners rounded or split.

    Raises:
        FieldError: nothing is left to print of a piece, or a run is too hollow for a tip at the stand-off.
    """
    spacing = float(paths.spacing.min())
    least = max(spacing, shortest) * (1.0 - ROUNDING)
    long_enough = partial(_long_enough, least=least, shortest=shortest, spacing=spacing)
    joined = _joined(_runs_of(paths, surface), least=least, spacing=spacing)
    which, dropped = long_enough(joined, [run.length for run in joined])
    ordered = _piece_by_piece([joined[number] for number in which], seams=seams, spacing=spacing)
    rounded, runs = _rounded(ordered, surface, least=least, spacing=spacing, speed=speed)
    which, short = long_enough(runs, [arc_lengths(positions(surface, each.points))[-1] for each in rounded.pieces])
    runs, pieces = [runs[number] for number in which], [rounded.pieces[number] for number in which]
    curves = _curves(surface, pieces, standoff=standoff, error=BACKTRACK_ERROR_SHARE * spacing)
    rows, spacings = _carried(surface, curves, runs)
    lost = [*dropped, *short, *((length, spacing) for length in paths.dropped)]
    return Toolpath(
        curves=curves,
        levels=np.array([run.level for run in runs]),
        layers=np.full(len(runs), 0 if seams is None else seams.layer),
        spacing=spacing,
        dropped_runs=len(lost),
        dropped_length=float(sum(length for length, _ in lost)),
        dropped_area=float(sum(length * width for length, width in lost)),
        fillets=rounded.fillets,
        splits=rounded.splits,
        rows=rows,
        spacings=spacings,
    )


def _runs_of(paths: Paths, surface: Surface) -> list[_Run]:
    curves = paths.curves
    places = positions(surface, curves.points)
    pieces = component_labels(surface)[curves.points.faces[curves.offsets[:-1]]]
    slices = [slice(*curves.offsets[i : i + 2]) for i in range(curves.count)]
    return [
        _Run(
            points=curves.points[piece],
            places=places[piece],
            rows=paths.row[piece],
            spacings=paths.spacing[piece],
            closed=bool(closed),
            level=int(level),
            piece=int(label),
        )
        for piece, closed, level, label in zip(slices, curves.closed, paths.levels, pieces, strict=True)
    ]


def _rounded(
    runs: list[_Run], surface: Surface, *, least: float, spacing: float, speed: float
) -> tuple[Rounded, list[_Run]]:
    """Return runs cut at creases, smoothed, sampled and without sharp corners, and the run that each piece is of."""
    cut, at_edges = cut_at_edges(
        surface, [run.points for run in runs], closed=[run.closed for run in runs], least=least
    )
    closed = [piece.closed for piece in cut]
    smooth = faired(surface, [piece.points for piece in cut], closed=closed, spacing=spacing)
    step, error = STEP_SHARE * spacing, CHORD_ERROR_SHARE * spacing
    sampled = [resample(surface, points, step=step, chord_error=error) for points in smooth]
    rounded = round_corners(surface, sampled, closed=closed, spacing=spacing, speed=speed)
    of = [runs[cut[each.run].run] for each in rounded.pieces]
    return rounded._replace(splits=np.concatenate([rounded.splits, at_edges])), of


def _curves(surface: Surface, runs: list[RunPiece], *, standoff: float, error: float) -> SurfaceCurves:
    """Return the curves of runs, one after the other, without the samples at which the tip would turn sharply."""
    offsets = np.concatenate([[0], np.cumsum([run.points.faces.size for run in runs])])
    every = SurfacePoints.chained([run.points for run in runs])
    places, outward = positions(surface, every), normals(surface, every)
    kept = [
        begin
        + without_backtracks(places[begin:end], outward[begin:end], closed=run.closed, standoff=standoff, error=error)
        for run, (begin, end) in zip(runs, pairwise(offsets.tolist()), strict=True)
    ]
    rows = np.concatenate(kept)
    return SurfaceCurves(
        every[rows],
        np.concatenate([[0], np.cumsum([run.size for run in kept])]),
        np.array([run.closed for run in runs]),
    )


def _carried(surface: Surface, curves: SurfaceCurves, runs: list[_Run]) -> tuple[FloatArray, FloatArray]:
    """Return row and spacing of each point of some curves: of the nearest point of the stroke that it comes from."""
    places, rows, spacings = positions(surface, curves.points), list[FloatArray](), list[FloatArray]()
    for run, (begin, end) in zip(runs, pairwise(curves.offsets.tolist()), strict=True):
        whose = np.zeros(end - begin, dtype=np.int64)
        if np.ptp(run.rows) or np.ptp(run.spacings):
            whose = np.asarray(KDTree(run.places).query(places[begin:end])[1], dtype=np.int64)
        rows.append(run.rows[whose])
        spacings.append(run.spacings[whose])
    return np.concatenate(rows), np.concatenate(spacings)


def _long_enough(
    runs: list[_Run], lengths: Sequence[float], *, least: float, shortest: float, spacing: float
) -> tuple[list[int], list[tuple[float, float]]]:
    """Return which runs are long enough, and length and width of each of the others.

    Of a piece without any, its longest open one is where the valve can deposit it.

    Raises:
        FieldError: nothing is left of a piece.
    """
    longest: dict[int, float] = {}
    for run, length in zip(runs, lengths, strict=True):
        longest[run.piece] = max(length, longest.get(run.piece, 0.0))
    kept = [
        number
        for number, (run, length) in enumerate(zip(runs, lengths, strict=True))
        if length >= least
        or (longest[run.piece] < least and not run.closed and length == longest[run.piece] > max(shortest, 0.0))
    ]
    _check_left({run.piece for run in runs}, {runs[number].piece for number in kept}, least=least, spacing=spacing)
    others = [number for number in range(len(runs)) if number not in {*kept}]
    return kept, [(float(lengths[number]), float(runs[number].spacings.mean())) for number in others]


def _joined(runs: list[_Run], *, least: float, spacing: float) -> list[_Run]:
    """Return runs of which short ones go on into those that they face: the nearest ends first, as long as there are."""
    runs = [*runs]
    while joints := _joints(runs, least=least, spacing=spacing):
        joint = joints[nearest(np.array([one.gap for one in joints]), np.array([one.middle for one in joints]))]
        first, second = (runs[number] for number in joint.runs)
        # The first is turned so that it ends at the joint, the second so that it starts there.
        first = first if joint.at_end[0] else _reordered(first, np.arange(len(first.places))[::-1])
        second = _reordered(second, np.arange(len(second.places))[::-1]) if joint.at_end[1] else second
        level = max(first, second, key=lambda run: run.length).level
        runs = [run for number, run in enumerate(runs) if number not in joint.runs]
        runs.append(_end_to_end(first, second, level=level))
    return runs


def _joints(runs: list[_Run], *, least: float, spacing: float) -> list[_Joint]:
    """Return where short runs go on into others."""
    opened = [number for number, run in enumerate(runs) if not run.closed and run.length > 0.0]
    short = {number for number in opened if runs[number].length < least}
    if not short:
        return []
    ends = [(number, at_end) for number in opened for at_end in (False, True)]
    places = np.array([runs[number].places[-1 if at_end else 0] for number, at_end in ends])
    outwards = np.array(
        [_outwards(runs[number].places, at_end=at_end, reach=DIRECTION * spacing) for number, at_end in ends]
    )
    every = np.concatenate([run.places for run in runs])
    owner = np.repeat(np.arange(len(runs)), [len(run.places) for run in runs])
    found = list[_Joint]()
    # The set has no order of its own.
    for a, b in sorted(KDTree(places).query_pairs(JOINED_REACH * spacing)):
        pair = (ends[a][0], ends[b][0])
        if pair[0] == pair[1] or not short & {*pair} or runs[pair[0]].piece != runs[pair[1]].piece:
            continue
        if _faces(places[a], outwards[a], places[b], outwards[b], touching=TOUCHING * spacing):
            middle = 0.5 * (places[a] + places[b])
            near = np.linalg.norm(every - middle, axis=1) < JOINED_ROOM * spacing
            if not (near & (owner != pair[0]) & (owner != pair[1])).any():
                gap = float(np.linalg.norm(places[b] - places[a]))
                found.append(_Joint(gap, middle, pair, (ends[a][1], ends[b][1])))
    return found


def _outwards(places: FloatArray, *, at_end: bool, reach: float) -> FloatArray:
    """Return the (3,) unit vector in which a line leaves itself at an end, over a reach [mm]."""
    line = places[::-1] if at_end else places
    arcs = arc_lengths(line)
    back = np.array([np.interp(reach, arcs, line[:, axis]) for axis in range(3)])
    return (line[0] - back) / max(float(np.linalg.norm(line[0] - back)), np.finfo(np.float64).tiny)


def _faces(first: FloatArray, ahead: FloatArray, second: FloatArray, behind: FloatArray, *, touching: float) -> bool:
    """Return whether a line that ends in one place and direction goes on in another that faces it."""
    step = second - first
    gap = float(np.linalg.norm(step))
    if gap < touching:
        return float(ahead @ behind) < -FACING
    return float(step @ ahead) > FACING * gap and float(-step @ behind) > FACING * gap


def _end_to_end(first: _Run, second: _Run, *, level: int) -> _Run:
    return _Run(
        points=SurfacePoints.chained([first.points, second.points]),
        places=np.concatenate([first.places, second.places]),
        rows=np.concatenate([first.rows, second.rows]),
        spacings=np.concatenate([first.spacings, second.spacings]),
        closed=False,
        level=level,
        piece=first.piece,
    )


def _check_left(pieces: set[int], kept: set[int], *, least: float, spacing: float) -> None:
    """Check that something is left of every piece.

    Raises:
        FieldError: nothing is.
    """
    lost = pieces - kept
    if not lost:
        return
    which = f"patch {min(lost) + 1}" if kept else "the part"
    if least < spacing:
        raise FieldError(
            f"at a spacing of {spacing:g} mm every contour of {which} is shorter than one spacing: choose a smaller "
            "spacing."
        )
    raise FieldError(
        f"every path of {which} is shorter than {least:.3g} mm, what flows while the valve shuts "
        "(signals.valve_close_s at process.speed_mm_s): choose a smaller spacing or print slower."
    )


def _piece_by_piece(runs: list[_Run], *, seams: Seams | None, spacing: float) -> list[_Run]:
    """Order the runs of each piece by themselves, and the pieces so that each starts near where the tool is."""
    waiting = [
        _in_turn([run for run in runs if run.piece == piece], seams, spacing=spacing)
        for piece in sorted({run.piece for run in runs})
    ]
    ordered = waiting.pop(0)
    while waiting:
        begun = np.array([piece[0].places[0] for piece in waiting])
        ordered += waiting.pop(nearest(np.linalg.norm(begun - ordered[-1].places[-1], axis=1), begun))
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
        first = [_nearest_start(*each, here) for each in zip(waiting[:level], starts[:level], strict=True)]
        begun = np.array([run.places[start] for run, start in zip(waiting, first, strict=False)])
        chosen = nearest(np.linalg.norm(begun - here, axis=1), begun)
        turned = _started_at(waiting.pop(chosen), first[chosen])
        del starts[chosen]
        ordered.append(turned)
        here = turned.places[-1]
    return ordered


def _first_start(runs: list[_Run], *, towards: FloatArray | None) -> FloatArray:
    """Start where the first level is nearest to the last one, so that the row of seams runs inwards straight.

    Where a direction is given, start where the first level reaches farthest towards it.
    """
    outer = np.concatenate([run.places for run in runs if run.level == runs[0].level])
    if towards is not None:
        return outer[nearest(-outer @ towards, outer)]
    inner = [run.places for run in runs if run.level == runs[-1].level]
    # By length: where a line begins, and how finely it was traced, does not count.
    steps = np.concatenate([np.diff(places, axis=0) for places in inner])
    middles = np.concatenate([0.5 * (places[1:] + places[:-1]) for places in inner])
    centre = np.average(middles, axis=0, weights=np.linalg.norm(steps, axis=1) + SMALLEST)
    return outer[nearest(np.linalg.norm(outer - centre, axis=1), outer)]


def _starts(run: _Run, taken: FloatArray, *, spacing: float) -> IntArray:
    """Return the indices of the points at which a run may start: its ends; of a closed run those apart from others."""
    if not run.closed:
        return np.array([0, len(run.places) - 1])
    return starts_apart(run.places[:-1], taken, spacing=spacing)


def _nearest_start(run: _Run, starts: IntArray, here: FloatArray) -> int:
    """Return which of some starting points of a run is nearest to a place."""
    return int(starts[nearest(np.linalg.norm(run.places[starts] - here, axis=1), run.places[starts])])


def _started_at(run: _Run, start: int) -> _Run:
    forward: IntArray = np.arange(int(run.places.shape[0]))
    if run.closed:
        return _reordered(run, np.append(np.roll(forward[:-1], -start), start))
    return run if start == 0 else _reordered(run, forward[::-1])


def _reordered(run: _Run, order: IntArray) -> _Run:
    return _Run(
        run.points[order], run.places[order], run.rows[order], run.spacings[order], closed=run.closed, level=run.level,
        piece=run.piece,
    )  # fmt: skip


# Whether what several parts of a program deposit is together what one deposit asks for, at every place of it.


# Middles of steps that are the same lie as near as tables are written [mm].
SAME_PLACE = 1e-4
# What is deposited over what is wanted, over a step, may be off by this: ends of fades are rounded to poses.
SHARE = 0.01


def check_sum(whole: PoseStream, parts: Sequence[PoseStream]) -> None:
    """Check that the flows of all parts add, from each pose of the whole to the next, to that of the whole.

    Both are compared in the part's own coordinates, so that it does not matter where it stood when it was printed.

    Args:
        whole: the deposit as it is planned.
        parts: as they are printed, one after another.

    Raises:
        VerificationError: a stretch of the whole is not laid, or laid with another volume, or something besides it.
    """
    volumes, middles, runs = _volumes(whole)
    tree = KDTree(middles)
    wanted, deposited = np.zeros((2, len(middles)))
    # Where the deposit passes the same line twice, both count as one.
    np.add.at(wanted, np.asarray(tree.query(middles)[1]), volumes)
    for number, part in enumerate(parts, start=1):
        volumes, places, own = _volumes(part)
        distances, rows = tree.query(places)
        far = np.flatnonzero(np.asarray(distances) > SAME_PLACE)
        if far.size:
            raise VerificationError(
                f"part {number} deposits material in its run {own[far[0]] + 1} at {in_words(places[far[0]])}, where "
                "the paths have none; please report this as a defect of geoprint.",
                part=number,
                place=triple(places[far[0]]),
            )
        np.add.at(deposited, np.asarray(rows), volumes)
    off = np.abs(deposited - wanted) / np.where(wanted > 0.0, wanted, 1.0)
    worst = int(off.argmax())
    if off[worst] > SHARE:
        raise VerificationError(
            f"all parts together deposit {deposited[worst]:.4g} mm3 in run {runs[worst] + 1} at "
            f"{in_words(middles[worst])}, the paths ask for {wanted[worst]:.4g}; please report this as a defect of "
            "geoprint.",
            deposited=float(deposited[worst]),
            wanted=float(wanted[worst]),
            place=triple(middles[worst]),
        )


def _volumes(stream: PoseStream) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the (k,) volumes that are deposited from pose to pose [mm3], their (k, 3) middles, and the runs."""
    rows, places = np.flatnonzero(stream.deposited), stream.surface_points
    lengths = np.linalg.norm(places[rows + 1] - places[rows], axis=1)
    volumes = lengths * (stream.flow[rows + 1] + stream.flow[rows]) / 2.0
    return volumes, (places[rows + 1] + places[rows]) / 2.0, stream.runs[rows]
