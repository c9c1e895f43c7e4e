"""What is known of a stack when all of its layers are planned: what each lays over the part, and how it is sliced."""

from __future__ import annotations

from typing import final

from geoprint.layers import CutPlane, Slice
from geoprint.model import BoolArray, FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.quality.stacked import ColumnFeet, Finished


@final
@frozen
class StackedLayer:
    """What is kept of a planned layer: f flows, k columns over the part, r runs.

    Attributes:
        bottom: height over the part at which it begins [mm].
        height: its own [mm].
        spacing: of its paths [mm].
        laid: (f, k) its thickness on the columns with constant flow, with the flow that follows the width, and where
            there is a robot as the program was executed [mm].
        printed: which of these flows is printed.
        met: (k,) whether a column has met others below its top.
        within: (k,) whether it is between the sides of the stack in its middle.
        volumes: (f,) that these flows lay [mm3].
        slices: what each of the two middle planes cuts of it.
        places: (p, 3) its paths, run after run [mm].
        offsets: (r + 1,) where each run starts among them.
    """

    bottom: float
    height: float
    spacing: float
    laid: FloatArray
    printed: int
    met: BoolArray
    within: BoolArray
    volumes: FloatArray
    slices: tuple[Slice, ...]
    places: FloatArray
    offsets: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(
            self, laid="float: f k", met="bool: k", within="bool: k", volumes="float: f", places="float: p 3",
            offsets="int: o",
        )  # fmt: skip

    @property
    def seams(self) -> FloatArray:
        """(r, 3) where its runs start [mm]."""
        return self.places[self.offsets[:-1]]


@final
@frozen
class FinishedStack:
    """A whole stack, as it is simulated.

    Attributes:
        base: the part.
        inputs: name and SHA-256 of its files.
        upright: (3, 3) rotation in which its mean normal is up.
        planes: that slice it open in its middle.
        ground: the line of the part in each of these: (q, 2) places [mm] and where each line starts.
        feet: of the columns.
        wanted: (k,) thickness wanted on these [mm].
        layers: the lowest first.
        flows: how the stack comes out with each flow of its layers; None where nothing can be judged.
        printed: which of these is printed.
    """

    base: Surface
    inputs: tuple[tuple[str, str], ...]
    upright: FloatArray
    planes: tuple[CutPlane, ...]
    ground: tuple[tuple[FloatArray, IntArray], ...]
    feet: ColumnFeet
    wanted: FloatArray
    layers: tuple[StackedLayer, ...]
    flows: tuple[Finished | None, ...]
    printed: int

    def __post_init__(self) -> None:
        freeze_arrays(self, upright="float: 3 3", wanted="float: k")
