"""Corners of runs: faired, rounded within a tolerance where the tip can drive that, else split."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from geoprint.geometry import PolylineDistance, arc_lengths, closest, positions, whole_steps
from geoprint.model import FloatArray, IntArray, Surface, SurfacePoints
from geoprint.toolpath.lifting import lifting_normals
from geoprint.toolpath.resample import graded
from geoprint.transforms import nearest

# Runs whose tip never turns back: where a line trembles or bends in a few fine steps, samples are left out.
#
# Corners are rounded on the surface, but the tip runs at its stand-off, and a contour may tremble within less than a
# corner's reach. Joints splined through such samples swing out; a chord within what counts as even replaces them.
# Creases in which the stand-off itself would fold are dealt with before, by `lifting`: no sample has to go for them.


# Turns between neighbouring steps above this [rad] are cut: joints splined through fine steps about a sharper one swing
# out so far that no speed holds them.
LARGEST_TURN = np.radians(30.0)
# Above this turn [rad] the line goes back.
BACKTRACK = np.radians(90.0)
# What is cut off is not longer than so many times its largest distance: a small ring stays a ring.
LONGEST_CHORD = 3.0
# Steps shorter than this [mm] have no direction; their row is left out.
SHORTEST = 1e-9


def without_backtracks(
    places: FloatArray, outward: FloatArray, *, closed: bool, standoff: float, error: float
) -> IntArray:
    """Return the samples of one run that are kept so that its tip turns back nowhere and its corners are less sharp.

    Args:
        places: (k, 3) samples of the run on the surface [mm].
        outward: (k, 3) unit normals of the surface there.
        closed: whether the run ends where it starts.
        standoff: height of the tip over the surface [mm].
        error: largest distance of the tip's places that are left out from the chord over them [mm].

    Returns:
        Rising rows; the first and the last always are among them.
    """
    lifted = lifting_normals(places, outward, closed=closed, standoff=standoff)
    return unfolded(places + standoff * lifted, turn=LARGEST_TURN, error=error)


def unfolded(places: FloatArray, *, turn: float, error: float) -> IntArray:
    """Return the rows of a polyline that are kept so that it turns less, wherever leaving rows out makes it so.

    Of neighbouring turns above the angle the sharpest goes first, until none is left that may go: what runs back is
    eaten up from both its ends, a sharp corner is cut by a chord. Only where the line goes back may a row go that
    leaves a turn back beside it.

    Args:
        places: (k, 3) vertices [mm].
        turn: angle between neighbouring steps above which a row may go [rad].
        error: largest distance of a vertex that is left out from the chord over it [mm].

    Returns:
        Rising rows, the first and the last among them.
    """
    rows: IntArray = np.arange(len(places))
    arcs = arc_lengths(places)
    fixed = np.zeros(len(places), dtype=np.bool_)
    fixed[[0, -1]] = True
    while True:
        turns = _turns(places[rows])
        open_turns = np.where(fixed[rows], 0.0, turns)
        sharper = np.maximum(np.append(open_turns[1:], 0.0), np.insert(open_turns[:-1], 0, 0.0))
        sharpest = np.flatnonzero((open_turns > turn) & (open_turns >= sharper))
        if sharpest.size == 0:
            return rows
        going = np.zeros(rows.size, dtype=np.bool_)
        for at in sharpest.tolist():
            if going[at - 1]:
                continue
            before, after = int(rows[at - 1]), int(rows[at + 1])
            left = _turns(places[np.delete(rows[max(at - 2, 0) : at + 3], at - max(at - 2, 0))]).max()
            going[at] = (
                arcs[after] - arcs[before] <= LONGEST_CHORD * error
                and _farthest(places[before + 1 : after], places[before], places[after]) <= error
                and (left < BACKTRACK or turns[at] > BACKTRACK)
            )
            fixed[rows[at]] = not going[at]
        rows = rows[~going]


def _turns(places: FloatArray) -> FloatArray:
    """Return the (k,) angle at each vertex [rad]: 0 at the ends, half a turn where a step has no direction."""
    steps = np.diff(places, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    across = np.linalg.norm(np.cross(steps[:-1], steps[1:]), axis=1)
    turns = np.arctan2(across, np.einsum("ij,ij->i", steps[:-1], steps[1:]))
    turns[np.minimum(lengths[:-1], lengths[1:]) < SHORTEST] = np.pi
    return np.concatenate([[0.0], turns, [0.0]])


def _farthest(places: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return the largest distance of places from a segment [mm]."""
    along = end - start
    shares = (places - start) @ along / max(float(along @ along), SHORTEST**2)
    return float(np.linalg.norm(places - start - np.clip(shares, 0.0, 1.0)[:, None] * along, axis=1).max(initial=0.0))


