"""Results in a script or notebook: a picture, with figures, and the report page as a view that needs no server."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias, final

from geoprint.model import frozen
from geoprint.reporting.comparison import compared_alone, comparison_report, plan_report, recorded_comparison
from geoprint.reporting.evenness import expected_text
from geoprint.reporting.figures import png_bytes
from geoprint.reporting.html import Markup, element, figure as figure_element, joined, row_table
from geoprint.reporting.measurement import measure_verdict, record_measurement
from geoprint.reporting.measurement_page import measure_figure, measure_report
from geoprint.reporting.metrics import COVERED_ONCE, GAP, OVERLAP, THICKNESS
from geoprint.reporting.pictures import comparison_pictures, figure
from geoprint.reporting.records.comparison import PartRecord
from geoprint.reporting.records.evenness import EvennessRecord
from geoprint.reporting.values import Picture
from geoprint.results import Comparison, Measurement, Plan

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Result: TypeAlias = Plan | Comparison | Measurement

# The five figures beside the picture; what a print is expected to have stands behind the first.
METRICS = (THICKNESS, COVERED_ONCE, GAP, OVERLAP)
PRINTED = "printed CV"
HINT = "`.view()` shows it in 3D, to be turned, with every figure."
# Notebooks set tables; without the first line wide pictures would be cut off.
STYLE = """
.geoprint-result img { max-width: 100%; max-height: 440px; background: #fff; }
.geoprint-result figure { margin: 0 0 8px; }
.geoprint-result th, .geoprint-result td { padding: 2px 10px; text-align: right; }
"""
VIEW_HEIGHT = 860


@final
@frozen
class NotebookView:
    """A result as a page within a notebook: it turns, replays the robot and has every figure, without a server.

    Attributes:
        page: report.html of the result, which opens in a browser too.
    """

    page: bytes

    def _repr_html_(self) -> str:
        return element(
            "iframe", srcdoc=self.page.decode("utf-8"), sandbox="allow-scripts", loading="lazy",
            style=f"width: 100%; height: {VIEW_HEIGHT}px; border: 0",
        )  # fmt: skip


def result_figure(result: Result) -> Figure:
    """Draw the paths of a result as beads coloured by the spacing to the next path.

    Raises:
        FieldError: the evenness of the paths was not measured.
    """
    return measure_figure(result) if isinstance(result, Measurement) else figure(result)


def notebook_view(result: Result) -> NotebookView:
    """Return the report page of a result as a notebook shows it."""
    if isinstance(result, Plan):
        return NotebookView(plan_report(result)[2])
    if isinstance(result, Measurement):
        return NotebookView(measure_report(result, record_measurement(result)))
    pictures = comparison_pictures(result, draw=lambda drawings: [drawing() for drawing in drawings])
    return NotebookView(comparison_report([result], recorded_comparison([result]), pictures=[pictures]))


def notebook_html(result: Result) -> str:
    """Return what a notebook shows of a result: the picture of its paths and five figures, a row each way."""
    if isinstance(result, Measurement):
        record = record_measurement(result)
        rows = [(row.file, row.uniformity) for row in record.files]
        return _html(measure_verdict(record)[0], png_bytes(result.figure()), "file", rows)
    if isinstance(result, Plan):
        if result.uniformity is None:
            return element("pre", repr(result))
        result = compared_alone(result)
    part = recorded_comparison([result]).record.parts[0] if result.planned else None
    if not isinstance(part, PartRecord):
        return joined(*(element("p", f"{name} could not plan: {reason}") for name, reason in result.refused))
    rows = [(row.backend, row.uniformity) for row in part.planned]
    return _html(part.verdict[0], png_bytes(result.figure()), "backend", rows)


def _html(said: str, png: bytes, heading: str, rows: Sequence[tuple[str, EvennessRecord]]) -> Markup:
    first, *others = METRICS
    columns = [heading, first.column, PRINTED, *(metric.column for metric in others)]
    cells = [
        [name, first.text(even), expected_text(even.printed, digits=1), *(metric.text(even) for metric in others)]
        for name, even in rows
    ]
    table = row_table(columns, cells, label="How even the paths are")
    shown = figure_element(Picture(said, "png", png)), table, element("p", HINT)
    return element("div", element("style", Markup(STYLE)), *shown, class_="geoprint-result")
