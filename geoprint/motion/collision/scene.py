"""The tool and what it must not touch, prepared once for all motions of the tool past it."""

from __future__ import annotations

from dataclasses import replace
from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import Box, FloatArray, Obstacle, Process, Surface, Tool
from geoprint.motion.collision.closest import ranking_trees
from geoprint.motion.collision.contact import CollisionWorld, InflatedSolids, inflated_solids
from geoprint.motion.collision.surroundings import Target, mesh_target, obstacle_target
from geoprint.motion.collision.sweep import Placements
from geoprint.motion.collision.tip_zone import TipZone
from geoprint.motion.collision.tool_solids import Solid, tool_solids

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
