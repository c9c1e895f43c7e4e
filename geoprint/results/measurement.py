"""What measuring files of toolpaths on a part yields."""

from __future__ import annotations

from typing import final

from geoprint.model import FloatArray, Reading, Surface, freeze_arrays, frozen
from geoprint.quality import Printed, RigidFit, Uniformity
from geoprint.surfaces.files import MeshFile


@final
@frozen
class MeasuredFile:
    """One file of toolpaths, measured.

    Attributes:
        name: of the file.
        format: that it was read as.
        deposit: how deposit was told from travel.
        points: that were read.
        dropped: runs of a single point, left out.
        reading: what its reader used, skipped and assumed.
        fit: the motion that laid it onto the part, or None where it was taken as it is.
        measured: how evenly it covers the part.
        printed: how even prints of it are expected to be.
        seconds: processor time that measuring took, all threads together [s].
    """

    name: str
    format: str
    deposit: str
    points: int
    dropped: int
    reading: Reading
    fit: RigidFit | None
    measured: Uniformity
    printed: Printed
    seconds: float


@final
@frozen
class Measurement:
    """Files of toolpaths, measured side by side on one part.

    Attributes:
        part: its file as it was read.
        surface: what they were measured on, as prepared.
        upright: (3, 3) rotation that turns the part's mean normal up.
        spacing: wanted [mm].
        files: in the order given, with names that differ.
        own_errors: whether the cell was given whose errors the prints have, and says them.
    """

    part: MeshFile
    surface: Surface
    upright: FloatArray
    spacing: float
    files: tuple[MeasuredFile, ...]
    own_errors: bool = False

    def __post_init__(self) -> None:
        freeze_arrays(self, upright="float: 3 3")
