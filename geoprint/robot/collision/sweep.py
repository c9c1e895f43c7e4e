"""Where the tool, or a link of the arm, comes too close on its path, or is inside a closed surface."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import final

import numpy as np

from geoprint import transforms
from geoprint.errors import ClearanceError, InputError
from geoprint.geometry import in_words, triple
from geoprint.model import BoolArray, ControllerPath, FloatArray, IntArray, freeze_arrays, frozen
from geoprint.robot.collision.contact import NOT_TESTED, REACH_STEP, CollisionWorld
from geoprint.robot.collision.surroundings import inside
from geoprint.robot.collision.tool_solids import EXCESS, Solid, movements, movements_between

# Where the tool, or a link of the arm, comes too close on its path: at every placement and everywhere between two.
#
# A placement stands for half of the step before it and half of the step behind it: each solid is inflated by the
# distance it has to keep and by half of the largest movement of any of its points in either step. Where that is
# free, the whole path is. Where it is not, the solid inflated by the kept distance alone decides; if that is free
# too, the steps beside the placement are cut into PARTS and the question is asked again, down to FINEST. What is
# still touched then is called a hit, so that everything nearer than the kept distance is found, and nothing that is
# farther by more than ALLOWANCE.
#
# Where the controller rounds a corner, its path lies anywhere between two edges, the placement halfway (`zones`).
# The *rounding*, the distance to either edge, is added to what a solid is inflated by; where that touches something,
# many placements across the path are asked instead.
#
# Before that, blocks of steps are asked at once, with a larger inflation; most links are free in most of them.
#
# The tip zone may come close, so that it is only tested on travel, where it must not touch. It is not inflated
# downwards, and therefore stands for its whole steps, so that the lower placement covers them.


# Steps that are tried at once where a solid is far from everything: first the many, then fewer where that failed.
BLOCKS = (40, 8)
# Steps are cut so that they stay below the largest allowed one by this factor: equal parts in joint angles are not
# quite equal movements.
STEP_MARGIN = 0.9
# Parts into which a step is cut where the tool may be too close.
PARTS = 6
# Half movement below which a step is not cut any more [mm].
FINEST = 0.01
# A distance that is larger than the kept one by more than this is never called a hit [mm]: half a movement and half the
# distance of neighbours across the path, rounded up to the next reach, and what the shapes are too large.
ALLOWANCE = FINEST + FINEST + REACH_STEP + EXCESS
# Largest movement of any point of the tool between neighbouring placements [mm]; the tip zone stands for whole steps.
LARGEST_STEP = 2.0
# The same for links of the arm, and for the tool as a link sees it: on an arc of 100 mm radius, the path between two
# placements is straight within 0.02 mm then.
LARGEST_ARM_STEP = 4.0


@final
@frozen
class Placements:
    """The motion of the tool past the part, so fine that no point of it moves more than LARGEST_STEP at once.

    That of a link of the arm is one too, and that of the tool past a link.

    Attributes:
        poses: (k, 4, 4) T_work_tool, or of whatever moves in the frame of what it must not touch [mm].
        runs: (k,) run of the pose stream, -1 on the joint moves from and to home.
        deposit: (k,) whether material is deposited from this placement to the next.
        corners: (k, 4, 4) where it is if the controller rounds nothing: the poses themselves away from corners. It may
            be anywhere from there to as far on the other side of the poses.
    """

    poses: FloatArray
    runs: IntArray
    deposit: BoolArray
    corners: FloatArray

    def __post_init__(self) -> None:
        sizes = freeze_arrays(self, poses="float: k 4 4", runs="int: k", deposit="bool: k", corners="float: k 4 4")
        if sizes["k"] < 2:
            raise InputError(f"the collision check needs a motion of at least two placements, found {sizes['k']}.")

    @property
    def count(self) -> int:
        """Number of placements k."""
        return int(self.runs.size)

    @property
    def travels(self) -> BoolArray:
        """(k - 1,) whether no material is deposited in the step from each placement to the next."""
        return ~self.deposit[:-1]

    def rounding(self, solids: tuple[Solid, ...]) -> FloatArray:
        """Return the (k, s) `rounding_of` the placements [mm]."""
        return rounding_of(solids, self.poses, self.corners)

    def travelling(self, rows: IntArray) -> bool:
        """Say whether all of some placements are on the travel between runs."""
        return bool((~self.deposit & (self.runs >= 0))[rows].all())

    def stretch(self, row: int) -> str:
        """Name the part of the motion that a placement belongs to."""
        if self.runs[row] >= 0:
            return f"in run {self.runs[row] + 1}"
        return "on the way from home" if (self.runs[:row] < 0).all() else "on the way to home"


@final
@frozen
class Hits:
    """Where the tool is too close.

    Attributes:
        poses: (h, 4, 4) T_work_tool [mm], at or between placements.
        rows: (h,) placement at each pose or before it.
        pairs: (h, s, t) which solid is too close to which target.
    """

    poses: FloatArray
    rows: IntArray
    pairs: BoolArray


@final
@frozen
class _Steps:
    """Steps that have to be looked at more closely.

    Attributes:
        starts: (n, 2, 4, 4) pose and corner where each begins [mm].
        ends: (n, 2, 4, 4) likewise where it ends.
        rows: (n,) placement before it.
        travels: (n,) whether it deposits no material.
        solids: (n, s) which solids are open in it.
    """

    starts: FloatArray
    ends: FloatArray
    rows: IntArray
    travels: BoolArray
    solids: BoolArray


def rounding_of(solids: tuple[Solid, ...], poses: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the (k, s) bounds on how far any point of solids is from (k, 4, 4) poses to their corners [mm]."""
    result = np.zeros((len(poses), len(solids)))
    rows = np.flatnonzero(differing(poses, corners))
    result[rows] = movements_between(solids, poses[rows], corners[rows])
    return result


