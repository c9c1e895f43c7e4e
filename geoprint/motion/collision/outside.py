"""Refusals of a tool or an arm that is inside a closed surface, which nothing else would notice: it touches none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geoprint import transforms
from geoprint.errors import ClearanceError
from geoprint.motion.collision.contact import CollisionWorld
from geoprint.motion.collision.sides import inside
from geoprint.motion.collision.sweep import Placements
from geoprint.surfaces import in_words, triple

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
                f"{target.name}; correct where the part stands, or which side of the surface is outside.",
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
                f"the {name} is inside the closed {target.name} where the path begins; correct where the part stands.",
                solid=name,
                against=target.name,
            )
