"""What appraising a scan yields: of a print, or of the part before it."""

from __future__ import annotations

from typing import final

from geoprint.appraisal.scanned.lying import LyingPart
from geoprint.appraisal.scanned.measuring import MeasuredPrint
from geoprint.appraisal.scanned.reading import Scan
from geoprint.deposition.feedback import PrintedProgram
from geoprint.model import FloatArray, Surface, freeze_arrays, frozen


@final
@frozen
class AppraisedScan:
    """A scan of a print, held against its plan.

    Attributes:
        scan: as read.
        unit: of its coordinates.
        printed: the program of the print.
        given: whether the pose it began from was given.
        surface: of the part.
        upright: (3, 3) rotation to the view.
        spacing: between neighbouring runs [mm].
        held: what it shows.
    """

    scan: Scan
    unit: str
    printed: PrintedProgram
    given: bool
    surface: Surface
    upright: FloatArray
    spacing: float
    held: MeasuredPrint

    def __post_init__(self) -> None:
        freeze_arrays(self, upright="float: 3 3")


@final
@frozen
class LyingScan:
    """A scan of a part before anything is printed on it.

    Attributes:
        scan: as read.
        unit: of its coordinates.
        part: name of the part's file.
        given: whether the pose it began from was given.
        most: largest offset that is allowed [mm].
        mesh: name of the file of the surface that is there.
        lying: how it lies.
    """

    scan: Scan
    unit: str
    part: str
    given: bool
    most: float
    mesh: str
    lying: LyingPart
