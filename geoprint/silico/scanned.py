"""A scan of beads on a part, by a known sensor that stands at a known place: a cloud with noise and holes.

Every line of sight that meets the part gives the point of the material over the foot that it meets.
"""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.model import BoolArray, FloatArray, Surface, freeze_arrays, frozen
from geoprint.silico.height_field import heights
from geoprint.silico.laid import LaidBeads
from geoprint.silico.viewpoint import Viewpoint
from geoprint.surfaces import normals
from geoprint.surfaces.rays import first_hits


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
                f"{self.noise:g} mm, {self.missing:.0%} and {self.patch:g} mm."
            )


@final
@frozen
class SilicoScan:
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
    beads: LaidBeads | None,
    sensor: Sensor,
    *,
    T_work_scan: FloatArray,
    random: np.random.Generator,
) -> SilicoScan:
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
    return SilicoScan(
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
