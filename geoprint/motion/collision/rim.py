"""The rim of the needle along a motion: whether it has room over the surface wherever material is laid."""

from __future__ import annotations

import numpy as np

from geoprint.errors import ClearanceError, InputError, VerificationError
from geoprint.model import FloatArray
from geoprint.motion.collision.contact import CollisionWorld
from geoprint.motion.collision.surroundings import Target
from geoprint.motion.collision.sweep import Placements
from geoprint.motion.collision.tip_zone import SMALLEST_ROOM, TipZone
from geoprint.surfaces import in_words, triple

# What a person may do where nothing is known of what helps.
NO_ROOM_ADVICE = "raise the stand-off, lean less, or use a thinner needle"


def refuse_rim(
    placements: Placements, world: CollisionWorld, zones: tuple[TipZone, ...], *, radius: float, standoff: float
) -> float:
    """Refuse a rim of the needle that lacks room on deposit; return the smallest room that it has [mm].

    Each placement stands for half of the step before it and half of the step behind it: its circle is widened so that
    it holds the needle in both, and by the rounding of a corner anywhere in them; the tip may be as much lower there.
    """
    laying = placements.deposit.copy()
    laying[1:] |= placements.deposit[:-1]
    rows = np.flatnonzero(laying)
    if not len(rows):
        raise InputError("the path lays no material, so that there is no room under the needle's rim to check.")
    tips = placements.poses[:, :3, 3]
    steps = np.where(placements.deposit[:-1], np.linalg.norm(np.diff(tips, axis=0), axis=1), 0.0)
    beside = np.maximum(np.append(steps, 0.0), np.append(0.0, steps))[rows]
    rounding = _largest_around(placements.rounding(world.solids[:1])[:, 0])[rows]
    widened = np.hypot(radius, beside / 2) + rounding
    rooms = np.array([zone.rooms(placements.poses[rows], radius=widened, standoff=standoff) for zone in zones])
    rooms -= rounding
    target, index = np.unravel_index(int(np.argmin(rooms)), rooms.shape)
    least, row = float(rooms[target, index]), int(rows[index])
    if least == np.inf:
        raise VerificationError(
            f"no surface is found below the tip at any of the {len(rows)} placements that lay material: path and part "
            "do not belong together; check where the part stands."
        )
    if least < SMALLEST_ROOM:
        short = int((rooms.min(axis=0) < SMALLEST_ROOM).sum())
        raise _no_room(placements, world.targets[int(target)], row=row, room=least, standoff=standoff, short=short)
    return least


def _largest_around(values: FloatArray) -> FloatArray:
    """Return the largest of each value and its neighbours."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    return np.maximum(np.maximum(padded[:-2], padded[2:]), values)


def _no_room(
    placements: Placements, target: Target, *, row: int, room: float, standoff: float, short: int
) -> ClearanceError:
    tip = placements.poses[row, :3, 3]
    side = "; if this is the wrong side of the part, `--flip` turns it" if room < 0.0 else ""
    return ClearanceError(
        f"{placements.stretch(row)} at tip {in_words(tip)} the rim of the needle has {room:.2f} mm of room over the "
        f"{target.name} at a stand-off of {standoff:.2f} mm, at least {SMALLEST_ROOM} mm are needed; {short} "
        f"placements have too little: {NO_ROOM_ADVICE}{side}.",
        solid="needle's tip",
        against=target.name,
        run=int(placements.runs[row]),
        place=triple(tip),
        room=room,
        placements=short,
        advice=NO_ROOM_ADVICE,
    )
