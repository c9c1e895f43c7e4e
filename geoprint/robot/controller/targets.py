"""Waypoints: which poses are written as targets of the controller, few enough and close enough to the path."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice, product
from typing import Literal, TypeAlias, final

import numpy as np

from geoprint.errors import UsageError
from geoprint.model import Bend, BoolArray, FloatArray, IntArray, JointPath, PoseStream, Process, Targets, Trajectory
from geoprint.robot.controller.choice import TIME_ROUNDING, Weighed, cheapest_chain, chord_shares, weighed
from geoprint.robot.controller.fitting import COINCIDENT, fitted_places, rounded_deviations, rounded_lengths, zones_of
from geoprint.robot.reach import bead_steps, tip_lengths, turns
from geoprint.transforms import same_sign

# Bends in which targets stand beside the path, or closer than a controller takes: what is listed of them.


def bends_of(
    poses: PoseStream, chosen: IntArray, times: FloatArray, *, places: FloatArray, shortest: float
) -> tuple[Bend, ...]:
    """Return the bends with targets beside the path, and the stretches with moves that deposit material in less time.

    Args:
        poses: p poses.
        chosen: (t,) of them that are targets.
        times: (p,) when they are passed [s].
        places: (t, 3) where the targets stand [mm].
        shortest: time of a move from which on nothing is said of it [s].
    """
    offsets, durations = np.linalg.norm(places - poses.tips[chosen], axis=1), np.diff(times[chosen])
    close = np.append(poses.deposited[chosen[:-1]] & (durations < shortest * (1.0 - TIME_ROUNDING)), np.False_)
    kinds: tuple[tuple[Literal["rounded", "close"], BoolArray], ...] = (("rounded", offsets > 0.0), ("close", close))
    found = [
        _bend(poses, chosen, durations, offsets=offsets, first=first, last=last, kind=kind)
        for kind, flags in kinds
        for first, last in _stretches(flags, poses.runs[chosen])
    ]
    return tuple(sorted(found, key=lambda bend: (bend.run, bend.arc)))


def _stretches(flags: BoolArray, runs: IntArray) -> Iterator[tuple[int, int]]:
    """Yield first and last of each stretch of flags in one run."""
    rows = np.flatnonzero(flags)
    parts = np.split(rows, np.flatnonzero((np.diff(rows) > 1) | (np.diff(runs[rows]) != 0)) + 1)
    return ((int(part[0]), int(part[-1])) for part in parts if part.size)


def _bend(
    poses: PoseStream,
    chosen: IntArray,
    durations: FloatArray,
    *,
    offsets: FloatArray,
    first: int,
    last: int,
    kind: Literal["rounded", "close"],
) -> Bend:
    most = first + int(offsets[first : last + 1].argmax()) if kind == "rounded" else (first + last) // 2
    x, y, z = poses.tips[chosen[most]].tolist()
    return Bend(
        run=int(poses.runs[chosen[most]]),
        kind=kind,
        place=(x, y, z),
        arc=float(poses.arcs[chosen[most]]),
        radius=_radius(poses.tips[chosen[max(most - 1, 0) : most + 2]]),
        targets=last - first + 1,
        offset=float(offsets[first : last + 1].max()),
        shortest=float(durations[max(first - 1, 0) : last + 1].min()),
    )


def _radius(tips: FloatArray) -> float:
    """Return the radius of the circle through three places; infinite where they lie in a line [mm]."""
    sides = np.linalg.norm(tips - np.roll(tips, 1, axis=0), axis=1)
    area = float(np.linalg.norm(np.cross(tips[1] - tips[0], tips[-1] - tips[0])))
    return float(sides.prod()) / (2.0 * area) if len(tips) == 3 and area > 0.0 else float("inf")


# The chain of targets of a whole path, with targets outside of the bends that are too tight for straight moves.


# Where straight moves come too soon, a move may leave the path by so many tolerances, as far as the rounded corners at
# its ends make up for it; so many moves about the one that comes too soon. What they do not make up for is halved.
WIDEST = 8.0
ABOUT = 3
ROUNDS = 8

# Where that is not enough, targets are tried at even times: so many periods apart, begun at so many shares of that.
EVEN_PERIODS = (1.25, 1.0, 1.1, 1.45, 0.9, 1.7, 0.8, 0.95, 1.15, 0.85, 0.75, 0.7, 0.65, 0.61)
EVEN_BEGINS = (0.0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875)
EVEN_FURTHER = 3
# Between two rests they are tried without a remainder: the first and the last move take so many times the least, the
# longer the slower the ramps are; so many moves lie between them at most, and down to so many fewer than fit.
END_PERIODS = (1.0, 1.5, 2.0)
MOST_BETWEEN = 24
FEWER_BETWEEN = 3
# So many of these are tried in a bend, and only where moves are shorter than the least time once not more than this
# share of the moves comes too soon.
MOST_PATTERNS = 300
# Targets to either side with which a stretch is looked at.
CONTEXT = 8
FEW_SHARE = 0.04

# What was found for stretches of one path: targets, and which of them are moved, by all that they follow from. Times
# count to so many decimals [s].
KnownStretches: TypeAlias = dict[bytes, tuple[IntArray, BoolArray]]
KNOWN_DECIMALS = 9


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
        held: (k,) where a target stands at its pose: there, and where deposits begin and end.
        printing: (k - 1,) whether the step to the next row is of a printing move.
        allowed: (k,) how far each may be off a move [mm]: by the tolerance, less what the timed path between the poses
            is farther off.
        turns: (k,) how far each may be turned from a move [rad], likewise.
        tolerance: of the path [mm].
        periods: least time of a move, and the time that moves should have [s].
        known: what was found for stretches of this very path before; what is found now is added.
    """

    tips: FloatArray
    quaternions: FloatArray
    times: FloatArray
    required: IntArray
    runs: IntArray
    rests: BoolArray
    held: BoolArray
    printing: BoolArray
    allowed: FloatArray
    turns: FloatArray
    tolerance: float
    periods: tuple[float, float]
    known: KnownStretches = field(default_factory=dict[bytes, tuple[IntArray, BoolArray]])

    def weighed(
        self, allowed: FloatArray, required: IntArray, *, first: int = 0, known: Weighed | None = None
    ) -> Weighed:
        """Weigh the moves between rows from the first on through the required ones, given what each may be off [mm].

        Required rows, and those weighed, count from the first.
        """
        cut = slice(first, first + allowed.size)
        return weighed(
            self.tips[cut], self.quaternions[cut], self.times[cut], required, allowed=allowed, turns=self.turns[cut],
            tolerance=self.tolerance, periods=self.periods, known=known,
        )  # fmt: skip

    def resting(self, rows: IntArray) -> BoolArray:
        """Return at which targets the program stops: also at the ends of runs, where one resumes from elsewhere."""
        borders = np.diff(self.runs[rows]) != 0
        ends = (rows == 0) | (rows == len(self.tips) - 1)
        return self.rests[rows] | ends | np.append(borders, np.False_) | np.insert(borders, 0, np.False_)

    def soon(self, rows: IntArray) -> IntArray:
        """Return the moves of a chain that print and come too soon."""
        late = np.diff(self.times[rows]) >= self.periods[1] * (1.0 - TIME_ROUNDING)
        return np.flatnonzero(self.printing[rows[:-1]] & ~late)

    def short(self, rows: IntArray) -> tuple[int, int]:
        """Return how many of these are shorter than the least time, and how many there are."""
        times = self.times[rows]
        durations = (times[1:] - times[:-1])[self.printing[rows[:-1]]]
        least, wanted = (period * (1.0 - TIME_ROUNDING) for period in (min(self.periods), self.periods[1]))
        return int(np.count_nonzero(durations < least)), int(np.count_nonzero(durations < wanted))

    def too_short(self, rows: IntArray) -> IntArray:
        """Return the moves of a chain that print and are shorter than the least time."""
        soon = self.soon(rows)
        return soon[np.diff(self.times[rows])[soon] < self.periods[0] * (1.0 - TIME_ROUNDING)]

    def eased(self, rows: IntArray) -> Course:
        """Return a course on which poses about these may be off by all of the tolerance, however the path bulges."""
        allowed, turns = self.allowed.copy(), self.turns.copy()
        for move in self.too_short(rows).tolist():
            near = slice(rows[max(move - ABOUT, 0)], rows[min(move + 1 + ABOUT, rows.size - 1)] + 1)
            allowed[near], turns[near] = self.tolerance, ANGLE_TOLERANCE
        return replace(self, allowed=allowed, turns=turns)


