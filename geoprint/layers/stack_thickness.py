"""The thickness of a stack of layers: what each deposits over places of the part, and all of them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.config import Job
from geoprint.geometry import closest, face_areas, normals, positions, upright_of
from geoprint.layers.feet import Ground
from geoprint.layers.layering import Stack
from geoprint.layers.slices import CutPlane, Slice, middle_planes, sliced, sliced_layer
from geoprint.layers.targets import LayerTarget
from geoprint.lazy import above
from geoprint.metrics import LevelledLayer, Levelling, stretches_of_poses
from geoprint.metrics.executed_flow import deposited_volume, executed_flow, flow_of_all
from geoprint.model import (
    BoolArray,
    FloatArray,
    IntArray,
    Surface,
    SurfacePoints,
    freeze_arrays,
    frozen,
)
from geoprint.results import Plan
from geoprint.workflow.workpiece import read_skin

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    for over in step * np.arange(1, int(np.ceil(target.thickness / step)) + 1):
        inside = np.where(target.depth(feet.at(over)) >= 0.0, over, inside)
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


# What is known of a stack when all of its layers are planned: what each deposits over the part, and how it is sliced.


@final
@frozen
class StackedLayer:
    """What is kept of a planned layer: f flows, k columns over the part, r runs.

    Attributes:
        bottom: height over the part at which it begins [mm].
        height: its own [mm].
        spacing: of its paths [mm].
        deposited: (f, k) its thickness on the columns with constant flow, with the flow that follows width, and where
            there is a robot as the program was executed [mm].
        printed: which of these flows is printed.
        met: (k,) whether a column has met others below its top.
        within: (k,) whether it is between the sides of the stack in its middle.
        volumes: (f,) that these flows deposit [mm3].
        slices: what each of the two middle planes cuts of it.
        places: (p, 3) its paths, run after run [mm].
        offsets: (r + 1,) where each run starts among them.
    """

    bottom: float
    height: float
    spacing: float
    deposited: FloatArray
    printed: int
    met: BoolArray
    within: BoolArray
    volumes: FloatArray
    slices: tuple[Slice, ...]
    places: FloatArray
    offsets: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, deposited="float: f k", met="bool: k", within="bool: k", volumes="float: f", places="float: p 3",
            offsets="int: o",
        )  # fmt: skip

    @property
    def seams(self) -> FloatArray:
        """(r, 3) where its runs start [mm]."""
        return self.places[self.offsets[:-1]]


@final
@frozen
class FinishedStack:
    """A whole stack, as it is simulated.

    Attributes:
        base: the part.
        inputs: name and SHA-256 of its files.
        upright: (3, 3) rotation in which its mean normal is up.
        planes: that slice it open in its middle.
        ground: the line of the part in each of these: (q, 2) places [mm] and where each line starts.
        feet: of the columns.
        wanted: (k,) thickness wanted on these [mm].
        layers: the lowest first.
        flows: how the stack comes out with each flow of its layers; None where nothing can be judged.
        printed: which of these is printed.
    """

    base: Surface
    inputs: tuple[tuple[str, str], ...]
    upright: FloatArray
    planes: tuple[CutPlane, ...]
    ground: tuple[tuple[FloatArray, IntArray], ...]
    feet: ColumnFeet
    wanted: FloatArray
    layers: tuple[StackedLayer, ...]
    flows: tuple[Finished | None, ...]
    printed: int

    def __post_init__(self) -> None:
        freeze_arrays(self, upright="float: 3 3", wanted="float: k")

    def figure(self) -> Figure:
        """Draw it cut across through the middle of the part: all of it, and a piece enlarged.

        Raises:
            FieldError: the plane through the middle meets no layer.
        """
        return above("geoprint.layers.stack_page", "stack_figure")(self)


# How a stack comes out: each layer is simulated where it is planned, and their sum.


# Columns over a part: of a thickness that varies by 2 % they tell the mean to 0.01 %.
COLUMNS = 40_000


def stacked_layer(planned: Plan) -> StackedLayer:
    """Return what is kept of a planned layer.

    Args:
        planned: with a place in a stack, and with the flow chosen.
    """
    place, deposited, poses = planned.workpiece.place, planned.deposited, planned.poses
    assert place is not None  # noqa: S101  # A stack's job names the layer.
    assert deposited is not None  # noqa: S101  # A whole plan has its flow.
    points, widths = poses.surface_points, planned.workpiece.widths
    nominal = place.height * (planned.contours.spacing if widths is None else widths(points))
    constant = np.where(poses.deposit, nominal, 0.0) if deposited.mode == "analog" else poses.flow
    # Constant, following, and as executed.
    flows = [constant, _at(planned, deposited.following_flow)]
    flows += [_executed(planned)] if planned.robot else []
    printed = 2 if planned.robot else int(deposited.mode == "analog")
    spacing = planned.contours.spacing
    pieces = stretches_of_poses(poses, spacing=spacing)
    levelling = Levelling(planned.workpiece.part, spacing=spacing, wanted=widths)
    layer = LevelledLayer(levelling, pieces.places)
    fields = layer.fields(np.column_stack([pieces.volumes(flow) for flow in flows])).T
    ground, feet = Ground(place.base), column_feet(place.base, count=COLUMNS)
    shown = replace(poses, flow=flows[printed])
    rows = np.flatnonzero(poses.deposit)
    return StackedLayer(
        bottom=place.bottom,
        height=place.height,
        spacing=spacing,
        deposited=deposited_over(feet, ground, levelling.surface, fields, bottom=place.bottom, height=place.height),
        printed=printed,
        met=have_met(feet, ground, height=place.bottom + place.height),
        within=within_sides(feet, ground, height=place.middle),
        volumes=np.array([deposited_volume(poses, flow) for flow in flows]),
        slices=tuple(
            sliced_layer(planned.workpiece.part, shown, plane, height=place.height)
            for plane in middle_planes(place.base, upright_of(place.base))
        ),
        places=points[rows],
        offsets=np.append(np.flatnonzero(np.diff(poses.runs[rows], prepend=-1)), rows.size),
    )


def _executed(planned: Plan) -> FloatArray:
    """Return the flow at the poses of a plan that its robot's parts deposit together, as they were executed."""
    cell = planned.workpiece.cell
    deposited = [
        (
            robot.joint_path.poses,
            executed_flow(robot.joint_path.poses, robot.trajectory.pose_times, robot.switching.material, cell=cell),
        )
        for robot in planned.robot
    ]
    # Over a table each part has poses of its own, for travel and attitude depend on how the part stands.
    return deposited[0][1] if planned.tilting is None else flow_of_all(planned.poses, deposited)


