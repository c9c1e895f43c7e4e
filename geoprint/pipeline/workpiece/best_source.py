"""The source that covers a part best: each that a patch has is tried through to its evenness, by itself.

Fronts from every rim of a band meet where nothing is planned; from one rim they end at the other. Which is better, and
whether a point in the middle is better still, only the measure says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from geoprint.backends import Piecewise, accuracy, backend
from geoprint.config import Job, Source
from geoprint.errors import FieldError
from geoprint.model import FloatArray, Surface
from geoprint.pipeline.choice import backend_of, with_backend
from geoprint.pipeline.covering import cover, evenness_of
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.workpiece.sources import BORDER, sources_of, united_seed
from geoprint.quality import EVEN_ENOUGH, Covering
from geoprint.results import TriedSource, Workpiece
from geoprint.surfaces import boundary_loops, boundary_seed, middle_of, pieces

# So many loops are tried alone, the longest first: what begins at a small hole covers no better.
MOST_LOOPS = 3
# Sources that miss or cover twice shares of the area that differ by less than this are as good.
SAME_FAULT = 0.001
# Places that a user may type back: to a hundredth of a millimetre.
PLACE_DIGITS = 2


def with_best_sources(job: Job, workpiece: Workpiece, *, backends: Sequence[str]) -> Workpiece:
    """Return a workpiece whose seed is the best one, of the sources that its patches have, where that is asked for.

    Args:
        job: what to plan.
        workpiece: as prepared.
        backends: that shall plan on it; the most accurate of them decides for all.

    Raises:
        FieldError: no source of a patch can be planned from.
    """
    sources = list(sources_of(job, workpiece.surface))
    if not any(source.best for source in sources):
        return workpiece
    job = with_backend(job, max(backends, key=lambda name: accuracy(backend(name))))
    base = None if workpiece.place is None else workpiece.place.base
    tried: list[TriedSource] = []
    parts = pieces(workpiece.part)
    for number, piece in enumerate(pieces(workpiece.surface)):
        if sources[number].best:
            alone = replace(workpiece, surface=piece.surface, part=parts[number].surface)
            sources[number], found = _best(job, alone, patch=number + 1)
            tried += found
    return replace(workpiece, seed=united_seed(workpiece.surface, tuple(sources), base=base), tried=tuple(tried))


def candidates(job: Job, surface: Surface) -> list[Source]:
    """Return the sources that a surface in one piece has: its border, loops of it alone, else a point.

    Of a disc the point is the one farthest from its rim, of a closed surface the two ends of its extent.
    """
    loops = len(boundary_loops(surface))
    if loops > 1:
        return [BORDER, *(Source(loops=[number]) for number in range(1, min(loops, MOST_LOOPS) + 1))]
    if loops == 1:
        depth = Piecewise(surface, backend_of(job)).distance(boundary_seed(surface)).values
        return [BORDER, _point(surface.vertices[int(np.argmax(depth))])]
    along = surface.vertices - middle_of(surface)
    farthest = int(np.argmax(np.linalg.norm(along, axis=1)))
    opposite = int(np.argmin(along @ along[farthest]))
    return [_point(surface.vertices[vertex]) for vertex in (farthest, opposite)]


def _point(place: FloatArray) -> Source:
    return Source(point=[round(value, PLACE_DIGITS) for value in place.tolist()])


def _best(job: Job, workpiece: Workpiece, *, patch: int) -> tuple[Source, list[TriedSource]]:
    """Try the sources of a workpiece in one piece; return the best one, and what was found of each."""
    sources, found, refused = list[Source](), list[TriedSource](), list[FieldError]()
    for source in candidates(job, workpiece.surface):
        seeded = replace(workpiece, seed=united_seed(workpiece.surface, (source,), base=None))
        try:
            paths = cover(job, seeded, Stages(lambda _: None))
            measured = evenness_of(paths)
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
