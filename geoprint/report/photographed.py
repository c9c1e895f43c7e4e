"""The report of photographed prints: one HTML file with the lines drawn over each photograph, and every figure."""

from __future__ import annotations

from typing import final

from geoprint.errors import InputError
from geoprint.model import FloatArray, freeze_arrays, frozen
from geoprint.report.blocks import distance_matrix, fact_table, figure, row_table, said
from geoprint.report.histogram import histograms
from geoprint.report.markup import Markup, element, joined
from geoprint.report.page import page
from geoprint.report.values import PathDistances, Picture

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
        versions: (program, version).
    """

    verdict: str
    cautions: tuple[str, ...]
    photographs: tuple[PhotographView, ...]
    figures: RowsReport
    said: tuple[str, ...]
    distances: PathDistances | None
    settings: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]
    versions: tuple[tuple[str, str], ...]

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
        element("h2", "How it was made"),
        fact_table("Settings", report.settings),
        fact_table("Input, SHA-256", report.inputs),
        fact_table("Versions", report.versions),
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
