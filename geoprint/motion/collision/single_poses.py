"""Whether tool and arm keep clear at single poses: what `clearance` asks of a placement, without the steps between.

The shapes, the kept distances and the targets are those of `clearance`, so that a pose that is refused here is refused
on every path through it. What is free here may still be too close between it and its neighbours.
"""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint import transforms
from geoprint.model import BoolArray, FloatArray, Obstacle, Process, Surface, Tool
from geoprint.motion.arm import Arm
from geoprint.motion.collision.arm_clearance import LINKS_APART_FROM_TOOL, pairs_of_links, with_whole_needle
from geoprint.motion.collision.contact import NOT_TESTED, CollisionWorld, InflatedSolids, inflated_solids
from geoprint.motion.collision.link_solids import link_solids
from geoprint.motion.collision.scene import stands_on
from geoprint.motion.collision.surroundings import Target, mesh_target, obstacle_target, solid_target
from geoprint.motion.collision.tip_zone import SMALLEST_ROOM, TipZone
from geoprint.motion.collision.tool_solids import Solid, tool_solids

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