def rounded_chain(course: Course) -> tuple[IntArray, FloatArray]:
    """Return (t,) rows that are targets, and (t, 3) where these stand [mm].

    A move that no controller takes in time is worse than what the path bulges: about such a one only poses count.
    """
    rows, places = _chain(course)
    if course.too_short(rows).size:
        others, elsewhere = _chain(course.eased(rows))
        if course.too_short(others).size < course.too_short(rows).size:
            return others, elsewhere
    return rows, places


def _chain(course: Course) -> tuple[IntArray, FloatArray]:
    moves = course.weighed(course.allowed, course.required)
    rows = cheapest_chain(moves, course.required)
    if not course.soon(rows).size:
        return rows, course.tips[rows]
    rows, moved = _relaxed(course, rows, moves)
    rows, moved = _evened(course, rows, moved)
    places = fitted_places(course.tips[rows], moved[rows], course.resting(rows))
    return rows, places


def _relaxed(course: Course, rows: IntArray, moves: Weighed) -> tuple[IntArray, BoolArray]:
    """Let moves be wide about those that come too soon, where corners make up for it; return which rows are moved."""
    last, left, allowed = rows.size - 1, ROUNDS, course.allowed.copy()
    for move in course.soon(rows).tolist():
        allowed[rows[max(move - ABOUT, 0)] : rows[min(move + 1 + ABOUT, last)] + 1] = WIDEST * course.tolerance
    moved = np.zeros(len(course.tips), dtype=np.bool_)
    # Each round narrows something: a move that is off, or one beside it, is wide.
    while True:
        moves = course.weighed(allowed, course.required, known=moves)
        rows = cheapest_chain(moves, course.required)
        wide = chord_shares(course.tips, rows, allowed=course.allowed) > 1.0 + TIME_ROUNDING
        moved[:] = False
        moved[rows] = np.append(wide, np.False_) | np.insert(wide, 0, np.False_)
        moved[rows] &= ~(course.held[rows] | course.resting(rows))
        off = _missing(course, rows, moved, wide=wide)
        if not off.size:
            return rows, moved
        about, last = (ABOUT if left <= 1 else 1), rows.size - 1
        for move in off.tolist():
            near = slice(rows[max(move - about, 0)], rows[min(move + 1 + about, last)] + 1)
            least = course.allowed[near]
            allowed[near] = np.maximum(allowed[near] / 2.0, least) if left > 1 else least
        left -= 1