# Runs faired: a level curve trembles from edge to edge of the mesh it was traced on, and no bead needs that.
#
# Where a distance is interpolated along edges of different directions, its level curve leaves the true one to either
# side by a hundredth of the spacing and more. That costs no evenness, but a controller cannot follow it at speed:
# each of its waves is a bend as tight as a corner. A Gaussian window, applied to what it left out as well, takes
# waves as short as an edge away and keeps bends: it leaves a circle by the fourth power of the window over the third
# of the radius.


# Standard deviation of the window in mean edges of the triangles passed, and its bound as a share of the spacing.
WINDOW_EDGES = 1.0
LARGEST_SHARE = 0.2
# No place is moved by more than this share of the spacing: a corner stays one, and is rounded later.
MOST_MOVED_SHARE = 1.0 / 50.0
# Even samples for each standard deviation of the window, so many on each run at least.
SAMPLES_PER_WINDOW = 2
FEWEST_SAMPLES = 8
# The window ends at so many standard deviations.
WINDOW_END = 4.0


def faired(surface: Surface, runs: list[SurfacePoints], *, closed: list[bool], spacing: float) -> list[SurfacePoints]:
    """Return runs without what they tremble, evenly sampled on the surface.

    Args:
        surface: what the runs lie on.
        runs: points of each; a closed one repeats its first point.
        closed: whether each is.
        spacing: distance between neighbouring runs [mm].

    Returns:
        As many runs; an open one keeps its ends. No place is farther than a 50th of the spacing from its run, but for
        what the surface curves in between.
    """
    if not runs:
        return []
    drawn = [
        _without_tremor(
            positions(surface, points),
            closed=ring,
            window=min(WINDOW_EDGES * _mean_edge(surface, points), LARGEST_SHARE * spacing),
            most=MOST_MOVED_SHARE * spacing,
        )
        for points, ring in zip(runs, closed, strict=True)
    ]
    landed, _ = closest(surface, np.concatenate(drawn))
    ends = np.cumsum([len(places) for places in drawn])[:-1]
    parts = map(SurfacePoints, np.split(landed.faces, ends), np.split(landed.weights, ends))
    return [_with_ends(part, run, closed=ring) for part, run, ring in zip(parts, runs, closed, strict=True)]


def _mean_edge(surface: Surface, points: SurfacePoints) -> float:
    """Return the mean edge of the triangles that points lie on [mm]."""
    corners = surface.vertices[surface.faces[points.faces]]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())


def _without_tremor(places: FloatArray, *, closed: bool, window: float, most: float) -> FloatArray:
    """Return even places along a polyline (k, 3), moved by at most so much to where a window puts them [mm]."""
    arcs = arc_lengths(places)
    length = float(arcs[-1])
    count = max(int(whole_steps(length, step=window / SAMPLES_PER_WINDOW)), FEWEST_SAMPLES)
    deviation = window / length * count
    even: FloatArray = np.linspace(0.0, length, count + 1)
    line = np.column_stack([np.interp(even, arcs, places[:, i]) for i in range(3)])
    once = _windowed(line, deviation, closed=closed)
    moved = 2.0 * once - _windowed(once, deviation, closed=closed) - line
    # Smoothly bounded: a sudden bound would bend the run where it begins.
    far = np.linalg.norm(moved, axis=1, keepdims=True) / most
    return line + moved / (1.0 + far**4) ** 0.25


