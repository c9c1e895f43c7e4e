"""The interface of a distance backend, the levels of contours, and how near a field is to a true distance."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Any, Protocol, final, runtime_checkable

import numpy as np

from geoprint.errors import FieldError, UsageError
from geoprint.geometry import face_areas, gradient
from geoprint.model import (
    BoolArray,
    Contours,
    FloatArray,
    IntArray,
    ScalarField,
    Source,
    Surface,
    comparable,
    freeze_arrays,
    frozen,
)

# Where level curves lie, and how short edges must be to follow them: the same rules for every backend.


# A distance that is linear in each triangle follows a curved front to a per cent of a spacing.
EDGES_PER_SPACING = 4


def level_distances(field: ScalarField, *, spacing: float) -> FloatArray:
    """Return the (l,) distances (k + 1/2) * spacing below the largest distance of the field [mm].

    Raises:
        UsageError: the spacing is not positive.
        FieldError: no level fits.
    """
    if not 0.0 < spacing < np.inf:
        raise UsageError(f"spacing is {spacing} mm; it must be positive, for example `--spacing 1.0`.")
    count = int(np.ceil(field.maximum / spacing - 0.5))
    if count < 1:
        raise FieldError(
            f"spacing is {spacing:g} mm, but the surface ends {field.maximum:.3g} mm from the source: choose a "
            f"spacing below {2 * field.maximum:.3g} mm."
        )
    return (np.arange(count, dtype=np.float64) + 0.5) * spacing


def linear_edge_length(*, spacing: float) -> float:
    """Return the edge length [mm] at which linear triangles follow level curves a spacing [mm] apart.

    Examples:
        >>> linear_edge_length(spacing=2.0)
        0.5
    """
    return spacing / EDGES_PER_SPACING


# The interface that every planning backend answers to, and that of what builds one.
#
# What a backend says of itself stands on its class, and nobody else knows its name:
#
# - `title`: a few words beside its name; - `summary`: one sentence; its title where it is not stated; - `accuracy`:
# how near its distances come to those over the surface; `Accuracy.UNSTATED` where it is not stated; - `compared`:
# whether `geoprint compare` plans with it unless it is told otherwise; else not; - options: the keyword-only
# arguments of its constructor, such as `resolution`.


class Backend(Protocol):
    """Covers a surface with curves a constant distance apart; built once per surface, asked many times."""

    def distance(self, source: Source) -> ScalarField:
        """Return the distance from the source at the vertices of the surface [mm], zero on it, never negative."""
        ...

    def contours(self, source: Source, *, spacing: float) -> Contours:
        """Return the level curves at (k + 1/2) * spacing from the source, k = 0, 1, ... [mm]."""
        ...


class BackendFactory(Protocol):
    """Builds a backend on a surface; says before how finely a part must be cut for it. A backend's class is one."""

    @property
    def title(self) -> str:
        """What it is, in a few words."""
        ...

    def __call__(self, surface: Surface, /, *_: Any, **options: Any) -> Backend:
        """Return the backend on a surface, with some of its options; the others have their defaults."""
        ...

    def edge_length(self, part: Surface, /, *, spacing: float) -> float:
        """Return how long the edges of a part may be for even curves at a spacing [mm]; finer ones do no harm."""
        ...


class Accuracy(IntEnum):
    """How near the distances of a backend come to the shortest ways over the triangles of any surface."""

    UNSTATED = 0
    # As near as a chart in the plane is true to length.
    CHART = 1
    # The error falls with the edges of the triangles.
    EDGE_LENGTH = 2
    # A few thousandths of an edge.
    NEARLY_EXACT = 3


@final
@frozen
class ChartImage:
    """The image of a distance in a chart, in square pixels; that of (row, column) is at origin + pixel * (column, row).

    Attributes:
        inside: (r, c) whether a pixel's centre lies in the chart.
        distances: (r, c) from the source at the centres [mm].
        origin: (2,) centre of the first pixel [mm].
        pixel: side of a pixel [mm].
    """

    inside: BoolArray
    distances: FloatArray
    origin: FloatArray
    pixel: float

    def __post_init__(self) -> None:
        freeze_arrays(self, inside="bool: r c", distances="float: r c", origin="float: 2")


@final
@frozen
class Shown:
    """What a backend that works in the plane can show of it: its chart of a surface, and its raster.

    Attributes:
        flat: the surface flattened: the same faces in their order, counter-clockwise, z = 0 [mm].
        mapped: by what it was flattened, in words.
        resolution: pixels along the longer side of the chart.
        pixel: side of a pixel in the chart [mm].
        largest_pixel: side of the largest pixel lifted to the surface [mm].
        image: returns the distance from a source with so many pixels along the longer side.
        jumps: returns the indices of (k, 2) places [mm] along a curve at which its image goes on across a cut.
    """

    flat: Surface
    mapped: str
    resolution: int
    pixel: float
    largest_pixel: float
    image: Callable[[Source, int], ChartImage]
    jumps: Callable[[FloatArray], IntArray]


@runtime_checkable
class Showing(Protocol):
    """A backend that can show how it works."""

    def shown(self, *, spacing: float) -> Shown:
        """Return what its contours at a spacing [mm] are made with."""
        ...


# How near a distance field is to a true distance: its slope should be 1 everywhere but on the cut locus.


# Triangles with a smaller slope lie over the cut locus, where fronts meet and the slope breaks.
CUT_LOCUS_SLOPE = 0.9


@final
@comparable
class Diagnostics:
    """The slope of a field, weighted by area.

    Attributes:
        mean_slope_error: mean of | |grad d| - 1 | away from the cut locus.
        p95_slope_error: its 95th percentile there.
        cut_locus_share: share of the area in triangles over the cut locus.
    """

    mean_slope_error: float
    p95_slope_error: float
    cut_locus_share: float


def diagnostics(surface: Surface, field: ScalarField) -> Diagnostics:
    """Measure the slope of a distance field in every triangle.

    Args:
        surface: n vertices.
        field: (n,) distances [mm].

    Returns:
        The measurement; where everything lies over the cut locus the slope errors are those of all triangles.
    """
    slopes = np.sqrt((gradient(surface, field.values) ** 2).sum(axis=1))
    areas = face_areas(surface)
    away = slopes >= CUT_LOCUS_SLOPE
    judged = away if away.any() else ~away
    errors, weights = np.abs(slopes - 1.0)[judged], areas[judged]
    order = np.argsort(errors)
    below = int((np.cumsum(weights[order]) < 0.95 * weights.sum()).sum())
    return Diagnostics(
        mean_slope_error=float(errors @ weights / weights.sum()),
        p95_slope_error=float(errors[order][min(below, errors.size - 1)]),
        cut_locus_share=float(areas[~away].sum() / areas.sum()),
    )
