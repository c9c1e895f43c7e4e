"""The thickness of a stack of layers: what each deposits over places of the part, and all of them together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.geometry import closest, face_areas, normals, positions
from geoprint.layers import LayerTarget
from geoprint.layers.feet import Ground
from geoprint.model import (
    BoolArray,
    Cell,
    FloatArray,
    IntArray,
    PoseStream,
    Surface,
    SurfacePoints,
    freeze_arrays,
    frozen,
)

# What a program deposits along its path, as it was executed: from when material flows and when the tip is where.
#
# A valve that is only open or shut lets the same volume through in every second, so that where the tip is slower
# more is deposited to a mm of path. An output that follows the speed of the tip deposits what was planned to a mm.


def executed_flow(poses: PoseStream, times: FloatArray, material: FloatArray, *, cell: Cell) -> FloatArray:
    """Return the (p,) flow at the poses that a program deposits, as it was executed [mm3/mm].

    With 'io' the valve lets through a volume a second: that of the set speed. A flow that settles rises evenly while
    the tip waits at the start of a deposit, where half of that volume comes to lie. With 'analog' the flow follows the
    speed.

    Args:
        poses: p of them, as the robot makes them, with the flow that was planned.
        times: (p,) when each is passed [s].
        material: (d, 2) when material begins and ends to flow, in order [s].
        cell: its signals and speed.
    """
    if cell.signals.mode == "analog":
        return flow_by_length(poses, times, material)
    rate = float(poses.flow.max()) * cell.process.speed
    return flow_by_time(poses, times, material, rate=rate, settle=cell.signals.settle)


def flow_by_time(
    poses: PoseStream, times: FloatArray, material: FloatArray, *, rate: float, settle: float = 0.0
) -> FloatArray:
    """Return the (p,) flow at the poses that a valve leaves which is open or shut [mm3/mm].

    Args:
        poses: p of them, as the robot makes them.
        times: (p,) when each is passed [s].
        material: (d, 2) when material begins and ends to flow, in order [s].
        rate: volume that flows in a second [mm3/s].
        settle: how long the flow rises to that where a deposit begins, of which the times know nothing [s].
    """
    begins = poses.deposited & ~np.insert(poses.deposited[:-1], 0, np.False_)
    return _spread(poses, rate * (_open(times, material) + begins * settle / 2.0))


def flow_by_length(poses: PoseStream, times: FloatArray, material: FloatArray) -> FloatArray:
    """Return the (p,) flow at the poses that an output leaves which follows the speed of the tip [mm3/mm].

    Args:
        poses: p of them, as the robot makes them, with the flow that was planned.
        times: (p,) when each is passed [s].
        material: (d, 2) when material begins and ends to flow, in order [s].
    """
    took = np.diff(times)
    shares = np.divide(_open(times, material), took, out=np.ones_like(took), where=took > 0.0)
    return _spread(poses, shares * poses.bead_lengths * (poses.flow[:-1] + poses.flow[1:]) / 2.0)


def flow_of_all(whole: PoseStream, parts: Sequence[tuple[PoseStream, FloatArray]]) -> FloatArray:
    """Return the (p,) flow at the poses of a deposit that several parts of a program deposit together [mm3/mm].

    Each step of a part lies on a step of the whole, as `paths.check_sum` has found: its volume is added to that one.

    Args:
        whole: p poses, as they were planned.
        parts: poses and flow of each, in the part's own coordinates wherever it stood.
    """
    rows, middles, _ = _steps(whole, np.zeros(whole.count))
    tree, volumes = KDTree(middles), np.zeros(whole.count - 1)
    for poses, flow in parts:
        _, places, deposited = _steps(poses, flow)
        np.add.at(volumes, rows[np.asarray(tree.query(places)[1])], deposited)
    return _spread(whole, volumes)


def deposited_volume(poses: PoseStream, flow: FloatArray) -> float:
    """Return the volume that a (p,) flow deposits along a path [mm3]: linear between the poses [mm3/mm]."""
    return float((poses.bead_lengths * (flow[:-1] + flow[1:]) / 2.0)[poses.deposited].sum())


def deposited_shares(poses: PoseStream, flow: FloatArray, *, layer_height: float) -> tuple[IntArray, FloatArray]:
    """Return the (r,) runs that deposit, and the volume that each gets over the one that was planned.

    A run that is shorter than its bead is wide is a dot: what it gets too much or too little is counted over a dot.

    Args:
        poses: p of them, as the robot makes them, with the flow that was planned.
        flow: (p,) that is deposited [mm3/mm].
        layer_height: [mm].
    """
    rows = np.flatnonzero(poses.deposited)
    runs, own = np.unique(poses.runs[rows + 1], return_inverse=True)
    found, wanted = (
        np.bincount(own, (poses.bead_lengths * (each[:-1] + each[1:]) / 2.0)[rows]) for each in (flow, poses.flow)
    )
    widest = float(poses.flow.max())
    return runs, 1.0 + (found - wanted) / np.maximum(wanted, widest * widest / layer_height)


def _steps(poses: PoseStream, flow: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return first poses (k,) of the steps that deposit material, their middles (k, 3) and volumes (k,) [mm, mm3]."""
    rows, places = np.flatnonzero(poses.deposited), poses.surface_points
    volumes = poses.bead_lengths * (flow[:-1] + flow[1:]) / 2.0
    return rows, (places[rows] + places[rows + 1]) / 2.0, volumes[rows]


