"""The report page of a thickness over a part: in 3D, with the layers that make it, and as a map.

Stacks of layers are shown so, and prints that were scanned.
"""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.errors import InputError, how_many
from geoprint.geometry import face_areas, refine
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.reporting.colouring import Scale, thickness_scale
from geoprint.reporting.figures import (
    COVERAGE_DOTS,
    PANEL_INCHES,
    SIDE_INCHES,
    UNMEASURED,
    add_title,
    draw_part,
    png_bytes,
    polygons,
)
from geoprint.reporting.histogram import histograms
from geoprint.reporting.html import (
    Document,
    Json,
    Markup,
    choice,
    element,
    figure,
    joined,
    row_table,
    scene_block,
    view,
)
from geoprint.reporting.page import ONLY, document_page
from geoprint.reporting.scene import numbers, scale_data, step, thinned, turned, with_breaks
from geoprint.reporting.values import Picture
from geoprint.reporting.view import ViewSurface, view_surface, views

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# What the page of a stack, or of several that are compared, shows as plain frozen values; no stage is known here.


# Finished thickness over the wanted one at the ends of the colour scale.
THICKNESS_RANGE = (0.9, 1.1)
# Colours of the map of thickness: blue is too thin, as on the page.
THICKNESS_COLOURS = "RdBu_r"
FINISHED_LABEL = "finished thickness / target thickness\n(blue: too thin, red: too thick, grey: not judged)"
# Faces in all views: finer than can be seen, and every one costs time when the page opens.
VIEWED_FACES = 60_000
# The least height of a panel over its width.
LOWEST = 0.16


@final
@frozen
class LayerPaths:
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
class ThicknessWords:
    """What a page calls that which its views show.

    Attributes:
        view: what the views differ in.
        table: heading of the table.
        rows: what its rows are, in the plural.
        mark: of the first view, in a word.
        marked: what this means.
        what: thickness that is shown.
        of: of the thickness that it is shown over, in a word.
        paths: beside the slider of layers.
        ends: of the colour scale.
        legend: of the colours.
    """

    view: str
    table: str
    rows: str
    mark: str = ""
    marked: str = ""
    what: str = "finished thickness"
    of: str = "wanted"
    paths: str = "Paths of layers up to"
    ends: tuple[float, float] = THICKNESS_RANGE
    legend: str = (
        "Blue: too thin, red: too thick, white: as wanted. Grey: not judged, because a hollow closes below that "
        "height or the target is thinner than a layer."
    )

    @property
    def scale(self) -> Scale:
        """Of the colours."""
        return thickness_scale(*self.ends, what=self.what, of=self.of, legend=self.legend)


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
class ThicknessReport:
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
    """

    name: str
    verdict: tuple[str, ...]
    cautions: tuple[str, ...]
    surface: Surface
    R_view_work: FloatArray
    spacing: float
    words: ThicknessWords
    flows: tuple[FlowView, ...]
    paths: tuple[LayerPaths, ...]
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    pages: tuple[tuple[str, str], ...]
    pictures: tuple[tuple[str, tuple[Picture, ...]], ...]
    settings: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]

    def __post_init__(self) -> None:
        freeze_arrays(self, R_view_work="float: 3 3")
        if not self.flows:
            raise InputError(f"the page of the stack on {self.name} needs at least one flow.")
        if len(self.paths) not in {1, len(self.flows)}:
            raise InputError(f"the page of the stack on {self.name}: give one set of paths, or one for each flow.")
        for flow in self.flows:
            if flow.thickness.shape != (len(self.surface.vertices),):
                raise InputError(
                    f"the page of the stack on {self.name}: {flow.name} has {how_many(flow.thickness.size, 'value')} "
                    f"for {how_many(len(self.surface.vertices), 'vertex', 'vertices')} of the view surface."
                )


# The page of a stack as HTML: verdict, the thickness in 3D with the layers that make it, and every layer.


def thickness_document(stack: ThicknessReport, *, key: str) -> Document:
    """Return what the page says of a stack.

    Args:
        stack: what to show.
        key: of its scene.
    """
    words = stack.words
    spread = element(
        "p", f"Share of the area by its {words.what}; shaded: within 5 % of the {words.of} one. Each row has its own "
        "height.", class_="note",
    )  # fmt: skip
    ratios = histograms(
        [(flow.name, flow.ratios) for flow in stack.flows], of="area", axis=f"{words.what} / {words.of} thickness [1]"
    )
    table = row_table(stack.columns, stack.rows, label=f"{words.rows} over {stack.name}")
    return Document(
        name=stack.name,
        verdict=stack.verdict,
        cautions=stack.cautions,
        shown=_scene(stack, key),
        blocks=(
            (words.table, joined(table, _pages(stack))),
            (f"How the {words.what} is distributed", joined(spread, ratios)),
            *((head, element("section", *map(figure, some))) for head, some in stack.pictures if some),
        ),
        settings=stack.settings,
        inputs=stack.inputs,
    )


def _scene(stack: ThicknessReport, key: str) -> Markup:
    """Return the views of the flows side by side, and how many layers of paths are shown on them."""
    names = [(str(place), flow.name) for place, flow in enumerate(stack.flows)]
    count = max(paths.layers.size for paths in stack.paths)
    shown = element(
        "label", f"{stack.words.paths} ",
        element("input", type="range", name=f"{key}-layers", min=0, max=count, value=0, step=1),
        element("output", "none", class_="layers"),
    )  # fmt: skip
    controls = [
        choice(key, "backend", stack.words.view, [("all", "Side by side"), *names] if len(names) > 1 else names),
        choice(key, "colour", "Colour", [("thickness", stack.words.scale.heading)]),
        element(
            "fieldset", element("legend", "Show"), shown, element("button", "Reset view", type="button", class_="reset")
        ),
    ]
    views = [
        view(
            flow.still, key=key, place=place, name=flow.name, title=flow.title, figures=flow.figures,
            label=f"3D view of {stack.name}, {flow.name}",
            mark=(stack.words.mark, stack.words.marked) if place == 0 and len(names) > 1 else None,
        )
        for place, flow in enumerate(stack.flows)
    ]  # fmt: skip
    return scene_block(key, views, controls)


def _pages(stack: ThicknessReport) -> Markup:
    if not stack.pages:
        return Markup("")
    links = joined(*(element("li", element("a", name, href=address)) for name, address in stack.pages))
    return element("p", "Each of them, layer by layer:", element("ul", links), class_="note")


# The map of a thickness over a part, from enough sides: stands in where no 3D is drawn.


def thickness_view(part: Surface, *, edge_length: float, count: int = 1) -> ViewSurface:
    """Return a part to show a thickness on, with triangles as long as this [mm], as far as so many views allow."""
    faces = VIEWED_FACES // count
    # Of as many equilateral triangles as there may be.
    least = float(np.sqrt(4.0 / np.sqrt(3.0) * face_areas(part).sum() / faces))
    return view_surface(refine(part, edge_length=max(least, edge_length)), faces=faces)


def thickness_figure(
    surface: Surface,
    thickness: FloatArray,
    *,
    R_view_work: FloatArray,
    title: str,
    ends: tuple[float, float] = THICKNESS_RANGE,
    label: str = FINISHED_LABEL,
) -> bytes:
    """Draw the finished thickness over a part, from enough sides.

    Args:
        surface: to draw on, n vertices.
        thickness: (n,) over the wanted one; NaN where it is not judged, drawn grey.
        R_view_work: (3, 3) rotation to the first side.
        title: above everything.
        ends: of the colour scale.
        label: of it.

    Returns:
        The PNG's bytes; the same for the same input.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    figure, axes, sides = side_panels(surface, R_view_work)
    scale = Normalize(*ends)
    shades = colormaps[THICKNESS_COLOURS].with_extremes(bad=UNMEASURED)
    colours = shades(scale(np.ma.masked_invalid(thickness[surface.faces].mean(axis=1))))
    for axis, R_side_work in zip(axes, sides, strict=True):
        draw_part(axis, surface, R_side_work)
        corners = (surface.vertices @ R_side_work.T)[surface.faces]
        order = np.argsort(corners[..., 2].mean(axis=1))
        painted = colours[order]
        axis.add_collection(polygons(corners[order, :, :2], faces=painted, edges=painted, width=0.4))
    bar = figure.colorbar(ScalarMappable(scale, THICKNESS_COLOURS), ax=axes, shrink=0.8, pad=0.01, extend="both")
    bar.set_label(label, fontsize=9)
    add_title(figure, title)
    return png_bytes(figure)


