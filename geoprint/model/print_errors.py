"""How far a print strays from its plan: how arm and flow err, where the part stands, how the needle runs."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.model.values import comparable

# Repeatability is given as mean plus three standard deviations of the distance from the mean place [ISO9283]. For an
# error that is alike in all directions and has the standard deviation 1 in each, that distance has, in space (pose
# repeatability, RP), the mean 2 sqrt(2 / pi) and the variance 3 - 8 / pi; in the plane square to the path (path
# repeatability, RT) the mean sqrt(pi / 2) and the variance 2 - pi / 2.
POSE_FACTOR = float(2.0 * np.sqrt(2.0 / np.pi) + 3.0 * np.sqrt(3.0 - 8.0 / np.pi))
PATH_FACTOR = float(np.sqrt(np.pi / 2.0) + 3.0 * np.sqrt(2.0 - np.pi / 2.0))
# Path accuracy is given as the mean of the distance from the commanded path, in that plane.
ACCURACY_FACTOR = float(np.sqrt(np.pi / 2.0))
# Length over the part along which the arm's deviation from its paths changes [mm]. ASSUMED: some paths of a part, and
# less than the links of a small arm, with whose angles it changes.
ACCURACY_LENGTH = 100.0


@final
@comparable
class PrintErrors:
    """What moves a print: standard deviations, but for both repeatabilities, as [ISO9283] has them, and path accuracy.

    Unless a cell says otherwise they are those of the packaged cells.

    Attributes:
        repeatability: of a pose (RP): each run as a whole lies so far off [mm].
        path_repeatability: of a path (RT): along a run the tip strays so far, slowly [mm].
        path_accuracy: mean distance of the arm's paths from the commanded ones, of an IRB 120 as in [MAPS]: alike in
            every print, nearly alike for paths beside one another; 0 where nobody has measured it [mm].
        correlation: length along a run over which that fades: its correlation is exp(-(s / length)^2 / 2) [mm].
        placement: of where the part stands, along each axis; touched points tell it better [mm].
        placement_turn: of how it stands, about each axis [rad].
        needle_runout: of the needle's tip from the tool frame's z axis, along x and y [mm].
        flow: of the flow of a whole print, over the wanted one.
        run_flow: of the flow from run to run.
    """

    repeatability: float = 0.01
    path_repeatability: float = 0.03
    path_accuracy: float = 0.114
    correlation: float = 20.0
    placement: float = 0.1
    placement_turn: float = float(np.radians(0.1))
    needle_runout: float = 0.05
    flow: float = 0.05
    run_flow: float = 0.02

    @property
    def run_deviation(self) -> float:
        """Standard deviation of where a run lies, along each axis [mm]."""
        return self.repeatability / POSE_FACTOR

    @property
    def path_deviation(self) -> float:
        """Standard deviation of where the tip is along a run, along each axis [mm]."""
        return self.path_repeatability / PATH_FACTOR

    @property
    def accuracy_deviation(self) -> float:
        """Standard deviation of how far the arm's paths lie off, along each axis [mm]."""
        return self.path_accuracy / ACCURACY_FACTOR