def _open(times: FloatArray, material: FloatArray) -> FloatArray:
    """Return (p - 1,) how long material flows between each moment and the next [s]."""
    moments = np.concatenate([[-np.inf], material.ravel(), [np.inf]])
    before = np.searchsorted(moments, times, side="right") - 1
    passed = np.concatenate([[0.0], np.cumsum(material[:, 1] - material[:, 0])])
    # Between the two ends of a span it flows, and its number is half of that of its moment.
    flowing, span = before % 2 == 1, before // 2
    until = passed[span] + np.where(flowing, times - np.where(flowing, moments[before], 0.0), 0.0)
    return np.diff(until)


def _spread(poses: PoseStream, volumes: FloatArray) -> FloatArray:
    """Return the (p,) flow at poses that deposits the (p - 1,) volumes between them, shared by the poses at both ends.

    A volume where the tip stands still comes to its neighbours.
    """
    deposited = np.where(poses.deposited, volumes, 0.0)
    lengths = np.where(poses.deposited, poses.bead_lengths, 0.0)
    total, along = (np.append(each, 0.0) + np.insert(each, 0, 0.0) for each in (deposited, lengths))
    return np.divide(total, along, out=np.zeros_like(total), where=along > 0.0)


# Columns over a part: they stand on places of it, upright, and meet a layer where that has the height of its middle.
#
# On a bulge the lines of a layer fan out, so volume over an area of the part grows with height; thickness along a
# column does not, and is what adds up. In a hollow columns lean together, and over a crease they meet: from there on
# nothing belongs to one of them alone, and what is laid higher is nobody's. Layers end at sides that the normals of
# the rim rule, and these turn along it more smoothly than triangles do: a column on one of its triangles may lean
# out through them, and what is wanted on it ends there.


# Steps of the additive sequence that spreads places over a triangle: powers of one over the root of x^3 = x + 1.
STEPS = (0.7548776662466927, 0.5698402909980532)
# A column has met others where it is nearer to the part than it is high by more than this share of its height: less
# comes of the angles between triangles.
NEARER_SHARE = 0.05
# A column passes a layer by where that ends farther beside it than this share of the layer's height: rims of layers
# are cut as exactly.
BESIDE_SHARE = 0.25
# The end of a target is looked for at heights so far apart, over the height of a layer.
LOOKED_AT_SHARE = 0.25
# Halvings of that until it is known to a hundredth of it.
HALVINGS = 7


@final
@frozen
class ColumnFeet:
    """Where columns stand on a part, each for the same area.

    Attributes:
        places: (k, 3) [mm].
        upright: (k, 3) outward unit normals of the part.
    """

    places: FloatArray
    upright: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, places="float: k 3", upright="float: k 3")

    def at(self, height: float | FloatArray) -> FloatArray:
        """Return the (k, 3) places of the columns at a height, or at (k,) heights [mm]."""
        return self.places + np.reshape(height, (-1, 1)) * self.upright


def column_feet(part: Surface, *, count: int) -> ColumnFeet:
    """Return places of a part that are spread evenly by area: the same ones for the same part.

    They lie in the middles of equal shares of the area, triangle after triangle, and within these where an additive
    sequence has them [Roberts2018].

    Args:
        part: m faces.
        count: how many.
    """
    areas: FloatArray = np.cumsum(face_areas(part))
    middles = (np.arange(count) + 0.5) * (areas[-1] / count)
    faces: IntArray = np.asarray(np.searchsorted(areas, middles), dtype=np.int64)
    square: FloatArray = np.mod(0.5 + np.outer(np.arange(count), STEPS), 1.0)
    # Half of the square is a triangle; the other half is turned onto it.
    pair = np.where(square.sum(axis=1, keepdims=True) > 1.0, 1.0 - square, square)
    points = SurfacePoints(faces, np.column_stack([1.0 - pair.sum(axis=1), pair]))
    return ColumnFeet(positions(part, points), normals(part, points))


def deposited_over(
    feet: ColumnFeet, ground: Ground, level: Surface, thicknesses: FloatArray, *, bottom: float, height: float
) -> FloatArray:
    """Return how thick a layer becomes on each column.

    Args:
        feet: of k columns.
        ground: the part that they stand on.
        level: the layer in its middle, n vertices.
        thicknesses: (f, n) of the layer there, with each of f flows [mm].
        bottom: height at which the layer begins [mm].
        height: its own [mm].

    Returns:
        (f, k) [mm], 0 where the layer is not.
    """
    middle = bottom + height / 2.0
    # Between triangles, and where columns lean together, a place of one is nearer to the part than it is high.
    points, beside = closest(level, ground.raised(feet.at(middle), middle))
    return np.where(beside > BESIDE_SHARE * height, 0.0, [points.values(level, each) for each in thicknesses])


