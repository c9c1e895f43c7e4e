"""Clearance: tool and arm against part, surroundings and obstacles, along motions and at poses."""

from __future__ import annotations

import operator
from dataclasses import replace
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import ClearanceError, InputError
from geoprint.geometry import in_words, triple
from geoprint.model import (
    BoolArray,
    Box,
    Clearance,
    ControllerPath,
    FloatArray,
    Obstacle,
    PoseStream,
    Process,
    Surface,
    Tool,
)
from geoprint.robot.arm import Arm
from geoprint.robot.collision.arm_clearance import (
    LINKS_APART_FROM_TOOL,
    ArmCheck,
    arm_motion,
    pairs_of_links,
    with_whole_needle,
)
from geoprint.robot.collision.closest import Closest, ranking_trees, smallest_distance, worst_hit
from geoprint.robot.collision.contact import NOT_TESTED, CollisionWorld, InflatedSolids, check_rigid, inflated_solids
from geoprint.robot.collision.surroundings import Target, mesh_target, obstacle_target, solid_target
from geoprint.robot.collision.sweep import ALLOWANCE, Hits, Placements, find_hits, refuse_tool_inside
from geoprint.robot.collision.tip_zone import SMALLEST_ROOM, TipZone, refuse_rim, refuse_rim_at
from geoprint.robot.collision.tool_solids import Solid, link_solids, tool_solids
from geoprint.threads import both

# The tool and what it must not touch, prepared once for all motions of the tool past it.


# A box that ends no higher than this in the base frame is what the arm stands on [mm]: rounding of centre and size.
FOOT_ROUNDING = 1e-6


@final
class CheckedWorld:
    """The tool, inflated, and what it must not touch.

    Args:
        tool: its solids.
        process: clearance to keep.
        part: the surface that is printed on.
        body: what it lies on, or None.
        obstacles: what stands in the cell, in the base frame.
        T_work_base: (4, 4) base frame in the work frame [mm].
        known: another of the very same tool, process, part and body, whose preparation of these serves here too.

    Attributes:
        kept: distance that each solid keeps [mm].
        bodies: the part and the body as targets, the first of all.
        tool: its solids, inflated.
        nominal: tool and targets, with the tip as long as it is.
        targets: what the tool must not touch: part, body, obstacles.
        base_targets: those that the base of the arm must not touch: not what it stands on.
        trees: fragments of the targets.
        zones: the targets as the needle's end passes over them.
        has_body: whether the body is known.

    Raises:
        InputError: tool, process or an obstacle is impossible.
        VerificationError: the collision check fails on what is known.
    """

    __slots__ = ("base_targets", "bodies", "has_body", "kept", "nominal", "targets", "tool", "trees", "zones")

    def __init__(
        self,
        tool: Tool,
        *,
        process: Process,
        part: Surface,
        body: Surface | None,
        obstacles: tuple[Obstacle, ...],
        T_work_base: FloatArray,
        known: CheckedWorld | None = None,
    ) -> None:
        if not 0.0 <= process.clearance < np.inf:
            raise InputError(f"process: the clearance is {process.clearance} mm; correct it to zero or more.")
        solids = tool_solids(tool)
        self.kept = tuple(process.clearance if solid.reach_below > 0.0 else 0.0 for solid in solids)
        surfaces = [(part, "part")] if body is None else [(part, "part"), (body, "body")]
        self.bodies: tuple[Target, ...] = (
            tuple(mesh_target(one, role=role) for one, role in surfaces) if known is None else known.bodies
        )
        standing = [obstacle_target(one, T_work_base=T_work_base) for one in obstacles]
        beside = [target for target, one in zip(standing, obstacles, strict=True) if not stands_on(one)]
        self.tool: InflatedSolids = inflated_solids(solids, self.kept) if known is None else known.tool
        self.targets: tuple[Target, ...] = (*self.bodies, *standing)
        self.base_targets: tuple[Target, ...] = (*self.bodies, *beside)
        self.nominal: CollisionWorld = CollisionWorld(
            self.tool, targets=self.targets, known=None if known is None else known.nominal
        )
        self.trees = ranking_trees(self.targets, known={} if known is None else known.trees)
        ready: tuple[TipZone, ...] = () if known is None else known.zones[: len(self.bodies)]
        self.zones: tuple[TipZone, ...] = (
            *ready,
            *(TipZone(target.triangles) for target in self.targets[len(ready) :]),
        )
        self.has_body = body is not None

    def world(self, placements: Placements) -> CollisionWorld:
        """Return tool and targets for a motion of the tool.

        The tip is not inflated downwards: where travel rounds a corner, it is longer by what it may be lower there.
        """
        tip, *rest = self.tool.solids
        longer = rounding_on_travel(placements, tip)
        if longer == 0.0:
            return self.nominal
        solids = (replace(tip, start=tip.start - longer * tip.axis), *rest)
        inflated = InflatedSolids(solids, kept=self.kept, known=self.tool)
        return CollisionWorld(inflated, targets=self.targets, known=self.nominal)