def _missing(course: Course, rows: IntArray, moved: BoolArray, *, wide: BoolArray) -> IntArray:
    """Return the moves that leave the tolerance or turn otherwise, of those that are wide or have a moved target."""
    places = fitted_places(course.tips[rows], moved[rows], course.resting(rows))
    zones = zones_of(places, course.resting(rows))
    off = rounded_deviations(course.tips, rows, places, zones)
    touched = wide | moved[rows[1:]] | moved[rows[:-1]]
    turned = _turned(course, rows, places, zones)
    return np.flatnonzero(touched & ((off > _least(course.allowed, rows)) | (turned > _least(course.turns, rows))))


def _least(values: FloatArray, rows: IntArray) -> FloatArray:
    """Return (t - 1,) the least of the values of the rows of each move, both of its ends among them."""
    return np.minimum(np.minimum.reduceat(values[: rows[-1]], rows[:-1]), values[rows[1:]])


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
        while last + 1 in soon and not course.held[rows[last + 1]]:
            last += 1
        done = int(rows[last])
        low, high = max(first - 2 * ABOUT, 0), min(last + 1 + 2 * ABOUT, rows.size - 1)
        sides = rows[max(low - CONTEXT, 0) : low], rows[high + 1 : high + 1 + CONTEXT]
        bend = int(rows[first]), int(rows[last + 1])
        part, moved = _known_or_improved(course, rows[low : high + 1], moved, bend=bend, sides=sides)
        rows = np.concatenate([rows[:low], part, rows[high + 1 :]])
    return rows, moved


