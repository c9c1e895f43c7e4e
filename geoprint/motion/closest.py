"""Where the tool is closest to what it must not touch, or deepest in it: the numbers of a message or a report.

The check itself is `sweep`; here a few placements are measured exactly. Which ones is a choice by a cheap estimate, so
that a number found here is true for its placement, and the smallest of the whole way as far as the choice was right.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.model import FloatArray, IntArray
from geoprint.motion.collision import CollisionWorld
from geoprint.motion.surroundings import Target
from geoprint.motion.sweep import Hits, Placements
from geoprint.motion.tool_distance import (
    Nearest,
    Revolution,
    circumscribed,
    nearest,
    quarter,
    revolution,
    signed_distances,
)
from geoprint.motion.tool_solids import Solid

# Hits that are measured, spread over all of them, and again around the worst.
MEASURED_HITS = 40
# Placements that are ranked, spread over the whole way, and the best ones of a target that are measured.
RANKED_PLACEMENTS = 600
MEASURED_PLACEMENTS = 8
# Distance of the points of the axis by which placements are ranked [mm]: fine where the tool is thin.
AXIS_STEP = {"needle": 1.0, "cone": 3.0, "barrel": 3.0, "bracket": 3.0}
# Triangles, spread over all of a target, whose distance says which others need a look.
FIRST_TRIANGLES = 500
# A target farther from the tool's axis than this [mm] does not rank: the part below the tip is nearer.
RANKED_DISTANCE = 30.0
# Pieces of a target for ranking have this radius [mm], or this share of its extent where that is larger.
PIECE_RADIUS = 1.0
PIECE_SHARE = 0.02


@final
@dataclass(frozen=True, slots=True, eq=False)
class Closest:
    """A measured distance between tool and target.

    Attributes:
        distance: [mm]; negative inside the tool.
        solid: name of the piece of the tool.
        target: name of the target.
        row: placement where it was measured, or before it.
        tip: (3,) place of the tip there in the work frame [mm].
    """

    distance: float
    solid: str
    target: str
    row: int
    tip: FloatArray


def shapes_of(solids: tuple[Solid, ...]) -> tuple[Revolution, ...]:
    """Join the tool's solids into convex shapes: tip; needle; cone and barrel as one, for they are; bracket."""
    tip, needle, cone, barrel, bracket = solids
    return revolution((tip,)), revolution((needle,)), revolution((cone, barrel)), revolution((bracket,))


def worst_hit(hits: Hits, world: CollisionWorld) -> Closest:
    """Measure hits and return the deepest; if none goes in, the closest.

    Up to MEASURED_HITS hits spread over all of them are measured, then as many around the worst of these.
    """
    chosen = _spread(0, len(hits.rows), MEASURED_HITS)
    found = [_measure_hit(hits, world, int(index)) for index in chosen]
    worst = int(chosen[np.argmin([closest.distance for closest in found])])
    gap = -(-len(hits.rows) // MEASURED_HITS)
    around = _spread(max(worst - gap, 0), min(worst + gap + 1, len(hits.rows)), MEASURED_HITS)
    found += [_measure_hit(hits, world, int(index)) for index in around]
    return min(found, key=lambda closest: closest.distance)


def smallest_distance(placements: Placements, world: CollisionWorld) -> Closest:
    """Return the smallest distance found between the tool above its tip zone and any target.

    For every target RANKED_PLACEMENTS placements are ordered by the distance of points of the tool's axis from small
    pieces of the target; the first MEASURED_PLACEMENTS are measured exactly.
    """
    rows = _spread(0, placements.count, RANKED_PLACEMENTS)
    _, *shapes = shapes_of(world.solids)
    best: list[Closest] = []
    for target in world.targets:
        order = np.argsort(_ranks(placements.poses[rows], world.solids[1:], target), kind="stable")
        for row in rows[order[:MEASURED_PLACEMENTS]].tolist():
            best += [_measure(shape, target, placements.poses[row], row=row) for shape in shapes]
    return min(best, key=lambda closest: closest.distance)


def _measure_hit(hits: Hits, world: CollisionWorld, index: int) -> Closest:
    struck = dict(zip(world.solids, hits.pairs[index], strict=True))
    measured = [
        _measure(shape, target, hits.poses[index], row=int(hits.rows[index]))
        for shape in shapes_of(world.solids)
        for column, target in enumerate(world.targets)
        if any(struck[solid][column] for solid in shape.solids)
    ]
    return min(measured, key=lambda closest: closest.distance)


def _measure(shape: Revolution, target: Target, pose: FloatArray, *, row: int) -> Closest:
    """Measure one shape of the tool against the triangles that can be nearest, after what a few of them tell."""
    centres, radii = target.balls
    local = (centres - pose[:3, 3]) @ pose[:3, :3]
    stride = -(-len(local) // FIRST_TRIANGLES)
    enough = max(float(signed_distances(shape, local[::stride]).min()), 0.0) + radii[:, None]
    low, high = shape.bounds
    near = ((local >= low - enough) & (local <= high + enough)).all(axis=1)
    found: Nearest = nearest(shape, (target.triangles[near] - pose[:3, 3]) @ pose[:3, :3])
    solid = shape.solid_at(found.point).name
    return Closest(found.distance, solid=solid, target=target.name, row=row, tip=pose[:3, 3])


def _ranks(poses: FloatArray, solids: tuple[Solid, ...], target: Target) -> FloatArray:
    """Return the (k,) distance of each placement from a target as far as points of the axis tell [mm]."""
    extent = float(np.linalg.norm(np.ptp(target.triangles, axis=(0, 1))))
    largest = max(PIECE_RADIUS, PIECE_SHARE * extent)
    pieces, rest = [np.empty((0, 3))], target.triangles
    while len(rest):
        centres, radii = circumscribed(rest)
        pieces.append(centres[radii <= largest])
        rest = quarter(rest[radii > largest])
    tree = KDTree(np.concatenate(pieces))
    ranks = np.full(len(poses), inf)
    for solid in solids:
        shares = np.linspace(0.0, 1.0, max(int(solid.length / AXIS_STEP[solid.name]), 1) + 1)
        points = solid.start + shares[:, None] * (solid.end - solid.start)
        radii = solid.start_radius + shares * (solid.end_radius - solid.start_radius)
        places = np.einsum("kij,aj->kai", poses[:, :3, :3], points) + poses[:, None, :3, 3]
        distances = np.asarray(tree.query(places.reshape(-1, 3), distance_upper_bound=RANKED_DISTANCE)[0]).reshape(
            len(poses), -1
        )
        ranks = np.minimum(ranks, (distances - radii).min(axis=1))
    return ranks


def _spread(first: int, stop: int, count: int) -> IntArray:
    """Return at most `count` whole numbers spread evenly from first to stop - 1, both included."""
    return np.unique(np.linspace(first, stop - 1, min(count, stop - first)).round().astype(np.int64))