def side_panels(surface: Surface, R_view_work: FloatArray) -> tuple[Figure, list[Axes], tuple[FloatArray, ...]]:
    """Return a figure with an axis for each side from which a part is seen, and these sides."""
    from matplotlib.figure import Figure

    sides = views(surface, R_view_work)
    sizes = [np.ptp(surface.vertices @ R.T, axis=0) for R in sides]
    tall = max(float(np.clip(size[1] / size[0], LOWEST, 1.0)) for size in sizes)
    inches = PANEL_INCHES if len(sides) == 1 else SIDE_INCHES
    figure = Figure(figsize=(inches * len(sides) + 1.2, inches * tall + 0.8), dpi=COVERAGE_DOTS, layout="constrained")
    return figure, list(figure.subplots(1, len(sides), squeeze=False)[0]), sides


# The report of stacks: one HTML file of the same form as that of a comparison, and the data of its scene.


def thickness_report(stack: ThicknessReport, *, title: str) -> bytes:
    """Return report.html of a stack: verdict, finished thickness in a 3D scene, and every layer.

    Args:
        stack: what to show.
        title: of the page.

    Returns:
        UTF-8 HTML; the same for the same input.
    """
    return document_page(title, thickness_document(stack, key=ONLY), scene=thickness_scene_data(stack))


def thickness_scene_data(stack: ThicknessReport) -> Json:
    """Return everything page.js needs to draw a stack: as `scene_data`, with the flows as backends.

    Returns:
        Beside what both have: of each flow its `thickness`, `path` of all layers, and `layers`, how much of it lies up
        to the end of each; the latter two once where all flows have the same.
    """
    upright, head = turned(stack.surface, R_view_work=stack.R_view_work, spacing=stack.spacing)
    paths = [_path(one, upright) for one in stack.paths]
    same = len(paths) == 1
    return {
        **head,
        "winner": 0,
        "scales": {"thickness": scale_data(stack.words.scale)},
        "machine": None,
        **(paths[0] if same else {}),
        "backends": [
            {"name": flow.name, "thickness": numbers(flow.thickness), **({} if same else paths[number])}
            for number, flow in enumerate(stack.flows)
        ],
    }


def _path(paths: LayerPaths, upright: Callable[[FloatArray], FloatArray]) -> dict[str, Json]:
    kept, offsets = thinned(paths.offsets, step=step(len(paths.places)))
    return {
        "path": numbers(with_breaks(upright(paths.places)[kept], offsets).T),
        # Between two runs stands a break.
        "layers": [int(offsets[runs]) + int(runs) - 1 for runs in paths.layers],
    }