def _next_soon(course: Course, rows: IntArray, *, after: int) -> int | None:
    """Return the next move that comes too soon; where few do, the next that is shorter than the least time."""
    soon = course.soon(rows)
    if soon.size <= FEW_SHARE * course.printing[rows[:-1]].sum():
        soon = soon[np.diff(course.times[rows])[soon] < course.periods[0] * (1.0 - TIME_ROUNDING)]
    left = soon[rows[soon] > after]
    return int(left[0]) if left.size else None


def _known_or_improved(
    course: Course, part: IntArray, moved: BoolArray, *, bend: tuple[int, int], sides: tuple[IntArray, IntArray]
) -> tuple[IntArray, BoolArray]:
    """Return what `_improved` does, which is asked once about a stretch however often the path is timed."""
    rows = np.concatenate([*sides, part])
    own = slice(int(rows.min()), int(rows.max()) + 1)
    passed = np.round(course.times[own] - course.times[part[0]], KNOWN_DECIMALS)
    sizes = np.array([*bend, *map(len, sides)])
    key = b"".join(
        each.tobytes() for each in (sizes, rows, moved[rows], passed, course.allowed[own], course.turns[own])
    )
    if key not in course.known:
        found, shifted = _improved(course, part, moved, bend=bend, sides=sides)
        course.known[key] = found, shifted[found]
    found, shifted = course.known[key][0], moved.copy()
    shifted[part] = False
    shifted[found] = course.known[key][1]
    return found, shifted


def _improved(
    course: Course, part: IntArray, moved: BoolArray, *, bend: tuple[int, int], sides: tuple[IntArray, IntArray]
) -> tuple[IntArray, BoolArray]:
    """Return a stretch of a chain with the best of the patterns over its bend, or as it was; the sides stay."""
    best, score = (part, moved), course.short(part)
    patterns = _patterns(course, *bend, within=(int(part[0]), int(part[-1])))
    for pattern in islice(patterns, MOST_PATTERNS):
        left, right = _free_about(course, part, moved, pattern, bend=bend)
        # Targets between those that stay and those of the pattern make no fewer moves that come too soon.
        if course.short(np.unique(np.concatenate([part[part <= left], pattern, part[part >= right]]))) >= score:
            continue
        found, shifted = _through(course, part, moved, pattern, within=(left, right))
        if course.short(found) < score and not _leaves(course, (sides[0], found, sides[1]), shifted):
            best, score = (found, shifted), course.short(found)
        if score[1] == 0:
            break
    return best


def _patterns(course: Course, first: int, last: int, *, within: tuple[int, int]) -> Iterator[IntArray]:
    """Yield rows at even times over a bend, from up to so many steps before its first row to behind its last one.

    They lie in one stretch that prints without a rest or switch, and moved there, corners keep the tolerance all along.
    """
    rests = np.flatnonzero(course.held)
    low = max(within[0], int(rests[np.searchsorted(rests, first, side="right") - 1]))
    high = min(within[1], int(rests[np.searchsorted(rests, last)]))
    if course.held[[low, high]].all():
        yield from _between(course, low, high)
    for share, periods in product(EVEN_BEGINS, EVEN_PERIODS):
        step = periods * course.periods[1]
        begin = course.times[first] - step * (share + EVEN_FURTHER)
        count = int(np.ceil((course.times[last] - begin) / step)) + 1 + EVEN_FURTHER
        rows = _nearest(course.times, begin + step * np.arange(count))
        inside = (rows > low) & (rows < high)
        inside[1:] &= rows[1:] > rows[:-1]
        rows = rows[inside]
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


