"""Whether inflated solids touch anything: FCL in millimetres, guarded against what FCL does not notice.

FCL answers 'free' for a pose that is not a number, stops the program on an empty model and knows nothing of insides;
so poses and models are checked before it sees them, and every set of objects first has to find hits and misses that
are known. All happens in the frame of the targets: the work frame, or that of the tool for the links of the arm.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import count
from threading import Lock
from typing import final

import fcl
import numpy as np

from geoprint import transforms
from geoprint.errors import InputError, VerificationError
from geoprint.model import BoolArray, Box, FloatArray, IntArray, Lamp, Tool
from geoprint.robot.collision.surroundings import Target, box_target, convex_models, fcl_transform, mesh_model
from geoprint.robot.collision.tool_solids import Solid, inflated_profile, sides_of, tool_solids

# By how much a solid is inflated on top of its clearance [mm]: reaches are rounded up to the next of these. The
# largest are for many steps at a time.
REACHES = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 1.0, 1.4, 2.0, 4.0, 12.0)
# The same for links of the arm, which are mostly far away; even at rest they are inflated by the first.
ARM_REACHES = (0.02, 0.04, 0.07, 0.3, 1.2, 4.0, 16.0)
# By how much the reaches of the finest steps, up to the first of a link, are rounded up at most [mm].
REACH_STEP = 0.01
# The reach of a solid that is not to be tested at a placement.
NOT_TESTED = -1.0
# Noise of sums of reaches [mm]; angles from the inverse kinematics are right to far less.
REACH_ROUNDING = 1e-6
# How far entries of R^T R may be from the identity: poses are products of a few rotations.
RIGID_TOLERANCE = 1e-6
# The plate of the control stands this much nearer or farther than the inflated side [mm], besides what the polygon
# around its circle adds.
CONTROL_GAP = 0.1
# Side of that plate [mm].
CONTROL_PLATE = 1.0


@final
class InflatedSolids:
    """Solids that move together, each inflated by the distance it keeps and by every reach.

    The constructor runs controls: a plate close to the side of each inflated solid is hit or missed as it must be.

    Args:
        solids: s solids in the frame that moves with them.
        kept: (s,) distance that each solid keeps [mm]; it is inflated by this and its reach.
        reaches: ascending [mm].
        known: others with the same reaches, whose models of the very same solids at the same distance serve here too.

    Attributes:
        solids: as given.
        kept: as given.
        reaches: (r,) as given.
        objects: [s][r] for FCL, which are moved to where they are asked about.
        asking: held by whoever moves them, until the answer is there.
        radii: (s, r) no point of an inflated solid is farther from the axis, along it neither [mm].

    Raises:
        VerificationError: a control fails; nothing that FCL says can be trusted then.
    """

    __slots__ = ("asking", "kept", "objects", "radii", "reaches", "solids")

    def __init__(
        self,
        solids: tuple[Solid, ...],
        *,
        kept: tuple[float, ...],
        reaches: tuple[float, ...] = REACHES,
        known: InflatedSolids | None = None,
    ) -> None:
        self.solids = solids
        self.kept = kept
        self.reaches = np.array(reaches)
        self.asking = Lock() if known is None else known.asking
        self.objects: list[list[fcl.CollisionObject]] = []
        self.radii = np.zeros((len(solids), len(reaches)))
        ready = {} if known is None else dict(zip(zip(known.solids, known.kept, strict=True), count()))
        for index, (solid, distance) in enumerate(zip(solids, kept, strict=True)):
            if known is not None and (solid, distance) in ready:
                self.objects.append(known.objects[ready[solid, distance]])
                self.radii[index] = known.radii[ready[solid, distance]]
                continue
            inflations = [distance + reach for reach in reaches]
            profiles = [inflated_profile(solid, by=by) for by in inflations]
            self.objects.append(convex_models(solid, profiles))
            polygon = np.cos(np.pi / sides_of(solid))
            self.radii[index] = [profile[:, 1].max() / polygon for profile in profiles]
            _control_sides(self.objects[-1], solid, inflations=inflations, radii=self.radii[index].tolist())


# FCL takes a tenth of a second for the links of an arm and two for a tool, and every check of the same cell needs them.
@lru_cache(maxsize=64)
def inflated_solids(
    solids: tuple[Solid, ...], kept: tuple[float, ...], reaches: tuple[float, ...] = REACHES
) -> InflatedSolids:
    """Return inflated solids, which all worlds share that ask for the very same ones."""
    return InflatedSolids(solids, kept=kept, reaches=reaches)


@final
class CollisionWorld:
    """Inflated solids that move together, and everything they must not touch.

    The constructor runs controls: each inflated solid hits every target that it is put on, and misses it beside.

    Args:
        inflated: s solids of the tool or of a link.
        targets: t things they must not touch.
        known: another world, whose controls of the very same models and targets stand.

    Attributes:
        inflated: as given.
        solids: the solids.
        reaches: (r,) by how much they are inflated besides what they keep [mm].
        targets: as given.

    Raises:
        VerificationError: a control fails; nothing that FCL says can be trusted then.
    """

    __slots__ = ("_bounds", "inflated", "reaches", "solids", "targets")

    def __init__(
        self, inflated: InflatedSolids, *, targets: tuple[Target, ...], known: CollisionWorld | None = None
    ) -> None:
        self.inflated = inflated
        self.solids = inflated.solids
        self.reaches = inflated.reaches
        self.targets = targets
        self._bounds = [target.bounds for target in targets]
        highest = {target: target.triangles.max(axis=(0, 1)) for target in targets}
        for models, solid, radii in zip(inflated.objects, self.solids, inflated.radii.tolist(), strict=True):
            controlled = () if known is None or not known.has(models) else known.targets
            new = [target for target in targets if target not in controlled]
            for model, radius in zip(models, radii, strict=True):
                size = solid.length + 2 * radius
                for target in new:
                    _control_target(model, solid, target, size=size, corner=highest[target])

    def has(self, models: list[fcl.CollisionObject]) -> bool:
        """Say whether models are those of one of its inflated solids."""
        return any(models is one for one in self.inflated.objects)

    def touches(self, poses: FloatArray, *, reaches: FloatArray) -> BoolArray:
        """Say which inflated solids touch which targets.

        Args:
            poses: (k, 4, 4) of the solids in the frame of the targets [mm].
            reaches: (k, s) inflation on top of the kept distance [mm], rounded up to one that there is;
                NOT_TESTED leaves a solid out.

        Returns:
            (k, s, t) whether they touch.

        Raises:
            InputError: a pose is not a rigid transform of finite numbers, or a reach is beyond the largest.
        """
        check_rigid(poses)
        found = np.zeros((*reaches.shape, len(self.targets)), dtype=np.bool_)
        largest = float(self.reaches[-1])
        if not (reaches <= largest + REACH_ROUNDING).all():
            raise InputError(
                f"a solid would have to grow by {np.max(reaches):.1f} mm to cover a step of its path, at most "
                f"{largest} mm is allowed. Sample the path more finely, or smooth a rough part (`geoprint remesh "
                "--smooth`)."
            )
        rows = np.flatnonzero((reaches > NOT_TESTED).any(axis=1))
        classes = np.searchsorted(self.reaches + REACH_ROUNDING, reaches[rows])
        near = self._near(poses[rows], classes=classes) & (reaches[rows] > NOT_TESTED)[:, :, None]
        places = {row: fcl_transform(poses[rows[row]]) for row in np.flatnonzero(near.any(axis=(1, 2))).tolist()}
        request = fcl.CollisionRequest()
        with self.inflated.asking:
            for row, solid, target in np.argwhere(near).tolist():
                inflated = self.inflated.objects[solid][int(classes[row, solid])]
                inflated.setTransform(places[row])
                result = fcl.CollisionResult()
                found[rows[row], solid, target] = fcl.collide(inflated, self.targets[target].model, request, result) > 0
        return found

    def _near(self, poses: FloatArray, *, classes: IntArray) -> BoolArray:
        """Return (k, s, t) whether the bounding boxes of inflated solid and target overlap."""
        near = np.zeros((len(poses), len(self.solids), len(self.targets)), dtype=np.bool_)
        for index, solid in enumerate(self.solids):
            start = poses[:, :3, :3] @ solid.start + poses[:, :3, 3]
            end = poses[:, :3, :3] @ solid.end + poses[:, :3, 3]
            radius = self.inflated.radii[index][classes[:, index]][:, None]
            for column, (target, (lowest, highest)) in enumerate(zip(self.targets, self._bounds, strict=True)):
                first, last = start @ target.axes, end @ target.axes
                low, high = np.minimum(first, last) - radius, np.maximum(first, last) + radius
                near[:, index, column] = ((low <= highest) & (high >= lowest)).all(axis=1)
        return near


def check_rigid(poses: FloatArray) -> None:
    """Refuse what is not a set of rigid transforms.

    Args:
        poses: (k, 4, 4).

    Raises:
        InputError: there is no pose, or one is not finite, not a rotation, or mirrored.
    """
    if poses.ndim != 3 or poses.shape[1:] != (4, 4) or len(poses) == 0:
        raise InputError(f"the collision check needs poses of shape (k, 4, 4), k at least 1; found {poses.shape}.")
    rotations = poses[:, :3, :3]
    rigid = np.isfinite(poses).all(axis=(1, 2))
    with np.errstate(invalid="ignore"):
        deviation = np.abs(rotations @ np.swapaxes(rotations, 1, 2) - np.eye(3)).max(axis=(1, 2))
        rigid &= (deviation < RIGID_TOLERANCE) & (np.linalg.det(rotations) > 0.0)
        rigid &= (poses[:, 3] == [0.0, 0.0, 0.0, 1.0]).all(axis=1)
    if not rigid.all():
        row = int(np.argmin(rigid))
        raise InputError(
            f"pose {row} of {len(poses)} is not a rigid transform of finite numbers, and a collision check would "
            "call it free; correct what made the pose.",
            pose=row,
        )


def collision_control() -> str:
    """Run the controls of the collision check alone, on a tool of usual size.

    Returns:
        A line that says what was found right.

    Raises:
        VerificationError: a known hit is missed, a known miss is hit, or a pose that is not a number passes.
    """
    tool = Tool(
        T_flange_tool=transforms.rigid(np.eye(3), np.array([0.0, 0.0, 160.0])),
        needle_length=25.4, needle_diameter=1.3, inner_diameter=0.84, cone_half_angle=float(np.radians(10.0)),
        barrel_diameter=20.0, barrel_top=120.0, bracket_length=40.0, bracket_diameter=30.0,
        mass_kg=0.6, cog=np.zeros(3), inertia_kg_m2=np.zeros(3),
        lamp=Lamp(transforms.rigid(np.eye(3), np.array([50.0, 0.0, 20.0])), length=60.0, diameter=25.0),
    )  # fmt: skip
    solids = tool_solids(tool)
    post = box_target(Box("control", np.zeros(3), np.array([1.0, 2.0, 3.0])), T_work_base=np.eye(4))
    world = CollisionWorld(InflatedSolids(solids, kept=tuple(0.5 for _ in solids)), targets=(post,))
    try:
        world.touches(np.full((1, 4, 4), np.nan), reaches=np.zeros((1, len(solids))))
    except InputError:
        return (
            f"python-fcl {fcl.__version__}: {2 * 2 * len(solids) * len(REACHES)} known hits and misses found right, "
            "a pose that is not a number refused"
        )
    raise VerificationError("the collision check accepts a pose that is not a number; do not use it.")


def _control_sides(
    objects: list[fcl.CollisionObject], solid: Solid, *, inflations: list[float], radii: list[float]
) -> None:
    """Test a solid, inflated by some distances and so wide then, on a plate close to its side."""
    slope = (solid.end_radius - solid.start_radius) / solid.length
    aside = solid.frame[:, 0]
    outward = (aside - slope * solid.axis) / np.hypot(1.0, slope)
    along = np.cross(solid.frame[:, 1], outward).astype(np.float64)
    corners: FloatArray = CONTROL_PLATE / 2 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    plate = solid.centre + aside * (solid.start_radius + solid.end_radius) / 2
    plate = plate + corners @ np.array([along, solid.frame[:, 1]])
    model = mesh_model(plate, np.array([[0, 1, 2], [0, 2, 3]]))
    beyond_circle = 1.0 / np.cos(np.pi / sides_of(solid)) - 1.0
    for inflated, by, radius in zip(objects, inflations, radii, strict=True):
        inflated.setTransform(fcl.Transform())
        polygon = radius * beyond_circle
        for gap, known in ((-CONTROL_GAP, True), (CONTROL_GAP + polygon, False)):
            model.setTransform(fcl.Transform(np.eye(3), (by + gap) * outward))
            _expect(inflated, model, known=known, solid=solid, name="plate")


def _control_target(
    inflated: fcl.CollisionObject, solid: Solid, target: Target, *, size: float, corner: FloatArray
) -> None:
    """Test an inflated solid on a target and beside its highest corner; no two of its points are farther apart."""
    onto = target.triangles[0].mean(axis=0) - solid.centre
    beside = corner - solid.centre + 2 * size
    for shift, known in ((onto, True), (beside, False)):
        inflated.setTransform(fcl.Transform(np.eye(3), shift))
        _expect(inflated, target.model, known=known, solid=solid, name=target.name)


def _expect(inflated: fcl.CollisionObject, model: fcl.CollisionObject, *, known: bool, solid: Solid, name: str) -> None:
    found = fcl.collide(inflated, model, fcl.CollisionRequest(), fcl.CollisionResult()) > 0
    if found != known:
        raise VerificationError(
            f"the collision check is wrong: a known {'hit' if known else 'miss'} of the {solid.name} and the {name} "
            f"was reported as a {'hit' if found else 'miss'}. Check the installation of python-fcl."
        )
