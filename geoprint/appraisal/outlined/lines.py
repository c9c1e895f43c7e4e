"""How near to the plan the lines of a photograph lie, if the camera stood at a place that is tried."""

from __future__ import annotations

from typing import final

import numpy as np
from scipy.spatial import KDTree

from geoprint.appraisal.against_plan import PlannedRuns
from geoprint.appraisal.beads import BeadLine
from geoprint.appraisal.camera import Camera
from geoprint.appraisal.on_part import place_beads
from geoprint.errors import InputError
from geoprint.model import Surface

# No place between runs is farther from one than this, over the spacing.
FARTHEST = 0.5


@final
class PrintedLines:
    """The lines of a photograph, and the plan that they are a print of."""

    def __init__(self, beads: tuple[BeadLine, ...], surface: Surface, plan: PlannedRuns) -> None:
        self._beads, self._surface, self._spacing = beads, surface, plan.spacing
        self._planned = KDTree(plan.finely(np.ones(len(plan.places), dtype=np.bool_)))

    def off(self, camera: Camera) -> float:
        """Return the mean distance from the lines to the nearest runs, over the spacing: 0 on them, at most a half.

        Lines that are no print of these runs are about a quarter off.

        Args:
            camera: that is thought to have seen them.
        """
        try:
            middles = place_beads(self._beads, camera, self._surface).middles
        except InputError:
            return FARTHEST
        distances = np.asarray(self._planned.query(middles)[0]) / self._spacing
        return float(np.minimum(distances, FARTHEST).mean())