def rounding_on_travel(placements: Placements, tip: Solid) -> float:
    """Return how far the tip may be off its placements on travel, where the controller rounds corners [mm]."""
    travels = np.append(placements.travels, np.False_) | np.append(np.False_, placements.travels)
    return float(placements.rounding((tip,))[travels].max(initial=0.0))


def stands_on(obstacle: Obstacle) -> bool:
    """Say whether the arm stands on an obstacle: a box that ends no higher than the foot; never on a table."""
    return isinstance(obstacle, Box) and float(obstacle.centre[2] + obstacle.size[2] / 2) <= FOOT_ROUNDING


# The driven motion passes a pose within this [mm], and turned from it by no more than this [rad]: what targets may
# leave out, with half as much again.
DRIVEN_OFF = 0.015
DRIVEN_TURN = float(np.radians(0.15))

# Tool and arm against the part, what it lies on, and the obstacles of the cell: the last question before a program.
#
# What is tested, at every placement of the path and between them: needle, cone, barrel and bracket keep the
# clearance of the process (`sweep`); the last millimetre of the needle touches nothing on travel; on deposit its rim
# has room over the surface (`tip_zone`); the tool is outside every closed surface (`sides`); and the links of the
# arm keep clear of all that, of the tool and of one another (`arm_clearance`). What is not tested is named in the
# result.


# What no check looks at. The layers below one are the part; what it has deposited itself is not looked at either.
DEPOSITED, DEPOSITED_BY_LAYER = "material already deposited", "material already deposited in this layer"
NOT_CHECKED = (
    "cables",
    DEPOSITED,
    "the way to home from where the arm is at program start",
    "whether the controller's world frame is its base frame",
)
# What is not looked at besides, without an arm and without a lamp in the cell; and with an arm.
WITHOUT_ARM = "arm links"
WITHOUT_LAMP = "UV lamp"
WITH_ARM = "the arm's link 1 against links 3 to 6, and links two joints apart"
# What a person may do where nothing is known of what helps.
TOO_CLOSE_ADVICE = "turn or move the part, lean the tool, or use a longer needle"


def clearance(
    path: ControllerPath,
    arm: Arm,
    *,
    tool: Tool,
    process: Process,
    T_base_work: FloatArray,
    poses: PoseStream,
    part: Surface,
    body: Surface | None,
    obstacles: tuple[Obstacle, ...],
    below: float = 0.0,
) -> Clearance:
    """Prove that tool and arm keep clear on the whole path, from home to home.

    Args:
        path: the motion as the controller interpolates it.
        arm: kinematics with this tool.
        tool: its solids.
        process: clearance to keep.
        T_base_work: (4, 4) where the part stands [mm].
        poses: the stream that the path prints; of one that deposits nothing the tip margin is infinite.
        part: the surface that is printed on: of a layer the top of those below with its sides.
        body: what the part lies on, in the same coordinates, or None where that is unknown.
        obstacles: what stands in the cell, in the base frame; the arm stands on boxes that end below its foot.
        below: how far what is printed on lies below the surface that the stand-off counts from; of a layer above 0.

    Returns:
        What was found, and what was not checked.

    Raises:
        ClearanceError: tool or arm touches something, comes too close, or is inside a closed surface.
        InputError: the placement is not a rigid transform, or tool, process or an obstacle is impossible.
        VerificationError: the check fails on what is known, or part and path do not belong together.
    """
    check = ClearanceCheck(
        arm, tool=tool, process=process, T_base_work=T_base_work, part=part, body=body, obstacles=obstacles, below=below
    )
    return check(path, poses=poses)