def _windowed(line: FloatArray, deviation: float, *, closed: bool) -> FloatArray:
    """Return the mean of even places (n, 3) in a Gaussian window of so many samples; the ends of an open line stay."""
    if closed:
        around = gaussian_filter1d(line[:-1], deviation, axis=0, mode="wrap", truncate=WINDOW_END)
        return np.vstack([around, around[:1]])
    reach = min(int(np.ceil(WINDOW_END * deviation)), len(line) - 1)
    # Beyond its ends the line goes on as it came, turned half about them.
    longer = np.vstack([2.0 * line[0] - line[reach:0:-1], line, 2.0 * line[-1] - line[-2 : -2 - reach : -1]])
    return gaussian_filter1d(longer, deviation, axis=0, truncate=WINDOW_END)[reach : reach + len(line)]


def _with_ends(points: SurfacePoints, run: SurfacePoints, *, closed: bool) -> SurfacePoints:
    """Return the points of an open run with its own ends, of a closed one with its first point as the last."""
    ends, last = (points, 0) if closed else (run, -1)
    return SurfacePoints.chained([ends[[0]], points[1:-1], ends[[last]]])


# Corners of runs: rounded within a tolerance where the tip can drive that, else the run is split there.
#
# A bead is never deposited at rest: where a run bends too sharply to be passed at speed, either a curve cuts the corner
# or one run ends there and the next begins. The curve is the moving average of the run about the corner: between
# straight legs a parabola, the very curve in which a controller passes a target with a zone, and where a contour
# trembles about its corner, smooth all the same.


# A run turns at a corner when its direction over this share of the spacing before a sample and after it differs by
# more than the angle [rad].
REACH_SHARE = 0.25
CORNER_ANGLE = np.radians(30.0)
# Turns that differ by less [rad] are equal.
EQUAL_TURN = 1e-4
# Largest distance between a run and the arc that rounds its corner, as a share of the spacing: what is within 5 %
# counts as even, and neighbouring beads cut their corners alike. Fairing has moved the run by up to a 50th before.
FILLET_ERROR_SHARE = 1.0 / 34.0
# An arc reaches at most this share of the spacing along the run to either side.
LARGEST_REACH_SHARE = 0.5
# Samples of an arc over each half of its reach.
ARC_SAMPLES = 12
# An arc is driven where its radius allows this share of the set speed ...
SLOWEST_SHARE = 0.35
# ... at this acceleration of the tip [mm/s2], which an arm of this size has in every direction. What its joints really
# hold is found when the motion is timed.
TIP_ACCELERATION = 1000.0
# Curvature is looked at over this share of an arc's reach.
BEND_SHARE = 1.0 / 6.0
# Arcs are tried from short ones on, as shares of the longest, as long as they leave the run by no more than allowed;
# rounding is allowed for.
REACHES = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
ERROR_ROUNDING = 1.1
# Samples of the run closer than this to the end of an arc are dropped [mm].
CROWDED = 0.01
# Averages over less than this [mm] are the place itself.
SHORTEST_HALF = 1e-6


class RunPiece(NamedTuple):
    """What a run, or a part of it, became.

    Attributes:
        run: index of the run.
        points: its samples.
        closed: whether it ends where it starts.
    """

    run: int
    points: SurfacePoints
    closed: bool


class Rounded(NamedTuple):
    """Runs whose corners are dealt with.

    Attributes:
        pieces: the runs that they became, in order.
        fillets: (f, 3) corners that were rounded [mm].
        splits: (g, 3) corners at which a run was split [mm].
    """

    pieces: list[RunPiece]
    fillets: FloatArray
    splits: FloatArray


