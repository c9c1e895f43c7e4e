"""From what a job says of its source to a seed on the refined surface, each patch by itself."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from geoprint.config import Job, Source
from geoprint.errors import FieldError, naming
from geoprint.model import FloatArray, Seed, Surface, SurfaceCurves
from geoprint.pipeline.workpiece.sections import section_seed
from geoprint.quality.oracle import shortest_way
from geoprint.surfaces import (
    all_curves,
    boundary_loops,
    boundary_seed,
    closest,
    in_words,
    loop_seed,
    middle_of,
    nearest_loop,
    part_seed,
    pieces,
    point_seed,
    with_vertex,
)

# A place may miss the surface by this [mm]: what is read off a screen is rounded.
SOURCE_TOLERANCE = 1.0
BORDER = Source(border=True)


def sources_of(job: Job, surface: Surface) -> tuple[Source, ...]:
    """Return the source of each piece of a surface: what its patch states, else what the job does, else the border.

    The angle of a layer's own pattern counts more than either.
    """
    own = job.drawing.angle_deg is not None
    stated = [None if own else patch.source for patch in job.patches] or [None]
    every = stated * len(pieces(surface)) if len(stated) == 1 else stated
    return tuple(each or job.counted_from or BORDER for each in every)


def seed_of(job: Job, surface: Surface, *, base: Surface | None = None) -> Seed:
    """Return where distance is zero on a surface; for the best source, which is yet to be found, its border or a point.

    Args:
        job: its sources.
        surface: in one piece, or a piece for each patch of the job.
        base: of a layer, the part that the lowest one lies on: an angle is counted on it; else on each piece itself.

    Raises:
        FieldError: the surface has no such source, or a place lies off it; of several patches it says which.
    """
    return united_seed(surface, sources_of(job, surface), base=base)


def united_seed(surface: Surface, sources: tuple[Source, ...], *, base: Surface | None) -> Seed:
    """Return the seed of a surface from the source of each of its pieces; the base is as of `seed_of`.

    Raises:
        FieldError: as `seed_of`.
    """
    found: list[SurfaceCurves] = []
    for number, (piece, source) in enumerate(zip(pieces(surface), sources, strict=True), start=1):
        with naming(f"patch {number}, about {in_words(middle_of(piece.surface))}" if len(sources) > 1 else ""):
            found.append(piece.on_whole(_seed(source, piece.surface, base=base or piece.surface).curves))
    return Seed(all_curves(found))


def _seed(source: Source, surface: Surface, *, base: Surface) -> Seed:
    """Return the seed of a surface in one piece."""
    if source.point is not None or (source.best and not boundary_loops(surface)):
        place = surface.vertices[0] if source.point is None else np.array(source.point)
        return point_seed(surface, place, tolerance=SOURCE_TOLERANCE)
    if source.angle is not None:
        return section_seed(surface, angle_deg=source.angle, base=base)
    if source.curve is not None:
        return curve_seed(surface, np.array(source.curve))
    if source.loops is not None or source.near is not None:
        near = [nearest_loop(surface, np.array(place)) for place in source.near or []]
        return loop_seed(surface, source.loops or near)
    if source.between is not None:
        first, *middle, last = np.array(source.between)
        return part_seed(surface, first, last, through=middle[0] if middle else None)
    return boundary_seed(surface)


def curve_seed(surface: Surface, points: FloatArray) -> Seed:
    """Return a drawn curve: points on a surface, joined by shortest lines over its triangles.

    Args:
        surface: in one piece.
        points: (k, 3) in order [mm]; the curve is closed where the last repeats the first.

    Raises:
        FieldError: fewer than two different points, one lies off the surface, or no line between two can be found.
    """
    landed, distances = closest(surface, points)
    farthest = int(np.argmax(distances))
    if distances[farthest] > SOURCE_TOLERANCE:
        raise FieldError(
            f"point {farthest + 1} of the source, {in_words(points[farthest])}, lies {distances[farthest]:.3g} mm off "
            f"{surface.name}, at most {SOURCE_TOLERANCE:g} mm is allowed.",
            distance=float(distances[farthest]),
        )
    drawn, corners = surface, list[int]()
    for point in points:
        drawn, vertex = with_vertex(drawn, point)
        if not corners or corners[-1] != vertex:
            corners.append(vertex)
    if len(corners) < 2:
        raise FieldError(
            f"the source on {surface.name} needs two different points or more; one is `--from point:X,Y,Z`."
        )
    lines = [shortest_way(drawn, first, last).places(drawn) for first, last in pairwise(corners)]
    places = np.concatenate([lines[0], *(line[1:] for line in lines[1:])])
    landed, _ = closest(surface, places)
    closed = corners[0] == corners[-1]
    return Seed(SurfaceCurves(landed, np.array([0, len(places)]), np.array([closed])))
