"""From grey values freed of light to lines along the middles of beads: thinned, walked along, joined."""

from __future__ import annotations

from collections import Counter
from typing import TypeAlias

import numpy as np
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, IntArray

# Grey values freed of the light on them, and how steep they are: what the paper takes lines from.


# Light is told from what it falls on by being alike over so many widths of a bead.
REACH_SHARE = 2.5
# What varies by less than this share of the picture's own contrast is flat, and stays so.
FLAT_SHARE = 0.1
# Edges are looked at through a smoothing of this share of a bead's width.
EDGE_SHARE = 1.0 / 6.0
# Grey values that vary by less are one colour: a step of 8 bits.
LEAST_CONTRAST = 1.0 / 255.0


def evened(grey: FloatArray, *, width: float) -> FloatArray:
    """Return grey values as they would be in even light: the remapping before edges are looked for.

    What is left has zero mean and unit standard deviation over the neighbourhood of every pixel, so that brightness
    and contrast of the whole, and a gradient of light over it, do not count.

    Args:
        grey: (h, w).
        width: of a bead [pixels].

    Raises:
        InputError: the picture is of one colour.
    """
    mean, spread = light_on(grey, width=width)
    return (grey - mean) / spread


def light_on(grey: FloatArray, *, width: float) -> tuple[FloatArray, FloatArray]:
    """Return (h, w) mean and spread of the grey values around every pixel, as its neighbourhood is lit.

    Args:
        grey: (h, w).
        width: of a bead [pixels].

    Raises:
        InputError: the picture is of one colour.
    """
    contrast = float(grey.std())
    if contrast < LEAST_CONTRAST:
        raise InputError(
            f"the photograph is of one colour: its grey values vary by {contrast:.2g}, needed are at least "
            f"{LEAST_CONTRAST:.2g}; light it so that beads stand out.",
            contrast=contrast,
        )
    reach = REACH_SHARE * width
    mean = ndimage.gaussian_filter(grey, reach)
    spread = np.sqrt(ndimage.gaussian_filter((grey - mean) ** 2, reach))
    return mean, spread + FLAT_SHARE * contrast


def steepness(grey: FloatArray, *, width: float) -> FloatArray:
    """Return G(I) = |dI/dx| + |dI/dy|, the paper's edge picture before its threshold.

    Args:
        grey: (h, w).
        width: of a bead [pixels]; what is much finer than it is smoothed away.

    Returns:
        (h, w) [1/pixel].
    """
    smoothing = EDGE_SHARE * width
    across = ndimage.gaussian_filter(grey, smoothing, order=(0, 1))
    down = ndimage.gaussian_filter(grey, smoothing, order=(1, 0))
    return np.abs(across) + np.abs(down)


def edges(grey: FloatArray, *, width: float) -> BoolArray:
    """Return which pixels are edges as the paper has them: G(I) of the remapped picture above a threshold [Otsu1979].

    Args:
        grey: (h, w).
        width: of a bead [pixels].

    Raises:
        InputError: the picture is of one colour.
    """
    steep = steepness(evened(grey, width=width), width=width)
    return steep > otsu(steep)


def otsu(values: FloatArray) -> float:
    """Return the threshold that parts values into two classes that differ most [Otsu1979]."""
    from skimage.filters import threshold_otsu

    return float(threshold_otsu(values))


# From pixels that are beads to the lines along their middles: thinned, walked along, without spurs, joined.
#
# A junction, as where a line meets a frame, parts a skeleton into branches; two that go on straight beyond it are
# one line.


# Branches that end free and are shorter than this share of the width are what thinning leaves of a thick end.
SPUR_SHARE = 1.5
# Over this share of the width the direction of an end is taken.
DIRECTION_SHARE = 1.5
# Branches go straight on where they turn by less than this [rad]: half a right angle would join what crosses.
STRAIGHT = np.radians(35.0)
# Ends that face each other over less than this share of the width are of one line that is broken ...
BREAK_SHARE = 4.0
# ... where each lies this nearly ahead of the other [rad].
AHEAD = np.radians(20.0)

_ROUND = np.ones((3, 3), dtype=np.int64)
# A line as it is walked, and the junctions at which it begins and ends: -1 where it ends free.
_Branch: TypeAlias = tuple[FloatArray, int, int]


def midlines(beads: BoolArray, *, width: float) -> list[FloatArray]:
    """Return the lines along the middles of beads.

    Args:
        beads: (h, w) which pixels are a bead's.
        width: of a bead [pixels].

    Returns:
        Of each line (k, 2) pixels (u, v) in their order, neighbours a step apart; a closed one ends where it starts.
    """
    from skimage.morphology import skeletonize

    thin = np.asarray(skeletonize(beads), dtype=np.bool_)
    branches = [branch for branch in _branches(thin) if not _is_spur(branch, width)]
    return _joined_over_breaks(_joined_at_junctions(branches, width), width)


def _branches(thin: BoolArray) -> list[_Branch]:
    """Return the branches of a skeleton between its junctions."""
    around = ndimage.convolve(thin.astype(np.int64), _ROUND, mode="constant") - 1
    crossing = thin & (around > 2)
    labels, _ = ndimage.label(crossing, structure=_ROUND)
    junctions: IntArray = np.asarray(labels, dtype=np.int64)
    parts, count = ndimage.label(thin & ~crossing, structure=_ROUND)
    places = ndimage.find_objects(parts)
    found: list[_Branch] = []
    for number in range(1, count + 1):
        rows, columns = places[number - 1]
        down, right = np.nonzero(parts[rows, columns] == number)
        line = _walked(np.column_stack([right + columns.start, down + rows.start]))
        ends = [_junction_at(junctions, line[end]) for end in (0, -1)]
        if len(line) > 2 and max(np.abs(line[0] - line[-1])) <= 1 and ends == [-1, -1]:
            line = np.vstack([line, line[:1]])
        found.append((line.astype(np.float64), ends[0], ends[1]))
    return found


