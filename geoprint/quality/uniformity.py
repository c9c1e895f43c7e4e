"""How evenly a toolpath covers a surface, by exact distances over it.

For exact level sets of an exact distance, every point of level k is one spacing away from level k - 1. The distance is
that of the shortest way over the triangles, from an oracle that belongs to no backend (`quality.oracle`). Paths without
whole levels, such as a spiral, are measured to the left and to the right instead. What the runs cover is measured for
any number of levels; where there is but one, there is no spacing to measure.
"""

from __future__ import annotations

from dataclasses import field
from typing import NamedTuple, final

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray, PoseStream, Surface, freeze_arrays, frozen
from geoprint.quality.apart import Apart, beside, levelled, outwards
from geoprint.quality.coverage import Coverage, coverage
from geoprint.quality.deposited import Samples, at_poses, deposited_path, deposited_rows, levels_at, sampled
from geoprint.quality.oracle import WINDOWS_IN_ALL, FlatMesh, GeodesicDistance, SurfacePath, flat_mesh, spatial
from geoprint.quality.sides import SideSpacing
from geoprint.quality.spacing import SpacingAt, laid_area
from geoprint.quality.spans import Spans, no_spans
from geoprint.surfaces.remesh import refine

# Samples per spacing along each run.
SAMPLES_PER_SPACING = 4
# Triangles are halved down to this many spacings first, so that none holds too many runs to look through.
LARGEST_TRIANGLE = 2.0
# Samples nearer together than this many spacings are one of the worst places.
WORST_APART = 2.0


class LevelSpacing(NamedTuple):
    """The spacing of one level to the one outside.

    Attributes:
        level: its number.
        mean: of the ratios.
        cv: standard deviation over mean.
        worst: the ratio farthest from 1.
    """

    level: int
    mean: float
    cv: float
    worst: float


class WorstPlace(NamedTuple):
    """A place where the spacing is far from wanted.

    Attributes:
        place: x, y, z [mm].
        level: of the run there.
        ratio: distance to the level outside, over the spacing.
    """

    place: tuple[float, float, float]
    level: int
    ratio: float


@final
@frozen
class Uniformity:
    """How even the spacing is; distances to the neighbouring level outside, over the spacing: 1 is ideal.

    Where there is but one level, k is 0 and the figures of the ratios are not a number. Where runs have no whole level,
    ratios are of both sides: first all samples with a neighbour on the left, then all with one on the right.

    Attributes:
        places: (k, 3) samples along the runs of every level but the first, run after run [mm].
        offsets: (r + 1,) samples of stretch i are `places[offsets[i]:offsets[i + 1]]`; a run, or a part of one.
        runs: (k,) run of the stream that each sample lies on.
        levels: (k,) level of each sample.
        ratios: (k,) distance of each sample to the nearest run of the level before, over the spacing.
        bounds: (k,) lower bound of the ratio; equal to it where it is exact.
        straight: (k,) the same ratio through the air; less where the surface bends within a spacing.
        widths: (k,) width of the strip of surface nearest to each sample, over the spacing.
        pose_widths: (p,) that width at every pose of the stream, on the runs of the first level too; 0 on travel.
        width_cv: coefficient of variation of the width along all runs, those of the first level too.
        uncovered: share of the area farther than 0.55 spacings from every run.
        overlap: share of the area within 0.45 spacings of two stretches more than two spacings apart along the path.
        unknown: share of the area for which the budget of work did not suffice; it counts as neither.
        unreached: samples from which no way over the surface to the level outside was found; they are left out above.
        meeting: share of the samples within one spacing of another stretch of their own level, where fronts meet.
        judged_places: (j, 3) places all over the surface [mm].
        gaps: (j,) whether each is uncovered.
        overlaps: (j,) whether each is overlapped.
        fill: deposited length times spacing, over the area.
        length: deposited length [mm].
        spacing: wanted distance between neighbouring levels [mm].
        spans: from where to where the ratios were measured.
        sides: all that is known of the left and the right; None where every run has a level.
    """

    places: FloatArray
    offsets: IntArray
    runs: IntArray
    levels: IntArray
    ratios: FloatArray
    bounds: FloatArray
    straight: FloatArray
    widths: FloatArray
    pose_widths: FloatArray
    width_cv: float
    uncovered: float
    overlap: float
    unknown: float
    unreached: int
    meeting: float
    judged_places: FloatArray
    gaps: BoolArray
    overlaps: BoolArray
    fill: float
    length: float
    spacing: float
    spans: Spans = field(default_factory=no_spans)
    sides: SideSpacing | None = None

    def __post_init__(self) -> None:
        freeze_arrays(
            self, places="float: k 3", offsets="int: o", runs="int: k", levels="int: k", ratios="float: k",
            bounds="float: k", straight="float: k", widths="float: k", pose_widths="float: p",
            judged_places="float: j 3", gaps="bool: j", overlaps="bool: j",
        )  # fmt: skip

    @property
    def spaced(self) -> bool:
        """Whether there is a spacing: two levels or more."""
        return self.ratios.size > 0

    @property
    def mean(self) -> float:
        """Mean of the ratios."""
        return float(self.ratios.mean()) if self.spaced else float("nan")

    @property
    def cv(self) -> float:
        """Coefficient of variation of the ratios: standard deviation over mean."""
        return float(self.ratios.std() / self.ratios.mean()) if self.spaced else float("nan")

    def percentile(self, share: float) -> float:
        """Return a percentile of the ratios, share in percent."""
        return float(np.percentile(self.ratios, share))

    @property
    def within_5_percent(self) -> float:
        """Share of samples within 5 % of the spacing."""
        return float((np.abs(self.ratios - 1.0) <= 0.05).mean()) if self.spaced else float("nan")

    @property
    def bounded(self) -> float:
        """Share of samples whose ratio is not exact but lies between its bound and what is given."""
        return float((self.bounds < self.ratios).mean()) if self.spaced else 0.0

    @property
    def largest_doubt(self) -> float:
        """Largest difference between a ratio and its lower bound."""
        return float((self.ratios - self.bounds).max(initial=0.0))

    @property
    def method(self) -> str:
        """How the spacing was measured."""
        if self.sides is not None:
            return "exact geodesic distance to the nearest other stretch on the left and on the right"
        if not self.spaced:
            return "not measured: there is one level of paths"
        if self.bounded == 0.0:
            return "exact geodesic distance to the level outside"
        return (
            f"geodesic distance to the level outside, exact for {1.0 - self.bounded:.1%} of the samples; the others "
            f"are at most {self.largest_doubt:.2g} spacings too long"
        )

    def by_level(self) -> tuple[LevelSpacing, ...]:
        """Return the spacing of every level to the one outside."""
        found: list[LevelSpacing] = []
        for level in np.unique(self.levels):
            ratios = self.ratios[self.levels == level]
            worst = ratios[np.argmax(np.abs(ratios - 1.0))]
            found.append(
                LevelSpacing(int(level), float(ratios.mean()), float(ratios.std() / ratios.mean()), float(worst))
            )
        return tuple(found)

    def worst(self, count: int) -> tuple[WorstPlace, ...]:
        """Return the places whose ratio is farthest from 1, each at least two spacings from the others."""
        remaining = np.argsort(-np.abs(self.ratios - 1.0), kind="stable")
        found: list[WorstPlace] = []
        while remaining.size and len(found) < count:
            first = remaining[0]
            x, y, z = self.places[first].tolist()
            found.append(WorstPlace((x, y, z), int(self.levels[first]), float(self.ratios[first])))
            away = np.linalg.norm(self.places[remaining] - self.places[first], axis=1)
            remaining = remaining[away > WORST_APART * self.spacing]
        return tuple(found)


