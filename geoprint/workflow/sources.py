"""The source that paths are counted from: what a job says of it, a section of the part, or the best of several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from geoprint.config import Job, SourceTable
from geoprint.distance import Piecewise, accuracy, backend, isolines
from geoprint.errors import FieldError, naming
from geoprint.geometry import (
    all_curves,
    boundary_loops,
    boundary_source,
    closest,
    direction_across,
    face_areas,
    in_words,
    loop_source,
    mean_normal,
    middle_of,
    nearest_loop,
    on_surface,
    part_source,
    pieces,
    point_source,
    positions,
    with_vertex,
)
from geoprint.metrics import EVEN_ENOUGH, Covering
from geoprint.metrics.oracle import shortest_way
from geoprint.model import BoolArray, FloatArray, ScalarField, Source, Surface, SurfaceCurves
from geoprint.results import TriedSource, Workpiece
from geoprint.workflow.backend_choice import backend_of, with_backend
from geoprint.workflow.covering import cover, evenness_of, measured_surface, shared_surface
from geoprint.workflow.stages import Stages

# A line over a part at an angle, for rows to run beside: the section of the part by an upright plane.


# A vertex this near to the plane [mm] lies in it, and points of a section this near to each other are one: rounding of
# coordinates up to some metres is less.
IN_PLANE = 1e-9


def section_source(surface: Surface, *, angle_deg: float, base: Surface) -> Source:
    """Return the line over a surface at an angle: straight as it is seen along the mean normal.

    It is the section by the plane that holds the mean normal of the base, the direction at the angle across it
    (`direction_across`) and the middle of the base's area; exact in each triangle. Where that misses the surface, as it
    may one piece of several in a layer, a parallel plane goes through the middle of the surface's own area, which it
    never misses. All pieces of the section count: beside a hole or a bay a part has several, and rows run beside each.

    Args:
        surface: in one piece.
        angle_deg: counter-clockwise seen from outside, from the x axis as it is seen along the mean normal [degrees].
        base: that says where and how the plane stands: the surface itself, or of a layer the part that the lowest one
            lies on, so that layers with the same angle lie over each other, and those with others cross them.

    Raises:
        FieldError: the base has no mean normal, as a closed part, whose normals cancel.
    """
    if not mean_normal(base).any():
        raise FieldError(
            f"the normals of {base.name} cancel, as on a closed part, so an angle has no meaning. Draw the line "
            "(`--from curve.csv`, columns x,y,z), or cut out the printed part."
        )
    square = direction_across(base, angle=np.radians(angle_deg + 90.0))
    curves = _section(surface, _area_middle(base), square)
    if curves.count == 0:
        curves = _section(surface, _area_middle(surface), square)
    return Source(curves)


def _section(surface: Surface, middle: FloatArray, square: FloatArray) -> SurfaceCurves:
    """Return the section by the plane through a place, square to a direction, without parts of no length."""
    heights = (surface.vertices - middle) @ square
    heights[np.abs(heights) < IN_PLANE] = 0.0
    curves, _ = isolines(surface, ScalarField(heights), levels=np.zeros(1))
    places = positions(surface, curves.points)
    kept = [begin + np.flatnonzero(_moves(places[begin:end])) for begin, end in pairwise(curves.offsets.tolist())]
    lines = [index for index, rows in enumerate(kept) if rows.size > 1]
    rows = np.concatenate([np.zeros(0, dtype=np.int64), *(kept[line] for line in lines)])
    return SurfaceCurves(
        curves.points[rows],
        np.concatenate([[0], np.cumsum([kept[line].size for line in lines], dtype=np.int64)]),
        curves.closed[lines],
    )


def _moves(places: FloatArray) -> BoolArray:
    """Return which of (k, 3) places of a curve are another than the one before; the first is."""
    return np.append([True], np.linalg.norm(np.diff(places, axis=0), axis=1) > IN_PLANE)


def _area_middle(surface: Surface) -> FloatArray:
    """Return the (3,) middle of the area of a surface [mm]."""
    areas = face_areas(surface)
    return areas @ surface.vertices[surface.faces].mean(axis=1) / areas.sum()


# From what a job says of its source to a source on the refined surface, each patch by itself.


BORDER = SourceTable(border=True)


def sources_of(job: Job) -> tuple[SourceTable, ...]:
    """Return the source of each patch of a job: what it states, else what the job does, else the border.

    The angle of a layer's own pattern counts more than either. Where there is one, all pieces of a surface have it.
    """
    own = job.drawing.angle_deg is not None
    stated = [None if own else patch.source for patch in job.patches] or [None]
    return tuple(each or job.counted_from or BORDER for each in stated)


def source_of(job: Job, surface: Surface, *, base: Surface | None = None) -> Source:
    """Return where distance is zero on a surface; for the best source, which is yet to be found, its border or a point.

    Args:
        job: its sources.
        surface: in one piece, or a piece for each patch of the job.
        base: of a layer, the part that the lowest one lies on: an angle is counted on it; else on each piece itself.

    Raises:
        FieldError: the surface has no such source, or a place lies off it; of several patches it says which.
    """
    return united_source(surface, sources_of(job), base=base)


def united_source(surface: Surface, sources: tuple[SourceTable, ...], *, base: Surface | None) -> Source:
    """Return the source of a surface from the source of each of its pieces, or one for all; the base as `source_of`.

    Raises:
        FieldError: as `source_of`.
    """
    found: list[SurfaceCurves] = []
    parts = pieces(surface)
    sources = sources * len(parts) if len(sources) == 1 else sources
    for number, (piece, source) in enumerate(zip(parts, sources, strict=True), start=1):
        with naming(f"patch {number}, about {in_words(middle_of(piece.surface))}" if len(sources) > 1 else ""):
            found.append(piece.on_whole(_source(source, piece.surface, base=base or piece.surface).curves))
    return Source(all_curves(found))


def _source(source: SourceTable, surface: Surface, *, base: Surface) -> Source:
    """Return the source of a surface in one piece."""
    if source.point is not None or (source.best and not boundary_loops(surface)):
        place = surface.vertices[0] if source.point is None else np.array(source.point)
        return point_source(surface, place)
    if source.angle is not None:
        return section_source(surface, angle_deg=source.angle, base=base)
    if source.curve is not None:
        return curve_source(surface, np.array(source.curve))
    if source.loops is not None or source.near is not None:
        near = [nearest_loop(surface, np.array(place)) for place in source.near or []]
        return loop_source(surface, source.loops or near)
    if source.between is not None:
        first, *middle, last = np.array(source.between)
        return part_source(surface, first, last, through=middle[0] if middle else None)
    return boundary_source(surface)


def curve_source(surface: Surface, points: FloatArray) -> Source:
    """Return a drawn curve: points on a surface, joined by shortest lines over its triangles.

    Args:
        surface: in one piece.
        points: (k, 3) in order [mm]; the curve is closed where the last repeats the first.

    Raises:
        FieldError: fewer than two different points, one lies off the surface, or no line between two can be found.
    """
    on_surface(surface, points, what="point {} of the source")
    drawn, corners = surface, list[int]()
    for point in points:
        drawn, vertex = with_vertex(drawn, point)
        if not corners or corners[-1] != vertex:
            corners.append(vertex)
    if len(corners) < 2:
        raise FieldError(
            f"the source on {surface.name} needs two or more different points; for one, give `--from point:X,Y,Z`."
        )
    lines = [shortest_way(drawn, first, last).places(drawn) for first, last in pairwise(corners)]
    places = np.concatenate([lines[0], *(line[1:] for line in lines[1:])])
    landed, _ = closest(surface, places)
    closed = corners[0] == corners[-1]
    return Source(SurfaceCurves(landed, np.array([0, len(places)]), np.array([closed])))


# The source that covers a part best: each that a patch has is tried through to its evenness, by itself.
#
# Fronts from every rim of a band meet where nothing is planned; from one rim they end at the other. Which is better,
# and whether a point in the middle is better still, only the measure says.


# So many loops are tried alone, the longest first: what begins at a small hole covers no better.
MOST_LOOPS = 3
# Sources that miss or cover twice shares of the area that differ by less than this are as good.
SAME_FAULT = 0.001
# Places that a user may type back: to a hundredth of a millimetre.
PLACE_DIGITS = 2


def with_best_sources(job: Job, workpiece: Workpiece, *, backends: Sequence[str]) -> Workpiece:
    """Return a workpiece whose source is the best one, of the sources that its patches have, where that is asked for.

    Args:
        job: what to plan.
        workpiece: as prepared.
        backends: that shall plan on it; the most accurate of them decides for all.

    Raises:
        FieldError: no source of a patch can be planned from.
    """
    if not any(source.best for source in sources_of(job)):
        return workpiece
    alone = pieces(workpiece.surface)
    sources = list(sources_of(job))
    sources = sources * len(alone) if len(sources) == 1 else sources
    job = with_backend(job, max(backends, key=lambda name: accuracy(backend(name))))
    base = None if workpiece.place is None else workpiece.place.base
    tried: list[TriedSource] = []
    parts = pieces(workpiece.part)
    for number, piece in enumerate(alone):
        if sources[number].best:
            one = replace(workpiece, surface=piece.surface, part=parts[number].surface)
            sources[number], found = _best(job, one, patch=number + 1)
            tried += found
    return replace(workpiece, source=united_source(workpiece.surface, tuple(sources), base=base), tried=tuple(tried))


def candidates(job: Job, surface: Surface) -> list[SourceTable]:
    """Return the sources that a surface in one piece has: its border, loops of it alone, else a point.

    Of a disc the point is the one farthest from its rim, of a closed surface the two ends of its extent.
    """
    loops = len(boundary_loops(surface))
    if loops > 1:
        return [BORDER, *(SourceTable(loops=[number]) for number in range(1, min(loops, MOST_LOOPS) + 1))]
    if loops == 1:
        depth = Piecewise(surface, backend_of(job)).distance(boundary_source(surface)).values
        return [BORDER, _point(surface.vertices[int(np.argmax(depth))])]
    along = surface.vertices - middle_of(surface)
    farthest = int(np.argmax(np.linalg.norm(along, axis=1)))
    opposite = int(np.argmin(along @ along[farthest]))
    return [_point(surface.vertices[vertex]) for vertex in (farthest, opposite)]


def _point(place: FloatArray) -> SourceTable:
    return SourceTable(point=[round(value, PLACE_DIGITS) for value in place.tolist()])


def _best(job: Job, workpiece: Workpiece, *, patch: int) -> tuple[SourceTable, list[TriedSource]]:
    """Try the sources of a workpiece in one piece; return the best one, and what was found of each."""
    sources, found, refused = list[SourceTable](), list[TriedSource](), list[FieldError]()
    on = shared_surface(job, workpiece)
    for source in candidates(job, workpiece.surface):
        seeded = replace(workpiece, source=united_source(workpiece.surface, (source,), base=None))
        try:
            paths = cover(job, seeded, Stages(lambda _: None))
            measured = evenness_of(paths, on or measured_surface(workpiece, spacing=paths.contours.spacing))
        except FieldError as error:
            refused.append(error)
            continue
        runs = paths.toolpath.curves.count
        sources.append(source)
        found.append(
            TriedSource(patch, str(source), measured.gap, measured.overlap, measured.thickness.cv, runs, taken=False)
        )
    if not found:
        raise refused[0]
    taken = preferred(found)
    found[taken] = replace(found[taken], taken=True)
    return sources[taken], found


def preferred(tried: Sequence[TriedSource]) -> int:
    """Return the index of what covers most once; of those nearly as good, and even, that with fewest runs."""
    coverings = [Covering(each.gap, each.overlap, each.cv) for each in tried]
    covering = [each for each in coverings if each.covers] or coverings
    least = min(each.fault for each in covering)
    alike = [index for index, each in enumerate(coverings) if each in covering and each.fault <= least + SAME_FAULT]
    even = max(EVEN_ENOUGH, min(coverings[index].cv for index in alike))
    return min((index for index in alike if coverings[index].cv <= even), key=lambda index: tried[index].runs)