def _walked(pixels: IntArray) -> IntArray:
    """Return the (k, 2) pixels of a branch in the order in which one walks along it, from an end where it has one."""
    number = {(int(u), int(v)): place for place, (u, v) in enumerate(pixels)}
    # Straight neighbours first: a corner is walked round, not cut.
    steps = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))
    beside = [[n for du, dv in steps if (n := number.get((int(u) + du, int(v) + dv))) is not None] for u, v in pixels]
    here = min(range(len(pixels)), key=lambda place: len(beside[place]))
    order, seen = [here], {here}
    while True:
        ahead = [place for place in beside[here] if place not in seen]
        if not ahead:
            return pixels[order]
        here = ahead[0]
        order.append(here)
        seen.add(here)


def _junction_at(junctions: IntArray, pixel: IntArray) -> int:
    """Return the junction that a pixel touches, or -1."""
    u, v = int(pixel[0]), int(pixel[1])
    near = junctions[max(v - 1, 0) : v + 2, max(u - 1, 0) : u + 2]
    return int(near.max()) or -1


def _is_spur(branch: _Branch, width: float) -> bool:
    line, first, last = branch
    return (first < 0 or last < 0) and first != last and len(line) < SPUR_SHARE * width


def _joined_at_junctions(branches: list[_Branch], width: float) -> list[FloatArray]:
    """Return lines: branches joined where two go straight on, the straightest first."""
    ends = [
        (junction, place, end)
        for place, (_, first, last) in enumerate(branches)
        for end, junction in ((0, first), (1, last))
        if junction >= 0
    ]
    used = Counter(junction for junction, _, _ in ends)
    # What begins and ends at a junction that nothing else meets any more is a ring.
    lines = [
        np.vstack([line, line[:1]]) if first == last >= 0 and used[first] == 2 else line
        for line, first, last in branches
    ]
    pairs: list[tuple[float, tuple[int, int], tuple[int, int]]] = []
    for place, (junction, one, end) in enumerate(ends):
        for other_junction, other, other_end in ends[place + 1 :]:
            if other_junction == junction and other != one:
                ahead, back = _direction(lines[one], end, width), _direction(lines[other], other_end, width)
                turn = float(np.arccos(np.clip(-ahead @ back, -1.0, 1.0)))
                # Where a spur was cut off, two branches are left of what was no junction.
                if turn < STRAIGHT or used[junction] == 2:
                    pairs.append((turn, (one, end), (other, other_end)))
    return _chained(lines, pairs)


def _joined_over_breaks(lines: list[FloatArray], width: float) -> list[FloatArray]:
    """Return lines, those joined whose ends face each other over a short break, the shortest first."""
    ends = [(place, end) for place, line in enumerate(lines) for end in (0, 1) if np.abs(line[0] - line[-1]).max() > 0]
    at = np.array([lines[place][-end] for place, end in ends]).reshape(-1, 2)
    out = np.array([_direction(lines[place], end, width) for place, end in ends]).reshape(-1, 2)
    pairs: list[tuple[float, tuple[int, int], tuple[int, int]]] = []
    for one, (place, _) in enumerate(ends):
        away = at[one + 1 :] - at[one]
        apart = np.linalg.norm(away, axis=1)
        for other in one + 1 + np.flatnonzero((apart <= BREAK_SHARE * width) & (apart > 0.0)):
            toward = (at[other] - at[one]) / apart[other - one - 1]
            faces = min(float(out[one] @ toward), float(-out[other] @ toward))
            if ends[other][0] != place and faces > np.cos(AHEAD):
                pairs.append((float(apart[other - one - 1]), ends[one], ends[int(other)]))
    return _chained(lines, pairs)


def _direction(line: FloatArray, end: int, width: float) -> FloatArray:
    """Return the unit vector out of a line at one of its ends, 0 or 1."""
    reach = min(len(line) - 1, max(1, round(DIRECTION_SHARE * width)))
    out = line[-1] - line[-1 - reach] if end else line[0] - line[reach]
    return out / max(float(np.linalg.norm(out)), 1e-12)


def _chained(lines: list[FloatArray], pairs: list[tuple[float, tuple[int, int], tuple[int, int]]]) -> list[FloatArray]:
    """Return lines joined end to end by pairs of (line, end), the smallest first, each end once."""
    partner: dict[tuple[int, int], tuple[int, int]] = {}
    for _, one, other in sorted(pairs):
        if one not in partner and other not in partner:
            partner[one], partner[other] = other, one
    joined = [(one[0], other[0]) for one, other in partner.items()]
    rows, columns = np.array(joined, dtype=np.int64).reshape(-1, 2).T
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(lines), len(lines)))
    count, chain = connected_components(graph, directed=False)
    return [_one_line(lines, np.flatnonzero(chain == number).tolist(), partner) for number in range(count)]


def _one_line(
    lines: list[FloatArray], members: list[int], partner: dict[tuple[int, int], tuple[int, int]]
) -> FloatArray:
    """Return the members of one chain as one line, beginning where it ends free, if it does."""
    free = [(place, end) for place in members for end in (0, 1) if (place, end) not in partner]
    start, end = free[0] if free else (members[0], 0)
    found: list[FloatArray] = []
    place = start
    while True:
        found.append(lines[place] if end == 0 else lines[place][::-1])
        beyond = partner.get((place, 1 - end))
        if beyond is None or beyond[0] == start:
            break
        place, end = beyond
    if not free:
        found.append(found[0][:1])
    return np.vstack(found)
