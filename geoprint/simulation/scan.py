"""A simulated scan: how high beads stand over a part, seen by a known sensor with noise and holes."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint import transforms
from geoprint.errors import InputError, percent
from geoprint.geometry import normals
from geoprint.geometry.rays import first_hits
from geoprint.model import BoolArray, FloatArray, Surface, freeze_arrays, frozen
from geoprint.simulation.deposited import DepositedBeads
from geoprint.simulation.viewpoint import Viewpoint

# How high material stands over a part: the beads of a simulated print, added up where they meet.
#
# Every place of a bead deposits its volume as the cap of a sphere pressed flat: its height at distance r is that of
# sqrt(R^2 - r^2), with R half the width. Along a straight bead these add up to a parabola across, whose area is the
# volume deposited per length; round a corner, at an end and where beads overlap nothing is lost or counted twice.


# Feet that are asked for at once: a hundred places of beads about each, at most, take 0.1 GB.
BATCH = 20_000


def heights(beads: DepositedBeads, feet: FloatArray) -> FloatArray:
    """Return the (k,) height of the material over places of the part, along the normals there [mm].

    Args:
        beads: that are deposited.
        feet: (k, 3) on the part [mm].
    """
    there = np.flatnonzero(beads.widths > 0.0)
    result = np.zeros(len(feet))
    if not there.size:
        return result
    volumes = beads.volumes[there]
    radii = 0.5 * beads.widths[there]
    tree, reach = KDTree(beads.places[there]), float(radii.max())
    for start in range(0, len(feet), BATCH):
        some = feet[start : start + BATCH]
        near = KDTree(some).sparse_distance_matrix(tree, reach, output_type="ndarray")
        foot, place, away = near["i"], near["j"], near["v"]
        radius = radii[place]
        cap = np.sqrt(np.maximum(radius**2 - away**2, 0.0))
        deposited = 1.5 * volumes[place] * cap / (np.pi * radius**3)
        result[start : start + BATCH] = np.bincount(foot, deposited, minlength=len(some))
    return result


# A scan of beads on a part, by a known sensor that stands at a known place: a cloud with noise and holes.
#
# Every line of sight that meets the part gives the point of the material over the foot that it meets.


@final
@frozen
class Sensor:
    """What scans.

    Attributes:
        view: where it stands in the part's coordinates, and its lines of sight: one a pixel.
        noise: standard deviation of each point along its line of sight [mm].
        missing: share of the points that is lost in patches.
        patch: radius of such a patch [mm].
    """

    view: Viewpoint
    noise: float = 0.0
    missing: float = 0.0
    patch: float = 3.0

    def __post_init__(self) -> None:
        if self.noise < 0.0 or not 0.0 <= self.missing < 1.0 or self.patch <= 0.0:
            raise InputError(
                f"a sensor has no negative noise, loses less than all and has patches of some size, found "
                f"{self.noise:g} mm, {percent(self.missing)} and {self.patch:g} mm."
            )


@final
@frozen
class SimulatedScan:
    """A scan whose truth is known.

    Attributes:
        points: (k, 3) in the sensor's coordinates [mm].
        feet: (k, 3) of the part, below them, in the part's coordinates [mm].
        heights: (k,) of the material there, without noise [mm].
        T_work_scan: (4, 4) turns coordinates of the scan into those of the part [mm].
    """

    points: FloatArray
    feet: FloatArray
    heights: FloatArray
    T_work_scan: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, points="float: k 3", feet="float: k 3", heights="float: k", T_work_scan="float: 4 4")


def scanned(
    surface: Surface,
    beads: DepositedBeads | None,
    sensor: Sensor,
    *,
    T_work_scan: FloatArray,
    random: np.random.Generator,
) -> SimulatedScan:
    """Return a scan of a part with beads on it.

    Args:
        surface: the part.
        beads: on it; None for a part on which nothing is printed yet.
        sensor: that scans.
        T_work_scan: (4, 4) of the coordinates in which the scan is given.
        random: of noise and holes.

    Raises:
        InputError: the sensor does not see the part.
    """
    rays = sensor.view.rays()
    hits = first_hits(surface, np.broadcast_to(sensor.view.place, rays.shape).copy(), rays)
    if not hits.met.any():
        raise InputError(f"the sensor does not see {surface.name}: no line of sight meets it; place it elsewhere.")
    feet, up, toward = hits.points.xyz(surface), normals(surface, hits.points), rays[hits.met]
    high = np.zeros(len(feet)) if beads is None else heights(beads, feet)
    kept = _kept(feet, sensor, random)
    noise = sensor.noise * random.standard_normal(len(feet))
    points = feet + high[:, None] * up + noise[:, None] * toward
    return SimulatedScan(
        transforms.apply(transforms.inverse(T_work_scan), points[kept]), feet[kept], high[kept], T_work_scan
    )


def _kept(feet: FloatArray, sensor: Sensor, random: np.random.Generator) -> BoolArray:
    """Return which of the feet are not in a patch that is lost, patch after patch until enough is."""
    kept = np.ones(len(feet), dtype=np.bool_)
    tree = KDTree(feet)
    while kept.mean() > 1.0 - sensor.missing:
        middle = feet[int(random.integers(len(feet)))]
        lost = np.array(tree.query_ball_point(middle, sensor.patch), dtype=np.int64)
        # The last patch ends where enough is lost.
        still = lost[kept[lost]]
        kept[still[: max(1, round(float((kept.mean() - 1.0 + sensor.missing) * len(feet))))]] = False
    return kept
