"""From pixels to places on the part, and how far two sets of lines lie apart."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import InputError
from geoprint.geometry import normals
from geoprint.geometry.rays import first_hits
from geoprint.inspection.beads import BeadLine
from geoprint.inspection.camera import Camera
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, comparable, freeze_arrays, frozen

# From pixels to places: the beads of a photograph on the part, and what of a plan the camera sees.


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
            f"no bead in the photograph (of {len(beads)}) lies on {surface.name}, seen as the "
            "fiducials place the camera. Check the fiducials, their unit and their order."
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


# How far two sets of lines lie apart: the paper's Hausdorff distance, and what that single number hides.


@final
@comparable
class Directed:
    """Distances from every point of one set to the nearest one of another, in the unit of both.

    Attributes:
        largest: their supremum.
        p95: their 95th percentile.
        mean: of them all.
    """

    largest: float
    p95: float
    mean: float


@final
@comparable
class SetDistances:
    """How far two sets of points lie apart.

    Attributes:
        there: from the first to the second: large where the first has what the second lacks.
        back: from the second to the first.
    """

    there: Directed
    back: Directed

    @property
    def hausdorff(self) -> float:
        """max(sup inf d, sup inf d), the paper's eq. 3 [Huttenlocher1993]."""
        return max(self.there.largest, self.back.largest)

    @property
    def p95(self) -> float:
        """The larger of both 95th percentiles: a Hausdorff distance that a twentieth of each set cannot spoil."""
        return max(self.there.p95, self.back.p95)

    @property
    def mean(self) -> float:
        """The mean of both means."""
        return 0.5 * (self.there.mean + self.back.mean)


def apart(first: FloatArray, second: FloatArray) -> SetDistances:
    """Measure how far two sets of points lie apart.

    Args:
        first: (n, d) points, such as the middles of the beads of one photograph.
        second: (m, d) points of another.

    Raises:
        InputError: a set is empty, as the distance from nothing is not defined, or the dimensions differ.
    """
    if not (first.size and second.size) or first.shape[1:] != second.shape[1:]:
        raise InputError(
            f"distances need two sets of points with as many coordinates, found {first.shape} and {second.shape}."
        )
    return SetDistances(_directed(first, second), _directed(second, first))


def _directed(source: FloatArray, target: FloatArray) -> Directed:
    distances = np.asarray(KDTree(target).query(source)[0])
    return Directed(float(distances.max()), float(np.percentile(distances, 95.0)), float(distances.mean()))