def round_corners(
    surface: Surface, runs: list[SurfacePoints], *, closed: list[bool], spacing: float, speed: float
) -> Rounded:
    """Round the corners of runs, or split the runs there.

    An arc starts and ends along the run, at most half a spacing and halfway to the next corner away; it keeps within a
    twentieth of the spacing of the run, and its samples lie on the surface. Where it would be so tight that the tip
    could not keep 35 % of its speed, the run is split. A closed run that is split, or has a corner next to its seam,
    starts and ends at that corner instead. Corners next to the ends of an open run stay: the tip is slow there.

    Args:
        surface: what the runs lie on.
        runs: samples of each; a closed one repeats its first point.
        closed: whether each is.
        spacing: distance between neighbouring runs [mm].
        speed: set speed of the tip [mm/s].

    Returns:
        The runs that they became, in the same order.
    """
    smallest_radius = (SLOWEST_SHARE * speed) ** 2 / TIP_ACCELERATION
    drawn: list[tuple[int, Outline]] = []
    fillets: list[FloatArray] = []
    splits: list[FloatArray] = []
    for run, (points, ring) in enumerate(zip(runs, closed, strict=True)):
        outline = Outline.of(np.arange(points.faces.size), positions(surface, points), ring)
        found = _solved(outline, spacing=spacing, smallest_radius=smallest_radius)
        drawn += [(run, piece) for piece in found.pieces()]
        fillets += [found.outline.at(arc.middle) for arc in found.arcs]
        splits += [found.outline.at(place) for place in found.splits]
    return Rounded(_on_surface(surface, runs, drawn), np.array(fillets).reshape(-1, 3), np.array(splits).reshape(-1, 3))


class Outline(NamedTuple):
    """A run as a polyline.

    Attributes:
        rows: (k,) sample of the run, or -1 where it is a new place.
        places: (k, 3) [mm].
        closed: whether it repeats its first place.
        arcs: (k,) arc length from the start [mm].
    """

    rows: IntArray
    places: FloatArray
    closed: bool
    arcs: FloatArray

    @classmethod
    def of(cls, rows: IntArray, places: FloatArray, closed: bool) -> Outline:  # noqa: FBT001  (a field of it)
        """Return an outline with its arc lengths."""
        return cls(rows, places, closed, arc_lengths(places))

    def at(self, arc: FloatArray | float) -> FloatArray:
        """Return the places at arc lengths [mm]: of an open line not beyond its ends, of a closed one around."""
        inside = np.mod(arc, self.arcs[-1]) if self.closed else arc
        return np.stack([np.interp(inside, self.arcs, self.places[:, i]) for i in range(3)], axis=-1)

    def started_at(self, sample: int) -> Outline:
        """Return a closed outline with another seam."""
        order = np.append(np.roll(np.arange(self.rows.size - 1), -sample), sample)
        return Outline.of(self.rows[order], self.places[order], closed=True)

    def turns(self, reach: float) -> FloatArray:
        """Return the angle at each place [rad] between the chords over a reach [mm] before and after it; 0 at ends."""
        arcs = self.arcs
        before, after = self.places - self.at(arcs - reach), self.at(arcs + reach) - self.places
        turns = angles(before, after)
        return turns if self.closed else np.where((arcs < reach) | (arcs > arcs[-1] - reach), 0.0, turns)


class _Arc(NamedTuple):
    """What replaces an outline from one arc length to another [mm]; (j, 3) places, ends included."""

    start: float
    end: float
    places: FloatArray

    @property
    def middle(self) -> float:
        return 0.5 * (self.start + self.end)


class _Solution(NamedTuple):
    """An outline, the arcs that round its corners, and the arc lengths [mm] at which it is split."""

    outline: Outline
    arcs: list[_Arc]
    splits: list[float]

    def pieces(self) -> list[Outline]:
        """Return the outline with its arcs in place, cut at the splits."""
        arcs = self.outline.arcs
        kept = np.ones(arcs.size, dtype=np.bool_)
        for arc in self.arcs:
            kept &= (arcs < arc.start - CROWDED) | (arcs > arc.end + CROWDED)
        kept[[0, -1]] = True
        order = np.concatenate([arcs[kept], *(np.linspace(arc.start, arc.end, len(arc.places)) for arc in self.arcs)])
        sorting = np.argsort(order, kind="stable")
        rows = np.concatenate([self.outline.rows[kept], *(np.full(len(arc.places), -1) for arc in self.arcs)])[sorting]
        places = np.concatenate([self.outline.places[kept], *(arc.places for arc in self.arcs)])[sorting]
        order = order[sorting]
        if self.arcs:
            added = np.setdiff1d(graded(order), order)
            between = np.searchsorted(order, added)
            rows, places = np.insert(rows, between, -1), np.insert(places, between, self.outline.at(added), axis=0)
            order = np.insert(order, between, added)
        cuts = [0, *np.searchsorted(order, self.splits).tolist(), rows.size - 1]
        closed = self.outline.closed and not self.splits
        return [Outline.of(rows[a : b + 1], places[a : b + 1], closed) for a, b in pairwise(cuts)]


