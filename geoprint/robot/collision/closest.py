"""Where the tool is closest to what it must not touch, or deepest in it: the numbers of a message or a report.

The check itself is `sweep`; here a few placements are measured exactly. Which ones is a choice by a cheap estimate, so
that a number found here is true for its placement, and the smallest of the whole motion as far as the choice was right.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from math import inf
from types import MappingProxyType
from typing import TypeAlias, final

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray, Tool, frozen
from geoprint.robot.collision.contact import CollisionWorld
from geoprint.robot.collision.surroundings import Target
from geoprint.robot.collision.sweep import Hits, Placements
from geoprint.robot.collision.tool_solids import (
    Revolution,
    Solid,
    circumscribed,
    nearest,
    quarter,
    revolution,
    signed_distances,
    tool_solids,
)

# Hits that are measured, spread over all of them, and again around the worst.
MEASURED_HITS = 40
# Placements that are ranked, spread over the whole motion, and the best ones of a target that are measured.
RANKED_PLACEMENTS = 600
MEASURED_PLACEMENTS = 8
# Every so manyth of the ranked ones tells how low the ranks of those are that are measured, but for rounding [mm].
RANKED_FIRST = 12
RANK_ROUNDING = 1e-6
# What is equally near but for rounding, as all along a flat part, is the first of it: so it is on every machine.
NEARNESS_DECIMALS = 6
# Distance of the points of the axis by which placements are ranked, as a share of the radius, and least and most [mm].
AXIS_STEP_SHARE = 0.3
AXIS_STEPS = (1.0, 25.0)
# Axes closer than this are one: rounding.
SAME_AXIS = 1e-9
# So many fragments of a target tell how far a link is, and it may be nearer by so much [mm].
ARM_FRAGMENTS = 400
ARM_FRAGMENT_MARGIN = 5.0
# Triangles, spread over all of a target, whose distance says which others need a look.
FIRST_TRIANGLES = 500
# A target farther from the tool's axis than this [mm] does not rank: the part below the tip is nearer.
RANKED_DISTANCE = 30.0
# The same counts for the links of the arm, which pass by at any distance but slowly.
RANKED_ARM_PLACEMENTS = 60
MEASURED_ARM_PLACEMENTS = 5
# Below this distance [mm] placements around the best one are measured too: farther away a millimetre is of no interest.
NEAR_ARM = 20.0
# Fragments of a target for ranking have this radius [mm], or this share of its extent where that is larger.
FRAGMENT_RADIUS = 1.0
FRAGMENT_SHARE = 0.02
# A triangle whose longest side is longer than this many times its height is cut in half: quarters of the faces of a
# table's cylinders would be as thin, and a thousand times as many.
LONG = 8.0


# Middles of small fragments of each target, by which placements are ranked.
Trees: TypeAlias = Mapping[Target, KDTree]


@final
@frozen
class Closest:
    """A measured distance between tool and target.

    Attributes:
        distance: [mm]; negative inside the solid.
        solid: name of the part of the tool, or of the link.
        target: name of the target.
        row: placement where it was measured, or before it.
        tip: (3,) origin of the frame that moves with the solid: for the tool the tip [mm].
        lever: how far from that origin the nearest point of the target is [mm].
    """

    distance: float
    solid: str
    target: str
    row: int
    tip: FloatArray
    lever: float

    @property
    def finding(self) -> str:
        """What a message says of it."""
        if self.distance < 0.0:
            return f"the {self.solid} reaches {-self.distance:.2f} mm into the {self.target}"
        return f"the {self.solid} comes within {self.distance:.2f} mm of the {self.target}"


@final
@frozen
class _Case:
    """A solid of a link at a placement, and a target that is not nearer to it than the bound [mm]."""

    bound: float
    shape: Revolution
    target: Target
    placements: Placements
    row: int


def shapes_of(solids: tuple[Solid, ...]) -> tuple[Revolution, ...]:
    """Join neighbouring solids into convex shapes where they are one: cone and barrel; the others stay alone."""
    groups: list[tuple[Solid, ...]] = []
    for solid in solids:
        if groups and _continues(groups[-1][-1], solid):
            groups[-1] = (*groups[-1], solid)
        else:
            groups.append((solid,))
    return tuple(revolution(group) for group in groups)


def _continues(first: Solid, second: Solid) -> bool:
    """Say whether a solid widens less where the one before it ends, on the same axis, and both are inflated alike."""
    meets = np.array_equal(first.end, second.start) and first.end_radius == second.start_radius
    straight = bool(np.linalg.norm(first.axis - second.axis) < SAME_AXIS)
    slopes = [(solid.end_radius - solid.start_radius) / solid.length for solid in (first, second)]
    return meets and straight and slopes[1] <= slopes[0] and first.reach_below == second.reach_below


def worst_hit(hits: Hits, world: CollisionWorld) -> Closest:
    """Measure hits and return the deepest; if none goes in, the closest.

    Up to MEASURED_HITS hits spread over all of them are measured, then as many around the worst of these.
    """
    chosen = _spread(0, len(hits.rows), MEASURED_HITS)
    found = _measure_hits(hits, world, chosen)
    worst = int(chosen[np.argmin([closest.distance for closest in found])])
    gap = -(-len(hits.rows) // MEASURED_HITS)
    around = _spread(max(worst - gap, 0), min(worst + gap + 1, len(hits.rows)), MEASURED_HITS)
    found += _measure_hits(hits, world, around, within=min(closest.distance for closest in found))
    return min(found, key=lambda closest: closest.distance)


def ranking_trees(targets: tuple[Target, ...], *, known: Trees = MappingProxyType({})) -> Trees:
    """Return the middles of small fragments of each target, by which placements are ranked; known ones are taken."""
    return {target: known[target] if target in known else _fragments(target) for target in targets}


def smallest_distance(placements: Placements, world: CollisionWorld, trees: Trees) -> Closest:
    """Return the smallest distance found between the tool above its tip zone and any target.

    For every target RANKED_PLACEMENTS placements are ordered by the distance of points of the tool's axis from small
    fragments of the target; the first MEASURED_PLACEMENTS are measured exactly, unless a nearer target has been found.
    """
    rows = _spread(0, placements.count, RANKED_PLACEMENTS)
    shapes = [shape for shape in shapes_of(world.solids) if shape.solids[0].reach_below > 0.0]
    solids = [solid for shape in shapes for solid in shape.solids]
    best: list[Closest] = []
    least = inf
    for target in world.targets:
        ranks, beyond = _lowest_ranks(placements.poses[rows], solids, trees[target])
        lowest = min(_lowest(*each, beyond=beyond) for each in zip(ranks, solids, strict=True))
        if lowest - _fragment_radius(target) > least:
            continue
        lowest_ranks: FloatArray = np.min(ranks, axis=0)
        order = np.argsort(np.round(lowest_ranks, NEARNESS_DECIMALS), kind="stable")
        for row in rows[order[:MEASURED_PLACEMENTS]].tolist():
            for shape in shapes:
                best.append(_measure(shape, target, placements.poses[row], row=row, within=least))
                least = min(least, best[-1].distance)
    return min(best, key=_nearness)


def tool_distances(tool: Tool, targets: Sequence[Target], poses: FloatArray) -> FloatArray:
    """Return the (k,) distances between the tool above its tip zone and what is nearest of some targets [mm].

    Args:
        tool: its solids.
        targets: one or more.
        poses: (k, 4, 4) of the tool in the frame of the targets [mm].
    """
    shapes = [shape for shape in shapes_of(tool_solids(tool)) if shape.solids[0].reach_below > 0.0]
    found = np.full(len(poses), inf)
    for row, pose in enumerate(poses):
        for shape in shapes:
            for target in targets:
                found[row] = min(found[row], _measure(shape, target, pose, row=row, within=found[row]).distance)
    return found


def smallest_arm_distance(moving: Sequence[tuple[CollisionWorld, Placements]], trees: Trees) -> Closest:
    """Return the smallest distance found between any link and any target.

    RANKED_ARM_PLACEMENTS placements of every solid are ordered by how near a target may be; in this order the distance
    of some fragments is taken while nearer ones may follow. The MEASURED_ARM_PLACEMENTS best are measured exactly, and
    where that is near, placements around the best of them, ever closer.
    """
    found: list[tuple[float, _Case]] = []
    least = inf
    for case in sorted(_arm_cases(moving, trees), key=lambda case: round(case.bound, NEARNESS_DECIMALS)):
        if case.bound > least + ARM_FRAGMENT_MARGIN:
            break
        distance = _fragment_distance(case, trees[case.target])
        least = min(least, distance)
        found.append((distance, case))
    nearest_first = sorted(found, key=lambda pair: round(pair[0], NEARNESS_DECIMALS))
    first = [case for _, case in nearest_first[:MEASURED_ARM_PLACEMENTS]]
    best, nearest_case = _measure_case(first[0], first[0].row), first[0]
    for case in first[1:]:
        measured = _measure_case(case, case.row, within=best.distance)
        if _nearness(measured) < _nearness(best):
            best, nearest_case = measured, case
    count = nearest_case.placements.count
    gap = -(-count // RANKED_ARM_PLACEMENTS)
    while gap and best.distance < NEAR_ARM:
        rows = _spread(max(best.row - gap, 0), min(best.row + gap + 1, count), MEASURED_ARM_PLACEMENTS)
        around = [_measure_case(nearest_case, row, within=best.distance) for row in rows.tolist()]
        best = min([best, *around], key=_nearness)
        gap //= 2
    return best


def _nearness(closest: Closest) -> float:
    return round(closest.distance, NEARNESS_DECIMALS)


def _arm_cases(moving: Sequence[tuple[CollisionWorld, Placements]], trees: Trees) -> list[_Case]:
    """Bound the distances at ranked placements, the last links first: what is farther than they needs no bound."""
    cases: list[_Case] = []
    least = inf
    for world, placements in reversed(moving):
        rows = _spread(0, placements.count, RANKED_ARM_PLACEMENTS)
        for solid, target in product(world.solids, world.targets):
            within = least + solid.start_radius + ARM_FRAGMENT_MARGIN
            bounds = _ranks(placements.poses[rows], solid, trees[target], within=within)
            shape = revolution((solid,))
            pairs = zip(bounds.tolist(), rows.tolist(), strict=True)
            cases += [_Case(bound, shape, target, placements, row) for bound, row in pairs]
            lowest = cases[len(cases) - len(rows) + int(np.argmin(bounds))]
            least = min(least, _fragment_distance(lowest, trees[target]))
    return cases


def _fragment_distance(case: _Case, tree: KDTree) -> float:
    """Return the distance of a solid from the middles of some fragments of a target [mm]."""
    pose = case.placements.poses[case.row]
    places = np.asarray(tree.data)[:: -(-tree.n // ARM_FRAGMENTS)]
    return float(signed_distances(case.shape, (places - pose[:3, 3]) @ pose[:3, :3]).min())


def _measure_case(case: _Case, row: int, *, within: float = inf) -> Closest:
    return _measure(case.shape, case.target, case.placements.poses[row], row=row, within=within)


def _measure_hits(hits: Hits, world: CollisionWorld, chosen: IntArray, *, within: float = inf) -> list[Closest]:
    """Measure some hits, each as far as it may be the deepest of them, and lie within a distance."""
    found: list[Closest] = []
    for index in chosen.tolist():
        struck = dict(zip(world.solids, hits.pairs[index], strict=True))
        row, pose = int(hits.rows[index]), hits.poses[index]
        measured = [
            _measure(shape, target, pose, row=row, within=within)
            for shape in shapes_of(world.solids)
            for column, target in enumerate(world.targets)
            if any(struck[solid][column] for solid in shape.solids)
        ]
        found.append(min(measured, key=lambda closest: closest.distance))
        within = min(within, found[-1].distance)
    return found


def _measure(shape: Revolution, target: Target, pose: FloatArray, *, row: int, within: float = inf) -> Closest:
    """Measure one shape of the tool against the triangles that can be nearest, after what a few of them tell.

    Where none of them lies within a distance, one is measured that does not.
    """
    centres, radii = target.balls
    local = (centres - pose[:3, 3]) @ pose[:3, :3]
    stride = -(-len(local) // FIRST_TRIANGLES)
    enough = max(float(signed_distances(shape, local[::stride]).min()), 0.0) + radii[:, None]
    low, high = shape.bounds
    near = ((local >= low - enough) & (local <= high + enough)).all(axis=1)
    distance, point = nearest(shape, (target.triangles[near] - pose[:3, 3]) @ pose[:3, :3], within=within)
    solid = shape.solid_at(point).name
    return Closest(
        distance, solid=solid, target=target.name, row=row, tip=pose[:3, 3], lever=float(np.linalg.norm(point))
    )


def _fragments(target: Target) -> KDTree:
    largest = _fragment_radius(target)
    fragments, rest = [np.empty((0, 3))], target.triangles
    while len(rest):
        centres, radii = circumscribed(rest)
        fragments.append(centres[radii <= largest])
        rest = _cut(rest[radii > largest])
    return KDTree(np.concatenate(fragments))


def _fragment_radius(target: Target) -> float:
    extent = float(np.linalg.norm(np.ptp(target.triangles, axis=(0, 1))))
    return max(FRAGMENT_RADIUS, FRAGMENT_SHARE * extent)


def _cut(triangles: FloatArray) -> FloatArray:
    """Return the quarters of (m, 3, 3) triangles, and the halves of those that are far longer than wide."""
    sides = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
    doubled = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    long = sides.max(axis=1) ** 2 > LONG * doubled
    # The longest side leads from the first corner to the second.
    turned = (sides[long].argmax(axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(triangles[long], turned[:, :, None], axis=1), 1, 0)
    middle = (a + b) / 2
    halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
    return np.concatenate([quarter(triangles[~long]), *halves])


def _lowest_ranks(poses: FloatArray, solids: list[Solid], tree: KDTree) -> tuple[list[FloatArray], float]:
    """Return `_ranks` of solids, infinite where they are above a bound, and that bound [mm].

    It is the one of a few placements up to which there are as many as are measured: no other can be among the lowest.
    """
    few = [_ranks(poses[::RANKED_FIRST], solid, tree, within=RANKED_DISTANCE) for solid in solids]
    lowest = np.sort(np.min(few, axis=0))
    bound = float(lowest[MEASURED_PLACEMENTS - 1]) if lowest.size >= MEASURED_PLACEMENTS else inf
    # The tree leaves out what is exactly as far as its bound.
    reaches = [bound + RANK_ROUNDING + max(solid.start_radius, solid.end_radius) for solid in solids]
    ranks = [
        _ranks(poses, solid, tree, within=float(np.clip(reach, 0.0, RANKED_DISTANCE)))
        for solid, reach in zip(solids, reaches, strict=True)
    ]
    return ranks, bound


def _ranks(poses: FloatArray, solid: Solid, tree: KDTree, *, within: float) -> FloatArray:
    """Return the (k,) distance of each placement from a target as far as points of the axis tell [mm]."""
    shares = np.linspace(0.0, 1.0, _axis_steps(solid) + 1)
    points = solid.start + shares[:, None] * (solid.end - solid.start)
    radii = solid.start_radius + shares * (solid.end_radius - solid.start_radius)
    places = (np.einsum("kij,aj->kai", poses[:, :3, :3], points) + poses[:, None, :3, 3]).reshape(-1, 3)
    distances = np.full(len(places), inf)
    beside = ((places >= tree.mins - within) & (places <= tree.maxes + within)).all(axis=1)
    distances[beside] = tree.query(places[beside], distance_upper_bound=within)[0]
    return np.asarray((distances.reshape(len(poses), -1) - radii).min(axis=1))


def _axis_steps(solid: Solid) -> int:
    step = float(np.clip(AXIS_STEP_SHARE * solid.end_radius, *AXIS_STEPS))
    return max(int(solid.length / step), 1)


def _lowest(ranks: FloatArray, solid: Solid, *, beyond: float) -> float:
    """Bound how near a solid of the tool is to a fragment at placements of these ranks, infinite above a bound [mm].

    Its nearest point lies on a circle about a place of the axis that is half a step from the next point of that at
    most.
    """
    half = solid.length / _axis_steps(solid) / 2.0
    wider = half * abs(solid.end_radius - solid.start_radius) / solid.length
    unseen = RANKED_DISTANCE - max(solid.start_radius, solid.end_radius)
    return min(float(ranks.min()), beyond, unseen) - half - wider


def _spread(first: int, stop: int, count: int) -> IntArray:
    """Return at most `count` whole numbers spread evenly from first to stop - 1, both included."""
    return np.unique(np.linspace(first, stop - 1, min(count, stop - first)).round().astype(np.int64))
