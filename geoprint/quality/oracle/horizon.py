"""What a search over unfolded triangles looks for and carries along: segments of curves, windows and their heap."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple, cast

import numpy as np

from geoprint.kernels import inlined
from geoprint.model import FloatArray, IntArray
from geoprint.quality.oracle.triangles import ComplexArray, FlatMesh

# What `Goal.label` is where every segment counts.
ANY = -1
# The parent of what the point sees itself. For a literal integer numba compiles all that take it once more.
POINT = cast("int", np.int64(-1))


class Segments(NamedTuple):
    """Straight segments of curves, each in one face, sorted by face.

    Attributes:
        first: (m + 1,) segments of face f are first[f] to first[f + 1].
        starts: (p,) where each starts in the plane of its face [mm].
        along: (p,) the way to its end [mm].
        labels: (p,) what is asked for.
        runs: (p,) the run each belongs to.
        arcs: (p,) arc length of its middle within the run [mm].
        loops: (p,) length of the run where it is closed, else infinity [mm].
    """

    first: IntArray
    starts: ComplexArray
    along: ComplexArray
    labels: IntArray
    runs: IntArray
    arcs: FloatArray
    loops: FloatArray


class Goal(NamedTuple):
    """What a search looks for.

    Attributes:
        label: only segments with it count, or `ANY`.
        run: segments of this run nearer along it than `clear` to `arc` do not count; -1 for none.
        arc: [mm].
        clear: [mm].
        aimed: whether to search towards a place first.
        x: that place in space [mm].
        y: likewise.
        z: likewise.
    """

    label: int
    run: int
    arc: float
    clear: float
    aimed: bool
    x: float
    y: float
    z: float


class Horizon(NamedTuple):
    """The windows and turns of one search; changed in place.

    Attributes:
        halves: (c,) half-edge over which a window looks, into the face on its left; of a turn -1 - the half-edge that
            starts at its vertex.
        parents: (c,) window or turn that each comes from, -1 where that is the point itself.
        starts: (c,) start of the edge as seen from the source at 0; of a turn its vertex [mm].
        ends: (c,) end of the edge; of a turn its half-edge, from the vertex [mm].
        rights: (c,) right side of the cone.
        lefts: (c,) left side of the cone.
        before: (c,) length of the path to the source [mm].
        keys: (c,) heap of least distances [mm].
        items: (c,) what they belong to.
        counts: how many windows there are; how many wait in the heap; how many are allowed.
        visited: (n,) number of the last search that turned at each vertex.
        least: (3 m,) how far every half-edge is at least from whatever is looked for [mm]; 0 where nobody knows.
        found: nearest segment so far, and the window and the face in which it is seen.
        best: its distance [mm], and the share of the segment at which it is nearest.
        seen: where it is nearest, from the source of that window [mm].
    """

    halves: IntArray
    parents: IntArray
    starts: ComplexArray
    ends: ComplexArray
    rights: ComplexArray
    lefts: ComplexArray
    before: FloatArray
    keys: FloatArray
    items: IntArray
    counts: IntArray
    visited: IntArray
    least: FloatArray
    found: IntArray
    best: FloatArray
    seen: ComplexArray


def empty_horizon(mesh: FlatMesh, *, windows: int, least: FloatArray | None = None) -> Horizon:
    """Return room for searches of so many windows, and what is known of the way behind every half-edge."""
    return Horizon(
        halves=np.zeros(windows, dtype=np.int64),
        parents=np.zeros(windows, dtype=np.int64),
        starts=np.zeros(windows, dtype=np.complex128),
        ends=np.zeros(windows, dtype=np.complex128),
        rights=np.zeros(windows, dtype=np.complex128),
        lefts=np.zeros(windows, dtype=np.complex128),
        before=np.zeros(windows),
        keys=np.zeros(windows),
        items=np.zeros(windows, dtype=np.int64),
        counts=np.array([0, 0, windows]),
        visited=np.full(mesh.totals.size, -1),
        least=np.zeros(mesh.starts.size) if least is None else least,
        found=np.zeros(3, dtype=np.int64),
        best=np.zeros(2),
        seen=np.zeros(1, dtype=np.complex128),
    )


@inlined
def add(
    mesh: FlatMesh, horizon: Horizon, goal: Goal, half: int, start: complex, end: complex, right: complex,
    left: complex, before: float, parent: int, ahead: float,
) -> int:  # fmt: skip
    """Put a window or a turn into the heap, unless it is too far; return its number."""
    key = before + ahead
    edge = half if half >= 0 else -1 - half
    if key + horizon.least[edge] >= horizon.best[0]:
        return -1
    if goal.aimed:
        x, y, z = mesh.middles[edge, 0] - goal.x, mesh.middles[edge, 1] - goal.y, mesh.middles[edge, 2] - goal.z
        key += max(sqrt(x * x + y * y + z * z) - mesh.halves[edge], 0.0)
    if key >= horizon.best[0] or horizon.counts[0] >= horizon.counts[2]:
        return -1
    item = horizon.counts[0]
    horizon.counts[0] += 1
    horizon.halves[item], horizon.parents[item], horizon.before[item] = half, parent, before
    horizon.starts[item], horizon.ends[item], horizon.rights[item], horizon.lefts[item] = start, end, right, left
    hole = horizon.counts[1]
    horizon.counts[1] += 1
    while hole > 0 and horizon.keys[(hole - 1) // 2] > key:
        horizon.keys[hole], horizon.items[hole] = horizon.keys[(hole - 1) // 2], horizon.items[(hole - 1) // 2]
        hole = (hole - 1) // 2
    horizon.keys[hole], horizon.items[hole] = key, item
    return item


@inlined
def pop(horizon: Horizon) -> int:
    """Take the least out of the heap."""
    item = horizon.items[0]
    horizon.counts[1] -= 1
    count = horizon.counts[1]
    key, last = horizon.keys[count], horizon.items[count]
    hole = 0
    while 2 * hole + 1 < count:
        child = 2 * hole + 1
        if child + 1 < count and horizon.keys[child + 1] < horizon.keys[child]:
            child += 1
        if horizon.keys[child] >= key:
            break
        horizon.keys[hole], horizon.items[hole] = horizon.keys[child], horizon.items[child]
        hole = child
    horizon.keys[hole], horizon.items[hole] = key, last
    return item


@inlined
def cross(first: complex, second: complex) -> float:
    """Return the cross product: positive where the second points to the left of the first."""
    return first.real * second.imag - first.imag * second.real
