"""The chain of targets of a whole path, with targets outside of the bends that are too tight for straight moves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice, product
from typing import final

import numpy as np

from geoprint.model import BoolArray, FloatArray, IntArray
from geoprint.motion.controller.choice import TIME_ROUNDING, Weighed, cheapest_chain, chord_shares, weighed
from geoprint.motion.controller.fitting import COINCIDENT, fitted_places, rounded_deviations, zones_of

# Where straight moves come too soon, a move may leave the path by so many tolerances, as far as the rounded corners at
# its ends make up for it; so many moves about the one that comes too soon. What they do not make up for is halved.
WIDEST = 8.0
ABOUT = 3
ROUNDS = 8

# How far a pose may be turned from the move past it where that has a target beside the path [rad]: more than where
# targets stand on it, and less than what the timed path may be off in all.
MOST_TURNED = float(np.radians(0.15))

# Where that is not enough, targets are tried at even times: so many periods apart, begun at so many shares of that.
EVEN_PERIODS = (1.25, 1.0, 1.1, 1.45, 0.9, 1.7, 0.8, 0.95, 1.15, 0.85, 0.75, 0.7, 0.65, 0.61)
EVEN_BEGINS = (0.0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875)
EVEN_FURTHER = 3
# So many of these are tried in a bend, and only where moves are shorter than the least time once not more than this
# share of the moves comes too soon.
MOST_PATTERNS = 300
# Targets to either side with which a stretch is looked at.
CONTEXT = 8
FEW_SHARE = 0.04


@final
@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """The path of the tool without poses that go nowhere, and what moves along it may do.

    Attributes:
        tips: (k, 3) [mm].
        quaternions: (k, 4) of one sign from pose to pose.
        times: (k,) when they are passed [s].
        required: rows that must be targets.
        runs: (k,) run of each.
        rests: (k,) where the tool stops.
        laid: (k - 1,) whether material is laid to the next row.
        tolerance: of the path [mm].
        turn: tolerance of the attitude [rad].
        periods: least time of a move, and the time that moves should have [s].
    """

    tips: FloatArray
    quaternions: FloatArray
    times: FloatArray
    required: IntArray
    runs: IntArray
    rests: BoolArray
    laid: BoolArray
    tolerance: float
    turn: float
    periods: tuple[float, float]

    def weighed(self, allowed: FloatArray, required: IntArray, *, known: Weighed | None = None) -> Weighed:
        """Weigh the moves between rows through the required ones, given what each row may be off [mm]."""
        return weighed(
            self.tips, self.quaternions, self.times, required, allowed=allowed, turn=self.turn,
            tolerance=self.tolerance, periods=self.periods, known=known,
        )  # fmt: skip

    def resting(self, rows: IntArray) -> BoolArray:
        """Return at which targets the program stops: also at the ends of runs, where one resumes from elsewhere."""
        borders = np.diff(self.runs[rows]) != 0
        ends = (rows == 0) | (rows == len(self.tips) - 1)
        return self.rests[rows] | ends | np.append(borders, np.False_) | np.insert(borders, 0, np.False_)

    def soon(self, rows: IntArray) -> IntArray:
        """Return the moves of a chain that lay material and come too soon."""
        late = np.diff(self.times[rows]) >= self.periods[1] * (1.0 - TIME_ROUNDING)
        return np.flatnonzero(self.laid[rows[:-1]] & ~late)

    def short(self, rows: IntArray) -> tuple[int, int]:
        """Return how many of these are shorter than the least time, and how many there are."""
        soon = self.soon(rows)
        least = np.diff(self.times[rows])[soon] < self.periods[0] * (1.0 - TIME_ROUNDING)
        return int(least.sum()), soon.size


def rounded_chain(course: Course) -> tuple[IntArray, FloatArray]:
    """Return (t,) rows that are targets, and (t, 3) where these stand [mm]."""
    moves = course.weighed(np.full(len(course.tips), course.tolerance), course.required)
    rows = cheapest_chain(moves, course.required)
    if not course.soon(rows).size:
        return rows, course.tips[rows]
    rows, moved = _relaxed(course, rows, moves)
    rows, moved = _evened(course, rows, moved)
    places = fitted_places(course.tips[rows], moved[rows], course.resting(rows))
    return rows, places


def _relaxed(course: Course, rows: IntArray, moves: Weighed) -> tuple[IntArray, BoolArray]:
    """Let moves be wide about those that come too soon, where corners make up for it; return which rows are moved."""
    last, allowed = rows.size - 1, np.full(len(course.tips), course.tolerance)
    for move in course.soon(rows).tolist():
        allowed[rows[max(move - ABOUT, 0)] : rows[min(move + 1 + ABOUT, last)] + 1] = WIDEST * course.tolerance
    moved = np.zeros(len(course.tips), dtype=np.bool_)
    for left in range(ROUNDS, -1, -1):
        moves = course.weighed(allowed, course.required, known=moves)
        rows = cheapest_chain(moves, course.required)
        wide = chord_shares(course.tips, rows, tolerance=course.tolerance) > 1.0 + TIME_ROUNDING
        moved[:] = False
        moved[rows] = (np.append(wide, np.False_) | np.insert(wide, 0, np.False_)) & ~course.resting(rows)
        off = _missing(course, rows, moved, wide=wide)
        if not off.size:
            break
        about, last = (ABOUT if left <= 1 else 1), rows.size - 1
        for move in off.tolist():
            near = slice(rows[max(move - about, 0)], rows[min(move + 1 + about, last)] + 1)
            allowed[near] = np.maximum(allowed[near] / 2.0, course.tolerance) if left > 1 else course.tolerance
    return rows, moved


def _missing(course: Course, rows: IntArray, moved: BoolArray, *, wide: BoolArray) -> IntArray:
    """Return the moves that leave the tolerance or turn otherwise, of those that are wide or have a moved target."""
    places = fitted_places(course.tips[rows], moved[rows], course.resting(rows))
    zones = zones_of(places, course.resting(rows))
    off = rounded_deviations(course.tips, rows, places, zones)
    touched = wide | moved[rows[1:]] | moved[rows[:-1]]
    return np.flatnonzero(touched & ((off > course.tolerance) | (_turned(course, rows, places, zones) > MOST_TURNED)))


def _turned(course: Course, rows: IntArray, places: FloatArray, zones: FloatArray) -> FloatArray:
    """Return (t - 1,) how far poses are turned at most from each move, where no corner is rounded [rad].

    The attitude of a move counts from its targets, which stand farther out than the poses that they are passed at.
    """
    move = np.repeat(np.arange(rows.size - 1), np.diff(rows))
    own: IntArray = np.arange(rows[0], rows[-1], dtype=np.int64)
    steps = np.diff(places, axis=0)
    lengths = np.maximum(np.linalg.norm(steps, axis=1), COINCIDENT)
    along = np.einsum("ij,ij->i", course.tips[own] - places[move], steps[move]) / lengths[move]
    straight = (along > zones[move]) & (along < lengths[move] - zones[move + 1])
    move, own, along = move[straight], own[straight], along[straight]
    share = (along / lengths[move])[:, None]
    # Moves turn by a few degrees: between them the straight line is the arc.
    meant = (1.0 - share) * course.quaternions[rows[move]] + share * course.quaternions[rows[move + 1]]
    meant /= np.linalg.norm(meant, axis=1, keepdims=True)
    found = np.zeros(rows.size - 1)
    np.maximum.at(found, move, 2.0 * np.linalg.norm(course.quaternions[own] - meant, axis=1))
    return found


def _evened(course: Course, rows: IntArray, moved: BoolArray) -> tuple[IntArray, BoolArray]:
    """Try targets at even times in the bends that are still too tight."""
    done = -1
    while (first := _next_soon(course, rows, after=done)) is not None:
        soon, last = set(course.soon(rows).tolist()), first
        while last + 1 in soon and not course.rests[rows[last + 1]]:
            last += 1
        done = int(rows[last])
        low, high = max(first - 2 * ABOUT, 0), min(last + 1 + 2 * ABOUT, rows.size - 1)
        sides = rows[max(low - CONTEXT, 0) : low], rows[high + 1 : high + 1 + CONTEXT]
        bend = int(rows[first]), int(rows[last + 1])
        part, moved = _improved(course, rows[low : high + 1], moved, bend=bend, sides=sides)
        rows = np.concatenate([rows[:low], part, rows[high + 1 :]])
    return rows, moved


def _next_soon(course: Course, rows: IntArray, *, after: int) -> int | None:
    """Return the next move that comes too soon; where few do, the next that is shorter than the least time."""
    soon = course.soon(rows)
    if soon.size <= FEW_SHARE * course.laid[rows[:-1]].sum():
        soon = soon[np.diff(course.times[rows])[soon] < course.periods[0] * (1.0 - TIME_ROUNDING)]
    left = soon[rows[soon] > after]
    return int(left[0]) if left.size else None


def _improved(
    course: Course, part: IntArray, moved: BoolArray, *, bend: tuple[int, int], sides: tuple[IntArray, IntArray]
) -> tuple[IntArray, BoolArray]:
    """Return a stretch of a chain with the best of the patterns over its bend, or as it was; the sides stay."""
    best, score = (part, moved), course.short(part)
    patterns = _patterns(course, *bend, within=(int(part[0]), int(part[-1])))
    for pattern in islice(patterns, MOST_PATTERNS):
        found, shifted = _through(course, part, moved, pattern)
        if course.short(found) < score and not _leaves(course, (sides[0], found, sides[1]), shifted):
            best, score = (found, shifted), course.short(found)
        if score[1] == 0:
            break
    return best


def _patterns(course: Course, first: int, last: int, *, within: tuple[int, int]) -> Iterator[IntArray]:
    """Yield rows at even times over a bend, from up to so many steps before its first row to behind its last one.

    They lie in one stretch that is laid without a rest, and moved there, corners keep the tolerance all along.
    """
    rests = np.flatnonzero(course.rests)
    low = max(within[0], int(rests[np.searchsorted(rests, first, side="right") - 1]))
    high = min(within[1], int(rests[np.searchsorted(rests, last)]))
    for share, periods in product(EVEN_BEGINS, EVEN_PERIODS):
        step = periods * course.periods[1]
        begin = course.times[first] - step * (share + EVEN_FURTHER)
        count = int(np.ceil((course.times[last] - begin) / step)) + 1 + EVEN_FURTHER
        rows = np.unique(_nearest(course.times, begin + step * np.arange(count)))
        rows = rows[(rows > low) & (rows < high)]
        if rows.size < 2:
            continue
        kept = _kept(course, rows)
        start = max(int(np.searchsorted(rows, first, side="right")) - 1, 0)
        end = min(int(np.searchsorted(rows, last)), rows.size - 1)
        if not kept[start:end].all():
            continue
        starts = range(start, start - min(_run_of(kept[:start][::-1]), EVEN_FURTHER) - 1, -1)
        ends = range(end, end + min(_run_of(kept[end:]), EVEN_FURTHER) + 1)
        yield from (rows[i : j + 1] for i in starts for j in ends if j > i)


def _kept(course: Course, rows: IntArray) -> BoolArray:
    """Return which moves keep the tolerance where all targets are moved."""
    rests = np.zeros(rows.size, dtype=np.bool_)
    places = fitted_places(course.tips[rows], ~rests, rests)
    return rounded_deviations(course.tips, rows, places, zones_of(places, rests)) <= course.tolerance


def _run_of(flags: BoolArray) -> int:
    """Return how many flags are set before the first that is not."""
    return int(flags.argmin()) if not flags.all() else flags.size


def _nearest(times: FloatArray, wanted: FloatArray) -> IntArray:
    above = np.clip(np.searchsorted(times, wanted), 1, times.size - 1)
    return above - (wanted - times[above - 1] < times[above] - wanted)


def _through(course: Course, part: IntArray, moved: BoolArray, pattern: IntArray) -> tuple[IntArray, BoolArray]:
    """Return a stretch of a chain that goes through a pattern, and which rows are moved then."""
    first, last = int(pattern[0]), int(pattern[-1])
    left, right = int(part[0]), int(part[-1])
    fixed = part[moved[part] | course.rests[part]]
    left = int(fixed[fixed < first].max(initial=left))
    right = int(fixed[fixed > last].min(initial=right))
    allowed = np.full(right + 1 - left, course.tolerance)
    allowed[first - left : last + 1 - left] = WIDEST * course.tolerance
    cut = slice(left, right + 1)
    local = replace(
        course, tips=course.tips[cut], quaternions=course.quaternions[cut], times=course.times[cut],
        runs=course.runs[cut], rests=course.rests[cut], laid=course.laid[left:right],
    )  # fmt: skip
    required = np.concatenate([[left], pattern, [right]]) - left
    rows = left + cheapest_chain(local.weighed(allowed, required), required)
    shifted = moved.copy()
    shifted[left + 1 : right] = False
    shifted[pattern] = True
    return np.concatenate([part[part < left], rows, part[part > right]]), shifted


def _leaves(course: Course, parts: tuple[IntArray, IntArray, IntArray], moved: BoolArray) -> bool:
    """Say whether a stretch of a chain, with what is beside it, is off where it is wide or has moved targets."""
    rows = np.concatenate(parts)
    wide = chord_shares(course.tips, rows, tolerance=course.tolerance) > 1.0 + TIME_ROUNDING
    stays = wide & ~(moved[rows[:-1]] | moved[rows[1:]])
    # Ends of the stretch that are moved are not fitted here; what that changes dies away towards its middle.
    inner = slice(parts[0].size // 2, rows.size - 1 - parts[2].size // 2)
    off = np.zeros(wide.size, dtype=np.bool_)
    off[_missing(course, rows, moved, wide=wide)] = True
    return bool((stays | off)[inner].any())
