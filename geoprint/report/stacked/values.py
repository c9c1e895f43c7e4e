"""What the page of a stack shows, as plain frozen values; no stage is known here."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.report.values import Picture

# Finished thickness over the wanted one at the ends of the colour scale.
THICKNESS_RANGE = (0.9, 1.1)


@final
@frozen
class FlowView:
    """The finished stack with one flow, on the n vertices of the view surface.

    Attributes:
        name: of the flow.
        title: in a few words.
        figures: name and value of what decides.
        thickness: (n,) finished thickness over the wanted one; NaN where it is not judged.
        ratios: (k,) the same at places that stand for equal areas; NaN likewise.
        still: its map; stands in where no 3D is drawn, and in print.
    """

    name: str
    title: str
    figures: tuple[tuple[str, str], ...]
    thickness: FloatArray
    ratios: FloatArray
    still: Picture


@final
@frozen
class StackReport:
    """Everything the page says of a stack.

    Attributes:
        name: of the part, usually its file's.
        verdict: sentences in plain words; the first one decides and is set large.
        cautions: what nobody may overlook.
        surface: the part to draw on, with no more faces than a page bears (`view_surface`).
        R_view_work: (3, 3) rotation to the view: z up.
        spacing: of the paths [mm].
        flows: the one that is printed first.
        places: (k, 3) paths of all layers, run after run, the lowest layer first [mm].
        offsets: (r + 1,) run i is `places[offsets[i]:offsets[i + 1]]`.
        layers: (l,) how many runs end with each layer.
        columns: headings of the table of layers.
        rows: its cells, a row a layer.
        pictures: under their headings: the stack sliced open, its seams.
        settings: (name, value), as asked for.
        inputs: (file, SHA-256).
        versions: (program, version).
    """

    name: str
    verdict: tuple[str, ...]
    cautions: tuple[str, ...]
    surface: Surface
    R_view_work: FloatArray
    spacing: float
    flows: tuple[FlowView, ...]
    places: FloatArray
    offsets: IntArray
    layers: IntArray
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    pictures: tuple[tuple[str, tuple[Picture, ...]], ...]
    settings: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]
    versions: tuple[tuple[str, str], ...]

    def __post_init__(self) -> None:
        freeze_arrays(self, R_view_work="float: 3 3", places="float: k 3", offsets="int: o", layers="int: l")
        if not self.verdict or not self.flows:
            raise InputError(f"the page of the stack on {self.name} needs a verdict and at least one flow.")
        if (
            not self.layers.size
            or np.diff(self.layers, prepend=0).min() < 1
            or self.layers[-1] != self.offsets.size - 1
        ):
            raise InputError(f"the page of the stack on {self.name}: each layer needs a run, and each run a layer.")
        if any(len(row) != len(self.columns) for row in self.rows):
            raise InputError(f"the page of the stack on {self.name}: every row needs {len(self.columns)} cells.")
        for flow in self.flows:
            if flow.thickness.shape != (len(self.surface.vertices),):
                raise InputError(
                    f"the page of the stack on {self.name}: {flow.name} has {flow.thickness.size} values for "
                    f"{len(self.surface.vertices)} vertices of the view surface."
                )