def have_met(feet: ColumnFeet, ground: Ground, *, height: float) -> BoolArray:
    """Say which of (k,) columns have met others below a height over the part [mm]."""
    return ground.feet(feet.at(height))[1] < (1.0 - NEARER_SHARE) * height


def within_sides(feet: ColumnFeet, ground: Ground, *, height: float) -> BoolArray:
    """Say which of (k,) columns are still between the sides of what layers can fill at a height over the part [mm].

    It is asked of the rim of the part, not of any layer: a layer that ends too early is found by it.
    """
    places = ground.raised(feet.at(height), height)
    return ground.beyond(places, ground.feet(places)[0]) <= 0.0


def wanted_over(feet: ColumnFeet, target: LayerTarget, *, height: float) -> FloatArray:
    """Return the (k,) height at which a target ends on each column [mm]; 0 where nothing of it is.

    Args:
        feet: of k columns.
        target: what the layers fill.
        height: of a layer [mm].
    """
    step = LOOKED_AT_SHARE * height
    inside = np.zeros(len(feet.places))
    for above in step * np.arange(1, int(np.ceil(target.thickness / step)) + 1):
        inside = np.where(target.depth(feet.at(above)) >= 0.0, above, inside)
    low, high = inside, np.where(inside > 0.0, inside + step, 0.0)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        within = target.depth(feet.at(middle)) >= 0.0
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    return np.minimum(low, target.thickness)


# The finished stack: the thickness of all layers together over the part, against what was wanted there.


# A thickness this near to the wanted one, as a share of it, is within.
WITHIN = 0.05


@final
@frozen
class Finished:
    """The thickness of a stack on columns that stand for equal areas, over the one that was wanted.

    Attributes:
        ratios: (k,) thickness over the wanted one; NaN where it is not judged.
        mean: of these.
        cv: their standard deviation over the mean.
        p1: 1 of 100 is thinner.
        p99: 1 of 100 is thicker.
        within_5_percent: share that is so near to the wanted one.
        judged: share of the wanted area that these stand for.
        creased: share of it whose columns meet others before they are as high as wanted.
        under_sides: share of it whose columns leave the stack through a side before: they are judged up to there.
    """

    ratios: FloatArray
    mean: float
    cv: float
    p1: float
    p99: float
    within_5_percent: float
    judged: float
    creased: float
    under_sides: float

    def __post_init__(self) -> None:
        ratios = np.array(self.ratios, dtype=np.float64)
        ratios.setflags(write=False)
        object.__setattr__(self, "ratios", ratios)


def finished(
    deposited: FloatArray, wanted: FloatArray, *, met: BoolArray, within: BoolArray, bottoms: FloatArray, height: float
) -> Finished | None:
    """Return how a stack comes out.

    Whole layers cannot fill a target that is lower than one of them: such places are not judged, and what a target
    leaves out is not wanted. Layers are cut upright where the sides pass their middles, so that a column which leaves
    through a side is wanted to have the whole layers below that, and nothing higher counts.

    Args:
        deposited: (l, k) thickness of each layer on each column [mm].
        wanted: (k,) thickness that the stack shall have there [mm].
        met: (l, k) whether a column has met others below the top of each layer.
        within: (l, k) whether it is between the sides in the middle of each layer.
        bottoms: (l,) height at which each layer begins [mm].
        height: of a layer [mm].

    Returns:
        The figures, or None where nothing can be judged.
    """
    asked = wanted > 0.0
    standing = np.logical_and.accumulate(within, axis=0)
    leaving = np.where(standing.all(axis=0), np.inf, bottoms[standing.argmin(axis=0)])
    under_sides = leaving + WITHIN * height < wanted
    wanted = np.minimum(wanted, leaving)
    creased = (met & (bottoms[:, None] + WITHIN * height < wanted)).any(axis=0)
    judged = asked & ~creased & (wanted >= (1.0 - WITHIN) * height)
    if not judged.any():
        return None
    ratios = np.full(wanted.size, np.nan)
    ratios[judged] = np.where(standing, deposited, 0.0)[:, judged].sum(axis=0) / wanted[judged]
    found = ratios[judged]
    p1, p99 = np.percentile(found, (1.0, 99.0)).tolist()
    return Finished(
        ratios=ratios,
        mean=float(found.mean()),
        cv=float(found.std() / found.mean()) if found.mean() > 0.0 else 0.0,
        p1=p1,
        p99=p99,
        within_5_percent=float((np.abs(found - 1.0) <= WITHIN).mean()),
        judged=float(judged.sum() / asked.sum()),
        creased=float((asked & creased).sum() / asked.sum()),
        under_sides=float((asked & under_sides & ~creased).sum() / asked.sum()),
    )
