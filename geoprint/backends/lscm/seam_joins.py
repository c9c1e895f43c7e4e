"""Level curves of a chart that was cut, put together again across the cut so that they close on the surface.

Curves are traced a little beyond both sides of the cut, kept where they lie in the chart, and joined there. The two
sides are traced on pixels that do not match, so that the ends on them differ by a fraction of a pixel, and a curve
that only just touches the cut may cross it on one side and not on the other. So no end is asked for its partner across
the cut: along the cut, ends of stretches are matched with beginnings of stretches, on whichever side, such that the sum
of the gaps is least. A curve that crosses finds itself again on the other side; one that crosses out and back on one
side alone closes its own little gap. In both cases larger values stay on its left.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias, final

import numpy as np

from geoprint.backends.lscm.continuation import Continuation
from geoprint.backends.lscm.segment_distance import point_distances
from geoprint.errors import FieldError
from geoprint.model import BoolArray, FloatArray, frozen
from geoprint.surfaces import arc_lengths

# Pixels from the cut within which curves are looked at: what is traced beyond it lies nearer.
NEAR_PIXELS = 4.0
# Pixels of the cut between two ends that can be one place: where the cut runs nearly along a curve, the error of the
# raster across it is many times as long on the cut.
LARGEST_GAP_PIXELS = 16.0

Holds: TypeAlias = Callable[[FloatArray], BoolArray]


@final
@frozen
class ChartStretch:
    """A stretch of a level curve in a chart.

    Attributes:
        nodes: (k, 2) corners [mm], those on the cut included.
        start: where on the cut it begins, as arc length from its first corner [mm]; infinite where it does not.
        end: where on the cut it ends, likewise.
    """

    nodes: FloatArray
    start: float
    end: float

    @property
    def middle(self) -> FloatArray:
        """The (2,) middle of its middle segment [mm]."""
        half = len(self.nodes) // 2
        return np.asarray(self.nodes[half - 1 : half + 1].mean(axis=0))

    @property
    def length(self) -> float:
        """Its length [mm]."""
        return float(np.linalg.norm(np.diff(self.nodes, axis=0), axis=1).sum())


def joined(
    levels: list[list[FloatArray]], continuation: Continuation, *, holds: Holds, pixel: float
) -> list[list[FloatArray]]:
    """Keep the stretches of level curves that lie in a chart, and join those of each level across its cut.

    Args:
        levels: of each level the (k, 2) polylines [mm], larger values on the left; a closed one repeats its first
            point.
        continuation: the cut; without any, the lines come back as they are.
        holds: tells which of (k, 2) places lie in the chart.
        pixel: of the raster [mm].

    Returns:
        The polylines [mm] of each level; where they cross the cut they have one node on its left side, and the next
        one lies at the other side of the chart. Those that touch the cut and are shorter than a pixel are left out.

    Raises:
        FieldError: a curve has no continuation across the cut, and no border near by at which it could have ended.
    """
    if not continuation.rounds:
        return levels
    near = NEAR_PIXELS * pixel
    cut = [[stretch for line in lines for stretch in _stretches(line, continuation, near=near)] for lines in levels]
    # The middle of a stretch is farthest from its ends, where it is in the chart and beyond it.
    kept = iter(holds(np.array([stretch.middle for stretches in cut for stretch in stretches]).reshape(-1, 2)).tolist())
    inside = [[stretch for stretch in stretches if next(kept)] for stretches in cut]
    return [_chained(stretches, continuation, pixel=pixel) for stretches in inside]


def _stretches(line: FloatArray, continuation: Continuation, *, near: float) -> list[ChartStretch]:
    """Cut a line at both sides of the cut."""
    close = point_distances(continuation.sides, line) <= near
    if not close.any():
        return [ChartStretch(line, np.inf, np.inf)]
    sides = (continuation.left, continuation.right)
    crossings = np.vstack([_crossings(line, side, close=close) for side in sides])
    crossings = crossings[np.argsort(crossings[:, 0], kind="stable")]
    places = np.concatenate([[-np.inf], crossings[:, 0], [np.inf]])
    on_cut = np.concatenate([[np.inf], crossings[:, 1], [np.inf]])
    corners = [line[:0], *crossings[:, None, 2:], line[:0]]
    index = np.arange(len(line))
    stretches = [
        ChartStretch(
            np.vstack([corners[i], line[(index > places[i]) & (index < places[i + 1])], corners[i + 1]]),
            float(on_cut[i]),
            float(on_cut[i + 1]),
        )
        for i in range(len(places) - 1)
    ]
    if len(stretches) > 1 and bool((line[0] == line[-1]).all()):
        first, last = stretches[0], stretches.pop()
        stretches[0] = ChartStretch(np.vstack([last.nodes[:-1], first.nodes]), last.start, first.end)
    return [stretch for stretch in stretches if len(stretch.nodes) > 1]


def _crossings(line: FloatArray, side: FloatArray, *, close: BoolArray) -> FloatArray:
    """Return where a line crosses a side of the cut.

    A corner on the other polyline counts as on its left, so that no crossing through a corner is missed or doubled.

    Returns:
        (c, 4): node of the line and share of the line to the next, arc length along the side [mm], x and y [mm].
    """
    nodes = np.flatnonzero(close[:-1] | close[1:])
    start, step, along = line[nodes, None], np.diff(line, axis=0)[nodes, None], np.diff(side, axis=0)
    corners = _cross(step, side - start)
    before, after = _cross(along, start - side[:-1]), _cross(along, line[nodes + 1, None] - side[:-1])
    crossed = ((corners[:, :-1] >= 0.0) != (corners[:, 1:] >= 0.0)) & ((before >= 0.0) != (after >= 0.0))
    i, j = np.nonzero(crossed)
    share = before[i, j] / (before[i, j] - after[i, j])
    ahead = corners[i, j] / (corners[i, j] - corners[i, j + 1])
    lengths = arc_lengths(side)
    arcs = lengths[j] + ahead * np.diff(lengths)[j]
    return np.column_stack([nodes[i] + share, arcs, side[j] + ahead[:, None] * along[j]])


def _chained(stretches: list[ChartStretch], continuation: Continuation, *, pixel: float) -> list[FloatArray]:
    """Join the ends of stretches on the cut with beginnings on it, and follow them round."""
    lengths = arc_lengths(continuation.left)
    following = _following(stretches, largest_gap=LARGEST_GAP_PIXELS * pixel, whole=float(lengths[-1]))
    free = set(range(len(stretches)))
    chains: list[FloatArray] = []
    for first in sorted(free - set(following.values())) + list(range(len(stretches))):
        if first not in free:
            continue
        parts, length, here = list[FloatArray](), 0.0, first
        while here in free:
            free.remove(here)
            stretch = stretches[here]
            length += stretch.length
            # The corner at which the stretch before it ended is the place of both.
            parts.append(stretch.nodes[1:] if parts else stretch.nodes)
            if here not in following:
                break
            here = following[here]
            arc = 0.5 * (stretch.end + stretches[here].start)
            node = [np.interp(arc, lengths, continuation.left[:, axis]) for axis in range(2)]
            parts[-1] = np.vstack([parts[-1][:-1], node])
        else:
            parts[0] = np.vstack([parts[-1][-1:], parts[0][1:]])
        if length >= pixel:
            chains.append(np.vstack(parts))
    return chains


def _following(stretches: list[ChartStretch], *, largest_gap: float, whole: float) -> dict[int, int]:
    """Return, for stretches that end on the cut, the stretch that begins there.

    Args:
        stretches: of one level.
        largest_gap: between an end and a beginning along the cut [mm].
        whole: length of the cut [mm].

    Raises:
        FieldError: an end or a beginning is left over that is farther from the border than that.
    """
    from scipy.optimize import linear_sum_assignment

    ends, starts = np.array([stretch.end for stretch in stretches]), np.array([stretch.start for stretch in stretches])
    ending, starting = np.flatnonzero(np.isfinite(ends)), np.flatnonzero(np.isfinite(starts))
    gaps = np.minimum(np.abs(ends[ending, None] - starts[starting]), largest_gap)
    rows, columns = linear_sum_assignment(gaps)
    near = gaps[rows, columns] < largest_gap
    ended, begun = ending[rows[near]], starting[columns[near]]
    alone = np.concatenate([ends[np.setdiff1d(ending, ended)], starts[np.setdiff1d(starting, begun)]])
    lost = alone[np.minimum(alone, whole - alone) > largest_gap]
    if lost.size:
        raise FieldError(
            f"{lost.size} level curves end at the cut of the chart, the first {lost[0]:.3g} mm along it, and none goes "
            f"on there within {largest_gap:.3g} mm: choose another spacing, or use `--backend heat`.",
            count=int(lost.size),
        )
    return dict(zip(ended.tolist(), begun.tolist(), strict=True))


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])
