"""How evenly a toolpath covers a surface, by straight distances between its runs.

For exact level sets of an exact distance, every point of level k is one spacing away from level k - 1. The straight
(chord) distance that is measured here falls short of the one along the surface by about (spacing / radius of
curvature)^2 / 24: 0.03 % for 1 mm on a radius of 12 mm. Nothing of a backend enters.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np

from geoprint.errors import FieldError
from geoprint.model import FloatArray, IntArray, PoseStream, Surface
from geoprint.model.arrays import freeze_arrays
from geoprint.surfaces import PolylineDistance, arc_lengths, even_points, face_areas

# Samples per spacing along each run at which the distance to the run outside is taken.
SAMPLES_PER_SPACING = 4
# Pieces per spacing into which runs are cut to find the nearest one; then the distance to the piece is exact.
PIECES_PER_SPACING = 20
# The covered area is judged at the middles of so many triangles at most, evenly taken: a share is then right to 0.3 %.
COVERAGE_SAMPLES = 100_000
# Surface farther than this share of the spacing from every run counts as uncovered.
UNCOVERED_SHARE = 0.55


@final
@dataclass(frozen=True, slots=True, eq=False)
class Uniformity:
    """How even the spacing is; distances to the neighbouring level outside, over the spacing: 1 is ideal.

    Attributes:
        places: (k, 3) samples along the runs of level 1 and higher, run after run [mm].
        offsets: (r + 1,) samples of run i are `places[offsets[i]:offsets[i + 1]]`.
        ratios: (k,) distance of each sample to the nearest run of the level before, over the spacing.
        uncovered: share of the area farther than 0.55 spacings from every run.
        fill: deposited length times spacing, over the area.
        length: deposited length [mm].
    """

    places: FloatArray
    offsets: IntArray
    ratios: FloatArray
    uncovered: float
    fill: float
    length: float

    def __post_init__(self) -> None:
        freeze_arrays(self, places="float: k 3", offsets="int: o", ratios="float: k")

    @property
    def mean(self) -> float:
        """Mean of the ratios."""
        return float(self.ratios.mean())

    @property
    def cv(self) -> float:
        """Coefficient of variation of the ratios: standard deviation over mean."""
        return float(self.ratios.std() / self.ratios.mean())

    def percentile(self, share: float) -> float:
        """Return a percentile of the ratios, share in percent."""
        return float(np.percentile(self.ratios, share))

    @property
    def within_5_percent(self) -> float:
        """Share of samples within 5 % of the spacing."""
        return float((np.abs(self.ratios - 1.0) <= 0.05).mean())


def uniformity(poses: PoseStream, surface: Surface, *, spacing: float) -> Uniformity:
    """Measure how evenly the deposited runs cover the surface.

    Args:
        poses: the stream; only depositing rows count.
        surface: what it covers, with triangles smaller than the spacing.
        spacing: wanted distance between neighbouring levels [mm].

    Returns:
        The measurement.

    Raises:
        FieldError: there are fewer than two levels, so that there is no spacing to measure.
    """
    runs = _deposited_runs(poses)
    levels = sorted({level for level, _ in runs})
    if len(levels) < 2:
        raise FieldError(
            f"uniformity needs two levels or more, the path has {len(levels)}: choose a spacing smaller than "
            f"{spacing:g} mm."
        )
    lines: list[FloatArray] = []
    ratios: list[FloatArray] = []
    for outer, inner in pairwise(levels):
        sampled = [even_points(line, step=spacing / SAMPLES_PER_SPACING) for level, line in runs if level == inner]
        distance = PolylineDistance([line for level, line in runs if level == outer], step=spacing / PIECES_PER_SPACING)
        lines += sampled
        ratios.append(distance(np.vstack(sampled)) / spacing)
    distance = PolylineDistance([line for _, line in runs], step=spacing / PIECES_PER_SPACING)
    length = float(sum(arc_lengths(line)[-1] for _, line in runs))
    areas = face_areas(surface)
    area = float(areas.sum())
    sampled_faces = slice(None, None, 1 + len(areas) // COVERAGE_SAMPLES)
    areas = areas[sampled_faces]
    far = distance(surface.vertices[surface.faces[sampled_faces]].mean(axis=1)) > UNCOVERED_SHARE * spacing
    return Uniformity(
        places=np.vstack(lines),
        offsets=np.cumsum([0, *(len(line) for line in lines)]),
        ratios=np.concatenate(ratios),
        uncovered=float(areas[far].sum() / areas.sum()),
        fill=length * spacing / area,
        length=length,
    )


def _deposited_runs(poses: PoseStream) -> list[tuple[int, FloatArray]]:
    """Return level and polyline on the surface of every run with two points or more."""
    rows = np.flatnonzero(poses.deposit)
    starts: IntArray = np.flatnonzero(np.diff(poses.runs[rows], prepend=-1))
    points = poses.surface_points[rows]
    pieces = np.split(points, starts[1:])
    return [
        (int(poses.levels[rows[start]]), piece) for start, piece in zip(starts, pieces, strict=True) if len(piece) > 1
    ]