def differing(poses: FloatArray, others: FloatArray) -> BoolArray:
    """Return (k,) whether (k, ...) poses differ from others, entry by entry: by far the fastest along the last axis."""
    return np.asarray((poses != others).reshape(len(poses), -1).any(axis=1))


def step_parts(moved: FloatArray, *, largest: float) -> IntArray:
    """Return into how many parts to cut (k - 1,) steps of given movements [mm] to stay below the largest."""
    return np.maximum(np.ceil(moved / (STEP_MARGIN * largest)), 1.0).astype(np.int64)


def refined(path: ControllerPath, *, parts: IntArray) -> ControllerPath:
    """Return a path with each of its steps cut into (k - 1,) equal parts in the joint angles."""
    rows = np.append(np.repeat(np.arange(len(parts)), parts), len(parts))
    within = np.arange(len(rows)) - np.append(np.cumsum(parts) - parts, parts.sum())[rows]
    following = np.minimum(rows + 1, len(parts))
    shares = within / np.append(parts, 1)[rows]
    # A row between a joint move and a run belongs to the joint move.
    joint_move = np.minimum(path.runs[rows], path.runs[following]) < 0

    def between_rows(values: FloatArray) -> FloatArray:
        return values[rows] + shares[:, None] * (values[following] - values[rows])

    return ControllerPath(
        joints=between_rows(path.joints),
        runs=np.where((within > 0) & joint_move, -1, path.runs[rows]),
        deposit=path.deposit[rows],
        rounding=between_rows(path.rounding),
        step=path.step,
    )


def find_hits(
    world: CollisionWorld,
    placements: Placements,
    *,
    largest_step: float = LARGEST_STEP,
    rounding: FloatArray | None = None,
) -> Hits | None:
    """Find where the tool touches a target or comes closer than it has to keep.

    Args:
        world: tool and targets.
        placements: the motion of the tool.
        largest_step: largest movement that is allowed between neighbouring placements [mm].
        rounding: (k, s) of the placements [mm], where that is known already.

    Returns:
        All hits among the placements; if there are none, hits between them; None where the whole motion is free.

    Raises:
        InputError: a pose is not rigid or finite, or two placements are too far apart.
    """
    poses, rows = placements.poses, np.arange(placements.count)
    moved = movements(world.solids, poses)
    if moved.max() > largest_step:
        raise InputError(
            f"the {world.solids[int(moved.max(axis=0).argmax())].name} moves by {moved.max():.1f} mm between two "
            f"placements, at most {largest_step} mm are allowed; sample the path more finely."
        )
    rounding = placements.rounding(world.solids) if rounding is None else rounding
    open_solids = np.ones(moved.shape, dtype=np.bool_)
    for block in BLOCKS:
        open_solids &= ~_free_blocks(world, poses, moved=moved, rounding=rounding, block=block, solids=open_solids)
    reaches = _step_reaches(world, moved, travels=placements.travels, solids=open_solids)
    if not (reaches > NOT_TESTED).any():
        return None
    hits, open_solids = _settle(world, poses, placements.corners, rows=rows, reaches=reaches)
    both = np.stack([poses, placements.corners], axis=1)
    steps = _open_steps(both, rows=rows, travels=placements.travels, solids=open_solids)
    while hits is None and len(steps.rows):
        hits, steps = _look_between(world, steps)
    return hits


