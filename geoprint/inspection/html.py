"""The report pages of photographs and scans as HTML, and lines drawn over a photograph."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.reporting.histogram import histograms
from geoprint.reporting.html import (
    Json,
    Markup,
    choice,
    distance_matrix,
    element,
    figure,
    how_made,
    joined,
    row_table,
    said,
    scene_block,
    view,
)
from geoprint.reporting.page import page
from geoprint.reporting.scene import numbers, step, thinned, turned, with_breaks
from geoprint.reporting.values import PathDistances, Picture

if TYPE_CHECKING:
    from PIL.Image import Image as Shown


# The report of photographed prints: one HTML file with the lines drawn over each photograph, and every figure.


MATRIX_NOTE = (
    "Above the diagonal: Hausdorff distance, the largest from a place of one photograph's lines to those of the other "
    "[pixels]. Below, shaded: the mean of these distances [pixels]."
)


@final
@frozen
class RowsReport:
    """A table of the page.

    Attributes:
        columns: headings.
        rows: cells, each row as many.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise InputError(f"a table of {', '.join(self.columns)} needs {len(self.columns)} cells in every row.")


@final
@frozen
class PhotographView:
    """What the page shows of one photograph.

    Attributes:
        name: of its file.
        said: sentences in plain words.
        pictures: the photograph with lines drawn over it, and its edges.
        runs: of the plan; None where there is none.
        faults: what is wrong, and where.
        widths: (k,) of the beads, over their mean; none where no width is known.
    """

    name: str
    said: tuple[str, ...]
    pictures: tuple[Picture, ...]
    runs: RowsReport | None
    faults: RowsReport
    widths: FloatArray

    def __post_init__(self) -> None:
        freeze_arrays(self, widths="float: k")


@final
@frozen
class PhotographsReport:
    """Everything the page says of photographs of prints.

    Attributes:
        verdict: the sentence that matters most, set large.
        cautions: what nobody may overlook.
        photographs: in their order.
        figures: a row a photograph.
        said: sentences on how far they lie apart.
        distances: between their lines [pixels]; None for one photograph.
        settings: (name, value).
        inputs: (file, SHA-256).
    """

    verdict: str
    cautions: tuple[str, ...]
    photographs: tuple[PhotographView, ...]
    figures: RowsReport
    said: tuple[str, ...]
    distances: PathDistances | None
    settings: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]

    def __post_init__(self) -> None:
        if not self.photographs:
            raise InputError("a page on photographs needs at least one; none was appraised.")


def photographs_report(report: PhotographsReport, *, title: str) -> bytes:
    """Return report.html of photographed prints: verdict, figures, how far they lie apart, and each of them.

    Args:
        report: what to show.
        title: of the page.

    Returns:
        UTF-8 HTML without any script; the same for the same input.
    """
    blocks = [
        element("p", report.verdict, class_="verdict"),
        said((), report.cautions),
        element("h2", "What the photographs show"),
        _table(report.figures, label="Photographs"),
        _apart(report),
        *(_photograph(each) for each in report.photographs),
        how_made(report.settings, report.inputs),
    ]
    return page(title, [element("h1", title), element("section", *blocks, class_="part", aria_label=title)], {})


def _photograph(each: PhotographView) -> Markup:
    """Return what the page shows of one photograph."""
    runs, faults = each.runs, each.faults
    bare = "No stretch of the plan in sight is without material, a blob or thin." if runs else "No line is broken."
    return joined(
        element("h2", each.name),
        *(element("p", sentence) for sentence in each.said),
        element("div", *map(figure, each.pictures), class_="beside"),
        *([element("h3", "Run by run"), _table(runs, label=f"Runs in {each.name}")] if runs else []),
        element("h3", "What is wrong, and where"),
        _table(faults, label=f"Faults in {each.name}") if faults.rows else element("p", bare),
        element("h3", "How the width is distributed"),
        *_widths(each),
    )


def _widths(each: PhotographView) -> tuple[Markup, ...]:
    """Return how widths are distributed, or that none is known."""
    if not each.widths.size:
        return (element("p", "No width is known."),)
    return (
        element("p", "Share of the length by its width; shaded: within 5% of the mean.", class_="note"),
        histograms([(each.name, each.widths)], of="length", axis="width / mean width [1]"),
    )


def _apart(report: PhotographsReport) -> Markup:
    if report.distances is None:
        return Markup("")
    return joined(
        element("h2", "How far their lines lie apart"),
        element("p", MATRIX_NOTE, class_="note"),
        distance_matrix(report.distances, unit="pixels", form="{:.4f}", label="Distances between the photographs"),
        element("ul", *(element("li", each) for each in report.said)),
    )


def _table(table: RowsReport, *, label: str) -> Markup:
    return row_table(table.columns, table.rows, label=label)


