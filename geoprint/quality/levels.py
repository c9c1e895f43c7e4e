"""How far each level of paths lies from the level outside it, over the surface.

For exact level sets of an exact distance every point of level k is one spacing away from level k - 1. A run that goes
through several levels, as a spiral does and rows joined by turns, has no level as a whole.
"""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np

from geoprint.model import FloatArray, IntArray, PoseStream, freeze_arrays, frozen
from geoprint.quality.deposited import Samples, deposited_rows
from geoprint.quality.oracle import FlatMesh, GeodesicDistance, SurfacePath, spatial
from geoprint.quality.spacing import SpacingFigures, meeting_share, outer_distance

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
class LevelSpacings:
    """Distances to the level outside, over the spacing: 1 is ideal. With a single level k is 0, and they are NaN.

    Attributes:
        places: (k, 3) samples along the runs of every level but the first, run after run [mm].
        offsets: (r + 1,) samples of stretch i are `places[offsets[i]:offsets[i + 1]]`; a run, or a part of one.
        runs: (k,) run of the stream that each sample lies on.
        levels: (k,) level of each sample.
        ratios: (k,) distance of each sample to the nearest run of the level before, over the spacing.
        bounds: (k,) lower bound of the ratio; equal to it where it is exact.
        straight: (k,) the same ratio through the air; less where the surface bends within a spacing.
        unreached: samples from which no way over the surface to the level outside was found; they are left out above.
        meeting: share of the samples within one spacing of another stretch of their own level, where fronts meet.
        spacing: wanted [mm].
    """

    places: FloatArray
    offsets: IntArray
    runs: IntArray
    levels: IntArray
    ratios: FloatArray
    bounds: FloatArray
    straight: FloatArray
    unreached: int
    meeting: float
    spacing: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, places="float: k 3", offsets="int: o", runs="int: k", levels="int: k", ratios="float: k",
            bounds="float: k", straight="float: k",
        )  # fmt: skip

    @property
    def figures(self) -> SpacingFigures:
        """Mean, variation and percentiles of the ratios."""
        return SpacingFigures(self.ratios)

    @property
    def bounded(self) -> float:
        """Share of samples whose ratio is not exact but lies between its bound and what is given."""
        return float((self.bounds < self.ratios).mean()) if self.ratios.size else 0.0

    @property
    def largest_doubt(self) -> float:
        """Largest difference between a ratio and its lower bound."""
        return float((self.ratios - self.bounds).max(initial=0.0))

    def by_level(self) -> tuple[LevelSpacing, ...]:
        """Return the spacing of every level to the one outside."""
        found: list[LevelSpacing] = []
        for level in np.unique(self.levels):
            here = SpacingFigures(self.ratios[self.levels == level])
            worst = here.ratios[np.argmax(np.abs(here.ratios - 1.0))]
            found.append(LevelSpacing(int(level), here.mean, here.cv, float(worst)))
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


def levelled(poses: PoseStream) -> bool:
    """Return whether every deposited run of a stream keeps to one level."""
    rows = deposited_rows(poses)
    runs, levels = poses.runs[rows], poses.levels[rows]
    return bool((np.diff(levels)[np.diff(runs) == 0] == 0).all())


def level_spacings(
    mesh: FlatMesh, path: SurfacePath, distance: GeodesicDistance, samples: Samples, *, runs: IntArray, spacing: float
) -> LevelSpacings:
    """Measure from every level but the first to the one outside.

    Args:
        mesh: m triangles.
        path: r runs on it, each of one level.
        distance: to the path.
        samples: along all of its runs.
        runs: (r,) what they are called.
        spacing: wanted [mm].
    """
    chosen = samples.some(np.flatnonzero(path.levels[samples.runs] > path.levels.min()))
    outer = outer_distance(mesh, path, distance, chosen, spacing=spacing)
    reached = np.isfinite(outer.distances)
    measured = chosen.some(reached)
    return LevelSpacings(
        places=spatial(mesh, measured.places),
        offsets=np.append(np.flatnonzero(np.diff(measured.runs, prepend=-1)), measured.runs.size),
        runs=runs[measured.runs],
        levels=path.levels[measured.runs],
        ratios=outer.distances[reached] / spacing,
        bounds=outer.bounds[reached] / spacing,
        straight=outer.straight[reached] / spacing,
        unreached=int((~reached).sum()),
        meeting=meeting_share(path, distance, measured, spacing=spacing),
        spacing=spacing,
    )
