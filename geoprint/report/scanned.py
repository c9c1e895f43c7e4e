"""The report of a scanned print: one HTML file of the form of a stack's, with the thickness over the part."""

from __future__ import annotations

from typing import final

import numpy as np

from geoprint.errors import InputError
from geoprint.model import FloatArray, IntArray, Surface, freeze_arrays, frozen
from geoprint.report.blocks import choice, fact_table, row_table, said, scene_block, view
from geoprint.report.histogram import histograms
from geoprint.report.markup import Json, Markup, element
from geoprint.report.page import page
from geoprint.report.scene import numbers, step, thinned, turned, with_breaks
from geoprint.report.values import Picture

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
        versions: (program, version).
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
    versions: tuple[tuple[str, str], ...]

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
        element("h2", "How it was made"),
        fact_table("Settings", scan.settings),
        fact_table("Input, SHA-256", scan.inputs),
        fact_table("Versions", scan.versions),
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
