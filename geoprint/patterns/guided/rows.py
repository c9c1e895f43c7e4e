"""The `guided` pattern: rows side by side with a drawn curve, and contours around them."""

from __future__ import annotations

from itertools import pairwise
from typing import ClassVar, final

import numpy as np

from geoprint.backends import Backend, isolines
from geoprint.errors import FieldError, UsageError
from geoprint.model import (
    Contours,
    FloatArray,
    ScalarField,
    Seed,
    Strokes,
    Surface,
    SurfaceCurves,
    frozen,
)
from geoprint.patterns.guided.filling import strips
from geoprint.patterns.guided.turns import Lines, RowPart, Stroke, joined
from geoprint.patterns.guided.within import parts_within
from geoprint.surfaces import (
    Piece,
    all_curves,
    arc_lengths,
    boundary_loops,
    boundary_seed,
    closest,
    pieces,
    some_curves,
)

# A row may run along the line of ends, outside of it by less than this share of the spacing: it is not cut there but
# where it comes within so many spacings of leaving it.
SPARED_SHARE = 0.1
GRAZING = 1.0
# A shorter part of a row [spacings] is no row: the turn past it lies there.
SHORTEST_ROW = 1.0


@final
class GuidedPattern:
    """The `guided` pattern: rows at (k + 1/2) * spacing from a drawn curve, on both sides of it.

    Rows end half a spacing from the rim, or from the contours around them, and are joined to strokes there by turns of
    at most four spacings. The curve may be a part of the rim; a row about the end of a curve inside the part goes round
    it.

    Args:
        contours: level curves of the distance from the rim, so many, around the rows.

    Raises:
        UsageError: fewer than none.

    Examples:
        >>> GuidedPattern.title
        'rows beside a drawn curve'
    """

    title: ClassVar[str] = "rows beside a drawn curve"
    beside_line: ClassVar[bool] = True
    summary: ClassVar[str] = "Rows at equal distances from a drawn curve, joined by turns where they end."

    def __init__(self, *, contours: int = 0) -> None:
        if contours < 0:
            raise UsageError(f"`--contours {contours}` is how many contours go around the rows: 0 or more.")
        self._contours = contours

    def strokes(self, surface: Surface, seed: Seed, *, backend: Backend, spacing: float | ScalarField) -> Strokes:
        """Return the contours, and strokes of rows; rows are numbered from where the contours end.

        Raises:
            UsageError: the spacing is not the same everywhere, the seed of a piece is no line with two ends, or a
                closed part shall have contours.
            FieldError: there is no room for a row within the contours, or on a piece.
        """
        if isinstance(spacing, ScalarField):
            raise UsageError(
                "guided rows lie one spacing apart everywhere, but a spacing at each vertex is given: give one number, "
                "or choose the pattern fibres."
            )
        _check(surface, seed)
        rim = self._rim(surface, backend, spacing=spacing)
        rows = backend.contours(seed, spacing=spacing)
        walls = None if rim is None else rim.walls
        found = [] if walls is None else [(walls.curves, walls.point_levels.astype(np.float64))]
        for piece in pieces(surface):
            strokes = _strokes(piece, rows, rim)
            if not strokes:
                raise FieldError(
                    f"no row of {surface.name} is {SHORTEST_ROW * spacing:g} mm long within its rim and "
                    f"{self._contours} contours: choose fewer contours, or a smaller spacing."
                )
            found += [_on_whole(piece, stroke, first=self._contours) for stroke in strokes]
        row = np.concatenate([numbers for _, numbers in found])
        curves = all_curves([curve for curve, _ in found])
        return Strokes(curves, row, np.full(row.size, rows.spacing), np.ones(row.size))

    def _rim(self, surface: Surface, backend: Backend, *, spacing: float) -> _Rim | None:
        """Return where rows end: beside the rim, or beside the contours along it; None where there is no rim."""
        if not boundary_loops(surface):
            if self._contours:
                raise UsageError(
                    f"contours go along a rim, but {surface.name} is closed and has none: leave out `--contours`."
                )
            return None
        border, depth = boundary_seed(surface), (self._contours + 0.5) * spacing
        if self._contours == 0:
            return _Rim(backend.distance(border), depth, None)
        contours = backend.contours(border, spacing=spacing)
        kept = np.flatnonzero(contours.levels < self._contours)
        walls = Contours(some_curves(contours.curves, kept), contours.levels[kept], spacing, contours.distance)
        return _Rim(contours.distance, depth, walls)


@frozen
class _Rim:
    """Where rows end: at a depth [mm] of the distance from the rim; and the contours outside of it, if any."""

    distance: ScalarField
    depth: float
    walls: Contours | None


def _strokes(piece: Piece, rows: Contours, rim: _Rim | None) -> list[Stroke]:
    """Return the strokes of rows on a piece."""
    surface, curves, spacing = piece.surface, piece.own(rows.curves), rows.spacing
    levels: list[int] = rows.levels[piece.holds(rows.curves)].tolist()
    places = [curves.xyz(surface, curve) for curve in range(curves.count)]
    if rim is None:
        whole = map(RowPart, places, levels, curves.closed.tolist())
        return joined([row for row in whole if _long(row, spacing)], Lines([], spacing=spacing), spacing=spacing)
    depth = rim.distance.values[piece.vertices]
    depths, parts = _at(surface, curves, depth), list[RowPart]()
    for curve, level in enumerate(levels):
        within = parts_within(
            places[curve],
            depths[curve],
            closed=bool(curves.closed[curve]),
            least=rim.depth,
            spared=SPARED_SHARE * spacing,
            grazing=GRAZING * spacing,
        )
        parts += [RowPart(part, level, whole) for part, whole in within]
    line, _ = isolines(surface, ScalarField(depth), levels=np.array([rim.depth]))
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


def _check(surface: Surface, seed: Seed) -> None:
    """Check that there is a line to run beside.

    Raises:
        UsageError: a piece has none.
    """
    for piece in pieces(surface):
        own = piece.own(seed.curves)
        if not (~own.closed & (np.diff(own.offsets) > 1)).any():
            raise UsageError(
                f"guided rows run beside a line with two ends, but the source on {surface.name} is none: draw one "
                "(`--from curve.csv`, columns x,y,z), or take a part of the rim (`--from between:X,Y,Z:X,Y,Z`)."
            )


def _on_whole(piece: Piece, stroke: Stroke, *, first: int) -> tuple[SurfaceCurves, FloatArray]:
    """Return a stroke on a piece as a curve on the whole, with the row of each of its points."""
    points, _ = closest(piece.surface, stroke.places)
    curve = SurfaceCurves(points, np.array([0, len(stroke.places)]), np.array([stroke.closed]))
    return piece.on_whole(curve), stroke.numbers + first
