"""The `guided` pattern: hatch (zigzag, raster) rows side by side with a drawn curve, and contours around them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import ClassVar, NamedTuple, final

import numpy as np
from scipy.spatial import KDTree

from geoprint.distance import Backend, isolines
from geoprint.errors import FieldError, UsageError
from geoprint.geometry import (
    Piece,
    all_curves,
    arc_lengths,
    boundary_loops,
    boundary_source,
    closest,
    even_points,
    pieces,
    some_curves,
    whole_steps,
)
from geoprint.model import Contours, FloatArray, IntArray, Paths, ScalarField, Source, Surface, SurfaceCurves, frozen

# Curves cut to where a field stays above a value: the parts of rows that keep from the rim.


def parts_within(
    places: FloatArray, values: FloatArray, *, closed: bool, least: float, spared: float, grazing: float
) -> Iterator[tuple[FloatArray, bool]]:
    """Yield the parts of a curve on which a field is large enough.

    Args:
        places: (k, 3) of the curve [mm]; a closed one repeats its first.
        values: (k,) of the field there, linear between them.
        closed: whether it is.
        least: a part ends where the field falls below this.
        spared: where the field stays below it by less than this the part goes on,
        grazing: and ends there only where it is cut off no farther than this [mm] from where it falls lower.

    Yields:
        The (j, 3) places of a part, j >= 2, and whether it is the whole of a closed curve.

    Examples:
        >>> places = np.column_stack([np.arange(4.0), np.zeros((4, 2))])
        >>> [part[:, 0].tolist() for part, _ in parts_within(
        ...     places, np.array([0.0, 2.0, 2.0, 1.5]), closed=False, least=1.0, spared=0.0, grazing=1.0)]
        [[0.5, 1.0, 2.0, 3.0]]
    """
    inside = values >= least - spared
    if inside.all():
        yield places, closed
        return
    if closed:
        first = int(np.flatnonzero(~inside)[0])
        order = np.append(np.roll(np.arange(len(places) - 1), -first), first)
        places, values, inside = places[order], values[order], inside[order]
    bounds = np.flatnonzero(np.diff(inside)) + 1
    for begin, end in pairwise([0, *bounds.tolist(), len(places)]):
        if not inside[begin]:
            continue
        # With the places beyond both ends, where the field is lower.
        first, last = max(begin - 1, 0), min(end, len(places) - 1)
        part, held = places[first : last + 1], values[first : last + 1]
        if end < len(places):
            part, held = _cut(part, held, least=least, spared=spared, grazing=grazing)
        if begin:
            part, held = (
                each[::-1] for each in _cut(part[::-1], held[::-1], least=least, spared=spared, grazing=grazing)
            )
        if len(part) > 1:
            yield part, False


def _cut(
    places: FloatArray, values: FloatArray, *, least: float, spared: float, grazing: float
) -> tuple[FloatArray, FloatArray]:
    """Return a line, with the field on it, that ends where the field crosses the value before its lower end."""
    ends = [_ended(places, values, at=value) for value in (least - spared, least) if values.max() >= value]
    lengths = [float(arc_lengths(line)[-1]) for line, _ in ends]
    return ends[-1] if lengths[0] - lengths[-1] <= grazing else ends[0]


def _ended(places: FloatArray, values: FloatArray, *, at: float) -> tuple[FloatArray, FloatArray]:
    """Return a line up to where the field takes a value for the last time."""
    last = int(np.flatnonzero(values >= at)[-1])
    share = (at - values[last]) / (values[last + 1] - values[last])
    end = places[last] + share * (places[last + 1] - places[last])
    return np.vstack([places[: last + 1], end]), np.append(values[: last + 1], at)


# Rows joined to paths: where a row ends, the stroke turns along the line of ends into the next row.


# A turn along the line of ends is no longer than this many spacings: beyond, lifting takes less time, and less of the
# next row is deposited twice.
LONGEST_TURN = 4.0
# The line of ends is no farther from an end than this many spacings; other ends, such as those at the rim itself, stay.
AT_LINE = 0.05
# Corners between row and turn are rounded by this radius, as a share of the spacing: two make a half circle.
CORNER_SHARE = 0.5
# Cosine of the sharpest corner that is rounded so, and the least length [mm] that is divided by.
SHARPEST = -0.99
SHORTEST = 1e-12
# Steps of a turn, as a share of the spacing, and places of the arc that rounds a corner.
STEP_SHARE = 0.125
CORNER_PLACES = 9


class RowPart(NamedTuple):
    """A part of a row that is printed in one go.

    Attributes:
        places: (k, 3) [mm], from one end to the other.
        number: of the row.
        closed: whether it goes round and has no ends.
        strip: whether it stands for a row that would run outside of the line of ends, and lies on that.
    """

    places: FloatArray
    number: int
    closed: bool
    strip: bool = False


class Stroke(NamedTuple):
    """Rows one after another, and the turns between them.

    Attributes:
        places: (k, 3) [mm].
        numbers: (k,) row that each place lies on; between two rows on a turn.
        closed: whether it is one row that goes round.
    """

    places: FloatArray
    numbers: FloatArray
    closed: bool


@frozen
class _End:
    """Where an end of a row lies along the lines of ends: which line, or -1 for none, and how far along [mm]."""

    line: int
    arc: float


NOWHERE = _End(-1, 0.0)


class Lines:
    """The lines at which rows end.

    Args:
        lines: closed, (k, 3) places each, the first repeated at the end [mm].
        spacing: of the rows [mm].
    """

    def __init__(self, lines: Sequence[FloatArray], *, spacing: float) -> None:
        self._lines = [even_points(line, step=STEP_SHARE * spacing) for line in lines]
        self._arcs = [arc_lengths(line) for line in self._lines]
        self._line_of: IntArray = np.repeat(np.arange(len(lines)), [len(line) for line in self._lines])
        self._place_of = np.concatenate([np.arange(len(line)) for line in self._lines]) if lines else np.zeros(0, int)
        self._tree = KDTree(np.concatenate(self._lines)) if lines else None
        self._spacing = spacing

    def end(self, place: FloatArray) -> _End:
        """Return where a place (3,) lies along them [mm]."""
        if self._tree is None:
            return NOWHERE
        away, found = self._tree.query(place)
        if away > (AT_LINE + STEP_SHARE) * self._spacing:
            return NOWHERE
        line = int(self._line_of[found])
        return _End(line, float(self._arcs[line][self._place_of[found]]))

    def apart(self, first: _End, second: _End) -> float:
        """Return how far two ends are apart along their line [mm]; infinitely where not on one."""
        if first.line < 0 or first.line != second.line:
            return np.inf
        away = abs(first.arc - second.arc)
        return min(away, float(self._arcs[first.line][-1]) - away)

    def between(self, first: _End, second: _End) -> FloatArray:
        """Return (k, 3) places on the shorter part of a line between two ends, both left out [mm]."""
        arcs, line = self._arcs[first.line], self._lines[first.line]
        whole = float(arcs[-1])
        along = (second.arc - first.arc + 0.5 * whole) % whole - 0.5 * whole
        steps = int(whole_steps(abs(along), step=STEP_SHARE * self._spacing))
        at = np.mod(first.arc + along * np.linspace(0.0, 1.0, steps + 1)[1:-1], whole)
        return np.column_stack([np.interp(at, arcs, line[:, axis]) for axis in range(3)])


def joined(rows: Sequence[RowPart], lines: Lines, *, spacing: float) -> list[Stroke]:
    """Join rows to paths.

    A stroke begins with the row that has the largest number of those left, at the end that is farther from any row next
    to it, and goes on with the row next to it whose end is nearest along the line of ends: numbers differ by one, or
    are both 0, on the two sides of the curve, or a strip leads on to the rest of its row.

    Args:
        rows: parts of rows.
        lines: at which they end.
        spacing: of the rows [mm].

    Returns:
        Paths; every row is in one.
    """
    ends = [(NOWHERE, NOWHERE) if row.closed else (lines.end(row.places[0]), lines.end(row.places[-1])) for row in rows]
    waiting = sorted(range(len(rows)), key=lambda index: -rows[index].number)
    paths: list[Stroke] = []

    def following(row: int, end: int) -> tuple[float, int, int]:
        """Return how far the next row begins, which it is, and at which of its ends."""
        found = [
            (lines.apart(ends[row][end], ends[other][side]), other, side)
            for other in waiting
            if _beside(rows[row], rows[other]) and other != row
            for side in (0, 1)
        ]
        return min(found, default=(np.inf, -1, 0))

    while waiting:
        at = waiting[0]
        out = 0 if following(at, 0)[0] < following(at, 1)[0] else 1
        waiting.remove(at)
        stroke = _along(rows[at], out)
        while True:
            away, other, side = following(at, out)
            if away > LONGEST_TURN * spacing:
                break
            turn = lines.between(ends[at][out], ends[other][side])
            stroke = _turned(stroke, turn, _along(rows[other], 1 - side), spacing=spacing)
            waiting.remove(other)
            at, out = other, 1 - side
        paths.append(stroke)
    return paths


def _beside(first: RowPart, second: RowPart) -> bool:
    """Return whether a turn may lead from one to the other: neighbours, and parts of one row with a strip between."""
    if first.number == second.number:
        return first.number == 0 or first.strip != second.strip
    return abs(first.number - second.number) == 1


def _along(row: RowPart, out: int) -> Stroke:
    """Return a row as a stroke that leaves at one of its ends."""
    places = row.places if out == 1 else row.places[::-1]
    return Stroke(places, np.full(len(places), float(row.number)), row.closed)


def _turned(first: Stroke, turn: FloatArray, second: Stroke, *, spacing: float) -> Stroke:
    """Return a stroke, a turn and another stroke as one, its two corners rounded."""
    bend = np.concatenate([first.places[-1:], turn, second.places[:1]])
    lengths = [float(arc_lengths(places)[-1]) for places in (first.places, bend, second.places)]
    leaving = _reach(first.places, bend, spacing=spacing)
    arriving = _reach(second.places[::-1], bend[::-1], spacing=spacing)
    shrunk = min(1.0, lengths[1] / max(leaving + arriving, SHORTEST))
    leaving = min(leaving * shrunk, lengths[0] / 2.0)
    arriving = min(arriving * shrunk, lengths[2] / 2.0)
    kept = _part(first.places, 0.0, lengths[0] - leaving)
    inner = _part(bend, leaving, lengths[1] - arriving)[int(leaving + arriving > lengths[1] - SHORTEST) :]
    onward = _part(second.places, arriving, lengths[2])
    places = np.concatenate([
        kept,
        _rounded(kept[-1], first.places[-1], inner[0]),
        inner,
        _rounded(inner[-1], second.places[0], onward[0]),
        onward,
    ])  # fmt: skip
    begun, ended = float(first.numbers[-1]), float(second.numbers[0])
    between: FloatArray = np.linspace(begun, ended, len(places) - len(kept) - len(onward) + 2)[1:-1]
    if begun == ended:
        between = between + 0.5
    numbers = np.concatenate([first.numbers[: len(kept)], between, np.full(len(onward), ended)])
    return Stroke(places, numbers, closed=False)


def _reach(row: FloatArray, bend: FloatArray, *, spacing: float) -> float:
    """Return how far from the corner between a row and a turn its rounding reaches, to be as wide as a half circle."""
    ahead, length = CORNER_SHARE * spacing, float(arc_lengths(row)[-1])
    before = row[-1] - _part(row, max(length - ahead, 0.0), length)[0]
    after = _part(bend, 0.0, ahead)[-1] - bend[0]
    cosine = before @ after / max(float(np.linalg.norm(before) * np.linalg.norm(after)), SHORTEST)
    return ahead * float(np.tan(0.5 * np.arccos(np.clip(cosine, SHARPEST, 1.0))))


def _part(places: FloatArray, begin: float, end: float) -> FloatArray:
    """Return the part of a polyline between two arc lengths [mm]."""
    arcs = arc_lengths(places)
    ends = [np.array([[np.interp(arc, arcs, places[:, axis]) for axis in range(3)]]) for arc in (begin, end)]
    return np.concatenate([ends[0], places[(arcs > begin) & (arcs < end)], ends[1]])


def _rounded(start: FloatArray, corner: FloatArray, end: FloatArray) -> FloatArray:
    """Return places of the parabola between two tangents that meet in a corner, both ends left out."""
    share = np.linspace(0.0, 1.0, CORNER_PLACES + 2)[1:-1, None]
    return (1 - share) ** 2 * start + 2 * share * (1 - share) * corner + share**2 * end


# Where rows run along the line of ends, but leave a strip open beside it, that line is a row itself.


# A strip is open where the line is farther from the row before than this share of the spacing ...
LEAST_SHARE = 0.5
# ... and from the row behind, which would run outside of it, than the rest to this.
MOST_SHARE = 0.9
# Shorter strips than so many spacings lie between rows that end there.
SHORTEST_STRIP = 2.0


def strips(places: FloatArray, distances: FloatArray, *, spacing: float) -> Iterator[RowPart]:
    """Yield the parts of a line of ends that are rows.

    Args:
        places: (k, 3) of a closed line, the first repeated at the end [mm].
        distances: (k,) from the drawn curve [mm].
        spacing: of the rows [mm].

    Yields:
        Rows with the number of the one that would run outside.
    """
    row = distances / spacing - 0.5
    before: FloatArray = np.floor(row)
    number = np.where((row - before >= LEAST_SHARE) & (row - before <= MOST_SHARE) & (row > 0.0), before + 1.0, -1.0)
    changes = np.flatnonzero(np.diff(number))
    if changes.size == 0:
        if number[0] >= 0.0:
            yield RowPart(places, int(number[0]), closed=True, strip=True)
        return
    first = int(changes[0]) + 1
    order = np.append(np.roll(np.arange(len(places) - 1), -first), first)
    places, number = places[order], number[order]
    bounds = np.flatnonzero(np.diff(number[:-1])) + 1
    for begin, end in pairwise([0, *bounds.tolist(), len(places) - 1]):
        if number[begin] >= 0.0 and arc_lengths(places[begin:end])[-1] >= SHORTEST_STRIP * spacing:
            yield RowPart(places[begin:end], int(number[begin]), closed=False, strip=True)


# The `guided` pattern: rows side by side with a drawn curve, and contours around them.


# A row may run along the line of ends, outside of it by less than this share of the spacing: it is not cut there but
# where it comes within so many spacings of leaving it.
SPARED_SHARE = 0.1
GRAZING = 1.0
# A shorter part of a row [spacings] is no row: the turn past it lies there.
SHORTEST_ROW = 1.0


@final
class GuidedPattern:
    """The `guided` pattern: rows at (k + 1/2) * spacing from a drawn curve, on both sides of it.

    Rows end half a spacing from the rim, or from the contours around them, and are joined to paths there by turns of
    at most four spacings. The curve may be a part of the rim; a row about the end of a curve inside the part goes round
    it.

    Args:
        contours: level curves of the distance from the rim, so many, around the rows.

    Raises:
        UsageError: fewer than none.

    Examples:
        >>> GuidedPattern.title
        'rows along a drawn curve'
    """

    title: ClassVar[str] = "rows along a drawn curve"
    beside_line: ClassVar[bool] = True
    summary: ClassVar[str] = "Rows at equal distances from a drawn curve, joined by turns where they end."

    def __init__(self, *, contours: int = 0) -> None:
        if contours < 0:
            raise UsageError(f"`contours = {contours}`: the number of contours around the rows must be 0 or more.")
        self._contours = contours

    def paths(self, surface: Surface, source: Source, *, backend: Backend, spacing: float | ScalarField) -> Paths:
        """Return the contours, and paths of rows; rows are numbered from where the contours end.

        Raises:
            UsageError: the spacing is not the same everywhere, the source of a piece is no line with two ends, or a
                closed part shall have contours.
            FieldError: there is no room for a row within the contours, or on a piece.
        """
        if isinstance(spacing, ScalarField):
            raise UsageError(
                "guided rows lie one spacing apart everywhere, but a spacing at each vertex is given. Give one "
                "number, or choose the pattern fibres."
            )
        _check(surface, source)
        rim = self._rim(surface, backend, spacing=spacing)
        rows = backend.contours(source, spacing=spacing)
        walls = rim and rim[2]
        found = [] if walls is None else [(walls.curves, walls.point_levels.astype(np.float64))]
        for piece in pieces(surface):
            paths = _strokes(piece, rows, rim and rim[:2])
            if not paths:
                raise FieldError(
                    f"no row of {surface.name} is {SHORTEST_ROW * spacing:g} mm long within its rim and "
                    f"{self._contours} contours: choose fewer contours, or a smaller spacing."
                )
            found += [_on_whole(piece, stroke, first=self._contours) for stroke in paths]
        row = np.concatenate([numbers for _, numbers in found])
        curves = all_curves([curve for curve, _ in found])
        return Paths(curves, row, np.full(row.size, rows.spacing), np.ones(row.size))

    def _rim(
        self, surface: Surface, backend: Backend, *, spacing: float
    ) -> tuple[ScalarField, float, Contours | None] | None:
        """Return at which depth [mm] of the distance from the rim rows end, and the contours outside of that, if any.

        None where there is no rim.
        """
        if not boundary_loops(surface):
            if self._contours:
                raise UsageError(f"contours need a rim, but {surface.name} is closed: omit `contours`.")
            return None
        border, depth = boundary_source(surface), (self._contours + 0.5) * spacing
        if self._contours == 0:
            return backend.distance(border), depth, None
        contours = backend.contours(border, spacing=spacing)
        kept = np.flatnonzero(contours.levels < self._contours)
        walls = Contours(some_curves(contours.curves, kept), contours.levels[kept], spacing, contours.distance)
        return contours.distance, depth, walls


def _strokes(piece: Piece, rows: Contours, rim: tuple[ScalarField, float] | None) -> list[Stroke]:
    """Return the paths of rows on a piece, which end at a depth of the distance from its rim."""
    surface, curves, spacing = piece.surface, piece.own(rows.curves), rows.spacing
    levels: list[int] = rows.levels[piece.holds(rows.curves)].tolist()
    places = [curves.xyz(surface, curve) for curve in range(curves.count)]
    if rim is None:
        whole = map(RowPart, places, levels, curves.closed.tolist())
        return joined([row for row in whole if _long(row, spacing)], Lines([], spacing=spacing), spacing=spacing)
    distance, least = rim
    depth = distance.values[piece.vertices]
    depths, parts = _at(surface, curves, depth), list[RowPart]()
    for curve, level in enumerate(levels):
        within = parts_within(
            places[curve],
            depths[curve],
            closed=bool(curves.closed[curve]),
            least=least,
            spared=SPARED_SHARE * spacing,
            grazing=GRAZING * spacing,
        )
        parts += [RowPart(part, level, whole) for part, whole in within]
    line, _ = isolines(surface, ScalarField(depth), levels=np.array([least]))
    ends = [line.xyz(surface, curve) for curve in range(line.count)]
    away = _at(surface, line, rows.distance.values[piece.vertices])
    for end, distances in zip(ends, away, strict=True):
        parts += strips(end, distances, spacing=spacing)
    return joined([row for row in parts if _long(row, spacing)], Lines(ends, spacing=spacing), spacing=spacing)


def _long(row: RowPart, spacing: float) -> bool:
    return bool(arc_lengths(row.places)[-1] >= SHORTEST_ROW * spacing)


def _at(surface: Surface, curves: SurfaceCurves, values: FloatArray) -> list[FloatArray]:
    """Return the values at the points of each curve of what is linear in each triangle."""
    found = curves.points.values(surface, values)
    return [found[begin:end] for begin, end in pairwise(curves.offsets.tolist())]


def _check(surface: Surface, source: Source) -> None:
    """Check that there is a line to run beside.

    Raises:
        UsageError: a piece has none.
    """
    for piece in pieces(surface):
        own = piece.own(source.curves)
        if not (~own.closed & (np.diff(own.offsets) > 1)).any():
            raise UsageError(
                f"guided rows need a line with two ends as their source on {surface.name}. Draw one (`--from "
                "curve.csv`, columns x,y,z), or take a part of the rim (`--from between:X,Y,Z:X,Y,Z`)."
            )


def _on_whole(piece: Piece, stroke: Stroke, *, first: int) -> tuple[SurfaceCurves, FloatArray]:
    """Return a stroke on a piece as a curve on the whole, with the row of each of its points."""
    points, _ = closest(piece.surface, stroke.places)
    curve = SurfaceCurves(points, np.array([0, len(stroke.places)]), np.array([stroke.closed]))
    return piece.on_whole(curve), stroke.numbers + first