@final
class ClearanceCheck:
    """Tool, arm and what they must not touch, prepared once for all paths past it.

    Args:
        arm: kinematics with this tool.
        tool: its solids.
        process: clearance to keep.
        T_base_work: (4, 4) where the part stands [mm].
        part: as for `clearance`.
        body: likewise.
        obstacles: likewise.
        below: likewise.
        known: another check, of wherever the part stands: what it prepared serves here too where arm, tool, process,
            part and body are the very same.

    Attributes:
        prepared: these five.
        scene: tool and targets.
        of_arm: the check of the links.

    Raises:
        InputError: the placement is not a rigid transform, or tool, process or an obstacle is impossible.
        VerificationError: the check fails on what is known.
    """

    __slots__ = ("_T_work_base", "_arm", "_below", "_links", "_process", "_tool", "of_arm", "prepared", "scene")

    def __init__(
        self,
        arm: Arm,
        *,
        tool: Tool,
        process: Process,
        T_base_work: FloatArray,
        part: Surface,
        body: Surface | None,
        obstacles: tuple[Obstacle, ...],
        below: float = 0.0,
        known: ClearanceCheck | None = None,
    ) -> None:
        check_rigid(T_base_work[None])
        self._arm, self._tool, self._process, self._below = arm, tool, process, below
        self._T_work_base = transforms.inverse(T_base_work)
        self.prepared = (arm.robot, tool, process, part, body)
        if known is not None and not all(map(operator.is_, self.prepared, known.prepared)):
            known = None
        self._links = link_solids(arm.robot.model, urdf=arm.robot.urdf, flange=arm.robot.flange)
        self.scene = CheckedWorld(
            tool, process=process, part=part, body=body, obstacles=obstacles, T_work_base=self._T_work_base,
            known=None if known is None else known.scene,
        )  # fmt: skip
        self.of_arm = ArmCheck(
            self._links, tool=tool_solids(tool), kept=process.clearance, targets=self.scene.targets,
            base_targets=self.scene.base_targets, trees=self.scene.trees,
            known=None if known is None else known.of_arm,
        )  # fmt: skip

    def __call__(self, path: ControllerPath, *, poses: PoseStream) -> Clearance:
        """Prove that tool and arm keep clear on a path, as `clearance` does."""
        motion = arm_motion(
            path, self._arm, tool=tool_solids(self._tool), links=self._links, T_work_base=self._T_work_base
        )
        over = poses.standoff + self._below if poses.deposit.any() else None
        check_rigid(motion.tool.poses)
        world = self.scene.world(motion.tool)

        def of_tool() -> Clearance:
            room, rounding = _refuse_tool(motion.tool, world, self.scene, tool=self._tool, standoff=over)
            return _finding(
                motion.tool, world, self.scene, tool=self._tool, process=self._process, room=room, rounding=rounding
            )

        found, (arm_smallest, arm_at, arm_checked) = both(of_tool, lambda: self.of_arm(motion))
        found = found if self._below == 0.0 else _of_a_layer(found)
        return replace(
            found,
            arm_smallest=arm_smallest,
            arm_at=arm_at,
            checked=(*found.checked, *arm_checked),
            not_checked=(WITH_ARM, *(name for name in found.not_checked if name != WITHOUT_ARM)),
        )

    def refuse_poses(self, poses: PoseStream) -> None:
        """Refuse poses at which the tool is so close that no motion past them is clear.

        A look ahead and no proof. A motion that is timed may be off the poses a little, and its targets leave poses
        out: what that may make up for is not refused here, nor anything that a link of the arm hits.

        Args:
            poses: p poses of the path.

        Raises:
            ClearanceError: as the check of every motion past these poses does, whatever its targets.
        """
        deposited, before = np.append(poses.deposited, np.False_), np.append(np.False_, poses.deposited)
        at = transforms.rigid(transforms.rotation_of(poses.quaternions), poses.tips)
        placements = Placements(at, runs=poses.runs, deposit=deposited, corners=at)
        scene, world = self.scene, self.scene.nominal
        # The tip counts wherever the tool travels before or behind the pose.
        tested = np.array([solid.reach_below > 0.0 for solid in world.solids]) | ~(deposited & before)[:, None]
        pairs = world.touches(at, reaches=np.where(tested, 0.0, NOT_TESTED))
        struck: BoolArray = np.asarray(pairs.any(axis=(1, 2)))
        printing: BoolArray = struck & deposited
        if printing.any():
            _refuse_clear_hits(printing, pairs, placements, world, kept=scene.kept)
        if (deposited | before).any():
            refuse_rim_at(
                placements, deposited | before, world.targets, scene.zones, radius=self._tool.needle_diameter / 2.0,
                standoff=poses.standoff + self._below, off=DRIVEN_OFF, turn=DRIVEN_TURN,
            )  # fmt: skip
        if struck.any() and not printing.any():
            _refuse_clear_hits(struck, pairs, placements, world, kept=scene.kept)


