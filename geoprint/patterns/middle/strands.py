"""Level curves as strands: samples a quarter of a spacing apart that know which side is inwards."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model import BoolArray, Contours, FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.surfaces import arc_lengths, normals, positions

# Distance of samples over the spacing, and fewest samples of a strand.
STEP_SHARE = 0.25
FEWEST_SAMPLES = 4


@final
@frozen
class Strands:
    """Level curves sampled evenly, one strand a curve.

    Attributes:
        places: (k, 3) samples, strand after strand; of a closed one the first is not repeated [mm].
        normals: (k, 3) outward unit normals of the surface.
        inward: (k, 3) unit vectors on the surface, square to the strand, towards larger distance.
        arcs: (k,) arc length from the start of the strand [mm].
        strand: (k,) which strand a sample lies on.
        levels: (k,) level of the strand.
        offsets: (c + 1,) strand i has the samples from `offsets[i]` to before `offsets[i + 1]`.
        closed: (c,) whether each is closed.
        lengths: (c,) of each [mm].
        spacing: of the levels [mm].
    """

    places: FloatArray
    normals: FloatArray
    inward: FloatArray
    arcs: FloatArray
    strand: IntArray
    levels: IntArray
    offsets: IntArray
    closed: BoolArray
    lengths: FloatArray
    spacing: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self, places="float: k 3", normals="float: k 3", inward="float: k 3", arcs="float: k", strand="int: k",
            levels="int: k", offsets="int: o", closed="bool: c", lengths="float: c",
        )  # fmt: skip

    @property
    def count(self) -> int:
        """Number of strands c."""
        return int(self.closed.size)

    def rows(self, strand: int) -> slice:
        """Return the rows of a strand's samples."""
        return slice(int(self.offsets[strand]), int(self.offsets[strand + 1]))

    def further(self, rows: IntArray, steps: int) -> IntArray:
        """Return the rows so many samples further along their strands; at the ends of an open one it ends."""
        strand = self.strand[rows]
        first, size = self.offsets[strand], np.diff(self.offsets)[strand]
        place = rows - first + steps
        return first + np.where(self.closed[strand], place % size, np.clip(place, 0, size - 1))


def strands_of(surface: Surface, contours: Contours) -> Strands:
    """Sample level curves.

    Args:
        surface: what they lie on.
        contours: c curves.

    Returns:
        As many strands.
    """
    places, outward = positions(surface, contours.curves.points), normals(surface, contours.curves.points)
    parts = list[tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]]()
    for number in range(contours.curves.count):
        held = slice(*contours.curves.offsets[number : number + 2])
        closed = bool(contours.curves.closed[number])
        parts.append(_sampled(places[held], outward[held], closed=closed, step=STEP_SHARE * contours.spacing))
    sizes = [len(part[0]) for part in parts]
    return Strands(
        places=np.concatenate([part[0] for part in parts]),
        normals=np.concatenate([part[1] for part in parts]),
        inward=np.concatenate([part[2] for part in parts]),
        arcs=np.concatenate([part[3] for part in parts]),
        strand=np.repeat(np.arange(len(parts)), sizes),
        levels=np.repeat(contours.levels, sizes),
        offsets=np.concatenate([[0], np.cumsum(sizes)]),
        closed=contours.curves.closed,
        lengths=np.array([part[4] for part in parts]),
        spacing=contours.spacing,
    )


def _sampled(
    line: FloatArray, outward: FloatArray, *, closed: bool, step: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """Return places, normals, inward directions and arcs of even samples along a polyline (n, 3), and its length."""
    arcs = arc_lengths(line)
    length = float(arcs[-1])
    count = max(int(np.ceil(length / step)), FEWEST_SAMPLES)
    even: FloatArray = np.linspace(0.0, length, count + 1)[: count if closed else count + 1]
    places, up = interpolated(even, arcs, line), _unit(interpolated(even, arcs, outward))
    before, behind = (np.roll(places, 1, axis=0), np.roll(places, -1, axis=0)) if closed else _ends_repeated(places)
    return places, up, _unit(np.cross(up, behind - before)), even, length


def interpolated(at: FloatArray, arcs: FloatArray, values: FloatArray) -> FloatArray:
    """Return vectors (n, 3) that are linear along an arc, at (k,) places of it."""
    return np.column_stack([np.interp(at, arcs, values[:, axis]) for axis in range(3)])


def _ends_repeated(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.vstack([places[:1], places[:-1]]), np.vstack([places[1:], places[-1:]])


def _unit(vectors: FloatArray) -> FloatArray:
    """Return vectors (k, 3) of length 1; those of no length stay."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