def _between(course: Course, low: int, high: int) -> Iterator[IntArray]:
    """Yield rows from rest to rest: the first and the last move short, those between them even in time.

    A corner at a rest is not rounded, so that the moves there keep the tolerance only where they are short; a ring that
    is hardly wider than its bead has no room for more than one such move at either end.
    """
    times, least = course.times[low : high + 1], course.periods[0]
    for ends in END_PERIODS:
        first, last = float(times[0]) + ends * least, float(times[-1]) - ends * least
        begin = int(np.searchsorted(times, first))
        inner: FloatArray = times[begin : int(np.searchsorted(times, last, side="right"))]
        most = int((inner[-1] - inner[0]) / least) if inner.size else 0
        for count in range(min(most, MOST_BETWEEN), max(most - FEWER_BETWEEN, 0), -1):
            wanted: FloatArray = np.linspace(float(inner[0]), float(inner[-1]), count + 1)
            even = begin + _nearest(inner, wanted)
            yield low + np.concatenate([[0], even, [high - low]])


def _kept(course: Course, rows: IntArray) -> BoolArray:
    """Return which moves keep the tolerance where all targets are moved."""
    rests = np.zeros(rows.size, dtype=np.bool_)
    places = fitted_places(course.tips[rows], ~rests, rests)
    return rounded_deviations(course.tips, rows, places, zones_of(places, rests)) <= _least(course.allowed, rows)


def _run_of(flags: BoolArray) -> int:
    """Return how many flags are set before the first that is not."""
    return int(flags.argmin()) if not flags.all() else flags.size


def _nearest(times: FloatArray, wanted: FloatArray) -> IntArray:
    above = np.minimum(np.maximum(times.searchsorted(wanted), 1), times.size - 1)
    return above - (wanted - times[above - 1] < times[above] - wanted)


def _free_about(
    course: Course, part: IntArray, moved: BoolArray, pattern: IntArray, *, bend: tuple[int, int]
) -> tuple[int, int]:
    """Return the targets of a stretch between which a pattern leaves none: ends, rests, what is moved off the bend."""
    beside = (part < bend[0]) | (part > bend[1])
    fixed = part[(moved[part] & beside) | course.held[part]]
    left = int(fixed[fixed < pattern[0]].max(initial=part[0]))
    right = int(fixed[fixed > pattern[-1]].min(initial=part[-1]))
    return left, right


def _through(
    course: Course, part: IntArray, moved: BoolArray, pattern: IntArray, *, within: tuple[int, int]
) -> tuple[IntArray, BoolArray]:
    """Return a stretch of a chain that goes through a pattern within two of its targets, and which are moved then."""
    left, right = within
    allowed = course.allowed[left : right + 1].copy()
    allowed[pattern[0] - left : pattern[-1] + 1 - left] = WIDEST * course.tolerance
    required = np.unique(np.concatenate([[left], pattern, [right]])) - left
    rows = left + cheapest_chain(course.weighed(allowed, required, first=left), required)
    shifted = moved.copy()
    shifted[left + 1 : right] = False
    shifted[pattern] = ~course.held[pattern]
    return np.concatenate([part[part < left], rows, part[part > right]]), shifted