def _look_between(world: CollisionWorld, steps: _Steps) -> tuple[Hits | None, _Steps]:
    """Cut steps into parts; return the hits there, and the parts that are still open."""
    each = PARTS + 1
    starts, ends = np.repeat(steps.starts, each, axis=0), np.repeat(steps.ends, each, axis=0)
    shares = np.tile(np.linspace(0.0, 1.0, each), len(steps.rows))
    poses, corners = (transforms.interpolate_poses(starts[:, i], ends[:, i], shares) for i in (0, 1))
    rows, travels = np.repeat(steps.rows, each), np.repeat(steps.travels, each)[:-1]
    solids = np.repeat(steps.solids, each, axis=0)[:-1]
    # From the last part of one step to the first of the next the tool does not move.
    solids[PARTS::each] = False
    reaches = _step_reaches(world, movements(world.solids, poses), travels=travels, solids=solids)
    hits, open_solids = _settle(world, poses, corners, rows=rows, reaches=reaches)
    return hits, _open_steps(np.stack([poses, corners], axis=1), rows=rows, travels=travels, solids=open_solids)


def _settle(
    world: CollisionWorld, poses: FloatArray, corners: FloatArray, *, rows: IntArray, reaches: FloatArray
) -> tuple[Hits | None, BoolArray]:
    """Return the hits at poses, and (k - 1, s) which solids may still hit something in which steps between them."""
    nothing = np.full((1, len(world.solids)), NOT_TESTED)
    beside = np.maximum(np.concatenate([nothing, reaches]), np.concatenate([reaches, nothing]))
    rounding = rounding_of(world.solids, poses, corners)
    # A corner that is rounded by more than any inflation covers is asked across the path alone.
    covered = beside + rounding <= world.reaches[-1]
    pairs = world.touches(poses, reaches=np.where((beside > NOT_TESTED) & covered, beside + rounding, NOT_TESTED))
    open_there = pairs.any(axis=2) | ((beside > NOT_TESTED) & ~covered)
    doubtful = np.flatnonzero(open_there.any(axis=1))
    if not doubtful.size:
        return None, np.zeros(reaches.shape, dtype=np.bool_)
    asked = np.where(open_there, beside, NOT_TESTED)[doubtful]
    certain = world.touches(poses[doubtful], reaches=np.where(asked > NOT_TESTED, 0.0, NOT_TESTED))
    # What is struck in the middle of its path need not be asked across it.
    across = np.flatnonzero(~certain.any(axis=(1, 2)))
    rows_across, asked_across = doubtful[across], asked[across]
    fan = _Fan.of(poses[rows_across], corners[rows_across], rounding=rounding[rows_across])
    covering = asked_across + rounding[rows_across] / fan.parts[:, None]
    near = fan.touches(world, np.where(asked_across > NOT_TESTED, covering, NOT_TESTED))
    touched = np.zeros(beside.shape, dtype=np.bool_)
    touched[rows_across] = near.any(axis=2)
    open_solids = (touched[:-1] | touched[1:]) & (reaches > NOT_TESTED)
    certain[across] = fan.touches(world, np.where(touched[rows_across], 0.0, NOT_TESTED))
    certain[across] |= near & (asked_across <= FINEST)[:, :, None]
    struck = certain.any(axis=(1, 2))
    if not struck.any():
        return None, open_solids
    return Hits(poses[doubtful[struck]], rows[doubtful[struck]], certain[struck]), open_solids


@final
@frozen
class _Fan:
    """Placements side by side across the paths of d others, from edge to edge of where a corner is rounded.

    Attributes:
        poses: (f, 4, 4) [mm].
        owners: (f,) ascending: which of the d each belongs to.
        parts: (d,) the rounding, cut into so many, is how far each stands for its neighbours.
    """

    poses: FloatArray
    owners: IntArray
    parts: IntArray

    @classmethod
    def of(cls, poses: FloatArray, corners: FloatArray, *, rounding: FloatArray) -> _Fan:
        """Spread (d, 4, 4) poses, whose solids may be off by (d, s) as far as at the corners [mm]."""
        parts = np.maximum(np.ceil(rounding.max(axis=1, initial=0.0) / FINEST), 1.0).astype(np.int64)
        owners = np.repeat(np.arange(len(parts)), parts)
        place = np.arange(len(owners)) - np.repeat(np.cumsum(parts) - parts, parts)
        shares = (2.0 * place + 1.0) / parts[owners] - 1.0
        return cls(transforms.interpolate_poses(poses[owners], corners[owners], shares), owners, parts)

    def touches(self, world: CollisionWorld, reaches: FloatArray) -> BoolArray:
        """Say which of (d, s) inflated solids touch which targets, (d, s, t), anywhere across the path."""
        found = np.zeros((*reaches.shape, len(world.targets)), dtype=np.bool_)
        if len(self.owners):
            np.logical_or.at(found, self.owners, world.touches(self.poses, reaches=reaches[self.owners]))
        return found


