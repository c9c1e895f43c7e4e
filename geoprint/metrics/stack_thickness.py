"""The thickness of a stack of layers: what each deposits over places of the part, and all of them together."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.geometry import closest, face_areas, normals, positions
from geoprint.layers import LayerTarget
from geoprint.layers.feet import Ground
from geoprint.model import (
    BoolArray,
    FloatArray,
    IntArray,
    Surface,
    SurfacePoints,
    freeze_arrays,
    frozen,
)

# Columns over a part: they stand on places of it, upright, and meet a layer where that has the height of its middle.
#
# On a bulge the lines of a layer fan out, so volume over an area of the part grows with height; thickness along a
# column does not, and is what adds up. In a hollow columns lean together, and over a crease they meet: from there on
# nothing belongs to one of them alone, and what is deposited higher is nobody's. Layers end at sides that the normals
# of the rim rule, and these turn along it more smoothly than triangles do: a column on one of its triangles may lean
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
