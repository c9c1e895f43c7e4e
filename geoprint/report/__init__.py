"""What people look at: figures of plans and comparisons. Takes plain values, knows no stage."""

from geoprint.report.chart_figure import FlattenedPart, chart_figure
from geoprint.report.figures import Coverage, coverage_figure

__all__ = ["Coverage", "FlattenedPart", "chart_figure", "coverage_figure"]
