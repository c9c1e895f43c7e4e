"""The links of the arm against part, body and obstacles, against the tool that the arm carries, and one another.

Every link is a group of cylinders (`link_solids`) that moves past the targets as the tool does, so that `sweep` proves
the same for it: the kept distance at every placement and between them. The tool moves past the base and the
links 1 to 4, each in the frame of that link; it is allowed to touch link 6, on which it is bolted, and link 5, which
bears it. Links that are three joints or more apart move past each other likewise, but for link 1. The base stands on
what ends below its foot, and link 1 turns above it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.geometry import in_words, triple
from geoprint.model import BoolArray, Box, ControllerPath, FloatArray, freeze_arrays
from geoprint.robot.arm import Arm
from geoprint.robot.collision.closest import Trees, smallest_arm_distance, worst_hit
from geoprint.robot.collision.contact import ARM_REACHES, CollisionWorld, InflatedSolids, inflated_solids
from geoprint.robot.collision.surroundings import Target, box_target, solid_target
from geoprint.robot.collision.sweep import (
    ALLOWANCE,
    LARGEST_ARM_STEP,
    LARGEST_STEP,
    Hits,
    Placements,
    differing,
    find_hits,
    refined,
    refuse_links_inside,
    step_parts,
)
from geoprint.robot.collision.tool_solids import Link, Solid, link_solids, movements

# The base and the links 1 to 4, which the tool must not touch.
LINKS_APART_FROM_TOOL = 5
# A link must not touch those so many joints on. Nearer ones are kept apart by their joints' limits; their cylinders,
# which hold more than the links, meet where the links themselves do not.
JOINTS_BETWEEN_LINKS = 3
# Link 1 is left out: its cylinder is as wide on all sides as the link is where it is widest, and the forearm of a part
# close to the arm is well inside it.
ROUND_LINK = 1


@final
@dataclass(frozen=True, slots=True, eq=False)
class ArmMotion:
    """Where the links and the tool are.

    Attributes:
        Ts_work_link: (k, 7, 4, 4) of the base and the links 1 to 6 [mm].
        corners: (k, 7, 4, 4) where they are if the controller rounds nothing [mm].
        tool: where the tool is [mm].
        Ts_link_work: (k, 7, 4, 4) of the work frame as they see it [mm].
        rounded: (k,) whether the controller rounds something there.
    """

    Ts_work_link: FloatArray
    corners: FloatArray
    tool: Placements
    Ts_link_work: FloatArray = field(init=False)
    rounded: BoolArray = field(init=False)

    def __post_init__(self) -> None:
        freeze_arrays(self, Ts_work_link="float: k 7 4 4", corners="float: k 7 4 4")
        object.__setattr__(self, "Ts_link_work", transforms.inverse(self.Ts_work_link))
        rounded = differing(self.Ts_work_link, self.corners) | differing(self.tool.poses, self.tool.corners)
        object.__setattr__(self, "rounded", rounded)

    def link_placements(self, link: Link) -> Placements:
        """Where a link is in the work frame; of the base, which does not move, one step stands for all."""
        count = self.tool.count if link.joint > 0 else 2
        return replace(
            self.tool,
            poses=self.Ts_work_link[:count, link.joint],
            corners=self.corners[:count, link.joint],
            runs=self.tool.runs[:count],
            deposit=self.tool.deposit[:count],
        )

    def tool_placements(self, link: Link) -> Placements:
        """Where the tool is as a link sees it."""
        return self._seen(link, self.tool.poses, self.tool.corners)

    def pair_placements(self, first: Link, second: Link) -> Placements:
        """Where the second of two links is as the first sees it."""
        return self._seen(first, self.Ts_work_link[:, second.joint], self.corners[:, second.joint])

    def _seen(self, link: Link, poses: FloatArray, corners: FloatArray) -> Placements:
        seen = self.Ts_link_work[:, link.joint] @ poses
        seen_corners = seen.copy()
        at_corners = self.corners[self.rounded, link.joint]
        seen_corners[self.rounded] = transforms.inverse(at_corners) @ corners[self.rounded]
        return replace(self.tool, poses=seen, corners=seen_corners)


def arm_motion(
    path: ControllerPath, arm: Arm, *, tool: tuple[Solid, ...], links: tuple[Link, ...], T_work_base: FloatArray
) -> ArmMotion:
    """Return the motion of links and tool: the path's rows and, where something moves far, rows between them."""
    motion = _motion(path, arm, T_work_base=T_work_base)
    parts = np.maximum(
        step_parts(movements(tool, motion.tool.poses).max(axis=1), largest=LARGEST_STEP),
        step_parts(_largest_movements(motion, tool=tool, links=links), largest=LARGEST_ARM_STEP),
    )
    return motion if parts.max() == 1 else _motion(refined(path, parts=parts), arm, T_work_base=T_work_base)


