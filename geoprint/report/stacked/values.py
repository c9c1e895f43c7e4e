"""What the page of a stack, or of several that are compared, shows as plain frozen values; no stage is known here."""

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
class StackPaths:
    """The paths of all layers of a stack.

    Attributes:
        places: (k, 3) run after run, the lowest layer first [mm].
        offsets: (r + 1,) run i is `places[offsets[i]:offsets[i + 1]]`.
        layers: (l,) how many runs end with each layer.
    """

    places: FloatArray
    offsets: IntArray
    layers: IntArray

    def __post_init__(self) -> None:
        freeze_arrays(self, places="float: k 3", offsets="int: o", layers="int: l")
        if (
            not self.layers.size
            or np.diff(self.layers, prepend=0).min() < 1
            or self.layers[-1] != self.offsets.size - 1
        ):
            raise InputError("the page of a stack: each layer needs a run, and each run a layer.")


@final
@frozen
class StackWords:
    """What a page calls that which its views show.

    Attributes:
        view: what the views differ in.
        table: heading of the table.
        rows: what its rows are, in the plural.
        mark: of the first view, in a word.
        marked: what this means.
    """

    view: str
    table: str
    rows: str
    mark: str
    marked: str


OF_FLOWS = StackWords(
    "Flow", "Layer by layer", "Layers", "printed", "what is printed; it is shown where there is room for one"
)
OF_BACKENDS = StackWords(
    "Backend",
    "Backend by backend",
    "Backends",
    "best",
    "covers the layers best; it is shown where there is room for one",
)


@final
@frozen
class FlowView:
    """A finished stack with one flow, on the n vertices of the view surface.

    Attributes:
        name: of the flow, or of the backend that planned it.
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
    """Everything the page says of a stack, or of several over one part.

    Attributes:
        name: of the part, usually its file's.
        verdict: sentences in plain words; the first one decides and is set large.
        cautions: what nobody may overlook.
        surface: the part to draw on, with no more faces than a page bears (`view_surface`).
        R_view_work: (3, 3) rotation to the view: z up.
        spacing: of the paths [mm].
        words: what the views and the table are called.
        flows: the one that is printed, or the best, first.
        paths: of each flow, or one that all of them have.
        columns: headings of the table.
        rows: its cells, a row a layer or a stack.
        pages: (name, address beside this page) of the stacks that are compared.
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
    words: StackWords
    flows: tuple[FlowView, ...]
    paths: tuple[StackPaths, ...]
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    pages: tuple[tuple[str, str], ...]
    pictures: tuple[tuple[str, tuple[Picture, ...]], ...]
    settings: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]
    versions: tuple[tuple[str, str], ...]

    def __post_init__(self) -> None:
        freeze_arrays(self, R_view_work="float: 3 3")
        if not self.verdict or not self.flows:
            raise InputError(f"the page of the stack on {self.name} needs a verdict and at least one flow.")
        if len(self.paths) not in {1, len(self.flows)}:
            raise InputError(f"the page of the stack on {self.name}: every flow needs its paths, or all of them one.")
        if any(len(row) != len(self.columns) for row in self.rows):
            raise InputError(f"the page of the stack on {self.name}: every row needs {len(self.columns)} cells.")
        for flow in self.flows:
            if flow.thickness.shape != (len(self.surface.vertices),):
                raise InputError(
                    f"the page of the stack on {self.name}: {flow.name} has {flow.thickness.size} values for "
                    f"{len(self.surface.vertices)} vertices of the view surface."
                )