def check_placements(
    placements: Placements,
    *,
    tool: Tool,
    process: Process,
    standoff: float,
    part: Surface,
    body: Surface | None,
    obstacles: tuple[Obstacle, ...],
    T_work_base: FloatArray,
) -> Clearance:
    """Prove that the tool keeps clear at and between placements; the part of `clearance` that needs no arm.

    Args:
        placements: of the tool in the work frame.
        tool: its solids.
        process: clearance to keep.
        standoff: height of the tip over the surface on deposit [mm].
        part: the surface that is printed on.
        body: what it lies on, or None.
        obstacles: what stands in the cell, in the base frame.
        T_work_base: (4, 4) base frame in the work frame [mm].

    Returns:
        What was found, and what was not checked.

    Raises:
        ClearanceError: the tool touches something, comes too close, or is inside a closed surface.
        InputError: a placement is not a rigid transform, or tool, process or an obstacle is impossible.
        VerificationError: the check fails on what is known, or part and placements do not belong together.
    """
    scene = CheckedWorld(tool, process=process, part=part, body=body, obstacles=obstacles, T_work_base=T_work_base)
    check_rigid(placements.poses)
    world = scene.world(placements)
    room, rounding = _refuse_tool(placements, world, scene, tool=tool, standoff=standoff)
    return _finding(placements, world, scene, tool=tool, process=process, room=room, rounding=rounding)


def _refuse_tool(
    placements: Placements, world: CollisionWorld, scene: CheckedWorld, *, tool: Tool, standoff: float | None
) -> tuple[float, float]:
    """Refuse a tool that comes too close.

    Returns:
        The room of its rim [mm], infinite without a stand-off, and how far off its way it is at most [mm].
    """
    refuse_tool_inside(placements, world)
    rounding = placements.rounding(world.solids)
    largest = float(rounding.max())
    hits = find_hits(world, placements, rounding=rounding)
    if hits is not None:
        raise _too_close(hits, world, placements, kept=scene.kept)
    if standoff is None:
        return np.inf, largest
    return refuse_rim(placements, world, scene.zones, radius=tool.needle_diameter / 2, standoff=standoff), largest


def _refuse_clear_hits(
    struck: BoolArray, pairs: BoolArray, placements: Placements, world: CollisionWorld, *, kept: tuple[float, ...]
) -> None:
    """Refuse placements that are struck, by (k, s, t) pairs, unless a motion may be clear that passes a little off."""
    rows = np.flatnonzero(struck)
    hits = Hits(placements.poses[rows], rows, pairs[rows])
    worst = worst_hit(hits, world)
    if _wanted(worst, world, kept=kept) - worst.distance > DRIVEN_OFF + DRIVEN_TURN * worst.lever:
        raise _too_close(hits, world, placements, kept=kept)


