"""From pixels to places: the beads of a photograph on the part, and what of a plan the camera sees."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.appraisal.beads import BeadLine
from geoprint.appraisal.camera import Camera
from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.surfaces import normals
from geoprint.surfaces.rays import first_hits

# Where a line of sight comes nearer to the surface than this [rad], a pixel covers three times its width and more.
FLATTEST_SIGHT = np.radians(20.0)
# What is farther behind the first thing in sight than this [mm] is hidden: a chord of a mesh cuts off less.
HIDDEN_BEHIND = 0.3
# Middles are a pixel apart; what is farther, on the flattest sight too, is a break [pixels].
LONGEST_STEP = 4.0


@final
@frozen
class PlacedBeads:
    """Places of a part at which a photograph shows beads.

    Attributes:
        middles: (k, 3) bead after bead, in their order [mm].
        lefts: (k, 3) edge to the left in the photograph [mm].
        rights: (k, 3) edge to the right [mm].
        pixels: (k, 2) middles in the photograph [pixels].
        beads: (k,) which bead of the photograph each belongs to.
        scale: length on the surface that a pixel covers, in the mean [mm].
    """

    middles: FloatArray
    lefts: FloatArray
    rights: FloatArray
    pixels: FloatArray
    beads: IntArray
    scale: float

    def __post_init__(self) -> None:
        freeze_arrays(
            self,
            middles="float: k 3",
            lefts="float: k 3",
            rights="float: k 3",
            pixels="float: k 2",
            beads="int: k",
        )

    @property
    def joined(self) -> BoolArray:
        """(k - 1,) whether a middle and the next one are of one bead, with material between them."""
        apart = np.linalg.norm(np.diff(self.middles, axis=0), axis=1)
        return np.asarray((self.beads[1:] == self.beads[:-1]) & (apart < LONGEST_STEP * self.scale))

    @property
    def steps(self) -> FloatArray:
        """(k,) length of the bead that each middle stands for: half of what joins it to its neighbours [mm]."""
        apart = np.where(self.joined, np.linalg.norm(np.diff(self.middles, axis=0), axis=1), 0.0)
        return 0.5 * (np.append(apart, 0.0) + np.insert(apart, 0, 0.0))

    @property
    def widths(self) -> FloatArray:
        """(k,) distance of both edges [mm]."""
        return np.asarray(np.linalg.norm(self.rights - self.lefts, axis=1))


def place_beads(beads: tuple[BeadLine, ...], camera: Camera, surface: Surface) -> PlacedBeads:
    """Return where on the part the beads of a photograph are; those beside it, or seen too flat, are left out.

    Args:
        beads: of the photograph.
        camera: that took it.
        surface: of the part.

    Raises:
        InputError: no bead lies on the part.
    """
    pixels = np.vstack([bead.middles[bead.seen] for bead in beads])
    sides = [np.vstack([getattr(bead, side)[bead.seen] for bead in beads]) for side in ("lefts", "rights")]
    numbers = np.repeat(np.arange(len(beads)), [int(bead.seen.sum()) for bead in beads])
    places = [_landed(camera, surface, each) for each in (pixels, *sides)]
    there = np.all([each[1] for each in places], axis=0)
    if not there.any():
        raise InputError(
            f"none of the {len(beads)} beads in the photograph lies on {surface.name} where the camera looks at it by "
            "the fiducials; check these, their unit and their order."
        )
    middles, lefts, rights = (each[0][there] for each in places)
    scale = float(np.linalg.norm(lefts - rights, axis=1).sum() / _widths(beads)[there].sum())
    return PlacedBeads(middles, lefts, rights, pixels[there], numbers[there], scale)


def _widths(beads: tuple[BeadLine, ...]) -> FloatArray:
    return np.concatenate([bead.widths[bead.seen] for bead in beads])


def in_sight(
    camera: Camera, surface: Surface, places: FloatArray, *, size: tuple[int, int], margin: float
) -> BoolArray:
    """Return which (k,) of places on a surface the camera sees: in the picture, not hidden, and not too flat.

    Args:
        camera: that looks at them.
        surface: they lie on.
        places: (k, 3) [mm].
        size: width and height of the photograph [pixels].
        margin: that a place lies within it, a bead's width, so that both edges of a bead there are seen [pixels].
    """
    away = places - camera.place
    ahead = away @ camera.T_camera_work[2, :3] > 0.0
    pixels = camera.seen(np.where(ahead[:, None], places, camera.place + camera.T_camera_work[2, :3]))
    within = ahead & (pixels >= margin).all(axis=1) & (pixels <= np.array(size) - 1.0 - margin).all(axis=1)
    distances = np.linalg.norm(away, axis=1)
    toward = away / distances[:, None]
    hits = first_hits(surface, np.broadcast_to(camera.place, away.shape).copy(), toward)
    first, steep = np.full(len(places), np.inf), np.zeros(len(places))
    first[hits.met] = hits.distances
    steep[hits.met] = -(normals(surface, hits.points) * toward[hits.met]).sum(axis=1)
    # A place at the rim may be missed by a hair: nothing is in front of it then.
    hidden = first < distances - HIDDEN_BEHIND
    flat = hits.met & (np.abs(steep) < np.sin(FLATTEST_SIGHT))
    return within & ~hidden & ~flat


def _landed(camera: Camera, surface: Surface, pixels: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return the (k, 3) places at which pixels look, and whether the part is there and not seen too flat."""
    toward = camera.directions(pixels)
    hits = first_hits(surface, np.broadcast_to(camera.place, toward.shape).copy(), toward)
    there = hits.met.copy()
    there[hits.met] = np.abs((normals(surface, hits.points) * toward[hits.met]).sum(axis=1)) >= np.sin(FLATTEST_SIGHT)
    places = np.zeros(toward.shape)
    places[hits.met] = hits.points.xyz(surface)
    return places, there