def _leaves(course: Course, parts: tuple[IntArray, IntArray, IntArray], moved: BoolArray) -> bool:
    """Say whether a stretch of a chain, with what is beside it, is off where it is wide or has moved targets."""
    rows = np.concatenate(parts)
    wide = chord_shares(course.tips, rows, allowed=course.allowed) > 1.0 + TIME_ROUNDING
    stays = wide & ~(moved[rows[:-1]] | moved[rows[1:]])
    # Ends of the stretch that are moved are not fitted here; what that changes dies away towards its middle.
    inner = slice(parts[0].size // 2, rows.size - 1 - parts[2].size // 2)
    off = np.zeros(wide.size, dtype=np.bool_)
    off[_missing(course, rows, moved, wide=wide)] = True
    return bool((stays | off)[inner].any())


# Which poses are written as targets: few enough for the controller, close enough to the path.
#
# All poses of `required_poses` are kept, in their places. Between them the straight move (slerp for the attitude) from
# one target to the next stays within `tolerance` and 0.1 degrees of every pose left out, and turns by at most 90
# degrees. Of all such chains of moves that one is taken (`cheapest_chain`) in which no move is shorter than 12 ms, then
# fewest are shorter than `period`, then fewest leave the poses by more than a quarter of the tolerances. Where a run
# begins in the place where the one before ends (a run that was split, or a neighbour right beside it), that place is a
# target once, of the run that begins: no move is shorter than 0.001 mm but for turns on the spot.
#
# Where bends that print are so tight that moves are still shorter than the period, moves may be longer and the
# targets stand outside of the bend (`fitting`): the controller's rounded corner passes the pose that a target stands
# for, and stays within `tolerance` of the poses left out. Such bends are listed, and those that stay closer than 12
# ms.
#
# Zones are 0 at stops, which are fine points, and at the first and last target of each run, because whoever resumes
# at a run comes from elsewhere; else half the distance to the nearer neighbour, at most 0.3 mm. A target with a
# neighbour in the same place (a turn on the spot) has zone 0 as well. Speeds give the time of each move over the
# length of the controller's path, and are at most those of the process; where a move holds the ramp at a stop, they
# are its mean.


# Largest distance [mm] of a pose left out from the moves that are written.
TOLERANCE = 0.01
# Largest angle [rad] between a pose left out and the attitude of the straight move past it: at the end of a 120 mm tool
# it moves the flange by 0.2 mm.
ANGLE_TOLERANCE = float(np.radians(0.1))
# So much of both is left to the poses, however far the timed path is off between them.
LEAST_SHARE = 0.3

# No move that prints is shorter than this [s] where the path allows it: controllers answer shorter ones with
# corner path failures.
SHORTEST_TIME = 0.012

# Speeds are rounded to so many digits, and never below the smallest [mm/s]: a controller needs one above zero.
SPEED_DIGITS = 4
SMALLEST_SPEED = 0.1

# A corner that is cut is a shorter path; the tip is slowed for it by no more than to this share.
EVEN_SHARE = 0.98

# No move is written that neither goes as far as this [mm], a tenth of what an arm repeats, nor turns the tool by this
# [rad], which moves the flange of a 120 mm tool by half of what an arm repeats.
SHORTEST_MOVE = 1e-3
SMALLEST_TURN = 5e-5


def tightest_bend(speed: float, *, period: float) -> float:
    """Return the radius of the tightest bend that straight moves follow which take the period of targets [mm].

    Args:
        speed: of the print [mm/s].
        period: time between targets that the controller takes without slowing down [s].
    """
    return (speed * period) ** 2 / (8.0 * TOLERANCE)


def written_targets(
    joint_path: JointPath,
    trajectory: Trajectory,
    *,
    process: Process,
    tolerance: float = TOLERANCE,
    period: float = 0.02,
    known: KnownStretches | None = None,
) -> Targets:
    """Choose the poses that the program names, and how the controller passes them.

    The module says how. The move to the first target has the travel speed.

    Args:
        joint_path: p poses.
        trajectory: when they are passed.
        process: speeds of the tip.
        tolerance: largest distance of a pose from the written path [mm].
        period: time between targets that the controller takes without slowing down [s].
        known: targets in bends of this very path that were found before, with the same tolerance and period.

    Returns:
        The targets.

    Raises:
        UsageError: tolerance or period are not positive.
    """
    if not (tolerance > 0.0 and period > 0.0):
        raise UsageError(
            f"targets need a positive tolerance and period, found {tolerance:g} mm and {period:g} s; the usual values "
            "are 0.01 mm and 0.02 s.",
            tolerance_mm=tolerance, period_s=period,
        )  # fmt: skip
    poses = joint_path.poses
    kept = np.flatnonzero(~_repeated(poses))
    course = _course(joint_path, kept, trajectory.pose_times, tolerance=tolerance, period=period)
    course = course if known is None else replace(course, known=known)
    rows, places = rounded_chain(course)
    beside = (places != course.tips[rows]).any(axis=1)
    chosen, moved = kept[rows], np.flatnonzero(beside)
    zones = zones_of(places, course.resting(rows), moved=beside)
    lengths = rounded_lengths(course.tips, rows, places, zones)
    return Targets(
        poses=chosen,
        zones=zones,
        speeds=_speeds(poses, chosen, trajectory.pose_times, lengths=lengths, process=process),
        moved=moved,
        places=places[moved],
        bends=bends_of(poses, chosen, trajectory.pose_times, places=places, shortest=SHORTEST_TIME),
    )


def _course(joint_path: JointPath, kept: IntArray, times: FloatArray, *, tolerance: float, period: float) -> Course:
    """Return the course of the poses of a path that go somewhere."""
    poses, bulges = joint_path.poses, np.zeros((kept.size + 1, 2))
    if len(joint_path.bulges):
        bulges[1:] = np.maximum.reduceat(joint_path.bulges, kept)
    # On both sides of a pose.
    bulges = np.maximum(bulges[:-1], bulges[1:])
    return Course(
        tips=poses.tips[kept],
        quaternions=same_sign(poses.quaternions)[kept],
        times=times[kept],
        required=np.searchsorted(kept, required_poses(poses)),
        runs=poses.runs[kept],
        rests=poses.stops[kept],
        held=(poses.stops | _switches(poses))[kept],
        printing=poses.printing[kept[:-1]],
        allowed=np.maximum(tolerance - bulges[:, 0], LEAST_SHARE * tolerance),
        turns=np.maximum(ANGLE_TOLERANCE - bulges[:, 1], LEAST_SHARE * ANGLE_TOLERANCE),
        tolerance=tolerance,
        periods=(min(SHORTEST_TIME, period), period),
    )


def close_targets(targets: Targets, trajectory: Trajectory, *, period: float) -> tuple[int, float]:
    """Tell where the tolerance or a stop puts targets closer together in time than the controller digests.

    Args:
        targets: that are written.
        trajectory: when their poses are passed.
        period: time between targets that the controller takes without slowing down [s].

    Returns:
        How many targets come sooner than that after the one before, and the smallest time between two [s].
    """
    times = np.diff(trajectory.pose_times[targets.poses])
    return int((times < period * (1.0 - TIME_ROUNDING)).sum()), float(times.min(initial=np.inf))


def required_poses(poses: PoseStream) -> IntArray:
    """Return the poses that must be targets: first, last, all stops, and where deposit begins or ends.

    Where one of them follows another in the same place and attitude, as a run begins where the one before ended, only
    the later one is meant.
    """
    required = poses.stops | _switches(poses)
    required[[0, -1]] = True
    return np.flatnonzero(required & ~_repeated(poses))


def _repeated(poses: PoseStream) -> BoolArray:
    """Tell which poses but the first one a stop or switch repeats right after it, so that a move would go nowhere."""
    switches = _switches(poses)
    same = (tip_lengths(poses) < SHORTEST_MOVE) & (turns(poses) < SMALLEST_TURN)
    repeated = np.append(same & (poses.stops | switches)[1:], np.False_) & ~switches
    repeated[0] = False
    return repeated


def _switches(poses: PoseStream) -> BoolArray:
    """Tell at which poses depositing begins or ends."""
    deposited = np.concatenate([[False], poses.deposited, [False]])
    return deposited[1:] != deposited[:-1]


def _speeds(
    poses: PoseStream, chosen: IntArray, times: FloatArray, *, lengths: FloatArray, process: Process
) -> FloatArray:
    """Return the speed of the move to each target [mm/s], given the lengths of the controller's path."""
    passed, beads = (np.append([0.0], np.cumsum(each)) for each in (tip_lengths(poses), bead_steps(poses)))
    paths, durations = np.diff(passed[chosen]), np.diff(times[chosen])
    # Over a bulge the tip goes farther than the bead, whose speed is that of the process.
    farther = np.where(paths < COINCIDENT, 1.0, paths / np.maximum(np.diff(beads[chosen]), COINCIDENT))
    lengths = np.clip(lengths, EVEN_SHARE * paths, paths)
    planned = np.where(poses.printing[chosen[:-1]], process.speed * farther, process.travel_speed)
    turning = (lengths < COINCIDENT) | (durations <= 0.0)
    mean = np.where(turning, planned, lengths / np.where(turning, 1.0, durations))
    steps = 10.0 ** (SPEED_DIGITS - 1 - np.floor(np.log10(np.maximum(mean, SMALLEST_SPEED))))
    rounded = np.round(mean * steps) / steps
    return np.append([process.travel_speed], np.minimum(planned, np.maximum(rounded, SMALLEST_SPEED)))