def _finding(
    placements: Placements,
    world: CollisionWorld,
    scene: CheckedWorld,
    *,
    tool: Tool,
    process: Process,
    room: float,
    rounding: float,
) -> Clearance:
    """Return how clear a tool keeps that comes nowhere too close."""
    closest = smallest_distance(placements, world, scene.trees)
    lamp = () if tool.lamp is not None else (WITHOUT_LAMP,)
    surroundings = () if scene.has_body else ("surroundings",)
    return Clearance(
        smallest=closest.distance,
        at=f"{placements.stretch(closest.row)} at {in_words(closest.tip)}, {closest.solid} to {closest.target}",
        arm_smallest=None,
        arm_at=None,
        kept=process.clearance,
        tip_margin=room,
        checks=placements.count,
        checked=_checked(world, rounding=rounding),
        not_checked=(WITHOUT_ARM, *lamp, *NOT_CHECKED, *surroundings),
    )


def _of_a_layer(found: Clearance) -> Clearance:
    """Say of a check that of all deposits only the layer itself was left out: those below are what it prints on."""
    return replace(
        found, not_checked=tuple(DEPOSITED_BY_LAYER if name == DEPOSITED else name for name in found.not_checked)
    )


def _too_close(hits: Hits, world: CollisionWorld, placements: Placements, *, kept: tuple[float, ...]) -> ClearanceError:
    """Describe the worst of the hits."""
    worst = worst_hit(hits, world)
    wanted = _wanted(worst, world, kept=kept)
    count = len(np.unique(hits.rows))
    solid = next(solid for solid in world.solids if solid.name == worst.solid)
    rounding = round(float(placements.rounding((solid,))[worst.row, 0]), 2)
    corner = f" and the rounded corner there up to {rounding:.2f} mm" if rounding else ""
    return ClearanceError(
        f"{placements.stretch(worst.row)} at tip {in_words(worst.tip)} {worst.finding}; at least {wanted:.2f} mm are "
        f"required, plus up to {ALLOWANCE:.2f} mm for the check itself{corner}. {count} of {placements.count} "
        f"placements are too close: {TOO_CLOSE_ADVICE}.",
        solid=worst.solid,
        against=worst.target,
        run=int(placements.runs[worst.row]),
        place=triple(worst.tip),
        distance=worst.distance,
        wanted=wanted,
        travelling=placements.travelling(hits.rows),
        hits=count,
        placements=placements.count,
        advice=TOO_CLOSE_ADVICE,
    )


def _wanted(hit: Closest, world: CollisionWorld, *, kept: tuple[float, ...]) -> float:
    """Return the distance that the solid of a hit has to keep [mm]."""
    return next(distance for solid, distance in zip(world.solids, kept, strict=True) if solid.name == hit.solid)


def _checked(world: CollisionWorld, *, rounding: float) -> tuple[str, ...]:
    solids = ", ".join(solid.name for solid in world.solids if solid.reach_below > 0.0)
    pairs = [f"{solids} against {target.name}" for target in world.targets]
    pairs += [f"needle's tip on travel and its rim on deposit against {target.name}" for target in world.targets]
    sides = [f"tool outside the closed {target.name}" for target in world.targets if target.closed]
    return (*pairs, *sides, f"tool where the controller rounds targets, at most {rounding:.3f} mm off its way")


# Whether tool and arm keep clear at single poses: what `clearance` asks of a placement, without the steps between.
#
# The shapes, the kept distances and the targets are those of `clearance`, so that a pose that is refused here is
# refused on every path through it. What is free here may still be too close between it and its neighbours.


# The first of `tool_solids`, tip to barrel, are round about the nozzle.
ROUND_SOLIDS = 4