@final
class ArmCheck:
    """Proves that links keep clear of targets and one another, and the tool of links, on any motion of them.

    Links, tool and targets are prepared once.

    Args:
        links: the base and the links 1 to 6.
        tool: its solids.
        kept: distance that the links keep from the targets [mm].
        targets: what the links must not touch, in the work frame.
        base_targets: those that the base and link 1 must not touch: not what the arm stands on.
        trees: fragments of the targets.
        known: another check of the very same links and tool at the same distance, whose preparation of these serves
            here too.

    Attributes:
        in_work: links, each with what it must not touch in the work frame.
        carried: links, each with the tool as it moves past it.
        pairs: two links each, with the second as it moves past the first.

    Raises:
        VerificationError: the check fails on what is known.
    """

    __slots__ = ("_base_targets", "_kept", "_targets", "_tool", "_trees", "carried", "in_work", "pairs")

    def __init__(
        self,
        links: tuple[Link, ...],
        *,
        tool: tuple[Solid, ...],
        kept: float,
        targets: tuple[Target, ...],
        base_targets: tuple[Target, ...],
        trees: Trees,
        known: ArmCheck | None = None,
    ) -> None:
        self._kept, self._targets, self._base_targets, self._trees = kept, targets, base_targets, trees
        self._tool = with_whole_needle(tool)
        if known is not None:
            self.carried, self.pairs = known.carried, known.pairs
            self.in_work = [
                (link, CollisionWorld(before.inflated, targets=self._against(link), known=before))
                for link, before in known.in_work
            ]
            return
        inflated = [_inflated(link.solids, kept=kept) for link in links]
        carried = _inflated(self._tool, kept=kept)
        solids = [tuple(solid_target(solid) for solid in link.solids) for link in links]
        self.in_work = [
            (link, CollisionWorld(around, targets=self._against(link)))
            for link, around in zip(links, inflated, strict=True)
        ]
        self.carried = [
            (link, CollisionWorld(carried, targets=solids[link.joint])) for link in links[:LINKS_APART_FROM_TOOL]
        ]
        self.pairs = [
            (first, second, CollisionWorld(inflated[second.joint], targets=solids[first.joint]))
            for first, second in pairs_of_links(links)
        ]

    def _against(self, link: Link) -> tuple[Target, ...]:
        """Return what a link must not touch."""
        return self._targets if link.joint > 1 else self._base_targets

    def __call__(self, motion: ArmMotion) -> tuple[float, str, tuple[str, ...]]:
        """Prove that a motion keeps clear, at and between placements.

        Returns:
            The smallest distance found between a link and a target [mm]; where that is, as text: run, place of the tip,
            which link and which target; and the pairs that were tested.

        Raises:
            ClearanceError: a link touches a target, comes too close to it or is inside it, or the tool or another link
                does so to a link.
            InputError: placements are too far apart.
        """
        placements = motion.tool
        in_work = [(world, motion.link_placements(link)) for link, world in self.in_work]
        seen = self._seen(motion)
        refuse_links_inside(in_work)
        farthest = 0.0
        for world, moving in (*in_work, *seen):
            rounding = moving.rounding(world.solids)
            farthest = max(farthest, float(rounding.max()))
            hits = find_hits(world, moving, largest_step=LARGEST_ARM_STEP, rounding=rounding)
            if hits is not None:
                raise _too_close(hits, world, placements, kept=self._kept, every_pose=moving.count < placements.count)
        closest = smallest_arm_distance(in_work, self._trees)
        checked = _checked(self._tool, targets=self._targets, base_targets=self._base_targets)
        where = f"{placements.stretch(closest.row)} with the tip at {in_words(placements.poses[closest.row, :3, 3])}"
        rounded = f"arm where the controller rounds targets, at most {farthest:.3f} mm off its way"
        return closest.distance, f"{where}, {closest.solid} to {closest.target}", (*checked, rounded)

    def _seen(self, motion: ArmMotion) -> list[tuple[CollisionWorld, Placements]]:
        """Return the worlds in which tool or links move past links, with where they are in each."""
        return [
            *((world, motion.tool_placements(link)) for link, world in self.carried),
            *((world, motion.pair_placements(first, second)) for first, second, world in self.pairs),
        ]


def pairs_of_links(links: tuple[Link, ...]) -> list[tuple[Link, Link]]:
    """Return the links that must not touch one another."""
    firsts = [link for link in links if link.joint != ROUND_LINK]
    return [(first, second) for first in firsts for second in links[first.joint + JOINTS_BETWEEN_LINKS :]]