def uniformity(
    poses: PoseStream,
    surface: Surface,
    *,
    spacing: float,
    windows: int = WINDOWS_IN_ALL,
    wanted: SpacingAt | None = None,
) -> Uniformity:
    """Measure how evenly the deposited runs cover the surface.

    Args:
        poses: the stream; only depositing rows count.
        surface: what it covers. Only its shape counts: refining it changes nothing but the time.
        spacing: wanted distance between neighbouring levels [mm].
        windows: budget of work for each of the three questions asked (spacing, nearest stretch, second stretch); what
            is left over then is bounded or unknown, and counted as such.
        wanted: what the spacing shall be at each place, where that differs; everything is over that then.

    Raises:
        FieldError: the path lies on another surface.
    """
    fine = refine(surface, edge_length=LARGEST_TRIANGLE * spacing)
    mesh = flat_mesh(fine)
    path = deposited_path(poses, fine, mesh, spacing=spacing)
    distance = GeodesicDistance(mesh, path, windows=windows)
    samples = sampled(path, step=spacing / SAMPLES_PER_SPACING)
    covered = coverage(mesh, path, distance, samples, spacing=spacing, wanted=wanted)
    # Levels are those of a distance, and so one spacing apart.
    if wanted is None and levelled(poses):
        found = outwards(mesh, path, distance, samples, spacing=spacing)
    else:
        found = beside(mesh, path, samples, spacing=spacing, windows=windows, wanted=wanted)
    laid = laid_area(mesh, path, wanted, spacing=spacing)
    return _uniformity(poses, mesh, path, samples, covered=covered, found=found, laid=laid, spacing=spacing)


def _uniformity(
    poses: PoseStream,
    mesh: FlatMesh,
    path: SurfacePath,
    samples: Samples,
    *,
    covered: Coverage,
    found: Apart,
    laid: float,
    spacing: float,
) -> Uniformity:
    """Return what was found of a path that covers so much where it is as wide as is wanted [mm2]."""
    measured = samples.some(found.kept)
    return Uniformity(
        places=spatial(mesh, measured.places),
        offsets=found.offsets,
        runs=np.unique(poses.runs[deposited_rows(poses)])[measured.runs],
        levels=levels_at(poses, path, samples)[found.kept],
        ratios=found.ratios,
        bounds=found.bounds,
        straight=found.straight,
        widths=covered.widths[found.kept],
        pose_widths=at_poses(poses, path, samples, covered.widths),
        width_cv=covered.width_cv,
        uncovered=covered.gap,
        overlap=covered.overlap,
        unknown=covered.unknown,
        unreached=found.unreached,
        meeting=found.meeting,
        judged_places=spatial(mesh, covered.places),
        gaps=covered.gaps,
        overlaps=covered.overlaps,
        fill=laid / covered.area,
        length=float(path.lengths.sum()),
        spacing=spacing,
        spans=found.spans,
        sides=found.sides,
    )