@final
class SinglePoses:
    """Tool and arm beside part, body and obstacles.

    Args:
        arm: with the tool.
        tool: its solids.
        process: clearance to keep.
        standoff: height of the tip over the surface on deposit [mm].
        part: the surface that is printed on.
        body: what it lies on, or None.
        obstacles: what stands in the cell, in the base frame.
        T_base_work: (4, 4) where the part stands [mm].

    Raises:
        InputError: tool or obstacle is impossible.
        VerificationError: the collision check fails on what is known.
    """

    __slots__ = ("_T_work_base", "_arm", "_carried", "_in_work", "_nozzle", "_radius", "_seen", "_standoff", "_zones")

    def __init__(
        self,
        arm: Arm,
        *,
        tool: Tool,
        process: Process,
        standoff: float,
        part: Surface,
        body: Surface | None,
        obstacles: tuple[Obstacle, ...],
        T_base_work: FloatArray,
    ) -> None:
        self._arm = arm
        self._T_work_base = transforms.inverse(T_base_work)
        surfaces = [mesh_target(part, role="part")]
        surfaces += [] if body is None else [mesh_target(body, role="body")]
        standing = [obstacle_target(one, T_work_base=self._T_work_base) for one in obstacles]
        beside = [target for target, one in zip(standing, obstacles, strict=True) if not stands_on(one)]
        targets: tuple[Target, ...] = (*surfaces, *standing)
        self._zones = [TipZone(target.triangles) for target in targets]
        solids, kept = tool_solids(tool), process.clearance
        self._nozzle = CollisionWorld(_inflated(solids[:ROUND_SOLIDS], kept=kept), targets=targets)
        self._carried = CollisionWorld(_inflated(solids[ROUND_SOLIDS:], kept=kept), targets=targets)
        self._radius = tool.needle_diameter / 2.0
        self._standoff = standoff
        links = link_solids(arm.robot.model, urdf=arm.robot.urdf, flange=arm.robot.flange)
        shapes = [_inflated(link.solids, kept=kept) for link in links]
        seen = [tuple(solid_target(solid) for solid in link.solids) for link in links]
        whole = _inflated(with_whole_needle(solids), kept=kept)
        self._in_work = [
            (link.joint, CollisionWorld(shape, targets=targets if link.joint > 1 else (*surfaces, *beside)))
            for link, shape in zip(links, shapes, strict=True)
        ]
        # In the frame of the first of two, the second moves past it; -1 is the tool.
        self._seen = [
            *((joint, -1, CollisionWorld(whole, targets=seen[joint])) for joint in range(LINKS_APART_FROM_TOOL)),
            *(
                (first.joint, second.joint, CollisionWorld(shapes[second.joint], targets=seen[first.joint]))
                for first, second in pairs_of_links(links)
            ),
        ]

    def nozzle_free(self, Ts_base_tool: FloatArray, *, deposit: bool) -> BoolArray:
        """Return (k,) whether tip, needle, cone, barrel and rim have their room at (k, 4, 4) poses [mm]."""
        poses = self._T_work_base @ Ts_base_tool
        reaches = np.zeros((len(poses), ROUND_SOLIDS))
        reaches[:, 0] = NOT_TESTED if deposit else 0.0
        free: BoolArray = np.asarray(~self._nozzle.touches(poses, reaches=reaches).any(axis=(1, 2)))
        asked = np.flatnonzero(free)
        for zone in self._zones if deposit and asked.size else ():
            rooms = zone.rooms(poses[asked], radius=self._radius, standoff=self._standoff)
            free[asked] &= rooms >= SMALLEST_ROOM
        return free

    def carried_free(self, Ts_base_tool: FloatArray) -> BoolArray:
        """Return (k,) whether bracket and lamp keep clear at (k, 4, 4) poses [mm]."""
        return _free(self._carried, self._T_work_base @ Ts_base_tool)

    def arm_free(self, joints: FloatArray) -> BoolArray:
        """Return (k,) whether at (k, 6) joint angles [rad] links keep clear of everything, and the tool of links."""
        Ts_base_link = self._arm.link_poses(joints)
        free = np.ones(len(joints), dtype=np.bool_)
        for joint, world in reversed(self._in_work):
            rows = np.flatnonzero(free)
            free[rows] = _free(world, self._T_work_base @ Ts_base_link[rows, joint])
        for first, second, world in self._seen:
            rows = np.flatnonzero(free)
            free[rows] = _free(world, transforms.inverse(Ts_base_link[rows, first]) @ Ts_base_link[rows, second])
        return free


def _free(world: CollisionWorld, poses: FloatArray) -> BoolArray:
    if not len(poses):
        return np.zeros(0, dtype=np.bool_)
    found = world.touches(poses, reaches=np.zeros((len(poses), len(world.solids))))
    return np.asarray(~found.any(axis=(1, 2)))


def _inflated(solids: tuple[Solid, ...], *, kept: float) -> InflatedSolids:
    each = tuple(kept if solid.reach_below > 0.0 else 0.0 for solid in solids)
    return inflated_solids(solids, each, (0.0,))