def _open_steps(places: FloatArray, *, rows: IntArray, travels: BoolArray, solids: BoolArray) -> _Steps:
    """Return the steps of (k, 2, 4, 4) poses and corners in which any solid is open."""
    first = np.flatnonzero(solids.any(axis=1))
    return _Steps(places[first], places[first + 1], rows[first], travels[first], solids[first])


def _step_reaches(world: CollisionWorld, moved: FloatArray, *, travels: BoolArray, solids: BoolArray) -> FloatArray:
    """Return (k - 1, s) how far solids have to be inflated for each step that moves them; NOT_TESTED for the others."""
    reaches = moved.copy()
    for column, solid in enumerate(world.solids):
        if solid.reach_below > 0.0:
            reaches[:, column] /= 2
        else:
            reaches[~travels, column] = NOT_TESTED
    return np.where(solids, reaches, NOT_TESTED)


def _free_blocks(
    world: CollisionWorld,
    poses: FloatArray,
    *,
    moved: FloatArray,
    rounding: FloatArray,
    block: int,
    solids: BoolArray,
) -> BoolArray:
    """Return (k - 1, s) whether a solid is free in a whole block of steps, by one test in its middle.

    The solid is inflated by its movement from the middle to the farther end of the block, and by the rounding; where
    that is too far, or it touches something, or `solids` does not ask for it, the block stays open.
    """
    starts = np.arange(0, len(moved), block)
    ends = np.minimum(starts + block, len(moved))
    middles = (starts + ends) // 2
    passed = np.concatenate([np.zeros((1, len(world.solids))), np.cumsum(moved, axis=0)])
    reaches = np.maximum(passed[middles] - passed[starts], passed[ends] - passed[middles])
    reaches += np.maximum.reduceat(np.maximum(rounding[:-1], rounding[1:]), starts, axis=0)
    # What is not inflated downwards alike does not stand for its neighbours.
    alike = np.array([solid.reach_below == inf for solid in world.solids])
    asked = np.logical_or.reduceat(solids, starts, axis=0) & alike & (reaches <= world.reaches[-1])
    touched = world.touches(poses[middles], reaches=np.where(asked, reaches, NOT_TESTED)).any(axis=2)
    return np.repeat(asked & ~touched, ends - starts, axis=0)


# Refusals of a tool or an arm that is inside a closed surface, which nothing else would notice: it touches none.


# Placements besides the first at which the side of closed surfaces is tested.
SIDE_PLACEMENTS = 4


def refuse_tool_inside(placements: Placements, world: CollisionWorld) -> None:
    """Refuse a tool that is inside a closed surface: at the first placement all its solids, later the largest."""
    later = np.linspace(0, placements.count - 1, SIDE_PLACEMENTS + 1).astype(np.int64)[1:]
    largest = max(world.solids, key=lambda solid: solid.length * solid.end_radius**2)
    cases = [(0, solid) for solid in world.solids] + [(int(row), largest) for row in later]
    points = np.array([transforms.apply(placements.poses[row], solid.centre[None])[0] for row, solid in cases])
    for target in world.targets:
        if not target.closed:
            continue
        within = inside(points, target.triangles)
        if within.any():
            row, solid = cases[int(np.argmax(within))]
            tip = placements.poses[row, :3, 3]
            raise ClearanceError(
                f"{placements.stretch(row)} at tip {in_words(tip)} the {solid.name} is inside the closed "
                f"{target.name}; correct the placement of the part, or the outer side of the surface.",
                solid=solid.name,
                against=target.name,
                place=triple(tip),
            )


def refuse_links_inside(moving: Sequence[tuple[CollisionWorld, Placements]]) -> None:
    """Refuse links inside a closed surface at the first placement: to get in later they had to pass through it."""
    centres = [
        transforms.apply(moved.poses[0], np.array([solid.centre for solid in world.solids])) for world, moved in moving
    ]
    worlds = [world for world, _ in moving]
    for target in dict.fromkeys(target for world in worlds for target in world.targets if target.closed):
        against = [link for link, world in enumerate(worlds) if target in world.targets]
        within = inside(np.concatenate([centres[link] for link in against]), target.triangles)
        if within.any():
            owners = [link for link in against for _ in centres[link]]
            name = worlds[owners[int(np.argmax(within))]].solids[0].name
            raise ClearanceError(
                (
                    f"the {name} is inside the closed {target.name} at the start of the path; correct the placement "
                    "of the part."
                ),
                solid=name,
                against=target.name,
            )