def _largest_movements(motion: ArmMotion, *, tool: tuple[Solid, ...], links: tuple[Link, ...]) -> FloatArray:
    """Bound how far any point of a link moves, or of tool or link as any link that it may hit sees it.

    Returns:
        (k - 1,) bounds from each placement to the next [mm].
    """
    bounds = [movements(link.solids, motion.Ts_work_link[:, link.joint]) for link in links[1:]]
    bounds += [movements(tool, motion.tool_placements(link).poses) for link in links[:LINKS_APART_FROM_TOOL]]
    bounds += [
        movements(second.solids, motion.pair_placements(first, second).poses) for first, second in pairs_of_links(links)
    ]
    return np.concatenate(bounds, axis=1).max(axis=1)


def arm_control(model: str) -> str:
    """Run the controls of the collision check alone, on the links of an arm.

    Returns:
        A line that says what was found right.

    Raises:
        UsageError: there is no such arm.
        VerificationError: a known hit is missed, or a known miss is hit.
    """
    post = box_target(Box("control", np.zeros(3), np.array([1.0, 2.0, 3.0])), T_work_base=np.eye(4))
    links = link_solids(model)
    for link in links:
        kept = (0.5,) * len(link.solids)
        CollisionWorld(InflatedSolids(link.solids, kept=kept, reaches=ARM_REACHES), targets=(post,))
    count = sum(len(link.solids) for link in links) * len(ARM_REACHES) * 2 * 2
    return f"links of the {model}: known hits and misses found right: {count}"


def _inflated(solids: tuple[Solid, ...], *, kept: float) -> InflatedSolids:
    return inflated_solids(solids, (kept,) * len(solids), ARM_REACHES)


def _motion(path: ControllerPath, arm: Arm, *, T_work_base: FloatArray) -> ArmMotion:
    poses = T_work_base @ arm.link_poses(path.joints)
    corners = poses.copy()
    rounded = path.rounding.any(axis=1)
    corners[rounded] = T_work_base @ arm.link_poses(path.joints[rounded] + path.rounding[rounded])
    tool = Placements(poses[:, -1], runs=path.runs, deposit=path.deposit, corners=corners[:, -1])
    return ArmMotion(poses[:, :-1], corners[:, :-1], tool)


@lru_cache(maxsize=8)
def with_whole_needle(tool: tuple[Solid, ...]) -> tuple[Solid, ...]:
    """Join the tip to the needle: it may come close to the part, but to no link."""
    tip, needle, *rest = tool
    return (Solid(needle.name, tip.start, needle.end, needle.start_radius, needle.end_radius), *rest)


def _too_close(
    hits: Hits, world: CollisionWorld, placements: Placements, *, kept: float, every_pose: bool
) -> ClearanceError:
    """Describe the worst of the hits; the place is that of the tool's tip."""
    worst = worst_hit(hits, world)
    count = placements.count if every_pose else len(np.unique(hits.rows))
    when = (
        "in every pose"
        if every_pose
        else f"{placements.stretch(worst.row)} with the tip at {in_words(placements.poses[worst.row, :3, 3])}"
    )
    return ClearanceError(
        f"{when} {worst.finding}; at least {kept:.2f} mm are required, plus up to {ALLOWANCE:.2f} mm for the check "
        f"itself. {count} of {placements.count} placements are too close. Move or turn the part (`geoprint place` "
        "looks for a better placement), move the obstacle, or correct the assumed link sizes.",
        solid=worst.solid,
        against=worst.target,
        run=int(placements.runs[worst.row]),
        place=triple(placements.poses[worst.row, :3, 3]),
        distance=worst.distance,
        wanted=kept,
        travelling=placements.travelling(hits.rows),
        hits=count,
        placements=placements.count,
    )


def _checked(
    tool: tuple[Solid, ...], *, targets: tuple[Target, ...], base_targets: tuple[Target, ...]
) -> tuple[str, ...]:
    carried = ", ".join(solid.name for solid in tool)
    pairs = [f"arm's links 2 to 6, as cylinders that hold them, against {target.name}" for target in targets]
    pairs += [f"arm's base and link 1, likewise, against {target.name}" for target in base_targets]
    pairs += [f"arm's links outside the closed {target.name}" for target in targets if target.closed]
    pairs += ["arm's links, as cylinders, against those three joints on or more, but for link 1"]
    return (*pairs, f"{carried} against the arm's base and links 1 to {LINKS_APART_FROM_TOOL - 1}")