def finished_stack(job: Job, stack: Stack, layers: Sequence[StackedLayer]) -> FinishedStack:
    """Return how a stack comes out of its layers, the lowest first.

    Args:
        job: that was planned; its part is read once more.
        stack: in which layers it falls.
        layers: those in which something is printed.

    Raises:
        GeoprintError: as `read_skin`.
    """
    read = read_skin(job)
    base = read.part
    feet, upright = column_feet(base, count=COLUMNS), upright_of(base)
    planes = middle_planes(base, upright)
    wanted = (
        np.full(COLUMNS, stack.thickness)
        if stack.target is None
        else wanted_over(feet, stack.target, height=stack.height)
    )
    met, within = (np.stack(each) for each in zip(*((layer.met, layer.within) for layer in layers), strict=True))
    bottoms = np.array([layer.bottom for layer in layers])
    return FinishedStack(
        base=base,
        inputs=tuple((file.name, file.digest) for file in read.files),
        upright=upright,
        planes=planes,
        ground=tuple(sliced(base, plane) for plane in planes),
        feet=feet,
        wanted=wanted,
        layers=tuple(layers),
        flows=tuple(
            finished(np.stack(deposited), wanted, met=met, within=within, bottoms=bottoms, height=stack.height)
            for deposited in zip(*(layer.deposited for layer in layers), strict=True)
        ),
        printed=layers[0].printed,
    )


def _at(planned: Plan, flow: FloatArray) -> FloatArray:
    """Return a flow at the poses of a plan that was chosen when other travel led between the same deposits."""
    found = np.zeros(planned.poses.count)
    found[planned.poses.deposit] = flow[flow > 0.0]
    return found