def _solved(outline: Outline, *, spacing: float, smallest_radius: float) -> _Solution:
    if outline.closed:
        outline = _started_at_near_corner(outline, spacing=spacing)
    solution = _attempt(outline, spacing=spacing, smallest_radius=smallest_radius)
    if not (outline.closed and solution.splits):
        return solution
    first = int(np.searchsorted(outline.arcs, solution.splits[0]))
    return _attempt(outline.started_at(first), spacing=spacing, smallest_radius=smallest_radius)


def _started_at_near_corner(outline: Outline, *, spacing: float) -> Outline:
    """Move the seam of a closed outline to the sharpest corner next to it, so that no arc has to cross it."""
    arcs, turns = outline.arcs, outline.turns(REACH_SHARE * spacing)
    to_seam = np.minimum(arcs, arcs[-1] - arcs)
    near = np.where(to_seam < LARGEST_REACH_SHARE * spacing, turns, 0.0)[:-1]
    if near.max() <= CORNER_ANGLE:
        return outline
    equal = np.flatnonzero(near >= near.max() - EQUAL_TURN)
    return outline.started_at(int(equal[nearest(to_seam[equal], outline.places[equal])]))


def _attempt(outline: Outline, *, spacing: float, smallest_radius: float) -> _Solution:
    """Round or split at every corner between the ends."""
    arcs, reach = outline.arcs, REACH_SHARE * spacing
    turns = outline.turns(reach)
    inside = (arcs > reach) & (arcs < arcs[-1] - reach)
    corners = peaks(np.where(inside, turns, 0.0), arcs, above=CORNER_ANGLE, apart=reach)
    places = arcs[corners]
    middles = 0.5 * (places[1:] + places[:-1])
    lows, highs = np.append([0.0], middles), np.append(middles, arcs[-1])
    solution = _Solution(outline, [], [])
    for corner, low, high in zip(corners, lows, highs, strict=False):
        place = float(arcs[corner])
        arc = _fillet(
            outline, place, turn=float(turns[corner]), spacing=spacing, smallest_radius=smallest_radius,
            room=min(place - float(low), float(high) - place),
        )  # fmt: skip
        if arc is None:
            solution.splits.append(place)
        else:
            solution.arcs.append(arc)
    return solution


