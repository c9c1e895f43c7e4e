"""The measure for anybody's paths: spacing left and right, gap, overlap and the largest hole, without levels."""

from __future__ import annotations

import time
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, Polylines, Surface, freeze_arrays, frozen
from geoprint.quality.coverage import coverage
from geoprint.quality.deposited import sampled
from geoprint.quality.holes import largest_hole
from geoprint.quality.laying import finely, laid_path
from geoprint.quality.oracle import WINDOWS_IN_ALL, FlatMesh, GeodesicDistance, SurfacePath, flat_mesh, spatial
from geoprint.quality.sides import SideSpacing, side_spacing
from geoprint.quality.spacing import SpacingAt, laid_area
from geoprint.quality.uniformity import LARGEST_TRIANGLE, SAMPLES_PER_SPACING
from geoprint.surfaces import closest
from geoprint.surfaces.remesh import refine

# Paths farther from the surface than this share of the spacing are refused, unless more is allowed.
OFF_SURFACE_SHARE = 0.1


@final
@frozen
class PathMeasure:
    """How evenly paths cover a surface.

    Attributes:
        sides: spacing to the left and to the right.
        runs: how many were measured.
        length: of the paths on the surface [mm].
        area: of the surface [mm2].
        gap: share of it farther than 0.55 spacings from every path.
        overlap: share within 0.45 spacings of two stretches more than two spacings apart along the path.
        unknown: share for which the budget of work did not suffice.
        hole: area of the largest connected gap [mm2].
        fill: length times spacing, over the area.
        off_mean: mean distance of the points of the paths from the surface [mm].
        off_max: largest [mm].
        judged_places: (j, 3) places all over the surface [mm].
        gaps: (j,) whether each is uncovered.
        overlaps: (j,) whether each is overlapped.
        seconds: processor time that it took, all threads together [s].
    """

    sides: SideSpacing
    runs: int
    length: float
    area: float
    gap: float
    overlap: float
    unknown: float
    hole: float
    fill: float
    off_mean: float
    off_max: float
    judged_places: FloatArray
    gaps: BoolArray
    overlaps: BoolArray
    seconds: float

    def __post_init__(self) -> None:
        freeze_arrays(self, judged_places="float: j 3", gaps="bool: j", overlaps="bool: j")

    @property
    def seconds_per_metre(self) -> float:
        """Processor time per metre of path [s]."""
        return self.seconds / (self.length / 1000.0)


def measure_paths(
    surface: Surface,
    curves: Polylines,
    *,
    spacing: float,
    offset_up_to: float | None = None,
    windows: int = WINDOWS_IN_ALL,
    wanted: SpacingAt | None = None,
) -> PathMeasure:
    """Measure how evenly any paths cover a surface: contours, spirals, fibres, toolpaths of others.

    The points are moved to the closest places of the surface; between them a path takes the shortest way over it.

    Args:
        surface: that they cover; left and right are as seen from its outside.
        curves: the deposited paths, in the surface's coordinates.
        spacing: wanted distance between neighbouring paths [mm].
        offset_up_to: how far a point may lie off the surface [mm]; a tenth of the spacing if not given.
        windows: budget of work for each of the questions asked.
        wanted: what the spacing shall be at each place, where that differs; everything is over that then.

    Raises:
        InputError: the spacing is no positive number.
        FieldError: the paths lie farther off, are too short or too many, or cannot be connected over the surface.
    """
    _check_spacing(spacing)
    begun = time.process_time()
    mesh = flat_mesh(fine := refine(surface, edge_length=LARGEST_TRIANGLE * spacing))
    path, off = _laid(fine, mesh, curves, spacing=spacing, offset_up_to=offset_up_to)
    samples = sampled(path, step=spacing / SAMPLES_PER_SPACING)
    distance = GeodesicDistance(mesh, path, windows=windows)
    covered = coverage(mesh, path, distance, samples, spacing=spacing, wanted=wanted)
    sides = side_spacing(mesh, path, samples, spacing=spacing, windows=windows, wanted=wanted)
    return PathMeasure(
        sides=sides,
        runs=int(path.lengths.size),
        length=float(path.lengths.sum()),
        area=covered.area,
        gap=covered.gap,
        overlap=covered.overlap,
        unknown=covered.unknown,
        hole=largest_hole(mesh, covered, spacing=spacing),
        fill=laid_area(mesh, path, wanted, spacing=spacing) / covered.area,
        off_mean=float(off.mean()),
        off_max=float(off.max()),
        judged_places=spatial(mesh, covered.places),
        gaps=covered.gaps,
        overlaps=covered.overlaps,
        seconds=time.process_time() - begun,
    )


def _check_spacing(spacing: float) -> None:
    if not (np.isfinite(spacing) and spacing > 0.0):
        raise InputError(f"the spacing must be a positive number of mm, found {spacing}.")


def _laid(
    fine: Surface, mesh: FlatMesh, curves: Polylines, *, spacing: float, offset_up_to: float | None
) -> tuple[SurfacePath, FloatArray]:
    """Return curves laid onto a surface, and how far their points were off [mm]."""
    cut = finely(curves, spacing=spacing)
    places, off = closest(fine, cut.points)
    allowed = OFF_SURFACE_SHARE * spacing if offset_up_to is None else offset_up_to
    return laid_path(mesh, places, cut, off, spacing=spacing, allowed=allowed), off