# The report of a scanned print: one HTML file of the form of a stack's, with the thickness over the part.


# Measured thickness over the planned one at the ends of the colour scale.
MEASURED_RANGE = (0.6, 1.4)
LEGEND = "Blue: too thin, red: too thick, white: as planned. Grey: not seen by the scan, or nothing is planned there."


@final
@frozen
class ScanReport:
    """Everything the page says of a scanned print.

    Attributes:
        name: of the part, usually its file's.
        verdict: sentences in plain words; the first one decides and is set large.
        cautions: what nobody may overlook.
        surface: the part to draw on, with no more faces than a page bears (`view_surface`).
        R_view_work: (3, 3) rotation to the view: z up.
        spacing: of the paths [mm].
        figures: name and value of what decides.
        thickness: (n,) measured over planned, at the vertices; NaN where it is not seen or nothing is planned.
        ratios: (k,) the same at cells of the surface.
        still: its map; stands in where no 3D is drawn, and in print.
        places: (p, 3) path of the plan, run after run [mm].
        offsets: (r + 1,) run i is `places[offsets[i]:offsets[i + 1]]`.
        columns: headings of the table of runs.
        rows: its cells, a row a run.
        settings: (name, value).
        inputs: (file, SHA-256).
    """

    name: str
    verdict: tuple[str, ...]
    cautions: tuple[str, ...]
    surface: Surface
    R_view_work: FloatArray
    spacing: float
    figures: tuple[tuple[str, str], ...]
    thickness: FloatArray
    ratios: FloatArray
    still: Picture
    places: FloatArray
    offsets: IntArray
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    settings: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]

    def __post_init__(self) -> None:
        freeze_arrays(self, R_view_work="float: 3 3", places="float: p 3", offsets="int: o")
        if not self.verdict or self.thickness.shape != (len(self.surface.vertices),):
            raise InputError(
                f"the page of the scan of {self.name} needs a verdict, and one value for each of its "
                f"{len(self.surface.vertices)} vertices, found {self.thickness.shape}."
            )
        if any(len(row) != len(self.columns) for row in self.rows):
            raise InputError(f"the page of the scan of {self.name}: every row needs {len(self.columns)} cells.")


def scan_report(scan: ScanReport, *, title: str) -> bytes:
    """Return report.html of a scanned print: verdict, thickness in a 3D scene, and every run.

    Args:
        scan: what to show.
        title: of the page.

    Returns:
        UTF-8 HTML; the same for the same input.
    """
    key = "part0"
    return page(title, [element("h1", title), _section(scan, key)], {key: _scene_data(scan)})


def _scene_data(scan: ScanReport) -> Json:
    """Return everything page.js needs to draw the print: as for a stack of one layer."""
    upright, head = turned(scan.surface, R_view_work=scan.R_view_work, spacing=scan.spacing)
    kept, offsets = thinned(scan.offsets, step=step(len(scan.places)))
    return {
        **head,
        "winner": 0,
        "thicknesses": list(MEASURED_RANGE),
        "said": {"what": "measured thickness", "of": "planned", "legend": LEGEND},
        "machine": None,
        "path": numbers(with_breaks(upright(scan.places)[kept], offsets).T),
        "layers": [int(offsets[-1]) + int(offsets.size) - 2],
        "backends": [{"name": scan.name, "thickness": numbers(scan.thickness)}],
    }


def _section(scan: ScanReport, key: str) -> Markup:
    blocks = [
        element("p", scan.verdict[0], class_="verdict"),
        _scene(scan, key),
        said(scan.verdict[1:], scan.cautions),
        element("h2", "Run by run"),
        _runs(scan),
        element("h2", "How the thickness is distributed"),
        element(
            "p", "Share of the area by its thickness; shaded: within 5% of the planned one.", class_="note",
        ),
        histograms(
            [(scan.name, scan.ratios[~np.isnan(scan.ratios)])], of="area",
            axis="measured thickness / planned thickness [1]",
        ),
        how_made(scan.settings, scan.inputs),
    ]  # fmt: skip
    return element("section", *blocks, id=key, class_="part", aria_label=scan.name)


def _scene(scan: ScanReport, key: str) -> Markup:
    shown = element(
        "label", "Paths of the plan ",
        element("input", type="range", name=f"{key}-layers", min=0, max=1, value=0, step=1),
        element("output", "none", class_="layers"),
    )  # fmt: skip
    controls = [
        choice(key, "backend", "Print", [("0", "as scanned")]),
        choice(key, "colour", "Colour", [("thickness", "Measured thickness")]),
        element(
            "fieldset", element("legend", "Show"), shown, element("button", "Reset view", type="button", class_="reset")
        ),
    ]
    drawn = view(
        scan.still, key=key, place=0, name=scan.name, title="as scanned", figures=scan.figures,
        label=f"3D view of {scan.name}, as scanned", mark=None,
    )  # fmt: skip
    return scene_block(key, [drawn], controls)