def peaks(turns: FloatArray, arcs: FloatArray, *, above: float, apart: float) -> IntArray:
    """Return the samples at which an outline turns most, of those that turn by more than an angle [rad], in order."""
    found: list[int] = []
    waiting = turns > above
    while waiting.any():
        # Of what turns alike side by side the middle is the corner, whatever rounding does.
        equal = np.flatnonzero(waiting & (turns >= turns[waiting].max() - EQUAL_TURN))
        beside = equal[arcs[equal] < arcs[equal[0]] + apart]
        found.append(int(beside[beside.size // 2]))
        waiting &= np.abs(arcs - arcs[found[-1]]) >= apart
    return np.array(sorted(found), dtype=np.int64)


def _fillet(
    outline: Outline, corner: float, *, turn: float, spacing: float, smallest_radius: float, room: float
) -> _Arc | None:
    """Return the arc that rounds a corner at an arc length [mm], or None where it would be too tight.

    The average over h to either side leaves a corner of turn t by h sin(t / 2) / 2. Towards the ends of the arc, 2 h
    away, the average is taken over less and less, so that it ends on the run.
    """
    error = FILLET_ERROR_SHARE * spacing
    # Arcs that would meet, or begin where the run does, leave a place between them.
    room = min(room, LARGEST_REACH_SHARE * spacing) - 2.0 * CROWDED
    half = min(2.0 * error / float(np.sin(turn / 2.0)), room / 2.0)
    near: list[tuple[_Arc, float]] = []
    for arc, share in zip(_arcs(outline, corner, halves=half * np.array(REACHES)), REACHES, strict=True):
        cut = outline.places[(outline.arcs > arc.start) & (outline.arcs < arc.end)]
        if PolylineDistance([arc.places], step=spacing)(cut).max(initial=0.0) > ERROR_ROUNDING * error:
            break
        near.append((arc, BEND_SHARE * 2.0 * share * half))
    wide = (arc for arc, reach in reversed(near) if _smallest_radius(arc.places, reach=reach) >= smallest_radius)
    return next(wide, None)


def _arcs(outline: Outline, corner: float, *, halves: FloatArray) -> list[_Arc]:
    """Return the arcs about a corner at an arc length [mm] that are the averages over (h,) lengths to either side."""
    shares = np.linspace(-1.0, 1.0, 2 * ARC_SAMPLES + 1)
    at = corner + 2.0 * halves[:, None] * shares
    places = _averaged(outline, at, halves[:, None] * np.minimum(2.0 * (1.0 - np.abs(shares)), 1.0))
    return [_Arc(float(arc[0]), float(arc[-1]), each) for arc, each in zip(at, places, strict=True)]


def _averaged(outline: Outline, at: FloatArray, halves: FloatArray) -> FloatArray:
    """Return (h, j, 3) mean places of an outline within (h, j) lengths to either side of (h, j) arc lengths [mm]."""
    arcs, places = outline.arcs, outline.places
    areas = np.concatenate(
        [np.zeros((1, 3)), np.cumsum(np.diff(arcs)[:, None] * (places[1:] + places[:-1]) / 2, axis=0)]
    )

    def area(ends: FloatArray) -> FloatArray:
        row = np.clip(np.searchsorted(arcs, ends, side="right") - 1, 0, arcs.size - 2)
        return areas[row] + (ends - arcs[row])[:, None] * (places[row] + outline.at(ends)) / 2.0

    wide = halves > SHORTEST_HALF
    ends = np.clip(np.stack([at - halves, at + halves]), 0.0, arcs[-1])
    means = outline.at(at)
    means[wide] = (area(ends[1][wide]) - area(ends[0][wide])) / (ends[1] - ends[0])[wide][:, None]
    return means


def _smallest_radius(places: FloatArray, *, reach: float) -> float:
    """Return the smallest radius of a polyline's bends, each looked at over a reach to either side [mm]."""
    line = Outline.of(np.arange(len(places)), places, closed=False)
    inner = line.arcs[(line.arcs > reach) & (line.arcs < line.arcs[-1] - reach)]
    before, at, after = line.at(inner - reach), line.at(inner), line.at(inner + reach)
    return float((reach / np.maximum(angles(at - before, after - at), 1e-9)).min(initial=np.inf))


def angles(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the (k,) angles between (k, 3) vectors [rad]."""
    across = np.linalg.norm(np.cross(first, second), axis=1)
    return np.arctan2(across, np.einsum("ij,ij->i", first, second))


def _on_surface(surface: Surface, runs: list[SurfacePoints], drawn: list[tuple[int, Outline]]) -> list[RunPiece]:
    """Return the pieces as points on the surface: those of their runs, the new ones projected."""
    added = [outline.places[outline.rows < 0] for _, outline in drawn]
    landed, _ = closest(surface, np.concatenate(added)) if any(len(places) for places in added) else (None, None)
    begin = 0
    pieces: list[RunPiece] = []
    for (run, outline), places in zip(drawn, added, strict=True):
        new = outline.rows < 0
        faces, weights = runs[run].faces[outline.rows].copy(), runs[run].weights[outline.rows].copy()
        if landed is not None:
            faces[new], weights[new] = (
                landed.faces[begin : begin + len(places)],
                landed.weights[begin : begin + len(places)],
            )
        begin += len(places)
        pieces.append(RunPiece(run, SurfacePoints(faces, weights), outline.closed))
    return pieces
