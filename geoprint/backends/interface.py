"""The interface that every planning backend answers to, and that of what builds one.

What a backend says of itself stands on its class, and nobody else knows its name:

- `title`: a few words beside its name;
- `summary`: one sentence; its title where it is not stated;
- `accuracy`: how near its distances come to those over the surface; `Accuracy.UNSTATED` where it is not stated;
- `compared`: whether `geoprint compare` plans with it unless it is told otherwise; else not;
- options: the keyword-only arguments of its constructor, such as `resolution`.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Any, Protocol, final, runtime_checkable

from geoprint.model import BoolArray, Contours, FloatArray, IntArray, ScalarField, Seed, Surface, freeze_arrays, frozen


class Backend(Protocol):
    """Covers a surface with curves a constant distance apart; built once per surface, asked many times."""

    def distance(self, seed: Seed) -> ScalarField:
        """Return the distance from the seed at the vertices of the surface [mm], zero at the seed, never negative."""
        ...

    def contours(self, seed: Seed, *, spacing: float) -> Contours:
        """Return the level curves at (k + 1/2) * spacing from the seed, k = 0, 1, ... [mm]."""
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
        distances: (r, c) from the seed at the centres [mm].
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
        flat: the surface laid flat: the same faces in their order, counter-clockwise, z = 0 [mm].
        mapped: by what it was laid flat, in words.
        resolution: pixels along the longer side of the chart.
        pixel: side of a pixel in the chart [mm].
        largest_pixel: side of the largest pixel lifted to the surface [mm].
        image: returns the distance from a seed with so many pixels along the longer side.
        jumps: returns the indices of (k, 2) places [mm] along a curve at which its image goes on across a cut.
    """

    flat: Surface
    mapped: str
    resolution: int
    pixel: float
    largest_pixel: float
    image: Callable[[Seed, int], ChartImage]
    jumps: Callable[[FloatArray], IntArray]


@runtime_checkable
class Showing(Protocol):
    """A backend that can show how it works."""

    def shown(self, *, spacing: float) -> Shown:
        """Return what its contours at a spacing [mm] are made with."""
        ...
