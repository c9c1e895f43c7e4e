"""A band flattened along a cut whose sides are tied by a rigid motion, and its level curves joined across the cut."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias, final

import numpy as np
from scipy.sparse import coo_array, csc_array

from geoprint.distance.distortion import signed_areas
from geoprint.distance.lscm_chart import PinnedMap, conformal_chart, conformal_energy, refuse_overlaps, turning_pull
from geoprint.distance.segment_distance import point_distances
from geoprint.distance.sparse_solver import ComplexArray, SymmetricSolver, nested_dissection
from geoprint.errors import FieldError, how_many
from geoprint.geometry import (
    arc_lengths,
    boundary_loops,
    connected_nodes,
    cotangent_laplacian,
    describe,
    face_areas,
    half_edges,
    shortest_edge_path,
    twins,
)
from geoprint.geometry.halfedges import next_halves
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen

# How a chart goes on beyond a cut: moved copies of itself, one on each side, and distances that do not see the cut.
#
# A point of a band is nearest to the image of a source that is at most half a round away. So each half of a chart
# needs the copy at its own side of the cut alone, and of that copy the half behind the cut. Nothing else is
# compared: once a chart turns far enough, other parts of its copies lie on top of it without being near it on the
# surface.


@final
@frozen
class Continuation:
    """The two sides of a cut in the plane, and the motion that carries the right one into the left one.

    Attributes:
        left: (s, 2) corners of the cut, the chart on their left [mm]; none where a chart is not cut.
        right: (s, 2) the same places of the surface on the other side, the chart on their right [mm].
        turn: angle of the motion [rad]: 2 pi for a plane ring, 0 for a cylinder.
        shift: (2,) its translation [mm], after the turn about the origin.
    """

    left: FloatArray
    right: FloatArray
    turn: float
    shift: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, left="float: s 2", right="float: s 2", shift="float: 2")

    @property
    def rounds(self) -> tuple[int, ...]:
        """The copies that continue the chart: 1 at the left side of the cut, -1 at the right; none without a cut."""
        return (1, -1) if len(self.left) else ()

    @property
    def sides(self) -> FloatArray:
        """The (2 s - 2, 2, 2) segments of both sides [mm]."""
        return np.concatenate([np.stack([side[:-1], side[1:]], axis=1) for side in (self.left, self.right)])

    def moved(self, points: FloatArray, *, rounds: int) -> FloatArray:
        """Carry places of the chart round the band.

        One round forward lays the right side of the cut on the left one, so that a moved chart continues this one
        there; one round back continues it on the right side.

        Args:
            points: (..., 2) places [mm].
            rounds: how often, counter-clockwise along the longest loop; negative for clockwise.

        Returns:
            (..., 2) places [mm].
        """
        z = points[..., 0] + 1j * points[..., 1]
        step, shift = np.exp(1j * self.turn), complex(*self.shift)
        for _ in range(abs(rounds)):
            z = step * z + shift if rounds > 0 else (z - shift) / step
        return np.stack([z.real, z.imag], axis=-1)

    @property
    def extremes(self) -> FloatArray:
        """The (2, 2, 2) pairs of left and right corners that bound where half a round from the cut is [mm].

        What is half a round from a corner is as far from its place on the left as from that on the right: a straight
        line through the centre of the motion, or across its shift. Half a round on from the middle of the cut these
        lines are compared; where the cut is not straight they differ.
        """
        half = np.exp(0.5j * self.turn)
        middle, shift = complex(*self.right.mean(axis=0)), complex(*self.shift)
        opposite = half * middle + shift / (1.0 + half)
        across = self.left - self.right
        places = np.array([opposite.real, opposite.imag]) - 0.5 * (self.left + self.right)
        beyond = (places * across).sum(axis=1) / np.linalg.norm(across, axis=1)
        corners = [int(np.argmin(beyond)), int(np.argmax(beyond))]
        return np.stack([self.left[corners], self.right[corners]], axis=1)

    def beside(self, x: FloatArray, y: FloatArray, *, rounds: int) -> BoolArray:
        """Tell which places [mm] can be nearer to something across a side of the cut than to all within the chart.

        They are the half of the chart at the side that a copy continues; where the cut is not straight, the halves
        overlap so that none is too small from any of its corners.
        """
        found = np.zeros(np.broadcast_shapes(x.shape, y.shape), dtype=np.bool_)
        for left, right in self.extremes:
            (across, up), (middle_x, middle_y) = left - right, 0.5 * (left + right)
            found |= ((x - middle_x) * across + (y - middle_y) * up) * rounds > 0.0
        return found

    def beyond(self, segments: FloatArray, *, rounds: int) -> FloatArray:
        """Return the (b, 2, 2) images in a copy of those segments [mm] that are within half a round of the cut."""
        behind = self.beside(segments[..., 0], segments[..., 1], rounds=-rounds).any(axis=1)
        return self.moved(segments[behind], rounds=rounds)

    def nearest_images(self, points: FloatArray, *, to: FloatArray) -> FloatArray:
        """Return, of each of (k, 2) places and its images in the copies, the one nearest to another place [mm]."""
        images = np.stack([points, *(self.moved(points, rounds=rounds) for rounds in self.rounds)])
        nearest = np.argmin(((images - to) ** 2).sum(axis=2), axis=0)
        return np.asarray(images[nearest, np.arange(len(points))])

    def distances(self, segments: FloatArray, points: FloatArray) -> FloatArray:
        """Return the (k,) straight distances of (k, 2) places of the chart to (s, 2, 2) segments and their images."""
        found = point_distances(segments, points)
        for rounds in self.rounds:
            images = self.beyond(segments, rounds=rounds)
            here = np.flatnonzero(self.beside(points[:, 0], points[:, 1], rounds=rounds))
            if len(images) and here.size:
                found[here] = np.minimum(found[here], point_distances(images, points[here]))
        return found


# Of a chart that was not cut.
UNCUT = Continuation(np.empty((0, 2)), np.empty((0, 2)), 0.0, np.zeros(2))


@final
@frozen
class Chart:
    """A surface in the plane, and how it goes on where it was cut to lie there.

    Attributes:
        flat: the m faces of the surface in their order, counter-clockwise, z = 0 [mm]; on its n vertices, and behind
            them, where it was cut, copies of those along the cut.
        continuation: beyond the cut; `UNCUT` where there is none.
    """

    flat: Surface
    continuation: Continuation


# A band flattened along a cut whose two sides are tied by a rigid motion: lengths without a visible seam.
#
# Uncut, a band becomes a ring in the plane, and its lengths grow exponentially across it. Cut, it can keep them: a
# cylinder becomes a rectangle, a cone frustum a sector. Chart lengths agree on both sides of the cut, so that
# whatever is measured in the chart and its moved copies does not know where the cut runs.


# Bands that turn by more are nearly plane rings [rad]: uncut their charts are hardly worse. From 4 / 3 pi on the copy
# at one side of the cut would come round to the half of the chart at that side; what is left is for crooked cuts.
LARGEST_TURN = 1.25 * np.pi


def flattened(surface: Surface) -> Chart:
    """Flatten a surface by the map that comes nearest to keeping angles, cut where it is a band.

    A band is an annulus that turns by no more than `LARGEST_TURN`; the cut is the shortest path between its loops. All
    else is left uncut, as `conformal_chart`.

    Args:
        surface: what `conformal_chart` takes.

    Returns:
        The chart, scaled so that its area is the surface's.

    Raises:
        FieldError: as `conformal_chart`; or the system of a band is singular.
    """
    if describe(surface) == "annulus":
        loops = boundary_loops(surface)
        turn = flat_turn(surface, loops)
        if abs(turn) <= LARGEST_TURN:
            return flattened_band(surface, seam=shortest_edge_path(surface, *loops), turn=turn)
    return Chart(conformal_chart(surface), UNCUT)


def flattened_band(surface: Surface, *, seam: IntArray, turn: float) -> Chart:
    """Flatten an annulus along a given cut with a given turn.

    The copies on the right of the cut are no unknowns but the images of their originals, turned back and moved by one
    more unknown. The longest loop is asked to advance along a line that turns evenly by the turn.

    Args:
        surface: an annulus of n vertices.
        seam: (s,) vertices along edges from the longest loop to the other, none in between on a loop.
        turn: angle from the right side of the cut to the left, once round [rad].

    Returns:
        The chart; vertex n + i of it is the copy of seam[i] on the right side of the cut.

    Raises:
        FieldError: the chart overlaps itself, or the system is singular.
    """
    count, copies = len(surface.vertices), len(surface.vertices) + np.arange(seam.size)
    cut = _cut_along(surface, seam)
    rows = np.concatenate([np.arange(count), copies, copies])
    columns = np.concatenate([np.arange(count), seam, np.full(seam.size, count)])
    entries = np.concatenate([np.ones(count), np.full(seam.size, np.exp(-1j * turn)), np.ones(seam.size)])
    tied = csc_array(coo_array((entries, (rows, columns)), shape=(count + seam.size, count + 1)))
    border = boundary_loops(cut)
    energy = csc_array(tied.conj().T @ conformal_energy(cut, border) @ tied)
    # Once round the longest loop: from the copy on the right of the cut to its original on the left.
    longest = boundary_loops(surface)[0]
    longest = np.roll(longest, -int(np.argmax(longest == seam[0])))
    line = np.concatenate([copies[:1], longest[1:], seam[:1]])
    lengths = np.linalg.norm(np.diff(cut.vertices[line], axis=0), axis=1)
    pull = turning_pull(line[:-1], line[1:], lengths=lengths, turn=turn, unknowns=count + seam.size)
    coordinates = np.vstack([surface.vertices, surface.vertices[seam].mean(axis=0)])
    solved = PinnedMap(energy, coordinates=coordinates, pins=np.array([seam[0], longest[longest.size // 2]]))
    unknowns = solved.pulled(np.asarray(tied.conj().T @ pull))
    image: ComplexArray = np.asarray(tied @ unknowns, dtype=np.complex128)
    flat = np.column_stack([image.real, image.imag])
    refuse_overlaps(cut, flat, border)
    scale = float(np.sqrt(face_areas(surface).sum() / signed_areas(flat, cut.faces).sum()))
    shift = -scale * np.exp(1j * turn) * unknowns[-1]
    flat = scale * flat
    chart = Surface(np.column_stack([flat, np.zeros(len(flat))]), cut.faces, name=surface.name)
    return Chart(chart, Continuation(flat[seam], flat[copies], turn, np.array([shift.real, shift.imag])))


def flat_turn(surface: Surface, loops: tuple[IntArray, ...]) -> float:
    """Return by how much the first loop of an annulus turns once the surface is flat [rad].

    On the surface the loops turn by angles that differ by its curvature, which flattening moves onto them. Logarithms
    of the scale of two conformal maps to flat surfaces differ by a harmonic function; the one that is zero on the
    border has the least Dirichlet energy of them all, because its gradient is orthogonal to those of harmonic
    functions. In that sense the scale varies least where the border keeps its lengths. Then the curvature of a place
    goes to the first loop by its harmonic measure there: the function that is 1 on that loop, 0 on the other and
    harmonic in between.
    """
    count = len(surface.vertices)
    share, straight = np.zeros(count), np.full(count, 2 * np.pi)
    share[loops[0]] = 1.0
    straight[np.concatenate(loops)] = np.pi
    free = np.flatnonzero(straight > np.pi)
    if free.size:
        rows = cotangent_laplacian(surface)[free]
        inner = csc_array(rows[:, free])
        solver = SymmetricSolver(inner, order=nested_dissection(inner, coordinates=surface.vertices[free]))
        share[free] = solver.solve(-np.asarray(rows @ share))
    corners = surface.vertices[surface.faces]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    doubled = 2.0 * face_areas(surface)[:, None]
    angles = np.arctan2(doubled, np.einsum("mcx,mcx->mc", ahead, back))
    around = np.bincount(surface.faces.ravel(), angles.ravel(), minlength=count)
    return float(share @ (straight - around))


def _cut_along(surface: Surface, seam: IntArray) -> Surface:
    """Return the surface with copies of the seam's vertices, in order, for the faces on its right.

    Corners of faces are joined across every edge that is not cut; what stays together is one vertex.
    """
    count = len(surface.vertices)
    halves, other = half_edges(surface.faces), twins(surface.faces)
    keys = halves @ np.array([count, 1])
    left, right = seam[:-1] * count + seam[1:], seam[1:] * count + seam[:-1]
    whole = np.flatnonzero((other >= 0) & ~np.isin(keys, np.concatenate([left, right])))
    # The end of a half-edge is the corner at which its twin starts.
    after = next_halves(whole)
    size = len(keys)
    corner_class = connected_nodes(after, other[whole], nodes=size)
    # The face of a half-edge that runs back along the seam lies on its right.
    order = np.argsort(keys)
    back = order[np.searchsorted(keys, right, sorter=order)]
    starts, ends = back, next_halves(back)
    copied = corner_class[np.concatenate([ends[:1], starts])]
    number = np.full(size, -1, dtype=np.int64)
    number[copied] = count + np.arange(seam.size)
    copy = number[corner_class]
    faces = np.where(copy >= 0, copy, surface.faces.ravel()).reshape(-1, 3)
    return Surface(np.vstack([surface.vertices, surface.vertices[seam]]), faces, name=surface.name)


# Level curves of a chart that was cut, put together again across the cut so that they close on the surface.
#
# Curves are traced a little beyond both sides of the cut, kept where they lie in the chart, and joined there. The
# two sides are traced on pixels that do not match, so that the ends on them differ by a fraction of a pixel, and a
# curve that only just touches the cut may cross it on one side and not on the other. So no end is asked for its
# partner across the cut: along the cut, ends of stretches are matched with beginnings of stretches, on whichever
# side, such that the sum of the gaps is least. A curve that crosses finds itself again on the other side; one that
# crosses out and back on one side alone closes its own little gap. In both cases larger values stay on its left.


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
            f"{how_many(lost.size, 'level curve')} end at the cut of the UV map, the first {lost[0]:.3g} mm along it, "
            f"with no continuation within {largest_gap:.3g} mm. Choose another spacing, or use `--backend heat`.",
            count=int(lost.size),
        )
    return dict(zip(ended.tolist(), begun.tolist(), strict=True))


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])
