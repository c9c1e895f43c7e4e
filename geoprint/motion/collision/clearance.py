"""Tool and arm against the part, what it lies on, and the obstacles of the cell: the last question before a program.

What is tested, at every placement of the path and between them: needle, cone, barrel and bracket keep the clearance of
the process (`sweep`); the last millimetre of the needle touches nothing on travel; on deposit its rim has room over the
surface (`tip_zone`); the tool is outside every closed surface (`sides`); and the links of the arm keep clear of all
that, of the tool and of one another (`arm_clearance`). What is not tested is named in the result.
"""

from __future__ import annotations

import operator
from dataclasses import replace
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.model import (
    BoolArray,
    Clearance,
    ControllerPath,
    FloatArray,
    Obstacle,
    PoseStream,
    Process,
    Surface,
    Tool,
)
from geoprint.motion.arm import Arm
from geoprint.motion.collision.arm_clearance import ArmCheck, ArmFinding, arm_motion, still_motion
from geoprint.motion.collision.closest import smallest_distance, worst_hit
from geoprint.motion.collision.contact import CollisionWorld, check_rigid
from geoprint.motion.collision.link_solids import link_solids
from geoprint.motion.collision.outside import refuse_tool_inside
from geoprint.motion.collision.rim import refuse_rim
from geoprint.motion.collision.scene import CheckedWorld
from geoprint.motion.collision.sweep import ALLOWANCE, Hits, Placements, find_hits
from geoprint.motion.collision.tool_solids import tool_solids
from geoprint.surfaces import in_words, triple
from geoprint.threads import both

# What no check looks at. Of a layer the ones below it are the part; what it has laid itself is not looked at either.
LAID, LAID_BY_LAYER = "material already laid", "material that this layer itself has already laid"
NOT_CHECKED = (
    "cables",
    LAID,
    "the way to home from where the arm stands when the program starts",
    "that the controller's world frame is its base frame",
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
        poses: the stream that the path prints; of one that lays nothing the tip margin is infinite.
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

        found, arm_found = both(of_tool, lambda: self.of_arm(motion))
        return _with_arm(found if self._below == 0.0 else _of_a_layer(found), arm_found)

    def arm_touches(self, joints: FloatArray) -> BoolArray:
        """Return (k,) whether a link comes too close, or the tool to a link, with the arm at (k, 6) joints [rad].

        A look ahead and no proof: what lies between is not asked, nor that links are outside of closed surfaces.
        """
        return self.of_arm.touching(still_motion(joints, self._arm, T_work_base=self._T_work_base))


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


def _with_arm(found: Clearance, arm_found: ArmFinding) -> Clearance:
    return replace(
        found,
        arm_smallest=arm_found.smallest,
        arm_at=arm_found.at,
        checked=(*found.checked, *arm_found.checked),
        not_checked=(WITH_ARM, *(name for name in found.not_checked if name != WITHOUT_ARM)),
    )


def _of_a_layer(found: Clearance) -> Clearance:
    """Say of a check that of what is laid only the layer itself was left out: those below are what it prints on."""
    return replace(found, not_checked=tuple(LAID_BY_LAYER if name == LAID else name for name in found.not_checked))


def _too_close(hits: Hits, world: CollisionWorld, placements: Placements, *, kept: tuple[float, ...]) -> ClearanceError:
    """Describe the worst of the hits."""
    worst = worst_hit(hits, world)
    wanted = next(distance for solid, distance in zip(world.solids, kept, strict=True) if solid.name == worst.solid)
    count = len(np.unique(hits.rows))
    solid = next(solid for solid in world.solids if solid.name == worst.solid)
    rounding = round(float(placements.rounding((solid,))[worst.row, 0]), 2)
    corner = f" and the rounded corner there up to {rounding:.2f} mm" if rounding else ""
    return ClearanceError(
        f"{placements.stretch(worst.row)} at tip {in_words(worst.tip)} {worst.finding}; at least {wanted:.2f} mm "
        f"are to be kept, and the check itself needs up to {ALLOWANCE:.2f} mm more{corner}; {count} of "
        f"{placements.count} placements are too close: {TOO_CLOSE_ADVICE}.",
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


def _checked(world: CollisionWorld, *, rounding: float) -> tuple[str, ...]:
    solids = ", ".join(solid.name for solid in world.solids if solid.reach_below > 0.0)
    pairs = [f"{solids} against {target.name}" for target in world.targets]
    pairs += [f"needle's tip on travel and its rim on deposit against {target.name}" for target in world.targets]
    sides = [f"tool outside the closed {target.name}" for target in world.targets if target.closed]
    return (*pairs, *sides, f"tool where the controller rounds targets, at most {rounding:.3f} mm off its way")