def _runs(scan: ScanReport) -> Markup:
    return row_table(scan.columns, scan.rows, label=f"Runs on {scan.name}")


# Lines drawn over a photograph, and below it what their colours mean.


# Longer sides of a photograph are shown with so many pixels.
MOST_SHOWN = 1600
# Grey values are pressed together, so that lines of colour stand out on white as on black.
DARKEST, LIGHTEST = 10.0, 175.0
# Of Okabe and Ito, safe for colour-blind readers.
COLOURS = {
    "middles": "#D55E00", "edges": "#56B4E9", "breaks": "#F0E442", "missing": "#CC79A7", "outline": "#009E73",
}  # fmt: skip
MEANINGS = {
    "middles": "middle", "edges": "edge", "breaks": "break of a line", "missing": "planned, not there",
    "outline": "outline of the part",
}  # fmt: skip
# Lines are wider in larger pictures: one pixel for so many.
PIXELS_A_WIDTH = 700
# Letters, over the longer side, within what can be read.
LETTER_SHARE, SMALLEST_LETTER, LARGEST_LETTER = 1.0 / 50.0, 11, 26


@final
@frozen
class Overlay:
    """What is drawn over a photograph, as lines of (k, 2) pixels (u, v) of it.

    Attributes:
        middles: of beads.
        edges: of beads.
        breaks: where a line has no material.
        missing: of the plan, where there is no material.
        outline: of the part, where the camera that it placed sees it.
    """

    middles: tuple[FloatArray, ...]
    edges: tuple[FloatArray, ...]
    breaks: tuple[FloatArray, ...]
    missing: tuple[FloatArray, ...]
    outline: tuple[FloatArray, ...]


def shown_scale(grey: FloatArray) -> float:
    """Return pixels of the picture for one of a photograph of (h, w) grey values, at most 1."""
    return min(1.0, MOST_SHOWN / max(grey.shape))


def overlay_picture(grey: FloatArray, overlay: Overlay, *, title: str) -> bytes:
    """Return a PNG: a photograph in grey with lines over it, and a legend below.

    Args:
        grey: (h, w) from 0 to 1.
        overlay: what is drawn.
        title: at the beginning of the legend.
    """
    from PIL import Image, ImageDraw

    scale = shown_scale(grey)
    pressed = Image.fromarray((DARKEST + (LIGHTEST - DARKEST) * grey).astype(np.uint8))
    shown = pressed.resize([max(1, round(scale * side)) for side in pressed.size]).convert("RGB")
    draw = ImageDraw.Draw(shown)
    wide = max(1, round(max(shown.size) / PIXELS_A_WIDTH))
    for name, thicker in (("edges", 0), ("middles", 0), ("breaks", 1), ("missing", 2), ("outline", 0)):
        lines: Sequence[FloatArray] = getattr(overlay, name)
        for line in lines:
            points = [(float(u), float(v)) for u, v in (line + 0.5) * scale - 0.5]
            if len(points) > 1:
                draw.line(points, fill=COLOURS[name], width=wide + thicker, joint="curve")
    kinds = [name for name in COLOURS if getattr(overlay, name)]
    written = io.BytesIO()
    _with_legend(shown, kinds, title=title).save(written, format="PNG", optimize=True)
    return written.getvalue()


def _with_legend(shown: Shown, kinds: Sequence[str], *, title: str) -> Shown:
    """Return a picture with a strip below it that says what colours mean, in as many lines as it takes."""
    from PIL import Image, ImageDraw, ImageFont

    letter = int(np.clip(LETTER_SHARE * max(shown.size), SMALLEST_LETTER, LARGEST_LETTER))
    font = ImageFont.load_default(size=letter)
    row, left = round(1.6 * letter), letter // 2
    placed: list[tuple[int, int, str | None, str]] = []
    x, y = left, 0
    for colour, text in ((None, title), *((COLOURS[kind], MEANINGS[kind]) for kind in kinds)):
        mark = 0 if colour is None else 2 * letter
        width = round(mark + font.getlength(text) + letter)
        if x > left and x + width > shown.width:
            x, y = left, y + row
        placed.append((x, y, colour, text))
        x += width
    full = Image.new("RGB", (shown.width, shown.height + y + row), "white")
    full.paste(shown, (0, 0))
    draw = ImageDraw.Draw(full)
    for x, y, colour, text in placed:
        top, mark = shown.height + y, 0
        if colour is not None:
            mark = 2 * letter
            draw.rectangle((x, top + 0.6 * row, x + 1.6 * letter, top + 0.6 * row + letter / 4), fill=colour)
        draw.text((x + mark, top + 0.12 * row), text, fill="black", font=font)
    return full
