"""What people look at: figures of plans and comparisons. Takes plain values, knows no stage."""

from geoprint.report.chart_figure import FlattenedPart, chart_figure
from geoprint.report.figures import Coverage, coverage_figure
from geoprint.report.inspection_figure import inspection_figure
from geoprint.report.page import html_report
from geoprint.report.paper_figures import paper_figures
from geoprint.report.switching_figure import switching_figure
from geoprint.report.values import (
    COVERED,
    GAP,
    MOST_FRAMES,
    OVERLAP,
    BackendView,
    PartReport,
    PathDistances,
    Picture,
    Replay,
    Row,
)
from geoprint.report.view_surface import ViewSurface, view_surface

__all__ = [
    "COVERED",
    "GAP",
    "MOST_FRAMES",
    "OVERLAP",
    "BackendView",
    "Coverage",
    "FlattenedPart",
    "PartReport",
    "PathDistances",
    "Picture",
    "Replay",
    "Row",
    "ViewSurface",
    "chart_figure",
    "coverage_figure",
    "html_report",
    "inspection_figure",
    "paper_figures",
    "switching_figure",
    "view_surface",
]
